"""What each figure shows, in words: for a reader, and for one who cannot see it."""

CAPTIONS: dict[str, tuple[str, str]] = {
    "sketch": (
        "The system drawn, with the names of its parts",
        "The system: its parts, the forcing, and the walls whose impacts are counted.",
    ),
    "algorithm": (
        "Flow chart of the general algorithm in three rows: initialize, iterate, finalize",
        "The general algorithm, steps 0 to vii: what is done, and which section of a study and which function does it.",
    ),
    "motion": (
        "Displacement of ball and walls over time, and the phase plane of relative displacement and velocity",
        "The exact motion at and between impacts, over time and in the phase plane; stars are impacts on the base wall.",
    ),
    "impacts": (
        "Phase against relative velocity at every impact, joined in order by dotted lines",
        "All impacts of the orbit: phase and velocity just before, whose sign tells the wall; dotted lines give their order.",
    ),
    "slices": (
        "Images against one coordinate of the start while the other is held, coloured by word",
        "First returns along one coordinate, the other held at the value above, by impact word; gaps are jumps of the map.",
    ),
    "words": (
        "The plane of states coloured by impact word",
        "The impact word of the first return from every state of the grid, and the pieces of the composite map if there is one."
        " The blue frame, if any, holds the states near the diagonals of all coordinates, at all values of a swept parameter.",
    ),
    "regions": (
        "The plane of states divided into named pieces",
        "The pieces of the composite map by name, with their words and their shares of the grid.",
    ),
    "surfaces": (
        "Surfaces of the images over the plane of states",
        "The return surfaces: each coordinate of the image over the starts, by family of words. Teeth along a steep edge are "
        "the grid's.",
    ),
    "projections": (
        "Images against starts, one coordinate a panel, with the diagonals",
        "The return surfaces seen along one coordinate: each line holds the other one, its colour is the phase of the start. On"
        " the dashed diagonal a coordinate comes back to itself. Stars, if any: states near the diagonals of all coordinates, "
        "filled where no slope exceeds the bound of the study (1 without one), else hollow.",
    ),
    "diagonal": (
        "States near the diagonals at some values of the parameter, inside those at all values, in the phase planes",
        "States near both diagonals (eq. r1uniond): green at one value of the parameter, blue at all values of the sweep; "
        "dotted lines are the ratios delta and 1/delta.",
    ),
    "diagonal_surface": (
        "Surfaces of the images with the part near both diagonals in blue",
        "The return surfaces of one family, blue where a state is near the diagonals of all coordinates (eq. r1uniond).",
    ),
    "orders": (
        "1 - R2 and sums of squared errors of polynomials near the diagonals, by order",
        "Polynomials of several orders near the diagonals (table TableDeltaErr): 1 - R2 and SSE, logarithmic, a line a delta.",
    ),
    "fit_error": (
        "The plane of states near the diagonals coloured by the error of the fitted polynomials",
        "Error of the polynomials fitted near the diagonals, a row a delta, at each state of the grid (fig. comparert).",
    ),
    "separable": (
        "A separable map beside the exact one in the phase planes, and both as curves on the surfaces",
        "A separable approximation: the exact map along one line of the grid green, the separable map orange, all other states "
        "of the region grey; below, both curves on the surface.",
    ),
    "partition": (
        "The plane of states divided into the pieces of the composite map",
        "The regions that the algorithm found, R_n.m for region n as iteration m left it: attracting ones blue, transient ones "
        "in the colour of their word.",
    ),
    "strips": (
        "Strips of the plane of states between grazing curves",
        "The leaves of the accurate map by total degree, with white lines between them; black: the edges of the exact map.",
    ),
    "speed_error": (
        "Error of the reduced map against its time per state, beside the time of the exact map",
        "Error against speed: processor time for the return of one state, and largest error at held-out states. A map right of "
        "the line is slower than the exact one.",
    ),
    "orbits": (
        "Orbits of the exact and of the composite map in the plane of states",
        "Orbits from the starts of the study, their last tenth marked: of the exact map, and of the composite map where there "
        "is one. Lines join a state to its return. A cross, if any: the last state of an orbit that ends, or the last one in "
        "the picture. Hatched: states in no piece.",
    ),
    "cobweb": (
        "Cobweb diagrams of the orbits over the projected surfaces",
        "Cobwebs: the orbits of the composite map in the phase planes, their last tenth marked, over its pieces: a line where "
        "the image depends on one coordinate alone, else the band of its values for all of the other. A cross, if any: the end "
        "of an orbit that goes astray.",
    ),
    "bifurcation": (
        "States of the attractors against the parameter, coloured by word",
        "The attractors over the parameter, by impact word. Above, the motion of the first orbit (of two, of that through "
        "growing values) where there is room: n:m/pT has n impacts on the base wall and m on others in p periods of the "
        "forcing, C no period found. Grey: no attractor.",
    ),
    "branches": (
        "States of periodic orbits against the parameter, solid where stable and dashed where unstable, with their events",
        "Branches of periodic orbits by motion: solid lines attract, dashed ones do not, with the events on them.",
    ),
    "stability": (
        "The plane of two parameters coloured by the motion that attracts, with curves of events",
        "The motion on which one orbit ends at each point of two parameters, and the curves on which a branch has an event; "
        "another start may end elsewhere.",
    ),
    "lyapunov": (
        "Lyapunov exponents against the parameter with bands of two standard errors",
        "The Lyapunov exponents over the parameter, per return and per unit of time, with bands of two standard errors. Above "
        "the line at zero neighbouring orbits part.",
    ),
    "basins": (
        "The plane of states coloured by the attractor reached, and by the number of returns to it",
        "Basins of attraction over the grid: where each state ends up, with its share of the grid, and after how many returns. "
        "Marks are states of the attractors.",
    ),
    "noise": (
        "Impacts under noise against the parameter, and shares and rates of the motions against the size of the noise",
        "Under noise: impacts over the parameter, if it is swept (fig. comp_stoch), and at the study's own parameters the "
        "shares of motions and the rates of changes between them, with standard errors, over the size of the noise.",
    ),
    "auxiliary": (
        "Families of curves of the map between their upper and lower envelopes",
        "The image of each coordinate for values of the other (grey), between the lower and the upper auxiliary map; with the "
        "worst-case steps from the box (dotted) and, if the box is trapped, the interval to which they shrink (green).",
    ),
    "morse": (
        "Cells of the window coloured by recurrent component, with states of an orbit",
        "The cells that hold all that stays in the window, by recurrent component, and states of orbits. From a minimal "
        "component no other is reached.",
    ),
    "transient": (
        "Cells of the regions coloured by the number of returns after which they are left",
        "After how many returns all states of a cell have left its region, by enclosure; the cells that stay, and cycles there.",
    ),
    "envelopes": (
        "Upper and lower auxiliary maps with the cobwebs between them",
        "Lower and upper auxiliary map of each coordinate, with the worst-case steps from the box (dotted). Where the box is "
        "trapped, they shrink to the yellow interval from p to q, which bounds the attracting domain; the thin line is a "
        "generic cobweb, left out where it comes to no cycle.",
    ),
    "domain_size": (
        "Width of the attracting domain after each update, one coordinate a panel",
        "Width of the box after each update of the auxiliary maps, for each domain; of one that is not trapped, of the start "
        "box alone.",
    ),
    "second_iterate": (
        "Second iterate of the first coordinate with its fixed points",
        "Second iterates of the auxiliary maps: the lower map of the upper one and the upper map of the lower one, or the worst"
        " case of both. Where the box is trapped, p and q bound the coordinate.",
    ),
}  #: by figure: the text in place of the picture, and the caption below it
