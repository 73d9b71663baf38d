"""The menus of tracks, and the dialogs that they open."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PySide6.QtGui import QAction
from PySide6.QtWidgets import QInputDialog, QMenu, QWidget

from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES
from forcelab.gui.label import segment_commands as commands
from forcelab.gui.label.actions import glossary_by_action
from forcelab.gui.label.swatches import swatch_icon
from forcelab.gui.label.track_gestures import gap_at
from forcelab.gui.layout import set_enabled_with_reason
from forcelab.gui.text import escape_ampersands, settle_name
from forcelab.labels import Segment
from forcelab.segment_edits import index_at

#: Plays from one time to another, in seconds.
Play = Callable[[float, float], None]

#: The longest gap that is offered to be filled at first, in seconds.
DEFAULT_GAP = 0.1
#: Names in menus are cut to about so many letters.
LONGEST_NAME = 48


def own_menu(parent: QWidget, document: Document, time: float, play: Play) -> QMenu:
    """What can be done on the coder's track at a time (s)."""
    menu = QMenu("Segment", parent)
    index, gap = index_at(document.editor.segments, time), gap_at(document.editor.segments, time)
    if index is not None:
        _add_segment_entries(menu, document, index, time, play)
    elif gap is not None:
        start, end = gap
        fill = menu.addMenu("Fill this gap with")
        _add_actions(fill, document, lambda name: document.editor.paint(start, end, name))
    menu.addSeparator()
    if document.view.range is not None:
        fill = menu.addMenu("Fill the range with")
        _add_actions(fill, document, lambda name: commands.fill_range(document, name))
        _add_entry(menu, "Erase the range", lambda: commands.erase_range(document))
    _add_entry(
        menu,
        "Fill short gaps…",
        lambda: ask_largest_gap(menu.parentWidget(), document),  # the parent must not be kept alive
        "" if len(document.editor.segments) > 1 else "Gaps lie between two segments.",
    )
    _add_copies(menu, document, time)
    return menu


def other_menu(parent: QWidget, document: Document, author: str, time: float, play: Play) -> QMenu:
    """What can be done on another author's track at a time (s)."""
    menu = QMenu(author, parent)
    segments = document.other_tracks.get(author, ())
    index = index_at(segments, time)
    segment = None if index is None else segments[index]
    if segment is not None:
        copy_this = partial(commands.copy_span, document, author, (segment.start, segment.end))
        _add_entry(menu, "Copy this segment to mine", copy_this)
    if document.view.range is not None:
        copy_range = partial(commands.copy_span, document, author, document.view.range)
        _add_entry(menu, "Copy the range to mine", copy_range)
    copy_all = partial(commands.copy_span, document, author, document.view.bounds)
    _add_entry(menu, "Copy the whole track to mine", copy_all)
    if segment is not None:
        _add_view_entries(menu, document, segment, play)
    return menu


def range_menu(parent: QWidget, document: Document) -> QMenu:
    """The actions that a marked range can be filled with: known, suggested and new ones."""
    menu = QMenu("Fill the range with", parent)
    menu.addSection("Fill with")
    _add_actions(menu, document, lambda name: commands.fill_range(document, name))
    names = document.vocabulary.names
    suggested = [name for name in glossary_by_action() if name not in names]
    submenu = menu.addMenu("More actions") if names and suggested else menu
    for name in suggested:
        _add_entry(submenu, shown_name(submenu, name), partial(commands.fill_range, document, name))
    _add_entry(
        menu,
        "Another action…",
        lambda: ask_action(menu.parentWidget(), document),  # as above
    )
    if document.view.range is not None:
        start, end = document.view.range
        if any(segment.start < end and start < segment.end for segment in document.editor.segments):
            menu.addSeparator()
            _add_entry(menu, "Erase the range", lambda: commands.erase_range(document))
    return menu


def ask_action(parent: QWidget | None, document: Document) -> QInputDialog:
    """Open a dialog that asks for a new action and fills the range with it."""
    dialog = QInputDialog(parent)
    dialog.setWindowTitle("Another action")
    dialog.setLabelText("Fill the range with an action called:")

    def fill(typed: str) -> None:
        name = settle_name(parent, " ".join(typed.split()), document.vocabulary.names)
        if name:
            commands.fill_range(document, name)

    dialog.textValueSelected.connect(fill)
    dialog.finished.connect(dialog.deleteLater)
    dialog.open()
    return dialog


def add_relabel_menu(menu: QMenu, document: Document, segment: Segment) -> None:
    """Add the other actions that one of the coder's segments can be given."""

    def relabel(name: str) -> None:
        commands.for_current_segment(
            document, segment, lambda index: document.editor.relabel(index, name)
        )

    others = menu.addMenu("Relabel with")
    _add_actions(others, document, relabel, except_for=segment.action)


def copy_menu(parent: QWidget, document: Document, time: float) -> QMenu:
    """Authors to copy from at a time (s); the one that was copied from last is the default."""
    menu = QMenu("Copy from another track", parent)
    entries = _add_copies(menu, document, time)
    if entries:
        menu.setDefaultAction(entries.get(document.view.copied_from, next(iter(entries.values()))))
    return menu


def ask_largest_gap(parent: QWidget | None, document: Document) -> QInputDialog:
    """Open a dialog that asks for the longest gap to fill, and fills."""
    dialog = QInputDialog(parent)
    dialog.setInputMode(QInputDialog.InputMode.DoubleInput)
    dialog.setWindowTitle("Fill short gaps")
    where = "in the marked range" if document.view.range else "in the whole demonstration"
    dialog.setLabelText(f"Longest gap to fill {where} (s):")
    dialog.setDoubleDecimals(3)
    dialog.setDoubleRange(0.001, 3600.0)
    dialog.setDoubleStep(0.01)
    dialog.setDoubleValue(DEFAULT_GAP)
    dialog.doubleValueSelected.connect(lambda longest: commands.fill_gaps(document, longest))
    dialog.finished.connect(dialog.deleteLater)
    dialog.open()
    return dialog


def shown_name(menu: QMenu, name: str) -> str:
    """A name as a menu shows it: cut if it is very long, its ampersands escaped."""
    metrics = menu.fontMetrics()
    room = LONGEST_NAME * metrics.averageCharWidth()
    return escape_ampersands(metrics.elidedText(name, NAMES, room))


def _add_segment_entries(
    menu: QMenu, document: Document, index: int, time: float, play: Play
) -> None:
    """What can be done with one of the coder's segments."""
    segment = document.editor.segments[index]
    # Another window may have edited the track by the time that an entry is chosen.
    on_segment = partial(commands.for_current_segment, document, segment)
    add_relabel_menu(menu, document, segment)
    _add_entry(menu, "Split here", lambda: document.editor.split(time))
    _add_entry(
        menu,
        "Merge with the previous",
        lambda: on_segment(lambda current: document.editor.merge(current - 1, current)),
        "" if index > 0 else "This is the first segment.",
    )
    _add_entry(
        menu,
        "Merge with the next",
        lambda: on_segment(lambda current: document.editor.merge(current, current + 1)),
        "" if index + 1 < len(document.editor.segments) else "This is the last segment.",
    )
    _add_entry(menu, "Delete", lambda: on_segment(document.editor.delete))
    _add_view_entries(menu, document, segment, play)


def _add_view_entries(menu: QMenu, document: Document, segment: Segment, play: Play) -> None:
    """How any author's segment can be viewed."""
    start, end = segment.start, segment.end
    menu.addSeparator()
    _add_entry(menu, "Play it", partial(play, start, end))
    _add_entry(menu, "Zoom to it", partial(commands.zoom_to, document, start, end))


def _add_actions(
    menu: QMenu, document: Document, choose: Callable[[str], object], except_for: str = ""
) -> None:
    """One entry for each action, with its swatch and its key, which also picks it in the menu."""
    for action in document.vocabulary:
        if action.name == except_for:
            continue
        name = shown_name(menu, action.name)
        label = f"&{action.key.upper()}  {name}" if action.key else name
        entry = _add_entry(menu, label, partial(choose, action.name))
        entry.setIcon(swatch_icon(action.colour, action.texture))
    reason = f"The task has no {'other ' if except_for else ''}actions."
    set_enabled_with_reason(menu.menuAction(), "" if menu.actions() else reason)


def _add_copies(menu: QMenu, document: Document, time: float) -> dict[str, QAction]:
    """One entry for each other author; gives those that would copy something."""
    possible = {}
    for author in document.other_tracks:
        span = commands.copy_candidates(document, author, time)
        entry = _add_entry(
            menu,
            f"Copy from {shown_name(menu, author)}",
            partial(commands.copy_span, document, author, span),
            "" if span is not None else "Nothing is labelled there.",
        )
        if span is not None:
            possible[author] = entry
    return possible


def _add_entry(menu: QMenu, label: str, verb: Callable[[], object], obstacle: str = "") -> QAction:
    """Add an entry; an obstacle switches it off and is its tooltip."""
    action = menu.addAction(label)
    set_enabled_with_reason(action, obstacle)
    action.triggered.connect(lambda _checked=False: verb())
    return action
