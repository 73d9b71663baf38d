"""The live scalogram against the transform of the whole recording."""

from types import SimpleNamespace

import numpy as np
import pytest

from forcelab.capture.reader import RingBuffer
from forcelab.demonstration import Channel
from forcelab.errors import InputError
from forcelab.live.scalogram import LiveScalogram, channels_to_show
from forcelab.signals.cwt import cwt

AXES = tuple(Channel(axis, "N") for axis in ("fx", "fy", "fz"))
RATE, SECONDS, COLUMNS, ROWS = 200.0, 4.0, 100, 12
WIDTH = SECONDS / COLUMNS
#: Of what counts as complete, relative to the largest coefficient of its scale.
TOLERANCE = 1.4e-3


class Streams:
    """Rings that a recorder would keep of devices with these rates (Hz)."""

    def __init__(self, *rates):
        self.devices = [SimpleNamespace(channels=AXES, holds=False, rate=rate) for rate in rates]
        self.rings = [RingBuffer(20_000, 3) for _ in rates]

    def since(self, device, number):
        return self.rings[device].since(number)

    def latest(self, seconds):
        return tuple(ring.latest(seconds) for ring in self.rings)


def fed(live, streams, blocks):
    """Let blocks of (device, times, values) come one after the other."""
    for device, times, values in blocks:
        streams.rings[device].extend(times, values)
        for _ in live.take(*live.read()):
            pass
    return live.image


def signal(n, seed=0):
    rng = np.random.default_rng(seed)
    times = 50.0 + np.arange(n) / RATE
    chirp = np.sin(2 * np.pi * (0.5 + 2 * (times - 50)) * (times - 50))
    return times, np.stack([rng.normal(size=n), np.zeros(n), 3 * chirp], axis=1)


def in_columns(live, x, times, first):
    """The largest magnitude in each column, from the whole recording."""
    sizes = np.abs(cwt(x, live.scales))
    column = np.floor(times / WIDTH + 1e-6).astype(int) - first
    out = np.full((ROWS, COLUMNS), np.nan)
    for c in range(COLUMNS):
        inside = column == c
        if inside.any():
            out[:, c] = sizes[:, inside].max(axis=1)
    return out, sizes.max(axis=1)


@pytest.mark.parametrize("block", [7, 64])
def test_what_is_complete_is_the_offline_scalogram_and_the_rest_is_marked(block):
    times, values = signal(1500)
    streams = Streams(RATE)
    live = LiveScalogram(streams, "normal 1", SECONDS, COLUMNS, ROWS)
    live.begin()
    n = len(times)
    strip = fed(
        live,
        streams,
        ((0, times[i : i + block], values[i : i + block]) for i in range(0, n, block)),
    )
    assert strip.values.shape == (ROWS, COLUMNS)
    assert strip.end >= times[-1]
    assert strip.end - times[-1] <= WIDTH
    first = round(strip.start / WIDTH)
    full, largest = in_columns(live, values[:, 2], times, first)
    ends = strip.start + WIDTH * np.arange(1, COLUMNS + 1)
    complete = ends[None, :] <= strip.complete[:, None]
    error = np.abs(10.0**strip.values - full) / largest[:, None]
    assert np.nanmax(error[complete]) <= TOLERANCE
    # Of what is not complete most is estimated already, worse but far from nothing.
    early = ~complete & np.isfinite(full)
    assert np.isfinite(strip.values[early]).mean() > 0.6
    assert TOLERANCE < np.nanmedian(error[early]) < 0.4
    # The wider a wavelet, the later it is complete.
    assert (np.diff(strip.complete) <= 0).all()
    assert (np.diff(strip.hertz) < 0).all()


def test_a_gap_stays_empty_and_the_stream_goes_on():
    times, values = signal(2000)
    present = np.r_[0:1500, 1600:2000]  # half a second is missing
    streams = Streams(RATE)
    live = LiveScalogram(streams, "normal 1", SECONDS, COLUMNS, ROWS)
    live.begin()
    blocks = (
        (0, times[present[i : i + 20]], values[present[i : i + 20]]) for i in range(0, 1900, 20)
    )
    strip = fed(live, streams, blocks)
    middles = strip.start + WIDTH * (np.arange(COLUMNS) + 0.5)
    within = (middles > times[1500] + WIDTH) & (middles < times[1600] - WIDTH)
    assert np.isnan(strip.values[:, within]).all()
    after = (middles > times[1600] + WIDTH) & (middles < times[-1] - 0.2)
    assert np.isfinite(strip.values[0, after]).all()


def test_one_channel_reads_only_the_device_it_is_of():
    streams = Streams(RATE, RATE)
    live = LiveScalogram(streams, "tangential 2", SECONDS, COLUMNS, ROWS)
    live.begin()
    times, values = signal(1500)
    values[:, 1] = values[:, 2]
    blocks = ((1, times[i : i + 50], values[i : i + 50]) for i in range(0, 1500, 50))
    strip = fed(live, streams, blocks)  # the first device gives nothing at all
    x = np.hypot(values[:, 0], values[:, 1])
    full, largest = in_columns(live, x, times, round(strip.start / WIDTH))
    error = np.abs(10.0 ** strip.values[0] - full[0]) / largest[0]
    assert np.nanmax(error[: COLUMNS - 10]) <= TOLERANCE


def test_a_channel_without_a_scalogram_is_refused_in_a_sentence():
    assert channels_to_show(AXES) == ("tangential", "normal", "fx", "fy", "fz")
    with pytest.raises(InputError, match="There is no channel 'fq'"):
        LiveScalogram(Streams(RATE), "fq", SECONDS, COLUMNS, ROWS)
    with pytest.raises(InputError, match="does not come evenly"):
        LiveScalogram(Streams(0.0), "fx1", SECONDS, COLUMNS, ROWS)
    with pytest.raises(InputError, match="too rarely"):
        LiveScalogram(Streams(5.0), "fx1", SECONDS, COLUMNS, ROWS)
    measured = LiveScalogram(Streams(0.0), "fx1", SECONDS, COLUMNS, ROWS, [RATE])
    assert measured.hertz[0] < RATE / 2


def test_a_glitch_is_left_out_of_the_picture():
    times, values = signal(1500)
    streams = Streams(RATE)
    live = LiveScalogram(streams, "normal 1", SECONDS, COLUMNS, ROWS)
    expected = fed(live, streams, [(0, times, values)])
    values[[1200, 1499], 2] = 1e16
    streams = Streams(RATE)
    live = LiveScalogram(streams, "normal 1", SECONDS, COLUMNS, ROWS)
    strip = fed(live, streams, [(0, times, values)])
    assert strip.high < expected.high + 0.5


def test_a_rate_of_few_samples_a_column_leaves_the_others_empty():
    times = 50.0 + np.arange(160) / 20.0
    streams = Streams(20.0)
    live = LiveScalogram(streams, "fx1", SECONDS, COLUMNS, ROWS)
    strip = fed(live, streams, [(0, times, np.random.default_rng(1).normal(size=(160, 3)))])
    filled = np.isfinite(strip.values).all(axis=0)
    assert np.isnan(strip.values[:, ~filled]).all()
    assert filled.sum() == 80


def test_the_colours_come_back_from_a_glitch_at_once_and_from_a_contact_calmly():
    for size, falls in ((16.0, 2.0), (1.0, 0.9)):
        live = LiveScalogram(Streams(RATE), "fx1", SECONDS, COLUMNS, ROWS)
        quiet = np.zeros((ROWS, COLUMNS), dtype=np.float32)
        assert live._colours(quiet + size, 0.2)[1] == pytest.approx(size)
        assert live._colours(quiet, 0.2)[1] == pytest.approx(falls)


def test_memory_stays_that_of_the_last_seconds():
    times, values = signal(6000)
    streams = Streams(RATE)
    live = LiveScalogram(streams, "normal 1", SECONDS, COLUMNS, ROWS)
    blocks = ((0, times[i : i + 200], values[i : i + 200]) for i in range(0, 6000, 200))
    fed(live, streams, blocks)
    assert len(live._times) == len(live._values) < 2500
