"""Labels of BORIS 7 to 10: its projects, and its exports of tabular and of aggregated events.

An observation's times are those of its media plus its time offset. State events become segments;
point events have no length and are left out. The author is the independent variable "observer"
(or coder, rater, annotator, author), else the subject.
"""

from __future__ import annotations

import csv
import io
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path, PureWindowsPath
from typing import Final

from forcelab.errors import InputError
from forcelab.formats.json_values import GZIP, LARGEST, JsonValue, read_json
from forcelab.formats.label_files import LabelOptions, LabelSet, own_stem
from forcelab.formats.table_sniff import encoding_of
from forcelab.labels import Segment, Track, means_unlabelled
from forcelab.text import left_out

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


@dataclass(slots=True)
class _Observation:
    """What is read of one observation."""

    id: str
    observer: str = ""
    offset: float = 0.0  #: of its times to those of its media
    media: dict[str, float] = field(default_factory=dict)
    duration: float | None = None
    states: list[tuple[str, Segment]] = field(default_factory=list)  #: with their subjects
    left_out: Counter[str] = field(default_factory=Counter)
    remarks: list[str] = field(default_factory=list)

    def add(self, where: str, subject: str, action: str, start: float, end: float) -> None:
        """A state, its times as the file has them."""
        if means_unlabelled(action) or not action:
            return
        if end < start:
            raise InputError(f"{where}: '{action[:80]}' ends before it starts; mend it in BORIS.")
        if end == start:
            self.left_out["state without length"] += 1
            return
        segment = Segment(start - self.offset, end - self.offset, action)
        self.states.append((subject, segment))

    def labels(self, path: Path, options: LabelOptions) -> LabelSet:
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
            raise InputError(
                f"'{path}', observation '{self.id[:80]}': {error} Make the behaviors exclude each "
                f"other."
            ) from error
        name = self.id.removesuffix(f" - {self.observer}") if self.observer else self.id
        remarks = (
            *dict.fromkeys(self.remarks),
            *(f"{left_out(number, what)}." for what, number in self.left_out.items()),
        )
        return LabelSet(name, tracks, self.duration, remarks, self.media, RESOLUTION)


def sniff_labels(path: Path, head: bytes) -> bool:
    """Whether a file is a project of BORIS, or a table of its events."""
    if head.startswith(GZIP):
        return path.name.lower().endswith(".boris.gz")
    if head.lstrip().startswith(b"{"):
        return path.suffix.lower() == ".boris" or b'"project_format_version"' in head
    text = head.decode("utf-8", "replace") if b"\0" not in head else ""
    return _find_header(text) is not None


def read_labels(path: Path, options: LabelOptions) -> list[LabelSet]:
    """Read the observations that hold events; those of one name and clock are put together."""
    with path.open("rb") as stream:
        project = stream.read(64).lstrip().startswith((b"{", GZIP))
    observations = _read_project(path) if project else _read_events(path)
    sets: dict[tuple[object, ...], LabelSet] = {}
    for observation in observations:
        labels = observation.labels(path, options)
        key = labels.name, labels.duration, tuple(labels.media.items())
        if (known := sets.get(key)) is not None:
            remarks = tuple(dict.fromkeys((*known.remarks, *labels.remarks)))
            tracks = (*known.tracks, *labels.tracks)
            labels = replace(labels, tracks=tracks, remarks=remarks)
        sets[key] = labels
    return list(sets.values())


def _read_project(path: Path) -> list[_Observation]:
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
        observation = _Observation(id_, _observer(variables))
        observations.append(observation)
        if content.member("type").text() == "IMAGES":
            observation.remarks.append("Events on pictures have no times and were left out.")
            continue
        observation.offset = content.member("time offset").number(0.0)
        _find_media(observation, content)
        open_states: dict[tuple[str, ...], float] = {}
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
            time, key = values[0].number(), (subject, code, modifiers)
            if key not in open_states:
                open_states[key] = time
                continue
            action = _action(observation, code, modifiers.split("|"))
            observation.add(event.where, subject, action, open_states.pop(key), time)
        for (_, code, _), start in open_states.items():
            raise _unpaired(content.where, code, start, "stops")
    return observations


def _find_media(observation: _Observation, content: JsonValue) -> None:
    """The media of an observation of a project: one after the other in each player."""
    information = content.member("media_info")
    lengths = information.member("length")
    for player, files in content.member("file").members():
        names = [file.text() for file in files.items()]
        durations = [lengths.member(name).number(0.0) for name in names]
        offset = information.member("offset").member(player).number(0.0)
        _add_media(observation, names, durations, offset)
        if player == "1" and durations and all(durations):
            observation.duration = sum(durations)


def _add_media(
    observation: _Observation, names: Sequence[str], durations: Sequence[float], offset: float
) -> None:
    """Files that follow each other in a player, as far as is known when they begin."""
    start = 0.0
    for name, duration in zip(names, durations, strict=False):
        # A path may be of another system.
        observation.media.setdefault(PureWindowsPath(name).name, 0.0 - start - offset)
        if not duration:
            break
        start += duration


def _read_events(path: Path) -> list[_Observation]:
    """Read a table of tabular or aggregated events."""
    with path.open("rb") as stream:
        content = stream.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise InputError(f"'{path}' is longer than {LARGEST >> 20} MB; export it in parts.")
    try:
        text = content.decode(encoding_of(path))
    except UnicodeDecodeError as error:
        raise InputError(f"'{path}' is no text ({error}); export it from BORIS again.") from error
    found = _find_header(text)
    if found is None:
        raise InputError(f"'{path}' has no header of BORIS' events; export it from BORIS again.")
    separator, names = found
    preamble: dict[str, str] = {}
    observations: dict[str, _Observation] = {}
    open_states: dict[tuple[str, ...], tuple[str, float]] = {}
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
                _read_event(path, where, names, cells, preamble, observations, open_states)
    except csv.Error as error:
        raise InputError(f"'{path}', line {reader.line_num}: {error}; export it again.") from error
    for (_, _, code, _), (where, start) in open_states.items():
        raise _unpaired(where, code, start, "stops")
    return list(observations.values())


def _read_event(
    path: Path,
    where: str,
    names: Sequence[str],
    cells: Sequence[str],
    preamble: Mapping[str, str],
    observations: dict[str, _Observation],
    open_states: dict[tuple[str, ...], tuple[str, float]],
) -> None:
    """Take one row of a table of events."""
    if len(cells) < len(names):
        raise InputError(
            f"{where} has {len(cells)} cells where {len(names)} are expected; export it again."
        )
    row = {**preamble, **dict(zip(names, cells, strict=False))}
    id_ = row.get("observation id") or own_stem(path)
    observation = observations.get(id_)
    if observation is None:
        observation = observations[id_] = _Observation(id_, _observer(row))
        _describe(observation, where, row)
    subject, code = row.get("subject", ""), row.get("behavior", row.get("behaviour", ""))
    subject = "" if subject == "No focal subject" else subject
    kind = next((row[name] for name in ("behavior type", "status") if name in row), "").upper()
    if any(row.get(name, "") for name in ("comment", "comment start", "comment stop")):
        observation.left_out["comment"] += 1
    if kind == "POINT":
        observation.left_out["point event"] += 1
        return
    modifiers = [
        cell for name, cell in zip(names, cells, strict=False) if name.startswith("modif") and cell
    ]
    modifiers = [part for cell in modifiers for part in cell.split("|")]
    action = _action(observation, code, modifiers)
    if "time" not in names:
        start, end = (_seconds(where, row, name) for name in ("start (s)", "stop (s)"))
        observation.add(where, subject, action, start, end)
        return
    time, key = _seconds(where, row, "time"), (id_, subject, code, "|".join(modifiers))
    if kind == "START" and key not in open_states:
        open_states[key] = where, time
    elif kind == "STOP" and key in open_states:
        observation.add(where, subject, action, open_states.pop(key)[1], time)
    elif kind in ("START", "STOP"):
        raise _unpaired(where, code, time, "starts" if kind == "STOP" else "stops")
    else:
        raise InputError(
            f"{where}: '{kind[:80]}' is neither START, STOP nor POINT; export it again."
        )


def _describe(observation: _Observation, where: str, row: Mapping[str, str]) -> None:
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
    _add_media(observation, names, lengths, 0.0)
    if names and all(lengths):
        observation.duration = sum(lengths)
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


def _action(observation: _Observation, code: str, modifiers: Iterable[str]) -> str:
    """A behavior, with its modifiers in brackets."""
    chosen = [part.strip() for part in modifiers if part.strip().lower() not in ("", "none")]
    if not chosen:
        return code
    observation.remarks.append("Modifiers stand in brackets behind their behavior.")
    return f"{code} ({', '.join(chosen)})"


def _unpaired(where: str, code: str, time: float, missing: str) -> InputError:
    return InputError(
        f"{where}: '{code[:80]}' at {time:g} s never {missing}; pair the state events in BORIS "
        f"(Observations > Check state events)."
    )
