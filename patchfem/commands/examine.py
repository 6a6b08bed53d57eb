"""Check of an installation: available and missing parts, with the command that adds each."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from shutil import which
from typing import NamedTuple

from .. import __version__, compiled

PICTURE = """\
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(32, 32))
plotter.add_mesh(pyvista.Sphere())
assert plotter.screenshot(None, return_img=True).std() > 0
"""
MAX_PICTURE_SECONDS = 60  # time limit of the test picture [s], for a slow disk
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
OPTIONAL_PACKAGES = {
    "pyuff": ("lab", "universal files"),
    "nbclient": ("notebook", "the notebooks of studies/notebooks"),
    "SurfaceTopography": ("profiles", "files of more instruments"),
    "distributed": ("cluster", "sweeps over several machines"),
    "trame": ("web", "fields in a browser"),
}


class Finding(NamedTuple):
    """Result of a check: its name, whether it passed, the finding, and the remedy ("" if none is needed)."""

    name: str
    fine: bool
    found: str
    cure: str


def check_installation() -> list[Finding]:
    """Check everything that a run may need, including pictures, which a separate process draws."""
    return [*_packages(), _cache(), _threads(), _window(), _film(), *_extras()]


def _packages() -> Iterator[Finding]:
    """Check the required packages."""
    yield Finding("python", sys.version_info >= (3, 11), sys.version.split()[0], "")
    yield Finding("patchfem", True, __version__, "")
    for name in REQUIRED_PACKAGES:
        version = _version(name)
        yield Finding(
            name,
            bool(version),
            version or "not installed",
            "" if version else f"pip install {name}",
        )


def _version(name: str) -> str:
    """Return the version of a package, or "" if it is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def _cache() -> Finding:
    """Check the cache of compiled code, without which every command would compile again."""
    folder = compiled.cache_folder()
    reason = compiled.explain_cache_folder()
    sizes = [path.stat().st_size for path in folder.rglob("*") if path.is_file()]
    return Finding(
        "compiled code",
        not reason,
        f"{len(sizes)} files, {sum(sizes) / 1e6:.1f} MB in {folder}",
        reason and f"{reason}; set PATCHFEM_CACHE to another folder",
    )


def _threads() -> Finding:
    """Return the number of cores that can be used."""
    try:
        cores = len(os.sched_getaffinity(0))
    except AttributeError:  # this function does not exist on every system
        cores = os.cpu_count() or 1
    return Finding(
        "threads",
        True,
        f"{cores} of {os.cpu_count()} cores can be used; with -j {cores} a sweep uses all of these",
        "",
    )


def _window() -> Finding:
    """Check whether the window of patchfem view can be drawn."""
    try:
        process = subprocess.run(
            [sys.executable, "-P", "-c", PICTURE],
            capture_output=True,
            text=True,
            timeout=MAX_PICTURE_SECONDS,
        )
        last_line = (process.stderr.strip().splitlines() or ["it crashed"])[-1]
        # VTK begins the line with its time.
        reason = re.sub(r"^.*\b(?:WARN|ERR)\| ", "", last_line)[:100]
        is_drawn = process.returncode == 0
    except (OSError, subprocess.TimeoutExpired) as error:
        is_drawn = False
        reason = str(error)[:100]

    remedy = (
        ""
        if is_drawn
        else (
            "run apt-get install libgl1 libxcursor1 on a machine with a screen, or write a picture "
            "(view -o FILE.png), which needs neither package"
        )
    )
    return Finding("the window by OpenGL", is_drawn, "drawn" if is_drawn else reason, remedy)


def _film() -> Finding:
    """Check whether a film of the last cycle can be written as .mp4 (patchfem view)."""
    program = which("ffmpeg")
    writer = (
        "by ffmpeg"
        if program
        else _version("imageio-ffmpeg") and f"imageio-ffmpeg {_version('imageio-ffmpeg')}"
    )
    return Finding(
        "films (.mp4)",
        bool(writer),
        writer or "neither ffmpeg nor imageio-ffmpeg, optional",
        ""
        if writer
        else "run pip install imageio-ffmpeg, or write .gif or .html, which need no ffmpeg",
    )


def _extras() -> Iterator[Finding]:
    """Check the optional packages."""
    for name, (extra, purpose) in OPTIONAL_PACKAGES.items():
        version = _version(name)
        yield Finding(
            f"{name} ({purpose})",
            bool(version),
            version or "not installed, optional",
            "" if version else f'pip install "patchfem[{extra}]"',
        )
