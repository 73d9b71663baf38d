"""The rules that machines can keep: imports and style; test_types has the types."""

import ast
import json
import os
import re
import subprocess
import sys
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
CHECKS = {
    "imports point downwards only": ["lint-imports"],
    "lint": ["ruff", "check", "."],
    "format": ["ruff", "format", "--check", "."],
}
#: Outside packages, and the only files and folders below forcelab/ that may import them.
HOMES = {
    "PySide6": {"gui"},
    "pyqtgraph": {"gui"},
    "serial": {"capture"},
    "cv2": {"video", "capture/camera.py", "simulation/rendering.py"},
    "sklearn": {"recognition"},
    "skops": {"recognition"},
}


@cache
def imports_and_painters():
    """Of each file its imports, also those inside functions, and painters that no block ends."""
    found = {}
    for path in (ROOT / "forcelab").rglob("*.py"):
        tree = ast.parse(source := path.read_text("utf-8"))
        imports = [
            node for node in statements(tree) if isinstance(node, ast.Import | ast.ImportFrom)
        ]
        found[path] = imports, painters_left(tree) if "QPainter(" in source else set()
    return found


def statements(node):
    """All statements inside one; quicker than ast.walk(), which takes expressions apart, too."""
    for field in ("body", "orelse", "handlers", "finalbody", "cases"):
        for inner in getattr(node, field, ()):
            yield inner
            yield from statements(inner)


def painters_left(tree):
    nodes = list(ast.walk(tree))
    calls = [node for node in nodes if isinstance(node, ast.Call)]
    painters = {call for call in calls if getattr(call.func, "id", None) == "QPainter"}
    return painters - {item.context_expr for node in nodes for item in getattr(node, "items", ())}


def imports_of_all_files():
    return {path: imports for path, (imports, _) in imports_and_painters().items()}


def packages(nodes):
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module.split(".")[0]


def test_outside_packages_are_imported_in_their_own_rooms_only():
    strays = [
        f"{path.relative_to(ROOT)} imports {package}"
        for path, nodes in imports_of_all_files().items()
        for package in HOMES.keys() & set(packages(nodes))
        if not any(path.is_relative_to(ROOT / "forcelab" / home) for home in HOMES[package])
    ]
    assert not strays


def test_the_names_for_scripts_are_not_used_inside():
    # Through them any room could reach any other, unseen by the layers.
    for path, nodes in imports_of_all_files().items():
        for node in nodes:
            if isinstance(node, ast.ImportFrom):
                assert node.module != "forcelab", path
            elif isinstance(node, ast.Import):
                assert "forcelab" not in [alias.name for alias in node.names], path


def test_no_two_files_import_each_other_not_even_by_way_of_others():
    # The layers say nothing of files in one room: a view would know the one that knows it.
    named = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): nodes
        for path, nodes in imports_of_all_files().items()
    }
    whole = named.pop("forcelab")
    assert whole  # the names for scripts: loaded when they are used
    dependencies = {
        name: {
            f"{node.module}.{alias.name}" if f"{node.module}.{alias.name}" in named else node.module
            for node in nodes
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        & named.keys()
        for name, nodes in named.items()
    }
    try:
        TopologicalSorter(dependencies).prepare()
    except CycleError as error:
        pytest.fail("in a circle: " + " <- ".join(error.args[1]))


def test_a_painter_ends_with_its_block():
    """Where an error keeps one alive until what it drew on is gone, Qt crashes."""
    for path, (_, painters) in imports_and_painters().items():
        assert not painters, f"{path}: write 'with QPainter(…) as painter:'"


@pytest.mark.parametrize("command", CHECKS.values(), ids=CHECKS)
def test_the_house_rules_hold(command):
    program = Path(sys.executable).with_name(command[0])
    done = subprocess.run(
        [program, *command[1:]],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), "NO_COLOR": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


#: What commands do not load. Those of one list are imported one after the other by one process:
#: what all of them together have not loaded, none loads by itself.
UNNEEDED = {
    "commands": [
        ("forcelab", {"numpy", "sklearn"}),
        ("forcelab.cli", {"numpy", "PySide6", "sklearn", "cv2", "serial"}),
        ("forcelab.cli.commands.actions", {"numpy", "PySide6"}),
        ("forcelab.cli.commands.list", {"PySide6", "sklearn", "scipy", "cv2", "serial"}),
        ("forcelab.cli.commands.measure", {"PySide6", "sklearn", "scipy", "cv2", "serial"}),
        ("forcelab.cli.commands.import_", {"PySide6", "sklearn", "scipy", "cv2", "serial"}),
        ("forcelab.cli.commands.plan", {"PySide6", "sklearn", "scipy.signal", "joblib", "cv2"}),
        ("forcelab.review.training", {"PySide6", "sklearn", "scipy.signal", "cv2", "serial"}),
        ("forcelab.signals.cwt", {"PySide6", "sklearn", "cv2", "serial"}),
        ("forcelab.cli.commands.simulate", {"PySide6", "sklearn", "cv2", "serial"}),
        ("forcelab.cli.commands.evaluate", {"PySide6", "cv2", "serial"}),
    ],
    "the sample project": [
        ("forcelab.cli.commands.demo", {"PySide6", "sklearn", "scipy", "cv2", "serial"}),
    ],
    "window": [
        ("forcelab.gui.window", {"sklearn", "scipy", "cv2", "serial", "joblib"}),
        ("forcelab.gui.figures.clusters", {"sklearn", "cv2", "serial"}),
    ],
}
LOADED = """
import importlib, json, sys
for name in sys.argv[1:]:
    importlib.import_module(name)
    print(json.dumps([*sys.modules]))
"""


@pytest.mark.parametrize("unneeded", UNNEEDED.values(), ids=UNNEEDED)
def test_what_a_command_does_not_need_is_not_loaded(unneeded):
    script = [sys.executable, "-c", LOADED, *(command for command, _ in unneeded)]
    done = subprocess.run(script, capture_output=True, text=True, check=True, cwd=ROOT)
    for (command, never), loaded in zip(unneeded, done.stdout.splitlines(), strict=True):
        assert not never & set(json.loads(loaded)), command


def test_the_way_in_for_developers_names_what_there_is():
    package = ROOT / "forcelab"
    text = (package / "README.md").read_text("utf-8")
    named = re.findall(r"`([a-z_/]+(?:\.py|/))`", text)
    assert len(named) > 60
    assert [name for name in named if not (package / name).exists()] == []
    rooms = {path.parent.name for path in package.glob("*/__init__.py")}
    assert rooms == {room.rstrip("/") for room in re.findall(r"^\| `([a-z]+/)`", text, re.M)}
    for function, module in re.findall(r"`([a-z_]+)`(?:\)| in) (?:in )?`([a-z_/]+\.py)`", text):
        assert f"def {function}(" in (package / module).read_text("utf-8"), function
