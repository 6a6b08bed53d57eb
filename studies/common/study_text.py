"""Answer of a study, read from its docstring, so that it stands in one place."""


def read_answer(text: str) -> str:
    """Return the second paragraph of a docstring on one line."""
    return " ".join(text.split("\n\n")[1].split())
