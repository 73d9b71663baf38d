"""'-' in place of a file: standard output then holds that file and nothing else."""

import io
import shlex
import subprocess
import sys
import zipfile

import pytest
from factories import FAST_OPTIONS

TRAINING = ["--task", "foam", *FAST_OPTIONS[:4], "--stride", "10"]
EVALUATION = ["--task", "foam", *FAST_OPTIONS, "--stride", "10"]


@pytest.fixture
def forcelab_bytes(forcelab, monkeypatch):
    """Calls a command; gives what it wrote to standard output as bytes, and the result."""

    def call(*words, terminal=False):
        with monkeypatch.context() as patch, io.TextIOWrapper(io.BytesIO(), "utf-8") as out:
            patch.setattr(out, "isatty", lambda: terminal)
            patch.setattr(sys, "stdout", out)
            result = forcelab(*words)
            out.flush()
            return out.buffer.getvalue(), result

    return call


def test_a_trained_recogniser_goes_to_standard_output(forcelab, forcelab_bytes, project, tmp_path):
    content, result = forcelab_bytes("train", project, *TRAINING, "--out", "-")
    assert result.err.startswith("recogniser: ")
    assert forcelab_bytes("train", project, *TRAINING, "--out", "-", "-q")[1].err == ""
    (tmp_path / "r.skops").write_bytes(content)
    assert forcelab("predict", tmp_path / "r.skops", project).status == 0


def test_a_recording_is_recognised_from_standard_input(
    forcelab, project, recordings, tmp_path, monkeypatch
):
    forcelab("train", project, *TRAINING, "--out", tmp_path / "r.skops")
    recording = recordings / "foam-01.csv"
    with recording.open() as stream, monkeypatch.context() as patch:
        patch.setattr(sys, "stdin", stream)
        piped = forcelab("predict", tmp_path / "r.skops", "-", "--out", "-")
    assert piped.out.count("\n") > 2
    assert piped.out == forcelab("predict", tmp_path / "r.skops", recording).out


def test_scores_go_to_standard_error_beside_a_figure_or_table(forcelab, project):
    figure = forcelab("evaluate", project, *EVALUATION, "--figure", "-")
    assert figure.out.startswith("<?xml")
    assert figure.out.endswith("</svg>\n")
    assert "accuracy" in figure.err
    table = forcelab("evaluate", project, *EVALUATION, "--table", "-", "--quiet")
    assert table.out.startswith("evaluation,stage,row,demonstration,accuracy")
    assert table.err == ""


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["evaluate", "P", *EVALUATION, "--json", "-", "--table", "-"], "can hold one file"),
        (["train", "P", *TRAINING, "--json", "--out", "-"], "can hold one file"),
        (["evaluate", "P", "--figure", "-"], "choose a --task"),  # there are two
        (["measure", "cwt", "--json", "-", "--figure", "-"], "can hold one file"),
        (["export", "P", "--into", "-", "--format", "lerobot"], "names no file or folder"),
    ],
)
def test_what_standard_output_cannot_hold_is_refused(forcelab, project, words, sentence):
    words = [project if word == "P" else word for word in words]
    assert sentence in forcelab(*words).wrong_word


@pytest.mark.parametrize(
    "words", ["train P --out -", "export P --format archive --out -", "gui P --screenshot -"]
)
def test_what_is_no_text_is_kept_from_the_terminal(forcelab_bytes, project, words):
    content, result = forcelab_bytes(
        *(project if word == "P" else word for word in words.split()), terminal=True
    )
    assert (content, result.status) == (b"", 2)
    assert result.err.startswith("forcelab: What is written to '-' is no text and would spoil")


def test_a_screenshot_goes_to_standard_output(forcelab_bytes, monkeypatch):
    def draw(options):
        options.screenshot.write_bytes(b"\x89PNG")
        return 0

    monkeypatch.setattr("forcelab.gui.app.run", draw)
    assert forcelab_bytes("gui", "--screenshot", "-")[0] == b"\x89PNG"


def test_an_archive_goes_through_a_pipe(project, tmp_path):
    command = f"{shlex.quote(sys.executable)} -m forcelab export {shlex.quote(str(project))}"
    with (tmp_path / "lab.zip").open("wb") as file:
        done = subprocess.run(
            ["bash", "-c", f"set -o pipefail; {command} --format archive --out - | cat"],
            stdout=file,
            stderr=subprocess.PIPE,
            check=True,
        )
    assert done.stderr == b""
    with zipfile.ZipFile(tmp_path / "lab.zip") as archive:
        assert archive.testzip() is None
