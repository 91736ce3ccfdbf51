"""The section `optimize`: the parameters at which a periodic motion of the exact map delivers most of an observable."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from nsmaps.exact.observables.spec import Observable
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.ahead import call_noise
from nsmaps.study.conclusions.texts import grid_text, plain, returns_text
from nsmaps.study.estimates import NOISY, POINT, RETURN, Size, states
from nsmaps.study.reading.values import Bounds, MaxReturns, Period, Seed, Side
from nsmaps.study.sections.base import Analysis, Finding, Table, Verdict, verdict
from nsmaps.study.sections.longrun.noise import NoiseSizes

if TYPE_CHECKING:
    from nsmaps.dynamics.design.optimum import NoisyOptimum, Optimum
    from nsmaps.study.ahead import Call
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

IMPACTS = 40  #: room for impacts of each return under noise
POINTS = 200  #: of a start, for an estimate of the time
SAME = 1e-6  #: share of the value within which starts lead to one value
PLACE = 1e-3  #: share of the bounds within which they lead to one place; a value changes with its square


class OptimumNoiseSection(NoiseSizes):
    """Noise at the optimum."""

    n_returns: int = Field(500, ge=1, description="returns of each realisation, from the motion on")
    n_realisations: int = Field(16, ge=2, description="realisations of each sigma")
    rng: Seed = 0


class OptimumSection(Analysis):
    """Parameters at which a periodic motion of the exact map has the largest or least mean of an observable.

    A verdict says how many of the starts lead to one value, and to one place; no motion that meets the conditions is an error.
    """

    key: ClassVar[str] = "optimize"
    results: ClassVar[Mapping[str, Any]] = {
        "optimize": None,
        "noisy_optimum": None,
    }

    observable: str | Observable = Field(description="what is to be largest: a name, or a formula")
    bounds: Bounds = Field(min_length=1, description="bounds of the parameters, which contain the study's own values")
    start: dict[str, Number] = Field(description="a state near the motion at the study's own parameters")
    period: Period = 1
    sense: Literal["max", "min"] = Field("max", description="the largest or the least mean")
    per: Literal["period", "return", "time"] | None = Field(
        None,
        description="mean over a period of the forcing (the default), a return (without forcing), or a unit of time",
    )
    motion: str = Field("", description="word or name of the motion, such as 1:1/T; another one at `start` is an error")
    multiplier: Number | None = Field(0.95, gt=0, le=1, description="largest modulus of the multipliers")
    graze: Number = Field(
        0.01, ge=0, lt=1, description="least margin from a graze, as a share of the largest impact speed or gap"
    )
    states: dict[str, Side] | None = Field(None, description="states whose basins are computed at the optimum")
    share: Number = Field(0.0, ge=0, le=1, description="share of these states that must come to the motion")
    tolerances: dict[str, Number] = Field(
        default_factory=dict, description="the share also holds where one of these parameters differs by this much, either way"
    )
    max_returns: MaxReturns = 1000
    n_guesses: int = Field(5, ge=1, description="points from which it is searched")
    noisy: OptimumNoiseSection | None = Field(None, description="the observable at the optimum under noise")

    def bind(self, binding: "Binding") -> dict[str, Any]:
        from nsmaps.dynamics.design.arguments import box, check_limits, observed, offsets_of
        from nsmaps.dynamics.noise.orbits import check_noise

        source, known = binding.study.source, binding.system.parameters
        for name in self.bounds:
            source.known(("optimize", "bounds", name), name, known, "parameter", key=True)
        guess = {name: known[name] for name in self.bounds}
        with source.located(("optimize", "bounds")):
            box(self.bounds, guess)
        check_limits(self.sense, self.multiplier, self.graze, self.share, {"n_guesses": self.n_guesses}, self.states is not None)
        with source.located(("optimize", "observable")):
            what, _ = observed(binding.system, self.observable, self.per)
            if self.noisy and what.of == "flights":
                raise source.error(("optimize", "noisy"), f"{what.name!r} is of flights, which noise moves; expected: of impacts")
        if self.noisy:
            with source.located(("optimize", "noisy")):
                check_noise(binding.system, self.noisy.noise(self.noisy.sigma[0]))
        if "graze" in self.model_fields_set and not isinstance(binding.system, FlowSystem):
            with source.located(("optimize", "graze")):
                FlowSystem.require(binding.system, "a margin from a graze")
        with source.located(("optimize", "tolerances")):
            offsets_of(self.tolerances, self.bounds)
        grid = None if self.states is None else binding.grid(("optimize", "states"), self.states)
        return {"guess": guess, "start": binding.start(("optimize", "start"), self.start), "states": grid}

    def calls(self) -> "tuple[Call, ...]":
        return (call_noise,) if self.noisy else ()

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """The optimum, and the observable there under noise."""
        from nsmaps.dynamics.design.optimum import optimize

        how = self.model_dump(exclude={"observable", "bounds", "start", "states", "noisy"})
        parallel = plan.portion(0, 2 if self.noisy else 1)
        found = optimize(plan.system, self.observable, self.bounds, **plan.bound["optimize"], **how, progress=parallel.progress)
        noisy = _noisy(self.noisy, plan, found) if self.noisy else None
        return {"optimize": found, "noisy_optimum": noisy}

    def describe(self, study: "Study") -> str:
        name = self.observable if isinstance(self.observable, str) else self.observable.name
        sample = f"; basins of {grid_text(self.states)}" if self.states else ""
        noise = self.noisy
        under = f"; {returns_text(noise.n_returns * noise.n_realisations * len(noise.sigma))} under noise" if noise else ""
        return f"{self.sense} of {name} over {', '.join(self.bounds)}, {self.n_guesses} guesses{sample}{under}"

    def size(self, study: "Study", system: "System") -> Size:
        search = Size(POINT * POINTS * self.n_guesses)
        basin = Size(RETURN * self.max_returns).times(states(self.states) * (60 if self.share else 1) if self.states else 0.0)
        noise = self.noisy
        return search + basin + Size(NOISY * noise.n_returns * noise.n_realisations * len(noise.sigma) if noise else 0.0)

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        """The optimum with its conditions, what coexists, every start, and means under noise."""
        found, noisy = result.optimize, result.noisy_optimum
        of = {"observable": found.observable.name, "unit": found.observable.unit, "per": found.per, "sense": found.sense}
        at = {name: _number(getattr(found, name)) for name in ("parameters", "value", "gradient", "residual")}
        motion = {"motion": found.orbit.label, "word": found.orbit.word, "states": found.orbit.states.tolist()}
        conditions = [
            {name: _number(value) for name, value in (asdict(one) | {"margin": one.margin}).items()} for one in found.conditions
        ]
        attempts = [asdict(one) for one in found.attempts]
        rows = of | at | motion | {"conditions": conditions, "attempts": attempts, "coexisting": list(_coexisting(found))}
        under = {} if noisy is None else {"sigma": list(noisy.sigma), "value": plain(noisy.value), "error": plain(noisy.error)}
        return {"optimize": rows | ({"noise": under} if under else {})}

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        found = result.optimize
        (values, places), total = same(found, self.bounds), len(found.attempts)
        text = f"{values} of {total} starts within {SAME:g} of its value, "
        text += f"{places} of {total} within {PLACE:g} of the bounds of its parameters"
        yield verdict("optimize: the same from every start", result.system.map_name, values == places == total, text)

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """The optimum, the parameters at which it lies, and the motion that has it."""
        found = result.optimize
        unit = " ".join(filter(None, (found.observable.unit, f"per {found.per}")))
        where = ", ".join(f"{name} = {value:.5g}" for name, value in found.parameters.items())
        where += ", and the same at all other parameters that were met" if found.flat else ""
        what = f"{found.sense}imum of {found.observable.name} of {found.orbit.label}"
        numbers = [(f"{found.value:.6g}", f"{what}, {unit}")]
        numbers += [(f"{name} = {value:.6g}", "at the optimum") for name, value in found.parameters.items()]
        numbers += [
            (f"{one.value:.5g}", f"{one.name} at the optimum, which is its bound") for one in found.conditions if one.active
        ]
        yield Finding(result.system.map_name, f"{what}: {found.value:.5g} {unit} at {where}", tuple(numbers))

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        """The optimum, its conditions, what attracts there, and the means under noise."""
        found, noisy = result.optimize, result.noisy_optimum
        unit = " ".join(filter(None, (found.observable.unit, f"per {found.per}")))
        rows = [
            (one.name, f"{one.value:.6g}", _bounds(one.low, one.high), _gain(one.active, one.gain)) for one in found.conditions
        ]
        title = f"{found.sense.capitalize()}imum of {found.observable.name} of {found.orbit.label}: {found.value:.6g} {unit}"
        yield Table(title, ("", "value", "allowed", "active, gain"), tuple(rows), ("gain: of the value, a unit of the bound.",))
        if found.basins is not None:
            shares = [(row["label"], f"{100 * row['share']:.3g} %", f"{100 * row['error']:.2g} %") for row in _coexisting(found)]
            yield Table("What attracts at the optimum", ("motion", "share", "error"), tuple(shares))
        if noisy is not None:
            each = zip(noisy.sigma, noisy.value.tolist(), noisy.error.tolist(), strict=True)
            under = [
                (f"{sigma:g}", f"{value:.6g}", f"{error:.2g}", f"{100 * value / found.value:.4g} %")
                for sigma, value, error in each
            ]
            yield Table("The optimum under noise", ("sigma", "mean", "error", "of the optimum"), tuple(under))


def _noisy(spec: OptimumNoiseSection, plan: "Plan", found: "Optimum") -> "NoisyOptimum":
    """The mean of the observable from the motion on, under noise of each amplitude."""
    from nsmaps.dynamics.design.optimum import NoisyOptimum
    from nsmaps.dynamics.noise.orbits import noisy_orbits
    from nsmaps.dynamics.observables.observe import observe

    system, rows = plan.system.at(**found.parameters), []
    for number, sigma in enumerate(spec.sigma):
        how = {"n_returns": spec.n_returns, "n_realisations": spec.n_realisations, "rng": spec.rng}
        parallel = plan.portion(len(spec.sigma) + number, 2 * len(spec.sigma), f"sigma-{number}")
        room = IMPACTS * spec.n_returns if isinstance(system, FlowSystem) else 0
        orbits = noisy_orbits(system, found.orbit.states[0], spec.noise(sigma), **how, max_impacts=room, parallel=parallel)
        mean = getattr(observe(system, orbits, [found.observable]), f"per_{found.per}")
        rows.append((mean.value[0], mean.error[0]))
    return NoisyOptimum(spec.sigma, *np.array(rows).T)


def _number(value: Any) -> Any:
    """A number that is not finite as None."""
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _coexisting(found: "Optimum") -> Iterator[dict[str, Any]]:
    """The attractors at the optimum with the shares of their basins."""
    if found.basins is not None:
        for attractor, share, error in zip(
            found.basins.attractors, found.basins.fractions.tolist(), found.basins.fraction_error.tolist(), strict=False
        ):
            yield {"label": attractor.label, "share": share, "error": error}


def same(found: "Optimum", bounds: Mapping[str, tuple[float, float]]) -> tuple[int, int]:
    """The numbers of starts that lead to the best value of all, and to its parameters or near them.

    Values are one within 1e-6 of the best, or 1e-9 of the largest one met, as where the best is zero.
    """
    from nsmaps.dynamics.design.search import FLAT

    met = [one for one in found.attempts if one.optimal] or [one for one in found.attempts if one.feasible]
    best = (max if found.sense == "max" else min)(met, key=lambda one: one.value)
    near = max(SAME * abs(best.value), FLAT * found.size)
    sides = {name: PLACE * (high - low) for name, (low, high) in bounds.items()}
    places = [all(abs(one.end[name] - best.end[name]) <= side for name, side in sides.items()) for one in met]
    return sum(abs(one.value - best.value) <= near for one in met), sum(places)


def _bounds(low: float, high: float) -> str:
    if np.isfinite([low, high]).all():
        return f"{low:g} to {high:g}"
    return f"at least {low:g}" if np.isfinite(low) else f"at most {high:g}"


def _gain(active: bool, gain: float) -> str:
    return "" if not active else f"yes, {gain:.4g}" if np.isfinite(gain) else "yes"
