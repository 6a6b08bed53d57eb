"""Backbones of scenes: three ways beside each other and beside closed forms."""

import numpy as np
import pytest
from scene_texts import IWAN, JOINT_SHAKEN, make_shaken_block
from scipy.integrate import solve_ivp

import patchfem as pf
from patchfem.campaigns import compute_backbone
from patchfem.campaigns.backbone.bench_loops import run_loop, settle_loop
from patchfem.campaigns.backbone.joint import build_joint
from patchfem.response.errors import error_of_change

PLASTIC = 'law = "elastic-plastic"\nbond_length = "1 mm"'
OMEGA = 200 * np.pi


def model(law: str, **sets):
    return pf.build(make_shaken_block(law), **sets)


def segalman(u):
    """Force [N] and loss [J] of the joint IWAN by Segalman's closed form at slides below phi_max = 2.7 mm."""
    r = u / 2.7e-3
    scale = 30 / (0.5 + 1 / 3)
    force = scale * (1.5 * r - r**1.5 / 1.5)
    return force, 8 * scale * 2.7e-3 * (0.75 * r**2 - r**2.5 / 3.75) - 4 * u * force


def test_exact_the_static_curve_of_an_iwan_joint_is_segalmans():
    a = np.array([1e-5, 1e-4, 1e-3, 2.5e-3])
    found = compute_backbone(model(IWAN), "", a, ("quasi-static",))
    one, (force, loss) = found.curves["quasi-static"], segalman(a)
    omega = np.sqrt(OMEGA**2 + force / (0.5 * a))
    assert one.frequency == pytest.approx(omega / (2 * np.pi), rel=1e-12)
    assert one.damping == pytest.approx(
        0.002 * OMEGA / omega + loss / (np.pi * (omega * a) ** 2), rel=1e-9
    )
    assert found.exponents.micro == pytest.approx(2.5, abs=1e-6) and found.exponents.gross is None
    assert found.frequencies.free == pytest.approx(100)
    assert found.frequencies.stuck == pytest.approx(np.sqrt(OMEGA**2 + 4e4) / (2 * np.pi))


def test_the_balance_of_an_iwan_joint_keeps_its_bars_and_the_decay_follows_it():
    """In micro-slip one harmonic carries all: the balance has the static curve's loss. The decay is within its bar and
    what the damping changes over one of its swings."""
    a = np.geomspace(2e-5, 2e-3, 6)
    found = compute_backbone(model(IWAN), "", a)
    static, balance, decay = (found.curves[way] for way in ("quasi-static", "balance", "decay"))
    assert balance.damping[0] == pytest.approx(static.damping[0], rel=1e-3)
    inside = np.isin(a, decay.amplitude)
    change = np.gradient(balance.damping, np.log(a))[inside] * 2 * np.pi * balance.damping[inside]
    off = np.abs(decay.damping - balance.damping[inside])
    assert inside.sum() >= 4 and (off < decay.damping_error + 2 * change).all()
    assert np.abs(decay.frequency - balance.frequency[inside]).max() < 0.1


def test_exact_a_motion_of_the_amplitude_asked_for_comes_back_after_a_cycle():
    """The largest of 4096 samples was taken for the amplitude, 3e-7 of it too small: the motion fell within a cycle."""
    found = compute_backbone(
        model('law = "tanh"\nreference_speed = "0.5 m/s"'),
        "",
        a := [6e-4, 8e-4, 1.2e-3],
        ("balance",),
    )
    one = found.curves["balance"]
    for start, f, zeta in zip(a, one.frequency, one.damping):
        damping = 2 * (0.002 * OMEGA - zeta * 2 * np.pi * f)
        end = solve_ivp(
            lambda t, y, c=damping: (
                y[1],
                -(OMEGA**2) * y[0] - c * y[1] - 60 * np.tanh(y[1] / 0.5),
            ),
            (0, 1 / f),
            [start, 0.0],
            rtol=1e-12,
            atol=1e-18,
        ).y[:, -1]
        assert end[0] / start == pytest.approx(1, abs=1e-9)


def test_exact_rigid_friction_by_balance_and_by_decay():
    """A block loses 2 h of every half swing, h = F/k: the decay reads ln(S/(S - 4 h)) at the mean of both swings, and
    the balance has loss over 2 pi m omega^2 A^2 but for what one harmonic leaves out, of the order of the ratio."""
    h = 30 / (0.5 * OMEGA**2)
    found = compute_backbone(model('law = "coulomb"'), "", np.geomspace(20 * h, 80 * h, 4))
    decay = found.curves["decay"]
    balance = found.curves["balance"]
    assert list(found.missing) == ["quasi-static"]
    assert "has no finite stiffness" in found.missing["quasi-static"]
    first = 2 * h / (np.pi * balance.amplitude) + 0.002
    assert balance.damping == pytest.approx(first, rel=2e-2)
    assert decay.damping == pytest.approx(
        np.interp(decay.amplitude, balance.amplitude, balance.damping), rel=2e-2
    )
    assert found.exponents.micro is None and found.exponents.gross == pytest.approx(1)


def test_exact_a_cubic_spring_has_duffings_backbone():
    """omega^2 = omega_0^2 + 3 k3 A^2/(4 m) to the first order of k3 A^2/k, and the damping of the structure alone."""
    scene = make_shaken_block(PLASTIC)
    scene = scene[scene.index("[structure]") :] + '[structure.stiffening]\ncubic = "1e9 N/m^3"\n'
    a = np.array([1e-5, 1e-4])
    found = compute_backbone(pf.build(scene), "", a, ("balance", "quasi-static"))
    omega = np.sqrt(OMEGA**2 + 0.75e9 * a**2 / 0.5)
    assert found.curves["balance"].frequency == pytest.approx(omega / (2 * np.pi), rel=1e-6)
    static = np.sqrt(OMEGA**2 + 1e9 * a**2 / 0.5)
    assert found.curves["quasi-static"].frequency == pytest.approx(static / (2 * np.pi), rel=1e-9)
    assert found.curves["balance"].damping == pytest.approx(0.002 * OMEGA / omega, rel=1e-5)


def test_a_mode_that_gains_energy_has_the_amplitude_of_flutter():
    """Where the balance falls through 0 is the limit cycle that does not last."""
    one = pf.build(make_shaken_block(PLASTIC), **{"structure.mode.axial.damping": -0.01})
    found = compute_backbone(one, "", np.geomspace(2e-3, 2e-2, 25), ("balance",))
    free = make_shaken_block(PLASTIC).replace(
        'kind = "base"\nfrequency = "100 Hz"\nacceleration = "1 g"',
        'kind = "free"\ndisplacement = "1 mm"',
    )
    told = pf.run(free, **{"structure.mode.axial.damping": -0.01}).measures["flutter_amplitude"]
    assert found.flutter == pytest.approx(told.value, rel=0.01)


def test_two_modes_are_chosen_by_name_and_matched_by_shape():
    """The held mode with most of the axial coordinate is the axial one, whatever its place among the frequencies."""
    scene = make_shaken_block('law = "elastic-plastic"\nbond_length = "1 um"').replace(
        "[drive]",
        """[[structure.mode]]
name = "yaw"
frequency = "80 Hz"
damping = 0.01
slide = 0.1
[drive]""",
    )
    one = pf.build(scene)
    found = compute_backbone(one, "axial", [1e-8], ("balance",))
    k = np.diag([OMEGA**2, (160 * np.pi) ** 2]) + 30e6 / 0.5 * np.outer([1, 0.1], [1, 0.1])
    assert found.frequencies.stuck == pytest.approx(
        np.sqrt(np.linalg.eigvalsh(k)[-1]) / (2 * np.pi)
    )
    assert found.curves["balance"].frequency == pytest.approx(found.frequencies.stuck, rel=1e-6)
    low = compute_backbone(one, "yaw", [1e-9], ("quasi-static",))
    first = np.sqrt(np.linalg.eigvalsh(k)[0]) / (2 * np.pi)
    assert low.curves["quasi-static"].frequency == pytest.approx(first, rel=1e-6)
    with pytest.raises(pf.PatchfemError, match="the modes of the rig are axial, yaw"):
        compute_backbone(one, "pitch")


def test_refuses_what_has_no_backbone():
    with pytest.raises(pf.PatchfemError, match="needs the scene of a rig"):
        compute_backbone(
            pf.build(
                '[normal]\nload = "1 N"\n[friction]\nlaw = "coulomb"\nstatic = 0.3\n[slide]\nkind = "sine"\n'
                'amplitude = "1 mm"\nfrequency = "10 Hz"\n'
            )
        )
    found = compute_backbone(model('law = "tanh"\nreference_speed = "1 mm/s"'), "", [1e-2, 2e-2])
    assert "sliding speed" in found.missing["quasi-static"] and set(found.curves) >= {"balance"}


@pytest.mark.parametrize(
    "scene, said",
    [
        (
            make_shaken_block(PLASTIC).replace("100 N", "0 N")
            + '[structure.stiffening]\ncubic = "1e9 N/m^3"\n',
            r"leave out \[friction\] and the normal load",
        ),
        (
            make_shaken_block(PLASTIC).replace("slide = 1.0", "slide = 1.0\noutput = 0.0"),
            "does not move the point of the output",
        ),
        (
            make_shaken_block('law = "coulomb"').replace(
                'frequency = "100 Hz"\ndamping', 'frequency = "0 Hz"\ndamping'
            ),
            "no natural frequency",
        ),
    ],
)
def test_refuses_a_mode_without_an_answer(scene, said):
    with pytest.raises(pf.PatchfemError, match=said):
        compute_backbone(pf.build(scene))


@pytest.mark.parametrize(
    "scene",
    [
        make_shaken_block(PLASTIC)[make_shaken_block(PLASTIC).index("[structure]") :],
        make_shaken_block('law = "coulomb"').replace("100 N", "0 N"),
    ],
)
def test_exact_a_rig_in_which_no_friction_acts_has_level_curves(scene):
    found = compute_backbone(pf.build(scene))
    for way, f in (("balance", 100.0), ("decay", 100 * np.sqrt(1 - 4e-6)), ("quasi-static", 100.0)):
        assert found.curves[way].frequency == pytest.approx(f, rel=1e-12)
        assert found.curves[way].damping == pytest.approx(0.002, rel=1e-9)
    assert not found.missing
    assert found.exponents.micro is None
    assert len(found.notes) == ("coulomb" in scene)


def test_exact_a_damper_between_masses_has_the_damping_that_keeps_a_motion_up():
    """det((k - m w^2) + i w (c - 2 zeta w m)) = 0 at the frequency and the ratio of the balance."""
    scene = """[structure]
masses = ["0.5 kg", "0.3 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "200 kN/m"
[[structure.spring]]
between = [2, 1]
stiffness = "100 kN/m"
[[structure.damper]]
between = [1, 0]
coefficient = "40 N s/m"
""" + make_shaken_block(PLASTIC)[make_shaken_block(PLASTIC).index("[drive]") :]
    one = compute_backbone(pf.build(scene), "2", [1e-4]).curves
    k = np.array([[3e5, -1e5], [-1e5, 1e5]])
    m = np.diag([0.5, 0.3])
    c = np.diag([40.0, 0])
    w = 2 * np.pi * one["balance"].frequency[0]
    zeta = one["balance"].damping[0]
    assert abs(
        np.linalg.det(k - m * w**2 + 1j * w * (c - 2 * zeta * w * m))
    ) < 1e-9 * np.linalg.det(k)
    s = 2j * np.pi * one["decay"].frequency[0]
    s -= s.imag * one["decay"].damping[0] / np.sqrt(1 - one["decay"].damping[0] ** 2)
    assert abs(np.linalg.det(k + c * s + m * s**2)) < 1e-9 * np.linalg.det(k)


def test_a_decay_behind_a_stiff_contact_lasts_some_swings_in_slip():
    """50 cycles of the held mode, 76 times as fast as the free one, were no swing in slip: the curve had no value."""
    found = compute_backbone(pf.build(CROWNED), "", [2e-2, 3e-2], ("decay",)).curves["decay"]
    assert found.amplitude.tolist() == [2e-2, 3e-2]
    assert (found.frequency_error < 1e-3 * found.frequency).all()
    # of Coulomb friction in gross slip
    lost = 4 * 0.3 * 2e3 * 3e-2 / (2 * np.pi * 0.5 * OMEGA**2 * 3e-2**2)
    assert found.damping[-1] == pytest.approx(0.002 + lost, rel=0.02)


def test_amplitudes_stay_within_the_stop():
    stopped = pf.build(
        make_shaken_block(IWAN).replace("moving_mass", 'travel = "0.2 mm"\nmoving_mass')
    )
    found = compute_backbone(stopped, methods=("decay", "quasi-static"))
    assert found.curves["quasi-static"].amplitude[-1] == pytest.approx(0.2e-3 / 1.15)
    assert 1.5e-4 < found.curves["decay"].amplitude[-1] < 0.2e-3
    with pytest.raises(
        pf.PatchfemError, match=r"structure\.travel: the largest amplitude, 300 um, is larger than"
    ):
        compute_backbone(stopped, "", [1e-4, 3e-4])


def test_a_curve_that_bends_back_is_kept_as_far_as_it_goes():
    """Two masses, of which the second slides on the first mode's coordinate: another motion takes over on the way."""
    structure = """masses = ["0.5 kg", "0.3 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "200 kN/m"
[[structure.spring]]
between = [2, 1]
stiffness = "100 kN/m"
[[structure.interface]]
between = [1, 0]
law = "elastic-plastic"
bond_length = "10 um"
static = 0.3
load = "100 N"
"""
    rig = make_shaken_block(PLASTIC)
    a = np.array([2e-6, 9e-6, 12e-6, 30e-6])
    found = compute_backbone(
        pf.build("[structure]\n" + structure + rig[rig.index("[drive]") :]), "", a, ("balance",)
    )
    one = found.curves["balance"]
    assert one.amplitude == pytest.approx(a[:2]) and one.frequency == pytest.approx(
        found.frequencies.stuck, rel=1e-6
    )
    assert "without a result" in found.notes[0]
    assert "did not converge at these amplitudes; the curve" in found.notes[0]


FOLDED = make_shaken_block('law = "elastic-plastic"\nbond_length = "1.80165 um"').replace(
    'load = "100 N"', 'load = "12.011 N"'
)
FOLDED = (
    FOLDED[: FOLDED.index("[structure]")]
    + """[structure]
moving_mass = "1 kg"
"""
    + "".join(
        f'''[[structure.mode]]
name = "{name}"
frequency = "{frequency} Hz"
damping = 0.002
slide = {slide}
output = {output}
base = 0.1
'''
        for name, frequency, slide, output in (
            ("first", 101.069, 1.0017, 2.17225),
            ("second", 634.018, -1.28353, 2.17435),
        )
    )
    + FOLDED[FOLDED.index("[drive]") :]
)


def test_beyond_a_fold_the_curve_goes_on():
    """A blade with a damper: its curve folds near 26 um, beyond which these were left out. Asked for
    alone, the motions beyond have the same frequency, damping and loss."""
    a = np.array([25e-6, 28e-6, 40e-6])
    found, alone = (
        compute_backbone(pf.build(FOLDED, **{"accuracy.tolerance": 0.1}), "", one, ("balance",))
        for one in (a, a[1:])
    )
    whole = found.curves["balance"]
    beyond = alone.curves["balance"]
    assert whole.amplitude == pytest.approx(a) and beyond.amplitude == pytest.approx(a[1:])
    assert not any("left out" in note for note in found.notes)
    assert (np.diff(whole.frequency) < 0).all()
    assert whole.frequency[1:] == pytest.approx(beyond.frequency, rel=1e-6)
    assert whole.damping[1:] == pytest.approx(beyond.damping, rel=1e-5)


TWO = make_shaken_block(PLASTIC.replace("1 mm", "1 um")).replace(
    "[drive]",
    """[[structure.mode]]
name = "second"
frequency = "470 Hz"
damping = 0.003
slide = 0.8
output = 0.6
[drive]""",
)


def test_two_modes_in_gross_slip_lose_the_same_by_decay_and_by_balance():
    """The decay of two modes is that of the output: 4 F/(2 pi k A) and the structure's own, less than 2 % apart where
    the damping is small; the static curve is at the amplitudes asked for."""
    a = np.array([2e-3, 4e-3])
    curves = compute_backbone(pf.build(TWO), "", a).curves
    plain = 0.002 + 4 * 30 / (2 * np.pi * 0.5 * OMEGA**2 * a)
    assert curves["balance"].damping == pytest.approx(plain, rel=0.02)
    assert curves["decay"].damping == pytest.approx(
        np.interp(curves["decay"].amplitude, a, plain), rel=0.02
    )
    assert curves["decay"].amplitude.size == 2 and curves[
        "quasi-static"
    ].amplitude == pytest.approx(a, rel=1e-6)


@pytest.mark.parametrize("two", [False, True])
def test_exact_a_decay_goes_on_where_the_contact_holds(two):
    """A contact that holds on a spring is no end: where nothing slips the decay is that of the held modes, zeta
    omega/omega_held of one mode. Of 13 points there were 7, of two modes 3."""
    a = np.geomspace(1e-7, 2e-3, 13)
    text = (
        TWO.replace("1 um", "0.1 mm")
        if two
        else make_shaken_block(PLASTIC.replace("1 mm", "10 um"))
    )
    found = compute_backbone(pf.build(text), "", a, ("decay",))
    one = found.curves["decay"]
    assert one.amplitude.size == 13 and not any("have a result" in note for note in found.notes)
    # the other mode rings there: up to 2e-4 of the damping ratio
    still = one.amplitude < (1e-4 if two else 2e-6)
    if two:
        own = np.array([1, 4.7]) * OMEGA
        shape = np.diag([0.004, 0.006 * 4.7]) * OMEGA
        phi = np.array([1, 0.8])
        stiff = np.diag(own**2) + 3e5 / 0.5 * np.outer(phi, phi)
        roots = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-stiff, -shape]]))
        root = roots[np.argmin(np.abs(roots))]
        zeta = -root.real / abs(root)
        omega = abs(root.imag)
    else:
        omega = np.sqrt(OMEGA**2 + 3e6 / 0.5)
        zeta = 0.002 * OMEGA / omega
        omega *= np.sqrt(1 - zeta**2)
    assert still.sum() >= 3
    for value, error, truth in (
        (one.damping, one.damping_error, zeta),
        (one.frequency, one.frequency_error, omega / (2 * np.pi)),
    ):
        assert (np.abs(value - truth) <= error + 1e-6 * truth)[still].all()
    assert (one.damping_error < (1e-4 if two else 0.2) * one.damping)[still].all()


NEAR = make_shaken_block(PLASTIC.replace("1 mm", "0.1 mm")).replace(
    "[drive]",
    """[[structure.mode]]
name = "yaw"
frequency = "102 Hz"
damping = 0.002
slide = 0.4
[drive]""",
)


def test_a_decay_in_which_another_mode_rings_is_not_given_as_that_of_this_mode():
    """Of two modes 2 % apart that slide together, a release of one turns into the other: 32 times the damping ratio of
    the free motion stood there, with an error of 15 %, and only the loss of a cycle was given as the reason."""
    found = compute_backbone(
        pf.build(NEAR), "axial", np.geomspace(1e-3, 1e-2, 5), ("balance", "decay")
    )
    assert "decay" not in found.curves
    assert "no longer a motion of this mode alone" in found.missing["decay"]
    assert found.curves["balance"].damping[:3] == pytest.approx(0.002, rel=1e-3)
    found = compute_backbone(
        pf.build(NEAR), "axial", a := np.geomspace(2e-3, 6e-2, 7), ("balance", "decay")
    )
    balance = found.curves["balance"]
    decay = found.curves["decay"]
    assert balance.amplitude.size == a.size and decay.amplitude == pytest.approx(a[4:])
    assert decay.damping == pytest.approx(balance.damping[4:], rel=0.04)
    assert (decay.other_modes > 0.01).all()
    assert any(
        "fallen to 11 mm, the motion of other modes is more than 10 % of its am" in one
        for one in found.notes
    )


CROWNED = """\
[contact]
length = "20 mm"
width = "20 mm"
height = "8 mm"
load = "2 kN"
substrate = "steel"
[contact.crown]
radius = "20 m"
[contact.shear]
[friction]
law = "coulomb"
static = 0.3
""" + make_shaken_block("")[make_shaken_block("").index("[structure]") :]


def test_always_the_mesh_is_in_the_bars_of_micro_slip():
    """Below the yield slide of its first node neither a mesh nor one of half its nodes slips; the finer mesh does."""
    coarse, fine = (
        compute_backbone(
            pf.build(CROWNED, **{"accuracy.tolerance": one}),
            "",
            np.geomspace(1e-9, 1e-5, 25),
            ("quasi-static",),
        )
        for one in (1e-2, 2e-4)
    )
    one = coarse.curves["quasi-static"]
    other = fine.curves["quasi-static"]
    for name in ("frequency", "damping"):
        off = abs(getattr(one, name) - getattr(other, name))
        bar = getattr(one, f"{name}_error")
        assert np.mean(off <= bar + getattr(other, f"{name}_error")) >= 0.95, name
    own = one.damping[0] * one.frequency[0] / 100
    # no slip is seen
    assert own == pytest.approx(0.002, rel=1e-9) and one.damping_error[0] > 1e-6 * one.damping[0]
    assert fine.exponents.micro == pytest.approx(3, abs=0.3) and fine.exponents.micro_theory == 3
    assert coarse.exponents.micro is None
    assert any("the exponent of micro-slip cannot be determined" in note for note in coarse.notes)
    assert any("higher than the frequencies by balance" in note for note in fine.notes)


BEHIND_BONDS = (
    JOINT_SHAKEN.replace('law = "coulomb"', 'law = "nonlocal"\nbond_length = "100 um"')
    .replace("kinetic = 0.2\n", "")
    .replace("damping = 0.01", "damping = 0.05")
)

FEW = "[contact.shear]", 'element_size = "6 mm"\n[contact.shear]'


def test_errors_say_what_they_leave_out_of_the_mesh():
    """Bonds behind pieces that give way have no steady loop: their errors hold the change on a coarser mesh, and where
    there is none, no error of the mesh."""
    a = [1e-6, 2e-6]
    found, few = (
        compute_backbone(pf.build(one), "", a, ("decay",))
        for one in (BEHIND_BONDS, BEHIND_BONDS.replace(*FEW))
    )
    (said,), (unmeshed, bare) = (
        [note for note in one.notes if "the errors of" in note] for one in (found, few)
    )
    assert said.startswith(
        "the errors of method decay include the change on a coarser mesh, but not the energy that"
    )
    assert said.endswith(
        "because the hysteresis loop of this friction law is not known without a computation in time"
    )
    assert unmeshed.endswith("too few elements for a coarser mesh; leave out contact.element_size")
    assert bare.startswith(
        "the errors of method decay include no error of the mesh, because the hysteresis loop of"
    )
    assert (found.curves["decay"].frequency_error > few.curves["decay"].frequency_error).all()
    plain = compute_backbone(
        pf.build(JOINT_SHAKEN.replace("kinetic = 0.2\n", "")), "", a, ("balance",)
    )
    assert plain.curves and not any("the errors of" in note for note in plain.notes)


def test_the_stuck_frequency_follows_from_the_stiffness_of_a_run():
    found = compute_backbone(pf.build(CROWNED), "", [1e-6], ("quasi-static",))
    told = pf.run(
        CROWNED[: CROWNED.index("[structure]")] + '[slide]\nkind = "sine"\namplitude = "1 um"\n'
        'frequency = "1 Hz"\n'
    ).measures["tangential_stiffness"]
    stuck = np.sqrt(OMEGA**2 + told.value / 0.5) / (2 * np.pi)
    error = found.frequencies.stuck_error + stuck * told.error / told.value / 2
    assert abs(found.frequencies.stuck - stuck) <= error < 1e-3 * stuck
    assert "above the range of micro-slip" in " ".join(found.notes)


@pytest.mark.parametrize("slide", [1.0, 0.01])
def test_amplitudes_unless_given_end_where_the_mode_is_nearly_free(slide):
    """A contact that slides by a hundredth of the output: the default ended at 7 m, not 0.7 mm, where `travel` did not
    stop it."""
    one = pf.build(make_shaken_block(IWAN).replace("slide = 1.0", f"slide = {slide}\noutput = 1.0"))
    found = compute_backbone(one, "", None, ("quasi-static",))
    deflected = 30 * slide / (0.5 * OMEGA**2)  # by the largest friction
    top = max(deflected, 1.5e-3 / slide)
    assert found.curves["quasi-static"].amplitude[-1] == pytest.approx(15 * top, rel=1e-6)
    assert found.curves["quasi-static"].frequency[-1] < 1.05 * found.frequencies.free


def test_a_loop_that_remembers_is_read_when_it_has_settled():
    """Three cycles of bonds of order 2 are not their loop yet: the curve is that of thirty, within both bars."""
    bonds = 'law = "nonlocal"\nreading = "stretch"\norder = 2\nbond_length = "1 um"'
    joint = build_joint(model(bonds), "")
    few, many = (
        run_loop(joint.model, joint.patch, 3e-7, 400.0, cycles).run.values for cycles in (3.0, 96.0)
    )
    found = settle_loop(joint.model, joint.patch, 3e-7, 400.0)
    name = "secant_stiffness"
    assert abs(few[name] / many[name] - 1) > 1e-3
    assert abs(found.run.values[name] / many[name] - 1) < 2e-3


def test_bonds_without_a_closed_loop_name_the_method_that_works():
    bonds = model('law = "nonlocal"\nreading = "stretch"\norder = 2\nbond_length = "1 um"')
    (said,) = compute_backbone(bonds, "", [3e-7], ("balance",)).missing.values()
    assert said.endswith("; use --method quasi-static")
    assert not compute_backbone(bonds, "", [3e-7], ("quasi-static",)).missing


def test_a_static_curve_ends_where_its_force_falls():
    """An interlock gives way at a quarter of its wave: 20 um of 80."""
    bonded = '[structure.bonded]\nstiffness = "4.6e6 N/m"\nwavelength = "80 um"\n[[structure.mode]]'
    scene = make_shaken_block(PLASTIC)[make_shaken_block(PLASTIC).index("[structure]") :].replace(
        "[[structure.mode]]", bonded, 1
    )
    found = compute_backbone(
        pf.build(scene), "", np.array([5e-6, 1e-5, 1.5e-5, 5e-5]), ("quasi-static",)
    )
    assert found.curves["quasi-static"].amplitude.size == 3
    assert "curve does not reach these" in found.notes[0]
    assert found.frequencies.free == pytest.approx(np.sqrt(OMEGA**2 + 9.2e6) / (2 * np.pi))


def test_python_gives_a_dataset():
    found = pf.backbone(make_shaken_block(IWAN), amplitudes=[1e-3, 1e-4], method="quasi-static")
    assert found["quasi_static_amplitude"].values == pytest.approx([1e-4, 1e-3], rel=1e-9)
    assert found["quasi_static_frequency"].attrs["units"] == "Hz" and found.attrs["mode"] == "axial"
    with pytest.raises(pf.PatchfemError, match="one of balance"):
        pf.backbone(make_shaken_block(IWAN), method="static")
    with pytest.raises(pf.PatchfemError, match="above 0"):
        pf.backbone(make_shaken_block(IWAN), amplitudes=[0.0])


def test_exact_error_of_cells_follows_largest_change():
    """The error due to the cells of an Iwan law follows from the largest change by merged cells."""
    values = iter([1.0, 1.01, 0.98, 1.005, 1.0])
    joint = build_joint(model(IWAN), "")
    error = joint.spatial_discretization_errors(lambda group: next(values))
    assert error == pytest.approx(error_of_change(0.02, ratio=4.0, order=2.0), rel=1e-9)
