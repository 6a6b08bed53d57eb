"""Measured modes of a universal file: the shapes of its datasets 55."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from ..inputs.universal import Dataset, find_unit_factors, read_datasets
from ..scene.keys.removed import describe_removed
from .places import DIRECTION_NAMES, MeasuredModes

NORMAL_MODE_TYPE = 2  # analysis type of a real mode in dataset 55


class _ModalNumbers(NamedTuple):
    """Numbers of a mode.

    - frequency: natural frequency [Hz].
    - zeta: damping ratio.
    - modal_mass: modal mass in the units of the file.
    """

    frequency: float
    zeta: float
    modal_mass: float


def read_universal(path: Path) -> MeasuredModes:
    """Read the modes of a universal file and scale them to unit modal mass.

    Dataset 164 gives the units of the file.

    Parameters
    ----------
    path : Path
        File with datasets 55 of normal or complex modes.

    Returns
    -------
    MeasuredModes
        Frequencies [Hz], damping ratios and shapes [kg^-1/2], with a note on each shape that was changed.

    Raises
    ------
    PatchfemError
        If the file contains no modes, or if a mode lacks something.
    """
    datasets = read_datasets(path)
    modes = [
        dataset
        for dataset in datasets
        # Real and complex modes
        if dataset["type"] == 55 and dataset["analysis_type"] in (NORMAL_MODE_TYPE, 3, 7)
    ]
    if not modes:
        types = ", ".join(sorted({str(dataset["type"]) for dataset in datasets}))
        removed = describe_removed("the fit of modes to frequency responses")
        raise PatchfemError(
            f"{path} has no mode shapes (dataset 55, normal or complex modes); its datasets: {types}; {removed}"
        )

    # The shapes of the file are in its units of length and force.
    factors = find_unit_factors(path, datasets)
    mass_unit = 1.0 if factors is None else factors["length"] / factors["force"]

    all_numbers = []
    notes = []
    columns = []
    for number, dataset in enumerate(modes, 1):
        name = f"mode {number}"
        motion = _collect_motion(dataset)
        values = np.array(list(motion.values()))
        if dataset["analysis_type"] == NORMAL_MODE_TYPE:
            numbers = _read_normal_mode(name, dataset, notes)
            rotated = _rotate_to_real(values) if np.iscomplexobj(values) else values
        else:
            numbers = _read_complex_mode(name, dataset)
            rotated = _rotate_to_real(values.astype(complex))
            imaginary = np.linalg.norm(rotated.imag) / max(np.linalg.norm(rotated), 1e-300)
            notes.append(
                f"{name} is complex; the shape is rotated in phase and only its real part is used, "
                f"which leaves out {100 * imaginary:.2g} % of the shape"
            )

        # Without a modal mass a shape has no scale.
        if not numbers.modal_mass > 0:
            raise PatchfemError(
                f"{name} ({numbers.frequency:.5g} Hz) has no modal mass, so its shape has no scale; export the "
                "modal mass (dataset 55: record 8; complex modes: modal A)"
            )
        if numbers.zeta < 0 or numbers.frequency < 0:
            raise PatchfemError(
                f"{name} has frequency {numbers.frequency:.5g} Hz and damping {numbers.zeta:.3g}; both "
                "must be >= 0"
            )
        all_numbers.append(numbers)
        scale = np.sqrt(numbers.modal_mass * mass_unit)
        columns.append(dict(zip(motion, rotated.real / scale)))

    # A place that a shape lacks does not move in this mode.
    places = dict.fromkeys(place for column in columns for place in column)
    motion = {place: np.array([column.get(place, 0.0) for column in columns]) for place in places}
    frequency, zeta, _ = np.array(all_numbers).T
    return MeasuredModes(frequency, zeta, motion, notes)


def _collect_motion(dataset: Dataset) -> dict[tuple[int, int], float]:
    """Return the components of the mode shape in a dataset 55 by direction (node, axis).

    They have the scale of the file. Axes are 0 to 5: translations along x, y, z and rotations about them.
    """
    motion = {}
    for axis in range(len(DIRECTION_NAMES)):
        column = dataset.get(f"r{axis + 1}")
        if column is not None:
            for node, value in zip(dataset["node_nums"], column):
                motion[int(node), axis] = value
    return motion


def _read_normal_mode(name: str, dataset: Dataset, notes: list[str]) -> _ModalNumbers:
    """Return frequency [Hz], damping ratio and modal mass [kg] of a real mode.

    If the viscous damping ratio is missing, it is half the hysteretic damping, and `notes` says so.

    `name` names the mode in notes, and `dataset` has its numbers.
    """
    zeta = dataset["modal_damp_vis"]
    if not zeta and dataset["modal_damp_his"]:
        zeta = dataset["modal_damp_his"] / 2
        notes.append(f"{name}: half of the hysteretic damping is used as the viscous damping ratio")
    return _ModalNumbers(dataset["freq"], zeta, dataset["modal_m"])


def _read_complex_mode(name: str, dataset: Dataset) -> _ModalNumbers:
    """Return frequency [Hz], damping ratio and modal mass [kg] of the real mode nearest to a complex one.

    With the eigenvalue s, the circular frequency is |s|, the damping ratio -Re s/|s| and the modal mass
    |modal A|/(2 |Im s|).

    `name` names the mode in messages, and `dataset` has the numbers of the complex one.
    """
    eigenvalue = dataset["eig"]
    if not eigenvalue.imag:
        raise PatchfemError(
            f"{name} has the real eigenvalue {eigenvalue.real:.5g} 1/s; only "
            "vibrating modes can be converted to real ones"
        )
    omega = abs(eigenvalue)
    modal_mass = abs(dataset["modal_a"]) / (2 * abs(eigenvalue.imag))
    return _ModalNumbers(omega / (2 * np.pi), -eigenvalue.real / omega, modal_mass)


def _rotate_to_real(values):
    """Rotate the phase of complex values (k,) of a mode shape so that the sum of their squares is positive."""
    return values * np.exp(-0.5j * np.angle(np.sum(values**2)))
