"""A return map that is given by formulas, in pieces: the first whose condition holds gives the image."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import as_states
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.returns import Returns
from nsmaps.exact.systems.parameters import ExactSystem
from nsmaps.parallel import fingerprint

if TYPE_CHECKING:
    from nsmaps.exact.piecewise.compiled import PieceKernel
    from nsmaps.exact.piecewise.prolonged import Prolonged


class PiecewiseMap(ExactSystem):
    """A return map in pieces, each a condition and an image in sympy, of which the first that holds applies.

    Subclass it: the fields are the parameters, `coordinates` the names of the coordinates, of which an `Angle` lives on the
    circle, and `pieces` formulas in `self` and in the states x.x, x.y, ..., with angles in [0, 2 pi). The word of a return is the
    letter of its piece, so that words of orbits are itineraries. A return takes one unit of time.
    """

    wanted: ClassVar[str] = "a PiecewiseMap: what it rests on are the formulas of pieces"

    @abstractmethod
    def pieces(self, x: SimpleNamespace) -> Mapping[str, tuple[Any, Mapping[str, Any]]]:
        """The pieces by their letters: each a condition, the last perhaps True, and the images by coordinate."""

    def preimages(self, x: SimpleNamespace) -> Mapping[str, Mapping[str, Any]] | None:
        """For each piece the state before a return to x, by coordinate: formulas for `inverse` that sympy does not find."""
        return None

    def inverse(self) -> "PiecewiseMap":
        """The inverse: the state before a return to each, in the first piece that has one.

        The equations of each piece are solved by sympy, unless `preimages` gives their solutions. A state without a preimage in
        its piece is `uncovered`.

        Raises:
            SystemDefinitionError: the equations of a piece are not solved.
        """
        from nsmaps.exact.piecewise.inverse import inverse_of

        return inverse_of(self)

    @property
    def letters(self) -> tuple[str, ...]:
        """The letters of the pieces, of which words consist."""
        return self._kernel().letters

    @property
    def is_affine(self) -> bool:
        """True if images and borders are affine in the coordinates, of which none is an angle."""
        return self._kernel().pieces.affine

    def first_return(self, states: ArrayLike, derivative: bool = False) -> Returns:
        """The images of a batch of states, and their derivatives by the formulas.

        A state in no piece is `uncovered`, one that is not finite `invalid`; one whose image is not finite `escaped`.

        Args:
            states: shape (N, n), angles in radians on any turn.
            derivative: also the derivative of the image, shape (N, n, n): in the piece of the state.

        Raises:
            StateError: `states` is not a batch of shape (N, n).
            SystemDefinitionError: a piece is not one.
        """
        return self._kernel().first_returns(as_states(states, self.coordinates), derivative, SUMMED_SPEED)

    def orbits(self, states: ArrayLike, n_returns: int, derivative: bool = False) -> Returns:
        """The first returns of each of M states: `n_returns` M rows, the first return of every state first.

        After an orbit's end its images are NaN, its words empty, and the outcome that ended it is repeated.
        """
        return self._kernel().orbits(as_states(states, self.coordinates), n_returns, derivative, SUMMED_SPEED)

    def sensitivity(self, states: ArrayLike, rates: Mapping[str, float]) -> Floats:
        """The derivative of images by the parameters, which change at the `rates` given, shape (N, n); NaN where there is none.

        Raises:
            StateError: `states` is not a batch of shape (N, n).
            ParameterError: a name is not one of a numerical parameter.
        """
        return self._kernel().sensitivities(as_states(states, self.coordinates), self.direction(rates), SUMMED_SPEED)

    def prolongation(self, pieces: Sequence[int], lowest: Floats, free: Sequence[int] = ()) -> "Prolonged":
        """The map on the states of cycles by the formulas of given pieces, of `free` states beyond their borders too.

        Args:
            pieces: numbers of the pieces of the q states of a cycle, as of `letters`.
            lowest: shape (q, n), from which the turns of angles begin in formulas.
            free: numbers of states.
        """
        from nsmaps.exact.piecewise.prolonged import Prolonged

        return Prolonged(self, self._kernel().pieces, tuple(pieces), lowest, tuple(free))

    def rests(self, states: ArrayLike) -> Floats:
        """NaN, as nothing rests, shape (N,)."""
        return np.full(len(as_states(states, self.coordinates)), np.nan)

    def phase_rate(self) -> float:
        """Zero, as there is no forcing."""
        return 0.0

    def obstacle(self) -> str:
        """None: the map is one by formulas."""
        return ""

    @classmethod
    def formulas(cls) -> dict[str, Any]:
        """The formulas of the class by name."""
        return {"pieces": cls.pieces, "preimages": cls.preimages}

    if TYPE_CHECKING:

        def _kernel(self) -> PieceKernel: ...

    def _compile(self) -> "PieceKernel":
        from nsmaps.exact.piecewise.compiled import piece_kernel
        from nsmaps.exact.piecewise.formulas import Choices

        return piece_kernel(Choices.of(self), tuple(self.parameters.values()))


@fingerprint.register
def _(system: PiecewiseMap) -> str:
    """The identity of a map includes its formulas."""
    return f"{system._kernel().name}({system!r})"
