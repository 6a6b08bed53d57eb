"""Compiled time loop of a march, and its counterpart for a prescribed slide.

Over a step the modes move exactly under the path means of the friction forces along the straight increments of slide,
which do exactly the work of the laws: the sum of all energies never grows by itself. The interface is one contact, or
elements with it or in its place (`faces_kernels`); the load is constant or varies (`pressing_kernels`). A contact is a
module with `solve_step`, `apply_increment`, `commit_step` and `read_state`, see `interfaces.element_kernels`. `instances`
compiles this source for each contact and set of features; features that a rig does not have are not compiled.
"""

from typing import NamedTuple

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.protocol_kernels import Reading
from ..interfaces import element_kernels as contact
from ..interfaces.arrays import SolvedStep, StepStart
from ..ledger import Ledger, SampleColumn
from ..modal_kernels import (
    ModalSample,
    count_iterations,
    free_increment,
    modal_energy,
    move_modes,
    project_modes,
    write_friction_accelerations,
    write_interface_sample,
    write_modal_sample,
)
from . import faces_kernels as coupling
from . import parts_kernels as parts
from . import pressing_kernels as pressing

# Numba omits the branches of flags that are False.
HAS_ELEMENTS = parts.HAS_ELEMENTS
HAS_STOPS = parts.HAS_STOPS
LOAD_VARIES = parts.LOAD_VARIES
HAS_LISTS = parts.HAS_LISTS
# Status codes of a march, in addition to EXCEEDS_TRAVEL and NOT_FINITE of
# `modal_kernels.write_interface_sample`.
FINISHED = 0
MEMORY_FULL = 2
NO_CONTACT_SET = 4


class InterfaceSample(NamedTuple):
    """Sampled motion of the modes and state of the interface.

    - modal: slide, slide speed and output
    - reading: force, energy and slip of the interface
    - energy_beside: additional energy of springs and preloaded contact [J]
    """

    modal: ModalSample
    reading: Reading
    energy_beside: float


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def sample_interface(i, is_last, drive, system, row):
    """Sample the modes and the interface at the start of a step, and write the sample row.

    Parameters
    ----------
    i : int
        Number of the sample.
    is_last : bool
        Whether it is the last sample.
    drive : float
        Acceleration of the base in the step before [m s-2].
    system : element_arrays.MarchArrays
    row : (k,) array
        Sample row of `march`; output.

    Returns
    -------
    InterfaceSample
    """
    modal = write_modal_sample(row, system.motion, system.modal_system)
    energy_beside = 0.0
    if LOAD_VARIES:
        energy_beside = pressing.sample_load(i, is_last, system, row)
        if system.press.slot[0] < 0:
            return InterfaceSample(modal, Reading(0.0, 0.0, 0.0), energy_beside)
    if HAS_ELEMENTS:
        reading, spring_energy = coupling.sample_elements(modal, system, row)
        energy_beside += spring_energy
        if HAS_STOPS:
            if i > 0:
                force = coupling.sample_set_valued(drive, reading.force, system, row)
                reading = Reading(force, reading.stored_energy, reading.slip)
    else:
        reading = contact.read_state(system.interface, modal.slide, modal.speed)
    return InterfaceSample(modal, reading, energy_beside)


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def march(first, steps, system, rows):
    """March modes and interface over a number of time steps, and record a sample per step.

    A step solves dq = free - beta F(dq) for the increment dq [m] of the relative displacement: `free`
    [m] is the increment without friction, beta [m/N] the increment per interface force, and F(dq) [N]
    the mean of the friction force over the path dq (`solve_contact_step`). The modes then move exactly
    under this constant force, and the memories of the contact are updated (`commit_step` of its kernels).

    Parameters
    ----------
    first : int
        Row of the drive table for the first step; the rows repeat cyclically.
    steps : int
        Number of steps.
    system : element_arrays.MarchArrays
        Motion, memories and ledger are updated in place.
    rows : (steps + 1, k) array
        Output samples. Columns: modal coordinates and rates; of the contact, or of the first element if there is none,
        slide, speed, force, slip, mean force of the step that follows, energy, friction work of the step that
        follows; of every element slide, speed, force, slip and mean force of the step that follows; under a load
        that varies load, moment, energy of the preloaded contact, heave and pitch.

    Returns
    -------
    int
        Number of completed steps.
    int
        Status, named at the top of the module.
    """
    motion = system.motion
    modal_system = system.modal_system
    table = system.table
    elements = system.elements
    ledger = system.ledger
    slide = modal_system.slide
    size = 2 * slide.size
    accel = modal_system.workspace[0]
    if LOAD_VARIES:
        pressing.start_march(system.press)
    for i in range(steps + 1):
        drive = table[(first + i - 1) % table.shape[0], 4 * size + 2] if HAS_STOPS else 0.0
        sample = sample_interface(i, i == steps, drive, system, rows[i])
        if LOAD_VARIES:
            if system.press.slot[0] < 0:
                return i, NO_CONTACT_SET
        energy_beside = sample.energy_beside + modal_energy(motion, modal_system)
        status = write_interface_sample(
            rows[i, : size + SampleColumn.STEP_WORK],
            sample.reading,
            sample.modal.output,
            system.travel,
            sample.reading.stored_energy + energy_beside,
            ledger,
        )
        if status:
            return i, status
        if i == steps:
            break
        at = (first + i) % table.shape[0]
        start = StepStart(sample.modal.slide, sample.modal.speed, modal_system.dt)
        if LOAD_VARIES:
            step = pressing.solve_coupled_forces(i, start, at, system)
            if system.press.slot[0] < 0:
                return i, NO_CONTACT_SET
        elif HAS_ELEMENTS:
            coupling.prepare_step(at, system)
            step = coupling.solve_step(start, at, system)
        else:
            step = solve_contact_step(start, at, system)
        if HAS_ELEMENTS:
            coupling.set_accelerations(modal_system, elements, accel)
            work = coupling.write_mean_forces(step.increment, rows[i], elements)
        else:
            write_friction_accelerations(step.mean_force, slide, modal_system.mass, accel)
            rows[i, size + SampleColumn.MEAN_FORCE] = step.mean_force
            work = step.mean_force * step.increment
            if LOAD_VARIES:
                pressing.add_press_accelerations(system.press, modal_system.mass, accel)
        move_modes(motion, modal_system, table, at, accel, ledger)
        if HAS_STOPS:
            impulse_energy = coupling.apply_end_impulses(motion, modal_system.mass, elements)
            work += impulse_energy
            ledger[Ledger.FRICTION_LOSS] += impulse_energy
        count_iterations(step.iterations, work, ledger)
        rows[i, size + SampleColumn.STEP_WORK] = work
        if HAS_ELEMENTS:
            loss, is_committed = coupling.commit_step(start, step.increment, system)
        else:
            loss, is_committed = contact.commit_step(
                step.increment,
                step.mean_force,
                start,
                project_modes(slide, motion[1]),
                system.interface,
            )
        ledger[Ledger.FRICTION_LOSS] += loss
        if not is_committed:
            if LOAD_VARIES and not HAS_LISTS:
                ledger[Ledger.N_UNCONVERGED] += 1.0
            else:
                return i, MEMORY_FULL
    return steps, FINISHED


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_contact_step(start, table_row, system):
    """Solve a step of a single contact without other elements.

    Parameters
    ----------
    start : interfaces.arrays.StepStart
    table_row : int
        Row of the table for this step.
    system : element_arrays.MarchArrays

    Returns
    -------
    interfaces.arrays.SolvedStep
    """
    modal_system = system.modal_system
    free = free_increment(system.motion, modal_system, 0, system.table, table_row)
    beta = modal_system.beta
    step = contact.solve_step(free, beta, start, system.interface, system.elements.goal[0])
    return SolvedStep(step.increment, (free - step.increment) / beta, step.iterations)


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def follow(path, dt, interface, goal, energies, forces):
    """Move a contact along a prescribed slide path, and record energies and forces.

    Parameters
    ----------
    path : (k,) array
        Slides at the samples [m].
    dt : float
        Length of the step [s].
    interface : tuple
        Arrays of the contact on port 0, in `interfaces.arrays`.
    goal : float
        Tolerance of the force in a step [N].
    energies : (k, 2) array
        Energy dissipated in the following step and energy stored at the sample [J]; output.
    forces : (k, 3) array
        Force at the sample, mean force of the following step [N] and irreversible slip [m]; output.

    Returns
    -------
    int
        Number of steps that did not converge or exceeded the memory of the contact.
    """
    n_failed = 0
    last_velocity = 0.0
    for i in range(path.size):
        is_last = i == path.size - 1
        increment = last_velocity * dt if is_last else path[i + 1] - path[i]
        velocity = increment / dt if dt > 0 else 0.0
        mean_velocity = 0.5 * (last_velocity + velocity) if i else velocity
        reading = contact.read_state(interface, path[i], mean_velocity)
        forces[i, 0] = reading.force
        forces[i, 2] = reading.slip
        energies[i, 1] = reading.stored_energy
        if is_last:
            break
        start = StepStart(path[i], velocity, dt)
        force, is_solved = contact.apply_increment(increment, start, interface, goal)
        forces[i, 1] = force
        energies[i, 0], is_committed = contact.commit_step(
            increment, force, start, velocity, interface
        )
        n_failed += not (is_solved and is_committed)
        last_velocity = velocity
    return n_failed
