"""Which changes of the API's description break a program that was written against an older one.

`python -m server.written.api_changes FILE` keeps today's description, without its words, as the one that programs rely on.
Where something must break, raise the package's version first: a description is held against those of its own version only.
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeAlias

Description: TypeAlias = dict[str, Any]

# Of a schema: what says something about values. Bounds may be loosened or tightened, words changed.
_TELLING = ("type", "enum", "const", "$ref", "anyOf", "oneOf", "items", "additionalProperties", "properties", "required")
_METHODS = ("get", "put", "post", "patch", "delete")


def stripped(description: Description) -> Description:
    """What programs rely on: routes, parameters, bodies, and the schemas that they name."""
    paths = {
        path: {method: _operation(operation) for method, operation in methods.items() if method in _METHODS}
        for path, methods in description["paths"].items()
    }
    schemas = {name: _schema(schema) for name, schema in description["components"]["schemas"].items()}
    return {"paths": paths, "schemas": schemas}


def breaking(kept: Description, now: Description) -> list[str]:
    """What a program that relies on `kept` does not find in `now`, both stripped; a sentence each."""
    found = list(_routes(kept, now))
    asked = _sent(now)
    for name, schema in kept["schemas"].items():
        if name in now["schemas"]:
            found += _narrowed(name, schema, now["schemas"][name], sent=name in asked)
        else:
            found.append(f"the schema {name} is gone")
    return found


def _routes(kept: Description, now: Description) -> Iterator[str]:
    for path, methods in kept["paths"].items():
        for method, before in methods.items():
            name = f"{method.upper()} {path}"
            after = now["paths"].get(path, {}).get(method)
            if after is None:
                yield f"{name} is gone"
                continue
            for parameter, given in before["parameters"].items():
                if parameter not in after["parameters"]:
                    yield f"{name}: the parameter {parameter} is gone"
                elif after["parameters"][parameter]["required"] and not given["required"]:
                    yield f"{name}: the parameter {parameter} has become required"
            for parameter, given in after["parameters"].items():
                if given["required"] and parameter not in before["parameters"]:
                    yield f"{name}: the new parameter {parameter} is required"
            if after["body"] != before["body"]:
                yield f"{name}: takes another body"
            for status in before["answers"]:
                if status.startswith("2") and after["answers"].get(status) != before["answers"][status]:
                    yield f"{name}: answers {status} with something else"


def _narrowed(where: str, before: Any, after: Any, *, sent: bool) -> Iterator[str]:
    """What has become of a schema; `sent` is one that programs send, which takes all that it took."""
    properties, there = before.get("properties", {}), after.get("properties", {})
    for name, schema in properties.items():
        if name not in there:
            yield f"{where}.{name} is gone"
        else:
            yield from _narrowed(f"{where}.{name}", schema, there[name], sent=sent)
    required, now_required = set(before.get("required", ())), set(after.get("required", ()))
    if sent:
        yield from (f"{where}.{name} has become required" for name in sorted(now_required - required))
    yield from (f"{where} has lost {value!r}" for value in before.get("enum", ()) if value not in after.get("enum", ()))
    for key in ("type", "$ref", "const"):
        if before.get(key) != after.get(key) and "enum" not in before:
            yield f"{where} was {before.get(key)}, and is {after.get(key)}"
    for key in ("anyOf", "oneOf"):
        lost = [choice for choice in before.get(key, ()) if "enum" not in choice and choice not in after.get(key, ())]
        yield from (f"{where} may no longer be {_words(choice)}" for choice in lost)
    for key in ("items", "additionalProperties"):
        if isinstance(before.get(key), dict) and isinstance(after.get(key), dict):
            yield from _narrowed(f"{where}[]", before[key], after[key], sent=sent)


def _sent(description: Description) -> set[str]:
    """The schemas that bodies are made of."""
    bodies = [operation["body"] for methods in description["paths"].values() for operation in methods.values()]
    waiting, found = set(_named(bodies)), set[str]()
    while waiting:
        name = waiting.pop()
        found.add(name)
        waiting |= set(_named(description["schemas"].get(name, {}))) - found
    return found


def _named(part: Any) -> Iterator[str]:
    if isinstance(part, dict):
        if "$ref" in part:
            yield str(part["$ref"]).rsplit("/", 1)[1]
        for value in part.values():
            yield from _named(value)
    elif isinstance(part, list):
        for value in part:
            yield from _named(value)


def _operation(operation: Description) -> Description:
    parameters = {
        f"{each['in']} {each['name']}": {"required": each.get("required", False)} for each in operation.get("parameters", ())
    }
    answers = {status: _content(answer) for status, answer in operation["responses"].items()}
    return {"parameters": parameters, "body": _content(operation.get("requestBody", {})), "answers": answers}


def _content(part: Description) -> Description:
    return {kind: _schema(content.get("schema", {})) for kind, content in part.get("content", {}).items()}


def _schema(schema: Any) -> Any:
    if isinstance(schema, list):
        return [_schema(each) for each in schema]
    if not isinstance(schema, dict):
        return schema
    kept = {key: schema[key] for key in _TELLING if key in schema}
    if "properties" in kept:
        kept["properties"] = {name: _schema(each) for name, each in kept["properties"].items()}
    return {key: value if key in ("properties", "required", "enum") else _schema(value) for key, value in kept.items()}


def _words(choice: Description) -> str:
    return str(choice.get("$ref", choice.get("type", "what it was"))).rsplit("/", 1)[-1]


def main(path: Path) -> None:
    """Keep today's description at `path`."""
    from server.version import version
    from server.written.openapi import description

    kept = stripped(json.loads(description()))
    # A line each, so that a difference can be read.
    parts = (f"{json.dumps(part)}: {{\n{_lines(kept[part])}\n}}" for part in ("paths", "schemas"))
    text = ",\n".join([f'"version": {json.dumps(version())}', *parts])
    path.write_text(f"{{\n{text}\n}}\n", encoding="utf-8")


def _lines(named: Description) -> str:
    return ",\n".join(f"{json.dumps(name)}: {json.dumps(named[name], sort_keys=True)}" for name in sorted(named))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
