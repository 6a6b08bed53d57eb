"""March of many patches with coupled bond points; each case takes one vector lane of the kernels."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...compiled import load
from ...core import ModalBasis, SineDrive
from ..propagator import make_propagator
from .lane_rows import (
    LANES,
    N_COLUMNS,
    N_LOSS_COEFFICIENTS,
    N_POINTS,
    N_RIG_MODES,
    N_SAMPLE,
    N_WORKSPACE_ROWS,
    At,
    RigRow,
    StepColumn,
    get_rows,
)

LANES_KERNELS = "dynamics.march.lanes_kernels"


# Workspace position of each energy sum of a run.
LEDGER_POSITIONS = {
    "work_in": At.WORK_IN,
    "viscous": At.VISCOUS_SUM,
    "power": At.DRIVE_WORK_SIZE,
    "lost": At.FRICTION_LOSS,
    "peak": At.MAX_STORED,
    "booked": At.FRICTION_WORK,
    "sampled": At.SAMPLED_WORK,
    "passed": At.FRICTION_WORK_SIZE,
    "gone": At.INTERFACE_LOSS,
    "created": At.INTERFACE_GAIN,
}


class PointsCase(NamedTuple):
    """Bond points and drive amplitude of one case.

    - `limit` (p,): friction limits of the points [N].
    - `shape` (p, r), `stiffness` (r,): slides of the points per coordinate of the pieces, and stiffness of
      these [N/m].
    - `length`: bond length [m].
    - `amplitude`: amplitude of the drive [m s-2].
    """

    limit: np.ndarray
    shape: np.ndarray
    stiffness: np.ndarray
    length: float
    amplitude: float


class MarchedCases(NamedTuple):
    """Results of n marched cases: cycle extremes, energies and samples.

    - `extremes` (n, c, 2), `phasors` (n, c): of the output in each cycle [m].
    - `energies`: energy sums of the run by name, (n,) [J].
    - `z`, `rate` (s, modes, n), `force` (s, n), `slip` (s, n): samples of the last cycles.
    - `friction_work` (n,): friction work of the last cycles [J].
    - `reach` (n,): largest slide [m].
    - `n_unsolved` (n,): number of steps that did not converge.
    """

    extremes: np.ndarray
    phasors: np.ndarray
    energies: dict
    z: np.ndarray
    rate: np.ndarray
    force: np.ndarray
    slip: np.ndarray
    friction_work: np.ndarray
    reach: np.ndarray
    n_unsolved: np.ndarray


def can_march(modes: ModalBasis) -> bool:
    """Return whether the compiled batch solver supports the number of modes and the damping of a rig."""
    return modes.omega.size <= N_RIG_MODES and modes.damping is None


def _make_rig_rows(modes: ModalBasis, prop) -> np.ndarray:
    """Return the propagator of a rig as rows for the batch kernels (see `RigRow`).

    Parameters
    ----------
    modes : ModalBasis
    prop : propagator.Propagator
    """
    n = modes.omega.size
    out = np.zeros((len(RigRow) + N_LOSS_COEFFICIENTS - 1, 3))
    for first, rows in (
        (RigRow.ZZ, prop.free),
        (RigRow.BY_Z, prop.force_response),
        (RigRow.REACH_Z, prop.slide_response[0].reshape(2, n)),
        (RigRow.LOSS, prop.loss),
        (RigRow.SLIDE_SHAPE, [modes.slide, modes.output, modes.omega**2]),
    ):
        out[first : first + len(rows), :n] = rows
    out[RigRow.STEP] = prop.beta[0, 0], modes.mass, prop.dt
    # The kernels apply these coefficients to forces [N] instead of accelerations.
    out[[RigRow.BY_Z, RigRow.BY_V, RigRow.LOSS + 3, RigRow.LOSS + 4]] /= modes.mass
    out[RigRow.LOSS + 5] /= modes.mass**2
    return out


def _make_step_table(modes: ModalBasis, drive, steps: int, prop) -> np.ndarray:
    """Return the drive table for the steps of a cycle, for a drive amplitude of 1 m s-2.

    Parameters
    ----------
    modes : ModalBasis
    drive : SineDrive
    steps : int
        Number of steps of a cycle.
    prop : propagator.Propagator
    """
    n = modes.omega.size
    table = prop.tables(replace(drive, acceleration=1.0), 0, steps)
    out = np.zeros((steps, N_COLUMNS))
    for k in range(8):  # each of the eight blocks has one column per mode
        out[:, k * N_RIG_MODES : k * N_RIG_MODES + n] = table[:, k * n : (k + 1) * n]
    angle = 2 * np.pi * np.arange(steps) / steps
    for forms in (StepColumn.WORK_FORMS, StepColumn.LOSS_FORMS):
        # The kernels apply the last coefficients to forces [N] instead of accelerations.
        out[:, forms + 2 * N_RIG_MODES : forms + 3 * N_RIG_MODES] /= modes.mass
    out[:, StepColumn.REMAINDERS : StepColumn.REMAINDERS + 2] = table[:, 8 * n : 8 * n + 2]
    out[:, StepColumn.PORT_SLIDE] = table[:, 8 * n + 3]
    out[:, StepColumn.WAVES :] = np.array([np.cos(angle), np.sin(angle)]).T
    return out


def _make_workspace(cases: list) -> np.ndarray:
    """Return the workspace for cases at rest; lanes that are not needed repeat the last case."""
    workspace = np.zeros((N_WORKSPACE_ROWS, LANES))
    for i in range(LANES):
        case = cases[min(i, len(cases) - 1)]
        n_points, n_modes = case.shape.shape
        lane = workspace[:, i : i + 1]
        get_rows(lane, At.DRIVE)[:] = case.amplitude
        get_rows(lane, At.BOND_LENGTH)[:] = case.length
        get_rows(lane, At.LIMIT)[:] = case.limit.sum()
        get_rows(lane, At.POINT_LIMITS)[:n_points, 0] = case.limit
        # Unused coordinates of the pieces stay at 0 with any stiffness.
        get_rows(lane, At.STIFFNESSES)[:] = case.stiffness.max()
        get_rows(lane, At.STIFFNESSES)[:n_modes, 0] = case.stiffness
        for k, shape in enumerate(case.shape.T):
            get_rows(lane, At.SHAPES)[k * N_POINTS : k * N_POINTS + n_points, 0] = shape
            get_rows(lane, At.MAX_SHAPES)[k] = np.abs(shape).max()
            get_rows(lane, At.MEAN_SHAPES)[k] = case.limit @ shape / case.limit.sum()
    return workspace


def march(
    modes: ModalBasis, drive: SineDrive, cases: list, cycles: int, steps: int, window: int
) -> MarchedCases:
    """March cases from rest over cycles of a drive signal, each case with its own drive amplitude.

    Parameters
    ----------
    modes : ModalBasis
    drive : SineDrive
    cases : list of PointsCase
    cycles : int
    steps : int
        Number of steps of a cycle.
    window : int
        Number of last cycles whose samples are kept.

    Returns
    -------
    MarchedCases
    """
    kernels = load(LANES_KERNELS)
    prop = make_propagator(modes, drive, steps)
    rig = _make_rig_rows(modes, prop)
    table = _make_step_table(modes, drive, steps, prop)
    blocks = []
    for first in range(0, len(cases), LANES):
        block_cases = cases[first : first + LANES]
        workspace = _make_workspace(block_cases)
        history = np.zeros((cycles, 4, LANES))
        work = np.zeros(LANES)
        samples = np.zeros((window * steps + 1, N_SAMPLE, LANES))
        kernels.march(workspace.ravel(), rig, table, history, samples, work)
        arrays = workspace, history, samples, work
        blocks.append([array[..., : len(block_cases)] for array in arrays])
    workspace, history, samples, work = (np.concatenate(part, axis=-1) for part in zip(*blocks))
    n = modes.omega.size
    energies = {name: get_rows(workspace, at)[0] for name, at in LEDGER_POSITIONS.items()}
    rates = get_rows(workspace, At.RIG_RATE)[:n]
    positions = get_rows(workspace, At.RIG_POSITION)[:n]
    squares = (rates**2 + (modes.omega[:, None] * positions) ** 2).sum(axis=0)
    energies["stored"] = 0.5 * modes.mass * squares + get_rows(workspace, At.INTERFACE_ENERGY)[0]
    return MarchedCases(
        extremes=history[:, :2].transpose(2, 0, 1),
        phasors=(history[:, 2] + 1j * history[:, 3]).T,
        energies=energies,
        z=samples[:, :n],
        rate=samples[:, N_RIG_MODES : N_RIG_MODES + n],
        force=samples[:, 2 * N_RIG_MODES],
        slip=samples[:, 2 * N_RIG_MODES + 1],
        friction_work=energies["booked"] - work,
        reach=get_rows(workspace, At.MAX_SLIDE)[0],
        n_unsolved=get_rows(workspace, At.N_UNSOLVED)[0],
    )
