"""What a query says, and where it is at fault."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.workbench.language import All, AnyOf, Comparison, Node, Not, QueryError, Text, Word, parse


def said(node: Node) -> str:
    """The tree in brackets, as hand-worked below."""
    match node:
        case Word(text):
            return repr(text.text)
        case Comparison(key, operator, values):
            return f"{key.text}{operator}{'|'.join(value.text for value in values)}"
        case Not(part):
            return f"not({said(part)})"
        case All(parts):
            return f"all({', '.join(map(said, parts))})"
        case AnyOf(parts):
            return f"any({', '.join(map(said, parts))})"


@pytest.mark.parametrize(
    ("query", "meaning"),
    [
        ("", "all()"),
        ("   ", "all()"),
        ("corridor", "'corridor'"),
        ("50%", "'50%'"),
        ('"two words"', "'two words'"),
        ("two words", "all('two', 'words')"),
        ("gamma=0.99", "gamma=0.99"),
        ("gamma >= 0.99 algorithm = ppo", "all(gamma>=0.99, algorithm=ppo)"),
        ("a and b", "all('a', 'b')"),
        ("a b or c", "any(all('a', 'b'), 'c')"),
        ("a (b or c)", "all('a', any('b', 'c'))"),
        ("not a b", "all(not('a'), 'b')"),
        ("-tag = old x", "all(not(tag=old), 'x')"),
        ("-(a or b)", "not(any('a', 'b'))"),
        ("well-known", "'well-known'"),
        ("weight = -100", "weight=-100"),
        ("weight = -100, -50", "weight=-100|-50"),
        ('state = running, queued, "x y"', "state=running|queued|x y"),
        ("train/return > 5", "train/return>5"),
        ("a != b", "a!=b"),
        ('"or" and "not"', "all('or', 'not')"),
        ("A OR B", "any('A', 'B')"),
        ("hidden = 64, 64", "hidden=64|64"),
    ],
)
def test_a_query_and_what_it_says(query: str, meaning: str) -> None:
    assert said(parse(query)) == meaning


@pytest.mark.parametrize(
    ("query", "position"),
    [
        ("gamma =", 7),
        ("gamma = )", 8),
        ("= 4", 0),
        ("a (b", 2),
        ("a )", 2),
        ('name = "x', 7),
        ("a or", 2),
        ("or a", 0),
        ("and a", 0),
        ("a and", 2),
        ("not", 0),
        ("gamma > 1, 2", 11),
        ("gamma = 1,", 10),
        ("a ! b", 2),
        ("(" * 30 + "a" + ")" * 30, 21),
        ("a " * 1_100, 2_000),
    ],
)
def test_a_fault_has_its_place(query: str, position: int) -> None:
    with pytest.raises(QueryError) as caught:
        parse(query)
    assert caught.value.position == position


@given(st.text(max_size=60) | st.text(alphabet='ab=<>!~()", -%*', max_size=40))
def test_any_text_is_a_query_or_is_refused_at_a_place_in_it(query: str) -> None:
    fault: QueryError | None = None
    try:
        parse(query)
    except QueryError as error:
        fault = error
    assert fault is None or (fault.position is not None and 0 <= fault.position <= len(query))


@given(st.text(min_size=1).filter(lambda text: '"' not in text))
def test_what_stands_in_quotes_is_taken_as_it_is(text: str) -> None:
    assert parse(f'"{text}"') == Word(Text(text, 0, quoted=True))
