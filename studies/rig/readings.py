"""What does the printed law change on the rig, against its passive reading?

Over 20 cycles at 143 Hz and 5 g with a rigid slide the printed law holds the block tighter: amplitude 11.69 ± 0.06 um
against 14.69 ± 0.06 um, loop area 1.69 ± 0.01 mJ against 2.195 ± 0.008 mJ. At a reversal the printed direction u/|u|
flips bond by bond, which makes the interface stiffer than mu_s N/eps_0.

Run: python studies/rig/readings.py
"""

from pathlib import Path

from patchfem.runs import run as runner
from patchfem.scene import scene

HERE = Path(__file__).parent
NAMES = ("relative_displacement_amplitude", "absolute_acceleration_peak", "loop_area")


def main() -> dict:
    """reading -> {measure: (value, error)} after 20 cycles from rest, rigid slide."""
    out = {}
    for reading in ("report", "stretch"):
        found = runner.run(runner.plan(scene.load(HERE / "report.toml", [f"friction.reading={reading}"])))
        out[reading] = {name: (found.measures[name].value, found.measures[name].error) for name in NAMES}
        out[reading]["seconds"] = found.seconds["march"]
    for name in NAMES:
        print(f"{name:<34}" + "".join(f"{r}: {v[name][0]:.5g} ± {v[name][1]:.1g}   " for r, v in out.items()))
    print("seconds of the march              " + "".join(f"{r}: {v['seconds']:.3f}   " for r, v in out.items()))
    return out


if __name__ == "__main__":
    main()
