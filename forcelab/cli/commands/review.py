"""List where labels and predictions differ, the most urgent first.

Compares the latest run with the present labels: suspected coding errors, wrong actions,
segments that the model missed, edges that differ, and segments it predicts in
unlabelled time. Then the verdicts given so far, by pair of actions.

for example:
  forcelab review lab.forcelab --task stylus --kind suspected --limit 10
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import asdict

from forcelab.cli.options import UsageError, add_json, add_project, add_task, name_of
from forcelab.cli.output import interval_cells, print_result, printable, table
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.labels import means_unlabelled
from forcelab.project import Project
from forcelab.review.confusion import count_confusion
from forcelab.review.differences import Difference
from forcelab.review.queue import Queue, review_queue
from forcelab.review.run_result import RunResult, latest_run, load_run
from forcelab.review.verdicts import VerdictCount, count_verdicts
from forcelab.text import counted, percent, unknown_word

#: What each section is called in the table.
KINDS = {
    "suspected": "suspected coding error",
    "actions": "wrong action",
    "missed": "missed",
    "boundaries": "boundary",
    "invented": "unlabelled, yet predicted",
}
#: What is listed unless something else is asked for.
USUAL = ("suspected", "actions", "missed")


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    parser.add_argument("--run", metavar="N", type=int, help="the run (the latest evaluation)")
    add_task(parser, "the latest evaluation of this task")
    which = parser.add_mutually_exclusive_group()
    which.add_argument(
        "--kind",
        action="append",
        choices=KINDS,
        help="only this; may be repeated (all but boundaries and invented)",
    )
    which.add_argument(
        "--actions",
        metavar=("HUMAN", "MODEL"),
        nargs=2,
        type=name_of,
        help="instead, every place of a cell of the confusion matrix; MODEL may be unlabelled",
    )
    parser.add_argument("--limit", metavar="N", type=int, help="at most this many of each kind")
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    if arguments.limit is not None and arguments.limit < 1:
        raise UsageError(f"--limit is 1 or more, not {arguments.limit}.")
    with Project.open(arguments.project) as project:
        outcome = _outcome(project, arguments.run, arguments.task)
        if arguments.actions is not None:
            human, model = arguments.actions
            _print_cell(outcome, human, model, arguments.limit, arguments.json)
            return
        queue = review_queue(project, outcome, invented=True)
    kinds = tuple(dict.fromkeys(arguments.kind or USUAL))
    sections = {kind: getattr(queue, kind)[: arguments.limit] for kind in kinds}
    compared = outcome, queue, sections
    print_result(arguments.json, _json_content(*compared), _tables(*compared))


def _outcome(project: Project, number: int | None, task: str | None) -> RunResult:
    """The run that is meant."""
    if number is not None:
        return load_run(project, number)
    outcome = latest_run(project, None if task is None else [task])
    if outcome is None:
        of_task = "" if task is None else f" of the task '{task}'"
        raise InputError(
            f"'{project.path}' has no evaluation{of_task} yet; 'forcelab evaluate' makes one."
        )
    return outcome


def _print_cell(
    outcome: RunResult, human: str, model: str, limit: int | None, as_json: bool
) -> None:
    """Print the places of a cell of the confusion matrix, as a click on it lists them."""
    predicted = None if means_unlabelled(model) else model
    for action in (human, predicted):
        if action is not None and action not in outcome.actions:
            raise InputError(unknown_word("action", action, outcome.actions))
    cells = finish(count_confusion(outcome))
    row = outcome.actions.index(human)
    column = len(outcome.actions) if predicted is None else outcome.actions.index(predicted)
    number, seconds = int(cells.numbers()[row, column]), float(cells.matrix()[row, column])
    places = cells.places(human, predicted, most=number if limit is None else limit)
    names = {demonstration.id: demonstration.name for demonstration in outcome.tested}
    content = {
        "run": outcome.number,
        "title": outcome.title,
        "author": outcome.author,
        "number": number,
        "seconds": seconds,
        "places": [
            asdict(place) | {"demonstration": names[place.demonstration], "id": place.demonstration}
            for place in places
        ],
    }
    rows = [["demonstration", "s", "", "human", "model", "confidence"]]
    rows += [[names[p.demonstration], *interval_cells(p), percent(p.confidence)] for p in places]
    text = (
        f"Run {outcome.number}, {printable(outcome.title)}: {counted(number, 'place')}, "
        f"{seconds:.2f} s, that {printable(outcome.author)} labelled '{printable(human)}' and "
        f"the model {'left unlabelled' if predicted is None else f'calls {printable(model)!r}'}."
    )
    if places:
        text += f"\n\n{table(rows, right=[1, 2, 5])}\n\nConfidence in percent."
    print_result(as_json, content, text)


def _tables(outcome: RunResult, queue: Queue, sections: dict[str, Sequence[Difference]]) -> str:
    """The queue and the verdicts as tables."""
    names = {demonstration.id: demonstration.name for demonstration in outcome.tested}
    rows = [["what", "demonstration", "s", "", "human", "model", "confidence", "suspicion"]]
    rows += [
        [
            KINDS[kind],
            names[d.demonstration],
            *interval_cells(d),
            percent(d.confidence),
            percent(d.suspicion or None),
        ]
        for kind, section in sections.items()
        for d in section
    ]
    counts = ", ".join(f"{len(getattr(queue, kind))} {kind}" for kind in KINDS)
    parts = [
        f"Run {outcome.number}, {printable(outcome.title)}: labels of {printable(outcome.author)} "
        f"as they are now, in {counted(len(outcome.tested), 'demonstration')}.",
        table(rows, right=[2, 3, 6, 7]) if len(rows) > 1 else _none_listed(queue, sections),
        f"In all: {counts}; {len(queue.judged)} judged. Rates in percent.",
    ]
    if queue.judged:
        parts.append(_verdicts(count_verdicts(queue.judged)))
    return "\n\n".join(parts)


def _none_listed(queue: Queue, asked: Iterable[str]) -> str:
    """That nothing is of the kinds that were asked for, and how to list what is of others."""
    others = "".join(f" --kind {k}" for k in KINDS if k not in asked and getattr(queue, k))
    cure = f"; see the others with{others}" if others else ""
    return f"Nothing is of the kind {' or '.join(asked)}{cure}."


def _verdicts(judged: Sequence[VerdictCount]) -> str:
    """Who was right, by pair of actions."""
    rows = [["human", "model", "human right", "model right", "ambiguous"]]
    rows += [
        [
            pair.human or "-",
            pair.predicted or "-",
            str(pair.human_right),
            str(pair.model_right),
            str(pair.ambiguous),
        ]
        for pair in judged
    ]
    return table(rows, right=[2, 3, 4])


def _json_content(
    outcome: RunResult, queue: Queue, sections: dict[str, Sequence[Difference]]
) -> dict[str, object]:
    names = {demonstration.id: demonstration.name for demonstration in outcome.tested}
    return {
        "run": outcome.number,
        "title": outcome.title,
        "author": outcome.author,
        "queue": {
            kind: [
                {
                    "demonstration": names[d.demonstration],
                    "id": d.demonstration,
                    "start": d.start,
                    "end": d.end,
                    "human": d.human,
                    "predicted": d.predicted,
                    "confidence": d.confidence,
                    "suspicion": d.suspicion,
                }
                for d in section
            ]
            for kind, section in sections.items()
        },
        "counts": {kind: len(getattr(queue, kind)) for kind in KINDS},
        "verdicts": [asdict(pair) for pair in count_verdicts(queue.judged)],
    }
