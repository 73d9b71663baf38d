"""From the first start to the first label of one's own recordings, in the real window."""

import shutil
from pathlib import Path

from window_helpers import PATIENCE

from forcelab.project import Project
from tests.e2e.program import wait_for_stored_segments

ASSETS = Path(__file__).parents[2] / "assets"


def test_own_recordings_are_imported_and_one_is_labelled(screen, start, tmp_path):
    folder = tmp_path / "foam"
    folder.mkdir()
    files = [folder / f"foam-{number:02d}.csv" for number in (1, 2)]
    for file in files:
        shutil.copy(ASSETS / file.name, file)
    program = start("gui", "--author", "Ada", display=screen)
    program.focus()
    assert program.ask("state")["title"] == "forcelab"
    assert sorted(folder.iterdir()) == files

    def dialog(before=0):
        """Give the keyboard to the next dialog, as a window manager does; gives its number."""
        number = program.until(lambda state: state["dialog"] not in (0, before))["dialog"]
        program.xdotool("windowfocus", "--sync", number)
        return number

    program.click(program.ask("widget", kind="QCommandLinkButton", name="Label your own"))
    first = dialog()
    program.xdotool("type", "--delay", 8, f"{folder}/")
    program.press("Return")
    # Of files that Qt's dialog has not listed yet it may take the last one alone.
    program.until(lambda _: program.ask("row", view="QTreeView", text=files[-1].name))
    program.xdotool("type", "--delay", 8, " ".join(f'"{file.name}"' for file in files))
    program.press("Return")
    dialog(first)
    program.xdotool("type", "--delay", 8, "foam")
    program.press("Return")
    program.until(lambda state: state["title"].startswith("foam-01"))
    program.press("Return")
    program.until(lambda state: not state["modal"])
    with Project.open(folder / "foam.forcelab") as project:
        assert [info.name for info in project.demonstrations.infos("foam")] == [
            "foam-01",
            "foam-02",
        ]

    # The three hints, followed by keys and mouse.
    program.focus()
    hint = {"kind": "HintBar", "name": "Hint"}
    program.press("space")
    program.until(lambda state: state["playing"])
    program.press("space")
    program.click(program.ask("row", view="Action", text="grab"))
    program.until(lambda state: state["action"] == "grab")
    assert program.ask("widget", **hint) is not None
    program.drag(program.ask("point", time=1), program.ask("point", time=2))
    wait_for_stored_segments(folder / "foam.forcelab", "foam-01", len)
    program.press("ctrl+Next")
    program.until(lambda state: state["title"].startswith("foam-02"))
    assert program.ask("widget", **hint) is None
    program.xdotool("key", "ctrl+q")
    assert program.process.wait(PATIENCE) == 0
