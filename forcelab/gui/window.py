"""The window: demonstrations at the left, workspaces as tabs, menus made from the table of keys."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from threading import Thread

from PySide6.QtCore import QByteArray, QEvent, Qt, QTimer
from PySide6.QtGui import QCloseEvent, QResizeEvent, QShowEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QApplication,
    QDialog,
    QMenu,
    QStackedWidget,
    QTabWidget,
    QWidget,
)

from forcelab.errors import InputError
from forcelab.formats.signatures import is_bag_folder
from forcelab.gui import settings, theme
from forcelab.gui.author_choice import AuthorChoice
from forcelab.gui.capture.tab import ENDLESS, CaptureTab
from forcelab.gui.demonstration_list import DemonstrationList
from forcelab.gui.document import Document
from forcelab.gui.file_dialogs import FileDrop
from forcelab.gui.guide_pages import GuideKey, page_about
from forcelab.gui.jobs import Jobs
from forcelab.gui.key_events import application
from forcelab.gui.kit import text_size
from forcelab.gui.label import commands
from forcelab.gui.label.workspace import LabelWorkspace
from forcelab.gui.launch_options import DIALOGS, REVIEW_PAGES, LaunchOptions
from forcelab.gui.layout import LAYOUT, Dock, DockedWindow, run_dialog
from forcelab.gui.menus import RecentProjects, ShownTracks, ToolBar, fill_menus, follow_tabs
from forcelab.gui.obstacles import Obstacles
from forcelab.gui.preferences import TEXT_SIZE, THEME
from forcelab.gui.project_actions import ProjectActions
from forcelab.gui.refusal_note import RefusalNote
from forcelab.gui.review.tab import BACKGROUND_JOBS, ReviewTab
from forcelab.gui.shortcuts import bind, keys
from forcelab.gui.status_bar import StatusLine
from forcelab.gui.welcome import HintBar, SampleProgress, Welcome
from forcelab.jobs import Progress
from forcelab.runtime import return_memory

#: The workspaces in the order of their tabs, as the command line names them.
WORKSPACES = ("label", "review", "capture")
#: Panels of Label that have a key: the command, and the panel.
PANEL_KEYS = {"show_scalogram": "scalogram", "segments_behind": "segments_behind"}
#: Milliseconds between two looks at what other windows and processes have changed, and from an
#: edit to the new share in the list of demonstrations.
POLL_MS, LIST_MS = 1000, 600
#: The share of the time that such looks may take, in a project with thousands of tracks.
POLL_SHARE = 0.05
#: Milliseconds after which memory that pictures and signals took is given back, again and again.
TIDY_MS = 30_000
#: The list's width at first, at least and at most, in pixels.
NARROWEST, WIDEST = 200, 250
#: In a window that is lower than so many pixels the panels need the toolbar's room.
LOWEST_WITH_TOOLBAR = 560


class Window(FileDrop, DockedWindow):
    """The program's one window.

    `author` is the coder in the project that is opened first; ``""`` for the last one. Unless
    `remembering`, as for pictures, layout and recent projects are neither used nor stored.
    """

    def __init__(self, author: str, *, remembering: bool = True) -> None:
        super().__init__()
        self._remembering = remembering
        self.document = Document(author or settings.coder(), self)
        self.jobs = Jobs(self)
        self.opening = ProjectActions(
            self.document, self.jobs, self, remembering=remembering, author=author
        )
        self.label = LabelWorkspace(self.document, self.jobs, self)
        self.review = ReviewTab(self.document, self.jobs, self.label)
        self.capture = CaptureTab(self.document, self.jobs)
        self.demonstrations = DemonstrationList(self.document)
        self._welcome = Welcome(self.opening, self._show_guide)
        self._coders, self._sample = AuthorChoice(self.document), SampleProgress(self.opening)
        self._status_line = StatusLine(self.document)
        self._dock = Dock("Demonstrations", self)
        self.obstacles = self._obstacles()
        self.commands = bind(self, self._handlers())
        self._tabs = QTabWidget(documentMode=True)
        self._tabs.tabBar().setDrawBase(False)
        self._tabs.setAccessibleName("Workspaces")
        self._tabs.tabBar().setAccessibleName("Workspaces")
        switches = [self.commands[f"workspace_{name}"] for name in WORKSPACES]
        pages = (self.label, self.review, self.capture)
        for page, switch in zip(pages, switches, strict=True):
            self._tabs.addTab(page, switch.text())
        follow_tabs(self._tabs, switches)
        self._tabs.currentChanged.connect(self._workspace_changed)
        self._tabs.setCornerWidget(self._coders, Qt.Corner.TopRightCorner)
        self._stack = QStackedWidget()
        self._stack.addWidget(self._welcome)
        self._stack.addWidget(self._tabs)
        self.setCentralWidget(self._stack)
        self._dock.setObjectName("demonstrations")
        self._dock.setWidget(self.demonstrations)
        self.addDockWidget(Qt.DockWidgetArea.LeftDockWidgetArea, self._dock)
        self._room_distributed = False
        self._add_menus_and_toolbar()
        self.setAcceptDrops(True)
        # There from the start: nothing moves when it first says something.
        self.setStatusBar(self._status_line)
        for shown in (self._sample, self.review.indicator, self.capture.indicator):
            self._status_line.addPermanentWidget(shown)
        self.capture.indicator.clicked.connect(partial(self.show_workspace, "capture"))
        self.review.indicator.clicked.connect(partial(self.show_workspace, "review"))
        GuideKey(self, self._show_guide)
        self._standard = self.saveState(LAYOUT)
        self._list_timer = QTimer(self, singleShot=True, interval=LIST_MS)
        self._poll_timer, self._memory_timer = QTimer(self), QTimer(self, interval=TIDY_MS)
        self._connect()
        self._project_changed()
        self._apply_theme()

    # What the program does with the window

    def begin(self, start: LaunchOptions) -> bool:
        """Show what the launch options ask for; returns whether a project is open."""
        self.show_workspace(start.workspace)
        project = start.project
        if project is None and self._remembering:
            project = next(iter(settings.recent_projects()), None)
            if project is not None and not self.opening.is_found(project):
                return False
        if project is None or not self.opening.open(project, start.demonstration):
            return False
        view = self.document.view
        at = view.bounds[0] if start.at is None else view.within(start.at)
        if start.span is not None:
            view.set_span(at - start.span / 2, at + start.span / 2)
        view.seek(at)
        return True

    def show_workspace(self, name: str) -> None:
        """Bring a workspace to the front, or a page of the review (:data:`REVIEW_PAGES`)."""
        page = name in REVIEW_PAGES
        self._tabs.setCurrentIndex(WORKSPACES.index("review" if page else name))
        if page:
            self.review.workspace.show_list(name)

    def open_dialog(self, name: str, files: Sequence[Path] = ()) -> None:
        """Open one of :data:`DIALOGS`, that of import with these files.

        Raises InputError if that cannot be done now.
        """
        command = DIALOGS[name]
        if obstacle := self.obstacles(command):
            raise InputError(obstacle)
        if name == "import":
            self.opening.ask_import(files)
        elif name == "settings":
            self.review.workspace.bar.open_settings()
        else:
            self.commands[command].trigger()

    def restore_layout(self) -> None:
        if geometry := settings.data("window/geometry"):
            self.restoreGeometry(QByteArray(geometry))
        self._room_distributed = self.restore_docks("window")
        self._dock.setVisible(self.document.project is not None)
        self._show_toolbar()
        self.label.restore_layout()

    @property
    def settled(self) -> bool:
        """Whether all that was requested is on the screen.

        Trainings and measurements may go on; what they bring comes when they are done.
        """
        behind = BACKGROUND_JOBS | ENDLESS
        quiet = behind.issuperset(self.jobs.busy)
        return quiet and self.label.settled

    def at_rest(self, patience: float) -> bool:
        """Whether all background work has ended after the window was closed.

        Waits at most `patience` s for each of jobs and video.
        """
        return self.jobs.close(patience) and self.label.video.close_video(patience)

    # Qt

    def closeEvent(self, event: QCloseEvent) -> None:
        """Store the layout and release everything; all labels are stored already."""
        # Who closes it from within has asked, or is a signal that waits for nobody.
        if event.spontaneous() and not self.capture.may_close(self):
            event.ignore()
            return
        with ExitStack() as leaving:  # the last step first, and each whatever becomes of another
            leaving.callback(super().closeEvent, event)
            leaving.callback(self.document.close)
            leaving.callback(self.jobs.close)
            leaving.callback(self.capture.release)  # a job may be keeping a recording
            leaving.callback(self.label.release)
            leaving.callback(self._list_timer.stop)
            leaving.callback(self._poll_timer.stop)
            leaving.callback(self._memory_timer.stop)
            if guide := self.findChild(QWidget, "guide"):
                leaving.callback(guide.close)
            if self._remembering:
                leaving.callback(self._remember_layout)

    def showEvent(self, event: QShowEvent) -> None:
        """Distribute the room at first, unless a layout was restored."""
        super().showEvent(event)
        if not self._room_distributed:
            self._room_distributed = True
            self._distribute_room()
        elif not self._widths:  # a layout was remembered
            QTimer.singleShot(0, self, self.note_widths)

    def createPopupMenu(self) -> QMenu:
        """What a right click on the toolbar or the list's title shows and hides."""
        menu = QMenu(self)
        menu.addActions([self._dock.toggleViewAction(), self.commands["toolbar"]])
        return menu

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._show_toolbar()

    def changeEvent(self, event: QEvent) -> None:
        """Check the menu entry of full screen, however it was entered."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.WindowStateChange:
            self.commands["full_screen"].setChecked(self.isFullScreen())

    def add_files(self, files: Sequence[Path]) -> None:
        """Open a project that was dropped, or import recordings."""
        if not files:
            return
        folders = [path for path in files if path.is_dir() and not is_bag_folder(path)]
        take: Callable[[], object] = partial(self.opening.ask_import, tuple(files))
        if folders:
            take = partial(self.opening.open, folders[0])
        # Once the drop is over: on a dialog that is opened within it another drop crashes Qt under
        # X, and the file manager would wait for it.
        QTimer.singleShot(0, self, take)

    # Dialogs, each loaded when it is first opened: the window is there sooner

    def _export_labels(self) -> None:
        from forcelab.gui.export_dialog import ExportDialog

        run_dialog(ExportDialog(self.document, self.jobs, self.demonstrations.model.ids(), self))

    def _synchronise(self) -> None:
        """Synchronise video and forces, with the panels at hand."""
        from forcelab.gui.label.video_sync import SynchroniseDialog

        video, keep = self.label.videos.video, self._remembering
        SynchroniseDialog(self.document, self.jobs, self, video, remembering=keep).show()

    def _show_keys(self) -> None:
        from forcelab.gui.help import HelpPage

        run_dialog(HelpPage(self.document, keys(), self))

    def _show_about(self) -> None:
        from forcelab.gui.help import AboutDialog

        run_dialog(AboutDialog(self))

    def _show_preferences(self, page: str) -> None:
        """Show the preferences beside the window; with a page of them in front, if one is named."""
        from forcelab.gui.preferences_dialog import PreferencesDialog

        dialog = self.findChild(PreferencesDialog)
        if dialog is None:
            trainer = self.review.trainer
            dialog = PreferencesDialog(self.document, trainer, self.opening, keys(), self)
            dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        if page:
            dialog.show_page(page)
        dialog.show()
        dialog.activateWindow()

    def _show_guide(self) -> None:
        """Show what the guide says of what is in front, beside the window or the dialog open."""
        from forcelab.gui.guide import GuideWindow

        place = page_about(QApplication.focusWidget(), self._stack.currentWidget())
        guide = self.findChild(GuideWindow)
        if guide is None:
            guide = GuideWindow(self, remembering=self._remembering)
        guide.show()
        guide.open(place)
        dialog = QApplication.activeModalWidget()
        guide.belong_to(dialog or self)  # or a modal dialog would keep mouse and keys from it
        if isinstance(dialog, QDialog):
            dialog.finished.connect(partial(guide.belong_to, self))
        guide.raise_()
        guide.activateWindow()

    # Inside

    def _add_menus_and_toolbar(self) -> None:
        panels = [self._dock.toggleViewAction(), *self.label.toggles_without(PANEL_KEYS.values())]
        submenus = ShownTracks(self.document, self), RecentProjects(self.opening.open_recent, self)
        fill_menus(self, self.commands, self.obstacles, panels, *submenus)
        self._toolbar = ToolBar(self.document, self.commands, self.obstacles, self)
        self.addToolBar(self._toolbar)
        shown = not self._remembering or settings.flag("window/toolbar", True)
        self.commands["toolbar"].setChecked(shown)

    def _connect(self) -> None:
        document, opening = self.document, self.opening
        document.project_changed.connect(self._project_changed)
        document.demonstration_changed.connect(opening.remember_demonstration)
        document.demonstration_changed.connect(self._show_title)
        document.demonstration_changed.connect(self._focus_tracks)
        document.tracks_changed.connect(self._list_timer.start)
        document.view.snapping_changed.connect(self._show_snapping)
        for command, panel in PANEL_KEYS.items():
            self.label.toggles[panel].toggled.connect(self.commands[command].setChecked)
            self.commands[command].setChecked(self.label.toggles[panel].isChecked())
        self._tabs.currentChanged.connect(RefusalNote(document, self.label.tracks, self).hide)
        self.capture.recording_changed.connect(self._recording_changed)
        self.capture.label_wanted.connect(partial(self.show_workspace, "label"))
        self.jobs.trouble.connect(partial(self._status_line.say, trouble=True))
        opening.sampling.connect(self._show_sample)
        theme.themes().changed.connect(self._apply_theme)
        THEME.changed.connect(self._use_theme)
        TEXT_SIZE.changed.connect(self._use_text_size)
        self.demonstrations.importing.connect(opening.ask_import)
        if self._remembering:
            self._hints = HintBar(document)
            self.label.setMenuWidget(self._hints)
            opening.begun.connect(self._hints.begin)
        opening.sample_opened.connect(self._train_sample)
        self._list_timer.timeout.connect(document.refresh_info)
        self._poll_timer.timeout.connect(self._poll_changes)
        self._poll_timer.start(POLL_MS)
        self._memory_timer.timeout.connect(lambda: Thread(target=return_memory).start())
        self._memory_timer.start()
        self._show_snapping()

    def _handlers(self) -> dict[str, Callable[[], object]]:
        document, opening = self.document, self.opening
        handlers: dict[str, Callable[[], object]] = {
            "new_project": opening.ask_new,
            "open_project": opening.ask_open,
            "import": opening.ask_import,
            "import_labels": opening.ask_labels,
            "export_labels": self._export_labels,
            "save": lambda: document.show_message(
                "Everything is saved already: each change is, as it is made."
            ),
            "synchronise": self._synchronise,
            "search": partial(self._in_list, self.demonstrations.focus_search),
            "choose_all": partial(self._in_list, self.demonstrations.choose_all),
            "coder": self._coders.choose,
            "quit": lambda: self.capture.may_close(self) and self.close(),
            "full_screen": lambda: self.setWindowState(
                self.windowState() ^ Qt.WindowState.WindowFullScreen
            ),
            "toolbar": self._switch_toolbar,
            "reset_layout": self._reset_layout,
            "manual": self._show_guide,
            "help": self._show_keys,
            "about": self._show_about,
            "next_camera": self.label.videos.show_next,
            "side_by_side": self.label.videos.switch_side_by_side,
        }
        for command, panel in PANEL_KEYS.items():
            handlers[command] = self.label.toggles[panel].toggle
        for name in (*WORKSPACES, "tradeoff"):
            handlers[f"workspace_{name}"] = partial(self.show_workspace, name)
        for command, subject in (("preferences", ""), ("change_keys", "Keys")):
            handlers[command] = partial(self._show_preferences, subject)
        for choice, _ in THEME.field.options:
            handlers[f"theme_{choice}"] = partial(THEME.set_value, choice)
        label = commands.handlers(document, self.label.tracks, self.label.player, self)
        # What was begun last is taken back where it can be seen.
        cancel = {"cancel": lambda: self.capture.cancel() or label["cancel"]()}
        handlers |= label | cancel
        handlers |= self.demonstrations.handlers() | self.review.handlers()
        handlers |= self.capture.handlers()
        return {id_: partial(self._carry_out, id_, verb) for id_, verb in handlers.items()}

    def _obstacles(self) -> Obstacles:
        """What stands in the way of each command."""
        checks = dict.fromkeys(("next_camera", "side_by_side"), self.label.videos.obstacle)
        for part in (self.demonstrations, self.review, self.capture):
            checks |= part.obstacles()
        return Obstacles(self.document, self._in_view, checks)

    def _carry_out(self, command: str, verb: Callable[[], object]) -> None:
        """Do what a command does, or say why that cannot be done now."""
        if obstacle := self.obstacles(command):
            self.document.refuse(obstacle)
        else:
            verb()

    def _in_view(self) -> bool:
        """Whether the workspace in front shows the open demonstration."""
        return WORKSPACES[self._tabs.currentIndex()] != "capture"

    def _workspace_changed(self, index: int) -> None:
        """Give timeline and video to the workspace in front; build it, the first time."""
        name = WORKSPACES[index]
        self.review.come_to_front(name == "review")
        self.capture.come_to_front(name == "capture")
        self._toolbar.refresh_soon()
        # Panels that were put back have handed the keyboard on, to whatever came next.
        if name == "label":
            self.label.tracks.setFocus()

    def _in_list(self, verb: Callable[[], object]) -> None:
        """Do something in the list, which may have been closed."""
        self._dock.setVisible(self.document.project is not None)
        verb()

    def _focus_tracks(self) -> None:
        """Let the next key paint, or choose an action, instead of being typed into a search field.

        A list of the review keeps the keyboard, as it leaves such keys to the window.
        """
        now = QApplication.focusWidget()
        if not (isinstance(now, QAbstractItemView) and self.review.isAncestorOf(now)):
            is_open = self.document.demonstration is not None
            (self.label.tracks if is_open else self.demonstrations.view).setFocus()

    def _project_changed(self) -> None:
        """Show the project, or how to open one."""
        is_open = self.document.project is not None
        self._stack.setCurrentIndex(1 if is_open else 0)
        self._dock.setVisible(is_open)
        self._show_toolbar()
        self._welcome.refresh()
        self._welcome.show_trouble("")
        self._show_title()

    def _show_toolbar(self) -> None:
        """Show the toolbar if it is switched on, a project is open, and there is room for it."""
        is_open, shown = self.document.project is not None, self.commands["toolbar"].isChecked()
        self._toolbar.setVisible(is_open and shown and self.height() >= LOWEST_WITH_TOOLBAR)

    def _switch_toolbar(self) -> None:
        """Show or hide the toolbar, and the next time as well."""
        if self._remembering:
            settings.store("window/toolbar", self.commands["toolbar"].isChecked())
        self._show_toolbar()

    def _show_sample(self, progress: Progress | None) -> None:
        """Show the progress in the status bar, too, while the start page is not in front."""
        self._sample.show_progress(progress if self.document.project is not None else None)

    def _train_sample(self) -> None:
        """Train on the sample project, so that there is something to review."""
        project = self.document.project
        if project is not None and not project.runs.summaries("evaluate"):
            self.review.trainer.train()

    def _poll_changes(self) -> None:
        """Take over what others have changed; the longer that takes, the later the next time."""
        began = time.monotonic()
        self.document.refresh()
        duration = 1000 * (time.monotonic() - began)
        self._poll_timer.setInterval(max(POLL_MS, round(duration / POLL_SHARE)))

    def _show_title(self) -> None:
        """Show what is open in the window's title."""
        project, demonstration = self.document.project, self.document.demonstration
        parts = [demonstration.name] if demonstration is not None else []
        parts += [project.path.name] if project is not None else []
        if self.capture.recording:
            stuck = self.capture.stuck
            template = "'{0}' is not kept yet" if stuck else "recording '{0}'"
            parts.insert(0, template.format(self.capture.recording))
        self.setWindowTitle(self.capture.title(" · ".join([*parts, "forcelab"])))

    def _recording_changed(self) -> None:
        """Show in the tab and in the title that something is being recorded."""
        name = self.commands["workspace_capture"].text()
        self._tabs.setTabText(WORKSPACES.index("capture"), self.capture.title(name))
        self._show_title()

    def _show_snapping(self) -> None:
        self.commands["snapping"].setChecked(self.document.view.snapping)

    def _use_theme(self) -> None:
        theme.use_theme(application(), THEME.value)
        self.commands[f"theme_{THEME.value}"].setChecked(True)

    def _use_text_size(self) -> None:
        theme.use_text_size(application(), TEXT_SIZE.value)

    def _apply_theme(self) -> None:
        theme.apply_to_application(self)

    def _remember_layout(self) -> None:
        settings.store("window/geometry", bytes(self.saveGeometry().data()))
        self.store_docks("window")
        self.label.take_back()  # its layout is the one in which nothing is lent
        self.label.remember_layout()
        self.review.remember_layout()

    def _reset_layout(self) -> None:
        self.restoreState(self._standard, LAYOUT)
        self._distribute_room()
        self._dock.setVisible(self.document.project is not None)
        self.commands["toolbar"].setChecked(True)
        self._switch_toolbar()
        self.label.reset_layout()
        self.review.reset_layout()

    def _distribute_room(self) -> None:
        """Give the list a fifth of the width, and no more than any workspace leaves it."""
        widest = round(text_size.pixels(WIDEST))
        width = min(max(self.width() * 3 // 16, NARROWEST), widest)
        self.set_widths([self._dock], width)
