"""Files of arrays as a stranger might send them: bytes changed.

Run by hand: ``python tests/fuzz/arrays.py hdf5 --count 5000 --seed 0``. Files that are read in a
process of their own are read in that of the case here, so that what they do to it can be seen.
"""

import random
import shutil
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[2]))

import campaign
import h5py  # noqa: F401 - so that no child has to, as below
import scipy.io  # noqa: F401
from campaign import Finding, findings, run
from ros_bags import change_bytes

import forcelab.formats.importing  # noqa: F401
from forcelab.formats import arrays, hdf5, matlab
from tests.formats import array_files

campaign.MEMORY = 2**30
KINDS = {
    "numpy": array_files.whole_numpy,
    "hdf5": array_files.whole_hdf5,
    "matlab": array_files.whole_matlab,
}


def change_member(file: Path, chance: random.Random) -> None:
    """Change one of the arrays in a zip archive, which is whole otherwise."""
    with zipfile.ZipFile(file) as archive:
        members = {name: bytearray(archive.read(name)) for name in archive.namelist()}
    content = members[chance.choice(sorted(members))]
    content[chance.randrange(128)] = chance.choice(b"0123456789,()' <>|fiUOV\x00\xff")
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, bytes(data))


def cases(count: int, seed: int, whole: list[Path]) -> Iterator[tuple[str, Any]]:
    """Cases for :func:`campaign.findings`, each with the command line that is run on it."""
    for number in range(count):

        def write(place: Path, number: int = number) -> list[list[str]]:
            chance = random.Random(f"{seed} {number}")
            source = chance.choice(whole)
            path = Path(shutil.copy(source, place / source.name))
            change = change_bytes
            if path.suffix == ".npz" and chance.random() < 0.6:
                change = change_member
            change(path, chance)
            return [["import", str(place / "p.forcelab"), str(path), "--task", "t"]]

        yield f"file {number} of seed {seed}", write


def findings_of(kind: str, count: int, seed: int, folder: Path) -> Iterator[Finding]:
    """Mutate small files of a kind so many times and yield what was found."""
    whole = folder / "whole"
    whole.mkdir()
    found = KINDS[kind](whole)
    (folder / "cases").mkdir()
    yield from findings(cases(count, seed, found), folder / "cases")


if __name__ == "__main__":
    for module in (hdf5, matlab):
        module.read_apart = arrays.use_tree
    chosen = sys.argv.pop(1)
    run(__doc__, f"{chosen} files", lambda *arguments: findings_of(chosen, *arguments))
