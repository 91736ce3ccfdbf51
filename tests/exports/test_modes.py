"""The equations of systems with modes in LaTeX: rates of all modes, derived ones too, events, resets and section."""

import dataclasses
import re
import shutil
import subprocess

import pytest
import sympy as sp
from hybrid import Friction

import nsmaps

BELT = {"zeta": 0.02, "vb": 0.3, "mu_k": 0.4, "mu_s": 0.6, "w": 0.9, "A": 0.25}
PAIR = {"eta": 0.1, "kappa": 0.04, "Lambda": 0.2, "d": 0.35, "r": 0.5, "g_bar": 0.2113}


class Rubbed(Friction):
    """Friction on a belt whose speed is noise, beside a force of noise: the rate of sliding has the noise's rate."""

    noise = "eta"

    def modes(self, t, y):
        rates = super().modes(t, y)
        return {name: {**given, "u": given["u"] + y.eta / 2} for name, given in rates.items()}

    def guards(self, t, y):
        (name, surface), *others = super().guards(t, y).items()
        return {name: dataclasses.replace(surface, function=surface.function - y.eta), **dict(others)}


SYSTEMS = {
    "belt": nsmaps.load_system("belt", **BELT),
    "contact": nsmaps.load_system("recoil_pair", **PAIR, contact=True),
    "friction": Friction(mu=0.5),
    "rubbed": Rubbed(mu=0.5),
    "converter": nsmaps.load_system("buck_converter", E=22.0),
    "strobe": nsmaps.load_system("rocking_block", a=0.8, w=4.0),
}


def numbers_in(text, left, values):
    """The right side of an equation for a state, evaluated: LaTeX of sums and products read back by a few substitutions."""
    (found,) = re.findall(rf"\\dot {{{left}}} &=(.*?)\\end", text, flags=re.DOTALL)
    plain = found.replace("\\\\\n&\\quad", " ").replace("\\left(", "(").replace("\\right)", ")")
    plain = re.sub(r"_{(\w+)}", r"_\1", plain)
    plain = re.sub(r"\\frac{((?:[^{}]|{[^{}]*})*)}{([^{}]*)}", r"((\1)/(\2))", plain)
    plain = re.sub(r"\\(cos|sin){(\([^()]*\))}", r"\1\2", plain).replace("\\", "")
    plain = re.sub(r"(?<=[\w)]) (?=[\w(])", "*", re.sub(r"\s+", " ", plain).strip())
    return float(sp.sympify(plain, locals={name: sp.Float(x) for name, x in values.items()}))


@pytest.mark.parametrize("name", SYSTEMS)
def test_braces_and_environments_are_balanced(name):
    text = nsmaps.export(SYSTEMS[name], "latex")
    assert text.count("{") == text.count("}")
    assert text.count(r"\begin{align*}") == text.count(r"\end{align*}") > 0
    assert "_y_" not in text
    assert "_p_" not in text


@pytest.mark.skipif(not shutil.which("pdflatex"), reason="pdflatex is not here, so the LaTeX was not compiled")
@pytest.mark.parametrize("name", SYSTEMS)
def test_documents_compile(name, tmp_path):
    nsmaps.export(SYSTEMS[name], "latex", tmp_path, name="system")
    subprocess.run(["pdflatex", "-halt-on-error", "-interaction=nonstopmode", "system.tex"], cwd=tmp_path, check=True)


def test_rates_are_read_back_from_latex():
    """Of slip on the belt as in its equation, and of contact as of one body of both masses."""
    values = {**BELT, "t": 0.7, "x": 0.4, "u": -0.2, "noise": 0}
    text = nsmaps.export(SYSTEMS["belt"], "latex")
    parts = dict(re.findall(r"Mode (\w+):(.*?)(?=Mode |An event)", text, flags=re.DOTALL))
    assert set(parts) == {"slower", "faster", "stick"}
    force = 0.25 * sp.cos(0.9 * 0.7) - 2 * 0.02 * -0.2 - 0.4
    assert numbers_in(parts["slower"], "u", values) == pytest.approx(float(force) + 0.4, rel=1e-12)
    assert numbers_in(parts["faster"], "u", values) == pytest.approx(float(force) - 0.4, rel=1e-12)
    assert numbers_in(parts["stick"], "x", values) == 0.3
    assert numbers_in(parts["stick"], "u", values) == 0
    values = {**PAIR, "t": 0.7, "x": 0.175, "v": 0.0, "X": 0.2, "V": -0.5, "noise": 0}
    (base,) = re.findall(r"Mode base:(.*?)Mode top", nsmaps.export(SYSTEMS["contact"], "latex"), flags=re.DOTALL)
    together = (float(sp.cos(sp.pi * 0.7)) - 0.04 * 0.2 + 0.2 * 0.5 - 0.1 * 0.2113) / 1.1
    assert numbers_in(base, "V", values) == pytest.approx(together, rel=1e-12)


def test_derived_modes_events_and_section_are_stated():
    text = nsmaps.export(SYSTEMS["contact"], "latex")
    assert re.findall(r"Mode (\w+):", text) == ["flight", "base", "top"]
    assert "impacts that accumulate lead to the mode base" in text
    assert r"v^+ &= - r v" in text
    assert "just before it" in text
    friction = nsmaps.export(SYSTEMS["friction"], "latex")
    assert re.findall(r"Mode (\w+):", friction) == ["slower", "faster", "stick"]
    assert "slides along it in the mode stick" in friction
    assert "The forcing has the period $P = 2 \\pi$." in friction


def test_noise_stands_where_it_acts():
    """In the rates of slip and of contact, in conditions and in events; sliding along a surface that moves has its rate."""
    belt, pair = nsmaps.export(SYSTEMS["belt"], "latex"), nsmaps.export(SYSTEMS["contact"], "latex")
    parts = dict(re.findall(r"Mode (\w+):(.*?)(?=Mode |An event)", belt, flags=re.DOTALL))
    values = {**BELT, "t": 0.7, "x": 0.4, "u": -0.2, "noise": 0.13}
    force = 0.25 * sp.cos(0.9 * 0.7) - 2 * 0.02 * -0.2 - 0.4 + 0.13
    assert numbers_in(parts["slower"], "u", values) == pytest.approx(float(force) + 0.4, rel=1e-12)
    assert "noise" not in parts["stick"]
    assert len(re.findall("geq 0", belt)) == len(re.findall("noise .*geq 0", belt)) == 6
    assert "The noise is $noise$, zero in the return map." in belt
    (base,) = re.findall(r"Mode base:(.*?)Mode top", pair, flags=re.DOTALL)
    values = {**PAIR, "t": 0.7, "x": 0.175, "v": 0.0, "X": 0.2, "V": -0.5, "noise": 0.13}
    together = (float(sp.cos(sp.pi * 0.7)) + 0.13 - 0.04 * 0.2 + 0.2 * 0.5 - 0.1 * 0.2113) / 1.1
    assert numbers_in(base, "V", values) == pytest.approx(together, rel=1e-12)
    rubbed = nsmaps.export(SYSTEMS["rubbed"], "latex")
    (stick,) = re.findall(r"Mode stick:(.*?)An event", rubbed, flags=re.DOTALL)
    assert r"\dot {u} &= \eta^{(1)}" in stick
    assert "_n_" not in rubbed
    assert "noise" not in nsmaps.export(SYSTEMS["friction"], "latex")


def test_a_nonlinear_system_has_its_formulas_and_a_kink_as_it_is_written():
    class Pendulum(nsmaps.HybridSystem):
        """A pendulum with quadratic drag."""

        c: float = 0.1
        states = ("a", "b")

        def modes(self, t, y):
            return {"m": {"a": y.b, "b": -sp.sin(y.a) - self.c * y.b * sp.Abs(y.b)}}

        def guards(self, t, y):
            return {"W": nsmaps.Guard("m", sp.sin(y.a), reset={"b": -y.b})}

        def section(self, t, y):
            return nsmaps.PoincareSection("W", ("b",), states={"a": 0})

    text = nsmaps.export(Pendulum(), "latex")
    assert text.count("Mode m:") == 1
    assert r"\left|{b}\right|" in text
    assert r"\sin{\left(a \right)}" in text
    assert not re.findall(r"_s_|_y_|_p_", text)
