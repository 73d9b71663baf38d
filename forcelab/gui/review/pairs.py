"""Timeline pairs: what the human labelled above what is predicted, for all demonstrations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from PySide6.QtGui import QResizeEvent, QShowEvent
from PySide6.QtWidgets import QLabel, QWidget

from forcelab.gui.arranging import PageOrNote, column
from forcelab.gui.document import Document
from forcelab.gui.figures.legend import looks_in_order
from forcelab.gui.figures.timelines import TimelinePairs
from forcelab.gui.figures.tracks import Look
from forcelab.gui.jobs import Jobs
from forcelab.gui.review.colouring import painted_by
from forcelab.gui.review.pairs_area import PairsArea
from forcelab.gui.review.pairs_hits import Hit, place_of
from forcelab.gui.review.pairs_reading import CurrentTracks, other_coders
from forcelab.gui.review.pairs_rows import Entry, arranged, entries_of, entry_of
from forcelab.gui.review.pairs_tools import AxisStrip, LegendRoom, LegendStrip, PairsTools
from forcelab.gui.review.pairs_words import Looks, actions_of, missing
from forcelab.gui.review.seen import blind_to
from forcelab.gui.saving import ask_picture, save_picture
from forcelab.gui.shortcuts import keys
from forcelab.review.run_result import Outcome, vocabulary_of
from forcelab.vocabulary import Vocabulary

__all__ = ["PairsView"]

#: What an exported file is called unless somebody says otherwise.
SUGGESTED = "pairs.svg"


class PairsView(QWidget):
    """The timeline pairs of the outcome that is reviewed.

    Parameters
    ----------
    document : Document
    jobs : Jobs
        Reads the tracks of all demonstrations.
    """

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document = document
        self._jobs = jobs
        self._stale = True
        self._entries: tuple[Entry, ...] = ()
        self._current = CurrentTracks(document, jobs, self)
        self._hidden: frozenset[str] = frozenset()
        self._vocabulary = Vocabulary()
        self._looks: Mapping[str, Look] = {}
        # The actions of an outcome: to list them takes a while, and edits add but few.
        self._listed: tuple[Outcome | None, tuple[str, ...]] = (None, ())
        self.setAccessibleName("Timeline pairs")
        self.tools = PairsTools()
        self.legend = LegendStrip()
        self.area = PairsArea(document)
        self.strip = AxisStrip()
        self.note = QLabel()
        self.note.setWordWrap(True)
        self.note.setContentsMargins(12, 2, 12, 2)
        self._lay_out()
        self._connect()

    # Verbs

    def figure(self) -> TimelinePairs | None:
        """What is shown, as a figure: the same pairs in the same order; None where none is."""
        outcome = self.document.outcome
        if outcome is None or not self.area.entries:
            return None
        return TimelinePairs(
            outcome.title,
            tuple(replace(entry.pair, note=_note(entry)) for entry in self.area.entries),
            self._vocabulary,
            tuple(self._looks),
            note_key="At the right: accuracy after the filters.",
            stretched=self.tools.stretched.isChecked(),
        )

    def export(self) -> None:
        """Ask where to save the pairs, and save them in the background."""
        chosen = ask_picture(self, "Export timeline pairs", SUGGESTED)
        if chosen is not None:
            self.export_to(chosen)

    def export_to(self, path: Path) -> None:
        """Save the pairs in the background, and say when that is done."""
        figure = self.figure()
        if figure is None:
            self.document.say("No timeline pair is shown that could be saved.", True)
        else:
            save_picture(figure, path, self.document, self._jobs)

    # Inside

    def _lay_out(self) -> None:
        """Tools and legend above, the rows, the time axis below."""
        rows = QWidget()
        column(rows, LegendRoom(self.legend), self.area, self.strip, growing=self.area)
        self._pages = PageOrNote(rows)
        column(self, self.tools, self.note, self._pages, growing=self._pages)

    def _connect(self) -> None:
        """Listen to the document, and to what is pressed."""
        document = self.document
        document.outcome_changed.connect(self._start_anew)
        document.training_changed.connect(self._say_what_is_missing)
        document.tracks_changed.connect(self._read_open)
        document.vocabulary_changed.connect(self._recolour)
        document.listing_changed.connect(self._check_blind)
        document.author_changed.connect(self._check_blind)
        keys().changed.connect(self._say_what_is_missing)
        self._current.changed.connect(self._build)
        self.tools.changed.connect(self._choose)
        self.tools.ordered.connect(lambda: self.area.verticalScrollBar().setValue(0))
        self.tools.exporting.connect(self.export)
        self.area.chosen.connect(self._go_to)

    def showEvent(self, event: QShowEvent) -> None:
        """Show what has changed while nobody saw it."""
        super().showEvent(event)
        if self._stale or blind_to(self.document) != self._hidden:
            self._build()
        else:
            self._recolour()
        self._read_all()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """The axis goes along with the rows."""
        super().resizeEvent(event)
        self._show_axis()

    def _start_anew(self) -> None:
        """Another outcome is reviewed."""
        self._current.forget()
        self._build()
        self._read_all()

    def _choose(self) -> None:
        """Other rows, or another order of them."""
        self._build()
        if self._current.lacks(self.tools.wanted.coders):
            self._read_all()

    def _build(self) -> None:
        """Make the rows of the outcome and of what is chosen."""
        self._stale = not self.isVisible()
        outcome, project = self.document.outcome, self.document.project
        if self._stale:
            return
        self._hidden = blind_to(self.document)
        if outcome is None or project is None:
            self._entries = ()
        else:
            coders = other_coders(self.document, self._hidden)
            if coders != self.tools.coders:
                self.tools.offer(coders)
            self._entries = entries_of(
                outcome, self._current.tracks, self.tools.wanted, self._hidden
            )
            self._take_vocabulary()
        self._show()

    def _show(self) -> None:
        """Show the rows in order."""
        actions = sorted(self._actions(), key=self._key_of)
        self._looks = Looks(looks_in_order(actions, self._vocabulary))
        looks, tools = self._looks, self.tools
        rows = arranged(self._entries, tools.chosen_order, tools.search.text())
        self.legend.show_looks(looks)
        self._say_what_is_missing(len(rows))
        self.area.show_entries(rows, looks, tools.stretched.isChecked())
        self._show_axis()

    def _show_axis(self) -> None:
        """Show the common axis, as wide as the rows."""
        common = bool(self.area.entries) and not self.area.stretched
        self.strip.show_axis(self.area.arrangement.axis() if common else None)

    def _actions(self) -> tuple[str, ...]:
        """All actions in the order of occurrence: those of the outcome first.

        What a recogniser sees on the way to its prediction is among those, and need not be looked
        through.
        """
        outcome = self.document.outcome
        if outcome is not self._listed[0]:
            self._listed = outcome, () if outcome is None else actions_of(outcome)
        tracks = [
            track
            for entry in self._entries
            for track in entry.whole_tracks
            if track is not entry.reviewed.human and track is not entry.reviewed.predicted
        ]
        return tuple(dict.fromkeys((*self._listed[1], *(s.action for t in tracks for s in t))))

    def _key_of(self, action: str) -> tuple[bool, str]:
        """What actions of the legend are sorted by: their keys; those without stay as they are."""
        key = self._vocabulary[action].key
        return not key, key or ""

    def _take_vocabulary(self) -> bool:
        """Take the looks of the outcome's actions and their keys; gives whether they are others."""
        outcome, project = self.document.outcome, self.document.project
        if outcome is None or project is None:
            return False
        before = self._vocabulary
        looks = vocabulary_of(project, outcome).with_actions(*self._actions())
        document, shown = self.document, self.document.demonstration
        task = "" if shown is None else shown.task
        self._vocabulary = painted_by(looks, document.vocabulary, task=task, apart=outcome.apart)
        return self._vocabulary != before

    def _say_what_is_missing(self, shown: int | None = None) -> None:
        """Say why there is nothing to see, or not all."""
        outcome = self.document.outcome
        shown = len(self.area.entries) if shown is None else shown
        words = missing(
            outcome,
            training=self.document.training,
            entries=bool(self._entries),
            hidden=bool(self._hidden),
            shown=bool(shown),
        )
        self._pages.say(words)
        self.tools.setHidden(not self._entries)
        count = 0
        if outcome is not None and self._entries:
            both = (*outcome.tested, *outcome.proposals)
            count = sum(reviewed.id in self._hidden for reviewed in both)
        self.note.setText(f"Demonstrations left out while you code them blind: {count}.")
        self.note.setHidden(not count)

    # Going there

    def _go_to(self, entry: Entry, found: Hit) -> None:
        """Open what was chosen."""
        document = self.document
        if found.what is not None:
            document.examine(place_of(entry, found.what))
        elif document.open_demonstration(entry.id) and found.time is not None:
            document.seek(found.time)

    # What the project holds now

    def _read_all(self) -> None:
        """Read the tracks as they are now, in the background."""
        if self.isVisible():
            self._current.read_all(self.tools.wanted.coders, self._hidden)

    def _read_open(self) -> None:
        """Read the open demonstration's tracks, and nothing else."""
        outcome, id_ = self.document.outcome, self.document.id
        old = next((entry for entry in self._entries if entry.id == id_), None)
        if outcome is None or old is None or not self.isVisible():
            return
        wanted = self.tools.wanted
        if old.human is None or not self._current.read_open(wanted.coders):
            return
        found = self._current.tracks[id_]
        new = entry_of(outcome, old.reviewed, found, wanted, old.evaluated)
        self._entries = tuple(new if entry is old else entry for entry in self._entries)
        known = set(self._vocabulary.names)
        if any(s.action not in known for track in new.whole_tracks for s in track):
            self._take_vocabulary()
            self._show()
        self.area.replace_entry(new)

    def _recolour(self) -> None:
        """The actions may have other colours."""
        if self.isVisible() and self._entries and self._take_vocabulary():
            self._show()

    def _check_blind(self) -> None:
        """Somebody may code another demonstration blind, or not any more."""
        if (
            self.isVisible()
            and self.document.outcome is not None
            and blind_to(self.document) != self._hidden
        ):
            self._build()
            self._read_all()


def _note(entry: Entry) -> str:
    """What is said beside a pair in the figure."""
    if entry.human is None:
        return "proposed"
    return "" if entry.share is None else f"{100 * entry.share:.1f} %"
