"""A table of pairs on paper: each pair with its verdict and numbers, mean and interval over the pairs, a page."""

from html import escape
from pathlib import Path

from ... import __version__
from ...core import PatchfemError
from ...disk.whole import write_rows, write_text
from ...scales import LADDERS, plain
from ...surface.compare import pairs, verdict
from ...surface.quantity import Mean
from ..pages.document import Section, document, figure, prose, table, warned
from . import compare, pictures, worn

TRACES, SCANS = ("worn_depth_mean", "amplitude_ratio"), ("worn_volume", "worn_depth_mean")  # the main numbers
ABOUT = ("The mean is taken over the pairs that have a value, each with equal weight. The interval is the 95 % "
         "interval of the mean, by Student's t from the scatter of the pairs, or from the intervals of the pairs if "
         "these give a wider interval. The interval does not include an error that all pairs share, such as "
         "calibration. The scatter is the standard deviation of the values of single pairs.")


def answers(asked: list, direction: str = "", done=None, **how) -> list[dict]:
    """The answer of each pair, of files or of results folders, as `compare` gives it (`pairs.each_pair`); how: units,
    shift, keep_spikes, datum of all files, direction: of the traces that tell none."""
    def answer(paths: tuple, own: str) -> dict:
        if not any(one.is_dir() for one in paths):
            return compare.data_of(*verdict.judged(paths, own or direction, **how))
        if own or how.get("shift") is not None:
            raise PatchfemError(f"{'a direction' if own else 'a shift'} can be given only for traces, not for results "
                                "folders")
        lost = worn.lost(*paths)
        return worn.data_of(lost, worn.verdict(lost))

    return pairs.each_pair(asked, answer, done)


def data_of(rows: list) -> dict:
    """Rows and means as plain data in SI."""
    means = [{"group": group, "direction": along or None, "kind": kind, "pairs": count,
              **{name: {**one.mean._asdict(), "scatter": one.scatter, "pairs": one.count}
                 for name, one in found.items()}} for (group, along, kind), count, found in pairs.means_of(rows)]
    for one in means:
        for each in one.values():
            if isinstance(each, dict):
                del each["text"], each["reason"], each["name"]
    return {"patchfem": __version__, "pairs": rows, "means": means, "notes": notes(rows)}


def notes(rows: list) -> list:
    """What a reader of the means has to know, as sentences."""
    done, out = [row for row in rows if row["outcome"] == "done"], []
    firsts = [(pairs.group_of(row), row["before"]) for row in done]
    if len(set(firsts)) < len(firsts):
        out.append("some pairs share the surface measured before wear; the errors of this surface are then common to "
                   "these pairs, and the intervals of the means do not include such common errors")
    for group, count, found in pairs.means_of(rows):
        less = [f"{words(name)} ({one.count})" for name, one in found.items() if one.count < count]
        if less:
            out.append(f"{title(*group)}: not all {count} pairs have a value of {', '.join(less)}; the mean of this "
                       "value says nothing about the other pairs")
    return out


def words(name: str) -> str:
    """A quantity of a pair in words."""
    plainly = name.removesuffix("_x").removesuffix("_y")
    return compare.WORDS[name] if name in compare.WORDS else f"{compare.WORDS[plainly]} along {name[-1]}"


def title(group: str, along: str, kind: str) -> str:
    """Which pairs have means of their own, in words."""
    return ", ".join(filter(None, (group, pairs.KINDS[kind], along and f"along {along}")))


def write_csv(rows: list, path: Path) -> None:
    """Write a row for each pair: its cells, outcome, verdict, message, then each number with the ends of its interval
    in SI; "" stands for what a pair has not."""
    numbers = [pairs.numbers_of(row) for row in rows]
    names = {name: one["unit"] for each in numbers for name, one in each.items()}
    own = ("before", "after", "direction", "outcome", "verdict", "message")
    labels = [name for name in dict.fromkeys(name for row in rows for name in row["labels"])
              if name not in own and name not in names]
    head = [*own[:3], *labels, *own[3:], *(f"{name}{end} [{unit}]" for name, unit in names.items()
                                           for end in ("", "_low", "_high"))]
    lines = [[*(row[name] or "" for name in own[:3]), *(row["labels"].get(name, "") for name in labels),
              *(row.get(name, "") for name in own[3:]),
              *(_cell(each.get(name, {}).get(end)) for name in names for end in ("value", "low", "high"))]
             for row, each in zip(rows, numbers)]
    write_rows(path, [head, *lines])


def _cell(value: float | None) -> str:
    return "" if value is None else repr(value)


def lines_of(rows: list) -> list:
    """The answer as lines: each pair, then the means of each group."""
    out = [headline(rows), ""]
    for row in rows:
        out.append(f"{row['before']} -> {row['after']}{_along(row)}")
        out.append(f"  {row['message'] or row['verdict']}" + "".join(f"; {text}" for text in _lead(row)))
    for group, count, found in pairs.means_of(rows):
        if not found:
            continue
        out += ["", _heading(group, count),
                f"  {'':<38} {'mean':>10}  {'95 %':<22} {'scatter':<12} {'pairs':<5} unit"]
        for name, one in found.items():
            value, interval, unit = compare.shown(one.mean)
            out.append(f"  {words(name):<38} {value:>10}  {interval:<22} {_scatter(one, unit):<12} {one.count:<5} "
                       f"{unit}".rstrip())
    return out


def headline(rows: list) -> str:
    """How many pairs there are, show wear, and failed."""
    failed = sum(row["outcome"] == "failed" for row in rows)
    worn = sum((row[_leading(row)[0]]["low"] or 0.0) > 0 for row in rows if row["outcome"] == "done")
    return f"{len(rows)} pairs, {worn} with detected wear{f', {failed} failed' * (failed > 0)}"


def _leading(row: dict) -> tuple:
    return SCANS if "worn_volume" in row else TRACES


def _along(row: dict) -> str:
    return f", along {row['direction']}" if row["direction"] and _leading(row) == TRACES else ""


def _lead(row: dict) -> list:
    """The main numbers of a pair in words."""
    if row["outcome"] == "failed":
        return []
    out = []
    for name in _leading(row):
        value, interval, unit = compare.shown(pairs.quantity(row[name]))
        if interval:
            out.append(f"{words(name)} {value} ({interval.replace(' .. ', ' to ')}) {unit}".rstrip())
    return out


def _scatter(one: Mean, unit: str) -> str:
    """The scatter in the unit of its mean."""
    steps = {**LADDERS, "m2": (("um^2", 1e12),)}.get(one.mean.unit, ())
    return plain(one.scatter * next((scale for name, scale in steps if name == unit), 1.0), 3)


def page(rows: list, name: str) -> str:
    """The page of a table of pairs, which stands alone."""
    lead = (f"<p class=soft>patchfem {escape(__version__)}</p><div class=verdict><b>{headline(rows)}.</b></div>"
            f"{warned([f'{text}.' for text in notes(rows)])}")
    sections = [Section(f"means{number}", _heading(group, count), _means(number, group, rows, found))
                for number, (group, count, found) in enumerate(pairs.means_of(rows)) if found]
    cells = [[str(row["line"]), *map(escape, (row["before"], row["after"] + _along(row), *row["labels"].values())),
              prose(row["message"] or row["verdict"]), escape("; ".join(_lead(row)))] for row in rows]
    heads = (">line", "before", "after", *map(escape, rows[0]["labels"]), "verdict", "main numbers, 95 %")
    sections.append(Section("pairs", "Each pair", table(heads, cells)))
    return document(f"{name}: pairs before and after", lead, sections)


def _heading(group: tuple, count: int) -> str:
    text = title(*group)
    return f"{text[0].upper()}{text[1:]}: mean of {count} pairs"


def _means(number: int, group: tuple, rows: list, found: dict) -> str:
    """Picture and table of the means of a group."""
    of = [row for row in rows if row["outcome"] == "done" and pairs.group_of(row) == group]
    panels = [(words(name), [(row["line"], pairs.quantity(row[name])) for row in of], found[name].mean)
              for name in _leading(of[0]) if name in found]
    drawn = [figure(f"m{number}", pictures.each_and_mean(panels), "Each point is one pair with its interval, plotted "
                                                                  "over the line number of the pair in the table. The "
                                                                  "band is the mean with its interval.",
                    "; ".join(f"{name}: mean {' '.join(compare.shown(mean)[::2])}" for name, _, mean in panels))
             ] if panels else []
    cells = []
    for name, one in found.items():
        value, interval, unit = compare.shown(one.mean)
        cells.append([escape(words(name)), value, interval, _scatter(one, unit), str(one.count), unit])
    return "\n".join([*drawn, table(("quantity", ">mean", ">95 %", ">scatter", ">pairs", "unit"), cells),
                      f"<p class=soft>{prose(ABOUT)}</p>"])


def write_page(path: Path, rows: list, name: str) -> None:
    """Write the page."""
    write_text(path, page(rows, name))
