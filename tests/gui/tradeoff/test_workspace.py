"""The Trade-off workspace: what it says before there is anything, and what leads where."""

import pytest
from learning_bench import FakeWork
from painted import shown
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from forcelab.jobs import Progress
from forcelab.measure.rows import Row

from .conftest import PAPER, measured_of, spot_of


@pytest.fixture
def workspace(app, measuring, until):
    from forcelab.gui.tradeoff.workspace import TradeoffWorkspace

    workspace = TradeoffWorkspace(measuring)
    with shown(app, workspace, (900, 600)):
        measuring.set_front(True)
        until(lambda: not measuring.reading)
        yield workspace


def table_of(workspace):
    model = workspace.table.model()
    return [
        [model.index(row, column).data() for column in range(model.columnCount())]
        for row in range(model.rowCount())
    ]


def test_the_table_has_every_figure_and_marks_use_and_front(workspace):
    rows = table_of(workspace)
    assert rows[0] == [
        "●", "paper", "50.0", "75.0", "50.0", "40.0", "40", "120", "0.80", "20.00", "2.0"
    ]  # fmt: skip
    assert [row[0] for row in rows] == ["●", "◆", "", "◆"]
    assert workspace.told.text().startswith("paper: F1@50 50.0 %")
    off = "half of the boundaries at most 40 ms off, nine in ten 120 ms"
    assert off in workspace.told.text()


def test_other_axes_draw_another_front(workspace):
    bar = workspace.bar
    bar.time.setCurrentIndex(1)
    bar.time.activated.emit(1)
    assert [row[0] for row in table_of(workspace)] == ["●", "", "", "◆"]
    bar.error.setCurrentIndex(2)
    bar.error.activated.emit(2)
    assert [point.error for point in workspace.plot.points] == [40.0, 10.0, 60.0, 5.0]


def test_a_click_in_the_plot_adopts(workspace, measuring):
    spot = spot_of(workspace.plot, 1).toPoint()
    assert not workspace.bar.back.isVisible()
    QTest.mouseClick(workspace.plot, Qt.MouseButton.LeftButton, pos=spot)
    assert measuring.learning.settings.preset == "fast"
    assert [row[0] for row in table_of(workspace)] == ["", "●◆", "", "◆"]
    assert workspace.plot.current == 1
    QTest.mouseClick(workspace.bar.back, Qt.MouseButton.LeftButton)
    assert measuring.learning.settings == PAPER
    assert workspace.plot.current == 0


def test_enter_in_the_table_adopts_and_its_rows_are_marked_in_the_plot(workspace, measuring):
    workspace.table.setFocus()
    workspace.table.selectRow(3)
    assert workspace.plot.looked_at == 3
    assert workspace.told.text().startswith("classifier: logistic")
    assert measuring.learning.settings == PAPER  # to look at it changes nothing
    QTest.keyClick(workspace.table, Qt.Key.Key_Return)
    assert measuring.learning.settings.classifier == "logistic"


def test_what_is_pointed_at_in_the_plot_is_selected_in_the_table(workspace):
    QTest.mouseMove(workspace.plot, spot_of(workspace.plot, 2).toPoint())
    assert workspace.table.currentIndex().row() == 2
    assert workspace.told.text().startswith("phase: none")


def test_the_bar_says_when_on_whose_labels_and_what_was_edited_since(workspace, measuring):
    standing = workspace.bar.standing
    assert "on 2 demonstrations labelled by Ann · no change since" in standing.text
    measuring.edits = 3
    measuring.changed.emit()
    assert standing.text.endswith("3 changes since")
    measuring.learning.set_settings(PAPER.replace(stride=77))
    assert standing.text.endswith("the settings in use were not measured")


def test_a_refused_setting_stays_in_the_table_with_its_reason(workspace, measuring, document):
    refused = Row("stride", "none", "foam", "labels", refusal="Too few samples; label more.")
    measuring._show(measured_of(document.project, extra=[refused]))
    assert table_of(workspace)[4][:3] == ["", "stride: none", "–"]
    workspace.table.selectRow(4)
    assert workspace.told.text() == "stride: none: Too few samples; label more."
    before = measuring.learning.settings
    QTest.keyClick(workspace.table, Qt.Key.Key_Return)
    assert measuring.learning.settings == before
    assert "Too few samples" in document.told[-1][0]


def test_progress_and_cancel_are_there_while_it_measures(workspace, measuring, work, until):
    bar = workspace.bar
    assert bar.measure.isVisible()
    assert not bar.cancel.isVisible()
    work.steps, work.gate = [Progress(3, 10, "preset best: 2 of 5")], False
    QTest.mouseClick(bar.measure, Qt.MouseButton.LeftButton)
    until(lambda: bar.standing.text == "preset best: 2 of 5")
    assert (bar.progress.value(), bar.progress.maximum()) == (3, 10)
    assert not bar.measure.isVisible()
    QTest.mouseClick(bar.cancel, Qt.MouseButton.LeftButton)
    assert bar.measure.isVisible()
    assert "no change since" in bar.standing.text


def test_without_a_measurement_it_says_what_to_do(workspace, measuring, until):
    assert not workspace.empty.isVisible()
    measuring.learning.set_task("stylus")
    until(lambda: not measuring.reading)
    assert workspace.empty.isVisible()
    assert "Nothing was measured for 'stylus' yet" in workspace.empty.text()
    assert workspace.bar.measure.isEnabled()
    assert not workspace.bar.error.isVisible()


def test_without_labels_or_project_it_says_what_is_missing(workspace, measuring, document, until):
    document.project.coding.assign(document.infos[0].id, "Bo", blind=True)
    document.set_author("Bo")
    until(lambda: not measuring.reading)
    measuring._show(None)
    assert "two labelled demonstrations are needed" in workspace.empty.text()
    assert "Labelled so far: 0." in workspace.empty.text()
    assert not workspace.bar.measure.isEnabled()
    document.close()
    assert "Open a project" in workspace.empty.text()


def test_the_tab_builds_nothing_before_it_is_shown(app, document, jobs, until):
    from forcelab.gui.review.trainer import Trainer
    from forcelab.gui.tradeoff.tab import TradeoffTab

    tab = TradeoffTab(document, jobs, Trainer(document, jobs, work=FakeWork()))
    tab.come_to_front(False)
    tab.reset_layout()
    assert tab._built is None
    assert tab.settled
    with shown(app, tab, (800, 500)):
        tab.come_to_front(True)
        until(lambda: tab.settled)
        assert "Nothing was measured" in tab.workspace.empty.text()
    document.close()
