"""What the figures of attracting domains share: the kind of a domain with its look and name."""

from collections.abc import Mapping

from nsmaps.auxiliary.attracting_domain import AttractingDomain
from nsmaps.figures.style import BLUE, GREEN, MAGENTA, RED

Domains = AttractingDomain | Mapping[str, AttractingDomain]  #: one, or several by name
Look = tuple[str, str]  #: colour and marker
_KINDS: Mapping[str, tuple[Look, str]] = {
    "outer": ((BLUE, "o"), "bounded"),
    "enclosed": ((RED, "s"), "enclosed"),
    "sampled": ((GREEN, "^"), "sampled, no bound"),
}  #: by how the numbers of a domain bound it, its look and its name
_OTHER: Look = (MAGENTA, "D")  #: of a polynomial with its error added


def by_name(domains: Domains) -> Mapping[str, AttractingDomain]:
    """Domains by name; one alone by the map that it is of."""
    return {domains.of: domains} if isinstance(domains, AttractingDomain) else domains


def look_of(domain: AttractingDomain) -> Look:
    """The colour and marker of a kind of domain, the same in all figures."""
    return _KINDS[domain.status][0] if domain.status in _KINDS else _OTHER


def heading(name: str, domain: AttractingDomain) -> str:
    """The name of a domain in its study, the map that it is of, and its kind: bounded, enclosed, sampled or inflated."""
    kind = _KINDS[domain.status][1] if domain.status in _KINDS else domain.status
    beside = kind if name in domain.of else f"{domain.of}, {kind}"
    return f"{domain.of if name in domain.of else name}: {beside}"
