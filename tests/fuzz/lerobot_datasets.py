"""LeRobot datasets as a stranger might send them: descriptions, tables, videos and bytes changed.

Run by hand: ``python tests/fuzz/lerobot_datasets.py --count 5000 --seed 0``.
"""

import json
import random
import shutil
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2]))

import campaign
import pyarrow as pa
import pyarrow.parquet as pq
from campaign import Campaign, run
from factories import GOP_250, even_frame_times, numbered_frame, write_video
from ros_bags import change_bytes

from forcelab.cli import main
from forcelab.labels import Segment
from forcelab.project import Project
from forcelab.video.codecs import opencv
from tests.formats.lerobot_datasets import write_dataset

campaign.MEMORY = 2**30
CAMERA = "observation.images.top"
VALUES = (
    None, True, -1, 0, 1, 2**31, 2**63, 10**40, 1e308, float("inf"), "", "v2.0", "v2.1", "v3.0",
    "../../canaries/canary.mp4", "/etc/passwd", "{x.__class__}", "{chunk_index:099d}", "\0",
    "\ud800", "x" * 100_000, [], {}, [1, [2]], {"a": {"b": []}}, "float64", "bool", "video",
    "image", "string", "int64", [2**31 - 1], [3, 3, 3], list(range(50_000)),
)  # fmt: skip
COLUMNS = (
    lambda n: pa.array([None] * n, pa.float64()),
    lambda n: pa.array([float("nan")] * n),
    lambda n: pa.array([1e308] * n),
    lambda n: pa.array(["x"] * n),
    lambda n: pa.array(["x" * 2000] * n),
    lambda n: pa.array([-(2**63)] * n),
    lambda n: pa.array([2**63 - 1] * n),
    lambda n: pa.array([2**64 - 1] * n, pa.uint64()),
    lambda n: pa.array([[1.0]] * n),
    lambda n: pa.array([[[1.0], None]] * n),
    lambda n: pa.array([{"a": 1}] * n),
    lambda n: pa.array([b"\xff\xfe"] * n),
    lambda n: pa.array(list(range(n))[::-1]),
    lambda n: pa.array([0] * n),
    lambda n: pa.array(["a"] * n).dictionary_encode(),
    lambda n: pa.array([1] * n, pa.timestamp("ns")),
    pa.nulls,
)


def whole_datasets(folder: Path) -> list[tuple[Path, Path]]:
    """Datasets of each version, labelled, and the project that each was imported into."""
    result = []
    for version in ("v2.0", "v2.1", "v3.0"):
        dataset, project = folder / version / "pen", folder / version / "p.forcelab"
        stretches = [(0.0, 0.2), (0.2, 0.2 + 5 / 30)]
        write_dataset(dataset, version, lengths=(6, 5), cameras={CAMERA: stretches})
        for number in range(2):
            name = f"videos/chunk-000/{CAMERA}/episode_{number:06d}.mp4"
            if version == "v3.0":
                name = f"videos/{CAMERA}/chunk-000/file-000.mp4"
            (dataset / name).parent.mkdir(parents=True, exist_ok=True)
            write_video(dataset / name, "libx264", even_frame_times(11), GOP_250)
        if version == "v3.0":
            add_pictures(dataset)
        assert main(["import", str(project), str(dataset)]) == 0
        with Project.open(project) as opened:
            for info in opened.demonstrations.infos():
                opened.tracks.edit(info.id, "a", (), (Segment(0.0, 0.1, "grab"),), "painted")
        assert main(["export", str(project), "--format", "lerobot", "--into", str(dataset)]) == 0
        result.append((dataset, project))
    return result


def add_pictures(dataset: Path) -> None:
    """Put a camera's pictures among the numbers."""
    file, info = dataset / "data/chunk-000/file-000.parquet", dataset / "meta/info.json"
    contents = [opencv().imencode(".png", numbered_frame(i))[1].tobytes() for i in range(11)]
    images = pa.array([{"bytes": content, "path": None} for content in contents])
    pq.write_table(pq.read_table(file).append_column("observation.image", images), file)
    described = json.loads(info.read_text("utf-8"))
    described["features"]["observation.image"] = {"dtype": "image", "shape": [64, 384, 3]}
    info.write_text(json.dumps(described), "utf-8")


def change_json(value: Any, chance: random.Random) -> Any:
    """The same with another value, a key less or one more somewhere."""
    if isinstance(value, dict) and value and chance.random() < 0.9:
        key = chance.choice(list(value))
        kind = chance.random()
        if kind < 0.15:
            return {name: v for name, v in value.items() if name != key}
        if kind < 0.3:
            odd = chance.choice(("", "../x", "observation", "timestamp", "fx1", "\0", "a.b", key))
            return {**value, odd: value[key]}
        return {**value, key: change_json(value[key], chance)}
    if isinstance(value, list) and value and chance.random() < 0.5:
        place = chance.randrange(len(value))
        return [*value[:place], change_json(value[place], chance), *value[place + 1 :]]
    return chance.choice(VALUES)


def change_lines(file: Path, chance: random.Random) -> None:
    """Another value in an object of a file of JSON, or of JSON lines."""
    lines = file.read_text("utf-8").splitlines() if file.suffix == ".jsonl" else [file.read_text()]
    place = chance.randrange(len(lines))
    lines[place] = json.dumps(change_json(json.loads(lines[place]), chance))
    file.write_text("\n".join(lines), "utf-8")


def change_table(file: Path, chance: random.Random) -> None:
    """Another column, or one more or less, or other rows."""
    table = pq.read_table(file)
    place = chance.randrange(table.num_columns)
    name = table.column_names[place]
    kind = chance.random()
    if kind < 0.7:
        table = table.set_column(place, name, chance.choice(COLUMNS)(len(table)))
    elif kind < 0.8:
        table = table.drop([name])
    elif kind < 0.9:
        table = table.slice(chance.randrange(len(table)))
    else:
        table = table.append_column(chance.choice(table.column_names), table[name])
    pq.write_table(table, file, compression=chance.choice(("none", "zstd", "gzip", "snappy")))


def mutate(whole: list[tuple[Path, Path]], place: Path, chance: random.Random) -> list[list[str]]:
    """Change a file of a dataset, and read and write it."""
    source, project = chance.choice(whole)
    shutil.copytree(source, place / "pen")
    shutil.copytree(project, place / "q.forcelab")
    files = sorted(p for p in (place / "pen").rglob("*") if p.is_file() and p.stat().st_size > 99)
    file = chance.choice(files)
    if chance.random() < 0.4:
        file = place / "pen/meta/info.json"
    if file.suffix == ".parquet" and chance.random() < 0.5:
        change_table(file, chance)
    elif file.suffix in (".json", ".jsonl") and chance.random() < 0.8:
        change_lines(file, chance)
    else:
        change_bytes(file, chance)
    dataset = str(place / "pen")
    return [
        ["import", str(place / "p.forcelab"), dataset, "--signal", "action"],
        ["export", str(place / "q.forcelab"), "--format", "lerobot", "--into", dataset],
    ]


if __name__ == "__main__":
    run(__doc__, Campaign("dataset", whole_datasets, mutate))
