"""Interfaces with patches of their own agree with a rig of one patch and with an independent
integration.

The order of the interfaces, their errors, files and refusals are checked as well.
"""

import json

import numpy as np
import pytest
import xarray as xr
from command_line import read_json, read_page, run_cli, run_successfully
from scene_runs import assert_agree, find_sentences
from yielding_points import solve_after_each_yield

import patchfem as pf
from patchfem.runs.patch import faces

SPRING, DAMPER, MASS = 1e6, 10.0, 0.5
LAW = 'law = "coulomb"\nstatic = 0.3\n'
STIFF_LAW = 'law = "elastic-plastic"\nstatic = 0.3\nbond_length = "50 nm"\n'
DRIVE = '[drive]\nkind = "base"\nfrequency = "240 Hz"\nacceleration = "8 g"\ncycles = 10\n'


def format_contact(table: str, load: float, radius: float) -> str:
    """Return the tables of a crowned patch with shear."""
    return (
        f'[{table}]\nlength = "10 mm"\nwidth = "10 mm"\nheight = "8 mm"\nload = "{load} N"\nsubstrate = "steel"\n'
        f'[{table}.crown]\nradius = "{radius} m"\n[{table}.shear]\n'
    )


def format_interface(between: str, load: float, radius: float) -> str:
    """Return an interface with a patch."""
    return f"[[structure.interface]]\nbetween = {between}\n{LAW}" + format_contact(
        "structure.interface.contact", load, radius
    )


def format_spring_and_damper(mass: int, other_mass: int) -> str:
    """Return a spring and a damper between two masses."""
    pair = f"between = [{mass}, {other_mass}]\n"
    return (
        f'[[structure.spring]]\n{pair}stiffness = "{SPRING} N/m"\n[[structure.damper]]\n{pair}'
        f'coefficient = "{DAMPER} N s/m"\n'
    )


def format_masses(count: int) -> str:
    """Return the table of a structure of equal masses."""
    return f"[structure]\nmasses = {json.dumps([f'{MASS} kg'] * count)}\n"


SINGLE_INTERFACE = (
    format_masses(1) + format_spring_and_damper(1, 0) + format_interface("[1, 0]", 100, 0.5) + DRIVE
)
CHAIN = (
    format_masses(2)
    + format_spring_and_damper(1, 0)
    + format_spring_and_damper(2, 1)
    + format_interface("[1, 0]", 100, 0.5)
    + format_interface("[2, 1]", 60, 2.0)
    + DRIVE
    + "[accuracy]\ntolerance = 1e-2\n"
)


def format_equivalent_rig(law: str = LAW) -> str:
    """Return the rig with [contact] whose mode is the mass of SINGLE_INTERFACE on its spring."""
    return (
        format_contact("contact", 100, 0.5)
        + f'[friction]\n{law}[structure]\nmoving_mass = "{MASS} kg"\n'
        '[[structure.mode]]\nname = "a"\nslide = 1.0\n'
        f'frequency = "{float(np.sqrt(SPRING / MASS)) / (2 * np.pi)!r} Hz"\n'
        f"damping = {DAMPER / (2 * float(np.sqrt(SPRING * MASS)))!r}\n" + DRIVE
    )


# A balance of a patch takes seconds, so that it is computed on a coarser mesh.
@pytest.mark.parametrize("law, method", [(STIFF_LAW, "auto"), (LAW, "march"), (LAW, "harmonic")])
def test_exact_single_interface_agrees_with_contact_rig(law, method):
    """Every measure and error of a scene agrees between both ways to write it: as an interface and
    as [contact]."""
    accuracy = (
        f'[accuracy]\nmethod = "{method}"\ntolerance = {1e-2 if method == "harmonic" else 1e-3}\n'
    )
    interface = pf.run(SINGLE_INTERFACE.replace(LAW, law) + accuracy)
    rig = pf.run(format_equivalent_rig(law) + accuracy)
    assert interface.outcome == rig.outcome and interface.measures.keys() == rig.measures.keys()
    for name, expected in rig.measures.items():
        actual = interface.measures[name]
        if expected.value is None:
            assert actual.value is None
            continue
        magnitude = max(abs(expected.value), expected.error or 0.0, expected.floor)
        assert actual.value == pytest.approx(expected.value, abs=1e-9 * magnitude), name
        assert (actual.error or 0.0) == pytest.approx(
            expected.error or 0.0, rel=1e-6, abs=1e-9 * magnitude
        ), name
    if method != "march":  # A march stores only the fields of the pressed state.
        fields = interface.faces[0].fields
        for name in ("time", "normal_stress", "shear_stress", "slip", "status"):
            magnitude = np.abs(rig.fields[name]).max()
            np.testing.assert_allclose(
                fields[name], rig.fields[name], atol=1e-9 * magnitude, err_msg=name
            )
    slip_amplitude = interface.measures["slip_amplitude"]
    assert slip_amplitude.value > 100 * slip_amplitude.error > 0


@pytest.fixture(scope="module")
def chain_result():
    """Return the result of two masses with a patch at each interface."""
    return pf.run(CHAIN)


def integrate_chain(model, cycles: int, steps: int) -> tuple:
    """Return the displacement of mass 1 [m] and the friction work [J] after some cycles of CHAIN,
    by leapfrog steps.

    The patches are nodes that slip one after the other.
    """
    # Stiffness and yield displacement of the parallel elements of each patch
    elements = []
    for interface in model.rig.friction.interfaces:
        patch = faces.solve_contact_on_meshes(interface, model.accuracy.tolerance)[0]
        in_contact = patch.active
        load = patch.pressure.sigma_n * patch.pieces.interface.weight
        slides, rates = solve_after_each_yield(
            patch.slip_compliance[np.ix_(in_contact, in_contact)],
            interface.numbers.static * load[in_contact],
        )
        elements.append((-np.diff(rates.sum(axis=1), append=0.0), slides))
    rows = np.array([[1.0, 0.0], [-1.0, 1.0]])
    omega = 2 * np.pi * 240
    peak = 8 * 9.80665
    h = 1 / (240 * steps)
    displacement = np.zeros(2)
    velocity = np.zeros(2)
    work = 0.0
    element_forces = [np.zeros(k.size) for k, _ in elements]
    total = np.zeros(2)
    for n in range(cycles * steps):
        previous = total
        velocity_at_step = velocity
        # The velocity at the step is the mean of those half a step before and after it.
        for _ in range(3):
            force = (
                -SPRING * rows.T @ rows @ displacement
                - DAMPER * rows.T @ rows @ velocity_at_step
                - rows.T @ total
            )
            next_velocity = velocity + h * (force / MASS - peak * np.sin(omega * n * h)) * (
                0.5 if n == 0 else 1.0
            )
            velocity_at_step = (velocity + next_velocity) / 2 if n else np.zeros(2)
        velocity = next_velocity
        displacement = displacement + h * velocity
        increments = rows @ velocity * h
        total = np.zeros(2)
        for k, (stiffness, limits) in enumerate(elements):
            element_forces[k] = np.clip(element_forces[k] + increments[k], -limits, limits)
            total[k] = stiffness @ element_forces[k]
        work += float((previous + total) / 2 @ increments)
    return displacement[0], work


def test_exact_chain_agrees_with_independent_integration():
    """Three cycles of the chain from rest agree with leapfrog steps and slipping nodes written
    here. The change on halving the steps is the error of the reference."""
    cycles = 3
    result = pf.run(CHAIN, **{"drive.cycles": float(cycles)})
    model = pf.build(pf.load(CHAIN))
    coarse, fine = (np.array(integrate_chain(model, cycles, steps)) for steps in (2000, 4000))
    extrapolated = fine + (fine - coarse) / 3
    change = np.abs(fine - coarse)
    response = result.response
    actual = np.array([response.extra["slides"][-1, 0], result.measures["friction_work"].value])
    assert (change < 4e-5 * np.abs(fine)).all()
    assert (np.abs(actual - extrapolated) < change + 1e-6 * np.abs(extrapolated)).all(), (
        actual,
        extrapolated,
        change,
    )


def test_exact_engines_of_chain_agree_within_errors(chain_result):
    """The march and, once the motion is steady, the harmonic balance agree with the exact engine within the errors."""
    steady = pf.run(CHAIN, **{"drive.cycles": 40.0})
    for method, exact in (("march", chain_result), ("harmonic", steady)):
        result = pf.run(CHAIN, **{"accuracy.method": method})
        names = "relative_displacement_amplitude loop_area loop_area_2 slip_amplitude_2"
        assert_agree(exact.measures, result.measures, names)


def test_exact_patch_without_load_changes_nothing():
    """A second interface without load changes nothing, whether it is a patch or a point."""
    point = f'[[structure.interface]]\nbetween = [2, 1]\n{STIFF_LAW}load = "0 N"\n'
    head = CHAIN[: CHAIN.rindex("[[structure.interface]]")]
    patch, unloaded = (
        pf.run(head + face + DRIVE, **{"accuracy.method": "exact"}).measures
        for face in (format_interface("[2, 1]", 0, 2.0), point)
    )
    assert_agree(patch, unloaded, "relative_displacement_amplitude loop_area friction_work", 1e-9)


def test_always_rigid_patch_moves_as_point_with_warning():
    """Without [contact.shear], a patch moves as a point contact; a warning says so."""
    rigid = SINGLE_INTERFACE.replace("[structure.interface.contact.shear]\n", "")
    point = (
        format_masses(1)
        + format_spring_and_damper(1, 0)
        + f'[[structure.interface]]\nbetween = [1, 0]\n{LAW}load = "100 N"\n'
        + DRIVE
    )
    patch_result = pf.run(rigid)
    assert_agree(pf.run(point).measures, patch_result.measures, rel=1e-12)
    assert patch_result.measures["pressure_peak"].value > 1e7
    assert find_sentences(
        patch_result.warnings, "interface 1-0: the shape of the patch does not affect"
    )


def test_always_law_that_averages_the_pressure_has_the_error_of_the_mesh():
    """The friction limit of a rigid patch whose law averages the pressure depends on its mesh, and so do its errors."""
    rigid = SINGLE_INTERFACE.replace("[structure.interface.contact.shear]\n", "")
    scene = rigid.replace(LAW, 'law = "convolution"\nstatic = 0.3\nbond_length = "1 mm"\n')
    rough, fine = (
        pf.run(scene, **{"structure.interface[1].contact.element_size": size}).measures["loop_area"]
        for size in ("0.4 mm", "0.1 mm")
    )
    assert 0 < abs(rough.value - fine.value) <= rough.error + fine.error


def test_always_files_contain_fields_of_every_interface(tmp_path, monkeypatch, chain_result):
    """The dataset, the report, the exports and the summary contain every interface."""
    monkeypatch.chdir(tmp_path)
    chain_result.save("out")
    with xr.open_dataset("out/result.nc") as data:
        for number, load in ((1, 100.0), (2, 60.0)):
            weight = data[f"weight_{number}"]
            total = (data[f"normal_stress_{number}"] * weight).sum(f"x_{number}").values
            assert total.size == 17 and total == pytest.approx(load, rel=1e-9)
            force = (data[f"shear_stress_{number}"] * weight).sum(f"x_{number}").values
            expected = np.interp(
                data["frame_time"], data["time"], data["friction_force"][number - 1]
            )
            np.testing.assert_allclose(force[1:], expected[1:], atol=1e-4 * np.abs(expected).max())
    page = read_page(tmp_path / "out")
    assert "Pressure on the interface (1-0)" in page and "Gap (2-1)" in page
    run_successfully("export", "out/interfaces/2-1", "-o", "fields.csv")
    view_answer = run_cli("view", "out", "-o", "v.png")
    assert view_answer.code == 4 and "out/interfaces/1-0" in view_answer.err
    summary = read_json(tmp_path / "out/summary.json")
    assert summary["numerics"]["interface_nodes_2"] == data.sizes["x_2"]
    assert pf.load("out/scene.resolved.toml").structure.interface[1].contact.load == 60


def test_always_interfaces_that_lose_contact_or_have_few_elements_say_so():
    """A displacement beyond a piece ends the run, patches without load are no contact, a coarse mesh gives no errors of
    the motion and a warning that names the key to leave out."""
    far = pf.run(CHAIN, **{"drive.acceleration": "3000 g", "drive.cycles": 5.0})
    assert str(far.outcome) == "leaves_contact"
    unloaded = pf.run(CHAIN, **{f"structure.interface.{k}.contact.load": "0 N" for k in (0, 1)})
    assert str(unloaded.outcome) == "no_contact" and set(unloaded.measures) == {"normal_load"}
    coarse = pf.run(
        CHAIN, **{"structure.interface.0.contact.element_size": "5 mm", "drive.cycles": 5.0}
    )
    assert (
        coarse.measures["loop_area_2"].error is None
        and coarse.measures["pressure_peak_2"].error > 0
    )
    (warning,) = find_sentences(
        coarse.warnings, "elements along the interface are too few for an estimate of the error"
    )
    assert warning.startswith("interface 1-0: the ")
    assert "leave out structure.interface.contact.element_size" in warning
