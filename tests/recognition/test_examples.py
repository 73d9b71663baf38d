"""Examples: features and codes of demonstrations; units are never mixed silently."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from factories import synthetic_demonstration, synthetic_set
from skops import io as skops_io

from forcelab.demonstration import Channel
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.label_map import MergeMap
from forcelab.labels import UNLABELLED, Segment, Track, to_codes
from forcelab.project import Project
from forcelab.recognition.dataset import DataSelection
from forcelab.recognition.examples import (
    LabelledDemonstration,
    actions_of,
    common_channels,
    common_rate,
    mixed_unit_remarks,
    prepare_examples,
    unit_remarks,
    units_of,
)
from forcelab.recognition.presets import preset
from forcelab.recognition.project_runs import evaluate_tasks_job, train_tasks_job
from forcelab.recognition.settings import Settings
from forcelab.recognition.storage import TRUSTED, dump, load_recogniser
from forcelab.recognition.training import train

SMALL = Settings(max_scale=16.0)


def labelled(seed=1, rate=100.0):
    return LabelledDemonstration(*synthetic_demonstration(seed, rate))


def with_gap(item, start, seconds):
    """The same recording with a pause of `seconds` put in at sample `start`."""
    old = item.demonstration
    times = old.times.copy()
    times[start:] += seconds
    return replace(item, demonstration=replace(old, times=times))


@pytest.mark.parametrize(
    "settings", [SMALL, preset("best"), preset("fast")], ids=["paper", "best", "fast"]
)
@pytest.mark.parametrize("rate", [None, 400.0, 2000.0])
def test_a_glitch_takes_nothing_with_it_that_lies_elsewhere(settings, rate):
    item = labelled(rate=1000.0)
    signals = item.demonstration.signals.copy()
    signals[1000] = 1e16
    broken = replace(item.demonstration, signals=signals)
    clean, found = (
        prepare_examples(labelled, settings, rate)
        for labelled in (item, LabelledDemonstration(broken))
    )
    far = np.abs(clean.times - 1.0) > 1.5
    assert far.sum() > 10
    np.testing.assert_allclose(found.features[far], clean.features[far], rtol=0, atol=0.1)


def test_wavelets_stand_behind_the_windows_where_both_are_wanted():
    item, windows = labelled(), preset("best")
    both = windows.replace(features="windows+wavelets", max_scale=16.0)
    found = prepare_examples(item, both).features
    first = prepare_examples(item, windows).features
    then = prepare_examples(item, SMALL.replace(step=windows.step)).features
    np.testing.assert_array_equal(found, np.concatenate([first, then], axis=1))
    assert found.shape[1] == both.width(4, 100.0)
    # Each belongs to a band of its own channel, one of a frequency nearest to its own.
    k = len(both.windows)
    bands = both.feature_bands(4, 100.0)[first.shape[1] :]
    np.testing.assert_array_equal(bands // k, np.tile(np.repeat(np.arange(4), 4), 2))
    hertz, nearest = SMALL.bands(100.0), both.bands(100.0)[bands[:4]]
    for own, chosen in zip(hertz, nearest, strict=True):
        others = np.abs(np.log(both.bands(100.0) / own))
        assert abs(np.log(chosen / own)) == pytest.approx(others.min())


def test_a_channel_that_is_not_there_is_refused_with_those_that_are():
    with pytest.raises(InputError, match=r"no recognition channel 'torque'.*normal 1"):
        prepare_examples(labelled(), SMALL.replace(channels=("torque",)))


def test_the_codes_are_those_of_the_segments():
    item = labelled()
    examples = prepare_examples(item, SMALL)
    actions = actions_of([examples])
    assert actions == ("still", "grab", "hold", "release")
    expected = to_codes(item.segments, item.demonstration.times, actions)
    np.testing.assert_array_equal(examples.codes(actions), expected)
    assert UNLABELLED in expected


def test_actions_that_are_not_requested_are_unlabelled():
    examples = prepare_examples(labelled(), SMALL)
    everything = examples.codes(("still", "grab", "hold", "release"))
    two = examples.codes(("hold", "still"))
    np.testing.assert_array_equal(two == 0, everything == 2)
    np.testing.assert_array_equal(two == 1, everything == 0)
    np.testing.assert_array_equal(two == UNLABELLED, ~np.isin(everything, [0, 2]))


def test_a_gap_is_unlabelled_although_a_segment_covers_it():
    item = with_gap(labelled(), 40, 1.0)
    over_all = LabelledDemonstration(item.demonstration, (Segment(0.0, 100.0, "still"),))
    examples = prepare_examples(over_all, SMALL)
    inside = (examples.times >= 0.41) & (examples.times < 1.39)
    assert inside.sum() >= 95
    np.testing.assert_array_equal(examples.valid, ~_in_gap(examples.times))
    codes = examples.codes(("still",))
    np.testing.assert_array_equal(codes == UNLABELLED, ~examples.valid)
    assert (codes[inside] == UNLABELLED).all()


def _in_gap(times):
    """Sample 39 lies at 0.39 s and lasts to 0.40 s; sample 40 comes at 1.40 s."""
    return (times > 0.395) & (times < 1.395)


def test_merged_spellings_are_one_action_and_the_stored_segments_stay():
    item = labelled()
    before = item.segments
    merged = prepare_examples(item, SMALL.replace(merge=MergeMap({"grab": "grip", "hold": "grip"})))
    assert actions_of([merged]) == ("still", "grip", "release")
    plain = prepare_examples(item, SMALL).codes(("still", "grab", "hold", "release"))
    np.testing.assert_array_equal(
        merged.codes(("still", "grip", "release")), np.array([0, 1, 1, 2, -1])[plain]
    )
    assert item.segments is before
    assert {segment.action for segment in before} == {"still", "grab", "hold", "release"}


def test_the_rate_on_which_recordings_meet_is_the_asked_one_or_the_median():
    recordings = [labelled(i, rate).demonstration for i, rate in enumerate([100.0, 200.0, 100.0])]
    assert common_rate(recordings, SMALL) == pytest.approx(100.0)
    assert common_rate(recordings, SMALL.replace(rate=50.0)) == 50.0


@pytest.mark.parametrize("rate", [50.0, 200.0])
def test_examples_at_another_rate_keep_the_human_at_the_same_seconds(rate):
    examples = prepare_examples(labelled(rate=100.0), SMALL.replace(rate=80.0), rate)
    assert examples.rate == pytest.approx(rate)
    np.testing.assert_allclose(np.diff(examples.times), 1 / rate)
    codes = examples.codes(("still", "grab", "hold", "release"))
    for segment in labelled().segments:
        middle = int(np.argmin(np.abs(examples.times - (segment.start + segment.end) / 2)))
        assert ("still", "grab", "hold", "release")[codes[middle]] == segment.action


def test_recordings_of_different_channels_are_refused_by_name():
    item = labelled()
    old = item.demonstration
    names = tuple(Channel(f"emg{i}") for i in range(len(old.channels)))
    other = LabelledDemonstration(replace(old, name="EMG", channels=names))
    alike = [prepare_examples(item, SMALL), prepare_examples(labelled(2), SMALL)]
    assert common_channels(alike) == alike[0].channels
    with pytest.raises(InputError, match=r"'foam 01' has the channels .* but 'EMG' has .*emg0"):
        common_channels([*alike, prepare_examples(other, SMALL)])


BAYES = Settings(max_scale=32.0, stride=6, classifier="naive-bayes")


def in_counts(demonstration):
    channels = tuple(Channel(channel.name, "") for channel in demonstration.channels)
    return replace(demonstration, channels=channels, signals=400 * demonstration.signals)


@pytest.fixture(scope="module")
def four():
    return synthetic_set(4, rate=100.0)


@pytest.fixture(scope="module")
def recogniser(four):
    return train([LabelledDemonstration(*pair) for pair in four[:2]], BAYES)


@pytest.fixture
def project(tmp_path, four):
    with Project.create(tmp_path / "mixed.forcelab") as created:
        for i, (demonstration, segments) in enumerate(four[:3]):
            stored = in_counts(demonstration) if i == 1 else demonstration
            created.demonstrations.add(stored, [Track("Ann", segments)])
        yield created


def test_demonstrations_in_counts_among_newtons_are_named_with_the_cure(four):
    demonstrations = [demonstration for demonstration, _ in four]
    assert mixed_unit_remarks(demonstrations, BAYES) == ()
    demonstrations[2] = in_counts(demonstrations[2])
    [remark] = mixed_unit_remarks(demonstrations, BAYES)
    odd, others = demonstrations[2].name, [demonstrations[i].name for i in (0, 1, 3)]
    assert f"without a unit in '{odd}'" in remark
    assert f"in N in {', '.join(f'{chr(39)}{name}{chr(39)}' for name in others)}" in remark
    assert "by a calibration" in remark
    assert mixed_unit_remarks([], BAYES) == ()


def test_only_channels_that_are_looked_at_count(four):
    demonstration = four[0][0]
    channels = (*demonstration.channels[:-1], Channel("fz2", ""))
    pair = [demonstration, replace(demonstration, name="other", channels=channels)]
    assert mixed_unit_remarks(pair, BAYES.replace(channels=("normal 1",))) == ()
    assert "normal 2" in mixed_unit_remarks(pair, BAYES)[0]


def test_a_recogniser_tells_what_it_learnt_in_other_units(recogniser, four):
    demonstration = four[3][0]
    assert recogniser.units == ("N",) * 4
    assert recogniser.unit_remarks(demonstration.channels) == ()
    [remark] = recogniser.unit_remarks(in_counts(demonstration).channels)
    assert "without a unit" in remark
    assert "learnt it in N" in remark


def test_units_are_kept_in_its_file_and_older_files_still_load(recogniser, four, tmp_path):
    file = tmp_path / "new.skops"
    file.write_bytes(dump(recogniser))
    assert load_recogniser(file).units == recogniser.units
    content = skops_io.loads(dump(recogniser), trusted=list(TRUSTED))
    del content["units"]
    file.write_bytes(skops_io.dumps(content))
    old = load_recogniser(file)
    assert old.units == ()
    assert old.unit_remarks(in_counts(four[3][0]).channels) == ()
    assert np.array_equal(old.predict(four[3][0]).filtered, recogniser.predict(four[3][0]).filtered)


def test_evaluating_and_training_on_mixed_units_is_remarked_on(project):
    name = project.demonstrations.infos()[1].name
    evaluated = finish(evaluate_tasks_job(project, BAYES, DataSelection()))
    trained = finish(train_tasks_job(project, BAYES, DataSelection(), "mixed"))
    for remarks in (evaluated.remarks, trained.remarks):
        assert any(f"without a unit in '{name}'" in remark for remark in remarks)
    assert trained.recogniser.units == ()


def test_each_recognition_channel_has_its_unit():
    channels = [Channel("fx", "N"), Channel("fy", "N"), Channel("fz", "mN"), Channel("opening", "")]
    assert units_of(channels) == ("N", "mN", "")
    assert unit_remarks(("N",), ("tangential",), channels) == ()
