"""What can be said to forcelab, and its manual."""

from __future__ import annotations

import argparse
import math
import re
from contextlib import suppress
from pathlib import Path

from forcelab import __version__
from forcelab.cli import parser_arranging, parser_capture, parser_projects, parser_recognition
from forcelab.cli.options import (
    Commands,
    Formatter,
    Parser,
    command,
    json_flag,
    name_of,
    path_of,
)

__all__ = ["build_parser"]

MANUAL = """\
forcelab labels and recognises force actions. A demonstration (force channels on one clock) goes
in; coders give each stretch of it an action; a recogniser learns the actions from complex-Morlet
wavelet features; human and predicted timelines come out as pairs.

To begin with:
  forcelab                                   (opens the window; the first time with samples)
  forcelab demo     sample.forcelab          (thirty simulated demonstrations to try things on)
  forcelab import   lab.forcelab recordings/*.csv --task stylus --videos
  forcelab list     lab.forcelab
  forcelab export   lab.forcelab --out labels --format table
  forcelab evaluate lab.forcelab --task stylus --stride 10 --figure pairs.svg
  forcelab train    lab.forcelab --task stylus --stride 10 --out stylus.skops
  forcelab predict  stylus.skops new.csv
"""

#: Pixels a side that a window may have at most.
LARGEST = 8192

#: What ``forcelab measure`` knows.
MEASURED = ("contact", "cwt", "recognition", "all")

CLOSING = """\
Every command but gui has --json; 'forcelab help COMMAND', or --help behind it, explains it. Exit
status: 0 done; 1 a file or project stands in the way (one sentence says what, where and the cure);
2 the command line is wrong.
"""


def build_parser() -> argparse.ArgumentParser:
    """The parser of the whole command line; each command names the module that runs it."""
    parser: argparse.ArgumentParser = Parser(
        prog="forcelab", description=MANUAL, epilog=CLOSING, formatter_class=Formatter
    )
    parser.add_argument("-V", "--version", action="version", version=f"forcelab {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    _add_gui(commands)
    parser_projects.add_demo(commands)
    parser_projects.add_simulate(commands)
    parser_projects.add_import(commands)
    parser_projects.add_list(commands)
    parser_projects.add_runs(commands)
    parser_arranging.add_assign(commands)
    parser_arranging.add_note(commands)
    parser_projects.add_agree(commands)
    parser_arranging.add_attach(commands)
    parser_arranging.add_sync(commands)
    parser_arranging.add_rename(commands)
    parser_arranging.add_remove(commands)
    parser_capture.add_capture(commands)
    parser_projects.add_replay(commands)
    parser_recognition.add_evaluate(commands)
    parser_recognition.add_train(commands)
    parser_recognition.add_predict(commands)
    parser_recognition.add_review(commands)
    parser_recognition.add_why(commands)
    parser_projects.add_export(commands)
    parser_recognition.add_plan(commands)
    _add_actions(commands)
    _add_figures(commands)
    _add_measure(commands)
    _add_doctor(commands)
    return parser


def _add_gui(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "gui",
        "showing",
        "open the window, or draw a picture of it",
        "The same as 'forcelab PROJECT'. Without a project it opens the last one; the first time,\n"
        "it makes the sample project. With --screenshot it needs no display, draws the window\n"
        "when everything in it is there, and ends.",
    )
    parser.add_argument(
        "project", metavar="PROJECT", type=Path, nargs="?", help="project folder (the last one)"
    )
    parser.add_argument("--demo", metavar="NAME", help="demonstration to open (the first)")
    parser.add_argument(
        "--workspace",
        choices=("label", "review", "capture", "tradeoff"),
        default="label",
        help="what to open (label)",
    )
    parser.add_argument("--at", metavar="SECONDS", type=_seconds, help="where the cursor is")
    parser.add_argument("--span", metavar="SECONDS", type=_span, help="how much time is visible")
    parser.add_argument("--size", metavar="WxH", type=_size, help="of the window (1280x800)")
    parser.add_argument(
        "--theme", choices=("light", "dark", "system"), help="colours (those chosen in the window)"
    )
    parser.add_argument(
        "--author",
        metavar="NAME",
        type=name_of,
        help="the coder (who labelled last in the project)",
    )
    parser.add_argument(
        "--screenshot", metavar="FILE", type=Path, help="draw the window into this .png"
    )


def _size(text: str) -> tuple[int, int]:
    """Width and height in pixels."""
    match = re.fullmatch(r"(\d{3,5})[xX](\d{3,5})", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"'{text}' is no size such as 1280x800")
    width, height = int(match[1]), int(match[2])
    if max(width, height) > LARGEST:
        raise argparse.ArgumentTypeError(f"'{text}' is too large; {LARGEST} pixels are the most")
    return width, height


def _seconds(text: str) -> float:
    """A time in seconds."""
    with suppress(ValueError):
        if math.isfinite(seconds := float(text)):
            return seconds
    raise argparse.ArgumentTypeError(f"'{text}' is no time in seconds")


def _span(text: str) -> float:
    """A length of time in seconds."""
    if (seconds := _seconds(text)) > 0:
        return seconds
    raise argparse.ArgumentTypeError(f"'{text}' is no length of time above 0 s")


def _add_actions(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "actions",
        "explaining",
        "explain the actions that coders label",
        "What each is, how to decide where it starts and ends, and what it is not to be mistaken\n"
        "for; with a picture of its beginning and its end.",
    )
    parser.add_argument("actions", metavar="ACTION", nargs="*", help="only these (all)")
    json_flag(parser)


def _add_figures(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "figures",
        "drawing",
        "draw what the wavelets see",
        "wavelets: Morlets of several p and what they make of two tones. clusters: four k-means\n"
        "clusters of a trapezoidal force; only magnitude and phase tell rising from falling.",
    )
    parser.add_argument("folder", metavar="DIR", type=path_of, help="folder to write into")
    parser.add_argument(
        "--format", choices=("svg", "pdf", "png"), default="svg", help="of both figures (svg)"
    )
    json_flag(parser)


def _add_measure(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "measure",
        "measuring",
        "measure error against run time",
        "Every row has its error and against what, the median CPU time with its spread, and the\n"
        "memory; * marks those that no other beats in both error and time (Pareto front).\n\n"
        "contact: the solvers of the simulated tongs.\n"
        "cwt: the wavelet engine at all its tolerances, to log magnitude and phase, beside\n"
        "PyWavelets, ssqueezepy and fCWT where they are installed (extra 'peers').\n"
        "recognition: presets, scales, phase, classifiers, filters and decoders on each task of\n"
        "PROJECT (the sample project): 1 - F1@50 and the other scores, with demonstrations left\n"
        "out of training in four groups in turn, against the CPU time of features, training and\n"
        "recognition. The window's Trade-off workspace draws it.\n"
        "all: every one of these; what cannot be measured here is told by its name.",
    )
    parser.add_argument(
        "what",
        metavar="WHAT",
        choices=MEASURED,
        help=", ".join(MEASURED),
    )
    parser.add_argument(
        "project", metavar="PROJECT", type=Path, nargs="?", help="recognition: folder of a project"
    )
    parser.add_argument(
        "--task",
        action="append",
        type=name_of,
        metavar="TASK",
        help="recognition: only this; may be repeated",
    )
    parser.add_argument(
        "--author",
        metavar="NAME",
        type=name_of,
        help="recognition: whose labels (who labelled most)",
    )
    parser.add_argument(
        "--thorough",
        action="store_true",
        help="recognition: leave out one demonstration at a time, however many there are",
    )
    parser.add_argument(
        "--json", metavar="FILE", type=Path, help="write the rows as JSON; - prints them"
    )
    parser.add_argument(
        "--figure",
        metavar="FILE",
        type=Path,
        help="draw error against time, where it has errors (.svg, .pdf or .png)",
    )
    parser.add_argument(
        "--extremes",
        action="store_true",
        help="cwt: zeros, gaps, steps, huge and tiny numbers: who gives the right answer",
    )
    parser.add_argument(
        "--quick", action="store_true", help="less of it: some minutes instead of half an hour"
    )


def _add_doctor(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "doctor",
        "examining",
        "examine this machine and say what is missing",
        "Versions, Qt and its fonts, video codecs (each is tried), cameras and serial ports,\n"
        "with the cure beside whatever is not as it should be.",
    )
    json_flag(parser)
