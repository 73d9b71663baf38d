"""Folders to write into: made where they are missing, never inside a project."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from unicodedata import category, normalize

from forcelab.errors import InputError
from forcelab.project import Project

#: What no file's name may have under Windows.
REFUSED = '<>:"/\\|?*'
#: Names of devices there, whatever ending follows: what is written to such a file is lost.
DEVICES = re.compile(r"(CON|PRN|AUX|NUL|CONIN\$|CONOUT\$|(COM|LPT)[0-9¹²³]) *(\.|$)", re.IGNORECASE)
#: Nor characters of these kinds: control, half a pair, and none at all.
NO_NAME = ("Cc", "Cs", "Cn")


@contextmanager
def output_folder(path: Path, inputs: Sequence[Path] = ()) -> Iterator[None]:
    """Make a folder to write into unless it exists; it lies neither in an input nor in a project.

    After an error, folders that were made and are still empty are removed.
    """
    place = Path(os.path.realpath(path))  # of links in a circle, too
    for source in (source.resolve() for source in inputs if source.is_dir()):
        if source == place or source in place.parents:
            raise InputError(f"'{path}' lies in what is read here; write elsewhere.")
    stay_out_of_projects(path, place)
    new = [folder for folder in (place, *place.parents) if not os.path.lexists(folder)]
    try:
        try:
            path.mkdir(parents=True, exist_ok=True)
        except FileExistsError as error:
            raise InputError(f"'{path}' is a file; name a folder to write into.") from error
        except OSError as error:
            raise InputError(f"The folder '{path}' cannot be made: {error.strerror}.") from error
        yield
    except BaseException:
        for folder in new:  # the innermost first
            with suppress(OSError):
                folder.rmdir()
        raise


def stay_out_of_projects(path: Path, folder: Path) -> None:
    """Refuse to write into a project's folder."""
    for place in (folder, *folder.parents):
        if Project.is_at(place):
            raise InputError(f"'{path}' lies in the project '{place}'; write elsewhere.")


def file_names(names: Sequence[str]) -> list[str]:
    """A harmless file name for each name, distinct also where case or composition is ignored.

    Only characters that some system refuses are replaced: names in any script stay readable.
    """
    taken: set[str] = set()
    result = []
    for name in names:
        base = "".join("_" if c in REFUSED or category(c) in NO_NAME else c for c in name)
        base = base.strip(" .") or "_"
        base = f"_{base}" if DEVICES.match(base) else base
        # Bytes, not characters, are what a file system limits, to 255.
        base = base.encode()[:200].decode(errors="ignore")
        free, number = base, 1
        while (folded := normalize("NFC", free).casefold()) in taken:
            number += 1
            free = f"{base} ({number})"
        taken.add(folded)
        result.append(free)
    return result
