"""The metrics of an evaluation: names, units, and a sentence that explains each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from forcelab.recognition.metrics import look_up


@dataclass(frozen=True, slots=True)
class Metric:
    """A number of the scores."""

    path: str  # in the scores' JSON, such as "f1.50"
    name: str
    tip: str
    unit: str  # "%", "ms", "s", "" (a plain number from -1 to 1) or "#" (a count)
    better: int = 1  # 1 if more is better, -1 if less is, 0 if neither

    @property
    def title(self) -> str:
        return self.name if self.unit in ("", "#") else f"{self.name} ({self.unit})"

    def value(self, scores: Mapping[str, Any]) -> float | None:
        """The number in scores as of ``forcelab evaluate --json``, in its own unit."""
        score = look_up(scores, self.path)
        return None if score is None else float(score)

    def text(self, value: float | None, *, signed: bool = False) -> str:
        """The number as it is shown, with as many decimals in every row; a dash for none."""
        if value is None:
            return "–"
        decimals = {"%": 1, "ms": 0, "s": 2, "": 3, "#": 0}[self.unit]
        rounded = round(100.0 * value if self.unit == "%" else value, decimals) + 0.0  # no -0
        sign = "+" if signed and rounded > 0 else ""
        return f"{sign}{rounded:,.{decimals}f}".replace("-", "\u2212")

    def span(self, ends: tuple[float, float] | None, *, signed: bool = False) -> str:
        if ends is None:
            return "–"
        low, high = (self.text(end, signed=signed) for end in ends)
        return f"{low} to {high}"


_OVERLAP = (
    "Share of segments that are found: F1 of segments that overlap one of the same action by "
    "{} % of their union."
)
_CLOSED = "F1@{} with all unlabelled time cut out: a segment that goes on behind it is one."
_EDGES = (
    "{} % of the edges of matched segments are no further off than this. At unlabelled time every "
    "edge counts as right."
)
_EDGES_LABELLED = (
    "{} % of the edges of matched segments are no further off than this, with all unlabelled time "
    "cut out; the first and the last edge are left out."
)
_PERCENTS = (10, 25, 50)

#: How well predictions agree with the human, from samples to boundaries.
AGREEMENT_METRICS = (
    Metric(
        "accuracy", "Accuracy", "Share of the human-labelled samples that are predicted right.", "%"
    ),
    Metric(
        "balanced_accuracy",
        "Balanced",
        "Mean over the actions of the share of their samples predicted right.",
        "%",
    ),
    Metric(
        "coverage",
        "Coverage",
        "Share of the human-labelled samples that are predicted as any action.",
        "%",
        0,
    ),
    Metric(
        "kappa",
        "Kappa",
        "Cohen's kappa over samples: agreement beyond chance, 1 if it is full.",
        "",
    ),
    Metric(
        "edit",
        "Edit",
        "How alike the two sequences of actions are, whatever the segments' durations.",
        "%",
    ),
    *(Metric(f"f1.{p}", f"F1@{p}", _OVERLAP.format(p), "%") for p in _PERCENTS),
    *(Metric(f"f1_labelled.{p}", f"F1@{p} labelled", _CLOSED.format(p), "%") for p in _PERCENTS),
    Metric(
        "boundaries_found",
        "Boundaries found",
        "Human boundaries with a predicted one within 100 ms; unlabelled time is cut out.",
        "%",
    ),
    Metric("boundary_ms.median", "Boundary median", _EDGES.format(50), "ms", -1),
    Metric("boundary_ms.p90", "Boundary 90 %", _EDGES.format(90), "ms", -1),
    Metric(
        "boundary_labelled_ms.median",
        "Boundary median labelled",
        _EDGES_LABELLED.format(50),
        "ms",
        -1,
    ),
    Metric(
        "boundary_labelled_ms.p90", "Boundary 90 % labelled", _EDGES_LABELLED.format(90), "ms", -1
    ),
)

#: In which way predictions are wrong, after Ward et al.: numbers and seconds.
ERROR_METRICS = tuple(
    Metric(f"events.{kind}.{unit_name}", name, tip, unit, better)
    for kind, name, tip, better in (
        ("human", "Human", "Segments that the human labelled.", 0),
        ("predicted", "Predicted", "Segments that were predicted where the human labelled.", 0),
        (
            "insertion",
            "Insertions",
            "Predicted segments where there is no human one of their action.",
            -1,
        ),
        (
            "deletion",
            "Deletions",
            "Human segments that no predicted one of their action meets.",
            -1,
        ),
        (
            "fragmentation",
            "Fragmented",
            "Human segments that several predicted ones fall into.",
            -1,
        ),
        ("merge", "Merged", "Predicted segments that join several human ones.", -1),
        ("overfill", "Overfill", "Predicted segments that reach over an edge of a human one.", -1),
        (
            "underfill",
            "Underfill",
            "Predicted segments that stay short of an edge of a human one.",
            -1,
        ),
    )
    for unit_name, unit in (("count", "#"), ("seconds", "s"))
)


def reliability_text(scores: Mapping[str, Any]) -> str:
    """How far to rely on the probabilities, from an evaluation's JSON; "" without probabilities."""
    brier, error = scores.get("brier"), scores.get("ece")
    if brier is None or error is None:
        return ""
    return f"Brier score {brier:.3f}, expected calibration error {100 * error:.1f} points."


RELIABILITY_TIP = (
    "Brier score: squared differences between the probabilities and what is right, summed over "
    "the actions, mean over the samples; 0 is best, 2 worst.\n"
    "Expected calibration error: how far the probability of the likeliest action is from the "
    "share that is right, mean over ten bins of equal width."
)
