"""What several tests of recognition learn from."""

import pytest
from factories import labelled_set

from forcelab.recognition import ensemble, perceptron


@pytest.fixture(scope="module")
def three():
    return labelled_set(3, rate=100.0)


@pytest.fixture(scope="module")
def small_fits():
    """Few trees, rounds and epochs do where nothing hangs on how well actions are recognised."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(ensemble, "TREES", 8)
        patched.setattr(ensemble, "ROUNDS", 10)
        patched.setattr(perceptron, "EPOCHS", 20)
        yield
