"""The outcome of a first return: the reason why it ended."""

from enum import IntEnum


class Outcome(IntEnum):
    """The reason why a return ended; `Outcome.x.advice` states what can be done about it."""

    returned = 0
    stuck = 1
    rests = 2
    escaped = 3
    undecided = 4
    uncovered = 5
    invalid = 6
    simultaneous = 7
    endless = 8
    repelling = 9
    accumulates = 10
    blocked = 11

    @property
    def advice(self) -> str:
        """One sentence: what happened and what may be tried."""
        return _ADVICE[self]


_ADVICE = {
    Outcome.returned: "The motion returned to its section, of an impact system the base wall.",
    Outcome.stuck: "The motion came to rest at its section; the image is its release, at speed zero.",
    Outcome.rests: "The motion rests in contact for all times: the forcing never ends it. There is no image.",
    Outcome.escaped: "The orbit diverges: an image is not finite. Of a motion between returns: there is none within the horizon; "
    "check the formulas of the flight, or raise the system's horizon.",
    Outcome.undecided: "A flight passes a wall within rounding of a graze, or grows from what is rounding; the image is that of "
    "one of the words that it may make, none where it may escape. `image_boxes` of the state, as a box without width, bounds the "
    "images of all of these words, or states that there is no bound.",
    Outcome.uncovered: "The state lies in no piece of the map. Add a piece, or restrict the starts.",
    Outcome.invalid: "The state is not a start: a number is not finite, a phase beyond 1e10, an impact speed negative or, with "
    "modes, no event of the section takes place at it. `HybridSystem.reasons` states which.",
    Outcome.simultaneous: "Two guards are met at once, and the image depends on which event is first: the motion is "
    "not unique. `HybridSystem.reasons` names both.",
    Outcome.endless: "More than 100,000 events without a return: the motion may never meet its section again. Take a section "
    "that every motion meets.",
    Outcome.repelling: "The state lies on a surface of sliding from which both modes lead away: the motion may leave on either "
    "side at any time, and is not unique. `HybridSystem.reasons` names the surface.",
    Outcome.accumulates: "Infinitely many events follow one another in a finite time, by now faster than rounding resolves, and "
    "nothing says what comes then. Declare `rests=` in the guard of impacts that lose speed; `HybridSystem.reasons` names it.",
    Outcome.blocked: "The motion comes to a state from which it cannot continue for any time: a guard is negative where its mode "
    "begins, or events follow one another at once without end. `HybridSystem.reasons` names the guards and what to declare.",
}

OUTCOMES = "; ".join(f"{outcome.value} {outcome.name}" for outcome in Outcome)  #: the values by name, as datasets state them
