"""Versions of installed packages, read from the names of their metadata folders.

`importlib.metadata` reads a file of each package instead, which takes 20 ms in all.
"""

import os
import re
import sys
from functools import cache

# Pattern of the name of a metadata folder: package and version
METADATA_PATTERN = re.compile(r"(.+?)-(\d[^-]*)(?:\.dist-info|(?:-py\d.*)?\.egg-info)")


def find_package_version(name: str) -> str:
    """Return the version of a package by its registry name; "" if it is not installed."""
    return list_installed_versions().get(_normalise_name(name), "")


@cache
def list_installed_versions() -> dict[str, str]:
    """Return the versions of the installed packages by their normalised names."""
    versions = {}
    for folder in sys.path:
        try:
            names = os.listdir(folder or ".")
        except OSError:
            continue
        for name in names:
            if match := METADATA_PATTERN.fullmatch(name):
                # Python imports the first package on the path.
                package, version = match.groups()
                versions.setdefault(_normalise_name(package), version)
    return versions


def _normalise_name(name: str) -> str:
    """Return the normalised name of a package (PEP 503)."""
    return re.sub("[-_.]+", "-", name).lower()
