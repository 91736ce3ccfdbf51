"""Entries as they were linked, simplified as for every processor, as files that the package ships.

Most of the time of compilation is numba's, and what it makes depends on the code, on versions and on the platform alone. With
those with which the files were made only LLVM's part for the processor is left to the user's machine, with any others all of it.
Of code in which a processor's vectors have no part that is its machine code alone.
"""

import lzma
import pickle
import sys
from pathlib import Path
from typing import Any

import llvmlite
import llvmlite.binding as llvm
import numba
import numpy as np

from nsmaps.exact.compiling.internals import dumps
from nsmaps.exact.compiling.libraries import optimise

SCALAR = 1e-3  #: share of the lines of code with vectors, as where words are copied, below which they have no part in it
FOLDER = Path(__file__).with_name("entries")
written_to: Path | None = None  #: where entries are written as they are compiled, if anywhere


def versions(codegen: Any) -> tuple[str, ...]:
    """The versions and the platform on which linked code depends, but not the processor."""
    (first, *_), (platform, *_) = np.__version__.split("."), codegen.magic_tuple()
    numbers = numba.__version__, llvmlite.__version__, first, str(sys.implementation.cache_tag)
    return (*numbers, platform)


def read(name: str) -> bytes | None:
    """The content shipped under a name; None if there is none, or if it is damaged."""
    try:
        return lzma.decompress((FOLDER / name).read_bytes())
    except (OSError, lzma.LZMAError):
        return None


def write(name: str, result: Any) -> None:
    """Write the linked code of a compiled entry under a name, if there is a folder for it."""
    linked = getattr(result.library, "linked", None)
    if written_to is not None and linked is not None:
        _, *about = result._reduce()
        module, lines = llvm.parse_bitcode(linked), result.library.get_llvm_str().splitlines()
        scalar = sum(" x double>" in line for line in lines) < SCALAR * len(lines)
        machine = llvm.Target.from_default_triple().create_target_machine()
        optimise(module, machine, unrolled=scalar and result.library.unrolled, vectors=False)
        written_to.mkdir(parents=True, exist_ok=True)
        (written_to / name).write_bytes(lzma.compress(dumps((result.library.name, module.as_bitcode(), scalar, tuple(about)))))


def complete(codegen: Any, content: bytes, kind: type[Any]) -> bytes:
    """Linked code, optimised as a library of its kind and compiled for this processor, as numba keeps compiled functions."""
    name, linked, scalar, about = pickle.loads(content)
    library = kind(codegen, name)
    library._final_module = llvm.parse_bitcode(linked)
    if not scalar:
        optimise(library._final_module, codegen._tm, unrolled=kind.unrolled)
    library._final_module.verify()
    code = codegen._tm.emit_object(library._final_module), library._final_module.as_bitcode()
    return bytes(dumps(((name, "object", code), *about)))
