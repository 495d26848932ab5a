"""The JSON schema that the launch form is rendered from."""

from typing import Any

from pydantic.json_schema import GenerateJsonSchema, NoDefault

from server.experiments.schemas import ExperimentCreate


class _FormSchema(GenerateJsonSchema):
    """Writes down every default, those of factories too: another algorithm's fields start with that algorithm's own."""

    def get_default_value(self, schema: Any) -> Any:
        factory = schema.get("default_factory")
        if factory is None or schema.get("default_factory_takes_data"):
            return schema.get("default", NoDefault)
        return factory()


def form_schema() -> dict[str, Any]:
    """JSON schema of `ExperimentCreate` with all defaults."""
    return ExperimentCreate.model_json_schema(schema_generator=_FormSchema)
