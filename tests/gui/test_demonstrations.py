from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Sequence

import numpy as np
import pytest
from factories import cached_project, write_opencv_video
from PySide6.QtCore import QEvent, QModelIndex, QPoint, Qt, QTimer
from PySide6.QtGui import QAction, QHelpEvent, QImage
from PySide6.QtTest import QAbstractItemModelTester, QTest
from PySide6.QtWidgets import QApplication, QInputDialog, QLabel, QPushButton

from forcelab.demonstration import Channel, Demonstration
from forcelab.gui import demonstration_menu, demonstration_painter, theme
from forcelab.gui.demonstration_list import DemonstrationList, OrderButton
from forcelab.gui.demonstration_model import (
    DemonstrationModel,
    DemonstrationRow,
    TaskGroup,
    grouped,
    percent,
    rows_of,
)
from forcelab.gui.document import Document
from forcelab.gui.removal_dialog import Removal, removal_of
from forcelab.gui.text import confirm
from forcelab.gui.widgets import ElidedLabel
from forcelab.labels import Segment, Track
from forcelab.project import DemonstrationInfo, NewDemonstration, Project

LONG = "a demonstration whose name " + "is very long indeed " * 12 + "and ends so"

#: Asks for a second what is chosen while another thread makes and searches for garbage.
BESIDE_GARBAGE = """
import gc, sys, threading, time
from pathlib import Path
from PySide6.QtWidgets import QApplication
from forcelab.gui.demonstration_list import DemonstrationList
from forcelab.gui.document import Document

app = QApplication([])
document = Document("anna")
document.open_project(Path(sys.argv[1]))
listing = DemonstrationList(document)
gc.set_threshold(50)
sys.setswitchinterval(1e-5)
end = time.monotonic() + 1

def make_garbage():
    while time.monotonic() < end:
        [[i] for i in range(500)]

threading.Thread(target=make_garbage).start()
while time.monotonic() < end:
    listing._chosen()
document.close()
"""


def incoming(name: str, task: str, seed: int, **labelled: float) -> NewDemonstration:
    """A demonstration of 10 s of which each author has labelled so many."""
    times = np.arange(100) / 10
    signals = np.random.default_rng(seed).normal(size=(100, 1))
    tracks = tuple(
        Track(author, (Segment(0.0, seconds, "grab"),)) for author, seconds in labelled.items()
    )
    demonstration = Demonstration(name, task, times, signals, (Channel("fz", "N"),))
    return NewDemonstration(demonstration, tracks, f"/data/{name}.csv"[:80])


def info(id_: str, name: str, task: str = "foam", **labelled: float) -> DemonstrationInfo:
    """What the list is told of a demonstration of 9 s; of each author, the seconds labelled."""
    return DemonstrationInfo(id_, name, task, 9, (), 1.0, 9.0, labelled, ("video 1",), "")


def study(path):
    with Project.create(path) as project:
        added = project.demonstrations.add_all(
            [
                incoming("pen-10", "stylus", 0),
                incoming("pen-2", "stylus", 1, anna=5.0, bert=2.5),
                incoming("block", "foam", 2, anna=10.0),
                incoming("sponge", "foam", 3, bert=10.0),
                incoming(LONG, "a task with a rather long name of its own for once", 4),
            ]
        )
        block = next(info.id for info in added if info.name == "block")
        project.tracks.edit(
            block, "net", (), (Segment(0.0, 1.0, "grab"),), "predicted", kind="predict"
        )


@pytest.fixture
def path(tmp_path):
    return cached_project(study, tmp_path / "study.forcelab")


@pytest.fixture
def document(app, path):
    document = Document("anna")
    document.open_project(path)
    yield document
    document.close()


@pytest.fixture
def listing(document):
    listing = DemonstrationList(document)
    listing.resize(260, 500)
    listing.show()
    yield listing
    listing.close()
    listing.deleteLater()


def id_of(document: Document, name: str) -> str:
    return next(info.id for info in document.infos if info.name == name)


def open_named(document: Document, name: str) -> bool:
    return document.open_demonstration(id_of(document, name))


def shown(listing: DemonstrationList) -> dict[str, list[str]]:
    return {group.task: [row.info.name for row in group.rows] for group in listing.model.groups}


def row(listing: DemonstrationList, name: str) -> DemonstrationRow:
    return next(row for row in listing.model.rows if row.info.name == name)


def click(listing: DemonstrationList, at: QModelIndex | str, modifier=Qt.NoModifier) -> None:
    """Click a place of the list, or the demonstration of a name."""
    index = listing.model.index_of(row(listing, at).info.id) if isinstance(at, str) else at
    where = listing.view.visualRect(index).center()
    assert listing.view.viewport().rect().contains(where)
    QTest.mouseClick(listing.view.viewport(), Qt.MouseButton.LeftButton, modifier, where, delay=1)


def chosen_rows(listing: DemonstrationList) -> list[DemonstrationRow]:
    selected, index_of = listing.view.selectionModel().isSelected, listing.model.index_of
    return [row for row in listing.model.rows if selected(index_of(row.info.id))]


def chosen(listing: DemonstrationList) -> list[str]:
    return [row.info.name for row in chosen_rows(listing)]


def entries(
    listing: DemonstrationList, rows: Sequence[DemonstrationRow | TaskGroup]
) -> dict[str, QAction]:
    """The menu of one row, or of several."""
    menu = listing.menu.menu_for(rows[0], rows if len(rows) > 1 else ())
    return {action.text(): action for action in menu.actions() if action.text()}


def opened(document: Document) -> str:
    return document.demonstration.name if document.demonstration else ""


def test_demonstrations_stand_by_task_in_natural_order(listing):
    tasks = list(shown(listing))
    assert tasks == ["a task with a rather long name of its own for once", "foam", "stylus"]
    assert shown(listing)["stylus"] == ["pen-2", "pen-10"]
    assert all(listing.view.isExpanded(listing.model.index(g, 0)) for g in range(3))


def test_the_model_is_as_qt_wants_it(listing, document):
    QAbstractItemModelTester(
        listing.model, QAbstractItemModelTester.FailureReportingMode.Fatal, listing
    )
    listing.search.setText("pen")
    listing.search.setText("")
    open_named(document, "pen-2")
    document.close()
    assert listing.model.rowCount() == 0


def test_a_row_tells_ones_own_share_and_who_else_labelled(listing, document):
    assert (row(listing, "pen-2").share, row(listing, "pen-2").others) == (0.5, (("bert", 0.25),))
    assert row(listing, "block").others == (("net", 0.1),)
    assert row(listing, "pen-10") == DemonstrationRow(row(listing, "pen-10").info)
    index = listing.model.index_of(row(listing, "pen-2").info.id)
    reported = index.data(Qt.ItemDataRole.AccessibleTextRole)
    assert reported == "pen-2; Labelled by you: 50 %; Labelled by bert: 25 %; No video"
    tip = index.data(Qt.ItemDataRole.ToolTipRole)
    for part in ("10.00 s", "10 Hz", "/data/pen-2.csv", row(listing, "pen-2").info.id):
        assert part in tip
    document.set_author("bert")
    assert (row(listing, "pen-2").share, row(listing, "pen-2").others) == (0.25, (("anna", 0.5),))
    assert row(listing, "sponge").share == 1.0


@pytest.mark.parametrize(
    ("share", "reported"), [(0, 0), (1e-9, 1), (0.5, 50), (0.996, 99), (0.99995, 100), (1, 100)]
)
def test_zero_and_hundred_percent_are_nothing_and_everything(share, reported):
    assert percent(share) == reported
    # Nor is what is painted past the end more than everything.
    infos = [info("0" * 32, "x", anna=9.7)]
    assert rows_of(infos, [], "anna")[0].share == 1.0
    assert rows_of(infos, [], "bert")[0].others == (("anna", 1.0),)


def test_what_is_painted_is_soon_in_the_list(listing, document, until):
    open_named(document, "pen-10")
    store = document.project.demonstrations
    store.infos = lambda: pytest.fail("the whole list was read")
    assert document.editor.paint(0.0, 2.0, "grab")
    until(lambda: row(listing, "pen-10").share == pytest.approx(0.2))
    assert document.editor.undo_everywhere()
    until(lambda: row(listing, "pen-10").share == 0.0)
    assert document.editor.paint(0.0, 3.0, "grab")
    open_named(document, "pen-2")
    document.refresh_info()  # as the window does a moment later
    document.listing_changed.emit()
    assert row(listing, "pen-10").share == pytest.approx(0.3)
    del store.infos


def test_a_click_opens_and_a_click_on_a_task_folds_it(listing, document):
    model = listing.model
    click(listing, "pen-2")
    assert opened(document) == "pen-2"
    assert model.opened == document.id
    click(listing, model.index(1, 0))
    assert not listing.view.isExpanded(model.index(1, 0))
    document.refresh_listing()
    assert not listing.view.isExpanded(model.index(1, 0))
    listing.search.setText("block")
    assert listing.view.isExpanded(model.index(0, 0))
    listing.search.setText("")
    assert not listing.view.isExpanded(model.index(1, 0))
    click(listing, model.index(1, 0))
    assert listing.view.isExpanded(model.index(1, 0))


def test_the_keyboard_alone_searches_and_opens(listing, document):
    listing.focus_search()
    assert listing.focusWidget() is listing.search
    QTest.keyClicks(listing.search, "STYLUS pe")
    assert shown(listing) == {"stylus": ["pen-2", "pen-10"]}
    QTest.keyClick(listing.search, Qt.Key.Key_Return)
    assert opened(document) == "pen-2"
    assert listing.focusWidget() is listing.view
    QTest.keyClick(listing.view, Qt.Key.Key_Down)
    QTest.keyClick(listing.view, Qt.Key.Key_Return)
    assert opened(document) == "pen-10"
    listing.focus_search()
    QTest.keyClick(listing.search, Qt.Key.Key_Escape)
    assert len(shown(listing)) == 3
    listing.focus_search()
    QTest.keyClicks(listing.search, "block")
    QTest.keyClick(listing.search, Qt.Key.Key_Escape)
    assert listing.search.text() == ""
    assert listing.focusWidget() is listing.view
    assert opened(document) == "pen-10"
    for key in (Qt.Key.Key_Down, Qt.Key.Key_Escape):
        listing.focus_search()
        QTest.keyClick(listing.search, key)
        assert listing.focusWidget() is listing.view


def sort(listing, order):
    choices = listing.findChild(OrderButton).menu().actions()
    next(choice for choice in choices if choice.data() == order).trigger()


def test_each_task_is_sorted_as_one_wishes_and_so_the_next_time(listing, document):
    assert shown(listing)["stylus"] == ["pen-2", "pen-10"]
    sort(listing, "share")
    assert shown(listing)["stylus"] == ["pen-10", "pen-2"]
    assert shown(listing)["foam"] == ["sponge", "block"]
    again = DemonstrationList(document)
    assert shown(again) == shown(listing)
    again.deleteLater()
    document.set_author("bert")  # of whose own labels the share is
    assert shown(listing)["foam"] == ["block", "sponge"]
    sort(listing, "name")
    assert shown(listing)["stylus"] == ["pen-2", "pen-10"]


def test_what_the_coder_labelled_last_comes_first_with_its_task(listing, document):
    sort(listing, "edit")
    open_named(document, "pen-10")
    before = shown(listing)
    document.editor.paint(1.0, 2.0, "grab")
    document.refresh_info()
    assert shown(listing) == before  # nothing moves below the hand
    open_named(document, "sponge")
    after = shown(listing)
    assert next(iter(after)) == "stylus"
    assert after["stylus"] == ["pen-10", "pen-2"]
    project, pen = document.project, id_of(document, "pen-2")
    project.tracks.edit(pen, "bert", project.tracks.get(pen, "bert").segments, (), "erased")
    document.refresh_listing()
    open_named(document, "block")
    assert shown(listing)["stylus"] == ["pen-10", "pen-2"]  # what others do does not count


def test_next_and_previous_stay_among_what_is_shown(listing, document):
    obstacles = listing.obstacles()
    listing.search.setText("foam")
    listing.open_next()
    assert opened(document) == "block"
    listing.open_next()
    assert opened(document) == "sponge"
    listing.open_next()
    assert opened(document) == "sponge"
    assert obstacles["next_demonstration"]() == "This is the last demonstration of the list."
    assert obstacles["previous_demonstration"]() == ""
    listing.open_previous()
    listing.open_previous()
    assert opened(document) == "block"
    assert obstacles["previous_demonstration"]() == "This is the first demonstration of the list."
    listing.search.setText("nowhere")
    listing.open_next()
    assert obstacles["next_demonstration"]() == "No demonstration is shown in the list."


def test_the_next_one_to_label_is_found_wherever_it_is(listing, document):
    names = [row.info.name for row in listing.model.rows]
    assert names == [LONG, "block", "sponge", "pen-2", "pen-10"]  # anna began block and pen-2
    open_named(document, "block")
    names_opened = []
    for _ in range(3):
        listing.open_to_label()
        names_opened.append(opened(document))
    assert names_opened == ["sponge", "pen-10", LONG]  # and from the end it begins anew
    listing.menu.set_done([id_of(document, LONG), id_of(document, "pen-10")], True)
    listing.menu.assign([id_of(document, "pen-2")], "anna")  # begun, but somebody waits for it
    listing.open_to_label()
    listing.open_to_label()
    assert opened(document) == "pen-2"
    listing.search.setText("pen")
    listing.open_to_label()
    assert opened(document) == "pen-2"
    sentence = "No other demonstration in the list is left to label."
    assert listing.obstacles()["next_to_label"]() == sentence


def test_a_task_is_finished_before_another_is_begun(listing, document):
    open_named(document, "pen-10")  # the last one in the list
    listing.done_and_next()
    assert opened(document) == "pen-2"
    listing.done_and_next()
    assert opened(document) == LONG


def test_the_menu_too_ends_what_a_key_began_before_it_marks_it_as_done(listing, document):
    open_named(document, "pen-2")
    document.begin_stroke("grab", 8)
    document.view.seek(3)
    assert not listing.menu.set_done([document.id], True)
    assert not document.project.coding.assignments("anna")
    document.view.seek(9)
    assert listing.menu.set_done([document.id], True)
    assert document.editor.segments == (Segment(0, 5, "grab"), Segment(8, 9, "grab"))


def test_going_on_by_a_key_with_ctrl_chooses_that_one_alone(listing, document):
    open_named(document, "block")
    screen = listing.window().windowHandle()
    QTest.keyPress(screen, Qt.Key.Key_Control, Qt.KeyboardModifier.ControlModifier)
    listing.open_to_label()
    listing.open_to_label()
    QTest.keyRelease(screen, Qt.Key.Key_Control)
    assert chosen(listing) == [opened(document)]


def test_another_thread_may_search_for_garbage_meanwhile(path):
    overwriting = os.environ | {"PYTHONMALLOC": "debug"}  # what is freed
    command = [sys.executable, "-c", BESIDE_GARBAGE, str(path)]
    subprocess.run(command, env=overwriting, check=True)


def test_several_are_chosen_and_put_right_at_once(listing, document, until):
    first = id_of(document, "sponge")
    document.open_demonstration(first)
    click(listing, "pen-2", Qt.ControlModifier)
    click(listing, "pen-10", Qt.ControlModifier)
    assert document.id == first  # to choose is not to open
    rows = chosen_rows(listing)
    assert chosen(listing) == ["sponge", "pen-2", "pen-10"]
    (count,) = listing.findChildren(ElidedLabel)
    assert (count.text, count.isVisible()) == ("3 chosen", True)
    reads = []
    document.listing_changed.connect(lambda: reads.append(None))
    entries(listing, rows)["Mark 3 as done"].trigger()
    assert len(reads) == 1  # read once for all of them
    assigned = document.project.coding.assignments("anna")
    assert {a.demonstration for a in assigned if a.done} == {row.info.id for row in rows}
    assert chosen(listing) == ["sponge", "pen-2", "pen-10"]
    again = entries(listing, chosen_rows(listing))
    assert "Mark 3 as done" not in again
    again["Withdraw 3 assignments (anna)"].trigger()
    assert not document.project.coding.assignments("anna")
    assert listing.menu.set_task([row.info.id for row in rows], "marker")
    assert [info.task for info in document.infos if info.name.startswith("pen")] == ["marker"] * 2
    click(listing, "block")
    assert opened(document) == "block"
    assert chosen(listing) == ["block"]
    assert count.text == "1 of 5 done"


def test_what_is_opened_is_chosen_alone(listing, document):
    open_named(document, "block")
    listing.view.collapse(listing.model.index(2, 0))
    listing.choose_all()
    assert len(chosen_rows(listing)) == 5
    assert listing.view.isExpanded(listing.model.index(2, 0))  # what is chosen is seen
    listing.open_next()
    assert chosen(listing) == ["sponge"]
    listing.search.setText("pen")
    assert chosen(listing) == []  # nothing of it seems chosen that is not shown


def test_filters_show_what_is_left_to_do(listing, document):
    project = document.project
    project.coding.assign(id_of(document, "pen-10"), "anna")
    project.coding.assign(id_of(document, "block"), "anna", blind=False)
    project.coding.set_done(id_of(document, "block"), "anna")
    project.coding.assign(id_of(document, "sponge"), "bert")
    document.refresh_listing()
    names = {}
    for i in range(listing.shown.count()):
        listing.shown.setCurrentIndex(i)
        names[listing.shown.currentData()] = [
            name for names in shown(listing).values() for name in names
        ]
    assert len(names["all"]) == 5
    assert names["unlabelled"] == [LONG, "sponge", "pen-10"]
    assert names["begun"] == ["pen-2"]
    assert names["assigned"] == ["pen-10"]
    assert names["done"] == ["block"]


def show(listing: DemonstrationList, what: str) -> None:
    listing.shown.setCurrentIndex(listing.shown.findData(what))


def test_what_is_half_labelled_is_never_lost(listing, document, until):
    show(listing, "unlabelled")
    open_named(document, "pen-10")
    document.editor.paint(0.0, 2.0, "grab")
    until(lambda: row(listing, "pen-10").share > 0)
    document.refresh_info()
    assert shown(listing)["stylus"] == ["pen-10"]
    current = listing.model.at(listing.view.currentIndex())
    assert isinstance(current, DemonstrationRow)
    assert current.info.name == "pen-10"
    open_named(document, "sponge")
    assert "stylus" not in shown(listing)
    show(listing, "begun")
    assert shown(listing) == {"foam": ["sponge"], "stylus": ["pen-2", "pen-10"]}
    listing.menu.set_done([id_of(document, "pen-10")], True)
    assert shown(listing)["stylus"] == ["pen-2"]
    show(listing, "all")
    reported = listing.model.index(2, 0).data(Qt.ItemDataRole.AccessibleTextRole)
    assert reported == "stylus; 1 of 2 done by you; 2 started"


def test_a_filtered_list_highlights_only_what_is_open(listing, document):
    open_named(document, "pen-2")
    for name in ("block", "sponge"):
        listing.view.setCurrentIndex(listing.model.index_of(id_of(document, name)))
        listing.search.setText("foam")
        assert not listing.view.selectedIndexes()
        listing.search.clear()
        [chosen] = listing.view.selectedIndexes()
        assert chosen.data() == "pen-2"


def test_a_blind_coder_learns_nothing_of_the_others(listing, document, answers, monkeypatch):
    id_ = id_of(document, "pen-2")
    document.open_demonstration(id_)
    assert "bert" in document.other_tracks
    assert listing.menu.assign([id_], "anna")
    document.project.coding.assign(id_, "bert")
    document.refresh_listing()
    assert document.coding_blind
    assert document.other_tracks == {}
    assert row(listing, "pen-2").blind
    index = listing.model.index_of(id_)
    for role in (Qt.ItemDataRole.AccessibleTextRole, Qt.ItemDataRole.ToolTipRole):
        assert "bert" not in index.data(role)
        assert "blind" in index.data(role)
    assert not any("bert" in title for title in entries(listing, [row(listing, "pen-2")]))
    drawn = []
    with monkeypatch.context() as patched:
        patched.setattr(
            demonstration_painter, "draw_line", lambda *words, **_: drawn.append(words[2])
        )
        listing.grab()
    assert drawn[drawn.index("pen-2") :][2] == "others hidden"
    questions = answers("Cancel")
    entries(listing, [row(listing, "pen-2")])["Mark as done"].trigger()
    assert "Mark 'pen-2' as done and end blind coding?" in questions[0]
    assert document.coding_blind
    entries(listing, [row(listing, "pen-2")])["Withdraw the assignment (anna)"].trigger()
    assert "Withdraw your assignment of 'pen-2' and end blind coding?" in questions[1]
    assert document.coding_blind
    answers("Mark as done")
    entries(listing, [row(listing, "pen-2")])["Mark as done"].trigger()
    assert "bert" in document.other_tracks
    assert row(listing, "pen-2").done
    assert row(listing, "pen-2").others == (("bert", 0.25),)


@pytest.mark.parametrize(
    ("names", "reported"),
    [
        (["pen-10"], "The demonstration is assigned to bert."),
        (["pen-2", "pen-10"], "2 demonstrations are assigned to bert."),
    ],
)
def test_who_assigns_is_told_that_it_is_done(
    listing, document, messages, monkeypatch, names, reported
):
    monkeypatch.setattr(QInputDialog, "getItem", lambda *_: ("bert", True))
    menu = entries(listing, [row(listing, name) for name in names])
    next(entry for text, entry in menu.items() if text.startswith("Assign ")).trigger()
    assert (reported, False) in messages
    assert len(document.project.coding.assignments("bert")) == len(names)


def test_what_the_menu_does_is_in_the_project(listing, document, messages, tmp_path):
    menu, project = listing.menu, document.project
    id_ = id_of(document, "pen-10")
    document.open_demonstration(id_)
    assert menu.rename(id_, "pencil")
    assert opened(document) == "pencil"
    assert shown(listing)["stylus"] == ["pen-2", "pencil"]
    film = tmp_path / "film.avi"
    film.write_bytes(b"no film at all")
    assert not menu.attach_video(id_, film)
    assert not document.infos[[info.id for info in document.infos].index(id_)].has_video
    assert not list((project.path / "demonstrations" / id_).glob("video-*"))
    write_opencv_video(film, "MJPG", 3)
    assert menu.attach_video(id_, film)
    assert any("'film.avi' lasts 0.07 s" in text for text, _ in messages)
    assert document.demonstration.video is not None
    assert row(listing, "pencil").info.has_video
    assert menu.set_done([id_], True)
    assert [a.done is not None for a in project.coding.assignments("anna")] == [True]
    assert menu.set_done([id_], False)
    assert menu.unassign([id_], "anna")
    assert project.coding.assignments() == ()


def test_a_further_video_is_added_and_one_of_several_replaced(
    listing, document, monkeypatch, tmp_path
):
    films = [
        write_opencv_video(tmp_path / f"{name}.avi", "MJPG", length)
        for name, length in (("pen-10", 3), ("pen-10.left", 4), ("other", 5))
    ]
    names = []
    monkeypatch.setattr(demonstration_menu, "ask_file", lambda *_: films[0])
    monkeypatch.setattr(
        QInputDialog, "getItem", lambda *words: names.append(words[3]) or (words[3][0], True)
    )
    id_ = id_of(document, "pen-10")

    def menu():
        return entries(listing, [row(listing, "pen-10")])

    def contents():
        videos = document.project.demonstrations.load(id_).videos
        return {video.name: video.path.read_bytes() for video in videos}

    menu()["Attach video…"].trigger()
    first, films[0] = films[0], films[1]
    menu()["Add another video…"].trigger()
    assert names == [["left", "video 1"]]
    assert contents() == {"video 1": first.read_bytes(), "left": films[1].read_bytes()}
    films[0] = films[2]
    (replacing,) = [entry.menu() for text, entry in menu().items() if text == "Replace video"]
    (left,) = [entry for entry in replacing.actions() if entry.text() == "left…"]
    left.trigger()
    assert contents()["left"] == films[2].read_bytes()
    index = listing.model.index_of(id_)
    assert index.data(Qt.ItemDataRole.AccessibleTextRole).endswith("; With 2 videos")
    text = " ".join(
        label.text() for label in removal_of([row(listing, "pen-10")], "anna").findChildren(QLabel)
    )
    assert "its videos 'video 1', 'left'" in text
    monkeypatch.setattr(demonstration_menu, "confirm", lambda *_: True)
    (removing,) = [entry.menu() for text, entry in menu().items() if text == "Remove video"]
    removing.actions()[0].trigger()
    assert list(contents()) == ["left"]


def test_a_demonstration_changes_its_task_and_comes_back(listing, document):
    def titles() -> dict[str, QAction]:
        return entries(listing, [row(listing, "pen-2")])

    open_named(document, "pen-2")
    assert not any("Back" in title for title in titles())
    assert listing.menu.set_task([document.id], "foam")
    assert shown(listing)["foam"] == ["block", "pen-2", "sponge"]
    assert document.demonstration.task == "foam"
    assert "Back to task 'stylus'" in titles()
    assert listing.menu.set_task([document.id], "stylus")
    assert shown(listing)["stylus"] == ["pen-2", "pen-10"]


def test_what_was_imported_by_mistake_is_removed(listing, document, messages):
    id_ = id_of(document, "pen-2")
    document.open_demonstration(id_)
    heads = {name: document.project.tracks.head(id_, name) for name in ("anna", "bert")}
    assert not listing.menu.remove({id_: {"anna": heads["anna"]}})
    assert "was labelled meanwhile" in messages[-1][0]
    assert document.id == id_
    assert listing.menu.remove({id_: heads})
    assert document.id == ""
    assert shown(listing)["stylus"] == ["pen-10"]


@pytest.mark.parametrize("key", [Qt.Key.Key_Return, Qt.Key.Key_Escape])
def test_neither_enter_nor_escape_does_what_cannot_be_undone(app, key):
    QTimer.singleShot(0, app, lambda: QTest.keyClick(QApplication.activeModalWidget(), key))
    assert not confirm(None, "Remove video", "Remove it?", "For good.", "Remove")


def test_several_are_removed_at_once_or_none_of_them(listing, document, messages, monkeypatch):
    names = ("pen-2", "pen-10", "block")
    rows = [row(listing, name) for name in names]
    ids = [row.info.id for row in rows]
    document.open_demonstration(ids[1])
    action = entries(listing, rows)["Remove 3 from the project…"]
    questions = []

    def exec_(dialog):
        questions.append(dialog)
        assert dialog.remove.isEnabled() == dialog.consent.isHidden()
        return len(questions) > 1

    monkeypatch.setattr(Removal, "exec", exec_)
    action.trigger()
    assert "the labels of bert (on 1)" in questions[0].text.text()
    assert "bert" in questions[0].consent.text()
    assert {info.id for info in document.infos} >= set(ids)
    tracks, head = document.project.tracks, document.project.tracks.head
    with monkeypatch.context() as stale:  # bert has gone on labelling one of them meanwhile
        stale.setattr(tracks, "head", lambda *at: head(*at) - (at == (ids[0], "bert")))
        action.trigger()
    assert len(questions) == 2
    assert {info.id for info in document.infos} >= set(ids)
    assert document.id == ids[1]
    action.trigger()
    assert not {info.id for info in document.infos} & set(ids)
    assert document.id == ""
    assert messages[-1][0] == "3 demonstrations were removed."


def test_others_labels_go_only_where_that_is_agreed_to(listing, document):
    alone = removal_of([row(listing, "pen-10")], "anna")
    assert alone.remove.isEnabled()
    both = removal_of([row(listing, "pen-2")], "anna")
    assert "bert" in both.consent.text()
    assert not both.remove.isEnabled()
    both.consent.click()
    assert both.remove.isEnabled()
    for name in ("pen-2", "pen-10"):
        listing.menu.assign([id_of(document, name)], "anna")
    blind = [removal_of([row(listing, name)], "anna") for name in ("pen-2", "pen-10")]
    assert len({dialog.consent.text() for dialog in blind}) == 1
    for dialog in blind:
        words = [label.text() for label in dialog.findChildren(QLabel)]
        assert not any("bert" in text for text in [*words, dialog.consent.text()])
        assert not dialog.remove.isEnabled()


def test_what_cannot_be_done_is_said(listing, document, messages, tmp_path):
    id_ = id_of(document, "pen-10")
    assert not listing.menu.rename(id_, "pen-2")
    assert messages[-1][1]
    assert "choose another name" in messages[-1][0]
    assert not listing.menu.attach_video(id_, tmp_path / "missing.mp4")
    assert not listing.menu.assign([id_], "net")
    assert "is a model" in messages[-1][0]
    assert len(messages) == 3


def test_every_row_has_a_menu(listing, document):
    open_named(document, "pen-2")
    assert list(entries(listing, [row(listing, "block")])) == [
        "Open",
        "Mark as done",
        "Assign for blind coding…",
        "Note…",
        "Rename…",
        "Attach video…",
        "Move to another task…",
        "Remove from the project…",
    ]
    assert not entries(listing, [row(listing, "pen-2")])["Open"].isEnabled()
    assert list(entries(listing, listing.model.groups[1:2])) == [
        "Mark 2 as done",
        "Assign 2 for blind coding…",
        "Move 2 to another task…",
        "Remove 2 from the project…",
    ]


def test_one_demonstration_is_not_spoken_of_as_several(listing, document):
    project = document.project
    project.coding.assign(id_of(document, "block"), "Nora")
    document.refresh_listing()
    [alone] = [group for group in listing.model.groups if len(group.rows) == 1]
    listing.menu.set_done([alone.rows[0].info.id], True)
    [alone] = [group for group in listing.model.groups if len(group.rows) == 1]
    texts = list(entries(listing, [alone]))
    assert "Mark 1 as not done" in texts
    assert not any("these 1" in text.lower() or "1 assignments" in text for text in texts)
    texts = list(entries(listing, [row(listing, "block"), row(listing, "pen-2")]))
    assert "Withdraw the assignment (Nora)" in texts


def test_a_project_that_may_only_be_read_offers_only_to_open(app, path, monkeypatch):
    monkeypatch.setattr("forcelab.project.database.os.access", lambda *_: False)
    document = Document("anna")
    document.open_project(path)
    listing = DemonstrationList(document)
    offered = entries(listing, [row(listing, "block")])
    assert [text for text, entry in offered.items() if entry.isEnabled()] == ["Open"]
    document.close()
    listing.deleteLater()


def test_what_another_window_does_shows_and_leaves_the_cursor_where_it_is(listing, document, path):
    open_named(document, "pen-2")
    listing.view.setCurrentIndex(listing.model.index_of(id_of(document, "sponge")))
    resets = []
    listing.model.modelReset.connect(lambda: resets.append(1))
    with Project.open(path) as other:
        other.tracks.edit(
            id_of(document, "sponge"), "anna", (), (Segment(0.0, 5.0, "grab"),), "painted"
        )
        document.refresh()
        assert row(listing, "sponge").share == 0.5
        assert resets == []
        other.demonstrations.add_all([incoming("cube", "foam", 9)])
        document.refresh()
    assert shown(listing)["foam"] == ["block", "cube", "sponge"]
    assert listing.view.currentIndex().data() == "sponge"
    assert listing.model.opened == document.id


def test_where_there_is_nothing_it_says_what_to_do(listing, document, tmp_path):
    def button() -> QPushButton | None:
        visible = [b for b in listing.findChildren(QPushButton) if b.isVisible()]
        return visible[0] if visible else None

    assert button() is None
    listing.search.setText("nowhere")
    assert button().text() == "Show all"
    assert any("'nowhere'" in label.text() for label in listing.findChildren(QLabel))
    QTest.mouseClick(button(), Qt.MouseButton.LeftButton)
    assert len(shown(listing)) == 3
    Project.create(tmp_path / "empty.forcelab").close()
    document.open_project(tmp_path / "empty.forcelab")
    questions = []
    listing.importing.connect(lambda: questions.append(1))
    QTest.mouseClick(button(), Qt.MouseButton.LeftButton)
    assert questions == [1]
    assert not listing.search.isVisible()
    document.close()
    assert button() is None


@pytest.mark.parametrize("choice", ["light", "dark"])
@pytest.mark.parametrize("width", [120, 260, 400])
def test_every_row_is_painted_within_its_box(app, listing, document, choice, width):
    theme.use_theme(app, choice)
    document.project.coding.assign(id_of(document, "block"), "anna")
    open_named(document, "pen-2")
    listing.resize(width, 400)
    image = listing.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    index = listing.model.index_of(id_of(document, "pen-2"))
    box = listing.view.visualRect(index)
    corner = listing.view.viewport().mapTo(listing, QPoint(0, 0))
    stripe = image.pixelColor(corner.x() + 1, corner.y() + box.center().y())
    assert stripe.name() == theme.colours().accent
    theme.use_theme(app, "light")


def test_a_tool_tip_of_a_name_that_looks_like_markup_shows_it(listing, document):
    listing.menu.rename(id_of(document, "block"), "<b>&amp;")
    index = listing.model.index_of(id_of(document, "<b>&amp;"))
    assert "&lt;b&gt;&amp;amp;" in index.data(Qt.ItemDataRole.ToolTipRole)
    where = listing.view.visualRect(index).center()
    event = QHelpEvent(QEvent.Type.ToolTip, where, listing.mapToGlobal(where))
    assert listing.view.viewportEvent(event)


def test_a_thousand_demonstrations_are_shown_at_once(app, listing, document):
    infos = [info(f"{i:032x}", f"pen-{i}", f"task {i // 200}", anna=3.0) for i in range(1000)]
    document.infos = tuple(infos)
    begun = time.process_time()
    document.listing_changed.emit()
    app.processEvents()
    # 30 ms where nothing else is at work.
    assert time.process_time() - begun < 0.3
    assert sum(len(group.rows) for group in listing.model.groups) == 1000
    assert len(listing.view.findChildren(QPushButton)) == 0


def test_words_are_found_in_name_task_and_id_in_any_order():
    infos = [
        info(f"{i:032x}", name, task)
        for i, (name, task) in enumerate([("Grüße 1", "LEGO"), ("two", "LEGO"), ("GRÜSSE", "foam")])
    ]
    rows = rows_of(infos, [], "anna")
    assert [group.task for group in grouped(rows, "grüsse", "all")] == ["LEGO", "foam"]
    assert grouped(rows, " lego TWO ", "all") == (TaskGroup("LEGO", (rows[1],)),)
    assert grouped(rows, f"{2:032x}", "all") == (TaskGroup("foam", (rows[2],)),)
    assert grouped(rows, "", "done") == ()


def test_what_is_counted_as_done_is_shown_as_done():
    infos = [info(f"{s:032x}", f"pen-{s}", "LEGO", anna=s) for s in (4, 9)]
    half, whole = rows_of(infos, [], "anna")
    (group,) = grouped((half, whole), "", "all")
    assert group.finished == 1
    assert grouped((half, whole), "", "done") == (TaskGroup("LEGO", (whole,)),)
    assert grouped((half, whole), "", "begun") == (TaskGroup("LEGO", (half,)),)


def test_a_number_that_is_searched_finds_names_and_not_by_chance_ids():
    """A coder of 400 who looks for participant 12 is shown that one, not 45 strangers beside it."""
    infos = [
        info(id_, name)
        for id_, name in [("12" * 16, "P03"), ("ab12cd" + "0" * 26, "P04"), ("7" * 32, "P12")]
    ]
    rows = rows_of(infos, [], "anna")
    for searched, found in [("12", "P12"), ("AB12CD", "P04"), ("ab12cd00", "P04"), ("1212", "")]:
        names = [row.info.name for group in grouped(rows, searched, "all") for row in group.rows]
        assert names == ([found] if found else []), searched


def test_an_index_that_is_nowhere_is_nothing(app):
    model = DemonstrationModel()
    assert not model.index(0, 0).isValid()
    assert not model.index_of("x").isValid()
    assert model.at(QModelIndex()) is None


def test_another_one_is_opened_where_the_open_one_was_removed_elsewhere(document, path):
    gone = id_of(document, "pen-10")
    document.open_demonstration(gone)
    with Project.open(path) as other:
        other.demonstrations.remove_all({gone: {}})
    assert open_named(document, "block")
