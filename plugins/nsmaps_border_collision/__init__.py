"""Border collisions: the piecewise-linear normal forms in one, two, three and n dimensions, and the Lozi map."""

from nsmaps_border_collision.system import (
    BorderCollision,
    BorderCollision1,
    BorderCollision3,
    Lozi,
    UnitTent,
    normal_form,
)

__all__ = ["BorderCollision", "BorderCollision1", "BorderCollision3", "Lozi", "UnitTent", "normal_form"]
