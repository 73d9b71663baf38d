"""An example or two of each command, at the end of its manual."""

from __future__ import annotations

from collections.abc import Mapping

__all__ = ["EXAMPLES"]

#: What to type, by the command's name.
EXAMPLES: Mapping[str, tuple[str, ...]] = {
    "gui": (
        "forcelab gui lab.forcelab --demo pull-03 --at 2.5",
        "forcelab gui lab.forcelab --workspace review --theme light --screenshot review.png",
    ),
    "demo": ("forcelab demo sample.forcelab",),
    "simulate": ("forcelab simulate --task marker --count 3 --seed 7 --out made.forcelab",),
    "import": (
        "forcelab import lab.forcelab recordings/*.csv --task stylus --videos",
        "forcelab import lab.forcelab left.bin --task foam --calibration left.toml",
    ),
    "list": (
        "forcelab list lab.forcelab --task stylus",
        "forcelab list lab.forcelab --to-label Ines",
    ),
    "runs": ("forcelab runs lab.forcelab --compare 1 2",),
    "assign": (
        "forcelab assign lab.forcelab pull-03 pull-04 --author Ines",
        "forcelab assign lab.forcelab --task stylus --author Ines --done",
    ),
    "note": ("forcelab note lab.forcelab pull-03 'sensor slipped at 3.2 s' --author Ines",),
    "agree": ("forcelab agree lab.forcelab --task stylus --authors Ines Tomas",),
    "attach": ("forcelab attach lab.forcelab pull-03 pull-03.mp4",),
    "sync": (
        "forcelab sync lab.forcelab pull-03 --accept",
        "forcelab sync lab.forcelab pull-03 --offset -0.287",
    ),
    "rename": ("forcelab rename lab.forcelab hold grip --author Ines --task stylus",),
    "remove": (
        "forcelab remove lab.forcelab pull-03 pull-04",
        "forcelab remove lab.forcelab --run 3 4 --yes",
    ),
    "capture": (
        "forcelab capture --list",
        "forcelab capture lab.forcelab --task foam --seconds 20 --camera 0 \\\n"
        '      --device "optoforce:/dev/ttyACM0?calibration=left.toml" \\\n'
        '      --device "encoder:/dev/ttyUSB1?scale=0.01&unit=mm"',
    ),
    "replay": ("forcelab replay lab.forcelab pull-03 --as text --lead 10",),
    "evaluate": (
        "forcelab evaluate lab.forcelab --task stylus --preset best --figure pairs.svg",
        "forcelab evaluate lab.forcelab --task stylus --test-names 'bob-*' --adapt",
    ),
    "train": (
        "forcelab train lab.forcelab --task stylus --preset best --out stylus.skops",
        "forcelab train lab.forcelab --task stylus --task foam --classifier svm --out both.skops",
    ),
    "predict": (
        "forcelab predict stylus.skops new.csv",
        "forcelab predict stylus.skops lab.forcelab --out predicted",
    ),
    "review": ("forcelab review lab.forcelab --task stylus --kind suspected --limit 10",),
    "why": ("forcelab why lab.forcelab pull-03 --at 1.8",),
    "export": (
        "forcelab export lab.forcelab --out labels --format table --task stylus",
        "forcelab export lab.forcelab --out backup --format archive",
    ),
    "plan": ("forcelab plan lab.forcelab pull-03 --preset best --measure",),
    "actions": ("forcelab actions slip 'slip transition'",),
    "figures": ("forcelab figures figures --format png",),
    "measure": (
        "forcelab measure cwt --quick",
        "forcelab measure recognition lab.forcelab --task stylus --figure tradeoff.svg",
    ),
    "doctor": ("forcelab doctor",),
}
