"""Several videos of a demonstration, chosen by keys and mouse in the real window."""

from dataclasses import replace

import pytest
from factories import write_opencv_video

from forcelab.clock import ClockMap
from forcelab.demonstration import VideoReference
from forcelab.project import Project

#: Names of the videos, and when each begins (s); they have 30 frames a second.
BEGIN = {"left": 0.0, "right": -1.0, "top": 2.0}


@pytest.fixture
def filmed(project, tmp_path):
    with Project.open(project) as opened:
        demonstration = opened.demonstrations.load("pen 1")
        videos = tuple(
            VideoReference(
                write_opencv_video(tmp_path / f"{name}.avi", "MJPG", 200), ClockMap(begin), name
            )
            for name, begin in BEGIN.items()
        )
        opened.demonstrations.add(replace(demonstration, videos=videos))
    return project


def test_videos_are_chosen_by_keys_and_mouse_and_stand_side_by_side(screen, start, filmed):
    program = start(filmed, "--author", "Ada", "--demo", "pen 1", "--at", "3", display=screen)
    program.focus()

    def shows(*names):
        """Wait until these are shown, each at the cursor and by a decoder of its own."""

        def right(state):
            frames = [max(int(30 * (state["cursor"] - BEGIN[name]) + 1e-6), -1) for name in names]
            return state["settled"] and state["video"] == names[0] and state["frames"] == frames

        state = program.until(right, names)
        return program.until(lambda state: state["decoders"] == len(names), state)

    shows("left")
    for name in ("right", "top", "left", "right"):
        program.press("F7")
        shows(name)
    program.press("shift+F7")
    shows(*BEGIN)
    # Left and Right step by frames of the first one, and all of them follow.
    cursor = program.press("Right", times=20)["cursor"]
    assert shows(*BEGIN)["cursor"] > cursor - 1e-9 > 3.5
    program.press("shift+F7")
    shows("right")

    def choose(entry):
        program.click(program.ask("widget", kind="VideoChoice"))
        program.until(lambda state: state["popup"])
        program.click(program.ask("row", view="ListView", text=entry))
        program.until(lambda state: not state["popup"])

    choose("top")
    shows("top")
    choose("All side by side")
    shows(*BEGIN)
    # Of a demonstration without a video nothing is decoded; back in the other one all are there.
    program.press("Next")
    program.until(lambda state: state["title"].startswith("pen 2") and state["decoders"] == 0)
    program.press("Prior")
    shows(*BEGIN)
