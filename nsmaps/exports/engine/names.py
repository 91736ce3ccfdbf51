"""Names of the engine as names of other languages."""

#: words of C or Julia that are not words of Python
RESERVED = """
    auto begin case catch char const default do double end export extern far float function global goto inline int let local
    long module near quote register restrict short signed sizeof static struct switch try typedef union unsigned void volatile
"""


def spelt(name: str) -> str:
    """A name of the engine as a name of C and of Julia."""
    return f"{name}_" if name in RESERVED.split() else name
