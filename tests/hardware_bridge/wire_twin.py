"""Reference implementation of the wire format in Python, with the `cobs` package and zlib."""

import random
import struct
import zlib

from cobs import cobs
from hypothesis import strategies as st

from hardware_bridge.readings import (
    MICROSECONDS_32,
    AckReading,
    DriveReading,
    HeartbeatReading,
    ImuReading,
    MotionReading,
    OperatorReading,
    PeerReading,
    RangeReading,
    Source,
    StateReading,
    StatusReading,
)
from hardware_bridge.wire.definition import MESSAGES

KEY = bytes(range(16))
MASK = (1 << 64) - 1


def siphash(data, key):
    """Return SipHash-2-4 as in the paper."""
    k = struct.unpack("<2Q", key)
    v = [k[0] ^ 0x736F6D6570736575, k[1] ^ 0x646F72616E646F6D]
    v += [k[0] ^ 0x6C7967656E657261, k[1] ^ 0x7465646279746573]

    def turn(i, bits):
        v[i] = (v[i] << bits | v[i] >> (64 - bits)) & MASK

    def rounds(n):
        for _ in range(n):
            for a, b, bits in ((0, 1, 13), (2, 3, 16)):
                v[a] = (v[a] + v[b]) & MASK
                turn(b, bits)
                v[b] ^= v[a]
            turn(0, 32)
            for a, b, bits in ((2, 1, 17), (0, 3, 21)):
                v[a] = (v[a] + v[b]) & MASK
                turn(b, bits)
                v[b] ^= v[a]
            turn(2, 32)

    padded = data + bytes(-(len(data) + 1) % 8) + bytes((len(data) & 0xFF,))
    for (m,) in struct.iter_unpack("<Q", padded):
        v[3] ^= m
        rounds(2)
        v[0] ^= m
    v[2] ^= 0xFF
    rounds(4)
    return v[0] ^ v[1] ^ v[2] ^ v[3]


def frame(type_, node, boot, sequence, time, payload, key=None, form=None):
    """Return the bytes of a frame with its zeros."""
    form = (1 << 4 | (key is not None)) if form is None else form
    raw = struct.pack("<BBHIII", form, type_, node, boot, sequence, time) + payload
    if key is not None:
        raw += struct.pack("<Q", siphash(raw, key))
    return b"\0" + cobs.encode(raw + struct.pack("<I", zlib.crc32(raw))) + b"\0"


def payload(message, rows):
    """Return the payload of a message with numbers in steps."""
    out = bytes((len(rows),)) if message.repeated else b""
    for row in rows:
        numbers = iter(row)
        for field in message.fields:
            for _ in range(field.n):
                out += next(numbers).to_bytes(field.size, "little", signed=field.type[0] == "i")
    return out


def row_of(message):
    """Return a strategy for the numbers of a row."""
    numbers = [st.integers(*field.limits) for field in message.fields for _ in range(field.n)]
    return st.tuples(*numbers)


@st.composite
def payloads(draw):
    """Draw a message and its payload, with any numbers."""
    message = draw(st.sampled_from(MESSAGES))
    most = 32 if message.repeated else 1
    rows = draw(st.lists(row_of(message), min_size=most % 32, max_size=most))
    return message, payload(message, rows)


words = st.integers(0, (1 << 32) - 1)
nodes = st.integers(0, (1 << 16) - 1)
sources = words.map(lambda ticks: Source(ticks=ticks, clock=MICROSECONDS_32))


def steps(bits, per):
    """Return a strategy for numbers that a field represents exactly."""
    limit = 1 << (bits - 1)
    return st.integers(-limit, limit - 1).map(lambda n: n / per)


gyr = st.tuples(*[steps(24, 100_000)] * 3)
acc = st.tuples(*[steps(24, 10_000)] * 3)
mag = st.tuples(*[steps(24, 1000)] * 3)
powers = st.none() | steps(16, 100)
names = nodes.map(str)
turns = st.sampled_from([(1.0, 0.0, 0.0, 0.0), (0.5, -0.5, 0.5, -0.5), (0.0, 0.6, -0.8, 0.0)])

readings = st.one_of(
    st.builds(ImuReading, sources, gyr, acc, mag=st.none() | mag),
    st.builds(StateReading, sources, turns, acc),
    st.builds(PeerReading, sources, names, st.integers(0, 65535).map(lambda n: n / 10_000), turns,
              acc, st.integers(0, 65535).map(lambda n: n / 1000)),
    st.builds(RangeReading, sources, names, steps(32, 10_000), powers, powers, st.none() | names),
    st.builds(MotionReading, sources, steps(16, 1000), st.none() | steps(16, 10_000)),
    st.builds(StatusReading, sources, st.none() | st.integers(0, 65535).map(lambda n: n / 1000),
              words),
    st.builds(AckReading, sources, words),
    st.builds(HeartbeatReading, sources),
    st.builds(OperatorReading, sources, names, st.tuples(*[steps(16, 1000)] * 2)),
    st.builds(DriveReading, sources, names, steps(16, 1000), steps(16, 10_000), st.booleans()),
)  # fmt: skip
"""Any reading, with values that the format represents exactly, and a time of its own."""


def spread(seed, n, key=None):
    """Return the bytes of n random frames of all messages."""
    rng = random.Random(seed)
    out = []
    for k in range(n):
        message = MESSAGES[rng.randrange(len(MESSAGES))]
        count = rng.randrange(6) if message.repeated else 1
        rows = [
            [rng.randint(*f.limits) if rng.random() < 0.7 else 0
             for f in message.fields for _ in range(f.n)]
            for _ in range(count)
        ]  # fmt: skip
        if message.name == "state":
            rows = [[8_000_000, 0, 0, 0, *rows[0][4:]]]
        if message.name == "peer":
            rows = [[*rows[0][:2], 8_000_000, 0, 0, 0, *rows[0][6:]]]
        out.append(
            frame(message.type, 3, 7, k, rng.randrange(1 << 32), payload(message, rows), key)
        )
    return out


def mutate(rng, data):
    """Return bytes with damage as by a bad line."""
    data = bytearray(data)
    kind = rng.randrange(6)
    at = rng.randrange(len(data))
    if kind == 0:
        data[at] ^= 1 << rng.randrange(8)
    elif kind == 1:
        del data[at : at + rng.randrange(1, 9)]
    elif kind == 2:
        data[at:at] = rng.randbytes(rng.randrange(1, 9))
    elif kind == 3:
        data[at : at + 8] = rng.randbytes(len(data[at : at + 8]))
    elif kind == 4:
        data[at : at + 8] = bytes(len(data[at : at + 8]))
    else:
        other = rng.randrange(len(data))
        data[at : at + 20] = data[other : other + 20]
    return bytes(data)
