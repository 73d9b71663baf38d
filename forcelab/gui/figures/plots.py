"""The figures of what scripts and the command line hold: runs, evaluations, demonstrations."""

from __future__ import annotations

from collections.abc import Iterable

from forcelab.demonstration import Demonstration
from forcelab.formats.recording import Recording
from forcelab.gui.figures.demonstration import DemonstrationFigure
from forcelab.gui.figures.figure import Figure
from forcelab.gui.figures.pairs import Pair, TimelinePairs
from forcelab.labels import Track
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.results import Evaluation
from forcelab.review.run_result import RunResult
from forcelab.text import percent
from forcelab.vocabulary import Vocabulary


def plot(
    what: RunResult | Evaluation | Demonstration | LabelledDemonstration | Recording,
    tracks: Iterable[Track] = (),
    vocabulary: Vocabulary | None = None,
) -> Figure:
    """Draw a run, an evaluation or a demonstration.

    Of a run or an evaluation these are the timeline pairs that ``forcelab evaluate --figure``
    writes; of a demonstration its channels below the tracks.

    Parameters
    ----------
    what : RunResult, Evaluation, Demonstration, LabelledDemonstration or Recording
    tracks : iterable of Track
        Labels of a demonstration, besides those that came with it.
    vocabulary : Vocabulary, optional
        The colours of the actions, such as ``project.actions.vocabulary(task)``; by default those
        of the project where a run or an evaluation is of one.

    Returns
    -------
    Figure
        Shown by notebooks; ``save("pairs.svg")`` writes it.

    Raises
    ------
    InputError
        If Qt or the system's fonts are missing.

    Examples
    --------
    >>> forcelab.plot(run).save("pairs.svg")
    >>> id_ = project.demonstrations.id_of("foam 01")
    >>> forcelab.plot(project.demonstrations.load(id_), project.tracks.of(id_)).save("foam 01.svg")
    """
    if isinstance(what, (RunResult, Evaluation)):
        return _pairs(what, what.vocabulary if vocabulary is None else vocabulary)
    shown = what if isinstance(what, Demonstration) else what.demonstration
    tracks = tuple(tracks)
    if isinstance(what, LabelledDemonstration):
        tracks = (Track("labels", what.segments), *tracks)
    elif isinstance(what, Recording):
        tracks = (*what.tracks, *tracks)
    actions = (action for track in tracks for action in track.actions)
    colours = (vocabulary or Vocabulary()).with_actions(*actions)
    title = f"{shown.name}, {shown.task}" if shown.task else shown.name
    return DemonstrationFigure(title, shown, tracks, colours)


def _pairs(result: RunResult | Evaluation, vocabulary: Vocabulary) -> TimelinePairs:
    """Human and predicted timelines in pairs, each with its accuracy."""
    if isinstance(result, RunResult):
        tested = result.tested
        accuracies = [each.scores.get("filtered", {}).get("accuracy") for each in tested]
    else:
        tested = tuple(item.result for item in result.tested)
        accuracies = [scores.accuracy for scores in result.scores("filtered")[1]]
    pairs = tuple(
        Pair(
            *(each.name, each.human, each.predicted, each.start, each.end),
            note=f"{percent(accuracy)} %",
        )
        for each, accuracy in zip(tested, accuracies, strict=True)
    )
    return TimelinePairs(
        result.title,
        pairs,
        vocabulary.with_actions(*result.actions),
        result.actions,
    )
