"""A whole drive in a time of its own: world, nodes, bytes, trackers, policy, gate, cars.

Everything that decides is what drives real cars; ports are lines in memory, and a clock that is
counted takes the place of the host's.
"""

from collections import deque

import numpy as np

from agents.compare.contender import find_entry
from agents.emulate import EmulatedRig
from agents.emulate.rig import STEP_NS
from agents.emulate.world import STEPS
from hardware_bridge.config import read_config
from hardware_bridge.drivers import make_driver
from hardware_bridge.emulator.fault_plan import Fault
from hardware_bridge.emulator.ports import MemoryPort
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.env import LiveFormationEnv
from hardware_bridge.live.start import Start, StartParams
from hardware_bridge.live.swarm import LiveSwarm
from hardware_bridge.safety.messages import Decision, Order, Word
from hardware_bridge.safety.supervisor import Supervisor

START_NS = 5_000_000_000_000


class VirtualDrive:
    """The feed of a `LiveGroup`, and all around it."""

    def __init__(self, options, folder, name="consensus"):
        self.rig = EmulatedRig(options, folder, ports=lambda name: MemoryPort())
        self.config = config = read_config(folder / "swarm.toml")
        self.t_ns = START_NS
        self.swarm = LiveSwarm(config, START_NS)
        self.drivers = {
            config.slot_of(car): make_driver(
                car.driver, car.node, car.options, car.key, 7, lambda: self.t_ns // 1000
            )
            for car in config.cars
        }
        self._ports = {config.slot_of(car): f"car{car.node}" for car in config.cars}
        self.supervisor = Supervisor(
            config.safety,
            config.n_slots,
            self.drivers,
            {k: f"cars.{config.constellation.ids[k]}" for k in self.drivers},
        )
        self.report = None
        self.notices = []
        self.tamper = lambda name, data: data
        """What comes from a port, as it is heard."""
        self.sent = {}
        """What each car was sent last, by slot."""
        self.gate = deque(maxlen=1000)
        """Time of a tick [ns] and what the gate let pass."""
        self.errors = []
        """Of what cars believe of each other, by the truth, mean after every decision [m]."""
        entry = find_entry(name)
        self._driver = entry.driver("estimate", config.n_slots, 0)
        start = Start(self, arm=True, params=StartParams(find=15.0))
        self.env = LiveFormationEnv(
            self.swarm, self, history=entry.history, max_cycles=1_000_000, prepare=start.run
        )
        self._seen = None

    def start(self):
        """Arm the cars, and let them find each other."""
        self._seen, _ = self.env.reset()
        return self

    def drive(self, seconds):
        """Go on for a while."""
        for _ in range(round(10 * seconds)):
            if not self.env.agents:
                self._seen, _ = self.env.reset()
            actions = {agent: self._driver.act(seen) for agent, seen in self._seen.items()}
            self._seen, *_ = self.env.step(actions)
        return self

    def advance(self):
        """See `hardware_bridge.live.group.Feed`."""
        for _ in range(STEPS):
            self._tick()
        self.report = self.supervisor.report()
        self.swarm.apply(self.report.speed, self.report.steering, self.report.armed)
        self.notices += [text for _, text in self.swarm.intake.notices]
        self.swarm.intake.notices.clear()
        self.errors.append(self.error())
        return self.t_ns

    def decide(self, picture):
        """See `hardware_bridge.live.group.Feed`."""
        self.supervisor.take(Decision(picture))

    def order(self, what):
        """What a person asks for."""
        self.notices += [notice.text for notice in self.supervisor.take(Order(what))]

    def befall(self, kind, target, seconds):
        """Let a fault happen now."""
        world = self.rig.world
        fault = Fault(t=max(world.t, 0.0), kind=kind, target=target, seconds=seconds)
        self.rig.emulator._befall(fault, world.t)

    def _tick(self):
        self.t_ns += STEP_NS
        self.rig.step(self.t_ns)
        cars = {name: slot for slot, name in self._ports.items()}
        for name, port in self.rig.ports.items():
            link = f"cars.{name[3:]}" if name in cars else f"links.{name}"
            if data := self.tamper(name, port.receive()):
                self.swarm.take(Chunk(link, self.t_ns, data))
        now = self.t_ns * 1e-9
        self.notices += [n.text for n in self.supervisor.take(Word(now, self.swarm.heard()))]
        up = [slot for slot, name in self._ports.items() if self.rig.ports[name].plugged]
        self.sent = self.supervisor.tick(now, 0.0, up)
        self.gate.append((self.t_ns, self.supervisor._output))
        for slot in up:
            self.rig.ports[self._ports[slot]].send(self.sent[slot] + self.drivers[slot].ask())
        self.notices += [notice.text for notice in self.supervisor.stopped()]

    def error(self):
        """Of the relative positions that cars can use, mean now [m]; NaN if there are none."""
        pos = self.rig.world.swarm.state.pos_w[0]
        wrong = np.linalg.norm(self.swarm.view.pos[0] - (pos[None] - pos[:, None]), axis=-1)
        known = wrong[self.swarm.view.ok[0] & ~np.eye(len(pos), dtype=bool)]
        return float(known.mean()) if len(known) else np.nan

    @property
    def armed(self):
        return self.report.armed.astype(bool).tolist()

    @property
    def places(self):
        """Where the cars are, (car, 2) [m]."""
        return self.rig.world.swarm.state.pos_w[0].copy()

    def close(self):
        self.rig.close()
