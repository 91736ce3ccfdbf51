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
        "First returns along one coordinate, the other held, by impact word; gaps are jumps of the map.",
    ),
    "words": (
        "The plane of states coloured by impact word",
        "The impact word of the first return from every state of the grid, and the pieces of the composite map if there is one.",
    ),
    "regions": (
        "The plane of states divided into named pieces",
        "The pieces of the composite map by name, with their words and their shares of the grid.",
    ),
    "surfaces": (
        "Surfaces of the images over the plane of states",
        "The return surfaces: each coordinate of the image over the starts, by family of words.",
    ),
    "projections": (
        "Images against starts, one coordinate a panel, with the diagonals",
        "The return surfaces seen along one coordinate, in the phase planes; where they meet the diagonal, a coordinate returns.",
    ),
    "diagonal": (
        "States near the diagonals at some values of the parameter, inside those at all values, in the phase planes",
        "States near both diagonals (eq. r1uniond): green at one value of the parameter, blue at all values of the sweep; dotted "
        "lines are the ratios delta and 1/delta.",
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
    "partition": ("The plane of states divided into the pieces of the composite map", "The regions that the algorithm found."),
    "strips": (
        "Strips of the plane of states between grazing curves",
        "The leaves of the accurate map by degree, and the grazing curves between them.",
    ),
    "speed_error": (
        "Error of the reduced map against its time a state, beside the time of the exact map",
        "Error against speed: processor time for the return of one state, and largest error at held-out states.",
    ),
    "orbits": (
        "Orbits of the exact and of the composite map in the plane of states",
        "Orbits from the starts of the study: of the exact map, and of the composite map where there is one.",
    ),
    "cobweb": (
        "Cobweb diagrams of the orbits over the projected surfaces",
        "Cobwebs: the orbits in the phase planes, over the pieces of the composite map.",
    ),
    "bifurcation": (
        "States of the attractors against the parameter, coloured by word",
        "The attractors over the parameter, by impact word, with the names of the motions.",
    ),
    "branches": (
        "States of periodic orbits against the parameter, solid where stable and dashed where unstable, with their events",
        "Branches of periodic orbits: solid lines attract, dashed ones do not, with the events on them.",
    ),
    "stability": (
        "The plane of two parameters coloured by the motion that attracts, with curves of events",
        "The motion that attracts over two parameters, and the curves on which a branch has an event.",
    ),
    "lyapunov": (
        "Lyapunov exponents against the parameter with bands of two standard errors",
        "The Lyapunov exponents over the parameter, a return and a unit of time, with bands of two standard errors.",
    ),
    "basins": (
        "The plane of states coloured by the attractor reached, and by the number of returns to it",
        "Basins of attraction over the grid: where each state ends up, and after how many returns.",
    ),
    "noise": (
        "Impacts under noise against the parameter, and shares and rates of the motions against the size of the noise",
        "Under noise: impacts over the parameter (fig. comp_stoch), shares of motions, and rates of changes between them.",
    ),
    "auxiliary": (
        "Families of curves of the map between their upper and lower envelopes",
        "Families of curves between the auxiliary maps, and the worst case that bounds the attracting domain.",
    ),
    "morse": (
        "Cells of the window coloured by recurrent component, with states of an orbit",
        "The cells that hold all that stays in the window, by recurrent component, and states of the attractor.",
    ),
    "transient": (
        "Cells of the regions coloured by the number of returns after which they are left",
        "After how many returns all states of a cell have left its region, by enclosure; the cells that stay, and cycles there.",
    ),
    "envelopes": (
        "Upper and lower auxiliary maps with the cobwebs between them",
        "Auxiliary maps of each coordinate with the worst-case and the generic cobweb: what bounds the attracting domain.",
    ),
    "domain_size": (
        "Width of the attracting domain after each update, one coordinate a panel",
        "How the attracting domain shrinks: its width after each update of the auxiliary maps.",
    ),
    "second_iterate": (
        "Second iterate of the first coordinate with its fixed points",
        "The second iterate of the auxiliary maps; its fixed points bound the first coordinate.",
    ),
}  #: by figure: the text in place of the picture, and the caption below it
