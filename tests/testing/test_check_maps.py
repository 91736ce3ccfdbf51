"""check_system of maps: each fault that it names, in a map that has no other."""

import warnings

import numpy as np
import pytest

from nsmaps import Angle, Outcome, Returns, System
from nsmaps.errors import CheckError
from nsmaps.testing import check_system


class Sound(System):
    """x -> a x on the left of 1, of which the others change one part."""

    a: float = 0.5
    coordinates = ("x",)

    def first_return(self, states, derivative=False):
        slopes = np.full((len(states), 1, 1), self.a) if derivative else None
        return Returns.of_map(self.coordinates, states, self.a * states, slopes)


class Changes(Sound):
    def first_return(self, states, derivative=False):
        states *= 2
        return Returns.of_map(self.coordinates, states, self.a * states)


class Mean(Sound):
    def first_return(self, states, derivative=False):
        return Returns.of_map(self.coordinates, states, self.a * states + states.sum())


class Steep(Sound):
    def first_return(self, states, derivative=False):
        return Returns.of_map(self.coordinates, states, self.a * states, np.full((len(states), 1, 1), 2 * self.a))


class Idle(Sound):
    b: float = 1.0


class Nowhere(Sound):
    def first_return(self, states, derivative=False):
        return Returns.of_map(self.coordinates, states, self.a * states * np.nan)


class Unturned(Sound):
    coordinates = (Angle("x"),)

    def first_return(self, states, derivative=False):
        n = len(states)
        rows = np.zeros((n, 1), np.int32), np.zeros(n, np.int64), np.zeros(n, np.int8), np.ones(n)
        return Returns(self.coordinates, (), states, self.a * states + 7, *rows)


class Both(Sound):
    def first_return(self, states, derivative=False):
        n = len(states)
        rows = np.zeros((n, 1), np.int32), np.zeros(n, np.int64), np.full(n, Outcome.escaped, np.int8), np.ones(n)
        return Returns(self.coordinates, (), states, self.a * states, *rows)


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        (Changes, "`first_return` of Changes changes the states that it is given"),
        (Mean, "alone and .* among others, with derivatives; expected: the same"),
        (Steep, r"the derivative of Steep by x at .* is \[1\.\]; expected: \[0\.5\]"),
        (Idle, "no return of Idle depends on its parameter 'b'"),
        (Nowhere, r"none of 200 states of Nowhere has an image \(\{'escaped': 200\}\)"),
        (Unturned, r"an angle of an image of Unturned is not in \[0, 2 pi\)"),
        (Both, "has the image .* and is 'escaped'; expected: only one of the two"),
    ],
)
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_fault_of_a_map_is_named(kind, text):
    with pytest.raises(CheckError, match=text):
        check_system(kind())


def test_a_sound_map_passes():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", "no description of Sound.a")
        check_system(Sound())
