"""What stands in the way of commands, derived from what is open."""

from dataclasses import replace
from pathlib import Path

import pytest
from window_helpers import open_foam_document

from forcelab.clock import ClockMap
from forcelab.demonstration import VideoReference
from forcelab.gui.commands import COMMANDS, NEEDS
from forcelab.gui.document import Document
from forcelab.gui.obstacles import Obstacles
from forcelab.labels import Segment

TRACK = (Segment(1.0, 2.0, "grab"), Segment(5.0, 6.0, "hold"))


@pytest.fixture
def document(app):
    with open_foam_document(TRACK, Ines=(Segment(7.0, 8.0, "hold"),)) as document:
        yield document


def free(document, *commands, in_view=True):
    """Which of these commands nothing stands in the way of."""
    obstacles = Obstacles(document, lambda: in_view)
    return [command for command in commands if not obstacles(command)]


def test_every_need_of_the_table_is_one_that_is_checked():
    assert {command.needs for command in COMMANDS} == NEEDS | {""}


def test_without_a_project_one_can_be_made_or_opened(app):
    obstacles = Obstacles(Document("Ada"))
    assert obstacles("new_project") == obstacles("open_project") == obstacles("quit") == ""
    assert obstacles("import") == ""  # which makes one for the recordings
    assert obstacles("import_labels") == obstacles("split") == "Open or make a project first."


def test_without_a_demonstration_nothing_is_played_or_labelled(document):
    document._close_demonstration()
    obstacles = Obstacles(document)
    assert obstacles("play") == obstacles("delete") == "Open a demonstration first."
    assert obstacles("export_labels") == ""
    document.infos = ()
    assert obstacles("export_labels") == "There is no demonstration yet; import one first."


def test_what_is_not_in_view_is_not_edited(document):
    commands = "split", "zoom_in", "undo", "accept"
    document.view.seek(1.5)
    sentence = "This acts on the demonstration in view; go to Label or Review."
    hidden = Obstacles(document, lambda: False)
    assert [hidden(command) for command in commands] == [sentence] * 4
    assert free(document, *commands) == ["split", "zoom_in", "undo"]


def test_a_project_that_can_only_be_read_is_looked_at(document, monkeypatch):
    monkeypatch.setattr(document.project._db, "_refusal", "It may only be read here.")
    document.view.seek(1.5)
    obstacles = Obstacles(document)
    assert obstacles("split") == obstacles("rename") == "It may only be read here."
    assert free(document, "play", "zoom_selection", "export_labels") == (
        ["play", "zoom_selection", "export_labels"]
    )


def test_commands_on_segments_follow_cursor_selection_and_range(document):
    view, on_segment = document.view, ("split", "merge", "delete", "end_later", "zoom_selection")
    view.seek(3.0)
    assert free(document, *on_segment, "next_segment", "previous_segment") == (
        ["next_segment", "previous_segment"]
    )
    view.seek(1.5)
    assert free(document, *on_segment) == ["split", "merge", "end_later", "zoom_selection"]
    document.select(0)
    assert "delete" in free(document, *on_segment)
    document.select(1)  # the last one
    assert "merge" not in free(document, *on_segment)
    document.select(None)
    view.seek(9.0)
    view.set_range(1.5, 5.5)
    assert free(document, *on_segment, "erase_range") == (
        ["merge", "delete", "zoom_selection", "erase_range"]
    )
    view.set_range(1.5, 3.0)
    assert Obstacles(document)("merge") == "The marked range must reach into two segments to merge."
    assert free(document, "start_to_cursor", "end_to_cursor") == ["end_to_cursor"]


def test_labels_are_copied_where_another_coder_has_any_that_may_be_seen(document):
    obstacles = Obstacles(document)
    document.view.seek(3.0)
    assert obstacles("copy_from") == "Ines has no segment at the cursor; mark a range to copy."
    document.view.seek(7.5)
    assert obstacles("copy_from") == ""
    document.project.coding.assign(document.id, "Ann")
    document.reread()
    assert obstacles("copy_from") == "Other labels are hidden until you are done; nothing copied."
    assert "hidden until you are done" in obstacles("accept")


def test_a_video_is_synchronised_where_there_is_one(document):
    obstacles = Obstacles(document)
    assert obstacles("synchronise") == "There is no video to synchronise here."
    videos = (VideoReference(Path("no.mp4"), ClockMap()),)
    document.view.demonstration = replace(document.demonstration, videos=videos)
    assert obstacles("synchronise") == ""
