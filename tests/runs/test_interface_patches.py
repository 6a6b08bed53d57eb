"""Interfaces that have a patch of their own: against the rig of one patch, against an integration and a slip of nodes
written here, in any order and alone; their bars, files and refusals."""

import json

import numpy as np
import pytest
import xarray as xr
from command_line import cli

import patchfem as pf
from patchfem.runs.patch import faces

SPRING, DAMPER, MASS = 1e6, 10.0, 0.5
LAW = 'law = "coulomb"\nstatic = 0.3\n'
STIFF = 'law = "elastic-plastic"\nstatic = 0.3\nbond_length = "50 nm"\n'
DRIVE = '[drive]\nkind = "base"\nfrequency = "240 Hz"\nacceleration = "8 g"\ncycles = 40\n'


def contact(at: str, load: float, radius: float, more: str = "") -> str:
    """The tables of a crowned patch that shears."""
    return (
        f'[{at}]\nlength = "10 mm"\nwidth = "10 mm"\nheight = "8 mm"\nload = "{load} N"\nsubstrate = "steel"\n'
        f'{more}[{at}.crown]\nradius = "{radius} m"\n[{at}.shear]\n'
    )


def face(between: str, load: float, radius: float, law: str = LAW, more: str = "") -> str:
    """An interface with a patch."""
    return f"[[structure.interface]]\nbetween = {between}\n{law}" + contact(
        "structure.interface.contact", load, radius, more
    )


def held(mass: int, to: int, stiffness: float = SPRING) -> str:
    """A spring and a damper between two masses."""
    pair = f"between = [{mass}, {to}]\n"
    return (
        f'[[structure.spring]]\n{pair}stiffness = "{stiffness} N/m"\n[[structure.damper]]\n{pair}'
        f'coefficient = "{DAMPER} N s/m"\n'
    )


def masses(count: int) -> str:
    """The head of a structure of equal masses."""
    return f"[structure]\nmasses = {json.dumps([f'{MASS} kg'] * count)}\n"


ALONE = masses(1) + held(1, 0) + face("[1, 0]", 100, 0.5) + DRIVE
CHAIN = (
    masses(2) + held(1, 0) + held(2, 1) + face("[1, 0]", 100, 0.5) + face("[2, 1]", 60, 2.0) + DRIVE
)


def rig_of_one(law: str = LAW) -> str:
    """The rig of [contact] whose mode is the mass of ALONE on its spring."""
    return (
        contact("contact", 100, 0.5) + f'[friction]\n{law}[structure]\nmoving_mass = "{MASS} kg"\n'
        '[[structure.mode]]\nname = "a"\nslide = 1.0\n'
        f'frequency = "{float(np.sqrt(SPRING / MASS)) / (2 * np.pi)!r} Hz"\n'
        f"damping = {DAMPER / (2 * float(np.sqrt(SPRING * MASS)))!r}\n" + DRIVE
    )


@pytest.mark.parametrize(
    "law, method", [(LAW, "auto"), (STIFF, "auto"), (LAW, "march"), (LAW, "harmonic")]
)
def test_exact_one_interface_with_a_patch_is_the_rig_of_that_patch(law, method):
    """Every measure and every error, of both ways to write one scene."""
    more = f'[accuracy]\nmethod = "{method}"\n'
    mine = pf.run(ALONE.replace(LAW, law) + more)
    want = pf.run(rig_of_one(law) + more)
    assert mine.outcome == want.outcome and mine.measures.keys() == want.measures.keys()
    for name, one in want.measures.items():
        ours = mine.measures[name]
        if one.value is None:
            assert ours.value is None
            continue
        size = max(abs(one.value), one.error or 0.0, one.floor)
        assert ours.value == pytest.approx(one.value, abs=1e-9 * size), name
        assert (ours.error or 0.0) == pytest.approx(one.error or 0.0, rel=1e-6, abs=1e-9 * size), (
            name
        )
    if method != "march":  # which shows the pressed state alone
        fields = mine.extra["faces"][0].fields
        for name in ("time", "normal_stress", "shear_stress", "slip", "status"):
            size = np.abs(want.fields[name]).max()
            np.testing.assert_allclose(
                fields[name], want.fields[name], atol=1e-9 * size, err_msg=name
            )
    slipped = mine.measures["slip_amplitude"]
    assert slipped.value > 100 * slipped.error > 0


@pytest.fixture(scope="module")
def chain():
    """The chain of two masses with a patch at each of its interfaces, run."""
    return pf.run(CHAIN)


def swapped(name: str) -> str:
    """Name of a measure where the two interfaces stand the other way round."""
    return name[:-2] if name.endswith("_2") else f"{name}_2"


def test_exact_the_order_of_interfaces_does_not_matter(chain):
    other = pf.run(
        masses(2)
        + held(1, 0)
        + held(2, 1)
        + face("[2, 1]", 60, 2.0)
        + face("[1, 0]", 100, 0.5)
        + DRIVE
    )
    assert other.outcome == chain.outcome
    pairs = [
        (name, swapped(name) if swapped(name) in chain.measures else name)
        for name in chain.measures
    ]
    assert sum(one != two for one, two in pairs) > 20
    for one, two in pairs:
        # of the first interface alone
        if one.startswith(("slip_start", "equivalent", "secant", "drift")):
            continue
        ours = other.measures[two]
        want = chain.measures[one]
        assert ours.value == pytest.approx(want.value, rel=1e-8, abs=want.floor), one
        # the secant stiffness of the first alone is among the signs
        assert ours.error <= 3 * want.error + want.floor
        assert want.error <= 3 * ours.error + want.floor


def slipping_nodes(giving, limit) -> tuple:
    """(stiffness, yield slide) of what nodes (m,) of a compliance (m, m) [m/N] and of friction limits [N] do under one
    rising slide: those that stick carry t of giving t = q - what the others bend them, and one after the other slips.
    """
    sticks = np.ones(limit.size, bool)
    slides = [0.0]
    forces = [0.0]
    while sticks.any():
        per = np.linalg.solve(
            giving[np.ix_(sticks, sticks)],
            np.stack(
                [np.ones(sticks.sum()), giving[np.ix_(sticks, ~sticks)] @ limit[~sticks]], axis=1
            ),
        )
        # the slide at which each of those that stick reaches its limit
        at = (limit[sticks] + per[:, 1]) / per[:, 0]
        slides.append(at.min())
        forces.append(float((per[:, 0] * at.min() - per[:, 1]).sum() + limit[~sticks].sum()))
        sticks[np.flatnonzero(sticks)[at <= at.min() * (1 + 1e-9)]] = False
    slope = np.diff(forces) / np.diff(slides)
    return slope - np.append(slope[1:], 0.0), np.array(slides[1:])


def integrated(model, cycles: int, steps: int) -> tuple:
    """(motion of mass 1 [m], friction work [J]) at the end of `cycles` of CHAIN relative to its base, in leapfrog
    steps; its patches are nodes that slip."""
    sets = []
    for one in model.rig.friction.interfaces:
        patch = faces.press_on_meshes(one, model.accuracy.tolerance)[0]
        bears = patch.active
        load = patch.pressure.sigma_n * patch.pieces.interface.weight
        sets.append(
            slipping_nodes(patch.giving[np.ix_(bears, bears)], one.numbers.static * load[bears])
        )
    rows = np.array([[1.0, 0.0], [-1.0, 1.0]])
    omega = 2 * np.pi * 240
    peak = 8 * 9.80665
    h = 1 / (240 * steps)
    place = np.zeros(2)
    half = np.zeros(2)
    work = 0.0
    held = [np.zeros(k.size) for k, _ in sets]
    total = np.zeros(2)
    for n in range(cycles * steps):
        before = total
        rate = half
        for _ in range(3):  # the rate at the step is the mean of those half a step before and after
            push = -SPRING * rows.T @ rows @ place - DAMPER * rows.T @ rows @ rate - rows.T @ total
            after = half + h * (push / MASS - peak * np.sin(omega * n * h)) * (
                0.5 if n == 0 else 1.0
            )
            rate = (half + after) / 2 if n else np.zeros(2)
        half = after
        place = place + h * half
        move = rows @ half * h
        total = np.zeros(2)
        for k, (stiffness, most) in enumerate(sets):
            held[k] = np.clip(held[k] + move[k], -most, most)
            total[k] = stiffness @ held[k]
        work += float((before + total) / 2 @ move)
    return place[0], work


def test_an_integration_of_its_own_agrees():
    """Three cycles of the chain from rest: the slip of the nodes and the motion in leapfrog steps, both written here;
    what half of the steps change shows the error of these."""
    cycles = 3
    found = pf.run(CHAIN, **{"drive.cycles": float(cycles)})
    model = pf.build(pf.load(CHAIN))
    coarse, fine = (np.array(integrated(model, cycles, steps)) for steps in (4000, 8000))
    best = fine + (fine - coarse) / 3
    open_ = np.abs(fine - coarse)
    response = found.response
    ours = np.array([response.extra["slides"][-1, 0], found.measures["friction_work"].value])
    assert (open_ < 1e-5 * np.abs(fine)).all()
    assert (np.abs(ours - best) < open_ + 1e-6 * np.abs(best)).all(), (ours, best, open_)


def test_the_march_and_the_balance_agree_with_the_exact_motion(chain):
    for method in ("march", "harmonic"):
        other = pf.run(CHAIN, **{"accuracy.method": method})
        for name in (
            "relative_displacement_amplitude",
            "loop_area",
            "loop_area_2",
            "slip_amplitude_2",
        ):
            one = chain.measures[name]
            two = other.measures[name]
            assert abs(one.value - two.value) <= one.error + two.error, (method, name)


def test_bars_hold_the_change_to_finer_meshes(chain):
    fine = pf.run(CHAIN, **{"accuracy.tolerance": "1e-4"}).measures
    for name, one in chain.measures.items():
        if one.value is not None and one.error is not None and name in fine:
            assert (
                abs(one.value - fine[name].value) <= one.error + fine[name].error + one.floor * 1e-3
            ), name
    assert 0 < chain.measures["loop_area_2"].error < 1e-2 * chain.measures["loop_area_2"].value


def test_exact_a_patch_beside_a_point_and_one_that_bears_nothing():
    """A rigid point leaves the exact engine of elements; a patch without a load changes nothing."""
    point = f'[[structure.interface]]\nbetween = [2, 1]\n{LAW}load = "0 N"\n'
    head = masses(2) + held(1, 0) + held(2, 1) + face("[1, 0]", 100, 0.5)
    one, two = (
        pf.run(head + other + DRIVE)
        for other in (face("[2, 1]", 0, 2.0), point.replace(LAW, STIFF))
    )
    for name in ("relative_displacement_amplitude", "loop_area", "friction_work"):
        assert one.measures[name].value == pytest.approx(two.measures[name].value, rel=1e-9), name
    assert one.measures["normal_load_2"].value == 0
    mixed, stiff = (
        pf.run(head + point.replace('"0 N"', '"20 N"').replace(LAW, law) + DRIVE)
        for law in (LAW, STIFF.replace("50 nm", "1 nm"))
    )
    assert (mixed.extra["engine"], stiff.extra["engine"]) == ("march", "piecewise")
    for name in ("relative_displacement_amplitude", "loop_area", "loop_area_2"):
        assert mixed.measures[name].value == pytest.approx(stiff.measures[name].value, rel=1e-2), (
            name
        )


def test_exact_elements_of_strips_are_those_of_one_patch():
    """Strips of equal pressure, side by side behind one slide, slip as the whole."""
    strips = "[structure.interface.contact.strips]\ncount = 3\n"
    wide, whole = (
        pf.build(pf.load(ALONE.replace("[drive]", more + "[drive]"))).rig.friction.interfaces[0]
        for more in (strips, "")
    )
    for slide in (2e-8, 1e-7, 1e-6):
        force = [
            float(k @ np.minimum(slide, most))
            for k, most, _ in (faces.make_elements(one, 1e-3) for one in (wide, whole))
        ]
        assert force[0] == pytest.approx(force[1], rel=1e-3)


def test_a_rigid_patch_moves_as_a_point_with_a_warning():
    rigid = ALONE.replace("[structure.interface.contact.shear]\n", "")
    point = (
        masses(1)
        + held(1, 0)
        + f'[[structure.interface]]\nbetween = [1, 0]\n{LAW}load = "100 N"\n'
        + DRIVE
    )
    one = pf.run(rigid)
    two = pf.run(point)
    for name, want in two.measures.items():
        found = one.measures[name]
        assert found.reason == want.reason, name
        assert (
            found.value is None
            if want.value is None
            else found.value == pytest.approx(want.value, rel=1e-12)
        ), name
    assert one.measures["pressure_peak"].value > 1e7
    assert any(
        "interface 1-0: the shape of the patch does not affect" in text
        and "[structure.interface.contact.shear]" in text
        for text in one.warnings
    )


def test_files_of_a_run_have_the_pressure_of_every_interface(tmp_path, monkeypatch, chain):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "chain.toml").write_text(CHAIN)
    answer = cli("run", "chain.toml", "-o", "out")
    assert answer.code == 0 and "pressure_peak_2" in answer.out
    with xr.open_dataset("out/result.nc") as data:
        for number, load in ((1, 100.0), (2, 60.0)):
            weight = data[f"weight_{number}"]
            total = (data[f"normal_stress_{number}"] * weight).sum(f"x_{number}").values
            assert total.size == 17 and total == pytest.approx(load, rel=1e-9)
            force = (data[f"shear_stress_{number}"] * weight).sum(f"x_{number}").values
            seen = np.interp(data["frame_time"], data["time"], data["friction_force"][number - 1])
            np.testing.assert_allclose(force[1:], seen[1:], atol=1e-4 * np.abs(seen).max())
    probed = json.loads(cli("plan", "chain.toml", "--probe", "--json").out)["stiffness_chain"]
    for ours, name in (
        ("pieces_shear", "tangential_stiffness"),
        ("pieces_shear_2", "tangential_stiffness_2"),
    ):
        assert probed[ours] == pytest.approx(chain.measures[name].value, rel=1e-2)
    page = (tmp_path / "out/report.html").read_text()
    assert "Pressure on interface 1-0" in page and "Pressure on interface 2-1" in page
    assert cli("export", "out/interfaces/2-1", "-o", "fields.csv").code == 0
    lost = cli("view", "out", "-o", "v.png")
    assert lost.code == 4 and "out/interfaces/1-0" in lost.err
    told = json.loads((tmp_path / "out/summary.json").read_text())
    assert told["numerics"]["interface_nodes_2"] == data.sizes["x_2"]
    assert pf.load("out/scene.resolved.toml").structure.interface[1].contact.load == 60
    assert cli("export", "chain.toml", "-o", "elements.npz").code == 0
    assert np.load("elements.npz", allow_pickle=True)


def test_a_slide_beyond_a_piece_and_pieces_without_a_load_end_the_run():
    assert (
        str(pf.run(CHAIN, **{"drive.acceleration": "3000 g", "drive.cycles": 5.0}).outcome)
        == "leaves_contact"
    )
    bare = pf.run(CHAIN, **{f"structure.interface.{k}.contact.load": "0 N" for k in (0, 1)})
    assert str(bare.outcome) == "no_contact" and set(bare.measures) == {"normal_load"}


def test_a_mesh_of_few_elements_leaves_the_errors_of_the_motion_open():
    few = pf.run(CHAIN, **{"structure.interface.0.contact.element_size": "5 mm"})
    assert few.measures["loop_area_2"].error is None and few.measures["pressure_peak_2"].error > 0
    assert any(
        "interface 1-0: the interface has too" in one
        and "leave out structure.interface.contact.element_size" in one
        for one in few.warnings
    )


@pytest.mark.parametrize(
    "old, new, says",
    [
        (
            "[drive]",
            '[structure.interface.contact.approach]\ndistance = "1 um"\n[drive]',
            "contact.approach",
        ),
        (
            "[drive]",
            '[structure.interface.contact.grooves]\nwavelength = "80 um"\namplitude = "2 um"\n[drive]',
            "structure.interface[2].contact.grooves: not supported yet with [[structure.interface]]; leave out this entry",
        ),
        (
            "static = 0.3\n[structure",
            'static = 0.3\nload = "5 N"\n[structure',
            "has its own load; leave this key out",
        ),
        ('radius = "2.0 m"', 'radius = "2.0 m"\non = "lower"', "put the shapes on the upper piece"),
        ('load = "60 N"\n', "", "structure.interface[2].contact.load: missing"),
        (
            'height = "8 mm"\nload = "60',
            'height = "8 mm"\nelement_size = "20 mm"\nload = "60',
            "contact.element_size",
        ),
        (
            LAW + "[structure.interface.contact]\nlength",
            'law = "nonlocal"\nstatic = 0.3\nbond_length = "1 um"\n'
            "[structure.interface.contact]\nlength",
            "or use law 'coulomb' or 'elastic-plastic'",
        ),
        (
            LAW,
            LAW + "kinetic = 0.2\n",
            "structure.interface[1].kinetic: 0.2 below static = 0.3 with "
            "[structure.interface.contact.shear] is not supported yet; leave out the key kinetic",
        ),
        (LAW, LAW.replace("0.3", "0.0"), "leave out [structure.interface.contact.shear]"),
        (
            "[drive]",
            '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 1000\n[drive]',
            "wear: not supported yet",
        ),
        (
            "[drive]",
            '[structure.interface.contact.profile]\nfile = "none.csv"\n[drive]',
            "structure.interface[2].contact.profile.file: there is no file",
        ),
    ],
)
def test_refuses_what_a_patch_of_an_interface_cannot_be(old, new, says, tmp_path):
    """Each mistake at its own line, with what to do."""
    text = CHAIN.replace(old, new)
    assert text != CHAIN
    (tmp_path / "chain.toml").write_text(text)
    answer = cli("check", str(tmp_path / "chain.toml"))
    assert answer.code == 2 and says in answer.err and "chain.toml:" in answer.err, answer.err
