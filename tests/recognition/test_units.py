"""Raw counts beside newtons are never mixed silently."""

from dataclasses import replace

import numpy as np
import pytest
from skops import io as skops_io
from synthetic import synthetic_set

from forcelab.demonstration import Channel
from forcelab.jobs import finish
from forcelab.labels import Track
from forcelab.project import Project
from forcelab.recognition.dataset import Choice
from forcelab.recognition.examples import Labelled, mixed_units, other_units, units_of
from forcelab.recognition.experiments import evaluate_tasks, train_tasks
from forcelab.recognition.settings import Settings
from forcelab.recognition.storage import TRUSTED, dump, load
from forcelab.recognition.training import train

SMALL = Settings(max_scale=32.0, stride=6, classifier="naive-bayes")


def in_counts(demonstration):
    channels = tuple(Channel(channel.name, "") for channel in demonstration.channels)
    return replace(demonstration, channels=channels, signals=400 * demonstration.signals)


@pytest.fixture(scope="module")
def four():
    return synthetic_set(4, rate=100.0)


@pytest.fixture(scope="module")
def recogniser(four):
    return train([Labelled(*pair) for pair in four[:2]], SMALL)


@pytest.fixture
def project(tmp_path, four):
    with Project.create(tmp_path / "mixed.forcelab") as made:
        for i, (demonstration, segments) in enumerate(four[:3]):
            given = in_counts(demonstration) if i == 1 else demonstration
            made.demonstrations.add(given, [Track("Ann", segments)])
        yield made


def test_demonstrations_in_counts_among_newtons_are_named_with_the_cure(four):
    demonstrations = [demonstration for demonstration, _ in four]
    assert mixed_units(demonstrations, SMALL) == ()
    demonstrations[2] = in_counts(demonstrations[2])
    [said] = mixed_units(demonstrations, SMALL)
    odd, others = demonstrations[2].name, [demonstrations[i].name for i in (0, 1, 3)]
    assert f"without a unit in '{odd}'" in said
    assert f"in N in {', '.join(f'{chr(39)}{name}{chr(39)}' for name in others)}" in said
    assert "by a calibration" in said
    assert mixed_units([], SMALL) == ()


def test_only_channels_that_are_looked_at_count(four):
    demonstration = four[0][0]
    channels = (*demonstration.channels[:-1], Channel("fz2", ""))
    pair = [demonstration, replace(demonstration, name="other", channels=channels)]
    assert mixed_units(pair, SMALL.replace(channels=("normal 1",))) == ()
    assert "normal 2" in mixed_units(pair, SMALL)[0]


def test_a_recogniser_tells_what_it_learnt_in_other_units(recogniser, four):
    demonstration = four[3][0]
    assert recogniser.units == ("N",) * 4
    assert recogniser.remarks_on(demonstration.channels) == ()
    [said] = recogniser.remarks_on(in_counts(demonstration).channels)
    assert "without a unit" in said
    assert "learnt it in N" in said


def test_units_are_kept_in_its_file_and_older_files_still_load(recogniser, four, tmp_path):
    file = tmp_path / "new.skops"
    file.write_bytes(dump(recogniser))
    assert load(file).units == recogniser.units
    content = skops_io.loads(dump(recogniser), trusted=list(TRUSTED))
    del content["units"]
    file.write_bytes(skops_io.dumps(content))
    old = load(file)
    assert old.units == ()
    assert old.remarks_on(in_counts(four[3][0]).channels) == ()
    assert np.array_equal(old.predict(four[3][0]).filtered, recogniser.predict(four[3][0]).filtered)


def test_evaluating_and_training_on_mixed_units_is_remarked_on(project):
    name = project.demonstrations.infos()[1].name
    evaluated = finish(evaluate_tasks(project, SMALL, Choice()))
    trained = finish(train_tasks(project, SMALL, Choice(), "mixed"))
    for remarks in (evaluated.remarks, trained.remarks):
        assert any(f"without a unit in '{name}'" in remark for remark in remarks)
    assert trained.recogniser.units == ()


def test_each_recognition_channel_has_its_unit():
    channels = [Channel("fx", "N"), Channel("fy", "N"), Channel("fz", "mN"), Channel("opening", "")]
    assert units_of(channels) == ("N", "mN", "")
    assert other_units(("N",), ("tangential",), channels) == ()
