from __future__ import annotations

import math
import threading

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest
from window_helpers import PATIENCE

from forcelab.demonstration import Channel, Demonstration
from forcelab.gui import theme
from forcelab.gui.document import Document
from forcelab.gui.label import scalogram as reading
from forcelab.gui.label import scalogram as scalogram_module
from forcelab.gui.label import scalogram_painting as scales
from forcelab.gui.label.scalogram import ScalogramPanel, ScalogramRequest, compute
from forcelab.gui.label.scalogram_painting import amount_text
from forcelab.recognition.presets import preset
from forcelab.signals import scalogram as signals
from forcelab.signals.cwt import cwt, frequencies
from forcelab.signals.wavelets import Morlet

NAMES = ("fx1", "fy1", "fz1")


class Shown(Document):
    """A document that shows demonstrations of no project."""

    def look(self, demonstration):
        self.view.reset(demonstration)
        self.demonstration_changed.emit()
        self.view.span_changed.emit(self.view.start, self.view.end)


def tone(n=8000, hertz=20.0, names=NAMES):
    t = np.arange(n) / 1000
    signals = 0.01 * np.random.default_rng(5).standard_normal((n, len(names)))
    signals[:, -1] += 2 * np.sin(2 * np.pi * hertz * t) * (t > n / 4000)
    return Demonstration("foam 1", "foam", t, signals, tuple(Channel(c, "N") for c in names))


@pytest.fixture
def document(app):
    document = Shown("Ann")
    document.look(tone())
    return document


@pytest.fixture
def panel(document, jobs):
    panel = ScalogramPanel(document, jobs)
    panel.resize(88 + 400 + 8, 160)
    yield panel
    panel.close()


@pytest.fixture
def open_panel(panel, until):
    panel.show()
    until(lambda: panel.picture is not None and panel.settled)
    return panel


@pytest.fixture
def started_jobs(jobs, monkeypatch):
    """The jobs that were started."""
    started = []
    run = jobs.run
    monkeypatch.setattr(jobs, "run", lambda *a, **k: started.append(a) or run(*a, **k))
    return started


def spot(panel, time, hertz):
    """The pixel of a time and a frequency."""
    place = math.log(1000.0 / (scales.FOURIER_FACTOR * hertz))
    box = panel._box
    return QPointF(panel.x_at(time), box.pos().y() + box.mapFromView(QPointF(0, place)).y())


def colour(panel, time, hertz):
    """The colour at a time and a frequency."""
    at = spot(panel, time, hertz) * panel.devicePixelRatioF()
    return panel.grab().toImage().pixelColor(int(at.x()), int(at.y()))


def test_a_hidden_panel_computes_nothing(panel, document, started_jobs, app):
    document.view.set_span(1.0, 2.0)
    panel.set_channel("normal 1")
    QTest.qWait(scalogram_module.LOADING_DELAY_MS + 20)
    assert not started_jobs
    assert panel.picture is None
    assert panel.settled


def test_hiding_ends_what_is_being_computed(panel, document, started_jobs, jobs, until):
    panel.show()
    panel.hide()
    QTest.qWait(scalogram_module.LOADING_DELAY_MS + 20)
    assert not started_jobs
    assert panel.settled
    panel.show()
    until(lambda: started_jobs)
    panel.hide()
    assert panel.settled
    until(lambda: not jobs.busy)
    QTest.qWait(1)
    assert panel.picture is None


def test_a_minimised_window_computes_nothing_until_it_comes_back(
    open_panel, document, started_jobs, until
):
    open_panel.showMinimized()
    document.view.set_span(1.0, 2.0)
    QTest.qWait(scalogram_module.LOADING_DELAY_MS + 20)
    assert not started_jobs
    assert open_panel.settled
    open_panel.showNormal()
    until(lambda: started_jobs and open_panel.settled)
    assert open_panel.picture.start == pytest.approx(1.0)


def test_only_the_visible_span_is_computed_at_the_screens_resolution(open_panel, document, until):
    document.view.set_span(2.0, 4.0)
    until(lambda: open_panel.settled)
    picture = open_panel.picture
    assert (picture.start, picture.end) == (pytest.approx(2.0), pytest.approx(4.0))
    assert picture.values.shape == (80, 400)
    assert not picture.coarse


def test_many_changes_of_the_span_make_one_picture(open_panel, document, started_jobs, until):
    for i in range(20):
        document.view.set_span(1.0 + 0.01 * i, 3.0)
    until(lambda: open_panel.settled)
    assert len(started_jobs) == 1


def test_the_old_picture_moves_with_the_time_axis_at_once(open_panel, document, until):
    open_panel.set_channel("normal 1")
    until(lambda: open_panel.settled and open_panel.picture is not None)
    loud, quiet = colour(open_panel, 5.0, 20.0), colour(open_panel, 0.8, 20.0)
    assert abs(loud.lightness() - quiet.lightness()) > 40
    old = open_panel.picture
    document.view.set_span(0.5, 6.5)
    assert open_panel.picture is old
    assert abs(colour(open_panel, 5.0, 20.0).lightness() - loud.lightness()) < 12
    assert abs(colour(open_panel, 0.8, 20.0).lightness() - quiet.lightness()) < 12


def test_colours_do_not_jump_while_panning(open_panel, document, until):
    before = open_panel._layers.ends
    document.view.set_span(0.2, 1.2)
    until(lambda: open_panel.settled)
    assert open_panel._layers.ends == before
    open_panel.set_steady(False)
    assert open_panel._layers.ends != before


@pytest.fixture
def long_from_little(monkeypatch):
    """Few samples make a long recording, of several blocks."""
    monkeypatch.setattr(signals, "LONG", 1 << 12)
    monkeypatch.setattr(signals, "BLOCK", 1 << 12)


@pytest.mark.usefixtures("long_from_little")
def test_a_long_recording_is_coarse_first_and_says_so(panel, document, until, monkeypatch):
    document.look(tone(60_000))
    pictures, arrived, compute = [], threading.Event(), scalogram_module.compute

    def watched(request, view):
        """The job, which waits with the fine picture until the coarse one was delivered."""
        results = []

        def relayed():
            results.append((yield from compute(request, view)))

        for step in relayed():
            yield step
            if getattr(step, "picture", None) is not None:
                assert arrived.wait(PATIENCE)
        return results[0]

    monkeypatch.setattr(scalogram_module, "compute", watched)
    panel._loader.loaded.connect(lambda picture: (pictures.append(picture), arrived.set()))
    panel.show()
    until(lambda: panel.settled and panel.picture is not None)
    assert pictures[0].coarse
    assert "coarse" in reading.readout_note(pictures[0], 0.0)
    assert not panel.picture.coarse
    assert "largest of 150 samples" in panel._note


@pytest.mark.usefixtures("long_from_little")
def test_what_is_not_seen_yet_is_ready_when_somebody_pans(panel, document, jobs, until):
    document.look(tone(60_000))
    document.view.set_span(0.0, 20.0)
    panel.show()
    until(lambda: panel.settled and panel.picture is not None)
    until(lambda: not jobs.busy)
    picture = panel.picture
    assert picture.end == pytest.approx(20.0)
    assert not picture.view.cells(picture.scales).missing()
    document.view.set_span(30.0, 55.0)
    until(lambda: panel.settled)
    assert panel.picture.view is picture.view
    assert not panel.picture.coarse


def test_the_value_under_the_pointer_is_that_of_the_transform(open_panel, document, until):
    open_panel.set_channel("normal 1")
    document.view.set_span(4.0, 4.4)
    until(lambda: open_panel.settled)
    text = open_panel.readout(spot(open_panel, 4.2, 20.0))
    hertz, rest = text.split(" Hz at ")
    time, value = rest.split(" s: ")
    assert float(hertz) == pytest.approx(20.0, rel=0.01)
    assert float(time) == pytest.approx(4.2)
    scale = 1000.0 / (scales.FOURIER_FACTOR * 20.0)
    exact = np.abs(cwt(document.demonstration.signals[:, 2], [scale])[0, 4200])
    assert value.startswith("|W| = ")
    assert float(value.removeprefix("|W| = ")) == pytest.approx(exact, rel=0.05)


def test_a_picture_of_another_channel_is_never_shown(open_panel, document, until):
    for channel in ("normal 1", "fx1", "fy1", "tangential 1", "fz1"):
        open_panel.set_channel(channel)
        QTest.qWait(43)
        assert open_panel.picture is None or open_panel.picture.view.reader.channel == channel
    until(lambda: open_panel.settled and open_panel.picture is not None)
    assert open_panel.picture.view.reader.channel == "fz1"


def test_phases_are_shown_on_request(open_panel, until):
    open_panel.set_phase(True)
    until(lambda: open_panel.settled and open_panel.picture is not None)
    assert open_panel.picture.phase
    y = spot(open_panel, 0.0, 27.0).y()
    values = [open_panel.readout(QPointF(x, y)) for x in range(100, 480, 5)]
    assert all(value.endswith(" rad") and "-" not in value for value in values)
    assert any("\N{MINUS SIGN}" in value for value in values)


def test_channels_are_those_of_recognition_then_the_recorded_ones(open_panel):
    assert open_panel.channels == ("tangential 1", "normal 1", "fx1", "fy1", "fz1")
    assert open_panel.channel == "tangential 1"


def test_the_channel_is_chosen_from_the_keyboard(open_panel, until):
    button = open_panel._button
    assert button.focusPolicy() == Qt.FocusPolicy.StrongFocus
    assert button.accessibleName()
    menu = button.menu()
    names = [action.text() for action in menu.actions() if action.text()]
    assert names[:5] == list(open_panel.channels)
    menu.popup(open_panel.mapToGlobal(QPoint(10, 10)))
    for _ in range(2):
        QTest.keyClick(menu, Qt.Key.Key_Down)
    QTest.keyClick(menu, Qt.Key.Key_Return)
    menu.close()
    assert open_panel.channel == "normal 1"
    until(lambda: open_panel.settled and open_panel.picture is not None)
    assert open_panel.picture.view.reader.channel == "normal 1"


def test_another_demonstration_keeps_the_channel_where_it_has_one(open_panel, document, until):
    open_panel.set_channel("normal 1")
    document.look(tone(3000))
    assert open_panel.channel == "normal 1"
    document.look(tone(3000, names=("grip",)))
    assert open_panel.channel == "grip"
    until(lambda: open_panel.settled and open_panel.picture is not None)
    assert open_panel.picture.end == pytest.approx(3.0)
    document.look(None)
    assert open_panel.channel == ""
    open_panel.grab()


def test_the_marked_scales_and_the_wavelet_are_those_of_the_paper():
    settings = preset("paper")
    np.testing.assert_allclose(scales.MARKED, settings.scales)
    assert pytest.approx(settings.mother.fourier_factor, rel=1e-12) == scales.FOURIER_FACTOR
    assert np.sqrt(2) == scales.E_FOLDING
    assert settings.parameter == scales.MORLET_P


def test_marks_stand_at_their_frequencies(open_panel, until):
    until(lambda: open_panel.settled and open_panel.picture is not None)
    for hertz in frequencies(scales.MARKED, 1000.0, Morlet()):
        at = spot(open_panel, 1.0, hertz) + QPointF(0, 1e-6)  # the first is at the very top
        assert open_panel.plot.contains(at)
        assert open_panel.readout(at).startswith(f"{hertz:.3g} Hz at 1.000 s: ")


def test_trouble_is_one_sentence_on_the_panel(open_panel, document, until):
    stray = tone(200)
    times = np.append(stray.times[:-1], 1e9)
    document.look(Demonstration("foam 2", "foam", times, stray.signals, stray.channels))
    until(lambda: open_panel.settled)
    assert "remove stray stamps" in open_panel._trouble
    open_panel.grab()
    document.look(tone())
    assert not open_panel._trouble


def test_the_theme_changes_the_colours(app, open_panel, until):
    open_panel.set_channel("normal 1")
    theme.use_theme(app, "light")
    until(lambda: open_panel.settled and open_panel.picture is not None)
    light = colour(open_panel, 0.5, 100.0).lightness()
    theme.use_theme(app, "dark")
    dark = colour(open_panel, 0.5, 100.0).lightness()
    theme.use_theme(app, "light")
    assert light > dark + 80


@pytest.mark.parametrize(
    ("value", "text"),
    [(113.2, "113"), (15.0, "15"), (2.04, "2"), (0.00344, "0.0034"), (3e-7, "3e-07")],
)
def test_the_legend_is_short(value, text):
    assert amount_text(value) == text


@pytest.mark.parametrize("at", [5_000, 150_100])  # heard when the colours are chosen, or not
def test_a_spike_without_a_colour_of_its_own_is_told_where_it_is_seen(panel, document, until, at):
    stray = tone(200_000)
    signals = stray.signals.copy()
    signals[at : at + 200, -1] = 1e7
    document.look(Demonstration("foam 3", "foam", stray.times, signals, stray.channels))
    panel.set_channel("fz1")
    panel.show()
    note = "spikes share the last colour"
    for start, noted in ((at / 1000 - 2, True), (60.0, False)):
        document.view.set_span(start, start + 4)
        until(lambda: panel.settled and panel.picture is not None)
        assert (note in panel._note) == noted


def test_glitches_that_were_left_out_are_told(panel, document, until):
    stray = tone(20_000)
    signals = stray.signals.copy()
    signals[[4000, 15_000], -1] = 1e16
    document.look(Demonstration("foam 2", "foam", stray.times, signals, stray.channels))
    panel.set_channel("fz1")
    panel.show()
    until(lambda: panel.settled and panel.picture is not None)
    assert panel._note.endswith(", 2 glitches left out")
    assert panel.picture.view.high < 3
    document.view.set_span(3.0, 6.0)
    until(lambda: panel.settled)
    assert panel._note.endswith(", 1 glitch left out")


@pytest.mark.usefixtures("long_from_little")
def test_an_exact_picture_does_not_wait_for_what_is_not_seen(panel, document, monkeypatch):
    document.look(tone(60_000))
    request = ScalogramRequest(document.demonstration, "fz1", (2.0, 4.0), 80, 400, False)
    built = []
    computing = signals.Cells.computing
    monkeypatch.setattr(signals.Cells, "computing", lambda *a: built.append(a) or computing(*a))
    for step in compute(request, None):
        if getattr(step, "picture", None) is not None and not step.picture.coarse:
            break
    assert not built
