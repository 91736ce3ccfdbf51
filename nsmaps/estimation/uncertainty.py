"""What is uncertain of parameters, through any quantity of a system: diagrams, observables, optima."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.errors import NsmapsError, ParameterError
from nsmaps.estimation.result import Estimate
from nsmaps.estimation.space import declared_bounds
from nsmaps.exact.systems.parameters import System
from nsmaps.progress import beat, shows
from nsmaps.results import NONE, Result, array

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Uncertainty(Result):
    """N draws of P parameters and Q quantities at each; all statements are sampled."""

    picture: ClassVar[str] = "nsmaps.figures.estimation.uncertainty"

    names: tuple[str, ...]
    quantities: tuple[str, ...]
    draws: Floats = field(metadata=array("draw parameter", "parameters", NONE))
    values: Floats = field(metadata=array("draw quantity", "quantities; NaN where there is none", NONE))
    means: Floats = field(metadata=array("quantity", "means", NONE))
    deviations: Floats = field(metadata=array("quantity", "standard deviations", NONE))
    quantiles: Floats = field(metadata=array("level quantity", "at 5, 25, 50, 75 and 95 %", NONE))
    first_order: Floats | None = field(
        default=None, metadata=array("quantity parameter", "first-order Sobol indices, of independent parameters", NONE)
    )
    total_order: Floats | None = field(default=None, metadata=array("quantity parameter", "total Sobol indices, likewise", NONE))

    def summary(self) -> str:
        """The numbers that matter."""
        failed = int(np.isnan(self.values).any(axis=1).sum())
        rows = zip(self.quantities, self.means, self.deviations, strict=True)
        parts = [f"{name} = {mean:.6g} +- {deviation:.2g}" for name, mean, deviation in rows]
        return f"{'; '.join(parts)} (sampled, {len(self.draws)} draws, {failed} without a value)"


@shows
def uncertainty(
    system: System,
    parameters: Estimate | Mapping[str, Any],
    quantities: Callable[[Any], float] | Mapping[str, Callable[[Any], float]],
    *,
    n_draws: int = 256,
    sobol: bool = False,
    rng: int | np.random.Generator = 0,
) -> Uncertainty:
    """The distribution of quantities of a system whose parameters are uncertain.

    Args:
        system: with values for all parameters.
        parameters: an `Estimate`, with its covariance, or distributions by name: bounds (low, high) of a uniform one, or a
            distribution of `scipy.stats` with its parameters.
        quantities: functions of the system, as `lambda system: nsmaps.observe(system, ...).per_period.value[0]`, by name. Where
            one raises an NsmapsError its value is NaN.
        n_draws: number of draws.
        sobol: also compute Sobol indices, by `scipy.stats.sobol_indices`, which takes (P + 2) times as many further calls, with
            `n_draws` as a power of 2; correlations of an estimate are left out in these.
        rng: random numbers.

    Raises:
        ParameterError: a parameter is unknown, or its distribution is not one.
        NsmapsError: parameters or draws are missing, or a quantity cannot be called.
    """
    random = np.random.default_rng(rng)
    functions = (
        quantities
        if isinstance(quantities, Mapping)
        else {getattr(quantities, "__name__", "").replace("<lambda>", "") or "quantity": quantities}
    )
    names = parameters.names if isinstance(parameters, Estimate) else tuple(parameters)
    if n_draws < 1 or (sobol and n_draws & (n_draws - 1)) or not names or not all(map(callable, functions.values())):
        raise NsmapsError(
            f"{len(names)} uncertain parameters, n_draws {n_draws}, quantities {', '.join(functions)}; expected: at least one "
            "parameter and draw, a power of 2 of these for Sobol indices, and functions of the system"
        )
    system.direction(dict.fromkeys(names, 1.0))
    laws = [law_of(parameters, name) for name in names]
    for name, law in zip(names, laws, strict=True):
        _check_support(system, name, law)
    if isinstance(parameters, Estimate):
        draws = parameters.draws(n_draws, random)
    else:
        draws = np.column_stack([law.ppf(random.random(n_draws)) for law in laws])
    values = values_at(system, names, functions, draws)
    first = total = None
    if sobol:
        first, total = _sobol(lambda some: values_at(system, names, functions, some), laws, n_draws, random)
    if not np.isfinite(values).any(axis=0).all():
        raise NsmapsError(f"{', '.join(functions)}: no value at any of {n_draws} draws; expected: values at some of them")
    statistics = np.nanmean(values, axis=0), np.nanstd(values, axis=0), np.nanquantile(values, QUANTILES, axis=0)
    return Uncertainty(names, tuple(functions), draws, values, *statistics, first, total)


def _sobol(of: Callable[[Floats], Floats], laws: list[Any], n: int, random: np.random.Generator) -> tuple[Floats, Floats]:
    """First-order and total Sobol indices, shape (Q, P): NaN of a quantity that has no value at a draw, or one value at all."""
    from scipy.stats import sobol_indices

    seen: list[Floats] = []

    def twice(x: Floats) -> Floats:  # scipy sets the indices of a quantity without variance to 0, and fails for a single one
        seen.append(of(x.T))
        return np.repeat(seen[-1].T, 2, axis=0)

    found = sobol_indices(func=twice, n=n, dists=laws, rng=random)
    varies = np.ptp(np.concatenate(seen), axis=0)[:, None] > 0
    return np.where(varies, found.first_order[::2], np.nan), np.where(varies, found.total_order[::2], np.nan)


def law_of(parameters: Estimate | Mapping[str, Any], name: str) -> Any:
    """The distribution of one parameter, a frozen one of scipy. ParameterError if it is not one."""
    from scipy.stats import truncnorm, uniform

    if isinstance(parameters, Estimate):
        k = parameters.names.index(name)
        center, error = parameters.values[k], min(parameters.errors[k], parameters.scale[k])
        return truncnorm(*((parameters.limits[k] - center) / error), center, error)
    given = parameters[name]
    if hasattr(given, "ppf"):
        return given
    try:
        low, high = map(float, given)
    except (TypeError, ValueError):
        low = high = np.nan
    if not low < high:
        raise ParameterError(f"the distribution of {name} is {given!r}; expected: bounds (low, high), or one of scipy.stats")
    return uniform(low, high - low)


def _check_support(system: System, name: str, law: Any) -> None:
    """ParameterError for a distribution of which all or, if it is bounded, some values are beyond what the class declares."""
    (low, high), (least, greatest) = getattr(law, "support", lambda: (-np.inf, np.inf))(), declared_bounds(system, name)
    beyond = (np.isfinite(low) and low < least) or (np.isfinite(high) and high > greatest)
    if beyond or high < least or low > greatest:
        raise ParameterError(
            f"the distribution of {name} is from {low:g} to {high:g}; expected: within {least:g} to {greatest:g}"
        )


def values_at(system: System, names: tuple[str, ...], functions: Mapping[str, Callable[[Any], float]], draws: Floats) -> Floats:
    """The quantities at draws of the parameters, shape (N, Q)."""
    found = np.full((len(draws), len(functions)), np.nan)
    for k, row in enumerate(draws):
        try:
            one = system.at(**dict(zip(names, row.tolist(), strict=True)))
            given = [function(one) for function in functions.values()]
        except NsmapsError:
            continue
        try:
            found[k] = [float(value) for value in given]
        except (TypeError, ValueError) as error:
            of = ", ".join(f"{name} = {value!r}" for name, value in zip(functions, given, strict=True))
            raise NsmapsError(f"{of}; expected: a number from each function of the system") from error
        beat((k + 1) / len(draws))
    return found
