"""Timeline pairs in the window: what is painted where, and where clicks and keys lead."""

from dataclasses import replace

import numpy as np
import pytest
from factories import FOAM_ACTIONS, cached_project, unscored_run_result
from PySide6.QtCore import QEvent, QObject, QPoint, QPointF, Qt
from PySide6.QtGui import QColor, QRegion
from PySide6.QtTest import QTest
from window_helpers import status_messages

from forcelab.demonstration import Channel, Demonstration
from forcelab.gui import settings, theme
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.label.swatches import style_of
from forcelab.gui.review import pairs, pairs_list
from forcelab.gui.review.pairs import TRACKS_JOB, ActionStyles, PairsView
from forcelab.gui.review.pairs_list import hit_tooltip
from forcelab.gui.review.reviewed_run import with_keys
from forcelab.label_map import MergeMap
from forcelab.labels import Interval, Segment
from forcelab.project import Project
from forcelab.project.tracks import TrackStore
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.recognition.results import DemonstrationResult
from forcelab.recognition.settings import Settings
from forcelab.review.run_result import action_styles
from forcelab.vocabulary import Vocabulary

VOCABULARY = Vocabulary().with_actions(*FOAM_ACTIONS)
#: What Ann sees, and what is predicted: wrong from 3 to 4 s, missed from 8 to 9 s, unsure in hold.
HUMAN = (Segment(1.0, 4.0, "grab"), Segment(4.0, 7.0, "hold"), Segment(7.0, 9.0, "release"))
PREDICTED = (Segment(1.0, 3.0, "grab"), Segment(3.0, 7.0, "hold"), Segment(7.0, 8.0, "release"))
UNSURE = 0.5


def certainty():
    times = np.arange(0, 10, 0.01)
    probabilities = np.zeros((len(times), 3))
    for segment in PREDICTED:
        column = FOAM_ACTIONS.index(segment.action)
        sure = UNSURE if segment.action == "hold" else 1.0
        inside = (times >= segment.start) & (times < segment.end)
        probabilities[inside, column] = sure
        probabilities[inside, (column + 1) % 3] = 1.0 - sure
    return ProbabilityTrace.from_probabilities(times, probabilities, FOAM_ACTIONS)


def reviewed(id_, name, **changes):
    stages = {"raw": (Segment(1.0, 2.0, "hold"),), "filtered": PREDICTED}
    values = {
        "human": HUMAN,
        "stages": stages,
        "probability_trace": certainty(),
        "end": 10.0,
        **changes,
    }
    return DemonstrationResult(id_, name, "foam", 0.0, values.pop("end"), **values)


def project(path):
    """Three demonstrations of 10 s that Ann and Bob have labelled."""
    with Project.create(path) as project:
        project.actions.set_vocabulary("foam", VOCABULARY)
        for number in (1, 2, 10):
            times = np.arange(100) / 10
            signals = np.sin(times + number)[:, np.newaxis]
            demonstration = Demonstration(
                f"d {number}", "foam", times, signals, (Channel("fz", "N"),)
            )
            project.demonstrations.add(demonstration)
            project.tracks.edit(demonstration.id, "Ann", (), HUMAN, "made")
            project.tracks.edit(demonstration.id, "Bob", (), HUMAN[:1], "made")


@pytest.fixture
def study(tmp_path):
    """A document of that project."""
    document = Document("Ann")
    document.open_project(cached_project(project, tmp_path / "study.forcelab"))
    yield document
    document.close()


@pytest.fixture
def shown(app, study, until):
    """Makes a view of a run, waits until it is drawn, and closes it in the end."""
    jobs, views = Jobs(), []

    def show(run=None, *, size=(1000, 500), look="light"):
        theme.use_theme(app, look)
        view = PairsView(study, jobs)
        views.append(view)
        view.resize(*size)
        view.show()
        study.review.set_run(
            run or unscored_run_result(reviewed(i.id, i.name) for i in study.infos)
        )
        settle(view)
        return view

    def settle(view):
        def done():
            layout, area = view.area.arrangement, view.area
            top = area.verticalScrollBar().value()
            rows = layout.visible(top, top + area.viewport().height())
            known = all(area.pictures.known(area.entries[row].id) is not None for row in rows)
            return known and not jobs.awaits(TRACKS_JOB)

        until(done)
        QTest.qWait(1)

    show.settle = settle
    yield show
    jobs.close()
    for view in views:
        view.close()
        view.deleteLater()
    theme.use_theme(app, "light")


def spot(view, row, time, part="human", height=0.2):
    """Where a time of a bar is, in the viewport."""
    layout = view.area.arrangement
    box = getattr(layout.boxes(row), part)
    y = layout.tops[row] + box.top() + height * box.height()
    return QPointF(layout.axis(layout.entries[row]).at(time), y)


def colour(view, row, time, part="human", height=0.2):
    """What is seen at a time of a bar."""
    image = view.area.viewport().grab().toImage()
    at = spot(view, row, time, part, height) * image.devicePixelRatio()
    return np.array(image.pixelColor(int(at.x()), int(at.y())).getRgb()[:3])


def rgb(name):
    return np.array(QColor(name).getRgb()[:3])


def click(view, point):
    button, none = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    QTest.mouseClick(view.area.viewport(), button, none, QPoint(int(point.x()), int(point.y())))


def press(view, *names):
    for name in names:
        QTest.keyClick(view.area, getattr(Qt.Key, f"Key_{name}"))


# What is painted


@pytest.mark.parametrize("look", ["light", "dark"])
def test_each_time_has_the_colour_of_its_action_and_unlabelled_time_is_light(shown, look):
    view = shown(look=look)
    for row in range(3):
        for time, action in ((2.4, "grab"), (4.5, "hold"), (7.5, "release")):
            expected = rgb(VOCABULARY[action].colour)
            assert np.abs(colour(view, row, time) - expected).max() <= 3, (row, time)
        for part, time in (("human", 0.5), ("human", 9.5), ("predicted", 8.5)):
            assert colour(view, row, time, part).min() > 190


def test_the_pairs_go_with_their_project_without_an_error(shown):
    view = shown()
    assert view.area.entries
    view.document.open_project(view.document.project.path)
    assert not view.area.entries


def test_a_prediction_is_lighter_where_it_is_less_probable(shown):
    view = shown()
    assert np.abs(colour(view, 0, 1.5, "predicted") - rgb(VOCABULARY["grab"].colour)).max() <= 3
    full = rgb(VOCABULARY["hold"].colour)
    expected = full + (255 - full) * 0.54  # of a probability of a half
    assert np.abs(colour(view, 0, 6.5, "predicted") - expected).max() <= 4
    assert np.abs(colour(view, 0, 6.5, "human") - full).max() <= 3


def test_marks_stand_only_where_both_differ_and_what_is_missed_is_thinner(shown):
    view = shown()
    mark = rgb(theme.LIGHT.trouble)

    def thickness(time):
        heights = np.linspace(0.02, 0.98, 40)
        marked = [np.abs(colour(view, 0, time, "band", h) - mark).max() < 90 for h in heights]
        return sum(marked)

    assert [thickness(time) > 0 for time in (0.5, 2.0, 5.0, 7.5, 9.5)] == [False] * 5
    assert 0 < thickness(8.5) < thickness(3.5)


@pytest.mark.parametrize("percent", [80, 130, 200])
def test_pairs_grow_with_the_text_and_a_click_still_meets_its_time(app, shown, study, percent):
    view = shown()
    try:
        theme.use_text_size(app, percent)
        shown.settle(view)
        scale = percent / 100
        assert view.area.arrangement.width == view.area.viewport().width() / scale
        image = view.area.viewport().grab().toImage()
        for time, action in ((2.4, "grab"), (4.5, "hold"), (7.5, "release")):
            point = spot(view, 0, time) * scale
            seen = image.pixelColor((point * image.devicePixelRatio()).toPoint())
            assert np.abs(np.array(seen.getRgb()[:3]) - rgb(VOCABULARY[action].colour)).max() <= 4
            click(view, point)
            assert study.review.examined.human == action
    finally:
        theme.use_text_size(app, 100)


def test_the_legend_is_in_the_order_of_the_keys(shown, study):
    results = [reviewed(i.id, i.name) for i in study.infos]
    results[0] = reviewed(study.infos[0].id, "d 1", human=(Segment(0.1, 0.4, "slip"), *HUMAN))
    study.open_demonstration(study.infos[0].id)
    study.editor.paint(0.1, 0.4, "slip")
    view = shown(unscored_run_result(results))
    assert view.legend.accessibleDescription() == "1 grab, 2 hold, 3 release, 4 slip"
    study.set_vocabulary(study.vocabulary.rebound("grab", "7"))
    assert view.legend.accessibleDescription() == "2 hold, 3 release, 4 slip, 7 grab"


def test_the_legend_tells_the_keys_that_paint(shown, study):
    study.open_demonstration(study.infos[0].id)
    view = shown()
    study.set_vocabulary(study.vocabulary.rebound("release", "8").rebound("hold", ""))
    assert view.legend.accessibleDescription() == "1 grab, 8 release, hold"
    assert {name: look.sign for name, look in view.figure()._action_styles.items()} == {
        "grab": "1", "hold": "", "release": "8"
    }  # fmt: skip


def test_an_action_kept_apart_by_its_task_has_the_key_of_that_task_alone():
    looks = Vocabulary().with_actions("grab_hard", "grab_soft", "slip_hard")
    keys_ = Vocabulary().with_actions("slip", "grab")
    actions = with_keys(looks, keys_, task="hard", apart=True)
    assert [(a.name, a.key) for a in actions] == [
        ("grab_hard", "2"), ("grab_soft", ""), ("slip_hard", "1")
    ]  # fmt: skip
    assert [a.look for a in actions] == [a.look for a in looks]


def test_a_legend_of_many_actions_leaves_room_for_the_pairs(shown, study):
    names = tuple(f"action number {i} of a long name" for i in range(24))
    human = tuple(Segment(0.4 * i, 0.4 * (i + 1), name) for i, name in enumerate(names))
    run = unscored_run_result([reviewed(study.infos[0].id, "d 1", human=human)], names)
    view = shown(run, size=(520, 400))
    assert view.legend.height() > view.height() / 2  # it could not stand there in full
    assert view.area.height() > view.height() / 3
    assert view.minimumSizeHint().height() < 200


def test_only_visible_rows_are_painted_and_none_twice(shown):
    many = unscored_run_result(reviewed(f"id {i}", f"d {i}") for i in range(200))
    view = shown(many, size=(600, 300))
    area = view.area
    page = area.viewport().height()
    rows_of_page = page / area.arrangement.row_height(0)
    first = area.pictures.painted
    assert rows_of_page - 1 <= first <= 3 * rows_of_page + 3
    area.viewport().update()
    area.verticalScrollBar().setValue(10)
    shown.settle(view)
    assert area.pictures.painted - first <= 2
    area.verticalScrollBar().setValue(area.verticalScrollBar().maximum())
    shown.settle(view)
    assert area.pictures.known("id 199") is not None
    assert area.pictures.known("id 100") is None


def test_rows_of_two_hundred_demonstrations_end_where_the_list_ends(shown):
    view = shown(
        unscored_run_result(reviewed(f"id {i}", f"d {i}") for i in range(200)), size=(600, 300)
    )
    bar, layout = view.area.verticalScrollBar(), view.area.arrangement
    assert bar.maximum() + view.area.viewport().height() == pytest.approx(layout.height, abs=1)
    assert layout.row_at(layout.height - 1) == 199
    assert layout.row_at(layout.height + 1) is None


# Where clicks and keys lead


def test_a_click_on_a_segment_examines_it(shown, study):
    view = shown()
    click(view, spot(view, 1, 5.5, "predicted", 0.5))
    entry = view.area.entries[1]
    assert study.review.examined == Interval(
        entry.id, 3.0, 7.0, "hold", "hold", pytest.approx(UNSURE, abs=0.01)
    )
    assert study.id == entry.id
    assert study.view.range == (3.0, 7.0)
    click(view, spot(view, 2, 8.8, "human", 0.5))
    assert (study.review.examined.human, study.review.examined.predicted) == ("release", "release")


def test_a_click_on_a_mark_examines_the_disagreement(shown, study):
    view = shown()
    click(view, spot(view, 0, 3.6, "band", 0.5))
    assert study.review.examined == Interval(
        view.area.entries[0].id, 3.0, 4.0, "grab", "hold", pytest.approx(UNSURE, abs=0.01)
    )
    click(view, spot(view, 0, 8.5, "band", 0.5))
    place = study.review.examined
    assert (place.start, place.end, place.human, place.predicted) == (8.0, 9.0, "release", None)
    assert place.confidence is None


def test_a_click_beside_segments_opens_there_and_examines_nothing(shown, study):
    view = shown()
    click(view, spot(view, 2, 9.5, "predicted", 0.5))
    assert study.id == view.area.entries[2].id
    assert study.view.cursor == pytest.approx(9.5, abs=0.02)
    assert study.review.examined is None
    click(view, QPointF(20, view.area.arrangement.tops[1] + 10))
    assert study.id == view.area.entries[1].id


def test_arrows_go_over_rows_and_disagreements_and_enter_goes_there(shown, study):
    view = shown()
    view.area.setFocus()
    press(view, "Down")
    assert "d 2: accuracy 75.0 %" in view.area.accessibleDescription()
    press(view, "Right")
    assert "human grab, predicted hold" in view.area.accessibleDescription()
    press(view, "Right", "Right")
    assert "human release, predicted unlabelled" in view.area.accessibleDescription()
    press(view, "Left", "Return")
    assert (study.review.examined.start, study.review.examined.end) == (3.0, 4.0)
    assert study.id == view.area.entries[1].id
    press(view, "End", "Return")
    assert study.id == view.area.entries[-1].id


def test_a_tooltip_tells_the_three_most_probable_actions_and_takes_no_name_for_markup(shown):
    run = unscored_run_result([reviewed("x", "<b>odd</b> & name")])
    view = shown(run)
    found = view.area.hit_at(spot(view, 0, 5.5, "predicted", 0.5))
    words = hit_tooltip(view.area.entries[0], found)
    assert "&lt;b&gt;odd&lt;/b&gt; &amp; name" in words
    assert "predicted: hold, 3.000" in words
    assert words.index("50 %&nbsp; hold") < words.index("0 %&nbsp; grab")


# What is shown


def test_rows_are_ordered_and_filtered(shown, study):
    wrong = {"raw": (), "filtered": ()}
    results = [reviewed(i.id, i.name) for i in study.infos]
    results[1] = reviewed(study.infos[1].id, study.infos[1].name, stages=wrong)
    results.append(reviewed("x", "longest", end=12.0))
    view = shown(unscored_run_result(results))

    def names():
        return [entry.reviewed.name for entry in view.area.entries]

    assert names() == ["d 1", "d 2", "d 10", "longest"]
    view.tools.order.setCurrentIndex(view.tools.order.findData("worst"))
    assert names()[0] == results[1].name
    view.tools.order.setCurrentIndex(view.tools.order.findData("longest"))
    assert names()[0] == "longest"
    view.tools.search.setText("FOAM D 1")
    assert set(names()) == {"d 1", "d 10"}
    view.tools.search.setText("nothing like it")
    assert "filter" in view.pages.note.text()


def test_a_search_reads_nothing_from_the_store_and_a_new_colour_is_read(shown, study, monkeypatch):
    study.open_demonstration(study.infos[0].id)
    view, read, read_styles = shown(), [], pairs.action_styles
    monkeypatch.setattr(pairs, "action_styles", lambda *of: read.append(of[1]) or read_styles(*of))
    for letters in ("d", "d 1", "d"):
        view.tools.search.setText(letters)
    assert not read
    grab = replace(study.vocabulary["grab"], colour="#123456")
    others = (action for action in study.vocabulary if action.name != "grab")
    assert study.set_vocabulary(Vocabulary((grab, *others)))
    assert read
    assert view.figure().vocabulary["grab"].colour == "#123456"


def test_an_order_that_is_chosen_is_read_from_its_top(shown, study):
    wrong = {"raw": (), "filtered": ()}
    many = [reviewed(f"{number:032x}", f"x {number}") for number in range(30)]
    many[7] = reviewed(many[7].id, "x 7", stages=wrong)
    last = reviewed(study.infos[0].id, study.infos[0].name, end=11.0)
    view = shown(unscored_run_result([*many, last]), size=(1000, 300))
    study.open_demonstration(study.infos[0].id)
    bar = view.area.verticalScrollBar()
    bar.setValue(bar.maximum())
    view.tools.order.setCurrentIndex(view.tools.order.findData("worst"))
    assert view.area.entries[0].reviewed.name == "x 7"
    assert bar.value() == 0


def test_names_stand_as_in_the_list_of_demonstrations(shown, study):
    names = ["Z", "Ü", "100% & more", "stylus 10", "stylus 9", "a"]
    rows = [reviewed(f"{number:032x}", name) for number, name in enumerate(names)]
    ordered = [entry.reviewed.name for entry in shown(unscored_run_result(rows)).area.entries]
    assert ordered == ["100% & more", "a", "stylus 9", "stylus 10", "Z", "Ü"]


def test_stretched_rows_take_the_whole_width(shown, study):
    ids = [info.id for info in study.infos]
    view = shown(unscored_run_result([reviewed(ids[0], "a"), reviewed(ids[1], "b", end=20.0)]))
    layout = view.area.arrangement
    assert layout.boxes(0).human.width() == pytest.approx(layout.boxes(1).human.width() / 2)
    view.tools.stretched.setChecked(True)
    layout = view.area.arrangement
    assert layout.boxes(0).human.width() == pytest.approx(layout.boxes(1).human.width())
    assert view.strip.isHidden()
    assert settings.flag("review/pairs/stretched")


def test_further_rows_are_those_chosen_and_are_remembered(shown, until):
    view = shown()
    titles = [action.text() for action in view.tools.menu.actions() if action.isCheckable()]
    assert titles == ["raw", "threshold", "median", "Bob"]
    for action in view.tools.menu.actions():
        if action.text() in ("raw", "Bob"):
            action.trigger()
    until(lambda: len(view.area.entries[0].lanes) == 2)
    lanes = view.area.entries[0].lanes
    assert [(lane.caption, lane.segments) for lane in lanes] == [
        ("raw", (Segment(1.0, 2.0, "hold"),)),
        ("Bob", HUMAN[:1]),
    ]
    again = shown()
    assert [lane.caption for lane in again.area.entries[0].lanes] == ["raw", "Bob"]


def test_proposals_stand_below_with_the_prediction_alone(shown, study):
    first, second, third = (reviewed(i.id, i.name) for i in study.infos)
    view = shown(unscored_run_result([second, third], proposals=(first,)))
    assert [entry.id for entry in view.area.entries] == [second.id, third.id, first.id]
    entry = view.area.entries[2]
    assert entry.pair.human is None
    assert entry.share == pytest.approx((2 + 1 + 4 * UNSURE) / 7, abs=0.01)
    assert view.area.arrangement.first_proposal == 2
    click(view, spot(view, 2, 5.5, "predicted", 0.5))
    assert (study.review.examined.demonstration, study.review.examined.human) == (first.id, None)


def test_the_heading_of_the_proposals_waits_for_no_row(shown, study, monkeypatch):
    first, second, third = (reviewed(i.id, i.name) for i in study.infos)
    area = shown(unscored_run_result([second, third], proposals=(first,))).area
    monkeypatch.setattr(pairs_list, "PAINT_BUDGET", -1.0)
    area.repaint_all()
    picture = area.viewport().grab().toImage()  # all rows but the first are skipped
    assert area.pictures.known(first.id) is None
    heading = round(area.arrangement.tops[2] - pairs_list.HEADING_HEIGHT / 2) + 5
    inks = {picture.pixel(x, heading) for x in range(picture.width())}
    assert len(inks) > 3, "letters on their ground"


def test_the_accuracy_is_that_of_the_run_until_the_track_is_edited(shown, study):
    scores = {"filtered": {"accuracy": 0.123}}
    tested = [replace(reviewed(i.id, i.name), scores=scores) for i in study.infos]
    view = shown(unscored_run_result(tested))
    assert view.area.entries[0].share == 0.123
    study.open_demonstration(view.area.entries[0].id)
    study.editor.paint(3.0, 4.0, "hold")
    entry = view.area.entries[0]
    assert entry.edited
    assert entry.share == pytest.approx(7 / 8)
    assert [(m.start, m.end) for m in entry.marks] == [(8.0, 9.0)]
    assert view.area.entries[1].share == 0.123


def test_an_edit_reads_and_paints_the_open_row_alone(shown, study, monkeypatch):
    view = shown()
    study.open_demonstration(study.infos[1].id)
    shown.settle(view)
    QTest.qWait(20)
    read, painted, track = [], view.area.pictures.painted, TrackStore.get

    def counted(project, id_, author):
        read.append(id_)
        return track(project, id_, author)

    monkeypatch.setattr(TrackStore, "get", counted)
    study.editor.erase(4.0, 7.0)
    shown.settle(view)
    assert set(read) == {study.id}
    assert view.area.pictures.painted == painted + 1
    row = [entry.id for entry in view.area.entries].index(study.id)
    assert colour(view, row, 5.5).min() > 240


def test_tracks_are_spelt_as_they_were_trained(shown, study):
    merged = Settings(merge=MergeMap({"grab": "hold"}))
    results = [reviewed(i.id, i.name, human=()) for i in study.infos]
    view = shown(unscored_run_result(results, settings=merged, apart=True))
    actions = [segment.action for segment in view.area.entries[0].human]
    assert actions == ["hold_foam", "hold_foam", "release_foam"]


# What is not shown


def test_without_a_run_it_says_what_to_do(shown, study):
    view = shown()
    study.review.set_run(None)
    assert view.pages.note.text() == (
        "Press F5 to train; human and predicted timelines then appear here in pairs."
    )
    assert not view.area.isVisible()
    study.review.set_run(unscored_run_result())
    assert "tested no demonstration" in view.pages.note.text()
    study.review.set_run(
        unscored_run_result(remarks=("Nothing could be tested: there is only still.",))
    )
    assert view.pages.note.text() == "Nothing could be tested: there is only still."


def test_what_is_coded_blind_is_left_out_and_counted(shown, study):
    study.project.coding.assign(study.infos[0].id, "Ann", blind=True)
    study.refresh_listing()
    view = shown()
    assert [entry.id for entry in view.area.entries] == [i.id for i in study.infos[1:]]
    assert view.note.text().endswith(": 1.")
    assert view.note.isVisible()
    study.project.coding.set_done(study.infos[0].id, "Ann", True)
    study.refresh_listing()
    assert len(view.area.entries) == 3
    assert not view.note.isVisible()


def test_who_looks_next_sees_nothing_that_he_codes_blind(shown, study):
    """Also where the coder changed while another workspace was in front."""
    study.project.coding.assign(study.infos[1].id, "Bob", blind=True)
    view = shown()
    assert len(view.area.entries) == 3
    view.hide()
    study.set_author("Bob")
    view.show()
    assert [entry.id for entry in view.area.entries] == [study.infos[i].id for i in (0, 2)]
    assert view.note.isVisible()
    shown.settle(view)
    assert len(view.area.entries) == 2


def test_colours_that_changed_while_it_was_hidden_are_the_new_ones(shown, study):
    view = shown()
    view.hide()
    study.open_demonstration(study.infos[0].id)
    actions = list(study.vocabulary)
    other = replace(actions[0], colour="#123456")
    assert study.set_vocabulary(Vocabulary((other, *actions[1:])))
    view.show()
    assert view._styles["grab"].colour.name() == "#123456"


def test_nothing_is_made_for_a_hidden_view(shown, study):
    view = shown()
    view.hide()
    painted = view.area.pictures.painted
    study.review.set_run(unscored_run_result([reviewed(study.infos[0].id, "d 1")]))
    QTest.qWait(10)
    assert len(view.area.entries) == 3
    view.show()
    shown.settle(view)
    assert len(view.area.entries) == 1
    assert view.area.pictures.painted > painted


# Export


def test_an_action_that_is_not_known_has_the_grey_that_it_has_on_its_track(app):
    assert ActionStyles()["unheard of"] == style_of(Vocabulary(), "unheard of")


def test_the_export_has_the_pairs_that_are_shown(shown):
    view = shown()
    view.tools.search.setText("d 1")
    figure = view.figure()
    assert [pair.name for pair in figure.pairs] == ["d 1", "d 10"]
    image = figure.image(2.0)
    for row, entry in enumerate(view.area.entries):
        assert figure.pairs[row].tracks == entry.pair.tracks
        for part in ("human", "predicted"):
            box = getattr(figure.boxes(row), part)
            for time in (0.5, 2.4, 4.5, 6.5, 8.5):
                x, y = figure.axis.at(time) * 2, (box.top() + 0.2 * box.height()) * 2
                exported = np.array(image.pixelColor(int(x), int(y)).getRgb()[:3])
                assert np.abs(exported - colour(view, row, time, part)).max() <= 4


def test_the_export_goes_on_in_the_background_and_says_when_it_is_done(
    shown, study, until, tmp_path, chosen_picture
):
    view, messages = shown(), status_messages(study)
    chosen_picture(tmp_path / "pairs.svg")
    view.export()
    until(lambda: messages)
    assert messages == [("Saved 'pairs.svg'.", False)]
    assert (tmp_path / "pairs.svg").stat().st_size > 1000
    chosen_picture(tmp_path / "none" / "pairs.svg")
    view.export()
    until(lambda: len(messages) == 2)
    assert messages[1][1]
    view.tools.search.setText("nothing like it")
    view.export()
    assert "no timeline pair" in messages[2][0]


# What was found while using it


class Painted(QObject):
    """Notes which regions are painted."""

    def __init__(self):
        super().__init__()
        self.regions = []
        self.all = QRegion()

    def eventFilter(self, _, event):  # noqa: N802
        if event.type() == QEvent.Type.Paint:
            self.regions.append(event.region().boundingRect())
            self.all += event.region()
        return False


def test_a_row_that_was_skipped_is_painted_wholly_though_a_part_of_it_is_seen_first(
    shown, until, monkeypatch
):
    view = shown(
        unscored_run_result(reviewed(f"id {i}", f"d {i}") for i in range(6)), size=(600, 420)
    )
    area = view.area
    monkeypatch.setattr(pairs_list, "PAINT_BUDGET", -1.0)
    area.repaint_all()
    area.viewport().repaint()  # all rows but the first are skipped
    assert area.pictures.known("id 2") is None
    monkeypatch.setattr(pairs_list, "PAINT_BUDGET", 60.0)
    events = Painted()
    area.viewport().installEventFilter(events)
    row = area.arrangement.row_box(2).toAlignedRect()
    area._painted(2)  # as an event does that shows a part of it
    until(lambda: any(part.contains(row) for part in events.regions))
    area.viewport().removeEventFilter(events)


def test_a_row_that_waits_to_be_painted_leaves_those_below_it(shown, monkeypatch):
    view = shown()
    monkeypatch.setattr(pairs_list, "PAINT_BUDGET", -1.0)
    for entry in view.area.entries[:2]:
        view.area.pictures.drop(entry.id)
    assert np.abs(colour(view, 2, 2.4) - rgb(VOCABULARY["grab"].colour)).max() <= 3


def test_all_rows_are_painted_however_long_it_takes_to_draw_those_that_are_known(
    shown, until, monkeypatch
):
    area = shown().area
    monkeypatch.setattr(pairs_list, "PAINT_BUDGET", -1.0)  # as on a large screen
    area.repaint_all()
    until(lambda: all(area.pictures.known(entry.id) is not None for entry in area.entries))


def test_as_many_pictures_are_kept_as_there_are_rows_in_view(shown, monkeypatch):
    area = shown().area
    monkeypatch.setattr(pairs_list, "PAINT_BUDGET", 60.0)
    monkeypatch.setattr(pairs_list, "PICTURES_KEPT", 2)  # as on a high screen
    area.repaint_all()
    area.viewport().grab()
    before = area.pictures.painted
    area.viewport().grab()
    assert len(area.entries) == 3
    assert area.pictures.painted == before, "no row is painted again"


def test_the_open_demonstration_is_in_view_whoever_opened_it(shown, study):
    view = shown(size=(600, 230))
    area, bar = view.area, view.area.verticalScrollBar()
    last = area.entries[-1]
    assert bar.maximum() > 0
    for id_ in (last.id, area.entries[0].id):
        study.review.examine(Interval(id_, 3.0, 4.0, "grab", "hold", 0.9))
        row = next(i for i, entry in enumerate(area.entries) if entry.id == id_)
        box = area.arrangement.row_box(row)
        assert box.top() >= bar.value() - 1
        assert box.bottom() <= bar.value() + area.viewport().height() + 1
        assert area.row == row


def test_only_the_open_demonstration_looks_open(shown, study):
    study.open_demonstration(study.infos[0].id)
    view = shown()
    area = view.area

    def ground(row):
        image = area.viewport().grab().toImage()
        at = QPointF(area.viewport().width() - 3, area.arrangement.row_box(row).center().y())
        return image.pixelColor((at * image.devicePixelRatio()).toPoint()).getRgb()

    opened = ground(0)
    assert opened != ground(1)
    study.open_demonstration(area.entries[1].id)
    shown.settle(view)
    assert ground(1) == opened
    assert ground(0) != opened


def test_an_action_has_the_colour_of_the_task_that_is_tested(shown, study):
    foam = study.project.actions.vocabulary("foam")
    other = Vocabulary().with_actions("hold", "push", "grab")
    study.project.actions.set_vocabulary("LEGO", other)
    both = action_styles(
        study.project, replace(unscored_run_result(), tasks=("LEGO",), test_task="foam")
    )
    assert all(both[name].look == foam[name].look for name in foam.names)
    # Its colour is taken already: it keeps it, with a texture.
    assert both["push"].colour == other["push"].colour
    assert both["push"].look != foam["hold"].look
    apart = action_styles(
        study.project, replace(unscored_run_result(), tasks=("foam", "LEGO"), apart=True)
    )
    assert apart["grab_foam"].colour == foam["grab"].colour
    assert apart["hold_LEGO"].colour == other["hold"].colour


@pytest.mark.parametrize("scrolled", [0, 24])
def test_the_first_move_of_the_cursor_takes_away_what_stood_there(shown, study, app, scrolled):
    study.open_demonstration(study.infos[0].id)
    study.view.seek(3.0)
    others = [reviewed(f"id {i}", f"e {i}") for i in range(9)]
    view = shown(unscored_run_result([reviewed(study.id, "d 1"), *others]), size=(600, 300))
    area = view.area
    area.verticalScrollBar().setValue(scrolled)
    app.processEvents()
    before = spot(view, 0, 3.0, "predicted", 0.9).toPoint() - QPoint(0, scrolled)
    events = Painted()
    area.viewport().installEventFilter(events)
    study.view.seek(7.0)
    app.processEvents()
    area.viewport().removeEventFilter(events)
    assert events.all.contains(before)


def test_what_the_share_at_the_right_is_stands_below_it(shown, study):
    view = shown()
    entry = view.area.entries[0]
    assert view.area._remark(entry) == "accuracy"
    view.tools.stretched.setChecked(True)
    assert view.area._remark(entry) == "10.0 s"
