"""numba's `njit` with a cache whose key holds everything on which compiled code depends.

The cache of numba identifies a function by the text of its file alone, although functions and constants of other files may have
changed, and two processes that fill its index at the same time may exchange two entries. Here every compiled function has a file
of its own. Its name is a hash of the code of the function and of all functions that it calls, of the values of their constants,
of the types of the arguments, and of the compiler: versions of numba, llvmlite, NumPy and Python, settings of numba, features of
the processor.
"""

import gc
import pickle
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import wraps
from hashlib import sha256
from pathlib import Path
from time import perf_counter
from typing import Any
from warnings import warn

import llvmlite
import numba
import numpy as np

from nsmaps.exact.compiling import addresses, internals, libraries, linked
from nsmaps.exact.compiling.digest import Dispatcher, code_of, code_of_module
from nsmaps.exact.compiling.internals import Cache, CompileResult, dumps, rtsys
from nsmaps.exact.compiling.kept import cache_folder, claim, read, release, store
from nsmaps.exact.compiling.libraries import (
    EntryCompiler,
    LongEntryCompiler,
    NamedCompiler,
    PartCompiler,
    compile_for_all_constants,
)
from nsmaps.exact.compiling.linked import versions

SETTINGS = ("OPT", "BOUNDSCHECK", "LOOP_VECTORIZE", "SLP_VECTORIZE", "DEBUGINFO_DEFAULT")  #: of numba; they change the code
OBJECTS = 100_000  #: made by the compiler from one search for unused ones to the next; Python itself takes some hundreds
PUBLIC = ("nogil", "error_model", "fastmath", "forceinline")  #: options of `numba.njit` that functions of the engine have
if internals.absent:
    warn(
        f"numba {numba.__version__} lacks {', '.join(internals.absent)}; functions are compiled by it alone, which takes longer",
        RuntimeWarning,
        stacklevel=2,
    )
missing: list[Callable[[], None]] = []  #: called when code is to be compiled


def njit(**options: Any) -> Any:
    """`numba.njit`; a function with `cache=True` is stored in the folder of compiled code.

    A function with `part=True` is a part of the entries that call it, one with `part=False` is an entry, with `long=True` one
    of much code: see `libraries.py`. Where numba lacks what that needs, all are functions of `numba.njit` alone.
    """
    if internals.absent:
        return _plain(options)
    cache, part, long = options.pop("cache", False), options.pop("part", None), options.pop("long", False)
    entry = LongEntryCompiler if long else EntryCompiler
    options["pipeline_class"] = NamedCompiler if part is None else PartCompiler if part else entry

    def wrapper(function: Any) -> Any:
        dispatcher = numba.njit(**options)(function)
        if part is not None and isinstance(dispatcher, Dispatcher):
            compile_for_all_constants(dispatcher)
        if cache and isinstance(dispatcher, Dispatcher):
            dispatcher._cache = _Kept(dispatcher)
            dispatcher._compiler.compile = _or_released(dispatcher._compiler.compile)
        return dispatcher

    return wrapper


def _plain(options: dict[str, Any]) -> Any:
    """The decorator of numba itself, with its own cache for functions of files."""
    known = {name: value for name, value in options.items() if name in PUBLIC}

    def wrapper(function: Any) -> Any:
        return numba.njit(**known, cache=options.get("cache", False) and Path(function.__code__.co_filename).exists())(function)

    return wrapper


@contextmanager
def _released_if_it_fails() -> Iterator[None]:
    """A failure ends all claims of this process. Unused objects, which it takes a tenth of the time to look for, may wait."""
    often, *others = gc.get_threshold()
    gc.set_threshold(max(OBJECTS, often), *others)
    try:
        yield
    except BaseException:
        release()
        raise
    finally:
        gc.set_threshold(often, *others)


def _or_released(compilation: Callable[..., Any]) -> Callable[..., Any]:
    """A call whose failure ends all claims of this process."""

    @wraps(compilation)
    def compile_or_release(*args: Any) -> Any:
        with _released_if_it_fails():
            return compilation(*args)

    return compile_or_release


def compilers() -> tuple[str, ...]:
    """The versions and settings of the compiler, except for the processor, which numba identifies."""
    versions = numba.__version__, llvmlite.__version__, np.__version__, sys.version
    return versions + settings()


def settings() -> tuple[str, ...]:
    """The settings of numba that change the code, and how functions are put together."""
    return (*(f"{name}={vars(numba.config)[name]}" for name in SETTINGS), *map(code_of_module, (addresses, libraries, internals)))


class _Kept(Cache):  # type: ignore[misc]
    """The compiled forms of one function, one file each, in place of numba's cache, which has no public extension point."""

    def __init__(self, function: Any) -> None:
        self._function = function
        self._began = 0.0

    @property
    def cache_path(self) -> str:
        """The folder."""
        return str(cache_folder())

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled function for arguments of these types, or None."""
        rtsys.initialize(target_context)  # all that compiled code calls; to compile, numba loads much more
        name = self._name(sig, target_context.codegen())
        content = read(name)
        if content is None:
            content = self._complete(name, sig, target_context.codegen())
        try:
            return None if content is None else CompileResult._rebuild(target_context, *pickle.loads(content))
        except ImportError:  # the module of the same code has another name by now
            return None

    def _complete(self, name: str, sig: Any, codegen: Any) -> bytes | None:
        """What is shipped in linked form, or what another process stores in the meantime; None if this one has to compile it."""
        self._began = perf_counter()
        shipped = linked.read(self._name(sig, codegen, shipped=True))
        self._report()
        for each in [*missing] if shipped is None else ():
            each()
        claim(name)
        content = read(name)
        if content is None and shipped is not None:
            with _released_if_it_fails():
                content = linked.complete(codegen, shipped, self._function._compiler.pipeline_class.library)
            self._write(name, content)
        if content is not None:
            release(name)
        return content

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store the function that was compiled for arguments of these types."""
        name = self._name(sig, data.codegen)
        if not data.library.has_dynamic_globals and all(each.can_cache for each in data.lifted):
            self._write(name, dumps(data._reduce()))
            linked.write(self._name(sig, data.codegen, shipped=True), data)
        release(name)

    def _write(self, name: str, content: bytes) -> None:
        """Store a function, and the time that it took."""
        store(name, content)
        store(self._last, f"{perf_counter() - self._began:.0f}".encode())

    def enable(self) -> None:
        """The cache is always enabled."""

    def disable(self) -> None:
        """The cache cannot be disabled."""

    def flush(self) -> None:
        """Files of other code are left unchanged."""

    @property
    def _last(self) -> str:
        """The name of the file with the seconds that the last compilation of the function took."""
        return f"{self._function.py_func.__module__}.{self._function.py_func.__name__}.seconds"

    def _report(self) -> None:
        """Report on a terminal that a function is being compiled; without a terminal, write nothing."""
        if sys.stderr is not None and sys.stderr.isatty():
            last, name = read(self._last), self._function.py_func.__name__
            took = "it takes some seconds" if last is None else f"it took {last.decode()} s last time"
            print(f"compiling {name}, once on this machine: {took}", file=sys.stderr, flush=True)

    def _name(self, sig: Any, codegen: Any, shipped: bool = False) -> str:
        """The name of the file with the compiled function, or with the linked one, which does not depend on the processor."""
        function = self._function.py_func
        about = function.__module__, function.__name__, code_of(self._function), " ".join(map(_type_text, sig))
        return _linked_name(*about, versions(codegen)) if shipped else _file_name(*about, codegen.magic_tuple())


def _type_text(kind: Any) -> str:
    """A numba type with the modules of the named tuples in it, from which a stored function is read back."""
    inner = " ".join(map(_type_text, getattr(kind, "types", ())))
    return f"{kind} {getattr(getattr(kind, 'instance_class', None), '__module__', '')} {inner}"


def _file_name(module: str, name: str, code: str, sig: str, processor: Iterable[str]) -> str:
    return f"{name}-{_short((module, code, sig, tuple(processor), compilers()))}.bin"


def _linked_name(module: str, name: str, code: str, sig: str, versions: Iterable[str]) -> str:
    return f"{name}-{_short((module, code, sig, tuple(versions), settings()))}.xz"


def _short(key: tuple[Any, ...]) -> str:
    return sha256(repr(key).encode()).hexdigest()[:32]
