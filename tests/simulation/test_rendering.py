"""Videos of simulated demonstrations: what they show, when they show it, and how they are kept."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.clock import fit_clock
from forcelab.errors import InputError
from forcelab.labels import Segment
from forcelab.simulation.rendering import SIZE, Camera, Stage, drawn_height, render
from forcelab.simulation.scene import Motion
from tests.simulation.staged import SCENES, TAPS, staged

DOME = (0x11, 0x9D, 0xA4)
ARM = (0x3C, 0x42, 0x50)
FOAM = (0xF2, 0xC1, 0x4E)
BRICK = (0xD6, 0x3A, 0x2F)
CAP = (0x6A, 0x4C, 0x93)
SKIN = (0xE3, 0xB1, 0x8C)
SPARK = (0xFF, 0xD2, 0x1F)
STREAK = (0x0F, 0x5C, 0x73)
CAMERA = Camera(offset=-0.2, drift=40e-6, jitter=4e-4, late=3, tail=0.1, seed=5)


def near(image, rgb, distance=40):
    """Which pixels have nearly a colour, shape (height, width)."""
    away = image.astype(int) - np.array(rgb[::-1])
    return np.abs(away).max(axis=2) < distance


def picture(performance, time, size=SIZE):
    return Stage(performance, size).frame(time)


def domes(image):
    """Columns of the left dome's inner edge and of the right one's, and their middle row."""
    rows, columns = np.nonzero(near(image, DOME))
    middle = 0.5 * (columns.min() + columns.max())
    return columns[columns < middle].max(), columns[columns > middle].min(), rows.mean()


def at(motion, values, time):
    return np.interp(time, motion.times, values)


def short(task, start, end):
    """A part of a performance, its clock starting anew."""
    complete = staged(task, taps=())
    within = (complete.motion.times >= start) & (complete.motion.times < end)
    motion = complete.motion
    part = Motion(
        motion.times[within] - start,
        motion.jaws[within],
        motion.tongs[within],
        motion.body[within],
        motion.normal[within],
    )
    return replace(complete, motion=part, forces=complete.forces[within])


def frames_of(path):
    reader = cv2.VideoCapture(str(path))
    frames, seconds = [], []
    while True:
        good, frame = reader.read()
        if not good:
            return frames, seconds
        frames.append(frame)
        seconds.append(reader.get(cv2.CAP_PROP_POS_MSEC) / 1000)


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """The foam is gripped: a fast motion, filmed with many late frames."""
    performance, path = short("foam", 0.8, 2.0), tmp_path_factory.mktemp("film") / "foam.mp4"
    return performance, path, *render(performance, path, replace(CAMERA, late=12))


def test_the_gap_between_the_domes_is_that_of_the_jaws():
    performance = staged("stylus", taps=())
    motion, stage = performance.motion, Stage(performance)
    times = np.arange(1.02, 1.5, 0.06)
    edges = [domes(stage.frame(time)) for time in times]
    gaps = [right - left for left, right, _ in edges]
    true = at(motion, motion.jaws.sum(axis=1), times)
    line = np.polyfit(true, gaps, 1)
    assert np.ptp(true) > 0.015
    assert line[0] > 1700  # pixels a metre: the tongs are large enough to see
    assert np.polyval(line, true) == pytest.approx(gaps, abs=3.5)


def test_domes_climb_along_the_stylus_as_the_tongs_do():
    performance = staged("stylus", taps=())
    motion, stage = performance.motion, Stage(performance)
    # Up to the thick end, which is stretched.
    end = performance.scene.profile.end - performance.scene.profile.rim_length
    times = np.arange(2.4, 3.4, 0.05)
    times = times[at(motion, motion.tongs[:, 1], times) < 0.9 * end]
    rows = np.array([domes(stage.frame(time))[2] for time in times])
    heights = at(motion, motion.tongs[:, 1], times)
    line = np.polyfit(heights, rows, 1)
    ends = np.array([1.02, 1.4])
    gaps = [np.subtract(*domes(stage.frame(time))[1::-1]) for time in ends]
    wide = at(motion, motion.jaws.sum(axis=1), ends)
    # Heights and widths have one scale, and up is up.
    assert line[0] == pytest.approx(-np.diff(gaps)[0] / np.diff(wide)[0], rel=0.12)
    assert np.polyval(line, heights) == pytest.approx(rows, abs=2.5)


def test_only_the_jaw_that_moves_moves():
    performance = staged("foam", taps=())
    motion = performance.motion
    shifted = replace(motion, jaws=motion.jaws + np.array([0.0, 0.002]))
    before = domes(picture(performance, 0.5))
    after = domes(picture(replace(performance, motion=shifted), 0.5))
    # The view may become a little smaller to hold what moved further out.
    assert after[0] == pytest.approx(before[0], abs=2)
    assert after[1] - before[1] > 5


def test_foam_gives_way_between_the_jaws_and_swells_back():
    performance = staged("foam")
    stage = Stage(performance)

    def width(time):
        image = stage.frame(time)
        _, _, row = domes(image)
        return near(image, FOAM, 12)[round(row)].sum()

    free, held, again = width(0.8), width(2.0), width(4.4)
    motion = performance.motion
    true = 2 * performance.scene.body.half_width
    share = at(motion, motion.jaws.sum(axis=1), 2.0) / true
    assert held / free == pytest.approx(share, abs=0.08)
    assert again == pytest.approx(free, rel=0.05)


def test_a_brick_keeps_its_width_and_goes_down_when_it_is_inserted():
    stage = Stage(staged("LEGO"))

    def pixels_near(time):
        """Its lowest row, and its width just above that."""
        brick = near(stage.frame(time), BRICK, 12)
        lowest = np.nonzero(brick)[0].max()
        return lowest, brick[lowest - 3].sum()

    free, gripped, searching, inserted = (pixels_near(time) for time in (0.8, 1.49, 3.9, 4.5))
    assert gripped[1] == pytest.approx(free[1], abs=2)
    # From the tops of the studs to their feet.
    assert 8 < inserted[0] - searching[0] < 60


@pytest.mark.parametrize("turn", [0.1, -0.1])
def test_the_caps_front_turns_the_way_the_nearer_jaw_goes(turn):
    performance = staged("marker", taps=())
    motion = performance.motion

    def pixels_near(angle):
        body = motion.body + np.array([0.0, 0.0, 0.0, angle])
        image = picture(replace(performance, motion=replace(motion, body=body)), 0.5)
        stripes = near(image, CAP, 12)
        rows, columns = np.nonzero(stripes)
        row = round(np.median(rows[rows < rows.max() - 25]))
        return stripes[row, columns.min() : columns.max()].astype(float)

    def jaw(angle):
        tongs = motion.tongs + np.array([0.0, 0.0, angle])
        image = picture(replace(performance, motion=replace(motion, tongs=tongs)), 0.5)
        rows, columns = np.nonzero(near(image, ARM, 8))
        return columns[rows > rows.max() - 8].mean()  # the nearer one's foot is lower

    still, turned = pixels_near(0.0), pixels_near(turn)
    size = min(still.size, turned.size)
    inner = slice(15, size - 15)
    shifts = range(-6, 7)
    likeness = [
        np.corrcoef(still[inner], turned[15 + shift : size - 15 + shift])[0, 1] for shift in shifts
    ]
    stripes = shifts[int(np.argmax(likeness))]
    nearest = jaw(0.5 * np.pi + turn) - jaw(0.5 * np.pi - turn)
    assert stripes != 0
    assert np.sign(stripes) == np.sign(nearest) == -np.sign(turn)


def test_a_fingertip_touches_the_left_dome_at_the_tap_and_is_gone_before_and_after():
    tapped = staged("LEGO")
    with_finger, without = Stage(tapped), Stage(replace(tapped, taps=()))

    def finger(time):
        """Its skin, below the dome's middle."""
        finger_scene, scene = with_finger.frame(time), without.frame(time)
        skin = near(finger_scene, SKIN, 12) & (finger_scene != scene).any(axis=2)
        return skin[round(domes(scene)[2]) :]

    tap = TAPS[0]
    assert np.nonzero(finger(tap))[1].min() == pytest.approx(domes(without.frame(tap))[0], abs=5)
    assert np.nonzero(finger(tap + 0.1))[1].min() > domes(without.frame(tap + 0.1))[0] + 15
    # Wherever the frames fall, the first one at or after the tap has rays, and three have them.
    for phase in (0.001, 0.011, 0.032):
        frames = [with_finger.frame(tap + phase + n / 30) for n in range(-2, 5)]
        rays = [near(frame, SPARK, 25).sum() for frame in frames]
        assert [count > 0 for count in rays] == [False, False, True, True, True, False, False]
        assert rays[2] > rays[3] > rays[4]
    assert not finger(tap - 0.3).any()
    assert not finger(tap + 0.3).any()


def test_a_drag_that_moves_nothing_yet_is_seen():
    performance = staged("stylus", taps=())
    pulled = performance.forces - np.array([0.0, 4.0, 0.0, 0.0, 4.0, 0.0])
    free, strained = picture(performance, 2.0), picture(replace(performance, forces=pulled), 2.0)

    def foot(image):
        return np.nonzero(near(image, ARM, 8))[0].max()

    assert domes(strained)[:2] == pytest.approx(domes(free)[:2], abs=3)
    assert 5 <= foot(free) - foot(strained) <= 15  # the arms run ahead, upwards


def test_a_twist_that_turns_nothing_yet_is_seen():
    performance = staged("marker", taps=())
    twisted = performance.forces + np.array([4.0, 0.0, 0.0, -4.0, 0.0, 0.0])
    free, strained = picture(performance, 2.0), picture(replace(performance, forces=twisted), 2.0)

    def feet(image):
        """How much lower the right arm's foot is than the left one's."""
        rows, columns = np.nonzero(near(image, ARM, 8))
        left = columns < 0.5 * (columns.min() + columns.max())
        return rows[~left].max() - rows[left].max()

    assert abs(feet(free)) <= 1
    # The arms run ahead the way in which the tongs then turn: the right one comes nearer.
    assert feet(strained) >= 6
    assert feet(picture(performance, 2.3)) > 0


def test_a_stylus_that_gives_way_in_its_vice_rises_visibly():
    performance = staged("stylus", taps=())
    motion = performance.motion
    risen = replace(
        motion,
        body=motion.body + np.array([0.0, 0.0, 0.002, 0.0]),
        tongs=motion.tongs + np.array([0.0, 0.002, 0.0]),
    )
    before, after = (
        domes(Stage(replace(performance, motion=moved)).frame(1.5))[2] for moved in (motion, risen)
    )
    assert before - after > 8


@settings(max_examples=30, deadline=None)
@given(
    st.floats(0.008, 0.04), st.floats(0.005, 0.02), st.floats(0.0005, 0.003), st.floats(0.01, 0.1)
)
def test_drawn_heights_rise_without_jumps_and_are_true_below_the_rim(end, taper, rim, beyond):
    profile = replace(SCENES["stylus"].profile, end=end, taper=taper, rim_length=rim)
    heights = np.linspace(-0.02, end + taper + beyond, 4000)
    slopes = np.diff(drawn_height(heights, profile)) / np.diff(heights)
    assert slopes.min() > 0
    assert slopes.max() < 20
    shaft = heights[heights < end - 1.1 * rim]
    assert drawn_height(shaft, profile) == pytest.approx(shaft, abs=1e-12)
    # What takes the domes longest is seen best.
    climb = np.array([end - rim, end - 0.4 * rim])
    assert np.diff(drawn_height(climb, profile))[0] > 6 * np.diff(climb)[0]


def test_streaks_are_drawn_only_while_the_domes_slide():
    performance = staged("stylus", taps=())
    motion, stage = performance.motion, Stage(performance)

    def streaks(time):
        return near(stage.frame(time), STREAK, 8).sum()

    sliding = [3.0, 3.1, 3.2]
    assert (at(motion, np.gradient(motion.tongs[:, 1], motion.times), sliding) > 0.02).all()
    assert min(streaks(time) for time in sliding) > 15
    # Open, gripping, held, and free again.
    assert max(streaks(time) for time in (0.5, 1.45, 2.0, 4.6)) == 0


def leaning(image):
    """How much lower the right end of a brick's lower edge is than the left one, pixels a pixel."""
    brick = near(image, BRICK, 12)
    columns = np.nonzero(brick.sum(axis=0) > 12)[0]
    inner = columns[len(columns) // 4 : -len(columns) // 8]
    lowest = [np.nonzero(brick[:, column])[0].max() for column in inner]
    return np.polyfit(inner, lowest, 1)[0]


def test_a_brick_leans_while_it_feels_for_its_place_and_is_upright_elsewhere():
    performance = staged("LEGO", taps=())
    motion = performance.motion

    def lean(off, height):
        body = np.tile([0.0, 0.12 + off, height, 0.0], (motion.times.size, 1))
        moved = replace(motion, body=body, tongs=body[:, 1:])
        return leaning(picture(replace(performance, motion=moved), 1.5))

    beside = [lean(off, 0.0) for off in (-0.006, -0.003, 0.003)]
    assert np.sign(beside).tolist() == [-1, -1, 1]
    assert (np.abs(np.degrees(np.arctan(beside))) > 4).all()
    assert (np.abs(np.degrees(np.arctan(beside))) < 9).all()
    assert [lean(*place) for place in ((-0.003, 0.004), (0.0, -0.0022), (-0.12, 0.0))] == (
        pytest.approx([0, 0, 0], abs=0.02)
    )


@pytest.mark.parametrize("task", SCENES)
def test_the_picture_does_not_tell_the_action(task):
    performance = staged(task)
    renamed = tuple(Segment(s.start, s.end, "nameless") for s in performance.actions)
    other = replace(performance, actions=renamed)
    assert np.array_equal(picture(performance, 1.4), picture(other, 1.4))


def test_before_the_start_and_after_the_end_everything_rests():
    performance = staged("foam", taps=())
    stage, end = Stage(performance), performance.motion.times[-1]
    assert np.array_equal(stage.frame(-0.4), stage.frame(0.0))
    assert np.array_equal(stage.frame(end + 0.4), stage.frame(end))


@pytest.mark.parametrize("task", SCENES)
def test_the_domes_stay_in_the_picture(task):
    performance = staged(task, taps=())
    stage = Stage(performance)
    for segment in performance.actions:
        pixels_near = near(stage.frame(segment.end), DOME)
        assert pixels_near.sum() > 20
        assert not pixels_near[0].any()
        assert not pixels_near[:, [0, -1]].any()


def test_a_picture_comes_in_the_size_that_is_asked_for():
    performance = staged("marker", taps=())
    large, small = picture(performance, 1.5, (960, 540)), picture(performance, 1.5, (320, 180))
    assert large.shape == (540, 960, 3)
    assert near(large, DOME).sum() > 5 * near(small, DOME).sum()


def test_the_video_opens_with_all_its_frames(film):
    _, path, force, _ = film
    frames, seconds = frames_of(path)
    assert len(frames) == force.size
    assert {frame.shape for frame in frames} == {(360, 640, 3)}
    assert seconds == pytest.approx(np.arange(force.size) / 30, abs=1e-3)
    # From 0.2 s before the recording to 0.1 s after its end.
    assert len(frames) / 30 == pytest.approx(0.2 + 1.2 + 0.1, abs=1 / 30)


def test_frames_show_the_instant_that_the_truth_says(film):
    performance, path, force, late = film
    frames, _ = frames_of(path)
    stage = Stage(performance)
    nominal = CAMERA.clock.to_force(np.arange(force.size) / 30)
    different = 0
    for number in late:
        true = stage.frame(force[number]).astype(int)
        early = stage.frame(nominal[number]).astype(int)
        if (np.abs(true - early).max(axis=2) > 60).sum() < 250:
            continue  # nothing moved meanwhile
        different += 1
        frame = frames[number]
        assert np.abs(frame - true).mean() < np.abs(frame - early).mean(), number
    assert different >= 3


def test_late_frames_are_late_and_the_others_follow_the_clock():
    force, late = CAMERA.shots(600.0)
    video = np.arange(force.size) / 30
    delay = force - CAMERA.clock.to_force(video)
    assert late.size == 3
    assert (delay[late] > 0.25 / 30).all()
    others = np.delete(delay, late)
    assert np.abs(others).max() < 1.1e-3
    assert others.std() == pytest.approx(4e-4, rel=0.05)
    # Who knows the late frames finds offset and rate again.
    fitted = fit_clock(np.delete(video, late), np.delete(force, late)).clock
    assert fitted.offset == pytest.approx(-0.2, abs=1e-4)
    assert fitted.rate - 1 == pytest.approx(40e-6, abs=1e-6)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32), st.floats(0.7, 12.0))
def test_a_camera_that_was_drawn_starts_near_the_recording_and_time_only_rises(seed, duration):
    camera = Camera.drawn(np.random.default_rng(seed))
    assert camera == Camera.drawn(np.random.default_rng(seed))
    force, late = camera.shots(duration)
    assert (np.diff(force) > 0).all()
    assert abs(force[0]) < 0.45
    assert 10e-6 < abs(camera.clock.rate - 1) < 100e-6
    assert late.size >= 2
    # The camera sees the end of the recording.
    assert force[-1] > duration - 1.1 / 30


def test_the_same_camera_gives_the_same_bytes(film, tmp_path):
    performance, path, *_ = film
    again = tmp_path / "again.mp4"
    render(performance, again, replace(CAMERA, late=12))
    assert again.read_bytes() == path.read_bytes()


def test_a_full_disk_is_one_sentence(tmp_path, capfd):
    resource = pytest.importorskip("resource")
    performance = short("foam", 0.8, 1.8)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        with pytest.raises(InputError, match="not all of it reached the disk; free some space"):
            render(performance, tmp_path / "a.mp4", Camera())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert capfd.readouterr().err == ""


def test_a_folder_that_is_not_there_is_one_sentence(tmp_path, capfd):
    with pytest.raises(InputError, match=r"'.*a\.mp4' cannot be written: .*free some space\.$"):
        render(short("foam", 0.0, 0.2), tmp_path / "missing" / "a.mp4", Camera())
    assert capfd.readouterr().err == ""


def test_frames_are_taken_in_the_order_in_which_they_are_shown_by_the_worst_camera():
    for seed in range(100):
        camera = Camera(jitter=1e-3, late=150, seed=seed)
        assert np.diff(camera.shots(10.0)[0]).min() > 1e-3
