"""Contact functions of bond points coupled by shear modes under a constant load (compiled).

The arrays are `arrays.ShearedPoints`.

For most of a cycle of gross slip all points are in steady full slip: their bonds are those of an endless slide,
and a further slide in the same direction has the force weight length load at every point, whatever
its size. Such a step has a closed form in the modes alone (`solve_full_slip_step`). The slide of a
point is that of the holder minus psi^T b at all times. `march.loop_kernels` calls the functions of
every contact.
"""

from ...compiled.jit import njit
from ...friction.bonds.point_kernels import bond_step, grow, short_bond_step
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ...friction.protocol_kernels import Reading
from .arrays import BondSums, FullSlipRow, PointRow, SlipStateIndex, SolvedStep, StepProblem
from .shear_points_kernels import POINTS, are_slides_short
from .shear_solve_kernels import accept_step, minimise, set_middle_length

# Largest relative deviation of the bonds of a point from those of steady full slip; the tolerance
# of their energy is 100 times as large.
FULL_SLIP_TOL = 2e-15


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def solve_step(free, beta, start, contact, goal):
    """Solve the slide increment and mean friction force of a step.

    Parameters
    ----------
    free : float
        Increment of the relative displacement in the absence of friction [m].
    beta : float
        Compliance of the modes in the step [m/N].
    start : arrays.StepStart
        State at the start of the step.
    contact : arrays.ShearedPoints
        Its row y[0] gets the increments of the holder and of the shear modes.
    goal : float
        Tolerance of the residual [N].

    Returns
    -------
    arrays.SolvedStep
        Increment [m], mean friction force [N] and number of iterations: zero if all points are in
        steady full slip, negative if the solution did not converge.
    """
    if contact.slip_state[SlipStateIndex.FULL_SLIP_DIRECTION] != 0.0 and solve_full_slip_step(
        free, beta, contact
    ):
        force = (
            contact.slip_state[SlipStateIndex.FULL_SLIP_DIRECTION]
            * contact.full_slip[FullSlipRow.FORCE, 0]
        )
        return SolvedStep(contact.y[0, 0], force, 0)
    contact.slip_state[SlipStateIndex.FULL_SLIP_DIRECTION] = 0.0
    set_middle_length(start.velocity, start.dt, contact)
    force, count = minimise(StepProblem(free, beta, POINTS, False), contact, goal)
    return SolvedStep(contact.y[0, 0], force, count)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_full_slip_step(free, beta, contact):
    """Solve a step in closed form if all points are in steady full slip.

    The solution is that of kappa (b + db/2) = psi^T f.

    Parameters
    ----------
    free : float
        Increment in the absence of friction [m].
    beta : float
        Compliance of the modes in the step [m/N].
    contact : arrays.ShearedPoints

    Returns
    -------
    bool
        Whether all points remain in full slip in this step; contact.y[0] is then its solution.
    """
    direction = contact.slip_state[SlipStateIndex.FULL_SLIP_DIRECTION]
    y = contact.y[0]
    min_increment = 0.0
    dq = free - beta * direction * contact.full_slip[FullSlipRow.FORCE, 0]
    for k in range(contact.b.size):
        y[k + 1] = 2 * (
            direction * contact.full_slip[FullSlipRow.FORCE, k + 1] / contact.kappa[k]
            - contact.b[k]
        )
        min_increment += contact.full_slip[FullSlipRow.MAX_SLIDE, k + 1] * abs(y[k + 1])
    if direction * dq <= min_increment:
        return False
    y[0] = dq
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def apply_increment(dq, start, contact, goal):
    """Return the mean friction force over a prescribed increment without updating the memory.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    start : arrays.StepStart
    contact : arrays.ShearedPoints
    goal : float
        Tolerance of the residual [N].

    Returns
    -------
    force : float
        Mean of the force over the path dq [N].
    is_solved : bool
        Whether the solution converged.
    """
    contact.slip_state[SlipStateIndex.FULL_SLIP_DIRECTION] = 0.0
    contact.y[0, 0] = dq
    solution = solve_step(dq, 0.0, start, contact, goal)
    return solution.mean_force, solution.iterations >= 0


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def commit_step(dq, force, start, end_velocity, contact):
    """Update the points and pieces after a converged step.

    The bonds of each point advance by its slide xi (eq. 2.17 for p = 1, in the form of the moments m, z
    and s2 of `friction.bonds.point_kernels`), and the mode coordinates b of the pieces by db.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    force : float
        Mean of the force over the path dq [N].
    start : arrays.StepStart
    end_velocity : float
        Relative velocity at the end of the step [m/s].
    contact : arrays.ShearedPoints

    Returns
    -------
    loss : float
        Energy dissipated [J].
    is_solved : bool
        Always true.
    """
    direction = contact.slip_state[SlipStateIndex.FULL_SLIP_DIRECTION]
    length = contact.eps[1]
    dissipated = 0.0
    contact.slip_state[SlipStateIndex.TOTAL_SLIDE] += dq
    if direction != 0.0:
        for k in range(contact.y.shape[1]):
            dissipated += (
                direction
                * contact.full_slip[FullSlipRow.FORCE, k]
                * contact.y[0, k]
                * (1.0 if k == 0 else -1.0)
            )
        accept_step(contact)
        return dissipated, True
    if are_slides_short(contact, length):
        dissipated = update_points_short(contact, length)
    else:
        dissipated = update_points(contact, length)
    accept_step(contact)
    contact.eps[0] = grow(
        contact.eps[0], start.velocity, end_velocity, abs(dq), start.dt, contact.growth
    )[0]
    if contact.growth[0] < 0.0:
        contact.slip_state[SlipStateIndex.FULL_SLIP_DIRECTION] = find_full_slip_direction(
            1.0 if dq > 0.0 else -1.0, contact
        )
    return dissipated / 2, True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_full_slip_direction(direction, contact):
    """Return the direction of steady full slip of all points, or 0 if they are not in full slip."""
    points = contact.points
    length = contact.eps[0]
    for j in range(contact.weight.size):
        load = points[PointRow.LOAD, j]
        if not (
            abs(points[PointRow.STRETCH, j] - direction * length * load)
            <= FULL_SLIP_TOL * length * load
            and abs(points[PointRow.DENSITY, j] - load) <= FULL_SLIP_TOL * load
            and abs(points[PointRow.SQUARED_STRETCH, j] - 2 * length * length * load)
            <= 100 * FULL_SLIP_TOL * length * length * load
        ):
            return 0.0
    return direction


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def update_points_short(contact, length):
    """Update all points for slides below MAX_SHORT_PATH bond lengths.

    Returns twice the energy dissipated [J].
    """
    points = contact.points
    dissipated = 0.0
    for j in range(contact.weight.size):
        xi = points[PointRow.SLIDE, j]
        (
            points[PointRow.DENSITY, j],
            points[PointRow.STRETCH, j],
            points[PointRow.SQUARED_STRETCH, j],
            part,
        ) = short_bond_step(
            points[PointRow.DENSITY, j],
            points[PointRow.STRETCH, j],
            points[PointRow.SQUARED_STRETCH, j],
            xi,
            points[PointRow.LOAD, j],
            length,
        )
        dissipated += contact.weight[j] * part
    return dissipated


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def update_points(contact, length):
    """Update all points for slides of any size.

    Parameters
    ----------
    contact : arrays.ShearedPoints
    length : float
        Bond length [m].

    Returns
    -------
    float
        Twice the energy dissipated [J].
    """
    points = contact.points
    dissipated = 0.0
    for j in range(contact.weight.size):
        m = points[PointRow.DENSITY, j]
        z = points[PointRow.STRETCH, j]
        s2 = points[PointRow.SQUARED_STRETCH, j]
        xi = points[PointRow.SLIDE, j]
        m, z, s2, part = bond_step(m, z, s2, xi, points[PointRow.LOAD, j], length)
        points[PointRow.DENSITY, j] = m
        points[PointRow.STRETCH, j] = z
        points[PointRow.SQUARED_STRETCH, j] = s2
        dissipated += contact.weight[j] * part
    return dissipated


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def read_state(contact, rel_disp, velocity):
    """Return friction force, stored energy and slip of points and pieces.

    Parameters
    ----------
    contact : arrays.ShearedPoints
    rel_disp : float
        Relative displacement [m].
    velocity : float
        Relative velocity [m/s].

    Returns
    -------
    friction.protocol_kernels.Reading
    """
    direction = contact.slip_state[SlipStateIndex.FULL_SLIP_DIRECTION]
    energy = 0.0
    slip = contact.slip_state[SlipStateIndex.TOTAL_SLIDE]
    for k in range(contact.b.size):
        energy += 0.5 * contact.kappa[k] * contact.b[k] ** 2
        slip -= contact.full_slip[FullSlipRow.MEAN_SLIDE, k + 1] * contact.b[k]
    if direction != 0.0:
        limit = contact.full_slip[FullSlipRow.FORCE, 0]
        energy += contact.eps[0] * limit
        return Reading(direction * limit, energy, slip - direction * contact.eps[0])
    sums = sum_bonds(contact)
    slip = slip - sums.stretch / sums.load if sums.load > 0 else rel_disp
    return Reading(sums.force, energy + sums.energy, slip)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def sum_bonds(contact):
    """Return the sums of force, energy, stretch and load over all bond points."""
    points = contact.points
    force = 0.0
    energy = 0.0
    stretch = 0.0
    total = 0.0
    for j in range(contact.weight.size):
        m = points[PointRow.DENSITY, j]
        z = points[PointRow.STRETCH, j]
        share = contact.weight[j] * points[PointRow.LOAD, j]
        force += contact.weight[j] * z
        energy += 0.5 * contact.weight[j] * points[PointRow.SQUARED_STRETCH, j]
        stretch += share * (z / m) if m > 0.0 else 0.0
        total += share if m > 0.0 else 0.0
    return BondSums(force, energy, stretch, total)
