"""The dialog that imports recordings: what goes in, and what is open afterwards."""

import threading
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import shiboken6
from factories import cached_project, foam_demonstration, numbered_frame
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QComboBox,
    QDoubleSpinBox,
    QLabel,
    QLineEdit,
    QListWidget,
    QMessageBox,
    QProgressBar,
    QPushButton,
    QScrollArea,
)
from window_helpers import named, status_messages

from forcelab.demonstration import Channel
from forcelab.formats.export import exporting
from forcelab.formats.importing import importing
from forcelab.formats.optoforce_packets import KINDS
from forcelab.gui import import_dialog, settings
from forcelab.gui.document import Document
from forcelab.gui.import_dialog import ImportDialog
from forcelab.gui.jobs import Jobs
from forcelab.gui.key_events import guard_typing
from forcelab.jobs import Progress, finish
from forcelab.project import Project
from forcelab.resources import asset
from tests.formats.array_files import CODES, FORCES, SAMPLES, TIMES, write_npz
from tests.formats.optoforce_streams import stream

FOAM = Path(__file__).parents[2] / "assets" / "foam-01.csv"


def empty_project(path):
    Project.create(path).close()


@pytest.fixture
def document(app, tmp_path):
    document = Document("Ann")
    document.open_project(cached_project(empty_project, tmp_path / "study.forcelab"))
    yield document
    document.close()


class PreviewingAtOnce(Jobs):
    """Jobs of which those that preview a file are done when they are begun."""

    def run(self, generator, done, *rest, key="", **options):
        if key != import_dialog.PREVIEW_JOB:
            return super().run(generator, done, *rest, key=key, **options)
        return done(finish(generator))


@pytest.fixture
def open_on(document):
    """Open the dialog on some files."""
    jobs, dialogs = PreviewingAtOnce(), []

    def opened(*files):
        dialogs.append(ImportDialog(document, jobs, files=files))
        dialogs[-1].show()
        return dialogs[-1]

    yield opened
    for dialog in dialogs:
        dialog.close()
    jobs.close()


@pytest.fixture
def dialog(open_on):
    return open_on(FOAM, FOAM.with_name("none.csv"))


def file_list(dialog):
    return named(dialog, QListWidget, "Files to import")


def files(dialog):
    """The paths that are listed."""
    return [file_list(dialog).item(row).text() for row in range(file_list(dialog).count())]


def import_button(dialog):
    return next(button for button in dialog.findChildren(QPushButton) if button.isDefault())


def report(dialog):
    labels = dialog.findChild(QScrollArea).widget().findChildren(QLabel)
    return "\n".join(label.text() for label in labels if label.text())


def warns_of_no_task(dialog):
    labels = dialog.findChildren(QLabel)
    return any(label.isVisible() and "Enter the task" in label.text() for label in labels)


def test_a_file_is_looked_at_in_the_background_and_imported_after_it(
    document, until, tmp_path, monkeypatch
):
    looked, look = threading.Event(), import_dialog.preview
    monkeypatch.setattr(import_dialog, "preview", lambda *a: (looked.wait(60), look(*a))[1])
    jobs = Jobs()
    dialog = ImportDialog(document, jobs, files=[FOAM])
    dialog.show()
    until(lambda: dialog.columns.heading.text() == "Looking at foam-01.csv…")
    named(dialog, QComboBox, "Task").setCurrentText("foam")
    QTest.mouseClick(import_button(dialog), Qt.MouseButton.LeftButton)
    assert not document.infos
    looked.set()
    until(lambda: document.id)
    assert document.demonstration.name == "foam-01"
    dialog.close()
    jobs.close()


def test_cancel_stops_an_import_half_way_and_the_dialog_stays(
    document, open_on, until, tmp_path, monkeypatch
):
    long_table = tmp_path / "long.csv"
    long_table.write_text(
        "time,fx\n" + "".join(f"{n / 1000:.3f},{n % 7}\n" for n in range(300_000))
    )
    half, cancelled = threading.Event(), threading.Event()

    def importing_until_cancelled(*given):
        for progress in importing(*given):
            yield progress
            if not half.is_set() and progress.total > 3 and 2 * progress.done > progress.total:
                half.set()
                assert cancelled.wait(60)

    monkeypatch.setattr(import_dialog, "importing", importing_until_cancelled)
    monkeypatch.setattr("forcelab.formats.importing.SLOW", 0.0)
    monkeypatch.setattr("forcelab.formats.recording._UNIT", 1)
    dialog = open_on(long_table)
    bar = named(dialog, QProgressBar, "Progress of the import")
    cancel = named(dialog, QPushButton, "Cancel the import")
    assert not cancel.isVisible()
    QTest.mouseClick(import_button(dialog), Qt.MouseButton.LeftButton)
    until(lambda: half.is_set() and 2 * bar.value() > bar.maximum())
    assert cancel.isVisible()
    assert bar.maximum() == long_table.stat().st_size
    assert "reading long.csv" in bar.format()
    QTest.mouseClick(cancel, Qt.MouseButton.LeftButton)
    cancelled.set()
    until(lambda: report(dialog) == "The import was cancelled.")
    assert not cancel.isVisible()
    assert not bar.isVisible()
    assert document.infos == ()
    assert files(dialog) == [str(long_table)]
    monkeypatch.setattr(import_dialog, "importing", importing)
    QTest.mouseClick(import_button(dialog), Qt.MouseButton.LeftButton)
    until(lambda: document.id)
    assert document.demonstration.name == "long"


def test_an_import_that_is_cancelled_once_it_is_written_is_reported(
    document, open_on, until, monkeypatch
):
    written, cancelled = threading.Event(), threading.Event()

    def importing_until_cancelled(*given):
        result = yield from importing(*given)
        written.set()
        assert cancelled.wait(60)
        return result

    monkeypatch.setattr(import_dialog, "importing", importing_until_cancelled)
    dialog = open_on(FOAM)
    QTest.mouseClick(import_button(dialog), Qt.MouseButton.LeftButton)
    until(written.is_set)
    QTest.mouseClick(named(dialog, QPushButton, "Cancel the import"), Qt.MouseButton.LeftButton)
    cancelled.set()
    until(lambda: report(dialog))
    assert report(dialog).startswith("1 demonstration imported.")
    assert document.demonstration.name == "foam-01"


@pytest.mark.parametrize("new", [True, False], ids=["a new project", "the open one"])
@pytest.mark.parametrize("late", [True, False], ids=["once it is written", "half way"])
def test_closing_the_dialog_cancels_an_import_and_shows_what_was_written_before(
    document, until, tmp_path, monkeypatch, new, late
):
    reached, closed, ended = threading.Event(), threading.Event(), threading.Event()

    def importing_until_closed(*given):
        steps = importing(*given)
        yield next(steps)
        if not late:
            reached.set()
            assert closed.wait(60)
        yield Progress(1, 2, "shown in no dialog any more")
        result = yield from steps
        reached.set()
        assert closed.wait(60)
        return result

    def steps_of(*given):
        try:
            return (yield from importing_until_closed(*given))
        finally:
            ended.set()

    def open_project(path):
        document.open_project(path)
        return True

    monkeypatch.setattr(import_dialog, "importing", steps_of)
    copy = tmp_path / "recordings" / FOAM.name
    copy.parent.mkdir()
    copy.write_bytes(FOAM.read_bytes())
    if new:
        document.close()
    messages = status_messages(document)
    jobs = PreviewingAtOnce()
    dialog = ImportDialog(document, jobs, files=[copy], open_project=open_project)
    dialog.show()
    QTest.mouseClick(import_button(dialog), Qt.MouseButton.LeftButton)
    until(reached.is_set)
    dialog.close()
    shiboken6.delete(dialog)
    closed.set()
    until(lambda: ended.is_set() and not jobs.awaits("import"))
    project = copy.parent / "recordings.forcelab" if new else document.project.path
    if late:
        assert document.demonstration.name == "foam-01"
        assert document.project.path == project
        text = f"{project.name}: 1 demonstration imported. It was too late to cancel."
        assert messages == [(text, False)]
    else:
        assert (document.id, messages) == ("", [])
        assert not new or (document.project is None and list(copy.parent.iterdir()) == [copy])
    jobs.close()


def test_delete_leaves_a_file_out_and_the_first_import_is_opened(document, dialog, until):
    file_list(dialog).setCurrentRow(1)
    file_list(dialog).setFocus()
    file_list(dialog).actions()[0].trigger()
    assert file_list(dialog).count() == 1
    QTest.mouseClick(import_button(dialog), Qt.MouseButton.LeftButton)
    until(lambda: document.id)
    assert document.demonstration.name == "foam-01"
    assert "1 demonstration imported" in report(dialog)


def test_counts_become_newtons_with_a_calibration_that_is_chosen(
    document, open_on, until, monkeypatch, tmp_path
):
    (tmp_path / "raw.bin").write_bytes(stream(KINDS[0], range(100, 400))[0])
    file = asset("calibrations/3-axis-40N.toml")
    monkeypatch.setattr(import_dialog, "ask_file", lambda *_: file)
    dialog = open_on(tmp_path / "raw.bin")
    choose = named(dialog, QPushButton, "Choose the calibration file")
    QTest.mouseClick(choose, Qt.MouseButton.LeftButton)
    assert dialog.calibration.text() == str(file)
    import_button(dialog).click()
    until(lambda: document.id)
    assert {channel.unit for channel in document.demonstration.channels} == {"N"}


def test_a_typed_task_moves_nothing(app, open_on):
    dialog = open_on(FOAM)
    app.processEvents()
    assert warns_of_no_task(dialog)
    before = import_button(dialog).y(), dialog.columns.height()
    assert import_button(dialog).text() == "Import without a task"
    named(dialog, QComboBox, "Task").setCurrentText("foam")
    app.processEvents()
    assert not warns_of_no_task(dialog)
    assert import_button(dialog).text() == "Import"
    assert (import_button(dialog).y(), dialog.columns.height()) == before


def test_a_task_is_asked_for_as_long_as_there_are_files_to_import(app, open_on, until):
    dialog = open_on()
    assert not warns_of_no_task(dialog)
    dialog.add_files([FOAM])
    assert warns_of_no_task(dialog)
    named(dialog, QComboBox, "Task").setCurrentText("foam")
    import_now = next(b for b in dialog.findChildren(QPushButton) if b.text() == "Import")
    QTest.mouseClick(import_now, Qt.MouseButton.LeftButton)
    until(lambda: "1 demonstration imported" in report(dialog))
    assert not warns_of_no_task(dialog)


def test_what_is_added_during_an_import_is_imported_after_it(document, open_on, tmp_path, until):
    later = tmp_path / "later.csv"
    later.write_text("t,fx\n" + "".join(f"{row / 50},{row % 9}\n" for row in range(99)))
    dialog = open_on(FOAM)
    import_button(dialog).click()
    dialog.add_files([later])
    assert not import_button(dialog).isEnabled()  # one at a time
    until(lambda: "1 demonstration imported" in report(dialog))
    assert files(dialog) == [str(later)]
    QTest.keyClick(dialog.focusWidget(), Qt.Key.Key_Return)
    until(lambda: files(dialog) == [])
    assert {info.name for info in document.infos} >= {"foam-01", "later"}


def test_without_files_enter_asks_for_them_and_then_imports_them(
    open_on, tmp_path, until, monkeypatch
):
    questions = []
    monkeypatch.setattr(import_dialog, "ask_files", lambda *_: questions.append(1) or [FOAM])
    dialog = open_on()
    for _ in range(2):
        QTest.keyClick(dialog.focusWidget(), Qt.Key.Key_Return)
    until(lambda: "1 demonstration imported" in report(dialog))
    assert len(questions) == 1
    dialog.add_files([tmp_path / "next.csv"])
    assert dialog.findChild(QScrollArea).isHidden()  # it told of what is imported already


def test_glitches_are_told(dialog, tmp_path, until):
    file_list(dialog).clear()
    rows = [f"{i / 100},{3e12 if i == 20 else i % 7}" for i in range(200)]
    (tmp_path / "torn.csv").write_text("\n".join(["time,fx", *rows]))
    dialog.add_files([tmp_path / "torn.csv"])
    import_button(dialog).click()
    until(lambda: "1 demonstration imported" in report(dialog))
    assert "torn.csv: 1 sample is a glitch" in report(dialog)


def test_files_that_cannot_be_read_are_left_out_and_selected(document, dialog, tmp_path, until):
    notes = tmp_path / "notes.csv"
    notes.write_text("nothing to see")
    dialog.add_files([notes])
    _, *wrong = files(dialog)
    import_button(dialog).click()
    until(lambda: document.id)
    assert document.demonstration.name == "foam-01"
    assert files(dialog) == wrong
    assert [item.text() for item in file_list(dialog).selectedItems()] == wrong
    lines = report(dialog)
    assert "1 demonstration imported" in lines
    assert all(name in lines for name in wrong)
    labels = dialog.findChild(QScrollArea).widget().findChildren(QLabel)
    (red,) = [label.text() for label in labels if label.property("tone") == "trouble"]
    assert "1 demonstration imported" not in red
    assert all(name in red for name in wrong)
    guard_typing()  # as in the program
    QTest.keyClick(file_list(dialog), Qt.Key.Key_Delete)
    assert files(dialog) == []


def test_a_video_of_no_recording_is_no_failure(document, open_on, tmp_path, until):
    film = tmp_path / "VP01_kamera.mp4"
    film.write_bytes(b"\0\0\0\x18ftypmp42")
    dialog = open_on(film, FOAM)
    import_button(dialog).click()
    until(lambda: document.id)
    sentence = "VP01_kamera.mp4 is a video: attach it by Demonstration > Attach video…"
    assert sentence in report(dialog)
    assert "could not be read" not in report(dialog)
    assert files(dialog) == []


def test_the_next_import_does_not_land_in_the_last_task(document, open_on, tmp_path, until):
    first = open_on(FOAM)
    named(first, QComboBox, "Task").setCurrentText("foam")
    import_button(first).click()
    until(lambda: document.id)
    assert named(first, QComboBox, "Task").currentText() == ""
    later = tmp_path / "pull.csv"
    later.write_text("t,fx\n" + "".join(f"{row / 50},{row % 9}\n" for row in range(99)))
    second = open_on(later)  # while a demonstration of the task is open
    assert named(second, QComboBox, "Task").currentText() == ""
    assert named(second, QComboBox, "Task").findText("foam") >= 0
    import_button(second).click()
    until(lambda: len(document.infos) == 2)
    assert {info.name: info.task for info in document.infos} == {"foam-01": "foam", "pull": ""}


def test_with_every_file_left_out_there_is_nothing_to_import(dialog):
    file_list(dialog).selectAll()
    file_list(dialog).actions()[0].trigger()
    assert not import_button(dialog).isEnabled()


def test_a_rate_that_is_given_is_no_longer_asked_for(open_on, tmp_path):
    plain = tmp_path / "plain.csv"
    plain.write_text("fx,fy,fz\n" + "0.1,0.2,0.3\n0.2,0.1,0.5\n" * 20)
    dialog = open_on(plain)
    heading = dialog.columns.heading
    assert "give the sample rate" in heading.text()
    assert heading.styleSheet()
    named(dialog, QDoubleSpinBox, "Sample rate of files without times").setValue(200.0)
    assert heading.text() == "Columns of plain.csv, and what each is read as:"
    assert not heading.styleSheet()
    named(dialog, QDoubleSpinBox, "Sample rate of files without times").setValue(0.0)
    assert "give the sample rate" in heading.text()


def test_a_clock_that_stands_still_is_named(open_on, tmp_path):
    stuck = tmp_path / "stuck.csv"
    stuck.write_text("time,fx\n" + "12.5,0.1\n12.5,0.2\n" * 20)
    heading = open_on(stuck).columns.heading
    assert heading.text().startswith("In stuck.csv the times in 'time' never change; choose")


def test_clocks_that_are_not_wanted_do_not_stand_still(open_on, tmp_path):
    two = tmp_path / "two.csv"
    two.write_text("time,timestamp,fx\n" + "".join(f"{n},{n}00,{n % 3}\n" for n in range(40)))
    columns = open_on(two).columns
    columns.choose("time", "left out")
    columns.choose("timestamp", "signal")
    assert columns.heading.text().startswith("two.csv has no column of times; choose one")


def test_files_are_looked_for_where_the_last_ones_were_chosen(dialog, tmp_path, monkeypatch):
    questions = []

    def choose(_parent, _title, folder):
        questions.append(Path(folder))
        return [str(FOAM)], ""

    monkeypatch.setattr("PySide6.QtWidgets.QFileDialog.getOpenFileNames", choose)
    settings.remember_project(tmp_path / "study.forcelab")
    (pick,) = [b for b in dialog.findChildren(QPushButton) if b.text() == "Choose files…"]
    pick.click()
    pick.click()
    assert questions == [tmp_path, FOAM.parent]


def test_what_is_typed_after_choosing_files_is_their_task(document, open_on, monkeypatch, until):
    dialog = open_on()
    monkeypatch.setattr(import_dialog, "ask_files", lambda *_: [FOAM])
    (pick,) = [b for b in dialog.findChildren(QPushButton) if b.text() == "Choose files…"]
    pick.setFocus()
    pick.click()
    QTest.keyClicks(dialog.focusWidget(), "foam")
    QTest.keyClick(dialog.focusWidget(), Qt.Key.Key_Return)
    until(lambda: document.id)
    assert document.demonstration.task == "foam"
    pick.click()  # the task of the next files is asked for again
    assert dialog.focusWidget() is named(dialog, QComboBox, "Task")
    dialog.focusWidget().setCurrentText("foam")
    pick.click()
    assert dialog.focusWidget() is import_button(dialog)


def test_the_dialog_names_the_project_that_is_imported_into(document, dialog):
    name = f"{document.project.path.name} (File > New project… begins another)"
    assert any(label.text() == name and label.isVisible() for label in dialog.findChildren(QLabel))


def test_labels_are_the_files_own_unless_a_coder_is_chosen(document, dialog, until):
    file_list(dialog).item(1).setSelected(True)
    file_list(dialog).actions()[0].trigger()
    assert named(dialog, QComboBox, "Coder for unsigned labels").currentText() == "coder"
    assert named(dialog, QComboBox, "Coder for unsigned labels").findText("Ann") > 0
    import_button(dialog).click()
    until(lambda: document.id)
    assert [author.name for author in document.project.coding.authors()] == ["coder"]


@pytest.mark.parametrize(("answer", "tasks"), [(0, ("foam",)), (1, ("Foam", "foam"))])
def test_a_task_that_differs_by_case_alone_is_asked_about(
    document, dialog, until, monkeypatch, answer, tasks
):
    with Project.open(document.project.path) as other:
        other.demonstrations.add(foam_demonstration())  # of task foam
    questions = []

    def press(box):
        questions.append((box.text(), [button.text() for button in box.buttons()]))
        box.buttons()[answer].click()

    monkeypatch.setattr(QMessageBox, "exec", press)
    file_list(dialog).item(1).setSelected(True)
    file_list(dialog).actions()[0].trigger()
    named(dialog, QComboBox, "Task").setCurrentText(" Foam ")
    import_button(dialog).click()
    until(lambda: "1 demonstration imported" in report(dialog))
    assert questions == [("'foam' already exists.", ["Use 'foam'", "Add 'Foam'"])]
    assert sorted(document.project.demonstrations.tasks()) == list(tasks)


def test_an_archive_is_not_asked_for_a_task(open_on, tmp_path):
    with Project.create(tmp_path / "lab.forcelab") as project:
        project.demonstrations.add(foam_demonstration())
    (archive,) = finish(exporting(tmp_path / "lab.forcelab", tmp_path, "archive"))
    dialog = open_on(archive)
    assert not warns_of_no_task(dialog)
    assert import_button(dialog).text() == "Import"
    dialog.add_files([FOAM])
    assert warns_of_no_task(dialog)


def test_a_project_made_of_an_archive_is_named_like_it(app, tmp_path):
    with Project.create(tmp_path / "lab.forcelab") as project:
        project.demonstrations.add(foam_demonstration())
    (archive,) = finish(exporting(tmp_path / "lab.forcelab", tmp_path / "sent", "archive"))
    document, jobs = Document("Ann"), PreviewingAtOnce()
    dialog = ImportDialog(document, jobs, files=[archive])
    assert dialog.project_name.text() == "lab.forcelab"
    assert dialog.project_name.cursorPosition() == 0
    dialog.close()
    jobs.close()
    document.close()


GERMAN = "Uhrzeit;Paket;Kraft_x;Taster\n" + "".join(
    f"31.05.2024 12:00:{row // 50:02},{row % 50 * 20:03};{65500 + row};0,{row % 11};{row % 2}\n"
    for row in range(150)
)


@pytest.fixture
def german(open_on, tmp_path):
    """The dialog with a table of one's own."""
    path = tmp_path / "VP07.csv"
    path.write_text(GERMAN)
    return open_on(path)


def read_as(dialog):
    return {column.name: column.use for column in dialog.columns.uses}


def choose(dialog, name, use):
    row = [column.name for column in dialog.columns.uses].index(name)
    box = dialog.columns.table.cellWidget(row, import_dialog._USE).findChild(QComboBox)
    box.setCurrentIndex(box.findData(use))
    box.activated.emit(box.currentIndex())


def test_the_choices_do_not_touch(german, app):
    table = german.columns.table
    app.processEvents()
    boxes = [table.cellWidget(row, import_dialog._USE).findChild(QComboBox) for row in range(3)]
    tops = [box.mapTo(table, box.rect().topLeft()).y() for box in boxes]
    assert min(b - a - boxes[0].height() for a, b in pairwise(tops)) >= 4


def test_the_columns_are_shown_as_they_will_be_read(german):
    assert read_as(german) == {
        "Uhrzeit": "times",
        "Paket": "counter",
        "Kraft_x": "signal",
        "Taster": "signal",
    }
    assert not german.columns.others.isVisible()  # where no axis is of a force none is beside them
    file_list(german).selectAll()
    file_list(german).actions()[0].trigger()
    assert not german.columns.isVisible()


def test_signals_beside_force_axes_are_named_until_they_are_left_out(open_on, tmp_path):
    path = tmp_path / "VP01.csv"
    rows = "".join(f"{n / 50};{n % 7};{n % 5};{n % 3};{n % 2};{20 + n / 99}\n" for n in range(99))
    path.write_text("t;Fx_l;Fy_l;Fz_l;Trigger;Temperatur\n" + rows)
    columns = open_on(path).columns
    others = columns.others
    assert others.isVisible()
    assert others.text().startswith("2 columns are no force axes (Trigger, Temperatur) and will be")
    table = columns.table  # all of it is seen, not its beginning
    assert table.viewport().height() >= table.verticalHeader().length()
    columns.choose("Temperatur", "left out")
    assert others.text().startswith("Trigger is no force axis and will be read as a signal too;")
    columns.choose("Trigger", "left out")
    assert not others.isVisible()


def test_a_counter_can_be_made_a_signal_and_a_signal_be_left_out(document, german, until):
    choose(german, "Paket", "signal")
    assert read_as(german)["Paket"] == "signal"
    choose(german, "Taster", "left out")
    import_button(german).click()
    until(lambda: document.id)
    assert {channel.name for channel in document.demonstration.channels} == {"Kraft_x", "Paket"}


def units_asked(dialog):
    """The fields for units, by the columns' names; none while the column is hidden."""
    table, columns = dialog.columns.table, dialog.columns.uses
    if table.isColumnHidden(import_dialog._UNIT):
        return {}
    cells = {c.name: table.cellWidget(row, import_dialog._UNIT) for row, c in enumerate(columns)}
    return {name: cell.findChild(QLineEdit) for name, cell in cells.items() if cell is not None}


def test_units_that_a_file_does_not_state_are_entered_and_remembered(
    document, german, open_on, until, tmp_path
):
    assert list(units_asked(german)) == ["Kraft_x", "Taster"]
    choose(german, "Taster", "left out")
    until(lambda: list(units_asked(german)) == ["Kraft_x"])
    QTest.keyClicks(units_asked(german)["Kraft_x"], " mN")
    import_button(german).click()
    until(lambda: document.id)
    assert document.demonstration.channels == (Channel("Kraft_x", "mN"),)
    again = tmp_path / "VP08.csv"
    again.write_text(GERMAN.replace("08:", "09:"))
    dialog = open_on(again)
    assert units_asked(dialog)["Kraft_x"].text() == "mN"
    assert "as was chosen for such a file before" in dialog.columns.heading.text()


def test_a_file_that_states_all_its_units_is_not_asked_for_them(open_on, tmp_path):
    path = tmp_path / "pull.csv"
    path.write_text("time [s],fz [N]\n" + "".join(f"{n / 50},{n % 7}\n" for n in range(99)))
    assert not units_asked(open_on(path))


def test_without_its_times_a_table_goes_by_its_counter_and_rate(document, german, until):
    choose(german, "Uhrzeit", "left out")
    assert "counts its samples" in german.columns.heading.text()
    named(german, QDoubleSpinBox, "Sample rate of files without times").setValue(100.0)
    import_button(german).click()
    until(lambda: document.id)
    assert document.demonstration.duration == pytest.approx(1.5)


def test_a_choice_that_cannot_be_is_told_at_once_and_can_be_taken_back(german):
    choose(german, "Kraft_x", "counter")
    assert "counts no samples" in german.columns.heading.text()
    choose(german, "Kraft_x", "signal")
    assert german.columns.heading.text().startswith("Columns of VP07.csv")


def test_enter_imports_and_opens_no_other_dialog(document, german, until, monkeypatch):
    monkeypatch.setattr(import_dialog, "ask_files", lambda *_: pytest.fail("asked for files"))
    named(german, QComboBox, "Task").setFocus()
    QTest.keyClicks(named(german, QComboBox, "Task"), "Stift")
    QTest.keyClick(named(german, QComboBox, "Task"), Qt.Key.Key_Return)
    until(lambda: document.id)
    assert document.demonstration.task == "Stift"


def test_every_remark_is_shown_once_for_all_files(open_on, tmp_path, until):
    files = []
    for number in range(8):
        files.append(tmp_path / f"trial {number}.csv")
        files[-1].write_text(GERMAN.replace("0,1;", f"0,{number};"))
    dialog = open_on(*files)
    import_button(dialog).click()
    until(lambda: "8 demonstrations imported" in report(dialog))
    together = "trial 0.csv, trial 1.csv, trial 2.csv and 5 more: "
    assert f"{together}Column Paket was left out: sample counts.\n" in report(dialog)
    assert report(dialog).count("Paket") == 1


def test_a_remark_names_no_option_of_the_command_line(german, until):
    path = Path(files(german)[0])
    path.write_text(path.read_text().replace("Paket", "Wert"))
    import_button(german).click()
    until(lambda: "1 demonstration imported" in report(german))
    assert "import what is a signal as one (Read as: signal)" in report(german)


def test_a_file_whose_signals_are_not_plain_names_no_option_either(open_on, tmp_path):
    path = tmp_path / "a.npz"
    pose = np.zeros((50, 3))
    np.savez(path, pose=pose, speed=pose, beat=np.arange(50) / 10)
    dialog = open_on(path)
    pick(dialog, "beat", "times")
    assert read_as(dialog)["beat"] == "times"
    assert named(dialog, QComboBox, "beat is read as").currentText() == "times"
    heading = dialog.columns.heading.text()
    assert "(Read as: signal), and the times (Read as: times) or their rate (Sample" in heading


def test_times_and_labels_are_proposed_by_name_until_others_are_chosen(open_on, tmp_path):
    beat, pose = np.arange(50) / 10, np.arange(150.0).reshape(50, 3)
    record = {"t": beat, "F": pose, "M": pose, "label": beat // 1, "beat": beat}
    scipy.io.savemat(tmp_path / "a.mat", {"rec": record}, oned_as="column")
    dialog = open_on(tmp_path / "a.mat")
    assert list(read_as(dialog).values()) == ["times", "left out", "left out", "labels", "left out"]
    assert dialog.columns.heading.text().startswith("It is not plain which are the signals in a")
    dialog.columns.choose("rec.beat", "times")
    assert list(read_as(dialog).values()) == ["left out", "left out", "left out", "labels", "times"]
    dialog.columns.choose("rec.F", "signal")
    assert list(read_as(dialog).values()) == ["left out", "signal", "left out", "labels", "times"]
    assert dialog.columns.heading.text().startswith("Columns of a.mat, and what each is read as")


def test_the_columns_of_a_file_that_is_clicked_are_shown(german, tmp_path):
    path = tmp_path / "VP08.csv"
    path.write_text("t,Druck\n" + "".join(f"{row / 50},{row % 9}\n" for row in range(99)))
    german.add_files([path])
    assert "Paket" in read_as(german)
    file_list(german).setCurrentRow(1)
    assert read_as(german) == {"t": "times", "Druck": "signal"}


def write_fold(path, forces=FORCES):
    """A file of arrays whose names do not say which are the signals."""
    arrays = {"obs/qpos": forces, "obs/qvel": -forces, "clock/seen": TIMES, "phase": CODES + 1}
    return write_npz(path, action=np.zeros((SAMPLES, 7)), **arrays)


def pick(dialog, name, text):
    """Choose by mouse and keys what an array is read as."""
    box = named(dialog, QComboBox, f"{name} is read as")
    dialog.columns.table.scrollTo(dialog.columns.table.indexAt(box.parentWidget().pos()))
    QTest.mouseClick(box, Qt.MouseButton.LeftButton)
    view = box.view()
    for _ in range(box.findText(text) - box.currentIndex()):
        QTest.keyClick(view, Qt.Key.Key_Down)
    assert view.currentIndex().data() == text
    QTest.keyClick(view, Qt.Key.Key_Return)


def test_of_very_many_columns_the_first_are_shown(open_on, tmp_path, monkeypatch):
    monkeypatch.setattr(import_dialog, "MOST_SHOWN", 3)
    path = tmp_path / "wide.csv"
    rows = [[row / 10, *range(row, row + 8)] for row in range(60)]
    path.write_text("\n".join(["t,a,b,c,d,e,f,g,h", *(",".join(map(str, row)) for row in rows)]))
    columns = open_on(path).columns
    assert columns.table.rowCount() == 3
    assert "wide.csv (the first 3 of 9)" in columns.heading.text()


def test_the_name_of_a_file_is_no_markup(open_on, tmp_path):
    path = tmp_path / "<h1>pull.csv"
    path.write_text("t,fx\n" + "".join(f"{row / 50},{row % 9}\n" for row in range(99)))
    columns = open_on(path).columns
    assert "<h1>pull.csv" in columns.heading.text()
    assert columns.heading.height() < 2 * columns.heading.fontMetrics().height()


def test_what_is_in_a_file_of_arrays_is_shown_as_a_tree(open_on, tmp_path):
    dialog = open_on(write_fold(tmp_path / "a.npz"))
    dialog.resize(680, 560)  # too low for all of its rows
    table = dialog.columns.table
    rows = [
        [item.text().strip() if (item := table.item(row, place)) else "" for place in (0, 1)]
        for row in range(table.rowCount())
    ]
    assert rows == [
        ["action", "200 × 7"],
        ["phase", "200"],
        ["obs", ""],
        ["qpos", "200 × 3"],
        ["qvel", "200 × 3"],
        ["clock", ""],
        ["seen", "200"],
    ]
    table.scrollToBottom()
    place = table.verticalScrollBar().value()
    dialog.columns.choose("obs/qvel", "signal")
    assert table.verticalScrollBar().value() == place > 0
    dialog.columns.choose("obs/qvel", "left out")
    assert dialog.columns.heading.text().startswith("It is not plain which are the signals in a")


def test_arrays_are_chosen_once_for_files_of_the_same_build(document, open_on, tmp_path, until):
    dialog = open_on(write_fold(tmp_path / "a.npz"))
    pick(dialog, "obs/qpos", "signal")
    pick(dialog, "clock/seen", "times")
    pick(dialog, "phase", "labels")
    assert dialog.columns.heading.text().startswith("Columns of a.npz, and what each is read as")
    QTest.keyClick(named(dialog, QComboBox, "Task"), Qt.Key.Key_Return)
    until(lambda: document.id)
    assert [channel.name for channel in document.demonstration.channels] == [
        "qpos 1",
        "qpos 2",
        "qpos 3",
    ]
    assert document.demonstration.times.tolist() == TIMES.tolist()
    dialog.close()

    dialog = open_on(write_fold(tmp_path / "b.npz", FORCES + 1))
    heading = dialog.columns.heading.text()
    assert heading == "Columns of b.npz, read as was chosen for such a file before:"
    assert read_as(dialog)["clock/seen"] == "times"
    QTest.keyClick(named(dialog, QComboBox, "Task"), Qt.Key.Key_Return)
    until(lambda: len(document.infos) == 2)
    with Project.open(document.project.path) as project:
        info = next(info for info in project.demonstrations.infos() if info.name == "b")
        assert project.demonstrations.load(info.id).signals.tolist() == (FORCES + 1).tolist()
    dialog.close()

    other = open_on(write_npz(tmp_path / "c.npz", a=FORCES, b=FORCES))
    assert set(read_as(other).values()) == {"left out"}


def test_a_rate_is_remembered_with_the_arrays_that_need_it(document, open_on, tmp_path, until):
    dialog = open_on(write_npz(tmp_path / "a.npz", a=FORCES, b=FORCES))
    pick(dialog, "b", "signal")
    named(dialog, QDoubleSpinBox, "Sample rate of files without times").setValue(40.0)
    import_button(dialog).click()
    until(lambda: document.id)
    dialog.close()
    dialog = open_on(write_npz(tmp_path / "b.npz", a=FORCES, b=FORCES))
    assert named(dialog, QDoubleSpinBox, "Sample rate of files without times").value() == 40.0
    assert read_as(dialog) == {"a": "left out", "b": "signal"}


def test_choices_that_were_written_by_something_else_are_not_used(open_on, tmp_path):
    settings.store("import/choices", ["[", "3", '["x", {"a": "run"}, 1]', '["y", {}, "nan"]'])
    dialog = open_on(write_fold(tmp_path / "a.npz"))
    assert set(read_as(dialog).values()) == {"labels", "left out"}  # as found


def test_channels_and_markers_of_streams_are_chosen(document, open_on, tmp_path, until):
    pytest.importorskip("pyxdf")
    from tests.formats.column_files import whole_xdf

    dialog = open_on(whole_xdf(tmp_path)[0])
    uses = read_as(dialog)
    assert (uses["Force: times"], uses["Pose.Pose 1"]) == ("times", "signal")
    assert uses["Markers"] == "labels"
    assert dialog.columns.heading.text().startswith("Columns of a.xdf")
    for name in ("Pose.Pose 1", "Pose.Pose 2", "Markers"):
        dialog.columns.choose(name, "left out")
    QTest.mouseClick(import_button(dialog), Qt.MouseButton.LeftButton)
    until(lambda: document.id)
    names = [channel.name for channel in document.demonstration.channels]
    assert names == ["fx", "fy", "fz", "Pose 3"]


def test_cameras_of_a_bag_are_videos_unless_they_are_left_out(document, open_on, tmp_path, until):
    pytest.importorskip("rosbags")
    from tests.formats.rosbag_files import COMPRESSED, WRENCH, compressed_image, wrenches, write_bag

    pictures = [(i / 10, compressed_image(i / 10, numbered_frame(i))) for i in range(5)]
    topics = {
        "/ft": (WRENCH, wrenches()),
        "/a": (COMPRESSED, pictures),
        "/b": (COMPRESSED, pictures),
    }
    dialog = open_on(write_bag(tmp_path / "a.bag", topics))
    assert (read_as(dialog)["/a"], read_as(dialog)["/b"]) == ("video", "video")
    choose(dialog, "/a", "left out")
    choose(dialog, "/b", "left out")
    choose(dialog, "/b", "video")
    import_button(dialog).click()
    until(lambda: document.id)
    assert [video.name for video in document.demonstration.videos] == ["/b"]
    assert "/b became a video: 5 frames of 384 x 64 (as in the bag)" in report(dialog)


def test_a_file_that_tells_its_rate_is_asked_for_none(document, open_on, tmp_path, until):
    file = tmp_path / "walk.csv"
    rows = "".join(f"{i // 10 + 1},{i % 10},{i % 7 / 4}\n" for i in range(200))
    file.write_text("Devices\n1000\n,,Plate\nFrame,Sub Frame,Fz\n,,N\n" + rows)
    dialog = open_on(file)
    assert [column.use for column in dialog.columns.uses] == ["counter", "counter", "signal"]
    assert "give" not in dialog.columns.heading.text()
    import_button(dialog).click()
    until(lambda: document.id)
    assert document.demonstration.duration == pytest.approx(0.2, abs=0.002)


def test_stamps_that_run_backwards_are_taken_where_they_may_jitter(
    document, open_on, tmp_path, until
):
    file = tmp_path / "log.csv"
    rows = "".join(f"{i / 100 - (0.012 if i % 4 == 3 else 0):.6f},{i % 7}\n" for i in range(200))
    file.write_text("time [s],fz [N]\n" + rows)
    dialog = open_on(file)
    import_button(dialog).click()
    until(lambda: "time runs backwards" in report(dialog))
    assert "(Timestamps may jitter by)" in report(dialog)
    dialog.jitter.setValue(20)
    import_button(dialog).click()
    until(lambda: document.id)
    assert len(document.demonstration.times) == 200
    assert "spread evenly between their neighbours" in report(dialog)


def test_a_repaired_import_takes_its_actions_out_of_the_open_task(
    document, open_on, tmp_path, until
):
    def labelled(name, action, phase):
        rows = "".join(f"{row / 50},{(row + phase) % 9}\n" for row in range(99))
        (tmp_path / f"{name}.csv").write_text("t,fx\n" + rows)
        (tmp_path / f"{name}.labels.csv").write_text(f"start,end,action\n0.1,0.5,{action}\n")
        return tmp_path / f"{name}.csv"

    def import_into(task, file):
        dialog = open_on(file)
        named(dialog, QComboBox, "Task").setCurrentText(task)
        import_button(dialog).click()
        until(lambda: report(dialog))

    import_into("foam", labelled("block", "squeeze", 0))
    assert document.vocabulary.names == ("squeeze",)
    pull = labelled("pull", "slip", 1)
    import_into("foam", pull)
    assert document.vocabulary.names == ("squeeze", "slip")
    import_into("stylus", pull)
    assert document.demonstration.name == "block"
    assert document.vocabulary.names == ("squeeze",)


def test_episodes_and_features_of_a_dataset_are_chosen(document, open_on, tmp_path, until):
    pytest.importorskip("pyarrow")
    from tests.formats.lerobot_datasets import write_dataset

    write_dataset(tmp_path / "pen")
    assert not open_on(FOAM).episodes.isVisible()
    # The file dialog chooses files, and one of them stands for the folder.
    dialog = open_on(tmp_path / "pen/meta/info.json")
    assert files(dialog) == [str(tmp_path / "pen")]
    assert dialog.episodes.isVisible()
    assert dialog.episodes.placeholderText() == "all 4, or such as 0-9, 12"
    assert not warns_of_no_task(dialog)  # it names them itself
    uses = read_as(dialog)
    assert (uses["timestamp"], uses["observation.state"], uses["action"]) == (
        "times",
        "signal",
        "left out",
    )
    dialog.columns.choose("action", "signal")
    dialog.episodes.setText("3-1")
    QTest.mouseClick(import_button(dialog), Qt.MouseButton.LeftButton)
    assert "'3-1' names no episodes; write such as 0-9,12." in report(dialog)
    dialog.episodes.setText("1-2")
    QTest.mouseClick(import_button(dialog), Qt.MouseButton.LeftButton)
    until(lambda: document.id)
    assert sorted(info.name for info in document.infos) == ["pen-1", "pen-2"]
    names = [channel.name for channel in document.demonstration.channels]
    assert names == ["fx1", "fy1", "fz1", "grip", "lift"]
    assert {info.task for info in document.infos} == {"pull the pen", "squeeze the foam"}
