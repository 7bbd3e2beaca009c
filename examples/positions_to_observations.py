"""A motion capture in the place of our tracker: lines of positions in, observations out."""

import json
import math
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from agents.controllers import Consensus
from hardware_bridge.config import read_config
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.env import HardwareFormationEnv
from hardware_bridge.live.swarm import LiveSwarm

SWARM = """
[nodes.1]
[nodes.2]
[nodes.3]
[links.mocap]
port = "file:positions.jsonl"
format = "positions"
[task]
name = "ring"
[tracker]
source = "positions"
"""
NOISE = 0.002  # m, of the motion capture


def circles(t):
    """Place and heading of every car: one circle, counter-clockwise at 1.2 m/s."""
    angle = 0.8 * t + np.array([0.0, 2.1, 4.2])
    return np.array([np.cos(angle), np.sin(angle)]).T * 1.5, angle + math.pi / 2


def write_lines(path, seconds, hz=100):
    """What a motion capture would write."""
    rng = np.random.default_rng(0)
    with path.open("w") as file:
        for k in range(round(seconds * hz)):
            places, headings = circles(k / hz)
            for car, (place, yaw) in enumerate(zip(places, headings, strict=True), start=1):
                pos = (place + NOISE * rng.normal(size=2)).tolist()
                said = {"time": round(1e6 * k / hz), "node": car, "pos": pos, "yaw": yaw}
                file.write(json.dumps(said) + "\n")


class LinesInTheirTime:
    """A finished file, at the pace of its own times; a port would be read in real time."""

    def __init__(self, swarm, path):
        self.swarm, self.lines, self.t_ns = swarm, path.read_bytes().splitlines(True), 0

    def advance(self):
        """Until the next decision, a tenth of a second later; None at the end."""
        self.t_ns += 100_000_000
        while self.lines:
            t_ns = 1000 * json.loads(self.lines[0])["time"]
            if t_ns > self.t_ns:
                return self.t_ns
            self.swarm.take(Chunk("links.mocap", t_ns, self.lines.pop(0)))
        return None

    def decide(self, picture):
        """Where cars are driven, this goes to the gate."""


with TemporaryDirectory() as folder:
    file = Path(folder) / "swarm.toml"
    file.write_text(SWARM)
    write_lines(Path(folder) / "positions.jsonl", seconds=3.0)
    swarm = LiveSwarm(read_config(file), start_ns=0)
    feed = LinesInTheirTime(swarm, Path(folder) / "positions.jsonl")
    env = HardwareFormationEnv(swarm, feed)
    controller = Consensus(env.fields)
    observations, _ = env.reset()
    for _ in range(25):
        actions = {agent: controller.act(each) for agent, each in observations.items()}
        observations, *_ = env.step(actions)

places, _ = circles(feed.t_ns * 1e-9)
pos, vel = swarm.view.pos[0, 0], swarm.view.vel[0, 0]
error = np.abs(pos[1:] - (places[1:] - places[0])).max()
print(f"observations of {len(observations['car_0'])} numbers for {len(observations)} cars")
print(f"car 2 is {pos[1].round(2)} m from car 1, its relative velocity {vel[1].round(2)} m/s")
print(f"largest error {1000 * error:.1f} mm; next action of car 1 {actions['car_0'].round(2)}")
