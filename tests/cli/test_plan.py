"""``forcelab plan``: what it says is computed is what is computed."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from quick import FAST
from synthetic import synthetic_demonstration

from forcelab.demonstration import VideoReference
from forcelab.project import Incoming, Project
from forcelab.recognition.examples import Labelled, prepare
from forcelab.recognition.planning import planned
from forcelab.recognition.settings import Settings
from forcelab.signals.channels import channel_map
from forcelab.simulation.layout import Layout
from forcelab.simulation.origin import Origin
from forcelab.simulation.scene import TASKS
from forcelab.simulation.tasks import scene_of

FOAM, _ = synthetic_demonstration(1, rate=200.0)
CHANNELS = channel_map(FOAM.channels).names


def parts_of(plan):
    """The parts of a plan by name."""
    parts = {part["name"]: part for part in plan["recognition"]}
    assert len(parts) == len(plan["recognition"])
    return parts


@given(
    st.lists(st.sampled_from(CHANNELS), min_size=1, unique=True),
    st.booleans(),
    st.sampled_from([2.0, 4.0]),
    st.sampled_from([16.0, 64.0]),
    st.sampled_from([0.5, 1.0]),
    st.sampled_from([None, 100.0]),
)
@settings(max_examples=15, deadline=None)
def test_the_plan_counts_what_the_features_hold(channels, phase, low, high, spacing, rate):
    wanted = Settings(
        channels=tuple(channels),
        phase=phase,
        min_scale=low,
        max_scale=high,
        spacing=spacing,
        rate=rate,
    )
    parts = {part.name: part for part in planned(FOAM, (), wanted)}
    counted = sum(
        int(parts[name].why.split()[0])
        for name in ("log magnitudes", "phases")
        if parts[name].computed
    )
    assert prepare(Labelled(FOAM), wanted).features.shape[1] == counted
    assert f"{len(wanted.scales)} scales" in parts


@pytest.mark.parametrize(
    ("channels", "columns"),
    [
        (("normal 1",), {"fx1", "fy1", "fx2", "fy2", "fz2"}),
        (("tangential 2", "normal 1"), {"fx1", "fy1", "fz2"}),
        (None, set()),
    ],
)
def test_columns_that_are_left_out_change_nothing(channels, columns):
    wanted = Settings(channels=channels, max_scale=64.0)
    parts = planned(FOAM, (), wanted)
    left_out = {part.name for part in parts if not part.computed}
    assert {name for name in left_out if name.startswith("column")} == {
        f"column {column}" for column in columns
    }
    spoilt = FOAM.signals.copy()
    spoilt[:, [channel.name in columns for channel in FOAM.channels]] = np.nan
    one, other = (
        prepare(Labelled(replace(FOAM, signals=signals)), wanted)
        for signals in (FOAM.signals, spoilt)
    )
    assert np.array_equal(one.features, other.features)
    assert other.valid.all()


def test_every_part_says_why(forcelab, project):
    plan = forcelab("plan", project, "foam-01", "--json").json
    parts = parts_of(plan)
    assert not parts["video decoder"]["computed"]
    assert parts["timelines"]["computed"]
    assert "coder" in parts["timelines"]["why"]
    assert parts["probabilities"]["computed"]
    assert all(part["why"] for part in parts.values())
    assert plan["mechanics"] is None


def test_what_the_settings_switch_off_is_left_out(forcelab, project):
    words = ["--threshold", "off", "--median", "off", "--drop", "off", "--no-phase"]
    parts = parts_of(forcelab("plan", project, "foam-01", *words, "--json").json)
    off = ("threshold filter", "median filter", "drop filter", "probabilities", "phases")
    assert not any(parts[name]["computed"] for name in off)
    said = forcelab("plan", project, "foam-01", *words).out
    assert "left out  probabilities" in said
    assert "computed  log magnitudes" in said


def test_without_labels_no_timelines_and_with_a_video_a_decoder(forcelab, project, tmp_path):
    film = tmp_path / "film.mp4"
    film.write_bytes(b"no video, but nothing looks into it")
    with Project.open(project) as opened:
        opened.add(replace(FOAM, name="filmed", video=VideoReference(film)))
    parts = parts_of(forcelab("plan", project, "filmed", "--json").json)
    assert parts["video decoder"]["computed"]
    assert not parts["timelines"]["computed"]


def test_scales_that_fit_the_recording_but_not_the_settings_are_named(forcelab, project):
    words = ["plan", project, "foam-01", "--max-scale", "64", "--json"]
    parts = parts_of(forcelab(*words).json)
    (wider,) = (name for name in parts if name.startswith("scales of "))
    assert wider.startswith("scales of 128, 256")
    assert not parts[wider]["computed"]


def test_a_recogniser_brings_its_own_settings(forcelab, project, tmp_path):
    file = tmp_path / "foam.skops"
    options = ["--channels", "normal 1,normal 2", *FAST[:-2]]
    assert forcelab("train", project, "--task", "foam", "--out", file, *options).status == 0
    words = ["plan", project, "foam-01", "--recogniser", file]
    parts = parts_of(forcelab(*words, "--json").json)
    assert parts["classifier naive-bayes"]["computed"]
    assert parts["channel normal 2"]["computed"]
    assert not parts["channel tangential 1"]["computed"]
    assert not parts["column fx2"]["computed"]
    assert "--recogniser alone" in forcelab(*words, "--stride", "3").sentence
    assert "no recogniser" in forcelab(*words[:-1], tmp_path / "none.skops").sentence


@pytest.mark.parametrize("task", TASKS)
def test_a_simulated_demonstration_tells_its_mechanics(forcelab, tmp_path, task):
    origin = Origin(task, 3, 2)
    project = tmp_path / "lab.forcelab"
    with Project.create(project) as opened:
        opened.add_all([Incoming(replace(FOAM, task=task), source=str(origin))])
    mechanics = forcelab("plan", project, FOAM.name, "--json").json["mechanics"]
    scene = scene_of(task, 3, 2)
    assert mechanics["source"] == str(origin)
    assert mechanics["states"] == list(Layout.of(scene).names)
    left_out = "; ".join(mechanics["left out"])
    assert ("socket and snap" in left_out) == (scene.socket is None)
    assert ("twist" in left_out) == (scene.thread is None)
    assert ("table: " in left_out) == (scene.ground is None)
    assert ("width that varies" in left_out) == (scene.profile is None)
    said = forcelab("plan", project, FOAM.name).out
    assert all(what in said for what in mechanics["left out"])


def test_a_demonstration_that_is_not_there_is_refused(forcelab, project):
    assert "'fly'" in forcelab("plan", project, "fly").sentence
    assert "'force 9'" in forcelab("plan", project, "foam-01", "--channels", "force 9").sentence


def test_planning_loads_neither_opencv_nor_qt(project):
    script = (
        "import sys; from forcelab.cli import main; status = main(sys.argv[1:]);"
        "sys.exit(status or bool({'cv2', 'serial', 'PySide6'} & set(sys.modules)))"
    )
    words = ["plan", str(project), "foam-01"]
    subprocess.run([sys.executable, "-c", script, *words], check=True, capture_output=True)
