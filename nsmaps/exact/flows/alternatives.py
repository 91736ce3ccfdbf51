"""What can be written in place of a formula that is refused: sentences that end its message."""

DELAY = "a delay is out of scope: the state of such a system is a function, which finitely many coordinates do not give"
FORCING = (
    "a second forcing of frequency w is two states p, q of a `HybridSystem` with the rates p' = -w*q and q' = w*p, and a decay a "
    "state with e' = -k*e"
)
PHASE_LAW = "a restitution that depends on the phase is the `reset` of a `Guard` in a `HybridSystem`"
FRICTION = (
    "friction in contact is a `SlidingSurface` between two modes of `rests`, one for each direction, and an impact that leads to "
    "another mode a `Guard` of its own with `where`"
)
