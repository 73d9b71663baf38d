"""Tiers, as ELAN and Praat have them: authors whose annotations are actions, or actions."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from forcelab.errors import InputError
from forcelab.formats.label_files import LabelOptions
from forcelab.labels import Segment, Track
from forcelab.text import left_out, listed


@dataclass(frozen=True, slots=True)
class Annotation:
    """What a tier says of a stretch of time, in seconds; its text may be blank."""

    start: float
    end: float
    text: str


@dataclass(frozen=True, slots=True)
class Tier:
    """A row of annotations."""

    name: str
    annotations: tuple[Annotation, ...]
    annotator: str = ""  #: who made it, where that is known


#: What ELAN calls the tier of a new file.
UNNAMED = "default"
#: Seconds by which annotations overlap only because their times were rounded.
_ROUNDING = 1e-6


def tracks_of_tiers(
    tiers: Sequence[Tier], options: LabelOptions
) -> tuple[tuple[Track, ...], list[str]]:
    """The tracks that tiers are, with remarks.

    As authors each tier is a track, by its annotator if no other tier has that one, else called as
    the tier; annotations without text are unlabelled. As actions all tiers of an annotator are one
    track, in which each annotation, whatever its text, is the action that its tier is called.

    Raises
    ------
    InputError
        If annotations overlap that would be of one track.
    """
    tiers = [tier for tier in tiers if tier.annotations]
    as_authors = options.tiers == "authors"
    remarks: list[str] = []
    if empty := sum(a.start == a.end for tier in tiers for a in tier.annotations):
        remarks.append(f"{left_out(empty, 'annotation without any duration')}.")
    blank = [f"'{t.name}'" for t in tiers if not any(a.text.strip() for a in t.annotations)]
    if blank and as_authors:
        what = left_out(len(blank), "tier without any text")
        remarks.append(f"{what}: {listed(blank)}; if they are actions, say so (--tiers actions).")
    rows: dict[str, list[tuple[Segment, str]]] = defaultdict(list)
    annotators = Counter(tier.annotator for tier in tiers if tier.annotator)
    texts = 0
    for tier in tiers:
        author = tier.annotator or options.author
        if as_authors and annotators[tier.annotator] != 1:
            author = options.author if tier.name in {"", UNNAMED} else tier.name
        for annotation in tier.annotations:
            text = annotation.text.strip()
            action = text if as_authors else tier.name
            if annotation.start < annotation.end and action:
                texts += not as_authors and text not in {"", tier.name}
                rows[author].append((Segment(annotation.start, annotation.end, action), tier.name))
    if texts:
        remarks.append(f"{left_out(texts, 'text')}, as the tiers are the actions.")
    for author, segments in rows.items():
        segments.sort()
        for place, ((left, first), (right, second)) in enumerate(pairwise(segments)):
            if left.end - _ROUNDING <= right.start < left.end and left.start < right.start:
                segments[place] = (replace(left, end=right.start), first)
            elif right.start < left.end:
                where = f"tier '{first}'" if first == second else f"tiers '{first}' and '{second}'"
                raise InputError(
                    f"In {where} of {author}, '{left.action}' ends at {left.end:.9g} s and "
                    f"'{right.action}' starts at {right.start:.9g} s; an author's labels may not "
                    "overlap: move an edge, or read the tiers as the other kind."
                )
    tracks = (
        Track(author, tuple(segment for segment, _ in segments))
        for author, segments in rows.items()
    )
    return tuple(tracks), remarks
