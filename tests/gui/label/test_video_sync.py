"""The dialog that synchronises video and force, driven by its widgets."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from factories import VIDEO_OFFSET, VIDEO_TAPS, demonstration_with_video
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QWidget
from window_helpers import status_messages

from forcelab.clock import ClockMap, fit_clock
from forcelab.gui.document import Document
from forcelab.gui.label.video_sync import SynchroniseDialog, TapRow
from forcelab.project import Project

FRAME = 1 / 30


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    return demonstration_with_video(tmp_path_factory.mktemp("film"), ClockMap(0.25, 1.00001))


@pytest.fixture(scope="module")
def lab(tmp_path_factory, filmed):
    folder = tmp_path_factory.mktemp("lab") / "lab.forcelab"
    with Project.create(folder) as project:
        project.demonstrations.add(filmed)
    return folder


@pytest.fixture
def document(app, tmp_path, lab):
    document = Document("Ines")
    document.open_project(Path(shutil.copytree(lab, tmp_path / "lab.forcelab")))
    document.open_demonstration(document.infos[0].id)
    yield document
    document.close()


@pytest.fixture
def dialog(document, jobs, until):
    dialog = SynchroniseDialog(document, jobs)
    dialog.show()
    until(lambda: dialog.preview.times.size > 0)
    yield dialog
    dialog.reject()


def press(button):
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)


def mark(dialog, frame, force):
    """Mark an event as a coder does."""
    dialog.preview.show_frame(frame)
    press(dialog.frame_button)
    dialog.document.view.seek(force)
    press(dialog.force_button)


def cells(dialog):
    table = dialog.table
    return [[table.item(r, c).text() for c in range(3)] for r in range(table.rowCount())]


def test_it_begins_at_the_frame_of_the_cursor_with_nothing_to_accept(document, dialog):
    assert dialog.preview.number == 0  # the cursor is before the video begins
    assert "offset +0.2500 s, rate +10.0 ppm" in dialog.stored_label.text()
    assert not dialog.accept_button.isEnabled()
    assert not dialog.remove_button.isEnabled()


def test_one_tap_moves_the_offset_and_keeps_the_rate(document, dialog):
    messages = status_messages(document)
    mark(dialog, 27, 0.5)
    assert dialog.rows == (TapRow(pytest.approx(27 * FRAME), 0.5),)
    assert dialog.candidate.rate == 1.00001
    assert dialog.candidate.offset == pytest.approx(0.5 - 1.00001 * 27 * FRAME)
    assert cells(dialog) == [["0.900", "0.500", "+0.0"]]
    press(dialog.accept_button)
    assert document.demonstration.video.clock == dialog.candidate
    assert messages[-1][0] == (
        "The video has a new clock: offset −0.4000 s, rate +10.0 ppm; it had offset +0.2500 s, "
        "rate +10.0 ppm."
    )
    assert not dialog.isVisible()


def test_three_taps_are_fitted_with_their_residual(document, dialog):
    taps = [(27, 0.5), (90, 2.61), (174, 5.4)]
    for frame, force in taps:
        mark(dialog, frame, force)
    fit = fit_clock([f * FRAME for f, _ in taps], [t for _, t in taps])
    assert dialog.candidate.offset == pytest.approx(fit.clock.offset)
    assert dialog.candidate.rate == pytest.approx(fit.clock.rate)
    assert f"{1000 * fit.residual:.1f} ms" in dialog.residual_label.text()
    away = [1000 * (float(fit.clock.to_force(f * FRAME)) - t) for f, t in taps]
    residuals = [row[2] for row in cells(dialog)]
    assert not any("-" in text for text in residuals), "a minus is as wide as a plus"
    numbers = [float(text.replace("\N{MINUS SIGN}", "-")) for text in residuals]
    assert numbers == pytest.approx(away, abs=0.06)
    press(dialog.fit_rate)
    assert dialog.candidate.rate == 1.00001
    assert dialog.residual > fit.residual


def test_marks_may_come_in_any_order_and_be_removed(dialog):
    dialog.document.view.seek(0.5)
    press(dialog.force_button)
    assert cells(dialog) == [["–", "0.500", ""]]
    assert not dialog.accept_button.isEnabled()
    dialog.preview.show_frame(27)
    press(dialog.frame_button)
    assert cells(dialog) == [["0.900", "0.500", "+0.0"]]
    mark(dialog, 174, 5.4)
    dialog.table.selectRow(0)
    press(dialog.remove_button)
    assert [row[:2] for row in cells(dialog)] == [["5.800", "5.400"]]
    press(dialog.reset_button)
    assert dialog.rows == ()
    assert not dialog.accept_button.isEnabled()


def test_taps_at_one_time_are_told(dialog):
    mark(dialog, 27, 0.5)
    mark(dialog, 27, 0.6)
    assert "further apart" in dialog.trouble.text()
    assert not dialog.accept_button.isEnabled()


def test_the_force_snaps_to_the_contact_event_beside_the_cursor(document, dialog):
    document.view.contacts = np.array([0.48, 2.0])
    document.view.seek(0.51)
    press(dialog.force_button)
    assert dialog.rows[-1].force == 0.48
    document.view.seek(1.0)
    dialog.set_rows(())
    press(dialog.force_button)
    assert dialog.rows[-1].force == 1.0
    dialog.snap.setChecked(False)
    dialog.set_rows(())
    document.view.seek(0.51)
    press(dialog.force_button)
    assert dialog.rows[-1].force == 0.51


def test_the_video_is_stepped_without_the_cursor(document, dialog, until):
    document.view.seek(2.0)
    dialog.preview.spin.setValue(1.0)
    assert dialog.preview.number == 30
    press(dialog.preview.next_button)
    assert dialog.preview.number == 31
    assert dialog.preview.time == pytest.approx(31 * FRAME)
    dialog.preview.slider.setValue(12)
    assert dialog.preview.number == 12
    assert document.view.cursor == 2.0
    until(lambda: "13" in dialog.preview.picture.caption)
    dialog.force_time.setValue(3.25)
    assert document.view.cursor == 3.25


def test_a_chosen_tap_is_shown_on_both_clocks(document, dialog):
    mark(dialog, 27, 0.5)
    mark(dialog, 174, 5.4)
    dialog.table.selectRow(0)
    assert dialog.preview.number == 27
    assert document.view.cursor == 0.5


def test_a_proposal_is_shown_and_accepted(document, dialog, until):
    press(dialog.propose_button)
    assert not dialog.propose_button.isEnabled()
    until(lambda: dialog.proposal is not None)
    assert dialog.candidate.offset == pytest.approx(VIDEO_OFFSET, abs=0.04)
    assert len(dialog.rows) == len(VIDEO_TAPS)
    assert "ms" in dialog.residual_label.text()
    assert f"{dialog.proposal.confidence:.2f}" in dialog.confidence_label.text()
    assert document.demonstration.video.clock == ClockMap(0.25, 1.00001)
    picture = dialog.plot.grab().toImage()
    assert len({picture.pixel(x, picture.height() // 2) for x in range(picture.width())}) > 3
    press(dialog.accept_button)
    assert document.demonstration.video.clock == dialog.candidate
    with Project.open(document.project.path) as project:
        assert project.demonstrations.load(document.id).video.clock == dialog.candidate


def test_what_is_doubtful_is_not_accepted_by_enter(document, dialog, until, monkeypatch):
    press(dialog.propose_button)
    until(lambda: dialog.proposal is not None)
    assert dialog.accept_button.isDefault()
    dialog._proposed(replace(dialog.proposal, confidence=0.33))
    assert not dialog.accept_button.isDefault()
    QTest.keyClick(dialog, Qt.Key.Key_Return)
    assert dialog.isVisible()
    assert document.demonstration.video.clock == ClockMap(0.25, 1.00001)
    press(dialog.accept_button)  # whoever has looked at it may
    assert document.demonstration.video.clock == dialog.candidate


def test_a_rate_that_no_clock_has_is_not_accepted_by_enter(dialog):
    mark(dialog, 27, 0.5)
    assert dialog.accept_button.isDefault()
    mark(dialog, 60, 1.61)
    assert "clocks never differ this much" in dialog.residual_label.text()
    assert not dialog.accept_button.isDefault()
    press(dialog.fit_rate)
    assert dialog.accept_button.isDefault()


def test_the_curves_have_times_below_them(dialog, until):
    press(dialog.propose_button)
    until(lambda: dialog.proposal is not None)
    area, picture = dialog.plot.area, dialog.plot.grab().toImage()
    below = range(round(area.bottom()) + 7, round(area.bottom()) + 16)
    assert len({picture.pixel(x, y) for x in range(picture.width()) for y in below}) > 3


def test_it_begins_at_the_bottom_right_and_then_where_it_was(document, jobs, app):
    window = QWidget()
    window.setGeometry(20, 20, 780, 720)
    window.show()
    first = SynchroniseDialog(document, jobs, window)
    first.show()
    assert first.geometry().bottomRight().x() <= window.geometry().right()
    assert first.geometry().bottomRight().y() <= window.geometry().bottom()
    assert first.geometry().left() > window.geometry().left() + 60
    assert first.height() < 560
    first.move(10, 30)
    first.reject()
    second = SynchroniseDialog(document, jobs, window)
    second.show()
    assert (second.x(), second.y()) == (10, 30)
    second.reject()
    picture = SynchroniseDialog(document, jobs, window, remembering=False)
    assert (picture.x(), picture.y()) != (10, 30)
    picture.reject()
    window.close()


def test_cancelling_while_it_searches_stores_nothing(document, dialog, until):
    press(dialog.propose_button)
    press(dialog.cancel_button)
    until(lambda: not dialog.jobs.busy)
    assert dialog.proposal is None
    assert document.demonstration.video.clock == ClockMap(0.25, 1.00001)


def test_a_click_into_the_curves_moves_the_cursor(document, dialog, until):
    press(dialog.propose_button)
    until(lambda: dialog.proposal is not None)
    plot = dialog.plot
    view, left, middle = plot.viewport(), Qt.MouseButton.LeftButton, plot.rect().center()
    QTest.mouseClick(view, left, pos=middle)
    assert document.view.cursor == pytest.approx(3.0, abs=0.05)
    QTest.mousePress(view, left, pos=middle)
    for x in (40, 80):
        QTest.mouseMove(view, middle + QPoint(x, 0))
    QTest.mouseRelease(view, left, pos=middle + QPoint(80, 0))
    assert document.view.cursor == pytest.approx(3.0, abs=0.05)  # a drag moves no cursor


def test_a_video_that_is_gone_is_told_and_marks_no_frame(document, jobs, until):
    path, name = document.demonstration.video.path, document.demonstration.name
    path.unlink()
    dialog = SynchroniseDialog(document, jobs)
    dialog.show()
    until(lambda: "is not there" in dialog.preview.picture.message)
    assert f"The video of '{name}' ('{path}') is not there" in dialog.preview.picture.message
    press(dialog.frame_button)
    assert dialog.rows == ()
    dialog.propose()
    until(lambda: bool(dialog.trouble.text()))
    assert dialog.propose_button.isEnabled()
    dialog.reject()


def test_everything_is_reached_by_keyboard_and_named(dialog):
    named = (
        dialog.frame_button,
        dialog.force_button,
        dialog.remove_button,
        dialog.fit_rate,
        dialog.table,
        dialog.snap,
        dialog.force_time,
        dialog.propose_button,
        dialog.reset_button,
        dialog.accept_button,
        dialog.cancel_button,
        dialog.preview.slider,
        dialog.preview.spin,
        dialog.preview.previous_button,
        dialog.preview.next_button,
    )
    for widget in named:
        assert widget.accessibleName()
        assert widget.focusPolicy() & Qt.FocusPolicy.TabFocus


def test_the_video_to_synchronise_is_chosen_among_several(document, jobs, until, filmed):
    document.project.media.attach_video(document.id, filmed.video.path, ClockMap(7.0), "left")
    document.reread()
    dialog = SynchroniseDialog(document, jobs, video=document.demonstration.videos[1])
    dialog.show()
    choice = dialog.choice
    assert [choice.itemText(i) for i in range(choice.count())] == ["video 1", "left"]
    assert choice.currentText() == "left"
    assert "+7.0" in dialog.stored_label.text()
    until(lambda: dialog.preview.times.size > 0)
    QTest.keyClick(choice, Qt.Key.Key_Up)
    assert dialog.video.name == "video 1"
    assert "+0.25" in dialog.stored_label.text()
    assert not dialog.preview.slider.isEnabled(), "until it is open"
    until(lambda: dialog.preview.times.size > 0)
    QTest.keyClick(choice, Qt.Key.Key_Down)
    until(lambda: dialog.preview.times.size > 0)
    mark(dialog, 30, 1.5)
    assert not choice.isEnabled(), "or the tap would be lost"
    press(dialog.reset_button)
    assert choice.isEnabled()
    mark(dialog, 30, 1.5)
    press(dialog.accept_button)
    first, left = document.demonstration.videos
    assert first.clock == ClockMap(0.25, 1.00001)
    assert left.clock.offset == pytest.approx(0.5, abs=0.09)
    assert dialog.isHidden()


def test_one_video_is_not_to_be_chosen(dialog):
    assert dialog.choice is None
