"""Auxiliary maps and the attracting domains that they bound (section 6 of the paper)."""

from nsmaps.auxiliary.attracting_domain import AttractingDomain as AttractingDomain
from nsmaps.auxiliary.envelope import Envelope as Envelope
from nsmaps.auxiliary.full_map import FullAuxiliaryMap as FullAuxiliaryMap
from nsmaps.auxiliary.worst_case import Update as Update
