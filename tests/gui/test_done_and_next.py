"""Done and next: one key or one click, and nothing that a blind coder has not agreed to see."""

import pytest
from factories import sine_demonstration
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from window_helpers import status_messages

from forcelab.errors import ForcelabError
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.window import Window
from forcelab.labels import Segment, Track
from forcelab.project import Project

HIS = (Segment(1.0, 2.0, "hold"),)


@pytest.fixture
def window(app, tmp_path):
    """Ann at work on the first of four demonstrations, which Ben has labelled."""
    path = tmp_path / "study.forcelab"
    with Project.create(path) as project:
        for number, name in enumerate(("01", "02", "03", "04")):
            recording = sine_demonstration(name, "foam", 0.1 * number)
            project.demonstrations.add(recording, [Track("Ben", HIS)] if name == "01" else [])
    window = Window("Ann", remembering=False)
    window.resize(1100, 700)
    window.show()
    window.begin(LaunchOptions(project=path))
    window.activateWindow()
    assert QTest.qWaitForWindowActive(window)
    yield window
    window.close()


def press_done_and_next(window):
    QTest.keyClick(window.label.tracks, Qt.Key.Key_Return, Qt.KeyboardModifier.ControlModifier)


def name_of(window):
    return window.document.demonstration.name


def done_by_ann(window):
    coding = window.document.project.coding
    ids = {item.demonstration for item in coding.assignments("Ann") if item.done is not None}
    return [info.name for info in window.document.infos if info.id in ids]


def count_in_list(window):
    return window.demonstrations._count.text


def test_one_key_marks_it_as_done_and_opens_the_next_that_is_not(window, answers):
    messages, questions = status_messages(window.document), answers("Cancel")
    assert count_in_list(window) == "0 of 4 done"
    third = window.document.infos[2].id
    window.document.project.coding.set_done(third, "Ann")
    press_done_and_next(window)
    assert name_of(window) == "02"
    assert messages[-1] == ("'01' is marked as done; 2 of 4 are done.", False)
    assert count_in_list(window) == "2 of 4 done"
    press_done_and_next(window)
    assert name_of(window) == "04"  # the third is done already
    press_done_and_next(window)
    assert name_of(window) == "04"
    assert messages[-1][0] == (
        "'04' is marked as done; no other demonstration in the list is left."
    )
    assert done_by_ann(window) == ["01", "02", "03", "04"]
    assert questions == []
    assert window.focusWidget() is window.label.tracks


def test_a_blind_coder_is_asked_and_sees_nothing_on_the_way(window, answers):
    document = window.document
    for info in document.infos:
        document.project.coding.assign(info.id, "Ann")
    document.reread()
    seen = []
    document.tracks_changed.connect(lambda: seen.append(dict(document.other_tracks)))
    questions = answers("Cancel")
    press_done_and_next(window)
    assert len(questions) == 1
    assert questions[0].startswith("Mark '01' as done and end blind coding?")
    assert name_of(window) == "01"
    assert document.coding_blind
    assert done_by_ann(window) == []
    assert "Ben" not in str(window.demonstrations._rows[0].others)
    questions = answers("Mark as done")
    press_done_and_next(window)
    assert len(questions) == 1
    assert name_of(window) == "02"
    assert document.coding_blind
    assert done_by_ann(window) == ["01"]
    assert count_in_list(window) == "1 of 4 done"
    assert not any("Ben" in others for others in seen)
    assert document.open_demonstration(document.infos[0].id)
    assert document.other_tracks == {"Ben": HIS}


def test_where_the_next_cannot_be_opened_that_is_said(window, monkeypatch):
    document, messages = window.document, status_messages(window.document)

    def fail(_):
        raise ForcelabError("'02' is damaged.")

    monkeypatch.setattr(document.project.demonstrations, "load", fail)
    press_done_and_next(window)
    assert document.demonstration.name == "01"
    assert ("'02' is damaged.", True) in messages
    assert "is marked" not in messages[-1][0]


def test_a_project_that_can_only_be_read_stays_where_it_is(window, monkeypatch):
    messages = status_messages(window.document)
    monkeypatch.setattr(window.document.project._db, "_refusal", "It may only be read here.")
    press_done_and_next(window)
    assert name_of(window) == "01"
    assert "may only be read here" in messages[-1][0]


def test_what_is_assigned_counts_as_done_once_it_is_marked(window, until):
    document = window.document
    low, high = document.view.bounds
    document.editor.paint(low, high, "grab")
    until(lambda: count_in_list(window) == "1 of 4 done")
    document.project.coding.assign(document.id, "Ann")
    document.reread()
    assert count_in_list(window) == "0 of 4 done"
