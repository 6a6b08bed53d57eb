"""Pages with pictures drawn beforehand: their style, and a picture in its place."""

import re
from html import escape

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


def placed(number: int | str, svg: str, caption: str) -> str:
    """A figure; one page holds many pictures, so their ids are told apart by the number."""
    svg = re.sub(r'\bid="([^"]+)"', rf'id="f{number}\1"', svg)
    svg = re.sub(r'(url\(|href=")#', rf"\1#f{number}", svg)
    return f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>"
