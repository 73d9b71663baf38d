"""The one state object of the window: what is open, where the cursor is, what is being painted.

Views listen to its signals and never to each other.
"""

from __future__ import annotations

from collections.abc import Collection
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from forcelab.clock import ClockMap
from forcelab.demonstration import Demonstration
from forcelab.errors import ForcelabError, InputError
from forcelab.gui.looking import Snap
from forcelab.gui.reviewing import Reviewing
from forcelab.gui.seen_labels import VisibleLabels, visible_to
from forcelab.labels import Segments, is_model
from forcelab.project import DemonstrationInfo, Project, UndoResult
from forcelab.project.track_editor import Labelling
from forcelab.review.differences import Interval
from forcelab.text import tidy_name
from forcelab.vocabulary import Vocabulary

if TYPE_CHECKING:
    from forcelab.review.run_result import Outcome

__all__ = ["Document", "Snap"]

#: What is shown on either side of a place: a share of its length, and at least so many seconds.
AROUND, LEAST_AROUND = 1.0, 1.5


class Document(Reviewing):
    """What is open, and the verbs that open something else.

    Parameters
    ----------
    author : str
        The coder whose tracks are painted.

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
        self._behind = False  # what was changed elsewhere could not be read yet

    def open_project(self, path: Path) -> None:
        """Open a project in place of the one that is open.

        Raises
        ------
        ForcelabError
            If it cannot be opened; the one that is open stays.
        """
        project = Project.open(path)
        try:
            infos = project.demonstrations.infos()
            project.sync_behind()
        except ForcelabError:
            project.close()
            raise
        self.close()
        self.project, self.infos, self._behind = project, infos, False
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
        self.outcome = self.examined = None
        self._renamings.clear()
        self._put_down()
        self.project_changed.emit()
        self.listing_changed.emit()
        self.outcome_changed.emit()
        self.examined_changed.emit()

    def _put_down(self) -> None:
        """No demonstration is open any more."""
        self.set_playing(False)
        self._look_anew(None)
        self._take_up("", None)
        self.others = {}
        self._list_actions(Vocabulary())
        self.demonstration_changed.emit()
        self.vocabulary_changed.emit()

    def open_demonstration(self, id_: str) -> bool:
        """Open a demonstration of the project; gives whether that could be done."""
        if self.project is None:
            return False
        with self._reporting_errors() as errors:
            demonstration = self.project.demonstrations.load(id_)
            if demonstration.id == self.id:
                return True
            labelling = Labelling(self.project, demonstration.id, self.author)
            seen = self._seen_by(self.author, demonstration)
            if self.id:  # what was painted there a moment ago is told only now
                with suppress(InputError):  # removed elsewhere meanwhile
                    self._take_in_info(self.project)
        if errors:
            return False
        self.set_playing(False)
        self._look_anew(demonstration)
        self._take_up(demonstration.id, labelling)
        self._take_in(seen)
        self.demonstration_changed.emit()
        self.vocabulary_changed.emit()
        self.tracks_changed.emit()
        self.span_changed.emit(self.start, self.end)
        self.cursor_moved.emit(self.cursor)
        return True

    def set_author(self, name: str) -> None:
        """Label as another coder from now on."""
        name = tidy_name(name)
        if not name or name == self.author:
            return
        if is_model(name):
            self.say(f"'{name}' is a model's name; use a person's.", True)
            return
        if self.project is not None and self.demonstration is not None:
            with self._reporting_errors() as errors:
                labelling = Labelling(self.project, self.id, name)
                seen = self._seen_by(name, self.demonstration)
            if errors:  # whose labels are not there must not seem to be the one who paints
                return
            self._take_up(self.id, labelling)
            self._take_in(seen)
        self.author = name
        self._look_away()
        self.selection_changed.emit()
        self.stroke_changed.emit()
        self.author_changed.emit()
        self.vocabulary_changed.emit()
        self.listing_changed.emit()
        self.tracks_changed.emit()

    def refresh(self) -> None:
        """Take over what other windows or processes have changed; tried again where that fails."""
        if self.project is None:
            return
        with self._reporting_errors():
            self._behind = self.project.changed_elsewhere() or self._behind
        if self._behind:
            old = self.demonstration
            self._behind = not self.reread()
            if old is not None and self.demonstration is None:
                self.say(f"'{old.name}' was removed elsewhere.")

    def refresh_listing(self) -> bool:
        """Read the list of demonstrations again; gives whether that could be done."""
        if self.project is None:
            return False
        with self._reporting_errors() as errors:
            self.infos = self.project.demonstrations.infos()
        self.listing_changed.emit()
        return not errors

    def refresh_info(self) -> None:
        """Read again what the list tells of the open demonstration, and of no other one."""
        if self.project is not None and self.id:
            with self._reporting_errors():
                self._take_in_info(self.project)
            self.listing_changed.emit()

    def _take_in_info(self, project: Project) -> None:
        """What the project tells of the open demonstration."""
        new = project.demonstrations.info(self.id)
        self.infos = tuple(new if info.id == new.id else info for info in self.infos)

    def reread(self) -> bool:
        """Take over what is stored by now: names, videos, assignments, labels, actions.

        Gives whether all of it could be read.
        """
        listed = self.refresh_listing()
        if self.project is None or self.demonstration is None or self._labelling is None:
            return listed
        if all(info.id != self.id for info in self.infos):  # a recording that was discarded
            self._put_down()
            return listed
        old = self.demonstration
        with self._reporting_errors() as errors:
            new = self.project.demonstrations.load(self.id)
            seen = self._seen_by(self.author, new)
            if self._labelling.refresh():
                self.select(None)
        if errors:
            return False
        self._take_in(seen)
        self._look_away()
        if (old.name, old.task, old.video) != (new.name, new.task, new.video):
            self.demonstration = new
            self.demonstration_changed.emit()
        self.vocabulary_changed.emit()
        self.tracks_changed.emit()
        return listed

    def rename_action(
        self, old: str, new: str, tasks: Collection[str] | None = None, *, merge: bool = False
    ) -> bool:
        """Rename an action in all of the coder's tracks, or merge it into another one."""
        if self.project is None:
            return False
        with self._reporting_errors() as errors:
            before = self.project.actions.vocabularies()
            done = self.project.actions.rename(self.author, old, new, tasks, merge=merge)
            after = self.project.actions.vocabularies()
        if errors:
            return False
        for task in done.tasks:
            one, other = before.get(task, Vocabulary()), after[task]
            if {*one.names} ^ {*other.names} <= {old, new}:  # nobody else changed them just then
                self._renamings += [(task, one, other), (task, other, one)]
        chosen, brush, stroke = self.selected, self.action, self.stroke
        self.reread()
        self.select(chosen)  # as many segments as before
        if brush == old:
            self.set_action(new)
        if stroke is not None and stroke.action == old:
            self.begin_stroke(new, stroke.start)
        self.say(done.sentences(done=True))
        return True

    def set_video_clock(self, clock: ClockMap) -> bool:
        """Map the video's clock onto the force clock anew."""
        if self.project is None or self.demonstration is None:
            return False
        with self._reporting_errors() as errors:
            self.project.media.set_video_clock(self.id, clock)
            self.demonstration = self.project.demonstrations.load(self.id)
        if not errors:
            self.demonstration_changed.emit()
        return not errors

    def set_done(self) -> bool:
        """Mark the open demonstration as done by the coder; blind coding ends then."""
        if self.project is None or not self.id:
            return False
        blind = self.coding_blind
        with self._reporting_errors() as errors:
            self.project.coding.set_done(self.id, self.author)
        self.reread()
        if not errors:
            shown = "Marked as done; the labels of others are shown."
            self.say(shown if blind else "Marked as done.")
        return not errors

    def other_authors(self) -> tuple[str, ...]:
        """Whose tracks there are besides the coder's; nobody's while coding blind."""
        if self.project is None or not self.id or self.coding_blind:
            return ()
        authors = [track.author for track in self.project.tracks.of(self.id)]
        if self.outcome is not None and self.reviewed is not None:
            authors.append(self.outcome.proposer)
        return tuple(author for author in authors if author != self.author)

    def set_outcome(self, outcome: Outcome | None) -> None:
        """Review another outcome; its prediction stands below the open demonstration's tracks."""
        self.outcome = outcome
        self.examined = None
        if self.demonstration is not None:
            self._look_again(self.demonstration)
            self.vocabulary_changed.emit()
        self.outcome_changed.emit()
        self.examined_changed.emit()

    def examine(self, place: Interval) -> bool:
        """Go to a place: open its demonstration, show it with its surroundings, mark it."""
        if place.demonstration != self.id and not self.open_demonstration(place.demonstration):
            return False
        margin = max(AROUND * place.duration, LEAST_AROUND)
        self.set_span(place.start - margin, place.end + margin)
        self.seek(place.start)
        self.set_range(place.start, place.end)
        self.examined = place
        self.examined_changed.emit()
        return True

    def set_hidden_authors(self, authors: frozenset[str]) -> None:
        """Leave these tracks away from the screen."""
        if authors != self.hidden_authors:
            self.hidden_authors = authors
            if self.demonstration is not None:
                self._look_again(self.demonstration)

    # Inside

    def _bring_back(self, reverted: UndoResult) -> None:
        """Follow what an undo or a redo changed, in other demonstrations, too."""
        super()._bring_back(reverted)
        if len(reverted.edits) > 1:
            self.refresh_listing()

    def _look_away(self) -> None:
        """Examine nothing while coding blind: a place tells where others begin and end."""
        if self.examined is not None and self.coding_blind:
            self.examined = None
            self.clear_range()
            self.examined_changed.emit()

    def _look_again(self, demonstration: Demonstration) -> None:
        """Show what may be seen by now."""
        with self._reporting_errors():
            self._take_in(self._seen_by(self.author, demonstration))
        self.tracks_changed.emit()

    def _seen_by(self, author: str, demonstration: Demonstration) -> VisibleLabels:
        """What a coder may see of a demonstration.

        Raises
        ------
        ForcelabError
            If it cannot be read.
        """
        assert self.project is not None
        return visible_to(author, demonstration, self.project, self.outcome)

    def _take_in(self, seen: VisibleLabels) -> None:
        """Show what may be seen; nobody is told yet."""
        self.others = {
            author: segments
            for author, segments in seen.others.items()
            if author not in self.hidden_authors
        }
        self._list_actions(seen.listed, seen.painted, seen.like)
