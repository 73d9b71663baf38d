"""A setting that changes nothing is known for that, with what it would take."""

import pytest

from forcelab.recognition.presets import PRESETS, preset
from forcelab.recognition.settings import Settings, applies, why_not_applied


@pytest.mark.parametrize(
    ("name", "changes", "told"),
    [
        ("changes", {}, "with decoder filters; it needs decoder semi-markov"),
        ("median", {"decoder": "semi-markov"}, "decoder semi-markov; it needs decoder filters"),
        ("max_scale", {"features": "windows"}, "with features windows; it needs features wavelets"),
        ("peaks", {}, "with features wavelets; it needs features windows"),
        ("circular", {"phase": False}, "with phase off; it needs phase on"),
        (
            "balanced",
            {},
            "with classifier mlp; it needs classifier logistic or extra-trees or boosting or "
            "ensemble",
        ),
    ],
)
def test_what_changes_nothing_is_told_with_what_it_takes(name, changes, told):
    values = vars(Settings(**changes))
    assert not applies(name, values)
    assert why_not_applied(name, values).endswith(told)


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
