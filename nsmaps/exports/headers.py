"""What an exported file says of what it holds: at which values curves are held, and of which study and domain they are."""

from collections.abc import Sequence
from typing import Any

from nsmaps.auxiliary.attracting_domain import AttractingDomain
from nsmaps.symbolic.curve_iterates import HeldIterate, SecondIterate

SIDES = {"max_first": ("max", "min"), "min_first": ("min", "max")}
ORDERS = {
    "max_first": "Order max_first: first the curve at the largest values of the others, then the one at the smallest.",
    "min_first": "Order min_first: first the curve at the smallest values of the others, then the one at the largest.",
}


def curve_titles(result: HeldIterate) -> list[str]:
    """What each curve is called, such as "Curve 1, at phi_max = 0.5"."""
    titles = [f"Curve {k}" for k in range(1, len(result.curves) + 1)]
    ends = [f"_{side}" for side in SIDES[result.order]] if isinstance(result, SecondIterate) else [""] * len(titles)
    for k, (values, end) in enumerate(zip(result.held, ends, strict=False)):
        titles[k] += "".join(f", at {name}{end} = {value}" for name, value in values.items() if str(value) != f"{name}{end}")
    return titles


def order_of(result: Any) -> list[str]:
    """The order of a second iterate in words."""
    return [ORDERS[result.order]] if isinstance(result, SecondIterate) else []


def described(result: Any) -> list[str]:
    """What a closed form of one coordinate is: the order of its curves, and what each is held at."""
    titles = curve_titles(result) if isinstance(result, HeldIterate) else []
    return [*order_of(result), *(f"{title}." for title in titles)]


def of_study(result: Any, without: str = "") -> list[str]:
    """The study of a result, its system and the parameters of that, but for one that a map leaves open."""
    values = ", ".join(f"{name} = {value!r}" for name, value in result.system.parameters.items() if name != without)
    study = " ".join(f"{result.study.name}: {result.study.title}".split()).removesuffix(":")
    return [f"Of the study {study}", f"System: {type(result.system).__name__}{f', {values}' if values else ''}."]


def of_domain(name: str, piece: str, domain: AttractingDomain, others: Sequence[str]) -> list[str]:
    """The domain whose last update held the others at the ends of its box, with its verdict; a warning where it has none."""
    known = f"{'' if domain.forward_invariant else 'NOT '}forward invariant and {'' if domain.converged else 'NOT '}converged"
    held = f"{' and '.join(others)} held at the ends of the box of its update {domain.updates[-1].number}, updates[-1].box"
    lines = [f"Of the piece {piece}, {held}.", f"Domain {name}, of the {domain.of}: {known}; {domain.reason}."]
    if not domain.forward_invariant:
        lines.append("CAUTION: as the domain is not forward invariant, orbits may leave it, and these curves bound nothing.")
    elif not domain.converged:
        lines.append("CAUTION: as the domain has not converged, another update would give other values.")
    return lines
