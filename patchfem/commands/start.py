"""Commands for the first hour: a template scene, a demo run, editor support, citations."""

import json
from pathlib import Path

from ..disk import atomic_write
from ..scene import scene as scenes
from ..scene import schema as schemas
from ..scene import starting
from . import examine, sources
from .run import run
from .shared import Json, NoPage, Out, Refused, choose_folder, out_option, print_message


def new(
    kind: str = "",
    /,
    *,
    out: out_option("file to write, such as mine.toml; default: the screen") = None,
):
    """Print a template scene of this KIND; without KIND, list the kinds.

    Example: patchfem new joint -o mine.toml
    """
    if not kind:
        width = max(map(len, starting.TEMPLATE_DESCRIPTIONS))
        for name, description in starting.TEMPLATE_DESCRIPTIONS.items():
            print(f"{name:<{width}}  {description}")
        return
    text = starting.read_template(kind)
    if out is None:
        print(text, end="")
        return
    if out.exists():
        raise Refused(f"{out}: already exists; choose another file with -o, or remove it")

    atomic_write.write_text(out, text)
    print(
        f"{out}: {starting.TEMPLATE_DESCRIPTIONS[kind]}\nnext: patchfem {starting.NEXT_VERBS.get(kind, 'run')} {out}"
    )


def demo(*, out: Out = None, no_page: NoPage = False):
    """Run the scene that comes with the program: the rig of the 1985 report at 143 Hz and 5 g. Write the results to
    out/demo.

    Example: patchfem demo
    """
    scene = starting.find_shipped_scene()
    print_message(f"scene: {scene}; for another template run: patchfem new")
    run(scene, out=choose_folder(out, "demo"), no_page=no_page)


def schema(*, out: out_option("file to write, such as scene.json; default: the screen") = None):
    """Print the JSON schema of a scene, for editors that complete keys and check units. In VS Code with Even Better
    TOML, begin a scene with the line #:schema scene.json.

    Example: patchfem schema -o scene.json
    """
    text = json.dumps(schemas.make_schema(), indent=1, ensure_ascii=False) + "\n"
    if out is None:
        print(text, end="")
        return
    atomic_write.write_text(out, text)
    print(f"{out}: for completion in an editor, begin a scene with the line #:schema {out}")


def doctor(*, json_: Json = False):
    """Print what is installed: versions, size of the cache of compiled code, support for pictures, usable cores, and
    optional packages with the command that installs each.

    Example: patchfem doctor
    """
    findings = examine.check_installation()
    if json_:
        print(json.dumps([finding._asdict() for finding in findings]))
        return
    width = max(len(finding.name) for finding in findings)
    for finding in findings:
        print(
            f"{'ok' if finding.fine else '--'}  {finding.name:<{width}}  {finding.found}"
            + (f"; {finding.cure}" if finding.cure else "")
        )


def cite(scene: Path | None = None, /):
    """Print BibTeX entries for the 1985 report and for this program. With SCENE, print also entries for the papers on
    which the effects of this scene are based.

    Example: patchfem cite rig.toml
    """
    print(sources.bibtex(scenes.load(scene).effect_names() if scene is not None else ()), end="")
