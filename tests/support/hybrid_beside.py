"""A scene through the engine `hybrid` beside the engine that runs it today.

`python tests/support/hybrid_beside.py SCENE... key=value...` prints every measure of both with their errors, and the
CPU seconds.
"""

import sys
from time import process_time
from typing import NamedTuple

import numpy as np

import patchfem as pf
from patchfem.core import PatchfemError
from patchfem.effects import law_has_trait
from patchfem.hybrid import cases, runs
from patchfem.hybrid.laws import make_law


class Comparison(NamedTuple):
    """A measure by both engines with its errors."""

    name: str
    hybrid: float
    hybrid_error: float
    today: float
    today_error: float
    floor: float

    @property
    def excess(self) -> float:
        """Difference over the sum of both errors and the floor."""
        allowed = self.hybrid_error + self.today_error + self.floor
        return abs(self.hybrid - self.today) / max(allowed, 1e-300)


def make_case(model, rtol: float = cases.DEFAULT_RTOL, samples=()) -> cases.Case:
    """Return the case of a rig or bench that slips as a whole; PatchfemError for others."""
    has_spread = model.patch is not None and law_has_trait(model.friction.law, "averaged")
    if model.partial_slip or model.has_interface_patches or model.kind == "patch" or has_spread:
        raise PatchfemError("a patch in partial slip")
    load = None
    if model.patch is not None:
        if model.rig is not None and model.rig.friction.load_varies:
            raise PatchfemError("a patch whose pressure changes with the motion")
        load = cases.Load(model.nominal_load)
    if model.point is not None and (model.rig is None or not model.rig.friction.names):
        omega = 2 * np.pi * (model.point.frequency or 0.0)
        load = cases.Load(model.point.load, model.point.amplitude, omega, model.point.phase)
    if model.rig is not None:
        if any(interface.lateral for interface in model.rig.friction.interfaces):
            raise PatchfemError("an interface that slides in a plane")
        return cases.make_rig_case(
            model.rig, load, grooves=model.grooves, samples=samples, rtol=rtol
        )
    law = make_law(model.friction, load.mean, model.slide.peak_speed, varies=load.varies)
    return cases.make_bench_case(model.slide, law, load, samples=samples, rtol=rtol)


def run_beside(path, rtol: float = cases.DEFAULT_RTOL, **changes):
    """Run a scene by both engines.

    Returns
    -------
    comparisons : list of Comparison
    seconds : (float, float)
        CPU seconds of hybrid with errors and of today's run, each of a second run in one process.
    motion, result
    """
    model = pf.build(pf.load(path, **changes) if changes else pf.load(path))
    case = make_case(model, rtol)
    for _ in range(2):
        begin = process_time()
        motion = runs.run_case(case)
        hybrid_seconds = process_time() - begin
    for _ in range(2):
        begin = process_time()
        result = pf.run(path, **changes)
        today_seconds = process_time() - begin
    found = []
    for name, value in motion.values.items():
        measure = result.measures.get(name)
        if measure is None or measure.value is None or np.isnan(value):
            continue
        error = motion.errors.get(name, np.nan)
        found.append(
            Comparison(name, value, error, measure.value, measure.error or 0.0, measure.floor)
        )
    return found, (hybrid_seconds, today_seconds), motion, result


def main() -> None:
    """Print the comparison of the scenes of the command line."""
    arguments = sys.argv[1:]
    changes = dict(part.split("=", 1) for part in arguments if "=" in part)
    for path in (part for part in arguments if "=" not in part):
        found, seconds, motion, _ = run_beside(path, **changes)
        print(
            f"{path}: {motion.status.name}, {motion.n_steps} steps, {seconds[0]:.4f} s, today {seconds[1]:.4f} s"
        )
        for row in found:
            ours = f"{row.hybrid:.10g} +- {row.hybrid_error:.1e}"
            print(
                f"  {row.name:36} {ours}   {row.today:.10g} +- {row.today_error:.1e}  {row.excess:.2f}"
            )


if __name__ == "__main__":
    main()
