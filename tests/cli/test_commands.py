"""The other commands, and what all commands share."""

import json
import os
import pty
import re
import shlex
import signal
import subprocess
import sys
import time
from functools import partial
from io import BytesIO, TextIOWrapper
from pathlib import Path
from unicodedata import normalize

import pytest
from factories import FAST_OPTIONS

from forcelab.cli import build_parser, main
from forcelab.cli.output import progress_bar
from forcelab.formats.output_folder import file_names
from forcelab.gui.qt_check import QtPlatform
from forcelab.jobs import Progress
from forcelab.project import Project
from forcelab.project.runs import RunStore
from forcelab.recognition.classifiers import REGISTRY
from forcelab.recognition.ensemble import FitProgress
from forcelab.recognition.presets import PRESETS
from forcelab.resources import asset
from forcelab.signals.wavelets import WAVELETS
from forcelab.version import full_version

COMMANDS = [
    "gui", "demo", "guide", "import", "labels", "attach", "sync", "export", "list", "assign",
    "note", "agree", "rename", "remove", "actions", "evaluate", "train", "predict", "runs",
    "review", "why", "plan", "capture", "replay", "simulate", "figures", "measure", "doctor",
    "install-launcher", "completion", "manual",
]  # fmt: skip
#: Commands whose result is no text, or one for other programs already.
WITHOUT_JSON = ("gui", "completion", "manual")


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_a_manual_with_examples_and_json(capsys, command):
    assert main([command, "--help"]) == 0
    manual = capsys.readouterr().out
    assert ("--json" in manual) == (command not in WITHOUT_JSON)
    assert "-q, --quiet" in manual
    assert "usage: forcelab" in manual
    examples = manual.partition("for example:\n")[2].replace("\\\n", " ")
    assert examples
    for example in examples.splitlines():
        program, *words = shlex.split(example.partition(" > ")[0])
        assert program == "forcelab"
        assert words[0] == command
        assert callable(build_parser(words).parse_args(words).command)


def test_the_list_of_commands_is_that_of_the_manual(capsys):
    assert main(["--help"]) == 0
    listed = capsys.readouterr().out.partition("\ncommands:\n")[2].partition("\n\n")[0]
    assert re.findall(r"^    ([\w-]+)(?= )", listed, re.M) == COMMANDS
    assert listed.startswith("  begin\n    gui ")


def test_help_groups_options_by_what_they_are_for(forcelab):
    manual = forcelab("evaluate", "--help").out
    assert manual.startswith("usage: forcelab evaluate [options] PROJECT\n")
    groups = dict(re.findall(r"^([a-z: ]+):\n((?:.+\n|\n(?=  ))+)", manual, re.M))
    for title, option in {
        "which demonstrations": "--task",
        "what is tested": "--test-names",
        "settings": "--preset",
        "settings: features": "--wavelet",
        "settings: classifier": "--stride",
        "settings: timeline": "--threshold",
        "output": "--figure",
        "computing": "--jobs",
        "general": "--quiet",
    }.items():
        assert f"  {option}" in groups[title] or f", {option}" in groups[title]


def test_a_usage_names_what_must_be_given(forcelab):
    manual = forcelab("export", "--help").out
    assert manual.startswith(
        "usage: forcelab export [options] (--out DIR | --into DATASET) PROJECT\n"
    )
    assert forcelab("attach", "--help").out.startswith("usage: forcelab attach [--name NAME] ")


def test_the_manual_names_every_choice_there_is(capsys):
    main(["evaluate", "--help"])
    manual = " ".join(capsys.readouterr().out.split())
    for name in (*REGISTRY, *WAVELETS, *PRESETS):
        assert name in manual


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["lst", "p"], "forcelab: there is no 'lst'; did you mean 'list'"),
        (["evaluate", "p", "--stride", "five"], "--stride: 'five' is no whole number"),
        (["why", "p", "d", "--at", "noon"], "--at: 'noon' is no number"),
        (["gui", "p", "--theme", "pink"], "there is no 'pink'; choose from light, dark, system"),
        (["train", "p"], "--out must be given"),
        (["list", "p", "--tusk"], "'--tusk' means nothing here; did you mean '--task'"),
        (
            ["evaluate", "p", "--strode=5"],
            "'--strode=5' means nothing here; did you mean '--stride'",
        ),
        (["export", "p", "--uot", "labels"], "'--uot' means nothing here; did you mean '--out'"),
        (["list", "p", "--zzzzz"], "forcelab list: '--zzzzz' means nothing here; see 'forcelab l"),
        (["simulate", "--task", "foam", "--out", "-"], "--out: '-' names no file or folder"),
        (["import", "-", "a.csv"], "'-' names no file or folder"),
        (["help", "evalate"], "there is no 'evalate'; did you mean 'evaluate'"),
        (["train", "p", "--out"], "--out: expected one argument"),
    ],
)
def test_a_wrong_command_line_is_told_in_one_sentence(forcelab, words, sentence):
    output = forcelab(*words).wrong_word
    assert sentence in output
    assert output.endswith("--help'.\n")


def test_help_and_version_are_asked_for_as_in_other_programs(forcelab):
    assert forcelab("help").out == forcelab("--help").out != ""
    assert forcelab("help", "evaluate").out == forcelab("evaluate", "--help").out != ""
    assert forcelab("-V").out == forcelab("--version").out == f"forcelab {full_version()}\n"


def test_recordings_do_not_come_from_standard_input(forcelab, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused = forcelab("import", "p.forcelab", "-").wrong_word
    assert "from files, not from standard input ('-')" in refused
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "name", "value"),
    [
        ("remove P --yes pull-03 pull-04", "demonstrations", ["pull-03", "pull-04"]),
        ("remove P pull-03 --yes pull-04", "demonstrations", ["pull-03", "pull-04"]),
        ("assign P --author Ines pull-03", "demonstrations", ["pull-03"]),
        ("actions slip --json grab", "actions", ["slip", "grab"]),
        ("measure recognition --quick P", "project", Path("P")),
    ],
)
def test_words_may_stand_behind_options(words, name, value):
    assert getattr(build_parser(words.split()).parse_args(words.split()), name) == value


def test_a_calibration_that_is_not_there_is_told_where_nothing_needs_it(
    forcelab, tmp_path, recordings
):
    table, missing = next(recordings.glob("*.csv")), tmp_path / "no.toml"
    project = tmp_path / "new.forcelab"
    result = forcelab("import", project, table, "--calibration", missing)
    assert f"The calibration file '{missing}' cannot be read" in result.sentence
    assert not project.exists()


def test_importing_twice_updates(forcelab, project, recordings):
    files = sorted(recordings.glob("foam-*.csv"))
    result = forcelab("import", project, *files, "--task", "foam", "--json")
    assert [row["status"] for row in result.json["demonstrations"]] == ["unchanged"] * 4
    output = forcelab("import", project, *files, "--task", "foam")
    assert output.out == "4 recordings: 0 new, 0 updated, 4 unchanged.\n"
    with Project.open(project) as opened:
        assert len(opened.demonstrations.infos()) == 6


def test_columns_are_read_as_it_is_said(forcelab, tmp_path):
    file = tmp_path / "press.csv"
    rows = "".join(f"{i / 100},{i * 5},{i % 7},{i % 2}\n" for i in range(200))
    file.write_text("time,crosshead,fx,button\n" + rows)
    project = tmp_path / "p.forcelab"
    assert "(--signal)" in forcelab("import", project, file).out
    result = forcelab("import", project, file, "--signal", "crosshead", "--leave-out", "button")
    assert "crosshead" not in result.out
    with Project.open(project) as opened:
        channels = {tuple(c.name for c in info.channels) for info in opened.demonstrations.infos()}
    assert channels == {("fx", "button"), ("crosshead", "fx")}


def test_remarks_are_told_for_each_file(forcelab, tmp_path):
    file = tmp_path / "late.csv"
    rows = [f"{i / 100},{i}" for i in range(30)] + ["9e9,1"]
    file.write_text("time,a\n" + "\n".join(rows) + "\n")
    result = forcelab("import", tmp_path / "p.forcelab", file)
    assert result.status == 0
    assert "late.csv: " in result.out
    assert "1 new" in result.out
    strict = tmp_path / "strict.forcelab"
    assert "late.csv" in forcelab("import", strict, file, "--strict").sentence
    assert not strict.exists()


def test_glitches_are_told_and_stay_as_they_are(forcelab, tmp_path):
    file = tmp_path / "torn.csv"
    wild = {20: "3e12", 21: "-4e15", 50: "9e37"}  # the last is no reading at all, but missing
    rows = [f"{i / 100},{wild.get(i, i % 7)},{'5e14' if i == 90 else 1}" for i in range(200)]
    file.write_text("\n".join(["time,fx,fz", *rows, ""]))
    result = forcelab("import", tmp_path / "p.forcelab", file)
    output = "torn.csv: 3 samples are glitches, no force, and count as missing (fx 2, fz 1)."
    assert output in result.out.splitlines()
    with Project.open(tmp_path / "p.forcelab") as opened:
        assert opened.demonstrations.load("torn").signals[20:22, 0].tolist() == [3e12, -4e15]


def test_a_bad_file_is_named_and_left_out(forcelab, recordings, tmp_path):
    bad, notes = tmp_path / "bad.csv", tmp_path / "README.md"
    bad.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    notes.write_text("# Recordings\n\nOf 3 people on 2 days.\n\n1. foam\n2. stylus\n")
    project = tmp_path / "p.forcelab"
    words = ["import", project, recordings / "foam-01.csv", bad, notes]
    strict = forcelab(*words, "--strict").sentence
    assert strict.startswith("forcelab: 2 of 3 files cannot be read (bad.csv, README.md), so ")
    assert not project.exists()
    done = forcelab(*words)
    assert done.status == 1
    assert done.out.endswith("1 recording: 1 new, 0 updated, 0 unchanged, 2 files left out.\n")
    assert done.err.count("forcelab: left out: ") == 2
    assert "looks like a PNG picture" in done.err
    as_json = forcelab(*words, "--json")
    assert as_json.status == 1
    assert list(as_json.json["unread"]) == [str(bad), str(notes)]
    assert [row["status"] for row in as_json.json["demonstrations"]] == ["unchanged"]


def test_list_tells_what_there_is(forcelab, project):
    result = forcelab("list", project)
    assert "foam-01" in result.out
    assert "6 demonstrations" in result.out
    content = forcelab("list", project, "--task", "sponge", "--json").json
    assert [d["name"] for d in content["demonstrations"]] == ["sponge-11", "sponge-12"]
    assert content["demonstrations"][0]["labelled_seconds"]["coder"] > 1
    assert "no project" in forcelab("list", project.parent / "nothing.forcelab").sentence.lower()


def test_list_names_the_videos_where_there_are_several(forcelab, project, tmp_path):
    (film := tmp_path / "second.mkv").write_bytes(b"a film")
    with Project.open(project) as opened:
        info = opened.demonstrations.infos()[0]
        for name in (None, "left"):
            assert "Videos of" not in forcelab("list", project).out
            opened.media.attach_video(info.id, film, name=name)
    assert f"Videos of '{info.name}': video 1, left" in forcelab("list", project).out
    output = forcelab("list", project, "--json").json["demonstrations"]
    (row,) = [row for row in output if row["id"] == info.id]
    assert row["videos"] == ["video 1", "left"]
    assert [Path(path).is_file() for path in row["beside"]] == [True]


def test_a_list_reads_no_results_of_runs(forcelab, project, monkeypatch):
    forcelab("evaluate", project, "--task", "foam", *FAST_OPTIONS)
    monkeypatch.setattr(RunStore, "all", None)  # to call it would fail
    assert forcelab("list", project).out.endswith("6 demonstrations, 0 recognisers, 1 run.\n")


def test_the_list_tells_what_is_left_to_label(forcelab, project):
    def left(*words):
        found = forcelab("list", project, *words, "--json").json["demonstrations"]
        return [row["name"] for row in found]

    assert left("--to-label", "coder") == []
    assert len(left("--to-label", "Ada")) == 6
    forcelab("assign", project, "foam-01", "foam-02", "sponge-11", "--author", "coder")
    forcelab("assign", project, "foam-02", "--author", "coder", "--done")
    assert left("--to-label", "coder") == ["foam-01", "sponge-11"]
    assert left("--to-label", "coder", "--task", "sponge") == ["sponge-11"]
    forcelab("assign", project, "foam-01", "sponge-11", "--author", "coder", "--done")
    result = forcelab("list", project, "--to-label", "coder").out
    assert result == "Nothing of this is left to label for coder.\n"
    assert "there is 'coder'" in forcelab("list", project, "--to-label", "Coder").sentence


def test_doctor_tries_everything_and_finds_this_machine_well(forcelab):
    from forcelab.gui.exception_hook import log_file

    result = forcelab("doctor", "--json")
    findings = {finding["what"]: finding for finding in result.json}
    assert result.status == 0, result.out
    assert findings["Qt platform"]["well"]
    assert findings["video MPEG-4 (mp4v)"]["found"] == "writes and reads"
    assert {"python", "numpy", "fonts", "sqlite"} <= set(findings)
    assert str(log_file()) in findings["log file"]["found"]
    versions = findings["versions of the guide's figures"]
    assert versions["found"].startswith(f"{asset('constraints.txt')} (")


def test_doctor_names_what_is_missing_and_the_cure(forcelab, monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    monkeypatch.setattr("forcelab.cli.commands.doctor._version", lambda _: None)
    here = QtPlatform("6.8", "offscreen", fonts=3)
    monkeypatch.setattr("forcelab.gui.qt_check.probe", lambda: here)
    result = forcelab("doctor", "--json")
    findings = {finding["what"]: finding for finding in result.json}
    assert result.status == 1
    assert findings["pyserial"]["found"] == "missing"
    assert "pip install pyserial" in findings["pyserial"]["cure"]
    assert "cv2" in findings["video"]["found"]
    assert "(those of numpy, scipy, " in findings["versions of the guide's figures"]["found"]
    assert "Qt platform" in findings


@pytest.mark.parametrize("command", ["export", "figures", "predict"])
def test_a_folder_that_cannot_be_made_is_one_sentence(forcelab, project, tmp_path, command):
    (tmp_path / "file").write_text("")
    below = tmp_path / "file" / "sub"
    recogniser = tmp_path / "r.skops"
    if command == "predict":
        forcelab("train", project, "--task", "foam", *FAST_OPTIONS[:4], "--out", recogniser)
    words = {
        "export": ["export", project, "--out", below],
        "figures": ["figures", below],
        "predict": ["predict", recogniser, project, "--out", below],
    }[command]
    assert str(below) in forcelab(*words).sentence


@pytest.mark.parametrize("buffered", [True, False])  # not, as PYTHONUNBUFFERED asks
@pytest.mark.parametrize("words", [["list"], ["list", "--help"], ["--version"]])
def test_a_full_disk_behind_standard_output_is_one_sentence(
    forcelab, project, monkeypatch, words, buffered
):
    with (
        Path("/dev/full").open("wb", -1 if buffered else 0) as raw,
        TextIOWrapper(raw, write_through=not buffered) as full,
        monkeypatch.context() as patch,
    ):
        patch.setattr(sys, "stdout", full)
        result = forcelab(*words, *([project] if words == ["list"] else []))
    # To close what could not be written raises no error either.
    assert result.sentence == "forcelab: the output: No space left on device.\n"


def test_names_cannot_steer_the_terminal(forcelab_on_terminal, project, recordings, tmp_path):
    forcelab = forcelab_on_terminal
    (file := tmp_path / "new\x1b[31m.csv").write_bytes((recordings / "foam-01.csv").read_bytes())
    result = forcelab("import", project, file, "--task", "a\x1b[31m\nb")
    assert r"reading new\x1b[31m.csv" in result.err
    with Project.open(project) as opened:
        for name in ("front", "left\x1b[31m"):
            opened.media.attach_video(opened.demonstrations.id_of("new\x1b[31m"), file, name=name)
    result = forcelab("list", project)
    assert "\x1b" not in result.out
    assert r"a\x1b[31m\nb" in result.out
    assert r"Videos of 'new\x1b[31m': front, left\x1b[31m" in result.out


def test_what_an_encoding_lacks_is_printed_as_json_escapes_it(forcelab, project, monkeypatch):
    with Project.open(project) as opened:
        opened.demonstrations.rename(opened.demonstrations.id_of("foam-01"), "Prüfung 🙂")
    for words in (["list", project], ["list", project, "--json"]):
        with monkeypatch.context() as patch:
            patch.setattr(sys, "stdout", TextIOWrapper(BytesIO(), "latin-1"))
            assert forcelab(*words).status == 0
            sys.stdout.seek(0)
            output = sys.stdout.read()
        assert r"Prüfung \ud83d\ude42" in output
    assert "Prüfung 🙂" in [row["name"] for row in json.loads(output)["demonstrations"]]


@pytest.mark.parametrize("words", ["import NEW LINK", "predict LINK LINK", "export OLD --out LINK"])
def test_a_link_to_itself_is_one_sentence(forcelab, project, tmp_path, words):
    link = tmp_path / "link.csv"
    link.symlink_to(link)
    named = {"NEW": tmp_path / "new.forcelab", "OLD": project, "LINK": link}
    assert str(link) in forcelab(*(named.get(word, word) for word in words.split())).sentence


def test_a_folder_that_was_removed_meanwhile_is_told(forcelab, tmp_path, monkeypatch):
    folder = tmp_path / "gone"
    folder.mkdir()
    monkeypatch.chdir(folder)
    folder.rmdir()
    with Path(os.devnull).open("w") as nowhere, monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", nowhere)
        result = forcelab("list", "lab.forcelab").sentence
    assert result == "forcelab: this folder: No such file or directory.\n"


def test_an_error_is_one_line_whatever_names_hold(forcelab, tmp_path):
    assert r"none\nx" in forcelab("list", tmp_path / "none\nx.forcelab").sentence


def test_an_export_replaces_no_recording_and_stays_out_of_projects(forcelab, recordings, tmp_path):
    table = tmp_path / "foam-01.csv"
    table.write_bytes((recordings / "foam-01.csv").read_bytes())
    project = tmp_path / "p.forcelab"
    forcelab("import", project, table)
    before = table.read_bytes()
    assert forcelab("export", project, "--out", tmp_path).status == 0
    assert table.read_bytes() == before
    assert "read here" in forcelab("export", project, "--out", project).sentence


def test_nothing_is_written_among_the_files_of_a_project(forcelab, project, tmp_path):
    before = {path: path.stat().st_mtime_ns for path in project.rglob("*")}
    inside = project / "demonstrations"
    assert f"lies in the project '{project}'" in forcelab("figures", project).sentence
    assert "lies in the project" in forcelab("figures", inside / "new").sentence
    other = tmp_path / "other.forcelab"
    Project.create(other).close()
    words = ("export", other, "--out", inside, "--format", "archive")
    assert "in the project" in forcelab(*words).sentence
    words = ("evaluate", other, "--task", "foam", "--figure", inside / "pairs.svg")
    assert "in the project" in forcelab(*words).sentence
    assert {path: path.stat().st_mtime_ns for path in project.rglob("*")} == before


def test_an_export_that_fails_leaves_no_folder_behind(forcelab, project, tmp_path):
    next(project.glob("demonstrations/*/signals.npy")).unlink()
    existing = tmp_path / "kept"
    existing.mkdir()
    for out in (tmp_path / "new" / "deep", existing):
        words = ("export", project, "--out", out, "--format", "archive")
        assert "signals.npy" in forcelab(*words).sentence
    assert not (tmp_path / "new").exists()
    assert existing.is_dir()


def in_shell(words):
    command = ["bash", "-c", f"{sys.executable} -m forcelab {words}"]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_what_goes_to_a_closed_standard_error_does_not_go_to_standard_output(project):
    cases = ((f"list {project} --task chess --json", 1), (f"list {project} --sort", 2))
    for words, status in cases:
        done = in_shell(f"{words} 2>&-")
        assert (done.returncode, done.stdout) == (status, "")


def test_progress_can_be_told_to_nobody(project, recordings):
    done = in_shell(f"import {project} {recordings / 'foam-01.csv'} 2>&-")
    assert done.returncode == 0
    assert "1 recording" in done.stdout


@pytest.mark.parametrize("rows", ["fx,fy\n3,4\n2,1\n5,6\n", "time,fx\ntea,1\nwater,2\nmilk,3\n"])
def test_a_table_that_tells_no_rate_is_refused_with_the_option_that_cures_it(
    forcelab, tmp_path, rows
):
    table = tmp_path / "table.csv"
    table.write_text(rows)
    result = forcelab("import", tmp_path / "p.forcelab", table).sentence
    assert result.endswith("say how many samples there are a second (--rate).\n")


def test_closed_standard_output_is_no_traceback(project):
    assert "Traceback" not in in_shell(f"list {project} >&-").stderr


def test_two_first_imports_at_once_both_arrive(recordings, tmp_path):
    words = [sys.executable, "-m", "forcelab", "import", str(tmp_path / "p.forcelab")]
    both = [
        subprocess.Popen([*words, str(recordings / f"foam-0{i}.csv")], stdout=subprocess.DEVNULL)
        for i in (1, 2)
    ]
    assert [process.wait(timeout=60) for process in both] == [0, 0]
    with Project.open(tmp_path / "p.forcelab") as opened:
        assert len(opened.demonstrations.infos()) == 2


def test_an_unknown_task_is_told_with_those_there_are(forcelab, project):
    assert "foam, sponge" in forcelab("list", project, "--task", "chess").sentence


def test_names_of_files_are_distinct_and_stay_in_their_folder():
    names = ["a/b", "../x", "A", "a", "", "..", "a" * 300, "gr/ün: 1", "con\nrol", "ü", "u\u0308"]
    created = file_names(names)
    assert len({normalize("NFC", name).casefold() for name in created}) == len(names)
    for name in created:
        assert name.strip(" .")
        assert not set('/\\:\n"*?<>|') & set(name)
        assert len(name.encode()) < 255


def test_a_name_in_any_script_is_the_name_of_its_file():
    names = ["Übung – 2, links", "100% & more", "हिन्दी", "U\u0308bung", "実験・左手", "👍"]
    names += ["می\u200cخواهم", "1\u202f% 2"]
    assert file_names(names) == names


def start_on_terminal(words, cwd):
    """Start the program in a session of its own, with a terminal for standard error."""
    leader, follower = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "forcelab", *words],
        cwd=cwd,
        stdout=subprocess.DEVNULL,
        stderr=follower,
        start_new_session=True,
    )
    os.close(follower)
    return process, leader


def read_terminal(leader, until=b"\0"):
    """What stands on the terminal, up to some words or the end of the program."""
    shown = b""
    while until not in shown:
        try:
            shown += os.read(leader, 65536)
        except OSError:  # Linux says so when the other end is closed
            break
    return shown


def test_progress_is_shown_on_a_terminal_only(project, forcelab, forcelab_on_terminal):
    words = ["evaluate", project, "--task", "foam", *FAST_OPTIONS]
    result = forcelab_on_terminal(*words)
    assert result.status == 0
    assert "█" in result.err
    assert result.err.endswith("\r\x1b[K")
    assert forcelab(*words).err == ""


def test_a_bar_tells_how_long_its_stage_still_takes(terminal, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr("forcelab.cli.output.time.monotonic", lambda: now[0])
    steps = {
        (0, 0, 100, "features"): "features 0/100",
        (1, 4, 100, "features"): "features 4/100",  # too early to tell
        (6, 20, 100, "features"): "features 20/100, about 30 s left",
        (6.01, 21, 100, "features"): "features 20/100, about 30 s left",  # not drawn again so soon
        (28, 80, 100, "features"): "features 80/100, about 10 s left",
        (34, 99, 100, "features"): "features 99/100",  # nearly done
        (35, 0, 10, "fit"): "fit 0/10",
        (95, 1, 10, "fit"): "fit 1/10, about 9 min left",
    }
    with progress_bar() as watch:
        for (seconds, *step), line in steps.items():
            now[0] = seconds
            watch(Progress(*step))
            shown = terminal.getvalue().rpartition("\r")[2]
            assert re.sub(r"[█·]+ |\x1b\[K", "", shown) == line


def test_a_bar_tells_the_most_that_a_fit_takes_which_may_end_before_its_last_epoch(
    terminal, monkeypatch
):
    now = [0.0]
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr("forcelab.cli.output.time.monotonic", lambda: now[0])
    with progress_bar() as watch:
        for now[0] in (0.0, 2.0, 4.0):
            watch(FitProgress(round(1 + 10 * now[0]), 200, "fit", loss=0.5))
        assert "fit 41/200, up to 20 s left" in re.sub("[█·]+ ", "", terminal.getvalue())


def test_a_bar_fits_the_terminal(terminal, monkeypatch):
    monkeypatch.setattr(sys, "stderr", terminal)
    with progress_bar("measuring") as watch:
        watch(Progress(3, 5, 10 * "a very long name "))
    line = terminal.getvalue().split("\r")[1].removesuffix("\x1b[K")
    assert len(line) == 79
    assert "… █" in line


def test_quiet_commands_show_results_and_errors_only(forcelab_on_terminal, project, recordings):
    forcelab = forcelab_on_terminal
    words = ["evaluate", project, "--task", "foam", *FAST_OPTIONS, "--median", "20"]
    words += ["--decoder", "semi-markov"]  # which has no use for the median
    assert "--median has no effect" in forcelab(*words).err
    quiet = forcelab(*words, "--quiet")
    assert (quiet.status, quiet.err) == (0, "")
    assert "accuracy" in quiet.out
    words = ["import", project, recordings / "foam-01.csv", "--rate", "50"]
    assert "'Foam' is a new task" in forcelab(*words, "--task", "Foam").err
    assert forcelab(*words, "--task", "FOAM", "-q").err == ""
    assert "no project" in forcelab("list", "lst", "-q").err.lower()


def test_a_reader_that_stops_early_is_no_error(forcelab, project, monkeypatch):
    reader, writer = os.pipe()
    os.close(reader)  # as head does when it has seen enough
    with os.fdopen(writer, "w") as pipe, monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", pipe)
        result = forcelab("list", project)
    assert (result.status, result.err) == (0, "")


def interrupt_evaluation(project, delay):
    """What stands on the terminal after Ctrl+C, some seconds after the features have begun."""
    words = ["evaluate", str(project), "--jobs", "2"]
    process, leader = start_on_terminal(words, project.parent)
    assert b"features" in read_terminal(leader, b"features")
    time.sleep(delay)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to every process of the program
    shown = read_terminal(leader).decode()
    os.close(leader)
    # A shell gives 130 for either: `python -m` ends by the signal where it came while a text was
    # executed, as in the making of a dataclass, although it was caught.
    assert process.wait(timeout=30) in (130, -signal.SIGINT), shown
    assert "Traceback" not in shown
    return shown


def is_whole(project):
    """Whether a project is as it was before an evaluation that was stopped."""
    with Project.open(project) as opened:
        return len(opened.demonstrations.infos()) == 6 and opened.runs.all() == ()


def test_ctrl_c_stops_in_one_sentence_and_leaves_the_project_whole(project):
    shown = interrupt_evaluation(project, 0.3)
    assert shown.endswith("forcelab: stopped; nothing was left half done.\r\n")
    assert is_whole(project)


def test_an_interrupt_while_processes_start_shows_no_traceback(project):
    interrupt_evaluation(project, 0.0)


def test_ctrl_c_stops_what_is_done_in_one_process(forcelab, project, monkeypatch):
    pressed = partial(signal.raise_signal, signal.SIGINT)
    monkeypatch.setattr("sklearn.naive_bayes.GaussianNB.fit", lambda *_: pressed())
    result = forcelab("evaluate", project, *FAST_OPTIONS)
    assert (result.status, result.out) == (130, "")
    assert result.err == "forcelab: stopped; nothing was left half done.\n"
    assert is_whole(project)


def test_a_name_is_stripped_and_one_that_is_nearly_there_is_told(forcelab, recordings, tmp_path):
    project = tmp_path / "lab.forcelab"
    first, second, third = (recordings / f"foam-0{number}.csv" for number in (1, 2, 3))
    result = forcelab("import", project, first, "--task", " foam ", "--author", " Ines")
    assert result.err == ""
    result = forcelab("import", project, second, "--task", "Foam", "--author", "ines", "--json")
    assert result.json["demonstrations"]
    assert result.err.splitlines() == [
        "'ines' is a new coder beside 'Ines'.",
        "'Foam' is a new task beside 'foam'.",
    ]
    assert forcelab("import", project, third, "--task", "Foam", "--author", "ines ").err == ""
    result = forcelab("assign", project, "foam-01", "--author", "INES")
    assert result.err == "'INES' is a new coder beside 'Ines'.\n"
    with Project.open(project) as opened:
        assert [author.name for author in opened.coding.authors()] == ["Ines", "ines"]
        assert set(opened.demonstrations.tasks()) == {"foam", "Foam"}


def test_a_name_of_nothing_is_a_wrong_command_line(forcelab, recordings, tmp_path):
    words = ["import", tmp_path / "lab.forcelab", recordings / "foam-01.csv"]
    assert "--author: a name cannot be empty" in forcelab(*words, "--author", "  ").wrong_word
