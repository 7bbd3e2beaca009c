"""Bytes of messages: valid frames round-trip, and nothing else decodes."""

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracking.errors import WireError
from tracking.ranging.frames.timestamps import MODULUS
from tracking.ranging.frames.wire import (
    ENTRY_BYTES,
    FIXED_BYTES,
    MAX_ID,
    MAX_PARTS,
    VERSION,
    Entry,
    Frame,
    Type,
    crc16,
    decode,
    encode,
    entries_per_frame,
    frame_lengths,
    split,
)

VECTORS = [
    (
        Frame(
            type=Type.REQUEST, src=0, root=0, round=17, slot=0, n=3, boot=0xB5,
            stamp=0x0123456600, sequence=42,
            entries=(Entry(1, 0x0123400000, -78.0, -81.0), Entry(2, None)),
        ),
        "41882a0000ffff0000110011000300b5006645230101000040230163020000000000f063f9",
    ),
    (
        Frame(
            type=Type.REPLY, src=2, root=0, round=17, slot=2, n=3, boot=7,
            stamp=0xFFFFFFFE00, sequence=255, pan=0x1234,
            entries=(Entry(0, 0xFFFFABCDEF, -81.0, -84.0), Entry(1, 1, -90.0, -98.0)),
        ),
        "4188ff3412ffff02001200110203000700feffffff00efcdabffff73010100000000a86dc2",
    ),
    (
        Frame(
            type=Type.JOIN, src=1, root=5, round=255, slot=2, n=2, boot=0, stamp=512, entries=(),
        ),
        "4188000000ffff01001305ff020200000002000000d0bd",
    ),
]  # fmt: skip
"""Frames and their bytes, as in `docs/reference/protocol.md`."""

BYTE = st.integers(0, 255)
STAMP = st.integers(0, MODULUS - 1) | st.sampled_from([0, 1, 2**32, MODULUS - 1])
quick = settings(max_examples=150, derandomize=True)


@st.composite
def entries(draw, ids):
    rows = []
    for k in ids:
        if draw(st.booleans()):
            rx = -60.0 - 3.0 * draw(st.integers(0, 14))
            rows.append(Entry(k, draw(STAMP), rx, rx - draw(st.integers(0, 15))))
        else:
            rows.append(Entry(k, None))
    return tuple(rows)


@st.composite
def frames(draw):
    src = draw(st.integers(0, MAX_ID))
    n, parts = draw(st.integers(1, 255)), draw(st.integers(1, MAX_PARTS))
    ids = draw(st.lists(st.integers(0, MAX_ID), unique=True, max_size=20))
    return Frame(
        type=draw(st.sampled_from(Type)),
        src=src,
        root=draw(st.integers(0, src)),
        round=draw(BYTE),
        slot=draw(st.integers(0, n)),
        n=n,
        boot=draw(BYTE),
        stamp=draw(STAMP),
        entries=draw(entries([k for k in ids if k != src])),
        pan=draw(st.integers(0, 0xFFFF)),
        sequence=draw(BYTE),
        part=draw(st.integers(0, parts - 1)),
        parts=parts,
    )


def summed(body):
    """Append the matching check sum to bytes."""
    return bytes(body) + crc16(bytes(body)).to_bytes(2, "little")


def changed(frame, at, value):
    """Return the bytes of a frame with one byte changed and a matching check sum."""
    body = bytearray(encode(frame)[:-2])
    body[at] = value
    return summed(body)


def accept(data):
    """Decode to a frame or a WireError; a frame has one form only."""
    try:
        frame = decode(data)
    except WireError:
        return
    assert encode(frame) == data


@pytest.mark.parametrize(("frame", "text"), VECTORS)
def test_published_vectors(frame, text):
    assert encode(frame).hex() == text
    assert decode(bytes.fromhex(text)) == frame


def test_check_sum_as_published():
    assert crc16(b"123456789") == 0x2189  # CRC-16/KERMIT, the check value of the catalogue
    assert crc16(b"") == 0


@quick
@given(frames())
def test_round_trip(frame):
    data = encode(frame)
    assert decode(data) == frame
    assert len(data) == FIXED_BYTES + ENTRY_BYTES * len(frame.entries)


@pytest.mark.parametrize("n", range(1, 16))
def test_length_law(n):
    """A message of n nodes has 16 + 7 n bytes."""
    rows = tuple(Entry(k, None) for k in range(1, n))
    assert len(encode(Frame(Type.REQUEST, 0, 0, 0, 0, n, 0, 0, rows))) == 16 + 7 * n
    assert frame_lengths(n - 1, 127) == [16 + 7 * n]


@quick
@given(st.binary(max_size=200))
def test_any_bytes_are_a_frame_or_a_wire_error(data):
    accept(data)


@quick
@given(st.integers(0, 20).flatmap(lambda k: st.binary(min_size=21 + 7 * k, max_size=21 + 7 * k)))
def test_any_bytes_with_a_check_sum_that_fits(body):
    accept(summed(body))


@quick
@given(frames(), st.data())
def test_changed_frames_with_a_check_sum_that_fits(frame, data):
    body = bytearray(encode(frame)[:-2])
    for _ in range(data.draw(st.integers(1, 4))):
        body[data.draw(st.integers(0, len(body) - 1))] = data.draw(BYTE)
    accept(summed(body))


@quick
@given(frames(), st.data())
def test_up_to_three_wrong_bits_are_noticed(frame, data):
    body = bytearray(encode(frame))
    bits = st.lists(st.integers(0, 8 * len(body) - 1), min_size=1, max_size=3, unique=True)
    for bit in data.draw(bits):
        body[bit // 8] ^= 1 << bit % 8
    with pytest.raises(WireError, match="check sum"):
        decode(bytes(body))


@quick
@given(frames(), st.data())
def test_cut_and_stretched_frames(frame, data):
    whole = encode(frame)
    accept(whole[: data.draw(st.integers(0, len(whole)))])
    accept(whole + data.draw(st.binary(max_size=10)))
    if len(whole) > FIXED_BYTES:
        with pytest.raises(WireError, match="length"):
            decode(whole[:-1])


PLAIN = Frame(Type.REPLY, 5, 2, 9, 1, 3, 77, 1024, (Entry(2, 512, -75.0, -78.0), Entry(7, None)))


@pytest.mark.parametrize(
    ("field", "at", "value"),
    [
        ("frame control", 0, 0x40),
        ("frame control", 5, 0xFE),
        ("version", 9, (VERSION + 1) << 4 | 2),
        ("type", 9, VERSION << 4 | 0),
        ("type", 9, VERSION << 4 | 5),
        ("source", 7, 255),
        ("source", 8, 1),
        ("root", 10, 255),
        ("root", 10, 6),
        ("slot", 12, 4),
        ("slot", 13, 0),
        ("part", 14, 0x10),
        ("table", 21, 255),  # an invalid ID
        ("table", 21, 5),  # the sender itself
        ("table", 21, 7),  # twice
        ("table", 28 + 1, 1),  # a stamp of a node that was not received
        ("table", 28 + 6, 0xF1),  # and a power
    ],
)
def test_errors_name_the_field(field, at, value):
    with pytest.raises(WireError, match=field):
        decode(changed(PLAIN, at, value))


@pytest.mark.parametrize("length", [0, 1, 22, 24, 29, 31])
def test_wrong_lengths_are_named(length):
    with pytest.raises(WireError, match="length"):
        decode(bytes(length))


@quick
@given(st.integers(0, 300), st.sampled_from([30, 64, 127, 255, 1023]))
def test_split_tables(n_rows, max_frame):
    rows = [Entry(k, None) for k in range(n_rows)]
    most = entries_per_frame(max_frame)
    if n_rows > MAX_PARTS * most:
        with pytest.raises(WireError, match="table"):
            split(rows, max_frame)
        return
    parts, lengths = split(rows, max_frame), frame_lengths(n_rows, max_frame)
    assert [row for part in parts for row in part] == rows
    assert [FIXED_BYTES + ENTRY_BYTES * len(part) for part in parts] == lengths
    assert 1 <= len(parts) <= MAX_PARTS
    assert max(lengths) <= max_frame
    assert all(len(part) == most for part in parts[:-1])


def test_longest_table_of_the_standard_frame():
    assert entries_per_frame(127) == 14
    assert entries_per_frame(1023) == 142


@quick
@given(st.floats(-200.0, 50.0), st.floats(-250.0, 50.0))
def test_powers_are_quantised(rx_power, fp_power):
    row = Entry(1, 512, rx_power, fp_power)
    heard = decode(encode(replace(PLAIN, entries=(row,)))).entries[0]
    step = min(max(round((-60.0 - rx_power) / 3.0), 0), 14)
    gap = min(max(round(rx_power - fp_power), 0), 15)
    assert (heard.rx_power, heard.fp_power) == (-60.0 - 3.0 * step, -60.0 - 3.0 * step - gap)
    assert decode(encode(replace(PLAIN, entries=(heard,)))).entries[0] == heard
    assert -102.0 <= heard.rx_power <= -60.0
    if -102.0 <= rx_power <= -60.0:
        assert abs(heard.rx_power - rx_power) <= 1.5
    gap = rx_power - fp_power
    assert abs(heard.rx_power - heard.fp_power - min(max(gap, 0.0), 15.0)) <= 0.5


def test_the_documentation_has_these_vectors():
    text = (Path(__file__).parents[3] / "docs" / "reference" / "protocol.md").read_text()
    hexes = text.replace(" ", "").replace("\n", "")
    assert all(data in hexes for _, data in VECTORS)
