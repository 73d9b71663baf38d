"""What a project holds and what was evaluated, as tables for a script or a notebook.

A table is a data frame of pandas where that is installed, else a dictionary of NumPy arrays under
the same names. Nothing else in forcelab needs pandas.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.formats.recording import Recording
from forcelab.formats.samples import LABELS_OF
from forcelab.labels import Segment, Track, model_author, to_codes
from forcelab.project import Origin, Project
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.intervals import Intervals
from forcelab.recognition.metrics import METRICS, look_up
from forcelab.recognition.results import Evaluation
from forcelab.review.run_result import RunResult
from forcelab.text import unknown_word

if TYPE_CHECKING:
    from pandas import DataFrame

#: Whose the labels of a `LabelledDemonstration` are called, which does not tell.
CODER = "coder"
#: What holds labels without being a project.
Labels = Iterable[Recording | LabelledDemonstration | Track]


def segments_frame(
    source: Project | RunResult | Evaluation | Labels,
    *,
    task: str | None = None,
    author: str | None = None,
) -> DataFrame:
    """Segments, a row each.

    Parameters
    ----------
    source : Project, RunResult, Evaluation or iterable of Recording, LabelledDemonstration or Track
        All tracks of a project; what a run or an evaluation compared and, of a run, proposed; or
        what was read or made otherwise.
    task, author : str, optional
        Only what is of this task and by this author.

    Returns
    -------
    pandas.DataFrame, or dict of str to ndarray without pandas
        ``task``, ``demonstration``, ``author``, ``start`` and ``end`` (s), ``action``,
        ``proposed_by`` (the model whose prediction a coder accepted; None for what is the coder's
        own) and ``changed`` (whether that was changed by hand since).

    Raises
    ------
    InputError
        If the project has no such task or author.

    Examples
    --------
    >>> frame = forcelab.segments_frame(project, task="foam", author="Ada")
    >>> list(frame["action"])[:3]
    ['still', 'grab', 'hold']
    """
    rows: list[tuple[str, str, str, float, float, str, str | None, bool]] = []
    for of_task, name, track, origins in _tracks(source, task, author):
        chosen = task in (None, of_task) and author in (None, track.author)
        for segment in track.segments if chosen else ():
            origin = origins.get(segment)
            proposed = (None, False) if origin is None else (origin.proposer, origin.changed)
            edges = (segment.start, segment.end, segment.action)
            rows.append((of_task, name, track.author, *edges, *proposed))
    types = {"task": object, "demonstration": object, "author": object, "start": float,
             "end": float, "action": object, "proposed_by": object, "changed": bool}  # fmt: skip
    return _frame_of_rows(rows, types)


def samples_frame(
    source: Project | Recording | LabelledDemonstration | Demonstration,
    tracks: Iterable[Track] = (),
    *,
    task: str | None = None,
    demonstration: str | None = None,
    author: str | None = None,
) -> DataFrame:
    """Samples, a row each, with the action that each author saw there.

    :meth:`Demonstration.from_frame` and :func:`read_frame` are the inverse.

    Parameters
    ----------
    source : Project, Recording, LabelledDemonstration or Demonstration
        Of a project all demonstrations that are chosen, one below the other; a channel that one of
        them lacks is NaN there.
    tracks : iterable of Track
        Labels besides those that the source has.
    task, demonstration : str, optional
        Of a project, only what is of this task, and only this one by name or id.
    author : str, optional
        Only the labels of this author.

    Returns
    -------
    pandas.DataFrame, or dict of str to ndarray without pandas
        ``time`` (s), a column each channel and author (``labels of NAME``; None where unlabelled),
        of a project ``task`` and ``demonstration`` before them. Units are in
        ``frame.attrs["units"]``.

    Raises
    ------
    InputError
        If there is no such task, demonstration or author, or a channel is called like another
        column.

    Examples
    --------
    >>> id_ = project.demonstrations.id_of("foam 01")
    >>> frame = forcelab.samples_frame(project.demonstrations.load(id_), project.tracks.of(id_))
    >>> list(frame)
    ['time', 'fx1', 'fy1', 'fz1', 'fx2', 'fy2', 'fz2', 'labels of Ada', 'labels of Bo']
    """
    if isinstance(source, Project):
        _check(source, task, author)
        infos = source.demonstrations.infos(task)
        keys = [info.id for info in infos if demonstration in (None, info.name)]
        if demonstration is not None and len(keys) != 1:  # an id, or what cannot be told apart
            keys = [source.demonstrations.id_of(demonstration)]
        given = [(source.demonstrations.load(key), source.tracks.of(key)) for key in keys]
    else:
        given = [_labelled(source)]
    parts = [
        (recording, [t for t in (*own, *tracks) if author in (None, t.author)])
        for recording, own in given
    ]
    if not parts:
        raise InputError("There are no demonstrations of which to give samples; import some first.")
    channels = {c.name: c.unit for recording, _ in parts for c in recording.channels}
    authors = {f"{LABELS_OF}{t.author}": t.author for _, used in parts for t in used}
    first = ("task", "demonstration", "time") if isinstance(source, Project) else ("time",)
    if twice := set(channels) & {*first, *authors}:
        raise InputError(f"A channel is called '{min(twice)}', as another column is; rename it.")
    blocks: dict[str, list[NDArray[Any]]] = {name: [] for name in (*first, *channels, *authors)}
    for recording, used in parts:
        times, of_author = np.asarray(recording.times), {t.author: t for t in used}
        column_of = {c.name: i for i, c in enumerate(recording.channels)}
        for name in ("task", "demonstration") if len(first) > 1 else ():
            value = recording.task if name == "task" else recording.name
            blocks[name].append(np.full(len(times), value, object))
        blocks["time"].append(times)
        for name in channels:
            i = column_of.get(name)
            blocks[name].append(
                np.full(len(times), np.nan) if i is None else recording.signals[:, i]
            )
        for name, coder in authors.items():
            track = of_author.get(coder, Track(coder))
            words = np.array([*track.actions, None], object)  # the last one is UNLABELLED, -1
            blocks[name].append(words[to_codes(track.segments, times, track.actions)])
    frame = _frame({name: np.concatenate(block) for name, block in blocks.items()})
    if not isinstance(frame, dict):
        frame.attrs["units"] = {name: unit for name, unit in channels.items() if unit}
    return frame


def scores_frame(result: Evaluation | RunResult) -> DataFrame:
    """Scores of an evaluation or a stored run, as ``forcelab evaluate --table`` writes them.

    Parameters
    ----------
    result : Evaluation or RunResult

    Returns
    -------
    pandas.DataFrame, or dict of str to ndarray without pandas
        ``stage`` (``"raw"``, ``"filtered"`` and others), ``row`` (``"demonstration"``,
        ``"pooled"``, and ``"lower"`` and ``"upper"`` end of the 95 % interval of the pooled
        scores), ``demonstration`` (its name, empty in the other rows), and a column each score,
        such as ``accuracy`` and ``f1.50``: fractions, ms and s, NaN where not defined.

    Examples
    --------
    >>> frame = forcelab.scores_frame(run)
    >>> list(frame["row"])[:6]
    ['demonstration', 'demonstration', 'demonstration', 'pooled', 'lower', 'upper']
    """
    rows = [(stage, row, name, *values) for stage, row, name, values in score_rows(result)]
    types = {"stage": object, "row": object, "demonstration": object}
    return _frame_of_rows(rows, {**types, **dict.fromkeys(METRICS, float)})


def score_rows(result: Evaluation | RunResult) -> Iterator[tuple[str, str, str, list[Any]]]:
    """The stage, what a row is of, the demonstration's name, and the metrics of its scores."""
    for stage, pooled, each, ranges in _stages(result):
        for name, record in each:
            yield stage, "demonstration", name, [look_up(record, metric) for metric in METRICS]
        yield stage, "pooled", "", [look_up(pooled, metric) for metric in METRICS]
        for end, row in enumerate(("lower", "upper")):
            intervals = (ranges[metric] for metric in METRICS)
            yield stage, row, "", [None if ends is None else ends[end] for ends in intervals]


def _stages(
    result: Evaluation | RunResult,
) -> Iterator[tuple[str, Mapping[str, Any], Sequence[tuple[str, Mapping[str, Any]]], Intervals]]:
    """Of each stage the pooled scores, those of each demonstration by its name, and intervals."""
    if isinstance(result, Evaluation):
        for stage in result.kinds:
            pooled, each = result.scores(stage)
            single = [(scores.name, scores.to_json()) for scores in each]
            yield stage, pooled.to_json(), single, result.intervals(stage)
        return
    for stage, record in result.scores.items():
        stored = [(each.name, each.scores.get(stage, {})) for each in result.tested]
        ranges = Intervals.from_json(record.get("intervals", {}))
        yield stage, record.get("pooled", {}), stored, ranges


def runs_frame(project: Project) -> DataFrame:
    """The runs of a project, a row each, oldest first.

    Parameters
    ----------
    project : Project

    Returns
    -------
    pandas.DataFrame, or dict of str to ndarray without pandas
        ``run`` (its number, for :func:`load_run`), ``time`` (UTC), ``kind``, ``title``, ``author``
        (whose labels were used), ``preset``, ``classifier``, ``seed``, ``tested`` (how many
        demonstrations), ``accuracy``, ``edit`` and ``f1.50`` (pooled, after the filters; fractions,
        NaN where nothing was tested), and ``recogniser`` (its id in the project; empty where none
        was trained).

    Examples
    --------
    >>> frame = forcelab.runs_frame(project)
    >>> frame["title"][0], frame["classifier"][0]
    ('foam', 'naive-bayes')
    """
    with project.snapshot():
        runs, uses = project.runs.summaries(), project.runs.uses()
    rows = [
        (
            *(run.id, run.time.replace(tzinfo=None), run.kind, run.title),
            run.labels[0].author if run.labels else "",
            *(str(run.settings.get(name, "")) for name in ("preset", "classifier")),
            -1 if run.seed is None else run.seed,
            run.digest.get("tested", 0),
            *(run.digest.get(name) for name in ("accuracy", "edit", "f1")),
            use.recogniser,
        )
        for run, use in zip(runs, uses, strict=True)
    ]
    types = {"run": int, "time": "datetime64[us]", "kind": object, "title": object,
             "author": object, "preset": object, "classifier": object, "seed": int, "tested": int,
             "accuracy": float, "edit": float, "f1.50": float, "recogniser": object}  # fmt: skip
    return _frame_of_rows(rows, types)


def _tracks(
    source: Project | RunResult | Evaluation | Labels, task: str | None, author: str | None
) -> Iterator[tuple[str, str, Track, Mapping[Segment, Origin]]]:
    """The task and name of a demonstration, a track over it, and where its segments come from.

    A project is asked for what is of the task alone.
    """
    if isinstance(source, Project):
        _check(source, task, author)
        for info in source.demonstrations.infos(task):
            for track in source.tracks.of(info.id):
                origins = source.tracks.origins(info.id, track.author)
                yield info.task, info.name, track, origins
    elif isinstance(source, (RunResult, Evaluation)):
        for of_task, name, *compared in _compared(source):
            yield from ((of_task, name, track, {}) for track in compared)
    else:
        for item in source:
            if isinstance(item, Track):
                yield "", "", item, {}
                continue
            recording, tracks = _labelled(item)
            yield from ((recording.task, recording.name, track, {}) for track in tracks)


def _labelled(
    item: Recording | LabelledDemonstration | Demonstration,
) -> tuple[Demonstration, tuple[Track, ...]]:
    """A demonstration and the labels that came with it."""
    if isinstance(item, Demonstration):
        return item, ()
    if isinstance(item, LabelledDemonstration):
        return item.demonstration, (Track(CODER, item.segments),)
    return item.demonstration, item.tracks


def _compared(result: RunResult | Evaluation) -> Iterator[tuple[str, str, Track, Track]]:
    """The task, the name, and the human and the predicted track of each demonstration."""
    if isinstance(result, RunResult):
        results, coder, model = (*result.tested, *result.proposals), result.author, result.proposer
    else:
        results = tuple(item.result for item in result.tested)
        coder, model = "human", model_author(result.settings.preset)
    for each in results:
        yield each.task, each.name, Track(coder, each.human), Track(model, each.predicted)


def _check(project: Project, task: str | None, author: str | None) -> None:
    """Refuse a task or an author that a project has not."""
    if task is not None:
        project.demonstrations.check_task(task)
    authors = [known.name for known in project.coding.authors()]
    if author is not None and author not in authors:
        raise InputError(unknown_word("author", author, authors or ("none at all",)))


def _frame_of_rows(rows: Sequence[tuple[Any, ...]], types: Mapping[str, Any]) -> DataFrame:
    """A table of rows whose columns have these types; None becomes NaN where there are numbers."""
    columns = list(zip(*rows, strict=True)) or [()] * len(types)
    named = zip(types.items(), columns, strict=True)
    return _frame({name: np.array(column, dtype) for (name, dtype), column in named})


def _frame(columns: dict[str, NDArray[Any]]) -> DataFrame:
    """A data frame of pandas; without it the columns themselves."""
    try:
        import pandas
    except ImportError:
        return columns
    return pandas.DataFrame(columns)
