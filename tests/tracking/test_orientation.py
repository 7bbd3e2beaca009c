"""Orientation stage: independence of blocks, and gravity-free acceleration."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from vqf import VQF

from tracking.ahrs.orientation import Orientation
from tracking.ahrs.params import OrientationParams, RestParams
from tracking.constellation import Constellation, NodeConfig
from tracking.geometry import GRAVITY, rotate, yaw_of
from tracking.measurements import Kind, MeasurementBlock
from tracking.sanity import imu
from tracking.sanity.params import SanityParams


def constellation(heading="magnetic", vehicle="hand"):
    nodes = tuple(NodeConfig(id=k, vehicle=vehicle, initial_heading=0.7) for k in (1, 2))
    return Constellation(nodes=nodes, heading=heading)


def recording(n=400, mag=True, seed=0):
    rng = np.random.default_rng(seed)
    t = np.arange(1, n + 1) / 100.0
    imu = 0.3 * rng.standard_normal((n, 6)) + [0, 0, 0.2, 0, 0, GRAVITY]
    field = 0.5 * rng.standard_normal((n, 3)) + [20.0, 5.0, -40.0]
    node = np.zeros(n, dtype=np.int64)
    parts = [MeasurementBlock.of_kind(Kind.IMU, t, node, imu)]
    if mag:
        parts.append(MeasurementBlock.of_kind(Kind.MAG, t, node, field))
    return MeasurementBlock.concatenate(parts).sorted(), imu, field


SANITY = SanityParams().as_record()[0]


def new_health():
    return np.zeros((1, 1, imu.N_HEALTH))


def inspect(health, samples, dt=0.01):
    judged, usable = samples.copy(), np.zeros(len(samples), dtype=bool)
    for k in range(len(samples)):
        usable[k] = imu.inspect_sample(SANITY, health, 0, 0, samples[None], 0, k, dt)
        judged[k] = health[0, 0, imu.GOOD : imu.GOOD + 6]
    return judged, usable


def new_limits():
    return np.zeros((1, 1, imu.N_LIMIT))


def at_limit(limits, accel_b):
    found = np.array([imu.find_limits(SANITY, limits, 0, 0, *row) for row in accel_b])
    return found[:, :3], found[:, 3]


def states(block):
    keep = block.valid[0] & (block.kind[0] == Kind.STATE)
    return block.values[0, keep]


@pytest.mark.parametrize("mag", [True, False])
def test_it_is_vqf(mag):
    block, imu, field = recording(mag=mag)
    c = constellation("magnetic" if mag else "initial")
    out = states(Orientation(c, OrientationParams()).step(block))
    args = [np.ascontiguousarray(imu[:, :3]), np.ascontiguousarray(imu[:, 3:])]
    twin = VQF(0.01, restThGyr=np.degrees(RestParams().rate))
    expected = twin.updateBatch(*args, *([field] if mag else []))
    if mag:
        np.testing.assert_allclose(out[:, :4], expected["quat9D"], atol=1e-12)
    else:
        assert yaw_of(out[0, :4]) == pytest.approx(0.7)
    lifted = rotate(out[:, :4], imu[:, 3:])
    np.testing.assert_allclose(out[:, 4:6], lifted[:, :2], atol=1e-12)


@pytest.mark.parametrize("mag", [True, False])
def test_blocks_change_nothing(mag):
    block, _, _ = recording(mag=mag)
    c = constellation("magnetic" if mag else "initial")
    whole = states(Orientation(c, OrientationParams()).step(block))
    cut = Orientation(c, OrientationParams())
    edges = [0, 1, 2, 7, 100, 101, 350, block.n_events]
    parts = [cut.step(block.take(slice(a, b))) for a, b in zip(edges, edges[1:], strict=False)]
    np.testing.assert_array_equal(np.concatenate([states(p) for p in parts]), whole)


def test_restored_is_uninterrupted():
    block, _, _ = recording()
    a = Orientation(constellation(), OrientationParams())
    a.step(block.take(slice(0, 333)))
    b = Orientation(constellation(), OrientationParams())
    b.restore(a.save())
    rest = block.take(slice(333, None))
    np.testing.assert_array_equal(states(b.step(rest)), states(a.step(rest)))


def test_no_heading_no_state():
    block, _, _ = recording(mag=False)
    assert len(states(Orientation(constellation("magnetic"), OrientationParams()).step(block))) == 0


def test_a_node_at_rest_does_not_accelerate_whatever_its_accelerometer_reads():
    n = 600
    t = np.arange(1, n + 1) / 100.0
    imu = np.tile([0.0, 0.0, 0.0, 0.3, -0.2, 10.02], (n, 1))
    imu += 1e-4 * np.random.default_rng(0).standard_normal(imu.shape)
    block = MeasurementBlock.of_kind(Kind.IMU, t, np.zeros(n, dtype=np.int64), imu)
    out = states(Orientation(constellation("initial"), OrientationParams()).step(block))
    np.testing.assert_allclose(out[-1, 4:8], 0.0, atol=0.01)


def test_a_sensor_that_sticks_gives_no_states():
    """It does not rotate the node, and is used again as soon as it moves."""
    n = 400
    t = np.arange(1, n + 1) / 100.0
    imu = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY], (n, 1))
    imu += 1e-3 * np.random.default_rng(0).standard_normal(imu.shape)
    imu[100:300] = [0.0, 0.0, 3.0, 0.0, 0.0, GRAVITY]
    block = MeasurementBlock.of_kind(Kind.IMU, t, np.zeros(n, dtype=np.int64), imu)
    orientation = Orientation(constellation("initial"), OrientationParams())
    out = orientation.step(block)
    assert out.valid[0, :100].all()
    assert out.valid[0, 300:].all()
    assert not out.valid[0, 120:300].any()


@settings(max_examples=40)
@given(seed=st.integers(0, 2**31), cuts=st.lists(st.integers(1, 399), max_size=6))
def test_any_cut_into_blocks_judges_samples_the_same(seed, cuts):
    rng = np.random.default_rng(seed)
    samples = rng.standard_normal((400, 6))
    samples[rng.random(400) < 0.05] *= 100.0
    for a in rng.integers(0, 380, 3):
        samples[a : a + rng.integers(5, 60)] = samples[a]
    whole = inspect(new_health(), samples)
    health, parts = new_health(), []
    edges = [0, *sorted(set(cuts)), 400]
    for a, b in itertools.pairwise(edges):
        parts.append(inspect(health, samples[a:b]))
    for k in range(2):
        np.testing.assert_array_equal(np.concatenate([p[k] for p in parts]), whole[k])


@settings(max_examples=40)
@given(seed=st.integers(0, 2**31), cuts=st.lists(st.integers(1, 399), max_size=6))
def test_any_cut_into_blocks_finds_the_same_limits(seed, cuts):
    accel = 3.0 * np.random.default_rng(seed).standard_normal((400, 3)).clip(-1.0, 1.0)
    whole = at_limit(new_limits(), accel)
    limits, parts = new_limits(), []
    for a, b in itertools.pairwise([0, *sorted(set(cuts)), 400]):
        parts.append(at_limit(limits, accel[a:b]))
    for k in range(2):
        np.testing.assert_array_equal(np.concatenate([p[k] for p in parts]), whole[k])


def test_flat_tops_are_limits_and_a_rest_is_none():
    """Nearly all readings cut at 2 m/s2 are found; rounded noise about gravity gives none."""
    t = np.arange(2000) / 100.0
    noise = 0.05 * np.random.default_rng(2).standard_normal((2000, 3))
    moving = noise + np.stack([4.0 * np.sin(3.0 * t), 0.0 * t, 0.0 * t + GRAVITY], axis=1)
    spoilt = np.column_stack([moving[:, :2].clip(-2.0, 2.0), moving[:, 2]])
    cut, upright = at_limit(new_limits(), spoilt)
    assert cut[:, 0].sum() > 0.9 * (np.abs(moving[:, 0]) > 2.0).sum()
    assert not cut[:, 1:].any()
    assert not upright[cut.any(axis=1)].any()
    at_rest = (noise + [0.0, 0.0, GRAVITY]).round(1)
    assert not at_limit(new_limits(), at_rest)[0].any()


def test_single_absurd_readings_are_replaced():
    samples = np.zeros((50, 6)) + 1e-3 * np.random.default_rng(1).standard_normal((50, 6))
    spoilt = samples.copy()
    spoilt[20] *= 1e5
    judged, usable = inspect(new_health(), spoilt)
    assert usable.all()
    np.testing.assert_array_equal(judged[20], samples[19])
    np.testing.assert_array_equal(np.delete(judged, 20, 0), np.delete(samples, 20, 0))


@pytest.mark.parametrize(
    ("dt", "jump", "is_odd"), [(0.002, 11.0, True), (0.01, 9.0, False), (0.05, 45.0, False)]
)
def test_slow_sensors_may_turn_further_between_two_samples(dt, jump, is_odd):
    samples = np.zeros((3, 6))
    samples[1, 0] = jump
    judged, usable = inspect(new_health(), samples, dt)
    assert usable.all()
    np.testing.assert_array_equal(judged[1], samples[0 if is_odd else 1])


def test_lost_samples_are_bridged():
    """A rotation at a constant rate continues over a gap of 0.2 s."""
    t = np.arange(1, 501) / 100.0
    imu = np.tile([0.0, 0.0, 0.5, 0.0, 0.0, GRAVITY], (500, 1))
    keep = (t < 3.0) | (t > 3.2)
    whole = MeasurementBlock.of_kind(Kind.IMU, t, np.zeros(500, dtype=np.int64), imu)
    c = constellation("initial")
    full = states(Orientation(c, OrientationParams()).step(whole))
    gapped = states(Orientation(c, OrientationParams()).step(whole.take(keep)))
    difference = yaw_of(full[-1, :4]) - yaw_of(gapped[-1, :4])
    assert abs(np.angle(np.exp(1j * difference))) < 0.01


@pytest.mark.parametrize("stamps", ["jitter", "repeated", "pairs", "slow"])
def test_a_turn_adds_up_to_the_time_that_passed(stamps):
    """A body rotates at 1 rad/s for 10 s, by 10 rad in total for any stamps of its samples."""
    rng, t = np.random.default_rng(4), np.arange(1, 1001) / 100.0
    if stamps == "jitter":
        stamped = np.sort(t + 0.005 * rng.standard_normal(len(t)))
    elif stamps == "repeated":
        stamped = np.where(rng.random(len(t)) < 0.3, np.r_[t[0], t[:-1]], t)
    elif stamps == "pairs":
        stamped = t[np.arange(len(t)) // 2 * 2 + 1]
    else:
        stamped = 1.1 * t  # a sensor that is slower than nominal
    stamped[[0, -1]] = t[0], stamped[-1]
    samples = 1e-3 * rng.standard_normal((len(t), 6)) + [0.0, 0.0, 1.0, 0.0, 0.0, GRAVITY]
    node = np.zeros(len(t), dtype=np.int64)
    block = MeasurementBlock.of_kind(Kind.IMU, stamped, node, samples)
    states = Orientation(constellation("initial", "car"), OrientationParams()).step(block)
    turned = np.unwrap(yaw_of(states.values[0, states.valid[0], :4]))
    assert turned[-1] - turned[0] == pytest.approx(stamped[-1] - stamped[0], abs=0.02)


def test_a_noisy_gyroscope_is_seen_to_rest():
    """Its bias and the norm of gravity are estimated; otherwise its tilt diverges."""
    rng, n = np.random.default_rng(3), 800
    bias, force = np.radians([0.5, -0.6, 0.4]), np.array([0.2, -0.3, GRAVITY + 0.1])
    gyr = bias + np.radians(0.7) * rng.standard_normal((n, 3))
    imu = np.concatenate([gyr, force + 0.03 * rng.standard_normal((n, 3))], axis=1)
    t, node = np.arange(1, n + 1) / 100.0, np.zeros(n, dtype=np.int64)
    block = MeasurementBlock.of_kind(Kind.IMU, t, node, imu)
    for rest_rate, most in ((RestParams().rate, 0.05), (np.radians(2.0), np.inf)):
        stage = Orientation(
            constellation("initial"), OrientationParams(rest=RestParams(rate=rest_rate))
        )
        out = states(stage.step(block))
        accel = np.abs(out[-200:, 4:8].mean(axis=0))
        assert (accel < most).all()
        assert np.isfinite(most) or accel.max() > 0.05  # VQF's own limit does not detect the rest


@pytest.mark.parametrize(("swing", "first"), [(15.0, 1.5), (0.0, 0.0)])
def test_an_orientation_that_starts_in_motion_is_used_once_it_has_settled(swing, first):
    """Before, its tilt follows single accelerations, and its heading follows the tilt."""
    rng, n = np.random.default_rng(0), 600
    t = np.arange(n) / 100.0
    samples = 0.01 * rng.standard_normal((n, 6))
    # A limb that swings along its x axis, level and pointing east.
    samples[:, 3] += swing * np.cos(2.0 * np.pi * 1.7 * t)
    samples[:, 5] += GRAVITY
    field = np.tile([0.0, 20.0, -40.0], (n, 1)) + 0.1 * rng.standard_normal((n, 3))
    node = np.zeros(n, dtype=np.int64)
    rows = [
        MeasurementBlock.of_kind(Kind.MAG, t, node, field),
        MeasurementBlock.of_kind(Kind.IMU, t, node, samples),
    ]
    block = MeasurementBlock.concatenate(rows)
    states = Orientation(constellation(vehicle="human"), OrientationParams()).step(
        block.take(block.order()[0])
    )
    states = states.take(states.valid[0] & (states.kind[0] == Kind.STATE))
    assert states.t[0, 0] == pytest.approx(first, abs=1e-9)
    assert np.degrees(np.abs(yaw_of(states.values[0, 100:, :4]))).max() < 5.0


def test_a_vehicle_that_stays_level_is_used_from_its_first_sample_on_in_motion_too():
    samples = np.tile([0.0, 0.0, 0.0, 15.0, 0.0, GRAVITY], (20, 1))
    t, node = np.arange(20) / 100.0, np.zeros(20, dtype=np.int64)
    stage = Orientation(constellation("initial", vehicle="car"), OrientationParams())
    out = stage.step(MeasurementBlock.of_kind(Kind.IMU, t, node, samples))
    assert out.valid[0, out.kind[0] == Kind.STATE].all()
