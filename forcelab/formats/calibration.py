"""Calibrations: from counts to newtons, per serial number, sensor, axis and sign.

A calibration file is TOML, with a table for each serial number and one in it for each sensor::

    [ISE012.sensor1]                             # the first sensor of the DAQ called ISE012
    fx = { capacity = 300.0, counts = 7925 }     # N (torques: Nm), and the counts that it reads
    fy = { capacity = 300.0, counts = 8641 }
    fz = { capacity = 2000.0, counts = [6049, 5990] }    # pulled (+) and pressed (-)

    [any.sensor1]                                # for every other DAQ
    ...

``newtons = counts * capacity / counts at capacity``. Either number may be a pair, the first for
readings above zero and the second for those below. Of a sensor that gives 560 counts per newton
the capacity is 1 and the counts are 560.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel
from forcelab.errors import InputError
from forcelab.formats.optoforce_packets import KINDS, SensorKind
from forcelab.io import small_text

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


#: The table for all serial numbers that have none of their own.
ANY: Final = "any"
_AXES: Final = KINDS[-1].axes
_SENSOR: Final = re.compile(r"sensor[1-9]\d?")


@dataclass(frozen=True)
class Calibration:
    """What one count of each reading is worth, for c readings."""

    source: str  #: the file and the table in it, for remarks
    positive: NDArray[np.float64]  #: newtons (or newton metres) per count above zero, shape (c,)
    negative: NDArray[np.float64]

    def apply(self, counts: NDArray[np.int16] | NDArray[np.float64]) -> NDArray[np.float64]:
        """Convert counts, shape (n, c), to newtons and newton metres."""
        newtons = np.where(counts < 0, self.negative, self.positive)
        return counts.astype(np.float64) * newtons


@dataclass(frozen=True)
class Calibrations:
    """A calibration file that was read and checked."""

    path: Path
    #: by serial number, then sensor ("sensor1") and axis: newtons per count above and below zero
    tables: Mapping[str, Mapping[tuple[str, str], tuple[float, float]]]

    def find(self, serial: str | None, kind: SensorKind) -> Calibration:
        """The calibration of a DAQ.

        Without a serial number it is that of the table ``any``, or the only one there is.
        """
        name = self._table(serial)
        table = self.tables[name]
        axes = [(f"sensor{i + 1}", axis) for i in range(kind.sensors) for axis in kind.axes]
        for sensor, axis in axes:
            if (sensor, axis) not in table:
                raise InputError(
                    f"'{self.path}' has no '{axis}' in [{name}.{sensor}], which the {kind.name} "
                    f"packets of {f'DAQ {serial}' if serial else 'the DAQ'} need; add it, such as "
                    f"{axis} = {{ capacity = 40.0, counts = 16037 }}."
                )
        newtons = np.array([table[place] for place in axes])
        return Calibration(f"{self.path.name}, [{name}]", newtons[:, 0], newtons[:, 1])

    def _table(self, serial: str | None) -> str:
        """The name of the table that a DAQ's calibration stands in."""
        if serial is not None and serial in self.tables:
            return serial
        if ANY in self.tables:
            return ANY
        if serial is None and len(self.tables) == 1:
            return next(iter(self.tables))
        if serial is None:
            raise InputError(
                f"'{self.path}' calibrates {', '.join(self.tables)}, and the recording does not "
                f"tell its DAQ's serial number; name a file with one of them only."
            )
        raise InputError(
            f"'{self.path}' has no section [{serial}.sensor1] for DAQ {serial}; copy the numbers "
            f"of its calibration sheet there, or call a section [{ANY}.sensor1]."
        )


def channels_of(kind: SensorKind, *, calibrated: bool, first: int = 1) -> tuple[Channel, ...]:
    """Channels of a packet, such as ``fx1 fy1 fz1`` for `first` = 1; counts have no unit."""
    return tuple(
        Channel(name, {"f": "N", "t": "Nm"}[name[0]] if calibrated else "")
        for name in kind.names(first)
    )


def read_calibrations(path: Path) -> Calibrations:
    """Read a calibration file; errors name the line."""
    try:
        text = small_text(path)
        content = tomllib.loads(text)
    except UnicodeDecodeError as error:
        raise InputError(f"'{path}' is no text in UTF-8; save it as such.") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"'{path}' is no valid TOML: {error}; correct that place.") from error
    except OSError as error:
        raise InputError(
            f"The calibration file '{path}' cannot be read: {error.strerror}; check its name."
        ) from error
    tables = _checked(path, text, content)
    if not tables:
        raise InputError(f"'{path}' calibrates nothing; add a section such as [{ANY}.sensor1].")
    return Calibrations(path, tables)


def _checked(
    path: Path, text: str, content: Mapping[str, Any]
) -> dict[str, dict[tuple[str, str], tuple[float, float]]]:
    """The tables of a calibration file, as of :class:`Calibrations`."""

    def refusal(keys: tuple[str, ...], problem: str) -> InputError:
        """An error that names the line, as far as the keys are found in the text in their order."""
        lines, line = text.splitlines(), 0
        for key in keys:
            word = re.compile(rf"(?<![\w-]){re.escape(key)}(?![\w-])")
            matches = (i for i in range(line, len(lines)) if word.search(lines[i].split("#")[0]))
            line = next(matches, line)
        return InputError(f"'{path}', line {line + 1}: {'.'.join(keys)} {problem}")

    tables: dict[str, dict[tuple[str, str], tuple[float, float]]] = {}
    for serial, sensors in content.items():
        if not isinstance(sensors, dict) or not sensors:
            raise refusal((serial,), "must be a section of sensors, such as [any.sensor1].")
        for sensor, axes in sensors.items():
            if not _SENSOR.fullmatch(sensor):
                problem = f"holds '{sensor}'; its sections are called sensor1, sensor2, ..."
                raise refusal((serial,), problem)
            if not isinstance(axes, dict) or not axes:
                problem = "must hold axes, such as fz = { capacity = 40.0, counts = 16037 }."
                raise refusal((serial, sensor), problem)
            for axis, value in axes.items():
                newtons = _newtons(axis, value, partial(refusal, (serial, sensor, axis)))
                tables.setdefault(serial, {})[sensor, axis] = newtons
    return tables


def _newtons(axis: str, value: Any, refusal: Callable[[str], InputError]) -> tuple[float, float]:
    """Newtons per count of one axis, above and below zero."""
    if axis not in _AXES:
        raise refusal(f"is no axis; they are called {', '.join(_AXES)}.")
    if not isinstance(value, dict) or value.keys() != {"capacity", "counts"}:
        raise refusal("must be such as { capacity = 40.0, counts = 16037 }.")
    pairs = {name: n if isinstance(n, list) else [n, n] for name, n in value.items()}
    for name, pair in pairs.items():
        # type() and not isinstance(): true and false are no numbers.
        if len(pair) != 2 or not all(type(n) in (int, float) and 0 < n < math.inf for n in pair):
            raise refusal(f"needs a {name} above zero, or two such numbers in [...] (+ and -).")
    above, below = zip(pairs["capacity"], pairs["counts"], strict=True)
    return above[0] / above[1], below[0] / below[1]
