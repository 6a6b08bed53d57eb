"""What a study says of itself: question and answer, taken from its docstring, so that they stand in one place."""


def told(text: str) -> tuple:
    """(question, answer): the first and the second paragraph of a docstring, each on one line."""
    question, answer = (" ".join(part.split()) for part in text.split("\n\n")[:2])
    return question, answer
