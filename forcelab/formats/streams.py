"""Recordings of several streams, each with its own times: chosen, and put onto one clock.

What C3D, XDF and TDMS files hold. Their events name what is done until the next one; where there
is a "NAME start" and a "NAME end", NAME is done in between.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.formats.alignment import TimedStream, align_streams
from forcelab.formats.fields import Field, unknown_name, values_within, with_sensors
from forcelab.formats.label_tables import own_or_beside_tracks
from forcelab.formats.recording import ColumnUse, ReadOptions, Recording, Use
from forcelab.formats.table_columns import MOST_LABELS, is_unlabelled, missing_remark
from forcelab.formats.track_text import on_samples
from forcelab.labels import Segment, Track
from forcelab.text import listed


@dataclass(frozen=True, slots=True)
class Stream:
    """Samples with common times, n of c channels."""

    name: str  #: unique within its file
    times: NDArray[np.float64]  #: seconds on the clock of the file, shape (n,); NaN where unknown
    values: NDArray[np.float64]  #: shape (n, c)
    channels: tuple[Channel, ...]  #: their names are unique within the stream
    chosen: bool = True  #: whether it is read without being asked for

    @property
    def addresses(self) -> list[str]:
        """How people name each channel."""
        return [f"{self.name}.{channel.name}" for channel in self.channels]


@dataclass(frozen=True, slots=True)
class Events:
    """What happened at single times."""

    name: str  #: unique within its file
    times: NDArray[np.float64]  #: seconds on the clock of the file
    words: list[str]


#: Samples of a stream at least.
_FEWEST: Final = 2
#: Nanoseconds in a second, and the seconds by which all times are moved from zero: a stamp of zero
#: means that there is none.
_SECOND, _LEAD = 10**9, 1e6
#: Seconds from the others beyond which times are none.
_ABSURD: Final = 1e9
_USES: Final[tuple[Use, ...]] = ("signal", "left out")
_EVENT_USES: Final[tuple[Use, ...]] = ("labels", "left out")


def make_recording(
    path: Path,
    streams: Sequence[Stream],
    events: Sequence[Events],
    options: ReadOptions,
    remarks: Sequence[str] = (),
) -> Recording:
    """The streams and events that the options choose, as one demonstration called like the file.

    Options name streams, or channels as in ``stream.channel``; events are chosen as labels.
    """
    chosen = _choose(streams, events, options)
    # Relative to a sample in the middle, times keep all their digits.
    times = np.concatenate([stream.times for stream, _ in chosen])
    times = times[np.isfinite(times)]
    zero = float(np.median(times)) if times.size else 0.0
    timed = [_timed(stream, field, zero) for stream, field in chosen]
    aligned = align_streams(timed, str(path), strict=options.strict)
    channels = tuple(channel for _, field in chosen for channel in field.channels)
    demonstration = Demonstration(
        path.stem,
        options.task or "",
        aligned.times,
        aligned.signals,
        channels,
        grid_rate=options.rate,
    )
    start = zero + (aligned.start - _LEAD)
    tracks, label_remarks = event_tracks(events, options, start, demonstration)
    tracks, beside_remarks = own_or_beside_tracks(path, tracks, options, start, demonstration)
    return Recording(
        demonstration,
        tracks,
        (
            *remarks,
            *_not_read(streams, {stream.name for stream, _ in chosen}),
            *aligned.remarks,
            *label_remarks,
            *beside_remarks,
            *missing_remark(aligned.signals, channels),
        ),
    )


def _not_read(streams: Sequence[Stream], read: set[str]) -> list[str]:
    """Remarks on streams that are not read although nobody left them out."""
    others = [stream.name for stream in streams if not stream.chosen and stream.name not in read]
    single = [stream.name for stream in streams if stream.times.size < _FEWEST]
    remarks = []
    if others:
        remarks.append(f"Others can be read as signals (--signal): {listed(others)}.")
    if single:
        remarks.append(f"A single sample is no signal: {listed(single)}.")
    return remarks


def preview_streams(
    streams: Sequence[Stream], events: Sequence[Events], options: ReadOptions
) -> tuple[ColumnUse, ...]:
    """What the channels and events would be read as; each stream begins with its times."""
    chosen = _choose(streams, events, options)
    read = {address for _, field in chosen for address in field.addresses}
    rows: list[ColumnUse] = []
    for stream in streams:
        cells = tuple(f"{time:.6f}" for time in stream.times[:3].tolist())
        rows.append(ColumnUse(f"{stream.name}: times", "s", "times", cells, choices=("times",)))
        for address, channel, column in zip(
            stream.addresses, stream.channels, stream.values[:3].T, strict=True
        ):
            use: Use = "signal" if address in read else "left out"
            cells = tuple(f"{value:.6g}" for value in column.tolist())
            rows.append(ColumnUse(address, channel.unit, use, cells, choices=_USES))
    labels = {kind.name for kind in _chosen_events(events, options)}
    for kind in events:
        use = "labels" if kind.name in labels else "left out"
        rows.append(ColumnUse(kind.name, "", use, tuple(kind.words[:3]), choices=_EVENT_USES))
    return tuple(rows)


def _choose(
    streams: Sequence[Stream], events: Sequence[Events], options: ReadOptions
) -> list[tuple[Stream, Field]]:
    """The streams to read, each with its channels to read, whose names tell them apart."""
    addresses = [address for stream in streams for address in stream.addresses]
    names = [kind.name for kind in events]
    for name in (*options.signals, *options.leave_out):
        if not any(values_within(address, name) for address in (*addresses, *names)):
            known = [*dict.fromkeys(stream.name for stream in streams), *names]
            raise InputError(
                f"it has no values called '{name}'; name one of {listed(known)}, or a "
                "channel as in STREAM.CHANNEL."
            )
    fields = {stream.name: _field(stream).requested(options) for stream in streams}
    read = [stream for stream in streams if fields[stream.name].leaves]
    if not read:
        known = [stream.name for stream in streams]
        raise InputError(
            f"it has no signals{' but what is left out' if options.leave_out else ''}; "
            + (
                f"read others as signals (--signal): {listed(known)}."
                if known
                else "there is nothing to import."
            )
        )
    named = with_sensors([fields[stream.name] for stream in read])
    return list(zip(read, named, strict=True))


def _field(stream: Stream) -> Field:
    """The channels of a stream that is long enough to be one."""
    channels = stream.channels if stream.times.size >= _FEWEST else ()
    names = tuple(channel.name for channel in channels)
    leaves = tuple((name,) for name in names)
    units = tuple(channel.unit for channel in channels)
    return Field(stream.name, (), leaves, names, units, force=stream.chosen)


def _timed(stream: Stream, field: Field, zero: float) -> TimedStream:
    """The chosen channels of a stream, as what comes onto one clock with others."""
    places = {address: i for i, address in enumerate(stream.addresses)}
    chosen = [places[address] for address in field.addresses]
    known = np.abs(stream.times - zero) < _ABSURD  # nor is NaN
    seconds = np.where(known, stream.times - zero, -_LEAD)
    ticks = np.rint((seconds + _LEAD) * _SECOND).astype(np.int64)
    values = np.ascontiguousarray(stream.values[:, chosen], np.float64)
    return TimedStream(stream.name, ticks, None, values)


def _chosen_events(events: Sequence[Events], options: ReadOptions) -> list[Events]:
    """The events that are labels: those asked for, else all that are not left out."""
    if options.label is not None:
        chosen = [kind for kind in events if values_within(kind.name, options.label)]
        if not chosen:
            raise unknown_name(options.label, "events", [kind.name for kind in events])
        return chosen
    return [kind for kind in events if not values_within(kind.name, *options.leave_out)]


_EDGE = re.compile(r"(.*?)[\W_]*(?:(start|begin|onset|on)|(end|stop|offset|off))", re.IGNORECASE)


def event_tracks(
    events: Sequence[Events], options: ReadOptions, start: float, demonstration: Demonstration
) -> tuple[tuple[Track, ...], list[str]]:
    """A track for each kind of events, and how they became segments.

    `start` is the time of the demonstration's zero on their clock.
    """
    tracks: list[Track] = []
    remarks: list[str] = []
    chosen = _chosen_events(events, options)
    for kind in chosen:
        number = len({word for word in kind.words if not is_unlabelled(word)})
        if number > MOST_LABELS:
            text = f"{kind.name} holds {number:,} different events, too many to be actions"
            if options.label is not None:
                raise InputError(f"{text}; name other ones for the labels.")
            remarks.append(f"{text}; no labels were read.")
            continue
        segments = _segments(kind, start, demonstration.duration)
        author = options.author if len(chosen) == 1 else f"{options.author} ({kind.name})"
        if segments:
            tracks.append(Track(author, segments))
            remarks.append(
                f"Labels were read from {kind.name}: each lasts until the next one"
                f"{', and from NAME start to NAME end' if _paired(kind.words) else ''}."
            )
    return on_samples(tracks, demonstration.times), remarks


def _paired(words: Sequence[str]) -> set[str]:
    """What has both a start and an end among some words, in lower case."""
    edges = [match for word in set(words) if (match := _EDGE.fullmatch(word))]
    starts = {match[1].lower() for match in edges if match[2]}
    return starts & {match[1].lower() for match in edges if match[3]}


def _segments(events: Events, start: float, duration: float) -> tuple[Segment, ...]:
    """From each event to the next one, on the clock of the demonstration."""
    paired = _paired(events.words)
    order = np.argsort(events.times, kind="stable")  # those without a time come last
    marks: list[tuple[float, str]] = []
    for i in order[np.isfinite(events.times[order])].tolist():
        action, match = events.words[i], _EDGE.fullmatch(events.words[i])
        if match and match[1].lower() in paired:
            # A bare "start" is called so itself.
            action = "" if match[3] else match[1] or action
        marks.append((float(events.times[i]) - start, "" if is_unlabelled(action) else action))
    marks.append((duration, ""))
    segments = [
        Segment(max(begin, 0.0), min(end, duration), action)
        for (begin, action), (end, _) in pairwise(marks)
        if action and max(begin, 0.0) < min(end, duration)
    ]
    joined: list[Segment] = []
    for segment in segments:  # an event that is told twice goes on
        if joined and (joined[-1].end, joined[-1].action) == (segment.start, segment.action):
            joined[-1] = replace(joined[-1], end=segment.end)
        else:
            joined.append(segment)
    return tuple(joined)
