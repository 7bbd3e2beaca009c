"""A drive on emulated cars in a time of its own, and what tests see of it and do to it."""

from collections import deque

import numpy as np

from agents.comparison.contender import find_entry
from agents.hardware.emulate.virtual import VirtualBridge
from hardware_bridge.emulator.fault_plan import Fault
from hardware_bridge.emulator.ports import MemoryPort
from hardware_bridge.live.env import HardwareFormationEnv


class WatchedLine(MemoryPort):
    """A line on which something else may be heard, and which knows what it carried last."""

    def __init__(self, name, drive):
        super().__init__()
        self._name, self._drive = name, drive
        self.last = b""
        """What the bridge sent last, to a car."""

    def receive(self):
        return self._drive.tamper(self._name, super().receive())

    def send(self, data):
        self.last = data or self.last
        super().send(data)

    def slip_in(self, data):
        """Send what is not the bridge's."""
        super().send(data)


class VirtualDrive:
    """A driver on a `VirtualBridge`; it stands between the environment and the bridge's feed."""

    def __init__(self, options, name="consensus"):
        self.tamper = lambda name, data: data
        """What comes over a line, as it is heard."""
        self.gate = deque(maxlen=1000)
        """Time of a tick [ns] and what the gate let pass."""
        self.errors = []
        """Of what cars believe of each other, by the truth, mean after every decision [m]."""
        self.bridge = VirtualBridge(options, ports=lambda name: WatchedLine(name, self))
        self.rig, self.swarm, self.feed = self.bridge.rig, self.bridge.swarm, self.bridge.feed
        self.supervisor = self.feed.supervisor
        self.feed.attend = self._attend
        entry = find_entry(name)
        self._driver = entry.driver("estimate", self.bridge.config.n_slots, 0)
        self.env = HardwareFormationEnv(
            self.swarm,
            self,
            history=entry.history,
            max_cycles=1_000_000,
            prepare=self.bridge.start.run,
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
        t_ns = self.feed.advance()
        self.errors.append(self.error())
        return t_ns

    def decide(self, picture):
        """See `hardware_bridge.live.group.Feed`."""
        self.feed.decide(picture)

    def order(self, what):
        """What a person asks for."""
        self.feed.order(what)

    def befall(self, kind, target, seconds):
        """Let a fault happen now."""
        world = self.rig.world
        fault = Fault(t=max(world.t, 0.0), kind=kind, target=target, seconds=seconds)
        self.rig.emulator._befall(fault, world.t)

    def _attend(self):
        self.gate.append((self.t_ns, self.supervisor._output))

    def error(self):
        """Of the relative positions that cars can use, mean now [m]; NaN if there are none."""
        pos = self.rig.world.swarm.state.pos_w[0]
        wrong = np.linalg.norm(self.swarm.view.pos[0] - (pos[None] - pos[:, None]), axis=-1)
        known = wrong[self.swarm.view.ok[0] & ~np.eye(len(pos), dtype=bool)]
        return float(known.mean()) if len(known) else np.nan

    @property
    def t_ns(self):
        """Now [ns]."""
        return self.feed.t_ns

    @property
    def report(self):
        """What the gate did, the latest."""
        return self.feed.report

    @property
    def notices(self):
        """What the user is to read, but for the orders that were given."""
        return [text for _, text in self.feed.notices if text != "arm"]

    @property
    def armed(self):
        return self.report.armed.astype(bool).tolist()

    @property
    def places(self):
        """Where the cars are, (car, 2) [m]."""
        return self.rig.world.swarm.state.pos_w[0].copy()

    def sent(self):
        """What each car was sent last, by the name of its line."""
        return {name: port.last for name, port in self.rig.ports.items() if name[:3] == "car"}

    def close(self):
        self.bridge.close()
