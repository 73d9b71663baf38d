"""The demonstration: one recording of one task, all channels on one clock."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcelab.above import Drawing, call_above
from forcelab.clock import ClockMap
from forcelab.errors import InputError
from forcelab.notebook import html_picture, html_title
from forcelab.text import counted, unknown_word

if TYPE_CHECKING:
    from pandas import DataFrame


#: Neighbouring stamps further apart than this many sample periods have a gap between them.
GAP_PERIODS = 5.0
#: Values beyond this were not measured and count as missing: boards print 3.4e38 where they know
#: nothing, next to which all that a wavelet or a mean makes of the others would be rounding.
LARGEST = 1e30
#: Least and largest mean distance of neighbouring stamps in seconds; beyond, a unit is wrong.
NEAREST, FARTHEST = 1e-9, 1e9


#: Steps of which a copy is made to find their median, and bits by which more are told apart.
_COPIED, _BITS = 2**19, 16


def median_step(times: NDArray[np.float64]) -> float:
    """The median distance of neighbouring times (n,), which increase.

    As ``np.median(np.diff(times))``; of a recording that just fits into memory there is no room for
    all distances at once.
    """
    count = len(times) - 1
    if count <= _COPIED:
        steps = np.diff(times)
        middle = (count - 1) // 2
        steps.partition(middle)  # as np.median, in a third of its time
        following = steps[middle + 1 :].min() if count % 2 == 0 else steps[middle]
        return float(0.5 * (steps[middle] + following))
    lower = _ranked_step(times, (count - 1) // 2)
    upper = lower if count % 2 else _ranked_step(times, count // 2)
    return 0.5 * (lower + upper)


def _ranked_step(times: NDArray[np.float64], rank: int) -> float:
    """The distance of neighbouring times than which `rank` are smaller, or as small.

    The bits of positive numbers, read as whole ones, have their order, so that counting by the
    leading bits leaves fewer and fewer that it may be.
    """
    first, width = 0, 63  # it is one of the 2**width bit patterns from here on
    while width:
        shift = max(0, width - _BITS)
        counts = np.zeros(2 ** (width - shift), np.int64)
        for start in range(0, len(times) - 1, _COPIED):
            bits = np.diff(times[start : start + _COPIED + 1]).view(np.int64)
            bits -= first
            inside = bits[(bits >= 0) & (bits < 2**width)] >> shift
            counts += np.bincount(inside, minlength=len(counts))
        below = np.cumsum(counts)
        place = int(np.searchsorted(below, rank, side="right"))
        rank -= int(below[place] - counts[place])
        first, width = first + (place << shift), shift
    return float(np.int64(first).view(np.float64))


@dataclass(frozen=True, slots=True)
class Channel:
    """Name and unit of one column of signals.

    Parameters
    ----------
    name : str
        Not empty, unique within its demonstration, such as ``"fx1"``.
    unit : str
        Such as ``"N"``; empty where it is not known.

    Examples
    --------
    >>> forcelab.Channel("fx1", "N")
    Channel(name='fx1', unit='N')
    """

    name: str
    unit: str = ""

    def __post_init__(self) -> None:
        if not self.name.strip():
            raise InputError("A channel needs a name.")


@dataclass(frozen=True, slots=True)
class VideoReference:
    """Where a video of a demonstration lies, and how its clock maps onto the force clock.

    Parameters
    ----------
    path : Path
        The video file.
    clock : ClockMap
        From the video's own timestamps (s) to force time (s).
    name : str
        What it is called among those of its demonstration, such as the camera's name or a topic;
        by default ``"video 1"``, ``"video 2"`` and so on, by its place there.
    """

    path: Path
    clock: ClockMap = field(default_factory=ClockMap)
    name: str = ""


def _is_read_only(array: NDArray[Any]) -> bool:
    """Whether an array can be written to neither itself nor through what it looks at."""
    base: object = array
    while isinstance(base, np.ndarray) and not base.flags.writeable:
        if isinstance(base, np.memmap):
            return True
        base = base.base
    # From another process arrays come as views of bytes.
    return base is None or (isinstance(base, memoryview) and base.readonly)


def _frozen(array: ArrayLike) -> NDArray[np.float64]:
    """A read-only C-contiguous float64 array; one that is so already is not copied."""
    if (
        isinstance(array, np.ndarray)
        and array.dtype == np.float64
        and array.flags.c_contiguous
        and _is_read_only(array)
    ):
        return array
    copy = np.array(array, dtype=np.float64, order="C")
    copy.flags.writeable = False
    return copy


@dataclass(frozen=True, eq=False)
class Demonstration:
    """One recording of one task: immutable and validated.

    Parameters
    ----------
    name : str
        Such as ``"LEGO 07"``; unique within its task in a project.
    task : str
        The choreography that this is an instance of, such as ``"LEGO"``; may be empty.
    times : array_like, shape (n,)
        Time of each sample in seconds from the start of the recording, strictly increasing and
        finite, n >= 2. Stamps may be irregular and are kept as they are.
    signals : array_like, shape (n, c)
        One column a channel, in the channel's unit. NaN or infinity marks a missing sample.
    channels : sequence of Channel, length c
        Distinct names.
    videos : sequence of VideoReference
        The videos of the same task, if there are any: distinct names, the main one first.
    grid_rate : float, optional
        Rate in Hz of the uniform grid on which features are computed; by default the inverse of
        the median period.

    Raises
    ------
    InputError
        If the shapes disagree, the stamps do not increase, are less than a nanosecond or more than
        30 years apart on average, or two channels or two videos share a name.

    Notes
    -----
    Two demonstrations are equal when their content is (see :attr:`id`), whatever they are called.

    Examples
    --------
    >>> demonstration = project.demonstrations.load("foam 01")
    >>> demonstration.signals.shape, round(demonstration.duration, 2)
    ((469, 6), 4.69)
    >>> columns = {"time": [0.0, 0.01, 0.025], "fx (N)": [0.1, 0.4, 0.3]}
    >>> forcelab.Demonstration.from_frame(columns, "pull").channels
    (Channel(name='fx', unit='N'),)
    """

    name: str
    task: str
    times: NDArray[np.float64] = field(repr=False)
    signals: NDArray[np.float64] = field(repr=False)
    channels: tuple[Channel, ...]
    videos: tuple[VideoReference, ...] = ()
    grid_rate: float | None = None

    def __post_init__(self) -> None:
        times, signals = _frozen(self.times), _frozen(self.signals)
        channels = tuple(self.channels)
        videos = tuple(
            video if video.name.strip() else replace(video, name=f"video {number}")
            for number, video in enumerate(self.videos, 1)
        )
        values = {"times": times, "signals": signals, "channels": channels, "videos": videos}
        for attribute, value in values.items():
            object.__setattr__(self, attribute, value)
        if not self.name.strip():
            raise InputError("A demonstration needs a name.")
        where = f"Demonstration '{self.name}'"
        if times.ndim != 1 or times.size < 2:
            raise InputError(f"{where} has fewer than two samples; record or import more.")
        if signals.ndim != 2 or signals.shape != (times.size, len(channels)) or not channels:
            raise InputError(
                f"{where}: signals of shape {signals.shape} do not fit {times.size} times and "
                f"{len(channels)} channels."
            )
        if not np.isfinite(times).all():
            raise InputError(f"{where}: sample {np.argmin(np.isfinite(times))} has no finite time.")
        back = np.flatnonzero(times[1:] <= times[:-1])
        if back.size:
            i = int(back[0])
            raise InputError(
                f"{where}: time does not increase at sample {i + 1} "
                f"({times[i]:.9g} s, then {times[i + 1]:.9g} s)."
            )
        step = (float(times[-1]) - float(times[0])) / (times.size - 1)
        if not NEAREST <= step <= FARTHEST:
            raise InputError(
                f"{where}: its samples are {step:.3g} s apart, which no recording has; check the "
                f"unit of its stamps, or its rate."
            )
        if self.grid_rate is not None and not 0 < self.grid_rate < np.inf:
            raise InputError(f"{where}: the rate must be positive, not {self.grid_rate} Hz.")
        for noun, names in (
            ("channels", [channel.name for channel in channels]),
            ("videos", [video.name for video in videos]),
        ):
            if len(set(names)) != len(names):
                twice = next(name for name in names if names.count(name) > 1)
                raise InputError(f"{where} has two {noun} called '{twice}'; rename one.")

    def __setstate__(self, state: dict[str, object]) -> None:
        """Restore a pickled copy; arrays come out of a pickle writeable."""
        self.__dict__.update(state)
        self.times.flags.writeable = self.signals.flags.writeable = False

    @classmethod
    def from_frame(
        cls,
        frame: DataFrame | Mapping[str, ArrayLike],
        name: str,
        *,
        task: str = "",
        time: str | None = None,
        rate: float | None = None,
        leave_out: Sequence[str] = (),
    ) -> Demonstration:
        """A demonstration of the columns of a data frame, or of a dictionary of arrays.

        Columns are understood as by :func:`forcelab.read_frame`, which gives their labels as well.
        What that repairs is refused here, and what it remarks on is a warning.

        Parameters
        ----------
        frame : pandas.DataFrame or mapping of str to array_like
            Columns of times and numbers; columns of words are passed over.
        name, task : str
            What the demonstration and its task are called.
        time : str, optional
            The column of times; found by itself by default. They may be irregular.
        rate : float, optional
            Samples a second, where there is no column of times.
        leave_out : sequence of str
            Columns that become no channels.

        Raises
        ------
        InputError
            If there is no column of times and no rate, no column of numbers, or times do not
            increase.
        """
        columns = tuple(leave_out)
        return call_above("demonstration_from_frame", frame, name, task, time, rate, columns)

    def plot(self, *tracks: Any) -> Drawing:
        """Its channels over time, below the `tracks` of those who labelled it.

        ``project.tracks.of(demonstration.id)`` are those of a stored one. With
        :func:`forcelab.plot` the actions get the colours that a project gives them.
        """
        return call_above("plot", self, tracks)

    def _repr_html_(self) -> str:
        """As notebooks show it: the main facts in a line, and its channels."""
        names = ", ".join(f"{c.name} ({c.unit})" if c.unit else c.name for c in self.channels)
        facts = [self.task] if self.task else []
        facts += [f"{self.duration:.2f} s at {self.rate:.6g} Hz", names]
        facts += [counted(len(self.gaps), "gap")] if self.gaps else []
        facts += [counted(len(self.videos), "video")] if self.videos else []
        title = html_title(self.name, "; ".join(facts))
        return title + html_picture(self.plot)

    @property
    def video(self) -> VideoReference | None:
        """The first video; None where there is none."""
        return self.videos[0] if self.videos else None

    def find_video(self, name: str | None = None) -> VideoReference:
        """A video by its name, by default the first one; InputError if there is none."""
        if not self.videos:
            raise InputError(f"Demonstration '{self.name}' has no video; attach one first.")
        names = [video.name for video in self.videos]
        if name is None:
            return self.videos[0]
        if name not in names:
            raise InputError(unknown_word("video", name, names))
        return self.videos[names.index(name)]

    @cached_property
    def id(self) -> str:
        """The fingerprint of what was recorded; of a stored one that of when it was added."""
        return self.fingerprint()

    def fingerprint(self) -> str:
        """32 hex digits of a SHA-256 over times, signals, channel names and units."""
        digest = hashlib.sha256()
        header = [[channel.name, channel.unit] for channel in self.channels]
        digest.update(json.dumps(header).encode())
        digest.update(self.times.astype("<f8", copy=False).data)
        digest.update(self.signals.astype("<f8", copy=False).data)
        return digest.hexdigest()[:32]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Demonstration) and self.id == other.id

    def __hash__(self) -> int:
        return hash(self.id)

    @cached_property
    def period(self) -> float:
        """Median distance of neighbouring stamps, in seconds."""
        return median_step(self.times)

    @property
    def rate(self) -> float:
        """Samples a second of the uniform grid: as asked for, or 1 / :attr:`period`, in Hz."""
        return self.grid_rate or 1.0 / self.period

    @property
    def start(self) -> float:
        """Time of the first sample, in seconds."""
        return float(self.times[0])

    @property
    def end(self) -> float:
        """Time at which the last sample ends, one period after its stamp, in seconds."""
        return float(self.times[-1]) + self.period

    @property
    def duration(self) -> float:
        """Length in seconds, the last sample's period included."""
        return self.end - self.start

    @cached_property
    def gaps(self) -> tuple[tuple[float, float], ...]:
        """Stretches ``(start, end)`` in seconds that hold no sample.

        A gap opens one period after the last stamp before it and closes at the next stamp, where
        two neighbouring stamps are more than :data:`GAP_PERIODS` periods apart.
        """
        before = np.flatnonzero(np.diff(self.times) > GAP_PERIODS * self.period)
        return tuple((float(self.times[i]) + self.period, float(self.times[i + 1])) for i in before)
