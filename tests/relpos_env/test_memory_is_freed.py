"""Kernels count no references: the memory of an environment is free once it is deleted."""

import gc
import weakref

import numpy as np
import pytest

from relpos_env.config import configure
from relpos_env.core.env_core import EnvCore


@pytest.mark.parametrize("name", ["joint", "ekf-mds"])
def test_an_environment_that_is_gone_leaves_nothing_behind(name):
    parts = configure({"scenario": "ring-los", "task": "ring", "n_cars": 3, "filter": name})
    formation = EnvCore(parts, n_envs=2, threads=2)
    for env in range(2):
        formation.seed(env, np.random.default_rng(env))
        formation.begin([env])
    for _ in range(15):  # through the start, with all its hypotheses
        formation.step(np.full((2, 3), 0.5), np.zeros((2, 3)))
    swarm = formation.loop.swarm
    held = [weakref.ref(array) for array in (swarm.events.values, formation.rewards)]
    held += [weakref.ref(formation.loop.estimate.cov), weakref.ref(formation.loop.view.pos)]
    formation.close()
    del formation, swarm
    gc.collect()
    assert [array() for array in held] == [None] * len(held)
