"""Julia of the kind that exports are written in, as Python, by rules of the text alone: to run it where there is no Julia."""

import math
import re
from types import SimpleNamespace

WORDS = {"true": "True", "false": "False", "Inf": "inf", "NaN": "nan", "Float64": "float"}
GROUP = re.compile(r"\(([^()\[\]]*)\)|\[([^()\[\]]*)\]")


class Entries:
    """An array whose first index runs fastest, or a part of one behind an offset."""

    def __init__(self, numbers, *lengths, offset=0):
        self.numbers, self.lengths, self.offset = numbers, lengths or (len(numbers),), offset

    def place(self, at):
        at, place = at if isinstance(at, tuple) else (at,), 0
        assert len(at) == len(self.lengths)
        for index, length in zip(reversed(at), reversed(self.lengths), strict=True):
            assert 0 <= index < length
            place = place * length + index
        return self.offset + place

    def __getitem__(self, at):
        return self.numbers[self.place(at)]

    def __setitem__(self, at, value):
        self.numbers[self.place(at)] = value


def from_one(*given):
    """Indices from one on as indices from zero on."""
    return given[0] - 1 if len(given) == 1 else tuple(each - 1 for each in given)


def view(array, *given):
    """The part of an array whose last indices are given; None stands for all."""
    whole = given.count(None)
    first = array.place((0,) * whole + from_one(*given[whole:], 1)[:-1])
    return Entries(array.numbers, *array.lengths[:whole], offset=first)


def zeros(*lengths):
    kind, *lengths = lengths if lengths[0] in (int, bool) else (float, *lengths)
    return Entries([kind()] * math.prod(lengths), *lengths)


NAMES = {
    **{name: getattr(math, name) for name in ("hypot", "exp", "ldexp", "cos", "sin", "expm1", "inf", "nan")},
    **{"Base_sqrt": math.sqrt, "Base_log": math.log, "Int64": int, "Bool": bool, "isinteger": float.is_integer},
    **{"isnan": math.isnan, "isfinite": math.isfinite, "zeros": zeros, "view": view, "from_one": from_one, "Entries": Entries},
    "Base_size": lambda array, axis: array.lengths[axis - 1],
    "reshape": lambda array, *lengths: Entries(array.numbers, *lengths),
    "record": SimpleNamespace,
    "trunc": lambda kind, x: int(x),
    "div": lambda x, y: x // y,
    "floor": lambda *given: math.floor(given[-1]) if given[0] is int else float(math.floor(given[0])),
}


def run(module: str) -> dict:
    """The functions and constants of a module, but for its last two functions, which are for Julia's own types."""
    body = module.split("export ", 1)[1].split("\n", 1)[1].split('\n"The first return of a state')[0]
    body = re.sub(r"^\"[^\"\\]*(\\.[^\"\\]*)*\"$", "", body, flags=re.M | re.S)
    body = re.sub(r"^([^\n]*) = \(\n(.*?)^\)$", lambda match: f"{match[1]} = record({fields(match[2])})", body, flags=re.M | re.S)
    body = re.sub(r"(Float64|Int64|Bool)\[([^\]]*)\]", lambda match: f"Entries([{' '.join(match[2].split())}])", body)
    lines, depth = [], 0
    for line in filter(None, map(str.strip, body.splitlines())):
        depth -= line == "end" or line.startswith("else")
        if not re.match(r"end$|local ", line):
            lines.append("    " * depth + statement(line))
        depth += line.startswith(("function ", "if ", "for ", "while ", "else", "elseif "))
    names = dict(NAMES)
    exec("\n".join(lines), names)
    return names


def fields(text: str) -> str:
    """The fields of a named tuple as keywords."""
    return re.sub(r"^ +(\w+) = ", r"\1=", text, flags=re.M).replace("\n", " ")


def statement(line: str) -> str:
    """One line, without its indentation."""
    if match := re.match(r"function (.*)", line):
        return f"def {match[1]}:"
    if match := re.match(r"(\w+\([^()]*\)) = (.*)", line):
        return f"def {match[1]}: return {expression(match[2])}"
    if match := re.match(r"for (\w+) in (.*?)(?<! ):(?! )(?:(-?\d+):)?(.*)", line):
        low, high, by = expression(match[2]), expression(match[4]), match[3] or "1"
        return f"for {match[1]} in range({low}, {high} + {-1 if by[0] == '-' else 1}, {by}):"
    if match := re.match(r"(if|elseif|while) (.*)", line):
        return f"{match[1].replace('elseif', 'elif')} {expression(match[2])}:"
    if line in ("else", "break", "continue", "return"):
        return line.replace("else", "else:")
    if match := re.match(r"return (.*)", line):
        return f"return {expression(match[1])}"
    if match := re.match(r"(?:const )?(.*?) ([*+|]?=) (.*)", line):
        return f"{expression(match[1])} {match[2]} {expression(match[3])}"
    return expression(line)


def expression(text: str) -> str:
    """An expression, or several with commas between them."""
    groups: list[str] = []

    def kept(match: re.Match) -> str:
        inside = choices(match[1] if match[1] is not None else match[2])
        indexed = match[2] is not None and re.match(r"[\w@)]", match.string[match.start() - 1 : match.start()])
        groups.append(f"({inside})" if match[1] is not None else f"[from_one({inside})]" if indexed else f"[{inside}]")
        return f"@{len(groups) - 1}@"

    text = text.replace("Base.", "Base_").replace(", :", ", None")
    while GROUP.search(text):
        text = GROUP.sub(kept, text)
    text = choices(text)
    while "@" in text:
        text = re.sub(r"@(\d+)@", lambda match: groups[int(match[1])], text)
    return text


def choices(text: str) -> str:
    """Expressions without brackets: choices, signs and words as Python has them."""
    return ", ".join(choice(each) for each in text.split(", "))


def choice(text: str) -> str:
    if " ? " in text:
        test, rest = text.split(" ? ", 1)
        first, second = rest.split(" : ", 1)
        return f"({choice(first)} if {choice(test)} else {choice(second)})"
    text = re.sub(r"(\S+)\.\.\.", r"*\1", text).replace("&&", "and").replace("||", "or")
    text = re.sub(r"!(?!=)", "not ", text).replace("^", "**")
    text = re.sub(r"\.im\b", ".imag", re.sub(r"\.re\b", ".real", text))
    return re.sub(r"[A-Za-z_]\w*", lambda match: WORDS.get(match[0], match[0]), text)
