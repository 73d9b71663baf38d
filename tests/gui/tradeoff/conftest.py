"""A project with two tasks, a measurement made by hand, and work that takes no time."""

import time
from datetime import datetime, timezone

import pytest
from learning_bench import FakeWork, study

from forcelab.measure.rows import Row
from forcelab.project import LabelsUsed
from forcelab.recognition.presets import preset

PAPER = preset("paper")
#: Kind, setting, 1 - F1@50, CPU s to recognise and to train, ms, and how it is set.
FIGURES = (
    ("preset", "paper", 0.5, 0.8, 20.0, 40.0, PAPER),
    ("preset", "fast", 0.3, 0.2, 1.0, 10.0, preset("fast")),
    ("phase", "none", 0.6, 0.4, 9.0, 60.0, PAPER.replace(phase=False)),
    ("classifier", "logistic", 0.2, 2.0, 0.5, 5.0, PAPER.replace(classifier="logistic")),
)


def row_of(kind, setting, error, recognise, train, edges):
    further = {
        "accuracy": 1 - error / 2,
        "balanced": 0.5,
        "edit": 0.4,
        "F1@50": 1 - error,
        "boundary (ms)": edges,
        "boundary p90 (ms)": 3 * edges,
        "features (s/min)": 0.1,
        "fit (s/min)": train - 0.1,
        "predict (s/min)": 0.1,
    }
    reference = "the coder's labels"
    return Row(kind, setting, "foam", reference, error, recognise, 0.01, 2_000_000, further)


def spot_of(plot, row):
    """Where the point of a row lies, in pixels of the plot."""
    return plot._laid_out().spots[plot._index(row)]


def measured_of(project, task="foam", author="Ann", number=1, extra=()):
    """A measurement as it is read from a project."""
    from forcelab.measure.recognition_runs import Measured
    from forcelab.measure.recognition_settings import Variant
    from forcelab.measure.rows import with_front

    infos = project.demonstrations.infos(task)
    return Measured(
        number=number,
        time=datetime(2026, 3, 1, 12, tzinfo=timezone.utc),
        task=task,
        author=author,
        labels=tuple(LabelsUsed(i.id, author, project.tracks.head(i.id, author)) for i in infos),
        variants=(
            *(Variant(kind, setting, settings) for kind, setting, *_, settings in FIGURES),
            *(Variant(row.name, row.setting, PAPER.replace(stride=3)) for row in extra),
        ),
        rows=with_front([*(row_of(*figures[:-1]) for figures in FIGURES), *extra]),
    )


class FakeMeasuring:
    """The workspace's work, as told."""

    def __init__(self):
        self.asked = []
        self.read = []
        self.steps = []
        self.gate = True
        self.closed = 0
        self.result = None
        self.kept = {}

    def measure(self, path, task, author, settings):
        self.asked.append((path, task, author, settings))
        try:
            yield from self.steps
            while not self.gate:
                time.sleep(0.001)
                yield self.steps[-1] if self.steps else None
            if isinstance(self.result, Exception):
                raise self.result
            return self.result
        finally:
            self.closed += 1

    def latest(self, _path, task, viewer):
        self.read.append((task, viewer))
        yield None
        found = self.kept.get(task)
        if isinstance(found, Exception):
            raise found
        return found


@pytest.fixture
def document(app):
    with study() as document:
        document.told = []
        document.message_shown.connect(lambda text, trouble: document.told.append((text, trouble)))
        yield document


@pytest.fixture
def work(document):
    work = FakeMeasuring()
    work.kept["foam"] = measured_of(document.project)
    return work


@pytest.fixture
def jobs(app, until):
    from forcelab.gui.jobs import Jobs

    jobs = Jobs()
    yield jobs
    jobs.close()


@pytest.fixture
def measuring(document, jobs, work, until, monkeypatch):
    from forcelab.gui.review.trainer import Trainer
    from forcelab.gui.tradeoff import measuring as module

    monkeypatch.setattr("forcelab.gui.review.training_preferences.DEFAULT_PRESET", "paper")
    monkeypatch.setattr(module, "COUNTING", 20)
    learning = Trainer(document, jobs, work=FakeWork())
    until(lambda: not jobs.busy)
    measuring = module.Measuring(document, jobs, learning, work=work)
    yield measuring
    measuring.set_front(False)
    measuring.cancel()
    document.close()
