"""A small project and a way to call the command line."""

import io
import json
import shutil
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from factories import synthetic_set
from make_assets import as_csv

from forcelab.cli import main


@dataclass
class Result:
    status: int
    out: str
    err: str

    @property
    def json(self):
        return json.loads(self.out)

    @property
    def sentence(self):
        """The one sentence about a file or project; fails if it is anything more or less."""
        return self._only_sentence(1)

    @property
    def wrong_word(self):
        """The one sentence about the command line itself; fails as :attr:`sentence`."""
        return self._only_sentence(2)

    def _only_sentence(self, status):
        assert self.status == status, (self.status, self.out, self.err)
        assert self.out == ""
        assert self.err.startswith(("forcelab: ", "forcelab "))  # argparse names the command
        assert self.err.endswith(".\n")
        assert self.err.count("\n") == 1
        assert "Traceback" not in self.err
        return self.err


@pytest.fixture
def forcelab(capsys, monkeypatch):
    monkeypatch.setenv("LANGUAGE", "C")  # argparse looks up no translation of its words

    def call(*words):
        capsys.readouterr()
        try:
            status = main([str(word) for word in words])
        except KeyboardInterrupt:  # it would end all tests
            pytest.fail("Ctrl+C was not heard.")
        result = capsys.readouterr()
        return Result(status, result.out, result.err)

    return call


class Terminal(io.StringIO):
    """Keeps what is shown on a terminal."""

    def isatty(self):
        return True


@pytest.fixture
def terminal():
    """What a test may have for standard error; pytest has its own again before the test begins."""
    return Terminal()


@pytest.fixture
def forcelab_on_terminal(forcelab, monkeypatch):
    """The same with a terminal for standard error."""

    def call(*words):
        with monkeypatch.context() as patch:
            patch.setattr(sys, "stderr", shown := Terminal())
            result = forcelab(*words)
        return replace(result, err=shown.getvalue())

    return call


@pytest.fixture(scope="session")
def recordings(tmp_path_factory):
    """Four recordings of foam, two of sponge, as CSV files with labels."""
    folder = tmp_path_factory.mktemp("recordings")
    for task, count, seed in (("foam", 4, 1), ("sponge", 2, 11)):
        for demonstration, segments in synthetic_set(count, 100.0, task, seed):
            path = folder / f"{demonstration.name.replace(' ', '-')}.csv"
            path.write_text(as_csv(demonstration, segments), encoding="utf-8")
    return folder


@pytest.fixture(scope="session")
def imported(tmp_path_factory, recordings):
    project = tmp_path_factory.mktemp("imported") / "lab.forcelab"
    for task in ("foam", "sponge"):
        files = sorted(str(path) for path in recordings.glob(f"{task}-*.csv"))
        assert main(["import", str(project), *files, "--task", task]) == 0
    return project


@pytest.fixture
def project(imported, tmp_path):
    """A copy of the small project that a test may change."""
    return Path(shutil.copytree(imported, tmp_path / "lab.forcelab"))
