"""The state space in cells: transition graphs, Morse sets, exit times, and periodic points found by excluding cells."""

from nsmaps.cells.conley import MorseGraph as MorseGraph
from nsmaps.cells.conley import conley_indices as conley_indices
from nsmaps.cells.morse import ForwardInvariantSet as ForwardInvariantSet
from nsmaps.cells.morse import MorseCover as MorseCover
from nsmaps.cells.morse import forward_invariant_box as forward_invariant_box
from nsmaps.cells.morse import forward_invariant_set as forward_invariant_set
from nsmaps.cells.morse import morse_sets as morse_sets
from nsmaps.cells.periodic_points import CycleSearch as CycleSearch
from nsmaps.cells.periodic_points import find_cycles as find_cycles
from nsmaps.cells.times import ExitTimes as ExitTimes
from nsmaps.cells.times import exit_times as exit_times
from nsmaps.enclosures.box_images import box_map as box_map
