"""Peaks of response curves of random rigs beside motions by brute force (`brute`), and beside their drawn curves.

    python tests/support/curve_campaign.py OUT [CPU_SECONDS]

Recipe: rig k of N_RIGS has the seed FIRST_SEED + k, a chain of 1 to 3 masses, and an interface to the ground at each of its
1 to 3 last masses, with the laws in turn. Each sixth rig has a cubic spring, whose curve may have folds. The amplitude at
the stated frequency of the peak is compared with that of the brute-force motion from rest or, where several motions
coexist, of the nearest from other starts; its own uncertainty is added to the error. A multiplier is compared with the
decay of the difference of two brute-force motions, on which MULTIPLIER_TOL is allowed, because they have steps of order 1.
A sweep's peak without a curve agrees with that of the run that draws it.
"""

import json
import signal
import sys
import tomllib
from pathlib import Path
from time import process_time

import numpy as np
from brute import systems
from brute.gauss_seidel import march
from brute.recipe import Sizes, write_law

import patchfem as pf

FIRST_SEED = 20302700
N_RIGS = 60
LAWS = ("elastic-plastic", "iwan", "tanh", "nonlocal", "bouc-wen", "lugre", "stiffness", "coulomb")
N_CYCLES = 300  # cycles of the brute-force motions from rest
N_STEPS = 800  # their steps per cycle
MULTIPLIER_TOL = 0.02
COEXISTING_TOL = 0.01  # relative difference of amplitudes above which the motions are not the same
MAX_CPU_SECONDS = 60.0  # of a rig, after which it is left out
AMPLITUDE = "relative_displacement_amplitude"


def make_structure(seed: int) -> tuple[str, float, float]:
    """Return the structure of a rig as text, its lowest frequency without friction [rad/s], and a drive [m/s2]."""
    number = seed - FIRST_SEED
    return make_chain(seed, number, 1 + number % 3, (0.005, 0.05) if number % 6 == 5 else None)


def make_chain(
    seed: int, number: int, n: int, cubic: tuple[float, float] | None
) -> tuple[str, float, float]:
    """Return a chain of `n` masses as text, its lowest frequency without friction [rad/s], and a drive [m/s2].

    Parameters
    ----------
    seed : int
    number : int
        Number of the rig, which says with which law the interfaces begin.
    n : int
    cubic : (2,) tuple of float or None
        Range of the part of a cubic spring in the stiffness at the amplitude a/omega^2.
    """
    rng = np.random.default_rng(seed)
    n_faces = int(rng.integers(1, n + 1))
    omega = 2 * np.pi * rng.uniform(60, 200)
    masses = rng.uniform(0.5, 1.5, n)
    springs = masses * omega**2 * rng.uniform(0.8, 2, n)
    dampers = 2 * rng.uniform(0.01, 0.03, n) * np.sqrt(masses * springs)
    text = f"[structure]\nmasses = {[f'{mass:.6g} kg' for mass in masses]}\n"
    for k in range(n):
        text += f"[[structure.spring]]\nbetween = [{k + 1}, {k}]\n"
        text += f'stiffness = "{springs[k]:.6g} N/m"\n'
        text += f"[[structure.damper]]\nbetween = [{k + 1}, {k}]\n"
        text += f'coefficient = "{dampers[k]:.6g} N s/m"\n'

    # Friction of about the drive force of a mass
    rows = np.eye(n) - np.eye(n, k=-1)
    stiffness = rows.T @ np.diag(springs) @ rows
    lowest = float(np.sqrt(np.linalg.eigvals(np.diag(1 / masses) @ stiffness).real.min()))
    acceleration = rng.uniform(5, 30)
    for face in range(n_faces):
        mass = n - face
        static = rng.uniform(0.2, 0.5)
        limit = rng.uniform(0.2, 1.0) * masses[mass - 1] * acceleration / n_faces
        sizes = Sizes(limit, limit / static, static, lowest, acceleration / lowest**2, 0.01)
        law = LAWS[(number + face) % len(LAWS)]
        text += f"[[structure.interface]]\nbetween = [{mass}, 0]\n"
        text += write_law(rng, law, sizes, has_patch=False)
        text += f'load = "{limit / static:.6g} N"\n'
    if cubic is not None:
        coefficient = rng.uniform(*cubic) * springs[0] * (lowest**2 / acceleration) ** 2
        text += f'[structure.stiffening]\ncubic = "{coefficient:.6g} N/m^3"\n'
    return text, lowest, acceleration


def make_sweep(seed: int) -> str:
    """Return the scene of the response curve of a rig."""
    text, omega, acceleration = make_structure(seed)
    frequency = omega / (2 * np.pi)
    return (
        f'{text}[drive]\nkind = "base"\nwaveform = "sweep"\nacceleration = "{acceleration:.12g} m/s^2"\n'
        f'from = "{0.7 * frequency:.6g} Hz"\nto = "{1.9 * frequency:.6g} Hz"\nrate = "1 Hz/s"\n'
        '[accuracy]\nmethod = "harmonic"\ntolerance = 1e-2\n'
    )


def make_sine(seed: int, frequency: float) -> str:
    """Return the scene of a rig under a sine, for `brute`."""
    text, _, acceleration = make_structure(seed)
    return (
        f'{text}[drive]\nkind = "base"\nacceleration = "{acceleration / 9.80665:.12g} g"\n'
        f'frequency = "{frequency:.12g} Hz"\ncycles = {N_CYCLES}\n'
    )


def march_output(text: str, n_steps: int, start=0.0) -> np.ndarray:
    """Return the displacement of the output [m] (N_CYCLES, n_steps) by brute force.

    Parameters
    ----------
    text : str
        Scene of `make_sine`.
    n_steps : int
        Steps per cycle.
    start : float or (2 n,) array
        Displacements and velocities at the start.
    """
    tables = tomllib.loads(text)
    period = 1 / systems.read_number(tables["drive"]["frequency"])
    time = period * np.arange(N_CYCLES * n_steps + 1) / n_steps
    structure = systems.make_structure(tables, time)
    points, loads = systems._make_points(tables, time)
    state = np.zeros(2 * structure.rows.shape[1]) + start
    samples = np.zeros((time.size, 2 * structure.rows.shape[0] + 1))
    march(points, structure, loads, float(time[1]), state, samples)
    return samples[1:, -1].reshape(N_CYCLES, n_steps)


def find_brute_amplitude(text: str, start=0.0) -> tuple[float, float]:
    """Return the amplitude [m] of the motion from a start, extrapolated from three step lengths, and its uncertainty."""
    sizes = [
        float(np.ptp(march_output(text, N_STEPS // divisor, start)[-1])) / 2
        for divisor in (4, 2, 1)
    ]
    earlier, change = np.diff(sizes)
    if change and 1.6 < earlier / change < 2.5:
        return sizes[2] + change, abs(change)
    return sizes[2], max(abs(change), 0.5 * abs(earlier))


def list_starts(text: str, amplitude: float) -> list:
    """Return states of all masses at an amplitude [m] of the output, at several phases, from which motions may differ."""
    tables = tomllib.loads(text)
    omega = 2 * np.pi * systems.read_number(tables["drive"]["frequency"])
    n = len(tables["structure"]["masses"])
    shape = np.arange(n, 0, -1) / n
    angles = np.arange(8) * np.pi / 4
    return [
        amplitude * np.append(np.cos(angle) * shape, np.sin(angle) * omega * shape)
        for angle in angles
    ]


def measure_multiplier(text: str) -> float:
    """Return the ratio per cycle of the differences of two brute-force motions; nan where they vanish at once."""
    first = march_output(text, N_STEPS // 3)
    second = march_output(text, N_STEPS // 3, 1e-3 * np.abs(first[-1]).max())
    difference = np.abs(second - first).max(axis=1)
    # Late cycles, whose difference is well above round-off
    used = np.flatnonzero(difference > 1e-9 * np.abs(first).max())
    used = used[used > 10][-40:]
    if used.size < 8:
        return np.nan
    return float(np.exp(np.polyfit(used, np.log(difference[used]), 1)[0]))


def examine(seed: int) -> dict:
    """Return stated values of a rig beside its brute-force motion."""
    text = make_sweep(seed)
    row = {"seed": seed}
    begin = process_time()
    drawn = pf.run(text)
    row["drawn_seconds"] = process_time() - begin
    row["outcome"] = [str(drawn.outcome)]
    stated = drawn.measures[AMPLITUDE]
    frequency = drawn.measures["peak_frequency"]
    if stated.value is None or frequency.value is None or stated.error is None:
        return row
    row["amplitude"] = [stated.value, stated.error]

    # The peak of a sweep follows from the curve where the laws have no harmonic balance.
    is_balanced = not any(f'"{law}"' in text for law in ("tanh", "nonlocal", "bouc-wen", "lugre"))
    if is_balanced and "stiffening" not in text:
        begin = process_time()
        cases = pf.run_many(text)
        row["sweep_seconds"] = process_time() - begin
        row["outcome"].append(str(cases.outcome[0]))
        row["sweep_amplitude"] = [
            float(part[AMPLITUDE][0]) for part in (cases.values, cases.errors)
        ]
    row["frequency"] = [frequency.value, frequency.error]
    steady = drawn.motion.steady
    row["multiplier"] = float(np.abs(steady.multipliers).max(initial=0.0))
    row["folds"] = [steady.curve[name].tolist() for name in ("folds", "fold_errors")]
    sine = make_sine(seed, frequency.value)
    row["brute"] = find_brute_amplitude(sine)
    # Several motions may coexist, of which one from rest need not be the largest
    if abs(row["brute"][0] / stated.value - 1) > COEXISTING_TOL:
        ends = [
            np.ptp(march_output(sine, N_STEPS // 4, start)[-1]) / 2
            for start in list_starts(sine, stated.value)
        ]
        nearest = int(np.argmin(np.abs(np.array(ends) - stated.value)))
        row["from_rest"] = row["brute"]
        row["brute"] = find_brute_amplitude(sine, list_starts(sine, stated.value)[nearest])
    row["brute_multiplier"] = measure_multiplier(sine)
    return row


def main(out: str, max_seconds: float = 1200.0) -> None:
    """Examine the rigs that a file does not have yet, until the CPU seconds are spent."""
    path = Path(out)
    rows = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    known = {row["seed"] for row in rows}

    def stop(*_):
        """End a rig that takes too long."""
        raise TimeoutError

    signal.signal(signal.SIGVTALRM, stop)
    for seed in range(FIRST_SEED, FIRST_SEED + N_RIGS):
        if seed in known:
            continue
        if process_time() > max_seconds:
            break
        signal.setitimer(signal.ITIMER_VIRTUAL, MAX_CPU_SECONDS)
        try:
            row = examine(seed)
        except (pf.PatchfemError, TimeoutError) as error:
            row = {"seed": seed, "message": f"{type(error).__name__}: {error}"}
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        with path.open("a") as file:
            file.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main(sys.argv[1], *map(float, sys.argv[2:]))
