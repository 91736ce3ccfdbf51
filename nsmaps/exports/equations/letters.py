"""Letters of a document's own quantities, other than those that a system takes for its parameters and states."""

from collections.abc import Iterable

from nsmaps.exports.languages.latex import math

CHOICES = {
    "place": ("Z", "X", "Y", r"\zeta"),
    "time": ("t", r"\tau", "s", r"\eta"),
    "velocity": ("w", r"\nu", "q", r"\xi"),
    "speed": ("u", "h", r"\mu", r"\upsilon"),
    "law": (r"\rho", "R", r"\varrho", r"\sigma"),
    "period": ("P", "T", r"\Pi", r"\Theta"),
    "state": ("v", r"\vartheta", "V", r"\omega"),
    "phase": (r"\varphi", r"\theta", r"\psi", r"\chi"),
    "function": ("g", "f", "h", r"\gamma"),
    "part": ("a", "b", "d", r"\alpha"),
    "impact": ("j", "i", "l", r"\iota"),
    "return": ("k", "m", "p", r"\kappa"),
    "last": ("n", "N", "L", r"\ell"),
}  #: for each quantity, the first that is free is taken


def letters_beside(names: Iterable[str]) -> dict[str, str]:
    """A letter for each quantity, none of which is that of a name, with an index or without, or of another quantity.

    Where a system takes all of the choices, the first one gets a prime.
    """
    taken, found = {math(name).split("_")[0].strip("{}") for name in names}, dict[str, str]()
    for what, choices in CHOICES.items():
        free = (letter for letter in choices if letter not in taken)
        found[what] = next(free, f"{choices[0]}'")
        taken.add(found[what])
    return found
