"""Devices by the names that people type: ``optoforce:/dev/ttyACM0?rate=1000&filter=15``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar
from urllib.parse import quote, unquote

from forcelab.capture.device import Device
from forcelab.capture.discovery import port_of
from forcelab.capture.encoder import Encoder
from forcelab.capture.optoforce_device import OptoForce
from forcelab.capture.text_device import TextLine
from forcelab.errors import InputError

__all__ = [
    "calibrated_by",
    "device_named",
    "devices_named",
    "number_sensors",
    "said",
]

T = TypeVar("T")
D = TypeVar("D")

#: What can be said of each kind of device behind a question mark.
OPTIONS = {
    "optoforce": ("rate", "filter", "calibration", "serial"),
    "text": ("baud", "rate"),
    "encoder": ("scale", "unit", "channel", "rate", "reverse"),
}


def device_named(name: str) -> OptoForce | TextLine | Encoder:
    """The device that a name means; it is not opened.

    Parameters
    ----------
    name : str
        ``KIND:PORT?OPTION=VALUE&...``. Without a port the only device of that kind is meant.
        Options are, of ``optoforce``, `rate` (Hz), `filter` (Hz, 0 for none), `calibration` (a
        file) and `serial`; of ``text`` `baud` and `rate`; of ``encoder`` `scale` (units a count),
        `unit`, `channel`, `rate` and `reverse` (yes or no). In port and values ``%26`` is an
        ampersand, ``%3F`` a question mark and ``%25`` a percent sign; see :func:`said`.

    Raises
    ------
    InputError
        If the name means nothing: what in it, and what would.
    """
    kind, colon, rest = name.partition(":")
    if kind not in OPTIONS or not colon:
        raise InputError(
            f"'{name}' is no device; write optoforce:PORT, text:PORT or encoder:PORT, such as "
            f"optoforce:/dev/ttyACM0."
        )
    port, _, behind = rest.partition("?")
    options = _Options(name, kind, behind)
    path = unquote(port) or port_of(kind)
    if kind == "optoforce":
        return OptoForce(
            path,
            rate=options.take("rate", float, 1000.0),
            cutoff=options.take("filter", float, 15.0),
            calibration=options.take("calibration", Path, None),
            serial=options.take("serial", str, None),
        )
    if kind == "text":
        return TextLine(
            path,
            baud=options.take("baud", int, 115_200),
            rate=options.take("rate", float, 0.0, "a number, such as rate=80"),
        )
    return Encoder(
        path,
        scale=options.take("scale", float, 1.0),
        unit=options.take("unit", str, ""),
        channel=options.take("channel", str, "opening"),
        rate=options.take("rate", float, 512.0),
        reverse=options.take("reverse", _yes, False, "yes or no"),
    )


def devices_named(names: Sequence[str]) -> list[OptoForce | TextLine | Encoder]:
    """The devices that names mean, as of :func:`device_named`.

    Raises
    ------
    InputError
        If a name means nothing, or two of them the same port.
    """
    found: dict[str, OptoForce | TextLine | Encoder] = {}
    for name in names:
        device = device_named(name)
        port = device.name.partition(":")[2]
        if port in found:
            raise InputError(f"Two devices are said to be at {port}; leave one of them out.")
        found[port] = device
    return list(found.values())


def said(words: str) -> str:
    """A port or a value as it stands in a name: what would end it there is written as ``%26``."""
    return quote(words, safe="/:=,;+@ ~!$'()*\\")


def calibrated_by(name: str, file: Path | None) -> str:
    """The name of a device with another calibration file, or with none; its other options stay."""
    place, _, behind = name.partition("?")
    parts = [part for part in behind.split("&") if part and not part.startswith("calibration=")]
    if file is not None:
        parts.append(f"calibration={said(str(file))}")
    return "?".join([place, *(["&".join(parts)] if parts else [])])


def number_sensors(devices: Sequence[Device]) -> None:
    """Number the sensors of open devices through, so that no two channels have the same name.

    Parameters
    ----------
    devices : sequence of Device
        Open, in the order in which their sensors are to be numbered; only OptoForce DAQs have any.
    """
    first = 1
    for device in devices:
        if isinstance(device, OptoForce):
            device.first = first
            first += device.sensors


class _Options:
    """What stands behind the question mark of a name."""

    def __init__(self, name: str, kind: str, behind: str) -> None:
        self._name = name
        self._values: dict[str, str] = {}
        for part in behind.split("&") if behind else []:
            key, equals, value = part.partition("=")
            if key not in OPTIONS[kind] or not equals or key in self._values:
                raise InputError(
                    f"'{part}' in '{name}' means nothing; {kind} takes "
                    f"{', '.join(f'{option}=...' for option in OPTIONS[kind])}, each once"
                    f"{'' if equals else '; an & within a value is written as %26'}."
                )
            self._values[key] = unquote(value)

    def take(self, key: str, kind: Callable[[str], T], default: D, right: str = "") -> T | D:
        """The value of an option, or what it is where nothing was said.

        What is `right` stands in the sentence where something else was said.
        """
        if key not in self._values:
            return default
        try:
            return kind(self._values[key])
        except ValueError as error:
            raise InputError(
                f"'{key}={self._values[key]}' in '{self._name}' does not say a {key}; write "
                f"{right or f'a number, such as {key}={default}'}."
            ) from error


def _yes(word: str) -> bool:
    """Whether a word means yes."""
    known = {"yes": True, "no": False, "1": True, "0": False, "true": True, "false": False}
    if word not in known:
        raise ValueError(word)
    return known[word]
