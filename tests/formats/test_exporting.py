"""What other programs are given: one table of all, ELAN's files, a project of BORIS."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pympi
import pytest
from factories import cached_project, make_filmed_project

from forcelab.cli import main
from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.formats import elan
from forcelab.formats.boris import Observation, to_boris
from forcelab.formats.elan import to_elan, write_time_series
from forcelab.formats.export import FORMATS, ExportFormat, exporting
from forcelab.formats.importing import importing
from forcelab.formats.recording import ReadOptions
from forcelab.jobs import finish
from forcelab.labels import Segment, Track
from forcelab.project import Project
from forcelab.video.reader import VideoReader
from forcelab.vocabulary import Vocabulary

DUSTY = 0.1 + 0.2
ANN = (Segment(0.1, DUSTY, "grab"), Segment(DUSTY, 0.45, "hold, firmly"))
ZOE = (Segment(0.0, 0.2, "grab"),)


@pytest.fixture
def project(tmp_path):
    """A demonstration whose video starts 0.4 s before its forces, labelled by two."""
    tracks = ("Ann", ANN), ("Zoe", ZOE)
    return cached_project(make_filmed_project, tmp_path / "study.forcelab", tracks)


def export(project, kind, **options):
    """What was written; of several files the first one."""
    return finish(exporting(project, project.parent / "out", kind, **options))[0]


def test_one_table_holds_every_segment_with_whose_and_of_what_it_is(project):
    with export(project, "table").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    whose = [(row["author"], row["kind"], row["segment"]) for row in rows]
    assert whose == [("Ann", "coder", "1"), ("Ann", "coder", "2"), ("Zoe", "coder", "1")]
    assert [row["action"] for row in rows] == ["grab", "hold, firmly", "grab"]
    assert [rows[1][name] for name in ("start", "end", "duration")] == ["0.3", "0.45", "0.15"]
    with Project.open(project) as opened:
        info = opened.demonstrations.infos()[0]
    assert {row["demonstration"] for row in rows} == {info.name}
    assert float(rows[0]["seconds"]) == pytest.approx(info.duration)


def boris(project):
    return json.loads(export(project, "boris").read_text("utf-8"))


def test_a_boris_project_holds_every_segment_as_a_state_event(project):
    content = boris(project)
    # What BORIS 9 asks of a project when it opens one.
    assert content["project_format_version"] == "7.0"
    assert content["project_name"] == "study"
    assert {"subjects_conf", "behavioral_categories", "coding_map", "converters"} <= set(content)
    codes = [(entry["code"], entry["type"]) for entry in content["behaviors_conf"].values()]
    assert codes == [("grab", "State event"), ("hold, firmly", "State event")]
    keys = [entry["key"] for entry in content["behaviors_conf"].values()]
    assert len(set(keys)) == 2
    with Project.open(project) as opened:
        (info,) = opened.demonstrations.infos()
        video = opened.demonstrations.load(info.id).video.path
        first = opened.tracks.history(info.id, "Ann")[0].time
    ann, zoe = (content["observations"][f"{info.name} - {name}"] for name in ("Ann", "Zoe"))
    assert ann["events"] == [
        [0.1, "", "grab", "", "", "NA"],
        [0.3, "", "grab", "", "", "NA"],
        [0.3, "", "hold, firmly", "", "", "NA"],
        [0.45, "", "hold, firmly", "", "", "NA"],
    ]
    assert [event[:3] for event in zoe["events"]] == [[0.0, "", "grab"], [0.2, "", "grab"]]
    assert ann["type"] == "MEDIA"
    assert (ann["file"]["1"], ann["file"]["2"]) == ([str(video)], [])
    assert ann["time offset"] == -0.4  # the time at which the video begins
    with VideoReader(video) as film:
        measured = 1 / np.median(np.diff(film.times))
        assert ann["media_info"]["length"][str(video)] == pytest.approx(len(film) / measured)
    assert ann["media_info"]["fps"][str(video)] == pytest.approx(measured, rel=1e-3)
    assert datetime.fromisoformat(ann["date"]).astimezone() == first.replace(
        microsecond=first.microsecond // 1000 * 1000
    )


def test_boris_has_the_keys_and_colours_of_the_task_that_is_written(project):
    with Project.open(project) as opened:
        (info,) = opened.demonstrations.infos()
        first = opened.actions.add(info.task, ["grab", "hold, firmly"])
        other = opened.actions.add(f"earlier than {info.task}", ["press", "grab", "turn"])
        opened.actions.add("another", ["press", "turn", "grab"])
    assert other["grab"].look == first["grab"].look
    written = {entry["code"]: entry for entry in boris(project)["behaviors_conf"].values()}
    for action in first:
        assert written[action.name]["key"].lower() == action.key
        assert written[action.name]["color"].lower() == action.colour


def test_boris_is_told_times_at_the_rate_of_the_video(project):
    with Project.open(project) as opened:
        (info,) = opened.demonstrations.infos()
        opened.media.set_video_clock(info.id, ClockMap(-0.4, 1.25))
    observation = boris(project)["observations"][f"{info.name} - Ann"]
    start = observation["events"][0][0]
    assert start - observation["time offset"] == pytest.approx((0.1 + 0.4) / 1.25)


def test_what_boris_cannot_hold_is_refused_and_what_is_alike_is_numbered():
    tracks = [Track("c", (Segment(0.0, 1.0, "grab"),)), Track("b - c", ANN)]
    both = [Observation("a - b", "foam", tracks[0]), Observation("a", "foam", tracks[1])]
    content = json.loads(to_boris("p", both, Vocabulary()))
    assert list(content["observations"]) == ["a - b - c", "a - b - c (2)"]
    live = content["observations"]["a - b - c"]
    assert (live["type"], live["file"], live["description"]) == ("LIVE", {}, "foam")
    assert live["events"] == [[0.0, "", "grab", "", ""], [1.0, "", "grab", "", ""]]
    bad = Observation("a", "", Track("c", (Segment(0.0, 1.0, "grab|hold"),)))
    with pytest.raises(InputError, match=r"holds a '\|', which BORIS"):
        to_boris("p", [bad], Vocabulary())
    ancient = Observation("a", "", tracks[0], begun=datetime(1, 1, 1, tzinfo=timezone.utc))
    content = json.loads(to_boris("p", [ancient], Vocabulary()))
    assert content["observations"]["a - c"]["date"].startswith("0001-01-01T")


def test_of_a_video_that_is_gone_the_rest_is_told(project):
    with Project.open(project) as opened:
        (info,) = opened.demonstrations.infos()
        video = opened.demonstrations.load(info.id).video.path
        video.unlink()
    observation = boris(project)["observations"][f"{info.name} - Ann"]
    assert observation["media_info"]["fps"] == {str(video): 0.0}
    assert len(observation["events"]) == 4


def test_elan_finds_the_video_and_the_times_in_it(project):
    written = export(project, "elan")
    root = ET.parse(written).getroot()
    media = root.find("HEADER/MEDIA_DESCRIPTOR")
    assert (written.parent / media.get("RELATIVE_MEDIA_URL")).is_file()
    assert media.get("TIME_ORIGIN") == "400"
    slots = {s.get("TIME_SLOT_ID"): int(s.get("TIME_VALUE")) for s in root.iter("TIME_SLOT")}
    tiers = {}
    for tier in root.iter("TIER"):
        tiers[tier.get("TIER_ID")] = [
            (slots[a.get("TIME_SLOT_REF1")], slots[a.get("TIME_SLOT_REF2")], a[0].text)
            for a in tier.iter("ALIGNABLE_ANNOTATION")
        ]
    assert tiers == {
        "Ann": [(100, 300, "grab"), (300, 450, "hold, firmly")],
        "Zoe": [(0, 200, "grab")],
    }


def test_elan_offers_the_actions_and_draws_the_forces_that_lie_beside(project):
    with Project.open(project) as opened:
        task = opened.demonstrations.infos()[0].task
        opened.actions.add(task, ["slip"])
        demonstration = opened.demonstrations.load(opened.demonstrations.infos()[0].id)
    files = finish(exporting(project, project.parent / "out", "elan"))
    written, table, series = files
    eaf = pympi.Elan.Eaf(str(written))
    entries = {id_: texts[0][0] for id_, (texts, _) in eaf.get_cv_entries("actions").items()}
    assert list(entries.values()) == ["slip", "grab", "hold, firmly"]
    root = ET.parse(written).getroot()
    for annotation in root.iter("ALIGNABLE_ANNOTATION"):
        assert entries[annotation.get("CVE_REF")] == annotation[0].text
    links = {link["RELATIVE_LINK_URL"]: link for link in eaf.linked_file_descriptors}
    assert list(links) == [f"./{table.name}", f"./{series.name}"]
    source = ET.parse(series).getroot().find("tracksource")
    # ELAN compares the two as texts.
    assert source.get("source-url") == links[f"./{table.name}"].get("LINK_URL")
    assert Path(source.get("source-url").removeprefix("file://")) == table.resolve()
    names = [track.get("name") for track in source.iter("track")]
    assert names == [channel.name for channel in demonstration.channels]
    drawn = np.loadtxt(table, ndmin=2)
    np.testing.assert_allclose(drawn[:, 0], demonstration.times, atol=5e-7)
    for track in source.iter("track"):
        column = int(track.find("sample-position/pos").get("col"))
        signal = demonstration.signals[:, names.index(track.get("name"))]
        np.testing.assert_allclose(drawn[:, column], signal, rtol=1e-5)


def test_elan_gets_no_more_samples_than_it_can_tell_apart(monkeypatch):
    times = np.arange(5000) / 4000
    signals = np.sin(times)[:, None]
    signals[8] = np.nan
    fast = Demonstration("fast", "pen", times, signals, (Channel("f\nz", "N"),))
    stream = io.BytesIO()
    write_time_series(fast, stream)
    rows = np.loadtxt(io.BytesIO(stream.getvalue()))
    np.testing.assert_allclose(rows[:, 0], times[::4], atol=5e-7)
    assert np.flatnonzero(np.isnan(rows[:, 1])).tolist() == [2]
    monkeypatch.setattr(elan, "MOST_SAMPLES", 500)
    stream = io.BytesIO()
    write_time_series(fast, stream)
    assert len(np.loadtxt(io.BytesIO(stream.getvalue()))) == 500


@pytest.fixture
def filmed_twice(project, tmp_path):
    """The project with a second video, which begins 1.25 s after the first one."""
    (film := tmp_path / "left.mp4").write_bytes(b"no film, but one of its own")
    with Project.open(project) as opened:
        (info,) = opened.demonstrations.infos()
        opened.media.attach_video(info.id, film, ClockMap(0.85), "left")
        return [str(video.path) for video in opened.demonstrations.load(info.id).videos]


def test_elan_finds_each_of_several_videos_and_the_times_in_it(project, filmed_twice):
    written = export(project, "elan")
    media = pympi.Elan.Eaf(str(written)).get_linked_files()
    assert [link["TIME_ORIGIN"] for link in media] == ["400", "-850"]
    found = [str((written.parent / link["RELATIVE_MEDIA_URL"]).resolve()) for link in media]
    assert found == filmed_twice


def test_boris_plays_several_videos_beside_each_other(project, filmed_twice):
    with Project.open(project) as opened:
        (info,) = opened.demonstrations.infos()
        opened.media.set_video_clock(info.id, ClockMap(-0.4, 1.25))
    observation = boris(project)["observations"][f"{info.name} - Ann"]
    assert [observation["file"][str(n)] for n in (1, 2, 3)] == [*([f] for f in filmed_twice), []]
    assert observation["time offset"] == -0.4
    # At time t of the first one the second one is at t - 1.
    assert observation["media_info"]["offset"] == {"1": 0.0, "2": 1.0}
    assert set(observation["media_info"]["fps"]) == set(filmed_twice)


@pytest.mark.parametrize(
    ("kind", "segment", "complaint"),
    [
        ("elan", Segment(0.1, 0.1002, "tap"), "'zz last': 'tap' of Ann.* shorter than a millisec"),
        ("elan", Segment(0.1, 0.2, "tap\x01"), "'zz last': .*character that ELAN files cannot"),
        ("audacity", Segment(0.1, 0.2, "ta\tp"), "'zz last': The action 'ta.*tab"),
        ("csv", Segment(0.1, 0.2, "ta\0p"), "'zz last': The name 'ta.*NUL"),
    ],
)
def test_one_demonstration_that_cannot_be_written_is_named_and_none_is(
    project, kind, segment, complaint
):
    with Project.open(project) as opened:
        first = opened.demonstrations.infos()[0].id
        again = replace(opened.demonstrations.load(first), name="zz last", videos=())
        again = replace(again, signals=again.signals + 1.0)
        added = opened.demonstrations.add(again)
        opened.tracks.edit(added.id, "Ann", (), (segment,), "painted")
    with pytest.raises(InputError, match=complaint):
        export(project, kind)
    assert not (project.parent / "out").exists()


def test_a_segment_of_a_millisecond_is_one_for_elan_wherever_it_lies(tmp_path):
    segments = [Segment(k / 2000, (k + 2) / 2000, "tap") for k in range(1, 4000, 2)]
    root = ET.fromstring(to_elan([Track("Ann", tuple(segments))], (), tmp_path))
    times = [int(slot.get("TIME_VALUE")) for slot in root.iter("TIME_SLOT")]
    assert {end - start for start, end in zip(times[::2], times[1::2], strict=True)} == {1}


@pytest.mark.parametrize("kind", ["csv", "table", "elan", "textgrid", "boris", "audacity"])
def test_only_the_tracks_of_those_asked_for(project, kind):
    text = export(project, kind, authors=["Zoe"]).read_text("utf-8")
    assert "grab" in text
    assert "hold" not in text


def test_what_has_no_labels_of_those_asked_for_is_said_so(project):
    with pytest.raises(InputError, match="What was chosen has no labels"):
        export(project, "table", ids=[])


def test_in_an_empty_project_nobody_is_there(tmp_path):
    with Project.create(tmp_path / "new.forcelab") as new:
        path = new.path
    with pytest.raises(InputError, match="'Ben' labelled here; nobody did yet"):
        export(path, "table", authors=["Ben"])


@pytest.mark.parametrize("name", ["pull 7", "Übung – 2, links & schnell", "हिन्दी"])
def test_exported_labels_are_read_again_beside_their_recording(tmp_path, name):
    """Nothing has to be renamed: labels go to whoever has the recordings, and are read there."""
    recording = tmp_path / "out" / f"{name}.csv"
    recording.parent.mkdir()
    recording.write_text("time,fz\n" + "".join(f"{i / 100},{i % 7}\n" for i in range(100)))
    options = ReadOptions(task="foam")
    finish(importing(tmp_path / "here.forcelab", [recording], options))
    with Project.open(tmp_path / "here.forcelab") as project:
        (info,) = project.demonstrations.infos()
        project.tracks.edit(info.id, "Zoe", (), ZOE, "painted")
    assert export(tmp_path / "here.forcelab", "csv").parent == recording.parent
    finish(importing(tmp_path / "there.forcelab", [recording], options))
    with Project.open(tmp_path / "there.forcelab") as project:
        (info,) = project.demonstrations.infos()
        assert project.tracks.get(info.id, "Zoe") == Track("Zoe", ZOE)


def test_files_of_demonstrations_with_the_same_name_are_told_by_their_tasks(tmp_path):
    path = tmp_path / "study.forcelab"
    times = np.arange(100) / 100
    with Project.create(path) as project:
        for i, (name, task) in enumerate([("pull", "foam"), ("Pull", "stylus"), ("push", "foam")]):
            created = Demonstration(name, task, times, times[:, None] + i, (Channel("fz", "N"),))
            project.tracks.edit(project.demonstrations.add(created).id, "Ann", (), ZOE, "painted")
    for kind, endings in (("csv", ".labels.csv"), ("audacity", " - Ann.txt")):
        written = finish(exporting(path, tmp_path / kind, kind))
        names = [f"{name}{endings}" for name in ("foam - pull", "push", "stylus - Pull")]
        assert sorted(file.name for file in written) == names


def test_a_format_is_written_once_it_is_registered(project, tmp_path, monkeypatch):
    count = ExportFormat("Counts", "track", lambda part: b"%d" % len(part.tracks), suffix=".count")
    monkeypatch.setitem(FORMATS, "count", count)
    out = tmp_path / "out"
    assert main(["export", str(project), "--out", str(out), "--format", "count"]) == 0
    assert sorted(path.read_text() for path in out.glob("* - *.count")) == ["1", "1"]
    with pytest.raises(InputError, match="There is no format 'cuont'; did you mean 'count'"):
        export(project, "cuont")


def test_files_that_are_there_are_told_before_the_work(project, monkeypatch):
    made = []
    kind = ExportFormat("Counts", "demonstration", lambda part: made.append(part) or b"1")
    beside = replace(kind, suffix=".count", beside=((".more", lambda _: b"2"),))
    monkeypatch.setitem(FORMATS, "count", beside)
    written = export(project, "count")
    for file in (written, written.with_suffix(".more")):
        file.rename(kept := file.with_suffix(".kept"))
        with pytest.raises(InputError, match="already; choose an empty folder"):
            export(project, "count", replacing=False)
        kept.rename(file)
    assert len(made) == 1
