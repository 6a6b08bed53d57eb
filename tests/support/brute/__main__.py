"""Score the program on a recipe: `python tests/support/brute [--march] [--references] [--shift=N] [PART ...]`.

The recipe is that of refused combinations, or with `--march` that of rigs and benches for the march. Without options every
scene that the program accepts is run and compared with the references of the recipe. `--references` computes what their
file lacks, from brute force alone. A PART limits the scenes to those whose seed, kind, effect or law it is. `--shift=N`
draws other scenes, whose seeds are higher by N; their references lie in the working folder.

Shifts of campaigns: 20000 (release 3.0, both recipes), 38200 (refused combinations), 36000 (`--march`), 50100 and 50300
(refused combinations under the effect "load").
"""

import json
import sys
from collections import Counter
from pathlib import Path
from time import process_time

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

from campaigns import Row, measure_rows

from brute import march_recipe, recipe, systems
from patchfem.runs.run import run
from patchfem.scene import loads
from patchfem.scene.scene import SceneError

REFERENCES = Path(__file__).with_name("references.json")
MARCH_REFERENCES = Path(__file__).with_name("march_references.json")


def select_scenes(scenes: list[recipe.Scene], parts: list[str]) -> list[recipe.Scene]:
    """Return the scenes of which one of the `parts` is a property; all scenes without parts."""
    return [scene for scene in scenes if not parts or {*map(str, scene[:4])} & {*parts}]


def write_references(scenes, path: Path) -> None:
    """Compute the references that a file lacks by brute force."""
    stored = json.loads(path.read_text("utf-8")) if path.exists() else {}
    for scene in scenes:
        if str(scene.seed) in stored:
            continue
        begin = process_time()
        found = systems.find_reference(scene.text, scene.steps)
        print(
            *scene[:4], f"{process_time() - begin:.1f} s, {found.n_unsolved} unsolved", flush=True
        )
        stored[str(scene.seed)] = found._asdict()
        path.write_text(json.dumps(stored, indent=0, sort_keys=True) + "\n", "utf-8")


def score_scene(scene: recipe.Scene, reference: dict) -> list[Row] | str:
    """Return the rows of a scene beside its reference, or why it has no result."""
    try:
        result = run(loads(scene.text))
    except SceneError as error:
        return f"refused: {error.mistakes[0]}"
    except Exception as error:  # a fault of the program is a row of the report
        return f"no result: {type(error).__name__}: {error}"
    return measure_rows(result.measures, reference["values"], reference["doubts"])


def print_scores(scenes, path: Path) -> None:
    """Run scenes and print each row beside the references of a file, and how many hold per law and per effect."""
    references = json.loads(path.read_text("utf-8"))
    counts = {True: Counter(), False: Counter()}
    n_refused = Counter()
    for scene in scenes:
        rows = score_scene(scene, references[str(scene.seed)])
        if isinstance(rows, str):
            n_refused[f"{scene.kind}, {scene.effect}"] += 1
            print(*scene[:4], rows, flush=True)
            continue
        for row in rows:
            for group in (scene.law, f"{scene.kind}, {scene.effect}", row.name, "all"):
                counts[row.holds][group] += 1
            ratio = row.true_error / max(abs(row.truth), row.floor)
            mark = "holds" if row.holds else "FAILS"
            print(*scene[:4], mark, f"{row}", f"relative {ratio:.1e}", flush=True)
    print("\ngroup: rows whose error holds, of all")
    for group in sorted(counts[True] + counts[False]):
        total = counts[True][group] + counts[False][group]
        print(f"{group}: {counts[True][group]} of {total}")
    print("scenes without a result:", dict(n_refused))


def main(words: list[str]) -> None:
    """Run the command line."""
    is_march = "--march" in words
    shift = sum(int(word[8:]) for word in words if word.startswith("--shift="))
    path = MARCH_REFERENCES if is_march else REFERENCES
    if shift:
        path = Path(f"{path.stem}_{shift}.json")
    made = march_recipe.make_scenes(shift) if is_march else recipe.make_scenes(shift)
    scenes = select_scenes(made, [word for word in words if not word.startswith("--")])
    if "--references" in words:
        write_references(scenes, path)
    else:
        print_scores(scenes, path)


if __name__ == "__main__":
    main(sys.argv[1:])
