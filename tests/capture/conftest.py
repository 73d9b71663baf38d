"""What tests of capturing need: a project to record into."""

import pytest

from forcelab.project import Project


@pytest.fixture
def project(tmp_path):
    """The folder of an empty project."""
    with Project.create(tmp_path / "lab.forcelab") as created:
        return created.path


@pytest.fixture(autouse=True)
def devices_are_looked_for_often(monkeypatch):
    """What was unplugged is found again sooner than in earnest."""
    monkeypatch.setattr("forcelab.capture.reader._RETRY", 0.05)
