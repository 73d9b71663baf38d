"""A project that many tests begin with is made once, and copied."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Hashable
from functools import lru_cache
from pathlib import Path

__all__ = ["made_once"]


def made_once(make: Callable[..., object], path: Path, *given: Hashable) -> Path:
    """What ``make(path, *given)`` would make at `path`, copied from what it made the first time."""
    path.mkdir()
    for name, content in _made(make, given):
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_bytes(content) if content is not None else (path / name).mkdir()
    return path


@lru_cache(maxsize=64)
def _made(
    make: Callable[..., object], given: tuple[Hashable, ...]
) -> tuple[tuple[Path, bytes | None], ...]:
    """All files by their place in the folder; nothing for a folder."""
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "made"
        make(made, *given)
        return tuple(
            (place.relative_to(made), place.read_bytes() if place.is_file() else None)
            for place in sorted(made.rglob("*"))
        )
