"""Preferences: their values, and the dialog in which they are found, changed and reset."""

import time

import pytest
import shiboken6
from factories import cached_project, make_foam_project
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QApplication,
    QCheckBox,
    QComboBox,
    QDockWidget,
    QDoubleSpinBox,
    QFileDialog,
    QLineEdit,
    QListWidget,
    QPushButton,
    QTreeWidget,
)
from window_helpers import PATIENCE, named, stored_rows

from forcelab.errors import InputError
from forcelab.gui import preferences, settings, theme
from forcelab.gui.label.ruler import Ruler
from forcelab.gui.label.tracks import AROUND
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.preferences import (
    HOLD_TIME,
    REACTION_TIME,
    SAMPLE_FOLDER,
    SNAPPING,
    TEXT_SIZE,
    THEME,
)
from forcelab.gui.preferences_dialog import PreferencesDialog
from forcelab.gui.project_actions import sample_place
from forcelab.gui.review.settings_dialog import SettingsDialog
from forcelab.gui.review.training_preferences import PRESET, PRESET_TEXTS, name_own_code
from forcelab.gui.shortcuts import keys
from forcelab.gui.window import Window
from forcelab.recognition import plugins
from forcelab.recognition.presets import PRESETS


@pytest.fixture
def window(app, window_of_file, tmp_path):
    path = cached_project(make_foam_project, tmp_path / "study.forcelab", ())
    window = window_of_file(LaunchOptions(project=path), size=(1024, 640))
    activate(window)
    size = app.font().pointSizeF()
    yield window
    for preference in (REACTION_TIME, SNAPPING):
        preference.reset()
    if app.font().pointSizeF() != size:
        theme.use_text_size(app, 100)
    if theme.colours() is not theme.LIGHT:
        theme.use_theme(app, "light")
    for dialog in window.findChildren(PreferencesDialog):
        shiboken6.delete(dialog)


def activate(window):
    """Bring a window to the front; of a dialog Qt says that it is active when its parent is."""
    window.activateWindow()
    deadline = time.monotonic() + PATIENCE
    while QApplication.activeWindow() is not window:
        assert time.monotonic() < deadline
        QTest.qWait(2)


def press_preferences(window):
    QTest.keyClick(window.label.tracks, Qt.Key.Key_Comma, Qt.KeyboardModifier.ControlModifier)
    [dialog] = window.findChildren(PreferencesDialog)
    activate(dialog)
    return dialog


@pytest.fixture
def dialog(window):
    return press_preferences(window)


def click(widget):
    QTest.mouseClick(widget, Qt.MouseButton.LeftButton)


def type_into(box, text):
    """Type a number, as a person does, and leave the field by Tab."""
    QTest.keyClick(box, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
    QTest.keyClicks(box, text)
    QTest.keyClick(box, Qt.Key.Key_Tab)


def subjects(dialog):
    rows = [dialog.subjects.item(i) for i in range(dialog.subjects.count())]
    return [row.text() for row in rows if not row.isHidden()]


def labels(dialog):
    """The settings that can be seen on the page in front."""
    page = dialog.pages[dialog.subjects.currentItem().text()]
    return [
        row.words.partition(row.preference.field.tip)[0].strip()
        for row in page.rows
        if not row.isHidden() and hasattr(row, "preference")
    ]


def reset_of(dialog, label):
    return named(dialog, QPushButton, f"Reset: {label}")


def test_what_is_stored_and_sound_counts_and_the_default_is_not_stored():
    assert (REACTION_TIME.value, HOLD_TIME.value, SNAPPING.value) == (0, 250, True)
    settings.store("labelling/reaction_ms", 180.0)  # as of older versions
    settings.store("labelling/hold_ms", 1e9)
    settings.store("window/theme", "pink")
    assert (REACTION_TIME.value, HOLD_TIME.value, THEME.value) == (180, 250, "system")
    HOLD_TIME.set_value(400)
    assert settings.number("labelling/hold_ms", 0) == 400
    HOLD_TIME.reset()
    assert "labelling/hold_ms" not in settings.settings().allKeys()


def test_presets_are_those_that_exist():
    assert [value for value, _ in PRESET.field.options] == [*PRESET_TEXTS] == [*PRESETS]
    assert PRESET.default in PRESETS


def test_the_key_opens_one_dialog_and_the_keys_are_a_page_of_it(window, dialog):
    assert dialog.search.hasFocus()
    assert dialog.subjects.currentItem().text() == "Coder"
    activate(window)
    assert press_preferences(window) is dialog
    window.commands["change_keys"].trigger()
    assert window.findChildren(PreferencesDialog) == [dialog]
    assert dialog.subjects.currentItem().text() == "Keys"
    QTest.keyClick(dialog.search, Qt.Key.Key_Escape)
    assert not dialog.isVisible()


def test_a_search_finds_settings_by_words_of_label_help_and_choices(dialog):
    QTest.keyClicks(dialog.search, "HELD press")
    assert subjects(dialog) == ["Labelling"]
    assert labels(dialog) == ["Hold time"]
    dialog.search.clear()
    QTest.keyClicks(dialog.search, "dark")
    assert (subjects(dialog), labels(dialog)) == (["Appearance", "Keys"], ["Theme"])
    dialog.search.clear()
    QTest.keyClicks(dialog.search, "median filter")  # within the settings of a task
    assert subjects(dialog) == ["Training"]
    dialog.search.clear()
    QTest.keyClicks(dialog.search, "split the")
    assert subjects(dialog) == ["Keys"]
    QTest.keyClick(dialog.search, Qt.Key.Key_Return)
    table = dialog.focusWidget()
    assert table.currentItem().text(0) == "Split the segment at the cursor"
    QTest.keyClick(table, Qt.Key.Key_Return)
    assert dialog.isVisible()
    QTest.keyClick(dialog.focusWidget(), Qt.Key.Key_F12)
    assert keys()["split"] == ("F12",)
    keys().reset_all()
    dialog.search.clear()
    QTest.keyClicks(dialog.search, "make tea")
    assert subjects(dialog) == []
    assert dialog.findChild(QTreeWidget).isVisible() is False
    QTest.keyClick(dialog.search, Qt.Key.Key_Return)  # leads nowhere
    dialog.search.clear()
    assert len(subjects(dialog)) == len(dialog.pages)


def test_the_theme_changes_at_once_and_follows_the_menu(window, dialog):
    dialog.show_page("Appearance")
    box = named(dialog, QComboBox, "Theme")
    box.setFocus()
    QTest.keyClick(box, Qt.Key.Key_End)
    assert (THEME.value, theme.colours()) == ("dark", theme.DARK)
    assert window.commands["theme_dark"].isChecked()
    window.commands["theme_light"].trigger()
    assert (box.currentText(), theme.colours()) == ("Light", theme.LIGHT)


def test_letters_grow_at_once_and_all_of_them(window, dialog, app):
    def title_width():
        image = window.findChild(QDockWidget, "demonstrations").grab().toImage()
        dark = [x for x in range(150) for y in range(5, 20) if image.pixelColor(x, y).value() < 128]
        return max(dark) - min(dark)

    dialog.show_page("Appearance")
    size, wide = app.font().pointSizeF(), title_width()
    type_into(named(dialog, QDoubleSpinBox, "Text size"), "150")
    assert TEXT_SIZE.value == 150
    for widget in (window.label.tracks, dialog.search, window.menuBar(), window.demonstrations):
        assert widget.font().pointSizeF() == pytest.approx(1.5 * size)
    assert title_width() > 1.2 * wide
    times, table = window.label.transport.time, window.label.segments.table
    assert times.width() > times.fontMetrics().horizontalAdvance("00000.000")
    assert table.verticalHeader().defaultSectionSize() > 1.4 * table.fontMetrics().height()
    click(reset_of(dialog, "Text size"))
    assert dialog.search.font().pointSizeF() == size


def test_plots_and_tracks_grow_with_the_letters(window, dialog, app):
    label = window.label
    label.document.open_demonstration(label.document.infos[0].id)
    [ruler] = window.findChildren(Ruler)

    def sizes():
        app.processEvents()
        axis = label.force._lane_axes[0]
        return (
            axis.style["tickFont"].pixelSize(),
            axis.size().width(),
            label.force.plot.left(),
            ruler.height(),
            ruler._numbers.style["tickFont"].pixelSize(),
            label.tracks.minimumSizeHint().height() - 2 * AROUND,
            label.overview.height(),
            label.scalogram._frequencies.size().width(),
        )

    usual = sizes()
    dialog.show_page("Appearance")
    type_into(named(dialog, QDoubleSpinBox, "Text size"), "150")
    assert sizes() == pytest.approx([1.5 * size for size in usual], abs=1)
    type_into(named(dialog, QDoubleSpinBox, "Text size"), "200")
    assert sizes() == pytest.approx([2.0 * size for size in usual], abs=1)
    click(reset_of(dialog, "Text size"))
    assert sizes() == usual


def test_a_small_screen_holds_the_window_in_larger_letters(window, app):
    window.document.open_demonstration(window.document.infos[0].id)
    theme.use_text_size(app, 150)
    for workspace in ("label", "review", "capture"):
        window.show_workspace(workspace)
        window.label.transport.frame.say("frame 1000", "frame 1000")
        app.processEvents()
        assert window.minimumSizeHint().width() <= 1024, workspace


def test_the_hold_time_is_obeyed_by_the_keys_of_labels(window, dialog):
    document, tracks = window.document, window.label.tracks

    def hold_and_move(milliseconds, start):
        activate(window)
        tracks.setFocus()
        document.view.seek(start)
        QTest.keyPress(tracks, Qt.Key.Key_1)
        time.sleep(milliseconds / 1000)
        document.view.seek(start + 0.5)
        QTest.keyRelease(tracks, Qt.Key.Key_1)

    dialog.show_page("Labelling")
    box = named(dialog, QDoubleSpinBox, "Hold time")
    type_into(box, "2000")
    hold_and_move(0, 1.0)
    assert document.stroke is not None  # that was a short press
    document.cancel_stroke()
    activate(dialog)
    type_into(box, "50")
    hold_and_move(80, 1.0)
    assert document.stroke is None
    [(start, end, action)] = stored_rows(document)
    assert (start, end) == (1.0, 1.5)
    assert action == document.vocabulary.names[0]
    click(reset_of(dialog, "Hold time"))
    assert (HOLD_TIME.value, box.value()) == (250, 250)
    assert not reset_of(dialog, "Hold time").isEnabled()


def test_the_controls_below_the_timeline_and_the_dialog_show_the_same(window, dialog):
    dialog.show_page("Labelling")
    transport = window.label.transport
    type_into(named(dialog, QDoubleSpinBox, "Reaction time"), "180")
    assert transport.reaction.value() == 180
    transport.reaction.setValue(90)
    assert named(dialog, QDoubleSpinBox, "Reaction time").value() == 90
    snap = named(dialog, QCheckBox, "Snapping")
    QTest.mouseClick(snap, Qt.MouseButton.LeftButton, pos=QPoint(8, snap.height() // 2))
    assert not window.document.view.snapping
    assert not transport.buttons["magnet"].isChecked()
    assert not window.commands["snapping"].isChecked()
    click(transport.buttons["magnet"])
    assert snap.isChecked()


def test_a_page_is_reset_and_no_other(dialog):
    HOLD_TIME.set_value(400)
    REACTION_TIME.set_value(90)
    THEME.set_value("dark")
    keys().set_keys("play", ["F8"])
    reset = named(dialog, QPushButton, "Reset this page")
    dialog.show_page("Labelling")
    click(reset)
    assert (HOLD_TIME.value, REACTION_TIME.value, THEME.value) == (250, 0, "dark")
    assert keys()["play"] == ("F8",)
    dialog.show_page("Keys")
    QTest.keyClicks(dialog.search, "split")
    click(reset)
    assert keys()["play"] == ("F8",)  # which the search hides
    dialog.search.clear()
    click(reset)
    assert keys()["play"] == ("Space",)
    assert THEME.value == "dark"


def test_the_coder_is_changed_and_reset_while_there_is_a_project(
    window, dialog, hovered, monkeypatch
):
    monkeypatch.setattr("getpass.getuser", lambda: "grace")
    box = named(dialog, QComboBox, "Coder")
    assert box.currentText() == "Ann"
    click(reset_of(dialog, "You label as"))
    assert (window.document.author, box.currentText()) == ("Grace", "Grace")
    assert settings.coder(window.document.project.path) == "Grace"
    assert not reset_of(dialog, "You label as").isEnabled()
    # What belongs to a project waits for one.
    automatic = named(dialog, QCheckBox, "Train automatically")
    dialog.show_page("Training")
    click(automatic)
    assert window.review.trainer.automatic
    window.document.close()
    assert not automatic.isEnabled()
    assert not box.isEnabled()
    dialog.show_page("Coder")
    assert hovered(box.parentWidget()) == "Open a project first."


def test_a_task_without_settings_of_its_own_follows_the_preset(window, dialog):
    trainer = window.review.trainer
    assert trainer.preset_used == ("ensemble", False)
    dialog.show_page("Training")
    box = named(dialog, QComboBox, "Preset of new tasks")
    box.setFocus()
    QTest.keyClick(box, Qt.Key.Key_F)  # of fast
    assert (PRESET.value, trainer.settings) == ("fast", PRESETS["fast"])
    button = named(dialog, QPushButton, "foam: fast…")
    click(button)
    [chosen] = dialog.findChildren(SettingsDialog)
    chosen.presets.setCurrentText("paper")
    chosen.presets.activated.emit(chosen.presets.currentIndex())
    click(chosen.ok)
    assert button.text() == "foam: paper…"
    click(reset_of(dialog, "Preset of new tasks"))
    assert trainer.settings == PRESETS["paper"]


def test_code_of_ones_own_is_named_and_what_is_wrong_with_it_said(dialog, tmp_path, monkeypatch):
    (tmp_path / "lab_of_preferences.py").write_text("def make():\n    pass\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(plugins, "_named", {"classifier": {}, "features": {}})
    dialog.show_page("Training")
    line = named(dialog, QLineEdit, "Your own classifiers")

    def trouble():
        return line.parentWidget().parentWidget().trouble.text()

    def write(text):
        line.setText(text)
        QTest.keyClick(line, Qt.Key.Key_Return)

    write("lab_of_preferences:make, lab_of_preferences")
    assert trouble() == "'lab_of_preferences' is no import path; write it as MODULE:FUNCTION."
    assert [*plugins.known_paths("classifier")] == ["lab_of_preferences:make"]
    write("lab_of_preferences:make, lab_of_preferences:no")
    assert "'lab_of_preferences:no' cannot be loaded (AttributeError" in trouble()
    write("lab_of_preferences:make")
    assert trouble() == ""
    plugins.prefer("classifier", ())
    name_own_code()  # as in another start
    assert plugins.load_plugin("classifier", "lab_of_preferences:make")() is None
    click(reset_of(dialog, "Your own classifiers"))
    assert plugins.known_paths("classifier") == {}
    with pytest.raises(InputError, match="code from outside forcelab"):
        plugins.load_plugin("classifier", "lab_of_preferences:make")


def test_recent_projects_are_removed_and_the_sample_goes_elsewhere(
    window, dialog, tmp_path, monkeypatch
):
    for name in "abc":
        settings.remember_project(tmp_path / f"{name}.forcelab")
    window.opening.recent_changed.emit()
    dialog.show_page("Files")
    listed = named(dialog, QListWidget, "Recent projects")
    remove = named(dialog, QPushButton, "Remove the selected projects from the list")
    assert not remove.isEnabled()
    QTest.mouseClick(
        listed.viewport(),
        Qt.MouseButton.LeftButton,
        pos=listed.visualItemRect(listed.item(1)).center(),
    )
    click(remove)
    assert [path.stem for path in settings.recent_projects()] == ["c", "a", "study"]
    assert listed.count() == 3
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_: str(tmp_path))
    click(named(dialog, QPushButton, "Choose: Folder of the sample project"))
    assert sample_place() == tmp_path / "sample.forcelab"
    click(reset_of(dialog, "Folder of the sample project"))
    assert sample_place().parent == SAMPLE_FOLDER.default
    settings.store(SAMPLE_FOLDER.field.name, str(tmp_path / "gone"))
    assert sample_place().parent == SAMPLE_FOLDER.default


def test_everything_is_remembered_after_a_restart(window, dialog, app):
    dialog.show_page("Labelling")
    type_into(named(dialog, QDoubleSpinBox, "Reaction time"), "180")
    snap = named(dialog, QCheckBox, "Snapping")
    snap.setFocus()
    QTest.keyClick(snap, Qt.Key.Key_Space)
    window.close()
    settings.settings().sync()
    settings._opened.cache_clear()
    again = Window("Ann", remembering=False)
    assert again.label.transport.reaction.value() == 180
    assert not again.document.view.snapping
    assert not again.commands["snapping"].isChecked()
    again.close()


def test_every_page_fits_a_small_window_and_says_what_everything_is(dialog):
    declared = [value for name, value in vars(preferences).items() if name.isupper()]
    fields = {getattr(item, "field", item) for item in declared}
    rows = [row for page in dialog.pages.values() for row in getattr(page, "rows", ())]
    shown = {row.preference.field for row in rows if hasattr(row, "preference")}
    assert fields < shown
    assert all(field.tip.endswith(".") and field.label for field in shown)
    for name in dialog.pages:
        dialog.show_page(name)
        assert dialog.minimumSizeHint().width() < 640
        for kind in (QComboBox, QAbstractSpinBox, QCheckBox, QPushButton, QListWidget):
            for widget in dialog.findChildren(kind):
                assert widget.accessibleName() or not widget.isVisible(), (name, widget)
