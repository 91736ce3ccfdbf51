"""The names that studies and figures share."""

from typing import Literal, get_args

FigureName = Literal[
    "sketch",
    "algorithm",
    "motion",
    "impacts",
    "slices",
    "words",
    "regions",
    "surfaces",
    "projections",
    "diagonal",
    "diagonal_surface",
    "orders",
    "fit_error",
    "separable",
    "partition",
    "strips",
    "speed_error",
    "orbits",
    "cobweb",
    "bifurcation",
    "branches",
    "stability",
    "lyapunov",
    "basins",
    "noise",
    "auxiliary",
    "envelopes",
    "domain_size",
    "second_iterate",
    "morse",
    "transient",
]
FIGURES: tuple[str, ...] = get_args(FigureName)
