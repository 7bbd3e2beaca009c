"""Preintegrated motion in messages: bytes, sums at the sender, accelerations at the receiver."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import cumulative_trapezoid
from scipy.spatial.transform import Rotation

from tracking.errors import WireError
from tracking.kernels.jit import kernel
from tracking.measurements import ACCEL_NOISE, N_VALUES, MeasurementBlock
from tracking.ranging.compiled.motion import (
    integrate_state,
    make_received,
    make_senders,
    noise_byte,
    noise_density,
    receive_motion,
    rotation_counts,
    rotation_of,
    to_counts,
)
from tracking.ranging.frames.airtime import PAPER_PHY, round_rate
from tracking.ranging.frames.motion import MOTION_BYTES, Motion, decode_motion, encode_motion
from tracking.ranging.frames.wire import Entry, Frame, Type, decode, encode
from tracking.records import as_records

HZ = 100.0
quick = settings(max_examples=60, derandomize=True)


def counts(bits):
    return st.integers(-(1 << (bits - 1)), (1 << (bits - 1)) - 1)


MOTIONS = st.builds(
    Motion,
    age=st.integers(0, 65535),
    velocity=st.tuples(*[counts(24)] * 3),
    position=st.tuples(*[counts(16)] * 3),
    rotation=st.tuples(st.integers(0, 3), *[st.integers(-11500, 11500)] * 3),
    noise=st.integers(0, 255),
    epoch=st.integers(0, 1),
)


@quick
@given(MOTIONS)
def test_motions_round_trip(motion):
    data = encode_motion(motion)
    assert len(data) == MOTION_BYTES <= 24
    assert decode_motion(data) == motion


@quick
@given(st.binary(min_size=24, max_size=24) | st.binary(max_size=30))
def test_any_bytes_decode_or_name_the_error(data):
    try:
        motion = decode_motion(data)
    except WireError:
        return
    assert encode_motion(motion) == data


@quick
@given(MOTIONS, st.integers(0, 12))
def test_frames_with_a_motion_round_trip(motion, n_rows):
    rows = tuple(Entry(k + 1, 512 * k, -78.0, -81.0) for k in range(n_rows))
    frame = Frame(Type.REPLY, 0, 0, 3, 1, n_rows + 1, 7, 512, rows, motion=encode_motion(motion))
    assert decode(encode(frame)) == frame


@quick
@given(st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).filter(lambda q: np.dot(q, q) > 0.01))
def test_orientations_are_kept_to_a_ten_thousandth(q):
    q = np.array(q) / np.linalg.norm(q)
    found = np.array(rotation_of(*rotation_counts(*q)))
    assert abs(abs(found @ q) - 1.0) < 1e-8


@quick
@given(st.floats(1e-4, 1e3))
def test_noise_is_rounded_up_by_a_tenth_at_most(density):
    assert density <= noise_density(noise_byte(density)) * (1.0 + 1e-12)
    assert noise_density(noise_byte(density)) <= 1.1 * density
    assert noise_density(noise_byte(0.0)) == 0.0


def drive(seed, seconds=8.0, bias=0.0):
    """Return times, accelerations and orientations of a node that moves and turns."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds * HZ)) / HZ
    phase, rate = rng.uniform(0, 6, 3), rng.uniform(1.0, 6.0, 3)
    a = rng.uniform(0.5, 4.0, 3) * np.sin(rate * t[:, None] + phase) + bias
    yaw = 1.5 * np.sin(0.7 * t + phase[0])
    q = Rotation.from_rotvec(np.outer(yaw, [0.0, 0.0, 1.0])).as_quat()[:, [3, 0, 1, 2]]
    return t, a, q


class Out(NamedTuple):
    t: np.ndarray
    kind: np.ndarray
    i: np.ndarray
    j: np.ndarray
    antenna_i: np.ndarray
    antenna_j: np.ndarray
    values: np.ndarray
    has_power: np.ndarray
    valid: np.ndarray
    used: np.ndarray


@kernel
def send_and_receive(senders, received, t, values, messages, out):
    """Integrate the states of node 1 and receive its messages at node 0."""
    k = 0
    for m in range(messages.shape[0]):
        while k < t.shape[0] and t[k] <= messages[m]:
            integrate_state(senders[0, 1], t[k], values, 0, k)
            k += 1
        receive_motion(senders[0, 1], received[0, 0, 1], messages[m], 1, out, 0)


def states_at_receiver(t, a, q, messages, noise=0.0):
    """Return times and values of the states that a receiver reconstructs."""
    block = MeasurementBlock.empty(1, 4 * len(messages))
    out = Out(*block.in_place, np.zeros(1, dtype=np.int64))
    values = np.zeros((1, len(t), N_VALUES))
    values[0, :, :4], values[0, :, 4:7], values[0, :, ACCEL_NOISE] = q, a, noise
    send_and_receive(
        as_records(make_senders(1, 2)), as_records(make_received(1, 2)), t, values, messages, out
    )
    n = int(out.used[0])
    return out.t[0, :n], out.values[0, :n]


@pytest.mark.parametrize("loss", [0.0, 0.2, 0.5, 0.8])
@pytest.mark.parametrize("bias", [0.0, 0.8])
def test_velocity_and_way_survive_lost_messages(loss, bias):
    """Twin: integration of the reconstructed accelerations against that of all samples."""
    t, a, q = drive(3, bias=bias)
    rng = np.random.default_rng(1)
    messages = np.arange(0.05, 7.9, 0.018)
    messages = messages[rng.random(len(messages)) >= loss]
    found_t, values = states_at_receiver(t, a, q, messages)
    grid = np.linspace(0.2, 7.6, 75)
    v = cumulative_trapezoid(a, t, axis=0, initial=0.0)
    p = cumulative_trapezoid(v, t, axis=0, initial=0.0)
    w = cumulative_trapezoid(values[:, 4:7], found_t, axis=0, initial=0.0)
    r = cumulative_trapezoid(w, found_t, axis=0, initial=0.0)

    def at(times, x):
        return np.stack([np.interp(grid, times, x[:, k]) for k in range(3)], axis=-1)

    # An arbitrary initial velocity and position, as a filter has to estimate them.
    off_v = at(t, v) - at(found_t, w)
    off_p = at(t, p) - at(found_t, r)
    fit = np.stack([np.ones(len(grid)), grid], axis=1)
    off_p -= fit @ np.linalg.lstsq(fit, off_p, rcond=None)[0]
    limits = {0.0: (0.03, 0.004), 0.2: (0.03, 0.004), 0.5: (0.12, 0.02), 0.8: (0.12, 0.04)}[loss]
    assert np.ptp(off_v, axis=0).max() < limits[0]
    assert np.abs(off_p).max() < limits[1]


def test_rest_looks_like_rest():
    t, a, q = drive(0)
    a[:], q[:] = 0.0, q[0]
    _, values = states_at_receiver(t, a, q, np.arange(0.05, 7.9, 0.036))
    assert np.abs(values[:, 4:7]).max() < 0.02


def test_noise_of_a_sample_reaches_the_receiver():
    t, a, q = drive(1)
    _, values = states_at_receiver(t, a, q, np.arange(0.05, 7.9, 0.02), noise=3.0)
    assert np.all(values[:, ACCEL_NOISE] >= 3.0)


def test_one_noisy_sample_is_forgotten_after_a_second():
    t, a, q = drive(1)
    noise = np.where(np.arange(len(t)) == 300, 3.0, 0.0)
    found_t, values = states_at_receiver(t, a, q, np.arange(0.05, 7.9, 0.02), noise=noise)
    noisy = values[:, ACCEL_NOISE] > 0.0
    assert noisy[(found_t > 3.02) & (found_t < 3.9)].all()
    assert not noisy[(found_t < 2.95) | (found_t > 4.1)].any()


def test_orientations_are_those_between_the_messages():
    t, a, q = drive(5)
    found_t, values = states_at_receiver(t, a, q, np.arange(0.05, 7.9, 0.02))
    true = Rotation.from_quat(q[:, [1, 2, 3, 0]]).as_euler("zyx")[:, 0]
    found = Rotation.from_quat(values[:, [1, 2, 3, 0]]).as_euler("zyx")[:, 0]
    assert np.abs(found - np.interp(found_t, t, true)).max() < 0.01


def test_sums_of_two_epochs_are_not_mixed():
    """A node that was off for a second begins new sums: no motion is made of both."""
    t, a, q = drive(2)
    off = (t > 3.0) & (t < 4.0)
    found_t, values = states_at_receiver(t[~off], a[~off], q[~off], np.arange(0.05, 7.9, 0.02))
    assert not np.any((found_t > 3.05) & (found_t < 3.99))
    assert np.abs(values[:, 4:7]).max() < 1.2 * np.abs(a).max()


@quick
@given(st.floats(-1e5, 1e5), st.sampled_from([16, 24]))
def test_counts_wrap(value, bits):
    unit = 1.0 / 4096.0
    found = to_counts.py_func(value, unit, bits)
    assert -(1 << (bits - 1)) <= found < 1 << (bits - 1)
    assert (found - round(value / unit)) % (1 << bits) in (0, 1, (1 << bits) - 1)


def test_motion_costs_airtime():
    """24 bytes at 110 kbit/s take 1.6 ms: 55 rounds a second of three nodes in place of 81."""
    with_motion = replace(PAPER_PHY, motion_bytes=MOTION_BYTES)
    rates = [round_rate(phy, n) for n in (3, 6) for phy in (PAPER_PHY, with_motion)]
    assert np.allclose(rates, [80.6, 54.6, 28.2, 22.3], atol=0.1), rates
