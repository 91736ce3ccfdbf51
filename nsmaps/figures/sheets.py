"""The figures by name: what to draw for a result, as sheets."""

from collections.abc import Callable, Mapping

from nsmaps.figures import (
    algorithm,
    auxiliary,
    basins,
    bifurcation,
    cobweb,
    domain_size,
    envelopes,
    impacts,
    lyapunov,
    morse,
    motion,
    noise,
    orbits,
    partition,
    projections,
    regions,
    second_iterate,
    sketch,
    slices,
    speed_error,
    strips,
    surfaces,
    transient,
    words,
)
from nsmaps.figures.needs import Drawable
from nsmaps.figures.sheet import Sheet

SHEETS: Mapping[str, Callable[[Drawable], tuple[Sheet, ...]]] = {
    "sketch": sketch.sheets,
    "algorithm": algorithm.sheets,
    "motion": motion.sheets,
    "impacts": impacts.sheets,
    "slices": slices.sheets,
    "words": words.sheets,
    "regions": regions.sheets,
    "surfaces": surfaces.sheets,
    "projections": projections.sheets,
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
