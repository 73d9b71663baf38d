"""assets/constraints.txt pins all that pyproject.toml asks for, on every Python."""

import pytest
from make_constraints import CONSTRAINTS, requirements
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

LINES = CONSTRAINTS.read_text("utf-8").splitlines()
PINS = [Requirement(line) for line in LINES if not line.startswith("#")]


@pytest.mark.parametrize("python", ["3.10", "3.11", "3.12", "3.13", "3.14"])
def test_every_package_has_one_exact_version_that_is_admitted(python):
    here = {"python_version": python, "python_full_version": f"{python}.0"}

    def chosen(every):
        return [item for item in every if item.marker is None or item.marker.evaluate(here)]

    pins = {pin.name: str(pin.specifier) for pin in chosen(PINS)}
    assert len(pins) == len(chosen(PINS))
    asked = chosen(requirements())
    assert {"numpy", "PySide6-Essentials", "h5py", "distributed"} <= {item.name for item in asked}
    for item in asked:
        exact, version = pins[canonicalize_name(item.name)].split("==")
        assert not exact
        assert item.specifier.contains(version), item.name
