"""How the actions of an outcome look, which may come from several tasks."""

from __future__ import annotations

from dataclasses import replace

from forcelab.project import Project
from forcelab.review.outcome import Outcome
from forcelab.vocabulary import Vocabulary, joined

__all__ = ["vocabulary_of"]


def vocabulary_of(project: Project, outcome: Outcome) -> Vocabulary:
    """All actions of an outcome, each with the look that it has where it is labelled.

    The task that is tested comes first, so that its tracks look as when they are labelled. Two
    actions of the same look, from two tasks, keep the colour and differ in texture; so do those
    that are kept apart by their task, like ``grab_hard`` and ``grab_soft``.

    Raises
    ------
    ForcelabError
        If the project cannot be read.
    """
    tasks = dict.fromkeys(([outcome.test_task] if outcome.test_task else []) + [*outcome.tasks])
    found = joined({task: project.vocabulary(task) for task in tasks}, apart=outcome.apart)
    keyless = Vocabulary(tuple(replace(action, key="") for action in found))
    return keyless.with_actions(*outcome.actions)
