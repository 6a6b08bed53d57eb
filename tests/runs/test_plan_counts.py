"""Plans agree with the run: sticking, and the measured probe."""

from time import perf_counter

import numpy as np
import pytest
from command_line import run_cli
from scene_runs import load_scene, run_scene
from scene_texts import COATED, COULOMB, KILOGRAM, POINT, SLIDE

import patchfem as pf
from patchfem import load, plan
from patchfem.core import PatchfemError
from patchfem.runs.probe import run_probe
from patchfem.runs.run import run

PROBED = COATED.replace("0.5 mm", "1 mm") + COULOMB + SLIDE + "cycles = 2\n"


def test_exact_probe_measures_what_the_plan_does_not_predict(tmp_path, monkeypatch):
    """`plan` predicts no time; with `--probe` it states the measured time of a run, in all and by stage, the static
    measures of this run, and what each setting multiplies."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.toml").write_text(PROBED)
    described = run_cli("plan", "a.toml", "--json").content
    for name in ("seconds", "bytes", "compile_seconds", "steps"):
        assert described[name] is None
    begin = perf_counter()
    probed = run_cli("plan", "a.toml", "--probe", "--json").content
    elapsed = perf_counter() - begin
    stages = probed["probe"]["seconds"]
    assert 0 < stages["contact"] <= stages["total"] == probed["seconds"] <= elapsed
    found = run(load(PROBED), estimate=False).measures["normal_stiffness"].value
    assert probed["probe"]["normal_stiffness"] == pytest.approx(found, rel=1e-9)
    text = " ".join(probed["probe"]["sentences"])
    assert "contact.element_size" in text and "drive.cycles" not in text
    # a motion that takes less than half a millisecond takes no measurable time
    assert ("slide.cycles" in text) == (stages["bench"] > 0)


FORCED = (
    POINT.replace("26 lbf", "100 N")
    + COULOMB.replace("0.3", "0.9")
    + KILOGRAM
    + '[drive]\nkind = "force"\nfrequency = "50 Hz"\nforce = "100 N"\ncycles = 200\n'
)


@pytest.mark.parametrize("kinetic, sticks", [(0.2, False), (0.85, True)])
def test_exact_kinetic_coefficient_decides_about_sticking(kinetic, sticks):
    """Whether a sliding block sticks again depends on the kinetic coefficient, in the run and in the verdict of the plan."""
    changes = f"friction.kinetic={kinetic}; structure.mode.axial.frequency=50 Hz; structure.mode.axial.damping=0.02"
    scene = load_scene(FORCED, changes)
    run_plan = plan(scene)
    (sentence,) = [line for line in run_plan.verdict if line.startswith("D = 0.9 is below 1")]
    assert ("alternates between stick and slip" in sentence) == sticks
    assert ("does not limit the amplitude" in sentence) != sticks
    assert (run_scene(FORCED, changes).measures["stick_fraction"].value > 0) == sticks
    assert run_plan.groups["knee_force"] == pytest.approx(4 / np.pi * kinetic * 100)


def test_exact_plan_of_a_sweep_is_that_of_its_first_case():
    """A scene with [sweep] has the plan of its first case, also for a key that the scene sets itself, and says so."""
    cases = FORCED + '[sweep]\n"drive.force" = ["25 N", "50 N"]\n"friction.static" = [0.5, 0.4]\n'
    run_plan = plan(load(cases))
    assert (
        run_plan.groups == plan(load_scene(FORCED, "drive.force=25 N; friction.static=0.5")).groups
    )
    assert (
        "first of 4 cases of [sweep], drive.force=25 N, friction.static=0.5;" in run_plan.verdict[0]
    )


def test_refuses_to_run_the_plan_of_a_sweep():
    """A run of the plan of a scene with [sweep] would leave out all cases but the first; with the swept keys set it runs.

    The probe measures the first case, as its plan says.
    """
    cases = FORCED + '[sweep]\n"drive.force" = ["25 N", "50 N"]\n'
    run_plan = pf.plan(cases)
    for run_it in (run, pf.run):
        with pytest.raises(PatchfemError, match=r"sweep.*first of 2 cases.*use `patchfem sweep`"):
            run_it(run_plan)
    chosen = pf.run(pf.plan(cases, **{"drive.force": "50 N"}))
    single = run_scene(FORCED, "drive.force=50 N")
    name = "friction_force_peak"
    assert chosen.measures[name].value == single.measures[name].value
    assert run_probe(run_plan).seconds["total"] > 0


def test_exact_probe_of_a_curve_names_the_curve():
    """The time of a response curve is that of the curve, not of its peak."""
    sweep = 'waveform = "sweep"\nfrom = "40 Hz"\nto = "60 Hz"\nrate = "1 Hz/s"\n'
    drive = FORCED.replace('frequency = "50 Hz"\nforce', sweep + "force").replace(
        "cycles = 200\n", ""
    )
    text = " ".join(run_probe(plan(load(drive + '[accuracy]\nmethod = "harmonic"\n'))).sentences)
    assert "of it for the response curve" in text and "drive.cycles" not in text


ELASTIC_BLOCK = """
[structure]
moving_mass = "0.3 kg"
mode = [{name = "blade", frequency = "200 Hz", damping = 0.001, slide = 1.0}]
[friction]
law = "elastic-plastic"
static = 0.35
stiffness = "8 N/um"
[normal]
load = "20 N"
[drive]
kind = "force"
waveform = "sweep"
from = "150 Hz"
to = "1000 Hz"
rate = "1 Hz/s"
force = "2 N"
[accuracy]
method = "harmonic"
"""


@pytest.mark.parametrize(
    "values, words",
    [
        ({}, "may slip near 845.9 Hz, its natural frequency while it sticks"),
        ({"drive.to": "700 Hz"}, "friction should hold the block"),
        ({"drive.to": "700 Hz", "normal.load": "7 N"}, "may slip near 845.9 Hz"),
        ({"structure.mode.0.frequency": "0 Hz"}, "may slip near 821.9 Hz"),
    ],
)
def test_exact_elastic_interface_slips_near_resonance(values, words):
    """Friction beyond the drive holds a block on an elastic interface, except near the resonance while it sticks."""
    assert any(words in sentence for sentence in plan(load(ELASTIC_BLOCK, **values)).verdict)
