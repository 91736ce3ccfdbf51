"""The boost converter in current-mode control, its output voltage held: the inductor current from clock to clock."""

from nsmaps_boost_converter.system import BoostConverter

__all__ = ["BoostConverter"]
