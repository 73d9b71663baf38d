"""The one state object of the window: what is open, where the cursor is, what is being painted.

Views listen to its signals and never to each other.
"""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject, Signal

from forcelab.clock import ClockMap
from forcelab.gui.editing import Editing, Stroke
from forcelab.gui.looking import SHORTEST_SPAN, Snap
from forcelab.labels import Segments, is_model
from forcelab.project import DemonstrationInfo, Project
from forcelab.project.labelling import Labelling

__all__ = ["SHORTEST_SPAN", "Document", "Snap", "Stroke"]


class Document(Editing):
    """What is open, and the verbs that open something else.

    Parameters
    ----------
    author : str
        The coder whose tracks are painted.
    parent : QObject, optional

    Attributes
    ----------
    infos : tuple of DemonstrationInfo
        The project's demonstrations, by task and name.
    others : dict of str to tuple of Segment
        The other tracks that are shown, by author; empty while coding blind.
    hidden_authors : frozenset of str
        Whose tracks are left away.
    """

    project_changed = Signal()
    listing_changed = Signal()
    demonstration_changed = Signal()
    author_changed = Signal()

    def __init__(self, author: str, parent: QObject | None = None) -> None:
        super().__init__(author, parent)
        self.infos: tuple[DemonstrationInfo, ...] = ()
        self.others: dict[str, Segments] = {}
        self.hidden_authors: frozenset[str] = frozenset()

    def open_project(self, path: Path) -> None:
        """Open a project in place of the one that is open.

        Raises
        ------
        ForcelabError
            If it cannot be opened; the one that is open stays.
        """
        project = Project.open(path)
        self.close()
        self.project = project
        self.infos = project.demonstrations()
        self.project_changed.emit()
        self.listing_changed.emit()

    def close(self) -> None:
        """Close the project; nothing is lost, as everything is stored already."""
        if self.project is None:
            return
        self.set_playing(False)
        self.project.close()
        self.project = None
        self.infos = ()
        self._look_anew(None)
        self._take_up("", None)
        self.others = {}
        self.demonstration_changed.emit()
        self.project_changed.emit()
        self.listing_changed.emit()

    def open_demonstration(self, id_: str) -> bool:
        """Open a demonstration of the project; gives whether that could be done."""
        if self.project is None:
            return False
        with self._telling() as told:
            demonstration = self.project.load(id_)
            labelling = Labelling(self.project, demonstration.id, self.author)
        if told:
            return False
        if demonstration.id == self.id:
            return True
        self.set_playing(False)
        self._look_anew(demonstration)
        self._take_up(demonstration.id, labelling)
        self._read_vocabulary()
        self._read_others()
        self.demonstration_changed.emit()
        self.vocabulary_changed.emit()
        self.tracks_changed.emit()
        self.span_changed.emit(self.start, self.end)
        self.cursor_moved.emit(self.cursor)
        return True

    def set_author(self, name: str) -> None:
        """Label as another coder from now on."""
        name = name.strip()
        if not name or name == self.author:
            return
        if is_model(name):
            self.say(self.tr("'{0}' is a model's name; use a person's.").format(name), True)
            return
        self.author = name
        self.cancel_stroke()
        self.select(None)
        if self.project is not None and self.id:
            with self._telling():
                self._labelling = Labelling(self.project, self.id, name)
                self._read_others()
        self.author_changed.emit()
        self.listing_changed.emit()
        self.tracks_changed.emit()

    def refresh(self) -> None:
        """Take over what other windows or processes have changed."""
        if self.project is None:
            return
        with self._telling():
            if not self.project.changed_elsewhere():
                return
            self.refresh_listing()
            if self._labelling is None:
                return
            if self._labelling.refresh():
                self.select(None)
            self._read_others()
            self._read_vocabulary()
            self.vocabulary_changed.emit()
            self.tracks_changed.emit()

    def refresh_listing(self) -> None:
        """Read the list of demonstrations again."""
        if self.project is not None:
            with self._telling():
                self.infos = self.project.demonstrations()
            self.listing_changed.emit()

    def refresh_info(self) -> None:
        """Read again what the list tells of the open demonstration, and of no other one."""
        if self.project is not None and self.id:
            with self._telling():
                new = self.project.info(self.id)
                self.infos = tuple(new if info.id == new.id else info for info in self.infos)
            self.listing_changed.emit()

    def reread(self) -> None:
        """Take over what was changed through the project: names, videos, assignments."""
        if self.project is None or self.demonstration is None:
            return
        old = self.demonstration
        with self._telling():
            self.demonstration = self.project.load(self.id)
            self._read_others()
        self.refresh_listing()
        if (old.name, old.video) != (self.demonstration.name, self.demonstration.video):
            self.demonstration_changed.emit()
        self.tracks_changed.emit()

    def set_video_clock(self, clock: ClockMap) -> bool:
        """Map the video's clock onto the force clock anew."""
        if self.project is None or self.demonstration is None:
            return False
        with self._telling() as told:
            self.project.set_video_clock(self.id, clock)
            self.demonstration = self.project.load(self.id)
        if not told:
            self.demonstration_changed.emit()
        return not told

    def set_done(self, done: bool = True) -> bool:
        """Say that the coder's assigned demonstration is done; blind coding ends then."""
        if self.project is None or not self.id:
            return False
        with self._telling() as told:
            self.project.set_done(self.id, self.author, done)
            self._read_others()
        self.refresh_listing()
        self.tracks_changed.emit()
        return not told

    def set_hidden_authors(self, authors: frozenset[str]) -> None:
        """Leave these tracks away from the screen."""
        if authors != self.hidden_authors:
            self.hidden_authors = authors
            self._read_others()
            self.tracks_changed.emit()

    # Inside

    def _read_vocabulary(self) -> None:
        """The actions of the task, those of every shown segment among them."""
        assert self.project is not None
        assert self.demonstration is not None
        stored = self.project.vocabulary(self.demonstration.task)
        tracks = self.project.tracks(self.id)
        self.vocabulary = stored.with_actions(*(a for track in tracks for a in track.actions))

    def _read_others(self) -> None:
        """The tracks of the other authors, unless they are to be hidden."""
        self.others = {}
        if self.project is None or not self.id or self.coding_blind:
            return
        for track in self.project.tracks(self.id):
            if track.author != self.author and track.author not in self.hidden_authors:
                self.others[track.author] = track.segments
