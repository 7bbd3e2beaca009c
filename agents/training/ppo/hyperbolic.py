"""Hyperbolic tangent of layers, by the faster of two implementations on this machine.

MKL, which torch calls, takes as long as the logistic function on Intel processors with AVX-512, and
four to seven times as long on others, a third of all learning. MKL / logistic, torch 2.13, one
thread, 10240 x 64 numbers: 0.2 / 0.25 ms; MKL with AVX2 only 1.1 ms; other machine 1.5 / 0.15 ms.
"""

from __future__ import annotations

from typing import Any

import llvmlite.binding
import torch
from torch import Tensor, nn


class FromLogistic(nn.Module):
    """`torch.nn.Tanh` within 3e-7, by the logistic function; exported as the plain operation."""

    def forward(self, x: Tensor) -> Tensor:
        """Return the hyperbolic tangent of each element."""
        if torch.compiler.is_exporting():
            return torch.tanh(x)
        y: Tensor = _FromLogistic.apply(x)  # type: ignore[no-untyped-call]
        return y


class _FromLogistic(torch.autograd.Function):
    """tanh(x) = 2 / (1 + exp(-2 x)) - 1."""

    @staticmethod
    def forward(ctx: Any, x: Tensor) -> Tensor:
        y = torch.sigmoid(x + x).mul_(2.0).sub_(1.0)
        ctx.save_for_backward(y)
        return y

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> Tensor:
        (y,) = ctx.saved_tensors
        out: Tensor = torch.ops.aten.tanh_backward(gradients[0], y)
        return out


def is_fast(processor: str, features: dict[str, bool], *, mkl: bool) -> bool:
    """Return whether torch's own hyperbolic tangent is fast.

    Decided by the processor, not by timing: a resumed run must use the same implementation.

    Args:
        processor: LLVM's name of the processor.
        features: LLVM's feature flags of the processor.
        mkl: True if torch calls MKL.
    """
    amd = processor.startswith(("znver", "bdver", "btver"))
    return not mkl or (features.get("avx512f", False) and not amd)


def _is_fast_here() -> bool:
    try:
        features = dict(llvmlite.binding.get_host_cpu_features())
    except RuntimeError:  # not available on this platform
        features = {}
    name = llvmlite.binding.get_host_cpu_name()
    return is_fast(
        name,
        features,
        mkl=torch.backends.mkl.is_available(),  # type: ignore[no-untyped-call]
    )


Tanh: type[nn.Module] = nn.Tanh if _is_fast_here() else FromLogistic
"""Activation of the layers of policies."""
