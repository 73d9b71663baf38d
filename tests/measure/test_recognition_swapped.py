"""A few wrong labels cost little, and a review finds them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from synthetic import synthetic_set

from forcelab.errors import InputError
from forcelab.formats import pdl
from forcelab.formats.recording import ReadOptions
from forcelab.jobs import finish
from forcelab.recognition import ensemble
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.presets import preset
from tests.benchmarks import swapped as benchmark
from tests.benchmarks.swapped import measuring_swapped, swapped

TONGS = Path(__file__).resolve().parents[2] / "../shared/data/tongs"


@pytest.fixture(scope="module")
def items():
    return [LabelledDemonstration(*item) for item in synthetic_set(6, 50.0)]


@pytest.mark.parametrize(("share", "count"), [(0.0, 1), (0.25, None), (1.0, None)])
def test_so_many_segments_get_another_action_and_no_other_changes(items, share, count):
    total = sum(len(item.segments) for item in items)
    wrong, places = swapped(items, np.random.default_rng(0), share)
    assert len(places) == (count or round(share * total))
    for one, other in zip(items, wrong, strict=True):
        for old, new in zip(one.segments, other.segments, strict=True):
            assert (old.start, old.end) == (new.start, new.end)
            changed = (one.demonstration.id, old.start) in places
            assert (old.action != new.action) == changed


def test_wrong_labels_are_scored_with_the_right_ones(items, monkeypatch):
    monkeypatch.setattr(ensemble, "TREES", 10)
    settings = preset("fast").replace(amplitude="absolute", stride=2)
    row = finish(measuring_swapped(items, "synthetic", settings, draws=2))
    assert (row.name, row.setting, row.size) == ("swapped", "fast", "synthetic")
    assert row.error < 0.25
    assert row.further["points lost"] < 10
    assert row.further["swapped"] == 2 * max(1, round(0.05 * sum(len(i.segments) for i in items)))
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
    row = finish(measuring_swapped(items[:3], "synthetic", settings, draws=3))
    assert (row.further["points lost"], row.further["standard error"]) == (0.0, 0.0)
    assert sorted(set(seeds)) == [0, 1, 2**32 - 1]


def test_of_too_little_it_is_told_what_is_missing(items):
    with pytest.raises(InputError, match="there is 1"):
        finish(measuring_swapped(items[:1], "one", preset("fast")))
    one_action = [LabelledDemonstration(items[0].demonstration, items[0].segments[:1])]
    with pytest.raises(InputError, match="two actions"):
        swapped(one_action, np.random.default_rng(0))


@pytest.mark.real
@pytest.mark.skipif(not TONGS.is_dir(), reason="the real recordings are not here")
@pytest.mark.parametrize("file", ["soft_sig.pdl", "JPen_sig.pdl"])
def test_of_the_papers_recordings_a_twentieth_swapped_costs_little_and_is_found(file, monkeypatch):
    monkeypatch.setattr(ensemble, "TREES", 10)
    recordings = pdl.read(TONGS / file, ReadOptions())
    items = [LabelledDemonstration(r.demonstration, r.tracks[0].segments) for r in recordings]
    row = finish(measuring_swapped(items, file, preset("fast"), draws=2))
    assert row.further["points lost"] < 3
    assert row.further["in the first tenth"] >= 0.5
