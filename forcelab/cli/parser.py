"""What can be said to forcelab, and its manual."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from forcelab import __version__
from forcelab.cli.options import (
    PROJECT,
    Commands,
    Formatter,
    add_changes,
    add_settings,
    command,
    json_flag,
)

__all__ = ["build_parser"]

MANUAL = """\
forcelab labels and recognises force actions. A demonstration (force channels on one clock) goes
in; coders give each stretch of it an action; a recogniser learns the actions from complex-Morlet
wavelet features; human and predicted timelines come out as pairs.

A first session:
  forcelab                                   (opens the window; the first time with samples)
  forcelab demo     sample.forcelab          (thirty simulated demonstrations to try things on)
  forcelab import   lab.forcelab recordings/*.csv --task stylus
  forcelab list     lab.forcelab
  forcelab evaluate lab.forcelab --task stylus --stride 10 --figure pairs.svg
  forcelab train    lab.forcelab --task stylus --stride 10 --out stylus.skops
  forcelab predict  stylus.skops new.csv
"""

CLOSING = """\
Every command has --json and its own --help. Exit status: 0 done; 1 a file, project or setting
stands in the way (one sentence says what, where and the cure); 2 the command line is wrong.
"""


def build_parser() -> argparse.ArgumentParser:
    """The parser of the whole command line; each command names the module that runs it."""
    parser = argparse.ArgumentParser(
        prog="forcelab", description=MANUAL, epilog=CLOSING, formatter_class=Formatter
    )
    parser.add_argument("--version", action="version", version=f"forcelab {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    _add_gui(commands)
    _add_demo(commands)
    _add_simulate(commands)
    _add_import(commands)
    _add_list(commands)
    _add_assign(commands)
    _add_sync(commands)
    _add_evaluate(commands)
    _add_train(commands)
    _add_predict(commands)
    _add_export(commands)
    _add_plan(commands)
    _add_actions(commands)
    _add_figures(commands)
    _add_measure(commands)
    _add_realism(commands)
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
        "project", metavar="PROJECT", type=Path, nargs="?", help="folder of a project"
    )
    parser.add_argument("--demo", metavar="NAME", help="demonstration to open (the first)")
    parser.add_argument(
        "--workspace", choices=("label", "review", "capture", "tradeoff"), default="label"
    )
    parser.add_argument("--at", metavar="SECONDS", type=float, help="where the cursor is")
    parser.add_argument("--span", metavar="SECONDS", type=float, help="how much time is visible")
    parser.add_argument("--size", metavar="WxH", type=_size, help="of the window (1280x800)")
    parser.add_argument("--theme", choices=("light", "dark", "system"))
    parser.add_argument("--author", metavar="NAME", help="the coder (the one of last time)")
    parser.add_argument(
        "--screenshot", metavar="FILE", type=Path, help="draw the window into this .png"
    )


def _size(text: str) -> tuple[int, int]:
    """Width and height in pixels."""
    match = re.fullmatch(r"(\d{3,5})[xX](\d{3,5})", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"'{text}' is no size such as 1280x800")
    return int(match[1]), int(match[2])


def _add_demo(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "demo",
        "demonstrating",
        "make the sample project",
        "Thirty simulated demonstrations of five tasks, with force, video and the labels of two\n"
        "coders, and a recogniser. It takes its name once it is complete; where it is already,\n"
        "nothing is changed.",
    )
    parser.add_argument(
        "folder",
        metavar="DIR",
        type=Path,
        nargs="?",
        default=Path("sample.forcelab"),
        help="project folder to make (default: sample.forcelab)",
    )
    json_flag(parser)


def _add_simulate(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "simulate",
        "simulating",
        "simulate demonstrations with a physical model of the tongs",
        "They go into a project, which is made if it does not exist, labelled by two simulated\n"
        "coders. The same task and seed give the same demonstrations: number 2 is the same\n"
        "whether 3 or 30 are made, filmed or not.",
    )
    parser.add_argument(
        "--task", required=True, help="LEGO, cartridge, stylus, marker or foam (whatever the case)"
    )
    parser.add_argument(
        "--count", metavar="N", type=int, required=True, help="number of demonstrations"
    )
    parser.add_argument("--seed", metavar="S", type=int, required=True, help="of everything random")
    parser.add_argument("--out", metavar="PROJECT", type=Path, required=True, help=PROJECT)
    parser.add_argument(
        "--rate",
        metavar="HZ",
        type=float,
        default=1000.0,
        help="samples a second, 50 to 4000 (1000)",
    )
    parser.add_argument(
        "--no-video", dest="video", action="store_false", help="forces and labels only"
    )
    json_flag(parser)


def _add_import(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "import",
        "importing",
        "read recordings into a project",
        "The project is made if it does not exist. Formats are told apart by content: tables\n"
        "(CSV, TSV, spaces), the paper's databases (*.pdl) and archives of projects. A recording\n"
        "that is there already is updated, not doubled. If one file cannot be read, nothing is\n"
        "imported at all. An archive alone, into a new project, brings back everything it holds.",
    )
    parser.add_argument("project", metavar="PROJECT", type=Path, help=PROJECT)
    parser.add_argument("files", metavar="FILE", type=Path, nargs="+", help="recordings")
    parser.add_argument("--task", help="task of the demonstrations")
    parser.add_argument(
        "--author", default="coder", help="author of the labels in the files (default: coder)"
    )
    parser.add_argument(
        "--rate",
        metavar="HZ",
        type=float,
        help="samples a second, where a file has no stamps; "
        "otherwise the rate of the features' grid",
    )
    parser.add_argument("--time", metavar="COL", help="name or number of the column of stamps")
    parser.add_argument("--label", metavar="COL", help="name or number of the column of labels")
    parser.add_argument(
        "--strict", action="store_true", help="refuse gaps and what would be repaired"
    )
    json_flag(parser)


def _add_list(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "list",
        "listing",
        "show what a project holds",
        "Demonstrations by task, with their length, rate, channels and labelled share by author.",
    )
    parser.add_argument("project", metavar="PROJECT", type=Path, help=PROJECT)
    parser.add_argument("--task", help="only this task")
    json_flag(parser)


def _add_assign(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "assign",
        "assigning",
        "say who is to label what, blind to the others' labels or not",
        "A coder who is assigned a demonstration blind sees neither the tracks of the others nor\n"
        "predictions in the window until it is done. Without DEMO: what is assigned as it is.\n"
        "Every assignment, and when it was done or opened again, is kept for ever.",
    )
    parser.add_argument("project", metavar="PROJECT", type=Path, help=PROJECT)
    parser.add_argument(
        "demonstrations", metavar="DEMO", nargs="*", help="names or ids of demonstrations"
    )
    parser.add_argument("--author", metavar="NAME", help="the coder; without DEMO: only this one's")
    parser.add_argument("--task", metavar="T", help="all demonstrations of this task")
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--open", action="store_true", help="assign openly, not blind")
    what.add_argument("--done", action="store_true", help="mark as done")
    what.add_argument("--reopen", action="store_true", help="mark as not done after all")
    what.add_argument("--remove", action="store_true", help="take the assignment back")
    json_flag(parser)


def _add_evaluate(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "evaluate",
        "evaluating",
        "recognise each demonstration by a recogniser that has not seen it",
        "Leaves one demonstration of a task out at a time; with --test-task trains on one task\n"
        "and tests on the other. Each task by itself unless --task is given several times.\n"
        "The result is kept in the project as a run.",
    )
    parser.add_argument("project", metavar="PROJECT", type=Path, help=PROJECT)
    add_settings(parser)
    parser.add_argument("--test-task", metavar="T2", help="train on --task, test on this one")
    parser.add_argument(
        "--json", metavar="FILE", type=Path, help="write settings and all scores; - prints them"
    )
    parser.add_argument(
        "--figure", metavar="FILE", type=Path, help="draw the timeline pairs (.svg, .pdf or .png)"
    )
    parser.add_argument("--confusion", metavar="FILE", type=Path, help="draw the confusion matrix")
    parser.add_argument(
        "--jobs", metavar="N", type=int, help="processes to share the work (default: all cores)"
    )


def _add_train(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "train",
        "training",
        "train a recogniser on all labelled demonstrations",
        "The file holds no pickle and can be passed on. The project keeps a copy.",
    )
    parser.add_argument("project", metavar="PROJECT", type=Path, help=PROJECT)
    parser.add_argument(
        "--out", metavar="RECOGNISER", type=Path, required=True, help="file to write (.skops)"
    )
    add_settings(parser)
    json_flag(parser)


def _add_predict(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "predict",
        "predicting",
        "label recordings with a recogniser",
        "Prints the segments, or writes them: one file for one demonstration, a folder of files\n"
        "for several. No track of a project is changed.",
    )
    parser.add_argument("recogniser", metavar="RECOGNISER", type=Path, help="from train")
    parser.add_argument(
        "sources", metavar="FILE|PROJECT", type=Path, nargs="+", help="recordings or projects"
    )
    parser.add_argument("--out", metavar="FILE", type=Path, help="file, or folder for several")
    parser.add_argument("--rate", metavar="HZ", type=float, help="of recordings without stamps")
    parser.add_argument("--time", metavar="COL", help="name or number of the column of stamps")
    parser.add_argument("--format", choices=("csv", "audacity"), default="csv")
    json_flag(parser)


def _add_export(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "export",
        "exporting",
        "write tracks, or a whole project as one archive",
        "csv: start,end,action,author of every track. audacity: a label track per author.\n"
        "archive: one zip with everything; 'forcelab import' reads it back.",
    )
    parser.add_argument("project", metavar="PROJECT", type=Path, help=PROJECT)
    parser.add_argument(
        "--out", metavar="DIR", type=Path, required=True, help="folder to write into"
    )
    parser.add_argument("--format", choices=("csv", "audacity", "archive"), default="csv")
    json_flag(parser)


def _add_plan(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "plan",
        "planning",
        "tell what is computed of a demonstration, and what is left out",
        "With these settings, or those of a trained recogniser. Of a simulated demonstration also\n"
        "which states the mechanics have and which parts the scene does without. Nothing of it is\n"
        "computed.",
    )
    parser.add_argument("project", metavar="PROJECT", type=Path, help=PROJECT)
    parser.add_argument("demonstration", metavar="DEMO", help="its name or id")
    parser.add_argument(
        "--recogniser", metavar="FILE", type=Path, help="with this one's settings, from train"
    )
    parser.set_defaults(merge=None)
    add_changes(parser)
    json_flag(parser)


def _add_sync(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "sync",
        "synchronising",
        "find or set the clock of a demonstration's video",
        "Proposes from the video's motion and the force which force time a frame belongs to, with\n"
        "its confidence (0 to 1; below 0.5 it should be looked at) and how far the taps lie from\n"
        "it. Force time is offset + rate * video time.",
    )
    parser.add_argument("project", metavar="PROJECT", type=Path, help=PROJECT)
    parser.add_argument("demonstration", metavar="DEMO", help="its name or id")
    parser.add_argument("--accept", action="store_true", help="store what is proposed")
    parser.add_argument(
        "--offset",
        metavar="S",
        type=float,
        help="store this: the force time at which the video's clock reads zero, s",
    )
    parser.add_argument(
        "--rate",
        metavar="R",
        type=float,
        help="store this: force seconds that pass in a second of the video, such as 1.00002",
    )
    json_flag(parser)


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
    parser.add_argument("folder", metavar="DIR", type=Path, help="folder to write into")
    parser.add_argument("--format", choices=("svg", "pdf", "png"), default="svg")
    json_flag(parser)


def _add_measure(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "measure",
        "measuring",
        "measure error against run time, or how fast the window is",
        "contact: the solvers of the simulated tongs. Every row has its error and against what,\n"
        "the median CPU time of five interleaved repetitions with its spread, and the memory;\n"
        "* marks those that no other beats in both error and time (Pareto front).\n"
        "view: the window, painted into memory (QT_QPA_PLATFORM=xcb: on the display). Frames\n"
        "while panning and zooming 6 channels of 1e6 and 1e7 samples, steps and jumps in videos,\n"
        "from a key to the paint, start, opening projects: median, p95, p99 and worst in ms,\n"
        "beside pyqtgraph and OpenCV used plainly.",
    )
    parser.add_argument("what", metavar="WHAT", choices=("contact", "view"), help="contact, view")
    parser.add_argument(
        "--json", metavar="FILE", type=Path, help="write the rows as JSON; - prints them"
    )
    parser.add_argument(
        "--figure",
        metavar="FILE",
        type=Path,
        help="contact: draw error against time (.svg, .pdf or .png)",
    )
    parser.add_argument(
        "--quick", action="store_true", help="less of it: some minutes instead of half an hour"
    )


def _add_realism(commands: Commands[argparse.ArgumentParser]) -> None:
    parser = command(
        commands,
        "realism",
        "comparing",
        "put the simulated tongs beside real recordings",
        "Simulates the tasks that the project has labelled recordings of, and compares durations,\n"
        "forces, spectra, noise and how well preset paper recognises both; ! marks what is more\n"
        "than a factor of 2 apart.",
    )
    parser.add_argument("project", metavar="PROJECT", type=Path, help=PROJECT)
    parser.add_argument("--author", help="whose labels, where there are several coders")
    parser.add_argument(
        "--count", metavar="N", type=int, default=10, help="demonstrations to simulate (10)"
    )
    parser.add_argument("--seed", metavar="S", type=int, default=1, help="of the simulation (1)")
    parser.add_argument(
        "--json", metavar="FILE", type=Path, help="write the figures as JSON; - prints them"
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
