"""What a coder may see of a demonstration: whose segments, and the actions that they have."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from forcelab.demonstration import Demonstration
from forcelab.labels import Segments
from forcelab.project import Project
from forcelab.vocabulary import Vocabulary

if TYPE_CHECKING:
    from forcelab.review.run_result import Outcome

__all__ = ["VisibleLabels", "visible_to"]


class VisibleLabels(NamedTuple):
    """What a coder may see.

    Parameters
    ----------
    others : dict of str to tuple of Segment
        The tracks of other authors, and the prediction that is reviewed, by author.
    listed : Vocabulary
        The task's actions as stored.
    painted : tuple of str
        The actions that segments have.
    like : Vocabulary
        How those look in a review that are not among the task's.
    """

    others: dict[str, Segments]
    listed: Vocabulary
    painted: tuple[str, ...]
    like: Vocabulary


def visible_to(
    author: str, demonstration: Demonstration, project: Project, outcome: Outcome | None
) -> VisibleLabels:
    """What a coder may see of a demonstration; what is hidden does not show in actions either.

    Raises
    ------
    ForcelabError
        If it cannot be read.
    """
    tracks = project.tracks.of(demonstration.id)
    blind = project.coding.is_blind(demonstration.id, author)
    if blind:
        tracks = tuple(track for track in tracks if track.author == author)
    painted = tuple(action for track in tracks for action in track.actions)
    others = {track.author: track.segments for track in tracks if track.author != author}
    reviewed = None if outcome is None else outcome.find(demonstration.id)
    if reviewed is not None and not blind and outcome is not None:
        from forcelab.review.differences import spelt_as_coded

        predicted = spelt_as_coded(reviewed.predicted, outcome, reviewed)
        others[outcome.proposer] = predicted
        painted += tuple(segment.action for segment in predicted)
    listed, like = project.actions.vocabulary(demonstration.task), Vocabulary()
    if outcome is not None and any(action not in listed for action in painted):
        from forcelab.review.run_result import vocabulary_of

        like = vocabulary_of(project, outcome)
    return VisibleLabels(others, listed, painted, like)
