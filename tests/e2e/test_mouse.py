"""A whole demonstration labelled with the mouse alone, in the real window on a real screen."""

import pytest

from tests.e2e.program import wait_for_stored_segments


def test_a_demonstration_is_labelled_without_the_keyboard(screen, start, project):
    program = start(project, "--author", "Ada", "--demo", "pen 1", display=screen)
    program.focus()
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

        return wait_for_stored_segments(project, "pen 1", alike)

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
    program.click(program.ask("row", view="", text="pen 2"))
    program.until(lambda state: state["title"].startswith("pen 2"))
