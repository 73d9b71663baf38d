"""Raw stamps beside a demonstration."""

import numpy as np
import pytest

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.project import Project
from forcelab.project.media import STAMPS

TIMES = np.arange(10) / 10


@pytest.fixture
def opened(tmp_path):
    with Project.create(tmp_path / "lab.forcelab") as project:
        d = Demonstration("a", "t", TIMES, TIMES[:, None], (Channel("f"),))
        project.demonstrations.add(d)
        yield project, d.id


def test_stamps_come_back_as_they_were_and_may_be_replaced(opened):
    project, id_ = opened
    assert project.media.stamps(id_) is None
    for arrays in ({"arrived_0": TIMES, "devices": np.array(["ä"])}, {"ticks_0": np.arange(3)}):
        project.media.attach_stamps(id_, arrays)
        found = project.media.stamps(id_)
        assert found.keys() == arrays.keys()
        for name, array in arrays.items():
            np.testing.assert_array_equal(found[name], array)
    project.demonstrations.add(
        project.demonstrations.load(id_)
    )  # once more: what is beside it stays
    assert project.media.stamps(id_) is not None


def test_objects_are_never_kept_nor_read(opened):
    project, id_ = opened
    with pytest.raises(ValueError, match="allow_pickle"):
        project.media.attach_stamps(id_, {"x": np.array([object()])})
    home = project.path / "demonstrations" / id_
    np.savez(home / STAMPS, x=np.array([{}], dtype=object))
    with pytest.raises(InputError, match="damaged"):
        project.media.stamps(id_)


@pytest.mark.parametrize("content", [b"", b"junk", b"PK\x03\x04junk"])
def test_damaged_stamps_are_one_sentence(opened, content):
    project, id_ = opened
    (project.path / "demonstrations" / id_ / STAMPS).write_bytes(content)
    with pytest.raises(InputError, match="delete it"):
        project.media.stamps(id_)


def test_unknown_demonstrations_have_none(opened):
    project, _ = opened
    with pytest.raises(InputError, match="no demonstration"):
        project.media.stamps("0" * 32)
    with pytest.raises(InputError, match="no demonstration"):
        project.media.attach_stamps("0" * 32, {})
