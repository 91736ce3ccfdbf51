"""Julia of the kind that exports are written in, as Python, by rules of the text alone: to run it where there is no Julia."""

import math
import re
from types import SimpleNamespace

WORDS = {"true": "True", "false": "False", "Inf": "inf", "NaN": "nan", "Float64": "float"}
GROUP = re.compile(r"\(([^()\[\]]*)\)|\[([^()\[\]]*)\]")


def run(module: str) -> dict:
    """The functions and constants of a module, but for its last two functions, which are for Julia's own types."""
    body = module.split("export ", 1)[1].split("\n", 1)[1].split('\n"The first return of a state')[0]
    body = re.sub(r"^(\"[^\"\\]*(\\.[^\"\\]*)*\"|struct .*?^end)$", "", body, flags=re.M | re.S)
    body = re.sub(r"\[\n(.*?)\n\]", lambda match: f"[{' '.join(match[1].split())}]", body, flags=re.S)
    lines, depth = [], 0
    for line in filter(None, map(str.strip, body.splitlines())):
        depth -= line == "end" or line.startswith("else")
        if not re.match(r"end$|local ", line):
            lines.append("    " * depth + statement(line))
        depth += line.startswith(("function ", "if ", "for ", "else", "elseif "))
    names = {"Flow": lambda table, flight: SimpleNamespace(table=table, flight=flight), "Int64": None, "inf": math.inf}
    names |= {"nan": math.nan, "Base_sqrt": math.sqrt, "Base_log": math.log, "trunc": lambda kind, x: int(x)}
    names |= {"div": lambda x, y: x // y, "floor": lambda x: float(math.floor(x)), "isinteger": float.is_integer}
    names |= {name: getattr(math, name) for name in ("hypot", "exp", "ldexp")}
    exec("\n".join(lines), names)
    return names


def statement(line: str) -> str:
    """One line, without its indentation."""
    if match := re.match(r"function (.*)", line):
        return f"def {match[1]}:"
    if match := re.match(r"(\w+\([^()]*\)) = (.*)", line):
        return f"def {match[1]}: return {expression(match[2])}"
    if match := re.match(r"for (\w+) in (.*):(.*)", line):
        return f"for {match[1]} in range({expression(match[2])}, {expression(match[3])} + 1):"
    if match := re.match(r"(if|elseif) (.*)", line):
        return f"{match[1].replace('elseif', 'elif')} {expression(match[2])}:"
    if line in ("else", "break"):
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
        indexed = match[2] is not None and match.start() > 0
        groups.append(f"({inside})" if match[1] is not None else f"[({inside}) - 1]" if indexed else f"[{inside}]")
        return f"@{len(groups) - 1}@"

    text = text.replace("Base.", "Base_")
    while GROUP.search(text):
        text = GROUP.sub(kept, text, count=1)
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
    text = re.sub(r"!(?!=)", "not ", text).replace(".re", ".real").replace(".im", ".imag")
    return re.sub(r"[A-Za-z_]\w*", lambda match: WORDS.get(match[0], match[0]), text)
