"""What tests of the Label workspace share."""

import pytest

from forcelab.gui.jobs import Jobs


@pytest.fixture
def jobs(app):
    jobs = Jobs()
    yield jobs
    assert jobs.close(10.0)
