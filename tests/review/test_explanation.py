"""Explanations: against finite differences, integration, plain loops and planted truths."""

import json
import sys
from dataclasses import replace
from functools import cache
from itertools import islice
from multiprocessing.reduction import ForkingPickler

import numpy as np
import pytest
from factories import (
    QUICK_SETTINGS,
    make_evaluated_project,
    make_labelled_project,
    synthetic_demonstration,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.labels import Interval, Segment
from forcelab.project import Project
from forcelab.recognition import training
from forcelab.recognition.attribution import BlackBoxScorer, MlpScorer, log_odds, make_scorer
from forcelab.recognition.classifiers import fit_classifier
from forcelab.recognition.dataset import DataSelection
from forcelab.recognition.ensemble import FitOptions
from forcelab.recognition.examples import LabelledDemonstration, prepare_examples
from forcelab.recognition.features import peak_features, window_features
from forcelab.recognition.perceptron import Perceptron
from forcelab.recognition.presets import preset
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.results import DemonstrationResult
from forcelab.recognition.settings import Settings
from forcelab.review.differences import action_over, interval_at, interval_of
from forcelab.review.explanation import attribute_bands, explain
from forcelab.review.held_out import train_held_out
from forcelab.review.run_result import load_run
from forcelab.review.similar_segments import (
    SegmentFeatures,
    force_preview,
    nearest_segments,
    preview_job,
    summarise,
    summarise_segments,
)
from forcelab.review.training import review_job

#: Epochs of an MLP's fit: what it has learnt by then is enough to be explained.
EPOCHS = 40
BAYES = QUICK_SETTINGS.replace(classifier="naive-bayes")


@pytest.fixture(scope="module", autouse=True)
def short_fits():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            training, "fit_classifier", lambda *args: islice(fit_classifier(*args), EPOCHS)
        )
        yield


def network(seed, f=6, h=9, actions=("grab", "hold", "still")):
    random = np.random.default_rng(seed)
    sizes = (f, h), (h,), (h, len(actions)), (len(actions),)
    return MlpScorer(actions, Perceptron(*(random.normal(size=size) for size in sizes))), random


# --- shares of a network --------------------------------------------------------------------------


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_the_shares_are_the_integral_of_the_gradient_along_the_way(seed):
    scorer, random = network(seed)
    row, mean = random.normal(size=(2, 6))
    # The middles of many pieces of the line: exact but where a kink falls into a piece.
    along = mean + (np.arange(4000) + 0.5)[:, None] / 4000 * (row - mean)
    gradient = [
        np.subtract(*(log_odds(scorer, at, "still", "hold") for at in (along + step, along - step)))
        for step in 1e-6 * np.eye(6)
    ]
    integral = (row - mean) * np.mean(gradient, axis=1) / 2e-6
    shares = scorer.integrated_gradients(row[None], mean, "still", "hold")[0]
    assert shares == pytest.approx(integral, abs=0.02)


@given(st.integers(0, 2**32 - 1))
def test_the_shares_add_up_to_the_difference_of_the_log_odds(seed):
    scorer, random = network(seed)
    rows, mean = random.normal(size=(5, 6)), random.normal(size=6)
    reference_odds = log_odds(scorer, mean[None], "grab", "still")
    gained = log_odds(scorer, rows, "grab", "still") - reference_odds
    assert scorer.integrated_gradients(rows, mean, "grab", "still").sum(axis=1) == pytest.approx(
        gained
    )


# --- classifiers --------------------------------------------------------------------------------


def fit_scorer(name, X, y, actions, probabilities=True):
    classifier = [
        s.classifier for s in islice(fit_classifier(name, X, y, 0, probabilities), EPOCHS)
    ][-1]
    return make_scorer(Recogniser(QUICK_SETTINGS, 1.0, (), tuple(actions), {}, classifier))


@pytest.mark.parametrize("actions", [("grab", "hold"), ("grab", "hold", "still")])
def test_a_network_gives_the_probabilities_of_the_mlp_that_it_was_taken_from(actions):
    random = np.random.default_rng(0)
    y = random.integers(len(actions), size=120)
    X = random.normal(size=(120, 5)) + y[:, None]
    step = next(fit_classifier("mlp", X, y, 0, True))
    scorer = make_scorer(Recogniser(QUICK_SETTINGS, 1.0, (), actions, {}, step.classifier))
    assert isinstance(scorer, MlpScorer)
    expected = step.classifier.predict_proba(X)
    assert scorer.probabilities(X) == pytest.approx(expected, abs=1e-9)
    odds = np.log(expected[:, 1] / expected[:, 0])
    assert log_odds(scorer, X, "hold", "grab") == pytest.approx(odds, abs=1e-6)


@pytest.mark.parametrize("name", ["naive-bayes", "decision-tree", "svm", "nearest-neighbours"])
@pytest.mark.parametrize("actions", [("grab", "hold"), ("grab", "hold", "still")])
@pytest.mark.parametrize("probabilities", [True, False])
def test_the_highest_score_is_what_is_recognised(name, actions, probabilities):
    random = np.random.default_rng(1)
    y = np.arange(90) % len(actions)
    X = random.normal(size=(90, 3)) + 3.0 * y[:, None]
    scorer = fit_scorer(name, X, y, actions, probabilities)
    assert isinstance(scorer, BlackBoxScorer)
    scores = scorer.scores(X)
    assert scores.shape == (90, len(actions))
    assert np.isfinite(scores).all()
    assert np.mean(scores.argmax(axis=1) == scorer.classifier.predict(X)) > 0.97


Q, K = 3, 4
PLANTED = 2, 1


@cache
def planted(name, phase):
    """A classifier for which one band decides, by its magnitude or by its phase alone."""
    random = np.random.default_rng(7)
    y = np.arange(200) % 2
    X = random.normal(size=(200, 2 * Q * K))
    column = PLANTED[0] * K + PLANTED[1] + phase * Q * K
    X[:, column] += 6.0 * (y - 0.5)
    scorer = fit_scorer(name, X, y, ("hold", "grab"))
    bands = np.resize(np.arange(Q * K), X.shape[1])
    found = X[y == 1], "grab", "hold", (Q, K), bands
    return finish(attribute_bands(scorer, *found, mean=X.mean(axis=0), sample=X))


@pytest.mark.parametrize(
    ("name", "method"),
    [("mlp", "gradient"), ("naive-bayes", "permutation"), ("decision-tree", "permutation")],
)
@pytest.mark.parametrize("phase", [0, 1])
def test_the_band_that_decides_is_found(name, method, phase):
    found = planted(name, phase)
    assert found.method == method
    weights = found.bands.copy()
    assert np.unravel_index(weights.argmax(), weights.shape) == PLANTED
    others = np.delete(weights.ravel(), PLANTED[0] * K + PLANTED[1])
    assert weights[PLANTED] > 4 * np.abs(others).max()
    assert found.channels.argmax() == PLANTED[0]
    assert weights[PLANTED] > 5 * found.bands_error[PLANTED]


@pytest.mark.parametrize("name", ["mlp", "svm", "naive-bayes"])
def test_standardised_features_in_units_of_any_size_are_explained_as_well(name):
    random = np.random.default_rng(7)
    y = np.arange(180) % 2
    units = np.geomspace(1e-3, 1e3, Q * K)
    X = random.normal(size=(180, Q * K))
    column = PLANTED[0] * K + PLANTED[1]
    X[:, column] += 6.0 * (y - 0.5)
    X *= units
    options = FitOptions(np.arange(180) // 60, calibrated=True, standardised=True)
    *_, last = fit_classifier(name, X, y, 0, True, options)
    recogniser = Recogniser(QUICK_SETTINGS, 1.0, (), ("hold", "grab"), {}, last.classifier)
    scorer = make_scorer(recogniser)
    assert scorer.probabilities(X) == pytest.approx(last.classifier.predict_proba(X), abs=1e-5)
    where = X[y == 1], "grab", "hold", (Q, K), np.arange(Q * K)
    found = finish(attribute_bands(scorer, *where, mean=X.mean(axis=0), sample=X))
    assert found.method == ("gradient" if name == "mlp" else "permutation")
    assert np.unravel_index(found.bands.argmax(), found.bands.shape) == PLANTED
    if name == "mlp":
        assert found.gap < 1e-9


def test_a_peak_belongs_to_its_own_channel_and_to_a_window_as_long_as_it_looks():
    settings = preset("best")
    channels = np.zeros((3, 2000))
    channels[1, 1200:1210] = 5.0  # a peak of the second one alone
    places = np.arange(1000, 1200, 20)
    values = window_features(channels, 1000.0, settings.windows, places, settings.amplitude)
    peaks = peak_features(channels, 1000.0, settings.windows[0], places, True)
    rows = np.concatenate([values, peaks], axis=1)
    bands = settings.feature_bands(3, 1000.0)
    assert len(bands) == rows.shape[1] == settings.width(3, 1000.0)
    k = len(settings.windows)
    assert set(bands[np.ptp(rows, axis=0) > 0] // k) == {1}
    lengths = [settings.windows[band % k] for band in bands[-3:]]
    assert lengths == [0.16, 0.64, 0.64]  # of spans of 0.2, 0.5 and 1.5 s


def test_the_gap_of_the_gradient_is_stated_and_next_to_nothing():
    found = planted("mlp", 0)
    missed = found.bands.sum() - (found.log_odds - found.reference)
    assert found.gap == pytest.approx(abs(missed), abs=1e-12)
    assert found.gap < 1e-9
    assert found.channels == pytest.approx(found.bands.sum(axis=1))


def test_the_error_of_a_permutation_is_the_spread_of_its_repetitions():
    # The same with other seeds scatters as much as each of them says.
    random = np.random.default_rng(3)
    y = np.arange(200) % 2
    X = random.normal(size=(200, 4)) + 2.0 * y[:, None]
    scorer = fit_scorer("naive-bayes", X, y, ("hold", "grab"))
    mean = X.mean(axis=0)
    found = [
        finish(
            attribute_bands(
                scorer,
                X[y == 1],
                "grab",
                "hold",
                (1, 2),
                np.resize([0, 1], 4),
                mean=mean,
                sample=X,
                seed=seed,
            )
        )
        for seed in range(12)
    ]
    scatter = np.std([explanation.bands[0, 1] for explanation in found], ddof=1)
    stated = np.mean([explanation.bands_error[0, 1] for explanation in found])
    assert stated / 2 < scatter < 2 * stated


# --- the recogniser that has not seen it ---------------------------------------------------------


@pytest.fixture(scope="module")
def bayes(tmp_path_factory):
    path = tmp_path_factory.mktemp("bayes") / "study.forcelab"
    return path, make_evaluated_project(path, BAYES)


@pytest.fixture(scope="module")
def mlp(tmp_path_factory):
    path = tmp_path_factory.mktemp("mlp") / "study.forcelab"
    return path, make_evaluated_project(path, QUICK_SETTINGS.replace(stride=8), count=2)


@pytest.fixture(scope="module")
def held_out(mlp):
    path, run = mlp
    return finish(train_held_out(path, run, run.tested[0].id))


def test_it_predicts_what_the_run_predicted_out_of_fold(bayes):
    path, run = bayes
    for result in run.tested:
        held_out = finish(train_held_out(path, run, result.id))
        assert held_out.how == "left out"
        assert held_out.same_share == 1.0
        assert result.id not in {place.demonstration for place in held_out.training.places}


def test_so_does_the_one_that_has_seen_none_of_its_group(tmp_path):
    path = tmp_path / "study.forcelab"
    run = make_evaluated_project(path, BAYES, count=5, folds=2)
    ids = [result.id for result in run.tested]
    for i, result in enumerate(run.tested):
        held_out = finish(train_held_out(path, run, result.id))
        assert held_out.same_share == 1.0
        shown = {place.demonstration for place in held_out.training.places}
        assert shown == {id_ for j, id_ in enumerate(ids) if j % 2 != i % 2}


def test_segments_that_were_not_trained_on_are_not_shown_as_if(bayes, monkeypatch):
    path, run = bayes
    id_ = run.tested[0].id
    before = finish(train_held_out(path, run, id_))
    fits = []

    def trimmed(examples, settings):
        yield from ()
        cleaned = [replace(example, segments=example.segments[:-1]) for example in examples]
        return cleaned, ()

    def watched(examples, *others):
        fits.append([example.segments for example in examples])
        return training.fit_cleaned(examples, *others)

    monkeypatch.setattr("forcelab.review.held_out.clean_examples", trimmed)
    monkeypatch.setattr("forcelab.review.held_out.fit_cleaned", watched)
    after = finish(train_held_out(path, run, id_))
    homes = {place.demonstration for place in before.training.places}
    assert len(after.training.places) == len(before.training.places) - len(homes)
    ((*segments,),) = fits
    assert len(after.training.places) == sum(map(len, segments))


def test_so_does_the_mlp_whose_fit_hangs_on_the_seed(held_out):
    assert held_out.same_share == 1.0
    assert held_out.how == "left out"


def test_a_recogniser_that_saw_it_would_be_another_one(bayes):
    # The check can fail: against the prediction of another demonstration's fold it does.
    path, run = bayes
    first, second = run.tested[:2]
    swapped = replace(first, stages={"filtered": second.predicted})
    wrong = replace(run, tested=(swapped, *run.tested[1:]))
    held_out = finish(train_held_out(path, wrong, first.id))
    assert held_out.same_share < 1.0
    why = finish(explain(held_out, wrong, interval_at(first, 2.0)))
    assert any("as the run did" in remark for remark in why.remarks)


def test_labels_that_were_edited_since_are_taken_as_they_were(tmp_path):
    path = tmp_path / "study.forcelab"
    run = make_evaluated_project(path, BAYES, count=3)
    first, second = run.tested[:2]
    with Project.open(path) as project:
        before = project.tracks.get(second.id, "Ann").segments
        project.tracks.edit(second.id, "Ann", before, before[:1], "all but one erased")
    assert finish(train_held_out(path, run, first.id)).same_share == 1.0


def test_the_probabilities_are_the_runs_where_it_kept_any(bayes):
    path, run = bayes
    result = run.tested[0]
    anew = finish(train_held_out(path, run, result.id))
    assert not anew.trace_from_run
    rows = anew.probability_trace.values.sum(axis=1)
    assert np.abs(rows[rows > 0].astype(int) - 255).max() <= 2
    values = np.zeros((10, 1), dtype=np.uint8)
    own = ProbabilityTrace(result.start, 50.0, ("hold",), values)
    with_trace = replace(run, tested=(replace(result, probability_trace=own), *run.tested[1:]))
    assert finish(train_held_out(path, with_trace, result.id)).probability_trace is own


def test_the_final_recogniser_labels_a_proposal_as_the_run_did_on_any_grid(tmp_path):
    path = make_labelled_project(tmp_path / "foam.forcelab", labelled=2)
    number = finish(review_job(path, BAYES.replace(rate=37.0), DataSelection(("foam",)), "foam"))
    with Project.open(path) as project:
        run = load_run(project, number)
    for result in (*run.tested, *run.proposals):
        held_out = finish(train_held_out(path, run, result.id))
        assert held_out.same_share == 1.0
        assert held_out.how == ("left out" if result in run.tested else "final")


def test_it_can_be_stopped_between_any_two_epochs(mlp):
    path, run = mlp
    job = train_held_out(path, run, run.tested[0].id)
    texts = [next(job).text for _ in range(6)]
    assert texts[:2] == ["features"] * 2
    assert texts[-1] == "fit"
    job.close()


def test_a_stranger_is_refused(bayes):
    path, run = bayes
    with pytest.raises(InputError, match="train again"):
        finish(train_held_out(path, run, "0" * 32))


def test_it_travels_between_processes(bayes):
    path, run = bayes
    held_out = finish(train_held_out(path, run, run.tested[0].id))
    again = ForkingPickler.loads(ForkingPickler.dumps(held_out))
    assert np.array_equal(again.mean, held_out.mean)
    assert again.bytes == held_out.bytes


# --- explanations --------------------------------------------------------------------------------


def explain_hold(mlp, held_out, human, predicted, hidden=()):
    result = mlp[1].tested[0]
    hold = next(s for s in result.human if s.action == "hold")
    place = Interval(result.id, hold.start, hold.end, human, predicted)
    return finish(explain(held_out, mlp[1], place, hidden))


def test_the_predicted_action_is_spoken_for_and_the_humans_against(mlp, held_out):
    why = explain_hold(mlp, held_out, "still", "hold")
    assert (why.favoured, why.against) == ("hold", "still")
    back = explain_hold(mlp, held_out, "hold", "still")
    assert back.attribution.bands == pytest.approx(-why.attribution.bands)
    assert back.attribution.log_odds == pytest.approx(-why.attribution.log_odds)


def test_where_both_agree_the_next_most_probable_action_is_spoken_against(mlp, held_out):
    why = explain_hold(mlp, held_out, "hold", "hold")
    means = dict(
        zip(
            why.probability_trace.actions,
            why.probability_trace.mean(why.place.start, why.place.end),
            strict=True,
        )
    )
    del means["hold"]
    assert why.favoured == "hold"
    assert means[why.against] == max(means.values())


def test_where_nothing_is_predicted_the_most_probable_action_is_spoken_for(mlp, held_out):
    why = explain_hold(mlp, held_out, None, None)
    mean = why.probability_trace.mean(why.place.start, why.place.end)
    assert why.favoured == why.probability_trace.actions[int(np.argmax(mean))]


def test_an_action_of_no_other_demonstration_is_remarked_on(mlp, held_out):
    why = explain_hold(mlp, held_out, "juggle", "hold")
    assert why.against != "juggle"
    assert "juggle" in why.remarks[0]


def test_neighbours_are_of_both_actions_and_of_no_hidden_demonstration(bayes):
    path, run = bayes
    first, second = run.tested[0].id, run.tested[1].id
    held_out = finish(train_held_out(path, run, first))
    why = explain_hold(bayes, held_out, "still", "hold")
    assert [n.place.human for n in why.neighbours["hold"]] == ["hold"] * 3
    assert [n.place.human for n in why.neighbours["still"]] == ["still"] * 3
    less = explain_hold(bayes, held_out, "still", "hold", hidden={second})
    found = {n.place.demonstration for near in less.neighbours.values() for n in near}
    assert found == {known.id for known in run.tested} - {first, second}


def test_the_strongest_bands_come_in_the_order_of_their_weight(mlp, held_out):
    why = explain_hold(mlp, held_out, "still", "hold")
    weights = [abs(band.weight) for band in why.strongest(5)]
    assert weights == sorted(weights, reverse=True)
    assert weights[0] == np.abs(why.attribution.bands).max()
    first = why.strongest()[0]
    row, column = why.channels.index(first.channel), why.hertz.tolist().index(first.hertz)
    assert why.attribution.bands[row, column] == first.weight


def test_an_explanation_is_plain_values_too(mlp, held_out):
    why = explain_hold(mlp, held_out, "still", "hold")
    plain = json.loads(json.dumps(why.to_json(), allow_nan=False))
    assert plain["method"] == "gradient"
    assert np.array(plain["bands"]).sum() == pytest.approx(
        plain["log_odds"] - plain["reference"], abs=1e-9
    )
    assert plain["nearest"]["hold"][0]["distance"] == why.neighbours["hold"][0].distance


def test_a_place_without_samples_is_refused(mlp, held_out):
    result = mlp[1].tested[0]
    with pytest.raises(InputError, match="no sample"):
        finish(explain(held_out, mlp[1], Interval(result.id, result.end + 1, result.end + 2)))


# --- places --------------------------------------------------------------------------------------

HUMAN = (Segment(1.0, 3.0, "grab"), Segment(3.0, 5.0, "hold"))
MODEL = (Segment(1.5, 4.0, "grab"), Segment(4.5, 6.0, "hold"))
REVIEWED = DemonstrationResult("d", "01", "foam", 0.0, 8.0, HUMAN, {"filtered": MODEL})


@pytest.mark.parametrize(
    ("time", "expected"),
    [
        (0.5, None),
        (1.0, (1.0, 1.5, "grab", None)),
        (2.0, (1.5, 3.0, "grab", "grab")),
        (3.5, (3.0, 4.0, "hold", "grab")),
        (4.2, (4.0, 4.5, "hold", None)),
        (5.5, (5.0, 6.0, None, "hold")),
        (6.0, None),
    ],
)
def test_a_place_is_where_neither_changes_their_mind(time, expected):
    place = interval_at(REVIEWED, time)
    found = place and (place.start, place.end, place.human, place.predicted)
    assert found == expected


def test_over_a_stretch_the_action_counts_that_covers_most_of_it():
    assert action_over(MODEL, 3.0, 5.0) == "grab"
    assert action_over(MODEL, 3.8, 5.0) == "hold"
    assert action_over(MODEL, 6.0, 7.0) is None
    assert interval_of(REVIEWED, 3.0, 5.0, "still").human == "still"


SETTINGS = Settings(max_scale=32.0)
SCALES = len(SETTINGS.scales)


def drawn(seed, count=30, width=7):
    """Summaries of three demonstrations and two actions, with one number that never changes."""
    random = np.random.default_rng(seed)
    values = random.normal(size=(count, width)) * random.uniform(0.1, 50.0, size=width)
    values[:, 3] = 4.0
    places = tuple(
        Interval(str(random.integers(3)), float(i), i + 1.0, ("grab", "hold")[random.integers(2)])
        for i in range(count)
    )
    return SegmentFeatures(places, values), values[0] + random.normal(size=width)


@given(st.integers(0, 2**32 - 1), st.integers(1, 5))
@settings(max_examples=40)
def test_they_are_those_of_a_plain_loop(seed, count):
    training, target = drawn(seed)
    spread = [s if s > 0 else 1.0 for s in training.values.std(axis=0)]
    found = []
    for i, place in enumerate(training.places):
        if place.human == "hold" and place.demonstration != "1":
            away = training.values[i] - target
            far = sum((a / s) ** 2 for a, s in zip(away, spread, strict=True)) ** 0.5
            found.append((far, i, place))
    found.sort()
    near = nearest_segments(target, training, "hold", count, without={"1"})
    assert [n.place for n in near] == [place for *_, place in found[:count]]
    assert [n.distance for n in near] == pytest.approx([far for far, *_ in found[:count]])


def test_an_action_of_no_other_demonstration_has_no_neighbours():
    training, target = drawn(1)
    assert nearest_segments(target, training, "juggle") == ()
    assert nearest_segments(target, training, "hold", without={"0", "1", "2"}) == ()


def test_a_segment_is_known_by_magnitudes_levels_and_length():
    demonstration, segments = synthetic_demonstration(3, rate=200.0)
    examples = prepare_examples(LabelledDemonstration(demonstration, segments), SETTINGS)
    found = summarise_segments(examples, demonstration, SCALES)
    assert [(p.start, p.end, p.human) for p in found.places] == [
        (s.start, s.end, s.action) for s in segments
    ]
    hold = segments[2]
    inside = (demonstration.times >= hold.start) & (demonstration.times < hold.end)
    rows = examples.features[inside, : 4 * SCALES]
    fx, fy, fz = demonstration.signals[inside, :3].T
    row = found.values[2]
    assert row[: 4 * SCALES] == pytest.approx(rows.mean(axis=0))
    assert row[4 * SCALES : 8 * SCALES] == pytest.approx(rows.std(axis=0))
    assert row[8 * SCALES] == pytest.approx(np.mean(np.hypot(fx, fy)))
    assert row[8 * SCALES + 2] == pytest.approx(fz.mean())
    assert row[-1] == pytest.approx(np.log(hold.duration))


def test_a_stretch_without_samples_has_no_summary():
    demonstration, segments = synthetic_demonstration(3, rate=200.0)
    examples = prepare_examples(LabelledDemonstration(demonstration, segments), SETTINGS)
    assert summarise(examples, demonstration, SCALES, 1.001, 1.004) is None


def test_a_demonstration_without_labels_adds_nothing():
    demonstration, segments = synthetic_demonstration(3, rate=200.0)
    bare = summarise_segments(
        prepare_examples(LabelledDemonstration(demonstration), SETTINGS), demonstration, SCALES
    )
    full = summarise_segments(
        prepare_examples(LabelledDemonstration(demonstration, segments), SETTINGS),
        demonstration,
        SCALES,
    )
    joined = SegmentFeatures.joined([bare, full])
    assert joined.places == full.places
    assert np.array_equal(joined.values, full.values)


@pytest.fixture
def demonstration():
    times = np.arange(1000) / 100.0
    signals = np.random.default_rng(0).normal(size=(1000, 2))
    return Demonstration("01", "foam", times, signals, (Channel("a"), Channel("b")))


def test_a_trace_holds_the_extremes_of_its_columns(demonstration):
    found = force_preview(demonstration, 2.0, 7.0, columns=50)
    blocks = demonstration.signals[200:700].reshape(50, 10, 2)
    assert np.array_equal(found.low, blocks.min(axis=1))
    assert np.array_equal(found.high, blocks.max(axis=1))


def test_a_stretch_after_the_last_stamp_has_the_last_sample(demonstration):
    end = demonstration.end
    found = force_preview(demonstration, demonstration.times[-1] + 1e-3, end)
    assert np.array_equal(found.low, demonstration.signals[-1:])


def test_what_is_missing_is_passed_over():
    signals = np.ones((100, 1))
    signals[:50], signals[70] = np.nan, np.inf
    gappy = Demonstration("01", "foam", np.arange(100) / 10.0, signals, (Channel("a"),))
    found = force_preview(gappy, 0.0, 10.0, columns=10)
    assert np.isnan(found.low[:5]).all()
    assert (found.high[5:] == 1.0).all()


def test_no_video_needs_no_decoder(tmp_path, monkeypatch):
    path = tmp_path / "study.forcelab"
    run = make_evaluated_project(path, QUICK_SETTINGS.replace(classifier="naive-bayes"), count=2)
    monkeypatch.setitem(sys.modules, "cv2", None)  # importing it fails
    places = [Interval(result.id, 1.0, 2.0) for result in run.tested]
    found = finish(preview_job(path, places))
    assert [explanation.name for explanation in found] == [result.name for result in run.tested]
    assert all(explanation.frame is None for explanation in found)
