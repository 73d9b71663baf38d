"""A document with one demonstration and a painted track, and widgets shown for a while."""

from contextlib import contextmanager

import numpy as np
from made_once import made_once

from forcelab.demonstration import Channel, Demonstration
from forcelab.gui.document import Document
from forcelab.labels import Segment, Track
from forcelab.project import NewDemonstration, Project

#: What Ada painted.
TRACK = (
    Segment(1.0, 2.0, "grab"),
    Segment(2.0, 4.5, "hold"),
    Segment(5.0, 5.25, "grab"),
    Segment(6.0, 8.0, "release"),
)


def study(path, segments, seconds):
    """A project of two demonstrations; Ada has painted on the first one."""
    times = np.arange(int(seconds * 100)) / 100
    one = Demonstration("01", "foam", times, np.sin(times)[:, None], (Channel("f", "N"),))
    two = Demonstration("02", "foam", times, np.cos(times)[:, None], (Channel("f", "N"),))
    with Project.create(path) as project:
        track = (Track("Ada", segments),) if segments else ()
        project.demonstrations.add_all([NewDemonstration(one, track), NewDemonstration(two)])


@contextmanager
def opened(folder, segments=TRACK, seconds=10.0):
    """A document in which Ada's track over ten seconds is open."""
    path = made_once(study, folder / "study.forcelab", tuple(segments), seconds)
    document = Document("Ada")
    document.told = []  # what was said in the status line
    document.message_shown.connect(lambda text, trouble: document.told.append((text, trouble)))
    document.open_project(path)
    document.open_demonstration("01")
    yield document
    document.close()


@contextmanager
def shown(app, widget, size=(320, 400)):
    """A widget on screen."""
    widget.resize(*size)
    widget.show()
    app.processEvents()
    yield widget
    widget.close()
    widget.deleteLater()
    app.processEvents()
