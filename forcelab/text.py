"""Words of many rooms: counted nouns, unknown words, and names of coders and tasks."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from difflib import get_close_matches
from functools import lru_cache


def amount(count: int) -> str:
    """Bytes in kB or MB: of what is small, MB would tell nothing."""
    return f"{count / 1e6:.1f} MB" if count >= 1e6 else f"{-(-count // 1000)} kB"


def percent(share: float | None) -> str:
    """A fraction in percent with one decimal; a dash where there is none."""
    return "-" if share is None else f"{100 * share:.1f}"


def duration_text(seconds: float) -> str:
    """Seconds, or minutes where there are many."""
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"


def counted(number: int, noun: str) -> str:
    """A number with its noun: ``1 run``, ``6,008 samples``."""
    return f"{number:,} {noun}{'s' * (number != 1)}"


def were(number: int) -> str:
    """The verb behind a number of things."""
    return "was" if number == 1 else "were"


def left_out(number: int, what: str) -> str:
    """What was left out, as a sentence begins: ``2 states without length were left out``."""
    noun, *more = re.split("(?= of | that | without )", what, maxsplit=1)
    return f"{counted(number, noun)}{''.join(more)} {were(number)} left out"


def task_text(task: str) -> str:
    """A task in words; demonstrations may be of none."""
    return task or "no task"


def listed(names: Sequence[str], most: int = 8) -> str:
    """The first names, and how many more there are: ``a, b and 3 more``."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def unique_names(names: Sequence[str]) -> list[str]:
    """Names with numbers behind those that repeat one before: ``fx``, ``fx 2``."""
    known, used = set(names), set[str]()
    counts: dict[str, int] = {}  # so that thousands of one name take no longer than others
    result = []
    for name in names:
        new, count = name, counts.get(name, 1)
        while new in used or (new != name and new in known):
            count += 1
            new = f"{name} {count}"
        counts[name] = count
        used.add(new)
        result.append(new)
    return result


@lru_cache(maxsize=1 << 14)
def natural_order(name: str) -> tuple[tuple[bool, int, str], ...]:
    """A sorting key by which ``pen-2`` comes before ``pen-10``, and ``2`` before ``pen``."""
    parts = re.findall(r"(\d+)|(\D+)", name)
    # A number sorts by its length before its digits: as many as one likes are no number of Python.
    numbers = ((digits.lstrip("0"), word.casefold()) for digits, word in parts)
    return tuple((bool(word), len(digits), digits or word) for digits, word in numbers)


def there_are(number: int) -> str:
    """How many there are, as a sentence ends: ``there is 1``, ``there are none``."""
    return f"there {'is' if number == 1 else 'are'} {number or 'none'}"


def unknown_word(noun: str, word: object, known: Collection[str]) -> str:
    """The sentence on a word that is not among those to choose from."""
    near = get_close_matches(str(word), known, n=1)
    hint = f"did you mean '{near[0]}'? Choose" if near else "choose"
    return f"There is no {noun} '{word}'; {hint} from {', '.join(known)}."


def tidy_name(name: str) -> str:
    """A name as it is kept, wherever it was typed: no spaces around it."""
    return name.strip()


def name_alike(name: str, known: Iterable[str]) -> str | None:
    """The known name that differs from a new one only by case or spaces, if there is one."""
    names = list(known)
    if name in names:
        return None
    folded = name.casefold().split()
    return next((other for other in names if other.casefold().split() == folded), None)
