"""Files with typed columns and streams as other programs write them, for tests and campaigns."""

import struct
from datetime import datetime
from pathlib import Path

import numpy as np

#: 2024-05-31 12:00:00 UTC in nanoseconds since 1970.
NOON = 1_717_156_800 * 10**9


def wobbling_stamps(count, start=NOON):
    """Nanoseconds about a millisecond apart, none two of them equally."""
    return start + np.cumsum(1_000_000 + np.random.default_rng(1).integers(-90_000, 90_000, count))


def forces(count, width=3):
    """Forces with as many digits as numbers have."""
    return np.random.default_rng(0).normal(size=(count, width))


def write_arrow(path: Path, columns, **options):
    """Write columns as Parquet, Feather or a stream of Arrow data, by the suffix."""
    import pyarrow as pa
    from pyarrow import feather, parquet

    table = columns if isinstance(columns, pa.Table) else pa.table(columns)
    if path.suffix == ".parquet":
        parquet.write_table(table, path, **options)
    elif path.suffix == ".feather":
        feather.write_feather(table, path, **options)
    else:
        with pa.OSFile(str(path), "wb") as file, pa.ipc.new_stream(file, table.schema) as stream:
            stream.write_table(table, **options)
    return path


def whole_arrow(folder: Path):
    """A file of each kind with columns of most types, plain and packed."""
    import pyarrow as pa

    values = forces(200)
    columns = {
        "time": pa.array(wobbling_stamps(200), pa.timestamp("ns", "UTC")),
        "fx [N]": values[:, 0],
        "fy": pa.array([None if i % 50 == 5 else v for i, v in enumerate(values[:, 1].tolist())]),
        "action": pa.array(["grab" if i // 40 % 2 else None for i in range(200)]),
        "label": pa.array([f"{i // 60}" for i in range(200)]).dictionary_encode(),
        "vector": pa.array(values.tolist(), pa.list_(pa.float32())),
        "pose": pa.array([{"x": float(v)} for v in values[:, 2]]),
        "on": pa.array(values[:, 0] > 0),
    }
    return [
        write_arrow(folder / "a.parquet", columns, row_group_size=64),
        write_arrow(folder / "b.parquet", columns, compression="zstd", use_dictionary=False),
        write_arrow(folder / "c.feather", columns, compression="uncompressed"),
        write_arrow(folder / "d.feather", columns, compression="lz4"),
        write_arrow(folder / "e.arrow", columns, max_chunksize=64),
    ]


def write_workbook(path: Path, sheets):
    """Write rows of cells by the title of their sheet."""
    import openpyxl

    book = openpyxl.Workbook()
    book.remove(book.active)
    for title, rows in sheets.items():
        sheet = book.create_sheet(title)
        for row in rows:
            sheet.append(list(row))
    book.save(path)
    return path


def whole_workbooks(folder: Path):
    """One with a sheet, and one with several."""
    values = forces(60).tolist()
    rows = [[i / 100, *row, "grab" if i // 20 % 2 else None] for i, row in enumerate(values)]
    table = [["time [s]", "fx", "fy", "fz", "label"], *rows]
    dates = [[datetime(2024, 5, 31, 12, 0, i), i / 7] for i in range(40)]
    return [
        write_workbook(folder / "a.xlsx", {"Sheet": table}),
        write_workbook(folder / "b.xlsx", {"one": table, "two": dates, "notes": [["mass", 3.2]]}),
    ]


def xdf_stream(name, samples, *, rate=0.0, kind="double64", stamps=None, offsets=(), **more):
    """A stream as :func:`write_xdf` takes it: `samples` of shape (n, c), or n words.

    `stamps` are of all samples, None where the reader has to count on by the rate; `offsets` are
    pairs of a time on the stream's clock and what has to be added there.
    """
    return {"name": name, "samples": samples, "rate": rate, "kind": kind, "stamps": stamps} | {
        "offsets": offsets, "type": "", "labels": (), "units": (), **more,
    }  # fmt: skip


def _number(value):
    """A number with how many bytes it has before it."""
    return struct.pack("<BB", 1, value) if value < 256 else struct.pack("<BI", 4, value)


def _chunk(tag, content):
    return _number(len(content) + 2) + struct.pack("<H", tag) + content


def _xdf_header(stream):
    channels = "".join(
        f"<channel><label>{label}</label><unit>{unit}</unit></channel>"
        for label, unit in zip(stream["labels"], stream["units"], strict=True)
    )
    first = stream["samples"][0] if len(stream["samples"]) else "x"
    width = 1 if isinstance(first, str) else len(first)
    return (
        f"<info><name>{stream['name']}</name><type>{stream['type']}</type>"
        f"<channel_count>{width}</channel_count><nominal_srate>{stream['rate']}</nominal_srate>"
        f"<channel_format>{stream['kind']}</channel_format>"
        f"<desc><channels>{channels}</channels></desc></info>"
    ).encode()


def xdf_content(*streams, block=50):
    """An XDF file, written from the specification; blocks of the streams alternate."""
    formats = {"double64": "<f8", "float32": "<f4", "int32": "<i4", "int16": "<i2"}
    parts = [b"XDF:", _chunk(1, b"<?xml version='1.0'?><info><version>1.0</version></info>")]
    parts += [
        _chunk(2, struct.pack("<I", number) + _xdf_header(stream))
        for number, stream in enumerate(streams, 1)
    ]
    longest = max(len(stream["samples"]) for stream in streams)
    for start in range(0, longest, block):
        for number, stream in enumerate(streams, 1):
            rows = stream["samples"][start : start + block]
            stamps = stream["stamps"][start : start + block]
            body = b""
            for row, stamp in zip(rows, stamps, strict=True):
                body += b"\0" if stamp is None else b"\x08" + struct.pack("<d", stamp)
                if isinstance(row, str):
                    body += _number(len(row.encode())) + row.encode()
                else:
                    body += np.asarray(row).astype(formats[stream["kind"]]).tobytes()
            if len(rows):
                parts.append(_chunk(3, struct.pack("<I", number) + _number(len(rows)) + body))
    parts.append(_chunk(5, bytes.fromhex("43a546dccbf5410fb30ed5467383cbe4")))
    for number, stream in enumerate(streams, 1):
        parts += [_chunk(4, struct.pack("<Idd", number, *pair)) for pair in stream["offsets"]]
        footer = f"<info><sample_count>{len(stream['samples'])}</sample_count></info>"
        parts.append(_chunk(6, struct.pack("<I", number) + footer.encode()))
    return b"".join(parts)


def write_xdf(path: Path, *streams):
    path.write_bytes(xdf_content(*streams))
    return path


def whole_xdf(folder: Path):
    """One with two streams and markers, one with a single irregular stream."""
    times = 5000 + np.arange(200) / 100
    slow = 5000 + np.arange(40) / 20
    counted_on = [t if i % 10 == 0 else None for i, t in enumerate(times)]
    return [
        write_xdf(
            folder / "a.xdf",
            xdf_stream(
                "Force", forces(200), rate=100, stamps=counted_on, type="Force",
                labels=("fx", "fy", "fz"), units=("N",) * 3, offsets=[(5000, 0.1), (5002, 0.1)],
            ),
            xdf_stream("Pose", forces(40), rate=20, stamps=slow, kind="float32"),
            xdf_stream(
                "Markers", ["grab", "hold", "rest"], stamps=[5000.2, 5000.9, 5001.5],
                kind="string", type="Markers",
            ),
        ),
        write_xdf(folder / "b.xdf", xdf_stream("Force", forces(200), stamps=times**1.001)),
    ]  # fmt: skip


def write_c3d(path: Path, analog, rate=1000.0, points=None, events=(), labels=None, units="N"):
    """Write analog channels, shape (n, c), and points, shape (m, p, 3), by the library.

    `events` are a context, a name and a time in seconds each.
    """
    import ezc3d

    file = ezc3d.c3d()
    parameters = file["parameters"]
    if len(analog):
        labels = labels or [f"F{axis}1" for axis in "xyz"][: analog.shape[1]]
        parameters["ANALOG"]["LABELS"]["value"] = labels
        parameters["ANALOG"]["UNITS"]["value"] = [units] * len(labels)
        parameters["ANALOG"]["RATE"]["value"] = [rate]
        file["data"]["analogs"] = analog.T[None]
    points = np.zeros((len(analog) // 10, 1, 3)) if points is None else points
    parameters["POINT"]["RATE"]["value"] = [rate / 10]
    parameters["POINT"]["LABELS"]["value"] = [f"P{i}" for i in range(points.shape[1])]
    parameters["POINT"]["UNITS"]["value"] = ["mm"] * points.shape[1]
    seen = np.concatenate([points.transpose(2, 1, 0), np.ones((1, *points.shape[1::-1]))])
    file["data"]["points"] = seen
    for context, name, time in events:
        file.add_event([0, time], context, name)
    file.write(str(path))
    return path


def whole_c3d(folder: Path):
    """One with everything, and one with analog channels alone."""
    events = [("Left", "Foot Strike", 0.05), ("Left", "Foot Off", 0.1), ("Right", "x", 0.02)]
    points = np.random.default_rng(2).normal(size=(20, 2, 3))
    return [
        write_c3d(folder / "a.c3d", forces(200), points=points, events=events),
        write_c3d(folder / "b.c3d", forces(200, 2)),
    ]


def write_tdms(path: Path, *segments):
    """Write channels by the library: of each segment group, name, values and properties."""
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as file:
        for segment in segments:
            file.write_segment(
                [ChannelObject(group, name, values, told) for group, name, values, told in segment]
            )
    return path


def waveform(rate, unit="N", start="2024-05-31T12:00:00.25", offset=0.0):
    """What LabVIEW tells of a channel."""
    return {
        "wf_increment": 1 / rate, "wf_start_offset": offset, "unit_string": unit,
        "wf_start_time": np.datetime64(start, "us"),
    }  # fmt: skip


def whole_tdms(folder: Path):
    """One with waveforms of two rates, one with a channel of times and one of words."""
    values = forces(100)
    force = [("Force", f"F{axis}", values[:, i], waveform(100)) for i, axis in enumerate("xyz")]
    temperature = ("Room", "Heat", values[:10, 0], waveform(10, "degC"))
    stamps = np.datetime64("2024-05-31T12:00:00", "us") + np.arange(50) * np.timedelta64(20, "ms")
    words = ["grab" if i // 10 % 2 else "" for i in range(50)]
    log = [
        ("Log", "Time", stamps, {}), ("Log", "fx", values[:50, 0], {}), ("Log", "what", words, {}),
    ]  # fmt: skip
    return [
        write_tdms(folder / "a.tdms", [*force, temperature], force),
        write_tdms(folder / "b.tdms", log),
    ]
