"""Evaluation as if demonstrations came live: each label rests on what its latency lets it see."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter

import numpy as np

from forcelab.recognition.decided import Decided
from forcelab.recognition.evaluation import Job, ready_to_part, tested_by, together
from forcelab.recognition.examples import Examples, Labelled, common_rate
from forcelab.recognition.folds import relied_on
from forcelab.recognition.online import check_latency, with_latency
from forcelab.recognition.recogniser import Prediction, Recogniser
from forcelab.recognition.results import Evaluation, Tested
from forcelab.recognition.settings import Settings
from forcelab.recognition.silence import silence_remark
from forcelab.recognition.training import training
from forcelab.recognition.trimming import Contradicted, remark_on

__all__ = ["leave_one_out_live"]


def leave_one_out_live(
    labelled: Sequence[Labelled],
    settings: Settings,
    latency: float,
    title: str = "",
    folds: int | None = None,
) -> Job:
    """Recognise each demonstration as a stream, by a recogniser trained on all the others.

    Parameters
    ----------
    labelled : sequence of Labelled
        Demonstrations without a segment take no part.
    settings : Settings
    latency : float
        Seconds from a force to its label.
    title : str
    folds : int, optional
        As of :func:`~forcelab.recognition.evaluation.leave_one_out`.

    Yields
    ------
    Progress

    Returns
    -------
    Evaluation
        Its raw predictions are the filtered ones.

    Raises
    ------
    InputError
        If fewer than two demonstrations are labelled, they do not fit together, or a recogniser
        with these settings cannot follow a stream.
    """
    check_latency(latency)
    used, parts, remarks = ready_to_part(labelled, folds)
    rate = common_rate([item.demonstration for item in used], settings)
    fixed = settings.replace(rate=rate)
    merged = [item.merged(settings.merge) for item in used]
    actions = tuple(dict.fromkeys(s.action for item in merged for s in item.segments))
    seconds = {"features": 0.0, "fit": 0.0, "predict": 0.0, "filter": 0.0}
    tested: dict[int, Tested] = {}
    reliable = []
    left_out: list[Contradicted] = []
    for part in parts:
        started = perf_counter()
        recogniser = yield from training([o for i, o in enumerate(used) if i not in part], fixed)
        left_out.extend(recogniser.left_out)
        seconds["fit"] += perf_counter() - started
        for i in part:
            started = perf_counter()
            decided = with_latency(recogniser, used[i].demonstration, latency)
            seconds["predict"] += perf_counter() - started
            examples = _examples(merged[i], recogniser, decided)
            codes = decided.codes
            prediction = Prediction(
                decided.times, recogniser.actions, codes, codes, decided.probabilities, {}
            )
            tested[i] = tested_by(used[i], examples, prediction, actions)
            reliable.append(relied_on(prediction, examples))  # gaps, which have none, do not count
    return Evaluation(
        title=title,
        settings=settings,
        actions=actions,
        tested=tuple(tested[i] for i in range(len(used))),
        rate=recogniser.rate,
        channels=recogniser.channels,
        trained_on=tuple(item.demonstration.id for item in used),
        seconds=seconds,
        reliability=together(reliable),
        remarks=(
            f"Recognised as a stream, each label {1000 * latency:g} ms after its force.",
            *remarks,
            *remark_on(left_out),
            *silence_remark(list(tested.values()), settings, recogniser.rate),
        ),
    )


def _examples(item: Labelled, recogniser: Recogniser, decided: Decided) -> Examples:
    """The steps of a stream, of which nothing but the human's labels is wanted."""
    n = len(decided)
    known = decided.probabilities
    seen = np.ones(n, dtype=bool) if known is None else np.asarray(known.any(axis=1))
    return Examples(
        name=item.demonstration.name,
        times=decided.times,
        features=np.empty((n, 0)),
        valid=seen,
        segments=item.segments,
        channels=recogniser.channels,
        rate=recogniser.rate,
    )
