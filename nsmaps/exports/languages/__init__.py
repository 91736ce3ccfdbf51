"""The languages of exports: each is its module in this room, whose `files(result, name, about)` gives texts by file name."""

LANGUAGES = (
    "latex",
    "python",
    "c",
    "julia",
    "matlab",
    "javascript",
    "json",
)
