"""Explain what a run predicted at a time of a demonstration.

Shows which channels and scales speak for the predicted action and against the coded
one, and the nearest training segments of both. The recogniser that has not seen the
demonstration is trained again, with the labels, settings and seed of the run.

for example:
  forcelab why lab.forcelab pull-03 --at 1.8
"""

from __future__ import annotations

import argparse

from forcelab.cli.options import add_demonstration, add_json, add_project
from forcelab.cli.output import print_result, printable, progress_bar, table
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.labels import Interval
from forcelab.project import Project
from forcelab.review.explanation import Explanation, explain_at_job
from forcelab.review.run_result import KIND, RunResult, load_run
from forcelab.review.similar_segments import Neighbour


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    add_demonstration(parser)
    parser.add_argument(
        "--at", metavar="SECONDS", type=float, required=True, help="a time within the segment"
    )
    parser.add_argument(
        "--run", metavar="N", type=int, help="the run (the latest one that tested it)"
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    with Project.open(arguments.project) as project:
        demonstration = project.demonstrations.load(arguments.demonstration)
        outcome = _outcome(project, demonstration.id, demonstration.task, arguments.run)
        names = {info.id: info.name for info in project.demonstrations.infos()}
    with progress_bar() as watch:
        job = explain_at_job(arguments.project, outcome, demonstration.id, arguments.at)
        why = finish(job, watch)
    start, end = why.place.start, why.place.end
    title = f"{demonstration.name}, {start:.3f} to {end:.3f} s, run {outcome.number}"
    text = "\n\n".join([printable(title), *_paragraphs(why, names)])
    print_result(arguments.json, {"run": outcome.number} | why.to_json(), text)


def _outcome(project: Project, id_: str, task: str, number: int | None) -> RunResult:
    """The run that is asked for, or the latest one that has to do with a demonstration."""
    if number is not None:
        return load_run(project, number)
    for run in reversed(project.runs.summaries(KIND)):
        if task in (*run.tasks, run.test_task):
            outcome = load_run(project, run.id)
            if outcome.find(id_) is not None:
                return outcome
    raise InputError(
        f"No run of '{project.path}' tested this demonstration; say 'forcelab evaluate' first."
    )


def _paragraphs(why: Explanation, names: dict[str, str]) -> list[str]:
    """An explanation for people, paragraph by paragraph."""
    return [
        f"{_sentence(why.place)}\n{_probability_text(why)}",
        _bands(why),
        _channels(why),
        _method(why),
        _nearest(why, names),
        *why.remarks,
    ]


def _sentence(place: Interval) -> str:
    """What human and model made of the place."""
    human, predicted = place.human or "unlabelled", place.predicted or "nothing"
    return printable(f"{place.duration:.2f} s coded {human}, predicted {predicted}.")


def _probability_text(why: Explanation) -> str:
    """Mean probabilities over the place."""
    if why.probability_trace is None:
        return "The classifier gives no probabilities."
    values = why.probability_trace.mean(why.place.start, why.place.end)
    pairs = sorted(zip(values.tolist(), why.probability_trace.actions, strict=True), reverse=True)
    means = ", ".join(f"{action} {value:.2f}" for value, action in pairs)
    origin = "as the run kept it" if why.trace_from_run else "computed anew, as the run kept none"
    return printable(f"Mean probability ({origin}): {means}.")


def _bands(why: Explanation) -> str:
    lines = [f"What tells {why.favoured} from {why.against} most, in log-odds:"]
    for band in why.strongest():
        side = "for" if band.weight >= 0 else "against"
        error = f" ± {band.error:.2f}" if band.error else ""
        lines.append(
            f"  {band.channel} at {band.hertz:.3g} Hz speaks {side} {why.favoured} "
            f"({band.weight:+.2f}{error})"
        )
    return "\n".join(printable(line) for line in lines)


def _channels(why: Explanation) -> str:
    """All bands, a column for each channel, and the channels as a whole."""
    attribution = why.attribution
    rows = [["Hz", *why.channels]]
    for hertz, weights in zip(why.hertz.tolist(), attribution.bands.T.tolist(), strict=True):
        rows.append([f"{hertz:.3g}", *(f"{weight:+.2f}" for weight in weights)])
    rows.append(["in all", *(f"{weight:+.2f}" for weight in attribution.channels.tolist())])
    return table(rows, right=range(len(rows[0])))


def _method(why: Explanation) -> str:
    """How it was found out, how far it can be relied on, and what it cost."""
    attribution = why.attribution
    sides = f"{attribution.log_odds:+.2f} here, {attribution.reference:+.2f}"
    if attribution.method == "gradient":
        method = (
            f"Log-odds {sides} at the mean of the training samples. Gradient along the way from "
            f"there,\nover {attribution.steps} samples; the bands add up to the difference to "
            f"within {max(attribution.gap, 1e-12):.0e}."
        )
    else:
        method = (
            f"Log-odds {sides} with every band replaced. Permutation: what is lost when a band "
            f"comes\nfrom random training samples; {attribution.steps} samples, "
            f"{attribution.repeats} "
            f"repetitions, standard errors up to {attribution.bands_error.max():.2g}."
        )
    seconds = sum(why.seconds.values())
    if why.how == "final":
        return f"{method}\nThe final recogniser, which was not trained on this demonstration."
    return (
        f"{method}\nThe recogniser of the run that has not seen this demonstration, trained once "
        f"more in {seconds:.1f} s;\n"
        f"{100 * why.same_share:.1f} % of its samples are labelled as by the run."
    )


def _nearest(why: Explanation, names: dict[str, str]) -> str:
    """The nearest training segments of both actions."""
    rows = [["nearest", "demonstration", "from s", "to s", "distance", "predicted"]]
    rows += [_row(action, n, names) for action, near in why.neighbours.items() for n in near]
    return table(rows, right=(2, 3, 4))


def _row(action: str, neighbour: Neighbour, names: dict[str, str]) -> list[str]:
    place = neighbour.place
    times = [f"{place.start:.3f}", f"{place.end:.3f}"]
    name = names.get(place.demonstration, place.demonstration)
    return [action, name, *times, f"{neighbour.distance:.2f}", place.predicted or "-"]
