"""Hash of the sources of compiled code, which names it in the cache on disk.

Numba names cached code after the time of the kernel's own file. But small kernels are compiled into
their callers, and so are the constants that they import. `fingerprint` hashes the contents of all
of these: a change of any of them compiles the kernel again; other changes and copies with new file
times do not.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dis import opmap
from functools import lru_cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np
from numba.core.dispatcher import Dispatcher


def fingerprint(kernel: Any) -> str:
    """Return the hash of a kernel's code and, recursively, of everything compiled into it.

    Args:
        kernel: A kernel of any of the three decorators.
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


@lru_cache
def name_of_record(record: Any) -> tuple[str, tuple[str]]:
    """Return the name of a record in machine code: a hash of its fields.

    Numba uses a number of the process in its place. Code from the disk and code of this process
    could then have one name for functions of different records, and be mistaken for each other.
    """
    return "Record", (hashlib.sha256(record.name.encode()).hexdigest()[:20],)


def _code_parts(code: CodeType) -> Iterator[str]:
    """Yield a function's code without its names for lines, files and itself, and its docstring."""
    constants = code.co_consts
    if constants and isinstance(constants[0], str | None):
        constants = constants[1:]  # the docstring or its absence
    yield code.co_code.hex()
    yield repr((code.co_names, code.co_varnames, code.co_freevars))
    for constant in constants:
        if isinstance(constant, CodeType):
            yield from _code_parts(constant)
        else:
            yield repr(constant)


def _globals_of(code: CodeType) -> set[str]:
    """Return the names of globals that a function and its inner functions read."""
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
    """Return the contents of a global of a kernel."""
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
    """Return hashes of the files of its own package that a code generator depends on."""
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
