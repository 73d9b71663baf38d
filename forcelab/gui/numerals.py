"""Large numbers as they are read most easily."""

from __future__ import annotations

__all__ = ["thousands"]


def thousands(number: int) -> str:
    """A whole number with its thousands apart."""
    return f"{number:,}"
