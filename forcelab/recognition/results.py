"""The result of an evaluation: predictions, scores, intervals, and the record that a run stores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.labels import Segments, from_codes
from forcelab.recognition.intervals import Intervals, score_intervals
from forcelab.recognition.metrics import Counts, Scores, count, pool
from forcelab.recognition.probabilities import ProbabilityTrace, Reliability
from forcelab.recognition.recogniser import Prediction
from forcelab.recognition.settings import Settings
from forcelab.resources import versions


@dataclass(frozen=True)
class HeldOutPrediction:
    """One demonstration, recognised by a recogniser that has not seen it."""

    #: name, id: of the demonstration
    name: str
    id: str
    #: (n,); the demonstration's own stamps in seconds, whatever grid it was recognised on, so that
    #: scores of different grids compare
    times: NDArray[np.float64]
    actions: tuple[str, ...]  # the evaluation's; codes index it
    #: human, raw, filtered: (n,); codes by the human, by the classifier, and by the classifier
    #: after the filters
    human: NDArray[np.int64]
    raw: NDArray[np.int64]
    filtered: NDArray[np.int64]
    #: (n,); codes after the filters before the last one, ``"threshold"`` and ``"median"``, as far
    #: as they are switched on
    stages: dict[str, NDArray[np.int64]] = field(default_factory=dict)
    #: Probabilities of the actions that the recogniser knew; None where not requested
    probability_trace: ProbabilityTrace | None = None
    #: (n,); codes decoded without the grammar; None without a decoder
    unaided: NDArray[np.int64] | None = None
    #: (n,); codes that were recognised of what was recorded; None where nothing was adapted
    unadapted: NDArray[np.int64] | None = None
    #: (n,); codes as the coder's own labels alone teach them; None where no others were added
    alone: NDArray[np.int64] | None = None

    @property
    def start(self) -> float:
        """Time of the first sample, in seconds."""
        return float(self.times[0])

    @property
    def end(self) -> float:
        """Time at which the last sample ends, in seconds."""
        return float(self.times[-1] + np.median(np.diff(self.times)))

    def segments(self, kind: str) -> Segments:
        """Segments of ``"human"``, ``"raw"``, ``"filtered"`` or one of the stages."""
        codes = self.stages[kind] if kind in self.stages else getattr(self, kind)
        return from_codes(codes, self.times, self.actions)

    def counts(self, kind: str) -> Counts:
        """Compare ``"filtered"`` or another of the evaluation's kinds with the human."""
        return count(self.human, getattr(self, kind), self.times, self.actions)


@dataclass(frozen=True)
class Evaluation:
    """An evaluation and everything needed to repeat it.

    Parameters
    ----------
    title : str
        What was evaluated, such as ``"stylus"`` or ``"trained on LEGO, tested on cartridge"``.
    settings : Settings
    actions : tuple of str
        All actions in the order of their first occurrence.
    tested : tuple of HeldOutPrediction
        In the order of the demonstrations.
    rate : float
        Samples a second of the grid that was recognised on.
    channels : tuple of str
        Recognition channels.
    trained_on : tuple of str
        Ids of the demonstrations that were trained on; leaving one out, all but the tested one.
    seconds : dict of str to float
        Run time of ``features``, ``fit``, ``predict`` and ``filter``, each summed over folds.
    remarks : tuple of str
        What was left out, a sentence each.
    reliability : Reliability, optional
        Of the probabilities before they are decoded or filtered; None where there were none.
    """

    title: str
    settings: Settings
    actions: tuple[str, ...]
    tested: tuple[HeldOutPrediction, ...]
    rate: float
    channels: tuple[str, ...]
    trained_on: tuple[str, ...]
    seconds: dict[str, float]
    remarks: tuple[str, ...] = ()
    reliability: Reliability | None = None

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds: raw, filtered, and those without grammar, adaptation or added labels."""
        left_away = [
            kind
            for kind in ("unaided", "unadapted", "alone")
            if self.tested and all(getattr(item, kind) is not None for item in self.tested)
        ]
        return ("raw", *left_away, "filtered")

    def scores(self, kind: str) -> tuple[Scores, list[Scores]]:
        """Pooled scores, and each demonstration's, of one of :attr:`kinds`."""
        return self._scores[kind]

    def intervals(self, kind: str) -> Intervals:
        """Intervals of the pooled scores of one of :attr:`kinds`."""
        return self._intervals[kind]

    @cached_property
    def _counts(self) -> dict[str, list[Counts]]:
        """Each demonstration, counted once."""
        return {kind: [item.counts(kind) for item in self.tested] for kind in self.kinds}

    @cached_property
    def _scores(self) -> dict[str, tuple[Scores, list[Scores]]]:
        """All scores."""
        result = {}
        for kind, counts in self._counts.items():
            named = zip(self.tested, counts, strict=True)
            single = [pool(item.name, [part]) for item, part in named]
            result[kind] = (pool("pooled", counts), single)
        return result

    @cached_property
    def _intervals(self) -> dict[str, Intervals]:
        """All intervals, resampled once."""
        seed = self.settings.seed
        return {kind: score_intervals(counts, seed) for kind, counts in self._counts.items()}

    def to_json(self) -> dict[str, Any]:
        """Settings, seed, versions, labels, run times and all scores, as plain values."""
        result: dict[str, Any] = {
            "title": self.title,
            "preset": self.settings.preset,
            "settings": self.settings.to_json(),
            "seed": self.settings.seed,
            "versions": versions(),
            "labels": list(self.actions),
            "rate": self.rate,
            "channels": list(self.channels),
            "seconds": dict(self.seconds),
            "tested": [item.id for item in self.tested],
            "trained_on": list(self.trained_on),
            "remarks": list(self.remarks),
        }
        if self.reliability is not None:
            result["reliability"] = self.reliability.to_json()
        for kind in self.kinds:
            pooled, single = self.scores(kind)
            result[kind] = {
                "pooled": pooled.to_json(),
                "demonstrations": [scores.to_json() for scores in single],
                "intervals": self.intervals(kind).to_json(),
            }
        return result

    def tracks_to_json(self, *, stages: bool = False) -> list[dict[str, Any]]:
        """The segments of each demonstration, as plain values.

        Parameters
        ----------
        stages : bool
            Whether those after each filter are there, besides human, raw and filtered, and where
            the demonstration starts and ends.
        """
        return [
            {"demonstration": item.id}
            | ({"start": item.start, "end": item.end} if stages else {})
            | {
                kind: [[s.start, s.end, s.action] for s in item.segments(kind)]
                for kind in ("human", "raw", *(item.stages if stages else ()), "filtered")
            }
            for item in self.tested
        ]


#: Share of the time steps that had an action before the filters; less is no timeline.
LEAST = 0.2
#: Hz, for which the scales of the presets are made.
USUAL = 1000


def empty_prediction_remarks(
    predicted: Sequence[HeldOutPrediction | Prediction], settings: Settings, rate: float
) -> tuple[str, ...]:
    """A remark where the filters left no timeline, with the main filter and a likely cause."""

    def left(stage: str) -> int:
        codes = (prediction.stages.get(stage, prediction.filtered) for prediction in predicted)
        return sum(int(np.count_nonzero(each >= 0)) for each in codes)

    before = sum(int(np.count_nonzero(item.raw >= 0)) for item in predicted)
    if not before or left("all") >= LEAST * before:
        return ()
    filters = {
        "threshold": f"what is less probable than {settings.threshold} (threshold)",
        "median": f"what a median over {settings.median} samples turns (median)",
        "drop": f"what lasts less than {settings.drop} of the shortest segment trained on (drop)",
    }
    active = [name for name in filters if getattr(settings, name) is not None]
    if not active or settings.decodes:
        return ()
    counts = [before, *map(left, active)]
    culprit = max(range(len(active)), key=lambda i: counts[i] - counts[i + 1])
    cause = ""
    if settings.features == "wavelets":
        # To three digits, but as 1,020 and not as 1.02e+03.
        low, high = (float(f"{1000 * item / rate:.3g}") for item in settings.scales[[0, -1]])
        example = "" if rate == USUAL else f", such as {USUAL} Hz"
        cause = (
            f"; at {rate:.6g} Hz the scales are {low:,g} to {high:,g} ms, so try others or another "
            f"rate{example}"
        )
    share = 100 * left("all") / before
    return (
        f"The filters left {share:.1f} % of the predicted time, most of it taken by one that "
        f"unlabels {filters[active[culprit]]}{cause}; or train on more, or switch that filter off.",
    )


def run_title(tasks: Sequence[str], test_task: str | None) -> str:
    """The title of an evaluation."""
    title = " + ".join(tasks) or "no task"
    return title if test_task is None else f"{title} → {test_task or 'no task'}"


def run_record(evaluation: Evaluation, *, probability_trace: bool = False) -> dict[str, Any]:
    """An evaluation as a run stores it, as plain values.

    With `probability_trace` probabilities and the tracks after each filter are stored too.
    """
    record = evaluation.to_json()
    result = {"digest": run_summary(evaluation.title, record)} | record
    result["tracks"] = evaluation.tracks_to_json(stages=probability_trace)
    if probability_trace:
        result["certainty"] = {
            item.id: item.probability_trace.to_json()
            for item in evaluation.tested
            if item.probability_trace is not None
        }
    return result


def run_summary(title: str, record: Mapping[str, Any]) -> dict[str, Any]:
    """The few values that a list of runs shows; rates from 0 to 1, None where there is none."""
    pooled = record.get("filtered", {}).get("pooled", {})
    return {
        "title": title,
        "tested": len(record.get("tested", ())),
        "accuracy": pooled.get("accuracy"),
        "edit": pooled.get("edit"),
        "f1": pooled.get("f1", {}).get("50"),
    }
