"""Recognise each demonstration by a recogniser that has not seen it.

Leaves out one demonstration of a task at a time, or a group if there are more than 20
(--folds); with --test-task trains on one task and tests on another; with --test-names
tests on some demonstrations of a task, such as those of another person. Tasks are
evaluated one by one unless --task is given several times. The result is kept in the
project as a run for the review; options that say so keep none, because the review would
train again without them.

--classifier also takes one of your own by its import path, MODULE:FUNCTION: called without
arguments it gives an unfitted classifier as scikit-learn's are. --features takes a function
of yours, alone or beside others: of an array of samples by channels, without gaps, and of
the samples a second it makes a row of features for each sample. Runs and recognisers keep
the paths, and no file can have them run: to use such a recogniser, or to ask why of such a
run, name them again, as in FORCELAB_CLASSIFIERS=mylab.models:make_forest and
FORCELAB_FEATURES. Installed packages name theirs by entry points of the groups
forcelab.classifiers and forcelab.features.

for example:
  forcelab evaluate lab.forcelab --task stylus --preset best --figure pairs.svg
  forcelab evaluate lab.forcelab --task stylus --test-names 'bob-*' --adapt
  forcelab evaluate lab.forcelab --task stylus --classifier mylab.models:make_forest
  forcelab evaluate lab.forcelab --preset best --features windows+mylab.signals:band_energy
"""

from __future__ import annotations

import argparse
import csv
import io
from pathlib import Path
from typing import Any

from joblib import cpu_count

from forcelab.cli.files import check_figure, check_outputs, output_file, save_figure
from forcelab.cli.options import (
    UsageError,
    add_file,
    add_project,
    add_scheduler,
    join_scheduler,
    name_of,
)
from forcelab.cli.output import (
    STANDARD_OUTPUT,
    print_remark,
    printable,
    progress_bar,
    report,
    table,
)
from forcelab.cli.settings_options import add_settings, choice_from, settings_from
from forcelab.errors import InputError
from forcelab.formats.output_folder import file_names
from forcelab.formats.track_text import quoted_text
from forcelab.frames import score_rows
from forcelab.io import write_atomically
from forcelab.jobs import finish
from forcelab.project import Project
from forcelab.recognition.intervals import METHOD, Intervals
from forcelab.recognition.metrics import METRICS, Scores
from forcelab.recognition.project_runs import TaskEvaluations, evaluate_tasks_job
from forcelab.recognition.results import Evaluation
from forcelab.text import counted, percent

#: The columns before the metrics.
KEY_COLUMNS = ("evaluation", "stage", "row", "demonstration")


def write_table(path: Path, evaluated: TaskEvaluations) -> None:
    """Write all scores as CSV; rates are fractions, and what is not defined is left empty.

    The column ``row`` tells a ``demonstration`` from what is ``pooled`` and the ``lower`` and
    ``upper`` ends of its 95 % interval.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow((*KEY_COLUMNS, *METRICS))
    for _, evaluation in evaluated.evaluations:
        for *words, values in score_rows(evaluation):
            writer.writerow((*map(quoted_text, (evaluation.title, *words)), *values))
    write_atomically(path, text.getvalue().encode())


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


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    parser.epilog = f"{_SCORES}\n\n{parser.epilog}"
    add_settings(parser)
    group = parser.add_argument_group("what is tested")
    group.add_argument(
        "--train-task",
        metavar="TASK",
        type=name_of,
        action="append",
        dest="task",
        help="the same as --task",
    )
    group.add_argument(
        "--test-task", metavar="TASK", type=name_of, help="train on --task, test on this one"
    )
    group.add_argument(
        "--test-names",
        metavar="PATTERN",
        help="test on the demonstrations with such names, as 'bob-*', train on all others of the "
        "task; keeps no run",
    )
    group.add_argument(
        "--folds",
        metavar="K",
        type=int,
        help="leave demonstrations out in K groups, for which K recognisers are trained; 0: one at "
        "a time (0, of more than 20 ten groups)",
    )
    group.add_argument(
        "--adapt",
        action="store_true",
        help="with --test-task or --test-names: match offsets, scales and swapped sensors to the "
        "training demonstrations, without labels; scores with and without; keeps no run",
    )
    group.add_argument(
        "--latency",
        metavar="SECONDS",
        type=float,
        help="as if it came live, each label so long after its force; keeps no run",
    )
    group = parser.add_argument_group("output")
    add_file(group, "--json", "write settings and all scores; - prints them")
    add_file(
        group,
        "--figure",
        "draw the timeline pairs (.svg, .pdf or .png); - prints the SVG, and the scores go to "
        "standard error; so with --confusion and --table",
    )
    add_file(group, "--confusion", "draw the confusion matrix")
    add_file(group, "--table", "write all scores as a table (.csv)")
    group = parser.add_argument_group("computing")
    group.add_argument(
        "--jobs", metavar="N", type=int, help="processes to share the work (default: all cores)"
    )
    add_scheduler(group)


def run(arguments: argparse.Namespace) -> None:
    settings = settings_from(arguments)
    if arguments.jobs is not None and arguments.jobs < 1:
        raise UsageError(f"--jobs is 1 or more, not {arguments.jobs}.")
    if arguments.folds is not None and (arguments.folds < 0 or arguments.folds == 1):
        raise UsageError(f"--folds is 2 or more, or 0, not {arguments.folds}.")
    figures = [path for path in (arguments.figure, arguments.confusion) if path is not None]
    _check_outputs(arguments, figures)
    for path in figures:
        check_figure(path)
    printed = STANDARD_OUTPUT in (*figures, arguments.table)
    path = arguments.table
    if path not in (None, STANDARD_OUTPUT) and path.suffix.lower() != ".csv":
        raise InputError(f"'{path}' is no table that can be written; name it '{path.stem}.csv'.")
    # More processes than cores only cost their start.
    jobs = min(arguments.jobs or cpu_count(), cpu_count())
    with (
        Project.open(arguments.project) as project,
        join_scheduler(arguments.scheduler),
        progress_bar() as watch,
    ):
        tasks = set(project.demonstrations.tasks()) - {arguments.test_task}
        if STANDARD_OUTPUT in figures and not arguments.task and len(tasks) > 1:
            raise UsageError(
                "Every task has a figure of its own, and standard output ('-') can hold one; "
                "choose a --task, or name a file."
            )
        # Where the filters need probabilities anyway, the review is to have them too.
        certainty = settings.needs_probabilities
        choice = choice_from(arguments)
        job = evaluate_tasks_job(
            project, settings, choice, jobs, probability_trace=certainty, latency=arguments.latency
        )
        evaluated = finish(job, watch)
    pairs, matrices = (
        _file_for_each(evaluated, path) for path in (arguments.figure, arguments.confusion)
    )
    # Names made from the tasks are known only now.
    _check_outputs(arguments, [*pairs, *matrices])
    try:
        for (_, evaluation), file in zip(evaluated.evaluations, pairs, strict=False):
            save_figure(evaluation.plot(), file)
        _draw_confusion(evaluated, matrices)
        if arguments.table is not None:
            with output_file(arguments.table, ".csv") as file:
                write_table(file, evaluated)
    finally:  # What took hours is told, even where the disk has no room for a figure.
        _report(evaluated, arguments.json, aside=printed)


def _check_outputs(arguments: argparse.Namespace, figures: list[Path]) -> None:
    """Refuse what is to be written where that cannot be or would replace what is read."""
    written = [*figures, arguments.table, arguments.json]
    check_outputs(written, [arguments.project, arguments.merge])


def _report(evaluated: TaskEvaluations, json_file: Path | None, *, aside: bool) -> None:
    """Print the scores and write the JSON that was asked for."""
    results = [evaluation.to_json() for _, evaluation in evaluated.evaluations]
    several = {"evaluations": results, "remarks": list(evaluated.remarks)}
    content: Any = results[0] if evaluated.joined else several
    text = "\n\n".join(_score_tables(each) for _, each in evaluated.evaluations)
    report(text, content, json_file, aside=aside)
    for sentence in evaluated.remarks:
        print_remark(f"forcelab: {sentence}")


def _score_tables(evaluation: Evaluation) -> str:
    settings = evaluation.settings
    raw, raw_each = evaluation.scores("raw")
    filtered, filtered_each = evaluation.scores("filtered")
    rows = [
        ["", "raw", "", "filtered", "", "", "", "boundary"],
        ["demonstration", "accuracy", "edit", "accuracy", "coverage", "edit", "F1@50", "median ms"],
    ]
    pairs = [*zip(raw_each, filtered_each, strict=True), (raw, filtered)]
    rows += [_row(single, after) for single, after in pairs]
    ranges = [evaluation.intervals(which) for which in ("raw", "filtered")]
    if not (reason := ranges[0].reason):
        rows.append(_ranges(*ranges))
    seconds = ", ".join(f"{name} {duration:.2f} s" for name, duration in evaluation.seconds.items())
    parts = [
        f"{printable(evaluation.title)}: preset {settings.preset}, {settings.classifier}, "
        f"stride {settings.stride}, seed {settings.seed}; "
        f"{counted(len(evaluation.tested), 'demonstration')} at {evaluation.rate:.6g} Hz, "
        f"{counted(len(evaluation.actions), 'action')}",
        table(rows, right=range(1, 8)),
        _actions(evaluation, raw, filtered),
        f"Rates in percent. Run time: {seconds}.",
        *_further_scores(evaluation),
        reason or f"95 % interval: {METHOD}.",
        *map(printable, evaluation.remarks),
    ]
    return "\n\n".join(parts)


def _further_scores(evaluation: Evaluation) -> list[str]:
    """What the table has no room for: other ways to count, and how far to rely on what is said."""
    pooled, _ = evaluation.scores("filtered")
    lines = [
        f"With unlabelled time cut out: F1@50 {percent(pooled.f1_labelled['50'])}; "
        f"{percent(pooled.boundaries_found)} of the boundaries found within 100 ms."
    ]
    if "unaided" in evaluation.kinds:
        alone, _ = evaluation.scores("unaided")
        lines.append(f"Decoded without any choreography: {_main_scores(alone)}.")
    if "unadapted" in evaluation.kinds:
        bare, _ = evaluation.scores("unadapted")
        lines.append(f"Without adaptation: {_main_scores(bare)}; with it: {_main_scores(pooled)}.")
    if "alone" in evaluation.kinds:
        alone, _ = evaluation.scores("alone")
        lines.append(
            f"Own labels alone: {_main_scores(alone)}; with the other's: {_main_scores(pooled)}."
        )
    reliability = evaluation.reliability
    if reliability is not None and reliability.brier is not None:
        lines.append(
            f"Probabilities: Brier score {reliability.brier:.3f}, expected calibration error "
            f"{percent(reliability.ece)} points."
        )
    return lines


def _main_scores(scores: Scores) -> str:
    return (
        f"accuracy {percent(scores.accuracy)}, edit {percent(scores.edit)}, "
        f"F1@50 {percent(scores.f1['50'])}"
    )


def _row(raw: Scores, filtered: Scores) -> list[str]:
    median = filtered.boundary_labelled_ms["median"]
    return [
        raw.name,
        percent(raw.accuracy),
        percent(raw.edit),
        percent(filtered.accuracy),
        percent(filtered.coverage),
        percent(filtered.edit),
        percent(filtered.f1["50"]),
        "-" if median is None else f"{median:.0f}",
    ]


def _ranges(raw: Intervals, filtered: Intervals) -> list[str]:
    """The line of intervals below the pooled scores."""

    def rate(intervals: Intervals, name: str) -> str:
        ends = intervals[name]
        return "-" if ends is None else f"{100 * ends[0]:.1f}–{100 * ends[1]:.1f}"

    median = filtered["boundary_labelled_ms.median"]
    return [
        "95 % interval",
        rate(raw, "accuracy"),
        rate(raw, "edit"),
        *(rate(filtered, name) for name in ("accuracy", "coverage", "edit", "f1.50")),
        "-" if median is None else f"{median[0]:.0f}–{median[1]:.0f}",
    ]


def _actions(evaluation: Evaluation, raw: Scores, filtered: Scores) -> str:
    """How much of each action was recognised, and what it was most often taken for at last."""
    rows = [["", "raw", "filtered", ""], ["action", *2 * ["recognised"], "mostly taken for"]]
    names = (*evaluation.actions, "unlabelled")
    each = zip(evaluation.actions, raw.confusion, filtered.confusion, strict=True)
    for i, (action, before, after) in enumerate(each):
        total = sum(after)
        confused = [0 if j == i else n for j, n in enumerate(after)]
        worst = max(range(len(confused)), key=confused.__getitem__)
        confusion = f"{names[worst]} ({percent(confused[worst] / total)})" if any(confused) else ""
        shares = (percent(counts[i] / total if total else None) for counts in (before, after))
        rows.append([action, *shares, confusion])
    return table(rows, right=[1, 2])


def _file_for_each(evaluated: TaskEvaluations, path: Path | None) -> list[Path]:
    """A file for each evaluation: unless one was asked for, its task stands in the name."""
    if path is None:
        return []
    if evaluated.joined:
        return [path]
    names = file_names(
        [f"{path.stem}-{evaluation.title}" for _, evaluation in evaluated.evaluations]
    )
    return [path.with_name(name + path.suffix) for name in names]


def _draw_confusion(evaluated: TaskEvaluations, files: list[Path]) -> None:
    """Draw the confusion matrix of the filtered predictions."""
    if not files:
        return
    import numpy as np

    from forcelab.gui.figures.confusion import ConfusionMatrix

    for (_, evaluation), file in zip(evaluated.evaluations, files, strict=True):
        pooled, _ = evaluation.scores("filtered")
        title = f"{evaluation.title}, after the filters"
        figure = ConfusionMatrix(title, evaluation.actions, np.array(pooled.confusion))
        save_figure(figure, file)
