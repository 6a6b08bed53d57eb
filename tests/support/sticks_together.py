"""Random rigs with several Coulomb interfaces that may stick at the same time, against DOP853 with events.

Campaign `stick-together` of `campaigns`; seeds from 29 500 000 on were not used in development. The
reference tries every combination of slip directions.

2 to 4 masses, 2 or 3 interfaces, ratio of kinetic to static friction from 1 to 0.02. Consecutive
seeds have four kinds: `mirror`: equal masses and couplings, so that all interfaces stick at the
same time; `twins`: equal interfaces between the same two bodies, whose shares of the force in stick
are not determined; `release` from a displacement at rest and `step` of the base, where all
interfaces choose stick or slip at the start. Several combinations can be consistent if kinetic
friction is less than static; a motion is correct if it agrees with one of the orders in which the
reference tries them. There are more interfaces than masses only if both frictions are equal;
otherwise there would be a continuum of motions. The motion is then unique, because its acceleration
minimizes a convex function, but the shares of the force are not, and the reference, which uses the
shares, may find another motion; in that case Moreau's time stepping decides, within the error of
its steps.
"""

import signal
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from campaigns import Row
from event_reference import march_reference, run_reference
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import eigh

import patchfem as pf

CYCLES = 6
KINDS, RATIOS = ("mirror", "twins", "release", "step"), (1.0, 0.95, 0.5, 0.2, 0.05, 0.02)
# Order of combinations in the reference: equal interfaces together, or fewest or most slipping
# interfaces first.
ORDERS = {
    "mirror": ("together", "fewest", "most"),
    "twins": ("together",),
    "release": ("fewest", "most"),
    "step": ("fewest", "most"),
}
# Tolerances: difference relative to the largest displacement; energy balance relative to the
# energy.
SAME, BALANCED = 1e-6, 1e-9
STEPS, NEAR = 3000, 2e-3  # Steps of the time stepping for dependent interfaces, and its own error.
LONGEST = 20  # Time limit of a reference [CPU s].


def draw_spec(seed: int) -> dict:
    """Return the parameters of a rig in SI units.

    `links` are (pair, stiffness [N/m], damping [N s/m]); bodies are numbered from 1, and 0 is the
    base.
    """
    r = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    faces = int(r.integers(2, 4))
    ratio = RATIOS[int(r.integers(len(RATIOS)))]
    n = int(r.integers(2 if kind == "twins" or (ratio == 1 and kind != "mirror") else faces, 5))
    is_symmetric = kind == "mirror"
    omega = 2 * np.pi * r.uniform(50, 200)
    mass = np.full(n, r.uniform(0.3, 2)) if is_symmetric else r.uniform(0.3, 2, n)
    ground = mass * omega**2 * r.uniform(0.5, 1.5, n)
    between = r.uniform(0.1, 0.8, (n, n)) * mass[0] * omega**2
    if is_symmetric:
        ground[:] = ground[0]
        between[:] = between[0, 0]
    links = [((k + 1, 0), ground[k]) for k in range(n)]
    links += [
        ((k + 1, j + 1), between[k, j])
        for k in range(n)
        for j in range(k)
        if is_symmetric or j == k - 1
    ]
    zeta = r.uniform(0.002, 0.05)
    size = r.uniform(10, 80)
    pairs = [[1, 0]] * faces if kind == "twins" else [[k + 1, 0] for k in range(min(faces, n))]
    if len(pairs) < faces:
        pairs.append([2, 1])
    limit_ratio = (
        np.full(faces, r.uniform(0.15, 0.6)) if is_symmetric else r.uniform(0.15, 0.6, faces)
    )
    if kind == "twins":
        limit_ratio[:] = limit_ratio[0] / faces
    limit = limit_ratio * size * (mass[0] if kind in ("mirror", "twins") else mass.mean())
    start = size / omega**2 * r.uniform(-4, 4, n) if kind == "release" else np.zeros(n)
    return {
        "seed": seed,
        "kind": kind,
        "mass": mass.tolist(),
        "pairs": pairs,
        "size": size,
        "start": start.tolist(),
        "links": [
            (list(pair), float(k), float(2 * zeta * np.sqrt(k * mass[0]))) for pair, k in links
        ],
        "load": (limit / 0.3).tolist(),
        "frequency": omega / (2 * np.pi) * r.uniform(0.5, 1.5),
        "ratio": ratio,
    }


def format_scene(s: dict) -> str:
    """Return the scene of a spec as text."""
    masses = ", ".join(f'"{mass!r} kg"' for mass in s["mass"])
    out = f"[structure]\nmasses = [{masses}]\n"
    for pair, k, c in s["links"]:
        out += f'[[structure.spring]]\nbetween = {pair}\nstiffness = "{k!r} N/m"\n'
        out += f'[[structure.damper]]\nbetween = {pair}\ncoefficient = "{c!r} N s/m"\n'
    for pair, load in zip(s["pairs"], s["load"]):
        out += f'[[structure.interface]]\nbetween = {pair}\nlaw = "coulomb"\nload = "{load!r} N"\n'
        out += f"static = 0.3\nkinetic = {0.3 * s['ratio']!r}\n"
    if s["kind"] == "release":
        displacements = ", ".join(f'"{x!r} m"' for x in s["start"])
        return (
            out
            + f'[structure.start]\ndisplacement = [{displacements}]\n[drive]\nkind = "free"\ncycles = {CYCLES}\n'
        )
    wave = (
        'waveform = "step"\n' if s["kind"] == "step" else f'frequency = "{s["frequency"]!r} Hz"\n'
    )
    return (
        out
        + f'[drive]\nkind = "base"\n{wave}acceleration = "{s["size"]!r} m/s^2"\ncycles = {CYCLES}\n'
    )


def difference_row(pair, n: int) -> np.ndarray:
    """Return the row of x_i - x_j for a pair (i, j)."""
    out = np.zeros(n + 1)
    out[pair[0]] += 1
    out[pair[1]] -= 1
    return out[1:]


def make_matrices(s: dict) -> tuple:
    """Return mass, stiffness and damping (n, n), and the rows of the interfaces (i, n) of a rig."""
    n = len(s["mass"])
    stiff, damp = (
        sum(
            link[which] * np.outer(difference_row(link[0], n), difference_row(link[0], n))
            for link in s["links"]
        )
        for which in (1, 2)
    )
    return (
        np.diag(s["mass"]),
        stiff,
        damp,
        np.array([difference_row(pair, n) for pair in s["pairs"]]),
    )


def difference_from_march(s: dict, time, slide) -> float:
    """Return the largest difference of displacements (i, t) [m] from Moreau's time stepping.

    It is relative to the largest displacement; the last of the times (t,) [s] is the end.
    """
    mass, stiff, damp, faces = make_matrices(s)
    square, shapes = eigh(stiff, mass)
    modes = SimpleNamespace(
        interfaces=faces @ shapes,
        mass=1.0,
        omega=np.sqrt(square),
        damping_matrix=shapes.T @ damp @ shapes,
        base=shapes.T @ mass @ np.ones(len(mass)),
    )
    size = s["size"] if s["kind"] != "release" else 0.0
    omega = 2 * np.pi * s["frequency"]
    drive = SimpleNamespace(
        values=lambda t: np.full_like(t, size) if s["kind"] == "step" else size * np.sin(omega * t)
    )
    times, z = march_reference(
        modes,
        drive,
        0.3 * np.array(s["load"]),
        time[-1],
        shapes.T @ mass @ np.array(s["start"]),
        np.zeros(len(mass)),
        STEPS,
    )
    displacements = z @ shapes.T @ faces.T
    difference = max(
        np.abs(np.interp(time, times, reference) - values).max()
        for reference, values in zip(displacements.T, slide)
    )
    return float(difference / np.abs(displacements).max())


def solve_reference(s: dict, end: float, order: str) -> tuple:
    """Return times (t,) [s] of events and the end, displacements (t, i) [m] and directions (t, i).

    They are those of the reference, in modes of unit mass. order: as in ORDERS; with `together`,
    equal interfaces are one that carries the total load, and equal bodies are one.
    """
    (mass, stiff, damp, faces), n = make_matrices(s), len(s["mass"])
    group = np.arange(len(faces))
    bodies = np.eye(n)
    if order == "together":
        group[:] = 0
    if order == "together" and s["kind"] == "mirror":
        with_face = np.arange(n) < len(faces)
        bodies = np.array([one for one in (with_face, ~with_face) if one.any()], float).T
    square, shapes = eigh(bodies.T @ stiff @ bodies, bodies.T @ mass @ bodies)
    shapes = bodies @ shapes
    modes = SimpleNamespace(
        interfaces=(faces @ shapes)[np.unique(group)],
        mass=1.0,
        omega=np.sqrt(square),
        damping_matrix=shapes.T @ damp @ shapes,
        base=shapes.T @ mass @ np.ones(n),
    )
    size = s["size"] if s["kind"] != "release" else 0.0
    omega = 2 * np.pi * s["frequency"]
    constant, amplitude = (size, 0.0) if s["kind"] == "step" else (0.0, size)
    drive = SimpleNamespace(
        start=0.0,
        constant=constant,
        amplitude=amplitude,
        phase=0.0,
        omega=0.0 if s["kind"] == "step" else omega,
    )
    static = 0.3 * np.bincount(group, s["load"])
    start = shapes.T @ mass @ np.array(s["start"])
    states = run_reference(
        modes,
        [drive],
        static,
        s["ratio"] * static,
        end,
        start,
        np.zeros(len(square)),
        most_sliding=order == "most",
    )
    time, signs, z, _ = zip(*states)
    return np.array(time), np.array(z) @ shapes.T @ faces.T, np.array(signs)[:, group]


def compare_rig(seed: int, folder: Path | None = None, earlier: dict | None = None) -> dict:
    """Compare the displacements of a rig with the reference at its events; see `campaigns`.

    Each order of combinations is tried until one agrees.
    """
    s = draw_spec(seed)
    line = {"group": f"{s['kind']}, {s['ratio']}", "engine": "events"}
    try:
        result = pf.run(format_scene(s), say=lambda _: None)
    except pf.PatchfemError as error:
        return line | {"rows": [], "refused": str(error)}
    data = result.to_xarray()
    time, slide, speed = (data[name].values for name in ("time", "slide", "slide_velocity"))
    is_last = np.append(np.diff(time) > 0, True)
    curve = CubicHermiteSpline(time[is_last], slide[:, is_last], speed[:, is_last], axis=1)
    gaps = {}
    failed = {}
    for order in ORDERS[s["kind"]]:
        signal.setitimer(signal.ITIMER_PROF, LONGEST)
        try:
            event_times, reference, _ = solve_reference(s, float(time[-1]), order)
        except (AssertionError, TimeoutError) as error:
            failed[order] = repr(error)
            continue
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
        scale = max(np.abs(reference).max(), np.abs(slide).max(), 1e-300)
        gaps[order] = float(np.abs(curve(event_times).T - reference).max() / scale)
        if gaps[order] <= SAME:
            break
    gap = min(gaps.values(), default=np.inf)
    tolerance = SAME
    if gap > SAME and len(s["pairs"]) > len(s["mass"]):
        gap = difference_from_march(s, time, slide)
        tolerance = NEAR
    balance = result.measures["energy_balance"].value
    rows = [
        Row("slides", gap, tolerance, 0.0, 0.0, 0.0),
        Row("energy_balance", balance, BALANCED, 0.0, 0.0, 0.0),
    ]
    return line | {"gaps": gaps, "failed": failed, "rows": rows}
