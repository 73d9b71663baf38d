"""One setting as forms present it: what it is called, what it does, and its range."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

FieldKind = Literal[
    "number", "whole", "choice", "flag", "channels", "windows", "merge", "folder", "paths"
]


@dataclass(frozen=True, slots=True)
class SettingField:
    """One setting in a form."""

    name: str  # by which it is stored
    kind: FieldKind  # which editor it has
    #: label, tip: what it is called, and what it does
    label: str
    tip: str
    #: lowest, highest, step: of a number: its range in the form, and what one click adds
    lowest: float = 0.0
    highest: float = 1e6
    step: float = 1.0
    decimals: int = 0  # of a number
    unit: str = ""  # of a number
    options: tuple[tuple[str, str], ...] = ()  # of a choice: values, and what they are called
    #: What a switch that is turned on begins with; a field that has it can be off, which is None
    default: float | None = None
