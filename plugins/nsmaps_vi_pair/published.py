"""The coefficients that the paper prints (supplement, section Coefficients for the Composite Map), as maps; no oracle."""

import json
from pathlib import Path

from nsmaps.errors import FitError, check_known
from nsmaps.reduced.composite.printed import TabulatedMap
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps_vi_pair.system import VIPair

FILE = Path(__file__).parent / "studies" / "published.json"
REGIONS = ("R1", "R2", "R3", "R4", "R5")


def published_map(region: str, d: float) -> PolyMap:
    """The printed map of one of the regions R1 to R5 at a length d, exactly as printed, errors of print included.

    The coefficients are carried over to Chebyshev products of the region's box in rational arithmetic, so that what
    cancels in the print (it reaches 1e11) costs no digits. FitError for a region that has none.
    """
    check_known("no printed map of", region, REGIONS, FitError)
    printed = TabulatedMap.model_validate(json.loads(FILE.read_text(encoding="utf-8"))[region])
    return printed.at(VIPair(d=d, r=0.5, g_bar=0).coordinates, None if printed.parameter is None else d)
