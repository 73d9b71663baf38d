"""HDF5 files written by h5py: what is read of them, and what a damaged one can do."""

import json
from dataclasses import replace

import numpy as np
import pytest
from factories import channel_names, read_single, refusal
from process_jobs import ending_process

from forcelab.cli import main
from forcelab.errors import UnclearRateError
from forcelab.formats import arrays, hdf5, preview, read
from forcelab.formats.recording import ReadOptions
from tests.formats.array_files import (
    CODES,
    FORCES,
    SAMPLES,
    TIMES,
    WORDS,
    actions,
    read_mutated,
    whole_hdf5,
)

h5py = pytest.importorskip("h5py")


@pytest.fixture
def inside(monkeypatch):
    """Read in this process."""
    monkeypatch.setattr(hdf5, "read_apart", arrays.use_tree)


@pytest.fixture
def path(tmp_path, inside):
    return tmp_path / "pull.h5"


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("<f2", {}),
        (">f4", {"chunks": (33, 2)}),
        ("<f8", {"chunks": (64, 3), "compression": "gzip", "shuffle": True}),
        (">i2", {"compression": "lzf", "fletcher32": True}),
        ("u1", {"compression": "gzip"}),
    ],
)
def test_numbers_are_kept_however_they_are_stored(path, kind, options):
    force = (FORCES * 50 + 100).astype(kind)
    with h5py.File(path, "w") as file:
        file["wrist/time"] = TIMES
        file.create_dataset("wrist/force", data=force, **options)
    demonstration = read_single(path).demonstration
    assert np.array_equal(demonstration.signals, force.astype(float))
    assert np.array_equal(demonstration.times, TIMES)


def test_attributes_tell_units_names_rate_scale_and_what_is_missing(path):
    counts = np.round(FORCES * 1000).astype("<i2")
    counts[7, 1] = -32768
    with h5py.File(path, "w") as file:
        data = file.create_dataset("adc/wrench", data=counts, compression="gzip")
        data.attrs.update({"units": "N", "scale_factor": 0.001, "add_offset": 1.5})
        data.attrs.update({"_FillValue": np.int16(-32768), "columns": ["left x", "left y", "z"]})
        file["adc"].attrs["sampling_rate"] = 500
    demonstration = read_single(path).demonstration
    channels = [(c.name, c.unit) for c in demonstration.channels]
    assert channels == [("left x", "N"), ("left y", "N"), ("z", "N")]
    assert demonstration.rate == pytest.approx(500)
    expected = counts * 0.001 + 1.5
    expected[7, 1] = np.nan
    assert np.allclose(demonstration.signals, expected, equal_nan=True)


def test_a_column_that_is_asked_for_by_its_own_name_is_told_apart(path):
    with h5py.File(path, "w") as file:
        file["t"], file["pose"], file["speed"] = TIMES, FORCES, FORCES
        file["pose"].attrs["columns"] = ["left x", "left y", "left z"]
    options = ReadOptions(signals=("left y",))
    assert channel_names(read(path, options)[0]) == ["left y"]
    uses = {use.name: use.use for use in preview(path, options)}
    columns = {"pose 1": "left out", "pose 2": "signal", "pose 3": "left out"}
    assert uses == {"t": "times", **columns, "speed": "left out"}


def test_uneven_stamps_are_kept(path):
    stamps = np.cumsum(np.random.default_rng(3).uniform(0.001, 0.003, SAMPLES))
    with h5py.File(path, "w") as file:
        file["t"], file["force"] = stamps, FORCES
    assert np.array_equal(read_single(path).demonstration.times, stamps - stamps[0])


@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_a_long_array_takes_its_own_memory_and_little_beside_it(
    kind, tmp_path, monkeypatch, peak_memory
):
    path, size = tmp_path / "long.h5", 300_000
    with h5py.File(path, "w") as file:
        file["t"] = np.cumsum(np.random.default_rng(3).uniform(0.001, 0.003, size))
        file["force"] = np.random.default_rng(4).normal(size=(size, 3)).astype(kind)
    read(path)  # the modules that it loads are not counted
    (recording,), peak = peak_memory(lambda: read(path))
    demonstration = recording.demonstration
    needed = demonstration.times.nbytes + demonstration.signals.nbytes
    assert peak < 1.2 * needed
    moved = replace(demonstration, name="another")
    assert moved.signals is demonstration.signals
    with pytest.raises(ValueError, match="read-only"):
        demonstration.signals[0] = 0
    monkeypatch.setattr(hdf5, "read_apart", arrays.use_tree)
    read(path)  # as above
    _, peak = peak_memory(lambda: read(path))
    assert peak < 1.7 * needed  # what is allocated; half of it is not used yet at the worst time


def strings(file):
    file.create_dataset("label", data=list(WORDS), dtype=h5py.string_dtype())


def fixed_strings(file):
    file["label"] = np.char.encode(WORDS)


def enumeration(file):
    kinds = h5py.enum_dtype({"grab": 0, "hold": 1, "none": -1}, basetype="i1")
    file.create_dataset("phase", data=CODES, dtype=kinds)


def flags(file):
    file["phase"] = CODES.astype("i1")
    file["phase"].attrs["flag_meanings"] = "grab hold"


def records(file):
    del file["t"], file["force"]
    table = np.zeros(SAMPLES, [("t", "f8"), ("fx", "f4"), ("label", "S4")])
    table["t"], table["fx"], table["label"] = TIMES, FORCES[:, 0], WORDS
    file["table"] = table


@pytest.mark.parametrize("write", [strings, fixed_strings, enumeration, flags, records])
def test_labels_are_words_or_codes_with_names(path, write):
    with h5py.File(path, "w") as file:
        file["t"], file["force"] = TIMES, FORCES
        write(file)
    assert actions(read_single(path)) == ["grab", "hold"]


def test_a_file_of_robomimic_is_a_demonstration_a_group(path):
    with h5py.File(path, "w") as file:
        for number in (0, 1, 2, 10):
            group = file.create_group(f"data/demo_{number}")
            group.attrs["num_samples"] = SAMPLES
            group["obs/robot0_eef_pos"] = FORCES + number
            group["obs/agentview_image"] = np.zeros((SAMPLES, 4, 4, 3), np.uint8)
            group["actions"], group["rewards"] = np.zeros((SAMPLES, 7)), np.zeros(SAMPLES)
        file["data"].attrs["env_args"] = '{"env_name": "Lift"}'
        file["mask/train"] = np.array([b"demo_0", b"demo_1"])
    assert "signals among actions (200 × 7), obs/robot0_eef_pos (200 × 3)" in refusal(path)
    recordings = read(path, ReadOptions(signals=("obs/robot0_eef_pos",), rate=20.0))
    found = [recording.demonstration for recording in recordings]
    assert [d.name for d in found] == [f"pull demo_{i}" for i in (0, 1, 2, 10)]
    assert np.array_equal(found[3].signals, FORCES + 10)
    assert channel_names(recordings[0]) == [f"robot0_eef_pos {i}" for i in (1, 2, 3)]
    assert "Pictures stay in the file; save them as a video and attach that." in (
        recordings[0].remarks
    )
    uses = {use.name: use for use in preview(path, ReadOptions())}
    listed = {"actions", "obs/agentview_image", "obs/robot0_eef_pos", "rewards", "mask/train"}
    assert set(uses) == listed
    assert uses["obs/agentview_image"].choices == ("left out",)


def test_a_file_of_robomimic_has_the_rate_of_its_environment(path):
    with h5py.File(path, "w") as file:
        file["data/demo_0/obs/robot0_ee_force"] = FORCES
        file["data"].attrs["env_args"] = json.dumps({"env_kwargs": {"control_freq": 20}})
    recording = read_single(path)
    assert recording.demonstration.rate == pytest.approx(20)
    assert "The file says that there are 20 samples a second." in recording.remarks
    assert read_single(path, rate=50.0).demonstration.rate == pytest.approx(50)
    with h5py.File(path, "a") as file:
        file["data/demo_0/t"] = TIMES
    assert np.array_equal(read_single(path).demonstration.times, TIMES)


@pytest.mark.parametrize(
    "text", ["{", "[]", "{}", '{"env_kwargs": {"control_freq": [20]}}', "[" * 10_000]
)
def test_an_environment_that_tells_no_rate_leaves_it_to_be_asked_for(path, text):
    with h5py.File(path, "w") as file:
        file["data/demo_0/obs/robot0_ee_force"] = FORCES
        file["data"].attrs["env_args"] = text
    assert "no column of times" in refusal(path, UnclearRateError)


def test_what_robomimic_keeps_a_step_later_is_no_second_sensor(path):
    with h5py.File(path, "w") as file:
        for name in ("obs", "next_obs"):
            file[f"data/demo_0/{name}/robot0_ee_force"] = FORCES
        file["data/demo_1/next_obs/robot0_ee_force"] = FORCES
    first, second = read(path, ReadOptions(rate=20.0))
    assert channel_names(first) == channel_names(second) == ["fx", "fy", "fz"]
    assert "Read from obs/robot0_ee_force." in first.remarks
    assert "Read from next_obs/robot0_ee_force." in second.remarks


def test_a_file_of_aloha_needs_its_rate_and_what_to_read(path):
    with h5py.File(path, "w") as file:
        file.attrs["sim"] = True
        for name in ("observations/qpos", "observations/qvel", "action"):
            file[name] = np.tile(np.arange(14.0), (SAMPLES, 1))
        file["observations/images/top"] = np.zeros((SAMPLES, 4, 4, 3), np.uint8)
    assert "no column of times" in refusal(path, UnclearRateError, signals=("observations/qpos",))
    recording = read_single(path, signals=("/observations",), rate=50.0)
    assert len(channel_names(recording)) == 28
    assert recording.demonstration.rate == pytest.approx(50)


class TestForeignFiles:
    def test_nothing_outside_the_file_is_opened(self, path, tmp_path):
        other = tmp_path / "other.h5"
        with h5py.File(other, "w") as file:
            file["force"] = FORCES
        (tmp_path / "raw").write_bytes(FORCES.tobytes())
        with h5py.File(path, "w") as file:
            file["t"], file["fx"] = TIMES, FORCES[:, 0]
            file["link"] = h5py.ExternalLink(str(other), "/force")
            file["soft"] = h5py.SoftLink("/link")
            layout = h5py.VirtualLayout(FORCES.shape, "f8")
            layout[:] = h5py.VirtualSource(str(other), "force", FORCES.shape)
            file.create_virtual_dataset("force", layout)
            raw = [(str(tmp_path / "raw"), 0, FORCES.nbytes)]
            file.create_dataset("wrench", FORCES.shape, "f8", external=raw)
        recording = read_single(path)
        assert channel_names(recording) == ["fx"]
        assert "force, wrench: left out, its data lie in other files." in recording.remarks
        assert "link: left out, a link to another file." in recording.remarks

    def test_what_a_filter_that_is_not_installed_compressed_is_left_out_and_named(self, path):
        """As PyTables and pandas compress with blosc."""
        with h5py.File(path, "w") as file:
            file["t"], file["force"] = TIMES, FORCES
            properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            properties.set_chunk((4,))
            properties.set_filter(32001, h5py.h5z.FLAG_OPTIONAL)
            space = h5py.h5s.create_simple((4,))
            data = h5py.h5d.create(file.id, b"wrench", h5py.h5t.IEEE_F64LE, space, properties)
            data.write_direct_chunk((0,), b"packed")
        recording = read_single(path)
        assert np.array_equal(recording.demonstration.signals, FORCES)
        assert "wrench: left out, compressed by " in recording.remarks[-1]
        assert recording.remarks[-1].endswith(", which h5py has not; write it with gzip.")

    def test_circles_end(self, path):
        with h5py.File(path, "w") as file:
            file["a/t"], file["a/force"] = TIMES, FORCES
            file["a/back"], file["a/again"] = file["/"], file["a"]
        assert channel_names(read_single(path)) == ["fx", "fy", "fz"]

    def test_what_is_nested_too_deep_is_refused(self, path):
        with h5py.File(path, "w") as file:
            file["/".join("abcdefgh" * 5)] = TIMES
        assert "nested deeper than 32 groups" in refusal(path)

    @pytest.mark.parametrize("chunks", [(10**5, 3), (5 * 10**6, 3)])
    def test_sizes_without_data_are_not_believed(self, path, chunks):
        with h5py.File(path, "w") as file:
            data = file.create_dataset("force", (10**9, 3), "f8", chunks=chunks, compression=9)
            if chunks[0] < 10**6:
                data[:10] = FORCES[:10]
        assert "force is said to hold" in refusal(path, rate=10.0)

    def test_mutated_files_are_a_sentence_each(self, path, tmp_path):
        pytest.importorskip("rosbags")
        (tmp_path / "whole").mkdir()
        read_mutated(whole_hdf5(tmp_path / "whole"), path)

    def test_a_file_that_ends_the_process_is_a_sentence(self, tmp_path, monkeypatch):
        monkeypatch.setattr(hdf5, "read_tree", ending_process)
        path = tmp_path / "a.h5"
        with h5py.File(path, "w") as file:
            file["force"] = FORCES
        assert "ended or held up the process that read it, as damaged files do" in refusal(path)


def test_the_command_reads_a_file_in_a_process_of_its_own(tmp_path, capsys):
    path = tmp_path / "pull.h5"
    with h5py.File(path, "w") as file:
        file["t"], file["force"], file["label"] = TIMES, FORCES, CODES + 1
    project = str(tmp_path / "p.forcelab")
    assert main(["import", project, str(path), "--task", "pull"]) == 0
    assert "1 recording: 1 new" in capsys.readouterr().out
    path.write_bytes(path.read_bytes()[:3000])
    assert main(["import", project, str(path)]) == 1
    assert "is not a whole HDF5 file (" in capsys.readouterr().err


def test_a_missing_library_is_named_with_the_extra_that_brings_it(path, monkeypatch):
    with h5py.File(path, "w") as file:
        file["force"] = FORCES

    def missing(name):
        raise ModuleNotFoundError(name, name=name)

    monkeypatch.setattr("forcelab.extras.import_module", missing)
    assert "is an HDF5 file, which needs the package h5py; install it with" in refusal(path)
