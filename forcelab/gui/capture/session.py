"""What the Capture workspace does, without how it looks: recordings and marks."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QTimer, Signal

from forcelab.capture.assemble import LiveMarks
from forcelab.errors import ForcelabError
from forcelab.gui.capture.attached import Attached
from forcelab.gui.capture.connection import Left, discarding_kept, recovering
from forcelab.gui.capture.last import LastKept
from forcelab.gui.capture.phase import WORKING, Phase
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.numerals import thousands
from forcelab.gui.shortcuts import keys
from forcelab.vocabulary import Vocabulary

if TYPE_CHECKING:
    from forcelab.capture.save import Recovered, SavedRecording

__all__ = ["Session"]


class Session(Attached):
    """What is recorded from the devices that are connected.

    Parameters
    ----------
    document : Document
    jobs : Jobs
    parent : QObject, optional

    Attributes
    ----------
    marks : LiveMarks
        Of the recording that runs or ran last.
    task, name : str
        Of the next recording; without a name it gets the task and the next number.
    countdown : int
        Seconds before a recording.
    left : int
        Seconds that are left of a countdown.
    left_behind : int
        Unfinished recordings of the project.
    last : LastKept
        The recording that was kept last, as long as it can be discarded.
    """

    kept = Signal()

    def __init__(self, document: Document, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(document, jobs, parent)
        self.marks = LiveMarks()
        self.vocabulary = Vocabulary()
        self.task, self.name = "", ""
        self.countdown, self.left = 0, 0
        self.left_behind = 0
        self.begun, self._recorded = 0.0, ""
        self.last = LastKept(self)
        self.last.changed.connect(self.changed)
        self._second = QTimer(self)
        self._second.setInterval(1000)
        self._second.timeout.connect(self._count)

    @property
    def recording(self) -> bool:
        """Whether something is being recorded."""
        return self.phase is Phase.RECORDING

    @property
    def recorded(self) -> str:
        """What the recording that runs is called; empty while none runs."""
        return self._recorded if self.phase in (Phase.RECORDING, Phase.STUCK) else ""

    @property
    def obstacle(self) -> str:
        """Why no recording can begin with the devices as they are; empty where one can."""
        if self.phase is not Phase.READY or self.state is None:
            return ""
        return self.state.obstacle

    def set_task(self, task: str) -> None:
        """The next recordings are of a task; its actions can be marked."""
        self.task = task.strip()
        project = self.document.project
        self.vocabulary = Vocabulary() if project is None else project.vocabulary(self.task)
        self.changed.emit()

    @property
    def seen_vocabulary(self) -> Vocabulary:
        """The task's actions, and those that the recogniser knows besides."""
        loaded = self.recognising.loaded
        if loaded is None:
            return self.vocabulary
        return self.vocabulary.with_actions(*loaded.recogniser.actions)

    def next_name(self) -> str:
        """What the next recording will be called; empty while there is no task."""
        from forcelab.capture.save import next_name

        project = self.document.project
        if self.name or project is None or not self.task:
            return self.name
        return next_name(project, self.task)

    def disconnect_all(self) -> None:
        """Let go of the devices; a recording that runs is kept, a countdown ends."""
        self._second.stop()
        super().disconnect_all()

    def record_or_stop(self) -> None:
        """Record, after the countdown; or stop and keep what was recorded."""
        if self.phase is Phase.READY:
            if not (self.name or self.task):
                self.say("A recording needs a task; write one.", True)
                return
            if self.obstacle:
                self.say(self.obstacle, True)
                return
            self.left = self.countdown
            if self.left:
                self._to(Phase.COUNTING)
                self._second.start()
            else:
                self._start()
        elif self.phase is Phase.COUNTING:
            self._second.stop()
            self._to(Phase.READY)
        elif self.phase in (Phase.RECORDING, Phase.STUCK):
            self.marks.end(time.monotonic())
            self._work(Phase.KEEPING, self._connection.stopping(), self._kept, self._not_ended)
        elif self.phase is Phase.APART:
            self.say("Connect the devices before recording.", True)

    def discard(self) -> None:
        """End what is recorded and keep nothing of it."""
        if self.phase is Phase.COUNTING:
            self.record_or_stop()
        elif self.phase in (Phase.RECORDING, Phase.STUCK):
            work = self._connection.discarding()
            self._work(Phase.DISCARDING, work, self._discarded, self._not_ended)
        elif self.phase not in WORKING:
            self._discard_last()

    def _discard_last(self) -> None:
        """Discard what was kept last, once it was asked for twice."""
        kept, path, after = self.last.kept, self.last.path, self.phase
        if kept is None or path is None:
            self.say("Nothing is being recorded, and nothing was recorded just now.")
        elif not self.last.asked_twice():
            self.say(
                f"'{kept.added.name}' ({kept.seconds:.1f} s) is discarded for good if you "
                "ask once more."
            )
        else:
            self._work(
                Phase.DISCARDING,
                discarding_kept(path, kept),
                self._discarded_last,
                lambda: after,
                after,
            )

    def mark(self, action: str, down: bool, at: float) -> bool:
        """An action's key went down or up; gives whether that counts."""
        if not self.recording or self._recorder is None:
            return False
        self._recorder.mark(action, down, at)
        self.marks.press(action, down, at)
        return True

    def forget_mark(self) -> str | None:
        """Forget the mark that grows, as if its key had never gone down; gives its action."""
        grown = self.marks.growing() if self.recording else None
        if grown is None:
            return None
        action, since = grown
        self.mark(action, False, since)
        self.say(f"The mark '{action}' is forgotten.")
        return action

    def look_for_unfinished(self) -> None:
        """Look for recordings that a crash ended."""
        from forcelab.capture.save import unfinished

        project = self.document.project
        self.left_behind = 0 if project is None else len(unfinished(project.path))
        self.changed.emit()

    def recover(self) -> None:
        """Make demonstrations of the unfinished recordings."""
        project = self.document.project
        if project is not None and self.phase in (Phase.APART, Phase.READY):
            after = self.phase
            self._work(
                Phase.RECOVERING, recovering(project.path), self._recovered, lambda: after, after
            )

    def let_go(self) -> str:
        """Let go of everything: the window closes. What is being recorded is kept, or why not."""
        self._second.stop()
        return super().let_go()

    # When jobs are done

    def _started(self, name: str) -> None:
        self.begun, self._recorded = time.monotonic(), name
        self.last.forget()
        self.marks = LiveMarks()
        self._to(Phase.RECORDING)
        self.say(f"Recording '{name}'.")
        self._check_project()

    def _kept(self, kept: SavedRecording) -> None:
        self.name = ""
        self.last.take(kept, self._path)
        self._to(Phase.READY)
        for remark in kept.remarks:
            self.say(remark)
        self.say(_kept_text(kept))
        self._reread()

    def _discarded(self, _: None) -> None:
        self.marks = LiveMarks()
        self._to(Phase.READY)
        self.say("Discarded; nothing of it is kept.")
        self._check_project()

    def _discarded_last(self, name: str) -> None:
        self.last.forget()
        self.say(f"'{name}' is discarded; nothing of it is kept.")
        self._reread()

    def _left(self, left: Left) -> None:
        super()._left(left)
        kept, trouble = left
        if trouble:
            self.say(trouble, True)
            self.look_for_unfinished()
        elif kept is not None:
            self.last.take(kept, self._path)
            for remark in kept.remarks:
                self.say(remark)
            self.say(_kept_text(kept))
        self._reread()

    def _recovered(self, found: tuple[Recovered, ...]) -> None:
        for one in found:
            if one.kept is None:
                self.say(one.trouble, not one.removed)
            else:
                self.say(_kept_text(one.kept))
        self._reread()
        self.look_for_unfinished()

    def _reread(self) -> None:
        """Show what is new in the project."""
        self.document.reread()
        self.kept.emit()
        self._check_project()

    # Inside

    def _start(self) -> None:
        """Record from now on."""
        work = self._connection.starting(self.task, self.name, self.document.author)
        self._work(Phase.STARTING, work, self._started, lambda: Phase.READY)

    def _not_ended(self) -> Phase:
        """What follows where ending a recording has failed."""
        return Phase.STUCK if self._connection.holding else Phase.READY

    def _told(self, error: ForcelabError) -> str:
        """What went wrong, and of a recording that could not be kept what is to be done now."""
        said = super()._told(error)
        if self.phase is not Phase.STUCK:
            return said
        return "{trouble} '{name}' is not lost: mend that and press {key} once more.".format(
            trouble=said, name=self._recorded, key=keys().shown("record")
        )

    def _count(self) -> None:
        """A second of the countdown has passed."""
        self.left -= 1
        if self.left > 0:
            self.changed.emit()
            return
        self._second.stop()
        self._start()

    def _check_project(self) -> None:
        """What is recorded goes into the project in which it began: leave that with it."""
        project = self.document.project
        if project is None or project.path != self.last.path:
            self.last.forget()
        super()._check_project()


def _kept_text(kept: SavedRecording) -> str:
    """What became of a recording, in a sentence."""
    return f"'{kept.added.name}' is kept: {kept.seconds:.1f} s, {thousands(kept.samples)} samples."
