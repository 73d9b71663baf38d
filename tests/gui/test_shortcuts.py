import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QLineEdit,
    QMainWindow,
    QPlainTextEdit,
    QPushButton,
    QSlider,
    QTableWidget,
    QTableWidgetItem,
    QTreeWidget,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import InputError
from forcelab.gui import commands, settings
from forcelab.gui.shortcuts import COMMANDS, Keys, bind, collision
from forcelab.vocabulary import KEYS, Vocabulary

LEGO = Vocabulary().with_actions("grab", "hold", *(f"a{i}" for i in range(20)))
#: The table of ../shared/style.md, row by row; Home and End are start and end, as everywhere.
HABITS = {
    "play": {"Space"},
    "play_segment": {"Shift+Space"},
    "step_back": {"Left"},
    "step_forward": {"Right"},
    "leap_back": {"Ctrl+Left"},
    "leap_forward": {"Ctrl+Right"},
    "to_start": {"Home", "Ctrl+Home"},
    "to_end": {"End", "Ctrl+End"},
    "slower": {"-", "<"},
    "faster": {"+", ">"},
    "normal_speed": {"Backspace", "0"},
    "range_in": {"["},
    "range_out": {"]"},
    "delete": {"Del"},
    "cancel": {"Esc"},
    "previous_segment": {"K"},
    "next_segment": {"L"},
    "next_review": {"N"},
    "previous_review": {"Shift+N"},
    "accept": {"G"},
    "accept_all": {"Shift+G"},
    "undo": {"Ctrl+Z"},
    "redo": {"Ctrl+Shift+Z", "Ctrl+Y"},
    "manual": {"F1"},
    "help": {"?"},
    "rename": {"F2"},
    "search": {"Ctrl+F"},
}


class Window(QMainWindow):
    """A window with one field of each kind, and a list of what its commands did."""

    def __init__(self, keys):
        super().__init__()
        self.did = []
        self.actions_made = bind(
            self, {c.id: lambda id_=c.id: self.did.append(id_) for c in COMMANDS}, keys
        )
        self.fields = QWidget()
        layout = QVBoxLayout(self.fields)
        self.setCentralWidget(self.fields)
        self.canvas = QWidget()
        self.canvas.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        layout.addWidget(self.canvas)
        self.show()
        self.activateWindow()
        assert QTest.qWaitForWindowActive(self)
        self.canvas.setFocus()

    def add(self, field):
        self.fields.layout().addWidget(field)
        field.show()
        field.setFocus()
        return field

    def press_on(self, widget, *presses):
        self.did.clear()
        for press in presses:
            key, modifiers = press if isinstance(press, tuple) else (press, Qt.NoModifier)
            QTest.keyClick(widget, key, modifiers)
        return self.did


@pytest.fixture
def window(keys):
    created = Window(keys)
    yield created
    created.close()
    created.deleteLater()


def test_every_habit_is_kept():
    for id_, expected in HABITS.items():
        [command] = [c for c in COMMANDS if c.id == id_]
        assert set(command.keys) == expected, id_


def test_ids_and_texts_differ():
    assert len({c.id for c in COMMANDS}) == len(COMMANDS)
    assert len({c.text for c in COMMANDS}) == len(COMMANDS)
    assert commands.GROUPS[0] == "File"
    assert commands.GROUPS[-1] == "Help"


def test_no_default_key_means_two_things_or_paints(keys):
    assert collision(keys.all(), LEGO) == ""
    assert not {key.lower() for bound in keys.all().values() for key in bound} & set(KEYS)


def test_all_commands_answer_to_all_their_keys(window, keys):
    for command in COMMANDS:
        for key in command.keys:
            pressed = QKeySequence(key)[0]
            assert window.press_on(window.canvas, (pressed.key(), pressed.keyboardModifiers())) == [
                command.id
            ], key


def test_text_that_is_typed_stays_text(window):
    for field in (QLineEdit(), QPlainTextEdit(), QComboBox(editable=True)):
        window.add(field)
        target = window.focusWidget()
        QTest.keyClicks(target, "kl [,.]?-+0")
        for key in (Qt.Key_Left, Qt.Key_Right, Qt.Key_Home, Qt.Key_End, Qt.Key_Backspace):
            QTest.keyClick(target, key)
            QTest.keyClick(target, key, Qt.ShiftModifier)
        QTest.keyClick(target, Qt.Key_Z, Qt.ControlModifier)
        QTest.keyClick(target, Qt.Key_Left, Qt.ControlModifier)
        QTest.keyClick(target, Qt.Key_Delete, Qt.ControlModifier)
        assert window.did == [], type(field)


def test_what_was_typed_arrives(window):
    line = window.add(QLineEdit())
    QTest.keyClicks(line, "kl [,.]?-+0")
    QTest.keyClick(line, Qt.Key_Home)
    QTest.keyClick(line, Qt.Key_Delete)
    assert line.text() == "l [,.]?-+0"


def test_a_number_is_edited_without_moving_the_time(window):
    box = window.add(QDoubleSpinBox(decimals=3, maximum=100))
    box.selectAll()
    QTest.keyClicks(box, "1.250")
    QTest.keyClick(box, Qt.Key_Left)
    QTest.keyClick(box, Qt.Key_Backspace)
    QTest.keyClick(box, Qt.Key_PageUp)
    assert window.did == []
    assert box.value() == pytest.approx(11.2)


def test_a_cell_that_is_edited_keeps_its_keys_and_a_table_at_rest_does_not(window):
    table = QTableWidget(3, 2)
    table.setItem(0, 0, QTableWidgetItem("grab"))
    window.add(table)
    table.setCurrentCell(0, 0)
    # Delete is not: nobody who looks at a list of other things means a segment.
    assert window.press_on(table, Qt.Key_Space, Qt.Key_Left, Qt.Key_K, Qt.Key_Delete) == [
        "play",
        "step_back",
        "previous_segment",
    ]
    table.lists_segments = True
    assert window.press_on(table, Qt.Key_Delete) == ["delete"]
    table.editItem(table.item(0, 0))
    editor = table.findChild(QLineEdit)
    assert window.focusWidget() is editor
    window.did.clear()
    QTest.keyClicks(editor, "kl 1")
    QTest.keyClick(editor, Qt.Key_Left)
    QTest.keyClick(editor, Qt.Key_Escape)
    assert window.did == []
    assert table.item(0, 0).text() == "grab"


def test_up_and_down_stay_in_lists_and_ticks_are_set_by_space(window):
    table = QTableWidget(3, 1)
    box = QTableWidgetItem("shown")
    box.setCheckState(Qt.CheckState.Unchecked)
    table.setItem(0, 0, box)
    window.add(table)
    table.setCurrentCell(0, 0)
    assert window.press_on(table, Qt.Key_Space) == []
    assert box.checkState() == Qt.CheckState.Checked
    tree = window.add(QTreeWidget())
    assert window.press_on(tree, Qt.Key_Left, Qt.Key_Right) == []


def test_a_button_in_focus_is_pressed_by_space(window):
    pressed = []
    button = QPushButton(clicked=lambda: pressed.append(1))
    window.add(button)
    assert window.press_on(button, Qt.Key_Space) == []
    assert pressed == [1]
    box = window.add(QCheckBox())
    assert window.press_on(box, Qt.Key_Space, Qt.Key_K) == ["previous_segment"]
    assert box.isChecked()


def test_a_slider_in_focus_is_moved_by_its_keys(window):
    slider = window.add(QSlider(Qt.Orientation.Horizontal))
    assert window.press_on(slider, Qt.Key_Right, Qt.Key_Home, Qt.Key_Space) == ["play"]


def test_a_field_that_cannot_be_edited_keeps_nothing_plain(window):
    line = QLineEdit("log", readOnly=True)
    window.add(line)
    assert window.press_on(line, Qt.Key_K) == ["previous_segment"]


def test_commands_of_the_keyboard_work_while_one_types(window):
    line = window.add(QLineEdit())
    assert window.press_on(line, (Qt.Key_F, Qt.ControlModifier), Qt.Key_F1) == ["search", "manual"]


def test_the_program_is_not_told_twice_while_a_key_is_held(window):
    assert not window.actions_made["play"].autoRepeat()
    assert window.actions_made["step_forward"].autoRepeat()


def test_actions_say_their_keys(window):
    play = window.actions_made["play"]
    assert play.text() == "Play or pause"
    assert play.toolTip() == play.statusTip() == "Play or pause (Space)"
    assert window.actions_made["reset_layout"].toolTip() == "Reset layout"
    assert window.actions_made["snapping"].isCheckable()


def test_an_unknown_command_cannot_be_bound(app, keys):
    with pytest.raises(KeyError):
        bind(QWidget(), {"make_tea": print}, keys)


def test_another_key_counts_at_once_and_in_the_next_run(window, keys):
    keys.set_keys("play", ["F8", "ctrl+space"])
    assert window.press_on(window.canvas, Qt.Key_Space) == []
    assert window.press_on(window.canvas, Qt.Key_F8, (Qt.Key_Space, Qt.ControlModifier)) == [
        "play",
        "play",
    ]
    assert window.actions_made["play"].toolTip() == "Play or pause (F8, Ctrl+Space)"
    assert Keys()["play"] == ("F8", "Ctrl+Space")
    assert keys.changed_by_coder("play")
    keys.reset("play")
    assert not keys.changed_by_coder("play")
    assert Keys()["play"] == ("Space",)
    assert window.press_on(window.canvas, Qt.Key_Space) == ["play"]


def test_a_command_can_do_without_a_key(window, keys):
    keys.set_keys("delete", [])
    assert window.press_on(window.canvas, Qt.Key_Delete) == []
    assert Keys()["delete"] == ()


def test_all_keys_can_be_put_back(keys):
    keys.set_keys("play", ["F8"])
    keys.set_keys("quit", [])
    messages = []
    keys.changed.connect(lambda: messages.append(1))
    keys.reset_all()
    assert keys.all() == Keys().all()
    assert keys["play"] == ("Space",)
    assert messages == [1]


@pytest.mark.parametrize(
    ("key", "sentence"),
    [
        ("Ctrl+Z", "The key Ctrl+Z already means 'Undo'; give that another key first."),
        ("1", "The key 1 paints 'grab'; choose another one for 'Play or pause'."),
        ("Z", "The key Z is kept for painting actions; choose another one for 'Play or pause', "
         "such as Z together with Ctrl."),
        ("Ctrl+Wheel", "'Ctrl+Wheel' is no key; press another one."),
        ("", "'' is no key; press another one."),
        ("Ctrl+K, Ctrl+L", "'Ctrl+K, Ctrl+L' is no key; press another one."),
    ],
)  # fmt: skip
def test_a_key_that_cannot_be_had_is_refused_in_one_sentence(keys, key, sentence):
    before = keys.all()
    with pytest.raises(InputError) as refusal:
        keys.set_keys("play", [key], LEGO)
    assert str(refusal.value) == sentence
    assert keys.all() == before == Keys().all()


def test_a_default_that_was_given_away_is_not_taken_back_silently(keys):
    keys.set_keys("play", ["F8"])
    keys.set_keys("delete", ["Space"])
    with pytest.raises(InputError, match="already means 'Delete the segment'"):
        keys.reset("play")
    assert keys["play"] == ("F8",)


def test_settings_that_collide_are_not_used(caplog):
    settings.store("keys/play", ["Ctrl+W"])
    settings.store("keys/quit", ["Ctrl+W"])
    keys = Keys()
    assert (keys["play"], keys["quit"]) == (("Space",), ("Ctrl+Q",))
    assert "already means" in caplog.text


def test_keys_of_earlier_versions_count_before_newer_defaults(window):
    """There Home was free to be given away, and F1 meant what ? alone means now."""
    settings.store("keys/play", ["Home"])
    settings.store("keys/help", ["F1"])
    keys = Keys()
    assert (keys["play"], keys["help"]) == (("Home",), ("F1",))
    assert (keys["to_start"], keys["manual"]) == (("Ctrl+Home",), ())
    keys.reset("play")
    assert keys["to_start"] == ("Home", "Ctrl+Home")


def test_a_widget_that_is_gone_does_not_hear_of_new_keys(app, keys):
    import shiboken6

    widget = QWidget()
    bind(widget, {"play": print}, keys)
    shiboken6.delete(widget)
    keys.set_keys("play", ["F8"])


def test_a_list_of_choices_in_focus_leaves_the_timeline_its_keys(window):
    """Of the speeds, Home and End would otherwise be the first and last, 0.1x and 4x."""
    speed = window.add(QComboBox())
    speed.addItems(["0.1", "1", "4"])
    speed.setCurrentIndex(1)
    presses = (Qt.Key_Home, Qt.Key_End, (Qt.Key_Home, Qt.ControlModifier), Qt.Key_PageDown)
    assert window.press_on(speed, *presses) == [
        "to_start",
        "to_end",
        "to_start",
        "next_demonstration",
    ]
    assert speed.currentIndex() == 1
    assert window.press_on(speed, Qt.Key_Down) == []
    assert speed.currentIndex() == 2
