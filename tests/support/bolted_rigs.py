"""Random rigs whose modes were measured with the joint bolted, and their steady motion by an independent program.

The loop follows from the curve of monotone sliding by Masing's rule, because the slide has two turning points in a cycle.
Harmonic balance finds the motion. The stiffness of the sticking joint is subtracted from the matrix of the modes.
"""

from typing import NamedTuple

import numpy as np
from block_joint import COARSE, FINE, ROUGH, Block, Joint, solve_joint
from scipy.integrate import trapezoid
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq, root

N_TIMES = 4096  # samples of a cycle
SUBSTRATES = {  # Young's modulus [Pa], Poisson's ratio
    "steel": (210e9, 0.3),
    "Ti-8Al-1Mo-1V": (121e9, 0.32),
    "Ti-6Al-4V": (114e9, 0.31),
    "aluminium": (69e9, 0.33),
    "42CrMo4": (200e9, 0.32),
}
COATINGS = {
    "WC-Co": (250e9, 0.24),
    "Cr": (235e9, 0.21),
    "TiN": (450e9, 0.25),
    "DLC": (259e9, 0.25),
}


class Rig(NamedTuple):
    """Modes measured with the joint bolted, and the drive.

    - mass [kg]: of each mode
    - modes: rows of frequency [Hz], damping ratio, slide, base and output
    - is_base: whether the base is driven; frequency [Hz]; level [m/s2] or [N]
    """

    mass: float
    modes: np.ndarray
    is_base: bool
    frequency: float
    level: float


class Loop:
    """Friction loop between turning points -X and X: Masing's rule on the curve of monotone sliding."""

    def __init__(self, joint: Joint):
        self.stiffness = joint.stiffness
        self.slide, self.force, self.slip = joint.slide[-1], joint.force[-1], joint.slip[-1]
        apart = np.append(np.diff(joint.slide) > 1e-7 * self.slide, True)
        slide, force, slip = (column[apart] for column in (joint.slide, joint.force, joint.slip))
        self._force, self._slip = PchipInterpolator(slide, force), PchipInterpolator(slide, slip)

        # Half of a change of the slide is slip; slopes over an element of four nodes, and 1 beyond gross slip
        slope = (slip[4:] - slip[:-4]) / (slide[4:] - slide[:-4])
        above = np.append(np.flatnonzero(slope > 0.5), slope.size)[0]
        around = slice(above - 1, above + 1)
        middle = (slide[4:] + slide[:-4]) / 2
        self.half_slip = self.slide
        if above < slope.size:
            self.half_slip = np.interp(0.5, slope[around], middle[around])

    def force_from_rest(self, slide):
        """Return the force [N] of monotone sliding."""
        return np.where(slide < self.slide, self._force(np.clip(slide, 0, self.slide)), self.force)

    def slip_from_rest(self, slide: float) -> float:
        """Return the slip [m] of monotone sliding."""
        return float(self._slip(min(slide, self.slide))) + max(slide - self.slide, 0.0)

    def force_at(self, slide, amplitude: float, falls):
        """Return the force [N] of a cycle at slides (m,) [m] that fall or rise."""
        sign = np.where(falls, -1.0, 1.0)
        travel = np.maximum(amplitude + sign * slide, 0.0)
        return sign * (2 * self.force_from_rest(travel / 2) - self.force_from_rest(amplitude))

    def first_harmonic(self, amplitude: float) -> complex:
        """Return the first harmonic of the force [N] under a sine, over its amplitude."""
        phase = (np.arange(N_TIMES) + 0.5) * 2 * np.pi / N_TIMES
        force = self.force_at(amplitude * np.cos(phase), amplitude, phase < np.pi)
        return 2 / N_TIMES * np.sum(force * np.exp(-1j * phase)) / amplitude


def _invert_modes(rig: Rig, stiffness: float, harmonic: int) -> np.ndarray:
    """Return the receptances (n, n) [m/N] of the modes without the joint of a stiffness [N/m]."""
    frequency, damping, slide = rig.modes.T[:3]
    omega, speed = 2 * np.pi * frequency, harmonic * 2 * np.pi * rig.frequency
    free = rig.mass * np.diag(omega**2) - stiffness * np.outer(slide, slide)
    damper = np.diag(2 * rig.mass * damping * omega)
    return np.linalg.inv(free - speed**2 * rig.mass * np.eye(omega.size) + 1j * speed * damper)


def _load(rig: Rig) -> np.ndarray:
    """Return the first harmonic of the modal forces [N] of a drive of phase zero, a sine."""
    base, output = rig.modes.T[3:]
    return -1j * rig.level * (-rig.mass * base if rig.is_base else output)


class _Motion:
    """Steady slide with odd harmonics, and the residual of its balance."""

    def __init__(self, rig: Rig, loop: Loop, n_harmonics: int):
        self.loop, self.rig = loop, rig
        self.orders = 2 * np.arange(n_harmonics) + 1
        self.inverses = [_invert_modes(rig, loop.stiffness, order) for order in self.orders]
        shape = rig.modes[:, 2]
        self.receptances = np.array([shape @ inverse @ shape for inverse in self.inverses])
        self.drive = np.zeros(n_harmonics, complex)
        self.drive[0] = shape @ self.inverses[0] @ _load(rig)
        self.phase = np.arange(N_TIMES) * 2 * np.pi / N_TIMES
        self.waves = np.exp(1j * np.outer(self.orders, self.phase))

    def find_turn(self, slide: np.ndarray) -> tuple[float, float]:
        """Return phase and size of the largest slide of harmonics (n,)."""
        phase = self.phase[np.argmax((slide @ self.waves).real)]
        for _ in range(20):  # Newton's method from the largest sample
            terms = slide * np.exp(1j * self.orders * phase)
            phase += (1j * self.orders * terms).sum().real / (self.orders**2 * terms).sum().real
        return phase, (slide * np.exp(1j * self.orders * phase)).sum().real

    def find_force(self, slide: np.ndarray) -> np.ndarray:
        """Return the harmonics (n,) of the friction force [N]."""
        phase, amplitude = self.find_turn(slide)
        falls = (self.phase - phase) % (2 * np.pi) < np.pi
        force = self.loop.force_at((slide @ self.waves).real, amplitude, falls)
        return 2 / N_TIMES * (self.waves.conj() @ force)

    def solve(self) -> np.ndarray:
        """Return the harmonics (n,) of the slide [m] that balance, from the smallest motion of one harmonic."""

        def excess(amplitude):
            joint = self.receptances[0] * self.loop.first_harmonic(amplitude)
            return abs(self.drive[0] / (1 + joint)) / amplitude - 1

        trials = self.loop.slide * np.geomspace(1e-3, 1e3, 200)
        first = np.flatnonzero([excess(trial) < 0 for trial in trials])[0]
        scale = brentq(excess, trials[first - 1], trials[first])
        start = self.drive / (1 + self.receptances[0] * self.loop.first_harmonic(scale))

        def residual(parts):
            slide = scale * (parts[: self.orders.size] + 1j * parts[self.orders.size :])
            gap = slide - self.drive + self.receptances * self.find_force(slide)
            return np.concatenate([gap.real, gap.imag]) / scale

        found = root(residual, np.concatenate([start.real, start.imag]) / scale, tol=1e-12)
        assert np.abs(found.fun).max() < 1e-9, found.message
        slide = scale * (found.x[: self.orders.size] + 1j * found.x[self.orders.size :])
        speed = (1j * self.orders * slide @ self.waves).real
        assert np.sum(speed * np.roll(speed, 1) < 0) == 2, "two turning points in a cycle"
        return slide


def compute_measures(rig: Rig, joint: Joint, n_harmonics: int) -> dict[str, float]:
    """Return the measures of the steady motion."""
    loop = Loop(joint)
    motion = _Motion(rig, loop, n_harmonics)
    slide = motion.solve()
    force = motion.find_force(slide)
    turn, amplitude = motion.find_turn(slide)
    shape, output = rig.modes[:, 2], rig.modes[:, 4]
    of_output = np.array([output @ inverse @ shape for inverse in motion.inverses]) * -force
    of_output[0] += output @ motion.inverses[0] @ _load(rig)
    path = np.linspace(0, amplitude, 20001)
    end = float(loop.force_from_rest(amplitude))
    measures = {
        "relative_displacement_amplitude": motion.find_turn(of_output)[1],
        "loop_area": 8 * trapezoid(loop.force_from_rest(path), path) - 4 * amplitude * end,
        "secant_stiffness": end / amplitude,
        "equivalent_stiffness": (force[0] / slide[0]).real,
        "slip_amplitude": loop.slip_from_rest(amplitude),
        "stick_fraction": 1.0,
    }
    if amplitude > loop.half_slip:
        delay = np.linspace(0, np.pi, 8001)
        travel = amplitude - (slide @ np.exp(1j * np.outer(motion.orders, turn + delay))).real
        stuck = np.interp(2 * loop.half_slip, np.maximum.accumulate(travel), delay)
        measures["stick_fraction"] = stuck / np.pi
        measures["slip_start_phase"] = (turn + stuck) % np.pi
    return measures


def compute_truths(block: Block, rig: Rig) -> tuple[dict[str, float], dict[str, float]]:
    """Return the measures, and twice their changes from a coarser reference, by name."""
    coarse = compute_measures(rig, solve_joint(block, COARSE), 21)
    fine = compute_measures(rig, solve_joint(block, FINE), 31)
    return fine, {name: 2 * abs(fine[name] - coarse.get(name, np.inf)) for name in fine}


def _round(value: float) -> float:
    """Return a value with five digits, as the scene has it."""
    return float(f"{value:.5g}")


def draw_rig(seed: int, number: int) -> tuple[str, Block, Rig]:
    """Return a scene, its blocks and its rig: crowns and tilts, coatings, base and force, one and two modes in turn.

    The slide is 0.14 to 2.5 times the slide at which a joint of constant stiffness would slip.
    """
    draw = np.random.default_rng([seed, number])
    shape = "tilt" if number % 2 else "crown"
    is_base = bool(number // 2 % 2) ^ bool(number % 2)
    length = _round(10 ** draw.uniform(1, 1.6))
    height = _round(length * draw.uniform(0.25, 0.7))
    width = _round(draw.uniform(7, 25))
    load, friction = _round(10 ** draw.uniform(2, 2.8)), _round(draw.uniform(0.15, 0.45))
    substrate = str(draw.choice(list(SUBSTRATES)))
    young, nu = SUBSTRATES[substrate]
    filled = draw.uniform(0.18, 0.45) if shape == "crown" else draw.uniform(0.3, 0.75)
    line_load, edge = load / (width * 1e-3), filled * length * 1e-3
    if shape == "crown":
        size = (0.6 * edge) ** 2 * np.pi * young / (2 * (1 - nu**2)) / (4 * line_load)
    else:
        modulus = young * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
        size = 4 * height * 1e-3 * line_load / (modulus * edge**2)
    size = _round(size)
    material, thickness = str(draw.choice(list(COATINGS))), _round(draw.uniform(100, 400))
    is_coated = number % 6 in (2, 5)
    coating = (thickness * 1e-6, *COATINGS[material]) if is_coated else None
    sizes = (length * 1e-3, width * 1e-3, height * 1e-3)
    block = Block(*sizes, load, young, nu, friction, shape, size, coating)
    loop = Loop(solve_joint(block, ROUGH))

    # The joint has 10 to 50 % of the stiffness of the first mode, and 3 to 15 % of that of the second one
    mass = _round(10 ** draw.uniform(-0.3, 0.5))
    slide_per_hertz = 2 * np.pi * np.sqrt(mass / loop.stiffness)
    first = _round(10 ** draw.uniform(2.3, 3.1))
    part = draw.uniform(0.1, 0.5)
    damping = _round(draw.uniform(0.01, 0.02))
    modes = [[first, damping, _round(np.sqrt(part) * slide_per_hertz * first), 1.0, 1.0]]
    second, part = _round(first * draw.uniform(1.4, 2.5)), draw.uniform(0.03, 0.15)
    sign, base, output = (
        float(draw.choice([-1, 1])),
        draw.uniform(0.7, 1.0),
        draw.uniform(-0.5, 0.5),
    )
    damping = _round(draw.uniform(0.01, 0.02))
    if number % 4 >= 2:
        base = modes[0][3] = _round(base)
        slide = sign * _round(np.sqrt(part) * slide_per_hertz * second)
        modes.append([second, damping, slide, _round(0.9 * np.sqrt(1 - base**2)), _round(output)])

    # The level gives the slide, in one harmonic
    amplitude = 10 ** draw.uniform(np.log10(0.14), np.log10(2.5)) * loop.force / loop.stiffness
    frequency = _round(first * draw.uniform(0.85, 1.03))
    rig = Rig(mass, np.array(modes), is_base, frequency, 1.0)
    inverse = _invert_modes(rig, loop.stiffness - loop.first_harmonic(amplitude), 1)
    level = _round(amplitude / abs(rig.modes[:, 2] @ inverse @ _load(rig)))
    rig = rig._replace(level=level)

    lines = [
        "[contact]",
        *(f'{key} = "{value} mm"' for key, value in zip(("length", "width", "height"), (length, width, height))),
        f'load = "{load} N"\nsubstrate = "{substrate}"',
    ]  # fmt: skip
    if is_coated:
        lines.append(f'[contact.coating]\nmaterial = "{material}"\nthickness = "{thickness} um"')
    lines.append(f"[contact.{shape}]")
    lines.append(f'radius = "{size} m"' if shape == "crown" else f'angle = "{size} rad"')
    lines.append(f'[contact.shear]\n[friction]\nlaw = "coulomb"\nstatic = {friction}')
    lines.append(f'[structure]\nmeasured = "stuck"\nmoving_mass = "{mass} kg"')
    for k, (natural, *numbers) in enumerate(modes):
        lines.append(f'[[structure.mode]]\nname = "m{k}"\nfrequency = "{natural} Hz"')
        keys = ("damping", "slide", "base", "output")
        lines += [f"{key} = {number}" for key, number in zip(keys, numbers)]
    lines.append(f'[drive]\nfrequency = "{frequency} Hz"\ncycles = 400')
    drive = f'kind = "base"\nacceleration = "{level} m/s^2"'
    lines.append(drive if is_base else f'kind = "force"\nforce = "{level} N"')
    return "\n".join(lines), block, rig
