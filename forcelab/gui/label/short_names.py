"""Names of actions where there is no room for them: shortened so that they are still told apart."""

from __future__ import annotations

from functools import lru_cache

from PySide6.QtGui import QFont

from forcelab.gui.figures import text

__all__ = ["fitting", "signs"]

#: Stands where letters are left out.
LEFT_OUT = "…"
#: Letters beside that sign: with fewer, it would take the room of those that tell the name.
LEAST = 3


@lru_cache(maxsize=4096)
def fitting(name: str, names: tuple[str, ...], size: float, room: int) -> tuple[str, float]:
    """As much of a name as fits into so many pixels, and its width.

    A beginning that other names have too tells nothing: ``slip transition`` beside ``slip`` is
    ``slip tra…``, then ``s…tra``, then ``st``; never ``sl``.

    Parameters
    ----------
    name : str
        Of an action.
    names : tuple of str
        Of all actions that are shown.
    size : float
        Height of the letters in pixels.
    room : int
        In pixels.
    """
    face, whole = text.font(size), text.shown(name)
    if (wide := text.width(whole, face)) <= room:
        return whole, wide
    others = [text.shown(other) for other in names if other != name]
    common = max((_common(whole, other) for other in others), default=0)
    common += len(whole[common:]) - len(whole[common:].lstrip())
    short = text.elided(whole, face, room)
    kept = len(short) - len(LEFT_OUT)
    if kept < LEAST or (common >= LEAST and kept <= common):
        short = _joined(whole, common, face, room) if common >= LEAST else ""
    if not short:
        tokens = signs(tuple(dict.fromkeys((*names, name))))[name]
        short = next((sign for sign in tokens if text.width(sign, face) <= room), "")
    return short, text.width(short, face)


@lru_cache(maxsize=256)
def signs(names: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """Two letters and one letter of each name; none where another name has the same.

    Parameters
    ----------
    names : tuple of str
        An earlier name does not change its sign for a later one, unless that begins like it.
    """
    shown = {name: text.shown(name) for name in names}
    pairs: dict[str, str] = {}
    later = []
    for name, whole in shown.items():
        if whole[:2] not in pairs.values():
            pairs[name] = whole[:2]
        else:
            later.append(name)
    for name in later:
        whole = shown[name]
        tail = whole[max(_common(whole, o) for n, o in shown.items() if n != name) :]
        made = (whole[0] + letter for letter in (*tail, *whole[1:]) if not letter.isspace())
        pairs[name] = next((pair for pair in made if pair not in pairs.values()), "")
    firsts = [whole[:1] for whole in shown.values()]
    return {
        name: tuple(filter(None, (pairs[name], whole[:1] if firsts.count(whole[:1]) == 1 else "")))
        for name, whole in shown.items()
    }


def _joined(whole: str, common: int, face: QFont, room: int) -> str:
    """The first letter, and what follows after what other names begin with, too."""
    tail = whole[common:]
    for count in range(len(tail), 0, -1):
        short = f"{whole[0]}{LEFT_OUT}{tail[:count].rstrip()}"
        if text.width(short, face) <= room:
            return short
    return ""


def _common(one: str, other: str) -> int:
    """How many letters two names begin with alike."""
    count = 0
    for a, b in zip(one, other, strict=False):
        if a != b:
            break
        count += 1
    return count
