"""LaTeX documents compile, and state the numbers of the map."""

import re
import shutil
import subprocess

import exported
import pytest
import sympy as sp
import systems

import nsmaps
from nsmaps.reduced.fit.polyfit import PolynomialFit
from nsmaps.symbolic.curve_iterates import second_iterate

POLY23 = PolynomialFit(degrees={"v": 3, "phi": 2})
THINGS = {name: case[0] for name, case in exported.cases().items()} | {
    "awkward": exported.awkward(),
    "general": second_iterate(POLY23),
    "in d": second_iterate(exported.parametric(), piece="P0"),
    "ball": systems.BouncingBall(a=0.3),
    "oscillator": systems.Oscillator(zeta=0.1, w=2.0, gap=0.5),
    "table": systems.Table(height=1.0),
    "VI pair": nsmaps.load_system("vi_pair", d=0.35, g_bar=0.2113),
}


@pytest.mark.skipif(not shutil.which("pdflatex"), reason="pdflatex is not here, so the LaTeX was not compiled")
@pytest.mark.parametrize("name", THINGS)
def test_documents_compile(name, tmp_path):
    nsmaps.export(THINGS[name], "latex", tmp_path)
    (file,) = tmp_path.glob("*.tex")
    command = ["pdflatex", "-halt-on-error", "-interaction=nonstopmode", file.name]
    told = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, errors="replace", check=False)
    assert told.returncode == 0, told.stdout[-2000:]
    assert file.with_suffix(".pdf").stat().st_size > 1000
    assert "Missing character" not in told.stdout
    wide = [float(points) for points in re.findall(r"Overfull \\hbox \((\d+\.\d+)pt too wide\)", told.stdout)]
    assert max(wide, default=0.0) < 60


@pytest.mark.parametrize("name", THINGS)
def test_braces_and_environments_are_balanced(name):
    text = nsmaps.export(THINGS[name], "latex")
    plain = re.sub(r"\\[\\{}]", "", text)
    assert plain.count("{") == plain.count("}")
    opened, closed = (sorted(re.findall(rf"\\{word}{{(\w+\*?)}}", text)) for word in ("begin", "end"))
    assert opened == closed
    assert len(re.findall(r"(?<!\\)\\\[", text)) == len(re.findall(r"(?<!\\)\\\]", text))


def value_of(formula, values):
    """A sum of Chebyshev products in LaTeX, in numbers: an evaluation that knows no nsmaps."""
    text = re.sub(r"\\\\\n&\\quad", "", formula)
    text = re.sub(r"\\cdot 10\^\{(-?\d+)\}", r"e\1", text)
    text = re.sub(r"T_\{(\d+)\}\(s_\{(\d+)\}\)", lambda m: f"*chebyshevt({m[1]}, s{m[2]})", text)
    return float(sp.sympify(text.replace(" ", ""), locals=dict(values)))


def test_chebyshev_products_are_those_of_the_map():
    polymap = exported.random_map([[0.5, 1.0], [0.1, 0.9]])
    text = nsmaps.export(polymap, "latex")
    formulas = re.findall(r"_\{k\+1\} &=(.*?)\n\\end", text, re.DOTALL)
    state = [0.66, 0.41]
    scaled = [
        (sp.Rational(x) - sp.Rational(c)) / sp.Rational(s) for x, c, s in zip(state, polymap.centre, polymap.scale, strict=True)
    ]
    values = {f"s{k}": value for k, value in enumerate(scaled, 1)}
    got = [value_of(formula, values) for formula in formulas[:2]]
    assert got == pytest.approx(polymap([state])[0].tolist(), rel=1e-14)


def test_alphas_of_general_coefficients_are_read_back_from_latex():
    iterate = second_iterate(POLY23)
    text = nsmaps.export(iterate, "latex")
    assert iterate.alpha
    for k, alpha in enumerate(iterate.alpha):
        (formula,) = re.findall(rf"\\alpha_\{{{k}\}} &=(.*?)\n\\end", text, re.DOTALL)
        source = re.sub(r"\\\\\n&\\quad", "", formula).strip()
        source = re.sub(r"\\phi_\{(min|max)\}", r"phi_\1", source)
        source = re.sub(r"b_\{(\d)\}", r"b_\1", source)
        source = re.sub(r"\^\{(\d+)\}", r"**\1", source)
        source = re.sub(r"(?<=[\w)]) (?=[bp(])", "*", source)
        read = sp.sympify(source, locals={str(s): s for s in alpha.free_symbols})
        assert sp.expand(read - alpha) == 0


def test_the_implicit_map_states_flight_walls_and_law():
    text = nsmaps.export(THINGS["VI pair"], "latex")
    for part in (
        r"Z(t; t_j, Z_j, w_j)",
        r"Wall B: $Z = \frac{d}{2}$",
        r"Wall T: $Z = - \frac{d}{2}$",
        r"\rho_{B}(u) = r u$",
        "$P = 2$",
    ):
        assert part in text
    assert "d = 0.35" in text
