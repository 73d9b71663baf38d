"""The settings dialog: only what is used is shown, and what is refused says why in its place."""

import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit
from window_helpers import open_training_document

from forcelab.gui.review.settings_dialog import SettingsDialog, TrainingFacts, training_facts
from forcelab.gui.review.training_preferences import TrainingChoice
from forcelab.label_map import MergeMap
from forcelab.recognition.presets import PRESETS, preset
from forcelab.recognition.settings import Settings


@pytest.fixture
def facts(app):
    return TrainingFacts(
        ("tangential 1", "normal 1"), 1000.0, 60.0, frozenset({"grab", "hold", "hodl"})
    )


@pytest.fixture
def dialog(facts, show):
    return show(SettingsDialog(preset("paper"), facts))


def is_row_visible(dialog, name):
    return dialog.form.editors[name].isVisible()


def test_a_preset_is_a_summary_until_it_is_changed(dialog):
    assert dialog.summary.isVisible()
    assert not is_row_visible(dialog, "stride")
    assert "1024 samples" in dialog.summary.text()
    assert not dialog.changed_label.isVisible()
    dialog.change.click()
    assert is_row_visible(dialog, "stride")
    dialog.form.editors["stride"].box.setValue(10)
    assert dialog.changed_label.isVisible()
    assert dialog.chosen == PRESETS["paper"].replace(stride=10)
    dialog.back.click()
    assert dialog.chosen == PRESETS["paper"]
    assert dialog.summary.isVisible()


def test_every_preset_is_told_and_can_be_taken(dialog):
    for name, settings in PRESETS.items():
        at = dialog.presets.findData(name)
        dialog.presets.setCurrentIndex(at)
        dialog.presets.activated.emit(at)
        assert dialog.about.text().endswith("."), name
        assert dialog.presets.itemData(at, Qt.ItemDataRole.ToolTipRole) == dialog.about.text(), name
        assert not dialog.changed_label.isVisible(), name
        assert ("Stride" in dialog.summary.text()) == (settings.stride > 1), name
        assert "Classifier" in dialog.summary.text()
        dialog.ok.click()
        assert dialog.chosen == settings, name
        dialog.show()


def test_opening_the_form_alone_changes_nothing_and_its_first_field_has_the_keyboard(dialog):
    dialog.change.click()
    assert dialog.focusWidget() is dialog.form.editors["features"].box
    dialog.form.settings()
    assert dialog.chosen == PRESETS["paper"]


@pytest.mark.parametrize(
    "settings",
    [
        Settings(),
        Settings(wavelet="haar", parameter=None),
        Settings(wavelet="dog", parameter=4.0, threshold=None, median=None, drop=None),
        Settings(classifier="naive-bayes", rate=123.4, seed=7, phase=False),
        Settings(channels=("normal 1",), drop=1 / 7, merge=MergeMap({"hodl": "hold"})),
        Settings(min_scale=2.75, max_scale=300.0, spacing=1 / 3),
    ],
)
def test_what_is_shown_is_what_was_given(facts, settings):
    assert SettingsDialog(settings, facts).chosen == settings


def test_what_does_not_apply_is_hidden(dialog):
    dialog.change.click()
    editors = dialog.form.editors
    assert is_row_visible(dialog, "parameter")
    editors["wavelet"].box.setCurrentIndex(5)
    assert editors["wavelet"].value() == "haar"
    assert not is_row_visible(dialog, "parameter")
    assert dialog.chosen.parameter is None
    editors["wavelet"].box.setCurrentIndex(4)
    assert dialog.chosen.parameter == 2.0  # the second derivative, not p = 5
    assert is_row_visible(dialog, "seed")
    editors["classifier"].box.setCurrentIndex(1)
    assert not is_row_visible(dialog, "seed")


def test_code_of_ones_own_is_in_the_lists(facts, show, monkeypatch):
    monkeypatch.setenv("FORCELAB_CLASSIFIERS", "mylab.models:make_forest")
    monkeypatch.setenv("FORCELAB_FEATURES", "mylab.signals:energy")
    dialog = show(SettingsDialog(preset("best"), facts))
    dialog.change.click()
    for name, text in (
        ("classifier", "mylab.models:make_forest"),
        ("features", "Level, slope and strength in windows + mylab.signals:energy"),
    ):
        box = dialog.form.editors[name].box
        box.setCurrentIndex(box.findText(text))
    assert dialog.chosen.classifier == "mylab.models:make_forest"
    assert dialog.chosen.features == "windows+mylab.signals:energy"
    assert is_row_visible(dialog, "amplitude")
    assert "and those of mylab.signals:energy, " in dialog.cost.text()  # not imported for this
    assert "Classifier: mylab.models:make_forest\n" in dialog.summary.text()
    box = dialog.form.editors["features"].box
    box.setCurrentIndex(box.findData("mylab.signals:energy"))
    assert not is_row_visible(dialog, "amplitude")
    assert dialog.cost.text().startswith("The features of mylab.signals:energy, ")


def test_a_long_path_makes_the_form_no_wider_than_the_dialog(facts, show, monkeypatch):
    monkeypatch.setenv("FORCELAB_FEATURES", "mylab.signals.energy:band_energy_of_the_forces")
    dialog = show(SettingsDialog(preset("best"), facts))
    dialog.change.click()
    QApplication.processEvents()
    assert not dialog._area.horizontalScrollBar().isVisible()
    box = dialog.form.editors["features"].box
    box.setCurrentIndex(box.count() - 1)
    assert box.toolTip() == box.currentText()
    QApplication.processEvents()
    assert dialog.form.width() <= dialog._area.viewport().width()


def test_settings_with_code_that_nobody_named_here_stay_as_they_are(facts):
    settings = Settings(classifier="mylab.models:make_forest", features="mylab.signals:energy")
    assert SettingsDialog(settings, facts).chosen == settings


def test_a_filter_can_be_switched_off_and_on_again(dialog):
    dialog.change.click()
    threshold = dialog.form.editors["threshold"]
    threshold.switch.setChecked(False)
    assert dialog.chosen.threshold is None
    assert not threshold.box.isVisible()
    threshold.switch.setChecked(True)
    assert dialog.chosen.threshold == 0.8


def test_what_is_refused_is_said_beneath_its_field(dialog):
    dialog.change.click()
    dialog.form.editors["max_scale"].box.setValue(1.0)
    assert dialog.chosen is None
    assert not dialog.ok.isEnabled()
    label = dialog.form.troubles["max_scale"]
    assert label.isVisible()
    assert label.text() == dialog.form.trouble != ""
    dialog.form.editors["max_scale"].box.setValue(64.0)
    assert not label.isVisible()
    assert dialog.ok.isEnabled()
    assert dialog.chosen.max_scale == 64.0


def test_without_a_channel_it_says_so(dialog):
    dialog.change.click()
    for box in dialog.form.editors["channels"].boxes.values():
        box.setChecked(False)
    assert dialog.chosen is None
    assert dialog.form.troubles["channels"].isVisible()
    dialog.form.editors["channels"].boxes["normal 1"].setChecked(True)
    assert dialog.chosen.channels == ("normal 1",)


def test_scales_and_cost_follow_what_is_set(dialog):
    # 2 .. 1024 in octaves; p = 5 answers to 1 / (1.2327 * scale) of the rate.
    assert dialog.scales.text().startswith("10 scales, 0.79")
    assert "at 1000 Hz" in dialog.scales.text()
    assert dialog.cost.text().startswith("40 features, 60,000 labelled")
    dialog.change.click()
    dialog.form.editors["stride"].box.setValue(10)
    dialog.form.editors["phase"].box.setChecked(False)
    dialog.form.editors["spacing"].box.setValue(0.5)
    assert dialog.scales.text().startswith("19 scales")
    assert dialog.cost.text().startswith("38 features, 6,000 labelled")


def test_the_merge_map_is_a_table_that_flags_what_nobody_labelled(dialog):
    dialog.change.click()
    merge = dialog.form.editors["merge"]
    merge.table.item(0, 0).setText("hodl")
    assert dialog.chosen is None  # no second name yet
    assert dialog.form.troubles["merge"].isVisible()
    merge.table.item(0, 1).setText("hold")
    assert dialog.chosen.merge == MergeMap({"hodl": "hold"})
    assert not merge.remark.isVisible()
    merge.table.item(1, 0).setText("graab")
    merge.table.item(1, 1).setText("grab")
    assert "graab" in merge.remark.text()
    assert merge.unknown() == ("graab",)
    merge.table.item(2, 0).setText("hodl")
    merge.table.item(2, 1).setText("grab")
    assert "twice" in dialog.form.trouble


def test_a_merge_is_written_by_mouse_and_keys(app, dialog, until):
    dialog.change.click()
    editor = dialog.form.editors["merge"]
    dialog.activateWindow()
    app.processEvents()
    assert editor.hint.isVisible()
    dialog._area.ensureWidgetVisible(editor.table)
    where = editor.table.visualItemRect(editor.table.item(0, 0)).center()
    QTest.mouseClick(editor.table.viewport(), Qt.MouseButton.LeftButton, pos=where)
    line = QApplication.focusWidget()
    assert isinstance(line, QLineEdit), "a click was to begin the writing"
    offered = line.completer()
    offered.setCompletionPrefix("ho")
    assert [offered.currentCompletion(), offered.completionCount()] == ["hodl", 2]
    QTest.keyClicks(line, "hodl")
    QTest.keyClick(line, Qt.Key.Key_Return)
    until(lambda: editor.lines() == [("hodl", "")])
    assert dialog.isVisible(), "Return in a cell is not the dialog's"
    assert "needs two names" in dialog.form.troubles["merge"].text()
    editor.table.item(0, 1).setText("hold")
    assert dialog.chosen.merge == MergeMap({"hodl": "hold"})
    assert editor.table.rowCount() == 2


def test_the_demonstrations_say_what_there_is(app):
    with open_training_document() as document:
        facts = training_facts(document, TrainingChoice(("foam", "stylus")))
        assert facts.channels == ("tangential", "normal")
        assert facts.rate == pytest.approx(100.0)
        assert facts.labelled == pytest.approx(4 * 5.0)
        assert facts.spellings == {"grab", "hold"}
        assert training_facts(document, TrainingChoice(("nothing",))).channels == ()


def test_only_the_time_that_is_trained_on_is_counted(app):
    with open_training_document() as document:
        document.set_author("Root")
        foam = TrainingChoice(("foam",))
        assert training_facts(document, foam).labelled == pytest.approx(2 * 5.0)
        for info in document.infos[:2]:
            document.open_demonstration(info.id)
            document.editor.paint(0, 3, "grab")
        assert training_facts(document, foam).labelled == pytest.approx(2 * 3.0)
        assert training_facts(
            document, TrainingChoice(("foam",), author="Ann")
        ).labelled == pytest.approx(10.0)


def test_of_two_scales_that_cannot_be_together_one_is_marked_though_both_are_new(facts):
    dialog = SettingsDialog(preset("paper").replace(min_scale=64.0), facts)
    for name, value in (("max_scale", 16.0), ("min_scale", 2000.0)):
        dialog.form.editors[name].box.setValue(value)
    marked = [name for name, label in dialog.form.troubles.items() if label.text()]
    assert marked == ["min_scale"]


@pytest.mark.parametrize(
    ("name", "value"),
    [("seed", 2**32 - 1), ("rate", 2e5), ("median", 200_001), ("drop", 200.0), ("step", 20.0)],
)
def test_what_a_script_has_set_is_shown_and_kept_however_large(facts, name, value):
    settings = preset("paper").replace(**{name: value})
    dialog = SettingsDialog(settings, facts)
    assert dialog.chosen == settings
    assert type(getattr(dialog.chosen, name)) is type(value)


def test_the_wheel_scrolls_the_form_and_changes_no_field_on_its_way(dialog):
    dialog.change.click()
    before = dialog.chosen
    for name in ("max_scale", "wavelet"):
        field = dialog.form.editors[name].box
        field.clearFocus()
        wheel = QWheelEvent(
            QPointF(5, 5), QPointF(field.mapToGlobal(QPoint(5, 5))), QPoint(), QPoint(0, -120),
            Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier,
            Qt.ScrollPhase.NoScrollPhase, False,
        )  # fmt: skip
        QApplication.sendEvent(field, wheel)
        assert not wheel.isAccepted(), "the form gets it"
    assert dialog.chosen == before
