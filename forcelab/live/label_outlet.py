"""Live labels as streams of the Lab Streaming Layer, for whatever program listens."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from forcelab.capture.lsl import lsl_clock_offset
from forcelab.extras import load_extra
from forcelab.labels import UNLABELLED
from forcelab.recognition.online import LiveLabels
from forcelab.recognition.probabilities import RATE


class LabelOutlet:
    """Two streams: the action whenever it changes, and some 50 times a second all probabilities.

    The first, of this name, sends an empty text where the label is unlabelled; the second has the
    name with "probabilities" behind it and a channel for each action. Stamps are the times of the
    forces that the labels are of. They are there until nothing refers to this any more.
    """

    def __init__(self, name: str, actions: Sequence[str]) -> None:
        lsl = load_extra("pylsl", "lsl", "Sending labels to the Lab Streaming Layer")
        self._actions = tuple(actions)
        self._offset = lsl_clock_offset()
        self._labels = _outlet(lsl, name, "Markers", ("action",), lsl.cf_string)
        self._probabilities = _outlet(
            lsl, f"{name} probabilities", "Probabilities", self._actions, lsl.cf_float32
        )
        self._code: int | None = None  # of the last label; none was sent yet
        self._last = -np.inf  # its time
        self._bin = -np.inf

    def push(self, labels: LiveLabels) -> None:
        """Send what is new of labels that are decided; where they begin anew some come twice."""
        new = labels.times > self._last
        times, codes = labels.times[new], labels.codes[new]
        if not len(times):
            return
        before = np.concatenate([[self._code if self._code is not None else np.nan], codes[:-1]])
        for i in np.flatnonzero(codes != before).tolist():
            action = "" if codes[i] == UNLABELLED else self._actions[codes[i]]
            self._labels.push_sample([action], float(times[i]) - self._offset)
        if labels.probabilities is not None:
            bins = np.floor(times * RATE)
            rows = labels.probabilities[new]
            for i in np.flatnonzero(np.diff(bins, prepend=self._bin) > 0).tolist():
                self._probabilities.push_sample(rows[i].tolist(), float(times[i]) - self._offset)
            self._bin = float(bins[-1])
        self._code, self._last = int(codes[-1]), float(times[-1])


def _outlet(lsl: Any, name: str, content: str, channels: Sequence[str], kind: int) -> Any:
    info = lsl.StreamInfo(
        name, content, len(channels), lsl.IRREGULAR_RATE, kind, f"forcelab {name}"
    )
    description = info.desc().append_child("channels")
    for channel in channels:
        description.append_child("channel").append_child_value("label", channel)
    return lsl.StreamOutlet(info)
