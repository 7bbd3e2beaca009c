"""Impossible values are refused, possible ones never, and a real jump is accepted soon."""

import math
import random
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardware_bridge.plausibility import Plausibility, PlausibilityParams
from hardware_bridge.readings import ImuReading, Source, StateReading

S = 1_000_000_000
REST = (0.0, 0.0, 9.8)
LEVEL = (1.0, 0.0, 0.0, 0.0)
LINE = re.compile(r"from: [0-9A-F]{4}\t Range: (-?\d+\.\d+) m\t RX power: -?\d+\.\d+ dBm\r\n")
JSON = re.compile(r'"raz": \[(-?\d+\.\d+)\]')


def true_distance(t):
    """Return the distance of two cars that pass each other at up to 6 m/s."""
    return 5.0 + 4.0 * math.sin(1.4 * t)


def dw1000(distance):
    return f"from: A1B2\t Range: {distance:.2f} m\t RX power: -45.00 dBm\r\n"


def uwb_core(distance):
    return (
        f'{{"utime": 3505358,"c": 278,"uid": 39068,"ouid": 4660,"raz": [{distance:.6f}],'
        '"rssi": [-88.538536],"los": [0.000000]}\n'
    )


def one_bit(line, rng):
    k = rng.randrange(len(line))
    line[k] ^= 1 << rng.randrange(8)


def byte_lost(line, rng):
    del line[rng.randrange(len(line))]


def burst(line, rng):
    k, n = rng.randrange(len(line)), rng.randint(2, 8)
    line[k : k + n] = rng.randbytes(n)


def splice(line, rng):
    """Replace the rest of the line by that of a later one, of another pair."""
    k = rng.randrange(len(line))
    other = line.replace(b"A1B2", b"C3D4")
    line[k:] = other[rng.randrange(len(line)) :]


@pytest.mark.parametrize("damage", [one_bit, byte_lost, burst, splice])
@pytest.mark.parametrize(("write", "pattern"), [(dw1000, LINE), (uwb_core, JSON)])
def test_what_damage_lets_through_is_near_the_truth(write, pattern, damage):
    """At 50 Hz with one line in three damaged: outliers never pass, correct lines always do."""
    rng = random.Random(0)
    gate = Plausibility()
    worst, worst_passed = 0.0, 0.0
    for k in range(20_000):
        t = 0.02 * k
        line = bytearray(write(true_distance(t)).encode())
        if k and rng.random() < 0.3:
            damage(line, rng)
        said = pattern.search(line.decode("latin-1"))
        if said is None:
            continue
        distance = float(said[1])
        error = abs(distance - true_distance(t))
        worst = max(worst, error)
        if gate.allows_range(1, 2, distance, round(t * S)):
            worst_passed = max(worst_passed, error)
        else:
            assert error > 0.5
    # The allowed jump, and the distance at 6 m/s while a few lines in a row were damaged.
    assert worst_passed < 1.5
    if damage is one_bit:
        assert worst > 3.0
        assert gate.refused["jump"] >= 10


@settings(max_examples=100)
@given(
    st.lists(st.tuples(st.floats(0.0, 20.0), st.floats(-1.0, 1.0), st.floats(-0.5, 0.5))),
    st.floats(2.0, 290.0),
)
def test_what_can_be_is_never_refused(steps, distance):
    gate = Plausibility()
    t = 0.0
    for gap, speed, noise in steps:
        t += gap
        distance = min(290.0, max(1.0, distance + 5.99 * speed * gap))
        assert gate.allows_range(1, 2, distance + noise, round(t * S))
    assert not gate.refused


def test_a_real_jump_is_believed_after_three():
    gate = Plausibility()
    answers = [gate.allows_range(1, 2, 2.0 if k < 5 else 30.0, k * S // 50) for k in range(12)]
    assert answers == [True] * 5 + [False] * 2 + [True] * 5
    assert gate.refused == {"jump": 2}


def test_wrong_ranges_that_do_not_agree_are_never_believed():
    gate = Plausibility()
    gate.allows_range(1, 2, 2.0, 0)
    for k in range(1, 50):
        assert not gate.allows_range(1, 2, 20.0 + 40.0 * (k % 3), k * S // 50)
    assert gate.allows_range(2, 1, 2.3, S)


def test_a_good_range_between_begins_the_count_anew():
    gate = Plausibility()
    for k in range(60):
        wrong = k % 3 != 0
        assert gate.allows_range(1, 2, 30.0 if wrong else 2.0, k * S // 50) is not wrong


def test_after_a_silence_a_node_may_be_anywhere():
    gate = Plausibility()
    assert gate.allows_range(1, 2, 2.0, 0)
    assert gate.allows_range(1, 2, 60.0, 10 * S)


def test_pairs_are_independent():
    gate = Plausibility()
    for j in range(2, 9):
        assert gate.allows_range(1, j, 10.0 * j, 0)


@pytest.mark.parametrize(
    ("distance", "reason"),
    [
        (math.nan, "not a number"),
        (-math.inf, "not a number"),
        (0.0, "too near"),
        (-0.5, "too near"),
        (301.0, "too far"),
        (1e300, "too far"),
    ],
)
def test_what_is_no_range_is_refused_at_once(distance, reason):
    gate = Plausibility()
    for _ in range(9):
        assert not gate.allows_range(1, 2, distance, 0)
    assert gate.refused == {reason: 9}


@pytest.mark.parametrize(
    ("gyr", "acc", "mag", "reason"),
    [
        ((0.0, 36.0, 0.0), REST, None, "rate"),
        ((0.0, 0.0, 0.0), (0.0, 0.0, -160.0), None, "acceleration"),
        ((0.0, 0.0, 0.0), REST, (0.0, 5100.0, 0.0), "field"),
        ((0.0, math.nan, 0.0), REST, None, "not a number"),
        ((0.0, 0.0, 0.0), (math.inf, 0.0, 9.8), None, "not a number"),
    ],
)
def test_samples_beyond_the_scale_are_refused(gyr, acc, mag, reason):
    gate = Plausibility()
    assert not gate.allows_imu(ImuReading(Source(), gyr, acc, mag))
    assert gate.refused == {reason: 1}


def test_samples_within_the_scale_are_taken():
    gate = Plausibility()
    full = math.radians(2000.0)
    assert gate.allows_imu(ImuReading(Source(), (full, -full, 0.0), (156.9, 0.0, -156.9)))
    assert gate.allows_imu(ImuReading(Source(), (0.0, 0.0, 0.0), REST, (4900.0, 0.0, 0.0)))
    assert gate.allows_state(StateReading(Source(), LEVEL, (166.0, 0.0, 0.0)))
    assert not gate.refused


@pytest.mark.parametrize(
    ("q", "accel", "reason"),
    [
        ((0.5, 0.0, 0.0, 0.0), REST, "attitude"),
        ((math.nan, 0.0, 0.0, 0.0), REST, "not a number"),
        (LEVEL, (0.0, 200.0, 0.0), "acceleration"),
    ],
)
def test_states_that_cannot_be_are_refused(q, accel, reason):
    gate = Plausibility()
    assert not gate.allows_state(StateReading(Source(), q, accel))
    assert gate.refused == {reason: 1}


def test_parameters_are_checked():
    with pytest.raises(ValueError, match="jump"):
        PlausibilityParams(jump=0.0)
