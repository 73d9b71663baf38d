"""Label files of other programs: a module each, told apart by content; and their import.

All files are read before anything is written. What does not fit is left out and reported.
"""

from __future__ import annotations

import codecs
import math
import os
import re
from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import Final, Literal, Protocol, cast
from unicodedata import normalize

import numpy as np

from forcelab.clock import ClockMap
from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.formats.json_values import GZIP
from forcelab.formats.label_offset import fit_offset
from forcelab.formats.output_folder import file_names
from forcelab.formats.samples import LABELS_OF
from forcelab.formats.signatures import Format, file_head, find_format, naming_file, seems_to_be
from forcelab.formats.table_sniff import find_layout, head_lines, is_label_name
from forcelab.formats.track_text import edges_of, nearest, on_samples, with_edges
from forcelab.jobs import Progress, finish
from forcelab.labels import (
    Segments,
    Track,
    check_name,
    first_beyond,
    is_model,
    means_unlabelled,
    overhang,
)
from forcelab.project import DemonstrationInfo, LabelImport, Project
from forcelab.segment_edits import tell_changes
from forcelab.text import counted, listed, name_alike, task_text
from forcelab.vocabulary import MOST_ACTIONS

#: Demonstrations that a sentence names; further ones it only counts.
NAMED: Final = 4
#: An offset is proposed if labels agree with others in this share of the labelled time at least,
#: and in this much more of it than without.
LEAST, BETTER = 0.5, 0.1
#: Characters of an author's name in a file.
LONGEST_AUTHOR: Final = 200
#: What stands before the author in the name of a file or an observation.
BEFORE_AUTHOR: Final = " - "
#: What the names of label files end in, after that of their recording.
_ENDING: Final = re.compile(r"(?<=.)(?:\.labels|_labels|\.segments)\Z", re.IGNORECASE | re.DOTALL)


@dataclass(frozen=True, slots=True)
class LabelSet:
    """The labels of one demonstration, as a file of another program has them."""

    name: str  #: the id of an observation, else of its media file or itself, without suffix
    #: one per author; times are seconds of the force clock where the file tells them so, else of
    #: the clock of its media, which mostly starts when they do
    tracks: tuple[Track, ...]
    duration: float | None = None  #: of the demonstration or its media (s), if the file tells it
    remarks: tuple[str, ...] = ()  #: on what was left out or is worth a look, a sentence each
    #: by the name of each media file that the labels were made on, its time (s) when that of the
    #: labels is 0; empty where times are of the force clock
    media: Mapping[str, float] = field(default_factory=dict)
    #: to which times in the file are rounded (s): stored labels no farther from them are the same
    resolution: float = 1e-6
    tiers: tuple[str, ...] = ()  #: what its tiers are called, if it has any
    problem: str = ""  #: why none of them can be read, as a sentence; its tracks are then empty


@dataclass(frozen=True, slots=True)
class LabelOptions:
    """How a label file is to be understood where it does not say so itself.

    Parameters
    ----------
    author : str
        Author of the labels, where the file names none.
    tiers : "authors" or "actions"
        Whether each tier is an author, whose annotations are the actions; or each is an action, so
        that all of them together are the author's track.
    offset : float
        Seconds that are added to all times.

    Raises
    ------
    InputError
        If the offset is not finite.

    Examples
    --------
    >>> forcelab.LabelOptions(author="Ada", offset=-0.25).offset
    -0.25
    """

    author: str = "coder"
    tiers: Literal["authors", "actions"] = "authors"
    offset: float = 0.0

    def __post_init__(self) -> None:
        if not math.isfinite(self.offset):
            raise InputError(f"An offset is a number of seconds, not {self.offset}.")


class _Reader(Protocol):
    """The interface of a label format's module."""

    def sniff_labels(self, path: Path, head: bytes) -> bool:
        """Whether the file, whose first 64 KiB are `head`, is of this format."""

    def read_labels(self, path: Path, options: LabelOptions) -> list[LabelSet]:
        """Read the whole file, without the offset; errors are :class:`InputError`."""


#: How ELAN files begin: as XML, or with the mark of an encoding.
_XML: Final = (b"<", codecs.BOM_UTF8, codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
#: In the order in which they are tried: any text might be a table.
LABEL_FORMATS: Final = (
    Format("elan", "ELAN files (*.eaf)", "forcelab.formats.elan", _XML),
    Format("textgrid", "TextGrids of Praat", "forcelab.formats.textgrid"),
    Format("boris", "projects and event tables of BORIS", "forcelab.formats.boris"),
    Format("boris.gz", "compressed projects of BORIS", "forcelab.formats.boris", (GZIP,)),
    Format("label-studio", "JSON of Label Studio", "forcelab.formats.label_studio"),
    Format(
        "table",
        "tables of start, end and action (CSV, TSV, Audacity)",
        "forcelab.formats.label_tables",
    ),
)


def read_label_file(
    path: str | os.PathLike[str], options: LabelOptions | None = None
) -> list[LabelSet]:
    """The labels of each demonstration in a file of any label format, without the offset.

    The error is one line and names the file.
    """
    path, options = Path(path), options or LabelOptions()
    with naming_file(path):
        sets = [_checked(path, labels) for labels in _reader(path).read_labels(path, options)]
        if not any(track.segments for labels in sets for track in labels.tracks):
            remarks = [remark for labels in sets for remark in labels.remarks]
            sentence = f"'{path}' holds no label; there is nothing to import."
            raise InputError(" ".join([sentence, *dict.fromkeys(remarks)]))
        return sets


def own_stem(path: str | os.PathLike[str]) -> str:
    """A file's name without suffix, and without what marks it as a label file."""
    return _ENDING.sub("", Path(path).stem)


def _reader(path: Path) -> _Reader:
    """The module that reads a file; the error says what the file seems to be."""
    head = file_head(path)
    if (format_ := find_format(LABEL_FORMATS, "sniff_labels", path, head)) is not None:
        return cast(_Reader, import_module(format_.module))
    layout = find_layout(head_lines(head)) if seems_to_be(head) == "text" else None
    names = [column.name for column in layout.columns] if layout is not None else []
    if any(is_label_name(name) or name.startswith(LABELS_OF) for name in names):
        raise InputError(
            f"'{path}' looks like a recording, not a file of labels (start, end, action); import "
            "it with those that are in it (forcelab import; in the window File > Import "
            "demonstrations)."
        )
    readable = "; ".join(format_.description for format_ in LABEL_FORMATS)
    raise InputError(
        f"'{path}' is no file of labels, but looks like {seems_to_be(head)}; what can be read: "
        f"{readable}."
    )


def _checked(path: Path, labels: LabelSet) -> LabelSet:
    """Labels that can be stored: each author once, names that are some, nothing unlabelled."""
    authors = [track.author for track in labels.tracks]
    if len(set(authors)) < len(authors):
        twice = next(author for author in authors if authors.count(author) > 1)
        raise InputError(f"'{path}' has two tracks of '{twice}' on '{labels.name}'; rename one.")
    tracks = []
    for read in labels.tracks:
        segments = (replace(s, action=s.action.strip()) for s in read.segments if s.action.strip())
        track = Track(read.author, tuple(s for s in segments if not means_unlabelled(s.action)))
        tracks.append(track)
        if "\0" in track.author or len(track.author) > LONGEST_AUTHOR:
            raise InputError(
                f"'{path}': {track.author[:40]!a} is no name for an author; rename it."
            )
        for action in track.actions:
            check_name(action)
        for name in (track.author, *track.actions):
            if not name.isascii() and name.encode("utf-8", "ignore").decode() != name:
                raise InputError(f"'{path}': the name {name!a} is not valid Unicode; rename it.")
    return replace(labels, tracks=tuple(tracks))


Status = Literal["new", "replaced", "unchanged", "left out"]


@dataclass(frozen=True, slots=True)
class ImportedTrack:
    """What became of one author's labels in a file, or of all where no demonstration has them."""

    file: Path
    name: str  #: what the file calls the demonstration
    demonstration: DemonstrationInfo | None
    author: str
    segments: int
    status: Status
    reason: str = ""  #: why they were left out, as a sentence
    changes: str = ""  #: what differs from the labels they replace


@dataclass(frozen=True, slots=True)
class LabelReport:
    """What an import of labels did.

    Parameters
    ----------
    tracks : tuple of ImportedTrack
        In the order of the files.
    remarks : mapping of Path to tuple of str
        For each file that gave cause: a sentence for each thing that is worth a look.
    unread : mapping of Path to str
        The files that could not be read, each with the reason.
    """

    tracks: tuple[ImportedTrack, ...] = ()
    remarks: Mapping[Path, tuple[str, ...]] = field(default_factory=dict)
    unread: Mapping[Path, str] = field(default_factory=dict)

    def count(self, status: Status) -> int:
        """How many tracks are ``"new"``, ``"replaced"``, ``"unchanged"`` or ``"left out"``."""
        return sum(track.status == status for track in self.tracks)

    def trouble(self) -> dict[Path, tuple[str, ...]]:
        """Why something was left out, by file."""
        reasons: dict[Path, list[str]] = defaultdict(list)
        for track in self.tracks:
            if track.reason:
                reasons[track.file].append(track.reason)
        for path, reason in self.unread.items():
            reasons[path].append(reason)
        return {path: tuple(dict.fromkeys(sentences)) for path, sentences in reasons.items()}


def import_labels(
    project_path: str | os.PathLike[str],
    files: Iterable[str | os.PathLike[str]],
    options: LabelOptions | None = None,
    *,
    demonstration: str | None = None,
    replacing: bool = False,
) -> LabelReport:
    """Import the labels in files into demonstrations that are in a project.

    All files are read and matched by name first; what fits is then written as a whole, one edit a
    track.

    Parameters
    ----------
    project_path : path-like
        The project's folder.
    files : iterable of path-like
        Label files of any format.
    options : LabelOptions, optional
        How they are to be understood where they do not say so themselves.
    demonstration : str, optional
        The name or id of the demonstration that the labels are of, whatever the files call it.
    replacing : bool
        Whether labels that an author has there already are replaced.

    Returns
    -------
    LabelReport
        What became of each track, and what did not fit.

    Raises
    ------
    InputError
        If the project cannot be written, or there is no such demonstration; nothing was changed.

    Examples
    --------
    >>> options = forcelab.LabelOptions(author="Dora")
    >>> report = forcelab.import_labels("lab.forcelab", ["foam 04.labels.csv"], options)
    >>> project.tracks.get(project.demonstrations.id_of("foam 04"), "Dora").segments
    (Segment(start=0.5, end=2.0, action='grab'),)
    """
    job = importing_labels(
        project_path, files, options, demonstration=demonstration, replacing=replacing
    )
    return finish(job)


def importing_labels(
    project_path: str | os.PathLike[str],
    files: Iterable[str | os.PathLike[str]],
    options: LabelOptions | None = None,
    *,
    demonstration: str | None = None,
    replacing: bool = False,
    viewer: str | None = None,
    writing: bool = True,
) -> Generator[Progress, None, LabelReport]:
    """As :func:`import_labels`, as a job; cancelled before it writes, it changes nothing.

    Labels of others stay hidden from a coder, the `viewer`, who labels a demonstration blind. What
    would be imported is only told where it is not for `writing`.
    """
    paths = list({os.path.realpath(file): Path(file) for file in files}.values())
    if not paths:
        raise InputError("There is no file to import; name at least one.")
    options = options or LabelOptions()
    with Project.open(project_path) as project:
        if writing:
            project.refuse_read_only()
        infos = project.demonstrations.infos()
        if demonstration is not None:
            id_ = project.demonstrations.id_of(demonstration)
            infos = tuple(info for info in infos if info.id == id_)
        matcher = _Matcher(infos, options, demonstration is not None)
        importer = _Importer(project, options, replacing, viewer)
        for done, path in enumerate(paths):
            yield Progress(done, len(paths) + 1, f"reading {path.name}")
            try:
                sets = read_label_file(path, options)
            except InputError as error:
                importer.unread[path] = str(error)
                continue
            for labels in sets:
                importer.add(path, labels, matcher.find(path, labels, len(sets) == 1))
        if writing and importer.imports:
            yield Progress(len(paths), len(paths) + 1, f"writing {project.path.name}")
            project.demonstrations.import_labels(importer.imports)
        yield Progress(len(paths) + 1, len(paths) + 1, "done")
        return importer.report()


class _Matcher:
    """Finds the demonstration that labels are of."""

    def __init__(
        self, infos: Sequence[DemonstrationInfo], options: LabelOptions, chosen: bool
    ) -> None:
        self._infos, self._options, self._chosen = infos, options, chosen
        self._exact: dict[str, list[DemonstrationInfo]] = defaultdict(list)
        self._folded: dict[str, list[DemonstrationInfo]] = defaultdict(list)
        for info in infos:
            titles = [info.name, f"{info.task} - {info.name}"]
            keys = dict.fromkeys([*titles, *file_names(titles[:1]), *file_names(titles[1:])])
            for key in keys:
                self._exact[key].append(info)
            for key in dict.fromkeys(map(_folded, [*keys, info.source])):
                if key:
                    self._folded[key].append(info)

    def find(
        self, path: Path, labels: LabelSet, alone: bool
    ) -> tuple[DemonstrationInfo, str] | str:
        """The demonstration, with the author that the name tells, if any; or why there is none.

        `alone` says that the file has labels of no other demonstration.
        """
        if self._chosen:
            several = (
                "It holds labels of several demonstrations, so that none can be chosen for it."
            )
            return (self._infos[0], "") if alone else several
        names = list(dict.fromkeys([labels.name, *([own_stem(path)] if alone else [])]))
        media = [Path(name).stem for name in labels.media]
        for candidates in (names, media):
            found = _look_up(candidates, self._exact) or _look_up(candidates, self._folded, _folded)
            if found:
                break
        else:
            names = list(dict.fromkeys([*names, *media]))
            called = " or ".join(f"'{name}'" for name in names)
            return f"No demonstration is called {called}; rename the file, or choose one (--demo)."
        if len(found) > 1:
            fitting = [match for match in found if self._fits(match[0], labels)]
            if len(fitting) != 1:
                where = [f"'{info.name}' of {task_text(info.task)}" for info, _ in found]
                return f"'{labels.name}' may be {listed(where, NAMED)}; choose one (--demo)."
            found = fitting
        return found[0]

    def _fits(self, info: DemonstrationInfo, labels: LabelSet) -> bool:
        """Whether a demonstration is as long as the labels say, and holds them."""
        if labels.duration is not None:
            return abs(labels.duration - info.duration) <= overhang(info.duration)
        end = max((s.end for track in labels.tracks for s in track.segments), default=0.0)
        return end + self._options.offset <= info.duration + overhang(info.duration)


def _look_up(
    names: Iterable[str],
    index: Mapping[str, list[DemonstrationInfo]],
    key: Callable[[str], str] = str,
) -> list[tuple[DemonstrationInfo, str]]:
    """The demonstrations of these names, or of what stands in them before an author."""
    found: dict[str, tuple[DemonstrationInfo, str]] = {}
    for name in names:
        words = name.split(BEFORE_AUTHOR)
        for count in range(len(words), 0, -1):
            if infos := index.get(key(BEFORE_AUTHOR.join(words[:count])), ()):
                author = BEFORE_AUTHOR.join(words[count:])
                found = {info.id: (info, author) for info in infos} | found
                break
    return list(found.values())


def _folded(name: str) -> str:
    """A name without case and without the suffix of a file."""
    name = re.sub(r"\.(?=\w*[^\W\d])\w{1,5}$", "", name.strip())
    return normalize("NFC", _ENDING.sub("", name)).casefold()


class _Importer:
    """Gathers what is to be written, and what becomes of the rest."""

    def __init__(
        self, project: Project, options: LabelOptions, replacing: bool, viewer: str | None
    ) -> None:
        self._project, self._options = project, options
        self._replacing, self._viewer = replacing, viewer
        self._kinds = {author.name: author.kind for author in project.coding.authors()}
        # A file's name has no dot at its end, and no character that some system refuses.
        self._as_in_file_names = {file_names([f"_{name}"])[0][1:]: name for name in self._kinds}
        self._taken: dict[tuple[str, str], tuple[Path, Segments]] = {}
        self._actions: dict[str, list[str]] = {}  # by task
        self.imports: list[LabelImport] = []
        self.tracks: list[ImportedTrack] = []
        self.remarks: dict[Path, list[str]] = defaultdict(list)
        self.unread: dict[Path, str] = {}

    def report(self) -> LabelReport:
        remarks = {
            path: tuple(dict.fromkeys(lines)) for path, lines in self.remarks.items() if lines
        }
        return LabelReport(tuple(self.tracks), remarks, self.unread)

    def add(self, path: Path, labels: LabelSet, match: tuple[DemonstrationInfo, str] | str) -> None:
        """Take up the labels of one demonstration."""
        self.remarks[path] += labels.remarks
        match = labels.problem or match
        if isinstance(match, str):
            for track in labels.tracks:
                self._report(path, labels, None, track, "left out", match)
            return
        info, author = match
        # A file of one track may have its author in its name.
        if author and [track.author for track in labels.tracks] == [self._options.author]:
            author = self._as_in_file_names.get(author, author)
            labels = replace(labels, tracks=(replace(labels.tracks[0], author=author),))
        try:
            demonstration = self._project.demonstrations.load(info.id)
            tracks, remark = _on_force_clock(labels, demonstration, self._options.offset)
        except InputError as error:  # of a file that is gone, or times beyond all clocks
            for track in labels.tracks:
                self._report(path, labels, info, track, "left out", str(error))
            return
        remarks = [remark, self._wrong_length(labels, info), self._actions_as_tiers(labels, info)]
        self.remarks[path] += filter(None, remarks)
        for track in tracks:
            if track.segments:
                self._add_track(path, labels, info, demonstration, track)

    def _report(
        self,
        path: Path,
        labels: LabelSet,
        info: DemonstrationInfo | None,
        track: Track,
        status: Status,
        reason: str = "",
        changes: str = "",
    ) -> None:
        number = len(track.segments)
        self.tracks.append(
            ImportedTrack(path, labels.name, info, track.author, number, status, reason, changes)
        )

    def _actions_as_tiers(self, labels: LabelSet, info: DemonstrationInfo) -> str:
        """A remark on tiers that were read as authors, and are called as actions of the task."""
        if self._options.tiers == "actions":
            return ""
        known = {name.casefold() for name in self._project.actions.vocabulary(info.task).names}
        tiers = [f"'{tier}'" for tier in labels.tiers if tier.strip().casefold() in known]
        if not tiers:
            return ""
        return (
            f"Tiers were read as authors and are called as actions of {task_text(info.task)}: "
            f"{listed(tiers, NAMED)}; if they are actions, say so (--tiers actions)."
        )

    @staticmethod
    def _wrong_length(labels: LabelSet, info: DemonstrationInfo) -> str:
        """A remark on labels of something that is not as long as the demonstration."""
        length = labels.duration
        if length is None or abs(length - info.duration) <= overhang(info.duration):
            return ""
        return (
            f"Its labels are of {length:.6g} s, and '{info.name}' is {info.duration:.6g} s long; "
            "check that they belong together."
        )

    def _add_track(
        self,
        path: Path,
        labels: LabelSet,
        info: DemonstrationInfo,
        demonstration: Demonstration,
        track: Track,
    ) -> None:
        """Take up an author's labels of one demonstration, or say why not."""
        author, before = track.author, self._project.tracks.get(info.id, track.author).segments
        track = _at_stored_edges(track, before, labels.resolution)
        if not self._hidden(info, author):
            self.remarks[path] += self._better_offset(info, track)
        reason = self._obstacle(path, info, demonstration, track)
        if not reason and before and before != track.segments and not self._replacing:
            reason = (
                f"{author} has labels on '{info.name}' already, which differ; replace them "
                "(--replace), or give the author in the file another name."
            )
        if reason:
            self._report(path, labels, info, track, "left out", reason)
            return
        known = before == track.segments or (info.id, author) in self._taken
        self._taken[info.id, author] = path, track.segments
        if known:
            self._report(path, labels, info, track, "unchanged")
            return
        what = f"{counted(len(track.segments), 'segment')} from {path.name}"
        if before:
            what += f" in place of {len(before):,}"
        self.imports.append(LabelImport(info.id, track, before, what))
        self.remarks[path] += self._new_actions(info.task, track)
        changes = tell_changes(before, track.segments) if before else ""
        self._report(path, labels, info, track, "replaced" if before else "new", changes=changes)

    def _new_actions(self, task: str, track: Track) -> list[str]:
        """Remarks on actions that the task lacks; the first ones of a task are no news."""
        had_some = bool(self._project.actions.vocabulary(task).names)
        known, remarks = self._known_actions(task), []
        for action in track.actions:
            if action in known:
                continue
            similar = name_alike(action, known)
            if had_some or similar:
                beside = f" (there is '{similar}')" if similar else ""
                remarks.append(f"New action '{action}'{beside} of {task_text(task)}.")
            known.append(action)
        return remarks

    def _known_actions(self, task: str) -> list[str]:
        """The actions of a task, with those that are imported."""
        if task not in self._actions:
            self._actions[task] = list(self._project.actions.vocabulary(task).names)
        return self._actions[task]

    def _hidden(self, info: DemonstrationInfo, author: str) -> bool:
        """Whether an author's labels are hidden from who imports."""
        if self._viewer is None or self._viewer == author:
            return False
        return self._project.coding.is_blind(info.id, self._viewer)

    def _obstacle(
        self, path: Path, info: DemonstrationInfo, demonstration: Demonstration, track: Track
    ) -> str:
        """Why an author's labels cannot be stored; empty if they can."""
        author = track.author
        if is_model(author) or self._kinds.get(author) == "model":
            return (
                f"'{author}' is a model, whose predictions never become labels; give the author in "
                "the file a coder's name."
            )
        if self._hidden(info, author):
            return (
                f"Labels of others on '{info.name}' are hidden from {self._viewer} until blind "
                "coding of it is done; import them then."
            )
        start = float(demonstration.times[0])
        beyond = first_beyond(track.segments, start, start + info.duration)
        if beyond is not None:
            return (
                f"'{beyond.action}' of {author} goes from {beyond.start:.6g} to {beyond.end:.6g} "
                f"s, and '{info.name}' is {info.duration:.6g} s long; choose another demonstration "
                "(--demo) or move the labels (--offset)."
            )
        actions = {*track.actions, *self._known_actions(info.task)}
        if len(actions) > MOST_ACTIONS:
            return (
                f"With the labels of {author}, {task_text(info.task)} would have "
                f"{len(actions):,} actions, more than {MOST_ACTIONS:,}; check that these are "
                "actions and not remarks."
            )
        other, segments = self._taken.get((info.id, author), (path, track.segments))
        if segments != track.segments:
            return (
                f"Labels of {author} on '{info.name}' are in '{other.name}' and in '{path.name}' "
                "and differ; import one of the two."
            )
        return ""

    def _better_offset(self, info: DemonstrationInfo, track: Track) -> list[str]:
        """The offset at which labels agree much better with others of the demonstration."""
        best, best_author = None, ""
        for other in self._project.tracks.of(info.id):
            if self._hidden(info, other.author):
                continue
            fit = fit_offset(track.segments, other.segments)
            if fit is not None and (best is None or fit.agreement > best.agreement):
                best, best_author = fit, other.author
        if best is None or best.agreement < max(LEAST, best.before + BETTER):
            return []
        offset = self._options.offset + best.offset
        return [
            f"Moved by {best.offset:+.3f} s, the labels of {track.author} would agree with those "
            f"of {best_author} in {100 * best.agreement:.0f} % of the labelled time instead of "
            f"{100 * best.before:.0f} % (--offset {offset:.3f})."
        ]


def _on_force_clock(
    labels: LabelSet, demonstration: Demonstration, offset: float
) -> tuple[tuple[Track, ...], str]:
    """The tracks on the clock of the forces, and a remark where a video's clock was needed."""
    clock, origin, remark = ClockMap(), 0.0, ""
    if labels.media and demonstration.videos:
        clocks = {video.path.name: video.clock for video in demonstration.videos}
        name = next((name for name in labels.media if name in clocks), next(iter(labels.media)))
        clock, origin = clocks.get(name, demonstration.videos[0].clock), labels.media[name]
        if clock != ClockMap():
            remark = "Its times were carried onto the forces by the video's clock."
            if name not in clocks:
                remark = (
                    f"'{name}' was taken for the video of '{demonstration.name}', by whose clock "
                    "times were carried onto the forces."
                )
    tracks = []
    for track in labels.tracks:
        edges = edges_of(track)
        with np.errstate(over="ignore"):  # no segment has such an edge, which is told
            if origin or clock != ClockMap():
                edges = clock.to_force(edges + origin)
            edges = edges + offset
        tracks.append(with_edges(track, edges))
    return on_samples(tracks, demonstration.times), remark


def _at_stored_edges(track: Track, stored: Segments, resolution: float) -> Track:
    """A track whose edges are those stored where the file only rounds them."""
    if not stored or not track.segments:
        return track
    edges = edges_of(track)
    known = nearest(edges, np.unique([(s.start, s.end) for s in stored]))
    moved = np.where(np.abs(known - edges) <= resolution, known, edges)
    # An edge may be nearer to the one across a short gap: segments are known by both of theirs.
    starts = [s.start for s in stored]
    for row, segment in enumerate(track.segments):
        low, high = segment.start - resolution, segment.start + resolution
        for known_segment in stored[bisect_left(starts, low) : bisect_right(starts, high)]:
            near = abs(known_segment.end - segment.end) <= resolution
            if near and known_segment.action == segment.action:
                moved[row] = known_segment.start, known_segment.end
    if not (moved[:, 0] < moved[:, 1]).all() or not (moved[:-1, 1] <= moved[1:, 0]).all():
        return track
    return with_edges(track, moved)
