"""An emulation in real time in a separate process that records the commands of its cars.

    python emulation_process.py FOLDER '{"scenario": "cars-nlos", ...}'

One JSON line per step goes to FOLDER/heard.jsonl, bytes of devices to FOLDER/said, unless ``"keep":
false``; orders are JSON lines on stdin.
"""

import contextlib
import gc
import json
import os
import sys
import threading
import time
from pathlib import Path

from agents.hardware.emulate import EmulatedRig, EmulateOptions
from agents.hardware.emulate.pace import Pace
from agents.hardware.emulate.rig import STEP_NS
from agents.hardware.emulate.warm_up import warm_up
from hardware_bridge.emulator.fault_plan import Fault
from hardware_bridge.emulator.pty import PtyPort


class Tap(PtyPort):
    """A port that keeps all bytes its device has sent to the host."""

    def __init__(self, link, copy):
        self._copy = open(copy, "wb", buffering=0)  # noqa: SIM115
        super().__init__(link)

    def write(self, data):
        before = self.counts.written
        super().write(data)
        self._copy.write(data[: self.counts.written - before])


class Ears:
    """Commands that a car decoded since the last step."""

    def __init__(self, device):
        self.commands = []
        make = device._make

        def listening():
            car = make()
            feed = car.feed

            def heard(t_ns, data):
                commands = feed(t_ns, data)
                self.commands += [(t_ns, c.brake, c.speed) for c in commands]
                return commands

            car.feed = heard
            return car

        device._make, device._car = listening, listening()

    def take(self):
        commands, self.commands = self.commands, []
        return commands


def main(folder, options, keep):
    folder = Path(folder)
    warm_up(options)
    # High priority, if permitted, as a real device does not depend on the host's load.
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, -15)
    copies = folder / "said"
    copies.mkdir(parents=True)

    def port(name):
        link = folder / "rig" / name
        return Tap(link, copies / name) if keep else PtyPort(link)

    rig = EmulatedRig(options, folder / "rig", ports=port)
    orders = []
    thread = threading.Thread(target=listen, args=(orders,), daemon=True)
    thread.start()
    ears = [Ears(car) for car in rig.emulator.cars]
    gc.collect()
    gc.freeze()
    pace = Pace(STEP_NS, time.monotonic_ns, time.sleep)
    with open(folder / "heard.jsonl", "w", buffering=1) as heard:
        print(json.dumps({"ready": str(rig.folder / "swarm.toml")}), flush=True)
        while True:
            t_ns = pace.wait()
            while orders:
                order = orders.pop(0)
                if order is None:
                    rig.close()
                    return
                fault = Fault(t=max(rig.world.t, 0.0), **order)
                rig.emulator._befall(fault, rig.world.t)
                print(json.dumps({"befell": order, "t_ns": time.monotonic_ns()}), flush=True)
            rig.step(t_ns)
            state = rig.world.swarm.state
            line = {
                "t_ns": t_ns,
                "heard": [ear.take() for ear in ears],
                "motor": [float(v) for v in rig.emulator._speed],
                "speed": [round(float(v), 4) for v in state.speed[0]],
                "late": pace.lateness.late,
            }
            if keep:
                heard.write(json.dumps(line) + "\n")


def listen(orders):
    """Append orders from the lines of stdin; None at its end."""
    for line in sys.stdin:
        orders.append(json.loads(line))
    orders.append(None)


if __name__ == "__main__":
    chosen = json.loads(sys.argv[2])
    keeps = chosen.pop("keep", True)
    main(sys.argv[1], EmulateOptions(**chosen), keeps)
