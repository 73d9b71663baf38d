"""Label files of other programs as a stranger might send them: bytes changed, cut out, doubled.

Run by hand: ``python tests/fuzz/label_files.py elan --count 5000 --seed 0``; or csv, table,
audacity, boris, label-studio, textgrid or wide (a TextGrid as UTF-16).
"""

import json
import random
import shutil
import sys
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[2]))

import campaign
import numpy as np
from campaign import Campaign, run
from text_mutations import mutated_bytes

from forcelab.demonstration import Channel, Demonstration
from forcelab.formats.boris import Observation, to_boris
from forcelab.formats.elan import to_elan
from forcelab.formats.label_files import LABEL_FORMATS  # noqa: F401 - so that no child has to
from forcelab.formats.label_studio import forces_task
from forcelab.formats.textgrid import to_textgrid
from forcelab.formats.track_text import AnnotatedTrack, to_audacity, to_csv, to_statistics_table
from forcelab.labels import Segment, Track
from forcelab.project import Project
from forcelab.vocabulary import Vocabulary

campaign.MEMORY = 2**30
ANN = Track("Ann", tuple(Segment(k / 2, k / 2 + 0.4, f"action {k % 3}") for k in range(12)))
BEN = Track("Ben", (Segment(0.75, 1.5, "grab"), Segment(1.5, 7.0, 'hold, "firmly"')))
CODED = [AnnotatedTrack("pull", "foam", 10.0, "coder", track) for track in (ANN, BEN)]
OBSERVATIONS = [Observation("pull", "foam", track) for track in (ANN, BEN)]
#: What each kind of file is called, and what is in it.
KINDS = {
    "csv": ("pull.csv", lambda: to_csv([ANN, BEN]).encode()),
    "table": ("all.csv", lambda: to_statistics_table(CODED).encode()),
    "audacity": ("pull - Ann.txt", lambda: to_audacity(ANN).encode()),
    "boris": ("study.boris", lambda: to_boris("study", OBSERVATIONS, Vocabulary())),
    "label-studio": (
        "tasks.json",
        lambda: json.dumps([forces_task("pull", "foam", "pull.csv", [ANN, BEN], {})]).encode(),
    ),
    "elan": ("pull.eaf", lambda: to_elan([ANN, BEN], (), Path(), ["slip"], ["a_tsconf.xml"])),
    "textgrid": ("pull.TextGrid", lambda: to_textgrid([ANN, BEN], 10.0)),
    "wide": ("pull.TextGrid", lambda: to_textgrid([ANN, BEN], 10.0).decode().encode("utf-16")),
}


def prepare(folder: Path) -> Path:
    """A project with the demonstration that is labelled."""
    times = np.arange(1000) / 100
    pull = Demonstration("pull", "foam", times, np.sin(times)[:, None], (Channel("fz", "N"),))
    with Project.create(folder / "study.forcelab") as project:
        project.demonstrations.add(pull)
    return folder / "study.forcelab"


def mutate(kind: str, project: Path, place: Path, chance: random.Random) -> list[list[str]]:
    """Import a mutated file of a kind into a copy of the project."""
    name, content = KINDS[kind]
    (mutated,) = mutated_bytes(content(), 1, chance.getrandbits(32))
    shutil.copytree(project, place / project.name)
    (place / name).write_bytes(mutated)
    tiers = chance.choice(("authors", "actions"))
    words = ["labels", str(place / project.name), str(place / name), "--tiers", tiers]
    return [words, ["list", str(place / project.name)]]


if __name__ == "__main__":
    chosen = sys.argv.pop(1)
    run(__doc__, Campaign(f"{chosen} file", prepare, partial(mutate, chosen)))
