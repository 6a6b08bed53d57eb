"""The compiled loop where faces and modes meet, and its twin for a slide that is given.

Over a step the modes move exactly under the path means of the friction forces along the straight increments of slide,
which do exactly the work of the laws: the sum of all energies never rises by itself. The faces are one contact, or
elements beside it or in its place (`faces_kernels`), of which the set-valued ones say too at what speed the step ends
(`stops_kernels`); the load stays, or changes (`pressing_kernels`). The text runs with any of them: `instances` makes an
instance of it per contact, of a module with solve, given, commit and state as those named here, and per set of parts,
and what a rig does not have is not compiled.
"""

from ...compiled.jit import njit
from ...contact.set_arrays import REFERENCE_LOAD
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ..interfaces import element_kernels as contact
from ..modal_kernels import free_slide, move, note, push_back, sample, stored, tell
from . import faces_kernels as faces
from . import parts_kernels as parts
from . import pressing_kernels as pressing

# numba leaves branches out
MANY, STOPS, PRESSED, LISTED = (
    parts.MANY,
    parts.STOPS,
    parts.PRESSED,
    parts.LISTED,
)
UNFIT = 4  # status where no contact set fits


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def seen(i, last, drive, motion, modal_system, row, c, j, n):
    """Sample i as (slide, its rate, output; force, energy and slip of the interface; energy of what stands beside it),
    written into its row; drive: acceleration of the step before."""
    q, v, out = sample(row, motion, modal_system.slide, modal_system.output)
    force = 0.0
    energy = 0.0
    slip = 0.0
    beside = 0.0
    if PRESSED:
        beside = pressing.pressed(i, last, motion, modal_system.mass, c, j, n, row)
        if n.slot[0] < 0:
            return q, v, out, force, energy, slip, beside
    if MANY:
        force, energy, slip, springs = faces.sampled(q, v, motion, row, c, j)
        beside += springs
        if STOPS:
            if i > 0:
                force = faces.held(motion, modal_system, drive, force, row, j)
    else:
        force, energy, slip = contact.state(c, q, v)
    return q, v, out, force, energy, slip, beside


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def march(first, steps, motion, modal_system, table, c, j, n, travel, ledger, rows):
    """March `steps` steps, the first by row `first` of the table (in turns); 0.1-0.3 us a step, a few ns per point.

    motion (2, n): coordinates and rates; table: of `propagator.Propagator`; c: the contact on port 0; j: Faces, or
    Single; n: Pressing, or Steady (all of `contacts.arrays`);
    ledger (9,): work in, viscous loss, |work in| per step, friction loss, peak stored, iterations, worst iterations,
    steps without convergence, friction work;
    rows (steps + 1, 2 n + 7 + ...): z, z', q, q', F, slip, mean force of the step that follows, energy in the
    interface, friction work of the step that follows [J], of the contact or else the first element; then slide, speed,
    force, slip and mean force of the step that follows of every element, of which the springs' energy does not count;
    under a load that changes then load, moment, energy of the preloaded contact, heave and pitch.
    Returns (steps done, status): 0 finished, 1 travel exceeded, 2 memory of the contact full, 3 not finite, 4 no
    contact set fits.
    """
    slide = modal_system.slide
    dt = modal_system.dt
    around = table.shape[0]
    size = 2 * modal_system.slide.size
    accel = modal_system.workspace[0]
    scratch = modal_system.workspace[1:]
    beta = modal_system.beta
    if PRESSED:
        n.few[:] = 0.0
        n.few[0] = n.sets.reference[REFERENCE_LOAD]
    for i in range(steps + 1):
        drive = table[(first + i - 1) % around, 4 * size + 2] if STOPS else 0.0
        q, v, out, force, energy, slip, beside = seen(
            i, i == steps, drive, motion, modal_system, rows[i], c, j, n
        )
        if PRESSED:
            if n.slot[0] < 0:
                return i, UNFIT
        status = note(
            rows[i, : size + 6],
            force,
            energy,
            slip,
            out,
            travel,
            energy + (beside + stored(motion, modal_system.omega, modal_system.mass)),
            ledger,
        )
        if status:
            return i, status
        if i == steps:
            break
        at = (first + i) % around
        if PRESSED:
            dq, used, count = pressing.solve_coupled_forces(
                i, q, v, motion, modal_system, table, at, c, j, n
            )
            if n.slot[0] < 0:
                return i, UNFIT
        elif MANY:
            faces.begun(motion, modal_system, table, at, dt, j)
            dq, count = faces.solved(q, v, motion, modal_system, table, at, c, j)
        else:
            free = free_slide(motion, modal_system.reach, 0, table, at)
            dq, _, count = contact.solve(free, beta, q, v, dt, c, j.goal[0])
            used = (free - dq) / beta
        if MANY:
            faces.pushed(modal_system, j, accel)
            work = faces.worked(dq, rows[i], j)
        else:
            push_back(used, slide, modal_system.mass, accel)
            rows[i, size + 4] = used
            work = used * dq
            if PRESSED:
                pressing.pushed(n, modal_system.mass, accel)
        move(
            motion,
            modal_system.free,
            modal_system.push,
            modal_system.loss,
            modal_system.dense,
            modal_system.dense_loss,
            table,
            at,
            accel,
            scratch,
            ledger,
        )
        if STOPS:
            blow = faces.blown(motion, modal_system.mass, j)
            work += blow
            ledger[3] += blow
        tell(count, work, ledger)
        rows[i, size + 6] = work
        if MANY:
            lost, ok = faces.committed(q, v, dq, motion, modal_system, c, j)
        else:
            after = 0.0
            for k in range(slide.size):
                after += slide[k] * motion[1, k]
            lost, ok = contact.commit(dq, used, q, v, after, dt, c)
        ledger[3] += lost
        if not ok:
            if PRESSED and not LISTED:
                ledger[7] += 1.0
            else:
                return i, 2
    return steps, 0


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def follow(path, dt, c, goal, lost, forces):
    """Resultant along a slide path (k,) [m] that is given, with steps of dt [s].

    forces (k, 3): force at the sample, at the mean speed of the steps beside it, mean over the step that follows,
    irreversible slip; lost (k, 2): energy dissipated in the step that follows, energy stored at the sample. Returns the
    steps that did not converge or found the memory of the contact full.
    """
    bad = 0
    before = 0.0
    for i in range(path.size):
        dq = path[i + 1] - path[i] if i < path.size - 1 else before * dt
        v = dq / dt if dt > 0 else 0.0
        force, energy, slip = contact.state(c, path[i], 0.5 * (before + v) if i else v)
        forces[i, 0] = force
        forces[i, 2] = slip
        lost[i, 1] = energy
        if i == path.size - 1:
            break
        mean, good = contact.given(dq, path[i], v, dt, c, goal)
        forces[i, 1] = mean
        lost[i, 0], ok = contact.commit(dq, mean, path[i], v, v, dt, c)
        bad += not (good and ok)
        before = v
    return bad
