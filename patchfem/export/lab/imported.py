"""Import of laboratory files: as a table for scenes and fits, or as modes of a scene."""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ... import formatting
from ...core import PatchfemError
from ...disk.atomic_write import write_text
from ...identify import measured_modes
from ...inputs import laboratory, records
from ...inputs import universal as universal_files
from ...inputs.units import SI_UNITS
from ...scene.keys import quantities
from ...scene.keys.removed import describe_removed
from ...scene.keys.tables import UNIVERSAL_EXTENSIONS
from ..answer import JsonObject
from ..columns import format_csv
from . import write

# columns of an exported file that can be its displacement, in order of preference; 1.x wrote the first one
DISPLACEMENT_COLUMN_NAMES = {
    "displacement": ("output_displacement", "relative_displacement", "slide")
}
# options that each form of a file uses
OPTIONS_OF_FORM = {"table": (), "decay": ("decay", "begin"), "modes": ("band", "decay", "begin")}
FREQUENCY_RESPONSE_FUNCTION_TYPE = 4  # function type of a frequency response in dataset 58
# records [SI] by quantity
Records = dict[str, np.ndarray]
DECAY_COLUMN_UNITS = {"time": "s", "amplitude": "m", "frequency": "Hz", "damping": "1"}


class EstimateOptions(NamedTuple):
    """User settings for the identification of modes.

    Attributes
    ----------
    band : str
        Frequencies, such as "20 Hz..400 Hz".
    decay : bool
        Whether the record is a free decay.
    begin : str
        Time at which it begins, such as "0.2 s".
    """

    band: str = ""
    decay: bool = False
    begin: str = ""


def convert_file(
    file: Path, out: Path, requests: Iterable[str], zero: bool, settings: EstimateOptions
) -> JsonObject:
    """Convert a laboratory file to records or a decay (.csv), or to modes (.toml).

    Parameters
    ----------
    file : Path
        Universal file, .mat or table with units.
    out : Path
        File to write, whose ending chooses the form.
    requests : iterable of str
        Quantities and their channels, such as "force=Load cell [lbf]".
    zero : bool
        Whether time and displacement are measured from their first row.
    settings : EstimateOptions
        How modes are estimated.

    Returns
    -------
    dict
        `notes`, the sentence `told`, and what was found.

    Raises
    ------
    PatchfemError
        If options do not fit together.
    """
    form = _choose_form(out, settings, zero=zero)
    if form == "table":
        return _write_table(file, out, requests, zero)
    if form == "modes":
        _refuse_modal_data(file)

    # decays and modes are estimated from records of known quantities
    values, notes = _read_records(file, requests)
    begin = _parse_quantity(settings.begin, "time", "--begin")
    if form == "decay":
        return _write_decay(values, out, begin, notes)
    if settings.decay:
        modes = measured_modes.identify_decay_modes(values, begin)
    else:
        band = _parse_band(settings.band)
        modes = measured_modes.identify_driven_modes(values, band)
    return _write_modes(modes, out, file.name, notes)


def _choose_form(out: Path, settings: EstimateOptions, *, zero: bool) -> str:
    """Return "table", "decay" or "modes", the form in which records are written.

    `zero` tells whether --zero is given.

    Raises
    ------
    PatchfemError
        If the file has another suffix, or if the form does not use a given option.
    """
    endings = {".csv": "decay" if settings.decay else "table", ".toml": "modes"}
    form = endings.get(out.suffix.lower())
    if form is None:
        removed = describe_removed(f"import -o {out.suffix}", "writing a frequency response")
        raise PatchfemError(f"{out}: {removed or 'records are written as .csv, modes as .toml'}")
    if zero and form != "table":
        raise PatchfemError(
            "--zero can be used only when importing a table of records (-o table.csv), not with --decay"
        )

    # an option without an effect is a mistake of the user
    given = [name for name, value in settings._asdict().items() if value]
    unused = [f"--{name}" for name in given if name not in OPTIONS_OF_FORM[form]]
    if unused:
        raise PatchfemError(
            f"{out}: {', '.join(unused)} can be used only for modes (-o modes.toml), --begin with --decay also for "
            "a table of the decay"
        )
    return form


def _write_table(file: Path, out: Path, requests: Iterable[str], zero: bool) -> dict[str, object]:
    """Write the histories of a laboratory file as a table, one row per sample, in SI units.

    Parameters
    ----------
    file : Path
        Laboratory file.
    out : Path
        Table to write.
    requests : iterable of str
        Requested channels, such as "force=Load cell [lbf]", or without any, those that the file states.
    zero : bool
        Whether time and displacements are shifted to start at 0.

    Returns
    -------
    dict
        Number of rows, units, notes, and a text on what was written.
    """
    file_records = laboratory.read_records(file, records.parse_requests(requests))
    values = records.shift_to_zero(file_records.values) if zero else file_records.values
    units = {name: SI_UNITS[name] for name in values}
    write_text(out, format_csv({f"{name} [{units[name]}]": one for name, one in values.items()}))
    rows = next(iter(values.values())).size
    told = f"{rows} rows of {', '.join(values)}"
    return {"rows": rows, "units": units, "notes": file_records.notes, "told": told}


def _write_decay(
    values: dict[str, np.ndarray], out: Path, begin: float | None, notes: list[str]
) -> dict[str, object]:
    """Write frequency and damping ratio of a measured decay as a table.

    Parameters
    ----------
    values : dict of str to array
        Records in SI by quantity.
    out : Path
        Table to write.
    begin : float or None
        Time at which the decay begins [s]. It is found if this is None.
    notes : list of str
        Notes on the records.
    """
    curve, curve_notes = measured_modes.compute_decay_curve(values, begin)
    columns = {f"decay_{name}": one.tolist() for name, one in curve._asdict().items()}
    units = {name: DECAY_COLUMN_UNITS[name.removesuffix("_error")] for name in curve._fields}
    headings = [f"decay_{name} [{unit}]" for name, unit in units.items()]
    write_text(out, format_csv(dict(zip(headings, columns.values(), strict=True))))
    ends = [
        f"{formatting.format_value(curve.frequency[k], curve.frequency_error[k], unit='Hz')} with a damping ratio of "
        f"{formatting.format_value(curve.damping[k], curve.damping_error[k])} at "
        f"{formatting.format_quantity(curve.amplitude[k], 'm', 3)}"
        for k in (0, -1)
    ]
    return {
        "points": curve.time.size,
        **columns,
        "notes": [*notes, *curve_notes],
        "told": f"{curve.time.size} amplitudes, from {ends[0]} to {ends[1]}",
    }


def _write_modes(
    modes: measured_modes.ListedModes, out: Path, source: str, notes: list[str]
) -> dict[str, object]:
    """Write identified modes as tables of a scene, and return what the command prints.

    `source` is the name of the file of records, and `notes` are on these records.
    """
    write_text(out, format_structure(modes, source))
    columns = (modes.frequency.tolist(), modes.damping.tolist(), modes.descriptions)
    entries = [
        {"frequency": frequency, "damping": damping, "about": about}
        for frequency, damping, about in zip(*columns, strict=True)
    ]
    texts = [f"{one['frequency']:.5g} Hz with a damping of {one['damping']:.4g}" for one in entries]
    return {
        "modes": entries,
        "moving_mass": modes.mass,
        "notes": [*notes, *modes.notes],
        "told": "; ".join(texts),
    }


def format_structure(modes: measured_modes.ListedModes, source: str) -> str:
    """Return the tables [structure] and [[structure.mode]] of a scene as text.

    `source` is the name of the measured file.
    """

    def printable(text: str) -> str:
        """Return a text as one line for a comment."""
        return "".join(letter if letter.isprintable() else "?" for letter in text)

    mass = 'moving_mass = "1 kg"  # assumed: not in the record'
    if modes.mass is not None:
        mass = f'moving_mass = "{modes.mass!r} kg"'
    remarks = [f"modes of {source}, by {write.PROGRAM_AND_VERSION}", *modes.notes]
    lines = [*(f"# {printable(remark)}" for remark in remarks), "", "[structure]", mass]
    for k, about in enumerate(modes.descriptions):
        comment = f"  # {printable(about)}" if about else ""
        lines += [
            "",
            "[[structure.mode]]",
            f'name = "mode {k + 1}"',
            f'frequency = "{float(modes.frequency[k])!r} Hz"',
            f"damping = {float(modes.damping[k])!r}{comment}",
        ]
        for key, row in modes.rows.items():
            value = repr(float(row[k]))
            lines.append(f'{key} = "{value} rad/m"' if key == "pitch" else f"{key} = {value}")
    return "\n".join(lines) + "\n"


def _read_records(file: Path, requests: Iterable[str]) -> tuple[Records, list[str]]:
    """Return measured records by quantity with notes.

    PatchfemError is raised if none of them is a response.
    """
    file_records = laboratory.read_records(
        file, records.parse_requests(requests), DISPLACEMENT_COLUMN_NAMES
    )
    responses = measured_modes.DERIVATIVE_ORDERS
    if file_records.channel_list and not file_records.values.keys() & responses.keys():
        raise PatchfemError(
            f"{file}: no channel is known as a response ({', '.join(responses)}); choose one with --map "
            f"{next(iter(responses))}=CHANNEL among {file_records.channel_list}"
        )
    return file_records.values, file_records.notes


def _refuse_modal_data(file: Path) -> None:
    """Raise PatchfemError for a universal file of mode shapes (dataset 55), or of frequency responses alone."""
    if file.suffix.lower() not in UNIVERSAL_EXTENSIONS:
        return
    datasets = universal_files.read_datasets(file)
    if any(dataset["type"] == 55 for dataset in datasets):
        raise PatchfemError(f"{file}: {describe_removed('the import of mode shapes')}")
    functions = {int(dataset["func_type"]) for dataset in datasets if dataset["type"] == 58}
    if functions == {FREQUENCY_RESPONSE_FUNCTION_TYPE}:
        removed = describe_removed("the fit of modes to frequency responses")
        raise PatchfemError(f"{file}: {removed}")


def _parse_quantity(text: str, kind: str, option: str) -> float | None:
    """Convert the text of an option to SI, or return None if it is "".

    `kind` is the kind of quantity, such as "time", and `option` the name of the option for an error message.
    """
    try:
        return quantities.parse_quantity(text, kind) if text else None
    except ValueError as error:
        raise PatchfemError(f"{option} {text}: {error}") from None


def _parse_band(text: str) -> tuple[float, float]:
    """Return both ends of a frequency band [Hz]."""
    if not text:
        return 0.0, float("inf")
    ends = [_parse_quantity(part.strip(), "frequency", "--band") for part in text.split("..")]
    if len(ends) != 2 or None in ends or not 0 <= ends[0] < ends[1]:
        raise PatchfemError(
            f'--band {text}: two rising frequencies are needed, such as "20 Hz..400 Hz"'
        )
    return ends[0], ends[1]
