"""Byte format of recordings: records are read back, and damage never creates a record."""

import json
import os
import zlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardware_bridge.errors import BridgeError
from hardware_bridge.recording import Header, Kind, Record, Recorder, read_recording
from hardware_bridge.recording.format import (
    HEAD,
    MOST_PAYLOAD,
    OVERHEAD,
    VERSION,
    decode_record,
    encode_record,
)

HEADER = Header(
    software="relpos-env 0.1.0",
    config='name = "three cars"\n',
    links=("links.left", "cars.1"),
    monotonic_ns=5_000_000_000,
    wall_ns=1_760_000_000_000_000_000,
)

records = st.builds(
    Record,
    kind=st.sampled_from([Kind.BYTES_IN, Kind.TICK, Kind.EVENT]),
    link=st.integers(0, 2**16 - 1),
    t_ns=st.integers(-(2**63), 2**63 - 1),
    payload=st.binary(max_size=60),
)


def write(path, content, header=HEADER):
    recorder = Recorder(path, header)
    for r in content:
        recorder.add(r.kind, r.link, r.t_ns, r.payload)
    assert recorder.close()
    assert recorder.lost is None
    return path


def plain(content):
    """Return records without sequence numbers."""
    return [(r.kind, r.link, r.t_ns, r.payload) for r in content]


def is_part_in_order(part, whole):
    rest = iter(whole)
    return all(any(one == other for other in rest) for one in part)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Return a function that gives a new path on every call; syncs are disabled."""
    folder, n = tmp_path_factory.mktemp("recordings"), iter(range(10**9))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda fd: None)
        yield lambda: folder / f"{next(n)}.rec"


@settings(max_examples=30)
@given(st.lists(records, max_size=20))
def test_what_was_written_comes_back(place, content):
    path = write(place(), content)
    recording = read_recording(path)
    assert recording.header == HEADER
    assert plain(recording) == plain(content)
    assert [r.sequence for r in recording] == list(range(1, len(content) + 1))
    assert (recording.n_records, recording.torn) == (len(content), False)
    assert (recording.damaged, recording.missing) == (0, 0)
    times = [r.t_ns for r in content] or [HEADER.monotonic_ns]
    assert recording.t_range_ns == (min(times), max(times))


def start_of_records(data):
    marker = HEAD.unpack_from(data)[3]
    return HEAD.size + OVERHEAD + len(decode_record(data, HEAD.size, marker).payload)


@settings(max_examples=40)
@given(st.lists(records, max_size=8), st.data())
def test_a_cut_file_gives_a_prefix(place, content, data):
    path = write(place(), content)
    whole = path.read_bytes()
    cut = data.draw(st.integers(0, len(whole)))
    path.write_bytes(whole[:cut])
    start = start_of_records(whole)
    if cut < start:
        with pytest.raises(BridgeError):
            read_recording(path)
        return
    ends = [start]
    for r in content:
        ends.append(ends[-1] + OVERHEAD + len(r.payload))
    recording = read_recording(path)
    n = sum(end <= cut for end in ends) - 1
    assert plain(recording) == plain(content[:n])
    assert recording.torn == (cut not in ends)
    assert recording.damaged == 0


damages = st.lists(
    st.tuples(
        st.sampled_from(["overwrite", "insert", "delete", "repeat", "zeros", "swap"]),
        st.integers(0, 2000),
        st.integers(0, 300),
        st.binary(min_size=1, max_size=40),
    ),
    min_size=1,
    max_size=4,
)


def damage(data, start, how):
    kind, at, n, junk = how
    at = start + at % max(1, len(data) - start + 1)
    if kind == "overwrite":
        return data[:at] + junk + data[at + len(junk) :]
    if kind == "insert":
        return data[:at] + junk + data[at:]
    if kind == "delete":
        return data[:at] + data[at + n :]
    if kind == "repeat":
        return data[: at + n] + data[at:]
    if kind == "zeros":
        return data[:at] + bytes(len(data[at : at + n])) + data[at + n :]
    return data[:at] + data[at + n : at + 2 * n] + data[at : at + n] + data[at + 2 * n :]


@settings(max_examples=150)
@given(st.lists(records, min_size=1, max_size=10), damages)
def test_damage_gives_some_of_what_was_written_in_order(place, content, blows):
    path = write(place(), content)
    data = path.read_bytes()
    start = start_of_records(data)
    for blow in blows:
        data = damage(data, start, blow)
    path.write_bytes(data)
    recording = read_recording(path)
    found = list(recording)
    written = [Record(r.kind, r.link, r.t_ns, r.payload, k) for k, r in enumerate(content, 1)]
    assert is_part_in_order(found, written)
    assert recording.n_records == len(found)
    if len(found) < len(content) and found and found[-1] == written[-1]:
        assert recording.missing == len(content) - len(found)


def test_behind_a_damaged_record_the_next_is_read(place):
    # Numbers of equal length: behind a shorter one the check sum may look like its next digit.
    content = [Record(Kind.BYTES_IN, 0, k, b"frame %03d" % k) for k in range(100)]
    path = write(place(), content)
    data = bytearray(path.read_bytes())
    for k in (3, 40, 41):
        data[data.index(b"frame %03d" % k)] ^= 1
    path.write_bytes(data)
    recording = read_recording(path)
    assert (recording.damaged, recording.missing, recording.torn) == (2, 3, False)
    assert plain(recording) == plain(r for k, r in enumerate(content) if k not in (3, 40, 41))


def test_a_length_that_lies_costs_one_record(place):
    content = [Record(Kind.BYTES_IN, 0, k, bytes(20)) for k in range(10)]
    path = write(place(), content)
    data = bytearray(path.read_bytes())
    size = OVERHEAD + 20
    data[-3 * size + 23] = 0xFF
    path.write_bytes(data)
    recording = read_recording(path)
    assert (recording.n_records, recording.damaged, recording.torn) == (9, 1, False)


def test_a_record_inside_a_payload_is_none(place):
    """It is neither a record of another file nor, in a damaged record, one of this file."""
    inner = encode_record(b"\x01\x02\x03\x04", Record(Kind.TICK, 0, 1, b"", 7))
    path = write(place(), [Record(Kind.BYTES_IN, 0, 1, inner)] * 3)
    data = bytearray(path.read_bytes())
    data[start_of_records(data) + 12] ^= 0x40
    path.write_bytes(data)
    assert plain(read_recording(path)) == [(Kind.BYTES_IN, 0, 1, inner)] * 2


def test_memory_is_bounded_and_long_files_are_whole(place):
    content = [Record(Kind.BYTES_IN, k, k, bytes([k]) * MOST_PAYLOAD) for k in range(70)]
    path = write(place(), content)
    data = bytearray(path.read_bytes())
    # Damage across the boundary of two reads.
    at = start_of_records(data) + (1 << 20) - 50
    data[at : at + 100] = bytes(100)
    path.write_bytes(data)
    recording = read_recording(path)
    assert recording.damaged == 1
    assert recording.n_records == 70 - recording.missing
    assert recording.missing in (1, 2)
    assert is_part_in_order(plain(recording), plain(content))


@settings(max_examples=60)
@given(st.binary(max_size=200))
def test_what_is_no_recording_is_refused(place, data):
    path = place()
    path.write_bytes(data)
    with pytest.raises(BridgeError, match="recording"):
        read_recording(path)
    path.write_bytes(HEAD.pack(b"\x89RELPOS\n", VERSION, 0, b"abcd") + data)
    with pytest.raises(BridgeError, match="header"):
        read_recording(path)


@pytest.mark.parametrize(
    "payload",
    [b"", b"[]", b"{}", b"\xff", b"[" * 20000, json.dumps({"links": [1]}).encode()],
)
def test_a_header_that_says_nothing_is_refused(place, payload):
    path = place()
    head = HEAD.pack(b"\x89RELPOS\n", VERSION, 0, b"abcd")
    path.write_bytes(head + encode_record(b"abcd", Record(Kind.HEADER, 0, 0, payload)))
    with pytest.raises(BridgeError, match="header"):
        read_recording(path)


def test_other_versions_and_no_file_are_refused(place, tmp_path):
    path = place()
    for version, advice in ((VERSION + 1, "update"), (VERSION - 1, "that wrote it")):
        path.write_bytes(HEAD.pack(b"\x89RELPOS\n", version, 0, b"abcd"))
        with pytest.raises(BridgeError, match=advice):
            read_recording(path)
    for nothing in (tmp_path / "none.rec", tmp_path):
        with pytest.raises(BridgeError, match="cannot be read"):
            read_recording(nothing)


def test_the_bytes_are_those_of_the_documentation(place):
    """The bytes are built by hand as described in docs/how-to/recording.md."""

    def record(kind, link, sequence, t_ns, payload):
        body = b"mark" + bytes([kind]) + link.to_bytes(2, "little")
        body += sequence.to_bytes(8, "little") + t_ns.to_bytes(8, "little", signed=True)
        body += len(payload).to_bytes(4, "little") + payload
        return body + zlib.crc32(body).to_bytes(4, "little")

    header = {
        "software": "x",
        "config": "",
        "links": ["links.a"],
        "monotonic_ns": 1,
        "wall_ns": 11,
    }
    path = place()
    path.write_bytes(
        b"\x89RELPOS\n"
        + bytes([2, 0, 0, 0])
        + b"mark"
        + record(1, 0, 0, 1, json.dumps(header).encode())
        + record(2, 0, 1, 5, b"frame")
        + record(3, 0, 2, -7, b"")
    )
    recording = read_recording(path)
    assert recording.header.links == ("links.a",)
    assert recording.header.wall_ns - recording.header.monotonic_ns == 10
    assert plain(recording) == [(Kind.BYTES_IN, 0, 5, b"frame"), (Kind.TICK, 0, -7, b"")]
    assert recording.t_range_ns == (-7, 5)
    assert not recording.torn
