from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.demonstration import Channel
from forcelab.errors import InputError
from forcelab.signals.channels import channel_map


def named(*names):
    return [Channel(name) for name in names]


SIX = named("fx1", "fy1", "fz1", "fx2", "fy2", "fz2")
FOUR = ("tangential 1", "tangential 2", "normal 1", "normal 2")


def test_two_sensors_give_tangential_magnitudes_then_signed_normals():
    signals = np.array([[3.0, 4.0, -5.0, -6.0, 8.0, 9.0], [0.0, -1.0, 2.0, 5.0, 12.0, -0.5]])
    four = channel_map(SIX)
    assert four.names == FOUR
    expected = [[5.0, 1.0], [10.0, 13.0], [-5.0, 2.0], [9.0, -0.5]]
    np.testing.assert_allclose(four.apply(signals), expected, rtol=1e-15)


@pytest.mark.parametrize(
    ("names", "sensors"),
    [
        ("fx1 fy1 fz1 fx2 fy2 fz2", ("1", "2")),
        ("FX1 FY1 FZ1 FX2 FY2 FZ2", ("1", "2")),
        ("Fx_left Fy_left Fz_left Fx_right Fy_right Fz_right", ("left", "right")),
        ("fx-L fy-L fz-L fx-R fy-R fz-R", ("l", "r")),
        ("force_x_1 force_y_1 force_z_1 force_x_2 force_y_2 force_z_2", ("1", "2")),
        ("f.x.1 f.y.1 f.z.1 f.x.2 f.y.2 f.z.2", ("1", "2")),
        ("fx1 fx2 fy1 fy2 fz1 fz2", ("1", "2")),
        ("fz1 fy1 fx1 fx2 fy2 fz2", ("1", "2")),
        ("fx fy fz fx2 fy2 fz2", ("", "2")),
    ],
)
def test_sensors_are_known_by_many_spellings_in_any_order(names, sensors):
    names = names.split()
    found = channel_map(named(*names))
    expected = [f"{kind} {s}".strip() for kind in ("tangential", "normal") for s in sensors]
    assert list(found.names) == expected
    signals = np.arange(6.0)[np.newaxis] + 1
    values = dict(zip(found.names, found.apply(signals)[:, 0], strict=True))
    for place, sensor in enumerate(sensors):
        own = [i for i, name in enumerate(names) if name.lower().endswith(sensor)]
        own = own[:3] if sensor == "" else own
        at = {next(c for c in names[i].lower() if c in "xyz"): i for i in own}
        assert values[f"normal {sensor}".strip()] == signals[0, at["z"]]
        assert values[expected[place]] == np.hypot(signals[0, at["x"]], signals[0, at["y"]])


def test_names_with_blanks_are_known_too():
    names = [f"force {axis} {sensor}" for sensor in (1, 2) for axis in "xyz"]
    assert channel_map(named(*names)).names == FOUR
    assert channel_map(named(" Force X", "Force Y ", "Force Z")).names == ("tangential", "normal")


def test_the_number_of_a_force_plate_may_stand_before_the_axis():
    """As in C3D files; a recogniser that was trained on such columns still finds them."""
    names = ("F1X", "F1Y", "F1Z", "M1X", "F2X", "F2Y", "F2Z")
    assert channel_map(named(*names)).names == (*FOUR, "M1X")
    assert channel_map(named(*names), names).names == names


@pytest.mark.parametrize("mark", [" ", "_", "."])
def test_the_sensor_may_stand_before_the_axis(mark):
    names = [f"{sensor}{mark}F{axis}" for sensor in ("left", "right") for axis in "xyz"]
    assert channel_map(named(*names)).names == (
        *("tangential left", "tangential right"),
        *("normal left", "normal right"),
    )
    # As a recogniser wants it that learnt when such columns were taken one by one.
    assert channel_map(named(*names), names).names == tuple(names)


def test_forces_are_known_in_german_too():
    names = [f"Kraft {axis}" for axis in "XYZ"]
    assert channel_map(named(*names)).names == ("tangential", "normal")
    assert channel_map(named(*names), names).names == tuple(names)


def test_three_sensors_give_three_magnitudes_then_three_normals():
    names = [f"f{axis}{sensor}" for sensor in "abc" for axis in "xyz"]
    found = channel_map(named(*names))
    assert found.names == tuple(f"{k} {s}" for k in ("tangential", "normal") for s in "abc")
    assert found.columns == ((0, 1), (3, 4), (6, 7), (2,), (5,), (8,))


@pytest.mark.parametrize(
    "names",
    [
        ("x_acc", "y_acc", "z_acc", "x_gyro", "y_gyro", "z_gyro"),
        ("fx1", "fy1", "grip"),
        ("fx", "fz"),
        ("fx1", "fy2", "fz3"),
        ("flex", "fuzzy", "fizz"),
        ("tx1", "ty1", "tz1"),
        ("tangential 1", "tangential 2", "normal 1", "normal 2"),
        ("a",),
    ],
)
def test_what_is_not_a_whole_force_sensor_is_left_as_it_is(names):
    found = channel_map(named(*names))
    assert found.names == names
    signals = np.random.default_rng(0).standard_normal((5, len(names)))
    np.testing.assert_array_equal(found.apply(signals), signals.T)


def test_other_channels_follow_the_sensors_in_their_own_order():
    found = channel_map(named("time of day", "fx1", "x_acc", "fy1", "fz1", "fx2"))
    assert found.names == ("tangential 1", "normal 1", "time of day", "x_acc", "fx2")
    assert found.columns == ((1, 3), (4,), (0,), (2,), (5,))


def test_a_second_column_for_the_same_axis_is_kept_as_a_channel_of_its_own():
    found = channel_map(named("fx1", "fy1", "fz1", "Fx_1", "FZ1"))
    assert found.names == ("tangential 1", "normal 1", "Fx_1", "FZ1")
    assert found.columns == ((0, 1), (2,), (3,), (4,))


def test_a_recorded_channel_never_hides_a_computed_one():
    found = channel_map(named("normal 1", "fx1", "fy1", "fz1"))
    assert found.names == ("tangential 1", "normal 1", "normal 1 (column 1)")
    assert found.columns == ((1, 2), (3,), (0,))


def test_only_what_is_wanted_is_computed_in_the_order_asked_for():
    found = channel_map([*SIX, Channel("temperature")], ["temperature", "normal 2"])
    assert found.names == ("temperature", "normal 2")
    assert found.recorded == (5, 6)
    np.testing.assert_array_equal(found.apply(np.array([[1.5, 20.0]])), [[20.0], [1.5]])


def test_a_channel_wanted_twice_is_refused():
    with pytest.raises(InputError, match="twice"):
        channel_map(SIX, ["normal 1", "normal 1"])


def test_a_channel_that_is_not_there_is_named_with_those_that_are():
    sentence = (
        r"no recognition channel 'fx1'; there are tangential 1, tangential 2, normal 1, normal 2"
    )
    with pytest.raises(InputError, match=sentence):
        channel_map(SIX, ["normal 1", "fx1"])


def test_lateral_forces_beyond_the_root_of_the_largest_number_do_not_overflow():
    signals = np.array([[3e300, 4e300, -1.0], [3e-300, 4e-300, 0.0]])
    tangential, _ = channel_map(SIX[:3]).apply(signals)
    np.testing.assert_allclose(tangential, [5e300, 5e-300], rtol=1e-15)


@given(
    st.lists(
        st.from_regex(r"(f|force)[ _]?[xyz][ _]?[12]?|[a-d]{1,2}", fullmatch=True),
        min_size=1,
        max_size=12,
        unique=True,
    )
)
def test_every_recorded_channel_is_used_exactly_once(names):
    found = channel_map(named(*names))
    used = sorted(column for columns in found.columns for column in columns)
    assert used == list(range(len(names)))
    assert len(set(found.names)) == len(found.names) == len(found.columns)
