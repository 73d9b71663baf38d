"""Writes assets/constraints.txt: the exact versions that make the figures in README and guide.

Start it as ``python tests/make_constraints.py``, in the environment that makes the figures and
with python3.10 at hand. What this environment has goes into it, with what the oldest Python takes
in place of packages that no longer support it.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from importlib.metadata import Distribution, distribution
from pathlib import Path
from typing import Any

from packaging.markers import Marker
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[1]
CONSTRAINTS = ROOT / "assets" / "constraints.txt"
OLDEST = "3.10"
#: Extras whose packages are no part of it: other programs, beside which ours is measured.
OTHERS = {"peers"}
HEAD = """\
# The exact versions by which the figures in README and guide were made, for
#   pip install -c constraints.txt forcelab
# Other versions that pyproject.toml admits work too; figures may then differ in the last digits.
# Where a package no longer supports Python 3.10, the newest one that does stands beside it.
"""


def project() -> dict[str, Any]:
    """What pyproject.toml says of the package."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


def requirements() -> list[Requirement]:
    """What pyproject.toml asks for, on any Python, except what `OTHERS` need."""
    described = project()
    extras = described["optional-dependencies"].items()
    chosen = [line for name, lines in extras if name not in OTHERS for line in lines]
    every = map(Requirement, [*described["dependencies"], *chosen])
    return [requirement for requirement in every if requirement.name != "forcelab"]


def installed() -> dict[str, Distribution]:
    """The packages that `requirements` bring here, by name."""
    found: dict[str, Distribution] = {}
    seen: set[str] = set()
    waiting = _applying(requirements(), [""])
    while waiting:
        requirement = waiting.pop()
        if str(requirement) not in seen:
            seen.add(str(requirement))
            package = distribution(requirement.name)
            found[canonicalize_name(requirement.name)] = package
            needed = map(Requirement, package.requires or ())
            waiting += _applying(needed, ["", *requirement.extras])
    return found


def _applying(every: Iterable[Requirement], extras: list[str]) -> list[Requirement]:
    """Those that this Python needs for one of the extras, of which "" is none."""

    def applies(marker: Marker | None) -> bool:
        return marker is None or any(marker.evaluate({"extra": extra}) for extra in extras)

    return [item for item in every if applies(item.marker)]


def resolved(python: str, pins: list[str]) -> dict[str, str]:
    """The version of every package that pip would install for a Python, given some already."""
    extras = [name for name in project()["optional-dependencies"] if name not in OTHERS]
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as constraints:
        constraints.write("\n".join(pins))
        constraints.flush()
        words = ["install", "--dry-run", "--ignore-installed", "--quiet", "--report", "-"]
        target = f"{ROOT}[{','.join(extras)}]"
        done = subprocess.run(
            [f"python{python}", "-m", "pip", *words, "--constraint", constraints.name, target],
            check=True,
            stdout=subprocess.PIPE,
        )
    metadata = [item["metadata"] for item in json.loads(done.stdout)["install"]]
    return {canonicalize_name(m["name"]): m["version"] for m in metadata if m["name"] != "forcelab"}


def lines() -> list[str]:
    """The constraints, one package a line, by name."""
    packages = installed()
    pins = {name: f"{name}=={package.version}" for name, package in packages.items()}
    newer = {name for name, package in packages.items() if not _supports_oldest(package)}
    everywhere = [pin for name, pin in pins.items() if name not in newer]
    return sorted(
        everywhere
        + [f"{pins[name]}; python_version > '{OLDEST}'" for name in newer]
        + [
            f"{name}=={version}; python_version <= '{OLDEST}'"
            for name, version in resolved(OLDEST, everywhere).items()
            if name not in pins or name in newer
        ]
    )


def _supports_oldest(package: Distribution) -> bool:
    return SpecifierSet(package.metadata.get("Requires-Python") or "").contains(f"{OLDEST}.99")


if __name__ == "__main__":
    CONSTRAINTS.write_text(HEAD + "\n".join(lines()) + "\n", encoding="utf-8")
