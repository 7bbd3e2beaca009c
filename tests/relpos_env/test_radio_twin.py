"""Compiled radios against the reference: equal sessions, messages and ranges, exactly."""

from dataclasses import replace

import numpy as np
import pytest

from relpos_env.sensors.radio.air import Air
from relpos_env.sensors.radio.channel import CALIBRATED, INDOOR
from relpos_env.sensors.radio.params import RadioSimParams
from relpos_env.sensors.radio.radio import Radio
from tracking.ranging.exchange import RangeEvent
from tracking.ranging.frames.airtime import FAST_PHY, PAPER_PHY
from tracking.ranging.frames.timestamps import MODULUS
from tracking.ranging.params import SessionParams

DT = 0.01
ROLES = ["listening", "initiator", "responder"]
BOXES = np.array([[0.0, 0.0, 0.4, 0.3, 1.0, 0.0], [1.5, -1.0, 0.2, 0.5, 0.6, 0.8]])
LOSSY = replace(CALIBRATED, loss=0.05, loss_nlos=0.4, max_distance=4.5)


def motion(n, seed):
    """Return positions of the nodes over time: each on a curve of its own."""
    rng = np.random.default_rng(seed)
    base, rate = rng.uniform(-2.5, 2.5, (n, 3)), rng.uniform(-1.5, 1.5, (n, 3))
    return lambda t: base + np.sin(rate * t)


def plan(n, seed, seconds):
    """Return switches (window, node, boot or None): joins, losses of nodes and of the initiator."""
    rng = np.random.default_rng(seed + 1)
    windows = int(seconds / DT)
    switches = [(0, k, int(rng.integers(256)), rng.uniform(0.0, 0.009)) for k in range(n - 1)]
    switches.append((windows // 8, n - 1, int(rng.integers(256)), float(rng.uniform(0.0, DT))))
    switches += [(windows // 3, 0, None, 0.0), (windows // 2, 0, 17, 0.0)]
    for at in range(windows // 2 + 40, windows - 60, 45):
        node = int(rng.integers(n))
        back = at + int(rng.integers(1, 40))
        switches += [(at, node, None, 0.0), (back, node, int(rng.integers(256)), 0.0)]
    return sorted(switches, key=lambda s: s[0])


def state(session):
    """Return the state of the reference that must be equal."""
    if session is None:
        return None
    turns = session._turns
    times = turns.expected, turns.deadline, turns.check_at, turns.received_at
    return (
        session.role.value, session.root, session.round, session.members, turns.cursor,
        session._dice._state, *(t % MODULUS for t in times),
    )  # fmt: skip


def twin_state(radio, env, node):
    """Return the same state of the compiled session."""
    s = radio._air.sessions[env, node]
    if not radio._air.nodes[env, node]["on"]:
        return None
    members = tuple(k for k in range(radio._air.sessions.shape[1]) if s["members"] >> k & 1)
    times = (s[k] % MODULUS for k in ("expected", "deadline", "check_at", "received_at"))
    return (ROLES[s["role"]], s["root"], s["round"], members, s["cursor"], s["dice"], *times)


def rows(ranges, env=0):
    count = ranges.count[env]
    return [
        (int(i), int(j), *map(float, v))
        for i, j, v in zip(
            ranges.i[env, :count], ranges.j[env, :count], ranges.values[env], strict=False
        )
    ]


def resolved(air):
    """Return the ranges at the node with the smaller number."""
    found = [t.event for t in air.events if isinstance(t.event, RangeEvent) and t.node == t.event.i]
    return [(e.i, e.j, e.distance, e.rx_power, e.fp_power) for e in found]


def compare(params, n, seed, seconds, switches):
    air, radio, where = Air(params, n, seed, DT), Radio(params, n, [seed], DT), motion(n, seed)
    found = []
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
        found += rows(radio.step(pos0[None], pos1[None], BOXES[None]))
        for k in range(n):
            assert twin_state(radio, 0, k) == state(air.sessions[k]), (w, k)
    assert found == resolved(air)
    return found


@pytest.mark.parametrize("phy", [PAPER_PHY, FAST_PHY], ids=lambda phy: phy.name)
@pytest.mark.parametrize("n", [2, 3, 6, 10])
def test_twin_in_a_place_with_obstacles(n, phy):
    params = RadioSimParams(session=SessionParams(phy=phy), channel=INDOOR)
    seconds = 3.0 if phy is PAPER_PHY else 1.6
    assert len(compare(params, n, n, seconds, plan(n, n, seconds))) > 50


@pytest.mark.parametrize("succession", [True, False])
@pytest.mark.parametrize("n", [3, 6])
@pytest.mark.parametrize("seed", [11, 12])
def test_twin_with_losses_and_hidden_nodes(n, succession, seed):
    params = RadioSimParams(
        session=SessionParams(succession=succession), channel=LOSSY, antenna_delay_std=0.05
    )
    assert len(compare(params, n, seed, 4.0, plan(n, seed, 4.0))) > 50


@pytest.mark.parametrize("succession", [True, False])
def test_twin_when_the_initiator_is_lost(succession):
    params = RadioSimParams(session=SessionParams(succession=succession))
    switches = [(0, k, 5 * k + 1, 0.001 * k) for k in range(4)]
    switches += [(80, 0, None, 0.0), (200, 1, None, 0.0), (290, 0, 9, 0.0037), (330, 1, 9, 0.0081)]
    assert len(compare(params, 4, 21, 4.0, switches)) > 500


def test_environments_of_a_batch_are_alone():
    n, seeds = 4, [5, 6, 7]
    params = RadioSimParams(channel=LOSSY)
    wheres = [motion(n, seed) for seed in seeds]
    plans = [plan(n, seed, 2.0) for seed in seeds]

    def run(envs):
        radio, out = Radio(params, n, [seeds[e] for e in envs], DT), [[] for _ in envs]
        for w in range(200):
            for place, e in enumerate(envs):
                for _, k, boot, at in [s for s in plans[e] if s[0] == w]:
                    if boot is None:
                        radio.switch_off(place, k)
                    else:
                        radio.switch_on(place, k, boot=boot, after=at)
            pos = [np.stack([wheres[e]((w + k) * DT) for e in envs]) for k in (0, 1)]
            ranges = radio.step(*pos, np.repeat(BOXES[None], len(envs), axis=0))
            for place in range(len(envs)):
                count = ranges.count[place]
                out[place].append(
                    [a[place, :count].tolist() for a in (ranges.t, ranges.i, ranges.values)]
                )
        return out, radio

    together, batch = run([0, 1, 2])
    for e in range(3):
        alone, radio = run([e])
        assert alone[0] == together[e]
        assert sum(len(window[0]) for window in alone[0]) > 50
        for name in ("nodes", "sessions", "peers", "latents", "flights"):
            np.testing.assert_array_equal(
                getattr(radio._air, name)[0], getattr(batch._air, name)[e], err_msg=name
            )
