"""The one state object of the window: what is open, how it is looked at, edited and reviewed.

Views listen to its signals and never to each other.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Literal, NamedTuple

from PySide6.QtCore import QObject, Signal

from forcelab.clock import ClockMap
from forcelab.demonstration import Demonstration
from forcelab.errors import ForcelabError, InputError, StaleTrackError
from forcelab.gui.view_state import ViewState
from forcelab.labels import Interval, Segment, Segments, is_model
from forcelab.project import DemonstrationInfo, Edit, Origin, Project, UndoResult
from forcelab.project.track_editor import Result, TrackEditor
from forcelab.review.differences import as_coded
from forcelab.segment_edits import SLIVER, covering
from forcelab.text import tidy_name
from forcelab.vocabulary import Action, Vocabulary

if TYPE_CHECKING:
    from forcelab.recognition.results import DemonstrationResult
    from forcelab.review.run_result import RunResult

#: What is shown on either side of an interval: a share of its length, and at least so many seconds.
MARGIN, SHORTEST_MARGIN = 1.0, 1.5
#: Steps that follow each other within so many seconds are one edit.
NUDGE_PAUSE = 1.0
#: Digits of a sum of steps, in seconds, that are free of float dust.
DIGITS = 9

_start = attrgetter("start")
_end = attrgetter("end")


@dataclass(frozen=True, slots=True)
class Stroke:
    """A segment begun with a key and not ended yet; `start` in seconds."""

    action: str
    start: float

    def __str__(self) -> str:
        return f"{self.action} from {self.start:.2f} s"


@dataclass(frozen=True, slots=True)
class _NudgeRun:
    """Steps of a segment that are one edit."""

    index: int  # of the segment, before the first step
    part: Literal["start", "end", "both"]
    before: Segment  # before the first step
    time: float  # where the latest step has brought it, in seconds
    edit: Edit  # that is stored for the steps so far
    after: Segment  # after the latest step
    deadline: float  # when the run is over, by the monotonic clock


class _NoTrack(TrackEditor):
    """The editor while no demonstration is open: an empty track whose verbs do nothing."""

    def __init__(self, author: str) -> None:
        self.demonstration, self.author = "", author
        self.segments: Segments = ()
        self._perform = lambda _: None

    def refresh(self) -> bool:
        return False

    def history(self) -> tuple[Edit, ...]:
        return ()


class _VisibleLabels(NamedTuple):
    """What a coder may see of a demonstration."""

    tracks: dict[str, Segments]  # of other authors, and the prediction that is reviewed, by author
    listed: Vocabulary  # the task's actions as stored
    painted: tuple[str, ...]  # the actions that segments have
    styles: list[Action]  # how those look elsewhere that are not among the task's


class Document(QObject):
    """What is open, and the verbs that open something else.

    A verb returns whether it changed anything; :meth:`refuse` shows why it did not.

    `editor` edits the coder's track. What it stores or refuses is signalled and shown by the
    document; a new one takes its place with each demonstration and coder, so that it must not be
    kept. `selected` is the index of the coder's selected segment, `stroke` what a key has begun;
    `vocabulary` is that of the open demonstration's task, with what is painted besides.
    """

    project_changed = Signal()
    listing_changed = Signal()
    demonstration_changed = Signal()
    author_changed = Signal()
    vocabulary_changed = Signal()
    action_changed = Signal()
    tracks_changed = Signal()
    selection_changed = Signal()
    stroke_changed = Signal()
    message_shown = Signal(str, bool)
    refusal_shown = Signal(str, bool)
    store_failed = Signal(str)

    def __init__(self, author: str, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.view = ViewState(self)
        self.review = ReviewState(self)
        self.project: Project | None = None
        self.infos: tuple[DemonstrationInfo, ...] = ()  # by task and name
        self.other_tracks: dict[str, Segments] = {}  # shown ones, by author; none in blind coding
        self.hidden_authors: frozenset[str] = frozenset()  # whose tracks are hidden
        self.action: str | None = None  # the brush: what dragging on the track paints
        self.refused = False  # the store refused the latest request, which may then be repeated
        self.local_message = ""  # the latest about the demonstration that was open then
        self._behind = False  # what was changed elsewhere could not be read yet
        # A task, with its actions on either side of each renaming, both ways round.
        self._renamings: list[tuple[str, Vocabulary, Vocabulary]] = []
        self._edit_track(_NoTrack(author))
        self._list_actions(Vocabulary())
        self.view.cursor_moved.connect(self._leave_selection)
        self.view.playing_changed.connect(self._leave_selection)

    @property
    def demonstration(self) -> Demonstration | None:
        """The demonstration that is open."""
        return self.view.demonstration

    @property
    def id(self) -> str:
        """The id of the open demonstration; ``""`` without one."""
        return self.editor.demonstration

    @property
    def author(self) -> str:
        """The coder whose track is edited."""
        return self.editor.author

    @property
    def coding_blind(self) -> bool:
        """Whether the labels of others are hidden from the coder here."""
        if self.project is None or not self.id:
            return False
        return self.project.coding.is_blind(self.id, self.author)

    # Projects and demonstrations

    def open_project(self, path: Path) -> None:
        """Open a project; where that raises a ForcelabError, the one that is open stays."""
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
        self.view.set_playing(False)
        self.finish_stroke(leaving=True)
        self.project.close()
        self.project = None
        self.infos = ()
        self.review.run = self.review.examined = None
        self._renamings.clear()
        self._close_demonstration()
        self.project_changed.emit()
        self.listing_changed.emit()
        self.review.run_changed.emit()
        self.review.examined_changed.emit()

    def _close_demonstration(self) -> None:
        self.view.set_playing(False)
        self.view.reset(None)
        self._edit_track(_NoTrack(self.author))
        self.other_tracks = {}
        self._list_actions(Vocabulary())
        self.demonstration_changed.emit()
        self.vocabulary_changed.emit()

    def open_demonstration(self, id_: str) -> bool:
        """Open a demonstration of the project; returns whether that succeeded."""
        if self.project is None:
            return False
        with self._reporting_errors() as errors:
            demonstration = self.project.demonstrations.load(id_)
            if demonstration.id == self.id:
                return True
            editor = TrackEditor(self.project, demonstration.id, self.author, self._perform_edit)
            labels = self._visible_labels(self.author, demonstration)
            self.finish_stroke(leaving=True)
            if self.id:  # what was painted in the previous one enters the list only now
                with suppress(InputError):  # removed elsewhere meanwhile
                    self._update_info(self.project)
        if errors:
            return False
        self.view.set_playing(False)
        self.view.reset(demonstration)
        self._edit_track(editor)
        self._show_labels(labels)
        self.demonstration_changed.emit()
        self.vocabulary_changed.emit()
        self.tracks_changed.emit()
        self.view.span_changed.emit(self.view.start, self.view.end)
        self.view.cursor_moved.emit(self.view.cursor)
        return True

    def set_author(self, name: str) -> None:
        """Label as another coder from now on."""
        name = tidy_name(name)
        if not name or name == self.author:
            return
        if is_model(name):
            self.refuse(f"'{name}' is a model's name; use a person's.")
            return
        if self.project is not None and self.demonstration is not None:
            with self._reporting_errors(tried=True) as errors:
                editor = TrackEditor(self.project, self.id, name, self._perform_edit)
                labels = self._visible_labels(name, self.demonstration)
            if errors:  # the coder shown must be the one whose labels are shown
                return
            self.finish_stroke(leaving=True)
            self._edit_track(editor)
            self._show_labels(labels)
        else:
            self._edit_track(_NoTrack(name))
        self._hide_examined()
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
                self.show_message(f"'{old.name}' was removed elsewhere.")

    def refresh_listing(self) -> bool:
        """Read the list of demonstrations again; returns whether that succeeded."""
        if self.project is None:
            return False
        with self._reporting_errors() as errors:
            self.infos = self.project.demonstrations.infos()
        self.listing_changed.emit()
        return not errors

    def refresh_info(self) -> None:
        """Read the list's row of the open demonstration again."""
        if self.project is not None and self.id:
            with self._reporting_errors():
                self._update_info(self.project)
            self.listing_changed.emit()

    def _update_info(self, project: Project) -> None:
        new = project.demonstrations.info(self.id)
        self.infos = tuple(new if info.id == new.id else info for info in self.infos)

    def reread(self) -> bool:
        """Take over what is stored by now: names, videos, assignments, labels, actions.

        Returns whether all of it could be read.
        """
        listed = self.refresh_listing()
        if self.project is None or self.demonstration is None:
            return listed
        if all(info.id != self.id for info in self.infos):  # a recording that was discarded
            self._close_demonstration()
            return listed
        old = self.demonstration
        with self._reporting_errors() as errors:
            new = self.project.demonstrations.load(self.id)
            labels = self._visible_labels(self.author, new)
            if self.editor.refresh():
                self.select(None)
        if errors:
            return False
        self._show_labels(labels)
        self._hide_examined()
        if (old.name, old.task, old.videos) != (new.name, new.task, new.videos):
            self.view.demonstration = new
            self.demonstration_changed.emit()
        self.vocabulary_changed.emit()
        self.tracks_changed.emit()
        return listed

    def set_video_clock(self, clock: ClockMap, name: str | None = None) -> bool:
        """Map a video's clock onto the force clock anew, by default the first one's."""
        if self.project is None or self.demonstration is None:
            return False
        with self._reporting_errors(tried=True) as errors:
            self.project.media.set_video_clock(self.id, clock, name)
            self.view.demonstration = self.project.demonstrations.load(self.id)
        if not errors:
            self.demonstration_changed.emit()
        return not errors

    def set_done(self, then_open: str = "") -> bool:
        """Mark the open demonstration as done by the coder; blind coding ends then.

        If another one is to be opened then (its id), the labels of others are not shown before.
        """
        if self.project is None or not self.id:
            return False
        if not self.finish_stroke():
            return False
        with self._reporting_errors(tried=True) as errors:
            blind = self.coding_blind
            self.project.coding.set_done(self.id, self.author)
        if then_open and not errors:
            opened = self.open_demonstration(then_open)
            self.refresh_listing() if opened else self.reread()
            return opened
        self.reread()
        if not errors:
            sentence = "Marked as done; the labels of others are shown."
            self.show_message(sentence if blind else "Marked as done.")
        return not errors

    # Messages

    def show_message(self, text: str, error: bool = False) -> None:
        """Show one sentence in the status line."""
        self.message_shown.emit(text, error)

    def show_local_message(self, text: str, error: bool = False) -> None:
        """Show a sentence about the open demonstration, which goes when another one is opened."""
        self.local_message = text
        self.show_message(text, error)

    def refuse(self, text: str, *, on_track: bool = False) -> None:
        """Say why what was just tried is not done, in the status line and where it was tried.

        That is beside what has the keyboard; `on_track` says that it is the coder's track, whatever
        has it.
        """
        self.show_local_message(text, True)
        self.refusal_shown.emit(text, on_track)

    @contextmanager
    def _reporting_errors(self, *, tried: bool = False) -> Iterator[list[str]]:
        """Show an error in the status line; yields a list that holds it then.

        Where the coder has `tried` something, it is shown there, too. A track that was changed
        elsewhere is read anew.
        """
        errors: list[str] = []
        self.refused = False
        try:
            try:
                yield errors
            except StaleTrackError:
                self.editor.refresh()
                self.select(None)
                self.tracks_changed.emit()
                raise
        except ForcelabError as error:
            self.refused = True
            errors.append(str(error))
            if tried:
                self.refuse(str(error))
            else:
                self.show_message(str(error), True)
            if error.__cause__ is not None:  # the disk or the store refused, not what was asked for
                self.store_failed.emit(str(error))

    # Tracks of others

    def other_authors(self) -> tuple[str, ...]:
        """Whose tracks exist besides the coder's; none while coding blind."""
        authors: list[str] = []
        with self._reporting_errors():
            if self.project is not None and self.id and not self.coding_blind:
                authors += (track.author for track in self.project.tracks.of(self.id))
                if self.review.run is not None and self.review.reviewed is not None:
                    authors.append(self.review.run.proposer)
        return tuple(author for author in authors if author != self.author)

    def set_hidden_authors(self, authors: frozenset[str]) -> None:
        """Hide these authors' tracks."""
        if authors != self.hidden_authors:
            self.hidden_authors = authors
            self.reread_tracks()

    def reread_tracks(self) -> None:
        """Read again the tracks that the coder may see."""
        if self.demonstration is not None:
            with self._reporting_errors():
                self._show_labels(self._visible_labels(self.author, self.demonstration))
            self.tracks_changed.emit()

    def _visible_labels(self, author: str, demonstration: Demonstration) -> _VisibleLabels:
        """What a coder may see; what is hidden does not show in actions either."""
        project, run = self.project, self.review.run
        assert project is not None
        tracks = project.tracks.of(demonstration.id)
        blind = project.coding.is_blind(demonstration.id, author)
        if blind:
            tracks = tuple(track for track in tracks if track.author == author)
        painted = tuple(action for track in tracks for action in track.actions)
        others = {track.author: track.segments for track in tracks if track.author != author}
        reviewed = None if run is None else run.find(demonstration.id)
        if run is not None and reviewed is not None and not blind:
            predicted = as_coded(reviewed.predicted, run, reviewed)
            others[run.proposer] = predicted
            painted += tuple(segment.action for segment in predicted)
        listed, styles = project.actions.vocabulary(demonstration.task), list[Action]()
        if any(action not in listed for action in painted):
            styles += project.actions.elsewhere(demonstration.task)
            if run is not None:
                # Runs are not loaded where none is reviewed.
                from forcelab.review.run_result import action_styles

                styles += action_styles(project, run)
        return _VisibleLabels(others, listed, painted, styles)

    def _show_labels(self, labels: _VisibleLabels) -> None:
        """Show what the coder may see; emits no signal."""
        self.other_tracks = {
            author: segments
            for author, segments in labels.tracks.items()
            if author not in self.hidden_authors
        }
        self._list_actions(labels.listed, labels.painted, labels.styles)

    def _hide_examined(self) -> None:
        """Examine nothing while coding blind: an interval shows where others begin and end."""
        if self.review.examined is not None and self.coding_blind:
            self.review.examined = None
            self.view.clear_range()
            self.review.examined_changed.emit()

    # Actions

    def set_action(self, name: str | None) -> None:
        """Take up a brush, or put it down."""
        if name != self.action:
            self.action = name
            self.action_changed.emit()

    def set_vocabulary(self, vocabulary: Vocabulary, recoloured: str = "") -> bool:
        """Replace the actions of the open demonstration's task, unless others changed them.

        Other tasks follow the colour of the action that was `recoloured`, where they can.
        """
        if self.project is None or self.demonstration is None:
            return False
        task, changed = self.demonstration.task, False
        with self._reporting_errors(tried=True):
            changed = self.project.actions.set_vocabulary(
                task, vocabulary, before=self._listed, recoloured=recoloured
            )
            if changed:
                self._list_actions(vocabulary)
            else:
                listed = self.vocabulary
                self._list_actions(self.project.actions.vocabulary(task), listed.names, listed)
                self.refuse("The actions were changed elsewhere; look at them and repeat it.")
            self.vocabulary_changed.emit()
        return changed

    def add_actions(self, *names: str) -> bool:
        """Make sure that the vocabulary has these actions; those that others add stay."""
        if all(name in self.vocabulary for name in names):
            return True
        if self.project is None or self.demonstration is None:
            return False
        with self._reporting_errors(tried=True) as errors:
            wider = self.vocabulary.with_actions(*names)
            self._list_actions(self.project.actions.add(self.demonstration.task, wider.names))
            self.vocabulary_changed.emit()
        return not errors

    def rename_action(
        self, old: str, new: str, tasks: Collection[str] | None = None, *, merge: bool = False
    ) -> bool:
        """Rename an action in all of the coder's tracks, or merge it into another one."""
        if self.project is None:
            return False
        with self._reporting_errors(tried=True) as errors:
            before = self.project.actions.vocabularies()
            renamed = self.project.actions.rename(self.author, old, new, tasks, merge=merge)
            after = self.project.actions.vocabularies()
        if errors:
            return False
        for task in renamed.tasks:
            previous, current = before.get(task, Vocabulary()), after[task]
            if {*previous.names} ^ {*current.names} <= {old, new}:  # no other change just then
                self._renamings += [(task, previous, current), (task, current, previous)]
        selected, brush, stroke = self.selected, self.action, self.stroke
        self.reread()
        self.select(selected)  # as many segments as before
        if brush == old:
            self.set_action(new)
        if stroke is not None and stroke.action == old:
            self.begin_stroke(new, stroke.start)
        self.show_message(renamed.sentences(done=True))
        return True

    def _list_actions(
        self, listed: Vocabulary, painted: tuple[str, ...] = (), styles: Iterable[Action] = ()
    ) -> None:
        """Offer the stored actions, and painted ones besides; emits no `vocabulary_changed`."""
        self._listed = listed
        self.vocabulary = listed.with_actions(*painted, like=styles)
        if self.action is not None and self.action not in self.vocabulary:
            self.set_action(None)

    def _restore_actions(self, result: UndoResult) -> None:
        """Offer what an undo or a redo brought back, which may have left the list since.

        Where a renaming was reverted, actions get back the look and the key that they had.
        """
        project = self.project
        if project is None:
            return
        open_task = None if self.demonstration is None else self.demonstration.task
        with self._reporting_errors():
            for task, (gone, back) in result.actions.items():
                listed = project.actions.vocabulary(task)  # which others may have changed just now
                restored = self._before_renaming(task, listed, gone, back, result)
                if restored is None or not project.actions.set_vocabulary(
                    task, restored, before=listed
                ):
                    wider = listed.with_actions(*sorted(back))
                    restored = listed if wider == listed else project.actions.add(task, wider.names)
                if task == open_task and restored != self._listed:
                    shown = self.vocabulary
                    unlisted = tuple(name for name in shown.names if name not in self._listed)
                    self._list_actions(restored, unlisted, shown)
                    self.vocabulary_changed.emit()

    def _before_renaming(
        self, task: str, listed: Vocabulary, gone: set[str], back: set[str], result: UndoResult
    ) -> Vocabulary | None:
        """The actions of a task on the other side of a renaming that was reverted.

        None if there was none, or the task still needs an action that it would remove. Where
        nothing comes back, as others kept the old action, the result shows that there was one.
        """
        assert self.project is not None
        # A coder of the task who is blind would learn from the list whether others use an action.
        blind = task in self.project.coding.blind_tasks(result.edits[0].author)
        for renamed_task, current, previous in self._renamings:
            leaving, restored = {*current.names} - {*previous.names}, back - {*current.names}
            fits = leaving <= gone and (restored or result.renames) and back <= {*previous.names}
            if not fits or (renamed_task, current) != (task, listed):
                continue
            if not leaving or not (blind or leaving & self.project.actions.painted(task)):
                return previous
        return None

    # The coder's track

    def _edit_track(self, editor: TrackEditor) -> None:
        """Edit another track from now on; emits no signal."""
        self.editor = editor
        self.selected: int | None = None
        self.stroke: Stroke | None = None
        self._nudges: _NudgeRun | None = None

    def _perform_edit(self, verb: Callable[[], Result]) -> Result:
        """Carry out a verb of the editor; the store has the edit before a view learns of it."""
        result = None
        selected = None if self.selected is None else self.editor.segments[self.selected]
        with self._reporting_errors(tried=True) as errors:
            result = verb()
        if result is None:
            if self.editor.unchanged and not errors:
                self.show_local_message(self.editor.unchanged)
            return None
        latest = result.edits[0] if isinstance(result, UndoResult) else result
        if selected is not None:
            self.select(self._index_after(selected, latest))
        if isinstance(result, UndoResult):
            self._restore_actions(result)
            if len(result.edits) > 1:  # in other demonstrations, too
                self.refresh_listing()
            self.tracks_changed.emit()
            self.show_local_message(result.sentence())
            self._reveal(latest)
        else:
            listed = self.add_actions(*(segment.action for segment in latest.inserted))
            self.tracks_changed.emit()
            if listed:
                self.show_local_message(latest.what)
        return result

    def _reveal(self, edit: Edit) -> None:
        """Bring what an edit changed into view, if none of it is."""
        view, changed = self.view, set(edit.removed) ^ set(edit.inserted)
        start = min((segment.start for segment in changed), default=view.start)
        end = max((segment.end for segment in changed), default=view.end)
        if end <= view.start or start >= view.end:
            margin = max(view.end - view.start - (end - start), end - start) / 2
            view.set_span(start - margin, end + margin)

    def _index_after(self, segment: Segment, edit: Edit) -> int | None:
        """Where a segment is after an edit, also one that another window had made before."""
        if (index := self.editor.index_of(segment)) is not None:
            return index
        before, after = set(edit.removed), set(edit.inserted)
        gone = [removed for removed in edit.removed if removed not in after]
        new = [inserted for inserted in edit.inserted if inserted not in before]
        if segment not in gone or len(gone) != len(new):
            return None
        return self.editor.index_of(new[gone.index(segment)])

    def origins(self) -> Mapping[Segment, Origin]:
        """Which of the coder's segments a model proposed; looked up anew only after edits."""
        if self.project is None or not self.id:
            return {}
        try:
            return self.project.tracks.origins(self.id, self.author)
        except ForcelabError:  # a busy store is reported where labels are read or written
            return {}

    def select(self, index: int | None) -> None:
        """Select one of the coder's segments, or none."""
        if index is not None and not 0 <= index < len(self.editor.segments):
            index = None
        if index != self.selected:
            self.selected = index
            self.selection_changed.emit()

    def _leave_selection(self) -> None:
        """Select nothing once the cursor has left the selected segment, but not in playback."""
        if self.selected is not None and not self.view.playing:
            segment = self.editor.segments[self.selected]
            if not segment.start - 1e-6 <= self.view.cursor <= segment.end + 1e-6:
                self.select(None)

    def nudge(self, index: int, part: Literal["start", "end", "both"], step: float) -> bool:
        """Move an edge of a segment, or all of it, by a step in seconds; the cursor goes with it.

        Steps that follow each other are one edit: one undo takes all of them back.
        """
        run = self._nudges
        if run is not None and self._continues(run, index, part):
            index, before, time, replacing = run.index, run.before, run.time, run.edit
        else:
            before, replacing = self.editor.segments[index], None
            time = before.end if part == "end" else before.start
        low, high = self.view.bounds
        high -= before.duration if part == "both" else 0
        time = min(max(round(time + step, DIGITS), low), high)
        if part == "both":
            edit = self.editor.move_segment(index, time, replacing)
        else:
            edit = self.editor.move_edge(index, part, time, replacing)
        if edit is None:
            return False
        self.view.seek(time)
        # Segments that it grew over may have gone, which changes its index.
        edge = _end if part == "end" else _start
        self.select(bisect_left(self.editor.segments, time - SLIVER, key=edge))
        self._nudges = None
        if edit.kind == "paint" and self.selected is not None:
            after, deadline = self.editor.segments[self.selected], monotonic() + NUDGE_PAUSE
            self._nudges = _NudgeRun(index, part, before, time, edit, after, deadline)
        return True

    def _continues(self, run: _NudgeRun, index: int, part: str) -> bool:
        """Whether a step continues a run: of the same kind, at once, and nothing in between."""
        if self.project is None:
            return False
        segments = self.editor.segments
        if (run.part, run.after) != (part, segments[index]) or monotonic() > run.deadline:
            return False
        try:
            head = self.project.tracks.head(self.id, self.author)
        except ForcelabError:  # a busy store is reported where labels are written
            return False
        edit = run.edit
        return (edit.demonstration, edit.author, edit.id) == (self.id, self.author, head)

    def begin_stroke(self, action: str, at: float) -> None:
        """Begin a segment that :meth:`end_stroke` ends."""
        self.stroke = Stroke(action, self.view.within(at))
        self.stroke_changed.emit()

    def end_stroke(self, at: float) -> bool:
        """Paint the stroke up to `at`, which may lie before its beginning.

        Where the store refuses, the stroke goes on, to be ended once more.
        """
        if self.stroke is None:
            return False
        stroke, self.stroke = self.stroke, None
        at = self.view.within(at)
        self.stroke_changed.emit()
        if at == stroke.start:
            self.refuse("A segment needs time: move the cursor before you end it.", on_track=True)
            return False
        start, end = sorted((stroke.start, at))
        painted = self.editor.paint(start, end, stroke.action) is not None
        if not painted and self.refused:
            self.begin_stroke(stroke.action, stroke.start)
        return painted

    def finish_stroke(self, *, leaving: bool = False) -> bool:
        """End the stroke at the cursor, as it is drawn there; returns whether none waits any more.

        Not where that would paint over segments: it may have been begun by mistake. That is
        refused or, where its track is left anyway, told, as is what the coder sees no more.
        """
        stroke, cursor, segments = self.stroke, self.view.cursor, self.editor.segments
        if stroke is None:
            return True
        start, end = sorted((stroke.start, cursor))
        if end - start <= SLIVER:
            self.cancel_stroke()
        elif not any(s.start + SLIVER < end and start + SLIVER < s.end for s in segments):
            if self.end_stroke(cursor) and leaving:
                self.show_message(f"{stroke} was ended at the cursor, at {cursor:.2f} s.")
        elif not leaving:
            sentence = f"{stroke} is not ended: press its key again, or Esc to cancel it."
            self.refuse(sentence, on_track=True)
        if leaving and self.stroke is not None:
            self.show_message(f"{stroke} was not ended: it is not stored.", True)
        return self.stroke is None

    def cancel_stroke(self) -> None:
        if self.stroke is not None:
            self.stroke = None
            self.stroke_changed.emit()


class ReviewState(QObject):
    """The predictions that are shown, and what is taken over from them; never a coder's track."""

    run_changed = Signal()
    examined_changed = Signal()
    training_changed = Signal()

    def __init__(self, document: Document) -> None:
        super().__init__(document)
        self._document = document
        self.run: RunResult | None = None
        self.examined: Interval | None = None  # what is being looked at
        self.training = False  # whether a recogniser is being trained

    def set_training(self, training: bool) -> None:
        if training != self.training:
            self.training = training
            self.training_changed.emit()

    def set_run(self, run: RunResult | None) -> None:
        """Review another run; its prediction stands below the open demonstration's tracks."""
        self.run = run
        self.examined = None
        if self._document.demonstration is not None:
            self._document.reread_tracks()
            self._document.vocabulary_changed.emit()
        self.run_changed.emit()
        self.examined_changed.emit()

    def examine(self, interval: Interval) -> bool:
        """Open an interval's demonstration, show the interval with its surroundings, mark it."""
        document, id_ = self._document, interval.demonstration
        if id_ != document.id and not document.open_demonstration(id_):
            return False
        margin = max(MARGIN * interval.duration, SHORTEST_MARGIN)
        document.view.set_span(interval.start - margin, interval.end + margin)
        document.view.seek(interval.start)
        document.view.set_range(interval.start, interval.end)
        self.examined = interval
        self.examined_changed.emit()
        return True

    @property
    def reviewed(self) -> DemonstrationResult | None:
        """The open demonstration in the run; None while coding blind, or if it is not in it."""
        if self.run is None or not self._document.id or self._document.coding_blind:
            return None
        return self.run.find(self._document.id)

    @property
    def prediction(self) -> Segments:
        """What is predicted for the open demonstration; empty while coding blind."""
        reviewed = self.reviewed
        return () if reviewed is None else reviewed.predicted

    # Accepting

    @property
    def obstacle(self) -> str:
        """Why no prediction can be accepted here; empty where there is one."""
        if self._document.coding_blind:
            return "Predictions are hidden until you are done; nothing accepted."
        missing = "There is no prediction to accept here; train a recogniser."
        return missing if self.reviewed is None else ""

    def accept_here(self) -> bool:
        """Accept the predicted segment at the cursor, and go to the next one to accept."""
        view, time = self._document.view, self._document.view.cursor
        accepted = self.accept(time, math.nextafter(time, math.inf))
        if accepted and not view.playing:
            view.seek(self._next_to_accept(time))
        return accepted

    def accept_in_view(self) -> bool:
        """Accept all predictions in view, wherever the coder has labelled nothing."""
        view = self._document.view
        return self.accept(view.start, view.end, replace=False)

    def accept(
        self, start: float, end: float, at_least: float = 0.0, *, replace: bool = True
    ) -> bool:
        """Copy predicted segments into the coder's track, as one edit that can be undone.

        Every predicted segment that overlaps ``[start, end)`` is taken as a whole, if its mean
        probability is `at_least` that; `replace` says whether what the coder has labelled there is
        painted over.
        """
        document, reviewed, run = self._document, self.reviewed, self.run
        if reviewed is None or run is None:
            document.refuse(self.obstacle)
            return False
        # It brings what proposes demonstrations to label, which takes long to load.
        from forcelab.review.active_learning import acceptable_segments

        if at_least and reviewed.probability_trace is None:
            document.refuse("This run kept no probabilities; train again to have them.")
            return False
        segments = acceptable_segments(reviewed, start, end, at_least)
        if not segments:
            document.show_message("Nothing is predicted here that could be accepted.")
            return False
        return self.adopt(*as_coded(segments, run, reviewed), replace=replace)

    def adopt(self, *segments: Segment, replace: bool = True) -> bool:
        """Paint what the recogniser proposes, in the coder's spelling.

        Each segment remembers which recogniser it was.
        """
        if self.run is None:
            return False
        editor = self._document.editor
        return editor.accept(segments, self.run.proposer, replace=replace) is not None

    def _next_to_accept(self, time: float) -> float:
        """The start of the next prediction that the track differs from; else this one's end."""
        reviewed, run = self.reviewed, self.run
        if reviewed is None or run is None:
            return time
        end, labels = time, self._document.editor.segments
        for segment in as_coded(reviewed.predicted, run, reviewed):
            if segment.start > time and covering(labels, segment) is None:
                return segment.start
            if segment.start <= time < segment.end:
                end = segment.end
        return end
