"""The track that held keys make: of several, the last one pressed counts."""

from __future__ import annotations

from forcelab.labels import Segment

__all__ = ["LiveMarks"]

#: Seconds between a key going up and down again that no finger is as fast as. On X a held key
#: repeats as a release and a press; where these are read one by one, nothing tells what they are.
BRIDGE = 0.03


class LiveMarks:
    """Grows while keys go down and up, in any clock's seconds that never run back.

    Attributes
    ----------
    segments : list of Segment
        Those that have ended.
    """

    def __init__(self) -> None:
        self.segments: list[Segment] = []
        self._held: list[str] = []
        self._since = 0.0
        self._lifted: tuple[str, float] | None = None  # may come down again at once

    def press(self, action: str, down: bool, now: float) -> None:
        """The key of an action went down or up."""
        lifted = self._lifted
        if down and lifted is not None and lifted[0] == action and now - lifted[1] <= BRIDGE:
            self._lifted = None
            return
        self._settle()
        if down:
            self._take(action, now)
            self._held.append(action)
        else:
            self._lifted = action, now

    def growing(self) -> tuple[str, float] | None:
        """The action that counts now, and since when; None where no key is down."""
        self._settle()
        return (self._held[-1], self._since) if self._held else None

    def end(self, now: float) -> None:
        """No key is heard any more."""
        self._settle()
        self._until(now)
        self._held.clear()

    def track(self, now: float, since: float = 0.0) -> list[Segment]:
        """All segments that end after a time, with the one that grows."""
        seen = []
        for segment in reversed(self.segments):
            if segment.end <= since:
                break
            seen.append(segment)
        seen.reverse()
        lifted, until = self._lifted or ("", now)
        if self._held and until > self._since:
            seen.append(Segment(self._since, until, self._held[-1]))
        below = [action for action in self._held if action != lifted]
        if below and now > until:
            seen.append(Segment(until, now, below[-1]))
        return seen

    def _settle(self) -> None:
        """What went up stays up."""
        if self._lifted is not None:
            (action, at), self._lifted = self._lifted, None
            self._take(action, at)

    def _take(self, action: str, now: float) -> None:
        """Hold an action no more, from a time on."""
        self._until(now)
        if action in self._held:
            self._held.remove(action)

    def _until(self, now: float) -> None:
        """The action that counts has lasted until a time."""
        if self._held and now > self._since:
            action, start = self._held[-1], self._since
            last = self.segments[-1] if self.segments else None
            if last is not None and (last.end, last.action) == (start, action):
                start = self.segments.pop().start
            self.segments.append(Segment(start, now, action))
        self._since = max(now, self._since)
