"""``forcelab export``."""

from __future__ import annotations

import argparse
from pathlib import Path

from forcelab.cli.files import file_names, make_folder
from forcelab.cli.output import json_text
from forcelab.errors import InputError
from forcelab.formats.tracks import write_audacity, write_csv
from forcelab.labels import Track
from forcelab.project import Project


def run(arguments: argparse.Namespace) -> None:
    """Write every track, or the whole project, into a folder."""
    out: Path = arguments.out
    with Project.open(arguments.project) as project:
        written = (
            _archive(project, out)
            if arguments.format == "archive"
            else _tracks(project, out, arguments.format)
        )
    if arguments.json:
        print(json_text({"written": [str(path) for path in written]}))
        return
    for path in written:
        print(path)


def _archive(project: Project, out: Path) -> list[Path]:
    """Write the whole project as one zip named after it."""
    from forcelab.formats.archive import write_archive

    make_folder(out, [project.path])
    path = out / f"{project.path.resolve().stem}.zip"
    write_archive(project, path)
    return [path]


def _tracks(project: Project, out: Path, kind: str) -> list[Path]:
    """Write the tracks: as CSV a file a demonstration, for Audacity a file a track."""
    infos = [info for info in project.demonstrations() if info.authors]
    if not infos:
        raise InputError(f"'{project.path}' has no labels to export; label something first.")
    wanted: list[tuple[str, tuple[Track, ...]]] = []
    for info in infos:
        title = f"{info.task} - {info.name}" if info.task else info.name
        tracks = project.tracks(info.id)
        if kind == "csv":
            wanted.append((title, tracks))
        else:
            wanted += [(f"{title} - {track.author}", (track,)) for track in tracks]
    make_folder(out, [project.path])
    # Not NAME.csv: that is what recordings are called.
    suffix = ".labels.csv" if kind == "csv" else ".txt"
    names = file_names([title for title, _ in wanted])
    written = [out / f"{name}{suffix}" for name in names]
    for path, (_, tracks) in zip(written, wanted, strict=True):
        if kind == "csv":
            write_csv(path, tracks)
        else:
            write_audacity(path, tracks[0])
    return written
