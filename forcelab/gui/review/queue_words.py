"""What is said of the queue: why there is nothing in it, and how far the judging is."""

from __future__ import annotations

from PySide6.QtCore import QCoreApplication

from forcelab.gui.review.queue_reading import Read
from forcelab.review.judging import report
from forcelab.review.outcome import Outcome
from forcelab.review.queue import Queue

__all__ = [
    "action_name",
    "explained",
    "missing",
    "percentages",
    "summary",
    "untested",
    "verdict_name",
]

translate = QCoreApplication.translate


def missing(outcome: Outcome | None, read: Read | None, *, training: bool) -> str:
    """Why there is nothing to list; empty where there is something.

    Parameters
    ----------
    outcome : Outcome or None
        What is reviewed.
    read : Read or None
        What was found in it, of what may be seen.
    training : bool
        Whether a recogniser is being trained.
    """
    if outcome is None:
        coming = translate(
            "forcelab",
            "A recogniser is being trained; every place where you and it differ will be listed "
            "here.",
        )
        none = translate(
            "forcelab",
            "Train a recogniser, and every place where you and it differ is listed here.",
        )
        return coming if training else none
    if read is None:
        return translate("forcelab", "Comparing…")
    if read.queue.open or read.queue.judged:
        return ""
    if not outcome.tested:
        return untested(
            outcome,
            translate("forcelab", "Nothing was tested, so nothing can differ."),
            translate("forcelab", "What the recogniser proposes for the others is in Proposals."),
        )
    if not read.outcome.tested:
        return translate(
            "forcelab", "You code these demonstrations blind; what differs is shown when done."
        )
    return translate("forcelab", "Labels and predictions agree everywhere.")


def untested(outcome: Outcome, nothing: str, further: str = "") -> str:
    """Why an outcome tested no demonstration, as the run itself has found.

    Parameters
    ----------
    outcome : Outcome
    nothing : str
        What follows from it here; said where the run kept no reason.
    further : str, optional
        What there is all the same.
    """
    reason = outcome.remarks[0] if outcome.remarks else nothing  # the run notes it first
    return " ".join(filter(None, (reason, further)))


def explained(kind: str) -> str:
    """What a section of the queue holds, in a sentence."""
    return {
        "suspected": translate(
            "forcelab",
            "A recogniser that has not seen them contradicts, where it is usually right.",
        ),
        "actions": translate("forcelab", "Both see an action, but not the same one."),
        "missed": translate("forcelab", "Labelled, and the model sees nothing."),
        "boundaries": translate(
            "forcelab", "Both see the same actions; only the edge between them differs."
        ),
        "invented": translate(
            "forcelab",
            "Unlabelled time, which is never scored, where the model sees an action.",
        ),
        "judged": translate("forcelab", "What somebody has judged, the latest first."),
    }[kind]


def percentages(kind: str) -> str:
    """What the percentages of a section are, and in which order it stands."""
    if kind == "suspected":
        return translate(
            "forcelab",
            "Percentages: how much speaks for an error of the coder, the largest first.",
        )
    return translate(
        "forcelab", "Percentages: how sure the model is; what is long and sure comes first."
    )


def summary(queue: Queue) -> str:
    """How much is open, and who was right so far."""
    main = len(queue.suspected) + len(queue.actions) + len(queue.missed)
    if not queue.judged:
        return translate("forcelab", "{0} to judge, none judged yet.").format(main)
    said = report(queue.judged)
    text = translate("forcelab", "{0} to judge. Right so far: human {1}, model {2}; ambiguous {3}.")
    return text.format(
        main,
        sum(pair.human_right for pair in said),
        sum(pair.model_right for pair in said),
        sum(pair.ambiguous for pair in said),
    )


def action_name(action: str | None) -> str:
    """An action as it is written in a row."""
    return translate("forcelab", "unlabelled") if action is None else action


def verdict_name(verdict: str) -> str:
    """A verdict as it is written in a row."""
    return {
        "human": translate("forcelab", "human right"),
        "model": translate("forcelab", "model right"),
        "ambiguous": translate("forcelab", "ambiguous"),
    }[verdict]
