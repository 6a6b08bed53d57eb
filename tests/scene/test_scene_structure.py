"""[structure] with masses, matrices or initial conditions: linear runs compared with direct solutions, and refusals."""

from dataclasses import replace

import numpy as np
import pytest
from scene_texts import COULOMB, LINEAR, POINT, STRUCTURE, get_only_mistake

import patchfem as pf
from patchfem.model import compute_named_motions
from patchfem.model.structure import build_modes, compute_initial_state
from patchfem.runs.plan import plan
from patchfem.runs.run import run
from patchfem.scene import load, loads

MASSES = """\
[structure]
masses = ["2 kg", "1 kg"]
output_mass = 2
[[structure.spring]]
between = [1, 0]
stiffness = "3e5 N/m"
[[structure.spring]]
between = [1, 2]
stiffness = "1e5 N/m"
[[structure.damper]]
between = [1, 0]
coefficient = "30 N s/m"
[[structure.damper]]
between = [1, 2]
coefficient = "10 N s/m"
[drive]
kind = "base"
frequency = "40 Hz"
acceleration = "2 m/s^2"
cycles = 300
"""
RUB = """\
[[structure.interface]]
between = [2, 0]
law = "coulomb"
static = 0.3
load = "10 N"
"""
M, K, C = (
    np.diag([2.0, 1.0]),
    np.array([[4e5, -1e5], [-1e5, 1e5]]),
    np.array([[40.0, -10], [-10, 10]]),
)


def with_drive(text, *sets, **drive):
    """Return a scene with other values of its drive, without checking them."""
    scene = loads(text, sets=sets)
    return replace(scene, drive=scene.drive.model_copy(update=drive))


def test_exact_linear_masses_agree_with_direct_solution():
    """Amplitude and acceleration of mass 2 agree with (K + i w C - w^2 M)^-1 M r a within 1e-9 and 1e-6."""
    result = run(plan(loads(MASSES)))
    w = 2 * np.pi * 40
    x = np.linalg.solve(K + 1j * w * C - w * w * M, -M @ np.ones(2) * 2.0)
    value = {name: m.value for name, m in result.measures.items()}
    assert value["relative_displacement_amplitude"] == pytest.approx(abs(x[1]), rel=1e-9)
    assert value["absolute_acceleration_peak"] == pytest.approx(abs(2.0 - w * w * x[1]), rel=1e-6)
    assert value["energy_balance"] < 1e-12 and result.outcome == "steady"
    both = compute_named_motions(result.plan.model.rig.modes, result.response.modal)
    np.testing.assert_allclose(both[:, 1], result.response.output, atol=1e-15)


def test_exact_force_acts_on_given_mass():
    """The force of a drive acts on the given mass, else on the output."""
    scene = with_drive(MASSES, kind="force", force=7.0, mass=None)
    found = build_modes(scene)
    np.testing.assert_allclose(
        found.shapes @ found.base, -np.linalg.solve(M, [0, 1]), rtol=1e-12, atol=1e-15
    )
    found = build_modes(with_drive(MASSES, kind="force", force=7.0, mass=1))
    np.testing.assert_allclose(
        found.shapes @ found.base, -np.linalg.solve(M, [1, 0]), rtol=1e-12, atol=1e-15
    )
    scene = with_drive(LINEAR, "structure.mode.second.output=0.5", kind="force")
    assert build_modes(scene).base.tolist() == [-0.8, -0.5]


def test_exact_initial_conditions_of_scene():
    """Initial displacements and velocities of a scene agree with the given values.

    They come from [structure.start], a free decay or a step.
    """
    begin = '[structure.start]\ndisplacement = ["1 mm", "-2 mm"]\nvelocity = ["0 m/s", "3 mm/s"]\n'
    scene = loads(MASSES + begin)
    found = build_modes(scene)
    start = compute_initial_state(scene, found)
    np.testing.assert_allclose(found.shapes @ start.z, [1e-3, -2e-3], rtol=1e-13)
    np.testing.assert_allclose(found.shapes @ start.v, [0, 3e-3], rtol=1e-13, atol=1e-18)
    free = with_drive(MASSES, kind="free", displacement=1e-3)
    np.testing.assert_allclose(
        found.shapes @ compute_initial_state(free, found).z, [0, 1e-3], atol=1e-18
    )
    free = with_drive(MASSES, kind="free", displacement=1e-3, mass=1)
    np.testing.assert_allclose(
        found.shapes @ compute_initial_state(free, found).z, [1e-3, 0], atol=1e-18
    )
    step = with_drive(MASSES, waveform="step", displacement=1e-3, acceleration=None)
    np.testing.assert_allclose(
        found.shapes @ compute_initial_state(step, found).z, [-1e-3, -1e-3], rtol=1e-13
    )
    assert not compute_initial_state(loads(MASSES), found).z.any()
    one = with_drive(STRUCTURE, kind="free", displacement=1e-3)
    assert compute_initial_state(one, build_modes(one)).z.tolist() == [1e-3]
    assert "structure.start" in scene.effect_names()
    assert loads(scene.resolved()).structure.start == scene.structure.start


@pytest.mark.parametrize("sets, key, says", [
    (["structure.spring.0.between=[3, 0]"], "structure.spring[1].between", "no mass 3: structure.masses has 2"),
    (["structure.damper.0.between=[0, 0]"], "structure.damper[1].between", "joins the base to itself"),
    (["structure.interface.0.load=-1 N"], "structure.interface[1].load", "must be >= 0"),
    (["structure.output_mass=3"], "structure.output_mass", "there is no mass 3"),
    (["structure.masses=[]"], "structure.masses", "not an empty array"),
    (["structure.start.displacement=['1 mm']"], "structure.start.displacement", "the number of values is 1, but one "
                                                                                "value for each mass"),
    (["structure.start={}"], "structure.start.displacement", "this key or velocity is needed"),
    (["structure.slide_at=12:+x"], "structure.slide_at", "names a place in a universal file"),
    (["drive={kind = 'force', mass = 3, force = '1 N', frequency = '1 Hz', cycles = 9}"], "drive.mass", "no mass 3"),
    (["drive={kind = 'free', displacement = '1 mm', cycles = 9}", "structure.start.velocity=['1 m/s', '0 m/s']"],
     "structure.start", "[structure.start] and drive.displacement exclude each other"),
])  # fmt: skip
def test_refuses_unknown_masses(sets, key, says):
    """Springs, dampers and interfaces between unknown masses are refused."""
    message = get_only_mistake(RUB + MASSES, *sets)
    assert message.startswith(f"--set: {key}: ") and says in message


@pytest.mark.parametrize("text, key, says", [
    (MASSES + '[normal]\nload = "1 N"\n' + COULOMB, "structure.interface",
     "write [[structure.interface]]"),
    (MASSES + '[structure.bonded]\nstiffness = "1 N/m"\n', "structure.bonded", "there are 0 interfaces"),
    (RUB + RUB + MASSES + '[structure.bonded]\nstiffness = "1 N/m"\n', "structure.bonded", "there are 2 interfaces"),
    (STRUCTURE + '[structure.start]\nvelocity = ["1 m/s", "2 m/s"]\n', "structure.start.velocity",
     "the number of values is 2, but one value for each mode is needed"),
    (STRUCTURE.replace("cycles", "mass = 1\ncycles").replace('"base"', '"force"').replace(
        "acceleration", 'force = "1 N"\nacceleration'), "drive.mass", "leave drive.mass out"),
    (STRUCTURE[:STRUCTURE.index("[[")].replace("moving", 'file = "rig.csv"\nmoving') +
     STRUCTURE[STRUCTURE.index("[drive]"):], "structure.file", "the name ends in '.csv'"),
])  # fmt: skip
def test_refuses_incompatible_structure_keys(text, key, says):
    """Keys of a structure that exclude each other are refused."""
    message = get_only_mistake(text)
    assert f": {key}: " in message and says in message


def test_always_free_mass_is_allowed():
    """A mass without a spring is allowed: its relative motion is minus that of the base, plus a uniform drift."""
    scene = loads(MASSES[: MASSES.index("[[structure.spring")] + MASSES[MASSES.index("[drive]") :])
    result = run(plan(scene))
    # the relative motion is minus that of the base, plus a uniform drift from rest
    base = 2.0 / (2 * np.pi * 40) ** 2
    time = result.response.time
    want = base * (np.sin(2 * np.pi * 40 * time) - 2 * np.pi * 40 * time)
    np.testing.assert_allclose(result.response.output, want, atol=1e-9 * np.abs(want).max())


FILE = """\
[structure]
file = "rig.npz"
[drive]
kind = "base"
frequency = "40 Hz"
acceleration = "2 m/s^2"
cycles = 300
"""


def write_scene(folder, text):
    """Write a scene into a folder and load it."""
    (folder / "scene.toml").write_text(text, "utf-8")
    return load(folder / "scene.toml")


def test_exact_matrices_equal_masses(tmp_path):
    """Matrices M, K and C from a file give the same measures as the same rig given by masses, within 1e-9."""
    np.savez(tmp_path / "rig.npz", M=M, K=K, C=C, output=[0.0, 1.0])
    ours = run(plan(write_scene(tmp_path, FILE)))
    for name, measure in run(plan(loads(MASSES))).measures.items():
        found = ours.measures[name]
        assert found.reason == measure.reason, name
        if not measure.reason:
            assert found.value == pytest.approx(measure.value, rel=1e-9, abs=1e-12), name
    scene = write_scene(tmp_path, RUB + FILE)
    np.testing.assert_allclose(
        build_modes(scene).interfaces, build_modes(loads(RUB + MASSES)).interfaces, rtol=1e-9
    )
    assert scene.kind == "rig"


@pytest.mark.parametrize("output", ["", "output = 0.5\n"])
def test_exact_force_drive_acts_where_first_mode_moves_by_one(output):
    """At resonance a force F at the output point moves it by phi^2 F/(2 zeta m omega^2), where phi is 1 by default.

    A note states the default where it decides where the force acts.
    """
    text = (
        '[structure]\nmoving_mass = "1.3 kg"\n[[structure.mode]]\nname = "first"\nfrequency = "212 Hz"\n'
        f'damping = 0.02\nslide = 0.0118\n{output}[drive]\nkind = "force"\nfrequency = "212 Hz"\nforce = "10 N"\n'
        'cycles = 400\n[accuracy]\nmethod = "harmonic"\n'
    )
    result = pf.run(text)
    motion = 0.5 if output else 1.0
    amplitude = motion**2 * 10 / (2 * 0.02 * 1.3 * (2 * np.pi * 212) ** 2)
    measure = result.measures["relative_displacement_amplitude"]
    assert measure.value == pytest.approx(amplitude, rel=1e-9)
    notes = [note for note in result.notes if "(default of `output`)" in note]
    assert len(notes) == (not output)
    assert all("the patch moves by 0.0118" in note for note in notes)


@pytest.mark.parametrize("base, n_notes", [("", 1), ("base=0.5", 0)])
def test_note_states_default_of_base(base, n_notes):
    """Unless `base` is given, a note states that the base drives the first mode by its `slide`."""
    scene = loads(
        LINEAR,
        sets=["structure.mode.axial.slide=0.1", *(f"structure.mode.axial.{base}",) * bool(base)],
    )
    assert sum("participation 0.1" in note for note in scene.notes) == n_notes


@pytest.mark.parametrize("method", ["exact", "harmonic"])
def test_exact_zero_friction_moves_as_no_friction(method):
    """Coulomb friction with static = 0 leaves the amplitude of the rig unchanged."""
    sets = [f"accuracy.method={method}"]
    rubbing = run(plan(loads(POINT + COULOMB + STRUCTURE, sets=[*sets, "friction.static=0"])))
    free = run(plan(loads(STRUCTURE, sets=sets)))
    name = "relative_displacement_amplitude"
    assert rubbing.measures[name].value == pytest.approx(free.measures[name].value, rel=1e-8)
