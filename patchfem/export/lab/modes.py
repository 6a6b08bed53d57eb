"""Identified modes as the [structure] of a scene, and a response as a universal file."""

from pathlib import Path

import numpy as np

from .series import program_name
from .universal import SI_UNITS, write_sets

# Codes of the data types of universal dataset 58.
ACCELERATION = 12
FORCE = 13
FREQUENCY = 18
RESPONSE_TYPES = {"displacement": (8, "m"), "velocity": (11, "m/s"), "acceleration": (12, "m/s^2")}
INPUT_TYPES = {"force": (FORCE, "N"), "base_acceleration": (ACCELERATION, "m/s^2")}
# Codes of the function types of universal dataset 58.
RESPONSE_FUNCTION = 4
COHERENCE_FUNCTION = 6


def structure_text(modes, source: str) -> str:
    """Return the tables [structure] and [[structure.mode]] of a scene as text.

    modes: `identify.measured_modes.ListedModes`; source: name of the file with the measurement.
    """
    lines = [f"# modes of {make_printable(source)}, by {program_name()}"] + [
        f"# {make_printable(note)}" for note in modes.notes
    ]
    mass = (
        f'moving_mass = "{modes.mass!r} kg"'
        if modes.mass is not None
        else 'moving_mass = "1 kg"  # assumed: not in the record'
    )
    lines += ["", "[structure]", mass]
    for k, (f, zeta, about) in enumerate(
        zip(modes.frequency.tolist(), modes.damping.tolist(), modes.descriptions)
    ):
        lines += [
            "",
            "[[structure.mode]]",
            f'name = "mode {k + 1}"',
            f'frequency = "{f!r} Hz"',
            f"damping = {zeta!r}" + (f"  # {make_printable(about)}" if about else ""),
        ]
        lines += [
            f'{key} = "{float(row[k])!r} rad/m"' if key == "pitch" else f"{key} = {float(row[k])!r}"
            for key, row in modes.rows.items()
        ]
    return "\n".join(lines) + "\n"


def make_printable(text: str) -> str:
    """Convert a text to one line of printable characters, for a comment."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def write_response(path: Path, estimate, drive: str, response: str) -> None:
    """Write an estimated frequency response and its coherence as universal datasets 58.

    Response and reference are at point 1 in direction +x. If the input is a force, structure.file
    can read the file.

    Parameters
    ----------
    path : Path
    estimate : object
        With frequency (k,) [Hz], complex value (k,) and coherence (k,) or None.
    drive, response : str
        Kinds of input and output, keys of INPUT_TYPES and KINDS.
    """
    (kind, unit), (drive_type, drive_unit) = RESPONSE_TYPES[response], INPUT_TYPES[drive]
    common = {
        "type": 58,
        "binary": 1,
        "id1": f"{response} over {drive}",
        "id2": program_name(),
        "rsp_node": 1,
        "rsp_dir": 1,
        "ref_node": 1,
        "ref_dir": 1,
        "abscissa_spacing": 0,
        "abscissa_spec_data_type": FREQUENCY,
        "abscissa_axis_lab": "Frequency",
        "abscissa_axis_units_lab": "Hz",
        "x": np.array(estimate.frequency),
    }
    sets = [
        SI_UNITS,
        common
        | {
            "func_type": RESPONSE_FUNCTION,
            "ordinate_spec_data_type": kind,
            "ordinate_axis_units_lab": unit,
            "orddenom_spec_data_type": drive_type,
            "orddenom_axis_units_lab": drive_unit,
            "data": np.array(estimate.value),
        },
    ]
    if estimate.coherence is not None:
        sets.append(
            common
            | {
                "func_type": COHERENCE_FUNCTION,
                "id1": f"coherence of {response} and {drive}",
                "ordinate_spec_data_type": 0,
                "orddenom_spec_data_type": 0,
                "data": np.array(estimate.coherence),
            }
        )
    write_sets(path, sets)
