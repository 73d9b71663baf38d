"""The reviewed run as the coder may see it: without what is coded blind; its actions' styles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from forcelab.gui.document import Document
from forcelab.review.run_result import RunResult, action_styles
from forcelab.vocabulary import Vocabulary


def blind_demonstrations(document: Document) -> frozenset[str]:
    """The demonstrations that the coder is assigned to code blind, and has not finished."""
    if document.project is None:
        return frozenset()
    return document.project.coding.blind_to(document.author)


def visible_run(document: Document) -> RunResult | None:
    """The reviewed run, without what the coder is assigned to code blind.

    Scores that are pooled over demonstrations stay as the run has them. Its remarks name segments
    and demonstrations, so they are left out where it rests on hidden labels. Such labels have no
    author: how often they were edited since is not counted either.
    """
    run, blind = document.review.run, blind_demonstrations(document)
    if run is None or not blind:
        return run
    hidden = {
        used
        for used in run.labels
        if used.edit and used.author != document.author and used.demonstration in blind
    }
    return replace(
        run,
        labels=tuple(replace(u, author="") if u in hidden else u for u in run.labels),
        remarks=() if hidden else run.remarks,
        tested=tuple(reviewed for reviewed in run.tested if reviewed.id not in blind),
        proposals=tuple(reviewed for reviewed in run.proposals if reviewed.id not in blind),
    )


def on_visible_run_changed(document: Document, follow: Callable[[], object]) -> None:
    """Have a view follow the run, and what of it the coder may see."""
    for changed in (
        document.review.run_changed,
        document.author_changed,
        document.listing_changed,  # demonstrations may be coded blind from now on
    ):
        changed.connect(follow)


def with_keys(
    vocabulary: Vocabulary, keys: Vocabulary, *, task: str = "", apart: bool = False
) -> Vocabulary:
    """The same actions, each with the key that paints it in the open demonstration, or with none.

    `keys` is the vocabulary of the open demonstration, `task` its task; `apart`: the actions of the
    run have their task as a suffix.
    """
    suffix = f"_{task}" if apart else ""
    keys_by_name = {action.name + suffix: action.key for action in keys}
    return Vocabulary(tuple(replace(a, key=keys_by_name.get(a.name, "")) for a in vocabulary))


def reviewed_vocabulary(document: Document) -> Vocabulary:
    """The styles of the reviewed run's actions; without a run, those of the open demonstration."""
    project, run = document.project, document.review.run
    if project is None or run is None:
        return document.vocabulary
    return action_styles(project, run)


def untested_text(run: RunResult, nothing: str, further: str = "") -> str:
    """Why a run tested no demonstration, as it has found itself, else `nothing`; then `further`."""
    reason = run.remarks[0] if run.remarks else nothing  # the run notes it first
    return " ".join(filter(None, (reason, further)))
