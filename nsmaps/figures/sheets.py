"""The figures by name: what to draw for a result, as sheets."""

from collections.abc import Callable, Mapping

from nsmaps.figures import (
    auxiliary,
    basins,
    bifurcation,
    cobweb,
    diagonal,
    diagonal_surface,
    domain_size,
    envelopes,
    fit_error,
    lyapunov,
    morse,
    noise,
    orbits,
    orders,
    partition,
    projections,
    second_iterate,
    separable,
    speed_error,
    strips,
    surfaces,
    transient,
    words,
)
from nsmaps.figures.needs import Drawable
from nsmaps.figures.sheet import Sheet

SHEETS: Mapping[str, Callable[[Drawable], tuple[Sheet, ...]]] = {
    "words": words.sheets,
    "surfaces": surfaces.sheets,
    "projections": projections.sheets,
    "diagonal": diagonal.sheets,
    "diagonal_surface": diagonal_surface.sheets,
    "orders": orders.sheets,
    "fit_error": fit_error.sheets,
    "separable": separable.sheets,
    "partition": partition.sheets,
    "strips": strips.sheets,
    "speed_error": speed_error.sheets,
    "orbits": orbits.sheets,
    "cobweb": cobweb.sheets,
    "bifurcation": bifurcation.sheets,
    "lyapunov": lyapunov.sheets,
    "basins": basins.sheets,
    "noise": noise.sheets,
    "auxiliary": auxiliary.sheets,
    "envelopes": envelopes.sheets,
    "domain_size": domain_size.sheets,
    "second_iterate": second_iterate.sheets,
    "morse": morse.sheets,
    "transient": transient.sheets,
}
