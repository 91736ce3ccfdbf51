"""What each section of a study needs: other sections, and names that were given elsewhere in it."""

import re
from collections.abc import Iterator

from nsmaps.plugins import sketch_of
from nsmaps.study.source import Loc
from nsmaps.study.spec import Study

ATTRACTING = "attracting"  #: the map of a domain that takes the attracting pieces of a partition
DIAGONAL = "diagonal"  #: the data of a piece that is fitted to the states near the diagonals; a domain's box around them
FIGURE_NEEDS = {
    "sketch": (),
    "algorithm": (),
    "motion": ("orbits",),
    "impacts": ("orbits",),
    "slices": ("slices",),
    "words": ("grid", "families"),
    "regions": ("grid", "families", "composite"),
    "surfaces": ("grid", "families"),
    "projections": ("grid", "families"),
    "diagonal": ("diagonal",),
    "diagonal_surface": ("diagonal",),
    "orders": ("diagonal",),
    "fit_error": ("diagonal",),
    "separable": ("grid", "families", "composite"),
    "partition": ("grid", "partition"),
    "strips": ("grid", "partition"),
    "speed_error": ("grid", "partition"),
    "orbits": ("orbits",),
    "cobweb": ("grid", "families", "composite", "orbits"),
    "bifurcation": ("bifurcation",),
    "branches": ("branches",),
    "stability": ("stability",),
    "lyapunov": ("lyapunov",),
    "basins": ("grid", "basins"),
    "noise": ("noise",),
    "auxiliary": ("domains",),
    "envelopes": ("domains",),
    "domain_size": ("domains",),
    "second_iterate": ("second_iterate",),
    "morse": ("morse",),
    "transient": ("transient",),
}


def check_needs(study: Study) -> None:
    """A StudyError at the first section whose need the study does not name."""
    for number, figure in enumerate(study.figures):
        if figure == "sketch":
            with study.source.located(("figures", number)):
                sketch_of(study.system)
        if text := _shows_nothing(study, figure):
            raise study.source.error(("figures", number), text)
    strips = study.partition is not None and study.partition.kind == "accurate"
    for loc, what, section in _needs(study):
        made = ("families",) if strips else ("families", "composite")
        if not study.names(section) and not (section in made and study.partition):
            raise study.source.error(loc, f"{what} needs the section {section!r}, which is missing")


def _shows_nothing(study: Study, figure: str) -> str:
    """Why a figure would have nothing to show although its sections are named; empty if it has."""
    strips = study.partition is not None and study.partition.kind == "accurate"
    if figure == "strips" and study.partition and not strips:
        return "the figure 'strips' shows a 'partition' of kind accurate, and this one is of closed forms"
    if figure in ("motion", "impacts") and study.orbits and not any(orbit.track for orbit in study.orbits):
        return f"the figure {figure!r} shows the motion between impacts; accepted: an entry of 'orbits' that says 'track'"
    if strips and figure in ("partition", "cobweb", "regions"):
        return f"the figure {figure!r} shows pieces in closed form; accepted beside it: a 'partition' of kind closed_form"
    if figure in ("orders", "fit_error") and study.diagonal and not study.diagonal.orders:
        return f"the figure {figure!r} shows fits near the diagonals; accepted beside it: 'orders' in the section 'diagonal'"
    separable = any(piece.fit and piece.fit.separable for piece in study.composite)
    if figure == "separable" and (study.composite or study.partition) and not separable:
        return "the figure 'separable' shows separable fits; accepted beside it: a piece of 'composite' whose fit is one"
    return ""


def check_names(study: Study) -> None:
    """A StudyError at the first name that refers to nothing, or that is given twice."""
    source = study.source
    fitted = [piece.name for piece in study.composite if piece.reset is None]
    if study.partition and study.composite:
        raise source.error(("partition",), "'partition' makes the pieces of 'composite'; accepted: one of the two")
    _once(study, "composite", [piece.name for piece in study.composite])
    _once(study, "domains", [domain.name for domain in study.domains])
    _once(study, "branches", [branch.name for branch in study.branches])
    _check_curves(study)
    if study.diagonal:
        source.known(("diagonal", "family"), study.diagonal.family, study.families, "family")
    for number, piece in enumerate(study.composite):
        if piece.family is not None:
            source.known(("composite", number, "family"), piece.family, study.families, "family")
        if piece.data == DIAGONAL and study.diagonal and piece.family != study.diagonal.family:
            text = f"the section 'diagonal' is of the family {study.diagonal.family!r}, the piece of {piece.family!r}"
            raise source.error(("composite", number, "data"), text)
    for number, domain in enumerate(study.domains):
        if not is_of_partition(study, domain.map):
            made = ["composite"] if study.composite else ["composite", ATTRACTING] if study.partition else []
            source.known(("domains", number, "map"), domain.map, ["exact", *made, *fitted], "map")
    if study.bifurcation and study.partition and "composite" in study.bifurcation.of:
        text = (
            "a partition is made once, and the pieces of a bifurcation at every value; accepted: 'exact', or 'composite' pieces"
        )
        raise source.error(("bifurcation", "of"), text)
    if study.second_iterate:
        of_pieces = [d.name for d in study.domains if d.map in fitted or is_of_partition(study, d.map)]
        source.known(("second_iterate", "domain"), study.second_iterate.domain, of_pieces, "domain of a fitted piece")


def _check_curves(study: Study) -> None:
    """A StudyError at the first curve of a stability diagram that is of no branch along its first parameter, or given twice."""
    if study.stability is None:
        return
    name = study.stability.along.parameter
    accepted = [branch.name for branch in study.branches if branch.parameter == name]
    for number, curve in enumerate(study.stability.curves):
        loc = ("stability", "curves", number)
        study.source.known((*loc, "branch"), curve.branch, accepted, f"branch in {name!r}")
        if curve in study.stability.curves[:number]:
            raise study.source.error(
                loc, f"the curve of {curve.branch!r} and {curve.event!r} is given twice; accepted: each once"
            )


def is_of_partition(study: Study, map: str) -> bool:
    """Whether the map of a domain is that of pieces which the partition names, as R1; whether there is one, the run shows."""
    return study.partition is not None and (map == ATTRACTING or bool(re.fullmatch(r"R\d+", map)))


def _once(study: Study, section: str, names: list[str]) -> None:
    for number, name in enumerate(names):
        if name in names[:number]:
            loc = (section, number, "name")
            raise study.source.error(loc, f"the name {name!r} is given twice; accepted: a name of its own for each")
        if name in ("exact", "composite") and section == "composite":
            raise study.source.error((section, number, "name"), f"a piece cannot be called {name!r}: that is a map")


def _needs(study: Study) -> Iterator[tuple[Loc, str, str]]:
    """Every need as (where it arises, what has it, the section it is for)."""
    if study.families:
        yield ("families",), "'families'", "grid"
    if study.diagonal:
        yield ("diagonal",), "'diagonal'", "families"
    for number, piece in enumerate(study.composite):
        if piece.fit:
            yield ("composite", number), f"the fit of the piece {piece.name!r}", "families"
        if piece.data == DIAGONAL:
            yield ("composite", number, "data"), f"the data of the piece {piece.name!r}", "diagonal"
    for number, domain in enumerate(study.domains):
        if domain.box == DIAGONAL:
            yield ("domains", number, "box"), f"the start box of the domain {domain.name!r}", "diagonal"
    if study.parametric:
        yield ("parametric",), "'parametric'", "composite"
    if study.bifurcation and "composite" in study.bifurcation.of:
        yield ("bifurcation", "of"), "the bifurcation of the composite map", "composite"
    if study.basins:
        yield ("basins",), "'basins'", "grid"
    if study.second_iterate:
        yield ("second_iterate",), "'second_iterate'", "domains"
    if study.transient:
        yield ("transient",), "'transient'", "composite"
    for number, figure in enumerate(study.figures):
        for section in FIGURE_NEEDS[figure]:
            yield ("figures", number), f"the figure {figure!r}", section
    if study.partition:
        yield ("partition",), "'partition'", "grid"
    for verdict, sections in (("covered", ("composite", "grid")), ("tolerance", ("partition",))):
        if verdict in study.require:
            for section in sections:
                yield ("require",), f"the verdict {verdict!r}", section
