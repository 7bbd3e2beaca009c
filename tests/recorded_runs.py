"""Live runs on the emulator's byte streams, without an operating system, on a virtual clock."""

import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from agents.hardware.emulate import EmulatedRig, EmulateOptions
from agents.hardware.emulate.rig import STEP_NS
from agents.hardware.live.history import History
from hardware_bridge.config import read_config
from hardware_bridge.drivers import make_driver
from hardware_bridge.emulator.ports import MemoryPort
from hardware_bridge.links.link_state import LinkNotice
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.feed import LiveFeed
from hardware_bridge.live.swarm import LiveSwarm, load_calibration
from hardware_bridge.recording import Header, Recorder
from tracking.calibration.file import calibration_toml

START = 5 * 10**12
WALL = 1_700_000_000 * 10**9


class RigLinks:
    """Replacement of `Links`: time passes in `wait`, in which the rig advances and cars drive."""

    def __init__(self, rig: EmulatedRig, config, seed: int):
        self.rig, self.now = rig, START
        self._names = {link.port.name: link.name for link in config.links}
        self._rng = np.random.default_rng(seed)
        self._kept = dict.fromkeys(self._names, b"")
        self._drivers = [
            (f"car{car.node}", make_driver(car.driver, car.node, {}, None, 7, lambda: 0))
            for car in config.cars
        ]
        self._notices = [LinkNotice(name, START, True) for name in self._names]
        self._up = dict.fromkeys(self._names, True)
        self._next = START + STEP_NS

    def clock(self) -> int:
        return self.now

    def wait(self, timeout: float) -> list[Chunk]:
        self.now += round(timeout * 1e9)
        while self._next <= self.now:
            for k, (port, driver) in enumerate(self._drivers):
                turn = 0.3 * (-1) ** k
                self.rig.ports[port].send(driver.drive(0.8, turn))
            self.rig.step(self._next)
            self._next += STEP_NS
        chunks = []
        for name, port in self._names.items():
            data = self._kept[name] + self.rig.ports[port].receive()
            # A read returns any part of the sent bytes.
            n = len(data) if self._rng.random() < 0.7 else int(self._rng.integers(len(data) + 1))
            self._kept[name] = data[n:]
            if n:
                chunks.append(Chunk(name, self.now, data[:n]))
            up = self.rig.ports[port].plugged
            if up != self._up[name]:
                self._up[name] = up
                self._notices.append(LinkNotice(name, self.now, up, "" if up else "unplugged"))
            self.now += 1234
        return chunks

    def drain_notices(self):
        notices, self._notices = self._notices, []
        return notices


@dataclass
class LiveRun:
    """Results of a live run, and its recording."""

    path: Path
    config: object
    estimate: object
    t_ns: np.ndarray
    notices: list[tuple[int, str]]
    refused: dict
    recorder: Recorder
    rig: EmulatedRig
    n_late: int = 0
    log: object = None
    views: list = field(default_factory=list)


def run_live(
    folder: Path,
    options: EmulateOptions,
    decisions: int,
    *,
    seed: int = 0,
    write=os.write,
    record_truth: bool = False,
    edit=lambda text: text,
) -> LiveRun:
    """Track an emulation step by step, as `agents.hardware.live.live` does."""
    (folder / "e").mkdir(parents=True)
    rig = EmulatedRig(options, folder / "e", ports=lambda name: MemoryPort(), record=record_truth)
    file = folder / "e" / "swarm.toml"
    file.write_text(edit(file.read_text()))
    config = read_config(file)
    links = RigLinks(rig, config, seed)
    calibration = load_calibration(config)
    swarm, history = LiveSwarm(config, START, calibration), History(config.constellation)
    header = Header(
        software="test", config=config.text, links=tuple(swarm.intake.streams),
        monotonic_ns=START, wall_ns=WALL,
    )  # fmt: skip
    path = folder / "run.rec"
    recorder = Recorder(path, header, write=write, clock=lambda: links.now * 1e-9)
    if calibration is not None:
        recorder.add_event(START, "calibration", text=calibration_toml(calibration))
    recorder.add_event(START, "start")
    feed = LiveFeed(swarm, links, links.clock, recorder=recorder)
    notices, views = [], []
    for _ in range(decisions):
        t_ns = feed.advance()
        swarm.step(t_ns)
        history.add(t_ns, swarm.estimate)
        views.append([array.copy() for array in swarm.view])
        notices += feed.notices
        feed.notices.clear()
        recorder.flush()
    recorder.close()
    rig.close()
    log = None
    if record_truth:
        world = rig.world
        log = world.recording.to_log("truth", world.parts.scenario.name, rig.constellation,
                                     truth_every=2)  # fmt: skip
    return LiveRun(
        path, config, history.estimate, history.t_ns, notices, dict(swarm.intake.refused),
        recorder, rig, feed.n_late, log, views,
    )  # fmt: skip


def same_bits(here, there, n: int | None = None) -> None:
    """Assert that estimates over (time, ...) are equal, up to the n-th time."""
    here, there = (here.t, *here.arrays), (there.t, *there.arrays)
    for a, b in zip(here, there, strict=True):
        assert a.dtype == b.dtype
        assert a[:n].tobytes() == b[:n].tobytes()
