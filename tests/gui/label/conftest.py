"""What tests of the Label workspace share."""

import pytest
from window_helpers import open_painted_document

from forcelab.gui.jobs import Jobs


@pytest.fixture
def document(app, tmp_path):
    """Ada's track, painted."""
    with open_painted_document(tmp_path) as document:
        yield document


@pytest.fixture
def jobs(app):
    jobs = Jobs()
    yield jobs
    assert jobs.close(10.0)
