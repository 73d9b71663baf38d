"""The truth of simulated demonstrations in archives."""

from __future__ import annotations

import json
import zipfile

import numpy as np
import pytest

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.formats.archive import read_archive, write_archive
from forcelab.formats.importing import import_files
from forcelab.labels import Segment, Track
from forcelab.project import Incoming, Project

TRUTH = {"taps": [0.1, 1 / 3], "video": {"offset": -0.25, "frames": [0.0, 1 / 30]}}

SOURCE = "simulated: task LEGO, seed 1, number 1, 1000 Hz"


@pytest.fixture
def archive(tmp_path):
    """One demonstration with a truth, one without."""
    signals = np.random.default_rng(0).normal(size=(20, 1))
    one, other = (
        Demonstration(name, "LEGO", np.arange(20) / rate, signals, (Channel("fz", "N"),))
        for name, rate in (("one", 100), ("other", 200))
    )
    with Project.create(tmp_path / "study.forcelab") as project:
        track = Track("Ines", (Segment(0.0, 0.05, "grab"),))
        project.demonstrations.add_all(
            [Incoming(one, (track,), SOURCE, truth=TRUTH), Incoming(other)]
        )
        write_archive(project, tmp_path / "study.zip")
    return tmp_path / "study.zip"


def test_an_archive_brings_the_truth_back(archive, tmp_path):
    with read_archive(archive, tmp_path / "copy.forcelab") as copy:
        assert copy.demonstrations.truth(copy.load("one").id) == TRUTH
        assert copy.demonstrations.truth(copy.load("other").id) is None
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
