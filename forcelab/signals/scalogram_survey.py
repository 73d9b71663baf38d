"""What all views of a channel share: its noise, its colours, what is kept of long spans."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Demonstration
from forcelab.jobs import Progress, finish
from forcelab.signals.conditioning import noise_level
from forcelab.signals.scalogram_picture import magnitudes
from forcelab.signals.scalogram_source import Level, Source, open_source
from forcelab.signals.scalogram_spots import means_of
from forcelab.signals.scalogram_threads import in_threads
from forcelab.signals.scalogram_tiles import Tiles
from forcelab.signals.wavelets import Morlet

__all__ = ["Survey", "colour_range", "row_scales", "survey"]

Real = NDArray[np.float64]

#: Stretches of a demonstration that tell its range of colours, and the samples of each.
_STRETCHES, _STRETCH = 8, 1 << 14
#: Columns that a stretch is seen in.
_LOOKED = 512
#: Shares of all magnitudes below the darkest and the brightest colour, and their least distance.
_DARKEST, _BRIGHTEST, _LEAST = 0.05, 0.999, 1.0
#: Decades above the middle that have colours of their own at most: forces take two. Next to a spike
#: that is no glitch yet they would all have one colour.
_MOST = 4.0


@dataclass(eq=False, slots=True)
class Survey:
    """What all views of a channel have in common, so that colours do not jump.

    What tells of the channel never changes. Beside it, once a long span was seen, are kept the
    channel's means, and the tiles of the scales that were last asked for: one job at a time may
    use them.

    Parameters
    ----------
    source : Source
        The channel on its grid.
    noise : float
        Standard deviation of the channel's white noise, in its unit.
    low, high : float
        Decimal logarithms of the magnitudes for the first and the last colour.
    level : Level
        Middle and size of the samples.
    wavelet : Morlet

    Attributes
    ----------
    means : Source or None
        The channel in means, once :meth:`averaging` has gone through it.
    kept : bool
        Whether the tiles came from a file, or were to be written into one.
    """

    source: Source
    noise: float
    low: float
    high: float
    level: Level
    wavelet: Morlet
    means: Source | None = field(default=None, init=False, repr=False)
    kept: bool = field(default=False, init=False, repr=False)
    _tiles: Tiles | None = field(default=None, init=False, repr=False)

    def tiles(self, scales: Real) -> Tiles:
        """The tiles of some scales, as far as they are computed; those of others are dropped."""
        if self._tiles is None or not np.array_equal(self._tiles.scales, scales):
            self._tiles = Tiles(self.source, self.noise, self.level, scales, self.wavelet)
        return self._tiles

    def averaging(self) -> Generator[Progress, None, Source]:
        """Compute the channel's means, once; a job."""
        if self.means is None:
            self.means = yield from means_of(self.source)
        return self.means

    def without_tiles(self) -> Survey:
        """The same with no tile computed yet."""
        fresh = replace(self)
        fresh.means = self.means
        return fresh


def colour_range(values: NDArray[np.floating], least: float = _LEAST) -> tuple[float, float]:
    """Which magnitudes the colours are for.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Decimal logarithms, at least one, all known.
    least : float
        Decades from the first colour to the last at least.

    Returns
    -------
    low, high : float
        Those of the first and the last colour.
    """
    shares = (_DARKEST, 0.5, _BRIGHTEST)
    dark, middle, bright = (float(v) for v in np.quantile(values, shares))
    high = min(bright, middle + _MOST)
    return min(dark, high - least), high


def row_scales(rows: int, largest: float, smallest: float = 2.0) -> Real:
    """Scales in the middles of `rows` even steps of the logarithm; shape (rows,)."""
    ratio = largest / smallest
    return np.asarray(smallest * ratio ** ((np.arange(rows) + 0.5) / rows), dtype=np.float64)


def survey(
    demonstration: Demonstration, channel: str, largest: float, wavelet: Morlet | None = None
) -> Generator[Progress, None, Survey]:
    """Look at stretches of a whole demonstration; a job of at most 5e5 samples.

    Parameters
    ----------
    demonstration : Demonstration
    channel : str
        A recorded channel, or a recognition channel such as ``"tangential 1"``.
    largest : float
        The largest scale that will be shown, in samples.
    wavelet : Morlet, optional

    Raises
    ------
    InputError
        If there is no such channel, or a stray stamp makes the grid too long.
    """
    source = yield from open_source(demonstration, channel)
    mother = wavelet or Morlet()
    length = min(_STRETCH, source.count)
    stretches = min(_STRETCHES, -(-source.count // length))
    scales = row_scales(24, largest)
    places = np.linspace(0, source.count - length, stretches).astype(int).tolist()
    seen: dict[int, _Stretch] = {}

    def look(first: int) -> None:
        if (stretch := _look(source, first, length, scales, mother)) is not None:
            seen[first] = stretch

    yield from in_threads([partial(look, first) for first in places], "range of colours")
    if not seen:
        return Survey(source, 0.0, -1.0, 0.0, Level(0.0, 0), mother)
    found = [seen[first] for first in places if first in seen]
    noise = float(np.median([stretch.noise for stretch in found]))
    dark, bright = colour_range(np.concatenate([stretch.known for stretch in found]))
    level = Level.of(min(each.low for each in found), max(each.high for each in found))
    return Survey(source, noise, dark, bright, level, mother)


@dataclass(frozen=True, eq=False, slots=True)
class _Stretch:
    """What one stretch tells: its samples' range and noise, and all magnitudes that are known."""

    low: float
    high: float
    noise: float
    known: NDArray[np.float32]


def _look(
    source: Source, first: int, length: int, scales: Real, wavelet: Morlet
) -> _Stretch | None:
    """Look at a stretch; None where nothing of it is known."""
    values, known = source.read(first, first + length)
    if not known.any():
        return None
    peak = int(np.frexp(np.max(np.abs(values)))[1])
    noise = float(np.ldexp(noise_level(np.ldexp(values, -peak)), peak))
    places = float(first), float(first + length)
    picture = finish(magnitudes(source, noise, places, scales, min(length, _LOOKED), wavelet))
    shown = picture[np.isfinite(picture)]
    return _Stretch(float(values.min()), float(values.max()), noise, shown)
