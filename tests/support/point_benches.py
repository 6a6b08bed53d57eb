"""Random benches of every friction law without a patch, against an integration of the law along the prescribed motion.

Campaign `point-benches` of `campaigns`. The reference integrates the rate equation of the law
(`motion_laws`) by DOP853 between events, and uses nothing of the package.
"""

from pathlib import Path
from time import process_time

import numpy as np
from campaigns import measure_rows
from motion_reference import Motion
from motion_scenes import (
    draw_law_keys,
    draw_log_uniform,
    format_law_keys,
    format_quantity,
    format_table,
)

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


def format_scene(bench: dict) -> str:
    """Return the scene of a bench as text."""
    slide = {
        "kind": '"sine"',
        "amplitude": format_quantity(bench["amplitude"], "m"),
        "frequency": format_quantity(bench["frequency"], "Hz"),
        "cycles": bench["cycles"],
    }
    return (
        format_table("normal", {"load": format_quantity(bench["load"], "N")})
        + format_table("friction", format_law_keys(bench))
        + format_table("slide", slide)
        + format_table("accuracy", {"tolerance": bench["tolerance"]})
    )


class PrescribedMotion(Motion):
    """Prescribed motion A sin(omega t) with a friction law whose force does not affect the motion."""

    def start(self):
        """Return the initial state."""
        y = super().start()
        y[1] = self.s["amplitude"] * self.s["seeded"]
        return y

    def friction_forces(self, t, y, pull=None):
        """Return the friction force [N]."""
        law = self.laws[0]
        part = self.parts[0]
        return np.array([law.mode * law.kinetic if law.set_valued else law.force(y[part], y[1], t)])

    def derivative(self, t, y):
        """Return the time derivative of the state."""
        law = self.laws[0]
        part = self.parts[0]
        out = np.empty_like(y)
        out[0] = y[1]
        out[1] = -self.s["size"] * np.sin(self.s["seeded"] * t)
        out[part] = law.rate(y[part], y[1], t)
        out[-1] = self.friction_forces(t, y)[0] * y[1]
        return out

    def apply_event(self, t, y, k, g):
        """Apply an event; a set-valued law reverses its direction."""
        law = self.laws[0]
        if law.set_valued:
            law.mode = -law.mode
        else:
            super().apply_event(t, y, k, g)


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
    for piece in motion.run(end, rtol, start=None if law.set_valued else motion.start()[:-1]):
        law.mode, law.side = piece.modes[0]
        law.turns = piece.turns[0]
        begin = piece.times[0]
        stop = piece.times[-1]
        count = max(int(N_SAMPLES * (stop - begin) / period), 2)
        t = np.linspace(begin, stop, count)
        y = piece.solution(t).T
        f = np.array([motion.friction_forces(*pair)[0] for pair in zip(t, y)])
        peak = max(peak, np.abs(f).max())
        for moment in (end - period, end):
            if begin <= moment <= stop:
                works[moment] = float(piece.solution(moment)[-1])
        last = t >= end - period * (1 + 1e-12)
        times.append(t[last])
        forces.append(f[last])
        displacements.append(y[last, 0])
    t, f, q = map(np.concatenate, (times, forces, displacements))
    phase = np.exp(-1j * bench["seeded"] * t)
    high = np.argmax(q)
    low = np.argmin(q)
    measures = {
        "loop_area": works[end] - works[end - period],
        "friction_work": works[end],
        "friction_force_peak": peak,
        "friction_ratio_end": f[-1] / bench["load"],
        "secant_stiffness": (f[high] - f[low]) / (q[high] - q[low]),
        "equivalent_stiffness": (np.trapezoid(f * phase, t) / np.trapezoid(q * phase, t)).real,
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
        result = pf.run(format_scene(bench))
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
