"""What a LeRobot dataset says of itself, and its frames, looked up where they are needed."""

from __future__ import annotations

import json
import math
import os
import re
from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.extras import load_extra
from forcelab.formats.signatures import LEROBOT_INFO, lerobot_folder, naming_damage
from forcelab.formats.timestamps import RawTimestamps, RepairedTimestamps, repair_timestamps
from forcelab.io import small_text
from forcelab.text import counted

VERSIONS: Final = ("v2.0", "v2.1", "v3.0")
SUBTASK: Final = "subtask_index"
SUBTASKS_FILE: Final = "meta/subtasks.parquet"
#: Features that say which frame it is, and are no signals.
_PLACES: Final = ("timestamp", "frame_index", "episode_index", "index", "task_index", SUBTASK)
#: What tells in which file of data or video an episode lies (v3), and where in the video.
_FILE_PLACES, _EDGES = ("chunk_index", "file_index"), ("from_timestamp", "to_timestamp")
_NUMBER: Final = re.compile(r"float(16|32|64)|u?int(8|16|32|64)|bool")
#: Numbers a frame of a feature at most; more are a cloud of points.
_MOST_NUMBERS: Final = 1000
#: Stamps from here on (s) are no times; sums of them would overflow.
_ABSURD: Final = 1e30
_LONGEST: Final = 200  #: characters of the name of a feature
_MOST_EPISODES, _MOST_BYTES = 10_000_000, 1 << 28


@dataclass(frozen=True, slots=True)
class Column:
    """One number of a frame, by the name of its channel."""

    name: str
    feature: str
    place: int  #: in the feature's vector


@dataclass(frozen=True, slots=True)
class Stretch:
    """Where an episode lies in a video, in seconds; to its end where that is not known."""

    file: Path
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class Episode:
    """Where an episode lies."""

    number: int
    length: int  #: frames
    file: Path
    videos: Mapping[str, Stretch]  #: by camera, where these are not pictures beside the numbers


class Dataset:
    """A dataset; what is wrong with any of its files is an :class:`InputError`."""

    def __init__(self, path: Path) -> None:
        self.path = Path(os.path.abspath(lerobot_folder(path)))  # noqa: PTH100 - links keep their names
        load_extra("pyarrow", "lerobot", f"'{path}' is a LeRobot dataset, which")
        self.info = _read_info(self.path)
        self.v3 = self.info["codebase_version"].startswith("v3")
        #: By feature of numbers, the names of its numbers.
        self.numbers: dict[str, tuple[str, ...]] = {}
        self.cameras: list[str] = []
        self.pictures: set[str] = set()  #: cameras whose pictures lie beside the numbers
        self.unread: list[str] = []  #: features that are none of these
        for name, feature in self.info["features"].items():
            size = math.prod(feature["shape"])
            if feature["dtype"] in ("video", "image"):
                self.cameras.append(name)
                if feature["dtype"] == "image":
                    self.pictures.add(name)
            elif not _NUMBER.fullmatch(feature["dtype"]) or size > _MOST_NUMBERS:
                self.unread.append(name)
            elif name not in _PLACES:
                self.numbers[name] = _names(name, feature.get("names"), size)
        own_names = Counter(part for parts in self.numbers.values() for part in parts)
        #: By name of the channel, which does not depend on which others are read.
        self.columns: dict[str, Column] = {}
        for feature_name, parts in self.numbers.items():
            for place, part in enumerate(parts):
                name = part if own_names[part] == 1 else f"{feature_name}.{part}"
                if name in self.columns:
                    raise InputError(
                        f"'{path}' calls two numbers '{name}'; rename one in its info."
                    )
                self.columns[name] = Column(name, feature_name, place)

    @property
    def video_cameras(self) -> list[str]:
        return [camera for camera in self.cameras if camera not in self.pictures]

    @cached_property
    def episodes(self) -> tuple[Episode, ...]:
        """All episodes by number; opens no file of data."""
        rows = _episode_rows(self) if self.v3 else _lines(self.path / "meta/episodes.jsonl")
        episodes = sorted((self._episode(row) for row in rows), key=lambda each: each.number)
        numbers = [episode.number for episode in episodes]
        if not episodes or len(set(numbers)) < len(numbers):
            what = "names an episode twice" if episodes else "has no episode"
            raise InputError(f"'{self.path}' {what}; record it again, or mend its meta folder.")
        return tuple(episodes)

    def _episode(self, row: Mapping[str, Any]) -> Episode:
        number, length = _whole(row, "episode_index"), _whole(row, "length")
        places = {"episode_index": number, "episode_chunk": 0}
        if self.v3:
            places |= {name: _whole(row, f"data/{name}") for name in _FILE_PLACES}
        else:
            places["episode_chunk"] = number // _whole(self.info, "chunks_size", least=1)
        file = _fill_path(self.path, self.info["data_path"], places)
        videos = {}
        for camera in self.video_cameras:
            start, end = 0.0, math.inf
            of_video: dict[str, object] = {**places, "video_key": camera}
            if self.v3:
                field = f"videos/{camera}"
                of_video |= {name: _whole(row, f"{field}/{name}") for name in _FILE_PLACES}
                start, end = (_seconds(row, f"{field}/{name}") for name in _EDGES)
            video = _fill_path(self.path, str(self.info.get("video_path")), of_video)
            videos[camera] = Stretch(video, start, end)
        return Episode(number, length, file, videos)

    @cached_property
    def tasks(self) -> Mapping[int, str]:
        """The sentence of each task."""
        if self.v3:
            return dict(enumerate(_texts(self.path / "meta/tasks.parquet", "task")))
        lines = _lines(self.path / "meta/tasks.jsonl")
        return {_whole(line, "task_index"): str(line.get("task")) for line in lines}

    @cached_property
    def subtasks(self) -> list[str]:
        """The name of each subtask, in the order that its index counts; empty without any."""
        file = self.path / SUBTASKS_FILE
        return _texts(file, "subtask") if file.exists() else []

    def frames(
        self, episodes: Sequence[Episode], features: Collection[str]
    ) -> Iterator[tuple[Episode, Any]]:
        """Tables of features of some episodes, with which frame it is; each file is read once."""
        import pyarrow as pa
        import pyarrow.compute as pc

        by_file: dict[Path, dict[int, Episode]] = defaultdict(dict)
        for episode in episodes:
            by_file[episode.file][episode.number] = episode
        for file, requested in by_file.items():
            parts: dict[int, list[Any]] = {number: [] for number in requested}
            numbers = sorted(requested)
            with open_parquet(file) as parquet:
                present = set(parquet.schema_arrow.names)
                needed = [*_PLACES[:3], "task_index", *features]
                if missing := [name for name in needed if name not in present]:
                    raise InputError(f"'{file}' lacks '{missing[0]}'; copy the dataset again.")
                columns = needed + ([SUBTASK] if SUBTASK in present and self.subtasks else [])
                for group in range(parquet.num_row_groups):
                    if not _may_hold(parquet, group, numbers):
                        continue
                    table = parquet.read_row_group(group, columns=columns)
                    for number in pc.unique(table["episode_index"]).to_pylist():
                        if number in requested:
                            rows = pc.equal(table["episode_index"], number)
                            parts[number].append(table.filter(rows))
                for number, episode in requested.items():
                    frames = pa.concat_tables(parts.pop(number)) if parts[number] else ()
                    if len(frames) != episode.length:
                        raise InputError(
                            f"'{file}' holds {counted(len(frames), 'frame')} of episode {number}, "
                            f"which should have {episode.length:,}; copy the dataset again."
                        )
                    yield episode, frames

    def times(self, episode: Episode, table: Any, *, strict: bool = False) -> RepairedTimestamps:
        """When each frame was; stamps that were rounded to 32 bits get their digits back."""
        stamps = _matrix(table["timestamp"], 1, "timestamp")[:, 0]
        stamps = np.where(np.abs(stamps) < _ABSURD, stamps, np.nan)
        even = _matrix(table["frame_index"], 1, "frame_index")[:, 0] / self.info["fps"]
        with np.errstate(over="ignore"):
            if np.array_equal(even.astype(np.float32), stamps.astype(np.float32)):
                stamps = even
        where = f"'{self.path}', episode {episode.number}"
        lines = np.arange(len(stamps))
        raw = RawTimestamps(stamps)
        return repair_timestamps(raw, lines, where, strict=strict, row="frame", line="frame")

    def frame_times(self, table: Any, repaired: RepairedTimestamps) -> NDArray[np.float64]:
        """The time of every frame, also of those that were dropped; NaN where it has no stamp."""
        times = _matrix(table["timestamp"], 1, "timestamp")[:, 0] - repaired.start
        times[repaired.rows] = repaired.times
        return times

    def values(self, table: Any, feature: str) -> NDArray[np.float64]:
        """The numbers of a feature in all frames, shape (n, size)."""
        return _matrix(table[feature], len(self.numbers[feature]), feature)

    def signals(self, table: Any, columns: Sequence[Column]) -> NDArray[np.float64]:
        """The columns of all frames, shape (n, c)."""
        features = dict.fromkeys(column.feature for column in columns)
        values = {feature: self.values(table, feature) for feature in features}
        return np.stack([values[c.feature][:, c.place] for c in columns], axis=1)

    def whole_numbers(self, table: Any, name: str) -> NDArray[np.int64]:
        """An index of each frame, -1 where it has none."""
        values = _matrix(table[name], 1, name)[:, 0]
        usable = (np.abs(values) < 2**31) & (values == np.floor(values))
        return np.where(usable, values, -1).astype(np.int64)


def stated_episodes(path: Path) -> str:
    """How many episodes a dataset says that it has; empty where it does not say."""
    try:
        count = _read_info(lerobot_folder(path)).get("total_episodes")
    except (InputError, OSError):
        return ""  # what is wrong is told when it is read
    return f"{count:,}" if isinstance(count, int) else ""


def _read_info(path: Path) -> dict[str, Any]:
    """``meta/info.json``, with all that is used of it checked."""
    file = path / LEROBOT_INFO
    if not file.is_file():
        raise InputError(f"'{path}' is no LeRobot dataset: it has no {LEROBOT_INFO}.")
    try:
        info = json.loads(small_text(file))
        version, features = info["codebase_version"], info["features"]
        fps, shapes = info["fps"], [feature["shape"] for feature in features.values()]
        sizes = [size for shape in shapes for size in shape]
        sound = (
            all(isinstance(feature["dtype"], str) for feature in features.values())
            and all(type(size) is int and 0 < size < 2**31 for size in sizes)
            and all(isinstance(shape, list) and 0 < len(shape) < 9 for shape in shapes)
            and type(fps) in (int, float)
            and 0 < fps < 1e9
            and all(0 < len(name) <= _LONGEST for name in features)
            and all(isinstance(text, str) for text in (version, info["data_path"]))
        )
    except json.JSONDecodeError as error:
        raise InputError(f"'{file}' is not whole JSON ({error}); copy it again.") from error
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(f"'{file}' does not describe a dataset; copy it again.") from error
    if not sound:
        raise InputError(f"'{file}' contradicts itself; copy it again.")
    if version not in VERSIONS:
        raise InputError(
            f"'{path}' is a LeRobot dataset of version {version[:20]}, and {', '.join(VERSIONS)} "
            f"can be read; convert it with their scripts."
        )
    return dict(info)


def _names(feature: str, names: Any, size: int) -> tuple[str, ...]:
    """What the numbers of a feature are called, numbered where it does not say."""
    if isinstance(names, dict):
        parts = list(names.values())
        if all(isinstance(part, list) for part in parts):
            names = [name for part in parts for name in part]
        elif sorted(map(str, parts)) == sorted(map(str, range(len(parts)))):
            names = sorted(names, key=lambda name: int(names[name]))
    texts = [name for name in names if isinstance(name, str)] if isinstance(names, list) else []
    given = tuple(" ".join(name.split()) for name in texts)
    if size == 1:
        return (feature,)
    if len(given) == len(set(given)) == size and all(given):
        return given
    return tuple(f"{feature}.{place}" for place in range(size))


def _fill_path(folder: Path, template: str, places: Mapping[str, object]) -> Path:
    """The path that a template such as ``data/chunk-{chunk_index:03d}`` gives, in the folder."""

    def fill(match: re.Match[str]) -> str:
        value = places.get(match[1], "..")  # refused below
        return f"{value:0{int(match[2] or 1)}d}" if isinstance(value, int) else str(value)

    text = re.sub(r"\{(\w+)(?::0?(\d)d)?\}", fill, template)
    parts = PurePosixPath(text).parts
    if not parts or {"..", "/"} & set(parts) or re.search(r"[{}\\:\0]", text):
        raise InputError(
            f"'{folder}' keeps files outside of its folder ('{template}'), which are not opened; "
            f"mend {LEROBOT_INFO}."
        )
    return folder.joinpath(*parts)


def _whole(row: Mapping[str, Any], name: str, least: int = 0) -> int:
    """A whole number in a row of metadata."""
    value = row.get(name)
    if type(value) is not int or not least <= value < 2**40:
        raise InputError(f"Its metadata has no whole number '{name}' ({value!r:.40}); mend it.")
    return value


def _seconds(row: Mapping[str, Any], name: str) -> float:
    """A time in a row of metadata."""
    value = row.get(name)
    if not isinstance(value, float) or not 0 <= value < 1e9:
        raise InputError(f"Its metadata has no time '{name}' ({value!r:.40}); mend it.")
    return value


def _lines(file: Path) -> list[dict[str, Any]]:
    """The objects in a file of JSON lines."""
    try:
        with file.open("rb") as stream:
            content = stream.read(_MOST_BYTES)
        rows = [json.loads(line) for line in content.splitlines() if line.strip()]
    except FileNotFoundError as error:
        raise InputError(f"'{file}' is missing; copy the dataset again.") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"'{file}' holds other than lines of JSON; copy it again.") from error
    if not all(isinstance(row, dict) for row in rows):
        raise InputError(f"'{file}' holds other than objects of JSON; copy it again.")
    return rows


def _episode_rows(dataset: Dataset) -> Iterator[dict[str, Any]]:
    """Rows of the tables of episodes, without the statistics, which are most of them."""
    columns = ["episode_index", "length", *(f"data/{name}" for name in _FILE_PLACES)]
    for camera in dataset.video_cameras:
        columns += [f"videos/{camera}/{name}" for name in (*_FILE_PLACES, *_EDGES)]
    total = 0
    for file in sorted((dataset.path / "meta/episodes").glob("*/*.parquet")):
        with open_parquet(file) as parquet:
            total += parquet.metadata.num_rows
            if total > _MOST_EPISODES:
                raise InputError(
                    f"'{file}' has {total:,} episodes, which cannot be; copy it again."
                )
            yield from parquet.read(columns=columns).to_pylist()


def _texts(file: Path, name: str) -> list[str]:
    """The texts of a table as pandas writes it: its column of that name, or its index."""
    with open_parquet(file) as parquet:
        table = parquet.read()
        texts = [n for n in (name, "__index_level_0__") if n in table.column_names]
        if not texts or len(table) > _MOST_EPISODES:
            raise InputError(f"'{file}' has no texts of {name}s; copy the dataset again.")
        return [str(text or "") for text in table[texts[0]].to_pylist()]


@contextmanager
def open_parquet(file: Path) -> Iterator[Any]:
    """A Parquet file; what the library says of one that it cannot read becomes a sentence."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    if not file.is_file():
        raise InputError(f"'{file}' is missing; copy or download the dataset again.")
    cure = "copy or download it again"
    with (
        naming_damage(file, "Parquet file", cure, pa.ArrowException),
        pq.ParquetFile(file) as parquet,
    ):
        names = parquet.schema_arrow.names
        if len(set(names)) < len(names):
            raise ValueError("two columns of one name")
        yield parquet


def _may_hold(parquet: Any, group: int, numbers: Sequence[int]) -> bool:
    """Whether a row group holds frames of some episodes, rising, as far as its statistics tell."""
    place = parquet.metadata.schema.names.index("episode_index")
    statistics = parquet.metadata.row_group(group).column(place).statistics
    if statistics is None or not statistics.has_min_max:
        return True
    place = bisect_left(numbers, statistics.min)
    return place < len(numbers) and bool(numbers[place] <= statistics.max)


def _matrix(column: Any, size: int, name: str) -> NDArray[np.float64]:
    """A column of numbers or of lists of `size` numbers as floats, shape (n, size)."""
    import pyarrow as pa

    kinds = pa.types
    rows, values = len(column), column.combine_chunks()
    while any(
        is_kind(values.type)
        for is_kind in (kinds.is_list, kinds.is_large_list, kinds.is_fixed_size_list)
    ):
        values = values.flatten()
    if kinds.is_boolean(values.type):
        values = values.cast(pa.uint8())
    if len(values) != rows * size or not (
        kinds.is_integer(values.type) or kinds.is_floating(values.type)
    ):
        raise InputError(
            f"'{name}' does not hold {counted(size, 'number')} a frame as the dataset says; copy "
            f"the dataset again."
        )
    numbers = np.asarray(values.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False))
    return numbers.reshape(rows, size)
