"""The woodpecker toy: a sleeve on a pole, a bird on a spring, and impacts with Coulomb friction at three contacts.

R. I. Leine, C. Glocker, D. H. van Campen, Nonlinear dynamics of the woodpecker toy, ASME DETC2001/VIB-21608 (2001);
R. I. Leine, D. H. van Campen, C. Glocker, Nonlinear dynamics and modeling of various wooden toys with impact and friction,
J. Vibration and Control 9 (2003) 25.
"""

from collections.abc import Mapping
from fractions import Fraction
from types import SimpleNamespace
from typing import Any, ClassVar, NamedTuple

from pydantic import Field

from nsmaps.exact.systems.hybrid import Guard, HybridSystem, PoincareSection, SlidingSurface

STROKES = ("slip", "stop", "halt")  #: of the beak: it slips throughout, or stops and then slips upwards, or downwards


class Contact(NamedTuple):
    """A contact: the rates of its gap and of its slip, by the velocities (v, m, s), and these velocities just before."""

    normal: Any
    tangent: Any
    velocities: Any


class Impulse(NamedTuple):
    """The normal impulse of an impact, and the velocities (v, m, s) just after it."""

    size: Any
    velocities: Any


class Woodpecker(HybridSystem):
    """Sleeve and bird in SI units: angles M and S, the speed v of the sleeve upwards, and both angular speeds m and s.

    The beak B strikes the pole, and the lower and the upper edge of the sleeve, 2 and 3, touch it without restitution. At each of
    the three Coulomb friction acts in impacts and in contact. The place of the sleeve on the pole does not matter.
    """

    c: float = Field(0.0056, gt=0, description="stiffness of the spring between sleeve and bird, N m")
    mu: float = Field(0.3, ge=0, description="friction at all contacts")
    e: float = Field(0.5, ge=0, le=1, description="restitution of the beak (Poisson)")

    sleeve_mass: ClassVar = Fraction(3, 10_000)  #: kg
    bird_mass: ClassVar = Fraction(45, 10_000)  #: kg
    sleeve_inertia: ClassVar = Fraction(5, 10**9)  #: kg m^2
    bird_inertia: ClassVar = Fraction(7, 10**7)  #: kg m^2
    pole_radius: ClassVar = Fraction(25, 10_000)  #: m
    sleeve_radius: ClassVar = Fraction(31, 10_000)  #: m, inside
    half_height: ClassVar = Fraction(58, 10_000)  #: m, of the sleeve
    spring_arm: ClassVar = Fraction(1, 100)  #: m, from the sleeve's centre to the spring
    bird_arm: ClassVar = Fraction(15, 1000)  #: m, from the spring to the bird's centre
    beak_height: ClassVar = Fraction(2, 100)  #: m, above the bird's centre
    beak_length: ClassVar = Fraction(201, 10_000)  #: m, from the bird's centre towards the pole
    gravity: ClassVar = Fraction(981, 100)  #: m/s^2

    states = ("M", "S", "v", "m", "s")

    def inverse(self) -> Any:
        """The inverse of the mass matrix of (v, m, s)."""
        from sympy import Matrix, sympify

        mass, a, b = sympify(self.bird_mass), sympify(self.spring_arm), sympify(self.bird_arm)
        rows = [
            [mass + self.sleeve_mass, mass * a, mass * b],
            [mass * a, mass * a**2 + self.sleeve_inertia, mass * a * b],
            [mass * b, mass * a * b, mass * b**2 + self.bird_inertia],
        ]
        return Matrix(rows).inv()

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        """Free fall, with the inner side of the sleeve moving upwards or downwards."""
        from sympy import Matrix

        twist, weight = self.c * (y.M - y.S), self.bird_mass * self.gravity
        forces = Matrix(
            [-(self.sleeve_mass * self.gravity + weight), -twist - weight * self.spring_arm, twist - weight * self.bird_arm]
        )
        accelerations = self.inverse() * forces
        return dict.fromkeys("ud", {"M": y.m, "S": y.s} | dict(zip("vms", accelerations, strict=True)))

    def slip_impulse(self, contact: Contact, direction: int, size: Any = None) -> Impulse:
        """An impulse with friction against a slip in one direction; of a size, or such that the gap no longer closes."""
        along = self.inverse() * (contact.normal - self.mu * direction * contact.tangent)
        if size is None:
            size = -contact.normal.dot(contact.velocities) / contact.normal.dot(along)
        return Impulse(size, contact.velocities + along * size)

    def stop_impulse(self, contact: Contact) -> Impulse:
        """The impulse after which the gap no longer closes, and slip has stopped."""
        from sympy import Matrix

        both, inverse = Matrix.hstack(contact.normal, contact.tangent), self.inverse()
        sizes = -(both.T * inverse * both).inv() * both.T * contact.velocities
        return Impulse(sizes[0], contact.velocities + inverse * both * sizes)

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        """The events of the sleeve's edges, of its slip, and of the beak."""
        slip = y.v + self.sleeve_radius * y.m
        guards: dict[str, Guard | SlidingSurface] = {"l": Guard("u", slip, to="d"), "r": Guard("d", -slip, to="u")}
        for name, side in (("2", 1), ("3", -1)):
            guards |= self.edge_guards(y, name, side)
            guards[f"stick at {name}"] = SlidingSurface(f"{name} u", f"{name} d", slip)
        return self.beak_guards(y) | guards

    def edge_guards(self, y: SimpleNamespace, name: str, side: int) -> dict[str, Guard | SlidingSurface]:
        """Impacts of an edge: slip continues, and contact lasts; slip turns; slip stops."""
        from sympy import Matrix, cancel

        gap = self.sleeve_radius - self.pole_radius + side * self.half_height * y.M
        contact = Contact(Matrix([0, side * self.half_height, 0]), Matrix([1, self.sleeve_radius, 0]), Matrix([y.v, y.m, y.s]))
        guards: dict[str, Guard | SlidingSurface] = {}
        for mode, other, direction in (("u", "d", 1), ("d", "u", -1)):
            kept, turned = self.slip_impulse(contact, direction), self.slip_impulse(contact, -direction)
            stays = cancel(direction * contact.tangent.dot(kept.velocities))
            turns = cancel(-direction * contact.tangent.dot(turned.velocities))
            guards[name + mode] = Guard(mode, gap, reset=_reset(kept), where=[stays], rests=f"{name} {mode}")
            guards[f"{name} turned {mode}"] = Guard(mode, gap, to=other, reset=_reset(turned), where=[turns])
            stopped = _reset(self.stop_impulse(contact))
            guards[f"{name} stopped {mode}"] = Guard(mode, gap, reset=stopped, where=[-stays, -turns])
        return guards

    def beak_guards(self, y: SimpleNamespace) -> dict[str, Guard | SlidingSurface]:
        """Impacts of the beak: compression with slip upwards or none, then expansion with slip upwards or downwards."""
        from sympy import Matrix, cancel

        reach = self.spring_arm + self.bird_arm - self.beak_length
        gap = reach - self.pole_radius - self.beak_height * y.S
        tangent = Matrix([1, self.spring_arm, self.bird_arm - self.beak_length])
        contact = Contact(Matrix([0, 0, -self.beak_height]), tangent, Matrix([y.v, y.m, y.s]))
        slipped, stopped = self.slip_impulse(contact, 1), self.stop_impulse(contact)
        guards: dict[str, Guard | SlidingSurface] = {}
        for name, compression, direction in zip(STROKES, (slipped, stopped, stopped), (1, 1, -1), strict=True):
            upwards = tangent.dot(slipped.velocities) * (1 if name == "slip" else -1)
            half_way = contact._replace(velocities=compression.velocities)
            expansion = self.slip_impulse(half_way, direction, self.e * compression.size)
            for to, sign in (("u", 1), ("d", -1)):
                sleeve = sign * (expansion.velocities[0] + self.sleeve_radius * expansion.velocities[1])
                where = [cancel(upwards), cancel(direction * tangent.dot(expansion.velocities)), cancel(sleeve)]
                guards[f"B {name} {to}"] = Guard(("u", "d"), gap, to=to, reset=_reset(expansion), where=where)
        return guards

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        """Just before a stroke of the beak: the angle of the sleeve, and all velocities."""
        return PoincareSection([f"B {name} {to}" for name in STROKES for to in "ud"], ("M", "v", "m", "s"))


def _reset(impulse: Impulse) -> dict[str, Any]:
    """The velocities after an impact, by name, as quotients of polynomials: what an impact brings to rest is then zero."""
    from sympy import cancel

    return dict(zip("vms", map(cancel, impulse.velocities), strict=True))
