"""What a request of any route may be refused with: written once in the API's description, and named by every route."""

from typing import Any, TypeAlias

from server.errors import ErrorBody

Description: TypeAlias = dict[str, Any]

_SENTENCE = {"$ref": "#/components/schemas/ErrorBody"}
_FIELDS = {"$ref": "#/components/schemas/HTTPValidationError"}
_COME_AGAIN = {
    "Retry-After": {
        "description": "Seconds after which to come again",
        "required": True,
        "schema": {"type": "integer", "minimum": 1},
    }
}


def _answer(description: str, schema: Description = _SENTENCE, headers: Description | None = None) -> Description:
    answer: Description = {"description": description, "content": {"application/json": {"schema": schema}}}
    return answer if headers is None else answer | {"headers": headers}


_UNREADABLE = _answer("The address or the body can't be read, or makes no sense as a whole")
# What is not even HTTP is refused by what reads HTTP.
_UNREADABLE["content"]["text/plain"] = {"schema": {"type": "string"}}

REFUSALS: dict[int, tuple[str, Description]] = {
    400: ("Unreadable", _UNREADABLE),
    401: ("Unauthorized", _answer("No valid login")),
    403: ("Forbidden", _answer("Takes more rights, or comes from another site's page")),
    404: ("NotFound", _answer("No such thing")),
    408: ("TooSlow", _answer("The body did not arrive in time")),
    409: ("Conflict", _answer("Not in this state")),
    413: ("TooLarge", _answer("The body is over its cap")),
    422: (
        "Refused",
        _answer("Fields are refused, each with its place; or all of it, in a sentence", {"anyOf": [_FIELDS, _SENTENCE]}),
    ),
    429: ("TooManyAttempts", _answer("Too many wrong tokens", headers=_COME_AGAIN)),
    500: ("Failed", _answer("A worker could not do it, and would not the next time: the reason is in the detail")),
    503: (
        "NotNow",
        _answer(
            "What the server needs is away or busy, too many wait already, it took too long, or no worker does such work",
            headers=_COME_AGAIN,
        ),
    ),
}
"""By status: the name under which the description keeps it, and what it says."""

# Whatever a route does: what comes before it may refuse a request so.
_ALWAYS = (400, 401, 403, 429, 503)
# Only what has a body may have a slow or a long one.
_WITH_BODY = (408, 413)


def refusal(status: int) -> Description:
    """Where a description finds the answer of this status."""
    return {"$ref": f"#/components/responses/{REFUSALS[status][0]}"}


def with_refusals(description: Description) -> Description:
    """The description in which every operation names what it may be refused with; routes say 404, 409 and 500 themselves."""
    for methods in description["paths"].values():
        for operation in methods.values():
            answers = operation["responses"]
            for status in (*_ALWAYS, *(_WITH_BODY if "requestBody" in operation else ())):
                answers[str(status)] = refusal(status)
            if "422" in answers:
                answers["422"] = refusal(422)
            operation["responses"] = {status: _bare(answers[status]) for status in sorted(answers)}
    components = description["components"]
    components["responses"] = dict(REFUSALS.values())
    components["schemas"]["ErrorBody"] = ErrorBody.model_json_schema()
    components["schemas"] = dict(sorted(components["schemas"].items()))
    return description


def _bare(answer: Description) -> Description:
    """FastAPI describes what is named only, too."""
    return {"$ref": answer["$ref"]} if "$ref" in answer else answer
