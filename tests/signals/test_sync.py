"""Proposals for the clocks of videos whose true clock is known."""

from pathlib import Path

import numpy as np
import pytest

from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.signals.sync import find_taps, propose_clock, propose_clock_for
from forcelab.video.motion import MotionEnergy

FRAME = 1 / 30


def propose(*recording):
    return finish(propose_clock(*recording))


def recorded(length=12.0, offset=0.0, rate=1.0, seed=0, taps=True, channels=3):
    """A force with contacts and taps, and the motion that a camera with another clock sees.

    Gives the frames' own times, their energy, the force's times and the force.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, length, 0.002)
    contacts = np.sort(rng.uniform(1.5, length - 1.5, int(length)))
    force = 0.01 * rng.standard_normal((t.size, channels))
    for contact in contacts:
        since = t - contact
        pressed = np.clip(since / 0.02, 0.0, 1.0) * np.exp(-np.maximum(since, 0.0) / 0.4)
        force += rng.normal(0.0, 2.0, channels) * pressed[:, None]
    tapped = (0.5, length - 0.6) if taps else ()
    for tap in tapped:
        force[:, 0] += 4.0 * np.exp(-0.5 * ((t - tap) / 0.007) ** 2)
    frames = np.arange(0.0, length + 0.8, FRAME)
    video_times = offset + rate * frames
    energy = 0.05 * np.abs(rng.standard_normal(frames.size)) + 0.3 * np.cos(video_times / 2.0) ** 2
    for event in (*contacts, *tapped):
        k = int(np.searchsorted(video_times, event))
        if 0 < k < frames.size - 1:
            energy[k : k + 2] += rng.uniform(1.0, 3.0) * np.array([1.0, 0.6])
    return frames, energy, t, force


def error(proposal, frames, offset, rate):
    """The largest distance from the true clock, s."""
    return float(np.max(np.abs(proposal.clock.to_force(frames) - (offset + rate * frames))))


@pytest.mark.parametrize("offset", [-10.0, -1.3, 0.0, 0.02, 4.0, 10.0])
def test_any_offset_is_found(offset):
    # The video's clock begins anywhere; both are of the same scene.
    frames, energy, t, force = recorded(offset=-0.4, seed=3)
    frames = frames - 0.4 - offset
    proposal = propose(frames, energy, t, force)
    assert error(proposal, frames, offset, 1.0) < FRAME
    assert proposal.confidence > 0.5
    assert proposal.clock.rate == 1.0
    assert len(proposal.taps) == 2
    assert proposal.residual < FRAME


@pytest.mark.parametrize("seed", range(6))
def test_a_confident_proposal_is_right(seed):
    for taps in (True, False):
        frames, energy, t, force = recorded(offset=-0.3, seed=seed, taps=taps)
        proposal = propose(frames, energy, t, force)
        assert proposal.confidence <= 0.45 or taps
        assert proposal.confidence <= 0.5 or error(proposal, frames, -0.3, 1.0) < 0.05


@pytest.mark.parametrize("rate", [1.0 - 1e-3, 1.0 + 6e-4])
def test_a_drift_is_found_where_it_can_be_told(rate):
    frames, energy, t, force = recorded(length=160.0, offset=-0.5, rate=rate, seed=1)
    proposal = propose(frames, energy, t, force)
    video_times = frames[(proposal.clock.to_force(frames) < 160.0)]
    assert error(proposal, video_times, -0.5, rate) < 1.5 * FRAME


def test_a_video_that_shows_nothing_is_not_believed():
    _, _, t, force = recorded(seed=1)
    frames = np.arange(0.0, 12.0, FRAME)
    for seed in range(8):
        noise = np.abs(np.random.default_rng(seed).standard_normal(frames.size))
        assert propose(frames, noise, t, force).confidence < 0.5
    still = propose(frames, np.zeros(frames.size), t, force)
    assert still.confidence == 0.0
    assert propose(frames, noise, t, np.zeros((t.size, 2))).confidence < 0.5


def test_missing_samples_gaps_and_one_channel_do_not_matter():
    frames, energy, t, force = recorded(offset=-0.4, seed=2)
    force[1000:1020] = np.nan
    keep = (t < 6.0) | (t > 6.3)
    for times, values in ((t[keep], force[keep]), (t, force[:, 0])):
        proposal = propose(frames, energy, times, values)
        assert error(proposal, frames, -0.4, 1.0) < FRAME


def test_a_glitch_in_a_channel_that_is_hardly_touched_hides_no_tap(monkeypatch):
    frames, energy, t, force = recorded(offset=-0.4, seed=3)
    counts = np.round(5e4 * force)
    counts[:, 1] = 0.0
    counts[2000:2040, 1] = 1e6
    missing = counts.copy()
    counts[3000, 1], missing[3000, 1] = 1e12, np.nan

    def motion(_):
        yield Progress(1, 1, "motion")
        return MotionEnergy(frames, energy)

    monkeypatch.setattr("forcelab.signals.sync.measuring_motion", motion)
    channels = tuple(Channel(name, "counts") for name in ("fx", "fy", "fz"))
    film = VideoReference(Path("film.mp4"))
    spoilt, usual = (
        finish(propose_clock_for(Demonstration("d", "t", t, signals, channels, videos=(film,))))
        for signals in (counts, missing)
    )
    assert spoilt.taps == usual.taps
    assert len(spoilt.taps) == 2


def test_what_is_to_be_looked_at_comes_with_it():
    frames, energy, t, force = recorded(seed=2)
    proposal = propose(frames, energy, t, force)
    for shown in (proposal.motion, proposal.force):
        assert shown.shape[0] == 2
        assert np.all(np.diff(shown[0]) > 0)
        assert shown[1].max() == pytest.approx(1.0)
        assert shown[1].min() >= 0.0


def test_taps_are_found_and_contacts_are_none():
    _, _, t, force = recorded(seed=4)
    assert [tap.time for tap in find_taps(t, force)] == pytest.approx([0.49, 11.39], abs=0.01)
    assert find_taps(t, recorded(seed=4, taps=False)[3]) == ()
    assert find_taps(t[:4], force[:4]) == ()


@pytest.mark.parametrize(
    ("frames", "energy", "match"),
    [
        (np.arange(30.0), np.zeros(29), "one time for each value of the video"),
        (np.arange(5.0), np.zeros(5), "video is too short"),
        (np.arange(100) / 1000.0, np.zeros(100), "video is too short"),
    ],
)
def test_what_cannot_be_compared_is_told(frames, energy, match):
    _, _, t, force = recorded()
    with pytest.raises(InputError, match=match):
        propose(frames, energy, t, force)


def test_without_a_video_there_is_nothing_to_synchronise():
    bare = Demonstration("d", "t", np.arange(2000) / 1e3, np.zeros((2000, 1)), (Channel("x"),))
    with pytest.raises(InputError, match="no video"):
        finish(propose_clock_for(bare))
