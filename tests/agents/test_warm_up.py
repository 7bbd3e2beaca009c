"""Compiling ahead: only what is missing, in processes of its own, and it is found afterwards."""

import json
import os
import subprocess
import sys

import pytest
from click.testing import CliRunner
from numba import config

from agents import warm_up as module
from agents.cli import cli
from agents.errors import UsageError
from agents.warm_up import calls_of, warm_up, warm_up_first
from tracking.filters import FILTERS
from tracking.jit import bind, is_compiled

pytestmark = pytest.mark.skipif(config.DISABLE_JIT, reason="nothing is compiled")


@pytest.fixture
def compiled():
    """The joint filter, compiled by this process."""
    for group in calls_of("joint"):
        for kernel, given in group:
            bind(kernel, *given)


def test_nothing_is_compiled_twice_and_nothing_is_said_then(compiled, capsys):
    shares = []
    found = warm_up(["joint"], progress=shares.append)
    assert (found.n_compiled, shares) == (0, [])
    assert found.n_kernels == sum(map(len, calls_of("joint")))
    warm_up_first(["joint", "joint", "package.module:Name"])
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("name", FILTERS)
def test_kernels_of_every_filter_are_known_ahead(name):
    groups = calls_of(name)
    assert len(groups) >= 2
    assert all(callable(kernel) and given for group in groups for kernel, given in group)


def test_what_a_process_has_compiled_is_found_by_the_next(tmp_path):
    env = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    ask = (
        "import sys; from agents.warm_up import calls_of; from tracking.jit import is_compiled;"
        "print([all(is_compiled(k, *g) for k, g in group) for group in calls_of('paper-ekf')])"
    )
    run = {"env": env, "capture_output": True, "text": True, "check": True}
    before = subprocess.run([sys.executable, "-c", ask], **run)
    subprocess.run([sys.executable, "-m", "agents.warm_up", "paper-ekf", "0"], **run)
    after = subprocess.run([sys.executable, "-c", ask], **run)
    assert before.stdout.split() == ["[False,", "False]"]
    assert after.stdout.split() == ["[True,", "False]"]


def test_a_process_that_fails_says_why(monkeypatch):
    monkeypatch.setattr(module, "is_compiled", lambda *_: False)
    monkeypatch.setattr(module, "_run_command", lambda name, k: [sys.executable, "-c", "1 / 0"])
    with pytest.raises(UsageError, match="compiling failed: ZeroDivisionError"):
        warm_up(["joint"], jobs=1)


def test_command(compiled):
    done = CliRunner().invoke(cli, ["warmup", "--json"])
    (line,) = map(json.loads, done.stdout.splitlines())
    assert line["filters"] == ["joint"]
    assert line["compiled"] == 0
    wrong = CliRunner().invoke(cli, ["warmup", "--filter", "missing"])
    assert wrong.exit_code != 0
    assert "missing" in str(wrong.exception)


def test_code_is_loaded_for_its_types_only(compiled):
    kernel, given = calls_of("joint")[0][0]
    assert is_compiled(kernel, *given)
    assert not is_compiled(kernel, *given[:-1], 1.5)
