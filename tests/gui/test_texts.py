"""Every text on screen can be translated, and the translators' tool finds it."""

import ast
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
GUI = ROOT / "forcelab" / "gui"
#: Not of the window: pictures are drawn with the words of the paper, and the probe prints.
EXEMPT = {GUI / "platform.py", *(GUI / "figures").rglob("*.py")}
FILES = sorted(set(GUI.rglob("*.py")) - EXEMPT)
#: Calls whose texts people see; also as keywords of a constructor.
SETTERS = {
    "setText",
    "setToolTip",
    "setStatusTip",
    "setWhatsThis",
    "setWindowTitle",
    "setPlaceholderText",
    "setAccessibleName",
    "setAccessibleDescription",
    "setTitle",
    "setSuffix",
    "setPrefix",
    "setSpecialValueText",
    "setLabelText",
    "setInformativeText",
    "setDetailedText",
    "setNameFilter",
    "setHeaderLabels",
    "setHorizontalHeaderLabels",
    "setButtonText",
    "setTabText",
    "setItemText",
    "addAction",
    "addMenu",
    "addItem",
    "addItems",
    "addTab",
    "addRow",
    "addButton",
    "addToolBar",
    "addSection",
    "showMessage",
    "say",
    "getOpenFileName",
    "getSaveFileName",
    "getExistingDirectory",
    "getText",
    "ask_picture",
    "question",
    "warning",
    "information",
    "critical",
    "about",
    "QLabel",
    "QPushButton",
    "QToolButton",
    "QCheckBox",
    "QRadioButton",
    "QGroupBox",
    "QAction",
    "QMenu",
    "QDockWidget",
    "QMessageBox",
    "QProgressDialog",
    "QTreeWidgetItem",
    "QTableWidgetItem",
    "QListWidgetItem",
}
KEYWORDS = {"text", "toolTip", "title", "windowTitle", "placeholderText", "accessibleName"}
#: No words: punctuation, units, patterns of file names, the program's name.
UNTRANSLATED = re.compile(r"[\W\d_]*|\s*(s|ms|Hz|N|px)|(\*\.\w+[ ;]*)+|forcelab")
#: Of logging and not of the window.
LOGGERS = {"log", "logger", "logging"}
MARKERS = {"tr", "translate", "translated", "QT_TRANSLATE_NOOP"}


def called(node):
    """The last name of what is called, and what it is called on."""
    if isinstance(node.func, ast.Attribute):
        owner = node.func.value
        return node.func.attr, owner.id if isinstance(owner, ast.Name) else ""
    return (node.func.id, "") if isinstance(node.func, ast.Name) else ("", "")


def bare(node):
    """The words in an expression that are shown as they are."""
    if isinstance(node, ast.Call):
        name, _ = called(node)
        if name in MARKERS:
            return
        # "..." .format(x), ", ".join(x): the text in front counts, and what is put in does, too.
        yield from bare(node.func)
        for child in node.args if name in {"format", "join"} else ():
            yield from bare(child)
    elif isinstance(node, ast.Constant):
        if isinstance(node.value, str) and not UNTRANSLATED.fullmatch(node.value):
            yield node.value
    elif isinstance(node, ast.Attribute):
        yield from bare(node.value)
    elif isinstance(node, ast.JoinedStr):
        for part in node.values:
            yield from bare(part.value if isinstance(part, ast.FormattedValue) else part)
    elif isinstance(node, (ast.BinOp, ast.BoolOp, ast.IfExp, ast.List, ast.Tuple, ast.Starred)):
        parts = list(ast.iter_child_nodes(node))
        if isinstance(node, ast.IfExp):
            parts.remove(node.test)
        for child in parts:
            yield from bare(child)


@cache
def read(source):
    """What is told of a source, from one walk through it."""
    told = Told([], [], [], [])
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef) and hands_on(node):
            told.helpers.append(node.name)
        if not isinstance(node, ast.Call):
            continue
        name, owner = called(node)
        if name in SETTERS and owner not in LOGGERS:
            shown = [*node.args, *(k.value for k in node.keywords if k.arg in KEYWORDS)]
            told.untranslated += ((node.lineno, text) for part in shown for text in bare(part))
        texts = [part.value if isinstance(part, ast.Constant) else None for part in node.args]
        written = isinstance(next(iter(texts), None), str)
        told.calls.append((name, node.lineno, written))
        if name in MARKERS - {"translated"}:
            told.marked += [
                text for text in texts[0 if name == "tr" else 1 :][:1] if isinstance(text, str)
            ]
    return told


@dataclass
class Told:
    """Functions that hand on, bare texts with their lines, calls, texts that are marked."""

    helpers: list
    untranslated: list
    calls: list
    marked: list


def hands_on(function):
    """Whether a function hands its argument on to be translated."""
    return any(
        isinstance(call, ast.Call)
        and called(call)[0] == "translate"
        and isinstance(call.args[0], ast.Constant)
        and isinstance(call.args[1], ast.Name)
        for call in ast.walk(function)
    )


def untranslated(source):
    """What is shown without having been translated, with its line."""
    return read(source).untranslated


def helpers(source):
    """Functions that hand their argument on to be translated, which the tool does not know."""
    return read(source).helpers


@cache
def all_helpers():
    """Those of the whole window: one file may use another's."""
    return {name for file in FILES for name in helpers(file.read_text("utf-8"))}


def unfindable(source, handing_on):
    """Calls in which the tool finds no text: by another name, or with a text made on the way."""
    for name, line, written in read(source).calls:
        if (name in handing_on and written) or (name == "tr" and not written):
            yield f'line {line}: write translate("forcelab", "...") or self.tr("...")'


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(GUI)))
def test_every_text_on_screen_goes_through_translation(path):
    source = path.read_text("utf-8")
    assert not list(untranslated(source))
    assert not list(unfindable(source, all_helpers()))


def test_a_text_that_the_tool_cannot_see_is_found():
    helper = 'def _tr(text):\n    return QCoreApplication.translate("forcelab", text)\n'
    assert list(helpers(helper)) == ["_tr"]
    assert list(unfindable('x = _tr("Undo")', {"_tr"}))
    assert list(unfindable('x = self.tr(f"Undo {n}")', set()))
    assert not list(unfindable('x = self.tr("Undo")\ny = _tr(row.text)', {"_tr"}))


@pytest.mark.parametrize(
    "line",
    [
        'x.setText("Undo")',
        'x.setText(f"{n} segments")',
        'x.setText("Undo " + name)',
        'x.setText("Undo" if n else self.tr("Redo"))',
        'x.setText("{} segments".format(n))',
        'x.setText(", ".join(["one", name]))',
        'x = QLabel("Undo", self)',
        'x = QPushButton(text="Undo")',
        'x.addAction(icon, "Undo", self.undo)',
        'x.setHeaderLabels(["Keys", self.tr("Command")])',
        'document.say("That cannot be undone.", True)',
    ],
)
def test_a_text_that_was_forgotten_is_found(line):
    assert list(untranslated(line))


@pytest.mark.parametrize(
    "line",
    [
        'x.setText(self.tr("Undo"))',
        'x.setText(self.tr("{n} segments").format(n=3))',
        'x.setText(QCoreApplication.translate("forcelab", "Undo"))',
        'x.setText("")',
        'x.setText("–")',
        "x.setText(name)",
        'x.setText(f"{n:.3f}")',
        'x.setText(names["grab"])',
        'x.setObjectName("undo")',
        'x.setSuffix(" ms")',
        "painter.translate(x, y)",
        'log.warning("not on screen")',
    ],
)
def test_what_needs_no_translation_is_let_through(line):
    assert not list(untranslated(line))


def test_the_translators_tool_finds_every_text(tmp_path):
    found = tmp_path / "forcelab.ts"
    tool = Path(sys.executable).with_name("pyside6-lupdate")
    if not tool.exists():
        pytest.skip("this PySide came without its translators' tool")
    done = subprocess.run(
        [tool, *FILES, "-ts", found], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
    sources = {e.text for e in ET.parse(found).iter("source")}
    for path in FILES:
        missing = set(read(path.read_text("utf-8")).marked) - sources
        assert not missing, path
    assert len(sources) > 100


def test_where_names_are_cut_is_said_at_one_place():
    elsewhere = [
        path.relative_to(GUI).as_posix()
        for path in FILES
        if "ElideMiddle" in path.read_text("utf-8") and path.parent.name != "capture"
    ]
    assert elsewhere == []


@pytest.mark.parametrize(
    ("names", "like", "at"),
    [
        (("stylus 07", "stylus 08"), "stylu07", "middle"),
        (("insert left peg", "insert right peg"), "insert le…", "end"),
        (("turn the screw clockwise", "turn the screw anticlockwise"), "…turnclockwise", "start"),
    ],
)
def test_names_that_are_cut_are_told_apart(app, names, like, at):
    from forcelab.gui.figures import text

    face = text.font(11)
    room = text.width(like, face)
    shown = tuple(text.elided_name(name, face, room, names) for name in names)
    assert len(set(shown)) == len(names)
    assert all(text.width(name, face) <= room for name in shown)
    for one in shown:
        begun, ended = one.startswith("…"), one.endswith("…")
        assert (begun, ended) == (at == "start", at == "end")
