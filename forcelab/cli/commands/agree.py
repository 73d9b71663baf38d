"""Measure how far coders agree, and list where they do not.

Cohen's kappa of every two coders and Fleiss' kappa of all, over the time that they
labelled; agreement of each action, of boundaries and segments, with the largest
differences; and how consistent each coder is from one demonstration to the next.

for example:
  forcelab agree lab.forcelab --task stylus --authors Ines Tomas
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

from forcelab.cli.options import add_json, add_project, add_task, name_of
from forcelab.cli.output import interval_cells, print_result, printable, progress_bar, table
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.labels import Interval
from forcelab.project import Project
from forcelab.review.agreement import Agreement, PairAgreement, agreement_job
from forcelab.review.coder_tracks import coded_demonstrations
from forcelab.review.consensus import CONSENSUS
from forcelab.review.consistency import Consistency
from forcelab.review.kappa import landis_koch
from forcelab.text import counted, percent

#: How many places of each kind are printed.
WORST = 5
#: How many of them ``--json`` holds.
WORST_JSON = 100


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    add_task(parser, "only this task")
    parser.add_argument(
        "--authors",
        metavar="NAME",
        type=name_of,
        nargs="+",
        help="only these coders (default: all)",
    )
    parser.add_argument(
        "--same",
        type=name_of,
        metavar=("NAME", "AGAIN"),
        nargs=2,
        help="two names of one coder who labelled twice: measure how consistent that coder is",
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    same = tuple(arguments.same) if arguments.same else None
    chosen = dict.fromkeys([*arguments.authors, *(same or ())]) if arguments.authors else ()
    with Project.open(arguments.project) as project:
        if same is not None:
            coded_demonstrations(project, arguments.task, same)  # says who is not known
        coded, _ = coded_demonstrations(project, arguments.task, chosen, without=(CONSENSUS,))
    with progress_bar("comparing") as watch:
        result = finish(agreement_job(coded, same=same), watch)
    if not result.pairs and not result.repeated:
        raise InputError(
            f"No demonstration is labelled by two coders; have a second one label some with "
            f"'forcelab assign {arguments.project} DEMO --author NAME'."
        )
    names = {demonstration.id: demonstration.name for demonstration in coded}
    text = "\n".join(map(printable, _report(result, names)))
    print_result(arguments.json, _json_content(result, names), text)


def _report(result: Agreement, names: dict[str, str]) -> list[str]:
    lines = []
    if result.pairs:
        lines += [*_pairs(result.pairs), ""]
    if result.fleiss is not None and result.fleiss_coders > 2:
        lines += [f"Fleiss' kappa of all: {_kappa(result.fleiss)}", ""]
    for pair in result.pairs:
        lines += _pair(pair, names)
    for pair in result.repeated:
        lines += [f"One coder, labelling twice: kappa {_kappa(pair.kappa)}", ""]
        lines += _pair(pair, names)
    for consistency in result.own:
        lines += _consistency_table(consistency, names)
    lines += [
        "Kappa: agreement beyond chance (0 chance, 1 full) over the time that both labelled; words",
        "by Landis and Koch (1977). only one: share of the time that only one of them labelled.",
    ]
    return lines


def _pairs(pairs: Sequence[PairAgreement]) -> list[str]:
    """A line for every two coders."""
    rows = [["coders", "demos", "kappa", "95 % interval", "", "agreed %", "only one %", "F1@50 %"]]
    for pair in pairs:
        interval = pair.interval
        kappa = pair.kappa
        rows.append(
            [
                f"{pair.a} / {pair.b}",
                str(len(pair.demonstrations)),
                "-" if kappa is None else f"{kappa:.3f}",
                "-" if interval is None else f"{interval[0]:.3f} to {interval[1]:.3f}",
                "" if kappa is None else landis_koch(kappa),
                percent(pair.agreed),
                percent(pair.only_share),
                percent(pair.f1[50]),
            ]
        )
    return table(rows, right=(1, 2, 5, 6, 7)).split("\n")


def _pair(pair: PairAgreement, names: dict[str, str]) -> list[str]:
    """Actions, boundaries and the worst places of two coders."""
    lines = [f"{pair.a} / {pair.b}"]
    shares = [f"{action} {percent(share)}" for action, share in pair.by_action.items()]
    lines.append(f"  agreement by action, %: {', '.join(shares)}")
    quartiles = pair.quartiles
    if quartiles is not None:
        within = ", ".join(
            f"{percent(share)} % within {ms} ms" for ms, share in pair.within.items()
        )
        lines.append(
            f"  boundaries: {len(pair.offsets)} matched of {pair.boundaries[0]} and "
            f"{pair.boundaries[1]}; {pair.b} is later by {quartiles[1]:.0f} ms (median; middle "
            f"half {quartiles[0]:.0f} to {quartiles[2]:.0f}); {within}"
        )
    f1 = ", ".join(f"{percent(value)} at {overlap} % overlap" for overlap, value in pair.f1.items())
    lines += [f"  segments, F1 %: {f1}", *_places(pair, names), ""]
    return lines


def _places(pair: PairAgreement, names: dict[str, str]) -> list[str]:
    """The longest stretches in which two coders differ."""
    places = sorted((*pair.apart, *pair.alone), key=lambda place: -place.duration)
    if not places:
        return ["  they differ nowhere"]
    rows = [["  longest differences", "from s", "to s", pair.a, pair.b]]
    rows += [[f"  {names[p.demonstration]}", *interval_cells(p)] for p in places[:WORST]]
    more = len(places) - WORST
    lines = table(rows, right=(1, 2)).split("\n")
    return [*lines, *([f"  and {counted(more, 'more place')}"] * (more > 0))]


def _consistency_table(consistency: Consistency, names: dict[str, str]) -> list[str]:
    rows = [[f"{consistency.author} alone", "segments", "mean s", "variation %"]]
    rows += [
        [
            f"  {action.task}: {action.action}",
            str(action.count),
            f"{action.mean:.3f}",
            percent(action.variation),
        ]
        for action in consistency.actions
    ]
    lines = table(rows, right=(1, 2, 3)).split("\n")
    lines += [
        f"  odd duration: {place.human} {_place_text(place, names)}, {place.duration:.3f} s"
        for place in consistency.odd[:WORST]
    ]
    lines += [
        f"  nowhere else: {place.human} then {place.predicted} {_place_text(place, names)}"
        for place in consistency.rare[:WORST]
    ]
    return [*lines, ""]


def _place_text(place: Interval, names: dict[str, str]) -> str:
    return f"in {names[place.demonstration]} at {place.start:.3f} s"


def _kappa(kappa: float | None) -> str:
    return "-" if kappa is None else f"{kappa:.3f} ({landis_koch(kappa)})"


def _json_content(result: Agreement, names: dict[str, str]) -> dict[str, Any]:

    def plain(places: Sequence[Interval], first: str, second: str) -> list[dict[str, Any]]:
        return [
            {
                "id": place.demonstration,
                "name": names[place.demonstration],
                "start": place.start,
                "end": place.end,
                first: place.human,
                second: place.predicted,
            }
            for place in places[:WORST_JSON]
        ]

    content = result.to_json()
    for key, pairs in (("pairs", result.pairs), ("repeated", result.repeated)):
        for record, pair in zip(content[key], pairs, strict=True):
            record["places"] = {
                "apart": plain(pair.apart, "first", "second"),
                "alone": plain(pair.alone, "first", "second"),
                "shifted": plain(pair.shifted, "first", "second"),
            }
    for record, consistency in zip(content["own"], result.own, strict=True):
        record["places"] = {
            "odd": plain(consistency.odd, "action", "other"),
            "rare": plain(consistency.rare, "action", "next"),
        }
    return content
