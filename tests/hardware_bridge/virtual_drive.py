"""A drive on emulated cars in simulated time, with access for tests to observe and disturb."""

from collections import deque

import numpy as np

from agents.comparison.contender import find_entry
from agents.hardware.emulate.virtual import VirtualBridge
from hardware_bridge.emulator.fault_plan import Fault
from hardware_bridge.emulator.ports import MemoryPort
from hardware_bridge.live.env import HardwareFormationEnv


class WatchedLine(MemoryPort):
    """A line that stores the last bytes sent, and on which tests can tamper or inject."""

    def __init__(self, name, drive):
        super().__init__()
        self._name, self._drive = name, drive
        self.last = b""
        """Last bytes sent by the bridge to a car."""

    def receive(self):
        return self._drive.tamper(self._name, super().receive())

    def send(self, data):
        self.last = data or self.last
        super().send(data)

    def slip_in(self, data):
        """Inject bytes that are not from the bridge."""
        super().send(data)


class VirtualDrive:
    """A driver on a `VirtualBridge`, inserted between the environment and the bridge's feed."""

    def __init__(self, options, name="consensus"):
        self.tamper = lambda name, data: data
        """Function from name and received bytes of a line to the bytes that are passed on."""
        self.gate = deque(maxlen=1000)
        """Time of a tick [ns] and output of the gate."""
        self.errors = []
        """[m] Mean error of relative positions after every control step."""
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
        """Arm the cars, and let them localise each other."""
        self._seen, _ = self.env.reset()
        return self

    def drive(self, seconds):
        """Continue for some seconds."""
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
        """Send an order of the operator."""
        self.feed.order(what)

    def befall(self, kind, target, seconds):
        """Inject a fault."""
        world = self.rig.world
        fault = Fault(t=max(world.t, 0.0), kind=kind, target=target, seconds=seconds)
        self.rig.emulator._befall(fault, world.t)

    def _attend(self):
        self.gate.append((self.t_ns, self.supervisor._output))

    def error(self):
        """Return the mean error of relative positions with status ok [m]; NaN if there are none."""
        pos = self.rig.world.swarm.state.pos_w[0]
        wrong = np.linalg.norm(self.swarm.view.pos[0] - (pos[None] - pos[:, None]), axis=-1)
        known = wrong[self.swarm.view.ok[0] & ~np.eye(len(pos), dtype=bool)]
        return float(known.mean()) if len(known) else np.nan

    @property
    def t_ns(self):
        """Current time [ns]."""
        return self.feed.t_ns

    @property
    def report(self):
        """Latest report of the gate."""
        return self.feed.report

    @property
    def notices(self):
        """Texts of notices to the user, without the given orders."""
        return [text for _, text in self.feed.notices if text != "arm"]

    @property
    def armed(self):
        return self.report.armed.astype(bool).tolist()

    @property
    def places(self):
        """True positions of the cars, (car, 2) [m]."""
        return self.rig.world.swarm.state.pos_w[0].copy()

    def sent(self):
        """Return the last bytes sent to each car, by the name of its line."""
        return {name: port.last for name, port in self.rig.ports.items() if name[:3] == "car"}

    def close(self):
        self.bridge.close()
