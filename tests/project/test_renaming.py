"""An action that is in use gets another name, in one coder's tracks and in no one else's."""

import pytest

from forcelab.errors import InputError
from forcelab.labels import Segment, Track
from forcelab.project import LabelsUsed, Project, Provenance
from forcelab.project import actions as renaming
from forcelab.project.track_editor import TrackEditor
from forcelab.vocabulary import Vocabulary

#: Ada's and Ben's labels: two of Ada's 'hold' touch, and stay two.
ADA = (Segment(0.0, 0.1, "grab"), Segment(0.1, 0.2, "hold"), Segment(0.2, 0.3, "hold"))
BEN = (Segment(0.0, 0.2, "hold"),)


@pytest.fixture
def ids(project, make):
    """Two demonstrations of LEGO and one of foam, which Ada labelled."""
    added = [
        project.demonstrations.add(make(seed, f"{seed}", task), [Track("Ada", ADA)])
        for seed, task in enumerate(("LEGO", "LEGO", "foam"))
    ]
    return [addition.id for addition in added]


def actions(project, id_, author="Ada"):
    return [segment.action for segment in project.tracks.get(id_, author).segments]


def paint(project, id_, author, segments):
    before = project.tracks.get(id_, author).segments
    project.tracks.edit(id_, author, before, segments, "painted")


def test_a_name_changes_in_all_of_the_coders_tracks_with_key_and_colour(project, ids):
    before = project.actions.vocabularies()
    done = project.actions.rename("Ada", "hold", "grip")
    assert [actions(project, id_) for id_ in ids] == [["grab", "grip", "grip"]] * 3
    for task, vocabulary in project.actions.vocabularies().items():
        assert vocabulary == before[task].renamed("hold", "grip")
    assert done.sentences(done=True) == (
        "'hold' is now 'grip' in 6 segments of Ada, in 3 demonstrations of foam, LEGO."
    )


def test_it_is_an_edit_of_each_track_and_is_undone_there(project, ids):
    project.actions.rename("Ada", "hold", "grip")
    edit = project.tracks.history(ids[0], "Ada")[-1]
    assert (edit.kind, edit.what) == ("paint", "hold is now grip in 2 segments")
    project.tracks.undo(ids[0], "Ada")
    assert project.tracks.get(ids[0], "Ada").segments == ADA
    assert actions(project, ids[1]) == ["grab", "grip", "grip"]


def test_only_the_tasks_that_are_named_change(project, ids):
    project.actions.rename("Ada", "hold", "grip", ["foam"])
    assert actions(project, ids[2]) == ["grab", "grip", "grip"]
    assert project.tracks.get(ids[0], "Ada").segments == ADA
    assert "hold" in project.actions.vocabulary("LEGO")
    assert "grip" not in project.actions.vocabulary("LEGO")


def test_what_others_use_stays_theirs_and_is_told(project, ids):
    paint(project, ids[0], "Ben", BEN)
    hold = project.actions.vocabulary("LEGO")["hold"]
    done = project.actions.rename("Ada", "hold", "grip")
    assert project.tracks.get(ids[0], "Ben").segments == BEN
    assert len(project.tracks.history(ids[0], "Ben")) == 1
    assert project.actions.vocabulary("LEGO").names == ("grab", "grip", "hold")
    grip, left = (
        project.actions.vocabulary("LEGO")["grip"],
        project.actions.vocabulary("LEGO")["hold"],
    )
    assert (grip.key, grip.look) == (hold.key, hold.look)  # what Ada has learnt by heart
    assert left.key != hold.key
    assert left.look != hold.look
    assert project.actions.vocabulary("foam").names == ("grab", "grip")
    assert done.sentences(done=True).endswith(
        "It stays 'hold' for Ben (1 segment). 'grip' keeps key and colour; 'hold' has others."
    )


def test_two_actions_become_one_only_where_that_is_meant(project, ids):
    with pytest.raises(InputError, match="The action 'grab' already exists"):
        project.actions.rename("Ada", "hold", "grab")
    assert project.tracks.get(ids[0], "Ada").segments == ADA
    grab = project.actions.vocabulary("LEGO")["grab"]
    project.actions.rename("Ada", "hold", "grab", merge=True)
    after = project.tracks.get(ids[0], "Ada").segments
    assert [(s.start, s.end) for s in after] == [(s.start, s.end) for s in ADA]
    assert actions(project, ids[0]) == ["grab"] * 3
    assert project.actions.vocabulary("LEGO").actions == (grab,)


def test_all_of_it_or_nothing(project, ids, monkeypatch):
    edits = []

    def full(*words, **more):
        if edits:
            raise InputError("The disk is full.")
        edits.append(edit(*words, **more))

    edit = project.tracks.edit
    monkeypatch.setattr(project.tracks, "edit", full)
    with pytest.raises(InputError, match="full"):
        project.actions.rename("Ada", "hold", "grip")
    assert edits
    assert [project.tracks.get(id_, "Ada").segments for id_ in ids] == [ADA] * 3
    assert "grip" not in project.actions.vocabulary("LEGO")


@pytest.mark.parametrize(
    ("author", "old", "new", "sentence"),
    [
        ("Ada", "hodl", "grip", "no action 'hodl'; did you mean 'hold'"),
        ("Ada", "hold", " ", "needs another name"),
        ("Ada", "hold", "hold", "needs another name"),
        ("Ada", "hold", "Unlabelled", "cannot be called"),
        ("Cleo", "hold", "grip", "Cleo has no segment of it, and others may use it"),
    ],
)
def test_what_cannot_be_is_said_and_changes_nothing(project, ids, author, old, new, sentence):
    before = project.actions.vocabularies()
    for verb in (project.actions.preview_rename, project.actions.rename):
        with pytest.raises(InputError, match=sentence):
            verb(author, old, new)
    assert project.actions.vocabularies() == before
    assert [project.tracks.get(id_, "Ada").segments for id_ in ids] == [ADA] * 3


def test_an_action_without_segments_is_renamed_by_anybody(project, ids):
    project.actions.add("foam", ["twist"])
    done = project.actions.rename("Cleo", "twist", "turn")
    assert project.actions.vocabulary("foam").names == ("grab", "hold", "turn")
    assert (
        done.sentences(done=True)
        == "'twist' is now 'turn' in foam; Cleo has no segment of 'twist'."
    )


def test_who_codes_blind_is_told_nothing_of_the_others(project, ids):
    project.coding.assign(ids[0], "Ada", blind=True)
    for number, author in enumerate(("Ben", "Ben", "Cleo")):
        paint(project, ids[0], author, BEN if number else ())
        sentences = project.actions.preview_rename("Ada", "hold", "grip").sentences(done=False)
        assert "Ben" not in sentences
        assert "Cleo" not in sentences
    assert sentences.endswith(
        "'hold' stays in the list, as others may use it. "
        "'grip' keeps key and colour; 'hold' gets others."
    )
    paint(project, ids[1], "Cleo", BEN)  # where Ada may see it
    assert "for Cleo (1 segment)." in project.actions.preview_rename(
        "Ada", "hold", "grip"
    ).sentences(done=False)
    project.coding.set_done(ids[0], "Ada")
    sentences = project.actions.preview_rename("Ada", "hold", "grip").sentences(done=False)
    assert "for Ben (1 segment), Cleo (2 segments)." in sentences


@pytest.mark.parametrize("used", [False, True])
def test_who_codes_blind_cannot_find_out_by_renaming_or_removing(project, ids, used):
    project.actions.add("LEGO", ["slip", "twist"])
    project.coding.assign(ids[0], "Cleo", blind=True)
    paint(project, ids[1], "Cleo", (Segment(0.0, 0.1, "twist"),))
    before = project.tracks.get(ids[0], "Ada").segments
    if used:
        hidden = (Segment(0.5, 0.6, "slip"), Segment(0.6, 0.7, "twist"))
        project.tracks.edit(ids[0], "Ada", before, (*before, *hidden), "painted")
    with pytest.raises(InputError, match="'slip' was not renamed: Cleo has no segment of it"):
        project.actions.rename("Cleo", "slip", "slide")
    with pytest.raises(InputError, match="'slip' stays in the list, as others may use it"):
        project.actions.refuse_removing("Cleo", "slip", "LEGO")
    with pytest.raises(InputError, match="There are segments of 'twist'"):
        project.actions.refuse_removing("Cleo", "twist", "LEGO")
    done = project.actions.rename("Cleo", "twist", "turn")
    assert "'twist' stays in the list, as others may use it." in done.sentences(done=True)
    assert {"twist", "turn"} < {*project.actions.vocabulary("LEGO").names}
    project.coding.set_done(ids[0], "Cleo")
    if used:
        with pytest.raises(InputError, match="There are segments of 'slip'"):
            project.actions.refuse_removing("Cleo", "slip", "LEGO")
    else:
        project.actions.refuse_removing("Cleo", "slip", "LEGO")


def test_which_of_two_actions_has_the_segments_is_said_before_they_are_merged(project, ids):
    assert project.actions.preview_rename("Ada", "hold", "grab", ["foam"]).sentences(
        done=False
    ) == (
        "'hold' becomes 'grab' in 2 segments of Ada, in 1 demonstration of foam. "
        "The action 'grab' already exists."
    )


def test_recognisers_and_runs_stay_as_they_are(project, ids):
    used = LabelsUsed(ids[1], "Ada", project.tracks.head(ids[1], "Ada"))
    provenance = Provenance(settings={}, seed=0, labels=[used], versions={})
    number = project.runs.add("evaluate", provenance, result={"actions": ["grab", "hold"]})
    done = project.actions.rename("Ada", "hold", "grip", ["foam"])
    assert "Recognisers" not in done.sentences(done=True)
    done = project.actions.rename("Ada", "hold", "grip")
    assert done.sentences(done=True).endswith(
        "Recognisers and runs made before keep 'hold': train again."
    )
    assert project.runs.get(number).result["actions"] == ["grab", "hold"]
    assert project.tracks.edits_since([used]) == 1


def test_predictions_do_not_keep_a_name_and_keep_theirs(project, ids):
    project.tracks.edit(ids[0], "model paper 1", (), BEN, "predicted", kind="predict")
    project.actions.rename("Ada", "hold", "grip")
    assert project.actions.vocabulary("LEGO").names == ("grab", "grip")
    assert actions(project, ids[0], "model paper 1") == ["hold"]


def test_another_process_reads_the_new_names(project, ids, path):
    with Project.open(path) as other:
        assert actions(other, ids[0]) == ["grab", "hold", "hold"]
        project.actions.rename("Ada", "hold", "grip")
        assert other.changed_elsewhere()
        assert actions(other, ids[0]) == ["grab", "grip", "grip"]
        assert (
            other.actions.vocabulary("LEGO") == project.actions.vocabulary("LEGO") != Vocabulary()
        )


def test_it_is_taken_back_in_every_track_at_once_and_brought_back(project, ids):
    project.actions.rename("Ada", "hold", "grip")
    done = project.tracks.undo_everywhere(ids[1], "Ada")
    assert done.edits[0].demonstration == ids[1]
    assert {edit.demonstration for edit in done.edits} == {*ids}
    assert done.sentence() == "Undone: rename of hold to grip (6 segments in 3 demonstrations)"
    assert [project.tracks.get(id_, "Ada").segments for id_ in ids] == [ADA] * 3
    project.tracks.redo_everywhere(ids[2], "Ada")
    assert [actions(project, id_) for id_ in ids] == [["grab", "grip", "grip"]] * 3


def test_what_was_edited_since_is_left_and_what_was_undone_already_is_not_told(project, ids):
    project.actions.rename("Ada", "hold", "grip")
    paint(project, ids[0], "Ada", project.tracks.get(ids[0], "Ada").segments[:2])
    project.tracks.undo(ids[1], "Ada")
    done = project.tracks.undo_everywhere(ids[2], "Ada")
    assert [edit.demonstration for edit in done.edits] == [ids[2]]
    assert done.left == ("0",)
    assert actions(project, ids[0]) == ["grab", "grip"]
    paint(project, ids[1], "Ada", ADA[:1])
    again = project.tracks.redo_everywhere(ids[2], "Ada")
    assert (len(again.edits), again.left) == (1, ("1",))
    assert "; not in '1'" in again.sentence()


def test_an_edit_that_is_like_another_is_undone_alone(project, ids):
    project.actions.rename("Ada", "hold", "grip", ["LEGO"])
    project.actions.rename("Ada", "hold", "grip", ["foam"])
    done = project.tracks.undo_everywhere(ids[2], "Ada")
    assert (len(done.edits), done.left) == (1, ())
    assert actions(project, ids[0]) == ["grab", "grip", "grip"]
    assert project.tracks.undo_everywhere(ids[2], "Ben") is None


def test_two_renamings_in_one_tick_of_the_clock_are_undone_one_by_one(project, ids, monkeypatch):
    now = renaming.utc_now()
    monkeypatch.setattr(renaming, "utc_now", lambda: now)
    project.actions.rename("Ada", "hold", "grip", ["LEGO"])
    project.actions.rename("Ada", "hold", "grip", ["foam"])
    done = project.tracks.undo_everywhere(ids[2], "Ada")
    assert (len(done.edits), done.left) == (1, ())
    assert actions(project, ids[0]) == actions(project, ids[1]) == ["grab", "grip", "grip"]
    assert project.tracks.get(ids[2], "Ada").segments == ADA


def test_undoing_a_relabel_is_no_undo_of_a_renaming(project, ids):
    editor = TrackEditor(project, ids[0], "Ada")
    editor.relabel(0, "put in")
    assert "is now put in" in editor.history()[-1].what
    assert not editor.undo_everywhere().renames
    project.actions.rename("Ada", "hold", "grip")
    assert editor.refresh()
    assert editor.undo_everywhere().renames
