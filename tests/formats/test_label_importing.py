"""Labels from other programs go onto the demonstrations of their names, and replace nothing."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

import forcelab
from forcelab.cli import main
from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.formats import identify
from forcelab.formats.elan import to_elan
from forcelab.formats.export import exporting
from forcelab.formats.label_files import LabelOptions, importing_labels
from forcelab.formats.textgrid import to_textgrid
from forcelab.formats.track_text import AnnotatedTrack, to_audacity, to_csv, to_statistics_table
from forcelab.jobs import finish
from forcelab.labels import Segment, Track
from forcelab.project import Project

ANN = (Segment(0.25, 1.5, "grab"), Segment(1.5, 3.0, "hold"), Segment(4.0, 6.5, "slip"))
OTHER = (Segment(0.5, 1.5, "grab"), Segment(1.5, 3.0, "hold"))


def demonstration(name, task, seconds, seed):
    times = np.arange(round(seconds * 100) + 1) / 100
    signals = np.random.default_rng(seed).normal(size=(times.size, 1))
    return Demonstration(name, task, times, signals, (Channel("fz1", "N"),))


@pytest.fixture
def project(tmp_path):
    """Two tasks, in both of which a demonstration is called 01; the second is the longer one."""
    path = tmp_path / "study.forcelab"
    with Project.create(path) as project:
        for seed, (name, task, seconds) in enumerate(
            [("01", "pen", 10.0), ("02", "pen", 10.0), ("01", "foam", 20.0), ("Ü 1: a", "foam", 9)]
        ):
            project.demonstrations.add(demonstration(name, task, seconds, seed))
    return path


@pytest.fixture
def load(project, tmp_path):
    def load(name, *tracks, text=None, options=None, **keywords):
        path = tmp_path / name
        path.write_text(to_csv(tracks) if text is None else text, encoding="utf-8")
        return finish(importing_labels(project, [path], options, **keywords))

    return load


def outcome(report):
    """Of the only track: its demonstration, author and status."""
    (track,) = report.tracks
    at = track.demonstration and (track.demonstration.task, track.demonstration.name)
    return at, track.author, track.status


def stored(project, name, author):
    with Project.open(project) as opened:
        return opened.tracks.get(opened.demonstrations.id_of(name), author).segments


@pytest.mark.parametrize("name", ["02.labels.csv", "02.csv", "pen - 02.csv", "02_labels.csv"])
def test_a_file_belongs_to_the_demonstration_of_its_name(load, project, name):
    report = load(name, Track("Ann", ANN))
    assert outcome(report) == (("pen", "02"), "Ann", "new")
    assert report.remarks == {}
    assert stored(project, "02", "Ann") == ANN


@pytest.mark.parametrize("name", ["ü 1_ A.csv", "FOAM - ü 1_ a.labels.csv", "Ü 1_ a.mp4.csv"])
def test_names_are_alike_whatever_their_case_and_what_no_file_can_be_called(load, name):
    assert outcome(load(name, Track("Ann", ANN)))[0] == ("foam", "Ü 1: a")


def test_a_name_of_two_is_that_of_the_one_as_long_as_the_labels(load, project, tmp_path):
    (track,) = load("01.csv", Track("Ann", ANN)).tracks
    assert track.status == "left out"
    assert track.reason == ("'01' may be '01' of foam, '01' of pen; choose one (--demo).")
    late = (Segment(12.0, 13.0, "grab"),)
    assert outcome(load("01.csv", Track("Ann", late)))[0] == ("foam", "01")
    rows = [AnnotatedTrack("01", "", 10.2, "coder", Track("Zoe", ANN))]
    assert outcome(load("all.csv", text=to_statistics_table(rows)))[0] == ("pen", "01")


def test_an_observation_of_another_name_belongs_to_the_demonstration_of_its_media(load):
    header = "Observation id,Observer,Media file name,Time offset (s),Behavior,Behavior type,Time\n"
    text = header + "".join(
        f"Obs KB 3,Kim,C:\\films\\02.mp4,0,grab,{kind}\n" for kind in ("START,1", "STOP,2")
    )
    assert outcome(load("events.csv", text=text)) == (("pen", "02"), "Kim", "new")
    (track,) = load("events.csv", text=text.replace("02.mp4", "x.mp4")).tracks
    assert track.reason.startswith("No demonstration is called 'Obs KB 3' or 'events' or 'x';")
    named = load("events.csv", text=text.replace("Obs KB 3", "Ü 1: a"))
    assert outcome(named)[0] == ("foam", "Ü 1: a")


def test_an_observation_whose_states_do_not_pair_is_left_out_and_the_others_are_read(load, project):
    header = "Observation id,Observer,Behavior,Behavior type,Time,Media file name\n"
    rows = [
        *("02,Kim,grab,START,1", "02,Kim,grab,STOP,2", "02,Kim,hold,STOP,3"),
        *("02 - Zoe,Zoe,grab,START,1", "02 - Zoe,Zoe,grab,STOP,2"),
        *("Ü 1: a,Kim,grab,START,1", "Ü 1: a,Kim,hold,START,1"),
        *("Ü 1: a,Kim,hold,STOP,2", "Ü 1: a,Kim,grab,STOP,3"),
    ]
    report = load("events.csv", text=header + "".join(f"{row},NA\n" for row in rows))
    told = [(track.name, track.author, track.segments, track.status) for track in report.tracks]
    left, read = ("Kim", 0, "left out"), ("Zoe", 1, "new")
    assert told == [("02", *left), ("02", *read), ("Ü 1: a", *left)]
    never, overlap = (track.reason for track in report.tracks if track.reason)
    assert "events.csv', line 4: 'hold' at 3 s never starts; pair the state events" in never
    assert "events.csv', observation 'Ü 1: a': Segments of one author overlap" in overlap
    assert len(stored(project, "02", "Zoe")) == 1


def test_a_demonstration_can_be_chosen_and_a_missing_one_is_told(load, project):
    assert load("what.csv", Track("Ann", ANN)).trouble().popitem()[1] == (
        "No demonstration is called 'what'; rename the file, or choose one (--demo).",
    )
    chosen = load("what.csv", Track("Ann", ANN), demonstration="02")
    assert outcome(chosen) == (("pen", "02"), "Ann", "new")
    rows = [AnnotatedTrack(name, "", 10, "coder", Track("Zoe", ANN)) for name in "ab"]
    both = load("all.csv", text=to_statistics_table(rows), demonstration="02")
    assert "several demonstrations" in both.tracks[0].reason
    with pytest.raises(InputError, match="There is no demonstration '03'"):
        load("what.csv", Track("Ann", ANN), demonstration="03")


def test_unsigned_labels_are_by_whom_the_name_or_else_the_options_say(load):
    unsigned = to_audacity(Track("x", ANN))
    assert outcome(load("02 - Zoe.txt", text=unsigned))[1:] == ("Zoe", "new")
    assert outcome(load("PEN - 02 - Ida.txt", text=unsigned))[1:] == ("Ida", "new")
    options = LabelOptions(author="Ben")
    assert outcome(load("02.txt", text=unsigned, options=options))[1:] == ("Ben", "new")
    signed = load("02 - Zoe.csv", Track("Ann", ANN))
    assert outcome(signed)[1:] == ("Ann", "new")


def test_what_an_author_has_there_is_replaced_only_on_demand_by_one_edit(load, project):
    load("02.csv", Track("Ann", ANN))
    refused = load("02.csv", Track("Ann", OTHER))
    assert outcome(refused)[2] == "left out"
    assert "Ann has labels on '02' already, which differ" in refused.tracks[0].reason
    assert stored(project, "02", "Ann") == ANN
    assert outcome(load("02.csv", Track("Ann", ANN)))[2] == "unchanged"
    dry = load("02.csv", Track("Ann", OTHER), replacing=True, writing=False)
    assert outcome(dry)[2] == "replaced"
    assert stored(project, "02", "Ann") == ANN
    assert outcome(load("02.csv", Track("Ann", OTHER), replacing=True))[2] == "replaced"
    assert stored(project, "02", "Ann") == OTHER
    with Project.open(project) as opened:
        id_ = opened.demonstrations.id_of("02")
        history = opened.tracks.history(id_, "Ann")
        assert [edit.what for edit in history] == [
            "3 segments from 02.csv",
            "2 segments from 02.csv in place of 3",
        ]
        opened.tracks.undo(id_, "Ann")
        assert opened.tracks.get(id_, "Ann").segments == ANN


def test_what_replacing_changes_and_new_actions_are_told(load, project, tmp_path, capsys):
    load("02.csv", Track("Ann", ANN))
    edited = (Segment(0.25, 1.75, "Grab"), Segment(1.75, 3.0, "hold"), Segment(4.0, 6.5, "slip"))
    report = load("02.csv", Track("Ann", edited), replacing=True, writing=False)
    assert report.tracks[0].changes == "1 edge moved, 1 segment renamed"
    told = "New action 'Grab' (there is 'grab') of pen."
    assert list(report.remarks.values()) == [(told,)]
    words = ["labels", str(project), str(tmp_path / "02.csv"), "--replace"]
    assert main([*words, "--dry-run", "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["tracks"][0]["changes"] == "1 edge moved, 1 segment renamed"
    assert list(content["remarks"].values()) == [[told]]
    assert main(words) == 0
    assert capsys.readouterr().out.startswith(
        f"replaced   02  Ann  3 segments: 1 edge moved, 1 segment renamed\n02.csv: {told}\n"
    )
    first = load("02.csv", Track("Zoe", (Segment(1, 2, "lift"), Segment(3, 4, " GRAB"))))
    assert first.tracks[0].changes == ""
    assert list(first.remarks.values()) == [
        ("New action 'lift' of pen.", "New action 'GRAB' (there is 'grab') of pen.")
    ]


def test_tiers_called_as_actions_and_tiers_without_text_are_told(load, tmp_path):
    load("02.csv", Track("Ann", ANN))
    tracks = [Track("grab", (Segment(1, 2, "x"),)), Track("hold", (Segment(2, 3, "-"),))]
    text = to_textgrid(tracks, 10.0).decode().replace('"-"', '" "')
    read_as_authors = load("02.TextGrid", text=text)
    (remarks,) = read_as_authors.remarks.values()
    cure = "if they are actions, say so (--tiers actions)."
    assert remarks[:2] == (
        "The tier 'hold' has no text and was left out.",
        f"Tiers were read as authors and are called as actions of pen: 'grab', 'hold'; {cure}",
    )
    options = LabelOptions(tiers="actions")
    (remarks,) = load("02.TextGrid", text=text, options=options).remarks.values()
    assert remarks[1] == "1 text was left out, as the tiers are the actions."
    eaf = to_elan(tracks, (), tmp_path, ()).decode()
    assert f"1 tier without any text was left out: 'hold'; {cure}" in next(
        iter(load("02.eaf", text=eaf.replace(">-<", "><")).remarks.values())
    )
    blank = load("02.eaf", text=eaf.replace(">-<", "><").replace(">x<", "><"))
    told = f"2 tiers without any text were left out: 'grab', 'hold'; {cure}"
    assert next(iter(blank.unread.values())).endswith(f"there is nothing to import. {told}")


def test_actions_that_the_task_lacks_are_added(load, project):
    load("02.csv", Track("Ann", ANN))
    with Project.open(project) as opened:
        assert opened.actions.vocabulary("pen").names == ("grab", "hold", "slip")


def test_texts_that_are_no_actions_are_left_out_before_they_are_too_many(load, project):
    texts = tuple(Segment(k / 200, (k + 1) / 200, f"remark {k}") for k in range(1001))
    (track,) = load("02.csv", Track("Ann", texts)).tracks
    assert track.reason == (
        "With the labels of Ann, pen would have 1,001 actions, more than 1,000; check that these "
        "are actions and not remarks."
    )
    with Project.open(project) as opened:
        with pytest.raises(InputError, match="up to 1,000 actions, and pen would have 1,001"):
            opened.actions.add("pen", [s.action for s in texts])
        assert opened.actions.vocabulary("pen").names == ()


def test_actions_of_several_tracks_count_together(load, project):
    ann, zoe = (
        Track(name, tuple(Segment(k / 200, (k + 1) / 200, f"{name} {k}") for k in range(501)))
        for name in ("Ann", "Zoe")
    )
    report = load("02.csv", ann, zoe)
    assert [track.status for track in report.tracks] == ["new", "left out"]
    assert "With the labels of Zoe, pen would have 1,002 actions" in report.tracks[1].reason
    assert stored(project, "02", "Ann") == ann.segments


def test_importing_the_recording_anew_does_not_replace_what_replaced_an_import(load, project):
    recording = demonstration("02", "pen", 10.0, 1)
    with Project.open(project) as opened:
        opened.demonstrations.add(recording, [Track("Ann", ANN)], "02.csv")
    load("02.csv", Track("Ann", OTHER), replacing=True)
    with Project.open(project) as opened:
        opened.demonstrations.add(recording, [Track("Ann", ANN)], "02.csv")
    assert stored(project, "02", "Ann") == OTHER


def test_predictions_and_labels_beyond_the_end_are_left_out(load, project):
    (track,) = load("02.csv", Track("model paper", ANN)).tracks
    assert "is a model, whose predictions never become labels" in track.reason
    (track,) = load("02.csv", Track("Ann", (Segment(9.0, 12.5, "grab"),))).tracks
    assert track.reason == (
        "'grab' of Ann goes from 9 to 12.5 s, and '02' is 10.01 s long; choose another "
        "demonstration (--demo) or move the labels (--offset)."
    )
    assert stored(project, "02", "Ann") == ()
    options = LabelOptions(offset=-2.5)
    moved = load("02.csv", Track("Ann", (Segment(9.0, 12.5, "grab"),)), options=options)
    assert outcome(moved)[2] == "new"
    assert stored(project, "02", "Ann") == (Segment(6.5, 10.0, "grab"),)


@pytest.mark.parametrize(("end", "offset"), [("1.0000000000000002", 5.0), ("1e308", 1e308)])
def test_times_that_no_clock_can_hold_are_left_out_and_other_files_are_not(
    project, tmp_path, end, offset
):
    far, near = tmp_path / "02.csv", tmp_path / "pen - 01.csv"
    far.write_text(f"start,end,action,author\n1.0,{end},grab,Ann\n")
    near.write_text(to_csv([Track("Ann", OTHER)]))
    report = finish(importing_labels(project, [far, near], LabelOptions(offset=offset)))
    assert report.tracks[0].status == "left out"
    assert "must end after it starts" in report.tracks[0].reason
    assert report.tracks[1].status == ("new" if offset == 5.0 else "left out")


def test_two_files_with_other_labels_of_one_author_do_not_both_count(load, project, tmp_path):
    files = [tmp_path / name for name in ("02.csv", "02.labels.csv", "pen - 02.csv")]
    for file, segments in zip(files, (ANN, OTHER, ANN), strict=True):
        file.write_text(to_csv([Track("Ann", segments)]))
    report = finish(importing_labels(project, files))
    assert [track.status for track in report.tracks] == ["new", "left out", "unchanged"]
    assert "are in '02.csv' and in '02.labels.csv' and differ" in report.tracks[1].reason
    assert stored(project, "02", "Ann") == ANN


def test_a_better_offset_is_told_with_how_well_labels_agree_there(load, project):
    random = np.random.default_rng(2)
    edges = np.sort(random.choice(np.arange(10, 80), 12, replace=False)) / 10
    actions = random.choice(["grab", "hold", "slip"], 6)
    pairs = zip(edges[::2], edges[1::2], actions, strict=True)
    segments = tuple(Segment(float(a), float(b), str(action)) for a, b, action in pairs)
    load("02.csv", Track("Ann", segments))
    early = tuple(Segment(s.start - 0.734, s.end - 0.734, s.action) for s in segments)
    (remark,) = load("02.csv", Track("Zoe", early)).remarks.popitem()[1]
    assert re.fullmatch(
        r"Moved by \+0.734 s, the labels of Zoe would agree with those of Ann in (99|100) % of the "
        r"labelled time instead of \d\d? % \(--offset 0.734\).",
        remark,
    )
    options = LabelOptions(offset=0.734)
    told = load("02.csv", Track("Ben", early), options=options)
    assert told.remarks == {}
    assert stored(project, "02", "Ben") == segments


def test_a_blind_coder_imports_own_labels_and_is_told_nothing_of_others(load, project):
    load("02.csv", Track("Ann", ANN))
    with Project.open(project) as opened:
        opened.coding.assign(opened.demonstrations.id_of("02"), "Zoe")
    for segments in (ANN, OTHER):
        report = load("02.csv", Track("Ann", segments), viewer="Zoe", replacing=True)
        assert outcome(report)[2] == "left out"
        assert "hidden from Zoe until blind coding of it is done" in report.tracks[0].reason
        assert report.remarks == {}
    early = tuple(Segment(s.start + 2, s.end + 2, s.action) for s in ANN)
    own = load("02.csv", Track("Zoe", early), viewer="Zoe")
    assert outcome(own)[2] == "new"
    assert own.remarks == {}


def test_a_file_that_is_none_is_told_and_the_others_are_imported(project, tmp_path, capsys):
    (tmp_path / "02.csv").write_text(to_csv([Track("Ann", ANN)]))
    (tmp_path / "note.txt").write_text("Dear all,\nno labels here\n")
    words = ["labels", str(project), str(tmp_path / "note.txt"), str(tmp_path / "02.csv")]
    assert main(words) == 1
    out, err = capsys.readouterr()
    assert out == "new        02  Ann  3 segments\n1 track: 1 new, 0 replaced, 0 unchanged.\n"
    assert err.startswith("forcelab: left out: ")
    assert "note.txt' is no file of labels, but looks like text" in err
    assert stored(project, "02", "Ann") == ANN


def test_samples_with_labels_are_told_to_be_a_recording(load):
    rows = "".join(f"{n / 100},{n % 7 / 3},{'grab' if n > 20 else ''}\n" for n in range(60))
    unread = load("02.samples.csv", text=f"time (s),fz1 (N),labels of Ines\n{rows}").unread
    assert "02.samples.csv' looks like a recording, not a file of labels" in (
        next(iter(unread.values()))
    )


def test_where_nothing_is_read_no_tracks_are_counted(project, tmp_path, capsys):
    (tmp_path / "note.txt").write_text("Dear all,\nno labels here\n")
    assert main(["labels", str(project), str(tmp_path / "note.txt")]) == 1
    assert capsys.readouterr().out == ""


def test_a_dry_run_says_what_it_would_do(project, tmp_path, capsys):
    (tmp_path / "02.csv").write_text(to_csv([Track("Ann", ANN)]))
    assert main(["labels", str(project), str(tmp_path / "02.csv"), "--dry-run"]) == 0
    assert capsys.readouterr().out == (
        "new        02  Ann  3 segments\n1 track: 1 new, 0 replaced, 0 unchanged.\n"
        "Nothing was imported (--dry-run).\n"
    )
    assert stored(project, "02", "Ann") == ()


def test_a_script_imports_as_the_command_does(project, tmp_path):
    (tmp_path / "02.csv").write_text("start,end,action\n0.25,1.5,grab\n")
    options = forcelab.LabelOptions(author="Ann", offset=0.5)
    report = forcelab.import_labels(project, [tmp_path / "02.csv"], options)
    assert report.count("new") == 1
    assert stored(project, "02", "Ann") == (Segment(0.75, 2.0, "grab"),)


def test_what_is_exported_comes_back_unchanged(load, project, tmp_path):
    for name in ("02", "Ü 1: a"):
        with Project.open(project) as opened:
            id_ = opened.demonstrations.id_of(name)
            for author in ("Ann", "Zoe - B."):
                opened.tracks.edit(id_, author, (), ANN, "painted")
    for form in ("csv", "table", "audacity"):
        files = finish(exporting(project, tmp_path / form, form))
        report = finish(importing_labels(project, files))
        assert [track.status for track in report.tracks] == ["unchanged"] * 4


@pytest.fixture
def filmed(tmp_path):
    """A demonstration whose second video begins 0.4 s earlier and runs 100 ppm slow."""
    path = tmp_path / "filmed.forcelab"
    with Project.create(path) as project:
        added = project.demonstrations.add(demonstration("take 1", "pen", 10.0, 5))
        for name, clock in (("left", ClockMap()), ("right", ClockMap(-0.4, 1.0001))):
            film = tmp_path / f"{name}.mp4"
            film.write_bytes(name.encode())
            project.media.attach_video(added.id, film, clock, name)
    return path


def as_made_on(path, *media):
    """Ann's labels in an ELAN file of somebody else's, made on media with their time origins."""
    content = to_elan([Track("Ann", ANN)], (), path.parent).decode()
    links = "".join(
        f'<MEDIA_DESCRIPTOR MEDIA_URL="file:///D:/{name}" MIME_TYPE="video/mp4" TIME_ORIGIN="{t}"/>'
        for name, t in media
    )
    content = content.replace('AUTHOR="forcelab"', 'AUTHOR=""')
    path.write_text(content.replace("<PROPERTY", f"{links}<PROPERTY", 1))
    return path


def test_times_of_a_video_are_carried_onto_the_forces_by_its_clock(filmed, tmp_path):
    with Project.open(filmed) as opened:
        left, right = (v.path.name for v in opened.demonstrations.load("take 1").videos)
    carried = "Its times were carried onto the forces by the video's clock."
    taken = (
        "'GX 01.mp4' was taken for the video of 'take 1', by whose clock times were carried onto "
        "the forces."
    )
    path = tmp_path / "take 1.eaf"
    for media, clock, origin, remarks in (
        ([(left, 0)], ClockMap(), 0.0, {}),
        ([("other.mp4", 0), (right, 1500)], ClockMap(-0.4, 1.0001), 1.5, {path: (carried,)}),
    ):
        with Project.open(filmed) as opened:
            opened.tracks.undo(opened.demonstrations.id_of("take 1"), "Ann")
        report = finish(importing_labels(filmed, [as_made_on(path, *media)]))
        assert report.trouble() == {}
        assert report.remarks == remarks
        edges = [(s.start, s.end) for s in stored(filmed, "take 1", "Ann")]
        expected = clock.to_force([(s.start + origin, s.end + origin) for s in ANN])
        np.testing.assert_allclose(edges, expected, atol=1e-9)
    with Project.open(filmed) as opened:
        opened.tracks.undo(opened.demonstrations.id_of("take 1"), "Ann")
        opened.media.set_video_clock(opened.demonstrations.id_of("take 1"), ClockMap(1.0))
    report = finish(
        importing_labels(filmed, [as_made_on(path, ("GX%2001.mp4", 0))], replacing=True)
    )
    assert report.remarks == {path: (taken,)}
    assert stored(filmed, "take 1", "Ann")[0] == Segment(1.25, 2.5, "grab")


def test_what_elan_only_rounds_is_unchanged_and_an_edit_there_moves_no_other_edge(
    project, tmp_path
):
    exact = (Segment(0.25031, 1.50049, "grab"), Segment(1.50049, 3.0, "hold"))
    with Project.open(project) as opened:
        id_ = opened.demonstrations.id_of("02")
        opened.tracks.edit(id_, "Ann", (), exact, "painted")
    path = finish(exporting(project, tmp_path / "out", "elan"))[0]
    assert outcome(finish(importing_labels(project, [path])))[2] == "unchanged"
    path.write_text(path.read_text().replace('"3000"', '"2500"'))
    assert outcome(finish(importing_labels(project, [path], replacing=True)))[2] == "replaced"
    assert stored(project, "02", "Ann") == (exact[0], Segment(1.50049, 2.5, "hold"))


@pytest.mark.parametrize("name", ["take.eaf", "take.TextGrid"])
def test_labels_that_are_imported_as_a_recording_are_told_for_what_they_are(tmp_path, name):
    path = tmp_path / name
    track = Track("Ann", ANN)
    path.write_bytes(
        to_elan([track], (), tmp_path) if name.endswith("eaf") else to_textgrid([track], 9.0)
    )
    with pytest.raises(InputError, match="holds labels, which belong to a demonstration"):
        identify(path)
