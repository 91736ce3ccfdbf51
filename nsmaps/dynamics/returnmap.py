"""The one interface of every return map: exact systems and composite maps satisfy it."""

from typing import Protocol, runtime_checkable

from numpy.typing import ArrayLike

from nsmaps.exact.impacts import Returns


@runtime_checkable
class ReturnMap(Protocol):
    """Anything that says, for a batch of states, where each first returns to."""

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The names of the n coordinates; an `Angle` lives on the circle."""

    def first_return(self, states: ArrayLike, derivative: bool = False) -> Returns:
        """First returns of states of shape (N, n)."""
