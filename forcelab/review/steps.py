"""How far a training is: phases, folds, epochs, and an honest guess at what is left."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from time import monotonic
from typing import Literal, TypeVar, cast

from forcelab.jobs import Progress
from forcelab.recognition.training import Epoch

__all__ = ["Phase", "Step", "Steps"]

Phase = Literal["features", "fold", "final fit", "proposals", "storing"]
MadeT = TypeVar("MadeT")

#: Parts of the progress that one fit is.
PARTS = 100


@dataclass(frozen=True, slots=True)
class Step(Progress):
    """How far a training is.

    Parameters
    ----------
    phase : "features", "fold", "final fit", "proposals" or "storing"
        What is being done; of the features, both for testing and for the final fit.
    fold, folds : int
        Which recogniser for testing is trained, from 1, of how many; 0 before the first.
    epoch : int or None
        Of the fit; None where it has none.
    loss : float or None
        After that epoch; None for classifiers that have none.
    seconds_left : float or None
        Estimated from what the fits before took; None until one is done.
    """

    phase: Phase = "features"
    fold: int = 0
    folds: int = 0
    epoch: int | None = None
    loss: float | None = None
    seconds_left: float | None = None


class Steps:
    """Turns the progress of the parts of a training into that of the whole.

    Parameters
    ----------
    folds : int
        Recognisers that are trained for testing.
    fit : bool
        Whether one is trained at the end.
    clock : callable
        Gives seconds.
    """

    def __init__(self, folds: int, fit: bool, clock: Callable[[], float] = monotonic) -> None:
        self.folds = folds
        self._fits = folds + fit
        self._clock = clock
        self._fold = 0
        self._done = 0  # fits
        self._took: list[float] = []  # seconds of each
        self._began = clock()  # the fit that is under way
        self._text = ""  # of that; empty while there is none

    def test(self, job: Generator[Progress, None, MadeT]) -> Generator[Step, None, MadeT]:
        """An evaluation as steps."""
        made = yield from self._of(job, "fold")
        self._fold = self.folds
        return made

    def fit(self, job: Generator[Progress, None, MadeT]) -> Generator[Step, None, MadeT]:
        """The final fit as steps."""
        # Testing may have been given up in the middle of it.
        self._done, self._text = self.folds, ""
        return (yield from self._of(job, "final fit"))

    def proposing(self, done: int, total: int, name: str) -> Step:
        """The step before a demonstration is recognised."""
        share = done / max(total, 1)
        return self._step("proposals", name, self._fits + share)

    def storing(self) -> Step:
        """The last step."""
        return self._step("storing", "storing", self._fits + 1)

    def _of(
        self, job: Generator[Progress, None, MadeT], phase: Phase
    ) -> Generator[Step, None, MadeT]:
        """The steps of a job."""
        try:
            while True:
                try:
                    progress = next(job)
                except StopIteration as end:
                    self._end_fit()
                    return cast(MadeT, end.value)
                yield self._seen(progress, phase)
        finally:
            job.close()

    def _seen(self, progress: Progress, phase: Phase) -> Step:
        """The step that a progress is."""
        if not isinstance(progress, Epoch):
            if progress.text != "features":
                self._end_fit()
                return self._step(phase, progress.text, self._done)
            self._began = self._clock()
            return self._step("features", "features", self._done)
        if progress.text != self._text:
            self._end_fit()
            self._text = progress.text
            self._fold += phase == "fold"
        share = progress.done / max(progress.total, 1)
        words = f"fold {self._fold} of {self.folds}" if phase == "fold" else "final fit"
        epoch = progress.done if progress.loss is not None else None
        return self._step(phase, words, self._done + share, epoch, progress.loss)

    def _end_fit(self) -> None:
        """Count the fit that is under way, if there is one; the next begins now."""
        if self._text:
            now = self._clock()
            self._took.append(now - self._began)
            self._began, self._text = now, ""
            self._done += 1

    def _step(
        self,
        phase: Phase,
        text: str,
        fits: float,
        epoch: int | None = None,
        loss: float | None = None,
    ) -> Step:
        """A step, with what is left."""
        return Step(
            done=round(PARTS * fits),
            total=PARTS * (self._fits + 1),
            text=text,
            phase=phase,
            fold=self._fold,
            folds=self.folds,
            epoch=epoch,
            loss=loss,
            seconds_left=self._left(),
        )

    def _left(self) -> float | None:
        """Seconds left: each fit that is not done takes as long as the mean of those that are."""
        if not self._took:
            return None
        mean = sum(self._took) / len(self._took)
        waiting = self._fits - self._done
        if not waiting:
            return 0.0
        return mean * (waiting - 1) + max(0.0, mean - (self._clock() - self._began))
