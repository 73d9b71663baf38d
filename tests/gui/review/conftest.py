"""A small project that stays open, for views that only look at it."""

import pytest
from painted import opened

from forcelab.gui.jobs import Jobs


@pytest.fixture(scope="module")
def kept(app, tmp_path_factory):
    with opened(tmp_path_factory.mktemp("study")) as document:
        yield document


@pytest.fixture
def document(kept):
    kept.open_demonstration(kept.infos[0].id)
    kept.told.clear()
    yield kept
    kept.set_outcome(None)
    for assignment in kept.project.assignments():
        kept.project.unassign(assignment.demonstration, assignment.author)


@pytest.fixture
def jobs(app):
    jobs = Jobs()
    yield jobs
    jobs.close()
