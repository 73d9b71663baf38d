"""Project archives: everything comes back, and nothing unsafe is taken."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import stat
import subprocess
import sys
import tracemalloc
import zipfile
from dataclasses import replace
from functools import reduce
from operator import getitem
from pathlib import Path

import numpy as np
import pytest
from factories import folder_in_memory
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.formats import read
from forcelab.formats.archive import (
    LARGEST,
    LARGEST_EDITS,
    LARGEST_TEXT,
    VERSION,
    read_archive,
    sniff,
    write_archive,
)
from forcelab.formats.importing import import_files
from forcelab.formats.recording import ReadOptions
from forcelab.labels import Segment, Track
from forcelab.project import LabelsUsed, NewDemonstration, Origin, Project, Provenance, Verdict
from forcelab.segment_edits import erase, paint

GRAB = (Segment(0.0, 0.1, "grab"),)
HOLD = (Segment(0.0, 0.1, "grab"), Segment(1 / 3, 0.7, "höld"))


@pytest.fixture
def tmp_path():
    with folder_in_memory() as folder:
        yield folder


def demonstration(seed: int, name: str = "", **more: object) -> Demonstration:
    random = np.random.default_rng(seed)
    times = np.cumsum(random.uniform(0.001, 0.002, 50))
    channels = (Channel("fx", "N"), Channel("Kraft °", ""))
    signals = random.normal(size=(50, 2))
    signals[3, 0] = np.inf
    return Demonstration(name or f"n{seed}", "LEGO", times, signals, channels, **more)  # type: ignore[arg-type]


def everything(project: Project) -> dict[str, object]:
    """All that a project tells, with its arrays and files."""
    infos = project.demonstrations.infos()
    demonstrations = [project.demonstrations.load(info.id) for info in infos]
    return {
        "infos": infos,
        "arrays": [(d.times.tobytes(), d.signals.tobytes()) for d in demonstrations],
        "videos": [
            [(v.name, v.path.read_bytes(), v.clock) for v in d.videos] for d in demonstrations
        ],
        "authors": project.coding.authors(),
        "tracks": [project.tracks.of(info.id) for info in infos],
        "edits": [project.tracks.history(i.id, author) for i in infos for author in i.authors],
        "vocabularies": project.actions.vocabularies(),
        "recognisers": project.runs.recognisers(),
        "files": [
            project.runs.recogniser_path(r.id).read_bytes() for r in project.runs.recognisers()
        ],
        "runs": project.runs.all(),
        "assignments": project.coding.assignment_events(),
        "verdicts": project.coding.verdict_events(),
        "notes": project.coding.note_events(),
        "origins": [project.tracks.origins(i.id, author) for i in infos for author in i.authors],
    }


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    """A folder with a project with one of everything, its videos, and an archive of it."""
    folder = tmp_path_factory.mktemp("prepared")
    films = [folder / "film.mp4", folder / "left.mp4"]
    for film in films:
        film.write_bytes(os.urandom(5000))
    with Project.create(folder / "study.forcelab") as project:
        videos = (
            VideoReference(films[0], ClockMap(-0.1, 1.00001)),
            VideoReference(films[1], ClockMap(0.2), "left"),
            VideoReference(films[0], ClockMap(), "the same, höher"),
        )
        id_ = project.demonstrations.add(
            demonstration(1, videos=videos), [Track("anna", HOLD)], "a.csv"
        ).id
        other = project.demonstrations.add(demonstration(2, grid_rate=250.0)).id
        project.tracks.edit(id_, "mlp 1", (), GRAB, "predicted", kind="predict")
        project.tracks.edit(id_, "anna", HOLD, GRAB, "höld erased")
        project.tracks.undo(id_, "anna")
        project.tracks.edit(other, "bert", (), GRAB, "grab painted")
        project.tracks.undo(other, "bert")
        project.tracks.redo(other, "bert")
        project.tracks.edit(other, "cleo", (), HOLD, "accepted", proposed_by="model mlp 1")
        project.actions.set_vocabulary(
            "LEGO", project.actions.vocabulary("LEGO").rebound("grab", "q")
        )
        project.coding.assign(other, "anna")
        project.coding.assign(id_, "cäcilie", blind=False)
        project.coding.set_done(other, "anna")
        created = Provenance(
            settings={"p": 5, "merge": {"grap": "grab"}},
            seed=3,
            labels=[
                LabelsUsed(id_, "anna", project.tracks.head(id_, "anna")),
                LabelsUsed(other, "anna", 0),
            ],
            versions={"numpy": "2.4"},
        )
        project.runs.add_recogniser("mlp 1", b"opaque", created)
        project.runs.add("evaluate", created, result={"accuracy": 0.72, "edit": float("nan")})
        verdict = Verdict(
            id_, 0.1, 1 / 3, "hold", None, author="bert", coder="anna", verdict="model", run=1
        )
        project.coding.add_verdict(verdict)
        project.coding.add_verdict(
            replace(verdict, verdict="withdrawn", run=None, predicted="höld")
        )
        for text in ("slipped at 3,2 s", "ausgelassen: höld", ""):
            project.coding.set_note(id_, "cäcilie", text)
        project.coding.set_note(id_, "anna", "second try")
        write_archive(project, folder / "study.zip")
    return folder


@pytest.fixture
def project(prepared, tmp_path):
    """That project; a test may change it."""
    shutil.copytree(prepared, tmp_path, dirs_exist_ok=True)
    with Project.open(tmp_path / "study.forcelab") as project:
        yield project


@pytest.fixture
def whole(prepared, tmp_path):
    """That archive."""
    return Path(shutil.copy(prepared / "study.zip", tmp_path))


def repack(path: Path, **members: object) -> Path:
    """An archive packed again with some members replaced, or left out where they are None."""
    with zipfile.ZipFile(path) as old:
        content = {info: old.read(info) for info in old.infolist()}
    target = path.with_name("changed.zip")
    with zipfile.ZipFile(target, "w") as new:
        for info, data in content.items():
            value = members.pop(info.filename, data)
            if value is not None:
                new.writestr(info, value if isinstance(value, bytes) else json.dumps(value))
        for name, value in members.items():
            new.writestr(name, value)
    return target


def of_version(path: Path, version: int, **members: object) -> Path:
    """An archive as versions before 4 were, when a demonstration had one video at most."""
    manifest = {"format": "forcelab archive", "version": version}
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
    for name in (name for name in names if name.endswith("/demonstration.json")):
        record = load_member(path, name)
        first, *others = record.pop("videos") or [None]  # type: ignore[attr-defined]
        members[name] = {**record, "video": first and {**first, "name": "unknown then"}}  # type: ignore[dict-item]
        gone = {video["file"] for video in others} - {first and first["file"]}
        members |= {name.replace("demonstration.json", file): None for file in gone}
    return repack(path, **members, **{"forcelab.json": manifest})


def member(path: Path, ending: str) -> str:
    with zipfile.ZipFile(path) as archive:
        return next(name for name in archive.namelist() if name.endswith(ending))


def load_member(path: Path, name: str) -> object:
    with zipfile.ZipFile(path) as old:
        return json.loads(old.read(name))


def refusal_of(path: Path, tmp_path: Path) -> str:
    """The one sentence with which an archive is refused, nothing being left behind."""
    target = tmp_path / "into" / "new.forcelab"
    target.parent.mkdir(exist_ok=True)
    before = sorted(p for p in tmp_path.rglob("*") if not p.is_relative_to(target.parent))
    with pytest.raises(InputError) as caught:
        read_archive(path, target)
    sentence = str(caught.value)
    assert list(target.parent.iterdir()) == []
    assert sorted(p for p in tmp_path.rglob("*") if not p.is_relative_to(target.parent)) == before
    assert "\n" not in sentence
    assert sentence.endswith(".")
    assert not re.search(r"\. [A-Z]", sentence)
    return sentence


def test_an_archive_brings_everything_back(project, whole, tmp_path):
    expected = everything(project)
    assert len(expected["edits"]) == 4  # type: ignore[arg-type]
    assert expected["origins"][-1] == {s: Origin("model mlp 1") for s in HOLD}  # type: ignore[index]
    with read_archive(whole, tmp_path / "copy.forcelab") as copy:
        output = everything(copy)
        runs, copies = expected.pop("runs"), output.pop("runs")
        assert output == expected
        assert repr(copies) == repr(runs)  # NaN is not equal to itself
        video = copy.demonstrations.load("n1").video
        assert video is not None
        assert video.path.is_relative_to(tmp_path / "copy.forcelab")
        write_archive(copy, tmp_path / "again.zip")
        bert = copy.demonstrations.load("n2").id
        assert copy.tracks.redo(bert, "bert") is None
        assert copy.tracks.undo(bert, "bert") is not None
        assert copy.tracks.redo(copy.demonstrations.load("n1").id, "anna") is not None
    assert (tmp_path / "again.zip").read_bytes() == whole.read_bytes()


@given(
    st.lists(
        st.tuples(
            st.sampled_from(
                ["paint", "erase", "accept", "undo", "redo", "predict", "import", "judge"]
            ),
            st.integers(0, 2),
            st.sampled_from(["anna", "bert"]),
            st.floats(0, 0.5),
            st.floats(0.01, 0.5),
        ),
        max_size=25,
    ),
    st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), min_size=1).filter(
        str.strip
    ),
)
@settings(max_examples=10, deadline=None)
def test_export_import_export_gives_the_same_bytes(steps, name):
    with folder_in_memory() as root:
        with Project.create(root / "one") as project:
            ids = [
                project.demonstrations.add(demonstration(seed, f"{name} {seed}")).id
                for seed in range(3)
            ]
            for verb, which, author, start, length in steps:
                id_, who = ids[which], f"model of {author}" if verb == "predict" else author
                track = project.tracks.get(id_, who).segments
                if verb == "import":
                    segments = (Segment(start, start + length, name),)
                    d = demonstration(which, f"{name} {which}")
                    project.demonstrations.add(d, [Track(author, segments)])
                elif verb == "undo":
                    project.tracks.undo(id_, author)
                elif verb == "redo":
                    project.tracks.redo(id_, author)
                elif verb == "judge":
                    people = {"author": "Bo", "coder": author, "verdict": "ambiguous"}
                    result = Verdict(id_, start, start + length, name, None, **people)
                    project.coding.add_verdict(result)
                else:
                    paints = verb != "erase"
                    action = (name,) if paints else ()
                    after = (paint if paints else erase)(track, start, start + length, *action)
                    kind = "predict" if verb == "predict" else "paint"
                    by = "model x" if verb == "accept" else None
                    project.tracks.edit(id_, who, track, after, verb, kind=kind, proposed_by=by)
            output = everything(project)
            write_archive(project, root / "one.zip")
        with read_archive(root / "one.zip", root / "two") as copy:
            write_archive(copy, root / "two.zip")
            assert everything(copy)["origins"] == output["origins"]
        assert (root / "two.zip").read_bytes() == (root / "one.zip").read_bytes()


def test_what_runs_found_is_held_one_after_the_other(project, tmp_path, peak_memory):
    created = Provenance(settings={}, seed=None, labels=[], versions={})
    for number in range(4):
        project.runs.add("evaluate", created, result={"told": f"{number}\n" * 500_000})
    _, peak = peak_memory(lambda: write_archive(project, tmp_path / "first.zip"))
    assert peak < 14e6  # the text of all four alone is 6 MB, and was there in six copies
    with zipfile.ZipFile(tmp_path / "first.zip") as archive:
        text = archive.read("runs.json").decode()
    runs = json.loads(text)
    assert text == json.dumps(runs, ensure_ascii=False, indent=1) + "\n"
    assert [run["result"] for run in runs[-4:]] == [run.result for run in project.runs.all()[-4:]]
    tracemalloc.start()
    with read_archive(tmp_path / "first.zip", tmp_path / "again") as again:
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert [run.result for run in again.runs.all()] == [
            run.result for run in project.runs.all()
        ]
    assert peak < 16e6  # all four at once took 22 MB
    with Project.create(tmp_path / "empty.forcelab") as empty:
        write_archive(empty, tmp_path / "empty.zip")
    with zipfile.ZipFile(tmp_path / "empty.zip") as archive:
        assert archive.read("runs.json") == b"[]\n"


@pytest.mark.parametrize("indent", [None, 0, 1, 2])
def test_however_a_list_is_laid_out_it_is_read(whole, tmp_path, indent):
    (run,) = load_member(whole, "runs.json")  # type: ignore[misc]
    runs = [run | {"result": {"a": f" }}{n}", "b": [{"c": {}}]}} for n in range(2)]
    members = {"runs.json": json.dumps(runs, indent=indent).encode()}
    with read_archive(repack(whole, **members), tmp_path / "read") as project:
        assert [run.result for run in project.runs.all()] == [run["result"] for run in runs]


@pytest.mark.parametrize(
    "spoil",
    [
        lambda _: "{}",
        lambda _: "",
        lambda text: text[1:],
        lambda text: text[:-1],
        lambda text: text + "]",
        lambda text: text.replace("\n },\n", "\n }\n"),
        lambda text: text.replace("\n }\n", "\n },\n"),
        lambda text: text.replace('"seed": 3', '"seed": three'),
    ],
)
def test_a_list_that_is_none_is_refused(whole, tmp_path, spoil):
    text = json.dumps(2 * load_member(whole, "runs.json"), indent=1)  # type: ignore[operator]
    output = refusal_of(repack(whole, **{"runs.json": spoil(text).encode()}), tmp_path)
    assert "'runs.json'" in output
    assert "no valid JSON list" in output


def test_an_archive_is_known_by_its_content(whole, tmp_path):
    head = whole.read_bytes()[:64]
    renamed = whole.rename(tmp_path / "study.csv")
    assert sniff(renamed, head)
    again = repack(renamed, **{"forcelab.json": None})
    assert not sniff(again, again.read_bytes()[:64])
    manifest = json.dumps({"format": "forcelab archive", "version": 1})
    last = repack(again, **{"forcelab.json": manifest})
    assert sniff(last, last.read_bytes()[:64])
    read_archive(repack(renamed), tmp_path / "fine").close()
    assert not sniff(renamed, b"")
    cut = tmp_path / "cut.zip"
    cut.write_bytes(b"PK\x03\x04" + bytes(100))
    assert not sniff(cut, cut.read_bytes())


def test_the_labels_of_coders_are_read_and_predictions_left(prepared, whole, tmp_path):
    unpack = tmp_path / "unpack"
    unpack.mkdir()
    recordings = read(whole, ReadOptions(task="x", unpack=unpack))
    first, second = sorted(recordings, key=lambda r: r.demonstration.name)
    assert [track.author for track in first.tracks] == ["anna"]
    assert first.tracks[0].segments == HOLD
    assert second.tracks == (Track("bert", GRAB), Track("cleo", HOLD))
    (remark,) = {first.not_imported, second.not_imported}
    assert "models' predictions" in remark
    assert (first.demonstration.task, second.demonstration.grid_rate) == ("LEGO", 250.0)
    with Project.create(tmp_path / "other.forcelab") as other:
        added = other.demonstrations.add(first.demonstration, first.tracks)
        assert other.demonstrations.load(added.id).id == first.demonstration.id
        video = other.demonstrations.load(added.id).video
        assert video is not None
        assert video.path.read_bytes() == (prepared / "film.mp4").read_bytes()


def test_a_video_that_nobody_has_a_place_for_stays_in_the_archive(whole):
    assert all(r.demonstration.video is None for r in read(whole, ReadOptions()))


def test_an_archive_of_version_3_has_one_video(project, whole, tmp_path):
    first = project.demonstrations.load("n1").video
    with read_archive(of_version(whole, 3), tmp_path / "copy.forcelab") as copy:
        (video,) = copy.demonstrations.load("n1").videos
        assert (video.name, video.clock) == ("video 1", first.clock)
        assert video.path.read_bytes() == first.path.read_bytes()
        assert copy.demonstrations.load("n2").videos == ()


def test_an_archive_of_version_1_knows_no_assignments(whole, tmp_path):
    old = of_version(whole, 1, **{"assignments.json": None, "verdicts.json": None})
    with read_archive(old, tmp_path / "copy.forcelab") as copy:
        assert len(copy.demonstrations.infos()) == 2
        assert copy.coding.assignments() == ()


def test_a_program_that_knows_no_notes_reads_the_archive_as_before(project, whole, tmp_path):
    with zipfile.ZipFile(whole) as archive:
        members = archive.namelist()
    assert not [member for member in members if "note" in member]
    assert load_member(whole, "forcelab.json") == {"format": "forcelab archive", "version": 4}
    plain = tmp_path / "plain.zip"
    with Project.create(tmp_path / "plain.forcelab") as other:
        other.demonstrations.add(demonstration(1))
        write_archive(other, plain)
    record = load_member(plain, member(plain, "demonstration.json"))
    assert "notes" not in record  # type: ignore[operator]
    with read_archive(plain, tmp_path / "read.forcelab") as older:
        assert older.coding.note_events() == ()


def test_notes_come_along_into_a_project_that_is_there(project, whole, tmp_path):
    with Project.create(tmp_path / "other.forcelab") as other:
        other.demonstrations.add(demonstration(1))
        id_ = other.demonstrations.infos()[0].id
        other.coding.set_note(id_, "anna", "third try")  # later than that of the archive
    for status in ("updated", "unchanged"):
        report = import_files(tmp_path / "other.forcelab", [whole])
        statuses = {item.added.name: item.added.status for item in report.demonstrations}
        assert statuses["n1"] == status
    with Project.open(tmp_path / "other.forcelab") as other:
        (note,) = other.coding.notes()
        assert (note.author, note.text) == ("anna", "third try")
        assert len(other.coding.note_events(id_)) == len(project.coding.note_events(id_)) + 1


def test_an_archive_of_version_2_knows_neither_verdicts_nor_who_proposed(whole, tmp_path):
    edits = load_member(whole, "edits.json")
    for edit in edits:  # type: ignore[attr-defined]
        del edit["proposed_by"]
    newer = repack(whole, **{"edits.json": edits})
    assert "'proposed_by' is missing" in refusal_of(newer, tmp_path)
    old = of_version(whole, 2, **{"edits.json": edits, "verdicts.json": None})
    with read_archive(old, tmp_path / "copy.forcelab") as copy:
        id_ = copy.demonstrations.load("n2").id
        assert copy.tracks.get(id_, "cleo").segments == HOLD
        assert copy.tracks.origins(id_, "cleo") == {}
        assert copy.coding.verdict_events() == ()
        assert len(copy.coding.assignments()) == 2


def test_runs_name_the_same_edits_where_these_get_other_numbers(project, whole, tmp_path):
    edits, runs, recognisers = (
        load_member(whole, f"{name}.json") for name in ("edits", "runs", "recognisers")
    )
    for edit in edits:  # type: ignore[attr-defined]
        edit["id"] += 40
        edit["reverts"] = edit["reverts"] and edit["reverts"] + 40
    for thing in (*runs, *recognisers):  # type: ignore[misc]
        thing["labels"][0]["edit"] += 40
    members = {"edits.json": edits, "runs.json": runs, "recognisers.json": recognisers}
    with read_archive(repack(whole, **members), tmp_path / "copy.forcelab") as copy:
        assert copy.runs.all()[0].labels == project.runs.all()[0].labels
        assert copy.runs.recognisers() == project.runs.recognisers()
    runs[0]["labels"][0]["edit"] = 99  # type: ignore[index]
    assert "edit 99" in refusal_of(repack(whole, **{"runs.json": runs}), tmp_path)


def test_an_archive_goes_only_where_nothing_is(project, whole):
    with pytest.raises(InputError, match="not empty"):
        read_archive(whole, project.path)
    assert project.demonstrations.load("n1").task == "LEGO"


EVIL = [
    "../evil.json",
    "demonstrations/../../evil.json",
    "/evil.json",
    "C:\\evil.json",
    "C:/evil.json",
    "demonstrations\\evil.json",
    "demonstrations/" + "a" * 32 + "/../evil.npy",
    "demonstrations/" + "A" * 32 + "/times.npy",
    "recognisers/x.skops",
    "forcelab.json\0.txt",
    "forcelab.json/",
    "project.sqlite",
    "edits.json\n",
]


@pytest.mark.parametrize("name", EVIL)
def test_a_member_that_does_not_belong_is_refused_by_name(whole, tmp_path, name):
    # zipfile cleans the names that it writes, so the name is put in afterwards.
    placeholder = "~" * len(name)
    path = repack(whole, **{placeholder: b"evil"})
    path.write_bytes(path.read_bytes().replace(placeholder.encode(), name.encode()))
    assert repr(name) in refusal_of(path, tmp_path)
    with pytest.raises(InputError, match="refused"):
        read(path, ReadOptions())


def test_links_copies_and_secrets_are_refused_by_name(whole, tmp_path):
    link = zipfile.ZipInfo("recognisers/" + "0" * 32 + ".skops")
    link.create_system, link.external_attr = 3, (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(whole, "a") as out:
        out.writestr(link, "/etc/passwd")
    assert "is a link" in refusal_of(whole, tmp_path)
    path = repack(whole, **{link.filename: None})
    with zipfile.ZipFile(path, "a") as out, pytest.warns(UserWarning, match="Duplicate"):
        out.writestr("runs.json", "[]")
    assert "'runs.json' is there twice" in refusal_of(path, tmp_path)


def test_an_encrypted_member_is_refused(whole, tmp_path):
    data = bytearray(whole.read_bytes())
    at = data.rindex(b"PK\x01\x02")
    data[at + 8] |= 1
    whole.write_bytes(data)
    assert "encrypted" in refusal_of(whole, tmp_path)


def test_a_bomb_is_refused_before_it_goes_off(whole, tmp_path):
    name = member(whole, "signals.npy")
    path = repack(whole, **{name: None})
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as out:
        out.writestr(name, bytes(LARGEST + 1))
    assert "claim to unpack to" in refusal_of(path, tmp_path)


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("verdicts.json", b"[" + b" " * LARGEST_TEXT + b"]", "bytes of text"),
        ("edits.json", b"[" + b" " * LARGEST_EDITS + b"]", "bytes of text"),
        (
            "runs.json",
            b"[" + (b"[" * 1023 + b"\n") * (LARGEST_TEXT // 1024 + 9),
            "an entry of more than 32 MiB",
        ),
    ],
)
def test_text_that_means_gigabytes_when_parsed_is_refused(whole, tmp_path, name, text, why):
    path = repack(whole, **{name: None})
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as out:
        out.writestr(name, text)
    assert why in refusal_of(path, tmp_path)


ACTION = {"name": "a", "colour": "#0072b2", "key": "", "texture": 0}
#: What cannot stand in a member, by the way to its place; and words of the refusal.
WRONG = {
    "demonstration.json": [
        ("videos 0 name", "left", "has two videos called 'left'"),
        ("videos 0 name", None, "'name' is missing or wrong"),
        ("videos 0 name", 2000 * "x", "is longer than"),
        ("videos 0 file", "../../film.mp4", "lacks 'demonstrations/"),
        ("videos 0 file", "signals.npy", "does not match its name"),
        ("videos 0 offset", "soon", "'offset' is missing or wrong"),
        ("videos 0 offset", 10**400, "too large"),
        ("videos 0 rate", 0, "positive rate"),
        ("videos", {}, "'videos' is missing or wrong"),
        ("videos", [], "for no use"),
        ("videos", [{"file": "film.mp4"}] * 101, "more than 100 videos"),
        ("notes 0 author", " ", "needs an author"),
        ("notes 0 author", None, "'author' is missing or wrong"),
        ("notes 0 text", 3, "'text' is missing or wrong"),
        ("notes 0 time", "2026-01-01", "has no time zone"),
        ("notes", None, "demonstration.json"),
        ("notes", {}, "demonstration.json"),
        ("notes", [3], "demonstration.json"),
    ],
    "assignments.json": [
        ("0 kind", "lost", "'lost' is nothing that befalls an assignment"),
        ("0 kind", "reopened", "never assigned to 'anna'"),
        ("0 demonstration", "0" * 32, "is named but missing in 'assignments.json'"),
        ("0 time", "2026-01-01", "has no time zone in 'assignments.json'"),
        ("1 author", " ", "needs an author"),
    ],
    "verdicts.json": [
        ("0 verdict", "maybe", "'maybe' is no verdict in 'verdicts.json'"),
        ("0 demonstration", "0" * 32, "is named but missing in 'verdicts.json'"),
        ("0 run", 2, "The run 2 is named but missing in 'verdicts.json'"),
        ("0 run", 0, "The run 0 is named but missing"),
        ("0 run", True, "'run' is missing or wrong"),
        ("0 time", "2026-01-01", "has no time zone in 'verdicts.json'"),
        ("0 author", " ", "needs an author"),
        ("0 coder", None, "'coder' is missing or wrong"),
        ("0 end", 0.1, "must last some time"),
        ("0 start", float("nan"), "must last some time"),
        ("0 start", 10**400, "too large"),
        ("0 human", 3, "'human' is missing or wrong"),
        ("0 predicted", "", "use None for unlabelled"),
    ],
    "vocabularies.json": [
        ("LEGO", [ACTION | {"name": f"{i}"} for i in range(20_000)], "up to 1,000 actions, not"),
        ("LEGO", [ACTION | {"name": "a\0b"}], "is no name for an action"),
        ("", {f"task {i}": [] for i in range(5000)}, "5,000 tasks"),
    ],
    "edits.json": [
        ("0 time", "0001-01-01T00:00:00+00:00", "of the year 1 "),
        ("0 time", "9999-12-31T23:59:59-23:59", "of the year 9999 "),
        ("0 time", "yesterday", ""),
        ("0 time", "2026-01-01T00:00:00", ""),
        ("0 inserted", [[0.0, 0.1, "a\0b"]], "is no name for an action"),
        ("0 inserted", [[0.0, 0.1, "x" * 1001]], "is no name for an action"),
        ("0 inserted", [[0.0, 234_466.6, "grab"]], "lies beyond its recording"),
        ("0 inserted", [[-50.0, 0.1, "grab"]], "lies beyond its recording"),
        ("0 inserted", [[1, 0, "x"]], ""),
        ("0 inserted", [["a", 1, "x"]], ""),
        ("0 inserted", [[0, 10**400, "x"]], ""),
        ("0 inserted", [[0, float("inf"), "x"]], ""),
        ("0 inserted", [[0.0, 1.0, "\ud800"]], ""),
        ("0 inserted", [[0.0, 0.2, "other"]], ""),
        ("0 removed", [[0, 1, "x"]], ""),
        ("0 position", 10**30, ""),
        ("0 position", -1, ""),
        ("0 position", True, ""),
        ("0 author", "a\0b", "'author' holds a NUL"),
        ("0 author", "", ""),
        ("0 kind", "invented", ""),
        ("0 kind", "undo", ""),
        ("0 demonstration", "0" * 32, ""),
        ("0 reverts", 1, ""),
        ("0 what", 3, ""),
        ("0 proposed_by", 3, ""),
        ("0 proposed_by", " ", ""),
        ("0 proposed_by", "model x", ""),  # of an import
    ],
    "tracks.json": [("0 segments", [[0.5, 0.6, "slip"]], "do not lead to")],
}


@pytest.mark.parametrize("kind", WRONG)
def test_what_cannot_stand_in_a_member_is_refused(whole, tmp_path, kind):
    with zipfile.ZipFile(whole) as archive:  # of several of that kind the one that holds most
        names = [name for name in archive.namelist() if name.endswith(kind)]
        name = max(names, key=lambda name: archive.getinfo(name).file_size)
    for way, value, why in WRONG[kind]:
        content = {"": load_member(whole, name)}
        *steps, last = [int(step) if step.isdigit() else step for step in ("", *way.split())]
        reduce(getitem, steps, content)[last] = value
        sentence = refusal_of(repack(whole, **{name: content[""]}), tmp_path)
        assert why in sentence, (way, value)


def test_labels_beyond_the_recording_do_not_come_into_a_project_that_is_there(whole):
    name = member(whole, "tracks.json")
    tracks = load_member(whole, name)
    tracks[-1]["segments"] = [[0.0, 234_466.6, "grab"]]
    with pytest.raises(InputError, match="lies beyond its recording"):
        read(repack(whole, **{name: tracks}), ReadOptions())


def test_a_member_longer_than_it_claims_is_refused(whole, tmp_path):
    path = repack(whole)
    data = bytearray(path.read_bytes())
    at = data.rindex(b"PK\x01\x02", 0, data.index(b"vocabularies.json", data.index(b"PK\x01\x02")))
    data[at + 24 : at + 28] = (5).to_bytes(4, "little")
    path.write_bytes(data)
    assert "damaged" in refusal_of(path, tmp_path)


def test_an_array_that_claims_to_be_huge_takes_no_memory(whole, tmp_path):
    stream = io.BytesIO()
    header = {"descr": "<f8", "fortran_order": False, "shape": (10**15, 2)}
    np.lib.format.write_array_header_1_0(stream, header)
    name = member(whole, "signals.npy")
    path = repack(whole, **{name: stream.getvalue()})
    assert "no array of 64-bit numbers" in refusal_of(path, tmp_path)


def test_an_array_of_objects_is_not_unpickled(whole, tmp_path):
    stream = io.BytesIO()
    np.save(stream, np.array([print], dtype=object), allow_pickle=True)
    name = member(whole, "times.npy")
    path = repack(whole, **{name: stream.getvalue()})
    assert "no array of 64-bit numbers" in refusal_of(path, tmp_path)


def test_a_newer_archive_is_refused(whole, tmp_path):
    manifest = {"format": "forcelab archive", "version": VERSION + 1}
    assert "newer forcelab" in refusal_of(repack(whole, **{"forcelab.json": manifest}), tmp_path)


def test_a_missing_member_is_named(whole, tmp_path):
    with zipfile.ZipFile(whole) as old:
        names = [n for n in old.namelist() if n != "forcelab.json"]
    for name in names:
        assert name in refusal_of(repack(whole, **{name: None}), tmp_path)
    nameless = repack(whole, **{"forcelab.json": None})
    assert "not a forcelab archive" in refusal_of(nameless, tmp_path)
    spare = "recognisers/" + "0" * 32 + ".skops"
    assert spare in refusal_of(repack(whole, **{spare: b"x"}), tmp_path)


def test_content_that_does_not_match_its_id_is_refused(whole, tmp_path):
    with zipfile.ZipFile(whole) as old:
        content = {n: old.read(n) for n in old.namelist()}
    for name, data in content.items():
        if not name.endswith(".json"):
            changed = bytearray(data)
            changed[-min(8, len(data))] ^= 1  # the lowest byte of a number
            path = repack(whole, **{name: bytes(changed)})
            assert "does not match" in refusal_of(path, tmp_path)


def test_json_that_is_not_what_it_should_be_is_refused_wherever_it_is(whole, tmp_path):
    with zipfile.ZipFile(whole) as old:
        texts = {n: old.read(n) for n in old.namelist() if n.endswith(".json")}
    deep = b"[" * 200_000
    for name in texts:
        for wrong in (b"\xff", b"null", b'{"a": 1}', b"[{}]", deep):
            refusal_of(repack(whole, **{name: wrong}), tmp_path)


def test_a_truncated_archive_is_refused(whole, tmp_path):
    data = whole.read_bytes()
    for share in np.linspace(0, 1, 20, endpoint=False):
        whole.write_bytes(data[: int(share * len(data))])
        refusal_of(whole, tmp_path)
    with pytest.raises(InputError, match="does not exist"):
        read(tmp_path / "nowhere.zip", ReadOptions())
    with pytest.raises(InputError, match="No such file"):
        read_archive(tmp_path / "nowhere.zip", tmp_path / "n.forcelab")


@given(st.data())
@settings(max_examples=40, deadline=None)
def test_a_damaged_byte_is_refused_or_changes_nothing(fuzzed, data):
    path, expected = fuzzed
    content = bytearray(path.read_bytes())
    at = data.draw(st.integers(0, len(content) - 1))
    content[at] ^= data.draw(st.integers(1, 255))
    with folder_in_memory() as folder:
        damaged = folder / "damaged.zip"
        damaged.write_bytes(content)
        try:
            copy = read_archive(damaged, folder / "copy")
        except InputError as error:
            sentence = str(error)
            assert sentence.endswith(".")
            assert [p.name for p in folder.iterdir()] == ["damaged.zip"]
        else:
            with copy:
                assert everything(copy) == expected


@pytest.fixture(scope="module")
def fuzzed(tmp_path_factory):
    """A small archive, and what it holds."""
    folder = tmp_path_factory.mktemp("fuzzed")
    with Project.create(folder / "p") as project:
        id_ = project.demonstrations.add(demonstration(1), [Track("anna", HOLD)]).id
        project.tracks.undo(id_, "anna")
        write_archive(project, folder / "p.zip")
        return folder / "p.zip", everything(project)


def test_writing_fails_as_a_whole_where_a_file_of_the_project_is_missing(project, tmp_path):
    target = tmp_path / "out.zip"
    target.write_text("before")
    video = project.demonstrations.load("n1").video
    video.path.unlink()
    with pytest.raises(InputError, match=r"video-.* is missing"):
        write_archive(project, target)
    project.demonstrations.add(
        replace(project.demonstrations.load("n1"), videos=(VideoReference(tmp_path / "film.mp4"),))
    )
    array = project.path / "demonstrations" / project.demonstrations.load("n2").id / "signals.npy"
    data = bytearray(array.read_bytes())
    data[-1] ^= 1
    array.write_bytes(data)
    with pytest.raises(InputError, match="no longer what was recorded"):
        write_archive(project, target)
    assert target.read_text() == "before"
    assert not list(tmp_path.glob(".*"))


@pytest.mark.skipif(os.name != "posix", reason="needs limits of POSIX")
def test_a_full_disk_leaves_neither_an_archive_nor_a_project(project, whole, tmp_path):
    code = """
import resource, sys
from forcelab.errors import InputError
from forcelab.formats.archive import read_archive, write_archive
from forcelab.project import LabelsUsed, Project
project = Project.open(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (8_000, 8_000))
try:
    write_archive(project, sys.argv[3])
except InputError as error:
    print(error)
try:
    read_archive(sys.argv[2], sys.argv[3])
except InputError as error:
    print(error)
"""
    target = tmp_path / "target" / "out"
    target.parent.mkdir()
    arguments = [sys.executable, "-c", code, project.path, whole, target]
    done = subprocess.run(arguments, capture_output=True, text=True, check=True)
    first, second = done.stdout.splitlines()
    assert "cannot be written" in first
    assert second.endswith(".")
    assert list(target.parent.iterdir()) == []


TRUTH = {"taps": [0.1, 1 / 3], "video": {"offset": -0.25, "frames": [0.0, 1 / 30]}}

SOURCE = "simulated: task LEGO, seed 1, number 1, 1000 Hz"


@pytest.fixture
def archive(tmp_path):
    """One demonstration with a truth, one without."""
    signals = np.random.default_rng(0).normal(size=(20, 1))
    first, second = (
        Demonstration(name, "LEGO", np.arange(20) / rate, signals, (Channel("fz", "N"),))
        for name, rate in (("one", 100), ("other", 200))
    )
    with Project.create(tmp_path / "study.forcelab") as project:
        track = Track("Ines", (Segment(0.0, 0.05, "grab"),))
        project.demonstrations.add_all(
            [NewDemonstration(first, (track,), SOURCE, truth=TRUTH), NewDemonstration(second)]
        )
        write_archive(project, tmp_path / "study.zip")
    return tmp_path / "study.zip"


def test_an_archive_brings_the_truth_back(archive, tmp_path):
    with read_archive(archive, tmp_path / "copy.forcelab") as copy:
        assert copy.demonstrations.truth(copy.demonstrations.load("one").id) == TRUTH
        assert copy.demonstrations.truth(copy.demonstrations.load("other").id) is None
        write_archive(copy, tmp_path / "again.zip")
    assert (tmp_path / "again.zip").read_bytes() == archive.read_bytes()


def test_truth_and_source_come_along_into_a_project_that_is_there(archive, tmp_path):
    Project.create(tmp_path / "lab.forcelab").close()
    for status in ("new", "unchanged"):
        report = import_files(tmp_path / "lab.forcelab", [archive])
        assert report.count(status) == 2
    with Project.open(tmp_path / "lab.forcelab") as project:
        sources = {info.name: info.source for info in project.demonstrations.infos()}
        assert sources == {"one": SOURCE, "other": "study.zip"}
        id_ = project.demonstrations.load("one").id
        assert project.demonstrations.truth(id_) == TRUTH
        assert project.demonstrations.truth(project.demonstrations.load("other").id) is None
        # The labels are the archive's; a simulation's source says nothing about them.
        (edit,) = project.tracks.history(id_, "Ines")
        assert "imported from study.zip" in edit.what


@pytest.mark.parametrize("content", [b"[0.1]", b"{"])
def test_a_truth_that_is_none_is_refused_by_name(archive, tmp_path, content):
    changed = tmp_path / "changed.zip"
    with zipfile.ZipFile(archive) as old, zipfile.ZipFile(changed, "w") as new:
        for info in old.infolist():
            truth = info.filename.endswith("truth.json")
            assert not truth or json.loads(old.read(info)) == TRUTH
            new.writestr(info, content if truth else old.read(info))
    with pytest.raises(InputError, match=r"truth\.json"):
        read_archive(changed, tmp_path / "copy.forcelab")
    assert not (tmp_path / "copy.forcelab").exists()
