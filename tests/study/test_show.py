"""What the terminal says of basins and exponents, and again of a run that is in its folder."""

import re
from math import log
from pathlib import Path

import pytest
from click.testing import Result
from systems import Logistic
from typer.testing import CliRunner

from nsmaps import read_result
from nsmaps.cli.cli import app
from nsmaps.dynamics.lyapunov import lyapunov
from nsmaps.study.sections.parameters.lyapunov import exponent_rows

STUDY = """\
system: vi_pair
parameters: {d: 0.2265, r: 0.25, M: 0.1245, g: 9.8, beta: pi/6, F: 5}
grid: {v: {from: 0.01, to: 1, points: 12}, phi: {from: 0, to: 2*pi*11/12, points: 12}}
lyapunov: {parameter: d, from: 0.22, to: 0.25, points: 3, starts: [{v: 0.68, phi: 0.5}], n_returns: 320, transient: 30}
basins: {max_returns: 300}
"""
STORED = Path(__file__).parents[1] / "data" / "run-format-4"


def program(*arguments: str) -> Result:
    """The command line, its output in a pipe."""
    return CliRunner().invoke(app, arguments)


def rows_of(text: str, title: str) -> list[list[str]]:
    """The cells of the rows of a table below its title."""
    lines = text.split(title)[1].strip().splitlines()
    body = lines[next(k for k, line in enumerate(lines) if line.strip().startswith("─")) + 1 :]
    return [re.split(r"\s{2,}", line.strip()) for line in body[: body.index("")]]


def test_a_run_says_its_basins_and_exponents_and_its_folder_says_them_again() -> None:
    Path("s.yaml").write_text(STUDY)
    done = program("run", "s.yaml", "--out", "out", "--no-figures")
    result = read_result("out")
    again = program("show", "out")
    assert (again.exit_code, again.stderr) == (0, "")
    assert set(done.stdout.splitlines()) - set(again.stdout.splitlines()) == {
        "All tables: nsmaps show out; all verdicts: with --verdicts."
    }
    told = rows_of(again.stdout, "Basins of the exact map, of 144 states of the grid")
    labels = result.basins.label.tolist()
    shares = {attractor.label: labels.count(k) / 144 for k, attractor in enumerate(result.basins.attractors)}
    assert len(shares) > 1
    assert [(row[0], float(row[3].removesuffix(" %"))) for row in told[: len(shares)]] == [
        (name, pytest.approx(100 * share, rel=5e-3)) for name, share in shares.items()
    ]
    latest = max(n for n, label in zip(result.basins.arrival.tolist(), labels, strict=True) if label == 0)
    assert told[0][4] == str(latest)
    exponents = rows_of(again.stdout, "Lyapunov exponents of the exact map")
    assert sum(int(row[-2]) for row in exponents) == 3
    assert (exponents[0][1], exponents[-1][2]) == ("0.22", "0.25")


def test_starts_that_come_to_nothing_have_rows_of_their_own() -> None:
    lines = [line for line in STUDY.splitlines() if not line.startswith("lyapunov")]
    Path("s.yaml").write_text("\n".join(lines).replace("max_returns: 300", "max_returns: 2"))
    done = program("run", "s.yaml", "--out", "out", "--no-figures", "--no-report")
    left = (read_result("out").basins.label == -1).mean()
    assert left > 0
    (row,) = [row for row in rows_of(done.stdout, "Basins of the exact map") if row[0] == "none within 2 returns"]
    assert float(row[1].removesuffix(" %")) == pytest.approx(100 * left, rel=5e-3)


@pytest.mark.parametrize("name", ["run", "partition", "accurate"])
def test_an_old_run_is_shown_with_its_verdicts(name: str) -> None:
    made = program("show", str(STORED / name), "--verdicts")
    assert (made.exit_code, made.stderr) == (0, "")
    for verdict in read_result(STORED / name).verdicts:
        assert verdict.text.partition(": ")[2][:60] in made.stdout


def test_what_is_no_run_is_told() -> None:
    Path("empty").mkdir()
    made = program("show", "empty")
    assert (made.exit_code, made.stdout) == (2, "")
    assert "contains no result.json" in made.stderr


def test_exponents_are_told_by_their_sign_in_intervals() -> None:
    """Of the logistic map: log 2 at r = 4, half the logarithm of |4 + 2 r - r^2| at a cycle of two."""

    def at(a: float) -> Logistic:
        if a > 4:
            raise ValueError("no map beyond 4")
        return Logistic(r=a)

    values = [3.1, 3.2, 3.4, 3.999, 4.0, 4.1]
    rows = exponent_rows(lyapunov(at, "a", values, [0.3], n_returns=2000, transient=300))
    assert [(row["sign"], row["from"], row["to"], row["values"]) for row in rows] == [
        ("below zero", 3.1, 3.4, 3),
        ("above zero", 3.999, 4.0, 2),
        ("none: no map, or the orbit ends", 4.1, 4.1, 1),
    ]
    known = [log(abs(4 + 2 * a - a * a)) / 2 for a in values[:3]]
    low, high = (float(part) for part in rows[0]["exponent"].split(" to "))
    assert (low, high) == (pytest.approx(min(known), rel=1e-2), pytest.approx(max(known), rel=1e-2))
    assert float(rows[1]["exponent"].split(" to ")[1]) == pytest.approx(log(2), rel=1e-2)
    assert rows[2]["exponent"] == ""
