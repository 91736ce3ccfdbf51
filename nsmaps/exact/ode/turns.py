"""The turning points of a step: zeros of the velocity, as letters of itineraries, and how near they come to a wall."""

from nsmaps.exact.engine.flight.flow import walls_of
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.returns import spell
from nsmaps.exact.modes.march.zeros import first_zero
from nsmaps.exact.modes.tables.taylor import ORDER
from nsmaps.exact.ode.flight import room_to, series_of
from nsmaps.exact.ode.layout import CLEARANCE, CODE, FRESH, POWER, RISING, TURNED, UP

MOST_TURNS = 100  # of one step


@inlined
def letters(p):
    """The number of walls, and that of the codes of letters, turning points among them."""
    has_up, has_down, _ = walls_of(p)
    walls = 2 if has_up and has_down else 1
    return walls, walls + 5


@inlined
def note(w, k, s):
    """Note a turning point of lane k a time s after the beginning of the step: its letter, and its gap to the wall ahead."""
    has_up, has_down, _ = walls_of(w.p)
    lane, count = w.lanes[k], w.counts[k]
    rising = count[RISING] == 1
    if (rising and has_up) or (not rising and has_down):
        place = 0.0
        for m in range(w.tc.shape[1] - 1, -1, -1):
            place = place * s + w.tc[0, m, k]
        gap = room_to(w.p, count[UP] == 1, rising) + (-place if rising else place)
        lane[CLEARANCE] = min(lane[CLEARANCE], gap)
    _, base = letters(w.p)
    count[CODE], count[POWER] = spell(count[CODE], count[POWER], base, base - 2 if rising else base - 1, 1)
    count[TURNED] += 1
    count[RISING] = 0 if rising else 1


@inlined
def about(a, s, b):
    """Write the coefficients about s of minus a polynomial that has a zero there."""
    for m in range(ORDER + 1):
        b[m] = -a[m]
    for m in range(ORDER):
        for j in range(ORDER - 1, m - 1, -1):
            b[j] += s * b[j + 1]
    b[0] = 0.0


@inner
def turns_of_step(w, k, end):
    """Note all turning points of lane k before `end`, a time since the beginning of the step."""
    count, a, b = w.counts[k], w.series[1], w.series[2]
    if count[FRESH] == 1:
        count[RISING] = 1 - count[UP]
    series_of(w.tc, 1, k, 1.0 if count[RISING] == 1 else -1.0, a)
    on = a[0] <= 0.0
    a[0] = max(a[0], 0.0)
    if on and count[FRESH] == 1:
        a[1] = max(a[1], 0.0)  # released: the acceleration is zero up to rounding
    s = 0.0
    for _ in range(MOST_TURNS):
        found, x, _ = first_zero(a, end - s, 0.0, on)
        if not found or not s + x < end:
            break
        s, on = s + x, True
        note(w, k, s)
        about(a, x, b)
        for m in range(ORDER + 1):
            a[m] = b[m]
