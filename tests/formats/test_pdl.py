"""The paper's databases, and what no pickle in one may do."""

import os
import pickle
import struct
import time
from collections import OrderedDict
from datetime import date

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.formats import pdl
from forcelab.formats.pdl import Opaque, load_all
from forcelab.formats.recording import ReadOptions
from forcelab.labels import Segment, Track

N = 8


def record(name="grip-1", **changed):
    """A record of eight samples at 100 Hz, with distinct numbers in every signal."""
    fx1, fy1, fx2, fy2 = (np.arange(N) * step + step for step in (0.3, 0.4, 0.6, 0.8))
    signals = [[] for _ in range(11)]
    signals[0], signals[1] = np.hypot(fx1, fy1), np.hypot(fx2, fy2)
    signals[2], signals[3] = -np.arange(N) - 0.25, -np.arange(N) - 0.75
    signals[7], signals[8], signals[9], signals[10] = fx1, fy1, fx2, fy2
    created = {
        "name": name,
        "timestamps": [12.5 + i / 100 for i in range(N)],
        "labels": ["", "grab", "grab", "grab", "", "slip", "grab", "grab"],
        "signals": [[float(value) for value in signal] for signal in signals],
        "signal_bundle": None,
        "__id__": 0,
    }
    return created | changed


def database(*records, protocol=2):
    parts = (["name", "signals"], len(records), dict(enumerate(records)), {}, {"name": None})
    return b"".join(pickle.dumps(part, protocol) for part in parts)


@pytest.fixture
def written(tmp_path):
    """Writes a database and gives its path."""

    def write(*records, **how):
        path = tmp_path / "tongs_sig.pdl"
        path.write_bytes(database(*records, **how))
        return path

    return write


def test_six_forces_in_newton_come_from_their_places(written):
    (recording,) = pdl.read(written(record()), ReadOptions(task="stylus", rate=50.0))
    demonstration = recording.demonstration
    assert [channel.name for channel in demonstration.channels] == [
        "fx1", "fy1", "fz1", "fx2", "fy2", "fz2",
    ]  # fmt: skip
    assert {channel.unit for channel in demonstration.channels} == {"N"}
    np.testing.assert_allclose(
        demonstration.signals[2], [0.9, 1.2, -2.25, 1.8, 2.4, -2.75], rtol=1e-14
    )
    assert (demonstration.name, demonstration.task) == ("grip-1", "stylus")
    assert demonstration.grid_rate == 50.0
    assert recording.remarks == ()


def test_time_starts_at_zero_and_labels_go_with_it(written):
    (recording,) = pdl.read(written(record()), ReadOptions(author="Ada"))
    times = recording.demonstration.times
    assert times[0] == 0.0
    np.testing.assert_allclose(times, np.arange(N) / 100, atol=1e-12)
    assert recording.tracks == (
        Track(
            "Ada",
            (
                Segment(times[1], times[4], "grab"),
                Segment(times[5], times[6], "slip"),
                Segment(times[6], times[7] + recording.demonstration.period, "grab"),
            ),
        ),
    )


@pytest.mark.parametrize("labels", [[""] * N, ["Unlabelled"] * N, None])
def test_a_record_without_labels_has_no_track(written, labels):
    (recording,) = pdl.read(written(record(labels=labels)), ReadOptions())
    assert recording.tracks == ()


@pytest.mark.parametrize("protocol", [0, 1, 2])
def test_every_protocol_of_python_2_is_told_by_content_and_read(tmp_path, protocol):
    path = tmp_path / "renamed.bin"
    path.write_bytes(database(record(), protocol=protocol))
    assert pdl.sniff(path, path.read_bytes()[:64])
    assert len(pdl.read(path, ReadOptions())) == 1


@pytest.mark.parametrize(
    "head", [b"t,fx\n0,1\n", b"(label)\n", b"]\n", b"PK\x03\x04", b"channel\n"]
)
def test_what_is_no_pickle_is_not_taken_for_one(tmp_path, head):
    assert not pdl.sniff(tmp_path / "x.csv", head)


def test_demonstrations_keep_the_order_of_the_file(written):
    path = written(*(record(name) for name in ("z", "a", "m")))
    assert [r.demonstration.name for r in pdl.read(path, ReadOptions())] == ["z", "a", "m"]


@pytest.mark.parametrize("names", [("a", "a"), ("a", ""), ("a", None), ("a", "b\nc"), (3, "a")])
def test_records_without_names_of_their_own_are_named_after_the_file(written, names):
    recordings = pdl.read(written(*map(record, names)), ReadOptions())
    assert [r.demonstration.name for r in recordings] == ["tongs_sig 01", "tongs_sig 02"]
    assert recordings[0].remarks == (
        "The names of the records are missing or not unique; the demonstrations are called "
        "'tongs_sig 01' and so on.",
    )
    assert recordings[1].remarks == ()


def test_magnitudes_that_belong_to_other_forces_are_told_or_refused(written):
    odd = record()
    odd["signals"][1] = [value * 1.001 for value in odd["signals"][1]]
    path = written(record("first"), odd)
    recordings = pdl.read(path, ReadOptions())
    assert recordings[1].remarks == (
        "'grip-1': signal 1 is not the magnitude of signals 9 and 10, which were taken.",
    )
    with pytest.raises(InputError, match="record 1: 'grip-1': signal 1 is not the magnitude"):
        pdl.read(path, ReadOptions(strict=True))


def without(place):
    signals = record()["signals"]
    signals[place] = []
    return signals


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({"signals": without(9)}, "record 1: signal 9 has 0 samples where timestamps has 8"),
        ({"signals": record()["signals"][:9]}, "record 1: signal 9 has 0 samples"),
        ({"signals": None}, "record 1 has no signals"),
        ({"signals": [["1.5"] * N] * 11}, "record 1: signal 0 is no list of numbers"),
        ({"signals": [[True] * N] * 11}, "record 1: signal 0 is no list of numbers"),
        ({"timestamps": [0.0, 0.1]}, "signal 7 has 8 samples where timestamps has 2"),
        ({"timestamps": "12345678"}, "record 1: timestamps is no list of numbers"),
        ({"timestamps": [float("inf")] * N}, "record 1: timestamps holds something that is no"),
        ({"timestamps": [0.5] * N}, "'grip-1': time does not increase at sample 1"),
        ({"labels": ["grab"] * 7}, "record 1 has 7 labels for 8 samples"),
        ({"labels": [1] * N}, "record 1: labels is no list of names"),
        ({"labels": ["a\nb"] * N}, r"record 1: the label 'a\nb' is no printable name"),
    ],
)
def test_a_damaged_record_is_refused_by_its_number(written, changed, what):
    with pytest.raises(InputError) as refusal:
        pdl.read(written(record("fine"), record(**changed)), ReadOptions())
    assert what in str(refusal.value)


@pytest.mark.parametrize(
    ("parts", "what"),
    [
        (({"a": 1},), "is no pydblite database"),
        ((["name"], 1), "is no pydblite database"),
        ((["name"], 1, {}), "is a database without records"),
        ((["name"], 1, {"a": {}}), "what is kept under 'a' is no record"),
        ((["name"], 1, {0: [1]}), "what is kept under 0 is no record"),
        ((["name"], 1, {0: {}}), "record 0: timestamps is no list of numbers"),
    ],
)
def test_other_pickles_are_refused(tmp_path, parts, what):
    path = tmp_path / "x.pdl"
    path.write_bytes(b"".join(pickle.dumps(part, 2) for part in parts))
    with pytest.raises(InputError) as refusal:
        pdl.read(path, ReadOptions())
    assert what in str(refusal.value)


def test_the_authors_class_around_the_signals_is_not_built(tmp_path):
    bundle = b"(clabelSelectedData\nSignalBundle\no}U\x04nameU\x01xsb"
    plain = pickle.dumps(record(), 2)[2:-1]
    records = b"\x80\x02}K\x00" + plain + b"U\x0dsignal_bundle" + bundle + b"ss."
    path = tmp_path / "x.pdl"
    path.write_bytes(pickle.dumps(["name"], 2) + pickle.dumps(1, 2) + records)
    (recording,) = pdl.read(path, ReadOptions())
    assert recording.demonstration.times.size == N


def test_a_file_too_large_for_a_database_is_not_even_opened(tmp_path):
    path = tmp_path / "x.pdl"
    with path.open("wb") as sparse:
        sparse.truncate(64 * 2**20 + 1)
    with pytest.raises(InputError, match="is larger than 67,108,864 bytes"):
        pdl.read(path, ReadOptions())


@pytest.mark.real
@pytest.mark.parametrize(
    ("file", "actions"),
    [
        (
            "JPen_sig.pdl",
            {"still", "grab_pen", "pull_pen", "slip_pen", "sliptransition_pen", "slipped_pen"},
        ),
        ("soft_sig.pdl", {"still", "grab_soft", "hold_soft", "release_soft"}),
    ],
)
def test_the_papers_recordings(file, actions, real_file):
    path = real_file(f"tongs/{file}")
    started = time.process_time()
    recordings = pdl.read(path, ReadOptions(author="coder"))
    assert time.process_time() - started < 1.5
    assert len(recordings) == 10
    assert {action for r in recordings for action in r.tracks[0].actions} == actions
    for recording in recordings:
        demonstration = recording.demonstration
        assert recording.remarks == ()
        assert demonstration.rate == pytest.approx(1000, rel=1e-9)
        assert demonstration.gaps == ()
        assert 3.5 < demonstration.duration < 6.3
        assert np.isfinite(demonstration.signals).all()
        # squeezing is negative on both normals, and the tongs are squeezed in every recording
        assert (demonstration.signals[:, [2, 5]].min(axis=0) < -1.5).all()
        unlabelled = 1 - recording.tracks[0].labelled / demonstration.duration
        assert 0.01 < unlabelled < 0.15


BUNDLE = frozenset({"authors.Bundle"})

plain = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**63 - 1)
    | st.floats(allow_nan=False)
    | st.text(),
    lambda inner: (
        st.lists(inner, max_size=5)
        | st.tuples(inner)
        | st.tuples(inner, inner, inner, inner)
        | st.dictionaries(st.text(max_size=3) | st.integers(-1000, 1000), inner, max_size=5)
    ),
    max_leaves=20,
)


def load_single(data: bytes, inert: frozenset[str] = frozenset()):
    (value,) = load_all(data, "x.pdl", inert)
    return value


@settings(max_examples=40, deadline=None)
@given(plain, st.sampled_from([0, 1, 2]))
def test_plain_data_comes_back_as_it_was_written(value, protocol):
    # repr also tells True from 1 and 1 from 1.0
    assert repr(load_single(pickle.dumps(value, protocol))) == repr(value)


@pytest.mark.parametrize(
    ("data", "value"),
    [
        (b"U\x04gr\xe4b.", "gräb"),
        (b"T\x04\x00\x00\x00gr\xe4b.", "gräb"),
        (rb"S'gr\xe4b\n\t\\ it\'s'" + b"\n.", "gräb\n\t\\ it's"),
        (b'S"it\'s"\n.', "it's"),
        (b"I01\n.", True),
        (b"I00\n.", False),
        (b"L-12345678901L\n.", -12345678901),
        (b"F1e-07\n.", 1e-07),
        (b"F-inf\n.", float("-inf")),
        (b"\x8b\x02\x00\x00\x00\xff\x7f.", 32767),
        (b"\x8a\x00.", 0),
        (b"(dp0\nS'a'\np1\n(lp2\nI1\naI2\nasS'b'\ng2\ns.", {"a": [1, 2], "b": [1, 2]}),
    ],
)
def test_strings_and_numbers_as_python_2_wrote_them(data, value):
    assert repr(load_single(data)) == repr(value)


def test_pickles_that_follow_one_another_are_all_read_and_do_not_share_a_memo():
    assert load_all(b"]q\x00.K\x05.N.", "x", frozenset()) == [[], 5, None]
    with pytest.raises(InputError, match="byte 4: the pickle is damaged .Memo value not found"):
        load_all(b"]q\x00.h\x00.", "x", frozenset())


def test_a_shared_part_stays_one_object():
    first, second = load_single(b"](]q\x00K\x01ah\x00e.")
    assert first is second == [1]


@pytest.mark.parametrize(
    "opcodes",
    [
        b"(cauthors\nBundle\no",  # an old-style instance in the binary protocols
        b"(iauthors\nBundle\n",  # the same in the text protocol
        b"cauthors\nBundle\n)R",
        b"cauthors\nBundle\n)\x81",
    ],
)
def test_an_instance_of_an_inert_class_keeps_nothing(opcodes):
    data = b"](" + opcodes + b"}U\x06secretK\x01sbK\x07e."
    instance, seven = load_single(data, BUNDLE)
    assert (type(instance), vars(instance), seven) == (Opaque, {}, 7)
    assert not callable(instance)


class Evil:
    """Pickles as a call of os.system."""

    def __reduce__(self):
        return os.system, ("touch canary",)


ATTACKS = {
    "GLOBAL os": b"cos\nsystem\n(S'touch canary'\ntR.",
    "GLOBAL posix": b"cposix\nsystem\n(S'touch canary'\ntR.",
    "GLOBAL builtins": b'c__builtin__\neval\n(S\'open("canary", "w")\'\ntR.',
    "GLOBAL builtins 3": b'cbuiltins\nexec\n(S\'open("canary", "w")\'\ntR.',
    "GLOBAL subprocess": b"csubprocess\nPopen\n((lS'touch'\naS'canary'\natR.",
    "GLOBAL import only": b"ccanary_module\nx\n.",
    "INST os": b"(S'touch canary'\nios\nsystem\n.",
    "OBJ os": b"(cos\nsystem\nS'touch canary'\no.",
    "NEWOBJ": b"csubprocess\nPopen\n((lS'touch'\naS'canary'\nat\x81.",
    "NEWOBJ_EX": b"cauthors\nBundle\n)}\x92.",
    "REDUCE of a number": b"K\x01)R.",
    "REDUCE of an inert instance": b"cauthors\nBundle\n)R)R.",
    "BUILD of a dictionary": b"}}b.",
    "BUILD of an inert class": b"cauthors\nBundle\n}b.",
    "STACK_GLOBAL": b"\x8c\x02os\x8c\x06system\x93\x8c\x0ctouch canary\x85R.",
    "STACK_GLOBAL of strings of Python 2": b"U\x02osU\x06system\x93(S'touch canary'\ntR.",
    "EXT1": b"\x82\x01.",
    "EXT2": b"\x83\x01\x00.",
    "EXT4": b"\x84\x01\x00\x00\x00.",
    "PERSID": b"Pcanary\n.",
    "BINPERSID": b"U\x06canaryQ.",
    "copy_reg": b"ccopy_reg\n_reconstructor\n(c__main__\nA\nc__builtin__\nobject\nNtR.",
    "attribute of an inert class": b"cauthors\nBundle.__init__\n.",
    "__reduce__ 0": pickle.dumps(Evil(), 0),
    "__reduce__ 2": pickle.dumps(Evil(), 2),
    "__reduce__ 5": pickle.dumps(Evil(), 5),
    "OrderedDict": pickle.dumps(OrderedDict(a=1), 2),
    "date": pickle.dumps(date(2017, 9, 24), 2),
    "set": pickle.dumps({1, 2}, 2),
    "bytes": pickle.dumps(b"x", 2),
    "in the last of many": b"]q\x00.K\x05.}.cos\nsystem\n(S'touch canary'\ntR.",
    "in the state of an inert instance": b"(cauthors\nBundle\no}U\x01acos\nsystem\nsb.",
    "where nobody looks": b"cos\nsystem\n0].",
}


@pytest.mark.parametrize("attack", ATTACKS.values(), ids=ATTACKS.keys())
def test_whatever_is_not_plain_data_is_refused_with_nothing_executed(attack, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "canary_module.py").write_text("open('canary', 'w')\nx = 1\n")
    with pytest.raises(InputError) as refusal:
        load_all(attack, "x.pdl", BUNDLE)
    assert "nothing was executed" in str(refusal.value) or "protocol 5" in str(refusal.value)
    assert [path.name for path in tmp_path.iterdir()] == ["canary_module.py"]


def test_a_refusal_names_the_class_and_the_byte():
    with pytest.raises(InputError) as refusal:
        load_all(b"]q\x00.](K\x01cos\nsystem\n", "x.pdl", frozenset())
    assert str(refusal.value) == (
        "'x.pdl', byte 8: the pickle asks for 'os.system', which is refused because it could run "
        "a program; nothing was executed."
    )


def test_a_refusal_names_the_opcode_and_the_byte():
    with pytest.raises(InputError, match=r"byte 2: the pickle opcode BINPERSID is refused"):
        load_all(b"K\x01Q.", "x.pdl", frozenset())


def nested(depth: int, opening: bytes, closing: bytes) -> bytes:
    return opening * depth + closing * (depth - 1) + b"."


def laughs(seed: bytes, double: bytes, times: int) -> bytes:
    """A value that is doubled in length by each of many short steps, through the memo."""
    body = b"(" + seed + b"q\x00"
    for step in range(times):
        index = bytes([step])
        body += double.replace(b"?", index) + b"q" + bytes([step + 1])
    return body + b"l."


BOMBS = {
    "an integer of 2 GiB": (b"\x8b\xff\xff\xff\x7f", "not enough data in stream"),
    "an integer of negative length": (b"\x8b\xff\xff\xff\xff.", "byte count < 0"),
    "a string of 2 GiB": (
        b"T\xff\xff\xff\x7fabc.",
        "expected 2147483647 bytes in a string4, but only 4 remain",
    ),
    "a string of negative length": (b"T\xff\xff\xff\xffabc.", "byte count < 0: -1"),
    "a text of 4 GiB": (b"X\xff\xff\xff\xffabc.", "expected 4294967295 bytes"),
    "a million digits": (b"I" + b"9" * 1_000_000 + b"\n.", "damaged"),
    "a float of a million digits": (b"F" + b"9" * 1_000_000 + b"\n.", "damaged"),
    "a list in itself": (b"]q\x00h\x00a.", "holds itself"),
    "a dictionary in itself": (b"}q\x00K\x01h\x00s.", "holds itself"),
    "a ring of two lists": (b"]q\x00](h\x00ea.", "holds itself"),
    "lists 100,000 deep": (nested(100_000, b"]", b"a"), "more than 50 deep"),
    "tuples 90,000 deep": (b")" + b"\x85" * 90_000 + b".", "more than 50 deep"),
    "100,000 marks": (b"(" * 100_000 + b"l" * 100_000 + b".", "more than 50 deep"),
    "a billion laughs": (laughs(b"](K\x01K\x01e", b"](h?h?e", 40), "more than 10,000,000 values"),
    "a billion laughs as a key": (
        laughs(b"K\x01\x85", b"h?h?\x86", 40).replace(b"l.", b"}h\x28K\x01s."),
        "uses one tuple in several places",
    ),
    "wide laughs": (b"(](" + b"N" * 4000 + b"eq\x00](" + b"h\x00" * 4000 + b"el.", "10,000,000"),
    "very many lists": (b"](" + b"]" * 100_001 + b"e.", "more than 100,000 lists"),
    "very many pickles": (b"N." * 101, "byte 200: more than 100 pickles follow"),
    "very many memo entries": (
        b"N" + b"".join(b"r" + struct.pack("<I", i) for i in range(500_001)) + b".",
        "remembers more than 500,000",
    ),
}


@pytest.mark.parametrize(("bomb", "what"), BOMBS.values(), ids=BOMBS.keys())
def test_a_bomb_is_defused_in_a_sentence(bomb, what):
    started = time.process_time()
    with pytest.raises(InputError) as refusal:
        load_all(bomb, "x.pdl", BUNDLE)
    assert time.process_time() - started < 2
    assert what in str(refusal.value)
    assert len(str(refusal.value)) < 400


@pytest.mark.parametrize("step", [b"N", b"\x80\x02", b"Nq\x00", b"G" + bytes(8)])
def test_the_number_of_steps_is_bounded_whatever_they_do(step, monkeypatch):
    monkeypatch.setattr(pdl, "MAX_OPCODES", 1000)
    assert load_single(b"](" + step * 400 + b"Ne.")
    with pytest.raises(InputError, match="has more than 1,000 opcodes; split the database"):
        load_single(b"](" + step * 1000 + b"Ne.")


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (b"]", "byte 1: here is no pickle opcode; the file is cut short"),
        (b"G\x00\x00", "byte 0: the file is cut short or damaged"),
        (b"I12", "byte 0: the file is cut short or damaged (no newline"),
        (b".", "byte 0: the pickle is damaged"),
        (b"e.", "byte 0: the pickle is damaged (could not find MARK)"),
        (b"](a.", "byte 0: the pickle is damaged"),
        (b"K\x01K\x02a.", "byte 0: the pickle is damaged"),
        (b"]K\x01K\x02s.", "byte 0: the pickle is damaged"),
        (b"(K\x01d.", "byte 0: the pickle is damaged (odd number of items for DICT)"),
        (b"}\x88Ns.", "byte 0: a key is of the type bool"),
        (b"}G\x00\x00\x00\x00\x00\x00\x00\x00Ns.", "a key is of the type float"),
        (b"S'abc\n.", "byte 0: the file is cut short or damaged"),
        (b"X\x02\x00\x00\x00\xff\xff.", "the pickle is damaged"),
        (b"V\\ud800\n.", "is no valid text"),
        (b"F1_0\n.", "byte 0: the pickle is damaged (could not convert string to float)"),
        (b"\xfe.", "byte 0: here is no pickle opcode"),
        (b"\x80\x04].", "protocol 4, and only those of Python 2 (0 to 2) are read"),
    ],
)
def test_damage_is_told_with_its_byte(data, what):
    with pytest.raises(InputError) as refusal:
        load_all(data, "x.pdl", frozenset())
    assert what in str(refusal.value)
    assert str(refusal.value).startswith("'x.pdl', byte ")


SAMPLE = (
    b"".join(
        pickle.dumps(part, protocol)
        for protocol in (0, 1, 2)
        for part in (["signals", "name"], 2, {0: {"name": "a", "signals": [[0.5, -1.5], []]}})
    )
    + b"(dp0\nS'l\\xe4'\nF1.5\nsI5\n(iauthors\nBundle\n}bsU\x01xL12345678901L\ns."
)


@settings(max_examples=200, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(["set", "cut", "insert", "repeat"]),
            st.integers(0, len(SAMPLE) - 1),
            st.binary(min_size=1, max_size=6),
        ),
        min_size=1,
        max_size=6,
    )
)
def test_a_damaged_pickle_is_read_or_refused_and_never_anything_else(damages):
    data = SAMPLE
    for kind, at, new in damages:
        if kind == "set":
            data = data[:at] + new + data[at + len(new) :]
        elif kind == "cut":
            data = data[:at]
        elif kind == "insert":
            data = data[:at] + new + data[at:]
        else:
            data = data[:at] + data[max(at - 40, 0) :]
    try:
        values = load_all(data, "x.pdl", BUNDLE)
    except InputError as refusal:
        sentence = str(refusal)
        assert sentence.startswith("'x.pdl', byte ")
        assert sentence.isprintable()
        assert len(sentence) < 400
    else:
        assert_plain(values)


def assert_plain(value):
    """Walk the value: nothing but plain data is in it, of these very types."""
    if type(value) in (list, tuple):
        for part in value:
            assert_plain(part)
    elif type(value) is dict:
        for key, part in value.items():
            assert type(key) in (str, int)
            assert_plain(part)
    else:
        assert value is None or type(value) in (str, int, float, bool, Opaque, type)
