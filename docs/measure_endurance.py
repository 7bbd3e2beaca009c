"""Memory and missed ticks of a long drive: emulator and drive as processes.

python docs/measure_endurance.py --seconds 3600 --cars 6

Prints the memory of every process once a minute and, at the end, how far it grew since the first
minute, and how many ticks of the supervisor were more than 20 ms late. Beside it a process that
only sleeps, with a high priority and its memory locked, tells how often the machine itself stood.

python docs/measure_endurance.py --seconds 3600 --cars 6 --virtual

Does the same in one process under a counted clock, as fast as it goes.
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
LATE = 0.02
"""[s]"""
START = 120.0
"""[s] For a drive to begin."""


def memory(pid: int) -> float:
    """Memory of a process [MB]; 0 if it is gone."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except OSError:
        return 0.0
    return next((int(li.split()[1]) / KB for li in lines if li.startswith("VmRSS")), 0.0)


def watch_machine(talk: Connection) -> None:
    """Sleep for 2 ms at a time until told to end; then tell when it took more than 20 [s, ms]."""
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(50))
    ctypes.CDLL(None).mlockall(3)  # what is there and what will be
    gc.disable()
    begin = last = time.monotonic()
    stood = []
    while not talk.poll():
        time.sleep(0.002)
        now = time.monotonic()
        if now - last > LATE:
            stood.append((round(now - begin, 1), round(1e3 * (now - last), 1)))
        last = now
    talk.send(stood)


def children(pid: int) -> dict[str, int]:
    """Processes below one, by what they are for."""
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
    """Emulator and drive in real time."""
    folder = Path(tempfile.mkdtemp(prefix="endurance"))
    env = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    options = {"scenario": scenario, "cars": cars, "seed": 3, "seconds": seconds + START}
    options["keep"] = False  # its disk may be slow, which is not what is measured
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
    said: dict[str, Any] = {"stops": []}
    listener = threading.Thread(target=_listen, args=(drive, said), daemon=True)
    listener.start()
    near, far = multiprocessing.Pipe()
    watch = multiprocessing.get_context("spawn").Process(target=watch_machine, args=(far,))
    watch.start()
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
        near.send("end")
        print(json.dumps({"machine_stood": near.recv()}))
    finally:
        watch.terminate()
        if drive.poll() is None:
            drive.terminate()
        emulation.stdin.close()
        emulation.wait()
    listener.join(5.0)
    first = rows[1] if len(rows) > 1 else rows[0]
    growth = {n: round(rows[-1][n] - first[n], 2) for n in ("emulator", "drive", "supervisor")}
    record = folder / "long.relpos"
    print(json.dumps({"growth_mb": growth, "recording_mb": record.stat().st_size / 1e6}))
    print(json.dumps(said.get("summary", said)))


def _arm_again(drive: subprocess.Popen[str], said: dict[str, Any]) -> None:
    """As somebody would who watches it."""
    if said.get("moved") and not all(said["armed"]) and drive.stdin is not None:
        with contextlib.suppress(BrokenPipeError):
            drive.stdin.write('{"order": "arm"}\n')
            drive.stdin.flush()


def _listen(drive: subprocess.Popen[str], said: dict[str, Any]) -> None:
    """Keep the last of everything that the drive says."""
    assert drive.stdout is not None
    for line in drive.stdout:
        fields = json.loads(line)
        if "notice" in fields:
            print(fields["notice"], file=sys.stderr, flush=True)
        said.update(fields)
        said["moved"] = said.get("moved") or all(said.get("armed", [False]))


def virtual(seconds: float, cars: int, scenario: str) -> None:
    """World, bytes, trackers, policy and gate under a counted clock."""
    sys.path[:0] = [str(TESTS), str(ROOT)]
    from virtual_drive import VirtualDrive

    from agents.emulate import EmulateOptions

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
