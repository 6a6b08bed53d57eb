"""The verb that brings a laboratory's files into the forms that scenes and fits read."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from .. import core, scales
from ..disk import whole
from ..export.lab import modes as mode_lines
from ..export.lab import write
from ..identify import measured_modes
from ..identify import measured_modes as measured
from ..inputs import laboratory, records
from ..inputs import universal as universal_files
from ..structure import universal as universal_modes
from .shared import Json, Refused, flag, note, quantity, texts, word


@dataclass(frozen=True)
class Estimate:
    """Options of a frequency response and its modes."""

    segment: word("length of the segments of the estimate, such as \"2 s\" [the whole record where it begins and ends "
                  "in rest, else an eighth]") = ""
    window: word("hann or none, such as none [hann where the record is cut into segments]") = ""
    band: word("where modes are sought, such as \"20 Hz..400 Hz\"") = ""
    decay: flag("the record is a free decay: frequency and damping without an input") = False
    begin: word("where the free decay begins, such as \"0.2 s\" [at its largest value]") = ""


def import_(file: Path, /, *, out: Annotated[Path, Parameter(
        name=["-o", "--out"], help="table.csv of the records in SI, modes.toml for a scene, response.uff")],
            map_: texts('which channel of the file is what: "force=Load cell [lbf]", "displacement=12:+x", "time=t '
                        '[s]", "force=run.load(:,2) [N]"; of shapes: slide=12:+x; may be repeated; without it channels '
                        'are taken that say so themselves', "--map") = (),
            zero: flag("count time and displacement from their first row") = False,
            modes: Annotated[Estimate, Parameter(name="*")] = Estimate(), json_: Json = False):
    """Turn the records of a laboratory file (.uff: datasets 58 in the units of 164; .mat; .csv with units in its
    header) into the table that drive.file, slide.file and fit --to read, or into modes: of an input and a response, of
    a free decay, of shapes (dataset 55) or frequency responses. With --decay the table has the frequency and damping
    ratio of the decay over its amplitude, with intervals of 95 %, which fit --to reads as well.

    Example: patchfem import bench.uff --map "force=Load cell [lbf]" --map displacement=12:+x -o loop.csv
    """
    ending = out.suffix.lower()
    if ending not in (".csv", ".toml", ".uff", ".unv"):
        raise Refused(f"{out}: records are written as .csv, modes as .toml, a frequency response as .uff")
    if ending == ".csv" and modes != Estimate(decay=modes.decay, begin=modes.begin if modes.decay else ""):
        raise Refused("--segment, --window, --band and, without --decay, --begin belong to modes (-o modes.toml) and "
                      "responses (-o response.uff)")
    if zero and modes.decay:
        raise Refused("--zero belongs to a table of records, not to what --decay reads off it")
    if zero and ending != ".csv":
        raise Refused("--zero belongs to a table of records (-o table.csv)")
    if ending == ".csv":
        answer = _decay(file, out, map_, modes.begin) if modes.decay else _table(file, out, map_, zero)
    else:
        answer = (_modes if ending == ".toml" else _response)(file, out, map_, modes)
    told = answer.pop("told")
    if json_:
        print(json.dumps({"file": str(out), **answer}, ensure_ascii=False))
        return
    for text in answer["notes"]:
        note(text)
    print(f"{out}: {told}")


def _table(file: Path, out: Path, asked, zero: bool) -> dict:
    found = laboratory.read_records(file, records.wanted(asked))
    values = records.from_zero(found.values) if zero else found.values
    units = {name: records.SI[name] for name in values}
    write.write_table(out, values, units)
    rows = len(next(iter(values.values())))
    moved = [f"{name} starts at {values[name][0]:g} {records.SI[name]}" for name in ("time", "displacement", "lateral")
             if "displacement" in values and name in values and values[name][0] != 0]
    notes = [*found.notes, *([f"{', '.join(moved)}: slide.file wants a table that starts at 0; --zero counts from the "
                              "first row"] if moved else [])]
    return {"rows": rows, "units": units, "notes": notes, "told": f"{rows} rows of {', '.join(values)}"}


def _decay(file: Path, out: Path, asked, begin: str) -> dict:
    values, notes = _records(file, asked)
    found = measured.decay_curve(values, quantity(begin, "time", f"--begin {begin}"))
    write.write_table(out, {f"decay_{name}": one for name, one in found._asdict().items()},
                      {f"decay_{name}": unit for name, unit in write.DECAY.items()})
    ends = [f"{scales.told(found.frequency[k], found.frequency_error[k], unit='Hz')} with a damping ratio of "
            f"{scales.told(found.damping[k], found.damping_error[k])} at {scales.short(found.amplitude[k], 'm', 3)}"
            for k in (0, -1)]
    return {"points": found.time.size, **{f"decay_{name}": one.tolist() for name, one in found._asdict().items()},
            "notes": notes, "told": f"{found.time.size} amplitudes, from {ends[0]} to {ends[1]}"}


def _modes(file: Path, out: Path, asked, how: Estimate) -> dict:
    shapes, notes = _shapes(file, asked, how)
    if shapes is not None:
        found = measured.of_shapes(*shapes)
    else:
        values, notes = _records(file, asked)
        found = measured.of_decay(values, quantity(how.begin, "time", f"--begin {how.begin}")) if how.decay else \
            measured.of_drive(values, _segment(how.segment), _window(how.window), _band(how.band))
    whole.write_text(out, mode_lines.fragment(found, file.name))
    listed = [{"frequency": f, "damping": zeta, "about": about} for f, zeta, about in
              zip(found.frequency.tolist(), found.damping.tolist(), found.about)]
    told = "; ".join(f"{one['frequency']:.5g} Hz with a damping of {one['damping']:.4g}" for one in listed)
    return {"modes": listed, "moving_mass": found.mass, "notes": [*notes, *found.notes], "told": told}


def _response(file: Path, out: Path, asked, how: Estimate) -> dict:
    if how.decay or how.begin or how.band:
        raise Refused("--decay, --begin and --band belong to modes (-o modes.toml)")
    values, notes = _records(file, asked)
    found, step, drive, response = measured_modes.estimated(values, _segment(how.segment), _window(how.window))
    write.write_response(out, found, drive, response)
    return {"lines": found.frequency.size, "segments": found.segments, "window": found.window, "notes": notes,
            "told": f"{response} over {drive}, {found.frequency.size} lines from {found.segments} segments of "
                    f"{found.segment * step:.4g} s, window {found.window}"}


def _records(file: Path, asked) -> tuple:
    found = laboratory.read_records(file, records.wanted(asked))
    return found.values, found.notes


def _shapes(file: Path, asked, how: Estimate) -> tuple:
    """((shapes, places), notes) of a universal file with modes or frequency responses; (None, ()) of any other."""
    names = {text.partition("=")[0].strip() for text in asked}
    if file.suffix.lower() not in laboratory.UNIVERSAL or how != Estimate() or names & set(records.UNITS):
        return None, ()
    if not any(one["type"] == 55 or int(one.get("func_type", 0)) == 4 for one in universal_files.sets_of(file)):
        return None, ()
    try:
        shapes = universal_modes.read(file)
    except core.PatchfemError as error:
        raise type(error)(str(error).removeprefix("structure.file: ")) from None
    return (shapes, {one.quantity: one.source for one in records.wanted(asked, measured_modes.PLACES)}), ()


def _segment(text: str) -> float | None:
    return quantity(text, "time", f"--segment {text}")


def _window(text: str) -> str | None:
    if text not in ("", "hann", "none"):
        raise Refused(f"--window {text}: hann or none")
    return text or None


def _band(text: str) -> tuple:
    if not text:
        return (0.0, float("inf"))
    low, dots, high = text.partition("..")
    ends = [quantity(one, "frequency", f"--band {one}") for one in (low.strip(), high.strip()) if dots]
    if not ends or None in ends or not 0 <= ends[0] < ends[1]:
        raise Refused(f'--band {text}: two rising frequencies are wanted, such as "20 Hz..400 Hz"')
    return tuple(ends)
