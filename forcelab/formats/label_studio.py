"""Label Studio: tasks to import there, and the labels of its exports (JSON and JSON-MIN).

A task is a demonstration: its forces as a time series, whose labels are in seconds, or its video,
whose labels are numbers of frames. These count ticks of the ``frameRate`` that the labelling
interface has, which is how Label Studio seeks: where that is the video's own they are its frames.
Labels of coders are annotations, those of models predictions.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path, PureWindowsPath
from typing import Any, Final
from urllib.parse import parse_qs, quote, unquote, urlsplit
from xml.etree import ElementTree as ET

from forcelab.clock import ClockMap
from forcelab.errors import InputError
from forcelab.formats.json_values import JsonValue, read_json
from forcelab.formats.label_files import LabelOptions, LabelSet, own_stem
from forcelab.formats.track_text import plain_times
from forcelab.labels import Segment, Track, is_model, means_unlabelled
from forcelab.text import left_out
from forcelab.vocabulary import Vocabulary

#: What the labelling interface calls its label control.
CONTROL: Final = "action"
#: The types of labels on forces and on videos, which are names of values of regions, too.
TIME_SERIES, TIMELINE = "timeserieslabels", "timelinelabels"
#: Before the author in the note of each region, which Label Studio keeps.
LABELLED_BY: Final = "labelled by "
#: Names of values of a task that hold frames a second.
_RATES: Final = ("framerate", "frame_rate", "fps")
#: Seconds, three years: no recording lasts as long, and times since 1970 are larger.
_LONGEST: Final = 1e8


def local_file(path: Path, folder: Path, project: Path) -> str:
    """The address of a file that lies in the tasks' `folder` or in a project.

    Label Studio serves it where its ``LOCAL_FILES_DOCUMENT_ROOT`` is the innermost folder that
    holds both.
    """
    parents = [folder.resolve().parent, project.resolve().parent]
    root = parents[0]
    while root not in (parents[1], *parents[1].parents) and root != root.parent:
        root = root.parent
    if root == root.parent:
        raise InputError(
            f"'{folder}' and the project have no folder in common, which Label Studio could be "
            f"given; export into a folder beside the project."
        )
    return f"/data/local-files/?d={quote(path.resolve().relative_to(root).as_posix())}"


def forces_task(
    title: str,
    task: str,
    csv: str,
    tracks: Iterable[Track],
    scores: Mapping[str, Sequence[float | None]],
) -> dict[str, Any]:
    """A task whose forces are in the table `csv`; `scores` are those of predictions, by author."""
    values = {
        track.author: [
            {"start": start, "end": end, "instant": False, TIME_SERIES: [segment.action]}
            for segment, (start, end) in plain_times(track)
        ]
        for track in tracks
    }
    data = {"demonstration": title, "task": task, "csv": csv}
    return _task(data, "forces", TIME_SERIES, values, scores)


def video_task(
    title: str,
    task: str,
    address: str,
    clock: ClockMap,
    fps: float,
    tracks: Iterable[Track],
    scores: Mapping[str, Sequence[float | None]],
) -> dict[str, Any]:
    """A task whose video is at an address; what begins before the video is cut off there."""
    values = {
        track.author: [
            {"ranges": [{"start": first, "end": last}], TIMELINE: [action]}
            for first, last, action in _frames(track, clock, fps)
        ]
        for track in tracks
    }
    data = {"demonstration": title, "task": task, "video": address, "framerate": fps}
    return _task(data, "video", TIMELINE, values, scores)


def _frames(track: Track, clock: ClockMap, fps: float) -> Iterator[tuple[int, int, str]]:
    """First and last frame of each segment, from 1; none shorter than a frame, none shared."""
    free = 1
    for segment in track.segments:
        start, end = (float(clock.to_device(time)) * fps for time in (segment.start, segment.end))
        if end <= 0:
            raise InputError(
                f"'{segment.action}' of {track.author} at {segment.start:g} s ends before the "
                f"video begins; export the forces as a time series, or delete it."
            )
        first = max(round(start) + 1, free)
        last = max(round(end), first)
        yield first, last, segment.action
        free = last + 1


def _task(
    data: dict[str, Any],
    shown: str,
    kind: str,
    values: Mapping[str, list[dict[str, Any]]],
    scores: Mapping[str, Sequence[float | None]],
) -> dict[str, Any]:
    """A task with the values of each author's regions, which are all of a kind."""
    annotations, predictions = [], []
    for number, (author, author_values) in enumerate(values.items(), start=1):
        result: list[dict[str, Any]] = [
            {
                "id": f"{number}-{i}",
                "from_name": CONTROL,
                "to_name": shown,
                "type": kind,
                "origin": "manual",
                "value": value,
            }
            for i, value in enumerate(author_values, start=1)
        ]
        if is_model(author):
            for region, score in zip_longest(result, scores.get(author, ())):
                region["origin"] = "prediction"
                if score is not None:
                    region["score"] = score
            predictions.append({"model_version": author, "result": result})
        else:
            for region in result:
                region["meta"] = {"text": [LABELLED_BY + author]}
            annotations.append({"result": result})
    return {"data": data, "annotations": annotations, "predictions": predictions}


def interface(
    tasks: Sequence[Mapping[str, Any]], channels: Sequence[str], vocabulary: Vocabulary
) -> bytes:
    """The labelling interface of tasks, to be pasted in; `channels` are columns of the forces."""
    used = dict.fromkeys(
        action
        for task in tasks
        for author in (*task["annotations"], *task["predictions"])
        for region in author["result"]
        for action in region["value"][region["type"]]
    )
    view = ET.Element("View")
    if channels:
        labels = ET.SubElement(view, "TimeSeriesLabels", name=CONTROL, toName="forces")
        series = ET.SubElement(
            view,
            "TimeSeries",
            name="forces",
            value="$csv",
            valueType="url",
            sep=",",
            timeColumn="time (s)",
            timeDisplayFormat=",.3f",
        )
        for channel in channels:
            ET.SubElement(series, "Channel", column=channel, legend=channel)
    else:
        ET.SubElement(view, "Video", name="video", value="$video", frameRate="$framerate")
        labels = ET.SubElement(view, "TimelineLabels", name=CONTROL, toName="video")
    for action in vocabulary.with_actions(*used):
        look = {"value": action.name, "background": action.colour}
        ET.SubElement(labels, "Label", look | ({"hotkey": action.key} if action.key else {}))
    ET.indent(view)
    written: bytes = ET.tostring(view, encoding="UTF-8")
    return written + b"\n"


_KEYWORDS = re.compile(
    rb'"(?:annotations|completions|predictions|timeserieslabels|timelinelabels|annotation_id)"\s*:'
)


def sniff_labels(path: Path, head: bytes) -> bool:
    """Whether a file is JSON with annotations as Label Studio exports them."""
    json = head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith((b"[", b"{"))
    return json and path.suffix.lower() != ".boris" and _KEYWORDS.search(head) is not None


def read_labels(path: Path, options: LabelOptions) -> list[LabelSet]:
    """Read the annotations of all tasks; predictions are left out."""
    root = read_json(path)
    tasks = [root] if isinstance(root.value, dict) else root.items()
    sets: dict[str, _TaskLabels] = {}
    for number, value in enumerate(tasks, start=1):
        task = JsonValue(value.value, f"'{path}', task {number}")
        # In JSON-MIN each annotation is a record, with the values of its task beside it.
        minimal = task.member("data").value is None
        data = task if minimal else task.member("data")
        name = _name(data, task, own_stem(path) if len(tasks) == 1 else f"task {number}")
        labels = sets.setdefault(name, _TaskLabels(name))
        if minimal:
            author = _person(task.member("annotator"), options)
            labels.add(author, _minimal_regions(task), data, task)
            continue
        for key in ("annotations", "completions"):
            for annotation in task.member(key).items():
                if annotation.member("was_cancelled").value or annotation.member("skipped").value:
                    labels.left_out["skipped annotation"] += 1
                    continue
                results = annotation.member("result").items()
                author = _author(results, _person(annotation.member("completed_by"), options))
                regions = [(r.member("type").text(), r.member("value")) for r in results]
                labels.add(author, regions, data, annotation)
        labels.left_out["prediction"] += sum(
            len(prediction.member("result").items())
            for prediction in task.member("predictions").items()
        )
    return [labels.finish() for labels in sets.values()]


class _TaskLabels:
    """The labels of one demonstration while they are read."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.left_out: Counter[str] = Counter()
        self._tracks: dict[str, tuple[str, Track]] = {}  # with when it was updated
        self._media: dict[str, float] = {}
        self._resolution = 1e-6

    def add(
        self,
        author: str,
        regions: Sequence[tuple[str, JsonValue]],
        data: JsonValue,
        annotation: JsonValue,
    ) -> None:
        """Take an annotation; of several by one author the latest."""
        segments = []
        for kind, value in regions:
            if kind == TIME_SERIES:
                spans = [(_seconds(value.member("start")), _seconds(value.member("end")))]
            elif kind == TIMELINE:
                spans = list(self._timeline(value, data))
            else:
                self.left_out[f"result of the type '{kind[:40]}'"] += 1
                continue
            names = [name.text().strip() for name in value.member(kind).items()]
            action = " + ".join(name for name in names if name)
            for span in spans:
                if not action or means_unlabelled(action):
                    self.left_out["region without label"] += 1
                elif span[0] == span[1]:
                    self.left_out["region without length"] += 1
                else:
                    segments.append((*span, action))
        try:
            track = Track(author, tuple(Segment(*segment) for segment in segments))
        except InputError as error:
            raise InputError(f"{annotation.where}: {error} Mend it in Label Studio.") from error
        when = annotation.member("updated_at").value or annotation.member("created_at").value or ""
        if author in self._tracks:
            self.left_out["earlier annotation"] += 1
        if author not in self._tracks or str(when) >= self._tracks[author][0]:
            self._tracks[author] = str(when), track

    def finish(self) -> LabelSet:
        tracks = tuple(track for _, track in self._tracks.values() if track.segments)
        remarks = tuple(
            f"{left_out(number, what)}." for what, number in self.left_out.items() if number
        )
        return LabelSet(self.name, tracks, None, remarks, self._media, self._resolution)

    def _timeline(self, value: JsonValue, data: JsonValue) -> Iterator[tuple[float, float]]:
        """The times of ranges of frames, both of which belong to them."""
        rate = next((r for key in _RATES if (r := data.member(key)).value is not None), None)
        if rate is None:
            raise InputError(
                f"{value.where} counts frames, and nothing tells how many there are a second; add "
                f"a value 'framerate' to the data of the task."
            )
        fps = float(rate.value) if _is_number(rate.value) else rate.number()
        if not 0 < fps < 1e6:
            raise rate.unexpected("a number of frames a second")
        self._resolution = 0.51 / fps  # half a frame, and what arithmetic adds
        if video := data.member("video").value:
            self._media[_file_name(str(video))] = 0.0
        for span in value.member("ranges").items():
            first, last = span.member("start").number(), span.member("end").number()
            yield (first - 1) / fps, last / fps


def _minimal_regions(record: JsonValue) -> list[tuple[str, JsonValue]]:
    """The regions of a record of JSON-MIN: lists of objects that name labels."""
    lists = [value.items() for _, value in record.members() if isinstance(value.value, list)]
    regions = [region for each in lists for region in each if isinstance(region.value, dict)]
    kinds = (TIME_SERIES, TIMELINE)
    return [(kind, region) for region in regions for kind in kinds if kind in region.value]


def _author(results: Sequence[JsonValue], person: str) -> str:
    """Whose labels we wrote, if all regions still say so; else who annotated."""
    notes = [result.member("meta").member("text") for result in results]
    firsts = {n.items()[0].text() if isinstance(n.value, list) and n.value else "" for n in notes}
    other, _, author = firsts.pop().partition(LABELLED_BY) if len(firsts) == 1 else ("", "", "")
    return author if author and not other else person


def _person(value: JsonValue, options: LabelOptions) -> str:
    """An annotator: an address, or a number."""
    person = value.value
    if isinstance(person, dict):
        person = next((person[key] for key in ("email", "username", "id") if person.get(key)), None)
    if isinstance(person, str):
        return person.strip() or options.author
    if isinstance(person, int) and 0 < person < 10**18:
        return f"annotator {person}"
    return options.author


def _name(data: JsonValue, task: JsonValue, otherwise: str) -> str:
    """What a task calls its demonstration: as we do, else as its file."""
    title = data.member("demonstration").value
    if title and isinstance(title, str):
        return title
    values = [data.member("csv"), data.member("video"), task.member("file_upload")]
    values += [value for _, value in data.members()]
    names = (_file_name(value.value) for value in values if isinstance(value.value, str))
    return next((own_stem(name) for name in names if re.search(r"\.\w{2,8}$", name)), otherwise)


def _file_name(address: str) -> str:
    """The name of the file at an address, without the digits that uploading put before it."""
    try:
        parts = urlsplit(address)
        served = parse_qs(parts.query).get("d", [unquote(parts.path)])[0]
    except ValueError:
        return ""
    return re.sub(r"^[0-9a-f]{8}-", "", PureWindowsPath(served).name)


def _is_number(value: object) -> bool:
    """Whether a text is a number, as values of tables are imported."""
    return isinstance(value, str) and bool(re.fullmatch(r"-?\d{1,15}(?:\.\d{0,20})?", value))


def _seconds(value: JsonValue) -> float:
    """A time of a time series, which may be a text."""
    is_text = isinstance(value.value, str)
    if is_text and not _is_number(value.value):
        raise InputError(
            f"{value.where} is {value.value[:40]!a}, no number of seconds; export with times as "
            f"numbers from the start (no timeFormat)."
        )
    seconds = float(value.value) if is_text else value.number()
    if abs(seconds) > _LONGEST:
        raise InputError(
            f"{value.where} is {seconds:.15g}, a time since 1970; label a table whose times are "
            f"seconds from the start."
        )
    return seconds
