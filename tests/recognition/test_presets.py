"""Presets with windows and a decoder, end to end; and nothing of a held-out demonstration leaks."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from factories import labelled_set

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.labels import Segment
from forcelab.recognition.cross_validation import leave_one_out_job
from forcelab.recognition.examples import LabelledDemonstration, prepare_examples
from forcelab.recognition.presets import preset
from forcelab.recognition.settings import Settings
from forcelab.recognition.storage import load_recogniser, pack, save_recogniser
from forcelab.recognition.training import train

pytestmark = pytest.mark.usefixtures("small_fits")

FAST, BEST = preset("fast"), preset("best")


@pytest.fixture(scope="module")
def four():
    return labelled_set(4, rate=100.0)


@pytest.fixture(scope="module")
def trained(four):
    return train(four[:3], BEST)


@pytest.fixture(scope="module")
def evaluated(four):
    return finish(leave_one_out_job(four, FAST))


def accuracy(evaluation):
    return evaluation.scores("filtered")[0].accuracy


def changed(item, signals):
    return dataclasses.replace(
        item, demonstration=dataclasses.replace(item.demonstration, signals=signals)
    )


def test_a_decoded_prediction_covers_every_stamp_with_probabilities(trained, four):
    unseen = four[3].demonstration
    found = trained.predict(unseen, probability_trace=True)
    n = len(unseen.times)
    assert found.times is unseen.times
    assert found.raw.shape == found.filtered.shape == (n,)
    assert found.probabilities.shape == (n, len(trained.actions))
    np.testing.assert_allclose(found.probabilities.sum(axis=1), 1.0)
    assert list(found.stages) == ["raw", "filtered"]
    assert found.probability_trace.values.shape[1] == len(trained.actions)
    # The decoder leaves no flicker: about as many segments as the human has.
    assert len(found.segments) <= len(four[3].segments) + 2


def test_asking_for_certainty_changes_nothing_else(trained, four):
    certain = trained.predict(four[3].demonstration, probability_trace=True)
    plain = trained.predict(four[3].demonstration)
    assert plain.probability_trace is None
    np.testing.assert_array_equal(certain.filtered, plain.filtered)
    np.testing.assert_array_equal(certain.probabilities, plain.probabilities)


@pytest.mark.parametrize("name", ["fast", "mlp", "ensemble"])
def test_a_loaded_recogniser_decodes_to_the_bit_what_the_saved_one_did(four, tmp_path, name):
    recogniser = train(four[:2], preset(name))
    save_recogniser(recogniser, tmp_path / "foam.skops")
    loaded = load_recogniser(tmp_path / "foam.skops")
    before, after = (r.predict(four[3].demonstration) for r in (recogniser, loaded))
    np.testing.assert_array_equal(after.filtered, before.filtered)
    np.testing.assert_array_equal(after.probabilities, before.probabilities)
    assert loaded.settings == recogniser.settings
    assert loaded.grammar.to_json() == recogniser.grammar.to_json()


def test_a_decoder_without_choreography_is_refused(trained, tmp_path):
    path = tmp_path / "foam.skops"
    path.write_bytes(pack(dataclasses.replace(trained, grammar=None)))
    with pytest.raises(InputError, match="not a whole recogniser"):
        load_recogniser(path)


def test_nothing_of_the_held_out_demonstration_is_seen(four):
    first = (four[0], four[1])
    clean = finish(leave_one_out_job([*first, four[3]], BEST))
    poisoned = [*first, LabelledDemonstration(four[3].demonstration, _nonsense(four[3]))]
    after = finish(leave_one_out_job(poisoned, BEST))
    # Other labels of the one that is left out: its prediction stays to the bit.
    before, now = clean.tested[2], after.tested[2]
    names = [tuple(s.action for s in item.result.predicted) for item in (before, now)]
    assert names[0] == names[1]
    edges = [[s.start for s in item.result.predicted] for item in (before, now)]
    assert edges[0] == edges[1]
    # Other forces there: what is predicted of it changes, the recogniser does not.
    rows = np.random.default_rng(0).normal(size=four[3].demonstration.signals.shape) * 1e3
    examples = [prepare_examples(item, BEST) for item in (*four[:3], changed(four[3], rows))]
    again = [prepare_examples(item, BEST) for item in four]
    for example, repeated in zip(examples[:3], again[:3], strict=True):
        np.testing.assert_array_equal(example.features, repeated.features)


def _nonsense(item):
    """The segments with their actions turned round, so that none is right."""
    actions = [segment.action for segment in item.segments]
    return tuple(
        Segment(s.start, s.end, action)
        for s, action in zip(item.segments, actions[1:] + actions[:1], strict=True)
    )


def test_shuffled_labels_give_chance(four, evaluated):
    random = np.random.default_rng(0)
    shuffled = []
    for item in four:
        start, end = item.segments[0].start, item.segments[-1].end
        edges = np.linspace(start, end, 25)
        names = sorted({segment.action for segment in item.segments})
        drawn = random.integers(len(names), size=24)
        cut = zip(edges[:-1], edges[1:], drawn, strict=True)
        shuffled.append(
            LabelledDemonstration(
                item.demonstration,
                tuple(Segment(float(a), float(b), names[i]) for a, b, i in cut),
            )
        )
    actions = len({s.action for item in shuffled for s in item.segments})
    assert accuracy(finish(leave_one_out_job(shuffled, FAST))) < 1 / actions + 0.2
    assert accuracy(evaluated) > 0.8


def test_an_evaluation_says_what_the_choreography_was_worth_and_how_far_to_rely_on_it(
    four, evaluated
):
    found, record = evaluated, evaluated.to_json()
    assert found.kinds == ("raw", "unaided", "filtered")
    assert record["unaided"]["pooled"]["accuracy"] > 0.7
    without = finish(leave_one_out_job(four, FAST.replace(choreography="none")))
    for result, unaided in zip(found.tested, without.tested, strict=True):
        np.testing.assert_array_equal(result.ablations["unaided"], unaided.filtered)
    reliability = record["reliability"]
    assert 0 < reliability["brier"] < 0.5
    assert sum(n for n, _, _ in reliability["bins"]) == int(found.reliability.steps.sum())


def test_the_published_code_differs_from_the_text_as_it_says():
    released = preset("released")
    assert released.scales.tolist() == [2.0**j for j in range(2, 13)]
    assert (released.threshold, released.median, released.drop) == (None, 101, 0.125)
    same = ("classifier", "phase", "stride", "wavelet", "features", "decoder", "circular", "step")
    assert all(getattr(released, name) == getattr(Settings(), name) for name in same)
