"""Normal contact of a patch whose pressure changes with heave and pitch, for a march (compiled).

`system` is a `march_rows_kernels.System`. The first two entries of `ports.contact` are the numbers of the ports of heave and
pitch. The contact carries its reference load and moment, less the derivatives of its energy by heave and pitch.
"""

from ..contact.press_kernels import compute_energy, find_set, press_state
from ..contact.press_path_kernels import path_mean
from ..contact.set_arrays import PRESENT_SLOT_INDEX, REFERENCE_LOAD_INDEX, REFERENCE_MOMENT_INDEX
from ..kernel_cache.flags_kernels import NJIT_CALL
from ..kernel_cache.jit import njit
from .march_rows_kernels import Port, Sample
from .motion_kernels import find_modal_energy, solve_holds, sum_products


@njit(**NJIT_CALL)
def average_forces(points):
    """Write the weighted averages of the nodal forces behind each node to `points.loads.averaged`, and their sums.

    The averages for slides to +x come first, then those for slides to -x. A node without load has the average 0. The sum
    behind a node ends at the first segment whose two nodes carry no load.
    """
    forces = points.loads.nodal
    n = forces.size
    for k in range(2):
        total = 0.0
        for j in range(n):
            load = 0.0
            s = j - 1 + k
            while forces[j] > 0 and 0 <= s < n - 1 and (forces[s] > 0 or forces[s + 1] > 0):
                weights = points.loads.averages[k, j, s]
                load += weights[0] * forces[s] + weights[1] * forces[s + 1]
                s += 2 * k - 1
            points.loads.averaged[k * n + j] = load
            total += load
        points.loads.averaged[2 * n + k] = total


@njit(**NJIT_CALL)
def find_resultant(system, forces):
    """Return the resultant load at the end of a trial step [N], -1 without a contact set; write the forces of the nodes.

    `forces` (n,) are the forces of the nodes [N], output.
    """
    moves = system.ports.values
    heave = int(system.ports.contact[0])
    pitch = int(system.ports.contact[1])
    up = moves[Port.SLIDE, heave] + moves[Port.INCREMENT, heave]
    turn = moves[Port.SLIDE, pitch] + moves[Port.INCREMENT, pitch]
    slot = find_set(system.sets, system.sets.counters[PRESENT_SLOT_INDEX], -up, turn)
    if slot < 0:
        return -1.0
    press_state(system.sets, slot, -up, turn, forces)
    if system.points.loads.averages.size:
        average_forces(system.points)
    energy = compute_energy(system.sets, slot, up, turn)
    return max(system.sets.reference[REFERENCE_LOAD_INDEX] - energy.heave_slope, 0.0)


@njit(**NJIT_CALL)
def add_residuals(system):
    """Add the change of load and moment of the contact to the residuals of heave and pitch; return its size [N]."""
    ports = system.ports
    moves = ports.values
    heave = int(ports.contact[0])
    pitch = int(ports.contact[1])
    path_mean(
        system.sets,
        system.sets.counters[PRESENT_SLOT_INDEX],
        moves[Port.SLIDE, heave],
        moves[Port.SLIDE, pitch],
        moves[Port.INCREMENT, heave],
        moves[Port.INCREMENT, pitch],
        ports.contact[2:11],
    )
    ports.newton.residual[heave] += ports.contact[2]
    ports.newton.residual[pitch] += ports.contact[3]
    return abs(ports.contact[2])


@njit(**NJIT_CALL)
def add_slopes(system, level):
    """Add to the Jacobian how the contact couples heave and pitch, by the derivatives of its load and moment."""
    ports = system.ports
    compliance = ports.compliance[level]
    heave = int(ports.contact[0])
    pitch = int(ports.contact[1])
    for i in range(2):
        p = heave if i == 0 else pitch
        for k in range(ports.values.shape[1]):
            change = ports.contact[7 + 2 * i] * compliance[0, heave, k]
            ports.newton.matrix[p, k] -= change + ports.contact[8 + 2 * i] * compliance[0, pitch, k]


@njit(**NJIT_CALL)
def find_holds(system, state, drive):
    """Write the forces that hold ports at rest at an instant to `Port.HOLD` [N].

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march; `ports.newton.residual` has the forces of the points of each port.
    state : (2 n,) array
        Modal coordinates and velocities.
    drive : float
        Drive at this instant [m s-2].
    """
    ports = system.ports
    n = state.size // 2
    heave = int(ports.contact[0])
    pitch = int(ports.contact[1])
    up = sum_products(ports.rows[heave], state[:n])
    turn = sum_products(ports.rows[pitch], state[:n])
    energy = compute_energy(system.sets, system.sets.counters[PRESENT_SLOT_INDEX], up, turn)
    ports.newton.residual[heave] += energy.heave_slope
    ports.newton.residual[pitch] += energy.rotation_slope
    solve_holds(system, state, drive)


@njit(**NJIT_CALL)
def find_motion_energy(system):
    """Return the energy of the modes and of the contact [J], and find the present contact set."""
    state = system.state[0]
    ports = system.ports
    n = state.size // 2
    up = sum_products(ports.rows[int(ports.contact[0])], state[:n])
    turn = sum_products(ports.rows[int(ports.contact[1])], state[:n])
    slot = find_set(system.sets, system.sets.counters[PRESENT_SLOT_INDEX], -up, turn)
    system.sets.counters[PRESENT_SLOT_INDEX] = slot
    energy = find_modal_energy(system)
    return energy + compute_energy(system.sets, slot, up, turn).value if slot >= 0 else energy


@njit(**NJIT_CALL)
def write_sample(system, sample):
    """Write load, moment and energy of the contact, heave and pitch to a sample (`march_rows_kernels.Sample`)."""
    ports = system.ports
    size = system.state.shape[1]
    up = ports.values[Port.SLIDE, int(ports.contact[0])]
    turn = ports.values[Port.SLIDE, int(ports.contact[1])]
    energy = compute_energy(system.sets, system.sets.counters[PRESENT_SLOT_INDEX], up, turn)
    reference = system.sets.reference
    sample[size + Sample.LOAD] = max(reference[REFERENCE_LOAD_INDEX] - energy.heave_slope, 0.0)
    sample[size + Sample.MOMENT] = reference[REFERENCE_MOMENT_INDEX] - energy.rotation_slope
    sample[size + Sample.CONTACT_ENERGY] = energy.value
    sample[size + Sample.HEAVE] = up
    sample[size + Sample.PITCH] = turn
