"""What does a structure of 1e5 unknowns cost once it is reduced, and do its bars hold what all of it would say?

35 to 50 CPU s and 2.3 (lap joint) to 2.9 GB (three blades) for the first run, the other side's memory included, then
0.1 to 11 CPU s a run. All 30 bars hold: amplitudes and works above NOTHING of 4 cases a model, 12 modes (seed 11;
errors and bars as shares of the value):

| model, method | unknowns | bars that hold | median error | largest | median bar | first run [CPU s] |
|---|---|---|---|---|---|---|
| lap joint, craig-bampton | 97950 | 8 of 8 | 4e-5 | 5e-4 | 1.3e-4 | 41 |
| lap joint, free-interface | 97950 | 8 of 8 | 1e-6 | 1.5e-4 | 2.2e-5 | 35 |
| three blades, craig-bampton | 118797 | 7 of 7 | 1.1e-2 | 7e-2 | 3.2e-2 | 47 |
| three blades, free-interface | 118797 | 7 of 7 | 1.9e-3 | 7e-2 | 6.8e-3 | 50 |

The largest error, 7 %, is that of the work of the blades' second interface in one case; its bar is 19 %. A bar is 2.7
to 3 times the error in the median, 8 times for the lap joint by free-interface modes. The other side takes 48 and
49 CPU s for one factor and 200 or 240 solutions; its own error is at most 2.2e-4, in the median 5e-6.

The other side is all unknowns, without patchfem: dynamic stiffness K + i k w C - (k w)^2 M condensed to the places that
rub, are pushed and watched, for odd harmonics up to TOP; the forces of elements that stretch and slip over a cycle;
Newton. The solutions of K + s M, which is the same for C = a M + b K, come from one SuperLU factor of K and a Krylov
space of K^-1 M; what their residuals come to is printed.

Run: python studies/substructures/large.py [seed] ["lap joint"] ["three blades"] [--small]
"""

import resource
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh
from scipy.sparse.linalg import splu

sys.path.insert(0, str(Path(__file__).parent))
import models

import patchfem as pf

TOP = 41  # highest harmonic
FINE = 100001  # samples of half a period from which the largest displacement is read
BLOCKS = 40  # of the Krylov space
# m, J, J
NOTHING = {
    "relative_displacement_amplitude": 0.0,
    "loop_area": 1e-12,
    "loop_area_2": 1e-12,
}
MODES = 12
CASES = 4
SCENE = """\
[structure]
output_mass = {watched}
[structure.reduced]
stiffness = "k.npz"
mass = "m.npz"
damping = "c.npz"
boundary = {boundary}
modes = {modes}
method = "{method}"
{interfaces}[drive]
kind = "force"
force = "{force!r} N"
mass = {pushed}
frequency = "{frequency!r} Hz"
cycles = 5
[accuracy]
method = "harmonic"
"""
INTERFACE = """\
[[structure.interface]]
between = [{between[0]}, {between[1]}]
law = "elastic-plastic"
static = 0.5
load = "{load!r} N"
bond_length = "{stretch!r} m"
"""
# pads that rub in pairs, where the force acts, what is watched, fine and coarse cells
STRUCTURES = {
    "lap joint": (
        models.lap_joint,
        (("lower 1", "upper 1"), ("lower 2", "upper 2")),
        "tip",
        "tip",
        8,
        2,
    ),
    "three blades": (
        models.three_blades,
        (("right 1", "left 2"), ("right 2", "left 3")),
        "tip 1",
        "tip 2",
        6,
        2,
    ),
}


class Whole:
    """Receptances of all unknowns at rows (b,) of a model."""

    def __init__(self, model, rows, blocks: int = BLOCKS):
        K, M = model.stiffness, model.mass
        loads = np.zeros((K.shape[0], len(rows)))
        loads[rows, range(len(rows))] = 1.0
        factor = splu(K.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        space, new = [], factor.solve(loads)
        for _ in range(blocks):
            for _ in range(2):
                for one in space:
                    new -= one @ (one.T @ (M @ new))
            square, turn = eigh(new.T @ (M @ new))
            new = new @ (turn / np.sqrt(square))
            space.append(new)
            new = factor.solve(M @ new)
        self.model, self.loads, self.rows, self.space = (
            model,
            loads,
            np.asarray(rows),
            np.hstack(space),
        )
        self.stiffness = self.space.T @ (K @ self.space)
        self.frequencies = np.sqrt(eigh(self.stiffness, eigvals_only=True)) / (2 * np.pi)

    def at(self, omega: float, share: float = 1.0) -> tuple:
        """(receptance (b, b) [m/N], largest residual of the equations over the load) by the first vectors of the space,
        a share of them."""
        scale, s = 1 + 1j * omega * models.BETA, 1j * omega * models.ALPHA - omega**2
        count = round(share * len(self.stiffness))
        space, own = (
            self.space[:, :count],
            scale * self.stiffness[:count, :count] + s * np.eye(count),
        )
        found = space @ np.linalg.solve(own, space.T @ self.loads)
        rest = self.loads - scale * (self.model.stiffness @ found) - s * (self.model.mass @ found)
        return found[self.rows], float(np.linalg.norm(rest, axis=0).max())


def friction(slide, stiffness, limit) -> np.ndarray:
    """Force (m, c, t) of elements (c,) that stretch and slip along periodic slides (m, c, t), in the second cycle."""
    force, stretch, last = np.zeros_like(slide), np.zeros(slide.shape[:-1]), slide[..., -1] * 0
    for k in (*range(slide.shape[-1]), *range(slide.shape[-1])):
        stretch = np.clip(stretch + stiffness * (slide[..., k] - last), -limit, limit)
        last = slide[..., k]
        force[..., k] = stretch
    return force


def balanced(receptances, omega: float, force: float, stiffness, limit, samples: int) -> dict:
    """Measures of the steady motion in odd harmonics, receptances (h, b, b) of them at c slides, pushed and watched."""
    c, odd = len(limit), np.arange(1, 2 * len(receptances), 2)
    wave = np.exp(1j * np.outer(odd, 2 * np.pi * np.arange(samples) / samples))
    free = np.zeros((len(odd), c + 2), complex)
    free[0] = receptances[0][:, c] * force

    def friction_of(x):
        """Harmonics (m, h, c) of the friction of those x (m, h, c) of the slides."""
        rub = friction(np.einsum("mhc,ht->mct", x, wave).real, stiffness, limit)
        return np.einsum("mct,ht->mhc", rub, wave.conj()) * 2 / samples

    def residual(flat):
        x = flat[:, : flat.shape[1] // 2] + 1j * flat[:, flat.shape[1] // 2 :]
        x = x.reshape(len(flat), len(odd), c) * size
        rest = (
            x - free[:, :c] + np.einsum("hbc,mhc->mhb", receptances[:, :c, :c], friction_of(x))
        ) / size
        rest = rest.reshape(len(flat), -1)
        return np.hstack([rest.real, rest.imag])

    size = np.abs(free[0, :c]).max()
    held = np.linalg.solve(np.eye(c) + receptances[0][:c, :c] * stiffness, free[0, :c])
    begin = free[:, :c].copy()
    begin[0] = held
    flat = np.concatenate([begin.real.ravel(), begin.imag.ravel()])[None] / size
    for _ in range(60):
        step = 1e-7
        both = residual(np.vstack([flat, flat + step * np.eye(flat.size)]))
        move = -np.linalg.solve((both[1:] - both[0]).T / step, both[0])
        for share in 0.5 ** np.arange(8):
            new = flat + share * move
            if (
                np.linalg.norm(residual(new)) <= (1 - 0.1 * share) * np.linalg.norm(both[0])
                or share < 0.01
            ):
                break
        flat = new
        if np.abs(share * move).max() < 1e-9:
            break
    else:
        raise ArithmeticError("no balance of all unknowns")
    x = (flat[0, : flat.size // 2] + 1j * flat[0, flat.size // 2 :]).reshape(len(odd), c) * size
    forces = friction_of(x[None])
    watched = free[:, c + 1] - np.einsum("hc,hc->h", receptances[:, c + 1, :c], forces[0])
    fine = np.exp(1j * np.outer(odd, np.linspace(0, np.pi, FINE)))
    area = np.pi * np.abs(np.imag(odd @ (forces[0] * x.conj())))
    return {
        "relative_displacement_amplitude": np.abs((watched @ fine).real).max(),
        "loop_area": area[0],
        "loop_area_2": area[1],
    }


def rows_of(model, pairs, pushed: str, watched: str) -> tuple:
    """(rows of the boundary, of pads then of the other places; combinations (b, c + 2) of slides, pushed, watched)."""
    names = [*(name for pair in pairs for name in pair), pushed]
    names += [watched] if watched != pushed else []
    turn = np.zeros((len(names), len(pairs) + 2))
    for k, pair in enumerate(pairs):
        turn[names.index(pair[0]), k], turn[names.index(pair[1]), k] = 1.0, -1.0
    turn[names.index(pushed), -2] = turn[names.index(watched), -1] = 1.0
    return [model.places[name] for name in names], turn


def drawn(rng, low: float, high: float) -> tuple:
    """(frequency [Hz], force [N], loads [N], stretches [m]) of a random case."""
    frequency = float(rng.uniform(0.8, 1.3) * rng.choice([low, high]))
    return (
        frequency,
        float(10 ** rng.uniform(0, 1.5)),
        10 ** rng.uniform(0.5, 2, 2),
        10 ** rng.uniform(-6.5, -5.5, 2),
    )


class Effort(NamedTuple):
    """Effort of the reference: the highest harmonic, and the samples of a cycle of friction."""

    harmonics: int = TOP
    samples: int = 4096


FULL_EFFORT = Effort()


def compare(
    name: str,
    seed: int,
    small: bool,
    cases: int = CASES,
    methods=("craig-bampton", "free-interface"),
    effort: Effort = FULL_EFFORT,
) -> list:
    """Rows (method, measure, value of all unknowns, its own error, value of the reduced, its bar) of random cases,
    printed. The own error: a third of what half the harmonics and samples and 3/4 of the space change."""
    make, pairs, pushed, watched, fine, coarse = STRUCTURES[name]
    begin = process_time()
    model = make(coarse if small else fine)
    rows, turn = rows_of(model, pairs, pushed, watched)
    print(
        f"{name}: {model.stiffness.shape[0]} unknowns, {model.stiffness.nnz} entries, made in "
        f"{process_time() - begin:.1f} CPU s"
    )
    begin = process_time()
    whole = Whole(model, rows)
    print(
        f"  all unknowns: one factor and {whole.space.shape[1]} solutions in {process_time() - begin:.1f} CPU s; "
        f"lowest frequencies {', '.join(f'{one:.2f}' for one in whole.frequencies[:4])} Hz"
    )
    rng, out, worst = np.random.default_rng(seed), [], 0.0
    draws = [drawn(rng, *whole.frequencies[:2]) for _ in range(cases)]
    truth = []
    for frequency, force, loads, stretches in draws:
        omega = 2 * np.pi * frequency
        found = [whole.at(k * omega) for k in range(1, effort.harmonics + 1, 2)]
        worst = max(worst, *(rest for _, rest in found))
        receptances = np.array([turn.T @ one @ turn for one, _ in found])
        given = omega, force, 0.5 * loads / stretches, 0.5 * loads
        fewer = np.array(
            [
                turn.T @ whole.at(k * omega, 0.75)[0] @ turn
                for k in range(1, effort.harmonics // 2 + 1, 2)
            ]
        )
        true = balanced(receptances, *given, effort.samples)
        rough = balanced(fewer, *given, effort.samples // 2)
        truth.append({key: (one, abs(one - rough[key]) / 3) for key, one in true.items()})
    print(
        f"  residuals of all unknowns at most {worst:.1e} of the load up to harmonic {effort.harmonics}"
    )
    with TemporaryDirectory() as folder:
        model.write(Path(folder))
        for method in methods:
            for case, (draw, true) in enumerate(zip(draws, truth)):
                frequency, force, loads, stretches = draw
                text = SCENE.format(
                    boundary=[row + 1 for row in rows],
                    modes=MODES,
                    method=method,
                    force=force,
                    frequency=frequency,
                    pushed=2 * len(pairs) + 1,
                    watched=2 * len(pairs) + (watched != pushed) + 1,
                    interfaces="".join(
                        INTERFACE.format(
                            between=(2 * k + 1, 2 * k + 2),
                            load=float(loads[k]),
                            stretch=float(stretches[k]),
                        )
                        for k in range(len(pairs))
                    ),
                )
                (Path(folder) / "scene.toml").write_text(text)
                begin = process_time()
                found = pf.run(Path(folder) / "scene.toml")
                seconds = process_time() - begin
                new = [
                    (method, key, *true[key], one.value, one.error)
                    for key in true
                    if (one := found.measures.get(key)) is not None and true[key][0] > NOTHING[key]
                ]
                print(
                    f"  {method}, case {case + 1}: {seconds:.2f} CPU s, {peak():.0f} MB at most so far; {held(new)}"
                )
                for _, key, value, own, ours, bar in new:
                    print(f"    {key} {value:.10e} +- {own:.1e}, reduced {ours:.10e} +- {bar:.1e}")
                out += new
            print(f"  {method}: {held([one for one in out if one[0] == method])}")
    return out


def peak() -> float:
    """Most memory of this process so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def held(rows: list) -> str:
    """How many bars hold the answer of the whole, and how wide they are."""
    own = [(abs(true - value), error, true, rough) for *_, true, rough, value, error in rows]
    inside = sum(gap <= error + rough for gap, error, _, rough in own)
    sharp = np.median([error / max(gap, 1e-300) for gap, error, *_ in own])
    off, wide = (np.median([one[k] / one[2] for one in own]) for k in (0, 1))
    return (
        f"{inside} of {len(own)} bars hold all unknowns; median error {off:.1e}, median bar {wide:.1e} of the "
        f"value, {sharp:.1f} times the error; the other side's own error "
        f"{np.median([one[3] / one[2] for one in own]):.0e}"
    )


def main() -> dict:
    """name -> rows of the comparison."""
    sys.stdout.reconfigure(line_buffering=True)
    numbers = [int(one) for one in sys.argv[1:] if one.isdigit()]
    asked = [name for name in STRUCTURES if name in sys.argv] or STRUCTURES
    return {name: compare(name, *(numbers or [1]), "--small" in sys.argv) for name in asked}


if __name__ == "__main__":
    main()
