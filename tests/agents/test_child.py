"""Processes end with their parent."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from processes import is_running

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")

CODE = """
import os, sys, time
from agents.jobs import find_engine

def work(k):
    print(os.getpid(), flush=True)
    time.sleep(600.0)

if __name__ == "__main__":
    list(find_engine("local")(work, [(0,), (1,)], 2))
"""


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL])
def test_jobs_end_with_a_command_that_is_ended(tmp_path, how):
    script = tmp_path / "begin.py"
    script.write_text(CODE)
    with subprocess.Popen(
        [sys.executable, str(script)], stdout=subprocess.PIPE, text=True
    ) as first:
        pids = [first.stdout.readline().strip() for _ in range(2)]
        assert all(is_running(pid) for pid in pids)
        first.send_signal(how)
    until = time.monotonic() + 20.0
    while any(map(is_running, pids)) and time.monotonic() < until:
        time.sleep(0.05)
    left = [pid for pid in pids if is_running(pid)]
    for pid in left:
        os.kill(int(pid), signal.SIGKILL)
    assert left == []


def test_a_policy_tells_nobody_and_leaves_nothing(tmp_path):
    """Its runtime would store an identifier in the home folder, and send usage data."""
    code = "from agents.policies import load_policy; load_policy('ring')"
    env = {k: v for k, v in os.environ.items() if k != "ORT_DISABLE_TELEMETRY"}
    env |= {"HOME": str(tmp_path), "TMPDIR": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path)}
    subprocess.run([sys.executable, "-c", code], env=env, check=True)
    left = [path for path in tmp_path.rglob("*") if "onnx" in path.name.lower()]
    assert left == []
    assert not (tmp_path / ".ses").exists()
    assert not list(tmp_path.rglob("deviceid"))
