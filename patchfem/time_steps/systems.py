"""Arrays of a march of contact points, and the states that are read from it."""

import numpy as np
from numpy.polynomial.legendre import leggauss

from .. import kernel_cache
from ..contact.set_arrays import PRESENT_SLOT_INDEX, hash_set, make_set_arrays
from ..core import ModalBasis
from ..friction.bonds.list_numbers import join_lists, make_lists, make_no_lists
from ..structure.exponentials import exponential
from .contacts import Contact
from .march_rows_kernels import (
    LOWER,
    RESULTANT,
    Flank,
    Newton,
    Options,
    Port,
    Ports,
    Responses,
    Shear,
    Structure,
    System,
    Total,
)
from .step_rows_kernels import (
    N_VALUES,
    WIDTH,
    BondRow,
    Law,
    Layout,
    ListRow,
    Loads,
    Pieces,
    Points,
    Value,
)

MAX_ANGLE = 0.5  # largest phase of the fastest mode in the step of a matrix exponential [rad]
N_GAUSS = 8  # Gauss points of the integrals over that step
REDUNDANT = 1e-10  # relative compliance of the strongest port at rest if ports outnumber the modes
MIN_STRENGTH = 0.01  # smallest strength by which ports share a force, relative to the strongest
# Lengths of the steps: whole ones, and those after up to seven halvings, by which a step that fails is retried
N_LEVELS = 8
MIN_RANK = (
    1e-6  # smallest singular value, relative to the largest one, of ports that modes move apart
)
# Distance of the tables of two lower pieces, and width of the steps at their ends, relative to the length of a table
TABLE_DISTANCE = 100.0
END_MARGIN = 1e-9
N_EVENT_LEVELS = 20  # the same with rigid friction, whose stops and releases are located by halving


def make_responses(modes: ModalBasis, step: float, levels: int) -> Responses:
    """Return motion and energies of steps of several lengths.

    The matrix exponential is that of the modes with the chain of derivatives of the drive and with constant forces.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the rig.
    step : float
        Duration of a whole step [s].
    levels : int
        Number of lengths of steps.
    """
    # The state (3 n + 3,): coordinates, velocities, the acceleration of the base with two derivatives, and constant
    # forces per mass.
    n = modes.omega.size
    matrix = np.zeros((3 * n + 3, 3 * n + 3))
    velocities = slice(n, 2 * n)
    matrix[:n, velocities] = np.eye(n)
    matrix[velocities, :n] = -np.diag(modes.omega**2)
    matrix[velocities, velocities] = -modes.damping_matrix
    matrix[velocities, 2 * n] = -np.asarray(modes.base)
    matrix[2 * n, 2 * n + 1] = matrix[2 * n + 1, 2 * n + 2] = 1.0
    matrix[velocities, 2 * n + 3 :] = np.eye(n)

    # Loss and work are integrals of quadratic forms x^T A x of the state. Gauss quadrature integrates them over a step that
    # resolves the fastest mode. The integral over twice the step is A + E^T A E, with the matrix exponential E of the step.
    fastest = float(modes.omega.max(initial=0.0)) * step
    n_halvings = max(levels - 1, int(np.ceil(np.log2(max(fastest / MAX_ANGLE, 1e-300)))))
    short = step / 2**n_halvings
    nodes, weights = leggauss(N_GAUSS)
    # The units of these states are [m s^-power].
    powers = np.concatenate([np.zeros(n), np.ones(n), [2, 3, 4], np.full(n, 2.0)])
    loss = np.zeros_like(matrix)
    loss[velocities, velocities] = modes.mass * modes.damping_matrix
    work = np.zeros_like(matrix)
    work[2 * n, velocities] = -modes.mass * np.asarray(modes.base)
    inside = np.array([exponential(matrix, 0.5 * short * (1 + node), powers) for node in nodes])
    forms = [
        np.einsum("g,gki,kl,glj->ij", 0.5 * short * weights, inside, form, inside, optimize=True)
        for form in (loss, work)
    ]
    parts = []
    for k in range(n_halvings + 1):
        # The square of the last matrix would double its round-off.
        whole = exponential(matrix, short * 2**k, powers)
        if k > n_halvings - levels:
            parts.append((whole[: 2 * n], forms[0], forms[1][2 * n : 2 * n + 3]))
        forms = [form + whole.T @ form @ whole for form in forms]
    return Responses(*(np.array(part) for part in zip(*parts[::-1])))


def make_system(
    contact, step: float, modes: ModalBasis | None = None, travel: float = np.inf, start=None
) -> System:
    """Return the arrays of a rig or of a prescribed slide at its start, without the drive.

    Parameters
    ----------
    contact : contacts.Contact
        Laws and loads of the points.
    step : float
        Duration of a whole step [s].
    modes : ModalBasis, optional
        Without modes the displacement of the first port is prescribed.
    travel : float
        Largest output [m].
    start : core.InitialState, optional
        Modal coordinates and velocities; at rest by default.
    """
    # Heave and pitch of a normal contact are two ports more; their numbers are -1 without them.
    n = 0 if modes is None else modes.omega.size
    rows = [np.zeros(n) if modes is None else point_set.row for point_set in contact.point_sets]
    press = np.zeros(11)
    press[:2] = -1.0
    if contact.press is not None:
        press[:2] = len(rows), len(rows) + 1
        rows += [contact.press.heave, contact.press.pitch]
    rows = np.array(rows, float).reshape(len(rows), n)

    # Responses of the modes; a prescribed slide has none.
    mass = 1.0
    is_rigid = [point_set.law.law == Law.COULOMB for point_set in contact.point_sets]
    has_events = modes is not None and any(is_rigid)
    levels = N_EVENT_LEVELS if has_events else N_LEVELS
    responses = Responses(*(np.zeros((levels, k, 3)) for k in (0, 3, 3)))
    shape = np.zeros((3, 0))
    damping = np.zeros((0, 0))
    if modes is not None:
        mass = float(modes.mass)
        responses = make_responses(modes, step, levels)
        shape = np.array([modes.omega**2, modes.base, modes.output], float)
        damping = np.array(modes.damping_matrix, float)
    by_force = responses.motion[:, :, 2 * n + 3 :]
    compliance = [[rows @ part[:n] @ rows.T, rows @ part[n:] @ rows.T] for part in by_force]

    points = _make_points(contact, len(rows))
    if not contact.has_loads:
        is_constant = slice(BondRow.IS_CONSTANT, BondRow.IS_CONSTANT + WIDTH)
        points.numbers[points.blocks.law == Law.BONDS, is_constant] = 1.0
    size = len(rows) + points.pieces.stiffness.size
    ports = Ports(
        rows,
        np.array(compliance).reshape(levels, 2, len(rows), len(rows)) / mass,
        rows @ rows.T / mass,
        _find_redundant(rows, contact),
        _make_port_values(contact, len(rows)),
        Newton(np.zeros((size, size)), np.zeros(size), np.zeros(size)),
        press,
    )
    structure = Structure(
        responses, shape, damping, np.zeros((1, 3)), np.zeros(0), np.zeros(0), np.zeros(3 * n + 3)
    )
    options = Options(
        mass,
        float(step),
        float(travel),
        max(float(contact.limit), 1e-300),
        int(has_events),
        int(contact.has_lists),
        int(contact.has_loads),
    )
    state = np.zeros((3, 2 * n))
    if start is not None:
        state[0] = [*start.z, *start.v]
    sets = make_no_sets() if contact.press is None else contact.press.sets.make_arrays()
    flank = make_flank(contact)
    totals = np.zeros(len(Total))
    system = System(structure, ports, points, flank, sets, state, totals, options)
    _set_start(system, contact)
    return system


def _set_start(system: System, contact) -> None:
    """Give points and ports the displacements and velocities of the start, and find the loads there."""
    points = system.points
    n = system.state.shape[1] // 2
    rows = system.ports.rows[points.blocks.port]
    values = points.values.reshape(len(points.blocks.law), N_VALUES, WIDTH)
    slides = rows @ system.state[0, :n]
    velocities = rows @ system.state[0, n:]
    values[:, Value.TOTAL // WIDTH] = slides[:, None]
    values[:, Value.VELOCITY // WIDTH] = values[:, Value.START_VELOCITY // WIDTH] = velocities[
        :, None
    ]

    # Springs refer to the displacement at rest; rigid friction opposes the velocity of its port.
    is_spring = points.blocks.is_spring[points.blocks.port].astype(bool)
    points.memory[is_spring, 0] = slides[is_spring]
    is_rigid = points.blocks.law == Law.COULOMB
    back, load = (values[:, row // WIDTH, 0] for row in (Value.END_BACK, Value.END_LOAD))
    limits = points.numbers[:, WIDTH] * np.where(velocities < 0, back, load)
    points.memory[is_rigid, 0] = np.sign(velocities)[is_rigid]
    values[is_rigid, Value.START // WIDTH, 0] = (limits * points.memory[:, 0])[is_rigid]
    if contact.press is not None:
        press_first(system, contact)
    if contact.grooves is not None and n:
        _climb_first(system, contact)
    points.trial[:] = points.memory


def _climb_first(system: System, contact) -> None:
    """Give the lifted mass the vertical velocity of the flank, and the points the normal force there."""
    ratio = find_first_climb(system, contact)
    points = system.points
    for row in (Value.START_LOAD, Value.END_LOAD, Value.START_BACK, Value.END_BACK):
        points.values[:, row : row + WIDTH] *= ratio
    is_bonds = points.blocks.law == Law.BONDS
    points.memory[is_bonds, WIDTH:] *= ratio
    points.memory[points.blocks.law == Law.CELLS, WIDTH:] *= ratio
    points.memory[points.blocks.law == Law.SLIDERS] *= ratio
    points.memory[points.blocks.law == Law.BOUC_WEN, WIDTH:] *= ratio


def _find_redundant(rows, contact) -> np.ndarray:
    """Return the relative compliances (p,) of rigid ports, which are 0 unless the modes move some of them only together.

    Such ports share their forces by the modal forces at which they slip, so that they reach their limits at once.

    Parameters
    ----------
    rows : (p, n) array
        Displacement of the ports per modal coordinate.
    contact : contacts.Contact
        Points of the first ports, with their loads at the start.
    """
    redundant = np.zeros(len(rows))
    sets = contact.point_sets
    rigid = [p for p, point_set in enumerate(sets) if contact.is_rigid(point_set)]
    if not rigid or not rows.size:
        return redundant
    values = np.linalg.svd(rows[rigid], compute_uv=False)
    if values.size == len(rigid) and values[-1] > MIN_RANK * values[0]:
        return redundant
    strength = np.array([sets[p].law.limits.sum() * np.linalg.norm(rows[p]) for p in rigid])
    largest = strength.max()
    share = strength / largest if largest > 0 else np.ones(len(rigid))
    redundant[rigid] = REDUNDANT / np.maximum(share, MIN_STRENGTH)
    return redundant


def find_stiffness(point_set) -> float:
    """Return the stiffness [N/m] of points at rest, in series with the shear of their pieces; 0 for rigid points."""
    law = point_set.law
    if point_set.shear is None:
        return float(law.stiffness.sum())
    # The coordinates y of the shear minimise the energy 1/2 (1 - S y)^T D (1 - S y) + 1/2 y^T K y of a unit slide, with the
    # stiffnesses D of the points and K of the coordinates, and the shapes S. An error of y changes it in second order only.
    is_stiff = law.stiffness > 0
    shape = np.asarray(point_set.shear.shape)[is_stiff]
    own = law.stiffness[is_stiff]
    weighted = own[:, None] * shape
    y = np.linalg.solve(
        np.diag(point_set.shear.stiffness) + shape.T @ weighted, weighted.sum(axis=0)
    )
    return float(own @ (1 - shape @ y) ** 2 + point_set.shear.stiffness @ y**2)


def _make_port_values(contact, n_ports: int) -> np.ndarray:
    """Return the rows of the ports, with the viscosity of their points at rest."""
    values = np.zeros((len(Port), n_ports))
    for p, point_set in enumerate(contact.point_sets):
        values[Port.VISCOSITY, p] = point_set.law.viscosity.sum()
    return values


def _make_points(contact, n_ports: int) -> Points:
    """Return the arrays of all points."""
    sets = contact.point_sets
    blocks = [point_set.law.make_blocks() for point_set in sets]
    counts = [len(part.count) for part in blocks]
    n_blocks = sum(counts)
    numbers = np.zeros((n_blocks, max([2 * WIDTH, *(part.numbers.shape[1] for part in blocks)])))
    memory = np.zeros((n_blocks, max([WIDTH, *(part.memory.shape[1] for part in blocks)])))
    values = np.zeros((n_blocks, N_VALUES * WIDTH))
    # Rows of a slide to +x, and a second one to -x where the loads differ
    n_rows = 1 + any(point_set.law.back is not None for point_set in sets)
    shifts, pressure = _join_pressures(sets)
    node = np.full((n_rows, n_blocks, WIDTH), RESULTANT, np.int64)
    share = np.zeros(node.shape)
    place = np.zeros(node.shape)
    n_moving = n_ports - len(sets)  # ports of heave and pitch have no points
    shears = _number_shears(sets, n_ports)
    n_shear = shears.max(initial=0)
    bent = np.zeros((n_shear, 2), np.int64)
    shapes = np.zeros((n_shear, n_blocks * WIDTH))
    stiffness = np.zeros(n_shear)

    resultant = contact.preload
    if contact.grooves is not None:
        resultant *= float(np.hypot(1.0, contact.grooves.slope(0.0)))
    first = 0
    for p, (point_set, part) in enumerate(zip(sets, blocks)):
        end = first + len(part.count)
        numbers[first:end, : part.numbers.shape[1]] = part.numbers
        memory[first:end, : part.memory.shape[1]] = part.memory
        for row in (Value.START_LOAD, Value.END_LOAD):
            values[first:end, row : row + WIDTH] = part.load
            values[first:end, row + Value.START_BACK : row + Value.START_BACK + WIDTH] = part.back
        size = point_set.law.load.size
        places = slice(WIDTH * first, WIDTH * first + size)
        for row, load in enumerate([part.load, part.back][:n_rows]):
            # A single point carries a prescribed load that is 0 at the start.
            share[row, first:end] = load / resultant if resultant > 0 else 1.0
            if point_set.nodes is not None:
                node[row].reshape(-1)[places] = np.broadcast_to(point_set.nodes, (n_rows, size))[
                    row
                ]
            if point_set.lower is not None:
                node[row].reshape(-1)[places] = LOWER
                share[row].reshape(-1)[places] = point_set.lower.shares
                place[row].reshape(-1)[places] = (
                    point_set.lower.places + shifts[p][-1 if row else 0]
                )
        if point_set.shear is not None:
            own = slice(*shears[p])
            shapes[own, places] = np.asarray(point_set.shear.shape).T
            stiffness[own] = point_set.shear.stiffness
            bent[own, 1] = end
            if not point_set.shares_shear:
                bent[own, 0] = first
        first = end

    shear = np.zeros((len(Shear), stiffness.size))
    parts = [shapes[k, WIDTH * begin : WIDTH * end] for k, (begin, end) in enumerate(bent)]
    shear[Shear.SCALE] = [np.sqrt(np.count_nonzero(part) / (part @ part)) for part in parts]
    averages = None if contact.press is None else contact.press.averages
    n_nodes = 0 if contact.press is None else contact.press.sets.x.size
    n_averaged = 0 if averages is None else 2 * n_nodes + 2
    laws = [_number_law(point_set.law.law) for point_set in sets]
    layout = Layout(
        np.repeat(laws, counts).astype(np.int64),
        np.repeat(np.arange(len(counts)), counts),
        np.concatenate([np.zeros(0, np.int64), *(part.count for part in blocks)]),
        _count_memory(sets, blocks),
        np.cumsum([0, *counts, *[0] * n_moving]),
        np.array([point_set.is_spring for point_set in sets] + [False] * n_moving, bool),
    )
    loads = Loads(
        *(np.hstack(array) for array in (node, share, place)),
        pressure,
        np.zeros(n_nodes),
        np.zeros((0, 0, 0, 0)) if averages is None else averages,
        np.zeros(n_averaged),
    )
    products = np.zeros((stiffness.size, 2))
    pieces = Pieces(shears, bent, shapes, stiffness, shear, np.zeros(1), products)
    lists = _make_lists(contact, layout, numbers)
    return Points(layout, numbers, memory, memory.copy(), values, loads, pieces, lists)


def _number_law(law: Law | str) -> int:
    """Return the number of a law, or of one with a module of its own."""
    return int(Law.OWN if isinstance(law, str) else law)


def _number_shears(sets, n_ports: int) -> np.ndarray:
    """Return the first shear coordinate (p, 2) of the points of each of `n_ports` ports, and the one after their last."""
    shears = np.zeros((n_ports, 2), np.int64)
    stop = 0
    for p, point_set in enumerate(sets):
        size = 0 if point_set.shear is None else len(point_set.shear.stiffness)
        if not point_set.shares_shear:
            stop += size
        shears[p] = stop - size, stop
    return shears


def _join_pressures(sets) -> tuple[list[list[float]], np.ndarray]:
    """Join the pressure tables of all lower pieces to one.

    They stand so far apart that no slide leads from one to the next. The results are, for each set of points, the shifts [m]
    of the places of its tables, and the joined table (2, k) of places [m] and relative pressures.
    """
    shifts = []
    parts = []
    end = 0.0
    for point_set in sets:
        shifts.append([])
        for places, pressures in () if point_set.lower is None else point_set.lower.tables:
            # The first table keeps its places; the pressure is 0 beyond the ends of all.
            margin = END_MARGIN * (places[-1] - places[0])
            shift = end - places[0] if parts else 0.0
            ends = [places[0] - margin, *places, places[-1] + margin]
            parts.append([np.add(ends, shift), [0.0, *pressures, 0.0]])
            shifts[-1].append(shift)
            end = ends[-1] + shift + TABLE_DISTANCE * (places[-1] - places[0])
    if len(parts) == 1:
        return shifts, np.array(parts[0])[:, 1:-1]
    return shifts, np.concatenate([np.zeros((2, 0)), *parts], axis=1)


def _make_lists(contact, blocks: Layout, numbers: np.ndarray):
    """Return the lists of bonds (`strip_rows_kernels.BondLists`), and number the points that have one."""
    if not contact.has_lists:
        return make_no_lists(0)
    is_used = (blocks.law == Law.LIST)[:, None] & (np.arange(WIDTH) < blocks.count[:, None])
    indices = numbers[:, ListRow.INDEX : ListRow.INDEX + WIDTH]
    indices[is_used] = np.arange(is_used.sum())
    sets = [point_set for point_set in contact.point_sets if point_set.bond_sum is not None]
    return join_lists([make_lists(*part.bond_sum, part.law.load) for part in sets])


def _count_memory(sets, blocks) -> np.ndarray:
    """Return the number of used entries of the memory of each block (b,)."""
    used = [np.zeros(0, np.int64)]
    for point_set, part in zip(sets, blocks):
        sliders = point_set.law.sliders
        if sliders is None:
            used.append(np.full(len(part.count), part.memory.shape[1]))
        else:
            used.append(2 * sliders.weights.size * part.count)
    return np.concatenate(used)


def make_flank(contact: Contact) -> np.ndarray:
    """Return the numbers of the flank of the first port, (0,) without grooves."""
    grooves = contact.grooves
    if grooves is None:
        return np.zeros(0)
    flank = np.zeros(len(Flank))
    flank[Flank.LOAD] = flank[Flank.VERTICAL] = flank[Flank.TRIAL_VERTICAL] = contact.preload
    flank[Flank.WAVE_NUMBER] = grooves.wave_number
    flank[Flank.AMPLITUDE] = grooves.amplitude
    flank[Flank.PHASE] = grooves.phase
    flank[Flank.LIFTED_MASS] = grooves.lifted_mass
    flank[Flank.NORMAL] = contact.preload * np.hypot(1.0, float(grooves.slope(0.0)))
    flank[Flank.RATIO] = 1.0
    return flank


def make_no_sets():
    """Return arrays of contact sets with a single point, for a march in which no pressure changes and none is used."""
    point = np.zeros(1)
    return make_set_arrays(
        np.ones((1, 1)), point, point, (1.0, 0.0, 0.0, 1.0, 1.0), np.zeros(1, bool), n_slots=1
    )


def press_first(system: System, contact: Contact) -> None:
    """Find the contact set of a patch at the start, and write its index to the counters of `system.sets`."""
    press = kernel_cache.load_compiled_module("contact.press_kernels")
    name = hash_set(system.sets, contact.press.sets.in_contact)
    n = system.state.shape[1] // 2
    heave, pitch = (
        float(np.dot(row, system.state[0, :n]))
        for row in (contact.press.heave, contact.press.pitch)
    )
    slot = press.find_set(system.sets, press.build_first_set(system.sets, name), -heave, pitch)
    system.sets.counters[PRESENT_SLOT_INDEX] = slot


def find_first_climb(system: System, contact: Contact) -> float:
    """Set normal force and vertical velocity of the flank at the start; return the ratio of the force to that at rest."""
    n = system.state.shape[1] // 2
    row = system.ports.rows[0]
    q = float(row @ system.state[0, :n])
    slope = float(contact.grooves.slope(q))
    flank = system.flank
    normal = flank[Flank.LOAD] * np.hypot(1.0, slope)
    ratio = normal / flank[Flank.NORMAL]
    flank[Flank.NORMAL] = normal
    flank[Flank.RISE_SPEED] = slope * float(row @ system.state[0, n:])
    return ratio


def copy_system(system):
    """Return a copy of nested tuples of arrays, in which the arrays are copied too."""
    if isinstance(system, np.ndarray):
        return system.copy()
    if isinstance(system, tuple):
        return type(system)(*map(copy_system, system))
    return system
