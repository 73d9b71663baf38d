"""Streams that send what is known, and a clock that is off, on this machine alone."""

import ctypes
import math
import socket
import threading
import time
from contextlib import contextmanager

import pylsl

#: Hz of the sine waves.
SINE = 3.0


def sine(k, rate):
    """Sample k of a stream: its number, and a wave."""
    return [float(k), math.sin(2 * math.pi * SINE * k / rate)]


class Sender:
    """Sends its samples in real time, stamped when they are taken, until it is stopped.

    Stamps are `offset` s ahead and `late(k)` s late; samples are left out as if none were taken.
    """

    def __init__(
        self, name, rate=500.0, *, source="", offset=0.0, leave_out=(), first=0, late=None
    ):
        info = pylsl.StreamInfo(name, "Force", 2, rate, pylsl.cf_double64, source)
        info.set_channel_labels(["fz", "wave"])
        info.set_channel_units(["newtons", "mm"])
        self.rate, self.offset, self.leave_out, self.sent = rate, offset, leave_out, first
        self.late = late or (lambda _: 0.0)
        self.outlet = pylsl.StreamOutlet(info)
        self.start = pylsl.local_clock() - first / rate
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def stamp(self, k):
        """When sample k is taken, by liblsl's clock."""
        return self.start + k / self.rate

    def _run(self):
        while not self._ended.wait(0.005):
            due = int((pylsl.local_clock() - self.start) * self.rate)
            for k in range(self.sent, due):
                if k not in self.leave_out:
                    stamp = self.stamp(k) + self.offset + self.late(k)
                    self.outlet.push_sample(sine(k, self.rate), stamp)
            self.sent = max(due, self.sent)

    def stop(self):
        self._ended.set()
        self._thread.join()
        self.outlet = None


@contextmanager
def sending(*arguments, **options):
    sender = Sender(*arguments, **options)
    try:
        yield sender
    finally:
        sender.stop()


def stream_info(xml):
    """The stream that a description is of."""
    parse = pylsl.lib.lib.lsl_streaminfo_from_xml
    parse.restype = ctypes.c_void_p
    return pylsl.StreamInfo(handle=parse(xml.encode()))


@contextmanager
def clock_ahead(seconds, info):
    """The stream as if its computer's clock were ahead: its answers to probes of it are.

    A probe is a datagram ``LSL:timedata``, a number and when it was sent; the answer has the
    number, when it was sent, received, and answered.
    """
    xml = info.as_xml()
    port = int(xml.partition("<v4service_port>")[2].partition("<")[0])
    ended = threading.Event()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as outside:
        outside.bind(("127.0.0.1", 0))
        outside.settimeout(0.02)

        def answer():
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as inside:
                inside.settimeout(0.5)
                while not ended.is_set():
                    try:
                        probe, sender = outside.recvfrom(4096)
                        inside.sendto(probe, ("127.0.0.1", port))
                        number, sent, received, answered = inside.recv(4096).split()
                    except TimeoutError:
                        continue
                    ahead = [repr(float(x) + seconds).encode() for x in (received, answered)]
                    outside.sendto(b" ".join([b"", number, sent, *ahead]), sender)

        thread = threading.Thread(target=answer)
        thread.start()
        changed = xml.replace(f"service_port>{port}<", f"service_port>{outside.getsockname()[1]}<")
        changed = changed.replace("<v4address />", "<v4address>127.0.0.1</v4address>")
        try:
            yield stream_info(changed)
        finally:
            ended.set()
            thread.join()


def host_clock(stamps):
    """Stamps of liblsl's clock on the one that recordings are timed by."""
    # Whatever interrupts one of these makes it too small.
    return stamps + max(time.monotonic() - pylsl.local_clock() for _ in range(9))
