"""ROS bags of ROS 1 and ROS 2, read as one demonstration.

What the messages hold is told by the definitions in the bag, so that custom messages are read as
the common ones are. Which of their numbers are forces is in
:mod:`~forcelab.formats.rosbag_topics`, how several topics come onto one clock in
:mod:`~forcelab.formats.alignment`, what becomes of pictures in
:mod:`~forcelab.formats.rosbag_pictures`.
"""

from __future__ import annotations

import itertools
import os
import re
import shutil
import tempfile
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from forcelab.demonstration import Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.extras import load_extra
from forcelab.formats.alignment import AlignedStreams, TimedRows, align_streams
from forcelab.formats.fields import address_of
from forcelab.formats.label_tables import own_or_beside_tracks
from forcelab.formats.recording import (
    ColumnUse,
    ReadOptions,
    Recording,
    Use,
    reading_progress,
)
from forcelab.formats.rosbag_pictures import (
    is_picture,
    preview_pictures,
    select_pictures,
    write_video,
)
from forcelab.formats.rosbag_topics import (
    Definitions,
    Topic,
    TopicData,
    describe_topic,
    follow_path,
    left_numbers,
    select_fields,
    unreadable_reason,
)
from forcelab.formats.signatures import BAG_METADATA, naming_damage
from forcelab.formats.table_columns import MOST_LABELS, is_unlabelled, missing_remark
from forcelab.jobs import Progress
from forcelab.labels import UNLABELLED, Track, from_codes
from forcelab.text import counted, listed

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
    with _open_bag(path) as bag:
        bag_path: Path = bag.paths[0]
        topics, unreadable = _survey(bag)
        if not topics:
            raise InputError(
                f"Nothing can be read from '{bag_path}': {listed(unreadable) or 'it is empty'}."
            )
        data = select_fields(topics, options)
        pictures, left_pictures = select_pictures(topics, options)
        # Those of pictures are read twice: once their times are known they are written.
        total = sum(each.topic.size * each.topic.count for each in (*data, *pictures, *pictures))
        sizes = {topic.name: topic.size for topic in topics}
        done = 0

        def count(topic: str) -> Progress:
            nonlocal done
            done += sizes[topic]
            return reading_progress(path, done, total)

        yield from _fill([*data, *pictures], bag, count)
        aligned = align_streams(
            [topic_data.stream() for topic_data in data],
            str(path),
            strict=options.strict,
            pictures=[topic_data.stream() for topic_data in pictures],
            stream_word="topic",
            sample_word="message",
        )
        videos, video_remarks = yield from _write_videos(bag, aligned.pictures, options, count)
        definitions = bag.typestore.fielddefs
    fields = [field_ for topic_data in data for field_ in topic_data.fields]
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
    tracks, label_remarks = _tracks(data, aligned, definitions, options)
    tracks, beside_remarks = own_or_beside_tracks(
        bag_path, tracks, options, aligned.start, demonstration
    )
    read_topics = {each.topic.name for each in (*data, *pictures)} | left_pictures.keys()
    unread = [f"{t.name} ({t.type_name})" for t in topics if t.name not in read_topics]
    remarks = [
        f"Channels were read from {listed([field_.address for field_ in fields])}.",
        *aligned.remarks,
        *video_remarks,
        *left_pictures.values(),
        *label_remarks,
        *beside_remarks,
        *missing_remark(aligned.signals, channels),
    ]
    if unread or unreadable:
        remarks.append(f"Nothing was read from {listed([*unread, *unreadable])}.")
    if numbers := left_numbers(data):
        remarks.append(f"Other numbers can be read as signals (--signal): {listed(numbers)}.")
    return [Recording(demonstration, tracks, tuple(remarks), source=bag_path.name)]


@contextmanager
def _open_bag(path: Path) -> Iterator[Any]:
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
        for reader in bag.readers:
            _skip_unparsed(reader)
        bag.open()
    try:
        with _naming_damage(path):
            _check_count(path, int(bag.message_count))
            for connection in bag.connections:
                if not (isinstance(connection.topic, str) and isinstance(connection.msgtype, str)):
                    raise TypeError("a topic or a type without a name")
                if not isinstance(connection.msgcount, int):
                    raise TypeError("numbers of messages that are no numbers")
        yield bag
    finally:
        bag.close()


def _skip_unparsed(reader: Any) -> None:
    """Have a reader of the library open without definitions that it cannot parse.

    Over one, as of the events of a service, it gives up the whole bag. Without it the bag does not
    define the topic's type.
    """
    from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat
    from rosbags.typesys import TypesysError, get_types_from_msg

    open_reader, none = reader.open, MessageDefinition(MessageDefinitionFormat.NONE, "")

    def is_parsed(connection: Any) -> bool:
        kind, text = connection.msgdef
        if kind == MessageDefinitionFormat.MSG:
            try:
                get_types_from_msg(text, connection.msgtype)
            except TypesysError:
                return False
        return True

    def open_parsed() -> None:
        open_reader()
        reader.connections[:] = [
            connection if is_parsed(connection) else connection._replace(msgdef=none, digest="")
            for connection in reader.connections
        ]

    reader.open = open_parsed


#: Bytes of metadata; a topic takes one or two thousand.
_MOST_METADATA: Final = 2**21


def _check_files(path: Path) -> None:
    """Refuse pipes and devices in a folder, which never end, and metadata too long to parse."""
    for file in path.iterdir() if path.is_dir() else ():
        if file.exists() and not (file.is_file() or file.is_dir()):
            raise InputError(f"'{file}' is a device or pipe; take it out of the bag's folder.")
        if file.is_file():
            _check_unpacked_size(file)
    file = path / BAG_METADATA
    if file.is_file() and (size := file.stat().st_size) > _MOST_METADATA:
        raise InputError(
            f"'{file}' has {size:,} bytes, which is more than metadata can have "
            f"({_MOST_METADATA:,}); make it anew with ros2 bag reindex."
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
    size = sum(file.stat().st_size for file in (path, *path.glob("*")) if file.is_file())
    if count > size:
        raise InputError(
            f"'{path}' has {count:,} messages in {size:,} bytes, which cannot be; {_CURE}."
        )


@contextmanager
def _naming_damage(path: Path) -> Iterator[None]:
    """Turn what the library, and those that it unpacks with, say of a bag into a sentence."""
    import apsw
    from rosbags.highlevel.anyreader import AnyReaderError, ReaderErrors
    from rosbags.rosbag2.reader import zstd  # Python's own, or that for older ones
    from rosbags.serde import SerdeError
    from rosbags.typesys import TypesysError
    from ruamel.yaml.error import YAMLError

    errors = (AnyReaderError, *ReaderErrors, SerdeError, TypesysError, YAMLError, zstd.ZstdError)
    with naming_damage(path, "ROS bag", _CURE, apsw.Error, *errors):
        try:
            yield
        except RecursionError as error:
            raise InputError(
                f"'{path}' is nested too deep to be read, in its metadata or by messages that "
                f"contain themselves; record it anew."
            ) from error
        except MemoryError as error:
            raise InputError(
                f"'{path}' unpacks to more than there is memory for; split it (rosbag filter, or "
                f"ROS 2: ros2 bag convert)."
            ) from error
        except (AssertionError, LookupError) as error:  # of which the texts say nothing
            raise ValueError("its records contradict each other") from error


#: Messages that are found so many times on average are named again and again by a false index.
#: Where two bags were merged it is twice.
_MOST_REPEATED: Final = 10


def _connections(bag: Any, topic: str) -> list[Any]:
    """The connections by which a topic's messages came."""
    return [c for c in bag.connections if c.topic == topic and c.msgcount]


def _messages(bag: Any, topic: str) -> Iterator[tuple[int, Any]]:
    """Time of arrival in nanoseconds and content of all messages of a topic."""
    messages = bag.messages(connections=_connections(bag, topic))
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


def _survey(bag: Any) -> tuple[list[Topic], list[str]]:
    """What each topic holds, by its first message, and topics that hold nothing to be read."""
    topics: list[Topic] = []
    unreadable: list[str] = []
    definitions = bag.typestore.fielddefs
    for name in dict.fromkeys(connection.topic for connection in bag.connections):
        connections = _connections(bag, name)
        kinds = {c.msgtype for c in connections}
        if not connections:
            unreadable.append(f"{name} (no messages)")
        elif len(kinds) > 1:
            unreadable.append(f"{name} (messages of several types)")
        elif reason := unreadable_reason(kind := kinds.pop(), definitions):
            unreadable.append(f"{name} ({reason})")
        else:
            count = sum(c.msgcount for c in connections)
            with _naming_damage(bag.paths[0]):
                first = next(iter(bag.messages(connections=connections)), None)
                if first is None:
                    # The library finds those only whose quality of service both tell alike.
                    unreadable.append(
                        f"{name} (its {counted(count, 'message')} not found by the metadata: write "
                        "it anew with ros2 bag reindex)"
                    )
                    continue
                message = bag.deserialize(first[2], kind)
            topics.append(
                describe_topic(name, message, definitions, size=len(first[2]), count=count)
            )
    return topics, unreadable


#: Messages that are read from one progress to the next.
_STEP: Final = 50


def _fill(
    data: Sequence[TopicData], bag: Any, count: Callable[[str], Progress]
) -> Generator[Progress, None, None]:
    """Read all messages of what was chosen, topic by topic; `count` counts those of a topic.

    The library unpacks a chunk anew whenever the next message is of another one, which, over all
    topics together, may be every time.
    """
    for topic_data in data:
        topic = topic_data.topic.name
        for number, (arrived, message) in enumerate(_messages(bag, topic), start=1):
            topic_data.add(arrived, message)
            progress = count(topic)
            if number % _STEP == 0:
                yield progress


def _write_videos(
    bag: Any, pictures: Sequence[TimedRows], options: ReadOptions, count: Callable[[str], Progress]
) -> Generator[Progress, None, tuple[list[VideoReference], list[str]]]:
    """Write the pictures of each topic into a video; with remarks."""
    videos: list[VideoReference] = []
    remarks: list[str] = []
    if not pictures or options.unpack is None:
        return videos, remarks
    folder = Path(tempfile.mkdtemp(dir=options.unpack))
    for number, frames in enumerate(pictures):
        if not frames.rows.size:
            remarks += frames.remarks
            continue
        # What topics are called is a stranger's choice.
        path = folder / f"{number}-{re.sub(r'[^a-zA-Z0-9]+', '-', frames.name)[:80]}.mkv"
        messages = _messages(bag, frames.name)
        video, more = yield from write_video(messages, frames, path, count, strict=options.strict)
        videos += [video] if video is not None else []
        remarks += more
    return videos, remarks


def _tracks(
    data: Sequence[TopicData],
    aligned: AlignedStreams,
    definitions: Definitions,
    options: ReadOptions,
) -> tuple[tuple[Track, ...], list[str]]:
    """The labels as a track, with a remark on where they are from."""
    labelled = next((each for each in data if each.label is not None), None)
    if labelled is None:
        return (), []
    names = _constants(labelled, definitions)
    words = [names.get(word, word) for word in aligned.labels]
    different = dict.fromkeys(words)
    if options.label is None and len(different) < 2:
        return (), []  # a tag that was never set
    if len(different) > MOST_LABELS:
        text = (
            f"{labelled.label_address} holds {len(different):,} different values, too many to be "
            "actions"
        )
        if options.label is not None:
            raise InputError(f"{text}; name another field for the labels.")
        return (), [f"{text}; no labels were read."]
    actions = [kind for kind in different if not is_unlabelled(kind)]
    code = {action: number for number, action in enumerate(actions)}
    codes = np.array([code.get(word, UNLABELLED) for word in words], np.int64)
    segments = from_codes(codes, aligned.times, actions)
    remark = f"Labels were read from {labelled.label_address}: {', '.join(actions) or 'none'}."
    return ((Track(options.author, segments),) if segments else ()), [remark]


def _constants(labelled: TopicData, definitions: Definitions) -> dict[str, str]:
    """What the definition of a message calls the values of its label, by the value as a word."""
    *within, name = labelled.label or ("",)
    constants, fields = definitions[follow_path(labelled.topic.first, tuple(within)).__msgtype__]
    type_name = dict(fields)[name][1][0]
    pairs = [(str(value), word) for word, kind, value in constants if kind == type_name]
    values = [value for value, _ in pairs]
    return {value: word for value, word in pairs if values.count(value) == 1}


_SIGNAL_USE: Final[tuple[Use, ...]] = ("signal", "left out")
_LABEL_USE: Final[tuple[Use, ...]] = ("signal", "labels", "left out")


def preview(path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """What the fields of a bag's messages would be read as, by the first message of each topic.

    A row is a stamp, a label, or a group of numbers that belong together; its cells are these.
    """
    with _open_bag(path) as bag:
        topics, _ = _survey(bag)
    try:
        data = select_fields(topics, options)
    except InputError:
        if options.signals or options.leave_out or options.label:
            raise
        data = []  # no forces; something may be chosen
    rows: list[ColumnUse] = []
    for topic in topics:
        if is_picture(topic.first):
            rows.append(preview_pictures(topic, topics, options))
        else:
            rows += _rows(topic, data)
    return tuple(rows)


def _rows(topic: Topic, data: Sequence[TopicData]) -> Iterator[ColumnUse]:
    """What a topic holds, and what it is read as."""
    read = {field_.address for each in data for field_ in each.fields}
    labels = {each.label_address for each in data}
    if topic.stamp is not None:
        stamp = follow_path(topic.first, topic.stamp)
        cell = f"{stamp.sec}.{stamp.nanosec:09}"
        name = address_of(topic.name, topic.stamp)
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
