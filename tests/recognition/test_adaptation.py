"""Sensors that are swapped and scaled are set right without labels; others are left alone."""

from dataclasses import replace

import numpy as np
import pytest
from factories import labelled_set

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.recognition.adaptation import LEAST_LOG_RATIO, estimate_adaptation
from forcelab.recognition.cross_validation import train_and_test_job
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.presets import preset

RATE = 200.0
#: Of the two sensors' axes: one side of the tongs is held loosely.
UNEVEN = np.array([1.0, 1.0, 1.0, 0.35, 0.35, 0.35])
SWAP = [3, 4, 5, 0, 1, 2]
GAIN = np.array([1.5, 1.5, 1.3, 1.7, 1.7, 1.9])
OFFSET = np.array([0.4, -0.3, 0.6, -0.2, 0.1, -0.5])
SETTINGS = preset("fast").replace(amplitude="absolute", decoder="filters", classifier="logistic")


def labelled_with(item, change):
    old = item.demonstration
    return replace(item, demonstration=replace(old, signals=change(np.array(old.signals))))


@pytest.fixture(scope="module")
def people():
    items = labelled_set(10, RATE)
    uneven = [labelled_with(item, lambda signals: signals * UNEVEN) for item in items]
    return uneven[:6], uneven[6:]


def accuracy(evaluation, which="filtered"):
    return evaluation.scores(which)[0].accuracy


def test_accuracy_is_restored_where_sensors_are_swapped_and_scaled(people):
    train, test = people
    turned = [
        labelled_with(item, lambda signals: signals[:, SWAP] * GAIN + OFFSET) for item in test
    ]
    right = accuracy(finish(train_and_test_job(train, test, SETTINGS)))
    evaluation = finish(train_and_test_job(train, turned, SETTINGS, adapt=True))
    assert accuracy(evaluation, "unadapted") == accuracy(
        finish(train_and_test_job(train, turned, SETTINGS))
    )
    assert accuracy(evaluation, "unadapted") < right - 0.1
    assert accuracy(evaluation) > right - 0.03
    (remark,) = [sentence for sentence in evaluation.remarks if "Adapted" in sentence]
    assert "sensors are swapped (2 for 1 and 1 for 2" in remark
    record = evaluation.to_json()
    assert record["unadapted"]["pooled"]["accuracy"] < record["filtered"]["pooled"]["accuracy"]
    # What is tested stays the recording: its id, its stamps and its labels.
    assert [result.id for result in evaluation.tested] == [item.demonstration.id for item in turned]


def test_with_matching_sensors_nothing_is_swapped(people):
    for train, test in (people, people[::-1]):
        found = estimate_adaptation(train, test)
        assert not found.swapped
        assert found.log_ratio < 0
        assert "no sensor is swapped" in found.summary
    scaled = [labelled_with(item, lambda signals: signals * GAIN + OFFSET) for item in people[1]]
    assert not estimate_adaptation(people[0], scaled).swapped
    even = labelled_set(6, RATE)
    assert not estimate_adaptation(even[:3], even[3:]).swapped


def test_alike_demonstrations_stay_as_they_are(people):
    train, _ = people
    found = estimate_adaptation(train, train)
    for item in train:
        again = found.apply(item).demonstration
        assert np.allclose(again.signals, item.demonstration.signals, atol=1e-12)
    assert set(found.gain.values()) == {1.0}


def test_levels_and_scales_come_to_those_of_training(people):
    train, _ = people
    turned = [
        labelled_with(item, lambda signals: signals[:, SWAP] * GAIN + OFFSET) for item in train
    ]
    found = estimate_adaptation(train, turned)
    assert found.log_ratio > LEAST_LOG_RATIO
    for item, expected in zip(turned, train, strict=True):
        again = found.apply(item).demonstration
        assert again.channels == item.demonstration.channels
        # Normal forces are set right to the sample; a hypotenuse of unequal gains nearly so.
        for column in (2, 5):
            assert np.allclose(
                again.signals[:, column], expected.demonstration.signals[:, column], atol=1e-9
            )


def test_labels_are_not_looked_at(people):
    train, test = people
    bare = [replace(item, segments=()) for item in (*train, *test)]
    assert estimate_adaptation(bare[: len(train)], bare[len(train) :]) == estimate_adaptation(
        train, test
    )


def test_a_dead_channel_is_not_blown_up(people):
    train, test = people

    def dead(signals):
        signals[:, 2] = 1e-6 * np.random.default_rng(0).standard_normal(len(signals))
        return signals

    found = estimate_adaptation(train, [labelled_with(item, dead) for item in test])
    assert found.gain["fz1"] == 1.0


def test_missing_samples_stay_missing(people):
    train, test = people

    def holed(signals):
        signals[50:60, 1] = np.nan
        return signals

    again = estimate_adaptation(train, test).apply(labelled_with(test[0], holed)).demonstration
    assert np.isnan(again.signals[50:60, 1]).all()
    assert np.isfinite(again.signals[:, 0]).all()


def test_other_channels_are_refused(people):
    train, test = people
    old = test[0].demonstration
    other = replace(old, name="x", signals=old.signals[:, :1], channels=(Channel("p"),))
    with pytest.raises(InputError, match="'x' has the channels p but .* has fx1"):
        estimate_adaptation(train, [LabelledDemonstration(other)])


def test_channels_without_sensors_are_scaled_and_never_swapped():
    random = np.random.default_rng(0)
    times = np.arange(400) / 100.0

    def labelled_noise(name, gain):
        signals = random.standard_normal((400, 2)) * gain
        signals[:20] = 0
        return LabelledDemonstration(
            Demonstration(name, "", times, signals, [Channel("a"), Channel("b")])
        )

    found = estimate_adaptation(
        [labelled_noise("x", 1.0)], [labelled_noise("y", np.array([3.0, 0.5]))]
    )
    assert not found.swapped
    assert found.gain["a"] == pytest.approx(1 / 3, rel=0.2)
    assert found.gain["b"] == pytest.approx(2, rel=0.2)
