"""Branches and their events against other programs: `python docs/benchmarks/branches.py auto|mappy FOLDER [TURNS]`.

FOLDER is where AUTO-07p is built, or where MapPy's sources lie (it needs NumPy before 2.4). Both programs get the equations
written here. Times are processor time of the shortest of some turns, without compilation; errors are those of the events' values
against DOP853 at a tolerance of 1e-13 with variational equations, and Newton's method on orbit and multiplier.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from time import process_time

import numpy as np
from nsmaps_neuron import Neuron
from pydantic import Field
from scipy.integrate import solve_ivp
from scipy.optimize import root

import nsmaps

NEURON = {"a": 0.2, "b": 0.2, "c": -50.0, "d": 2.0}
FORTRAN = """SUBROUTINE FUNC(NDIM,U,ICP,PAR,IJAC,F,DFDU,DFDP)
  INTEGER NDIM, ICP(*), IJAC
  DOUBLE PRECISION U(NDIM), PAR(*), F(NDIM), DFDU(NDIM,NDIM), DFDP(NDIM,*), S
  S = U(3)**2 + U(4)**2
  F(1) = U(2)
  F(2) = PAR(1)*U(4) - 0.25D0*U(2) + U(1) - U(1)**3
  F(3) = U(3) + U(4) - U(3)*S
  F(4) = -U(3) + U(4) - U(4)*S
END SUBROUTINE
SUBROUTINE STPNT(NDIM,U,PAR,T)
  INTEGER NDIM
  DOUBLE PRECISION U(NDIM), PAR(*), T, TURN
  TURN = 8*ATAN(1D0)
  PAR(1) = 0D0
  PAR(11) = TURN
  U = (/ 1D0, 0D0, SIN(TURN*T), COS(TURN*T) /)
END SUBROUTINE
""" + "".join(f"SUBROUTINE {name}\nEND SUBROUTINE\n" for name in ("BCND", "ICND", "FOPT", "PVLS"))
CONSTANTS = """NDIM=4, IPS=2, ILP=1, ICP=[1,11], NTST={}, NCOL=4, IAD=3, ISP=2, ISW=1, IPLT=0, MXBF=0, IID=2, JAC=0
NMX=400, NPR=1000, ITMX=8, ITNW=7, NWTN=3, EPSL=1e-10, EPSU=1e-10, EPSS=1e-10, NPAR=11, THL={{11:0.0}}
DS=0.01, DSMIN=1e-5, DSMAX=0.05, IADS=1, UZSTOP={{1:[-0.05,0.6]}}
"""
KINDS = {5: "fold", 7: "period doubling"}  #: of AUTO's labels


class Well(nsmaps.HybridSystem):
    """Duffing's oscillator x'' + x'/4 - x + x^3 = f cos t, from maximum to maximum."""

    f: float = Field(0.1)

    states = ("x", "v")

    def period(self):
        """Of the forcing."""
        from sympy import pi

        return 2 * pi

    def modes(self, t, y):
        """One."""
        from sympy import cos

        return {"well": {"x": y.v, "v": self.f * cos(t) - y.v / 4 + y.x - y.x**3}}

    def guards(self, t, y):
        """The maximum."""
        return {"M": nsmaps.Guard("well", y.v)}

    def section(self, t, y):
        """Place and phase of the maximum."""
        return nsmaps.PoincareSection("M", ("x", "phi"))


def linearised(rates, jacobian, y, end, event=None):
    """The state and the derivative of a flight to a time or to an event."""
    n = len(y)

    def both(t, z):
        return np.append(rates(t, z[:n]), jacobian(z[:n]) @ z[n:].reshape(n, n))

    z = solve_ivp(both, (0, end), np.append(y, np.eye(n)), "DOP853", events=event, rtol=1e-13, atol=1e-14).y[:, -1]
    return z[:n], z[n:].reshape(n, n)


def well_reference(x, v, f, multiplier):
    """The forcing of Duffing's oscillator at which the orbit near x, v has this multiplier."""

    def off(z):
        rates = lambda t, y: [y[1], z[2] * np.cos(t) - y[1] / 4 + y[0] - y[0] ** 3]  # noqa: E731
        image, slopes = linearised(rates, lambda y: np.array([[0, 1], [1 - 3 * y[0] ** 2, -0.25]]), z[:2], 2 * np.pi)
        return *(image - z[:2]), np.linalg.det(slopes - multiplier * np.eye(2))

    return root(off, [x, v, f], tol=1e-14).x[2]


def neuron_reference(u, current, a):
    """The current at which the orbit of one spike doubles its period."""
    spike = lambda t, z: z[0] - 30  # noqa: E731
    spike.terminal = True

    def off(z):
        rates = lambda t, y: np.array([y[0] ** 2 / 25 + 5 * y[0] + 140 - y[1] + z[1], a * (0.2 * y[0] - y[1])])  # noqa: E731
        jacobian = lambda y: np.array([[2 * y[0] / 25 + 5, -1], [0.2 * a, -a]])  # noqa: E731
        end, slopes = linearised(rates, jacobian, [-50, z[0]], 1e3, spike)
        final = rates(0, end)
        slope = slopes[1, 1] - final[1] / final[0] * slopes[0, 1]
        return end[1] + 2 - z[0], slope + 1

    return root(off, [u, current], tol=1e-14).x[1]


def shortest(run, turns):
    """The result, and the processor time of the shortest turn after one."""
    found, best = run(), np.inf
    for _ in range(turns):
        begin = process_time()
        run()
        best = min(best, process_time() - begin)
    return found, best


def auto(folder, turns):
    """Lines of the table: the resonance of Duffing's oscillator in its forcing, f from 0.1 to 0.6."""
    system = Well()
    orbit = nsmaps.periodic_orbit(system, [1.098, 0.225])
    branch, ours = shortest(lambda: nsmaps.continue_branch(system, "f", orbit, 0.1, (0.05, 0.6)), turns)
    true = [
        well_reference(*near, 1 - 2 * (event.kind == "period doubling"))
        for event, near in zip(branch.events, starts(branch), strict=True)
    ]
    yield row("nsmaps", [event.value for event in branch.events], true, ours, ours)
    with tempfile.TemporaryDirectory() as place:
        for intervals in (50, 200):
            values, time = auto_run(folder, place, intervals, turns)
            yield row(f"AUTO, {intervals} intervals", values, true, time, ours)


def starts(branch):
    """A state at phase zero, and the forcing, near each event."""
    for event in branch.events:
        x, phase = event.orbit.states[0]
        rates = lambda t, y, f=event.value: [y[1], f * np.cos(t) - y[1] / 4 + y[0] - y[0] ** 3]  # noqa: E731
        y = solve_ivp(rates, (phase, 2 * np.pi), [x, 0], "DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
        yield *y, event.value


def auto_run(folder, place, intervals, turns):
    """The values of AUTO's folds and period doublings, and its time."""
    Path(place, "well.f90").write_text(FORTRAN)
    for name in ("c.well", "fort.2"):
        Path(place, name).write_text(CONSTANTS.format(intervals))
    Path(place, "fort.3").touch()
    given = {**os.environ, "AUTO_DIR": folder, "OMP_NUM_THREADS": "1"}
    subprocess.run([f"{folder}/cmds/@r", "well"], cwd=place, env=given, check=True, capture_output=True)
    Path(place, "fort.2").write_text(CONSTANTS.format(intervals))
    Path(place, "fort.3").touch()
    best = np.inf
    for _ in range(turns):
        begin = getrusage(RUSAGE_CHILDREN)
        subprocess.run(["./well.exe"], cwd=place, env=given, check=True, capture_output=True)
        end = getrusage(RUSAGE_CHILDREN)
        best = min(best, end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime)
    lines = [line.split() for line in Path(place, "fort.7").read_text().splitlines()]
    return [float(one[4].replace("D", "E")) for one in lines if one[0] != "0" and int(one[2]) in KINDS], best


def mappy(folder, turns):
    """Lines of the table: the neuron's period doubling in its current, and its curve to a = 0.25."""
    sys.path.insert(0, folder)
    system = Neuron(**NEURON, current=10.0)
    orbit = nsmaps.periodic_orbit(system, [-5.0])
    (event,), ours = shortest(
        lambda: nsmaps.continue_branch(system, "current", orbit, 10.0, (4.5, 10.0), direction="down").events, turns
    )
    ranges = {"current": (3.0, 10.0), "a": (0.2, 0.25)}
    curve, curve_time = shortest(lambda: nsmaps.bifurcation_curve(system, event, ranges), turns)
    true = [neuron_reference(-4.79, 4.587, 0.2), neuron_reference(-5.09, 4.15, 0.25)]
    yield row("nsmaps", [event.value, curve.parameters[-1, 0]], true, ours + curve_time, ours + curve_time)
    values, time = shortest(mappy_run(), turns)
    yield row("MapPy, rtol 1e-12", values, true, time, ours + curve_time)


def mappy_run():
    """MapPy's branch, its period doubling and its curve, in as many points as those of nsmaps."""
    from mappy import ContinuousMode, DiscreteMode, PoincareMap
    from mappy.root import find_local_bf, trace_cycle, trace_local_bf

    rates = lambda y, p: np.array([0.04 * y[0] ** 2 + 5 * y[0] + 140 - y[1] + p["I"], p["a"] * (p["b"] * y[0] - y[1])])  # noqa: E731
    flight = ContinuousMode.function(2, ["a", "b", "I"])(rates)
    spike = ContinuousMode.border(1)(lambda y, _: y[0] - 30.0)
    reset = DiscreteMode.function(2, 2, ["c", "d"])(lambda y, p: y + np.array([p["c"] - 30, p["d"]]))
    put = DiscreteMode.function(1, 2, ["c"])(lambda y, p: np.array([0, 1]) * y + np.array([p["c"], 0]))
    take = DiscreteMode.function(2, 1)(lambda y, _: np.array([0, 1]) @ y)
    modes = (
        DiscreteMode("0", put),
        ContinuousMode("1", flight, borders=[spike]),
        DiscreteMode("2", reset),
        DiscreteMode("3", take),
    )
    section = PoincareMap(modes, {"0": "1", "1": ["2"], "2": "3", "3": "0"}, "0", rtol=1e-12)

    def run():
        *_, (y, p, _) = trace_cycle(section, np.array([-1.7]), {**NEURON, "I": 10.0}, "I", 4.55, resolution=88, m0="0")
        found = find_local_bf(section, y, p, "I", np.pi, m0="0")
        curve = trace_local_bf(section, found.y, found.params, "I", np.pi, "a", 0.25, resolution=53, m0="0")
        return found.params["I"], curve[-1][1]["I"]

    return run


def row(name, values, true, time, ours):
    """A line of the table: the values, the largest error, the time, and its ratio to that of nsmaps."""
    worst = np.abs(np.subtract(values, true)).max()
    return f"| {name} | {', '.join(f'{one:.12f}' for one in values)} | {worst:.1e} | {time:.3g} | {time / ours:.3g} |"


if __name__ == "__main__":
    print("| program | events | largest error | s | ratio |\n|---|---|---:|---:|---:|")
    for line in {"auto": auto, "mappy": mappy}[sys.argv[1]](sys.argv[2], int(sys.argv[3]) if len(sys.argv) > 3 else 3):
        print(line, flush=True)
