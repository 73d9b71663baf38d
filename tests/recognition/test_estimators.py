"""Recognition by scikit-learn's own tools."""

import numpy as np
import pytest
from factories import labelled_set
from sklearn.base import clone
from sklearn.cluster import KMeans
from sklearn.exceptions import NotFittedError
from sklearn.model_selection import (
    GridSearchCV,
    LeaveOneGroupOut,
    LeaveOneOut,
    cross_val_predict,
    cross_val_score,
)
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils import estimator_checks

from forcelab import ForceActionClassifier, ForceFeatures
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.labels import Track, is_model
from forcelab.recognition.cross_validation import leave_one_out_job
from forcelab.recognition.examples import prepare_examples
from forcelab.recognition.presets import preset
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import train

#: Naive Bayes on few scales: what is tested is not how well it recognises.
QUICK = {"max_scale": 64.0, "classifier": "naive-bayes", "median": 5, "rate": 100.0}
PAPER = preset("paper")
#: Some of the features there are, with all kinds among them.
WIDE = Settings(
    features="windows+wavelets", max_scale=8.0, amplitude="both", peaks=True, circular=True
)


@pytest.fixture(scope="module")
def recordings(three):
    return [item.demonstration for item in three]


@pytest.fixture(scope="module")
def tracks(three):
    return [Track("coder", item.segments) for item in three]


def test_it_learns_and_predicts_what_train_and_predict_do(three, recordings, tracks):
    classifier = ForceActionClassifier(**QUICK).fit(recordings, tracks)
    recogniser = train(three, PAPER.replace(**QUICK))
    assert tuple(classifier.classes_) == recogniser.actions
    predictions = [recogniser.predict(demonstration) for demonstration in recordings]
    predicted = classifier.predict(recordings)
    assert [track.segments for track in predicted] == [each.segments for each in predictions]
    assert all(is_model(track.author) for track in predicted)  # never taken for a coder's
    for found, each in zip(classifier.predict_proba(recordings), predictions, strict=True):
        np.testing.assert_array_equal(found, each.probabilities)


def test_probabilities_are_of_the_samples_where_decisions_lie_farther_apart(three, recordings):
    segments = [item.segments for item in three]  # as good as tracks
    coarse = {"step": 0.05, "decoder": "filters", "classifier": "naive-bayes"}
    classifier = ForceActionClassifier("fast", **coarse).fit(recordings, segments)
    (found,) = classifier.predict_proba(recordings[:1])
    assert found.shape == (len(recordings[0].times), len(classifier.classes_))
    np.testing.assert_allclose(found.sum(axis=1), 1.0)
    expected = classifier.recogniser_.predict(recordings[0], probability_trace=True)
    np.testing.assert_array_equal(found, expected.probabilities)


def test_scores_of_left_out_demonstrations_are_those_of_an_evaluation(three, recordings, tracks):
    classifier = ForceActionClassifier(**QUICK)
    scores = cross_val_score(classifier, recordings, tracks, cv=LeaveOneOut())
    _, each = finish(leave_one_out_job(three, PAPER.replace(**QUICK))).scores("filtered")
    np.testing.assert_array_equal(scores, [one.accuracy for one in each])
    assert 0.3 < scores.min() < scores.max() < 1.0
    predicted = cross_val_predict(classifier, recordings, tracks, cv=3)
    evaluation = finish(leave_one_out_job(three, PAPER.replace(**QUICK)))
    for track, item in zip(predicted, evaluation.tested, strict=True):
        assert track.segments == item.result.stages["filtered"]


def test_whole_tasks_are_left_out_by_groups():
    labelled = [*labelled_set(2, 100.0), *labelled_set(1, 100.0, "pen", seed=7)]
    recordings = [item.demonstration for item in labelled]
    scores = cross_val_score(
        ForceActionClassifier(**QUICK),
        recordings,
        [item.segments for item in labelled],
        groups=[recording.task for recording in recordings],
        cv=LeaveOneGroupOut(),
    )
    by_hand = ForceActionClassifier(**QUICK).fit(recordings[:2], [i.segments for i in labelled[:2]])
    assert len(scores) == 2
    assert by_hand.score(recordings[2:], [labelled[2].segments]) == scores[1]


def test_settings_are_searched_and_the_best_is_learnt(three, recordings, tracks):
    grid = {"max_scale": [4.0, 64.0], "threshold": [None, 1.0]}
    search = GridSearchCV(ForceActionClassifier(**QUICK), grid, cv=LeaveOneOut())
    search.fit(recordings, tracks)
    assert search.best_params_["threshold"] is None  # with 1.0 next to all is left unlabelled
    best = PAPER.replace(**QUICK).replace(**search.best_params_)
    assert search.best_estimator_.recogniser_.settings == best
    assert (
        search.predict(recordings[:1])[0].segments
        == train(three, best).predict(recordings[0]).segments
    )


def test_parameters_begin_where_the_preset_does():
    assert ForceActionClassifier().settings == PAPER
    assert ForceActionClassifier("best", stride=3).settings == preset("best").replace(stride=3)
    own = preset("fast").replace(seed=7)
    copy = clone(ForceActionClassifier(own)).set_params(threshold=None, features="wavelets")
    assert copy.settings == own.replace(threshold=None, features="wavelets")
    assert ForceFeatures("fast").settings == preset("fast")
    assert repr(ForceActionClassifier("fast", stride=3)) == (
        "ForceActionClassifier(preset='fast', stride=3)"
    )
    with pytest.raises(TypeError, match="no parameter 'strid'; did you mean 'stride'"):
        ForceActionClassifier(strid=3)
    with pytest.raises(TypeError, match="no parameter 'stride'"):
        ForceFeatures(stride=3)
    with pytest.raises(InputError, match="The setting stride must be a whole number"):
        ForceActionClassifier(stride=0.5).fit([], [])


def test_what_it_cannot_do_is_a_sentence(recordings, tracks):
    with pytest.raises(InputError, match="3 demonstrations and 1 tracks; give each"):
        ForceActionClassifier().fit(recordings, tracks[:1])
    with pytest.raises(NotFittedError):
        ForceActionClassifier().predict(recordings)
    unsure = ForceActionClassifier(**QUICK | {"classifier": "svm", "threshold": None, "stride": 9})
    with pytest.raises(InputError, match="svm was trained without probabilities; give a thresh"):
        unsure.fit(recordings, tracks).predict_proba(recordings)
    with pytest.raises(InputError, match="Nothing is labelled in what was to be scored"):
        unsure.score(recordings[:1], [()])


def test_features_are_those_that_recognition_makes(three, recordings):
    features = ForceFeatures(WIDE, rate=100.0)
    found = features.fit_transform(recordings)
    expected = [prepare_examples(item, features.settings).features for item in three]
    np.testing.assert_array_equal(found, np.concatenate(expected))
    # On another one's grid, as a recogniser does it.
    other = labelled_set(1, rate=50.0)[0]
    np.testing.assert_array_equal(
        features.transform([other.demonstration]),
        prepare_examples(other, features.settings, 100.0).features,
    )


def test_features_are_named_in_their_order(three, recordings):
    features = ForceFeatures(WIDE, rate=100.0).fit(recordings)
    names = list(features.get_feature_names_out())
    found = features.transform(recordings)
    assert len(names) == len(set(names)) == found.shape[1]
    settings = features.settings

    def columns(part):
        return found[:, [i for i, name in enumerate(names) if part(name)]]

    def alone(**changes):
        made = [prepare_examples(item, settings.replace(**changes)).features for item in three]
        return np.concatenate(made)

    bare = {"peaks": False, "features": "windows"}
    wavelets = alone(features="wavelets")
    third = wavelets.shape[1] // 3
    own = alone(amplitude="own", **bare)
    np.testing.assert_array_equal(columns(lambda n: " own " in n), own)
    np.testing.assert_array_equal(columns(lambda n: n.endswith("Hz")), wavelets)
    np.testing.assert_array_equal(columns(lambda n: "log magnitude" in n), wavelets[:, :third])
    np.testing.assert_array_equal(columns(lambda n: " sine of" in n), wavelets[:, -third:])
    few = alone(channels=("normal 2",), amplitude="absolute", windows=(0.04, 0.16), **bare)
    for column, kind in enumerate(["level 0.04 s", "level 0.16 s", "slope 0.04 s"]):
        name = f"normal 2 {kind}"
        np.testing.assert_array_equal(columns(lambda n, name=name: n == name)[:, 0], few[:, column])
    peaks = ForceFeatures("best", step=None, rate=100.0, channels=("normal 1",)).fit(recordings[:1])
    names = list(peaks.get_feature_names_out())
    highest = peaks.transform(recordings[:1])[:, names.index("normal 1 highest before 0.2 s")]
    lowest = peaks.transform(recordings[:1])[:, names.index("normal 1 lowest after 1.5 s")]
    assert highest.min() == 0 < highest.max()
    assert lowest.min() < 0 == lowest.max()


def test_features_begin_a_pipeline(recordings):
    pipeline = make_pipeline(ForceFeatures("best"), StandardScaler(), KMeans(3, random_state=0))
    clusters = pipeline.fit_predict(recordings)
    assert set(clusters) == {0, 1, 2}
    assert clone(pipeline).get_params()["forcefeatures__preset"] == "best"
    pandas = pytest.importorskip("pandas")
    table = ForceFeatures("best").set_output(transform="pandas").fit_transform(recordings)
    assert isinstance(table, pandas.DataFrame)
    assert table.columns[0] == "tangential 1 level 0.01 s"


#: Scikit-learn's checks of an estimator as such. The others fit it to arrays of random numbers,
#: whose rows are samples; ours are demonstrations, which those checks cannot make.
CHECKS = [
    "check_estimator_cloneable",
    "check_estimator_repr",
    "check_get_params_invariance",
    "check_mixin_order",
    "check_no_attributes_set_in_init",
    "check_parameters_default_constructible",
    "check_set_params",
    "check_do_not_raise_errors_in_init_or_set_params",
    "check_valid_tag_types",
    "check_estimator_tags_renamed",
]


@pytest.mark.parametrize("check", CHECKS)
@pytest.mark.parametrize("estimator", [ForceActionClassifier(), ForceFeatures()])
def test_the_checks_of_scikit_learn_pass_where_they_need_no_arrays(estimator, check):
    if not hasattr(estimator_checks, check):
        pytest.skip("this version of scikit-learn has no such check")
    getattr(estimator_checks, check)(type(estimator).__name__, clone(estimator))
