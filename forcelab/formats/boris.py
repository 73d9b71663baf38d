"""Labels of BORIS: its projects out (format 7.0) and in, and its exported events in.

It exports tabular and aggregated events, whose columns differ between versions 7 to 10. An
observation's times are those of its media plus its time offset. State events are segments; point
events have no length and are left out. The author is the independent variable "observer" (or coder,
rater, annotator, author), else the subject.
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import datetime
from itertools import chain, count, islice
from pathlib import Path, PureWindowsPath
from typing import Any, Final

from forcelab.clock import ClockMap
from forcelab.demonstration import VideoReference
from forcelab.errors import InputError
from forcelab.formats.json_values import GZIP, JsonValue, read_content, read_json
from forcelab.formats.label_files import LabelOptions, LabelSet, own_stem
from forcelab.formats.table_sniff import encoding_of
from forcelab.formats.track_text import plain_times
from forcelab.labels import Segment, Track, means_unlabelled
from forcelab.text import left_out
from forcelab.video.index import stated_rate_and_length
from forcelab.vocabulary import Vocabulary

#: The version of the format, which is not that of the program.
FORMAT_VERSION = "7.0"
#: The independent variable that says whose labels they are; a column of BORIS' tables.
OBSERVER = "observer"
#: BORIS plays up to so many files beside each other.
PLAYERS = 8


@dataclass(frozen=True, slots=True)
class Observation:
    """What one coder labelled in one demonstration."""

    name: str  #: of the demonstration; BORIS lists it with the author's
    task: str  #: becomes the description
    track: Track
    videos: tuple[VideoReference, ...] = ()  #: without any BORIS has a live observation
    begun: datetime | None = None  #: when the coder began


def to_boris(name: str, observations: Sequence[Observation], vocabulary: Vocabulary) -> bytes:
    """A BORIS project: each observation of one, each segment a state event.

    Times are seconds of the force clock; where there is a video whose clock runs at another rate
    they go on at that one, so that BORIS shows the right frames. Further videos play beside the
    first one, as far as BORIS has players: from when they begin, and at its rate. The vocabulary's
    colours and keys become the ethogram.
    """
    labelled = dict.fromkeys(
        s.action for observation in observations for s in observation.track.segments
    )
    for code in labelled:
        if "|" in code:
            raise InputError(
                f"The action {code!a} holds a '|', which BORIS cannot hold; rename it."
            )
    actions = [action for action in vocabulary.with_actions(*labelled) if action.name in labelled]
    content = {
        "time_format": "s",
        "project_date": _date(datetime.now().astimezone()),
        "project_name": name,
        "project_description": "Labels of forcelab; times are seconds from the start of the forces",
        "project_format_version": FORMAT_VERSION,
        "subjects_conf": {},
        "behaviors_conf": {
            str(number): {
                "type": "State event",
                "key": action.key,
                "code": action.name,
                "description": "",
                "color": action.colour,
                "category": "",
                "modifiers": {},
                "excluded": "",
                "coding map": "",
            }
            for number, action in enumerate(actions)
        },
        "behavioral_categories": [],
        "behavioral_categories_config": {},
        "independent_variables": {
            "0": {
                "label": OBSERVER,
                "description": "",
                "type": "text",
                "default value": "",
                "possible values": "",
            }
        },
        "coding_map": {},
        "behaviors_coding_map": [],
        "converters": {},
        "observations": dict(zip(_ids(observations), map(_observation, observations), strict=True)),
    }
    return json.dumps(content, ensure_ascii=True, indent=1).encode()


def _ids(observations: Iterable[Observation]) -> list[str]:
    ids: dict[str, None] = {}
    for observation in observations:
        name = f"{observation.name} - {observation.track.author}".strip()
        numbered = (f"{name} ({number})" for number in count(2))
        ids[next(id_ for id_ in chain([name], numbered) if id_ not in ids)] = None
    return list(ids)


def _observation(observation: Observation) -> dict[str, Any]:
    videos = observation.videos[:PLAYERS]
    clock = videos[0].clock if videos else ClockMap()
    # Neither subject nor modifier nor comment; where there is a video its frame, which may be open.
    rest = ["", "", "NA"] if videos else ["", ""]
    events = [
        [_video_time(time, clock), "", segment.action, *rest]
        for segment, times in plain_times(observation.track)
        for time in times
    ]
    common = {
        "date": _date(observation.begun),
        "description": observation.task,
        "time offset": float(clock.offset),
        "events": events,
        "observation time interval": [0, 0],
        "independent_variables": {OBSERVER: observation.track.author},
        "visualize_spectrogram": False,
        "visualize_waveform": False,
        "media_creation_date_as_offset": False,
        "media_scan_sampling_duration": 0,
        "image_display_duration": 1,
        "close_behaviors_between_videos": False,
    }
    if not videos:
        live = {"scan_sampling_time": 0, "start_from_current_time": False}
        live["start_from_current_epoch_time"] = False
        return {"type": "LIVE", "file": {}, **common, **live}
    files = {
        str(player): [str(video.path) for video in videos[player - 1 : player]]
        for player in range(1, PLAYERS + 1)
    }
    stated = {str(video.path): stated_rate_and_length(video.path) for video in videos}
    info = {
        "length": {path: seconds for path, (_, seconds) in stated.items()},
        "fps": {path: fps for path, (fps, _) in stated.items()},
        "hasVideo": dict.fromkeys(stated, True),
        "hasAudio": dict.fromkeys(stated, False),
        # When each begins, on the clock of the first one.
        "offset": {
            str(player): round(float(clock.to_device(video.clock.offset)), 6)
            for player, video in enumerate(videos, 1)
        },
        "display": dict.fromkeys(stated, "Nothing"),
    }
    return {"type": "MEDIA", "file": files, "media_info": info, **common}


def _video_time(time: float, clock: ClockMap) -> float:
    """A force time, counted at the video's rate from where the video begins."""
    return round(float(clock.to_device(time)) + float(clock.offset), 6)


def _date(when: datetime | None) -> str:
    """A local date and time as BORIS writes them."""
    if when is None:
        return ""
    with suppress(OverflowError, ValueError):  # a year that has no local time on this machine
        when = when.astimezone()
    return when.replace(tzinfo=None).isoformat(timespec="milliseconds")


#: Half a millisecond, as BORIS rounds all times to one when it opens a project, and what arithmetic
#: adds (s).
RESOLUTION: Final = 0.51e-3
_OBSERVERS: Final = ("observer", "coder", "rater", "annotator", "author")
#: Lines in which the header is looked for; BORIS 7 has the observation above it.
_PREAMBLE: Final = 200
#: The columns that say START, STOP or POINT: of BORIS 7, and of later ones.
_STATUS: Final = frozenset(["status", "behavior type"])
#: What BORIS writes for a value that it does not know.
_NOTHING: Final = frozenset(["", "na", "nan", "none", "not found", "live"])

#: Subject, behavior and modifiers, between which a "|" stands.
_State = tuple[str, str, str]


@dataclass(slots=True)
class _ReadObservation:
    id: str
    observer: str = ""
    offset: float = 0.0  #: of its times to those of its media
    media: dict[str, float] = field(default_factory=dict)
    duration: float | None = None
    states: list[tuple[str, Segment]] = field(default_factory=list)  #: with their subjects
    #: where and when states started that have not stopped
    started: dict[_State, tuple[str, float]] = field(default_factory=dict)
    left_out: Counter[str] = field(default_factory=Counter)
    remarks: list[str] = field(default_factory=list)
    problem: str = ""  #: the first one, for which all of it is left out

    def add_event(self, where: str, state: _State, time: float, kind: str | None = None) -> None:
        """The start or stop of a state; in projects, which do not tell, it is what is due."""
        started = state in self.started
        if kind is None:
            kind = "STOP" if started else "START"
        if kind == "START" and not started:
            self.started[state] = where, time
        elif kind == "STOP" and started:
            self.add_state(where, state, self.started.pop(state)[1], time)
        elif kind in ("START", "STOP"):
            self.leave_out(_unpaired(where, state, time, "starts" if kind == "STOP" else "stops"))
        else:
            raise InputError(
                f"{where}: '{kind[:80]}' is neither START, STOP nor POINT; export it again."
            )

    def leave_out(self, problem: str) -> None:
        """Note a problem that the coder mends in BORIS; the first one is told."""
        self.problem = self.problem or problem

    def add_state(self, where: str, state: _State, start: float, end: float) -> None:
        """A state, its times as the file has them, with its modifiers in brackets."""
        subject, code, modifiers = state
        chosen = [part.strip() for part in modifiers.split("|")]
        chosen = [part for part in chosen if part.lower() not in ("", "none")]
        if chosen:
            self.remarks.append("Modifiers stand in brackets behind their behavior.")
        action = f"{code} ({', '.join(chosen)})" if chosen else code
        if means_unlabelled(action) or not action:
            return
        if end < start:
            self.leave_out(f"{where}: '{action[:80]}' ends before it starts; mend it in BORIS.")
            return
        if end == start:
            self.left_out["state without length"] += 1
            return
        segment = Segment(start - self.offset, end - self.offset, action)
        self.states.append((subject, segment))

    def add_media(
        self, files: Iterable[tuple[str, float]], offset: float = 0.0, player: str = "1"
    ) -> None:
        """Files, with their durations, that follow each other in a player."""
        start = 0.0
        for name, duration in files:
            # A path may be of another system.
            self.media.setdefault(PureWindowsPath(name).name, 0.0 - start - offset)
            if not duration:  # when the next ones begin is not known
                return
            start += duration
        if start and player == "1":
            self.duration = start

    def labels(self, path: Path, options: LabelOptions) -> LabelSet:
        for state, (where, start) in self.started.items():
            self.leave_out(_unpaired(where, state, start, "stops"))
        subjects = dict.fromkeys(subject for subject, _ in self.states)
        segments: dict[str, list[Segment]] = defaultdict(list)
        for subject, segment in self.states:
            if not self.observer:
                author = subject or options.author
            else:
                several = len(subjects) > 1 and subject
                author = f"{self.observer} - {subject}" if several else self.observer
            segments[author].append(segment)
        try:
            tracks = tuple(Track(author, tuple(parts)) for author, parts in segments.items())
        except InputError as error:
            self.leave_out(
                f"'{path}', observation '{self.id[:80]}': {error} Make the behaviors exclude each "
                f"other."
            )
        if self.problem:
            tracks = (Track(self.observer or options.author, ()),)
        name = self.id.removesuffix(f" - {self.observer}") if self.observer else self.id
        remarks = (
            *dict.fromkeys(self.remarks),
            *(f"{left_out(number, what)}." for what, number in self.left_out.items()),
        )
        return LabelSet(
            name, tracks, self.duration, remarks, self.media, RESOLUTION, problem=self.problem
        )


def sniff_labels(path: Path, head: bytes) -> bool:
    """Whether a file is a project of BORIS, or a table of its events."""
    if head.startswith(GZIP):
        return path.name.lower().endswith(".boris.gz")
    if head.lstrip().startswith(b"{"):
        return path.suffix.lower() == ".boris" or b'"project_format_version"' in head
    text = head.decode("utf-8", "replace") if b"\0" not in head else ""
    return _find_header(text) is not None


def read_labels(path: Path, options: LabelOptions) -> list[LabelSet]:
    """Read the observations that hold events; those of one name and clock are put together.

    One with a problem, such as a state that never stops, keeps no other from being read.
    """
    with path.open("rb") as stream:
        project = stream.read(64).lstrip().startswith((b"{", GZIP))
    observations = _read_project(path) if project else _read_events(path)
    sets: dict[tuple[object, ...], LabelSet] = {}
    for observation in observations:
        labels = observation.labels(path, options)
        key = labels.name, labels.duration, tuple(labels.media.items()), labels.problem
        if (known := sets.get(key)) is not None:
            remarks = tuple(dict.fromkeys((*known.remarks, *labels.remarks)))
            tracks = (*known.tracks, *labels.tracks)
            labels = replace(labels, tracks=tracks, remarks=remarks)
        sets[key] = labels
    problems = [labels.problem for labels in sets.values()]
    if problems and all(problems):
        raise InputError(problems[0])
    return list(sets.values())


def _read_project(path: Path) -> list[_ReadObservation]:
    root = read_json(path)
    kinds = {
        entry.member("code").text(): entry.member("type").text()
        for _, entry in root.member("behaviors_conf").members()
    }
    points = {code for code, kind in kinds.items() if kind.startswith("Point")}
    observations = []
    for id_, value in root.member("observations").members():
        content = JsonValue(value.value, f"'{path}', observation '{id_[:80]}'")
        events = content.member("events").items()
        if not events:
            continue
        variables = {
            name.strip().casefold(): variable.text() if isinstance(variable.value, str) else ""
            for name, variable in content.member("independent_variables").members()
        }
        observation = _ReadObservation(id_, _observer(variables))
        observations.append(observation)
        if content.member("type").text() == "IMAGES":
            observation.remarks.append("Events on pictures have no times and were left out.")
            continue
        observation.offset = content.member("time offset").number(0.0)
        _find_media(observation, content)
        for event in events:
            values = event.items()
            if len(values) < 3:
                raise event.unexpected("a time, a subject and a behavior")
            subject, code = values[1].text(), values[2].text()
            modifiers = values[3].text() if len(values) > 3 else ""
            if len(values) > 4 and values[4].text():
                observation.left_out["comment"] += 1
            if code in points:
                observation.left_out["point event"] += 1
                continue
            observation.add_event(event.where, (subject, code, modifiers), values[0].number())
    return observations


def _find_media(observation: _ReadObservation, content: JsonValue) -> None:
    """The media of an observation of a project: one after the other in each player."""
    information = content.member("media_info")
    lengths = information.member("length")
    media = content.member("file")
    if media.value == []:
        return  # a live observation of BORIS 7
    for player, files in media.members():
        names = [file.text() for file in files.items()]
        offset = information.member("offset").member(player).number(0.0)
        known = [(name, lengths.member(name).number(0.0)) for name in names]
        observation.add_media(known, offset, player)


def _read_events(path: Path) -> list[_ReadObservation]:
    """Read a table of tabular or aggregated events."""
    try:
        text = read_content(path).decode(encoding_of(path))
    except UnicodeDecodeError as error:
        raise InputError(f"'{path}' is no text ({error}); export it from BORIS again.") from error
    found = _find_header(text)
    if found is None:
        raise InputError(f"'{path}' has no header of BORIS' events; export it from BORIS again.")
    separator, names = found
    preamble: dict[str, str] = {}
    observations: dict[str, _ReadObservation] = {}
    header_seen = False
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            if not header_seen:
                header_seen = _names(row) == names
                if not header_seen and len(cells) > 1:
                    preamble.setdefault(cells[0].casefold(), cells[1])
            elif any(cells):
                where = f"'{path}', line {reader.line_num}"
                _read_event(path, where, names, cells, preamble, observations)
    except csv.Error as error:
        raise InputError(f"'{path}', line {reader.line_num}: {error}; export it again.") from error
    return list(observations.values())


def _read_event(
    path: Path,
    where: str,
    names: Sequence[str],
    cells: Sequence[str],
    preamble: Mapping[str, str],
    observations: dict[str, _ReadObservation],
) -> None:
    """Take one row of a table of events."""
    if len(cells) < len(names):
        raise InputError(
            f"{where} has {len(cells)} cells where {len(names)} are expected; export it again."
        )
    own = dict(zip(names, cells, strict=False))
    row = {**preamble, **own}
    id_ = row.get("observation id") or own_stem(path)
    observation = observations.get(id_)
    if observation is None:
        observation = observations[id_] = _ReadObservation(id_, _observer(row))
        _describe(observation, where, row)
    subject, code = row.get("subject", ""), row.get("behavior", row.get("behaviour", ""))
    subject = "" if subject == "No focal subject" else subject
    kind = next((row[name] for name in ("behavior type", "status") if name in row), "").upper()
    if any(row.get(name, "") for name in ("comment", "comment start", "comment stop")):
        observation.left_out["comment"] += 1
    if kind == "POINT":
        observation.left_out["point event"] += 1
        return
    modifiers = "|".join(cell for name, cell in own.items() if name.startswith("modif"))
    state = subject, code, modifiers
    if "time" in names:
        observation.add_event(where, state, _seconds(where, row, "time"), kind)
    else:
        start, end = (_seconds(where, row, name) for name in ("start (s)", "stop (s)"))
        observation.add_state(where, state, start, end)


def _describe(observation: _ReadObservation, where: str, row: Mapping[str, str]) -> None:
    """The time offset and the media that a row tells of its observation."""
    if row.get("time offset (s)", "").lower() not in _NOTHING:
        observation.offset = _seconds(where, row, "time offset (s)")
    files, durations = "", ""
    if source := re.match(r"player #1:([^|]*)", row.get("source", "")):
        files, durations = source[1], row.get("media duration (s)", "").partition("|")[0]
    else:
        columns = ("player #1", "media file", "media file path", "media file name")
        files = next((row[name] for name in columns if name in row), "")
        files = "" if files.lower() in _NOTHING else files
    names = files.split(";") if files else []
    lengths = [float(cell) if _NUMBER.fullmatch(cell) else 0.0 for cell in durations.split(";")]
    if len(lengths) != len(names):
        lengths = [0.0] * len(names)
    observation.add_media(zip(names, lengths, strict=True))
    if names and "time offset (s)" not in row:
        observation.remarks.append("No time offset stands in the file; none was assumed.")


_NUMBER = re.compile(r"[+-]?\d{1,15}(?:\.\d*)?(?:[eE][+-]?\d\d?)?", re.ASCII)


def _seconds(where: str, row: Mapping[str, str], name: str) -> float:
    """A time of a table."""
    cell = row.get(name, "")
    if not _NUMBER.fullmatch(cell):
        raise InputError(
            f"{where}: {cell[:40]!a} in column '{name}' is no time in seconds; export it from "
            f"BORIS again, with times in seconds."
        )
    return float(cell)


def _find_header(text: str) -> tuple[str, list[str]] | None:
    """The separator and the names, in lower case, of a table of events."""
    for row in islice(io.StringIO(text, newline=None), _PREAMBLE):
        for separator in "\t,;":
            if row.count(separator) < 3 or "Behavio" not in row or len(row) > 1 << 16:
                continue
            names = _names(next(csv.reader([row], delimiter=separator), []))
            known = {"behaviour" if name == "behavior" else name for name in names}
            aggregated = {"behaviour", "start (s)", "stop (s)"} <= known
            if aggregated or ({"behaviour", "time"} <= known and known & _STATUS):
                return separator, names
    return None


def _names(cells: Sequence[str]) -> list[str]:
    return [cell.strip(" \ufeff").casefold() for cell in cells]


def _observer(variables: Mapping[str, str]) -> str:
    return next((v for name in _OBSERVERS if (v := variables.get(name, "").strip())), "")


def _unpaired(where: str, state: _State, time: float, missing: str) -> str:
    return (
        f"{where}: '{state[1][:80]}' at {time:g} s never {missing}; pair the state events in BORIS "
        f"(Observations > Check state events)."
    )
