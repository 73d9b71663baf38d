"""The lowest versions that pyproject.toml admits; tests/floors.py installs and tries them."""

from importlib.metadata import version

import floors
import pytest
from packaging.requirements import Requirement
from packaging.version import Version

from forcelab.extras import PACKAGES

REQUIREMENTS = {requirement.name: requirement for requirement in floors.requirements()}


def test_every_package_has_a_lowest_version_and_this_machine_none_below():
    assert {"numpy", "PySide6-Essentials", "pytest", "rosbags"} <= set(REQUIREMENTS)
    for name, requirement in REQUIREMENTS.items():
        lowest = floors.floor(requirement).partition("==")[2]
        assert requirement.specifier.contains(lowest), name
        assert Version(lowest) <= Version(version(name)), name


def test_a_package_without_a_lowest_version_is_named():
    with pytest.raises(ValueError, match="no lowest version of numpy"):
        floors.floor(Requirement("numpy<3"))


@pytest.mark.parametrize(
    ("name", "lowest"),
    [
        # Before it cv2.utils.logging, which keeps OpenCV's chatter off the terminal, was missing.
        ("opencv-contrib-python-headless", "4.13.0.90"),
        # Before it an error while drawing ended the program; before 6.10 errors got lost.
        ("PySide6-Essentials", "6.11.2"),
        ("numpy", "2"),  # the lowest that OpenCV 4.13 takes
    ],
)
def test_floors_that_were_found_by_trying_are_not_lowered(name, lowest):
    assert Version(floors.floor(REQUIREMENTS[name]).partition("==")[2]) >= Version(lowest)


def test_the_extra_of_each_package_brings_it():
    extras = floors.project()["optional-dependencies"]
    for package, extra in PACKAGES.items():
        assert package in {Requirement(line).name for line in extras[extra]}, package
