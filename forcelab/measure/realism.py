"""The simulated beside the real: figures that tell whether recordings are alike."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np

from forcelab.jobs import Progress
from forcelab.measure.statistics import figures
from forcelab.recognition.evaluation import leave_one_out
from forcelab.recognition.examples import Labelled
from forcelab.recognition.presets import preset
from forcelab.recognition.settings import Settings

__all__ = ["FACTOR", "MARK", "Comparison", "cells", "realism", "recognition"]

#: Figures further apart than this factor are marked.
FACTOR = 2.0
MARK = "!"


@dataclass(frozen=True, slots=True)
class Comparison:
    """One figure of simulated and of real recordings.

    Parameters
    ----------
    name : str
        What it is, such as ``"grab: duration, median"``.
    unit : str
        Empty where it has none.
    simulated, real : float
        Finite and not negative.
    """

    name: str
    unit: str
    simulated: float
    real: float

    @property
    def ratio(self) -> float | None:
        """Simulated over real; None where the real one is zero."""
        return self.simulated / self.real if self.real else None

    @property
    def alike(self) -> bool:
        """Whether the two are equal or no more than :data:`FACTOR` apart."""
        if self.ratio is None:
            return self.simulated == self.real
        return 1 / FACTOR <= self.ratio <= FACTOR


def realism(simulated: Sequence[Labelled], real: Sequence[Labelled]) -> tuple[Comparison, ...]:
    """Compare simulated with real recordings of one task.

    Parameters
    ----------
    simulated, real : sequence of Labelled
        Which spell the actions alike.

    Returns
    -------
    tuple of Comparison
        Figures that a side does not tell are left out. An action that only one side has shows in
        its number of segments, which is then zero on the other.

    Raises
    ------
    InputError
        If a side is empty, or a demonstration has no labels or no 3-axis force sensor.
    """
    sides = simulated, real
    spelled = [segment.action for side in sides for item in side for segment in item.segments]
    ours, theirs = (figures(side, tuple(dict.fromkeys(spelled))) for side in sides)
    return tuple(
        Comparison(name, unit, value, theirs[name, unit])
        for (name, unit), value in ours.items()
        if np.isfinite([value, theirs.get((name, unit), np.nan)]).all()
    )


def recognition(
    simulated: Sequence[Labelled],
    real: Sequence[Labelled],
    settings: Settings | None = None,
    jobs: int = 1,
) -> Generator[Progress, None, tuple[Comparison, ...]]:
    """Compare how well a recogniser does on each side, leaving one demonstration out.

    A simulation that is recognised much better than the real recordings is a toy.

    Parameters
    ----------
    simulated, real : sequence of Labelled
    settings : Settings, optional
        By default the preset ``paper``, trained on every tenth sample, which scores the same.
    jobs : int
        Processes that share the folds.

    Raises
    ------
    InputError
        If a side has fewer than two labelled demonstrations.
    """
    chosen = settings or preset("paper").replace(stride=10)
    scores = []
    for side in (simulated, real):
        evaluation = yield from leave_one_out(side, chosen, jobs=jobs)
        scores.append(
            {
                f"{which}: {measure.replace('_', ' ')}": getattr(
                    evaluation.scores(which)[0], measure
                )
                for which in ("raw", "filtered")
                for measure in ("accuracy", "balanced_accuracy", "edit")
            }
        )
    ours, theirs = scores
    return tuple(
        Comparison(name, "", ours[name], theirs[name])
        for name in ours
        if ours[name] is not None and theirs[name] is not None
    )


def cells(rows: Sequence[Comparison]) -> list[list[str]]:
    """Header and rows as text: the mark of what is not alike, figure, unit and three numbers."""
    return [
        ["", "figure", "unit", "simulated", "real", "ratio"],
        *(
            [
                "" if row.alike else MARK,
                row.name,
                row.unit,
                f"{row.simulated:.3g}",
                f"{row.real:.3g}",
                "-" if row.ratio is None else f"{row.ratio:.2f}",
            ]
            for row in rows
        ),
    ]
