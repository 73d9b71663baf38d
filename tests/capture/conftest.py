"""What tests of capturing need: a project to record into."""

import pytest

from forcelab.project import Project


@pytest.fixture
def project(tmp_path):
    """The folder of an empty project."""
    with Project.create(tmp_path / "lab.forcelab") as created:
        return created.path
