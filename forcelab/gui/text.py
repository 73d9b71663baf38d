"""Names in menus and searches, and questions to the coder."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMessageBox, QWidget

from forcelab.text import name_alike, tidy_name


def escape_ampersands(name: str) -> str:
    """A name for menus and buttons, where a single ampersand would mark a key."""
    return name.replace("&", "&&")


def contains_words(text: str, query: str) -> bool:
    """Whether a text has each word of what is searched for, in any order."""
    text = text.casefold()
    return all(word in text for word in query.casefold().split())


def name_fields(sentence: str, fields: Mapping[str, str]) -> str:
    """A sentence with the fields of a dialog in place of the options of the command line.

    ``(--offset 1.5)`` becomes ``(Add to all times: 1.5)``; what is chosen by a word needs no value.
    """

    def field(match: re.Match[str]) -> str:
        option, value = match.groups()
        name = fields.get(option, option)
        return f"({name}: {value})" if value and ":" not in name else f"({name})"

    return re.sub(r"\((--[a-z-]+)(?: ([^()]*))?\)", field, sentence)


def settle_name(parent: QWidget | None, name: str, known: Iterable[str]) -> str:
    """A tidied name; if it nearly is a known one, the coder is asked which to use."""
    name = tidy_name(name)
    existing = name_alike(name, known)
    if existing is None:
        return name
    answers = f"Use '{existing}'", f"Add '{name}'"
    detail = f"'{name}' would be another name beside it."
    answer = ask(parent, "Nearly the same name", f"'{existing}' already exists.", detail, answers)
    return name if answer == answers[1] else existing


def confirm(parent: QWidget | None, title: str, question: str, detail: str, verb: str) -> bool:
    """Ask whether to do what cannot be undone; neither Enter nor Escape does it."""
    answers = verb, "Cancel"
    return ask(parent, title, question, detail, answers, default=1, escape=1) == verb


def ask(
    parent: QWidget | None,
    title: str,
    question: str,
    detail: str,
    answers: Sequence[str],
    *,
    default: int = 0,
    escape: int = 0,
) -> str:
    """Ask a question in plain text; gives the pressed answer, that of `escape` when closed.

    `default` and `escape` are indices of the answers that Enter and Escape give; the first answer
    accepts.
    """
    box = QMessageBox(parent)
    box.setIcon(QMessageBox.Icon.Question)
    box.setWindowTitle(title)
    box.setTextFormat(Qt.TextFormat.PlainText)  # a name is not markup
    box.setText(question)
    box.setInformativeText(detail)
    buttons = []
    for i, text in enumerate(answers):
        rejects = i == escape > 0
        role = QMessageBox.ButtonRole.RejectRole if rejects else QMessageBox.ButtonRole.AcceptRole
        buttons.append(box.addButton(escape_ampersands(text), role))
    box.setDefaultButton(buttons[default])
    box.setEscapeButton(buttons[escape])
    box.exec()
    pressed = [text for text, b in zip(answers, buttons, strict=True) if b is box.clickedButton()]
    box.deleteLater()
    return pressed[0] if pressed else answers[escape]
