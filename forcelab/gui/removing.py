"""Asking whether something is to be removed for good: what goes with it, and what stays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from PySide6.QtCore import QCoreApplication, Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QDialogButtonBox,
    QLabel,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.listing_rows import Row, percent
from forcelab.gui.naming import verbatim
from forcelab.labels import is_model
from forcelab.project import Project, RunUse
from forcelab.wording import amount

__all__ = ["Removal", "removal_agreed", "removal_of", "removal_of_run"]

translate = QCoreApplication.translate
#: How many things are named one by one.
NAMED = 3
#: How many letters of a note are shown.
LETTERS = 300


class Removal(QDialog):
    """Says what goes; where more has to be agreed to, that is ticked first.

    Parameters
    ----------
    title, text : str
    others : str
        What has to be agreed to apart; ``""`` where nothing has.
    """

    def __init__(self, title: str, text: str, others: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(title)
        self.text = QLabel(text)
        self.text.setTextFormat(Qt.TextFormat.PlainText)  # names are anybody's
        self.text.setWordWrap(True)
        self.text.setMinimumWidth(360)
        self.others = QCheckBox(verbatim(others), self)  # alone it would be a window for a moment
        self.others.setVisible(bool(others))
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel)
        self.remove = buttons.addButton(
            translate("forcelab", "Remove"), QDialogButtonBox.ButtonRole.DestructiveRole
        )
        self.remove.setAutoDefault(False)
        self.remove.setEnabled(not others)
        self.remove.clicked.connect(self.accept)
        self.others.toggled.connect(self.remove.setEnabled)
        buttons.rejected.connect(self.reject)
        buttons.button(QDialogButtonBox.StandardButton.Cancel).setDefault(True)
        column = QVBoxLayout(self)
        column.setSpacing(10)
        for widget in (self.text, self.others, buttons):
            column.addWidget(widget)


def removal_agreed(
    rows: Sequence[Row], author: str, project: Project, parent: QWidget | None = None
) -> bool:
    """Whether the coder agrees that demonstrations go; parameters are those of `removal_of`.

    Notes that were written while it asked were not agreed to: then it asks again.
    """
    changed = False
    while True:
        dialog = removal_of(rows, author, parent, changed=changed)
        agreed = dialog.exec()
        dialog.deleteLater()
        if not agreed:
            return False
        notes = project.notes(author)
        now = [
            replace(row, notes=tuple(n for n in notes if n.demonstration == row.info.id))
            for row in rows
        ]
        changed = [row.notes for row in now] != [row.notes for row in rows]
        if not changed:
            return True
        rows = now


def removal_of(
    rows: Sequence[Row], author: str, parent: QWidget | None = None, *, changed: bool = False
) -> Removal:
    """Asks whether demonstrations are to go, with whoever's labels are on them.

    Parameters
    ----------
    rows : sequence of Row
        The demonstrations as the coder may see them, at least one.
    author : str
        The coder.
    changed : bool
        Whether it is asked again, as notes were written meanwhile.
    """
    title, told = translate("forcelab", "Remove from the project"), _told(rows, author)
    if changed:
        told = translate("forcelab", "Notes have changed meanwhile.") + "\n\n" + told
    return Removal(title, told, _others(rows), parent)


def _told(rows: Sequence[Row], author: str) -> str:
    """What goes and what stays."""
    if len(rows) == 1:
        return translate(
            "forcelab",
            "Remove '{0}' for good? With it go: {1}.\n\nThis cannot be undone. The file that it "
            "was imported from stays, and so do runs and recognisers.",
        ).format(rows[0].info.name, ", ".join(_goes(rows[0], author)))
    names = [f"'{row.info.name}'" for row in rows[:NAMED]]
    if len(rows) > NAMED:
        names.append(translate("forcelab", "and {0} more").format(len(rows) - NAMED))
    return translate(
        "forcelab",
        "Remove these {0} demonstrations for good: {1}? With them go: {2}.\n\nThis cannot be "
        "undone. The files that they were imported from stay, and so do runs and recognisers.",
    ).format(len(rows), ", ".join(names), ", ".join(_all_go(rows, author)))


def _goes(row: Row, author: str) -> list[str]:
    """What goes with a demonstration."""
    goes = [translate("forcelab", "the recording ({0:.2f} s)").format(row.info.duration)]
    if row.info.has_video:
        goes.append(translate("forcelab", "its video"))
    if row.share:
        goes.append(translate("forcelab", "your labels ({0} %)").format(percent(row.share)))
    elif author in row.info.labelled:
        goes.append(translate("forcelab", "the history of your labels"))
    goes += [
        translate("forcelab", "the labels of {0} ({1} %)").format(name, percent(share))
        for name, share in row.others
    ]
    if row.assignments:
        goes.append(translate("forcelab", "assignments"))
    goes += [
        translate("forcelab", "the note of {0}: “{1}”").format(note.author, _beginning(note.text))
        for note in row.notes
    ]
    return goes


def _beginning(text: str) -> str:
    """As much of a note as leaves room for the other sentences."""
    return text if len(text) <= LETTERS else text[:LETTERS].rstrip() + "…"


def _all_go(rows: Sequence[Row], author: str) -> list[str]:
    """What goes with several demonstrations, on how many of them it is."""
    seconds = sum(row.info.duration for row in rows)
    goes = [translate("forcelab", "the recordings ({0:.0f} s)").format(seconds)]
    videos = sum(row.info.has_video for row in rows)
    if videos:
        goes.append(translate("forcelab", "videos ({0})").format(videos))
    own = sum(bool(row.share) or author in row.info.labelled for row in rows)
    if own:
        goes.append(translate("forcelab", "your labels (on {0})").format(own))
    every = [name for row in rows for name, _ in row.others]
    goes += [
        translate("forcelab", "the labels of {0} (on {1})").format(name, every.count(name))
        for name in dict.fromkeys(every)
    ]
    if any(row.assignments for row in rows):
        goes.append(translate("forcelab", "assignments"))
    if notes := sum(len(row.notes) for row in rows):
        goes.append(translate("forcelab", "notes ({0})").format(notes))
    return goes


def _others(rows: Sequence[Row]) -> str:
    """What is to be agreed to about others' labels; the same to whoever codes blind."""
    if any(row.blind for row in rows):
        if len(rows) == 1:
            return translate("forcelab", "Remove it whatever others have labelled on it")
        return translate("forcelab", "Remove them whatever others have labelled on them")
    every = dict.fromkeys(name for row in rows for name, _ in row.others)
    names = [name for name in every if not is_model(name)]
    if not names:
        return ""
    return translate("forcelab", "Remove the labels of {0} too").format(", ".join(names))


def removal_of_run(name: str, use: RunUse, parent: QWidget | None = None) -> Removal:
    """Asks whether a run is to go.

    Parameters
    ----------
    name : str
        As the list has it.
    use : RunUse
    """
    goes = translate("forcelab", "With it go its predictions and scores ({0}).")
    if use.recogniser:
        goes = translate(
            "forcelab", "With it go its predictions, its scores and its recogniser ({0})."
        )
    told = [
        translate("forcelab", "Remove the run '{0}' for good?").format(name)
        + " "
        + goes.format(amount(use.bytes))
    ]
    if use.accepted:
        told.append(
            translate(
                "forcelab",
                "Predictions of it were accepted as labels ({0} edits); these labels stay, and "
                "still tell what proposed them.",
            ).format(use.accepted)
        )
    if use.verdicts:
        told.append(
            translate(
                "forcelab",
                "Verdicts were given on it ({0}); they stay, but no longer tell on which run.",
            ).format(use.verdicts)
        )
    told.append(translate("forcelab", "This cannot be undone. No label changes."))
    return Removal(translate("forcelab", "Remove a run"), "\n\n".join(told), "", parent)
