"""The commands that train, recognise and compare."""

from __future__ import annotations

import argparse
from pathlib import Path

from forcelab.cli.options import (
    Commands,
    add_changes,
    add_settings,
    column_options,
    command,
    json_flag,
    name_of,
    path_of,
    project_command,
)

__all__ = [
    "add_evaluate",
    "add_plan",
    "add_predict",
    "add_review",
    "add_train",
    "add_why",
]


#: What the scores are, at the end of the manual of ``evaluate``.
_SCORES = """\
what the scores are:
  All compare with the human's labels; what the human left unlabelled is never counted.

  raw, filtered   what the classifier says of each sample; what filters or decoder make of it
  accuracy        share of the samples that are right; predicted as unlabelled is wrong
  coverage        share of the samples that are not predicted as unlabelled
  edit            1 - edit distance of the two sequences of actions / length of the longer one;
                  durations play no part; pooled: the mean over demonstrations
  F1@50           F1 of segments; a predicted one is right if it is the first to overlap one of its
                  action by half of their union or more; unlabelled time cuts segments, unless it
                  is cut out, and then a segment that goes on behind it is one
  boundary        how far the edges of segments matched at 10 % overlap lie apart, with unlabelled
                  time cut out; the first and the last edge of a demonstration are left out
  kappa           Cohen's, over samples; predicted as unlabelled counts as one more action
  Brier score     squared differences between probabilities and truth, summed over the actions,
                  mean over the samples: 0 (best) to 2
  expected calibration error
                  how far the probability of the likeliest action is from the share that is right,
                  mean over ten bins of equal width

  --table and --json hold all of them, fractions instead of percents: the boundaries as they are
  (boundary_ms, 0 wherever unlabelled time cuts both segments) and in labelled time
  (boundary_labelled_ms), balanced accuracy, Ward's event errors, and 95 % intervals."""


def add_evaluate(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``evaluate`` to the commands."""
    parser = project_command(
        commands,
        "evaluate",
        "evaluating",
        "recognise each demonstration by a recogniser that has not seen it",
        "Leaves one demonstration of a task out at a time, of more than 20 a group (--folds);\n"
        "with --test-task trains on one task and tests on the other; with --test-names on some\n"
        "demonstrations of a task, such as those of another person. Each task by itself unless\n"
        "--task is given several times. The result is kept in the project as a run for a review,\n"
        "unless an option says otherwise: a review trains again what it explains, and would do so\n"
        "without that option.",
    )
    parser.epilog = f"{_SCORES}\n\n{parser.epilog}"
    add_settings(parser)
    parser.add_argument(
        "--train-task",
        metavar="TASK",
        type=name_of,
        action="append",
        dest="task",
        help="the same as --task",
    )
    parser.add_argument(
        "--test-task", metavar="TASK", type=name_of, help="train on --task, test on this one"
    )
    parser.add_argument(
        "--test-names",
        metavar="PATTERN",
        help="test on the demonstrations with such names, as 'bob-*', train on all others of the "
        "task; keeps no run",
    )
    parser.add_argument(
        "--folds",
        metavar="K",
        type=int,
        help="leave demonstrations out in K groups, for which K recognisers are trained; 0: one at "
        "a time (0, of more than 20 ten groups)",
    )
    parser.add_argument(
        "--adapt",
        action="store_true",
        help="with --test-task or --test-names: match offsets, scales and swapped sensors to the "
        "training demonstrations, without labels; scores with and without; keeps no run",
    )
    parser.add_argument(
        "--latency",
        metavar="SECONDS",
        type=float,
        help="as if it came live, each label so long after its force; keeps no run",
    )
    parser.add_argument(
        "--json", metavar="FILE", type=Path, help="write settings and all scores; - prints them"
    )
    parser.add_argument(
        "--figure", metavar="FILE", type=Path, help="draw the timeline pairs (.svg, .pdf or .png)"
    )
    parser.add_argument("--confusion", metavar="FILE", type=Path, help="draw the confusion matrix")
    parser.add_argument(
        "--table", metavar="FILE", type=Path, help="write all scores as a table (.csv)"
    )
    parser.add_argument(
        "--jobs", metavar="N", type=int, help="processes to share the work (default: all cores)"
    )


def add_train(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``train`` to the commands."""
    parser = project_command(
        commands,
        "train",
        "training",
        "train a recogniser on all labelled demonstrations",
        "The file holds no pickle and can be passed on. The project keeps a copy.",
    )
    parser.add_argument(
        "--out", metavar="RECOGNISER", type=path_of, required=True, help="file to write (.skops)"
    )
    add_settings(parser)
    json_flag(parser)


def add_predict(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``predict`` to the commands."""
    parser = command(
        commands,
        "predict",
        "predicting",
        "label recordings with a recogniser",
        "Prints the segments, or writes them: one file for one demonstration, a folder of files\n"
        "for several. No track of a project is changed.",
    )
    parser.add_argument(
        "recogniser", metavar="RECOGNISER", type=path_of, help="file that train wrote"
    )
    parser.add_argument(
        "sources", metavar="FILE|PROJECT", type=Path, nargs="+", help="recordings or projects"
    )
    parser.add_argument(
        "--out", metavar="FILE", type=path_of, help="file (printed), or folder for several"
    )
    parser.add_argument(
        "--rate", metavar="HZ", type=float, help="of recordings without a column of times"
    )
    column_options(parser)
    parser.add_argument(
        "--format",
        choices=("csv", "audacity"),
        default="csv",
        help="start,end,action,author (csv), or a label track",
    )
    json_flag(parser)


def add_plan(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``plan`` to the commands."""
    parser = project_command(
        commands,
        "plan",
        "planning",
        "tell what is computed of a demonstration, and what is left out",
        "Which modules, panels and decoders the window needs for it, and what is computed to\n"
        "recognise it with these settings, or those of a trained recogniser. Of a simulated\n"
        "demonstration also which states the mechanics have and which parts the scene does\n"
        "without. Nothing of it is computed, unless --measure asks what all of it costs.",
    )
    parser.add_argument("demonstration", metavar="DEMO", help="its name or id")
    parser.add_argument(
        "--recogniser",
        metavar="FILE",
        type=Path,
        help="with the settings of this one, a file that train wrote",
    )
    parser.add_argument(
        "--measure", action="store_true", help="measure time and memory, taken and saved"
    )
    parser.set_defaults(merge=None)
    add_changes(parser)
    json_flag(parser)


def add_why(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``why`` to the commands."""
    parser = project_command(
        commands,
        "why",
        "why",
        "explain what a run predicted at a time of a demonstration",
        "Which channels and scales speak for the predicted action and against the coded one, and\n"
        "the nearest training segments of both. The recogniser that has not seen the\n"
        "demonstration is trained once more, with the labels, settings and seed of the run.",
    )
    parser.add_argument("demonstration", metavar="DEMO", help="its name or id")
    parser.add_argument(
        "--at", metavar="SECONDS", type=float, required=True, help="a time within the segment"
    )
    parser.add_argument(
        "--run", metavar="N", type=int, help="the run (the latest one that tested it)"
    )
    json_flag(parser)


def add_review(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``review`` to the commands."""
    parser = project_command(
        commands,
        "review",
        "reviewing",
        "list where labels and predictions differ, the most urgent first",
        "Of the latest run, with the labels as they are now: suspected coding errors, wrong\n"
        "actions, what the model missed, edges that differ, and what it sees in unlabelled time.\n"
        "Then the verdicts that were given, by pair of actions.",
    )
    parser.add_argument("--run", metavar="N", type=int, help="the run (the latest evaluation)")
    parser.add_argument(
        "--task", metavar="TASK", type=name_of, help="the latest evaluation of this task"
    )
    which = parser.add_mutually_exclusive_group()
    which.add_argument(
        "--kind",
        action="append",
        choices=("suspected", "actions", "missed", "boundaries", "invented"),
        help="only this; may be given several times (all but boundaries and invented)",
    )
    which.add_argument(
        "--actions",
        metavar=("HUMAN", "MODEL"),
        nargs=2,
        type=name_of,
        help="instead, every place of a cell of the confusion matrix; MODEL may be unlabelled",
    )
    parser.add_argument("--limit", metavar="N", type=int, help="at most so many of each kind")
    json_flag(parser)
