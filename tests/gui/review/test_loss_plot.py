"""The loss curves: one for each fold, on axes that show them."""

import pytest
from factories import run_result_of
from PySide6.QtTest import QTest
from window_helpers import open_training_document, training_step

from forcelab.gui.review.loss_plot import LossView, loss_curves
from forcelab.recognition.presets import preset
from forcelab.recognition.settings import Settings


@pytest.fixture
def document(app):
    with open_training_document() as document:
        yield document


@pytest.fixture
def view(document, work, trainer, show):
    work.result = run_result_of(document.project, remarks=("Something was left out.",))
    view = show(LossView(document, trainer), 500, 320)
    view.work = work
    return view


def test_each_fold_has_a_curve_and_the_final_fit_its_own():
    steps = [
        training_step(1, 2.0, 1),
        training_step(2, 1.0, 1),
        training_step(None, None, 1, phase="features"),
        training_step(1, 3.0, 2),
        training_step(2, float("nan"), 2),
        training_step(1, 0.5, 2, phase="final fit"),
    ]
    assert loss_curves(steps) == (
        (False, 1, [(1, 2.0), (2, 1.0)]),
        (False, 2, [(1, 3.0)]),
        (True, 2, [(1, 0.5)]),
    )


def test_no_epoch_is_left_out_however_fast_they_come(view, until):
    view.work.steps = [training_step(n, 1 / n) for n in range(1, 500)]
    view.trainer.train()
    until(lambda: not view.trainer.training)
    until(lambda: view.curves.curves and len(view.curves.curves[0][2]) == 499)


def test_the_axis_is_logarithmic_where_losses_span_decades(view):
    view.curves.show_curves(((False, 1, [(1, 2.0), (2, 1.0)]),))
    assert not view.curves.logarithmic
    view.curves.show_curves(((False, 1, [(1, 2.0), (2, 0.01)]),))
    assert view.curves.logarithmic
    view.curves.show_curves(((False, 1, [(1, 2.0), (2, 0.0)]),))
    assert not view.curves.logarithmic  # a zero has no place on such an axis


def test_the_pointer_reads_the_nearest_loss(view):
    view.curves.show_curves(((False, 1, [(1, 2.0), (9, 1.0)]), (True, 1, [(1, 1.5), (9, 0.2)])))
    for epoch, loss, said in (
        (9, 1.0, "fold 1, epoch 9: loss 1"),
        (9, 0.2, "final fit, epoch 9: loss 0.2"),
    ):
        QTest.mouseMove(view.curves.viewport(), view.curves.spot(epoch, loss).toPoint())
        assert view.curves.readout(view.curves.spot(epoch, loss)) == said
    assert view.curves.readout(view.curves.spot(6, 1.9)) == ""


@pytest.mark.parametrize(
    "points",
    [[(1, 0.5)], [(1, 0.0), (2, 0.0)], [(1, 1e-9), (400, 1e9)], [(1, -2.0), (2, -1.0)]],
)
def test_whatever_the_losses_are_they_are_drawn(view, points):
    view.curves.show_curves(((False, 1, points),))
    empty = view.curves.grab().toImage()
    view.curves.show_curves(())
    assert view.curves.grab().toImage() != empty


def test_time_and_remarks_of_the_run_stand_beneath(view, until):
    assert not view.times.isVisible()
    view.trainer.train()
    until(lambda: not view.trainer.training)
    assert "features 0.25 s" in view.times.text()
    assert "fit 3.5 s (1.8 s a fold)" in view.times.text()  # 3.5 s over two folds
    assert view.remarks.text() == "Something was left out."


def test_a_classifier_without_a_loss_says_so(view):
    view.trainer.set_settings(Settings())
    assert "has none" not in view.curves.empty_text()
    view.trainer.set_settings(preset("ensemble"))
    assert "has none" not in view.curves.empty_text()
    view.trainer.set_settings(Settings(classifier="naive-bayes"))
    assert "has none" in view.curves.empty_text()


def test_nothing_is_drawn_while_hidden(view, until):
    view.hide()
    view.trainer.train()
    until(lambda: not view.trainer.training)
    assert view.curves.curves == ()
    view.show()
    assert view.curves.curves


def test_what_a_run_says_of_labels_that_are_hidden_is_hidden(view, until):
    document = view.document
    view.trainer.train()
    until(lambda: not view.trainer.training)
    assert view.remarks.text() == "Something was left out."
    labelled = document.review.run.tested[0].id
    document.project.coding.assign(labelled, "Bob", blind=True)
    document.set_author("Bob")
    assert not view.remarks.text()
    document.project.coding.set_done(labelled, "Bob", True)
    document.refresh_listing()
    assert view.remarks.text() == "Something was left out."
