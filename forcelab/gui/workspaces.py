"""The workspaces: the tabs of the window, and what they are called."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QT_TRANSLATE_NOOP, QCoreApplication

__all__ = ["WORKSPACES", "Workspace"]


@dataclass(frozen=True, slots=True)
class Workspace:
    """One tab of the window.

    Parameters
    ----------
    name : str
        As on the command line.
    text : str
        The tab's text, to be translated.
    """

    name: str
    text: str

    def title(self) -> str:
        """The tab's text in the user's language."""
        return QCoreApplication.translate("forcelab", self.text)


WORKSPACES = (
    Workspace("label", str(QT_TRANSLATE_NOOP("forcelab", "Label"))),
    Workspace("review", str(QT_TRANSLATE_NOOP("forcelab", "Review"))),
    Workspace("capture", str(QT_TRANSLATE_NOOP("forcelab", "Capture"))),
    Workspace("tradeoff", str(QT_TRANSLATE_NOOP("forcelab", "Trade-off"))),
)
