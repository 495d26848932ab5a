"""The little language by which trainings are found.

    corridor                          the name contains it
    "two words" or maze               either of the two
    algorithm = ppo gamma >= 0.99     both: what stands side by side must all hold
    state = running, queued           one of them
    train/return > 50                 the mean of the runs' last values
    not (tag = old or starred = no)   brackets, and the opposite; -tag = old is the same as not tag = old
    name ~ corr   notes = *           contains; is there at all
    created > 2026-11-20  created > 7d   a day, or less than seven days ago

A key is a setting's dotted name, or the end of it where that names one setting only.
"""

from dataclasses import dataclass
from typing import Literal

from server.errors import RefusedFieldError

Operator = Literal["=", "!=", "<", "<=", ">", ">=", "~"]

MAX_LENGTH = 2_000
"""Characters of a query."""
_MAX_PARTS = 100
_MAX_DEPTH = 20
_OPERATORS: tuple[Operator, ...] = ("!=", "<=", ">=", "=", "<", ">", "~")
_SPECIAL = frozenset('()",=<>!~')


class QueryError(RefusedFieldError):
    """A query that makes no sense.

    Args:
        message: what is wrong, and what would be right.
        position: of the fault, in characters from 0.
    """

    def __init__(self, message: str, position: int) -> None:
        super().__init__(("query", "query"), message, position)


@dataclass(frozen=True, slots=True)
class Text:
    """A text that one of several values is compared with.

    Attributes:
        text: as it was typed, without its quotes.
        position: in the query.
        quoted: whether it stood in quotes: a star is only a star then.
    """

    text: str
    position: int
    quoted: bool = False


@dataclass(frozen=True, slots=True)
class Word:
    """The name contains it."""

    text: Text


@dataclass(frozen=True, slots=True)
class Comparison:
    """A key, what is asked of it, and the values of which one must do."""

    key: Text
    operator: Operator
    values: tuple[Text, ...]


@dataclass(frozen=True, slots=True)
class Not:
    """The opposite."""

    part: "Node"


@dataclass(frozen=True, slots=True)
class All:
    """Every part holds; of none, everything does."""

    parts: tuple["Node", ...]


@dataclass(frozen=True, slots=True)
class AnyOf:
    """One part holds."""

    parts: tuple["Node", ...]


Node = Word | Comparison | Not | All | AnyOf


def parse(query: str) -> Node:
    """What a query says.

    Raises:
        QueryError: it is no query.
    """
    if len(query) > MAX_LENGTH:
        raise QueryError(f"A query has at most {MAX_LENGTH} characters.", MAX_LENGTH)
    parser = _Parser(_tokens(query), len(query))
    node = parser.any_of(0)
    if parser.here is not None:
        raise QueryError("This bracket closes nothing.", parser.here.position)
    return node


@dataclass(frozen=True, slots=True)
class _Token:
    """`sign` is an operator, a bracket, a comma or a minus; a word has none."""

    sign: str
    text: str
    position: int
    quoted: bool = False

    def says(self, word: str) -> bool:
        return not self.sign and not self.quoted and self.text.lower() == word


def _tokens(query: str) -> list[_Token]:
    tokens: list[_Token] = []
    place = 0
    while place < len(query):
        here = query[place]
        operator = next((sign for sign in _OPERATORS if query.startswith(sign, place)), None)
        if here.isspace():
            place += 1
        elif operator is not None or here in "(),":
            sign = operator or here
            tokens.append(_Token(sign, sign, place))
            place += len(sign)
        elif here == '"':
            end = query.find('"', place + 1)
            if end < 0:
                raise QueryError("This quotation mark has no second one.", place)
            tokens.append(_Token("", query[place + 1 : end], place, quoted=True))
            place = end + 1
        elif here == "!":
            raise QueryError("A lone ! means nothing: != is unequal, not is the opposite.", place)
        elif here == "-" and _negates(tokens, query, place):
            tokens.append(_Token("-", "-", place))
            place += 1
        else:
            end = place
            while end < len(query) and not query[end].isspace() and query[end] not in _SPECIAL:
                end += 1
            tokens.append(_Token("", query[place:end], place))
            place = end
    if len(tokens) > _MAX_PARTS * 4:
        raise QueryError(f"A query has at most {_MAX_PARTS} parts.", tokens[_MAX_PARTS * 4].position)
    return tokens


def _negates(tokens: list[_Token], query: str, place: int) -> bool:
    """Whether a minus means the opposite: not before a value, which may be a negative number, nor on its own."""
    if tokens and tokens[-1].sign and tokens[-1].sign not in "()":
        return False
    return place + 1 < len(query) and not query[place + 1].isspace()


class _Parser:
    def __init__(self, tokens: list[_Token], length: int) -> None:
        self._tokens = tokens
        self._length = length
        self._place = 0

    @property
    def here(self) -> _Token | None:
        return self._tokens[self._place] if self._place < len(self._tokens) else None

    def any_of(self, depth: int) -> Node:
        parts = [self._all(depth)]
        while self.here is not None and self.here.says("or"):
            self._place += 1
            if self._at_end():
                raise QueryError("Something must follow this or.", self._tokens[self._place - 1].position)
            parts.append(self._all(depth))
        return parts[0] if len(parts) == 1 else AnyOf(tuple(parts))

    def _all(self, depth: int) -> Node:
        parts: list[Node] = []
        while not self._at_end():
            assert self.here is not None
            if self.here.says("and"):
                if not parts:
                    raise QueryError("Something must stand before this and.", self.here.position)
                self._place += 1
                if self._at_end():
                    raise QueryError("Something must follow this and.", self._tokens[self._place - 1].position)
            parts.append(self._one(depth))
        if self.here is not None and self.here.says("or") and not parts:
            raise QueryError("Something must stand before this or.", self.here.position)
        return parts[0] if len(parts) == 1 else All(tuple(parts))

    def _at_end(self) -> bool:
        return self.here is None or self.here.sign == ")" or self.here.says("or")

    def _one(self, depth: int) -> Node:
        token = self.here
        if token is None:
            raise QueryError("Something is missing at the end.", self._length)
        if depth > _MAX_DEPTH:
            raise QueryError("Brackets are nested too deep.", token.position)
        self._place += 1
        if token.sign == "-" or token.says("not"):
            if self._at_end():
                raise QueryError("Something must follow: the opposite of what?", token.position)
            return Not(self._one(depth + 1))
        if token.sign == "(":
            inside = self.any_of(depth + 1)
            if self.here is None:
                raise QueryError("This bracket is never closed.", token.position)
            self._place += 1
            return inside
        if token.sign:
            raise QueryError(f"A key must stand before {token.sign}, as in gamma {token.sign} 0.99.", token.position)
        return self._after(token)

    def _after(self, token: _Token) -> Node:
        """A word alone, or a key with what is asked of it."""
        text = Text(token.text, token.position, token.quoted)
        operator = next((sign for sign in _OPERATORS if self.here is not None and self.here.sign == sign), None)
        if operator is None:
            return Word(text)
        self._place += 1
        values = [self._value(operator)]
        while self.here is not None and self.here.sign == ",":
            self._place += 1
            values.append(self._value(","))
        if len(values) > 1 and operator not in ("=", "!=", "~"):
            raise QueryError(f"After {operator} one value makes sense.", values[1].position)
        return Comparison(text, operator, tuple(values))

    def _value(self, after: str) -> Text:
        token = self.here
        if token is None or token.sign:
            raise QueryError(f"A value must follow {after}.", self._length if token is None else token.position)
        self._place += 1
        return Text(token.text, token.position, token.quoted)
