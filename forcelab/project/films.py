"""What is said of a film in the store, whose file has a name that nobody gave it."""

from __future__ import annotations

import re
from pathlib import Path

__all__ = ["said_of_film"]

#: How files are called whose content names them.
_STORED = re.compile(r"[a-z]+-[0-9a-f]{16}(\.[a-z0-9]{1,8})?")


def said_of_film(sentence: str, path: Path, demonstration: str) -> str:
    """A sentence about a film in the name that people know: that of its demonstration.

    Parameters
    ----------
    sentence : str
        That quotes the file's name, or its path, which stays beside the name.
    path : Path
        The file; of one that is not in a store the sentence stays as it is.
    demonstration : str
        The demonstration's name.
    """
    if not _STORED.fullmatch(path.name):
        return sentence
    for quoted, where in ((str(path), f" ('{path}')"), (path.name, "")):
        told = f"the video of '{demonstration}'{where}"
        parts = re.split(rf"(?:The video )?'{re.escape(quoted)}'", sentence)
        if len(parts) > 1:
            sentence = told.join(parts)
            return sentence[:1].upper() + sentence[1:]
    return sentence
