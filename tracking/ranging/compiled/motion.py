"""Motion between nodes: sums at the sender, accelerations at the receiver.

The sender integrates its STATE events; its ranging messages carry the sums (`frames.motion`). The
receiver takes the difference of two messages of a node, however many were lost between them, and
gives its filter STATE events in the past: the mean accelerations of the first and of the second
half of the time, at the middle of each, that have both differences,

    v_1 - v_0 = (a_1 + a_2) T / 2,    p_1 - p_0 - v_0 T = (3 a_1 + a_2) T^2 / 8

The reordering buffer upstream of the tracker puts them in order with the ranges of that time. Over
an interval of up to `SHORT` one mean acceleration is as good: rounding of p counts more.
"""

from __future__ import annotations

import math

import numpy as np

from tracking.kernels.jit import small_kernel
from tracking.measurements import ACCEL_NOISE
from tracking.ranging.frames.motion import (
    NOISE_ONE,
    NOISE_STEPS,
    POSITION_BITS,
    POSITION_UNIT,
    ROTATION_UNIT,
    VELOCITY_BITS,
    VELOCITY_UNIT,
)
from tracking.records import Records

SHORT = 0.06
"""[s] Interval up to which one mean acceleration is used."""
LONGEST = 1.0
"""[s] Interval above which the motion between two messages is not used."""
FASTEST = 2000.0
"""[m/s] Sum above which the sums start again: p can be unwrapped only while v does not wrap."""
GAP = 0.3
"""[s] Time without a state after which the sums of the sender start again: a new epoch."""
STATE = 3
"""Plain number of `Kind.STATE`: kernels do not know enums."""

SENDER = np.dtype(
    [("running", "?"), ("epoch", "i8"), ("t", "f8"), ("t_before", "f8")]
    + [(f"{name}{k}", "f8") for name in ("v", "p", "a", "vb", "pb") for k in range(3)]
    + [(f"{name}{k}", "f8") for name in ("q", "qb") for k in range(4)]
    + [("noise", "f8"), ("t_noise", "f8")]
)
"""Sums of a node: number of the epoch; time of the last STATE and of the one before [s]; sums v,
p [m/s, m] and acceleration a [m/s2] at the last one; sums vb, pb at the one before; orientations;
largest added noise density of the last second [m/s2/sqrt(Hz)], and its time [s]."""

RECEIVED = np.dtype(
    [("known", "?"), ("epoch", "i8"), ("t", "f8")]
    + [(f"{name}{k}", "i8") for name in ("v", "p") for k in range(3)]
    + [(f"q{k}", "i8") for k in range(4)]
)
"""Last message of one node at another one: epoch, time of the sums [s], and the sums in counts."""


@small_kernel
def to_counts(value, unit, bits):
    """Return a number as counts of a unit, modulo 2^bits, signed."""
    half = 1 << (bits - 1)
    return ((int(math.floor(value / unit + 0.5)) + half) & ((1 << bits) - 1)) - half


@small_kernel
def difference(later, earlier, bits):
    """Return the difference of two counts modulo 2^bits, signed."""
    half = 1 << (bits - 1)
    return ((later - earlier + half) & ((1 << bits) - 1)) - half


@small_kernel
def noise_byte(density):
    """Return the byte of an added noise density [m/s2/sqrt(Hz)], rounded up."""
    if not density > 0.0:
        return 0
    steps = math.ceil(NOISE_STEPS * math.log2(min(density, 1e4)))
    return min(max(NOISE_ONE + int(steps), 1), 255)


@small_kernel
def noise_density(byte):
    """Return the noise density of a byte [m/s2/sqrt(Hz)]."""
    return 0.0 if byte == 0 else 2.0 ** ((byte - NOISE_ONE) / NOISE_STEPS)


@small_kernel
def rotation_counts(w, x, y, z):
    """Return the index of the largest component of a quaternion, and counts of the others.

    The largest is positive: the sign of a quaternion has no meaning.
    """
    q, largest = (w, x, y, z), 0
    for k in range(1, 4):
        if abs(q[k]) > abs(q[largest]):
            largest = k
    scale = (1.0 if q[largest] >= 0.0 else -1.0) / ROTATION_UNIT
    first, second, third = (largest == 0), 1 + (largest <= 1), 2 + (largest <= 2)
    return (
        largest,
        round_count(scale * q[int(first)]),
        round_count(scale * q[second]),
        round_count(scale * q[third]),
    )


@small_kernel
def round_count(x):
    """Return a number as a count of 15 bits."""
    return min(max(int(math.floor(x + 0.5)), -16384), 16383)


@small_kernel
def rotation_of(largest, i, j, k):
    """Return the unit quaternion w x y z of an index and three counts."""
    x, y, z = i * ROTATION_UNIT, j * ROTATION_UNIT, k * ROTATION_UNIT
    big = math.sqrt(max(1.0 - x * x - y * y - z * z, 0.0))
    norm = math.sqrt(big * big + x * x + y * y + z * z)
    big, x, y, z = big / norm, x / norm, y / norm, z / norm
    if largest == 0:
        return big, x, y, z
    if largest == 1:
        return x, big, y, z
    if largest == 2:
        return x, y, big, z
    return x, y, z, big


@small_kernel
def integrate_state(s, t, values, e, k):
    """Add a STATE event in column k to the sums of its node."""
    dt = t - s.t
    if s.running and (dt > GAP or max(abs(s.v0), abs(s.v1), abs(s.v2)) > FASTEST):
        s.running = False
    if not s.running:
        s.running, s.epoch, s.noise, s.t_noise = True, s.epoch + 1, 0.0, t
        s.v0 = s.v1 = s.v2 = s.p0 = s.p1 = s.p2 = dt = 0.0
        s.q0, s.q1, s.q2, s.q3 = (
            values[e, k, 0], values[e, k, 1], values[e, k, 2], values[e, k, 3],
        )  # fmt: skip
        s.t = t
    s.t_before = s.t
    s.vb0, s.vb1, s.vb2, s.pb0, s.pb1, s.pb2 = s.v0, s.v1, s.v2, s.p0, s.p1, s.p2
    s.qb0, s.qb1, s.qb2, s.qb3 = s.q0, s.q1, s.q2, s.q3
    a0, a1, a2 = values[e, k, 4], values[e, k, 5], values[e, k, 6]
    if dt > 0.0:  # the trapezoidal rule, as in the filters
        m0, m1, m2 = 0.5 * dt * (s.a0 + a0), 0.5 * dt * (s.a1 + a1), 0.5 * dt * (s.a2 + a2)
        s.p0 += dt * (s.v0 + 0.5 * m0)
        s.p1 += dt * (s.v1 + 0.5 * m1)
        s.p2 += dt * (s.v2 + 0.5 * m2)
        s.v0, s.v1, s.v2 = s.v0 + m0, s.v1 + m1, s.v2 + m2
    s.t = t
    s.q0, s.q1, s.q2, s.q3 = values[e, k, 0], values[e, k, 1], values[e, k, 2], values[e, k, 3]
    s.a0, s.a1, s.a2 = a0, a1, a2
    noise = values[e, k, ACCEL_NOISE]
    if noise >= s.noise or t - s.t_noise > LONGEST:
        s.noise, s.t_noise = noise, t


@small_kernel
def receive_motion(s, r, sent, node, out, e):
    """Process a message of a sender: append the STATE events of the time before to `out`.

    Args:
        s: SENDER of the node; its sums are those at the last state before the message, or one
            state later. A message that is longer than this passes without a motion.
        r: RECEIVED of the node at the receiver, updated.
        sent: Time of the message [s].
        node: Index of the node.
        out: Events with the fields of `MeasurementBlock`, and `used`; appended.
        e: Row of the receiver.
    """
    late = s.t > sent
    t = s.t_before if late else s.t
    if not s.running or t > sent:
        return
    vx, vy, vz = (s.vb0, s.vb1, s.vb2) if late else (s.v0, s.v1, s.v2)
    px, py, pz = (s.pb0, s.pb1, s.pb2) if late else (s.p0, s.p1, s.p2)
    qw, qx, qy, qz = (s.qb0, s.qb1, s.qb2, s.qb3) if late else (s.q0, s.q1, s.q2, s.q3)
    v0, v1, v2 = (
        to_counts(vx, VELOCITY_UNIT, VELOCITY_BITS),
        to_counts(vy, VELOCITY_UNIT, VELOCITY_BITS),
        to_counts(vz, VELOCITY_UNIT, VELOCITY_BITS),
    )
    p0, p1, p2 = (
        to_counts(px, POSITION_UNIT, POSITION_BITS),
        to_counts(py, POSITION_UNIT, POSITION_BITS),
        to_counts(pz, POSITION_UNIT, POSITION_BITS),
    )
    q0, q1, q2, q3 = rotation_counts(qw, qx, qy, qz)
    noise = noise_density(noise_byte(s.noise))
    if r.known and (r.epoch ^ s.epoch) & 1 == 0 and 0.0 < t - r.t <= LONGEST:
        dt = t - r.t
        ax, bx = mean_accelerations(r.v0, r.p0, v0, p0, dt)
        ay, by = mean_accelerations(r.v1, r.p1, v1, p1, dt)
        az, bz = mean_accelerations(r.v2, r.p2, v2, p2, dt)
        first, last = rotation_of(r.q0, r.q1, r.q2, r.q3), rotation_of(q0, q1, q2, q3)
        middle = half_way(first, last)
        if dt <= SHORT:
            mean = (0.5 * (ax + bx), 0.5 * (ay + by), 0.5 * (az + bz))
            append_state(out, e, r.t + 0.5 * dt, node, middle, mean, noise)
        else:
            early, late_one = half_way(first, middle), half_way(middle, last)
            append_state(out, e, r.t + 0.25 * dt, node, early, (ax, ay, az), noise)
            append_state(out, e, r.t + 0.75 * dt, node, late_one, (bx, by, bz), noise)
    if not r.known or t > r.t:
        r.known, r.epoch, r.t = True, s.epoch, t
        r.v0, r.v1, r.v2, r.p0, r.p1, r.p2 = v0, v1, v2, p0, p1, p2
        r.q0, r.q1, r.q2, r.q3 = q0, q1, q2, q3


@small_kernel
def mean_accelerations(v_before, p_before, v_after, p_after, dt):
    """Return the mean accelerations of both halves of an interval along one axis [m/s2].

    Args:
        v_before: Sum of accelerations at its start [counts].
        p_before: Sum of velocities at its start [counts].
        v_after: Sum of accelerations at its end [counts].
        p_after: Sum of velocities at its end [counts].
        dt: Length of the interval [s].
    """
    dv = VELOCITY_UNIT * difference(v_after, v_before, VELOCITY_BITS)
    # The way at the first sum is known: it is taken off before the rest is unwrapped.
    way = int(math.floor(v_before * VELOCITY_UNIT * dt / POSITION_UNIT + 0.5))
    dp = POSITION_UNIT * difference(p_after, p_before + way, POSITION_BITS)
    first = (4.0 * dp / dt - dv) / dt
    return first, 2.0 * dv / dt - first


@small_kernel
def half_way(a, b):
    """Return the unit quaternion between two."""
    sign = 1.0 if a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] >= 0.0 else -1.0
    w, x, y, z = a[0] + sign * b[0], a[1] + sign * b[1], a[2] + sign * b[2], a[3] + sign * b[3]
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    return w / norm, x / norm, y / norm, z / norm


@small_kernel
def append_state(out, e, t, node, rotation, accel, noise):
    """Append a STATE event without feedback of an attitude filter."""
    k = out.used[e]
    if k >= out.t.shape[1]:
        return
    out.t[e, k], out.kind[e, k] = t, STATE
    out.i[e, k], out.j[e, k] = node, node
    out.antenna_i[e, k], out.antenna_j[e, k] = 0, 0
    values = out.values
    for column in range(values.shape[2]):
        values[e, k, column] = 0.0
    values[e, k, 0], values[e, k, 1] = rotation[0], rotation[1]
    values[e, k, 2], values[e, k, 3] = rotation[2], rotation[3]
    values[e, k, 4], values[e, k, 5], values[e, k, 6] = accel
    values[e, k, ACCEL_NOISE] = noise
    out.has_power[e, k], out.valid[e, k] = False, True
    out.used[e] = k + 1


def make_senders(n_envs: int, n_nodes: int) -> Records:
    """Return SENDER, (env, node), without a state."""
    return np.zeros((n_envs, n_nodes), dtype=SENDER)


def make_received(n_envs: int, n_nodes: int) -> Records:
    """Return RECEIVED, (env, receiver, node), without a message."""
    return np.zeros((n_envs, n_nodes, n_nodes), dtype=RECEIVED)
