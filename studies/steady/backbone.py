"""Is the backbone of the axial mode, its frequency and damping over amplitude, that of the contact's loops on a bench?

For a held joint it is: omega^2 = omega_0^2 + K_eq/m and zeta = zeta_0 omega_0/omega + loop area/(2 pi m omega^2 A^2) from
sine loops on the bench differ from the free motion by at most 2e-4 and 7e-5 for the elastic-plastic law and for bonds at
amplitudes of 0.1 um (1007 and 1005 Hz).

Where the joint slips, the motion is no sine any more, and a bench that moves as one does not know it: at 10 um the
frequency of the elastic-plastic joint differs by 3 %, its damping by 18 %, and at 100 um by 3 and 9 %. Between 13 and 30
um the free motion does not oscillate, because its damping ratio is above 1; the bench has 0.8 there.

Run: python studies/steady/backbone.py
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import steady_pictures
from rig_texts import ONE_MODE, TEXTS
from study_run import run_study

from patchfem.event_driven.free_motions import FreeMotions
from patchfem.model import build
from patchfem.runs import choose_numerics, solve_with_coarser
from patchfem.runs import run as runner
from patchfem.runs.rig.joints import make_undriven_rig
from patchfem.scene import scene

FOLDER = Path(__file__).parent
# {name: (text of the scene, unit of the amplitudes [m])}
CASES = {
    "elastic-plastic": (TEXTS["elastic-plastic"], 1e-6),
    "bonds": (TEXTS["bonds"], 1e-6),
    "patch of 41 elements": (ONE_MODE, 3e-7),
}
SHARES = np.geomspace(0.1, 100, 16)


@dataclass(frozen=True, eq=False, slots=True)
class Row:
    """Case with amplitudes (k,) [m].

    Contains frequency [Hz] and damping ratio [1] from the loops of the bench, and of the free motion.
    """

    case: str
    amplitude: np.ndarray
    bench: tuple
    free: tuple

    def miss(self) -> np.ndarray:
        """Return the relative differences (2, k) of frequency and damping from those of the bench."""
        return np.abs(np.divide(self.free, self.bench) - 1)


def loop(text: str, amplitude: float, steps: int) -> tuple:
    """Return equivalent stiffness [N/m] and loop area [J] of a steady sine cycle of the interface on a bench.

    Parameters
    ----------
    text : str
        Scene.
    amplitude : float
        [m]
    steps : int
        Steps per cycle.
    """
    head = text[: text.index("[structure]")]
    bench = (
        f'{head}[slide]\nkind = "sine"\namplitude = "{amplitude!r} m"\nfrequency = "143 Hz"\ncycles = 8\n'
        f"[accuracy]\nsteps_per_cycle = {steps}\n"
    )
    found = runner.run(runner.plan(scene.loads(bench)), estimate=False).measures
    return found["equivalent_stiffness"].value, found["loop_area"].value


def case(name: str, shares=SHARES, steps: int = 4000) -> Row:
    """Return the row of one contact."""
    text, size = CASES[name]
    model = build(scene.loads(text))
    modes = model.rig.modes
    patch = (
        solve_with_coarser(model.patch, model.accuracy.tolerance, False)[0]
        if model.patch is not None
        else None
    )
    amplitude = size * np.asarray(shares)
    rig = make_undriven_rig(model, choose_numerics(model), patch)
    motions = FreeMotions(rig, 0).find(amplitude)
    free = np.full((2, amplitude.size), np.nan)
    for k, motion in enumerate(motions):
        if motion is not None:
            free[:, k] = motion.omega / (2 * np.pi), motion.zeta
    w = modes.omega[0]
    zeta = modes.zeta[0]
    stiffness, area = np.array([loop(text, float(a), steps) for a in amplitude]).T
    omega = np.sqrt(w**2 + stiffness / modes.mass)
    damping = zeta * w / omega + area / (2 * np.pi * modes.mass * omega**2 * amplitude**2)
    return Row(name, amplitude, (omega / (2 * np.pi), damping), tuple(free))


def main(names=tuple(CASES), path: Path | None = FOLDER / "backbone.svg", **how) -> list:
    """Print, draw and return the rows."""
    rows = [case(name, **how) for name in names]
    for r in rows:
        top = int(r.bench[1].argmax())
        print(
            f"{r.case}: {r.bench[0][0]:.2f} Hz held, {r.bench[0][-1]:.2f} Hz at {1e6 * r.amplitude[-1]:.3g} um; "
            f"damping {r.bench[1][0]:.5f}, most {r.bench[1][top]:.3f} at {1e6 * r.amplitude[top]:.3g} um, last "
            f"{r.bench[1][-1]:.4f}"
        )
        for name, miss in zip(("frequency", "damping"), r.miss()):
            print(f"  {name} off by {miss[0]:.1e} to {np.nanmax(miss):.1e}, last {miss[-1]:.1e}")
    if path is not None:
        steady_pictures.backbone(rows, path)
    return rows


if __name__ == "__main__":
    run_study(main)
