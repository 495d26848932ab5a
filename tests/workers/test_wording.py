import pytest

from workers.wording import counted, percent


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0, "0"),
        (999, "999"),
        (1000, "1\u202f000"),
        (1_234_567.4, "1\u202f234\u202f567"),
        (-12_345, "\N{MINUS SIGN}12\u202f345"),
        (-0.4, "0"),
    ],
)
def test_thousands_stand_apart(value: float, text: str) -> None:
    assert counted(value) == text


@pytest.mark.parametrize(
    ("fraction", "digits", "text"),
    [
        (1.0, 1, "100\u202f%"),
        (0.9999, 1, "99.9\u202f%"),
        (0.0, 1, "0\u202f%"),
        (0.494, 1, "49.4\u202f%"),
        (0.494, 0, "49\u202f%"),
        (0.999, 0, "99\u202f%"),
    ],
)
def test_all_are_only_all(fraction: float, digits: int, text: str) -> None:
    assert percent(fraction, digits) == text
