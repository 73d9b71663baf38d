"""``forcelab evaluate``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from joblib import cpu_count

from forcelab.atomic import write_atomically
from forcelab.cli.output import json_text, percent, progress_bar, table
from forcelab.cli.settings import choice_from, settings_from
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.project import Project
from forcelab.recognition.evaluation import Evaluation
from forcelab.recognition.metrics import Scores
from forcelab.recognition.project_runs import evaluate_tasks
from forcelab.vocabulary import Vocabulary


def run(arguments: argparse.Namespace) -> None:
    """Evaluate, print the scores, and write what was asked for."""
    settings = settings_from(arguments)
    jobs = cpu_count() if arguments.jobs is None else arguments.jobs
    if jobs < 1:
        raise InputError(f"--jobs is 1 or more, not {jobs}.")
    _check_figures(arguments)
    with Project.open(arguments.project) as project, progress_bar() as watch:
        job = evaluate_tasks(project, settings, choice_from(arguments), arguments.test_task, jobs)
        evaluations, left_out = finish(job, watch)
        vocabularies = project.vocabularies()
    if arguments.figure is not None:
        _draw_pairs(evaluations, vocabularies, arguments.figure)
    if arguments.confusion is not None:
        _draw_confusion(evaluations, arguments.confusion)
    _tell(evaluations, arguments.json)
    for sentence in left_out:
        print(f"forcelab: {sentence}", file=sys.stderr)


def _check_figures(arguments: argparse.Namespace) -> None:
    """Refuse a figure that cannot be saved before the evaluation, not after it."""
    wanted = [path for path in (arguments.figure, arguments.confusion) if path is not None]
    if wanted:
        from forcelab.gui.figures.canvas import check_suffix

        for path in wanted:
            check_suffix(path)


def _tell(evaluations: list[Evaluation], json_file: Path | None) -> None:
    """Print the scores, or JSON where that was asked for on standard output."""
    results = [evaluation.to_json() for evaluation in evaluations]
    content: Any = results[0] if len(results) == 1 else {"evaluations": results}
    if json_file == Path("-"):
        print(json_text(content))
        return
    if json_file is not None:
        write_atomically(json_file, (json_text(content) + "\n").encode())
    print("\n\n".join(_report(evaluation) for evaluation in evaluations))


def _report(evaluation: Evaluation) -> str:
    """The scores of one evaluation as tables."""
    settings = evaluation.settings
    raw, raw_each = evaluation.scores("raw")
    filtered, filtered_each = evaluation.scores("filtered")
    rows = [
        ["", "raw", "", "filtered", "", "", "", "boundary"],
        ["demonstration", "accuracy", "edit", "accuracy", "coverage", "edit", "F1@50", "median ms"],
    ]
    pairs = [*zip(raw_each, filtered_each, strict=True), (raw, filtered)]
    rows += [_row(single, after) for single, after in pairs]
    seconds = ", ".join(f"{name} {spent:.2f} s" for name, spent in evaluation.seconds.items())
    parts = [
        f"{evaluation.title}: preset {settings.preset}, {settings.classifier}, "
        f"stride {settings.stride}, seed {settings.seed}; "
        f"{len(evaluation.tested)} demonstrations, {len(evaluation.actions)} actions",
        table(rows, right=range(1, 8)),
        _actions(evaluation, raw),
        f"Rates in percent. Run time: {seconds}.",
        *evaluation.remarks,
    ]
    return "\n\n".join(parts)


def _row(raw: Scores, filtered: Scores) -> list[str]:
    """A demonstration's line."""
    median = filtered.boundary_ms["median"]
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


def _actions(evaluation: Evaluation, raw: Scores) -> str:
    """How much of each action was recognised, and what it was most often taken for."""
    rows = [["action", "recognised", "mostly taken for"]]
    for i, (action, counts) in enumerate(zip(evaluation.actions, raw.confusion, strict=True)):
        total = sum(counts)
        wrong = [0 if j == i else n for j, n in enumerate(counts[:-1])]
        worst = max(range(len(wrong)), key=wrong.__getitem__)
        taken = f"{evaluation.actions[worst]} ({percent(wrong[worst] / total)})" if total else ""
        share = percent(counts[i] / total if total else None)
        rows.append([action, share, taken if any(wrong) else ""])
    return table(rows, right=[1])


def _for_task(path: Path, evaluation: Evaluation, several: bool) -> Path:
    """The file of one evaluation: with several, the task stands in its name."""
    if not several:
        return path
    safe = "".join(c if c.isalnum() or c in "-_ " else "_" for c in evaluation.title)
    return path.with_name(f"{path.stem}-{safe}{path.suffix}")


def _draw_pairs(
    evaluations: list[Evaluation], vocabularies: Mapping[str, Vocabulary], path: Path
) -> None:
    """Draw the timeline pairs in the colours of the project's vocabularies."""
    from forcelab.gui.figures import Pair, TimelinePairs

    for evaluation in evaluations:
        _, each = evaluation.scores("filtered")
        vocabulary = vocabularies.get(evaluation.title, Vocabulary())
        pairs = tuple(
            Pair(
                item.name,
                item.segments("human"),
                item.segments("filtered"),
                item.start,
                item.end,
                note=f"{percent(scores.accuracy)} %",
            )
            for item, scores in zip(evaluation.tested, each, strict=True)
        )
        figure = TimelinePairs(
            evaluation.title or "no task",
            pairs,
            vocabulary.with_actions(*evaluation.actions),
            evaluation.actions,
        )
        figure.save(_for_task(path, evaluation, len(evaluations) > 1))


def _draw_confusion(evaluations: list[Evaluation], path: Path) -> None:
    """Draw the confusion matrix of the filtered predictions."""
    import numpy as np

    from forcelab.gui.figures import ConfusionMatrix

    for evaluation in evaluations:
        pooled, _ = evaluation.scores("filtered")
        figure = ConfusionMatrix(evaluation.title, evaluation.actions, np.array(pooled.confusion))
        figure.save(_for_task(path, evaluation, len(evaluations) > 1))
