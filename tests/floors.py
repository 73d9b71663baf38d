"""Passes tests with the lowest version of every package that pyproject.toml admits.

Start it as ``python tests/floors.py``, with words for pytest if other tests than `TESTS` are
wanted. It installs those versions into an environment of its own, which is gone afterwards.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import venv
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement

from forcelab.extras import PACKAGES

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[1]
#: Extras that are installed too.
EXTRAS = ("test", *PACKAGES.values())
#: The parts that rely on outside packages most: Qt, OpenCV, scikit-learn and its files, bags.
TESTS = ("tests/gui", "tests/video", "tests/recognition", "tests/formats", "tests/cli")


def project() -> dict[str, Any]:
    """What pyproject.toml says of the package."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


def requirements() -> list[Requirement]:
    """The packages of pyproject.toml that this Python needs, with those of `EXTRAS`."""
    described = project()
    lines = [*described["dependencies"]]
    for extra in EXTRAS:
        lines += described["optional-dependencies"][extra]
    every = map(Requirement, lines)
    return [item for item in every if item.marker is None or item.marker.evaluate()]


def floor(requirement: Requirement) -> str:
    """The lowest version that a requirement admits, as a constraint for pip.

    Raises
    ------
    ValueError
        If it admits any version.
    """
    for part in requirement.specifier:
        if part.operator in (">=", "=="):
            return f"{requirement.name}=={part.version}"
    raise ValueError(f"pyproject.toml says no lowest version of {requirement.name}")


def main(words: list[str]) -> int:
    """Install the floors and run the tests; gives pytest's exit status."""
    with tempfile.TemporaryDirectory(prefix="forcelab-floors-") as folder:
        constraints = Path(folder) / "constraints.txt"
        constraints.write_text("\n".join(map(floor, requirements())), "utf-8")
        venv.create(Path(folder) / "venv", with_pip=True)
        python = Path(folder) / "venv" / "bin" / "python"
        pip = [python, "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
        # pip's own constraints may come from the machine; hatchling builds what is installed.
        target = f"{ROOT}[{','.join(EXTRAS)}]"
        subprocess.run([*pip, "--constraint", constraints, "--editable", target], check=True)
        tests = [python, "-m", "pytest", "-q", "-n", "2", *(words or TESTS)]
        return subprocess.run(tests, cwd=ROOT, check=False).returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
