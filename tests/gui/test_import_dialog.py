"""The dialog that imports recordings: what goes in, and what is open afterwards."""

from itertools import pairwise
from pathlib import Path

import pytest
from painting_bench import demonstration
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QComboBox, QMessageBox

from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.importing import ImportDialog
from forcelab.gui.jobs import Jobs
from forcelab.project import Project

FOAM = Path(__file__).parents[2] / "assets" / "foam-01.csv"


@pytest.fixture
def document(app, tmp_path):
    path = tmp_path / "study.forcelab"
    Project.create(path).close()
    document = Document("Ann")
    document.open_project(path)
    yield document
    document.close()


@pytest.fixture
def dialog(document):
    jobs = Jobs()
    dialog = ImportDialog(document, jobs, files=[FOAM, FOAM.with_name("none.csv")])
    dialog.show()
    yield dialog
    dialog.close()
    jobs.close()


def test_delete_leaves_a_file_out_and_the_first_import_is_opened(document, dialog, until):
    dialog._files.setCurrentRow(1)
    dialog._files.setFocus()
    dialog._files.actions()[0].trigger()
    assert dialog._files.count() == 1
    QTest.mouseClick(dialog._go, Qt.MouseButton.LeftButton)
    until(lambda: document.id, 20.0)
    assert document.demonstration.name == "foam-01"
    assert "1 new" in dialog._told.text()


def test_files_that_cannot_be_read_are_selected_to_be_left_out(document, dialog, tmp_path, until):
    notes = tmp_path / "notes.csv"
    notes.write_text("nothing to see")
    dialog.add_files([notes])
    right, *wrong = dialog._chosen()
    dialog._go.click()
    until(dialog._told.text)
    assert [item.text() for item in dialog._files.selectedItems()] == wrong
    assert "(none.csv, notes.csv)" in dialog._told.text()
    QTest.keyClick(dialog._files, Qt.Key.Key_Delete)
    assert dialog._chosen() == [right]
    assert dialog._report.isHidden()  # it told of files that are not in the list any more
    dialog._go.click()
    until(lambda: document.infos)


def test_with_every_file_left_out_there_is_nothing_to_import(dialog):
    dialog._files.selectAll()
    dialog._files.actions()[0].trigger()
    assert not dialog._go.isEnabled()


def test_a_rate_that_is_given_is_no_longer_asked_for(document, tmp_path):
    plain = tmp_path / "plain.csv"
    plain.write_text("fx,fy,fz\n" + "0.1,0.2,0.3\n0.2,0.1,0.5\n" * 20)
    jobs = Jobs()
    dialog = ImportDialog(document, jobs, files=[plain])
    heading = dialog.columns.heading
    assert "give the sample rate" in heading.text()
    assert heading.styleSheet()
    dialog._rate.setValue(200.0)
    assert heading.text() == "Columns of plain.csv, and what each is read as:"
    assert not heading.styleSheet()
    dialog._rate.setValue(0.0)
    assert "give the sample rate" in heading.text()
    dialog.close()
    jobs.close()


def test_files_are_looked_for_where_the_last_ones_were_chosen(dialog, tmp_path, monkeypatch):
    asked = []

    def choose(_parent, _title, folder):
        asked.append(Path(folder))
        return [str(FOAM)], ""

    monkeypatch.setattr("PySide6.QtWidgets.QFileDialog.getOpenFileNames", choose)
    settings.remember_project(tmp_path / "study.forcelab")
    dialog._choose()
    dialog._choose()
    assert asked == [tmp_path, FOAM.parent]


def test_labels_are_the_files_own_unless_a_coder_is_chosen(document, dialog, until):
    dialog._files.item(1).setSelected(True)
    dialog._remove()
    assert dialog._author.currentText() == "coder"
    assert dialog._author.findText("Ann") > 0
    dialog._go.click()
    until(lambda: document.id, 20.0)
    assert [author.name for author in document.project.authors()] == ["coder"]


@pytest.mark.parametrize(("answer", "tasks"), [(0, ("foam",)), (1, ("Foam", "foam"))])
def test_a_task_that_differs_by_case_alone_is_asked_about(
    document, dialog, until, monkeypatch, answer, tasks
):
    with Project.open(document.project.path) as other:
        other.add(demonstration())  # of task foam
    asked = []

    def press(box):
        asked.append((box.text(), [button.text() for button in box.buttons()]))
        box.buttons()[answer].click()

    monkeypatch.setattr(QMessageBox, "exec", press)
    dialog._files.item(1).setSelected(True)
    dialog._remove()
    dialog._task.setCurrentText(" Foam ")
    dialog._go.click()
    until(lambda: "1 new" in dialog._told.text(), 20.0)
    assert asked == [("There is 'foam' already.", ["Use 'foam'", "Add 'Foam'"])]
    assert sorted(document.project.tasks()) == list(tasks)


def test_a_missing_task_is_warned_of_plainly(dialog):
    assert dialog._taskless.isVisible()
    assert dialog._go.text() == "Import without a task"
    dialog._task.setCurrentText("stylus")
    assert not dialog._taskless.isVisible()
    assert dialog._go.text() == "Import"


GERMAN = "Uhrzeit;Paket;Kraft_x;Taster\n" + "".join(
    f"31.05.2024 12:00:{row // 50:02},{row % 50 * 20:03};{65500 + row};0,{row % 11};{row % 2}\n"
    for row in range(150)
)


@pytest.fixture
def german(dialog, tmp_path):
    """The dialog with a table of one's own in place of the files."""
    path = tmp_path / "VP07.csv"
    path.write_text(GERMAN)
    dialog._files.selectAll()
    dialog._remove()
    dialog.add_files([path])
    return dialog


def read_as(dialog):
    return {one.name: one.use for one in dialog.columns.uses}


def choose(dialog, name, use):
    row = [one.name for one in dialog.columns.uses].index(name)
    box = dialog.columns.table.cellWidget(row, 2).findChild(QComboBox)
    box.setCurrentIndex(box.findData(use))
    box.activated.emit(box.currentIndex())


def test_the_choices_do_not_touch(german, app):
    table = german.columns.table
    app.processEvents()
    boxes = [table.cellWidget(row, 2).findChild(QComboBox) for row in range(3)]
    tops = [box.mapTo(table, box.rect().topLeft()).y() for box in boxes]
    assert min(b - a - boxes[0].height() for a, b in pairwise(tops)) >= 4


def test_the_columns_are_shown_as_they_will_be_read(german):
    assert read_as(german) == {
        "Uhrzeit": "times",
        "Paket": "counter",
        "Kraft_x": "signal",
        "Taster": "signal",
    }
    german._files.selectAll()
    german._remove()
    assert not german.columns.isVisible()


def test_a_column_that_is_left_out_is_no_channel(document, german, until):
    choose(german, "Taster", "left out")
    german._go.click()
    until(lambda: document.id, 20.0)
    assert [channel.name for channel in document.demonstration.channels] == ["Kraft_x"]
    assert document.demonstration.duration == pytest.approx(3.0)


def test_what_is_taken_for_a_counter_can_be_made_a_signal(document, german, until):
    choose(german, "Paket", "signal")
    assert read_as(german)["Paket"] == "signal"
    german._go.click()
    until(lambda: document.id, 20.0)
    assert "Paket" in [channel.name for channel in document.demonstration.channels]


def test_without_its_times_a_table_goes_by_its_counter_and_rate(document, german, until):
    choose(german, "Uhrzeit", "left out")
    assert "counts its samples" in german.columns.heading.text()
    german._rate.setValue(100.0)
    german._go.click()
    until(lambda: document.id, 20.0)
    assert document.demonstration.duration == pytest.approx(1.5)


def test_a_choice_that_cannot_be_is_told_at_once_and_can_be_taken_back(german):
    choose(german, "Kraft_x", "counter")
    assert "counts no samples" in german.columns.heading.text()
    choose(german, "Kraft_x", "signal")
    assert german.columns.heading.text().startswith("Columns of VP07.csv")


def test_enter_imports_and_opens_no_other_dialog(document, german, until, monkeypatch):
    monkeypatch.setattr(german, "_choose", lambda: pytest.fail("asked for files"))
    german._task.setFocus()
    QTest.keyClicks(german._task, "Stift")
    QTest.keyClick(german._task, Qt.Key.Key_Return)
    until(lambda: document.id, 20.0)
    assert document.demonstration.task == "Stift"


def test_every_remark_is_shown_once_for_all_files(document, dialog, tmp_path, until):
    files = []
    for number in range(8):
        files.append(tmp_path / f"trial {number}.csv")
        files[-1].write_text(GERMAN.replace("0,1;", f"0,{number};"))
    dialog._files.selectAll()
    dialog._remove()
    dialog.add_files(files)
    dialog._go.click()
    until(lambda: "8 new" in dialog._told.text(), 20.0)
    named = "trial 0.csv, trial 1.csv, trial 2.csv and 5 more: "
    assert f"{named}Column Paket was left out: counting samples.\n" in dialog._told.text()
    assert dialog._told.text().count("Paket") == 1


def test_a_remark_names_no_option_of_the_command_line(german, until):
    path = Path(german._chosen()[0])
    path.write_text(path.read_text().replace("Paket", "Wert"))
    german._go.click()
    until(lambda: "1 new" in german._told.text(), 20.0)
    assert "if it is a signal, import it as one (Read as: signal)" in german._told.text()


def test_the_columns_of_a_file_that_is_clicked_are_shown(german, tmp_path):
    path = tmp_path / "VP08.csv"
    path.write_text("t,Druck\n" + "".join(f"{row / 50},{row % 9}\n" for row in range(99)))
    german.add_files([path])
    assert "Paket" in read_as(german)
    german._files.setCurrentRow(1)
    assert read_as(german) == {"t": "times", "Druck": "signal"}
