"""A recogniser on a recording of the command line: what it tells, and what becomes of its track."""

from __future__ import annotations

import logging
import math
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TextIO, TypeVar

from forcelab.capture.save import SavedRecording
from forcelab.cli.output import printable
from forcelab.cli.stopping import unbroken
from forcelab.errors import InputError
from forcelab.live.recognition import LiveRecognition, Recognised
from forcelab.text import counted

__all__ = ["Recognition", "told"]

log = logging.getLogger("forcelab")
Found = TypeVar("Found")


class Recognition:
    """A recogniser on a recording, which goes on and is kept whatever fails here.

    Parameters
    ----------
    live : LiveRecognition
        It has begun.
    out : TextIO
        Takes the segments as they end, where there is no line that shows them.

    Attributes
    ----------
    trouble : str
        Why the recording has no track; empty where it has one.
    """

    def __init__(self, live: LiveRecognition, out: TextIO) -> None:
        self._live = live
        self._out: TextIO | None = None if sys.stderr.isatty() else out
        self.trouble = ""

    @property
    def now(self) -> str:
        """The action of the latest label and its probability; empty while there is none."""
        return "" if self.trouble else self._live.now

    def look(self) -> None:
        """Take in what came since."""
        with unbroken():
            found = self._tried(self._live.look)
        self._print(found or ())

    def finish(self) -> None:
        """The recording has ended: take in the last of it."""
        self._print(self._tried(self._live.finish) or ())

    def keep(self, path: Path, kept: SavedRecording) -> dict[str, Any] | None:
        """Keep the track and tell what became of it as plain values; None where there is none."""
        return self._tried(partial(self._live.keep, path, kept))

    def _tried(self, do: Callable[[], Found]) -> Found | None:
        """What a step gives; None once the track is lost."""
        if self.trouble:
            return None
        try:
            return do()
        except Exception as error:  # noqa: BLE001 - logged, and told when the recording is kept
            self._lose(error)
            return None

    def _lose(self, error: Exception) -> None:
        """Recognise no more."""
        if isinstance(error, InputError):
            self.trouble = str(error)
            return
        log.error("A live track is lost.", exc_info=error)
        fault = f"{type(error).__name__}: {error}"
        self.trouble = f"The recogniser failed ({fault}): the recording is kept without its track."

    def _print(self, found: Sequence[Recognised]) -> None:
        """Print the segments that have ended, as long as anybody reads that."""
        try:
            for one in found if self._out is not None else ():
                sure = "" if math.isnan(one.probability) else f"  {one.probability:.2f}"
                start, end = (max(at - self._live.begun, 0.0) for at in (one.start, one.end))
                line = f"{start:7.2f} {end:7.2f}  {printable(one.action)}{sure}"
                print(line, file=self._out, flush=True)
        except OSError:
            self._out = None


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
