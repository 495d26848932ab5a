"""A union of configuration models that others may add to: told apart by their `name`, in forms, JSON and API alike."""

from typing import Annotated, Any, Generic, TypeVar, Union

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, TypeAdapter
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from sim.config.base import Frozen

Member = TypeVar("Member", bound=Frozen)


class OpenUnion(Generic[Member]):
    """Annotates a field with a base class, and reads any of the union's members into it.

    Reads, writes and describes itself in JSON schema exactly as `Annotated[A | B, Field(discriminator="name")]` does, but a
    member that is added later is read too, also by models that exist already.

    Args:
        members: each has a field `name` of one literal value, its default.
    """

    def __init__(self, *members: type[Member]) -> None:
        self._members: dict[str, type[Member]] = {}
        for member in members:
            self.add(member)

    @property
    def members(self) -> tuple[type[Member], ...]:
        """In the order in which they were added."""
        return tuple(self._members.values())

    def add(self, member: type[Member]) -> None:
        """Adds a member.

        Raises:
            ValueError: another one has its name.
        """
        name = member.model_fields["name"].default
        if self._members.setdefault(name, member) is not member:
            raise ValueError(f"there is a {name!r} already, {self._members[name].__module__}: choose another name")
        self._adapter: TypeAdapter[Member] | None = None

    def remove(self, member: type[Member]) -> None:
        """Takes a member back out."""
        del self._members[member.model_fields["name"].default]
        self._adapter = None

    @property
    def adapter(self) -> TypeAdapter[Member]:
        """Reads any member."""
        if self._adapter is None:
            # One member needs no telling apart, and pydantic refuses to.
            union: Any = Union[self.members]  # noqa: UP007 - of a tuple that is known at run time only
            kind: Any = Annotated[union, Field(discriminator="name")] if len(self._members) > 1 else union
            self._adapter = TypeAdapter(kind)
        return self._adapter

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """For pydantic: reads by the members that there are at that moment."""
        return core_schema.no_info_plain_validator_function(lambda value: self.adapter.validate_python(value))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """For pydantic: the schema of the members that there are at that moment."""
        return handler(self.adapter.core_schema)
