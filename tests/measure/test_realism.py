"""The simulated beside the real: figures of recordings that were made to measure."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic import synthetic_set

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.formats import pdl
from forcelab.formats.recording import ReadOptions
from forcelab.jobs import finish
from forcelab.labels import Segment
from forcelab.measure.beside import PUBLISHED
from forcelab.measure.realism import Comparison, cells, realism, recognition
from forcelab.recognition.evaluation import leave_one_out
from forcelab.recognition.examples import Labelled
from forcelab.recognition.settings import Settings
from forcelab.simulation.sensor import CHANNELS, Sensor, record

TONGS = Path(__file__).resolve().parents[2] / "../shared/data/tongs"
RATE = 1000.0
TIMES = np.arange(6000) / RATE
#: Rest to 1.5 s, a ramp of 0.5 s, 2 s held, a ramp down of 0.5 s, rest.
GRIP = np.interp(TIMES, [1.5, 2.0, 4.0, 4.5], [0.0, 1.0, 1.0, 0.0])
SEGMENTS = (
    Segment(0.0, 1.5, "still"),
    Segment(1.5, 2.0, "grab"),
    Segment(2.0, 4.0, "hold"),
    Segment(4.1, 4.5, "release"),
    Segment(4.5, 6.0, "still"),
)
STEPS = (0.002, 0.002, 0.006) * 2
OFFSET = np.array([0.1, -0.2, 0.3, 0.0, -0.1, 0.2])
#: fx, fy, fz of the left and the right sensor in a full grip; 5 N and 2.5 N along the surface.
FULL = np.array([1.5, 2.0, -2.0, 3.0, -4.0, -4.0])


def demonstration(name, signals, times=TIMES, channels=CHANNELS):
    return Demonstration(name, "made", times, signals, tuple(Channel(c, "N") for c in channels))


def gripping(seed=0, force=1.0, noise=0.005, added=0.0, columns=range(6)):
    """A grip with white noise, rounded to counts."""
    rng = np.random.default_rng(seed)
    signals = force * np.outer(GRIP, FULL) + OFFSET + noise * rng.standard_normal((6000, 6))
    signals = np.rint((signals + added) / STEPS) * STEPS
    return Labelled(demonstration(f"grip {seed}", signals[:, columns]), SEGMENTS)


@pytest.fixture(scope="module")
def grips():
    return [gripping(seed) for seed in range(4)]


def figures_of(items, real=None):
    return {row.name: row for row in realism(items, real or items)}


@pytest.fixture(scope="module")
def figures(grips):
    return figures_of(grips)


# --- figures ------------------------------------------------------------------------------------


def test_durations_and_numbers_of_segments_are_those_of_the_labels(grips):
    longer = replace(
        grips[0],
        segments=(
            *SEGMENTS[:2],
            Segment(2.0, 2.5, "hold"),
            Segment(2.5, 3.5, "hold"),
            *SEGMENTS[3:],
        ),
    )
    figures = figures_of([longer, grips[1], grips[2]])
    assert figures["duration"].simulated == pytest.approx(6.0)
    assert figures["unlabelled share"].simulated == pytest.approx(100 * 0.1 / 6)
    assert figures["hold: segments"].simulated == pytest.approx(4 / 3)
    assert figures["still: segments"].simulated == 2
    assert figures["hold: duration, lower quartile"].simulated == pytest.approx(0.875)
    assert figures["hold: duration, median"].simulated == pytest.approx(1.5)
    assert figures["hold: duration, upper quartile"].simulated == pytest.approx(2.0)


def test_forces_are_those_above_the_reading_at_rest_overall_and_within_actions(figures):
    expected = {
        "all actions: normal force of sensor 1, peak": 4.0,
        "all actions: tangential force of sensor 1, peak": 5.0,
        "all actions: normal force of sensor 2, peak": 2.0,
        "all actions: tangential force of sensor 2, peak": 2.5,
        "hold: normal force of sensor 1, median": 4.0,
        "hold: tangential force of sensor 2, median": 2.5,
        "grab: normal force of sensor 1, median": 2.0,
        "release: tangential force of sensor 1, peak": 4.0,
        "gripped: tangential over normal force": 1.25,
    }
    for name, value in expected.items():
        assert figures[name].simulated == pytest.approx(value, rel=0.02), name
    assert not any(name.startswith("still: normal") for name in figures)


def test_a_linear_grip_rises_from_10_to_90_percent_in_four_fifths_of_its_time(figures):
    assert figures["grab: rise from 10 to 90 %"].simulated == pytest.approx(0.4, abs=0.01)


def test_the_rise_is_that_of_the_grip_even_where_the_coder_ends_the_grab_early(grips):
    early = (*SEGMENTS[:1], Segment(1.5, 1.7, "grab"), Segment(1.7, 4.0, "hold"), *SEGMENTS[3:])
    figures = figures_of([replace(item, segments=early) for item in grips])
    assert figures["grab: rise from 10 to 90 %"].simulated == pytest.approx(0.4, abs=0.01)


def test_noise_and_its_density_are_those_of_white_noise_and_rounding(figures):
    for kind, step in (("tangential", 2.0), ("normal", 6.0)):
        density = np.sqrt((5.0**2 + step**2 / 12) / (RATE / 2))
        noise = density * np.sqrt(RATE / 2 - 15)
        measured = figures[f"{kind} axes: noise at rest above 15 Hz"].simulated
        assert measured == pytest.approx(noise, rel=0.03)
        for band in ("15 to 40", "40 to 100", "100 to 400"):
            at_rest = figures[f"{kind} axes at rest: {band} Hz"].simulated
            assert at_rest == pytest.approx(density, rel=0.15)


def test_a_tremor_of_10_hz_shows_in_its_band_in_action_and_nowhere_else(figures):
    tremor = 0.2 * np.outer(np.sin(2 * np.pi * 10 * TIMES) * (GRIP == 1), np.eye(6)[2])
    shaken = figures_of([gripping(seed, added=tremor) for seed in range(4)])
    # Its power over the band of 7 Hz; one of two normal axes shakes, 2 of the 3 s in action.
    density = 1e3 * np.sqrt(0.2**2 / 2 / 7 / 2 * 2 / 3)
    name = "normal axes in action: 8 to 15 Hz"
    assert shaken[name].simulated == pytest.approx(density, rel=0.2)
    assert shaken[name].simulated > 10 * figures[name].simulated
    for other in ("normal axes at rest: 8 to 15 Hz", "tangential axes in action: 8 to 15 Hz"):
        assert shaken[other].simulated == pytest.approx(figures[other].simulated, rel=0.05)


def test_a_zero_that_drifts_steadily_is_no_part_of_the_spectrum_at_rest(figures):
    drift = np.outer(0.2 * (TIMES - TIMES.mean()), np.ones(6))
    drifting = figures_of([gripping(seed, added=drift) for seed in range(4)])
    for name in figures:
        if "at rest" in name:
            assert drifting[name].simulated == pytest.approx(figures[name].simulated, rel=0.1), name


def test_the_step_between_counts_is_found_even_where_straight_lines_joined_them(grips):
    jitter = np.cumsum(np.random.default_rng(1).uniform(0.8, 1.2, 6000)) / RATE
    lined = [
        replace(
            item,
            demonstration=demonstration(
                "lined",
                np.stack(
                    [np.interp(TIMES, jitter, c) for c in item.demonstration.signals.T], axis=1
                ),
            ),
        )
        for item in grips
    ]
    figures = figures_of(lined, grips)
    for kind, step in (("tangential", 2.0), ("normal", 6.0)):
        row = figures[f"{kind} axes: quantisation step"]
        assert row.simulated == pytest.approx(step, rel=1e-6)
        assert row.real == pytest.approx(step, rel=1e-6)


def test_it_does_not_matter_which_sensor_is_called_left(grips, figures):
    swapped = [gripping(seed, columns=[3, 4, 5, 0, 1, 2]) for seed in range(4)]
    for name, row in figures_of(swapped, grips).items():
        assert row.simulated == pytest.approx(figures[name].real, rel=1e-9), name


def test_a_tap_outside_all_actions_does_not_pass_for_a_grip(grips, figures):
    tap = np.outer(-30 * np.exp(-(((TIMES - 0.5) / 0.01) ** 2)), np.eye(6)[2])
    tapped = figures_of([gripping(seed, added=tap) for seed in range(4)])
    for name in tapped:
        if "force" in name or "rise" in name:
            assert tapped[name].simulated == pytest.approx(figures[name].simulated, rel=1e-3), name


def test_one_demonstration_that_went_wrong_does_not_move_the_figures(grips, figures):
    wild = figures_of([*grips, gripping(9, force=6.0)])
    for name in ("all actions: normal force of sensor 1, peak", "grab: rise from 10 to 90 %"):
        assert wild[name].simulated == pytest.approx(figures[name].simulated, rel=0.02)


def test_lost_samples_and_missing_values_do_not_disturb_the_spectrum(grips, figures):
    def broken(item):
        signals = np.array(item.demonstration.signals)
        signals[300:303, 2] = np.nan
        kept = np.delete(np.arange(6000), [700, 701, 2500, 5000])
        return replace(item, demonstration=demonstration("b", signals[kept], TIMES[kept]))

    result = figures_of([broken(item) for item in grips], grips)
    for name, row in result.items():
        assert row.simulated == pytest.approx(figures[name].real, rel=0.06, abs=0.002), name


# --- rows ---------------------------------------------------------------------------------------


def test_recordings_are_like_themselves_in_every_figure(grips):
    rows = realism(grips, grips)
    assert len(rows) > 50
    assert all(row.ratio == 1.0 and row.alike for row in rows)


def test_twice_the_force_is_marked_and_less_is_not(grips):
    for force, alike in ((1.9, True), (2.2, False), (0.55, True), (0.45, False)):
        other = [gripping(seed, force) for seed in range(4)]
        row = figures_of(other, grips)["hold: normal force of sensor 1, median"]
        assert row.ratio == pytest.approx(force, rel=0.01)
        assert row.alike is alike
        marks = {line[1]: line[0] for line in cells([row])[1:]}
        assert marks == {row.name: "" if alike else "!"}


def test_the_mark_begins_beyond_a_factor_of_two_either_way_and_at_any_difference_from_zero():
    assert Comparison("a", "", 2.0, 1.0).alike
    assert Comparison("a", "", 1.0, 2.0).alike
    assert not Comparison("a", "", 2.01, 1.0).alike
    assert not Comparison("a", "", 1.0, 2.01).alike
    assert Comparison("a", "", 0.0, 0.0).alike
    assert not Comparison("a", "", 0.0, 1.0).alike
    assert not Comparison("a", "", 0.1, 0.0).alike
    assert Comparison("a", "", 0.1, 0.0).ratio is None


def test_the_table_says_figure_unit_numbers_and_ratio():
    rows = [Comparison("duration", "s", 4.5678, 5.0), Comparison("slips", "", 1.0, 0.0)]
    assert cells(rows) == [
        ["", "figure", "unit", "simulated", "real", "ratio"],
        ["", "duration", "s", "4.57", "5", "0.91"],
        ["!", "slips", "", "1", "0", "-"],
    ]


def test_an_action_that_one_side_has_counts_no_segments_on_the_other(grips):
    spelled = [
        replace(item, segments=tuple(replace(s, action=f"{s.action}_x") for s in item.segments))
        for item in grips
    ]
    apart = figures_of(grips, spelled)
    assert (apart["grab: segments"].simulated, apart["grab: segments"].real) == (1, 0)
    assert (apart["grab_x: segments"].simulated, apart["grab_x: segments"].real) == (0, 1)
    assert not apart["grab: segments"].alike
    assert "grab: duration, median" not in apart


def test_bands_that_a_slow_recording_cannot_hold_are_left_out(grips):
    slow = [
        replace(
            item,
            demonstration=demonstration("slow", item.demonstration.signals[::5], TIMES[::5]),
        )
        for item in grips
    ]
    names = set(figures_of(slow, grips))
    assert "normal axes at rest: 40 to 100 Hz" in names
    assert "normal axes at rest: 100 to 400 Hz" not in names


@pytest.mark.parametrize(
    ("spoilt", "sentence"),
    [
        (lambda items: items[:0], "There is no demonstration"),
        (lambda items: [replace(items[0], segments=())], "'grip 0' has no labels"),
        (
            lambda items: [
                replace(
                    items[0],
                    demonstration=demonstration("odd", np.zeros((6000, 6)), channels="abcdef"),
                )
            ],
            "'odd' has no 3-axis force sensor",
        ),
        (
            lambda items: [
                items[0],
                Labelled(
                    demonstration("one", np.zeros((6000, 3)), channels=CHANNELS[:3]), SEGMENTS
                ),
            ],
            "different numbers of sensors",
        ),
    ],
)
def test_what_cannot_be_compared_is_refused_with_a_sentence(grips, spoilt, sentence):
    with pytest.raises(InputError, match=sentence):
        realism(spoilt(grips), grips)
    with pytest.raises(InputError, match=sentence):
        realism(grips, spoilt(grips))


def test_recognition_is_compared_by_the_scores_of_leaving_one_out():
    easy = [Labelled(*pair) for pair in synthetic_set(3, rate=100.0)]
    hard = [Labelled(*pair) for pair in synthetic_set(4, rate=100.0)][1:]
    settings = Settings(max_scale=64.0, classifier="naive-bayes", stride=2)
    seen = []
    rows = finish(recognition(easy, hard, settings=settings), seen.append)
    expected = [finish(leave_one_out(side, settings)).scores("raw")[0] for side in (easy, hard)]
    row = {row.name: row for row in rows}["raw: accuracy"]
    assert (row.simulated, row.real) == (expected[0].accuracy, expected[1].accuracy)
    assert len(rows) == 6
    assert seen


# --- real recordings ----------------------------------------------------------------------------

needs_tongs = pytest.mark.skipif(not TONGS.is_dir(), reason="the real recordings are not here")


def published(name):
    recordings = pdl.read(TONGS / name, ReadOptions())
    found = (Labelled(r.demonstration, r.tracks[0].segments) for r in recordings)
    return [item.merged(PUBLISHED) for item in found]


@pytest.mark.real
@needs_tongs
def test_the_steps_of_the_real_sensors_are_found_through_the_lines_that_joined_their_counts():
    rows = figures_of(published("JPen_sig.pdl"), published("soft_sig.pdl"))
    # The same two devices, swapped: 1/767.5, 1/812.5, 1/429.8, 1/467.8; 1/158.61, 1/165.95 N.
    lateral = np.median(np.repeat([1 / 767.5, 1 / 812.5, 1 / 429.8, 1 / 467.8], 2))
    normal = np.median([1 / 158.61, 1 / 165.95])
    for kind, step in (("tangential", lateral), ("normal", normal)):
        row = rows[f"{kind} axes: quantisation step"]
        assert row.simulated == pytest.approx(1e3 * step, rel=1e-3)
        assert row.real == pytest.approx(1e3 * step, rel=1e-3)
    assert rows["grab: segments"].alike


@pytest.mark.real
@needs_tongs
@pytest.mark.parametrize("name", ["JPen_sig.pdl", "soft_sig.pdl"])
def test_the_simulated_sensor_at_rest_is_like_the_real_ones_in_every_figure(name):
    still = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        made = record(np.zeros((10_001, 6)), 2000.0, RATE, Sensor.drawn(rng), rng)
        still.append(
            Labelled(
                demonstration(f"still {seed}", made.signals, made.times),
                (Segment(0.0, 2.0, "still"), Segment(2.0, 5.0, "still")),
            )
        )
    rows = [
        row
        for row in realism(still, published(name))
        if "at rest" in row.name or "step" in row.name
    ]
    assert len(rows) == 16
    # What moves slower than 8 Hz at rest is also the creep of a grip before, and the hand.
    for row in rows:
        slow = row.name.endswith(("0.5 to 2 Hz", "2 to 8 Hz"))
        assert 0.25 < row.ratio < 4 if slow else row.alike, row
