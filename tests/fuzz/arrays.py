"""Files of arrays as a stranger might send them: bytes changed.

Run by hand: ``python tests/fuzz/arrays.py hdf5 --count 5000 --seed 0``. Files that are read in a
process of their own are read in that of the case here, so that what they do to it can be seen.
"""

import random
import sys
import zipfile
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[2]))

import campaign
import h5py  # noqa: F401 - so that no child has to, as below
import scipy.io  # noqa: F401
from campaign import run
from columns import findings_of

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


if __name__ == "__main__":
    for module in (hdf5, matlab):
        module.read_apart = arrays.use_tree
    chosen = sys.argv.pop(1)
    run(__doc__, f"{chosen} files", partial(findings_of, KINDS[chosen], change_member))
