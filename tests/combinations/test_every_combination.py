"""Every friction law with every effect: balance of energy, sign of dissipation, and the limit of a vanishing effect.

A combination runs once with an effect of a marked size, where its energies must balance and friction must dissipate, and
once with an effect so small that the motion must be that without it.
"""

from functools import cache

import pytest
from scene_runs import load_scene, run_scene
from scene_texts import THREE_CYCLES

LAWS = {
    "coulomb": 'law = "coulomb"\n',
    "tanh": 'law = "tanh"\nreference_speed = "5 mm/s"\n',
    "elastic-plastic": 'law = "elastic-plastic"\nbond_length = "2 um"\n',
    "stiffness": 'law = "elastic-plastic"\nstiffness = "1.7e7 N/m"\n',
    "nonlocal": 'law = "nonlocal"\nbond_length = "2 um"\n',
    "order 2": 'law = "nonlocal"\nbond_length = "2 um"\norder = 2\n',
    "report": 'law = "nonlocal"\nbond_length = "2 um"\nreading = "report"\n',
    "convolution": 'law = "convolution"\nbond_length = "100 um"\n',
    "iwan": 'law = "iwan"\nstiffness = "1.7e7 N/m"\nchi = -0.5\nbeta = 0.5\n',
    "bouc-wen": 'law = "bouc-wen"\nstiffness = "1.7e7 N/m"\nexponent = 1.5\n',
    "lugre": 'law = "lugre"\nstiffness = "1.7e7 N/m"\nstribeck_speed = "10 mm/s"\nkinetic = 0.25\n',
}
# Effects; "bench ..." are those of a prescribed slide.
EFFECTS = (
    "shear",
    "yaw",
    "shear and yaw",
    "lower",
    "load",
    "pitch",
    "shear and pitch",
    "grooves",
    "shear and grooves",
    "load and grooves",
    "cubic spring",
    "interfaces",
    "shear of interfaces",
    "wear",
    "bench with shear",
    "bench with lower",
    "bench with load",
    "bench with grooves",
    "bench with load and grooves",
)
# A patch so long that its slide over the pressure of the lower piece is small
LONG = {'length = "12.7 mm"': 'length = "127 mm"', '"1.2 mm"': '"12 mm"', '"10 m"': '"1000 m"'}
POINT = '[normal]\nload = "116 N"\n'
PATCH = """\
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "116 N"
element_size = "1.2 mm"
substrate = {{young = "{}", poisson = 0.3, density = "7800 kg/m^3"}}
[contact.crown]
radius = "{}"
"""
STEEL = PATCH.format("200 GPa", "10 m")
RIG = THREE_CYCLES + "[accuracy]\nsteps_per_cycle = 400\n"
BENCH = (
    '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "143 Hz"\ncycles = 2\n'
    "[accuracy]\nsteps_per_cycle = 400\n"
)
MASSES = """\
[structure]
masses = ["1 kg", "1 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "1e6 N/m"
[[structure.spring]]
between = [2, 1]
stiffness = "1e6 N/m"
"""
CARVED = '[{}.grooves]\nwavelength = "40 um"\namplitude = "{}"\n'
OSCILLATING = 'amplitude = "{}"\nfrequency = "143 Hz"\nphase = "1 rad"\n'
SHEAR = "[contact.shear]\n"
# Pieces a million times as stiff as steel, with the same gap relative to the approach
STIFF = PATCH.format("2e8 GPa", "1e7 m")
WORN = '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 1000\n'


def add_pitch(pitch: str) -> str:
    """Return the rig with a mode that pitches the patch."""
    return RIG.replace("slide = 1.0\n", f'slide = 1.0\npitch = "{pitch}"\n')


def make_scenes(effect: str, law: str) -> tuple[str, str, str]:
    """Return scenes with a marked effect, with a vanishing one, and without it; texts that are equal mean the same run."""
    keys = f"static = 0.3\n{LAWS[law]}"
    friction = f"[friction]\n{keys}"
    point, patch = POINT + friction, STEEL + friction
    plain = point + RIG
    lower = STEEL.replace("[contact.crown]\n", '[contact.crown]\non = "lower"\n')
    long = STEEL
    for before, after in LONG.items():
        long = long.replace(before, after)
    long_lower = long.replace("[contact.crown]\n", '[contact.crown]\non = "lower"\n')
    cubic = '[structure.stiffening]\ncubic = "{} N/m^3"\n[drive]'
    face = "structure.interface"

    def write_faces(contact: str, *, has_second: bool = True, second_load: str = "116 N") -> str:
        """Return two masses with an interface at each, or at the first one, that carries `contact`."""
        tables = [f"[[{face}]]\nbetween = [1, 0]\n{keys}{contact}"]
        if has_second:
            tables.append(
                f"[[{face}]]\nbetween = [2, 0]\n{keys}{contact}".replace("116 N", second_load)
            )
        return MASSES + "".join(tables) + RIG[RIG.index("[drive]") :]

    load = 'load = "116 N"\n'
    nested = STEEL.replace("[contact", f"[{face}.contact")
    stiff = STIFF.replace("[contact", f"[{face}.contact") + f"[{face}.contact.shear]\n"
    yawing = RIG.replace("slide = 1.0\n", 'slide = 1.0\nyaw = "{} rad/m"\n')
    area = (
        STEEL.replace('element_size = "1.2 mm"\n', "") + "[contact.area]\ncells = 32\n" + friction
    )
    table = {
        "shear": (STEEL + SHEAR + friction + RIG, STIFF + SHEAR + friction + RIG, patch + RIG),
        "yaw": (
            area + yawing.format(20), area + yawing.format(1e-6), area + RIG
        ),
        "shear and yaw": (
            area + SHEAR + yawing.format(20), area + SHEAR + yawing.format(1e-6), area + SHEAR + RIG
        ),
        "lower": (lower + friction + RIG, long_lower + friction + RIG, long + friction + RIG),
        "load": (
            POINT + OSCILLATING.format("60 N") + friction + RIG,
            POINT + OSCILLATING.format("1e-6 N") + friction + RIG,
            plain,
        ),
        "pitch": (patch + add_pitch("0.3 rad/m"), patch + add_pitch("1e-9 rad/m"), patch + RIG),
        "shear and pitch": (
            STEEL + SHEAR + friction + add_pitch("0.3 rad/m"),
            STIFF + SHEAR + friction + add_pitch("1e-15 rad/m"),
            patch + RIG,
        ),
        "grooves": (
            POINT + CARVED.format("normal", "1 um") + friction + RIG,
            POINT + CARVED.format("normal", "1e-6 um") + friction + RIG,
            plain,
        ),
        "shear and grooves": (
            STEEL + SHEAR + CARVED.format("contact", "1 um") + friction + RIG,
            STIFF + SHEAR + CARVED.format("contact", "1e-6 um") + friction + RIG,
            patch + RIG,
        ),
        "load and grooves": (
            POINT + OSCILLATING.format("60 N") + CARVED.format("normal", "1 um") + friction + RIG,
            POINT + OSCILLATING.format("1e-6 N") + CARVED.format("normal", "1 um") + friction + RIG,
            POINT + CARVED.format("normal", "1 um") + friction + RIG,
        ),
        "cubic spring": (
            point + RIG.replace("[drive]", cubic.format(1e15)),
            point + RIG.replace("[drive]", cubic.format(1e3)),
            plain,
        ),
        "interfaces": (
            write_faces(load),
            write_faces(load, second_load="1e-6 N"),
            write_faces(load, has_second=False),
        ),
        "shear of interfaces": (
            write_faces(nested + f"[{face}.contact.shear]\n"),
            write_faces(stiff),
            write_faces(nested),
        ),
        "wear": (patch + RIG + WORN, patch + RIG + WORN.replace("e-14", "e-30"), patch + RIG),
        "bench with shear": (
            STEEL + SHEAR + friction + BENCH, STIFF + SHEAR + friction + BENCH, patch + BENCH
        ),
        "bench with lower": (
            lower + friction + BENCH, long_lower + friction + BENCH, long + friction + BENCH
        ),
        "bench with load": (
            POINT + OSCILLATING.format("60 N") + friction + BENCH,
            POINT + OSCILLATING.format("1e-6 N") + friction + BENCH,
            point + BENCH,
        ),
        "bench with grooves": (
            POINT + CARVED.format("normal", "1 um") + friction + BENCH,
            POINT + CARVED.format("normal", "1e-6 um") + friction + BENCH,
            point + BENCH,
        ),
        "bench with load and grooves": (
            POINT + OSCILLATING.format("60 N") + CARVED.format("normal", "1 um") + friction + BENCH,
            POINT + OSCILLATING.format("60 N") + CARVED.format("normal", "1e-6 um") + friction + BENCH,
            POINT + OSCILLATING.format("60 N") + friction + BENCH,
        ),
    }  # fmt: skip
    # Points that stick rigidly need short steps.
    n_steps = 1600 if law in ("coulomb", "convolution") else 400
    steps = f"steps_per_cycle = {n_steps}"
    marked, vanishing, without = (
        text.replace("steps_per_cycle = 400", steps) for text in table[effect]
    )
    return marked, vanishing, without


@cache
def run_measures(text: str) -> dict:
    """Return the values of the measures of a scene, without error estimates."""
    measures = run_scene(text, estimate=False).measures
    return {name: measure.value for name, measure in measures.items()}


def test_stiffness_under_an_approach_has_the_loop_of_the_load():
    """A law with a stiffness has the same loop under the approach of a load as under the load, also at an interface."""
    distance = run_measures(STEEL)["approach"]
    rig = STEEL + "[friction]\nstatic = 0.3\n" + LAWS["stiffness"] + RIG
    for text in (rig, make_scenes("shear of interfaces", "stiffness")[0]):
        given = text.replace('load = "116 N"\n', f'approach = {{distance = "{distance!r} m"}}\n')
        assert given != text
        assert run_measures(given)["loop_area"] == pytest.approx(
            run_measures(text)["loop_area"], rel=1e-9
        )


LONG_TESTS = {("lower", "order 2"), ("pitch", "order 2")}  # combinations that .ci/run runs
COMBINATIONS = [
    pytest.param(effect, law, marks=pytest.mark.long if (effect, law) in LONG_TESTS else ())
    for effect in EFFECTS
    for law in LAWS
]


@pytest.mark.parametrize("effect, law", COMBINATIONS)
def test_law_with_effect(effect, law):
    """The energies balance, friction dissipates, and a vanishing effect leaves the motion as it is."""
    marked, vanishing, without = make_scenes(effect, law)
    found = run_measures(marked)
    work = found["friction_work"] if found.get("friction_work") else found["energy_dissipated"]
    assert found["energy_dissipated"] > 0
    assert abs(found["energy_balance"]) < 2e-3
    if law != "report":  # the law as printed creates energy
        assert found["energy_created"] <= 1e-3 * abs(work)

    # A whole node at the edge of the pressed area counts as loaded or not.
    tolerance = 1e-2 if law == "convolution" else 3e-3
    vanished, plain = run_measures(vanishing), run_measures(without)
    for name in ("loop_area", "friction_force_peak", "relative_displacement_amplitude"):
        if plain.get(name) is not None:
            assert vanished[name] == pytest.approx(plain[name], rel=tolerance), name


@pytest.mark.parametrize("law", ["elastic-plastic", "iwan", "tanh"])
def test_number_of_shear_modes_is_used_where_a_patch_has_no_elements(law):
    """A law without parallel elements behind elastic pieces takes accuracy.shear_modes; another one gets a remark."""
    scene = load_scene(make_scenes("shear", law)[0], "accuracy.shear_modes=7")
    assert (scene.accuracy.shear_modes == 7) == (law != "elastic-plastic")
    assert bool(scene.remarks) == (law == "elastic-plastic")
