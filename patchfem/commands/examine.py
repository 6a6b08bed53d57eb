"""Check of an installation: available and missing parts, with the command that adds each."""

import os
import sys
from shutil import which
from typing import NamedTuple

from .. import __version__, kernel_cache
from ..disk.installed import find_package_version

# Packages that pyproject.toml requires; an older installation may lack new ones.
REQUIRED_PACKAGES = (
    "numpy",
    "scipy",
    "scikit-fem",
    "meshio",
    "pyvista",
    "numba",
    "matplotlib",
    "pydantic",
    "cyclopts",
    "rich",
    "xarray",
    "h5netcdf",
    "h5py",
    "jinja2",
    "threadpoolctl",
    "contourpy",
)
# Optional packages: extra of patchfem that installs each, and what it is for
OPTIONAL_PACKAGES = {
    "pyuff": ("lab", "universal files"),
    "nbclient": ("notebook", "the notebooks of studies/notebooks"),
    "SurfaceTopography": ("profiles", "files of more instruments"),
    "distributed": ("cluster", "sweeps over several machines"),
    "trame": ("web", "fields in a browser"),
}


class Finding(NamedTuple):
    """Result of a check of the installation.

    - name: what was checked.
    - fine: whether the check passed.
    - found: what was found.
    - cure: remedy, or "" if none is needed.
    """

    name: str
    fine: bool
    found: str
    cure: str


def check_installation() -> list[Finding]:
    """Check everything that a run may need."""
    required = [_check_package(name, name, name, "") for name in REQUIRED_PACKAGES]
    optional = []
    for name, (extra, purpose) in OPTIONAL_PACKAGES.items():
        source = f'"patchfem[{extra}]"'
        optional.append(_check_package(name, f"{name} ({purpose})", source, ", optional"))
    python = Finding("python", sys.version_info >= (3, 11), sys.version.split()[0], "")
    program = Finding("patchfem", True, __version__, "")
    return [python, program, *required, _check_cache(), _count_threads(), _check_films(), *optional]


def _check_package(name: str, label: str, source: str, remark: str) -> Finding:
    """Check whether a package is installed.

    Parameters
    ----------
    name, label : str
        Name of the distribution, and the words for it in the report.
    source : str
        What pip installs.
    remark : str
        Text that follows the words for a missing package.
    """
    version = find_package_version(name)
    cure = "" if version else f"pip install {source}"
    return Finding(label, bool(version), version or f"not installed{remark}", cure)


def _check_cache() -> Finding:
    """Check the cache of compiled code, without which every command would compile again."""
    folder, reason = kernel_cache.find_cache_folder()
    sizes = [path.stat().st_size for path in folder.rglob("*") if path.is_file()]
    text = f"{len(sizes)} files, {sum(sizes) / 1e6:.1f} MB in {folder}"
    cure = reason and f"{reason}; set PATCHFEM_CACHE to another folder"
    return Finding("compiled code", not reason, text, cure)


def _count_threads() -> Finding:
    """Return the number of cores that can be used."""
    try:
        cores = len(os.sched_getaffinity(0))
    except AttributeError:  # this function does not exist on every system
        cores = os.cpu_count() or 1
    text = (
        f"{cores} of {os.cpu_count()} cores can be used; with -j {cores} a sweep uses all of these"
    )
    return Finding("threads", True, text, "")


def _check_films() -> Finding:
    """Check whether a film of the last cycle can be written as .mp4 (patchfem view)."""
    version = find_package_version("imageio-ffmpeg")
    if which("ffmpeg") or version:
        source = "by ffmpeg" if which("ffmpeg") else f"imageio-ffmpeg {version}"
        return Finding("films (.mp4)", True, source, "")
    cure = "run pip install imageio-ffmpeg, or write .gif or .html, which need no ffmpeg"
    return Finding("films (.mp4)", False, "neither ffmpeg nor imageio-ffmpeg, optional", cure)
