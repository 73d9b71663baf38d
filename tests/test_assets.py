"""What the program carries with it is found in a checkout and in an installed wheel."""

import email
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from forcelab import resources
from forcelab.errors import InputError
from forcelab.resources import asset, read_toml

ROOT = Path(__file__).resolve().parents[1]
#: What of the assets an installation has, too.
CARRIED = ("**/*.toml", "actions/*.png", "foam-*.csv", "constraints.txt", "guide/**/*")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder that takes the place of the program's assets."""
    monkeypatch.setattr(resources, "FOLDERS", (tmp_path / "absent", tmp_path))
    return tmp_path


def test_in_a_checkout_the_assets_are_those_that_people_edit():
    assert asset("actions.toml") == ROOT / "assets" / "actions.toml"
    assert read_toml("actions.toml").keys() >= {"grab", "slip transition"}


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The folder of an installed wheel."""
    folder = tmp_path_factory.mktemp("wheel")
    # Without the sandbox of pip: the same wheel, and no network.
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder],
        cwd=ROOT,
        check=True,
        capture_output=True,
    )
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "installed")
    return folder / "installed"


def test_what_a_package_index_shows_leads_nowhere_but_into_the_web_and_itself(installed):
    (folder,) = installed.glob("*.dist-info")
    metadata = email.message_from_bytes((folder / "METADATA").read_bytes())
    readme = metadata.get_payload()
    assert metadata["Description-Content-Type"] == "text/markdown"
    assert readme.startswith("# forcelab\n")
    assert readme.index("pipx install forcelab") < readme.index(".ci/setup")
    assert "`forcelab guide " in readme
    assert "![" not in readme
    links = re.findall(r"\]\(([^)]*)\)", readme)
    assert links
    assert all(link.startswith(("https://", "#")) for link in links)
    pythons = [line for line in metadata.get_all("Classifier") if line.endswith(("3.10", "3.14"))]
    assert len(pythons) == 2


def test_a_wheel_carries_the_assets_and_finds_them(installed, tmp_path):
    # Somebody else's folder, as badly packaged programs leave them there.
    (installed / "assets").mkdir()
    script = "import forcelab.resources as a; print(a.__file__, a.asset('actions.toml'), sep='\\n')"
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(installed)},
        check=True,
        capture_output=True,
        text=True,
    )
    package = installed / "forcelab"
    assert done.stdout.splitlines() == [
        str(package / "resources.py"),
        str(package / "assets_data" / "actions.toml"),
    ]
    assert (package / "py.typed").is_file()
    carried = [
        path.relative_to(ROOT / "assets")
        for pattern in CARRIED
        for path in (ROOT / "assets").glob(pattern)
        if path.is_file()
    ]
    data = package / "assets_data"
    packed = [path.relative_to(data) for path in data.rglob("*") if path.is_file()]
    assert sorted(packed) == sorted(carried)
    for path in carried:
        assert (data / path).read_bytes() == (ROOT / "assets" / path).read_bytes()


def test_all_that_the_installed_guide_links_to_is_installed(installed):
    pages = list((installed / "forcelab" / "assets_data" / "guide").glob("*.md"))
    assert len(pages) > 9
    for page in pages:
        text = re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.S)
        for link in re.findall(r"\]\(([^)#\s]+)", text):
            assert link.startswith("https://") or (page.parent / link).exists(), (page.name, link)


def test_an_asset_in_a_folder_is_found(folder):
    (folder / "actions").mkdir()
    (folder / "actions" / "grab.png").write_bytes(b"\x89PNG")
    assert asset("actions/grab.png").read_bytes() == b"\x89PNG"
    assert asset("actions", "grab.png") == asset("actions/grab.png")


@pytest.mark.parametrize("name", ["actions/grab.png", "tasks", "."])
def test_a_missing_asset_is_named_with_the_place_and_the_cure(folder, name):
    (folder / "tasks").mkdir()
    with pytest.raises(InputError) as refused:
        asset(name)
    assert f"file '{name}' is missing from {folder}; install forcelab again" in str(refused.value)


def test_where_there_are_no_assets_at_all_the_sentence_names_where_they_belong(folder, monkeypatch):
    monkeypatch.setattr(resources, "FOLDERS", (folder / "one", folder / "two"))
    with pytest.raises(InputError, match=r"missing from .*one; install forcelab again"):
        asset("actions.toml")


def test_toml_is_read_in_utf_8_whatever_the_machine_speaks(folder):
    text = 'mass = 0.02\naxes = ["y", "z"]\n[jaws]\nname = "größer"\n'
    (folder / "foam.toml").write_text(text, "utf-8")
    content = {"mass": 0.02, "axes": ["y", "z"], "jaws": {"name": "größer"}}
    assert read_toml("foam.toml") == content


def test_a_toml_file_that_is_missing_is_a_missing_asset(folder):
    with pytest.raises(InputError, match=r"file 'tasks/foam\.toml' is missing from"):
        read_toml("tasks", "foam.toml")
