"""A rig as matrices and friction elements in a .mat file, for NLvib, TMDSimPy, pyHarm and own programs.

The equations are M q'' + C q' + K q + sum_e w_e f_e(w_e' q) = Fex1 cos(omega t) with the modal coordinates q. MATRICES.md
lists the variables. `structure.file` reads M, C, K, slide, output and base or force.
"""

from pathlib import Path

import numpy as np

from ...core import Outcome, PatchfemError, SineDrive
from ...disk.atomic_write import write_atomically
from ...model.model import Model
from ...model.rig import MAX_COMPUTED_DISPLACEMENT
from ...model.source import locate_errors
from ...runs.interfaces.joints import list_parts
from ...runs.patch import case_meshes
from ...runs.rig import engines


def export_structure(model: Model, out: Path) -> str:
    """Write the rig of a Model as .mat, and return a line of text about the file.

    Raises
    ------
    PatchfemError
        For another ending, a scene without [structure], a law that is not elements that stretch and slip, a nonlinear
        spring, grooves, and a varying load.
    Missing
        If `out` cannot be written.
    """
    from scipy.io import savemat

    out = Path(out)
    if out.suffix.lower() != ".mat":
        removed = (
            "; .npz was removed in patchfem 1.2, scipy.io.loadmat reads .mat in Python"
            if out.suffix.lower() == ".npz"
            else ""
        )
        raise PatchfemError(f"{out}: a structure is exported as .mat{removed}")

    # a refusal names the line of the scene
    with locate_errors(model.source):
        if model.rig is None:
            raise PatchfemError(
                "only the structure of a scene can be exported, and this scene has none; export a results folder",
                "structure",
            )
        _refuse_unsupported(model)
        arrays = make_matrices(model.rig) | make_elements(model)

    with write_atomically(out) as partial, open(partial, "wb") as file:
        savemat(file, arrays, oned_as="column", long_field_names=True)
    counts = {"coordinate": len(arrays["M"]), "friction element": arrays["limit"].size}
    texts = [f"{count} {name}{'s' * (count != 1)}" for name, count in counts.items()]
    return f"{out}: {', '.join(texts)}{_describe_omissions(model)}"


def _describe_omissions(model: Model) -> str:
    """Return a clause on features of the scene that the file lacks."""
    rig = model.rig
    missing = {
        "[wear]": model.wear is not None,
        "structure.travel": rig.springs.travel < MAX_COMPUTED_DISPLACEMENT,
        "the initial motion": rig.start is not None,
        "the drive signal (Fex1 is for an amplitude of 1 N or 1 m/s^2)": not rig.drive.is_release
        and not isinstance(rig.drive.signal, SineDrive),
    }
    names = [name for name, is_missing in missing.items() if is_missing]
    return "; not in the file: " + ", ".join(names) if names else ""


def make_matrices(rig) -> dict[str, np.ndarray | float]:
    """Return matrices and vectors of a rig by the names of the file.

    For a drive other than a sine, Fex1 is that of 1 N or 1 m/s^2; for a release it is 0.
    """
    modes = rig.modes
    is_sine = isinstance(rig.drive.signal, SineDrive)
    size = rig.drive.signal.acceleration if is_sine else float(not rig.drive.is_release)
    arrays = {
        "M": modes.mass * np.eye(modes.omega.size),
        "C": modes.mass * modes.damping_matrix,
        "K": modes.mass * np.diag(modes.omega**2),
        "Fex1": -size * modes.mass * modes.base,
        "output": modes.output,
    }
    if rig.drive.kind == "base":
        arrays["base"] = modes.base
    elif rig.drive.kind == "force":
        arrays["force"] = -modes.base
    if rig.friction.interfaces:
        arrays["slide"] = modes.interfaces
    if is_sine or rig.drive.levels.amplitudes:
        arrays["Omega"] = 2 * np.pi * rig.drive.frequency
    return arrays


def _refuse_unsupported(model: Model) -> None:
    """Raise PatchfemError for features that matrices and friction elements cannot represent."""
    reason = engines.find_obstacle_of_map("piecewise", model)
    if reason.startswith("for law"):
        raise PatchfemError(
            f"{reason.removeprefix('for ')} cannot be written as friction elements that stretch and slip; "
            "use law 'elastic-plastic' or 'iwan', or law 'coulomb' with [contact.shear]",
            f"{model.rig.friction.interfaces[0].key}.law",
        )
    if reason:
        raise PatchfemError(
            f"matrices and friction elements cannot be written {reason}; remove this feature from the scene",
            "structure",
        )


def make_elements(model: Model) -> dict[str, np.ndarray]:
    """Return the friction elements of a rig by the names of the file; the arrays are empty without friction."""
    modes = model.rig.modes
    if not model.rig.friction.interfaces:
        none = np.zeros(0)
        return {"limit": none, "stiffness": none, "direction": np.zeros((0, modes.omega.size))}
    patch = None
    if model.patch is not None:
        patch = case_meshes.solve_with_coarser(model.patch, model.accuracy.tolerance)[0]
        if patch.pressure.outcome is Outcome.NO_CONTACT:
            raise PatchfemError(
                "the pieces do not touch, so no friction acts; raise the load or close the gap",
                "contact",
            )

    groups = [_sort_elements(*joint.list_elements()) for joint in list_parts(model, patch)]
    stiffness, yields = (np.concatenate(parts) for parts in zip(*groups))
    direction = np.repeat(modes.interfaces, [group[0].size for group in groups], axis=0)
    return {"limit": stiffness * yields, "stiffness": stiffness, "direction": direction}


def _sort_elements(stiffness, yields) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness [N/m] and yield displacement [m] of elements in increasing order, equal ones as one."""
    is_used = (stiffness > 0) & (yields > 0)
    steps, number = np.unique(yields[is_used], return_inverse=True)
    return np.bincount(number, stiffness[is_used]), steps
