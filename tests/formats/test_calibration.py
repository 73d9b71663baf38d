"""Calibration files: counts to newtons, and sentences that name the line."""

import numpy as np
import pytest

from forcelab.errors import InputError
from forcelab.formats.calibration import channels_of, read_calibrations
from forcelab.formats.optoforce_packets import KINDS
from forcelab.resources import asset

AXES3, FOUR, AXES6 = KINDS
GOOD = """\
[ISE012.sensor1]
fx = { capacity = 300.0, counts = 7925 }
fy = { capacity = 300, counts = 8641 }
fz = { capacity = 2000.0, counts = [6049, 5990] }
"""


def written(tmp_path, text):
    path = tmp_path / "mine.toml"
    path.write_text(text, "utf-8")
    return path


@pytest.mark.parametrize(
    ("name", "counts", "newtons"),
    [
        ("3-axis-40N", [16_037, -16_037, 0], [40.0, -40.0, 0.0]),
        ("3-axis-2000N", [7_925, -8_641, 6_049], [300.0, -300.0, 2000.0]),
        ("3-axis-per-newton", [560, 546, -81], [1.0, 1.0, -1.0]),
    ],
)
def test_the_examples_that_are_shipped(name, counts, newtons):
    calibration = read_calibrations(asset(f"calibrations/{name}.toml")).find("X1", AXES3)
    found = calibration.apply(np.array([counts], np.int16))
    assert found[0] == pytest.approx(newtons, abs=1e-12)


def test_pulling_and_pressing_may_differ(tmp_path):
    calibration = read_calibrations(written(tmp_path, GOOD)).find("ISE012", AXES3)
    found = calibration.apply(np.array([[0, 0, 6_049], [0, 0, -5_990]], np.int16))
    assert found[:, 2] == pytest.approx([2000.0, -2000.0])
    assert calibration.apply(np.array([[-32_768, 0, 0]], np.int16))[0, 0] < -1_000


def test_a_daq_has_its_own_table_and_others_have_that_for_any(tmp_path):
    other = GOOD.replace("ISE012", "any").replace("7925", "100")
    known = read_calibrations(written(tmp_path, GOOD + other))
    counts = np.array([[100, 0, 0]], np.int16)
    assert known.find("ISE012", AXES3).apply(counts)[0, 0] == pytest.approx(300 / 79.25)
    assert known.find("ISE099", AXES3).apply(counts)[0, 0] == pytest.approx(300)
    assert known.find(None, AXES3).apply(counts)[0, 0] == pytest.approx(300)


def test_an_unknown_serial_number_names_the_file_and_the_section(tmp_path):
    path = written(tmp_path, GOOD)
    known = read_calibrations(path)
    assert known.find(None, AXES3).source == "mine.toml, [ISE012]"
    with pytest.raises(InputError) as refused:
        known.find("ISE099", AXES3)
    assert f"'{path}' has no section [ISE099.sensor1] for DAQ ISE099" in str(refused.value)


def test_without_a_serial_number_two_tables_are_a_question(tmp_path):
    known = read_calibrations(written(tmp_path, GOOD + GOOD.replace("ISE012", "ISE013")))
    with pytest.raises(InputError, match=r"calibrates ISE012, ISE013, and the recording does not"):
        known.find(None, AXES3)


@pytest.mark.parametrize(
    ("kind", "missing"), [(AXES6, r"no 'tx' in \[ISE012.sensor1\]"), (FOUR, r"\[ISE012.sensor2\]")]
)
def test_what_the_packets_need_and_the_file_lacks_is_named(tmp_path, kind, missing):
    with pytest.raises(InputError, match=missing):
        read_calibrations(written(tmp_path, GOOD)).find("ISE012", kind)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("7925", "0", "line 2: ISE012.sensor1.fx needs a counts above zero"),
        ("7925", "true", "line 2: ISE012.sensor1.fx needs a counts above zero"),
        ("7925", "nan", "line 2: ISE012.sensor1.fx needs a counts above zero"),
        ("[6049, 5990]", "[6049]", "line 4: ISE012.sensor1.fz needs a counts above zero, or two"),
        ("300, counts", "-300, counts", "line 3: ISE012.sensor1.fy needs a capacity above zero"),
        ("fy =", "force =", "line 3: ISE012.sensor1.force is no axis; they are called fx, fy"),
        ("300, counts", "300, count", "line 3: ISE012.sensor1.fy must be such as"),
        ("ISE012.sensor1", "ISE012.left", "line 1: ISE012 holds 'left'"),
        ("[ISE012.sensor1]", "", "line 2: fx holds 'capacity'"),
        ("8641 }", "8641", "is no valid TOML: "),
        (GOOD, "", "calibrates nothing"),
        (GOOD, "ISE012 = 3", "line 1: ISE012 must be a section of sensors"),
        (GOOD, "[ISE012]\nsensor1 = 3", "line 2: ISE012.sensor1 must hold axes"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(tmp_path, old, new, complaint):
    with pytest.raises(InputError) as refused:
        read_calibrations(written(tmp_path, GOOD.replace(old, new)))
    assert "mine.toml'" in str(refused.value)
    assert complaint in str(refused.value)


def test_a_file_that_cannot_be_read_is_one_sentence(tmp_path):
    with pytest.raises(InputError, match=r"none\.toml' cannot be read: No such file"):
        read_calibrations(tmp_path / "none.toml")
    (tmp_path / "wide.toml").write_bytes(GOOD.encode("utf-16"))
    with pytest.raises(InputError, match="is no text in UTF-8"):
        read_calibrations(tmp_path / "wide.toml")


def test_channels_have_units_only_when_calibrated():
    assert [str(c.unit) for c in channels_of(AXES6, calibrated=True)] == ["N"] * 3 + ["Nm"] * 3
    assert {c.unit for c in channels_of(FOUR, calibrated=False)} == {""}
    assert [c.name for c in channels_of(AXES3, calibrated=True, first=2)] == ["fx2", "fy2", "fz2"]
