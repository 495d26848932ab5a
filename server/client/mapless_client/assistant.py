"""A server of the Model Context Protocol over the client: what an assistant may ask of Mapless, within a token's rights."""

import functools
from collections.abc import Callable
from itertools import islice
from typing import Annotated, Any, ParamSpec, TypeVar

from mcp.server.mcpserver import MCPServer
from mcp.server.mcpserver.exceptions import ToolError
from mcp.types import ToolAnnotations
from pydantic import Field

from mapless_client.client import Client
from mapless_client.errors import ClientError
from mapless_client.models import Comparison, Diagnoses, Experiment, Json, ListedExperiment, RunEvent

_P = ParamSpec("_P")
_T = TypeVar("_T")

_INSTRUCTIONS = """Mapless trains LiDAR navigation policies for mobile robots. A training is one configuration with one run
a seed. Success rates are 0 to 1, with 95 % intervals; fewer than five seeds allow no verdict. Trainings take minutes of
other people's machines: launch what you were asked for, and no more. Read a run's diagnoses before you suggest settings."""

_READS = ToolAnnotations(read_only_hint=True, open_world_hint=False)
_LAUNCHES = ToolAnnotations(read_only_hint=False, destructive_hint=False, open_world_hint=False)
_STOPS = ToolAnnotations(read_only_hint=False, destructive_hint=True, idempotent_hint=True, open_world_hint=False)

TrainingId = Annotated[str, Field(description="Id of a training, as the list and the launch say it.")]
RunId = Annotated[str, Field(description="Id of a run: those of a training are in `get_training`.")]


def assistant(client: Client) -> MCPServer:
    """The tools over a client; each is refused what the client's token may not."""
    server = MCPServer("mapless", title="Mapless", instructions=_INSTRUCTIONS, log_level="WARNING")

    @server.tool(annotations=_READS)
    @_said
    def list_trainings(
        query: Annotated[
            str,
            Field(
                description="Part of the name, or `algorithm = ppo gamma >= 0.99 success > 90% -tag = old`; empty for all."
            ),
        ] = "",
        columns: Annotated[
            list[str], Field(description="Settings and metrics to show: `algorithm.gamma`, `train/return`.")
        ] = [],  # noqa: B006 (never changed; a schema shows it)
        sort: Annotated[str, Field(description="A key; with a minus before it the largest first.")] = "-created",
        limit: Annotated[int, Field(ge=1, le=200)] = 20,
    ) -> list[ListedExperiment]:
        """Trainings with state, success rate and interval, the newest first."""
        return list(islice(client.experiments(query, sort=sort, columns=columns), limit))

    @server.tool(annotations=_READS)
    @_said
    def get_training(training: TrainingId) -> Experiment:
        """One training: its whole configuration, and how far each run is."""
        return client.experiment(training)

    @server.tool(annotations=_READS)
    @_said
    def default_configuration() -> Json:
        """Every setting of a training with its default: what `launch_training` takes parts of."""
        return client.defaults()

    @server.tool(annotations=_LAUNCHES)
    @_said
    def launch_training(
        name: Annotated[str, Field(description="What people will know it by.")],
        settings: Annotated[
            dict[str, Any],
            Field(description='What differs from the defaults, nested: {"steps": 500000, "algorithm": {"gamma": 0.99}}.'),
        ] = {},  # noqa: B006 (never changed; a schema shows it)
        seeds: Annotated[list[int], Field(description="One run each.", min_length=1, max_length=50)] = [0],  # noqa: B006
    ) -> Experiment:
        """Launch a training; its runs wait in the queue until a worker is free."""
        return client.launch(name, settings, seeds=seeds)

    @server.tool(annotations=_STOPS)
    @_said
    def stop_training(training: TrainingId) -> Experiment:
        """End every run of a training; each writes a checkpoint first, and can be resumed."""
        return client.stop(training)

    @server.tool(annotations=_LAUNCHES)
    @_said
    def resume_training(training: TrainingId) -> Experiment:
        """Go on with every run of a training that was stopped or failed."""
        return client.resume(training)

    @server.tool(annotations=_READS)
    @_said
    def diagnose_run(run: RunId) -> Diagnoses:
        """Whether a run learns, and if not: the evidence, and what to try, the most promising first."""
        return client.diagnoses(run)

    @server.tool(annotations=_READS)
    @_said
    def read_curves(
        run: RunId,
        names: Annotated[list[str], Field(description="Of metrics: `eval/success_rate`, `train/return`.", min_length=1)],
        points: Annotated[int, Field(ge=2, le=500, description="Of a curve at most.")] = 50,
    ) -> dict[str, dict[str, list[float]]]:
        """A run's curves: environment steps, and values (means, where many points are put together)."""
        curves = client.metrics(run, names, points)
        return {name: {"steps": curve.steps.tolist(), "values": curve.values.tolist()} for name, curve in curves.items()}

    @server.tool(annotations=_READS)
    @_said
    def read_events(run: RunId) -> list[RunEvent]:
        """What happened to a run: attempts, losses, errors."""
        return client.events(run)

    @server.tool(annotations=_READS)
    @_said
    def compare_trainings(
        trainings: Annotated[list[str], Field(description="Ids; the first is what the others are judged by.", min_length=2)],
    ) -> Comparison:
        """Final figures with intervals, verdicts on each beside the first, and the settings in which they differ."""
        return client.compare(trainings)

    return server


def _said(tool: Callable[_P, _T]) -> Callable[_P, _T]:
    """A refusal is an answer that the assistant reads."""

    @functools.wraps(tool)
    def told(*arguments: _P.args, **named: _P.kwargs) -> _T:
        try:
            return tool(*arguments, **named)
        except ClientError as error:
            raise ToolError(str(error)) from error

    return told
