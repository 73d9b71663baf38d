"""Contact events of forces whose events are known, and of simulated ones."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.signals import contacts
from forcelab.signals.contacts import find_contacts
from forcelab.simulation.tasks import perform_job

RATE = 1000.0


def contact_events(times, signals):
    return finish(find_contacts(times, signals))


def steps(at, height=2.0, rise=0.004, length=4.0, noise=0.01, rest=0.3, seed=0, rate=RATE):
    """A force that rises at the odd ones of some times and falls back at the even ones."""
    t = np.arange(0.0, length, 1.0 / rate)
    x = np.full(t.size, rest)
    for number, time in enumerate(at):
        x += height * (-1) ** number * np.clip((t - time) / rise, 0.0, 1.0)
    return t, x + noise * np.random.default_rng(seed).standard_normal(t.size)


def kinds(events):
    return [event.kind for event in events]


@given(
    st.floats(0.2, 1.8),
    st.floats(0.3, 1.5),
    st.floats(0.5, 20.0),
    st.floats(-5.0, 5.0),
    st.integers(0, 99),
)
@example(1.255859375, 1.25, 1.0, 0.0, 57)  # its densest samples lie beside the middle of the noise
@example(1.0756094970099963, 0.6410484247375479, 0.49747591710838546, -2.0455321147568553, 86)
def test_a_touch_and_its_end_are_found_where_they_are(start, length, height, rest, seed):
    at = (start, start + length)
    t, x = steps(at, height, rest=rest, seed=seed)
    events = contact_events(t, x[:, None])
    for time in at:
        assert min(abs(event.time - time) for event in events) < 0.012
    # Nothing where nothing happens.
    assert all(min(abs(event.time - time) for time in at) < 0.03 for event in events)


def test_noise_and_a_constant_have_no_events():
    t = np.arange(0.0, 20.0, 0.001)
    noise = np.random.default_rng(1).standard_normal((t.size, 3))
    assert len(contact_events(t, noise)) < 5
    assert contact_events(t, np.full((t.size, 2), 3.7)) == ()
    assert contact_events([0.0], [[1.0]]) == ()


def test_a_slow_force_is_touched_and_left_once():
    t = np.arange(0.0, 6.0, 0.001)
    x = 3.0 * np.exp(-(((t - 3.0) / 0.6) ** 2))
    x += 0.01 * np.random.default_rng(0).standard_normal(t.size)
    found = [event for event in contact_events(t, x[:, None]) if event.kind != "jerk"]
    assert kinds(found) == ["touch", "leave"]
    assert found[0].time == pytest.approx(6.0 - found[1].time, abs=0.05)
    # It counts from little more than its noise on.
    assert 0.003 < 3.0 * np.exp(-(((found[0].time - 3.0) / 0.6) ** 2)) < 0.05


def test_a_jerk_under_load_tells_its_onset():
    t = np.arange(0.0, 3.0, 0.001)
    quiet = 0.01 * np.random.default_rng(0).standard_normal((t.size, 2))
    quiet[:, 1] += 2.0 + 1.0 / (1.0 + np.exp(-np.clip((t - 1.5) / 0.01, -50, 50)))
    (event,) = (event for event in contact_events(t, quiet) if event.kind == "jerk")
    assert 1.45 < event.time < 1.5


def test_events_close_together_are_one():
    t, x = steps((1.0, 3.0))
    other = np.roll(x, 4)  # another channel, 4 ms later
    events = contact_events(t, np.stack([x, other], axis=1))
    assert len(events) == len(contact_events(t, x[:, None])) <= 4
    assert all(b.time - a.time >= 0.01 for a, b in pairwise(events))


def test_a_gap_is_no_event_and_missing_samples_are_bridged():
    t, x = steps((1.0, 3.0))
    loaded = (t > 1.5) & (t < 2.0)
    gap = ~loaded
    holes = x.copy()
    holes[np.random.default_rng(0).choice(t.size, 40, replace=False)] = np.nan
    complete = contact_events(t, x[:, None])
    for times, values in ((t[gap], x[gap]), (t, np.where(loaded, np.nan, x)), (t, holes)):
        events = contact_events(times, values[:, None])
        assert kinds(events) == kinds(complete)
        assert [e.time for e in events] == pytest.approx([e.time for e in complete], abs=0.004)
    assert contact_events(t, np.full((t.size, 1), np.nan)) == ()


@pytest.mark.parametrize("wild", [3.4e38, -1e12])
def test_what_no_sensor_can_have_read_is_no_event_and_hides_none(wild):
    t, x = steps((1.0, 3.0))
    printed, missing = x.copy(), x.copy()
    printed[[400, 1500]], missing[[400, 1500]] = wild, np.nan
    found = contact_events(t, missing[:, None])
    assert contact_events(t, printed[:, None]) == found != ()


def test_irregular_stamps_make_no_events():
    t, x = steps((1.0, 3.0), noise=0.0)
    shaken = t + 0.0003 * np.random.default_rng(0).standard_normal(t.size)
    shaken = np.maximum.accumulate(shaken) + 1e-6 * np.arange(t.size)
    ramp = contact_events(shaken, (2.0 * shaken)[:, None])
    assert [event for event in ramp if event.kind == "jerk"] == []
    times = [event.time for event in contact_events(shaken, x[:, None])]
    assert min(abs(np.array(times) - 1.0)) < 0.01


def test_chunks_change_nothing(monkeypatch):
    t, x = steps((0.5, 0.9, 1.7, 1.9, 3.2, 3.3), noise=0.02)
    complete = contact_events(t, x[:, None])
    for chunk in (512, 1024, 1711):
        monkeypatch.setattr(contacts, "CHUNK", chunk)
        events = contact_events(t, x[:, None])
        assert kinds(events) == kinds(complete)
        assert [e.time for e in events] == pytest.approx([e.time for e in complete], abs=1e-9)


def test_a_job_tells_its_progress(monkeypatch):
    monkeypatch.setattr(contacts, "CHUNK", 1024)
    t, x = steps((1.0, 3.0))
    progress = []
    finish(find_contacts(t, x[:, None]), progress.append)
    assert len(progress) >= 4


def test_shapes_that_do_not_fit_are_told():
    with pytest.raises(InputError, match="one time for each row"):
        contact_events([0.0, 1.0], [[1.0], [2.0], [3.0]])


def test_most_action_edges_of_simulated_tongs_have_an_event_within_20_ms():
    hits, contacts_met = [], []
    for moved in finish(perform_job("stylus", 1, (37,), taps=False)):
        step = round(moved.rate / RATE)
        force = moved.forces[::step]
        force = force + 0.01 * np.random.default_rng(0).standard_normal(force.shape)
        times = np.array([e.time for e in contact_events(np.arange(len(force)) / RATE, force)])
        edges = [segment.start for segment in moved.actions[1:]]
        hits += [np.min(np.abs(times - edge)) < 0.02 for edge in edges]
        contacts_met += [
            np.min(np.abs(times - event.time)) < 0.01
            for event in moved.events
            if "contact made" in event.kind
        ]
    assert np.mean(hits) > 0.6
    assert all(contacts_met)
    assert contacts_met
