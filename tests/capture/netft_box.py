"""A Net F/T box as its manual describes it (9620-05-Net FT-11, chapters 10 and 18).

Written from that, not from our reader: a request is the header 0x1234, a command and a count; a
record two counters, the status and six counts, all with the high byte first.
"""

import socket
import struct
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np

START_STREAM, STOP_STREAM = 0x0002, 0x0000
ROLLOVER = 2**32

PAGE = """<?xml version="1.0" encoding="UTF-8"?>
<netft><prodname>{product}</prodname><runstat>00000000</runstat><cfgnam>Configuration #0</cfgnam>
<cfgcpf>{cpf}</cfgcpf><cfgcpt>{cpt}</cfgcpt><scfgfu>{fu}</scfgfu><scfgtu>{tu}</scfgtu>
<runrate>7000</runrate><comrdtrate>1000</comrdtrate></netft>"""


def counts_of(k):
    """The six counts of record k."""
    return [k, -k, 2 * k, 1000 - k, 7, -2_000_000_000]


class Box:
    """Samples at 7000 Hz, of which every `step`-th is a record.

    `fate(k)` is what becomes of record k: how often it is sent, from 3 on how many bytes
    of it, or ``"later"`` for behind the next one.
    """

    def __init__(
        self, step=7, *, sequence=0, rdt=0, status=lambda _: 0, fate=lambda _: 1, batch=1,
        product="Net F/T", cpf="1000000", cpt="2000000", fu="N", tu="N-m", page=None,
    ):  # fmt: skip
        self.step, self.sequence, self.rdt, self.batch = step, sequence, rdt, batch
        self.status, self.fate = status, fate
        self.page = page or PAGE.format(product=product, cpf=cpf, cpt=cpt, fu=fu, tu=tu)
        self.commands = []
        self.streams = 0
        self.start = 0.0
        self.on = True
        self._client, self._sent = None, 0
        self._ended = threading.Event()

    def __enter__(self):
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._udp.bind(("127.0.0.1", 0))
        self._udp.settimeout(0.002)
        self.rdt_port = self._udp.getsockname()[1]
        box = self

        class Pages(BaseHTTPRequestHandler):
            def do_GET(self):
                found = self.path == "/netftapi2.xml" and box.page
                self.send_response(200 if found else 404)
                self.end_headers()
                self.wfile.write(box.page.encode() if found else b"")

            def log_message(self, *_):
                pass

        self._http = ThreadingHTTPServer(("127.0.0.1", 0), Pages)
        self.http_port = self._http.server_address[1]
        self._threads = [
            threading.Thread(target=self._run),
            threading.Thread(target=self._http.serve_forever, args=(0.01,)),
        ]
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        self._http.shutdown()
        for thread in self._threads:
            thread.join()
        self._http.server_close()
        self._udp.close()

    def taken(self, k):
        """When record k was taken, on the host's monotonic clock."""
        return self.start + k * self.step / 7000.0

    def switch_off(self):
        self.on = False

    def switch_on(self):
        """Both counters begin anew, and nothing is sent before that is asked for."""
        self._client, self.sequence, self.on = None, 0, True

    def _run(self):
        while not self._ended.is_set():
            try:
                request, client = self._udp.recvfrom(64)
            except TimeoutError:
                self._send_due()
                continue
            header, command, count = struct.unpack(">HHI", request)
            assert header == 0x1234
            assert count == 0
            self.commands.append(command)
            if not self.on:
                continue
            if command == START_STREAM:
                self._client, self._sent, self.start = client, 0, time.monotonic()
                self.streams += 1
            elif command == STOP_STREAM:
                self._client = None

    def _send_due(self):
        if self._client is None or not self.on:
            return
        due = int((time.monotonic() - self.start) * 7000.0 / self.step)
        packets, later = [], []
        for k in range(self._sent, due):
            record = struct.pack(
                ">III6i", (self.rdt + k + 1) % ROLLOVER, (self.sequence + k * self.step) % ROLLOVER,
                self.status(k), *counts_of(k),
            )  # fmt: skip
            fate = self.fate(k)
            if fate == "later":
                later.append(record)
                continue
            packets += [record] * fate if fate < 3 else [record[:fate]]
            packets += later
            later = []
        self._sent = max(due, self._sent)
        packets += later
        for i in range(0, len(packets), self.batch):
            self._udp.sendto(b"".join(packets[i : i + self.batch]), self._client)


def newtons(k):
    """Record k in newtons and newton metres, by the counts of the page above."""
    return np.array(counts_of(k)) / np.repeat([1e6, 2e6], 3)
