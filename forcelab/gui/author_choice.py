"""The choice of a coder: the one that one labels as, or the one of labels that name none."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QInputDialog, QLabel, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.layout import fill_layout
from forcelab.gui.text import settle_name
from forcelab.gui.widgets import ElidedComboBox

#: How many letters of a name are shown at most; the tooltip has all of it.
NAME_LETTERS = 44


class AuthorChoice(QWidget):
    """The project's coders, and a way to become another one."""

    def __init__(self, document: Document, *, labelled: bool = True) -> None:
        super().__init__()
        self._document = document
        self._box = ElidedComboBox()
        self._box.setAccessibleName("Coder")
        self._box.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # after a click keys paint, as before
        self._box.setMinimumContentsLength(10)
        self._box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
        self._box.setMaximumWidth(NAME_LETTERS * self.fontMetrics().averageCharWidth())
        self._box.activated.connect(self._chosen)
        self.setFocusProxy(self._box)
        if labelled:
            fill_layout(QHBoxLayout(self), QLabel("Coder"), self._box, margins=(0, 2, 8, 2))
        else:
            fill_layout(QHBoxLayout(self), self._box, 1, margins=0)
        document.project_changed.connect(self._list)
        document.author_changed.connect(self._list)
        document.listing_changed.connect(self._relist)
        self._list()

    def choose(self) -> None:
        """Open the list, as a click does."""
        self._box.showPopup()

    def _list(self) -> None:
        names = self._names()
        self._box.clear()
        self._box.addItems(names)
        self._box.setCurrentIndex(names.index(self._document.author))
        self._box.insertSeparator(len(names))
        self._box.addItem("Another coder…")
        self._box.setToolTip(f"You label as {self._document.author}")

    def _relist(self) -> None:
        """List the coders again if somebody was assigned something, or has begun to label."""
        try:
            names = self._names()
        except ForcelabError:  # whoever reads the listing says so
            return
        if names != [self._box.itemText(at) for at in range(self._box.count() - 2)]:
            self._list()

    def _names(self) -> list[str]:
        """The project's coders and the current one."""
        project, author = self._document.project, self._document.author
        return list(dict.fromkeys([*(() if project is None else project.coding.people()), author]))

    def _chosen(self, index: int) -> None:
        name = self._box.itemText(index)
        if index == self._box.count() - 1:
            title, text = "Another coder", "Name of the coder:"
            name, agreed = QInputDialog.getText(self, title, text)
            name = settle_name(self, name, self._names()) if agreed else ""
        self.become(name)
        self._list()

    def become(self, name: str) -> None:
        """Label as another coder from now on, also the next time."""
        self._document.set_author(name)
        project = self._document.project
        settings.remember_coder(project.path if project else None, self._document.author)


class UnsignedCoder(QComboBox):
    """The coder of labels that are brought without one: seldom the one who sits here now."""

    def __init__(self, document: Document, unsigned: str) -> None:
        super().__init__()
        self._document, self._unsigned = document, unsigned
        self.setEditable(True)
        self.setAccessibleName("Coder for unsigned labels")
        self.addItems(list(dict.fromkeys((unsigned, *self._coders(), document.author))))

    @property
    def name(self) -> str:
        """What is written, by default `unsigned`."""
        return self.currentText().strip() or self._unsigned

    def settle(self) -> str:
        """The tidied name; if it nearly is that of a coder here, the coder is asked which it is."""
        return settle_name(self, self.name, self._coders())

    def _coders(self) -> tuple[str, ...]:
        project = self._document.project
        return project.coding.coders() if project else ()
