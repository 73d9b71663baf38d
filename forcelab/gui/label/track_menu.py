"""The menus of the tracks: what can be done with what is under the pointer."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PySide6.QtGui import QAction
from PySide6.QtWidgets import QInputDialog, QMenu, QWidget

from forcelab.gui.document import Document
from forcelab.gui.figures.text import NAMES
from forcelab.gui.label import segment_verbs as verbs
from forcelab.gui.label.swatches import swatch_icon
from forcelab.gui.label.track_hits import gap_at, index_at
from forcelab.gui.label.vocabulary_model import entries
from forcelab.gui.naming import settled_name, verbatim
from forcelab.labels import Segment

__all__ = [
    "ask_action",
    "ask_longest_gap",
    "copy_menu",
    "other_menu",
    "own_menu",
    "range_menu",
    "relabel_menu",
    "shown_name",
]

#: The longest gap that is offered to be filled at first, in seconds.
GAP = 0.1
#: How many letters of a name are shown, about.
LONGEST = 48


def own_menu(
    parent: QWidget, document: Document, time: float, play: Callable[[float, float], None]
) -> QMenu:
    """What can be done on the coder's track at a time in seconds.

    `play` is called with the start and the end of a segment that is to be played.
    """
    menu = QMenu("Segment", parent)
    index, gap = index_at(document.segments, time), gap_at(document.segments, time)
    if index is not None:
        _segment_entries(menu, document, index, time, play)
    elif gap is not None:
        start, end = gap
        fill = menu.addMenu("Fill this gap with")
        _actions(fill, document, lambda name: document.paint(start, end, name))
    menu.addSeparator()
    if document.range is not None:
        fill = menu.addMenu("Fill the range with")
        _actions(fill, document, lambda name: verbs.fill_range(document, name))
        _entry(menu, "Erase the range", lambda: verbs.erase_range(document))
    _entry(
        menu,
        "Fill short gaps…",
        lambda: ask_longest_gap(menu.parentWidget(), document),  # the parent must not be kept alive
        len(document.segments) > 1,
    )
    _copies(menu, document, time)
    return menu


def other_menu(
    parent: QWidget,
    document: Document,
    author: str,
    time: float,
    play: Callable[[float, float], None],
) -> QMenu:
    """What can be done on another author's track at a time in seconds."""
    menu = QMenu(author, parent)
    segments = document.others.get(author, ())
    index = index_at(segments, time)
    segment = None if index is None else segments[index]
    if segment is not None:
        label = "Copy this segment to mine"
        _entry(menu, label, lambda: document.copy_from(author, segment.start, segment.end))
    if document.range is not None:
        low, high = document.range
        label = "Copy the range to mine"
        _entry(menu, label, lambda: document.copy_from(author, low, high))
    label = "Copy the whole track to mine"
    _entry(menu, label, lambda: document.copy_from(author, *document.bounds))
    if segment is not None:
        _look_entries(menu, document, segment, play)
    return menu


def range_menu(parent: QWidget, document: Document) -> QMenu:
    """The actions that a marked range can be filled with, or those to begin with; and a new one."""
    menu = QMenu("Fill the range with", parent)
    menu.addSection("Fill with")
    _actions(menu, document, lambda name: verbs.fill_range(document, name))
    names = document.vocabulary.names
    lacking = [name for name in entries() if name not in names]
    more = menu.addMenu("More actions") if names and lacking else menu
    for name in lacking:
        _entry(more, shown_name(more, name), partial(verbs.fill_range, document, name))
    _entry(
        menu,
        "Another action…",
        lambda: ask_action(menu.parentWidget(), document),  # as above
    )
    if document.range is not None and _labelled(document, *document.range):
        menu.addSeparator()
        _entry(menu, "Erase the range", lambda: verbs.erase_range(document))
    return menu


def ask_action(parent: QWidget | None, document: Document) -> QInputDialog:
    """Ask for an action that is new, and fill the range with it; nothing waits for the answer."""
    dialog = QInputDialog(parent)
    dialog.setWindowTitle("Another action")
    dialog.setLabelText("Fill the range with an action called:")

    def named(text: str) -> None:
        name = settled_name(parent, " ".join(text.split()), document.vocabulary.names)
        if name:
            verbs.fill_range(document, name)

    dialog.textValueSelected.connect(named)
    dialog.finished.connect(dialog.deleteLater)
    dialog.open()
    return dialog


def relabel_menu(menu: QMenu, document: Document, segment: Segment) -> None:
    """Offer the other actions that one of the coder's segments can be given."""

    def relabel(name: str) -> None:
        verbs.on_segment(document, segment, lambda now: document.relabel(now, name))

    others = menu.addMenu("Relabel with")
    _actions(others, document, relabel, but=segment.action)


def copy_menu(parent: QWidget, document: Document, time: float) -> QMenu:
    """From whom to copy what lies at a time in seconds: Enter copies from the same as last."""
    menu = QMenu("Copy from another track", parent)
    found = _copies(menu, document, time)
    if found:
        menu.setDefaultAction(found.get(document.copied_from, next(iter(found.values()))))
    return menu


def ask_longest_gap(parent: QWidget | None, document: Document) -> QInputDialog:
    """Ask how long gaps may be that are filled, and fill them; nothing waits for the answer."""
    dialog = QInputDialog(parent)
    dialog.setInputMode(QInputDialog.InputMode.DoubleInput)
    dialog.setWindowTitle("Fill short gaps")
    where = "in the marked range" if document.range else "in the whole demonstration"
    label = f"Fill gaps {where} that last at most so many seconds:"
    dialog.setLabelText(label)
    dialog.setDoubleDecimals(3)
    dialog.setDoubleRange(0.001, 3600.0)
    dialog.setDoubleStep(0.01)
    dialog.setDoubleValue(GAP)
    dialog.doubleValueSelected.connect(lambda longest: verbs.fill_gaps(document, longest))
    dialog.finished.connect(dialog.deleteLater)
    dialog.open()
    return dialog


def _labelled(document: Document, start: float, end: float) -> bool:
    """Whether there is anything of the coder's between two times in seconds."""
    return any(one.start < end and start < one.end for one in document.segments)


def _segment_entries(
    menu: QMenu,
    document: Document,
    index: int,
    time: float,
    play: Callable[[float, float], None],
) -> None:
    """What can be done with one of the coder's segments."""
    segment = document.segments[index]
    # Another window may have edited the track by the time that an entry is chosen.
    on_it = partial(verbs.on_segment, document, segment)
    relabel_menu(menu, document, segment)
    _entry(menu, "Split here", lambda: document.split(time))
    _entry(
        menu,
        "Merge with the previous",
        lambda: on_it(lambda now: document.merge(now - 1, now)),
        index > 0,
    )
    _entry(
        menu,
        "Merge with the next",
        lambda: on_it(lambda now: document.merge(now, now + 1)),
        index + 1 < len(document.segments),
    )
    _entry(menu, "Delete", lambda: on_it(document.delete))
    _look_entries(menu, document, segment, play)


def _look_entries(
    menu: QMenu, document: Document, segment: Segment, play: Callable[[float, float], None]
) -> None:
    """How a segment can be looked at, whoever's it is."""
    start, end = segment.start, segment.end
    menu.addSeparator()
    _entry(menu, "Play it", partial(play, start, end))
    _entry(menu, "Zoom to it", partial(verbs.zoom_to, document, start, end))


def _actions(
    menu: QMenu, document: Document, chosen: Callable[[str], object], but: str = ""
) -> None:
    """One entry for each action, with its look and its key, which also picks it in the menu."""
    for action in document.vocabulary:
        if action.name == but:
            continue
        name = shown_name(menu, action.name)
        label = f"&{action.key.upper()}  {name}" if action.key else name
        entry = _entry(menu, label, partial(chosen, action.name))
        entry.setIcon(swatch_icon(action.colour, action.texture))
    menu.setEnabled(bool(menu.actions()))


def _copies(menu: QMenu, document: Document, time: float) -> dict[str, QAction]:
    """One entry for each other author to copy from; gives those that would copy something."""
    found = {}
    for author in document.others:
        stretch = verbs.to_copy(document, author, time)
        copy = _entry(
            menu,
            f"Copy from {shown_name(menu, author)}",
            partial(document.copy_from, author, *(stretch or ())),
            stretch is not None,
        )
        if stretch is not None:
            found[author] = copy
    return found


def shown_name(menu: QMenu, name: str) -> str:
    """A name as an entry shows it: cut if it is very long, and with its ampersands, if any."""
    metrics = menu.fontMetrics()
    return verbatim(metrics.elidedText(name, NAMES, LONGEST * metrics.averageCharWidth()))


def _entry(menu: QMenu, label: str, done: Callable[[], object], possible: bool = True) -> QAction:
    """One entry of a menu."""
    action = menu.addAction(label)
    action.setEnabled(possible)
    action.triggered.connect(lambda _checked=False: done())
    return action
