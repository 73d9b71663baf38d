"""What is said of the queue: why there is nothing in it, and how far the judging is."""

from __future__ import annotations

from PySide6.QtCore import QCoreApplication

from forcelab.gui.review.queue_reading import Read
from forcelab.review.judging import report
from forcelab.review.outcome import Outcome
from forcelab.review.queue import Queue

__all__ = ["missing", "summary", "untested"]

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
