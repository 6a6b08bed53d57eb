"""The verb that brings a laboratory's files into the forms that scenes and fits read."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..export.lab import imported
from .shared import Json, flag, note, texts, word


@dataclass(frozen=True)
class Estimate:
    """Options of a frequency response and its modes."""

    segment: word('length of the averaged segments, such as "2 s" [the whole record if it begins and ends at rest, '
                  "else an eighth]") = ""
    window: word("window of the segments, hann or none, such as none [hann if the record is cut into segments]") = ""
    band: word('frequency band in which to find modes, such as "20 Hz..400 Hz"') = ""
    decay: flag("read the record as a free decay, which gives frequency and damping without an input") = False
    begin: word("where the free decay begins, such as \"0.2 s\" [at its largest value]") = ""


def import_(file: Path, /, *, out: Annotated[Path, Parameter(
        name=["-o", "--out"], help="output: table.csv (records in SI), modes.toml (modes for a scene) or "
                                   "response.uff")],
            map_: texts('quantity of a channel of the file: "force=Load cell [lbf]", "displacement=12:+x", "time=t '
                        '[s]", "force=run.load(:,2) [N]"; for shapes: slide=12:+x; may be repeated; without this '
                        'option the labels of the channels are used', "--map") = (),
            zero: flag("subtract the first row from time and displacement") = False,
            modes: Annotated[Estimate, Parameter(name="*")] = Estimate(), json_: Json = False):
    """Convert a laboratory file (.uff: datasets 58 in the units of 164; .mat; .csv with units in its header) into the
    table that drive.file, slide.file and fit --to read, or into modes of a scene. Modes come from an input and a
    response, from a free decay, from mode shapes (dataset 55) or from frequency responses. With --decay the table has
    the frequency and damping ratio of the decay over its amplitude, with 95 % intervals; fit --to reads it as well.

    Example: patchfem import bench.uff --map "force=Load cell [lbf]" --map displacement=12:+x -o loop.csv
    """
    answer = imported.imported(file, out, map_, zero, imported.Estimate(**vars(modes)))
    told = answer.pop("told")
    if json_:
        print(json.dumps({"file": str(out), **answer}, ensure_ascii=False))
        return
    for text in answer["notes"]:
        note(text)
    print(f"{out}: {told}")
