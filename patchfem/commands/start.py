"""Commands for the first hour: a template scene, a demo run, editor support, citations."""

import json
import sys
from pathlib import Path

from ..disk import atomic_write
from ..scene import joint_laws, starting
from ..scene import scene as scenes
from ..scene import schema as schemas
from . import examine, sources
from .run import run
from .shared import (
    Json,
    NoPage,
    Out,
    Output,
    UsageError,
    flag_option,
    out_option,
    print_message,
    refuse_existing,
    text_option,
)


def new(
    kind: str = "",
    /,
    *,
    out: out_option("file to write, such as mine.toml; default: the screen") = None,
    ask: flag_option(
        "list the answers, and ask what you know about a joint and what you want to compute"
    ) = False,
    know: text_option("answer to the first question of --ask, such as loop,roughness") = "",
    want: text_option("answer to the second question of --ask, such as loss,squeal") = "",
):
    """Print a template scene of this KIND; without KIND, list the kinds.

    With --ask, or --know and --want, write the scene of a joint with the law that suits your answers.

    Example: patchfem new joint -o mine.toml
    """
    if ask or know or want:
        _write_joint(kind, out, know, want)
        return
    if not kind:
        width = max(map(len, starting.TEMPLATE_DESCRIPTIONS))
        for name, description in starting.TEMPLATE_DESCRIPTIONS.items():
            print(f"{name:<{width}}  {description}")
        return
    description = starting.TEMPLATE_DESCRIPTIONS.get(kind, "")
    verb = starting.NEXT_VERB_BY_KIND.get(kind, "run")
    _write_scene(starting.read_template(kind), out, [description], verb)


def _write_scene(text: str, out: Path | None, description: list[str], verb: str) -> None:
    """Write the text of a scene to the file `out`, and print its description and the next command.

    The next command has this verb. Without a file, the text is printed.
    """
    if out is None:
        print(text, end="")
        return
    refuse_existing(out)
    atomic_write.write_text(out, text)
    lines = "\n".join(description)
    print(f"{out}: {lines}\nnext: patchfem {verb} {out}")


def _write_joint(kind: str, out: Path | None, known: str, wanted: str) -> None:
    """Write the scene of a joint that follows from what is known and what is wanted.

    The user is asked for each of both that is "".

    Parameters
    ----------
    kind : str
        Kind of scene that the user asks for. Only "joint" is possible.
    out : Path or None
        File. None prints the scene.
    known, wanted : str
        Words on what is known of the joint, and on what is to be computed, separated by commas.
    """
    if kind != "joint":
        raise UsageError("--ask, --know and --want are for a joint: patchfem new joint --ask")
    refuse_existing(out)
    known = known or _ask(
        "--know", "What do you know about the joint?", joint_laws.KNOWLEDGE_OF_JOINT
    )
    wanted = wanted or _ask("--want", "What do you want to compute?", joint_laws.WISHES_FOR_LAW)
    choice = joint_laws.choose_law(known, wanted)
    _write_scene(
        joint_laws.compose_scene(choice), out, joint_laws.describe_choice(choice), verb="run"
    )


def _ask(option: str, question: str, answers: dict[str, str]) -> str:
    """Ask a question on the terminal and return the answer.

    Parameters
    ----------
    option : str
        Option that answers the question without a terminal, for the message.
    question : str
        Question as it is printed.
    answers : dict
        Word of an answer -> its meaning.

    Raises
    ------
    UsageError
        If there is no terminal, or if the input ends before the answer.
    """
    print_message(joint_laws.format_question(question, answers))
    if sys.stdin is None or not sys.stdin.isatty():
        raise UsageError(f"--ask: no terminal to ask at; give {option}, from {', '.join(answers)}")
    line = sys.stdin.buffer.readline()
    if not line:
        raise UsageError(f"--ask: the input ended before the answer; give {option}")
    return line.decode("utf-8", "replace").strip()


def demo(*, out: Out = None, no_page: NoPage = False):
    """Run the scene that comes with the program: the rig of the 1985 report at 143 Hz and 5 g. Write the results to
    out/demo.

    Example: patchfem demo
    """
    scene = starting.find_shipped_scene()
    print_message(f"scene: {scene}; for another template run: patchfem new")
    run(scene, output_options=Output(out or Path("out") / "demo", no_page))


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
    """Print what is installed: versions, size of the cache of compiled code, support for films, usable cores, and optional
    packages with the command that installs each.

    Example: patchfem doctor
    """
    findings = examine.check_installation()
    if json_:
        print(json.dumps([finding._asdict() for finding in findings]))
        return
    width = max(len(finding.name) for finding in findings)
    for name, fine, found, cure in findings:
        text = f"{'ok' if fine else '--'}  {name:<{width}}  {found}"
        print(f"{text}; {cure}" if cure else text)


def cite(scene: Path | None = None, /):
    """Print BibTeX entries for the 1985 report and for this program. With SCENE, print also entries for the papers on
    which the effects of this scene are based.

    Example: patchfem cite rig.toml
    """
    print(sources.bibtex(scenes.load(scene).effect_names() if scene is not None else ()), end="")
