"""Several videos of one demonstration: one of them is shown, or all side by side."""

import re
import threading
from dataclasses import replace

import numpy as np
import pytest
from factories import GOP_250, write_video

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.gui.document import Document
from forcelab.gui.label.video import VideoChoice, VideoPanels, VideoSelection
from forcelab.project import Project

TIMES = np.arange(0, 4, 0.01)
FRAMES = (np.arange(80) / 20, np.arange(40) / 10, np.arange(60) / 15)
NAMES, OFFSETS = ("left", "right", "top"), (0.1, 0.25, -0.3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A project: "three" was filmed by three cameras, "two" and "pair" by two, "one" by one."""
    home = tmp_path_factory.mktemp("videos")
    videos = [
        VideoReference(write_video(home / f"{n}.mp4", "libx264", t, GOP_250), ClockMap(o), n)
        for n, t, o in zip(NAMES, FRAMES, OFFSETS, strict=True)
    ]
    with Project.create(home / "lab.forcelab") as project:
        shown = {"three": videos, "two": videos[1:], "one": videos[:1], "pair": videos[1:]}
        for shift, (name, some) in enumerate(shown.items()):
            signal = TIMES[:, None] + shift
            d = Demonstration(name, "t", TIMES, signal, (Channel("f"),), tuple(some))
            project.demonstrations.add(d)
    return home / "lab.forcelab"


@pytest.fixture
def document(app, folder):
    document = Document("Ann")
    document.open_project(folder)
    yield document
    document.close()


@pytest.fixture
def selection(document):
    return VideoSelection(document)


@pytest.fixture
def panels(document, selection):
    panels = VideoPanels(document, selection)
    panels.resize(640, 480)
    panels.show()
    yield panels
    panels.close_video()
    panels.close()
    assert decoders() == 0


def decoders():
    return sum(thread.name.startswith("video ") for thread in threading.enumerate())


def frame_at(number, time):
    return np.searchsorted(FRAMES[number] + OFFSETS[number], time + 1e-9) - 1


def test_the_chosen_video_is_shown_by_its_own_clock(document, panels, selection, until):
    document.open_demonstration("three")
    until(lambda: panels.settled)
    document.view.seek(2.0)
    until(lambda: panels.settled)
    assert panels.shown_index == frame_at(0, 2.0)
    selection.show(1)
    until(lambda: panels.settled and panels.shown_index >= 0)
    np.testing.assert_allclose(document.view.frame_times, FRAMES[1] + 0.25, atol=1e-6)
    assert panels.shown_index == frame_at(1, 2.0)
    until(lambda: decoders() == 1)
    document.open_demonstration("one")
    until(lambda: panels.settled)
    assert selection.all == ()
    np.testing.assert_allclose(document.view.frame_times, FRAMES[0] + 0.1, atol=1e-6)


def test_side_by_side_each_is_at_the_cursor_and_one_that_is_not_shown_has_no_decoder(
    document, panels, selection, until
):
    document.open_demonstration("three")
    until(lambda: panels.settled and panels.shown_index >= 0)
    assert decoders() == 1
    selection.show_all()
    until(lambda: panels.settled)
    assert decoders() == len(panels.panels) == 3
    for time in (1.0, 3.4, 0.3):
        document.view.seek(time)
        until(lambda: panels.settled)
        assert [p.shown_index for p in panels.panels] == [frame_at(n, time) for n in range(3)]
    # Left and Right step by the frames of the first one.
    np.testing.assert_allclose(document.view.frame_times, FRAMES[0] + 0.1, atol=1e-6)
    for panel, name in zip(panels.panels, NAMES, strict=True):
        assert re.match(rf"{name} · 0\.\d+ s · frame ", panel.caption)
    boxes = [panel.geometry() for panel in panels.panels]
    assert all(panels.rect().contains(box) for box in boxes)
    assert not any(a.intersects(b) for a in boxes for b in boxes if a is not b)
    document.open_demonstration("two")
    until(lambda: panels.settled and decoders() == 2)
    assert [panel.isVisible() for panel in panels.panels] == [True, True, False]
    np.testing.assert_allclose(document.view.frame_times, FRAMES[1] + 0.25, atol=1e-6)
    document.open_demonstration("one")
    until(lambda: panels.settled and decoders() == 1)
    assert panels.panels[0].geometry() == panels.rect()
    assert re.match(r"0\.\d+ s · frame ", panels.panels[0].caption)
    document.open_demonstration("three")
    until(lambda: panels.settled and decoders() == 3)
    selection.show(2)
    until(lambda: panels.settled and decoders() == 1)
    assert [panel.isVisible() for panel in panels.panels] == [True, False, False]


def test_hidden_panels_decode_nothing_beside_the_first_video(document, panels, selection, until):
    panels.hide()
    selection.show_all()
    document.open_demonstration("three")
    until(lambda: document.view.frame_times is not None)
    assert decoders() == 1
    panels.show()
    until(lambda: panels.settled and all(panel.isVisible() for panel in panels.panels))
    document.view.seek(1.0)
    until(lambda: panels.settled)
    assert [p.shown_index for p in panels.panels] == [frame_at(n, 1.0) for n in range(3)]
    assert decoders() == 3


def test_the_choice_is_there_only_among_several(document, selection):
    document.open_demonstration("three")
    choice = VideoChoice(selection)
    entries = [choice.itemText(i) for i in range(choice.count())]
    assert entries == [*NAMES, "All side by side"]
    assert not choice.isHidden()
    choice.activated.emit(1)
    assert (selection.shown, selection.beside) == (1, ())
    assert choice.currentText() == choice.toolTip() == "right"
    choice.activated.emit(3)
    assert [v.name for v in (selection.video, *selection.beside)] == list(NAMES)
    assert choice.currentText() == "All side by side"
    selection.switch_side_by_side()
    assert choice.currentText() == "right"
    for name in ("top", "left"):
        selection.show_next()
        assert choice.currentText() == name
    selection.switch_side_by_side()
    assert choice.currentText() == "All side by side"
    document.open_demonstration("one")
    assert choice.isHidden()
    assert selection.obstacle()
    selection.show_next()
    assert (selection.shown, selection.beside) == (0, ())


def test_another_demonstration_shows_the_video_of_the_same_name(document, selection):
    document.open_demonstration("three")
    selection.show(2)
    document.open_demonstration("one")
    assert selection.video.name == "left"
    document.open_demonstration("two")
    assert selection.video.name == "top"
    selection.show(0)
    document.open_demonstration("three")
    assert selection.video.name == "right"


def test_a_long_name_stays_within_the_panel(document, panels, until):
    document.open_demonstration("three")
    choice = panels.findChild(VideoChoice)
    choice.addItem("a camera with a name that is far too long for the panel, and for its list")
    panels.resize(180, 160)
    # A combo box takes its new size a moment later.
    until(lambda: 100 < choice.geometry().right() <= panels.width())
    choice.showPopup()
    popup = choice.view().window()
    until(popup.isVisible)
    left, right = (
        panels.mapToGlobal(at).x() for at in (panels.rect().topLeft(), panels.rect().topRight())
    )
    until(lambda: left <= popup.geometry().left() < popup.geometry().right() <= right)
    choice.hidePopup()


def test_a_new_clock_leaves_the_choice_and_a_new_video_is_offered(document, selection):
    document.open_demonstration("pair")
    selection.show(1)
    document.set_video_clock(ClockMap(0.25))
    document.set_video_clock(ClockMap(-0.3), "top")
    assert selection.shown == 1
    assert [video.clock.offset for video in selection.all] == [0.25, -0.3]
    film = selection.video.path
    document.project.media.attach_video(document.id, film, name="back")
    document.reread()
    assert [video.name for video in selection.all] == ["right", "top", "back"]
    assert selection.video.name == "top"


def test_nothing_steps_by_the_frames_of_a_video_that_is_not_shown(
    document, panels, selection, until
):
    document.open_demonstration("three")
    until(lambda: panels.settled)
    gone = replace(selection.all[1], path=selection.video.path.with_name("gone.mp4"))
    selection.all = (selection.all[0], gone)
    selection.show(1)
    until(lambda: panels.panels[0].failed)
    assert document.view.frame_times is None
