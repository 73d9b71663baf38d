"""Agreement of coders, against references that sample or count by hand."""

import numpy as np
import pytest
from factories import make_track, synthetic_set
from hypothesis import example, given, settings
from hypothesis import strategies as st

from forcelab.jobs import finish
from forcelab.labels import Segment, Track, to_codes
from forcelab.project import NewDemonstration, Project
from forcelab.review.agreement import agreement_job, compare_pair, match_boundaries
from forcelab.review.coder_tracks import CoderTracks, coded_demonstrations
from forcelab.review.consistency import consistency
from forcelab.review.kappa import cohen_kappa, fleiss_kappa, kappa_interval, landis_koch


def agree(coded, a, b):
    return finish(compare_pair(coded, a, b))


def coded(a, b, id_="d", task="foam", **more):
    return CoderTracks(id_, id_, task, {"Ann": a, "Ben": b, **more})


ANN = make_track((0, 1, "grab"), (1, 3, "hold"), (3.5, 4, "release"))
BEN = make_track((0, 1.2, "grab"), (1.2, 3, "hold"), (3, 3.6, "still"), (3.6, 4, "release"))


@st.composite
def tracks(draw):
    """Tracks whose edges are whole hundredths of a second."""
    edges = sorted(draw(st.sets(st.integers(0, 300), min_size=2, max_size=12)))
    names = draw(
        st.lists(
            st.sampled_from(["grab", "hold", "release", None]),
            min_size=len(edges) - 1,
            max_size=len(edges) - 1,
        )
    )
    rows = zip(edges, edges[1:], names, strict=False)
    return tuple(Segment(s / 100, e / 100, name) for s, e, name in rows if name)


@pytest.fixture(scope="module")
def jittered():
    """Recordings that two coders labelled, the second later and with some errors."""
    random = np.random.default_rng(3)
    found = []
    for number, (_, segments) in enumerate(synthetic_set(5, 100.0)):
        shift = random.uniform(-0.05, 0.15, len(segments))
        other = [
            Segment(round(s.start + shift[i], 3), round(s.end, 3), s.action)
            for i, s in enumerate(segments)
        ]
        other[2] = Segment(other[2].start, other[2].end, "grab")
        late = [other[0]]
        for segment in other[1:]:
            late.append(Segment(max(segment.start, late[-1].end), segment.end, segment.action))
        found.append(coded(segments, tuple(late), f"d{number}"))
    return found


def test_kappa_over_time_is_that_of_scikit_learn_over_samples(jittered):
    from sklearn.metrics import cohen_kappa_score

    pair = agree(jittered, "Ann", "Ben")
    times = np.arange(0, 8, 1e-3) + 5e-4  # edges are whole milliseconds: samples never lie on one
    sampled = []
    for item in jittered:
        a, b = (to_codes(item.tracks[name], times, pair.actions) for name in ("Ann", "Ben"))
        both = (a >= 0) & (b >= 0)
        sampled.append((a[both], b[both]))
    a, b = (np.concatenate(column) for column in zip(*sampled, strict=True))
    assert 0.2 < pair.kappa < 0.95
    assert pair.kappa == pytest.approx(cohen_kappa_score(a, b), abs=1e-9)
    assert pair.agreed == pytest.approx((a == b).mean(), abs=1e-9)
    number = pair.actions.index("grab")
    dice = 2 * ((a == number) & (b == number)).sum() / ((a == number).sum() + (b == number).sum())
    assert pair.by_action["grab"] == pytest.approx(dice, abs=1e-9)


def test_figures_of_a_pair_by_hand():
    pair = agree([coded(ANN, BEN)], "Ann", "Ben")
    # Both labelled 0-3 and 3.5-4; they differ in 1-1.2 and 3.5-3.6.
    assert pair.agreed == pytest.approx(3.2 / 3.5)
    assert pair.only == pytest.approx((0.0, 0.5))
    assert pair.only_share == pytest.approx(0.5 / 4.0)
    assert [(p.start, p.end, p.human, p.predicted) for p in pair.apart] == [
        (1, 1.2, "hold", "grab"),
        (3.5, 3.6, "release", "still"),
    ]
    assert [(p.start, p.end, p.human, p.predicted) for p in pair.alone] == [(3, 3.5, None, "still")]
    # grab, hold and release start, release ends; Ann's hold ends and Ben's still starts alone.
    assert sorted(pair.offsets) == pytest.approx([0, 0, 100, 200])
    assert pair.boundaries == (5, 5)
    assert pair.within == {50: 0.5, 100: 0.75, 200: 1.0}
    assert pair.quartiles == pytest.approx((0, 50, 125))
    assert [(p.start, p.end) for p in pair.shifted] == [(1, 1.2), (3.5, 3.6)]
    # Where both labelled: grab 1 of 1.2, hold 1.8 of 2, release 0.4 of 0.5, Ben's still alone.
    assert pair.f1[50] == pytest.approx(2 * 3 / (3 + 4))


def test_fleiss_equals_the_closed_form_of_1971():
    # The table of Fleiss (1971) as it stands in textbooks: 10 subjects, 14 raters, 5 classes.
    table = np.array(
        [
            [0, 0, 0, 0, 14],
            [0, 2, 6, 4, 2],
            [0, 0, 3, 5, 6],
            [0, 3, 9, 2, 0],
            [2, 2, 8, 1, 1],
            [7, 7, 0, 0, 0],
            [3, 2, 6, 3, 0],
            [2, 5, 3, 2, 2],
            [6, 5, 2, 1, 0],
            [0, 2, 2, 3, 7],
        ]
    )
    assert fleiss_kappa(table, np.ones(10)) == pytest.approx(0.210, abs=5e-4)
    twice = np.repeat(table, [1, 3] * 5, axis=0)
    assert fleiss_kappa(table, np.tile([1.0, 3.0], 5)) == pytest.approx(
        fleiss_kappa(twice, np.ones(20))
    )
    alone = np.vstack([table, [1, 0, 0, 0, 0]])  # rated by one only: it says nothing
    assert fleiss_kappa(alone, np.ones(11)) == pytest.approx(0.210, abs=5e-4)


def test_fleiss_of_two_coders_is_the_pi_of_scott(jittered):
    found = finish(agreement_job(jittered))
    shares = found.pairs[0].both / found.pairs[0].both.sum()
    chance = (((shares.sum(0) + shares.sum(1)) / 2) ** 2).sum()
    assert found.fleiss == pytest.approx((np.trace(shares) - chance) / (1 - chance))
    assert found.fleiss_coders == 2


def test_three_coders_of_whom_one_labelled_less():
    three = [coded(ANN, BEN, Cleo=ANN), coded(ANN, ANN, "e")]
    found = finish(agreement_job(three))
    assert [(p.a, p.b) for p in found.pairs] == [("Ann", "Ben"), ("Ann", "Cleo"), ("Ben", "Cleo")]
    assert found.pair("Cleo", "Ann").kappa == 1.0
    assert len(found.pair("Ben", "Cleo").demonstrations) == 1
    assert found.counts == {"Ann": {"foam": 2}, "Ben": {"foam": 2}, "Cleo": {"foam": 1}}
    assert 0 < found.fleiss < 1


def test_two_names_of_one_coder_are_compared_with_each_other_only():
    again = [CoderTracks("d", "d", "foam", {"Ann": ANN, "Ann again": BEN, "Cleo": ANN})]
    found = finish(agreement_job(again, same=("Ann", "Ann again")))
    assert [(p.a, p.b) for p in found.pairs] == [("Ann", "Cleo")]
    assert [(p.a, p.b) for p in found.repeated] == [("Ann", "Ann again")]
    assert found.fleiss == 1.0


def test_gaps_that_one_coder_leaves_cut_no_segment_of_the_other():
    full = make_track((0, 1, "grab"), (1, 3, "hold"), (3, 4, "release"))
    gaps = make_track(
        (0, 0.98, "grab"), (1.1, 1.9, "hold"), (2.0, 2.9, "hold"), (3.1, 4, "release")
    )
    found = agree([coded(full, gaps)], "Ann", "Ben").f1
    # Of the two holds the longer one is more than half of the whole one.
    assert found == {k: pytest.approx(2 * 3 / (3 + 4)) for k in (10, 25, 50)}
    # An edge beside a gap: 0.9 to 1 is grab and hold at once, which makes no further segment.
    early = make_track((0, 0.9, "grab"), (0.93, 2.8, "hold"), (2.85, 4, "release"))
    assert set(agree([coded(gaps[:1] + full[1:], early)], "Ann", "Ben").f1.values()) == {1.0}


@settings(max_examples=40, deadline=None)
@given(tracks(), tracks(), st.integers(0, 50))
def test_figures_are_symmetric_and_follow_no_shift_and_no_name(a, b, shift):
    base = agree([coded(a, b)], "Ann", "Ben")
    other = agree([coded(a, b)], "Ben", "Ann")
    names = {"grab": "x", "hold": "y", "release": "z"}

    def moved(track):
        return tuple(Segment(s.start + shift, s.end + shift, names[s.action]) for s in track)

    new = agree([coded(moved(a), moved(b))], "Ann", "Ben")
    close = pytest.approx
    for again in (other, new):
        assert again.kappa == (None if base.kappa is None else close(base.kappa, abs=1e-9))
        assert again.agreed == (None if base.agreed is None else close(base.agreed, abs=1e-9))
        assert again.only_share == close(base.only_share, abs=1e-9)
        assert again.f1 == {k: None if v is None else close(v) for k, v in base.f1.items()}
        assert len(again.apart) == len(base.apart)
    assert sorted(-other.offsets) == close(sorted(base.offsets), abs=1e-6)
    assert sorted(new.offsets) == close(sorted(base.offsets), abs=1e-6)
    total = sum(place.duration for place in (*base.apart, *base.alone))
    assert total == close(base.seconds.sum() - np.trace(base.both), abs=1e-9)


@settings(max_examples=40, deadline=None)
@example(())
@given(tracks())
def test_who_is_equal_agrees_fully(a):
    pair = agree([coded(a, a)], "Ann", "Ben")
    assert pair.kappa in (None, pytest.approx(1.0))
    assert pair.agreed == (pytest.approx(1.0) if a else None)
    assert pair.only_share == 0
    assert (pair.apart, pair.alone, pair.shifted) == ((), (), ())
    assert set(pair.f1.values()) == ({1.0} if a else {None})
    assert len(pair.offsets) == pair.boundaries[0] == pair.boundaries[1]


def test_the_nearest_boundaries_are_matched_within_the_window():
    a = make_track((1, 1.1, "grab"), (2, 2.1, "grab"))
    b = make_track((1.3, 1.4, "grab"), (2.6, 2.7, "grab"))
    assert match_boundaries(a, b).offsets == pytest.approx([300, 300])
    assert len(match_boundaries(a, b, window=0.2).offsets) == 0
    # The end of hold where grab follows at once is where grab starts, and counts once.
    touching = make_track((0, 1, "hold"), (1, 2, "grab"))
    assert match_boundaries(touching, touching).counts == (3, 3)


def test_figures_without_data_are_none():
    assert agree([CoderTracks("d", "d", "foam", {"Ann": ANN})], "Ann", "Ben") is None
    grabs = agree([coded(make_track((0, 1, "grab")), make_track((0, 1, "grab")))], "Ann", "Ben")
    assert grabs.kappa is None  # with one action chance agrees always
    assert grabs.agreed == 1.0
    assert cohen_kappa(np.zeros((2, 2))) is None
    none = agree([coded(make_track((0, 1, "grab")), make_track((2, 3, "grab")))], "Ann", "Ben")
    assert (none.kappa, none.agreed, none.only_share) == (None, None, 1.0)
    assert kappa_interval(np.ones((2, 2, 2))) is None


def test_the_interval_holds_the_figure_and_narrows_with_more_demonstrations(jittered):
    few, many = agree(jittered, "Ann", "Ben"), agree(jittered * 8, "Ann", "Ben")
    assert few.interval[0] < few.kappa < few.interval[1]
    assert few.interval == agree(jittered, "Ann", "Ben").interval
    assert np.diff(many.interval) < 0.6 * np.diff(few.interval)


def test_the_words_are_those_of_landis_and_koch():
    words = [landis_koch(k) for k in (-0.1, 0.2, 0.21, 0.6, 0.61, 0.8, 0.81, 1.0)]
    assert words == [
        "poor",
        "slight",
        "fair",
        "moderate",
        *["substantial"] * 2,
        *["almost perfect"] * 2,
    ]


def test_a_coder_who_varies_is_led_to_the_odd_places():
    usual = [1.0, 1.1, 0.9, 1.05, 0.95, 1.02]
    expected = [
        coded(make_track((0, 1, "grab"), (1, 1 + length, "hold")), (), f"d{i}")
        for i, length in enumerate(usual)
    ]
    expected.append(coded(make_track((0, 1, "hold"), (1, 5, "hold"), (5, 6, "grab")), (), "odd"))
    found = consistency(expected, "Ann")
    assert [(p.demonstration, p.start, p.end) for p in found.odd] == [("odd", 1, 5)]
    assert {(p.demonstration, p.human, p.predicted) for p in found.rare} == {
        ("odd", "hold", "hold"),
        ("odd", "hold", "grab"),
    }
    grab = next(action for action in found.actions if action.action == "grab")
    assert (grab.count, grab.mean, grab.variation) == (7, 1.0, 0.0)


def test_a_project_gives_coders_and_never_models_nor_what_is_blind(tmp_path):
    (demonstration, _), (another, _) = synthetic_set(2, 100.0)
    with Project.create(tmp_path / "p.forcelab") as project:
        pair = (Track("Ann", ANN), Track("Ben", BEN))
        first, second = project.demonstrations.add_all(
            [NewDemonstration(demonstration, pair), NewDemonstration(another, pair)]
        )
        project.tracks.edit(first.id, "model paper", (), ANN, "predicted", kind="predict")
        found, hidden = coded_demonstrations(project)
        assert [sorted(demonstration.tracks) for demonstration in found] == [["Ann", "Ben"]] * 2
        assert hidden == 0
        project.coding.assign(second.id, "Ann")
        found, hidden = coded_demonstrations(project, viewer="Ann")
        assert [demonstration.id for demonstration in found] == [first.id]
        assert hidden == 1
        assert len(coded_demonstrations(project, viewer="Ben")[0]) == 2
