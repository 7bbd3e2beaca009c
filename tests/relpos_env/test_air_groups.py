"""Large groups whose tables are split, and groups that share the air."""

from dataclasses import replace

import numpy as np
import pytest

from relpos_env.errors import EnvError
from relpos_env.sensors.radio.air import Air
from relpos_env.sensors.radio.channel import EXACT
from relpos_env.sensors.radio.params import RadioSimParams
from tracking.errors import ConfigError
from tracking.ranging import RangeEvent, SessionParams
from tracking.ranging.frames.airtime import FAST_PHY, PAPER_PHY

DT = 0.01
NOISY = replace(EXACT, stamp_std=156e-12)


def group(n, phy, seed=3):
    air = Air(RadioSimParams(channel=NOISY, session=SessionParams(phy=phy)), n, seed, DT)
    pos = np.random.default_rng(seed).uniform(-3.0, 3.0, (n, 3))
    for k in range(n):
        air.switch_on(k, boot=11 * k + 5, at=0.0004 * k)
    return air, pos


def run(air, pos, seconds):
    for _ in range(round(seconds / DT)):
        air.step(pos, pos)


@pytest.mark.parametrize("n", [15, 16, 20])
def test_every_node_knows_every_pair_also_when_tables_are_split(n):
    air, pos = group(n, FAST_PHY)
    run(air, pos, 2.0)
    assert all(s.members == tuple(range(n)) for s in air.sessions)
    air.events.clear()
    run(air, pos, 0.3)
    found = [t for t in air.events if isinstance(t.event, RangeEvent)]
    known = {(t.node, t.event.i, t.event.j) for t in found}
    assert len(known) == n * n * (n - 1) // 2
    true = np.linalg.norm(pos[:, None] - pos[None], axis=-1)
    error = np.array([t.event.distance - true[t.event.i, t.event.j] for t in found])
    assert error.std() < 0.035
    assert np.abs(error).max() < 0.2


def test_groups_of_different_numbers_take_turns_in_one_air():
    params = RadioSimParams(channel=EXACT)
    air, pos = Air(params, 6, 4, DT), np.random.default_rng(4).uniform(-3.0, 3.0, (6, 3))
    for k in range(6):
        air.switch_on(k, boot=k + 1, at=0.001 * k)
    other = replace(params.session, pan=1)
    for k, (at, node, session) in enumerate(air._switch):
        if node >= 3:
            air._switch[k] = (at, node, type(session)(node, other, boot=node))
    run(air, pos, 10.0)
    for members in ({0, 1, 2}, {3, 4, 5}):
        told = [t for t in air.events if t.node in members and isinstance(t.event, RangeEvent)]
        assert len(told) > 600  # each group alone would have 7000; they alternate
        assert all({t.event.i, t.event.j} <= members for t in told)


def test_settings_that_make_no_sense_are_named():
    for name, value in (
        ("pan", 70000), ("watchdog", 20.0), ("takeover", float("nan")), ("listen", (0.06, 0.04)),
        ("drop_after", 0), ("antenna_delay", 0.5),
    ):  # fmt: skip
        with pytest.raises(ConfigError, match=name):
            SessionParams(**{name: value})
    for name, value in (("max_frame", 20), ("max_frame", 2000), ("sense", 1e-6)):
        with pytest.raises(ConfigError, match=name):
            replace(PAPER_PHY, **{name: value})
    with pytest.raises(EnvError, match="at most 64"):
        Air(RadioSimParams(), 65, 0, DT)
