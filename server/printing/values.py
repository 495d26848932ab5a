"""Values of settings in words, as the pages write them (web/src/form/settingText.ts, web/src/lib/format.ts)."""

import math
import re
from collections.abc import Mapping
from typing import Any

from workers.wording import MINUS, counted

NOTHING = "–"
SPELLED: Mapping[str, str] = {
    "cpu": "CPU",
    "cuda": "CUDA",
    "ddpg": "DDPG",
    "lidar": "LiDAR",
    "mlp": "MLP",
    "ppo": "PPO",
    "relu": "ReLU",
    "resblock": "ResBlock",
    "sac": "SAC",
    "td3": "TD3",
}
"""Names that are not spelled as words are."""

# Of a setting's number.
_DIGITS = 6
# What is less is written with a power of ten.
_SMALL = 1e-4
# What makes a text a formula, or else something that was typed.
_TYPED = re.compile(r"[^\w\s-]", re.ASCII)


def setting_text(value: Any) -> str:
    """A value of a setting: "20 000", "yes", "ReLU", "64, 64", "Proximity −5 (margin 0.3)"."""
    match value:
        case None:
            return NOTHING
        case bool():
            return "yes" if value else "no"
        case int() | float():
            return counted(value) if float(value).is_integer() else significant(value, _DIGITS)
        case str():
            return value if _TYPED.search(value) else spelled_out(value)
        case list() | tuple():
            return ", ".join(map(setting_text, value)) or "none"
    return _term_text(value)


def spelled_out(name: str) -> str:
    """A name of the code as a person reads it: "Learning rate", "CPU"."""
    text = name.replace("_", " ")
    return SPELLED.get(text, text[:1].upper() + text[1:])


def significant(value: float, digits: int) -> str:
    """So many significant digits at most, without zeros behind the last."""
    size = abs(value)
    if not math.isfinite(value):
        return "not a number"
    if size >= 10**digits:
        return counted(value)
    if 0.0 < size < _SMALL:
        mantissa, _, power = f"{value:.{digits - 2}e}".partition("e")
        text = f"{mantissa.rstrip('0').rstrip('.')}e{int(power)}"
    else:
        text = f"{value:.{digits}g}"
    return text.replace("-", MINUS)


def _term_text(term: Mapping[str, Any]) -> str:
    """A term of a list in a few words."""
    called = next((term[key] for key in ("label", "name") if term.get(key) is not None), None)
    head = [] if called is None else [spelled_out(str(called))]
    if term.get("weight") is not None:
        head.append(setting_text(term["weight"]))
    more = [
        str(value) if key == "formula" else f"{key} {setting_text(value)}"
        for key, value in term.items()
        if key not in ("name", "label", "weight") and value is not False
    ]
    inside = ", ".join(more)
    return f"{' '.join(head)} ({inside})" if head and more else " ".join(head) or inside
