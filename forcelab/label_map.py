"""Label maps: spellings that mean the same action."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

from forcelab.errors import InputError
from forcelab.io import small_text
from forcelab.labels import Segment, Segments, check_action_name


@dataclass(frozen=True, init=False)
class MergeMap:
    """Which spellings mean the same action, such as ``grap_pen -> grab``.

    Applied when a recogniser is trained or scored, never to stored labels. Applying a map twice
    gives the same as applying it once.

    Parameters
    ----------
    targets : mapping of str to str
        From the spelling found to the action meant; actions that are not in it stay as they are.

    Raises
    ------
    InputError
        If a name is blank, or an action is merged into one that is itself merged into another.

    Examples
    --------
    >>> merge = forcelab.MergeMap({"grap_pen": "grab", "grab_pen": "grab"})
    >>> settings.replace(merge=merge).merge.items()
    (('grab_pen', 'grab'), ('grap_pen', 'grab'))
    """

    _pairs: tuple[tuple[str, str], ...]

    def __init__(self, targets: Mapping[str, str] | None = None) -> None:
        targets = dict(targets or {})
        for source, target in targets.items():
            if not source.strip() or not target.strip():
                raise InputError(f"The merge '{source}' -> '{target}' needs two names.")
            final = targets.get(target, target)
            if final != target:
                raise InputError(
                    f"'{source}' is merged into '{target}', but '{target}' itself into '{final}'; "
                    f"merge each action straight into its last name."
                )
        object.__setattr__(self, "_pairs", tuple(sorted(targets.items())))

    def items(self) -> tuple[tuple[str, str], ...]:
        """Pairs ``(spelling found, action meant)``, sorted."""
        return self._pairs

    def unused(self, actions: Iterable[str]) -> tuple[str, ...]:
        """The spellings of the map that are none of these actions, sorted; perhaps mistyped."""
        existing = set(actions)
        return tuple(source for source, _ in self._pairs if source not in existing)

    def check_targets(self) -> None:
        """Refuse a new map that merges into no action; one of an old run is still read.

        Raises
        ------
        InputError
            If it does.
        """
        for _, target in self._pairs:
            check_action_name(target)

    def apply_segments(self, segments: Sequence[Segment]) -> Segments:
        """Relabel segments.

        Edges stay where they are: neighbours that touch and now have the same action stay two
        segments.
        """
        targets = dict(self._pairs)
        return tuple(
            replace(segment, action=targets[segment.action])
            if segment.action in targets
            else segment
            for segment in segments
        )

    def to_json(self) -> dict[str, str]:
        """The map as an object of strings."""
        return dict(self._pairs)

    @classmethod
    def from_json(cls, targets: object) -> MergeMap:
        """Build a map from what :meth:`to_json` gave.

        Raises
        ------
        InputError
            If it is anything but an object of strings, or not a valid map.
        """
        if not isinstance(targets, dict):
            raise InputError("A merge map must be an object of strings.")
        for source, target in targets.items():
            if not isinstance(target, str):
                raise InputError(f"The merge of '{source}' must name an action, not be {target}.")
        return cls(targets)

    @classmethod
    def read(cls, path: str | PathLike[str]) -> MergeMap:
        """Read a map from a JSON file such as ``{"grap_pen": "grab", "slip_pen": "slip"}``.

        Raises
        ------
        InputError
            If the file cannot be read, is not JSON, names a spelling twice or is not a valid map.
        """
        try:
            text = small_text(Path(path), "utf-8-sig")
            merge_map = cls.from_json(json.loads(text, object_pairs_hook=_distinct))
            merge_map.check_targets()
            return merge_map
        except OSError as error:
            raise InputError(f"The merge map {path} cannot be read: {error.strerror}.") from error
        except InputError as error:
            raise InputError(f"{path}: {error}") from error
        except json.JSONDecodeError as error:
            raise InputError(
                f"The merge map {path} is not JSON: {error.msg} in line {error.lineno}."
            ) from error
        except (ValueError, RecursionError) as error:
            raise InputError(f"The merge map {path} is not a text of JSON.") from error


def _distinct(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """A JSON object, unless one name occurs in it twice."""
    targets: dict[str, object] = {}
    for name, target in pairs:
        if name in targets:
            raise InputError(f"'{name}' is merged twice; keep one of the two lines.")
        targets[name] = target
    return targets
