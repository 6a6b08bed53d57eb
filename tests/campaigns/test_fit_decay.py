"""Tests of fitting the parameters of a joint to its frequency and damping over the amplitude."""

import numpy as np
import pytest
import xarray as xr
from command_line import read_page, run_cli, run_successfully
from page_data import find_accessibility_errors
from scene_texts import (
    COULOMB,
    DRIVE,
    KILOGRAM,
    POINT,
    make_friction_table,
)

import patchfem as pf
from patchfem.campaigns.fits.curve import CurveComparison
from patchfem.campaigns.free_keys import parse_ranges
from patchfem.core import PatchfemError

IWAN = (
    POINT
    + make_friction_table("iwan").replace("1e7 N/m", "1e6 N/m").replace("chi = -0.5", "chi = -0.35")
    + KILOGRAM
    + DRIVE
)
START = IWAN.replace("chi = -0.35", "chi = -0.6").replace("1e6 N/m", "6e5 N/m")
AMPLITUDES = np.geomspace(1e-6, 2e-5, 2)
FREE = {"friction.stiffness": ("3e5 N/m", "3e6 N/m"), "friction.chi": (-0.9, -0.05)}


def read_curve(path, scene=IWAN, free="friction.chi=-0.9..-0.05") -> CurveComparison:
    """Return the comparison of a measured curve with a joint, by default an Iwan joint."""
    return CurveComparison(pf.load(scene), path, parse_ranges([free]))


def write_decay(path, text: str, noise: float = 0.0, seed: int = 0, amplitudes=AMPLITUDES):
    """Write the balance curve of a scene as a measured decay and return its path.

    The damping has the relative noise `noise`, the frequency a hundredth of it.
    """
    curve = pf.backbone(text, amplitudes=amplitudes, method="balance")
    a, f, z = (curve[f"balance_{name}"].values for name in ("amplitude", "frequency", "damping"))
    rng = np.random.default_rng(seed)
    f = f * (1 + noise / 100 * rng.normal(size=f.size))
    z = z * (1 + noise * rng.normal(size=z.size))
    rows = [
        f"{x!r},{y!r},{0.02 * (noise or 1e-4) * y!r},{w!r},{2 * (noise or 1e-4) * w!r}"
        for x, y, w in zip(a.tolist(), f.tolist(), z.tolist())
    ]
    head = "decay_amplitude [m],decay_frequency [Hz],decay_frequency_error [Hz],decay_damping,decay_damping_error"
    path.write_text("\n".join([head, *rows]) + "\n")
    return path


@pytest.mark.slow
def test_band_of_the_fitted_curve_contains_the_truth_beyond_the_data(tmp_path):
    """The 95 % band of a curve that is fitted to noisy data contains the true curve at three times the amplitudes."""
    path = write_decay(tmp_path / "decay.csv", IWAN, 0.03, 5, np.geomspace(2e-7, 1e-5, 6))
    result = pf.fit(START, to=path, free=FREE, starts=1, out=tmp_path / "out")
    with xr.open_dataset(tmp_path / "out/result.nc") as data:
        amplitude = data.curve_amplitude.values
        truth = pf.backbone(IWAN, amplitudes=amplitude, method="balance")
        for name in ("frequency", "damping"):
            difference = abs(data[f"curve_{name}"].values - truth[f"balance_{name}"].values)
            band = data[f"curve_{name}_error"].values
            assert np.mean(difference <= band) >= 0.9
            # the band is no wider than a few times the noise of the data
            assert (band > 0).all() and np.median(band / data[f"curve_{name}"].values) < 0.1
    assert amplitude[-1] == pytest.approx(3e-5) and amplitude[0] == pytest.approx(2e-7 / 3)
    assert any("a further measurement at about" in note for note in result["notes"])


def test_exact_parameters_are_recovered_from_computed_decay(tmp_path):
    """Stiffness and exponent of an Iwan joint are recovered from its curve within 1e-5.

    The fitted scene has the same values.
    """
    path = write_decay(tmp_path / "decay.csv", IWAN)
    result = pf.fit(START, to=path, free=FREE, starts=1, out=tmp_path / "out")
    values = {name: fitted["value"] for name, fitted in result["values"].items()}
    assert values["friction.stiffness"] == pytest.approx(1e6, rel=1e-5)
    assert values["friction.chi"] == pytest.approx(-0.35, abs=1e-5)
    assert result["outcome"] == "done" and result["scores"]["damping_residual_rms"] < 1e-5
    assert pf.load(tmp_path / "out/scene.fitted.toml").friction.chi == pytest.approx(
        -0.35, abs=1e-5
    )
    measured, rows = (
        np.loadtxt(file, delimiter=",", skiprows=1) for file in (path, tmp_path / "out/fit.csv")
    )
    np.testing.assert_allclose(rows[:, :5], measured, rtol=1e-12)
    np.testing.assert_allclose(rows[:, 5:7], measured[:, [1, 3]], rtol=1e-5)
    # a free motion loses 1 - exp(-2 pi zeta) of its amplitude in a cycle
    loss = 100 * (1 - np.exp(-2 * np.pi * measured[:, 3].max()))
    assert any(f"the amplitude falls by up to {loss:.2g} %" in note for note in result["notes"])


def test_common_factor_of_stated_errors_has_no_effect_on_the_intervals(tmp_path):
    """Stated errors that are ten times larger give the same value and interval, and a note states the smaller residual."""
    path = write_decay(tmp_path / "decay.csv", IWAN, 1e-2)
    head, *rows = path.read_text().splitlines()
    wide = tmp_path / "wide.csv"
    cells = np.array([row.split(",") for row in rows], float) * [1, 1, 10, 1, 10]
    np.savetxt(wide, cells, delimiter=",", header=head, comments="")
    scene = IWAN.replace("chi = -0.35", "chi = -0.6")
    narrow, wide = (
        pf.fit(scene, to=file, free={"friction.chi": (-0.9, -0.05)}, starts=1)
        for file in (path, wide)
    )
    fitted, same = (fit["values"]["friction.chi"] for fit in (narrow, wide))
    for name in ("value", "low", "high"):
        assert same[name] == pytest.approx(fitted[name], rel=1e-3)
    ratios = []
    for fit in (narrow, wide):
        (note,) = (note for note in fit["notes"] if "the stated errors are weights" in note)
        ratios.append(float(note.partition("rms is ")[2].split()[0]))
    assert ratios[1] == pytest.approx(ratios[0] / 10, rel=0.05)


def test_fit_command_reads_curve_and_refuses_invalid_curves(tmp_path, monkeypatch):
    """The command fits a curve from a file and refuses tables that are no single valid curve."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rig.toml").write_text(START)
    # a residual of zero has no chart
    write_decay(tmp_path / "decay.csv", IWAN, 1e-3)
    command = ["fit", "rig.toml", "--to", "decay.csv", "--free", "friction.chi=-0.9..-0.05"]
    assert "use amplitude" in run_cli(*command, "--hold", "frequency=1 Hz").err
    answer = run_successfully(
        *command, "--set", "friction.stiffness=1e6 N/m", "--starts", "1", "-o", "out"
    )
    assert "At 2 amplitudes" in answer.out and "by method balance" in answer.out
    assert "friction.chi" in answer.out
    page = read_page(tmp_path / "out")
    assert (
        find_accessibility_errors(page) == []
        and page.count("<figure") == 4
        and "the residual is" in page
    )
    # without columns of errors they follow from the scatter, which screen, file and page say
    rows = np.loadtxt("decay.csv", delimiter=",", skiprows=1)[:, [0, 1, 3]]
    head = "amplitude [m],frequency [Hz],damping"
    np.savetxt("decay.csv", rows, delimiter=",", header=head, comments="")
    answer = run_cli(*command, "--set", "friction.stiffness=1e6 N/m", "--starts", "1", "-o", "out")
    assert "The errors of the measured values are their scatter around the fit." in answer.out
    for name in ("fit.json", "report.html"):
        assert "from their scatter around the fit: " in (tmp_path / "out" / name).read_text("utf-8")
    # a table of no kind and a record over time are refused with the header of each kind, and how to make the first
    for header in (
        "time [s],velocity [m/s]",
        "Time [ms],displacement [m],force [N]",
        "a [m],f [Hz],z",
        "MATLAB",
    ):
        command[3] = "ring.mat" if header == "MATLAB" else "decay.csv"
        (tmp_path / command[3]).write_text(f"{header}\n1,2,3\n")
        answer = run_cli(*command)
        for text in ("amplitude [um],frequency [Hz],damping [%]", "frequency [Hz],input [g],"):
            assert answer.code == 2 and f"`{text}" in answer.err
        assert (
            f"records over time is fitted as the table that `patchfem import {command[3]} --decay"
            in answer.err
        )
    table = tmp_path / "backbone.csv"
    table.write_text(
        "method,amplitude [m],frequency [Hz],damping\na,1e-6,100,0.1\nb,2e-6,100,0.1\n"
    )
    with pytest.raises(PatchfemError, match="several methods"):
        read_curve(table)
    table.write_text("amplitude [m],frequency [Hz],damping\n-1e-6,100,0.1\n2e-6,100,0.1\n")
    with pytest.raises(PatchfemError, match="above 0"):
        read_curve(table)
    table.write_text(
        "amplitude [m],frequency [Hz],frequency_error [Hz],damping\n1e-6,100,-1,0.1\n2e-6,100,1,0.1\n"
    )
    with pytest.raises(PatchfemError, match="errors must be 0 or more"):
        read_curve(table)


def test_damping_in_percent_and_assumed_errors(tmp_path):
    """Damping in percent is read as the ratio, and errors that a table does not give are assumed until a fit."""
    rows = ((1, 100, 0.2, 0.5), (2, 99, 0.3, 0.5))
    path = tmp_path / "curve.csv"
    path.write_text(
        "amplitude [um],frequency [Hz],damping [%],damping_error [%]\n"
        + "".join(",".join(map(str, row)) + "\n" for row in rows)
    )
    curve = read_curve(path)
    every = np.ones(4, bool)
    assert curve.measured == pytest.approx([100, 99, 0.002, 0.003], rel=1e-15)
    assert curve.deviation == pytest.approx([2.5, 2.475, 0.0025, 0.0025])
    assert curve.is_assumed.tolist() == [True, False]
    curve.keys.ranges = []
    deviation = curve.estimate_deviation(curve.measured * [1.01, 1.01, 1.1, 1.1], every)
    assert deviation[:2] == pytest.approx(0.01 * curve.measured[:2], rel=1e-3)
    assert deviation[2:] == pytest.approx(curve.deviation[2:])


def test_refuses_amplitude_at_which_rigid_friction_stops_the_mode(tmp_path):
    """An amplitude at which the mode does not oscillate is named, with what to do."""
    path = tmp_path / "curve.csv"
    path.write_text("amplitude [um],frequency [Hz],damping\n1,143,0.1\n10000,143,0.005\n")
    curve = read_curve(path, POINT + COULOMB + KILOGRAM + DRIVE, "friction.static=0.1..0.6")
    curve.method = "balance"
    with pytest.raises(PatchfemError, match="not oscillate at 1 of 2 amplitudes, at 1 um; leave"):
        curve.compute([0.3])


def test_refuses_fewer_values_than_parameters(tmp_path):
    """Two amplitudes are refused for four parameters.

    Each amplitude has two values, a frequency and a damping ratio.
    """
    path = tmp_path / "few.csv"
    path.write_text("amplitude [m],frequency [Hz],damping [1]\n1e-6,100,0.01\n2e-6,99,0.01\n")
    free = {**FREE, "friction.static": (0.1, 0.6), "friction.beta": (0.1, 2)}
    with pytest.raises(PatchfemError, match=r"only 4 values are used .* needs more than 4"):
        pf.fit(IWAN, to=path, free=free)


@pytest.mark.long
def test_assumed_errors_are_the_scatter_around_the_fit_by_balance(tmp_path):
    """Errors that the table does not give are two standard deviations of the residual of the reported fit.

    The quasi-static curve, which starts the search, differs in gross slip from that of the balance by far more than the
    0.05 % by which the measured frequency scatters.
    """
    scene = POINT + make_friction_table("elastic-plastic") + KILOGRAM + DRIVE
    amplitudes = np.geomspace(1e-6, 1e-4, 8)
    truth = pf.backbone(scene, amplitudes=amplitudes, method="balance")
    signs = np.array([1, -1, -1, 1, -1, 1, 1, -1])
    rows = np.column_stack(
        [
            amplitudes,
            truth.balance_frequency * (1 + 5e-4 * signs),
            truth.balance_damping * (1 + 1e-2 * signs[::-1]),
        ]
    )
    path = tmp_path / "curve.csv"
    header = "amplitude [m],frequency [Hz],damping"
    np.savetxt(path, rows, delimiter=",", header=header, comments="")
    free = {"friction.static": (0.1, 1.0)}
    result = pf.fit(scene, to=path, free=free, starts=1, out=tmp_path / "out")
    with xr.open_dataset(tmp_path / "out/result.nc") as data:
        for name in ("frequency", "damping"):
            relative_error = data[f"{name}_error"].values / data[name].values
            # one parameter takes up half a degree of freedom of each of the two quantities
            scatter = result["scores"][f"{name}_residual_rms"] * np.sqrt(8 / 7.5)
            assert np.median(relative_error) == pytest.approx(2 * scatter, rel=0.01), name
    assert result["scores"]["frequency_residual_rms"] == pytest.approx(5e-4, rel=0.01)
