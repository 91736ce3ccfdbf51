"""What a run of a study would compute, step by step, in a few words each, and how much work it is."""

from collections.abc import Callable, Mapping

from nsmaps.study.ranges import Range
from nsmaps.study.spec import PieceSection, Study
from nsmaps.study.steps import steps_of


def about(study: Study) -> dict[str, str]:
    """What each step would compute, by its name; nothing is computed for it."""
    return {name: ABOUT[name](study) if name in ABOUT else "" for name in steps_of(study)[1:]}


def _surfaces(study: Study) -> str:
    return f"{', '.join(study.families) or 'words'} over {_grid(study)}"


def _diagonal(study: Study) -> str:
    made = study.diagonal
    assert made is not None
    over = f" over {made.sweep.points} values of {made.sweep.parameter}" if made.sweep else ""
    return f"{made.family} within a factor {made.delta:g} of the diagonals{over}"


def _composite(study: Study) -> str:
    return ", ".join(f"{piece.name} ({_map_of(piece)})" for piece in study.composite)


def _map_of(piece: PieceSection) -> str:
    """Where the map of a piece comes from."""
    return f"fit of {piece.family}" if piece.fit else "printed" if piece.polynomial else "reset"


def _partition(study: Study) -> str:
    assert study.partition is not None
    return f"{study.partition.kind}, tolerance {study.partition.tolerance:g}"


def _parametric(study: Study) -> str:
    made = study.parametric
    assert made is not None
    return f"order {made.order} in {made.parameter} from {made.low:g} to {made.high:g}"


def _orbits(study: Study) -> str:
    return ", ".join(f"{orbit.returns} returns" for orbit in study.orbits)


def _bifurcation(study: Study) -> str:
    made = study.bifurcation
    assert made is not None
    ways = 2 if made.follow == "both" else 1
    each = made.transient + made.returns
    return f"{_range(made)} of {' and '.join(made.of)}; {_work(made.points * ways * each * len(made.of))}"


def _branches(study: Study) -> str:
    return ", ".join(f"{made.name} ({made.parameter} from {made.low:g} to {made.high:g})" for made in study.branches)


def _stability(study: Study) -> str:
    made = study.stability
    assert made is not None
    values = " x ".join(f"{span.points} values of {span.parameter}" for span in (made.along, made.across))
    return f"{values}; {_work(made.along.points * made.across.points * (made.transient + 2 * made.longest))}"


def _slices(study: Study) -> str:
    return f"{len(study.slices)} of the exact map"


def _lyapunov(study: Study) -> str:
    made = study.lyapunov
    assert made is not None
    return f"{_range(made)}; {_work(made.points * (made.transient + made.returns))} with derivatives"


def _basins(study: Study) -> str:
    made = study.basins
    assert made is not None
    states = 1
    for span in (study.grid or {}).values():
        states *= span.points
    return f"{_grid(study)}, up to {made.returns} returns each; at most {_work(states * made.returns)}"


def _noise(study: Study) -> str:
    made = study.noise
    assert made is not None
    sizes = f"{len(made.sigma)} sizes, {made.realisations} realisations of {made.returns} returns each"
    returns = len(made.sigma) * made.realisations * made.returns
    if (along := made.impacts) is None:
        return f"{sizes}; {_work(returns)}"
    return f"{sizes}, and impacts at {_range(along)}; {_work(returns + 4 * along.points * (along.transient + along.returns))}"


def _domains(study: Study) -> str:
    return ", ".join(f"{each.name} (map {each.map}, {each.updates} updates)" for each in study.domains)


def _second_iterate(study: Study) -> str:
    assert study.second_iterate is not None
    return f"of the domain {study.second_iterate.domain}"


def _morse(study: Study) -> str:
    assert study.morse is not None
    return f"{study.morse.cells} cells an axis, halved {study.morse.depth} times"


def _transient(study: Study) -> str:
    assert study.transient is not None
    return f"{study.transient.cells} cells an axis, halved {study.transient.depth} times"


def _grid(study: Study) -> str:
    return f"{' x '.join(str(span.points) for span in (study.grid or {}).values())} states"


def _range(made: Range) -> str:
    """The values of a parameter, and the returns at each where the section says them."""
    values = f"{made.points} values of {made.parameter} from {made.low:g} to {made.high:g}"
    given = dict(made)
    return f"{values}, {given['transient']} + {given['returns']} returns each" if "transient" in given else values


def _work(returns: int) -> str:
    return f"{returns:,} returns"


ABOUT: Mapping[str, Callable[[Study], str]] = {
    "surfaces": _surfaces,
    "diagonal": _diagonal,
    "composite": _composite,
    "partition": _partition,
    "parametric": _parametric,
    "orbits": _orbits,
    "bifurcation": _bifurcation,
    "branches": _branches,
    "stability": _stability,
    "slices": _slices,
    "lyapunov": _lyapunov,
    "basins": _basins,
    "noise": _noise,
    "domains": _domains,
    "second_iterate": _second_iterate,
    "morse": _morse,
    "transient": _transient,
}
