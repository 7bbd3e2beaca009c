"""The decorator of every compiled kernel, and the cache of compiled code.

Numba keeps compiled code on disk and names it after the time of the kernel's own file. But the
code of the kernels it calls is compiled into it, and so are the constants it imports. Here cached
code is stamped with the contents of all of these (`fingerprint`): a change of any of them compiles
the kernel again, a change of anything else does not, and neither does a copy with new file times.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterator
from dis import opmap
from functools import partial
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, TypeVar

import numpy as np
from numba import config, njit, typeof
from numba.core.caching import IndexDataCacheFile
from numba.core.dispatcher import Dispatcher

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """Compile a function with numba, without the interpreter, and keep the result on disk.

    It holds no lock of the interpreter, so several threads can run kernels at a time. It makes no
    arrays, only views of those it is given: so nobody counts who holds which, which costs atomic
    operations wherever an array is named.
    """
    return _compile(function)


def allocating_kernel(function: Function) -> Function:
    """A kernel that makes arrays of its own: what runs now and then, not for every measurement.

    It counts who holds them. So it must not take an array that a plain kernel returns, which
    nobody has counted.
    """
    return _compile(function, nrt=True)


def small_kernel(function: Function) -> Function:
    """A kernel whose code is put in place of every call: calls with many arrays are not free."""
    return _compile(function, inline=True)


def bind(kernel: Callable[..., Any], *arguments: Any) -> Callable[[], Any]:
    """A kernel that is called again and again with the same arguments: arrays filled anew.

    Finding out the types of many arrays takes longer than most kernels do. Here that is done
    once, and the compiled code is then called without a look at them.

    Args:
        kernel: To call.
        arguments: Everything it takes.
    """
    if config.DISABLE_JIT:
        return partial(kernel, *arguments)
    compiled: Any = kernel
    entry = compiled.compile(tuple(_type_of(argument) for argument in arguments))
    return partial(entry, *arguments)


_types: dict[Any, Any] = {}
"""Numba's types by what they depend on: parts of a batch are bound again and again."""


def _type_of(value: Any) -> Any:
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


def fingerprint(kernel: Any) -> str:
    """Hash of a kernel's code and, recursively, of everything that is compiled into it.

    Args:
        kernel: Of any of the three kinds.
    """
    found: str | None = getattr(kernel, "_fingerprint", None)
    if found is None:
        function, sha = kernel.py_func, hashlib.sha256()
        sha.update(repr(sorted(kernel.targetoptions.items(), key=str)).encode())
        for part in _code_parts(function.__code__):
            sha.update(part.encode())
        for name in sorted(_globals_of(function.__code__)):
            if name in function.__globals__:
                sha.update(f"{name}={_describe(function.__globals__[name])};".encode())
        found = kernel._fingerprint = sha.hexdigest()
    return found


def _compile(function: Function, *, inline: bool = False, nrt: bool = False) -> Function:
    compiled = njit(
        cache=True,
        nogil=True,
        error_model="numpy",
        forceinline=inline,
        _nrt=nrt,
    )(function)
    if not config.DISABLE_JIT:
        compiled._cache._cache_file = _CacheFile(compiled)
    return compiled  # type: ignore[no-any-return]


class _CacheFile(IndexDataCacheFile):  # type: ignore[misc]
    """The cache of one kernel; each entry says what it was compiled from, and for which types.

    Entries are numbered files. Where several processes compile at a time, one can find under a
    number what another has saved for other types, or what is left from before a change.
    """

    def __init__(self, compiled: Any) -> None:
        impl = compiled._cache._impl
        # The number of the kernel's first line says nothing about its contents.
        base = re.sub(r"-\d+\.", ".", impl.filename_base, count=1)
        super().__init__(impl.locator.get_cache_path(), base, None)
        self._kernel = compiled

    def load(self, key: Any) -> Any:
        """The compiled code for a key, None if there is none, or none that can be read."""
        self._source_stamp = fingerprint(self._kernel)
        try:
            stamp, data = super().load(key) or (None, None)
        except Exception:
            # A class that has moved, a file that was cut short: what cannot be read is no code.
            return None
        return data if stamp == (self._source_stamp, key) else None

    def save(self, key: Any, data: Any) -> None:
        """Keep compiled code under a key."""
        self._source_stamp = fingerprint(self._kernel)
        super().save(key, ((self._source_stamp, key), data))

    def _load_index(self) -> Any:
        try:
            return super()._load_index()
        except Exception:
            return {}


def _code_parts(code: CodeType) -> Iterator[str]:
    """What a function does, without its names for lines, files and itself, nor its docstring."""
    constants = code.co_consts
    if constants and isinstance(constants[0], str | None):
        constants = constants[1:]  # the docstring, or that there is none
    yield code.co_code.hex()
    yield repr((code.co_names, code.co_varnames, code.co_freevars))
    for constant in constants:
        if isinstance(constant, CodeType):
            yield from _code_parts(constant)
        else:
            yield repr(constant)


def _globals_of(code: CodeType) -> set[str]:
    """Names of the globals that a function reads, those of functions in it included."""
    names, extended = set[str](), 0
    for op, arg in zip(code.co_code[::2], code.co_code[1::2], strict=True):
        if op == opmap["EXTENDED_ARG"]:
            extended = (extended | arg) << 8
            continue
        if op == opmap["LOAD_GLOBAL"]:
            names.add(code.co_names[(extended | arg) >> 1])
        extended = 0
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            names |= _globals_of(constant)
    return names


def _describe(value: Any) -> str:
    """The contents of a global of a kernel."""
    if isinstance(value, Dispatcher):
        return fingerprint(value)
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{value.shape}{value.tobytes().hex()}"
    if isinstance(value, type):
        return f"{value.__module__}.{value.__qualname__}{getattr(value, '_fields', '')}"
    if isinstance(value, ModuleType):
        return value.__name__
    maker = getattr(value, "_defn", value)  # of an intrinsic
    if isinstance(maker, FunctionType):
        return _files_of(maker)
    return repr(value)


def _files_of(function: FunctionType) -> str:
    """The files that a function which writes machine code is made of, its own package's."""
    package = function.__module__.partition(".")[0]
    waiting, files = [function.__globals__], dict[str, str]()
    while waiting:
        names = waiting.pop()
        path = names.get("__file__")
        if path is None or path in files:
            continue
        files[path] = hashlib.sha256(Path(path).read_bytes()).hexdigest()
        for value in names.values():
            if isinstance(value, ModuleType):
                if value.__name__.partition(".")[0] == package:
                    waiting.append(vars(value))
            elif isinstance(value, FunctionType) and value.__module__.startswith(package + "."):
                waiting.append(value.__globals__)
    return " ".join(sorted(files.values()))
