"""What the README shows is what happens."""

import re
import subprocess
import sys
from fnmatch import fnmatch
from pathlib import Path

import pytest
from make_assets import ASSETS, assets
from make_readme import README, ROOT, run_blocks

TEXT = README.read_text("utf-8")


def mask_numbers(text):
    """Text without its numbers, which differ a little between processors, and without columns."""
    return re.sub(r"[ \-─]+", " ", re.sub(r"\d+(\.\d+)?(e-?\d+)?", "#", text))


@pytest.fixture(autouse=True)
def one_process(monkeypatch):
    """Commands start no processes of their own: the tests share the processors already."""
    monkeypatch.setenv("LOKY_MAX_CPU_COUNT", "1")


def run_script(number, folder):
    """What the README's script of this number prints."""
    script = re.findall(r"```python\n(.*?)```", TEXT, re.S)[number]
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=folder, capture_output=True, text=True, check=True
    )
    return done.stdout


def test_every_command_prints_what_the_readme_shows(tmp_path):
    printed = run_blocks(TEXT, tmp_path, slow=False)
    assert mask_numbers(printed) == mask_numbers(TEXT)
    assert (tmp_path / "pairs.png").read_bytes().startswith(b"\x89PNG")
    painted = run_script(0, tmp_path)
    assert "copied from coder" in painted
    assert len(painted.splitlines()) == 3
    reviewed = run_script(1, tmp_path)
    first, *places = reviewed.splitlines()
    assert float(re.match("F1@50 ([.0-9]+), worst foam-0[1-6]$", first)[1]) > 0.5
    assert 0 < len(places) <= 3
    assert all(
        re.match(r"(action|boundary|missed) [.0-9]+ s: \w+, seen as \w+$", place)
        for place in places
    )
    assert "None" not in reviewed
    shown = re.fullmatch(r"foam-06: \(1097, 64\), (0\.\d\d)\n", run_script(2, tmp_path))
    assert float(shown[1]) > 0.85


def test_ci_runs_the_readme_command_for_tests():
    runs = [line for line in TEXT.splitlines() if line.startswith(".ci/setup")]
    assert len(runs) == 2
    assert runs[1].startswith(".ci/setup test && ")
    assert (ROOT / ".ci" / "run").stat().st_mode & 0o111


def test_every_link_of_the_readme_leads_somewhere_and_every_picture_is_shown():
    links = re.findall(r"\]\((.*?)\)", TEXT)
    headings = re.findall(r"^#+ (.*)", re.sub(r"```.*?```", "", TEXT, flags=re.S), re.M)
    anchors = {"#" + re.sub(r"[^\w -]", "", h).lower().replace(" ", "-") for h in headings}
    for link in (link for link in links if not link.startswith("https://")):
        assert link in anchors if link.startswith("#") else (ROOT / link).exists(), link
    assert {f"assets/{path.name}" for path in Path(ASSETS).glob("*.png")} <= set(links)


def test_the_example_recordings_are_what_the_generator_makes():
    found = {path.name: path.read_text("utf-8") for path in Path(ASSETS).glob("*.csv")}
    assert found == assets()


def test_what_the_commands_write_into_a_clone_is_ignored():
    """Somebody who tries them all has no new file to commit."""
    ignored = [line.strip("/") for line in (ROOT / ".gitignore").read_text("utf-8").splitlines()]
    commands = re.findall(r"^(?:\$|\.ci/setup|  forcelab) .*|`.*?\bforcelab .*?`", TEXT, re.M)
    named = re.findall(
        r"(?:--(?:screenshot|figure|confusion|json|out)|[>])\s+([\w.-]+)(?![\w.{}/-])",
        "\n".join(commands),
    )
    named += re.findall(r"[\w-]+\.forcelab\b", "\n".join(commands))
    assert {"sample.png", "window.png", "ports.json", "tongs.skops", "labels"} <= set(named)
    for name in named:
        places = (name, f"{name}/")
        assert any(fnmatch(place, rule) for place in places for rule in ignored), name
