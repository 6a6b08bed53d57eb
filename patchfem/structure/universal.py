"""Measured modes of a universal file: shapes (dataset 55) or fits to responses (dataset 58)."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from ..inputs.universal import (
    FunctionType,
    OrdinateType,
    find_axis_scale,
    find_unit_factors,
    read_datasets,
)
from . import modal_fit
from .places import DIRECTION_NAMES, MeasuredModes

NORMAL_MODE_TYPE = 2  # analysis type of a real mode in dataset 55
COMPLEX_MODE_TYPES = (3, 7)  # analysis types of a complex mode in dataset 55
# Order of the time derivative of the displacement, by ordinate type of dataset 58
DERIVATIVE_ORDERS = {
    OrdinateType.DISPLACEMENT: 0,
    OrdinateType.VELOCITY: 1,
    OrdinateType.ACCELERATION: 2,
}
FORCE_TYPES = (OrdinateType.EXCITATION_FORCE, OrdinateType.FORCE)  # ordinate types of a force
# Largest relative difference between the frequencies of two responses; it allows for single
# precision
MAX_FREQUENCY_CHANGE = 1e-6


class _Mode(NamedTuple):
    """Mode that is read from dataset 55.

    - frequency: natural frequency [Hz].
    - zeta: damping ratio.
    - modal_mass: modal mass [kg] of the shape.
    - shape: motion of each (node, axis).
    - notes: sentences for the user.
    """

    frequency: float
    zeta: float
    modal_mass: float
    shape: np.ndarray
    notes: tuple = ()


def read_universal(path: Path) -> MeasuredModes:
    """Read the modes of a universal file, or fit modes to its frequency responses.

    Dataset 164 gives the units of the file.

    Raises
    ------
    PatchfemError
        If the file contains neither modes nor frequency responses, or if they lack something.
    """
    datasets = read_datasets(path)
    modes = [dataset for dataset in datasets if _is_mode(dataset)]
    responses = [dataset for dataset in datasets if dataset.get("type") == 58]
    factors = find_unit_factors(path, datasets)
    if modes:
        return _read_modes(modes, factors)
    if responses:
        return _fit_responses(responses, factors)
    types = sorted({str(dataset.get("type", "?")) for dataset in datasets})
    raise PatchfemError(
        f"{path} has neither mode shapes (dataset 55, normal or complex modes) nor "
        f"frequency responses (58); its datasets: {', '.join(types) or 'none'}"
    )


def _is_mode(dataset: dict) -> bool:
    """Return whether a dataset is a normal or a complex mode."""
    is_shape = dataset.get("type") == 55
    return is_shape and dataset.get("analysis_type") in (NORMAL_MODE_TYPE, *COMPLEX_MODE_TYPES)


def _read_modes(datasets: list, factors: dict | None) -> MeasuredModes:
    """Read modes of dataset 55 and scale them to unit modal mass."""
    mass_unit = 1.0 if factors is None else factors["length"] / factors["force"]
    modes = []
    columns = []
    for number, dataset in enumerate(datasets, 1):
        motion = _collect_motion(dataset)
        values = np.array(list(motion.values()))
        if dataset["analysis_type"] == NORMAL_MODE_TYPE:
            mode = _read_normal_mode(number, dataset, values)
        else:
            mode = _read_complex_mode(number, dataset, values.astype(complex))
        modal_mass = mode.modal_mass * mass_unit
        if not modal_mass > 0:
            raise PatchfemError(
                f"mode {number} ({mode.frequency:.5g} Hz) has no modal mass, so its shape has no "
                "scale; export the modal mass (dataset 55: record 8; complex modes: modal A), or "
                "frequency responses"
            )
        if mode.zeta < 0 or mode.frequency < 0:
            raise PatchfemError(
                f"mode {number} has frequency {mode.frequency:.5g} Hz and damping {mode.zeta:.3g}; both "
                "must be >= 0"
            )
        modes.append(mode)
        columns.append(dict(zip(motion, mode.shape / np.sqrt(modal_mass))))
    places = dict.fromkeys(place for column in columns for place in column)
    return MeasuredModes(
        frequency=np.array([mode.frequency for mode in modes]),
        zeta=np.array([mode.zeta for mode in modes]),
        motion={
            place: np.array([column.get(place, 0.0) for column in columns]) for place in places
        },
        notes=[note for mode in modes for note in mode.notes],
    )


def _collect_motion(dataset: dict) -> dict:
    """Return the component of a mode shape in each direction (node, axis)."""
    motion = {}
    for axis in range(len(DIRECTION_NAMES)):
        column = dataset.get(f"r{axis + 1}")
        if column is not None:
            for node, value in zip(dataset["node_nums"], column):
                motion[int(node), axis] = value
    return motion


def _read_normal_mode(number: int, dataset: dict, values) -> _Mode:
    """Read a real mode; if its viscous damping ratio is missing, use half its hysteretic damping."""
    zeta = dataset["modal_damp_vis"]
    notes = ()
    if not zeta and dataset["modal_damp_his"]:
        zeta = dataset["modal_damp_his"] / 2
        notes = (
            f"mode {number}: half of the hysteretic damping is used as the viscous damping ratio",
        )
    if np.iscomplexobj(values):
        values = _rotate_to_real(values).real
    return _Mode(dataset["freq"], zeta, dataset["modal_m"], values, notes)


def _read_complex_mode(number: int, dataset: dict, values) -> _Mode:
    """Read a complex mode, and convert it to the nearest real mode."""
    rotated = _rotate_to_real(values)
    imaginary = np.linalg.norm(rotated.imag) / max(np.linalg.norm(rotated), 1e-300)
    note = (
        f"mode {number} is complex; the shape is rotated in phase and only its real part is used, "
        f"which leaves out {100 * imaginary:.2g} % of the shape"
    )
    eigenvalue = dataset["eig"]
    if not eigenvalue.imag:
        raise PatchfemError(
            f"mode {number} has the real eigenvalue {eigenvalue.real:.5g} 1/s; only "
            "vibrating modes can be converted to real ones"
        )
    omega = abs(eigenvalue)
    modal_mass = abs(dataset["modal_a"]) / (2 * abs(eigenvalue.imag))
    zeta = -eigenvalue.real / omega
    return _Mode(omega / (2 * np.pi), zeta, modal_mass, rotated.real, (note,))


def _rotate_to_real(values):
    """Rotate the phase of a complex mode shape so that the sum of its squares is real and positive."""
    return values * np.exp(-0.5j * np.angle(np.sum(values**2)))


def _fit_responses(datasets: list, factors: dict | None) -> MeasuredModes:
    """Fit modes to frequency responses of dataset 58."""
    kinds = {str(dataset["func_type"]) for dataset in datasets}
    datasets = [
        dataset for dataset in datasets if dataset["func_type"] == FunctionType.FREQUENCY_RESPONSE
    ]
    if not datasets:
        raise PatchfemError(
            "dataset 58 contains no frequency response function (function type 4); its "
            f"types: {', '.join(sorted(kinds))}"
        )
    notes = []
    default_unit = "SI" if factors is None else "those of dataset 164"
    frequency = np.asarray(datasets[0]["x"], float)
    measured = {}
    for dataset in datasets:
        name = (
            f"response {dataset['rsp_node']}:{dataset['rsp_dir']:+d} over "
            f"{dataset['ref_node']}:{dataset['ref_dir']:+d}"
        )
        derivative = _check_response(dataset, name, frequency)
        sign_out, place = _find_direction(dataset["rsp_node"], dataset["rsp_dir"])
        sign_in, reference = _find_direction(dataset["ref_node"], dataset["ref_dir"])
        scale_out = find_axis_scale(dataset, "ordinate", factors)
        scale_in = find_axis_scale(dataset, "orddenom", factors)
        for axis in (scale_out, scale_in):
            note = f"structure.file: the unit label '{axis.unit}' is not known; the values are taken as {default_unit}"
            if axis.unit and not axis.is_stated and note not in notes:
                notes.append(note)
        scale = sign_out * sign_in * scale_out.factor / scale_in.factor
        measured[place, reference] = (scale * np.asarray(dataset["data"]), derivative)
    return modal_fit.identify_modes(frequency, measured, notes)


def _check_response(dataset: dict, name: str, frequency) -> int:
    """Check a response of dataset 58; return its order as a time derivative of the displacement."""
    kind = dataset["ordinate_spec_data_type"]
    input_kind = dataset["orddenom_spec_data_type"]
    if kind not in DERIVATIVE_ORDERS or input_kind not in FORCE_TYPES:
        raise PatchfemError(
            f"{name} is a response of type {kind} per input of type {input_kind}; "
            "displacement (8), velocity (11) or acceleration (12) per force (13) is needed"
        )
    own_frequency = dataset["x"]
    if len(own_frequency) != frequency.size or not np.allclose(
        own_frequency, frequency, rtol=MAX_FREQUENCY_CHANGE, atol=0
    ):
        raise PatchfemError(
            f"{name} is given at other frequencies than the first response; all "
            "responses need the same frequencies"
        )
    if not np.isfinite(dataset["data"]).all() or not np.iscomplexobj(dataset["data"]):
        raise PatchfemError(f"{name} contains values that are not finite or not complex")
    return DERIVATIVE_ORDERS[kind]


def _find_direction(node: int, direction: int) -> tuple:
    """Return the sign and the (node, axis) for a direction +-1 to +-6 in a universal file."""
    if not 1 <= abs(direction) <= len(DIRECTION_NAMES):
        raise PatchfemError(
            f"direction {direction} of node {node} is unknown; +-1 to +-6 for x, y, z, "
            "rx, ry, rz is needed"
        )
    return (1.0 if direction > 0 else -1.0), (int(node), abs(direction) - 1)
