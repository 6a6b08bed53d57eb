"""The free decay of a run, exported and imported as a measurement, agrees with the decay curve of the run."""

import numpy as np
import pytest
from command_line import run_successfully

from patchfem.measures import DecayCurve

MODE = """\
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "axial"
frequency = "100 Hz"
damping = 0.002
slide = 1.0
"""
MASSES = """\
[structure]
masses = ["0.6 kg", "0.4 kg"]
start.displacement = ["298 um", "300 um"]
output_mass = 2
[[structure.spring]]
between = [1, 2]
stiffness = "40 N/um"
[[structure.spring]]
between = [1, 0]
stiffness = "0.6 N/um"
[[structure.damper]]
between = [1, 2]
coefficient = "800 N s/m"
[[structure.interface]]
between = [1, 0]
law = "elastic-plastic"
static = 0.3
stiffness = "0.2 N/um"
load = "40 N"
"""
LOAD = '[normal]\nload = "20 N"\n'
IWAN = (
    MODE
    + LOAD
    + '[friction]\nlaw = "iwan"\nstatic = 0.3\nstiffness = "0.2 N/um"\nchi = -0.4\nbeta = 0.5\n'
)
RELEASED = '[drive]\nkind = "free"\ndisplacement = "300 um"\ncycles = 40\n'
CASES = {
    "exact": IWAN,
    "masses": MASSES,
}


@pytest.fixture(scope="module")
def decay_folders(tmp_path_factory):
    """Return a function from a name of CASES to its results folder; each case runs once."""
    folder = tmp_path_factory.mktemp("decays")
    folders = {}

    def run_case(name):
        """Return the results folder of a case, which is run at its first use."""
        if name not in folders:
            text = CASES[name]
            drive = (
                RELEASED.replace('displacement = "300 um"\n', "") if "start" in text else RELEASED
            )
            (folder / f"{name}.toml").write_text(text + drive, "utf-8")
            folders[name] = folder / name
            run_successfully("run", folder / f"{name}.toml", "-o", folders[name], "--no-page")
        return folders[name]

    return run_case


def read_decay_curve(folder) -> DecayCurve:
    """Return the decay curve that a results folder contains."""
    import xarray as xr

    with xr.open_dataset(folder / "result.nc") as data:
        names = DecayCurve.__annotations__
        return DecayCurve(**{name: data[f"decay_{name}"].values for name in names})


@pytest.mark.parametrize("name, ending", [("exact", "csv"), ("masses", "uff")])
def test_exact_imported_decay_agrees_with_run(decay_folders, tmp_path, name, ending):
    """The decay imported from exported histories agrees with that of the run in frequency and damping.

    At least 95 % of the amplitudes agree within the sum of both errors, and all within twice this
    sum.
    """
    folder = decay_folders(name)
    run_successfully("export", folder, "-o", tmp_path / f"run.{ending}", "--histories")
    run_successfully("import", tmp_path / f"run.{ending}", "--decay", "-o", tmp_path / "decay.csv")
    imported = DecayCurve(*np.loadtxt(tmp_path / "decay.csv", delimiter=",", skiprows=1).T)
    curve = read_decay_curve(folder)
    inside = np.isfinite(curve.interpolate("frequency", imported.amplitude))
    assert inside.sum() > 10 and imported.amplitude[inside].max() > 0.7 * 300e-6
    for name, largest in (("frequency", 5e-3), ("damping", 0.25)):
        value, error = (getattr(imported, column) for column in (name, f"{name}_error"))
        allowed = error + curve.interpolate(f"{name}_error", imported.amplitude)
        ratio = np.abs(value - curve.interpolate(name, imported.amplitude)) / allowed
        assert np.mean(ratio[inside] <= 1) >= 0.95 and ratio[inside].max() < 2
        assert np.median(error / np.abs(value)) < largest
