"""The commands `nsmaps prove` and `nsmaps verify`."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from nsmaps.cli.drawing import Format
from nsmaps.cli.options import InstalledOnly
from nsmaps.cli.terminal import FAILED, examples, progress_line, reported_errors, say
from nsmaps.errors import NsmapsError
from nsmaps.progress import beat, working

if TYPE_CHECKING:
    from nsmaps.exact.systems.piecewise import PiecewiseMap
    from nsmaps.exact.systems.system import ImpactSystem
    from nsmaps.study.sections.sets.proof import ProofSection
    from nsmaps.study.study import Study
    from nsmaps.verify.certificate import Certificate, Verified
    from nsmaps.verify.maps.proved import VerifiedMap

PROVE = examples("nsmaps prove bouncing_ball/proof", "nsmaps prove mine.yaml --out mine.proof")
PICTURES = tuple(f".{each}" for each in Format)
VERIFY = examples(
    "nsmaps verify proof.proof", "nsmaps verify proof.proof --figure proved.png", "python -m nsmaps.verify proof.proof"
)


def prove(
    study: Annotated[
        str, typer.Argument(metavar="STUDY", help="A YAML file, or an installed study, with a section `proof` or `horseshoe`.")
    ],
    out: Annotated[Path | None, typer.Option(help="The certificate.", show_default="<study>.proof", dir_okay=False)] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")] = False,
    installed_only: InstalledOnly = False,
) -> None:
    """Search for a proof of convergence to a cycle, of arrival in a closed set, or of chaos; write a certificate, and verify it.

    Ctrl-C ends the search after the division of cells that is under way; what was found is kept. Pressed twice it ends at once.
    The exit code is 1 if nothing is proved of any cell.
    """
    with reported_errors(), progress_line(quiet):
        from nsmaps.files.storage import unfinished
        from nsmaps.study.reading.reader import load_study
        from nsmaps.verify.certificate import write_certificate

        read = load_study(study, installed_only=installed_only)
        path = out or Path(f"{read.name.rpartition('/')[2]}.proof")
        with unfinished(path.parent) as beside:  # what cannot be written is known before the search, not after it
            certificate = _found(read)
            write_certificate(beside / path.name, certificate)
            (beside / path.name).replace(path)
        say(f"written to {path}: {path.stat().st_size / 1e3:.3g} kB")
        with _refusal():
            _verified(certificate)


def _found(study: "Study") -> "Certificate":
    """The certificate of what the sections of a study ask for."""
    from nsmaps.exact.systems.piecewise import PiecewiseMap
    from nsmaps.proof.formula import provable
    from nsmaps.proof.horseshoe import prove_horseshoe

    parts, spec, chaos = [], study.proof, study.horseshoe
    if spec is None and chaos is None:
        raise NsmapsError(
            f"the study {study.name} names no proof; expected: a section 'proof' with a start near an attractor, or 'horseshoe'"
        )
    system = provable(study.system_object())
    if chaos is not None:
        parts.append(prove_horseshoe(system, **chaos.model_dump()))
    if spec is not None:
        cycles = [(cycle.start, cycle.period) for cycle in spec.cycles]
        parts.append(_of_map(system, spec, cycles) if isinstance(system, PiecewiseMap) else _of_flights(system, spec, cycles))
    return replace(parts[-1], horseshoe=parts[0].horseshoe)


def _of_map(system: "PiecewiseMap", spec: "ProofSection", cycles: list[Any]) -> "Certificate":
    """The certificate of a map by formulas: of the cycle at the start, or of a closed set."""
    from nsmaps.proof.maps.prove import prove_map

    if spec.closed_set is None:
        return prove_map(system, cycles=[(spec.start, spec.period), *cycles])
    about = spec.closed_set
    return prove_map(
        system,
        cycles=cycles,
        start=spec.start,
        box=about.box,
        n_cells=about.n_cells,
        n_parts=about.n_parts,
        transient=about.transient,
    )


def _of_flights(system: "ImpactSystem", spec: "ProofSection", cycles: list[Any]) -> "Certificate":
    """The certificate of a system with impacts: of convergence to a cycle, or of a closed set."""
    from nsmaps.proof.closed import Around
    from nsmaps.proof.prove import prove as search

    options = spec.model_dump(exclude={"start", "cycles", "closed_set"})
    around = Around(**spec.closed_set.model_dump(include={"depth", "transient", "n_samples"})) if spec.closed_set else None
    return search(system, spec.start, options.pop("period"), cycles=cycles, around=around, **options)


def verify(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A certificate that `nsmaps prove` wrote.", dir_okay=False)],
    figure: Annotated[
        Path | None,
        typer.Option(help="A picture of the cells that are proved, such as proved.png, .pdf or .svg.", dir_okay=False),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")] = False,
) -> None:
    """Verify a certificate: compute all it claims again, in ball arithmetic and doubles with bounds of all rounding.

    The exit code is 0 if it is proved, 1 if it is refused or if nothing is proved of any cell.
    """
    with reported_errors(), progress_line(quiet):
        from nsmaps.verify.certificate import Verified, read

        if figure is not None and figure.suffix not in PICTURES:
            raise NsmapsError(f"--figure is {str(figure)!r}; expected: a name that ends with {', '.join(PICTURES)}")
        with _refusal():
            certificate = read(file)
            if figure is not None and (not certificate.grid or "pieces" in certificate.system):
                raise NsmapsError(f"{figure} is not drawn: it is of cells of phase and speed; expected: a certificate with these")
            found = _verified(certificate)
        if figure is not None and isinstance(found, Verified):
            say(f"drawn to {_drawn(certificate, found, figure)}")


@contextmanager
def _refusal() -> Iterator[None]:
    """A certificate that is refused ends the program with the reason."""
    from nsmaps.verify.cells import CertificateError

    try:
        yield
    except CertificateError as refused:
        say(f"refused: {refused}", err=True)
        raise typer.Exit(FAILED) from None


def _verified(certificate: "Certificate") -> "Verified | VerifiedMap":
    """Verify a certificate and print the theorem."""
    from nsmaps.verify.certificate import Verified, statement
    from nsmaps.verify.certificate import verify as prove_again

    with working("verification"):
        found = prove_again(certificate, lambda done, total: beat(done / total, f"{done} of {total}"))
    say("as the file says: " + "; ".join(f"{name}: {value}" for name, value in certificate.about.items()))
    say(statement(found, certificate))
    say("seconds for cycles and horseshoe, trap, cells: " + ", ".join(f"{t:.1f}" for t in found.seconds))
    if isinstance(found, Verified) and found.is_empty:
        raise typer.Exit(FAILED)
    return found


def _drawn(certificate: "Certificate", found: "Verified", path: Path) -> Path:
    """The picture of a certificate of cells."""
    from nsmaps.cells.certified import Orders
    from nsmaps.figures.cells.proved import sheet

    impacts = [
        (wall, float(phase), float(speed), cycle.kind == "stable")
        for cycle in found.cycles
        for wall, (phase, speed) in zip(cycle.walls, cycle.states, strict=True)
    ]
    trap = certificate.trap
    impacts += [(trap["wall"], *trap["centre"], True)] if trap else []
    drawn = sheet(Orders.of(certificate), impacts, path.stem, "trap" if trap else "closed set")
    return drawn.save(path.parent, (path.suffix[1:],), 300)[0]
