"""What there is to say: each thing once, however long it goes on."""

from __future__ import annotations

import threading
import time

#: Seconds after which what comes again is something new.
QUIET = 0.5
#: Sentences that are kept for somebody who asks late.
KEPT = 100


class MessageQueue:
    """Sentences that wait to be asked for, by whatever thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._sentences: list[str] = []
        self._going_on: dict[object, float] = {}

    def say(self, sentence: str) -> None:
        """Say a sentence; of very many that nobody asks for, the newest are kept."""
        with self._lock:
            del self._sentences[: max(0, len(self._sentences) + 1 - KEPT)]
            self._sentences.append(sentence)

    def during(self, key: object, sentence: str, now: float | None = None) -> None:
        """Say a sentence when something begins, and not again while it goes on.

        Parameters
        ----------
        key : hashable
            What goes on.
        sentence : str
            What is said of it.
        now : float, optional
            Seconds of the host's monotonic clock; by default the present.
        """
        moment = time.monotonic() if now is None else now
        last = self._going_on.get(key)
        self._going_on[key] = moment
        if last is None or moment - last > QUIET:
            self.say(sentence)

    def take(self) -> tuple[str, ...]:
        """What was said since this was asked last."""
        with self._lock:
            taken, self._sentences = tuple(self._sentences), []
        return taken
