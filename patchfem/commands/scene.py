"""Commands that examine a scene without running it: its mistakes, its plan, its mesh."""

import json
from pathlib import Path
from typing import Any

from .. import core
from ..campaigns.sweeps import parse_request
from ..effects import law_has_trait, list_displayed_absent_effects
from ..formatting import format_quantity, rewrite_powers_of_ten
from ..mesh import files as mesh_files
from ..model import files as model_files
from ..runs import plan as plans
from ..runs.patch import plan as patch_plan
from ..runs.patch import result
from ..scene.files import list_named_files
from .shared import (
    Json,
    Sets,
    UsageError,
    flag_option,
    load_model,
    load_scene,
    note,
    print_message,
    required_out_option,
)
from .sweep import CaseOptions


def check(scene: Path, /, *, set_: Sets = (), json_: Json = False):
    """List every mistake in SCENE and in the files that it names; nothing is computed, so that mistakes that need the
    stiffness of the contact show in `patchfem plan`. A table [sweep] in which every case is invalid counts as a mistake.

    Example: patchfem check rig.toml
    """
    notes = []

    def find_file_mistakes(tables, folder: Path, is_complete: bool) -> list[str]:
        """Return the mistakes in the files that the scene names, and add notes on them; without files import nothing."""
        if not list_named_files(tables):
            return []
        return model_files.find_file_faults(tables, folder, is_complete, notes)

    # all mistakes are raised here
    checked_scene = load_scene(scene, set_, find_file_mistakes)
    notes = [rewrite_powers_of_ten(text) for text in dict.fromkeys([*checked_scene.notes, *notes])]
    content = {
        "kind": checked_scene.kind,
        "effects": checked_scene.effect_names(),
        "remarks": checked_scene.remarks,
        "notes": notes,
    }
    text = f"{scene}: a {checked_scene.kind} scene without mistakes"
    if checked_scene.sweep:
        _, cases = parse_request.read_sweep(scene, set_, CaseOptions().request())
        content["cases"] = len(cases)
        text += f", {len(cases)} cases"

    for remark in checked_scene.remarks:
        print_message(f"{scene}: {remark}")
    for remark in notes:
        note(remark)
    print(json.dumps(content) if json_ else text)


def plan(
    scene: Path,
    /,
    *,
    set_: Sets = (),
    json_: Json = False,
    probe: flag_option(
        "run the scene once without error estimates: measured seconds, and the stiffness of the solved patch"
    ) = False,
    verbose: flag_option(
        "list also the effects that the scene does not name", "-v", "--verbose"
    ) = False,
):
    """Print what a run of SCENE would compute: sizes, the stiffnesses in series and dimensionless groups. Of a
    scene with [sweep] it is the first case; --set chooses another one.

    Example: patchfem plan rig.toml --set contact.tilt.angle="1 mrad"
    """
    loaded_scene = load_scene(scene, set_)
    run_plan = plans.plan_first_case(loaded_scene)
    plan_data = run_plan.as_json()
    if probe:
        from ..runs.probe import run_probe

        measured = run_probe(run_plan)
        plan_data |= {"seconds": measured.seconds["total"], "probe": measured.as_json()}
        if measured.static:
            chain = plan_data["stiffness_chain"]
            chain |= patch_plan.find_solved_links(chain, measured.static)
            plan_data["modes"] = run_plan.modes(chain)
    if json_:
        print(json.dumps(plan_data))
        return
    _print_plan(plan_data, probe or run_plan.model.has_bolted_patch, verbose)


def _print_plan(plan_data: dict[str, Any], is_solved: bool, verbose: bool) -> None:
    """Print a plan: effects, measured time, sentences, stiffnesses and groups.

    Parameters
    ----------
    plan_data : dict
        Plan as JSON, see `pf.plan`.
    is_solved : bool
        Whether the stiffness of the pieces is that of a solved patch.
    verbose : bool
        Whether to list the effects that the scene does not have.
    """
    print(f"kind     {plan_data['kind']}, engine {plan_data['engine']}")

    sizes = []
    for name, count in plan_data["unknowns"].items():
        sizes.append(f"{count} {_format_size_name(name.removesuffix('s') if count == 1 else name)}")
    if sizes:
        print("sizes    " + ", ".join(sizes))

    for sentence in plan_data.get("probe", {}).get("sentences", ()):
        print(f"probe    {sentence}")
    for effect in plan_data["effects"]:
        print(f"  runs   {effect['effect']:<28} {effect['equations']}")
    for sentence in plan_data["verdict"]:
        print(f"says     {rewrite_powers_of_ten(sentence)}")

    # a link is named after bonds only for a law that has bonds
    laws = [effect["effect"].partition("law=")[2] for effect in plan_data["effects"]]
    word = "bonds" if any(law_has_trait(law, "bonds") for law in laws) else "friction"
    links = []
    for name, link in plan_data["stiffness_chain"].items():
        text = link if isinstance(link, str) else format_quantity(link, "N m-1", 4)
        links.append(f"{_format_size_name(name.replace('bonds', word))} {text}")
    print("chain    " + " -> ".join(links))

    # A patch that was not solved has an upper estimate of its shear stiffness.
    is_upper_estimate = not is_solved and any(
        not isinstance(link, str)
        for name, link in plan_data["stiffness_chain"].items()
        if core.remove_interface_number(name) == "pieces_shear"
    )
    if is_upper_estimate:
        print(
            "         the shear stiffness of the pieces is an upper estimate; use --probe to compute it"
        )

    for mode in plan_data.get("modes", ()):
        text = f"mode     {mode['name']} {mode['free_frequency']:.5g} Hz without contact"
        if mode["stuck_frequency"] is not None:
            limit = "at most " * is_upper_estimate
            text += f", {limit}{mode['stuck_frequency']:.5g} Hz while the contact sticks"
        print(text)

    for name, value in plan_data["groups"].items():
        text, unit = plans.DIMENSIONLESS_GROUPS.get(name, (_format_size_name(name), "1"))
        print(f"group    {format_quantity(value, unit, 4):<10} {text}")
    if verbose:
        absent = list_displayed_absent_effects(plan_data["not_in_scene"], plan_data["engine"])
        print(f"absent   {', '.join(absent)}")


def _format_size_name(name: str) -> str:
    """Return the name of a size or of a link as words, with "(about)" for predicted ones."""
    return name.removesuffix("_about").replace("_", " ") + " (about)" * name.endswith("_about")


def mesh(
    scene: Path,
    /,
    *,
    out: required_out_option("mesh.msh or mesh.vtu"),
    set_: Sets = (),
):
    """Write the mesh of the pieces of SCENE, with its tags.

    Example: patchfem mesh rig.toml -o pieces.vtu
    """
    scene_model = load_model(scene, set_)
    if scene_model.patch is None:
        raise UsageError(
            f"{scene}: missing [contact]: only a scene with a patch has a mesh; write the patch of an "
            "interface as the [contact] of a separate scene"
        )
    low, high = result.make_piece_meshes_of_run(scene_model)
    mesh_files.write_mesh(low, out, high)
    for name, body in (("lower", low), ("upper", high or low)):
        print(
            f"{out}: {name} piece, {body.x.size} interface nodes, {body.length:.6g} m long, {body.height:.6g} m tall"
        )
