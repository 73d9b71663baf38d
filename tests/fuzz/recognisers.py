"""Recogniser files as a stranger might send them: numbers, arrays, texts and bytes changed.

Run by hand: ``python tests/fuzz/recognisers.py --count 5000 --seed 0``.
"""

import copy
import io
import random
import sys
import zipfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from skops import io as skops_io

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1]))

from campaign import Campaign, run
from factories import labelled_set, synthetic_set

from forcelab.labels import Track
from forcelab.project import Project
from forcelab.recognition.classifiers import REGISTRY
from forcelab.recognition.presets import preset
from forcelab.recognition.settings import Settings
from forcelab.recognition.storage import TRUSTED, dump
from forcelab.recognition.training import train

NUMBERS: tuple[float, ...] = (
    0, 1, 2, -1, -2, 0.5, 1e-300, -1e-300, 1e-9, 1e3, 1e6, 1e9, 1e15, 1e300, -1e300, 2**31,
    2**31 - 1, -(2**31), 2**63, 2**200, float("inf"), float("-inf"), float("nan"),
)  # fmt: skip
OTHERS: tuple[Any, ...] = (None, True, "", "x", "x" * 100_000, [], {}, [0], ["x"], {"x": 1}, b"x")

Spot = tuple[Any, Any]


def recognisers() -> list[bytes]:
    """One file of each kind of classifier, and of the presets with decoder and windows."""
    labelled = labelled_set(2, rate=100.0)
    small = Settings(max_scale=32.0, stride=6)
    settings = [small.replace(classifier=name) for name in REGISTRY]
    settings += [preset("fast").replace(stride=6), preset("best").replace(stride=12)]
    windows = preset("fast").replace(calibrated=True, changes=False, decoder="filters")
    settings += [windows.replace(classifier=name) for name in REGISTRY]
    return [dump(train(labelled, setting)) for setting in settings]


def spots(value: Any) -> Iterator[Spot]:
    """Every place in nested values where something else could stand."""
    if isinstance(value, dict):
        yield from ((value, key) for key in value)
        for inner in value.values():
            yield from spots(inner)
    elif isinstance(value, list):
        yield from ((value, number) for number in range(len(value)))
        for inner in value:
            yield from spots(inner)
    elif isinstance(value, np.ndarray):
        if value.size:
            yield value, None
    elif hasattr(value, "__dict__"):
        yield from spots(vars(value))


def change_array(array: np.ndarray, chance: random.Random) -> np.ndarray:
    """Other numbers, another shape or another type."""
    changed = array.copy()
    kind = chance.choice(("one", "one", "all", "shape", "type", "cut"))
    if kind in ("one", "all"):
        fields = changed.dtype.names
        part = changed[chance.choice(fields)] if fields else changed
        number = chance.choice(NUMBERS)
        where = np.unravel_index(chance.randrange(part.size), part.shape) if kind == "one" else ...
        with np.errstate(all="ignore"):
            try:
                part[where] = number
            except (OverflowError, ValueError, TypeError):
                part[where] = part.dtype.type(chance.choice((0, 1, 127)))
    elif kind == "shape":
        changed = changed.reshape(chance.choice(((-1,), (1, -1), (-1, 1), (1, 1, -1))))
    elif kind == "type" and changed.dtype.names is None and changed.dtype != object:
        other = chance.choice((np.float32, np.complex128, np.int8, np.int64, np.bool_, np.str_))
        with np.errstate(all="ignore"):
            changed = changed.astype(other)
    elif kind == "cut":
        changed = changed[: chance.randrange(len(changed))] if changed.ndim else changed[None]
    return changed


def change_content(content: Any, chance: random.Random) -> None:
    """Put something else somewhere, mostly another number where one was."""
    everywhere = list(spots(content))
    numbers = [
        (place, key)
        for place, key in everywhere
        if key is not None and isinstance(place[key], int | float)
    ]
    place, key = chance.choice(numbers if numbers and chance.random() < 0.4 else everywhere)
    if key is None:  # an array alone: changed in place, so far as its shape allows
        other = change_array(place, chance)
        if other.shape == place.shape and other.dtype == place.dtype:
            place[...] = other
        return
    old = place[key]
    if isinstance(old, np.ndarray) and old.size and chance.random() < 0.9:
        place[key] = change_array(old, chance)
    elif chance.random() < 0.1 and isinstance(place, dict):
        del place[key]
    elif isinstance(old, int | float) and chance.random() < 0.85:
        place[key] = chance.choice(NUMBERS)
    else:
        place[key] = chance.choice((*OTHERS, *NUMBERS))


def change_bytes(whole: bytes, chance: random.Random) -> bytes:
    """Change bytes of one part of the file, whose checksums are right again; or its own bytes."""
    if chance.random() < 0.3:
        content = bytearray(whole)
        for _ in range(chance.choice((1, 1, 8))):
            content[chance.randrange(len(content))] = chance.randrange(256)
        return bytes(content[: chance.choice((len(content), chance.randrange(len(content))))])
    written = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(whole)) as old, zipfile.ZipFile(written, "w") as new:
        names = old.namelist()
        hit = chance.choice(("schema.json", chance.choice(names)))
        for name in names:
            part = bytearray(old.read(name))
            if name == hit and part:
                for _ in range(chance.choice((1, 1, 3))):
                    first = chance.choice((128, len(part)))
                    part[chance.randrange(min(first, len(part)))] = chance.randrange(256)
            new.writestr(name, bytes(part))
    return written.getvalue()


def prepare(folder: Path) -> tuple[list[bytes], list[Any], Path]:
    """Files of small recognisers, what is in them, and a project to recognise."""
    path = folder / "whole.forcelab"
    with Project.create(path) as project:
        for demonstration, segments in synthetic_set(1, rate=100.0):
            project.demonstrations.add(demonstration, [Track("Ann", segments)])
    # Elsewhere: a child that is forked after OpenMP began here would wait for its threads for ever.
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        files = pool.submit(recognisers).result()
    return files, [skops_io.loads(file, trusted=list(TRUSTED)) for file in files], path


def mutate(
    whole: tuple[list[bytes], list[Any], Path], place: Path, chance: random.Random
) -> list[list[str]]:
    files, contents, project = whole
    which = chance.randrange(len(files))
    changed = None
    if chance.random() < 0.8:
        content = copy.deepcopy(contents[which])
        for _ in range(chance.choice((1, 1, 1, 2))):
            change_content(content, chance)
        with suppress(TypeError, ValueError, AttributeError, OverflowError):
            changed = skops_io.dumps(content)  # unless skops cannot write that either
    file = place / "a.recogniser"
    file.write_bytes(change_bytes(files[which], chance) if changed is None else changed)
    labels = ["predict", str(file), str(project)]
    return [labels, ["plan", str(project), "foam 01", "--recogniser", str(file)]]


if __name__ == "__main__":
    run(__doc__, Campaign("recogniser", prepare, mutate))
