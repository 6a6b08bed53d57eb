"""Random benches with [contact.shear] against a separate partial-slip solver.

Campaign `partial-slip` of `campaigns`. The benches are crowned, tilted or both, coated or not, with
amplitudes of 0.02 to 2 times the relative displacement at which the whole patch slips, at
tolerances of 1e-2 to 1e-4.

The solver shares nothing with patchfem: pressure and compliances are those of
`patch_of_order_four`. With the friction limits g = mu f of the nodes, the missing
shear r = g - t at the displacement q solves r >= 0, C r >= C g - q, r (C r - C g + q) = 0, and
Masing's rule gives the loop. The difference between the last two
grids is the uncertainty of the reference.
"""

from pathlib import Path
from time import process_time

import numpy as np
from campaigns import measure_rows
from patch_of_order_four import Pressed, press_levels, read_scene
from scipy.interpolate import PchipInterpolator
from static_scenes import BodySection, PatchScene, make_contact

import patchfem as pf
from patchfem.scene import format_scene as format_tables

MATERIALS = (("steel", 210e9, 0.3), ("titanium", 121e9, 0.32), ("aluminium", 70e9, 0.33))
COATING = 250e9, 0.24  # Young's modulus [Pa] and Poisson's ratio.


def solve_missing_shear(compliance, right) -> np.ndarray:
    """Solve f >= 0, compliance f >= right, f (compliance f - right) = 0 by an active-set method."""
    active = right > 0
    for _ in range(200):
        index = np.flatnonzero(active)
        force = np.zeros(right.size)
        force[index] = np.linalg.solve(compliance[np.ix_(index, index)], right[index])
        gap = compliance @ force - right
        following = np.where(active, force > 0, gap < -1e-14 * np.abs(right).max())
        if (following == active).all():
            return force
        active = following
    raise RuntimeError("active set cycles")


class RandomBench:
    """Random bench in SI units: bodies, shapes, friction law, amplitude and tolerance."""

    def __init__(self, seed):
        draw = np.random.default_rng(seed)
        self.kind = draw.choice(["crown", "tilt", "both"])
        self.length = draw.uniform(10e-3, 60e-3)
        self.width = draw.uniform(5e-3, 45e-3)
        self.height = draw.uniform(3e-3, 25e-3)
        self.load = 10 ** draw.uniform(1.5, 4)
        self.name, self.young, self.poisson = MATERIALS[draw.integers(3)]
        self.static = draw.uniform(0.1, 0.6)
        self.thick = draw.choice([0.0, 1.0], p=[0.6, 0.4])
        self.thick = float(self.thick * draw.uniform(50e-6, 400e-6))
        plane = self.young / (1 - self.poisson**2)
        reach = draw.uniform(0.15, 1.8) * self.length / 2  # Half-width of Hertzian contact.
        self.radius = reach**2 * np.pi * plane / 2 / (4 * self.load / self.width)
        opening = 2 * self.load * 2 * self.height / (plane * self.length * self.width) / self.length
        self.angle = 10 ** draw.uniform(-0.7, 1.5) * opening
        self.crowned, self.tilted = self.kind != "tilt", self.kind != "crown"
        if self.kind == "both":
            self.angle *= 0.3
        self.share = 10 ** draw.uniform(np.log10(0.02), np.log10(2))
        self.tolerance = draw.choice(["1e-2", "1e-3", "1e-3", "1e-4"])
        self.cycles = int(draw.integers(2, 4))
        self.amplitude = None

    @property
    def scene(self):
        """Patch for the reference."""
        base = (self.young, self.poisson)
        layers = (COATING if self.thick else base, base)
        piece = BodySection(self.length, self.height, self.thick, layers)
        curvature = 1 / self.radius if self.crowned else 0.0
        tilt = self.angle if self.tilted else 0.0
        return PatchScene(
            self.length, self.width, "strain", piece, piece, self.load, tilt, curvature
        )

    def text(self):
        """Return the text of the scene; the amplitude must have been set."""
        slide = {"kind": "sine", "amplitude": self.amplitude, "frequency": 10.0}
        tables = {"friction": {"law": "coulomb", "static": self.static}}
        tables["slide"] = slide | {"cycles": self.cycles}
        return format_tables({"contact": make_contact(self.scene) | {"shear": {}}} | tables)


class PartialSlipReference:
    """Solution of a bench whose patch is pressed."""

    def __init__(self, bench, pressed: Pressed):
        self.bench = bench
        index = np.flatnonzero(pressed.active)
        self.shear = pressed.tt[np.ix_(index, index)]
        self.limit = bench.static * pressed.force[index]
        self.stiffness = float(np.linalg.solve(self.shear, np.ones(index.size)).sum())

    def measures(self):
        """Return the measures by their names in patchfem."""
        bench = self.bench
        amplitude = self.bench.amplitude
        free = self.shear @ self.limit
        slides = amplitude * (np.arange(161) / 160) ** 2
        lack = np.array(
            [
                self.stiffness * q
                - self.limit.sum()
                + solve_missing_shear(self.shear, free - q).sum()
                for q in slides
            ]
        )
        lack[0] = 0.0
        curve = PchipInterpolator(slides, np.maximum(lack, 0.0))
        area = curve.antiderivative()

        def loop_area(a):
            """Return the area of the loop of an amplitude by Masing's rule."""
            return float(4 * a * curve(a) - 8 * area(a))

        force = self.stiffness * amplitude - float(curve(amplitude))
        stored = (
            float(-area(amplitude) - 4 * area(amplitude / 2) + amplitude * curve(amplitude))
            - loop_area(amplitude) / 4
            - loop_area(amplitude / 2) / 2
        )
        lost = (
            loop_area(amplitude) / 4
            + (bench.cycles - 0.5) * loop_area(amplitude)
            + loop_area(amplitude / 2) / 2
        )
        angle = (np.arange(4000) + 0.5) * np.pi / 4000
        return_force = curve(amplitude) - 2 * curve(amplitude * (1 - np.cos(angle)) / 2)
        end = float(curve(amplitude) - 2 * curve(amplitude / 2))
        return {
            "tangential_stiffness": self.stiffness,
            "loop_area": loop_area(amplitude),
            "slip_amplitude": loop_area(amplitude) / (4 * self.limit.sum()),
            "friction_force_peak": force,
            "secant_stiffness": force / amplitude,
            "energy_stored": stored,
            "energy_dissipated": lost,
            "friction_work": lost + stored,
            "friction_ratio_peak": force / bench.load,
            "friction_ratio_end": end / bench.load,
            "equivalent_stiffness": self.stiffness
            - float(2 / np.pi / amplitude * np.mean(return_force * np.cos(angle)) * np.pi),
        }


def solve_bench(seed: int) -> tuple:
    """Return a bench, its measures on the fine grid, and their differences from a coarser grid."""
    bench = RandomBench(seed)
    levels = press_levels(read_scene(make_contact(bench.scene)))
    coarse, fine = (PartialSlipReference(bench, pressed) for pressed in levels[1:])
    bench.amplitude = float(bench.share * bench.static * bench.load / fine.stiffness)
    values = fine.measures()
    coarse_values = coarse.measures()
    return bench, values, {name: abs(value - coarse_values[name]) for name, value in values.items()}


def compare_bench(seed: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare a bench with its reference; see `campaigns`."""
    if earlier and "true" in earlier:
        bench = RandomBench(seed)
        true = earlier["true"]
        doubt = earlier["doubt"]
        bench.amplitude = earlier["amplitude"]
    else:
        bench, true, doubt = solve_bench(seed)
    begin = process_time()
    result = pf.run(bench.text(), **{"accuracy.tolerance": float(bench.tolerance)})
    return {
        "group": bench.kind,
        "engine": "coated" if bench.thick else "bare",
        "seconds": process_time() - begin,
        "warnings": list(result.warnings),
        "true": true,
        "doubt": doubt,
        "amplitude": bench.amplitude,
        "rows": measure_rows(result.measures, true, doubt),
    }
