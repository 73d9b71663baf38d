"""Files with typed columns and streams as other programs write them, for tests and campaigns."""

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
