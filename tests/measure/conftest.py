"""What tests of measuring share."""

from types import SimpleNamespace

import pytest

from forcelab.measure import timing


@pytest.fixture(autouse=True)
def garbage_is_left(monkeypatch):
    """Nothing is searched for garbage before a run: that takes longer than what is measured."""
    monkeypatch.setattr(timing, "gc", SimpleNamespace(collect=lambda: None))
