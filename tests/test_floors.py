"""The lowest versions that pyproject.toml admits; .ci/pythons installs and tries them."""

import sys
from importlib.metadata import version
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.version import Version

from forcelab.extras import PACKAGES

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

TEXT = (Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8")
PROJECT = tomllib.loads(TEXT)["project"]
EXTRAS = {
    name: [Requirement(line) for line in lines]
    for name, lines in PROJECT["optional-dependencies"].items()
}
#: Those of this Python, with what .ci/pythons installs too.
REQUIREMENTS = {
    requirement.name: requirement
    for requirement in [
        *map(Requirement, PROJECT["dependencies"]),
        *(item for extra in ("test", *PACKAGES.values()) for item in EXTRAS[extra]),
    ]
    if requirement.marker is None or requirement.marker.evaluate()
}


def floor(name):
    """The lowest version that is admitted of a package."""
    every = REQUIREMENTS[name].specifier
    return next(Version(part.version) for part in every if part.operator in (">=", "=="))


def test_every_package_has_a_lowest_version_and_this_machine_none_below():
    assert {"numpy", "PySide6-Essentials", "pytest", "rosbags"} <= set(REQUIREMENTS)
    for name, requirement in REQUIREMENTS.items():
        assert requirement.specifier.contains(floor(name)), name
        assert floor(name) <= Version(version(name)), name


@pytest.mark.parametrize(
    ("name", "lowest"),
    [
        # Before it cv2.utils.logging, which keeps OpenCV's chatter off the terminal, was missing.
        ("opencv-contrib-python-headless", "4.13.0.90"),
        # Before it an error while drawing ended the program; before 6.10 errors got lost.
        ("PySide6-Essentials", "6.11.2"),
        ("numpy", "2"),  # the lowest that OpenCV 4.13 takes
        ("av", "16"),  # before it the last frames of what is cut out of a video were lost
        ("pylsl", "1.18"),  # before it liblsl was not in the wheel
        # Before it tests in turn could get one folder, of which Qt remembers what lay in it.
        ("pytest", "9.2"),
        ("hypothesis", "6.112"),  # before it it gave examples that a filter refuses
    ],
)
def test_floors_that_were_found_by_trying_are_not_lowered(name, lowest):
    assert floor(name) >= Version(lowest)


def test_the_extra_of_each_package_brings_it():
    for package, extra in PACKAGES.items():
        assert package in {requirement.name for requirement in EXTRAS[extra]}, package
