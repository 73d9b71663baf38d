"""The scores view: every number of ``forcelab evaluate``, with intervals, sorted and copied."""

from dataclasses import replace

import pytest
from factories import demonstration_result, random_run_result, run_result
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtTest import QTest
from window_helpers import shown_widget

from forcelab.gui.review.metrics import AGREEMENT_METRICS, ERROR_METRICS
from forcelab.gui.review.scores import ScoresView
from forcelab.recognition.intervals import Intervals, score_intervals
from forcelab.recognition.metrics import METRICS, count_segments, look_up
from forcelab.recognition.results import TOO_HIGH

ACTIONS = ("grab", "hold", "release")


@pytest.fixture
def view(app, document, jobs, until):
    with shown_widget(app, ScoresView(document, jobs), (700, 320)) as view:
        ids = [info.id for info in document.infos]
        document.review.set_run(random_run_result([*ids, "c", "d"], ACTIONS))
        until(lambda: view.intervals)
        yield view


def names(view):
    return [row.name for row in view.model.rows]


def column(view, number):
    return [row.cells[number] for row in view.model.rows]


def test_every_metric_of_the_scores_is_shown_with_its_own_explanation():
    metrics = (*AGREEMENT_METRICS, *ERROR_METRICS)
    assert tuple(sorted(metric.path for metric in metrics)) == tuple(sorted(METRICS))
    assert all(metric.tip.endswith(".") for metric in metrics)


def test_numbers_are_those_of_the_run_pooled_first_raw_beside_filtered(view, document):
    run = document.review.run
    for which in (0, 1):
        view.which.setCurrentIndex(which)
        for number, metric in enumerate(view.metrics):
            for offset, stage in enumerate(("raw", "filtered")):
                records = [
                    run.scores[stage]["pooled"],
                    *(item.scores[stage] for item in run.tested),
                ]
                expected = [metric.text(look_up(record, metric.path)) for record in records]
                found = column(view, 2 * number + offset)
                assert [found[0], *found[2:]] == expected
    assert names(view)[:2] == ["pooled", "95 % interval"]


def test_how_far_probabilities_can_be_relied_on_stands_below(view, document, until):
    assert "Brier" not in view.note.text() + view.note.toolTip()  # the run kept none
    known = {"brier": 0.2614, "ece": 0.0235, "bins": []}
    document.review.set_run(replace(document.review.run, reliability=known))
    until(lambda: view.intervals)
    assert "Brier score 0.261, expected calibration error 2.4 points." in view.note.text()
    assert "0 is best" in view.note.toolTip()


def test_that_proposals_were_tested_stands_beside_the_scores(view, document, until):
    remark = f"2 of 9 tested segments (30.0 % of the tested time) were {TOO_HIGH}; report others."
    run = replace(document.review.run, remarks=("Left out in 4 groups of up to 2.", remark))
    document.review.set_run(run)
    until(lambda: view.intervals)
    assert (view.warning.text(), view.warning.isVisible()) == (remark, True)
    document.review.set_run(replace(run, remarks=run.remarks[:1]))
    assert not view.warning.isVisible()


def test_numbers_have_units_and_as_many_decimals_in_every_row(view):
    cells = {c.name: column(view, i) for i, c in enumerate(view.model.columns)}
    assert {len(cell.split(".")[1]) for cell in cells["Accuracy (%)\nfiltered"][2:]} == {1}
    assert {"." in cell for cell in cells["Boundary median (ms)\nfiltered"][2:]} == {False}
    assert {len(cell.split(".")[1]) for cell in cells["Kappa\nraw"][2:]} == {3}


def test_intervals_are_of_the_pooled_scores(view, document):
    run = document.review.run
    counts = [count_segments(d.human, d.predicted, ACTIONS) for d in run.tested]
    low, high = score_intervals(counts, run.settings.seed)["accuracy"]
    assert column(view, 1)[1] == f"{100 * low:.1f} to {100 * high:.1f}"
    assert "2,000 resamples" in view.note.text()


def test_intervals_that_the_run_holds_are_shown_as_they_are(view, document, until):
    run = random_run_result(["a", "b", "c"], ACTIONS)
    stored = Intervals({"accuracy": (0.125, 0.25)})
    for stage in ("raw", "filtered"):
        run.scores[stage]["intervals"] = stored.to_json()
    document.review.set_run(run)
    until(lambda: view.intervals)
    assert column(view, 1)[1] == "12.5 to 25.0"


def test_too_few_demonstrations_have_no_interval_and_it_says_why(view, document, until):
    document.review.set_run(random_run_result(["a", "b"], ACTIONS))
    until(lambda: view.intervals)
    assert column(view, 1)[1] == "–"
    assert "needs 3 demonstrations" in view.note.text()


def test_a_click_on_a_column_sorts_the_demonstrations_below_the_pooled(view):
    before = names(view)
    view.sort_by(1)
    values = [float(cell) for cell in column(view, 1)[2:]]
    assert values == sorted(values, reverse=True)
    assert names(view)[:2] == before[:2]
    view.sort_by(1)
    assert [float(cell) for cell in column(view, 1)[2:]] == sorted(values)
    view.sort_by(1)
    assert names(view) == before


def test_undefined_numbers_are_dashes_and_sort_last(view, document, until):
    missed = demonstration_result("none", [(0, 5, "grab")], [])
    right = demonstration_result("right", [(0, 5, "grab")], [(0, 5, "grab")])
    document.review.set_run(run_result([missed, right], ACTIONS))
    until(lambda: view.intervals)
    place = next(i for i, c in enumerate(view.model.columns) if c.name.startswith("Boundary med"))
    for _ in range(2):
        view.sort_by(place + 1)
        assert names(view)[2:] == ["foam right", "foam none"]
        assert column(view, place + 1)[-1] == "–"


def test_a_click_on_a_demonstration_opens_it_wherever_it_was_sorted_to(view, document):
    info = document.infos[1]
    for descending in (True, False):
        view.sort_by(1)
        assert view.sorting.descending is descending
        row = names(view).index(f"foam {info.id}")
        document.open_demonstration(document.infos[0].id)
        spot = view.table.visualRect(view.model.index(row, 0)).center()
        QTest.mouseClick(view.table.viewport(), Qt.MouseButton.LeftButton, pos=spot)
        assert document.id == info.id
    view.table.clicked.emit(view.model.index(0, 0))
    assert document.id == info.id  # the pooled scores open nothing


def test_the_table_is_copied_for_a_spreadsheet(view):
    view.copy_button.click()
    lines = [line.split("\t") for line in QGuiApplication.clipboard().text().splitlines()]
    assert lines[0][1] == "Accuracy (%) raw"
    assert [line[0] for line in lines[1:]] == names(view)
    assert [line[2] for line in lines[1:]] == column(view, 1)


def test_blind_demonstrations_have_no_row(view, document):
    two = document.infos[1].id
    document.project.coding.assign(two, "Ada", blind=True)
    document.refresh_listing()
    assert f"foam {two}" not in names(view)
    assert f"foam {document.infos[0].id}" in names(view)


def test_rows_come_when_the_last_blind_demonstration_is_done(view, document, until):
    id_ = document.infos[0].id
    document.project.coding.assign(id_, "Ada", blind=True)
    document.review.set_run(random_run_result([id_], ACTIONS, number=3))
    until(lambda: view.intervals)
    assert len(view.model.rows) == 2
    document.project.coding.set_done(id_, "Ada", True)
    document.refresh_listing()
    assert names(view)[2:] == [f"foam {id_}"]


def test_nothing_is_computed_while_it_is_hidden(view, document, app, jobs, until):
    view.hide()
    document.review.set_run(random_run_result(["a", "b", "c"], ACTIONS, number=2))
    app.processEvents()
    assert jobs.busy == ()
    view.show()
    until(lambda: "Run 2" in view.note.text() and view.intervals)
    assert names(view)[2:] == ["foam a", "foam b", "foam c"]


def test_without_a_run_it_says_what_to_do(view, document):
    document.review.set_run(None)
    assert view.pages.note.isVisible()
    assert "Train" in view.pages.note.text()


def test_where_nothing_could_be_tested_it_says_why_and_not_that_nothing_was_trained(view, document):
    reason = "Only one demonstration is labelled, so nothing could be tested."
    document.review.set_run(replace(document.review.run, tested=(), remarks=(reason,)))
    assert view.pages.note.text() == reason
    document.review.set_run(replace(document.review.run, remarks=()))
    assert view.pages.note.text() == "This run tested no demonstration."
