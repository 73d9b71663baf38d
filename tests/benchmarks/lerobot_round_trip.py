"""A dataset that LeRobot's package writes: imported, labelled, exported, and read by it again.

``python -m tests.benchmarks.lerobot_round_trip PYTHON FOLDER``, from the checkout, where PYTHON is
an interpreter that has the package lerobot. Episodes are the real recordings of the tongs, every
20th sample of 1 kHz from three beginnings, with two cameras in AV1 whose pictures show the number
of the frame.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

EPISODES, STEP, FPS = 50, 20, 50
CAMERAS = ("observation.images.top", "observation.images.side")
WIDTH, HEIGHT, BITS = 96, 64, 12
AXES = ["fx1", "fy1", "fz1", "fx2", "fy2", "fz2"]


def picture(number: int, camera: int) -> Any:
    """A picture whose upper half shows a number as bars, and whose lower half the camera."""
    image = np.full((HEIGHT, WIDTH, 3), 60 + 100 * camera, np.uint8)
    for bit in range(BITS):
        bar = slice(bit * WIDTH // BITS, (bit + 1) * WIDTH // BITS)
        image[: HEIGHT // 2, bar] = 230 if number >> bit & 1 else 20
    return image


def shown(image: Any) -> tuple[int, int]:
    """Number and camera of a decoded picture."""
    bars = image[: HEIGHT // 2].mean(axis=(0, 2)).reshape(BITS, -1).mean(axis=1)
    number = sum(1 << bit for bit in range(BITS) if bars[bit] > 125)
    return number, int(image[HEIGHT // 2 + 4 :].mean() > 110)


# What follows until the next line of this kind is run by the interpreter that has lerobot.


def write(folder: Path) -> None:
    """Write the dataset with their package, in files that are smaller than they make them."""
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    cameras = {
        name: {"dtype": "video", "shape": (HEIGHT, WIDTH, 3), "names": ["h", "w", "c"]}
        for name in CAMERAS
    }
    features = {
        "observation.state": {"dtype": "float32", "shape": (6,), "names": AXES},
        "action": {"dtype": "float32", "shape": (2,), "names": {"axes": ["grip", "lift"]}},
        **cameras,
    }
    dataset = LeRobotDataset.create(
        "tongs/pen", fps=FPS, features=features, root=folder / "pen", streaming_encoding=True
    )
    dataset.meta.info["data_files_size_in_mb"] = 0.15
    dataset.meta.info["video_files_size_in_mb"] = 0.25
    source = np.load(folder / "source.npz")
    for number, task in enumerate(source["tasks"].tolist()):
        for index, forces in enumerate(source[f"forces{number}"]):
            pictures = {name: picture(index, place) for place, name in enumerate(CAMERAS)}
            action = np.array([number, index], np.float32)
            dataset.add_frame(
                {"observation.state": forces, "action": action, "task": task, **pictures}
            )
        dataset.save_episode()
    dataset.finalize()


def look(folder: Path) -> None:
    """Every frame's subtask as their loader gives it; pictures of one frame in 20 are decoded."""
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    dataset = LeRobotDataset("tongs/pen", root=folder / "pen", video_backend="pyav")
    query, rows = dataset._query_videos, []
    for index in range(len(dataset)):
        decoded = index % 20 == 0
        dataset._query_videos = query if decoded else lambda *_: {}
        item = dataset[index]
        row = [int(item["episode_index"]), float(item["timestamp"]), item["subtask"], item["task"]]
        if decoded:
            image = (item[CAMERAS[1]].numpy().transpose(1, 2, 0) * 255).round()
            assert shown(image) == (int(item["frame_index"]), 1)
        rows.append(row)
    (folder / "seen.json").write_text(json.dumps(rows), "utf-8")


# From here on it is forcelab's interpreter.


def episodes(data: Path) -> list[tuple[Any, str, Any]]:
    """Forces, task and human labels of each episode."""
    from forcelab.formats import read

    tasks = {"JPen_sig.pdl": "pull the pen out of its holder", "soft_sig.pdl": "squeeze the foam"}
    result = []
    for begin in range(0, STEP, STEP // 3):
        for name, task in tasks.items():
            for recording in read(data / name):
                forces = recording.demonstration.signals[begin::STEP].astype(np.float32)
                result.append((forces, task, recording.tracks[0].segments))
    return result[:EPISODES]


def check_pictures(path: Path) -> int:
    """Look whether each frame's pictures are shown at its time; gives how many there are."""
    from forcelab.jobs import finish
    from forcelab.project import Project
    from forcelab.video.index import indexing
    from forcelab.video.reader import VideoReader

    checked = 0
    with Project.open(path) as project:
        for info in project.demonstrations.infos():
            demonstration = project.demonstrations.load(info.id)
            for camera, video in enumerate(demonstration.videos):
                index = finish(indexing(video.path))
                times = video.clock.to_force(index.times)
                with VideoReader(video.path, index) as reader:
                    for number, at in enumerate(demonstration.times):
                        place = int(np.argmin(np.abs(times - at)))
                        assert abs(times[place] - at) < 1e-4
                        assert shown(reader.frame(place)) == (number, camera)
                        checked += 1
            assert [video.name for video in demonstration.videos] == ["top", "side"]
    return checked


def digests(folder: Path) -> dict[str, str]:
    """A hash of every file, and of each column of files of frames."""
    import pyarrow.parquet as pq

    found = {}
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        name = str(path.relative_to(folder))
        found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
        if name.startswith("data/"):
            table = pq.read_table(path)
            for column in table.column_names:
                values = json.dumps(table[column].to_pylist()).encode()
                kind = str(table.schema.field(column).type)
                found[f"{name}: {column} {kind}"] = hashlib.sha256(values).hexdigest()
    return found


def main(python: str, folder: Path) -> None:
    """Write, import, label, export, read; say what was compared."""
    from forcelab.cli import main as forcelab
    from forcelab.project import Project

    folder.mkdir(parents=True)
    source = episodes(Path(__file__).resolve().parents[3] / "shared" / "data" / "tongs")
    arrays = {f"forces{number}": forces for number, (forces, _, _) in enumerate(source)}
    np.savez(folder / "source.npz", tasks=[task for _, task, _ in source], **arrays)
    peer = [python, __file__]
    subprocess.run([*peer, "write", str(folder)], check=True)
    dataset, project = folder / "pen", folder / "study.forcelab"
    before = digests(dataset)
    started = time.perf_counter()
    assert forcelab(["import", str(project), str(dataset)]) == 0
    print(f"imported in {time.perf_counter() - started:.1f} s")
    labels: dict[int, Any] = {}
    with Project.open(project) as opened:
        for info in opened.demonstrations.infos():
            number = int(info.name.rpartition("-")[2])
            forces, task, labels[number] = source[number]
            assert info.task == task
            np.testing.assert_array_equal(opened.demonstrations.load(info.id).signals, forces)
            opened.tracks.edit(info.id, "coder", (), labels[number], "painted")
        print(f"{len(labels)} demonstrations have the forces and tasks of their episodes")
    print(f"{check_pictures(project):,} pictures are those of their frames")
    started = time.perf_counter()
    assert forcelab(["export", str(project), "--format", "lerobot", "--into", str(dataset)]) == 0
    print(f"exported in {time.perf_counter() - started:.1f} s")
    after = digests(dataset)
    files = {name for name in before if name.startswith("data/") and ":" not in name}
    different = {name for name in {*before, *after} if before.get(name) != after.get(name)}
    new = {f"{name}: subtask_index int64" for name in files}
    assert different == files | new | {"meta/info.json", "meta/subtasks.parquet"}, different
    print(f"{len(before) - len(files) - 1} hashes of other files and columns are as they were")
    subprocess.run([*peer, "look", str(folder)], check=True)
    rows = json.loads((folder / "seen.json").read_text("utf-8"))
    wrong = 0
    for episode, stamp, subtask, task in rows:
        at = round(stamp * FPS) / FPS
        actions = [s.action for s in labels[episode] if s.start <= at < s.end]
        wrong += subtask != (actions[0] if actions else "unlabelled")
        assert task == source[episode][1]
    names = sorted({row[2] for row in rows})
    print(f"{len(rows):,} frames read by lerobot: {wrong} with another subtask than their label")
    print(f"subtasks: {', '.join(names)}")
    assert not wrong


if __name__ == "__main__":
    if sys.argv[1] in ("write", "look"):
        {"write": write, "look": look}[sys.argv[1]](Path(sys.argv[2]))
    else:
        main(sys.argv[1], Path(sys.argv[2]))
