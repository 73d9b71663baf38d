"""What there is to draw of the channels: their envelopes, and what the coder wants to see of them.

The force panel draws from it, and so does the overview. A hidden channel costs nothing: it is
neither read nor searched.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from forcelab.demonstration import GAP_PERIODS, Channel, Demonstration
from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.jobs import Progress, finish
from forcelab.signals.minmax import Columns, Envelope, Extremes, drawn_together, read_envelopes

__all__ = ["ForceChannels", "Gaps"]

#: Up to so many samples are read at once, in some 10 ms; more are read in the background.
AT_ONCE = 500_000
#: Seconds between two drawings of what was read so far.
BREATH = 0.1

Real = NDArray[np.float64]
Gaps = Real
"""Starts and ends of gaps in seconds, shape (2, g)."""


def _gaps(demonstration: Demonstration) -> Generator[Progress, None, Gaps]:
    """Find the gaps of a demonstration."""
    yield Progress(0, 1, "looking for gaps")
    return np.array(demonstration.gaps, dtype=np.float64).reshape(-1, 2).T


class ForceChannels(QObject):
    """The channels of the open demonstration.

    Parameters
    ----------
    document : Document
        Whose demonstration is drawn.
    jobs : Jobs
        Runs the reading of long demonstrations.

    Attributes
    ----------
    channels : tuple of Channel
        All of them, in the order of the recording.
    gaps : ndarray, shape (2, g)
        Starts and ends of the gaps in seconds, once they are known.
    overlaid, autoscale : bool
        Whether the channels of one unit share an axis; whether axes follow what is visible.

    Signals
    -------
    choices_changed()
        Other channels are shown, or in another way.
    grown()
        More was read.
    """

    choices_changed = Signal()
    grown = Signal()

    def __init__(self, document: Document, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._document = document
        self._jobs = jobs
        self._id = ""
        self._envelopes: dict[str, Envelope] = {}
        self._hidden: set[str] = set()
        self._drawn_at = 0.0
        self.channels: tuple[Channel, ...] = ()
        self.gaps: Gaps = np.empty((2, 0))
        self.overlaid = False
        self.autoscale = False
        document.demonstration_changed.connect(self._take)
        self._take()

    # What there is

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all channels."""
        return tuple(channel.name for channel in self.channels)

    @property
    def shown(self) -> tuple[str, ...]:
        """The names of those that are shown."""
        return tuple(name for name in self.names if name not in self._hidden)

    @property
    def read(self) -> float:
        """Which share of the shown channels was read, from 0 to 1."""
        wanted = [self._envelopes[name] for name in self.shown]
        total = sum(len(envelope) for envelope in wanted)
        return sum(envelope.filled for envelope in wanted) / total if total else 1.0

    def envelope(self, name: str) -> Envelope:
        """The envelope of a channel that is shown."""
        return self._envelopes[name]

    def glitches(self, name: str, start: float, end: float) -> tuple[Real, NDArray[np.bool_]]:
        """When a shown channel has glitches within a span, and which of them are upwards."""
        demonstration, envelope = self._document.demonstration, self._envelopes[name]
        if demonstration is None or envelope.limits is None:
            return np.empty(0), np.empty(0, dtype=np.bool_)
        times = demonstration.times[envelope.glitches]
        within = (start <= times) & (times <= end)
        upwards = envelope.values[envelope.glitches] > envelope.limits[1]
        return times[within], upwards[within]

    def columns(self, edges: NDArray[np.float64]) -> Columns:
        """The samples between edges in seconds."""
        demonstration = self._document.demonstration
        if demonstration is None:
            return Columns(np.empty(0), edges)
        return Columns(demonstration.times, edges, GAP_PERIODS * demonstration.period)

    def drawn(self, names: Sequence[str], columns: Columns) -> dict[str, Extremes]:
        """What is drawn of some channels that are shown, by their names."""
        if not names:
            return {}
        found = drawn_together([self._envelopes[name] for name in names], columns)
        return dict(zip(names, found, strict=True))

    def values_at(self, seconds: float) -> dict[str, float | None]:
        """The last sample of each shown channel at or before a time.

        None in a gap, outside of the recording and where the sample is missing.
        """
        demonstration = self._document.demonstration
        if demonstration is None:
            return {}
        times, period = demonstration.times, demonstration.period
        last = int(np.searchsorted(times, seconds, side="right")) - 1
        following = float(times[last + 1]) if last + 1 < len(times) else np.inf
        ended = seconds >= times[last] + period and following - times[last] > GAP_PERIODS * period
        if last < 0 or ended:
            return dict.fromkeys(self.shown)
        values = {name: float(self._envelopes[name].values[last]) for name in self.shown}
        return {name: value if np.isfinite(value) else None for name, value in values.items()}

    # What is wanted

    def set_shown(self, name: str, shown: bool) -> None:
        """Show or hide a channel; the choice is kept by its name."""
        if shown != (name in self._hidden):
            return
        self._hidden ^= {name}
        self._read()
        self.choices_changed.emit()

    def show_all(self) -> None:
        """Show every channel."""
        if self._hidden & set(self.names):
            self._hidden -= set(self.names)
            self._read()
            self.choices_changed.emit()

    def set_overlaid(self, overlaid: bool) -> None:
        """Draw the channels of one unit over each other, or each on its own axis."""
        if overlaid != self.overlaid:
            self.overlaid = overlaid
            self.choices_changed.emit()

    def set_autoscale(self, autoscale: bool) -> None:
        """Let axes follow what is visible, or hold the whole recording."""
        if autoscale != self.autoscale:
            self.autoscale = autoscale
            self.choices_changed.emit()

    def save_choices(self) -> None:
        """Remember what is wanted."""
        settings.put("force/hidden", sorted(self._hidden))
        settings.put("force/overlaid", self.overlaid)
        settings.put("force/autoscale", self.autoscale)

    def restore_choices(self) -> None:
        """Want again what was remembered."""
        self._hidden = set(settings.strings("force/hidden"))
        self.overlaid = settings.flag("force/overlaid")
        self.autoscale = settings.flag("force/autoscale")
        self._read()
        self.choices_changed.emit()

    # Reading

    def _take(self) -> None:
        """Take over another demonstration; a new video clock leaves its samples as they are."""
        demonstration = self._document.demonstration
        if demonstration is not None and self._document.id == self._id:
            return
        self._id = self._document.id if demonstration is not None else ""
        self._jobs.cancel("force gaps")
        self._jobs.cancel("force envelopes")
        self._envelopes = {}
        self.gaps = np.empty((2, 0))
        self.channels = demonstration.channels if demonstration is not None else ()
        if demonstration is not None:
            if demonstration.signals.size <= AT_ONCE:
                self.gaps = finish(_gaps(demonstration))
            else:
                self._jobs.run(_gaps(demonstration), self._got_gaps, key="force gaps")
        self._read()
        self.choices_changed.emit()

    def _read(self) -> None:
        """Read what is shown and was not read yet."""
        demonstration = self._document.demonstration
        if demonstration is None or not self._id:
            return
        self._jobs.cancel("force envelopes")
        for column, name in enumerate(self.names):
            if name not in self._hidden and name not in self._envelopes:
                self._envelopes[name] = Envelope(demonstration.signals, column)
        wanted = [self._envelopes[name] for name in self.shown]
        wanted = [envelope for envelope in wanted if envelope.filled < len(envelope)]
        if demonstration.signals.size <= AT_ONCE:
            finish(read_envelopes(wanted))
        elif wanted:
            key = "force envelopes"
            self._jobs.run(read_envelopes(wanted), self._got_all, progress=self._got_some, key=key)

    def _got_gaps(self, gaps: Gaps) -> None:
        """The gaps were found."""
        self.gaps = gaps
        self.grown.emit()

    def _got_all(self, _: object) -> None:
        """All that is shown was read."""
        self.grown.emit()

    def _got_some(self, _: object) -> None:
        """Some more was read; it is drawn now and then."""
        now = time.monotonic()
        if now - self._drawn_at >= BREATH:
            self._drawn_at = now
            self.grown.emit()
