"""Backbones of rigs by three methods, compared with each other and with closed forms."""

import tomllib

import numpy as np
import pytest
from fold_recipe import FIRST_BACKBONE_SEED, make_backbone_scene
from scene_texts import IWAN, make_shaken_block
from scipy.integrate import solve_ivp

import patchfem as pf
from patchfem.campaigns.backbone.curves import compute_backbone
from patchfem.campaigns.fits.curve import compute_points
from patchfem.export import backbones
from patchfem.export.columns import format_curves

PLASTIC = 'law = "elastic-plastic"\nbond_length = "1 mm"'
OMEGA = 200 * np.pi
STRUCTURE = "[structure]" + make_shaken_block("").partition("[structure]")[2]


def build_block(law: str, **sets):
    """Return the Model of a shaken block with a friction law and changes of the scene."""
    return pf.build(make_shaken_block(law), **sets)


def segalman_loop(u):
    """Return force [N] and loss per cycle [J] of the joint IWAN at amplitudes `u` below phi_max = 2.7 mm.

    Closed form of Segalman (2005).
    """
    r = u / 2.7e-3
    scale = 30 / (0.5 + 1 / 3)
    force = scale * (1.5 * r - r**1.5 / 1.5)
    return force, 8 * scale * 2.7e-3 * (0.75 * r**2 - r**2.5 / 3.75) - 4 * u * force


def test_exact_quasi_static_iwan_curve_agrees_with_segalman():
    """Quasi-static frequency and damping of an Iwan joint agree with Segalman's closed form within 1e-9."""
    amplitudes = np.array([1e-5, 1e-4, 1e-3, 2.5e-3])
    backbone = compute_backbone(build_block(IWAN), "", amplitudes, ("quasi-static",))
    curve, (force, loss) = backbone.curves["quasi-static"], segalman_loop(amplitudes)
    omega = np.sqrt(OMEGA**2 + force / (0.5 * amplitudes))
    assert curve.frequency == pytest.approx(omega / (2 * np.pi), rel=1e-12)
    assert curve.damping == pytest.approx(
        0.002 * OMEGA / omega + loss / (np.pi * (omega * amplitudes) ** 2), rel=1e-9
    )
    assert (
        backbone.exponents.micro == pytest.approx(2.5, abs=1e-6)
        and backbone.exponents.gross is None
    )
    assert backbone.frequencies.free == pytest.approx(100)
    assert backbone.frequencies.stuck == pytest.approx(np.sqrt(OMEGA**2 + 4e4) / (2 * np.pi))


def test_exact_joint_without_friction_is_linear():
    """Without a friction limit all amplitudes have the frequency and the damping of the mode, and a note says why."""
    scene = pf.load(make_shaken_block(PLASTIC))
    backbone = pf.backbone(scene, amplitudes=[1e-5, 1e-3], **{"friction.static": 0.0})
    for method in ("balance", "quasi_static"):
        assert backbone[f"{method}_frequency"].values == pytest.approx([100.0, 100.0], rel=1e-12)
        assert backbone[f"{method}_damping"].values == pytest.approx([0.002, 0.002], rel=1e-9)
    assert any("No friction acts" in note for note in backbone.notes)


@pytest.mark.parametrize(
    "law, static, reason",
    [
        (PLASTIC, 0.0, "no friction acts"),
        ('law = "coulomb"', 0.3, "a rigid contact leaves no motion"),
    ],
)
def test_missing_stuck_frequency_has_its_reason(law, static, reason):
    """Without friction nothing sticks, and a rigid contact holds the only mode: both give the reason."""
    scene = pf.load(make_shaken_block(law), **{"friction.static": static})
    model = pf.build(scene)
    backbone = compute_backbone(model, "", [1e-5], ("quasi-static",))
    answer = backbones.make_backbone_answer(backbone, model.source)
    assert answer.quantities["stuck_frequency"].value is None
    assert answer.quantities["stuck_frequency"].reason == reason


def test_exact_balanced_motion_repeats_after_a_cycle():
    """A motion with the damping of the balance returns to its amplitude after a cycle within 1e-9.

    The amplitude was once the largest of 4096 samples, which is 3e-7 too small.
    """
    backbone = compute_backbone(
        build_block('law = "tanh"\nreference_speed = "0.5 m/s"'),
        "",
        amplitudes := [6e-4, 8e-4, 1.2e-3],
        ("balance",),
    )
    curve = backbone.curves["balance"]
    for start, f, zeta in zip(amplitudes, curve.frequency, curve.damping):
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


def test_exact_rigid_friction_damping_agrees_with_closed_form():
    """Frequency and damping of a block on Coulomb friction agree with their closed form within 1e-9.

    At an amplitude A, with h = F/k lost per half period, the gain G = (A/h + 1)/(A/h - 1) gives the net damping ratio -z
    by pi z/sqrt(1 - z^2) = ln G. Under a static friction of four times F the block sticks at small amplitudes.
    """
    h = 30 / (0.5 * OMEGA**2)
    amplitudes = h * np.array([3, 10, 200])
    backbone = compute_backbone(build_block('law = "coulomb"'), "", amplitudes)
    balance = backbone.curves["balance"]
    sticking = build_block('law = "coulomb"\nkinetic = 0.075')
    assert compute_backbone(sticking, "", [0.6 * h, 20 * h]).curves["balance"].amplitude == 20 * h
    assert list(backbone.missing) == ["quasi-static"]
    assert "has no finite stiffness" in backbone.missing["quasi-static"]
    gain = np.log((amplitudes + h) / (amplitudes - h))
    net_ratio = gain / np.hypot(np.pi, gain)
    omega = OMEGA * np.sqrt(1 - net_ratio**2)
    assert balance.frequency == pytest.approx(omega / (2 * np.pi), rel=1e-9)
    assert balance.damping == pytest.approx((net_ratio + 0.002) * OMEGA / omega, rel=1e-9)
    assert backbone.exponents.micro is None and backbone.exponents.gross == pytest.approx(1)


def test_exact_backbone_of_cubic_spring_agrees_with_duffing():
    """The backbone of a cubic spring agrees with Duffing's to first order within 1e-6.

    It is omega^2 = omega_0^2 + 3 k3 A^2/(4 m), and the damping is that of the structure alone.
    """
    scene = STRUCTURE + '[structure.stiffening]\ncubic = "1e9 N/m^3"\n'
    amplitudes = np.array([1e-5, 1e-4])
    backbone = compute_backbone(pf.build(scene), "", amplitudes, ("balance", "quasi-static"))
    omega = np.sqrt(OMEGA**2 + 0.75e9 * amplitudes**2 / 0.5)
    assert backbone.curves["balance"].frequency == pytest.approx(omega / (2 * np.pi), rel=1e-6)
    static = np.sqrt(OMEGA**2 + 1e9 * amplitudes**2 / 0.5)
    assert backbone.curves["quasi-static"].frequency == pytest.approx(
        static / (2 * np.pi), rel=1e-9
    )
    assert backbone.curves["balance"].damping == pytest.approx(0.002 * OMEGA / omega, rel=1e-5)


def test_modes_are_selected_by_name_and_matched_by_shape():
    """The stuck mode with the largest part of a named mode is selected, whatever its order in frequency."""
    scene = make_shaken_block('law = "elastic-plastic"\nbond_length = "1 um"').replace(
        "[drive]",
        """[[structure.mode]]
name = "yaw"
frequency = "80 Hz"
damping = 0.01
slide = 0.1
[drive]""",
    )
    rig = pf.build(scene)
    backbone = compute_backbone(rig, "axial", [1e-8], ("balance",), errors=False)
    k = np.diag([OMEGA**2, (160 * np.pi) ** 2]) + 30e6 / 0.5 * np.outer([1, 0.1], [1, 0.1])
    assert backbone.frequencies.stuck == pytest.approx(
        np.sqrt(np.linalg.eigvalsh(k)[-1]) / (2 * np.pi)
    )
    assert backbone.curves["balance"].frequency == pytest.approx(
        backbone.frequencies.stuck, rel=1e-6
    )
    low = compute_backbone(rig, "yaw", [1e-9], ("quasi-static",), errors=False)
    first = np.sqrt(np.linalg.eigvalsh(k)[0]) / (2 * np.pi)
    assert low.curves["quasi-static"].frequency == pytest.approx(first, rel=1e-6)
    with pytest.raises(pf.PatchfemError, match="the modes of the rig are axial, yaw"):
        compute_backbone(rig, "pitch")


def test_refuses_scenes_without_a_rig():
    """A scene without a rig is refused, and a method that does not apply to the law states the reason."""
    with pytest.raises(pf.PatchfemError, match="needs the scene of a rig"):
        compute_backbone(
            pf.build(
                '[normal]\nload = "1 N"\n[friction]\nlaw = "coulomb"\nstatic = 0.3\n[slide]\nkind = "sine"\n'
                'amplitude = "1 mm"\nfrequency = "10 Hz"\n'
            )
        )
    backbone = compute_backbone(
        build_block('law = "tanh"\nreference_speed = "1 mm/s"'), "", [1e-2, 2e-2]
    )
    assert "sliding speed" in backbone.missing["quasi-static"] and set(backbone.curves) >= {
        "balance"
    }
    grooves = '[normal.grooves]\nwavelength = "80 um"\namplitude = "6.5 um"\n'
    model = pf.build(make_shaken_block(PLASTIC) + grooves)
    backbone = compute_backbone(model, "", [1e-5])
    assert backbone.missing == {
        "balance": "balance cannot be computed on grooves",
        "quasi-static": "static curve cannot be computed on grooves",
    }
    answer = backbones.make_backbone_answer(backbone, model.source)
    for reason in backbone.missing.values():
        assert any(reason in note for note in answer.remarks.notes)
    assert format_curves(answer) == {}


@pytest.mark.parametrize(
    "scene, message",
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
def test_refuses_modes_without_a_backbone(scene, message):
    """Zero load with a cubic spring, an output that does not move and a mode at 0 Hz are refused."""
    with pytest.raises(pf.PatchfemError, match=message):
        compute_backbone(pf.build(scene))


def test_exact_damper_between_masses_agrees_with_eigenvalues():
    """The curves of two masses with a damper satisfy their characteristic equations within 1e-9.

    For the balance it is det((k - m w^2) + i w (c - 2 zeta w m)) = 0.
    """
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
""" + STRUCTURE[STRUCTURE.index("[drive]") :]
    curves = compute_backbone(pf.build(scene), "2", [1e-4]).curves
    k = np.array([[3e5, -1e5], [-1e5, 1e5]])
    m = np.diag([0.5, 0.3])
    c = np.diag([40.0, 0])
    w = 2 * np.pi * curves["balance"].frequency[0]
    zeta = curves["balance"].damping[0]
    assert abs(
        np.linalg.det(k - m * w**2 + 1j * w * (c - 2 * zeta * w * m))
    ) < 1e-9 * np.linalg.det(k)


def test_amplitudes_stay_within_travel():
    """The default amplitudes stay within the travel of the structure, and larger ones are refused."""
    stopped = pf.build(
        make_shaken_block(IWAN).replace("moving_mass", 'travel = "0.2 mm"\nmoving_mass')
    )
    backbone = compute_backbone(stopped, methods=("quasi-static",))
    assert backbone.curves["quasi-static"].amplitude[-1] == pytest.approx(0.2e-3 / 1.15)
    with pytest.raises(
        pf.PatchfemError, match=r"structure\.travel: the largest amplitude, 300 um, is larger than"
    ):
        compute_backbone(stopped, "", [1e-4, 3e-4])


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


@pytest.mark.slow
def test_curve_continues_beyond_a_fold():
    """The curve of a blade with a damper continues beyond its fold near 26 um.

    Frequency and damping there agree with a computation of these amplitudes alone.
    """
    amplitudes = np.array([25e-6, 28e-6, 40e-6])
    rig = pf.build(FOLDED, **{"accuracy.tolerance": 0.1})
    backbone, found_alone = (
        compute_backbone(rig, "", given, ("balance",), errors=False)
        for given in (amplitudes, amplitudes[1:])
    )
    whole = backbone.curves["balance"]
    beyond = found_alone.curves["balance"]
    assert whole.amplitude == pytest.approx(amplitudes) and beyond.amplitude == pytest.approx(
        amplitudes[1:]
    )
    assert not any("left out" in note for note in backbone.notes)
    assert (np.diff(whole.frequency) < 0).all()
    assert whole.frequency[1:] == pytest.approx(beyond.frequency, rel=1e-6)
    assert whole.damping[1:] == pytest.approx(beyond.damping, rel=1e-5)


def test_motion_of_a_strongly_damped_mode_is_found_without_smaller_ones():
    """Three masses with laws nonlocal, bouc-wen and lugre: a free motion whose search needs new derivatives often is found
    from that of sticking contacts, and is that which is followed from half of the amplitude."""
    scene, _ = make_backbone_scene(FIRST_BACKBONE_SEED + 11)
    amplitude = 60.8134e-6
    found = [
        pf.backbone(scene, amplitudes=amplitudes, method="balance").sel(balance_amplitude=amplitude)
        for amplitudes in ([amplitude, 66.482e-6], [0.5 * amplitude, amplitude])
    ]
    for name in ("balance_frequency", "balance_damping"):
        at_once, followed = (float(curves[name]) for curves in found)
        assert at_once == pytest.approx(followed, rel=1e-6)


CROWNED = (
    """\
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
"""
    + STRUCTURE
)


@pytest.mark.long
def test_always_errors_of_micro_slip_include_the_mesh():
    """The errors in micro-slip cover the difference from a finer mesh at 95 % of the amplitudes.

    Below the yield displacement of its first node neither a mesh nor one with half its nodes slips,
    but a finer mesh does.
    """
    coarse, fine = (
        compute_backbone(
            pf.build(CROWNED, **{"accuracy.tolerance": tolerance}),
            "",
            np.geomspace(1e-9, 1e-5, 25),
            ("quasi-static",),
        )
        for tolerance in (1e-2, 2e-4)
    )
    coarse_curve = coarse.curves["quasi-static"]
    fine_curve = fine.curves["quasi-static"]
    for name in ("frequency", "damping"):
        difference = abs(getattr(coarse_curve, name) - getattr(fine_curve, name))
        error = getattr(coarse_curve, f"{name}_error")
        assert np.mean(difference <= error + getattr(fine_curve, f"{name}_error")) >= 0.95, name
    viscous = coarse_curve.damping[0] * coarse_curve.frequency[0] / 100
    # No node of this mesh slips.
    assert (
        viscous == pytest.approx(0.002, rel=1e-9)
        and coarse_curve.damping_error[0] > 1e-6 * coarse_curve.damping[0]
    )
    assert fine.exponents.micro == pytest.approx(3, abs=0.3)
    assert coarse.exponents.micro is None


@pytest.mark.long
@pytest.mark.parametrize("slide", [1.0, 0.01])
def test_default_amplitudes_end_where_mode_is_nearly_free(slide):
    """The default amplitudes end where the frequency is within 5 % of the free one.

    For a relative displacement of a hundredth of the output they once ended at 7 m instead of 0.7
    mm if no `travel` was given.
    """
    rig = pf.build(make_shaken_block(IWAN).replace("slide = 1.0", f"slide = {slide}\noutput = 1.0"))
    backbone = compute_backbone(rig, "", None, ("quasi-static",))
    deflected = 30 * slide / (0.5 * OMEGA**2)  # displacement by the friction limit [m]
    max_amplitude = max(deflected, 1.5e-3 / slide)
    assert backbone.curves["quasi-static"].amplitude[-1] == pytest.approx(
        15 * max_amplitude, rel=1e-6
    )
    assert backbone.curves["quasi-static"].frequency[-1] < 1.05 * backbone.frequencies.free


def test_bonds_without_closed_loop_state_the_method_to_use():
    """For bonds without a closed loop the reason names the method that works, and it does work."""
    bonds = build_block('law = "nonlocal"\nreading = "stretch"\norder = 2\nbond_length = "1 um"')
    (reason,) = compute_backbone(bonds, "", [3e-7], ("balance",)).missing.values()
    assert reason.endswith("; use --method quasi-static")
    assert not compute_backbone(bonds, "", [3e-7], ("quasi-static",)).missing


def test_always_loops_of_growing_bonds_run_until_they_are_steady():
    """Bonds that grow over tens of cycles have the frequency that follows from the last of 600 cycles of a bench."""
    law = (
        'law = "nonlocal"\nkinetic = 0.2\nbond_length = "1 um"\nrest_growth = "0.02 m/s^2"\n'
        'slip_growth = "20 um"\nrest_speed = "1 mm/s"'
    )
    backbone = compute_backbone(build_block(law), "", [2e-6], ("quasi-static",))
    frequency = float(backbone.frequencies.stuck)
    slide = f'[slide]\nkind = "sine"\namplitude = "2 um"\nfrequency = "{frequency!r} Hz"\ncycles = 600\n'
    bench = make_shaken_block(law).partition("[structure]")[0] + slide
    stiffness = pf.run(bench).measures["secant_stiffness"].value
    curve = backbone.curves["quasi-static"]
    omega = np.sqrt(OMEGA**2 + stiffness / 0.5)
    assert curve.frequency == pytest.approx(omega / (2 * np.pi), rel=1e-6)
    assert curve.frequency_error < 1e-4 * curve.frequency


def test_quasi_static_curve_ends_at_maximum_force():
    """The quasi-static curve ends where the force of an interlock is largest.

    This is at a quarter of its wavelength of 80 um.
    """
    bonded = '[structure.bonded]\nstiffness = "4.6e6 N/m"\nwavelength = "80 um"\n[[structure.mode]]'
    scene = STRUCTURE.replace("[[structure.mode]]", bonded, 1)
    model = pf.build(scene)
    amplitudes = np.array([5e-6, 1e-5, 1.5e-5, 5e-5])
    backbone = compute_backbone(model, "", amplitudes, ("quasi-static",))
    curve = backbone.curves["quasi-static"]
    assert curve.amplitude.size == 3
    # A fit takes the points of the curve at its amplitudes in any order, and knows none beyond the end.
    points = compute_points(model, amplitudes[::-1], "quasi-static")
    assert np.isnan(points[:, 0]).all()
    assert points[:, :0:-1] == pytest.approx(np.array([curve.frequency, curve.damping]), rel=1e-9)
    assert "curve does not reach these" in backbone.notes[0]
    assert backbone.frequencies.free == pytest.approx(np.sqrt(OMEGA**2 + 9.2e6) / (2 * np.pi))


@pytest.mark.long
def test_backbone_of_a_face_states_the_subtracted_joint():
    """The scene in SI of a bench over a face has the stiffness that was subtracted from the modes, as a number."""
    keys = {"contact.area.cells": 32, "slide.amplitude": "1 um"}
    curves = pf.backbone(pf.new("area"), method="quasi-static", amplitudes="1 um..2 um:2", **keys)
    stuck = tomllib.loads(curves.attrs["scene"])["structure"]["measured_stiffness"]
    number, unit = stuck.split()
    assert float(number) == pytest.approx(358e6, rel=5e-3) and unit == "N/m"
