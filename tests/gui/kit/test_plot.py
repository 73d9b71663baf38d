"""Every plot can be copied and exported, as vectors where it has them."""

import xml.etree.ElementTree as ET

import pytest
from PySide6.QtCore import QPoint
from PySide6.QtGui import QContextMenuEvent, QGuiApplication
from PySide6.QtWidgets import QApplication, QMenu, QMessageBox
from window_helpers import open_foam_document, pixels

from forcelab.gui.jobs import Jobs
from forcelab.gui.kit import plot as kit
from forcelab.gui.label.traces import ForcePanel
from forcelab.labels import Segment


@pytest.fixture
def panel(app):
    with open_foam_document((Segment(1.0, 2.0, "grab"),)) as document:
        jobs = Jobs()
        panel = ForcePanel(document, jobs)
        panel.resize(640, 200)
        panel.show()
        yield panel
        panel.close()
        jobs.close()


def choose(panel, entry):
    at = QPoint(300, 100)
    event = QContextMenuEvent(QContextMenuEvent.Reason.Mouse, at, panel.mapToGlobal(at))
    QApplication.sendEvent(panel.viewport(), event)
    menu = panel.findChildren(QMenu)[-1]
    next(action for action in menu.actions() if action.text() == entry).trigger()
    menu.close()


def test_a_copy_is_what_is_seen(panel):
    choose(panel, "Copy as picture")
    image = QGuiApplication.clipboard().image()
    assert (image.width(), image.height()) == (1280, 400)  # twice the size, to be read in print
    seen, copied = pixels(panel.grab().toImage()), pixels(image)[::2, ::2]
    assert (abs(seen - copied).max(axis=2) <= 60).mean() > 0.9


@pytest.mark.parametrize("suffix", [".svg", ".pdf", ".png"])
def test_it_is_exported_in_the_format_of_the_files_suffix(panel, monkeypatch, tmp_path, suffix):
    path = tmp_path / f"forces{suffix}"
    monkeypatch.setattr(kit, "ask_picture", lambda *_: path)
    choose(panel, "Export as picture…")
    start = {".svg": b"<?xml", ".pdf": b"%PDF", ".png": b"\x89PNG"}[suffix]
    assert path.read_bytes().startswith(start)


def test_curves_are_exported_as_lines_and_not_as_pictures(panel, monkeypatch, tmp_path):
    path = tmp_path / "forces.svg"
    monkeypatch.setattr(kit, "ask_picture", lambda *_: path)
    choose(panel, "Export as picture…")
    tags = [element.tag.rpartition("}")[2] for element in ET.parse(path).iter()]
    assert "image" not in tags
    assert tags.count("path") >= len(panel.source.shown)


def test_a_file_that_cannot_be_written_is_said_in_one_sentence(panel, monkeypatch, tmp_path):
    said = []
    monkeypatch.setattr(kit, "ask_picture", lambda *_: tmp_path / "none" / "forces.svg")
    monkeypatch.setattr(QMessageBox, "warning", lambda *args: said.append(args[2]))
    choose(panel, "Export as picture…")
    assert len(said) == 1
    assert "forces.svg" in said[0]


def test_a_plot_has_its_axes_again_after_a_sentence(app):
    plot = kit.Plot("share", "time (s)")
    plot.resize(400, 200)
    plot.say("Wait.")
    plot.show()
    plot.grab()
    plot.say("")
    assert plot.bottom.size().height() == plot.margins[3]
    assert plot.left.size().width() == plot.margins[0]
    plot.close()
