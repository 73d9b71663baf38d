"""What a review proposes to label next is not worse than any other demonstration."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic import synthetic_set

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.recognition import ensemble
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.presets import preset
from forcelab.recognition.training import fit_examples, prepare_all
from forcelab.review.active_learning import sample_steps, typicality
from tests.benchmarks import label_next
from tests.benchmarks.label_next import CHOOSING, measuring_next

#: Quick, and with probabilities all the same.
PLAIN = preset("fast").replace(amplitude="absolute", decoder="filters", stride=2)


def pressed(item, gain):
    """The same by somebody who presses harder."""
    old = item.demonstration
    made = Demonstration(old.name, old.task, old.times, gain * old.signals, old.channels)
    return replace(item, demonstration=made)


@pytest.fixture(scope="module")
def mixed():
    """Most by one person, some by another who presses four times as hard."""
    items = [LabelledDemonstration(*item) for item in synthetic_set(9, 50.0)]
    return [pressed(item, 4.0) if i % 4 == 0 else item for i, item in enumerate(items)]


@pytest.fixture(scope="module")
def rows(mixed):
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(ensemble, "TREES", 10)
        patched.setattr(label_next, "ADDED", 2)
        return finish(measuring_next(mixed, "foam", PLAIN, turns=4))


def test_proposed_demonstrations_bring_no_less_than_random_ones(rows):
    by_name = {row.setting: row for row in rows}
    chance = by_name["at random"]
    for name in ("least certain", "least certain of the typical"):
        row = by_name[name]
        assert row.error <= chance.error + 0.02
        gain = row.further["points gained"]
        assert gain == pytest.approx(100 * (chance.error - row.error), abs=1e-9)
        assert gain >= -2 * row.further["standard error"] - 1


def test_all_orders_are_measured_on_the_same_partings(rows):
    assert [row.setting for row in rows] == list(CHOOSING)
    assert len({(row.size, row.reference) for row in rows}) == 1
    chance = rows[-1]
    assert (chance.further["points gained"], chance.further["standard error"]) == (0, 0)
    assert rows[0].peak_bytes > 0
    assert rows[0].seconds > chance.seconds


def test_who_presses_harder_is_passed_over_until_the_others_are_labelled(mixed):
    examples = finish(prepare_all(mixed, PLAIN))
    recogniser = finish(fit_examples([examples[1], examples[2]], PLAIN))
    waiting = [*examples[3:8], examples[0]]  # the second and the last one press harder
    typical = np.array(CHOOSING["least certain of the typical"](recogniser, waiting))
    plain = np.array(CHOOSING["least certain"](recogniser, waiting))
    weights = typical / plain
    assert sorted(np.argsort(weights)[:2].tolist()) == [1, 5]
    assert weights == pytest.approx(typicality([sample_steps(one) for one in waiting]))


def test_who_chooses_sees_no_label(mixed, monkeypatch):
    given = []

    def spying(recogniser, waiting):
        given.extend(waiting)
        return [0.0] * len(waiting)

    monkeypatch.setattr(ensemble, "TREES", 2)
    monkeypatch.setattr(label_next, "CHOOSING", {"spy": spying, "at random": None})
    (row, _) = finish(measuring_next(mixed[:6], "foam", PLAIN, turns=1))
    assert row.reference.endswith("all are equally typical")
    assert given
    assert not any(one.segments for one in given)


def test_too_few_demonstrations_are_refused_by_name(mixed):
    with pytest.raises(InputError, match="5 labelled demonstrations; there are 4"):
        finish(measuring_next(mixed[:4], "foam"))
