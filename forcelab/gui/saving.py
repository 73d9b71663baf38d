"""Asking where a picture is to be saved, and saving it."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QWidget

from forcelab.gui.choosing import last_folder, remember_folder
from forcelab.gui.document import Document
from forcelab.gui.figures.canvas import Figure
from forcelab.gui.jobs import Jobs

__all__ = ["ask_picture", "save_picture"]


def ask_picture(parent: QWidget, title: str, name: str) -> Path | None:
    """Let the user name a file for a picture; None where he does not.

    The dialog begins in the folder of the last picture, or else beside the last project.

    Parameters
    ----------
    title : str
        Of the dialog.
    name : str
        Of the file, as it is suggested; without a suffix the file gets ``.svg``.
    """
    kinds = "Pictures (*.svg *.pdf *.png)"
    suggested = str(last_folder("pictures") / name)
    chosen, _ = QFileDialog.getSaveFileName(parent, title, suggested, kinds)
    if not chosen:
        return None
    path = Path(chosen)
    remember_folder("pictures", path.parent)
    return path if path.suffix else path.with_suffix(".svg")


def save_picture(figure: Figure, path: Path, document: Document, jobs: Jobs) -> None:
    """Save a figure in the background as its suffix says, and say what became of it."""
    saved = f"Saved '{path.name}'."
    jobs.run(
        _saving(figure, path),
        lambda _: document.say(saved),
        lambda error: document.say(str(error), True),
        key=f"saving {path}",
    )


def _saving(figure: Figure, path: Path) -> Generator[None, None, None]:
    """Save a figure, as a job."""
    yield
    figure.save(path)
