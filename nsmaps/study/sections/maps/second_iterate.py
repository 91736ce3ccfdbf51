"""The section `second_iterate`: the second iterate of the piece of one domain."""

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field

from nsmaps.errors import NsmapsError
from nsmaps.figures.parts import Bounded
from nsmaps.reduced.composite.composite import CompositeMap
from nsmaps.study.conclusions.phrases import at
from nsmaps.study.conclusions.titles import pieces_with_a_map
from nsmaps.study.pictures.figure import FigurePart, StudyFigure
from nsmaps.study.reading.values import ATTRACTING
from nsmaps.study.sections.base import Analysis
from nsmaps.study.sections.maps.partition import attracting_of, is_of_partition

if TYPE_CHECKING:
    from nsmaps.study.sections.base import Plan, Study, StudyResult


def _bounded(result: "StudyResult") -> Bounded | None:
    """The domain between whose bounds the study takes the second iterate, with the updates that it names."""
    asked = result.study.second_iterate
    return None if asked is None else Bounded(asked.domain, result.domains[asked.domain], asked.updates)


BOUNDED: "FigurePart[Bounded]" = FigurePart("an attracting domain", ("domains",), _bounded)


class SecondIterateSection(Analysis):
    """The second iterate of the piece of one domain, between its last auxiliary maps; needs `domains`.

    The order is that of eq. seconditerativev, which has the fixed point q where the map falls with the other coordinate, or that
    of eq. auxv2nd, which has p. The other coordinate is held at the ends of the box from which the last update started,
    `domain.updates[-1].box`; `result.second_iterate.held` has the values.
    """

    key: ClassVar[str] = "second_iterate"
    needed: ClassVar[tuple[str, ...]] = ("domains",)
    stored: ClassVar[bool] = False
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "domains.second_iterate",
            "The second iterates of the auxiliary maps with their fixed points.",
            "Second iterates of the auxiliary maps at some updates N: the lower map of the upper map (thick), which has p, and "
            "the upper map of the lower map (thin), which has q, or the worst case of both. If the box is forward invariant, p "
            "and q bound the coordinate.",
            (FigurePart("a second-iterate map", ("second_iterate",)), BOUNDED),
        ),
    )

    domain: str = Field(description="a domain of a fitted piece")
    order: Literal["max_first", "min_first"] = Field(
        "max_first",
        description="which extreme the other coordinate takes first: `max_first` has the fixed point q, `min_first` has p",
    )
    updates: tuple[Annotated[int, Field(ge=1)], ...] = Field(
        (), description="updates N that the figure shows; by default the second and the last"
    )

    def recompute(self, result: "StudyResult") -> dict[str, Any]:
        """The second iterate of the first coordinate, between the last bounds of the second."""
        from nsmaps.symbolic.curve_iterates import second_iterate

        spec = result.study.second_iterate
        name = spec.domain
        piece = next(domain.map for domain in result.study.domains if domain.name == name)
        polymap = attracting_of(result.partition) if result.partition and piece == ATTRACTING else None
        if isinstance(polymap, CompositeMap):
            count = len(polymap.pieces)
            raise NsmapsError(
                f"the second iterate is of one piece, and {count} are attracting; expected: a domain of one of them"
            )
        if polymap is None:
            assert result.composite is not None
            polymap = result.composite.piece(piece).map
        low, high = result.domains[name].updates[-1].box[1]  # of the last auxiliary maps, whose two-cycle is (p, q)
        return {"second_iterate": second_iterate(polymap, float(low), float(high), spec.order)}

    def check(self, study: "Study") -> None:
        fitted = pieces_with_a_map(study)
        of_pieces = [d.name for d in study.domains if d.map in fitted or is_of_partition(study, d.map)]
        study.source.known(("second_iterate", "domain"), self.domain, of_pieces, "domain of a fitted piece")

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        return self.recompute(result)

    def describe(self, study: "Study") -> str:
        return f"of the domain {self.domain}"

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        iterate = result.second_iterate
        return {"second_iterate": {"expr": str(iterate.expr), "alpha": [float(value) for value in iterate.alpha]}}

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The domain of the second iterate, and the ends p and q of its box."""
        domain = result.domains.get(self.domain)
        if domain is None or not domain.forward_invariant:
            return ""
        ends = zip(domain.coordinates, domain.two_cycle, strict=True)
        points = "; ".join(f"p = {p:.5g} and q = {q:.5g} of {name}" for name, (p, q) in ends)
        return f"{at(result)}domain {self.domain}; {points}."
