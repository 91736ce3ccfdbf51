"""From a system's formulas to its compiled kernel: generated once, kept on disk, loaded without sympy from then on."""

import ast
import hashlib
import inspect
import marshal
import math
import os
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.errors import NsmapsError, SystemDefinitionError
from nsmaps.exact.files import place_of
from nsmaps.exact.impacts import CHATTER, REST, Floats, Impacts, Legs, Returns, Stretches
from nsmaps.exact.kept import keep, kept

if TYPE_CHECKING:
    from nsmaps.exact.system import ImpactSystem

HERE = Path(__file__).parent
RETURNS = ("remainders.py", "flight.py", "returns.py")  # copied behind what is generated
ENGINE = (*RETURNS, "batch.py", "legs.py", "sensitivity.py", "stretches.py", "swayed.py", "noisy.py")
BALLS = (*RETURNS, "balls.py", "swarm.py", "encounters.py", "cells.py")  # the same for images of boxes
GENERATOR = ("symbols.py", "bounding.py", "rounding.py", "generate.py", "printing.py")
MARK = "# === engine ===\n"
OTHERS = ("numba", "llvmlite", "matplotlib", "pytest")  #: packages that files of systems may import, and formulas cannot call
WRITTEN_WITH = ("sympy", "mpmath", "numpy", "scipy", "pydantic")  #: packages that formulas may call, told by their versions
KNOWN = {"nsmaps", *WRITTEN_WITH, *OTHERS, *sys.stdlib_module_names} - {"__main__"}
STEPS = 2000  # of a realisation under noise whose random numbers are drawn together
CHUNK = 25_000  # returns a thread takes at a time: long enough to hide its cost, short enough for Ctrl-C


@dataclass(frozen=True, slots=True)
class Kernel:
    """The compiled functions of one system class, for every value of its parameters."""

    module: ModuleType

    def vector(self, system: "ImpactSystem") -> Floats:
        """The parameters as the compiled functions take them.

        Raises:
            SystemDefinitionError: with these parameters there is no bound on the rates of flights within the horizon.
        """
        p = np.array([*system.parameters.values(), 0.0])  # never empty, so that its type is known
        if not math.isfinite(sum(self.module.bounds(p, 0.0, self.module.wall_places(p)[0], 1.0))):
            raise SystemDefinitionError(
                f"{type(system).__name__} with {system.parameters} has flights without a bound within the horizon of "
                f"{system.horizon} periods; a shorter `horizon`, or parameters with which they grow less, are accepted"
            )
        return p

    def first_returns(self, system: "ImpactSystem", start: Floats, derivative: bool, chatter: float) -> Returns:
        """First returns of a batch, shape (N, 2), on all cores."""
        n = len(start)
        image, turns = np.empty((n, 2)), np.empty((n, 2), np.int32)
        codes, outcome, time = np.empty(n, np.int64), np.empty(n, np.int8), np.empty(n)
        tangents = np.empty((n if derivative else 0, 2, 2))
        p = self.vector(system)

        def run(k: slice) -> None:
            self.module.first_returns(p, start[k], chatter, image[k], turns[k], codes[k], outcome[k], time[k], tangents[k])

        in_chunks(n, run)
        coordinates, walls = system.coordinates, system.wall_names
        return Returns(coordinates, walls, start, image, turns, codes, outcome, time, tangents if derivative else None)

    def orbits(self, system: "ImpactSystem", start: Floats, n: int, chatter: float) -> Returns:
        """The first n returns of each of M states, shape (M, 2): n M rows, the first return of every state first."""
        m = len(start)
        states, turns = np.empty((n * m + m, 2)), np.empty((n * m, 2), np.int32)
        codes, outcome, time = np.empty(n * m, np.int64), np.empty(n * m, np.int8), np.empty(n * m)
        states[:m] = start
        tables = states.reshape(n + 1, m, 2), turns.reshape(n, m, 2), *(row.reshape(n, m) for row in (codes, outcome, time))
        self.module.orbits(self.vector(system), float(chatter), *tables)
        return Returns(system.coordinates, system.wall_names, states[:-m], states[m:], turns, codes, outcome, time)

    def stretches(self, system: "ImpactSystem", start: Floats, frames: Floats, n: int, chatter: float) -> Stretches:
        """What n returns of each of M states, shape (M, 2), do to their frames, shape (M, 2, 2)."""
        m = len(start)
        states, frames = start.copy(), frames.copy()
        growth, log_det, time = np.empty((n, m, 2)), np.empty((n, m)), np.empty((n, m))
        outcome = np.empty((n, m), np.int8)
        self.module.stretches(self.vector(system), float(chatter), states, frames, growth, log_det, time, outcome)
        return Stretches(states, frames, growth, log_det, time, outcome)

    def noisy_orbit(
        self, system: "ImpactSystem", law: Any, step: Floats, parts: int, chatter: float, rng: np.random.Generator, tables: Any
    ) -> None:
        """One realisation under noise, written into its tables: see `nsmaps.dynamics.noise`."""
        module, p, constants = self.module, self.vector(system), np.array(law)
        ball, count = np.zeros(module.NUMBERS), np.zeros(module.COUNTS, np.int64)
        states, turns, codes, outcome, time, eta, hits = tables
        module.begin(p, ball, count, constants[3], rng.standard_normal(), states, eta)
        while count[module.FATE] == module.UNDER_WAY and count[module.MADE] < len(codes):
            normals = rng.standard_normal((STEPS, parts, 3))
            rows = hits, states, turns, codes, outcome, time, eta
            module.noisy_orbit(p, constants, step, normals, float(chatter), ball, count, *rows)
        module.finish(count, states, turns, codes, outcome, time, eta)

    def acceleration(self, system: "ImpactSystem", phi: float, z: float, w: float) -> float:
        """Of a ball at a phase, place and velocity, in flight."""
        return float(self.module.start(self.module.coefficients(self.vector(system), phi, z, w))[0])

    def legs(self, system: "ImpactSystem", start: Floats, chatter: float) -> Legs:
        """The legs of the first returns of a batch, shape (N, 2)."""
        n = len(start)
        outcome, codes, turns = np.empty(n, np.int8), np.empty(n, np.int64), np.empty(n, np.int32)
        clearance, slowest = np.empty(n), np.empty(n)
        p = self.vector(system)
        in_chunks(
            n, lambda k: self.module.all_legs(p, start[k], chatter, outcome[k], codes[k], turns[k], clearance[k], slowest[k])
        )
        return Legs(system.wall_names, codes, turns, clearance, slowest, outcome)

    def sensitivities(self, system: "ImpactSystem", start: Floats, rates: Floats, chatter: float) -> Floats:
        """The derivatives of the images of a batch, shape (N, 2), by the parameters along a direction."""
        moves = np.zeros((len(start), 2))
        if rates.any():
            self.module.sensitivities(self.vector(system), np.append(rates, 0.0), start, float(chatter), moves)
        return moves

    def impacts(self, system: "ImpactSystem", state: Floats, n: int, chatter: float) -> Impacts:
        """The first n impacts on all walls from one state, shape (2,)."""
        time, phase, speed = np.empty(n), np.empty(n), np.empty(n)
        on_base, mark = np.empty(n, np.int8), np.zeros(n, np.int8)
        v, phi = float(state[0]), float(state[1]) % (2 * np.pi)
        p, up = self.vector(system), bool(self.module.BASE_UP)
        m = self.module.trajectory(p, v, phi, float(chatter), up, on_base, time, phase, speed, mark)
        marks = np.array(["", CHATTER, REST, REST, ""])[mark[:m]]
        return Impacts(system.wall_names, 1 - on_base[:m], time[:m], phase[:m], speed[:m], marks)

    def trajectory(self, system: "ImpactSystem", impacts: Impacts, samples: int) -> tuple[Floats, Floats, Floats]:
        """Times, displacements and velocities along the M - 1 flights between impacts, each of shape (M - 1, samples)."""
        p = self.vector(system)
        top, bottom = self.module.wall_places(p)
        times = np.linspace(impacts.time[:-1], impacts.time[1:], samples, axis=1)
        places, rates = np.zeros((2, *times.shape))
        for i, time in enumerate(times):
            up = bool(self.module.BASE_UP) == (impacts.wall[i] == 0)
            places[i] = z = top if up else bottom
            if not impacts.mark[i + 1]:  # else it chatters or rests here: no flight to follow
                u, _ = self.module.rebound(p, up, impacts.speed[i])
                c = self.module.coefficients(p, impacts.phase[i], z, -u if up else u)
                d, rates[i] = np.array([self.module.evaluate(c, s)[:2] for s in time - time[0]]).T
                places[i] += d
        return times, places, rates


def in_chunks(n: int, run: Callable[[slice], None], size: int = CHUNK) -> None:
    """Run a task over n states in chunks, on all cores where there is more than one chunk."""
    chunks = [slice(i, min(i + size, n)) for i in range(0, n, size)]
    if len(chunks) < 2:
        for k in chunks:
            run(k)
    else:
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(run, chunks))


def kernel_of(system: "ImpactSystem", balls: bool = False) -> Kernel:
    """The kernel of a system's class (and of its fields that are no numbers): of returns, or of images of boxes in `balls`."""
    cls = type(system)
    fixed = {name: getattr(system, name) for name in cls.model_fields if name not in cls.parameter_names()}
    told = tuple(sorted((name, repr(value)) for name, value in {**fixed, "horizon": cls.horizon}.items()))
    return _kernel(cls, told, (cls.walls, cls.period, cls.displacement, cls.rebound), balls, system=_Quiet(system))


class _Quiet:
    """Carries an argument past the memory of `lru_cache`: all of these are equal."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Quiet)

    def __hash__(self) -> int:
        return 0


@lru_cache(maxsize=64)
def _kernel(cls: type, fixed: tuple[tuple[str, str], ...], formulas: tuple[Any, ...], balls: bool, system: _Quiet) -> Kernel:
    sources = _sources(cls)
    source = (
        None if sources is not None else _generate(system.value, balls)
    )  # of a class without a file all there is to tell it by
    name = (
        f"nsmaps_{'boxes_' if balls else ''}{cls.__name__.lower()}_{_key(cls, fixed, formulas, balls, sources or source or '')}"
    )
    content = kept(f"{name}.code")
    if content is None:
        _tell(f"compiling {cls.__name__}{' for boxes' if balls else ''}, once: about 10 s, on a busy machine a minute")
        content = marshal.dumps(compile(source or _generate(system.value, balls), f"{name}.py", "exec"))
        keep(f"{name}.code", content)
    return Kernel(_load(name, content))


def _key(cls: type, fixed: tuple[tuple[str, str], ...], formulas: tuple[Any, ...], balls: bool, sources: str) -> str:
    """A digest of all that the source of a class's kernel depends on: formulas, what they read, generator, engine, versions."""
    from nsmaps.exact.compiled import code_of, compilers

    files = (*BALLS, "ballcode.py") if balls else ENGINE
    machinery = [(HERE / name).read_text() for name in (*files, *GENERATOR, "system.py", "compiled.py")]
    versions = [f"{name} {version(name)}" for name in WRITTEN_WITH]
    text = "\0".join([cls.__qualname__, repr(fixed), code_of(*formulas), sources, *versions, *compilers(), *machinery])
    return hashlib.sha256(text.encode()).hexdigest()[:20]


def _tell(what: str) -> None:
    """Say on a terminal why nothing seems to happen; elsewhere nothing."""
    if sys.stderr is not None and sys.stderr.isatty():
        print(what, file=sys.stderr, flush=True)


def _generate(system: "ImpactSystem", balls: bool) -> str:
    from nsmaps.exact.ballcode import ball_source
    from nsmaps.exact.generate import flow_source

    try:
        heads = [flow_source(system), ball_source(system)] if balls else [flow_source(system)]
    except NsmapsError:
        raise
    except Exception as error:  # sympy's, by formulas of which nobody thought
        cls, why = type(system), f"{type(error).__name__}: {error}"
        place = place_of(cls, "displacement")
        raise SystemDefinitionError(f"the formulas of {cls.__name__} cannot be turned into a flow ({why}){place}") from error
    return "\n\n".join([*heads, *((HERE / name).read_text().partition(MARK)[2] for name in (BALLS if balls else ENGINE))])


def _sources(cls: type) -> str | None:
    """The text of every file that the formulas of a class may depend on, or None where that cannot be told.

    Those are the files of the class and its bases outside nsmaps, and of what these import, but for well-known packages.
    """
    texts: dict[str, str] = {}
    for base in cls.__mro__:
        module = sys.modules.get(base.__module__)
        if base.__module__.split(".")[0] in KNOWN and getattr(module, base.__qualname__, None) is base:
            continue  # not so of what only says that it is from there, as classes made by exec
        if "<locals>" in base.__qualname__:  # made by a function, perhaps with what is not in its text
            return None
        try:
            inspect.getsource(base)
        except (TypeError, OSError):
            return None
        _add_sources(base.__module__, texts)
    return "\0".join(texts[name] for name in sorted(texts))


def _add_sources(name: str, texts: dict[str, str]) -> None:
    """Add the text of a module, and of the modules that it imports."""
    module = sys.modules.get(name)
    file = getattr(module, "__file__", None)
    if name in texts or name.split(".")[0] in KNOWN or file is None or not file.endswith(".py"):
        return
    texts[name] = Path(file).read_text()
    package = getattr(module, "__package__", None) or ""
    for node in ast.walk(ast.parse(texts[name])):
        if isinstance(node, ast.Import):
            found = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            parts = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            stem = ".".join([*parts, *([node.module] if node.module else [])])
            found = [stem, *(f"{stem}.{alias.name}" for alias in node.names)]
        else:
            continue
        for each in found:
            _add_sources(each, texts)


def _load(name: str, content: bytes) -> ModuleType:
    module = sys.modules[name] = ModuleType(name)
    exec(marshal.loads(content), vars(module))
    return module
