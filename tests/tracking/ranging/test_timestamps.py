"""Arithmetic of stamps that wrap every 17.2 s."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracking.ranging.frames.timestamps import (
    GRID,
    MODULUS,
    SPEED_OF_LIGHT,
    TICK_HZ,
    difference,
    on_grid,
    seconds,
    ticks,
    unwrap,
)

HALF = MODULUS // 2
TIMES = st.integers(-(2**60), 2**60)
STEPS = st.integers(-HALF, HALF - 1)
STAMPS = st.integers(0, MODULUS - 1) | st.sampled_from([0, 1, HALF - 1, HALF, MODULUS - 1])
quick = settings(max_examples=100, derandomize=True)


def test_constants_as_in_the_data_sheet():
    assert seconds(MODULUS) == pytest.approx(17.2074, abs=1e-4)
    assert seconds(GRID) == pytest.approx(8.0128e-9, rel=1e-4)
    assert seconds(1) * SPEED_OF_LIGHT == pytest.approx(4.6917e-3, rel=1e-4)


@quick
@given(TIMES, STEPS)
def test_difference_of_wrapped_stamps_is_that_of_the_times(time, step):
    assert difference((time + step) % MODULUS, time % MODULUS) == step
    assert difference(time + step, time) == step


@quick
@given(STAMPS, STAMPS)
def test_difference_turned_round_changes_sign(a, b):
    d = difference(a, b)
    assert -HALF <= d < HALF
    assert (b + d - a) % MODULUS == 0
    assert difference(b, a) == (-d if d != -HALF else d)


@quick
@given(STAMPS, STAMPS, STAMPS)
def test_differences_add_up_to_whole_wraps(a, b, c):
    assert (difference(a, b) + difference(b, c) - difference(a, c)) % MODULUS == 0


@quick
@given(TIMES, STEPS)
def test_unwrap_finds_the_time_again(near, step):
    assert unwrap((near + step) % MODULUS, near) == near + step


@quick
@given(STAMPS, TIMES)
def test_unwrap_keeps_the_stamp_and_is_near(stamp, near):
    time = unwrap(stamp, near)
    assert time % MODULUS == stamp
    assert -HALF <= time - near < HALF
    assert unwrap(stamp, time) == time


@quick
@given(st.lists(st.integers(0, HALF - 1), min_size=1, max_size=40), TIMES)
def test_unwrapping_step_by_step_never_loses_a_wrap(steps, start):
    time, known = start, start
    for step in steps:
        time += step
        known = unwrap(time % MODULUS, known)
    assert known == time


@quick
@given(TIMES)
def test_grid_is_the_first_at_or_after(time):
    at = on_grid(time)
    assert at % GRID == 0
    assert 0 <= at - time < GRID
    assert on_grid(at) == at
    assert (at % MODULUS) % GRID == 0  # the grid is continuous at the wrap


@quick
@given(st.integers(-(2**45), 2**45))
def test_whole_ticks_survive_seconds(n):
    assert seconds(n) == pytest.approx(n / 63.8976e9, rel=1e-12)
    assert abs(ticks(seconds(n)) - n) <= 1


@quick
@given(st.floats(-100.0, 100.0, allow_subnormal=False))
def test_ticks_round_up(duration):
    n = ticks(duration)
    assert isinstance(n, int)
    assert -1e-3 <= n - duration * TICK_HZ < 1.0 + 1e-3
