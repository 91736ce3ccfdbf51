"""Parts and entries: what inner functions are compiled to, and that they outlive, outnumber and replace one another safely."""

import gc
import subprocess
import sys

import numba
import pytest
from messages import message

from nsmaps.exact.compiling.compiled import njit
from nsmaps.exact.compiling.libraries import Entry, Part, libraries_of

part, allocating, entry = njit(part=True, _nrt=False), njit(part=True), njit(part=False)


@part
def twice(x):
    return x + x


@part
def fourfold(x):
    return twice(twice(x))


@entry
def mixed(x):
    return twice(x) + fourfold(x)


@part
def refusing(x):
    if x < 0.0:
        raise ValueError("raised by the test")
    return x


@entry
def rooted(x):
    return refusing(x) + 1.0


@entry
def above(x):
    return rooted(x) + twice(x)


def library(function):
    """The library of the one form that a function was compiled to."""
    (form,) = function.overloads.values()
    return form.library


def test_a_part_is_linked_once_and_has_no_machine_code_of_its_own():
    assert mixed(3.0) == 18.0
    own = library(mixed)
    parts = [found for found in libraries_of(own) if isinstance(found, Part)]
    assert isinstance(own, Entry)
    assert sorted(found.name.split(".")[-1] for found in parts) == ["fourfold", "twice"]
    engine = own.codegen._engine
    for function in (twice, fourfold):
        (form,) = function.overloads.values()
        assert not engine.is_symbol_defined(form.fndesc.llvm_func_name)
        assert form.library.get_pointer_to_function(form.fndesc.llvm_func_name) == 0


def test_constants_are_no_types_of_their_own():
    @part
    def power(x, n):
        for _ in range(n):
            x *= 2.0
        return x

    @entry
    def powers(x, n):
        return power(x, 1) + power(x, 2) + power(x, n)

    assert powers(1.0, 3) == 14.0
    assert len(power.overloads) == 1


def test_an_error_raised_in_a_part_arrives_and_what_follows_is_right():
    for _ in range(3):
        with pytest.raises(ValueError, match=message("others.raised")):
            rooted(-1.0)
        assert rooted(1.0) == 2.0


def test_an_entry_may_be_called_by_another_and_numba_may_call_parts():
    assert above(2.0) == 7.0
    with pytest.raises(ValueError, match=message("others.raised")):
        above(-2.0)
    assert numba.njit(lambda x: mixed(x) + fourfold(x))(1.0) == 10.0


@pytest.mark.thorough
def test_functions_of_one_name_keep_apart():
    def made(k):
        @part
        def inner(x):
            return x + k

        @entry
        def outer(x):
            return inner(x) * 2.0

        return outer

    functions = [made(float(k)) for k in range(4)]
    assert [function(1.0) for function in functions] == [2.0 * (1 + k) for k in range(4)]
    del functions[::2]
    gc.collect()
    assert [function(1.0) for function in functions] == [2.0 * (1 + k) for k in (1, 3)]


STRESS = '''
import ast, faulthandler, gc, os, sys
faulthandler.enable()
os.environ["NSMAPS_CACHE_DIR"] = sys.argv[1]
from nsmaps.exact.compiling.compiled import njit

part, entry = njit(part=True, _nrt=False), njit(part=False, cache=True)


def made(k, broken):
    names = {"__name__": "__main__", "part": part, "entry": entry}
    exec(f"""
@part
def a(x):
    if x < 0.0:
        raise ValueError("negative")
    return x + {k}.0

@part
def b(x):
    return a(x) * a(x + 1.0) {'+ undefined(x)' if broken else ''}

@entry
def low(x):
    return b(x)

@entry
def high(x):
    return low(x) + b(x)
""", names)
    return names["low"], names["high"]


kept, count = [], int(sys.argv[2])
for k in range(3 * count):
    low, high = made(k % count, k % 5 == 4)
    first, second = (low, high) if k % 2 else (high, low)
    want = {id(low): 1, id(high): 2}
    for function in (first, second):
        try:
            assert function(1.0) == want[id(function)] * (1.0 + k % count) * (2.0 + k % count), k
        except Exception as error:
            assert k % 5 == 4 and "undefined" in str(error), (k, error)
        try:
            function(-5.0)
            raise SystemExit("no error")
        except Exception as error:
            assert "negative" in str(error) or k % 5 == 4, (k, error)
    if k % 3 == 0:
        kept.append((k % count, low, k % 5 == 4))
    del low, high, first, second, function
    gc.collect()
    ast.parse("x = [" + "1 + 2, " * 2000 + "]")
for k, low, broken in kept:
    if not broken:
        assert low(1.0) == (1.0 + k) * (2.0 + k)
print("whole")
'''


@pytest.mark.parametrize("count", [3, pytest.param(8, marks=pytest.mark.thorough)])
def test_many_versions_failures_and_collected_functions_leave_the_process_whole(count, tmp_path):
    script, kernels = tmp_path / "stress.py", tmp_path / "kernels"
    script.write_text(STRESS)
    for turn in (0, 2) if count == 3 else range(3):  # from an empty folder of compiled code, a full one, half of one
        for file in sorted(kernels.glob("*.bin"))[::2] if turn == 2 else []:
            file.unlink()
        done = subprocess.run([sys.executable, script, kernels, str(count)], capture_output=True, text=True, check=False)
        assert done.stdout == "whole\n", done.stderr


ORDER = """
import os, sys
os.environ["NSMAPS_CACHE_DIR"] = sys.argv[1]
from nsmaps.exact.compiling.compiled import njit


def made(k):
    names = {"__name__": "__main__", "entry": njit(part=False, cache=True)}
    exec(f"@entry\\ndef one(x):\\n    return x + {k}.0", names)
    return names["one"]


functions = [made(int(k)) for k in sys.argv[2:]]
values = [function(1.0) for function in functions]
first, last = functions[0], functions[-1]
both = njit(part=False)(lambda x: 10.0 * first(x) + last(x))
print(*values, both(1.0))
"""


def test_compiled_functions_of_two_programs_that_have_one_name_keep_apart(tmp_path):
    script = tmp_path / "order.py"
    script.write_text(ORDER)
    for versions, values in ((["1"], "2.0 22.0\n"), (["2", "1"], "3.0 2.0 32.0\n"), (["3", "1", "2"], "4.0 2.0 3.0 43.0\n")):
        command = [sys.executable, script, tmp_path / "kernels", *versions]
        assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == values
