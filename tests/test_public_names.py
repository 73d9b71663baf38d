"""The names that scripts import."""

import ast
import subprocess
import sys
from pathlib import Path

import forcelab


def test_every_public_name_is_there():
    for name in forcelab.__all__:
        assert getattr(forcelab, name) is not None
    assert forcelab.load_recogniser.__module__ == "forcelab.recognition.storage"


def test_type_checkers_are_told_the_same_names():
    tree = ast.parse(Path(forcelab.__file__).read_text("utf-8"))
    (checked,) = (node for node in tree.body if isinstance(node, ast.If))
    told = {
        alias.asname: (node.module, alias.name) for node in checked.body for alias in node.names
    }
    there = {name: (f"forcelab.{home}", real) for name, (home, real) in forcelab._HOMES.items()}
    assert told == there


def test_importing_forcelab_loads_nothing_else():
    script = "import sys, forcelab; print('numpy' in sys.modules, 'sklearn' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout == "False False\n"
