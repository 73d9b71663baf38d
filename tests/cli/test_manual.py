"""The manual page, read by the programs that show such pages."""

import io
import re
import shutil
import subprocess
from contextlib import redirect_stdout

import pytest

from forcelab.cli import command_modules, main


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("manual") / "forcelab.1"
    with redirect_stdout(io.StringIO()) as text, pytest.MonkeyPatch.context() as patch:
        patch.setenv("FORCE_COLOR", "1")  # as help has it on a terminal from Python 3.14 on
        assert main(["manual"]) == 0
    assert "\x1b" not in text.getvalue()
    path.write_text(text.getvalue(), "utf-8")
    return path


def run_on(page, *command):
    if shutil.which(command[0]) is None:
        pytest.skip(f"{command[0]} is not installed")
    return subprocess.run([*command, page], capture_output=True, text=True, check=True)


@pytest.mark.parametrize("command", ["mandoc -Tlint -Wwarning", "groff -man -ww -Tutf8 -z"])
def test_the_page_is_well_formed(page, command):
    done = run_on(page, *command.split())
    assert done.stdout + done.stderr == ""


def test_the_page_describes_every_command_with_its_options_and_examples(page):
    shown = run_on(page, "groff", "-man", "-Tascii", "-P-cbou").stdout
    assert re.findall(r"^   ([a-z-]+)$", shown, re.M) == list(command_modules())
    evaluate = shown.partition("\n   evaluate\n")[2].partition("\n   train\n")[0]
    assert "forcelab evaluate [options] PROJECT" in evaluate
    assert re.search(r"^       --test-task TASK$", evaluate, re.M)
    assert "--task stylus --preset best --figure pairs.svg" in evaluate
    assert "boundary_ms, 0 wherever" in evaluate  # what stands behind the options
    assert not re.search(r"^ +-q, --quiet", evaluate, re.M)  # said once, for all commands
    assert shown.count("-q, --quiet") == 1


def test_on_a_narrow_terminal_all_but_examples_is_broken_between_words(page):
    shown = run_on(page, "groff", "-man", "-Tascii", "-P-cbou").stdout
    # An example may be copied as it stands; it is indented further than the text, and less than
    # what an option means.
    assert [x for x in shown.splitlines() if len(x) > 80 and not re.match(" {9}\\S", x)] == []
    assert "ULE:FUNCTION" not in shown.replace("MODULE:FUNCTION", "")
    rows = shown.partition("\n   export\n")[2]
    assert re.search(
        r"^       csv    one per demonstration, one row per segment:\n {14}start", rows, re.M
    )
    assert re.search(r"^       --task TASK\n {14}only this", rows, re.M)
    assert "\\fB\\-\\-task\\fR \\fITASK\\fR\n" in page.read_text("utf-8")
