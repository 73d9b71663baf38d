"""Put forcelab into the menu of applications, with completion and manual page.

On Linux, for the current user: writes a desktop entry and its icon, the manual page, and
the completion of bash, fish and zsh into XDG_DATA_HOME (by default ~/.local/share). zsh
has to be told that folder in ~/.zshrc, before compinit:
  fpath=(~/.local/share/zsh/site-functions $fpath)
The entry starts the program that wrote it. After a move or an update, write all of it
again.

for example:
  forcelab install-launcher
  forcelab install-launcher --remove
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path

import forcelab.gui
from forcelab.cli.options import add_json
from forcelab.cli.output import print_result, printable
from forcelab.errors import InputError
from forcelab.io import write_atomically

#: StartupWMClass is what X11 is told of the window, by which a dock knows whose it is.
ENTRY = """\
[Desktop Entry]
Type=Application
Version=1.1
Name=forcelab
GenericName=Force labelling
Comment=Label and recognise force actions
Exec={command}
Icon=forcelab
Terminal=false
Categories=Science;DataVisualization;Qt;
Keywords=force;label;annotation;recognition;
StartupWMClass=forcelab
"""

#: Where each shell looks for the completion of a command, below the data of a user.
COMPLETIONS = {
    "bash": "bash-completion/completions/forcelab",
    "fish": "fish/vendor_completions.d/forcelab.fish",
    "zsh": "zsh/site-functions/_forcelab",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--remove", action="store_true", help="remove all of it again")
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    if not sys.platform.startswith("linux"):
        raise InputError(
            "A launcher can be installed on Linux only; elsewhere, make a shortcut to the program "
            "'forcelab'."
        )
    data = _data_folder()
    themes = data / "icons" / "hicolor"
    icon = themes / "scalable" / "apps" / "forcelab.svg"
    entry = data / "applications" / "forcelab.desktop"
    manual = data / "man" / "man1" / "forcelab.1"
    completions = {shell: data / path for shell, path in COMPLETIONS.items()}
    files = [icon, entry, manual, *completions.values()]
    if arguments.remove:
        present = [path for path in files if path.is_file()]
        for path in present:
            path.unlink()
        outcome = "Removed" if present else f"There is no launcher in {data}."
    else:
        from forcelab.cli.commands.completion import completion_script  # these two load all
        from forcelab.cli.commands.manual import manual_page  # commands

        present = files
        for path in present:
            path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(icon, Path(forcelab.gui.__file__).with_name("forcelab.svg").read_bytes())
        os.utime(themes)  # by which desktops notice that their cache of the theme is old
        text = ENTRY.format(command=exec_value(_program()))
        write_atomically(entry, text.encode("utf-8", "surrogateescape"))
        write_atomically(manual, manual_page().encode())
        for shell, path in completions.items():
            write_atomically(path, completion_script(shell).encode())
        outcome = "Wrote"
    content = {"removed" if arguments.remove else "written": [str(path) for path in present]}
    lines = [outcome, *(f"  {printable(str(path))}" for path in present)]
    print_result(arguments.json, content, "\n".join(lines))


def exec_value(command: Sequence[str]) -> str:
    """The value of the key Exec, quoted as the Desktop Entry Specification says.

    Within the quotes a backslash goes before each of four characters, and percent signs are
    doubled, as %f stands for a file. What that gives is written as any value of the file is, with
    each backslash doubled.
    """
    quoted = (re.sub(r'[\\"`$]', r"\\\g<0>", argument) for argument in command)
    value = " ".join(f'"{argument}"' for argument in quoted)
    value = value.replace("%", "%%").replace("\\", "\\\\")
    return value.replace("\n", "\\n").replace("\t", "\\t").replace("\r", "\\r")


def _program() -> list[str]:
    """The command that starts the program which is running."""
    script = Path(sys.argv[0])
    if script.name == "forcelab" and script.is_file():
        return [str(script.absolute())]
    return [sys.executable, "-m", "forcelab"]


def _data_folder() -> Path:
    """Where the desktop looks for what belongs to this user; a relative folder does not count."""
    folder = Path(os.environ.get("XDG_DATA_HOME", ""))
    return folder if folder.is_absolute() else Path.home() / ".local" / "share"
