from __future__ import annotations

import copy
import dataclasses
import functools
import io
import json
import operator
import os
import struct
import types
import zipfile

import numpy as np
import pytest
import sklearn
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import RandomForestClassifier
from sklearn.neighbors import KNeighborsClassifier
from sklearn.svm import NuSVC
from skops import io as skops_io

from forcelab.errors import InputError
from forcelab.recognition import ensemble
from forcelab.recognition.classifiers import REGISTRY
from forcelab.recognition.ensemble import CalibratedEnsemble
from forcelab.recognition.forest import Forest
from forcelab.recognition.presets import preset
from forcelab.recognition.settings import Settings
from forcelab.recognition.storage import TRUSTED, load_recogniser, pack, save_recogniser
from forcelab.recognition.training import train
from tests.recognition.format_1 import forest_in_format_1

pytestmark = pytest.mark.usefixtures("small_fits")

SMALL = Settings(max_scale=32.0, stride=6)


@pytest.fixture(scope="module")
def trained(three):
    """A recogniser of each kind, trained when first asked for."""

    @functools.cache
    def make(name, threshold):
        return train(three[:2], SMALL.replace(classifier=name, threshold=threshold))

    return lambda name, threshold=0.8: make(name, threshold)


@pytest.fixture(scope="module")
def fast(three):
    """A recogniser with windows, a decoder and parts for streams."""
    return train(three[:2], preset("fast"))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "foam.recogniser"


def content_of(recogniser):
    return skops_io.loads(pack(recogniser), trusted=list(TRUSTED))


def refused(path, match="recogniser"):
    """Loading says one sentence, which it gives."""
    with pytest.raises(InputError, match=match) as refusal:
        load_recogniser(path)
    sentence = str(refusal.value)
    assert sentence.startswith(str(path)) or str(path) in sentence
    assert "\n" not in sentence
    assert sentence.endswith(".")
    return sentence


def with_classifier(recogniser, **changes):
    """The same recogniser with learnt attributes of its classifier overwritten."""
    classifier = copy.deepcopy(recogniser.classifier)
    vars(classifier).update(changes)
    return dataclasses.replace(recogniser, classifier=classifier)


# --- the round trip -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "threshold"), [*((name, 0.8) for name in REGISTRY), ("mlp", None), ("svm", None)]
)
def test_a_loaded_recogniser_predicts_to_the_bit_what_the_saved_one_did(
    trained, three, path, name, threshold
):
    recogniser = trained(name, threshold)
    save_recogniser(recogniser, path)
    loaded = load_recogniser(path)
    unseen = three[2].demonstration
    before, after = recogniser.predict(unseen), loaded.predict(unseen)
    np.testing.assert_array_equal(after.raw, before.raw)
    np.testing.assert_array_equal(after.filtered, before.filtered)
    assert (after.probabilities is None) == (threshold is None)
    if threshold is not None:
        np.testing.assert_array_equal(after.probabilities, before.probabilities)
    for field in ("settings", "rate", "channels", "actions", "shortest", "trained_on"):
        assert getattr(loaded, field) == getattr(recogniser, field)


@pytest.mark.parametrize("name", REGISTRY)
def test_a_classifier_of_standardised_features_predicts_to_the_bit_what_the_saved_one_did(
    three, path, name
):
    settings = preset("fast").replace(classifier=name, changes=False, decoder="filters")
    recogniser = train(three[:2], settings.replace(threshold=0.6, calibrated=True))
    save_recogniser(recogniser, path)
    unseen = three[2].demonstration
    before, after = (r.predict(unseen) for r in (recogniser, load_recogniser(path)))
    np.testing.assert_array_equal(after.probabilities, before.probabilities)
    content = content_of(recogniser)
    content["classifier"]["scale"][3] = 0.0
    path.write_bytes(skops_io.dumps(content))
    refused(path, "not a whole recogniser")


def test_a_classifier_within_another_is_checked_as_one_by_itself(three, path):
    settings = preset("fast").replace(classifier="svm", changes=False)
    content = content_of(train(three[:2], settings))
    (svm,) = content["classifier"]["members"][0]["classifier"].calibrated_classifiers_
    svm.estimator._n_support = svm.estimator._n_support[:-1]
    path.write_bytes(skops_io.dumps(content))
    refused(path, "not a whole recogniser")


def test_a_classifier_within_another_has_all_of_its_actions(three, path):
    settings = preset("fast").replace(classifier="naive-bayes", changes=False)
    content = content_of(train(three[:2], settings))
    bayes = content["classifier"]["members"][0]["classifier"]
    for name in ("classes_", "theta_", "var_", "class_prior_", "class_count_"):
        setattr(bayes, name, getattr(bayes, name)[:-1])
    path.write_bytes(skops_io.dumps(content))
    refused(path, "not a whole recogniser")


def test_an_older_file_of_windows_has_a_bare_classifier(three, path):
    # As it was before features were standardised; it goes on predicting as it did.
    settings = preset("fast").replace(classifier="naive-bayes", changes=False)
    recogniser = train(three[:2], settings)
    (member,) = recogniser.classifier.members
    older = dataclasses.replace(recogniser, classifier=member.classifier)
    path.write_bytes(pack(older))
    unseen = three[2].demonstration
    found = load_recogniser(path).predict(unseen)
    np.testing.assert_array_equal(found.probabilities, older.predict(unseen).probabilities)


@pytest.mark.parametrize("name", REGISTRY)
def test_a_recogniser_can_still_predict_and_be_saved_again_after_saving(trained, three, name):
    recogniser = trained(name)
    before = recogniser.predict(three[2].demonstration)
    parts = set(vars(recogniser.classifier))
    pack(recogniser)
    assert set(vars(recogniser.classifier)) == parts
    np.testing.assert_array_equal(recogniser.predict(three[2].demonstration).raw, before.raw)
    pack(recogniser)


def test_a_loaded_recogniser_can_be_saved_again(trained, three, path):
    for name in REGISTRY:
        save_recogniser(trained(name), path)
        save_recogniser(load_recogniser(path), path)
        first, second = (
            r.predict(three[2].demonstration) for r in (trained(name), load_recogniser(path))
        )
        np.testing.assert_array_equal(first.probabilities, second.probabilities)


def test_a_recogniser_trained_on_one_recording_twice_loads(three, path):
    save_recogniser(train([three[0], three[0]], SMALL.replace(classifier="naive-bayes")), path)
    assert load_recogniser(path).trained_on == (three[0].demonstration.id,) * 2


def test_the_file_holds_nothing_pickled_and_says_which_versions_wrote_it(trained, path):
    for name in REGISTRY:
        save_recogniser(trained(name), path)
        with zipfile.ZipFile(path) as archive:
            assert {part.rsplit(".")[-1] for part in archive.namelist()} <= {"json", "npy"}
        assert not set(skops_io.get_untrusted_types(file=path)) - set(TRUSTED)
    content = content_of(trained("mlp"))
    assert content["versions"]["scikit-learn"] == sklearn.__version__
    assert content["classifier"].random_state == SMALL.seed


# --- writing whole or not at all ----------------------------------------------------------------


def test_a_failed_save_leaves_the_former_file_and_nothing_else(trained, path, monkeypatch):
    save_recogniser(trained("naive-bayes"), path)
    before = path.read_bytes()
    monkeypatch.setattr(os, "fsync", lambda _: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(InputError, match="disk full"):
        save_recogniser(trained("decision-tree"), path)
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


def test_a_recogniser_that_cannot_be_written_out_leaves_the_former_file(trained, path):
    save_recogniser(trained("naive-bayes"), path)
    before = path.read_bytes()
    with pytest.raises(TypeError):
        save_recogniser(with_classifier(trained("naive-bayes"), theta_=io.StringIO()), path)
    assert path.read_bytes() == before


# --- files that are something else --------------------------------------------------------------


def test_a_missing_file_and_a_folder_are_no_recogniser(tmp_path):
    refused(tmp_path / "nowhere", "no recogniser at")
    refused(tmp_path, "no recogniser at")


def test_a_file_that_may_not_be_read_is_refused_with_the_reason(path, monkeypatch):
    path.write_bytes(b"PK")

    def locked(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(type(path), "open", locked)
    refused(path, "cannot be read: Permission denied; look who may read it")


@pytest.mark.parametrize(
    "data", [b"", b"PK", b"PK\x03\x04", b"%PDF-1.7", b"\x00" * 5000, b"a;b\n1;2\n" * 99]
)
def test_a_file_that_is_no_zip_is_refused(path, data):
    path.write_bytes(data)
    refused(path, "is not a recogniser; train one")


@pytest.mark.parametrize(
    "parts",
    [
        {},
        {"word/document.xml": "<w/>"},
        {"schema.json": ""},
        {"schema.json": "[]"},
        {"schema.json": "{}"},
        {"schema.json": '{"protocol": 2}'},
        {"schema.json": '{"protocol": 99}'},
        {"schema.json": b"\xff\xfe\x00"},
        {"schema.json": "[" * 100_000},
        {"schema.json": '{"protocol": 2, "__loader__": "NoNode", "__module__": 1, "__class__": 2}'},
    ],
)
def test_a_zip_of_something_else_is_refused(path, parts):
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in parts.items():
            archive.writestr(name, text)
    refused(path)


@pytest.mark.parametrize("value", [3, "text", None, [1, 2], {"weights": np.eye(3)}])
def test_something_else_that_skops_wrote_is_refused(path, value):
    path.write_bytes(skops_io.dumps(value))
    refused(path, "is not a recogniser; train one")


def test_a_recogniser_of_a_newer_format_is_refused_with_the_cure(trained, path):
    content = content_of(trained("naive-bayes"))
    content["forcelab recogniser"] = 3
    path.write_bytes(skops_io.dumps(content))
    refused(path, "comes from a newer forcelab; update")


def test_a_recogniser_of_format_1_predicts_to_the_bit_what_it_did(three, path, monkeypatch):
    monkeypatch.setattr(ensemble, "TREES", 50)  # as many as make most of the file
    recogniser = train(three[:2], preset("fast").replace(stride=1, changes=False))
    content = content_of(recogniser)
    for plain in (content["classifier"], *(part["classifier"] for part in content["live"])):
        plain["members"] = [
            forest_in_format_1(member) if isinstance(member, Forest) else member.plain()
            for member in CalibratedEnsemble.from_plain(plain, 10**6, 99).members
        ]
    content["forcelab recogniser"] = 1
    path.write_bytes(skops_io.dumps(content))
    older, size = load_recogniser(path), path.stat().st_size
    unseen = three[2].demonstration
    for stored in (older, recogniser):
        save_recogniser(stored, path)
        assert path.stat().st_size < size / 3
        found = load_recogniser(path).predict(unseen)
        np.testing.assert_array_equal(found.probabilities, recogniser.predict(unseen).probabilities)
    for stored, other in zip(older.live_models, recogniser.live_models, strict=True):
        rows = np.random.default_rng(0).normal(size=(50, stored.windows.width)).astype(np.float32)
        np.testing.assert_array_equal(
            stored.classifier.predict_proba(rows), other.classifier.predict_proba(rows)
        )


def test_a_setting_of_a_newer_version_is_refused_with_the_files_name(trained, path):
    content = content_of(trained("naive-bayes"))
    content["settings"]["clairvoyance"] = 1
    path.write_bytes(skops_io.dumps(content))
    refused(path, "setting 'clairvoyance' is unknown")


# --- damage -------------------------------------------------------------------------------------


def test_a_truncated_file_is_refused_wherever_it_ends(trained, path):
    data = pack(trained("naive-bayes"))
    for end in np.linspace(0, len(data) - 1, 30).astype(int):
        path.write_bytes(data[:end])
        refused(path)


def test_a_directory_that_begins_before_the_file_is_refused(path):
    size, place, comment = 2**16, 0, 0
    path.write_bytes(struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 1, 1, size, place, comment))
    refused(path, "not a whole recogniser")


def test_a_flipped_bit_is_refused_or_harmless(trained, three, path):
    recogniser = trained("naive-bayes")
    data = pack(recogniser)
    expected = recogniser.predict(three[2].demonstration).probabilities
    random = np.random.default_rng(0)
    directory = data.index(b"PK\x01\x02")
    # The zip's own directory is where a flip can do most.
    places = [*random.integers(0, len(data), 30), *random.integers(directory, len(data), 50)]
    for place in places:
        broken = bytearray(data)
        broken[place] ^= 1 << random.integers(8)
        path.write_bytes(broken)
        try:
            loaded = load_recogniser(path)
        except InputError:
            continue
        after = loaded.predict(three[2].demonstration).probabilities
        np.testing.assert_array_equal(after, expected)


def test_a_file_that_may_unpack_to_more_than_its_size_is_refused(trained, path):
    content = content_of(trained("naive-bayes"))
    path.write_bytes(skops_io.dumps(content))
    load_recogniser(path)
    path.write_bytes(skops_io.dumps(content, compression=zipfile.ZIP_DEFLATED))
    refused(path, "not a whole recogniser")


@pytest.mark.parametrize("header", [b"{'descr': (", b"\x00", b"{{", b"{'descr': '|O', ", b'"""'])
def test_an_array_with_a_broken_header_is_refused(trained, path, header):
    old = zipfile.ZipFile(io.BytesIO(pack(trained("naive-bayes"))))
    with zipfile.ZipFile(path, "w") as new:
        for part in old.namelist():
            data = old.read(part)
            if part.endswith(".npy"):
                data = data[:10] + header + data[10 + len(header) :]
            new.writestr(part, data)
    refused(path, "not a whole recogniser")


@pytest.mark.parametrize("shape", [(10**15,), (10**30,), (-1,), (2**62, 4)])
def test_an_array_that_claims_to_be_huge_is_refused(trained, path, shape):
    old = zipfile.ZipFile(io.BytesIO(pack(trained("naive-bayes"))))
    claim = io.BytesIO()
    header = {"descr": "<f8", "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(claim, header)
    with zipfile.ZipFile(path, "w") as new:
        for part in old.namelist():
            new.writestr(part, claim.getvalue() if part.endswith(".npy") else old.read(part))
    refused(path, "not a whole recogniser")


# --- files that mean harm -----------------------------------------------------------------------

HARM = []


class Canary:
    """Tells when it is built from a file."""

    def __getstate__(self):
        return {"song": "tweet"}

    def __setstate__(self, state):
        HARM.append(state)


@pytest.mark.parametrize(
    ("thing", "name"),
    [
        (functools.partial(os.system, "true"), "functools.partial|posix.system|nt.system"),
        (os.system, "posix.system|nt.system"),
        (eval, "builtins.eval"),
        (Canary(), "Canary"),
        (Canary, "Canary"),
        (operator.methodcaller("clear"), "operator.methodcaller"),
        (HARM.append, "append"),
    ],
)
@pytest.mark.parametrize("place", ["extra", "classifier", "inside"])
def test_a_type_that_no_recogniser_needs_is_refused_by_name_and_not_built(
    trained, path, thing, name, place
):
    content = content_of(trained("naive-bayes"))
    if place == "inside":
        content["classifier"].theta_ = [thing]
    else:
        content[place] = thing
    path.write_bytes(skops_io.dumps(content))
    refused(path, rf"holds the type .*({name}).*, which no recogniser needs; it was not loaded")
    assert HARM == []


def node(module, name, loader, content):
    return {"__module__": module, "__class__": name, "__loader__": loader, "content": content}


@pytest.mark.parametrize(
    ("module", "name", "loader"),
    [
        ("subprocess", "Popen", "ConstructorFromReduceNode"),
        ("os", "system", "ConstructorFromReduceNode"),
        ("builtins", "eval", "ConstructorFromReduceNode"),
        ("builtins", "exec", "ObjectNode"),
        ("subprocess", "call", "TypeNode"),
        ("os", "system", "FunctionNode"),
    ],
)
def test_a_schema_edited_by_hand_runs_nothing(trained, path, module, name, loader):
    canary = path.with_name("ran")
    command = {"Popen": ["touch", str(canary)]}.get(name, f"touch {canary}")
    command = {"eval": f"open({str(canary)!r}, 'w')"}.get(name, command)
    argument = {**node("builtins", "str", "JsonNode", json.dumps(command)), "is_json": True}
    old = zipfile.ZipFile(io.BytesIO(pack(trained("naive-bayes"))))
    schema = json.loads(old.read("schema.json"))
    schema["content"]["classifier"] = node(
        module, name, loader, node("builtins", "tuple", "TupleNode", [argument])
    )
    with zipfile.ZipFile(path, "w") as new:
        for part in old.namelist():
            new.writestr(part, json.dumps(schema) if part == "schema.json" else old.read(part))
    refused(path, rf"holds the type .*{name}|not a whole recogniser")
    assert not canary.exists()


# --- parts that do not fit together -------------------------------------------------------------


def test_another_classifier_than_the_settings_name_is_refused(trained, path):
    X, y = np.zeros((9, trained("svm").classifier.n_features_in_)), np.arange(9) % 4
    for stranger in (RandomForestClassifier(2), KNeighborsClassifier(1, algorithm="ball_tree")):
        wrong = dataclasses.replace(trained("naive-bayes"), classifier=stranger.fit(X, y))
        path.write_bytes(pack(wrong))
        refused(path)
    for name, stranger in (
        (
            "naive-bayes",
            LinearDiscriminantAnalysis().fit(np.random.default_rng(0).random(X.shape), y),
        ),
        ("mlp", trained("svm").classifier),
    ):
        path.write_bytes(pack(dataclasses.replace(trained(name), classifier=stranger)))
        refused(path, "not a whole recogniser")


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("rate", -100.0),
        ("rate", float("nan")),
        ("rate", "fast"),
        ("channels", "normal 1"),
        ("channels", ["normal 1"]),
        ("channels", [1, 2, 3, 4]),
        ("actions", ["still"]),
        ("actions", ["still", "grab", "grab", "hold"]),
        ("actions", ["still", "", "hold", "release"]),
        ("actions", None),
        ("shortest", {"still": "long"}),
        ("shortest", [1.0]),
        ("trained_on", 7),
        ("settings", {"max_scale": 64.0}),
        ("settings", ["paper"]),
        ("settings", {"stride": "often"}),
        ("classifier", None),
        ("classifier", {"classes_": [0, 1]}),
    ],
)
def test_a_field_of_nonsense_is_refused_at_once_and_not_when_predicting(
    trained, path, field, value
):
    content = content_of(trained("naive-bayes"))
    content[field] = value
    path.write_bytes(skops_io.dumps(content))
    refused(path, ".")


@pytest.mark.parametrize(
    ("spot", "value"),
    [
        (("rate",), float("inf")),
        (("rate",), 1e9),
        (("rate",), 1e-9),
        (("shortest", "grab"), 1e300),
        (("shortest", "grab"), -1.0),
        (("settings", "median"), 2**31),
        (("settings", "rate"), 1e9),
        (("settings", "drop"), 1e300),
        (("settings", "windows"), [0.01, 900.0]),
        (("choreography", "mean"), [0.0, 21.5, 0.0, 0.0]),
        (("choreography", "sd"), [0.5, 1e6, 0.5, 0.5]),
        (("choreography", "share"), [0.25, 2**31, 0.25, 0.25]),
        (("classifier", "mean"), float("inf")),
        (("classifier", "scale"), 1e300),
        (("live", 0, "look"), 2.0**31),
    ],
)
def test_a_number_out_of_its_range_is_refused_before_anything_is_predicted(fast, path, spot, value):
    content = content_of(fast)
    content["rate"] = 20_000.0 if "windows" in spot else content["rate"]
    place = content
    for key in spot[:-1]:
        place = place[key]
    if isinstance(place[spot[-1]], np.ndarray):
        place[spot[-1]][1] = value
    else:
        place[spot[-1]] = value
    path.write_bytes(skops_io.dumps(content))
    refused(path, ".")


def test_what_could_not_be_loaded_again_is_not_saved(trained, path):
    recogniser = trained("naive-bayes")
    save_recogniser(recogniser, path)
    before = path.read_bytes()
    for wrong in (
        dataclasses.replace(recogniser, rate=float("inf")),
        dataclasses.replace(recogniser, actions=recogniser.actions[:1]),
        with_classifier(recogniser, theta_=np.full_like(recogniser.classifier.theta_, np.nan)),
    ):
        with pytest.raises(InputError, match="was not saved, as it could not be loaded again"):
            save_recogniser(wrong, path)
        assert path.read_bytes() == before
    assert [file.name for file in path.parent.iterdir()] == [path.name]


@pytest.mark.parametrize(
    "field", ["settings", "rate", "channels", "actions", "shortest", "trained_on", "classifier"]
)
def test_a_missing_field_is_refused(trained, path, field):
    content = content_of(trained("naive-bayes"))
    del content[field]
    path.write_bytes(skops_io.dumps(content))
    refused(path, "not a whole recogniser")


@pytest.mark.parametrize(
    ("node_field", "value"),
    [
        ("left_child", 10**9),
        ("left_child", -7),
        ("left_child", 0),
        ("right_child", 10**9),
        ("right_child", -1),
        ("right_child", 0),
        ("feature", 10**6),
        ("feature", -1),
    ],
)
def test_a_tree_whose_nodes_point_outside_is_refused(trained, path, node_field, value):
    def change(state):
        nodes = state["nodes"].copy()
        nodes[node_field][0] = value
        return {**state, "nodes": nodes}

    path.write_bytes(pack(with_tree(trained("decision-tree"), change)))
    refused(path, "not a whole recogniser")


def with_tree(recogniser, change):
    """The same recogniser with what its tree is kept as changed."""
    state = change(recogniser.classifier.tree_.__getstate__())
    return with_classifier(recogniser, tree_=types.SimpleNamespace(__getstate__=lambda: state))


@pytest.mark.parametrize(
    "change",
    [
        lambda s: {**s, "node_count": 10**12},
        lambda s: {**s, "node_count": 1},
        lambda s: {**s, "nodes": s["nodes"][:1], "node_count": 1},
        lambda s: {**s, "nodes": s["nodes"][:0], "values": s["values"][:0], "node_count": 0},
        lambda s: {**s, "values": s["values"][:-1]},
        lambda s: {**s, "values": s["values"][:, :, :1]},
        lambda s: {**s, "values": s["values"].astype("f4")},
        lambda s: {**s, "nodes": s["values"]},
        lambda s: {k: v for k, v in s.items() if k != "nodes"},
    ],
)
def test_a_tree_of_arrays_that_do_not_fit_is_refused(trained, path, change):
    path.write_bytes(pack(with_tree(trained("decision-tree"), change)))
    refused(path, "not a whole recogniser")


def _without_a_row(array):
    return array[:-1]


CRAFTED = [
    ("mlp", "coefs_", lambda c: [c[0][:-1], c[1]]),
    ("mlp", "coefs_", lambda c: [c[0], c[1][:, :-1]]),
    ("mlp", "coefs_", lambda c: c[:1]),
    ("mlp", "coefs_", lambda c: [c[0].astype(str), c[1]]),
    ("mlp", "intercepts_", lambda i: [i[0], i[1][:-1]]),
    ("mlp", "out_activation_", lambda _: "explode"),
    ("mlp", "activation", lambda _: "explode"),
    ("mlp", "n_layers_", lambda _: 4),
    ("mlp", "classes_", _without_a_row),
    ("mlp", "classes_", lambda c: c + 1),
    ("mlp", "classes_", lambda c: c - 1),
    ("mlp", "classes_", lambda c: c[::-1]),
    ("mlp", "classes_", lambda c: c.astype(float)),
    ("mlp", "n_features_in_", lambda n: n - 1),
    ("naive-bayes", "theta_", _without_a_row),
    ("naive-bayes", "var_", lambda v: v[:, :-1]),
    ("naive-bayes", "class_prior_", _without_a_row),
    ("nearest-neighbours", "_fit_X", lambda x: x[:, :-1]),
    ("nearest-neighbours", "_fit_X", _without_a_row),
    ("nearest-neighbours", "_y", _without_a_row),
    ("nearest-neighbours", "_y", lambda y: y + 10**6),
    ("nearest-neighbours", "_y", lambda y: y - 10**6),
    ("nearest-neighbours", "_y", lambda y: np.where(np.arange(len(y)) == 0, 10**6, y)),
    ("nearest-neighbours", "n_neighbors", lambda _: 10**6),
    ("nearest-neighbours", "n_neighbors", lambda _: 0),
    ("nearest-neighbours", "n_samples_fit_", lambda n: n + 1),
    ("nearest-neighbours", "metric", lambda _: "precomputed"),
    ("nearest-neighbours", "_fit_method", lambda _: "kd_tree"),
    ("nearest-neighbours", "weights", lambda _: "distance"),
    ("svm", "support_vectors_", _without_a_row),
    ("svm", "support_vectors_", lambda v: v[:, :-1]),
    ("svm", "support_", _without_a_row),
    ("svm", "_n_support", _without_a_row),
    ("svm", "_n_support", lambda n: n * 1000),
    ("svm", "_n_support", lambda n: n + np.array([-9999, 9999, 0, 0], dtype=n.dtype)),
    ("svm", "_dual_coef_", lambda c: c[:, :-1]),
    ("svm", "_dual_coef_", _without_a_row),
    ("svm", "_intercept_", _without_a_row),
    ("svm", "_probA", lambda _: np.zeros(1)),
    ("svm", "kernel", lambda _: "precomputed"),
    ("svm", "kernel", lambda _: "linear"),
    ("svm", "_sparse", lambda _: True),
]


@pytest.mark.parametrize(("name", "part", "change"), CRAFTED)
def test_learnt_numbers_that_do_not_fit_are_refused_before_anything_uses_them(
    trained, path, name, part, change
):
    recogniser = trained(name, threshold=None)
    changed = with_classifier(recogniser, **{part: change(getattr(recogniser.classifier, part))})
    path.write_bytes(pack(changed))
    refused(path, "not a whole recogniser")


@pytest.mark.parametrize(("name", "part", "change"), [c for c in CRAFTED if c[0] == "svm"])
def test_the_same_holds_for_the_svm_inside_a_calibration(trained, path, name, part, change):
    recogniser = trained("svm")
    changed = copy.deepcopy(recogniser)
    inner = changed.classifier.calibrated_classifiers_[0].estimator
    vars(inner)[part] = change(getattr(inner, part))
    path.write_bytes(pack(changed))
    refused(path, "not a whole recogniser")


def test_a_tree_of_fewer_actions_than_it_says_is_refused(trained, path):
    path.write_bytes(pack(with_classifier(trained("decision-tree"), n_classes_=3)))
    refused(path, "not a whole recogniser")


def test_a_calibration_of_something_else_is_refused(trained, path):
    stranger = NuSVC()
    vars(stranger).update(vars(trained("svm", None).classifier))
    codes = np.array([0, 1])
    for part, value in (("estimator", stranger), ("calibrators", []), ("classes", codes)):
        changed = copy.deepcopy(trained("svm"))
        vars(changed.classifier.calibrated_classifiers_[0])[part] = value
        path.write_bytes(pack(changed))
        refused(path, "not a whole recogniser")


def test_an_mlp_that_numbers_its_actions_in_another_way_is_refused(trained, path):
    recogniser = trained("mlp", None)
    binarizer = copy.copy(recogniser.classifier._label_binarizer)
    binarizer.classes_ = binarizer.classes_ + np.array([0, 0, 0, 5])
    path.write_bytes(pack(with_classifier(recogniser, _label_binarizer=binarizer)))
    refused(path, "not a whole recogniser")
    coefficients, biases = recogniser.classifier.coefs_, recogniser.classifier.intercepts_
    fewer = {
        "coefs_": [coefficients[0], coefficients[1][:, :3]],
        "intercepts_": [biases[0], biases[1][:3]],
    }
    path.write_bytes(pack(with_classifier(recogniser, **fewer)))
    refused(path, "not a whole recogniser")
