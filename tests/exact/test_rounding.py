"""Flights that amplify rounding errors, against closed forms: what is decided is right, and what is right is decided."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import mpmath as mp
import numpy as np
import pytest
import sympy as sp

from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.arrays import Floats
from nsmaps.exact.outcome import Outcome

pytest.importorskip("heyoka")


class Saddle(HybridSystem):
    """x'' = x - x**3 between walls at x = -1 and x = 1 that give the speed back."""

    states = ("x", "v")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"free": {"x": y.v, "v": y.x - y.x**3}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        return {"R": Guard("free", 1 - y.x, reset={"v": -y.v}), "L": Guard("free", 1 + y.x, reset={"v": -y.v})}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("R", ("v",))


class Shaken(HybridSystem):
    """The same motion in the states z = x + a sin(t) and w = z', whose rates depend on the time."""

    a: float = 0.5
    states = ("z", "w")

    def period(self) -> Any:
        return 2 * sp.pi

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        x = y.z - self.a * sp.sin(t)
        return {"free": {"z": y.w, "w": x - x**3 - self.a * sp.sin(t)}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        x, back = y.z - self.a * sp.sin(t), {"w": 2 * self.a * sp.cos(t) - y.w}
        return {"R": Guard("free", 1 - x, reset=back), "L": Guard("free", 1 + x, reset=back)}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("R", ("w", "phi"))


def beside_the_separatrix() -> tuple[Floats, Floats]:
    """Speeds at the walls, and how far their energy is from that of the saddle, as a share of what it would be at its depth."""
    shares = np.array([sign * 10.0 ** (-k / 2) for k in range(2, 33) for sign in (1, -1)])
    speeds = np.sqrt(0.5 * (1 + shares))
    return speeds, np.array([float(2 * mp.mpf(v) ** 2 - 1) for v in speeds.tolist()])


def test_what_passes_near_a_saddle_is_decided_to_the_ends_of_its_words() -> None:
    """Errors along the motion are shifts of time. The word is that of the sign of the energy, and the speed is kept."""
    speeds, exact = beside_the_separatrix()
    found = Saddle().first_return(speeds[:, None])
    decided = found.outcome == Outcome.returned
    assert decided[np.abs(exact) > 1e-12].all()
    assert not decided[np.abs(exact) < 1e-15].any()
    assert found.words[decided].tolist() == np.where(exact > 0, "RLR", "RR")[decided].tolist()
    np.testing.assert_allclose(found.image[decided, 0], speeds[decided], rtol=1e-14)


def test_with_rates_that_depend_on_the_time_a_shift_of_it_counts() -> None:
    speeds, exact = beside_the_separatrix()
    found = Shaken().first_return(np.column_stack([speeds + 0.5, 0 * speeds]))
    decided = found.outcome == Outcome.returned
    assert decided[np.abs(exact) > 1e-3].all()
    assert not decided[np.abs(exact) < 1e-9].any()
    assert found.words[decided].tolist() == np.where(exact > 0, "RLR", "RR")[decided].tolist()
    np.testing.assert_allclose((found.image[:, 0] - 0.5 * np.cos(found.image[:, 1]))[decided], speeds[decided], rtol=1e-10)


class Delayed(HybridSystem):
    """x' = y x with y' = eps, in the states z = x + sin(y) and y, until x = 1: stable while y < 0, and then unstable."""

    eps: float = 0.05
    states = ("z", "y")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"slow": {"z": y.y * (y.z - sp.sin(y.y)) + self.eps * sp.cos(y.y), "y": self.eps}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        return {"out": Guard("slow", 1 - y.z + sp.sin(y.y), reset={"z": sp.sin(y.y) + sp.Rational(1, 2), "y": -y.y})}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("out", ("y",), states={"z": 1 + sp.sin(y.y)})


def test_errors_that_come_in_where_a_slow_manifold_becomes_unstable_are_counted() -> None:
    """x shrinks to exp(-y0**2/(2 eps)) at y = 0 and grows again, by as much; rounding of z begins to grow there."""
    eps, starts = 0.05, -np.linspace(0.2, 2.2, 41)
    found = Delayed().arrivals(np.column_stack([np.sin(starts) + 0.5, starts]), ["slow"] * len(starts))
    with mp.workdps(30):
        left = [mp.mpf(z) - mp.sin(mp.mpf(y)) for z, y in zip((np.sin(starts) + 0.5).tolist(), starts.tolist(), strict=True)]
        exact = np.array(
            [float(mp.sqrt(mp.mpf(y) ** 2 - 2 * mp.mpf(eps) * mp.log(x))) for x, y in zip(left, starts.tolist(), strict=True)]
        )
    wrong, decided = np.abs(found.image[:, 0] - exact), found.outcome == Outcome.returned
    assert decided[wrong < 1e-13].all()
    assert not decided[wrong > 1e-9].any()
    assert 10 < decided.sum() < 35
