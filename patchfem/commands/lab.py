"""The verb that brings a laboratory's files into the forms that scenes and fits read."""

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from .shared import Json, Refused, flag, say, texts


def import_(file: Path, /, *, out: Annotated[Path, Parameter(name=["-o", "--out"], help="table.csv in SI")],
            map_: texts('which channel of the file is what: "force=Load cell [lbf]", "displacement=12:+x", "time=t '
                        '[s]", "force=data(:,2) [N]"; may be repeated; without it channels are taken that say so '
                        'themselves', "--map") = (),
            zero: flag("count time and displacement from their first row") = False, json_: Json = False):
    """Turn the records of a laboratory file (.uff: datasets 58 in the units of 164; .mat of version 5 to 7; .csv with
    units in its header) into the table that drive.file, slide.file and fit --to read.

    Example: patchfem import bench.uff --map "force=Load cell [lbf]" --map displacement=12:+x -o loop.csv
    """
    from ..inputs.lab.read import read_records
    from ..inputs.lab.records import SI, from_zero, wanted

    if out.suffix.lower() != ".csv":
        raise Refused(f"{out}: records are written as .csv")
    found = read_records(file, wanted(map_))
    values = from_zero(found.values) if zero else found.values
    from ..export.lab.write import write_table

    write_table(out, values, {name: SI[name] for name in values})
    rows = len(next(iter(values.values())))
    if json_:
        print(json.dumps({"file": str(out), "rows": rows, "units": {name: SI[name] for name in values},
                          "notes": found.notes}, ensure_ascii=False))
        return
    for note in found.notes:
        say(f"note: {note}")
    print(f"{out}: {rows} rows of {', '.join(values)}")
