"""Random chains of masses with interfaces that slide in a plane, against an integration of their rate equations.

Campaign `planes` of `campaigns`. DOP853 integrates the masses and the elongation s of every
tangential spring: s' = q' while |s| < m or s.q' < 0, else the part of q' normal to s, with each
change of state as an event. Nothing of the package is used. Seeds below 7000 were used in
development.
"""

from itertools import pairwise
from pathlib import Path

import numpy as np
from campaigns import measure_rows
from scipy.integrate import solve_ivp
from scipy.spatial import ConvexHull, distance

import patchfem as pf

SAMPLES = 4000  # Samples per cycle at which the solution is evaluated.
# Minimum number of steps per cycle; an event that begins and ends within one step is missed.
STEPS = 400
HEAD = "[structure]\nmasses = {masses}\noutput_mass = {seen}\n"
LINK = '[[structure.{kind}]]\nbetween = {pair}\n{key} = "{value!r} {unit}"\n'
RUBS = (
    '[[structure.interface]]\nbetween = {0}\n{1}law = "elastic-plastic"\nstatic = 0.4\nstiffness = "{2!r} N/m"\n'
    'load = "{3!r} N"\n'
)
DRIVE = '[drive]\nkind = "{drive}"\nfrequency = "{frequency!r} Hz"\n{size}\ncycles = {cycles}\n'


def draw_chain(seed: int) -> dict:
    """Return the parameters of a random chain of 1 to 3 nodes with two masses each.

    Mass 2 k - 1 moves along x, mass 2 k along y.
    """
    r = np.random.default_rng(seed)
    nodes = int(r.integers(1, 4))
    masses = r.uniform(0.5, 2, 2 * nodes)
    links = []
    for k in range(nodes):
        x = 2 * k + 1
        y = 2 * k + 2
        previous = max(2 * k - 1, 0)
        links += [
            ((x, previous), r.uniform(2e4, 8e4)),
            ((y, previous and previous + 1), r.uniform(2e4, 8e4)),
            ((x, y), r.uniform(0, 1e4)),
        ]
    springs = [(pair, float(k)) for pair, k in links]
    K = assemble_matrix(springs, 2 * nodes)
    C = assemble_matrix(make_dampers(springs), 2 * nodes)
    omega = np.sqrt(np.linalg.eigvalsh(K / np.sqrt(np.outer(masses, masses))))
    drive = str(r.choice(["base", "force"]))
    frequency = float(r.choice(omega[:2]) * r.uniform(0.7, 1.3))
    push = float(10 ** r.uniform(0, 2))
    interfaces = []
    limit = push * 10 ** r.uniform(-1.2, 0.1)
    nodes_with_friction = r.choice(nodes, int(r.integers(1, nodes + 1)), replace=False)
    for k in (int(interface) for interface in nodes_with_friction):
        partner = 2 * k - 1 if k and r.random() < 0.5 else 0
        stiff = float(10 ** r.uniform(4, 5.3))
        load = float(limit / 0.4 * r.uniform(0.5, 1.5))
        interfaces.append(
            (
                [2 * k + 1, partner],
                [2 * k + 2, partner and partner + 1]
                if r.random() < 0.8 or not interfaces
                else None,
                stiff,
                load,
            )
        )
    interfaces.sort(key=lambda one: one[1] is None)
    return {
        "seed": seed,
        "masses": masses,
        "springs": springs,
        "K": K,
        "C": C,
        "faces": interfaces,
        "drive": drive,
        "law": f"{sum(interface[1] is not None for interface in interfaces)} of {len(interfaces)} in planes",
        "frequency": frequency / 2 / np.pi,
        "push": push / (1.0 if drive == "force" else float(masses.sum())),
        "pushed": int(r.integers(1, 2 * nodes + 1)),
        "seen": int(r.integers(1, 2 * nodes + 1)),
        "cycles": int(r.integers(6, 25)),
    }


def difference_row(pair, n: int) -> np.ndarray:
    """Return the row (n,) that gives the relative displacement of two masses, numbered from 1; 0 is the base."""
    unit = np.vstack([np.zeros(n), np.eye(n)])
    return unit[pair[0]] - unit[pair[1]]


def assemble_matrix(links, n: int) -> np.ndarray:
    """Return the matrix (n, n) of links (pair, value)."""
    return sum(
        value * np.outer(difference_row(pair, n), difference_row(pair, n)) for pair, value in links
    )


def make_dampers(springs) -> list:
    """Return the dampers in parallel with the springs."""
    return [(pair, 2e-4 * k) for pair, k in springs]


def format_scene(s: dict) -> str:
    """Return the scene of a chain as text."""
    out = HEAD.format(masses=[f"{m!r} kg" for m in s["masses"].tolist()], seen=s["seen"])
    for kind, links, key, unit in (
        ("spring", s["springs"], "stiffness", "N/m"),
        ("damper", make_dampers(s["springs"]), "coefficient", "N s/m"),
    ):
        out += "".join(
            LINK.format(kind=kind, pair=list(pair), key=key, value=value, unit=unit)
            for pair, value in links
        )
    for pair, lateral, stiff, load in s["faces"]:
        out += RUBS.format(pair, f"lateral = {lateral}\n" if lateral else "", stiff, load)
    size = (
        f'acceleration = "{s["push"]!r} m/s^2"'
        if s["drive"] == "base"
        else f'force = "{s["push"]!r} N"\nmass = {s["pushed"]}'
    )
    return out + DRIVE.format(**s | {"size": size})


class ChainMotion:
    """Rate equations of a chain.

    The state y consists of displacements, velocities, elongations, and the work and loss of every
    interface.
    """

    def __init__(self, s: dict):
        self.s = s
        n = len(s["masses"])
        self.n = n
        self.m = s["masses"]
        self.omega = 2 * np.pi * s["frequency"]
        self.rows = [
            np.array([difference_row(pair, n) for pair in pairs if pair])
            for *pairs, _, _ in s["faces"]
        ]
        self.k, self.most = zip(*((stiff, 0.4 * load / stiff) for *_, stiff, load in s["faces"]))
        ends = 2 * n + np.cumsum([0, *map(len, self.rows)])
        self.at = [slice(a, b) for a, b in pairwise(ends)]
        self.size = int(ends[-1]) + 2 * len(self.rows)
        self.push = (
            -self.m * s["push"]
            if s["drive"] == "base"
            else s["push"] * difference_row((s["pushed"], 0), n)
        )

    def derivative(self, t, y, slips):
        """Return dy/dt; slips: whether each interface slips."""
        n = self.n
        out = np.zeros_like(y)
        out[:n] = y[n : 2 * n]
        force = (
            self.push * np.sin(self.omega * t) - self.s["K"] @ y[:n] - self.s["C"] @ y[n : 2 * n]
        )
        for i, (rows, part, k) in enumerate(zip(self.rows, self.at, self.k)):
            stretch = y[part]
            speed = rows @ y[n : 2 * n]
            elastic_rate = (
                speed - stretch * (stretch @ speed) / (stretch @ stretch) if slips[i] else speed
            )
            force -= k * rows.T @ stretch
            out[part] = elastic_rate
            out[self.size - 2 * len(self.rows) + 2 * i :][:2] = (
                k * stretch @ speed,
                k * stretch @ (speed - elastic_rate),
            )
        out[n : 2 * n] = force / self.m
        return out

    def make_event(self, i: int, slips: bool):
        """Return the event function that ends the present state of interface i."""

        def margin(t, y, *_):
            """Return the margin to the end of the state."""
            stretch = y[self.at[i]]
            return (
                stretch @ (self.rows[i] @ y[self.n : 2 * self.n])
                if slips
                else stretch @ stretch - self.most[i] ** 2
            )

        margin.terminal = True
        margin.direction = -1 if slips else 1
        return margin

    def run(self, end: float, first: float, rtol: float) -> tuple:
        """Return (times, y) with SAMPLES per cycle from `first` [s] to the end."""
        period = 2 * np.pi / self.omega
        times = np.linspace(first, end, round((end - first) / period * SAMPLES) + 1)
        y = np.zeros(self.size)
        slips = [False] * len(self.rows)
        t = 0.0
        out = np.zeros((times.size, self.size))
        atol = rtol * np.concatenate(
            [
                np.full(self.n, min(self.most)),
                np.full(self.n, min(self.most) * self.omega),
                np.full(self.size - 2 * self.n, min(self.most)),
            ]
        )
        atol[-2 * len(self.rows) :] *= max(self.k) * max(self.most)
        while t < end:
            solution = solve_ivp(
                self.derivative,
                (t, end),
                y,
                "DOP853",
                dense_output=True,
                args=(slips,),
                rtol=rtol,
                atol=atol,
                events=[self.make_event(i, is_slipping) for i, is_slipping in enumerate(slips)],
                max_step=period / STEPS,
            )
            assert solution.success, solution.message
            is_inside = (times >= t) & (times <= solution.t[-1])
            out[is_inside] = solution.sol(times[is_inside]).T if is_inside.any() else out[is_inside]
            t = solution.t[-1]
            y = solution.y[:, -1].copy()
            for i, hit in enumerate(solution.t_events):
                if hit.size:
                    slips[i] = not slips[i]
                if slips[i]:
                    y[self.at[i]] *= self.most[i] / np.linalg.norm(y[self.at[i]])
        # These checks show that no event was missed.
        for i, (part, max_stretch) in enumerate(zip(self.at, self.most)):
            assert np.linalg.norm(out[:, part], axis=1).max() <= max_stretch * (1 + 1e-8)
            lost = out[:, 2 * i + 1 - 2 * len(self.rows)]
            assert np.diff(lost).min() >= -1e-9 * lost[-1] - 1e-12 * self.k[i] * max_stretch**2
        return times, out


def max_distance(positions) -> float:
    """Return the largest distance between two positions (k, 1 or 2) [m]."""
    if positions.shape[1] == 1:
        return float(np.ptp(positions))
    try:
        positions = positions[ConvexHull(positions).vertices]
    except Exception:  # All positions lie on a line.
        positions = positions[np.lexsort(positions.T)[[0, -1]]]
    return float(distance.pdist(positions).max())


def compute_measures(motion: ChainMotion, times, y, cycles: float) -> dict:
    """Return the measures of the last cycles by name, as MEASURES.md defines them."""
    s = motion.s
    n = motion.n
    output = motion.s["seen"] - 1
    base = s["push"] * np.sin(motion.omega * times) if s["drive"] == "base" else 0.0
    last = -2 * len(motion.rows)
    works = y[:, last:]
    force = (
        motion.push[:, None] * np.sin(motion.omega * times)
        - s["K"] @ y[:, :n].T
        - s["C"] @ y[:, n : 2 * n].T
    )
    out = {
        "relative_displacement_amplitude": np.ptp(y[:, output]) / 2,
        "friction_work": works[-1, ::2].sum(),
        "energy_dissipated": works[-1, 1::2].sum(),
    }
    for i, (rows, part, k) in enumerate(zip(motion.rows, motion.at, motion.k)):
        suffix = f"_{i + 1}" if i else ""
        stretch = y[:, part]
        force -= k * rows.T @ stretch.T
        slip = y[:, :n] @ rows.T - stretch
        out |= {
            f"friction_force_peak{suffix}": k * np.linalg.norm(stretch, axis=1).max(),
            f"slip_amplitude{suffix}": max_distance(slip) / 2,
            f"loop_area{suffix}": (works[-1, 2 * i] - works[0, 2 * i]) / cycles,
        }
    out["absolute_acceleration_peak"] = np.abs(force[output] / motion.m[output] + base).max()
    return {name: float(value) for name, value in out.items()}


def solve_reference(s: dict, window: int, rtol: float = 1e-10) -> dict:
    """Return the measures of the last `window` cycles of a chain."""
    motion = ChainMotion(s)
    period = 1 / s["frequency"]
    return compute_measures(
        motion, *motion.run(s["cycles"] * period, (s["cycles"] - window) * period, rtol), window
    )


def compare_chain(seed: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare the chain of a seed with its integration; see `campaigns`."""
    s = draw_chain(seed)
    path = folder / "scene.toml"
    path.write_text(format_scene(s))
    result = pf.run(path)
    line = {"group": f"{s['law']}, {s['drive']}", "engine": result.extra["engine"], "rows": []}
    if result.outcome == "not_converged":
        return line | {"refused": str(result.outcome)}
    reference = solve_reference(s, int(result.extra["window"]))
    uncertainties = {name: 1e-6 * abs(value) for name, value in reference.items()}
    return line | {"rows": measure_rows(result.measures, reference, uncertainties)}
