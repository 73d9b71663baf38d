"""Streams of OptoForce packets for tests, made and parsed the slow and obvious way."""

import itertools

import numpy as np

from forcelab.formats.optoforce_packets import KINDS, Parser

CONFIGURED = bytes([170, 0, 80, 1, 0, 0, 251])


def sealed(body):
    return body + (sum(body) % 65_536).to_bytes(2, "big")


def packet(kind, count, values=None, status=0):
    """One valid packet."""
    values = [0] * kind.columns if values is None else values
    words = [count % 65_536, status, *(int(value) % 65_536 for value in values)]
    payload = b"".join(word.to_bytes(2, "big") for word in words)
    return sealed(bytes([170, 7, 8, len(payload)]) + payload)


def stream(kind, counts, seed=0):
    """Valid packets with random readings, and the readings."""
    values = np.random.default_rng(seed).integers(-32_768, 32_768, (len(counts), kind.columns))
    return b"".join(map(packet, [kind] * len(counts), counts, values)), values


def parsed_slowly(data):
    """Place and bytes of each valid frame of data, byte by byte as the protocol says."""
    found, place, kinds = [], 0, KINDS
    while place < len(data):
        size = 0
        for kind in kinds:
            if data.startswith(kind.header, place):
                size = kind.size
        is_data = size > 0
        for header, length in (((170, 0, 80, 1), 7), ((170, 0, 18, 8), 14)):
            if data.startswith(bytes(header), place):
                size = length
        frame = data[place : place + size]
        if size and len(frame) == size and frame == sealed(frame[:-2]):
            if is_data:
                found.append((place, frame))
                kinds = tuple(kind for kind in kinds if frame.startswith(kind.header))
            place += size
        else:
            place += 1
    return found


def in_pieces(data, cuts, kind=None):
    """Feed a stream cut at some places; offsets, counts, status, values, and the parser."""
    parser = Parser()
    parser.kind = kind
    edges = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    pieces = [parser.feed(data[a:b]) for a, b in itertools.pairwise(edges)]
    pieces.append(parser.finish())
    pieces = [piece for piece in pieces if len(piece)]
    rows = [
        (int(offset), int(count), int(status), tuple(map(int, values)))
        for piece in pieces
        for offset, count, status, values in zip(
            piece.offsets, piece.counts, piece.status, piece.values, strict=True
        )
    ]
    return rows, parser


def fuzzed(number, seed=0):
    """Random and mutated strings: noise, headers in noise, and packets with a few wrong bytes."""
    random = np.random.default_rng(seed)
    whole = [stream(kind, range(4), seed)[0] for kind in KINDS]
    for i in range(number):
        kind = i % 3
        if i % 4 == 0:
            yield random.bytes(int(random.integers(1, 120)))
        elif i % 4 == 1:
            yield KINDS[kind].header + random.bytes(int(random.integers(0, 60)))
        else:
            data = bytearray(whole[kind])
            for place in random.integers(0, len(data), int(random.integers(1, 6))):
                data[place] = int(random.integers(0, 256))
            yield bytes(data[int(random.integers(0, 20)) :])


def fuzz(number, seed=0):
    """Packets accepted, those of them that are not valid, and those that nobody sent.

    The parser must not fail.
    """
    accepted = invalid = unsent = 0
    whole = b"".join(stream(kind, range(4), seed)[0] for kind in KINDS)
    for data in fuzzed(number, seed):
        parser = Parser()
        for packets in (parser.feed(data), parser.finish()):
            accepted += len(packets)
            for place in packets.offsets.tolist():
                frame = data[place : place + parser.kind.size]
                valid = frame.startswith(parser.kind.header)
                invalid += not (valid and frame == sealed(frame[:-2]))
                unsent += frame not in whole
    return accepted, invalid, unsent


def chance(number, seed=0):
    """Headers with noise behind them, in one stream: how many the checksum lets through."""
    random = np.random.default_rng(seed)
    noise = random.integers(0, 256, (number, KINDS[0].size), dtype=np.uint8)
    noise[:, :4] = np.frombuffer(KINDS[0].header, np.uint8)
    # Sums of twelve bytes are small: what has to agree is drawn from what they can be.
    noise[:, -2] &= 15
    parser = Parser()
    parser.kind = KINDS[0]
    return len(parser.feed(noise.tobytes())) + len(parser.finish())
