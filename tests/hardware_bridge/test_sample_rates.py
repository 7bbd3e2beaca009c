"""Samples at another rate than configured, and other faults visible in a stream."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware_bridge.config import parse_config
from hardware_bridge.errors import BridgeError
from hardware_bridge.ingest.intake import Intake
from hardware_bridge.ingest.sample_rates import SampleRates
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.start import Start
from hardware_bridge.live.swarm import LiveSwarm
from hardware_bridge.readings import MICROSECONDS_32, ImuReading, Source, StatusReading
from hardware_bridge.wire.encoder import RelposEncoder
from tracking.measurements import Kind, MeasurementBlock

S = 1_000_000_000


def parsed(links):
    return parse_config(f"[nodes.1]\n[nodes.2]\n{links}", file="swarm.toml", folder=Path())


def relpos(intake, node, readings):
    """Feed readings of a node of our own format, as (t_ns, reading)."""
    encoder = RelposEncoder(node, 1, None)
    for t_ns, reading in readings:
        source = Source(ticks=t_ns // 1000, clock=MICROSECONDS_32)
        data = encoder.encode([reading._replace(source=source)])
        intake.take(Chunk(f"links.n{node}", t_ns, data))


NODES = "".join(f'[links.n{k}]\nport = "/dev/n{k}"\nformat = "relpos"\n' for k in (1, 2))


@given(st.floats(20.0, 500.0), st.floats(0.3, 3.0), st.integers(0, 10**9))
def test_a_rate_that_differs_is_found_and_one_that_fits_is_not(configured, ratio, start_ns):
    rates, real = SampleRates([configured]), ratio * configured
    told = sum(rates.note(0, start_ns + round(k * S / real)) for k in range(int(5.0 * real)))
    assert rates.rate[0] == pytest.approx(real, rel=0.1)
    if abs(ratio - 1.0) > 0.4:
        assert rates.is_off(0)
        assert told == 1  # once
    elif abs(ratio - 1.0) < 0.2:
        assert not rates.is_off(0)
        assert told == 0


def test_what_a_port_has_kept_is_no_rate():
    """A backlog arrives at once, as after opening a port; and a bunch later."""
    rates = SampleRates([100.0])
    times = sorted([0] * 200 + [k * S // 100 for k in range(600)] + [3 * S] * 60)
    assert not any(rates.note(0, t_ns) for t_ns in times)
    assert rates.rate[0] == pytest.approx(100.0, rel=0.05)


def test_a_pause_is_no_rate():
    rates = SampleRates([100.0])
    for second in range(0, 20, 2):
        for k in range(80):
            assert not rates.note(0, second * S + k * S // 100)
    assert rates.rate == {}
    assert rates.is_open(0)
    assert not rates.is_open(1)


@pytest.mark.parametrize("hz", [100.0, 200.0])
def test_cars_are_not_armed_by_turns_of_another_size(hz):
    swarm = LiveSwarm(parsed(NODES + "[cars.1]\nport = '/dev/c'\ndriver = 'relpos'\n"), 0)
    samples = [
        (round(k * S / hz) + S, ImuReading(Source(), (1e-4 * (k % 7), 0.0, 0.0), (0.0, 0.0, 9.8)))
        for k in range(int(3.0 * hz))
    ]
    relpos(swarm.intake, 1, samples)
    group = type("Group", (), {"swarm": swarm})
    start = Start(None, arm=True)
    if hz == 100.0:
        assert start._rates_fit(group, [0])
        assert swarm.intake.notices == []
        return
    with pytest.raises(BridgeError, match=r"nodes\.1\.imu_hz: 100 configured, but 200 samples"):
        start._rates_fit(group, [0])
    assert len(swarm.intake.notices) == 1


@pytest.mark.parametrize(
    ("acc", "reason"),
    [
        ((0.0, 0.0, 1.0), "seem to be in g"),
        ((0.0, 0.0, -9.8), r"gravity is on -z, expected on \+z"),
    ],
)
def test_cars_are_not_armed_by_an_imu_that_reads_at_rest_what_none_does(acc, reason):
    nodes = NODES + "[cars.1]\nport = '/dev/c'\ndriver = 'relpos'\n"
    swarm = LiveSwarm(parsed(nodes), 0)
    samples = [
        (round(k * S / 100.0) + S, ImuReading(Source(), (1e-4 * (k % 7), 0.0, 0.0), acc))
        for k in range(300)
    ]
    relpos(swarm.intake, 1, samples)
    with pytest.raises(BridgeError, match=reason):
        Start(None, arm=True)._rates_fit(type("Group", (), {"swarm": swarm}), [0])
    assert len(swarm.intake.notices) == 1


def test_samples_are_turned_to_axes_of_the_body():
    """A board mounted upside down is correct if the mounting is configured."""
    axes = 'imu_axes = ["x", "-y", "-z"]\nmag_axes = ["-x", "y", "z"]\n'
    swarm = parse_config(f"[nodes.1]\n{axes}[nodes.2]\n{NODES}", file="swarm.toml", folder=Path())
    intake = Intake(swarm, 0)
    noise = np.random.default_rng(2).normal(0.0, 0.01, 250)
    field = (20.0, 5.0, -40.0)
    samples = [
        (k * S // 100 + S, ImuReading(Source(), (0.0, 0.0, 1e-3 * z), (0.0, z, -9.8), field))
        for k, z in enumerate(noise)
    ]
    relpos(intake, 1, samples)
    assert intake.at_rest.wrong == {}
    block = MeasurementBlock.empty(1, len(intake.events))
    intake.events.move_into(block)
    imu, mag = (block.values[0, block.kind[0] == kind] for kind in (Kind.IMU, Kind.MAG))
    np.testing.assert_allclose(imu[:, 5], 9.8, rtol=1e-6)
    np.testing.assert_allclose(mag[:, :3], [[-20.0, 5.0, -40.0]] * len(mag), rtol=1e-6)


def test_faults_are_told_when_they_change():
    intake = Intake(parsed(NODES), 0)
    said = [StatusReading(Source(), 12.0, fault) for fault in (0, 0, 5, 5, 5, 0)]
    relpos(intake, 2, [((k + 1) * S, reading) for k, reading in enumerate(said)])
    assert [text for _, text in intake.notices] == [
        "links.n2: node 2 reports fault 5",
        "links.n2: node 2 reports no fault any more",
    ]


@pytest.mark.parametrize("damaged", [(), (0,), (0, 1), (30,), (30, 31, 32)])
def test_stamps_of_another_counter_do_not_decide_for_good(damaged):
    """uwb-core has microseconds and radio ticks, distinguished by their size."""
    intake = Intake(parsed('[links.a]\nport = "/dev/a"\nformat = "uwb-core"\nnode = 1\n'), 0)
    for k in range(100):
        t = k / 10
        ticks = 30_000_000_000_000 if k in damaged else int(3e6 + 1e6 * t)
        said = {"utime": ticks, "uid": 1, "ouid": 2, "raz": [2.5], "rssi": [-80.0]}
        chunk = Chunk("links.a", int(t * S) + 2_000_000, (json.dumps(said) + "\n").encode())
        intake.take(chunk)
    late = [0.1 * k + 0.002 - row[0] for k, row in enumerate(intake.events._rows)]
    assert len(late) == 100
    whole = [lag for k, lag in enumerate(late) if k > 3 and not 30 <= k <= 33]
    assert np.max(np.abs(whole)) < 0.01


@pytest.mark.parametrize("hangs", ["no time", "new time", "old time"])
@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_a_tracker_that_hangs_is_not_believed_while_cars_drive(hangs, speed):
    text = '[links.a]\nport = "/dev/x"\nformat = "positions"\n[tracker]\nsource = "positions"\n'
    swarm = LiveSwarm(parsed(text), 0)
    swarm.apply(np.array([speed, 0.0]), np.zeros(2), np.ones(2), -np.ones(2))
    heard = []
    for k in range(400):
        step = min(k, 200)
        for node, x in ((1, 0.5 * step / 100), (2, 10.0)):
            said = {"node": node, "pos": [x, 0.0], "yaw": 0.0}
            if hangs != "no time":
                said["time"] = 10_000 * (k if hangs == "new time" else step)
            t_ns = k * S // 100 + 1_000_000
            swarm.take(Chunk("links.a", t_ns, (json.dumps(said) + "\n").encode()))
        if k % 10 == 9:
            swarm.step(t_ns)
        heard.append(swarm.intake.received_ns[0])
    silent = (t_ns - heard[-1]) / S
    assert (silent > 1.5) == (speed > 0.0)
    if speed and hangs != "old time":
        texts = [text for _, text in swarm.intake.notices]
        assert texts == ["the place of 1 stays the same while it drives: its tracker hangs"]
    # When the position changes again, it is accepted.
    said = {"node": 1, "pos": [1.1, 0.0], "yaw": 0.0}
    swarm.take(Chunk("links.a", t_ns + S, (json.dumps(said) + "\n").encode()))
    assert swarm.intake.received_ns[0] == t_ns + S
