"""Text tables: how they are written, what each column is, and what is said about them."""

from __future__ import annotations

import math
import time
from pathlib import Path

import numpy as np
import pytest
from factories import read_single, refusal
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.formats import identify, preview, read
from forcelab.formats.recording import ReadOptions, Recording
from forcelab.formats.table import sniff
from forcelab.formats.table_columns import counter_ticks, is_counter_name


@pytest.fixture
def table(tmp_path):
    def write(content: str | bytes, name: str = "reach 07.csv") -> Path:
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def channels(recording: Recording) -> list[tuple[str, str]]:
    return [(channel.name, channel.unit) for channel in recording.demonstration.channels]


SMALL = "time,fx,fy\n0.00,1,2\n0.01,3,4\n0.02,5,6\n"


class TestDialects:
    def test_a_plain_table_keeps_stamps_names_and_numbers(self, table):
        recording = read_single(table(SMALL), task="reach")
        demonstration = recording.demonstration
        assert demonstration.name == "reach 07"
        assert demonstration.task == "reach"
        assert demonstration.times.tolist() == [0.0, 0.01, 0.02]
        assert demonstration.signals.tolist() == [[1, 2], [3, 4], [5, 6]]
        assert channels(recording) == [("fx", ""), ("fy", "")]
        assert recording.tracks == ()
        assert recording.remarks == ()

    @pytest.mark.parametrize(
        "content",
        [
            SMALL.replace(",", "\t"),
            SMALL.replace(",", ";"),
            SMALL.replace(",", " "),
            SMALL.replace(",", "   "),
            SMALL.replace(",", " , "),
            SMALL.replace(",", "|"),
            SMALL.replace(",fx,", "\tfx  ").replace(".01,3,", ".01\t3  ").replace(",", "  "),
            SMALL.replace(",", ";").replace(".", ","),
            SMALL.replace(",", "\t").replace(".", ","),
            SMALL.replace("\n", "\r\n"),
            SMALL.replace("\n", "\r"),
            SMALL.rstrip("\n"),
            SMALL.replace("\n", ",\n"),
            SMALL.replace("\n", "\n\n"),
            "\ufeff" + SMALL,
            "# made by a logger\n" + SMALL + "# end\n",
            "% time fx fy\n" + SMALL.partition("\n")[2].replace(",", " "),
            "# time, fx, fy\n" + SMALL.partition("\n")[2].replace(",", " "),
            "// one\n// two\n\n" + SMALL,
            "  time    fx   fy\n" + SMALL.partition("\n")[2].replace(",", "  "),
            '"time","fx","fy"\n"0.00","1","2"\n"0.01","3","4"\n"0.02","5","6"\n',
            "time;fx;fy\n0;1;2\n1e-2;3;4\n2E-2;5;6\n",
        ],
    )
    def test_the_same_table_in_another_dialect_is_the_same(self, table, content):
        recording = read_single(table(content))
        assert recording.demonstration == read_single(table(SMALL, "plain.csv")).demonstration
        assert recording.remarks == ()

    @pytest.mark.parametrize(
        "encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1"]
    )
    def test_encodings_are_told_by_content(self, table, encoding):
        text = SMALL.replace("fx", "Kräfte x [µm]")
        recording = read_single(table(text.encode(encoding)))
        assert channels(recording) == [("Kräfte x", "µm"), ("fy", "")]

    def test_decimal_commas_may_stand_quoted_between_commas(self, table):
        rows = "".join(f'"0,0{i}","{i},5"\n' for i in range(1, 6))
        demonstration = read_single(table('"time [s]","fx"\n' + rows)).demonstration
        assert demonstration.signals[:, 0].tolist() == [1.5, 2.5, 3.5, 4.5, 5.5]
        np.testing.assert_allclose(demonstration.times, [0, 0.01, 0.02, 0.03, 0.04], atol=1e-15)

    def test_decimal_commas_that_come_late_are_seen(self, table):
        rows = "".join(f"{10 * i};0;0\n" for i in range(3000)) + "30000;2,5;-0,125\n"
        recording = read_single(table("time [ms];fx;fy\n" + rows))
        assert recording.demonstration.signals[-1].tolist() == [2.5, -0.125]

    def test_units_stand_in_brackets_behind_a_slash_or_in_a_line_of_their_own(self, table):
        text = "t/s;Fx [N];Mz (N m);acc (raw data);force[0]\n0;1;2;3;4\n1e-3;1;2;3;4\n"
        found = channels(read_single(table(text)))
        assert found == [("Fx", "N"), ("Mz", "N m"), ("acc (raw data)", ""), ("force[0]", "")]
        text = "time,fx,vx,heat\n[ms],[N],[mm/s],[C]\n0,1,2,3\n10,1,2,3\n"
        recording = read_single(table(text))
        assert channels(recording) == [("fx", "N"), ("vx", "mm/s"), ("heat", "C")]
        assert recording.demonstration.times.tolist() == [0.0, 0.01]

    @pytest.mark.parametrize("unit", ["daN", "kgf", "gf", "kp", "newtons", "lbf", "µN"])
    def test_a_force_in_another_unit_is_an_axis_all_the_same(self, table, unit):
        assert channels(read_single(table(f"t,fx ({unit})\n0,1\n.1,1\n"))) == [("fx", unit)]

    def test_of_many_columns_the_first_are_named(self, table):
        header = ",".join(f"c{number}" for number in range(1000))
        with pytest.raises(InputError, match="among c0, c1, .*, c19 and 980 more; name the"):
            read_single(table("\n".join([header, *9 * ["1" + 999 * ",1"]])))

    def test_repeated_and_blank_names_are_made_unique_and_said(self, table):
        recording = read_single(table("time,f,,f,f 2\n0,1,2,3,4\n.1,1,2,3,4\n"))
        assert channels(recording) == [("f", ""), ("column 3", ""), ("f 3", ""), ("f 2", "")]
        assert recording.remarks == (
            "Columns that repeat a name were renamed: 'f 3' (column 4).",
            "The header leaves a column without a name, called column 3.",
        )

    def test_a_preamble_is_skipped_and_counted(self, table):
        text = "Device: OptoForce\nRate;1000\n\n" + SMALL
        recording = read_single(table(text))
        assert recording.demonstration == read_single(table(SMALL, "plain.csv")).demonstration
        assert recording.remarks == ("2 lines before the table were skipped.",)

    def test_row_numbers_as_pandas_and_r_write_them_are_no_channel(self, table):
        pandas = ",time,fx\n0,0.0,5\n1,0.1,6\n2,0.2,7\n"
        recording = read_single(table(pandas))
        assert channels(recording) == [("fx", "")]
        assert "Column 1 was left out: row numbers." in recording.remarks
        r = '"time" "fx"\n"1" 0.0 5\n"2" 0.1 6\n"3" 0.2 7\n'
        assert read_single(table(r)).demonstration == recording.demonstration

    def test_constant_words_and_empty_columns_are_left_out_and_said(self, table):
        text = "time,who,fx,note\n0,s05,1,\n1e-3,s05,2,\n2e-3,s05,3,\n"
        recording = read_single(table(text))
        assert channels(recording) == [("fx", "")]
        assert recording.tracks == ()
        assert recording.remarks == (
            "Column who was left out: words, not numbers.",
            "Column note was left out: empty.",
        )

    def test_a_column_that_starts_empty_is_still_a_channel(self, table):
        rows = [f"{i / 1000},{i % 7},{'' if i < 20_000 else 1.5}\n" for i in range(20_010)]
        recording = read_single(table("time,fx,fy\n" + "".join(rows)))
        assert channels(recording) == [("fx", ""), ("fy", "")]
        assert recording.demonstration.signals[-1, 1] == 1.5
        assert recording.remarks == ("20,000 samples are missing (fy 20,000).",)


CELL = st.floats(allow_nan=False, allow_infinity=False, width=64)


@st.composite
def written_tables(draw):
    """A table of random numbers, and its bytes in a random dialect."""
    count = draw(st.integers(2, 12))
    width = draw(st.integers(1, 4))
    signals = draw(
        st.lists(st.lists(CELL, min_size=width, max_size=width), min_size=count, max_size=count)
    )
    unit, factor = draw(st.sampled_from([("s", 1), ("ms", 1000), ("us", 10**6), ("ns", 10**9)]))
    steps = draw(st.lists(st.integers(900, 1100), min_size=count - 1, max_size=count - 1))
    ticks = np.concatenate([[0], np.cumsum(steps)]).tolist()
    stamps = [tick / 1000 for tick in ticks] if unit == "s" else ticks
    epoch = unit != "s" and draw(st.booleans())
    base = 1_700_000_000 * factor if epoch else 0
    separator, comma = draw(
        st.sampled_from([(",", False), (";", False), (";", True), ("\t", True), ("\t", False)])
        | st.sampled_from([(" ", False), ("  ", False), ("|", False)])
    )
    rows = [
        [str(base + t) if base else repr(t), *map(repr, r)]
        for t, r in zip(stamps, signals, strict=True)
    ]
    if comma:
        rows = [[cell.replace(".", ",") for cell in row] for row in rows]
    if draw(st.booleans()) and separator.strip():
        rows = [[f'"{cell}"' for cell in row] for row in rows]
    names = [f"f{i}" for i in range(width)]
    bracket = draw(st.sampled_from(["time [{}]", "time ({})", "t/{}", "time_{}", "timestamp_{}"]))
    if not separator.strip():
        bracket = "time_{}"
    head = [bracket.format(unit), *names]
    newline = draw(st.sampled_from(["\n", "\r\n", "\r"]))
    tail = separator if separator.strip() and draw(st.booleans()) else ""
    text = draw(st.sampled_from(["", "# a comment, 1 2 3\n", "% one\n\n// two\n"]))
    text += "".join(separator.join(row) + tail + "\n" for row in [head, *rows])
    if draw(st.booleans()):
        text += "# the end\n"
    encoding = draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le"]))
    times = [t if unit == "s" else t / factor for t in stamps]
    return text.replace("\n", newline).encode(encoding), times, signals


@settings(
    max_examples=75, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(written=written_tables())
def test_a_random_table_in_a_random_dialect_is_read_back_to_the_bit(written, table):
    content, times, signals = written
    path = table(content)
    assert sniff(path, content[:65_536])
    demonstration = read_single(path).demonstration
    assert demonstration.times.tolist() == times
    assert [list(map(repr, row)) for row in demonstration.signals.tolist()] == [
        list(map(repr, row)) for row in signals
    ]


@pytest.mark.parametrize(
    ("text", "length"), [("a,b\n", "line"), ("a", "line"), ("a\nb\n", "2 lines")]
)
def test_a_file_without_rows_is_told_as_long_as_it_is(table, text, length):
    assert f"in its first {length};" in refusal(table(text))


class TestMissingSamples:
    def test_empty_cells_and_words_for_nothing_are_missing_and_counted(self, table):
        text = "time,fx,fy\n0,,1\n.1,NaN,2\n.2,-inf,3\n.3,1e400,\n.4,7,5\n.5,8,3.4e38\n"
        recording = read_single(table(text))
        assert np.isnan(recording.demonstration.signals[:4, 0]).all()
        assert recording.demonstration.signals[4].tolist() == [7, 5]
        # What a board prints that knows nothing is kept, and taken for no measurement anywhere.
        assert recording.demonstration.signals[5, 1] == 3.4e38
        assert recording.remarks == ("6 samples are missing (fx 4, fy 2).",)

    @pytest.mark.parametrize("cell", ["abc", "1_000", "1,5", "0x10", "1.2.3", "--5", "12:30"])
    def test_a_word_among_numbers_is_refused_with_its_line(self, table, cell):
        rows = [f"{i / 100};{i}.5\n" for i in range(50)]
        rows[40] = f"0.4;{cell}\n"
        sentence = refusal(table("time;fx\n# a comment\n" + "".join(rows)))
        assert "line 43" in sentence
        assert f"'{cell}'" in sentence
        assert "'fx'" in sentence

    def test_a_word_in_the_first_row_is_not_taken_for_a_header(self, table):
        text = "time,fx,fy\n0,oops,1\n" + "".join(f"{i / 10},1,2\n" for i in range(1, 9))
        assert "line 2: 'oops' in column 'fx'" in refusal(table(text))

    def test_absurd_stamps_are_dropped_like_absent_ones(self, table):
        rows = [f"{1_700_000_000_000 + 10 * i},{i}\n" for i in range(50)]
        rows[20:22] = ["1e300,20\n", "9" * 5000 + ",21\n"]
        recording = read_single(table("timestamp,fx\n" + "".join(rows)))
        assert recording.demonstration.times.size == 48
        assert recording.remarks == ("2 rows without a usable stamp were dropped.",)

    def test_points_among_decimal_commas_are_refused(self, table):
        rows = "".join(f"{i}0;1,5\n" for i in range(1, 40))
        assert "'1.234'" in refusal(table("t [ms];fx\n" + rows + "900;1.234\n"))


class TestRaggedRows:
    def test_a_row_cut_off_at_the_end_is_dropped_and_said(self, table):
        recording = read_single(table(SMALL + "0.03,7"))
        assert recording.demonstration.times.tolist() == [0.0, 0.01, 0.02]
        assert recording.remarks == (
            "1 row with more or fewer than 3 cells was dropped, the first in line 5.",
        )
        assert "line 5" in refusal(table(SMALL + "0.03,7"), strict=True)

    def test_without_stamps_a_ragged_row_keeps_its_place_as_missing_samples(self, table):
        rows = ["1.5,2\n"] * 10 + ["3\n"] + ["4,5.5\n"] * 10
        recording = read_single(table("fx,fy\n" + "".join(rows)), rate=100)
        assert recording.demonstration.signals.shape == (21, 2)
        assert np.isnan(recording.demonstration.signals[10]).all()
        assert recording.demonstration.signals[11].tolist() == [4, 5.5]
        assert any("taken as missing samples" in remark for remark in recording.remarks)

    def test_wildly_different_widths_are_refused_with_the_first_line(self, table):
        rows = [",".join(["1.5"] * (1 + i * 7 % 11)) + "\n" for i in range(100)]
        assert "rows do not have" in refusal(table("".join(rows)), rate=100)


class TestTime:
    def test_a_table_without_stamps_needs_a_rate(self, table):
        path = table("fx,fy\n3,4\n2,1\n5,6\n")
        assert "say how many samples there are a second" in refusal(path)
        demonstration = read_single(path, rate=500).demonstration
        assert demonstration.times.tolist() == [0.0, 0.002, 0.004]
        assert demonstration.rate == 500
        with pytest.raises(InputError, match="positive"):
            read_single(path, rate=-1)

    def test_stamps_are_kept_and_the_rate_is_for_the_grid(self, table):
        demonstration = read_single(table(SMALL), rate=500).demonstration
        assert demonstration.times.tolist() == [0.0, 0.01, 0.02]
        assert demonstration.grid_rate == 500

    @pytest.mark.parametrize("wish", ["clk", "CLK", "clk [s]", "2"])
    def test_a_column_is_named_as_stamps_by_name_or_number(self, table, wish):
        path = table("fx,clk [s],time\n5,0,3\n6,.1,2\n7,.3,1\n")
        assert read_single(path, time=wish).demonstration.times.tolist() == [0, 0.1, 0.3]

    @pytest.mark.parametrize("name", ["label", "labels of Ann"])
    def test_a_column_of_labels_that_is_named_as_times_is_refused(self, table, name):
        path = table(f"time,{name},fx\n0,0,1\n.1,1,2\n.2,1,3\n")
        assert "cannot hold both times and labels" in refusal(path, time=name)

    def test_an_unknown_column_is_refused_with_those_there_are(self, table):
        assert "time, fx, fy" in refusal(table(SMALL), time="clock")
        assert "no column '9' of labels" in refusal(table(SMALL), label="9")

    @pytest.mark.parametrize(
        ("seconds", "nanoseconds"),
        [("stamp.sec", "stamp.nanosec"), ("/ft/header/stamp/secs", "/ft/header/stamp/nsecs")],
    )
    def test_seconds_and_nanoseconds_are_one_time(self, table, seconds, nanoseconds):
        ticks = 1_764_000_000_900_000_000 + np.arange(300) * 2_000_000
        rows = "".join(f"{t // 10**9},{t % 10**9},{t % 7}\n" for t in ticks.tolist())
        path = table(f"{seconds},{nanoseconds},fx\n" + rows)
        recording = read_single(path)
        np.testing.assert_allclose(
            recording.demonstration.times, np.arange(300) * 0.002, rtol=0, atol=1e-6
        )
        assert channels(recording) == [("fx", "")]
        assert recording.remarks == ()
        np.testing.assert_allclose(
            read_single(path, time=nanoseconds).demonstration.times, recording.demonstration.times
        )
        path = table(f"{seconds},{nanoseconds},fx\n" + rows.replace("1764", "e764", 1))
        assert "'e764000000' in column" in refusal(path)

    def test_seconds_beside_the_same_in_nanoseconds_are_no_pair(self, table):
        rows = "".join(f"{i},{i * 10**9},{i % 7}\n" for i in range(30))
        recording = read_single(table("t_sec,t_nsec,fx\n" + rows))
        np.testing.assert_allclose(recording.demonstration.times, np.arange(30))
        rows = "".join(f"{i // 500},{i * 2_000_000},{i % 7}\n" for i in range(999))
        path = table("t_sec,t_nsec,fx\n" + rows)
        assert "'t_nsec' goes beyond a second" in refusal(path)
        recording = read_single(path, leave_out=("t_sec",))
        np.testing.assert_allclose(recording.demonstration.times, np.arange(999) / 500)

    def test_without_a_header_an_even_step_tells_the_stamps(self, table):
        rng = np.random.default_rng(1)
        rows = "".join(f"{rng.normal():.4f} {3 + i * 0.005:.3f}\n" for i in range(50))
        recording = read_single(table(rows))
        np.testing.assert_allclose(recording.demonstration.times, np.arange(50) * 0.005)
        assert recording.remarks == (
            "There is no header; the columns are called by their numbers.",
            "Times were read from 'column 2', as it steps like a clock; name another column if "
            "they are not (--time).",
        )

    def test_a_ramp_of_force_with_a_name_is_not_taken_for_stamps(self, table):
        rows = "".join(f"{i * 0.5},{i % 3}\n" for i in range(50))
        assert "no column of times" in refusal(table("fx,fy\n" + rows))

    def test_times_that_stand_still_are_told(self, table):
        rows = "".join(f"12.5,{i % 3}\n" for i in range(50))
        assert "has in 'time' one and the same time throughout; name" in refusal(
            table("time,fx\n" + rows)
        )

    def test_stamps_as_rosbag_to_csv_writes_them(self, table):
        rows = "".join(f"2023/03/06/16:37:59.{i}00000,{i}\n" for i in range(8))
        assert read_single(table("time,.wrench.force.x\n" + rows)).demonstration.times.tolist() == (
            pytest.approx([i / 10 for i in range(8)])
        )

    def test_a_second_column_of_stamps_is_no_channel(self, table):
        recording = read_single(table("time,timestamp,fx\n0,1700000000000,1\n.1,1700000000100,2\n"))
        assert channels(recording) == [("fx", "")]
        assert recording.remarks == ("Column timestamp was left out: times were read from 'time'.",)
        columns = table("t,time 2,time 3,fx\n" + "".join(f".{i},{i},5,0.5\n" for i in range(4)))
        (remark,) = read_single(columns).remarks
        assert remark == "Columns time 2, time 3 were left out: times were read from 't'."

    @pytest.mark.parametrize("mark", [",", "\t"])
    def test_stamps_may_say_am_and_pm(self, table, mark):
        stamps = ["11:59:59.5 PM", "12:00:00.0 AM", "12:00:00.5 AM", "12:00:01.0 AM"]

        def file_of(stamps):
            return table(
                f"Time{mark}fx\n" + "".join(f"{s}{mark}{n}\n" for n, s in enumerate(stamps))
            )

        path = file_of(stamps)
        assert [column.use for column in preview(path, ReadOptions())] == ["times", "signal"]
        assert read_single(path).demonstration.times.tolist() == [0, 0.5, 1, 1.5]
        without = refusal(file_of([*stamps[:2], "00:00:00.5", stamps[3]]))
        assert "line 4: '00:00:00.5' in column 'Time' is not a stamp" in without
        assert "time runs backwards" in refusal(file_of(stamps[:0:-1]))

    def test_stamps_in_words_that_are_no_iso_8601_are_refused(self, table):
        path = table("time,fx\n31.05.2024 12h,1\n31.05.2024 13h,2\n")
        assert "2024-05-31 12:00:00" in refusal(path)


class TestLabels:
    ROWS = "".join(
        f"{i / 10},{i},{word}\n"
        for i, word in enumerate(["", "grab", "grab", "hold", "hold", "-", "NaN", "grab"])
    )

    @pytest.mark.parametrize("name", ["label", "Action", "activity_label", "phase", "whatever"])
    def test_runs_of_a_label_column_become_segments(self, table, name):
        recording = read_single(table(f"time,fx,{name}\n" + self.ROWS), author="Ann")
        (track,) = recording.tracks
        assert track.author == "Ann"
        found = [(s.start, s.end, s.action) for s in track.segments]
        assert found == [(0.1, 0.3, "grab"), (0.3, 0.5, "hold"), (0.7, pytest.approx(0.8), "grab")]
        assert channels(recording) == [("fx", "")]

    def test_a_column_found_by_its_words_is_named(self, table):
        remark = "Labels were read from 'whatever', the only column of words"
        assert remark in read_single(table("time,fx,whatever\n" + self.ROWS)).remarks[-1]
        assert read_single(table("time,fx,phase\n" + self.ROWS)).remarks == ()
        text = table("time,fx,whatever\n" + self.ROWS)
        assert read_single(text, label="whatever").remarks == ()

    def test_labels_where_an_action_begins_only_are_told_to_be_brief(self, table):
        words = ["grab", "", "", "hold", "", ""]
        rows = "".join(f"{i / 10},{i},{word}\n" for i, word in enumerate(words))
        recording = read_single(table("time,fx,label\n" + rows))
        assert [s.end - s.start for s in recording.tracks[0].segments] == pytest.approx([0.1] * 2)
        assert "'label' is empty below each label" in recording.remarks[0]
        assert "Fill down" in recording.remarks[0]
        assert read_single(table("time,fx,label\n" + self.ROWS)).remarks == ()

    def test_words_that_change_in_each_row_are_no_labels(self, table):
        rows = "".join(f"{i / 10},{i % 4},{'xyz'[i % 3]}\n" for i in range(30))
        recording = read_single(table("time,value,axis\n" + rows))
        assert recording.tracks == ()
        assert recording.remarks == ("Column axis was left out: words, not numbers.",)

    def test_several_rows_for_each_time_are_refused_where_a_word_parts_them(self, table):
        rows = "".join(f"{i // 3 / 10},{i % 4},{'xyz'[i % 3]}\n" for i in range(30))
        message = refusal(path := table("time,value,axis\n" + rows))
        assert "several rows for each time, one for each of x, y, z in 'axis'" in message
        assert "pivot" in message
        assert "10 bursts" in read_single(path, leave_out=("axis",)).remarks[0]

    def test_whole_numbers_are_labels_where_the_column_says_so(self, table):
        text = "time,fx,{}\n0,5,1\n.1,5,1\n.2,5,3\n.3,5,-1\n"
        recording = read_single(table(text.format("class")))
        assert recording.tracks[0].actions == ("1", "3")
        assert recording.tracks[0].segments[-1].end == 0.3
        assert read_single(table(text.format("n"))).tracks == ()
        assert read_single(table(text.format("n")), label="n").tracks[0].actions == ("1", "3")
        phase = "time,phase\n" + "".join(f"{i / 100},{i * 0.3:.1f}\n" for i in range(20))
        assert channels(read_single(table(phase))) == [("phase", "")]

    def test_two_columns_of_words_are_not_guessed_between(self, table):
        text = "time,fx,one,two\n" + "".join(
            f"{i / 10},1,{'ab'[i > 2]},{'cd'[i > 3]}\n" for i in range(9)
        )
        recording = read_single(table(text))
        assert recording.tracks == ()
        assert recording.remarks[0] == "Columns one, two were left out: words, not numbers."
        assert "several may be (one, two): name the one that is (--label)" in recording.remarks[1]
        assert "call each column 'labels of NAME' in the header" in recording.remarks[1]
        recording = read_single(table(text.replace("one,two", "labels of Ann,labels of Ben")))
        assert [track.author for track in recording.tracks] == ["Ann", "Ben"]
        assert recording.remarks == ()
        assert read_single(table(text), label="two").tracks[0].actions == ("c", "d")

    def test_a_column_with_a_thousand_words_names_no_actions(self, table):
        rows = "".join(f"{i / 100},{i},note {i // 3}\n" for i in range(6000))
        found = read_single(table("time,fx,whatever\n" + rows))
        assert found.tracks == ()
        assert "Column whatever was left out: words, not numbers." in found.remarks
        complaint = refusal(table("time,fx,label\n" + rows))
        assert "column 'label' holds 2,000 different words" in complaint
        assert "column 'whatever' holds" in refusal(
            table("time,fx,whatever\n" + rows), label="whatever"
        )

    def test_labels_of_dropped_rows_are_dropped_with_them(self, table):
        text = "time,fx,label\n0,1,a\n.1,1,a\n.1,1,b\n.2,1,a\n.3,1,a\n"
        recording = read_single(table(text))
        assert [s.action for s in recording.tracks[0].segments] == ["a"]
        assert recording.demonstration.times.size == 4

    def test_a_labels_file_given_as_a_recording_is_told_so(self, table):
        assert "is a labels file" in refusal(table("start,end,action\n0,1,grab\n1,2,hold\n"))


class TestBrokenFiles:
    @pytest.mark.parametrize("seed", range(3))
    def test_a_table_with_flipped_bytes_is_read_or_refused_in_one_sentence(self, table, seed):
        rng = np.random.default_rng(seed)
        rows = "".join(f"{i / 100},{rng.normal():.5f},{'ab'[i % 20 < 9]}\n" for i in range(60))
        whole = ("time,fx,label\n" + rows).encode()
        for _ in range(60):
            broken = bytearray(whole[: rng.integers(1, len(whole))])
            for place in rng.integers(0, len(broken), rng.integers(0, 4)):
                broken[place] = rng.integers(0, 256)
            path = table(bytes(broken))
            try:
                recording = read_single(path)
            except InputError:
                refusal(path)
            else:
                assert recording.demonstration.times[0] == 0
                assert math.isfinite(recording.demonstration.duration)

    def test_sniffing_tells_tables_from_other_texts(self, table):
        def sniffs(content: bytes, name: str) -> bool:
            return sniff(table(content, name), content[:65_536])

        assert sniffs(SMALL.encode(), "data.log")
        assert sniffs(b"word\n", "data.csv")
        assert not sniffs(b"word\n", "data.log")
        assert not sniffs(b'{"a": [1, 2]}\n', "data.json")
        assert not sniffs(b"PK\x03\x04" + bytes(100), "data.csv")
        assert not sniffs(b"(lp0\nF0.5\naF1.0\na.", "data.pdl")


class TestSpeed:
    def test_a_hundred_thousand_rows_of_seven_numbers_take_less_than_two_seconds(self, table):
        block = "".join(f"{i},{i * 0.25},-1.5,2.25,3e-3,4,5\n" for i in range(100_000))
        path = table("time [ms],a,b,c,d,e,f\n" + block)
        start = time.process_time()
        demonstration = read_single(path).demonstration
        assert time.process_time() - start < 2
        assert demonstration.signals[-1].tolist() == [99_999 * 0.25, -1.5, 2.25, 3e-3, 4, 5]


class TestRealRecordings:
    pytestmark = pytest.mark.real

    @pytest.mark.parametrize(
        ("number", "rows", "repeats", "segments"),
        [
            (1, 1117, 4, 8),
            (2, 1160, 5, 9),
            (3, 1021, 4, 7),
            (4, 975, 5, 7),
            (5, 1056, 5, 7),
            (6, 1057, 6, 7),
        ],
    )
    def test_watch_recordings(self, number, rows, repeats, segments, real_file):
        path = real_file(f"imu/s05_0{number}_sw.csv")
        recording = read_single(path)
        lines = [line.split(",") for line in path.read_text().splitlines()[1:]]
        fresh = [i for i in range(rows) if i == 0 or lines[i][6] != lines[i - 1][6]]
        demonstration = recording.demonstration
        assert len(lines) == rows
        assert len(fresh) == rows - repeats == demonstration.times.size
        assert demonstration.times.tolist() == [
            (int(lines[i][6]) - int(lines[0][6])) / 1000 for i in fresh
        ]
        assert demonstration.signals.tolist() == [list(map(float, lines[i][:6])) for i in fresh]
        assert [name for name, _ in channels(recording)] == [
            *("x_acc", "y_acc", "z_acc", "x_gyro", "y_gyro", "z_gyro")
        ]
        assert recording.remarks == (
            f"{repeats} rows repeat the stamp before; the first row of each stamp was kept.",
        )
        (track,) = recording.tracks
        assert len(track.segments) == segments
        for i in fresh:
            time = (int(lines[i][6]) - int(lines[0][6])) / 1000
            (covering,) = [s for s in track.segments if s.start <= time < s.end]
            assert covering.action == lines[i][7]

    def test_the_camera_recording(self, real_file):
        recording = read_single(real_file("video/karma.csv"))
        assert channels(recording) == [(f"accel_{axis}", "m/s^2") for axis in "xyz"]
        assert recording.demonstration.times.size == 2397
        assert recording.demonstration.rate == pytest.approx(198.8, abs=0.1)
        assert recording.demonstration.times[-1] == 12.074214
        assert recording.remarks == ()


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ("t,fx,Aktion", "labels"),
        ("t,fx,fz [N]", "left out"),
        ("t,fx,", "left out"),
        ("t,fx,note,Aktion", "left out"),
        ("t,fx,label,Aktion", "left out"),
    ],
)
def test_the_only_column_that_begins_empty_is_proposed_as_labels(table, header, expected):
    width = header.count(",") - 1
    rows = [f"{i / 500},{i % 7}{',' * width}" for i in range(1000)]
    rows += [f"{2 + i / 500},1{',' * width}grab" for i in range(100)]
    path = table("\n".join([header, *rows]))
    assert preview(path, ReadOptions())[-1].use == expected
    if expected == "labels":
        assert [segment.action for segment in read_single(path).tracks[0].segments] == ["grab"]


def in_one_table(*parts, header="who,trial,t,fx,note"):
    """Recordings below each other: of each what tells it from the others, and its rows."""
    rows = [
        f"{told},{i / 100 + start},{i % 7 + place},{'grab' if i > 30 else ''}"
        for place, (told, start, count) in enumerate(parts)
        for i in range(count)
    ]
    return "\n".join([header, *rows])


class TestRecordingsInOneTable:
    def test_columns_with_which_times_begin_again_tell_recordings_apart(self, table):
        text = in_one_table(("Ann,1", 0, 50), ("Ann,2", 0, 60), ("Ben,1", 0.02, 55))
        recordings = read(table(text), ReadOptions(task="pull"))
        found = [recording.demonstration for recording in recordings]
        expected = ["Ann trial 1", "Ann trial 2", "Ben trial 1"]
        assert [d.name for d in found] == [f"reach 07 {name}" for name in expected]
        assert [d.times.size for d in found] == [50, 60, 55]
        for place, recording in enumerate(recordings):
            assert channels(recording) == [("fx", "")]
            times, signals = recording.demonstration.times, recording.demonstration.signals
            np.testing.assert_allclose(times, np.arange(times.size) / 100, atol=1e-12)
            np.testing.assert_array_equal(signals[:, 0], np.arange(times.size) % 7 + place)
            assert [segment.start for segment in recording.tracks[0].segments] == [0.31]
            assert (
                "Times begin again with 'who', 'trial', so that the file holds 3 recordings."
                in (recording.remarks)
            )
            assert not any("left out" in remark for remark in recording.remarks)

    def test_values_that_come_again_are_numbered(self, table):
        text = in_one_table(("a", 0, 50), ("b", 0, 50), ("a", 0, 50), header="trial,t,fx,note")
        names = [r.demonstration.name for r in read(table(text), ReadOptions())]
        assert names == ["reach 07 a", "reach 07 b", "reach 07 a 2"]

    @pytest.mark.parametrize(
        "parts",
        [
            [("Ann,1", 0, 50), ("Ann,1", 0, 60)],  # nothing tells them apart
            [("Ann,1", 0, 50), ("Ann,2", 0, 25), ("Ann,2", 0, 25)],
            [("Ann,1", 0, 30), ("Ann,2", 0.3, 30), ("Ann,3", 0, 60)],
        ],
    )
    def test_what_is_not_told_apart_runs_backwards(self, table, parts):
        assert "time runs backwards" in refusal(table(in_one_table(*parts)))

    @pytest.mark.parametrize("header", ["date,t,fx,note", "date,trial,t,fx,note"])
    def test_a_date_tells_recordings_apart_however_long_the_table_is(self, table, header):
        several = header.count(",") > 3
        days = [f"2024-05-0{i // 2 + 1 if several else i + 1} 10:00:00" for i in range(8)]
        told = [f"{day},{i + 1}" if several else day for i, day in enumerate(days)]
        path = table(in_one_table(*((part, 0, 9000) for part in told), header=header))
        assert path.stat().st_size > 2 << 20  # which are several blocks
        found = [recording.demonstration for recording in read(path, ReadOptions())]
        names = [f"{day} trial {i + 1}" if several else day for i, day in enumerate(days)]
        assert [d.name for d in found] == [f"reach 07 {name}" for name in names]
        assert {d.times.size for d in found} == {9000}

    def test_a_stamp_that_jitters_where_a_column_changes_begins_no_recording(self, table):
        text = in_one_table(("Ann,1", 0, 50), ("Ann,2", 0.48, 50))
        (recording,) = read(table(text), ReadOptions())
        assert recording.demonstration.times.size == 98

    @pytest.mark.parametrize("told", ["one,1 two,1", "1,one 2,one"])
    def test_a_column_that_is_left_out_tells_them_apart_and_a_signal_stays_one(self, table, told):
        path = table(in_one_table(*((part, 0, 50) for part in told.split())))
        for name in ("who", "trial"):
            recordings = read(path, ReadOptions(leave_out=(name,)))
            assert len(recordings) == 2
            assert all(channels(recording)[-1] == ("fx", "") for recording in recordings)
        if "1,one" in told:
            recordings = read(path, ReadOptions(signals=("who",)))
            assert [r.demonstration.signals[0, 0] for r in recordings] == [1, 2]


SIX = "".join(f"{i / 100},{i % 7},{i % 5},{i % 3},{i % 9},{i % 4},{i % 8}\n" for i in range(50))
BOTH_HANDS = [f"{hand} {axis}" for hand in ("left", "right") for axis in ("fx", "fy", "fz")]


@pytest.mark.parametrize(
    "header",
    [
        ",left,left,left,right,right,right\n,fx,fy,fz,fx,fy,fz\ntime,,,,,,\n",
        "hand,left,left,left,right,right,right\naxis,fx,fy,fz,fx,fy,fz\ntime,,,,,,\n",
        ",left,,,right,,\ntime,fx,fy,fz,fx,fy,fz\n",
        ",left,,,right,,\ntime,fx,fy,fz,fx,fy,fz\ns,,,,,,\n",
    ],
)
def test_a_header_of_two_levels_names_the_sensor_and_its_axes(table, header):
    recording = read_single(table(header + SIX))
    assert [name for name, _ in channels(recording)] == BOTH_HANDS
    assert recording.remarks == ()
    assert recording.demonstration.times[1] == 0.01


@pytest.mark.parametrize(
    ("header", "remarks"),
    [
        ("a title,,,,,,\ntime,fx,fy,fz,fx,fy,fz\n", ["1 line before", "'fx 2' (column 5)"]),
        ("a title,,,,,,\ntime,fx,fy,fz,mx,my,\n", ["1 line before", "called column 7"]),
        ("title,,,,,,\ntime,fx,,,,,\n", ["1 line before", "called column 3, column 4"]),
    ],
)
def test_a_title_above_the_header_is_no_level_of_it(table, header, remarks):
    recording = read_single(table(header + SIX))
    assert recording.demonstration.channels[0].name == "fx"
    for expected, remark in zip(remarks, recording.remarks, strict=True):
        assert expected in remark


def test_ground_forces_of_opensim_have_their_units(table):
    names = ["ground_force_vx", "ground_force_px", "1_ground_torque_y", "knee_angle_r"]
    rows = "".join(f"{i / 100:.8f}\t{i % 7 / 4}\t0.5\t{i % 9 / 4}\t12.5\n" for i in range(20))
    head = "walk_grf\nversion=1\nnRows=20\nnColumns=5\ninDegrees=yes\nendheader\n"
    recording = read_single(table(head + "\t".join(["time", *names]) + "\n" + rows, "walk.mot"))
    units = ["N", "m", "Nm", ""]
    assert channels(recording) == list(zip(names, units, strict=True))
    assert recording.demonstration.rate == pytest.approx(100)


def vicon(samples, after=""):
    """Two forces at 1 kHz beside video at 100 Hz, as Vicon exports them."""
    rows = [f"{i // 10 + 1},{i % 10},{i % 7 / 4},{i % 9 / 4}\n" for i in samples]
    head = "Devices\n1000\n,,Plate - Force,\nFrame,Sub Frame,Fx,Fz\n,,N,N\n"
    return head + "".join(rows) + after


def test_a_vicon_export_has_its_rate_and_its_counters(table):
    lost = [i for i in range(400) if not 150 <= i < 173]
    after = "\nTrajectories\n100\n,,a:LFHD,,\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n"
    after += "".join(f"{i},0,1.5,2.5,3.5\n" for i in range(1, 900))
    recording = read_single(table(vicon(lost, after)))
    demonstration = recording.demonstration
    assert [(c.name, c.unit) for c in demonstration.channels] == [("Fx", "N"), ("Fz", "N")]
    np.testing.assert_allclose(demonstration.times, np.array(lost) / 1000)
    assert demonstration.grid_rate is None
    result = " ".join(recording.remarks)
    assert "The file says that there are 1000 samples a second." in result
    assert "'Frame' counts the samples and places the rows: 23 of 400 were lost." in result
    assert "More tables follow in the file; only the first one was read." in result


def test_a_vicon_export_that_a_spreadsheet_saved_again(table):
    """Its lines are as wide as the widest one, and channels may be called by a number."""
    lines = vicon(range(400)).replace("Fx,Fz", "1,EMG2").splitlines()
    padded = [line + "," * (4 - line.count(",")) for line in lines]
    (recording,) = read(table("\n".join(padded) + "\n"), ReadOptions())
    channels = [(c.name, c.unit) for c in recording.demonstration.channels]
    assert channels == [("1", "N"), ("EMG2", "N")]
    np.testing.assert_allclose(recording.demonstration.times, np.arange(400) / 1000)


def test_a_vicon_export_has_the_rate_of_its_devices_not_of_the_events_before_them(table):
    events = "".join(f"S01,Left,Foot Strike,{i / 4},The instant\n" for i in range(12))
    before = f"Events\n100\nSubject,Context,Name,Time (s),Description\n{events}\n"
    after = "\nTrajectories\n100\n,,a:LFHD,,\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n"
    after += "".join(f"{i},0,1.5,2.5,3.5\n" for i in range(1, 900))
    (recording,) = read(table(before + vicon(range(400), after)), ReadOptions())
    assert [c.name for c in recording.demonstration.channels] == ["Fx", "Fz"]
    np.testing.assert_allclose(recording.demonstration.times, np.arange(400) / 1000)


def test_frame_and_sub_frame_count_together_wherever_they_stand(table):
    text = vicon(range(400)).split("\n", 3)[3]
    assert "say how many samples" in refusal(table(text))
    recording = read_single(table(text), rate=1000)
    assert [c.name for c in recording.demonstration.channels] == ["Fx", "Fz"]


LABVIEW = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\n"
    "Decimal_Separator\t.\nMulti_Headings\tYes\nX_Columns\tOne\nTime_Pref\tRelative\n"
    "Date\t2024/05/31\nTime\t12:00:00.123456\n***End_of_Header***\t\n\t\n"
    "Channels\t2\t\t\t\nSamples\t200\t200\t\t\nDate\t2024/05/31\t2024/05/31\t\t\n"
    "Y_Unit_Label\tNewton\tVolt\t\nX_Dimension\tTime\tTime\t\nX0\t0.0\t0.0\t\n"
    "Delta_X\t0.002000\t0.002000\t\n***End_of_Header***\t\t\t\nX_Value\tFx\tFz\tComment\n"
)


@pytest.mark.parametrize("timed", [True, False])
@pytest.mark.parametrize("comma", [True, False])
def test_a_labview_measurement_has_two_headers(tmp_path, timed, comma):
    rows = [f"{i / 500 if timed else ''}\t{i % 7 / 4}\t{i % 9 / 4:.3f}\n" for i in range(200)]
    text = LABVIEW + "".join(rows)
    path = tmp_path / "pull.lvm"
    path.write_text(text.replace(".", ",") if comma else text)
    assert identify(path).name == "table"
    recording = read_single(path)
    demonstration = recording.demonstration
    assert [(c.name, c.unit) for c in demonstration.channels] == [("Fx", "Newton"), ("Fz", "Volt")]
    np.testing.assert_allclose(demonstration.times, np.arange(200) / 500, atol=1e-12)
    np.testing.assert_allclose(demonstration.signals[:, 0], np.arange(200) % 7 / 4)


def test_each_channel_of_a_labview_measurement_may_have_times(tmp_path):
    text = LABVIEW.replace("X_Columns\tOne", "X_Columns\tMulti")
    text = text.replace("X_Value\tFx\tFz", "X_Value\tFx\tX_Value\tFz")
    path = tmp_path / "pull.lvm"
    path.write_text(text + "".join(f"{i / 500}\t{i}.5\t{i / 500}\t{i}.25\n" for i in range(40)))
    recording = read_single(path)
    assert [c.name for c in recording.demonstration.channels] == ["Fx", "Fz"]
    np.testing.assert_allclose(recording.demonstration.times, np.arange(40) / 500, atol=1e-12)


@pytest.mark.parametrize("rows", [7, 40])
def test_a_short_labview_measurement_with_empty_channels_and_comments(tmp_path, rows):
    """There are as many numbers in its headers as below them."""
    head = LABVIEW.replace("\t200\t200", "\t7\t0").replace("0.0\t0.0", "0.0\t0.0\t0.0")
    text = head + "".join(
        f"{i / 500}\t{i}.5\t\t{'lost' if i % 4 else 'good'}\n" for i in range(rows)
    )
    path = tmp_path / "pull.lvm"
    path.write_text(text)
    assert identify(path).name == "table"
    recording = read_single(path)
    assert [(c.name, c.unit) for c in recording.demonstration.channels] == [("Fx", "Newton")]
    np.testing.assert_allclose(recording.demonstration.times, np.arange(rows) / 500, atol=1e-12)
    assert [s.action for s in recording.tracks[0].segments[:2]] == ["good", "lost"]


def test_a_quote_in_a_labview_header_that_is_not_closed_does_no_harm(table):
    rows = "".join(f"{i / 500}\t{i % 7 / 4}\t{i % 9 / 4}\n" for i in range(200))
    whole = read_single(table(LABVIEW + rows, "pull.lvm"))
    quoted = LABVIEW.replace("Writer_Version", 'Operator\t"Joe\nWriter_Version')
    recording = read_single(table(quoted + rows, "pull.lvm"))
    assert recording.demonstration == whole.demonstration


@pytest.fixture
def counter_table(tmp_path):
    """Writes a table of a counter, perhaps stamps, and a force that is the row's true number."""

    def write(counts, header="Paket;Daumen_x", times=None):
        rows = [header if times is None else f"Zeit;{header}"]
        for row, count in enumerate(counts):
            stamp = [] if times is None else [f"{times[row]:.3f}".replace(".", ",")]
            rows.append(";".join([*stamp, str(count), f"{np.sin(row):.3f}".replace(".", ",")]))
        path = tmp_path / "trial.csv"
        path.write_text("\n".join(rows) + "\n")
        return path

    return write


#: Of 300 samples 80 are lost, and a 16-bit counter begins again.
NUMBERS = np.array([n for n in range(300) if not 100 <= n < 180])
COUNTS = (65_400 + NUMBERS) % 65_536


def test_beside_stamps_a_counter_is_left_out_and_said(counter_table):
    recording = read_single(counter_table(COUNTS, times=NUMBERS / 200))
    assert [c.name for c in recording.demonstration.channels] == ["Daumen_x"]
    assert "Column Paket was left out: sample counts." in recording.remarks


def test_without_stamps_it_places_the_rows_so_that_what_was_lost_is_a_gap(counter_table):
    recording = read_single(counter_table(COUNTS), rate=200.0)
    np.testing.assert_allclose(recording.demonstration.times, NUMBERS / 200, atol=1e-12)
    assert "80 of 300 were lost" in " ".join(recording.remarks)


def test_a_column_of_on_and_off_is_a_signal_and_said_to_be_one_unless_it_was_asked_for(tmp_path):
    path = tmp_path / "trial.csv"
    rows = [f"{i / 100},{np.sin(i):.3f},{i % 2},{i % 3}" for i in range(40)]
    path.write_text("\n".join(["t (s),fz,button,gear", *rows]) + "\n")
    (remark,) = read_single(path).remarks
    assert remark.startswith("Column button holds nothing but 0 and 1")
    assert read_single(path, signals=("button",)).remarks == ()
    assert "button" not in " ".join(read_single(path, leave_out=("button",)).remarks[1:])


@pytest.mark.parametrize("last", [300, 1500, 20_000, 30_999, 40_000])
def test_a_device_that_was_restarted_is_a_gap_of_unknown_length_and_no_loss(counter_table, last):
    counts = [*range(last - 199, last + 1), *range(100)]
    recording = read_single(counter_table(counts), rate=200.0)
    np.testing.assert_allclose(recording.demonstration.times, np.arange(300) / 200, atol=1e-12)
    result = " ".join(recording.remarks)
    assert "none was lost" in result
    assert "'Paket' begins again once, first in line 202" in result
    assert "a gap of unknown length" in result


def test_a_device_that_was_restarted_early_counts_far_beyond_that(counter_table):
    recording = read_single(counter_table([*range(200), *range(3, 600)]), rate=200.0)
    assert [c.name for c in recording.demonstration.channels] == ["Daumen_x"]


@pytest.mark.parametrize("counts", [[*range(200), 198, *range(199, 400)], [*range(400, 0, -1)]])
def test_what_falls_but_not_to_its_beginning_is_a_signal_whatever_its_name(counter_table, counts):
    path = counter_table(counts, times=np.arange(len(counts)) / 200)
    assert [c.name for c in read_single(path).demonstration.channels] == ["Paket", "Daumen_x"]


def test_a_turn_at_which_samples_were_lost_is_no_restart(counter_table):
    counts = [*range(32_000, 32_700), *range(50, 300)]
    result = " ".join(read_single(counter_table(counts), rate=200.0).remarks)
    assert "118 of 1,068 were lost" in result
    assert "begins again" not in result


def test_one_of_any_name_is_known_by_how_it_goes_on(counter_table):
    recording = read_single(counter_table(COUNTS, "Wert_A;Wert_B"), rate=200.0)
    assert [c.name for c in recording.demonstration.channels] == ["Wert_B"]
    assert recording.demonstration.duration == pytest.approx(1.5)
    why = "sample counts, by their steps; import what is a signal as one (--signal)."
    assert f"Column Wert_A was left out: {why}" in recording.remarks


def test_a_column_taken_for_a_counter_is_a_signal_where_it_is_asked_for(counter_table):
    path = counter_table(np.arange(200), "Traverse;Daumen_x", times=np.arange(200) / 200)
    assert [c.name for c in read_single(path).demonstration.channels] == ["Daumen_x"]
    demonstration = read_single(path, signals=("traverse",)).demonstration
    assert [c.name for c in demonstration.channels] == ["Traverse", "Daumen_x"]
    np.testing.assert_array_equal(demonstration.signals[:, 0], np.arange(200))
    with pytest.raises(InputError, match="'Traverse' is asked for as a signal and as something"):
        read_single(path, signals=("Traverse",), leave_out=("Traverse",))


@pytest.mark.parametrize("wish", ["leave_out", "signals"])
def test_rows_do_not_go_by_a_column_that_is_said_to_be_no_counter(counter_table, wish):
    recording = read_single(counter_table(COUNTS), rate=200.0, **{wish: ("Paket",)})
    np.testing.assert_allclose(recording.demonstration.times, np.arange(NUMBERS.size) / 200)


def test_a_temperature_called_t_is_a_signal_where_it_is_asked_for(counter_table):
    path = counter_table(NUMBERS // 8 + 20, "t;Daumen_x")
    demonstration = read_single(path, rate=200.0, signals=("t",)).demonstration
    assert [c.name for c in demonstration.channels] == ["t", "Daumen_x"]


def test_second_times_are_a_signal_where_they_are_asked_for(tmp_path):
    path = tmp_path / "trial.csv"
    rows = (f"{i / 100},{i * 7 % 5 / 10},{i}" for i in range(50))
    path.write_text("\n".join(["time,fx,device time", *rows]) + "\n")
    assert [c.name for c in read_single(path).demonstration.channels] == ["fx"]
    channels = read_single(path, signals=("device time",)).demonstration.channels
    assert [c.name for c in channels] == ["fx", "device time"]


@pytest.mark.parametrize("header", [None, "time,id,fx"])
def test_what_counts_rows_only_at_first_stays_a_signal(tmp_path, header):
    path = tmp_path / "trial.csv"
    course = [min(i, 12_000 - i) for i in range(9_000)]  # there, and half the way back
    rows = [f"{i / 100},{course[i]},{np.sin(i):.3f}" for i in range(9_000)]
    path.write_text("\n".join([*([header] if header else []), *rows]) + "\n")
    demonstration = read_single(path).demonstration
    assert len(demonstration.channels) == 2
    np.testing.assert_array_equal(demonstration.signals[:, 0], course)


def test_numbers_of_rows_of_which_some_were_taken_out_are_no_signal(tmp_path):
    path = tmp_path / "trial.csv"
    numbers = [i if i < 7_000 else 3 * i + i % 2 for i in range(9_000)]
    rows = [f"{i / 100},{number},{np.sin(i):.3f}" for i, number in enumerate(numbers)]
    path.write_text("\n".join(["time,index,fx", *rows]) + "\n")
    assert [c.name for c in read_single(path).demonstration.channels] == ["fx"]


def test_words_are_no_signal_even_where_they_are_asked_for(tmp_path):
    path = tmp_path / "trial.csv"
    rows = (f"{i / 100},{i * 7 % 5 / 10},word {i}" for i in range(50))
    path.write_text("\n".join(["time,fx,note", *rows]) + "\n")
    with pytest.raises(InputError, match="'note' holds no numbers, so that it is no signal"):
        read_single(path, signals=("note",))


@pytest.mark.parametrize("name", ["encoder_count", "MotorTicks", "Position", "enc2"])
def test_what_is_measured_at_an_even_speed_stays_a_signal(counter_table, name):
    path = counter_table(np.arange(200), f"{name};Daumen_x", times=np.arange(200) / 200)
    assert [c.name for c in read_single(path).demonstration.channels] == [name, "Daumen_x"]


def test_a_counter_that_is_asked_for_stands_before_stamps(counter_table):
    path = counter_table(COUNTS, times=np.arange(NUMBERS.size) / 200)
    recording = read_single(path, rate=100.0, counter="paket")
    np.testing.assert_allclose(recording.demonstration.times, NUMBERS / 100, atol=1e-12)
    for rate in (100.0, None):
        with pytest.raises(InputError, match="'Daumen_x' does not go on by one step"):
            read_single(path, rate=rate, counter="Daumen_x")
    with pytest.raises(InputError, match="'Paket' counts the samples; say how many there are"):
        read_single(path, counter="Paket")


def test_columns_that_are_not_wanted_become_no_channels(counter_table):
    path = counter_table(NUMBERS % 7, "Taster;Daumen_x", times=NUMBERS / 200)
    for wish, left in (("taster", "Daumen_x"), ("3", "Taster")):
        recording = read_single(path, leave_out=(wish,))
        assert [c.name for c in recording.demonstration.channels] == [left]
        assert any("was left out: as chosen" in remark for remark in recording.remarks)
    with pytest.raises(InputError, match="no column 'Daumenx' of values; name one of"):
        read_single(path, leave_out=("Daumenx",))


@pytest.mark.parametrize(
    ("values", "named"),
    [
        (np.arange(200) % 7, True),  # seven states in turn
        (np.sin(np.arange(200.0)), True),  # no whole numbers
        (np.repeat([0, 1], 100), True),  # a switch
        (np.random.default_rng(0).integers(0, 9000, 200), True),  # raw values of a sensor
        (np.arange(50), False),  # too few to tell
        (np.repeat(np.arange(400), [1] * 399 + [3]), False),  # stands still at last
        (np.full(200, np.nan), True),
        ([2e9, 1e8, 5e6, 2.5e5], True),  # as of a device that is restarted in each row
    ],
)
def test_what_is_no_counter_stays_a_signal(values, named):
    assert counter_ticks(np.asarray(values, np.float64), named) is None


def test_steps_of_several_are_one_and_missing_counts_stay_missing():
    values = np.array([0, 10, 20, np.nan, 40, 50, 80, 90, 100, 110, 120, 130.0])
    np.testing.assert_array_equal(
        counter_ticks(values, True), [0, 1, 2, np.nan, 4, 5, 8, 9, 10, 11, 12, 13]
    )


@pytest.mark.parametrize(
    ("name", "counts"),
    [
        *((name, True) for name in ("Paket", "packet_no", "SampleCounter", "Zähler", "nr")),
        ("force_counter", True),
        *((name, False) for name in ("fx1", "Daumen_x", "norm", "pressure", "wheel ticks")),
    ],
)
def test_names_of_counters(name, counts):
    assert is_counter_name(name) is counts
