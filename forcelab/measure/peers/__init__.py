"""What others made, measured beside ours where it is installed: ways to recognise time series."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec

from forcelab.errors import InputError

__all__ = ["Library"]


@dataclass(frozen=True)
class Library:
    """A library by its name, and the module that is imported."""

    name: str
    module: str

    @property
    def installed(self) -> bool:
        """Whether it can be imported."""
        return find_spec(self.module) is not None

    def check(self) -> None:
        """Raise an `InputError` if it is not installed."""
        if not self.installed:
            raise InputError(
                f"{self.name} is not installed ({self.module}); pip install 'forcelab[peers]' has "
                f"it."
            )
