"""How compiled functions are put together: inner ones are parts of the entries that reach them, and are optimised there alone.

Numba optimises every function with copies of all that it calls, and makes machine code of it even if only compiled functions
call it: in a deep tree of calls a function is optimised once for each way that leads to it. A `Part` is kept as it was lowered.
An `Entry` links each part that it reaches once, as functions that nothing else can call, and is then optimised and compiled as
one module. No compiled object refers to another, so the order in which objects are loaded or released does not matter.
"""

import os
from collections.abc import Iterator
from typing import Any
from uuid import uuid4

import llvmlite.binding as llvm
from numba import config, types

from nsmaps.exact.compiling.internals import UNUSED, Compiler, FunctionCompiler, Library, lookup_environment

ENVIRONMENT = "_ZN08NumbaEnv"  #: what begins the names under which numba's code finds its Python objects
PROCESS = uuid4().hex  #: of this process and those that are forked from it


class _WithoutCode:
    """The code generator of a library without machine code, which has no place for Python objects."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, env_name: str, env: Any) -> None:
        """Nothing: no machine code reads the environment."""


class Part(Library):  # type: ignore[misc]
    """A function as it was lowered, without machine code."""

    @property
    def codegen(self) -> Any:
        """The code generator, as numba's compiler asks for it."""
        return _WithoutCode(self._codegen)

    def finalize(self) -> None:
        """The function is complete; raises RuntimeError if it was before."""
        self._raise_if_finalized()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Zero, by which numba marks a function without machine code."""
        return 0

    def alone(self) -> Any:
        """The module of this function without those that it calls."""
        self._ensure_finalized()
        return self._final_module

    def _get_module_for_linking(self) -> Any:
        """The module with all that the function reaches, for functions that numba's own libraries hold."""
        module = self.alone().clone()
        for name in link_parts(module, self):
            module.get_function(name).linkage = "linkonce_odr"
        return module


class Entry(Library):  # type: ignore[misc]
    """A function that Python calls, with all parts that it reaches."""

    linked: bytes | None = None  #: with all parts, before it is optimised
    unrolled = True  #: whether LLVM unrolls loops

    def finalize(self) -> None:
        """Link, optimise and compile; raises RuntimeError if that was done before."""
        self._codegen._check_llvm_bugs()
        self._raise_if_finalized()
        if hasattr(self, "_reload_init"):  # which the oldest numba allowed does not have
            for library in libraries_of(self):
                self._reload_init.update(library._reload_init)
        for name in link_parts(self._final_module, self):
            self._final_module.get_function(name).linkage = "internal"
        self.linked = self._final_module.as_bitcode()
        self._optimize_final_module()
        self._final_module.verify()
        self._finalize_final_module()
        self._environments = list(self._connections())  # compiled code holds their addresses alone

    def _connections(self) -> Iterator[Any]:
        """Connect the compiled code to the Python objects of its parts, as numba does for a single function."""
        for variable in self._final_module.global_variables:
            environment = lookup_environment(variable.name) if variable.name.startswith(ENVIRONMENT) else None
            if environment is not None:
                self._codegen.set_env(variable.name, environment)
                yield environment


class LongEntry(Entry):
    """An entry of much code, of which LLVM unrolls no loop and which it optimises once, not twice as numba does.

    The code takes two thirds of the time to compile, and runs as fast: its loops are those over lanes, which become vector
    instructions, or over few states.
    """

    unrolled = False

    def _optimize_final_module(self) -> None:
        """The passes of LLVM at numba's settings."""
        optimise(self._final_module, self._codegen._tm, unrolled=self.unrolled)


def optimise(module: Any, machine: Any, *, unrolled: bool = False, vectors: bool = True) -> None:
    """Run the passes of LLVM at numba's settings once; without vectors the code is still one for every processor."""
    options = llvm.create_pipeline_tuning_options(speed_level=int(config.OPT))
    options.loop_vectorization = vectors and bool(config.LOOP_VECTORIZE)
    options.slp_vectorization = vectors and bool(config.SLP_VECTORIZE)
    options.loop_unrolling = unrolled
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)


def libraries_of(library: Any) -> list[Any]:
    """The libraries that a library calls, by way of parts also, each once, parts first."""
    found, waiting = {library: None}, list(library._linking_libraries)  # a dict keeps the order
    while waiting:
        called = waiting.pop()
        if called not in found:
            found[called] = None
            waiting += called._linking_libraries if isinstance(called, Part) else []
    return sorted(list(found)[1:], key=lambda called: not isinstance(called, Part))


def link_parts(module: Any, library: Any) -> list[str]:
    """Link all that a library reaches into a module; returns the names of the functions that are parts.

    A function that several modules may define is only linked if it is called already: parts, defined once, come first.
    """
    names = []
    for called in libraries_of(library):
        part = isinstance(called, Part)
        more = called.alone() if part else called._get_module_for_linking()
        names += [function.name for function in more.functions if part and not function.is_declaration]
        module.link_in(more, preserve=True)
    return names


class NamedCompiler(Compiler):  # type: ignore[misc]
    """Numba's compiler, with names of functions that no process uses twice, nor two processes the same.

    Numba counts the functions of each process, so that one from the disk and another of a later version may have one name. Where
    both are called by a third, LLVM would take them for the same.
    """

    library: type[Library] = Library

    def define_pipelines(self) -> Any:
        """The passes of numba."""
        function = self.state.func_id
        function.unique_id = f"{function.unique_id}p{os.getpid()}p{PROCESS}"
        if self.state.library is None:
            self.state.library = self.library(self.state.targetctx.codegen(), function.func_qualname)
            self.state.library.enable_object_caching()
        return super().define_pipelines()


class PartCompiler(NamedCompiler):
    """Compiles a function to a `Part`."""

    library = Part

    def define_pipelines(self) -> Any:
        """The passes of numba but those for what parts do not contain."""
        managers = super().define_pipelines()
        for manager in managers:
            manager.passes = [(each, about) for each, about in manager.passes if each not in UNUSED]
            manager._finalized = False
            manager.finalize()
        return managers


class EntryCompiler(NamedCompiler):
    """Compiles a function to an `Entry`."""

    library = Entry


class LongEntryCompiler(NamedCompiler):
    """Compiles a function to a `LongEntry`."""

    library = LongEntry


class Unspecialised(FunctionCompiler):  # type: ignore[misc]
    """Compiles a function once for all constants that it may be called with, which numba takes for types of their own."""

    def fold_argument_types(self, args: Any, kws: Any) -> Any:
        """The signature and the types of the arguments."""
        signature, found = super().fold_argument_types(args, kws)
        return signature, tuple(map(types.unliteral, found))


def compile_for_all_constants(dispatcher: Any) -> None:
    """Have a function compiled by `Unspecialised`."""
    old = dispatcher._compiler
    dispatcher._compiler = Unspecialised(old.py_func, old.targetdescr, old.targetoptions, old.locals, old.pipeline_class)
