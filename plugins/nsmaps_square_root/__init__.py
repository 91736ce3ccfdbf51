"""Nordmark's square-root map, the normal form of a graze: in one coordinate and in two."""

from nsmaps_square_root.system import SquareRoot, SquareRootPlane

__all__ = ["SquareRoot", "SquareRootPlane"]
