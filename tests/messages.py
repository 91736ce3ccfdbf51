"""What errors say, by code: `messages.toml` has the wording, tests have a code and the values."""

import re
import tomllib
from pathlib import Path

ROOMS = tomllib.loads((Path(__file__).parent / "messages.toml").read_text(encoding="utf-8"))
PHRASES = ROOMS.pop("phrases")  #: what several texts have
TEXTS = {
    f"{room}.{fault}": re.sub(r"\{(\w+)\}", lambda hole: PHRASES.get(hole[1], hole[0]), text)
    for room, faults in ROOMS.items()
    for fault, text in faults.items()
}  #: by code, with the phrases
SIGN = re.compile(r"\{(\w+)\}|(\.\.\.)|(^\^|\$$)")  #: a hole, what may be anything, and the beginning or end of a message


def message(code: str, /, **parts: object) -> str:
    """The regular expression of the messages of a code, with values or expressions in its holes; the others are open.

    The part `at` is what stands before it, as the place in a study.
    """
    text = "{at}: " * ("at" in parts) + TEXTS[code]
    if not set(parts) <= {name for name, *_ in SIGN.findall(text)}:
        raise KeyError(f"{code} has other holes than {', '.join(parts)}: {text}")
    written, end = [], 0
    for sign in SIGN.finditer(text):
        part = parts.get(sign[1] or "", re.compile(sign[3] or ".*"))
        written += [re.escape(text[end : sign.start()]), part.pattern if isinstance(part, re.Pattern) else re.escape(str(part))]
        end = sign.end()
    return "".join([*written, re.escape(text[end:])])
