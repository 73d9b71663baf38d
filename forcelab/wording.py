"""What sentences of many rooms have in common: counted nouns, and words that are not known."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from difflib import get_close_matches

__all__ = ["amount", "counted", "listed", "there_are", "unknown_word"]


def amount(count: int) -> str:
    """Bytes in kB or MB: of what is small, MB would tell nothing."""
    return f"{count / 1e6:.1f} MB" if count >= 1e6 else f"{-(-count // 1000)} kB"


def counted(number: int, noun: str) -> str:
    """A number with its noun: ``1 run``, ``6,008 samples``."""
    return f"{number:,} {noun}{'s' * (number != 1)}"


def listed(names: Sequence[str], most: int) -> str:
    """The first names, and how many more there are: ``a, b and 3 more``."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def there_are(number: int) -> str:
    """How many there are, as a sentence ends: ``there is 1``, ``there are none``."""
    return f"there {'is' if number == 1 else 'are'} {number or 'none'}"


def unknown_word(what: str, given: object, known: Collection[str]) -> str:
    """What to say of a word that is none of those one may choose from."""
    near = get_close_matches(str(given), known, n=1)
    meant = f"did you mean '{near[0]}'? Choose" if near else "choose"
    return f"There is no {what} '{given}'; {meant} from {', '.join(known)}."
