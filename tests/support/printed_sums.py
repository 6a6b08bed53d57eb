"""Equation 2.17 with [contact.shear] as a direct sum, for random benches and rigs.

Used by the campaigns `printed-benches` and `printed-rigs` of `campaigns`, which count how often the
errors of a run hold. Rigs begin at rest. From seed 8000 on the pressure may be given by the shape
of the lower body, and modes may heave and rock the patch up to lift-off.

The sum is NumPy code, written from 2.10-2.17 without the compiled lists. Every node of a mesh for a
tenth of the tolerance keeps every bond of its own path, in strips of 80 bond lengths over the steps
of a cycle (0.2 at 400, which alone has an error of 4e-4 of the friction limit), each with the
midpoint rule and its fraction on either side of u = 0. The bodies have their full compliance, s_i =
q - sum_j C_ij F_j(s_j) at the end of each step, solved by Newton's method on all nodes. A mode is
integrated by the trapezoidal rule, which adds beta to every C_ij. No force is averaged over a step;
no bonds are merged, no modes dropped and no points reduced. A bond forms under the pressure at its
position, or under the load, in the middle of its part of the step. Heave and rotation load the
nodes through the full normal compliance; nodes in tension are removed by an active-set iteration.
"""

from math import gamma, pi
from pathlib import Path

import numpy as np
from campaigns import measure_rows

import patchfem as pf
from patchfem.model import build
from patchfem.runs import run as runs
from patchfem.runs.patch import mesh_levels as patches
from patchfem.scene import loads

# Maximum age of the bonds that are kept, and half-width of the initial bonds [bond lengths].
MOST, FIRST_WIDE = (25.0, 1e-6)
# Bond lengths per strip times steps per cycle; maximum number of parts per step.
FINEST, MOST_PARTS = 80.0, 60
COMPARED = {
    "bench": (
        "loop_area",
        "friction_force_peak",
        "friction_ratio_end",
        "friction_work",
        "slip_amplitude",
    ),
    "rig": (
        "relative_displacement_amplitude",
        "loop_area",
        "friction_force_peak",
        "friction_work",
        "slip_amplitude",
    ),
}
PIECES = """
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "115 N"
substrate = "Ti-8Al-1Mo-1V"
[contact.shear]
[friction]
law = "nonlocal"
static = 0.3
bond_length = "1 um"
[accuracy]
tolerance = 1e-2
"""
MOTION = {
    "bench": '[slide]\nkind = "sine"\namplitude = "1 um"\nfrequency = "100 Hz"\ncycles = 2\n',
    "rig": '[structure]\nmoving_mass = "0.884 kg"\n[[structure.mode]]\nname = "axial"\nfrequency = "143 Hz"\n'
    'damping = 0.02\nslide = 1.0\n[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\n'
    "cycles = 3\n",
}


HEAVE = (
    '[[structure.mode]]\nname = "heave"\nfrequency = "{:.4g} Hz"\ndamping = 0.02\nslide = 0.0\nnormal = 1.0\n'
    "base = {:.3g}\n"
)
ROCK = (
    '[[structure.mode]]\nname = "rock"\nfrequency = "{:.4g} Hz"\ndamping = 0.02\nslide = 0.0\n'
    'pitch = "{:.3g} rad/m"\nbase = {:.3g}\n'
)


def draw_scene(kind: str, seed: int):
    """Return a random scene below or above gross slip.

    Reading, order, initial bonds, growth, pressure, and amplitude or drive are random.
    """
    draw = np.random.default_rng(seed)
    length = 10 ** draw.uniform(-0.7, 0.5)  # Bond length [um].
    reading = draw.choice(["report", "report", "report", "stretch"])
    sets = {
        "friction.static": f"{draw.uniform(0.15, 0.6):.3f}",
        "friction.bond_length": f"{length:.4g} um",
        "contact.load": f"{10 ** draw.uniform(1.7, 2.7):.4g} N",
        "friction.reading": reading,
        "friction.order": draw.choice(
            ["0.0", "0.5", "1.0", "2.0"] if reading == "report" else ["0.5", "1.5", "2.0"]
        ),
        "friction.initial_bonds": draw.choice(["0.0", "0.5", "1.0"]),
    }
    shape = draw.choice(["crown", "flat", "tilt"])
    if shape == "crown":
        sets["contact.crown.radius"] = f"{10 ** draw.uniform(0.3, 2):.3g} m"
    if shape == "tilt":
        sets["contact.tilt.angle"] = f"{10 ** draw.uniform(-5.5, -4):.3g} rad"
    frequency = draw.uniform(80, 200)
    stroke = length * 10 ** draw.uniform(-0.3, 0.9)
    acceleration = 10 ** draw.uniform(0.3, 1.0)
    if kind == "bench":
        sets |= {"slide.frequency": f"{frequency:.1f} Hz", "slide.amplitude": f"{stroke:.4g} um"}
        speed = 2 * pi * frequency * stroke * 1e-6
    else:
        sets |= {
            "drive.frequency": f"{frequency:.1f} Hz",
            "drive.acceleration": f"{acceleration:.3g} g",
        }
        speed = acceleration * 9.80665 / (2 * pi * frequency)
    if draw.random() < 0.4:
        floor = 0.05 * speed
        sets |= {
            "friction.kinetic": f"{float(sets['friction.static']) * draw.uniform(0.7, 0.95):.3f}",
            "friction.slip_growth": f"{length * 10 ** draw.uniform(-1, 0):.4g} um",
            "friction.rest_growth": f"{speed * frequency * 10 ** draw.uniform(-1, 1):.4g} m/s^2",
            "friction.rest_speed": f"{floor:.4g} m/s",
        }
    motion = MOTION[kind]
    # The pressure is given by the lower body, or the load varies by heave or by rocking, which
    # lifts the ends.
    if seed >= 8000:
        variant = draw.choice(
            ["upper", "lower", "lower"] if kind == "bench" else ["upper", "lower", "heave", "rock"]
        )
        if variant == "lower" and shape != "flat":
            sets[f"contact.{shape}.on"] = "lower"
        if variant in ("heave", "rock") and reading == "report":
            pitch = 10 ** draw.uniform(0.8, 1.8)
            mode = (
                HEAVE.format(draw.uniform(150, 400), draw.uniform(0.1, 0.4))
                if variant == "heave"
                else ROCK.format(draw.uniform(150, 400), pitch, draw.uniform(0.1, 0.4))
            )
            motion = motion.replace("slide = 1.0\n", "slide = 1.0\nbase = 0.9\n" + mode)
    return loads(PIECES + motion, "random.toml", [f"{key}={value}" for key, value in sets.items()])


class NodeBonds:
    """Bonds of m points, each along its own path, by 2.10 and 2.14-2.17.

    Parameters
    ----------
    f : Friction
        Law of the scene.
    size : int
        Number of points m.
    floor : float
        Smallest speed in the growth at rest [m/s].
    steps : int
        Steps per cycle.
    """

    def __init__(self, f, size: int, floor: float, steps: int = 400):
        self.f = f
        self.floor = floor
        self.mu = f.static
        self.finest = FINEST / steps
        self.at = np.zeros(size)
        self.path = np.zeros(size)
        self.harm = np.zeros(size)
        self.eps = np.full(size, f.bond_length)
        self.low, self.high, self.when, self.hurt, self.born, self.lag, self.dense = (
            np.zeros((0, size)) for _ in range(7)
        )
        self.first = np.ones(size)
        self.forming = lambda places, part: np.ones_like(places)

    def compute_lengths(self, displacement, dt):
        """Return bond lengths by 2.10 for points that move by `displacement` (m,) [m] in a step dt [s].

        Returns
        -------
        tuple
            Mature length after the step, factor on the distance of a bond from it, and length half
            way, (m,) each.
        """
        f = self.f
        if f.rest_growth is None:
            return self.eps, np.ones_like(displacement), self.eps
        out = []
        for part in (1.0, 0.5):
            rest_growth = f.rest_growth * part * dt / np.maximum(displacement / dt, self.floor)
            slip_growth = part * displacement / f.slip_growth
            target = (
                rest_growth * f.bond_length + slip_growth * f.bond_length * f.kinetic / f.static
            ) / (rest_growth + slip_growth)
            decay = np.exp(-rest_growth - slip_growth)
            out += [target + (self.eps - target) * decay, decay]
        return out[0], out[1], out[2]

    def weight(self, s, dt, keep: bool = False):
        """Return force / (mu_s sigma A) (m,) of points that slide to s (m,) [m] in a step dt [s].

        keep: whether s becomes the new state.
        """
        f = self.f
        p = self.f.order
        e0 = self.f.bond_length
        distance = np.abs(s - self.at)
        norm = gamma(self.f.order + 1)
        eps, decay, middle = self.compute_lengths(distance, dt)
        path = self.path + distance
        harm = self.harm + distance / middle
        parts = (
            int(np.ceil(distance.max() / (self.finest * e0 * (f.kinetic or f.static) / f.static)))
            or 1
        )
        parts = min(parts, MOST_PARTS)
        ends = self.at + np.arange(parts + 1)[:, None] / parts * (s - self.at)
        # Fraction of the step between the middle of a part and the end of the step.
        remaining_fraction = 1 - (np.arange(parts)[:, None] + 0.5) / parts
        low = np.vstack([self.low, ends[:-1]])
        high = np.vstack([self.high, ends[1:]])
        size = np.abs(high - low)
        position = np.divide(s - low, high - low, out=np.full(low.shape, 0.5), where=size > 0)
        # Bonds formed behind the point minus bonds formed ahead of it.
        side = np.where(high >= low, 1.0, -1.0) * (2 * np.clip(position, 0, 1) - 1)
        initial_path = np.vstack([self.when, path - remaining_fraction * distance])
        initial_damage = np.vstack([self.hurt, harm - remaining_fraction * distance / middle])
        initial_length = np.vstack([self.born, np.tile(middle, (parts, 1))])
        gone = np.zeros_like(distance) + decay
        # Difference between the mature length and the length of a bond, which grows from 0 by 2.10.
        lag = np.vstack([self.lag * gone, middle * gone**remaining_fraction])
        dense = np.vstack(
            [self.dense, self.forming((ends[1:] + ends[:-1]) / 2, 1 - remaining_fraction)]
        )
        age = path - initial_path
        if f.reading == "report":
            bond_length = np.maximum(eps - lag, 1e-9 * eps) if f.rest_growth is not None else e0
            x = age / bond_length
            contributions = np.where(size > 0, x**p * np.exp(-x), 0.0) * size / (e0 * norm)
            initial_bonds = (
                f.initial_bonds
                / norm
                * np.where(path > 0, (path / e0) ** p, float(p == 0))
                * np.exp(-path / e0)
            )
            initial_bonds = initial_bonds * self.first * np.clip(s / (FIRST_WIDE * e0), -1, 1)
        else:
            u = np.abs(s - (low + high) / 2)
            contributions = (
                (u / initial_length) ** p * np.exp(-(harm - initial_damage)) * size / (e0 * norm)
            )
            initial_bonds = (
                f.initial_bonds
                / norm
                * (np.abs(s) / e0) ** p
                * np.exp(-harm)
                * np.sign(s)
                * self.first
            )
        contributions = contributions * dense
        if keep:
            is_kept = (age / e0 < MOST).any(axis=1)
            self.low, self.high, self.when, self.hurt, self.born, self.lag, self.dense = (
                column[is_kept]
                for column in (low, high, initial_path, initial_damage, initial_length, lag, dense)
            )
            self.at = s
            self.path = path
            self.harm = harm
            self.eps = eps
        return (contributions * side).sum(axis=0) + initial_bonds

    def break_bonds(self, is_unloaded):
        """Break the bonds of points without pressure, off (m,) bool."""
        self.dense[:, is_unloaded] = 0.0
        self.first[is_unloaded] = 0.0


def solve_displacements(bonds: NodeBonds, limit, c, q: float, dt: float, guess):
    """Solve s = q - c F(s) by Newton's method with step halving.

    Parameters
    ----------
    bonds : Bonds
    limit : (m,) array
        Friction limits [N].
    c : (m, m) array
        Compliance [m/N].
    q : float
        Slide of the holder [m].
    dt : float
        Step [s].
    guess : (m,) array
        Initial slides [m].

    Returns
    -------
    tuple
        Slides (m,) [m] and forces (m,) [N].
    """
    s = guess.copy()
    increment = 1e-7 * bonds.f.bond_length
    force = limit * bonds.weight(s, dt)
    residual = s - q + c @ force
    for _ in range(25):
        if np.abs(residual).max() < 1e-9 * (abs(q) + bonds.f.bond_length):
            break
        slope = (
            limit
            * (bonds.weight(s + increment, dt) - bonds.weight(s - increment, dt))
            / (2 * increment)
        )
        step = np.linalg.solve(np.eye(s.size) + c * slope, residual)
        for part in 0.5 ** np.arange(8):
            new = s - part * step
            new_force = limit * bonds.weight(new, dt)
            new_residual = new - q + c @ new_force
            if np.linalg.norm(new_residual) < (1 - 0.1 * part) * np.linalg.norm(residual):
                break
        s = new
        force = new_force
        residual = new_residual
    return s, force


class PressedPatch:
    """Nodal forces (m,) of a patch whose upper holder heaves and rotates."""

    def __init__(self, patch):
        self.force = patch.pieces.interface.weight * patch.pressure.sigma_n
        self.c = patch.pieces.normal
        self.x = patch.x
        self.load, self.moment = self.force.sum(), self.force @ self.x
        self.opening = patch.pressure.gap - self.c @ self.force
        self.inverses = {}

    def at(self, heave: float, turn: float):
        """Return nodal forces (m,) [N] and their derivatives with respect to heave and rotation (m, 2).

        The forces and gaps are >= 0. The active set starts from the last one: nodes in tension
        leave it, nodes that would overlap join it.
        """
        is_active = self.force > 0
        gap_without_force = self.opening + heave + turn * self.x
        for _ in range(200):
            force = np.zeros_like(self.x)
            slopes = np.zeros((self.x.size, 2))
            if is_active.any():
                if is_active.tobytes() not in self.inverses:
                    self.inverses[is_active.tobytes()] = np.linalg.inv(
                        self.c[np.ix_(is_active, is_active)]
                    )
                right_sides = np.stack(
                    [gap_without_force, np.ones_like(gap_without_force), self.x], axis=1
                )
                solution = self.inverses[is_active.tobytes()] @ right_sides[is_active]
                force[is_active] = -solution[:, 0]
                slopes[is_active] = -solution[:, 1:]
            next_active = np.where(
                is_active, force >= 0, gap_without_force + self.c @ force < -1e-16
            )
            if (next_active == is_active).all():
                break
            is_active = next_active
        self.force = force
        return force, slopes


def sum_scene(scene, steps: int = 500) -> dict:
    """Return the measures of a scene by the direct sum with `steps` per cycle."""
    model = build(scene)
    patch = patches.solve_with_coarser(model.patch, 0.1 * model.accuracy.tolerance, False, False)[0]
    f = model.friction
    rig = model.rig
    area = patch.pieces.interface.weight
    sigma = patch.pressure.sigma_n
    lower = model.side == "lower"
    varies = rig is not None and rig.friction.load_varies
    nodes = np.flatnonzero(sigma > 0) if not (lower or varies) else np.arange(sigma.size)
    measure = patch.pressure.load / area[sigma > 0].sum()
    pressure = np.full(nodes.size, measure) if lower or varies else sigma[nodes]
    limit = f.static * area[nodes] * pressure
    c = patch.slip_compliance[np.ix_(nodes, nodes)]
    x = patch.x[nodes]
    bonds = NodeBonds(f, nodes.size, model.bonds.rest_speed, steps)
    press = PressedPatch(patch)
    bonds.first = sigma[nodes] / pressure
    force_now = area * sigma
    if lower:
        bonds.forming = lambda places, part: np.interp(
            x + places, patch.x, sigma / measure, left=0.0, right=0.0
        )
    omega, cycles = (
        (2 * pi * scene.slide.frequency, int(scene.slide.cycles))
        if rig is None
        else (2 * pi * scene.drive.frequency, int(scene.drive.cycles))
    )
    dt = 2 * pi / omega / steps
    slide, force, slip = (np.zeros(cycles * steps + 1) for _ in range(3))
    s = np.zeros(nodes.size)
    before = np.zeros(nodes.size)
    beta = 0.0
    if rig is not None:
        modes = rig.modes
        omega_modes = modes.omega
        zeta = modes.zeta
        mass = modes.mass
        rows = np.stack(
            [
                np.zeros(omega_modes.size)
                if participation is None
                else np.asarray(participation, float)
                for participation in (modes.slide, modes.normal, modes.pitch)
            ]
        )
        stiff = omega_modes**2 + 4 / dt**2 + 4 * zeta * omega_modes / dt
        beta = float((rows[0] ** 2 / stiff).sum() / mass)
        state = np.zeros((3, omega_modes.size))
    for k in range(1, slide.size):
        t = k * dt
        if rig is None:
            free = scene.slide.amplitude * np.sin(omega * t)
        else:  # Newmark's method with average acceleration: z'' = 4 (z - z0)/dt^2 - 4 v0/dt - a0
            z, v, a = state
            drive = -modes.base * scene.drive.acceleration * np.sin(omega * t)
            free_z = (
                drive + 4 * z / dt**2 + 4 * v / dt + a + 2 * zeta * omega_modes * (2 * z / dt + v)
            ) / stiff
            previous_normal_force = force_now
            contact_displacement = np.zeros(omega_modes.size)
            if varies:
                force_now, contact_displacement = solve_equilibrium(
                    press, rows, free_z, stiff * mass, z
                )
                bonds.forming = (
                    lambda places, part, a=previous_normal_force[nodes], b=force_now[nodes]: (
                        np.broadcast_to(
                            (a + part * (b - a)) / (measure * area[nodes]), places.shape
                        )
                    )
                )
            free_z = free_z + contact_displacement
            free = rows[0] @ free_z
        new, friction = solve_displacements(bonds, limit, c + beta, free, dt, 2 * s - before)
        before = s
        s = new
        bonds.weight(s, dt, keep=True)
        normal_force = (
            np.interp(x + s, patch.x, sigma, left=0.0, right=0.0) * area[nodes]
            if lower
            else force_now[nodes]
        )
        bonds.break_bonds(normal_force <= 0)
        force[k] = friction.sum()
        slide[k] = free - beta * force[k]
        slip[k] = (
            (normal_force @ s - f.bond_length / f.static * force[k]) / normal_force.sum()
            if normal_force.sum() > 0
            else slide[k]
        )
        if rig is not None:
            z1 = free_z - rows[0] * force[k] / (stiff * mass)
            a1 = 4 * (z1 - z) / dt**2 - 4 * v / dt - a
            state = np.array([z1, v + dt / 2 * (a + a1), a1])
    work = np.concatenate([[0.0], np.cumsum((force[1:] + force[:-1]) / 2 * np.diff(slide))])
    last = slice(-steps - 1, None)
    force_magnitude = np.abs(force[last if beta else slice(None)])
    return {
        "loop_area": work[-1] - work[-steps - 1],
        "friction_force_peak": force_magnitude.max(),
        "friction_work": work[-1],
        "friction_ratio_end": force[-1] / patch.pressure.load,
        "slip_amplitude": np.ptp(slip[last]) / 2,
        "relative_displacement_amplitude": np.ptp(slide[last]) / 2,
    }


def solve_equilibrium(press: PressedPatch, rows, free, stiff, guess) -> tuple:
    """Find heave and rotation in equilibrium with the contact forces by Newton's method.

    Parameters
    ----------
    press : Pressed
    rows : (3, n) array
        Slide, heave and rotation per unit of the modal coordinates.
    free : (n,) array
        Coordinates without contact forces.
    stiff : (n,) array
        Stiffness of the modes in the step [N/m].
    guess : (n,) array
        Initial coordinates.

    Returns
    -------
    tuple
        Nodal forces (m,) [N], and the coordinates (n,) by which they push the modes from `free`.
    """
    compliance = rows[1:] / stiff  # Change of the coordinates per newton and per newton metre.
    motion = rows[1:] @ guess
    free_motion = rows[1:] @ free
    for _ in range(60):
        force, slopes = press.at(*motion)
        contact_load = np.array([force.sum() - press.load, force @ press.x - press.moment])
        residual = motion - free_motion - rows[1:] @ (compliance.T @ contact_load)
        if np.abs(residual / np.array([1.0, 1 / np.ptp(press.x)])).max() < 1e-15:
            break
        arms = np.stack([np.ones_like(press.x), press.x])
        motion = motion - np.linalg.solve(
            np.eye(2) - rows[1:] @ compliance.T @ (arms @ slopes), residual
        )
    return force, compliance.T @ contact_load


def compare_sum(kind: str, seed: int) -> dict:
    """Compare a random scene with the direct sum at two step lengths.

    The difference of the two sums is the uncertainty of the reference.
    """
    scene = draw_scene(kind, seed)
    try:
        result = runs.run(pf.plan(scene))
    except pf.PatchfemError as error:
        return {"group": kind, "rows": [], "refused": str(error)}
    coarse = sum_scene(scene, 200)
    fine = sum_scene(scene, 400)
    uncertainties = {name: abs(fine[name] - coarse[name]) for name in fine}
    return {
        "group": kind,
        "rows": measure_rows(result.measures, fine, uncertainties, COMPARED[kind]),
    }


def compare_bench(seed: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare the bench of a seed; see `campaigns`."""
    return compare_sum("bench", seed)


def compare_rig(seed: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare the rig of a seed; see `campaigns`."""
    return compare_sum("rig", seed)
