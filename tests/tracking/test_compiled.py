"""Compiled code that is kept on disk."""

import subprocess
import sys

import pytest
from numba import config

KERNEL = """
from tracking.compiled import kernel


@kernel
def double(x):
    return 2 * x
"""


def run(folder, call):
    done = subprocess.run(
        [sys.executable, "-c", f"from _double_kernels import double; print({call})"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.skipif(config.DISABLE_JIT, reason="nothing is compiled")
def test_code_under_another_number_is_not_taken_for_what_it_is_not(tmp_path):
    """As processes leave it that compile at the same time, each for other types."""
    (tmp_path / "_double_kernels.py").write_text(KERNEL)
    assert run(tmp_path, "double(1), double(1.5)") == "2 3.0"
    first, second = sorted((tmp_path / "__pycache__").glob("*.nbc"))
    kept = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(kept)
    assert run(tmp_path, "double(1), double(1.5)") == "2 3.0"
    # What was compiled instead has its place now.
    compiled = "double(1), double(1.5), sum(double.stats.cache_hits.values())"
    assert run(tmp_path, compiled) == "2 3.0 2"
