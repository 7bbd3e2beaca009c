"""Memory and missed ticks of a long drive: emulator and drive as processes.

python benchmarks/measure_endurance.py --seconds 3600 --cars 6

Prints the memory of every process once a minute and, at the end, its growth since the first minute
and the number of supervisor ticks that were more than 20 ms late. A process per core that only
sleeps, with real-time priority and locked memory, measures how often the machine itself stalled;
the longest stall in the two seconds before the report of each missed tick is printed.

python benchmarks/measure_endurance.py --seconds 3600 --cars 6 --virtual

Does the same in one process with a virtual clock, as fast as possible.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import gc
import json
import multiprocessing
import os
import subprocess
import sys
import tempfile
import threading
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
TESTS = ROOT / "tests" / "hardware_bridge"
KB = 1024.0
NAP, STALL = 0.002, 0.01
"""[s] Sleep of the watching processes; time between two wake-ups above which a core stalled."""
NUMBERS = ("t", "missed", "late_decisions")
"""Fields of a row that are not the memory of a process."""
REPORT_DELAY = 2.0
"""[s] Longest delay of the report of a missed tick."""
START = 120.0
"""[s] Additional time for the start of a drive."""


def memory(pid: int) -> float:
    """Return the resident memory of a process [MB]; 0 if it has ended."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except OSError:
        return 0.0
    return next((int(li.split()[1]) / KB for li in lines if li.startswith("VmRSS")), 0.0)


def watch_core(core: int, talk: Connection) -> None:
    """Sleep in steps of 2 ms until a message is received; then send all stalls [(s, ms), ...]."""
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setaffinity(0, {core})
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(60))
    ctypes.CDLL(None).mlockall(3)  # MCL_CURRENT | MCL_FUTURE
    gc.disable()
    last = time.monotonic()
    stalls = []
    while not talk.poll():
        time.sleep(NAP)
        now = time.monotonic()
        if now - last > STALL:
            stalls.append((now, round(1e3 * (now - last - NAP), 1)))
        last = now
    talk.send(stalls)


class Watch:
    """Processes that detect stalls of the machine, one per core."""

    def __init__(self) -> None:
        spawn = multiprocessing.get_context("spawn")
        self._talks, self._processes = [], []
        for core in sorted(os.sched_getaffinity(0)):
            near, far = multiprocessing.Pipe()
            self._talks.append(near)
            self._processes.append(spawn.Process(target=watch_core, args=(core, far)))
            self._processes[-1].start()

    def end(self) -> list[list[tuple[float, float]]]:
        """Return the stalls of each core: time [s] and duration [ms]."""
        for talk in self._talks:
            talk.send("end")
        return [talk.recv() for talk in self._talks]

    def close(self) -> None:
        """End the processes."""
        for process in self._processes:
            process.terminate()


def children(pid: int) -> dict[str, int]:
    """Return the child processes of a process by their roles."""
    found = {}
    for status in Path("/proc").glob("[0-9]*/status"):
        try:
            fields = dict(
                line.split(":", 1) for line in status.read_text().splitlines() if ":" in line
            )
            line = status.with_name("cmdline").read_bytes().decode(errors="replace")
        except OSError:
            continue
        if int(fields["PPid"]) == pid:
            name = "tracker" if "resource_tracker" in line else "supervisor"
            found[name] = int(fields["Pid"])
    return found


def real(seconds: float, cars: int, scenario: str) -> None:
    """Run emulator and drive in real time."""
    folder = Path(tempfile.mkdtemp(prefix="endurance"))
    env = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    options = {"scenario": scenario, "cars": cars, "seed": 3, "seconds": seconds + START}
    options["keep"] = False  # slow disks are not part of the measurement
    emulation = subprocess.Popen(
        [sys.executable, TESTS / "emulation_process.py", folder, json.dumps(options)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=env,
    )  # fmt: skip
    assert emulation.stdout is not None and emulation.stdin is not None  # noqa: PT018
    config = json.loads(emulation.stdout.readline())["ready"]
    chosen = {"seconds": seconds, "record": str(folder / "long.relpos")}
    drive = subprocess.Popen(
        [sys.executable, TESTS / "drive_process.py", config, json.dumps(chosen)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=env,
    )  # fmt: skip
    said: dict[str, Any] = {"stops": [], "misses": []}
    listener = threading.Thread(target=_listen, args=(drive, said), daemon=True)
    listener.start()
    watch = Watch()
    rows = []
    try:
        begin, every = time.monotonic(), min(60.0, seconds / 10.0)
        while drive.poll() is None:
            time.sleep(every)
            pids = {"emulator": emulation.pid, "drive": drive.pid, **children(drive.pid)}
            row: dict[str, Any] = {"t": round(time.monotonic() - begin, 1)}
            row |= {name: round(memory(pid), 2) for name, pid in pids.items()}
            row |= {"missed": said.get("missed"), "late_decisions": said.get("late")}
            if drive.poll() is None:
                rows.append(row)
                print(json.dumps(row), flush=True)
            _arm_again(drive, said)
        print(json.dumps(_stalls(watch.end(), said["misses"], begin)))
    finally:
        watch.close()
        if drive.poll() is None:
            drive.terminate()
        emulation.stdin.close()
        emulation.wait()
    listener.join(5.0)
    rows = [row for row in rows if "supervisor" in row] or rows
    first = rows[min(1, len(rows) - 1)]
    growth = {n: round(rows[-1][n] - first[n], 2) for n in first if n not in NUMBERS}
    record = folder / "long.relpos"
    print(json.dumps({"growth_mb": growth, "recording_mb": record.stat().st_size / 1e6}))
    print(json.dumps(said.get("summary", said)))


def _stalls(
    stalls: list[list[tuple[float, float]]], misses: list[float], begin: float
) -> dict[str, Any]:
    """Return number and length of the stalls of each core, and those before each missed tick."""
    return {
        "cores_stalled_20_ms": [sum(ms > 20.0 for _, ms in core) for core in stalls],
        "longest_ms": [max((ms for _, ms in core), default=0.0) for core in stalls],
        "missed_at_s_beside_longest_ms": [
            [
                round(t - begin, 1),
                [
                    max((ms for s, ms in core if 0.0 <= t - s < REPORT_DELAY), default=0.0)
                    for core in stalls
                ],
            ]
            for t in misses
        ],
    }


def _arm_again(drive: subprocess.Popen[str], said: dict[str, Any]) -> None:
    """Arm the cars again, as an operator would."""
    if said.get("moved") and not all(said["armed"]) and drive.stdin is not None:
        with contextlib.suppress(BrokenPipeError):
            drive.stdin.write('{"order": "arm"}\n')
            drive.stdin.flush()


def _listen(drive: subprocess.Popen[str], said: dict[str, Any]) -> None:
    """Store the newest value of every field of the drive's output."""
    assert drive.stdout is not None
    for line in drive.stdout:
        fields = json.loads(line)
        if "notice" in fields:
            print(fields["notice"], file=sys.stderr, flush=True)
        if fields.get("missed", 0) > said.get("missed", 0):
            said["misses"].append(time.monotonic())
        said.update(fields)
        said["moved"] = said.get("moved") or all(said.get("armed", [False]))


def virtual(seconds: float, cars: int, scenario: str) -> None:
    """Run world, bytes, trackers, policy and gate with a virtual clock."""
    sys.path[:0] = [str(TESTS), str(ROOT)]
    from virtual_drive import VirtualDrive

    from agents.hardware.emulate import EmulateOptions

    options = EmulateOptions(scenario=scenario, cars=cars, seed=3, seconds=seconds + START)
    drive = VirtualDrive(options).start()
    begin, rows, every = time.perf_counter(), [], min(60.0, seconds / 10.0)
    for k in range(round(seconds / every)):
        drive.drive(every)
        if not all(drive.armed):
            drive.order("arm")
        drive.errors[:-100] = []
        drive.feed.notices[:-100] = []
        rows.append(memory(os.getpid()))
        row = {"t": round((k + 1) * every, 1), "rss_mb": round(rows[-1], 2)}
        row["armed"] = sum(drive.armed)
        row["took"] = round(time.perf_counter() - begin, 1)
        print(json.dumps(row), flush=True)
    drive.close()
    grew = rows[-1] - rows[min(2, len(rows) - 1)]
    print(json.dumps({"seconds": seconds, "cars": cars, "rss_growth_mb": round(grew, 2)}))


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=180.0)
    parser.add_argument("--cars", type=int, default=6)
    parser.add_argument("--scenario", default="ring-nlos")
    parser.add_argument("--virtual", action="store_true")
    chosen = parser.parse_args()
    (virtual if chosen.virtual else real)(chosen.seconds, chosen.cars, chosen.scenario)


if __name__ == "__main__":
    main()
