"""What is refused when a class is defined, what then waits for its first use, and what must not be refused."""

import math
import os
import re
import subprocess
import sys
import types
from abc import abstractmethod
from io import StringIO
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import sympy as sp
from messages import message
from nsmaps_soft_impact import SoftImpact
from pydantic import Field, PrivateAttr
from systems import Oscillator, Table

from nsmaps.errors import NsmapsError, ParameterError, SystemDefinitionError
from nsmaps.exact.compiling import compiled, kept
from nsmaps.exact.flows import exponentials
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall
from nsmaps.testing import check_system


class Floor(ImpactSystem):
    """One wall and a period, without a flight or an impact law: abstract."""

    h: float = Field(gt=0, lt=1e6)

    def walls(self):
        return {"F": Wall(at=-self.h, side=-1)}

    def period(self):
        return 2 * sp.pi


KIND = Literal["good", "bad"]


def made(body, **fields):
    """A class over Floor with this flight and these fields."""
    annotations = {"r": float, **{name: kind for name, (kind, _) in fields.items()}}
    values = {name: value for name, (_, value) in fields.items() if value is not ...}
    inside = {"__annotations__": annotations, "r": 0.5, "displacement": body, "__module__": __name__, **values}
    return types.new_class("Made", (Floor,), exec_body=lambda space: space.update(inside))


def falls(self, t, hit):
    s = t - hit.t
    return hit.z + hit.w * s - s**2 / 2


@pytest.mark.parametrize(
    ("body", "why"),
    [
        (lambda self, t, hit: falls(self, t, hit) + sp.sin((t - hit.t) ** 2), message("exact.not-linear-in-time")),
        (lambda self, t, hit: falls(self, t, hit) + sp.sin(1 / t), message("exact.not-linear-in-time")),
        (lambda self, t, hit: falls(self, t, hit) + sp.sqrt(1 + t), message("exact.not-followed")),
        (lambda self, t, hit: falls(self, t, hit) + sp.tan(t), message("exact.not-followed")),
        (lambda self, t, hit: falls(self, t, hit) / (1 + t), message("exact.not-followed")),
        (lambda self, t, hit: falls(self, t, hit) + sp.Abs(sp.sin(t)), message("exact.not-followed")),
        (lambda self, t, hit: falls(self, t, hit) if self.h > 1 else hit.z, message("exact.branches")),
        (
            lambda self, t, hit: hit.z + hit.w * np.sin(t - hit.t),
            message("exact.sympys-functions-of", cls="Made", formula="displacement"),
        ),
        (
            lambda self, t, hit: hit.z + hit.w * math.cos(t),
            message("exact.sympys-functions-of", cls="Made", formula="displacement"),
        ),
        (lambda self, t, hit: hit.z + hit.w * int(t), message("exact.sympys-functions-of", cls="Made", formula="displacement")),
        (
            lambda self, t, hit: hit.z + hit.w * None,
            message("exact.not-in-symbols-of", formula="displacement", error=re.compile("[^;]*"), cls="Made"),
        ),
        (lambda self, t, hit: falls(self, t, hit) * sp.Symbol("q"), message("exact.unknown-symbols", symbols="q")),
    ],
)
def test_a_form_without_bounds_is_refused_when_defined(body, why):
    with pytest.raises(SystemDefinitionError, match=why):
        made(body)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"walls": lambda self: {"A": Wall(at=0, side=1), "C": Wall(at=1, side=1)}}, message("exact.sides")),
        ({"walls": lambda self: {"A": Wall(at=0, side=1), "AB": Wall(at=1, side=-1)}}, message("exact.wall-names")),
        ({"walls": lambda self: {}}, message("exact.no-walls")),
        ({"walls": lambda self: {"A": Wall(at=sp.Symbol("q"), side=1)}}, message("exact.moving-wall", wall="A", symbols="q")),
        ({"period": lambda self: sp.Symbol("q")}, message("exact.unknown-symbols", symbols="q")),
        ({"rebound": lambda self, speed, wall: sp.Symbol("q") * speed}, message("exact.unknown-symbols", symbols="q")),
        (
            {"rebound": lambda self, speed, wall: np.exp(speed)},
            message("exact.sympys-functions-of", cls="Odd", formula="rebound"),
        ),
        ({"period": lambda self: 2 / math.sqrt(self.height)}, message("exact.sympys-functions-of", cls="Odd", formula="period")),
        (
            {"walls": lambda self: {"A": Wall(at=math.sin(self.height), side=1)}},
            message("exact.sympys-functions-of", cls="Odd", formula="walls"),
        ),
    ],
)
def test_walls_period_and_law_are_refused_when_defined(change, why):
    with pytest.raises(SystemDefinitionError, match=why):
        types.new_class("Odd", (Table,), exec_body=lambda space: space.update(change))


@pytest.mark.parametrize(
    ("formula", "body", "why"),
    [
        (
            "walls",
            lambda self: {"A": Wall(at=self.height * sp.sin(sp.Symbol("t")), side=1)},
            message("exact.moving-wall", wall="A", place="height*sin(t)", symbols="t"),
        ),
        ("walls", lambda self, t: {"A": Wall(at=0, side=1)}, message("exact.walls-called-so", arguments="(self)")),
        ("walls", lambda self: {"A": Wall(at=lambda t: sp.sin(t), side=1)}, message("exact.wall-at-function", wall="A")),
        ("walls", lambda self: {"A": Wall(at=sp.sin, side=1)}, message("exact.wall-at-function", wall="A", function="sin")),
        ("walls", lambda self: {"A": Wall(at="0", side=1)}, message("exact.wall-at", wall="A", place="'0'")),
        ("walls", lambda self: {"A": Wall(at=sp.oo, side=1)}, message("exact.wall-at-infinity", wall="A", place="oo")),
        ("walls", lambda self: {"A": Wall(at=0, side=2)}, message("exact.sides", sides="[2]")),
        ("walls", lambda self: {1: Wall(at=0, side=1)}, message("exact.wall-names", names="[1]")),
        ("walls", lambda self: [Wall(at=0, side=1)], message("exact.walls", given=re.compile(r"\[Wall.*"))),
        ("walls", lambda self: None, message("exact.walls", given="None")),
        ("period", lambda self, t: t, message("exact.not-called-so", arguments="(self)")),
        ("period", lambda self: None, message("exact.not-a-formula", given="None")),
        ("rebound", lambda self, speed: speed, message("exact.not-called-so", arguments="(self, speed, wall)")),
        ("rebound", lambda self, speed, wall: None, message("exact.not-a-formula", given="None")),
        ("displacement", lambda self, t: t, message("exact.not-called-so", arguments="(self, t, hit)")),
        (
            "displacement",
            lambda self, t, hit: hit.X,
            message("exact.arguments-of-hit", error=re.compile("AttributeError: .* 'X'")),
        ),
        ("displacement", lambda self, t, hit: [hit.z], message("exact.not-a-formula", given="[_z]")),
        ("displacement", lambda self, t, hit: "hit.z", message("exact.not-a-formula", given="'hit.z'")),
        (
            "displacement",
            lambda self, t, hit: sp.sympify("a b"),
            message("exact.not-in-symbols", error=re.compile("SympifyError: .*parse 'a b'.*")),
        ),
    ],
)
def test_what_no_system_can_be_is_refused_by_class_formula_file_and_line(formula, body, why):
    begins = message("exact.formula", cls="Odd", formula=formula)
    ends = message("exact.place-and-class", place=f"{__file__}:{body.__code__.co_firstlineno}", cls="Odd", file=__file__)
    with pytest.raises(SystemDefinitionError, match=f"(?s)(?=^{begins} ).*{why}.*{ends}"):
        types.new_class("Odd", (Table,), exec_body=lambda space: space.update({formula: body, "__module__": __name__}))


@pytest.mark.filterwarnings("ignore:Made")
@pytest.mark.parametrize(
    ("body", "why"),
    [
        (lambda self, t, hit: hit.z + self.drag, re.compile("AttributeError: .* has no attribute 'drag'.*")),
        (lambda self, t, hit: hit.z + 1 / 0, re.compile("ZeroDivisionError.*")),
        (lambda self, t, hit: {}["k"], re.compile("KeyError: 'k'.*")),
        (lambda self, t, hit: NotImplemented(t), re.compile("TypeError.*")),
    ],
)
def test_whatever_fails_in_a_formula_is_told_with_its_class_and_line(body, why):
    """Also where the class could not be looked at when it was defined, as its field `kind` has no default."""
    said = message("exact.not-in-symbols", cls="Made", formula="displacement", error=why)
    place = message("exact.place", place=f"{__file__}:{body.__code__.co_firstlineno}")
    system = made(body, kind=(KIND, ...))(h=1, kind="good")
    for ask in (lambda: system.first_return([[1.0, 0.0]]), lambda: check_system(system)):
        with pytest.raises(SystemDefinitionError, match=f"^{said}.*{place}"):
            ask()


def test_what_fails_in_sympy_is_told_with_its_class(monkeypatch):
    def fails(total):
        raise sp.PolynomialError("no polynomial")

    monkeypatch.setattr(exponentials, "split", fails)
    system = made(lambda self, t, hit: falls(self, t, hit) - (t - hit.t) ** 2)(h=1)
    with pytest.raises(SystemDefinitionError, match=message("exact.no-flow", cls="Made", why="PolynomialError: no polynomial")):
        system.first_return([[1.0, 0.0]])


def test_a_formula_that_is_inherited_is_told_with_its_base():
    base = made(lambda self, t, hit: falls(self, t, hit) - sp.cos(t) + sp.cos(hit.t) - (t - hit.t) * sp.sin(hit.t))
    heir = types.new_class("Heir", (base,), exec_body=lambda space: space.update(period=lambda self: 1, __module__=__name__))
    with pytest.raises(
        SystemDefinitionError, match=message("exact.inherited", cls="Heir", formula="displacement", base="Made", file=__file__)
    ):
        heir(h=1).first_return([[1.0, 0.0]])


@pytest.mark.parametrize("period", [0, -1, -2.5, -sp.pi])
def test_a_period_is_positive(period):
    """By one message, of flights in closed form and of modes, which would otherwise be divided by it."""
    for base, given in ((made(falls), {"h": 1}), (SoftImpact, {"xi": 0.05, "e": 0.3, "a": 0.7, "beta": 29, "w": 0.8})):
        space = {"period": lambda self: period, "__module__": __name__}
        odd = types.new_class("Odd", (base,), exec_body=lambda body, space=space: body.update(space))
        with pytest.raises(NsmapsError, match=message("exact.period", cls="Odd", period=f"{float(period):g}")):
            odd(**given).first_return([[1.0, 0.0]])


def test_a_formula_that_is_no_method_is_named_with_its_arguments():
    with pytest.raises(SystemDefinitionError, match=message("exact.no-method", cls="Made")):
        made(None)(h=1).first_return([[1.0, 0.0]])


@pytest.mark.parametrize(
    ("body", "why"),
    [
        (lambda self, t, hit: falls(self, t, hit) + 1, message("exact.start-of-flight")),
        (lambda self, t, hit: falls(self, t, hit) + t - hit.t, message("exact.velocity-of-flight")),
        (lambda self, t, hit: falls(self, t, hit) - (t - hit.t) ** 3, message("exact.restarted")),
    ],
)
def test_what_takes_numbers_is_refused_at_first_use(body, why):
    system = made(body)(h=1)
    with pytest.raises(SystemDefinitionError, match=why):
        system.first_return([[1.0, 0.0]])


def test_numbers_are_told_by_the_names_that_the_author_knows():
    cls = made(lambda self, t, hit: falls(self, t, hit) + self.pull * sp.sin(hit.t) * (t - hit.t), pull=(float, 1.0))
    with pytest.raises(
        SystemDefinitionError,
        match=message("exact.velocity-of-flight", off=re.compile(r"0\.\d+"), place="pull = 7/11, phi = 2/3", file=__file__),
    ):
        cls(h=1).first_return([[1.0, 0.0]])


def test_the_class_and_its_line_are_told():
    line = Path(__file__).read_text().split("\n").index("        class Bent(Table):") + 1
    said, ends = message("exact.not-followed"), message("exact.class", cls="Bent", place=f"{__file__}:{line}")
    with pytest.raises(SystemDefinitionError, match=f"{said}.*{ends}"):

        class Bent(Table):
            def displacement(self, t, hit):
                return falls(self, t, hit) + sp.sqrt(t)


class Terminal(StringIO):
    """What is written to standard error by somebody who looks on."""

    def isatty(self):
        return True


def test_that_something_is_compiled_is_said_on_a_terminal_only(monkeypatch, tmp_path):
    monkeypatch.setattr(kept, "_folder", lambda: tmp_path)
    streams = Terminal(), StringIO(), Terminal()
    for k, stream in enumerate(streams):
        monkeypatch.setattr(sys, "stderr", stream)
        for _ in range(2):  # the second time from memory
            compiled.njit(cache=True)(eval(f"lambda x: x + {k}"))(1)
    said = [stream.getvalue() for stream in streams]
    assert said[0] == "compiling <lambda>, once on this machine: it takes some seconds\n"
    assert said[1] == ""
    assert re.fullmatch(r"compiling <lambda>, once on this machine: it took \d+ s last time\n", said[2])


def test_classes_in_between_may_be_abstract():
    """Without an impact law, without a flight, and with hooks of their own."""
    assert issubclass(Floor, ImpactSystem)

    class Pulled(Floor):
        r: float = 0.5

        @abstractmethod
        def pull(self): ...

        def displacement(self, t, hit):
            s = t - hit.t
            return hit.z + hit.w * s - self.pull() * s**2 / 2

    class Weak(Pulled):
        def pull(self):
            return sp.Rational(1, 2)

    assert Weak(h=1).first_return([[1.0, 0.0]]).time == pytest.approx([2.0])
    with pytest.raises(SystemDefinitionError, match=message("exact.not-followed")):

        class Strange(Pulled):
            def pull(self):
                return sp.Symbol("_s", real=True) ** sp.Rational(1, 2)

    class Template(Floor):
        r: float = 0.5

        def displacement(self, t, hit):
            raise NotImplementedError

    assert Template(h=1).parameters == {"h": 1, "r": 0.5}
    with pytest.raises(SystemDefinitionError, match=message("exact.no-restitution")):

        class Lawless(Floor):
            displacement = falls


def test_a_formula_may_use_what_is_defined_below_it():
    space = {"Floor": Floor}
    text = "class Late(Floor):\n    r: float = 0.5\n    def displacement(self, t, hit):\n        return later(self, t, hit)\n"
    exec(text, space)
    with pytest.raises(
        SystemDefinitionError,
        match=message("exact.not-in-symbols", cls="Late", formula="displacement", error="NameError: name 'later' is not defined"),
    ):
        space["Late"](h=1).first_return([[1.0, 0.0]])
    space["later"] = falls
    assert space["Late"](h=1).first_return([[1.0, 0.0]]).time == pytest.approx([1.0])


def chosen(self, t, hit):
    s = t - hit.t
    return falls(self, t, hit) + (sp.sin(s**2) if self.kind == "bad" else 0)


@pytest.mark.parametrize(("kind", "default"), [(KIND, ...), (KIND | None, None), (KIND, "good"), (KIND, Field("good"))])
def test_a_choice_that_is_not_made_is_left_to_first_use(kind, default):
    cls = made(chosen, kind=(kind, default))
    assert cls(h=1, kind="good").first_return([[1.0, 0.0]]).time == pytest.approx([1.0])
    with pytest.raises(SystemDefinitionError, match=message("exact.not-linear-in-time")):
        cls(h=1, kind="bad").first_return([[1.0, 0.0]])


@pytest.mark.parametrize("default", ["bad", Field("bad"), Field(default_factory=lambda: "bad")])
def test_a_choice_that_is_made_by_default_is_refused_when_defined(default):
    with pytest.raises(SystemDefinitionError, match=message("exact.not-linear-in-time")):
        made(chosen, kind=(KIND, default))


def test_what_pydantic_offers_is_no_obstacle():
    """Constraints, private attributes, things done after validation, and factories that see other fields."""

    class Rich(Floor):
        r: float = Field(0.5, ge=0, le=1, multiple_of=0.25)
        copies: int = Field(default_factory=lambda data: int(data["r"] * 2), ge=1)
        _seen: list[str] = PrivateAttr(default_factory=list)
        displacement = falls

        def model_post_init(self, context):
            self._seen.append(str(self.h))

    assert Rich(h=1).first_return([[1.0, 0.0]]).time == pytest.approx([1.0])


def test_a_formula_may_hold_floats():
    """Which are rounded, and what sympy makes of several of them is so again."""
    systems = [
        made(lambda self, t, hit, c=c: falls(self, t, hit) - c * (t - hit.t) ** 2)(h=1) for c in (0.1 * 3, sp.Rational(3, 10))
    ]
    one, other = (system.first_return([[1.0, 0.0], [0.3, 2.0]]) for system in systems)
    assert one.image == pytest.approx(other.image, rel=1e-14)


def run(code):
    """What a python that runs some code prints."""
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=env)


def test_a_class_without_a_file_and_with_annotations_that_are_text():
    """As in a notebook."""
    head = "from __future__ import annotations\nfrom systems import Table\nimport sympy as sp\n"
    good = (
        "class Mine(Table):\n    pull: float = 1.0\n    def displacement(self, t, hit):\n"
        "        s = t - hit.t\n        return hit.z + hit.w * s - self.pull * s**2 / 2"
    )
    told = run(f"{head}{good}\nprint(*Mine.parameter_names())\n{good.replace('Mine', 'Other')} + sp.sin(s**2)")
    assert told.stdout == "height floor ceiling pull\n"
    assert "SystemDefinitionError: sin(_s**2)" in told.stderr


def test_where_sympy_is_not_loaded_nothing_loads_it():
    lazy = (
        "from nsmaps.exact.systems.system import ImpactSystem\n"
        "from nsmaps.exact.systems.walls import Wall\n"
        "class Lazy(ImpactSystem):\n    r: float = 0.5\n    def walls(self):\n        return {'F': Wall(at=0, side=-1)}\n"
        "    def period(self):\n        return 1\n    def displacement(self, t, hit):\n        from sympy import sqrt\n"
        "        return hit.z + hit.w * sqrt(t - hit.t)\n"
    )
    told = run(f"{lazy}import sys\nprint('sympy' in sys.modules)\nLazy().first_return([[1.0, 0.0]])")
    assert told.stdout == "False\n"
    assert "SystemDefinitionError: sqrt(_s) cannot be followed" in told.stderr
    with pytest.raises(SystemDefinitionError, match=message("exact.not-followed", formula="sqrt(_s)")):
        exec(lazy, {"__name__": "lazy"})


def test_the_systems_of_the_tests_are_defined():
    """The good ones are not refused for a second time either."""
    for cls in (Table, Oscillator):
        types.new_class("Again", (cls,))


def test_formulas_of_many_terms_can_be_read_by_python() -> None:
    from nsmaps.exact.enclosure.arithmetic.formulas import ball_code

    many = sp.symbols("a0:900")
    for whole in (sp.Add(*many), sp.Mul(*many), sp.Add(*(x * y for x, y in pairwise(many)))):
        code = ball_code(whole)
        names = dict.fromkeys(map(str, many), (2.0, 0.0))
        added = {"badd": lambda a, b: (a[0] + b[0], 0.0), "bmul": lambda a, b: (a[0] * b[0], 0.0)}
        expected = whole.xreplace(dict.fromkeys(many, sp.Integer(2)))
        assert eval(code, added | names)[0] == pytest.approx(float(expected))


class Paced(Table):
    speed: float = 1.0

    def period(self):
        return sp.pi / self.speed


@pytest.mark.parametrize("speed", [-1.0, -0.5])
def test_a_period_that_parameters_make_negative_is_refused(speed: float):
    said = message("exact.period-at", cls="Paced", period=f"{math.pi / speed:g}", name="speed", value=f"{speed:g}")
    with pytest.raises(ParameterError, match=said):
        Paced(height=1.0, speed=speed).first_return([[1.0, 1.0]])
    assert Paced(height=1.0).first_return([[1.0, 1.0]]).valid.all()
