"""The version says of a checkout which commit it is, whatever git does."""

import shutil
import subprocess

import pytest

from forcelab import version
from forcelab.resources import versions

needs_git = pytest.mark.skipif(shutil.which("git") is None, reason="needs git")


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A folder that takes the place of the one that holds the package."""
    monkeypatch.setattr(version, "ROOT", tmp_path)
    version.full_version.cache_clear()
    yield tmp_path
    version.full_version.cache_clear()


@needs_git
def test_a_checkout_names_its_commit_and_whether_files_were_changed(checkout, monkeypatch):
    def git(*words):
        who = ["-c", "user.name=Ada", "-c", "user.email=ada@lab", "-c", "commit.gpgSign=false"]
        done = subprocess.run(["git", *who, *words], cwd=checkout, check=True, capture_output=True)
        return done.stdout.decode().strip()

    git("init", "-q")
    (checkout / "a.py").write_text("a = 1")
    git("add", "a.py")
    git("commit", "-q", "-m", "A number")
    git("tag", "-a", "v9", "-m", "no part of it")
    commit = git("rev-parse", "--short=8", "HEAD")
    monkeypatch.setenv("GIT_DIR", str(checkout / "of another repository"))
    assert version.full_version() == f"{version.__version__} (checkout {commit})"
    assert versions()["forcelab"] == version.full_version()  # what runs keep
    (checkout / "a.py").write_text("a = 22")
    version.full_version.cache_clear()
    assert version.full_version() == f"{version.__version__} (checkout {commit}, changed)"


def test_an_installed_package_has_the_version_alone(checkout):
    assert version.full_version() == version.__version__


@pytest.mark.parametrize("missing", ["git", pytest.param("commit", marks=needs_git)])
def test_without_git_or_without_a_commit_it_is_still_told_that_this_is_a_checkout(
    checkout, monkeypatch, missing
):
    if missing == "git":
        monkeypatch.setenv("PATH", str(checkout))
        (checkout / ".git").mkdir()
    else:
        subprocess.run(["git", "init", "-q", checkout], check=True)
    assert version.full_version() == f"{version.__version__} (checkout)"
