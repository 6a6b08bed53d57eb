"""The command that converts laboratory files into forms that scenes and fits read."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..export.lab import imported
from .shared import Json, flag_option, note, repeated_option, required_out_option, text_option


@dataclass(frozen=True)
class EstimateArguments:
    """Options of the identification of modes."""

    band: text_option('frequency band in which to find modes, such as "20 Hz..400 Hz"') = ""
    decay: flag_option(
        "treat the record as a free decay; frequency and damping are then computed without a record of the "
        "input"
    ) = False
    begin: text_option(
        'time at which the free decay begins, such as "0.2 s"; default: time of the largest '
        "value of the record"
    ) = ""


def import_(
    file: Path,
    /,
    *,
    out: required_out_option(
        "file to write: table.csv (records in SI) or modes.toml (modes for a scene)"
    ),
    map_: repeated_option(
        'quantity and name of a channel of the file, such as "force=Load cell [lbf]", '
        '"displacement=12:+x", "time=t [s]", "force=run.load(:,2) [N]"; may be repeated; without this option the labels of '
        "the channels are used",
        "--map",
    ) = (),
    zero: flag_option(
        "subtract the time and the displacement of the first row from all rows"
    ) = False,
    modes: Annotated[EstimateArguments, Parameter(name="*")] = EstimateArguments(),
    json_: Json = False,
):
    """Convert a laboratory file into a table or into the modes of a scene. The table can be used as `drive.file`, as
    `slide.file` and with `fit --to`. The laboratory file may be .uff (datasets 58, with the units of dataset 164),
    .mat, or .csv with units in its header. Modes are computed from an input and a response, or from a free decay; a
    file of mode shapes is given as `structure.file`. With --decay the table gives
    frequency and damping ratio of the decay against its amplitude, with 95 % intervals.

    Example: patchfem import bench.uff --map "force=Load cell [lbf]" --map displacement=12:+x -o loop.csv
    """
    conversion = imported.convert_file(
        file, out, map_, zero, imported.EstimateOptions(**vars(modes))
    )
    summary = conversion.pop("told")
    if json_:
        print(json.dumps({"file": str(out), **conversion}, ensure_ascii=False))
        return
    for text in conversion["notes"]:
        note(text)
    print(f"{out}: {summary}")
