"""Mutated texts: bytes changed, cut out, doubled and moved; values of JSON made something else."""

from __future__ import annotations

import json
import random
from collections.abc import Iterator
from typing import Any

#: What stands in place of a value of JSON.
STRANGE: tuple[Any, ...] = (
    *(None, True, -1, 0, 1e308, -1e308, 10**400, 0.1, "", "\0", "\ud800", "x" * 2000),
    *([], [[]], {}, {"a": 1}, "NaN", float("nan"), "../../etc/passwd", [1, 2, 3], "player #1:|"),
)

#: What is put between two bytes.
MARKS = (b'"', b",", b";", b"\t", b"\n", b"{", b"]", b"-", b"9" * 30, b"\0", b"\xff")


def mutated_bytes(content: bytes, count: int, seed: int = 0) -> Iterator[bytes]:
    """So many mutations of a file."""
    chance = random.Random(seed)
    for _ in range(count):
        mutated = bytearray(content)
        for _ in range(chance.choice((1, 1, 2, 5))):
            at = chance.randrange(len(mutated) + 1)
            to = min(len(mutated), at + chance.choice((1, 2, 8, 64, 1000)))
            match chance.randrange(5):
                case 0:
                    mutated[at:to] = bytes(chance.randrange(256) for _ in range(to - at))
                case 1:
                    del mutated[at:to]
                case 2:
                    mutated[at:at] = mutated[at:to] * chance.choice((1, 3))
                case 3:
                    mutated[at:at] = chance.choice(MARKS)
                case _:
                    del mutated[at:]
        yield bytes(mutated)


def mutated_json(content: bytes, count: int, seed: int = 0) -> Iterator[bytes]:
    """So many texts in which a value or two are something else, or missing."""
    chance = random.Random(seed)
    for _ in range(count):
        root = json.loads(content)
        for _ in range(chance.choice((1, 1, 2, 4))):
            places = list(_places(root))
            if not places:
                break
            holder, key = chance.choice(places)
            if isinstance(holder, dict) and chance.random() < 0.3:
                del holder[key]
            elif chance.random() < 0.2:
                holder[key] = chance.choice(places)[0]
            else:
                holder[key] = chance.choice(STRANGE)
        try:
            yield json.dumps(root).encode("utf-8", "surrogatepass")
        except ValueError:  # a value that holds itself
            yield content[: len(content) // 2]


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Each object or list in a value, with each of its keys."""
    pending, seen = [value], set()
    while pending:
        holder = pending.pop()
        if not isinstance(holder, (dict, list)) or id(holder) in seen:
            continue
        seen.add(id(holder))
        for key in list(holder) if isinstance(holder, dict) else range(len(holder)):
            yield holder, key
            pending.append(holder[key])
