"""Random benches of every friction law without a patch, against an integration of the law along the prescribed motion.

Campaign `point-benches` of `campaigns`. The reference integrates the rate equation of the law
(`motion_laws`) by DOP853 between events, and uses nothing of the package.
"""

from pathlib import Path
from time import process_time

import numpy as np
from campaigns import measure_rows
from motion_reference import Motion
from motion_scenes import draw_law_keys, draw_log_uniform, quantity, table, write_law_keys

import patchfem as pf

LAWS = (
    "coulomb",
    "weakening",
    "elastic-plastic",
    "iwan",
    "tanh",
    "bouc-wen",
    "lugre",
    "stretch",
    "growing",
    "report",
)
N_SAMPLES = 20000  # Samples of the last cycle at which the reference is evaluated.
# Relative error of measures taken from samples: a peak between two samples differs by less.
SAMPLING_DOUBT = 1e-6
SAMPLED = ("friction_force_peak", "secant_stiffness", "equivalent_stiffness")
# Relative tolerances of the two integrations, whose difference is the uncertainty.
TOLERANCES = (1e-11, 1e-12)


def draw_bench(seed: int) -> dict:
    """Draw the parameters of a bench in SI units; consecutive seeds have different laws."""
    r = np.random.default_rng(seed)
    law = LAWS[seed % len(LAWS)]
    load = draw_log_uniform(r, 20, 2000)
    frequency = draw_log_uniform(r, 1, 300)
    amplitude = draw_log_uniform(r, 1e-6, 1e-4)
    omega = 2 * np.pi * frequency
    numbers = {
        "law": law,
        "load": load,
        "frequency": frequency,
        "amplitude": amplitude,
        "cycles": int(r.integers(2, 5)),
        "tolerance": float(r.choice([1e-2, 1e-3, 1e-4])),
        # Keys that the independent program also needs: one mode, which the motion does not affect.
        "several": False,
        "patch": None,
        "drive": "sine",
        "mass": 1.0,
        "size": amplitude * omega**2,
        "seeded": omega,
        "modes": [
            {"frequency": frequency, "base": 1.0, "damping": 0.0, "slide": 1.0, "output": 1.0}
        ],
    }
    return numbers | draw_law_keys(r, law, load, amplitude, amplitude * omega)


def write_bench(bench: dict) -> str:
    """Return the scene of a bench as text."""
    slide = {
        "kind": '"sine"',
        "amplitude": quantity(bench["amplitude"], "m"),
        "frequency": quantity(bench["frequency"], "Hz"),
        "cycles": bench["cycles"],
    }
    return (
        table("normal", {"load": quantity(bench["load"], "N")})
        + table("friction", write_law_keys(bench))
        + table("slide", slide)
        + table("accuracy", {"tolerance": bench["tolerance"]})
    )


class PrescribedMotion(Motion):
    """Prescribed motion A sin(omega t) with a friction law whose force does not affect the motion."""

    def start(self):
        """Return the initial state."""
        y = super().start()
        y[1] = self.s["amplitude"] * self.s["seeded"]
        return y

    def forces(self, t, y, pull=None):
        """Return the friction force [N]."""
        law = self.laws[0]
        part = self.parts[0]
        return np.array([law.mode * law.kinetic if law.set_valued else law.force(y[part], y[1], t)])

    def slope(self, t, y):
        """Return the time derivative of the state."""
        law = self.laws[0]
        part = self.parts[0]
        out = np.empty_like(y)
        out[0] = y[1]
        out[1] = -self.s["size"] * np.sin(self.s["seeded"] * t)
        out[part] = law.rate(y[part], y[1], t)
        out[-1] = self.forces(t, y)[0] * y[1]
        return out

    def turn(self, t, y, k, g):
        """Apply an event; a set-valued law reverses its direction."""
        law = self.laws[0]
        if law.set_valued:
            law.mode = -law.mode
        else:
            super().turn(t, y, k, g)


def integrate_bench(bench: dict, rtol: float) -> dict:
    """Integrate a bench and return its measures by name."""
    motion = PrescribedMotion(bench)
    law = motion.laws[0]
    period = 1 / bench["frequency"]
    end = bench["cycles"] * period
    times = []
    forces = []
    displacements = []
    peak = 0.0
    works = {}
    for stretch in motion.run(end, rtol, start=None if law.set_valued else motion.start()[:-1]):
        law.mode, law.side = stretch.modes[0]
        if stretch.turns:
            law.turns = stretch.turns[0]
        begin = stretch.times[0]
        stop = stretch.times[-1]
        count = max(int(N_SAMPLES * (stop - begin) / period), 2)
        t = np.linspace(begin, stop, count)
        y = stretch.solution(t).T
        f = np.array([motion.forces(*pair)[0] for pair in zip(t, y)])
        peak = max(peak, np.abs(f).max())
        for moment in (end - period, end):
            if begin <= moment <= stop:
                works[moment] = float(stretch.solution(moment)[-1])
        last = t >= end - period * (1 + 1e-12)
        times.append(t[last])
        forces.append(f[last])
        displacements.append(y[last, 0])
    t, f, q = map(np.concatenate, (times, forces, displacements))
    turn = np.exp(-1j * bench["seeded"] * t)
    high = np.argmax(q)
    low = np.argmin(q)
    measures = {
        "loop_area": works[end] - works[end - period],
        "friction_work": works[end],
        "friction_force_peak": peak,
        "friction_ratio_end": f[-1] / bench["load"],
        "secant_stiffness": (f[high] - f[low]) / (q[high] - q[low]),
        "equivalent_stiffness": (np.trapezoid(f * turn, t) / np.trapezoid(q * turn, t)).real,
    }
    # At a reversal the force may have any value between the two friction limits.
    if law.set_valued:
        del measures["secant_stiffness"], measures["friction_force_peak"]
    return measures


def compare_bench(seed: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare a bench with its reference; see `campaigns`."""
    bench = draw_bench(seed)
    begin = process_time()
    try:
        result = pf.run(write_bench(bench))
    except pf.PatchfemError as error:
        return {"group": bench["law"], "rows": [], "refused": str(error)}
    line = {
        "group": bench["law"],
        "engine": "bench",
        "seconds": process_time() - begin,
        "warnings": list(result.warnings),
        "steps": result.extra.get("steps_per_cycle"),
    }
    if earlier and "true" in earlier:
        line |= {key: earlier[key] for key in ("true", "doubt")}
    else:
        first, second = (integrate_bench(bench, rtol) for rtol in TOLERANCES)
        line["true"] = second
        line["doubt"] = {
            name: abs(value - first[name]) + (name in SAMPLED) * SAMPLING_DOUBT * abs(value)
            for name, value in second.items()
        }
    return line | {"rows": measure_rows(result.measures, line["true"], line["doubt"])}
