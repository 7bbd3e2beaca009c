"""Decoder, encoder and driver of our own format: round trips, damage, limits."""

import math
import random

import pytest
from cobs import cobs
from hypothesis import given, settings
from hypothesis import strategies as st
from wire_twin import KEY, frame, mutate, readings, spread, words

from hardware_bridge.counts import Counts
from hardware_bridge.decoders.base import MOST_WAITING
from hardware_bridge.decoders.relpos import RelposDecoder
from hardware_bridge.drivers.relpos import RelposDriver, RelposOptions
from hardware_bridge.errors import BridgeError
from hardware_bridge.readings import (
    MICROSECONDS_32,
    RADIO_40,
    DriveReading,
    HeartbeatReading,
    ImuReading,
    MotionReading,
    OperatorReading,
    RangeReading,
    Source,
    StateReading,
    StatusReading,
)
from hardware_bridge.wire.definition import HOST, STATE
from hardware_bridge.wire.encoder import RelposEncoder

NOW = Source(ticks=5, clock=MICROSECONDS_32)


def cut(data, places):
    edges = sorted({min(p, len(data)) for p in places} | {0, len(data)})
    return [data[a:b] for a, b in zip(edges, edges[1:], strict=False)]


def said(chunks, key=None):
    decoder = RelposDecoder(key)
    met = [reading for chunk in chunks for reading in decoder.feed(chunk)]
    return met, decoder.counts


@settings(max_examples=200)
@given(st.lists(readings, max_size=8), st.sampled_from([None, KEY]), words)
def test_what_was_encoded_is_decoded(spoken, key, boot):
    encoder = RelposEncoder(7, boot, key)
    met, counts = said([encoder.encode(spoken)], key)
    assert [type(r) for r in met] == [type(r) for r in spoken]
    assert [r._replace(source=r.source) for r in met] == [
        was._replace(source=r.source._replace(ticks=was.source.ticks))
        for was, r in zip(spoken, met, strict=True)
    ]
    numbers = [r.source.sequence for r in met]
    assert sorted(set(numbers)) == list(range(encoder.sequence))
    assert numbers == sorted(numbers)
    assert {(r.source.device, r.source.boot, r.source.clock) for r in met} <= {
        ("7", boot, MICROSECONDS_32)
    }
    assert (counts.damaged, counts.skipped, counts.strange) == (0, 0, 0)
    assert counts.frames == encoder.sequence


@settings(max_examples=100)
@given(st.integers(0, 1000), st.lists(st.integers(0, 1500)), st.binary(max_size=700), st.booleans())
def test_any_cut_gives_the_same(seed, places, garbage, behind):
    frames = b"".join(spread(seed, 8))
    data = frames + garbage + frames if behind else garbage + b"\0" + frames
    whole = said([data])
    assert said(cut(data, places)) == whole
    assert said([bytes((byte,)) for byte in data]) == whole


def damage(seed, n, key):
    """Feed mutated frames: only sent readings are decoded, and the next good frame is read."""
    rng = random.Random(seed)
    frames = spread(seed, n, key)
    sent = {repr(r) for r in said(frames, key)[0]}
    decoder, last = RelposDecoder(key), frames[-1]
    expected = said([last], key)[0]
    assert expected
    for coded in frames[:-1]:
        bad = mutate(rng, coded)
        met = decoder.feed(bad)
        assert decoder.waiting <= MOST_WAITING
        if rng.random() < 0.1:
            met += decoder.feed(last)
            assert met[-len(expected) :] == expected
        assert all(repr(reading) in sent for reading in met)
    return decoder.counts


@pytest.mark.parametrize("key", [None, KEY])
def test_a_damaged_frame_is_never_a_wrong_one(key):
    counts = damage(3, 4000, key)
    assert counts.damaged > 2000


def test_the_frame_after_damage_is_read():
    first, good = (RelposEncoder(1, 2).encode([HeartbeatReading(NOW)] * n) for n in (8, 1))
    expected = said([good])[0]
    for at in range(len(first)):
        assert said([first[:at], good])[0][-1:] == expected
    for garbage in (b"\xff", b"\1" * 515, b"\xff" * 516, b"\x02" * 9999):
        assert said([garbage, good])[0] == expected


def test_what_is_kept_is_bounded():
    decoder = RelposDecoder()
    for _ in range(50):
        assert decoder.feed(b"\x55" * 1000) == []
        assert decoder.waiting <= 515 <= MOST_WAITING
    assert decoder.counts == Counts(n_bytes=50_000, strange=50_000)
    (reading,) = decoder.feed(b"\0" + RelposEncoder(1, 2).encode([HeartbeatReading(NOW)]))
    assert reading.source == Source("1", 2, 0, 5, MICROSECONDS_32)
    assert decoder.waiting == 0


def test_random_bytes_are_no_frames():
    rng = random.Random(0)
    decoder = RelposDecoder()
    for _ in range(300):
        assert decoder.feed(rng.randbytes(rng.randrange(2000))) == []
    assert decoder.counts.frames == 0
    assert decoder.counts.damaged > 500


def test_a_quaternion_that_is_none_is_damage():
    met, counts = said([frame(STATE.type, 1, 2, 3, 4, bytes(21))])
    assert met == []
    assert (counts.frames, counts.damaged) == (0, 1)


def test_ranges_of_one_time_share_a_frame():
    later = Source(ticks=6)
    spoken = [RangeReading(NOW, str(k), 1.0) for k in range(40)] + [RangeReading(later, "1", 1.0)]
    encoder = RelposEncoder(9, 1)
    met, counts = said([encoder.encode(spoken)])
    assert [r.to for r in met] == [r.to for r in spoken]
    assert [r.source.sequence for r in met] == [0] * 32 + [1] * 8 + [2]
    assert counts.frames == 3


def test_many_readings_at_once():
    spoken = [HeartbeatReading(NOW)] * 1500 + [RangeReading(NOW, "1", 1.0)] * 5000
    met, _ = said([RelposEncoder(9, 1).encode(spoken)])
    assert len(met) == 6500


def test_no_readings_are_no_bytes():
    assert RelposEncoder(9, 1).encode([]) == b""


def test_time_wraps():
    met, _ = said([RelposEncoder(9, 1).encode([HeartbeatReading(Source(ticks=(1 << 32) + 3))])])
    assert met[0].source.ticks == 3


def test_no_pair_of_boot_and_sequence_comes_twice():
    encoder = RelposEncoder(9, 4)
    encoder.sequence = (1 << 32) - 1
    met, _ = said([encoder.encode([HeartbeatReading(NOW)] * 2)])
    assert [(r.source.boot, r.source.sequence) for r in met] == [(4, (1 << 32) - 1), (5, 0)]


@pytest.mark.parametrize(("reading", "match"), [
    (HeartbeatReading(Source()), "source.ticks"),
    (HeartbeatReading(Source(ticks=1, clock=RADIO_40)), "source.clock: expected microseconds"),
    (HeartbeatReading(NOW._replace(device="8")), "source.device: expected 9, got '8'"),
    (MotionReading(NOW, math.nan), "MotionReading: expected finite"),
    (MotionReading(NOW, 1.0, math.inf), "finite"),
    (ImuReading(NOW, (0.0, -math.inf, 0.0), (0.0, 0.0, 0.0)), "finite"),
    (StateReading(NOW, (1.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0)), "q_wb"),
    (StateReading(NOW, (math.nan, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0)), "q_wb"),
    (RangeReading(NOW, "A1", 1.0), "to: expected a node, 0 to 65535, got 'A1'"),
    (RangeReading(NOW, "65536", 1.0), "to: expected a node"),
    (RangeReading(NOW, "01", 1.0), "to: expected a node"),
    (RangeReading(NOW, "1", 1.0, nearer="-1"), "nearer: expected a node"),
    (StatusReading(NOW, 1.0, 1 << 32), "fault"),
    (OperatorReading(NOW, "", (0.0, 0.0)), "to: expected a node"),
    (DriveReading(NOW, "1", math.nan, 0.0, True), "finite"),
])  # fmt: skip
def test_what_cannot_be_said_is_refused(reading, match):
    encoder = RelposEncoder(9, 1)
    with pytest.raises(ValueError, match=match):
        encoder.encode([HeartbeatReading(NOW), reading])
    assert encoder.sequence == 0


@pytest.mark.parametrize(("node", "boot", "match"), [
    (-1, 0, "node"), (65536, 0, "node"), (0, -1, "boot"), (0, 1 << 32, "boot"),
])  # fmt: skip
def test_an_encoder_of_nobody_is_refused(node, boot, match):
    with pytest.raises(ValueError, match=match):
        RelposEncoder(node, boot)


def driver(key=None, **options):
    clock = iter(range(100, 10_000_000, 100))
    return RelposDriver(4, RelposOptions(**options), key, 6, lambda: next(clock))


@settings(max_examples=100)
@given(st.floats(), st.floats(), st.floats(0.01, 32.0), st.floats(0.01, 3.0))
def test_a_command_stays_within_limits(speed, steering, max_speed, max_steering):
    car = driver(max_speed=max_speed, max_steering=max_steering)
    ((command,), _) = said([car.drive(speed, steering)])
    assert abs(command.speed) <= max_speed
    assert abs(command.steering) <= max_steering
    assert command.brake == (not (math.isfinite(speed) and math.isfinite(steering)))
    if not command.brake:
        assert command.speed == pytest.approx(max(-max_speed, min(max_speed, speed)), abs=1e-3)
        assert command.steering == pytest.approx(
            max(-max_steering, min(max_steering, steering)), abs=1e-4
        )


def test_commands_are_numbered_and_sealed():
    car = driver(KEY)
    assert (car.boot, car.sequence) == (6, 0)
    data = car.opening() + car.drive(9.0, -9.0) + car.neutral() + car.ask()
    assert car.sequence == 2
    source = Source(str(HOST), 6, 0, 100, MICROSECONDS_32)
    then = source._replace(sequence=1, ticks=200)
    assert said([b"\x07rubbish", data], KEY)[0] == [
        DriveReading(source, "4", 2.0, -0.42, brake=False),
        DriveReading(then, "4", 0.0, 0.0, brake=True),
    ]
    assert said([data], KEY[::-1])[1].damaged == 2


def test_telemetry_of_a_car_is_sealed_too():
    car = driver(KEY)
    spoken = [MotionReading(NOW, 0.5, 0.1), StatusReading(NOW, 7.4), HeartbeatReading(NOW)]
    assert len(car.telemetry.feed(RelposEncoder(4, 1, KEY).encode(spoken))) == 3
    assert car.telemetry.feed(RelposEncoder(4, 1).encode(spoken)) == []


@pytest.mark.parametrize("options", [
    {"max_speed": 0.0}, {"max_speed": 33.0}, {"max_steering": math.nan}, {"max_steering": 4.0},
])  # fmt: skip
def test_limits_that_are_none_are_refused(options):
    with pytest.raises(BridgeError, match=next(iter(options))):
        RelposOptions(**options)


@pytest.mark.parametrize("node", [-1, HOST])
def test_a_car_is_a_node(node):
    with pytest.raises(ValueError, match="node: expected 0 to 65534"):
        RelposDriver(node, RelposOptions(), None, 1, lambda: 0)


def test_framing_is_that_of_the_package():
    for coded in spread(5, 50):
        assert b"\0" + cobs.encode(cobs.decode(coded[1:-1])) + b"\0" == coded
