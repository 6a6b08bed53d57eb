"""Import of laboratory files: as a table for scenes and fits, as modes, or as a response."""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from ... import formatting
from ...core import PatchfemError
from ...disk import atomic_write
from ...identify import measured_modes as measured
from ...inputs import laboratory, records
from ...inputs import universal as universal_files
from ...inputs.units import CHANNEL_UNITS, SI_UNITS
from ...scene.keys import quantities
from ...structure import universal as universal_modes
from . import modes as mode_lines
from . import write

# Names of columns in files of `patchfem export`.
OUTPUT = {"displacement": ("output_displacement", "relative_displacement", "slide")}


class Estimate(NamedTuple):
    """Settings for the estimate of modes or of a response; "" stands for the default.

    Attributes
    ----------
    segment : str
        Length of a segment, such as "2 s".
    window : str
        "hann" or "none".
    band : str
        Frequencies, such as "20 Hz..400 Hz".
    decay : bool
        Whether the record is a free decay.
    begin : str
        Time at which it begins, such as "0.2 s".
    """

    segment: str = ""
    window: str = ""
    band: str = ""
    decay: bool = False
    begin: str = ""


def convert_file(file: Path, out: Path, asked: Iterable[str], zero: bool, how: Estimate) -> dict:
    """Write the records (.csv), modes (.toml) or response (.uff) of a file.

    Parameters
    ----------
    file : Path
    out : Path
    asked : iterable of str
        Channels as in `patchfem import --map`.
    zero : bool
        Whether time and displacement are measured from their first row.
    how : Estimate

    Returns
    -------
    dict
        `notes`, the sentence `told`, and what was found.

    Raises
    ------
    PatchfemError
        If options do not fit together.
    """
    ending = out.suffix.lower()
    if ending not in (".csv", ".toml", ".uff", ".unv"):
        raise PatchfemError(
            f"{out}: records are written as .csv, modes as .toml, a frequency response as .uff"
        )
    if ending == ".csv" and how != Estimate(decay=how.decay, begin=how.begin if how.decay else ""):
        raise PatchfemError(
            "--segment, --window, --band and, without --decay, --begin can be used only for modes (-o "
            "modes.toml) and responses (-o response.uff)"
        )
    if zero and how.decay:
        raise PatchfemError(
            "--zero can be used only when importing a table of records, not with --decay"
        )
    if zero and ending != ".csv":
        raise PatchfemError(
            "--zero can be used only when importing a table of records (-o table.csv)"
        )
    if ending == ".csv":
        return (
            _write_decay(file, out, asked, how.begin)
            if how.decay
            else _write_table(file, out, asked, zero)
        )
    return (_write_modes if ending == ".toml" else _write_response)(file, out, asked, how)


def _write_table(file: Path, out: Path, asked, zero: bool) -> dict:
    """Write records as a table."""
    found = laboratory.read_records(file, records.parse_requests(asked))
    values = records.shift_to_zero(found.values) if zero else found.values
    units = {name: SI_UNITS[name] for name in values}
    write.write_table(out, values, units)
    rows = len(next(iter(values.values())))
    moved = [
        f"{name} starts at {values[name][0]:g} {SI_UNITS[name]}"
        for name in ("time", "displacement", "lateral")
        if "displacement" in values and name in values and values[name][0] != 0
    ]
    notes = [
        *found.notes,
        *(
            [
                f"{', '.join(moved)}: slide.file needs a table that starts at 0; use --zero to subtract "
                "the first row"
            ]
            if moved
            else []
        ),
    ]
    return {
        "rows": rows,
        "units": units,
        "notes": notes,
        "told": f"{rows} rows of {', '.join(values)}",
    }


def _write_decay(file: Path, out: Path, asked, begin: str) -> dict:
    """Write frequency and damping of a free decay as a table."""
    values, notes = _read_records(file, asked)
    found, more = measured.compute_decay_curve(
        values, _parse_quantity(begin, "time", f"--begin {begin}")
    )
    write.write_table(
        out,
        {f"decay_{name}": one for name, one in found._asdict().items()},
        {f"decay_{name}": unit for name, unit in write.DECAY.items()},
    )
    ends = [
        f"{formatting.format_value(found.frequency[k], found.frequency_error[k], unit='Hz')} with a damping ratio of "
        f"{formatting.format_value(found.damping[k], found.damping_error[k])} at "
        f"{formatting.format_quantity(found.amplitude[k], 'm', 3)}"
        for k in (0, -1)
    ]
    return {
        "points": found.time.size,
        **{f"decay_{name}": one.tolist() for name, one in found._asdict().items()},
        "notes": [*notes, *more],
        "told": f"{found.time.size} amplitudes, from {ends[0]} to {ends[1]}",
    }


def _write_modes(file: Path, out: Path, asked, how: Estimate) -> dict:
    """Write modes as tables of a scene."""
    shapes, notes = _read_shapes(file, asked, how)
    if shapes is not None:
        found = measured.list_shape_modes(*shapes)
    else:
        values, notes = _read_records(file, asked)
        found = (
            measured.identify_decay_modes(
                values, _parse_quantity(how.begin, "time", f"--begin {how.begin}")
            )
            if how.decay
            else measured.identify_driven_modes(
                values,
                _parse_segment(how.segment),
                _parse_window(how.window),
                _parse_band(how.band),
            )
        )
    atomic_write.write_text(out, mode_lines.structure_text(found, file.name))
    listed = [
        {"frequency": f, "damping": zeta, "about": about}
        for f, zeta, about in zip(
            found.frequency.tolist(), found.damping.tolist(), found.descriptions
        )
    ]
    told = "; ".join(
        f"{one['frequency']:.5g} Hz with a damping of {one['damping']:.4g}" for one in listed
    )
    return {
        "modes": listed,
        "moving_mass": found.mass,
        "notes": [*notes, *found.notes],
        "told": told,
    }


def _write_response(file: Path, out: Path, asked, how: Estimate) -> dict:
    """Write a frequency response as a universal file."""
    if how.decay or how.begin or how.band:
        raise PatchfemError(
            "--decay, --begin and --band can be used only for modes (-o modes.toml)"
        )
    values, notes = _read_records(file, asked)
    found, step, drive, response = measured.estimate_record(
        values, _parse_segment(how.segment), _parse_window(how.window)
    )
    write.write_response(out, found, drive, response)
    return {
        "lines": found.frequency.size,
        "segments": found.segments,
        "window": found.window,
        "notes": notes,
        "told": f"{response} over {drive}, {found.frequency.size} frequencies from {found.segments} segments of "
        f"{found.segment * step:.4g} s, window {found.window}",
    }


def _read_records(file: Path, asked) -> tuple:
    """Read records and check that one of them is a response."""
    found = laboratory.read_records(file, records.parse_requests(asked), OUTPUT)
    if found.channel_list and not found.values.keys() & measured.DERIVATIVE_ORDERS.keys():
        raise PatchfemError(
            f"{file}: no channel is known as a response ({', '.join(measured.DERIVATIVE_ORDERS)}); choose one with "
            f"--map {next(iter(measured.DERIVATIVE_ORDERS))}=CHANNEL among {found.channel_list}"
        )
    return found.values, found.notes


def _read_shapes(file: Path, asked, how: Estimate) -> tuple:
    """Return ((shapes, points), notes) of a universal file with modes or frequency responses.

    (None, ()) for any other file.
    """
    names = {text.partition("=")[0].strip() for text in asked}
    if (
        file.suffix.lower() not in laboratory.UNIVERSAL_EXTENSIONS
        or how != Estimate()
        or names & set(CHANNEL_UNITS)
    ):
        return None, ()
    if not any(
        dataset["type"] == 55 or int(dataset.get("func_type", 0)) == 4
        for dataset in universal_files.read_datasets(file)
    ):
        return None, ()
    try:
        shapes = universal_modes.read_universal(file)
    except PatchfemError as error:
        raise type(error)(str(error).removeprefix("structure.file: ")) from None
    return (
        shapes,
        {
            one.quantity: one.source
            for one in records.parse_requests(asked, measured.SHAPE_QUANTITIES)
        },
    ), ()


def _parse_quantity(text: str, kind: str, option: str) -> float | None:
    """Return the value of an option in SI; None if it is ""."""
    try:
        return quantities.parse_quantity(text, kind) if text else None
    except ValueError as error:
        raise PatchfemError(f"{option}: {error}") from None


def _parse_segment(text: str) -> float | None:
    """Return the length of a segment [s]; None for the default."""
    return _parse_quantity(text, "time", f"--segment {text}")


def _parse_window(text: str) -> str | None:
    """Return the name of the window; None for the default."""
    if text not in ("", "hann", "none"):
        raise PatchfemError(f"--window {text}: hann or none")
    return text or None


def _parse_band(text: str) -> tuple:
    """Return both ends of a band [Hz]."""
    if not text:
        return (0.0, float("inf"))
    low, dots, high = text.partition("..")
    ends = [
        _parse_quantity(one, "frequency", f"--band {one}")
        for one in (low.strip(), high.strip())
        if dots
    ]
    if not ends or None in ends or not 0 <= ends[0] < ends[1]:
        raise PatchfemError(
            f'--band {text}: two rising frequencies are needed, such as "20 Hz..400 Hz"'
        )
    return tuple(ends)
