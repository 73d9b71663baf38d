"""``forcelab predict``."""

from __future__ import annotations

import argparse
import csv
import io
import sys
from pathlib import Path

from forcelab.atomic import write_atomically
from forcelab.cli.files import check_outputs, demonstrations_in, file_names, make_folder
from forcelab.cli.output import json_text
from forcelab.errors import InputError
from forcelab.formats.recording import ReadOptions
from forcelab.formats.tracks import to_audacity, to_csv
from forcelab.labels import Track, model_author
from forcelab.recognition.storage import load

SUFFIXES = {"csv": ".csv", "audacity": ".txt"}


def run(arguments: argparse.Namespace) -> None:
    """Recognise every demonstration, then print or write the predicted tracks."""
    check_outputs(
        [None if _is_folder(arguments.out) else arguments.out],
        [arguments.recogniser, *arguments.sources],
    )
    recogniser = load(arguments.recogniser)
    author = model_author(arguments.recogniser.stem)
    options = ReadOptions(rate=arguments.rate, time=arguments.time)
    found: list[tuple[str, Track]] = []
    for demonstration, remarks in demonstrations_in(arguments.sources, options):
        for remark in remarks:
            print(f"{demonstration.name}: {remark}", file=sys.stderr)
        segments = recogniser.predict(demonstration).segments
        found.append((demonstration.name, Track(author, segments)))
    if arguments.json:
        print(json_text([_plain(name, track) for name, track in found]))
    if arguments.out is not None:
        _write(found, arguments.out, arguments.format)
    elif not arguments.json:
        sys.stdout.write(_shown(found, arguments.format))


def _is_folder(out: Path | None) -> bool:
    """Whether an output is meant as a folder: it is one, or has no suffix of a file."""
    return out is not None and (out.is_dir() or out.suffix not in SUFFIXES.values())


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
    writer = csv.writer(text)
    writer.writerow(["demonstration", "start", "end", "action", "author"])
    for name, track in found:
        for s in track.segments:
            writer.writerow([name, repr(s.start), repr(s.end), s.action, track.author])
    return text.getvalue()


def _write(found: list[tuple[str, Track]], out: Path, kind: str) -> None:
    """Write one file, or one file a demonstration into a folder."""
    texts = [_text(track, kind) for _, track in found]
    if not _is_folder(out):
        if len(found) > 1:
            raise InputError(f"'{out}' is one file; {len(found)} demonstrations need a folder.")
        write_atomically(out, texts[0].encode())
        return
    make_folder(out)
    for name, text in zip(file_names([name for name, _ in found]), texts, strict=True):
        write_atomically(out / f"{name}{SUFFIXES[kind]}", text.encode())
