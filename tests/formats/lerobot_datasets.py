"""Small LeRobot datasets, laid out as their package writes or wrote them."""

import json

import numpy as np
import pytest

pa = pytest.importorskip("pyarrow")
pq = pytest.importorskip("pyarrow.parquet")

FORCES = ("fx1", "fy1", "fz1")
PLACES = {
    "v2": (
        "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
        "videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4",
    ),
    "v3": (
        "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4",
    ),
}


def vectors(names):
    return {"dtype": "float32", "shape": [len(names)], "names": list(names)}


FEATURES = {
    "observation.state": vectors(FORCES),
    "action": {"dtype": "float32", "shape": [2], "names": {"motors": ["grip", "lift"]}},
    "next.reward": {"dtype": "float32", "shape": [1], "names": None},
    "next.done": {"dtype": "bool", "shape": [1], "names": None},
}
INDICES = ("timestamp", "frame_index", "episode_index", "index", "task_index")


def episode_values(features, number, length, rng):
    """The columns of an episode, by feature."""
    values = {}
    for name, feature in features.items():
        size = int(np.prod(feature["shape"]))
        numbers = rng.normal(size=(length, size)).astype("float32")
        values[name] = numbers > 0 if feature["dtype"] == "bool" else numbers
    return values


def as_table(values, number, first, fps, task):
    """An episode's frames as their package stores them: vectors of fixed length, plain numbers."""
    length = len(next(iter(values.values())))
    columns = {}
    for name, array in values.items():
        flat = pa.array(array.ravel())
        vector = array.shape[1] > 1
        columns[name] = pa.FixedSizeListArray.from_arrays(flat, array.shape[1]) if vector else flat
    columns["timestamp"] = pa.array((np.arange(length) / fps).astype("float32"))
    columns["frame_index"] = pa.array(np.arange(length))
    columns["episode_index"] = pa.array(np.full(length, number))
    columns["index"] = pa.array(np.arange(first, first + length))
    columns["task_index"] = pa.array(np.full(length, task))
    return pa.table(columns)


def indexed_by(name, texts):
    """A table of texts and their numbers, whose index they are as pandas writes it."""
    table = pa.table({name: list(range(len(texts))), "__index_level_0__": list(texts)})
    pandas = {"index_columns": ["__index_level_0__"], "columns": []}
    return table.replace_schema_metadata({b"pandas": json.dumps(pandas).encode()})


def write_table(table, path):
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(table, path)


def write_dataset(
    folder,
    version="v3.0",
    lengths=(12, 15, 9, 11),
    tasks=("pull the pen", "squeeze the foam"),
    features=FEATURES,
    fps=30,
    per_file=3,
    cameras=None,
):
    """Write a dataset; gives the values of each episode, by feature.

    Files of data hold `per_file` episodes in v3, each a row group. Of `cameras` each has, in
    seconds, the stretch of its file in which an episode lies (v3): the files are not written.
    """
    rng = np.random.default_rng(len(lengths))
    v3 = version.startswith("v3")
    indices = {name: {"dtype": "int64", "shape": [1], "names": None} for name in INDICES}
    indices["timestamp"]["dtype"] = "float32"
    videos = {
        name: {"dtype": "video", "shape": [24, 32, 3], "names": ["height", "width", "channels"]}
        for name in cameras or ()
    }
    info = {
        "codebase_version": version,
        "robot_type": "tongs",
        "total_episodes": len(lengths),
        "total_frames": sum(lengths),
        "total_tasks": len(tasks),
        "chunks_size": 1000,
        "fps": fps,
        "splits": {"train": f"0:{len(lengths)}"},
        "data_path": PLACES[version[:2]][0],
        "video_path": PLACES[version[:2]][1] if cameras else None,
        "features": {**features, **videos, **indices},
    }
    (folder / "meta").mkdir(parents=True)
    text = json.dumps(info, indent=4, ensure_ascii=False)
    (folder / "meta/info.json").write_text(text, "utf-8")
    (folder / "meta/stats.json").write_text("{}", "utf-8")
    episodes, written, tables, first = [], [], {}, 0
    for number, length in enumerate(lengths):
        values = episode_values(features, number, length, rng)
        task = number % len(tasks)
        table = as_table(values, number, first, fps, task)
        row = {"episode_index": number, "tasks": [tasks[task]], "length": length}
        if v3:
            file = number // per_file
            row |= {"data/chunk_index": 0, "data/file_index": file}
            row |= {"dataset_from_index": first, "dataset_to_index": first + length}
            for camera, stretches in (cameras or {}).items():
                edges = dict(
                    zip(("from_timestamp", "to_timestamp"), stretches[number], strict=True)
                )
                places = {"chunk_index": 0, "file_index": 0, **edges}
                row |= {f"videos/{camera}/{name}": value for name, value in places.items()}
            row |= {"stats/action/mean": [0.0, 0.0], "meta/episodes/chunk_index": 0}
            name = f"data/chunk-000/file-{file:03d}.parquet"
        else:
            name = f"data/chunk-{number // 1000:03d}/episode_{number:06d}.parquet"
        tables.setdefault(name, []).append(table)
        episodes.append(row)
        written.append(values)
        first += length
    said = {"info": {"features": {name: {"_type": "Value"} for name in features}}}
    for name, parts in tables.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        metadata = {b"huggingface": json.dumps(said).encode()}
        schema = parts[0].schema.with_metadata(metadata)
        with pq.ParquetWriter(folder / name, schema, compression="snappy") as writer:
            for part in parts:
                writer.write_table(part.replace_schema_metadata(metadata))
    if v3:
        write_table(indexed_by("task_index", tasks), folder / "meta/tasks.parquet")
        write_table(
            pa.Table.from_pylist(episodes), folder / "meta/episodes/chunk-000/file-000.parquet"
        )
    else:
        named = [{"task_index": i, "task": task} for i, task in enumerate(tasks)]
        for name, rows in (("tasks", named), ("episodes", episodes)):
            lines = "".join(json.dumps(row) + "\n" for row in rows)
            (folder / f"meta/{name}.jsonl").write_text(lines, "utf-8")
    return written


def frames(folder):
    """All frames of a dataset, in the order of their files."""
    files = sorted(folder.glob("data/*/*.parquet"))
    return pa.concat_tables([pq.read_table(file) for file in files])


def subtasks(folder):
    """The subtask of every frame, as their package looks it up."""
    names = pq.read_table(folder / "meta/subtasks.parquet")["subtask"].to_pylist()
    return [names[number] for number in frames(folder)["subtask_index"].to_pylist()]
