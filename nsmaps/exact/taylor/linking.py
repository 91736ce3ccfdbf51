"""The address of heyoka's step: what compiled code calls to expand a flight, in any number of threads.

It is `void step(double *state, const double *par, const double *time, double *h, double *tc)`. With h = 0 it leaves the state and
writes the Taylor coefficients of all states to `tc`, shape (states, order + 1).
"""

import ctypes
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from nsmaps.arrays import Floats

STEP = "step"  #: the name of the function in heyoka's object code
LIBRARIES = "libheyoka", "libsleef"  #: whose functions it calls
MAPPED = Path("/proc/self/maps")  #: of files into the memory of this process
FIELDS = 5  #: of a line before the path
POINTER = ctypes.c_void_p
SIGNATURE = ctypes.CFUNCTYPE(None, *[POINTER] * 5)


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """A step by its address, and all that must live as long as this."""

    address: int
    owner: Any


def step_of(program: Any) -> Step:
    """The step of heyoka's `taylor_adaptive`: its own machine code, or where that cannot be linked a call of Python."""
    try:
        return link_step(program)
    except Exception:  # whatever the versions of heyoka and llvmlite differ in
        return python_step(program)


def link_step(program: Any) -> Step:
    """The machine code of a program that is not compact, linked by llvmlite. Raises an error of any kind where it cannot be."""
    from llvmlite import binding as llvm

    _load_libraries()
    compiled = llvm.ObjectFileRef.from_data(program.llvm_state.object_code)
    machine = llvm.Target.from_default_triple().create_target_machine(codemodel="jitdefault", jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(compiled)
    engine.finalize_object()
    address = int(engine.get_function_address(STEP))
    if not address:
        raise LookupError(f"heyoka's object code has no function {STEP!r}")
    return Step(address, (engine, machine, program))


@cache
def _load_libraries() -> None:
    """Let machine code find the functions of the libraries that heyoka has loaded."""
    from llvmlite import binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    paths = {line.split(maxsplit=FIELDS).pop() for line in MAPPED.read_text().splitlines()}
    for path in sorted(path for path in paths if Path(path).name.startswith(LIBRARIES)):
        llvm.load_library_permanently(path)


def python_step(program: Any) -> Step:
    """A function of C that calls Python to make the step of a program, one thread at a time."""
    lock = Lock()

    def expand(state: int, par: int, time: int, _: int, tc: int) -> None:
        out = _array(tc, program.tc.size)
        try:
            with lock:
                program.state[:] = _array(state, program.state.size)
                program.pars[:] = _array(par, program.pars.size)
                program.time = _array(time, 1).item()
                program.step(max_delta_t=0.0, write_tc=True)
                out[:] = program.tc.ravel()
        except Exception:  # which cannot pass through C: a state beyond the range of floats
            out[:] = np.nan

    function = SIGNATURE(expand)
    return Step(int(ctypes.cast(function, POINTER).value or 0), function)


def _array(address: int, size: int) -> Floats:
    """The floats at an address, shape (size,)."""
    return np.ctypeslib.as_array((ctypes.c_double * size).from_address(address)) if size else np.empty(0)
