"""List what was evaluated and trained, or compare two runs.

Every evaluation, by 'forcelab evaluate' or in the window, is kept as a run with its
settings, seed and labels. Two are compared on the demonstrations that both tested: a
difference is the second's score less the first's. The list shows the disk space of each
run, and recognisers that belong to none; 'forcelab remove' removes them.

for example:
  forcelab runs lab.forcelab --compare 1 2
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

from forcelab.cli.options import add_json, add_project
from forcelab.cli.output import print_result, printable, table
from forcelab.project import Project, RunSummary, RunUse
from forcelab.recognition.intervals import METHOD
from forcelab.recognition.metrics import METRICS, look_up
from forcelab.recognition.presets import PRESETS
from forcelab.recognition.results import STAGES, run_title
from forcelab.review.run_comparison import Comparison, as_text, compare_runs
from forcelab.review.run_result import load_run
from forcelab.text import counted, percent


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    parser.add_argument(
        "--compare", metavar=("A", "B"), type=int, nargs=2, help="numbers of two runs"
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    with Project.open(arguments.project) as project:
        if arguments.compare is not None:
            comparison = compare_runs(*(load_run(project, number) for number in arguments.compare))
            content, text = _comparison_json(comparison), _comparison_text(comparison)
            print_result(arguments.json, content, text)
            return
        with project.snapshot():
            runs, uses = project.runs.summaries(), project.runs.uses()
            recognisers, sizes = project.runs.recognisers(), project.runs.recogniser_bytes()
    pairs = list(zip(runs, uses, strict=True))
    text = "No runs; 'forcelab evaluate' and the window's Train make them."
    if runs:
        header = ["run", "time (UTC)", "kind", "what", "settings", "tested", "accuracy", "F1@50"]
        rows = [[*header, "MB"], *(_row(*pair) for pair in pairs)]
        number = counted(len(runs), "run")
        text = table(rows, right=[0, 5, 6, 7, 8])
        text += f"\n\n{number}. Rates in percent, after the filters."
    owned = {use.recogniser for use in uses}
    alone = [
        [r.id[:8], f"{r.time:%Y-%m-%d %H:%M}", r.name, _megabytes(sizes.get(r.id, 0))]
        for r in recognisers
        if r.id not in owned
    ]
    if alone:
        text += f"\n\n{table([['recogniser', 'time (UTC)', 'name', 'MB'], *alone], right=[3])}"
    print_result(arguments.json, [_summary(*pair) for pair in pairs], text)


def _megabytes(count: int) -> str:
    return f"{count / 1e6:.1f}"


def _row(run: RunSummary, use: RunUse) -> list[str]:
    digest = run.digest
    return [
        str(run.id),
        f"{run.time:%Y-%m-%d %H:%M}",
        run.kind,
        str(digest.get("title", run_title(run.tasks, run.test_task))),
        _settings(run.settings),
        str(digest.get("tested", "")),
        percent(digest.get("accuracy")),
        percent(digest.get("f1")),
        _megabytes(use.bytes),
    ]


def _settings(settings: Mapping[str, Any]) -> str:
    """The preset of a run and what was changed of it: ``fast, choreography none``."""
    name = str(settings.get("preset", ""))
    usual = PRESETS[name].to_json() if name in PRESETS else {}
    changed = (key for key, value in usual.items() if settings.get(key, value) != value)
    return ", ".join([name, *(f"{key} {as_text(settings[key])}" for key in changed)])


def _summary(run: RunSummary, use: RunUse) -> dict[str, Any]:
    """A run as plain values, without what it found."""
    return {
        "run": run.id,
        "kind": run.kind,
        "time": str(run.time),
        "settings": run.settings,
        "seed": run.seed,
        "labels": [[used.demonstration, used.author, used.edit] for used in run.labels],
        "versions": run.versions,
        "bytes": use.bytes,
        "recogniser": use.recogniser or None,
        "verdicts": use.verdicts,
        "accepted": use.accepted,
        **run.digest,
    }


def _comparison_text(comparison: Comparison) -> str:
    first, second = comparison.first, comparison.second
    parts = [
        f"Run {first.number} ({printable(first.title)}) and {second.number} "
        f"({printable(second.title)})"
    ]
    numbers = [f"run {first.number}", f"run {second.number}"]
    if comparison.settings:
        parts.append(table([["asked for", *numbers], *map(list, comparison.settings)]))
    if not comparison.pairs:
        parts.append("They tested no demonstration in common, so there are no scores to compare.")
        return "\n\n".join(parts)
    for stage in STAGES:
        header = [stage, *numbers, "difference", "95 % interval"]
        rows = [_line(comparison, stage, metric) for metric in METRICS if "events" not in metric]
        parts.append(table([header, *rows], right=range(1, 5)))
    rows = [["demonstration, filtered accuracy", *numbers, "difference"]]
    for pair in comparison.pairs:
        before, after = (look_up(r.scores.get("filtered", {}), "accuracy") for r in pair)
        difference = _difference_text(before, after)
        rows.append([pair[0].name, percent(before), percent(after), difference])
    parts.append(table(rows, right=range(1, 4)))
    if comparison.relabelled:
        names = ", ".join(printable(result.name) for result in comparison.relabelled)
        parts.append(f"The human labels differ between the runs: {names}.")
    parts.append(
        comparison.intervals["filtered"].reason or f"95 % interval of the difference: {METHOD}."
    )
    parts.append("Rates in percent, boundaries in ms.")
    return "\n\n".join(parts)


def _line(comparison: Comparison, stage: str, metric: str) -> list[str]:
    first, second = (look_up(scores, metric) for scores in comparison.pooled[stage])
    ends = comparison.intervals[stage][metric]
    scale = 1.0 if metric == "kappa" or metric.startswith("boundary_") else 100.0
    digits = 3 if metric == "kappa" else 1
    between = ""
    if ends is not None:
        between = " to ".join(f"{scale * end:+.{digits}f}" for end in ends)
    return [
        _metric_name(metric),
        *("-" if value is None else f"{scale * value:.{digits}f}" for value in (first, second)),
        _difference_text(first, second, scale, digits),
        between,
    ]


def _metric_name(metric: str) -> str:
    """What a score is called for people, as in the window and the other tables."""
    name, _, part = metric.partition(".")
    labelled = " labelled" * ("_labelled" in name)
    if name.startswith("f1"):
        return f"F1@{part}{labelled}"
    if name.startswith("boundary_"):
        return f"boundary {'90 %' if part == 'p90' else part}{labelled}"
    return {"balanced_accuracy": "balanced", "boundaries_found": "boundaries found"}.get(name, name)


def _difference_text(
    first: float | None, second: float | None, scale: float = 100.0, digits: int = 1
) -> str:
    """What the second has more."""
    return "-" if first is None or second is None else f"{scale * (second - first):+.{digits}f}"


def _comparison_json(comparison: Comparison) -> dict[str, Any]:
    return {
        "runs": [comparison.first.number, comparison.second.number],
        "settings": [list(row) for row in comparison.settings],
        "shared": [result.id for result, _ in comparison.pairs],
        "relabelled": [result.id for result in comparison.relabelled],
        "pooled": {stage: list(comparison.pooled[stage]) for stage in STAGES},
        "demonstrations": {
            stage: {
                pair[0].id: [result.scores.get(stage, {}) for result in pair]
                for pair in comparison.pairs
            }
            for stage in STAGES
        },
        "intervals": {stage: comparison.intervals[stage].to_json() for stage in STAGES},
    }
