"""Static contact of patches that rigid holders press: all cases of one pair of pieces together.

The motion q = (delta, -theta) of the holder, or as much of it as is free, closes a node at x by R q with R = (1, x).

`press` finds the contact sets of all cases on one table (`press_cases`). A case whose sets cycle or lose digits is solved
alone (`unilateral.solve`), and its solution is checked.

Asperities form a compliant layer with the local law P(s) in series with the pieces: a node of area A_i carries
f_i = A_i P(s_i) at the separation s_i = g_i + theta x_i - delta + (C f)_i of the mean planes. P >= 0 decreases with s,
so the solution is unique for every law, gap and control. A linear law, which carries nothing beyond s = 0, adds 1/(k A_i)
to the diagonal of C; cases with a smooth law are solved alone (`asperity_layer`).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..core import Compliance, PatchfemError
from ..elasticity.lapack import use_one_blas_thread
from ..formatting import format_length
from . import asperity_laws, asperity_layer
from .press_cases import MIN_COMPUTABLE_LOAD, Holders, press_on_table
from .set_table import SetTable
from .unilateral import make_problem, solve


class SmoothLayer(NamedTuple):
    """Asperity layer of a smooth law between the pieces of n cases.

    - area (m,): areas [m2] of the nodes.
    - make_law: function of a load [N] that returns the law, an `asperity_laws.SmoothAsperities`.
    """

    area: np.ndarray
    make_law: "Callable[[float], asperity_laws.SmoothAsperities]"


class Pressed(NamedTuple):
    """Contact of n cases at m nodes, or of a single one without the first axis; a case with an error has no forces.

    - force (n, m): nodal forces [N] >= 0; all are 0 if nothing touches.
    - gap (n, m): gap under load [m]; with a smooth asperity law the separation of the mean planes, negative where the layer
      is compressed.
    - approach, turn (n,): approach [m], and rotation [rad] that the given gap does not contain.
    - layer_stiffness (n, m): stiffness of a smooth asperity layer [Pa/m]; None without such a layer.
    - errors: PatchfemError of each case that cannot be pressed, by its number; None for a single case.
    """

    force: np.ndarray
    gap: np.ndarray
    approach: np.ndarray
    turn: np.ndarray
    layer_stiffness: np.ndarray | None = None
    errors: dict[int, PatchfemError] | None = None


def press(
    table: SetTable, holders: Holders, amplitudes, start, layer: SmoothLayer | None = None
) -> Pressed:
    """Solve the contact of patches that differ in their loads and in the amplitudes of their gap shapes.

    The forces are those of strictly convex quadratic programs, so that neither the sets from which the search starts nor
    the method that finds them changes them.

    Parameters
    ----------
    table : SetTable
        Contact sets, with the columns 1 and x, and the gap shapes (p, m) [m per unit amplitude].
    holders : Holders
        Loads and prescribed motions of the n cases.
    amplitudes : (n, p) ndarray
        Factors of the gap shapes.
    start : (n, m) bool ndarray
        Contact sets from which the search starts; an empty one is replaced by a guess.
    layer : SmoothLayer, optional
        Asperity layer of a smooth law, which the compliance of the table does not contain.

    Returns
    -------
    Pressed
    """
    unloaded_gap = amplitudes @ table.columns[2:]
    n_cases = len(unloaded_gap)
    force = np.zeros(unloaded_gap.shape)
    motion = np.zeros((2, n_cases))
    stiffness = None if layer is None else np.zeros(force.shape)
    out = Pressed(force, unloaded_gap.copy(), *motion, stiffness, {})

    with use_one_blas_thread():
        is_alone = np.ones(n_cases, bool)
        if layer is None:
            sets = press_on_table(table, holders, amplitudes, start)
            is_solved = sets.is_solved & holders.are_computable(unloaded_gap.min(axis=1))
            is_alone = ~is_solved
            slots = sets.slot[is_solved]
            unknown = table.combine(slots, sets.closing[is_solved])
            active = table.active[slots]
            out.force[is_solved] = np.where(active, unknown, 0.0)
            out.gap[is_solved] = np.where(active, 0.0, np.maximum(unknown, 0.0))
            motion[:, is_solved] = sets.closing[is_solved, :2].T
            out.turn[:] *= -1

        for case in np.flatnonzero(is_alone).tolist():
            try:
                state = _press_alone(table, unloaded_gap[case], holders.take(case), layer)
            except PatchfemError as error:
                out.errors[case] = error
                continue
            for column, value in zip(out[:-1], state):
                if value is not None:
                    column[case] = value
    return out


def press_patch(
    pieces: Compliance,
    gap: np.ndarray,
    holder: Holders,
    asperities: "asperity_laws.SmoothAsperities | None" = None,
    start: np.ndarray | None = None,
) -> Pressed:
    """Solve the contact of a single patch that a holder presses.

    Parameters
    ----------
    pieces : Compliance
        Compliance of the pieces at the m nodes, with a linear layer of asperities; that of rigid pieces, 0, needs a law.
    gap : (m,) ndarray
        Gap [m] with the prescribed rotation.
    holder : Holders
        Loads and prescribed motions, as numbers.
    asperities : ExponentialAsperities or HertzAsperities, optional
        Smooth pressure law of the asperities.
    start : (m,) bool ndarray, optional
        Nodes in contact of a similar state, from which the search for the contact set starts.

    Returns
    -------
    Pressed

    Raises
    ------
    PatchfemError
        For a load below zero or too small, a moment that no pressure can carry, or values that are not finite.
    NotConverged
        If a residual exceeds 1e-12, with a smooth asperity law 1e-9.
    """
    x = pieces.interface.x
    columns = np.array([np.ones(x.size), x, gap])
    table = SetTable(pieces.normal, columns, x.size, has_ends=False)
    holders = Holders(*np.array([holder], float).T)
    start = np.zeros((1, x.size), bool) if start is None else start[None]
    layer = None
    if asperities is not None:
        layer = SmoothLayer(pieces.interface.weight, lambda load: asperities)
    pressed = press(table, holders, np.ones((1, 1)), start, layer)
    for error in pressed.errors.values():
        raise error
    return Pressed(*(column[0] for column in pressed[:-1] if column is not None))


def _press_alone(table: SetTable, gap, holder: Holders, layer: SmoothLayer | None) -> Pressed:
    """Press a single case with a gap (m,) [m], without the contact sets of the table.

    Raises
    ------
    PatchfemError
        If the case cannot be pressed (`press_patch`).
    """
    x = table.columns[1]
    _refuse_unsolvable(x, gap, holder)
    touching = float(gap.min())
    if holder.load == 0:
        no_force = np.zeros(x.size)
        return Pressed(no_force, gap - touching, touching, 0.0, layer and no_force)

    # A gap that is measured from a point near the contact loses no digits to a large offset.
    reference = 0.0 if layer else touching
    if np.isnan(holder.load):
        reference = holder.approach
    problem = make_problem(x, gap - reference, holder)
    if layer:
        law = layer.make_law(holder.load)
        rough = asperity_layer.AsperityProblem(law, table.compliance, layer.area, problem)
        solution = asperity_layer.press_with_asperities(rough)
        opening = solution.separation
        stiffness = law.stiffness(opening) * (solution.force > 0)
    else:
        solution = solve(table.compliance, problem)
        opening = problem.gap - solution.motion @ problem.motions
        opening += table.compliance @ solution.force
        opening = np.where(solution.force > 0, 0.0, np.maximum(opening, 0.0))
        stiffness = None
    approach, rotation = np.append(solution.motion, [0.0, 0.0])[:2].tolist()
    return Pressed(solution.force, opening, reference + approach, -rotation, stiffness)


def _refuse_unsolvable(x: np.ndarray, gap: np.ndarray, holder: Holders) -> None:
    """Raise PatchfemError for loads and approaches that numbers cannot represent, and for pieces that tip over.

    `gap` (m,) [m] is that of the nodes at `x` (m,) [m] without load, and `holder` has the loads and prescribed motions. The
    load line of a free rotation lies at x = moment/load.
    """
    load = holder.load
    if np.isnan(load) and not np.isnan(holder.approach):
        overlap = holder.approach - gap.min()
        if 0 < overlap < MIN_COMPUTABLE_LOAD:
            raise PatchfemError(
                f"contact.approach: an overlap of {format_length(overlap, 3)} is too small to compute with; for "
                f"pieces that touch without load give {gap.min():.6g} m"
            )
        return
    if not (load == 0 or MIN_COMPUTABLE_LOAD <= load <= 1 / MIN_COMPUTABLE_LOAD):
        raise PatchfemError(
            f"contact.load: {load:.3g} N cannot be computed with; give 0 (touching without load) or a load > 0 of at "
            f"least {MIN_COMPUTABLE_LOAD:.0e} N"
        )

    # A free rotation tips over if the load line lies outside the pieces.
    if load and not (np.isnan(holder.moment) or holder.spring):
        load_line = holder.moment / load
        half_length = np.ptp(x) / 2 * (1 - 1e-13)
        if not abs(load_line - (x[0] + x[-1]) / 2) < half_length:
            raise PatchfemError(
                f"contact.load_line: the load line lies {load_line:.6g} m from the middle, outside the half length "
                f"{half_length:.6g} m: the piece tips over; "
                "move the load line towards the middle"
            )
