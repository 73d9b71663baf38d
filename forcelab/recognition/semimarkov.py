"""The semi-Markov model behind the decoder: what a segmentation of a stretch scores.

A segmentation of the steps ``0 .. n`` into segments, neighbours of different actions, scores

    start(k_1) + S(k_1, d_1) + sum_i [ follow(k_i, k_i+1) + F(k_i, d_i) ] + S(k_m, d_m)
        + sum_t evidence(t, action at t) + sum of change(t) wherever the action changes,

the first and the last segment cut off by the ends of what was recorded: of them is known only that
they last at least so long, S, and of the ones between how long they last, F. Both are log-normal
up to a length that is longer than nearly all, and fall by the same share a step from there on: so
nothing is too long to be, and a step costs no more the longer the recording is. Whole segments of
many steps are told apart in blocks of lengths, the middle one of which gives a block its height;
within a block F falls as it does at the end. All else is exact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.recognition.choreography import Choreography

__all__ = ["FINE", "LENGTHS", "STEP", "Scores", "Use"]

Real = NDArray[np.float64]

#: How much of the choreography is used.
Use = Literal["none", "durations", "order"]

#: Seconds of the step at which the weights are meant; at other steps they are converted, so that
#: finer steps, whose evidence is nearly the same twice, decide no differently.
STEP = 0.02
#: Seconds over which a duration's density is taken for a probability: shorter would make each
#: boundary dearer. From 0.02 to 0.5 s the order hides the difference; durations alone gain by it.
UNIT = 0.5
#: A segment is at least so long, as a share of the median of its action; at least one `STEP`.
SHORTEST = 1 / 8
#: Up to so many sd above the mean of the logarithms durations are log-normal.
LOG_NORMAL = 2.0
#: Such lengths are rounded up to powers of this number of steps, so that actions share tables.
ROUNDING = math.sqrt(2.0)
#: Up to so many steps each length is told apart; from there on so many at once, 6 % or less. At
#: the presets' 20 ms that begins at 2.6 s.
FINE, LENGTHS = 128, 8
#: Exponent of the probabilities of one 20 ms step. Neighbouring steps say nearly the same: 1 would
#: count it many times over.
EVIDENCE = 0.25
#: Exponent of the share of time of each action, by which probabilities are divided.
PRIOR = 0.5
#: Exponent of a duration's probability.
DURATION = 0.7
#: What a change of action costs, in nats, where neither durations nor order are used.
SWITCH = 1.0
#: Smallest probability, relative to the step's largest, that the classifier is believed.
FLOOR = 1e-3
#: Exponent of how much likelier than usual a change is to be near, where that is known (a
#: classifier of few demonstrations is less sure than it might be), and how much likelier it must
#: be, in nats: of a few places near a change the best is taken.
CHANGE, LIKELIER = 1.5, 0.5


@dataclass(frozen=True, eq=False)
class Scores:
    """The model's numbers at one step length; K actions, all logarithms in nats.

    Parameters
    ----------
    step : float
        Seconds.
    prior : ndarray, shape (K,)
        What is taken off the log probabilities.
    start : ndarray, shape (K,)
    follow : ndarray, shape (K, K)
        From the row's action to the column's; minus infinity from an action to itself.
    mean, sd : ndarray, shape (K,)
        Of the logarithm of durations in seconds.
    emphasis : float
        Exponent of durations; 0 leaves them out.
    shortest, longest : ndarray of int64, shape (K,)
        Fewest steps of a whole segment, and the steps up to which durations are log-normal.
    """

    step: float
    prior: Real
    start: Real
    follow: Real
    mean: Real
    sd: Real
    emphasis: float
    shortest: NDArray[np.int64]
    longest: NDArray[np.int64]

    @classmethod
    def of(cls, choreography: Choreography, step: float, use: Use) -> Scores:
        """The numbers of a choreography.

        Parameters
        ----------
        choreography : Choreography
        step : float
            Seconds between two steps.
        use : "none", "durations" or "order"
            "order" uses durations as well.

        Raises
        ------
        InputError
            If the step is not above 0, or there is no such use.
        """
        if not (step > 0 and math.isfinite(step)):
            raise InputError(f"The decoder's step must be longer than 0 s, not {step} s.")
        if use not in ("none", "durations", "order"):
            raise InputError(f"The decoder uses none, durations or order, not '{use}'.")
        K = len(choreography.actions)
        least = max(1, round(STEP / step))
        shortest = np.full(K, least)
        longest = shortest
        if use != "none":
            usual = SHORTEST * np.exp(choreography.mean) / step
            shortest = np.maximum(shortest, np.minimum(usual, 2**31).astype(np.int64))
            limit = np.exp(choreography.mean + LOG_NORMAL * choreography.sd) / step
            powers = np.ceil(np.log(np.clip(limit, 1.0, 2.0**31)) / math.log(ROUNDING))
            longest = np.maximum(shortest, np.ceil(ROUNDING**powers).astype(np.int64))
            # Whole blocks only: none is partly too short, and a table ends with one.
            shortest -= np.where(shortest > FINE, (shortest - FINE - 1) % LENGTHS, 0)
            blocks = -(-np.maximum(longest - FINE, 0) // LENGTHS)
            longest = np.where(blocks > 0, FINE + LENGTHS * blocks, longest)
        start = np.full(K, -math.log(max(K, 1)))
        follow = np.full((K, K), -SWITCH if use == "none" else -math.log(max(K - 1, 1)))
        if use == "order":
            with np.errstate(divide="ignore"):
                start, follow = np.log(choreography.start), np.log(choreography.follow)
        np.fill_diagonal(follow, -np.inf)
        return cls(
            step,
            PRIOR * np.log(choreography.share),
            start,
            follow,
            choreography.mean,
            choreography.sd,
            0.0 if use == "none" else DURATION,
            shortest,
            longest,
        )

    def evidence(self, log_probabilities: NDArray[np.floating]) -> Real:
        """What each step says for each action, shape (n, K) as `log_probabilities`; finite.

        Only differences within a step count. A step that rules out every action says nothing.
        """
        logs = np.asarray(log_probabilities, dtype=np.float64)
        top = np.maximum.reduce(logs, axis=1, keepdims=True)
        says = np.isfinite(top)
        every = bool(says.all())
        if not every:
            top, logs = np.where(says, top, 0.0), np.where(says, logs, 0.0)
        below = np.maximum(logs - top, math.log(FLOOR))
        # Steps longer than it takes evidence to be new count once each.
        exponent = min(1.0, EVIDENCE * self.step / STEP)
        below -= self.prior
        below *= exponent
        if not every:
            below[~says[:, 0]] = 0.0
        return below

    def changing(self, ratios: NDArray[np.floating]) -> Real:
        """What a change of actions scores right after each step, shape (n,).

        Nothing where durations are not used, as nothing else keeps an action from flickering there.

        Parameters
        ----------
        ratios : ndarray, shape (n,)
            How much likelier than usual a change is near each step, in nats.
        """
        above = np.asarray(ratios, dtype=np.float64) - LIKELIER
        scores = (CHANGE if self.emphasis else 0.0) * above
        # After the last one none is left to change to.
        return np.append(0.5 * (scores[:-1] + scores[1:]), 0.0)

    @property
    def slope(self) -> Real:
        """What each step beyond the longest adds, shape (K,); never positive."""
        seconds = self.longest * self.step
        z = (np.log(seconds) - self.mean) / self.sd
        fall = -(1.0 + z / self.sd) / self.longest
        return self.emphasis * np.minimum(fall, 0.0)

    def lasting(self, code: int | NDArray[np.int64], steps: NDArray[np.int64]) -> Real:
        """F: how probable it is that a segment lasts so many steps (>= 1); shapes broadcast."""
        table = np.minimum(steps, self.longest[code])
        within = (table - FINE - 1) % LENGTHS
        table = np.where(table > FINE, table - within + LENGTHS // 2, table)
        logs = np.log(table * self.step)
        z = (logs - self.mean[code]) / self.sd[code]
        density = -0.5 * z**2 - logs - np.log(math.sqrt(2 * math.pi) * self.sd[code] / UNIT)
        scores = self.emphasis * density + self.slope[code] * (steps - table)
        return np.where(steps >= self.shortest[code], scores, -np.inf)

    def outlasting(self, code: int | NDArray[np.int64], steps: NDArray[np.int64]) -> Real:
        """S: how probable it is that a segment lasts so many steps or more; shapes broadcast."""
        from scipy.special import log_ndtr

        table = np.minimum(steps, self.longest[code])
        z = (np.log(table * self.step) - self.mean[code]) / self.sd[code]
        return self.emphasis * log_ndtr(-z) + self.slope[code] * (steps - table)

    def per_place(self) -> Scores:
        """The same for sums over all places of a boundary, of which finer steps have more."""
        return replace(self, follow=self.follow + math.log(self.step / STEP))

    def anywhere(self) -> Scores:
        """The same of a stretch that does not begin with its demonstration."""
        return replace(self, start=np.full_like(self.start, -math.log(len(self.start))))

    def of_actions(self, order: NDArray[np.int64]) -> Scores:
        """The same with the actions in another order."""
        return replace(
            self,
            prior=self.prior[order],
            start=self.start[order],
            follow=self.follow[np.ix_(order, order)],
            mean=self.mean[order],
            sd=self.sd[order],
            shortest=self.shortest[order],
            longest=self.longest[order],
        )

    def reversed(self) -> Scores:
        """The same of time that runs backwards, from after the last step."""
        return replace(self, follow=self.follow.T.copy(), start=np.zeros_like(self.start))
