"""Live labels as streams of the Lab Streaming Layer, heard by real inlets on this machine."""

import time

import numpy as np
import pytest

pytest.importorskip("pylsl")

import pylsl

from forcelab.errors import InputError
from forcelab.labels import UNLABELLED
from forcelab.live.label_outlet import LabelOutlet
from forcelab.recognition.online import LiveLabels
from tests.capture.lsl_streams import host_clock

ACTIONS = ("grab", "hold")


def listen(name):
    """An inlet that hears a stream from now on."""
    [info] = pylsl.resolve_byprop("name", name, timeout=5.0)
    inlet = pylsl.StreamInlet(info)
    inlet.open_stream(5.0)
    return inlet


def hear(inlet, count):
    """So many samples, and their stamps on the host's monotonic clock."""
    samples = [inlet.pull_sample(5.0) for _ in range(count)]
    assert inlet.pull_sample(0.0) == (None, None)
    values, stamps = zip(*samples, strict=True)
    return list(values), host_clock(np.array(stamps))


def test_the_action_is_sent_when_it_changes_and_probabilities_now_and_then():
    outlet = LabelOutlet("labels", ACTIONS)
    actions, probabilities = listen("labels"), listen("labels probabilities")
    times = time.monotonic() + np.arange(1000) / 1000.0
    codes = np.repeat([0, 0, UNLABELLED, 1], 250)
    shares = np.column_stack([np.linspace(0, 1, 1000), np.linspace(1, 0, 1000)])
    for first in range(0, 1000, 40):
        part = slice(max(first - 20, 0), first + 40)  # some come twice
        outlet.push(LiveLabels(times[part], codes[part], shares[part]))
    values, stamps = hear(actions, 3)
    assert values == [["grab"], [""], ["hold"]]
    assert stamps == pytest.approx(times[[0, 500, 750]], abs=1e-3)
    count = len(set(np.floor(times * 50.0)))
    values, stamps = hear(probabilities, count)
    rows = np.searchsorted(times, stamps - 5e-4)
    assert np.array(values) == pytest.approx(shares[rows], abs=2e-3)
    assert np.diff(stamps)[1:] == pytest.approx(0.02, abs=2e-3)
    [found] = pylsl.resolve_byprop("name", "labels probabilities", timeout=5.0)
    described = pylsl.StreamInlet(found).info(5.0)
    assert described.get_channel_labels() == list(ACTIONS)


def test_labels_without_probabilities_are_sent_as_well():
    outlet = LabelOutlet("bare", ACTIONS)
    actions = listen("bare")
    outlet.push(LiveLabels(np.empty(0), np.empty(0, dtype=np.int64), None))
    outlet.push(LiveLabels(np.array([time.monotonic()]), np.array([1]), None))
    assert hear(actions, 1)[0] == [["hold"]]


def test_without_the_package_it_is_said_how_to_install_it(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pylsl", None)
    with pytest.raises(
        InputError, match=r"needs the package pylsl; install it with .*forcelab\[lsl\]"
    ):
        LabelOutlet("labels", ACTIONS)
