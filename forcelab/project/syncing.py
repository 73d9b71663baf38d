"""Bringing commits to the disk behind the back of whoever made them."""

from __future__ import annotations

import os
import threading
from pathlib import Path

__all__ = ["Syncing"]


class Syncing:
    """A thread that syncs a store's journal to the disk whenever there is something new in it.

    Parameters
    ----------
    journal : Path
        SQLite's write-ahead log. Locks lie on the store and its index, never on this file: that it
        is opened and closed here lets go of none.

    Attributes
    ----------
    failed : bool
        Whether the disk has refused: whoever writes has to wait for it from now on, and is told.
    """

    def __init__(self, journal: Path) -> None:
        self.failed = False
        self._journal = journal
        self._asked = threading.Event()
        self._ended = False
        self._thread = threading.Thread(target=self._run, name="forcelab sync", daemon=True)
        self._thread.start()

    def ask(self) -> None:
        """Have everything brought to the disk that was committed by now."""
        self._asked.set()

    def close(self) -> None:
        """Bring the rest to the disk, and end."""
        self._ended = True
        self._asked.set()
        self._thread.join()

    def _run(self) -> None:
        """Sync as often as it is asked for; what is asked for meanwhile is one more time."""
        while self._asked.is_set() or not self._ended:
            self._asked.wait()
            self._asked.clear()
            try:
                with self._journal.open("rb+") as file:
                    os.fsync(file.fileno())
            except FileNotFoundError:
                pass  # all of it was moved into the store, which SQLite syncs itself
            except OSError:
                self.failed = True
                return
