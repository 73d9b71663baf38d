"""ROS bags of ROS 1 and ROS 2, read as one demonstration.

What the messages hold is told by the definitions in the bag, so that custom messages are read as
the common ones are. Which of their numbers are forces, and how several topics come onto one clock,
is in :mod:`~forcelab.formats.rosbag_topics`, what becomes of pictures in
:mod:`~forcelab.formats.rosbag_pictures`.
"""

from __future__ import annotations

import itertools
import os
import shutil
import struct
import tempfile
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from forcelab.demonstration import Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.extras import load_extra
from forcelab.formats.label_tables import own_or_beside_tracks
from forcelab.formats.recording import (
    ColumnUse,
    ReadOptions,
    Recording,
    Use,
    reading_progress,
)
from forcelab.formats.rosbag_pictures import (
    describe_picture,
    is_picture,
    video_path,
    write_video,
)
from forcelab.formats.rosbag_topics import (
    AlignedTopics,
    Contents,
    Definitions,
    Field,
    FieldPath,
    FrameTimes,
    TopicData,
    address_of,
    align_topics,
    contents,
    follow_path,
    values_within,
    with_sensors,
)
from forcelab.formats.signatures import BAG_METADATA
from forcelab.formats.table_columns import MOST_LABELS, is_unlabelled, missing_remark
from forcelab.jobs import Progress
from forcelab.labels import UNLABELLED, Track, from_codes
from forcelab.text import counted, listed


def select_fields(topics: Sequence[Contents], options: ReadOptions) -> list[TopicData]:
    """The topics to read, empty yet: forces and requested signals, without what is to be left out.

    Options name topics, or fields as in ``/topic.field.part``.
    """
    all_fields = [field_ for topic in topics for field_ in topic.numbers]
    addresses = [address for field_ in all_fields for address in field_.addresses]
    addresses += [address for topic in topics for address in topic.words]
    for name in (*options.signals, *options.leave_out):
        if not any(values_within(address, name) for address in addresses):
            raise _unknown(name, "values", [field_.address for field_ in all_fields])
    chosen = with_sensors(
        [part for field_ in all_fields if (part := field_.requested(options)).leaves]
    )
    if not chosen:
        left = " but what is left out" if options.leave_out else ""
        raise InputError(
            f"no topic in it carries forces{left} (there are "
            f"{listed([topic.topic for topic in topics])}); name what is to be read as a "
            "signal, a topic or a field of it as in --signal /topic.field."
        )
    labelled, label = _label(topics, options, {field_.topic for field_ in chosen})
    return [
        TopicData(
            topic.topic,
            fields := tuple(field_ for field_ in chosen if field_.topic == topic.topic),
            _sizes(topic.first, fields),
            topic.stamp,
            label if topic.topic == labelled else None,
        )
        for topic in topics
        if topic.topic == labelled or any(field_.topic == topic.topic for field_ in chosen)
    ]


def select_pictures(
    topics: Sequence[Contents], options: ReadOptions
) -> tuple[list[TopicData], dict[str, str]]:
    """The topics of pictures to make videos of, empty yet, and a sentence on each that is none."""
    selected: list[TopicData] = []
    left: dict[str, str] = {}
    for topic in topics:
        if not is_picture(topic.first) or _left_out(topic.topic, topics, options):
            continue
        kind, trouble = describe_picture(topic.first)
        pictures = f"Pictures of {topic.topic} ({kind})"
        if options.unpack is None:
            left[topic.topic] = f"{pictures} become a video when the bag is imported."
        elif trouble:
            left[topic.topic] = f"{pictures} were left out: {trouble}."
        else:
            selected.append(TopicData(topic.topic, (), {}, topic.stamp, None))
    return selected, left


def _left_out(topic: str, topics: Sequence[Contents], options: ReadOptions) -> bool:
    """Whether a topic is to be left out: by its own name, or by that of what it lies in.

    The name of another topic stands for that alone: ``/camera/compressed`` lies beside ``/camera``.
    """
    names = {other.topic.removeprefix("/") for other in topics} - {topic.removeprefix("/")}
    return values_within(
        topic, *(name for name in options.leave_out if name.removeprefix("/") not in names)
    )


def left_numbers(topics: Sequence[Contents], read: Sequence[TopicData]) -> list[str]:
    """Addresses of numbers that are not read, in topics of which others are."""
    used = {field_.address for data in read for field_ in data.fields}
    measured = {data.topic for data in read if data.fields}
    return [
        field_.address
        for topic in topics
        if topic.topic in measured
        for field_ in topic.numbers
        if field_.address not in used and field_.address not in topic.words
    ]


def _sizes(first: object, fields: Sequence[Field]) -> dict[FieldPath, int]:
    """How many there are in each array and list that fields are taken from."""
    leaves = [leaf for field_ in fields for leaf in field_.leaves]
    inside = [leaf[:i] for leaf in leaves for i, step in enumerate(leaf) if isinstance(step, int)]
    return {path: len(follow_path(first, path)) for path in inside}


def _label(
    topics: Sequence[Contents], options: ReadOptions, measured: set[str]
) -> tuple[str, FieldPath | None]:
    """Topic and path of the labels: as asked for, else the surest name, beside forces first."""
    labels = {
        address: (topic.topic, path) for topic in topics for address, path in topic.words.items()
    }
    if options.label is not None:
        addresses = [address for address in labels if values_within(address, options.label)]
        if len(addresses) != 1:
            raise _unknown(options.label, "labels", list(labels))
    else:
        addresses = [
            address
            for topic in sorted(topics, key=lambda topic: topic.topic not in measured)
            for address in topic.labels
            if not values_within(address, *options.leave_out, *options.signals)
        ]
    return labels[addresses[0]] if addresses else ("", None)


def _unknown(name: str, kind: str, names: Sequence[str]) -> InputError:
    """The error for a name that means nothing, or more than one thing."""
    cure = f"name one of {listed(names)}" if names else "there are none"
    return InputError(f"it has no {kind} called '{name}'; {cure}.")


_METADATA: Final = b"rosbag2_bagfile_information:"
_ROS1, _MCAP, _SQLITE = b"#ROSBAG V", b"\x89MCAP", b"SQLite format 3\x00"
#: What each kind of file has to be called for the library.
_SUFFIXES: Final = ((_ROS1, ".bag"), (_MCAP, ".mcap"))
_CURE: Final = "copy it again, or mend it with rosbag reindex (ROS 2: ros2 bag reindex)"


def sniff(path: Path, head: bytes) -> bool:
    """Whether a file or folder is a bag, or the metadata (a folder's `head`) or the data of one."""
    database = head.startswith(_SQLITE) and path.suffix == ".db3"
    return database or head.startswith((_ROS1, _MCAP, _METADATA))


def read(path: Path, options: ReadOptions) -> Generator[Progress, None, list[Recording]]:
    """Read a bag as one demonstration, called like the file, or the folder of a ROS 2 bag.

    Its metadata or one file of its data stand for a folder. A labels file beside it is read where
    it holds no labels, as beside a table.
    """
    with open_bag(path) as bag:
        bag_path: Path = bag.paths[0]
        topics, unreadable = survey_topics(bag)
        if not topics:
            raise InputError(
                f"Nothing can be read from '{bag_path}': {listed(unreadable) or 'it is empty'}."
            )
        data = select_fields(topics, options)
        pictures, left_pictures = select_pictures(topics, options)
        # Those of pictures are read twice: once their times are known they are written.
        times_read = Counter(topic.topic for topic in (*data, *pictures, *pictures))
        sizes = {name: _message_size(bag, name) for name in times_read}
        numbers = ((c.topic, c.msgcount * times_read[c.topic]) for c in bag.connections)
        total = sum(number * sizes[topic] for topic, number in numbers if number)
        done = 0

        def count(topic: str) -> Progress:
            nonlocal done
            done += sizes[topic]
            return reading_progress(path, done, total)

        yield from _fill([*data, *pictures], bag, count)
        names = _constants(topics, data, bag)
        types = {c.topic: c.msgtype.replace("/msg/", "/") for c in bag.connections}
        aligned = align_topics(data, str(path), strict=options.strict, pictures=pictures)
        videos, video_remarks = yield from _write_videos(bag, aligned.frames, options, count)
    fields = [field_ for topic in data for field_ in topic.fields]
    channels = tuple(channel for field_ in fields for channel in field_.channels)
    demonstration = Demonstration(
        bag_path.stem if bag_path.is_file() else bag_path.name,
        options.task or "",
        aligned.times,
        aligned.signals,
        channels,
        videos=tuple(videos),
        grid_rate=options.rate,
    )
    tracks, label_remarks = _tracks(data, aligned, names, options)
    tracks, beside_remarks = own_or_beside_tracks(
        bag_path, tracks, options, aligned.start, demonstration
    )
    read_topics = {topic.topic for topic in (*data, *pictures)} | left_pictures.keys()
    others = [topic.topic for topic in topics if topic.topic not in read_topics]
    unread = [f"{name} ({types[name]})" for name in others]
    remarks = [
        f"Channels were read from {listed([field_.address for field_ in fields])}.",
        *aligned.remarks,
        *video_remarks,
        *left_pictures.values(),
        *label_remarks,
        *beside_remarks,
        *missing_remark(aligned.signals, channels),
        *_not_imported(unread, unreadable, left_numbers(topics, data)),
    ]
    return [Recording(demonstration, tracks, tuple(remarks), source=bag_path.name)]


@contextmanager
def open_bag(path: Path) -> Iterator[Any]:
    """The library's reader of a bag, which may be named by its metadata."""
    path = path.parent if path.name == BAG_METADATA else path
    load_extra("rosbags", "rosbag", f"'{path}' is a ROS bag, which")
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    if path.is_file():
        with path.open("rb") as file:
            head = file.read(16)
        for start, suffix in _SUFFIXES:
            if head.startswith(start) and path.suffix != suffix:
                raise InputError(f"'{path}' is a ROS bag by its content; rename it to *{suffix}.")
    _check_files(path)
    with _naming_damage(path), _plain_databases():
        # Older bags of ROS 2 do not define their messages; the common ones never changed.
        bag = AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE))
        bag.open()
    try:
        with _naming_damage(path):
            _check_count(path, int(bag.message_count))
            if not all(
                isinstance(c.topic, str) and isinstance(c.msgtype, str) for c in bag.connections
            ):
                raise TypeError("a topic or a type without a name")
            if not all(isinstance(c.msgcount, int) for c in bag.connections):
                raise TypeError("numbers of messages that are no numbers")
        yield bag
    finally:
        bag.close()


#: Bytes of metadata; a topic takes one or two thousand.
MOST_METADATA: Final = 2**21


def _check_files(path: Path) -> None:
    """Refuse pipes and devices in a folder, which never end, and metadata too long to parse."""
    for file in path.iterdir() if path.is_dir() else ():
        if file.exists() and not (file.is_file() or file.is_dir()):
            raise InputError(f"'{file}' is a device or pipe; take it out of the bag's folder.")
        if file.is_file():
            _check_unpacked_size(file)
    file = path / BAG_METADATA
    if file.is_file() and (size := file.stat().st_size) > MOST_METADATA:
        raise InputError(
            f"'{file}' has {size:,} bytes, which is more than metadata can have "
            f"({MOST_METADATA:,}); make it anew with ros2 bag reindex."
        )


#: Data as zstd begin so. What forces are written as packs to a third, zeros to a hundredth.
_ZSTD, _MOST_TIMES = b"\x28\xb5\x2f\xfd", 1000


def _check_unpacked_size(file: Path) -> None:
    """Refuse a packed file that would fill the temporary folder, to which the library unpacks it.

    What a packed file says of its size need not be true, so it is unpacked once to be measured.
    """
    from rosbags.rosbag2.reader import zstd

    with file.open("rb") as packed:
        if packed.read(len(_ZSTD)) != _ZSTD:
            return
        size = packed.seek(0, os.SEEK_END)
        packed.seek(0)
        free = shutil.disk_usage(tempfile.gettempdir()).free
        room, unpacked = min(_MOST_TIMES * size, free // 2), 0
        with _naming_damage(file), zstd.open(packed, "rb") as content:
            while unpacked <= room and (part := len(content.read(2**20))):
                unpacked += part
    if unpacked > room:
        raise InputError(
            f"'{file}' has {size:,} bytes and unpacks to more than {room:,}, which is more than "
            f"{_MOST_TIMES:,} times as many or half of the free room for temporary files; unpack "
            "it by hand (zstd -d) and look at it, or make room."
        )


@contextmanager
def _plain_databases() -> Iterator[None]:
    """Refuse databases in which anything but tables and indexes would answer.

    They are looked at as the library opens them, whatever they are called or packed in.
    """
    import apsw

    def check(store: Any) -> None:
        odd = store.execute(
            "SELECT 1 FROM sqlite_schema WHERE type NOT IN ('table', 'index') "
            "OR sql LIKE 'CREATE VIRTUAL%'"
        ).fetchone()
        if odd:
            raise ValueError("its database has views, triggers or virtual tables")

    apsw.connection_hooks.append(check)
    try:
        yield
    finally:
        apsw.connection_hooks.remove(check)


def _check_count(path: Path, count: int) -> None:
    """Refuse more messages than a bag has bytes: those of an empty type are never at an end."""
    if count > (size := _size(path)):
        raise InputError(
            f"'{path}' has {count:,} messages in {size:,} bytes, which cannot be; {_CURE}."
        )


def _size(path: Path) -> int:
    """Bytes of a bag's file, or of all files in its folder."""
    return sum(file.stat().st_size for file in (path, *path.glob("*")) if file.is_file())


@contextmanager
def _naming_damage(path: Path) -> Iterator[None]:
    """Turn what the library says of a bag that it cannot read into a sentence."""
    try:
        yield
    except RecursionError as error:
        raise InputError(
            f"'{path}' is nested too deep to be read, in its metadata or by messages that contain "
            f"themselves; record it anew."
        ) from error
    except MemoryError as error:
        raise InputError(
            f"'{path}' unpacks to more than there is memory for; split it (rosbag filter, or ROS "
            f"2: ros2 bag convert)."
        ) from error
    except _damage() as error:
        if isinstance(error, OSError) and error.errno is not None:
            raise
        text = " ".join(str(error).split()).rstrip(".")
        if isinstance(error, AssertionError | LookupError) or not text:
            text = "its records contradict each other"
        reason = text if len(text) <= 160 else f"{text[:160]}…"
        raise InputError(f"'{path}' is not a whole ROS bag ({reason}); {_CURE}.") from error


def _damage() -> tuple[type[Exception], ...]:
    """What the library, and those that it unpacks with, raise over a damaged bag."""
    import apsw
    from rosbags.highlevel.anyreader import AnyReaderError, ReaderErrors
    from rosbags.rosbag2.reader import zstd  # Python's own, or that for older ones
    from rosbags.serde import SerdeError
    from rosbags.typesys import TypesysError
    from ruamel.yaml.error import YAMLError

    reader_errors = (
        AnyReaderError,
        *ReaderErrors,
        SerdeError,
        TypesysError,
        YAMLError,
        zstd.ZstdError,
    )
    # Damaged lengths, names and code made of definitions; lz4 has nothing of its own.
    plain = (ArithmeticError, AssertionError, AttributeError, EOFError, LookupError, RuntimeError)
    odd = (SyntaxError, TypeError, ValueError, apsw.Error, struct.error)
    return (*reader_errors, *plain, *odd, OSError)


#: What the library gives to a type without fields; in ROS 1 it takes no byte.
_DUMMY_FIELD: Final = "structure_needs_at_least_one_member"
#: A message has no more fields, all within one another counted, nor are they nested deeper.
MOST_FIELDS, DEEPEST = 20_000, 32


def _trouble(kind: str, definitions: Definitions) -> str | None:
    """Why messages of a type cannot be read, before anything is made of them; None if they can."""
    from rosbags.interfaces import Nodetype

    known: dict[str, int] = {}  # fields of each type; 0 of what takes no bytes

    def count(kind: str, above: tuple[str, ...]) -> int:
        if kind in above:
            raise _UnreadableError(f"{kind} contains itself")
        if len(above) > DEEPEST:
            raise _UnreadableError(f"messages are nested deeper than {DEEPEST}")
        if kind not in definitions:
            raise _UnreadableError(f"{kind}, which the bag does not define")
        if kind not in known:
            known[kind] = sum(
                fields(desc, (*above, kind))
                for name, desc in definitions[kind][1]
                if name != _DUMMY_FIELD
            )
        if known[kind] > MOST_FIELDS:
            raise _UnreadableError(f"more than {MOST_FIELDS:,} fields a message")
        return known[kind]

    def fields(desc: Any, above: tuple[str, ...]) -> int:
        sort, inner = desc
        if sort == Nodetype.NAME:
            return count(inner, above)
        if sort == Nodetype.BASE:
            return 1
        item, length = inner
        several = fields(item, above)
        if several == 0:
            raise _UnreadableError(f"a list of {item[1]}, which holds nothing")
        if sort == Nodetype.SEQUENCE:
            return 1 + several
        return several if item[0] == Nodetype.BASE and item[1][0] != "string" else several * length

    try:
        count(kind, ())
    except _UnreadableError as error:
        return str(error)
    return None


class _UnreadableError(Exception):
    """A definition that no message can have."""


#: Messages that are found so many times on average are named again and again by a false index.
#: Where two bags were merged it is twice.
_MOST_REPEATED: Final = 10


def _messages(bag: Any, connections: Sequence[Any]) -> Iterator[tuple[int, Any]]:
    """Time of arrival in nanoseconds and content of all messages of some connections."""
    messages = bag.messages(connections=connections)
    different: set[int] = set()
    for count in itertools.count(1):
        if count % 100_000 == 0:
            _check_count(bag.paths[0], count)
        with _naming_damage(bag.paths[0]):
            entry = next(messages, None)
            if entry is None:
                return
            connection, arrived, raw = entry
            different.add(hash((connection.id, arrived, raw)))
            if count % 100 == 0 and count > _MOST_REPEATED * len(different):
                raise ValueError(
                    f"its index names {counted(len(different), 'message')} {count:,} times"
                )
            message = bag.deserialize(raw, connection.msgtype)
        yield arrived, message


def survey_topics(bag: Any) -> tuple[list[Contents], list[str]]:
    """What each topic holds, by its first message, and topics that hold nothing to be read."""
    topics: list[Contents] = []
    unreadable: list[str] = []
    for name in dict.fromkeys(connection.topic for connection in bag.connections):
        connections = [c for c in bag.connections if c.topic == name and c.msgcount]
        kinds = {c.msgtype for c in connections}
        if not connections:
            unreadable.append(f"{name} (no messages)")
        elif len(kinds) > 1:
            unreadable.append(f"{name} (messages of several types)")
        elif reason := _trouble(kinds.pop(), bag.typestore.fielddefs):
            unreadable.append(f"{name} ({reason})")
        else:
            for _, message in _messages(bag, connections):
                topics.append(contents(name, message, bag.typestore.fielddefs))
                break
    return topics, unreadable


def _message_size(bag: Any, topic: str) -> int:
    """Bytes of the first message of a topic, as which all of them are counted."""
    connections = [c for c in bag.connections if c.topic == topic and c.msgcount]
    with _naming_damage(bag.paths[0]):
        entry = next(bag.messages(connections=connections), None)
        return max(1, len(entry[2])) if entry is not None else 1


#: Messages that are read from one progress to the next.
_STEP: Final = 50


def _fill(
    data: Sequence[TopicData], bag: Any, count: Callable[[str], Progress]
) -> Generator[Progress, None, None]:
    """Read all messages of what was chosen, topic by topic; `count` counts those of a topic.

    The library unpacks a chunk anew whenever the next message is of another one, which, over all
    topics together, may be every time.
    """
    for topic in data:
        connections = [c for c in bag.connections if c.topic == topic.topic]
        for number, (arrived, message) in enumerate(_messages(bag, connections), start=1):
            topic.add(arrived, message)
            progress = count(topic.topic)
            if number % _STEP == 0:
                yield progress


def _write_videos(
    bag: Any, frames: Sequence[FrameTimes], options: ReadOptions, count: Callable[[str], Progress]
) -> Generator[Progress, None, tuple[list[VideoReference], list[str]]]:
    """Write the pictures of each topic into a video; with remarks."""
    videos: list[VideoReference] = []
    remarks: list[str] = []
    if not frames or options.unpack is None:
        return videos, remarks
    folder = Path(tempfile.mkdtemp(dir=options.unpack))
    for times in frames:
        if not times.rows.size:
            remarks += times.remarks
            continue
        connections = [c for c in bag.connections if c.topic == times.topic]
        messages = _messages(bag, connections)
        path = video_path(folder, times.topic)
        video, video_remarks = yield from write_video(
            messages, times, path, count, strict=options.strict
        )
        videos += [video] if video is not None else []
        remarks += video_remarks
    return videos, remarks


def _constants(topics: Sequence[Contents], data: Sequence[TopicData], bag: Any) -> dict[str, str]:
    """What the definition of a message calls the values of its label, by the value as a word."""
    labels = {topic_data.topic: topic_data.label for topic_data in data if topic_data.label}
    names: dict[str, str] = {}
    for topic in topics:
        if path := labels.get(topic.topic):
            kind = follow_path(topic.first, path[:-1]).__msgtype__
            constants, fields = bag.typestore.fielddefs[kind]
            type_name = dict(fields)[path[-1]][1][0]
            pairs = [(str(value), name) for name, type_, value in constants if type_ == type_name]
            values = [value for value, _ in pairs]
            names = {value: name for value, name in pairs if values.count(value) == 1}
    return names


def _tracks(
    data: Sequence[TopicData], aligned: AlignedTopics, names: dict[str, str], options: ReadOptions
) -> tuple[tuple[Track, ...], list[str]]:
    """The labels as a track, with a remark on where they are from."""
    source = next((topic for topic in data if topic.label is not None), None)
    if source is None or source.label is None:
        return (), []
    address = address_of(source.topic, source.label)
    words = [names.get(word, word) for word in aligned.words]
    different = dict.fromkeys(words)
    if options.label is None and len(different) < 2:
        return (), []  # a tag that was never set
    if len(different) > MOST_LABELS:
        text = f"{address} holds {len(different):,} different values, too many to be actions"
        if options.label is not None:
            raise InputError(f"{text}; name another field for the labels.")
        return (), [f"{text}; no labels were read."]
    actions = [kind for kind in different if not is_unlabelled(kind)]
    code = {action: number for number, action in enumerate(actions)}
    codes = np.array([code.get(word, UNLABELLED) for word in words], np.int64)
    segments = from_codes(codes, aligned.times, actions)
    remark = f"Labels were read from {address}: {', '.join(actions) or 'none'}."
    return ((Track(options.author, segments),) if segments else ()), [remark]


def _not_imported(
    unread: Sequence[str], unreadable: Sequence[str], numbers: Sequence[str]
) -> Iterator[str]:
    """Remarks on what of the bag was not read."""
    if unread or unreadable:
        yield f"Nothing was read from {listed([*unread, *unreadable])}."
    if numbers:
        yield f"Other numbers can be read as signals (--signal): {listed(numbers)}."


_SIGNAL_USE: Final[tuple[Use, ...]] = ("signal", "left out")
_LABEL_USE: Final[tuple[Use, ...]] = ("signal", "labels", "left out")


def preview(path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """What the fields of a bag's messages would be read as, by the first message of each topic.

    A row is a stamp, a label, or a group of numbers that belong together; its cells are these.
    """
    with open_bag(path) as bag:
        topics, _ = survey_topics(bag)
    try:
        data = select_fields(topics, options)
    except InputError:
        if options.signals or options.leave_out or options.label:
            raise
        data = []  # no forces; something may be chosen
    return tuple(
        row
        for topic in topics
        for row in (
            [_picture_row(topic, topics, options)]
            if is_picture(topic.first)
            else _rows(topic, data)
        )
    )


def _picture_row(topic: Contents, topics: Sequence[Contents], options: ReadOptions) -> ColumnUse:
    """What the pictures of a topic are read as."""
    kind, trouble = describe_picture(topic.first)
    if trouble:
        return ColumnUse(topic.topic, "", "left out", (kind,), choices=("left out",))
    use: Use = "left out" if _left_out(topic.topic, topics, options) else "video"
    return ColumnUse(topic.topic, "", use, (kind,), choices=("video", "left out"))


def _rows(topic: Contents, data: Sequence[TopicData]) -> Iterator[ColumnUse]:
    """What a topic holds, and what it is read as."""
    read = {field_.address for topic_data in data for field_ in topic_data.fields}
    labels = {
        address_of(topic_data.topic, topic_data.label)
        for topic_data in data
        if topic_data.label is not None
    }
    if topic.stamp is not None:
        stamp = follow_path(topic.first, topic.stamp)
        cell = f"{stamp.sec}.{stamp.nanosec:09}"
        name = address_of(topic.topic, topic.stamp)
        yield ColumnUse(name, "", "times", (cell,), choices=("times",))
    numbers = {field_.address for field_ in topic.numbers}
    for address in topic.labels:
        if address not in numbers:  # a text
            use: Use = "labels" if address in labels else "left out"
            word = str(follow_path(topic.first, topic.words[address]))
            yield ColumnUse(address, "", use, (word,), choices=("labels", "left out"))
    for field_ in topic.numbers:
        use = "labels" if field_.address in labels else "left out"
        cells = tuple(f"{float(follow_path(topic.first, leaf)):.4g}" for leaf in field_.leaves[:3])
        units = ", ".join(unit for unit in dict.fromkeys(field_.units) if unit)
        use = "signal" if field_.address in read else use
        choices = _LABEL_USE if field_.address in topic.words else _SIGNAL_USE
        yield ColumnUse(field_.address, units, use, cells, choices=choices)
