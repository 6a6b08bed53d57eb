"""A rig as matrices and friction elements, for NLvib (.mat) and for Python programs (.npz).

The equations are M q'' + D q' + K q + sum_e w_e f_e(w_e' q) = Fex1 cos(omega t). The first
coordinates q are the slides of the interfaces, because elements of pyHarm act on coordinates; the
others are motions without slide. If the slides depend on one another, q are the modal coordinates.

NLvib takes M, D, K, Fex1 and the structures of `nonlinear_elements`: elasticDryFriction with
stiffness and friction_limit_force, or tanhDryFriction with friction_limit_force and eps, its speed
[m/s]. TMDSimPy takes M, K, C, and Q, T, kt, Fs of each JenkinsForce: one row of `direction`, its
transpose, `stiffness` and `limit`. M, K, C, slide, output and force or base are those that
structure.file reads. The guide has a table of all variables.
"""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core import Outcome, PatchfemError, SineDrive
from ...disk.atomic_write import write_atomically
from ...model.model import Model
from ...model.rig import MAX_TRAVEL
from ...model.source import locate_errors
from ...runs.patch import result as patch_result
from ...runs.rig import costs, engines, event_driven, numerics
from ...scene.rules import methods

ENDINGS = (".mat", ".npz")
# Ratio of the smallest to the largest singular value of the slides below which the
# slides are linearly dependent.
DEPENDENCE_TOL = 1e-6
# Features that the exported matrices support if the friction force depends on the speed only.
SPEED_LAW_SUPPORT = methods.EngineSupport("", "no-law faces levels")
NLVIB = {"elements": "elasticDryFriction", "tanh": "tanhDryFriction"}


class Elements(NamedTuple):
    """Friction elements of a rig as arrays for other programs.

    Attributes
    ----------
    form : {"elements", "tanh"}
    direction : (e, n) array
    limit : (e,) array
        Friction limit [N].
    stiffness : (e,) array
        [N/m], for elements that stretch.
    speed : (e,) array
        [m/s], for tanh.
    """

    form: str
    direction: np.ndarray
    limit: np.ndarray
    stiffness: np.ndarray
    speed: np.ndarray


def export_structure(model: Model, out: Path) -> str:
    """Write the rig of a Model as .mat or .npz, and return a line of text about the file.

    Raises
    ------
    PatchfemError
        For another suffix, a scene without [structure], a law that is neither elements that stretch
        and slip nor tanh, a nonlinear spring, grooves, and a varying load.
    Missing
        If `out` cannot be written.
    """
    out = Path(out)
    if out.suffix.lower() not in ENDINGS:
        raise PatchfemError(f"{out}: a structure is exported as {' or '.join(ENDINGS)}")
    with locate_errors(model.source):
        if model.rig is None:
            raise PatchfemError(
                "only the structure of a scene can be exported, and this scene has none; export a "
                "results folder",
                "structure",
            )
        _refuse_unsupported(model)
        arrays = rig_matrices(model)
        elements = friction_elements(model)
    with write_atomically(out) as partial, open(partial, "wb") as file:
        if out.suffix.lower() == ".npz":
            np.savez(file, **arrays, **elements._asdict())
        else:
            _write_nlvib(file, arrays, elements)
    counts = (
        f"{count} {name}{'s' * (count != 1)}"
        for count, name in (
            (len(arrays["M"]), "coordinate"),
            (elements.limit.size, "friction element"),
        )
    )
    name = "output" if out.suffix.lower() == ".npz" else "T_out"
    rows = f"; in these coordinates x the output is {name}·x, Fex1 is the force on each of them"
    slides = ", the slide of interface i is row i of slide·x" if "slide" in arrays else ""
    return f"{out}: {', '.join(counts)}{rows}{slides}{_omitted_features(model)}"


def _omitted_features(model: Model) -> str:
    """Return a clause that lists the features of the scene that the exported file lacks."""
    rig = model.rig
    out = ["[wear]"] * (model.wear is not None) + ["structure.travel"] * (
        rig.springs.travel < MAX_TRAVEL
    )
    out += ["the initial motion"] * (rig.start is not None)
    unit = ""
    if not isinstance(rig.drive.signal, SineDrive) and rig.drive.kind != "free":
        amplitude = "1 N" if rig.drive.kind == "force" else "1 m/s^2"
        unit = (
            f"; Fex1 is the excitation for an amplitude of {amplitude}, not for waveform = "
            f"'{rig.drive.waveform.name}'"
        )
    return unit + ("; not in the file: " + ", ".join(out) if out else "")


def rig_matrices(model: Model) -> dict:
    """Return the matrices and vectors of a rig for other programs.

    For a drive other than a sine, Fex1 is that of 1 N or 1 m/s^2; for a release it is 0.

    Returns
    -------
    dict
        M, C, K (n, n) [kg, N s/m, N/m]; output (n,); Fex1 (n,) [N]; force or base (n,); slide (i,
        n); Omega [rad/s] for a sine and for levels.
    """
    rig = model.rig
    modes = model.rig.modes
    basis = _coordinate_basis(
        modes.interfaces if rig.friction.interfaces else np.zeros((0, modes.omega.size))
    )
    mass = modes.mass
    sine = isinstance(rig.drive.signal, SineDrive)
    size = rig.drive.signal.acceleration if sine else float(rig.drive.kind != "free")
    vectors = {}
    if rig.drive.kind == "base":
        vectors["base"] = np.linalg.solve(basis, modes.base)
    elif rig.drive.kind == "force":
        vectors["force"] = -modes.base @ basis
    if rig.friction.interfaces:
        vectors["slide"] = modes.interfaces @ basis
    if sine or rig.drive.levels.amplitudes:
        vectors["Omega"] = 2 * np.pi * rig.drive.frequency
    M, C, K = (
        mass * basis.T @ modal_matrix @ basis
        for modal_matrix in (np.eye(len(basis)), modes.damping_matrix, np.diag(modes.omega**2))
    )
    return {
        "M": M,
        "C": C,
        "K": K,
        "output": modes.output @ basis,
        "Fex1": -size * mass * modes.base @ basis,
        **vectors,
    }


def _coordinate_basis(slides) -> np.ndarray:
    """Return the matrix (n, n) that maps the exported coordinates of a rig to its modal coordinates."""
    i, n = slides.shape
    if not i or i > n:
        return np.eye(n)
    left_vectors, singular_values, right_vectors = np.linalg.svd(slides)
    return (
        np.hstack([right_vectors[:i].T / singular_values @ left_vectors.T, right_vectors[i:].T])
        if singular_values[-1] > DEPENDENCE_TOL * singular_values[0]
        else np.eye(n)
    )


def _is_speed_only(rig) -> bool:
    """Return whether the friction force depends only on the sliding speed, at every interface."""
    return all(interface.numbers.law == "tanh" for interface in rig.friction.interfaces)


def _refuse_unsupported(model: Model) -> None:
    """Raise PatchfemError for features that matrices and friction elements cannot represent."""
    rig = model.rig
    motion = engines.collect_motion_features(model, steady=True)
    if _is_speed_only(rig):
        reason = methods.find_unsupported_feature(SPEED_LAW_SUPPORT, motion)
    else:
        reason = engines.PIECES.find_unsupported_feature(model, steady=True)
    if reason.startswith("for law"):
        raise PatchfemError(
            f"{reason.removeprefix('for ')} cannot be written as friction elements that stretch and slip; "
            "use law 'elastic-plastic', 'iwan' or 'tanh', or law 'coulomb' with [contact.shear]",
            f"{rig.friction.interfaces[0].key}.law",
        )
    if reason:
        raise PatchfemError(
            f"matrices and friction elements cannot be written {reason}; remove this feature from the "
            "scene",
            "structure",
        )


def friction_elements(model: Model) -> Elements:
    """Return the friction elements of a rig, which are empty arrays if the rig has no friction."""
    rig = model.rig
    n = model.rig.modes.omega.size
    no_values = np.zeros(0)
    if not rig.friction.interfaces:
        return Elements("elements", np.zeros((0, n)), no_values, no_values, no_values)
    rows = rig.modes.interfaces @ _coordinate_basis(rig.modes.interfaces)
    laws = [interface.numbers for interface in rig.friction.interfaces]
    if _is_speed_only(rig):
        limit = np.array(
            [
                law.static * (model.nominal_load if one.load is None else one.load)
                for law, one in zip(laws, rig.friction.interfaces)
            ]
        )
        return Elements(
            "tanh", rows, limit, no_values, np.array([law.reference_speed for law in laws])
        )
    patch = None
    if model.patch is not None:
        patch = patch_result.solve_with_coarser(model.patch, model.accuracy.tolerance)[0]
        if patch.pressure.outcome is Outcome.NO_CONTACT:
            raise PatchfemError("the pieces do not touch, so no friction acts", "contact")
    settings = replace(numerics.choose_numerics(model), pairs=costs.count_cell_merges(model))
    groups = event_driven.YieldingElements(model, settings, patch).groups
    stiffness = np.concatenate([group.stiffness for group in groups])
    limit = np.concatenate([group.stiffness * group.yield_displacement for group in groups])
    direction = np.repeat(rows, [group.stiffness.size for group in groups], axis=0)
    return Elements("elements", direction, limit, stiffness, no_values)


def _write_nlvib(file, arrays: dict, elements: Elements) -> None:
    """Write a rig as variables of the MATLAB tool NLvib."""
    from scipy.io import savemat

    cells = np.empty((1, elements.limit.size), dtype=object)
    for k, limit in enumerate(elements.limit):
        settings = (
            {"stiffness": elements.stiffness[k], "ishysteretic": 1.0}
            if elements.form == "elements"
            else {"eps": elements.speed[k], "ishysteretic": 0.0}
        )
        cells[0, k] = {
            "type": NLVIB[elements.form],
            "force_direction": elements.direction[k][:, None],
            "friction_limit_force": limit,
            "islocal": 1.0,
            **settings,
        }
    column = {
        name: np.asarray(array)[:, None] if np.ndim(array) == 1 else array
        for name, array in arrays.items()
    }
    savemat(
        file,
        {
            **column,
            "D": arrays["C"],
            "T_out": arrays["output"][None, :],
            "nonlinear_elements": cells,
        },
        long_field_names=True,
    )
