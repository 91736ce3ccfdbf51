"""The search for what certificates of maps given by formulas claim, in floats; `nsmaps.verify.maps` proves it."""
