"""What the compiled functions of integrated flights work in."""

from typing import Any, NamedTuple

from nsmaps.exact.engine.flight.flow import Flow


class Memory(NamedTuple):
    """The lanes with the returns under way, and the arrays of all returns, into which they write."""

    p: Flow  #: the table: walls, forcing and impact laws
    moved: Flow  #: its derivatives along a direction of the parameters
    tc: Any  #: shape (states, order + 1, lanes), Taylor coefficients at the beginning of the step
    state: Any  #: shape (states, lanes), of the integrator
    pars: Any  #: shape (parameters, lanes), of the integrator
    lanes: Any  #: shape (lanes, FLOATS), see `layout`
    counts: Any  #: shape (lanes, INTEGERS)
    pressing: tuple[Any, Any]  #: shapes (K, 2): phases between which the lower wall and the upper press on a ball at rest
    series: Any  #: shape (3, ORDER + 1), of a gap or a velocity, with room to shift it
    ends: Any  #: shape (states,), of the step
    chatter: tuple[float, float]  #: on the base wall and on the other, as in `first_return`
    turning: bool  #: whether turning points are letters of the words
    next: Any  #: shape (1,), the next state to start from
    start: Any  #: shape (M, 2)
    states: Any  #: shape (n, M, 2), and so on as `put` of the engine writes them
    turns: Any
    codes: Any
    outcome: Any
    time: Any
    tangents: Any  #: shape (n, M, 2, 3)
    margins: Any  #: shape (M, 3), clearance, slowest, turning points; or no rows
    hits: Any  #: shape (H, 5), impacts: on the base wall, time, phase, speed, mark; or no rows
