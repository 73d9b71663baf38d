"""How many edits lie between two states of a track."""

from __future__ import annotations

import pytest
from factories import track_editor_in_memory
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.labels import Segment
from forcelab.project import Project
from forcelab.project.runs import LabelsUsed


@pytest.fixture(scope="module")
def shared():
    """A project in memory and the demonstration that all authors label."""
    with track_editor_in_memory() as labelling:
        yield labelling.project, labelling.demonstration


@settings(max_examples=30, deadline=None)
@given(st.lists(st.sampled_from(["paint", "undo", "redo"]), max_size=14), st.integers(0, 14))
def test_what_was_taken_back_counts_for_nothing(shared, steps, looked_at):
    """Beside two plain stacks: what lies on one and not on the other is counted."""
    project, demonstration = shared
    author = f"coder {len(project.coding.authors())}"
    done: list[int] = []
    undone: list[int] = []
    used, then = LabelsUsed(demonstration, author, 0), []
    for number, step in enumerate(steps):
        if number == looked_at:
            history = project.tracks.history(demonstration, author)
            used = LabelsUsed(demonstration, author, history[-1].id if history else 0)
            then = list(done)
        if step == "paint":
            before = project.tracks.get(demonstration, author).segments
            after = (Segment(0.0, 0.1 + 0.01 * number, "grab"),)
            project.tracks.edit(demonstration, author, before, after, f"painted {number}")
            done.append(number)
            undone.clear()
        elif step == "undo" and done:
            project.tracks.undo(demonstration, author)
            undone.append(done.pop())
        elif step == "redo" and undone:
            project.tracks.redo(demonstration, author)
            done.append(undone.pop())
    assert project.tracks.edits_since([used]) == len(set(then) ^ set(done))


def test_another_coders_edits_do_not_count(project: Project, make):
    demonstration = project.demonstrations.add(make(1)).id
    project.tracks.edit(demonstration, "anna", (), (Segment(0.0, 0.1, "grab"),), "painted")
    assert project.tracks.edits_since([LabelsUsed(demonstration, "bert", 0)]) == 0
