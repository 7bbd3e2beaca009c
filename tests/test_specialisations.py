"""Every kernel is compiled for one set of types, for all groups and callers.

The check needs a process of its own, since other tests call kernels with arrays of their own.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import config

from relpos_env import formation_v0
from relpos_env.api.vector_env import FormationVectorEnv
from tracking import Constellation, NodeConfig, Tracker
from tracking.filters import FILTERS
from tracking.kernels.compile_units import units_of
from tracking.measurements import Kind, MeasurementBlock

OF_TWO_FILTERS = {"tracking.filters.first_ranges", "tracking.filters.best_hypothesis"}
"""Modules whose kernels take the records of both the joint filter and the pair filters."""


def block(n_nodes, dimensions):
    """Return measurements of nodes that jitter about their places."""
    rng = np.random.default_rng(0)
    t = np.repeat(np.arange(0.0, 3.0, 0.02), n_nodes)
    node = np.tile(np.arange(n_nodes), len(t) // n_nodes)
    samples = rng.standard_normal((len(t), 6)) * 0.1 + [0.0, 0.0, 0.0, 0.0, 0.0, 9.81]
    first, second = np.triu_indices(n_nodes, 1)
    at = np.repeat(np.arange(0.01, 3.0, 0.05), len(first))
    i, j = (np.tile(of, len(at) // len(first)) for of in (first, second))
    place = rng.uniform(-3.0, 3.0, (n_nodes, dimensions))
    distance = np.linalg.norm(place[j] - place[i], axis=1)[:, None]
    imu = MeasurementBlock.of_kind(Kind.IMU, t, node, samples)
    return MeasurementBlock.concatenate(
        [imu, MeasurementBlock.of_kind(Kind.RANGE, at, i, distance, j=j)]
    ).sorted()


def track(filter_name):
    """Track groups of several sizes and dimensions."""
    for n_nodes, dimensions, vehicle in ((3, 2, "car"), (5, 3, "drone"), (4, 3, "human")):
        nodes = tuple(NodeConfig(id=k, vehicle=vehicle) for k in range(n_nodes))
        tracker = Tracker(Constellation(nodes=nodes, dimensions=dimensions), filter=filter_name)
        tracker.run(block(n_nodes, dimensions), np.arange(0.5, 3.0, 0.5))
        tracker.step(MeasurementBlock.empty(1), 3.5)


def drive():
    """Step environments in several numbers, with cars that join and leave."""
    for env in (FormationVectorEnv(1), FormationVectorEnv(3)):
        env.reset(seed=0)
        for _ in range(20):
            env.step(env.action_space.sample())
        env.close()
    single = formation_v0.parallel_env(scenario="swarm-nlos")
    single.reset(seed=1)
    for _ in range(50):
        single.step({agent: single.action_space(agent).sample() for agent in single.agents})


def several():
    """Return the kernels that this process has for more than one set of types."""
    return sorted(
        f"{unit.py_func.__module__}.{unit.py_func.__name__}"
        for package in ("tracking.filters", "tracking.ahrs", "relpos_env")
        for unit in units_of(package)
        if len(unit.overloads) > (2 if unit.py_func.__module__ in OF_TWO_FILTERS else 1)
    )


@pytest.mark.skipif(config.DISABLE_JIT, reason="nothing is compiled")
@pytest.mark.parametrize("what", [*FILTERS, "environments"])
def test_kernels_have_one_set_of_types(what):
    root = str(Path(__file__).resolve().parent.parent)
    done = subprocess.run(
        [sys.executable, __file__, what],
        env={**os.environ, "PYTHONPATH": root},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == []


if __name__ == "__main__":
    drive() if sys.argv[1] == "environments" else track(sys.argv[1])
    print("\n".join(several()))
