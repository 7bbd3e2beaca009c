"""Compiled kernels: the decorators, and calls without overhead.

Compilation and caching are in `compile_units`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

import numpy as np
from numba import config, njit, typeof

from tracking.kernels.compile_units import compile_as_unit, is_kept, load_unit, units_of

Function = TypeVar("Function", bound=Callable[..., Any])
Call = tuple[Callable[..., Any], tuple[Any, ...]]
"""A kernel and arguments of the types that it is compiled for."""


def kernel(function: Function) -> Function:
    """Compile a function with numba, without the interpreter, and cache the result on disk.

    It releases the interpreter lock, so several threads can run kernels at a time. It makes no
    arrays, only views of its arguments: references are not counted, which would cost atomic
    operations for every use of an array.
    """
    return _compile(function)


def allocating_kernel(function: Function) -> Function:
    """Compile a kernel that allocates arrays, small ones if it runs for many measurements.

    Its references are counted, so it must not take an array that a plain kernel returns, which
    is not counted.
    """
    return _compile(function, nrt=True)


def small_kernel(function: Function) -> Function:
    """Compile a kernel that is inlined in its callers: calls with many arrays are expensive.

    It is optimised within its callers, and slow when called from Python.
    """
    return _compile(function, inline=True)


def bind(kernel: Callable[..., Any], *arguments: Any) -> Callable[[], Any]:
    """Bind a kernel to arguments that are refilled arrays.

    Finding the types of many arrays takes longer than most kernels. It is done once here, and
    the compiled code is then called without a check. Parts of a batch are bound repeatedly.

    Args:
        kernel: Kernel to call.
        arguments: All arguments of the kernel.
    """
    if config.DISABLE_JIT:
        return partial(kernel, *arguments)
    compiled: Any = kernel
    kind = kind_of(arguments)
    if kind is None:
        return partial(compiled.compile(types_of(arguments)), *arguments)
    if (kernel, kind) not in _entries:
        _entries[kernel, kind] = compiled.compile(types_of(arguments))
    return partial(_entries[kernel, kind], *arguments)


def is_compiled(kernel: Callable[..., Any], *arguments: Any) -> bool:
    """Load a kernel for the types of arguments; False if it is not compiled yet."""
    if config.DISABLE_JIT:
        return True
    return load_unit(kernel, types_of(arguments))


def missing_in(package: str) -> list[str]:
    """Return the kernels of a package's imported modules that are not on disk."""
    if config.DISABLE_JIT:
        return []
    return [unit.py_func.__qualname__ for unit in units_of(package) if not is_kept(unit)]


def types_of(arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return the types that a kernel is compiled for when called with these arguments."""
    return tuple(type_of(argument) for argument in arguments)


_types: dict[Any, Any] = {}
"""Cache of numba's types."""
_entries: dict[Any, Callable[..., Any]] = {}
"""Compiled code by kernel and kind of its arguments."""


def type_of(value: Any) -> Any:
    """Return the numba type of an argument, faster than numba."""
    kind = kind_of(value)
    if kind is None:
        return typeof(value)
    if kind not in _types:
        _types[kind] = typeof(value)
    return _types[kind]


def kind_of(value: Any) -> tuple[Any, ...] | None:
    """Return the key of the type of an array, number or tuple of them; None for all else."""
    if type(value) is np.ndarray:
        flags, dtype = value.flags, value.dtype
        layout = flags.c_contiguous, flags.f_contiguous, flags.writeable, flags.aligned
        return dtype, dtype.isalignedstruct, value.ndim, *layout
    if isinstance(value, tuple):
        kinds = [kind_of(each) for each in value]
        return None if any(kind is None for kind in kinds) else (type(value), *kinds)
    if type(value) is int:
        bits = value.bit_length()
        return (int, bits < 31) if bits < 63 else None
    return (type(value),) if type(value) in (bool, float, np.float64) else None


def _compile(function: Function, *, inline: bool = False, nrt: bool = False) -> Function:
    compiled = njit(nogil=True, error_model="numpy", forceinline=inline, _nrt=nrt)(function)
    if not config.DISABLE_JIT:
        compile_as_unit(compiled)
    return compiled  # type: ignore[no-any-return]
