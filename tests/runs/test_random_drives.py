"""Random drives from the scene to the result: the motion against scipy's, energies under friction, refusals."""

import numpy as np
import pytest
from scipy.signal import lsim, lti

import patchfem as pf

MODE = {"name": "axial", "frequency": 100.0, "damping": 0.02, "slide": 1.0}
RIG = {
    "structure": {"moving_mass": 0.9, "mode": [MODE]},
    "drive": {
        "kind": "base",
        "waveform": "random",
        "spectrum": "0.01 g^2/Hz",
        "from": "20 Hz",
        "to": "300 Hz",
        "duration": "3 s",
    },
}
PLASTIC = {
    "normal": {"load": "100 N"},
    "friction": {"law": "elastic-plastic", "static": 0.3, "bond_length": "50 um"},
}
SHAKEN = (
    "relative_displacement_rms",
    "absolute_acceleration_rms",
    "response_frequency",
    "response_damping",
)


def test_exact_the_motion_is_that_of_its_record():
    """The same record through scipy's linear filter gives the motion, its root mean square and its spectrum."""
    result = pf.run(RIG)
    drive = result.plan.model.rig.drive.signal
    omega = 2 * np.pi * 100
    zeta = 0.02
    _, place, _ = lsim(
        lti([[0, 1], [-(omega**2), -2 * zeta * omega]], [[0], [-1]], [[1, 0]], [[0]]),
        drive.value,
        drive.time,
        interp=True,
    )
    first = result.window.time[0]
    # three decay times, up to a cycle less
    assert first == pytest.approx(3 / (zeta * omega), abs=0.011)
    steps = result.response.time / drive.time[1]
    at_rows = np.abs(steps - np.round(steps)) < 1e-6
    true = np.interp(result.response.time, drive.time, place)
    assert np.abs(result.response.output - true)[at_rows].max() < 1e-9 * np.abs(place).max()
    found = {name: result.measures[name] for name in SHAKEN}
    assert found["relative_displacement_rms"].value == pytest.approx(
        place[drive.time >= first].std(), rel=2e-3
    )
    assert (
        abs(found["response_frequency"].value - 100)
        < 2 * result.measures["response_frequency_scatter"].value
    )
    assert all(one.error is not None for one in found.values()) and result.outcome == "done"
    data = result.to_xarray()
    assert data["absolute_acceleration_spectrum"].attrs["units"] == "m2 s-3"
    power = data["relative_displacement_spectrum"]
    assert np.sqrt(power.sum() * power.frequency[0]) == pytest.approx(
        found["relative_displacement_rms"].value, rel=0.1
    )


def test_exact_energies_balance_under_elastic_plastic_friction():
    result = pf.run(RIG | PLASTIC)
    m = result.measures
    assert m["energy_balance"].value < 1e-11 and m["work_check"].value < 1e-9
    ledger = result.to_xarray()[["friction_work", "energy_dissipated", "energy_stored"]].isel(
        time=-1
    )
    assert float(ledger.friction_work) == pytest.approx(
        float(ledger.energy_dissipated + ledger.energy_stored), 1e-9
    )
    assert m["friction_work"].value == pytest.approx(float(ledger.friction_work), rel=1e-9)
    # stuck 164.2 Hz
    assert 100 < m["response_frequency"].value < 165 and m["response_damping"].value > 0.02
    stuck = pf.run(
        RIG | PLASTIC | {"friction": {"law": "coulomb", "static": 0.9}}, **{"normal.load": "900 N"}
    )
    assert stuck.outcome == "stuck" and stuck.measures["response_damping"].reason.startswith(
        "the frequency response (H1) has no peak"
    )


def test_each_seed_gives_its_own_reproducible_record():
    first, again, other = (
        pf.run(RIG, **{"drive.seed": seed, "drive.duration": "1 s"}).measures for seed in (1, 1, 2)
    )
    assert first["relative_displacement_rms"].value == again["relative_displacement_rms"].value
    assert first["relative_displacement_rms"].value != other["relative_displacement_rms"].value
    swept = pf.sweep(RIG, {"drive.seed": [1, 2], "drive.duration": ["1 s"]})
    assert swept["relative_displacement_rms"].values.ravel() == pytest.approx(
        [one["relative_displacement_rms"].value for one in (first, other)], rel=1e-12
    )


def test_exact_a_table_of_one_level_is_the_spectrum_of_that_level(tmp_path):
    path = tmp_path / "spectrum.csv"
    path.write_text("frequency [Hz],level [g^2/Hz]\n10,0.01\n0.4e3,0.01\n", "utf-8")
    drive = {name: one for name, one in RIG["drive"].items() if name != "spectrum"} | {
        "file": str(path)
    }
    one, other = (
        pf.build(RIG | {"drive": each}).rig.drive.signal for each in (RIG["drive"], drive)
    )
    assert other.value == pytest.approx(one.value, rel=1e-9) and other.band == one.band
    for text, said in (
        ("frequency [Hz],level [g^2/Hz]\n10,0.01\n5,0.01\n", r"csv:3: frequencies must be above"),
        ("frequency [Hz],level [g]\n10,0.01\n50,0.01\n", "unknown unit"),
        ("frequency [Hz],level [g^2/Hz]\n50,0.01\n100,0.01\n", "reach beyond the spectrum"),
    ):
        path.write_text(text, "utf-8")
        with pytest.raises(pf.PatchfemError, match=said):
            pf.run(RIG | {"drive": drive})


@pytest.mark.parametrize(
    "given, said",
    [
        ({"kind": "force"}, r"drive\.kind: waveform .random. can only shake the base"),
        ({"to": "20 Hz"}, "is not above"),
        ({"file": "x.csv"}, "exclude each other"),
        ({"spectrum": None}, "or drive.file, a table"),
        ({"from": None}, r"drive\.from.*needs a lowest frequency"),
        ({"duration": None}, r"drive\.cycles|drive\.duration"),
        ({"spectrum": "0.01 g"}, "acceleration spectrum"),
        ({"seed": -1}, "seed"),
        ({"spectrum": "0 g^2/Hz"}, "spectrum"),
        ({"duration": "0.01 s"}, "short for a band"),
    ],
)
def test_refuses_a_random_drive_that_none_can_be(given, said):
    drive = {name: one for name, one in (RIG["drive"] | given).items() if one is not None}
    with pytest.raises(pf.PatchfemError, match=said):
        pf.run(RIG | {"drive": drive})
