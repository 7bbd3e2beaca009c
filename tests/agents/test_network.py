"""Optimisations of the networks do not change them."""

import numpy as np
import pytest
import torch

from agents.settings import from_options
from agents.training.config import TrainConfig
from agents.training.environments import layout_of
from agents.training.ppo.hyperbolic import FromLogistic, is_fast
from agents.training.ppo.learner import make_policy


def test_the_tangent_is_that_of_torch():
    x = torch.linspace(-30.0, 30.0, 20001, requires_grad=True)
    ours, theirs = FromLogistic()(x), torch.tanh(x)
    torch.testing.assert_close(ours, theirs, rtol=0.0, atol=3e-7)
    up = torch.linspace(-1.0, 2.0, len(x))
    slope, expected = (torch.autograd.grad(y, x, up)[0] for y in (ours, theirs))
    torch.testing.assert_close(slope, expected, rtol=0.0, atol=2e-6)


def test_the_tangent_has_the_slope_that_finite_differences_have():
    x = torch.linspace(-2.0, 2.0, 41, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(FromLogistic(), (x,))


def test_an_exported_network_has_the_plain_tangent():
    graph = torch.export.export(FromLogistic(), (torch.zeros(2, 3),)).graph
    called = [node.target for node in graph.nodes if node.op == "call_function"]
    assert called == [torch.ops.aten.tanh.default]


@pytest.mark.parametrize(
    ("processor", "features", "mkl", "fast"),
    [
        ("sapphirerapids", {"avx512f": True}, True, True),
        ("haswell", {"avx512f": False}, True, False),
        ("znver4", {"avx512f": True}, True, False),
        ("generic", {}, True, False),
        ("apple-m1", {}, False, True),
    ],
)
def test_the_tangent_of_torch_is_used_where_it_is_fast(processor, features, mkl, fast):
    assert is_fast(processor, features, mkl=mkl) == fast


@pytest.mark.parametrize("n_present", [0, 2, 5])
def test_others_that_do_not_count_cost_nothing_and_change_nothing(n_present):
    """Features and gradients equal those of computing all others and multiplying some by zero."""
    torch.manual_seed(0)
    config = from_options(TrainConfig, {"task": "hold", "proximity": "16"})
    policy = make_policy(config)
    features = policy.pi_features_extractor
    rng = np.random.default_rng(n_present)
    seen = rng.normal(size=(7, layout_of(config).size)).astype(np.float32)
    present = np.arange(5) < n_present
    for name in ("_mask", "_has_target"):
        seen[:, getattr(features, name).numpy()] = np.where(present, rng.random((7, 5)) < 0.7, 0.0)
    rows: list[int] = []
    features.of_other.register_forward_hook(lambda module, given, out: rows.append(len(given[0])))
    sparse = features(torch.from_numpy(seen))
    weight = np.maximum(*(seen[:, getattr(features, n).numpy()] for n in ("_mask", "_has_target")))
    assert rows == [int(weight.sum())]

    slopes = torch.autograd.grad(sparse.square().sum(), list(features.parameters()))
    features.skips_absent = False
    whole = features(torch.from_numpy(seen))
    torch.testing.assert_close(sparse, whole)
    expected = torch.autograd.grad(whole.square().sum(), list(features.parameters()))
    for ours, theirs in zip(slopes, expected, strict=True):
        torch.testing.assert_close(ours, theirs, rtol=1e-4, atol=1e-4)
