"""The section `noise`: the exact map under a forcing by noise or noise on its images, and the composite map so."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from nsmaps.arrays import Floats
from nsmaps.parallel import Parallel
from nsmaps.reduced.conditions.condition import Number
from nsmaps.results import units_of
from nsmaps.study.ahead import call_noise
from nsmaps.study.conclusions.phrases import at
from nsmaps.study.conclusions.texts import each_text, percent, plain, returns_text, shares_text
from nsmaps.study.estimates import COPIES, NOISY, NOISY_MODES, RETURN, STORED, Size
from nsmaps.study.pictures.figure import FigurePart, StudyFigure
from nsmaps.study.reading.values import Compared, Name, Range, Section, Seed, Transient
from nsmaps.study.sections.base import Analysis, Finding, Need, Table

if TYPE_CHECKING:
    from nsmaps.dynamics.noise.impacts import ImpactDiagram
    from nsmaps.dynamics.noise.law import Noise
    from nsmaps.dynamics.noise.residence import Residence
    from nsmaps.study.ahead import Call
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

DOWN_AND_UP: tuple[Literal["down", "up"], ...] = ("down", "up")


class ImpactsSection(Range):
    """The impacts of the exact map over a parameter, down and up, without noise and with noise of amplitude `sigma`."""

    sigma: Number = Field(gt=0, description="standard deviation of the stationary forcing")
    n_returns: int = Field(40, ge=1, description="returns whose impacts are kept at each value")
    transient: Transient = 300


class NoiseSizes(Section):
    """The kind of a noise, and its amplitudes."""

    sigma: tuple[Number, ...] = Field(min_length=1, description="standard deviations of the noise, each >= 0")
    tau: Number | None = Field(
        None, gt=0, description="correlation time of a forcing; without it independent noise is added to images"
    )
    scale: dict[Name, Number] | None = Field(
        None,
        description="without `tau`: standard deviation of each coordinate in units of sigma, 0 if not named; by default 1",
    )

    def noise(self, sigma: float) -> "Noise":
        """The noise of one amplitude."""
        from nsmaps.dynamics.noise.law import Noise

        return Noise(sigma=sigma, tau=self.tau, scale=self.scale)


class NoiseSection(NoiseSizes, Analysis):
    """The exact map under noise: residence in motions for each amplitude, impacts over a parameter.

    With `tau` the noise is an Ornstein-Uhlenbeck forcing, otherwise it is added to the images, by coordinate in units of `scale`.
    """

    key: ClassVar[str] = "noise"
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "longrun.noise",
            "Impacts under noise against the parameter, and shares and rates of the motions against the size of the noise.",
            "Noise: impacts over the parameter, if it is swept (fig. comp_stoch), and, for the parameters of the study, the "
            "shares of motions and the rates of transitions between them, with standard errors, over the size of the noise.",
            (FigurePart("orbits under noise", ("noise",)),),
        ),
    )

    start: dict[str, Number] = Field(description="start of every realisation")
    n_returns: int = Field(2000, ge=1, description="returns of each realisation")
    n_realisations: int = Field(16, ge=1, description="realisations of each sigma")
    step: Number | None = Field(
        None,
        gt=0,
        description="of the grid in time of a forcing, at most `tau`; by default a hundredth of the period, at most `tau`/10",
    )
    rng: Seed = 0
    modes: dict[Name, tuple[str, ...]] = Field(
        min_length=1, description="the words of one period of each motion, by the motion's name"
    )
    map: Compared = Field(("exact",), description="the maps; images of `composite` receive the same kicks")
    min_returns: int = Field(12, ge=1, description="successive returns that count as a motion")
    impacts: ImpactsSection | None = Field(
        None, description="impacts on all walls over a parameter, down and up, without and with forcing by noise"
    )

    @model_validator(mode="after")
    def _in_bounds(self) -> Self:
        if min(self.sigma) < 0:
            raise ValueError(f"sigma is {min(self.sigma):g}; expected: zero or more")
        if self.tau is None and (self.step is not None or self.impacts is not None):
            raise ValueError("step and impacts are of a forcing by noise; expected: with them tau, its correlation time")
        if self.step is not None and self.tau is not None and self.step > self.tau:
            raise ValueError(f"step is {self.step:g}; expected: at most tau = {self.tau:g}")
        length = max(map(len, self.modes.values()))
        if not all(self.modes.values()) or self.min_returns < length:
            text = f"expected: motions of one or more words, and min_returns of at least their number, {length}"
            raise ValueError(f"min_returns is {self.min_returns}; {text}")
        return self

    def bind(self, binding: "Binding") -> Floats:
        """The start, of shape (n,); raises StudyError for words that are not valid and an unknown parameter."""
        from nsmaps.dynamics.noise.orbits import check_noise

        check_noise(binding.system, self.noise(self.sigma[0]))
        for name, words in self.modes.items():
            for word in words:
                binding.check_return(("noise", "modes", name), word)
        if along := self.impacts:
            binding.swept_values(("noise", "impacts"), along.parameter, (along.low, along.high))
        return binding.start(("noise", "start"), self.start)

    def calls(self) -> "tuple[Call, ...]":
        return (call_noise,)

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """The residence in motions for each amplitude of the noise, and the impacts over a parameter."""
        from nsmaps.dynamics.noise.orbits import noisy_orbits
        from nsmaps.dynamics.noise.residence import NoiseResult, Residence, residence

        stays, ended, count = [], [], len(self.sigma) + (self.impacts is not None)
        counted, reduced = list[Residence](), list[Residence]()
        how: Any = self.model_dump(include={"n_returns", "n_realisations", "rng", "step"})
        for number, sigma in enumerate(self.sigma):
            noise = self.noise(sigma)
            orbits = noisy_orbits(
                plan.system, plan.bound["noise"], noise, **how, parallel=plan.portion(number, count, f"sigma-{number}")
            )
            stays.append(residence(orbits.words, orbits.time, self.modes, self.min_returns))
            ended.append(orbits.ended())
            if "composite" in self.map:
                counted.append(residence(orbits.words, _each(orbits.words), self.modes, self.min_returns))
                reduced.append(_reduced(self, plan, result, noise))
        impacts = _impacts(self, self.impacts, plan, plan.portion(count - 1, count, "impacts")) if self.impacts else ()
        sizes, both = tuple(map(self.noise, self.sigma)), (tuple(counted), tuple(reduced))
        return {"noise": NoiseResult(sizes, tuple(stays), tuple(ended), impacts, *both, units_of(plan.system))}

    def describe(self, study: "Study") -> str:
        sizes = f"{len(self.sigma)} amplitudes, {self.n_realisations} realisations of {self.n_returns} returns each"
        returns = len(self.sigma) * self.n_realisations * self.n_returns
        if (along := self.impacts) is None:
            return f"{sizes}; {returns_text(returns)}"
        more = 4 * along.points * (along.transient + along.n_returns)
        return f"{sizes}, and impacts at {each_text(along)}; {returns_text(returns + more)}"

    def size(self, study: "Study", system: "System") -> Size:
        one = Size(_seconds(self, system), COPIES * STORED)
        found = one.times(float(self.n_returns) * self.n_realisations * len(self.sigma))
        if (along := self.impacts) is not None:
            kept = Size(memory=COPIES * STORED).times(4.0 * along.points * along.n_returns)
            found += kept + Size(one.seconds).times(4.0 * along.points * (along.transient + along.n_returns))
        return found

    def needs(self) -> Iterator[Need]:
        if "composite" in self.map:
            yield ("noise", "map"), "the composite map under noise", "composite"
            yield ("noise", "map"), "the composite map under noise", "grid"

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        """The numbers for each amplitude of the noise."""
        noise = result.noise
        rows: list[dict[str, Any]] = []
        for sigma, stay, ended in zip(self.sigma, noise.stays, noise.ended, strict=True):
            row = {"sigma": sigma, "modes": list(stay.modes), "time": stay.time.tolist(), "switches": stay.switches.tolist()}
            tables = {name: plain(getattr(stay, name)) for name in ("share", "mean", "rates", "rates_error")}
            rows.append(row | tables | {"unknown": stay.unknown, "ended": ended})
        for of in ("counted", "reduced"):
            for row, stay in zip(rows, getattr(noise, of), strict=False):
                row[of] = {name: plain(getattr(stay, name)) for name in ("share", "mean", "switches", "rates", "rates_error")}
        return {"noise": rows}

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """The share of each motion under the least and the greatest noise, and the changes from one to another."""
        noise = result.noise
        each = list(zip(self.sigma, noise.stays, strict=True))
        ends = [each[0], *each[1:][-1:]]
        texts = [f"under noise of sigma = {sigma:g} {shares_text(_shares(stay))}" for sigma, stay in ends]
        numbers = [
            (percent(share), f"of the time in {name} at sigma = {sigma:g}")
            for sigma, stay in ends
            for name, share in _shares(stay).items()
        ]
        numbers += [(f"{int(stay.switches.sum()):,}", f"changes between motions at sigma = {sigma:g}") for sigma, stay in ends]
        yield Finding(result.system.map_name, "; ".join(texts), tuple(numbers))

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        """Shares of the motions and changes from one to another, of both maps."""
        noise = result.noise
        if not noise.reduced:
            return
        modes = noise.reduced[0].modes
        pairs = [(i, j) for i in range(len(modes)) for j in range(len(modes)) if i != j]
        heads = "sigma", "map", *(f"share of {name}" for name in modes), *(f"{modes[i]} to {modes[j]}" for i, j in pairs)
        rows = []
        for sigma, exact, reduced in zip(self.sigma, noise.counted, noise.reduced, strict=True):
            for of, stay in (("exact", exact), ("composite", reduced)):
                found = [(1000 * stay.rates[pair], 1000 * stay.rates_error[pair], stay.switches[pair]) for pair in pairs]
                changes = [f"{rate:.2g} +- {error:.1g}" if count else "0" for rate, error, count in found]
                rows.append((f"{sigma:.3g}", of, *(f"{100 * share:.3g} %" for share in stay.share), *changes))
        note = "Shares of returns, and changes per 1000 returns in the first motion. "
        note += "Images of the composite map are kicked as the noise kicks exact ones."
        yield Table("Motions under noise", heads, tuple(rows), (note,))

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The sizes of the noise, and the motions."""
        sizes = f"sigma from {min(self.sigma):g} to {max(self.sigma):g}" if len(self.sigma) > 1 else f"sigma = {self.sigma[0]:g}"
        kind = "of independent noise on the images" if self.tau is None else f"correlation time {self.tau:g}"
        return f"{at(result)}{sizes}, {kind}, {self.n_realisations} realisations of {self.n_returns:,} returns each."


def _shares(stay: "Residence") -> dict[str, float]:
    """The shares of the motions in the time spent in any."""
    return dict(zip(stay.modes, np.nan_to_num(stay.share).tolist(), strict=True))


def _each(words: NDArray[np.str_]) -> Floats:
    """One for each return that has a word, as the time of residence in returns."""
    return np.where(words != "", 1.0, np.nan)


def _reduced(spec: NoiseSection, plan: "Plan", result: "StudyResult", noise: "Noise") -> "Residence":
    """The residence of the composite map under kicks, in returns."""
    from nsmaps.dynamics.noise.residence import residence
    from nsmaps.reduced.composite.noise import KickedMap

    assert result.composite is not None
    assert result.returns is not None
    grids = {repr(piece.grid): piece.grid for piece in plan.bound["composite"] if piece.grid is not None}
    states = np.concatenate([result.returns.start, *(grid.states() for grid in grids.values())])
    kicked = KickedMap.of(result.composite, plan.system, states, noise, spec.rng)
    words = kicked.words(plan.bound["noise"], spec.n_returns, spec.n_realisations, spec.rng)
    return residence(words, _each(words), spec.modes, spec.min_returns)


def _impacts(spec: NoiseSection, section: ImpactsSection, plan: "Plan", parallel: Parallel) -> "tuple[ImpactDiagram, ...]":
    """The diagrams in descending and ascending order, each without and with noise."""
    from nsmaps.dynamics.noise.impacts import impact_diagram

    values = np.linspace(section.low, section.high, section.points)
    sizes = spec.noise(0.0), spec.noise(section.sigma)
    how = section.n_returns, section.transient, spec.rng, spec.step
    where = plan.system, section.parameter, values, plan.bound["noise"]
    return tuple(
        impact_diagram(*where, size, way, *how, parallel=parallel.share(k / 4 + n / 8, (k + n + 1) / 4, way, str(n)))
        for k, way in enumerate(DOWN_AND_UP)
        for n, size in enumerate(sizes)
    )


def _seconds(spec: NoiseSection, system: "System") -> float:
    """The time of one return."""
    from nsmaps.dynamics.noise.law import usual_step

    if spec.tau is None:
        return RETURN
    usual = usual_step(system, spec.tau)
    return (NOISY_MODES if system.obstacle() else NOISY) * max(1.0, usual / (spec.step or usual))
