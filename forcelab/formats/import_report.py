"""What an import did, and what is to be said of the files it read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from forcelab.errors import InputError
from forcelab.formats.recording import Recording
from forcelab.project import Added
from forcelab.text import listed

__all__ = ["ImportReport", "Imported", "report_of"]

#: So many files of which the same is to be remarked are named.
SHARING = 3


@dataclass(frozen=True, slots=True)
class Imported:
    """What became of one demonstration.

    Parameters
    ----------
    file : Path
        Where it was read from.
    added : Added
        Its name in the project, and whether it is new, updated or unchanged.
    """

    file: Path
    added: Added


@dataclass(frozen=True, slots=True)
class ImportReport:
    """What an import did.

    Parameters
    ----------
    demonstrations : tuple of Imported
        In the order of the files and, within a file, in the file's order.
    remarks : mapping of Path to tuple of str
        For each file that gave cause: a sentence for each thing that was dropped, repaired or is
        worth a look.
    statistics : mapping of str to int
        What the formats counted while they read, added up over all files.
    unread : mapping of Path to str
        The files that could not be read and were left out, each with the reason.
    """

    demonstrations: tuple[Imported, ...] = ()
    remarks: Mapping[Path, tuple[str, ...]] = field(default_factory=dict)
    statistics: Mapping[str, int] = field(default_factory=dict)
    unread: Mapping[Path, str] = field(default_factory=dict)

    def count(self, status: str) -> int:
        """How many demonstrations are ``"new"``, ``"updated"`` or ``"unchanged"``."""
        return sum(one.added.status == status for one in self.demonstrations)

    def told(self) -> tuple[str, ...]:
        """A line for each remark; where it is the same for several files, one line for all."""
        files: dict[str, list[str]] = {}
        for path, remarks in self.remarks.items():
            for remark in dict.fromkeys(remarks):
                files.setdefault(remark, []).append(path.name)
        return tuple(f"{listed(names, SHARING)}: {remark}" for remark, names in files.items())


def report_of(
    read_files: Mapping[Path, Sequence[Recording]],
    demonstrations: tuple[Imported, ...],
    failures: Mapping[Path, InputError],
) -> ImportReport:
    """The report on files that were read, on what became of what they hold, and on the others."""
    return ImportReport(
        demonstrations,
        _remarks(read_files, demonstrations),
        _counted(read_files),
        {path: str(error) for path, error in failures.items()},
    )


def _remarks(
    read_files: Mapping[Path, Sequence[Recording]], demonstrations: Sequence[Imported]
) -> dict[Path, tuple[str, ...]]:
    """The remarks of the formats, then those of the project, by file."""
    remarks = {
        file: [remark for recording in recordings for remark in recording.remarks]
        for file, recordings in read_files.items()
    }
    changed = {one.file for one in demonstrations if one.added.status != "unchanged"}
    for file in changed:
        remarks[file] += dict.fromkeys(r.left for r in read_files[file] if r.left)
    for one in demonstrations:
        remarks[one.file] += one.added.remarks
    return {file: tuple(sentences) for file, sentences in remarks.items() if sentences}


def _counted(read_files: Mapping[Path, Sequence[Recording]]) -> dict[str, int]:
    """What the formats counted, added up."""
    total: dict[str, int] = {}
    for recordings in read_files.values():
        for recording in recordings:
            for name, number in recording.statistics.items():
                total[name] = total.get(name, 0) + number
    return total
