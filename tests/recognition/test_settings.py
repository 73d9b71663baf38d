"""Settings: their ranges, and which of them apply beside the others."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.label_map import MergeMap
from forcelab.recognition.classifiers import REGISTRY
from forcelab.recognition.presets import PRESETS, preset
from forcelab.recognition.settings import Settings, applies, why_not_applied
from forcelab.signals.wavelets import Morlet

NAMES = st.text(min_size=1, max_size=8).filter(str.strip)
POSITIVE = st.floats(0.1, 1e4)
ANY_SETTINGS = st.builds(
    Settings,
    preset=st.text(max_size=8),
    channels=st.none() | st.lists(NAMES, max_size=4, unique=True).map(tuple),
    rate=st.none() | POSITIVE,
    wavelet=st.sampled_from(
        ["morlet", "real-morlet", "uncorrected-morlet", "torrence-compo", "dog"]
    ),
    parameter=st.none() | st.integers(1, 9).map(float),
    min_scale=st.floats(0.5, 4.0),
    max_scale=st.floats(4.0, 1e5),
    spacing=st.floats(0.1, 2.0),
    phase=st.booleans(),
    classifier=st.sampled_from(list(REGISTRY)),
    stride=st.integers(1, 1000),
    threshold=st.none() | st.floats(0, 1),
    median=st.none() | st.integers(1, 1000),
    drop=st.none() | st.floats(0, 1e6),
    merge=st.dictionaries(NAMES, st.just("grab")).map(lambda m: MergeMap({**m, "grab": "grab"})),
    seed=st.integers(0, 2**32 - 1),
)


@hypothesis_settings(max_examples=60, deadline=None)
@given(ANY_SETTINGS)
def test_settings_survive_the_trip_through_a_json_file(settings):
    text = json.dumps(settings.to_json(), allow_nan=False)
    assert Settings.from_json(json.loads(text)) == settings


def test_a_value_left_out_of_a_file_has_its_default():
    assert Settings.from_json({"stride": 7}) == Settings(stride=7)
    assert Settings.from_json({}) == Settings()


def test_the_unit_of_forces_that_older_versions_chose_stands_for_features_of_both():
    assert Settings.from_json({"amplitude": "chosen"}) == Settings(amplitude="both")


def test_the_preset_paper_is_the_published_method():
    paper = preset("paper")
    assert paper.mother == Morlet(5.0)
    assert paper.scales.tolist() == [2.0**j for j in range(1, 11)]
    chosen = ("phase", "classifier", "stride", "threshold", "median", "drop", "channels", "rate")
    values = [getattr(paper, name) for name in chosen]
    assert values == [True, "mlp", 1, 0.8, 10, 0.125, None, None]
    assert paper.merge == MergeMap()
    assert paper.preset == "paper"


def test_every_preset_bears_its_own_name():
    assert {name: settings.preset for name, settings in PRESETS.items()} == {n: n for n in PRESETS}


def test_an_unknown_preset_is_refused_with_the_known_ones():
    message = r"no preset 'better'; did you mean 'best'\? Choose from .*paper"
    with pytest.raises(InputError, match=message):
        preset("better")


OUT_OF_RANGE = [
    ("classifier", "forest"),
    ("wavelet", "mexican"),
    ("wavelet", 5),
    ("parameter", -1.0),
    ("parameter", np.nan),
    ("min_scale", 0.0),
    ("min_scale", np.nan),
    ("max_scale", 1.0),
    ("max_scale", np.inf),
    ("spacing", 0.0),
    ("spacing", -1.0),
    ("spacing", 1e-320),
    ("rate", 0.0),
    ("rate", -5.0),
    ("rate", np.inf),
    ("stride", 0),
    ("stride", 1.5),
    ("stride", True),
    ("threshold", -0.1),
    ("threshold", 1.1),
    ("threshold", np.nan),
    ("median", 0),
    ("median", 2.5),
    ("drop", -0.1),
    ("drop", np.nan),
    ("drop", np.inf),
    ("seed", -1),
    ("seed", 2**32),
    ("seed", 0.5),
    ("phase", "yes"),
    ("channels", (1, 2)),
    ("channels", ("normal 1", "normal 1")),
    ("preset", None),
    ("windows", (0.1, 0.1)),
    ("windows", (0.2, 0.1)),
    ("windows", (0.0,)),
    ("step", 0.0),
]


@pytest.mark.parametrize(("name", "value"), OUT_OF_RANGE)
def test_a_value_out_of_its_range_is_refused_in_one_sentence(name, value):
    with pytest.raises(InputError) as refusal:
        Settings(**{name: value})
    assert str(refusal.value).endswith(".")
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("name", ["stride", "threshold", "median", "drop", "rate", "seed"])
def test_the_refusal_names_the_setting_what_it_must_be_and_what_it_was(name):
    with pytest.raises(InputError, match=rf"The setting {name} must be .*, not -3\."):
        Settings(**{name: -3})


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"min_scale": 10, "max_scale": 2},
            "The setting max_scale must be at least min_scale, which is 10 samples, not 2.",
        ),
        (
            {"channels": ("fx", "fx")},
            "The setting channels must name each channel once, not fx, fx.",
        ),
        (
            {"windows": ()},
            "The setting windows must be 1 to 32 numbers of seconds from 0.0001 to 1000, the "
            "smallest first, not none.",
        ),
        (
            {"features": "x"},
            "There is no kind of features 'x'; choose from wavelets, windows, windows+wavelets.",
        ),
    ],
)
def test_a_refusal_names_the_cure(values, message):
    with pytest.raises(InputError) as refusal:
        Settings(**values)
    assert str(refusal.value) == message


@pytest.mark.parametrize("name", [f.name for f in dataclasses.fields(Settings)])
@pytest.mark.parametrize("value", [[], {"a": 1}, "?", [[1]]])
def test_no_value_of_a_wrong_type_gets_further_than_a_sentence(name, value):
    if (name, value) in [("preset", "?"), ("channels", [])]:
        Settings.from_json({name: value})
        return
    with pytest.raises(InputError, match=r"\.$"):
        Settings.from_json({name: value})


def test_a_setting_that_a_newer_version_invented_is_refused_by_name():
    with pytest.raises(InputError, match=r"setting 'clairvoyance' is unknown.*newer"):
        Settings.from_json({**Settings().to_json(), "clairvoyance": 1})


def test_replacing_a_value_checks_it_and_leaves_the_first_settings_alone():
    settings = Settings()
    assert settings.replace(stride=3).stride == 3
    assert settings.stride == 1
    with pytest.raises(InputError):
        settings.replace(stride=0)


@pytest.mark.parametrize(
    ("name", "changes", "reason"),
    [
        ("changes", {}, "with decoder filters; it needs decoder semi-markov"),
        ("median", {"decoder": "semi-markov"}, "decoder semi-markov; it needs decoder filters"),
        (
            "max_scale",
            {"features": "windows"},
            "with features windows; it needs features wavelets or windows+wavelets",
        ),
        (
            "peaks",
            {},
            "with features wavelets; it needs features windows or windows+wavelets",
        ),
        ("circular", {"phase": False}, "with phase off; it needs phase on"),
        (
            "balanced",
            {},
            "with classifier mlp; it needs classifier logistic or extra-trees or trees-mlp or "
            "boosting or ensemble",
        ),
    ],
)
def test_a_setting_that_changes_nothing_is_explained_with_what_it_needs(name, changes, reason):
    values = vars(Settings(**changes))
    assert not applies(name, values)
    assert why_not_applied(name, values).endswith(reason)


def test_beside_windows_wavelets_count_as_windows_do():
    both = vars(preset("mlp").replace(features="windows+wavelets"))
    assert all(applies(name, both) for name in ("max_scale", "phase", "windows", "peaks"))


def test_of_windows_every_classifier_can_be_calibrated():
    for name in REGISTRY:
        assert applies("calibrated", vars(Settings(features="windows", classifier=name)))
    assert not applies("calibrated", vars(Settings(classifier="mlp")))


def test_a_seed_counts_where_anything_is_drawn():
    assert not applies("seed", vars(Settings(classifier="logistic", changes=True)))
    assert applies("seed", vars(Settings(classifier="logistic", trimmed=True)))
    decoded = Settings(classifier="logistic", changes=True, decoder="semi-markov")
    assert applies("seed", vars(decoded))


@pytest.mark.parametrize("name", PRESETS)
def test_all_that_a_preset_chooses_counts(name):
    chosen = {key: value for key, value in vars(preset(name)).items() if value is not None}
    plain = vars(Settings())
    differing = [key for key, value in chosen.items() if value is not False and value != plain[key]]
    assert all(applies(key, chosen) and why_not_applied(key, chosen) == "" for key in differing)


@pytest.mark.parametrize(
    ("rate", "stride"), [(10_000, 5), (1000, 5), (100, 5), (50, 5), (25, 2), (20, 2), (5, 1)]
)
def test_a_stride_of_steps_in_seconds_takes_as_long_at_low_rates(rate, stride):
    settings = preset("fast")  # every fifth step of 20 ms
    assert settings.training_stride(rate) == stride
    assert Settings(stride=7).training_stride(rate) == 7
