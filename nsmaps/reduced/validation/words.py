"""States whose word under a composite map differs from that of the exact map, and their distance from an edge."""

from dataclasses import dataclass

import numpy as np

from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.compose import iterate_returns
from nsmaps.exact.surfaces.surface import Grid
from nsmaps.reduced.composite.composite import CompositeMap
from nsmaps.results import Result


@dataclass(frozen=True, slots=True, repr=False)
class Misleads(Result):
    """States of a grid at which the composite and the exact map differ; shares of the states that have both images."""

    states: int  #: number of states with both images
    wrong_words: float  #: share with another word
    typical: float  #: median distance of these from the edge of a piece, in sides of the grid's box; NaN without any
    farthest: float  #: the largest
    leaves: float  #: share whose image lies in no piece, where an orbit ends

    @property
    def text(self) -> str:
        """The numbers as a sentence."""
        word = f"{100 * self.wrong_words:.3g} % of {self.states} states of the grid get another word than the exact map's"
        near = f"half of them within {self.typical:.2g} of an edge between pieces, all within {self.farthest:.2g}"
        far = f", {near} (grid scaled to unit sides)"
        gone = f"; the images of {100 * self.leaves:.3g} % lie in no piece"
        return f"{word}{far if np.isfinite(self.typical) else ''}{gone if self.leaves else ''}"


def misleads(composite: CompositeMap, grid: Grid, return_map: ReturnMap, first: Returns) -> Misleads:
    """The difference of the words of a composite map from those of the exact map, from all states of a grid.

    The word of a piece of several returns is compared with that of as many exact ones. Distances are those between states of the
    grid, so exact to its spacing. A piece without a word, as a reset, is omitted.
    """
    from scipy.ndimage import distance_transform_edt

    exact = iterate_returns(return_map, first, composite.returns_of(first.start)) if composite.several else first
    ours = composite.first_return(exact.start)
    number = composite.piece_of(exact.start)
    worded = np.array([bool(piece.word) for piece in composite.pieces] + [False])[number]
    both = ours.valid & exact.valid & worded
    wrong = both & (ours.codes != exact.codes)
    away = np.full(len(number), np.inf)
    spacing = 1 / np.maximum(np.array(grid.shape) - 1, 1)
    for k in np.unique(number[wrong]):
        own = number == k
        if not own.all():  # an edge somewhere
            away[wrong & own] = distance_transform_edt(own.reshape(grid.shape), spacing).ravel()[wrong & own]
    far = away[wrong & np.isfinite(away)]
    gone = composite.piece_of(ours.image[both]) < 0
    return Misleads(
        states=int(both.sum()),
        wrong_words=float(wrong.sum() / max(both.sum(), 1)),
        typical=float(np.median(far)) if len(far) else float("nan"),
        farthest=float(far.max()) if len(far) else float("nan"),
        leaves=float(gone.mean()) if len(gone) else float("nan"),
    )
