"""What is said of the queue: why there is nothing in it, and how far the judging is."""

from __future__ import annotations

from forcelab.gui.review.queue_reading import Read
from forcelab.review.queue import Queue
from forcelab.review.run_result import Outcome
from forcelab.review.verdicts import report

__all__ = [
    "action_name",
    "explained",
    "missing",
    "percentages",
    "summary",
    "untested",
    "verdict_name",
]


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
        coming = (
            "A recogniser is being trained; every place where you and it differ will be listed "
            "here."
        )
        none = "Train a recogniser, and every place where you and it differ is listed here."
        return coming if training else none
    if read is None:
        return "Comparing…"
    if read.queue.open or read.queue.judged:
        return ""
    if not outcome.tested:
        return untested(
            outcome,
            "Nothing was tested, so nothing can differ.",
            "What the recogniser proposes for the others is in Proposals.",
        )
    if not read.outcome.tested:
        return "You code these demonstrations blind; what differs is shown when done."
    return "Labels and predictions agree everywhere."


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
        "suspected": "A recogniser that has not seen them contradicts, where it is usually right.",
        "actions": "Both see an action, but not the same one.",
        "missed": "Labelled, and the model sees nothing.",
        "boundaries": "Both see the same actions; only the edge between them differs.",
        "invented": "Unlabelled time, which is never scored, where the model sees an action.",
        "judged": "What somebody has judged, the latest first.",
    }[kind]


def percentages(kind: str) -> str:
    """What the percentages of a section are, and in which order it stands."""
    if kind == "suspected":
        return "Percentages: how much speaks for an error of the coder, the largest first."
    return "Percentages: how sure the model is; what is long and sure comes first."


def summary(queue: Queue) -> str:
    """How much is open, and who was right so far."""
    main = len(queue.suspected) + len(queue.actions) + len(queue.missed)
    if not queue.judged:
        return f"{main} to judge, none judged yet."
    said = report(queue.judged)
    return (
        f"{main} to judge. Right so far: human {sum(pair.human_right for pair in said)}, model "
        f"{sum(pair.model_right for pair in said)}; ambiguous "
        f"{sum(pair.ambiguous for pair in said)}."
    )


def action_name(action: str | None) -> str:
    """An action as it is written in a row."""
    return "unlabelled" if action is None else action


def verdict_name(verdict: str) -> str:
    """A verdict as it is written in a row."""
    return {
        "human": "human right",
        "model": "model right",
        "ambiguous": "ambiguous",
    }[verdict]
