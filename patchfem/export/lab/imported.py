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

# Columns of an exported file that can be its displacement, in order of preference.
COLUMNS = {"displacement": ("output_displacement", "relative_displacement", "slide")}


class EstimateOptions(NamedTuple):
    """User settings for the estimation of modes or of a frequency response.

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


def convert_file(
    file: Path, out: Path, requests: Iterable[str], zero: bool, settings: EstimateOptions
) -> dict:
    """Convert a laboratory file to records (.csv), modes (.toml) or a response (.uff).

    Parameters
    ----------
    file : Path
    out : Path
    requests : iterable of str
        Channels as in `patchfem import --map`.
    zero : bool
        Whether time and displacement are measured from their first row.
    settings : EstimateOptions

    Returns
    -------
    dict
        `notes`, the sentence `told`, and what was found.

    Raises
    ------
    PatchfemError
        If options do not fit together.
    """
    suffix = out.suffix.lower()
    if suffix not in (".csv", ".toml", ".uff", ".unv"):
        raise PatchfemError(
            f"{out}: records are written as .csv, modes as .toml, a frequency response as .uff"
        )
    if suffix == ".csv" and settings != EstimateOptions(
        decay=settings.decay, begin=settings.begin if settings.decay else ""
    ):
        raise PatchfemError(
            "--segment, --window, --band and, without --decay, --begin can be used only for modes (-o "
            "modes.toml) and responses (-o response.uff)"
        )
    if zero and settings.decay:
        raise PatchfemError(
            "--zero can be used only when importing a table of records, not with --decay"
        )
    if zero and suffix != ".csv":
        raise PatchfemError(
            "--zero can be used only when importing a table of records (-o table.csv)"
        )
    if suffix == ".csv":
        return (
            _write_decay(file, out, requests, settings.begin)
            if settings.decay
            else _write_table(file, out, requests, zero)
        )
    return (_write_modes if suffix == ".toml" else _write_response)(file, out, requests, settings)


def _write_table(file: Path, out: Path, requests, zero: bool) -> dict:
    """Write measured records as a table."""
    laboratory_records = laboratory.read_records(file, records.parse_requests(requests))
    values = records.shift_to_zero(laboratory_records.values) if zero else laboratory_records.values
    units = {name: SI_UNITS[name] for name in values}
    write.write_table(out, values, units)
    rows = len(next(iter(values.values())))
    shifted_starts = [
        f"{name} starts at {values[name][0]:g} {SI_UNITS[name]}"
        for name in ("time", "displacement", "lateral")
        if "displacement" in values and name in values and values[name][0] != 0
    ]
    notes = [
        *laboratory_records.notes,
        *(
            [
                f"{', '.join(shifted_starts)}: slide.file needs a table that starts at 0; use --zero to subtract "
                "the first row"
            ]
            if shifted_starts
            else []
        ),
    ]
    return {
        "rows": rows,
        "units": units,
        "notes": notes,
        "told": f"{rows} rows of {', '.join(values)}",
    }


def _write_decay(file: Path, out: Path, requests, begin_text: str) -> dict:
    """Write frequency and damping ratio of a measured decay as a table."""
    values, notes = _read_records(file, requests)
    curve, curve_notes = measured.compute_decay_curve(
        values, _parse_quantity(begin_text, "time", f"--begin {begin_text}")
    )
    write.write_table(
        out,
        {f"decay_{name}": values_of_name for name, values_of_name in curve._asdict().items()},
        {f"decay_{name}": unit for name, unit in write.DECAY.items()},
    )
    ends = [
        f"{formatting.format_value(curve.frequency[k], curve.frequency_error[k], unit='Hz')} with a damping ratio of "
        f"{formatting.format_value(curve.damping[k], curve.damping_error[k])} at "
        f"{formatting.format_quantity(curve.amplitude[k], 'm', 3)}"
        for k in (0, -1)
    ]
    return {
        "points": curve.time.size,
        **{
            f"decay_{name}": values_of_name.tolist()
            for name, values_of_name in curve._asdict().items()
        },
        "notes": [*notes, *curve_notes],
        "told": f"{curve.time.size} amplitudes, from {ends[0]} to {ends[1]}",
    }


def _write_modes(file: Path, out: Path, requests, settings: EstimateOptions) -> dict:
    """Write identified modes as tables of a scene."""
    shapes, notes = _read_shapes(file, requests, settings)
    if shapes is not None:
        modes = measured.list_shape_modes(*shapes)
    else:
        values, notes = _read_records(file, requests)
        modes = (
            measured.identify_decay_modes(
                values, _parse_quantity(settings.begin, "time", f"--begin {settings.begin}")
            )
            if settings.decay
            else measured.identify_driven_modes(
                values,
                _parse_segment(settings.segment),
                _parse_window(settings.window),
                _parse_band(settings.band),
            )
        )
    atomic_write.write_text(out, mode_lines.structure_text(modes, file.name))
    mode_entries = [
        {"frequency": f, "damping": zeta, "about": about}
        for f, zeta, about in zip(
            modes.frequency.tolist(), modes.damping.tolist(), modes.descriptions
        )
    ]
    summary = "; ".join(
        f"{entry['frequency']:.5g} Hz with a damping of {entry['damping']:.4g}"
        for entry in mode_entries
    )
    return {
        "modes": mode_entries,
        "moving_mass": modes.mass,
        "notes": [*notes, *modes.notes],
        "told": summary,
    }


def _write_response(file: Path, out: Path, requests, settings: EstimateOptions) -> dict:
    """Write an estimated frequency response as a universal file."""
    if settings.decay or settings.begin or settings.band:
        raise PatchfemError(
            "--decay, --begin and --band can be used only for modes (-o modes.toml)"
        )
    values, notes = _read_records(file, requests)
    estimate, step, drive, response = measured.estimate_record(
        values, _parse_segment(settings.segment), _parse_window(settings.window)
    )
    write.write_response(out, estimate, drive, response)
    return {
        "lines": estimate.frequency.size,
        "segments": estimate.segments,
        "window": estimate.window,
        "notes": notes,
        "told": f"{response} over {drive}, {estimate.frequency.size} frequencies from {estimate.segments} segments of "
        f"{estimate.segment * step:.4g} s, window {estimate.window}",
    }


def _read_records(file: Path, requests) -> tuple:
    """Read measured records, and check that one of them is a response."""
    laboratory_records = laboratory.read_records(file, records.parse_requests(requests), COLUMNS)
    if (
        laboratory_records.channel_list
        and not laboratory_records.values.keys() & measured.DERIVATIVE_ORDERS.keys()
    ):
        raise PatchfemError(
            f"{file}: no channel is known as a response ({', '.join(measured.DERIVATIVE_ORDERS)}); choose one with "
            f"--map {next(iter(measured.DERIVATIVE_ORDERS))}=CHANNEL among {laboratory_records.channel_list}"
        )
    return laboratory_records.values, laboratory_records.notes


def _read_shapes(file: Path, requests, settings: EstimateOptions) -> tuple:
    """Read mode shapes or frequency responses of a universal file, with notes.

    (None, ()) for any other file.
    """
    names = {text.partition("=")[0].strip() for text in requests}
    if (
        file.suffix.lower() not in laboratory.UNIVERSAL_EXTENSIONS
        or settings != EstimateOptions()
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
            request.quantity: request.source
            for request in records.parse_requests(requests, measured.SHAPE_QUANTITIES)
        },
    ), ()


def _parse_quantity(text: str, kind: str, option: str) -> float | None:
    """Convert the text of an option to SI, or return None if the text is ""."""
    try:
        return quantities.parse_quantity(text, kind) if text else None
    except ValueError as error:
        raise PatchfemError(f"{option}: {error}") from None


def _parse_segment(text: str) -> float | None:
    """Convert an option to the segment length [s]; None means the default."""
    return _parse_quantity(text, "time", f"--segment {text}")


def _parse_window(text: str) -> str | None:
    """Convert an option to the name of a window function; None means the default."""
    if text not in ("", "hann", "none"):
        raise PatchfemError(f"--window {text}: hann or none")
    return text or None


def _parse_band(text: str) -> tuple:
    """Convert an option to both ends of a frequency band [Hz]."""
    if not text:
        return (0.0, float("inf"))
    low, dots, high = text.partition("..")
    ends = [
        _parse_quantity(end, "frequency", f"--band {end}")
        for end in (low.strip(), high.strip())
        if dots
    ]
    if not ends or None in ends or not 0 <= ends[0] < ends[1]:
        raise PatchfemError(
            f'--band {text}: two rising frequencies are needed, such as "20 Hz..400 Hz"'
        )
    return tuple(ends)
