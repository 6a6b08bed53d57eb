"""Pages of the site that are made from what the program itself knows: effects, glossary, commands, Python, code.

In: the records of the package (effects, keys, measures, sources, docstrings) and the scenes of `examples`, which are
run. Out: Markdown and pictures in one folder, written anew at every build.
"""

import ast
import contextlib
import inspect
import os
import re
import subprocess
import sys
from functools import cache
from hashlib import sha256
from pathlib import Path

import examples
import matplotlib
from matplotlib import pyplot
from reference import keys as keys_page
from reference import limits as limits_page
from reference import tried

import patchfem as pf
from patchfem.commands.sources import read_sources
from patchfem.effects import EFFECTS, LAWS
from patchfem.formatting import format_value
from patchfem.measures.rows import MOTION_MEASURE_ROWS
from patchfem.runs.results.patch_rows import PATCH_TABLE
from patchfem.scene.keys.types import list_keys

ROOT = Path(__file__).parents[2]
GLOSSARY = ROOT / "patchfem/scene/GLOSSARY.md"
SHOWN_EFFECTS = [name for name in EFFECTS if not name.startswith("structure.interface.")]
GROUPS = {
    "The patch": "contact",
    "One point": "normal",
    "Friction": "friction",
    "Prescribed slide": "slide",
    "Rig": "structure",
    "Drive": "drive",
    "Wear": "wear",
    "Method": "accuracy",
    "Readings beside": "measured",
    "Many runs": "sweep",
}
TABLES = {header.strip("[]"): model for header, model in keys_page.iterate_tables()}
FENCE = "```"
KINDS = {"patch": "pressure", "bench": "loop", "rig": "history", "linear": "history"}
WITHOUT = 6  # maximum number of rows in a table of changes


def write(folder: Path) -> None:
    """Write all pages into a folder of the site, unless none of their sources has changed."""
    matplotlib.use("Agg")
    (folder / "effects").mkdir(parents=True, exist_ok=True)
    files = sorted(
        [
            *(ROOT / "patchfem").rglob("*.py"),
            *guide_files(),
            GLOSSARY,
            *Path(__file__).parent.glob("*.py"),
        ]
    )
    state = sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
    kept = folder / "made_from"
    if kept.exists() and kept.read_text("utf-8") == state:
        return
    for name, text in examples.FILES.items():
        (folder / "effects" / name).write_text(text, "utf-8")
    pages = {
        "glossary": glossary(),
        "messages": limits_page.format_messages(),
        "commands": commands(),
        "python": python(),
        "code": code(),
        "effects/index": effects_index(),
    }
    pages |= {f"effects/{slug(name)}": effect(name, folder / "effects") for name in SHOWN_EFFECTS}
    for name, text in pages.items():
        (folder / f"{name}.md").write_text(text, "utf-8")
    for path in (*folder.rglob("*.toml"), *folder.rglob("*.csv")):
        # the pages show these scenes; the files would look like scenes written by hand
        path.unlink()
    kept.write_text(state, "utf-8")


def slug(effect: str) -> str:
    """Return the name of the page of an effect."""
    return re.sub(r"[.=]", "-", effect)


def fence(kind: str, text: str) -> str:
    """Return a fenced block of Markdown."""
    return f"{FENCE}{kind}\n{text.strip()}\n{FENCE}"


# --- effects


def effects_index() -> str:
    """Return the list of all effects by group."""
    parts = [
        "# Effects",
        "An effect is on if its table or its value is in the scene. Each page has the equation, a "
        "scene that was run when this site was built, its picture, the keys and the limits of the "
        "effect.",
    ]
    for title, table in GROUPS.items():
        of = [name for name in SHOWN_EFFECTS if re.split(r"[.=]", name)[0] == table]
        parts += [
            f"## {title}",
            keys_page.format_table(
                ("effect", "what it does"),
                [(f"[`{name}`]({slug(name)}.md)", about(name)) for name in of],
            ),
        ]
    listed = "\n".join(slug(name) for name in SHOWN_EFFECTS)
    return "\n\n".join([*parts, fence("{toctree}", f":hidden:\n\n{listed}")]) + "\n"


def effect_table(effect: str) -> tuple:
    """Return table, key and value that turn an effect on, such as ("friction", "law", "coulomb")."""
    selector, _, value = effect.partition("=")
    table, _, key = selector.rpartition(".") if value else (selector, "", "")
    return table, key, value


def about(effect: str) -> str:
    """Describe an effect in the words of the guide or of the records of the keys."""
    table, key, value = effect_table(effect)
    if effect == "sweep":
        return "Keys and their values: the scene is run for each combination."
    if not value:
        return " ".join((TABLES[table].__doc__ or "").split())
    for row in re.findall(r"^\| (.+?) \| (.+) \|$", guide(), re.M):
        if row[0] in (f"`{value}`", f'`{key} = "{value}"`'):
            return remove_links(row[1][:1].upper() + row[1][1:].rstrip(".") + ".")
    return f"One value of `{key}`: {list_keys(TABLES[table])[key].record.meaning}."


def guide_files() -> list:
    """Return the pages of the guide and of the theory, whose tables have a sentence for each law, drive and method."""
    return [
        *sorted((ROOT / "patchfem/scene/guide").glob("*.md")),
        Path(__file__).parent / "theory.md",
    ]


@cache
def guide() -> str:
    """Return the text of the guide."""
    return "\n".join(page.read_text("utf-8") for page in guide_files())


def remove_links(text: str) -> str:
    """A sentence of the guide without its links, which lead elsewhere from here."""
    return re.sub(r"\[([^\]]+)\]\([^)]+\)", r"\1", text)


def effect(name: str, folder: Path) -> str:
    """Return the page of an effect, and draw its picture into the folder."""
    table, key, value = effect_table(name)
    heading = f'`{key} = "{value}"` in `[{table}]`' if value else f"`[{table}]`"
    parts = [
        f"# {heading}",
        about(name),
        "## Equation",
        fence("text", EFFECTS[name].equations),
        "Numbers in brackets are those of the [corrected equations](../../theory.md).",
        "## Scene",
        fence("toml", examples.scene(name)),
        *read_files(name),
        "## Answer",
        *answer(name, folder),
        "## Keys",
        *key_rows(name),
        "## Limits",
        *limits(name),
        *source(name),
    ]
    return "\n\n".join(parts) + "\n"


def read_files(name: str) -> list:
    """Return the first lines of the files that a scene reads."""
    return [
        f"The first lines of `{file}`:\n\n" + fence("text", "\n".join(text.splitlines()[:4]))
        for file, text in examples.FILES.items()
        if f'"{file}"' in examples.scene(name)
    ]


def answer(name: str, folder: Path) -> list:
    """Run a scene with and without the effect; return the table of both and the picture."""
    scene = folder / f"{slug(name)}.toml"
    scene.write_text(examples.scene(name), "utf-8")
    picture = folder / f"{slug(name)}.svg"
    if name == "sweep":
        found = pf.sweep(scene)
        save(pf.plot.sweep(found, "contact_fraction"), picture)
        return [found.attrs["verdict"], f"![Contact fraction against tilt]({picture.name})"]
    result = pf.run(scene, say=lambda text: None)
    kind = "levels" if "levels" in name else KINDS[result.plan.kind]
    save(getattr(result.plot, kind)(), picture)
    words = [
        result.outcome.sentence,
        changes(name, result, folder),
        f"![{kind}: {about(name)}]({picture.name})",
    ]
    words += [f"*Warning of this run:* {text}" for text in result.warnings]
    return [one for one in words if one]


def save(axes, path: Path) -> None:
    """Save a picture as SVG whose bytes depend only on what it shows."""
    figure = axes.figure
    figure.set_size_inches(7, 3.6)
    with matplotlib.rc_context({"svg.hashsalt": "patchfem"}):
        figure.savefig(path, metadata={"Date": None}, bbox_inches="tight")
    pyplot.close(figure)


def changes(name: str, result, folder: Path) -> str:
    """Return the measures that the effect changes by more than their errors.

    Without a run that lacks the effect, return the first measures.
    """
    start, more = examples.EXAMPLES[name]
    plain = None
    if more and not effect_table(name)[2] and name != "contact.approach":
        bare = folder / "without.toml"
        bare.write_text(start, "utf-8")
        with contextlib.suppress(pf.PatchfemError):
            plain = pf.run(bare, say=lambda text: None)
    rows = []
    for measure, one in result.measures.items():
        other = plain.measures.get(measure) if plain is not None else None
        if one.value is None or (plain is not None and not differs(one, other)):
            continue
        rows.append(
            (
                f"`{measure}`",
                format_value(one.value, one.error, one.floor, one.unit),
                *(
                    [format_value(other.value, other.error, other.floor, one.unit)]
                    if plain is not None
                    else []
                ),
            )
        )
    heads = (
        ("measure", "with the effect", "without the effect")
        if plain is not None
        else ("measure", "value")
    )
    return keys_page.format_table(heads, rows[:WITHOUT]) if rows else ""


def differs(one, other) -> bool:
    """Return whether two values of a measure differ by more than both errors and round-off."""
    if other is None or other.value is None:
        return False
    return (
        abs(one.value - other.value)
        > (one.error or 0) + (other.error or 0) + 1e-9 * abs(one.value) + one.floor
    )


def key_rows(name: str) -> list:
    """Return the keys of an effect: all keys of a table, or the keys that a value requires and allows."""
    table, key, value = effect_table(name)
    if name == "sweep":
        return [
            "The keys of this table are dotted keys of the scene in quotes. A value is a list, or a range with its "
            "number of values."
        ]
    model = TABLES[table]
    choices = next((one.choices for one in keys_page.find_selectors(model) if one.key == key), {})
    used = re.findall(r"\w+", " ".join(choices.get(value, ("", ""))))
    keys = list_keys(model)
    named = [key, *used] if value else list(keys)
    rows = [
        keys_page.format_row(keys[one]) for one in named if one in keys and keys[one].accepts_value
    ]
    head = ("key", "kind", "default", "required", "meaning")
    return [keys_page.format_table(head, rows)] if rows else ["This effect has no keys."]


def limits(name: str) -> list:
    """List the effects that cannot be combined with an effect, by trying every other effect."""
    value = effect_table(name)[2]
    said = {}
    if value in LAWS:
        law = tried.list_laws()[value]
        for one in (*tried.RIGS, *tried.MORE, *tried.BENCHES):
            for sentence in tried.find_refusal(law, one):
                said.setdefault(sentence, []).append(one.words)
    elif name != "sweep":
        for other in SHOWN_EFFECTS:
            for sentence in refusing_sentences(name, other):
                said.setdefault(sentence, []).append(f"`{other}`")
    rows = [(", ".join(dict.fromkeys(words)), sentence) for sentence, words in said.items()]
    more = "[Limits](../../../../patchfem/scene/LIMITS.md) has the bounds of all numbers and what the models neglect."
    return [
        *(
            [keys_page.format_table(("cannot be combined with", "message"), rows)]
            if rows
            else ["This effect can be combined with every other effect that the scene can have."]
        ),
        more,
    ]


def refusing_sentences(name: str, other: str) -> list:
    """Return the sentences with which the scene of an effect refuses another effect that is not implemented for it."""
    start, more = examples.EXAMPLES[name]
    blocks = examples.blocks(start) | examples.blocks(more)
    own = examples.blocks(more)
    added = examples.blocks(examples.EXAMPLES[other][1])
    if not added or set(added) & (
        set(own) | {"[accuracy]", "[drive]", "[slide]", "[measured]", "[sweep]"}
    ):
        return []
    both = "".join((blocks | added).values())
    try:
        pf.load(both)
    except pf.SceneError as fault:
        return [
            re.sub(r"^[^:]*(?::\d+)?: ", "", line)
            for line in fault.mistakes
            if "not supported yet" in line
        ]
    return []


def source(name: str) -> list:
    """Return the papers on which an effect is based."""
    found = [one.fields for one in read_sources() if name in one.effects]
    return (
        [
            "## Source",
            *(
                f"{one['author'].replace(' and ', ', ')}: {one['title']}. {one['journal']} {one['volume']}, "
                f"{one['pages']} ({one['year']}).".translate(
                    str.maketrans("", "", '{}\\"')
                ).replace("--", "-")
                for one in found
            ),
        ]
        if found
        else []
    )


# --- glossary, commands, Python, code


def glossary() -> str:
    """Return every term and every measure in one alphabetical list."""
    words = glossary_terms()
    for row in (*PATCH_TABLE.values(), *MOTION_MEASURE_ROWS):
        text = f"{row.text[:1].upper()}{row.text[1:]} [{row.unit}]. A measure: `{row.name}` in `summary.json`."
        words.setdefault(row.name.replace("_", " "), text)
    body = "\n\n".join(
        f"{term}\n  {text}" for term, text in sorted(words.items(), key=lambda one: one[0].lower())
    )
    return (
        f"# Glossary\n\nTerms as this program uses them, and every measure of a run.\n\n"
        f"{fence('{glossary}', body)}\n"
    )


def glossary_terms() -> dict:
    """Return {term: meaning} of the committed glossary, with links as the generated pages need them."""
    table = GLOSSARY.read_text("utf-8").partition("\n## ")[0]
    rows = re.findall(r"^\| ([^|]+) \| ([^|]+) \|$", table, re.M)[1:]
    return {term: re.sub(r"(?<=\]\()[^)#]+", _move_link, meaning) for term, meaning in rows}


def _move_link(link: re.Match) -> str:
    """Return the target of a link of the glossary as a page in studies/site/made has to name it."""
    target = GLOSSARY.parent / link[0]
    return Path(os.path.relpath(target, Path(__file__).parent / "made")).as_posix()


def commands() -> str:
    """Return the first screen and the help of every command, as printed."""
    from patchfem.__main__ import VERBS

    parts = [
        "# Commands",
        "`patchfem` without arguments prints:",
        fence("text", run_patchfem()),
        "The sections below are the texts that `patchfem VERB --help` prints.",
    ]
    for verb in VERBS:
        parts += [f"## patchfem {verb}", fence("text", run_patchfem(verb, "--help"))]
    return "\n\n".join(parts) + "\n"


def run_patchfem(*words: str) -> str:
    """Return what the command line prints on a terminal of 110 columns."""
    environment = dict(examples.ENVIRON, COLUMNS="110")
    return subprocess.run(
        [sys.executable, "-m", "patchfem", *words],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=True,
        env=environment,
    ).stdout


def python() -> str:
    """Return the public names of the package with their docstrings."""
    parts = [
        "# Python",
        "`import patchfem as pf`; each name below is `pf.NAME`. A key with dots is passed as "
        '`**{"contact.load": "26 lbf"}`.',
    ]
    for name in pf.__all__:
        one = pf.api.plot if name == "plot" else getattr(pf.api, name)
        if inspect.isclass(one):
            parts.append(fence("{eval-rst}", f".. autoclass:: patchfem.api.{name}\n   :members:"))
        elif callable(one):
            parts.append(fence("{eval-rst}", f".. autofunction:: patchfem.api.{name}"))
    parts.append(
        fence(
            "{eval-rst}",
            ".. autoclass:: patchfem.api.SweepPlots\n   :members:\n\n.. autoclass:: "
            "patchfem.api.Plots\n   :members:",
        )
    )
    return "\n\n".join(parts) + "\n"


def code() -> str:
    """Return the reading order of the package and the description of each folder."""
    order = re.findall(r"^\d+\. `(\w+)`\s+(.*)$", pf.__doc__, re.M)
    parts = [
        "# How the code is laid out",
        "The folders of the package have an order: a module imports only its own "
        "folder and the folders before it. A test checks every import.",
        "[How to add a law, a gap shape, a drive, a measure](../../../patchfem/ADDING.md) lists the files that "
        "each of them needs. [tests/README.md](../../../tests/README.md) says which test proves what.",
    ]
    for name, words in order:
        file = ROOT / "patchfem" / name / "__init__.py"
        file = file if file.exists() else file.parent.with_suffix(".py")
        text = ast.get_docstring(ast.parse(file.read_text("utf-8")))
        parts += [f"## {name}", words[:1].upper() + words[1:] + ".", fence("text", text)]
    return "\n\n".join(parts) + "\n"
