"""Whether a motion has settled: windows, tails, beats, and scenes that were called steady or stuck too early."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import patchfem as pf
from patchfem.core import Outcome
from patchfem.response import CHANGE_NOT_RESOLVED_REASON, NOT_SETTLED_WARNING, settling
from patchfem.runs.run import run
from patchfem.scene import loads


@pytest.mark.parametrize("ratio", [0.3, 0.8, 0.97, 0.995, -0.6])
def test_exact_geometric_tail_is_extrapolated(ratio):
    a = 2.0 - 0.9 * ratio ** np.arange(6)
    assert settling.classify(a, 1e-6) is Outcome.TRANSIENT
    assert a[-1] + settling.geometric_remainder(a[-3:]) == pytest.approx(2.0, rel=1e-9)
    steady, error = settling.extrapolate_steady_amplitude(a, a * np.exp(0.7j))
    assert steady == pytest.approx(2.0, rel=1e-9) and error < 1e-6


@pytest.mark.parametrize("turn", [0.3, 1.0, 2.5])
def test_exact_a_beat_is_extrapolated_by_its_complex_factor(turn):
    """A free motion beside the drive: the amplitudes swing about the steady one, the phasors close in on it."""
    p = 2.0 - 1.1 * (0.9 * np.exp(1j * turn)) ** np.arange(9)
    steady, error = settling.extrapolate_steady_amplitude(np.abs(p), p)
    assert steady == pytest.approx(2.0, rel=1e-9) and error < 1e-6


def test_exact_two_decays_are_bracketed_by_the_error():
    n = np.arange(12)
    a = 1.0 + 0.3 * 0.8**n + 0.1 * 0.4**n
    steady, error = settling.extrapolate_steady_amplitude(a, a)
    assert 0 < abs(steady - 1.0) < error
    # too early to tell the decays apart
    assert settling.extrapolate_steady_amplitude(a[:6], a[:6]) == (None, None)


def test_always_no_estimate_without_a_shrinking_change():
    a = 1 + 0.1 * np.arange(8)
    assert settling.extrapolate_steady_amplitude(a, a) == (None, None)
    assert settling.extrapolate_steady_amplitude(a[:3], a[:3]) == (None, None)


@pytest.mark.parametrize("map_", [[[0.7, 0.3], [-0.4, 0.6]], [[0.9, 0.2], [0.0, 0.5]]])
def test_exact_a_map_of_the_plane_is_summed(map_):
    """Against the sum of its Neumann series, (1 - M)^-1 M d; one turns, one shrinks along two lines."""
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
def test_exact_endless_growth(growth):
    assert settling.classify(growth, 1e-3) is Outcome.GROWS


def test_exact_growth_that_no_tolerance_notices_is_steady():
    """A change below a twentieth of the tolerance, or of the floor, would take very long to count."""
    assert settling.classify(1 + 1e-6 * np.arange(6), 1e-3) is Outcome.STEADY
    tiny = 1e-7 + 1e-10 * np.arange(6)
    assert settling.classify(tiny, 1e-6) is Outcome.GROWS
    assert settling.classify(tiny, 1e-6, 1e-8) is Outcome.STEADY


@given(st.lists(st.floats(-4e-7, 4e-7), min_size=2, max_size=8), st.floats(0.1, 10))
def test_always_noise_is_steady(noise, size):
    assert settling.classify(size * (1 + np.array(noise)), 1e-3) is Outcome.STEADY


def test_exact_short_and_odd_runs():
    assert settling.classify([1.0], 1e-3) is Outcome.TRANSIENT
    assert settling.classify([1.0, 1.0001], 1e-3) is Outcome.STEADY
    assert settling.classify([1.0, 1.1], 1e-3) is Outcome.TRANSIENT
    assert settling.classify([1.0, 1.0, 1.0], 1e-3) is Outcome.STEADY
    assert settling.classify([0.0, 0.0, 0.0], 1e-3) is Outcome.STEADY
    assert settling.classify(5 - 0.5 * np.arange(6), 1e-3) is Outcome.TRANSIENT


# free motion that is left

CYCLES = np.arange(120)


def swinging(beat: float, decay: float, count: int = 120) -> np.ndarray:
    """Extremes (c, 2) of 1 + 0.3 exp(-decay c) cos(beat c) per cycle."""
    high = 1 + 0.3 * np.exp(-decay * CYCLES[:count]) * np.cos(beat * CYCLES[:count])
    return np.column_stack([-high, high])


@pytest.mark.parametrize("beat", [2.3, 1.1, 0.7])
@pytest.mark.parametrize("decay", [0.01, 0.03, 0.06])
def test_exact_what_is_left_of_a_short_beat(beat, decay):
    """The amplitude of the last window less that of the settled motion, to a factor of three."""
    extremes = swinging(beat, decay)
    amplitude = settling.window_amplitude_means(extremes, 10)[0]
    left = settling.remaining_free_motion(extremes, 10, 10 * decay)
    assert 0.4 * (amplitude[-1] - 1) < left < 3 * (amplitude[-1] - 1)
    value, error = (one.item() for one in settling.beat_mean_amplitudes(extremes[None], 10))
    # NaN: the last window is nearer
    assert abs(value - 1) < error < 0.3 if value == value else decay == 0.06


@given(st.floats(0.1, 3.0), st.floats(0.05, 0.5), st.integers(1, 10))
def test_always_less_is_left_of_a_longer_run(beat, decay, window):
    short, long = (
        settling.remaining_free_motion(swinging(beat, decay, count), window, decay * window)
        for count in (60, 120)
    )
    assert long <= short + 1e-12 and long < 3 * np.exp(-decay * (110 - 2 * window))


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


def test_exact_three_modes_that_beat_are_not_steady_while_they_do():
    """Called steady at 2.606e-4 m, as two windows moved by less than 1 %; it settles at 2.459e-4 m.

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
def test_exact_the_size_of_a_linear_drive_does_not_settle_it(size, cycles, outcome):
    """A ring-up to 1e-5 or 1e-14 m: below 1e-10 m every change counted as none."""
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


@pytest.mark.parametrize("cycles", [24, 25, 26, 27])
def test_exact_a_rig_at_the_crest_of_its_ring_up_is_not_steady(cycles):
    """Called steady at 445.05 +- 0.24 um after 25 cycles, tolerance 1e-3; the harmonic balance gives 443.852 um."""
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


def test_exact_a_transient_that_shows_no_end_has_the_reason_in_place_of_its_steady_amplitude():
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


@pytest.mark.parametrize("end, outcome", [(20.0, "transient"), (40.0, "steady"), (100.0, "steady")])
def test_exact_a_belt_does_not_end_stuck(end, outcome):
    """A block on a belt of 0.1 m/s sticks for 8 s of every 11.63 s, so windows of one cycle, 6.28 s, see no slip or
    half of one. One of two cycles holds a whole period: 0.6 +- sqrt(0.17) m, from 40 s on twice in a row."""
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
def test_exact_a_motion_that_sticks_and_rings_on_is_said_to_be_transient(cycles, settled):
    """Of a held linear rig the steady amplitude is a/|w_1^2 - w^2 + 2 i z_1 w_1 w|."""
    done = pf.run(HOLDS.format(cycles=cycles))
    own = 2 * np.pi * 100
    omega = 2 * np.pi * 150
    steady = 1 / abs(own**2 + 1e6 - omega**2 + 0.02j * own * omega)
    amplitude = done.measures["relative_displacement_amplitude"].value
    told = [one for one in done.warnings if one.startswith(NOT_SETTLED_WARNING)]
    assert done.outcome == "stuck" and (abs(amplitude / steady - 1) < 0.01) == settled == (not told)
    assert settled or "drive.cycles = " in told[0]


def test_exact_the_cycles_that_are_named_let_a_motion_that_sticks_settle():
    told = next(
        one
        for one in pf.run(HOLDS.format(cycles=20)).warnings
        if one.startswith(NOT_SETTLED_WARNING)
    )
    cycles = float(told.rpartition("drive.cycles = ")[2])
    assert cycles < 600 and not any(
        one.startswith(NOT_SETTLED_WARNING) for one in pf.run(HOLDS.format(cycles=cycles)).warnings
    )
