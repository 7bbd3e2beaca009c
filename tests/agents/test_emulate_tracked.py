"""With the bytes of any format a live tracker is as accurate as that of the simulation."""

import numpy as np
import pytest

from agents.hardware.emulate import EmulatedRig, EmulateOptions
from agents.hardware.emulate.rig import STEP_NS
from agents.hardware.emulate.world import AT_REST, STEPS
from hardware_bridge.config import read_config
from hardware_bridge.drivers import make_driver
from hardware_bridge.emulator.ports import MemoryPort
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.swarm import LiveSwarm
from relpos_env.core.env_core import EnvCore

SETTLED = 40
"""[-] Steps after which errors are compared."""


def known_mean(values):
    known = values[np.isfinite(values)]
    return known.mean() if len(known) else np.nan


class Live:
    """A rig and its live tracker, on a virtual clock."""

    def __init__(self, options, folder):
        self.rig = EmulatedRig(options, folder / "new", ports=lambda name: MemoryPort())
        self.swarm = LiveSwarm(read_config(folder / "new" / "swarm.toml"), 0)
        self.drivers = {
            f"car{k}": make_driver(options.driver, k, {}, None, 7, lambda: 0)
            for k in self.rig.constellation.ids
        }
        self.t_ns = 0

    def decide(self, speed, steering):
        for _ in range(STEPS):
            for (name, driver), v, angle in zip(self.drivers.items(), speed, steering, strict=True):
                self.rig.ports[name].send(driver.drive(float(v), float(angle)) + driver.ask())
            self.t_ns += STEP_NS
            self.rig.step(self.t_ns)
            for name, port in self.rig.ports.items():
                link = f"cars.{name[3:]}" if name in self.drivers else f"links.{name}"
                if data := port.receive():
                    self.swarm.take(Chunk(link, self.t_ns, data))
        self.swarm.step(self.t_ns)

    def error(self):
        """Return the mean error of the relative positions that cars can use [m]."""
        pos = self.rig.world.swarm.state.pos_w[0]
        wrong = np.linalg.norm(self.swarm.view.pos[0] - (pos[None] - pos[:, None]), axis=-1)
        known = self.swarm.view.ok[0]
        return known_mean(np.where(known, wrong, np.nan))


def follow(formation):
    """Return speeds and steering angles for the operator's command, rounded as on the wire."""
    wish, heading = formation.operator.command[0], formation.state.heading[0]
    turn = np.arctan2(wish[:, 1], wish[:, 0]) - heading
    turn = (turn + np.pi) % (2.0 * np.pi) - np.pi
    speed = np.minimum(np.hypot(wish[:, 0], wish[:, 1]), 1.0).round(3)
    return speed, np.clip(turn, -0.42, 0.42).round(4)


@pytest.mark.parametrize("form", ["relpos", "linktrack", "uwb-core", "dw1000"])
def test_a_live_tracker_knows_what_that_of_the_simulation_knows(form, tmp_path):
    options = EmulateOptions(seed=3, seconds=12.0, format=form)
    live, formation = Live(options, tmp_path), EnvCore(options.parts())
    formation.seed(0, np.random.default_rng(options.seed))
    formation.begin([0])
    n = live.rig.world.parts.n_cars
    for _ in range(AT_REST // STEPS):
        live.decide(np.zeros(n), np.zeros(n))
    errors = []
    for _ in range(options.cycles):
        speed, steering = follow(formation)
        formation.step(speed[None], steering[None])
        live.decide(speed, steering)
        errors.append((live.error(), known_mean(formation.tracking_error()[0])))
    np.testing.assert_array_equal(live.rig.world.swarm.state.pos_w, formation.state.pos_w)
    here, there = np.nanmean(errors[SETTLED:], axis=0)
    assert here < 1.3 * there + 0.02
    intake = live.swarm.intake
    assert not intake.notices
    assert sum(intake.refused.values()) < 20
    assert all(s.decoder.counts.damaged == 0 for s in intake.streams.values())
    live.rig.close()
