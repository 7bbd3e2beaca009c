"""A car whose computer decides for it alone: configuration, motion of the others, limits."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from safety_group import check, picture

from agents.hardware.emulate import EmulatedRig, EmulateOptions
from agents.hardware.emulate.rig import STEP_NS
from agents.hardware.emulate.world import STEPS
from hardware_bridge.config import alone, known_by, parse_config
from hardware_bridge.emulator.ports import MemoryPort
from hardware_bridge.errors import BridgeError
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.swarm import LiveSwarm
from hardware_bridge.readings import (
    MICROSECONDS_32,
    ImuReading,
    PeerReading,
    RangeReading,
    Source,
)
from hardware_bridge.safety.geometry.braking import stopping_way
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.wire.encoder import RelposEncoder
from relpos_env.config import configure
from relpos_env.core.env_core import EnvCore
from tracking.measurements import Kind

S = 1_000_000_000
LEVEL = (1.0, 0.0, 0.0, 0.0)


def config_of(task="hold", command="plan"):
    text = f'calibration.uncalibrated = true\ntask.name = "{task}"\ntask.command = "{command}"\n'
    for node in (1, 2, 3):
        text += f"""
[nodes.{node}]
[antennas.{node}]
node = {node}
offset_m = [0.0, 0.0, 0.1]
[cars.{node}]
port = "/dev/car{node}"
driver = "relpos"
"""
    text += '[links.own]\nport = "/dev/n2"\nformat = "relpos"\n'
    return parse_config(text, file="swarm.toml", folder=Path())


def says(swarm, t_ns, *readings, node=2, sequence=0):
    encoder = RelposEncoder(node, 5)
    encoder.sequence = sequence
    source = Source(ticks=t_ns // 1000, clock=MICROSECONDS_32)
    swarm.take(
        Chunk("links.own", t_ns, encoder.encode([r._replace(source=source) for r in readings]))
    )


def peer(of, age=0.02, accel=(0.0, 0.0, 0.0), noise=0.0):
    return PeerReading(Source(), str(of), age, LEVEL, accel, noise)


def rows(swarm):
    taken = []
    swarm.tap = lambda block: taken.extend(
        (int(block.kind[0, m]), int(block.i[0, m]), float(block.t[0, m]), block.values[0, m].copy())
        for m in np.flatnonzero(block.valid[0])
    )
    return taken


def test_only_its_own_car_is_driven_and_the_others_have_half_of_the_way():
    config = alone(config_of(), 2)
    assert [car.node for car in config.cars] == [2]
    assert config.safety.others_drive
    assert config.n_slots == 3


@pytest.mark.parametrize(
    ("config", "node", "said"),
    [
        (config_of(), 7, r"^--node: expected a node that moves \(1, 2, 3\), got 7"),
        (config_of("ring"), 2, "^task.name: .* expects one of hold, .*, got 'ring'"),
        (config_of("seek"), 1, "^--node: expected another one than 1, which the others"),
        (config_of(command="link"), 2, '^task.command: .* expects "plan"'),
    ],
)
def test_what_computers_cannot_share_is_refused(config, node, said):
    with pytest.raises(BridgeError, match=said):
        alone(config, node)


def test_listening_alone_needs_no_car_and_no_certain_task():
    config = known_by(replace(config_of("ring"), cars=()), 2)
    assert config.alone == 2
    with pytest.raises(BridgeError, match="^--node: expected a node that moves"):
        known_by(config_of(), 4)


def test_motion_of_others_is_a_state_at_its_own_time():
    swarm = LiveSwarm(alone(config_of(), 2), 0)
    taken = rows(swarm)
    says(swarm, S, peer(3, 0.05, (0.5, -0.25, 0.0), 0.125))
    swarm.step(S)
    ((kind, node, t, values),) = [row for row in taken if row[0] == Kind.STATE]
    assert (kind, node) == (Kind.STATE, 2)
    assert t == pytest.approx(0.95, abs=1e-3)
    np.testing.assert_allclose(values[:8], [*LEVEL, 0.5, -0.25, 0.0, 0.125], atol=1e-3)
    assert set(swarm.intake.received_ns) == {1, 2}  # indices of nodes 2 and 3
    assert not swarm.intake.sensed_ns


def test_a_car_at_rest_is_not_a_stuck_sensor():
    swarm = LiveSwarm(alone(config_of(), 2), 0)
    taken = rows(swarm)
    for k in range(100):
        says(swarm, S + k * S // 50, peer(1), sequence=k)
    swarm.step(4 * S)
    assert sum(row[0] == Kind.STATE for row in taken) == 100
    assert not swarm.intake.refused


@pytest.mark.parametrize(
    ("readings", "node"),
    [
        ([peer(2)], 2),  # of itself
        ([peer(9)], 2),  # of no node of the group
        ([peer(1)], 3),  # by another node than the own
        ([PeerReading(Source(), "1", 0.0, LEVEL, (400.0, 0.0, 0.0))], 2),  # impossible
        ([peer(1, age=1.5)], 2),  # too old
    ],
)
def test_other_motions_are_not_used(readings, node):
    swarm = LiveSwarm(alone(config_of(), 2), 0)
    taken = rows(swarm)
    says(swarm, S, *readings, node=node)
    swarm.step(S)
    assert not [row for row in taken if row[0] == Kind.STATE]


def test_measurements_of_other_nodes_are_not_what_the_own_radio_received():
    swarm = LiveSwarm(alone(config_of(), 2), 0)
    taken = rows(swarm)
    sample = ImuReading(Source(), (0.0,) * 3, (0.0, 0.0, 9.8))
    says(swarm, S, sample, RangeReading(Source(), "2", 1.5), node=1)
    says(swarm, S, sample, RangeReading(Source(), "3", 2.5, nearer="1"))
    swarm.step(S)
    assert sorted(row[:2] for row in taken if row[0] in (Kind.IMU, Kind.RANGE)) == [
        (Kind.IMU, 1), (Kind.RANGE, 0)
    ]  # fmt: skip
    assert swarm.intake.refused["other_node"] == 2


def test_old_motion_does_not_keep_a_silent_node():
    swarm = LiveSwarm(alone(config_of(), 2), 0)
    says(swarm, 2 * S, peer(1, age=0.5))
    assert swarm.intake.received_ns[0] == pytest.approx(1.5 * S, abs=1e6)
    says(swarm, 2 * S + 1000, peer(1, age=0.9), sequence=1)
    assert swarm.intake.received_ns[0] == pytest.approx(1.5 * S, abs=1e6)


def test_a_host_of_the_group_uses_the_samples_instead():
    swarm = LiveSwarm(config_of(), 0)
    taken = rows(swarm)
    says(swarm, S, ImuReading(Source(), (0.0,) * 3, (0.0, 0.0, 9.8)), peer(1))
    swarm.step(S)
    assert {row[0] for row in taken if row[0] in (Kind.IMU, Kind.STATE)} == {Kind.IMU}


def test_two_cars_with_gates_of_their_own_do_not_use_the_same_way():
    """From rest each would take the whole way, since the other does not move."""
    q = picture(spacing=3.0)
    q.heading[0] = 0.0, np.pi  # towards each other
    mine = np.array([[True, False]])
    p = SafetyParams(others_drive=True)
    free, own = (check("separation", q, each, armed=mine) for each in (SafetyParams(), p))
    ways = [stopping_way(v.forward[0, 0], p.reaction, p.braking) for v in (free, own)]
    assert ways[1] == pytest.approx(0.5 * ways[0], rel=0.02)
    # Next to a car that comes nearer by itself, what it needs is left, too.
    q.vel[0, 0, 1] = -1.5, 0.0
    free, own = (check("separation", q, each, armed=mine) for each in (SafetyParams(), p))
    assert own.forward[0, 0] <= free.forward[0, 0]


class Computers:
    """An emulation with a computer on each car, on a virtual clock; the cars drive circles."""

    def __init__(self, scenario, seed):
        options = EmulateOptions(
            scenario=scenario, task="hold", cars=3, seed=seed, seconds=40.0, trackers="own"
        )
        self.rig = EmulatedRig(options, ports=lambda name: MemoryPort())
        self.swarms = {}
        for node in self.rig.constellation.ids:
            text = self.rig.swarm_toml(Path("/virtual"), node)
            config = parse_config(text, file="swarm.toml", folder=Path())
            self.swarms[node] = LiveSwarm(alone(config, node), 0)
        self.t_ns = 0

    def decide(self, speed, steering):
        for _ in range(STEPS):
            for k, car in enumerate(self.rig.emulator.cars):
                car.listen = lambda t, t_ns, k=k: (speed[k], steering[k])
            self.t_ns += STEP_NS
            self.rig.step(self.t_ns)
            for node, swarm in self.swarms.items():
                if data := self.rig.ports[f"n{node}"].receive():
                    swarm.take(Chunk(f"links.n{node}", self.t_ns, data))
                self.rig.ports[f"car{node}"].receive()
        for swarm in self.swarms.values():
            swarm.step(self.t_ns)

    def errors(self):
        """Return the error of each car's own estimates of the others [m]; NaN if unknown."""
        pos = self.rig.world.swarm.state.pos_w[0]
        found = []
        for k, swarm in enumerate(self.swarms.values()):
            off = np.linalg.norm(swarm.view.pos[0, k] - (pos - pos[k]), axis=-1)
            found.append(np.where(swarm.view.ok[0, k], off, np.nan))
        return np.array(found)


def test_estimates_are_those_of_trackers_on_the_cars():
    """The simulation with `trackers="own"` is the twin: same world, other path of the data."""
    computers = Computers("ring-los", 4)
    parts = configure(
        {"scenario": "ring-los", "task": "hold", "n_cars": 3, "trackers": "own", "max_cycles": 400}
    )
    twin = EnvCore(parts)
    twin.seed(0, np.random.default_rng(4))
    twin.begin([0])
    rng, live, simulated = np.random.default_rng(0), [], []
    for k in range(260):
        if k % 10 == 0:
            speed, steering = rng.uniform(-0.5, 0.7, 3), rng.uniform(-0.4, 0.4, 3)
        computers.decide(speed, steering)
        twin.step(speed[None], steering[None])
        live.append(computers.errors())
        simulated.append(twin.tracking_error()[0])
    assert np.isfinite(live[200:]).mean() > 0.3
    assert np.nanmean(live[200:]) < 1.3 * np.nanmean(simulated[200:]) + 0.05
    for swarm in computers.swarms.values():
        assert not swarm.intake.refused
        assert swarm.n_late == 0


@pytest.mark.parametrize("task", ["ring", "seek", "inspect"])
def test_tasks_that_cannot_be_driven_so_are_refused(task):
    with pytest.raises(BridgeError, match=r"^task: (expected one of hold|'\w+' is not emulated)"):
        EmulateOptions(task=task, trackers="own")


def test_nodes_of_another_format_have_no_message_for_it():
    with pytest.raises(BridgeError, match="format: expected relpos with own trackers"):
        EmulateOptions(task="hold", trackers="own", format="linktrack")
    assert not EmulateOptions(task="hold", trackers="own").operator
