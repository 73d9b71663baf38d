"""Labels as the subtasks of a LeRobot dataset: a number for each frame, and a table of their names.

The dataset is written anew beside the old one and takes its place at once; what does not change is
the same file in both. A demonstration is the episode whose samples it has.
"""

from __future__ import annotations

import json
import os
import shutil
from collections import defaultdict
from collections.abc import Generator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.formats.lerobot import source_text
from forcelab.formats.lerobot_dataset import (
    SUBTASK,
    SUBTASKS_FILE,
    Dataset,
    Episode,
    open_parquet,
)
from forcelab.formats.signatures import LEROBOT_INFO
from forcelab.formats.table_columns import is_unlabelled
from forcelab.jobs import Progress
from forcelab.labels import Segments, to_codes
from forcelab.project import DemonstrationInfo
from forcelab.project.files import file_errors, replacing_folder, write_bytes

#: The subtask of frames without a label. Their loader looks every number up, and takes -1 for the
#: last one.
_UNLABELLED: Final = "unlabelled"


def writing_subtasks(
    path: Path, labelled: Sequence[tuple[DemonstrationInfo, Segments]], strict: bool
) -> Generator[Progress, None, tuple[Path, ...]]:
    """Write labels into the dataset whose episodes were labelled; gives the files that changed.

    Other episodes keep their subtasks, or get that of frames without a label. A demonstration that
    came from the dataset, or any if `strict`, is refused where none of its episodes is the same.
    """
    with file_errors(f"'{path}' was not changed"):
        dataset = Dataset(path)
        found = yield from _matching(dataset, labelled, strict)
    names, named = list(dataset.subtasks), len(dataset.subtasks)
    if not any(map(is_unlabelled, names)):
        names.append(_UNLABELLED)
    used = dict.fromkeys(s.action for segments, _ in found.values() for s in segments)
    names += [action for action in used if action not in names]
    unlabelled = next(number for number, name in enumerate(names) if is_unlabelled(name))
    codes = {number: _codes(*labels, names, unlabelled) for number, labels in found.items()}
    changed = []
    with (
        file_errors(f"'{dataset.path}' was not changed"),
        replacing_folder(dataset.path.resolve()) as new,
    ):
        present = (dataset.path / "data").glob("*/*.parquet")  # those their loader reads
        files = sorted({*present, *(episode.file for episode in dataset.episodes)})
        targets = {file: new / file.relative_to(dataset.path) for file in files}
        _refuse_linked_folders(new, [*targets.values(), new / SUBTASKS_FILE])
        for done, file in enumerate(files):
            yield Progress(done, len(files), f"writing {file.name}")
            if _write_data(file, targets[file], codes, unlabelled, named):
                changed.append(file)
        for name, content in ((SUBTASKS_FILE, _names_table(names)), (LEROBOT_INFO, _info(dataset))):
            (new / name).unlink(missing_ok=True)
            write_bytes(new / name, content)
            changed.append(dataset.path / name)
        for file in filter(Path.exists, changed):
            shutil.copymode(file, new / file.relative_to(dataset.path))
    return tuple(changed)


def _refuse_linked_folders(new: Path, targets: Sequence[Path]) -> None:
    """Refuse to write through a link to a folder, which leads out of the new dataset."""
    root = new.resolve()
    for target in targets:
        if not target.parent.resolve().is_relative_to(root):
            raise InputError(
                f"'{target.parent.relative_to(new)}' is, or lies in, a link to a folder elsewhere, "
                f"which would be changed in place; put the folder itself there, or copy the "
                f"dataset with what its links lead to (cp -rL)."
            )


def _matching(
    dataset: Dataset, labelled: Sequence[tuple[DemonstrationInfo, Segments]], strict: bool
) -> Generator[Progress, None, dict[int, tuple[Segments, NDArray[np.float64]]]]:
    """The labels of each episode that was labelled, and the times of all its frames."""
    groups: dict[tuple[str, ...], dict[str, Segments]] = defaultdict(dict)
    for info, segments in labelled:
        names = tuple(channel.name for channel in info.channels)
        if all(name in dataset.columns for name in names):
            groups[names][info.id] = segments
    counts = {info.samples for info, _ in labelled}
    features = {dataset.columns[name].feature for names in groups for name in names}
    found, missing = {}, {info.id: info for info, _ in labelled}
    for episodes in _likely_first(dataset, labelled):
        if not missing:
            break
        for done, (episode, table) in enumerate(dataset.frames(episodes, sorted(features))):
            if done % 100 == 0:
                yield Progress(done, len(episodes), f"looking through {dataset.path.name}")
            times = dataset.times(episode, table)
            for names, segments_of in groups.items() if len(times.times) in counts else ():
                signals = dataset.signals(table, [dataset.columns[name] for name in names])
                channels = tuple(Channel(name) for name in names)
                read = Demonstration("-", "", times.times, signals[times.rows], channels)
                if read.id in segments_of:
                    missing.pop(read.id, None)
                    found[episode.number] = segments_of[read.id], dataset.frame_times(table, times)
    _refuse_missing(dataset, list(missing.values()), strict)
    if not found:
        raise InputError(
            f"Nothing that was labelled is an episode of '{dataset.path}'; import it and label its "
            f"episodes, or name another dataset."
        )
    return found


def _likely_first(
    dataset: Dataset, labelled: Sequence[tuple[DemonstrationInfo, Segments]]
) -> tuple[list[Episode], list[Episode]]:
    """The episodes that demonstrations were imported as, and all others."""
    ends = {info.source.rpartition(", ")[2] for info, _ in labelled}
    parts: tuple[list[Episode], list[Episode]] = ([], [])
    for episode in dataset.episodes:
        parts[f"episode {episode.number}" not in ends].append(episode)
    return parts


def _refuse_missing(dataset: Dataset, missing: Sequence[DemonstrationInfo], strict: bool) -> None:
    """Refuse demonstrations that should be episodes of the dataset and are not."""
    prefix = source_text(dataset.path, None)
    for info in missing:
        if info.source.startswith(prefix):
            raise InputError(
                f"'{info.name}' was imported as {info.source}, and no episode of '{dataset.path}' "
                f"has its samples any more; import the dataset again and label that."
            )
        if strict:
            raise InputError(
                f"'{info.name}' is no episode of '{dataset.path}'; choose only demonstrations that "
                f"were imported from it."
            )


def _codes(
    segments: Segments, times: NDArray[np.float64], names: Sequence[str], unlabelled: int
) -> NDArray[np.int64]:
    """The number of each frame's label, `unlabelled` without one; frames may come in any order."""
    order = np.argsort(times, kind="stable")  # those without a time come last
    codes = np.empty(len(times), np.int64)
    codes[order] = to_codes(segments, times[order], names)
    return np.where(codes < 0, unlabelled, codes)


def _write_data(
    file: Path, target: Path, codes: Mapping[int, NDArray[np.int64]], unlabelled: int, named: int
) -> bool:
    """Write a file of frames with each one's subtask, unless it has those.

    In the old file numbers below `named` have names.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    with open_parquet(file) as parquet:
        schema = parquet.schema_arrow
        index = schema.get_field_index(SUBTASK)
        indices = parquet.read(columns=["episode_index", *[SUBTASK][: index + 1]])
        episodes = indices["episode_index"].to_numpy()
        old = indices[SUBTASK].to_numpy() if index >= 0 else np.full(len(episodes), -1)
        # A number that had no name shall not get that of another subtask.
        values = np.where((old >= 0) & (old < named), old, unlabelled).astype(np.int64)
        order = np.argsort(episodes, kind="stable")
        numbers, starts = np.unique(episodes[order], return_index=True)
        for number, rows in zip(numbers.tolist(), np.split(order, starts[1:]), strict=True):
            if number in codes:
                values[rows] = codes[number]
        if index >= 0 and np.array_equal(values, old):
            return False
        field_ = pa.field(SUBTASK, pa.int64())
        schema = schema.append(field_) if index < 0 else schema.set(index, field_)
        schema = schema.with_metadata(_with_feature(schema.metadata or {}))
        target.unlink()  # it is the same file as the old one
        with target.open("xb") as stream:
            groups = parquet.metadata.num_row_groups
            kind = parquet.metadata.row_group(0).column(0).compression if groups else "SNAPPY"
            packing = "none" if kind == "UNCOMPRESSED" else kind
            with pq.ParquetWriter(stream, schema, compression=packing) as writer:
                start = 0
                for group in range(groups):
                    table = parquet.read_row_group(group)
                    column = pa.array(values[start : start + len(table)], pa.int64())
                    start += len(table)
                    if index < 0:
                        table = table.append_column(field_, column)
                    else:
                        table = table.set_column(index, field_, column)
                    table = table.replace_schema_metadata(schema.metadata)
                    writer.write_table(table, row_group_size=max(1, len(table)))
            stream.flush()
            os.fsync(stream.fileno())
    return True


def _with_feature(metadata: Mapping[bytes, bytes]) -> dict[bytes, bytes]:
    """What their library says of a file's columns, with the subtask where it says anything."""
    try:
        description = json.loads(metadata[b"huggingface"])
        description["info"]["features"][SUBTASK] = {"dtype": "int64", "_type": "Value"}
    except (KeyError, ValueError, TypeError):
        return dict(metadata)
    return {**metadata, b"huggingface": json.dumps(description).encode()}


def _names_table(names: Sequence[str]) -> bytes:
    """The table of subtasks as pandas writes it, whose index their loader takes the names from."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.table({SUBTASK: pa.array(range(len(names)), pa.int64()), "subtask": list(names)})
    text = {"name": "subtask", "field_name": "subtask", "pandas_type": "unicode"}
    number = {"name": SUBTASK, "field_name": SUBTASK, "pandas_type": "int64"}
    pandas: dict[str, Any] = {
        "index_columns": ["subtask"],
        "column_indexes": [],
        "columns": [
            {**number, "numpy_type": "int64", "metadata": None},
            {**text, "numpy_type": "object", "metadata": None},
        ],
        "pandas_version": "2.0.0",
    }
    sink = pa.BufferOutputStream()
    pq.write_table(table.replace_schema_metadata({b"pandas": json.dumps(pandas).encode()}), sink)
    return sink.getvalue().to_pybytes()


def _info(dataset: Dataset) -> bytes:
    """What the dataset says of itself, with the feature."""
    features = dict(dataset.info["features"])
    features.setdefault(SUBTASK, {"dtype": "int64", "shape": [1], "names": None})
    text = json.dumps({**dataset.info, "features": features}, indent=4, ensure_ascii=False)
    return text.encode("utf-8", "surrogatepass")
