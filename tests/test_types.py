"""The types are right, as mypy sees them; it began when the first test did."""

import sys

import pytest

if sys.version_info[:2] != (3, 11):
    # numpy's own annotations differ from version to version, and so does what they find.
    pytest.skip("types are checked with the numpy of Python 3.11", allow_module_level=True)


def test_the_types_are_right(mypy_outcome):
    status, output = mypy_outcome
    assert status == 0, output
