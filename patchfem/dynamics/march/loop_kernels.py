"""The compiled loop of the march, and its counterpart for a prescribed slide.

Over a step the modes move exactly under the path means of the friction forces along the straight increments of slide,
which do exactly the work of the laws: the sum of all energies never grows by itself. The interface is one contact, or
elements beside it or in its place (`faces_kernels`); the load is constant or varies (`pressing_kernels`). A contact is a
module with `solve_step`, `apply_increment`, `commit_step` and `read_state`, see `interfaces.element_kernels`. `instances`
makes an instance of this text per contact and set of parts, and what a rig does not have is not compiled.
"""

from ...compiled.jit import njit
from ...contact.set_arrays import REFERENCE_LOAD
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ..interfaces import element_kernels as contact
from ..ledger import LEDGER
from ..modal_kernels import (
    count_iterations,
    free_increment,
    modal_energy,
    move_modes,
    write_friction_accelerations,
    write_interface,
    write_modes,
)
from . import faces_kernels as coupling
from . import parts_kernels as parts
from . import pressing_kernels as pressing

# Numba leaves out the branches of flags that are False.
HAS_ELEMENTS = parts.HAS_ELEMENTS
HAS_STOPS = parts.HAS_STOPS
LOAD_VARIES = parts.LOAD_VARIES
HAS_LISTS = parts.HAS_LISTS
# Status of a march, beside EXCEEDS_TRAVEL and NOT_FINITE of `modal_kernels.write_interface`.
FINISHED = 0
MEMORY_FULL = 2
NO_CONTACT_SET = 4


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def sample_interface(i, last, drive, motion, modal_system, row, interface, faces, press):
    """Sample modes and interface at the start of a step and write them into a row.

    Parameters
    ----------
    i : int
        Number of the sample.
    last : bool
        Whether it is the last sample.
    drive : float
        Acceleration of the base in the step before [m s-2].
    motion : (2, n) array
        Coordinates and rates of the modes.
    modal_system : interfaces.arrays.ModalArrays
    row : (k,) array
        Row of samples of `loop_kernels.march`; it is written.
    interface : tuple
        Arrays of the contact on port 0, in `interfaces.arrays`.
    faces : interfaces.arrays.PortElements
    press : interfaces.arrays.VaryingLoad or ConstantLoad

    Returns
    -------
    tuple
        Slide [m], its speed [m/s] and output [m]; force [N], energy [J] and slip [m] of the interface; energy beside it [J].
    """
    q, v, out = write_modes(row, motion, modal_system)
    force = 0.0
    energy = 0.0
    slip = 0.0
    beside = 0.0
    if LOAD_VARIES:
        beside = pressing.sample_load(
            i, last, motion, modal_system.mass, interface, faces, press, row
        )
        if press.slot[0] < 0:
            return q, v, out, force, energy, slip, beside
    if HAS_ELEMENTS:
        force, energy, slip, springs = coupling.sample_elements(q, v, motion, row, interface, faces)
        beside += springs
        if HAS_STOPS:
            if i > 0:
                force = coupling.sample_set_valued(motion, modal_system, drive, force, row, faces)
    else:
        force, energy, slip = contact.read_state(interface, q, v)
    return q, v, out, force, energy, slip, beside


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def march(first, steps, motion, modal_system, table, interface, faces, press, travel, ledger, rows):
    """March a number of steps, at 0.1 to 0.3 us per step and a few ns per point.

    Parameters
    ----------
    first : int
        Row of the table for the first step; the rows are used in turns.
    steps : int
        Number of steps.
    motion, modal_system, table
        Coordinates and rates of the modes (2, n), their arrays, and the table of `propagator.Propagator`.
    interface, faces, press
        Arrays of the contact on port 0, of the elements and of the load, in `interfaces.arrays`.
    travel : float
        Largest displacement of the output [m], beyond which the march ends.
    ledger : (9,) array
        Energy balance [J] and counters, updated in place: work of the drive, viscous loss, sum of the absolute
        works of the steps, dissipated energy, largest stored energy, iterations, most iterations of a step, steps
        without convergence, friction work.
    rows : (steps + 1, k) array
        Samples, which are written. Columns: modes and their rates; of the contact, or else the first element,
        slide, speed, force, slip, mean force of the step that follows, energy, friction work of the step that
        follows; of every element slide, speed, force, slip and mean force of the step that follows; under a load
        that varies load, moment, energy of the preloaded contact, heave and pitch.

    Returns
    -------
    int
        Number of steps that are done.
    int
        Status, named at the top of the module.
    """
    slide = modal_system.slide
    dt = modal_system.dt
    around = table.shape[0]
    size = 2 * modal_system.slide.size
    accel = modal_system.workspace[0]
    scratch = modal_system.workspace[1:]
    beta = modal_system.beta
    if LOAD_VARIES:
        press.few[:] = 0.0
        press.few[0] = press.sets.reference[REFERENCE_LOAD]
    for i in range(steps + 1):
        drive = table[(first + i - 1) % around, 4 * size + 2] if HAS_STOPS else 0.0
        q, v, out, force, energy, slip, beside = sample_interface(
            i, i == steps, drive, motion, modal_system, rows[i], interface, faces, press
        )
        if LOAD_VARIES:
            if press.slot[0] < 0:
                return i, NO_CONTACT_SET
        status = write_interface(
            rows[i, : size + 6],
            force,
            energy,
            slip,
            out,
            travel,
            energy + (beside + modal_energy(motion, modal_system)),
            ledger,
        )
        if status:
            return i, status
        if i == steps:
            break
        at = (first + i) % around
        if LOAD_VARIES:
            dq, used, count = pressing.solve_coupled_forces(
                i, q, v, motion, modal_system, table, at, interface, faces, press
            )
            if press.slot[0] < 0:
                return i, NO_CONTACT_SET
        elif HAS_ELEMENTS:
            coupling.prepare_step(motion, modal_system, table, at, dt, faces)
            dq, count = coupling.solve_step(q, v, motion, modal_system, table, at, interface, faces)
        else:
            free = free_increment(motion, modal_system, 0, table, at)
            dq, _, count = contact.solve_step(free, beta, q, v, dt, interface, faces.goal[0])
            used = (free - dq) / beta
        if HAS_ELEMENTS:
            coupling.set_accelerations(modal_system, faces, accel)
            work = coupling.friction_work(dq, rows[i], faces)
        else:
            write_friction_accelerations(used, slide, modal_system.mass, accel)
            rows[i, size + 4] = used
            work = used * dq
            if LOAD_VARIES:
                pressing.add_press_accelerations(press, modal_system.mass, accel)
        move_modes(motion, modal_system, table, at, accel, scratch, ledger)
        if HAS_STOPS:
            blow = coupling.strike_modes(motion, modal_system.mass, faces)
            work += blow
            ledger[LEDGER.friction_loss] += blow
        count_iterations(count, work, ledger)
        rows[i, size + 6] = work
        if HAS_ELEMENTS:
            lost, ok = coupling.commit_step(q, v, dq, motion, modal_system, interface, faces)
        else:
            after = 0.0
            for k in range(slide.size):
                after += slide[k] * motion[1, k]
            lost, ok = contact.commit_step(dq, used, q, v, after, dt, interface)
        ledger[LEDGER.friction_loss] += lost
        if not ok:
            if LOAD_VARIES and not HAS_LISTS:
                ledger[LEDGER.n_unconverged] += 1.0
            else:
                return i, MEMORY_FULL
    return steps, FINISHED


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def follow(path, dt, interface, goal, lost, forces):
    """Move a contact along a prescribed slide.

    Parameters
    ----------
    path : (k,) array
        Slides at the samples [m].
    dt : float
        Length of the step [s].
    interface : tuple
        Arrays of the contact on port 0, in `interfaces.arrays`.
    goal : float
        Tolerance of a step [N].
    lost : (k, 2) array
        Energy dissipated in the step that follows and energy stored at the sample [J]; it is written.
    forces : (k, 3) array
        Force at the sample, mean force of the step that follows [N] and irreversible slip [m]; it is written.

    Returns
    -------
    int
        Number of steps that did not converge or found the memory of the contact full.
    """
    bad = 0
    before = 0.0
    for i in range(path.size):
        dq = path[i + 1] - path[i] if i < path.size - 1 else before * dt
        v = dq / dt if dt > 0 else 0.0
        force, energy, slip = contact.read_state(interface, path[i], 0.5 * (before + v) if i else v)
        forces[i, 0] = force
        forces[i, 2] = slip
        lost[i, 1] = energy
        if i == path.size - 1:
            break
        mean, good = contact.apply_increment(dq, path[i], v, dt, interface, goal)
        forces[i, 1] = mean
        lost[i, 0], ok = contact.commit_step(dq, mean, path[i], v, v, dt, interface)
        bad += not (good and ok)
        before = v
    return bad
