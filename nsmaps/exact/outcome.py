"""The outcome of a first return: why it ended as it did."""

from enum import IntEnum


class Outcome(IntEnum):
    """Why a return ended as it did; `Outcome.x.advice` says what to do about it."""

    returned = 0
    stuck = 1
    rests = 2
    escaped = 3
    undecided = 4
    uncovered = 5
    invalid = 6

    @property
    def advice(self) -> str:
        """One sentence: what happened and what may be tried."""
        return _ADVICE[self]


_ADVICE = {
    Outcome.returned: "Came back to the base wall.",
    Outcome.stuck: "Came to rest on the base wall; the image is its release, at speed zero.",
    Outcome.rests: "Rests on a wall for ever: the forcing never lifts it off. There is no image.",
    Outcome.escaped: "No return within the horizon. Look at the displacement, or raise the system's horizon.",
    Outcome.undecided: "A flight passes a wall within rounding of a graze, or grows from what is rounding; the image is that of "
    "one of the words that it may make, none where it may escape.",
    Outcome.uncovered: "The state lies in no piece of the composite map. Add a piece, or restrict the starts.",
    Outcome.invalid: "The start is no state: NaN, infinite, with a negative impact speed or a phase beyond 1e10.",
}

OUTCOMES = "; ".join(f"{outcome.value} {outcome.name}" for outcome in Outcome)  #: the values by name, as datasets say them
