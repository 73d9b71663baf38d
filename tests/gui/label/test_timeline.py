import pytest
from PySide6.QtWidgets import QWidget

from forcelab.gui.label.workspace import Timeline


class Part(QWidget):
    def __init__(self, height):
        super().__init__()
        self.setMinimumSize(100, height)

    def set_compact(self, _):
        pass

    def least_height(self, **_):
        return self.minimumHeight()


@pytest.fixture
def parts():
    heights = {"ruler": 20, "tracks": 50, "force": 80, "scalogram": 60, "overview": 40, "bar": 30}
    return {name: Part(height) for name, height in heights.items()}


@pytest.fixture
def timeline(app, parts):
    window = QWidget()  # the timeline itself would not become lower than what it shows
    window.resize(500, 500)
    timeline = timeline_in(window, parts)
    window.show()
    yield timeline
    window.close()


def timeline_in(window, parts):
    panels = (parts["force"], parts["scalogram"])
    timeline = Timeline(
        parts["ruler"], parts["tracks"], panels, (0, 5, 3), parts["overview"], parts["bar"]
    )
    timeline.setParent(window)
    return timeline


def seen(timeline, parts, height):
    timeline.resize(400, height)
    assert timeline.height() == height
    return "".join(name[0] for name, part in parts.items() if not part.isHidden())


def test_in_a_low_window_the_least_needed_give_way_and_come_back(timeline, parts):
    assert timeline.minimumSizeHint().height() == 100
    heights = (400, 290, 230, 100, 230, 290, 400)
    assert [seen(timeline, parts, height) for height in heights] == [
        "rtfsob", "rtfsb", "rtfb", "rtb", "rtfb", "rtfsb", "rtfsob"
    ]  # fmt: skip


def test_what_is_not_wanted_leaves_its_room_to_others(timeline, parts):
    timeline.set_shown(parts["force"], False)
    assert seen(timeline, parts, 240) == "rtsob"
    timeline.set_shown(parts["force"], True)
    assert seen(timeline, parts, 240) == "rtfb"
    timeline.set_shown(parts["tracks"], False)
    assert "t" not in seen(timeline, parts, 400)


def test_a_part_that_grows_takes_the_room_of_others(timeline, parts, until):
    assert seen(timeline, parts, 400) == "rtfsob"
    parts["tracks"].setMinimumHeight(160)
    until(parts["overview"].isHidden)
    assert seen(timeline, parts, 400) == "rtfsb"


class Rows(Part):
    """A first panel that can do with less."""

    def __init__(self):
        super().__init__(10)
        self.compact = False

    def set_compact(self, compact):
        self.compact = compact

    def least_height(self, *, compact):
        return 30 if compact else 50


def test_the_first_panel_is_slim_where_the_second_one_would_have_no_room_else(app, parts):
    rows = parts["tracks"] = Rows()
    window = QWidget()
    window.resize(500, 500)
    timeline = timeline_in(window, parts)
    window.show()
    assert timeline.minimumSizeHint().height() == 80
    shown = [(seen(timeline, parts, height), rows.compact) for height in (200, 180, 100, 200)]
    assert shown == [("rtfb", False), ("rtfb", True), ("rtb", True), ("rtfb", False)]
    window.close()
