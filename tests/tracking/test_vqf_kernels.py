"""Compiled VQF against its author's library, and properties of the orientation stage."""

import csv
import gzip
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from vqf import VQF

from tracking.ahrs.gyro_bias import BIAS
from tracking.ahrs.orientation import Orientation, make_coefficients, make_state
from tracking.ahrs.params import OrientationParams
from tracking.ahrs.stage import forget
from tracking.ahrs.vqf import run_vqf
from tracking.constellation import Constellation, NodeConfig
from tracking.geometry import GRAVITY, quat_conjugate, rotate
from tracking.measurements import Kind, MeasurementBlock

NORTH = np.array([0.5, 20.0, -40.0])


def turning(rng, n, dt):
    """Return gyroscope, specific force and field of a sensor that rotates, rests and rotates."""
    t = np.arange(n) * dt
    rest = (t % 9.0) > 5.0
    phase = rng.uniform(0.0, 6.0, 6)
    rate = np.array([0.7, 1.1, 0.4, 0.9, 1.7, 0.6])
    waves = np.sin(t[:, None] * rate + phase) * [1.5, 1.0, 2.5, 3.0, 2.0, 4.0]
    waves[rest] = 0.0
    noise = rng.standard_normal((n, 6)) * ([0.002] * 3 + [0.02] * 3)
    gyr, acc = waves[:, :3].copy(), np.zeros((n, 3))
    q = VQF(dt).updateBatch(gyr, acc)["quat6D"]  # of the gyroscope only
    body = quat_conjugate(q)
    samples = noise + [0.01, -0.02, 0.015, 0.0, 0.0, 0.0]
    samples[:, :3] += gyr
    samples[:, 3:] += rotate(body, waves[:, 3:] + [0.0, 0.0, GRAVITY])
    return samples, rotate(body, NORTH) + 0.3 * rng.standard_normal((n, 3))


def plain(samples, field, rng):
    return None


def disturbed(samples, field, rng):
    """Add a magnet for a while, then a lasting new field, which is accepted at last."""
    n = len(field)
    field[n // 5 : n // 4] += [30.0, 0.0, 20.0]
    field[n // 2 :] *= 1.4


def with_zeros(samples, field, rng):
    """Set readings of one sensor after another to zero."""
    for rows in rng.integers(0, len(samples), (30, 3)):
        samples[rows[0], 3:] = 0.0
        field[rows[1]] = 0.0
        samples[rows[2], :3] = 0.0


def fast(samples, field, rng):
    """Rotate by half a turn per sample, beyond the small-angle series."""
    samples[:, :3] *= 40.0


def upside_down(samples, field, rng):
    """Make the first correction one of 180 degrees."""
    samples[:, 3:] = [0.0, 0.0, -GRAVITY]


def run(samples, field, hz, params, every=1):
    """Run the kernel with a field on some samples: q_6d, q_9d, bias, resting, (sample, ...)."""
    nodes = tuple(NodeConfig(id=k, vehicle="hand", imu_hz=hz, mag_hz=hz / every) for k in (1, 2))
    coefficients = make_coefficients(Constellation(nodes=nodes), params)
    n = len(samples)
    samples, field = (np.ascontiguousarray(a[None, None]) for a in (samples, field))
    out = [np.zeros((1, 1, n, d)) for d in (4, 4, 3)]
    resting = np.zeros((1, 1, n), dtype=bool)
    has_field = (np.arange(n) % every == 0)[None, None]
    state = make_state(1, 1)
    forget(coefficients, state, GRAVITY)
    run_vqf(coefficients, state, samples, field, has_field, *out, resting)
    return [*(a[0, 0] for a in out), resting[0, 0]]


def of_the_library(params):
    """Return arguments of the library; a longer tau_acc delays the bias measured in motion."""
    return {
        "tauAcc": params.tau_acc,
        "tauMag": params.tau_mag,
        "restThGyr": np.degrees(params.rest.rate),
        "biasSigmaMotion": 0.1 * np.sqrt(params.tau_acc / 3.0),
    }


def assert_same(samples, field, hz, params):
    found = run(samples, field, hz, params)
    twin = VQF(1.0 / hz, **of_the_library(params))
    gyr, acc = (np.ascontiguousarray(samples[:, k : k + 3]) for k in (0, 3))
    expected = twin.updateBatch(gyr, acc, np.ascontiguousarray(field))
    for name, value in zip(("quat6D", "quat9D", "bias"), found[:3], strict=True):
        np.testing.assert_allclose(value, expected[name], rtol=0.0, atol=1e-9, err_msg=name)
    np.testing.assert_array_equal(found[3], expected["restDetected"])
    return expected


@pytest.mark.parametrize("spoil", [plain, disturbed, with_zeros, fast, upside_down])
@pytest.mark.parametrize(("hz", "tau_acc", "tau_mag"), [(100.0, 3.0, 9.0), (51.3, 30.0, 4.0)])
def test_it_is_the_library(spoil, hz, tau_acc, tau_mag):
    """Compare quaternions, bias and rest of every sample; the tested effect does occur."""
    rng = np.random.default_rng(7)
    samples, field = turning(rng, 9000, 1.0 / hz)
    spoil(samples, field, rng)
    params = OrientationParams(tau_acc=tau_acc, tau_mag=tau_mag)
    expected = assert_same(samples, field, hz, params)
    if spoil is plain:
        assert expected["restDetected"].any()
        assert not expected["restDetected"].all()
    if spoil is disturbed:
        states = expected["magDistDetected"]
        assert np.count_nonzero(np.diff(states)) >= 3


@pytest.mark.parametrize("every", [4, 30])
def test_it_is_the_library_with_a_slower_magnetometer(every):
    """At 3 Hz the low pass of the field passes everything."""
    rng = np.random.default_rng(9)
    samples, field = turning(rng, 3000, 0.01)
    found = run(samples, field, 100.0, OrientationParams(), every)
    twin = VQF(0.01, -1.0, 0.01 * every, **of_the_library(OrientationParams()))
    expected = []
    for k in range(len(samples)):
        twin.update(samples[k, :3].copy(), samples[k, 3:].copy())
        if k % every == 0:
            twin.updateMag(field[k].copy())
        expected.append(twin.getQuat9D())
    np.testing.assert_allclose(found[1], expected, rtol=0.0, atol=1e-9)


@settings(max_examples=15)
@given(seed=st.integers(0, 2**31), hz=st.floats(5.0, 800.0))
def test_it_is_the_library_on_anything(seed, hz):
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-3.0, 1.0, 3)
    samples = rng.standard_normal((200, 6)) * np.repeat(size[:2], 3)
    samples[:, 3:] += GRAVITY * rng.standard_normal(3)
    field = NORTH + size[2] * rng.standard_normal((200, 3))
    assert_same(samples, field, hz, OrientationParams())


def test_it_is_the_library_on_a_recording(data):
    """A sensor in a hand, with a magnet brought near."""
    path = data / "imu_orientation" / "34_disturbed_attached_magnet_3cm.csv.gz"
    with gzip.open(path, "rt") as file:
        rows = list(itertools.islice(csv.DictReader(file), 8000))
    names = ("gx", "gy", "gz", "ax", "ay", "az", "mx", "my", "mz")
    table = np.array([[float(r[n] or 0.0) for n in names] for r in rows])
    expected = assert_same(table[:, :6], table[:, 6:], 285.714, OrientationParams())
    assert expected["restDetected"].any()


def events(rng, n_nodes=3, n=120):
    """Return a block of one environment with gaps, a stuck sensor, jumps, limits and zeros."""
    parts = []
    for node in range(n_nodes):
        samples, field = turning(rng, n, 0.01)
        t = np.arange(1, n + 1) / 100.0
        t[rng.integers(0, n) :] += rng.choice([0.0, 0.07, 0.3, 0.8])
        t[rng.integers(0, n) :] += rng.choice([0.0, 0.07, 0.3, 0.8])
        a = rng.integers(0, n - 40)
        samples[a : a + 35] = samples[a] if rng.random() < 0.5 else samples[a : a + 35]
        samples[rng.integers(0, n, 2)] *= 1e4
        samples[rng.integers(0, n, 2), 3:] = 0.0
        samples[:, 3] = samples[:, 3].clip(-1.0, 1.0)
        ints = np.full(n, node)
        parts.append(MeasurementBlock.of_kind(Kind.IMU, t, ints, samples))
        heard = rng.random(n) < rng.choice([0.3, 1.0])
        parts.append(MeasurementBlock.of_kind(Kind.MAG, t[heard], ints[heard], field[heard]))
    return MeasurementBlock.concatenate(parts).sorted()


def orientation(heading, n_envs=1):
    nodes = (
        NodeConfig(id=1, vehicle="hand", initial_heading=0.7),
        NodeConfig(id=2, vehicle="car", mag_hz=30.0),
        NodeConfig(id=3),
    )
    constellation = Constellation(nodes=nodes, heading=heading)
    return Orientation(constellation, OrientationParams(), n_envs)


def assert_equal_blocks(a, b):
    for name in ("kind", "values", "valid"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)


@settings(max_examples=30)
@given(
    seed=st.integers(0, 2**31),
    cuts=st.lists(st.integers(1, 400), max_size=8),
    heading=st.sampled_from(["magnetic", "initial"]),
)
def test_any_split_into_blocks_gives_the_same_states(seed, cuts, heading):
    block = events(np.random.default_rng(seed))
    whole, cut = orientation(heading), orientation(heading)
    expected = whole.step(block)
    edges = [0, *sorted({c for c in cuts if c < block.n_events}), block.n_events]
    parts = [cut.step(block.take(slice(a, b))) for a, b in itertools.pairwise(edges)]
    assert_equal_blocks(MeasurementBlock.concatenate(parts), expected)
    for one, other in zip(whole.state, cut.state, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("heading", ["magnetic", "initial"])
def test_an_environment_of_a_batch_is_that_environment_alone(heading):
    rng = np.random.default_rng(3)
    blocks = [events(rng) for _ in range(4)]
    batch = orientation(heading, 4)
    out = batch.step(MeasurementBlock.stack(blocks))
    for k, block in enumerate(blocks):
        alone = orientation(heading)
        expected = alone.step(block)
        n = block.n_events
        for name in ("kind", "values", "valid"):
            np.testing.assert_array_equal(getattr(out, name)[k, :n], getattr(expected, name)[0])
        for one, other in zip(batch.state.of(slice(k, k + 1)), alone.state, strict=True):
            np.testing.assert_array_equal(one, other)


def test_a_reset_environment_is_a_new_one_and_the_others_go_on():
    rng = np.random.default_rng(5)
    first = MeasurementBlock.stack([events(rng), events(rng)])
    one, other = orientation("magnetic", 2), orientation("magnetic", 2)
    one.step(first)
    kept = one.state.copy()
    one.reset(1)
    for array, before, new in zip(one.state, kept, other.state, strict=True):
        np.testing.assert_array_equal(array[0], before[0])
        np.testing.assert_array_equal(array[1], new[1])


def test_the_block_that_came_is_left_as_it_was():
    block = events(np.random.default_rng(1))
    before = MeasurementBlock.concatenate([block])
    orientation("magnetic").step(block)
    assert_equal_blocks(block, before)


def test_a_long_silence_keeps_the_bias_and_finds_the_heading_anew():
    """Only the first sample with a field after the gap gives a state again."""
    n = 3000
    samples = np.tile([0.01, -0.02, 0.005, 0.0, 0.0, GRAVITY], (n, 1))
    samples += 1e-4 * np.random.default_rng(0).standard_normal(samples.shape)
    t = np.arange(1, n + 1) / 100.0
    node = np.zeros(n, dtype=np.int64)
    field = np.tile(NORTH, (n, 1))
    stage = orientation("magnetic")
    whole = [(Kind.IMU, t, node, samples), (Kind.MAG, t, node, field)]
    stage.step(MeasurementBlock.concatenate([MeasurementBlock.of_kind(*p) for p in whole]).sorted())
    late = t[:20] + t[-1] + 2.0
    parts = [
        (Kind.IMU, late, node[:20], samples[:20]),
        (Kind.MAG, late[10:], node[10:20], field[10:20]),
    ]
    block = MeasurementBlock.concatenate([MeasurementBlock.of_kind(*p) for p in parts]).sorted()
    out = stage.step(block)
    assert out.valid[0, out.kind[0] == Kind.STATE].tolist() == [False] * 10 + [True] * 10
    np.testing.assert_allclose(
        stage.state.bias[0, 0, BIAS : BIAS + 3], [0.01, -0.02, 0.005], atol=5e-4
    )
