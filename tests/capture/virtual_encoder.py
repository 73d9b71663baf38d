"""A virtual encoder behind the adapter that counts for it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from forcelab.capture.emulator import BURST, Readings, SamplingRun, VirtualSampler

#: Registers of the encoder's adapter: how much its count has to change to be sent, how often it
#: looks, its clock, its count, what it is, and how it replies.
THRESHOLD, INTERVAL, CLOCK, COUNT, VERSION, FORMAT = "0B", "0C", "0D", "0E", "14", "15"
#: Bits of the last: line feed, carriage return, a time stamp before them, blanks between all.
LINE_FEED, RETURN, STAMPED, SPACED = 1, 2, 4, 8
#: Steps a second of its clock.
STAMP_RATE = 512.0


class VirtualEncoder(VirtualSampler):
    """A quadrature encoder behind a QSB adapter: it streams on change once it is told to.

    Its replies are ``r``, ``w``, ``s`` or ``e``, the register, the value in hexadecimal, and where
    register 15 says so a time stamp; then ``!`` if the adapter is one that ends so. See
    :mod:`forcelab.capture.encoder`.

    Parameters
    ----------
    source : callable
        Counts, shape (m, 1), at device times (s), shape (m,).
    rate : float
        How often a second it looks whether the count has changed.
    bang : bool
        Whether its replies end with ``!``.
    serial : int
        Its serial number.
    clock_ppm, path, burst, waits
        As of :class:`~forcelab.capture.emulator.VirtualSampler`.
    """

    def __init__(
        self,
        source: Readings,
        rate: float = STAMP_RATE,
        *,
        bang: bool = True,
        serial: int = 81_830,
        clock_ppm: float = 0.0,
        path: Path | None = None,
        burst: float = BURST,
        waits: bool = False,
    ) -> None:
        super().__init__(source, rate, clock_ppm, path, burst, waits)
        #: All commands it was given.
        self.commands: list[str] = []
        self._end, self._serial = "!" if bang else "", serial
        self._received = ""
        self._current_item = 0.0
        self._reset()

    def _reset(self) -> None:
        """As it is when it is switched on: it has lost its count."""
        self._streams = False
        self._registers = {FORMAT: LINE_FEED | RETURN, VERSION: self._serial << 12 | 6}
        self._clock = self._current_item
        self._offset: int | None = None
        self._count = self._shown = 0

    def _begin(self, now: float) -> None:
        super()._begin(now)
        self._reset()

    def _due(self, now: float) -> bytes:
        times, values = self._next(now)
        out = b""
        threshold = self._registers.get(THRESHOLD, 0)
        for time, count in zip(times.tolist(), values[:, 0].tolist(), strict=True):
            if self._offset is None:
                self._offset = round(count)
            self._current_item, self._count = time, round(count) - self._offset
            if self._streams and abs(self._count - self._shown) >= threshold:
                self._shown = self._count
                out += self._reply("s", COUNT, self._count)
        return out

    def _answer(self, data: bytes) -> bytes:
        *lines, self._received = (self._received + data.decode("ascii", "replace")).split("\n")
        commands = [line.strip().upper() for line in lines]
        return b"".join(self._reply_to(command) for command in commands if command)

    def _reply_to(self, command: str) -> bytes:
        """What it replies to one command."""
        self.commands.append(command)
        verb, register, digits = command[:1], command[1:3], command[3:]
        try:
            number = int(digits or "0", 16)
        except ValueError:
            return self._reply("e", "00", 0)
        if verb == "W":
            self._write(register, number)
        elif verb in {"R", "S"} and register == COUNT:
            self._streams = verb == "S"
            number = self._shown = self._count
        elif verb == "R":
            number = self._registers.get(register, 0)
        else:
            return self._reply("e", "00", 0)
        return self._reply(verb.lower(), register, number)

    def _write(self, register: str, number: int) -> None:
        """Do what a register stands for."""
        self._registers[register] = number
        if register == INTERVAL and number and self._runs:
            last = self._runs[-1]
            sent = np.array([self._sent])
            start, device = float(last.host_times(sent)[0]), float(last.device_times(sent)[0])
            self._runs.append(
                SamplingRun(self._sent, start, device, STAMP_RATE / number, self._pace)
            )
        elif register == CLOCK:
            self._clock = self._current_item

    def _reply(self, verb: str, register: str, value: int) -> bytes:
        """One reply, in the format that register 15 asks for."""
        style = self._registers[FORMAT]
        parts = [verb, register, f"{value & 0xFFFFFFFF:08X}"]
        if style & STAMPED:
            parts.append(f"{int((self._current_item - self._clock) * STAMP_RATE) & 0xFFFFFFFF:08X}")
        if self._end:
            parts.append(self._end)
        ending = "\r" * bool(style & RETURN) + "\n" * bool(style & LINE_FEED)
        return ((" " if style & SPACED else "").join(parts) + ending).encode("ascii")
