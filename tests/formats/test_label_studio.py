"""Label Studio: tasks to import there, and what its exports come back as.

The spelling of exports is that of the server's JSON and of label-studio-sdk's converter.
"""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree as ET

import pytest
from factories import cached_project, foam_demonstration, make_filmed_project
from fuzz.text_mutations import mutated_bytes, mutated_json

from forcelab.cli import main
from forcelab.clock import ClockMap
from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.formats.export import exporting
from forcelab.formats.label_files import LabelOptions, LabelSet, read_label_file
from forcelab.formats.label_studio import local_file
from forcelab.formats.samples import Prediction
from forcelab.formats.table_sniff import sniff_layout
from forcelab.jobs import finish
from forcelab.labels import Segment, Track
from forcelab.project import Project

ANN = (Segment(0.1, 0.3, "grab"), Segment(0.3, 0.45, "hold, firmly"))
ZOE = (Segment(0.0, 0.2, "grab"),)
MODEL = "model mlp 3"


@pytest.fixture
def project(tmp_path):
    """A demonstration whose video starts 0.4 s before its forces, labelled by two."""
    tracks = ("Ann", ANN), ("Zoe", ZOE)
    return cached_project(make_filmed_project, tmp_path / "study.forcelab", tracks)


def predictions(project):
    """One of a run that has not kept its probabilities for all of its actions."""
    info = project.demonstrations.infos()[0]
    segments = (Segment(0.0, 0.25, "grab"), Segment(0.25, 0.4, "slip"))
    probabilities = {"grab": 0.875, "slip": float("nan")}
    return {info.id: Prediction(MODEL, segments, lambda a, t: 0 * t + probabilities[a])}


def export(project, kind, out="out"):
    files = finish(exporting(project, project.parent / out, kind, predictions=predictions))
    by_end = {file.name.rpartition(".")[2]: file for file in files}
    return by_end["json"], by_end["xml"], files


def test_demonstrations_without_a_common_channel_are_refused_with_what_to_do(project):
    with Project.open(project) as opened:
        other = Demonstration.from_frame({"t": [0.0, 0.1, 0.2], "angle": [1.0, 2.0, 3.0]}, "b")
        opened.demonstrations.add(other)
    with pytest.raises(InputError, match=r"no channel in common.*export those that have the same"):
        export(project, "label-studio")


def test_forces_are_a_time_series_with_annotations_and_predictions(project):
    tasks, interface, files = export(project, "label-studio")
    (task,) = json.loads(tasks.read_text())
    with Project.open(project) as opened:
        (info,) = opened.demonstrations.infos()
        demonstration = opened.demonstrations.load(info.id)
    root = project.parent  # what the server would be given
    address = unquote(task["data"]["csv"])
    assert address.startswith("/data/local-files/?d=")
    table = root / address.removeprefix("/data/local-files/?d=")
    assert table in files
    view = ET.parse(interface).getroot()
    series = view.find("TimeSeries")
    columns = [column.name for column in sniff_layout(table).columns]
    assert columns == ["time", *(channel.name for channel in demonstration.channels)]
    header = table.read_text().splitlines()[0].split(",")
    assert series.get("timeColumn") == header[0]
    assert [channel.get("column") for channel in series] == header[1:]
    labels = view.find("TimeSeriesLabels")
    assert [label.get("value") for label in labels] == ["grab", "hold, firmly", "slip"]
    for author in (*task["annotations"], *task["predictions"]):
        for region in author["result"]:
            assert (region["from_name"], region["to_name"]) == (labels.get("name"), "forces")
    predicted = task["predictions"][0]
    assert predicted["model_version"] == MODEL
    assert [region.get("score") for region in predicted["result"]] == [0.875, None]
    assert [region["value"]["end"] for region in predicted["result"]] == [0.25, 0.4]


def test_what_we_write_comes_back_by_author_without_predictions(project):
    tasks, _, _ = export(project, "label-studio")
    (labels,) = read_label_file(tasks)
    assert labels.tracks == (Track("Ann", ANN), Track("Zoe", ZOE))
    assert labels.media == {}
    assert labels.remarks == ("2 predictions were left out.",)


def test_a_video_has_labels_on_its_frames(project):
    tasks, interface, _ = export(project, "label-studio-video")
    (task,) = json.loads(tasks.read_text())
    fps = task["data"]["framerate"]
    ranges = [r["value"]["ranges"][0] for r in task["annotations"][0]["result"]]
    # Frame 1 is shown from 0 s on, 0.4 s before the forces begin.
    assert ranges[0]["start"] == round((0.1 + 0.4) * fps) + 1
    assert ranges[0]["end"] == round((0.3 + 0.4) * fps) == ranges[1]["start"] - 1
    video = ET.parse(interface).getroot().find("Video")
    assert (video.get("value"), video.get("frameRate")) == ("$video", "$framerate")
    (labels,) = read_label_file(tasks)
    (file,) = labels.media
    assert unquote(task["data"]["video"]).endswith(f"/{file}")
    for read, written in zip(labels.tracks[0].segments, ANN, strict=True):
        assert read.action == written.action
        assert read.start == pytest.approx(written.start + 0.4, abs=0.5 / fps)
        assert read.end == pytest.approx(written.end + 0.4, abs=0.5 / fps)


@pytest.mark.parametrize("kind", ["label-studio", "label-studio-video"])
def test_labels_that_come_back_change_nothing(project, kind, capsys):
    tasks, _, _ = export(project, kind)
    assert main(["labels", str(project), str(tasks)]) == 0
    assert "2 unchanged" in capsys.readouterr().out


def test_segments_shorter_than_a_frame_keep_one_each(project):
    short = tuple(Segment(0.5 + i / 100, 0.5 + (i + 1) / 100, f"tap {i}") for i in range(4))
    with Project.open(project) as opened:
        (info,) = opened.demonstrations.infos()
        opened.tracks.edit(info.id, "Ann", ANN, ANN + short, "painted")
    tasks, _, _ = export(project, "label-studio-video")
    (task,) = json.loads(tasks.read_text())
    ranges = [r["value"]["ranges"][0] for r in task["annotations"][0]["result"]][-4:]
    assert all(r["start"] <= r["end"] for r in ranges)
    assert all(a["end"] < b["start"] for a, b in pairwise(ranges))


def test_what_label_studio_cannot_show_is_refused(project):
    with Project.open(project) as opened:
        (info,) = opened.demonstrations.infos()
        opened.media.set_video_clock(info.id, ClockMap(0.3))
    with pytest.raises(InputError, match="ends before the video begins; export the forces"):
        export(project, "label-studio-video")
    assert not (project.parent / "out").exists()


@pytest.mark.parametrize(
    ("folder", "project", "address"),
    [
        ("/lab/out", "/lab/a.forcelab", "out/a%20b.csv"),
        ("/lab/x/out", "/lab/a.forcelab", "x/out/a%20b.csv"),
        ("/lab/out", "/lab/x/a.forcelab", "out/a%20b.csv"),
        ("/home/out", "/lab/a.forcelab", None),
    ],
)
def test_addresses_start_from_the_folder_that_holds_both(folder, project, address):
    arguments = Path(folder) / "a b.csv", Path(folder), Path(project)
    if address is not None:
        assert local_file(*arguments) == f"/data/local-files/?d={address}"
    else:
        with pytest.raises(InputError, match="no folder in common"):
            local_file(*arguments)


def test_without_a_video_there_is_no_task(tmp_path):
    path = tmp_path / "study.forcelab"
    with Project.create(path) as project:
        added = project.demonstrations.add(foam_demonstration())
        project.tracks.edit(added.id, "Ann", (), ZOE, "painted")
    with pytest.raises(InputError, match="None of the demonstrations has a video"):
        export(path, "label-studio-video")


def region(start, end, *labels, note=None):
    value = {"start": start, "end": end, "instant": False, "timeserieslabels": list(labels)}
    found = {"id": "a", "type": "timeserieslabels", "origin": "manual", "value": value}
    return found if note is None else {**found, "meta": {"text": [note]}}


def server_task(*annotations, **changes):
    """A task as the server exports it."""
    annotations = [
        {
            "id": i,
            "completed_by": who,
            "was_cancelled": False,
            "updated_at": f"2026-11-27T10:00:0{i}Z",
            "result": result,
        }
        for i, (who, result) in enumerate(annotations)
    ]
    data = {"csv": "/data/upload/3/0a1b2c3d-pull-7.csv"}
    return {"id": 5, "annotations": annotations, "predictions": [], "data": data, **changes}


def read(tmp_path, content, **options):
    path = tmp_path / "project-3-at-2026-11-27.json"
    path.write_text(json.dumps(content))
    return read_label_file(path, LabelOptions(**options))


def test_annotators_of_the_server_are_authors(tmp_path):
    task = server_task(
        (1, [region(0.5, 1.0, "grab"), region(1, 2, "hold", "firm")]),
        ({"id": 2, "email": "zoe@lab.org"}, [region("0.25", "1.5", "grab")]),
    )
    (labels,) = read(tmp_path, [task])
    ann = Track("annotator 1", (Segment(0.5, 1.0, "grab"), Segment(1.0, 2.0, "hold + firm")))
    zoe = Track("zoe@lab.org", (Segment(0.25, 1.5, "grab"),))
    assert labels == LabelSet("pull-7", (ann, zoe))


def test_of_an_author_the_latest_annotation_counts(tmp_path):
    task = server_task((1, [region(0.5, 1.0, "grab")]), (1, [region(0.5, 1.5, "grab")]))
    task["annotations"][0]["updated_at"] = "2026-11-28T10:00:00Z"
    (labels,) = read(tmp_path, [task])
    assert labels.tracks[0].segments == (Segment(0.5, 1.0, "grab"),)
    assert labels.remarks == ("1 earlier annotation was left out.",)


def test_what_an_annotator_added_to_is_the_annotators(tmp_path):
    ours = [region(0.5, 1.0, "grab", note="labelled by Ann")]
    (labels,) = read(tmp_path, [server_task((4, ours))])
    assert [track.author for track in labels.tracks] == ["Ann"]
    (labels,) = read(tmp_path, [server_task((4, [*ours, region(1.0, 2.0, "hold")]))])
    assert [track.author for track in labels.tracks] == ["annotator 4"]


def test_what_is_no_segment_is_left_out_and_counted(tmp_path):
    task = server_task(
        (1, [region(1, 1, "tap"), region(1, 2), *[{"type": "choices", "value": {}}] * 2]),
        (2, [region(0.5, 1.0, "grab")]),
    )
    task["annotations"].append({"was_cancelled": True, "result": [region(1, 2, "grab")]})
    (labels,) = read(tmp_path, task)  # a single task is no list
    assert labels.tracks == (Track("annotator 2", (Segment(0.5, 1.0, "grab"),)),)
    assert labels.remarks == (
        "1 region without length was left out.",
        "1 region without label was left out.",
        "2 results of the type 'choices' were left out.",
        "1 skipped annotation was left out.",
    )


def test_minimal_json_is_a_record_for_each_annotation(tmp_path):
    video = "/data/local-files/?d=films%2Fpull-7.mp4"
    spans = [{"start": 1, "end": 25}, {"start": 51, "end": 51}]
    records = [
        {
            "video": video,
            "fps": "25",
            "id": 1,
            "action": [{"ranges": spans, "timelinelabels": ["grab"]}],
            "annotator": 2,
            "annotation_id": 9,
        },
        {"csv": "pull-8.csv", "action": [{"start": 1, "end": 2, "timeserieslabels": ["hold"]}]},
    ]
    filmed, forces = read(tmp_path, records, author="Kim")
    segments = (Segment(0.0, 1.0, "grab"), Segment(2.0, 2.04, "grab"))
    assert filmed.tracks == (Track("annotator 2", segments),)
    assert (filmed.name, filmed.media) == ("pull-7", {"pull-7.mp4": 0.0})
    assert forces == LabelSet("pull-8", (Track("Kim", (Segment(1.0, 2.0, "hold"),)),))


def test_tasks_without_a_file_are_called_by_their_numbers(tmp_path):
    inline = {"ts": {"time": [0, 1], "fx": [0.0, 0.1]}}
    tasks = [server_task((1, [region(0, i, "a")]), data=inline) for i in (1, 2)]
    assert [labels.name for labels in read(tmp_path, tasks)] == ["task 1", "task 2"]
    (labels,) = read(tmp_path, tasks[:1])
    assert labels.name == "project-3-at-2026-11-27"


@pytest.mark.parametrize(
    ("address", "name"),
    [
        ("/data/upload/3/0a1b2c3d-my%20pull.mp4", "my pull"),
        ("/data/local-files/?d=films/a%2Fmy%20pull.mp4", "my pull"),
        ("https://lab.org/films/my%20pull.mp4?token=3", "my pull"),
        ("s3://films/my pull.mp4", "my pull"),
        ("C:\\films\\my pull.mp4", "my pull"),
    ],
)
def test_addresses_of_any_kind_name_a_demonstration(tmp_path, address, name):
    task = server_task((1, [region(0, 1, "a")]), data={"note": "x", "film": address})
    (labels,) = read(tmp_path, task)
    assert labels.name == name


def timeline(**data):
    value = {"ranges": [{"start": 2, "end": 5}], "timelinelabels": ["grab"]}
    task = server_task((1, [{"type": "timelinelabels", "value": value}]))
    return {**task, "data": {"video": "a.mp4", **data}}


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        ([timeline()], "task 1, .*counts frames, and nothing tells how many .* 'framerate'"),
        ([timeline(fps=0)], "'fps' is 0 where a number of frames a second is expected"),
        ([server_task((1, [region("2026-11-27 10:00", "2026", "a")]))], "no number of seconds"),
        (
            [server_task((1, [region(1592250751951.8, 1592250752e3, "a")]))],
            "951.8, a time since 1970",
        ),
        ([server_task((1, [region(None, 2, "a")]))], "'start' is missing where a number"),
        ([server_task((1, [region(0, 2, "a"), region(1, 3, "b")]))], "1: Segments .* overlap"),
        ([server_task((1, [region(2, 1, "a")]))], "'annotations', 1: A segment must end after"),
        ([server_task()], "holds no label"),
        ([server_task(), 7], "task 2 is 7 where an object is expected"),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_place(tmp_path, content, complaint):
    with pytest.raises(InputError, match=complaint):
        read(tmp_path, content)


def test_broken_files_are_refused_in_a_sentence(tmp_path):
    whole = json.dumps([server_task((1, [region(0.5, 1.0, "grab")])), timeline(fps=25)]).encode()
    path = tmp_path / "a.json"
    for text in (*mutated_bytes(whole, 60), *mutated_json(whole, 100)):
        path.write_bytes(text)
        try:
            read_label_file(path)
        except InputError as error:
            assert "\n" not in str(error)
