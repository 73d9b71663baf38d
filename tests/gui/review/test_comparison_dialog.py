"""The dialog that compares two runs: what is offered, shown, marked and opened."""

from dataclasses import replace

import pytest
from factories import random_run_result
from PySide6.QtGui import QColor
from window_helpers import open_painted_document, run_summary

from forcelab.errors import InputError
from forcelab.gui.review.comparison_dialog import (
    ComparisonDialog,
    metric_rows,
    settings_differences,
)
from forcelab.gui.review.metrics import AGREEMENT_METRICS
from forcelab.gui.review.training_backend import Backend
from forcelab.gui.theme import colours
from forcelab.recognition.settings import Settings
from forcelab.review.run_comparison import compare_runs

ACTIONS = ("grab", "hold", "release")


@pytest.fixture(scope="module")
def document(app, tmp_path_factory):
    with open_painted_document(tmp_path_factory.mktemp("study")) as document:
        yield document


class Runs(Backend):
    """Lists and reads these runs instead of a project's."""

    def __init__(self, results):
        self.results = results

    def list_runs(self, _path):
        yield None
        runs = [run_summary(o.number, o.title, tasks=o.tasks) for o in self.results]
        return tuple(reversed(runs))

    def load(self, _path, number):
        yield None
        found = next((o for o in self.results if o.number == number), None)
        if found is None:
            raise InputError(f"There is no run {number}.")
        return found


@pytest.fixture
def runs(document):
    ids = [*(info.id for info in document.infos), "c", "d"]
    return [
        random_run_result(ids, ACTIONS, right=0.95, number=1),
        random_run_result(ids, ACTIONS, right=0.5, number=2),
        random_run_result(ids, ACTIONS, right=0.95, number=3),
    ]


@pytest.fixture
def dialog(document, jobs, runs, until, show):
    dialog = show(ComparisonDialog(document, jobs, backend=Runs(runs)))
    until(lambda: dialog.comparison is not None)
    return dialog


def row_of(dialog, name):
    return next(row for row in dialog.model.rows if row.cells[0].startswith(name))


def test_the_last_two_runs_are_compared_at_first(dialog):
    assert (dialog.first.currentData(), dialog.second.currentData()) == (2, 3)
    assert dialog.first.currentText().startswith("2: foam · ")
    assert [c.name for c in dialog.model.columns][1:3] == ["run 2", "run 3"]


def test_at_first_a_run_is_compared_with_an_older_one_of_the_same_tasks(
    document, jobs, runs, until, show
):
    runs[1] = replace(runs[1], title="stylus", tasks=("stylus",))
    dialog = show(ComparisonDialog(document, jobs, backend=Runs(runs)))
    until(lambda: dialog.comparison is not None)
    assert (dialog.first.currentData(), dialog.second.currentData()) == (1, 3)
    dialog.first.resize(120, dialog.first.height())
    assert dialog.first.shown_text.endswith("…")


def test_differences_are_signed_and_say_whether_they_are_better(dialog, runs):
    two, three = (run.scores["filtered"]["pooled"] for run in runs[1:])
    row = row_of(dialog, "Accuracy")
    assert row.cells[1:3] == (f"{100 * two['accuracy']:.1f}", f"{100 * three['accuracy']:.1f}")
    difference = 100 * (three["accuracy"] - two["accuracy"])
    assert row.cells[3] == f"better  +{difference:.1f}"
    assert QColor(row.colours[3]) == QColor(colours().range)
    low, high = row.cells[4].split(" to ")
    assert float(low) <= difference <= float(high)


def test_fewer_errors_are_better_and_the_other_way_round_worse(dialog, until):
    assert row_of(dialog, "Deletions").cells[3].startswith("better  \u2212")
    dialog.first.setCurrentIndex(0)
    dialog.second.setCurrentIndex(1)
    until(lambda: dialog.comparison is not None)
    row = row_of(dialog, "Deletions")
    assert row.cells[3].startswith("worse  +")
    assert QColor(row.colours[3]) == QColor(colours().trouble)


def test_what_may_be_chance_is_called_neither_better_nor_worse(dialog, runs):
    comparison = compare_runs(*runs[1:])
    metric = next(metric for metric in AGREEMENT_METRICS if metric.title.startswith("Accuracy"))

    def row(low, high):
        changed = replace(comparison, intervals={"filtered": {metric.path: (low, high)}})
        return metric_rows(changed, "filtered", [metric])[0]

    unsure = row(-0.049, 0.9)
    assert unsure.cells[3].startswith("no clear difference  +")
    assert QColor(unsure.colours[3]) == QColor(colours().muted)
    assert row(0.01, 0.9).cells[3].startswith("better  +")


def test_coverage_is_neither_better_nor_worse(dialog):
    assert row_of(dialog, "Coverage").colours[3] is None


def test_a_run_beside_itself_differs_in_nothing(dialog, until):
    dialog.first.setCurrentIndex(0)
    until(lambda: dialog.comparison is not None and dialog.comparison.first.number == 3)
    assert all(row.colours[3] is None for row in dialog.model.rows)
    assert row_of(dialog, "Accuracy").cells[3:] == ("0.0", "0.0 to 0.0")
    assert dialog.settings.text() == "Both runs have the same settings."


def test_settings_that_differ_are_called_as_in_the_dialog_where_they_are_chosen(dialog, runs):
    plain = Settings(decoder="semi-markov")
    changed = plain.replace(changes=True, classifier="extra-trees", preset="best")
    comparison = compare_runs(
        replace(runs[0], settings=plain), replace(runs[1], settings=changed, author="Ben")
    )
    text = settings_differences(comparison)
    assert "Learn where actions change: no → yes" in text
    assert "Classifier: Multilayer perceptron → Extra trees" in text
    assert "Preset: paper → best" in text
    assert "Labels of:" in text


def test_the_chosen_metric_is_shown_for_each_demonstration(dialog, document, runs):
    number = [row.cells[0] for row in dialog.model.rows].index("Edit (%)")
    dialog.table.setCurrentIndex(dialog.model.index(number, 0))
    expected = [f"{100 * item.scores['filtered']['edit']:.1f}" for item in runs[1].tested]
    assert [row.cells[1] for row in dialog.each_model.rows] == expected
    dialog.each.clicked.emit(dialog.each_model.index(1, 0))
    assert document.id == document.infos[1].id


def test_blind_demonstrations_are_not_listed(dialog, document):
    two = document.infos[1].id
    document.project.coding.assign(two, "Ada", blind=True)
    dialog.stage.setCurrentIndex(1)
    assert f"foam {two}" not in [row.cells[0] for row in dialog.each_model.rows]
    assert len(dialog.each_model.rows) == 3
    document.project.coding.unassign(two, "Ada")


def test_one_run_is_not_enough(document, jobs, runs, until):
    dialog = ComparisonDialog(document, jobs, backend=Runs(runs[:1]))
    until(lambda: "Two runs are needed" in dialog.settings.text())
    dialog.close()


def test_a_run_that_cannot_be_read_is_told(document, jobs, runs, until):
    dialog = ComparisonDialog(document, jobs, backend=Runs(runs))
    until(lambda: dialog.first.count() == 3)
    dialog.first.setItemData(2, 9)
    dialog.first.setCurrentIndex(2)
    until(lambda: dialog.settings.text() == "There is no run 9.")
    dialog.close()
