"""Compilation of the engine: inner functions without Python wrappers, entry points stored on disk."""

import math
from typing import Any

from numba import cfunc, types

from nsmaps.exact.compiling.compiled import njit

LEAN = {
    "part": True,
    "nogil": True,
    "error_model": "numpy",
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "_nrt": False,
}
inner = njit(**LEAN)  #: without wrappers, and without counting references to arrays: it allocates none
inlined = njit(**LEAN, forceinline=True)
fused = njit(**LEAN, forceinline=True, fastmath={"contract"})  #: a product and a sum may be rounded once
allocating = njit(**{**LEAN, "_nrt": True})  #: as `inner`, for functions that allocate arrays
ENTRY = {"cache": True, "part": False, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
entry = njit(**ENTRY)
long_entry = njit(**ENTRY, long=True)  #: an entry of much code, which is compiled in less time


def law_of(text: str) -> Any:
    """The compiled callback of a function `law(speed, parameters)` given by its source."""
    names: dict[str, Any] = {"math": math}
    exec(compile(text, "<impact law>", "exec"), names)
    return cfunc(types.float64(types.float64, types.CPointer(types.float64)), error_model="numpy")(names["law"])


def ball_law_of(text: str, names: dict[str, Any]) -> Any:
    """The compiled callback of a function `law(centre, radius, parameters, out)` given by its source, and the functions that it
    may call.
    """
    found: dict[str, Any] = {**names, "math": math}
    exec(compile(text, "<impact law in balls>", "exec"), found)
    pointer = types.CPointer(types.float64)
    return cfunc(types.void(types.float64, types.float64, pointer, pointer), error_model="numpy")(found["law"])


def reset_law_of(text: str) -> Any:
    """The compiled callback of a function `law(phase, states, parameters, out)` given by its source."""
    names: dict[str, Any] = {"math": math}
    exec(compile(text, "<reset>", "exec"), names)
    pointer = types.CPointer(types.float64)
    return cfunc(types.void(types.float64, pointer, pointer, pointer), error_model="numpy")(names["law"])
