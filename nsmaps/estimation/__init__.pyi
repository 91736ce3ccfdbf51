"""From measured data to parameters: records, estimates with their errors, and what they imply for the motion."""

from nsmaps.estimation.classification import Margins as Margins
from nsmaps.estimation.classification import Motions as Motions
from nsmaps.estimation.classification import motions as motions
from nsmaps.estimation.margin import BasinDistance as BasinDistance
from nsmaps.estimation.margin import basin_distance as basin_distance
from nsmaps.estimation.records import Record as Record
from nsmaps.estimation.result import Estimate as Estimate
from nsmaps.estimation.result import Minima as Minima
from nsmaps.estimation.result import Pairs as Pairs
from nsmaps.estimation.result import Profile as Profile
from nsmaps.estimation.uncertainty import Uncertainty as Uncertainty
