"""Small ROS bags: messages are dictionaries, what they leave out is zero or empty."""

from functools import cache

import cv2
import numpy as np
import pytest

pytest.importorskip("rosbags")

from rosbags.interfaces import Nodetype
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

#: When the bags begin, in nanoseconds since 1970.
BEGIN = 1_700_000_000 * 10**9
WRENCH = "geometry_msgs/msg/WrenchStamped"
IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"


def stamp(seconds):
    """A time as messages hold it, so many seconds after the bags begin."""
    whole, rest = divmod(BEGIN + round(seconds * 1e9), 10**9)
    return {"sec": whole, "nanosec": rest}


def wrench(seconds, *values):
    """A stamped wrench."""
    names = "xyz"
    force = dict(zip(names, values[:3], strict=False))
    torque = dict(zip(names, values[3:], strict=False))
    return {"header": {"stamp": stamp(seconds)}, "wrench": {"force": force, "torque": torque}}


def wrenches(count=50, rate=100.0, start=0.0):
    """Stamped wrenches with the number of each as its force fx; they arrive 5 ms late."""
    times = [start + i / rate for i in range(count)]
    return [(t + 0.005, wrench(t, float(i))) for i, t in enumerate(times)]


def image(seconds, picture, encoding="rgb8", padding=0, **fields):
    """A picture as it is, (height, width, ...), with rows that are so many bytes longer."""
    height, width = picture.shape[:2]
    rows = np.ascontiguousarray(picture).reshape(height, -1).view(np.uint8)
    rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=77)
    return {
        "header": {"stamp": stamp(seconds)},
        "height": height,
        "width": width,
        "encoding": encoding,
        "step": rows.shape[1],
        "data": rows.ravel(),
    } | fields


def compressed_image(seconds, picture, kind="jpeg"):
    """A picture of red, green and blue in a file of JPEG or PNG; bytes stay as they are."""
    data = picture
    if not isinstance(picture, bytes):
        data = cv2.imencode(f".{kind}", picture[:, :, ::-1])[1].tobytes()
    return {
        "header": {"stamp": stamp(seconds)},
        "format": kind,
        "data": np.frombuffer(data, np.uint8),
    }


def write_bag(path, topics, definitions=None, *, ros=1, storage="mcap", compression=None):
    """Write a bag.

    Parameters
    ----------
    path : Path
        The file, or the folder of a ROS 2 bag.
    topics : dict of str to (str, list)
        Each with the type of its messages and these: pairs of seconds of arrival and a message.
    definitions : dict of str to str, optional
        Types besides the common ones.
    compression : str, optional
        Of a ROS 1 bag: bz2 or lz4.
    """
    stores = Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_JAZZY
    store = get_typestore(stores) if definitions else _common_types(stores)
    for kind, text in (definitions or {}).items():
        store.register(get_types_from_msg(text, kind))
    plugin = {"mcap": StoragePlugin.MCAP, "db3": StoragePlugin.SQLITE3}[storage]
    writer = Writer1(path) if ros == 1 else Writer2(path, version=9, storage_plugin=plugin)
    if compression:
        writer.set_compression(Writer1.CompressionFormat[compression.upper()])
    serialize = store.serialize_ros1 if ros == 1 else store.serialize_cdr
    with writer:
        for topic, (kind, messages) in topics.items():
            connection = writer.add_connection(topic, kind, typestore=store)
            for seconds, fields in messages:
                data = serialize(_message(store, kind, fields), kind)
                writer.write(connection, BEGIN + round(seconds * 1e9), data)
    return path


@cache
def _common_types(stores):
    """A store that keeps what it compiles of messages for the next bag."""
    return get_typestore(stores)


def digest(kind, text):
    """The MD5 sum by which ROS 1 knows a definition; of one that contains itself there is none."""
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(text, kind))
    try:
        return store.generate_msgdef(kind)[1]
    except RecursionError:
        return "0" * 32


def _message(store, kind, fields):
    """A message of some type."""
    values = {
        name: _value(store, desc, fields.get(name)) for name, desc in store.fielddefs[kind][1]
    }
    assert fields.keys() <= values.keys()
    return store.types[kind](**values)


def _value(store, desc, value):
    """A field's value."""
    kind, inner = desc
    if kind == Nodetype.NAME:
        return _message(store, inner, value or {})
    if kind == Nodetype.BASE:
        return value if value is not None else ("" if inner[0] == "string" else 0)
    of, name = inner[0]
    if of == Nodetype.NAME:
        return [_message(store, name, element) for element in value or []]
    if name[0] == "string":
        return list(value or [])
    length = inner[1] if kind == Nodetype.ARRAY else 0
    return np.array([0] * length if value is None else value, dtype=name[0])
