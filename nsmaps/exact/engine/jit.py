"""Compilation of the engine: inner functions without Python wrappers, entry points stored on disk."""

import math
from functools import cache
from types import ModuleType
from typing import Any

from numba import cfunc, types

from nsmaps.exact.compiling.compiled import njit

LEAN = {"part": True, "nogil": True, "error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "_nrt": False}
inner = njit(**LEAN)  #: without wrappers, and without counting references to arrays: it allocates none
inlined = njit(**LEAN, forceinline=True)
fused = njit(**LEAN, forceinline=True, fastmath={"contract"})  #: a product and a sum may be rounded once
allocating = njit(**{**LEAN, "_nrt": True})  #: as `inner`, for functions that allocate arrays
ENTRY = {"cache": True, "part": False, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
entry = njit(**ENTRY)
long_entry = njit(**ENTRY, long=True)  #: an entry of much code, which is compiled in less time


NUMBER, PLACE = types.float64, types.CPointer(types.float64)
LAWS = {
    "impact law": NUMBER(NUMBER, PLACE),  #: of speed and parameters
    "impact law in balls": types.void(NUMBER, NUMBER, PLACE, PLACE),  #: of centre, radius, parameters and what is written
    "reset": types.void(NUMBER, PLACE, PLACE, PLACE),  #: of phase, states, parameters and what is written
}


@cache  # its address is kept elsewhere
def law_of(kind: str, text: str, *modules: ModuleType) -> Any:
    """The compiled callback of a function `law`, one of `LAWS`, given by its source, and modules whose functions it may call."""
    known = {name: value for module in modules for name, value in vars(module).items()} | {"math": math}
    exec(compile(text, f"<{kind}>", "exec"), known)
    return cfunc(LAWS[kind], error_model="numpy")(known["law"])
