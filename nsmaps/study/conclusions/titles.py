"""The maps of a study by their names: `exact`, `composite`, `parametric`, and the pieces of the composite map; their titles."""

from typing import TYPE_CHECKING

from nsmaps.exact.systems.parameters import map_name

if TYPE_CHECKING:
    from nsmaps.exact.systems.parameters import System
    from nsmaps.study.reading.head import Head as Study


def pieces_with_a_map(study: "Study") -> list[str]:
    """The names of the pieces of the composite map that are fitted or printed."""
    return [piece.name for piece in study.composite if piece.reset is None]


def maps_along(study: "Study") -> list[str]:
    """The names of the maps of a study that there are at every value of a parameter."""
    named = ["composite", *pieces_with_a_map(study)] if study.composite else []
    return ["exact", *named, *(["parametric"] if study.parametric_map else [])]


def map_title(study: "Study", system: "System", of: str) -> str:
    """What a map is called in texts and figures: `exact map`, `composite map`, `parametric map`, `fitted map R1`."""
    if of not in pieces_with_a_map(study):
        return map_name(system, of)
    printed = any(piece.name == of and piece.polynomial for piece in study.composite)
    return f"{'printed' if printed else 'fitted'} map {of}"
