"""What is said where timeline pairs are missing, and how their actions are listed and drawn."""

from __future__ import annotations

from PySide6.QtGui import QColor

from forcelab.gui.figures.tracks import Look
from forcelab.gui.review.queue_words import untested
from forcelab.gui.shortcuts import keys
from forcelab.gui.theme import colours
from forcelab.review.run_result import Outcome

__all__ = ["Looks", "actions_of", "missing"]


class Looks(dict[str, Look]):
    """Looks of actions; grey where an action is not known."""

    def __missing__(self, action: str) -> Look:
        """A look that is nobody's."""
        return Look("", QColor(colours().muted))


def actions_of(outcome: Outcome) -> tuple[str, ...]:
    """What a run knows, what its coder labelled and what it predicts; thousands of segments."""
    both = (*outcome.tested, *outcome.proposals)
    tracks = [track for one in both for track in (one.human, one.predicted)]
    return tuple(dict.fromkeys((*outcome.actions, *(s.action for t in tracks for s in t))))


def missing(
    outcome: Outcome | None, *, training: bool, entries: bool, hidden: bool, shown: bool
) -> str:
    """Why there is nothing to see; empty where there is something.

    Parameters
    ----------
    outcome : Outcome or None
        What is reviewed.
    training : bool
        Whether a recogniser is being trained.
    entries, hidden : bool
        Whether any demonstration may be seen, and whether any is coded blind.
    shown : bool
        Whether the filter lets any through.
    """
    if outcome is None and training:
        return (
            "A recogniser is being trained; human and predicted timelines will stand here in pairs."
        )
    if outcome is None:
        bound = keys().shown("train")
        return (
            "Train a recogniser{key} and human and predicted timelines stand here in pairs.".format(
                key=f" ({bound})" if bound else ""
            )
        )
    if not entries and hidden:
        return "All demonstrations of this run are hidden while you code them blind."
    if not entries:
        return untested(outcome, "This run tested no demonstration.")
    return "" if shown else "No demonstration fits the filter."
