"""Devices by the names that people type: ``optoforce:/dev/ttyACM0?rate=1000&filter=15``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote, unquote

from forcelab.capture.device import Device
from forcelab.capture.discovery import only_port
from forcelab.capture.encoder import Encoder
from forcelab.capture.lsl import FoundStream, LslStream
from forcelab.capture.netft import NetFT
from forcelab.capture.optoforce import OptoForce
from forcelab.capture.replay import RecordedDevice
from forcelab.capture.text_device import TextDevice
from forcelab.errors import InputError


def _parse_yes_no(word: str) -> bool:
    """Whether a word means yes."""
    meanings = {"yes": True, "no": False, "1": True, "0": False, "true": True, "false": False}
    if word not in meanings:
        raise ValueError(word)
    return meanings[word]


#: The options of each kind of device, behind a question mark: what reads a value, and what an error
#: asks for.
OPTIONS: Final[dict[str, dict[str, tuple[Callable[[str], Any], str]]]] = {
    "optoforce": {
        "rate": (float, "a number, such as rate=1000.0"),  # Hz
        "filter": (float, "a number, such as filter=15.0"),  # Hz, 0 for none
        "calibration": (Path, "a file"),
        "serial": (str, "a text"),
    },
    "text": {
        "baud": (int, "a number, such as baud=115200"),
        "rate": (float, "a number, such as rate=80"),  # Hz
    },
    "encoder": {
        "scale": (float, "a number, such as scale=1.0"),  # units a count
        "unit": (str, "a text"),
        "channel": (str, "a text"),
        "rate": (float, "a number, such as rate=512.0"),  # Hz, at most
        "reverse": (_parse_yes_no, "yes or no"),
    },
    "netft": {
        "force": (float, "counts a newton, such as force=1000000"),
        "torque": (float, "counts a Nm, such as torque=1000000"),
        "rate": (float, "a number, such as rate=1000"),  # Hz
    },
    # A source tells streams of one name apart.
    "lsl": {"source": (str, "a text"), "dejitter": (_parse_yes_no, "yes or no")},
    "replay": {"demonstration": (str, "a text"), "loop": (_parse_yes_no, "yes or no")},
}
_MAKERS: Final[dict[str, Callable[..., Device]]] = {
    "optoforce": OptoForce,
    "text": TextDevice,
    "encoder": Encoder,
    "netft": NetFT,
    "lsl": LslStream,
    "replay": RecordedDevice,
}


def parse_device(name: str) -> Device:
    """The device that a name means, not yet open: ``KIND:PORT?OPTION=VALUE&...``, see `OPTIONS`.

    Without a port the only device of that kind is meant; the port of ``netft`` is an address
    in the network, that of ``lsl`` a stream's name, that of ``replay`` a project. In port and
    values ``%26`` is an ampersand, ``%3F`` a question mark and ``%25`` a percent sign; see
    :func:`quote_value`.
    """
    kind, colon, rest = name.partition(":")
    if kind not in OPTIONS or not colon:
        raise InputError(
            f"'{name}' is no device; write optoforce:PORT, text:PORT, encoder:PORT, "
            f"netft:ADDRESS, lsl:STREAM or replay:PROJECT, such as optoforce:/dev/ttyACM0."
        )
    port, _, behind = rest.partition("?")
    port, options = unquote(port), _parse_options(name, kind, behind)
    if kind == "replay" and not (port and options.get("demonstration")):
        raise InputError(
            f"'{name}' does not say what to play; write a project and one of its "
            f"demonstrations, such as replay:lab.forcelab?demonstration=pull-03."
        )
    if kind == "netft" and not port:
        raise InputError(f"'{name}' has no address; write one, such as netft:192.168.1.1.")
    if kind != "lsl":
        port = port or only_port(kind)
    return _MAKERS[kind](port, **options)


def _parse_options(name: str, kind: str, behind: str) -> dict[str, Any]:
    """The options behind the question mark of a name, as far as they are given."""
    values: dict[str, Any] = {}
    for part in behind.split("&") if behind else []:
        key, equals, value = part.partition("=")
        if key not in OPTIONS[kind] or not equals or key in values:
            raise InputError(
                f"'{part}' in '{name}' means nothing; {kind} takes "
                f"{', '.join(f'{option}=...' for option in OPTIONS[kind])}, each once"
                f"{'' if equals else '; an & within a value is written as %26'}."
            )
        parse, right = OPTIONS[kind][key]
        try:
            values[key] = parse(unquote(value))
        except ValueError as error:
            raise InputError(
                f"'{key}={unquote(value)}' in '{name}' does not say a {key}; write {right}."
            ) from error
    return values


def parse_devices(names: Sequence[str]) -> list[Device]:
    """The devices that names mean; InputError if two of them have the same port."""
    devices: dict[str, Device] = {}
    for name in names:
        device = parse_device(name)
        port = device.name.partition(":")[2]
        if port in devices:
            raise InputError(f"Two devices are said to be at {port}; leave one of them out.")
        devices[port] = device
    return list(devices.values())


def quote_value(text: str) -> str:
    """A port or a value as it is written in a name: what would end it there becomes ``%26``."""
    return quote(text, safe="/:=,;+@ ~!$'()*\\")


def name_stream(stream: FoundStream) -> str:
    """What ``--device`` takes of a stream, such as ``"lsl:Forces"``."""
    name = f"lsl:{quote_value(stream.name)}"
    return f"{name}?source={quote_value(stream.source)}" if stream.ambiguous else name


def with_calibration(name: str, file: Path | None) -> str:
    """The name of a device with another calibration file, or with none; its other options stay."""
    device, _, options = name.partition("?")
    parts = [part for part in options.split("&") if part and not part.startswith("calibration=")]
    if file is not None:
        parts.append(f"calibration={quote_value(str(file))}")
    return "?".join([device, *(["&".join(parts)] if parts else [])])
