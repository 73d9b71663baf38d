"""Several cameras that filmed one demonstration."""

from dataclasses import replace

import numpy as np
import pytest
from factories import GOP_250, write_video

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.gui.document import Document
from forcelab.gui.label.video import CameraChoice, CameraSelection, VideoPanel
from forcelab.project import Project

TIMES = np.arange(0, 4, 0.01)
FIRST, SECOND = np.arange(80) / 20, np.arange(40) / 10


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A project: "two" was filmed by two cameras, "one" by one."""
    home = tmp_path_factory.mktemp("cameras")
    paths = [
        write_video(home / f"{i}.mp4", "libx264", times, GOP_250)
        for i, times in enumerate((FIRST, SECOND))
    ]
    with Project.create(home / "lab.forcelab") as project:
        for name, shift in (("two", 0.0), ("one", 1.0)):
            signal = TIMES[:, None] + shift
            films = [VideoReference(paths[0], ClockMap(0.1), "left")]
            if name == "two":
                films.append(VideoReference(paths[1], ClockMap(0.25), "right"))
            d = Demonstration(name, "t", TIMES, signal, (Channel("f"),), tuple(films))
            project.demonstrations.add(d)
    return home / "lab.forcelab"


@pytest.fixture
def document(app, folder):
    document = Document("Ann")
    document.open_project(folder)
    yield document
    document.close()


def test_the_chosen_camera_is_shown_by_its_own_clock(document, until):
    document.open_demonstration("two")
    cameras = CameraSelection(document)
    panel = VideoPanel(document, cameras)
    panel.resize(320, 240)
    panel.show()
    until(lambda: panel.settled)
    document.view.seek(2.0)
    until(lambda: panel.settled)
    assert panel.shown_index == np.searchsorted(FIRST + 0.1, 2.0 + 1e-9) - 1
    cameras.show(1)
    until(lambda: panel.settled and panel.shown_index >= 0)
    np.testing.assert_allclose(document.view.frame_times, SECOND + 0.25, atol=1e-6)
    assert panel.shown_index == np.searchsorted(SECOND + 0.25, 2.0 + 1e-9) - 1
    document.open_demonstration("one")
    until(lambda: panel.settled)
    assert cameras.all == ()
    np.testing.assert_allclose(document.view.frame_times, FIRST + 0.1, atol=1e-6)
    panel.close_video()
    panel.close()


def test_the_choice_is_there_only_among_several(document):
    document.open_demonstration("two")
    cameras = CameraSelection(document)
    choice = CameraChoice(cameras)
    assert [choice.itemText(i) for i in range(choice.count())] == ["left", "right"]
    assert not choice.isHidden()
    choice.activated.emit(1)
    assert cameras.shown == 1
    assert choice.currentText() == choice.toolTip() == "right"
    cameras.show_next()
    assert choice.currentText() == "left"
    document.open_demonstration("one")
    assert choice.isHidden()
    cameras.show_next()
    assert cameras.shown == 0


def test_a_long_name_stays_within_the_panel(document, until, app):
    document.open_demonstration("two")
    cameras = CameraSelection(document)
    panel = VideoPanel(document, cameras)
    choice = panel.findChild(CameraChoice)
    choice.addItem("a camera with a name that is far too long for the panel, and for its list")
    panel.resize(180, 160)
    panel.show()
    # A combo box takes its new size a moment later.
    until(lambda: 100 < choice.geometry().right() <= panel.width())
    choice.showPopup()
    popup = choice.view().window()
    until(popup.isVisible)
    left, right = (
        panel.mapToGlobal(at).x() for at in (panel.rect().topLeft(), panel.rect().topRight())
    )
    until(lambda: left <= popup.geometry().left() < popup.geometry().right() <= right)
    choice.hidePopup()
    panel.close_video()
    panel.close()


def test_a_new_clock_of_the_first_camera_leaves_the_choice(document):
    document.open_demonstration("two")
    cameras = CameraSelection(document)
    cameras.show(1)
    document.set_video_clock(ClockMap(0.1))
    assert cameras.shown == 1
    assert cameras.video.clock == ClockMap(0.25)


def test_nothing_steps_by_the_frames_of_a_camera_that_is_not_shown(document, until):
    document.open_demonstration("two")
    cameras = CameraSelection(document)
    panel = VideoPanel(document, cameras)
    panel.show()
    until(lambda: panel.settled)
    gone = replace(cameras.all[1], path=cameras.video.path.with_name("gone.mp4"))
    cameras.all = (cameras.all[0], gone)
    cameras.show(1)
    until(lambda: panel.failed)
    assert document.view.frame_times is None
    panel.close_video()
    panel.close()
