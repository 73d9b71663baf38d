"""Pictures of a scalogram that are asked for: one at a time, once the span has come to rest."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QTimer, Signal

from forcelab.errors import ForcelabError
from forcelab.gui.jobs import Job, Jobs
from forcelab.gui.label.scalogram_job import Wish, compute

if TYPE_CHECKING:
    from forcelab.signals.scalogram import Scalogram, Survey

__all__ = ["Asking"]

#: Milliseconds for which the span must rest before a picture of it is begun.
PATIENCE = 40


class Asking(QObject):
    """Has pictures computed in the background.

    Parameters
    ----------
    jobs : Jobs
        Runs the computing.
    wish : callable
        What is wanted a picture of, when it is begun; None for nothing.

    Attributes
    ----------
    view : Survey or None
        What is known of the channel, for the pictures that come next.
    wanted : bool
        Whether a picture is waited for.
    came : Signal(Scalogram)
        A picture, the coarse one first where there is one.
    refused : Signal(str)
        Why there is none.
    """

    came = Signal(object)
    refused = Signal(str)

    def __init__(self, jobs: Jobs, wish: Callable[[], Wish | None], parent: QObject) -> None:
        super().__init__(parent)
        self.view: Survey | None = None
        self.wanted = False
        self._jobs, self._wish = jobs, wish
        self._shown: Scalogram | None = None
        self._job: Job | None = None
        self._timer = QTimer(self, singleShot=True, interval=PATIENCE)
        self._timer.timeout.connect(self._begin)

    def ask(self) -> None:
        """Have a picture made of what is seen then."""
        self.wanted = True
        self._timer.start()
        if self.view is not None and self._job is not None:
            # What it computes is out of date, and it would slow down whoever pans and zooms.
            self._job.cancel()
            self._job = None

    def stop(self) -> None:
        """Compute nothing any more."""
        self._timer.stop()
        self.wanted, self._shown = False, None
        if self._job is not None:
            self._job.cancel()
            self._job = None

    def forget(self) -> None:
        """The pictures are of another channel from now on."""
        self.view = None

    def _begin(self) -> None:
        """Start computing."""
        wish = self._wish()
        if wish is None:
            self.stop()
            return

        def done(picture: Scalogram) -> None:
            self.wanted = self._timer.isActive()  # the span may have changed again
            self._tell(picture)

        def failed(error: Exception) -> None:
            self.wanted = self._timer.isActive()
            known = isinstance(error, ForcelabError)
            self.refused.emit(str(error) if known else "The scalogram failed; see the log.")

        def moved(step: object) -> None:
            picture = getattr(step, "picture", None)
            if picture is not None and picture is not self._shown:
                if not picture.coarse:  # what the job goes on with is not seen
                    self.wanted = self._timer.isActive()
                self._tell(picture)

        self._job = self._jobs.run(
            compute(wish, self.view), done, failed, moved, key=f"scalogram {id(self)}"
        )

    def _tell(self, picture: Scalogram) -> None:
        """Give a newer picture away."""
        if picture is not self._shown:
            self._shown, self.view = picture, picture.view
            self.came.emit(picture)
