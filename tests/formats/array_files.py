"""Files of arrays as NumPy, SciPy, h5py and MATLAB write them, for tests and campaigns."""

import random
from pathlib import Path

import numpy as np

from forcelab.errors import InputError
from forcelab.formats import read

#: Samples of the recording that each file holds, at 500 Hz.
SAMPLES = 200
TIMES = np.arange(SAMPLES) / 500
FORCES = np.random.default_rng(0).normal(size=(SAMPLES, 3))
#: 60 samples of grab, 60 without a label, 80 of hold.
CODES = np.repeat([0, -1, 1], [60, 60, 80])
WORDS = np.array(["grab", "hold", ""])[CODES]


def write_npz(path: Path, packed: bool = False, **arrays) -> Path:
    (np.savez_compressed if packed else np.savez)(path, **arrays)
    return path


def write_mat(path: Path, version: str = "5", packed: bool = False, **variables) -> Path:
    from scipy.io import savemat

    savemat(path, variables, format=version, do_compression=packed)
    return path


class Mat73:
    """Writes a MATLAB file of version 7.3 as MATLAB does: HDF5 behind 512 bytes of text."""

    def __init__(self, path: Path) -> None:
        import h5py

        self.path, self._h5py = path, h5py

    def __enter__(self):
        self.file = self._h5py.File(self.path, "w", userblock_size=512)
        self._references = self.file.create_group("#refs#")
        return self

    def __exit__(self, *_: object) -> None:
        self.file.close()
        content = bytearray(self.path.read_bytes())
        text = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Fri Nov 27 12:00:00 2026"
        content[:128] = text.ljust(124) + b"\0\2IM"
        self.path.write_bytes(content)

    def numbers(self, group, name, values, kind="double", **options):
        """An array, whose axes are in reverse."""
        values = np.atleast_2d(values)
        data = group.create_dataset(name, data=np.ascontiguousarray(values.T), **options)
        data.attrs["MATLAB_class"] = np.bytes_(kind)
        return data

    def text(self, group, name, rows):
        """A char array: a text, or several of one length."""
        rows = [rows] if isinstance(rows, str) else rows
        letters = np.array([[ord(letter) for letter in row] for row in rows], "u2")
        if not letters.size:
            data = group.create_dataset(name, data=np.zeros(2, "u8"))
            data.attrs["MATLAB_empty"] = np.uint8(1)
        else:
            data = group.create_dataset(name, data=np.ascontiguousarray(letters.T))
        data.attrs["MATLAB_class"] = np.bytes_("char")
        data.attrs["MATLAB_int_decode"] = np.int32(2)
        return data

    def cell(self, group, name, values, kind="cell"):
        """A cell, or with no class a field of a struct with several elements, a column of it."""
        items = []
        for value in values:
            inner = f"r{len(self._references)}"
            write = self.text if isinstance(value, str) else self.numbers
            items.append(write(self._references, inner, value).ref)
        references = np.array([items], dtype=self._h5py.ref_dtype)
        data = group.create_dataset(name, data=references, dtype=self._h5py.ref_dtype)
        if kind:
            data.attrs["MATLAB_class"] = np.bytes_(kind)
        return data

    def struct(self, group, name):
        inner = group.create_group(name)
        inner.attrs["MATLAB_class"] = np.bytes_("struct")
        return inner


def write_mat73(path: Path) -> Path:
    """The recording with labels in a cell, and a struct with two elements."""
    with Mat73(path) as mat:
        mat.numbers(mat.file, "t", TIMES, compression="gzip")
        mat.numbers(mat.file, "force", FORCES, chunks=(1, 50))
        mat.cell(mat.file, "label", [str(word) for word in WORDS])
        mat.text(mat.file, "coder", "Ann")
        field = mat.struct(mat.file, "notes")
        mat.cell(field, "gain", [np.eye(3), np.eye(2)], kind="")
    return path


def whole_numpy(folder: Path):
    """Arrays, records and archives of arrays, plain and packed."""
    arrays = {"t": TIMES, "force": FORCES.astype(">f4"), "label": WORDS, "pose": np.eye(4)}
    np.save(folder / "a.npy", np.column_stack([TIMES, FORCES]))
    records = np.zeros(SAMPLES, [("t", "f8"), ("fx", "f4"), ("label", "U4")])
    records["t"], records["fx"], records["label"] = TIMES, FORCES[:, 0], WORDS
    np.save(folder / "b.npy", records)
    write_npz(folder / "c.npz", **arrays)
    write_npz(folder / "d.npz", packed=True, label_names=np.array(["grab", "hold"]), **arrays)
    return sorted(folder.iterdir())


def whole_hdf5(folder: Path):
    """Data sets of most layouts and types, and several demonstrations."""
    import h5py

    for name, version in (("a.h5", "earliest"), ("b.h5", "latest")):
        with h5py.File(folder / name, "w", libver=version) as file:
            file["time"] = TIMES
            counts = (FORCES * 100).astype(">i2")
            force = file.create_dataset("force", data=counts, chunks=(64, 3), compression="gzip")
            force.attrs["scale_factor"], force.attrs["units"] = 0.01, "N"
            file.create_dataset("label", data=list(WORDS), dtype=h5py.string_dtype())
            kinds = h5py.enum_dtype({"grab": 0, "hold": 1, "none": -1}, basetype="i1")
            file.create_dataset("phase", data=CODES, dtype=kinds)
            file.create_dataset("image", data=np.zeros((SAMPLES, 4, 4, 3), np.uint8), chunks=True)
            file["link"], file["soft"] = h5py.ExternalLink("a.h5", "x"), h5py.SoftLink("/force")
            file["group/back"] = file["/"]
    with h5py.File(folder / "c.h5", "w") as file:
        for number in (0, 1, 10):
            file[f"data/demo_{number}/obs/wrist_force"] = FORCES.astype("f2")
            file[f"data/demo_{number}/obs/time"] = TIMES
        file["data"].attrs["env_args"] = "{}"
        records = np.zeros(SAMPLES, [("t", "f8"), ("fx", "f4"), ("label", "S4")])
        file.create_dataset("table", data=records, shuffle=True, fletcher32=True, chunks=(50,))
    return sorted(folder.iterdir())


def whole_matlab(folder: Path):
    """Each version of MATLAB's files, with structs and cells."""
    words = WORDS.astype(object)
    variables = {"t": TIMES, "force": FORCES, "label": words, "Fs": 500.0, "coder": "Ann"}
    trials = [{"t": TIMES, "force": FORCES + i, "phase": CODES} for i in range(2)]
    write_mat(folder / "a.mat", version="4", t=TIMES, force=FORCES)
    write_mat(folder / "b.mat", **variables)
    write_mat(folder / "c.mat", packed=True, **variables)
    write_mat(folder / "d.mat", trials=trials, names=np.array(["grab", "hold"], object))
    write_mat73(folder / "e.mat")
    return sorted(folder.iterdir())


def read_mutated(whole: list[Path], path: Path) -> None:
    """Read mutations of whole files under a name; what is refused is refused in a sentence."""
    from tests.fuzz.ros_bags import change_bytes  # needs rosbags

    for number, source in enumerate(whole * 4):
        path.write_bytes(source.read_bytes())
        chance = random.Random(number)
        for _ in range(4):
            change_bytes(path, chance)
        try:
            read(path)
        except InputError as error:
            assert str(error).isprintable()


def actions(recording):
    return [segment.action for track in recording.tracks for segment in track.segments]
