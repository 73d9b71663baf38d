"""ROS bags: forces of any message become channels on one clock, a tag beside them labels."""

import contextlib
import os
import re
import sqlite3
import struct
import tempfile
import time

import numpy as np
import pytest
from factories import read_single

pytest.importorskip("rosbags")

from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2.reader import zstd
from rosbags.typesys import Stores, get_typestore

from forcelab.errors import InputError
from forcelab.formats import identify
from forcelab.signals.channels import channel_map
from tests.formats.rosbag_files import BEGIN, WRENCH, digest, stamp, wrench, wrenches, write_bag

AXES = ["fx", "fy", "fz", "tx", "ty", "tz"]


def names(recording):
    return [channel.name for channel in recording.demonstration.channels]


def joined_remarks(recording):
    return "\n".join(recording.remarks)


def labels(recording):
    return [(round(s.start, 6), round(s.end, 6), s.action) for s in recording.tracks[0].segments]


@pytest.mark.real
def test_a_real_bag_gives_its_wrenches_and_the_phases_beside_them(real_file):
    recording = read_single(real_file("rosbag/baxter-pick-and-place.bag"))
    demonstration = recording.demonstration
    assert demonstration.times.shape == (3160,)
    assert demonstration.rate == pytest.approx(100.0, abs=0.01)
    assert demonstration.duration == pytest.approx(31.6, abs=0.01)
    sensors = ("endpoint_state", "wrench_stamped")
    assert names(recording) == [f"{axis} {sensor}" for sensor in sensors for axis in AXES]
    assert [channel.unit for channel in demonstration.channels] == (["N"] * 3 + ["Nm"] * 3) * 2
    assert demonstration.signals[0, 8] == pytest.approx(-0.25)
    assert [s.action for s in recording.tracks[0].segments] == ["0", "1", "2", "5", "3", "4", "0"]
    assert recording.tracks[0].segments[2].start == pytest.approx(5.85, abs=0.005)
    assert "joint_state.effort" in joined_remarks(recording)
    assert "normal wrench_stamped" in channel_map(demonstration.channels).names


@pytest.mark.parametrize(
    ("name", "how"),
    [
        ("a.bag", {}),
        ("a.bag", {"compression": "bz2"}),
        ("a.bag", {"compression": "lz4"}),
        ("a", {"ros": 2, "storage": "mcap"}),
        ("a", {"ros": 2, "storage": "db3"}),
    ],
)
def test_a_wrench_becomes_six_channels_at_the_times_of_its_headers(tmp_path, name, how):
    path = write_bag(tmp_path / name, {"/ft": (WRENCH, wrenches(50))}, **how)
    assert identify(path).name == "rosbag"
    recording = read_single(path, task="peg")
    demonstration = recording.demonstration
    assert (demonstration.name, demonstration.task) == ("a", "peg")
    assert names(recording) == AXES
    np.testing.assert_allclose(demonstration.times, np.arange(50) / 100, atol=1e-9)
    np.testing.assert_array_equal(demonstration.signals[:, 0], np.arange(50))
    assert recording.remarks == ("Channels were read from /ft.wrench.",)


def test_a_ros_2_bag_is_read_by_its_folder_its_metadata_or_its_data(tmp_path):
    path = write_bag(tmp_path / "run 7", {"/ft": (WRENCH, wrenches())}, ros=2)
    (data,) = path.glob("*.mcap")
    by_folder, by_metadata, by_data = map(read_single, (path, path / "metadata.yaml", data))
    assert by_folder.demonstration == by_metadata.demonstration == by_data.demonstration
    assert by_folder.demonstration.name == by_metadata.demonstration.name == "run 7"
    assert by_metadata.source == "run 7"


TONGS = {
    "my_lab/msg/Tongs": (
        "std_msgs/Header header\ngeometry_msgs/Wrench left\ngeometry_msgs/Wrench right\n"
        "uint8 NONE=0\nuint8 GRAB=1\nuint8 PULL=2\nint32 RETRIES=2\nuint8 phase\nfloat32 width\n"
    )
}


def tongs(phases, width=0.0):
    return [
        (
            i / 100,
            {
                "header": {"stamp": stamp(i / 100)},
                "left": {"force": {"z": -float(i)}},
                "right": {"force": {"z": float(i)}},
                "phase": phase,
                "width": width + i,
            },
        )
        for i, phase in enumerate(phases)
    ]


def test_wrenches_in_a_custom_message_are_told_apart_and_its_constants_name_the_labels(tmp_path):
    phases = [0] * 10 + [1] * 20 + [2] * 15 + [0] * 5
    path = write_bag(tmp_path / "a.bag", {"/tongs": ("my_lab/msg/Tongs", tongs(phases))}, TONGS)
    recording = read_single(path, author="Ada")
    assert names(recording) == [f"{axis} {side}" for side in ("left", "right") for axis in AXES]
    assert recording.demonstration.signals[3, [2, 8]].tolist() == [-3.0, 3.0]
    assert recording.tracks[0].author == "Ada"
    assert labels(recording) == [(0.1, 0.3, "GRAB"), (0.3, 0.45, "PULL")]
    assert "Labels were read from /tongs.phase: GRAB, PULL." in recording.remarks
    assert "/tongs.width" in joined_remarks(recording)


def test_channels_and_labels_can_be_chosen_by_topic_field_or_name(tmp_path):
    path = write_bag(
        tmp_path / "a.bag", {"/tongs": ("my_lab/msg/Tongs", tongs([0, 1, 1, 2]))}, TONGS
    )
    right_ty = "/tongs.right.torque.y"
    recording = read_single(
        path, signals=("/tongs.width",), leave_out=("tongs.left", right_ty, "tongs.phase")
    )
    assert names(recording) == ["fx", "fy", "fz", "tx", "tz", "width"]
    assert recording.demonstration.channels[-1].unit == ""
    assert recording.demonstration.signals[:, -1].tolist() == [0, 1, 2, 3]
    assert recording.tracks == ()
    assert read_single(path, signals=("/tongs.phase",)).tracks == ()
    assert read_single(path, label="/tongs.phase").tracks[0].actions == ("GRAB", "PULL")
    for wish in ({"signals": ("/tong",)}, {"leave_out": ("nothing",)}, {"label": "/tongs.left"}):
        with pytest.raises(
            InputError, match=r"a\.bag': it has no .* called '.*'; name one of /tongs"
        ):
            read_single(path, **wish)


def test_a_tag_that_never_changes_labels_nothing_unless_it_is_asked_for(tmp_path):
    path = write_bag(tmp_path / "a.bag", {"/tongs": ("my_lab/msg/Tongs", tongs([1] * 9))}, TONGS)
    assert read_single(path).tracks == ()
    assert read_single(path, label="/tongs.phase").tracks[0].actions == ("GRAB",)


def test_a_topic_of_labels_holds_until_its_next_message(tmp_path):
    result = [(0.1, {"data": "grab"}), (0.3, {"data": "hold"}), (0.4, {"data": ""})]
    forces = [(t, wrench(t)) for t in np.arange(50) / 100]
    topics = {"/action": ("std_msgs/msg/String", result), "/ft": (WRENCH, forces)}
    recording = read_single(write_bag(tmp_path / "a.bag", topics))
    assert labels(recording) == [(0.1, 0.3, "grab"), (0.3, 0.4, "hold")]


def test_the_outermost_header_is_the_time_and_a_tag_beside_the_force_comes_first(tmp_path):
    text = "std_msgs/Header header\ngeometry_msgs/WrenchStamped held\nstring tag\n"
    messages = [
        (t, {"header": {"stamp": stamp(t)}, "held": wrench(t // 0.1, t), "tag": "ab"[int(t > 0.2)]})
        for t in np.arange(50) / 100
    ]
    topics = {
        "/action": ("std_msgs/msg/String", [(0.1, {"data": "x"}), (0.2, {"data": "y"})]),
        "/logged": ("my_lab/msg/Logged", messages),
    }
    recording = read_single(write_bag(tmp_path / "a.bag", topics, {"my_lab/msg/Logged": text}))
    np.testing.assert_allclose(recording.demonstration.times, np.arange(50) / 100, atol=1e-9)
    assert labels(recording) == [(0.0, 0.21, "a"), (0.21, 0.5, "b")]
    assert names(recording) == AXES


@pytest.mark.parametrize("absolute", [True, False])
def test_a_labels_file_beside_a_bag_is_read(tmp_path, absolute):
    path = write_bag(tmp_path / "a.bag", {"/ft": (WRENCH, wrenches(50))})
    shift = BEGIN / 1e9 if absolute else 0.0
    rows = f"{shift + 0.1},{shift + 0.3},grab\n"
    (tmp_path / "a.labels.csv").write_text(f"start,end,action\n{rows}")
    recording = read_single(path)
    assert labels(recording) == [(0.1, 0.3, "grab")]
    assert "The labels were read from a.labels.csv." in recording.remarks


@pytest.mark.parametrize(
    ("topic", "kind", "message", "channels"),
    [
        ("/left/force", "geometry_msgs/msg/Vector3Stamped", {"vector": {"z": 2}}, AXES[:3]),
        ("/wrist/torque", "geometry_msgs/msg/Vector3", {"z": 2}, AXES[3:]),
        ("/any", "geometry_msgs/msg/Wrench", {"force": {"z": 2}}, AXES),
        ("/ft_sensor/raw", "std_msgs/msg/Float64MultiArray", {"data": [0] * 6}, AXES),
        ("/force", "std_msgs/msg/Float32MultiArray", {"data": [0] * 2}, ["force 1", "force 2"]),
        ("/gripForce", "std_msgs/msg/Float64", {"data": 2.0}, ["gripForce"]),
    ],
)
def test_what_is_called_a_force_is_one(tmp_path, topic, kind, message, channels):
    messages = [(i / 100, message) for i in range(20)]
    recording = read_single(write_bag(tmp_path / "a.bag", {topic: (kind, messages)}))
    assert names(recording) == channels
    units = {"t": "Nm"}
    assert [c.unit for c in recording.demonstration.channels] == [
        units.get(c[0], "N") for c in channels
    ]


def test_numbers_that_are_no_forces_are_read_when_they_are_asked_for(tmp_path):
    imu = [(i / 100, {"linear_acceleration": {"x": i}}) for i in range(20)]
    path = write_bag(tmp_path / "a.bag", {"/imu": ("sensor_msgs/msg/Imu", imu)})
    with pytest.raises(
        InputError, match=r"a\.bag': no topic in it carries forces .*/imu.*--signal"
    ):
        read_single(path)
    recording = read_single(path, signals=("/imu.linear_acceleration",))
    assert names(recording) == [f"linear_acceleration.{axis}" for axis in "xyz"]
    assert "header.seq" not in names(read_single(path, signals=("/imu",)))


def test_several_topics_are_interpolated_at_the_times_of_the_fastest(tmp_path):
    slow = wrenches(20, rate=50.0, start=0.1)
    slow = slow[:8] + slow[14:]  # a gap of 0.14 s
    topics = {"/left/ft": (WRENCH, wrenches(100)), "/right/ft": (WRENCH, slow)}
    recording = read_single(write_bag(tmp_path / "a.bag", topics))
    assert names(recording) == [f"{axis} {side}" for side in ("left", "right") for axis in AXES]
    times, right = recording.demonstration.times, recording.demonstration.signals[:, 6]
    assert times[0] == 0.0
    assert len(times) == 100
    present = ((times > 0.099) & (times < 0.241)) | ((times > 0.379) & (times < 0.481))
    np.testing.assert_allclose(right[present], (times[present] - 0.1) * 50, atol=1e-6)
    beyond = (times < 0.079) | ((times > 0.241) & (times < 0.379)) | (times > 0.501)
    assert np.isnan(right[beyond]).all()
    assert (
        "/right/ft (50 Hz, 14 messages) was interpolated at the times of /left/ft."
        in joined_remarks(recording)
    )


def test_a_topic_whose_headers_are_of_another_clock_is_put_in_time_by_its_arrivals(tmp_path):
    other = [(t, wrench(t - 3600.0, i)) for i, t in enumerate(np.arange(30) / 100)]
    topics = {
        "/left/ft": (WRENCH, [(t, wrench(t, i)) for i, t in enumerate(np.arange(40) / 100)]),
        "/right/ft": (WRENCH, other),
    }
    recording = read_single(write_bag(tmp_path / "a.bag", topics))
    signals = recording.demonstration.signals
    np.testing.assert_allclose(signals[:30, 0], signals[:30, 6], atol=1e-4)
    assert "/right/ft: it is of another clock and was shifted by 3600 s." in recording.remarks
    with pytest.raises(InputError, match=r"a\.bag, topic /right/ft: it is of another clock"):
        read_single(tmp_path / "a.bag", strict=True)


def test_without_times_in_the_headers_those_of_arrival_are_taken(tmp_path):
    unset = [(t, {"wrench": {"force": {"x": t}}}) for t in np.arange(20) / 100]
    recording = read_single(write_bag(tmp_path / "a.bag", {"/ft": (WRENCH, unset)}))
    np.testing.assert_allclose(recording.demonstration.times, np.arange(20) / 100, atol=1e-9)
    assert "/ft: its headers hold no times" in joined_remarks(recording)
    with pytest.raises(InputError, match=r"a\.bag, topic /ft: its headers hold no times"):
        read_single(tmp_path / "a.bag", strict=True)


def test_topics_that_share_a_clock_stay_on_it_however_late_each_arrives(tmp_path):
    """As of a simulation, whose clock is not that of the computer."""
    left = [(t, wrench(t - 3600.0, i)) for i, t in enumerate(np.arange(50) / 100)]
    right = [(t + 0.2, message) for t, message in left[:40]]
    topics = {
        "/left/ft": (WRENCH, left),
        "/right/ft": (WRENCH, right),
        "/action": ("std_msgs/msg/String", [(0.1, {"data": "grab"}), (0.3, {"data": ""})]),
    }
    recording = read_single(write_bag(tmp_path / "a.bag", topics))
    signals = recording.demonstration.signals
    np.testing.assert_allclose(signals[:40, 0], signals[:40, 6], atol=1e-6)
    assert labels(recording) == [(0.1, 0.3, "grab")]
    assert "/action: it is of another clock and was shifted by -3600 s." in recording.remarks


def test_a_header_that_was_never_set_costs_its_message_and_no_digits_of_the_others(tmp_path):
    stamps = np.arange(50) * 0.001000003
    messages = [(t, wrench(t, 1.0)) for t in stamps]
    messages[7] = (stamps[7], {"wrench": {"force": {"x": 1.0}}})
    recording = read_single(write_bag(tmp_path / "a.bag", {"/ft": (WRENCH, messages)}))
    times = np.delete(stamps, 7)
    np.testing.assert_allclose(recording.demonstration.times, times, rtol=0, atol=1.1e-9)
    assert "/ft: 1 message without a usable stamp was dropped." in recording.remarks


def test_stamps_that_repeat_or_run_backwards_are_repaired_or_refused(tmp_path):
    messages = wrenches(50)
    messages[20] = (messages[20][0], wrench(0.1))
    path = write_bag(tmp_path / "a.bag", {"/ft": (WRENCH, messages)})
    recording = read_single(path)
    assert len(recording.demonstration.times) == 49
    assert "/ft: 1 message whose stamp is out of order was dropped." in recording.remarks
    with pytest.raises(InputError, match=r"a\.bag, topic /ft, message 21: 1 message whose stamp"):
        read_single(path, strict=True)
    twice = [*wrenches(50), *((t + 1, m) for t, m in wrenches(50))]
    with pytest.raises(InputError, match=r"topic /ft, message 51: time runs backwards"):
        read_single(write_bag(tmp_path / "b.bag", {"/ft": (WRENCH, twice)}))


def test_messages_that_overtook_each_other_are_in_the_order_of_their_headers(tmp_path):
    late = np.random.default_rng(1).uniform(0, 0.03, 50)
    messages = [(t + more, message) for (t, message), more in zip(wrenches(50), late, strict=True)]
    messages.sort(key=lambda item: item[0])
    path = write_bag(tmp_path / "a.bag", {"/ft": (WRENCH, messages)})
    recording = read_single(path, strict=True)
    np.testing.assert_array_equal(recording.demonstration.signals[:, 0], np.arange(50.0))
    np.testing.assert_allclose(recording.demonstration.times, np.arange(50) / 100, atol=1e-9)


def test_what_is_no_force_is_left_out_with_a_remark(tmp_path):
    topics = {
        "/joy": ("sensor_msgs/msg/Joy", [(0.1, {"axes": [1.0]})]),
        "/ft": (WRENCH, wrenches()),
    }
    recording = read_single(write_bag(tmp_path / "a.bag", topics))
    assert names(recording) == AXES
    assert "Nothing was read from /joy (sensor_msgs/Joy)." in joined_remarks(recording)


def test_a_topic_without_a_name_is_not_that_of_labels_where_there_are_none(tmp_path):
    topics = {"": ("sensor_msgs/msg/Joy", [(0.1, {"axes": [1.0]})]), "/ft": (WRENCH, wrenches())}
    recording = read_single(write_bag(tmp_path / "a", topics, ros=2))
    assert "Nothing was read from  (sensor_msgs/Joy)." in recording.remarks


def test_a_bag_of_an_older_ros_2_does_not_define_its_messages(tmp_path):
    topics = {"/ft": (WRENCH, wrenches()), "/odd": ("my_lab/msg/Odd", [(0.1, {"x": 1})])}
    path = write_bag(tmp_path / "a", topics, {"my_lab/msg/Odd": "int32 x\n"}, ros=2, storage="db3")
    (data,) = path.glob("*.db3")
    with contextlib.closing(sqlite3.connect(data)) as database:
        database.execute("DELETE FROM message_definitions")
        database.commit()
    recording = read_single(path)
    assert names(recording) == AXES
    assert "/odd (my_lab/msg/Odd, which the bag does not define)" in joined_remarks(recording)


def test_events_of_a_service_beside_forces_do_not_hide_them(tmp_path):
    """ROS 2 puts the service's definition into the bag, which the library cannot parse."""
    topics = {"/ft": (WRENCH, wrenches()), "/odd": ("my_lab/msg/Odd", [(0.1, {"x_long": 1})])}
    path = write_bag(tmp_path / "a", topics, {"my_lab/msg/Odd": "int32 x_long\n"}, ros=2)
    (data,) = path.glob("*.mcap")
    content = data.read_bytes()
    assert b"int32 x_long" in content
    data.write_bytes(content.replace(b"int32 x_long", b"int32 x\n---\n"))
    recording = read_single(data)
    assert names(recording) == AXES
    assert "/odd (my_lab/msg/Odd, which the bag does not define)" in joined_remarks(recording)


def test_messages_that_the_metadata_hides_are_told(tmp_path):
    path = write_bag(tmp_path / "a", {"/ft": (WRENCH, wrenches())}, ros=2)
    metadata = path / "metadata.yaml"
    text = metadata.read_text()
    assert text.count("offered_qos_profiles: []") == 1
    profile = "{history: 1, depth: 1, reliability: 1, durability: 2, deadline: {sec: 0, nsec: 0}, "
    profile += "lifespan: {sec: 0, nsec: 0}, liveliness: 1, liveliness_lease_duration: {sec: 0, "
    profile += "nsec: 0}, avoid_ros_namespace_conventions: false}"
    metadata.write_text(text.replace("profiles: []", f"profiles: [{profile}]"))
    with pytest.raises(InputError, match=r"/ft \(its 50 messages not found by the metadata: write"):
        read_single(path)
    (data,) = path.glob("*.mcap")
    assert names(read_single(data)) == AXES


def test_an_array_that_changes_its_length_is_refused(tmp_path):
    messages = [(i / 100, {"data": [0.0] * (4 if i == 7 else 3)}) for i in range(20)]
    path = write_bag(tmp_path / "a.bag", {"/force": ("std_msgs/msg/Float64MultiArray", messages)})
    with pytest.raises(InputError, match=r"a\.bag': message 8 of /force holds 4 .* first one 3"):
        read_single(path)


@pytest.mark.parametrize(("first", "then"), [(1, 2), (2, 1)])
def test_a_list_that_changes_its_length_is_refused(tmp_path, first, then):
    text = {"my_lab/msg/Hand": "std_msgs/Header header\ngeometry_msgs/Wrench[] fingers\n"}
    counts = [first] * 9 + [then] * 11
    messages = [
        (i / 100, {"header": {"stamp": stamp(i / 100)}, "fingers": [{}] * count})
        for i, count in enumerate(counts)
    ]
    path = write_bag(tmp_path / "a.bag", {"/hand": ("my_lab/msg/Hand", messages)}, text)
    expected = (
        f"message 10 of /hand holds {then} values in /hand.fingers, and the first one {first}"
    )
    with pytest.raises(InputError, match=expected):
        read_single(path)


def test_a_bag_that_is_cut_off_anywhere_is_refused_in_one_sentence(tmp_path):
    whole = write_bag(tmp_path / "a.bag", {"/ft": (WRENCH, wrenches(20))}).read_bytes()
    for size in range(20, len(whole), 211):
        (tmp_path / "b.bag").write_bytes(whole[:size])
        with pytest.raises(InputError, match=r"b\.bag' is not a whole ROS bag \(.*; copy it again"):
            read_single(tmp_path / "b.bag")


@pytest.mark.parametrize(("name", "how"), [("a.bag", {}), ("a", {"ros": 2})])
def test_a_damaged_bag_is_read_or_refused_and_nothing_else_happens(tmp_path, name, how):
    path = write_bag(tmp_path / name, {"/ft": (WRENCH, wrenches(20))}, **how)
    file = path if path.is_file() else next(path.glob("*.mcap"))
    whole, random = file.read_bytes(), np.random.default_rng(7)
    refused = 0
    for _ in range(40):
        data = bytearray(whole)
        place = int(random.integers(16, len(data) - 4))
        data[place : place + 4] = random.choice([b"\xff" * 4, random.bytes(4), b"\xff\x00\x00\x7f"])
        file.write_bytes(data)
        try:
            read_single(file)
        except InputError as error:
            refused += 1
            assert file.name in str(error)
            assert str(error).isprintable()
    assert refused > 8


def test_a_bag_that_was_never_closed_names_the_cure(tmp_path):
    whole = bytearray(write_bag(tmp_path / "a.bag", {"/ft": (WRENCH, wrenches(20))}).read_bytes())
    place = whole.index(b"index_pos=") + 10
    whole[place : place + 8] = bytes(8)
    (tmp_path / "a.bag").write_bytes(whole)
    with pytest.raises(InputError, match=r"not indexed.*rosbag reindex"):
        read_single(tmp_path / "a.bag")


def odd(path, text, raw, count=3):
    """A ROS 1 bag of messages of a type that is defined so."""
    with Writer1(path) as writer:
        connection = writer.add_connection("/force", ODD, msgdef=text, md5sum=digest(ODD, text))
        for number in range(count):
            writer.write(connection, BEGIN + number, raw)
    return path


ODD = "odd_msgs/msg/Odd"
EMPTY = "\n" + "=" * 80 + "\nMSG: std_msgs/Empty\n"
MANY = b"\xff\xff\xff\x7f"


@pytest.mark.parametrize(
    ("text", "raw", "why"),
    [
        ("odd_msgs/Odd[] inner\nfloat64 force", MANY, "contains? (itself|themselves)"),
        ("std_msgs/Empty[] parts\nfloat64 force" + EMPTY, MANY, "which holds nothing"),
        ("std_msgs/Empty[2147483647] parts\nfloat64 force" + EMPTY, bytes(8), "holds nothing"),
        ("string[100000000] force", bytes(8), "more than 20,000 fields"),
    ],
)
def test_a_definition_that_no_message_can_have_is_told_before_one_is_read(tmp_path, text, raw, why):
    with pytest.raises(InputError, match=why) as refusal:
        read_single(odd(tmp_path / "a.bag", text, raw))
    assert "\n" not in str(refusal.value)


def test_a_topic_of_such_messages_costs_no_other_one(tmp_path):
    path = tmp_path / "a.bag"
    store = get_typestore(Stores.ROS1_NOETIC)
    with Writer1(path) as writer:
        text = "std_msgs/Empty[] parts" + EMPTY
        odd = writer.add_connection("/odd", ODD, msgdef=text, md5sum=digest(ODD, text))
        force = writer.add_connection("/force", "std_msgs/msg/Float64", typestore=store)
        for number in range(20):
            writer.write(odd, BEGIN + number * 10**7, MANY)
            data = store.serialize_ros1(
                store.types["std_msgs/msg/Float64"](number), "std_msgs/msg/Float64"
            )
            writer.write(force, BEGIN + number * 10**7, data)
    recording = read_single(path)
    assert recording.demonstration.signals.shape == (20, 1)
    assert "a list of std_msgs/msg/Empty, which holds nothing" in joined_remarks(recording)


ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT "


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize(
    ("table", "view"),
    [
        ("messages", "i AS id, 1 AS topic_id, i AS timestamp, x'00' AS data FROM n"),
        ("schema", "max(i) AS schema_version FROM n"),
    ],
)
def test_a_view_that_never_ends_in_place_of_a_table_is_refused(tmp_path, table, view, packed):
    path = write_bag(tmp_path / "a", {"/ft": (WRENCH, wrenches(20))}, ros=2, storage="db3")
    (file,) = path.glob("*.db3")
    with contextlib.closing(sqlite3.connect(file, isolation_level=None)) as store:
        store.execute(f"ALTER TABLE {table} RENAME TO old")
        store.execute(f"CREATE VIEW {table} AS {ENDLESS}{view}")
    # By another name, or packed, it is a database as well.
    other = file.with_suffix(".zstd" if packed else ".bin")
    other.write_bytes(zstd.compress(file.read_bytes()) if packed else file.read_bytes())
    file.unlink()
    metadata = (path / "metadata.yaml").read_text().replace(file.name, other.name)
    if packed:
        metadata = re.sub("compression_format:.*", "compression_format: zstd", metadata)
        metadata = re.sub("compression_mode:.*", "compression_mode: FILE", metadata)
    (path / "metadata.yaml").write_text(metadata)
    with pytest.raises(InputError, match="its database has views"):
        read_single(path)


def test_a_pipe_among_the_files_of_a_bag_is_refused(tmp_path):
    path = write_bag(tmp_path / "a", {"/ft": (WRENCH, wrenches(20))}, ros=2)
    (file,) = path.glob("*.mcap")
    file.unlink()
    os.mkfifo(file)
    with pytest.raises(InputError, match=r"mcap' is a device or pipe; take it out"):
        read_single(path)


@pytest.mark.parametrize(
    ("more", "why"),
    [("[" * 600 + "]" * 600, "nested too deep"), ("1, " * 2**20, "more than metadata can have")],
)
def test_metadata_that_would_not_end_to_be_parsed_is_refused(tmp_path, more, why):
    path = write_bag(tmp_path / "a", {"/ft": (WRENCH, wrenches(20))}, ros=2)
    with (path / "metadata.yaml").open("a") as file:
        file.write(f"\n  more: {more}\n")
    with pytest.raises(InputError, match=why) as refusal:
        read_single(path)
    assert "definitions" not in str(refusal.value)


def test_numbers_of_messages_are_numbers(tmp_path):
    path = write_bag(tmp_path / "a", {"/ft": (WRENCH, wrenches(20))}, ros=2)
    file = path / "metadata.yaml"
    topics, rest = file.read_text().split("topics_with_message_count", 1)
    file.write_text(
        f"{topics}topics_with_message_count"
        + rest.replace("message_count: 20", "message_count: many")
    )
    with pytest.raises(InputError, match="numbers of messages that are no numbers"):
        read_single(path)


def test_more_messages_than_bytes_are_refused(tmp_path, monkeypatch):
    path = write_bag(tmp_path / "a", {"/ft": (WRENCH, wrenches(20))}, ros=2)
    file = path / "metadata.yaml"
    claimed = file.read_text().replace("message_count: 20", "message_count: 2147483648")
    file.write_text(claimed)
    with pytest.raises(InputError, match="2,147,483,648 messages in"):
        read_single(path)


def test_a_packed_file_that_would_fill_the_temporary_folder_is_refused(tmp_path, monkeypatch):
    path = write_bag(tmp_path / "a", {"/ft": (WRENCH, wrenches(20))}, ros=2)
    (file,) = path.glob("*.mcap")
    packed = file.with_name(f"{file.name}.zstd")
    metadata = (path / "metadata.yaml").read_text().replace(file.name, packed.name)
    metadata = re.sub("compression_format:.*", "compression_format: zstd", metadata)
    metadata = re.sub("compression_mode:.*", "compression_mode: FILE", metadata)
    (path / "metadata.yaml").write_text(metadata)
    packed.write_bytes(zstd.compress(file.read_bytes()))
    assert read_single(path).demonstration.times.size == 20
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    packed.write_bytes(zstd.compress(file.read_bytes() + bytes(2**27)))
    monkeypatch.setattr(tempfile, "TemporaryDirectory", None)  # nothing is unpacked there
    with pytest.raises(InputError, match=r"zstd' has .* bytes and unpacks to more than"):
        read_single(path)
    assert not list(temporary.iterdir())


def test_an_index_that_names_one_message_again_and_again_is_refused(tmp_path):
    path = write_bag(tmp_path / "a.bag", {"/ft": (WRENCH, wrenches(2))})
    whole = path.read_bytes()
    # The record of the index, and behind it where the next ones are.
    place = whole.rindex(b"op=\x04") - 8
    (length,) = struct.unpack_from("<I", whole, place)
    start = place + 4 + length
    head = whole[place:start].replace(b"count=\x02\x00\x00\x00", b"count=\x00\x93\x04\x00")
    entries = whole[start + 4 : start + 16] * 299_776
    rest = whole[start + 28 :]
    false = whole[:place] + head + struct.pack("<I", len(entries)) + entries + rest
    moved = struct.unpack_from("<Q", false, (at := false.index(b"index_pos=") + 10))[0]
    false = false[:at] + struct.pack("<Q", moved + len(entries) - 24) + false[at + 8 :]
    path.write_bytes(false)
    begin = time.monotonic()
    with pytest.raises(InputError, match="its index names 1 message 100 times"):
        read_single(path)
    assert time.monotonic() - begin < 10


def test_a_bag_under_another_name_says_what_to_call_it(tmp_path):
    path = write_bag(tmp_path / "a.bag", {"/ft": (WRENCH, wrenches())}).rename(tmp_path / "a.bin")
    with pytest.raises(
        InputError, match=r"a\.bin' is a ROS bag by its content; rename it to \*\.bag"
    ):
        read_single(path)


def test_labels_of_several_lines_become_one(tmp_path):
    result = [(0.1, {"data": " grab\nit "}), (0.3, {"data": ""})]
    topics = {"/ft": (WRENCH, wrenches()), "/action": ("std_msgs/msg/String", result)}
    assert read_single(write_bag(tmp_path / "a.bag", topics)).tracks[0].actions == ("grab it",)
