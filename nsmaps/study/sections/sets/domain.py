"""One entry of the section `domains`: its keys, and the verdicts on it in words."""

from typing import TYPE_CHECKING, Literal

from pydantic import Field

from nsmaps.study.conclusions.diagnostics import SAMPLED, elsewhere, on_domain
from nsmaps.study.conclusions.texts import intervals
from nsmaps.study.reading.values import DIAGONAL, Bounds, Name, Section
from nsmaps.study.result import Verdict
from nsmaps.study.sections.base import verdict

if TYPE_CHECKING:
    from nsmaps.auxiliary.attracting_domain import AttractingDomain
    from nsmaps.study.result import StudyResult


class DomainSection(Section):
    """The attracting domain of one map from one box: of a piece, of the `exact` map, or of the `composite` map."""

    name: Name = Field(description="name of the domain")
    map: str = Field(description="`exact`, `composite` or a piece other than a reset; with a `partition` also `attracting`")
    box: Bounds | Literal["diagonal"] = Field(
        description="the start box; `diagonal` is the hull of the states near the diagonals"
    )
    max_updates: int = Field(11, ge=1, description="largest number of updates N")
    grow: bool = Field(False, description="start from the smallest box around this one that the map carries into itself")
    bounds_kind: Literal["outer", "inflated", "enclosed", "sampled"] | None = Field(
        None, description="how images are bounded; by default the best that the map allows"
    )
    require: tuple[Literal["forward_invariant", "converged"], ...] = Field((), description="claims that must hold")


def composite_verdict(section: DomainSection, share: float) -> Verdict:
    """Whether the composite map keeps the box of one of its pieces; required where the box is."""
    carried = f"{100 * share:.3g} %" if share else "none"
    text = f"the composite map carries {carried} of {SAMPLED:,} states of the box of {section.map}, sampled, out of it"
    text += ": other pieces decide over a part of it" if share else ""
    name = f"domain {section.name}: holds for the composite map"
    return verdict(name, "composite map", not share, text, "forward_invariant" in section.require)


def trapped_text(result: "StudyResult", section: DomainSection, domain: "AttractingDomain") -> str:
    """The reason why a box is forward invariant, or possible reasons why it is not."""
    if domain.forward_invariant:
        reason = f"no worst-case step leaves its box, in {len(domain.updates)} updates ({domain.claim})"
        skips = _of_several_returns(result, section.map)
        between = "; the states between these returns are not bounded" if skips else ""
        return f"{reason}{between}{elsewhere(result, domain)}"
    reasons = on_domain(result, section.map, domain, section.box != DIAGONAL, bool(section.require))
    return f"{domain.reason} ({domain.status}){reasons}"


def _of_several_returns(result: "StudyResult", of: str) -> bool:
    """True if an image of the composite map, or of the piece of this name, is that of several returns."""
    pieces = result.composite.pieces if result.composite else ()
    return any(piece.returns > 1 for piece in pieces if of in ("composite", piece.name))


def settled_text(domain: "AttractingDomain") -> str:
    """Whether the sides of a box have converged, with the sides."""
    if not domain.forward_invariant:
        return f"the box is not forward invariant ({domain.status})"
    if not domain.converged:
        return f"{domain.reason} ({domain.status})"
    sizes = " x ".join(f"{size:.4g}" for size in domain.sizes[-1])
    box = intervals(domain.coordinates, domain.boxes[-1])
    parts = ", ".join(f"{part} for {name}" for name, part in zip(domain.coordinates, domain.part, strict=True))
    return f"{sizes} after {len(domain.updates)} updates, {box}; part of the Statement: {parts} ({domain.status})"
