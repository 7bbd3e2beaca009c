"""Separate compilation and caching of kernels with numba.

By default numba links everything that a function calls into it and optimises all of that again, in
each caller on the way up, and stores it there again; and it compiles a function separately for
constants and for variables of one type. Here

- a kernel is a unit: optimised once, called by its name in machine code. Only small kernels and
  numba's own functions are linked in, and those are optimised with their callers alone;
- a constant argument is of the same type as a variable;
- cached code is stamped with a hash of its sources (`fingerprint`), and loads the units that it
  calls before it runs.

Only this file uses parts of numba that are not public (numba 0.61 to 0.68).
"""

from __future__ import annotations

import hashlib
import logging
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
from numba.core.bytecode import FunctionIdentity
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags
from numba.core.types import Record
from numba.core.types.misc import unliteral
from numba.core.untyped_passes import ExtractByteCode

from tracking.kernels.fingerprint import fingerprint, name_of_record
from tracking.kernels.processors import fitting_levels

_FORMAT = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()
"""Hash of this file: the way of compilation is a part of the sources."""
SHIPPED = "__compiled__"
"""Folder next to modules with code compiled ahead of time, for several processors."""
MANY = 5
"""Number of kernels from which compilation takes seconds."""
_log = logging.getLogger("tracking.kernels.jit")
_kernels: dict[tuple[str, str], Any] = {}
"""Dispatchers by module and name, for units that cached code calls."""
setattr(Record, "mangling_args", property(name_of_record))  # noqa: B010


def compile_as_unit(compiled: Any) -> None:
    """Make a dispatcher compile its function as a unit, and cache it on disk."""
    function = compiled.py_func
    _kernels[function.__module__, function.__qualname__] = compiled
    compiled._compiler.pipeline_class = _UnitCompiler
    compiled._cache = _UnitCache(compiled)
    resolve = compiled.get_call_template

    def resolve_without_constants(args: Any, kws: Any) -> Any:
        named = {name: unliteral(kind) for name, kind in kws.items()}
        return resolve([unliteral(kind) for kind in args], named)

    compiled.get_call_template = resolve_without_constants


def load_unit(compiled: Any, args: tuple[Any, ...]) -> bool:
    """Load a dispatcher's code for some types from disk; False if it has to be compiled."""
    if args in compiled.overloads:
        return True
    found = compiled._cache.load_overload(args, compiled.targetctx)
    if found is None:
        return False
    compiled.targetctx.insert_user_function(found.entry_point, found.fndesc, [found.library])
    compiled.add_overload(found)
    return True


def units_of(package: str) -> list[Any]:
    """Return the dispatchers of the units in the imported modules of a package."""
    return [
        unit
        for (module, _), unit in _kernels.items()
        if f"{module}.".startswith(f"{package}.") and not unit.targetoptions.get("forceinline")
    ]


def is_kept(compiled: Any) -> bool:
    """True if a dispatcher's code, for some types and this processor, is on disk."""
    return bool(compiled._cache.has_code(compiled.targetctx))


class _Unit(JITCodeLibrary):  # type: ignore[misc]
    """Machine code of one kernel for one set of types."""

    _linking_libraries: Any

    def __init__(self, codegen: Any, name: str) -> None:
        super().__init__(codegen, name)
        self.key: Any = None
        """Module and name of the kernel, types; None for one that is linked into its callers."""
        self.calls: list[Any] = []
        """Units that it calls, and those that code linked into it calls."""
        self._names: set[str] | None = None

    def finalize(self) -> None:
        """Link, optimise and emit the code."""
        libraries = self._linking_libraries
        units = [library for library in libraries if getattr(library, "key", None) is not None]
        linked = [library for library in libraries if getattr(library, "key", None) is None]
        inherited = [unit for library in linked for unit in getattr(library, "calls", ())]
        self.calls = list(dict.fromkeys([*units, *inherited]))
        self._linking_libraries = type(libraries)(linked)
        super().finalize()
        for unit in self.calls:
            getattr(self, "_reload_init", set()).update(getattr(unit, "_reload_init", ()))

    def _optimize_final_module(self) -> None:
        if self.key is not None:
            super()._optimize_final_module()

    def defined_names(self) -> set[str]:
        """Return the names of all functions that the code defines."""
        if self._names is None:
            functions = self._final_module.functions
            self._names = {f.name for f in functions if not f.is_declaration}
        return self._names


class _Flags(Flags):  # type: ignore[misc]
    """Compiler flags with fast comparison: every typed call compares them."""

    def values(self) -> dict[str, Any]:
        """Return all flags by name."""
        return {**_DEFAULTS, **self._values}

    def __hash__(self) -> int:
        return _FLAGS_HASH


_DEFAULTS = {name: getattr(Flags(), name) for name in Flags.options}
_FLAGS_HASH = hash(Flags())


class _UnitCompiler(Compiler):  # type: ignore[misc]
    """Numba's compiler, with a `_Unit` for the code."""

    def __init__(self, typing: Any, target: Any, library: Any, args: Any, result: Any,
                 flags: Any, names: Any) -> None:  # fmt: skip
        flags = _Flags(flags)
        flags.no_cfunc_wrapper = True  # kernels are never called from C
        super().__init__(typing, target, library, args, result, flags, names)

    n_compiled = 0
    """Number of units compiled in this process."""

    def compile_extra(self, func: Any) -> Any:
        codegen = self.state.targetctx.codegen()
        self.state.library = library = _Unit(codegen, func.__qualname__)
        library.enable_object_caching()
        if not self.state.flags.forceinline:
            library.key = (func.__module__, func.__qualname__), tuple(self.state.args)
            _UnitCompiler.n_compiled += 1
            if _UnitCompiler.n_compiled == MANY:
                _log.warning("compiling, once, for a minute or two; `relpos warmup` does it ahead")
        self.state.func_id = identity = FunctionIdentity.from_function(func)
        kernel = _kernels.get((func.__module__, func.__qualname__))
        if kernel is not None:
            # Numba numbers functions. Processes that compile in parallel have to agree on names.
            identity.unique_id = int(fingerprint(kernel)[:15], 16)
            identity.unique_name = f"{identity.func_qualname}${identity.unique_id}"
        ExtractByteCode().run_pass(self.state)
        self.state.lifted = ()
        self.state.lifted_from = None
        return self._compile_bytecode()


class _UnitCacheImpl(CompileResultCacheImpl):  # type: ignore[misc]
    """Cached form of a unit: its code, and the names in other units that the code expects."""

    def reduce(self, compiled: Any) -> Any:
        """Return the data for the disk."""
        unit = compiled.library
        library, *rest = super().reduce(compiled)
        defined = unit.defined_names()
        if unit.key is not None:
            # No other code links it, so its code is enough.
            name, kind, (code, _) = library
            library = name, kind, (code, _empty_module(unit))
        calls = [(called.key, called.defined_names()) for called in unit.calls]
        declared = {f.name for f in unit._final_module.functions if f.is_declaration}
        expected = [(key, declared & names) for key, names in calls]
        return unit.key, defined, expected, (library, *rest)

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """Return the unit; None if the code that it calls differs from that at compilation."""
        key, defined, expected, reduced = payload
        calls = []
        for (name, args), names in expected:
            if name not in _kernels:
                return None
            _kernels[name].compile(args)
            unit = _kernels[name].overloads[args].library
            if not names <= unit.defined_names():
                return None
            calls.append(unit)
        target_context.codegen()._engine._defined_symbols.update(defined)
        compiled = super().rebuild(target_context, reduced)
        unit = compiled.library
        unit.key, unit.calls, unit.defined_names = key, calls, lambda: defined
        return compiled


def _empty_module(unit: Any) -> bytes:
    module = llvm.parse_assembly(str(unit.codegen._create_empty_module(unit.name)))
    code: bytes = module.as_bitcode()
    return code


class _UnitCache(FunctionCache):  # type: ignore[misc]
    """The cache of one kernel."""

    _impl_class = _UnitCacheImpl

    def __init__(self, compiled: Any) -> None:
        super().__init__(compiled.py_func)
        self._cache_file = _CacheFile(compiled, self._impl)

    def has_code(self, target_context: Any) -> bool:
        """Return whether there is code for any types that runs on this processor."""
        return self._cache_file.has_code(target_context.codegen().magic_tuple())


class _CacheFile(IndexDataCacheFile):  # type: ignore[misc]
    """Cache file of one kernel; each entry has the hash of its sources, and its types.

    Entries are numbered files. If several processes compile at a time, a number can hold the
    entry of another process for other types, or one from before a change.

    Missing entries are looked up in the installed package, in the folder `SHIPPED` next to the
    kernel's module, with a folder for each kind of processor.
    """

    def __init__(self, compiled: Any, impl: Any) -> None:
        # The line number of the kernel is independent of its contents.
        base = re.sub(r"-\d+\.", ".", impl.filename_base, count=1)
        super().__init__(impl.locator.get_cache_path(), base, None)
        self._kernel = compiled
        folder = Path(compiled.py_func.__code__.co_filename).parent / SHIPPED
        self._shipped: dict[str, IndexDataCacheFile] = {}
        if folder.is_dir():
            for level in fitting_levels():
                self._shipped[level] = IndexDataCacheFile(str(folder / level), base, None)

    def load(self, key: Any) -> Any:
        """Return the compiled code for a key; None if it is missing or cannot be read."""
        stamp = self._stamp()
        for file, at in self._places(key):
            try:
                found, data = file.load(at) or (None, None)
            except Exception:
                # A class that has moved, or a truncated file: unreadable code counts as missing.
                continue
            if found == (stamp, at):
                return data
        return None

    def save(self, key: Any, data: Any) -> None:
        """Save compiled code under a key."""
        super().save(key, ((self._stamp(), key), data))

    def has_code(self, processor: Any) -> bool:
        """Return whether there is code for any types and a processor as named by codegen."""
        self._stamp()
        for file, (_, of, _) in self._places((None, processor, None)):
            try:
                if any(kept == of for _, kept, _ in file._load_index()):
                    return True
            except Exception:
                continue
        return False

    def _places(self, key: Any) -> Iterator[tuple[Any, Any]]:
        """Yield files to search, and the key in each."""
        types, (triple, *_), code = key
        yield super(), key
        for level, file in self._shipped.items():
            file._source_stamp = self._source_stamp
            yield file, (types, (triple, level, ""), code)

    def _stamp(self) -> str:
        self._source_stamp = _FORMAT + fingerprint(self._kernel)
        return self._source_stamp

    def _load_index(self) -> Any:
        try:
            return super()._load_index()
        except Exception:
            return {}
