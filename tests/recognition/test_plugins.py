"""Classifiers and features from outside forcelab."""

import dataclasses
import json
import os
import pickle
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from factories import FOREIGN_MODULE
from sklearn.base import clone
from sklearn.ensemble import (
    GradientBoostingClassifier,
    HistGradientBoostingClassifier,
    RandomForestClassifier,
    StackingClassifier,
)
from sklearn.naive_bayes import GaussianNB
from sklearn.neural_network import MLPClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler
from sklearn.tree import DecisionTreeClassifier
from skops import io as skops_io

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.recognition import plugins
from forcelab.recognition.classifiers import _check_own
from forcelab.recognition.cross_validation import leave_one_out_job
from forcelab.recognition.estimators import ForceActionClassifier, ForceFeatures
from forcelab.recognition.examples import LabelledDemonstration, prepare_examples
from forcelab.recognition.presets import preset
from forcelab.recognition.settings import Settings, applies
from forcelab.recognition.storage import TRUSTED, load_recogniser, pack, save_recogniser
from forcelab.recognition.training import train, training_job
from forcelab.signals.channels import channel_map

#: Features and filters whose computation takes no time.
QUICK = Settings(max_scale=64.0, threshold=0.5, median=None, drop=None, rate=100.0, stride=2)


@pytest.fixture(autouse=True)
def nothing_named(monkeypatch):
    """Each test begins with what a new process knows."""
    monkeypatch.setattr(plugins, "_named", {"classifier": {}, "features": {}})
    monkeypatch.setattr(plugins, "_imported", {})
    for variable in plugins.VARIABLES.values():
        monkeypatch.delenv(variable, raising=False)


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """The folder of a module `lab_<number>` that nobody has imported, and its name."""
    name = f"lab_{tmp_path.name.replace('-', '_')}"
    folder = tmp_path / "code"
    folder.mkdir()
    (folder / f"{name}.py").write_text(FOREIGN_MODULE)
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.chdir(folder)
    yield name
    sys.modules.pop(name, None)


def was_imported():
    return Path("imported").exists()


@pytest.fixture
def path(tmp_path):
    return tmp_path / "own.skops"


def gaussian():
    return GaussianNB()


def scaled():
    return make_pipeline(StandardScaler(), GaussianNB())


def forest():
    return RandomForestClassifier(4)


def test_a_classifier_of_ones_own_is_fitted_and_scored_as_any_other(three):
    own = QUICK.replace(classifier=plugins.register_classifier(gaussian))
    theirs = QUICK.replace(classifier="naive-bayes")
    found, expected = (finish(leave_one_out_job(three, settings)) for settings in (own, theirs))
    for a, b in zip(found.tested, expected.tested, strict=True):
        np.testing.assert_array_equal(a.filtered, b.filtered)
    # Of windows it gets standardised features and is calibrated, as others are.
    changes = {"decoder": "filters", "calibrated": True}
    ours, others = (
        train(three[:2], preset("fast").replace(classifier=s.classifier, **changes))
        for s in (own, theirs)
    )
    demonstration = three[2].demonstration
    assert ours.classifier.exponent == others.classifier.exponent != 1
    np.testing.assert_array_equal(
        ours.predict(demonstration, probability_trace=True).probabilities,
        others.predict(demonstration, probability_trace=True).probabilities,
    )


def test_the_seed_is_that_of_the_settings(three):
    name = plugins.register_classifier(forest)
    settings = QUICK.replace(classifier=name, seed=7)
    assert applies("seed", vars(settings))
    assert train(three, settings).classifier.random_state == 7


@pytest.mark.parametrize("windows", [False, True])
def test_a_recogniser_holds_a_classifier_of_ones_own_where_its_origin_is_named(
    three, path, lab, windows
):
    name = plugins.name_path("classifier", f"{lab}:make_nearest")
    settings = QUICK.replace(classifier=name)
    if windows:
        settings = preset("fast").replace(classifier=name, decoder="filters")
    recogniser = train(three[:2], settings)
    save_recogniser(recogniser, path)
    loaded = load_recogniser(path)
    assert loaded.settings.classifier == f"{lab}:make_nearest"
    demonstration = three[2].demonstration
    before, after = (r.predict(demonstration, probability_trace=True) for r in (recogniser, loaded))
    np.testing.assert_array_equal(after.probabilities, before.probabilities)
    assert len({*before.filtered}) > 2
    # Without it, such as on another machine.
    plugins._named["classifier"].clear()
    Path("imported").unlink()
    del sys.modules[lab]
    with pytest.raises(InputError) as refusal:
        load_recogniser(path)
    assert str(refusal.value) == (
        f"{path}: The classifier '{name}' is code from outside forcelab, which runs only where its "
        f"user names it: if you trust it, set FORCELAB_CLASSIFIERS={name}, name it in the window's "
        f"preferences, or call forcelab.register_classifier in a script."
    )
    assert not was_imported()


def boosting():
    return HistGradientBoostingClassifier(max_iter=2)


def stacked():
    members = [("bayes", GaussianNB()), ("mlp", MLPClassifier(4, tol=10.0, n_iter_no_change=1))]
    return StackingClassifier(members, final_estimator=DecisionTreeClassifier(), cv=2)


def products():
    """A forest that looks at more features than it was given."""
    return make_pipeline(PolynomialFeatures(2), RandomForestClassifier(4))


def check_kept(recogniser, path, demonstration):
    """What comes back from its file predicts the same."""
    save_recogniser(recogniser, path)
    kept, loaded = (r.predict(demonstration) for r in (recogniser, load_recogniser(path)))
    np.testing.assert_array_equal(kept.probabilities, loaded.probabilities)
    np.testing.assert_array_equal(kept.filtered, loaded.filtered)


@pytest.mark.parametrize(
    "factory", [scaled, forest, boosting, stacked, products, DecisionTreeClassifier]
)
def test_what_consists_of_scikit_learn_is_kept_as_it_is(three, path, factory):
    name = plugins.register_classifier(factory)
    recogniser = train(three[:2], QUICK.replace(classifier=name, stride=9))
    check_kept(recogniser, path, three[2].demonstration)
    plugins._named["classifier"].clear()
    with pytest.raises(InputError, match=f"The classifier '{name}' is code from outside"):
        load_recogniser(path)


@pytest.mark.parametrize(
    ("what", "reason"),
    [
        (subprocess.CompletedProcess((), 0), "it holds the type subprocess.CompletedProcess, whi"),
        ((number for number in ()), "cannot pickle 'generator' object"),
    ],
)
def test_what_no_file_can_hold_is_not_saved(three, path, what, reason):
    name = plugins.register_classifier(gaussian)
    recogniser = train(three[:2], QUICK.replace(classifier=name))
    recogniser.classifier.friend = what
    with pytest.raises(InputError) as refusal:
        save_recogniser(recogniser, path)
    sentence = str(refusal.value)
    assert sentence.startswith(f"A recogniser with '{name}' cannot be kept in a file ({reason}")
    assert sentence.endswith(
        "); let the classifier consist of plain values, arrays and objects of "
        "scikit-learn and of its own package."
    )


# --- features -----------------------------------------------------------------------------------


def energy(signals, rate):
    """How fast each channel changes, squared."""
    return np.square(np.gradient(signals, axis=0) * rate)


def strongest(signals, rate):
    return np.abs(signals).max(axis=1)


def test_features_of_ones_own_stand_alone_or_come_last(three):
    own, one = (plugins.register_features(function) for function in (energy, strongest))
    both = QUICK.replace(features=f"{own}+windows+{one}", step=0.02)
    examples = prepare_examples(three[0], both)
    known = prepare_examples(three[0], both.replace(features="windows")).features
    alone = prepare_examples(three[0], both.replace(features=own, step=None))
    q = len(alone.channels)
    assert alone.features.shape == (len(three[0].demonstration.times), q)
    np.testing.assert_array_equal(examples.features[:, : -q - 1], known)
    np.testing.assert_array_equal(
        examples.features[:, -q - 1 : -1], alone.features[both.steps(len(alone.times), 100.0)]
    )
    signals = channel_map(three[0].demonstration.channels).apply(three[0].demonstration.signals)
    np.testing.assert_array_equal(alone.features, energy(signals.T, alone.rate))
    assert both.width(q, 100.0) == examples.features.shape[1]
    names = ForceFeatures(both).fit([three[0].demonstration]).get_feature_names_out()
    assert list(names[-2:]) == [f"{own} {q}", f"{one} 1"]
    assert len(names) == examples.features.shape[1]
    assert applies("windows", vars(both))
    assert not applies("wavelet", vars(both))
    assert not applies("windows", vars(both.replace(features=own)))


@pytest.mark.parametrize("beside", ["", "+windows"])
def test_a_recogniser_with_features_of_ones_own_is_kept_and_asks_for_them(three, path, beside):
    name = plugins.register_features(energy)
    settings = preset("fast").replace(features=name + beside, decoder="filters")
    recogniser = train(three[:2], settings)
    check_kept(recogniser, path, three[2].demonstration)
    plugins._named["features"].clear()
    with pytest.raises(InputError, match=f"{path}: The features '{name}' are code from outside"):
        load_recogniser(path)


def test_gaps_are_bridged_for_features_of_ones_own(three):
    name = plugins.register_features(energy)
    demonstration = three[0].demonstration
    signals = demonstration.signals.copy()
    signals[40:44] = np.nan
    holed = LabelledDemonstration(dataclasses.replace(demonstration, signals=signals))
    assert np.isfinite(prepare_examples(holed, QUICK.replace(features=name)).features).all()


def short(signals, rate):
    return signals[1:]


def holes(signals, rate):
    return np.where(signals > 0, signals, np.nan)


def test_features_that_cannot_be_used_are_a_sentence(three):
    for function, reason in (
        (short, "ValueError: it gave an array of shape"),
        (holes, "ValueError: it gave numbers that are not finite"),
        (gaussian, "TypeError: gaussian() takes 0 positional arguments but 2 were given"),
    ):
        name = plugins.register_features(function)
        with pytest.raises(InputError) as refusal:
            prepare_examples(three[0], QUICK.replace(features=name))
        assert f"'{name}' failed as features ({reason}" in str(refusal.value)
    for features in ("windows+", "wavelets+windows", f"{name}+{name}", f"{name}+phases", ""):
        with pytest.raises(InputError, match="There is no kind of features"):
            Settings(features=features)
    with pytest.raises(InputError, match="which runs? only where its user names it"):
        prepare_examples(three[0], QUICK.replace(features="windows+another.module:function"))


# --- files of strangers -------------------------------------------------------------------------


def hostile(three, lab, path, classifier):
    """A recogniser whose settings name a module, and whose classifier is of any type."""
    recogniser = train(three[:2], QUICK.replace(classifier="naive-bayes"))
    content = skops_io.loads(pack(recogniser), trusted=list(TRUSTED))
    content["settings"]["classifier"] = f"{lab}:make_nearest"
    content["classifier"] = classifier
    path.write_bytes(skops_io.dumps(content))


def test_a_path_in_a_file_is_never_imported(three, lab, path):
    hostile(three, lab, path, GaussianNB())
    with pytest.raises(InputError, match="which runs? only where its user names it"):
        load_recogniser(path)
    settings = Settings.from_json({"classifier": f"{lab}:make_nearest"})
    with pytest.raises(InputError, match="which runs? only where its user names it"):
        train(three, settings)
    for copy in (settings.replace(stride=4), pickle.loads(pickle.dumps(settings))):  # noqa: S301
        with pytest.raises(InputError, match="which runs? only where its user names it"):
            finish(training_job(three, copy))
    assert lab not in sys.modules
    assert not was_imported()


class Reducing:
    """Writes a call of what its class is called into a file."""

    def __init__(self, *arguments):
        self.arguments = arguments

    def __reduce__(self):
        return type(self), self.arguments


@pytest.mark.parametrize("what", ["Popen", "os.mkdir", "make_nearest", "fail", "NearestMean"])
def test_a_file_calls_nothing_of_a_module_that_was_named(three, lab, path, what):
    plugins.load_plugin("classifier", plugins.name_path("classifier", f"{lab}:make_nearest"))
    # To be called as Popen(["touch", "pwned"]) where it is loaded; of a class that is named rightly
    # a file may give the attributes, and call no constructor.
    type_ = type(what, (Reducing,), {"__module__": lab})
    hostile(three, lab, path, [type_(["touch", "pwned"])])
    with pytest.raises(InputError, match=f"holds the type {lab}.{what}, which is neither"):
        load_recogniser(path)
    assert not Path("pwned").exists()


@pytest.mark.parametrize("protocol", [2, 0])
def test_a_file_gets_no_class_that_it_could_have_called_later(three, lab, path, protocol):
    """As the function of a FunctionTransformer, say, with arguments that the file gives."""
    plugins.load_plugin("classifier", plugins.name_path("classifier", f"{lab}:make_nearest"))
    hostile(three, lab, path, [int])
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    schema = json.loads(parts["schema.json"])
    schema["protocol"] = protocol
    schema["content"]["classifier"]["content"][0] = {
        2: {"__class__": "NearestMean", "__module__": lab, "__loader__": "TypeNode"},
        0: {
            **{"__class__": "function", "__module__": "builtins", "__loader__": "FunctionNode"},
            "content": {"module_path": lab, "function": "NearestMean"},
        },
    }[protocol]
    parts["schema.json"] = json.dumps(schema).encode()
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    with pytest.raises(InputError, match=f"holds the type {lab}.NearestMean, which is neither"):
        load_recogniser(path)


def refuses_a_changed_tree(recogniser, path):
    path.write_bytes(pack(recogniser))
    with pytest.raises(InputError, match="not a whole recogniser"):
        load_recogniser(path)


@pytest.mark.parametrize(("field", "value"), [("left", 1 << 30), ("feature_idx", 1 << 20)])
def test_trees_of_gradient_boosting_point_at_their_own_nodes(three, path, field, value):
    name = plugins.register_classifier(boosting)
    recogniser = train(three[:2], QUICK.replace(classifier=name, stride=9))
    recogniser.classifier._predictors[1][0].nodes[field][0] = value
    refuses_a_changed_tree(recogniser, path)


def test_trees_within_point_at_their_own_nodes(three, path):
    name = plugins.register_classifier(forest)
    recogniser = train(three[:2], QUICK.replace(classifier=name, stride=9))
    tree = recogniser.classifier.estimators_[3].tree_
    state = tree.__getstate__()
    state["nodes"]["left_child"][0] = 1 << 30
    tree.__setstate__(state)
    refuses_a_changed_tree(recogniser, path)


def test_trees_behind_other_steps_ask_for_features_of_their_own(three, path):
    name = plugins.register_classifier(products)
    recogniser = train(three[:2], QUICK.replace(classifier=name, stride=9))
    grown = recogniser.classifier[-1].estimators_[3]
    state = grown.tree_.__getstate__()
    state["nodes"]["feature"][0] = grown.n_features_in_
    grown.tree_.__setstate__(state)
    refuses_a_changed_tree(recogniser, path)


def test_trees_of_gradient_boosting_have_its_features():
    boosted = GradientBoostingClassifier(n_estimators=2)
    boosted.fit(np.random.default_rng(0).standard_normal((40, 3)), np.arange(40) % 3)
    _check_own(boosted, 3)
    boosted.estimators_[1, 2].n_features_in_ = 1 << 30  # which it would not look at
    with pytest.raises(ValueError, match="trees of its own features"):
        _check_own(boosted, 3)


# --- who may name a path, and where it counts ---------------------------------------------------


def test_the_environment_and_installed_packages_name_paths(lab, monkeypatch, tmp_path):
    name = f"{lab}:make_nearest"
    monkeypatch.setenv("FORCELAB_CLASSIFIERS", f" other.module:make , {name}")
    assert plugins.known_paths("classifier") == {
        "other.module:make": "other.module:make",
        name: name,
    }
    assert plugins.known_paths("features") == {}
    assert type(plugins.load_plugin("classifier", name)()).__name__ == "NearestMean"
    with pytest.raises(InputError, match=r"'other.module:make' cannot be loaded \(No module named"):
        plugins.load_plugin("classifier", "other.module:make")
    monkeypatch.delenv("FORCELAB_CLASSIFIERS")
    plugins._named["classifier"].clear()
    package = tmp_path / "lab-1.dist-info"
    package.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: lab\nVersion: 1\n")
    (package / "entry_points.txt").write_text(f"[forcelab.classifiers]\nnearest = {name}\n")
    sys.path.append(str(tmp_path))
    plugins.installed.cache_clear()
    try:
        assert plugins.known_paths("classifier") == {name: "nearest"}
        assert plugins.name_path("classifier", "nearest") == name
        assert type(plugins.load_plugin("classifier", name)()).__name__ == "NearestMean"
    finally:
        plugins.installed.cache_clear()


def test_preferences_find_nothing_in_a_folder_that_a_stranger_may_have_made(lab, monkeypatch):
    monkeypatch.setattr(plugins, "_preferred", {"classifier": (f"{lab}:make_nearest",)})
    with pytest.raises(InputError, match="No module named .*; install its package or add its fol"):
        plugins.load_plugin("classifier", f"{lab}:make_nearest")
    assert not was_imported()
    assert plugins.name_path("classifier", f"{lab}:make_nearest")  # as the command line does
    plugins.load_plugin("classifier", f"{lab}:make_nearest")
    assert was_imported()


def test_another_process_of_ours_finds_what_was_named_here(lab):
    settings = QUICK.replace(classifier=plugins.name_path("classifier", f"{lab}:make_nearest"))
    script = (
        "import pickle, sys; from forcelab.recognition.plugins import load_plugin; "
        "settings = pickle.load(sys.stdin.buffer); "
        "print(load_plugin('classifier', settings.classifier)())"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        input=pickle.dumps(settings),
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},  # which workers are given
        capture_output=True,
        check=True,
    )
    assert done.stdout.startswith(f"<{lab}.NearestMean object".encode())
    assert str(Path.cwd()) in sys.path  # for what comes back from there


def test_workers_of_a_search_find_all_that_was_named_here(lab):
    name = plugins.name_path("classifier", f"{lab}:make_nearest")
    content = pickle.dumps(ForceActionClassifier("fast"))  # which another one is searched for
    plugins._named["classifier"].clear()
    assert pickle.loads(content).settings == preset("fast")  # noqa: S301
    assert plugins.load_plugin("classifier", name).__name__ == "make_nearest"


def test_an_estimator_takes_functions_as_they_are(three):
    demonstrations, tracks = zip(*((i.demonstration, i.segments) for i in three), strict=True)
    classifier = ForceActionClassifier(QUICK, classifier=gaussian, features=energy)
    found = clone(classifier).fit(demonstrations, tracks).predict(demonstrations)
    settings = QUICK.replace(classifier=f"{__name__}:gaussian", features=f"{__name__}:energy")
    recogniser = train(three, settings)
    assert [t.segments for t in found] == [recogniser.predict(d).segments for d in demonstrations]


def test_a_function_of_a_notebook_goes_along_with_the_settings():
    make = type(gaussian)(gaussian.__code__, {"GaussianNB": GaussianNB}, "make")
    make.__module__ = make.__qualname__ = "__main__"
    name = plugins.register_classifier(make)
    # Joblib and Dask send such a function as it is, which plain pickle cannot.
    named = plugins.named_here(QUICK.replace(classifier=name).plugins)
    plugins._named["classifier"].clear()
    plugins.name_as(named)
    assert plugins.load_plugin("classifier", name) is make


def test_what_cannot_be_used_is_a_sentence(three, lab):
    with pytest.raises(InputError, match="has no name at the top of a module"):
        plugins.register_classifier(lambda: None)
    with pytest.raises(InputError, match="There is no classifier 'my.module'; choose from"):
        Settings(classifier="my.module")

    def refusal(function):
        settings = QUICK.replace(classifier=plugins.name_path("classifier", f"{lab}:{function}"))
        with pytest.raises(InputError) as caught:
            train(three, settings)
        return str(caught.value)

    assert refusal("fail") == (
        f"'{lab}:fail' failed as a classifier (ArithmeticError: out of cheese); correct it, or "
        f"choose another classifier."
    )
    assert "cannot be loaded (AttributeError: " in refusal("missing")
    assert "cannot be loaded (TypeError: it is no function)" in refusal("os.sep")
    assert "failed as a classifier (AttributeError: 'str' object" in refusal("os.getcwd")
