"""What the launch form is rendered from: a JSON schema, defaults and presets."""

from functools import cache
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, NoDefault

from server.experiments.schemas import ExperimentCreate, TrainingForm
from workers.presets import PRESETS


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


@cache
def training_form() -> bytes:
    """`TrainingForm` as JSON: the same as long as the process runs."""
    form = TrainingForm(schema=form_schema(), defaults=ExperimentCreate(), presets=list(PRESETS))
    return form.model_dump_json(by_alias=True).encode()
