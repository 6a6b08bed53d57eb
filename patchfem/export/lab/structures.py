"""A rig as matrices and friction elements in a .mat file, for NLvib, TMDSimPy, pyHarm and own programs.

The equations are M q'' + C q' + K q + sum_e w_e f_e(w_e' q) = Fex1 cos(omega t). The first coordinates q are the slides of
the interfaces, because elements of pyHarm act on coordinates; the others are motions without slide. If the slides depend
on one another, q are the modal coordinates.

Variables: M, C, K (n, n) [kg, N s/m, N/m]; Fex1 (n,) [N] and Omega [rad/s] of the drive; output (n,): the output is
output'q; slide (i, n): row i gives the slide of interface i; base (n,) or force (n,): participation in the drive; form:
"elements" or "tanh"; direction (e, n): rows w_e; limit (e,) [N]: friction limits; stiffness (e,) [N/m] of elements that
stretch and slip; speed (e,) [m/s] of tanh elements. NLvib takes C as D, and each element as elasticDryFriction (stiffness,
limit) or tanhDryFriction (limit, speed as eps). TMDSimPy takes one JenkinsForce for each element, with direction as Q and
its transpose as T. `structure.file` reads M, C, K, slide, output and base or force.
"""

from pathlib import Path

import numpy as np

from ...core import Outcome, PatchfemError, SineDrive
from ...disk.atomic_write import write_atomically
from ...friction.cells import join_cells
from ...model.model import Model
from ...model.rig import MAX_TRAVEL
from ...model.source import locate_errors
from ...runs.patch import mesh_levels
from ...runs.rig import costs, engines, hybrid_laws, numerics
from ...scene.rules import methods

# ratio of the smallest to the largest singular value of the slides below which they are linearly dependent
DEPENDENCE_TOL = 1e-6
# features that the exported matrices support if the friction force depends on the speed only
SPEED_LAW_SUPPORT = methods.EngineSupport("", "no-law faces levels")


def export_structure(model: Model, out: Path) -> str:
    """Write the rig of a Model as .mat, and return a line of text about the file.

    Raises
    ------
    PatchfemError
        For another ending, a scene without [structure], a law that is neither elements that stretch
        and slip nor tanh, a nonlinear spring, grooves, and a varying load.
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
        basis = _find_coordinates(model)
        arrays = make_matrices(model, basis) | make_elements(model, basis)

    with write_atomically(out) as partial, open(partial, "wb") as file:
        savemat(file, arrays, oned_as="column", long_field_names=True)
    counts = {"coordinate": len(basis), "friction element": arrays["limit"].size}
    texts = [f"{count} {name}{'s' * (count != 1)}" for name, count in counts.items()]
    return f"{out}: {', '.join(texts)}{_describe_omissions(model)}"


def _describe_omissions(model: Model) -> str:
    """Return clauses on the size of the drive and on features of the scene that the file lacks."""
    rig = model.rig
    missing = {
        "[wear]": model.wear is not None,
        "structure.travel": rig.springs.travel < MAX_TRAVEL,
        "the initial motion": rig.start is not None,
    }
    names = [name for name, is_missing in missing.items() if is_missing]
    text = ""
    if not isinstance(rig.drive.signal, SineDrive) and rig.drive.kind != "free":
        amplitude = "1 N" if rig.drive.kind == "force" else "1 m/s^2"
        text = f"; Fex1 is the excitation for an amplitude of {amplitude}, not for waveform = '{rig.drive.waveform.name}'"
    return text + ("; not in the file: " + ", ".join(names) if names else "")


def _find_coordinates(model: Model) -> np.ndarray:
    """Return the matrix (n, n) that maps the exported coordinates to the modal coordinates."""
    rig = model.rig
    slides = rig.modes.interfaces
    identity = np.eye(rig.modes.omega.size)
    count = len(slides) if rig.friction.interfaces else 0
    if not count or count > len(identity):
        return identity
    # pseudo-inverse of the slides, and the motions that they leave out (singular value decomposition)
    left, sizes, right = np.linalg.svd(slides)
    if sizes[-1] <= DEPENDENCE_TOL * sizes[0]:
        return identity
    return np.hstack([right[:count].T / sizes @ left.T, right[count:].T])


def make_matrices(model: Model, basis: np.ndarray) -> dict[str, np.ndarray | float]:
    """Return matrices and vectors of a rig by the names of the file.

    For a drive other than a sine, Fex1 is that of 1 N or 1 m/s^2; for a release it is 0.

    Parameters
    ----------
    model : Model
        Model with a rig.
    basis : (n, n) ndarray
        Exported coordinates to modal coordinates.
    """
    rig = model.rig
    modes = rig.modes
    is_sine = isinstance(rig.drive.signal, SineDrive)
    size = rig.drive.signal.acceleration if is_sine else float(rig.drive.kind != "free")
    modal = {"M": np.eye(len(basis)), "C": modes.damping_matrix, "K": np.diag(modes.omega**2)}
    arrays = {name: modes.mass * basis.T @ matrix @ basis for name, matrix in modal.items()}
    arrays |= {"output": modes.output @ basis, "Fex1": -size * modes.mass * modes.base @ basis}
    if rig.drive.kind == "base":
        arrays["base"] = np.linalg.solve(basis, modes.base)
    elif rig.drive.kind == "force":
        arrays["force"] = -modes.base @ basis
    if rig.friction.interfaces:
        arrays["slide"] = modes.interfaces @ basis
    if is_sine or rig.drive.levels.amplitudes:
        arrays["Omega"] = 2 * np.pi * rig.drive.frequency
    return arrays


def _is_speed_only(rig) -> bool:
    """Return whether the friction force depends only on the sliding speed, at every interface."""
    return all(interface.numbers.law == "tanh" for interface in rig.friction.interfaces)


def _refuse_unsupported(model: Model) -> None:
    """Raise PatchfemError for features that matrices and friction elements cannot represent."""
    rig = model.rig
    if _is_speed_only(rig):
        features = engines.collect_motion_features(model, steady=True)
        reason = methods.find_unsupported_feature(SPEED_LAW_SUPPORT, features)
    else:
        reason = engines.find_obstacle_of_map("piecewise", model)
    if reason.startswith("for law"):
        raise PatchfemError(
            f"{reason.removeprefix('for ')} cannot be written as friction elements that stretch and slip; "
            "use law 'elastic-plastic', 'iwan' or 'tanh', or law 'coulomb' with [contact.shear]",
            f"{rig.friction.interfaces[0].key}.law",
        )
    if reason:
        raise PatchfemError(
            f"matrices and friction elements cannot be written {reason}; remove this feature from the scene",
            "structure",
        )


def make_elements(model: Model, basis: np.ndarray) -> dict[str, np.ndarray | str]:
    """Return the friction elements of a rig by the names of the file; the arrays are empty without friction.

    Parameters
    ----------
    model : Model
        Model with a rig.
    basis : (n, n) ndarray
        Exported coordinates to modal coordinates.
    """
    interfaces = model.rig.friction.interfaces
    none = np.zeros(0)
    elements = {"form": "elements", "limit": none, "stiffness": none, "speed": none}
    if not interfaces:
        return elements | {"direction": np.zeros((0, len(basis)))}
    rows = model.rig.modes.interfaces @ basis

    # under these laws the force is a function of the speed, so that no element stretches
    if _is_speed_only(model.rig):
        loads = [model.nominal_load if one.load is None else one.load for one in interfaces]
        limits = [one.numbers.static * load for one, load in zip(interfaces, loads, strict=True)]
        speeds = [one.numbers.reference_speed for one in interfaces]
        tanh = {"form": "tanh", "limit": np.array(limits), "speed": np.array(speeds)}
        return elements | tanh | {"direction": rows}

    patch = None
    if model.patch is not None:
        patch = mesh_levels.solve_with_coarser(model.patch, model.accuracy.tolerance)[0]
        if patch.pressure.outcome is Outcome.NO_CONTACT:
            raise PatchfemError("the pieces do not touch, so no friction acts", "contact")

    # as many elements as the first run would use, which merges neighbours in pairs
    settings = numerics.choose_numerics(model)
    groups = [_sort_elements(*one) for one in hybrid_laws.list_elements(model, settings, patch)]
    for _ in range(costs.count_cell_merges(model)):
        groups = [join_cells(2, 0, *group) for group in groups]
    stiffness, yields = (np.concatenate(parts) for parts in zip(*groups))
    direction = np.repeat(rows, [group[0].size for group in groups], axis=0)
    return elements | {"limit": stiffness * yields, "stiffness": stiffness, "direction": direction}


def _sort_elements(stiffness, yields) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness [N/m] and yield displacement [m] of elements in increasing order, equal ones as one."""
    is_used = (stiffness > 0) & (yields > 0)
    steps, number = np.unique(yields[is_used], return_inverse=True)
    return np.bincount(number, stiffness[is_used]), steps
