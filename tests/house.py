"""Count the size and the style of the sources by folder, and compare the counts with a baseline.

    python tests/house.py                    print the counts of every folder, and the sums
    python tests/house.py patchfem/contact   print every line of a folder that breaks a rule
    python tests/house.py --lower            lower the baseline `tests/house.toml` to the present counts
    python tests/house.py --add N7 N8        put the present counts of new rules into the baseline

`tests/test_house.py` fails if a count exceeds the baseline. A count that has to rise is raised by hand in the
baseline, in the commit that gives the reason. Tokens leave out comments and docstrings, so that neither
documentation nor the format of a file changes them. Rules of style are counted in the package and in the
studies. In the tests are counted imports from modules inside a folder of the package (`deep`), private names and
uses of monkeypatch.

A deep import reaches behind the border of a folder (`inner`) if the name is not one that the folder offers to the
package: no module of another folder imports it, or reads it as an attribute of a module that it imports. A test of an
offered name breaks only if the package itself has to change at the same border; a test of an inner name breaks with
every change inside the folder.
"""

import ast
import re
import sys
import tomllib
from collections import Counter, defaultdict
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
if __name__ == "__main__":
    sys.path.insert(0, str(ROOT / "tests/support"))

from import_graph import child_nodes, syntax_nodes  # noqa: E402

BASELINE = "tests/house.toml"
TREES = ("patchfem", "studies", "tests")
# Modules with the functions of measures.toml; every other module of the package asks them.
MEASURE_TABLES = ("patchfem/measures/rows.py", "patchfem/runs/results/patch_rows.py")
SHOWN_LINES = 12  # largest number of lines that a message lists
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
CALLABLES = (*FUNCTIONS, ast.Lambda)
SCOPES = (*CALLABLES, ast.ClassDef)
DOCUMENTED = (*FUNCTIONS, ast.ClassDef, ast.Module)
COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
# Tokens of Python 3.11, where a formatted string is one token. The module tokenize takes ten times as long.
TOKEN = re.compile(
    r"""(?P<comment>\#[^\n]*)
    | [a-zA-Z]{0,2}(?:\"{3}(?:[^\\]|\\.)*?\"{3} | '{3}(?:[^\\]|\\.)*?'{3} | "(?:[^\\"]|\\.)*" | '(?:[^\\']|\\.)*')
    | (?:\d|\.\d)(?:[\w.]|(?<=[eE])[+-])*
    | \w+
    | \*\*=? | //=? | >>=? | <<=? | \.\.\. | -> | [-+*/%&@|^=<>!:]= | [^\s\\]""",
    re.X | re.S,
)

RULES = {
    "tokens": "tokens of code",
    "N1": "a function is named by a bare participle",
    "N2": "a function is named by an adverb",
    "N3": "a name begins or ends with a preposition",
    "N4": "a function is named by a filler word",
    "N5": "a parameter of one letter that the docstring does not explain",
    "N6": "a constant is named by one filler word, adverb or participle",
    "N7": "a count is named by a plural instead of n_ and the things that it counts",
    "N8": "a public name that another module of the package defines too",
    "N9": "a variable is named by a filler word, or by the participle of what was done with it",
    "C1": "several constants are assigned in one statement",
    "C2": "the comment of a constant is a fragment",
    "C4": "more than 12 constants in a module",
    "D2": "a public function of 3 or more parameters has no sections in its docstring",
    "D3": "a docstring begins with a tuple",
    "D4": "a docstring begins with What, Who, How many, With, As ...",
    "D5": "the first line of a docstring is not a sentence",
    "D6": "the names in the section Parameters are not the parameters",
    "D7": "a docstring of the package quotes a name that its code does not use",
    "F1": "a function returns a bare tuple of 3 or more values",
    "F2": "a function has more than 6 parameters",
    "F3": "a flag that can be passed by position",
    "F5": "a conditional expression inside another",
    "F6": "a conditional expression over several lines",
    "F7": "a comprehension over three lines, or with two `for`",
    "F8": "several values are assigned in one statement",
    "F9": "more than two functions inside a function",
    "R1": "a record with more than 8 fields",
    "K1": "a kernel reads a row of an array by a literal number above 1",
    "M1": "a measure is named outside the tables of measures",
    "deep": "a name imported from a module inside a folder of the package",
    "inner": "such a name that no other folder of the package imports",
    "private": "a private name of the package",
    "monkeypatch": "a use of monkeypatch.setattr",
}
IRREGULAR_PARTICIPLES = frozenset(
    "begun bent borne bound broken brought built caught chosen dealt done drawn driven fed felt foreseen found given "
    "gone grown heard held hidden hung kept known laid left lost made meant met paid said seen sent shown sold "
    "sought spent split sprung struck stuck sunk swept taken taught thrown told torn won worn wound written".split()
)
NOUNS_IN_ED = frozenset("embed exceed feed need seed speed".split())
ADVERBS = frozenset(
    "above across afresh after again ahead alike alone along already anew apart around before below beneath beside "
    "between beyond here inside later off once out outside over there together twice under within".split()
)
FILLERS = frozenset(
    "alike any big book cheap close dear done each else every far few found go high how large least low made many mine "
    "more most near now odd one other others out own place plain rest round say seen sharp small some sure then thing "
    "things told way what which who whole why wide worth".split()
)
PREPOSITIONS = frozenset("after at before beyond by from in of over under without".split())
# Names such as `from_file` and `to_text` are idiomatic.
VERBS_BEFORE_PREPOSITION = ("from_", "to_", "as_", "on_", "at_", "in_", "by_")
# Variables that tell a reader nothing, besides the bare participles of which the noun is missing
VAGUE_VARIABLES = frozenset(
    "done drawn found given most nows seen seens told way what which whole".split()
)
# Names of limits may be plurals of what they limit, and `digits` is the word of Python and NumPy for its number.
COUNT_PREFIXES = ("n_", "max_", "min_", "has_")
PLURALS_FOR_COUNTS = frozenset(["digits"])
# Functions that every law or verb has under the same name: one protocol, many modules
PROTOCOL_FOLDERS = ("laws", "commands")
AXES = frozenset("xyztnm_")  # letters of coordinates, time and counts need no explanation
SECTION = re.compile(r"^ *(Parameters|Returns|Yields|Attributes)\n *---", re.M)
# Lines of the section Parameters, without its end; a line that is not indented names parameters
PARAMETERS = re.compile(r"^Parameters\n-+\n(.*?)(?=^\w+\n-+\n|\Z)", re.M | re.S)
OPENING = re.compile(
    r"(What|Who|Whether what|How many|How far|That|With|As|Where|Why|Between which)\b"
)
# A name or dotted names in backquotes, and the quoted names that are not those of the package: modules that only comments
# name, a page, a library, and a column of a file that a user writes
QUOTED = re.compile(r"`([A-Za-z_][\w.]*)(?:\(\))?`")
FOREIGN_NAMES = frozenset("ADDING calendar email mmread scipy socket x_um".split())
FRAGMENT = re.compile(
    r"(above|an?|and|at|below|beyond|by|from|in|its|of|or|over|so|that|times|to|where|which|within)\b"
)


class Breach(NamedTuple):
    """One line that breaks a rule."""

    rule: str
    path: Path
    line: int
    text: str


class Source(NamedTuple):
    """One file: path, text, syntax tree and all nodes of the tree."""

    path: Path
    text: str
    tree: ast.Module
    nodes: tuple


def parse_source(text: str, path: Path) -> Source:
    """Parse the text of a file."""
    nodes = syntax_nodes(text)
    return Source(path, text, nodes[0], nodes)


def list_docstrings(source: Source) -> list:
    """Return (node, docstring) of the module, the functions and the classes that have a docstring."""
    documented = [node for node in source.nodes if isinstance(node, DOCUMENTED)]
    return [(node, text) for node in documented if (text := ast.get_docstring(node, clean=False))]


# ---- the rules


def is_participle(word: str) -> bool:
    """Return whether a word without underscores is a past participle, such as "settled" or "given"."""
    regular = word.endswith("ed") and len(word) > 4 and word not in NOUNS_IN_ED
    return "_" not in word and (regular or word in IRREGULAR_PARTICIPLES)


def name_rules(node):
    """Yield the rules of names that a function breaks."""
    word = node.name.strip("_")
    first = word.partition("_")[0]
    last = word.rpartition("_")[2]
    if is_participle(word):
        yield "N1", node, node.name
    if word in ADVERBS:
        yield "N2", node, node.name
    if (
        "_" in word
        and not word.startswith(VERBS_BEFORE_PREPOSITION)
        and {first, last} & PREPOSITIONS
    ):
        yield "N3", node, node.name
    if word in FILLERS:
        yield "N4", node, node.name


def is_count(target: str, annotation) -> bool:
    """Return whether a parameter or a field of this name and type is a count that does not begin with n_."""
    is_plural = target.endswith("s") and not target.endswith(("ss", "us", "is"))
    return (
        annotation is not None
        and ast.unparse(annotation) in ("int", "int | None")
        and is_plural
        and not target.startswith(COUNT_PREFIXES)
        and target not in PLURALS_FOR_COUNTS
    )


def variable_rules(nodes: tuple):
    """Yield the rules of variables, fields and array rows that a module breaks."""
    for node in nodes:
        if isinstance(node, ast.arg) and is_count(node.arg, node.annotation):
            yield "N7", node, node.arg
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            if is_count(node.target.id, node.annotation):
                yield "N7", node, node.target.id
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            if node.id in VAGUE_VARIABLES:
                yield "N9", node, node.id


def row_rules(nodes: tuple):
    """Yield the rule that a kernel breaks where it reads a row of an array by a literal number above 1."""
    for node in nodes:
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name):
            index = node.slice
            parts = index.elts if isinstance(index, ast.Tuple) else [index]
            rows = [part.value for part in parts if isinstance(part, ast.Constant)]
            if any(isinstance(row, int) and row > 1 for row in rows):
                yield "K1", node, ast.unparse(node)


def list_public_names(source: Source) -> list:
    """Return (name, node) of the functions and classes of a module that have no underscore in front."""
    return [
        (node.name, node)
        for node in source.tree.body
        if isinstance(node, (*FUNCTIONS, ast.ClassDef)) and not node.name.startswith("_")
    ]


def owner_rules(source: Source, n_owners: Counter):
    """Yield the rule that a module breaks where it defines a public name that another module defines too."""
    if not set(PROTOCOL_FOLDERS) & set(source.path.parts):
        for name, node in list_public_names(source):
            if n_owners[name] > 1:
                yield "N8", node, name


def parameter_rules(node, documentation: str):
    """Yield the rules of parameters that a function breaks."""
    positional = [
        arg for arg in (*node.args.posonlyargs, *node.args.args) if arg.arg not in ("self", "cls")
    ]
    parameters = [*positional, *node.args.kwonlyargs]
    explained = set(re.findall(r"\b\w\b", documentation))
    for arg in parameters:
        if len(arg.arg) == 1 and arg.arg not in AXES | explained:
            yield "N5", arg, f"{node.name}({arg.arg})"
    if len(parameters) > 6:
        yield "F2", node, f"{node.name}: {len(parameters)} parameters"
    defaults = dict(zip(reversed(positional), reversed(node.args.defaults)))
    for arg in positional:
        default = defaults.get(arg)
        has_flag = isinstance(default, ast.Constant) and isinstance(default.value, bool)
        if has_flag or getattr(arg.annotation, "id", "") == "bool":
            yield "F3", arg, f"{node.name}({arg.arg})"
    is_public = bool(documentation) and not node.name.startswith("_")
    if is_public and len(parameters) >= 3 and not SECTION.search(documentation):
        yield "D2", node, node.name
    if section := PARAMETERS.search(documentation):
        heads = re.findall(r"^(\S.*?)(?: : .*)?$", section[1], re.M)
        documented = {name.strip(" *") for head in heads for name in head.split(",")}
        stars = [arg for arg in (node.args.vararg, node.args.kwarg) if arg]
        if documented != {arg.arg for arg in (*parameters, *stars)}:
            yield "D6", node, f"{node.name}: {', '.join(sorted(documented))}"


def docstring_rules(node, documentation: str):
    """Yield the rules that the first line of a docstring breaks."""
    first = documentation.partition("\n")[0].rstrip()
    if first.startswith("("):
        yield "D3", node, f"{node.name}: {first}"
    if OPENING.match(first):
        yield "D4", node, f"{node.name}: {first}"
    if first and not first.endswith((".", ":")):
        yield "D5", node, f"{node.name}: {first}"


def find_words(sources: list) -> set:
    """Return the words of the code and of its texts, without comments and docstrings, and the names of the modules."""
    words = set(FOREIGN_NAMES)
    for source in sources:
        text = source.text
        for _, documentation in list_docstrings(source):
            text = text.replace(documentation, "")
        words.update(source.path.with_suffix("").parts, re.findall(r"\w+", re.sub("#.*", "", text)))
    return words


def quoted_name_rules(source: Source, words: set):
    """Yield the rule that docstrings break if they quote a name that is not among the words of the code."""
    for node, documentation in list_docstrings(source):
        for name in QUOTED.findall(documentation):
            if not words.issuperset(name.split(".")):
                yield "D7", node, name


def nodes_of_function(node) -> list:
    """Return the nodes of a function; functions and classes inside it count as single nodes."""
    nodes = child_nodes(node)
    for child in nodes:
        if not isinstance(child, SCOPES):
            nodes += child_nodes(child)
    return nodes


def body_rules(node):
    """Yield the rules that the statements of a function break."""
    longest = 0
    nodes = nodes_of_function(node)
    for part in nodes:
        n_lines = getattr(part, "end_lineno", 0) - getattr(part, "lineno", 0) + 1
        if isinstance(part, ast.Return) and isinstance(part.value, ast.Tuple):
            longest = max(longest, len(part.value.elts))
        elif isinstance(part, ast.IfExp):
            if sum(isinstance(inner, ast.IfExp) for inner in ast.walk(part)) > 1:
                yield "F5", part, node.name
            if n_lines > 1:
                yield "F6", part, node.name
        elif isinstance(part, COMPREHENSIONS) and (n_lines > 2 or len(part.generators) > 1):
            yield "F7", part, node.name
        elif isinstance(part, ast.Assign) and isinstance(part.value, ast.Tuple):
            if any(isinstance(target, ast.Tuple) for target in part.targets):
                yield "F8", part, node.name
    if longest > 2:
        yield "F1", node, f"{node.name}: {longest} values"
    has_inner_scopes = any(isinstance(part, SCOPES) for part in nodes)
    if has_inner_scopes and sum(isinstance(inner, CALLABLES) for inner in ast.walk(node)) > 3:
        yield "F9", node, node.name


def record_rules(node):
    """Yield the rule broken by a NamedTuple or dataclass with too many fields."""
    is_record = re.search(
        "NamedTuple|dataclass", " ".join(map(ast.unparse, [*node.bases, *node.decorator_list]))
    )
    n_fields = sum(isinstance(part, ast.AnnAssign) for part in node.body)
    if is_record and n_fields > 8:
        yield "R1", node, f"{node.name}: {n_fields} fields"


def constant_rules(tree, lines: list):
    """Yield the rules that the constants of a module break."""
    n_constants = 0
    for node in tree.body:
        if not isinstance(node, (ast.Assign, ast.AnnAssign)):
            continue
        target = node.targets[0] if isinstance(node, ast.Assign) else node.target
        names = [
            part.id
            for part in ast.walk(target)
            if isinstance(part, ast.Name) and part.id.strip("_").isupper()
        ]
        n_constants += len(names)
        if names and isinstance(target, ast.Tuple):
            yield "C1", node, ", ".join(names)
        for name in names:
            word = name.strip("_").lower()
            if word in FILLERS | ADVERBS or is_participle(word):
                yield "N6", node, name
        comment = lines[node.end_lineno - 1].partition("  # ")[2]
        if names and FRAGMENT.match(comment):
            yield "C2", node, comment
    if n_constants > 12:
        yield "C4", tree, f"{n_constants} constants"


def style_rules(source: Source):
    """Yield (rule, node, text) for every breach of style in a module."""
    yield from constant_rules(source.tree, source.text.splitlines())
    yield from variable_rules(source.nodes)
    if source.path.name.endswith("_kernels.py"):
        yield from row_rules(source.nodes)
    for node in source.nodes:
        if isinstance(node, FUNCTIONS):
            documentation = ast.get_docstring(node) or ""
            yield from name_rules(node)
            yield from parameter_rules(node, documentation)
            yield from docstring_rules(node, documentation)
            yield from body_rules(node)
        elif isinstance(node, ast.ClassDef):
            yield from record_rules(node)


def measure_names(root: Path) -> frozenset:
    """Return the names of all measures of measures.toml, except those that are constants of measures/rows.py."""
    path = root / "patchfem/measures.toml"
    if not path.is_file():
        return frozenset()
    tables = tomllib.loads(path.read_text("utf-8"))
    constants = re.findall(
        r'^[A-Z_]+ = "(\w+)"', (root / MEASURE_TABLES[0]).read_text("utf-8"), re.M
    )
    return frozenset((tables["motion"].keys() | tables["patch"].keys()) - set(constants))


def measure_rules(nodes: tuple, names: frozenset):
    """Yield the rule that a module breaks where it names a measure."""
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value in names:
            yield "M1", node, node.value


def absolute_module(node, package: tuple) -> str:
    """Return the dotted name of the module of a `from` import in a module of a package."""
    base = package[: len(package) - node.level + 1] if node.level else ()
    return ".".join([*base, *filter(None, [node.module])])


def imported_names(nodes: tuple, package: tuple):
    """Yield the dotted names that a module imports, and the attributes that it reads from imported modules."""
    aliases = {}
    attributes = []
    for node in nodes:
        if isinstance(node, ast.ImportFrom):
            module = absolute_module(node, package)
            for alias in node.names:
                aliases[alias.asname or alias.name] = f"{module}.{alias.name}"
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            attributes.append(node)
    yield from aliases.values()
    for node in attributes:
        if node.value.id in aliases:
            yield f"{aliases[node.value.id]}.{node.attr}"


def offered_names(sources: list, root: Path) -> frozenset:
    """Return the dotted names that modules of other folders import or read: the interface of each folder."""
    package = [source for source in sources if source.path.is_relative_to(root / "patchfem")]
    modules = {".".join(source.path.relative_to(root).with_suffix("").parts) for source in package}
    offered = set()
    for source in package:
        own_folder = ".".join(source.path.relative_to(root).parts[:-1])
        for name in imported_names(source.nodes, source.path.relative_to(root).parts[:-1]):
            # the folder that contains the module, or the module that defines the name
            folder = name.rsplit(".", 1 if name in modules else 2)[0]
            if folder != own_folder:
                offered.add(name)
    return frozenset(offered)


def border_rules(nodes: tuple, offered: frozenset):
    """Yield (rule, node, text) where a test uses a name from inside a folder of the package."""
    modules = set()  # names of imported modules of the package
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "patchfem":
            modules |= {alias.asname or alias.name for alias in node.names}
            for alias in node.names:
                if node.module.count(".") >= 2:
                    name = f"{node.module}.{alias.name}"
                    yield "deep", node, name
                    if name not in offered:
                        yield "inner", node, name
                if alias.name.startswith("_"):
                    yield "private", node, alias.name
    for node in nodes:
        if isinstance(node, ast.Attribute):
            owner = getattr(node.value, "id", "")
            if owner in modules and re.match("_[^_]", node.attr):
                yield "private", node, f"{owner}.{node.attr}"
            if (owner, node.attr) == ("monkeypatch", "setattr"):
                yield "monkeypatch", node, "monkeypatch.setattr"


# ---- the counts


def count_tokens(source: Source) -> int:
    """Count the tokens of a source without comments and docstrings."""
    comments = TOKEN.findall(source.text)  # an empty text for each token that is no comment
    return comments.count("") - len(list_docstrings(source))


def folder_of_file(path: Path, root: Path) -> str:
    """Return the folder under which a file is counted, e.g. patchfem/export for patchfem/export/pages/headline.py."""
    return "/".join(path.relative_to(root).parts[:-1][:2])


class Counts(NamedTuple):
    """Token counts and breaches of the rules in a checkout, by folder."""

    values: dict  # folder -> {rule: count}, without zeros
    breaches: dict  # (folder, rule) -> list of Breach


def count_sources(root: Path = ROOT) -> Counts:
    """Count tokens and breaches of the rules in every folder of a checkout."""
    values = defaultdict(Counter)
    breaches = defaultdict(list)
    paths = sorted(path for tree in TREES for path in (root / tree).rglob("*.py"))
    sources = [parse_source(path.read_text("utf-8"), path) for path in paths]
    offered = offered_names(sources, root)
    measures = measure_names(root)
    package = [one for one in sources if one.path.is_relative_to(root / "patchfem")]
    words = find_words(package)
    n_owners = Counter(
        name
        for source in package
        if not set(PROTOCOL_FOLDERS) & set(source.path.parts)
        for name, _ in list_public_names(source)
    )
    for source in sources:
        folder = folder_of_file(source.path, root)
        values[folder]["tokens"] += count_tokens(source)
        if folder.startswith("tests"):
            found = border_rules(source.nodes, offered)
        else:
            found = [*style_rules(source)]
        if folder.startswith("patchfem"):
            found += quoted_name_rules(source, words)
            found += owner_rules(source, n_owners)
            if str(source.path.relative_to(root)) not in MEASURE_TABLES:
                found += measure_rules(source.nodes, measures)
        for rule, node, text in found:
            values[folder][rule] += 1
            line = getattr(node, "lineno", 1)
            breaches[folder, rule].append(Breach(rule, source.path, line, text))
    return Counts({folder: dict(counter) for folder, counter in values.items()}, dict(breaches))


def read_baseline(root: Path = ROOT) -> dict:
    """Read {folder: {rule: largest count that is allowed}}."""
    return tomllib.loads((root / BASELINE).read_text("utf-8"))


def write_baseline(values: dict, root: Path = ROOT) -> None:
    """Write the baseline, one folder per line."""
    lines = []
    for folder in sorted(values):
        counts = ", ".join(
            f"{rule} = {values[folder][rule]}" for rule in RULES if values[folder].get(rule)
        )
        lines.append(f'"{folder}" = {{ {counts} }}\n')
    head = "# Largest counts that are allowed, by folder: tests/house.py explains them and lowers them.\n"
    (root / BASELINE).write_text(head + "".join(lines), "utf-8")


def exceeded_counts(counts: Counts, baseline: dict) -> list:
    """Return one message for every count above the baseline; the files changed most recently come first."""
    messages = []
    for folder, values in counts.values.items():
        allowed = baseline.get(folder, {})
        for rule, count in values.items():
            if count <= allowed.get(rule, 0):
                continue
            breaches = sorted(
                counts.breaches.get((folder, rule), []), key=lambda one: -one.path.stat().st_mtime
            )
            lines = [f"\n    {one.path}:{one.line}: {one.text}" for one in breaches[:SHOWN_LINES]]
            messages.append(
                f"{folder}: {rule} {count}, allowed {allowed.get(rule, 0)} ({RULES[rule]}){''.join(lines)}"
            )
    return messages


def lower_baseline(counts: Counts, baseline: dict) -> dict:
    """Return the baseline with every count lowered to the present count where this is smaller."""
    lowered = {}
    for folder, values in counts.values.items():
        allowed = baseline.get(folder, values)
        lowered[folder] = {rule: min(count, allowed.get(rule, 0)) for rule, count in values.items()}
    return lowered


def add_rules(counts: Counts, baseline: dict, rules: list) -> dict:
    """Return the baseline with the present counts of new rules."""
    return {
        folder: baseline.get(folder, {}) | {rule: values.get(rule, 0) for rule in rules}
        for folder, values in counts.values.items()
    }


def print_table(values: dict) -> None:
    """Print the sums of the three source trees and the counts of their folders."""
    for tree in TREES:
        folders = {
            folder: counts
            for folder, counts in sorted(values.items())
            if folder.split("/")[0] == tree
        }
        total = sum((Counter(counts) for counts in folders.values()), Counter())
        for folder, counts in {f"{tree} (sum)": total, **folders}.items():
            print(f"{folder:24}", *(f"{rule} {counts[rule]}" for rule in RULES if counts.get(rule)))


def main(words: list) -> None:
    """Run the command line with the given arguments."""
    counts = count_sources()
    if words == ["--lower"]:
        write_baseline(lower_baseline(counts, read_baseline()))
    elif words[:1] == ["--add"]:
        write_baseline(add_rules(counts, read_baseline(), words[1:]))
    elif words:
        for (folder, _), breaches in counts.breaches.items():
            for breach in breaches * (folder == words[0]):
                print(f"{breach.rule} {breach.path.relative_to(ROOT)}:{breach.line}: {breach.text}")
    else:
        print_table(counts.values)


if __name__ == "__main__":
    main(sys.argv[1:])
