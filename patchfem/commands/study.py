"""Commands that run a scene many times: error against time, backbone of a mode, fits."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..campaigns import cost as cost_curves
from ..campaigns import numerical_settings
from ..campaigns.backbone import cost as backbone_cost
from ..campaigns.backbone import given_modes
from ..campaigns.backbone import request as backbone_requests
from ..campaigns.fits import request as fit_requests
from ..export import backbones, costs, fits
from ..model import model
from .shared import (
    DEFAULT_OUTPUT,
    NOT_CONVERGED_EXIT_CODE,
    CommandExit,
    OutputGroup,
    Progress,
    Sets,
    UsageError,
    flag_option,
    load_model,
    load_scene,
    print_message,
    repeated_option,
    save,
    text_option,
)


def cost(
    scene: Path,
    /,
    *,
    over: text_option(
        f"vary only one setting, where the scene uses it: {', '.join(numerical_settings.NUMERICAL_SETTINGS)}; also with its "
        "table, such as contact.element_size"
    ) = "",
    of_backbone: flag_option(
        "measure the backbone of the first mode at up to five amplitudes, in place of the run of SCENE",
        "--backbone",
    ) = False,
    set_: Sets = (),
    output_options: OutputGroup = DEFAULT_OUTPUT,
):
    """Measure how the error of SCENE depends on computing time (CPU seconds): one run for each of several tolerances, and
    for each value of the mesh or the steps, whose convergence is shown with its observed order. With -v every setting is
    varied.

    Example: patchfem cost rig.toml --over steps_per_cycle
    """
    subject = cost_curves.RUN
    if of_backbone:
        scene_model = given_modes.prepare_model(_make_backbone_builder(scene, set_), "", ()).model
        subject = backbone_cost.make_backbone_subject(scene_model)
    else:
        scene_model = load_model(scene, set_)
    settings = numerical_settings.NUMERICAL_SETTINGS
    over = numerical_settings.SCENE_KEYS.get(over, over)
    if over and over not in settings:
        raise UsageError(f"cost --over {over}: unknown key; use one of {', '.join(settings)}")
    output = output_options.into(f"{scene_model.source.path.stem}-cost")

    def measure_costs(_):
        """Run the scene with all settings."""
        report = None if output.quiet else print_message
        curves = cost_curves.compute_costs(
            scene_model, over, report, subject, varies_all=output_options.verbose
        )
        return costs.make_cost_answer(curves, scene_model, subject.notes)

    save(measure_costs, output)


def backbone(
    scene: Path,
    /,
    *,
    mode: text_option(
        "name of the mode, such as axial, or its number in a rig of masses; default: the first mode"
    ) = "",
    amplitudes: text_option(
        'amplitudes (half peak-to-peak at the output), such as "1 um..1 mm:25"; default: around '
        "the onset of slip, closer where the damping changes fast"
    ) = "",
    forces: text_option(
        "amplitudes of a sinusoidal force at the output that holds the phase resonance, in place of --amplitudes, such as "
        '"1 N..100 N:9"'
    ) = "",
    over: text_option(
        "key and its values, each of which gives a curve on the same page, such as "
        '"contact.load=6.4 kN,8 kN,9.6 kN"'
    ) = "",
    method: text_option(
        "method that computes the motion, such as balance; possible values: balance, quasi-static; default: both"
    ) = "",
    modes: text_option(
        'frequency, damping ratio and optionally slide of modes that replace those of the scene, such as "120 Hz:0.01, '
        '170 Hz:0.02"; the frequencies are those of the bolted joint'
    ) = "",
    set_: Sets = (),
    output_options: OutputGroup = DEFAULT_OUTPUT,
):
    """Compute frequency and damping ratio of a mode of SCENE against its amplitude, and the force at the output that holds
    it in phase resonance: a curve with a band of what tests measure, and which method holds where. The contact is included;
    [drive] and [slide] are ignored.

    Example: patchfem backbone joint.toml --modes "120 Hz:0.01, 170 Hz:0.02"
    """

    if over and any(text.partition("=")[0] == over.partition("=")[0] for text in set_):
        raise UsageError(f"--over {over}: --set gives this key, too; remove one of them")
    output = output_options.into(f"{scene.stem}-backbone")
    report = output.report and (lambda name: print_message(f"{name} ..."))
    build = _make_backbone_builder(scene, set_)
    request = backbone_requests.BackboneRequest(mode, amplitudes, forces, method, modes, over)

    answer = save(lambda _: backbones.compute_answer(build, request, report), output)
    cases = answer.details.get("cases", [answer.details])
    if not all(case["curves"] for case in cases):
        raise CommandExit(NOT_CONVERGED_EXIT_CODE)


def _make_backbone_builder(scene: Path, set_: tuple[str, ...]):
    """Return the function that builds the model of a scene with the tables of a backbone; `set_` are the texts of --set."""

    def build_model(tables, sets: tuple[str, ...] | None):
        """Build the model of the scene with further changes, or of the scene as written without `sets`."""
        all_sets = () if sets is None else (*set_, *sets)
        return model.build(load_scene(scene, all_sets, prepare=tables))

    return build_model


def fit(
    scene: Path,
    /,
    *,
    to: text_option(
        'measurements; for a scene with [slide]: a loop with the header "time [s],displacement [um],force [N]", '
        'or one written by export; for a rig: a curve with the header "amplitude [um],frequency [Hz],damping [%]", '
        "optionally with "
        "frequency_error [Hz] and damping_error [%], or what import --decay wrote, or responses "
        '"frequency [Hz],input [g],acceleration [g],displacement [um],flag"; for a scene with [wear]: compare.json of two '
        'runs, or a depth of both pieces such as "worn_depth_max=2.5 um..3.5 um"'
    ) = "",
    free: repeated_option(
        'key to fit and its range, such as "friction.static=0.1..0.6"; may be repeated'
    ) = (),
    hold: repeated_option(
        'rows to hold out: the fit predicts them but does not use them, such as "frequency=135 Hz,150 '
        'Hz"'
    ) = (),
    leave_out: text_option(
        "column for cross-validation, such as frequency, input or run: each value of the column is left "
        "out in turn, and the fit to the other rows is scored on the rows left out"
    ) = "",
    starts: Annotated[
        int | None,
        Parameter(
            help="number of starting points inside the ranges, such as 20; the best result is used; default: 8 for rows of "
            "a rig, 6 for a curve of frequency and damping against amplitude, 3 for a loop"
        ),
    ] = None,
    set_: Sets = (),
    output_options: OutputGroup = DEFAULT_OUTPUT,
):
    """Fit values of keys of SCENE to measurements. A bench is fitted to a friction loop. A rig is fitted to rows of
    frequency, input, acceleration and displacement, or to frequency and damping against amplitude. For a scene with
    [wear], the wear coefficient is fitted to a measured wear depth.

    Example: patchfem fit bench.toml --to loop.csv --free "friction.static=0.1..0.6"
    """
    loaded_scene = load_scene(scene, set_)
    output = output_options.into(f"{scene.stem}-fit")
    options = fit_requests.FitOptions(hold, leave_out, starts)
    # the fit to a loop is too short for a progress line
    is_short = fit_requests.choose_kind(loaded_scene, to) == "loop"
    with Progress(output.quiet or output.json_ or is_short) as progress:
        report = None if output.quiet else print_message
        listener = fit_requests.Listener(report, progress)
        answer = save(
            lambda folder: fits.compute_answer(loaded_scene, to, free, options, listener, folder),
            output,
        )
    if answer.details["outcome"] == "not_converged":
        raise CommandExit(NOT_CONVERGED_EXIT_CODE)
