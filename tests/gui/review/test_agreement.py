"""Coders compared on screen, and a consensus decided with keys."""

import tempfile
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from factories import MEMORY_FOLDER
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit, QMessageBox
from window_helpers import status_messages

from forcelab.demonstration import Channel, Demonstration
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.review import agreement as coders_module
from forcelab.gui.review.agreement import AgreementView
from forcelab.gui.review.agreement_details import ConsistencyView, histogram_bins
from forcelab.labels import Segment, Track
from forcelab.project import NewDemonstration, Project
from forcelab.review.agreement import Agreement
from forcelab.review.consistency import Consistency, Durations


def track(*rows):
    return tuple(Segment(*row) for row in rows)


ANN = track((0, 1, "grab"), (1, 3, "hold"), (3, 4, "pull"), (4, 5, "hold"))
BEN = track((0, 1.06, "grab"), (1.06, 3, "hold"), (3, 4, "slip"), (4, 5, "hold"), (6, 7, "grab"))
CLEO = track((0, 2, "grab"), (2, 5, "hold"))


@dataclass
class Bench:
    document: Document
    view: AgreementView
    ids: tuple[str, ...]
    path: Path

    @property
    def bar(self):
        return self.view.consensus

    def track(self, author):
        """What the store holds, read by its own connection."""
        with Project.open(self.path) as project:
            return [
                (round(s.start, 6), round(s.end, 6), s.action)
                for s in project.tracks.get(self.ids[0], author).segments
            ]


@contextmanager
def bench(app, until, *tracks, blind=()):
    """Demonstrations with these tracks, the second of which may be blind for Ann."""
    with tempfile.TemporaryDirectory(dir=MEMORY_FOLDER) as folder:
        path = Path(folder) / "study.forcelab"
        times = np.arange(1000) / 100
        incoming = [
            NewDemonstration(
                Demonstration(f"foam {i}", "foam", times, np.sin(times + i)[:, None], CHANNELS),
                tuple(Track(name, segments) for name, segments in each.items()),
            )
            for i, each in enumerate(tracks)
        ]
        with Project.create(path) as project:
            ids = tuple(added.id for added in project.demonstrations.add_all(incoming))
            for i in blind:
                project.coding.assign(ids[i], "Ann")
        document, jobs = Document("Ann"), Jobs()
        document.open_project(path)
        document.open_demonstration(ids[0])
        view = AgreementView(document, jobs)
        view.resize(460, 700)
        view.show()
        until(lambda: view.result is not None)
        app.processEvents()
        try:
            yield Bench(document, view, ids, path)
        finally:
            view.close()
            view.deleteLater()
            assert jobs.close()
            document.close()
            app.processEvents()


CHANNELS = (Channel("f", "N"),)


@pytest.fixture(scope="module")
def two(app, until):
    """Ann and Ben on one demonstration, for tests that change nothing."""
    with bench(app, until, {"Ann": ANN, "Ben": BEN}) as b:
        yield b


def show_page(b, page):
    b.view.pages.setCurrentIndex(page)
    QApplication.processEvents()


def test_the_matrix_leads_to_the_figures_and_to_the_places(app, until):
    with bench(app, until, {"Ann": ANN, "Ben": BEN, "Cleo": CLEO}, {"Ann": ANN, "Ben": BEN}) as b:
        view = b.view
        assert view.matrix.authors == ("Ann", "Ben", "Cleo")
        assert "Fleiss" in view.summary.text()
        pair = view.result.pair("Ann", "Ben")
        assert view.matrix.pair is pair
        assert f"Kappa {pair.kappa:.2f}" in view.pair.frames.text()
        assert "2 demonstrations" in view.pair.title.text()
        heading, *counts = view.counts.text().splitlines()
        assert heading == "Demonstrations labelled, by task:"
        assert counts == ["Ann: foam 2", "Ben: foam 2", "Cleo: foam 1"]
        QTest.mouseClick(
            view.matrix.viewport(),
            Qt.MouseButton.LeftButton,
            pos=view.matrix.cell(1, 2).center().toPoint(),
        )
        assert view.pair.title.text() == "Ben and Cleo, 1 demonstration"
        QTest.keyClick(view.matrix, Qt.Key.Key_Left)  # over the diagonal
        assert view.matrix.at == (1, 0)
        spot = view.matrix.cell(0, 1).center()
        assert view.matrix.readout(spot).startswith(f"Ann and Ben: kappa {pair.kappa:.3f}")
        assert view.matrix.readout(QPointF(1, 1)) == ""
        assert view.matrix.readout(view.matrix.cell(2, 2).center()).endswith(
            ": 1 demonstration labelled"
        )
        table = view.pair.places
        first = table.rows[0].place
        assert first.duration == max(p.duration for p in (*pair.apart, *pair.alone))
        table.clicked.emit(table.model().index(0, 0))
        assert b.document.review.examined == first
        assert b.document.id == first.demonstration


def test_the_consensus_is_of_the_pair_that_was_looked_at(app, until):
    with bench(app, until, {"Ann": ANN, "Ben": BEN, "Cleo": CLEO}) as b:
        choice = b.bar.choice
        assert choice.coders == ("Ann", "Ben")
        b.view.matrix.choose(1, 2)
        assert choice.coders == ("Ben", "Cleo")
        assert choice.id == b.ids[0]
        choice.first.setCurrentIndex(0)  # what is chosen there stays, until another is looked at
        b.view._show()
        assert choice.coders == ("Ann", "Cleo")
        b.view.pages.setCurrentIndex(1)
        app.processEvents()
        b.view.matrix.choose(0, 1)
        assert choice.coders == ("Ann", "Cleo")


def test_the_histogram_reads_how_many_boundaries_are_in_a_bin(two):
    show_page(two, 0)
    plot, pair = two.view.pair.histogram, two.view.result.pair("Ann", "Ben")
    counts, edges = histogram_bins(pair.offsets)
    number = int(counts.argmax())
    spot = plot.spot((edges[number] + edges[number + 1]) / 2, counts.max() / 2)
    assert plot.readout(spot).endswith(f" ms: {counts[number]}")
    assert plot.readout(QPointF(0, 0)) == ""


def test_kinds_of_places_are_listed_apart(two):
    details = two.view.pair

    def listed(kind):
        details.kinds.setCurrentIndex(details.kinds.findData(kind))
        details.kinds.activated.emit(0)
        return [(r.place.start, r.place.end) for r in details.places.rows]

    assert listed("apart") == [(3, 4), (1, 1.06)]
    assert listed("alone") == [(6, 7)]
    assert listed("shifted") == [(1, 1.06)]
    assert listed("all") == [(3, 4), (6, 7), (1, 1.06)]


def test_what_is_to_be_labelled_blind_is_neither_compared_nor_offered(app, until):
    both = {"Ann": ANN, "Ben": BEN}
    with bench(app, until, both, both, blind=(1,)) as b:
        assert not b.view.note.isHidden()
        assert len(b.view.result.pair("Ann", "Ben").demonstrations) == 1
        assert b.bar.choice.demonstration.count() == 1
        with Project.open(b.path) as project:
            project.coding.set_done(b.ids[1], "Ann")
        b.document.reread()
        until(lambda: len(b.view.result.pairs[0].demonstrations) == 2)
        assert b.view.note.isHidden()
    with bench(app, until, both, blind=(0,)) as b:
        assert not b.view.pages.isVisible()
        assert b.bar.consensus is None


@pytest.mark.parametrize("visible", [True, False])
def test_who_looks_next_sees_at_once_nothing_that_he_codes_blind(app, until, visible):
    both = {"Ann": ANN, "Ben": BEN}
    with bench(app, until, both, both) as b:
        b.view.pages.setCurrentIndex(1)
        assert b.bar.consensus is not None
        for id_ in b.ids:
            b.document.project.coding.assign(id_, "Cleo")
        b.view.setVisible(visible)
        b.document.set_author("Cleo")
        b.view.show()
        assert not b.view.pages.isVisible()
        assert b.bar.consensus is None or not visible
        until(lambda: b.view.result is not None)
        assert b.view.note.isVisible()
        assert not b.view.pages.isVisible()


def test_a_consensus_of_the_project_before_is_not_asked_of_the_next_one(app, until, tmp_path):
    both = {"Ann": ANN, "Ben": BEN}
    Project.create(tmp_path / "next.forcelab").close()
    with bench(app, until, both) as b:
        messages = status_messages(b.document)
        b.view.pages.setCurrentIndex(1)
        b.bar.buttons.begin.setFocus()
        b.view.hide()
        b.document.open_project(tmp_path / "next.forcelab")
        b.view.pages.show()
        b.view.show()
        app.processEvents()
        assert b.bar.isVisible()
        assert b.bar.consensus is None
        assert messages == []
        assert not b.bar.buttons.tolerance.hasFocus()


def test_differences_are_called_the_same_in_both_tables(two):
    show_page(two, 1)
    rows, model = range(3), two.bar.places.model()
    found = [model.index(row, model.columnCount() - 1).data() for row in rows]
    assert found == ["boundary moved", "different actions", "only one labelled"]
    assert "boundaries match within 500 ms" in two.view.pair.offsets.text()


def test_what_cannot_be_pressed_any_more_leaves_the_keys_to_the_decisions(app, until):
    with bench(app, until, {"Ann": ANN, "Ben": BEN}) as b:
        b.view.pages.setCurrentIndex(1)
        b.view.activateWindow()
        until(b.view.isActiveWindow)
        buttons = b.bar.buttons
        for button in (buttons.begin, buttons.mean_all, buttons.undo, buttons.redo):
            button.setFocus()
            QTest.mouseClick(button, Qt.MouseButton.LeftButton)
        assert not buttons.redo.isEnabled()
        assert not buttons.tolerance.isEnabled()  # digits would be typed into it
        assert QApplication.focusWidget() is b.bar


def test_one_coder_alone_is_told_how_to_get_a_second(app, until):
    with bench(app, until, {"Ann": ANN}) as b:
        assert b.view.room.note.isVisible()
        assert "forcelab assign" in b.view.room.note.text()


def test_of_a_long_name_the_task_is_cut_and_not_the_action(app):
    long = "assembling the cartridge of the printer"
    own = Consistency("Ann", tuple(Durations(t, "grab", 1, 1.0, None) for t in (long, "")), (), ())
    document = Document("Ann")
    view = ConsistencyView(document)
    view.show_agreement(Agreement(("Ann",), (), (), None, own=(own,)), {})
    table = view.durations
    names = [table.model().index(row, 0).data() for row in range(2)]
    assert names == [f"grab · {long}", "grab · no task"]
    metrics, mode = table.fontMetrics(), table.textElideMode()
    cut = metrics.elidedText(names[0], mode, metrics.horizontalAdvance("grab · assemb"))
    assert cut.startswith("grab · a")
    view.deleteLater()
    document.close()


def test_nothing_is_compared_while_nobody_looks(app, until, monkeypatch):
    comparisons = []
    real = coders_module._compare_coders
    monkeypatch.setattr(
        coders_module, "_compare_coders", lambda *args: comparisons.append(args) or real(*args)
    )
    with bench(app, until, {"Ann": ANN, "Ben": BEN}) as b:
        count = len(comparisons)
        b.view.pair.places.interval_chosen.emit(
            b.view.pair.places.rows[0].place
        )  # opening and looking changes no label
        QTest.qWait(coders_module.COMPARE_DELAY + 50)
        assert len(comparisons) == count
        b.view.hide()
        b.document.editor.paint(8, 9, "grab")
        QTest.qWait(coders_module.COMPARE_DELAY + 50)
        assert len(comparisons) == count
        b.view.show()
        until(lambda: b.view.result.pairs[0].only == pytest.approx((1.0, 1.0)))


def test_a_consensus_is_decided_with_keys_and_each_is_stored(app, until):
    with bench(app, until, {"Ann": ANN, "Ben": BEN}) as b:
        bar = b.bar
        b.view.pages.setCurrentIndex(1)
        app.processEvents()
        assert not bar.buttons.take_a.isEnabled()
        assert not bar.buttons.undo.isEnabled()
        assert "[1]" in bar.buttons.take_a.text()
        assert "Ann" in bar.buttons.take_a.text()
        bar.buttons.begin.click()
        assert b.track("consensus") == [(0, 1, "grab"), (1.06, 3, "hold"), (4, 5, "hold")]
        assert bar.state.text() == "0 of 3 differences decided"
        assert b.document.review.examined.start == 1
        QTest.keyClick(bar, Qt.Key.Key_M)
        assert b.track("consensus")[:2] == [(0, 1.03, "grab"), (1.03, 3, "hold")]
        assert b.document.review.examined.start == 3
        assert b.document.other_tracks["consensus"]  # the tracks on screen follow
        assert not bar.buttons.mean.isEnabled()
        QTest.keyClick(bar, Qt.Key.Key_2)
        assert (3, 4, "slip") in b.track("consensus")
        QTest.keyClick(bar, Qt.Key.Key_U)
        assert bar.buttons.undo.isEnabled()
        assert not bar.buttons.redo.isEnabled()
        assert bar.state.text() == "3 of 3 differences decided"
        QTest.keyClick(bar, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
        QTest.keyClick(bar, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
        assert bar.state.text() == "1 of 3 differences decided"
        assert bar.current.start == 3
        assert bar.buttons.redo.isEnabled()
        assert (3, 4, "slip") not in b.track("consensus")
        QTest.keyClick(bar, Qt.Key.Key_Y, Qt.KeyboardModifier.ControlModifier)
        assert bar.state.text() == "2 of 3 differences decided"
        assert b.document.editor.segments == ANN  # nobody else's labels were touched
        assert "consensus" not in b.view.matrix.authors


def test_arrows_go_on_from_the_consensus_to_the_next_page_and_back(app, two, until):
    show_page(two, 0)
    two.view.activateWindow()
    until(two.view.isActiveWindow)
    two.view.pages.tabBar().setFocus()
    reached = []
    for key in (Qt.Key.Key_Right, Qt.Key.Key_Right, Qt.Key.Key_Left, Qt.Key.Key_Left):
        QTest.keyClick(app.focusWidget(), key)
        app.processEvents()
        reached.append(two.view.pages.currentIndex())
    assert reached == [1, 2, 1, 0]


def test_what_comes_back_by_itself_leaves_the_keyboard_where_it_is(app, until):
    with bench(app, until, {"Ann": ANN, "Ben": BEN}) as b:
        b.view.activateWindow()
        until(b.view.isActiveWindow)  # another test's window may still be in front
        b.view.pages.setCurrentIndex(1)
        until(b.bar.hasFocus)  # which it gets once the window is active
        field = QLineEdit(b.view)
        field.show()
        field.setFocus()
        b.document.project.coding.assign(b.ids[0], "Ann", blind=True)
        b.document.refresh_listing()
        until(lambda: not b.bar.isVisible())
        b.document.project.coding.unassign(b.ids[0], "Ann")
        b.document.refresh_listing()
        until(b.bar.isVisible)
        assert field.hasFocus()


def test_another_action_and_all_close_edges_at_once(app, until):
    with bench(app, until, {"Ann": ANN, "Ben": BEN}) as b:
        bar = b.bar
        b.view.pages.setCurrentIndex(1)
        app.processEvents()
        bar.buttons.begin.click()
        bar.buttons.tolerance.setValue(50)
        bar.buttons.mean_all.click()
        assert bar.state.text().startswith("0 of 3")
        bar.buttons.tolerance.setValue(60)
        bar.buttons.mean_all.click()
        assert bar.state.text().startswith("1 of 3")
        bar.places.clicked.emit(bar.places.model().index(1, 0))
        menu = bar.action_menu()
        next(action for action in menu.actions() if action.text() == "hold").trigger()
        assert (1.03, 5, "hold") in b.track("consensus")
        bar.step(1)
        bar.buttons.take_a.click()  # Ann has nothing there
        assert bar.state.text().startswith("3 of 3")
        assert b.track("consensus")[-1] == (1.03, 5, "hold")


def test_letters_typed_as_a_name_decide_nothing(app, until):
    with bench(app, until, {"Ann": ANN, "Ben": BEN}) as b:
        b.view.pages.setCurrentIndex(1)
        app.processEvents()
        b.bar.buttons.begin.click()
        b.view.activateWindow()
        b.bar.choice.author.setFocus()
        b.bar.choice.author.clear()
        QTest.keyClicks(b.bar.choice.author, "Ubu")
        assert b.bar.choice.author.text() == "Ubu"
        assert b.bar.state.text().startswith("0 of 3")
        b.bar.choice.author.editingFinished.emit()
        assert not b.bar.consensus.begun  # a track of its own
        assert b.track("Ubu") == []


@pytest.mark.parametrize(("answer", "name"), [(0, "Cleo"), (1, "cleo")])
def test_a_consensus_whose_name_is_nearly_a_coder_s_is_asked_about(
    app, until, monkeypatch, answer, name
):
    questions = []
    with bench(app, until, {"Ann": ANN, "Ben": BEN, "Cleo": CLEO}) as b:
        b.view.pages.setCurrentIndex(1)
        app.processEvents()
        author = b.bar.choice.author

        def press(box):
            questions.append(box.text())
            author.editingFinished.emit()  # the question takes the keyboard from the field
            box.buttons()[answer].click()

        monkeypatch.setattr(QMessageBox, "exec", press)
        author.setText(" cleo ")
        author.editingFinished.emit()
        assert questions == ["'Cleo' already exists."]
        assert (b.bar.name, author.text()) == (name, name)
        author.editingFinished.emit()
        assert len(questions) == 1
        assert b.bar.consensus.author == name


def test_bins_lie_about_zero_and_hold_every_offset():
    offsets = np.array([-120.0, -0.5, 0.0, 0.5, 19.9, 20.0, 130.0])
    counts, edges = histogram_bins(offsets)
    assert counts.sum() == len(offsets)
    assert edges[0] == -edges[-1]
    assert 0.0 in edges
    expected, _ = np.histogram(offsets, edges)
    assert counts.tolist() == expected.tolist()
    assert len(counts) <= 60


def test_it_is_drawn_at_any_size(two):
    view = two.view
    for page in range(3):
        for width in (260, 900):
            view.resize(width, 400)
            show_page(two, page)
            assert view.grab().width() >= width
    assert view.minimumSizeHint().width() < 420
    assert view.matrix.mapTo(view, QPoint(0, 0)).x() >= 0
