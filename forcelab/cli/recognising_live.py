"""What became of a recogniser on a recording, in words."""

from __future__ import annotations

from typing import Any

from forcelab.wording import counted

__all__ = ["told"]


def told(figures: dict[str, Any]) -> str:
    """What became of it, in a sentence.

    Parameters
    ----------
    figures : dict
        As :meth:`forcelab.live.recognition.LiveRecognition.keep` gives them.
    """
    after = figures["after"]
    late = (
        "no label in time"
        if after["median"] is None
        else f"labels {after['median']:.2f} s after the force (99 %: {after['p99']:.2f} s)"
    )
    return (
        f"Recognised by '{figures['author']}': {counted(figures['segments'], 'segment')}, "
        f"{100 * figures['labelled']:.0f} % labelled, {late}, "
        f"{100 * figures['cpu']:.1f} % of a core."
    )
