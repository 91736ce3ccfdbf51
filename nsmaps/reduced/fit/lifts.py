"""Lifts: angles of data as real numbers that a polynomial, or a periodic function, can follow."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI, wrap
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.surface import Surface
from nsmaps.reduced.fit.polymap import PolyMap

SEAM = 0.5  #: radians that another cut of the circle must gain before the data are moved there
CLEAR = np.pi / 2  #: radians of the circle that a periodic part leaves free to be taken on the stretch beside them


def unwrapped(surface: Surface | Returns) -> tuple[Floats, Floats]:
    """Starts and images of a surface or of M returns, each (M, n), with angles as real numbers that a polynomial can follow.

    Starts lie on one interval of the circle, which leaves [0, 2 pi) only where it would be cut there. Images are
    continued from their starts, minus one common number of turns that brings their median to [0, 2 pi).
    """
    start, lifted = np.array(surface.start, float), np.array(surface.lifted, float)
    for i in np.flatnonzero(surface.coordinates.angles):
        if len(start) and np.isfinite(lifted[:, i]).all() and np.isfinite(start[:, i]).all():
            stretch = stretch_of(start[:, i])
            lifted[:, i] += stretch - start[:, i]
            lifted[:, i] -= TWO_PI * np.floor(np.median(lifted[:, i]) / TWO_PI)
            start[:, i] = stretch
    return start, lifted


def stretch_of(angles: Floats) -> Floats:
    """The angles, plus whole turns, on the interval that omits the widest gap of the circle; unchanged if they fit."""
    wrapped = wrap(angles)
    around = np.sort(wrapped)
    gaps = np.diff(around, append=around[0] + TWO_PI)
    if np.ptp(angles) <= TWO_PI - gaps.max() + SEAM:
        return angles
    first = around[(np.argmax(gaps) + 1) % len(around)]
    return np.asarray(wrapped - TWO_PI * (wrapped >= first), float)


@dataclass(frozen=True, slots=True, eq=False)
class Wound:
    """Images of a fit to maps of whole circles: a number of turns times the start, and a periodic part, which is fitted."""

    winding: Mapping[int, int]  #: how often images go round as their angle does once, by coordinate
    target: Floats  #: shape (M, n), all images as real numbers
    periodic: Floats  #: shape (M, n), those of `winding` less so many times the start

    @classmethod
    def of(cls, surface: Surface, start: Floats, target: Floats, winding: Mapping[int, int]) -> Self:
        """Of a surface and its unwrapped starts and images, shape (M, n) each, of which some angles wind.

        Where an angle lacks turns, as that of a map which gives none, the periodic part is taken on one stretch.
        """
        target, periodic = target.copy(), target.copy()
        for i, times in winding.items():
            part = surface.lifted[:, i] - times * surface.start[:, i]
            if len(part) and np.isfinite(part).all():
                stretch = stretch_of(part)
                part = stretch if np.ptp(stretch) < TWO_PI - CLEAR else part
                part = part - TWO_PI * np.floor(np.median(part + times * start[:, i]) / TWO_PI)
            periodic[:, i], target[:, i] = part, part + times * start[:, i]
        return cls(winding, target, periodic)


def with_windings(polymap: PolyMap, winding: Mapping[int, int]) -> PolyMap:
    """A map of periodic parts with the angles added, so many times, that its images wind with."""
    own = {i: times for i, times in winding.items() if times}
    if not own:
        return polymap
    names, exponents, coefficients = polymap.coordinates.names, list(polymap.exponents), list(polymap.coefficients)
    texts = polymap.variables or names
    for j, each in enumerate(exponents):
        exponents[j] = np.hstack([np.zeros((len(each), len(own)), int), each])
    for column, (i, times) in enumerate(own.items()):
        row = np.arange(len(own) + len(texts)) == column
        exponents[i], coefficients[i] = np.vstack([exponents[i], row]).astype(int), np.append(coefficients[i], times)
    return replace(
        polymap,
        exponents=tuple(exponents),
        coefficients=tuple(coefficients),
        centre=np.append(np.zeros(len(own)), polymap.centre),
        scale=np.append(np.ones(len(own)), polymap.scale),
        variables=(*(names[i] for i in own), *texts),
    )
