"""Three computers, each with its own node and car and no host: processes at pseudo terminals."""

import os
import signal
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from rows import Drive, Emulation

pytestmark = [pytest.mark.slow, pytest.mark.realtime]
NODES = (1, 2, 3)


@pytest.fixture
def computers(tmp_path):
    folder = tmp_path / "emulation"
    emulation = Emulation(
        folder, scenario="ring-los", task="hold", cars=3, trackers="own", seed=4, seconds=300
    )  # fmt: skip
    files = [emulation.config.with_name(f"swarm-{node}.toml") for node in NODES]
    with ThreadPoolExecutor() as pool:
        drives = list(pool.map(lambda file, node: Drive(file, node=node), files, NODES))
    for k, drive in enumerate(drives):
        drive.moving(cars=(k,))
    # The start of one process may have held up another one for too long.
    time.sleep(2.0)
    for k, drive in enumerate(drives):
        if not state(drive)["armed"][k]:
            drive.arm(cars=(k,))
    yield emulation, drives
    for drive in drives:
        drive.close()
    emulation.close()


def state(drive):
    return drive.wait_for(lambda s: "armed" in s, since=time.monotonic_ns())


def speeds(emulation, seconds):
    start = time.monotonic_ns()
    time.sleep(seconds)
    return emulation.motors(start, time.monotonic_ns())


def test_each_drives_its_own_car_and_goes_on_if_another_is_killed(computers):
    emulation, drives = computers
    deadline = time.monotonic() + 60.0
    moved = [False] * 3
    while not all(moved) and time.monotonic() < deadline:
        moved = [m or v > 0.05 for m, v in zip(moved, speeds(emulation, 0.5), strict=True)]
    assert all(moved)
    for k, drive in enumerate(drives):
        assert state(drive)["armed"] == [j == k for j in range(3)]
    os.kill(drives[0].process.pid, signal.SIGKILL)
    drives[0].process.wait()
    time.sleep(1.0)
    assert speeds(emulation, 4.0)[0] == 0.0
    for k in (1, 2):
        assert state(drives[k])["armed"][k]
