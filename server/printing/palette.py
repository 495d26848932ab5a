"""Colours of experiments, as on the pages (`web/src/charts/palette.ts`): told by the id, and so the same everywhere."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

LIGHT = (
    *("#2a55d5", "#cf7d09", "#6ea065", "#6e1972", "#7f6c0c", "#2b99ee"),
    *("#470eae", "#3d3d3d", "#cb3565", "#258b94", "#2f5d1e", "#695197"),
)
DARK = (
    *("#0180d2", "#e8a685", "#93fd9c", "#8c6298", "#9f920a", "#5ea5ca"),
    *("#988bfc", "#e8e8e8", "#c14442", "#24d0c1", "#aaca13", "#eab8fd"),
)
# Lengths of dash and gap, in widths of the line; the first is drawn through.
DASHES: tuple[tuple[int, ...], ...] = ((), (6, 3), (2, 2), (8, 2, 2, 2))
_FNV_START, _FNV_PRIME, _BITS = 0x811C9DC5, 0x01000193, 0xFFFFFFFF


@dataclass(frozen=True)
class Look:
    """Of a line: the place of its colour in `LIGHT` and `DARK`, and of its dashes in `DASHES`."""

    color: int
    dash: int = 0

    @property
    def ink(self) -> str:
        """The colour as CSS; a file that holds `STYLE` has it in its reader's scheme, any other the light one."""
        return f"var(--line-{self.color}, {LIGHT[self.color]})"

    def dashes(self, width: float) -> str:
        """SVG's attribute for a line of this width, in pixels; empty for one that is drawn through."""
        lengths = " ".join(f"{length * width:g}" for length in DASHES[self.dash])
        return f' stroke-dasharray="{lengths}"' if lengths else ""


def _variables(colors: Iterable[str]) -> str:
    return " ".join(f"--line-{place}: {color};" for place, color in enumerate(colors))


STYLE = f":root {{ {_variables(LIGHT)} }}\n@media (prefers-color-scheme: dark) {{ :root {{ {_variables(DARK)} }} }}\n"


def color_of(experiment_id: str) -> int:
    """The colour that stays with an experiment: FNV-1a of its id."""
    value = _FNV_START
    for letter in experiment_id:
        value = ((value ^ ord(letter)) * _FNV_PRIME) & _BITS
    return value % len(LIGHT)


def looks_of(experiment_ids: Iterable[str]) -> Mapping[str, Look]:
    """The looks of experiments that are drawn together, in order: of those of one colour the second is dashed, and so on."""
    looks: dict[str, Look] = {}
    drawn = [0] * len(LIGHT)
    for each in dict.fromkeys(experiment_ids):
        color = color_of(each)
        looks[each] = Look(color, drawn[color] % len(DASHES))
        drawn[color] += 1
    return looks
