"""ROS bags in the import dialog: their fields are shown and chosen as the columns of tables are."""

import pytest

pytest.importorskip("rosbags")

from bags import WRENCH, stamp, wrenches, write
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from forcelab.gui.document import Document
from forcelab.gui.importing import ImportDialog
from forcelab.gui.jobs import Jobs
from forcelab.project import Project

POSES = "geometry_msgs/msg/PointStamped"


@pytest.fixture
def document(app, tmp_path):
    Project.create(tmp_path / "study.forcelab").close()
    document = Document("Ann")
    document.open_project(tmp_path / "study.forcelab")
    yield document
    document.close()


@pytest.mark.parametrize("ros", [1, 2])
def test_a_field_that_is_no_force_can_be_made_a_signal(document, tmp_path, until, ros):
    poses = [(i / 100, {"header": {"stamp": stamp(i / 100)}, "point": {"z": i}}) for i in range(50)]
    name = "a.bag" if ros == 1 else "a"
    bag = write(tmp_path / name, {"/ft": (WRENCH, wrenches()), "/tip": (POSES, poses)}, ros=ros)
    jobs = Jobs()
    dialog = ImportDialog(document, jobs, files=[bag])
    dialog.show()
    uses = {one.name: one.use for one in dialog.columns.uses}
    assert uses["/ft.header.stamp"] == "times"
    assert uses["/ft.wrench"] == "signal"
    assert uses["/tip.point"] == "left out"
    choices = {one.name: one.choices for one in dialog.columns.uses}
    assert choices["/tip.point"] == ("signal", "left out")
    assert "Columns of" in dialog.columns.heading.text()
    dialog.columns.wish("/tip.point", "signal")
    assert {one.name: one.use for one in dialog.columns.uses}["/tip.point"] == "signal"
    QTest.mouseClick(dialog._go, Qt.MouseButton.LeftButton)
    until(lambda: document.id, 20.0)
    names = [channel.name for channel in document.demonstration.channels]
    assert names == ["fx", "fy", "fz", "tx", "ty", "tz", "point.x", "point.y", "point.z"]
    dialog.close()
    jobs.close()
