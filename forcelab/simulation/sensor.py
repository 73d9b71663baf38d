"""The sensors: from the forces that the domes feel to the counts that are stored.

Each figure is either measured in the recordings published with the paper (stylus and foam, ten
demonstrations each) or said to be a choice. Those recordings were read off straight lines between
raw counts, so that only where two neighbouring counts are equal is a stored number a raw one;
these numbers give the counts per newton exactly, and the spectrum, corrected for the straight
lines, the noise: it is white, and larger than the rounding to counts.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, lfilter, sosfilt, sosfilt_zi

from forcelab.arrays import Real

#: Names of the six channels, left sensor first; all in newtons.
CHANNELS = ("fx1", "fy1", "fz1", "fx2", "fy2", "fz2")

#: The low-pass is a Butterworth filter of this order.
ORDER = 6
#: Its corner is at most this share of the recording's rate: what would fold onto a frequency
#: below the corner is then attenuated 40 times and more.
CORNER = 0.35
#: Seconds that a device's zero has walked since it was set, when a recording begins.
SINCE_ZERO = 10.0


@dataclass(frozen=True, eq=False)
class Sensor:
    """The numbers of one device, two 3-axis sensors; the defaults are an ideal typical one."""

    #: (6, 6), recorded over true force: gains on the diagonal, cross-talk beside it.
    response: Real = field(default_factory=lambda: np.eye(6))
    #: (6,), counts per newton. Measured: 767.5, 812.5 and 158.6 of the one sensor, 429.8, 467.8 and
    #: 165.9 of the other.
    counts: Real = field(default_factory=lambda: np.tile([600.0, 640.0, 162.0], 2))
    #: (6,), white noise of a raw sample before rounding, N rms. Measured: 3.1, 2.9, 7.2 and 5.8,
    #: 4.9, 7.6 mN, which is 2.4 to 2.6 counts laterally and 1.2 counts normally.
    noise: Real = field(default_factory=lambda: np.tile([0.0042, 0.0039, 0.0074], 2))
    #: (6,), reading without force, N. Measured: up to 0.2 N.
    offset: Real = field(default_factory=lambda: np.zeros(6))
    #: (6,), how the offset walks, N/sqrt(s). Measured: the spectrum at 0.5 to 2 Hz without contact,
    #: 0.4 to 3.7 mN/sqrt(Hz), is that of a random walk of 2 to 16 mN/sqrt(s).
    drift: Real = field(default_factory=lambda: np.full(6, 0.006))
    #: creep and creep_time: Share of the force that comes late, and its time constant in s.
    #: Measured: the zero is 0.06 to 0.1 N off after holding 3 N and comes back in 0.3 to 1.3 s.
    creep: float = 0.033
    creep_time: float = 0.6
    #: (6,), amplitude of the mains' hum, N. Measured: 0.5 to 1.5 mN.
    hum: Real = field(default_factory=lambda: np.full(6, 0.001))
    mains: float = 60.0  # its frequency, Hz
    #: Corner of the low-pass, Hz; a choice, below the 500 Hz that 1 kHz can hold. The recordings
    #: show spikes of 3 ms.
    bandwidth: float = 350.0
    #: (6,), the sensor saturates at this force of either sign, N. A choice: now and then reached by
    #: the largest forces that recordings show, 23 N laterally and 29 N normally.
    limits: Real = field(default_factory=lambda: np.tile([22.0, 22.0, 32.0], 2))
    #: Losses of samples per second; each takes one sample or a few. Measured: 0 to 2.
    losses: float = 0.1
    #: Mean number of samples lost at once, from 1. Measured: 3, at most 14.
    loss_length: float = 2.0

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Sensor:
        """Draw the numbers of one device, as different as devices are.

        Counts and noise cover what was measured on the two real sensors and, for the noise, the 3
        to 17 mN over several devices; gains of 5 % and cross-talk of 3 % at most are a choice.
        """
        lateral, normal = rng.uniform(430.0, 810.0, (2, 2)), rng.uniform(155.0, 170.0, (2, 1))
        counts = np.hstack([lateral, normal]).ravel()
        typical = np.tile([2.5, 2.5, 1.2], 2) / counts
        response = np.diag(rng.uniform(0.95, 1.05, 6))
        for first in (0, 3):  # the sensors know nothing of each other
            within = rng.uniform(-0.03, 0.03, (3, 3))
            np.fill_diagonal(within, 0.0)
            response[first : first + 3, first : first + 3] += within
        return cls(
            response=response,
            counts=counts,
            noise=np.clip(typical * rng.lognormal(0.0, 0.3, 6), 0.003, 0.017),
            offset=np.clip(rng.normal(0.0, 0.12, 6), -0.4, 0.4),
            drift=rng.uniform(0.002, 0.016, 6),
            creep=rng.uniform(0.02, 0.045),
            creep_time=rng.uniform(0.4, 1.0),
            hum=rng.uniform(0.0005, 0.0015, 6),
            mains=float(rng.choice([50.0, 60.0])),
            bandwidth=rng.uniform(280.0, 380.0),
            limits=np.tile([rng.uniform(18.0, 26.0)] * 2 + [rng.uniform(25.0, 40.0)], 2),
            losses=rng.exponential(0.2),
            loss_length=rng.uniform(1.0, 3.0),
        )


@dataclass(frozen=True)
class SensorRecord:
    """What is stored of one demonstration."""

    times: Real  # (n,), stamps in seconds from the first sample; a lost sample has none
    signals: Real  # (n, 6), N, whole counts; columns as in :data:`CHANNELS`
    saturated: NDArray[np.bool_]  # (n, 6), where the sensor would have read more than it can


def record(
    forces: Real, rate: float, recording_rate: float, sensor: Sensor, rng: np.random.Generator
) -> SensorRecord:
    """Record forces: filter, mix, sample, disturb, round to counts, clip, lose a few.

    The low-pass is causal and comes before the sampling: a force at the recording's rate less the
    corner, which would fold onto the corner, is 40 times smaller by then. Samples that are lost
    change nothing in the others.

    `forces` (m, 6): what the domes feel, N; columns as in :data:`CHANNELS`; `rate`: of `forces`,
    Hz; `recording_rate`: samples a second that the device stores, Hz; not above `rate`. Any ratio
    goes; `rng`: the same state gives the same bytes.
    """
    true = np.arange(len(forces)) / rate
    # A whole number of samples; rounding must not ask for one after the last force.
    count = int(np.floor((len(forces) - 1) * recording_rate / rate * (1 + 1e-12))) + 1
    times = np.arange(count) / recording_rate
    filtered = _low_pass(_creep(forces, rate, sensor), rate, recording_rate, sensor.bandwidth)
    sampled = CubicSpline(true, filtered @ sensor.response.T)(np.minimum(times, true[-1]))
    disturbed = sampled + _disturbances(times, sensor, rng)
    counts = np.rint(disturbed * sensor.counts)
    most = np.floor(sensor.limits * sensor.counts)
    delivered = ~_draw_losses(count, recording_rate, sensor, rng)
    return SensorRecord(
        times=times[delivered],
        signals=(np.clip(counts, -most, most) / sensor.counts)[delivered],
        saturated=(np.abs(counts) > most)[delivered],
    )


def _creep(forces: Real, rate: float, sensor: Sensor) -> Real:
    """Forces of which a share comes late, by an exact first-order lag at the forces' rate."""
    if sensor.creep == 0:
        return forces
    stays = np.exp(-1.0 / (rate * sensor.creep_time))
    late, _ = lfilter([1.0 - stays], [1.0, -stays], forces, axis=0, zi=stays * forces[:1])
    return (1.0 - sensor.creep) * forces + sensor.creep * late


def _low_pass(forces: Real, rate: float, recording_rate: float, bandwidth: float) -> Real:
    """Forces below the corner; before the first sample they were what it is."""
    corner = min(bandwidth, CORNER * recording_rate)
    sections = butter(ORDER, corner, fs=rate, output="sos")
    before = sosfilt_zi(sections)[:, :, np.newaxis] * forces[0]
    return sosfilt(sections, forces, axis=0, zi=before)[0]


def _disturbances(times: Real, sensor: Sensor, rng: np.random.Generator) -> Real:
    """Offset, drift, hum and noise of each sample, shape (n, 6), N."""
    steps = rng.standard_normal((len(times), 6)) * np.sqrt(times[1])
    steps[0] *= np.sqrt(SINCE_ZERO / times[1])
    phases = 2 * np.pi * (sensor.mains * times[:, np.newaxis] + rng.random(6))
    return (
        sensor.offset
        + sensor.drift * np.cumsum(steps, axis=0)
        + sensor.hum * np.sin(phases)
        + sensor.noise * rng.standard_normal((len(times), 6))
    )


def _draw_losses(
    count: int, rate: float, sensor: Sensor, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Which samples are lost; never the first and the last: a recording begins with a sample."""
    lost = np.zeros(count, dtype=np.bool_)
    happened = rng.poisson(sensor.losses * count / rate)
    places = rng.integers(1, max(count - 1, 2), happened)
    lengths = rng.geometric(1.0 / sensor.loss_length, happened)
    for place, length in zip(places, lengths, strict=True):
        lost[place : place + length] = True
    lost[-1] = False
    return lost
