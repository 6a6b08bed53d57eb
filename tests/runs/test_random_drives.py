"""Random vibration: the motion against SciPy's linear filter, energies with friction, refusals."""

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
RESPONSE_MEASURES = (
    "relative_displacement_rms",
    "absolute_acceleration_rms",
    "response_frequency",
    "response_damping",
)


def test_random_response_agrees_with_scipy_lsim():
    """The motion under a random record and its root mean square agree with SciPy's linear filter of
    this record, and its spectrum is consistent with both."""
    result = pf.run(RIG)
    drive = result.plan.model.rig.drive.signal
    omega = 2 * np.pi * 100
    zeta = 0.02
    _, displacement, _ = lsim(
        lti([[0, 1], [-(omega**2), -2 * zeta * omega]], [[0], [-1]], [[1, 0]], [[0]]),
        drive.value,
        drive.time,
        interp=True,
    )
    start = result.window.time[0]
    # The window starts after three decay times, up to one cycle less.
    assert start == pytest.approx(3 / (zeta * omega), abs=0.011)
    sample_index = result.response.time / drive.time[1]
    at_samples = np.abs(sample_index - np.round(sample_index)) < 1e-6
    expected = np.interp(result.response.time, drive.time, displacement)
    assert (
        np.abs(result.response.output - expected)[at_samples].max()
        < 1e-9 * np.abs(displacement).max()
    )
    measures = {name: result.measures[name] for name in RESPONSE_MEASURES}
    assert measures["relative_displacement_rms"].value == pytest.approx(
        displacement[drive.time >= start].std(), rel=2e-3
    )
    assert (
        abs(measures["response_frequency"].value - 100)
        < 2 * result.measures["response_frequency_scatter"].value
    )
    assert (
        all(measure.error is not None for measure in measures.values()) and result.outcome == "done"
    )
    data = result.to_xarray()
    assert data["absolute_acceleration_spectrum"].attrs["units"] == "m2 s-3"
    power = data["relative_displacement_spectrum"]
    assert np.sqrt(power.sum() * power.frequency[0]) == pytest.approx(
        measures["relative_displacement_rms"].value, rel=0.1
    )


def test_exact_random_vibration_energies_balance():
    """The energies of an elastic-plastic contact under random vibration balance; a stuck rig has no
    damping of the response and gives the reason."""
    result = pf.run(RIG | PLASTIC)
    measures = result.measures
    assert measures["energy_balance"].value < 1e-9 and measures["work_check"].value < 1e-3
    ledger = result.to_xarray()[["friction_work", "energy_dissipated", "energy_stored"]].isel(
        time=-1
    )
    assert float(ledger.friction_work) == pytest.approx(
        float(ledger.energy_dissipated + ledger.energy_stored), 1e-9
    )
    assert measures["friction_work"].value == pytest.approx(float(ledger.friction_work), rel=1e-9)
    # The natural frequency of the stuck rig is 164.2 Hz.
    assert (
        100 < measures["response_frequency"].value < 165
        and measures["response_damping"].value > 0.02
    )
    stuck = pf.run(
        RIG | PLASTIC | {"friction": {"law": "coulomb", "static": 0.9}}, **{"normal.load": "900 N"}
    )
    assert stuck.outcome == "stuck" and stuck.measures["response_damping"].reason.startswith(
        "the frequency response (H1) has no peak"
    )


@pytest.mark.parametrize(
    "rows, message",
    [
        ("[g^2/Hz]\n10,0.01\n5,0.01\n", r"csv:3: frequencies must be above"),
        ("[g]\n10,0.01\n50,0.01\n", "unknown unit"),
        ("[g^2/Hz]\n50,0.01\n100,0.01\n", "reach beyond the spectrum"),
    ],
)
def test_refuses_faulty_table_of_a_spectrum(tmp_path, rows, message):
    """The table of a spectrum has increasing frequencies, a unit of a spectrum, and the whole band."""
    path = tmp_path / "spectrum.csv"
    path.write_text("frequency [Hz],level " + rows)
    drive = {key: value for key, value in RIG["drive"].items() if key != "spectrum"}
    with pytest.raises(pf.PatchfemError, match=message):
        pf.run(RIG | {"drive": drive | {"file": str(path)}})
