"""Recording from the command line, from virtual devices on real ptys: ended, killed, recovered."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from forcelab.capture.journal import RecordKind, encode_header, read_journal
from forcelab.capture.save import CAPTURES, unfinished_journals
from forcelab.project import Project
from forcelab.resources import asset
from tests.capture.helpers import block_of, eventually
from tests.capture.virtual_devices import VirtualOptoForce

#: How often a recording is killed; more often when asked, as it takes seconds each.
KILLS = int(os.environ.get("FORCELAB_KILLS", "1"))


def source(times):
    """A reading that counts milliseconds, beside two that stand still."""
    counts = np.round(times * 1000).astype(np.int64)
    return np.stack([counts % 8000, np.full_like(counts, 100), np.full_like(counts, -200)], axis=1)


@pytest.fixture
def daq():
    with VirtualOptoForce(source) as created:
        yield created


def start_capture(*words):
    """Start a recording in a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "forcelab", "capture", *map(str, words)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def journal_of(project, process, size=40_000):
    """The journal that a process writes, once some samples are in it: a thousand in 40 kB."""

    def has_samples():
        assert process.poll() is None, process.communicate()
        found = list((project / CAPTURES).glob("*.journal")) if project.exists() else []
        return found and found[0].stat().st_size > size

    eventually(has_samples, 60)
    return next((project / CAPTURES).glob("*.journal"))


def test_a_recording_of_a_second_is_in_a_new_project(forcelab, daq, tmp_path):
    project = tmp_path / "lab.forcelab"
    result = forcelab(
        "capture", project, "--device", f"optoforce:{daq.port}", "--task", "LEGO",
        "--seconds", "1", "--json",
    )  # fmt: skip
    assert result.status == 0, result.err
    output = result.json
    assert output["name"] == "LEGO 01"
    (device,) = output["devices"]
    assert device["lost"] == 0
    assert device["channels"] == ["fx1", "fy1", "fz1"]
    assert device["rate"] == pytest.approx(1000, rel=0.01)
    assert "Ctrl+C" in result.err
    with Project.open(project) as opened:
        d = opened.demonstrations.load("LEGO 01")
        stamps = opened.media.stamps(d.id)
        assert "optoforce" in opened.demonstrations.info(d.id).source
    assert output["samples"] == len(d.times)
    assert d.gaps == ()
    assert (np.diff(stamps["ticks_0"]) == 1).all()
    assert len(d.times) > 750
    again = forcelab(
        "capture", project, "--device", f"optoforce:{daq.port}", "--task", "LEGO",
        "--seconds", "0.6",
    )  # fmt: skip
    assert "'LEGO 02': 0." in again.out
    assert "0 lost" in again.out
    assert list((project / CAPTURES).iterdir()) == []


@pytest.mark.parametrize("turn", range(KILLS))
def test_killed_it_loses_at_most_a_second_and_is_recovered(forcelab, daq, tmp_path, turn):
    project = tmp_path / "lab.forcelab"
    device = f"optoforce:{daq.port}"
    process = start_capture(project, "--device", device, "--task", "LEGO")
    journal_of(project, process)
    time.sleep(0.05 * turn)
    killed = time.monotonic()
    process.kill()
    process.communicate(timeout=60)
    (journal,) = unfinished_journals(project)
    blocks = [block_of(r.payload) for r in read_journal(journal) if r.kind == RecordKind.BLOCK]
    ticks = np.concatenate([block.ticks for block in blocks])
    assert (np.diff(ticks) == 1).all()
    assert killed - blocks[-1].arrived[-1] < 1.0
    # The next start says so, and records under the next name.
    result = forcelab("capture", project, "--device", device, "--task", "LEGO", "--seconds", "0.6")
    assert "1 unfinished recording" in result.err
    assert "'LEGO 02'" in result.out
    result = forcelab("capture", project, "--recover", "--json")
    assert result.status == 0
    (found,) = result.json["recovered"]
    assert found["name"] == "LEGO 01"
    assert found["samples"] == len(ticks)
    with Project.open(project) as opened:
        d = opened.demonstrations.load("LEGO 01")
    assert len(d.times) == len(ticks)
    assert unfinished_journals(project) == ()


def test_ctrl_c_keeps_one_demonstration_though_unplugged_and_plugged_in_again(tmp_path):
    project = tmp_path / "lab.forcelab"
    with VirtualOptoForce(source, clock_ppm=-200) as daq:
        words = ("--device", f"optoforce:{daq.port}", "--task", "LEGO", "--json")
        process = start_capture(project, *words)
        journal = journal_of(project, process, 20_000)
        daq.unplug()
        time.sleep(0.4)
        daq.replug()
        size = journal.stat().st_size
        eventually(lambda: journal.stat().st_size > size + 20_000, 60)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    output = json.loads(out)
    assert output["samples"] > 500
    assert "unplugged" in " ".join(output["remarks"])
    assert "is back" in err
    with Project.open(project) as opened:
        (info,) = opened.demonstrations.infos()
        d = opened.demonstrations.load(info.id)
    assert info.name == "LEGO 01"
    assert len(d.gaps) == 1
    begin, end = d.gaps[0]
    assert end - begin > 0.3


def test_what_the_disk_does_not_take_is_kept_elsewhere_and_can_be_recovered(
    forcelab, daq, tmp_path, monkeypatch
):
    home, away, project = tmp_path / "home", tmp_path / "away", tmp_path / "lab.forcelab"
    home.mkdir()
    monkeypatch.setenv("HOME", str(home))
    process = start_capture(project, "--device", f"optoforce:{daq.port}", "--task", "LEGO")
    journal_of(project, process)
    project.rename(away)
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 1
    (saved,) = home.glob("*.journal")
    output = err.splitlines()[-1]
    assert str(saved) in output
    assert f"'{project / CAPTURES}'" in output
    assert "--recover" in output
    away.rename(project)
    for part in unfinished_journals(project):  # as far as the disk took it
        part.unlink()
    saved.rename(project / CAPTURES / saved.name)
    result = forcelab("capture", project, "--recover", "--json")
    (found,) = result.json["recovered"]
    assert found["name"] == "LEGO 01"
    with Project.open(project) as opened:
        d = opened.demonstrations.load("LEGO 01")
    assert len(d.times) == found["samples"]
    assert not d.gaps


def test_a_recording_that_cannot_be_recovered_is_said_and_left(forcelab, tmp_path):
    with Project.create(tmp_path / "lab.forcelab") as created:
        project = created.path
    (project / CAPTURES).mkdir()
    bad = project / CAPTURES / "bad.journal"
    bad.write_bytes(b"junk")
    result = forcelab("capture", project, "--recover")
    assert result.status == 1
    assert "no journal" in result.out
    assert bad.exists()


def test_a_recording_without_samples_is_said_once_and_gone(forcelab, tmp_path):
    with Project.create(tmp_path / "lab.forcelab") as created:
        project = created.path
    (project / CAPTURES).mkdir()
    none = project / CAPTURES / "pull 01.journal"
    none.write_bytes(encode_header({"name": "pull 01", "cameras": []}))
    torn = none.with_stem("pull 02")
    torn.write_bytes(none.read_bytes() + b"half a block")
    result = forcelab("capture", project, "--recover")
    assert result.status == 1
    assert "'pull 01' ended before its first sample" in result.out
    assert not none.exists()
    assert torn.exists()  # something was in it
    torn.unlink()
    assert "0 unfinished" in forcelab("capture", project, "--recover").out


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["new.forcelab", "--device", "optoforce:/dev/nowhere", "--task", "t"], "/dev/nowhere"),
        (["new.forcelab", "--device", "x", "--task", "t"], "'x' is no device"),
        (
            ["new.forcelab", "--device", "text:/dev/x", "--task", "t", "--camera", "93"],
            "camera 93 cannot be opened",
        ),
        (["new.forcelab", "--recover"], "new.forcelab"),
    ],
)
def test_what_cannot_be_done_is_one_sentence_and_makes_no_project(
    forcelab, tmp_path, monkeypatch, words, expected
):
    monkeypatch.chdir(tmp_path)
    assert expected in forcelab("capture", *words).sentence
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([], "--list"),
        (["new.forcelab"], "--device"),
        (["new.forcelab", "--device", "optoforce:/dev/nowhere"], "--task"),
        (["new.forcelab", "--device", "text:/dev/x", "--task", "t", "--seconds", "-1"], "positive"),
    ],
)
def test_a_recording_that_is_not_told_of_is_a_wrong_command_line(
    forcelab, tmp_path, monkeypatch, words, expected
):
    monkeypatch.chdir(tmp_path)
    assert expected in forcelab("capture", *words).wrong_word
    assert list(tmp_path.iterdir()) == []


def test_raw_counts_are_warned_of_before_they_are_recorded(forcelab, daq, tmp_path):
    words = ("--task", "LEGO", "--seconds", "0.6")
    port = f"optoforce:{daq.port}"
    result = forcelab("capture", tmp_path / "lab.forcelab", "--device", port, *words)
    assert result.status == 0
    warning = (
        f"{port} is not calibrated: its forces are recorded as raw counts, which do not compare "
        f"with newtons; give ?calibration=FILE.\n"
    )
    assert warning in result.err
    assert result.err.index(warning) < result.err.index("Recording 'LEGO 01'")
    file = asset("calibrations", "3-axis-40N.toml")
    newtons = f"{port}?calibration={file}"
    result = forcelab("capture", tmp_path / "lab.forcelab", "--device", newtons, *words)
    assert "calibrated" not in result.err
