"""Each folder lists in PUBLIC the names that it offers to other folders."""

import re
from importlib import import_module
from pathlib import Path

import pytest
from import_graph import read_sources

SOURCES = read_sources(Path(__file__).parents[1])
FOLDERS = sorted({name.partition(".")[0] for name in SOURCES if "." in name})


@pytest.mark.parametrize("folder", FOLDERS)
def test_always_public_names_are_used_by_other_folders(folder):
    """Every name in PUBLIC of a folder is used by another folder and is the object of the module that defines it."""
    package = import_module(f"patchfem.{folder}")
    text_of_others = "\n".join(
        text for module, text in SOURCES.items() if module.partition(".")[0] != folder
    )
    words = set(re.findall(r"\w+", text_of_others))
    names = [name for listed in package.PUBLIC.values() for name in listed]
    assert len(names) == len(set(names))
    assert set(names) - words == set()
    for module, listed in package.PUBLIC.items():
        for name in listed:
            owner = import_module(f"patchfem.{folder}.{module}")
            assert getattr(package, name) is getattr(owner, name)
