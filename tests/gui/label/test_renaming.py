"""Renaming an action that is in use, by its menu; merging is asked first."""

import pytest
from factories import PAINTED_TRACK
from PySide6.QtCore import Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QDialog, QLineEdit, QMessageBox
from window_helpers import open_painted_document, shown_widget

from forcelab.gui.document import Document
from forcelab.gui.label.actions import ActionList
from forcelab.gui.label.history import HistoryView
from forcelab.labels import Segment
from forcelab.project import Project


@pytest.fixture
def view(app, document):
    with shown_widget(app, ActionList(document)) as view:
        yield view


def actions(document):
    return [segment.action for segment in document.editor.segments]


def paint(project, demonstration, action):
    """Ada paints on what need not be open."""
    before = project.tracks.get(demonstration, "Ada").segments
    project.tracks.edit(demonstration, "Ada", before, (*before, Segment(8, 9, action)), "painted")


def rename(view, name, new, press=None):
    """Choose the menu's entry, type a name, and press a button if something is asked."""
    questions = []

    def answer():
        dialog = QApplication.activeModalWidget()
        if isinstance(dialog, QMessageBox):
            questions.append(f"{dialog.text()} {dialog.informativeText()}")
            buttons = {button.text().replace("&", ""): button for button in dialog.buttons()}
            QTest.mouseClick(buttons[press], Qt.MouseButton.LeftButton)
        elif isinstance(dialog, QDialog):
            field = dialog.findChild(QLineEdit)
            field.selectAll()
            QTest.keyClicks(field, new)
            QTimer.singleShot(0, answer)
            QTest.keyClick(field, Qt.Key.Key_Return)

    QTimer.singleShot(0, answer)
    menu = view.menu(name)
    next(entry for entry in menu.actions() if entry.text() == "Rename…").trigger()
    menu.deleteLater()
    return questions


def test_an_action_in_use_is_renamed_at_once_and_keeps_its_look_and_key(view, document, messages):
    hold = document.vocabulary["hold"]
    document.set_action("hold")
    document.select(1)
    assert rename(view, "hold", "grip") == []
    assert actions(document) == ["grab", "grip", "grab", "release"]
    grip = document.vocabulary["grip"]
    assert (grip.look, grip.key) == (hold.look, hold.key)
    assert document.vocabulary.names == ("grab", "grip", "release")
    assert (document.action, document.selected) == ("grip", 1)
    sentence = "'hold' is now 'grip' in 1 segment of Ada, in 1 demonstration of foam."
    assert messages[-1] == (sentence, False)
    document.editor.undo_everywhere()
    assert document.editor.segments == PAINTED_TRACK
    assert "hold" in document.vocabulary


def test_a_stroke_that_was_begun_ends_with_the_new_name(view, document):
    document.begin_stroke("hold", 8.5)
    rename(view, "hold", "grip")
    document.end_stroke(9.0)
    assert actions(document)[-1] == "grip"


@pytest.mark.parametrize(("press", "merged"), [("Merge", True), ("Cancel", False)])
def test_merging_is_asked_with_how_much_it_changes(view, document, press, merged):
    (question,) = rename(view, "grab", "hold", press)
    assert question.startswith("Merge 'grab' into 'hold'? ")
    assert "'grab' becomes 'hold' in 2 segments of Ada" in question
    assert "The action 'hold' already exists." in question
    assert "in 1 demonstration of foam." in question
    if merged:
        assert actions(document) == ["hold", "hold", "hold", "release"]
        assert document.vocabulary.names == ("hold", "release")
    else:
        assert document.editor.segments == PAINTED_TRACK
        assert document.vocabulary.names == ("grab", "hold", "release")


@pytest.mark.parametrize(("press", "also"), [("Only in foam", False), ("In all 2 tasks", True)])
def test_other_tasks_are_asked_about(view, document, press, also):
    project = document.project
    other = next(info.id for info in document.infos if info.name == "02")
    project.demonstrations.set_task(other, "sponge")
    project.tracks.edit(other, "Ada", (), (Segment(0, 1, "hold"),), "painted")
    project.actions.add("sponge", ["hold"])
    (question,) = rename(view, "hold", "grip", press)
    assert "in 2 segments of Ada, in 2 demonstrations of foam, sponge." in question
    assert actions(document)[1] == "grip"
    assert (project.tracks.get(other, "Ada").segments[0].action == "grip") is also
    assert ("grip" in project.actions.vocabulary("sponge")) is also


def test_who_codes_blind_is_not_told_who_else_labelled(view, document, messages):
    document.project.tracks.edit(document.id, "Ben", (), PAINTED_TRACK[:1], "painted")
    document.project.coding.assign(document.id, "Ada", blind=True)
    document.reread()
    (question,) = rename(view, "grab", "hold", "Merge")
    for text in (question, messages[-1][0]):
        assert "Ben" not in text
        assert "'grab' stays in the list, as others may use it." in text
    assert document.project.tracks.get(document.id, "Ben").segments == PAINTED_TRACK[:1]


def test_what_is_only_predicted_is_not_renamed(view, document, messages):
    document.other_tracks = {}
    document.vocabulary = document.vocabulary.with_actions("slip")
    assert rename(view, "slip", "slide") == []
    assert messages[-1] == (
        "'slip' is only predicted; it disappears when you train again.",
        True,
    )


def test_another_window_follows(app, tmp_path):
    with open_painted_document(tmp_path) as document:
        other, ben = Document("Ada"), Document("Ben")
        for another in (other, ben):
            another.open_project(document.project.path)
            another.open_demonstration("01")
        other.select(1)
        assert document.rename_action("hold", "grip")
        for another in (other, ben):
            another.refresh()
            assert another.vocabulary == document.vocabulary
        assert other.editor.segments == document.editor.segments
        assert ben.other_tracks["Ada"] == document.editor.segments
        assert other.editor.undo_everywhere()
        assert other.editor.segments == PAINTED_TRACK
        other.close()
        ben.close()


def test_what_is_taken_back_looks_as_it_did_and_so_does_what_is_done_again(document):
    before = document.vocabulary
    assert document.rename_action("hold", "grip")
    renamed = document.vocabulary
    assert document.rename_action("grip", "clutch")
    again = document.vocabulary
    assert document.rename_action("grab", "clutch", merge=True)
    merged = document.vocabulary
    for verb, expected in (
        (document.editor.undo_everywhere, again),
        (document.editor.undo_everywhere, renamed),
        (document.editor.undo_everywhere, before),
        (document.editor.redo_everywhere, renamed),
        (document.editor.redo_everywhere, again),
        (document.editor.redo_everywhere, merged),
    ):
        assert verb()
        assert document.vocabulary == document.project.actions.vocabulary("foam") == expected


def test_what_the_task_still_needs_stays_when_a_renaming_is_taken_back(document):
    project = document.project
    other = next(info.id for info in document.infos if info.name == "02")
    project.tracks.edit(other, "Ada", (), (Segment(0, 1, "hold"),), "painted")
    assert document.rename_action("hold", "grip")
    paint(project, other, "grab")
    grip = document.vocabulary["grip"]
    document.editor.undo_everywhere()
    assert document.vocabulary["grip"] == grip
    assert document.vocabulary.names == ("grab", "grip", "release", "hold")
    assert document.rename_action("hold", "slip")
    with Project.open(project.path) as elsewhere:
        elsewhere.actions.add("foam", ["twist"])
    document.editor.undo_everywhere()
    assert {"hold", "grip", "slip", "twist"} <= {*project.actions.vocabulary("foam").names}


@pytest.fixture
def other(document):
    """Another demonstration, in which Ada held twice."""
    id_ = next(info.id for info in document.infos if info.name == "02")
    before, held = (), (Segment(0, 1, "hold"), Segment(2, 3, "hold"))
    document.project.tracks.edit(id_, "Ada", before, held, "painted")
    return id_


def actions_of(document, id_):
    return [segment.action for segment in document.project.tracks.get(id_, "Ada").segments]


def test_a_renaming_is_undone_and_redone_in_every_demonstration_as_one_step(
    document, other, messages
):
    before = document.vocabulary
    assert document.rename_action("hold", "grip")
    assert document.editor.undo_everywhere()
    assert document.editor.segments == PAINTED_TRACK
    assert actions_of(document, other) == ["hold", "hold"]
    assert document.vocabulary == document.project.actions.vocabulary("foam") == before
    what = "rename of hold to grip (3 segments in 2 demonstrations)"
    assert messages[-1] == (f"Undone: {what}", False)
    assert document.editor.redo_everywhere()
    assert actions(document) == ["grab", "grip", "grab", "release"]
    assert actions_of(document, other) == ["grip", "grip"]
    assert "hold" not in document.project.actions.vocabulary("foam")
    assert messages[-1] == (f"Redone: {what}", False)


def test_where_something_was_edited_since_a_renaming_stays_and_that_is_told(
    document, other, messages
):
    document.rename_action("hold", "grip")
    paint(document.project, other, "grab")
    document.editor.undo_everywhere()
    assert document.editor.segments == PAINTED_TRACK
    assert actions_of(document, other) == ["grip", "grip", "grab"]
    assert messages[-1][0] == (
        "Undone: rename of hold to grip (1 segment); not in '02', where something else was edited "
        "since"
    )
    document.open_demonstration(other)
    assert document.editor.undo_everywhere()
    assert document.editor.undo_everywhere()
    assert actions_of(document, other) == ["hold", "hold"]


def test_going_back_past_a_renaming_tells_where_else_it_was_undone(app, document, other, messages):
    document.rename_action("hold", "grip")
    document.editor.delete(0)
    with shown_widget(app, HistoryView(document), (320, 400)) as history:
        history.refresh()
        history.go_to(2)
    assert document.editor.segments == PAINTED_TRACK
    assert actions_of(document, other) == ["hold", "hold"]
    assert "rename of hold to grip (3 segments in 2 demonstrations)" in messages[-1][0]


def test_other_tasks_have_their_actions_again_when_a_renaming_is_undone(document, other):
    project = document.project
    project.demonstrations.set_task(other, "sponge")
    before = project.actions.vocabularies()
    document.rename_action("hold", "grip")
    document.editor.undo_everywhere()
    assert project.actions.vocabularies() == before
    with Project.open(project.path) as again:  # as after a restart: no look is remembered
        again.actions.rename("Ada", "hold", "grip")
    document.editor.undo_everywhere()
    assert "hold" in project.actions.vocabulary("sponge")
    assert "hold" in project.actions.vocabulary("foam")


def test_what_undo_brings_back_is_an_action_again_though_it_was_renamed_elsewhere(document):
    project, before = document.project, document.vocabulary
    with Project.open(project.path) as elsewhere:
        elsewhere.actions.rename("Ada", "hold", "grip")
    assert document.vocabulary == before  # the window has not looked yet
    document.editor.undo_everywhere()
    assert document.editor.segments == PAINTED_TRACK
    assert "hold" in project.actions.vocabulary("foam")
    assert document.vocabulary == project.actions.vocabulary("foam")


def test_the_new_name_leaves_the_actions_on_undo_where_others_kept_the_old_one(document, other):
    document.project.tracks.edit(other, "Ben", (), (Segment(0, 1, "hold"),), "painted")
    before = document.vocabulary
    document.rename_action("hold", "grip")
    renamed = document.vocabulary
    assert {"hold", "grip"} < {*renamed.names}
    document.editor.undo_everywhere()
    assert document.vocabulary == document.project.actions.vocabulary("foam") == before
    document.editor.redo_everywhere()
    assert document.vocabulary == document.project.actions.vocabulary("foam") == renamed


@pytest.mark.parametrize("used", [False, True])
def test_who_codes_blind_does_not_find_out_by_undoing_a_renaming(document, other, used):
    project = document.project
    project.coding.assign(other, "Ada", blind=True)
    document.rename_action("hold", "grip")
    if used:
        project.tracks.edit(other, "Ben", (), (Segment(0, 1, "grip"),), "painted")
    document.editor.undo_everywhere()
    assert document.editor.segments == PAINTED_TRACK
    assert {"hold", "grip"} < {*document.vocabulary.names}


def test_only_undoing_takes_a_renaming_back(document):
    predicted = (
        Segment(document.editor.segments[1].start, document.editor.segments[1].end, "hold"),
    )
    document.project.tracks.edit(
        document.id, "model one", (), predicted, "predicted", kind="predict"
    )
    document.rename_action("hold", "grip")
    assert document.editor.copy_from("model one", predicted[0].start, predicted[0].end)
    assert {"hold", "grip"} <= {*document.vocabulary.names}


def test_a_name_that_is_free_again_may_be_another_actions(document):
    assert document.add_actions("twist")
    assert document.rename_action("twist", "turn")
    assert document.add_actions("twist")
    assert document.vocabulary.names == ("grab", "hold", "release", "turn", "twist")
    document.editor.delete(1)
    assert document.rename_action("hold", "grip")
    document.editor.undo_everywhere()  # the segment comes back; the list was not edited
    assert {"hold", "grip"} <= {*document.vocabulary.names}
