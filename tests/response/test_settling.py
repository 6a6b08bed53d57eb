"""Steady state, transient and growth of a motion, and extrapolation of its steady amplitude."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import patchfem as pf
from patchfem.core import Outcome
from patchfem.response import CHANGE_NOT_RESOLVED_REASON, NOT_SETTLED_WARNING, settling
from patchfem.runs.run import run
from patchfem.scene import loads


@pytest.mark.parametrize("ratio", [0.3, 0.995, -0.6])
def test_exact_geometric_transient_is_extrapolated(ratio):
    """The steady amplitude after a geometric transient is extrapolated within 1e-9."""
    a = 2.0 - 0.9 * ratio ** np.arange(6)
    assert settling.classify(a, 1e-6) is Outcome.TRANSIENT
    assert a[-1] + settling.geometric_remainder(a[-3:]) == pytest.approx(2.0, rel=1e-9)
    steady, error = settling.extrapolate_steady_amplitude(a, a * np.exp(0.7j))
    assert steady == pytest.approx(2.0, rel=1e-9) and error < 1e-6


@pytest.mark.parametrize("turn", [0.3, 2.5])
def test_exact_beat_is_extrapolated(turn):
    """The steady amplitude of a beat is extrapolated by its complex factor within 1e-9."""
    p = 2.0 - 1.1 * (0.9 * np.exp(1j * turn)) ** np.arange(9)
    steady, error = settling.extrapolate_steady_amplitude(np.abs(p), p)
    assert steady == pytest.approx(2.0, rel=1e-9) and error < 1e-6


def test_always_error_covers_two_decays():
    """The error of the extrapolation covers a transient of two decays."""
    n = np.arange(12)
    a = 1.0 + 0.3 * 0.8**n + 0.1 * 0.4**n
    steady, error = settling.extrapolate_steady_amplitude(a, a)
    assert 0 < abs(steady - 1.0) < error
    # too early to tell the decays apart
    assert settling.extrapolate_steady_amplitude(a[:6], a[:6]) == (None, None)


def test_always_no_extrapolation_without_decay():
    """Amplitudes whose changes do not shrink are not extrapolated."""
    a = 1 + 0.1 * np.arange(8)
    assert settling.extrapolate_steady_amplitude(a, a) == (None, None)
    assert settling.extrapolate_steady_amplitude(a[:3], a[:3]) == (None, None)


@pytest.mark.parametrize("map_", [[[0.7, 0.3], [-0.4, 0.6]], [[0.9, 0.2], [0.0, 0.5]]])
def test_exact_plane_map_remainder_agrees_with_neumann_series(map_):
    """The remainder of a linear map of the plane agrees with (1 - M)^-1 M d within 1e-9."""
    map_ = np.array(map_)
    end = np.array([2.0, 1.0])
    away = [np.array([0.3, -0.5])]
    for _ in range(6):
        away.append(map_ @ away[-1])
    p = (np.array(away) + end) @ [1, 1j]
    difference = away[-1] - away[-2]
    rest = np.linalg.solve(np.eye(2) - map_, map_ @ difference) @ [1, 1j]
    assert settling.plane_map_remainders(p[None, -4:])[0] == pytest.approx(rest, rel=1e-9)
    value, error = settling.extrapolate_steady_amplitude(np.abs(p), p)
    assert abs(value - np.hypot(*end)) < error + 1e-12


@pytest.mark.parametrize(
    "growth", [1 + 0.1 * np.arange(6), 1e-6 * (7 + np.arange(9)), 1.05 ** np.arange(6)]
)
def test_exact_growth_is_classified(growth):
    """Amplitudes that grow linearly or exponentially are classified as growing."""
    assert settling.classify(growth, 1e-3) is Outcome.GROWS


def test_exact_growth_below_tolerance_is_steady():
    """A growth below a twentieth of the tolerance or of the floor is steady."""
    assert settling.classify(1 + 1e-6 * np.arange(6), 1e-3) is Outcome.STEADY
    tiny = 1e-7 + 1e-10 * np.arange(6)
    assert settling.classify(tiny, 1e-6) is Outcome.GROWS
    assert settling.classify(tiny, 1e-6, 1e-8) is Outcome.STEADY


@given(st.lists(st.floats(-4e-7, 4e-7), min_size=2, max_size=8), st.floats(0.1, 10))
def test_always_noise_is_steady(noise, size):
    """Amplitudes with noise of 4e-7 are steady."""
    assert settling.classify(size * (1 + np.array(noise)), 1e-3) is Outcome.STEADY


def test_exact_short_runs_are_classified():
    """Runs of one to six windows are classified as steady or transient by their changes."""
    assert settling.classify([1.0], 1e-3) is Outcome.TRANSIENT
    assert settling.classify([1.0, 1.0001], 1e-3) is Outcome.STEADY
    assert settling.classify([1.0, 1.1], 1e-3) is Outcome.TRANSIENT
    assert settling.classify([1.0, 1.0, 1.0], 1e-3) is Outcome.STEADY
    assert settling.classify([0.0, 0.0, 0.0], 1e-3) is Outcome.STEADY
    assert settling.classify(5 - 0.5 * np.arange(6), 1e-3) is Outcome.TRANSIENT


# free motion that is left

CYCLES = np.arange(120)


def make_beating_extremes(beat: float, decay: float, count: int = 120) -> np.ndarray:
    """Return the extremes (c, 2) of 1 + 0.3 exp(-decay c) cos(beat c) per cycle."""
    high = 1 + 0.3 * np.exp(-decay * CYCLES[:count]) * np.cos(beat * CYCLES[:count])
    return np.column_stack([-high, high])


@pytest.mark.parametrize("beat", [2.3, 0.7])
@pytest.mark.parametrize("decay", [0.01, 0.06])
def test_exact_remaining_free_motion_of_beat(beat, decay):
    """The estimate of the remaining free motion of a beat is right within a factor of three."""
    extremes = make_beating_extremes(beat, decay)
    amplitude = settling.window_amplitude_means(extremes, 10)[0]
    left = settling.remaining_free_motion(extremes, 10, 10 * decay)
    assert 0.4 * (amplitude[-1] - 1) < left < 3 * (amplitude[-1] - 1)
    value, error = (one.item() for one in settling.beat_mean_amplitudes(extremes[None], 10))
    # NaN: the last window is nearer
    assert abs(value - 1) < error < 0.3 if value == value else decay == 0.06


# scenes

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


def test_exact_beating_modes_are_transient():
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


@pytest.mark.parametrize("size", ["1 g", "1e-9 g"])
@pytest.mark.parametrize("cycles, outcome", [(30, "transient"), (1200, "steady")])
def test_exact_outcome_of_linear_rig_is_independent_of_drive(size, cycles, outcome):
    """A linear rig has the same outcome for a drive of 1 g and of 1e-9 g."""
    text = BEATING[
        BEATING.index("[structure]") : BEATING.index('[[structure.mode]]\nname = "m1')
    ].replace("damping = 0.0", "damping = 0.003")
    text += f'[drive]\nkind = "base"\nfrequency = "50.8 Hz"\nacceleration = "{size}"\ncycles = {cycles}\n'
    assert run(loads(text), estimate=False).outcome == outcome


CREST = {
    "normal": {"load": 490.8385468627066},
    "friction": {
        "law": "lugre",
        "static": 0.20225473066502245,
        "kinetic": 0.16180378453201796,
        "stiffness": 6058917.979262763,
        "stribeck_speed": 0.011162824693624403,
        "micro_damping": 91.01153908108391,
    },
    "structure": {
        "moving_mass": 3.417730803691922,
        "mode": [
            {
                "name": "a",
                "frequency": 163.46704777528493,
                "damping": 0.024868620207150423,
                "slide": 1.0,
            }
        ],
    },
    "drive": {"kind": "base", "frequency": 168.28036136786184, "acceleration": 57.32633753154075},
}


@pytest.mark.parametrize("cycles", [25, 27])
def test_exact_rig_at_overshoot_is_transient(cycles):
    """A rig at the maximum of its overshoot is transient.

    Its steady amplitude agrees with harmonic balance within the errors.
    """
    name = "relative_displacement_amplitude"
    scene = CREST | {"drive": CREST["drive"] | {"cycles": float(cycles)}}
    truth = pf.run(scene, **{"accuracy.method": "harmonic"}).measures[name]
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


def test_exact_unresolved_transient_gives_reason():
    """A transient of 8 cycles has a reason in place of a steady amplitude."""
    done = pf.run(CREST | {"drive": CREST["drive"] | {"cycles": 8.0}})
    steady = done.measures["relative_displacement_amplitude_steady"]
    assert done.outcome == "transient"
    assert steady.value is None
    assert steady.reason == CHANGE_NOT_RESOLVED_REASON
    later = pf.run(CREST | {"drive": CREST["drive"] | {"cycles": 200.0}})
    assert later.outcome == "steady"
    assert "relative_displacement_amplitude_steady" not in later.measures


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


@pytest.mark.parametrize("end, outcome", [(20.0, "transient"), (100.0, "steady")])
def test_exact_block_on_belt_is_not_stuck(end, outcome):
    """A block on a moving belt is steady with the amplitude sqrt(0.17) m.

    It sticks longer than a cycle of the drive.
    """
    result = run(loads(BELT + f'duration = "{end} s"\n'), estimate=False)
    slipped = result.response.slide[-1] - result.response.slide[0]
    assert abs(slipped) > 0.1 and result.outcome == outcome
    if outcome == "steady":
        assert result.extra["window"] == 2
        assert result.measures["relative_displacement_amplitude"].value == pytest.approx(
            np.sqrt(0.17), abs=2e-7
        )
        # the belt loses a little speed
        assert settling.slip_period(
            result.response.time, result.response.slide_rate
        ) == pytest.approx(8 + 2 * (np.pi - np.arctan(4)), rel=2e-5)


HOLDS = """[normal]
load = "100 N"
[friction]
law = "elastic-plastic"
static = 0.5
stiffness = "1e6 N/m"
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "m0"
frequency = "100 Hz"
damping = 0.01
slide = 1.0
[drive]
kind = "base"
frequency = "150 Hz"
acceleration = "1 m/s^2"
cycles = {cycles}
[accuracy]
tolerance = 1e-2
"""


@pytest.mark.parametrize("cycles, settled", [(20, False), (600, True)])
def test_exact_stuck_ringing_motion_gives_warning(cycles, settled):
    """A stuck motion that still rings gives a warning with the number of cycles needed.

    After 600 cycles the amplitude agrees with the closed form.
    """
    done = pf.run(HOLDS.format(cycles=cycles))
    own = 2 * np.pi * 100
    omega = 2 * np.pi * 150
    steady = 1 / abs(own**2 + 1e6 - omega**2 + 0.02j * own * omega)
    amplitude = done.measures["relative_displacement_amplitude"].value
    told = [one for one in done.warnings if one.startswith(NOT_SETTLED_WARNING)]
    assert done.outcome == "stuck" and (abs(amplitude / steady - 1) < 0.01) == settled == (not told)
    assert settled or "drive.cycles = " in told[0]
