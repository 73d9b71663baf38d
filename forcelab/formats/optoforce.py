"""Raw dumps of the serial stream of OptoForce DAQs.

Some dumps were written by a program that put pieces of the stream down as ``b'...'`` on a line
each and left the marks between them, four bytes that cut a packet in two. They are taken out where
they lie in no valid packet; what was cut has to have a right checksum then like any other packet.

A dump tells no rate. Its stamps are ticks of the counter over the rate that is asked for, else over
1000 Hz divided by the counter's usual step, which a remark says. Missing samples leave gaps.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.formats.calibration import channels_of, read_calibrations
from forcelab.formats.optoforce_packets import (
    Packets,
    Parser,
    SensorKind,
    Statistics,
    Unwrapper,
    is_faulty,
    modal_step,
    parse_all,
    status_sentences,
)
from forcelab.formats.recording import ReadOptions, Recording
from forcelab.text import counted, were

#: What stands between two pieces that a program wrote down as Python shows bytes.
SEAM: Final = b"'\nb'"


@dataclass(frozen=True)
class Dump:
    packets: Packets
    kind: SensorKind | None
    statistics: Statistics
    size: int  #: bytes
    serial: str | None  #: of the DAQ, if it was asked for while the dump was made
    seams: int  #: marks that were taken out
    mended: int  #: packets that became valid by that
    first_bad: int  #: where the first bytes in no packet lie between two; -1 where there are none


def parse_dump(data: bytes) -> Dump:
    """Parse a dump, and if it has marks once more without them."""
    parser, packets = parse_all(data)
    statistics, seams, mended = parser.statistics, 0, 0
    ends = packets.offsets + (parser.kind.size if parser.kind else 0)
    breaks = ends[:-1][ends[:-1] < packets.offsets[1:]]
    places = np.array([match.start() for match in re.finditer(SEAM, data)], np.int64)
    # Inside a valid packet, which begins before the mark ends, these bytes mean something else.
    before = np.searchsorted(packets.offsets, places + len(SEAM))
    places = places[places >= np.append(0, ends)[before]]
    if places.size:
        starts = np.append(0, places + len(SEAM))
        pieces = (data[a:b] for a, b in zip(starts, [*places, len(data)], strict=True))
        joined_parser, joined_packets = parse_all(b"".join(pieces))
        if len(joined_packets) > len(packets):
            seams, mended = len(places), len(joined_packets) - len(packets)
            statistics = replace(
                joined_parser.statistics,
                bad_checksums=statistics.bad_checksums,
                skipped_bytes=joined_parser.statistics.skipped_bytes + seams * len(SEAM),
            )
            parser, packets = joined_parser, joined_packets
    return Dump(
        packets,
        parser.kind,
        statistics,
        len(data),
        next((reply.serial for reply in parser.take_replies() if reply.serial), None),
        seams,
        mended,
        int(breaks[0]) if breaks.size else -1,
    )


#: A file is a dump if so many packets are in its head, and fill so large a share of it.
_PACKETS, _SHARE = 8, 0.5
#: Samples a second of a DAQ whose counter goes on by one; the protocol's highest.
_FULL_RATE = 1000.0


def sniff(path: Path, head: bytes) -> bool:  # noqa: ARG001 - a dump has no name of its own
    """Whether a file is a raw dump: it starts with several valid packets and little else."""
    parser = Parser()
    count = len(parser.feed(head))
    size = parser.kind.size if parser.kind else 0
    return count >= _PACKETS and count * size >= _SHARE * len(head)


def read(path: Path, options: ReadOptions) -> list[Recording]:
    """Read a dump as one demonstration, called like the file.

    Readings are newtons and newton metres with a calibration, else counts. The statistics are
    ``packets``, ``bad_checksums`` (before marks were taken out), ``skipped_bytes`` and
    ``missing_samples``.
    """
    dump = parse_dump(path.read_bytes())
    if dump.kind is None or len(dump.packets) < 2:
        raise InputError(
            f"'{path}' holds {len(dump.packets)} valid OptoForce packets in {dump.size:,} bytes; "
            f"record it again at 1,000,000 baud, 8N1, and save the bytes as they come."
        )
    step, _ = modal_step(dump.packets.counts)
    rate = options.rate or _FULL_RATE / step
    unwrapper = Unwrapper(step, rate)
    unwrapped = unwrapper.feed(dump.packets.counts)
    if options.strict:
        _refuse_repairs(path, dump, unwrapper)
    times = unwrapped.ticks / rate
    signals = dump.packets.values[unwrapped.is_new].astype(np.float64)
    remarks = [f"The DAQ's serial number is {dump.serial}."] * (dump.serial is not None)
    if options.calibration is None:
        remarks.append(
            "Forces are in counts; imported again with a calibration file, they are newtons."
        )
    else:
        calibration = read_calibrations(options.calibration).find(dump.serial, dump.kind)
        signals = calibration.apply(dump.packets.values[unwrapped.is_new])
        remarks.append(f"Forces were calibrated by {calibration.source}.")
    if options.rate is None:
        remarks.append(
            f"The rate was taken as {rate:g} Hz, as the counter goes on by {step} from sample to "
            f"sample; if it was another, import it again with that sample rate."
        )
    remarks += _remarks(dump, unwrapper, unwrapped.ticks, times)
    remarks += _status_remarks(dump.packets.status[unwrapped.is_new], times)
    channels = channels_of(dump.kind, calibrated=options.calibration is not None)
    demonstration = Demonstration(
        path.stem, options.task or "", times, signals, channels, grid_rate=options.rate
    )
    statistics = {
        "packets": dump.statistics.packets,
        "bad_checksums": dump.statistics.bad_checksums,
        "skipped_bytes": dump.statistics.skipped_bytes,
        "missing_samples": unwrapper.missing,
    }
    return [Recording(demonstration, remarks=tuple(remarks), statistics=statistics)]


def _refuse_repairs(path: Path, dump: Dump, unwrapper: Unwrapper) -> None:
    if dump.statistics.bad_checksums:
        fault = f"wrong checksum of {counted(dump.statistics.bad_checksums, 'packet')}"
    elif unwrapper.missing:
        fault = f"{counted(unwrapper.missing, 'sample')} went missing"
    elif unwrapper.doubled:
        fault = f"{counted(unwrapper.doubled, 'sample')} came twice"
    else:
        return
    where = f", byte {dump.first_bad:,}" if dump.first_bad >= 0 else ""
    raise InputError(f"'{path}'{where}: {fault}; import it without --strict to go on without them.")


def _remarks(
    dump: Dump, unwrapper: Unwrapper, ticks: NDArray[np.int64], times: NDArray[np.float64]
) -> Iterator[str]:
    """What was skipped, repaired or is missing."""
    if dump.seams:
        yield (
            f"{counted(dump.seams, 'mark')} of the program that wrote the dump ({SEAM.hex(' ')}) "
            f"{were(dump.seams)} taken out, which put {counted(dump.mended, 'packet')} right."
        )
    bad = dump.statistics.bad_checksums - dump.mended
    skipped = dump.statistics.skipped_bytes
    if bad > 0:
        yield f"{counted(bad, 'packet')} with a wrong checksum {were(bad)} left out."
    if skipped:
        yield f"{skipped:,} of {dump.size:,} bytes belong to no packet and were skipped."
    if unwrapper.missing:
        lost = np.diff(ticks) - 1
        longest = int(lost.argmax())
        yield (
            f"{counted(unwrapper.missing, 'sample')} went missing in "
            f"{counted(int(np.sum(lost > 0)), 'place')}, at most {lost[longest]:,} at once after "
            f"{times[longest]:.3f} s; nothing was put there."
        )
    if unwrapper.doubled:
        twice = unwrapper.doubled
        yield f"{counted(twice, 'sample')} came twice and {were(twice)} taken once."


def _status_remarks(status: NDArray[np.uint16], times: NDArray[np.float64]) -> Iterator[str]:
    """Errors and overload that the DAQ reported."""
    codes, first = np.unique(status[is_faulty(status)], return_index=True)
    for code in codes[np.argsort(first)][:8]:
        where = np.flatnonzero(status == code)
        for sentence in status_sentences(int(code)):
            yield f"{sentence[:-1]} ({counted(len(where), 'sample')} from {times[where[0]]:.3f} s)."
