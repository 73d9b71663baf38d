"""What this program is: its version and those of what it rests on, where it writes, its manual."""

from __future__ import annotations

import re
from importlib.metadata import metadata

import PySide6
from PySide6.QtCore import QSize, Qt, qVersion
from PySide6.QtGui import (
    QGuiApplication,
    QTextCharFormat,
    QTextCursor,
    QTextDocument,
    QTextOption,
    QTextTable,
)
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QLabel,
    QPushButton,
    QTextBrowser,
    QVBoxLayout,
    QWidget,
)

from forcelab import __version__
from forcelab.gui import settings
from forcelab.gui.arranging import stress
from forcelab.gui.faults import log_file
from forcelab.resources import versions

__all__ = ["AboutDialog", "ManualDialog", "facts", "manual"]

#: A picture alone in its line, which the installed manual comes without.
_PICTURE = re.compile(r"^\s*(?:!\[[^\]]*\]\([^)]*\)|<img[^>]*>)\s*$", re.MULTILINE)
#: A link to a file that lies beside the manual in a checkout only: following it empties the page.
_FILE = re.compile(r"\[([^\[\]]*)\]\((?!#|https?:)[^)]*\)")

#: Room below a table, in pixels; above it is half of that.
SPACE = 12


def facts() -> dict[str, str]:
    """Versions, by name, and where settings and log lie."""
    found = {**versions(), "PySide6": PySide6.__version__, "Qt": qVersion()}
    found["settings"] = settings.settings().fileName()
    found["log"] = str(log_file())
    return found


def manual() -> str:
    """The manual as Markdown, which is installed with the program; empty where it is not."""
    pictured = metadata("forcelab")["Description"] or ""
    return _FILE.sub(r"\1", _PICTURE.sub("", pictured)).strip()


class AboutDialog(QDialog):
    """Which version this is, of what, and where it writes: all that a report of a fault needs."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("About forcelab")
        title = QLabel(f"forcelab {__version__}")
        stress(title, 1.4)
        what = QLabel("Labels, recognises and scores the actions of hands in recorded forces.")
        self._facts = facts()
        form = QFormLayout()
        for name, value in self._facts.items():
            if name != "forcelab":
                form.addRow(name, _copied(value, name))
        column = QVBoxLayout(self)
        column.setSpacing(14)
        column.addWidget(title)
        column.addWidget(what)
        column.addLayout(form)
        column.addWidget(self._buttons())

    def _buttons(self) -> QDialogButtonBox:
        """Copy, open the manual, close."""
        buttons = QDialogButtonBox()
        self.copy_button = QPushButton("Copy")
        self.copy_button.setAccessibleName("Copy versions and places")
        self.copy_button.clicked.connect(self._copy)
        close = QPushButton("Close")
        close.setAccessibleName("Close")
        close.setDefault(True)
        close.clicked.connect(self.accept)
        buttons.addButton(self.copy_button, QDialogButtonBox.ButtonRole.ActionRole)
        buttons.addButton(close, QDialogButtonBox.ButtonRole.AcceptRole)
        return buttons

    def _copy(self) -> None:
        """Copy everything, for a message to whoever mends something."""
        lines = (f"{name}: {value}" for name, value in self._facts.items())
        QGuiApplication.clipboard().setText("\n".join(lines))
        self.copy_button.setText("Copied")


class ManualDialog(QDialog):
    """The manual, to be read beside the window.

    Parameters
    ----------
    text : str
        As of :func:`manual`.
    """

    def __init__(self, text: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Manual of forcelab")
        self.pages = QTextBrowser()
        self.pages.setAccessibleName("Manual")
        self.pages.setOpenExternalLinks(True)
        self.pages.setMarkdown(text)
        _name_headings(self.pages.document())
        _fit(self.pages.document())
        column = QVBoxLayout(self)
        column.addWidget(self.pages)
        self.resize(self.sizeHint())

    def sizeHint(self) -> QSize:
        """Room for lines of about a hundred characters, within the screen."""
        metrics = self.fontMetrics()
        room = self.screen().availableGeometry().size() * 0.92
        return QSize(metrics.averageCharWidth() * 116, metrics.lineSpacing() * 46).boundedTo(room)


def _name_headings(document: QTextDocument) -> None:
    """Let links such as ``#from-python`` find their headings, which Qt gives no names."""
    block = document.begin()
    while block.isValid():
        if block.blockFormat().headingLevel():
            named = QTextCharFormat()
            name = re.sub(r"[^\w -]", "", block.text()).lower().replace(" ", "-")
            named.setAnchor(True)
            named.setAnchorNames([name])
            cursor = QTextCursor(block)
            cursor.movePosition(QTextCursor.MoveOperation.Right, QTextCursor.MoveMode.KeepAnchor)
            cursor.mergeCharFormat(named)
        block = block.next()


def _fit(document: QTextDocument) -> None:
    """Break lines of output that are wider than the window, and keep tables apart."""
    how = document.defaultTextOption()
    how.setWrapMode(QTextOption.WrapMode.WrapAtWordBoundaryOrAnywhere)
    document.setDefaultTextOption(how)
    block = document.begin()
    while block.isValid():
        if block.blockFormat().nonBreakableLines():
            broken = block.blockFormat()
            broken.setNonBreakableLines(False)
            QTextCursor(block).setBlockFormat(broken)
        block = block.next()
    for table in document.rootFrame().childFrames():
        if isinstance(table, QTextTable):
            spaced = table.format()
            spaced.setTopMargin(SPACE / 2)
            spaced.setBottomMargin(SPACE)
            table.setFormat(spaced)


def _copied(value: str, name: str) -> QLabel:
    """A text that can be copied; plain, as names of folders are no markup."""
    label = QLabel(value)
    label.setTextFormat(Qt.TextFormat.PlainText)
    label.setAccessibleName(name)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    return label
