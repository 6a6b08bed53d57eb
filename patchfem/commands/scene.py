"""Commands that examine a scene without running it: its mistakes, its plan, its mesh."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from ..campaigns.sweeps import parse_request
from ..campaigns.sweeps import plan as sweep_plan
from ..effects import law_has_trait, list_displayed_absent_effects
from ..formatting import format_quantity, rewrite_powers_of_ten
from ..mesh import files as mesh_files
from ..model import files as model_files
from ..response import rows
from ..runs import plan as plans
from ..runs.patch import plan as patch_plan
from ..runs.patch import result
from ..scene.files import list_named_files
from .shared import Json, Sets, UsageError, flag_option, load_model, load_scene, note, print_message
from .sweep import CaseOptions

if TYPE_CHECKING:
    from ..campaigns.sweeps.case_models import SweepScene
    from ..campaigns.sweeps.cases import Cases


def check(scene: Path, /, *, set_: Sets = (), json_: Json = False):
    """List every mistake in SCENE and in the files that it names; nothing is computed. A table [sweep] in which every
    case is invalid counts as a mistake.

    Example: patchfem check rig.toml
    """
    notes = []
    checked_scene = load_scene(
        scene, set_, lambda tables, folder, whole: _find_file_mistakes(tables, folder, whole, notes)
    )
    cases = len(_read_sweep(scene, set_, CaseOptions())[1]) if checked_scene.sweep else None
    for remark in checked_scene.remarks:
        print_message(f"{scene}: {remark}")
    # several tables may give the same note
    notes = [rewrite_powers_of_ten(text) for text in dict.fromkeys([*checked_scene.notes, *notes])]
    for text in notes:
        note(text)

    if not json_:
        count = f", {cases} cases" if cases else ""
        print(f"{scene}: a {checked_scene.kind} scene without mistakes{count}")
        return
    content = {
        "kind": checked_scene.kind,
        "effects": checked_scene.effect_names(),
        "remarks": checked_scene.remarks,
        "notes": notes,
    }
    print(json.dumps(content | ({"cases": cases} if cases else {})))


def _read_sweep(
    scene: Path, sets: tuple[str, ...], what: CaseOptions
) -> "tuple[SweepScene, Cases]":
    """Return the data that all cases of a sweep share, and the cases."""
    return parse_request.read_sweep(scene, sets, what.request())


def _find_file_mistakes(
    tables, folder: Path, is_complete: bool, notes: list[str]
) -> list[tuple[str, str]]:
    """Return the mistakes in the files that a scene names, and append notes on the run to `notes`.

    Without such files nothing is imported.
    """
    if not list_named_files(tables):
        return []
    return model_files.find_file_faults(tables, folder, is_complete, notes)


def plan(
    scene: Path,
    /,
    *,
    set_: Sets = (),
    what: CaseOptions | None = None,
    json_: Json = False,
    probe: flag_option(
        "run the scene once without error estimates: measured seconds, and the stiffness of the solved patch"
    ) = False,
    verbose: flag_option(
        "list also the effects that the scene does not name", "-v", "--verbose"
    ) = False,
):
    """Print what a run of SCENE would compute: sizes, the stiffnesses in series and dimensionless groups. With
    --over, or if SCENE has a table [sweep], plan the whole sweep.

    Example: patchfem plan rig.toml --over "contact.tilt.angle=1e-6 rad..1e-2 rad:9"
    """
    case_options = what if what is not None and what.selects_cases() else None
    loaded_scene = load_scene(scene, set_) if case_options is None else None
    if case_options is not None or loaded_scene.sweep:
        if probe:
            raise UsageError(
                "--probe works for a single case, not for a sweep; give the values of this case with --set "
                "and no --over"
            )
        _plan_sweep(scene, set_, case_options or CaseOptions(), json_, verbose)
        return

    run_plan = plans.plan(loaded_scene)
    plan_data = run_plan.as_json()
    if probe:
        # a plan without a probe computes nothing, so that it needs no engine
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


def _plan_sweep(scene: Path, sets, what: CaseOptions, json_: bool, verbose: bool) -> None:
    """Print the plan of a sweep."""
    sweep_scene, cases = _read_sweep(scene, sets, what)
    plan_data = sweep_plan.plan_sweep(sweep_scene, cases)
    if wrong := cases.warning:
        note(wrong)
    if json_:
        print(json.dumps(plan_data))
        return
    print(
        "case     "
        + ", ".join(f"{key} {text}" for key, text in plan_data["case"].items())
        + " (the first case), which the lines below describe"
    )
    _print_plan(plan_data, False, verbose)
    print(
        f"sweep    {plan_data['cases']} cases of "
        + ", ".join(f"{n} {key}" for key, n in plan_data["values"].items())
    )


def _print_plan(plan_data: dict[str, Any], is_solved: bool, verbose: bool) -> None:
    """Print a plan: effects, measured time, sentences, stiffnesses and groups.

    is_solved: whether the stiffness of the pieces is that of a solved patch.
    verbose: whether to list the effects that the scene does not have.
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

    # without a solved patch a plan has only an upper bound of the shear stiffness of the pieces
    is_upper_estimate = not is_solved and _has_pieces(plan_data["stiffness_chain"])
    _print_chain(plan_data, is_upper_estimate=is_upper_estimate)
    for name, value in plan_data["groups"].items():
        print(f"group    {_format_group(value, name)}")
    if verbose:
        absent = list_displayed_absent_effects(plan_data["not_in_scene"], plan_data["engine"])
        print(f"absent   {', '.join(absent)}")


def _has_pieces(chain: dict[str, float | str]) -> bool:
    """Return whether a chain of stiffnesses has the shear stiffness of the pieces as a number."""
    return any(
        not isinstance(link, str)
        for name, link in chain.items()
        if rows.remove_interface_number(name) == "pieces_shear"
    )


def _print_chain(plan_data: dict[str, Any], *, is_upper_estimate: bool) -> None:
    """Print the stiffnesses in series, and the frequencies of the modes without contact and while it sticks."""
    bonded = any(
        law_has_trait(one["effect"].partition("law=")[2], "bonds") for one in plan_data["effects"]
    )
    links = []
    for name, link in plan_data["stiffness_chain"].items():
        text = link if isinstance(link, str) else format_quantity(link, "N m-1", 4)
        links.append(f"{_format_link(name, bonded)} {text}")
    print("chain    " + " -> ".join(links))
    if is_upper_estimate:
        print(
            "         the shear stiffness of the pieces is an upper estimate; use --probe to compute it"
        )
    for mode in plan_data.get("modes", ()):
        stuck = mode["stuck_frequency"]
        text = f"mode     {mode['name']} {mode['free_frequency']:.5g} Hz without contact"
        if stuck is not None:
            text += f", {'at most ' * is_upper_estimate}{stuck:.5g} Hz while the contact sticks"
        print(text)


def _format_link(name: str, bonded: bool) -> str:
    """Return the name of a spring in the chain of stiffnesses as words.

    It is "bonds" only for a law that has bonds.
    """
    return _format_size_name(name if bonded else name.replace("bonds", "friction"))


def _format_size_name(name: str) -> str:
    """Return the name of a size or of a link as words, with "(about)" for predicted ones."""
    return (
        f"{name.removesuffix('_about')} (about)".replace("_", " ")
        if name.endswith("_about")
        else name.replace("_", " ")
    )


def _format_group(value: float, name: str) -> str:
    """Return a dimensionless group of the plan with its value as text."""
    text, unit = plans.GROUPS.get(name, (_format_size_name(name), "1"))
    return f"{format_quantity(value, unit, 4):<10} {text}"


def mesh(
    scene: Path,
    /,
    *,
    out: Annotated[Path, Parameter(name=["-o", "--out"], help="mesh.msh or mesh.vtu")],
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
