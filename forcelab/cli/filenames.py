"""File names out of demonstrations' names."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["file_names"]


def file_names(names: Sequence[str]) -> list[str]:
    """A distinct, harmless file name for each name, alike on systems that ignore case."""
    taken: set[str] = set()
    result = []
    for name in names:
        base = "".join(c if c.isalnum() or c in " ._-()" else "_" for c in name).strip(" .") or "_"
        # Bytes, not characters, are what a file system limits, to 255.
        base = base.encode()[:200].decode(errors="ignore")
        free, number = base, 1
        while free.casefold() in taken:
            number += 1
            free = f"{base} ({number})"
        taken.add(free.casefold())
        result.append(free)
    return result
