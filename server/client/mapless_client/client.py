"""The client: one method for each thing that a program asks of a server."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self

import httpx

from mapless_client.curves import Curve, curve
from mapless_client.downloads import Form, Pulled, keep, pull
from mapless_client.errors import ClientError
from mapless_client.models import (
    Bag,
    BagReading,
    Checkpoint,
    Comparison,
    Diagnoses,
    Experiment,
    Json,
    ListedExperiment,
    Project,
    ProjectImport,
    Run,
    RunEvent,
    Study,
)
from mapless_client.transport import Transport
from mapless_client.watching import watch

_PAGE = 200
_EVENTS = 1_000


Table = Literal["figures", "verdicts", "improvements", "differences"]
TableForm = Literal["latex", "markdown", "csv"]


class Client:
    """Speaks to one server. Close it, or use it as a context manager.

    Every method raises `RefusedError` where the server says no, and `UnreachableError` where it does not answer.

    Args:
        url: of the server.
        token: that opens it.
        http: to use instead of a connection of its own; its address and headers are as they are.
    """

    def __init__(self, url: str, token: str | None = None, http: httpx.Client | None = None) -> None:
        self._transport = Transport(url, token, http)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Close its connections."""
        self._transport.close()

    def experiments(
        self,
        query: str = "",
        *,
        project: str | None = None,
        place: Literal["live", "archived", "trash"] = "live",
        sort: str = "-created",
        columns: Sequence[str] = (),
    ) -> Iterator[ListedExperiment]:
        """Trainings that a query of the workbench finds, fetched as they are asked for.

        Args:
            query: part of the name, or the workbench's language: `algorithm = ppo success > 90%`.
            project: id of the only project; all without it.
            place: where they are.
            sort: a key, with a minus before it the largest first.
            columns: settings and metrics that `settings` and `metrics` should have.
        """
        after = None
        while True:
            page = self._transport.get(
                "/api/experiments",
                {
                    "query": query,
                    "project": project,
                    "place": place,
                    "sort": sort,
                    "column": list(columns),
                    "limit": _PAGE,
                    "after": after,
                },
            )
            yield from map(ListedExperiment.model_validate, page["items"])
            after = page["next"]
            if after is None:
                return

    def experiment(self, experiment_id: str) -> Experiment:
        """A training with its runs."""
        return Experiment.model_validate(self._transport.get(f"/api/experiments/{experiment_id}"))

    def run(self, run_id: str) -> Run:
        """One run."""
        return Run.model_validate(self._transport.get(f"/api/runs/{run_id}"))

    def defaults(self) -> Json:
        """The launch form's defaults: a whole configuration to change and to `launch`."""
        training: Json = self._transport.get("/api/training/form")["defaults"]["training"]
        return training

    def launch(
        self, name: str, training: Json | None = None, *, seeds: Sequence[int] = (0,), project: str | None = None
    ) -> Experiment:
        """Launch a training, one run a seed.

        Args:
            name: for people.
            training: as the form's JSON; what is absent has its default. A part without a `name`, such as
                `{"algorithm": {"gamma": 0.9}}`, is of the kind that the defaults have.
            seeds: each once.
            project: id of the project; the first one without it.

        Raises:
            InvalidRequestError: it names the settings that make no sense.
            ForbiddenError: the token may not launch.
        """
        training = _named(training, self.defaults()) if training else {}
        body: Json = {"name": name, "seeds": list(seeds), "training": training}
        if project is not None:
            body["project_id"] = project
        return Experiment.model_validate(self._transport.send("POST", "/api/experiments", body))

    def search(
        self,
        name: str,
        settings: Sequence[Json],
        training: Json | None = None,
        *,
        trials: int = 30,
        sampler: str = "tpe",
        seeds: Sequence[int] = (0, 1, 2),
        project: str | None = None,
    ) -> Study:
        """Launch a study, which searches settings of a training.

        Args:
            name: for people.
            settings: `{"kind": "range", "path": "algorithm.gamma", "low": 0.9, "high": 0.99}`, with `"log": True` where what
                counts is how many times as large, or `{"kind": "list", "path": "algorithm.epochs", "values": [3, 6]}`.
            training: all others, as for `launch`.
            trials: to train.
            sampler: `tpe`, `random`, `quasi` or `grid`.
            seeds: of every trial, three or more; the best is judged on five others.
            project: id of the project; the first one without it.

        Raises:
            InvalidRequestError: it names the settings that can't be searched so.
            ForbiddenError: the token may not launch.
        """
        training = _named(training, self.defaults()) if training else {}
        body: Json = {"name": name, "training": training, "settings": list(settings), "trials": trials}
        body |= {"sampler": sampler, "seeds": list(seeds)} | ({} if project is None else {"project_id": project})
        return Study.model_validate(self._transport.send("POST", "/api/studies", body))

    def study(self, study_id: str) -> Study:
        """A study with its trials."""
        return Study.model_validate(self._transport.get(f"/api/studies/{study_id}"))

    def stop_study(self, study_id: str) -> Study:
        """Ask for no more trials, and stop those that go on; the page of the study resumes it."""
        return Study.model_validate(self._transport.send("POST", f"/api/studies/{study_id}/stop"))

    def stop(self, experiment_id: str) -> Experiment:
        """End every run that has not ended; each writes a checkpoint first."""
        return Experiment.model_validate(self._transport.send("POST", f"/api/experiments/{experiment_id}/stop"))

    def resume(self, experiment_id: str) -> Experiment:
        """Go on with every run that was stopped or failed."""
        return Experiment.model_validate(self._transport.send("POST", f"/api/experiments/{experiment_id}/resume"))

    def watch(self, experiment_id: str, at_most_every: float = 1.0) -> Iterator[Experiment]:
        """A training as it is now, and again whenever it has moved on, until all of its runs have ended.

        Args:
            experiment_id: which.
            at_most_every: seconds between two of them at least.
        """
        return watch(
            self._transport,
            experiment_id,
            read=lambda: self.experiment(experiment_id),
            ended=lambda experiment: experiment.ended,
            at_most=at_most_every,
        )

    def metrics(self, run_id: str, names: Sequence[str] = (), points: int = 1_000) -> dict[str, Curve]:
        """A run's curves by name, as arrays.

        Args:
            run_id: which.
            names: of the metrics; all if empty.
            points: of a curve at most, 100,000 and no more; neighbours are put together where there are more.
        """
        answer = self._transport.get(f"/api/runs/{run_id}/metrics", {"names": ",".join(names), "points": points})
        return {series["name"]: curve(series) for series in answer["series"]}

    def events(self, run_id: str) -> list[RunEvent]:
        """A run's event log, oldest first."""
        found: list[RunEvent] = []
        while True:
            part = self._transport.get(f"/api/runs/{run_id}/events", {"limit": _EVENTS, "offset": len(found)})
            found += map(RunEvent.model_validate, part)
            if len(part) != _EVENTS:
                return found

    def diagnoses(self, run_id: str) -> Diagnoses:
        """Whether a run learns, and if not, why, and what to try."""
        return Diagnoses.model_validate(self._transport.get(f"/api/runs/{run_id}/diagnoses"))

    def checkpoints(self, run_id: str) -> Iterator[Checkpoint]:
        """A run's checkpoints, the newest first, fetched as they are asked for."""
        offset = 0
        while items := self._checkpoint_page(run_id, limit=_PAGE, offset=offset)["items"]:
            yield from map(Checkpoint.model_validate, items)
            offset += len(items)

    def best_checkpoint(self, run_id: str) -> Checkpoint:
        """That with the highest success rate; the newest before the first evaluation.

        Raises:
            ClientError: there is none yet.
        """
        page = self._checkpoint_page(run_id, limit=1, offset=0)
        found: Any = page["best"] or next(iter(page["items"]), None)
        if found is None:
            raise ClientError(f"Run {run_id} has no checkpoint yet.")
        return Checkpoint.model_validate(found)

    def pull(self, checkpoint_id: str, to: str | Path = ".", form: Form = "archive") -> Pulled:
        """Take a policy home; called again after it broke off, it goes on from there.

        Args:
            checkpoint_id: which.
            to: directory, which is made.
            form: the checkpoint's archive, a bundle for a robot, or the ONNX file out of it.

        Raises:
            DamagedDownloadError: what arrived is not what the server has.
        """
        return pull(self._transport, checkpoint_id, Path(to), form)

    def compare(
        self, experiment_ids: Sequence[str], margin: float = 0.02, *, base: str | None = None, pairs: bool = False
    ) -> Comparison:
        """Final figures side by side, verdicts, and the settings that differ.

        Args:
            experiment_ids: in order, 50 at most.
            margin: success rates that differ by less are equivalent, 0 to 1.
            base: what the others are held against; the first without it.
            pairs: judge every pair instead, of 12 experiments at most.
        """
        answer = self._transport.get("/api/compare", _compared(experiment_ids, margin, base, pairs=pairs))
        return Comparison.model_validate(answer)

    def comparison_table(
        self,
        experiment_ids: Sequence[str],
        table: Table = "verdicts",
        form: TableForm = "latex",
        margin: float = 0.02,
        *,
        base: str | None = None,
        pairs: bool = False,
    ) -> str:
        """A table of a comparison as one would print it.

        Args:
            experiment_ids: in order, 50 at most.
            table: which of them.
            form: LaTeX with booktabs, Markdown, or CSV.
            margin: success rates that differ by less are equivalent, 0 to 1.
            base: what the others are held against; the first without it.
            pairs: judge every pair instead, of 12 experiments at most.
        """
        query = _compared(experiment_ids, margin, base, pairs=pairs) | {"table": table, "format": form}
        return self._transport.text("/api/compare/table", query)

    def comparison_report(
        self, experiment_ids: Sequence[str], margin: float = 0.02, *, base: str | None = None, pairs: bool = False
    ) -> str:
        """The whole comparison as one HTML file that opens offline; arguments as `compare`."""
        return self._transport.text("/api/compare/report", _compared(experiment_ids, margin, base, pairs=pairs))

    def projects(self) -> Iterator[Project]:
        """The projects that the token may see, by name, fetched as they are asked for."""
        offset = 0
        while items := self._transport.get("/api/projects", {"limit": _PAGE, "offset": offset})["items"]:
            yield from map(Project.model_validate, items)
            offset += len(items)

    def export_project(self, project_id: str, to: str | Path = ".") -> Path:
        """All of a project in one file, checkpoints included, for `import_project` of another server.

        Args:
            project_id: which.
            to: directory, which is made.
        """
        return keep(self._transport, f"/api/projects/{project_id}/export", Path(to))

    def import_project(self, archive: str | Path, project_id: str) -> ProjectImport:
        """Take what another server exported, with the same ids: each run whole, or not at all.

        Sent again, it goes on: runs that are there are left as they are.

        Args:
            archive: of `export_project`.
            project_id: where to.

        Raises:
            InvalidRequestError: it is no such archive, or ends too early; runs before that are kept.
        """
        answer = self._transport.upload(f"/api/projects/{project_id}/import", Path(archive), "application/x-tar")
        return ProjectImport.model_validate(answer)

    def recordings(self) -> Iterator[Bag]:
        """Robots' recordings, the newest first, fetched as they are asked for."""
        offset = 0
        while items := self._transport.get("/api/recordings", {"limit": _PAGE, "offset": offset})["items"]:
            yield from map(Bag.model_validate, items)
            offset += len(items)

    def upload_recording(self, file: str | Path, name: str | None = None, *, project: str | None = None) -> Bag:
        """Send what a robot recorded: an `.mcap` or a `.db3` file, or the folder of a rosbag2 recording as `.zip` or `.tar`.

        Args:
            file: of the recording.
            name: for people; that of the file without it.
            project: id of the project; the first one without it.

        Raises:
            RefusedError: it is empty or too large, or there are too many.
        """
        file = Path(file)
        query = {"name": name or file.name, "project_id": project}
        return Bag.model_validate(self._transport.upload("/api/recordings", file, "application/octet-stream", query))

    def recording_reading(self, recording_id: str) -> BagReading:
        """What a recording tells of its robot: quantities with intervals, and settings for a training.

        Raises:
            RefusedError: it is no recording of ROS 2, or lacks a scan or odometry.
        """
        return BagReading.model_validate(self._transport.get(f"/api/recordings/{recording_id}/reading"))

    def _checkpoint_page(self, run_id: str, *, limit: int, offset: int) -> Json:
        page: Json = self._transport.get(f"/api/runs/{run_id}/checkpoints", {"limit": limit, "offset": offset})
        return page


def _compared(
    experiment_ids: Sequence[str], margin: float, base: str | None, *, pairs: bool
) -> dict[str, str | int | float | Sequence[str] | None]:
    return {"experiment": list(experiment_ids), "margin": margin, "base": base, "pairs": pairs}


def _named(part: Json, defaults: Json) -> Json:
    """A configuration whose parts say of which kind they are."""

    def inside(key: str, value: Any) -> Any:
        return _named(value, defaults.get(key) or {}) if isinstance(value, dict) else value

    inner = {key: inside(key, value) for key, value in part.items()}
    return {"name": defaults["name"], **inner} if "name" in defaults else inner


def connect(url: str | None = None, token: str | None = None) -> Client:
    """A client of a server.

    Args:
        url: of the server; MAPLESS_URL, else http://127.0.0.1:8400, without it.
        token: that opens it; MAPLESS_TOKEN without it.
    """
    return Client(url or os.environ.get("MAPLESS_URL") or "http://127.0.0.1:8400", token or os.environ.get("MAPLESS_TOKEN"))
