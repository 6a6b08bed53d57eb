"""Systems of contact points from the text of a scene, and the measures of their motion by brute force.

The text is read as plain TOML, without the rules of the package, so that scenes that it refuses can be solved as well.
Pressed pieces are those of the package on the mesh that `contact.element_size` fixes.
"""

import tomllib
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from patchfem.model.model import build
from patchfem.runs.patch import case_meshes
from patchfem.scene import loads as read_scene

from .gauss_seidel import CONTACT, GROOVES, LOWER, PRESCRIBED, Loads, Points, Structure, march
from .laws_by_steps import BONDS, BOUC_WEN, CELLS, COULOMB, LUGRE, STRIPS, TANH

UNITS = {
    "": 1.0, "m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "N": 1.0, "kg": 1.0, "Hz": 1.0, "g": 9.80665, "m/s": 1.0,
    "mm/s": 1e-3, "N/m": 1.0, "rad/m": 1.0, "N/m^3": 1.0, "N s/m": 1.0, "mrad": 1e-3, "rad": 1.0, "m^2/N": 1.0,
}  # fmt: skip
N_SLIDER_CELLS = (
    120  # cells of law "iwan"; the curve of first loading is wrong by 1/(8 120^2) of the limit
)
# Relative distance of the largest sample from the peak of a force that follows a load of two periods per cycle
SAMPLED_PEAK = 2e-6
MEASURES = ("loop_area", "relative_displacement_amplitude", "friction_force_peak")


class Pressed(NamedTuple):
    """Pressed patch of m nodes: positions [m], areas [m2], pressure [Pa], gap [m], shear and normal compliance [m/N]."""

    x: np.ndarray
    area: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray
    shear: np.ndarray
    normal: np.ndarray


class Reference(NamedTuple):
    """Measures of a motion by brute force and their own uncertainties, by name, and the number of unsolved steps."""

    values: dict[str, float]
    doubts: dict[str, float]
    n_unsolved: int


def read_number(value) -> float:
    """Return a quantity of a scene, such as "5 um", in SI units; numbers are unchanged."""
    if not isinstance(value, str):
        return float(value)
    number, _, unit = value.partition(" ")
    return float(number) * UNITS[unit]


def find_reference(text: str, steps_per_cycle: int) -> Reference:
    """Return the measures of a scene, by steps of equal length.

    The values are those of the finest of three runs, each with half the steps of the next one, or, if their changes show
    errors of order 1, extrapolated ones. Where the motion stops or a point begins to slip the error is not regular in the
    step, so that the uncertainty is then the largest change seen.
    """
    runs = [solve_scene(text, steps_per_cycle // divisor) for divisor in (4, 2, 1)]
    coarsest, coarse, values = (found for found, _ in runs)
    doubts = {}
    for name, value in values.items():
        change = value - coarse[name]
        earlier = coarse[name] - coarsest[name]
        doubts[name] = max(abs(change), 0.5 * abs(earlier))
        if name == "friction_force_peak":
            doubts[name] = max(doubts[name], SAMPLED_PEAK * abs(value))
        if change and 1.6 < earlier / change < 2.5:
            values[name] = value + change
            doubts[name] = abs(change)
    return Reference(values, doubts, sum(n_unsolved for _, n_unsolved in runs))


def solve_scene(text: str, steps_per_cycle: int) -> tuple[dict[str, float], int]:
    """Return the measures of a scene with steps of equal length, and the number of unsolved steps."""
    tables = tomllib.loads(text)
    motion = tables.get("slide") or tables["drive"]
    period = 1 / read_number(motion["frequency"])
    n_cycles = round(motion.get("cycles", 1))
    time = period * np.arange(n_cycles * steps_per_cycle + 1) / steps_per_cycle
    structure = make_structure(tables, time)
    points, point_loads = _make_points(tables, time)
    n_ports = structure.rows.shape[0]
    samples = np.zeros((time.size, 2 * n_ports + 1))
    state = np.zeros(2 * structure.rows.shape[1])
    n_unsolved = march(points, structure, point_loads, float(time[1]), state, samples)

    # the last cycle of the first port
    slide, force = samples[-steps_per_cycle - 1 :, 0], samples[-steps_per_cycle - 1 :, 1]
    output = slide if "slide" in tables else samples[-steps_per_cycle - 1 :, -1]
    peak = np.abs(samples[:, 1] if "slide" in tables else force).max()
    values = {
        "loop_area": float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(slide))),
        "relative_displacement_amplitude": float(np.ptp(output)) / 2,
        "friction_force_peak": float(peak),
    }
    return values, n_unsolved


# ---- structure


def make_structure(tables: dict, time) -> Structure:
    """Return the linear structure of a rig, or the prescribed slide of a bench."""
    step = time[1]
    if "slide" in tables:
        omega = 2 * np.pi * read_number(tables["slide"]["frequency"])
        amplitude = read_number(tables["slide"]["amplitude"])
        path = amplitude * np.stack([np.sin(omega * time), omega * np.cos(omega * time)], axis=1)
        none = np.zeros((0, 0))
        return Structure(
            np.zeros((1, 0)),
            *(none,) * 3,
            np.zeros(0),
            np.zeros((time.size, 0)),
            np.zeros((0, 0)),
            np.zeros((0, 2)),
            np.ascontiguousarray(path),
        )

    table = tables["structure"]
    drive = tables["drive"]
    omega = 2 * np.pi * read_number(drive["frequency"])
    acceleration = read_number(drive["acceleration"]) * np.sin(omega * time)
    if "masses" in table:
        mass = np.diag([read_number(value) for value in table["masses"]])
        n = len(mass)
        stiffness, damping = np.zeros((n, n)), np.zeros((n, n))
        for name, matrix in (("spring", stiffness), ("damper", damping)):
            for element in table.get(name, ()):
                row = _make_difference(element["between"], n)
                key = "stiffness" if name == "spring" else "coefficient"
                matrix += read_number(element[key]) * np.outer(row, row)
        rows = np.array([_make_difference(face["between"], n) for face in table["interface"]])
        base = mass @ np.ones(n)
        output = np.eye(n)[0]
    else:
        modes = table["mode"]
        n = len(modes)
        modal_mass = read_number(table["moving_mass"])
        frequency = 2 * np.pi * np.array([read_number(mode["frequency"]) for mode in modes])
        ratio = np.array([mode["damping"] for mode in modes])
        mass = modal_mass * np.eye(n)
        stiffness = modal_mass * np.diag(frequency**2)
        damping = modal_mass * np.diag(2 * ratio * frequency)
        slide = np.array([mode["slide"] for mode in modes])
        output = np.array([mode.get("output", float(k == 0)) for k, mode in enumerate(modes)])
        base = np.array([mode.get("base", 0.0) for mode in modes])
        base[0] = modes[0].get("base", slide[0])
        base = modal_mass * base
        rows = slide[None]
        yaw = np.array([read_number(mode.get("yaw", 0.0)) for mode in modes])
        strips = tables.get("contact", {}).get("strips")
        if yaw.any() and strips:
            width = read_number(tables["contact"]["width"])
            places = width * ((np.arange(strips["count"]) + 0.5) / strips["count"] - 0.5)
            rows = slide + places[:, None] * yaw

    # exact steps for forces that are linear in a step
    inverse = np.linalg.inv(mass)
    block = np.zeros((4 * n, 4 * n))
    block[:n, n : 2 * n] = np.eye(n)
    block[n : 2 * n, :n] = -inverse @ stiffness
    block[n : 2 * n, n : 2 * n] = -inverse @ damping
    block[n : 2 * n, 2 * n : 3 * n] = inverse
    block[2 * n : 3 * n, 3 * n :] = np.eye(n) / step
    exponential = expm(block * step)
    constant = exponential[: 2 * n, 2 * n : 3 * n]
    rising = exponential[: 2 * n, 3 * n :]
    forces = -acceleration[:, None] * base
    return Structure(
        np.ascontiguousarray(rows, float),
        np.ascontiguousarray(exponential[: 2 * n, : 2 * n]),
        np.ascontiguousarray(constant - rising),
        np.ascontiguousarray(rising),
        output,
        forces,
        *_list_springs(table, rows, output),
        np.zeros((time.size, 0)),
    )


def _list_springs(table: dict, rows, output) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements per coordinate, and numbers, of the nonlinear springs of a table [structure]."""
    lines, springs = [], []
    if "stiffening" in table:
        lines.append(output)
        springs.append([read_number(table["stiffening"]["cubic"]), 0.0])
    bonded = table.get("bonded", {})
    if "wavelength" in bonded:
        lines.append(rows[0])
        springs.append(
            [read_number(bonded["stiffness"]), 2 * np.pi / read_number(bonded["wavelength"])]
        )
    return np.array(lines, float).reshape(-1, rows.shape[1]), np.array(springs).reshape(-1, 2)


def _make_difference(between, n: int) -> np.ndarray:
    """Return the row (n,) of the displacement of the first of two masses relative to the second; 0 is the base."""
    row = np.zeros(n)
    for sign, number in zip((1.0, -1.0), between):
        if number:
            row[number - 1] = sign
    return row


# ---- points


def _make_points(tables: dict, time) -> tuple[Points, Loads]:
    """Return the contact points of all interfaces of a scene with their loads."""
    faces = tables.get("structure", {}).get("interface")
    if faces:
        parts = [_make_face(face, face.get("contact"), face.get("load")) for face in faces]
    else:
        contact = tables.get("contact")
        load = None if contact else tables["normal"]["load"]
        parts = [_make_face(tables["friction"], contact, load, tables)]
        yaws = any(mode.get("yaw") for mode in tables.get("structure", {}).get("mode", ()))
        if contact and "strips" in contact and yaws:
            count = contact["strips"]["count"]
            parts = [_divide(parts[0], count) for _ in range(count)]
    sizes = [part.loads.size for part in parts]
    n_cells = max(part.cells.shape[1] for part in parts)
    port = np.repeat(np.arange(len(parts)), sizes)
    compliance = np.zeros((sum(sizes), sum(sizes)))
    memory = np.zeros((sum(sizes), max(3, 2 * n_cells)))
    cells = np.ones((sum(sizes), n_cells, 2))
    cells[:, :, 0] = 0.0
    begin = 0
    for part in parts:
        end = begin + part.loads.size
        compliance[begin:end, begin:end] = part.compliance
        cells[begin:end, : part.cells.shape[1]] = part.cells
        begin = end
    values = np.concatenate([part.loads for part in parts])
    kind = np.repeat([part.kind for part in parts], sizes)
    numbers = np.concatenate([np.tile(part.numbers, (part.loads.size, 1)) for part in parts])
    limits = np.concatenate([part.limits for part in parts])
    point_loads = _make_loads(tables, time, values, parts[0])
    # The springs of a given stiffness are those under the mean load.
    is_fixed = (kind == CELLS) & (numbers[:, 1] > 0)
    values = np.where(is_fixed, values, point_loads.values[0])
    is_cell = (kind == CELLS) | (kind == BOUC_WEN)
    for k in range(n_cells):
        memory[is_cell, 2 * k + 1] = values[is_cell]
    density = np.where(kind == LUGRE, 1.0, numbers[:, 2])
    is_bond = (kind == BONDS) | (kind == LUGRE)
    memory[is_bond, 0] = (density * values)[is_bond]
    average = np.zeros(1)
    if point_loads.kind in (CONTACT, LOWER) and tables["friction"]["law"] == "convolution":
        law = tables["friction"]
        s = np.arange(600) / 40
        weight = s ** law.get("order", 1.0) * np.exp(-s)
        weight[0] *= 0.5
        average = np.append(read_number(law["bond_length"]) / 40, weight / weight.sum())
    points = Points(port, kind, numbers, cells, memory, limits, average, compliance)
    return points, point_loads


class Face(NamedTuple):
    """Contact points of one interface: kind and numbers of the law, cells, loads, limit factors, compliance, patch."""

    kind: int
    numbers: np.ndarray
    cells: np.ndarray
    loads: np.ndarray
    limits: np.ndarray
    compliance: np.ndarray
    patch: Pressed | None


def _divide(face: Face, count: int) -> Face:
    """Return one of `count` equal strips of a patch that yaws."""
    return face._replace(loads=face.loads / count, compliance=face.compliance * count)


def _make_face(law: dict, contact, load, tables: dict | None = None) -> Face:
    """Return the points of an interface: one point, or the nodes of its patch."""
    patch = press(contact) if contact else None
    if patch is None:
        loads = np.array([read_number(load)])
        compliance = np.zeros((1, 1))
        index = np.zeros(1, int)
    else:
        forces = patch.pressure * patch.area
        moves = tables is not None and (
            _is_lower(contact) or any(_find_motions(tables)[0]) or any(_find_motions(tables)[1])
        )
        holder = contact.get("holder", {}).get("tangential_stiffness")
        is_soft = "shear" in contact or holder
        is_whole = not is_soft and not moves and law["law"] != "convolution"
        index = np.arange(forces.size) if moves else np.flatnonzero(forces > 0)
        if is_whole:
            loads, compliance = np.array([forces.sum()]), np.zeros((1, 1))
        else:
            loads = forces[index]
            # The package adds the holder to the compliance of the pieces; alone it is the same at all nodes.
            compliance = np.zeros((index.size, index.size))
            if "shear" in contact:
                compliance += patch.shear[np.ix_(index, index)]
            elif holder:
                compliance += 1 / read_number(holder)
    kind, numbers, cells = make_law(law, float(loads.sum()))
    limits = np.ones((loads.size, 2))
    if law["law"] == "convolution" and patch is not None:
        for column, sign in enumerate((1.0, -1.0)):
            averages = average_pressure(patch, law, sign)[index]
            limits[:, column] = averages * patch.area[index] / np.maximum(loads, 1e-300)
    numbers = np.array([*numbers, *(0.0,) * (6 - len(numbers))])
    return Face(
        kind, numbers, np.array(cells, float).reshape(1, -1, 2), loads, limits, compliance, patch
    )


def make_law(law: dict, load: float) -> tuple[int, np.ndarray, list]:
    """Return kind, numbers (6,) and cells of a law; a stiffness belongs to the `load` [N] of the whole contact."""
    kind, numbers, cells = _list_numbers(law, load)
    return kind, np.array([*numbers, *(0.0,) * (6 - len(numbers))]), cells


def _list_numbers(law: dict, load: float) -> tuple[int, tuple, list]:
    """Return kind, numbers and cells of a law as in `laws_by_steps`."""
    name = law["law"]
    static = law["static"]
    stiffness = read_number(law["stiffness"]) / load if "stiffness" in law else 0.0
    length = static / stiffness if stiffness else read_number(law.get("bond_length", 0.0))
    cells = [[1.0, length or 1.0]]
    if name in ("coulomb", "convolution"):
        return COULOMB, (static,), cells
    if name == "elastic-plastic":
        return CELLS, (static, float(bool(stiffness))), cells
    if name == "iwan":
        return CELLS, (static,), make_sliders(law["chi"], law["beta"], length)
    if name == "bouc-wen":
        return BOUC_WEN, (static, length, law.get("exponent", 1.0), law.get("shape", 0.5)), cells
    if name == "tanh":
        return TANH, (static, read_number(law["reference_speed"])), cells
    if name == "lugre":
        damping = [read_number(law.get(key, 0.0)) / load for key in ("micro_damping", "viscous")]
        kinetic = law.get("kinetic", static)
        speed = read_number(law["stribeck_speed"])
        return LUGRE, (stiffness, *damping, static, kinetic, speed), cells
    initial = law.get("initial_bonds", 1.0)
    is_report = law.get("reading") == "report"
    order = law.get("order", 1.0)
    if is_report or order != 1.0:
        return STRIPS, (static, length, order, float(is_report), initial), cells
    return BONDS, (static, length, initial), cells


def make_sliders(chi: float, beta: float, length: float) -> list:
    """Return shares and yield displacements of cells of Segalman's density; `length` is limit over stiffness."""
    # rho = R phi^chi up to 1, and a slider of stiffness S at 1, with beta = S (chi + 1)/R
    edges = np.linspace(0.0, 1.0, N_SLIDER_CELLS + 1) ** (1 / (1 + chi / 2))
    stiffness = np.append(np.diff(edges ** (chi + 1)) / (chi + 1), beta / (chi + 1))
    force = np.append(np.diff(edges ** (chi + 2)) / (chi + 2), beta / (chi + 1))
    yields = force / stiffness * length * stiffness.sum() / force.sum()
    return np.stack([force / force.sum(), yields], axis=1).tolist()


def average_pressure(patch: Pressed, law: dict, sign: float) -> np.ndarray:
    """Return the pressure averaged over the path behind each node, for a slide to +x or -x, by a fine trapezoidal sum."""
    length = read_number(law["bond_length"])
    order = law.get("order", 1.0)
    s = length * np.concatenate([[0.0], np.geomspace(1e-6, 60.0, 40001)])
    weight = (s / length) ** order * np.exp(-s / length) / length
    weight /= np.trapezoid(weight, s)
    averages = np.zeros(patch.x.size)
    for k, x in enumerate(patch.x):
        values = np.interp(x - sign * s, patch.x, patch.pressure, left=0.0, right=0.0)
        # bonds are lost where the pressure vanishes
        lost = np.flatnonzero((values <= 0) & (s > 0))
        if lost.size:
            values[lost[0] :] = 0.0
        averages[k] = np.trapezoid(weight * values, s) if patch.pressure[k] > 0 else 0.0
    return averages


# ---- loads


def _find_motions(tables: dict) -> tuple[np.ndarray, np.ndarray]:
    """Return heave and pitch of the upper piece per mode; both are 0 without modes."""
    modes = tables.get("structure", {}).get("mode", [{}])
    heave = [read_number(mode.get("normal", 0.0)) for mode in modes]
    pitch = [read_number(mode.get("pitch", 0.0)) for mode in modes]
    return np.array(heave), np.array(pitch)


def _is_lower(contact: dict) -> bool:
    """Return whether the shapes of a patch lie on its lower piece."""
    return any(isinstance(part, dict) and part.get("on") == "lower" for part in contact.values())


def make_constant_loads(values, n_samples: int) -> Loads:
    """Return constant loads `values` (m,) [N] at a number of samples."""
    m = values.size
    return Loads(
        PRESCRIBED,
        np.repeat(values[None], n_samples, axis=0),
        np.zeros(m),
        np.ones(m),
        np.zeros(m),
        np.zeros((m, m)),
        np.zeros((2, 1)),
        np.zeros((2, 2)),
        np.zeros(3),
    )


def _make_loads(tables: dict, time, values, face: Face) -> Loads:
    """Return the loads of the points, which are `values` (m,) [N] at the start."""
    kind, history, x, area, opening, compliance, motions, pressure, grooves = make_constant_loads(
        values, 1
    )
    contact = tables.get("contact", {})
    normal = tables.get("normal", {})
    carved = contact.get("grooves") or normal.get("grooves")
    heave, pitch = _find_motions(tables)
    patch = face.patch
    if carved:
        kind = GROOVES
        wave = 2 * np.pi / read_number(carved["wavelength"])
        grooves = np.array(
            [wave, read_number(carved["amplitude"]), read_number(carved.get("phase", 0.0))]
        )
    elif heave.any() or pitch.any():
        kind = CONTACT
        motions = np.stack([heave, pitch])
        force = patch.pressure * patch.area
        x, area, compliance = patch.x.copy(), patch.area.copy(), np.ascontiguousarray(patch.normal)
        opening = patch.gap - patch.normal @ force
    elif contact and _is_lower(contact):
        kind = LOWER
        x, area = patch.x.copy(), patch.area.copy()
        pressure = np.stack([patch.x, patch.pressure])
    if kind in (PRESCRIBED, GROOVES):
        factor = np.ones(time.size)
        if "amplitude" in normal:
            omega = 2 * np.pi * read_number(normal["frequency"])
            phase = read_number(normal.get("phase", 0.0))
            change = read_number(normal["amplitude"]) / read_number(normal["load"])
            factor = np.maximum(1 + change * np.cos(omega * time + phase), 0.0)
        history = factor[:, None] * values
    return Loads(kind, history, x, area, opening, compliance, motions, pressure, grooves)


def press(contact: dict) -> Pressed:
    """Return the pressed pieces of a table [contact] on its fixed mesh."""
    keys = {key: value for key, value in contact.items() if key not in ("grooves", "strips")}
    return _press_text(_write_tables("contact", keys | {"shear": {}}))


@lru_cache(64)
def _press_text(text: str) -> Pressed:
    """Return the pressed pieces of a scene that has only [contact]."""
    model = build(read_scene(text))
    patch = case_meshes.solve_with_coarser(model.patch, 1e-3)[0]
    arrays = (
        patch.x,
        patch.pieces.interface.weight,
        patch.pressure.sigma_n,
        patch.pressure.gap,
        patch.slip_compliance,
        patch.pieces.normal,
    )
    return Pressed(*(np.array(array, float) for array in arrays))


def _write_tables(name: str, table: dict) -> str:
    """Return TOML of a table with nested tables."""
    values = {key: value for key, value in table.items() if not isinstance(value, dict)}
    lines = [f"[{name}]"] + [
        f'{key} = "{value}"' if isinstance(value, str) else f"{key} = {value}"
        for key, value in values.items()
    ]
    nested = [
        _write_tables(f"{name}.{key}", value)
        for key, value in table.items()
        if isinstance(value, dict)
    ]
    return "\n".join(lines + nested) + "\n"
