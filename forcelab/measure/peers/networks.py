"""Peers that learn their own features: a small 1-D convolutional network, and an MS-TCN.

Sources
-------
Abu Farha and Gall, "MS-TCN: multi-stage temporal convolutional network for action segmentation",
CVPR 2019: four stages of ten dilated residual layers of 64 filters, each stage after the first
refining the probabilities of the one before, trained with cross entropy and a truncated squared
difference of neighbouring log probabilities; Adam at 5e-4, 50 epochs, one demonstration at a time.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.measure.peers.classifiers import windows
from forcelab.measure.peers.peer import Fitted, Peer, Task, around

__all__ = ["CNN", "MS_TCN"]

Real = NDArray[np.float64]
Whole = NDArray[np.int64]
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


def _cells(channels: Real, rate: float, places: Whole) -> Real:
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

    made = [_stage(width if i == 0 else actions, actions) for i in range(STAGES)]

    def scores(x: Any) -> list[Any]:
        found: list[Any] = []
        for run, _ in made:
            found.append(run(nn.functional.softmax(found[-1], dim=1) if found else x))
        return found

    return scores, [module for _, modules in made for module in modules]


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
    epochs: int,
    rate: float,
    smooth: float = 0.0,
) -> Callable[[Task, int], Fitted]:
    """How a network of some build learns a task by Adam; on one thread, as all others."""

    def fit(task: Task, seed: int) -> Fitted:
        import torch

        torch.set_num_threads(1)
        torch.manual_seed(seed)
        known, _ = task.labelled()
        mean, scale = known.mean(axis=0), known.std(axis=0)
        scale = np.where(scale > 0, scale, 1.0)

        def ready(rows: Real) -> Any:
            rows = ((rows - mean) / scale).T[None]
            return torch.from_numpy(np.ascontiguousarray(rows, dtype=np.float32))

        network, modules = build(len(mean), task.actions)
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


CNN = Peer("1-D CNN", "torch", _cells, _learn(_convolutions, 100, 1e-3))
MS_TCN = Peer("MS-TCN on our windows", "torch", windows, _learn(_stages, 50, 5e-4, SMOOTHING))
