"""The bytes of a dump: its packets, what was skipped, and marks that do not belong to the stream.

Some dumps were written by a program that put pieces of the stream down as ``b'...'`` on a line
each and left the marks between them, four bytes that cut a packet in two. They are taken out where
they lie in no valid packet; what was cut has to have a right checksum then like any other packet.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from forcelab.formats.optoforce.packets import Kind, Packets, Statistics, parse_all

__all__ = ["SEAM", "Dump", "parse_dump"]

#: What stands between two pieces that a program wrote down as Python shows bytes.
SEAM: Final = b"'\nb'"


@dataclass(frozen=True)
class Dump:
    """What a dump holds.

    Parameters
    ----------
    packets, kind, statistics
        As of the parser; skipped bytes count the marks that were taken out.
    size : int
        Its bytes.
    serial : str or None
        Of the DAQ, if it was asked for while the dump was made.
    seams : int
        How many marks were taken out.
    mended : int
        How many packets came right by that.
    first_bad : int
        Where the first bytes that are in no packet lie between packets; -1 where there are none.
    """

    packets: Packets
    kind: Kind | None
    statistics: Statistics
    size: int
    serial: str | None
    seams: int
    mended: int
    first_bad: int


def parse_dump(data: bytes) -> Dump:
    """Parse a dump, once more without marks if it has any.

    Parameters
    ----------
    data : bytes
        All of it.
    """
    parser, packets = parse_all(data)
    statistics, seams, mended = parser.statistics, 0, 0
    size = parser.kind.frame.size if parser.kind else 0
    first_bad = _first_break(packets, size)
    seams_at = (found.start() for found in re.finditer(re.escape(SEAM), data))
    places = [place for place in seams_at if not _inside(packets.offsets, size, place)]
    if places:
        ends = [0, *(place + len(SEAM) for place in places)]
        pieces = (data[a:b] for a, b in zip(ends, [*places, len(data)], strict=True))
        again, more = parse_all(b"".join(pieces))
        if len(more) > len(packets):
            seams, mended = len(places), len(more) - len(packets)
            skipped = again.statistics.skipped_bytes + seams * len(SEAM)
            statistics = Statistics(
                len(more), again.statistics.replies, statistics.bad_checksums, skipped
            )
            parser, packets = again, more
    serials = [reply.serial for reply in parser.take_replies() if reply.serial]
    serial = serials[0] if serials else None
    return Dump(packets, parser.kind, statistics, len(data), serial, seams, mended, first_bad)


def _first_break(packets: Packets, size: int) -> int:
    """Where the first bytes that are in no packet lie between two; -1 where there are none."""
    breaks = np.flatnonzero(np.diff(packets.offsets) > size)
    return int(packets.offsets[breaks[0]]) + size if breaks.size else -1


def _inside(offsets: NDArray[np.int64], size: int, place: int) -> bool:
    """Whether a mark lies inside a valid packet, where its bytes mean something else."""
    before = int(np.searchsorted(offsets, place + len(SEAM), side="left")) - 1
    return before >= 0 and place < int(offsets[before]) + size
