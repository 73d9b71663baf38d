"""Recognition of what breaks careless code: right, or refused in one sentence, whatever preset."""

import math
from dataclasses import replace

import numpy as np
import pytest
from factories import labelled_set

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.labels import Segment
from forcelab.recognition import live_model
from forcelab.recognition.cross_validation import leave_one_out_job
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.presets import preset
from forcelab.recognition.training import train

# What breaks careless code breaks small forests as well, and one of three that follow streams.
pytestmark = pytest.mark.usefixtures("small_fits", "one_look")

RATE = 100.0
NAMES = ("paper", "best", "ensemble")
THREE = labelled_set(3, rate=RATE)


def pinned(item):
    """A channel that never changes: both of its columns are stuck."""
    signals = item.demonstration.signals.copy()
    signals[:, :2] = 5.0
    return replace(item, demonstration=replace(item.demonstration, signals=signals))


PINNED = [pinned(item) for item in THREE]


@pytest.fixture(scope="module")
def one_look():
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(live_model, "LOOKS", live_model.LOOKS[:1])
        yield


def settings_of(name):
    """A preset that learns in a tenth of a second; its method is left as it is."""
    return preset("paper").replace(stride=8, max_scale=32.0) if name == "paper" else preset(name)


@pytest.fixture(params=NAMES)
def settings(request):
    return settings_of(request.param)


@pytest.fixture(scope="module")
def trained(small_fits, one_look):
    return {name: train(PINNED[:2], settings_of(name)) for name in NAMES}


def predicted(recogniser, demonstration, probability_trace=True):
    """A prediction whose numbers are all numbers."""
    found = recogniser.predict(demonstration, probability_trace=probability_trace)
    assert len(found.filtered) == len(demonstration.times)
    assert set(found.filtered.tolist()) <= set(range(-1, len(recogniser.actions)))
    assert np.isfinite(found.probabilities).all()
    np.testing.assert_allclose(found.probabilities.sum(axis=1), 1.0, atol=1e-6)
    if probability_trace:
        assert found.probability_trace.values.shape[1] == len(recogniser.actions)
    return found


def agreement(recogniser, labelled):
    """The share of the labelled samples whose action is found, before any threshold."""
    found = predicted(recogniser, labelled.demonstration, probability_trace=False)
    times = labelled.demonstration.times
    codes = found.filtered if recogniser.settings.decodes else found.raw
    right = [
        recogniser.actions[code] == segment.action
        for segment in labelled.segments
        for code in codes[(times >= segment.start) & (times < segment.end)]
    ]
    return np.mean(right)


def refused(items, settings):
    """The sentence that refuses a training; exactly one."""
    with pytest.raises(InputError) as error:
        train(items, settings)
    message = str(error.value)
    assert message.endswith(".")
    assert ". " not in message
    return message


def only(labelled, condition):
    return replace(labelled, segments=tuple(s for s in labelled.segments if condition(s.action)))


def test_two_identical_demonstrations(settings):
    again = replace(THREE[0].demonstration, name="twin", times=THREE[0].demonstration.times + 1e-9)
    twins = [THREE[0], replace(THREE[0], demonstration=again)]
    recogniser = train(twins, settings)
    assert agreement(recogniser, THREE[0]) > 0.8
    with pytest.raises(InputError, match="hold the same recording"):
        finish(leave_one_out_job(twins, settings))


def test_one_action_only(settings):
    message = refused([only(item, lambda action: action == "hold") for item in THREE], settings)
    assert "two actions" in message
    assert "only hold" in message


def test_all_samples_unlabelled(settings):
    bare = [replace(item, segments=()) for item in THREE]
    assert "label at least two actions" in refused(bare, settings)
    with pytest.raises(InputError, match="needs two labelled ones"):
        finish(leave_one_out_job(bare, settings))


def test_an_action_in_a_single_demonstration(settings):
    items = [THREE[0], *(only(item, lambda action: action != "grab") for item in THREE[1:])]
    recogniser = train(items, settings)
    assert "grab" in recogniser.actions
    predicted(recogniser, THREE[0].demonstration)
    if settings.preset != "best":
        return
    evaluation = finish(leave_one_out_job(items, settings))
    assert any("grab (only in foam 01)" in remark for remark in evaluation.remarks)
    for tested in evaluation.tested:
        assert len(tested.filtered) == len(tested.human)


def steps(seed, actions, each=8):
    """Every action has a force of its own, for a few samples, in another order each time."""
    random = np.random.default_rng(seed)
    order = random.permutation(actions)
    signals = np.repeat(order, each)[:, None] + 0.05 * random.standard_normal((actions * each, 2))
    times = np.arange(actions * each) / RATE
    segments = tuple(
        Segment(i * each / RATE, (i + 1) * each / RATE, f"action {code:03}")
        for i, code in enumerate(order)
    )
    channels = (Channel("a", "N"), Channel("b", "N"))
    return LabelledDemonstration(
        Demonstration(f"steps {seed}", "steps", times, signals, channels), segments
    )


@pytest.mark.parametrize("name", NAMES)
def test_more_actions_than_a_signed_byte_counts(name):
    item = steps(1, 130)
    settings = settings_of(name).replace(max_scale=4.0, windows=(0.01, 0.04))
    recogniser = train([item], settings)
    assert len(recogniser.actions) == 130
    # Of the paper's method one sample of each was learnt from; chance is 0.008.
    assert agreement(recogniser, item) > (0.05 if name == "paper" else 0.8)


@pytest.mark.parametrize("name", ["paper", "best"])
def test_a_thousand_channels(name):
    random = np.random.default_rng(1)
    channels = tuple(Channel(f"c{i}", "N") for i in range(1000))
    segments = (Segment(0.0, 0.4, "weak"), Segment(0.4, 0.8, "strong"))
    size = np.repeat([0.1, 10.0], 40)[:, None]
    items = [
        LabelledDemonstration(
            Demonstration(
                f"wide {i}",
                "wide",
                np.arange(80) / RATE,
                size * random.standard_normal((80, 1000)),
                channels,
            ),
            segments,
        )
        for i in range(2)
    ]
    recogniser = train(
        items[:1], settings_of(name).replace(max_scale=2.0, stride=2, windows=(0.04,))
    )
    assert len(recogniser.channels) == 1000
    assert agreement(recogniser, items[1]) > 0.9


@pytest.mark.parametrize(
    ("value", "sentence"),
    [
        (0.0, "never change"),
        (7.0, "never change"),
        (1e30, "never change"),
        (3.5e38, "without missing samples"),
        (1e300, "without missing samples"),
    ],
)
def test_constant_features_everywhere(settings, value, sentence):
    still = [
        replace(
            item,
            demonstration=replace(
                item.demonstration, signals=np.full_like(item.demonstration.signals, value)
            ),
        )
        for item in THREE
    ]
    assert sentence in refused(still, settings)


@pytest.mark.parametrize("name", NAMES)
def test_constant_features_of_one_channel(trained, name):
    assert agreement(trained[name], PINNED[0]) > 0.4  # chance is a quarter


class Certain:
    """A classifier whose probabilities are 0 or 1, and which is as sure where it is wrong."""

    def __init__(self, actions):
        self.classes_ = np.arange(actions)

    def predict_proba(self, features):
        codes = np.arange(len(features)) // 7 % len(self.classes_)
        return np.eye(len(self.classes_))[codes]

    def predict(self, features):
        return np.argmax(self.predict_proba(features), axis=1)


@pytest.mark.parametrize("name", NAMES)
def test_probabilities_that_are_nothing_or_one(trained, name):
    known = trained[name]
    found = predicted(
        replace(known, classifier=Certain(len(known.actions))), THREE[2].demonstration
    )
    assert set(np.unique(found.probabilities)) == {0.0, 1.0}
    assert (found.filtered >= 0).any()


def test_a_median_wider_than_the_signal(trained):
    known, signal = trained["paper"], THREE[2].demonstration
    wide = replace(known, settings=known.settings.replace(median=10**7, threshold=None, drop=None))
    found = wide.predict(signal)
    # Ends are held: in a window that wide, each end's value fills half of it.
    ends = {int(found.raw[0]), int(found.raw[-1])}
    assert set(found.filtered.tolist()) <= {*ends, math.floor(sum(ends) / len(ends) + 0.5)}


@pytest.mark.parametrize("n", [2, 3, 5])
@pytest.mark.parametrize("name", NAMES)
def test_a_demonstration_of_hardly_any_samples(trained, name, n):
    short = Demonstration(
        "short", "foam", np.arange(n) / RATE, np.ones((n, 6)), THREE[0].demonstration.channels
    )
    predicted(trained[name], short)
