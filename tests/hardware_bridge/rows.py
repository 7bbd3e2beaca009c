"""Emulation and drive as processes that tests control and observe."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
MS = 1_000_000


class Talking:
    """A process that prints and reads JSON lines."""

    def __init__(self, script, *args):
        env = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
        self.process = subprocess.Popen(
            [sys.executable, str(HERE / script), *map(str, args)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=env,
        )
        self.said = []
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _listen(self):
        for line in self.process.stdout:
            with self._changed:
                self.said.append(json.loads(line))
                self._changed.notify_all()
        with self._changed:
            self._changed.notify_all()

    def tell(self, **order):
        """Send an order; return a time before its reception [ns]."""
        t_ns = time.monotonic_ns()
        self.process.stdin.write(json.dumps(order) + "\n")
        self.process.stdin.flush()
        return t_ns

    def wait_for(self, fits, seconds=60.0, since=0):
        """Return the first line at or after a time [ns] that satisfies `fits`."""
        end, k = time.monotonic() + seconds, 0
        with self._changed:
            while True:
                while k < len(self.said):
                    line = self.said[k]
                    k += 1
                    if line.get("t_ns", 0) >= since and fits(line):
                        return line
                left = end - time.monotonic()
                over = self.process.poll() is not None and not self._thread.is_alive()
                assert left > 0 and not over, (  # noqa: PT018
                    f"it did not happen; last: {self.said[-5:]}"
                )
                self._changed.wait(min(left, 0.2))

    def between(self, start, end, key):
        """Return the lines between two times [ns] that have a key."""
        return [s for s in list(self.said) if key in s and start <= s["t_ns"] <= end]

    def close(self):
        if self.process.poll() is None:
            self.process.stdin.close()
            try:
                self.process.wait(5.0)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        elif not self.process.stdin.closed:
            with contextlib.suppress(BrokenPipeError):
                self.process.stdin.close()
        self._thread.join()
        self.process.stdout.close()


class Emulation(Talking):
    """Cars at pseudo terminals, and the commands they receive."""

    def __init__(self, folder, **options):
        super().__init__("emulation_process.py", folder, json.dumps(options))
        self.folder = folder
        self._file, self._steps, self._rest = None, [], ""
        self.config = Path(self.wait_for(lambda s: "ready" in s)["ready"])
        self._file = open(folder / "heard.jsonl")  # noqa: SIM115

    def befall(self, kind, target, seconds):
        """Inject a fault; return its time [ns]."""
        t_ns = self.tell(kind=kind, target=target, seconds=seconds)
        return self.wait_for(lambda s: "befell" in s, since=t_ns)["t_ns"]

    @property
    def steps(self):
        """Commands received in every step so far."""
        text = self._rest + self._file.read()
        *lines, self._rest = text.split("\n")
        self._steps += [json.loads(line) for line in lines]
        return self._steps

    def commands(self, car, start, end=None):
        """Return time [ns], brake and speed of each command to a car."""
        commands = [c for s in self.steps if s["t_ns"] >= start for c in s["heard"][car]]
        return [c for c in commands if c[0] >= start and (end is None or c[0] <= end)]

    def first_brake(self, start, cars=range(3)):
        """Return when the last of the cars received its first stop command after a time [ns]."""
        return max(
            min((t for t, brake, _ in self.commands(k, start) if brake), default=1 << 62)
            for k in cars
        )

    def motors(self, start, end):
        """Return the highest speed that a car's controller requested of each motor [m/s]."""
        rows = [s["motor"] for s in self.steps if start <= s["t_ns"] <= end]
        return [max(map(abs, column)) for column in zip(*rows, strict=True)]

    def last_turn(self, start):
        """Return the last time [ns] at or after `start` when any motor turned."""
        return max((s["t_ns"] for s in self.steps if s["t_ns"] >= start and any(s["motor"])),
                   default=start)  # fmt: skip

    def close(self):
        super().close()
        if self._file is not None:
            self._file.close()


class Drive(Talking):
    """A drive of a policy on these cars."""

    def __init__(self, config, **options):
        super().__init__("drive_process.py", config, json.dumps({"seconds": 300.0, **options}))
        self.supervisor = self.wait_for(lambda s: "supervisor" in s)["supervisor"]

    def moving(self, since=0, cars=range(3), seconds=60.0):
        """Wait until the cars are armed."""
        return self.wait_for(
            lambda s: "armed" in s and all(s["armed"][k] for k in cars), seconds, since
        )

    def arm(self, cars=range(3)):
        """Arm cars as soon as possible; return the time when they are armed [ns]."""
        since = time.monotonic_ns()
        self.wait_for(
            lambda s: (
                "armed" in s
                and not all(s["armed"][k] for k in cars)
                and min(s["well_for"][k] for k in cars) > 0.55
            ),
            since=since,
        )
        return self.moving(self.tell(order="arm"), cars)["t_ns"]

    def signal(self, what):
        """Send a signal to the deciding process; return a time before its reception [ns]."""
        t_ns = time.monotonic_ns()
        os.kill(self.process.pid, what)
        return t_ns

    def close(self):
        if self.process.poll() is None:
            os.kill(self.process.pid, signal.SIGCONT)
            os.kill(self.process.pid, signal.SIGINT)
            try:
                self.process.wait(10.0)
            except subprocess.TimeoutExpired:
                self.process.kill()
        super().close()
