"""ATI Net F/T boxes and Ethernet Axia sensors: six axes by Raw Data Transfer (RDT) over UDP.

As ATI's manual describes it (9620-05-Net FT-11, chapters 10 and 18). A request of eight bytes
starts the stream. Each record has two counters of 32 bits: one counts the records that were sent,
the other the samples that the sensor took, of which every n-th makes a record. What the counters
leave out is a gap. Counts become newtons and newton metres by the sensor's configuration page, or
by what is given.
"""

from __future__ import annotations

import http.client
import math
import re
import select
import socket
import struct
import time
from collections.abc import Mapping
from contextlib import suppress
from typing import Final

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.device import Block, Device, ReadPacer, SoftwareZero, UnpluggedError
from forcelab.demonstration import Channel
from forcelab.errors import InputError

#: Where it takes requests, and where its pages are.
RDT_PORT, HTTP_PORT = 49_152, 80
PAGE: Final = "/netftapi2.xml"
#: Bytes of the page that are read; a real one has some 5,000.
MOST_PAGE = 1 << 16
_REQUEST = struct.Struct(">HHI")
_STOP, _START = 0, 2
#: Where its counters begin at zero again.
_TURN: Final = 1 << 32
_RECORD = np.dtype([("sent", ">u4"), ("taken", ">u4"), ("status", ">u4"), ("counts", ">i4", 6)])
#: Samples a second that it takes itself, unless its page says another number.
INTERNAL_RATE = 7000.0
#: Seconds for the first records, and for the page.
ANSWER_SECONDS = 1.0
#: Seconds, and records, without any of which it is taken for gone, whichever is longer.
SILENCE_SECONDS, SILENCE_RECORDS = 0.5, 5
#: Seconds of readings of which the mean is taken for zero.
ZEROING_SECONDS = 0.03
#: Bytes that wait while this computer is busy, and datagrams that are read at once.
WAITING_BYTES, AT_ONCE = 1 << 20, 1000
#: Newtons in a unit of force and newton metres in one of torque, as the page calls them.
FORCES: Final = {
    "n": 1.0, "kn": 1e3, "lbf": 4.4482216152605, "klbf": 4448.2216152605, "kgf": 9.80665,
    "gf": 0.00980665,
}  # fmt: skip
TORQUES: Final = {
    "nm": 1.0, "nmm": 1e-3, "knm": 1e3, "lbfin": 0.1129848290276167, "lbfft": 1.3558179483314004,
    "kgfcm": 0.0980665,
}  # fmt: skip
#: What bits of the status mean; of the rest the number is told. Bit 31 says that any is set, and
#: bit 16 of a box that a threshold was passed, which is no fault.
_BOX: Final = {
    30: "CPU or RAM error", 29: "digital board error", 28: "analog board error",
    27: "serial link error", 26: "program memory error", 25: "halted by its configuration",
    24: "invalid settings", 23: "settings do not fit the calibration", 20: "RDT error",
    17: "transducer saturated, or A/D error", 5: "no data from the transducer",
}  # fmt: skip
_AXIA: Final = {
    30: "force or torque out of range", 29: "calibration checksum error", 28: "simulated error",
    27: "gage out of range", 7: "calibration not accessible", 3: "busy", 2: "broken gage",
    1: "supply voltage out of range", 0: "temperature out of range",
}  # fmt: skip
_BOX_SATURATED, _AXIA_SATURATED = 1 << 17, 1 << 27 | 1 << 30
_NO_FAULT = 1 << 31 | 1 << 16
#: Status bit of a sample by which a recorder counts it as beyond the sensor's range.
_OVERLOAD = 0x0200


def parse_records(data: bytes) -> NDArray[np.void]:
    """The records of a datagram, shape (n,); none where it does not hold whole ones."""
    whole = len(data) % _RECORD.itemsize == 0
    return np.frombuffer(data if whole else b"", _RECORD)


def parse_page(page: str, where: str) -> dict[str, str]:
    """The texts of a configuration page by their elements' names."""
    found = dict(re.findall(r"<([a-z]\w{0,30})>([^<>]{0,200})</\1>", page))
    if not {"cfgcpf", "cfgcpt"} <= found.keys():
        raise InputError(f"{where} is no configuration page of a Net F/T; check the address.")
    return {name: text.strip() for name, text in found.items()}


def scale(page: Mapping[str, str], counts: str, unit: str, units: Mapping[str, float]) -> float:
    """Newtons or newton metres a count, by a page."""
    name = page.get(unit, "")
    worth = units.get(re.sub(r"[^a-z]", "", name.lower()))
    number = _positive(page[counts])
    if worth is None or number is None:
        raise InputError(
            f"The sensor's configuration page says '{page[counts]}' counts a '{name}', which means "
            f"nothing here; give the counts a newton and a newton metre, such as "
            f"?force=1000000&torque=1000000."
        )
    return worth / number


def _positive(text: str) -> float | None:
    """The positive number that a text is; None for any other."""
    with suppress(ValueError):
        number = float(text)
        return number if 0 < number < math.inf else None
    return None


class NetFT(Device):
    """A Net F/T at an address of the network; not for several threads at once.

    A zero is subtracted here, not set in the sensor, whose readings others may use as well.
    """

    channels = tuple(Channel(f"f{axis}", "N") for axis in "xyz") + tuple(
        Channel(f"t{axis}", "Nm") for axis in "xyz"
    )

    def __init__(
        self, host: str, *, force: float = 0.0, torque: float = 0.0, rate: float = 0.0
    ) -> None:
        """`force` and `torque` are counts a newton and a newton metre, 0 to ask the sensor.

        `rate` (Hz) is that of its records, 0 to tell it by their counters.
        """
        for key, value in (("force", force), ("torque", torque), ("rate", rate)):
            if not 0 <= value < math.inf:
                raise InputError(f"A Net F/T cannot have {key}={value:g}; give a positive number.")
        if bool(force) != bool(torque):
            raise InputError("Give a Net F/T both force and torque (counts), or neither.")
        super().__init__()
        self.name, self._host = f"netft:{host}", host
        self.rate = self._stated_rate = rate
        self._stated_counts = force, torque
        self._per_count = np.ones(6)
        self._meanings: Mapping[int, str] = {}
        self._saturated = 0
        self._internal_rate = INTERNAL_RATE
        self._socket: socket.socket | None = None
        self._stream = RecordStream()
        self._last_arrival = 0.0
        self._pacer = ReadPacer()

    def open(self) -> None:
        """Learn what a count is worth, start the stream, and see how far its counters step."""
        self._stream = RecordStream()
        if any(self._stated_counts):
            force, torque = self._stated_counts
            self._per_count = np.repeat([1 / force, 1 / torque], 3)
        else:
            self._read_page()
        try:
            self._connect()
        except UnpluggedError as error:
            raise InputError(str(error)) from error
        self.rate = self._stated_rate or self._internal_rate / self._stream.step
        self._zero = SoftwareZero(max(1, round(ZEROING_SECONDS * self.rate)))

    def reopen(self) -> None:
        """Start the stream again; UnpluggedError while nothing comes."""
        self._stream.restart()
        self._connect()

    def read(self, timeout: float) -> Block | None:
        """What has arrived; a few milliseconds are read together."""
        records, arrived = self._receive(timeout)
        block = self._stream.feed(records)
        if block is None:
            silent = arrived - self._last_arrival
            if silent > max(SILENCE_SECONDS, SILENCE_RECORDS / (self.rate or 1.0)):
                raise UnpluggedError(
                    f"{self.name} sends nothing any more; check its cable, and that no other "
                    f"program reads it."
                )
            return None
        self._last_arrival = arrived
        ticks, taken = block
        values = self._zero.apply(taken["counts"] * self._per_count)
        words = taken["status"].astype(np.int64)
        self._report(words[(words & ~_NO_FAULT) != 0], arrived)
        status = np.where(words & self._saturated, _OVERLOAD, 0).astype(np.uint16)
        return Block(np.full(len(ticks), arrived), ticks, values, status)

    def close(self) -> None:
        """Stop its stream; it serves one program at a time."""
        port, self._socket = self._socket, None
        if port is not None:
            with suppress(OSError):
                port.send(_REQUEST.pack(0x1234, _STOP, 0))
            port.close()

    def _read_page(self) -> None:
        """What a count is worth, and what the bits of its status mean."""
        where = f"http://{self._host}{PAGE}"
        connection = http.client.HTTPConnection(self._host, HTTP_PORT, timeout=ANSWER_SECONDS)
        try:
            connection.request("GET", PAGE)
            answer = connection.getresponse()
            text = answer.read(MOST_PAGE).decode("latin-1") if answer.status == 200 else ""
        except (OSError, ValueError, http.client.HTTPException) as error:
            raise InputError(
                f"The sensor at '{self._host}' does not show its configuration ({error}); check "
                f"the address, or give the counts a newton and a newton metre, such as "
                f"{self.name}?force=1000000&torque=1000000."
            ) from error
        finally:
            connection.close()
        page = parse_page(text, where)
        force = scale(page, "cfgcpf", "scfgfu", FORCES)
        torque = scale(page, "cfgcpt", "scfgtu", TORQUES)
        self._per_count = np.repeat([force, torque], 3)
        self._internal_rate = _positive(page.get("runrate", "")) or INTERNAL_RATE
        axia = "axia" in page.get("prodname", "").lower()
        self._meanings = _AXIA if axia else _BOX
        self._saturated = _AXIA_SATURATED if axia else _BOX_SATURATED

    def _connect(self) -> None:
        """Ask for records until some come, of which the first tell how the counters step."""
        self.close()
        port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, WAITING_BYTES)
            port.connect((self._host, RDT_PORT))
            port.setblocking(False)
            self._socket = port
            for _ in range(2):  # a request may be lost
                port.send(_REQUEST.pack(0x1234, _START, 0))
                until = time.monotonic() + 0.5 * ANSWER_SECONDS
                while time.monotonic() < until:
                    with suppress(UnpluggedError):  # refused, as it has only begun to start
                        records, arrived = self._receive(0.05)
                        if self._stream.learn(records):
                            self._last_arrival = arrived
                            return
        except (OSError, UnicodeError) as error:
            self.close()
            raise UnpluggedError(f"The address '{self._host}' cannot be used ({error}).") from error
        self.close()
        raise UnpluggedError(
            f"The sensor at '{self._host}' sends no records; check the address, and that RDT is "
            f"enabled on its Communications page."
        )

    def _receive(self, timeout: float) -> tuple[NDArray[np.void], float]:
        """Records that have come after at most so many seconds, and when they were read."""
        port = self._socket
        if port is None:
            raise UnpluggedError(f"{self.name} is not connected.")
        left = self._pacer.wait(timeout)
        pieces: list[NDArray[np.void]] = [np.empty(0, _RECORD)]
        try:
            if select.select([port], [], [], left)[0]:
                with suppress(BlockingIOError):
                    while len(pieces) < AT_ONCE:
                        data = port.recv(1 << 16)
                        pieces.append(parse_records(data))
                        if not len(pieces[-1]):
                            self._remark_size(len(data))
        except OSError as error:
            raise UnpluggedError(f"{self.name} is gone ({error}).") from error
        return np.concatenate(pieces), self._pacer.arrived()

    def _remark_size(self, size: int) -> None:
        self._messages.put_once(
            "size",
            f"{self.name} sent {size} bytes, which are no whole records of {_RECORD.itemsize}; "
            f"they are left out.",
        )

    def _report(self, words: NDArray[np.int64], arrived: float) -> None:
        """Remark what status words say, shape (n,), the last read at `arrived`."""
        for word in np.unique(words).tolist():
            bits = [bit for bit in range(32) if word & ~_NO_FAULT & 1 << bit]
            texts = [self._meanings.get(bit, f"bit {bit}") for bit in bits]
            sentence = f"{self.name} reports status 0x{word:08x}: {', '.join(texts)}."
            self._messages.put_once(word, sentence, arrived)


class RecordStream:
    """Ticks of records, by the counters of those that were sent and of the samples taken."""

    def __init__(self) -> None:
        #: Samples that the sensor takes from one record to the next.
        self.step = 1.0
        self._last: tuple[int, int] | None = None  # both counters of the last record
        self._tick = -1
        self._first: list[NDArray[np.void]] = []

    def learn(self, records: NDArray[np.void]) -> bool:
        """Take the first records of a stream, which are dropped; whether the step is known."""
        self._first.append(records)
        first = _sorted(np.concatenate(self._first), None)
        if len(first) < 3:
            return False
        sent, taken = _steps(first["sent"]), _steps(first["taken"])
        self.step = max(float(np.median(taken / sent)), 1.0)
        self._last = int(first["sent"][-1]), int(first["taken"][-1])
        self._first.clear()
        return True

    def restart(self) -> None:
        """The stream begins anew, and both counters may; the ticks go on."""
        self._last = None
        self._first.clear()

    def feed(self, records: NDArray[np.void]) -> tuple[NDArray[np.int64], NDArray[np.void]] | None:
        """Records in their order, and their ticks; None without any.

        Those that come twice, or after later ones were given, are dropped.
        """
        assert self._last is not None
        records = _sorted(records, self._last[0])
        if not len(records):
            return None
        sent, taken = (
            _steps(np.concatenate([[last], records[key]]))
            for last, key in zip(self._last, ("sent", "taken"), strict=True)
        )
        # What the sensor took and did not send is missing as well.
        ticks = self._tick + np.cumsum(np.maximum(sent, np.rint(taken / self.step)))
        self._last = int(records["sent"][-1]), int(records["taken"][-1])
        self._tick = int(ticks[-1])
        return ticks.astype(np.int64), records


def _steps(counts: NDArray[np.generic]) -> NDArray[np.int64]:
    """How far a counter that turns at 32 bits went from each record to the next."""
    return np.remainder(np.diff(counts.astype(np.int64)), _TURN)


def _sorted(records: NDArray[np.void], last: int | None) -> NDArray[np.void]:
    """Records by their counter, which turns at 32 bits: each once, and none before the last."""
    if not len(records):
        return records
    before = int(records["sent"][0]) - _TURN // 4 if last is None else last
    ahead = (records["sent"].astype(np.int64) - before) % _TURN
    ahead, places = np.unique(ahead, return_index=True)
    return records[places[(ahead > 0) & (ahead < _TURN // 2)]]
