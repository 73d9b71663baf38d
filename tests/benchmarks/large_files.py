"""What files that are larger than the memory one would give them cost to import.

``python -m tests.benchmarks.large_files FOLDER [hdf5] [lerobot] [bag]``, from the checkout; FOLDER
needs 20 GB for all three and is left as it is found. Memory is that of the largest process of a
command, above that of the same command on a small file of the kind.

hdf5     4.3 GB of pictures beside one array of forces and their times
lerobot  a dataset of 10,000 episodes: listed, ten of them imported, all of them imported, and the
         window on that project beside the one on a project of ten
bag      10 GB: two wrenches, and two cameras of different rates that lose pictures, one raw and one
         as JPEG; 500 random times of each video are looked at
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from forcelab.project import Project
from forcelab.video.reader import VideoReader
from tests.factories import frame_number, numbered_frame
from tests.formats.lerobot_datasets import write_dataset
from tests.formats.rosbag_files import (
    COMPRESSED,
    IMAGE,
    WRENCH,
    compressed_image,
    image,
    wrench,
    write_bag,
)

EPISODES, PLACES = 10_000, 500
SIZE = (640, 480)


#: A process that is small when it starts a command: by what Linux counts, that begins as large.
LAUNCHER = """
import os, sys
_, status, usage = os.wait4(os.spawnv(os.P_NOWAIT, sys.argv[1], sys.argv[1:]), 0)
print(usage.ru_maxrss)
sys.exit(os.waitstatus_to_exitcode(status))
"""


def run(*arguments: str | Path) -> tuple[float, float]:
    """Seconds that a command of the program takes, and the largest memory of its processes, MB."""
    begun = time.perf_counter()
    command = [sys.executable, "-m", "forcelab", *map(str, arguments), "-q"]
    launched = [sys.executable, "-S", "-c", LAUNCHER, *command]
    done = subprocess.run(launched, check=True, capture_output=True, text=True)
    return time.perf_counter() - begun, int(done.stdout.split()[-1]) / 1000


def show(what: str, seconds: float, memory: float | None = None) -> None:
    """Print what was measured."""
    tail = "" if memory is None else f", {memory:.0f} MB of memory"
    print(f"  {what:<52} {seconds:7.2f} s{tail}", flush=True)


def write_hdf5(path: Path, samples: int, pictures: int) -> None:
    """Forces at 1 kHz and their times, 7 x float64, beside pictures."""
    import h5py

    random = np.random.default_rng(1)
    with h5py.File(path, "w") as file:
        group = file.create_group("data/demo_0/obs")
        group["force"] = random.normal(size=(samples, 6))
        group["time"] = np.arange(samples) / 1000
        stack = group.create_dataset("agentview_image", (pictures, 480, 640, 3), "u1")
        for number in range(pictures):
            stack[number] = random.integers(0, 255, (480, 640, 3), "u1")


def measure_hdf5(folder: Path) -> None:
    small, large = folder / "small.h5", folder / "large.h5"
    write_hdf5(small, 1_000, 1)
    write_hdf5(large, 2_500_000, 4_700)
    arrays = 2_500_000 * 7 * 8 / 1e6
    print(f"HDF5, {large.stat().st_size / 1e9:.1f} GB, of it forces and times of {arrays:.0f} MB:")
    _, least = run("import", folder / "small.forcelab", small)
    seconds, memory = run("import", folder / "large.forcelab", large)
    show(f"imported ({(memory - least) / arrays:.2f} times these)", seconds, memory - least)


def started(project: Path) -> float:
    """Seconds until the window is complete, of three starts the median."""
    taken = []
    for _ in range(3):
        begun = time.monotonic()
        environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
        command = [sys.executable, "-m", "tests.benchmarks.started", str(project)]
        done = subprocess.run(command, check=True, capture_output=True, env=environment)
        taken.append(float(done.stdout.split()[1]) - begun)
    return sorted(taken)[1]


def measure_lerobot(folder: Path) -> None:
    few, many = folder / "few", folder / "many"
    write_dataset(few, lengths=[50] * 10)
    write_dataset(many, lengths=[50] * EPISODES, per_file=500)
    projects = {path: path.with_suffix(".forcelab") for path in (few, many)}
    print(f"LeRobot, {EPISODES:,} episodes of 50 frames, beside 10:")
    _, least = run("import", projects[few], few)
    seconds, memory = run(
        "import", folder / "ten.forcelab", many, "--episodes", f"{EPISODES - 10}-{EPISODES - 1}"
    )
    show("the last ten imported", seconds, memory - least)
    seconds, memory = run("import", projects[many], many, "--episodes", f"0-{EPISODES - 1}")
    show("all imported", seconds, memory - least)
    _, least = run("list", projects[few])
    seconds, memory = run("list", projects[many])
    show("project listed", seconds, memory - least)
    show("window on the project of ten", started(projects[few]))
    show("window on the project of all", started(projects[many]))


def taken(rate: float, seconds: float, random: np.random.Generator) -> np.ndarray[Any, Any]:
    """When a camera takes pictures: unevenly, and it loses one in ten."""
    times = np.arange(int(rate * seconds)) / rate
    times = times + random.uniform(0, 0.6 / rate, times.size)
    return np.round(times[random.random(times.size) < 0.9], 9)


def write_cameras(path: Path, seconds: float) -> dict[str, np.ndarray[Any, Any]]:
    """A bag with two wrenches and two cameras; gives the stamps of the pictures."""
    random = np.random.default_rng(3)
    stamps = {
        "/right/image_raw": taken(30, seconds, random),
        "/left/image_raw/compressed": taken(12.5, seconds, random),
    }
    noise = random.integers(0, 255, (SIZE[1], SIZE[0], 3), np.uint8)

    def picture(number: int) -> np.ndarray[Any, Any]:
        return np.concatenate([numbered_frame(number, SIZE)[:64], noise[64:]])

    def raw() -> Iterator[tuple[float, dict[str, Any]]]:
        for number, at in enumerate(stamps["/right/image_raw"]):
            yield at + 0.3, image(at, picture(number))

    def coded() -> Iterator[tuple[float, dict[str, Any]]]:
        for number, at in enumerate(stamps["/left/image_raw/compressed"]):
            yield at + 0.03, compressed_image(at, picture(number))

    def forces(rate: float) -> Iterator[tuple[float, dict[str, Any]]]:
        for at in np.arange(int(rate * seconds)) / rate:
            yield at + 0.005, wrench(at, np.sin(at), np.cos(at), 1.0)

    topics = {
        "/wrist/ft": (WRENCH, forces(500)),
        "/table/ft": (WRENCH, forces(61)),
        "/right/image_raw": (IMAGE, raw()),
        "/left/image_raw/compressed": (COMPRESSED, coded()),
    }
    write_bag(path, topics, ros=2)
    return stamps


def wrong_frames(project: Path, stamps: dict[str, np.ndarray[Any, Any]]) -> int:
    """How many of the random times of all videos show another picture than the last one by then."""
    wrong, random = 0, np.random.default_rng(4)
    with Project.open(project) as opened:
        (info,) = opened.demonstrations.infos()
        demonstration = opened.demonstrations.load(info.id)
        assert len(demonstration.channels) == 12
        for video in demonstration.videos:
            times = stamps[video.name]
            with VideoReader(video.path, cache=1) as reader:
                assert len(reader) == times.size
                for at in random.uniform(times[0], times[-1], PLACES):
                    number = reader.index_at(float(video.clock.to_device(at)))
                    right = number == np.flatnonzero(times <= at)[-1]
                    wrong += not (right and frame_number(reader.frame(number)) == number)
    return wrong


def measure_bag(folder: Path) -> None:
    small, large = folder / "small", folder / "large"
    write_cameras(small, 2.0)
    stamps = write_cameras(large, 360.0)
    size = sum(file.stat().st_size for file in large.iterdir())
    pictures = sum(times.size for times in stamps.values())
    print(f"ROS 2 bag, {size / 1e9:.1f} GB, {pictures:,} pictures of two cameras:")
    _, least = run("import", folder / "small.forcelab", small)
    seconds, memory = run("import", folder / "large.forcelab", large)
    show("imported", seconds, memory - least)
    wrong = wrong_frames(folder / "large.forcelab", stamps)
    print(
        f"  {wrong} of {PLACES * len(stamps):,} random times show another picture than they should"
    )


MEASURES = {"hdf5": measure_hdf5, "lerobot": measure_lerobot, "bag": measure_bag}

if __name__ == "__main__":
    for name in sys.argv[2:] or MEASURES:
        with tempfile.TemporaryDirectory(dir=sys.argv[1]) as temporary:
            MEASURES[name](Path(temporary))
