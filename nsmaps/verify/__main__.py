"""`python -m nsmaps.verify FILE`: verify a certificate; exit code 0, or 1 if it is refused or proves nothing of any cell."""

import sys
from pathlib import Path

from nsmaps.verify.cells import CertificateError
from nsmaps.verify.certificate import Verified, read, statement, verify


def main(path: str) -> int:
    """Print what is proved, or why it is not."""
    try:
        certificate = read(Path(path))
        print("As the file says: " + "; ".join(f"{name}: {value}" for name, value in certificate.about.items()))
        found = verify(certificate, lambda done, total: print(f"\r{done} of {total}", end="", file=sys.stderr))
    except CertificateError as refused:
        print(f"\nRefused: {refused}")
        return 1
    print(f"\n{statement(found, certificate)}")
    print("Seconds for cycles and horseshoe, trap, cells: " + ", ".join(f"{t:.1f}" for t in found.seconds))
    return int(isinstance(found, Verified) and found.is_empty)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]) if len(sys.argv) == 2 else "one certificate is expected: python -m nsmaps.verify FILE")
