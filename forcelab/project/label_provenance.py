"""Which of a coder's segments a model proposed, found by following the edits of the track.

Nothing but the edits is stored: an edit says who proposed it, and what it put in place of what. So
origins cannot disagree with the labels, and undoing takes them back exactly.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from forcelab.labels import Segment, Segments
from forcelab.project.database import Database, content_errors
from forcelab.project.records import Origin, segments_from_text
from forcelab.segment_edits import SLIVER, covering, overlapping

_Origins = dict[Segment, Origin]

#: The origins of a track that holds nothing proposed.
_NONE: Mapping[Segment, Origin] = MappingProxyType({})


@dataclass(slots=True)
class _TrackOrigins:
    """The origins after the edit `head`, and what the edits up to there did to them.

    Whatever came before the edit `first`, which a model proposed first, is human, and so is what
    taking it back brings back.
    """

    first: int
    head: int
    now: _Origins = field(default_factory=dict)
    # For each edit that touched an origin: those that it took away, and those that it gave.
    done: dict[int, tuple[_Origins, _Origins]] = field(default_factory=dict)
    published: Mapping[Segment, Origin] = field(default_factory=lambda: _NONE)


class OriginTracker:
    """The origins of all tracks, followed from where they were asked for last.

    Costs two queries and one pass over the edits since then; the first time, over those since the
    first one that a model proposed.
    """

    def __init__(self, database: Database) -> None:
        self._db = database
        self._known: dict[tuple[str, str], _TrackOrigins] = {}

    def of(self, demonstration: str, author: str) -> Mapping[Segment, Origin] | None:
        """Each segment of a track that was proposed, with its origin; None without a track."""
        row = self._db.one(
            "SELECT track.id AS track, (SELECT min(edit.id) FROM edit WHERE edit.track = track.id "
            "AND proposed_by IS NOT NULL) AS first "
            "FROM track JOIN author ON author.id = track.author "
            "WHERE demonstration = ? AND name = ?",
            demonstration,
            author,
        )
        if row is None or row["first"] is None:
            return None if row is None else _NONE
        followed = self._known.get((demonstration, author))
        # Numbers of edits are given once: with another first one, what was followed was removed.
        if followed is None or followed.first != row["first"]:
            followed = _TrackOrigins(row["first"], head=row["first"] - 1)
            self._known[demonstration, author] = followed
        rows = self._db.all(
            "SELECT id, removed, inserted, reverts, proposed_by FROM edit "
            "WHERE track = ? AND id > ? ORDER BY id",
            row["track"],
            followed.head,
        )
        touched = False
        for edit in rows:
            touched |= _follow(followed, edit)
            followed.head = edit["id"]
        if touched:
            # A copy: what was handed out before stays as it was.
            followed.published = MappingProxyType(dict(followed.now))
        return followed.published


def _follow(followed: _TrackOrigins, row: sqlite3.Row) -> bool:
    """Follow one edit; gives whether it touched any origin."""
    now, reverts = followed.now, row["reverts"]
    if reverts is not None:
        given, taken = followed.done.get(reverts, ({}, {}))  # the other way round
    elif not now and row["proposed_by"] is None:
        return False
    else:
        with content_errors(f"Edit {row['id']}"):
            removed = segments_from_text(row["removed"])
            inserted = segments_from_text(row["inserted"])
        taken = {segment: now[segment] for segment in removed if segment in now}
        if row["proposed_by"] is not None:
            given = _accepted(removed, inserted, taken, Origin(row["proposed_by"]))
        else:
            given = _inherited(removed, inserted, taken) if taken else {}
    if not taken and not given:
        return False
    for segment in taken:
        del now[segment]
    now.update(given)
    followed.done[row["id"]] = (taken, given)
    return True


def _accepted(removed: Segments, inserted: Segments, taken: _Origins, origin: Origin) -> _Origins:
    """The origins of the segments inserted by accepting a prediction."""
    given = {}
    for segment in inserted:
        old = covering(removed, segment)
        if old is None:
            given[segment] = origin
        elif old in taken:  # what is left of a segment beside what was accepted, or all of it
            given[segment] = taken[old] if old == segment else Origin(taken[old].proposer, True)
    return given


def _inherited(removed: Segments, inserted: Segments, taken: _Origins) -> _Origins:
    """The origins of the segments inserted by a coder's own edit."""
    given = {}
    proposed = tuple(segment for segment in removed if segment in taken)
    for segment in inserted:
        if segment in taken:
            given[segment] = taken[segment]
        elif (old := _most_of(proposed, segment)) is not None:
            given[segment] = Origin(taken[old].proposer, True)
    return given


def _most_of(segments: Segments, segment: Segment) -> Segment | None:
    """The segment of the same action that overlaps `segment` most, if one does."""
    most, shared = None, SLIVER
    for old in segments[overlapping(segments, segment.start, segment.end)]:
        overlap = min(old.end, segment.end) - max(old.start, segment.start)
        if old.action == segment.action and overlap > shared:
            most, shared = old, overlap
    return most
