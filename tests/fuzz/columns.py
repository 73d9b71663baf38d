"""Files with typed columns and streams as a stranger might send them: bytes changed.

Run by hand: ``python tests/fuzz/columns.py parquet --count 5000 --seed 0``.
"""

import os
import random
import shutil
import sys
import zipfile
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

os.environ["ARROW_DEFAULT_MEMORY_POOL"] = "system"  # others reserve more than the bound
sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[2]))

import campaign
from campaign import Finding, findings, run
from ros_bags import change_bytes

# So that no child has to.
import forcelab.cli.commands.import_
import forcelab.formats.importing
import forcelab.formats.table  # noqa: F401
from tests.formats import column_files

campaign.MEMORY = 2**30
#: Changes a file by chance.
Change = Callable[[Path, random.Random], None]
KINDS = {
    "parquet": column_files.whole_arrow,
    "excel": column_files.whole_workbooks,
    "xdf": column_files.whole_xdf,
    "c3d": column_files.whole_c3d,
    "tdms": column_files.whole_tdms,
}


def change_member(file: Path, chance: random.Random) -> None:
    """Change one of the files in a zip archive."""
    with zipfile.ZipFile(file) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    changed = file.with_name("member")
    changed.write_bytes(members[name := chance.choice(sorted(members))])
    change_bytes(changed, chance)
    members[name] = changed.read_bytes()
    changed.unlink()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)


def cases(
    whole: list[Path], change_member: Change, count: int, seed: int
) -> Iterator[tuple[str, Any]]:
    """Cases for :func:`campaign.findings`, each with the command line that is run on it."""
    for number in range(count):

        def write(place: Path, number: int = number) -> list[list[str]]:
            chance = random.Random(f"{seed} {number}")
            source = chance.choice(whole)
            path = Path(shutil.copy(source, place / source.name))
            in_archive = zipfile.is_zipfile(path) and chance.random() < 0.7
            (change_member if in_archive else change_bytes)(path, chance)
            return [["import", str(place / "p.forcelab"), str(path), "--task", "t"]]

        yield f"file {number} of seed {seed}", write


def findings_of(
    make_whole: Callable[[Path], list[Path]],
    change_member: Change,
    count: int,
    seed: int,
    folder: Path,
) -> Iterator[Finding]:
    """Mutate small files so many times, of archives mostly a member, and yield what was found."""
    (folder / "whole").mkdir()
    whole = make_whole(folder / "whole")
    (folder / "cases").mkdir()
    yield from findings(cases(whole, change_member, count, seed), folder / "cases")


if __name__ == "__main__":
    chosen = sys.argv.pop(1)
    import_module(f"forcelab.formats.{chosen}")
    run(__doc__, f"{chosen} files", partial(findings_of, KINDS[chosen], change_member))
