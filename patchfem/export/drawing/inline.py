"""Pages with pictures drawn beforehand: their style, and a picture in its place."""

import re
from html import escape

from ... import __version__

CSS = """
:root{--ink:#1c2430;--soft:#5d6877;--line:#dfe4ea;--tint:#f4f7fa;--accent:#1f5f99}
body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);max-width:62rem;margin:2rem auto;padding:0 1.2rem}
h1{font-size:1.5rem;margin:0 0 .2rem}h2{font-size:1.1rem;margin:2rem 0 .4rem}
.verdict{background:var(--tint);border-left:4px solid var(--accent);padding:.8rem 1rem;margin:1rem 0;font-size:1.05rem}
.v{white-space:nowrap}.warn{border-color:#c8551b;font-size:1rem}.warn p{margin:.2rem 0}
table{border-collapse:collapse;width:100%;font-size:.92rem}
td,th{padding:.25rem .6rem;border-bottom:1px solid var(--line);text-align:left;vertical-align:top}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}th{color:var(--soft);font-weight:600}
figure{margin:1.6rem 0}figure svg{display:block;width:100%;height:auto}
figcaption,.soft{color:var(--soft);font-size:.9rem}figcaption{margin-top:.3rem}
pre{background:var(--tint);padding:.8rem;overflow:auto;font-size:.82rem}details{margin:.6rem 0}
@media print{details{display:none}body{margin:0}figure{break-inside:avoid}}
"""


def page(title: str, body: str) -> str:
    """The whole page: its title as plain text, its body as HTML below the heading; nothing is fetched."""
    return (f"<!doctype html><html lang=en><head><meta charset=utf-8><meta name=viewport content='width=device-width'>"
            f"<title>{escape(title)}</title><style>{CSS}</style></head><body><h1>{escape(title)}</h1>"
            f"<p class=soft>patchfem {escape(__version__)}</p>{body}</body></html>\n")


def warned(texts: list) -> str:
    """A box of warnings, "" without one."""
    told = "".join(f"<p>{escape(text)}</p>" for text in texts)
    return told and f"<div class='verdict warn'>{told}</div>"


def placed(number: int | str, svg: str, caption: str, alternative: str) -> str:
    """A figure with its caption and the text in its place; one page holds many pictures, so their ids are told apart by
    the number."""
    svg = svg.replace("<svg", f'<svg role="img" aria-label="{escape(alternative, quote=True)}"', 1)
    svg = re.sub(r'\bid="([^"]+)"', rf'id="f{number}\1"', svg)
    svg = re.sub(r'(url\(|href=")#', rf"\1#f{number}", svg)
    return f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>"
