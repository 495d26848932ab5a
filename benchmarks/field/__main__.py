"""The matrices of docs/generalisation.md: baselines and shipped policies in families at difficulty 1, BARN, among people.

python -m benchmarks.field --check                            # all of it: hours; what was done before is not done again
python -m benchmarks.field --size 100 --only families --families maze rooms
python -m benchmarks.field --only people --baselines "dynamic window" MPPI --policies
python -m benchmarks.field --seeds seeds                      # seeds/1/clutter/policy.zip ...: other training seeds, too
python -m benchmarks.field --minutes 0 --write                # what is kept goes into the package and the docs, where what
                                                              # is kept nowhere any more stays as it is

Every success stands with the exact 95 % interval over scenarios, that of a policy with several training seeds with one over
seeds. Each scenario of a family has a map of its own, of seeds that no training, no suite and no choice of a recipe has met.
Attempts there last 500 steps or four times as long as the shortest path takes at top speed, whichever is more; those of the
challenge 100 s, those among people 60 s. Results are kept piece by piece (`--keep`), and a run
that is started again goes on.
"""

import time
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path

import torch

from benchmarks.field.candidates import Candidate, baselines, knows_the_map, of_the_default_robot, policies
from benchmarks.field.report import DOCS, tables, written
from benchmarks.field.results import Kept, drive, key_of, rows
from benchmarks.field.suites import FAMILIES, FROZEN, Piece, pieces
from benchmarks.report import finish, parser
from sim.baselines.named import TABLED
from sim.errors import SuiteError
from workers.shipped.field import FIELD, Field, FieldRow, Part
from workers.shipped.library import shipped_policies

PARTS: tuple[Part, ...] = ("families", "barn", "people")
USUAL = tuple(name for name in TABLED if name != "random")

# What is asked for (success in percent of the best shipped policy of a family, points below ORCA, scores), of a full run.
FAMILY_TARGETS = {"rooms": 90.0, "passages": 90.0, "maze": 75.0, "warehouse": 97.0, "thicket": 97.0, "clutter": 99.5}
BARN_TARGET = 0.476
PEOPLE_TARGET = 95.0


def figures_of(found: tuple[FieldRow, ...]) -> tuple[dict[str, object], dict[str, float]]:
    """The best mapless policy of each suite, and its target."""
    best: dict[str, object] = {}
    targets: dict[str, float] = {}
    wanted = {**FAMILY_TARGETS, **dict.fromkeys(FROZEN["barn"], BARN_TARGET), FROZEN["people"][0]: PEOPLE_TARGET}
    for suite in dict.fromkeys(row.suite for row in found if row.suite in wanted):
        own = [row for row in found if row.suite == suite and row.policy]
        values = [row.score if row.part == "barn" else round(100.0 * row.success, 1) for row in own]
        best[f"{suite}, best policy"] = max((value for value in values if value is not None), default=None)
        targets[f"{suite}, best policy"] = wanted[suite]
    return best, targets


def asked(
    parts: tuple[Part, ...], families: tuple[str, ...], size: int, who: dict[Part, list[Candidate]]
) -> Iterator[tuple[Candidate, Piece]]:
    """Every candidate with every piece, first pieces before any second one: what is cut off is a smaller run."""
    suites = [(part, suite) for part in parts for suite in (families if part == "families" else FROZEN[part])]
    everything = [list(pieces(part, suite, size)) for part, suite in suites]
    for turn in range(max(map(len, everything), default=0)):
        for own in everything:
            for piece in own[turn : turn + 1]:
                for candidate in who[piece.part]:
                    yield candidate, piece


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure what is not kept yet, and print the matrices in Markdown."""
    known = parser(__doc__)
    known.add_argument("--size", type=int, default=1000, help="scenarios of each family and suite, at most")
    known.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    known.add_argument("--families", nargs="+", choices=FAMILIES, default=FAMILIES)
    known.add_argument("--baselines", nargs="*", choices=tuple(TABLED), default=USUAL)
    known.add_argument("--policies", nargs="*", default=[each.card.name for each in shipped_policies()], metavar="NAME")
    known.add_argument("--seeds", type=Path, help="folder with policies of other training seeds")
    known.add_argument("--keep", type=Path, default=Path("field.jsonl"), help="file of results to go on with")
    known.add_argument("--minutes", type=float, default=float("inf"), help="after which no further piece is begun")
    known.add_argument("--write", action="store_true", help="write the package's file and the docs' tables")
    options = known.parse_args(arguments)
    torch.set_num_threads(1)
    begun, kept = time.time(), Kept(options.keep)
    trained = policies(options.policies, options.seeds)
    who: dict[Part, list[Candidate]] = {part: [*trained, *baselines(options.baselines, part)] for part in PARTS}
    who["families"] = of_the_default_robot(who["families"])
    if options.baselines:
        who["barn"] = [knows_the_map(), *who["barn"]]
    for candidate, piece in asked(tuple(options.only), tuple(options.families), options.size, who):
        if time.time() - begun >= 60.0 * options.minutes:
            break
        if kept.get(key_of(candidate, piece), piece) is None:
            try:
                kept.add(drive(candidate, piece))
            except SuiteError:
                continue  # a policy of another robot
    found = rows(iter(kept))
    measured = Field(command="python -m benchmarks.field", date=datetime.now(UTC).date().isoformat(), rows=found)
    if options.write:
        measured = measured.in_place_of(Field.model_validate_json(FIELD.read_bytes()))
        FIELD.write_text(measured.model_dump_json(indent=1, exclude_defaults=True) + "\n")
        DOCS.write_text(written(DOCS.read_text(), measured))
    print(tables(measured))
    best, targets = figures_of(found)
    finish(
        "field", {"size": options.size, **best, "seconds": round(time.time() - begun)}, at_least=targets, check=options.check
    )


if __name__ == "__main__":
    main()
