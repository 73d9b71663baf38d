"""A small project, and demonstrations to put into it."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from forcelab.demonstration import Channel, Demonstration
from forcelab.project import Project

Make = Callable[..., Demonstration]

#: Most tests are not about the disk, and every commit waits for it: they run in memory.
MEMORY = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None


@pytest.fixture
def tmp_path() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(dir=MEMORY) as folder:
        yield Path(folder)


@pytest.fixture
def make() -> Make:
    """Make a demonstration whose content depends on its seed alone."""

    def build(seed: int = 0, name: str = "01", task: str = "LEGO", **more: object) -> Demonstration:
        random = np.random.default_rng(seed)
        times = np.cumsum(random.uniform(0.0005, 0.0015, 500))
        signals = random.normal(size=(500, 2))
        signals[7, 1] = np.nan
        channels = (Channel("fx", "N"), Channel("fz", "N"))
        return Demonstration(name, task, times, signals, channels, **more)  # type: ignore[arg-type]

    return build


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "study.forcelab"


@pytest.fixture
def project(path: Path) -> Iterator[Project]:
    with Project.create(path) as project:
        yield project
