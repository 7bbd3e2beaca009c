"""Compiled queue of the horizon against sorted lists, and properties of a batch."""

from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracking.errors import ConfigError
from tracking.late_data.horizon import Horizon, HorizonParams
from tracking.late_data.queue import hand_on, take_in
from tracking.measurements import N_MEASURED, MeasurementBlock

NAMES = tuple(f.name for f in fields(MeasurementBlock))
DELAY = 0.5


def random_block(rng, n_envs, n_events, now):
    """Return events about `now`, many at the same time, some late, some doubled, some padding."""
    block = MeasurementBlock.empty(n_envs, n_events)
    shape = block.t.shape
    block.t[:] = np.round(now + rng.uniform(-0.7, 0.2, shape), 1)
    for name in ("kind", "i", "j", "antenna_i", "antenna_j"):
        getattr(block, name)[:] = rng.integers(0, 2, shape)
    block.values[..., 0] = rng.integers(0, 2, shape)
    block.has_power[:] = rng.random(shape) < 0.5
    block.valid[:] = rng.random(shape) < 0.8
    return block


class Twin:
    """Reference implementation of one environment with a plain list."""

    def __init__(self):
        self.held, self.released, self.n_late, self.n_doubled = [], -np.inf, 0, 0

    def step(self, block, e, now):
        for k in np.nonzero(block.valid[e])[0]:
            event = tuple(np.array(getattr(block, name)[e, k]) for name in NAMES)
            if event[0] <= self.released:
                self.n_late += 1
            elif any(self.what(event) == self.what(other) for other in self.held):
                self.n_doubled += 1
            else:
                self.held.append(event)
        self.held.sort(key=self.what)
        until = now - DELAY
        due = [event for event in self.held if event[0] <= until]
        self.held = self.held[len(due) :]
        self.released = max(self.released, until)
        return due

    @staticmethod
    def what(event):
        return *(float(x) for x in event[:6]), tuple(event[6])


def assert_events(block, e, expected):
    alone = block.env(e)
    assert alone.n_events == len(expected)
    assert block.valid[e, : len(expected)].all()
    for f, name in enumerate(NAMES):
        if expected:
            column = np.stack([event[f] for event in expected])
            np.testing.assert_array_equal(getattr(alone, name)[0], column, err_msg=name)


@settings(max_examples=40)
@given(seed=st.integers(0, 2**31), n_envs=st.integers(1, 3), largest=st.sampled_from([3, 40, 150]))
def test_it_is_a_sorted_list(seed, n_envs, largest):
    """Compare output, queue and counters while slots are freed and the queue grows."""
    rng = np.random.default_rng(seed)
    horizon, twins = Horizon(HorizonParams(delay=DELAY), n_envs), [Twin() for _ in range(n_envs)]
    for now in np.cumsum(rng.uniform(0.0, 0.4, 12)):
        block = random_block(rng, n_envs, int(rng.integers(0, largest)), now)
        out = horizon.step(block, now)
        waiting = horizon.waiting
        for e, twin in enumerate(twins):
            assert_events(out, e, twin.step(block, e, now))
            assert_events(waiting, e, twin.held)
            counted = horizon.n_late[e], horizon.n_doubled[e], horizon.t[e]
            assert counted == (twin.n_late, twin.n_doubled, twin.released)


def test_a_long_block_is_as_good_as_its_pieces():
    rng = np.random.default_rng(4)
    block = MeasurementBlock.concatenate([random_block(rng, 1, 1000, 0.1 * k) for k in range(9)])
    whole, parts = Horizon(HorizonParams()), Horizon(HorizonParams())
    out = [parts.step(block.take(slice(k, k + 1000)), -1.0) for k in range(0, 9000, 1000)]
    assert sum(b.n_events for b in out) == 0
    assert whole.step(block, -1.0).n_events == 0
    a, b = whole.flush(), parts.flush()
    for name in NAMES:
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


@settings(max_examples=40)
@given(seed=st.integers(0, 2**31))
def test_no_order_of_arrival_shows(seed):
    """Compare one block, permuted events, and a sorted block."""
    rng = np.random.default_rng(seed)
    block = random_block(rng, 1, 40, 1.0)
    shuffled = block.take(rng.permutation(40))
    a, b = Horizon(HorizonParams()), Horizon(HorizonParams())
    a.step(block, 0.2)
    for k in range(40):
        b.step(shuffled.take(slice(k, k + 1)), 0.2)
    one, other = a.flush(), b.flush()
    power = [k for k, name in enumerate(NAMES) if name == "has_power"]
    for name in (n for k, n in enumerate(NAMES) if k not in power):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
        x, y = getattr(block.sorted(), name), getattr(shuffled.sorted(), name)
        valid = block.sorted().valid
        np.testing.assert_array_equal(x[valid], y[valid], err_msg=name)


def test_what_is_bound_or_a_part_says_so_when_room_was_made():
    horizon = Horizon(HorizonParams(delay=DELAY), 2)
    block, due = MeasurementBlock.empty(2, 4), MeasurementBlock.empty(2, 200)
    step, part = horizon.bind(block, np.zeros(2), due), horizon.part(slice(0, 1))
    inner = horizon.part(slice(0, 2)).part(slice(1, 2))
    step()
    part.step(MeasurementBlock.empty(), 0.0)
    horizon.reserve(500)
    uses = (
        step,
        part.flush,
        lambda: part.step(MeasurementBlock.empty(), 0.0),
        lambda: inner.step(MeasurementBlock.empty(), 0.0),
        lambda: inner.reset(0),
        lambda: inner.waiting,
        lambda: part.t,
    )
    for use in uses:
        with pytest.raises(ConfigError, match="room was made"):
            use()


def test_a_stream_may_go_on_after_a_flush():
    horizon = Horizon(HorizonParams(delay=DELAY))
    block = random_block(np.random.default_rng(0), 1, 30, 1.0)
    horizon.step(block, 0.0)
    last = horizon.flush().t[0].max()
    assert horizon.t[0] == last
    later = block.take(slice(0, 1))
    later.t[:], later.valid[:] = last + 0.1, True
    horizon.step(later, 0.0)
    assert horizon.flush().count(int(later.kind[0, 0])) == 1
    assert horizon.n_late[0] == 0


def test_a_slice_of_environments_is_those_alone():
    rng = np.random.default_rng(2)
    block = random_block(rng, 4, 60, 1.0)
    whole, parts = (Horizon(HorizonParams(delay=DELAY), 4) for _ in range(2))
    expected = whole.step(block, 1.0)
    parts.reserve(60)
    arrays = [getattr(block, name) for name in NAMES]
    out = MeasurementBlock.empty(4, 60)
    for envs in (slice(0, 1), slice(1, 4)):
        state = parts.state.of(envs)
        take_in(state, tuple(a[envs] for a in arrays))
        until = np.full(envs.stop - envs.start, 1.0 - DELAY)
        hand_on(state, until, True, tuple(getattr(out, name)[envs] for name in NAMES))
    for e in range(4):
        for name in NAMES:
            found = getattr(out.env(e), name)
            np.testing.assert_array_equal(found, getattr(expected.env(e), name))


def test_a_block_to_write_into_may_be_longer_but_not_shorter():
    rng = np.random.default_rng(6)
    block = random_block(rng, 2, 50, 0.0)
    expected = Horizon(HorizonParams(), 2).step(block, 1.0)
    room = MeasurementBlock.empty(2, 64)
    room.valid[:] = True
    out = Horizon(HorizonParams(), 2).step(block, 1.0, room)
    assert out is room
    for e in range(2):
        np.testing.assert_array_equal(out.env(e).values, expected.env(e).values)
    with pytest.raises(ConfigError, match="out: expected at least"):
        Horizon(HorizonParams(), 2).step(block, 1.0, MeasurementBlock.empty(2, 3))


def test_a_reset_environment_forgets_and_the_others_do_not():
    rng = np.random.default_rng(8)
    horizon = Horizon(HorizonParams(delay=DELAY), 2)
    horizon.step(random_block(rng, 2, 40, 1.0), 1.0)
    n_late, left = horizon.n_late.copy(), horizon.waiting.env(0).n_events
    horizon.reset(1)
    assert horizon.n_late.tolist() == [n_late[0], 0]
    assert horizon.t.tolist() == [0.5, -np.inf]
    assert [horizon.waiting.env(e).n_events for e in (0, 1)] == [left, 0]


def test_what_devices_send_is_handed_on_and_the_rest_is_nothing():
    """The output arrays hold older states with more values."""
    horizon = Horizon(HorizonParams())
    block, out = MeasurementBlock.empty(1, 3), MeasurementBlock.empty(1, 3)
    block.t[:], block.valid[:] = [[0.1, 0.2, 0.3]], True
    block.values[:] = np.random.default_rng(0).uniform(1.0, 2.0, block.values.shape)
    out.values[:] = 7.0
    horizon.bind(block, np.array([9.0]), out)()
    assert out.valid.all()
    np.testing.assert_array_equal(out.values[..., :N_MEASURED], block.values[..., :N_MEASURED])
    np.testing.assert_array_equal(out.values[..., N_MEASURED:], 0.0)
