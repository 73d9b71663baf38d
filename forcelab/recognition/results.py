"""The result of an evaluation: predictions, scores, intervals, and the record that a run stores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, reduce
from operator import add
from typing import Any, Final

import numpy as np

from forcelab.above import Drawing, call_above
from forcelab.arrays import Codes
from forcelab.demonstration import Demonstration
from forcelab.labels import Segment, Segments, from_codes
from forcelab.notebook import html_picture, html_table, html_title
from forcelab.recognition.intervals import Intervals, score_intervals
from forcelab.recognition.metrics import Counts, Scores, count, look_up, pool
from forcelab.recognition.probabilities import ProbabilityTrace, Reliability
from forcelab.recognition.recogniser import Prediction
from forcelab.recognition.settings import Settings
from forcelab.resources import versions
from forcelab.text import percent
from forcelab.vocabulary import Vocabulary

#: The stages of prediction that every run has scores of.
STAGES = ("raw", "filtered")
#: In the remark of an evaluation that tested labels which a recogniser had proposed.
TOO_HIGH: Final = "accepted unchanged, which makes scores too high"


@dataclass(frozen=True)
class DemonstrationResult:
    """What is predicted for one demonstration, as segments: stored by runs, reviewed, drawn."""

    id: str
    name: str
    task: str
    #: start, end: its first sample and the end of its last one, in seconds
    start: float
    end: float
    human: Segments  # as trained and scored with; empty in a proposal
    #: Predictions after each step: ``"raw"``, ``"threshold"``, ``"median"`` as far as they are
    #: switched on and were kept, and always ``"filtered"``
    stages: Mapping[str, Segments]
    probability_trace: ProbabilityTrace | None = None  # None where the run kept no probabilities
    #: By stage, as ``forcelab evaluate --json`` prints them; a run stores them apart
    scores: Mapping[str, Mapping[str, Any]] = field(default_factory=dict, repr=False)

    @classmethod
    def of(
        cls, demonstration: Demonstration, prediction: Prediction, human: Segments = ()
    ) -> DemonstrationResult:
        """A prediction as segments."""
        return cls(
            demonstration.id,
            demonstration.name,
            demonstration.task,
            demonstration.start,
            demonstration.end,
            human,
            {
                stage: from_codes(codes, prediction.times, prediction.actions)
                for stage, codes in prediction.stages.items()
            },
            prediction.probability_trace,
        )

    @property
    def predicted(self) -> Segments:
        """The final prediction."""
        return self.stages["filtered"]

    def confidence(self, action: str | None, start: float, end: float) -> float | None:
        """Mean probability of a predicted action over a stretch (s).

        None for unlabelled, and without probabilities.
        """
        if action is None or self.probability_trace is None:
            return None
        return self.probability_trace.of_action(action, start, end)

    def to_json(self) -> dict[str, Any]:
        """Plain values as a run stores them: without name and task, which may be changed."""
        tracks = {"human": self.human, **self.stages}
        plain: dict[str, Any] = {"demonstration": self.id, "start": self.start, "end": self.end}
        plain |= {
            name: [[s.start, s.end, s.action] for s in track] for name, track in tracks.items()
        }
        if self.probability_trace is not None:
            plain["certainty"] = self.probability_trace.to_json()
        return plain

    @classmethod
    def from_json(cls, plain: Mapping[str, Any], name: str, task: str) -> DemonstrationResult:
        """The inverse of :meth:`to_json`; a ValueError, or what it is of, where it is damaged."""
        # The last key is of earlier runs.
        others = ("demonstration", "start", "end", "certainty", "typicality")
        tracks = {
            key: tuple(Segment(float(start), float(end), action) for start, end, action in rows)
            for key, rows in plain.items()
            if key not in others
        }
        human = tracks.pop("human", ())
        start, end = float(plain["start"]), float(plain["end"])
        if "filtered" not in tracks or not start < end:
            raise ValueError("no prediction, or no time")
        trace = plain.get("certainty")
        return cls(
            id=plain["demonstration"],
            name=name,
            task=task,
            start=start,
            end=end,
            human=human,
            stages=tracks,
            probability_trace=None if trace is None else ProbabilityTrace.from_json(trace),
        )


@dataclass(frozen=True, kw_only=True)
class HeldOutPrediction(Prediction):
    """A prediction by a recogniser that has not seen the demonstration, beside the human's labels.

    It is at the demonstration's own stamps, whatever grid it was recognised on, so that scores of
    different grids compare; codes index the actions of the evaluation.
    """

    demonstration: Demonstration
    human: Codes  # (n,); codes

    @property
    def id(self) -> str:
        """The demonstration's."""
        return self.demonstration.id

    @property
    def name(self) -> str:
        """The demonstration's."""
        return self.demonstration.name

    @property
    def result(self) -> DemonstrationResult:
        """The prediction as segments."""
        human = from_codes(self.human, self.times, self.actions)
        return DemonstrationResult.of(self.demonstration, self, human)

    def counts(self, kind: str) -> Counts:
        """Compare a stage or an ablation with the human."""
        codes = (self.stages | self.ablations)[kind]
        return count(self.human, codes, self.times, self.actions)


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
    vocabulary : Vocabulary
        How a project draws the actions; empty where there is none.

    Examples
    --------
    >>> evaluation = forcelab.finish(forcelab.leave_one_out_job(labelled, settings))
    >>> pooled, each = evaluation.scores("filtered")
    >>> pooled.accuracy > 0.6, [scores.name for scores in each]
    (True, ['foam 01', 'foam 02', 'foam 03'])
    >>> evaluation.plot().save("pairs.svg")
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
    vocabulary: Vocabulary = field(default_factory=Vocabulary, repr=False)

    def plot(self) -> Drawing:
        """The timeline pairs of what was tested, as ``forcelab evaluate --figure`` draws them."""
        return call_above("plot", self)

    def _repr_html_(self) -> str:
        """As notebooks show it: the scores after the filters, and the timeline pairs."""
        pooled, each = self.scores("filtered")
        rows = [(scores.name, scores.to_json()) for scores in each]
        table = scores_html(rows, pooled.to_json(), self.intervals("filtered"))
        settings = f"{self.settings.preset}, {self.settings.classifier}"
        return html_title(self.title, settings) + table + html_picture(self.plot)

    @property
    def reliability(self) -> Reliability | None:
        """Reliability over all tested demonstrations; None where there were no probabilities."""
        parts = [item.reliability for item in self.tested if item.reliability is not None]
        return reduce(add, parts) if parts else None

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds: raw, filtered, and those without grammar, adaptation or added labels."""
        left_away = [
            kind
            for kind in ("unaided", "unadapted", "alone")
            if self.tested and all(kind in item.ablations for item in self.tested)
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
        for kind in self.kinds if self.tested else ():
            pooled, single = self.scores(kind)
            result[kind] = {
                "pooled": pooled.to_json(),
                "demonstrations": [scores.to_json() for scores in single],
                "intervals": self.intervals(kind).to_json(),
            }
        return result


#: The scores that a notebook shows, and what their columns are called.
SHOWN = {"accuracy": "accuracy", "coverage": "coverage", "edit": "edit", "f1.50": "F1@50"}


def scores_html(
    each: Sequence[tuple[str, Mapping[str, Any]]], pooled: Mapping[str, Any], ranges: Intervals
) -> str:
    """A table of scores in percent as notebooks show it, as they are in ``--json``."""
    rows = [
        [name, *(percent(look_up(record, metric)) for metric in SHOWN)]
        for name, record in [*each, ("pooled", pooled)]
    ]
    if not ranges.reason:
        intervals = (ranges[metric] for metric in SHOWN)
        texts = ["-" if i is None else f"{percent(i[0])}–{percent(i[1])}" for i in intervals]
        rows.append(["95 % interval", *texts])
    return html_table(["demonstration", *(f"{name} %" for name in SHOWN.values())], rows)


#: Share of the time steps that had an action before the filters; less is no timeline.
LEAST = 0.2
#: Hz, for which the scales of the presets are made.
USUAL = 1000


def empty_prediction_remarks(
    predicted: Sequence[Prediction], settings: Settings, rate: float
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
    if "wavelets" in settings.known_features:
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


def run_record(evaluation: Evaluation) -> dict[str, Any]:
    """An evaluation as a run stores it, as plain values."""
    record = evaluation.to_json()
    return {
        "digest": run_summary(evaluation.title, record),
        **record,
        "tracks": [item.result.to_json() for item in evaluation.tested],
    }


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
