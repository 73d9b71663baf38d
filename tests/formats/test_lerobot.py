"""LeRobot datasets: an episode is a demonstration, and labels go back as subtasks of its frames."""

import hashlib
import json
import multiprocessing
import os
import random
import re
import shutil
import signal
import sys
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("pyarrow")

import pyarrow as pa
import pyarrow.parquet as pq
from factories import GOP_250, even_frame_times, frame_number, numbered_frame, write_video

from forcelab.cli import main
from forcelab.errors import InputError
from forcelab.formats import identify, lerobot, read
from forcelab.formats.lerobot import preview
from forcelab.formats.recording import ReadOptions, parse_episodes
from forcelab.jobs import finish
from forcelab.labels import Segment
from forcelab.project import Project, files
from forcelab.video.codecs import opencv
from forcelab.video.index import indexing
from forcelab.video.reader import VideoReader
from tests.formats.lerobot_datasets import (
    FEATURES,
    FORCES,
    frames,
    subtasks,
    vectors,
    write_dataset,
    write_table,
)

VERSIONS = ("v2.0", "v2.1", "v3.0")
GRABS = (Segment(0.1, 0.2, "grab"), Segment(0.2, 0.25, "hold"))


def channels(recording):
    return [channel.name for channel in recording.demonstration.channels]


def hashes(folder):
    """What each file below a folder holds."""
    found = sorted(path for path in folder.rglob("*") if path.is_file())
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in found
    }


def imported(folder, *options):
    """A project of a dataset."""
    project = folder.parent / "study.forcelab"
    assert main(["import", str(project), str(folder), *options]) == 0
    return project


def label(project, segments, author="Ann", names=None):
    """Label demonstrations alike, or those of these names."""
    with Project.open(project) as opened:
        for info in opened.demonstrations.infos():
            if names is None or info.name in names:
                old = opened.tracks.get(info.id, author).segments
                opened.tracks.edit(info.id, author, old, segments, "painted")


@pytest.fixture
def folder(tmp_path):
    """A dataset of four episodes."""
    write_dataset(tmp_path / "pen")
    return tmp_path / "pen"


@pytest.fixture
def project(folder):
    """A project of that dataset, labelled by Ann."""
    project = imported(folder)
    label(project, GRABS)
    return project


def export(project, folder, *options):
    return main(["export", str(project), "--format", "lerobot", "--into", str(folder), *options])


def labels_of(number, folder):
    """The subtasks of an episode's frames."""
    own = np.array(frames(folder)["episode_index"]) == number
    return [name for name, chosen in zip(subtasks(folder), own, strict=True) if chosen]


def labels_at(times, segments):
    """What a frame is labelled with, one by one."""
    found = [[s.action for s in segments if s.start <= time < s.end] for time in times]
    return [actions[0] if actions else "unlabelled" for actions in found]


@pytest.mark.parametrize("version", VERSIONS)
def test_an_episode_is_a_demonstration_with_its_task(tmp_path, version):
    written = write_dataset(tmp_path / "pen", version)
    assert identify(tmp_path / "pen").name == "lerobot"
    recordings = read(tmp_path / "pen")
    assert [r.demonstration.name for r in recordings] == ["pen-0", "pen-1", "pen-2", "pen-3"]
    tasks = [r.demonstration.task for r in recordings]
    assert tasks == ["pull the pen", "squeeze the foam"] * 2
    for recording, values in zip(recordings, written, strict=True):
        assert channels(recording) == list(FORCES)
        own = recording.demonstration
        # Stamps of 32 bits, of which there is no telling here, get their digits back.
        np.testing.assert_array_equal(own.times, np.arange(len(own.times)) / 30)
        np.testing.assert_array_equal(own.signals, values["observation.state"])
        assert recording.tracks == ()
    assert "action, next.reward, next.done" in recordings[0].remarks[1]


def test_the_description_stands_for_the_folder(tmp_path):
    write_dataset(tmp_path / "pen")
    named = read(tmp_path / "pen/meta/info.json")
    assert [r.demonstration.id for r in named] == [
        r.demonstration.id for r in read(tmp_path / "pen")
    ]


@pytest.mark.parametrize("name", ["data/chunk-000/file-000.parquet", "meta/tasks.parquet"])
def test_of_a_file_of_a_dataset_it_is_said_to_import_the_dataset(tmp_path, monkeypatch, name):
    write_dataset(tmp_path / "pen")
    folder, _, file = name.rpartition("/")
    monkeypatch.chdir(tmp_path / "pen" / folder)
    sentence = f"'{file}' belongs to the LeRobot dataset '{tmp_path / 'pen'}'; import that folder"
    with pytest.raises(InputError, match=re.escape(sentence)):
        read(file)


def test_a_file_of_a_dataset_is_read_as_a_table_where_that_is_asked_for(tmp_path):
    write_dataset(tmp_path / "pen", per_file=1)
    file = tmp_path / "pen/data/chunk-000/file-000.parquet"
    (recording,) = read(file, ReadOptions(format="parquet"))
    assert recording.demonstration.times.size == 12


def test_signals_are_chosen_by_feature_or_by_number(tmp_path):
    same = FEATURES | {"action": vectors(["fx1", "lift"])}
    written = write_dataset(tmp_path / "pen", features=same)
    options = ReadOptions(signals=("action", "next.done"), leave_out=("observation.state.fy1",))
    (recording, *_) = read(tmp_path / "pen", options)
    # Two numbers are called fx1, and each has its feature's name before its own.
    names = ["observation.state.fx1", "fz1", "action.fx1", "lift", "next.done"]
    assert channels(recording) == names
    signals = recording.demonstration.signals
    np.testing.assert_array_equal(signals[:, 2:4], written[0]["action"])
    np.testing.assert_array_equal(signals[:, 4:], written[0]["next.done"])
    rows = {row.name: (row.use, row.choices) for row in preview(tmp_path / "pen", options)}
    assert rows["action"] == ("signal", ("signal", "left out"))
    assert rows["next.reward"] == ("left out", ("signal", "left out"))
    with pytest.raises(InputError, match="no feature 'grip'; name one of observation.state, act"):
        read(tmp_path / "pen", ReadOptions(signals=("grip",)))


def test_numbers_are_chosen_by_what_their_names_have_in_common(tmp_path):
    arm = vectors(["pan.pos", "pan.vel", "lift.pos"])
    write_dataset(tmp_path / "pen", features=FEATURES | {"action": arm})
    signals = read(tmp_path / "pen", ReadOptions(signals=("pan",)))
    assert channels(signals[0]) == [*FORCES, "pan.pos", "pan.vel"]
    options = ReadOptions(signals=("action",), leave_out=("pan", "observation"))
    assert channels(read(tmp_path / "pen", options)[0]) == ["lift.pos"]


@pytest.mark.parametrize(
    ("added", "names"),
    [
        ({"observation.wrench": {"dtype": "float32", "shape": [2], "names": None}},
         [*FORCES, "observation.wrench.0", "observation.wrench.1"]),
        ({"observation.state": vectors(["a", "b"])}, ["a", "b"]),
        ({"observation.state": {"dtype": "float32", "shape": [2], "names": {"b": 1, "a": 0}}},
         ["a", "b"]),
        ({"observation.state": {"dtype": "float32", "shape": [2], "names": ["a", "a"]}},
         ["observation.state.0", "observation.state.1"]),
        ({"observation.state": {"dtype": "string", "shape": [1], "names": None}},
         ["grip", "lift", "next.reward", "next.done"]),
    ],
    ids=["forces", "observed", "by place", "named twice", "nothing observed"],
)  # fmt: skip
def test_forces_are_read_or_what_is_observed_or_all_numbers(tmp_path, added, names):
    features = FEATURES | added
    numbers = {name: f for name, f in features.items() if f["dtype"] != "string"}
    write_dataset(tmp_path / "pen", features=numbers)
    if len(numbers) < len(features):
        path = tmp_path / "pen/meta/info.json"
        info = json.loads(path.read_text("utf-8"))
        path.write_text(json.dumps({**info, "features": {**features, **info["features"]}}), "utf-8")
    assert channels(read(tmp_path / "pen")[0]) == names


def test_some_episodes_are_chosen_by_number(tmp_path, monkeypatch, capsys):
    write_dataset(tmp_path / "pen", lengths=(5,) * 8)
    project = imported(tmp_path / "pen", "--episodes", "1-3, 6")
    with Project.open(project) as opened:
        names = {info.name for info in opened.demonstrations.infos()}
    assert names == {"pen-1", "pen-2", "pen-3", "pen-6"}
    monkeypatch.setattr(lerobot, "MOST_UNASKED", 5)
    with pytest.raises(InputError, match=r"has 8 episodes, 0 to 7; say which \(--episodes 0-99\)"):
        read(tmp_path / "pen")
    with pytest.raises(InputError, match="has no episode 8; it has 8, 0 to 7"):
        read(tmp_path / "pen", ReadOptions(episodes=(7, 8)))
    for wrong in ("3-1", "a", "1-", "-2", "1.5", "1-2-3", "0-999999,1-999999"):
        with pytest.raises(InputError, match="episodes"):
            parse_episodes(wrong)


def test_only_the_files_of_chosen_episodes_are_opened(tmp_path):
    write_dataset(tmp_path / "pen", lengths=(5,) * 6, per_file=2)
    for number in (0, 2):
        (tmp_path / f"pen/data/chunk-000/file-{number:03d}.parquet").unlink()
    assert len(read(tmp_path / "pen", ReadOptions(episodes=(2, 3)))) == 2


@pytest.mark.parametrize("version", VERSIONS)
def test_labels_go_back_as_the_subtask_of_each_frame(tmp_path, version):
    folder = tmp_path / "pen"
    write_dataset(folder, version)
    before, before_frames = hashes(folder), frames(folder)
    project = imported(folder)
    label(project, GRABS)
    assert export(project, folder) == 0
    times = np.array(before_frames["frame_index"]) / 30
    assert subtasks(folder) == labels_at(times, GRABS)
    # Nothing else changed: no other file, no other column, nothing that files say of themselves.
    after, after_frames = hashes(folder), frames(folder)
    data = {name for name in before if name.startswith("data/")}
    changed = {name for name in after if after[name] != before.get(name)}
    assert changed == data | {"meta/info.json", "meta/subtasks.parquet"}
    assert after_frames.drop(["subtask_index"]).equals(before_frames)
    info = json.loads((folder / "meta/info.json").read_text("utf-8"))
    feature = info["features"].pop("subtask_index")
    assert feature == {"dtype": "int64", "shape": [1], "names": None}
    text = json.dumps(info, indent=4, ensure_ascii=False).encode()
    assert hashlib.sha256(text).hexdigest() == before["meta/info.json"]
    file = pq.ParquetFile(sorted(folder.glob("data/*/*.parquet"))[0])
    assert file.num_row_groups == (3 if version == "v3.0" else 1)
    assert b"subtask_index" in file.schema_arrow.metadata[b"huggingface"]
    # What is read back is what was labelled, to the frame.
    tracks = [track for recording in read(folder) for track in recording.tracks]
    assert [track.author for track in tracks] == ["dataset"] * 4
    assert [s.action for s in tracks[0].segments] == ["grab", "hold"]


def test_a_second_export_changes_only_what_was_labelled_anew(folder):
    project = imported(folder)
    label(project, GRABS, names=["pen-0", "pen-3"])
    assert export(project, folder) == 0
    assert labels_of(1, folder) == ["unlabelled"] * 15
    first, first_labels = hashes(folder), labels_of(0, folder)
    label(project, (Segment(0.0, 9 / 30, "pull"),), names=["pen-2"])
    label(project, (), names=["pen-3"])
    assert export(project, folder) == 0
    assert labels_of(0, folder) == first_labels
    assert labels_of(2, folder) == ["pull"] * 9
    names = pq.read_table(folder / "meta/subtasks.parquet")["subtask"].to_pylist()
    assert names == ["unlabelled", "grab", "hold", "pull"]
    assert export(project, folder, "--demo", "pen-2") == 0
    again = hashes(folder)
    assert {n for n in again if again[n] != first[n]} <= {
        "data/chunk-000/file-000.parquet",
        "data/chunk-000/file-001.parquet",
        "meta/subtasks.parquet",
    }


def test_a_number_without_a_name_gets_no_other_ones(folder, project):
    # Their tools keep the numbers, and not the table.
    assert export(project, folder) == 0
    (folder / "meta/subtasks.parquet").unlink()
    assert not any(recording.tracks for recording in read(folder))
    label(project, (Segment(0.0, 0.2, "pull"),), names=["pen-0"])
    assert export(project, folder, "--demo", "pen-0") == 0
    assert labels_of(0, folder) == ["pull"] * 6 + ["unlabelled"] * 6
    assert labels_of(1, folder) == ["unlabelled"] * 15


def test_the_labels_of_one_coder_are_written(folder, project, capsys):
    label(project, (Segment(0.0, 0.1, "pull"),), author="Zoe")
    before = hashes(folder)
    assert export(project, folder) == 1
    assert "was labelled by Ann, Zoe, and a frame has one subtask; cho" in capsys.readouterr().err
    assert hashes(folder) == before
    assert export(project, folder, "--author", "Zoe") == 0
    assert set(subtasks(folder)) == {"unlabelled", "pull"}


def test_only_episodes_of_the_dataset_are_written(folder, tmp_path, capsys):
    project = imported(folder)
    table = tmp_path / "other.csv"
    table.write_text("t,fx\n" + "".join(f"{i / 100},{i}\n" for i in range(50)), "utf-8")
    assert main(["import", str(project), str(table)]) == 0
    label(project, GRABS)
    # What is of another kind stays away by itself, unless it is asked for.
    assert export(project, folder) == 0
    assert export(project, folder, "--demo", "other") == 1
    assert "'other' is no episode of" in capsys.readouterr().err
    moved = tmp_path / "moved"
    folder.rename(moved)
    assert export(project, moved, "--demo", "pen-1") == 0
    shutil.rmtree(moved)
    write_dataset(moved, lengths=(12, 14))
    assert export(project, moved) == 1
    assert "Nothing that was labelled is an episode of" in capsys.readouterr().err
    moved.rename(folder)
    before = hashes(folder)
    assert export(project, folder) == 1
    sentence = "'pen-0' was imported as pen, episode 0, and no episode of"
    assert sentence in capsys.readouterr().err
    assert hashes(folder) == before


def test_an_episode_is_known_by_its_samples_also_under_another_number(tmp_path):
    folder = tmp_path / "pen"
    write_dataset(folder, lengths=(9, 9))
    project = imported(folder)
    label(project, GRABS, names=["pen-0"])
    file = folder / "data/chunk-000/file-000.parquet"
    table = pq.read_table(file)
    place = table.column_names.index("episode_index")
    others = pa.array(1 - np.array(table["episode_index"]))
    write_table(table.set_column(place, "episode_index", others), file)
    assert export(project, folder) == 0
    assert labels_of(1, folder) == labels_at(np.arange(9) / 30, GRABS)
    assert labels_of(0, folder) == ["unlabelled"] * 9


def test_labels_go_nowhere_but_into_a_dataset_outside_of_projects(folder, tmp_path, capsys):
    project = folder / "study.forcelab"
    assert main(["import", str(project), str(folder)]) == 0
    label(project, GRABS)
    for place, why in (
        (folder, "The project lies in"),
        (tmp_path, "The project lies in"),
        (project, "lies in the project"),
        (tmp_path / "none", "is no LeRobot dataset"),
    ):
        assert export(project, place) == 1
        assert why in capsys.readouterr().err
    changed_info(folder, data_path="x" * 300)
    shutil.move(project, tmp_path / "study.forcelab")
    assert export(tmp_path / "study.forcelab", folder) == 1
    # From Python 3.14 on a path that is too long is one where there is nothing.
    why = "is missing" if sys.version_info >= (3, 14) else "was not changed: File name too long"
    assert why in capsys.readouterr().err
    for options in (["--format", "lerobot", "--out"], ["--format", "csv", "--into"]):
        assert main(["export", str(tmp_path), *options, str(folder)]) == 2


def test_a_folder_that_is_a_link_is_not_written_through(folder, project, tmp_path, capsys):
    elsewhere = (folder / "data").rename(tmp_path / "disk")
    (folder / "data").symlink_to(elsewhere)
    before = hashes(elsewhere)
    assert export(project, folder) == 1
    assert "a link to a folder elsewhere" in capsys.readouterr().err
    assert hashes(elsewhere) == before
    # A file that is a link, as in the cache of the hub, is replaced by one of its own.
    (folder / "data").unlink()
    (folder / "data/chunk-000").mkdir(parents=True)
    for file in elsewhere.glob("*/*"):
        (folder / "data/chunk-000" / file.name).symlink_to(file)
    assert export(project, folder) == 0
    assert hashes(elsewhere) == before
    assert set(subtasks(folder)) == {"unlabelled", "grab", "hold"}


def kill_when(moment):
    """Kill this process at a step of the export."""

    def die(*_):
        os.kill(os.getpid(), signal.SIGKILL)

    real = files._swap
    if moment == "half written":
        pq.ParquetWriter.close = die
    elif moment == "before the swap":
        files._swap = die
    elif moment == "after the swap":
        files._swap = lambda *names: (real(*names), die())
    else:
        os.fsync = die


def _export_and_die(moment, project, folder):
    kill_when(moment)
    export(project, folder)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="forks and kills")
@pytest.mark.parametrize(
    "moment", ["half written", "data written", "before the swap", "after the swap"]
)
def test_killed_at_any_moment_the_old_or_the_new_dataset_is_there(folder, project, moment):
    before = hashes(folder)
    context = multiprocessing.get_context("fork")
    child = context.Process(target=_export_and_die, args=(moment, project, folder))
    child.start()
    child.join()
    assert child.exitcode == -signal.SIGKILL
    if moment == "after the swap":
        assert set(subtasks(folder)) == {"unlabelled", "grab", "hold"}
    else:
        assert hashes(folder) == before
    # What it left is in the way of nothing.
    assert export(project, folder) == 0
    assert len(read(folder)) == 4


def test_on_a_full_disk_the_old_dataset_stays(folder, project, tmp_path, monkeypatch, capsys):
    before = hashes(tmp_path)

    def full(_):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(os, "fsync", full)
    assert export(project, folder) == 1
    assert "was not changed: No space left on device; make room" in capsys.readouterr().err
    assert {name for name in hashes(tmp_path) if name.startswith(("pen", "."))} == {
        name for name in before if name.startswith("pen")
    }
    assert hashes(folder) == {
        name.removeprefix("pen/"): digest
        for name, digest in before.items()
        if name.startswith("pen/")
    }


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_cameras_are_videos_of_the_frames_of_their_episode(tmp_path, version):
    folder, lengths = tmp_path / "pen", (12, 15, 9)
    begins = np.cumsum((4, *lengths))  # no episode has the first pictures
    edges = [(begins[i] / 30, begins[i + 1] / 30) for i in range(3)]
    cameras = {"observation.images.top": edges, "observation.images.side": edges}
    write_dataset(folder, version, lengths=lengths, cameras=cameras)
    if version == "v3.0":
        file = folder / "videos/observation.images.top/chunk-000/file-000.mp4"
        file.parent.mkdir(parents=True)
        write_video(file, "libx264", even_frame_times(40), GOP_250)
    else:
        for number, length in enumerate(lengths):
            file = folder / f"videos/chunk-000/observation.images.top/episode_{number:06d}.mp4"
            file.parent.mkdir(parents=True, exist_ok=True)
            write_video(file, "libx264", even_frame_times(length), GOP_250)
    read_by = ReadOptions(unpack=tmp_path)
    recordings, others = read(folder, read_by), read(folder, read_by)
    for number, (recording, other) in enumerate(zip(recordings, others, strict=True)):
        (video,) = recording.demonstration.videos
        assert video.path != other.demonstration.videos[0].path  # as of another of its name
        assert video.name == "top"
        *_, cut, missing = recording.remarks
        assert cut == "The videos of observation.images.top were cut by episode, as they are."
        assert "no pictures of 'observation.images.side'" in missing
        index = finish(indexing(video.path))
        times = video.clock.to_force(index.times)
        with VideoReader(video.path, index) as reader:
            for frame, time in enumerate(recording.demonstration.times):
                shown = frame_number(reader.frame(int(np.argmin(np.abs(times - time)))))
                assert shown == frame + (begins[number] if version == "v3.0" else 0)
    with pytest.raises(InputError, match="mp4' is missing; copy or download it again"):
        read(folder, replace(read_by, strict=True))
    left = ReadOptions(unpack=tmp_path, leave_out=("observation.images",))
    assert not any(recording.demonstration.videos for recording in read(folder, left))


def test_pictures_beside_the_numbers_become_a_video(tmp_path):
    folder = tmp_path / "pen"
    write_dataset(folder, lengths=(6, 5))
    contents = []
    for number in range(11):
        suffix = ".png" if number < 6 else ".jpg"
        contents.append(opencv().imencode(suffix, numbered_frame(number))[1].tobytes())
    contents[8] = contents[8][:50]
    images = pa.array([{"bytes": content, "path": None} for content in contents])
    file = folder / "data/chunk-000/file-000.parquet"
    write_table(pq.read_table(file).append_column("observation.image", images), file)
    info = json.loads((folder / "meta/info.json").read_text("utf-8"))
    image = {"dtype": "image", "shape": [64, 384, 3], "names": ["height", "width", "channels"]}
    changed_info(folder, features={**info["features"], "observation.image": image})
    whole, cut = read(folder, ReadOptions(unpack=tmp_path))
    for recording, first, missing in ((whole, 0, -1), (cut, 6, 2)):
        (video,) = recording.demonstration.videos
        assert video.name == "image"
        index = finish(indexing(video.path))
        shown = np.delete(recording.demonstration.times, [missing] if missing > 0 else [])
        np.testing.assert_allclose(video.clock.to_force(index.times), shown, atol=1e-6)
        with VideoReader(video.path, index) as reader:
            numbers = [frame_number(reader.frame(i)) for i in range(len(shown))]
        assert numbers == [
            first + i for i in range(len(recording.demonstration.times)) if i != missing
        ]
    assert "'observation.image' has 4 pictures of an episode of 5 frames." in cut.remarks
    uses = {row.name: row.use for row in preview(folder, ReadOptions())}
    assert uses["observation.image"] == "video"
    with pytest.raises(InputError, match="4 pictures of an episode of 5 frames; leave it out"):
        read(folder, ReadOptions(unpack=tmp_path, strict=True))
    table = pq.read_table(file)
    odd = pa.array([1] * len(table), pa.timestamp("ns"))
    write_table(table.set_column(table.num_columns - 1, "observation.image", odd), file)
    sentence = "There are no pictures of 'observation.image': they are not stored as bytes."
    remarks = read(folder, ReadOptions(unpack=tmp_path))[0].remarks
    assert remarks[-1] == sentence
    assert not any("became videos" in remark for remark in remarks)


def changed_info(folder, **changes):
    path = folder / "meta/info.json"
    info = json.loads(path.read_text("utf-8")) | changes
    path.write_text(json.dumps(info), "utf-8")


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"codebase_version": "v1.6"}, "is a LeRobot dataset of version v1.6, and v2.0, v2.1"),
        ({"codebase_version": 3}, "contradicts itself"),
        ({"features": []}, "does not describe a dataset"),
        ({"features": {"a": {"dtype": "float32", "shape": [0]}}}, "contradicts itself"),
        ({"features": {"a": {"dtype": "float32", "shape": [2**30]}}}, "has no numbers to read"),
        ({"fps": 0}, "contradicts itself"),
        ({"data_path": "../other.parquet"}, "keeps files outside of its folder"),
        ({"data_path": "/etc/passwd"}, "keeps files outside of its folder"),
        ({"data_path": "{chunk_index.__class__}"}, "keeps files outside of its folder"),
        ({"data_path": "{secret}/a"}, "keeps files outside of its folder"),
        ({"data_path": "data/none.parquet"}, "none.parquet' is missing"),
        ({"data_path": "meta/info.json"}, "info.json' is not a whole Parquet file"),
    ],
    ids=str,
)
def test_a_description_that_cannot_be_is_one_sentence(tmp_path, changes, sentence):
    write_dataset(tmp_path / "pen")
    changed_info(tmp_path / "pen", **changes)
    with pytest.raises(InputError, match=sentence):
        read(tmp_path / "pen")


def test_a_description_that_is_no_json_is_named_with_its_line(tmp_path):
    write_dataset(tmp_path / "pen")
    info = tmp_path / "pen/meta/info.json"
    info.write_text(info.read_text("utf-8").replace('"fps": 30,', '"fps": 30'), "utf-8")
    with pytest.raises(InputError, match=r"info.json' is not whole JSON \(.*: line 9 column"):
        read(tmp_path / "pen")


def test_two_numbers_of_one_name_are_refused(tmp_path):
    odd = {"a": vectors(["b", "c"]), "a.b": {"dtype": "float32", "shape": [1], "names": None}}
    write_dataset(tmp_path / "pen", features=odd | {"d": vectors(["b", "e"])})
    with pytest.raises(InputError, match="calls two numbers 'a.b'; rename one"):
        read(tmp_path / "pen")


def test_data_that_contradict_the_description_are_one_sentence(tmp_path):
    write_dataset(tmp_path / "pen")
    features = FEATURES | {"observation.state": vectors("abcdef")}
    changed_info(tmp_path / "pen", features=features)
    with pytest.raises(InputError, match="does not hold 6 numbers a frame"):
        read(tmp_path / "pen")
    changed_info(tmp_path / "pen", features={**features, **FEATURES})
    file = tmp_path / "pen/data/chunk-000/file-000.parquet"
    table = pq.read_table(file)
    write_table(table.slice(0, 20), file)
    with pytest.raises(InputError, match="holds 8 frames of episode 1, which should have 15"):
        read(tmp_path / "pen")
    far = pa.array([1e308] * len(table))
    write_table(table.set_column(table.column_names.index("timestamp"), "timestamp", far), file)
    with pytest.raises(InputError, match="without a usable stamp were dropped, and too few"):
        read(tmp_path / "pen")
    write_table(table.drop(["timestamp"]), file)
    with pytest.raises(InputError, match="lacks 'timestamp'"):
        read(tmp_path / "pen")
    file.write_bytes(file.read_bytes()[:-100])
    with pytest.raises(InputError, match="is not a whole Parquet file"):
        read(tmp_path / "pen")


def test_a_subtask_that_has_no_name_is_no_label(folder):
    file = folder / "data/chunk-000/file-000.parquet"
    table = pq.read_table(file)
    numbers = np.full(len(table), -1)
    numbers[3:6], numbers[6:8] = 0, 7
    write_table(table.append_column("subtask_index", pa.array(numbers)), file)
    write_table(
        pa.table({"subtask_index": [0], "subtask": ["grab"]}), folder / "meta/subtasks.parquet"
    )
    (recording, *_) = read(folder, ReadOptions(episodes=(0,)))
    (track,) = recording.tracks
    assert [(s.start, s.end, s.action) for s in track.segments] == [(0.1, 0.2, "grab")]
    assert (
        "Some frames have a subtask_index that meta/subtasks.parquet lacks" in recording.remarks[-1]
    )


def mutated(content, rng):
    """Bytes with some changed, or a part missing or twice."""
    data = bytearray(content)
    for _ in range(rng.choice((1, 2, 8))):
        place = rng.randrange(len(data))
        kind = rng.randrange(4)
        if kind == 0:
            data[place] = rng.randrange(256)
        elif kind == 1:
            data[place] ^= 1 << rng.randrange(8)
        elif kind == 2:
            del data[place : place + rng.randrange(1, 40)]
        else:
            data[place:place] = data[place : place + rng.randrange(1, 40)]
        if not data:
            break
    return bytes(data)


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_mutations_are_read_or_refused_in_a_sentence(tmp_path, version):
    folder = tmp_path / "pen"
    write_dataset(folder, version, lengths=(6, 5))
    rng = random.Random(version)
    whole = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    refused = 0
    for number in range(24):
        path = sorted(whole)[number % len(whole)]
        path.write_bytes(mutated(whole[path], rng))
        try:
            read(folder)
        except InputError as error:
            refused += 1
            assert "\n" not in str(error)
        path.write_bytes(whole[path])
    assert refused > 8
