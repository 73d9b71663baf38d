"""One setting in the form: what it is called, what it may be, and when it is used."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from forcelab.recognition.settings import counts

__all__ = ["Field", "Values"]

Kind = Literal["number", "whole", "choice", "flag", "channels", "merge"]
#: What a form holds, by the names of :class:`~forcelab.recognition.settings.Settings`.
Values = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Field:
    """One setting in the form.

    Parameters
    ----------
    name : str
        As of :class:`~forcelab.recognition.settings.Settings`.
    kind : str
        Which editor it has.
    label, tip : str
        In English; what it is called, and what it does.
    lowest, highest, step : float
        Of a number: its range in the form, and what one click adds.
    decimals : int
        Of a number.
    unit : str
        Of a number, in English.
    options : tuple of (str, str)
        Of a choice: values, and what they are called in English.
    default : float, optional
        What a switch that is turned on begins with; a field that has it can be off, which is None.
    """

    name: str
    kind: Kind
    label: str
    tip: str
    lowest: float = 0.0
    highest: float = 1e6
    step: float = 1.0
    decimals: int = 0
    unit: str = ""
    options: tuple[tuple[str, str], ...] = ()
    default: float | None = None

    def applies(self, values: Values) -> bool:
        """Whether it is used, told from all values of the form."""
        return counts(self.name, values)

    @property
    def shown(self) -> str:
        """What it is called in the coder's language."""
        return self.label

    @property
    def shown_tip(self) -> str:
        """What it does, in the coder's language."""
        return self.tip
