"""Compiled kernels: the decorators, and calls without overhead.

How they are compiled and kept is in `compile_units`.
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
    """Compile a function with numba, without the interpreter, and keep the result on disk.

    It holds no lock of the interpreter, so several threads can run kernels at a time. It makes no
    arrays, only views of those it is given: so references are not counted, which costs atomic
    operations wherever an array is named.
    """
    return _compile(function)


def allocating_kernel(function: Function) -> Function:
    """A kernel that makes arrays of its own, small ones where it runs for many measurements.

    It counts who holds them. So it must not take an array that a plain kernel returns, which
    is not counted.
    """
    return _compile(function, nrt=True)


def small_kernel(function: Function) -> Function:
    """A kernel whose code is put in place of every call: calls with many arrays are not free.

    It is optimised where it is called, and slow when Python calls it.
    """
    return _compile(function, inline=True)


def bind(kernel: Callable[..., Any], *arguments: Any) -> Callable[[], Any]:
    """A kernel that is called again and again with the same arguments: arrays filled again.

    Finding out the types of many arrays takes longer than most kernels do. Here that is done
    once, and the compiled code is then called without a look at them.

    Args:
        kernel: To call.
        arguments: Everything it takes.
    """
    if config.DISABLE_JIT:
        return partial(kernel, *arguments)
    compiled: Any = kernel
    entry = compiled.compile(types_of(arguments))
    return partial(entry, *arguments)


def is_compiled(kernel: Callable[..., Any], *arguments: Any) -> bool:
    """Load a kernel for arguments of some types; false if it has yet to be compiled."""
    if config.DISABLE_JIT:
        return True
    return load_unit(kernel, types_of(arguments))


def missing_in(package: str) -> list[str]:
    """Kernels of a package, as far as it is imported, of which nothing is on the disk."""
    if config.DISABLE_JIT:
        return []
    return [unit.py_func.__qualname__ for unit in units_of(package) if not is_kept(unit)]


def types_of(arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    """What a kernel is compiled for when it is called with these arguments."""
    return tuple(type_of(argument) for argument in arguments)


_types: dict[Any, Any] = {}
"""Numba's types by what they depend on: parts of a batch are bound again and again."""


def type_of(value: Any) -> Any:
    """The type that numba gives an argument, found faster."""
    kind = _kind_of(value)
    if kind is None:
        return typeof(value)
    if kind not in _types:
        _types[kind] = typeof(value)
    return _types[kind]


def _kind_of(value: Any) -> tuple[Any, ...] | None:
    """What the type of an array, a number or a tuple of them depends on; None for all else."""
    if type(value) is np.ndarray:
        flags, dtype = value.flags, value.dtype
        layout = flags.c_contiguous, flags.f_contiguous, flags.writeable, flags.aligned
        return dtype, dtype.isalignedstruct, value.ndim, *layout
    if isinstance(value, tuple):
        kinds = [_kind_of(each) for each in value]
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
