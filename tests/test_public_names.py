"""Each folder lists in PUBLIC the names that it offers to other folders."""

import re
from importlib import import_module
from pathlib import Path

import pytest
from import_graph import read_sources

import patchfem as pf

WORDS_BY_FOLDER = {}  # Words in the sources of each folder; modules at the top are folders here.
for module, text in read_sources(Path(__file__).parents[1]).items():
    WORDS_BY_FOLDER.setdefault(module.partition(".")[0], set()).update(re.findall(r"\w+", text))
FOLDERS = [path.parent.name for path in sorted(Path(pf.__file__).parent.glob("*/__init__.py"))]


@pytest.mark.parametrize("folder", FOLDERS)
def test_always_public_names_are_used_by_other_folders(folder):
    """Every name in PUBLIC of a folder is used by another folder and is the object of the module that defines it."""
    package = import_module(f"patchfem.{folder}")
    words = set().union(*(words for name, words in WORDS_BY_FOLDER.items() if name != folder))
    names = [name for listed in package.PUBLIC.values() for name in listed]
    assert len(names) == len(set(names))
    assert set(names) - words == set()
    for module, listed in package.PUBLIC.items():
        for name in listed:
            owner = import_module(f"patchfem.{folder}.{module}")
            assert getattr(package, name) is getattr(owner, name)
