"""The catalogue of figures, a row a figure; importing it loads no matplotlib, drawing a figure does."""

from collections.abc import Collection, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

from nsmaps.figures import data
from nsmaps.figures.row import Need, Row

if TYPE_CHECKING:
    from nsmaps.study.reading.head import Head as Study
    from nsmaps.study.result import StudyResult


_ROWS = (
    Row(
        "system.sketch",
        "A drawing of the system with the names of its parts.",
        "The system: its parts, the forcing, and the walls whose impacts are counted.",
        (data.SKETCH,),
    ),
    Row(
        "system.algorithm",
        "A flow chart of the general algorithm, from top to bottom: initialize, iterate, finalize.",
        "The general algorithm, steps 0 to vii. Each box names what is done, the section of a study, and the function.",
        (data.MADE,),
    ),
    Row(
        "system.motion",
        "The displacements of ball and walls over time, beside the phase plane of relative displacement and velocity.",
        "The exact motion at and between impacts, over time and in the phase plane. Stars are impacts on the base wall. With "
        "modes it is that of all states, coloured by mode, with the events.",
        (data.TRACKS,),
    ),
    Row(
        "system.impacts",
        "The phase against the relative velocity at every impact, joined in order by dotted lines.",
        "All impacts of the orbit by phase and by velocity just before the impact, whose sign distinguishes the walls, or all "
        "events of a system with modes. Dotted lines give their order.",
        (data.TRACKS,),
    ),
    Row(
        "returns.slices",
        "Images against one coordinate of the initial state while the other is held, coloured by word.",
        "First returns along one coordinate by word; the other coordinate is held at the value above. In its phase plane "
        "all stand over one value. Gaps are jumps of the map.",
        (data.SLICES,),
    ),
    Row(
        "returns.words",
        "The plane of states coloured by word.",
        "The word or family of the first return from every state of the grid, and the pieces of any composite map."
        " The blue frame, if any, bounds the states near the diagonals of all coordinates, over all values of a swept parameter.",
        (data.PLANES, data.MESH, data.NEAR_DIAGONALS, data.REDUCED, data.PAIRS),
    ),
    Row(
        "composite.regions",
        "The plane of states divided into the named pieces of the composite map.",
        "The pieces of the composite map with their names, words and shares of the grid.",
        (data.COMPOSITE, data.GRID, data.PAIRS),
    ),
    Row(
        "returns.surfaces",
        "Surfaces of the images over the plane of states, seen in perspective.",
        "The return surfaces: each coordinate of the image over the initial states, coloured by family. They end "
        "where the map jumps or an angle is wrapped.",
        (data.PLANES, data.MESH),
        animated=True,
    ),
    Row(
        "returns.projections",
        "Images against initial states with the diagonals, one coordinate a panel.",
        "The return surfaces projected along one coordinate, which each line holds fixed; its colour "
        "is the value held. On the dashed diagonal a coordinate is mapped to itself. Stars, if any, are states near the diagonals"
        " of all coordinates, filled where no slope exceeds the bound of the study (1 unless it sets one), else hollow.",
        (data.SURFACES, data.MESH, data.NEAR_DIAGONALS),
    ),
    Row(
        "fits.diagonal",
        "States near the diagonals in the phase planes, for some values of a parameter and for all of them.",
        "States near both diagonals (eq. r1uniond): green for one value of the parameter, blue for all values of the sweep. "
        "Dotted lines are the ratios delta and 1/delta.",
        (data.DIAGONAL, data.SWEPT, data.SHOWN),
    ),
    Row(
        "returns.diagonal_surface",
        "Surfaces of the images over the plane of states; the part near both diagonals is blue.",
        "The return surfaces of one family, blue where a state is near the diagonals of all coordinates (eq. r1uniond).",
        (data.NEAR, data.SURFACES, data.NEAR_MESH),
    ),
    Row(
        "fits.orders",
        "Logarithmic plots of 1 - R2 and of the sum of squared errors against the order of the polynomial.",
        "Polynomials of several orders fitted near the diagonals (table TableDeltaErr): 1 - R2 and the sum of squared errors "
        "(SSE), a line for each delta.",
        (data.ORDERS,),
    ),
    Row(
        "fits.fit_error",
        "The states near the diagonals coloured by the error of the fitted polynomials.",
        "The error of the polynomials fitted near the diagonals at each state of the grid, a row for each delta (fig. "
        "comparert).",
        (data.ORDERS,),
    ),
    Row(
        "fits.separable",
        "A separable map and the exact map in the phase planes, and both as curves on the surfaces.",
        "A separable approximation. The exact map along one line of the grid is green, the separable map orange, and all other "
        "states of the region are grey. Below, both are curves on the return surface.",
        (data.SEPARABLE, data.COMPOSITE, data.SURFACES, data.MESH, data.TITLE),
    ),
    Row(
        "composite.partition",
        "The plane of states divided into attracting and transient regions.",
        "The regions found by the general algorithm, with the names and colours of the pieces of the composite map. Attracting "
        "regions have a thick frame.",
        (data.PARTITION, data.GRID, data.PAIRS),
    ),
    Row(
        "composite.strips",
        "Strips of the plane of states between grazing curves.",
        "The cells of the accurate map by the total degree of their polynomials, separated by white lines. Black curves are the "
        "edges of the exact map.",
        (data.ACCURATE, data.NAMES),
    ),
    Row(
        "composite.speed_error",
        "The error of the reduced map against its processor time per state, beside the time of the exact map.",
        "Error against speed: the processor time for the return of one state, and the largest error at held-out states. A map to"
        " the right of the line is slower than the exact map.",
        (data.SPEED, data.ERRORS, data.TOLERANCE, data.TITLE),
    ),
    Row(
        "composite.orbits",
        "Orbits of the exact map and of the composite map in the plane of states.",
        "Orbits from the initial states of the study with their last tenth marked: of the exact map, and of the composite map if "
        "there is one. Lines join a state to its image. A cross, if any, is the last state of an orbit that ends, or its last "
        "state within the picture. No piece holds the hatched states.",
        (data.ORBITS, data.PLANE, data.OVER),
    ),
    Row(
        "composite.cobweb",
        "Cobweb diagrams of the orbits over the projected surfaces.",
        "A cobweb of the composite map in the phase planes, with its last tenth marked, over the pieces: a line where the image "
        "depends on one coordinate alone, else the range of its values over the other, pale where the orbit does not come. A "
        "cross, if any, is the end of an orbit that leaves the domain of the map.",
        (data.COMPOSITE, data.GRID, data.ORBITS),
        animated=True,
    ),
    Row(
        "parameters.bifurcation",
        "The states of the attractors against the parameter, coloured by word.",
        "The attractors over the parameter by word; the darker a place, the more states lie there. Lines are "
        "the computed borders of the widest windows of the first orbit (of two, of the one followed through growing "
        "values), where they are known to the distance of neighbouring values, and motions are named above where there is "
        "room; C is chaos, between windows at most of the values. A motion of the "
        "composite map has the name of the exact one with the same words and period in returns. Grey: no attractor.",
        (data.BIFURCATION,),
    ),
    Row(
        "parameters.branches",
        "The states of periodic orbits against the parameter, solid where stable and dashed where unstable, with events.",
        "Branches of periodic orbits, coloured by motion. Solid lines are stable, dashed lines unstable and dotted lines of "
        "unknown stability; marks are events.",
        (data.BRANCHES,),
    ),
    Row(
        "parameters.stability",
        "The plane of two parameters coloured by the motion that attracts, with bifurcation curves.",
        "The motion to which one orbit converges at each point of two parameters, and bifurcation curves of branches. "
        "Another initial state may converge to another motion.",
        (data.STABILITY, data.CURVES),
    ),
    Row(
        "parameters.chart",
        "The plane of two parameters coloured by the period of the attractor and by its largest Lyapunov exponent.",
        "The attractor of the first start at each pixel of two parameters: its period in returns, black where none was found, "
        "and its largest Lyapunov exponent per return. Hatched are pixels with several attractors, and crossed those whose "
        "parameters the system refuses.",
        (data.CHART, data.CHART_CURVES, data.OPTIMUM),
    ),
    Row(
        "parameters.lyapunov",
        "The Lyapunov exponents against the parameter with bands of two standard errors.",
        "The Lyapunov exponents over the parameter, per return and per unit of time, with bands of two standard errors. "
        "Neighbouring orbits diverge where an exponent is positive.",
        (data.LYAPUNOV,),
    ),
    Row(
        "longrun.basins",
        "The plane of states coloured by the attractor reached, beside the number of returns taken.",
        "Basins of attraction over the grid: the attractor that each state reaches, with the share of its basin, and the number "
        "of returns taken. Marks are states of the attractors.",
        (data.BASINS, data.SAME_ATTRACTOR),
    ),
    Row(
        "longrun.global_continuation",
        "Shares of basins as stacked bands over a parameter, above distances to the boundary and return times of the attractors.",
        "Attractors along the parameter, matched from value to value: the share of the random starts that each reaches; the "
        "smallest kick found that leads elsewhere, an upper estimate of the distance to the boundary (an arrow: none up to one); "
        "the mean return time after a kick, with two standard errors. Kicks are in shares of the region's sides.",
        (data.GLOBAL_CONTINUATION,),
    ),
    Row(
        "longrun.manifolds",
        "The stable and unstable manifolds of saddles as lines in the plane of states.",
        "The stable (blue) and unstable (orange) manifolds of the saddles (crosses), grown to the lengths of the study and "
        "interrupted where the map jumps, over the basins or the words where the study has them.",
        (data.MANIFOLDS, data.BELOW),
    ),
    Row(
        "longrun.observables",
        "Means of quantities such as the energy lost at impacts, over a parameter.",
        "Means of the study's observables per period of the forcing, or per return without forcing: on the attractors of the "
        "bifurcation diagram, with two standard errors, and along branches of periodic orbits, dashed where they are "
        "not stable.",
        (data.OBSERVABLES,),
    ),
    Row(
        "longrun.noise",
        "Impacts under noise against the parameter, and shares and rates of the motions against the size of the noise.",
        "Noise: impacts over the parameter, if it is swept (fig. comp_stoch), and, for the parameters of the study, the shares "
        "of motions and the rates of transitions between them, with standard errors, over the size of the noise.",
        (data.NOISE,),
    ),
    Row(
        "domains.auxiliary",
        "Families of curves of the map between their upper and lower envelopes, above the first steps between these.",
        "The image of each coordinate for values of the other (grey), between the lower and the upper auxiliary map; below, the "
        "worst-case steps from the box (dotted), with the points at which the upper map is largest and the lower one least. If "
        "the box is forward invariant, the interval of the first step is green. The title has the width of the box to which the "
        "update leads.",
        (data.ENVELOPED,),
        by_domain=True,
    ),
    Row(
        "domains.envelopes",
        "The upper and lower auxiliary maps with the cobwebs between them.",
        "The lower and upper auxiliary map of each coordinate at the first, the second and the last update, with the worst-case "
        "steps from the box (dotted). If the box is forward invariant, they converge to the yellow interval from p to q, the "
        "next box. The thin line is a generic cobweb, which is omitted if it converges to no cycle.",
        (data.ENVELOPED,),
        by_domain=True,
    ),
    Row(
        "domains.domain_size",
        "The width of the attracting domain after each update, one coordinate a panel.",
        "The width of the box after each update of the auxiliary maps, for each domain that is forward invariant; the title "
        "names those that are not.",
        (data.DOMAINS,),
    ),
    Row(
        "domains.second_iterate",
        "The second iterates of the auxiliary maps with their fixed points.",
        "Second iterates of the auxiliary maps at some updates N: the lower map of the upper map (thick), which has p, and the "
        "upper map of the lower map (thin), which has q, or the worst case of both. If the box is forward invariant, p and q "
        "bound the coordinate.",
        (data.SECOND_ITERATE, data.BOUNDED),
    ),
    Row(
        "domains.auxiliary_map",
        "Upper and lower auxiliary maps in two regions, the curves of the other pieces, and a cobweb through them.",
        "The full auxiliary map: in A_1 and over the regions of the pieces that the study names, every coordinate is led on by "
        "its upper and lower auxiliary map alternately, elsewhere by the composite map. Pieces are lines where the image depends "
        "on one coordinate alone, else the range of its values over the other.",
        (data.AUXILIARY_MAP, data.COMPOSITE, data.GRID, data.PAIRS),
    ),
    Row(
        "cells.morse",
        "The cells of the window coloured by recurrent component, with states of orbits.",
        "Cells that contain every orbit which stays in the window, by recurrent component (Morse set), and states of orbits. "
        "From a minimal component no other component can be reached.",
        (data.MORSE, data.EXACT_ORBITS),
    ),
    Row(
        "cells.exit_times",
        "The cells of the regions coloured by the number of returns after which they have been left.",
        "The number of returns after which all states of a cell have left its region, by enclosure, with the cells for which "
        "this is not shown and the periodic points found there.",
        (data.EXIT_TIMES,),
    ),
)
CATALOGUE: Mapping[str, Row] = {row.name: row for row in _ROWS}


def rows_of(study: "Study") -> Mapping[str, Row]:
    """The catalogue with a figure for each analysis of another package or file of a study, under the key of its section."""
    rows = dict(CATALOGUE)
    for key, kind in study.others().items():
        text = " ".join((kind.__doc__ or f"The analysis {key}.").split("\n\n")[0].split())
        need: Need[Any] = Need(f"the result of {key!r}", (key,), partial(part_named, key))
        rows[key] = Row(key, text, text, (need,), of_other=True)
    return rows


def part_named(key: str, result: "StudyResult") -> Any:
    """The part of a result of this name, None if it was not computed."""
    return result.parts.get(key)


def named_by(result: "StudyResult") -> list[str]:
    """The figures that the study names, and that of speed and error wherever both were measured."""
    return [*result.study.figures, *(["speed_error"] if result.speed else [])]


def drawable(result: "StudyResult", without: Collection[str] = ()) -> list[str]:
    """The figures that a result has the data for, apart from some."""
    return [name for name, row in rows_of(result.study).items() if name not in without and row.has_data(result)]


if TYPE_CHECKING:
    FigureName = str
else:
    FigureName = Literal[tuple(CATALOGUE)]
