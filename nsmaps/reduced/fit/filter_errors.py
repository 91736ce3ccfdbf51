"""Errors of polynomials of several orders fitted to the states near the diagonals, for several delta: table TableDeltaErr."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from nsmaps.errors import FitError
from nsmaps.exact.surfaces.surface import Surface
from nsmaps.reduced.fit.filter import NearDiagonal
from nsmaps.reduced.fit.polyfit import PolyFit, fit_orders
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.results import Result


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class NearDiagonals(Result):
    """The part of one surface near the diagonals for one delta (eq. r1uniond), and the fits to it."""

    delta: float
    surface: Surface
    maps: dict[str, PolyMap]  #: by the name of the order; each with its report
    picture: ClassVar[str] = "nsmaps.figures.fits.orders"

    def summary(self) -> str:
        """The numbers that matter."""
        return f"delta = {self.delta:g}: {len(self.surface.start)} states, fits {', '.join(self.maps) or 'none'}"

    @property
    def units(self) -> Mapping[str, str]:
        """Those of the surface."""
        return self.surface.units


def compare_deltas(
    diagonal: NearDiagonal, surface: Surface, deltas: Sequence[float], fits: Mapping[str, PolyFit]
) -> tuple[NearDiagonals, ...]:
    """The fits to the part of a surface near the diagonals, for the filter's own delta and then each other one, once.

    Raises:
        FitError: names the delta and the fit.
    """
    found = []
    for delta in dict.fromkeys((diagonal.delta, *deltas)):
        near = diagonal.model_copy(update={"delta": delta}).near(surface)
        try:
            found.append(NearDiagonals(delta, near, fit_orders(near, fits)))
        except FitError as error:
            raise FitError(f"delta {delta:g}: {error}") from error
    return tuple(found)
