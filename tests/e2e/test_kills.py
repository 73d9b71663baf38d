"""The program is killed while somebody paints: what was seen on the screen is in the store."""

import json
import os
import random
import signal

from forcelab.project import Project
from tests.e2e.program import stored_segments

#: FORCELAB_KILLS=30 kills more often than the suite does.
KILLS = int(os.environ.get("FORCELAB_KILLS", "1"))


def test_every_painted_segment_that_was_seen_is_there(start, project):
    for number in range(KILLS):
        program = start(project, "--author", "Ada", "--demo", "pen 1")
        assert program.until(lambda state: state["settled"])["title"].startswith("pen 1")
        program.process.stdin.write(json.dumps({"ask": "paint"}) + "\n")
        program.process.stdin.flush()
        # Not at a moment that the program could know of: somewhere in the work after a line.
        strokes = random.Random(number).randint(3, 40)
        drawn = [program.answer() for _ in range(strokes)][-1]["seen"]
        program.process.send_signal(signal.SIGKILL)
        rest = program.process.stdout.read().splitlines()
        lines = [json.loads(line) for line in rest if line.endswith("}")]
        drawn = lines[-1]["seen"] if lines else drawn
        assert drawn
        stored = stored_segments(project, "pen 1")
        # A stroke that was stored, but not yet seen, may have joined or lengthened some of them.
        for start_, end, _ in drawn:
            covered = sum(max(0.0, min(e, end) - max(s, start_)) for s, e, _ in stored)
            assert covered > end - start_ - 2e-4
        with Project.open(project) as opened:  # so that the next time all is painted anew
            info = opened.demonstrations.infos()[0]
            opened.tracks.edit(
                info.id, "Ada", opened.tracks.get(info.id, "Ada").segments, (), "cleared"
            )
