"""Each thing is measured once on little data; how long anything takes is not asserted."""

import numpy as np
import pytest
from trained_project import FAST

from forcelab.gui.label import scalogram_job
from forcelab.gui.measuring import capturing, films, recordings, scalograms, training
from forcelab.gui.measuring.capturing import measuring_capture
from forcelab.gui.measuring.films import FILMS, number_of
from forcelab.gui.measuring.opening import measuring_opening
from forcelab.gui.measuring.panning import measuring_panning, zooms
from forcelab.gui.measuring.scalograms import measuring_scalograms
from forcelab.gui.measuring.stage import stage
from forcelab.gui.measuring.strokes import measuring_strokes
from forcelab.gui.measuring.videos import measuring_video
from forcelab.jobs import finish
from forcelab.measure.latency import Latencies
from forcelab.signals import scalogram, scalogram_tiles

SIZE = (1280, 1000)


@pytest.fixture
def folder(app):
    with stage() as folder:
        yield folder


def test_panning_is_measured_at_every_zoom_beside_pyqtgraph(folder, recwarn):
    rows = finish(measuring_panning(folder, 3000, gestures=1, size=SIZE))
    table = Latencies("t", rows)
    frames = [row for row in rows if row.name == "pan and zoom"]
    assert [row.setting.partition(", ")[2] for row in frames] == [
        zoom.name for zoom in zooms(2.999)
    ]
    assert all(len(row.samples) == 8 and table.ratio(row) for row in frames)
    assert not list(folder.glob("long*"))


def test_scalograms_are_measured_cold_and_warm(folder, monkeypatch):
    monkeypatch.setattr(scalograms, "SPANS", (2000,))
    # Few samples make a long recording, of several chunks.
    for module in (scalogram, scalogram_tiles):
        monkeypatch.setattr(module, "CHUNK", 1 << 12)
    monkeypatch.setattr(scalogram, "LONG", 1 << 12)
    monkeypatch.setattr(scalogram_job, "KEPT", 1 << 12)
    rows = finish(measuring_scalograms(folder, 300_000, times=2, size=SIZE))
    told = {(row.name, row.setting.partition(", ")[2]): row for row in rows}
    for span in ("2,000", "300,000"):
        ways = [f"{span} visible, {way}" for way in ("never seen", "seen before", "from its file")]
        for way in ways:
            first, exact = told.pop(("first scalogram", way)), told.pop(("exact scalogram", way))
            assert len(first.samples) == len(exact.samples) == 2
            assert all(a <= b for a, b in zip(first.samples, exact.samples, strict=True))
        assert exact.bound is not None
    assert not told
    assert not list(folder.glob("long*"))


def test_what_does_not_fit_is_refused_in_one_sentence(folder, monkeypatch):
    monkeypatch.setattr(recordings, "SAMPLE", 10**12)
    rows = finish(measuring_panning(folder, 1000, gestures=1, size=SIZE))
    assert all("GB" in row.refusal for row in rows)


def test_strokes_end_in_the_store(folder):
    project = recordings.segmented(folder, 60, count=20_000)
    rows = finish(measuring_strokes(project, segments=60, times=2, size=SIZE))
    assert [len(row.samples) for row in rows if row.name == "key to paint"] == [2, 2]


def test_a_project_is_opened_again_and_again(folder):
    projects = {"many": recordings.many(folder, 3), "dense": recordings.segmented(folder, 20, 5000)}
    rows = finish(measuring_opening(projects, times=2, size=SIZE))
    assert [(row.setting, len(row.samples)) for row in rows] == [("many", 2), ("dense", 2)]


def test_live_frames_are_measured_with_all_that_can_be_on(folder, monkeypatch):
    monkeypatch.setattr(capturing, "SETTLED", 0.1)
    monkeypatch.setattr(capturing, "SECONDS", 4.0)
    monkeypatch.setattr(capturing, "preset", lambda _: FAST.replace(stride=10))
    monkeypatch.setattr("forcelab.gui.capture.scalogram.ROWS", 6)
    rows = finish(measuring_capture(folder, frames=5, size=(960, 640)))
    settings = [row.setting.removeprefix("2 DAQs at 1 kHz") for row in rows[::2]]
    assert settings == ["", ", scalogram", ", recognition", ", scalogram, recognition"]
    for apart, work in zip(rows[::2], rows[1::2], strict=True):
        assert len(apart.samples) == len(work.samples) >= 5
        assert 0 < work.at("median") < 1
        assert min(apart.samples) > 0


def test_no_frame_of_a_video_is_wrong(folder):
    rows = finish(measuring_video(folder, FILMS[-1], frames=40, times=6, size=SIZE))
    ours = [row for row in rows if row.alternative]
    assert [row.wrong for row in ours] == [0, 0, 0]
    assert all(row.samples for row in rows)


def test_without_pyav_it_is_said_how_to_get_it(folder, monkeypatch):
    monkeypatch.setattr(films, "find_spec", lambda _: None)
    rows = finish(measuring_video(folder, FILMS[0], frames=40, times=6, size=SIZE))
    assert all("pip install av" in row.refusal for row in rows)


@pytest.mark.parametrize("film", FILMS, ids=lambda film: film.name)
def test_frames_carry_their_number_through_the_codec(film, tmp_path):
    from forcelab.video.opencv import opencv

    film.make(tmp_path / "film.mp4", 12)
    capture = opencv().VideoCapture(str(tmp_path / "film.mp4"))
    assert [number_of(capture.read()[1]) for _ in range(12)] == list(range(12))
    capture.release()
    assert film.times(12)[0] == 0
    assert (np.diff(film.times(12)) > 0).all()


def test_training_is_measured_and_leaves_nothing_behind(app, monkeypatch):
    monkeypatch.setattr(training, "SOON", 0.5)
    few = training.Amount(samples=6000, seconds=0.3, cancels=1, trainings=1, size=SIZE)
    measured = finish(training.tabulate(amount=few))
    late, alone, own, own_alone, mlp, svm = measured.rows
    assert measured.ratio(late)
    assert measured.ratio(own)
    assert len(alone.samples) > 0
    assert len(own_alone.samples) > 0
    assert (len(mlp.samples), len(svm.samples)) == (1, 1)
    assert [level.unit for level in measured.levels] == ["MB", "", ""]
    assert [level.value for level in measured.levels[1:]] == [0, 0]
    assert len(measured.level_cells()) == 4
    assert measured.to_json()["levels"][0]["most"] == 50
