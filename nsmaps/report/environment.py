"""What nsmaps runs on, for a report of an error."""

import os
from importlib.metadata import PackageNotFoundError, version

from nsmaps.study.store.archive import versions

OPTIONAL = ("rich", "xarray", "h5netcdf", "h5py", "dask", "distributed", "heyoka", "diffrax", "scikit-sundae")
THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS")


def environment() -> dict[str, str]:
    """Versions of what must be and of what may be there, cores, settings of threads, and the folder of kernels.

    Only NumPy is imported.
    """
    from nsmaps.exact.compiling.kept import cache_folder

    settings = [f"{name}={os.environ[name]}" for name in THREADS if name in os.environ]
    return {
        **versions(),
        **{name: _version(name) for name in OPTIONAL},
        "cores": str(os.cpu_count()),
        "threads": ", ".join(settings) or "as libraries choose",
        "kernels": str(cache_folder()),
    }


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def show_versions() -> None:
    """Print the versions of Python, nsmaps, its required and optional packages, and the platform, for a report of an error."""
    for name, found in environment().items():
        print(f"{name:16s} {found}")
