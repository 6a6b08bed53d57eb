"""Any file of a laboratory as `Records`, by its ending."""

from pathlib import Path

from ...core import PatchfemError
from . import matlab, table, universal
from .records import Records, chosen

UNIVERSAL = (".uff", ".unv", ".uf", ".58")
ENDINGS = (*UNIVERSAL, ".mat", ".csv", ".txt")


def read_records(path, asked: list) -> Records:
    """Records over time of a file, in SI; asked: `Wanted` channels, none to take those that say what they are.

    PatchfemError names the file and what is wanted, Missing where there is no file.
    """
    path = Path(path)
    ending, notes = path.suffix.lower(), []
    if ending == ".mat":
        return matlab.read(path, asked)
    if ending in UNIVERSAL:
        sets = universal.sets_of(path)
        return of_sets(path, sets, asked)
    if ending in ENDINGS:
        return chosen(path, table.channels(path), asked, notes)
    raise PatchfemError(f"{path}: files that are imported end in {', '.join(ENDINGS)}")


def of_sets(path, sets: list, asked: list) -> Records:
    """Records over time among the datasets of a universal file; PatchfemError where there is none."""
    notes = []
    there = universal.channels(path, sets, notes)
    if not there:
        raise PatchfemError(f"{path}: no record over time (dataset 58 of function type 1); what it holds is modes or "
                            "frequency responses, which become a scene's modes: -o modes.toml")
    return chosen(path, there, asked, notes)
