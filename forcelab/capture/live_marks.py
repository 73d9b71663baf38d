"""Actions that are marked while a recording runs, by the keys that are held down."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from typing import Any

from forcelab.labels import Segment, Track, ordered

#: Seconds between a key going up and down again that no finger is as fast as. On X a held key
#: repeats as a release and a press; where these are read one by one, nothing tells what they are.
AUTOREPEAT_SECONDS = 0.03


class LiveMarks:
    """Segments of the actions whose keys are held, in seconds of a clock that never runs back."""

    def __init__(self) -> None:
        self.segments: list[Segment] = []
        self._held: list[str] = []
        self._since = 0.0
        self._released: tuple[str, float] | None = None  # may come down again at once

    def press(self, action: str, down: bool, now: float) -> None:
        """Note that the key of an action went down or up."""
        released, at = self._released or ("", 0.0)
        if down and released == action and now - at <= AUTOREPEAT_SECONDS:
            self._released = None
            return
        self._settle()
        if down:
            self._release(action, now)
            self._held.append(action)
        else:
            self._released = action, now

    def current(self) -> tuple[str, float] | None:
        """The action that is marked now, and since when; None where no key is down."""
        self._settle()
        return (self._held[-1], self._since) if self._held else None

    def end(self, now: float) -> None:
        """Release all keys."""
        self._settle()
        self._extend(now)
        self._held.clear()

    def track(self, now: float, since: float = 0.0) -> list[Segment]:
        """All segments that end after a time, with the one that grows."""
        ended = copy.copy(self)
        ended.segments, ended._held = self.segments.copy(), self._held.copy()
        ended.end(now)
        return [segment for segment in ended.segments if segment.end > since]

    def _settle(self) -> None:
        """Count a key that went up as released, as it has not come down again at once."""
        if self._released is not None:
            (action, at), self._released = self._released, None
            self._release(action, at)

    def _release(self, action: str, now: float) -> None:
        """Stop holding an action at a time."""
        self._extend(now)
        if action in self._held:
            self._held.remove(action)

    def _extend(self, now: float) -> None:
        """Let the marked action last until a time."""
        if self._held and now > self._since:
            action, start = self._held[-1], self._since
            last = self.segments[-1] if self.segments else None
            if last is not None and (last.end, last.action) == (start, action):
                start = self.segments.pop().start
            self.segments.append(Segment(start, now, action))
        self._since = max(now, self._since)


def marks_track(
    marks: Sequence[Mapping[str, Any]], start: float, end: float, author: str
) -> Track | None:
    """The track of the keys that were held down."""
    marked = LiveMarks()
    for mark in sorted(marks, key=lambda mark: float(mark["at"])):
        at = min(float(mark["at"]) - start, end)  # none before 0 either
        marked.press(str(mark["action"]), bool(mark["down"]), at)
    marked.end(end)
    return Track(author, ordered(marked.segments)) if marked.segments else None
