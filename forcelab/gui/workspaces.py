"""The workspaces: what each is for, and what stands in place of one that is not built yet."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QT_TRANSLATE_NOOP, QCoreApplication, Qt
from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

__all__ = ["WORKSPACES", "Workspace", "coming"]


@dataclass(frozen=True, slots=True)
class Workspace:
    """One tab of the window.

    Parameters
    ----------
    name : str
        As on the command line.
    text : str
        The tab's text, to be translated.
    meanwhile : str
        What a coder can do until it is built, to be translated; empty for one that is.
    """

    name: str
    text: str
    meanwhile: str = ""

    def title(self) -> str:
        """The tab's text in the user's language."""
        return QCoreApplication.translate("forcelab", self.text)


WORKSPACES = (
    Workspace("label", str(QT_TRANSLATE_NOOP("forcelab", "Label"))),
    Workspace("review", str(QT_TRANSLATE_NOOP("forcelab", "Review"))),
    Workspace("capture", str(QT_TRANSLATE_NOOP("forcelab", "Capture"))),
    Workspace(
        "tradeoff",
        str(QT_TRANSLATE_NOOP("forcelab", "Trade-off")),
        str(
            QT_TRANSLATE_NOOP(
                "forcelab",
                "Here the error of every approximation will stand against its run time. Until "
                "then “forcelab measure” draws it.",
            )
        ),
    ),
)


def coming(workspace: Workspace) -> QWidget:
    """A page that says what a workspace will be for, and what does its work until then."""
    title = QLabel(workspace.title())
    face = title.font()
    face.setPointSizeF(face.pointSizeF() * 1.5)
    title.setFont(face)
    text = QLabel(QCoreApplication.translate("forcelab", workspace.meanwhile))
    text.setWordWrap(True)
    text.setFixedWidth(460)
    text.setAlignment(Qt.AlignmentFlag.AlignHCenter)
    text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    page = QWidget()
    column = QVBoxLayout(page)
    column.addStretch(1)
    column.addWidget(title, 0, Qt.AlignmentFlag.AlignHCenter)
    column.addWidget(text, 0, Qt.AlignmentFlag.AlignHCenter)
    column.addStretch(2)
    return page
