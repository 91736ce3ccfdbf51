"""The woodpecker toy: impacts with friction that slip, stop or turn the slip."""

from nsmaps_woodpecker.system import Woodpecker

__all__ = ["Woodpecker"]
