"""Steady state, transient and growth of a motion, and extrapolation of its steady amplitude."""

import numpy as np
import pytest

import patchfem as pf
from patchfem.measures import settling
from patchfem.runs.run import run
from patchfem.scene import loads


@pytest.mark.parametrize("ratio", [0.3, 0.995, -0.6])
def test_exact_geometric_transient_is_extrapolated(ratio):
    """The steady amplitude after a geometric transient is extrapolated within 1e-9."""
    a = 2.0 - 0.9 * ratio ** np.arange(5)[None]
    (steady,), (error,) = settling.extrapolate_steady_amplitudes(a, a * np.exp(0.7j))
    assert steady == pytest.approx(2.0, rel=1e-9) and error < 1e-6


def test_always_error_covers_two_decays():
    """The error of the extrapolation covers a transient of two decays."""
    # The first row is too early to tell the decays apart.
    n = np.array([[1], [7]]) + np.arange(5)
    a = 1.0 + 0.3 * 0.8**n + 0.1 * 0.4**n
    steady, error = settling.extrapolate_steady_amplitudes(a, a)
    assert np.isnan(steady[0]) and 0 < abs(steady[1] - 1.0) < error[1]


@pytest.mark.parametrize("window", [1, 3])
@pytest.mark.parametrize("extra, is_extrapolated", [(0, False), (1, True)])
def test_exact_only_the_second_half_of_a_run_is_extrapolated(window, extra, is_extrapolated):
    """The four windows before the last one have to lie in the second half of the run, or no steady amplitude is stated."""
    n_cycles = 8 * window + extra
    amplitude = 2.0 - 0.9 * 0.8 ** np.arange(n_cycles)[None]
    extremes = np.stack([-amplitude, amplitude], axis=-1)
    ends = settling.judge_motions(extremes, amplitude + 0j, window, 1e-6, 0.0, 0.0)
    assert np.isfinite(ends.steady).all() == is_extrapolated
    if is_extrapolated:
        assert ends.steady[0, 0] == pytest.approx(2.0, rel=1e-9)


@pytest.mark.parametrize(
    "amplitudes, outcome",
    [
        (1 + 0.1 * np.arange(6), "grows"),
        (1e-6 * (7 + np.arange(9)), "grows"),
        (1.05 ** np.arange(6), "grows"),
        (1 + 4e-5 * np.arange(6), "steady"),
        (1 + 6e-5 * np.arange(6), "grows"),
        ([1.0], "transient"),
        ([1.0, 1.0001], "steady"),
        ([1.0, 1.1], "transient"),
        ([1.0, 1.0, 1.0], "steady"),
        ([0.0, 0.0, 0.0], "steady"),
        (5 - 0.5 * np.arange(6), "transient"),
        *[(2.0 - 0.9 * ratio ** np.arange(6), "transient") for ratio in (0.3, 0.995, -0.6)],
    ],
)
def test_exact_amplitudes_of_windows_are_classified(amplitudes, outcome):
    """Amplitudes grow from a twentieth of the tolerance per window; short runs are classified by their last change."""
    found = settling.classify_motions(np.array([amplitudes]), 1e-3)
    assert settling.MOTION_CLASSES[found[0]] == outcome


def test_exact_windows_end_at_last_cycle():
    """Windows of two cycles leave out the first of five; a run that is shorter than a window is one window."""
    extremes = np.array([[0, 9], [2, 5], [1, 4], [3, 7], [2, 6]])
    windows = settling.measure_windows(extremes, 2)
    assert windows.amplitude.tolist() == [2.0, 2.5]
    assert windows.cycle_amplitude.tolist() == [1.5, 2.0]
    assert windows.find_drift(2) == 0.75
    whole = settling.measure_windows(extremes, 7)
    assert whole.amplitude.tolist() == [4.5] and whole.find_drift(7) == np.inf


BEATING = """\
[normal]
load = "11.609394870916159 N"
[friction]
law = "elastic-plastic"
static = 0.3
bond_length = "1.442184428919966e-05 m"
[structure]
moving_mass = "0.45750044047756644 kg"
[[structure.mode]]
name = "m0"
frequency = "50.87602774937182 Hz"
damping = 0.0
slide = 1.0
base = 0.8234029358327306
output = 1.0
[[structure.mode]]
name = "m1"
frequency = "102.38435328283282 Hz"
damping = 0.003
slide = 0.21371552727786047
base = -0.11703537550943954
output = -0.0679638707682324
[[structure.mode]]
name = "m2"
frequency = "49.897401285531195 Hz"
damping = 0.003
slide = -0.07104935650644062
base = -0.005236360848597077
output = -0.3471520601475445
[drive]
kind = "force"
frequency = "84.51984054071893 Hz"
force = "17.219116021866952 N"
cycles = 60
[accuracy]
tolerance = 0.01
"""


def test_beating_modes_are_transient():
    """Three modes that beat are transient, and the error of the steady amplitude covers the value after 2500 cycles.

    After 2500 cycles the slowest mode has exp(-27) of its free motion left.
    """
    early, late = (
        run(loads(BEATING, sets=[f"drive.cycles={count}"]), estimate=False) for count in (60, 2500)
    )
    name = "relative_displacement_amplitude"
    truth = late.measures[name].value
    assert truth == pytest.approx(2.459e-4, rel=1e-3) and late.outcome == "steady"
    assert early.measures[name].value > 1.05 * truth and early.outcome == "transient"
    steady = run(loads(BEATING)).measures[f"{name}_steady"]
    assert abs(steady.value - truth) <= steady.error < 0.05 * truth
    # The steady amplitude of the accelerometer is not stated for the displacement at a gauge.
    text = BEATING.replace("base = 0.8", "gauge = 0.5\nbase = 0.8")
    assert run(loads(text), estimate=False).measures[f"{name}_steady"].value is None


CREST = """\
[normal]
load = "490.8385468627066 N"
[friction]
law = "lugre"
static = 0.20225473066502245
kinetic = 0.16180378453201796
stiffness = "6058917.979262763 N/m"
stribeck_speed = "0.011162824693624403 m/s"
micro_damping = "91.01153908108391 N s/m"
[structure]
moving_mass = "3.417730803691922 kg"
[[structure.mode]]
name = "a"
frequency = "163.46704777528493 Hz"
damping = 0.024868620207150423
slide = 1.0
[drive]
kind = "base"
frequency = "168.28036136786184 Hz"
acceleration = "57.32633754153075 m/s^2"
"""


@pytest.mark.parametrize("cycles", [25, 27])
def test_exact_rig_at_overshoot_is_transient(cycles):
    """A rig at the maximum of its overshoot is transient.

    Its steady amplitude agrees with harmonic balance within the errors.
    """
    name = "relative_displacement_amplitude"
    scene = f"{CREST}cycles = {cycles}\n"
    settings = {"accuracy.method": "harmonic", "accuracy.tolerance": 1e-5}
    truth = pf.run(scene, **settings).measures[name]
    done = pf.run(scene)
    steady = done.measures[f"{name}_steady"]
    assert truth.value == pytest.approx(443.852e-6, rel=2e-6) and done.outcome == "transient"
    assert abs(steady.value - truth.value) <= steady.error + truth.error
    assert steady.error < 0.01 * truth.value
    if cycles == 25:
        assert steady.error > 1e-3 * steady.value
        assert any(
            one.startswith(f"{name}_steady has")
            and "more drive cycles make this value more accurate" in one
            for one in done.warnings
        )


BELT = """\
[structure]
masses = ["1 kg", "1e8 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "1 N/m"
[[structure.interface]]
between = [1, 2]
law = "coulomb"
static = 1.0
kinetic = 0.6
load = "1 N"
[structure.start]
displacement = ["0 m", "0 m"]
velocity = ["0.1 m/s", "0.1 m/s"]
[drive]
kind = "free"
"""


@pytest.mark.parametrize("end, outcome", [(20, "transient"), (100, "steady")])
def test_exact_block_on_belt_is_not_stuck(end, outcome):
    """A block on a moving belt is steady with the amplitude sqrt(0.17) m.

    It sticks longer than a cycle of the drive.
    """
    result = run(loads(BELT + f'duration = "{end} s"\n'), estimate=False)
    slipped = result.response.slide[-1] - result.response.slide[0]
    assert abs(slipped) > 0.1 and result.outcome == outcome
    if outcome == "steady":
        assert result.settings.window_cycles == 2
        assert result.measures["relative_displacement_amplitude"].value == pytest.approx(
            np.sqrt(0.17), abs=2e-7
        )
        # the belt loses a little speed
        assert settling.find_slip_period(
            result.response.time, result.response.slide_rate
        ) == pytest.approx(8 + 2 * (np.pi - np.arctan(4)), rel=2e-5)
