"""Ways of others to recognise time series, measured beside ours where they are installed.

Each is given the same recognition channels on the same grid, decides at the same time steps, and
learns from the same human labels; unlabelled time is neither learnt nor scored. Its inputs are
standardised. Which of its settings it takes, and how sure it is of what it says, is found on whole
demonstrations that are left out of inner fits, as preset ``best`` is calibrated; the time of a fit
holds that of the inner ones.

A peer says how probable each action is at each time step. What is made of that is measured twice:
its most probable actions as they come, and decoded as presets ``fast`` and ``best`` are, so that
what a decoder brings is not taken for what a classifier brings; where actions change our presets
learn with trees of their own, and peers do not. The memory of networks and of LightGBM is that
which Python is told of: their own is not seen.

Sources
-------
Dempster, Schmidt and Webb, "MiniRocket: a very fast (almost) deterministic transform for time
series classification", KDD 2021. Ke et al., "LightGBM: a highly efficient gradient boosting
decision tree", NeurIPS 2017. Lafferty, McCallum and Pereira, "Conditional random fields:
probabilistic models for segmenting and labeling sequence data", ICML 2001. Abu Farha and Gall,
"MS-TCN: multi-stage temporal convolutional network for action segmentation", CVPR 2019: four stages
of ten dilated residual layers of 64 filters, each stage after the first refining the probabilities
of the one before, trained with cross entropy and a truncated squared difference of neighbouring log
probabilities by Adam at 5e-4, one demonstration at a time.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.labels import UNLABELLED
from forcelab.measure.cwt import Library
from forcelab.measure.recognition import (
    Prepared,
    VariantResult,
    recognise,
    reference_text,
    require_labelled,
    row_of,
)
from forcelab.measure.rows import Row
from forcelab.measure.timing import measure_peak, measure_seconds
from forcelab.recognition.examples import (
    Examples,
    LabelledDemonstration,
    actions_of,
    common_rate,
    prepare_examples,
)
from forcelab.recognition.features import window_features
from forcelab.recognition.forest import softmax
from forcelab.recognition.groups import fold_groups
from forcelab.recognition.presets import PRESETS, preset
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.task_grammar import TaskGrammar
from forcelab.signals.channels import channel_map
from forcelab.signals.grid import on_grid

Real = NDArray[np.float64]
Whole = NDArray[np.int64]
#: Probabilities, shape (m, K), from the rows of a whole demonstration, shape (m, f).
Fitted = Callable[[Real], Real]


@dataclass(frozen=True)
class Task:
    """What a peer learns from."""

    rows: Sequence[Real]  # (m, f), what it knows of the time steps of each training demonstration
    codes: Sequence[Whole]  # (m,), the human's actions, 0 to K - 1; -1 where unlabelled
    actions: int  # K
    channels: int

    def labelled(self) -> tuple[Real, Whole]:
        """Rows of all labelled time steps of all demonstrations, and their actions."""
        known = [codes >= 0 for codes in self.codes]
        rows = [rows[some] for rows, some in zip(self.rows, known, strict=True)]
        return np.concatenate(rows), np.concatenate(
            [codes[some] for codes, some in zip(self.codes, known, strict=True)]
        )

    def of(self, demonstrations: Sequence[int]) -> Task:
        """The same task with some of its demonstrations."""
        return replace(
            self,
            rows=[self.rows[i] for i in demonstrations],
            codes=[self.codes[i] for i in demonstrations],
        )


@dataclass(frozen=True)
class Peer(Library):
    """A method of others."""

    #: Takes recognition channels, shape (q, n), samples a second, and the samples in the middle of
    #: each time step, shape (m,); gives what it knows of them, shape (m, f).
    look: Callable[[Real, float, Whole], Real]
    #: Takes a task, a seed and one of the settings; gives what recognises.
    fit: Callable[[Task, int, Any], Fitted]
    settings: tuple[Any, ...]  # among these it chooses


#: Into so many groups training demonstrations are parted to choose settings and calibrate.
INNER = 3


def fit_tuned(peer: Peer, task: Task, seed: int) -> Fitted:
    """Fit with standardised inputs, the best of the peer's settings, and calibrated.

    The best have the least log loss on left-out demonstrations once calibrated: all probabilities
    to one power, then made to sum to one.
    """
    known, _ = task.labelled()
    mean, scale = known.mean(axis=0), known.std(axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    task = replace(task, rows=[(rows - mean) / scale for rows in task.rows])
    every = np.arange(len(task.rows))
    groups = [every[i::INNER] for i in range(min(INNER, len(every)))]
    trials = []
    for settings in peer.settings:
        logs, codes = [], []
        for group in groups if len(groups) > 1 else ():
            fitted = peer.fit(
                task.of(np.setdiff1d(np.arange(len(task.rows)), group)), seed, settings
            )
            for i in group:
                labelled = task.codes[i] >= 0
                logs.append(_logarithms(fitted(task.rows[i]))[labelled])
                codes.append(task.codes[i][labelled])
        trials.append((*_calibration(logs, codes), settings))
    _, power, settings = min(trials, key=lambda trial: trial[0])
    fitted = peer.fit(task, seed, settings)
    return lambda rows: softmax(power * _logarithms(fitted((rows - mean) / scale)))


def _logarithms(probabilities: Real) -> Real:
    return np.log(np.maximum(probabilities, 1e-6))


def _calibration(logs: Sequence[Real], codes: Sequence[Whole]) -> tuple[float, float]:
    """The least mean log loss of log probabilities (m, K) each, and the power that gives it."""
    if not logs:
        return 0.0, 1.0
    L, y = np.concatenate(logs), np.concatenate(codes)

    def loss(power: float) -> float:
        return float(-_logarithms(softmax(power * L))[np.arange(len(y)), y].mean())

    found = minimize_scalar(loss, bounds=(0.05, 5.0), method="bounded")
    return float(found.fun), float(found.x)


def around(channels: Real, rate: float, places: Whole, count: int, period: float) -> Real:
    """Means of each channel in cells around some samples, shape (m, q * count).

    `channels` (q, n); `places` (m,); `count`: cells around each, half of them before it; a
    channel's stand together; `period`: seconds that a cell lasts; below a sample it is read off
    between two of them.

    Beyond its ends a channel has its end values.
    """
    edges = places[:, None] + rate * period * (np.arange(count + 1) - count / 2)[None]
    n = channels.shape[1]
    pad = int(np.ceil(np.abs(edges - np.clip(edges, 0, n)).max())) + 1
    out = np.empty((len(places), len(channels), count))
    for i, channel in enumerate(channels):
        held = np.pad(channel, pad, mode="edge")
        total = np.concatenate([[0.0], np.cumsum(held)])
        sums = np.interp(edges + pad + 0.5, np.arange(len(total)), total)
        out[:, i] = np.diff(sums, axis=1) / (rate * period)
    return out.reshape(len(places), -1)


#: MiniRocket sees so many means over so many seconds around a time step: 1.28 s.
COUNT, PERIOD = 128, 0.01
#: It learns from every so-manieth labelled step: its features of all of them take gigabytes.
STRIDE = 2


def _cells(channels: Real, rate: float, places: Whole) -> Real:
    return around(channels, rate, places, COUNT, PERIOD)


def _minirocket(task: Task, seed: int, _: None) -> Fitted:
    """Ridge regression chooses its own penalty; its decisions are made positive by a softmax."""
    from aeon.classification.convolution_based import MiniRocketClassifier

    def shaped(rows: Real) -> NDArray[np.float32]:
        return rows.reshape(len(rows), task.channels, COUNT).astype(np.float32)

    X, y = task.labelled()
    model = MiniRocketClassifier(n_jobs=1, random_state=seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what its compiler says of our NumPy is nobody's concern
        model.fit(shaped(X[::STRIDE]), y[::STRIDE])

    def recognised(rows: Real) -> Real:
        found = model.pipeline_.decision_function(shaped(rows))
        if found.ndim == 1:  # of two actions there is one decision
            found = np.stack([-found, found], axis=1)
        return _spread(softmax(found), model.classes_, task.actions)

    return recognised


def windows(channels: Real, rate: float, places: Whole) -> Real:
    """What presets `fast` and `best` look at around each time step, shape (m, f)."""
    return window_features(channels, rate, preset("fast").windows, places, "both")


def _lightgbm(task: Task, seed: int, leaves: int) -> Fitted:
    from lightgbm import LGBMClassifier

    X, y = task.labelled()
    model = LGBMClassifier(num_leaves=leaves, n_jobs=1, random_state=seed, verbose=-1).fit(X, y)

    def recognised(rows: Real) -> Real:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that rows have no names
            return _spread(np.asarray(model.predict_proba(rows)), model.classes_, task.actions)

    return recognised


def _logistic(task: Task, seed: int, C: float) -> Fitted:
    """Logistic regression; every so-manieth step, as neighbours are almost copies."""
    from sklearn.linear_model import LogisticRegression

    X, y = task.labelled()
    model = LogisticRegression(C=C, max_iter=1000, random_state=seed).fit(X[::STRIDE], y[::STRIDE])
    return lambda rows: _spread(model.predict_proba(rows), model.classes_, task.actions)


def _spread(probabilities: Real, codes: Whole, actions: int) -> Real:
    """Probabilities of all actions; those that were not learnt have none."""
    out = np.zeros((len(probabilities), actions))
    out[:, codes] = probabilities
    return out


def _linear_chain(task: Task, seed: int, decay: float) -> Fitted:
    """A conditional random field: scores linear in the rows, and one for each change of actions.

    Unlabelled steps may be any action. The probabilities of the actions at each step are the
    derivatives of the logarithm of the sum over all sequences by the scores.
    """
    import torch

    torch.set_num_threads(1)
    K = task.actions
    longest = max(len(rows) for rows in task.rows)
    X = torch.zeros(longest, len(task.rows), task.rows[0].shape[1], dtype=torch.float64)
    live = torch.zeros(longest, len(task.rows), dtype=torch.bool)
    # What contradicts the labels is left out of the sum over the sequences that agree with them.
    agrees = torch.zeros(longest, len(task.rows), K, dtype=torch.float64)
    for i, (rows, codes) in enumerate(zip(task.rows, task.codes, strict=True)):
        X[: len(rows), i] = torch.from_numpy(rows)
        live[: len(rows), i] = True
        known = np.flatnonzero(codes >= 0)
        agrees[known, i] = -1e9
        agrees[known, i, codes[known]] = 0.0
    weights = torch.zeros(X.shape[2], K, dtype=torch.float64, requires_grad=True)
    bias = torch.zeros(K, dtype=torch.float64, requires_grad=True)
    changes = torch.zeros(K, K, dtype=torch.float64, requires_grad=True)

    def total(scores: Any, live: Any) -> Any:
        """Logarithms of the sums over all sequences of scores (m, demonstrations, K)."""
        forward = scores[0]
        for t in range(1, len(scores)):
            after = torch.logsumexp(forward[:, :, None] + changes, dim=1) + scores[t]
            forward = torch.where(live[t][:, None], after, forward)
        return torch.logsumexp(forward, dim=1)

    optimiser = torch.optim.LBFGS(
        [weights, bias, changes], max_iter=60, line_search_fn="strong_wolfe"
    )
    both_live = torch.cat([live, live], dim=1)

    def loss() -> Any:
        optimiser.zero_grad()
        scores = X @ weights + bias
        every, agreeing = total(torch.cat([scores, scores + agrees], dim=1), both_live).chunk(2)
        value = (every - agreeing).sum() / live.sum() + decay * (weights**2).sum()
        value.backward()
        return value

    optimiser.step(loss)

    def recognised(rows: Real) -> Real:
        scores = (torch.from_numpy(rows) @ weights + bias).detach()[:, None].requires_grad_()
        whole = torch.ones(len(rows), 1, dtype=torch.bool)
        (marginals,) = torch.autograd.grad(total(scores, whole).sum(), scores)
        return np.asarray(marginals[:, 0].numpy())

    return recognised


MINIROCKET = Peer("MiniRocket + ridge", "aeon", _cells, _minirocket, (None,))
LIGHTGBM = Peer("LightGBM on our windows", "lightgbm", windows, _lightgbm, (7, 15, 31))
LOGISTIC = Peer(
    "logistic regression on our windows", "sklearn", windows, _logistic, (1e-3, 1e-2, 1e-1)
)
LINEAR_CHAIN = Peer(
    "linear chain on our windows", "torch", windows, _linear_chain, (1e-3, 1e-2, 1e-1)
)


#: From the channels of a demonstration, (1, f, m), to scores of each stage, (1, K, m) each.
Network = Callable[[Any], list[Any]]

#: Means that the convolutional network is given of each channel within a time step.
CELLS = 4
#: Filters of a layer; layers and stages of the MS-TCN.
FILTERS = 64
LAYERS, STAGES = 10, 4
#: Weight of the smoothing loss, and where a difference of logarithms is cut off.
SMOOTHING, LARGEST = 0.15, 4.0
#: Kernel and dilations of the convolutional network: it sees 1.8 s at 50 time steps a second.
KERNEL, DILATIONS = 7, (1, 2, 4, 8)


def _network_cells(channels: Real, rate: float, places: Whole) -> Real:
    period = float(np.median(np.diff(places))) / rate / CELLS if len(places) > 1 else 1 / rate
    return around(channels, rate, places, CELLS, period)


def _convolutions(width: int, actions: int) -> tuple[Network, list[Any]]:
    """Four layers of convolutions with batch normalisation, then one decision a time step."""
    from torch import nn

    layers: list[Any] = []
    for i, dilation in enumerate(DILATIONS):
        before = width if i == 0 else FILTERS
        layers += [
            nn.Conv1d(before, FILTERS, KERNEL, padding="same", dilation=dilation),
            nn.BatchNorm1d(FILTERS),
            nn.ReLU(),
        ]
    whole = nn.Sequential(*layers, nn.Dropout(0.5), nn.Conv1d(FILTERS, actions, 1))
    return (lambda x: [whole(x)]), [whole]


def _stages(width: int, actions: int) -> tuple[Network, list[Any]]:
    """The stages of an MS-TCN."""
    from torch import nn

    stages = [_stage(width if i == 0 else actions, actions) for i in range(STAGES)]

    def scores(x: Any) -> list[Any]:
        found: list[Any] = []
        for run, _ in stages:
            found.append(run(nn.functional.softmax(found[-1], dim=1) if found else x))
        return found

    return scores, [module for _, modules in stages for module in modules]


def _stage(width: int, actions: int) -> tuple[Callable[[Any], Any], list[Any]]:
    """One stage: dilated residual layers, each of which sees twice as far as the one before."""
    from torch import nn

    first, last = nn.Conv1d(width, FILTERS, 1), nn.Conv1d(FILTERS, actions, 1)
    residual = [
        nn.Sequential(
            nn.Conv1d(FILTERS, FILTERS, 3, padding=2**i, dilation=2**i),
            nn.ReLU(),
            nn.Conv1d(FILTERS, FILTERS, 1),
            nn.Dropout(0.5),
        )
        for i in range(LAYERS)
    ]

    def run(x: Any) -> Any:
        held = first(x)
        for layer in residual:
            held = held + layer(held)
        return last(held)

    return run, [first, *residual, last]


def _learn(
    build: Callable[[int, int], tuple[Network, list[Any]]],
    rate: float,
    smooth: float = 0.0,
) -> Callable[[Task, int, int], Fitted]:
    """How a network of some build learns a task by Adam; on one thread, as all others."""

    def fit(task: Task, seed: int, epochs: int) -> Fitted:
        import torch

        torch.set_num_threads(1)
        torch.manual_seed(seed)

        def ready(rows: Real) -> Any:
            return torch.from_numpy(np.ascontiguousarray(rows.T[None], dtype=np.float32))

        network, modules = build(task.rows[0].shape[1], task.actions)
        optimiser = torch.optim.Adam([p for m in modules for p in m.parameters()], lr=rate)
        pairs = [
            (ready(rows), torch.from_numpy(codes)[None])
            for rows, codes in zip(task.rows, task.codes, strict=True)
        ]
        order = np.random.default_rng(seed)
        for _ in range(epochs):
            for i in order.permutation(len(pairs)):
                x, codes = pairs[i]
                optimiser.zero_grad()
                _loss(network(x), codes, smooth).backward()
                optimiser.step()
        for module in modules:
            module.eval()

        def recognised(rows: Real) -> Real:
            with torch.no_grad():
                found = torch.softmax(network(ready(rows))[-1], dim=1)
            return np.asarray(found[0].T.double().numpy())

        return recognised

    return fit


def _loss(stages: list[Any], codes: Any, smooth: float) -> Any:
    """Cross entropy where there are labels, and what neighbouring decisions differ by."""
    import torch

    total = 0.0
    for scores in stages:
        entropy = torch.nn.functional.cross_entropy(scores, codes, ignore_index=-1)
        total = total + entropy
        if smooth:
            logs = torch.log_softmax(scores, dim=1)
            steps = logs[:, :, 1:] - logs.detach()[:, :, :-1]
            total = total + smooth * torch.clamp(steps**2, 0.0, LARGEST**2).mean()
    return total


CNN = Peer("1-D CNN", "torch", _network_cells, _learn(_convolutions, 1e-3), (30, 100))
MS_TCN = Peer(
    "MS-TCN on our windows", "torch", windows, _learn(_stages, 5e-4, SMOOTHING), (50, 100)
)


#: Those that are measured beside ours.
PEERS = (LOGISTIC, LINEAR_CHAIN, MINIROCKET, LIGHTGBM, CNN, MS_TCN)

#: What is made of a peer's probabilities.
DECODED = PRESETS["fast"].replace(changes=False)
WAYS = {
    "as it comes": DECODED.replace(decoder="filters"),
    "with our decoder": DECODED,
}


def measuring_peers(
    labelled: Sequence[LabelledDemonstration],
    size: str,
    folds: int | None,
) -> Generator[Progress, None, tuple[Row, ...]]:
    """Measure other people's recognisers as `measure_variants` does ours: two rows a peer.

    One row with a refusal for each peer that is not installed.
    """
    used = require_labelled(labelled)
    parts = fold_groups([item.demonstration for item in used], folds)
    against = reference_text(len(used), len(parts))
    rows: list[Row] = []
    for number, peer in enumerate(PEERS):
        yield Progress(number * len(parts), len(PEERS) * len(parts), peer.name)
        try:
            peer.check()
            prepared = _prepare(peer, used)
            spent = {way: VariantResult() for way in WAYS}
            for i, part in enumerate(parts):
                _fold(peer, prepared, part, spent)
                yield Progress(number * len(parts) + i + 1, len(PEERS) * len(parts), peer.name)
        except (InputError, ImportError) as error:
            why = error if isinstance(error, InputError) else f"{peer.name}: {error}."
            rows.append(Row(peer.name, "as it comes", size, against, refusal=str(why)))
            continue
        rows += [row_of(peer.name, way, found, size, against) for way, found in spent.items()]
    return tuple(rows)


def _prepare(peer: Peer, labelled: Sequence[LabelledDemonstration]) -> Prepared:
    """What a peer knows of all demonstrations, each on the clock."""
    rate = common_rate([item.demonstration for item in labelled], DECODED)
    prepared_steps = [_steps(item, rate) for item in labelled]

    def look(i: int) -> Examples:
        example, channels, places = prepared_steps[i]
        return replace(example, features=peer.look(channels, example.rate, places))

    _, peak = measure_peak(lambda: look(0))
    found = [measure_seconds(lambda i=i: look(i)) for i in range(len(prepared_steps))]  # type: ignore[misc]
    return Prepared(
        labelled, [examples for examples, _ in found], [taken for _, taken in found], peak
    )


def _steps(item: LabelledDemonstration, rate: float) -> tuple[Examples, Real, NDArray[np.int64]]:
    """The time steps that ours decides at, and the channels it sees around them."""
    example = prepare_examples(item, DECODED, rate)
    channels = channel_map(item.demonstration.channels)
    grid = on_grid(item.demonstration, rate, channels.recorded)
    places = np.searchsorted(grid.times, example.times)
    return example, channels.apply(grid.signals), places


def _fold(
    peer: Peer, prepared: Prepared, part: Sequence[int], spent: dict[str, VariantResult]
) -> None:
    """Let a peer learn from all demonstrations but some, and recognise those."""
    every = actions_of(prepared.examples)
    train = [example for i, example in enumerate(prepared.examples) if i not in part]
    actions = actions_of(train)
    codes = [example.codes(actions) for example in train]
    known = np.unique(np.concatenate(codes))
    if len(known[known != UNLABELLED]) < 2:
        raise InputError("Training needs samples of two actions; label more.")
    task = Task([e.features for e in train], codes, len(actions), len(train[0].channels))
    fitted, taken = measure_seconds(lambda: _limited(peer, task))
    minutes = sum(m for i, m in enumerate(prepared.minutes) if i not in part)
    for way, found in spent.items():
        settings = WAYS[way]
        recogniser = Recogniser(
            settings=settings,
            rate=train[0].rate,
            channels=train[0].channels,
            actions=actions,
            shortest={},
            classifier=_Classifier(fitted, np.arange(len(actions))),
            grammar=TaskGrammar.learn([e.segments for e in train], actions)
            if settings.decodes
            else None,
        )
        found.fit += taken
        found.trained += minutes
        for i in part:
            recognise(recogniser, prepared, i, every, found)


def _limited(peer: Peer, task: Task) -> Fitted:
    """Fit on one thread, as ours does."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        return fit_tuned(peer, task, DECODED.seed)


@dataclass(frozen=True, eq=False)
class _Classifier:
    """A peer named as those of scikit-learn are, which a recogniser asks."""

    fitted: Fitted
    classes_: NDArray[np.int64]

    def predict_proba(self, rows: Real) -> Real:
        """Probabilities of the actions, shape (m, K)."""
        return self.fitted(rows)

    def predict(self, rows: Real) -> NDArray[np.int64]:
        """Codes of the most probable actions, shape (m,)."""
        return np.asarray(self.fitted(rows).argmax(axis=1))
