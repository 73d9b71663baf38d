"""Print a script that completes commands, options and file names by the Tab key.

Save it where the shell looks for it, and open a new terminal; write it again after an
update. 'forcelab install-launcher' does so on Linux. For zsh, the folder must be in fpath
before compinit is called in ~/.zshrc.

for example:
  forcelab completion bash > ~/.local/share/bash-completion/completions/forcelab
  forcelab completion zsh > ~/.zsh/completions/_forcelab
  forcelab completion fish > ~/.config/fish/completions/forcelab.fish
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator
from pathlib import Path

from forcelab.cli import build_parser
from forcelab.cli.options import path_of
from forcelab.recognition.presets import PRESETS
from forcelab.recognition.settings import FIELDS

SHELLS = ("bash", "zsh", "fish")
#: What an argument that is a path is called where it is a folder; otherwise it is a file.
FOLDERS = ("PROJECT", "DIR", "DATASET")
#: What completes a path in bash, which hands over words as they are typed. The functions that shtab
#: has for that stop at a space in a name.
PATHS = """
_forcelab_word() {{
  local word=${{1//\\\\/}}
  printf '%s' "${{word#[\\"\\']}}"
}}
{name}() {{
  compgen {option} -- "$(_forcelab_word "$1")"
}}"""


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("shell", metavar="SHELL", choices=SHELLS, help=", ".join(SHELLS))


def run(arguments: argparse.Namespace) -> None:
    print(completion_script(arguments.shell))


def completion_script(shell: str) -> str:
    """The script that completes the whole command line in a shell."""
    import shtab  # only here: no other command needs it

    files, folders = (
        {**kind, "bash": name, "preamble": {"bash": PATHS.format(name=name, option=option)}}
        for kind, name, option in (
            (shtab.FILE, "_forcelab_files", "-f"),
            (shtab.DIRECTORY, "_forcelab_dirs", "-d"),
        )
    )
    parser = build_parser()
    words: dict[str, list[str]] = {
        field.name: [value for value, _ in field.options] for field in FIELDS if field.options
    }
    words["preset"] = list(PRESETS)
    for action in _arguments(parser):
        action.choices = words.get(action.dest, action.choices)  # others may be taken, too
        if action.type in (Path, path_of):
            action.complete = folders if action.metavar in FOLDERS else files  # type: ignore[attr-defined]
    script: str = shtab.complete(parser, shell)
    # In zsh as shtab writes it, only the first of several files is completed.
    return re.sub(r'"\(\*\)::?', '"*:', script) if shell == "zsh" else script


def _arguments(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """The options and arguments of all commands."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _arguments(command)
        else:
            yield action
