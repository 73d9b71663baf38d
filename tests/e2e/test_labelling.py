"""Demonstrations are labelled by keys and by the mouse, in the real window on a real screen."""

from dataclasses import replace

import pytest
from factories import write_opencv_video

from forcelab.clock import ClockMap
from forcelab.demonstration import VideoReference
from forcelab.project import Project
from tests.e2e.program import wait_for_stored_segments

#: Names of the videos of "pen 5", and when each begins (s); they have 30 frames a second.
BEGIN = {"left": 0.0, "right": -1.0, "top": 2.0}


@pytest.fixture(scope="module")
def program(screen, start, project):
    """The program on a project with videos of one demonstration."""
    with Project.open(project) as opened:
        demonstration = opened.demonstrations.load("pen 5")
        videos = tuple(
            VideoReference(
                write_opencv_video(project.with_name(f"{name}.avi"), "MJPG", 200),
                ClockMap(begin),
                name,
            )
            for name, begin in BEGIN.items()
        )
        opened.demonstrations.add(replace(demonstration, videos=videos))
    program = start(project, "--author", "Ada", "--demo", "pen 1", display=screen)
    program.focus()
    return program


def open_by_mouse(program, name):
    """Click a demonstration in the list."""
    program.click(program.ask("row", view="DemonstrationTree", text=name))
    program.until(lambda state: state["title"].startswith(name) and state["settled"])


def test_a_demonstration_is_played_and_labelled_without_the_mouse(program, project):
    space_held_down_plays_on(program)
    label(program, project)


def space_held_down_plays_on(program):
    """It is repeated while it is held, and does not stop and begin again each time."""
    program.xdotool("keydown", "space")
    program.until(lambda state: state["playing"])
    # The X server repeats it after 0.66 s, 25 times a second.
    while (state := program.ask("state"))["cursor"] < 1.0:
        assert state["playing"]
    program.xdotool("keyup", "space")
    assert program.ask("state")["playing"]
    program.press("space")
    program.until(lambda state: not state["playing"])
    program.press("ctrl+Home")
    program.until(lambda state: state["cursor"] == 0)


def label(program, project):
    """By every key that labels; all of it is in the store."""

    def check(*expected, name="pen 1"):
        wait_for_stored_segments(project, name, lambda found: found == list(expected))

    # Press to start, press again to end; another action's key ends one and begins the next.
    program.press("1")
    program.press("ctrl+Right", times=5)  # a fiftieth of the 10 s each
    program.press("2")
    program.press("Right", times=30)  # samples of 10 ms
    program.press("3")
    program.press("ctrl+Right", times=5)
    program.press("3")
    program.until(lambda state: state["stroke"] is None)
    expected = [(0.0, 1.0, "still"), (1.0, 1.3, "grab"), (1.3, 2.3, "hold")]
    check(*expected)

    # A range, filled by a key.
    program.press("bracketleft")
    program.press("ctrl+Right", times=4)
    program.press("bracketright", "4")
    expected.append((2.3, 3.1, "pull"))
    check(*expected)

    # Held down for a short action.
    program.xdotool("keydown", "5")
    program.press("Right", times=7)
    program.until(lambda state: state["stroke"] == "release")
    program.xdotool("sleep", "0.3", "keyup", "5")
    program.until(lambda state: state["stroke"] is None)
    expected.append((3.1, 3.17, "release"))
    check(*expected)

    # Escape forgets a stroke, and a stroke without time is refused.
    program.press("1", "Right", "Escape")
    program.press("2")
    program.until(lambda state: state["stroke"] == "grab")
    program.press("2")
    program.until(lambda state: state["stroke"] is None)
    check(*expected)

    # Back to a segment; relabel it, move its edges, split and merge it, delete one.
    program.press("k", times=2)
    program.press("k")
    program.until(lambda state: state["cursor"] == 1.3)
    program.press("1")
    expected[2] = (1.3, 2.3, "still")
    check(*expected)
    program.press("alt+Right", times=2)
    program.press("alt+shift+Left", times=3)
    expected[1:3] = [(1.0, 1.32, "grab"), (1.32, 2.27, "still")]
    expected[3] = (2.27, 3.1, "pull")
    check(*expected)
    program.press("ctrl+Left", "ctrl+b")  # the cursor has gone with the edge
    wait_for_stored_segments(project, "pen 1", lambda found: len(found) == len(expected) + 1)
    program.press("ctrl+z", "l", "Delete")
    del expected[3]
    check(*expected)

    # Everything can be taken back and made again, and the next demonstration is a key away.
    program.press("ctrl+z", times=40)
    check()
    program.press("ctrl+shift+z", times=40)
    check(*expected)
    program.press("Next")
    program.until(lambda state: state["title"].startswith("pen 2") and state["settled"])
    program.press("ctrl+End", "4", "ctrl+Home", "4")
    check((0.0, 10.0, "pull"), name="pen 2")


def test_a_demonstration_is_labelled_without_the_keyboard(program, project):
    open_by_mouse(program, "pen 3")
    near = 1.5 * program.ask("state")["per_pixel"]

    def brush(action):
        program.click(program.ask("row", view="Action", text=action))
        program.until(lambda state: state["action"] == action)

    def drag(start, end):
        program.drag(program.ask("point", time=start), program.ask("point", time=end))

    def check(*expected):
        def alike(found):
            return [s[2] for s in found] == [s[2] for s in expected] and all(
                segment[:2] == pytest.approx(expected_segment[:2], abs=near)
                for segment, expected_segment in zip(found, expected, strict=True)
            )

        return wait_for_stored_segments(project, "pen 3", alike)

    # Choose an action, drag on the track.
    # Beside an edge, and not on it: there the drag would move the edge. It snaps to it.
    for action, begin, end in (("still", 0.5, 2), ("grab", 2.1, 3.5), ("hold", 4, 6)):
        brush(action)
        drag(begin, end)
    found = check((0.5, 2, "still"), (2, 3.5, "grab"), (4, 6, "hold"))
    assert found[0][1] == found[1][0], "edges that were painted to touch do touch"

    # Drag an edge that two segments share, then one that stands alone.
    drag(found[1][0], 2.5)
    drag(found[2][1], 7)
    found = check((0.5, 2.5, "still"), (2.5, 3.5, "grab"), (4, 7, "hold"))
    assert found[0][1] == found[1][0]

    # From the menu: give another action, split, delete.
    program.click(program.ask("point", time=3), button=3)
    program.until(lambda state: state["popup"])
    spot = program.ask("entry", text="Delete")
    assert all(isinstance(number, int) for number in spot), spot
    program.click(spot)
    found = check((0.5, 2.5, "still"), (4, 7, "hold"))

    # A range dragged over the forces, filled by a click on an action.
    _, y = program.ask("widget", kind="ForcePanel")
    left, right = program.ask("point", time=8), program.ask("point", time=9)
    program.drag((left[0], y), (right[0], y))
    program.until(lambda state: state["range"] is not None)
    program.click(program.ask("row", view="Action", text="release"))
    check((0.5, 2.5, "still"), (4, 7, "hold"), (8, 9, "release"))

    # The other demonstration is a click away.
    program.click(program.ask("row", view="", text="pen 4"))
    program.until(lambda state: state["title"].startswith("pen 4"))


def test_videos_are_chosen_by_keys_and_mouse_and_stand_side_by_side(program):
    open_by_mouse(program, "pen 5")
    program.click(program.ask("point", time=3))

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
    program.until(lambda state: state["title"].startswith("pen 6") and state["decoders"] == 0)
    program.press("Prior")
    shows(*BEGIN)
