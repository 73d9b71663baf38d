"""``forcelab predict``."""

from __future__ import annotations

import argparse
import csv
import io
import sys
from pathlib import Path

from forcelab.atomic import write_atomically
from forcelab.cli.filenames import file_names
from forcelab.cli.output import json_text
from forcelab.cli.sources import demonstrations_in
from forcelab.errors import InputError
from forcelab.formats.tracks import to_audacity, to_csv
from forcelab.labels import Track
from forcelab.recognition.storage import load


def run(arguments: argparse.Namespace) -> None:
    """Recognise every demonstration, then print or write the predicted tracks."""
    recogniser = load(arguments.recogniser)
    author = arguments.recogniser.stem
    found: list[tuple[str, Track]] = []
    for demonstration in demonstrations_in(arguments.sources):
        segments = recogniser.predict(demonstration).segments
        found.append((demonstration.name, Track(author, segments)))
    if arguments.json:
        print(json_text([_plain(name, track) for name, track in found]))
    if arguments.out is not None:
        _write(found, arguments.out, arguments.format)
    elif not arguments.json:
        sys.stdout.write(_shown(found, arguments.format))


def _plain(name: str, track: Track) -> dict[str, object]:
    """A predicted track as plain values."""
    segments = [{"start": s.start, "end": s.end, "action": s.action} for s in track.segments]
    return {"demonstration": name, "author": track.author, "segments": segments}


def _text(track: Track, kind: str) -> str:
    """One track in the format asked for."""
    return to_csv([track]) if kind == "csv" else to_audacity(track)


def _shown(found: list[tuple[str, Track]], kind: str) -> str:
    """What is printed: one track as its file would be, several with their names in front."""
    if len(found) == 1:
        return _text(found[0][1], kind)
    if kind == "audacity":
        raise InputError("A label track holds one demonstration; name a folder with --out.")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["demonstration", "start", "end", "action", "author"])
    for name, track in found:
        for s in track.segments:
            writer.writerow([name, repr(s.start), repr(s.end), s.action, track.author])
    return text.getvalue()


def _write(found: list[tuple[str, Track]], out: Path, kind: str) -> None:
    """Write one file, or one file a demonstration into a folder."""
    if len(found) == 1 and not out.is_dir():
        write_atomically(out, _text(found[0][1], kind).encode())
        return
    if out.exists() and not out.is_dir():
        raise InputError(f"'{out}' is a file; {len(found)} demonstrations need a folder.")
    texts = [_text(track, kind) for _, track in found]
    out.mkdir(parents=True, exist_ok=True)
    suffix = ".csv" if kind == "csv" else ".txt"
    for name, text in zip(file_names([name for name, _ in found]), texts, strict=True):
        write_atomically(out / f"{name}{suffix}", text.encode())
