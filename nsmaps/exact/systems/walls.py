"""The walls of an impact system."""

from dataclasses import dataclass
from typing import Any, Literal


@dataclass(frozen=True, slots=True)
class Wall:
    """A wall at displacement `at`: side +1 stops growing displacement (the ball is below), side -1 falling displacement."""

    at: Any
    side: Literal[-1, 1]
