"""The whole window: what it leaves out, what it remembers."""

import time

import pytest
from factories import (
    add_foam_demonstration,
    cached_project,
    make_foam_project,
    remove_demonstration,
)
from PySide6 import __version_info__ as version_info
from PySide6.QtCore import QEvent, QMimeData, QObject, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import (
    QColor,
    QDragEnterEvent,
    QDragMoveEvent,
    QDropEvent,
    QPalette,
    QStatusTipEvent,
)
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QComboBox,
    QCommandLinkButton,
    QDialog,
    QFileDialog,
    QLineEdit,
    QMenu,
    QStyle,
    QToolTip,
    QWidget,
)

from forcelab.gui import settings, theme
from forcelab.gui.import_dialog import ImportDialog
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.layout import set_enabled_with_reason
from forcelab.gui.menus import RecentProjects
from forcelab.gui.theme import colours
from forcelab.gui.window import WIDEST, Window
from forcelab.labels import Segment
from forcelab.project import Project

HIS = (Segment(3, 4, "hold"),)


@pytest.fixture
def study(tmp_path):
    tracks = (("Ben", HIS),)
    return cached_project(make_foam_project, tmp_path / "study.forcelab", tracks)


@pytest.fixture
def window(window_of_file, study):
    return window_of_file(LaunchOptions(project=study))


def test_it_is_complete_while_a_training_goes_on_behind_it(window, until):
    """Otherwise no picture of it could be made for minutes."""
    from forcelab.gui.review.trainer import TRAINING

    ended = []

    def training():
        while not ended:
            time.sleep(0.001)
            yield

    window.jobs.run(training(), lambda _: None, key=TRAINING)
    assert window.jobs.busy == (TRAINING,)
    assert window.settled
    window.jobs.run(training(), lambda _: None, key="anything that is to be seen")
    assert not window.settled
    ended.append(True)
    until(lambda: window.settled and not window.jobs.busy)


@pytest.mark.parametrize(
    "step", ["capture.release", "label.release", "label.remember_layout", "jobs.close"]
)
def test_a_fault_in_one_step_of_closing_leaves_nothing_open(window, monkeypatch, until, step):
    faults = []
    monkeypatch.setattr("sys.excepthook", lambda _, error, __: faults.append(str(error)))
    part, verb = step.split(".")
    part = getattr(window, part)
    done = getattr(part, verb)

    def endless():
        while True:
            time.sleep(0.001)
            yield

    def fail():
        if step == "jobs.close":
            done()
        raise ZeroDivisionError("a fault")

    with monkeypatch.context() as broken:
        broken.setattr(part, verb, fail)
        window.jobs.run(endless(), print, key="endless")
        window.close()
    assert [fault.endswith("a fault") for fault in faults] == [True]
    assert not window.isVisible()
    assert window.document.project is None
    assert not window._poll_timer.isActive()
    assert not window._list_timer.isActive()
    assert window.at_rest(5.0)
    if step == "label.release":
        done()  # what could not be let go of is let go of now


def test_that_videos_stand_side_by_side_is_remembered(windows):
    first = windows()
    assert not first.label.videos.side_by_side
    first.label.videos.show_all()
    first.close()
    assert windows().label.videos.side_by_side


def list_widths(window):
    docks = [window._dock, *(window.label._docks[name] for name in ("actions", "segments"))]
    return [dock.width() for dock in docks if dock.isVisible()]


def drag_border(page, dock, by, until):
    """Make a list wider by its border, by so many pixels to the right or to the left."""
    before, shape = dock.width(), dock.geometry()
    edge = shape.right() + 3 if by > 0 else shape.left() - 3
    start = QPoint(edge, shape.center().y())
    QTest.mousePress(page, Qt.MouseButton.LeftButton, pos=start)
    QTest.mouseMove(page, start + QPoint(by, 0))
    until(lambda: dock.width() == before + abs(by))
    QTest.mouseRelease(page, Qt.MouseButton.LeftButton, pos=start + QPoint(by, 0))
    until(lambda: page._widths[dock] == before + abs(by))


def test_lists_take_their_widths_back_once_a_small_window_is_enlarged(app, windows, study, until):
    """A click in it, and another workspace, do not make them narrow for good."""
    window = windows(LaunchOptions(project=study), size=(1440, 900))
    window.setUpdatesEnabled(False)  # sizes alone are looked at
    window.commands["reset_layout"].trigger()
    wide = [WIDEST, *[window.label._widths[window.label._docks["actions"]]] * 2]
    until(lambda: list_widths(window) == wide)
    window.resize(window.minimumSizeHint())
    until(lambda: max(list_widths(window)) < min(wide))
    for page in (window, window.label):
        title = window._dock if page is window else page._docks["actions"]
        where = title.geometry().topLeft() + QPoint(20, 8)
        QTest.mouseClick(page, Qt.MouseButton.LeftButton, pos=where)
    app.processEvents()
    window.show_workspace("review")  # which the timeline is lent to
    window.resize(1440, 900)
    window.show_workspace("label")
    until(lambda: list_widths(window) == wide)


def test_lists_keep_the_widths_that_they_were_dragged_to(windows, study, until):
    """Also where the window was closed while it was small."""
    window = windows(LaunchOptions(project=study), size=(1440, 900))
    window.setUpdatesEnabled(False)
    until(lambda: len(list_widths(window)) == 3)
    drag_border(window, window._dock, 60, until)
    drag_border(window.label, window.label._docks["actions"], -60, until)
    dragged = list_widths(window)
    for enlarged in (True, False):
        window.resize(window.minimumSizeHint())
        until(lambda: max(list_widths(window)) < min(dragged))
        if enlarged:
            window.resize(1440, 900)
            until(lambda: list_widths(window) == dragged)
    window.close()
    again = windows(LaunchOptions(project=study))
    again.resize(1440, 900)
    until(lambda: list_widths(again) == dragged)


def click_on(window, control):
    """As a mouse does, which the system hands to the window."""
    spot = control.mapTo(window, control.rect().center())
    QTest.mouseClick(window.windowHandle(), Qt.MouseButton.LeftButton, pos=spot)


def test_a_click_on_what_is_switched_off_says_why(window, until, hovered):
    def clicked(control):
        until(control.isVisible)
        assert not control.isEnabled()
        QToolTip.hideText()
        click_on(window, control)
        return QToolTip.text()

    window.label._docks["history"].raise_()
    assert clicked(window.label.history.redo) == "Nothing was undone here."
    window.show_workspace("capture")
    page = window.capture.workspace
    assert clicked(page.zero_button) == "Connect devices before zeroing them."
    assert clicked(page.record_button) == "Connect devices before recording."
    assert clicked(page.discard_button) == "There is no recording to discard."
    window.show_workspace("review")
    train = window.review.workspace.bar.train
    until(train.isVisible)
    for obstacle in ("A training goes on.", ""):
        set_enabled_with_reason(train, obstacle)
        assert train.isEnabled() == (not obstacle)
        assert (hovered(train) == "A training goes on.") == bool(obstacle)


def test_a_menu_says_why_an_entry_is_switched_off(window, hovered):
    entry = window.commands["range_in"]
    (menu,) = [object_ for object_ in entry.associatedObjects() if isinstance(object_, QMenu)]
    view = "This acts on the demonstration in view; go to Label or Review."
    for workspace, reason in (("capture", view), ("label", "")):
        window.show_workspace(workspace)
        menu.popup(window.mapToGlobal(QPoint(0, 0)))
        spot = menu.actionGeometry(entry).center()
        assert hovered(menu, spot) == reason
        QToolTip.showText(QPoint(0, 0), "no reason")
        QTest.mouseClick(menu, Qt.MouseButton.LeftButton, pos=spot)
        assert (QToolTip.text() == view) == bool(reason)
        assert menu.isVisible() == bool(reason)
    assert entry.isEnabled()


def test_a_last_project_that_was_moved_is_not_replaced_by_another(
    windows, study, tmp_path, answers, monkeypatch
):
    """It is said, and it can be located from the page of ways to begin and from the menu."""
    other, moved = tmp_path / "other.forcelab", tmp_path / "elsewhere" / "study.forcelab"
    Project.create(other).close()
    for path in (other, study):
        settings.remember_project(path)
    moved.parent.mkdir()
    study.rename(moved)
    window = windows(LaunchOptions())
    assert window.document.project is None
    assert f"'{study.name}' is no longer in '{study.parent}'" in window._welcome._trouble.text()
    assert window._welcome._trouble.isVisible()
    assert study.name in str([b.text() for b in window._welcome.findChildren(QCommandLinkButton)])
    menu = window.findChild(RecentProjects)
    menu.aboutToShow.emit()
    assert [action.text() for action in menu.actions()] == [
        "study.forcelab (not found)",
        "other.forcelab",
    ]
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_: str(moved))
    questions = answers("Locate…")
    menu.actions()[0].trigger()
    assert len(questions) == 1
    assert window.document.project.path == moved
    assert settings.recent_projects() == (moved, other)


def test_a_project_that_is_gone_can_be_left_out_of_the_list(windows, tmp_path, answers):
    settings.remember_project(tmp_path / "gone.forcelab")
    window = windows(LaunchOptions())
    answers("Remove from list")
    window.opening.open_recent(tmp_path / "gone.forcelab")
    assert settings.recent_projects() == ()
    assert window.document.project is None


def test_a_hidden_scalogram_is_not_computed(window_of_file, study, monkeypatch):
    first = window_of_file(LaunchOptions(project=study))
    first.label.toggles["scalogram"].setChecked(False)
    first.close()
    questions = []
    monkeypatch.setattr(
        "forcelab.gui.jobs.Jobs.run", lambda *_, key="", **__: questions.append(key)
    )
    second = window_of_file(LaunchOptions(project=study))
    assert not second.label.scalogram.isVisible()
    second.document.view.set_span(1, 2)
    assert not [key for key in questions if "scalogram" in key]
    second.label.toggles["scalogram"].setChecked(True)
    assert second.label.scalogram.isVisible()


def drop_files(window, paths):
    """Drop files as a file manager does that would rather move them; gives what it is answered."""
    content = QMimeData()
    content.setUrls([QUrl.fromLocalFile(str(path)) for path in paths])
    left, none = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    possible = Qt.DropAction.CopyAction | Qt.DropAction.MoveAction
    answers = []
    for kind, handler in (
        (QDragEnterEvent, window.dragEnterEvent),
        (QDragMoveEvent, window.dragMoveEvent),
        (QDropEvent, window.dropEvent),
    ):
        # Of moves, too, PySide6 6.12 wants fractions of pixels, which 6.11 does not take.
        whole = kind is not QDropEvent and version_info < (6, 12)
        where = QPoint(9, 9) if whole else QPointF(9, 9)
        event = kind(where, possible, content, left, none)
        event.setDropAction(Qt.DropAction.MoveAction)
        event.ignore()
        handler(event)
        answers.append((event.isAccepted(), event.dropAction()))
    assert len(set(answers)) == 1
    return answers[0]


def test_a_drop_is_answered_with_copy(window, monkeypatch, tmp_path):
    """Who is answered with "move" deletes the files."""
    monkeypatch.setattr(window.opening, "ask_import", lambda _: None)
    dialog = ImportDialog(window.document, window.jobs, window)
    for target in (window, dialog):
        assert drop_files(target, [tmp_path / "a.csv"]) == (True, Qt.DropAction.CopyAction)
        accepted, _ = drop_files(target, [])
        assert not accepted
    dialog.deleteLater()


def test_files_that_are_dropped_are_imported_and_folders_opened(window, study, until, monkeypatch):
    """After the drop: a dialog within it crashes the program when files are dropped there, too."""
    questions = []
    monkeypatch.setattr(window.opening, "ask_import", questions.append)
    monkeypatch.setattr(window.opening, "open", questions.append)

    def drop(*paths):
        before = len(questions)
        drop_files(window, paths)
        assert len(questions) == before
        until(lambda: len(questions) > before)

    drop(study.parent / "a.csv", study.parent / "b.csv")
    drop(study)
    bag = study.parent / "run"
    bag.mkdir()
    (bag / "metadata.yaml").touch()
    drop(bag)
    assert questions == [(study.parent / "a.csv", study.parent / "b.csv"), study, (bag,)]


def test_what_was_painted_is_no_longer_said_of_another_demonstration(window):
    document, bar = window.document, window.statusBar()
    second = add_foam_demonstration(document.project, "02")
    document.refresh_listing()
    document.editor.paint(1.0, 2.0, "grab")
    assert "grab" in bar.currentMessage()
    assert document.open_demonstration(second)
    assert bar.currentMessage() == ""
    for verb, reported in (("undo", "nothing to undo"), ("next_segment", "no segment after")):
        document.open_demonstration(second)
        window.commands[verb].trigger()
        assert reported in bar.currentMessage()
        document.open_demonstration(document.infos[0].id)
        assert bar.currentMessage() == ""
    document.open_demonstration(second)
    document.show_message("This is the last demonstration of the list.")
    document.open_demonstration(document.infos[0].id)
    assert "last demonstration" in bar.currentMessage()


def test_the_status_line_shows_trouble_as_such_in_either_theme(window, app):
    bar = window.statusBar()
    bar.say("It went wrong.", trouble=True)
    app.sendEvent(window, QStatusTipEvent("New project"))  # of an entry of a menu
    assert bar.currentMessage() == "New project"
    assert bar.palette().color(QPalette.ColorRole.WindowText) == QColor(colours().text)
    try:
        for trouble in (False, True):
            window.commands["theme_light"].trigger()
            bar.say("It went as it went.", trouble=trouble)
            window.commands["theme_dark"].trigger()
            ink = colours().trouble if trouble else colours().text
            assert colours().dark
            assert bar.palette().color(QPalette.ColorRole.WindowText) == QColor(ink)
            assert bar.currentMessage() == "It went as it went."
    finally:
        theme.use_theme(app, "light")


def test_what_belongs_to_the_window_is_dressed_as_it_is(window, app):
    """A sheet of the application would cost each part a dressing whenever it is put somewhere."""
    try:
        for choice in ("dark", "light"):
            window.commands[f"theme_{choice}"].trigger()
            menu, dialog = QMenu(window), QDialog(window)
            line = QLineEdit(dialog)
            for widget in (menu, line, window.statusBar()):
                widget.ensurePolished()
            assert menu.style().styleHint(QStyle.StyleHint.SH_Menu_Scrollable, None, menu)
            line.resize(80, 24)
            edge = line.grab().toImage().pixelColor(40, 0).name()
            assert edge == colours().frame
            box = QComboBox(dialog)
            box.addItems(["a", "b"])
            unfolded = box.view().window()
            unfolded.ensurePolished()
            ground = unfolded.palette().color(QPalette.ColorRole.Window).name()
            assert ground == colours().panel
        assert not app.styleSheet()
    finally:
        theme.use_theme(app, "light")


class Appearing(QObject):
    """Notes what is shown as a window of its own."""

    def __init__(self):
        super().__init__()
        self.kinds = []

    def eventFilter(self, watched, event):  # noqa: N802
        if event.type() == QEvent.Type.Show and isinstance(watched, QWidget) and watched.isWindow():
            self.kinds.append(type(watched).__name__)
        return False


def test_nothing_flashes_up_as_a_window_of_its_own(windows, study, app):
    """A part that is shown before it has a parent is one, for a moment, on a real screen."""
    from forcelab.gui.exception_hook import FaultDialog
    from forcelab.gui.removal_dialog import removal_of

    appearing = Appearing()
    app.installEventFilter(appearing)
    try:
        window = windows(LaunchOptions(project=study))
        for name in ("review", "capture"):
            window.show_workspace(name)
        lists = window.review.workspace.lists
        for index in range(lists.count()):
            lists.setCurrentIndex(index)
        rows = list(window.demonstrations.model.rows)
        for dialog in (
            removal_of(rows, "Ann", window),
            FaultDialog("", study, window),
        ):
            dialog.show()
            dialog.close()
            dialog.deleteLater()
    finally:
        app.removeEventFilter(appearing)
    assert appearing.kinds == ["Window", "Removal", "FaultDialog"]


def test_on_a_small_screen_the_list_keeps_its_width_and_everything_its_place(app, study, until):
    window = Window("Ann")
    window.setUpdatesEnabled(False)
    window.resize(960, 540)
    window.show()
    window.begin(LaunchOptions(project=study))
    until(lambda: window.settled)
    widths = []
    for workspace in ("label", "review", "label"):
        window.show_workspace(workspace)
        until(lambda: window.settled)
        app.processEvents()
        widths.append(window.demonstrations.width())
    assert max(widths) - min(widths) <= 10, widths
    window.label._docks["video"].show()  # the one dock that some demonstrations lack
    app.processEvents()
    assert window.minimumSizeHint().height() <= 480  # a task bar and a title bar are there, too
    assert window.minimumSizeHint().width() <= 960
    window.close()


def test_actions_are_listed_where_there_is_a_demonstration(window, tmp_path):
    view = window.label.vocabulary
    assert (view.list.isVisible(), view.nothing.isVisible()) == (True, False)
    Project.create(tmp_path / "empty.forcelab").close()
    window.opening.open(tmp_path / "empty.forcelab")
    assert (view.list.isVisible(), view.nothing.isVisible()) == (False, True)


def test_back_in_label_the_keyboard_paints_and_who_goes_through_a_list_stays_in_it(window, app):
    """Not: chooses another coder, whose box was next in the order of Tab."""
    window.show_workspace("review")
    app.processEvents()
    window.show_workspace("label")
    app.processEvents()
    assert window.focusWidget() is window.label.tracks
    window.show_workspace("review")
    window.activateWindow()
    queue = window.review.workspace.queue.list
    queue.show()
    queue.setFocus()
    app.processEvents()
    window.document.demonstration_changed.emit()
    assert app.focusWidget() is queue
    window.demonstrations.search.setFocus()
    window.document.demonstration_changed.emit()
    assert app.focusWidget() is window.label.tracks


@pytest.mark.parametrize("name", ["Coder", "Which demonstrations are shown"])
def test_a_click_on_a_list_to_choose_from_leaves_the_keyboard_on_the_track(window, app, name):
    """Not: Space opens the list again, and a letter labels as another coder."""
    window.label.tracks.setFocus()
    box = next(box for box in window.findChildren(QComboBox) if box.accessibleName() == name)
    QTest.mouseClick(box, Qt.MouseButton.LeftButton)
    box.hidePopup()
    app.processEvents()
    assert window.focusWidget() is window.label.tracks


def test_when_the_open_demonstration_is_removed_the_keyboard_is_in_the_list(window, study, app):
    """Not: types into the filter of the segments, which then hides those of the next one."""
    document = window.document
    with Project.open(study) as other:
        add_foam_demonstration(other, "02")
        remove_demonstration(other, document.id)
    document.refresh()
    app.processEvents()
    assert document.demonstration is None
    assert window.focusWidget() is window.demonstrations.view


def test_choose_all_means_the_list_that_the_keyboard_is_in(window, app, until):
    window.activateWindow()
    until(lambda: app.activeWindow() is window)  # which an unfolded list may have been before
    chosen = window.demonstrations.view.selectionModel()
    window.document.editor.paint(1.0, 2.0, "grab")
    chosen.clear()
    for view in (window.label.segments.table, window.label.vocabulary.list):
        view.setFocus()
        QTest.keyClick(view, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
        assert not chosen.hasSelection()
        assert window.focusWidget() is view
    for place in (window.label.tracks, window.demonstrations.view):
        place.setFocus()
        QTest.keyClick(place, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
        assert chosen.hasSelection()
        chosen.clear()
    search = window.demonstrations.search
    search.setText("02")
    search.setFocus()
    QTest.keyClick(search, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
    assert search.selectedText() == "02"  # where one types it is the text
    search.clear()


def test_a_list_that_was_closed_is_there_to_search_and_to_choose_in(window, app):
    for command, place in (("search", "search"), ("choose_all", "view")):
        window.demonstrations.parentWidget().close()
        window.commands[command].trigger()
        app.processEvents()
        assert window.focusWidget() is getattr(window.demonstrations, place)
        assert window.demonstrations.isVisible()
