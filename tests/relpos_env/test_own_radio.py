"""What every node knows from its own radio: motion of others, and ranges of all pairs."""

from dataclasses import replace

import numpy as np
import pytest
from test_radio_twin import BOXES, DT, LOSSY, motion, plan

from relpos_env.sensors.radio._air_kernels import true_at
from relpos_env.sensors.radio.air import Air
from relpos_env.sensors.radio.params import RadioSimParams
from relpos_env.sensors.radio.radio import Radio
from tracking.ranging.compiled.overheard import RANGE, RECEIVED_MESSAGE
from tracking.ranging.events import MotionEvent
from tracking.ranging.exchange import RangeEvent
from tracking.ranging.frames.airtime import FAST_PHY, PAPER_PHY
from tracking.ranging.frames.motion import MOTION_BYTES, Motion
from tracking.ranging.frames.timestamps import MODULUS, unwrap
from tracking.ranging.params import SessionParams


@pytest.mark.parametrize("phy", [PAPER_PHY, FAST_PHY], ids=lambda p: p.name)
def test_messages_carry_the_motion_of_their_sender(phy):
    """Sessions in the reference air: sums arrive as sent, at their time in the other clock."""
    params = RadioSimParams(session=SessionParams(phy=replace(phy, motion_bytes=MOTION_BYTES)))
    air, pos = Air(params, 3, 5, 0.01), np.random.default_rng(0).uniform(-2, 2, (3, 3))
    for k in range(3):
        air.switch_on(k, boot=k + 1, at=0.001 * k)
    found = []
    for window in range(60):
        air.step(pos, pos)
        for k, session in enumerate(air.sessions):
            clock = int(air._nodes[k]["base"]) % MODULUS
            motion = Motion(0, (window, k, -1), (k, 5, -window), (k, 7, 8, -9), 10)
            session.transmitter.set_motion(motion, clock)
        for event in air.events:
            if isinstance(event.event, MotionEvent):
                found.append((event.node, event.event, window))
                at = true_at(air._nodes, event.node, unwrap(event.event.time, clocks(air, event)))
                sums = (event.event.motion.velocity[0] + 1) * air._dt
                assert abs(air.t + at - sums) < 2e-5
        air.events.clear()
    assert len(found) > 100
    for node, event, _ in found:
        assert event.id != node
        assert event.boot == event.id + 1
        assert event.motion.velocity[1:] == (event.id, -1)
        assert event.motion.rotation == (event.id, 7, 8, -9)


def clocks(air, event):
    """Return the clock of the node of an event, at the start of the next window [ticks]."""
    return int(air._nodes[event.node]["base"])


def overheard(n, seed, seconds, params):
    """Run the reference and the compiled radios; return the ranges that each node knows."""
    air = Air(params, n, seed, DT)
    radio = Radio(params, n, [seed], DT, overheard_windows=1)
    where, switches = motion(n, seed), plan(n, seed, seconds)
    found, messages = [], 0
    for w in range(int(seconds / DT)):
        for _, k, boot, at in [s for s in switches if s[0] == w]:
            if boot is None:
                air.switch_off(k)
                radio.switch_off(0, k)
            else:
                air.switch_on(k, boot=boot, at=at)
                radio.switch_on(0, k, boot=boot, after=at)
        pos0, pos1 = where(w * DT), where((w + 1) * DT)
        air.step(pos0, pos1, BOXES)
        radio.step(pos0[None], pos1[None], BOXES[None])
        over = radio.overheard
        for m in range(int(over.used[0])):
            pair = int(over.i[0, m]), int(over.j[0, m])
            if over.kind[0, m] == RANGE:
                found.append((w, int(over.receiver[0, m]), *pair, *over.values[0, m]))
            messages += over.kind[0, m] == RECEIVED_MESSAGE
        over.used[0] = 0
    known = [
        (round(e.t / DT - 0.5), e.node, e.event.i, e.event.j, e.event.distance, e.event.rx_power,
         e.event.fp_power)
        for e in air.events
        if isinstance(e.event, RangeEvent)
    ]  # fmt: skip
    assert messages > len(known) / n
    return found, known


@pytest.mark.parametrize(("loss", "least"), [(None, 0.85), (0.05, 0.85), (0.3, 0.6)])
@pytest.mark.parametrize("n", [3, 5])
def test_each_node_knows_the_ranges_of_the_reference(n, loss, least):
    """Twin: the reference sessions compute every range from the bytes that they received.

    They also complete exchanges whose question is older than the asker's last message, and use
    their own clock estimates, so a few ranges are known to one of both only.
    """
    channel = LOSSY if loss is None else replace(LOSSY, loss=loss, max_distance=50.0)
    found, known = overheard(n, 7 + n, 4.0, RadioSimParams(channel=channel))
    of_asker = [[r for r in rows if r[1] == r[2]] for rows in (found, known)]
    assert of_asker[0] == of_asker[1]
    others = [r for r in found if r[1] != r[2]]
    assert min(r[4] for r in others) > 0.0
    assert len(others) > least * sum(r[1] != r[2] for r in known)
    paired = 0
    for window, *which, distance, rx, fp in others:
        same = [r for r in known if [*r[1:4]] == which and abs(r[0] - window) <= 1]
        best = min(same, key=lambda r: abs(r[4] - distance), default=None)
        if best is not None:
            paired += 1
            assert abs(best[4] - distance) < 0.1
            assert (rx, fp) == best[5:] or abs(best[4] - distance) > 1e-9
    assert paired > (0.98 if loss != 0.3 else 0.9) * len(others)


def test_a_channel_without_losses_tells_all_ranges_to_all_nodes():
    """Every round of three nodes has three ranges, and each node knows all of them."""
    channel = replace(LOSSY, loss=0.0, loss_nlos=0.0, max_distance=50.0)
    radio = Radio(RadioSimParams(channel=channel), 3, [3], DT, overheard_windows=1)
    for k in range(3):
        radio.switch_on(0, k, boot=k + 1, after=0.002 * k)
    pos, count = np.random.default_rng(1).uniform(-2, 2, (1, 3, 3)), np.zeros((3, 3, 3), dtype=int)
    for _ in range(200):
        radio.step(pos, pos)
        over = radio.overheard
        for m in range(int(over.used[0])):
            if over.kind[0, m] == RANGE:
                count[over.receiver[0, m], over.i[0, m], over.j[0, m]] += 1
        over.used[0] = 0
    pairs = count[:, [0, 0, 1], [1, 2, 2]]
    assert pairs.min() > 140
    assert np.ptp(pairs, axis=0).max() <= 3
