"""Archives as a stranger might send them: members, values, names and bytes changed.

Run by hand: ``python tests/fuzz/archives.py --count 5000 --seed 0``.
"""

import io
import json
import random
import sys
import warnings
import zipfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from campaign import Campaign, run
from stores import make_project

from forcelab.cli import main as forcelab
from forcelab.project import Project, Verdict

VALUES: tuple[Any, ...] = (
    None, True, 0, -1, 1, 0.5, 1e300, -1e300, 10**400, 2**63, float("nan"), float("inf"), "", " ",
    "..", "../../canaries/victim", "/etc/passwd", "a\0b", "\x1b[2J", "=1+1", "x" * 100_000,
    "9" * 5000, "\ud800", [], {}, [[]], [[0, 1e999, "grab"]], [["a"] * 3] * 1000, "model", "undo",
    "0001-01-01T00:00:00+00:00", "9999-12-31T23:59:59-23:59", "2026-01-01T00:00:00",
)  # fmt: skip
MEMBERS = (
    "../../canaries/victim/more.txt",
    "/more",
    "demonstrations/../../canaries/canary.mp4",
    "demonstrations/" + "0" * 32 + "/demonstration.json",
    "recognisers/" + "0" * 32 + ".skops",
    "forcelab.json",
    "more.json",
)


def places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every place in nested JSON where something else could stand."""
    keys = range(len(value)) if isinstance(value, list) else value
    for key in keys if isinstance(value, list | dict) else ():
        yield value, key
        yield from places(value[key])


def change_value(text: bytes, chance: random.Random) -> bytes:
    """Put something else somewhere into JSON, repeat it often, or leave it out."""
    value = json.loads(text)
    found = list(places(value))
    if not found:
        return json.dumps(chance.choice(VALUES)).encode("utf-8", "surrogatepass")
    place, key = chance.choice(found)
    kind = chance.random()
    if kind < 0.7:
        place[key] = chance.choice(VALUES)
    elif kind < 0.8 and isinstance(place, list):
        place *= chance.choice((2, 3, 100))
    elif kind < 0.9:
        del place[key]
    elif isinstance(place, dict):
        place[chance.choice(("more", "x" * 2000, "a\0b"))] = chance.choice(VALUES)
    # As other programs may lay it out, or as ours does.
    indent = chance.choice((None, 1))
    written = json.dumps(value, indent=indent, ensure_ascii=chance.random() < 0.5)
    return written.encode("utf-8", "surrogatepass")


def many(chance: random.Random) -> tuple[str, bytes]:
    """A member that unpacks to much, or means much."""
    name = chance.choice(("vocabularies.json", "edits.json", "verdicts.json", "runs.json"))
    action = {"name": "a{0}", "colour": "#0072b2", "key": "", "texture": 0}
    text = {
        "vocabularies.json": json.dumps(
            {"LEGO": [action | {"name": f"a{i}", "texture": i} for i in range(20_000)]}
        ),
        "edits.json": "[" + ",".join(["{}"] * 2_000_000) + "]",
        "verdicts.json": "[" + " " * 30_000_000 + "]",
        "runs.json": "[" + "[" * 200_000,
    }
    return name, text[name].encode()


def change_members(members: dict[str, bytes], chance: random.Random) -> list[tuple[str, bytes]]:
    """Other members, more of them or fewer."""
    changed = list(members.items())
    number = chance.randrange(len(changed))
    name, content = changed[number]
    kind = chance.choice(
        ("value", "value", "value", "value", "bytes", "name", "twice", "gone", "many")
    )
    if kind == "value" and name.endswith(".json"):
        with suppress(ValueError):  # spoilt already
            changed[number] = name, change_value(content, chance)
    elif kind == "name":
        changed[number] = chance.choice(MEMBERS), content
    elif kind == "twice":
        changed.append((name, content))
    elif kind == "gone":
        del changed[number]
    elif kind == "many" and chance.random() < 0.1:
        more, text = many(chance)
        changed = [(n, text if n == more else c) for n, c in changed]
    elif content:
        spoilt = bytearray(content)
        for _ in range(chance.choice((1, 1, 5))):
            first = chance.choice((128, len(spoilt)))
            spoilt[chance.randrange(min(first, len(spoilt)))] = chance.randrange(256)
        changed[number] = name, bytes(spoilt[: chance.choice((len(spoilt), len(spoilt) // 2))])
    return changed


def pack(members: list[tuple[str, bytes]], chance: random.Random) -> bytes:
    """The bytes of an archive of these members, sometimes changed themselves."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that a name is there twice
        for name, content in members:
            info = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            link = chance.random() < 0.005
            info.external_attr = (0o120777 if link else 0o644) << 16
            info.compress_type = chance.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
            archive.writestr(info, content)
    whole = bytearray(stream.getvalue())
    if chance.random() < 0.1:
        for _ in range(chance.choice((1, 1, 8))):
            whole[chance.randrange(len(whole))] = chance.randrange(256)
    return bytes(whole)


def prepare(folder: Path) -> dict[str, bytes]:
    """The members of the archive of a small project."""
    path = folder / "whole.forcelab"
    make_project(path)
    with Project.open(path) as project:
        id_ = project.demonstrations.infos()[0].id
        project.coding.add_verdict(
            Verdict(id_, 0.0, 0.05, "grab", None, author="ben", coder="anna", verdict="human")
        )
        project.coding.assign(id_, "ben", blind=True)
        project.tracks.undo(id_, "anna")
    if forcelab(["export", str(path), "--format", "archive", "--out", str(folder / "out")]):
        raise SystemExit("The archive could not be made.")
    (file,) = (folder / "out").iterdir()
    with zipfile.ZipFile(file) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def mutate(members: dict[str, bytes], place: Path, chance: random.Random) -> list[list[str]]:
    changed = change_members(members, chance)
    if chance.random() < 0.2:
        known = dict(changed)
        changed = change_members(known, chance) if known else changed
    file = place / "a.zip"
    file.write_bytes(pack(changed, chance))
    p, out = str(place / "p.forcelab"), str(place / "out")
    formats = chance.choice(("archive", "elan", "csv", "boris", "audacity"))
    looks = [["list", p, "--json"], ["agree", p], ["runs", p]] if chance.random() < 0.5 else []
    return [
        ["import", p, str(file)],
        *looks,
        ["export", p, "--format", formats, "--out", out],
        ["remove", p, "01", "--yes"],
    ]


if __name__ == "__main__":
    run(__doc__, Campaign("archive", prepare, mutate))
