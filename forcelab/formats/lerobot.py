"""LeRobot datasets (v2.0, v2.1, v3.0): folders of Parquet and MP4 files, read episode by episode.

Forces are channels where a feature is called like one or holds a 3-axis sensor, else all that is
observed. The sentence of the task is the demonstration's task, and subtasks are labels. Of a
camera's video the stretch that shows an episode is cut out as it is.
"""

from __future__ import annotations

import re
import tempfile
from collections import Counter
from collections.abc import Collection, Generator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Final

import numpy as np

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.formats.fields import values_within
from forcelab.formats.lerobot_dataset import SUBTASK, SUBTASKS_FILE, Column, Dataset, Episode
from forcelab.formats.recording import ColumnUse, ReadOptions, Recording
from forcelab.formats.signatures import is_lerobot_folder, lerobot_folder
from forcelab.formats.table_columns import is_unlabelled, missing_remark
from forcelab.formats.timestamps import RepairedTimestamps
from forcelab.jobs import Progress
from forcelab.labels import UNLABELLED, Track, from_codes
from forcelab.project.files import file_errors
from forcelab.signals.channels import channel_map
from forcelab.text import counted, listed
from forcelab.video.cut import cut_video
from forcelab.video.pictures import PictureError, PictureVideo, read_picture

#: Author of the labels in a dataset, which does not say who made them.
DATASET: Final = "dataset"
#: Words in the name of a feature of forces.
_FORCES: Final = frozenset(["force", "forces", "wrench", "torque", "torques", "ft", "effort"])
#: Episodes that are read without being chosen by number; with cameras they take a minute.
MOST_UNASKED: Final = 1000


def sniff(path: Path, head: bytes) -> bool:
    """Whether a folder is a dataset, or a file the ``meta/info.json`` of one (`head`)."""
    return is_lerobot_folder(lerobot_folder(path)) and b'"codebase_version"' in head


def read(path: Path, options: ReadOptions) -> Generator[Progress, None, list[Recording]]:
    """Read the chosen episodes of a dataset; its ``meta/info.json`` stands for the folder."""
    dataset = Dataset(path)
    columns, cameras = choose_features(dataset, options)
    features = list(dict.fromkeys(column.feature for column in columns))
    if not columns:
        raise InputError(
            f"'{dataset.path}' has no numbers to read but what is left out; name a feature as a "
            f"signal (--signal)."
        )
    shared = _remarks(dataset, features)
    recordings: list[Recording] = []
    chosen = _chosen(dataset, options)
    pictures = [camera for camera in cameras if camera in dataset.pictures and options.unpack]
    for episode, table in dataset.frames(chosen, features + pictures):
        yield Progress(len(recordings), len(chosen), f"reading {dataset.path.name}")
        times = dataset.times(episode, table, strict=options.strict)
        channels = tuple(Channel(column.name) for column in columns)
        signals = dataset.signals(table, columns)[times.rows]
        tasks = Counter(dataset.whole_numbers(table, "task_index").tolist()).most_common(2)
        track, remarks = _labels(dataset, table, times)
        if len(tasks) > 1:
            remarks.append("Several tasks are shown; the one of most frames is kept.")
        videos, video_remarks = _videos(dataset, episode, table, cameras, times, options)
        demonstration = Demonstration(
            f"{dataset.path.name}-{episode.number}",
            options.task or " ".join(dataset.tasks.get(tasks[0][0], "").split()),
            times.times,
            signals,
            channels,
            videos,
            grid_rate=options.rate,
        )
        recordings.append(
            Recording(
                demonstration,
                track,
                (
                    *shared,
                    *times.remarks,
                    *remarks,
                    *missing_remark(signals, channels),
                    *video_remarks,
                ),
                source=source_text(dataset.path, episode.number),
            )
        )
    return recordings


def source_text(folder: Path, number: int | None) -> str:
    """Where an episode comes from; without a number, how it begins for all of a dataset."""
    return f"{folder.name}, episode {'' if number is None else number}"


def preview(path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """What the features of a dataset would be read as, by the first frame of its first episode."""
    dataset = Dataset(path)
    columns, cameras = choose_features(dataset, options)
    read_features = {column.feature for column in columns}
    episode, table = next(dataset.frames(dataset.episodes[:1], dataset.numbers))
    stamps = [f"{stamp:.4g}" for stamp in dataset.times(episode, table).times[:3]]
    rows = [ColumnUse("timestamp", "s", "times", tuple(stamps), choices=("times",))]
    for name in dataset.numbers:
        values = dataset.values(table, name)[0, :3]
        use: Any = "signal" if name in read_features else "left out"
        cells = tuple(f"{value:.4g}" for value in values)
        rows.append(ColumnUse(name, "", use, cells, choices=("signal", "left out")))
    for name in dataset.cameras:
        use = "video" if name in cameras else "left out"
        shape = " x ".join(map(str, dataset.info["features"][name]["shape"]))
        rows.append(ColumnUse(name, "", use, (shape,), choices=("video", "left out")))
    return tuple(rows)


def choose_features(dataset: Dataset, options: ReadOptions) -> tuple[list[Column], list[str]]:
    """The numbers to read as channels, and the cameras."""
    for name in (*options.signals, *options.leave_out):
        if not any(_is_named(column, (name,)) for column in dataset.columns.values()) and not any(
            values_within(camera, name) for camera in dataset.cameras
        ):
            names = listed([*dataset.numbers, *dataset.cameras])
            raise InputError(f"'{dataset.path}' has no feature '{name}'; name one of {names}.")
    default = _default_features(dataset)
    columns = [
        column
        for column in dataset.columns.values()
        if (column.feature in default or _is_named(column, options.signals))
        and not _is_named(column, options.leave_out)
    ]
    cameras = [name for name in dataset.cameras if not values_within(name, *options.leave_out)]
    return columns, cameras


def _is_named(column: Column, names: Sequence[str]) -> bool:
    """Whether one of some names is of a number, or of a feature or part of one that it is in."""
    addresses = (f"{column.feature}.{column.name}", column.name)
    return any(values_within(address, *names) for address in addresses)


def _default_features(dataset: Dataset) -> Collection[str]:
    """Features of forces; where there is none, what is observed; else all numbers."""
    forces = [
        name
        for name, parts in dataset.numbers.items()
        if _FORCES & set(re.split(r"[\W_]+", name.lower()))
        or any(len(c) > 1 for c in channel_map([Channel(part) for part in parts]).columns)
    ]
    observed = [name for name in dataset.numbers if name.startswith("observation.")]
    return forces or observed or list(dataset.numbers)


def _chosen(dataset: Dataset, options: ReadOptions) -> list[Episode]:
    """The episodes to read: all, or those of the options, which must exist."""
    if not options.episodes:
        if len(dataset.episodes) > MOST_UNASKED:
            raise InputError(
                f"'{dataset.path}' has {len(dataset.episodes):,} episodes, "
                f"{dataset.episodes[0].number} to {dataset.episodes[-1].number}; say which "
                f"(--episodes 0-99)."
            )
        return list(dataset.episodes)
    known = {episode.number: episode for episode in dataset.episodes}
    for number in options.episodes:
        if number not in known:
            raise InputError(
                f"'{dataset.path}' has no episode {number}; it has {len(known):,}, "
                f"{min(known)} to {max(known)}."
            )
    return [known[number] for number in dict.fromkeys(options.episodes)]


def _labels(
    dataset: Dataset, table: Any, times: RepairedTimestamps
) -> tuple[tuple[Track, ...], list[str]]:
    """The subtasks of an episode as a track, where the dataset has any."""
    if SUBTASK not in table.column_names:
        return (), []
    codes = dataset.whole_numbers(table, SUBTASK)[times.rows]
    names = dataset.subtasks
    inside = (codes >= 0) & (codes < len(names))
    # The last one stands for what is outside.
    is_action = np.array([*(not is_unlabelled(name) for name in names), False])
    codes = np.where(is_action[np.where(inside, codes, -1)], codes, UNLABELLED)
    segments = from_codes(codes, times.times, [" ".join(name.split()) for name in names])
    remarks = []
    if not inside.all():
        remarks = [
            f"Some frames have a {SUBTASK} that {SUBTASKS_FILE} lacks; they stay unlabelled."
        ]
    return ((Track(DATASET, segments),) if segments else ()), remarks


def _videos(
    dataset: Dataset,
    episode: Episode,
    table: Any,
    cameras: Sequence[str],
    times: RepairedTimestamps,
    options: ReadOptions,
) -> tuple[tuple[VideoReference, ...], list[str]]:
    """The video of each camera; its pictures are as many as the frames, or that is said."""
    videos: list[VideoReference] = []
    read_cameras: list[str] = []
    remarks, faults = [], []
    for camera in cameras if options.unpack is not None else ():
        folder = Path(tempfile.mkdtemp(dir=options.unpack))
        try:
            if camera in dataset.pictures:
                file, first, count = _write_pictures(table[camera], times, folder)
            else:
                stretch, file = episode.videos[camera], folder / "cut.mp4"
                cut = cut_video(stretch.file, stretch.start, stretch.end, file)
                first, count = cut.first - stretch.start - times.start, len(cut.times)
        except InputError as error:
            sentence = f"There are no pictures of '{camera}': {str(error).removesuffix('.')}."
            if options.strict:
                raise InputError(sentence) from error
            faults.append(sentence)
            continue
        read_cameras.append(camera)
        if count != episode.length:
            pictures, frames = counted(count, "picture"), counted(episode.length, "frame")
            sentence = f"'{camera}' has {pictures} of an episode of {frames}"
            if options.strict:
                raise InputError(f"{sentence}; leave it out (--leave-out {camera}).")
            faults.append(f"{sentence}.")
        name = camera.removeprefix("observation.").removeprefix("images.")
        video_name = name if name not in [video.name for video in videos] else camera
        videos.append(VideoReference(file, ClockMap(first), video_name))
    if names := [camera for camera in read_cameras if camera not in dataset.pictures]:
        remarks.append(f"The videos of {listed(names)} were cut by episode, as they are.")
    if names := [camera for camera in read_cameras if camera in dataset.pictures]:
        remarks.append(f"The pictures of {listed(names)} became videos; PNG was encoded as JPEG.")
    return tuple(videos), remarks + faults


def _write_pictures(
    column: Any, times: RepairedTimestamps, folder: Path
) -> tuple[Path, float, int]:
    """Write pictures that lie beside the numbers as a video; damaged ones are left out.

    Also gives the time of the first one, and how many there are.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    if not (
        pa.types.is_struct(column.type)
        and column.type.get_field_index("bytes") >= 0
        and pa.types.is_binary(column.type.field("bytes").type)
    ):
        raise InputError("they are not stored as bytes")
    contents = pc.struct_field(column, "bytes")
    file, fault = folder / "pictures.mkv", ""
    with (
        file_errors(f"The pictures were not written to '{file}'"),
        closing(PictureVideo(file)) as video,
    ):
        for row, time in zip(times.rows.tolist(), times.times.tolist(), strict=True):
            try:
                video.write(read_picture(contents[row].as_py() or b""), time)
            except PictureError as error:  # noqa: PERF203 - others may be whole
                fault = fault or f"picture {row} cannot be used: {error}"
    if not video.count:
        raise InputError(fault)
    return file, video.start, video.count


def _remarks(dataset: Dataset, features: Sequence[str]) -> list[str]:
    """What is said of a dataset as a whole."""
    remarks = [f"Channels were read from {listed(features)}."]
    others = [name for name in dataset.numbers if name not in features]
    if others:
        names = listed(others)
        remarks.append(f"Other numbers can be read as signals (--signal): {names}.")
    if dataset.unread:
        remarks.append(f"Nothing was read from {listed(dataset.unread)}.")
    return remarks
