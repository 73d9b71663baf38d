"""Outcomes made by hand, for tests of what shows them."""

from datetime import datetime, timezone

import numpy as np

from forcelab.labels import Segment
from forcelab.recognition.metrics import count_segments, pool
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.recognition.settings import Settings
from forcelab.review.run_result import DemonstrationResult, RunResult

__all__ = ["drawn_outcome", "outcome_of", "reviewed"]


def reviewed(id_, human, predicted, raw=None, probability_trace=None, task="foam"):
    """One demonstration of ten seconds; segments are (start, end, action)."""
    stages = {"filtered": tuple(Segment(*s) for s in predicted)}
    if raw is not None:
        stages["raw"] = tuple(Segment(*s) for s in raw)
    human = tuple(Segment(*s) for s in human)
    return DemonstrationResult(
        id_, f"{task} {id_}", task, 0.0, 10.0, human, stages, probability_trace
    )


def outcome_of(tested, actions, number=1, settings=None):
    """An outcome with the scores that ``forcelab evaluate`` would find."""
    scores = {}
    for stage in ("raw", "filtered"):
        counts = [count_segments(d.human, d.stages.get(stage, ()), actions) for d in tested]
        scores[stage] = {
            "pooled": pool("pooled", counts).to_json() if counts else {},
            "demonstrations": [
                pool(d.name, [c]).to_json() for d, c in zip(tested, counts, strict=True)
            ],
        }
    return RunResult(
        number=number,
        time=datetime(2026, 1, number, tzinfo=timezone.utc),
        title="foam",
        tasks=("foam",),
        test_task=None,
        author="Ada",
        apart=False,
        settings=settings or Settings(),
        actions=tuple(actions),
        labels=(),
        tested=tuple(tested),
        scores=scores,
    )


def drawn_outcome(ids, actions, seed=0, right=0.75, number=1):
    """Demonstrations whose segments are predicted right for a share, else confused or missed."""
    random = np.random.default_rng(seed)
    tested = []
    for id_ in ids:
        edges = np.linspace(0.0, 10.0, 12).round(3).tolist()
        which = random.integers(0, len(actions), 11).tolist()
        human = [(a, b, actions[w]) for a, b, w in zip(edges, edges[1:], which, strict=False)]
        predicted, raw = [], []
        for (start, end, action), w in zip(human, which, strict=True):
            shift = float(random.uniform(0, 0.2))
            near = actions[(w + int(random.integers(1, 3))) % len(actions)]
            seen = action if random.random() < right else near
            raw += [(start, start + 0.3, near), (start + 0.3, end, seen)]
            if random.random() < 0.9:
                predicted.append((round(start + shift, 3), end, seen))
        values = random.integers(60, 255, (500, len(actions))).astype(np.uint8)
        certainty = ProbabilityTrace(0.0, 50.0, tuple(actions), values)
        tested.append(reviewed(id_, human, predicted, raw, certainty))
    return outcome_of(tested, actions, number)
