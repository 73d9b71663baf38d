"""What several tests of recognition learn from."""

import pytest
from factories import labelled_set


@pytest.fixture(scope="module")
def three():
    return labelled_set(3, rate=100.0)
