"""Rates of the state of a motion: modes, drive, friction, work and slip (compiled).

`rig` is a `records.Rig` and `state` a `records.State`, whose rows are named by enumerations of `records`: `Clock` for values
of the run, `Memory` and `Face` for each interface, `Mode` and `Piece` for modes and pieces of the drive.
"""

import numpy as np

from ..kernel_cache.flags_kernels import NJIT_KERNEL
from ..kernel_cache.jit import njit
from .records import (
    N_FACE_INTEGRALS,
    N_INTEGRALS,
    Clock,
    Face,
    Memory,
    Mode,
    Piece,
    Point,
    Setting,
    Tail,
)
from .table_kernels import force_and_rates

SHARED_GRIP = 1e-7  # relative compliance by which more interfaces than modes share their forces
MIN_STRENGTH = 0.01  # smallest strength by which they do so, relative to that of the strongest
N_GRIP_PASSES = 3  # each pass removes the acceleration that this compliance leaves


@njit(**NJIT_KERNEL)
def copy_values(source, target):
    """Copy a vector element by element.

    Numba would count references for an assignment to a slice, and the kernels are compiled without reference counts.
    """
    for k in range(source.size):
        target[k] = source[k]


@njit(**NJIT_KERNEL)
def project(row, vector):
    """Return the product of a row of participations and a vector of the modes."""
    total = 0.0
    for j in range(row.size):
        total += row[j] * vector[j]
    return total


@njit(**NJIT_KERNEL)
def find_integrals(rig):
    """Return the index in a state of the first integral over time, the friction work of the first interface.

    The entries before it are the states on which rates depend.
    """
    return rig.scales.size - N_INTEGRALS - N_FACE_INTEGRALS * rig.faces.shape[0]


@njit(**NJIT_KERNEL)
def find_phase(piece, tau):
    """Return phase [rad] and circular frequency [rad/s] of the sine in a piece of the drive, `tau` [s] after its start."""
    growth = piece[Piece.GROWTH]
    grown = piece[Piece.OMEGA]
    turned = grown * tau
    if growth != 0:
        turned = grown * np.expm1(growth * tau) / growth
        grown *= np.exp(growth * tau)
    chirp = piece[Piece.CHIRP] * tau
    return piece[Piece.PHASE] + turned + 0.5 * chirp * tau, grown + chirp


@njit(**NJIT_KERNEL)
def find_drive(rig, clock, t):
    """Return the drive and its rate at a time in the current piece.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    clock : (16,) array
        Row of `records.State.clock`.
    t : float
        Time [s], in the current piece.
    """
    value = rate = 0.0
    if rig.pieces.shape[0]:
        piece = rig.pieces[int(clock[Clock.PIECE])]
        tau = t - piece[Piece.START]
        value = piece[Piece.CONSTANT] + piece[Piece.SLOPE] * tau
        rate = piece[Piece.SLOPE]
        if piece[Piece.AMPLITUDE] != 0:
            phase, omega = find_phase(piece, tau)
            size = piece[Piece.AMPLITUDE] * (omega * omega if piece[Piece.SQUARED] else 1.0)
            value += size * np.sin(phase)
            rate += size * omega * np.cos(phase)
    for k in range(rig.tones.shape[0]):
        phase = rig.tones[k, 1] * t + rig.tones[k, 2]
        value += rig.tones[k, 0] * np.sin(phase)
        rate += rig.tones[k, 0] * rig.tones[k, 1] * np.cos(phase)
    return value, rate


@njit(**NJIT_KERNEL)
def prescribed_load(face, t):
    """Return the normal load [N] of an interface at a time t [s] without heave, and its rate [N/s].

    It may be negative, as if the surfaces pulled.
    """
    if face[Face.SWING] == 0:
        return face[Face.MEAN], 0.0
    phase = face[Face.RATE] * t + face[Face.PHASE]
    return (
        face[Face.MEAN] + face[Face.SWING] * np.cos(phase),
        -face[Face.SWING] * face[Face.RATE] * np.sin(phase),
    )


@njit(**NJIT_KERNEL)
def look(rig, state, i, t, y):
    """Return the `Point` of an interface: its load, slide and velocity at a state, and what holds it at rest.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    i : int
        Number of the interface.
    t : float
        Time [s].
    y : (n,) array
        Coordinates, velocities, states of the laws and integrals, in the order of `records.State.y`.
    """
    n = rig.modes.shape[1]
    face = rig.faces[i]
    memory = state.memory[i]
    load, load_rate = prescribed_load(face, t)

    # The slide of a bench is the drive; that of a rig follows from the modes, whose heave changes the load.
    if rig.settings[Setting.IS_BENCH] > 0:
        slide, velocity = find_drive(rig, state.clock, t)
        compliance = 0.0
    else:
        row = rig.rows[0, i]
        slide = project(row, y[:n])
        velocity = project(row, y[n : 2 * n])
        compliance = project(row, row) / rig.settings[Setting.MASS]
        if face[Face.STIFFNESS] != 0:
            load -= face[Face.STIFFNESS] * project(rig.rows[1, i], y[:n])
            load_rate -= face[Face.STIFFNESS] * project(rig.rows[1, i], y[n : 2 * n])

    return Point(
        load,
        load_rate,
        slide,
        velocity,
        memory[Memory.FORCE],
        memory[Memory.PULL],
        compliance,
        memory[Memory.SPEED],
        face[Face.LOAD],
        face[Face.LOAD_RATE],
    )


@njit(**NJIT_KERNEL)
def find_rates(rig, state, t, y, rates):
    """Write the rates of the state y at a time t; FORCE [N] and SLIP_RATE [m/s] of each interface go to `state.memory`.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    t : float
        Time [s].
    y : (n,) array
        Coordinates, velocities, states of the laws and integrals, in the order of `records.State.y`.
    rates : (n,) array
        Rates of the entries of `records.State.y` per second, which are written.
    """
    n = rig.modes.shape[1]
    n_faces = rig.faces.shape[0]
    mass = rig.settings[Setting.MASS]
    v = y[n : 2 * n]
    acceleration = rates[n : 2 * n]
    drive = find_drive(rig, state.clock, t)[0]

    # Modes under the drive (eq. 3.4), and the powers of drive and dampers.
    power = loss = 0.0
    for j in range(n):
        damping = project(rig.damping[j], v)
        push = rig.modes[Mode.PUSH, j] * drive
        rates[j] = v[j]
        acceleration[j] = push - rig.modes[Mode.STIFFNESS, j] * y[j] - damping
        power += mass * push * v[j]
        loss += mass * damping * v[j]

    # Normal contact reacts on the modes by the change of the load due to heave.
    for i in range(n_faces):
        stiffness = rig.faces[i, Face.STIFFNESS]
        if stiffness != 0:
            reaction = -stiffness * project(rig.rows[1, i], y[:n])
            if state.memory[i, Memory.CONTACT] < 0:
                reaction = -prescribed_load(rig.faces[i], t)[0]
            power += reaction * project(rig.rows[1, i], v)
            for j in range(n):
                acceleration[j] += rig.rows[1, i, j] * reaction / mass

    is_held = False
    for i in range(n_faces):
        is_held = add_friction(rig, state, i, t, y, rates) or is_held
    if is_held:
        hold(rig, state, acceleration)

    rates[Tail.WORK] = power
    rates[Tail.LOSS] = loss


@njit(**NJIT_KERNEL)
def rests(memory):
    """Return whether an interface is held at rest by rigid friction, from its row of `State.memory`."""
    return memory[Memory.DIRECTION] == 0 and memory[Memory.CONTACT] > 0


@njit(**NJIT_KERNEL)
def add_friction(rig, state, i, t, y, rates):
    """Add the force of an interface to the accelerations and write its rates; return whether it is at rest.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    i : int
        Number of the interface.
    t : float
        Time [s].
    y : (n,) array
        Coordinates, velocities, states of the laws and integrals, in the order of `records.State.y`.
    rates : (n,) array
        Rates of the entries of `records.State.y` per second, which are written.
    """
    n = rig.modes.shape[1]
    memory = state.memory[i]
    face = rig.faces[i]
    first = 2 * n + int(face[Face.FIRST_STATE])
    last = first + int(face[Face.N_STATES])
    integral = find_integrals(rig) + N_FACE_INTEGRALS * i
    for k in range(first, last):
        rates[k] = 0.0
    if rests(memory):
        memory[Memory.SLIP_RATE] = 0.0
        rates[integral] = rates[integral + 1] = rates[integral + 2] = 0.0
        return True

    # The law at the state, with the acceleration that the other forces give.
    memory[Memory.PULL] = project(rig.rows[0, i], rates[n : 2 * n])
    point = look(rig, state, i, t, y)
    friction = force_and_rates(
        int(face[Face.LAW]),
        face[Face.NUMBERS :],
        memory,
        point,
        y[first:last],
        rates[first:last],
    )

    # Its force on the modes, and the integrals of work, slip and loss.
    memory[Memory.FORCE] = friction.force
    memory[Memory.SLIP_RATE] = friction.slip_rate
    rates[integral] = friction.force * point.velocity
    rates[integral + 1] = friction.slip_rate
    rates[integral + 2] = friction.loss
    if point.compliance > 0:
        for j in range(n):
            rates[n + j] -= rig.rows[0, i, j] * friction.force / rig.settings[Setting.MASS]
    return False


@njit(**NJIT_KERNEL)
def hold(rig, state, acceleration):
    """Add the forces that keep the resting interfaces at rest to the accelerations of the modes.

    They are the relative accelerations without them, times `state.grip`. Further passes remove the acceleration that
    the small compliance SHARED_GRIP leaves.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    acceleration : (n,) array
        Accelerations of the modes [m/s2], which are changed.
    """
    n_faces = rig.faces.shape[0]
    for i in range(n_faces):
        if rests(state.memory[i]):
            state.memory[i, Memory.FORCE] = 0.0
    for _ in range(N_GRIP_PASSES):
        for i in range(n_faces):
            state.memory[i, Memory.PULL] = project(rig.rows[0, i], acceleration)
        for i in range(n_faces):
            if not rests(state.memory[i]):
                continue
            force = 0.0
            for k in range(n_faces):
                if rests(state.memory[k]):
                    force += state.grip[i, k] * state.memory[k, Memory.PULL]
            state.memory[i, Memory.FORCE] += force
            for j in range(acceleration.size):
                acceleration[j] -= rig.rows[0, i, j] * force / rig.settings[Setting.MASS]


@njit(**NJIT_KERNEL)
def find_strength(rig, i):
    """Return the static friction of a rigid interface under its mean load, as the norm of its modal forces [N].

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    i : int
        Number of the interface.
    """
    row = rig.rows[0, i]
    return rig.faces[i, Face.NUMBERS] * rig.faces[i, Face.MEAN] * np.sqrt(project(row, row))


@njit(**NJIT_KERNEL)
def update_grip(rig, state):
    """Compute `state.grip`, the forces that hold the resting interfaces per unit of their relative accelerations.

    It is the inverse of their compliance matrix, by the Gauss-Jordan method.
    """
    n = rig.faces.shape[0]
    grip = state.grip
    # More interfaces than modes share their forces by their strengths, so that they reach their limits at once.
    strongest = 1e-300
    for i in range(n):
        if rests(state.memory[i]):
            strongest = max(strongest, find_strength(rig, i))

    # Compliance [1/kg] between resting interfaces. The others have a unit row. More interfaces than modes would make it
    # singular, so that the diagonal is a little larger.
    for i in range(n):
        for k in range(n):
            grip[i, k] = 1.0 if i == k else 0.0
            if rests(state.memory[i]) and rests(state.memory[k]):
                grip[i, k] = project(rig.rows[0, i], rig.rows[0, k]) / rig.settings[Setting.MASS]
        if rests(state.memory[i]):
            share = max(find_strength(rig, i) / strongest, MIN_STRENGTH)
            grip[i, i] *= 1 + SHARED_GRIP / share

    for i in range(n):
        # Row i is divided by its pivot, and subtracted from the other rows. The inverse takes the place of the matrix.
        pivot = 1 / grip[i, i]
        grip[i, i] = 1.0
        for k in range(n):
            grip[i, k] *= pivot
        for r in range(n):
            if r != i:
                factor = grip[r, i]
                grip[r, i] = 0.0
                for k in range(n):
                    grip[r, k] -= factor * grip[i, k]
