"""Choice of a friction law for a joint, from what an engineer knows about it and wants to compute.

`JOINT_LAWS` is the only table: the questions of `patchfem new joint --ask`, its sentences and the table "Which law for
my joint?" of guide/friction.md come from it.
"""

import textwrap
import tomllib
from collections.abc import Iterable
from typing import NamedTuple

from ..exceptions import PatchfemError
from .keys.types import advise_on_name
from .starting import TEMPLATE_FOLDER

GUIDE_SECTION = 'patchfem/scene/guide/friction.md, "Which law for my joint?"'
NOTHING_KNOWN = "nothing"  # word of KNOWLEDGE_OF_JOINT that excludes the others


class JointLaw(NamedTuple):
    """Friction law, with the questions about a joint that it answers.

    - known: words of KNOWLEDGE_OF_JOINT that the keys of the law need.
    - wanted: words of WISHES_FOR_LAW that the law answers.
    - law: value of `friction.law`.
    - keys: keys of [friction] besides `law` and `static`, and tables of [contact].
    - gives: accuracy of the answer, with its condition.
    - cannot: what the law does not describe.
    - scene: name of a template scene.
    """

    known: list[str]
    wanted: list[str]
    law: str
    keys: list[str]
    gives: str
    cannot: str
    scene: str


_ROWS = tomllib.loads((TEMPLATE_FOLDER.parent / "joint_laws.toml").read_text(encoding="utf-8"))
JOINT_LAWS = tuple(JointLaw(**row) for row in _ROWS["law"])
# Words that a user may answer, with their meanings.
KNOWLEDGE_OF_JOINT: dict[str, str] = _ROWS["knowledge"]
WISHES_FOR_LAW: dict[str, str] = _ROWS["wishes"]


class Choice(NamedTuple):
    """Friction law that is chosen for a user.

    - row: row of JOINT_LAWS with the law.
    - known, wanted: words of both answers: what is known of the joint, and what is to be computed.
    """

    row: JointLaw
    known: list[str]
    wanted: list[str]


def parse_choice(text: str, allowed_words: Iterable[str], option: str) -> list[str]:
    """Parse the words of an answer, separated by commas; a repeated word counts once.

    Parameters
    ----------
    text : str
        Such as "loop, roughness".
    allowed_words : iterable of str
        Words that may occur.
    option : str
        Option of the question, for the message.

    Raises
    ------
    PatchfemError
        If a word is unknown, or if there is none.
    """
    permitted = list(allowed_words)
    parts = [part.strip().lower() for part in text.split(",")]
    chosen = list(dict.fromkeys(part for part in parts if part))
    if not chosen:
        raise PatchfemError(f"{option}: no answer; use one or more of {', '.join(permitted)}")
    for word in chosen:
        if word not in permitted:
            raise PatchfemError(
                f"{option}: unknown answer '{word}'; {advise_on_name(word, permitted)}"
            )
    if NOTHING_KNOWN in chosen and len(chosen) > 1:
        raise PatchfemError(f"{option}: '{NOTHING_KNOWN}' excludes other answers")
    return chosen


def choose_law(known: str, wanted: str) -> Choice:
    """Choose the law that fulfils the most wishes; among equals, the one with the fewest assumptions.

    Parameters
    ----------
    known : str
        Words of KNOWLEDGE_OF_JOINT, separated by commas.
    wanted : str
        Words of WISHES_FOR_LAW, separated by commas.

    Raises
    ------
    PatchfemError
        If an answer has an unknown word or none.
    """
    known_words = parse_choice(known, KNOWLEDGE_OF_JOINT, "--know")
    wanted_words = parse_choice(wanted, WISHES_FOR_LAW, "--want")

    def count_costs(row: JointLaw) -> tuple[int, int, int]:
        """Return the costs of the law in a row of the table.

        The law with the smallest tuple is chosen. They are minus the number of answered wishes, the number of missing
        inputs and that of assumed keys.
        """
        # A friction coefficient can be taken from tables; the other inputs must be measured.
        missing = set(row.known).difference(known_words, {"coefficient"})
        n_answered = len(set(row.wanted).intersection(wanted_words))
        # Of the laws with missing inputs, the one with the fewest assumed values is preferred.
        n_assumed_keys = len(row.keys) if missing else 0
        return -n_answered, len(missing), n_assumed_keys

    return Choice(min(JOINT_LAWS, key=count_costs), known_words, wanted_words)


def format_question(question: str, meanings: dict[str, str]) -> str:
    """Return a question with the possible answers and their meanings, one on each line."""
    width = max(map(len, meanings))
    answers = [f"  {word:<{width}}  {meaning}" for word, meaning in meanings.items()]
    return "\n".join([f"{question} (words, separated by commas)", *answers])


def describe_choice(choice: Choice) -> list[str]:
    """Return sentences on a choice: the law, its limits, and the wishes that it does not answer."""
    row = choice.row
    missing = [word for word in row.known if word not in choice.known]
    unanswered = [word for word in choice.wanted if word not in row.wanted]
    sentences = [
        f"you know {', '.join(choice.known)} and want {', '.join(choice.wanted)}",
        f"law: {row.law}; keys: {', '.join(['static', *row.keys])}",
        f"what it gives: {row.gives}",
        f"what it cannot do: {row.cannot}",
    ]
    if missing:
        assumed = "; ".join(f"{word} ({KNOWLEDGE_OF_JOINT[word]})" for word in missing)
        sentences.append(f"assumed in the scene, because you do not know it: {assumed}")
    if unanswered:
        sentences.append(
            f"not answered by this law: {', '.join(unanswered)}; ask again with --want {unanswered[0]}"
        )
    return [*sentences, f"see {GUIDE_SECTION}"]


def compose_scene(choice: Choice) -> str:
    """Return the scene of the chosen law, with the sentences of `describe_choice` as comments at its head."""
    lines = []
    for sentence in describe_choice(choice):
        # Width of a scene file in characters
        lines += textwrap.wrap(sentence, 120, initial_indent="# ", subsequent_indent="#   ")
    scene = (TEMPLATE_FOLDER / f"{choice.row.scene}.toml").read_text(encoding="utf-8")
    return "\n".join(lines) + "\n\n" + scene
