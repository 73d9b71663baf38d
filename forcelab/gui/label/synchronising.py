"""The dialog that puts the video's clock right: by marked taps, or by a proposal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import QTableWidgetItem, QWidget

from forcelab.clock import ClockMap, fit_clock
from forcelab.errors import InputError
from forcelab.gui.document import Document
from forcelab.gui.figures.text import signed
from forcelab.gui.jobs import Jobs
from forcelab.gui.label.synchronising_form import SynchroniseForm
from forcelab.gui.theme import colours
from forcelab.jobs import Progress
from forcelab.signals.sync import Proposal, proposing_for

__all__ = ["SynchroniseDialog", "TapRow"]

#: A contact event at most so far from the cursor is what was meant, s.
SNAP = 0.08
#: Rates further from 1 are mistakes.
RARE = 2e-3
KEY = "synchronise"


@dataclass(frozen=True, slots=True)
class TapRow:
    """An event as it is marked so far: its times (s) on the video's clock and on the force's."""

    video: float | None = None
    force: float | None = None


class SynchroniseDialog(SynchroniseForm):
    """Offset and rate of the video's clock, from taps marked by hand or from a proposal.

    Nothing is stored before Accept is pressed.

    Parameters
    ----------
    document : Document
        With a demonstration that has a video.
    jobs : Jobs
        Runs the search for a proposal.

    Attributes
    ----------
    rows : tuple of TapRow
        What was marked.
    candidate : ClockMap or None
        What Accept would store.
    proposal : Proposal or None
        What was found by itself.
    """

    def __init__(self, document: Document, jobs: Jobs, parent: QWidget | None = None) -> None:
        super().__init__(document, parent)
        self.jobs = jobs
        demonstration = document.demonstration
        assert demonstration is not None
        assert demonstration.video is not None
        self._id = document.id
        self.stored = demonstration.video.clock
        self.rows: tuple[TapRow, ...] = ()
        self.candidate: ClockMap | None = None
        self.residual: float | None = None
        self.proposal: Proposal | None = None
        self.setWindowTitle(f"Synchronise video and force – {demonstration.name}")
        for button, verb in (
            (self.frame_button, self.mark_frame),
            (self.force_button, self.mark_force),
            (self.remove_button, self.remove),
            (self.propose_button, self.propose),
            (self.reset_button, self.reset),
        ):
            button.clicked.connect(verb)
        self.fit_rate.toggled.connect(lambda: self.set_rows(self.rows))
        self.table.currentCellChanged.connect(self._look_at)
        self.preview.show_time(float(self.stored.to_device(document.cursor)))
        self.preview.open(demonstration.video.path, demonstration.name)
        document.cursor_moved.connect(self._follow)
        document.demonstration_changed.connect(self._leave_if_other)
        self._follow()
        self._show_hint()
        self._refresh()

    # Verbs

    def mark_frame(self) -> None:
        """Take the time of the chosen frame for the event that lacks one, or for a new one."""
        if self.preview.times.size:
            self._mark(video=self.preview.time)

    def mark_force(self) -> None:
        """Take the time of the cursor, or of the contact event beside it."""
        time, contacts = self.document.cursor, self.document.contacts
        if self.snap.isChecked() and contacts.size:
            nearest = float(contacts[np.argmin(np.abs(contacts - time))])
            time = nearest if abs(nearest - time) <= SNAP else time
        self._mark(force=time)

    def remove(self) -> None:
        """Forget the selected event."""
        row = self.table.currentRow()
        if 0 <= row < len(self.rows):
            self.set_rows(self.rows[:row] + self.rows[row + 1 :])

    def set_rows(self, rows: tuple[TapRow, ...]) -> None:
        """Put these events in place of those that are there, and fit the clock to them."""
        self.rows = rows
        whole = [(r.video, r.force) for r in rows if r.video is not None and r.force is not None]
        self.candidate = self.residual = None
        self.trouble.clear()
        try:
            if whole:
                self.candidate, self.residual = self._fitted(whole)
        except InputError as error:
            self.trouble.setText(str(error))
        self._refresh()

    def propose(self) -> None:
        """Look for the clock in the background."""
        demonstration = self.document.demonstration
        if demonstration is None:
            return
        self.propose_button.setEnabled(False)
        self.trouble.clear()
        search = proposing_for(demonstration)
        self.jobs.run(search, self._proposed, self._failed, self._progress, KEY)

    def reset(self) -> None:
        """Forget everything marked and proposed; the stored clock stays."""
        self.proposal = None
        self._show_hint()
        self.set_rows(())

    def accept(self) -> None:
        """Store the clock and close."""
        if self.candidate is None or self.document.set_video_clock(self.candidate):
            super().accept()

    def done(self, result: int) -> None:
        """Close, whichever way: the search ends and the file is let go."""
        self.jobs.cancel(KEY)
        self.preview.close_video()
        super().done(result)
        self.deleteLater()  # with it go its connections to the document

    def closeEvent(self, event: QCloseEvent) -> None:
        """As Close."""
        self.reject()
        super().closeEvent(event)

    # The proposal

    def _proposed(self, proposal: Proposal) -> None:
        """Show what was found; it is the candidate until something is marked."""
        self.propose_button.setEnabled(True)
        self.proposal = proposal
        self.plot.show_signals(proposal)
        self.rows = tuple(TapRow(seen, felt) for seen, felt in proposal.taps)
        self.candidate, self.residual = proposal.clock, proposal.residual
        self._refresh(proposed=True)

    def _failed(self, error: Exception) -> None:
        """Say why nothing was found."""
        self.propose_button.setEnabled(True)
        self.trouble.setText(str(error))
        self._show_hint()

    def _progress(self, progress: Progress) -> None:
        """Say how far the search is."""
        share = 100.0 * progress.done / max(progress.total, 1)
        if self.proposal is None:
            self.plot.show_signals(None, f"{progress.text}  {share:.0f} %")

    # Inside

    def _fitted(self, whole: list[tuple[float, float]]) -> tuple[ClockMap, float]:
        """The clock through events (video s, force s), and its residual (s).

        Times that are one, or a clock that would run backwards, are an InputError.
        """
        seen, felt = (np.array(times) for times in zip(*whole, strict=True))
        if len(whole) > 1 and self.fit_rate.isChecked():
            fit = fit_clock(seen.tolist(), felt.tolist())
            return fit.clock, fit.residual
        rate = self.stored.rate  # one event tells nothing about it
        clock = ClockMap(float(np.mean(felt - rate * seen)), rate)
        return clock, float(np.sqrt(np.mean((clock.to_force(seen) - felt) ** 2)))

    def _look_at(self, number: int) -> None:
        """Show the frame and the force of an event that was chosen."""
        if not 0 <= number < len(self.rows):
            return
        row = self.rows[number]
        if row.video is not None:
            self.preview.show_time(row.video)
        if row.force is not None:
            self.document.seek(row.force)

    def _mark(self, video: float | None = None, force: float | None = None) -> None:
        """Fill the first event that lacks this time, or begin another."""
        rows = list(self.rows)
        for place, row in enumerate(rows):
            if video is not None and row.video is None:
                rows[place] = TapRow(video, row.force)
                break
            if force is not None and row.force is None:
                rows[place] = TapRow(row.video, force)
                break
        else:
            rows.append(TapRow(video, force))
        self.set_rows(tuple(rows))

    def _follow(self) -> None:
        """The cursor has moved."""
        with QSignalBlocker(self.force_time):
            self.force_time.setValue(self.document.cursor)

    def _leave_if_other(self) -> None:
        """Close when another demonstration is open."""
        if self.document.id != self._id:
            self.reject()

    def _show_hint(self) -> None:
        """Tell both ways to a clock in place of the curves, while nothing is proposed."""
        hint = (
            "Propose compares the motion in the video with the force. Or by hand: find a moment "
            "that is seen and felt, such as a tap; mark its frame, move the force time to it, and "
            "mark that."
        )
        self.plot.show_signals(None, hint)

    def _refresh(self, proposed: bool = False) -> None:
        """Show what is marked, what follows from it and what would be stored."""
        clock = self.candidate or self.stored
        with QSignalBlocker(self.table):  # nobody has chosen an event
            self._fill_table(clock)
        self.remove_button.setEnabled(bool(self.rows))
        taps = tuple(row.force for row in self.rows if row.force is not None)
        self.plot.show_clock(clock, taps)
        self.stored_label.setText(_told(self.stored))
        self.new_label.setText("–" if self.candidate is None else _told(self.candidate))
        self.residual_label.setText(self._residual(proposed))
        self.confidence_label.setText(self._confidence() if proposed else "–")
        doubtful = proposed and self.proposal is not None and self.proposal.doubtful
        colour = colours().warning if doubtful else colours().text
        self.confidence_label.setStyleSheet(f"color: {colour}")
        self.accept_button.setEnabled(self.candidate is not None)

    def _fill_table(self, clock: ClockMap) -> None:
        """List what is marked, the last event chosen, and how far each is from a new clock."""
        self.table.setRowCount(len(self.rows))
        for number, row in enumerate(self.rows):
            away = ""
            if row.video is not None and row.force is not None and self.candidate is not None:
                away = signed(f"{1000 * (float(clock.to_force(row.video)) - row.force):+.1f}")
            for column, text in enumerate((_seconds(row.video), _seconds(row.force), away)):
                item = QTableWidgetItem(text)
                item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
                self.table.setItem(number, column, item)
        if self.rows:
            self.table.setCurrentCell(len(self.rows) - 1, 0)

    def _residual(self, proposed: bool) -> str:
        """How far the events lie from the new clock, and what that tells."""
        count = sum(row.video is not None and row.force is not None for row in self.rows)
        if self.candidate is None or count == 0:
            return "–"
        if count == 1 and not proposed:
            return "one tap: the rate stays"
        if abs(self.candidate.rate - 1.0) > RARE:
            return "no two clocks differ so much: check the taps, or leave the rate"
        if self.residual is None or (count == 2 and self.residual < 1e-6):
            return "two taps are met exactly; a third tells the error"
        return "{} ms, root mean square".format(f"{1000 * self.residual:.1f}")

    def _confidence(self) -> str:
        """How far the proposal may be believed."""
        assert self.proposal is not None
        value = f"{self.proposal.confidence:.2f}"
        if self.proposal.doubtful:
            return f"{value} – low: compare the frames at a tap before accepting"
        return f"{value} of 1"


def _seconds(time: float | None) -> str:
    """A time of the table; a dash where it is still to be marked."""
    return "–" if time is None else signed(f"{time:.3f}")


def _told(clock: ClockMap) -> str:
    """A clock for people."""
    return "offset {} s, rate {} ppm".format(
        signed(f"{clock.offset:+.4f}"), signed(f"{1e6 * (clock.rate - 1):+.1f}")
    )
