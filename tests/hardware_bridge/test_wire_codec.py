"""The codec against its reference implementation, published vectors, and refused input."""

import struct
import zlib

import numpy as np
import pytest
from cobs import cobs
from hypothesis import given, settings
from hypothesis import strategies as st
from wire_twin import KEY, frame, payload, payloads, siphash, words

from hardware_bridge.counts import Counts
from hardware_bridge.decoders.relpos import RelposDecoder
from hardware_bridge.wire import _codec_kernels
from hardware_bridge.wire import definition as wire
from hardware_bridge.wire._check_kernels import check_sums
from hardware_bridge.wire.codec import MOST_CODED, Batch, Codec
from hardware_bridge.wire.layout import CRC_TABLE

VECTORS = {
    0: 0x726FDB47DD0E0E31, 1: 0x74F839C593DC67FD, 7: 0xAB0200F58B01D137, 8: 0x93F5F5799A932462,
    15: 0xA129CA6149BE45E5, 63: 0x958A324CEB064572,
}  # fmt: skip
"""Results of SipHash-2-4 with the key 00 .. 0f for the bytes 00, 01, ..., by length; that of 15 is
from the paper, the others from the authors' reference implementation."""


def sums(data, key=KEY):
    out = np.zeros(2, np.uint64)
    array = np.frombuffer(data or b"\0", np.uint8)
    words = np.frombuffer(key, "<u8").astype(np.uint64)
    check_sums(array, len(data), CRC_TABLE, words, out)
    return int(out[0]), int(out[1])


@pytest.mark.parametrize(("n", "value"), VECTORS.items())
def test_siphash_is_that_of_the_paper(n, value):
    assert siphash(bytes(range(n)), KEY) == value
    assert sums(bytes(range(n)))[1] == value


def test_crc_of_the_usual_check_string():
    assert sums(b"123456789")[0] == 0xCBF43926


@given(st.binary(max_size=520), st.binary(min_size=16, max_size=16))
def test_check_sums_are_those_of_the_twins(data, key):
    assert sums(data, key) == (zlib.crc32(data), siphash(data, key))


def decode(data, key=None):
    """Return the decoded frames with their values, and the counts."""
    codec, batch, counts = Codec(key), Batch(), Counts()
    frames, at = [], 0
    while True:
        then = codec.decode(np.frombuffer(data, np.uint8), at, batch, counts)
        for f in batch.frames[: batch.n_frames].copy():
            frames.append((f, batch.values[f["first"] : f["first"] + f["rows"]].copy()))
        if then == at:
            return frames, counts
        at = then


@settings(max_examples=200)
@given(payloads(), words, words, st.sampled_from([None, KEY]))
def test_decoding_and_encoding_are_those_of_the_twin(spoken, boot, time, key):
    message, data = spoken
    coded = frame(message.type, 513, boot, 70000, time, data, key)
    ((head, values),), counts = decode(coded, key)
    assert counts == Counts(frames=1)
    assert head[["type", "mac", "node", "boot", "sequence", "time"]].tolist() == (
        message.type, key is not None, 513, boot, 70000, time,
    )  # fmt: skip
    per = [field.steps for field in message.fields for _ in range(field.n)]
    steps = values[:, : message.columns] * np.array(per)
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-5)
    assert payload(message, np.round(steps).astype(int).tolist()) == data
    batch = Batch()
    batch.frames[0], batch.values[: len(values)] = head, values
    batch.frames[0]["first"] = 0
    batch.n_frames, batch.n_rows = 1, len(values)
    assert Codec(key).encode(batch).tobytes() == coded


def test_the_constants_of_the_kernels_are_those_of_the_definition():
    k = _codec_kernels
    assert (k.HEADER, k.MAC, k.CRC) == (wire.HEADER_BYTES, wire.MAC_BYTES, wire.CRC_BYTES)
    assert (k.VERSION, k.MOST_FRAME, k.MOST_ROWS) == (wire.VERSION, wire.MOST_FRAME, wire.MOST_ROWS)
    assert k.MOST_CODED == MOST_CODED == wire.MOST_FRAME + -(-wire.MOST_FRAME // 254)


def test_every_message_fits():
    beside = wire.HEADER_BYTES + wire.MAC_BYTES + wire.CRC_BYTES
    for message in wire.MESSAGES:
        most = 1 + wire.MOST_ROWS * message.size if message.repeated else message.size
        assert most + beside <= wire.MOST_FRAME
    assert len({message.type for message in wire.MESSAGES}) == len(wire.MESSAGES)
    assert len({message.name for message in wire.MESSAGES}) == len(wire.MESSAGES)


HEAD = struct.pack("<BBHIII", 0x10, wire.HEARTBEAT.type, 3, 1, 0, 5)


def sealed(raw):
    return cobs.encode(raw + struct.pack("<I", zlib.crc32(raw))) + b"\0"


@pytest.mark.parametrize(("data", "counts"), [
    (sealed(HEAD), Counts(frames=1)),
    (b"\0\0" + sealed(HEAD) + b"\0", Counts(frames=1)),
    (sealed(b"\x20" + HEAD[1:]), Counts(skipped=1)),  # another version
    (sealed(b"\x12" + HEAD[1:]), Counts(skipped=1)),  # a flag of a later version
    (sealed(HEAD[:1] + b"\xfe" + HEAD[2:]), Counts(skipped=1)),  # another message
    (sealed(HEAD[:1] + b"\xfe" + HEAD[2:] + bytes(484)), Counts(skipped=1)),
    (sealed(HEAD + bytes(493)), Counts(damaged=1)),  # longer than any frame
    (sealed(HEAD + b"\1"), Counts(damaged=1)),  # longer than its message
    (sealed(b"\x11" + HEAD[1:]), Counts(damaged=1)),  # flag of a MAC, but no MAC
    (sealed(HEAD[:-1]), Counts(damaged=1)),
    (sealed(b""), Counts(damaged=1)),
    (b"\x09abc\0" + sealed(HEAD), Counts(frames=1, damaged=1)),
    (b"\1" * 515 + b"\0", Counts(damaged=1)),
    (b"\1" * 516 + b"\0", Counts(strange=516)),
    (sealed(HEAD[:1] + b"\4" + HEAD[2:] + b"\1" + bytes(14)), Counts(frames=1)),
    (sealed(HEAD[:1] + b"\4" + HEAD[2:] + b"\2" + bytes(14)), Counts(damaged=1)),
    (sealed(HEAD[:1] + b"\4" + HEAD[2:] + b"\x21" + bytes(33 * 14)), Counts(damaged=1)),
    (sealed(HEAD[:1] + b"\4" + HEAD[2:]), Counts(damaged=1)),
    (sealed(HEAD)[:-1], Counts()),
    (b"", Counts()),
])  # fmt: skip
def test_what_is_no_frame_is_counted(data, counts):
    assert decode(data)[1] == counts
    decoder = RelposDecoder()
    decoder.feed(data)
    counts.n_bytes = len(data)
    assert decoder.counts == counts


def test_with_a_key_only_its_frames_are_taken():
    good = frame(wire.HEARTBEAT.type, 1, 2, 3, 4, b"", KEY)
    other = frame(wire.HEARTBEAT.type, 1, 2, 3, 4, b"", KEY[::-1])
    without = frame(wire.HEARTBEAT.type, 1, 2, 3, 4, b"")
    unknown = frame(200, 1, 2, 3, 4, b"", KEY[::-1])
    assert decode(good + other + without + unknown, KEY)[1] == Counts(frames=1, damaged=3)
    assert decode(good + other + without + unknown)[1] == Counts(frames=3, skipped=1)


def test_each_bit_is_under_the_mac():
    """An attacker without the key can fix the CRC, but nothing else."""
    raw = cobs.decode(frame(wire.COMMAND.type, 1, 2, 3, 4, bytes(7), KEY)[1:-1])[:-4]
    for bit in range(8 * len(raw)):
        changed = bytearray(raw)
        changed[bit // 8] ^= 1 << bit % 8
        assert decode(sealed(bytes(changed)), KEY)[1] == Counts(damaged=1)


def test_more_frames_than_a_batch_has_room_for():
    codec, batch, counts = Codec(), Batch(3), Counts()
    data = np.frombuffer(sealed(HEAD) * 7, np.uint8)
    at, met = 0, []
    while batch.n_frames or not met:
        at = codec.decode(data, at, batch, counts)
        met.append(batch.n_frames)
    assert met == [3, 3, 1, 0]
    assert counts == Counts(frames=7)


def one(message, values, rows=1, **fields):
    batch = Batch()
    batch.n_frames, batch.n_rows = 1, max(rows, 0)
    batch.frames[0] = (message.type, 0, 1, 2, 3, 4, 0, rows)
    for name, value in fields.items():
        batch.frames[0][name] = value
    batch.values[:, : message.columns] = values
    return batch


@pytest.mark.parametrize(("batch", "match"), [
    (one(wire.MOTION, [np.nan, 0.0, 0.0]), "finite"),
    (one(wire.MOTION, [0.0, np.inf, 0.0]), "finite"),
    (one(wire.MOTION, 0.0, type=99), "type"),
    (one(wire.MOTION, 0.0, rows=2), "rows"),
    (one(wire.MOTION, 0.0, rows=0), "rows"),
    (one(wire.RANGES, 0.0, rows=33), "rows"),
    (one(wire.RANGES, 0.0, rows=-1), "rows"),
    (one(wire.MOTION, 0.0, first=5), "first"),
    (one(wire.MOTION, 0.0, mac=1), "mac"),
])  # fmt: skip
def test_what_cannot_be_encoded_is_refused(batch, match):
    with pytest.raises(ValueError, match=match):
        Codec().encode(batch)


def test_too_much_becomes_the_most():
    batch = one(wire.MOTION, [1e9, -1e300, 1e9])
    ((_, values),), _ = decode(Codec().encode(batch).tobytes())
    np.testing.assert_array_equal(values[0, :3], [32.767, -3.2768, 255.0])


def test_a_key_has_sixteen_bytes():
    with pytest.raises(ValueError, match="key: expected 16 bytes, got 15"):
        Codec(bytes(15))
