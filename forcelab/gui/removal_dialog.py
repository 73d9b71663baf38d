"""Asking before something is removed for good: what is lost, and what stays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from PySide6.QtWidgets import QCheckBox, QDialog, QDialogButtonBox, QVBoxLayout, QWidget

from forcelab.gui.demonstration_model import DemonstrationRow, percent
from forcelab.gui.layout import fill_layout, run_dialog, sentence_label, set_enabled_with_reason
from forcelab.gui.text import escape_ampersands
from forcelab.labels import is_model
from forcelab.project import Project, RunUse
from forcelab.text import amount

#: How many things are named one by one.
NAMED = 3
_CONSENT_MISSING = "Agree to what goes as well first."
#: How many letters of a note's first line are shown: the other sentences need room.
LETTERS = 300


class Removal(QDialog):
    """Says what is lost; a `consent` has to be ticked first, unless it is ``""``."""

    def __init__(self, title: str, text: str, consent: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(title)
        self.text = sentence_label(text)
        self.text.setMinimumWidth(360)
        # Without a parent it would be a window for a moment.
        self.consent = QCheckBox(escape_ampersands(consent), self)
        self.consent.setVisible(bool(consent))
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel, self)
        self.remove = buttons.addButton("Remove", QDialogButtonBox.ButtonRole.DestructiveRole)
        self.remove.setAutoDefault(False)
        set_enabled_with_reason(self.remove, _CONSENT_MISSING if consent else "")
        self.remove.clicked.connect(self.accept)
        self.consent.toggled.connect(
            lambda on: set_enabled_with_reason(self.remove, "" if on else _CONSENT_MISSING)
        )
        buttons.rejected.connect(self.reject)
        buttons.button(QDialogButtonBox.StandardButton.Cancel).setDefault(True)
        fill_layout(QVBoxLayout(self), self.text, self.consent, buttons, spacing=10)


def confirm_removal(
    rows: Sequence[DemonstrationRow], author: str, project: Project, parent: QWidget | None = None
) -> bool:
    """Ask whether to remove demonstrations, with all labels on them.

    Notes written while the dialog was open were not agreed to: then it asks again.
    """
    changed = False
    while run_dialog(removal_of(rows, author, parent, changed=changed)):
        notes = project.coding.notes(author)
        now = [
            replace(row, notes=tuple(n for n in notes if n.demonstration == row.info.id))
            for row in rows
        ]
        if [row.notes for row in now] == [row.notes for row in rows]:
            return True
        rows, changed = now, True
    return False


def removal_of(
    rows: Sequence[DemonstrationRow],
    author: str,
    parent: QWidget | None = None,
    *,
    changed: bool = False,
) -> Removal:
    """The dialog for demonstrations; `changed` if notes were written since it was open before."""
    text = "Notes have changed meanwhile.\n\n" if changed else ""
    text += _question(rows, author)
    return Removal("Remove from the project", text, _consent(rows), parent)


def _question(rows: Sequence[DemonstrationRow], author: str) -> str:
    """What is lost and what stays."""
    if len(rows) == 1:
        name, losses = rows[0].info.name, ", ".join(_losses(rows[0], author))
        return (
            f"Remove '{name}' for good? With it go: {losses}.\n\nThis cannot be undone. The file "
            "that it was imported from stays, and so do runs and recognisers."
        )
    names = [f"'{row.info.name}'" for row in rows[:NAMED]]
    if len(rows) > NAMED:
        names.append(f"and {len(rows) - NAMED} more")
    losses = ", ".join(_common_losses(rows, author))
    return (
        f"Remove these {len(rows)} demonstrations for good: {', '.join(names)}? With them go: "
        f"{losses}.\n\nThis cannot be undone. The files that they were imported from stay, and so "
        "do runs and recognisers."
    )


def _losses(row: DemonstrationRow, author: str) -> list[str]:
    """What is lost with one demonstration."""
    losses = [f"the recording ({row.info.duration:.2f} s)"]
    videos = row.info.videos
    if len(videos) > 1:
        losses.append("its videos " + ", ".join(f"'{name}'" for name in videos))
    elif videos:
        losses.append("its video")
    if row.share:
        losses.append(f"your labels ({percent(row.share)} %)")
    elif author in row.info.labelled:
        losses.append("the history of your labels")
    losses += [f"the labels of {name} ({percent(share)} %)" for name, share in row.others]
    if row.assignments:
        losses.append("assignments")
    for note in row.notes:
        beginning = note.text.partition("\n")[0][:LETTERS].rstrip()
        more = "" if beginning == note.text else "…"
        losses.append(f"the note of {note.author}: “{beginning}{more}”")
    return losses


def _common_losses(rows: Sequence[DemonstrationRow], author: str) -> list[str]:
    """What is lost with several demonstrations, with counts."""
    seconds = sum(row.info.duration for row in rows)
    losses = [f"the recordings ({seconds:.0f} s)"]
    videos = sum(len(row.info.videos) for row in rows)
    if videos:
        losses.append(f"videos ({videos})")
    own_count = sum(bool(row.share) or author in row.info.labelled for row in rows)
    if own_count:
        losses.append(f"your labels (on {own_count})")
    authors = [name for row in rows for name, _ in row.others]
    losses += [
        f"the labels of {name} (on {authors.count(name)})" for name in dict.fromkeys(authors)
    ]
    if any(row.assignments for row in rows):
        losses.append("assignments")
    if notes := sum(len(row.notes) for row in rows):
        losses.append(f"notes ({notes})")
    return losses


def _consent(rows: Sequence[DemonstrationRow]) -> str:
    """The consent to losing others' labels; the same text for all who code blind."""
    if any(row.blind for row in rows):
        if len(rows) == 1:
            return "Remove it whatever others have labelled on it"
        return "Remove them whatever others have labelled on them"
    authors = dict.fromkeys(name for row in rows for name, _ in row.others)
    names = ", ".join(name for name in authors if not is_model(name))
    return f"Remove the labels of {names} too" if names else ""


def removal_of_run(name: str, use: RunUse, parent: QWidget | None = None) -> Removal:
    """The dialog for a run, under its name in the list."""
    losses = "predictions and scores"
    if use.recogniser:
        losses = "predictions, its scores and its recogniser"
    size = amount(use.bytes)
    sentences = [f"Remove the run '{name}' for good? With it go its {losses} ({size})."]
    if use.accepted:
        sentences.append(
            f"Predictions of it were accepted as labels ({use.accepted} edits); these labels stay, "
            "and still tell what proposed them."
        )
    if use.verdicts:
        sentences.append(
            f"Verdicts were given on it ({use.verdicts}); they stay, but no longer tell on which "
            "run."
        )
    sentences.append("This cannot be undone. No label changes.")
    return Removal("Remove a run", "\n\n".join(sentences), "", parent)
