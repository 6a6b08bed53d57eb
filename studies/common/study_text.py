"""Question and answer of a study, read from its docstring, so that each stands in one place."""


def read_question(text: str) -> str:
    """Return the first paragraph of a docstring on one line."""
    return " ".join(text.split("\n\n")[0].split())


def read_answer(text: str) -> str:
    """Return the second paragraph of a docstring on one line."""
    return " ".join(text.split("\n\n")[1].split())
