"""Writing the labels of a project, or all of it, into a folder."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Collection, Generator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO, Final, Literal

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.formats.archive import write_archive
from forcelab.formats.boris import Observation, to_boris
from forcelab.formats.elan import to_elan, to_time_series, write_time_series
from forcelab.formats.label_studio import forces_task, interface, local_file, video_task
from forcelab.formats.lerobot_subtasks import writing_subtasks
from forcelab.formats.output_folder import file_names, output_folder, stay_out_of_projects
from forcelab.formats.samples import SAMPLES, Prediction, SampleTable
from forcelab.formats.textgrid import to_textgrid
from forcelab.formats.track_text import AnnotatedTrack, to_audacity, to_csv, to_statistics_table
from forcelab.io import atomic_file, write_atomically
from forcelab.jobs import Progress
from forcelab.labels import Track
from forcelab.project import DemonstrationInfo, Project
from forcelab.text import unknown_word
from forcelab.video.index import stated_rate_and_length
from forcelab.vocabulary import Vocabulary, joined


@dataclass(frozen=True, slots=True)
class Part:
    """Tracks of one demonstration, all that are written or one of them."""

    project: Project
    info: DemonstrationInfo
    tracks: tuple[Track, ...]
    title: str  #: what the demonstration, or the track, is called
    folder: Path  #: where its file will lie
    prediction: Prediction | None = None  #: for formats that hold some
    stem: str = ""  #: the title as the name of a file, which no other part has

    def demonstration(self) -> Demonstration:
        """What was recorded, loaded anew each time: its arrays are open files."""
        return self.project.demonstrations.load(self.info.id)


#: Gives what is predicted in a project, by the demonstrations' ids.
Predictions = Callable[[Project], Mapping[str, Prediction]]
#: Writes a file that may be too long for the memory.
StreamWriter = Callable[[BinaryIO], None]


@dataclass(frozen=True, slots=True)
class ExportFormat:
    """What labels can be written as; command line and window offer what :data:`FORMATS` holds."""

    label: str  #: in the window
    #: What a file is made of; "dataset": the labels go into what was imported.
    per: Literal["demonstration", "track", "project", "dataset"]
    #: A file's bytes, or a StreamWriter; items, where there is a `join`; None: the project is
    #: archived.
    convert: Callable[[Part], Any] | None = None
    #: Makes a project's files of all items: their bytes by what their names end in.
    join: Callable[[Project, list[Any]], dict[str, bytes]] | None = None
    suffix: str = ""  #: of each file that is not joined
    prints: bool = True  #: whether a single file may go to standard output
    binary: bool = False  #: whether a file is no text
    #: Further files for each part, by what their names end in.
    beside: tuple[tuple[str, Callable[[Part], Any]], ...] = ()
    predictions: bool = False  #: whether it holds what runs predict, too
    unlabelled: bool = False  #: whether demonstrations without labels are written, too
    #: Formats of a kind stand together in the window: tables, those of a program, and the rest.
    group: Literal["table", "program", "whole"] = "program"


def _statistics_rows(part: Part) -> list[AnnotatedTrack]:
    kinds = {author.name: author.kind for author in part.project.coding.authors()}
    info = part.info
    rows = []
    for track in part.tracks:
        origins = part.project.tracks.origins(info.id, track.author)
        proposers = {segment: origin.proposer for segment, origin in origins.items()}
        kind = kinds.get(track.author, "coder")
        rows.append(AnnotatedTrack(info.name, info.task, info.duration, kind, track, proposers))
    return rows


#: What the names of an ELAN file's time series end in; ELAN knows the second one by it.
FORCES, SERIES = "_forces.csv", "_tsconf.xml"


def _elan(part: Part) -> bytes:
    return to_elan(
        part.tracks,
        part.demonstration().videos,
        part.folder,
        part.project.actions.vocabulary(part.info.task).names,
        (f"{part.stem}{FORCES}", f"{part.stem}{SERIES}"),
    )


def _elan_series(part: Part) -> bytes:
    return to_time_series(part.demonstration(), part.folder / f"{part.stem}{FORCES}")


def _elan_forces(part: Part) -> StreamWriter:
    return lambda stream: write_time_series(part.demonstration(), stream)


def _observations(part: Part) -> list[Observation]:
    """Tracks with what else is known of how they were observed: the video, and when."""
    project, info = part.project, part.info
    videos = part.demonstration().videos if info.has_video else ()
    observations = []
    for track in part.tracks:
        edits = project.tracks.history(info.id, track.author)
        begun = next((edit.time for edit in edits), None)
        observations.append(Observation(part.title, info.task, track, videos, begun))
    return observations


def _boris(project: Project, observations: list[Observation]) -> dict[str, bytes]:
    vocabulary = _vocabulary(project, {observation.task for observation in observations})
    return {".boris": to_boris(project.path.resolve().stem, observations, vocabulary)}


def _vocabulary(project: Project, tasks: Collection[str]) -> Vocabulary:
    """The keys and colours of the tasks that are written, not those of other tasks."""
    all_tasks = project.actions.vocabularies()
    return joined({task: words for task, words in all_tasks.items() if task in tasks})


def _tracks_and_prediction(part: Part) -> tuple[list[Track], dict[str, list[float | None]]]:
    """All tracks, what is predicted as one of them, with how probable its segments are."""
    prediction = part.prediction
    if prediction is None:
        return list(part.tracks), {}
    tracks = [track for track in part.tracks if track.author != prediction.author]
    scores: list[float | None] = []
    for segment in prediction.segments:
        score = prediction.probability(segment)
        scores.append(None if score is None else round(score, 4))
    return [*tracks, Track(prediction.author, prediction.segments)], {prediction.author: scores}


def _forces_task(part: Part) -> list[tuple[dict[str, Any], tuple[str, ...]]]:
    """A task, with the columns of its table of forces."""
    csv = local_file(part.folder / f"{part.stem}{FORCES_OF_TASK}", part.folder, part.project.path)
    task = forces_task(part.title, part.info.task, csv, *_tracks_and_prediction(part))
    return [(task, SampleTable(part.demonstration(), (), None).columns[1:])]


def _video_task(part: Part) -> list[tuple[dict[str, Any], tuple[str, ...]]]:
    """A task on the first video; none where there is no video."""
    videos = part.demonstration().videos
    if not videos:
        return []
    video = videos[0]
    fps, _ = stated_rate_and_length(video.path)
    if not fps:
        raise InputError(f"The video '{video.path}' does not say its frame rate; encode it anew.")
    address = local_file(video.path, part.folder, part.project.path)
    shown = _tracks_and_prediction(part)
    return [(video_task(part.title, part.info.task, address, video.clock, fps, *shown), ())]


#: What the names of the tables end in that tasks of Label Studio show.
FORCES_OF_TASK = ".forces.csv"


def _tasks(
    project: Project, items: list[tuple[dict[str, Any], tuple[str, ...]]]
) -> dict[str, bytes]:
    """The tasks, and the labelling interface to show them in."""
    if not items:
        raise InputError("None of the demonstrations has a video; attach one, or export forces.")
    tasks = [task for task, _ in items]
    channels = [name for name in items[0][1] if all(name in own for _, own in items)]
    if items[0][1] and not channels:
        raise InputError(
            "The demonstrations have no channel in common, and Label Studio shows the same "
            "channels of all; export those that have the same at a time."
        )
    vocabulary = _vocabulary(project, {task["data"]["task"] for task in tasks})
    return {
        ".label-studio.json": json.dumps(tasks, indent=1).encode(),
        ".label-studio.xml": interface(tasks, channels, vocabulary),
    }


def _samples(part: Part, write: Callable[[SampleTable, BinaryIO], None]) -> StreamWriter:
    """Writes a table of samples, once it is known that it can be."""

    def table() -> SampleTable:
        return SampleTable(part.demonstration(), part.tracks, part.prediction)

    table()
    return lambda stream: write(table(), stream)


def _forces_table(part: Part) -> StreamWriter:
    return _samples(replace(part, tracks=(), prediction=None), SampleTable.write_csv)


FORMATS: Final[dict[str, ExportFormat]] = {
    "table": ExportFormat(
        "CSV for statistics: one table of all, one row per segment",
        "project",
        _statistics_rows,
        lambda _project, rows: {".segments.csv": to_statistics_table(rows).encode()},
        group="table",
    ),
    "csv": ExportFormat(
        "CSV: one file per demonstration, one row per segment",
        "demonstration",
        lambda part: to_csv(part.tracks).encode(),
        suffix=".labels.csv",  # not .csv: that is what recordings are called
        group="table",
    ),
    "samples": ExportFormat(
        "CSV with forces: one row per sample, labels and predictions beside",
        "demonstration",
        lambda part: _samples(part, SampleTable.write_csv),
        suffix=f"{SAMPLES}.csv",
        predictions=True,
        unlabelled=True,
        group="table",
    ),
    "parquet": ExportFormat(
        "Parquet with forces: one row per sample, labels and predictions beside",
        "demonstration",
        lambda part: _samples(part, SampleTable.write_parquet),
        suffix=f"{SAMPLES}.parquet",
        binary=True,
        predictions=True,
        unlabelled=True,
        group="table",
    ),
    "elan": ExportFormat(
        "ELAN: one file per demonstration, one tier per coder, with videos and forces",
        "demonstration",
        _elan,
        suffix=".eaf",
        prints=False,  # the links to videos start from the file's folder
        beside=((FORCES, _elan_forces), (SERIES, _elan_series)),
    ),
    "textgrid": ExportFormat(
        "TextGrid of Praat: one file per demonstration, one tier per coder",
        "demonstration",
        lambda part: to_textgrid(part.tracks, part.info.duration),
        suffix=".TextGrid",
    ),
    "boris": ExportFormat(
        "BORIS: one project, one observation per coder and demonstration",
        "project",
        _observations,
        _boris,
    ),
    "label-studio": ExportFormat(
        "Label Studio: forces as time series, labels and predictions on them",
        "project",
        _forces_task,
        _tasks,
        prints=False,
        beside=((FORCES_OF_TASK, _forces_table),),
        predictions=True,
    ),
    "label-studio-video": ExportFormat(
        "Label Studio: videos with timelines of labels and predictions",
        "project",
        _video_task,
        _tasks,
        prints=False,
        predictions=True,
    ),
    "audacity": ExportFormat(
        "Audacity: one label track per coder and demonstration",
        "track",
        lambda part: to_audacity(part.tracks[0]).encode(),
        suffix=".txt",
    ),
    "lerobot": ExportFormat(
        "LeRobot: subtasks of all frames, into the dataset that was imported",
        "dataset",
        prints=False,
        group="whole",
    ),
    "archive": ExportFormat(
        "Archive: the whole project as one file, to be imported again",
        "project",
        suffix=".zip",
        binary=True,
        group="whole",
    ),
}


def exporting(
    path: Path,
    out: Path,
    format_: str,
    ids: Collection[str] | None = None,
    viewer: str | None = None,
    replacing: bool = True,
    authors: Collection[str] | None = None,
    predictions: Predictions | None = None,
) -> Generator[Progress, None, tuple[Path, ...]]:
    """Write labels into a folder, which is made if need be, as a job; gives the files.

    Only labels of the demonstrations `ids` and the `authors`, and without tracks that are hidden
    from the coder `viewer`. An archive holds everything, and is refused where anything is hidden.
    Formats that hold predictions get those that `predictions` gives, unless `authors` are chosen.
    """
    if format_ not in FORMATS:
        raise InputError(unknown_word("format", format_, tuple(FORMATS)))
    chosen = FORMATS[format_]
    with Project.open(path) as project:
        if chosen.convert is None and chosen.per == "project":
            file = out / f"{project.path.resolve().stem}{chosen.suffix}"
            return (yield from _archive(project, file, viewer, replacing))
        predicted: Mapping[str, Prediction] = {}
        if predictions is not None and chosen.predictions and authors is None:
            predicted = predictions(project)
        unlabelled = chosen.unlabelled and authors is None
        parts = _parts(project, out, ids, viewer, authors, predicted, unlabelled)
        if not parts:
            if ids is not None or authors is not None:
                raise InputError("What was chosen has no labels; export more, or label it first.")
            raise InputError(f"'{project.path}' has no labels to export; label something first.")
        if chosen.per == "dataset":
            return (yield from _subtasks(project, out, parts, strict=ids is not None))
        return (yield from _labels(project, out, chosen, parts, replacing))


def _archive(
    project: Project, file: Path, viewer: str | None, replacing: bool
) -> Generator[Progress, None, tuple[Path, ...]]:
    if viewer is not None and project.coding.blind_to(viewer):
        raise InputError(
            f"An archive holds everybody's labels, and some are hidden from '{viewer}' until "
            f"blind coding is done; export tracks instead."
        )
    _check_free([file], replacing)
    with output_folder(file.parent, [project.path]):
        yield Progress(0, 1, file.name)
        write_archive(project, file)
    return (file,)


def _subtasks(
    project: Project, dataset: Path, parts: list[Part], *, strict: bool
) -> Generator[Progress, None, tuple[Path, ...]]:
    place = dataset.resolve()
    stay_out_of_projects(dataset, place)
    if place in project.path.resolve().parents:
        raise InputError(f"The project lies in '{dataset}', which is replaced; move it elsewhere.")
    for part in parts:
        if len(part.tracks) > 1:
            names = ", ".join(track.author for track in part.tracks)
            raise InputError(
                f"'{part.info.name}' was labelled by {names}, and a frame has one subtask; choose "
                f"one of them (--author)."
            )
    labelled = [(part.info, part.tracks[0].segments) for part in parts]
    return (yield from writing_subtasks(dataset, labelled, strict))


def _parts(
    project: Project,
    out: Path,
    ids: Collection[str] | None,
    viewer: str | None,
    authors: Collection[str] | None,
    predicted: Mapping[str, Prediction],
    unlabelled: bool,
) -> list[Part]:
    """The tracks to write, and what is predicted, by demonstration, perhaps without either."""
    author_names = [author.name for author in project.coding.authors()]
    for name in authors or ():
        if name not in author_names:
            cure = f"choose from {', '.join(author_names)}" if author_names else "nobody did yet"
            raise InputError(f"Nobody called '{name}' labelled here; {cure}.")
    infos = project.demonstrations.infos()
    times = Counter(info.name.casefold() for info in infos)
    parts = []
    for info in infos:
        if ids is not None and info.id not in ids:
            continue
        hidden = viewer is not None and project.coding.is_blind(info.id, viewer)
        prediction = None if hidden else predicted.get(info.id)
        tracks = tuple(
            track
            for track in project.tracks.of(info.id)
            if (not hidden or track.author == viewer)
            and (authors is None or track.author in authors)
        )
        # Its name alone where no other has it: beside its recording, it is read with that.
        unique = not info.task or times[info.name.casefold()] == 1
        title = info.name if unique else f"{info.task} - {info.name}"
        if tracks or prediction or unlabelled:
            parts.append(Part(project, info, tracks, title, out, prediction))
    return parts


def _labels(
    project: Project, out: Path, format_: ExportFormat, parts: list[Part], replacing: bool
) -> Generator[Progress, None, tuple[Path, ...]]:
    """Write labels as one file, or one for each demonstration or track."""
    if format_.per == "track":
        parts = [
            Part(project, part.info, (track,), f"{part.title} - {track.author}", out)
            for part in parts
            for track in part.tracks
        ]
    stems = file_names([part.title for part in parts])
    parts = [replace(part, stem=stem) for part, stem in zip(parts, stems, strict=True)]
    contents: dict[Path, Any] = {}
    items: list[Any] = []
    convert, join = format_.convert, format_.join
    suffixes = [suffix for suffix, _ in format_.beside] + [format_.suffix] * (join is None)
    _check_free([out / f"{p.stem}{suffix}" for p in parts for suffix in suffixes], replacing)
    assert convert is not None  # archives are written by _archive
    for done, part in enumerate(parts):
        file = out / f"{part.stem}{format_.suffix}"
        yield Progress(done, len(parts), part.info.name if join else file.name)
        try:
            content = convert(part)
        except InputError as error:
            raise InputError(f"'{part.info.name}': {error}") from error
        if join is None:
            contents[file] = content
        else:
            items += content
    if join is not None:
        (stem,) = file_names([project.path.resolve().stem])
        files = join(project, items)
        contents = {out / f"{stem}{suffix}": text for suffix, text in files.items()}
        _check_free(contents, replacing)
    for suffix, make in format_.beside:
        contents |= {out / f"{part.stem}{suffix}": make(part) for part in parts}
    # All were made before: what a format cannot hold leaves no half of an export.
    with output_folder(out, [project.path]):
        for done, (file, content) in enumerate(contents.items()):
            if not callable(content):
                write_atomically(file, content)
                continue
            yield Progress(done, len(contents), file.name)
            with atomic_file(file) as stream:
                content(stream)
    return tuple(contents)


def _check_free(files: Collection[Path], replacing: bool) -> None:
    """Refuse to replace files unless that was asked for."""
    existing = [] if replacing else [file for file in files if file.exists()]
    if existing:
        raise InputError(
            f"'{existing[0].name}' is in '{existing[0].parent}' already; choose an empty folder, "
            "or overwrite existing files."
        )
