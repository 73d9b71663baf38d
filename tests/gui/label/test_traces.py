from functools import cache
from itertools import combinations

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QContextMenuEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu
from window_helpers import pixels, shown_widget

from forcelab.demonstration import Channel, Demonstration
from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.jobs import Jobs
from forcelab.gui.kit.traces import curve_ink
from forcelab.gui.label import traces
from forcelab.gui.label.lanes import number_format
from forcelab.gui.label.traces import ChannelTrace, ForcePanel
from forcelab.gui.theme import DARK, LIGHT, colours
from forcelab.signals.minmax import Envelope

NAMES = ("fx1", "fy1", "fz1", "fx2", "fy2", "temperature")
CHANNELS = tuple(Channel(name, "°C" if name == "temperature" else "N") for name in NAMES)


@cache
def recording(n=20_000, rate=1000.0, seed=0):
    random = np.random.default_rng(seed)
    signals = random.standard_normal((n, len(NAMES))) * 0.1 + np.arange(len(NAMES))
    return Demonstration("one", "foam", np.arange(n) / rate, signals, CHANNELS)


def show(document, demonstration, id_="one"):
    document.view.demonstration, document.editor.demonstration = demonstration, id_
    document.view.start, document.view.end = document.view.bounds
    document.demonstration_changed.emit()


@pytest.fixture
def document(app):
    return Document("Ann")


@pytest.fixture
def panel(document, jobs):
    panel = ForcePanel(document, jobs)
    panel.resize(700, 360)
    show(document, recording())
    panel.show()
    yield panel
    panel.close()
    panel.deleteLater()


def picture(widget):
    return pixels(widget.grab().toImage())


def ink(image, colour, box):
    """The pixels of a colour, fully covered, inside left, top, right, bottom."""
    left, top, right, bottom = (round(edge) for edge in box)
    part = image[top:bottom, left:right].astype(int)
    return (np.abs(part - np.array(QColor(colour).getRgb()[:3])).max(axis=2) <= 3).nonzero()


def lane_of(panel, name):
    i = panel.source.names.index(name)
    return next((lane, axis) for lane, axis in panel.axes if i in lane.channels)


def test_every_channel_is_drawn_where_its_values_are(panel):
    for name in NAMES:
        image = picture(panel)
        lane, axis = lane_of(panel, name)
        column = panel.source.names.index(name)
        rows, _ = ink(image, colours().curves[column], (100, lane.top, 690, lane.bottom))
        assert rows.size > 200
        values = panel.document.demonstration.signals[:, column]
        assert axis.start <= values.min()
        assert axis.end >= values.max()
        assert lane.top + rows.min() == pytest.approx(axis.at(values.max()), abs=2.5)
        assert lane.top + rows.max() == pytest.approx(axis.at(values.min()), abs=2.5)


def many_channels(count, unit="N"):
    """A recording of sensors with three axes, each channel of another range."""
    signals = np.random.default_rng(0).standard_normal((1000, count)) * (1.0 + 7 * np.arange(count))
    channels = tuple(Channel(f"f{'xyz'[i % 3]}{i // 3}", unit) for i in range(count))
    return Demonstration("many", "foam", np.arange(1000) / 1000.0, signals, channels)


def test_in_lanes_lower_than_a_number_no_numbers_cover_the_curves(panel):
    show(panel.document, many_channels(81), "many")
    panel.document.view.seek(0.1)
    at, beside = round(panel.x_at(0.1)), slice(round(panel.x_at(0.1)) + 4, 600)
    with_cursor = picture(panel)
    panel.document.view.seek(0.99)
    assert not np.array_equal(picture(panel)[:, at], with_cursor[:, at])
    assert np.array_equal(picture(panel)[:, beside], with_cursor[:, beside])


def test_a_long_unit_leaves_the_names_to_be_read(panel):
    show(panel.document, many_channels(3, "newtons of the left sensor"), "many")
    panel.source.set_overlaid(True)
    picture(panel)
    boxes = [box for *_, box in panel._lane_axes[0].texts({"fx0": 1.0})]
    assert len(boxes) > 3
    assert not any(a.intersects(b) for a, b in combinations(boxes, 2))


def test_numbers_are_those_of_the_curve_beside_them_when_another_channel_is_hidden(panel):
    show(panel.document, many_channels(18), "many")
    picture(panel)
    panel.source.set_shown("fx0", False)
    hidden = picture(panel)
    fresh = ForcePanel(panel.document, Jobs())
    fresh.source.set_shown("fx0", False)
    with shown_widget(QApplication.instance(), fresh, (panel.width(), panel.height())):
        assert np.array_equal(picture(fresh), hidden)


def test_a_single_sample_is_seen_however_far_one_zooms_out(panel):
    demonstration = recording(80_000)
    signals = np.zeros(demonstration.signals.shape)
    signals[12_345, 2] = 50.0
    show(panel.document, Demonstration("s", "", demonstration.times, signals, CHANNELS), "spike")
    image = picture(panel)
    _, axis = lane_of(panel, "fz1")
    x = panel.x_at(12.345)
    _, columns = ink(image, colours().curves[2], (x - 3, axis.at(45), x + 3, axis.at(5)))
    assert columns.size > 20


@pytest.mark.parametrize("n", [20_000, 300_000])
def test_a_glitch_leaves_the_curve_as_it_is_and_is_marked_at_the_edge(panel, jobs, until, n):
    plain = recording(n)
    show(panel.document, plain, "plain")
    until(lambda: not jobs.awaits("force envelopes"))
    panel.invalidate()
    picture(panel)
    _, before = lane_of(panel, "fz1")
    signals = np.array(plain.signals)
    at = n // 4
    signals[at, 2], signals[2 * at : 2 * at + 2, 2] = 1e16, -3e17
    show(panel.document, Demonstration("g", "", plain.times, signals, CHANNELS), "glitch")
    until(lambda: not jobs.awaits("force envelopes"))
    for autoscale in (False, True):
        panel.source.set_autoscale(autoscale)
        panel.invalidate()
        image = picture(panel)
        lane, axis = lane_of(panel, "fz1")
        assert (axis.start, axis.end) == pytest.approx((before.start, before.end), abs=0.05)
        rows, _ = ink(image, colours().curves[2], (100, lane.top, 690, lane.bottom))
        assert rows.max() - rows.min() > 0.8 * lane.height
        up, down = panel.x_at(plain.times[at]), panel.x_at(plain.times[2 * at])
        red = colours().trouble
        assert ink(image, red, (up - 5, lane.top, up + 5, lane.top + 8))[0].size > 5
        assert ink(image, red, (down - 5, lane.bottom - 8, down + 5, lane.bottom))[0].size > 5
    assert panel.source.values_at(plain.times[at])["fz1"] == 1e16


def test_glitches_in_view_are_told(panel, monkeypatch):
    shown = []
    monkeypatch.setattr("forcelab.gui.label.traces.paint_notes", lambda *a, **_: shown.append(a[2]))
    signals = np.array(recording().signals)
    signals[[5000, 7000], 2] = 1e16
    demonstration = Demonstration("g", "", recording().times, signals, CHANNELS)
    show(panel.document, demonstration, "glitch")
    for span, words in (((0, 20), "2 samples are"), ((4, 6), "1 sample is"), ((8, 9), "")):
        panel.document.view.set_span(*span)
        picture(panel)
        notes = [note for note in shown[-1] if "glitch" in note]
        assert [note.startswith(words) for note in notes] == [True] * bool(words)


def test_no_line_runs_across_a_gap_and_the_gap_is_hatched(panel):
    times = np.concatenate([np.arange(0, 4, 1e-3), np.arange(6, 10, 1e-3)])
    signals = np.sin(times)[:, np.newaxis] * np.ones(len(NAMES))
    show(panel.document, Demonstration("gap", "", times, signals, CHANNELS), "gap")
    image = picture(panel)
    left, right = panel.x_at(4.01), panel.x_at(5.99)
    for column in range(len(NAMES)):
        rows, _ = ink(image, colours().curves[column], (left + 2, 0, right - 2, 360))
        assert rows.size == 0
    gap = image[5:355, round(left) + 3 : round(right) - 3].reshape(-1, 3)
    assert len(np.unique(gap, axis=0)) > 2  # more than a ground
    # Close up, with fewer samples than pixels, it is no different.
    panel.document.view.set_span(3.9, 6.1)
    left, right = panel.x_at(4.0), panel.x_at(5.999)
    rows, _ = ink(picture(panel), colours().curves[0], (left + 2, 0, right - 2, 360))
    assert rows.size == 0


def test_the_value_at_the_cursor_is_that_of_the_last_sample_at_or_before_it(panel):
    signals = panel.document.demonstration.signals
    at = panel.source.values_at
    assert at(1.0)["fx1"] == signals[1000, 0]
    assert at(1.0009)["fz1"] == signals[1000, 2]
    assert at(-0.1)["fx1"] is None
    assert at(19.9995)["fx1"] == signals[-1, 0]
    assert at(20.1)["fx1"] is None


def test_there_is_no_value_in_a_gap_or_where_a_sample_is_missing(panel):
    times = np.concatenate([np.arange(0, 4, 1e-3), np.arange(6, 10, 1e-3)])
    signals = np.ones((len(times), len(NAMES)))
    signals[100, 1] = np.nan
    show(panel.document, Demonstration("gap", "", times, signals, CHANNELS), "gap")
    at = panel.source.values_at
    assert at(0.1) == {name: None if name == "fy1" else 1.0 for name in NAMES}
    assert at(3.9995)["fx1"] == 1.0
    assert at(5.0)["fx1"] is None
    assert at(6.0)["fx1"] == 1.0


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_names_and_values_in_their_curves_colours_can_be_read(theme):
    for column in range(len(theme.curves)):
        for ground in (theme.panel, theme.background):
            assert text.contrast(curve_ink(column, theme), QColor(ground)) >= 4.5


def test_moving_the_cursor_changes_the_values_but_draws_no_curve_anew(panel, monkeypatch):
    before = picture(panel)
    monkeypatch.setattr(panel, "paint_content", lambda *_: pytest.fail("drawn anew"))
    monkeypatch.setattr(ChannelTrace, "extremes", lambda *_: pytest.fail("drawn anew"))
    panel.document.view.seek(7.0)
    after = picture(panel)
    assert (before[:, :60] != after[:, :60]).any()


def test_a_hidden_channel_is_neither_read_nor_searched(panel, monkeypatch):
    touched = []
    read, search = Envelope.read, traces.drawn_together
    monkeypatch.setattr(
        Envelope, "read", lambda self, start: touched.append(self) or read(self, start)
    )
    monkeypatch.setattr(
        traces, "drawn_together", lambda found, c: touched.extend(found) or search(found, c)
    )
    for name in ("fy1", "temperature"):
        panel.source.set_shown(name, False)
    show(panel.document, recording(seed=5), "two")
    picture(panel)
    assert panel.source.shown == ("fx1", "fz1", "fx2", "fy2")
    assert set(touched) == {panel.source.envelope(name) for name in panel.source.shown}
    with pytest.raises(KeyError):
        panel.source.envelope("fy1")
    assert "fy1" not in panel.source.values_at(1.0)
    panel.source.set_shown("fy1", True)
    assert panel.source.envelope("fy1").filled == 20_000


def test_all_hidden_says_how_to_get_them_back(panel):
    for name in NAMES:
        panel.source.set_shown(name, False)
    assert np.ptp(picture(panel)[150:210, 100:690], axis=(0, 1)).min() > 50


def test_autoscale_follows_what_is_visible(panel):
    signals = np.array(panel.document.demonstration.signals)
    signals[:10_000] *= 100
    times = panel.document.demonstration.times
    show(panel.document, Demonstration("a", "", times, signals, CHANNELS), "a")
    panel.document.view.set_span(15.0, 16.0)
    picture(panel)
    _, whole = lane_of(panel, "temperature")
    panel.source.set_autoscale(True)
    picture(panel)
    _, visible = lane_of(panel, "temperature")
    assert whole.end == signals[:, 5].max()
    assert visible.end == signals[15_000:16_001, 5].max()
    assert visible.start == signals[15_000:16_001, 5].min()


def test_overlaid_channels_share_an_axis_with_those_of_their_unit(panel):
    panel.source.set_overlaid(True)
    picture(panel)
    assert [lane.channels for lane, _ in panel.axes] == [(0, 1, 2, 3, 4), (5,)]
    assert [lane.unit for lane, _ in panel.axes] == ["N", "°C"]


def test_a_constant_channel_and_one_without_a_sample_can_be_drawn(panel):
    signals = np.tile([1e300, -1e300, 0.0, 5.0, np.nan, np.inf], (20_000, 1))
    signals[0, :2] *= -1
    times = panel.document.demonstration.times
    show(panel.document, Demonstration("odd", "", times, signals, CHANNELS), "odd")
    image = picture(panel)
    lane, _ = lane_of(panel, "fx2")
    line = image[round(lane.top) + 3 : round(lane.bottom) - 3, 105].astype(int)
    blue = QColor(colours().curves[3]).getRgb()[:3]
    nearest = np.abs(line - np.array(blue)).sum(axis=1).argmin()
    assert round(lane.top) + 3 + nearest == pytest.approx(lane.middle, abs=2)


def test_a_note_gives_way_to_the_values_at_the_cursor_in_low_lanes(panel, monkeypatch):
    places, put = {}, text.draw_text

    def noting(painter, x, y, line, **how):
        places[line.split(" ")[0]] = x
        put(painter, x, y, line, **how)

    monkeypatch.setattr(text, "draw_text", noting)
    panel.source.set_overlaid(True)
    panel.resize(600, 90)
    picture(panel)
    assert places["min/max"] > panel.plot.center().x()
    panel.document.view.seek(panel.document.view.bounds[1])
    picture(panel)
    assert places["min/max"] < panel.plot.center().x()


def test_a_note_says_that_samples_share_a_pixel(panel, monkeypatch):
    notes = []
    put = text.draw_text
    monkeypatch.setattr(
        text, "draw_text", lambda *args, **how: notes.append(args[3]) or put(*args, **how)
    )
    picture(panel)
    assert any("min/max" in note for note in notes)
    notes.clear()
    panel.document.view.set_span(1.0, 1.2)
    picture(panel)
    assert not any("min/max" in note for note in notes)


def test_choices_are_remembered_by_the_channels_names(panel, document, jobs):
    panel.source.set_shown("fy1", False)
    panel.source.set_overlaid(True)
    panel.source.set_autoscale(True)
    panel.source.save_choices()
    other = ForcePanel(document, jobs)
    assert "fy1" in other.source.shown
    other.source.restore_choices()
    assert other.source.shown == panel.source.shown
    assert (other.source.overlaid, other.source.autoscale) == (True, True)


def test_another_demonstration_keeps_the_choices(panel):
    changes = []
    panel.source.choices_changed.connect(lambda: changes.append(panel.source.shown))
    panel.source.set_shown("fx1", False)
    assert changes == [NAMES[1:]]
    show(panel.document, recording(seed=9), "other")
    assert panel.source.shown == NAMES[1:]
    panel.source.show_all()
    assert panel.source.shown == NAMES


def test_the_menu_key_offers_every_choice(panel):
    QTest.keyClick(panel, Qt.Key.Key_Menu)
    event = QContextMenuEvent(QContextMenuEvent.Reason.Keyboard, QPoint(5, 5), QPoint(5, 5))
    panel.contextMenuEvent(event)
    menu = panel.findChildren(QMenu)[-1]
    entries = {entry.text(): entry for entry in menu.actions() if entry.text()}
    assert list(entries)[: len(NAMES)] == list(NAMES)
    entries["fz1"].trigger()
    entries["One axis for each unit"].trigger()
    entries["Scale to what is visible"].trigger()
    assert "fz1" not in panel.source.shown
    assert panel.source.overlaid
    assert panel.source.autoscale
    menu.close()


def test_a_long_recording_is_shown_while_it_is_read(panel, monkeypatch):
    monkeypatch.setattr(traces, "SYNCHRONOUS_SAMPLES", 1000)
    monkeypatch.setattr(traces, "REDRAW_SECONDS", 0.0)
    grown = []
    panel.source.data_read.connect(lambda: grown.append(panel.source.read))
    show(panel.document, recording(300_000), "long")
    for _ in range(2000):
        picture(panel)
        QTest.qWait(1)
        if panel.source.read == 1.0 and grown and grown[-1] == 1.0:
            break
    assert grown[-1] == 1.0
    lane, _ = lane_of(panel, "fx1")
    _, columns = ink(picture(panel), colours().curves[0], (100, lane.top, 690, lane.bottom))
    assert columns.max() > 550


def test_a_new_video_clock_reads_nothing_again(panel):
    envelope = panel.source.envelope("fx1")
    panel.document.demonstration_changed.emit()
    assert panel.source.envelope("fx1") is envelope


def test_closing_the_demonstration_leaves_nothing_drawn(panel):
    panel.document.view.demonstration, panel.document.editor.demonstration = None, ""
    panel.document.demonstration_changed.emit()
    assert not panel.source.names
    assert panel.source.values_at(1.0) == {}
    assert (np.ptp(picture(panel), axis=(0, 1)) == 0).all()


def test_pointing_at_a_name_tells_it_in_full(panel):
    picture(panel)
    lane, _ = lane_of(panel, "temperature")
    assert panel.tooltip_at(QPointF(20, lane.middle)) == "temperature (°C)"
    assert panel.tooltip_at(QPointF(400, lane.middle)) == ""


@pytest.mark.parametrize("height", [80, 120, 400])
def test_values_stand_behind_the_names_and_at_the_cursor_only_where_names_are_long(
    panel, monkeypatch, height
):
    drawn = []
    put = text.draw_text

    def record(painter, x, y, line, **more):
        drawn.append((line, x))
        put(painter, x, y, line, **more)

    monkeypatch.setattr(text, "draw_text", record)
    panel.resize(700, height)
    panel.document.view.seek(10.0)
    picture(panel)
    signals = panel.document.demonstration.signals
    for column, name in enumerate(NAMES):
        value = number_format(signals[10_000, column], 1.0)
        assert [x for line, x in drawn if line == value], name
        at_cursor = any(x > panel.plot.left() for line, x in drawn if line == value)
        assert at_cursor == (height < 200 and name == "temperature")


@pytest.mark.parametrize("height", [80, 100, 120])
def test_in_low_lanes_what_the_gutter_says_does_not_overlap(panel, monkeypatch, height):
    boxes, put = [], text.draw_text

    def record(painter, x, y, line, *, face, align=0.0, **more):
        wide = text.width(line, face)
        if x < panel.gutter:
            box = QRectF(x - align * wide, y - 4, wide, 8)
            boxes.append((line, painter.worldTransform().mapRect(box)))
        put(painter, x, y, line, face=face, align=align, **more)

    monkeypatch.setattr(text, "draw_text", record)
    monkeypatch.setattr(text, "draw_text_upwards", lambda *_, **__: None)  # left of all of it
    panel.resize(700, height)
    panel.document.view.seek(10.0)
    picture(panel)
    assert len(boxes) >= 2 * len(NAMES) - 1
    for i, (line, box) in enumerate(boxes):
        assert box.right() <= panel.gutter, line
        assert not [other for other, earlier in boxes[:i] if box.intersects(earlier)], line


def test_a_click_moves_the_cursor_there(panel):
    x = panel.x_at(5.0)
    QTest.mouseClick(panel.viewport(), Qt.MouseButton.LeftButton, pos=QPointF(x, 50).toPoint())
    assert panel.document.view.cursor == pytest.approx(5.0, abs=panel.seconds_per_pixel)
