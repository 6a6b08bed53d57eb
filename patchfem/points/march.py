"""March of a rig with contact points over the cycles of its drive, and the record of its motion."""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from .. import compiled
from ..contact.set_arrays import hash_set, make_set_arrays
from ..core import ModalBasis, Outcome, Response
from .contacts import RESULTANT, Contact
from .laws import N_MEMORY, N_NUMBERS
from .march_kernels import DONE, EXCEEDS_TRAVEL, NO_CONTACT_SET
from .march_rows import (
    N_PORT_COLUMNS,
    Point,
    Points,
    Port,
    Ports,
    Sample,
    Structure,
    System,
    Total,
)

LEVELS = 8  # lengths of the steps: whole steps and seven halvings
SAME_CYCLE = (
    1e-11  # change of the state between two cycles, relative to its size, below which they repeat
)
N_KEPT = 128  # samples per cycle of the histories before the window
REPEATED = [
    Total.WORK_IN,
    Total.POWER,
    Total.VISCOUS,
    Total.FRICTION,
]  # sums that a repeated cycle continues
MAX_UNSOLVED = 0  # steps without convergence of a run that is used


class Snapshot(NamedTuple):
    """State of the interface at an instant.

    - time [s], slide [m], rate [m/s], force [N], slip [m] of the first port; heave [m] and pitch [rad]
    - memory (l, m), load (m,), shear (r,): of the points and pieces
    - nodal (k,): forces of the nodes [N]
    """

    time: float
    slide: float
    rate: float
    force: float
    slip: float
    heave: float
    pitch: float
    memory: np.ndarray
    load: np.ndarray
    shear: np.ndarray
    nodal: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class Motion:
    """Motion of a rig.

    - response: histories of the samples that were kept
    - window: histories of all samples of the last cycles
    - step_force: mean friction force of the first interface in each step of the window [N]
    - window_work: friction work in the window [J]
    - extremes (c, 2), phasors (c,): smallest and largest output, and phasor of the output, in each cycle [m]
    - ledger: energies [J] and counters by name
    - outcome, message: how the run ended, None and "" at its last step
    - cycles_done: number of cycles
    - snapshots: states at the ends of equal parts of the last cycle
    - state: arrays of the engine at the end
    """

    response: Response
    window: Response
    step_force: np.ndarray
    window_work: float
    extremes: np.ndarray
    phasors: np.ndarray
    ledger: dict
    outcome: Outcome | None
    message: str
    cycles_done: float
    snapshots: list
    state: System
    marks: tuple = ()


def make_responses(modes: ModalBasis, step: float) -> np.ndarray:
    """Return the motion at the end of steps of LEVELS lengths, see `march_rows.Structure`.

    The matrix exponential is that of the modes with the chain of derivatives of the drive and with constant forces.
    """
    n = modes.omega.size
    matrix = np.zeros((3 * n + 3, 3 * n + 3))
    velocities = slice(n, 2 * n)
    matrix[:n, velocities] = np.eye(n)
    matrix[velocities, :n] = -np.diag(modes.omega**2)
    matrix[velocities, velocities] = -modes.damping_matrix
    matrix[velocities, 2 * n] = -np.asarray(modes.base)
    matrix[2 * n, 2 * n + 1] = matrix[2 * n + 1, 2 * n + 2] = 1.0
    matrix[velocities, 2 * n + 3 :] = np.eye(n)
    return np.array([expm(matrix * (step / 2**level))[: 2 * n] for level in range(LEVELS)])


def make_system(
    modes: ModalBasis, contact: Contact, step: float, travel: float, start=None
) -> System:
    """Return the arrays of a rig at the start of a march, without its drive.

    Parameters
    ----------
    modes : ModalBasis
    contact : Contact
    step : float
        [s]
    travel : float
        Largest output [m].
    start : core.InitialState, optional
    """
    n = modes.omega.size
    rows = [np.asarray(one.row, float) for one in contact.point_sets]
    press = np.zeros(11)
    press[:2] = -1.0
    if contact.sets is not None:
        press[:2] = len(rows), len(rows) + 1
        rows += [contact.heave, contact.pitch]
    rows = np.array(rows).reshape(-1, n)
    responses = make_responses(modes, step)
    by_force = responses[:, :, 2 * n + 3 :]
    compliance = np.array(
        [[rows @ part[:n] @ rows.T, rows @ part[n:] @ rows.T] for part in by_force]
    )
    points = _make_points(contact, 0 if contact.sets is None else contact.sets.x.size)
    size = len(rows) + points.stiffness.size
    state = np.zeros((3, 2 * n))
    if start is not None:
        state[0] = [*start.z, *start.v]
    ports = Ports(
        rows,
        compliance / modes.mass,
        rows @ rows.T / modes.mass,
        np.zeros((len(Port), len(rows))),
        np.zeros((size, size)),
        np.zeros(size),
        press,
    )
    structure = Structure(
        responses,
        np.array([modes.omega**2, modes.base, modes.output], float),
        np.array(modes.damping_matrix, float),
        np.zeros((1, 3)),
        np.zeros(0),
        np.array([modes.mass, step, travel]),
    )
    sets = _make_no_sets() if contact.sets is None else contact.sets.make_arrays()
    system = System(structure, ports, points, sets, state, np.zeros(len(Total)))
    # Energy that is released at the start counts as work of the drive.
    squares = state[0, n:] @ state[0, n:] + np.sum((modes.omega * state[0, :n]) ** 2)
    energy = 0.5 * modes.mass * float(squares)
    system.totals[[Total.WORK_IN, Total.POWER, Total.STORED]] = energy
    if contact.sets is not None:
        _press_first(system, contact)
    return system


def _make_points(contact: Contact, n_nodes: int) -> Points:
    """Return the arrays of all points."""
    laws = [law for one in contact.point_sets for law in one.laws]
    counts = [len(one.laws) for one in contact.point_sets]
    shapes = np.zeros((sum(one.stiffness.size for one in contact.point_sets), len(laws)))
    column = row = 0
    for one, count in zip(contact.point_sets, counts):
        shapes[row : row + one.stiffness.size, column : column + count] = one.shapes.reshape(
            -1, count
        )
        row = row + one.stiffness.size
        column = column + count
    size = max([N_MEMORY, *(law.memory.size for law in laws)])
    memory = np.zeros((size, len(laws)))
    numbers = np.zeros((N_NUMBERS, len(laws)))
    values = np.zeros((len(Point), max(len(laws), n_nodes)))
    for j, law in enumerate(laws):
        numbers[:, j] = law.numbers
        memory[: law.memory.size, j] = law.memory
        values[[Point.START_LOAD, Point.LOAD, Point.END_LOAD], j] = law.load
    varies = contact.sets is not None or contact.load is not None
    nodes = [
        np.full(n, RESULTANT) if one.nodes is None else one.nodes
        for one, n in zip(contact.point_sets, counts)
    ]
    share = [law.load / contact.preload if varies else law.load for law in laws]
    return Points(
        np.repeat(np.arange(len(counts)), counts),
        np.concatenate(nodes).astype(np.int64),
        np.array(share, float),
        numbers,
        memory,
        memory.copy(),
        values,
        shapes,
        np.concatenate([one.stiffness for one in contact.point_sets]),
        np.zeros((3, len(shapes))),
        np.repeat([one.is_spring for one in contact.point_sets], counts),
    )


def _make_no_sets():
    """Return contact sets of a point that is not used."""
    point = np.zeros(1)
    return make_set_arrays(
        np.ones((1, 1)), point, point, (1.0, 0.0, 0.0, 1.0, 1.0), np.zeros(1, bool), n_slots=1
    )


def _press_first(system: System, contact: Contact) -> None:
    """Find the contact set at the start."""
    press = compiled.load("contact.press_kernels")
    name = hash_set(system.sets, contact.sets.in_contact)
    n = system.state.shape[1] // 2
    heave, pitch = (
        float(np.dot(row, system.state[0, :n])) for row in (contact.heave, contact.pitch)
    )
    slot = press.find_set(system.sets, press.build_first_set(system.sets, name), -heave, pitch)
    system.totals[Total.SLOT] = slot


def sample_drive(drive, step: float, first: int, count: int) -> np.ndarray:
    """Return value, slope and second derivative (count, 3) of parabolas through the drive in each step."""
    times = step * (first + np.arange(2 * count + 1) / 2)
    values = drive.values(times)
    start = values[:-2:2]
    middle = values[1::2]
    end = values[2::2]
    slope = (4 * middle - 3 * start - end) / step
    return np.stack([start, slope, 4 * (start - 2 * middle + end) / step**2], axis=1)


def march(
    modes: ModalBasis, drive, contact: Contact, cycles: float, steps_per_cycle: int, *,
    window: int = 10, travel: float = np.inf, start=None, frames: int = 0, repeats: bool = True,
) -> Motion:  # fmt: skip
    """March a rig over the cycles of its drive.

    Parameters
    ----------
    modes : ModalBasis
    drive : core.SineDrive or another drive
    contact : Contact
    cycles : float
    steps_per_cycle : int
    window : int
        Number of last cycles whose samples are all kept.
    travel : float
        Largest output [m].
    start : core.InitialState, optional
    frames : int
        Number of snapshots in the last cycle.
    repeats : bool
        Whether a periodic motion is not computed again.
    """
    step = drive.period / steps_per_cycle
    system = make_system(modes, contact, step, travel, start)
    kernels = compiled.load("points.march_kernels")
    n_steps = round(cycles * steps_per_cycle)
    n_window = min(window * steps_per_cycle, n_steps)
    width = 2 * modes.omega.size + Sample.PORTS + N_PORT_COLUMNS * len(contact.point_sets)
    if contact.sets is not None:
        width += 2 * N_PORT_COLUMNS
    # The march begins with the fraction of a cycle, so that the window has complete cycles.
    done = 0
    status = DONE
    chunks: list = []
    snapshots: list = []
    last_state = None
    last_totals = system.totals.copy()
    can_repeat = (
        repeats and not drive.segments == () and hasattr(drive, "omega") and contact.load is None
    )
    while done < n_steps and status == DONE:
        count = (n_steps - done) % steps_per_cycle or steps_per_cycle
        is_last = done + count == n_steps
        samples = np.zeros((count + 1, width))
        structure = system.structure._replace(drive=sample_drive(drive, step, done, count + 1))
        if contact.load is not None:
            structure = structure._replace(
                loads=contact.load(step * (done + np.arange(count + 1.0)))
            )
        stride = 1 if done + count > n_steps - n_window else max(1, steps_per_cycle // N_KEPT)
        system = system._replace(structure=structure)
        if frames and is_last:
            n_done, status = _march_frames(kernels, system, done, samples, frames, snapshots)
        else:
            n_done, status = kernels.march(system, count, stride, samples)
        chunks.append((done, samples[: n_done + 1]))
        done += n_done
        state = np.concatenate(
            [system.state[0], system.points.memory.ravel(), system.points.shear[0]]
        )
        n_left = (n_steps - n_window - done) // steps_per_cycle
        if can_repeat and n_left > 0 and last_state is not None and state.size == last_state.size:
            size = np.abs(
                np.concatenate(
                    [
                        samples[:, : system.state.shape[1]].max(axis=0),
                        state[system.state.shape[1] :],
                    ]
                )
            )
            if (np.abs(state - last_state) <= SAME_CYCLE * size).all():
                first, samples = chunks[-1]
                chunks += [(first + k * steps_per_cycle, samples) for k in range(1, n_left + 1)]
                done += n_left * steps_per_cycle
                system.totals[REPEATED] += n_left * (system.totals - last_totals)[REPEATED]
        last_state = state
        last_totals = system.totals.copy()
    return _make_motion(
        modes,
        drive,
        contact,
        system,
        chunks,
        snapshots,
        (status, done, n_window, steps_per_cycle, step),
    )


def _march_frames(
    kernels, system: System, done: int, samples, frames: int, snapshots: list
) -> tuple[int, int]:
    """March in parts, with a snapshot after each; return the number of steps done and the status."""
    structure = system.structure
    count = len(samples) - 1
    ends = np.linspace(0, count, min(frames, count) + 1).round().astype(int)
    size = system.state.shape[1]
    for first, last in pairwise(ends):
        part = structure._replace(drive=structure.drive[first:])
        if structure.loads.size:
            part = part._replace(loads=structure.loads[first:])
        n_done, status = kernels.march(
            system._replace(structure=part), last - first, 1, samples[first : last + 1]
        )
        row = samples[first + n_done]
        ports = row[size + Sample.PORTS :]
        points = system.points
        snapshots.append(
            Snapshot(
                (done + first + n_done) * structure.numbers[1],
                float(system.ports.rows[0] @ row[: size // 2]),
                float(system.ports.rows[0] @ row[size // 2 : size]),
                ports[0],
                ports[1],
                row[size + Sample.HEAVE],
                row[size + Sample.PITCH],
                points.memory.copy(),
                points.values[Point.END_LOAD, : points.port.size].copy(),
                points.shear[0].copy(),
                points.values[Point.NODE_FORCE].copy(),
            )
        )
        if status != DONE:
            return first + n_done, status
    return count, DONE


def _make_motion(modes, drive, contact, system, chunks, snapshots, run) -> Motion:
    """Return the record of a finished march."""
    status, done, n_window, steps, step = run
    extremes = []
    phasors = []
    kept = []
    numbers = []
    works = []
    friction = 0.0
    first_window = done - n_window
    size = 2 * modes.omega.size
    stride = max(1, steps // N_KEPT)
    for first, samples in chunks:
        extremes.append(find_extremes(samples, modes, step))
        time = step * (first + np.arange(len(samples)))
        output = samples[:, : modes.omega.size] @ modes.output
        wave = np.exp(-2j * np.pi * time / drive.period)
        phasors.append(2 / drive.period * np.trapezoid(output * wave, dx=step))
        picked = np.arange(
            0, len(samples) - 1, 1 if first + len(samples) - 1 > first_window else stride
        )
        kept.append(samples[picked])
        sums = friction + np.append(0.0, np.cumsum(samples[:-1, size + Sample.WORK]))
        friction = sums[-1]
        works.append(sums[picked])
        numbers.append(first + picked)
    kept.append(chunks[-1][1][-1:])
    works.append([friction])
    numbers.append([chunks[-1][0] + len(chunks[-1][1]) - 1])
    rows = np.concatenate(kept)
    number = np.concatenate(numbers)
    in_window = number >= first_window
    response = make_response(modes, drive, contact, rows, number * step, np.concatenate(works))
    window = response.select(in_window)
    outcome, message = _judge(system, status, done)
    return Motion(
        response,
        window,
        rows[in_window][:-1, size + Sample.PORTS + 2],
        float(rows[in_window][:-1, size + Sample.WORK].sum()),
        np.array(extremes),
        np.array(phasors),
        _make_ledger(modes, system, rows[-1]),
        outcome,
        message,
        done / steps,
        snapshots,
        system,
    )


def _judge(system: System, status: int, done: int) -> tuple[Outcome | None, str]:
    """Return how a march ended, and the reason."""
    if status == EXCEEDS_TRAVEL:
        return Outcome.EXCEEDS_TRAVEL, ""
    if status == NO_CONTACT_SET:
        return (
            Outcome.NOT_CONVERGED,
            f"at step {done} no set of points in contact was found; raise accuracy.steps_per_cycle",
        )
    if status != DONE:
        return (
            Outcome.NOT_CONVERGED,
            f"at step {done} the motion is not a finite number; raise accuracy.steps_per_cycle",
        )
    unsolved = int(system.totals[Total.UNSOLVED])
    if unsolved > MAX_UNSOLVED:
        return (
            Outcome.NOT_CONVERGED,
            f"{unsolved} of {done} time steps did not converge; raise accuracy.steps_per_cycle",
        )
    return None, ""


def _make_ledger(modes: ModalBasis, system: System, last) -> dict:
    """Return energies [J] and counters by name."""
    n = modes.omega.size
    totals = system.totals
    z = last[:n]
    v = last[n : 2 * n]
    interface = last[2 * n + Sample.ENERGY] + last[2 * n + Sample.CONTACT_ENERGY]
    friction = float(totals[Total.FRICTION])
    stored = 0.5 * modes.mass * float(v @ v + (modes.omega * z) @ (modes.omega * z)) + float(
        interface
    )
    lost = friction - float(last[2 * n + Sample.ENERGY])
    return {
        "work_in": float(totals[Total.WORK_IN]), "viscous": float(totals[Total.VISCOUS]),
        "power": float(totals[Total.POWER]), "friction": lost, "peak_stored": float(totals[Total.STORED]),
        "iterations": float(totals[Total.ITERATIONS]), "worst_iterations": float(totals[Total.WORST]),
        "stored": stored, "booked": friction, "sampled": friction, "passed": abs(friction),
    }  # fmt: skip


def find_extremes(samples, modes: ModalBasis, step: float) -> tuple[float, float]:
    """Return the smallest and largest output of samples, those of the cubics between them included."""
    n = modes.omega.size
    q = samples[:, :n] @ modes.output
    v = samples[:, n : 2 * n] @ modes.output
    turn = np.flatnonzero(v[:-1] * v[1:] < 0)
    if not turn.size:
        return float(q.min()), float(q.max())
    # The velocity is the parabola with the mean of the increment.
    first = v[turn]
    last = v[turn + 1]
    mean = (q[turn + 1] - q[turn]) / step
    square = 3 * (first + last) - 6 * mean
    linear = 6 * mean - 4 * first - 2 * last
    root = np.sqrt(np.maximum(linear**2 - 4 * square * first, 0.0))
    x = 2 * first / (-linear + np.copysign(root, first - last))
    x = np.clip(x, 0.0, 1.0)
    peaks = q[turn] + step * x * (first + x * (linear / 2 + x * square / 3))
    return float(min(q.min(), peaks.min())), float(max(q.max(), peaks.max()))


def make_response(modes: ModalBasis, drive, contact: Contact, rows, time, work) -> Response:
    """Return samples as histories.

    `work` (k,) is the friction work [J] up to each sample. Slides, slide rates, forces and slips of several interfaces
    are columns in `extra`, which also has the load, moment, energy, heave and pitch of a contact that moves.
    """
    n = modes.omega.size
    z = rows[:, :n]
    rate = rows[:, n : 2 * n]
    first = 2 * n + Sample.PORTS
    n_ports = len(contact.point_sets)
    columns = rows[:, first : first + N_PORT_COLUMNS * n_ports].reshape(
        len(rows), n_ports, N_PORT_COLUMNS
    )
    port_rows = np.array([one.row for one in contact.point_sets])
    forces = columns[..., 0]
    push = drive.values(time)
    base = push if drive.moving else np.zeros_like(push)
    acceleration = -np.outer(push, modes.base) - rate @ modes.damping_matrix.T - z * modes.omega**2
    acceleration -= forces @ port_rows / modes.mass
    extra = {}
    if contact.sets is not None or contact.load is not None:
        names = ("normal_load", "normal_moment", "normal_energy", "heave", "turn")
        extra = dict(zip(names, rows[:, 2 * n + Sample.LOAD : 2 * n + Sample.PORTS].T))
    if contact.sets is not None:
        press = np.stack(
            [extra["normal_load"] - contact.sets.load, extra["normal_moment"] - contact.sets.moment]
        )
        # Less load accelerates the holder towards the contact.
        acceleration += press.T @ np.array([contact.heave, contact.pitch]) / modes.mass
    energy = rows[:, 2 * n + Sample.ENERGY]
    extra["ledger"] = np.stack([work, energy, work - energy, np.zeros_like(work)])
    is_interface = [not one.is_spring for one in contact.point_sets]
    slides = z @ port_rows.T
    rates = rate @ port_rows.T
    if len(port_rows) > 1:
        parts = {"slides": slides, "slide_rates": rates, "forces": forces, "slips": columns[..., 1]}
        extra |= {name: part[:, is_interface] for name, part in parts.items()}
    return Response(
        time, z, rate, slides[:, 0], rates[:, 0], z @ modes.output, rate @ modes.output,
        acceleration @ modes.output + base, base, forces[:, 0], columns[:, 0, 1], extra,
    )  # fmt: skip
