"""March of patches with bonds behind shear modes in lanes: input, march and results."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...compiled import load
from ...core import ModalBasis, SineDrive
from ..propagator import make_propagator

LANES_KERNELS = "dynamics.march.lanes_kernels"


# Row of `lanes_kernels` of each sum of a run.
LEDGER_ROWS = {
    "work_in": "WORK_IN",
    "viscous": "VISCOUS_SUM",
    "power": "DRIVE_WORK_SIZE",
    "lost": "FRICTION_LOSS",
    "peak": "MAX_STORED",
    "booked": "FRICTION_WORK",
    "sampled": "SAMPLED_WORK",
    "passed": "FRICTION_WORK_SIZE",
    "gone": "INTERFACE_LOSS",
    "created": "INTERFACE_GAIN",
}


class PointsCase(NamedTuple):
    """Points of a case.

    - `limit` (p,): friction limits [N].
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
    """Results of n cases that were marched.

    - `extremes` (n, c, 2), `phasors` (n, c): of the output in each cycle [m].
    - `book`: sums of the run by name, (n,) [J].
    - `z`, `rate` (s, modes, n), `force` (s, n), `slip` (s, n): samples of the last cycles.
    - `worked` (n,): friction work of the last cycles [J].
    - `reach` (n,): largest slide [m].
    - `bad` (n,): number of steps without a solution.
    """

    extremes: np.ndarray
    phasors: np.ndarray
    book: dict
    z: np.ndarray
    rate: np.ndarray
    force: np.ndarray
    slip: np.ndarray
    worked: np.ndarray
    reach: np.ndarray
    bad: np.ndarray


def can_march(modes: ModalBasis) -> bool:
    """Return whether lanes can march a rig."""
    return modes.omega.size <= load(LANES_KERNELS).N_RIG_MODES and modes.damping is None


def _rig_rows(kernels, modes: ModalBasis, prop) -> np.ndarray:
    """Return the rows of a rig as the kernels take them.

    Parameters
    ----------
    kernels
    modes : ModalBasis
    prop : propagator.Propagator
    """
    n = modes.omega.size
    out = np.zeros((kernels.N_RIG_ROWS + 1, 3))
    for first, rows in (
        (kernels.ZZ, prop.free),
        (kernels.BY_Z, prop.push),
        (kernels.REACH_Z, prop.reach[0].reshape(2, n)),
        (kernels.LOSS, prop.loss),
        (kernels.SLIDE_SHAPE, [modes.slide, modes.output, modes.omega**2]),
    ):
        out[first : first + len(rows), :n] = rows
    out[-1] = prop.beta[0, 0], modes.mass, prop.dt
    # these coefficients apply to forces [N] instead of accelerations
    for first, power in (
        (kernels.BY_Z, 1),
        (kernels.BY_V, 1),
        (kernels.LOSS + 3, 1),
        (kernels.LOSS + 4, 1),
        (kernels.LOSS + 5, 2),
    ):
        out[first] /= modes.mass**power
    return out


def _step_table(kernels, modes: ModalBasis, drive, steps: int, prop) -> np.ndarray:
    """Return the table of the steps of a cycle under a drive of 1 m s-2.

    Parameters
    ----------
    kernels
    modes : ModalBasis
    drive : float
        Acceleration of the base [m s-2].
    steps
    prop : propagator.Propagator
    """
    n = modes.omega.size
    unit = replace(drive, acceleration=1.0)
    found = prop.tables(unit, 0, steps)
    out = np.zeros((steps, kernels.N_COLUMNS))
    for k in range(8):  # one column of each kind per mode
        out[:, k * kernels.N_RIG_MODES : k * kernels.N_RIG_MODES + n] = found[
            :, k * n : (k + 1) * n
        ]
    angle = 2 * np.pi * np.arange(steps) / steps
    for forms in (
        kernels.WORK_FORMS,
        kernels.LOSS_FORMS,
    ):  # these apply to forces [N] instead of accelerations
        out[:, forms + 2 * kernels.N_RIG_MODES : forms + 3 * kernels.N_RIG_MODES] /= modes.mass
    out[:, kernels.REMAINDERS : kernels.REMAINDERS + 2] = found[:, 8 * n : 8 * n + 2]
    out[:, kernels.PORT_SLIDE] = found[:, 8 * n + 3]
    out[:, kernels.WAVES :] = np.array([np.cos(angle), np.sin(angle)]).T
    return out


def _make_workspace(kernels, cases: list) -> np.ndarray:
    """Return the workspace of cases at rest; the last case fills lanes that are left over."""
    out = np.zeros((kernels.N_NUMBERS, kernels.LANES))
    points = kernels.N_POINTS
    for i in range(kernels.LANES):
        one = cases[min(i, len(cases) - 1)]
        few, modes = one.shape.shape
        out[[kernels.DRIVE, kernels.BOND_LENGTH, kernels.LIMIT], i] = (
            one.amplitude,
            one.length,
            one.limit.sum(),
        )
        out[kernels.POINT_LIMITS : kernels.POINT_LIMITS + few, i] = one.limit
        out[kernels.STIFFNESSES : kernels.STIFFNESSES + kernels.N_PIECE_MODES, i] = (
            one.stiffness.max()
        )
        for k in range(modes):
            first = kernels.SHAPES + k * points
            out[first : first + few, i] = one.shape[:, k]
            out[kernels.STIFFNESSES + k, i] = one.stiffness[k]
            out[kernels.MAX_SHAPES + k, i] = np.abs(one.shape[:, k]).max()
            out[kernels.MEAN_SHAPES + k, i] = one.limit @ one.shape[:, k] / one.limit.sum()
    return out


def march(
    modes: ModalBasis, drive: SineDrive, cases: list, cycles: int, steps: int, window: int
) -> MarchedCases:
    """March cases over cycles of a drive from rest, each under its own amplitude.

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
    Marched
    """
    kernels = load(LANES_KERNELS)
    prop = make_propagator(modes, drive, steps)
    rig = _rig_rows(kernels, modes, prop)
    table = _step_table(kernels, modes, drive, steps, prop)
    n = len(cases)
    parts = []
    for first in range(0, n, kernels.LANES):
        workspace = _make_workspace(kernels, cases[first : first + kernels.LANES])
        few = min(kernels.LANES, n - first)
        history = np.zeros((cycles, 4, kernels.LANES))
        work = np.zeros(kernels.LANES)
        samples = np.zeros((window * steps + 1, kernels.N_SAMPLE, kernels.LANES))
        kernels.march(workspace.ravel(), rig, table, history, samples, work)
        parts.append((workspace[:, :few], history[:, :, :few], samples[:, :, :few], work[:few]))
    workspace, history, samples, work = (np.concatenate(one, axis=-1) for one in zip(*parts))
    m = modes.omega.size
    r = kernels.N_RIG_MODES
    book = {name: workspace[getattr(kernels, row)] for name, row in LEDGER_ROWS.items()}
    moving = (
        workspace[kernels.RIG_RATE : kernels.RIG_RATE + m] ** 2
        + (modes.omega[:, None] * workspace[:m]) ** 2
    ).sum(axis=0)
    book["stored"] = 0.5 * modes.mass * moving + workspace[kernels.INTERFACE_ENERGY]
    return MarchedCases(
        history[:, :2].transpose(2, 0, 1),
        (history[:, 2] + 1j * history[:, 3]).T,
        book,
        samples[:, :m],
        samples[:, r : r + m],
        samples[:, 2 * r],
        samples[:, 2 * r + 1],
        book["booked"] - work,
        workspace[kernels.MAX_SLIDE],
        workspace[kernels.N_UNSOLVED],
    )
