"""Versions of installed packages, without the parser of mails that importlib.metadata brings."""

import os
import re
import sys
from functools import cache

METADATA = re.compile(r"(.+?)-(\d[^-]*)(?:\.dist-info|(?:-py\d.*)?\.egg-info)")


def package_version(name: str) -> str:
    """Version of an installed package, "" where there is none; name: as a package registry writes it."""
    return installed_versions().get(re.sub("[-_.]+", "-", name).lower(), "")


@cache
def installed_versions() -> dict:
    """Versions of the installed packages by name, as the names of their metadata folders say them: importlib.metadata
    reads a file of each with a parser of mails, for 20 ms in all."""
    out = {}
    for folder in sys.path:
        try:
            names = os.listdir(folder or ".")
        except OSError:
            continue
        for name in names:
            if there := METADATA.fullmatch(name):
                # the first on the path is imported
                out.setdefault(re.sub("[-_.]+", "-", there[1]).lower(), there[2])
    return out
