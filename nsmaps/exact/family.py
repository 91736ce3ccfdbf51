"""Families of returns: which impact words belong together on one surface, eq. exactmap."""

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from nsmaps.exact.impacts import Returns
from nsmaps.exact.surface import Grid, Surface, surfaces

if TYPE_CHECKING:
    from nsmaps.exact.system import ImpactSystem


class ReturnFamily(BaseModel, ABC):
    """A set of first returns that form one surface over the states."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str

    @abstractmethod
    def contains(self, returns: Returns) -> NDArray[np.bool_]:
        """Which returns belong to the family, shape (N,)."""

    def surface(self, system: "ImpactSystem", grid: Grid) -> Surface:
        """The family's returns over a grid of states."""
        return surfaces(system, grid, [self])[self.name]


class WordFamily(ReturnFamily):
    """The returns that make one of a few impact words, such as BB or BTB."""

    words: tuple[str, ...] = Field(min_length=1)

    def contains(self, returns: Returns) -> NDArray[np.bool_]:
        """Which returns make one of the words, shape (N,)."""
        return np.logical_or.reduce([returns.has_word(word) for word in self.words])
