"""Label recordings with a recogniser.

Prints the segments or writes them: a file for one demonstration, a folder of files for
several. Tracks of projects are not changed.

for example:
  forcelab predict stylus.skops new.csv
  forcelab predict stylus.skops lab.forcelab --out predicted
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from forcelab.cli.files import check_outputs, demonstrations_in
from forcelab.cli.options import add_column_options, add_file, add_json, columns_from, path_of
from forcelab.cli.output import STANDARD_OUTPUT, json_text, print_remark
from forcelab.errors import InputError
from forcelab.formats.output_folder import file_names, output_folder
from forcelab.formats.recording import ReadOptions
from forcelab.formats.track_text import COLUMNS, plain_times, table_text, to_audacity, to_csv
from forcelab.io import write_atomically
from forcelab.labels import Track, model_author
from forcelab.recognition.results import empty_prediction_remarks
from forcelab.recognition.storage import load_recogniser

#: Endings of the files in a folder. They are neither those of recordings, which they must not
#: replace, nor those of labels, which are read with the recording beside them.
ENDINGS = {"csv": ".predicted.csv", "audacity": ".predicted.txt"}


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "recogniser", metavar="RECOGNISER", type=path_of, help="file that train wrote"
    )
    parser.add_argument(
        "sources",
        metavar="FILE|PROJECT",
        type=Path,
        nargs="+",
        help="recordings or projects; - is a recording from standard input",
    )
    add_file(parser, "--out", "file (-, standard output), or folder for several")
    group = parser.add_argument_group("how recordings are read")
    group.add_argument(
        "--rate", metavar="HZ", type=float, help="of recordings without a column of times"
    )
    add_column_options(group)
    parser.add_argument(
        "--format",
        choices=("csv", "audacity"),
        default="csv",
        help="start,end,action,author (csv), or a label track",
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    inputs = [arguments.recogniser, *arguments.sources]
    out: Path | None = arguments.out
    if not _is_folder(out):
        check_outputs([out, STANDARD_OUTPUT if arguments.json else None], inputs)
    recogniser = load_recogniser(arguments.recogniser)
    author = model_author(arguments.recogniser.stem)
    options = ReadOptions(rate=arguments.rate, **columns_from(arguments))
    tracks: list[tuple[str, Track]] = []
    for demonstration, remarks in demonstrations_in(arguments.sources, options):
        # First, as it names the demonstration that lacks a channel.
        predicted = recogniser.predict(demonstration)
        warnings = [
            *recogniser.rate_remarks(1.0 / demonstration.period),
            *recogniser.unit_remarks(demonstration.channels),
        ]
        warnings += empty_prediction_remarks([predicted], recogniser.settings, recogniser.rate)
        for sentence in [*remarks, *warnings]:
            print_remark(f"{demonstration.name}: {sentence}")
        tracks.append((demonstration.name, Track(author, predicted.segments)))
    if arguments.json:
        print(json_text([_track_json(name, track) for name, track in tracks]))
    if out not in (None, STANDARD_OUTPUT):
        for path in _write(tracks, out, arguments.format, inputs):
            (print_remark if arguments.json else print)(str(path))
    elif not arguments.json:
        sys.stdout.write(_shown(tracks, arguments.format))


def _is_folder(out: Path | None) -> bool:
    """Whether an output is meant as a folder: it is one, or is nothing yet and has no suffix."""
    return out not in (None, STANDARD_OUTPUT) and (out.is_dir() or not (out.exists() or out.suffix))


def _track_json(name: str, track: Track) -> dict[str, object]:
    segments = [
        {"start": start, "end": end, "action": s.action} for s, (start, end) in plain_times(track)
    ]
    return {"demonstration": name, "author": track.author, "segments": segments}


def _text(track: Track, kind: str) -> str:
    """One track in the format asked for."""
    return to_csv([track]) if kind == "csv" else to_audacity(track)


def _shown(predictions: list[tuple[str, Track]], kind: str) -> str:
    """What is printed: one track as its file would be, several with their names in front."""
    if len(predictions) == 1:
        return _text(predictions[0][1], kind)
    if kind == "audacity":
        raise InputError("A label track holds one demonstration; name a folder with --out.")
    rows = (
        (name, *map(repr, times), segment.action, track.author)
        for name, track in predictions
        for segment, times in plain_times(track)
    )
    return table_text(("demonstration", *COLUMNS), rows)


def _write(
    predictions: list[tuple[str, Track]], out: Path, kind: str, inputs: list[Path]
) -> list[Path]:
    """Write one file, or one file a demonstration into a folder; gives what was written."""
    texts = [_text(track, kind) for _, track in predictions]
    if not _is_folder(out):
        if len(predictions) > 1:
            raise InputError(
                f"'{out}' is one file; {len(predictions)} demonstrations need a folder."
            )
        write_atomically(out, texts[0].encode())
        return [out]
    paths = [
        out / f"{name}{ENDINGS[kind]}" for name in file_names([name for name, _ in predictions])
    ]
    with output_folder(out, inputs):
        check_outputs(paths, inputs)
        for path, text in zip(paths, texts, strict=True):
            write_atomically(path, text.encode())
    return paths
