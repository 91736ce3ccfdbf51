"""Untrusted files, read as text and as JSON: of a limited size, and without control characters."""

import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from nsmaps.errors import NsmapsError

#: control characters, halves of surrogate pairs, and what turns the direction of writing: terminals and pages obey them
ODD = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\u202a-\u202e\u2066-\u2069]")


def odd_character(text: str) -> str:
    r"""The first control character of a text, other than tabs and ends of lines, as it is written in Python; "" if it has none.

    >>> odd_character("two\nlines"), odd_character("a red \x1b[31m title")
    ('', "'\\x1b'")
    """
    found = ODD.search(text)
    return ascii(found[0]) if found else ""


def text_of(path: Path, max_bytes: int) -> str:
    """The text of a file of at most so many bytes.

    Raises:
        NsmapsError: a larger file, or one that is not text in UTF-8.
        OSError: a file that cannot be read.
    """
    if (size := os.path.getsize(path)) > max_bytes:
        raise NsmapsError(f"a file of {size:,} bytes; expected: at most {max_bytes:,}")
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise NsmapsError(f"not text in UTF-8: {error}") from error


def json_of(text: str) -> Any:
    """What a text says in JSON, strings without control characters. NsmapsError for what is nested too deeply or has one.

    Raises json.JSONDecodeError for invalid JSON.
    """
    try:
        data = json.loads(text)
    except RecursionError:
        raise NsmapsError("nested too deeply to be read; expected: lists and objects of a few levels") from None
    except ValueError as error:
        if isinstance(error, json.JSONDecodeError):
            raise
        raise NsmapsError(f"not readable as JSON: {error}") from error  # a whole number of thousands of digits
    if found := next(filter(None, map(odd_character, _texts(data))), ""):
        raise NsmapsError(f"the character {found} in a text; expected: text without control characters")
    return data


def _texts(data: Any) -> Iterator[str]:
    """Every text and key of plain data."""
    waiting = [data]
    while waiting:
        item = waiting.pop()
        if isinstance(item, str):
            yield item
        elif isinstance(item, list):
            waiting += item
        elif isinstance(item, dict):
            waiting += [*item, *item.values()]
