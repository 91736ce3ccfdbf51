"""What the figures of attracting domains share: the kind of a domain with its look and name, which are drawn, and the titles."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from nsmaps.figures.data import held
from nsmaps.figures.style import BLUE, GREEN, MAGENTA, RED

if TYPE_CHECKING:
    from nsmaps.auxiliary.attracting_domain import AttractingDomain

Look = tuple[str, str]  #: colour and marker
_KINDS: Mapping[str, tuple[Look, str]] = {
    "outer": ((BLUE, "o"), "bounded"),
    "enclosed": ((RED, "s"), "enclosed"),
    "sampled": ((GREEN, "^"), "sampled, no bound"),
}  #: by how the numbers of a domain bound it, its look and its name
_OTHER: Look = (MAGENTA, "D")  #: of a polynomial with its error added


def look_of(domain: "AttractingDomain") -> Look:
    """The colour and marker of a kind of domain, the same in all figures."""
    return _KINDS[domain.status][0] if domain.status in _KINDS else _OTHER


def heading(name: str, domain: "AttractingDomain") -> str:
    """The name of a domain in its study, the map that it is of, and its kind: bounded, enclosed, sampled or inflated."""
    kind = _KINDS[domain.status][1] if domain.status in _KINDS else domain.status
    beside = kind if name in domain.of else f"{domain.of}, {kind}"
    return f"{domain.of if name in domain.of else name}: {beside}"


def failed(domains: "Mapping[str, AttractingDomain]") -> str:
    """A sentence on the domains that are not drawn."""
    names = [name for name in domains if name not in held(domains)]
    return f"Not forward invariant: {', '.join(names)}." if names else ""
