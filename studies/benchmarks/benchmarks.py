"""What does patchfem give for joints and dampers that others measured or computed and published?

Where both solve the same equations, the same numbers: NLvib's beam with dry friction to 1e-8, TMDSimPy's mass on
Iwan's law to 2e-6 of its finest runs. A plane model of the Brake-Reuss joint, with its measured gap, a friction of
0.03 and one fitted number, follows the frequency that Porter and Brake computed to 1.3 % from 181 down to 163 Hz, its
damping to factors of 0.68 and 1.43. One length gives the work of a cycle of the banded damper to 0.4 %, and no law
its backlash.

The fitted number is the slide of the joint per motion at the accelerometer, 0.0219 (0.0212 to 0.0225). Far faces are
held rigidly, so the halves bear at their ends alone, on 8 % of the length, where bolts bend the halves together; the
gap less its best parabola, which a bolt of 2 kN bends away, bears on 39 % and is 3.6 times as stiff. The loss grows
with the slide to the power 3.0 and 3.3; with the amplitude of the beam to 3.9 by Porter and Brake and to 3.7 in the
measurement of a longer beam, whose frequency changed less than it scattered from test to test (0.3 Hz). With Iwan's
law the fit of the same curve ends at chi = 0, where the power is 3, its highest.

Of others, read from the folder that PATCHFEM_DATA names and not part of this project:

- friction-damper-1hz.csv: the loop of a banded rotary damper (ARTS-Laboratory, Dataset-Friction-Damper-with-Backlash,
  dataset-1, 1 Hz, 20 lb tension; CC BY-SA 4.0); all laws beside it in `damper/damper.py`.
- brb_surface_data.mat: the gap of the interface of a Brake-Reuss beam before its bolts are tightened (TMDSimPy, commit
  17d5fc3f, examples/structures/data; MIT).
- nlvib-beam.mat: matrices of example 08 of NLvib, a clamped beam with dry friction (GPL 3).

- ForcedFrequencyResponses.mat: a longer Brake-Reuss beam on a shaker (M. Cenedese, BRBtesting, commit 2d42d3a; GPL 3;
  Chen et al., MSSP 166, 2022, 108401). It is read to check MEASURED alone.

Typed here, with their sources: BACKBONE, MEASURED and IWAN.

Run: PATCHFEM_DATA=FOLDER python studies/benchmarks/benchmarks.py [PICTURE.svg]
"""

import os
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.io import loadmat
from scipy.optimize import least_squares

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
sys.path.insert(0, str(Path(__file__).parents[1] / "damper"))

import damper

import patchfem as pf

DATA = {"loop": "friction-damper-1hz.csv", "gap": "brb_surface_data.mat", "beam": "nlvib-beam.mat"}
HELD = "ForcedFrequencyResponses.mat"
LOOP_LAWS = ("coulomb", "stretch")

# First bending mode of the Brake-Reuss beam with its measured gap, by 232 rough contact elements on a model of the
# whole beam (Porter and Brake, MSSP 192, 2023, 110210; numbers: TMDSimPy,
# examples/structures/results/brb_epmc_meso.yaml): amplitude at the accelerometer [m], frequency [Hz], damping ratio.
# Their modal mass there is 1.033 kg.
BACKBONE = np.array([
    (1.2716e-6, 180.5734, 1.0745e-3), (4.6547e-6, 180.0316, 3.0781e-3), (8.8497e-6, 178.6034, 8.3865e-3),
    (1.3781e-5, 176.2332, 1.6115e-2), (2.2928e-5, 172.2149, 2.4561e-2), (3.3164e-5, 168.9854, 2.9242e-2),
    (4.3087e-5, 166.3804, 3.3303e-2), (5.8046e-5, 163.1906, 3.7770e-2)])
STUCK = 180.6274, 8.7796e-4  # frequency [Hz] and damping ratio of their smallest amplitude

# A longer Brake-Reuss beam at eight held accelerations, as `held` reads them from HELD: amplitude [m], frequency [Hz]
# and damping ratio, each with the half-width of its 95 % interval, the points taken as independent.
MEASURED = np.array([
    (1.964e-5, 80.379, 0.007, 1.592e-3, 0.078e-3), (7.899e-5, 80.204, 0.008, 2.032e-3, 0.091e-3),
    (1.175e-4, 80.211, 0.009, 2.401e-3, 0.123e-3), (1.576e-4, 80.132, 0.013, 3.210e-3, 0.166e-3),
    (1.975e-4, 80.266, 0.016, 4.109e-3, 0.201e-3), (2.369e-4, 80.344, 0.023, 5.216e-3, 0.302e-3),
    (2.768e-4, 80.414, 0.023, 6.015e-3, 0.344e-3), (3.164e-4, 80.454, 0.025, 7.017e-3, 0.389e-3)])

# A mass on Iwan's law under 3.3 N (TMDSimPy's examples/sdof_iwan_hysteresis.py, run at commit 17d5fc3f): rad/s, half
# peak-to-peak [m] by its 8 harmonics, 100 sliders and 1024 samples, and by 41 (0.3 rad/s:
# 61), 400 and 4096 (from 0.35 rad/s on 25, 300 and 4096). At 0.3 rad/s four times as many sliders add 1.0e-5 m, four
# times as many samples take 1.1e-5 m.
IWAN = ((0.20, 4.33592568, 4.33598031), (0.25, 4.44509814, 4.44520849), (0.30, 5.74539470, 5.74568250),
        (0.35, 5.14910002, 5.14913549), (0.40, 5.39667882, 5.39670105))
IWAN_SCENE = {
    "normal": {"load": 1.0},
    "friction": {"law": "iwan", "static": 0.2, "stiffness": 0.25, "chi": -0.5, "beta": 0.0},
    "structure": {"moving_mass": 1.0, "mode": [{"name": "x", "frequency": np.sqrt(0.75) / (2 * np.pi),
                                                "damping": 0.01 / (2 * np.sqrt(0.75)), "slide": 1.0}]},
    "drive": {"kind": "force", "frequency": 0.05, "force": 3.3, "cycles": 20},
    "accuracy": {"method": "harmonic", "tolerance": 1e-4}}

# NLvib's example 08: rad/s and half peak-to-peak of the tip [m] by a balance written from the equations alone with
# NLvib's 7 harmonics and 128 samples (tests/structure/test_beam_of_nlvib.py; 31 and 1024 change the ninth digit).
NLVIB = ((110.0, 5.20918531e-7), (123.4, 1.75213558e-6), (200.0, 6.51239490e-8))
NLVIB_SCENE = {
    "structure": {"output_mass": 2, "interface": [{"between": [1, 0], "law": "tanh", "static": 1.0, "load": 1.5,
                                                   "reference_speed": 1e-6}]},
    "drive": {"kind": "force", "force": 0.2, "mass": 2, "frequency": 1.0, "cycles": 5},
    "accuracy": {"method": "harmonic"}}

# The joint as Porter and Brake describe it: 12.25 kN in each of three bolts, friction 0.03, halves 12.7 mm high; length
# times width is their area without the holes.
JOINT = {"length": 116e-3, "width": 25.2e-3, "height": 12.7e-3, "load": 36.75e3, "shear": {},
         "substrate": {"young": 192.31e9, "poisson": 0.3, "density": 7800.0}}
FRICTION = {"law": "coulomb", "static": 0.03}
SLIDES = np.geomspace(1e-7, 4e-7, 4)  # m, of the loops of the joint on a bench, those of 5 to 18 um of the beam
SLIDE = 0.0219  # of the joint per motion at the accelerometer, the one fitted number: 0.0212 to 0.0225 by
#                 patchfem fit --to BACKBONE.csv --free structure.mode.bending.slide=0.002..0.03


class Row(NamedTuple):
    """One number beside another: what; the numbers of others and of patchfem; the error that patchfem states, or the
    half-width of its interval, NaN where it states none; unit."""

    benchmark: str
    what: str
    theirs: float
    ours: float
    error: float
    unit: str


def files() -> dict:
    """{name: path} of the files of DATA that are there."""
    folder = os.environ.get("PATCHFEM_DATA")
    found = {name: Path(folder or ".") / file for name, file in DATA.items()}
    return {name: path for name, path in found.items() if folder and path.is_file()}


def gap(path) -> tuple:
    """(x (n,), gap (n,)) [m] of the measured interface, its mean over the width."""
    points = loadmat(path)["mesoscale_xygap"]
    points = points[np.isfinite(points).all(axis=1)]
    x, place = np.unique(np.round(points[:, 0], 5), return_inverse=True)
    z = np.bincount(place, points[:, 2]) / np.bincount(place)
    return x, z - z.min()


def joint(path, folder: Path, bent: bool = False) -> dict:
    """The table [contact] of the Brake-Reuss joint, its gap written into `folder`; bent: less its best parabola, which
    a bolt's bending takes; path None: flat."""
    if path is None:
        return JOINT
    x, z = gap(path)
    if bent:
        z = z - np.polyval(np.polyfit(x, z, 2), x)
    file = Path(folder) / f"gap_{'bent' if bent else 'measured'}.csv"
    np.savetxt(file, np.column_stack([x, z - z.min()]), "%.9g", ",", header="x [m],z [m]", comments="")
    return JOINT | {"profile": {"file": str(file)}}


def held(path) -> np.ndarray:
    """The rows of MEASURED: one mode through the 41 points of each held acceleration a, by least squares of the force
    F/a = m ((f0/f)^2 - 1 + 2 i zeta f0/f) in its complex value."""
    out = []
    for one in loadmat(path, squeeze_me=True, struct_as_record=False)["FRdata"].ResponseControl:
        f, force, a, phase = (np.asarray(getattr(one, name), float) for name in
                              ("frequency", "force", "amplitude", "phase"))
        turned = force / a * np.exp(1j * phase)

        def miss(values, f=f, turned=turned):
            m, f0, zeta = values * (1.0, 80.0, 1e-3)
            gap = (m * ((f0 / f)**2 - 1 + 2j * zeta * f0 / f) - turned) / np.abs(turned).max()
            return np.concatenate([gap.real, gap.imag])

        found = least_squares(miss, (1.0, 1.0, 2.0))
        spread = np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)) * 2 * found.cost / (2 * f.size - 3))
        f0, zeta = found.x[1] * 80.0, abs(found.x[2]) * 1e-3  # the sign of the phase is that of the file
        out.append((a.mean() / (2 * np.pi * 80.2)**2, f0, 2 * 80.0 * spread[1], zeta, 2e-3 * spread[2]))
    return np.array(out)


def damper_rows(path) -> tuple:
    """(rows, fits) of the banded damper: work of a cycle, and the values found with their intervals."""
    out, fits = [], damper.main(path, LOOP_LAWS)
    for row in fits:
        out.append(Row("banded damper", f"{row.law}: work of a cycle", row.measured, row.work, np.nan, "J"))
        for free, value, ends in zip(
                row.fitted.keys.ranges, row.fitted.keys.fit.values, row.fitted.keys.fit.intervals):
            half = float(np.ptp(ends)) / 2
            out.append(Row("banded damper", f"{row.law}: {free.key}", np.nan, value, half, free.unit))
    return out, fits


def joint_rows(path, folder: Path) -> tuple:
    """(rows, {name: result}) of the joint pressed flat, with its gap, and with its gap less a parabola."""
    out, seen = [], {}
    for name, file, bent in (("flat", None, False), ("gap as measured", path, False),
                             ("gap less a parabola", path, True)):
        contact = joint(file, folder, bent)
        pressed = seen[name] = pf.run({"contact": contact, "accuracy": {"tolerance": 1e-2}})
        for measure in ("contact_fraction", "pressure_peak", "normal_stiffness", "tangential_stiffness"):
            one = pressed.measures[measure]
            out.append(Row("Brake-Reuss joint", f"{name}: {measure}", np.nan, one.value, one.error, one.unit))
        if name != "flat":
            out.append(Row("Brake-Reuss joint", f"{name}: exponent of the loss", exponent(*BACKBONE[1:3, [0, 2]].T),
                           loss_exponent(contact), np.nan, "1"))
    return out, seen


def exponent(amplitude, damping, still: float = STUCK[1]) -> float:
    """Exponent of the loss per cycle between two amplitudes, from damping ratios less that of the structure."""
    loss = (np.asarray(damping) - still) * np.asarray(amplitude)**2
    return float(np.diff(np.log(loss))[0] / np.diff(np.log(amplitude))[0])


def loss_exponent(contact: dict) -> float:
    """Exponent of the loss over the slide of a joint on a bench, by least squares over SLIDES."""
    scene = {"contact": contact, "friction": FRICTION, "slide": {"kind": "sine", "frequency": 1.0, "cycles": 3,
             "amplitude": 1e-7}, "accuracy": {"tolerance": 1e-2}}
    lost = [pf.run(scene, **{"slide.amplitude": float(one)}).measures["loop_area"].value for one in SLIDES]
    return float(np.polyfit(np.log(SLIDES), np.log(lost), 1)[0])


def rig(contact: dict, slide: float = SLIDE) -> dict:
    """The scene of the first bending mode on the joint: frequency, damping and mass of Porter and Brake, bolted."""
    return {"contact": contact, "friction": FRICTION, "accuracy": {"tolerance": 1e-2},
            "structure": {"moving_mass": 1.033, "measured": "stuck", "mode": [
                {"name": "bending", "frequency": STUCK[0], "damping": STUCK[1], "slide": slide, "output": 1.0}]},
            "drive": {"kind": "force", "frequency": STUCK[0], "force": 1.0, "cycles": 10}}


def beam_curve(contact: dict, method: str = "quasi-static") -> np.ndarray:
    """Frequency [Hz], its error, damping ratio, its error (n, 4) of the joint's rig at the amplitudes of BACKBONE."""
    found, way = pf.backbone(rig(contact), amplitudes=BACKBONE[:, 0], method=method), method.replace("-", "_")
    return np.array([found[f"{way}_{name}"].values.ravel() for name in
                     ("frequency", "frequency_error", "damping", "damping_error")]).T


def beam_rows(curve) -> list:
    """Frequency and damping of the Brake-Reuss beam beside those of Porter and Brake."""
    return [row for (amplitude, f, zeta), ours in zip(BACKBONE, curve) for row in (
        Row("Brake-Reuss beam", f"frequency at {1e6 * amplitude:.3g} um", f, *ours[:2], "Hz"),
        Row("Brake-Reuss beam", f"damping at {1e6 * amplitude:.3g} um", zeta, *ours[2:], "1"))]


def iwan_rows(points=IWAN) -> list:
    """TMDSimPy's mass on Iwan's law."""
    out = []
    for omega, _, many in points:
        one = pf.run(IWAN_SCENE, **{"drive.frequency": omega / (2 * np.pi)}).measures["relative_displacement_amplitude"]
        out.append(Row("TMDSimPy, Iwan", f"amplitude at {omega} rad/s", many, one.value, one.error, "m"))
    return out


def nlvib_rows(path, points=NLVIB) -> list:
    """NLvib's clamped beam, example 08."""
    reduced, out = {"boundary": [5, 15], "modes": 14} | dict.fromkeys(("stiffness", "mass", "damping"), str(path)), []
    for omega, theirs in points:
        scene = NLVIB_SCENE | {"structure": NLVIB_SCENE["structure"] | {"reduced": reduced}}
        one = pf.run(scene, **{"drive.frequency": omega / (2 * np.pi),
                               "structure.interface[1].reference_speed": 6e-7 * omega}).measures
        one = one["relative_displacement_amplitude"]
        out.append(Row("NLvib, beam 08", f"tip at {omega} rad/s", theirs, one.value, one.error, "m"))
    return out


def main(folder: Path, picture: Path | None = None) -> list:
    """Rows of all benchmarks whose data are there; folder: where the gap is written for its scenes."""
    there, rows = files(), iwan_rows()
    if "beam" in there:
        rows += nlvib_rows(there["beam"])
    if "gap" in there:
        found, pressed = joint_rows(there["gap"], folder)
        curve = beam_curve(joint(there["gap"], folder))
        measured = exponent(*MEASURED[[3, 7]][:, [0, 3]].T, MEASURED[0, 3])
        rows += [*found, Row("Brake-Reuss beam", "exponent of the measured loss", measured, np.nan, np.nan, "1"),
                 *beam_rows(curve)]
    if "loop" in there:
        found, fits = damper_rows(there["loop"])
        rows += found
    if picture is not None and len(there) == len(DATA):
        draw(picture, there["gap"], pressed, curve, fits)
    return rows


def draw(path, file, pressed: dict, curve, fits: list) -> None:
    """The damper's loop, the joint's gap and pressure, frequency and damping of the beams."""
    from drawing import drawing

    with drawing(path, (9.6, 7.6), 2, 2) as (_, ((loop, joint_), (frequency, damping))):
        record = fits[0].fitted.loop
        loop.plot(record.displacement[:269:4] * 1e3, record.reading[:269:4] / 1e3, ".", ms=4, color="0.5",
                  label="measured (CC BY-SA 4.0)")
        for row in fits:
            loop.plot(record.displacement[:269:2] * 1e3, row.fitted.model[:269:2] / 1e3, lw=1,
                      label=f"{row.law}, fitted")
        loop.set(xlabel="slide [mm]", ylabel="force [kN]", title="Banded damper")
        x, z = gap(file)
        joint_.plot(x[::4] * 1e3, z[::4] * 1e6, color="0.5", label="measured gap [um]")
        for name in ("gap as measured", "gap less a parabola"):
            part = pressed[name].to_xarray()
            joint_.plot(part["x"].values * 1e3, part["normal_stress"].values[-1] / 1e6, lw=1,
                        label=f"pressure [MPa], {name}")
        joint_.set(xlabel="place along the joint [mm]", title="Brake-Reuss joint", ylim=(0, 290))
        um = BACKBONE[:, 0] * 1e6
        frequency.semilogx(um, BACKBONE[:, 1], "o", ms=4, color="0.5", label="Porter and Brake, computed")
        frequency.semilogx(um, curve[:, 0], ".-", lw=1.2, label="patchfem, slide fitted")
        damping.loglog(um, BACKBONE[:, 2], "o", ms=4, color="0.5", label="Porter and Brake, computed")
        damping.loglog(um, curve[:, 2], ".-", lw=1.2, label="patchfem, slide fitted")
        damping.loglog(MEASURED[:, 0] * 1e6, MEASURED[:, 3], "s", ms=4, label="measured, 80 Hz beam")
        for axes, what in ((frequency, "frequency [Hz]"), (damping, "damping ratio")):
            axes.set(xlabel="amplitude [um]", ylabel=what, title="Brake-Reuss beam")
            axes.set_xticks([1, 3, 10, 30, 100, 300][:4 if axes is frequency else 6], minor=False)
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_formatter("")
        for axes in (loop, joint_, frequency, damping):
            axes.legend(frameon=False)


if __name__ == "__main__":
    from tempfile import TemporaryDirectory

    missing = [file for name, file in DATA.items() if name not in files()]
    if missing:
        print(f"PATCHFEM_DATA names no folder with {', '.join(missing)}: these are left out", file=sys.stderr)
    with TemporaryDirectory() as place:
        for row in main(Path(place), Path(sys.argv[1]) if len(sys.argv) > 1 else None):
            beside = f"{row.theirs:.6g}" if np.isfinite(row.theirs) else "-"
            error = f" ± {row.error:.1e}" if np.isfinite(row.error) else ""
            print(f"{row.benchmark:18s} {row.what:45s} others {beside:12s} here {row.ours:.7g}{error} {row.unit}")
