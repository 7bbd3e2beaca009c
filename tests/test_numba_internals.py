"""Private parts of numba that `tracking.kernels.compile_units` uses: the first test to read
when a new numba breaks the others. Each name has its purpose."""

import inspect

import numba
import pytest
from numba import njit
from numba.core import bytecode, caching, codegen, compiler, untyped_passes

USED = [
    (caching.IndexDataCacheFile, "_load_index", "entries of a kernel's file on the disk"),
    (caching.IndexDataCacheFile, "load", "code of a kernel from the disk"),
    (caching.IndexDataCacheFile, "save", "code of a kernel to the disk"),
    (caching.CompileResultCacheImpl, "reduce", "what is kept of compiled code"),
    (caching.CompileResultCacheImpl, "rebuild", "compiled code from what was kept"),
    (caching.FunctionCache, "load_overload", "the cache of a dispatcher"),
    (codegen.JITCodeLibrary, "finalize", "linking and optimising one kernel"),
    (codegen.JITCodeLibrary, "_optimize_final_module", "leaving linked code as it is"),
    (codegen.JITCodeLibrary, "enable_object_caching", "machine code to keep"),
    (codegen.JITCPUCodegen, "magic_tuple", "naming the processor"),
    (codegen.JITCPUCodegen, "_create_empty_module", "a module in place of one that is not kept"),
    (compiler.Compiler, "compile_extra", "the compiler of one kernel"),
    (compiler.Compiler, "_compile_bytecode", "the same, after its name is set"),
    (bytecode.FunctionIdentity, "from_function", "the name of a kernel in machine code"),
    (untyped_passes.ExtractByteCode, "run_pass", "the first step of the compiler"),
]


@pytest.mark.parametrize(
    ("owner", "name", "use"), USED, ids=lambda part: getattr(part, "__name__", part)
)
def test_what_is_used_of_numba_is_there(owner, name, use):
    assert hasattr(owner, name), f"numba {numba.__version__}: {owner.__name__}.{name}, for {use}"


def test_the_first_arguments_are_those_that_are_given():
    expected = {
        caching.IndexDataCacheFile: ["cache_path", "filename_base", "source_stamp"],
        compiler.Compiler: ["typingctx", "targetctx", "library", "args", "return_type", "flags"],
    }
    for owner, names in expected.items():
        found = list(inspect.signature(owner).parameters)[: len(names)]
        assert found == names, f"numba {numba.__version__}: {owner.__name__} takes {found}"


def test_a_dispatcher_has_its_parts():
    compiled = njit(lambda x: x)
    for name, use in (
        ("_cache", "replacing its cache"),
        ("_compiler", "replacing its compiler"),
        ("targetctx", "loading code"),
        ("overloads", "what it is compiled for"),
        ("get_call_template", "constants as variables"),
    ):
        assert hasattr(compiled, name), f"numba {numba.__version__}: Dispatcher.{name}, for {use}"
    assert hasattr(compiled._compiler, "pipeline_class"), "_FunctionCompiler.pipeline_class"


def test_functions_have_the_names_and_numbers_that_are_set():
    identity = bytecode.FunctionIdentity.from_function(lambda x: x)
    for name in ("unique_id", "unique_name", "func_qualname"):
        assert hasattr(identity, name), f"numba {numba.__version__}: FunctionIdentity.{name}"
