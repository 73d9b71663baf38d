"""What the training bar says: runs, progress, and how up to date the recogniser is."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING

from forcelab.gui.review.training_jobs import Kept

if TYPE_CHECKING:
    from forcelab.review.training import Step

__all__ = ["progress_text", "run_text", "standing_text"]


def standing_text(
    edits: int | None, coder: str = "", *, kept: bool = True, resettled: bool = False
) -> tuple[str, str]:
    """How up to date what is reviewed is, at length and in short.

    Parameters
    ----------
    edits : int or None
        Edits and new demonstrations since it was trained; None where nothing is.
    coder : str, optional
        Whose labels it was trained on, where the next training takes another coder's.
    kept : bool
        Whether there is a recogniser; an evaluation leaves none.
    resettled : bool
        Whether the next training takes other settings.
    """
    if edits is None:
        return "not trained yet", ""
    if coder:
        told = "trained on the labels of {0}"
        return told.format(coder), f"trained on {coder}"
    if not edits and kept and resettled:
        told = "trained with other settings"
        return told, "other settings"
    if not edits and kept:
        return "up to date", ""
    if not edits:
        told = "up to date, no recogniser kept"
        if resettled:
            told = "of other settings, no recogniser kept"
        return told, "no recogniser kept"
    trained = "this recogniser was trained"
    since = trained if kept else "this run"
    told = "{0} edits or new demonstrations since {1}"
    short = "{0} changes since"
    if edits == 1:
        told = "{0} edit or new demonstration since {1}"
        short = "{0} change since"
    return told.format(edits, since), short.format(edits)


def run_text(kept: Kept) -> str:
    """A run in a list: its number, what, how, how good, and when."""
    here = kept.time.astimezone()
    now = datetime.now(here.tzinfo)
    day = "" if here.date() == now.date() else "%d %b " if here.year == now.year else "%d %b %Y "
    when = here.strftime(f"{day}%H:%M")
    score = "" if kept.f1 is None else f" · F1 {100 * kept.f1:.0f} %"
    preset = f" · {kept.preset}" if kept.preset else ""
    return f"{kept.number}: {kept.title}{preset}{score} · {when}"


def progress_text(step: Step, *, short: bool = False) -> str:
    """How far a training is, in words such as ``"fold 3 of 10 · epoch 41 · 12 s left"``."""
    phases = {
        "features": "features",
        "fold": f"fold {step.fold} of {step.folds}",
        "final fit": "final fit",
        "proposals": "proposals",
        "storing": "storing",
    }
    parts = [phases[step.phase]]
    if step.epoch is not None and not short:
        parts.append(f"epoch {step.epoch}")
    # A fit that takes longer than those before it is not "0 s" from its end.
    if step.seconds_left is not None and step.seconds_left >= 0.5:
        parts.append(f"{_span(step.seconds_left)} left")
    return " · ".join(parts)


def _span(seconds: float) -> str:
    """Seconds, or minutes where there are many."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min"
