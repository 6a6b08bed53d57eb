"""Loop of a march: whole steps, their halving, ports that return to rest, energies and samples (compiled).

`march_kernels` solves the steps. It is the part `steps`, which `compiled.instantiate` puts in with the parts of a rig.

`system` is a `march_rows_kernels.System`. A step of level k lasts a whole step over 2^k.
"""

from ..contact.set_arrays import PRESENT_SLOT_INDEX
from ..kernel_cache.flags_kernels import NJIT_CALL, NJIT_KERNEL
from ..kernel_cache.jit import njit
from . import flanks_kernels as flanks
from . import march_kernels as steps
from . import normal_kernels as normal
from .march_rows_kernels import (
    DONE,
    EXCEEDS_TRAVEL,
    LEAVES_GROOVES,
    N_PORT_COLUMNS,
    NO_CONTACT_SET,
    NOT_FINITE,
    TOO_MANY_PARTS,
    Flank,
    Port,
    Sample,
    Shear,
    Total,
)
from .motion_kernels import (
    add_energies,
    extrapolate_shear,
    move_freely,
    return_ports,
    sum_products,
    write_trial,
)
from .step_rows_kernels import Value

# Parts of a whole step, of which a stop or a release takes about 40, after which rigid friction stops and slips too often
MAX_PARTS = 20_000


@njit(**NJIT_CALL)
def find_held_ports(system):
    """Write to `Port.HELD` which ports are held at rest; return whether any is."""
    moves = system.ports.values
    is_any_held = False
    for p in range(moves.shape[1]):
        is_held = steps.is_held(system.points.memory, system.points, p)
        moves[Port.HELD, p] = 1.0 if is_held else 0.0
        is_any_held = is_any_held or is_held
    return is_any_held


@njit(**NJIT_CALL)
def try_step(system, level, row, begin, end, drive):
    """Advance the motion by a step, unless the step must be halved.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    row : int
        Number of the whole step.
    begin, end : float
        Start and end of the step, as fractions of the whole step.
    drive : tuple of float
        Value, slope and second derivative of the drive at the start of the step [m s-2], per second and per second
        squared.

    Returns
    -------
    bool
        False if rigid friction changes its regime within the step, or if Newton's method failed, and the step can be
        halved. Then the motion has not advanced. True after a step, and also if no contact set was found, in which case
        the counter `PRESENT_SLOT_INDEX` is -1.
    """
    dt = system.options.step / (1 << level)
    move_freely(system, level, drive, row, begin)
    extrapolate_shear(system.points, dt)
    loads = system.structure.loads
    if system.flank.size and loads.size:
        slope = loads[row + 1] - loads[row]
        system.flank[Flank.ADDED] = (
            loads[row] + 0.5 * (begin + end) * slope - system.flank[Flank.LOAD]
        )
        system.flank[Flank.RISE] = 0.5 * (end - begin) * slope
    is_solved = steps.solve_step(system, level, row, end)
    if system.sets.counters[PRESENT_SLOT_INDEX] < 0:
        return True

    # An event inside the step, or Newton's method without a solution, halves the step.
    write_trial(system, level)
    is_last = steps.is_shortest(system, level)
    last = drive[0] + dt * (drive[1] + 0.5 * dt * drive[2])
    has_event = bool(system.options.has_events) and steps.find_event(system, level, last)
    if has_event and not is_last:
        return False
    if not is_last and steps.gains_energy(system):
        return False
    if not is_solved:
        # After a shortest step without a solution the march has no result, and shorter steps would only take time.
        if not is_last and system.totals[Total.UNSOLVED] == 0:
            return False
        system.totals[Total.UNSOLVED] += 1

    steps.commit(system, dt)
    advance_modes(system, dt)
    add_energies(system, level)
    if has_event:
        steps.settle(system, last)
        find_held_ports(system)
    return True


@njit(**NJIT_CALL)
def advance_modes(system, dt):
    """Advance modes and flank after an accepted step of `dt` [s]; bring held ports to rest.

    `Total.REST` is then the work of the drive on motions that are taken back.
    """
    flank = system.flank
    for i in range(system.state.shape[1]):
        system.state[0, i] = system.state[2, i]

    # Held ports come back to rest, which may also move the holder.
    energy = normal.find_motion_energy(system)
    if find_held_ports(system) and system.sets.counters[PRESENT_SLOT_INDEX] >= 0:
        return_ports(system)
        system.totals[Total.REST] += energy - normal.find_motion_energy(system)
        if system.ports.contact[0] >= 0:
            press_at_rest(system)

    if flank.size:
        flanks.accept_climb(flank, system.ports.values[Port.INCREMENT, 0], dt)
        flank[Flank.FORCE] = steps.sum_forces(system, 0)


@njit(**NJIT_CALL)
def press_at_rest(system):
    """Give the points the loads of the present state, while their ports rest.

    A start with heave, and ports that come back to rest, change the loads outside of steps.
    """
    if system.sets.counters[PRESENT_SLOT_INDEX] < 0:
        return  # the march ends without a contact set
    ports = system.ports
    n = system.state.shape[1] // 2
    for i in range(2 if ports.contact[0] >= 0 else 0):
        p = int(ports.contact[i])
        ports.values[Port.SLIDE, p] = sum_products(ports.rows[p], system.state[0, :n])
        ports.values[Port.INCREMENT, p] = 0.0
    steps.press_at_rest(system)


@njit(**NJIT_CALL)
def write_sample(system, row, sample):
    """Write forces, slips and energies at the present state to a sample, and its modal coordinates and velocities.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    row : int
        Number of the whole step.
    sample : (k,) array
        Sample, in the rows of `march_rows_kernels.Sample`; output.
    """
    ports = system.ports
    points = system.points
    structure = system.structure
    state = system.state[0]
    size = state.size
    for k in range(size):
        sample[k] = state[k]
    if system.options.has_events:
        for p in range(ports.values.shape[1]):
            ports.newton.residual[p] = steps.sum_forces(system, p)
        normal.find_holds(system, state, structure.drive[row, 0])

    for p in range(ports.values.shape[1]):
        slide = structure.path[row] if structure.path.size else 0.0
        if size > 0:
            slide = sum_products(ports.rows[p], state[: size // 2])
        ports.values[Port.SLIDE, p] = slide

    # Stored energy of pieces, points and grooves
    energy = 0.0
    for k in range(points.pieces.stiffness.size):
        energy += 0.5 * points.pieces.stiffness[k] * points.pieces.shear[Shear.VALUE, k] ** 2
    sample[size + Sample.ENERGY] = energy
    sample[size + Sample.SPRINGS] = 0.0
    sample[size + Sample.LOAD] = structure.loads[row] if structure.loads.size else 0.0
    steps.write_ports(system, sample)
    if system.flank.size:
        path = points.values[0, Value.TOTAL]  # of the first point along its flank
        flanks.write_sample(system.flank, ports.values[Port.SLIDE, 0], path, sample, size)
    if ports.contact[0] >= 0:
        normal.write_sample(system, sample)


@njit(**NJIT_CALL)
def judge_sample(system, sample):
    """Return the status of a march at a sample, as defined in `march_rows_kernels`."""
    output = sum_products(sample, system.structure.modes[2])
    if not abs(output) <= system.options.travel:
        return EXCEEDS_TRAVEL if output == output else NOT_FINITE
    if system.flank.size and system.flank[Flank.HAS_LIFTED] > 0:
        return LEAVES_GROOVES
    return DONE


@njit(**NJIT_KERNEL)
def march(system, n_steps, samples):
    """March over a number of whole steps, or find loads and forces of the points at the present state for 0 steps.

    Parameters
    ----------
    system : march_rows_kernels.System
        Changed in place.
    n_steps : int
        Number of steps.
    samples : (n_steps + 1, k) array
        Samples before each step and at the end (output).

    Returns
    -------
    int
        Number of steps done.
    int
        Status, as defined in `march_rows_kernels`.
    """
    size = system.state.shape[1]
    ticks = 1 << (system.structure.responses.motion.shape[0] - 1)
    dt = system.options.step
    first_column = size + Sample.PORTS + 2
    level = 0
    find_held_ports(system)
    if n_steps == 0:
        press_at_rest(system)

    for i in range(n_steps + 1):
        write_sample(system, i, samples[i])
        status = judge_sample(system, samples[i])
        if status != DONE or i == n_steps:
            return i, status

        # Mean forces of the ports in the whole step; `add_work` sums them over its parts.
        for p in range(system.ports.values.shape[1]):
            samples[i, first_column + N_PORT_COLUMNS * p] = 0.0

        # A step that fails is halved; steps double again once they end on a tick of the longer one.
        work = 0.0
        tick = 0
        n_parts = 0
        while tick < ticks:
            part = ticks >> level
            tau = dt * tick / ticks
            coefficients = system.structure.drive[i]
            drive = (
                coefficients[0] + tau * (coefficients[1] + 0.5 * tau * coefficients[2]),
                coefficients[1] + tau * coefficients[2],
                coefficients[2],
            )
            if not try_step(system, level, i, tick / ticks, (tick + part) / ticks, drive):
                level += 1
                continue
            if system.sets.counters[PRESENT_SLOT_INDEX] < 0:
                return i, NO_CONTACT_SET

            work += steps.add_work(system, samples[i], first_column, part / ticks)
            tick += part
            n_parts += 1
            if n_parts > MAX_PARTS:
                return i, TOO_MANY_PARTS
            if level > 0 and tick % (2 * part) == 0:
                level -= 1
        samples[i, size + Sample.WORK] = work
    return n_steps, DONE
