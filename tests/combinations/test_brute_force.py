"""Brute force (`tests/support/brute`) agrees with closed forms, with solve_ivp, and with the engines where they run."""

import numpy as np
import pytest
from brute import systems
from scene_runs import run_scene
from scipy.integrate import quad, solve_ivp

STATIC, LOAD, LENGTH, AMPLITUDE = 0.3, 116.0, 1e-6, 5e-6  # -, N, m, m
LIMIT = STATIC * LOAD
OMEGA = 2 * np.pi * 143
STIFFNESS = LIMIT / LENGTH
POINT = f'[normal]\nload = "{LOAD} N"\n'
BENCH = '[slide]\nkind = "sine"\namplitude = "5 um"\nfrequency = "143 Hz"\ncycles = 2\n'
RIG = """\
[structure]
moving_mass = "0.884 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = 0.01
slide = 1.0
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "5 g"
cycles = 6
"""
PATCH = """\
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "116 N"
element_size = "0.7 mm"
substrate = "steel"
[contact.crown]
radius = "8 m"
"""
SHEAR = "[contact.shear]\n"
GROOVES = '[{}.grooves]\nwavelength = "80 um"\namplitude = "1 um"\n'
AMPLITUDE_OF_LOAD = 'amplitude = "60 N"\nfrequency = "286 Hz"\nphase = "1 rad"\n'
PITCH = RIG.replace("slide = 1.0", 'slide = 1.0\npitch = "0.4 rad/m"\nnormal = 0.002')
CUBIC = '[structure.stiffening]\ncubic = "1e15 N/m^3"\n[drive]'
LAWS = {
    "coulomb": "",
    "tanh": 'reference_speed = "5 mm/s"\n',
    "elastic-plastic": 'bond_length = "1 um"\n',
    "stiffness": f'stiffness = "{STIFFNESS} N/m"\n',
    "nonlocal": 'bond_length = "1 um"\n',
    "convolution": 'bond_length = "1 mm"\n',
    "iwan": f'stiffness = "{STIFFNESS} N/m"\nchi = -0.5\nbeta = 0.5\n',
    "bouc-wen": f'stiffness = "{STIFFNESS} N/m"\nexponent = 2.0\n',
    "lugre": f'stiffness = "{STIFFNESS} N/m"\nstribeck_speed = "10 mm/s"\nkinetic = 0.25\n'
    'micro_damping = "50 N s/m"\nviscous = "20 N s/m"\n',
    "dahl": f'stiffness = "{STIFFNESS} N/m"\nstribeck_speed = "1 m/s"\n',
    # friction that exceeds static times the load
    "viscous": f'stiffness = "{STIFFNESS} N/m"\nstribeck_speed = "1 m/s"\nviscous = "2000 N s/m"\n',
}


def write_law(name: str) -> str:
    """Return the table of a friction law."""
    law = {"dahl": "lugre", "viscous": "lugre", "stiffness": "elastic-plastic"}.get(name, name)
    return f'[friction]\nlaw = "{law}"\nstatic = {STATIC}\n{LAWS[name]}'


def find_loop_of_iwan() -> float:
    """Return the loop area of Segalman's density beyond its last slider, by Masing's rule from the first loading."""
    chi, beta = -0.5, 0.5
    phi_max = LENGTH * (1 + beta) / (beta + (chi + 1) / (chi + 2))

    def missing_force(x: float) -> float:
        """Return the part of the limit that the sliders have not reached at a displacement x of phi_max."""
        scale = LIMIT / (beta + (chi + 1) / (chi + 2))
        return LIMIT - scale * ((beta + 1) * x - x ** (chi + 2) / (chi + 2))

    loss = phi_max * quad(missing_force, 0, 1)[0]
    return 4 * LIMIT * AMPLITUDE - 8 * loss


LOOPS = {
    "coulomb": 4 * LIMIT * AMPLITUDE,
    "elastic-plastic": 4 * LIMIT * (AMPLITUDE - LENGTH),
    "nonlocal": 4 * LIMIT * (AMPLITUDE - LENGTH * np.tanh(AMPLITUDE / LENGTH)),
    "dahl": 4 * LIMIT * (AMPLITUDE - LENGTH * np.tanh(AMPLITUDE / LENGTH)),
    "iwan": find_loop_of_iwan(),
    "tanh": LIMIT
    * AMPLITUDE
    * quad(lambda a: np.cos(a) * np.tanh(OMEGA * AMPLITUDE * np.cos(a) / 5e-3), 0, 2 * np.pi)[0],
}


@pytest.mark.parametrize("law", LOOPS)
def test_loop_has_its_closed_form(law):
    """The loop area of a point on a sinusoidal path agrees with the closed form of each law within 1e-4."""
    found = systems.find_reference(POINT + write_law(law) + BENCH, 4000)
    assert found.n_unsolved == 0
    assert found.values["loop_area"] == pytest.approx(LOOPS[law], rel=1e-4)


def test_dahl_points_behind_compliance_agree_with_solve_ivp():
    """Two points of Dahl's law behind a full compliance matrix follow the integrated rate equations within 1e-5."""
    compliance = np.array([[3e-8, 1e-8], [1e-8, 2e-8]])
    loads = np.array([40.0, 76.0])
    gain = STATIC / LENGTH * loads
    signs = [np.array([a, b]) for a in (1, -1) for b in (1, -1)]

    def find_rates(time, z):
        """Return dz/dt = v (1 - z sgn(v)/length), with the velocities v = q' - C gain dz/dt of both points."""
        for sign in signs:
            factor = 1 - sign * z / LENGTH
            matrix = np.eye(2) + compliance * (gain * factor)
            v = np.linalg.solve(matrix, np.full(2, AMPLITUDE * OMEGA * np.cos(OMEGA * time)))
            if (v * sign >= 0).all():
                break
        return v * factor

    time = np.linspace(0, 2 / 143, 801)
    solution = solve_ivp(
        find_rates,
        (0, time[-1]),
        np.zeros(2),
        "DOP853",
        time,
        rtol=1e-10,
        atol=1e-16,
        max_step=2e-5,
    )
    force = gain @ solution.y

    tables = {"slide": {"amplitude": "5 um", "frequency": "143 Hz"}}
    structure = systems.make_structure(tables, time)
    kind, numbers, cells = systems.make_law(
        {
            "law": "lugre",
            "static": STATIC,
            "stiffness": f"{STIFFNESS} N/m",
            "stribeck_speed": "1 m/s",
        },
        LOAD,
    )
    points = systems.Points(
        np.zeros(2, int),
        np.full(2, kind),
        np.tile(numbers, (2, 1)),
        np.tile(cells, (2, 1, 1)),
        np.stack([loads, 0 * loads, 0 * loads], axis=1),
        np.ones((2, 2)),
        np.zeros(1),
        compliance,
    )
    constant = systems.make_constant_loads(loads, time.size)
    samples = np.zeros((time.size, 3))
    assert systems.march(points, structure, constant, time[1], np.zeros(0), samples) == 0
    assert np.abs(samples[:, 1] - force).max() < 1e-4 * LIMIT


def test_tanh_rig_agrees_with_solve_ivp():
    """A mode with the law tanh follows the integrated equation of motion within 2e-4."""

    def find_rates(time, state):
        """Return velocity and acceleration of the mode."""
        x, v = state
        friction = LIMIT * np.tanh(v / 5e-3) / 0.884
        drive = 5 * 9.80665 * np.sin(OMEGA * time)
        return v, -drive - friction - 2 * 0.01 * OMEGA * v - OMEGA**2 * x

    time = np.linspace(5 / 143, 6 / 143, 2001)
    solution = solve_ivp(find_rates, (0, time[-1]), (0, 0), "Radau", time, rtol=1e-9, atol=1e-13)
    x, v = solution.y
    area = np.trapezoid(LIMIT * np.tanh(v / 5e-3) * v, time)
    found = systems.find_reference(POINT + write_law("tanh") + RIG, 2000)
    assert found.values["loop_area"] == pytest.approx(area, rel=2e-4)
    assert found.values["relative_displacement_amplitude"] == pytest.approx(np.ptp(x) / 2, rel=2e-4)


# Combinations that run: name -> (scene without its law, steps per cycle, laws)
SUPPORTED = {
    "rig": (POINT + "{}" + RIG, 2000, ("coulomb", "elastic-plastic", "iwan", "bouc-wen", "lugre")),
    "load": (
        POINT + AMPLITUDE_OF_LOAD + "{}" + RIG,
        8000,
        ("coulomb", "tanh", "nonlocal", "stiffness", "iwan", "bouc-wen", "lugre"),
    ),
    "load and cubic spring": (
        POINT + AMPLITUDE_OF_LOAD + "{}" + RIG.replace("[drive]", CUBIC),
        2000,
        ("elastic-plastic", "nonlocal", "coulomb"),
    ),
    "shear": (
        PATCH + SHEAR + "{}" + RIG,
        400,
        (
            "coulomb",
            "elastic-plastic",
            "nonlocal",
            "convolution",
            "tanh",
            "iwan",
            "bouc-wen",
            "lugre",
        ),
    ),
    "pitch": (
        PATCH + "{}" + PITCH,
        400,
        ("coulomb", "convolution", "tanh", "nonlocal", "stiffness", "iwan", "lugre"),
    ),
    "pitch and shear": (
        PATCH + SHEAR + "{}" + PITCH,
        400,
        ("elastic-plastic", "nonlocal", "convolution"),
    ),
    "grooves": (
        POINT + GROOVES.format("normal") + "{}" + RIG,
        2000,
        ("tanh", "elastic-plastic", "iwan", "bouc-wen", "viscous"),
    ),
    "grooves and cubic spring": (
        POINT + GROOVES.format("normal") + "{}" + RIG.replace("[drive]", CUBIC),
        2000,
        ("coulomb", "tanh", "elastic-plastic", "bouc-wen"),
    ),
    "grooves and load": (
        POINT + AMPLITUDE_OF_LOAD + GROOVES.format("normal") + "{}" + RIG,
        4000,
        ("coulomb", "tanh", "elastic-plastic", "nonlocal", "iwan"),
    ),
    "grooves, shear and holder": (
        PATCH
        + '[contact.holder]\ntangential_stiffness = "1e8 N/m"\n'
        + SHEAR
        + GROOVES.format("contact")
        + "{}"
        + BENCH,
        400,
        ("coulomb", "elastic-plastic", "nonlocal", "convolution", "tanh"),
    ),
    "lower": (
        PATCH.replace('"8 m"', '"8 m"\non = "lower"') + "{}" + RIG,
        400,
        ("nonlocal", "convolution", "tanh", "iwan"),
    ),
    "bench": (
        POINT + AMPLITUDE_OF_LOAD + "{}" + BENCH,
        2000,
        ("stiffness", "iwan", "bouc-wen", "lugre"),
    ),
    "bench with grooves and load": (
        POINT + AMPLITUDE_OF_LOAD + GROOVES.format("normal") + "{}" + BENCH,
        4000,
        ("coulomb", "tanh", "stiffness", "bouc-wen", "lugre"),
    ),
    "bench with shear": (
        PATCH + SHEAR + "{}" + BENCH,
        400,
        ("convolution", "tanh", "iwan", "bouc-wen", "lugre"),
    ),
    "bench with lower": (
        PATCH.replace('"8 m"', '"8 m"\non = "lower"') + SHEAR + "{}" + BENCH,
        400,
        ("coulomb", "convolution", "elastic-plastic", "bouc-wen"),
    ),
}
LONG = {("grooves and cubic spring", "tanh")}  # cases that .ci/run runs
CASES = [
    pytest.param(name, law, marks=pytest.mark.long if (name, law) in LONG else ())
    for name, row in SUPPORTED.items()
    for law in row[2]
]


@pytest.mark.parametrize("name, law", CASES)
def test_agrees_with_engines(name, law):
    """Measures of combinations that the engines run agree within the sum of both errors."""
    text, steps, _ = SUPPORTED[name]
    text = text.format(write_law(law))
    reference = systems.find_reference(text, steps)
    assert reference.n_unsolved == 0
    measures = run_scene(text).measures
    names = [one for one in reference.values if one in measures]
    assert "loop_area" in names
    for one in names:
        measure = measures[one]
        doubt = reference.doubts[one] + 2e-4 * abs(measure.value)
        assert abs(measure.value - reference.values[one]) <= measure.error + doubt, one


def test_start_at_full_speed_does_not_overshoot():
    """Pieces that relax within a few steps after a start at full speed keep the force below that of the speed."""
    text = PATCH + SHEAR + write_law("tanh") + BENCH
    peaks = [
        run_scene(text, f"accuracy.steps_per_cycle={n}", estimate=False)
        .measures["friction_force_peak"]
        .value
        for n in (400, 6400)
    ]
    assert peaks[0] == pytest.approx(peaks[1], rel=3e-4)  # 2e-2 by the formula of order 2 alone
