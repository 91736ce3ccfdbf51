"""Every way in which a study can be wrong: one line with file, line, column, what is accepted, and a near match."""

import re
from pathlib import Path

import pytest
from messages import message
from typer.testing import CliRunner

from nsmaps import load_study, run_study
from nsmaps.cli.cli import app
from nsmaps.errors import StudyError
from nsmaps.files.expressions import FUNCTIONS
from nsmaps.study.study import CATALOGUE

SECTIONS = (
    "name, title, system, parameters, grid, families, slices, diagonal, composite, partition, parametric_map, orbits, "
    "bifurcation_diagram, branches, parameter_plane, lyapunov, basins, global_continuation, manifolds, "
    "observe, optimize, estimate, basin_distance, noise, domains, second_iterate, auxiliary_map, morse_sets, exit_times, proof, "
    "horseshoe, figures, require, expected_failures"
)
CONDITION = "the coordinates v, phi; < <= > >= == !=; and, or, not; numbers, pi, e, + - * / **, parentheses, " + ", ".join(
    FUNCTIONS
)

# what the good study says, what the bad one says, where in the latter the error is, and what it says
BAD = {
    "unknown key": (
        "families:",
        "familys:",
        "familys",
        f"unknown key 'familys', did you mean 'families'?; expected: {SECTIONS}",
    ),
    "empty section": (
        "families:",
        "basins:\nfamilies:",
        "basins",
        "'basins' is empty; expected: its keys, as listed by `nsmaps schema`, or {} for the defaults of a section",
    ),
    "tab": (
        "families:",
        "families:\n\t",
        "\t",
        "not readable as YAML: found character '\\t' that cannot start any token; expected: spaces",
    ),
    "unknown key inside": (
        "family: low",
        "famly: low",
        "famly",
        "unknown key 'famly', did you mean 'family'?; expected: name, box, where, region, family, fit, grid, data, reset, "
        "polynomial",
    ),
    "unknown key of an axis": (
        "points: 31",
        "point: 31",
        "point",
        "unknown key 'point', did you mean 'points'?; expected: from, to, points",
    ),
    "misspelt system": (
        "system: ball",
        "system: bal",
        "bal\n",
        "no system 'bal' is installed, did you mean 'ball'?; installed: {systems}; "
        "or a class in a file, as path/to/mine.py:Class",
    ),
    "missing system": (
        "system: ball\n",
        "",
        "# a ball",
        "the key 'system' is missing; expected: "
        "an installed system, or `path/to/mine.py:Class`, a file that is executed, sought beside the study first",
    ),
    "unknown parameter": (
        "{a: 0.2,",
        "{a: 0.2, rr: 1,",
        "rr",
        "unknown parameter 'rr', did you mean 'r'?; expected: a, r, mode",
    ),
    "missing parameter": (
        "a: 0.2, ",
        "",
        "{r: 1/2}",
        "the parameter 'a' is missing; expected: amplitude of the table, in units of gravity",
    ),
    "parameter out of range": ("a: 0.2", "a: -0.2", "-0.2", "a is -0.2; expected: greater than 0"),
    "parameter not finite": ("a: 0.2", "a: .inf", ".inf", "inf is not finite; expected: a finite number, or text as 'pi/3'"),
    "parameter no number": (
        "r: 1/2",
        "r: 1/x",
        "x}",
        "number '1/x', column 3: unknown name 'x'; expected: numbers, pi, e, + - * / **, parentheses, " + ", ".join(FUNCTIONS),
    ),
    "count out of range": ("points: 31", "points: 0", "0}", "points is 0; expected: greater than or equal to 1"),
    "count no number": (
        "n_returns: 5",
        "n_returns: many",
        "many",
        "n_returns is 'many'; expected: an integer",
    ),
    "axis upside down": (
        "from: 0.01",
        "from: 0.9",
        "{from: 0.9",
        "from 0.9 to 0.5 is empty; expected: 'from' below 'to'",
    ),
    "slice of a coordinate too few": (
        "orbits:",
        "slices: [{at: {}, axis: {v: {from: 0, to: 1, points: 9}}}]\norbits:",
        "{}, axis",
        "'v' varies along the slice; expected in 'at': all of phi",
    ),
    "slice along a coordinate that is held": (
        "orbits:",
        "slices: [{at: {v: 1, phi: 0}, axis: {v: {from: 0, to: 1, points: 9}}}]\norbits:",
        "{v: 1, phi: 0}",
        "'v' varies along the slice; expected in 'at': all of phi",
    ),
    "slice upside down": (
        "orbits:",
        "slices: [{at: {phi: 0}, axis: {v: {from: 1, to: 0.5, points: 9}}}]\norbits:",
        "{from: 1",
        "from 1 to 0.5 is empty; expected: 'from' below 'to'",
    ),
    "motion that is not kept": (
        "require: [covered]",
        "require: [covered]\nfigures: [motion]",
        "motion]",
        "the figure 'motion' shows the motion between impacts; expected in the study: 'track' in an entry of 'orbits'",
    ),
    "a sketch that nobody offers": (
        "require: [covered]",
        "require: [covered]\nfigures: [sketch]",
        "sketch]",
        "no package offers a sketch of the system 'ball'; of these there is one: bouncing_ball, impact_oscillator, vi_pair",
    ),
    "coordinate missing": (
        "start: {v: 0.3, phi: 1}",
        "start: {v: 0.3}",
        "{v: 0.3}",
        "the coordinate 'phi' is missing; expected: all of v, phi",
    ),
    "coordinate unknown": (
        "start: {v: 0.3, phi: 1}",
        "start: {v: 0.3, phy: 1}",
        "phy",
        "unknown coordinate 'phy', did you mean 'phi'?; expected: v, phi",
    ),
    "box upside down": (
        "v: [0.1, 0.3]",
        "v: [0.5, 0.3]",
        "{v: [0.5",
        "the box is v from 0.5 to 0.3; expected: finite ends (low, high), low < high, for each of v, phi",
    ),
    "unreadable condition": (
        '"v <= 0.2"',
        '"v <= 0.2 and phy > 1"',
        "phy",
        "condition 'v <= 0.2 and phy > 1', column 14: unknown name 'phy', did you mean 'phi'?; expected: " + CONDITION,
    ),
    "unreadable plain condition": (
        "where: v > 0.2",
        "where: v > 0.2 + w",
        "w, reset",
        "condition 'v > 0.2 + w', column 11: unknown name 'w'; expected: " + CONDITION,
    ),
    "word of no wall": (
        "[BB]",
        "[BB, BTB]",
        "BTB",
        "the word 'BTB' has no letter at 'TB'; expected: the walls B, '~' (chatter) and '_' (rest)",
    ),
    "word of no return": (
        "[BB]",
        "[B]",
        "B]",
        "the word 'B' is not a return; expected: words that begin on the base wall 'B' and end on it or in its release",
    ),
    "pattern that cannot be read": (
        "[BB]",
        "['B(B']",
        "['B(B'",
        "the pattern 'B(B' cannot be read: missing ), unterminated subpattern at position 1",
    ),
    "duplicate key": (
        "title: The ball\n",
        "title: The ball\ntitle: Another\n",
        "title: Another",
        "the key 'title' is given twice; expected: each key once",
    ),
    "duplicate parameter": (
        "{a: 0.2,",
        "{a: 0.2, a: 0.3,",
        "a: 0.3",
        "the key 'a' is given twice; expected: each key once",
    ),
    "not YAML": ("grid:\n", "grid: [\n", None, "not readable as YAML"),
    "two pieces of one name": (
        "{name: fast,",
        "{name: slow,",
        "slow, where",
        "the name 'slow' is given twice; expected: different names",
    ),
    "two regions": (
        "where: v > 0.2,",
        "where: v > 0.2, box: {v: [0, 1], phi: [0, 1]},",
        "{name: fast",
        "the piece 'fast' has 'box' and 'where'; expected: exactly one of 'box' or 'where' or 'region'",
    ),
    "no region": (
        "where: v > 0.2, ",
        "",
        "{name: fast",
        "the piece 'fast' has neither; expected: exactly one of 'box' or 'where' or 'region'",
    ),
    "unknown family": (
        "family: low",
        "family: lwo",
        "lwo",
        "unknown family 'lwo', did you mean 'low'?; expected: low",
    ),
    "unknown map": (
        "map: exact",
        "map: slwo",
        "slwo",
        "unknown map 'slwo', did you mean 'slow'?; expected: exact, composite, slow",
    ),
    "unknown verdict": (
        "[covered]",
        "[covred]",
        "covred",
        "unknown word 'covred', did you mean 'covered'?; expected: covered, tolerance",
    ),
    "unknown figure": (
        "require:",
        "figures: [cobwebs]\nrequire:",
        "cobwebs",
        f"unknown word 'cobwebs', did you mean 'cobweb'?; expected: {', '.join(CATALOGUE)}",
    ),
    "deltas of no orders": (
        "require:",
        "diagonal: {family: low, delta: 1.2, deltas: [1.3]}\nrequire:",
        "{family: low, delta",
        "'deltas' without 'orders' to compare; expected: beside 'orders' only",
    ),
    "a delta of one": (
        "require:",
        "diagonal: {family: low, delta: 1.2, orders: {flat: {full: {v: 1}}}, deltas: [1.3, 0.5]}\nrequire:",
        "0.5]}",
        "1 is 0.5; expected: greater than 1",
    ),
    "figure of orders that are not compared": (
        "require:",
        "diagonal: {family: low, delta: 1.2}\nfigures: [fit_error]\nrequire:",
        "fit_error",
        "the figure 'fit_error' shows fits near the diagonals; expected in the study: 'orders' in 'diagonal'",
    ),
    "figure of separable fits where none is": (
        "require:",
        "figures: [separable]\nrequire:",
        "separable]",
        "the figure 'separable' shows pieces with a separable fit; "
        "expected in the study: a piece of 'composite' with a 'separable' fit",
    ),
    "a window without a coordinate": (
        "require:",
        "morse_sets: {box: {v: [0.13, 1]}}\nrequire:",
        "{v: [0.13",
        "the coordinate 'phi' is missing; expected: all of v, phi",
    ),
    "a window that is empty": (
        "require:",
        "morse_sets: {box: {v: [1, 0.1], phi: [0, 1]}}\nrequire:",
        "{v: [1",
        "the box is v from 1.0 to 0.1; expected: finite ends (low, high), low < high, for each of v, phi",
    ),
    "bifurcation of no parameter": (
        "require:",
        "bifurcation_diagram: {parameter: b, from: 0.2, to: 0.4, points: 3, starts: [{v: 0.3, phi: 1}]}\nrequire:",
        "b, from",
        "unknown parameter 'b'; expected: a, r",
    ),
    "bifurcation backwards": (
        "require:",
        "bifurcation_diagram: {parameter: a, from: 0.4, to: 0.2, points: 3, starts: [{v: 0.3, phi: 1}]}\nrequire:",
        "{parameter",
        "from 0.4 to 0.2 is empty; expected: 'from' below 'to'",
    ),
    "bifurcation of nothing": (
        "require:",
        "bifurcation_diagram: {parameter: a, from: 0.2, to: 0.4, points: 3, starts: [{v: 0.3, phi: 1}], map: []}\nrequire:",
        "{parameter",
        "'map' names no map; expected: 'exact', 'composite', 'parametric' or pieces of the composite map",
    ),
    "bifurcation of a map that is not there": (
        "require:",
        "bifurcation_diagram: {parameter: a, from: 0.2, to: 0.4, points: 3, starts: [{v: 0.3, phi: 1}], "
        "map: [reduced]}\nrequire:",
        "reduced",
        "unknown map 'reduced'; expected: exact, composite, slow",
    ),
    "lyapunov of no parameter": (
        "require:",
        "lyapunov: {parameter: b, from: 0.2, to: 0.4, points: 3, starts: [{v: 0.3, phi: 1}]}\nrequire:",
        "b, from",
        "unknown parameter 'b'; expected: a, r",
    ),
    "bifurcation of values that are none": (
        "require:",
        "bifurcation_diagram: {parameter: a, from: -0.4, to: -0.2, points: 3, starts: [{v: 0.3, phi: 1}]}\nrequire:",
        "-0.4",
        "a is -0.4; expected: greater than 0",
    ),
    "lyapunov of values that are none": (
        "require:",
        "lyapunov: {parameter: a, from: -0.4, to: -0.2, points: 3, starts: [{v: 0.3, phi: 1}]}\nrequire:",
        "-0.4",
        "a is -0.4; expected: greater than 0",
    ),
    "bifurcation at no value": (
        "require:",
        "bifurcation_diagram: {parameter: a, from: 0.2, to: 0.4, points: 0, starts: [{v: 0.3, phi: 1}]}\nrequire:",
        "0, starts",
        "points is 0; expected: greater than or equal to 2",
    ),
    "lyapunov at no value": (
        "require:",
        "lyapunov: {parameter: a, from: 0.2, to: 0.4, points: 0, starts: [{v: 0.3, phi: 1}]}\nrequire:",
        "0, starts",
        "points is 0; expected: greater than or equal to 2",
    ),
    "branch of no parameter": (
        "require:",
        "branches: [{name: one, parameter: b, bounds: [0.2, 0.4], start: {v: 0.3, phi: 1}}]\nrequire:",
        "b, bounds",
        "unknown parameter 'b'; expected: a, r",
    ),
    "branch from beyond its range": (
        "require:",
        "branches: [{name: one, parameter: a, bounds: [0.3, 0.4], start: {v: 0.3, phi: 1}}]\nrequire:",
        "{name: one",
        "a = 0.2 is not from 0.3 to 0.4; expected: 'value' within 'bounds'",
    ),
    "branch at a value beyond its range": (
        "require:",
        "branches: [{name: one, parameter: a, bounds: [0.3, 0.4], value: 0.5, start: {v: 0.3, phi: 1}}]\nrequire:",
        "0.5, start",
        "a = 0.5 is not from 0.3 to 0.4; expected: 'value' within 'bounds'",
    ),
    "branch at a value that the system refuses": (
        "require:",
        "branches: [{name: one, parameter: a, bounds: [-1, 0.4], value: -0.5, start: {v: 0.3, phi: 1}}]\nrequire:",
        "-0.5",
        "a is -0.5; expected: greater than 0",
    ),
    "branch of an empty range": (
        "require:",
        "branches: [{name: one, parameter: a, bounds: [0.4, 0.2], start: {v: 0.3, phi: 1}}]\nrequire:",
        "[0.4, 0.2]",
        "[0.4, 0.2] is empty; expected: the lower end first",
    ),
    "branch of no returns": (
        "require:",
        "branches: [{name: one, parameter: a, bounds: [0.1, 0.4], period: 0, start: {v: 0.3, phi: 1}}]\nrequire:",
        "0, start",
        "period is 0; expected: greater than or equal to 1",
    ),
    "branch with steps of nothing": (
        "require:",
        "branches: [{name: one, parameter: a, bounds: [0.1, 0.4], step: 0, start: {v: 0.3, phi: 1}}]\nrequire:",
        "0, start",
        "step is 0.0; expected: greater than 0.00000001",
    ),
    "branch with events that are none": (
        "require:",
        "branches: [{name: one, parameter: a, bounds: [0.1, 0.4], start: {v: 0.3, phi: 1}, kinds: [folds]}]\nrequire:",
        "folds",
        "unknown word 'folds', did you mean 'fold'?; expected: period doubling, fold, branch point, Neimark-Sacker",
    ),
    "branch with doublings that are not located": (
        "require:",
        "branches: [{name: one, parameter: a, bounds: [0.1, 1], start: {v: 1, phi: 1}, n_doublings: 1, kinds: [fold]}]\nrequire:",
        "{name: one",
        "'n_doublings' requires the event 'period doubling'; expected: 'period doubling' among 'kinds'",
    ),
    "branches of one name": (
        "require:",
        "branches: [{name: one, parameter: a, bounds: [0.1, 0.4], start: {v: 1, phi: 1}}, "
        "{name: one, parameter: a, bounds: [0.1, 0.4], start: {v: 1, phi: 1}}]\nrequire:",
        None,
        "the name 'one' is given twice; expected: different names",
    ),
    "plane at no value": (
        "require:",
        "parameter_plane: {axes: {a: {from: 0.1, to: 1, points: 0}, r: {from: 0.1, to: 0.9, points: 2}}, "
        "starts: [{v: 1, phi: 1}]}\nrequire:",
        "0}, r",
        "points is 0; expected: greater than or equal to 2",
    ),
    "plane of values that are none": (
        "require:",
        "parameter_plane: {axes: {a: {from: 0.1, to: 1, points: 2}, r: {from: 1.1, to: 1.9, points: 2}}, "
        "starts: [{v: 1, phi: 1}]}\nrequire:",
        "1.1",
        "r is 1.1; expected: less than or equal to 1",
    ),
    "plane of one parameter": (
        "require:",
        "parameter_plane: {axes: {a: {from: 0.1, to: 1, points: 2}}, starts: [{v: 1, phi: 1}]}\nrequire:",
        "{a: {from",
        "axes is {'a': {'from': 0.1, 'to': 1, 'points': 2}}; expected: 2 entries or more",
    ),
    "plane of an unknown parameter": (
        "require:",
        "parameter_plane: {axes: {a: {from: 0.1, to: 1, points: 2}, q: {from: 0.1, to: 0.9, points: 2}}, "
        "starts: [{v: 1, phi: 1}]}\nrequire:",
        "q: {from",
        "unknown parameter 'q'; expected: a, r",
    ),
    "plane with a range that is not finite": (
        "require:",
        "parameter_plane: {axes: {a: {from: 0.1, to: .inf, points: 2}, r: {from: 0.1, to: 0.9, points: 2}}, "
        "starts: [{v: 1, phi: 1}]}\nrequire:",
        ".inf",
        "inf is not finite; expected: a finite number, or text as 'pi/3'",
    ),
    "plane of no starts": (
        "require:",
        "parameter_plane: {axes: {a: {from: 0.1, to: 1, points: 2}, r: {from: 0.1, to: 0.9, points: 2}}, starts: []}\nrequire:",
        "[]}",
        "starts is []; expected: 1 entry or more",
    ),
    "plane of a start without a coordinate": (
        "require:",
        "parameter_plane: {axes: {a: {from: 0.1, to: 1, points: 2}, r: {from: 0.1, to: 0.9, points: 2}}, "
        "starts: [{v: 1, phi: 1}, {v: 2}]}\nrequire:",
        "{v: 2}",
        "the coordinate 'phi' is missing; expected: all of v, phi",
    ),
    "plane of few returns": (
        "require:",
        "parameter_plane: {axes: {a: {from: 0.1, to: 1, points: 2}, r: {from: 0.1, to: 0.9, points: 2}}, "
        "starts: [{v: 1, phi: 1}], n_returns: 63}\nrequire:",
        "{axes",
        "63 'n_returns' hold no period up to 32 twice; expected: 2 'max_period'",
    ),
    "plane that is followed and refined": (
        "require:",
        "parameter_plane: {axes: {a: {from: 0.1, to: 1, points: 2}, r: {from: 0.1, to: 0.9, points: 2}}, "
        "starts: [{v: 1, phi: 1}], direction: up, refine: 4}\nrequire:",
        "{axes",
        "orbits that are followed need every pixel; expected: no 'direction', or no 'refine'",
    ),
    "plane of an unknown observable": (
        "require:",
        "parameter_plane: {axes: {a: {from: 0.1, to: 1, points: 2}, r: {from: 0.1, to: 0.9, points: 2}}, "
        "starts: [{v: 1, phi: 1}], observables: [los]}\nrequire:",
        "[los]",
        "'los' is not an observable of Ball, did you mean 'loss'?; expected: impacts, speed, loss, momentum, displacement, work, "
        "damping, or a `name` with a `formula`",
    ),
    "curve of no branch": (
        "require:",
        "parameter_plane: {axes: {a: {from: 0.1, to: 1, points: 2}, r: {from: 0.1, to: 0.9, points: 2}}, "
        "starts: [{v: 1, phi: 1}], bifurcation_curves: [{branch: one, event: fold}]}\nrequire:",
        "one, event",
        "unknown branch in 'a' 'one'; expected: none",
    ),
    "curve of a branch in another parameter": (
        "require:",
        "branches: [{name: one, parameter: r, bounds: [0.1, 0.9], start: {v: 1, phi: 1}}]\n"
        "parameter_plane: {axes: {a: {from: 0.1, to: 1, points: 2}, r: {from: 0.1, to: 0.9, points: 2}}, "
        "starts: [{v: 1, phi: 1}], bifurcation_curves: [{branch: one, event: fold}]}\nrequire:",
        "one, event",
        "unknown branch in 'a' 'one'; expected: none",
    ),
    "curve of an event that the branch does not locate": (
        "require:",
        "branches: [{name: one, parameter: a, bounds: [0.1, 0.9], start: {v: 1, phi: 1}, kinds: [period doubling]}]\n"
        "parameter_plane: {axes: {a: {from: 0.1, to: 1, points: 2}, r: {from: 0.1, to: 0.9, points: 2}}, "
        "starts: [{v: 1, phi: 1}], bifurcation_curves: [{branch: one, event: fold}]}\nrequire:",
        "fold}",
        "the branch 'one' locates no fold; expected: one of its 'kinds', period doubling, grazing, border collision, detachment",
    ),
    "figure of branches that are not there": (
        "require:",
        "figures: [branches]\nrequire:",
        "branches]",
        "the figure 'branches' needs the section 'branches', which is missing",
    ),
    "noise of words that are none": (
        "require:",
        "noise: {sigma: [0.1], tau: 1, start: {v: 0.3, phi: 1}, modes: {odd: [BXB]}}\nrequire:",
        "[BXB]",
        "the word 'BXB' has no letter at 'XB'; expected: the walls B, '~' (chatter) and '_' (rest)",
    ),
    "noise with steps that are too long": (
        "require:",
        "noise: {sigma: [0.1], tau: 1, step: 2, start: {v: 0.3, phi: 1}, modes: {one: [BB]}}\nrequire:",
        "{sigma",
        "step is 2; expected: at most tau = 1",
    ),
    "noise held for too short": (
        "require:",
        "noise: {sigma: [0.1], tau: 1, min_returns: 1, start: {v: 0.3, phi: 1}, modes: {two: [BB, BB]}}\nrequire:",
        "{sigma",
        "min_returns is 1; expected: motions of one or more words, and min_returns of at least their number, 2",
    ),
    "grid of basins": (
        "require:",
        "basins: {starts: {v: {from: 0, to: 1, points: 3}}}\nrequire:",
        "{v: {from: 0, to: 1, points: 3}}",
        "the coordinate 'phi' is missing; expected: all of v, phi",
    ),
    "basins of the composite map alone": (
        "require:",
        "basins: {map: [composite]}\nrequire:",
        "[composite]",
        "[composite] lacks the exact map; expected: [exact] or [exact, composite], as the latter is compared with it",
    ),
    "family without grid": (
        "grid:\n  v: {from: 0.01, to: 0.5, points: 31}\n  phi: {from: 0, to: 2*pi, points: 41}\n",
        "",
        "low: [BB]",
        "'families' needs the section 'grid', which is missing",
    ),
    "data without its section": (
        "family: low\n",
        "family: low\n    data: diagonal\n",
        "diagonal",
        "the data of the piece 'slow' needs the section 'diagonal', which is missing",
    ),
    "second iterate without its domain": (
        "require:",
        "second_iterate: {domain: exact}\nrequire:",
        "exact}",
        "unknown domain of a fitted piece 'exact'; expected: none",
    ),
    "figure without its section": (
        "orbits:\n  - start: {v: 0.3, phi: 1}\n    n_returns: 5\n",
        "figures: [orbits]\n",
        "orbits]",
        "the figure 'orbits' needs the section 'orbits', which is missing",
    ),
    "degree out of range": (
        "v: 2, phi: 3}",
        "v: -2, phi: 3}",
        "-2",
        "v is -2; expected: greater than or equal to 0",
    ),
    "degree of one output out of range": (
        "{v: 2, phi: 3}",
        "{v: {v: 99, phi: 1}, phi: {phi: 1}}",
        "99",
        "v is 99; expected: less than or equal to 40",
    ),
    "degrees of one output missing": (
        "{v: 2, phi: 3}",
        "{v: {v: 2, phi: 1}}",
        "{v: {v: 2",
        "the coordinate 'phi' is missing; expected: all of v, phi",
    ),
    "file of a polynomial that is not there": (
        "reset: {phi: pi/2}",
        "polynomial: maps.json#R1",
        "maps.json",
        "no file 'maps.json#R1' beside the study; expected: a mapping, or file#key, in YAML or JSON",
    ),
    "monomial that is none": (
        "reset: {phi: pi/2}",
        "polynomial: {images: {v: {v: 1}, phi: {phi^2: 1}}, over: {v: [0, 1], phi: [0, 1]}}",
        "1}}, over",
        "the monomial 'phi^2' cannot be read; expected: '1', 'v', 'phi**2*v' and the like, each name once",
    ),
    "coefficient that is no number": (
        "reset: {phi: pi/2}",
        "polynomial: {images: {v: {v: one}, phi: {phi: 1}}, over: {v: [0, 1], phi: [0, 1]}}",
        "one}",
        "v is 'one'; expected: a number",
    ),
    "image that is missing": (
        "reset: {phi: pi/2}",
        "polynomial: {images: {v: {v: 1}}, over: {v: [0, 1], phi: [0, 1]}}",
        "{images",
        "the image of 'phi' is missing; expected: those of all of v, phi",
    ),
    "parameter of a polynomial": (
        "reset: {phi: pi/2}",
        "polynomial: {parameter: d, images: {v: {v: 1}, phi: {phi: 1}}, over: {v: [0, 1], phi: [0, 1]}}",
        "{parameter",
        "parameter: no parameter 'd' of the system; expected: a, r",
    ),
    "box of a polynomial": (
        "reset: {phi: pi/2}",
        "polynomial: {images: {v: {v: 1}, phi: {phi: 1}}, over: {v: [1, 0], phi: [0, 1]}}",
        "{v: [1, 0]",
        "the box is v from 1.0 to 0.0; expected: finite ends (low, high), low < high, for each of v, phi",
    ),
    "parametric parameter": (
        "orbits:\n",
        "parametric_map: {parameter: b, bounds: [0.2, 0.4]}\norbits:\n",
        "b, bounds",
        "unknown parameter 'b'; expected: a, r",
    ),
    "parametric value that the system refuses": (
        "orbits:\n",
        "parametric_map: {parameter: r, bounds: [0.5, 1.5]}\norbits:\n",
        "1.5",
        "r is 1.5; expected: less than or equal to 1",
    ),
    "parametric with too few nodes": (
        "orbits:\n",
        "parametric_map: {parameter: a, bounds: [0.2, 0.4], degree: 3, n_nodes: 3}\norbits:\n",
        "{parameter: a",
        "3 nodes for degree 3; expected: more nodes than the degree",
    ),
    "empty region": ('"v <= 0.2"', '"v <= 0.001"', None, "slow"),
}


def place(text: str, needle: str) -> str:
    """Line and column, from one, of where a text has the needle."""
    before = text[: text.index(needle)]
    return f"{before.count(chr(10)) + 1}:{len(before) - before.rfind(chr(10))}"


@pytest.mark.parametrize("kind", BAD)
def test_a_bad_study_is_told_in_one_line_and_nothing_is_written(kind: str, good: str, installed: Path) -> None:
    from nsmaps.plugins import system_names

    said, says, needle, told = BAD[kind]
    assert good.count(said) == 1
    text = good.replace(said, says)
    Path("bad.yaml").write_text(text)
    answer = CliRunner().invoke(app, ["run", "bad.yaml", "--out", "out"])
    assert (answer.exit_code, answer.stdout) == (2, "")
    lines = answer.stderr.splitlines()
    assert len(lines) == 1, lines
    if needle is None:
        assert lines[0].startswith("bad.yaml:")
        assert told in lines[0]
    else:
        assert lines[0] == f"bad.yaml:{place(text, needle)}: {told.replace('{systems}', ', '.join(system_names()))}"
    assert [path.name for path in installed.iterdir()] == ["bad.yaml"]


def test_the_good_study_is_good(good: str) -> None:
    Path("good.yaml").write_text(good)
    assert load_study("good.yaml").title == "The ball"


def test_every_complaint_has_its_line(good: str) -> None:
    text = good.replace("points: 31", "points: 0").replace("n_returns: 5", "n_returns: 0")
    Path("bad.yaml").write_text(text)
    with pytest.raises(StudyError) as error:
        load_study("bad.yaml")
    assert str(error.value).splitlines() == [
        f"bad.yaml:{place(text, '0}')}: points is 0; expected: greater than or equal to 1",
        f"bad.yaml:{place(text, '0' + chr(10) + 'domains')}: n_returns is 0; expected: greater than or equal to 1",
    ]


def test_an_empty_region_names_the_line_of_its_piece(good: str) -> None:
    text = good.replace('"v <= 0.2"', '"v <= 0.001"')
    Path("bad.yaml").write_text(text)
    said = message("study.no-data-of-family", name="slow", at=re.compile(f"^bad.yaml:{place(text, 'name: slow')}"))
    with pytest.raises(StudyError, match=said):
        run_study("bad.yaml")


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("ball/dorp", "no study 'ball/dorp', did you mean 'ball/drop'?; expected: the path of a YAML file, or one of {studies}"),
        ("ball", "no study 'ball', did you mean 'ball/drop'?; expected: the path of a YAML file, or one of {studies}"),
        ("nowhere.yaml", "no study 'nowhere.yaml'; expected: the path of a YAML file, or {listed}"),
        ("here", "here is a folder; expected: the path of a YAML file, or {listed}"),
        ("here/", "here/ is a folder; expected: the path of a YAML file, or {listed}"),
    ],
)
def test_a_study_that_is_not_there(name: str, said: str) -> None:
    from nsmaps.plugins import study_names

    Path("here").mkdir()
    answer = CliRunner().invoke(app, ["check", name])
    assert answer.exit_code == 2
    beside = ", ".join(each for each in study_names() if each.startswith("ball/"))
    listed = "an installed study, which `nsmaps systems` lists"
    assert answer.stderr.strip() == said.format(studies=beside, listed=listed)


def test_a_live_page_may_be_of_a_system() -> None:
    answer = CliRunner().invoke(app, ["explore", "bal", "--live"])
    assert answer.exit_code == 2
    assert answer.stderr.startswith("no study or system 'bal', did you mean 'ball'?; expected: ")


def test_a_list_without_brackets(good: str) -> None:
    Path("one.yaml").write_text(good + "\nfigures: cobweb\n" if "figures:" not in good else good)
    with pytest.raises(
        StudyError, match=message("errors.value", name="figures", value="'cobweb'", at=re.compile(r"one.yaml:\d+:\d+"))
    ):
        load_study("one.yaml")


def test_a_study_of_no_system() -> None:
    with pytest.raises(StudyError, match=message("study.no-study", study="bal/drop", system="bal", near="ball")):
        load_study("bal/drop")


@pytest.mark.parametrize("text", ["", "- a\n- b\n", "just words\n"])
def test_a_file_that_is_no_mapping(text: str) -> None:
    Path("bad.yaml").write_text(text)
    with pytest.raises(StudyError, match=message("study.not-a-mapping", at=re.compile(r"^bad.yaml:1:1"))):
        load_study("bad.yaml")


def test_a_study_made_in_python_names_the_section() -> None:
    from nsmaps import Study

    with pytest.raises(
        StudyError, match=message("study.coordinate-missing", name="phi", at=re.compile(r"^mine: orbits\.0\.start"))
    ):
        run_study(Study(name="mine", system="ball", parameters={"a": 1}, orbits=({"start": {"v": 1}, "n_returns": 2},)))
