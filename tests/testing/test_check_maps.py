"""check_system of maps: each fault that it names, in a map that has no other."""

import warnings

import numpy as np
import pytest
from messages import message

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
        (Changes, message("testing.changes-states", system="Changes")),
        (Mean, message("testing.alone")),
        (Steep, message("testing.derivative", system="Steep", name="x", given="[1.]", found="[0.5]")),
        (Idle, message("testing.no-effect", system="Idle", name="b")),
        (Nowhere, message("testing.no-image", number=200, system="Nowhere", counts="{'escaped': 200}")),
        (Unturned, message("testing.angle", system="Unturned")),
        (Both, message("testing.image-and-outcome", outcome="escaped")),
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
