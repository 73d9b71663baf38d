"""The recogniser that follows the devices, in the hands of whoever holds the recorder."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from forcelab.errors import InputError

if TYPE_CHECKING:
    from forcelab.capture.device import Device
    from forcelab.capture.recorder import Recorder
    from forcelab.capture.save import SavedRecording
    from forcelab.live.recognition import LiveRecognition, LiveSnapshot

log = logging.getLogger("forcelab")

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
        self._trouble = ""  # why a recording has no track; what failed is asked nothing more

    @property
    def glimpse(self) -> LiveSnapshot | None:
        """What was recognised last, for any thread; None where nothing is."""
        live = self._live
        return None if live is None or self._trouble else live.glimpse

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

    def anew(self, *, keeping: bool, firsts: Sequence[int] | None = None) -> None:
        """Begin with another one that knows nothing yet, whatever became of the one before.

        Where that fails, there is no track.
        """
        self._trouble = ""
        try:
            self.begin(self.renewed(), keeping=keeping, firsts=firsts)
        except Exception as error:  # noqa: BLE001 - logged, and told with what is kept
            self.lose(error)

    def lose(self, error: Exception) -> None:
        """Recognise no more until all begins anew; of a recording that runs it is told why."""
        self._trouble = _told(error)

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
        if self._live is None or self._trouble:
            return
        if not wanted:
            self._paused = True
            return
        if self._paused:
            self.begin(self.renewed(), keeping=False)
        self._live.look()

    def finish(self) -> None:
        """The recording has ended: take in the last of it. What fails costs its track alone."""
        if self._live is None or self._trouble:
            return
        try:
            self._live.finish()
        except Exception as error:  # noqa: BLE001 - as above
            self.lose(error)

    def keep(self, path: Path, kept: SavedRecording) -> SavedRecording:
        """Keep the track with its demonstration; gives that with a sentence on it."""
        if self._trouble:
            return replace(kept, remarks=(*kept.remarks, self._trouble))
        if self._live is None:
            return kept
        try:
            figures = self._live.keep(path, kept)
        except Exception as error:  # noqa: BLE001 - as above
            return replace(kept, remarks=(*kept.remarks, _told(error)))
        one = "Recognised by '{author}': 1 segment, {share:.0f} % labelled."
        more = "Recognised by '{author}': {segments} segments, {share:.0f} % labelled."
        told = (one if figures["segments"] == 1 else more).format(
            author=figures["author"],
            segments=figures["segments"],
            share=100 * figures["labelled"],
        )
        return replace(kept, remarks=(*kept.remarks, told))


def _told(error: Exception) -> str:
    """What went wrong with a track; a fault of the program is in the log besides."""
    if isinstance(error, InputError):
        return str(error)
    log.error("A live track is lost.", exc_info=error)
    return "The recogniser failed ({fault}): the recording is kept without its track.".format(
        fault=f"{type(error).__name__}: {error}"
    )


def _alike(one: LiveRecognition, other: LiveRecognition) -> bool:
    """Whether two do the same."""
    return one.recogniser is other.recogniser and one.latency == other.latency
