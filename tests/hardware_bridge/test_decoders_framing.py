"""Boundaries of frames and lines: against a plain search, and at the edges."""

from hypothesis import given
from hypothesis import strategies as st

from hardware_bridge.decoders.checked_frames import CheckedFrames
from hardware_bridge.decoders.lines import MOST_LINE, Lines
from hardware_bridge.decoders.plausible import Damaged
from hardware_bridge.readings import UNNAMED, HeartbeatReading, StatusReading

START = 1
LENGTHS = range(3, 8)


def length(head):
    return head[1] if head[1] in LENGTHS else 0


def small_frames(read):
    return CheckedFrames(START, 2, length, read)


def is_frame(data):
    return (
        len(data) > 2
        and data[0] == START
        and length(data) == len(data)
        and data[-1] == sum(data[:-1]) & 0xFF
    )


def plain_search(data):
    """Repeatedly take the valid frame that ends first, and of these the longest."""
    found, at = [], 0
    while True:
        ends = (
            (end, begin)
            for end in range(at, len(data) + 1)
            for begin in range(at, end)
            if is_frame(data[begin:end])
        )
        first = next(ends, None)
        if first is None:
            return found
        at, begin = first
        found.append(data[begin:at])


# Sums of small bytes are small bytes: valid frames, also nested ones, are frequent.
SMALL = st.lists(st.sampled_from([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10]), max_size=60).map(bytes)
GOOD = st.lists(st.integers(0, 9), min_size=0, max_size=4).map(
    lambda body: (lambda b: b + bytes((sum(b),)))(bytes((START, len(body) + 3, *body)))
)


@given(data=st.lists(SMALL | GOOD, max_size=6).map(b"".join), cut=st.integers(0, 60))
def test_frames_are_those_of_a_plain_search(data, cut):
    frames = []

    def read(frame):
        frames.append(frame)
        return [HeartbeatReading(UNNAMED)]

    decoder = small_frames(read)
    readings = decoder.feed(data[:cut]) + decoder.feed(data[cut:])
    assert frames == plain_search(data)
    assert len(readings) == len(frames) == decoder.counts.frames
    assert decoder.counts.strange + sum(map(len, frames)) + decoder.waiting == len(data)
    assert decoder.waiting < max(LENGTHS)


def test_a_frame_that_was_refused_hides_no_other():
    inner = bytes((1, 3, 4))
    decoder = small_frames(lambda frame: [HeartbeatReading(UNNAMED)])
    assert len(decoder.feed(bytes((1, 6, 9)) + inner + bytes((9, 9)))) == 1
    assert (decoder.counts.frames, decoder.counts.strange) == (1, 5)


def test_a_wrong_sum_is_counted_once():
    decoder = small_frames(lambda frame: [])
    for byte in bytes((1, 4, 9, 9, 9)):
        decoder.feed(bytes((byte,)))
    assert (decoder.counts.damaged, decoder.counts.strange, decoder.waiting) == (1, 5, 0)


def test_what_looks_damaged_within_a_good_frame_is_not_counted():
    frame = bytes((1, 7, 1, 3, 9, 9))
    frame += bytes((sum(frame),))
    decoder = small_frames(lambda frame: [])
    decoder.feed(frame)
    assert (decoder.counts.skipped, decoder.counts.damaged, decoder.counts.strange) == (1, 0, 0)


def read(line):
    if line == "bad":
        raise Damaged
    return [StatusReading(UNNAMED, fault=len(line))] if line.isalpha() else []


def test_lines_end_at_either_end_and_empty_ones_are_nothing():
    decoder = Lines(read)
    assert [r.fault for r in decoder.feed(b"a\nbb\r\nccc\r \n\r\n12\nbad\nx")] == [1, 2, 3]
    counts = decoder.counts
    assert (counts.frames, counts.skipped, counts.damaged, decoder.waiting) == (3, 1, 1, 1)


def test_what_is_no_text_is_damaged():
    decoder = Lines(read)
    assert decoder.feed(b"a\x00b\n\xc3\xa4\na\x7f\n") == []
    assert decoder.counts.damaged == 3


def test_a_line_without_end_is_given_up():
    decoder = Lines(read)
    for _ in range(MOST_LINE + 5):
        decoder.feed(b"a")
        assert decoder.waiting <= MOST_LINE
    assert decoder.counts.strange == MOST_LINE + 5
    assert decoder.feed(b"aa\nbb\n") == [StatusReading(UNNAMED, fault=2)]
    assert decoder.counts.strange == MOST_LINE + 7
    assert [r.fault for r in decoder.feed(b"a" * MOST_LINE + b"\n")] == [MOST_LINE]
