"""report.html: one page that stands alone, the verdict first; pictures are inline SVG, nothing is fetched."""

import re
from html import escape
from pathlib import Path

import numpy as np

from . import pictures

CSS = """
:root{--ink:#1c2430;--soft:#5d6877;--line:#dfe4ea;--tint:#f4f7fa;--accent:#1f5f99}
body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);max-width:62rem;margin:2rem auto;padding:0 1.2rem}
h1{font-size:1.5rem;margin:0 0 .2rem}h2{font-size:1.1rem;margin:2rem 0 .4rem}
.verdict{background:var(--tint);border-left:4px solid var(--accent);padding:.8rem 1rem;margin:1rem 0;font-size:1.05rem}
.warn{border-color:#c8551b}table{border-collapse:collapse;width:100%;font-size:.92rem}
td,th{padding:.25rem .6rem;border-bottom:1px solid var(--line);text-align:left;vertical-align:top}
td.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}th{color:var(--soft);font-weight:600}
svg{max-width:100%;height:auto}figure{margin:1rem 0}figcaption,.soft{color:var(--soft);font-size:.9rem}
pre{background:var(--tint);padding:.8rem;overflow:auto;font-size:.82rem}details{margin:.6rem 0}
@media print{details{display:none}body{margin:0}}
"""
SHOP = {"m": (("um", 1e6), ("mil", 1 / 25.4e-6)), "m s-2": (("g", 1 / 9.80665),),
        "Pa": (("MPa", 1e-6), ("psi", 1 / 6894.757)),
        "N": (("lbf", 1 / 4.4482216152605),), "N m-1": (("N/um", 1e-6), ("lbf/in", 0.0254 / 4.4482216152605)),
        "rad": (("mrad", 1e3), ("deg", 57.29577951308232)), "J": (("mJ", 1e3), ("in lbf", 8.850745791327184)),
        "N m": (("in lbf", 8.850745791327184),)}


def number(value) -> str:
    """Six significant digits, or a dash for nothing."""
    return "&ndash;" if value is None else f"{value:.6g}"


def shop(value, unit: str) -> str:
    """The value in the units of a workshop, where the unit has any."""
    if value is None or unit not in SHOP:
        return ""
    return " = ".join(f"{value * scale:.4g} {name}" for name, scale in SHOP[unit])


def verdict(data: dict) -> str:
    """The answer in one or two sentences, with the error of each number."""
    measures, parts = data["summary"]["measures"], []

    def said(name, scale, unit, text):
        found = measures.get(name)
        if found and found["value"] is not None:
            error = f" ± {found['error'] * scale:.2g}" if found["error"] is not None else ""
            parts.append(text.format(f"{found['value'] * scale:.4g}{error} {unit}".strip()))

    said("relative_displacement_amplitude", 1e6, "um", "the block moves {} half peak-to-peak")
    said("absolute_acceleration_peak", 1 / 9.80665, "g", "peak acceleration {}")
    if "relative_displacement_amplitude" not in measures:
        said("friction_ratio_peak", 1, "", "friction ratio peaks at {}")
    said("loop_area", 1e3, "mJ", "{} dissipated per cycle")
    said("contact_fraction", 100, "%", "contact on {} of the patch")
    if data["summary"]["kind"] == "patch":
        said("pressure_peak", 1e-6, "MPa", "peak pressure {}")
    outcome = data["summary"]["outcome"]
    return f"<b>{escape(outcome)}</b>: {escape(data['sentence'])} " + escape("; ".join(parts)) + "."


def page(data: dict) -> str:
    """The whole page from the plain data of a run."""
    summary = data["summary"]
    title = summary["title"] or "patchfem run"
    parts = [f"<h1>{escape(title)}</h1><p class=soft>patchfem {escape(summary['patchfem'])} &middot; "
             f"{escape(summary['kind'])} &middot; engine {escape(data['engine'] or 'static')} &middot; "
             f"{summary['seconds'].get('total', 0):.2f} s</p>", f"<p class=verdict>{verdict(data)}</p>"]
    if summary["warnings"]:
        items = "".join(f"<li>{escape(w)}</li>" for w in summary["warnings"])
        parts.append(f"<div class='verdict warn'><ul>{items}</ul></div>")
    parts += _figures(data)
    if "measured" in data:
        parts.append(_table_one(data))
    parts += [_measures(summary), _cost(data)]
    parts.append(f"<details><summary>Scene</summary><pre>{escape(data['scene'])}</pre></details>")
    parts.append(f"<details><summary>Scene in SI, every default written out</summary><pre>{escape(data['resolved'])}"
                 "</pre></details>")
    versions = ", ".join(f"{k} {v}" for k, v in data["versions"].items())
    parts.append(f"<p class=soft>{escape(versions)}</p>")
    body = "\n".join(parts)
    return (f"<!doctype html><html lang=en><head><meta charset=utf-8><meta name=viewport content='width=device-width'>"
            f"<title>{escape(title)}</title><style>{CSS}</style></head><body>{body}</body></html>\n")


def _figures(data: dict) -> list:
    out = []

    def add(svg, caption):
        # one page holds many pictures: their ids must not meet
        tag = f"f{len(out)}"
        svg = re.sub(r'id="([^"]+)"', rf'id="{tag}\1"', svg)
        svg = re.sub(r'(url\(|href=")#', rf"\1#{tag}", svg)
        out.append(f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>")

    if data["x"] is not None and data["fields"]:
        add(pictures.interface(data["x"], data["fields"], "shear_stress" in data["fields"]),
            "Normal stress of the pressed pieces; shear stress in the frames of the last cycle, the largest in colour.")
    if "bodies" in data:
        add(pictures.bodies(data["x"], data["bodies"]["depth"], data["bodies"]["mises"]),
            "Both pieces with their coatings under the load alone.")
    if "loop" in data and np.any(data["loop"]["force"]):
        add(pictures.loop(data["loop"]["slide"], data["loop"]["force"], "Friction loop"),
            "Resultant friction force against the slide of the interface, over the last window.")
    if "history" in data:
        window = None
        if "window" in data:
            w = data["window"]
            late = w["time"] >= w["time"][-1] - 3 * data["loop"]["period"]
            window = {k: v[late] for k, v in w.items()}
        add(pictures.histories(data["history"]["time"], data["history"]["displacement"], window),
            "Displacement over the whole run (thinned before the last window) and the last cycles.")
    if "measured" in data and data["measured"].get("input") is not None:
        m, found = data["measured"], data["summary"]["measures"]
        pair = [(found[k]["value"], found[k]["error"]) for k in ("absolute_acceleration_peak",
                                                                "relative_displacement_amplitude")]
        pair[0] = tuple(None if v is None else v * m["gain"] for v in pair[0])
        add(pictures.measured(m["rows"], m["frequency"], m["input"], *pair),
            "Measured responses at the drive frequency and the computed point"
            + (f" (reading factor {m['gain']:g})." if m["gain"] != 1 else "."))
    return out


def _table_one(data: dict) -> str:
    m, found = data["measured"], data["summary"]["measures"]
    if m.get("input") is None:
        return ""
    rows = []
    for r in m["rows"]:
        if abs(r.frequency - m["frequency"]) > 0.5 or abs(r.input - m["input"]) > 0.01 * m["input"]:
            continue
        for name, key, scale, unit in (("acceleration", "absolute_acceleration_peak", 9.80665, "g"),
                                       ("displacement", "relative_displacement_amplitude", 25.4e-6, "mil")):
            value = getattr(r, name)
            if value is None:
                continue
            mine = found[key]["value"] * (m["gain"] if name == "acceleration" else 1.0)
            kind = f"{name}{' (repeat)' if 'R' in r.flag else ''}"
            rows.append(f"<tr><td>{kind}</td><td class=n>{value / scale:.3g} {unit}</td>"
                        f"<td class=n>{mine / scale:.3g} {unit}</td><td class=n>{mine / value:.2f}</td></tr>")
    if not rows:
        return "<p class=soft>No measured row has this frequency and input.</p>"
    return ("<h2>Against the measurement</h2><table><tr><th>reading<th>measured<th>computed<th>ratio</tr>"
            + "".join(rows) + "</table>")


def _measures(summary: dict) -> str:
    rows = []
    for name, m in summary["measures"].items():
        rows.append(f"<tr><td>{escape(name)}</td><td class=n>{number(m['value'])}</td>"
                    f"<td class=n>{number(m['error'])}</td><td>{escape(m['unit'])}</td>"
                    f"<td>{escape(shop(m['value'], m['unit']))}</td></tr>")
    return ("<h2>Measures</h2><table><tr><th>measure<th>value<th>error (±)<th>unit<th>in other units</tr>"
            + "".join(rows) + "</table>")


def _cost(data: dict) -> str:
    summary = data["summary"]
    rows = "".join(f"<tr><td>{escape(e['effect'])}</td><td>{escape(e['equations'])}</td>"
                   f"<td class=n>{e['seconds']:.4f}</td></tr>" for e in summary["effects"])
    parts = ", ".join(f"{k} {v:.3f} s" for k, v in summary["seconds"].items())
    return (f"<h2>What ran and what it cost</h2><table><tr><th>effect<th>equations<th>seconds</tr>{rows}</table>"
            f"<p class=soft>{escape(parts)}. The law and the modes share one loop; its time stands with the law.</p>"
            f"<p class=soft>Not in the scene, so neither imported nor computed: "
            f"{escape(', '.join(summary['not_in_scene']))}.</p>")


def write_report(path: Path, data: dict) -> None:
    """Write the page."""
    Path(path).write_text(page(data), encoding="utf-8")
