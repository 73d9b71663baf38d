"""Why: against finite differences, numerical integration and planted truths."""

import json
from dataclasses import replace
from functools import cache
from itertools import islice
from multiprocessing.reduction import ForkingPickler

import numpy as np
import pytest
from explained import FAST, made
from hypothesis import given, settings
from hypothesis import strategies as st
from trained_project import make

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.labels import Segment
from forcelab.project import LabelsUsed, Project
from forcelab.recognition import training
from forcelab.recognition.attribution import Network, Voter, judge_of, log_odds
from forcelab.recognition.classifiers import fitting
from forcelab.recognition.dataset import Choice
from forcelab.recognition.probability_trace import Certainty
from forcelab.recognition.recogniser import Recogniser
from forcelab.review import explanation
from forcelab.review.differences import Interval, action_over, place_at, place_of
from forcelab.review.explanation import explaining, influence, track_at, withholding
from forcelab.review.run_result import Reviewed, load
from forcelab.review.training import reviewing

#: Epochs of an MLP's fit: what it has learnt by then is enough to be explained.
EPOCHS = 40
BAYES = FAST.replace(classifier="naive-bayes")


@pytest.fixture(scope="module", autouse=True)
def short_fits():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(training, "fitting", lambda *given: islice(fitting(*given), EPOCHS))
        yield


def network(seed, f=6, h=9, actions=("grab", "hold", "still")):
    random = np.random.default_rng(seed)
    sizes = (f, h), (h,), (h, len(actions)), (len(actions),)
    return Network(actions, *(random.normal(size=size) for size in sizes)), random


# --- shares of a network --------------------------------------------------------------------------


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_the_shares_are_the_integral_of_the_gradient_along_the_way(seed):
    judge, random = network(seed)
    row, mean = random.normal(size=(2, 6))
    # The middles of many pieces of the line: exact but where a kink falls into a piece.
    along = mean + (np.arange(4000) + 0.5)[:, None] / 4000 * (row - mean)
    gradient = [
        np.subtract(*(log_odds(judge, at, "still", "hold") for at in (along + step, along - step)))
        for step in 1e-6 * np.eye(6)
    ]
    integral = (row - mean) * np.mean(gradient, axis=1) / 2e-6
    shares = judge.shares(row[None], mean, "still", "hold")[0]
    assert shares == pytest.approx(integral, abs=0.02)


@given(st.integers(0, 2**32 - 1))
def test_the_shares_add_up_to_the_difference_of_the_log_odds(seed):
    judge, random = network(seed)
    rows, mean = random.normal(size=(5, 6)), random.normal(size=6)
    there = log_odds(judge, mean[None], "grab", "still")
    gained = log_odds(judge, rows, "grab", "still") - there
    assert judge.shares(rows, mean, "grab", "still").sum(axis=1) == pytest.approx(gained)


def test_at_the_reference_itself_nothing_speaks():
    judge, random = network(4)
    mean = random.normal(size=6)
    assert not judge.shares(mean[None], mean, "grab", "still").any()


# --- classifiers --------------------------------------------------------------------------------


def fitted(name, X, y, actions, probabilities=True):
    classifier = [s.classifier for s in islice(fitting(name, X, y, 0, probabilities), EPOCHS)][-1]
    return judge_of(Recogniser(FAST, 1.0, (), tuple(actions), {}, classifier))


@pytest.mark.parametrize("actions", [("grab", "hold"), ("grab", "hold", "still")])
def test_a_network_gives_the_probabilities_of_the_mlp_that_it_was_taken_from(actions):
    random = np.random.default_rng(0)
    y = random.integers(len(actions), size=120)
    X = random.normal(size=(120, 5)) + y[:, None]
    step = next(fitting("mlp", X, y, 0, True))
    judge = judge_of(Recogniser(FAST, 1.0, (), actions, {}, step.classifier))
    assert isinstance(judge, Network)
    expected = step.classifier.predict_proba(X)
    assert judge.probabilities(X) == pytest.approx(expected, abs=1e-9)
    odds = np.log(expected[:, 1] / expected[:, 0])
    assert log_odds(judge, X, "hold", "grab") == pytest.approx(odds, abs=1e-6)


@pytest.mark.parametrize("name", ["naive-bayes", "decision-tree", "svm", "nearest-neighbours"])
@pytest.mark.parametrize("actions", [("grab", "hold"), ("grab", "hold", "still")])
@pytest.mark.parametrize("probabilities", [True, False])
def test_the_highest_score_is_what_is_recognised(name, actions, probabilities):
    random = np.random.default_rng(1)
    y = np.arange(90) % len(actions)
    X = random.normal(size=(90, 3)) + 3.0 * y[:, None]
    judge = fitted(name, X, y, actions, probabilities)
    assert isinstance(judge, Voter)
    scores = judge.scores(X)
    assert scores.shape == (90, len(actions))
    assert np.isfinite(scores).all()
    assert np.mean(scores.argmax(axis=1) == judge.classifier.predict(X)) > 0.97


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
    judge = fitted(name, X, y, ("hold", "grab"))
    job = influence(judge, X[y == 1], "grab", "hold", (Q, K), mean=X.mean(axis=0), sample=X)
    return finish(job)


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


def test_what_the_gradient_misses_is_told_and_next_to_nothing():
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
    judge = fitted("naive-bayes", X, y, ("hold", "grab"))
    mean = X.mean(axis=0)
    found = [
        finish(influence(judge, X[y == 1], "grab", "hold", (1, 2), mean=mean, sample=X, seed=seed))
        for seed in range(12)
    ]
    scatter = np.std([one.bands[0, 1] for one in found], ddof=1)
    told = np.mean([one.bands_error[0, 1] for one in found])
    assert told / 2 < scatter < 2 * told


# --- the recogniser that has not seen it ---------------------------------------------------------


@pytest.fixture(scope="module")
def bayes(tmp_path_factory):
    path = tmp_path_factory.mktemp("bayes") / "study.forcelab"
    return path, made(path, BAYES)


@pytest.fixture(scope="module")
def mlp(tmp_path_factory):
    path = tmp_path_factory.mktemp("mlp") / "study.forcelab"
    return path, made(path, FAST.replace(stride=8), count=2)


@pytest.fixture(scope="module")
def withheld(mlp):
    path, outcome = mlp
    return finish(withholding(path, outcome, outcome.tested[0].id))


def test_it_predicts_what_the_run_predicted_out_of_fold(bayes):
    path, outcome = bayes
    for one in outcome.tested:
        withheld = finish(withholding(path, outcome, one.id))
        assert withheld.how == "left out"
        assert withheld.same == 1.0
        assert one.id not in {place.demonstration for place in withheld.training.places}


def test_so_does_the_one_that_has_seen_none_of_its_group(tmp_path):
    path = tmp_path / "study.forcelab"
    outcome = made(path, BAYES, count=5, folds=2)
    ids = [one.id for one in outcome.tested]
    for i, one in enumerate(outcome.tested):
        withheld = finish(withholding(path, outcome, one.id))
        assert withheld.same == 1.0
        seen = {place.demonstration for place in withheld.training.places}
        assert seen == {id_ for j, id_ in enumerate(ids) if j % 2 != i % 2}


def test_segments_that_were_not_trained_on_are_not_shown_as_if(bayes, monkeypatch):
    path, outcome = bayes
    id_ = outcome.tested[0].id
    before = finish(withholding(path, outcome, id_))
    fits = []

    def trimmed(examples, settings):
        yield from ()
        kept = [replace(example, segments=example.segments[:-1]) for example in examples]
        return kept, ()

    def watched(examples, *others):
        fits.append([example.segments for example in examples])
        return training.fit_trimmed(examples, *others)

    monkeypatch.setattr(explanation, "trimming", trimmed)
    monkeypatch.setattr(explanation, "fit_trimmed", watched)
    after = finish(withholding(path, outcome, id_))
    homes = {place.demonstration for place in before.training.places}
    assert len(after.training.places) == len(before.training.places) - len(homes)
    ((*segments,),) = fits
    assert len(after.training.places) == sum(map(len, segments))


def test_so_does_the_mlp_whose_fit_hangs_on_the_seed(withheld):
    assert withheld.same == 1.0
    assert withheld.how == "left out"


def test_a_recogniser_that_saw_it_would_be_another_one(bayes):
    # The check can fail: against the prediction of another demonstration's fold it does.
    path, outcome = bayes
    one, other = outcome.tested[:2]
    swapped = replace(one, stages={"filtered": other.predicted})
    wrong = replace(outcome, tested=(swapped, *outcome.tested[1:]))
    withheld = finish(withholding(path, wrong, one.id))
    assert withheld.same < 1.0
    why = finish(explaining(withheld, wrong, place_at(one, 2.0)))
    assert any("as the run did" in remark for remark in why.remarks)


def test_labels_that_were_edited_since_are_taken_as_they_were(tmp_path):
    path = tmp_path / "study.forcelab"
    outcome = made(path, BAYES, count=3)
    first, second = outcome.tested[:2]
    with Project.open(path) as project:
        before = project.tracks.get(second.id, "Ann").segments
        project.tracks.edit(second.id, "Ann", before, before[:1], "all but one erased")
    assert finish(withholding(path, outcome, first.id)).same == 1.0


def test_a_track_can_be_read_as_it_was_after_each_edit(tmp_path):
    path = tmp_path / "study.forcelab"
    outcome = made(path, BAYES, count=2)
    id_ = outcome.tested[0].id
    with Project.open(path) as project:
        known = {0: (), project.tracks.head(id_, "Ann"): project.tracks.get(id_, "Ann").segments}
        for number in range(3):
            before = project.tracks.get(id_, "Ann").segments
            after = (*before[:number], *before[number + 1 :])
            project.tracks.edit(id_, "Ann", before, after, "one erased")
            known[project.tracks.head(id_, "Ann")] = after
        for again in (project.tracks.undo, project.tracks.undo, project.tracks.redo):
            again(id_, "Ann")
            known[project.tracks.head(id_, "Ann")] = project.tracks.get(id_, "Ann").segments
        assert len(known) == 8
        for edit, segments in known.items():
            assert track_at(project, LabelsUsed(id_, "Ann", edit)) == segments


def test_the_probabilities_are_the_runs_where_it_kept_any(bayes):
    path, outcome = bayes
    one = outcome.tested[0]
    anew = finish(withholding(path, outcome, one.id))
    assert not anew.kept
    rows = anew.certainty.values.sum(axis=1)
    assert np.abs(rows[rows > 0].astype(int) - 255).max() <= 2
    values = np.zeros((10, 1), dtype=np.uint8)
    own = Certainty(one.start, 50.0, ("hold",), values)
    kept = replace(outcome, tested=(replace(one, certainty=own), *outcome.tested[1:]))
    assert finish(withholding(path, kept, one.id)).certainty is own


def test_of_an_unlabelled_demonstration_all_others_are_trained_on(tmp_path):
    path = tmp_path / "study.forcelab"
    outcome = made(path, BAYES, count=4)
    last = outcome.tested[-1]
    proposed = replace(last, human=())
    rest = replace(
        outcome, tested=outcome.tested[:-1], labels=outcome.labels[:-1], proposals=(proposed,)
    )
    withheld = finish(withholding(path, rest, last.id))
    assert withheld.how == "final"
    places = {place.demonstration for place in withheld.training.places}
    assert places == {one.id for one in rest.tested}


def test_the_final_recogniser_labels_a_proposal_as_the_run_did_on_any_grid(tmp_path):
    path = make(tmp_path / "foam.forcelab", labelled=2)
    number = finish(reviewing(path, BAYES.replace(rate=37.0), Choice(("foam",)), "foam"))
    with Project.open(path) as project:
        outcome = load(project, number)
    for one in (*outcome.tested, *outcome.proposals):
        withheld = finish(withholding(path, outcome, one.id))
        assert withheld.same == 1.0
        assert withheld.how == ("left out" if one in outcome.tested else "final")


def test_it_can_be_stopped_between_any_two_epochs(mlp):
    path, outcome = mlp
    job = withholding(path, outcome, outcome.tested[0].id)
    texts = [next(job).text for _ in range(6)]
    assert texts[:2] == ["features"] * 2
    assert texts[-1] == "fit"
    job.close()


def test_a_stranger_is_refused(bayes):
    path, outcome = bayes
    with pytest.raises(InputError, match="train again"):
        finish(withholding(path, outcome, "0" * 32))


def test_it_travels_between_processes(bayes):
    path, outcome = bayes
    withheld = finish(withholding(path, outcome, outcome.tested[0].id))
    again = ForkingPickler.loads(ForkingPickler.dumps(withheld))
    assert np.array_equal(again.mean, withheld.mean)
    assert again.bytes == withheld.bytes


# --- explanations --------------------------------------------------------------------------------


def explained(mlp, withheld, human, predicted, hidden=()):
    one = mlp[1].tested[0]
    hold = next(s for s in one.human if s.action == "hold")
    place = Interval(one.id, hold.start, hold.end, human, predicted)
    return finish(explaining(withheld, mlp[1], place, hidden))


def test_the_predicted_action_is_spoken_for_and_the_humans_against(mlp, withheld):
    why = explained(mlp, withheld, "still", "hold")
    assert (why.favoured, why.against) == ("hold", "still")
    back = explained(mlp, withheld, "hold", "still")
    assert back.influence.bands == pytest.approx(-why.influence.bands)
    assert back.influence.log_odds == pytest.approx(-why.influence.log_odds)


def test_where_both_agree_the_next_most_probable_action_is_spoken_against(mlp, withheld):
    why = explained(mlp, withheld, "hold", "hold")
    means = dict(
        zip(why.certainty.actions, why.certainty.mean(why.place.start, why.place.end), strict=True)
    )
    del means["hold"]
    assert why.favoured == "hold"
    assert means[why.against] == max(means.values())


def test_where_nothing_is_predicted_the_most_probable_action_is_spoken_for(mlp, withheld):
    why = explained(mlp, withheld, None, None)
    mean = why.certainty.mean(why.place.start, why.place.end)
    assert why.favoured == why.certainty.actions[int(np.argmax(mean))]


def test_an_action_of_no_other_demonstration_is_told(mlp, withheld):
    why = explained(mlp, withheld, "juggle", "hold")
    assert why.against != "juggle"
    assert "juggle" in why.remarks[0]


def test_neighbours_are_of_both_actions_and_of_no_hidden_demonstration(bayes):
    path, outcome = bayes
    one, other = outcome.tested[0].id, outcome.tested[1].id
    withheld = finish(withholding(path, outcome, one))
    why = explained(bayes, withheld, "still", "hold")
    assert [n.place.human for n in why.neighbours["hold"]] == ["hold"] * 3
    assert [n.place.human for n in why.neighbours["still"]] == ["still"] * 3
    less = explained(bayes, withheld, "still", "hold", hidden={other})
    found = {n.place.demonstration for near in less.neighbours.values() for n in near}
    assert found == {known.id for known in outcome.tested} - {one, other}


def test_the_strongest_bands_come_in_the_order_of_their_weight(mlp, withheld):
    why = explained(mlp, withheld, "still", "hold")
    weights = [abs(band.weight) for band in why.strongest(5)]
    assert weights == sorted(weights, reverse=True)
    assert weights[0] == np.abs(why.influence.bands).max()
    first = why.strongest()[0]
    row, column = why.channels.index(first.channel), why.hertz.tolist().index(first.hertz)
    assert why.influence.bands[row, column] == first.weight


def test_an_explanation_is_plain_values_too(mlp, withheld):
    why = explained(mlp, withheld, "still", "hold")
    plain = json.loads(json.dumps(why.to_json(), allow_nan=False))
    assert plain["method"] == "gradient"
    assert np.array(plain["bands"]).sum() == pytest.approx(
        plain["log_odds"] - plain["reference"], abs=1e-9
    )
    assert plain["nearest"]["hold"][0]["distance"] == why.neighbours["hold"][0].distance


def test_a_place_without_samples_is_refused(mlp, withheld):
    one = mlp[1].tested[0]
    with pytest.raises(InputError, match="no sample"):
        finish(explaining(withheld, mlp[1], Interval(one.id, one.end + 1, one.end + 2)))


# --- places --------------------------------------------------------------------------------------

HUMAN = (Segment(1.0, 3.0, "grab"), Segment(3.0, 5.0, "hold"))
MODEL = (Segment(1.5, 4.0, "grab"), Segment(4.5, 6.0, "hold"))
REVIEWED = Reviewed("d", "01", "foam", 0.0, 8.0, HUMAN, {"filtered": MODEL})


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
    place = place_at(REVIEWED, time)
    found = place and (place.start, place.end, place.human, place.predicted)
    assert found == expected


def test_over_a_stretch_the_action_counts_that_covers_most_of_it():
    assert action_over(MODEL, 3.0, 5.0) == "grab"
    assert action_over(MODEL, 3.8, 5.0) == "hold"
    assert action_over(MODEL, 6.0, 7.0) is None
    assert place_of(REVIEWED, 3.0, 5.0, "still").human == "still"
