"""A demonstration played and labelled from the keyboard alone, in the real window on a screen."""

from window_helpers import PATIENCE

from tests.e2e.program import wait_for_stored_segments


def test_a_demonstration_is_played_and_labelled_without_the_mouse(screen, start, project):
    program = start(project, "--author", "Ada", "--demo", "pen 1", display=screen)
    program.focus()
    space_held_down_plays_on(program)
    label(program, project)
    hold_time_is_changed(program, project)
    program.xdotool("key", "ctrl+q")  # no state is asked for: the program ends
    assert program.process.wait(PATIENCE) == 0


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


def hold_time_is_changed(program, project):
    """In the preferences; a press that is long enough otherwise is no hold then."""
    set_hold_time(program, "2000")
    hold_for_half_a_second(program)
    assert program.ask("state")["stroke"] == "grab"
    program.press("Escape")
    set_hold_time(program, "250")
    hold_for_half_a_second(program)
    program.until(lambda state: state["stroke"] is None)
    wait_for_stored_segments(project, "pen 2", lambda found: found[0] == (0.0, 0.07, "grab"))


def set_hold_time(program, milliseconds):
    """Find it in the preferences, and change it."""
    program.press("ctrl+comma")
    program.until(lambda state: state["focus"] == "QLineEdit")
    program.xdotool("type", "held press")
    program.press("Return")
    program.until(lambda state: state["focus"] == "QDoubleSpinBox")
    program.press("ctrl+a")
    program.xdotool("type", milliseconds)
    program.press("Tab", "Escape")
    program.focus()  # which a window manager would give back
    program.until(lambda state: state["focus"] == "TrackPanel")


def hold_for_half_a_second(program):
    program.press("ctrl+Home")
    program.xdotool("keydown", "2")
    program.press("Right", times=7)
    program.until(lambda state: state["stroke"] == "grab")
    program.xdotool("sleep", "0.5", "keyup", "2")
