"""The state of the Trade-off workspace: what was measured is shown, adopted and kept apart."""

import pytest
from learning_bench import TRACK
from synthetic import synthetic_set

from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.labels import Segment, Track
from forcelab.measure.recognition_runs import keeping
from forcelab.measure.recognition_settings import Variant
from forcelab.project import Project
from forcelab.recognition.presets import preset

from .conftest import PAPER, measured_of


def test_nothing_is_read_while_it_is_hidden(measuring, work, until):
    measuring.learning.set_task("stylus")
    assert work.read == []
    assert measuring.measured is None
    measuring.learning.set_task("foam")
    measuring.set_front(True)
    until(lambda: measuring.measured is not None)
    assert work.read == [("foam", "Ann")]
    assert measuring.measured is work.kept["foam"]
    assert measuring.edits == 0


def test_another_task_shows_its_own_measurement(measuring, work, until):
    measuring.set_front(True)
    until(lambda: measuring.measured is not None)
    measuring.learning.set_task("stylus")
    assert measuring.measured is None
    until(lambda: not measuring.reading)
    assert measuring.measured is None
    measuring.learning.set_task("foam")
    until(lambda: measuring.measured is not None)


def test_measuring_tells_how_far_it_is_and_shows_what_came_of_it(measuring, document, work, until):
    work.steps = [Progress(n, 3, f"{n} of 3") for n in range(3)]
    work.gate = False
    work.result = measured_of(document.project, number=2)
    measuring.set_front(True)
    until(lambda: measuring.measured is not None)
    told = []
    measuring.progressed.connect(lambda: told.append(measuring.progress))
    measuring.measure()
    measuring.measure()  # never two at once
    until(lambda: told and told[-1] == work.steps[-1])
    assert measuring.running
    assert measuring.measured.number == 1  # stays until the new one is there
    work.gate = True
    until(lambda: not measuring.running)
    assert measuring.measured.number == 2
    assert work.asked == [(document.project.path, "foam", "Ann", PAPER)]


def test_cancel_ends_the_work_and_keeps_what_is_shown(measuring, work, until):
    work.gate = False
    measuring.set_front(True)
    until(lambda: measuring.measured is not None)
    measuring.measure()
    until(lambda: work.asked)
    measuring.cancel()
    assert not measuring.running
    until(lambda: work.closed)
    assert measuring.measured.number == 1


def test_it_goes_on_while_another_workspace_is_in_front(measuring, document, work, until):
    work.gate = False
    work.result = measured_of(document.project, number=2)
    measuring.set_front(True)
    until(lambda: measuring.measured is not None)
    measuring.measure()
    measuring.set_front(False)
    measuring.learning.changed.emit()
    measuring.learning.changed.emit()
    assert measuring.running
    work.gate = True
    until(lambda: not measuring.running)
    assert measuring.measured.number == 2


def test_another_project_ends_it(measuring, document, work, until):
    work.gate = False
    measuring.set_front(True)
    measuring.measure()
    until(lambda: work.asked)
    document.close()
    assert not measuring.running
    until(lambda: work.closed)
    assert measuring.measured is None


def test_a_refusal_is_said(measuring, document, work, until):
    work.result = InputError("There is too little.")
    measuring.set_front(True)
    measuring.measure()
    until(lambda: not measuring.running)
    assert measuring.trouble == "There is too little."
    assert ("There is too little.", True) in document.told


def test_what_cannot_be_read_is_said(measuring, work, until):
    work.kept["foam"] = InputError("It is damaged; measure again.")
    measuring.set_front(True)
    until(lambda: measuring.trouble)
    assert measuring.trouble == "It is damaged; measure again."
    assert not measuring.reading


def test_edits_since_are_counted(measuring, document, until):
    measuring.set_front(True)
    until(lambda: measuring.measured is not None)
    with Project.open(document.project.path) as another:
        another.tracks.edit(document.id, "Ann", TRACK, TRACK[:1], "deleted")
    document.refresh()
    until(lambda: measuring.edits == 1)


def test_adopting_changes_what_is_trained_with_and_can_be_taken_back(measuring, document, until):
    measuring.set_front(True)
    until(lambda: measuring.measured is not None)
    own = PAPER.replace(stride=7)  # not measured, so no point leads back to it
    measuring.learning.set_settings(own)
    assert measuring.current is None
    measuring.adopt(3)
    assert measuring.current == 3
    assert measuring.learning.settings == PAPER.replace(classifier="logistic")
    assert document.told[-1] == (
        "'foam' is trained with “classifier: logistic” from now on.", False)  # fmt: skip
    assert measuring.can_go_back
    measuring.go_back()
    assert measuring.learning.settings == own
    assert not measuring.can_go_back
    measuring.adopt(0)
    measuring.learning.set_settings(PAPER.replace(stride=9))  # changed elsewhere
    assert not measuring.can_go_back


def test_adopted_settings_are_remembered_for_the_task(measuring, until):
    from forcelab.gui.review.training_preferences import recall_preset

    measuring.set_front(True)
    until(lambda: measuring.measured is not None)
    measuring.adopt(1)
    path = measuring.document.project.path
    assert recall_preset(path, "foam") == ("fast", False)
    assert recall_preset(path, "stylus") == ("paper", False)


def test_a_coder_who_is_blind_measures_on_his_own_labels_alone(measuring, document):
    document.set_author("Bo")
    assert measuring.author == "Ann"  # whoever looks at a project of others can measure at once
    assert measuring.labelled == 2
    document.project.coding.assign(document.infos[0].id, "Bo", blind=True)
    assert measuring.author == "Bo"
    assert measuring.labelled == 0


FAST = preset("paper").replace(classifier="naive-bayes", max_scale=32.0)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A project measured on the labels of Ada, with labels of Bo."""
    path = tmp_path_factory.mktemp("measured") / "study.forcelab"
    with Project.create(path) as project:
        for number, (demonstration, segments) in enumerate(synthetic_set(2, 100.0)):
            own = [Track("Bo", (Segment(0.0, 1.0, "grab"),))] if number else []
            project.demonstrations.add(demonstration, [Track("Ada", segments), *own])
    finish(keeping(path, "foam", "Ada", FAST, [Variant("classifier", "naive-bayes", FAST)]))
    return path


def latest(path, viewer, task="foam"):
    from forcelab.gui.tradeoff.measuring import BACKGROUND

    return finish(BACKGROUND.latest(path, task, viewer))


def test_the_latest_measurement_that_a_coder_may_see_is_found(study):
    assert latest(study, "Ada").place_of(FAST) == 0
    assert latest(study, "Bo").author == "Ada"
    assert latest(study, "Ada", "pen") is None
    with Project.open(study) as project:
        one = project.demonstrations.infos()[0].id
        project.coding.assign(one, "Bo", blind=True)
        assert project.coding.is_blind(one, "Bo")
    # What a model makes of hidden labels says something about them.
    assert latest(study, "Bo") is None
    assert latest(study, "Ada") is not None


def test_every_adopted_setting_can_be_taken_back_to_what_was_in_use_at_first(
    measuring, document, until
):
    measuring.set_front(True)
    until(lambda: measuring.measured is not None)
    first = measuring.learning.settings
    others = [place for place in range(4) if place != measuring.current]
    for place in others:
        measuring.adopt(place)
    for place in reversed(others[:-1]):
        measuring.go_back()
        assert measuring.current == place
    measuring.go_back()
    assert measuring.learning.settings == first
    assert not measuring.can_go_back


def test_nothing_is_shown_anew_while_it_is_hidden_though_labels_change(measuring, document, until):
    measuring.set_front(True)
    until(lambda: measuring.measured is not None)
    told = []
    measuring.changed.connect(lambda: told.append(True))
    measuring.set_front(False)
    document.refresh_listing()
    assert told == []
    measuring.set_front(True)
    assert told


def test_what_comes_for_another_coder_than_asked_is_read_as_that_one_may_see_it(
    measuring, document, work, until
):
    measuring.set_front(True)
    until(lambda: measuring.measured is not None)
    work.result, work.gate = measured_of(document.project, number=2), False
    work.steps = [None]
    measuring.measure()
    work.kept["foam"] = None  # nothing that Bo may see
    document.set_author("Bo")
    work.gate = True
    until(lambda: not measuring.running and not measuring.reading)
    assert measuring.measured is None
    assert work.read[-1] == ("foam", "Bo")
