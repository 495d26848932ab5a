"""Numbers in sentences, as the pages write them (web/src/lib/format.ts): those of a log, an alert, a caption, an error."""

import math

NARROW_SPACE = "\N{NARROW NO-BREAK SPACE}"
MINUS = "\N{MINUS SIGN}"


def counted(value: float) -> str:
    """A whole number, with narrow spaces between its thousands."""
    whole = math.floor(abs(value) + 0.5)
    return f"{MINUS if value < 0 and whole else ''}{whole:,}".replace(",", NARROW_SPACE)


def percent(fraction: float, digits: int = 1) -> str:
    """A fraction as people read it: 0.494 is "49.4 %".

    It is "100 %" only where nothing is missing, and "0 %" only where there is nothing.

    Args:
        fraction: 0 to 1.
        digits: behind the point, those of what lies between.
    """
    value = 100.0 * fraction
    last = 10.0**-digits
    text = f"{value:.0f}" if value in (0.0, 100.0) else f"{min(100.0 - last, value):.{digits}f}"
    return f"{text}{NARROW_SPACE}%"
