"""MATLAB files: versions 4 to 7 as SciPy writes them, 7.3 as MATLAB does."""

from pathlib import Path

import numpy as np
import pytest
import scipy.io
from factories import channel_names, read_single, refusal

from forcelab.errors import InputError
from forcelab.formats import arrays, identify, matlab, preview, read
from forcelab.formats.recording import ReadOptions
from tests.formats.array_files import (
    CODES,
    FORCES,
    SAMPLES,
    TIMES,
    WORDS,
    Mat73,
    actions,
    read_mutated,
    whole_matlab,
    write_mat,
    write_mat73,
)


@pytest.fixture
def inside(monkeypatch):
    """Read in this process."""
    monkeypatch.setattr(matlab, "read_apart", arrays.use_tree)


@pytest.fixture
def path(tmp_path, inside):
    return tmp_path / "pull.mat"


@pytest.mark.parametrize("version", ["4", "5"])
@pytest.mark.parametrize("shape", ["row", "column"])
def test_vectors_are_alike_in_every_version(path, version, shape):
    times = TIMES.reshape((1, -1) if shape == "row" else (-1, 1))
    write_mat(path, version, t=times, force=FORCES)
    assert identify(path).name == "matlab"
    demonstration = read_single(path).demonstration
    assert np.array_equal(demonstration.signals, FORCES)
    assert np.array_equal(demonstration.times, TIMES)


@pytest.mark.parametrize("packed", [False, True], ids=["v6", "v7"])
@pytest.mark.parametrize("label", [WORDS.astype(object), WORDS], ids=["cell", "char"])
def test_words_in_cells_and_in_char_arrays_are_labels(path, packed, label):
    write_mat(path, packed=packed, force=FORCES, Fs=500, label=label)
    recording = read_single(path)
    assert recording.demonstration.rate == pytest.approx(500)
    assert actions(recording) == ["grab", "hold"]


@pytest.mark.parametrize("kind", ["f4", "f8", "i1", "u2", "i4", "?"])
def test_numbers_of_any_class_are_kept(path, kind):
    force = (FORCES * 50).astype(kind)
    write_mat(path, t=TIMES, force=force)
    assert np.array_equal(read_single(path).demonstration.signals, force.astype(float))


def test_fields_of_structs_are_named_by_their_path(path):
    record = {"meta": {"coder": "Ann"}, "arm": {"F": FORCES, "clock": TIMES}}
    write_mat(path, rec=record)
    recording = read_single(path, signals=("rec.arm.F",), time="rec.arm.clock")
    assert channel_names(recording) == ["F 1", "F 2", "F 3"]
    assert np.array_equal(recording.demonstration.times, TIMES)
    uses = {use.name: use.size for use in preview(path, ReadOptions())}
    assert uses == {"rec.arm.F": "200 × 3", "rec.arm.clock": "1 × 200"}


def test_a_struct_array_of_trials_is_a_demonstration_each(path):
    trials = [{"t": TIMES, "force": FORCES + i, "phase": CODES + 1} for i in range(3)]
    write_mat(path, trials=trials, note="three trials")
    recordings = read(path)
    assert [r.demonstration.name for r in recordings] == ["pull 1", "pull 2", "pull 3"]
    assert np.array_equal(recordings[2].demonstration.signals, FORCES + 2)
    assert actions(recordings[0]) == ["1", "0", "2"]


def test_complex_numbers_are_refused_only_where_they_are_chosen(path):
    write_mat(path, t=TIMES, force=FORCES, impedance=FORCES[:, 0] + 1j, empty={})
    assert channel_names(read_single(path)) == ["fx", "fy", "fz"]
    assert "impedance is sparse or holds complex numbers" in refusal(path, signals=("impedance",))
    assert [use.name for use in preview(path, ReadOptions())] == ["t", "force", "impedance"]


def test_what_only_matlab_can_read_is_left_out_and_named(path):
    from scipy.sparse import eye

    write_mat(path, t=TIMES, force=FORCES, sparse=eye(4, format="csc"))
    assert read_single(path).remarks[-1] == (
        "sparse: left out, which only MATLAB can read; save them there as numbers or texts, as "
        "with cellstr(labels) or table2array."
    )


def test_a_table_is_left_out_and_named_and_the_arrays_beside_it_are_read(path):
    """MATLAB writes tables, strings and times of the day as objects, of which SciPy lists none."""
    import struct

    def element(kind, content):
        padding = b"\0" * (-len(content) % 8)
        return struct.pack("<II", kind, len(content)) + content + padding

    def variable(flags, *elements):
        return element(14, element(6, struct.pack("<II", flags, 0)) + b"".join(elements))

    write_mat(path, t=TIMES, force=FORCES)
    shape, numbers = element(5, struct.pack("<ii", 6, 1)), element(6, struct.pack("<6I", *range(6)))
    inside = variable(13, shape, element(1, b""), numbers)
    words = (element(1, word) for word in (b"notes", b"MCOS", b"table"))
    with path.open("ab") as file:
        file.write(variable(17, *words, inside))
    recording = read_single(path)
    assert np.array_equal(recording.demonstration.signals, FORCES)
    assert recording.remarks[-1].startswith("notes: left out, which only MATLAB can read; save")


class TestVersion73:
    def test_arrays_lie_in_it_with_their_axes_in_reverse(self, path):
        pytest.importorskip("h5py")
        recording = read_single(write_mat73(path))
        assert np.array_equal(recording.demonstration.signals, FORCES)
        assert np.array_equal(recording.demonstration.times, TIMES)
        assert actions(recording) == ["grab", "hold"]

    def test_struct_arrays_and_char_arrays(self, path):
        pytest.importorskip("h5py")
        with Mat73(path) as mat:
            trials = mat.struct(mat.file, "trial")
            mat.cell(trials, "force", [FORCES, -FORCES], kind="")
            mat.cell(trials, "t", [TIMES, TIMES], kind="")
            rows = [f"{word:4}" for word in WORDS]
            mat.text(mat.file, "label", rows)
            table = mat.numbers(mat.file, "table", np.zeros((1, 6)), kind="table")
            table.attrs["MATLAB_object_decode"] = np.int32(3)
        recordings = read(path)
        assert [recording.demonstration.name for recording in recordings] == ["pull 1", "pull 2"]
        assert np.array_equal(recordings[1].demonstration.signals, -FORCES)
        assert actions(recordings[1]) == ["grab", "hold"]
        remarks = " ".join(recordings[0].remarks)
        assert "table: left out, which only MATLAB can read; save them there as" in remarks

    def test_a_cell_that_holds_itself_is_refused(self, path):
        h5py = pytest.importorskip("h5py")
        with Mat73(path) as mat:
            cell = mat.cell(mat.file, "c", [TIMES])
            cell[0, 0] = cell.ref
            assert isinstance(cell[0, 0], h5py.Reference)
        assert "nested deeper than 32 cells" in refusal(path)


class TestDamage:
    def test_what_unpacks_to_more_than_can_be_believed_is_not_read(self, path, monkeypatch):
        monkeypatch.setattr(matlab, "ROOM", 2**16)
        write_mat(path, packed=True, force=np.zeros((10**5, 3)))
        assert "which is not believed; save it again without compression" in refusal(path)

    @pytest.mark.parametrize("packed", [False, True])
    def test_a_file_that_ends_early_is_told_so(self, path, packed):
        write_mat(path, packed=packed, t=TIMES, force=FORCES)
        path.write_bytes(path.read_bytes()[:-700])
        assert "ends within a variable; copy it again" in refusal(path)

    def test_mutated_files_are_a_sentence_each(self, path, tmp_path):
        pytest.importorskip("rosbags")
        (tmp_path / "whole").mkdir()
        read_mutated(whole_matlab(tmp_path / "whole"), path)

    def test_numbers_that_are_no_file_of_version_4_are_none(self, path):
        path.write_bytes(bytes(4096))
        assert "a file of zeros" in refusal(path)
        assert SAMPLES  # and one that is called otherwise is told by its content alone
        write_mat(path.with_suffix(".bin.mat"), "4", t=TIMES)
        path.with_suffix(".bin.mat").rename(path.with_suffix(".bin"))
        with pytest.raises(InputError):
            identify(path.with_suffix(".bin"))


#: Files that MATLAB itself wrote, of versions 4 to 7.4, with damaged ones among them.
REAL = Path(scipy.io.matlab.__file__).parent / "tests" / "data"


@pytest.mark.skipif(not REAL.is_dir(), reason="SciPy came without the files of its tests")
@pytest.mark.usefixtures("inside")
class TestFilesOfMatlab:
    @pytest.mark.parametrize("name", sorted(path.name for path in REAL.glob("testmatrix_*.mat")))
    def test_numbers_are_those_that_scipy_reads(self, name):
        recording = read_single(REAL / name, rate=10.0)
        expected = scipy.io.loadmat(REAL / name)["testmatrix"]
        rows = expected if expected.shape[0] > expected.shape[1] else expected.T
        assert np.array_equal(recording.demonstration.signals, rows)

    def test_each_is_read_or_refused_in_a_sentence(self):
        for file in REAL.glob("*.mat"):
            try:
                assert read(file, ReadOptions(rate=10.0))
            except InputError as error:
                assert file.name in str(error)
                assert str(error).isprintable()
