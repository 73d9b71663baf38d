"""What an evaluation says of the demonstrations that it was given, beside its scores."""

from __future__ import annotations

from collections.abc import Sequence

from forcelab.recognition.examples import Examples, Labelled, actions_of
from forcelab.recognition.grouping import twins
from forcelab.recognition.settings import Settings

__all__ = [
    "fitting_remarks",
    "group_remarks",
    "lonely_remark",
    "twin_remarks",
    "with_labels",
]


def with_labels(labelled: Sequence[Labelled]) -> tuple[list[Labelled], tuple[str, ...]]:
    """The demonstrations that have a segment, and a remark on those that have none."""
    used = [item for item in labelled if item.segments]
    without = len(labelled) - len(used)
    if not without:
        return used, ()
    what = (
        "demonstration without labels was" if without == 1 else "demonstrations without labels were"
    )
    return used, (f"{without} {what} left out.",)


def twin_remarks(labelled: Sequence[Labelled]) -> tuple[str, ...]:
    """A remark on recordings that are there twice."""
    names = [item.demonstration.name for item in labelled]
    return tuple(
        f"{' and '.join(names[i] for i in same)} hold the same recording, so that they were left "
        f"out together; remove all but one."
        for same in twins([item.demonstration for item in labelled])
        if len(same) > 1
    )


def group_remarks(parts: Sequence[Sequence[int]]) -> tuple[str, ...]:
    """A remark on demonstrations that were left out together."""
    most = max(map(len, parts))
    return (f"Left out in {len(parts)} groups of up to {most}.",) if most > 1 else ()


def lonely_remark(examples: Sequence[Examples], parts: Sequence[Sequence[int]]) -> tuple[str, ...]:
    """A remark on actions of a single demonstration or group, which no other can teach."""
    homes: dict[str, dict[int, str]] = {}  # by action, the first demonstration of each group
    for number, group in enumerate(parts):
        for i in group:
            for action in actions_of([examples[i]]):
                homes.setdefault(action, {}).setdefault(number, examples[i].name)
    lonely = {action: next(iter(of.values())) for action, of in homes.items() if len(of) < 2}
    if not lonely:
        return ()
    what = "group" if max(map(len, parts)) > 1 else "demonstration"
    told = ", ".join(f"{action} (only in {name})" for action, name in lonely.items())
    return (f"Cannot be recognised when its only {what} is left out: {told}.",)


def fitting_remarks(
    labelled: Sequence[Labelled], examples: Sequence[Examples], settings: Settings
) -> tuple[str, ...]:
    """Remarks on how settings and demonstrations fit together."""
    remarks = []
    rates = sorted(item.demonstration.rate for item in labelled)
    if rates[-1] > 1.01 * rates[0]:
        remarks.append(
            f"Recorded at {rates[0]:.6g} to {rates[-1]:.6g} Hz, recognised at "
            f"{examples[0].rate:.6g} Hz."
        )
    short = [
        example.name
        for example in examples
        if len(example.times) * settings.hop(example.rate) < settings.max_scale
    ]
    if short and settings.features == "wavelets":
        remarks.append(
            f"The largest scale, {settings.max_scale:g} samples, is longer than {short[0]}"
            + (f" and {len(short) - 1} more" if len(short) > 1 else "")
            + ": there it sees held end values more than forces."
        )
    return tuple(remarks)
