"""From measured data to parameters: records, estimates with their errors, and what they imply for the motion."""

from nsmaps.estimation.records import Record as Record
from nsmaps.estimation.result import Estimate as Estimate
from nsmaps.estimation.result import Minima as Minima
from nsmaps.estimation.result import Pairs as Pairs
from nsmaps.estimation.result import Profile as Profile
