"""Emulated nodes send their measurements in every format, stamped by their own clocks."""

import numpy as np
import pytest

from hardware_bridge.decoders import make_decoder
from hardware_bridge.emulator.formats import THIRD_PARTY, check_formats, wire_format
from hardware_bridge.emulator.measured import Measured, by_node
from hardware_bridge.emulator.node import EmulatedNode, NodeParams, at_rest
from hardware_bridge.emulator.node_clock import NodeClock
from hardware_bridge.errors import BridgeError
from hardware_bridge.identity import Identities, Verdict
from hardware_bridge.readings import (
    MICROSECONDS_32,
    RADIO_40,
    HeartbeatReading,
    ImuReading,
    RangeReading,
    StatusReading,
)
from tracking.measurements import Kind, MeasurementBlock

IDS = (1, 2, 12)
KEY = bytes(range(16))
RESOLUTION = {
    # distance [m], power [dB], gyroscope [rad/s], accelerometer [m/s2], magnetometer [uT]
    "relpos": (6e-5, 6e-3, 6e-6, 6e-5, 6e-4),
    "linktrack": (6e-4, 0.26, None, None, None),
    "uwb-core": (6e-7, 6e-7, None, None, None),
    "dw1000": (6e-3, 6e-3, None, None, None),
    "dwm1001": (6e-3, None, None, None, None),
    "witmotion": (None, None, 6e-4, 3e-3, 0.06),
}


def block_of(n_steps=20, seed=4):
    """Return steps of 10 ms with IMU and magnetometer of every node and a range of every pair."""
    rng, rows = np.random.default_rng(seed), []
    for k in range(1, n_steps + 1):
        t = 0.01 * k
        nodes = np.arange(3)
        mag, imu = rng.normal(0.0, 30.0, (3, 3)), rng.normal(0.0, 2.0, (3, 6))
        rows.append(MeasurementBlock.of_kind(Kind.MAG, np.full(3, t), nodes, mag))
        rows.append(MeasurementBlock.of_kind(Kind.IMU, np.full(3, t), nodes, imu))
        i, j = np.array([0, 0, 1]), np.array([1, 2, 2])
        times = t - np.array([0.008, 0.005, 0.001])
        values = np.column_stack([rng.uniform(0.5, 9.0, 3), rng.uniform(-95.0, -70.0, (3, 2))])
        rows.append(
            MeasurementBlock.of_kind(
                Kind.RANGE, times, i, values, j=j, antennas=(i, j), has_power=np.ones(3, bool)
            )
        )
    return MeasurementBlock.concatenate([*rows, MeasurementBlock.empty(1, 7)])


def node_of(*names, index=0, seed=5, key=None, **params):
    formats = tuple(wire_format(name, key) for name in names)
    return EmulatedNode(IDS[index], formats, IDS, np.random.default_rng(seed), NodeParams(**params))


def said(node, rows, steps=1, key=None):
    """Return the readings that a host decodes from each of the node's ports."""
    decoders = [make_decoder(f.name, key if f.name == "relpos" else None) for f in node.formats]
    readings = [[] for _ in decoders]
    for part in np.array_split(np.arange(len(rows)), steps):
        mine = [rows[k] for k in part]
        frames = node.say(mine, mine[-1].t if mine else 0.0)
        for port, decoder in enumerate(decoders):
            for frame in frames[port]:
                readings[port] += decoder.feed(frame)
    for decoder in decoders:
        assert decoder.counts.damaged == decoder.counts.strange == 0
    return readings


def test_rows_are_sorted_out_by_who_measured_them():
    block = block_of()
    rows = by_node(block, 3)
    assert sum(map(len, rows)) == int(block.valid.sum())
    for node, mine in enumerate(rows):
        assert [r.t for r in mine] == sorted(r.t for r in mine)
        assert {r.other for r in mine if r.kind is not Kind.RANGE} == {node}
    assert [r.other for r in rows[0] if r.kind is Kind.RANGE][:2] == [1, 2]
    assert not [r for r in rows[2] if r.kind is Kind.RANGE]


@pytest.mark.parametrize(
    "names",
    [("relpos",), ("linktrack", "witmotion"), ("uwb-core", "witmotion"), ("dw1000", "witmotion"),
     ("dwm1001", "relpos")],
)  # fmt: skip
@pytest.mark.parametrize("keyed", [False, True])
def test_what_the_host_reads_is_what_was_measured(names, keyed):
    key = KEY if keyed else None
    rows = by_node(block_of(), 3)[0]
    node = node_of(*names, key=key)
    ports = said(node, rows, steps=7, key=key)
    for port, name in enumerate(names):
        metres, decibels, turn, force, field = RESOLUTION[name]
        ranges = [r for r in ports[port] if isinstance(r, RangeReading)]
        if metres is not None and port == 0:
            measured = [r for r in rows if r.kind is Kind.RANGE]
            names_of = wire_format(name).name_of
            assert [r.to for r in ranges] == [names_of(IDS[r.other]) for r in measured]
            for reading, row in zip(ranges, measured, strict=True):
                assert abs(reading.distance - row.values[0]) <= metres
                if decibels is not None:
                    assert abs(reading.rx_power - row.values[1]) <= decibels
                if reading.source.ticks is not None:
                    clock = reading.source.clock
                    assert reading.source.ticks == node.clock.ticks(row.t, clock)
        samples = [r for r in ports[port] if isinstance(r, ImuReading)]
        if turn is not None:
            imus = [r for r in rows if r.kind is Kind.IMU]
            mags = [r for r in rows if r.kind is Kind.MAG]
            # The last sample may wait for a frame that completes it.
            assert len(imus) - 1 <= len(samples) <= len(imus)
            for reading, imu, mag in zip(samples, imus, mags, strict=False):
                np.testing.assert_allclose(reading.gyr, imu.values[:3], atol=turn)
                np.testing.assert_allclose(reading.acc, imu.values[3:6], atol=force)
                np.testing.assert_allclose(reading.mag, mag.values[:3], atol=field)


def test_every_format_of_a_device_is_tested():
    assert {"relpos", *THIRD_PARTY} == set(RESOLUTION)


def test_the_host_can_tell_who_speaks_and_whether_anything_is_missing():
    node = node_of("relpos")
    (readings,) = said(node, by_node(block_of(), 3)[0], steps=20)
    assert {r.source.device for r in readings} == {"1"}
    assert {r.source.boot for r in readings} == {node.boot}
    assert [r.source.sequence for r in readings] == list(range(len(readings)))
    assert {type(r) for r in readings} == {
        ImuReading, RangeReading, HeartbeatReading, StatusReading,
    }  # fmt: skip


def test_same_rows_and_seed_same_bytes():
    rows = by_node(block_of(), 3)[0]
    first, second, other = (node_of("relpos", seed=s).say(rows, 0.2) for s in (1, 1, 2))
    assert first == second
    assert first != other


def test_a_clock_starts_anywhere_drifts_jumps_and_wraps():
    clock = NodeClock(offset=10.0, drift=100e-6)
    assert clock.ticks(0.0, MICROSECONDS_32) == 10_000_000
    assert clock.seconds(1000.0) == pytest.approx(1010.1)
    clock.step(-4.0)
    assert clock.ticks(0.0, MICROSECONDS_32) == 6_000_000
    ahead = NodeClock(offset=(1 << 32) * 1e-6 - 0.5)
    assert ahead.ticks(0.25, MICROSECONDS_32) == (1 << 32) - 250_000
    assert ahead.ticks(0.75, MICROSECONDS_32) == 250_000
    assert NodeClock(offset=20.0).ticks(0.0, RADIO_40) == 20 * 63_897_600_000 % (1 << 40)
    clock.restart(50.0)
    assert clock.ticks(50.0, MICROSECONDS_32) == 0


def test_after_a_reboot_it_is_silent_and_begins_anew():
    rows = by_node(block_of(200), 3)[0]
    node = node_of("relpos")
    before = said(node, [r for r in rows if r.t <= 0.5])[0]
    old = node.boot
    node.reboot(0.5, 1.0)
    silent = said(node, [r for r in rows if 0.5 < r.t < 1.495])[0]
    after = said(node, [r for r in rows if r.t >= 1.505])[0]
    assert before
    assert silent == []
    assert {r.source.boot for r in after} == {node.boot}
    assert node.boot > old
    assert after[0].source.sequence == 0
    assert 0 <= after[0].source.ticks < 20_000


@pytest.mark.parametrize("seed", range(4))
def test_a_node_with_a_key_is_believed_after_every_reboot(seed):
    rows = by_node(block_of(100), 3)[0]
    node, identities = node_of("relpos", key=KEY, seed=seed), Identities(authenticated=True)
    found = []
    for k in range(5):
        (readings,) = said(node, [r for r in rows if 0.2 * k <= r.t < 0.2 * k + 0.15], key=KEY)
        found.append([identities.check("a", r.source, 0, 1) for r in readings])
        node.reboot(0.2 * k + 0.15, 0.05)
    assert [each[0] for each in found] == [Verdict.FRESH, *[Verdict.REBOOT] * 4]
    assert {verdict for each in found for verdict in each[1:]} == {Verdict.FRESH}


def test_a_stuck_sensor_repeats_itself_and_ranges_go_on():
    rows = by_node(block_of(100), 3)[0]
    node = node_of("relpos")
    said(node, [r for r in rows if r.t < 0.2])
    node.stick(0.6)
    (stuck,) = said(node, [r for r in rows if 0.2 <= r.t < 0.595])
    samples = [r for r in stuck if isinstance(r, ImuReading)]
    assert len(samples) > 30
    assert len({(r.gyr, r.acc) for r in samples}) == 1
    assert len({r.source.ticks for r in samples}) == len(samples)
    assert len({r.distance for r in stuck if isinstance(r, RangeReading)}) > 30
    (free,) = said(node, [r for r in rows if r.t >= 0.605])
    assert len({r.gyr for r in free if isinstance(r, ImuReading)}) > 30


def test_a_silent_node_goes_on_where_its_clock_is():
    rows = by_node(block_of(100), 3)[0]
    node = node_of("relpos")
    node.be_silent(0.5)
    (readings,) = said(node, rows)
    first = min(r.source.ticks for r in readings)
    assert node.clock.ticks(0.4999, MICROSECONDS_32) <= first
    assert first <= node.clock.ticks(0.5101, MICROSECONDS_32)


def test_a_twin_lies_still_under_the_same_id():
    rows = by_node(block_of(), 3)[0]
    still = at_rest(rows)
    assert {r.values[:6] for r in still if r.kind is Kind.IMU} == {(0.0,) * 5 + (9.81,)}
    assert [r for r in still if r.kind is not Kind.IMU] == [
        r for r in rows if r.kind is not Kind.IMU
    ]


def test_states_and_rows_that_no_device_sends():
    state = Measured(0.1, Kind.STATE, 0, 0, (1.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.3, 0.0), False)
    block = MeasurementBlock.of_kind(
        Kind.JOIN, np.zeros(1), np.zeros(1, np.int64), np.zeros((1, 0))
    )
    assert by_node(block, 1) == [[]]
    (readings,) = said(node_of("relpos"), [state])
    np.testing.assert_allclose(readings[0].accel_w, (0.1, 0.2, 0.3), atol=1e-4)


def test_formats_that_cannot_carry_enough_are_refused():
    with pytest.raises(BridgeError, match="format: expected one of relpos, linktrack"):
        wire_format("nonsense")
    with pytest.raises(BridgeError, match="imu_format: dw1000 cannot say"):
        check_formats((wire_format("dw1000"),))
    with pytest.raises(BridgeError, match="format: witmotion cannot say distances"):
        check_formats((wire_format("witmotion"),))
