"""Ahead-of-time compilation: only missing kernels, in separate processes, found afterwards."""

import json
import os
import subprocess
import sys
import time

import pytest
from click.testing import CliRunner
from numba import config

from agents.cli.main import cli
from agents.errors import UsageError
from agents.warm_up import PURPOSES, BackgroundWarmUp, parts_of, processes, warm_up, warm_up_first
from agents.warm_up.parts import NoFilter, Part
from relpos_env import formation_v0
from tracking import Constellation, NodeConfig, Tracker
from tracking.filters import FILTERS
from tracking.kernels.jit import bind, is_compiled

pytestmark = pytest.mark.skipif(config.DISABLE_JIT, reason="nothing is compiled")


def calls(name="joint", dimensions=3):
    nodes = tuple(NodeConfig(id=k) for k in range(4))
    return Tracker(Constellation(nodes=nodes, dimensions=dimensions), filter=name).calls()


@pytest.fixture
def compiled():
    """Compile the joint filter in this process."""
    for group in calls():
        for kernel, given in group:
            bind(kernel, *given)


def a_part(name, **changes):
    given = {"is_kept": lambda: False, "compile": lambda: None, **changes}
    return Part(name=name, **given)


def test_nothing_is_compiled_twice_and_nothing_is_said_then(compiled, capsys):
    shares = []
    found = warm_up(parts_of("track"), progress=lambda *said: shares.append(said))
    assert (found.compiled, shares, found.largest_mb) == ((), [], 0.0)
    assert found.parts == ("joint.0", "joint.1", "joint.2", "orientation")
    warm_up_first(["joint", "joint", "package.module:Name"])
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("purpose", PURPOSES)
def test_every_purpose_has_its_parts_once(purpose):
    names = [part.name for part in parts_of(purpose)]
    assert len(names) == len(set(names))
    assert {"joint.0", "orientation", *PURPOSES[purpose]} <= set(names)


def test_groups_in_a_plane_compile_nothing_that_is_for_space():
    needed = {kernel.py_func.__name__ for group in calls(dimensions=2) for kernel, _ in group}
    others = {kernel.py_func.__name__ for group in calls() for kernel, _ in group} - needed
    assert others == {"align", "modes", "challenge_in_space"}
    names = [part.name for part in parts_of("track", in_space=False)]
    assert names == ["joint.0", "joint.1", "orientation"]


def test_an_unknown_purpose_is_named():
    with pytest.raises(UsageError, match="--for: expected one of track, env, hardware, all"):
        parts_of("lunch")


def test_filters_with_the_same_kernels_are_one_part():
    assert [p.name for p in parts_of("track", ("ekf", "ekf-mds"))] == ["ekf.0", "orientation"]


@pytest.mark.parametrize("name", FILTERS)
def test_kernels_of_every_filter_are_known_ahead(name):
    groups = calls(name)
    assert len(groups) >= 2
    assert all(callable(kernel) and given for group in groups for kernel, given in group)


def test_what_a_process_has_compiled_is_found_by_the_next(tmp_path):
    env = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    ask = (
        "from agents.warm_up import parts_of;"
        "print([part.is_kept() for part in parts_of('track', ('paper-ekf',))])"
    )
    run = {"env": env, "capture_output": True, "text": True, "check": True}
    before = subprocess.run([sys.executable, "-c", ask], **run)
    subprocess.run([sys.executable, "-m", "agents.warm_up", "paper-ekf.0"], **run)
    after = subprocess.run([sys.executable, "-c", ask], **run)
    assert before.stdout.split() == ["[False,", "False]"]
    assert after.stdout.split() == ["[True,", "False]"]


def test_a_process_that_fails_says_why(monkeypatch):
    monkeypatch.setattr(processes, "_command", lambda name: [sys.executable, "-c", "1 / 0"])
    with pytest.raises(UsageError, match="compiling some failed: ZeroDivisionError"):
        warm_up([a_part("some")], jobs=1)


def test_parts_that_need_others_come_last_and_alone(monkeypatch):
    began = []

    def command(name):
        began.append(name)
        return [sys.executable, "-c", "import time; time.sleep(0.3)"]

    monkeypatch.setattr(processes, "_command", command)
    told = []
    parts = [a_part("last", needs_others=True), a_part("one"), a_part("two")]
    found = warm_up(parts, jobs=3, progress=lambda share, what: told.append((share, what)))
    assert sorted(began[:2]) == ["one", "two"]
    assert began[2:] == ["last"]
    assert all("last" not in what for _, what in told if "one" in what)
    assert all(0.0 <= share <= 1.0 for share, _ in told)
    assert found.compiled == ("one", "two", "last")
    assert found.largest_mb > 1.0


def test_what_is_compiled_in_the_background_ends_with_its_block(monkeypatch):
    sleep = [sys.executable, "-c", "import time; time.sleep(60)"]
    monkeypatch.setattr(processes, "_command", lambda name: sleep)
    began = time.monotonic()
    with BackgroundWarmUp([], [a_part("slow")]) as others:
        assert others.missing == ("slow",)
        assert not others.is_done()
    assert time.monotonic() - began < 30.0
    assert others.is_done()


def test_the_world_is_driven_without_a_tracker():
    env = formation_v0.parallel_env(filter=NoFilter)
    env.reset(seed=0)
    for _ in range(5):
        env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    assert not env.formation.loop.view.ok.any()


def test_command(compiled):
    done = CliRunner().invoke(cli, ["warmup", "--json"])
    (line,) = map(json.loads, done.stdout.splitlines())
    assert line["parts"] == ["joint.0", "joint.1", "joint.2", "orientation"]
    assert line["compiled"] == []
    wrong = CliRunner().invoke(cli, ["warmup", "--filter", "missing"])
    assert wrong.exit_code != 0
    assert "missing" in str(wrong.exception)


def test_code_is_loaded_for_its_types_only(compiled):
    kernel, given = calls()[0][0]
    assert is_compiled(kernel, *given)
    assert not is_compiled(kernel, *given[:-1], 1.5)


def test_what_is_needed_comes_first_and_is_all_that_is_waited_for(monkeypatch):
    began = []

    def command(name):
        began.append(name)
        wait = 0.2 if name.startswith("needed") else 60
        return [sys.executable, "-c", f"import time; time.sleep({wait})"]

    monkeypatch.setattr(processes, "_command", command)
    needed, later = [a_part("needed 1"), a_part("needed 2")], [a_part("later")]
    since = time.monotonic()
    with BackgroundWarmUp(needed, later) as others:
        said = []
        others.wait_for_needed(lambda share, what: said.append(what))
        assert began[:2] == ["needed 1", "needed 2"]
        assert said
        assert not any("later" in what for what in said)
        assert not others.is_done()
    assert time.monotonic() - since < 30.0


def test_who_waits_is_told_of_what_failed(monkeypatch):
    monkeypatch.setattr(processes, "_command", lambda name: [sys.executable, "-c", "1 / 0"])
    failing = BackgroundWarmUp([a_part("bad")], [])
    with failing, pytest.raises(UsageError, match="compiling bad failed: ZeroDivisionError"):
        failing.wait_for_needed(lambda share, what: None)
