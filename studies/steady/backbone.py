"""Is the backbone of the axial mode, its frequency and damping over amplitude, that of the contact's loops on a bench?

With one harmonic it is, to the digits of the bench: omega^2 = omega_0^2 + K_eq/m and zeta = zeta_0 omega_0/omega + loop
area/(2 pi m omega^2 A^2) from sine loops on the bench (4000 steps) and the free balance differ by at most 2e-6 and 5e-6
for the elastic-plastic law, 2e-4 and 6e-5 for bonds, 4e-6 and 8e-6 for the patch of 41 elements, from the held joint
(1007, 1005 and 3219 Hz) to amplitudes a hundred times its length (149, 148 and 155 Hz).

With nine harmonics the motion is no sine any more, and a bench that moves as one does not know it: where the joint
damps most (ratios .80, .83 and 1.75 at amplitudes of 16, 16 and 5 um) frequencies differ by 13, 14 and 37 %, damping by
38, 38 and 150 %. A mode that is lost within a cycle has no backbone to speak of.

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

from patchfem.dynamics import LawGroup, find_free_motions, make_free_balance
from patchfem.model import build
from patchfem.runs import choose_numerics, solve_with_coarser
from patchfem.runs import run as runner
from patchfem.runs.rig.joints import make_single_law
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

    Contains frequency [Hz] and damping ratio [1] from the loops of the bench, and by harmonic
    balance of the free motion with one and with nine harmonics.
    """

    case: str
    amplitude: np.ndarray
    bench: tuple
    single: tuple
    many: tuple

    def miss(self, which: str) -> tuple:
        """Return the largest relative differences of frequency and damping from those of the bench.

        Damping is compared relative to what the contact adds, where that is larger.
        """
        pairs = zip(getattr(self, which), self.bench)
        return tuple(float(np.abs(found / truth - 1).max()) for found, truth in pairs)


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
    element = make_single_law(model, choose_numerics(model), patch)
    amplitude = size * np.asarray(shares)
    group = LawGroup(modes, element)
    free = []
    for harmonics in (1, 9):
        equations = make_free_balance(modes, group, 0, amplitude[-1], harmonics)
        motions = [found.motion for found in find_free_motions(equations, amplitude)]
        frequency = np.array([motion.omega for motion in motions]) / (2 * np.pi)
        free.append((frequency, np.array([motion.zeta for motion in motions])))
    w = modes.omega[0]
    zeta = modes.zeta[0]
    stiffness, area = np.array([loop(text, float(a), steps) for a in amplitude]).T
    omega = np.sqrt(w**2 + stiffness / modes.mass)
    damping = zeta * w / omega + area / (2 * np.pi * modes.mass * omega**2 * amplitude**2)
    return Row(name, amplitude, (omega / (2 * np.pi), damping), *free)


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
        for which in ("single", "many"):
            print(
                f"  {which:7} frequency off by {r.miss(which)[0]:.1e}, damping by {r.miss(which)[1]:.1e}"
            )
    if path is not None:
        steady_pictures.backbone(rows, path)
    return rows


if __name__ == "__main__":
    main()
