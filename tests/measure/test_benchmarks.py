"""The simulated tongs are like the real ones, wherever the real recordings are at hand."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from factories import labelled_set, read_labelled

from forcelab.formats import read
from forcelab.formats.recording import ReadOptions
from forcelab.jobs import finish
from forcelab.recognition import ensemble
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.presets import preset
from forcelab.simulation import generate
from forcelab.simulation.origin import origins
from tests.benchmarks import label_next
from tests.benchmarks import swapped as benchmark
from tests.benchmarks.label_next import measuring_next
from tests.benchmarks.realism import PUBLISHED, realism, simulated_beside
from tests.benchmarks.swapped import measuring_swapped, swapped


@pytest.mark.parametrize(
    "name", sorted(path.stem for path in Path(label_next.__file__).parent.glob("*.py"))
)
def test_every_benchmark_finds_what_it_measures(name):
    import_module(f"tests.benchmarks.{name}")


#: What is further apart than a factor of two; the guide tells why.
APART = {
    "stylus": {"normal axes in action: 8 to 15 Hz"},
    "foam": {
        "grab: normal force of sensor 2, median",
        "grab: tangential force of sensor 2, median",
        "release: normal force of sensor 2, median",
        "tangential axes in action: 15 to 40 Hz",
    },
}


@pytest.mark.real
@pytest.mark.parametrize(("task", "file"), [("stylus", "JPen_sig.pdl"), ("foam", "soft_sig.pdl")])
def test_every_figure_is_within_a_factor_of_two_or_has_its_reason(
    task, file, real_file, monkeypatch
):
    monkeypatch.setattr(generate, "BATCH", 10)  # all at once take hardly longer than one
    real = [
        LabelledDemonstration(item.demonstration, item.tracks[0].segments).merged(PUBLISHED)
        for item in read(real_file(f"tongs/{file}"), ReadOptions(task=task))
    ]
    rows = realism(finish(simulated_beside(origins(task, 10, seed=1))), real)
    assert len(rows) >= 80
    assert {row.name for row in rows if not row.alike} <= APART[task]


#: Quick, and with probabilities all the same.
PLAIN = preset("fast").replace(amplitude="absolute", decoder="filters", stride=2)


def pressed(item, gain):
    """The same by somebody who presses harder."""
    old = item.demonstration
    return replace(item, demonstration=replace(old, signals=gain * old.signals))


@pytest.fixture(scope="module")
def mixed():
    """Most by one person, some by another who presses four times as hard."""
    items = labelled_set(9, 50.0)
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
    row = by_name["least certain"]
    assert row.error <= chance.error + 0.02
    gain = row.further["points gained"]
    assert gain == pytest.approx(100 * (chance.error - row.error), abs=1e-9)
    assert gain >= -2 * row.further["standard error"] - 1


def test_who_chooses_sees_no_label(mixed, monkeypatch):
    candidates = []

    def spying(recogniser, waiting):
        candidates.extend(waiting)
        return [0.0] * len(waiting)

    monkeypatch.setattr(ensemble, "TREES", 2)
    monkeypatch.setattr(label_next, "CHOOSING", {"spy": spying, "at random": None})
    finish(measuring_next(mixed[:6], "foam", PLAIN, turns=1))
    assert candidates
    assert not any(item.segments for item in candidates)


@pytest.fixture(scope="module")
def items():
    return labelled_set(6, 50.0)


@pytest.mark.parametrize(("share", "count"), [(0.0, 1), (0.25, None), (1.0, None)])
def test_so_many_segments_get_another_action_and_no_other_changes(items, share, count):
    total = sum(len(item.segments) for item in items)
    wrong, places = swapped(items, np.random.default_rng(0), share)
    assert len(places) == (count or round(share * total))
    for item, swapped_item in zip(items, wrong, strict=True):
        for old, new in zip(item.segments, swapped_item.segments, strict=True):
            assert (old.start, old.end) == (new.start, new.end)
            changed = (item.demonstration.id, old.start) in places
            assert (old.action != new.action) == changed


def test_wrong_labels_are_scored_with_the_right_ones(items, monkeypatch):
    monkeypatch.setattr(ensemble, "TREES", 10)
    settings = preset("fast").replace(amplitude="absolute", stride=2)
    row = finish(measuring_swapped(items, "synthetic", settings, draws=1))
    assert (row.name, row.setting, row.size) == ("swapped", "fast", "synthetic")
    assert row.error < 0.25
    assert row.further["points lost"] < 10
    assert row.further["swapped"] == max(1, round(0.05 * sum(len(i.segments) for i in items)))
    assert row.further["in the first tenth"] >= 0.5


def test_draws_are_compared_under_their_own_seeds(items, monkeypatch):
    monkeypatch.setattr(ensemble, "TREES", 2)
    seeds = []
    fit = benchmark.fit_examples

    def watched(examples, settings):
        seeds.append(settings.seed)
        return (yield from fit(examples, settings))

    settings = preset("fast").replace(amplitude="absolute", stride=2, seed=2**32 - 1)
    monkeypatch.setattr(benchmark, "fit_examples", watched)
    # Labels that are swapped for themselves cost nothing at all, whatever the seeds do.
    monkeypatch.setattr(benchmark, "swapped", lambda used, _: (list(used), {("a", 0.0)}))
    row = finish(measuring_swapped(items[:2], "synthetic", settings, draws=2))
    assert (row.further["points lost"], row.further["standard error"]) == (0.0, 0.0)
    assert seeds == [2**32 - 1] * 4 + [0] * 4  # of two left out, with right labels and with wrong


@pytest.mark.real
def test_of_the_papers_recordings_a_twentieth_swapped_costs_little_and_is_found(
    monkeypatch, real_file
):
    monkeypatch.setattr(ensemble, "TREES", 10)
    items = read_labelled(real_file("tongs/JPen_sig.pdl"))
    row = finish(measuring_swapped(items, "stylus", preset("fast"), draws=1))
    assert row.further["points lost"] < 3
    assert row.further["in the first tenth"] >= 0.5
