"""The recogniser that follows the devices, in the hands of whoever holds the recorder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication

from forcelab.errors import InputError

if TYPE_CHECKING:
    from forcelab.capture.blocks import Device
    from forcelab.capture.keeping import Kept
    from forcelab.capture.recorder import Recorder
    from forcelab.live.glimpse import Glimpse
    from forcelab.live.recognition import LiveRecognition

__all__ = ["LiveTrack", "Making"]

#: Makes what follows the open devices of a recorder.
Making = Callable[["Recorder", "Sequence[Device]"], "LiveRecognition"]


class LiveTrack:
    """What is recognised while devices are connected, anew from the start of each recording.

    So that the track of a recording rests on nothing that is not in it, and can be computed again.
    """

    def __init__(self) -> None:
        self._live: LiveRecognition | None = None
        self._spare: LiveRecognition | None = None  # like it, and knows nothing yet
        self._paused = False

    @property
    def glimpse(self) -> Glimpse | None:
        """What was recognised last, for any thread; None where nothing is."""
        live = self._live
        return None if live is None else live.glimpse

    def begin(
        self, live: LiveRecognition | None, *, keeping: bool, firsts: Sequence[int] | None = None
    ) -> None:
        """Recognise with this one from now on, or from the first samples of a recording.

        None ends it.
        """
        before, self._live, self._paused = self._live, live, False
        if before is None or live is None or not _alike(before, live):
            self._spare = None
        if live is not None:
            live.begin(keeping=keeping, after=before, firsts=firsts)

    def renewed(self) -> LiveRecognition | None:
        """Another one that knows nothing yet: the spare one where there is one."""
        spare, self._spare = self._spare, None
        if spare is not None or self._live is None:
            return spare
        return self._live.renewed()

    @property
    def lacking(self) -> LiveRecognition | None:
        """The one of which there is no spare yet.

        Making one takes longer than a person's finger on a key. Whoever does it in advance, with
        :meth:`~forcelab.live.recognition.LiveRecognition.renewed`, needs to hold nothing meanwhile.
        """
        return self._live if self._spare is None else None

    def spare(self, made: LiveRecognition) -> None:
        """Have one for the next recording; left alone if it is of another recogniser by now."""
        if self._live is not None and _alike(self._live, made):
            self._spare = made

    def look(self, wanted: bool) -> None:
        """Take in what came since, or let it pass where nobody looks and nothing is recorded."""
        if self._live is None:
            return
        if not wanted:
            self._paused = True
            return
        if self._paused:
            self.begin(self.renewed(), keeping=False)
        self._live.look()

    def finish(self) -> None:
        """The recording ends; to be called before it does."""
        if self._live is not None:
            self._live.finish()

    def keep(self, path: Path, kept: Kept) -> Kept:
        """Keep the track with its demonstration; gives that with a sentence on it."""
        if self._live is None:
            return kept
        try:
            figures = self._live.keep(path, kept)
        except InputError as error:  # the demonstration is kept, whatever becomes of its track
            return replace(kept, remarks=(*kept.remarks, str(error)))
        told = QCoreApplication.translate(
            "forcelab", "Recognised by '{author}': {segments} segments, {share:.0f} % labelled."
        ).format(
            author=figures["author"],
            segments=figures["segments"],
            share=100 * figures["labelled"],
        )
        return replace(kept, remarks=(*kept.remarks, told))


def _alike(one: LiveRecognition, other: LiveRecognition) -> bool:
    """Whether two do the same."""
    return one.recogniser is other.recogniser and one.latency == other.latency
