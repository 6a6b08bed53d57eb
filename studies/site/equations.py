"""Equations as MathML, which browsers draw without a script and without a server."""

from docutils import nodes
from latex2mathml.converter import convert


def _inline(self, node) -> None:
    self.body.append(convert(node.astext()))
    raise nodes.SkipNode


def _display(self, node) -> None:
    number = f'<span class="eqno">({node["number"]})</span>' if node.get("number") else ""
    drawn = convert(node.astext(), display="block")
    self.body.append(
        f'<div style="overflow: auto; margin: 1em 0; padding: 0.3em 0">{number}{drawn}</div>'
    )
    raise nodes.SkipNode


def setup(app) -> dict:
    """Register the renderer for `html_math_renderer`."""
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))
    return {"parallel_read_safe": True}
