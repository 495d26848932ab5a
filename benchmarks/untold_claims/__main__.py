"""Three claims of the paper that nothing in it tests, each put to a small experiment.

    python -m benchmarks.untold_claims --directory reproduction --seeds 5 --write docs/untold-claims.md
    python -m benchmarks.untold_claims --without ranges speeds      these parts of the observation, and no others

The directory is that of a campaign of `mapless reproduce`: what it has trained is not trained again, and what is trained
here lies beside it. Interrupted, the same command goes on where it was.
"""

from datetime import UTC, datetime
from pathlib import Path

from benchmarks.report import finish, machine, parser
from benchmarks.untold_claims.adaptation import adaptation
from benchmarks.untold_claims.observation import PARTS, observation
from benchmarks.untold_claims.stability import stability
from benchmarks.untold_claims.trainings import Trainings


def main() -> None:
    """Train what is missing, and write the page."""
    options = parser(__doc__)
    options.add_argument("--directory", type=Path, default=Path("reproduction"))
    options.add_argument("--seeds", type=int, default=5)
    options.add_argument("--write", type=Path, default=None, help="the page; printed where it is not given")
    options.add_argument("--without", nargs="+", choices=tuple(PARTS), default=tuple(PARTS), help="parts of the observation")
    arguments = options.parse_args()
    trainings = Trainings(arguments.directory, arguments.seeds)
    sections = [list(observation(trainings, arguments.without)), list(stability(trainings)), list(adaptation(trainings))]
    of = machine()
    chosen = "" if len(arguments.without) == len(PARTS) else f" --without {' '.join(arguments.without)}"
    command = f"python -m benchmarks.untold_claims --seeds {arguments.seeds}{chosen}"
    page = [
        "# What the paper does not test",
        "",
        "Three of the paper's claims are made without a figure that could carry them. Each was put to a small experiment of",
        "ours, beside [the campaign](reproduction.md). They say what holds here, for our reading of the paper, and not what",
        "its authors would have measured. Intervals are 95 % over seeds ([how](statistics.md)).",
        "",
        f"Made by `{command}` in a campaign's directory on {datetime.now(UTC).date().isoformat()}, {of['cores']} cores.",
    ]
    text = "\n".join([*page, *("\n".join(["", *lines]) for lines in sections), ""])
    if arguments.write is None:
        print(text)
    else:
        arguments.write.write_text(text)
    finish("untold_claims", {"seeds": arguments.seeds}, check=arguments.check)


if __name__ == "__main__":
    main()
