"""Files of typed columns, arrays and streams as a stranger might send them: bytes changed.

Run by hand: ``python tests/fuzz/recordings.py parquet --count 5000 --seed 0``; or excel, xdf, c3d,
tdms, numpy_arrays, hdf5 or matlab. Files that are read in a process of their own are read in that
of the case here, so that what they do to it can be seen: HDF5's and SciPy's libraries in C end or
hold it up for a few mutations in a thousand, of which the command says in a sentence.
"""

import os
import random
import shutil
import sys
import zipfile
from importlib import import_module
from pathlib import Path

os.environ["ARROW_DEFAULT_MEMORY_POOL"] = "system"  # others reserve more than the bound
sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[2]))

import campaign
import h5py  # noqa: F401 - so that no child has to, as below
import scipy.io  # noqa: F401
from campaign import Campaign, run
from ros_bags import change_bytes

import forcelab.cli.commands.import_
import forcelab.formats.importing
import forcelab.formats.table  # noqa: F401
from forcelab.formats import arrays, hdf5, matlab
from tests.formats import array_files, column_files

campaign.MEMORY = 2**30
#: What makes whole files of each kind, by the module that reads it.
KINDS = {
    "parquet": column_files.whole_arrow,
    "excel": column_files.whole_workbooks,
    "xdf": column_files.whole_xdf,
    "c3d": column_files.whole_c3d,
    "tdms": column_files.whole_tdms,
    "numpy_arrays": array_files.whole_numpy,
    "hdf5": array_files.whole_hdf5,
    "matlab": array_files.whole_matlab,
}


def change_member(file: Path, chance: random.Random) -> None:
    """Change one of the files in a zip archive, which is whole otherwise."""
    with zipfile.ZipFile(file) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = chance.choice(sorted(members))
    changed = file.with_name("member")
    changed.write_bytes(members[name])
    if name.endswith(".npy"):  # its header says what follows
        content = bytearray(members[name])
        content[chance.randrange(128)] = chance.choice(b"0123456789,()' <>|fiUOV\x00\xff")
        changed.write_bytes(content)
    else:
        change_bytes(changed, chance)
    members[name] = changed.read_bytes()
    changed.unlink()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)


def mutate(whole: list[Path], place: Path, chance: random.Random) -> list[list[str]]:
    """Change a copy of a file; of an archive mostly a member."""
    source = chance.choice(whole)
    path = Path(shutil.copy(source, place / source.name))
    in_archive = zipfile.is_zipfile(path) and chance.random() < 0.7
    (change_member if in_archive else change_bytes)(path, chance)
    return [["import", str(place / "p.forcelab"), str(path), "--task", "t"]]


if __name__ == "__main__":
    chosen = sys.argv.pop(1)
    import_module(f"forcelab.formats.{chosen}")
    for module in (hdf5, matlab):
        module.read_apart = arrays.use_tree
    run(__doc__, Campaign(f"{chosen} file", KINDS[chosen], mutate))
