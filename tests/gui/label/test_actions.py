"""The vocabulary beside the tracks: brushes, ranges, and changes that touch one action only."""

import pytest
from PySide6.QtCore import QEvent, QModelIndex, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QMenu, QPushButton
from window_helpers import open_painted_document, shown_widget

from forcelab.gui.label.actions import ActionList, KeyDialog, colour_menu
from forcelab.labels import Segment
from forcelab.project import Project
from forcelab.vocabulary import COLOURS, Vocabulary


@pytest.fixture
def view(app, document):
    with shown_widget(app, ActionList(document)) as view:
        yield view


def click(view, row):
    where = view.list.visualRect(view.model.index(row)).center()
    QTest.mouseClick(view.list.viewport(), Qt.MouseButton.LeftButton, pos=where)


def stored(document):
    with Project.open(document.project.path) as project:
        return project.actions.vocabulary("foam")


def test_a_row_for_each_action_with_what_the_track_has_of_it(view, document, until):
    assert [view.model.name(row) for row in range(3)] == ["grab", "hold", "release"]
    assert view.model.counts == {"grab": (2, 1.25), "hold": (1, 2.5), "release": (1, 2.0)}
    document.editor.paint(9.0, 9.5, "grab")
    until(lambda: view.model.counts["grab"] == (3, 1.75))
    spoken = view.model.index(0).data(Qt.ItemDataRole.AccessibleTextRole)
    assert spoken == "grab, key 1, 3 segments, 1.8 seconds"


def test_a_click_takes_up_the_brush_and_another_puts_it_down(view, document, messages):
    click(view, 1)
    assert document.action == "hold"
    assert messages[-1][0].startswith("'hold' is the brush: every drag on your track paints it.")
    click(view, 0)
    assert document.action == "grab"
    click(view, 0)
    assert document.action is None
    assert messages[-1] == ("No brush: a drag on your track asks for the action.", False)


def test_escape_and_another_project_empty_the_line_of_a_new_action(view, document):
    view.entry.setFocus()
    QTest.keyClicks(view.entry, "pres")
    QTest.keyClick(view.entry, Qt.Key.Key_Escape)
    assert view.entry.text() == ""
    assert not view.entry.hasFocus()
    QTest.keyClicks(view.entry, "pres")
    document.project_changed.emit()
    assert view.entry.text() == ""


def test_a_click_fills_the_marked_range(view, document):
    document.view.set_range(8.5, 9.0)
    click(view, 1)
    assert document.editor.segments[-1].action == "hold"
    assert (document.editor.segments[-1].start, document.editor.segments[-1].end) == (8.5, 9.0)
    assert document.action is None
    assert document.view.range is None


def test_the_brush_is_clearly_marked(app, view, document):
    before = view.list.grab().toImage()
    click(view, 1)
    app.processEvents()
    after = view.list.grab().toImage()
    row = view.list.visualRect(view.model.index(1))
    differ = [
        before.pixel(x, y) != after.pixel(x, y)
        for x in range(row.left(), row.right())
        for y in range(row.top(), row.bottom())
    ]
    assert sum(differ) > 0.6 * len(differ)


def test_the_keyboard_reaches_everything(app, view, document):
    view.list.setFocus()
    view.list.setCurrentIndex(view.model.index(0))
    QTest.keyClick(view.list, Qt.Key.Key_Down)
    QTest.keyClick(view.list, Qt.Key.Key_Return)
    assert document.action == "hold"
    for key, letter in ((Qt.Key.Key_1, "1"), (Qt.Key.Key_Space, " ")):
        event = QKeyEvent(QEvent.Type.KeyPress, key, Qt.KeyboardModifier.NoModifier, letter)
        app.sendEvent(view.list, event)
        assert not event.isAccepted()


def test_a_known_action_is_explained(view):
    tip = view.model.index(0).data(Qt.ItemDataRole.ToolTipRole)
    assert "close on the object" in tip
    assert "Starts:" in tip


def test_a_new_action_changes_no_other(view, document, messages):
    before = document.vocabulary.actions
    QTest.keyClicks(view.entry, "  press   down ")
    QTest.keyClick(view.entry, Qt.Key.Key_Return)
    assert document.vocabulary.actions[:3] == before
    assert document.vocabulary.names[3] == "press down"
    assert stored(document) == document.vocabulary
    assert view.entry.text() == ""
    assert view.model.rowCount() == 4
    assert not view.add("grab")
    assert "already" in messages[-1][0]
    assert not view.add("  ")


def test_colour_and_name_change_one_action_only(view, document):
    before = document.vocabulary
    assert view.recolour("hold", "#123456")
    assert document.vocabulary["hold"].colour == "#123456"
    assert document.vocabulary["grab"] == before["grab"]
    view.add("twist")
    assert view.rename("twist", "turn")
    assert document.vocabulary.names == ("grab", "hold", "release", "turn")
    assert stored(document) == document.vocabulary


def test_an_action_that_has_segments_stays(view, document, messages):
    document.set_author("Ben")  # it is Ada who used it
    document.open_demonstration("02")
    assert not view.remove("hold")
    sentence, trouble = messages[-1]
    assert trouble
    assert "segments of 'hold' in demonstrations of foam" in sentence
    assert not view.rename("hold", "keep")
    assert "Ben has no segment of it" in messages[-1][0]
    view.add("twist")
    document.set_action("twist")
    assert view.remove("twist")
    assert document.vocabulary.names == ("grab", "hold", "release")
    assert document.action is None


@pytest.mark.parametrize("used", [False, True])
def test_who_codes_blind_does_not_learn_by_removing_what_others_use(view, document, used, messages):
    id_ = document.project.demonstrations.id_of("02")
    view.add("twist")
    if used:
        segment = (Segment(0.1, 0.2, "twist"),)
        document.project.tracks.edit(id_, "Ben", (), segment, "painted")
    document.project.coding.assign(id_, "Ada", blind=True)
    assert not view.remove("twist")
    sentence = (
        "'twist' stays in the list, as others may use it: Ada codes demonstrations of foam blind."
    )
    assert messages[-1][0].startswith(sentence)
    document.project.coding.set_done(id_, "Ada")
    assert view.remove("twist") is not used


def press(dialog, key, text):
    modifiers = Qt.KeyboardModifier.NoModifier
    dialog.keyPressEvent(QKeyEvent(QEvent.Type.KeyPress, key, modifiers, text))


def test_a_key_is_chosen_by_pressing_it(app, document):
    dialog = KeyDialog(document.vocabulary, "hold")
    press(dialog, Qt.Key.Key_1, "1")
    assert "paints 'grab'" in dialog.trouble.text()
    press(dialog, Qt.Key.Key_K, "k")
    assert "cannot paint" in dialog.trouble.text()
    press(dialog, Qt.Key.Key_Shift, "")
    assert dialog.key is None
    press(dialog, Qt.Key.Key_H, "H")
    assert dialog.key == "h"
    none = KeyDialog(document.vocabulary, "hold")
    press(none, Qt.Key.Key_Backspace, "\b")
    assert none.key == ""
    left = KeyDialog(document.vocabulary, "hold")
    press(left, Qt.Key.Key_Escape, "\x1b")
    assert left.key is None


def test_a_name_in_the_dialog_of_its_key_is_no_markup(app):
    name = "<i>grab</i>"
    dialog = KeyDialog(Vocabulary().with_actions(name), name)
    (sentence,) = (label for label in dialog.findChildren(QLabel) if name in label.text())
    assert sentence.textFormat() == Qt.TextFormat.PlainText


def test_colours_for_every_eye_come_first(app, view):
    chosen = []
    menu = colour_menu(COLOURS[0], chosen.append, QMenu(view))
    actions = menu.actions()
    assert not actions[0].isEnabled()  # it has that one
    for action in actions[1:8]:
        action.trigger()
    assert chosen == list(COLOURS[1:])


def test_the_menu_offers_what_can_be_done(view, document):
    document.view.set_range(8.5, 9.0)
    menu = view.menu("hold")
    by_text = {action.text(): action for action in menu.actions()}
    by_text["Fill the marked range"].trigger()
    assert document.editor.segments[-1].action == "hold"
    by_text["Use as brush"].trigger()
    assert document.action == "hold"
    assert {"Change key…", "Colour", "Rename…", "Remove"} <= set(by_text)
    assert "Fill the marked range" not in {action.text() for action in view.menu("hold").actions()}


def test_an_empty_vocabulary_is_begun_from_the_glossary(app, tmp_path):
    with (
        open_painted_document(tmp_path, ()) as document,
        shown_widget(app, ActionList(document)) as view,
    ):
        buttons = {button.text(): button for button in view.findChildren(QPushButton)}
        assert buttons["grab"].isVisible()
        assert "close on the object" in buttons["grab"].toolTip()
        buttons["grab"].click()
        assert document.vocabulary == Vocabulary().with_actions("grab")
        assert not buttons["grab"].isVisible()
        document.close()
        assert not view.entry.isEnabled()


def test_hidden_it_counts_nothing(app, document):
    view = ActionList(document)
    document.editor.paint(9.0, 9.5, "grab")
    assert not view._count_timer.isActive()
    assert view.model.counts == {}
    with shown_widget(app, view):
        assert view.model.counts["grab"][0] == 3


def test_it_fits_into_a_narrow_column(app, view, document):
    view.add("an action with a name that is far too long for any column")
    view.resize(view.minimumSizeHint())
    app.processEvents()
    assert view.width() <= 200
    assert not view.list.horizontalScrollBar().isVisible()
    assert not view.grab().isNull()
    assert view.model.index(3).data(Qt.ItemDataRole.ToolTipRole).startswith("an action with")
    assert view.model.name(99) is None
    assert view.model.index(0).data() == "grab"
    assert QModelIndex().data() is None


def test_suggestions_stay_until_the_coder_paints_or_has_enough(app, tmp_path):
    for ending in ("painting", "enough"):
        folder = tmp_path / ending
        folder.mkdir()
        with open_painted_document(folder, segments=()) as document:
            document.set_vocabulary(Vocabulary())
            with shown_widget(app, ActionList(document)) as view:
                buttons = view.suggestions.buttons
                assert not view.suggestions.hide_button.isVisible()
                for name in ("grab", "hold"):
                    QTest.mouseClick(buttons[name], Qt.MouseButton.LeftButton)
                    assert buttons["pull"].isVisible()
                    assert not buttons[name].isVisible()
                    assert view.list.isVisible()
                assert document.vocabulary.names == ("grab", "hold")
                if ending == "painting":
                    document.editor.paint(0.0, 1.0, "grab")
                else:
                    QTest.mouseClick(view.suggestions.hide_button, Qt.MouseButton.LeftButton)
                assert not view.suggestions.isVisible()
                assert view.list.isVisible()
                assert app.focusWidget() is view.list  # not the field: the next keys paint


def test_a_colour_from_the_menu_goes_to_the_other_tasks_that_have_the_action(view, document):
    other = document.project.actions.add("LEGO", ["insert", "hold"])
    assert other["hold"].look == document.vocabulary["hold"].look
    menu = view.menu("hold")
    colours = next(m for m in menu.findChildren(QMenu) if m.title() == "Colour")
    next(a for a in colours.actions() if a.text() == "Black").trigger()
    menu.deleteLater()
    assert document.vocabulary["hold"].look == ("#000000", 0)
    assert document.project.actions.vocabulary("LEGO")["hold"].look == ("#000000", 0)


def test_each_task_has_keys_from_one_and_shows_its_own_actions_only(view, document):
    foam, project = document.vocabulary, document.project
    project.demonstrations.set_task(project.demonstrations.id_of("02"), "stylus")
    project.actions.set_vocabulary("stylus", Vocabulary())
    document.set_author("Ben")  # who has painted nothing
    assert document.open_demonstration("02")
    shown = len(document.vocabulary)
    for name in ("twist", "release"):
        QTest.keyClicks(view.entry, name)
        QTest.keyClick(view.entry, Qt.Key.Key_Return)
    rows = [view.model.name(row) for row in range(view.model.rowCount())]
    assert rows == [*document.vocabulary.names]
    assert rows[shown:] == ["twist", "release"]
    assert [action.key for action in document.vocabulary] == [*"123456"[: len(rows)]]
    for action in document.vocabulary:
        if action.name in foam:
            assert action.look == foam[action.name].look
