"""The steps of a study's run that ask about the long run of the exact map."""

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from nsmaps.exact.parts import Along
from nsmaps.study.plan import Plan
from nsmaps.study.result import NoiseResult, StudyResult

if TYPE_CHECKING:
    from nsmaps.dynamics.impactdiagram import ImpactDiagram

DOWN_AND_UP: tuple[Literal["down", "up"], ...] = ("down", "up")


def lyapunov(plan: Plan, result: StudyResult) -> dict[str, Any]:
    """The Lyapunov exponents over a parameter."""
    from nsmaps.dynamics.lyapunov import lyapunov_sweep

    section = plan.study.lyapunov
    assert section is not None
    values = np.linspace(section.low, section.high, section.points)
    along, how = Along(plan.system, section.parameter), (section.returns, section.transient, section.follow)
    with plan.study.source.located(("lyapunov",)):
        return {"lyapunov": lyapunov_sweep(along, values, plan.begin["lyapunov"], *how, keep=plan.keep)}


def basins(plan: Plan, result: StudyResult) -> dict[str, Any]:
    """Where the states of the grid end up, and the points between basins if the study asks for them."""
    from nsmaps.dynamics.basins import basins, boundary

    section = plan.study.basins
    assert section is not None
    assert plan.grid is not None
    with plan.study.source.located(("basins",)):
        how = None, section.returns, section.tolerance, section.longest
        made = basins(plan.system, plan.grid, *how, keep=plan.keep)
        line = None if section.boundary is None else boundary(plan.system, made, section.boundary, section.returns)
    return {"basins": made, "boundary": line}


def noise(plan: Plan, result: StudyResult) -> dict[str, Any]:
    """The residence in motions for each size of the noise, and the impacts over a parameter."""
    from nsmaps.dynamics.noise import Noise, noisy_orbits
    from nsmaps.dynamics.residence import residence

    section = plan.study.noise
    assert section is not None
    stays, ended = [], []
    with plan.study.source.located(("noise",)):
        for number, sigma in enumerate(section.sigma):
            noise = Noise(sigma=sigma, tau=section.tau)
            how = section.returns, noise, section.realisations, section.seed, section.step
            made = noisy_orbits(plan.system, plan.begin["noise"], *how, keep=plan.kept(f"sigma-{number}"))
            stays.append(residence(made.words, made.time, section.modes, section.hold))
            ended.append(made.ended())
        return {"noise": NoiseResult(section.sigma, tuple(stays), tuple(ended), _impacts(plan))}


def _impacts(plan: Plan) -> "tuple[ImpactDiagram, ...]":
    """Down and up, each without noise and with it."""
    from nsmaps.dynamics.impactdiagram import impact_diagram
    from nsmaps.dynamics.noise import Noise

    noise = plan.study.noise
    assert noise is not None
    section = noise.impacts
    if section is None:
        return ()
    values = np.linspace(section.low, section.high, section.points)
    sizes = Noise(sigma=0.0, tau=noise.tau), Noise(sigma=section.sigma, tau=noise.tau)
    how = section.returns, section.transient, noise.seed, noise.step
    along, start = Along(plan.system, section.parameter), plan.begin["noise"]
    return tuple(
        impact_diagram(along, values, start, size, follow, *how, keep=plan.kept("impacts", follow, str(number)))
        for follow in DOWN_AND_UP
        for number, size in enumerate(sizes)
    )
