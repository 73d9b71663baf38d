"""Playback: where the cursor is depends on the clock, and on nothing else."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from forcelab.gui.label.playback import SPEEDS, Player


class Clock:
    now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def player(document, clock):
    player = Player(document, clock=clock)
    yield player
    player.stop()


def wait(player, seconds, ticks=1):
    for _ in range(ticks):
        player._clock.now += seconds / ticks
        player.tick()


def test_the_speeds_go_from_a_tenth_to_four_with_normal_in_the_middle():
    assert tuple(sorted(SPEEDS)) == SPEEDS
    assert (SPEEDS[0], SPEEDS[len(SPEEDS) // 2], SPEEDS[-1]) == (0.1, 1.0, 4.0)


def test_late_ticks_skip_time_and_never_slow_it(document, player):
    document.view.seek(2.0)
    player.start()
    assert document.view.playing
    for late in (0.016, 0.5, 0.001, 1.25):
        wait(player, late)
    assert document.view.cursor == pytest.approx(2.0 + 0.016 + 0.5 + 0.001 + 1.25, abs=1e-12)


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(st.sampled_from(SPEEDS), st.floats(0.001, 0.4)), max_size=12))
def test_a_new_speed_keeps_the_place(document, player, moves):
    player.stop()
    document.view.set_speed(1.0)
    document.view.seek(0.5)
    player.start()
    expected = 0.5
    for speed, seconds in moves:
        document.view.set_speed(speed)
        wait(player, 0.0)
        assert document.view.cursor == pytest.approx(min(expected, 10.0), abs=1e-9)
        wait(player, seconds, ticks=3)
        expected += speed * seconds
    if expected < document.view.bounds[1]:
        assert document.view.cursor == pytest.approx(expected, abs=1e-9)


def test_it_stops_at_the_end_and_begins_anew_from_there(document, player):
    end = document.view.bounds[1]
    document.view.seek(end - 0.1)
    player.start()
    wait(player, 5.0)
    assert (document.view.cursor, document.view.playing) == (end, False)
    assert not player._timer.isActive()
    player.start()
    assert (document.view.cursor, document.view.playing) == (0.0, True)


def test_seeking_while_it_plays_goes_on_from_there(document, player):
    player.start()
    wait(player, 0.3)
    document.view.seek(7.0)
    wait(player, 0.25)
    assert document.view.cursor == pytest.approx(7.25)


def test_a_stretch_is_played_once_and_ends_where_it_ends(document, player):
    player.play_span(3.0, 3.5)
    wait(player, 0.4)
    assert document.view.cursor == pytest.approx(3.4)
    wait(player, 0.4)
    assert (document.view.cursor, document.view.playing) == (3.5, False)
    document.view.seek(3.2)
    player.start()  # the stretch is forgotten
    wait(player, 1.0)
    assert document.view.cursor == pytest.approx(4.2)


def test_seeking_out_of_the_stretch_leaves_it(document, player):
    player.play_span(3.0, 3.5)
    document.view.seek(6.0)
    wait(player, 1.0)
    assert document.view.cursor == pytest.approx(7.0)


def test_the_current_segment_is_the_range_or_the_selected_or_the_one_below(document, player):
    document.view.seek(2.5)
    player.play_current()
    assert document.view.cursor == 2.0
    wait(player, 9.0)
    assert document.view.cursor == 4.5
    document.select(3)
    player.play_current()
    assert document.view.cursor == 6.0
    document.view.set_range(8.5, 9.0)
    player.play_current()
    assert document.view.cursor == 8.5
    wait(player, 9.0)
    assert document.view.cursor == 9.0
    document.view.clear_range()
    document.select(None)
    document.view.seek(9.5)
    player.play_current()  # nothing here: play on
    assert (document.view.cursor, document.view.playing) == (9.5, True)


def test_a_loop_keeps_time_over_its_end(document, player):
    document.view.set_range(2.0, 3.0)
    player.set_loop(True)
    player.start()
    assert document.view.cursor == 2.0
    wait(player, 5.25, ticks=7)
    assert document.view.cursor == pytest.approx(2.25)
    assert document.view.playing
    player.set_loop(False)
    wait(player, 1.0)
    assert (document.view.cursor, document.view.playing) == (3.0, False)


def test_without_a_range_the_whole_demonstration_is_looped(document, player):
    low, high = document.view.bounds
    document.view.seek(high - 0.5)
    player.set_loop(True)
    player.start()
    wait(player, 0.75)
    assert document.view.cursor == pytest.approx(low + 0.25)


def test_whoever_sets_playing_starts_and_stops_it(document, player):
    document.view.set_playing(True)
    wait(player, 0.5)
    assert document.view.cursor == pytest.approx(0.5)
    document.view.set_playing(False)
    wait(player, 0.5)
    assert document.view.cursor == pytest.approx(0.5)
    assert not player._timer.isActive()


def test_steps_of_speed(document, player):
    player.faster()
    assert document.view.speed == 1.5
    for _ in range(9):
        player.faster()
    assert document.view.speed == 4.0
    for _ in range(20):
        player.slower()
    assert document.view.speed == 0.1
    document.view.set_speed(0.6)
    player.faster()
    assert document.view.speed == 0.75
    player.normal_speed()
    assert document.view.speed == 1.0


def test_another_demonstration_stops_it_and_none_cannot_be_played(document, player):
    player.start()
    document.open_demonstration("02")
    assert not document.view.playing
    document.close()
    player.start()
    assert not document.view.playing
    assert not player._timer.isActive()


def test_the_timer_really_moves_the_cursor(app, document, until):
    player = Player(document)
    player.start()
    until(lambda: document.view.cursor > 0.05)
    player.stop()
