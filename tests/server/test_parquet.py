"""Parquet is read back by pyarrow: the same rows as in the CSV, with their types and units, whatever the size."""

import csv
import io
import json
import math
from collections.abc import Iterator
from typing import Any
from zipfile import ZipFile

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from fastapi.testclient import TestClient

from server.data_export import parquet as module
from server.data_export.columns import POINTS
from server.data_export.parquet import parquet, point_blocks
from server.data_export.series import read_run
from server.services import Services
from tests.server.harness import Reports
from tests.server.test_curve_thinning import run as long_run
from tests.server.test_curve_thinning import thin
from tests.server.test_data_export import add_points, export, rows_of

__all__ = ["long_run"]


def read(content: bytes) -> pa.Table:
    return pq.read_table(io.BytesIO(content))


def as_in_csv(table: pa.Table) -> list[dict[str, str]]:
    """The cells as the CSV writes them."""

    def cell(name: str, value: Any) -> str:
        if value is None:
            return ""
        if isinstance(value, bool):
            return str(value).lower()
        return str(np.float32(value)) if table.schema.field(name).type == pa.float32() else str(value)

    return [{name: cell(name, value) for name, value in row.items()} for row in table.to_pylist()]


@pytest.fixture
def experiment(services: Services, reports: Reports) -> dict[str, Any]:
    """Two runs; one that compacted some of its points, and reported what is no number."""
    experiment = reports.experiment("Corridor", seeds=(3, 8))
    first, second = experiment["runs"]
    add_points(services, first, "train/return", [10, 20, 30], [0.1, -2.0, 1e-9])
    reports.metrics(first, "loss/policy", {40: 0.5, 50: -math.inf})
    add_points(services, second, "=loss", [1, 2], [math.nan, 7.25])
    return experiment


def test_the_rows_are_those_of_the_csv(client: TestClient, experiment: dict[str, Any]) -> None:
    for kind, item in (("experiments", experiment), ("runs", experiment["runs"][0])):
        response = export(client, kind, item, "parquet")
        assert response.headers["content-type"] == "application/vnd.apache.parquet"
        assert response.headers["content-disposition"].endswith('.parquet"')
        expected = rows_of(export(client, kind, item, "csv"))
        for row in expected:
            # A spreadsheet's apostrophe.
            row["metric"] = row["metric"].removeprefix("'")
        assert as_in_csv(read(response.content)) == expected


def test_types_units_and_what_it_is_of_stand_in_the_schema(client: TestClient, experiment: dict[str, Any]) -> None:
    schema = read(export(client, "experiments", experiment, "parquet").content).schema

    types = {field.name: field.type for field in schema}
    assert [types[name] for name in ("seed", "step", "wall_time", "value")] == [
        *(pa.int64(), pa.int64()),
        *(pa.float64(), pa.float32()),
    ]
    assert types["metric"].value_type == types["run"].value_type == pa.string()
    units = {field.name: field.metadata.get(b"unit") for field in schema}
    assert units == {"run": None, "seed": None, "metric": None, "step": b"step", "wall_time": b"s", "value": None}
    assert all(field.metadata[b"description"] for field in schema)
    told = {"table": "points", "experiment": experiment["id"], "name": "Corridor", "project": "default"}
    assert json.loads(schema.metadata[b"mapless"]) == told


def test_a_run_without_points_is_a_table_without_rows(client: TestClient, reports: Reports) -> None:
    (run,) = reports.experiment()["runs"]
    table = read(export(client, "runs", run, "parquet").content)
    assert (table.num_rows, table.column_names) == (0, [column.name for column in POINTS])


def test_a_thinned_curve_says_so(client: TestClient, long_run: dict[str, Any]) -> None:
    thin(client, long_run)

    table = read(export(client, "runs", long_run, "parquet").content)

    assert table.column_names[-3:] == ["points", "min", "max"]
    assert as_in_csv(table) == rows_of(export(client, "runs", long_run, "csv"))


def test_a_long_run_leaves_group_by_group(services: Services, reports: Reports, client: TestClient) -> None:
    (run,) = reports.experiment()["runs"]
    values = np.random.default_rng(0).normal(size=200_000).astype(np.float32)
    for name in ("a", "b"):
        add_points(services, run, name, list(range(values.size)), values.tolist())
    blocks = list(
        parquet(POINTS, point_blocks(run["id"], 0, read_run(services.database, run["id"]), wide=False), {"mapless": "{}"})
    )

    # No group has more than so many rows, and each leaves before the next one is made.
    file = pq.ParquetFile(io.BytesIO(b"".join(blocks)))
    groups = [file.metadata.row_group(index).num_rows for index in range(file.num_row_groups)]
    assert sum(groups) == 400_000
    assert max(groups) <= 2 * 2**16
    assert len(blocks) == len(groups) + 1
    assert max(map(len, blocks)) < 3_000_000
    assert np.array_equal(file.read(["value"])["value"].to_numpy()[:200_000], values)


def test_short_series_share_a_group(client: TestClient, reports: Reports) -> None:
    (run,) = reports.experiment()["runs"]
    reports.rows(run, {step: {f"loss/{index}": 1.0 for index in range(40)} for step in (1, 2)})
    file = pq.ParquetFile(io.BytesIO(export(client, "runs", run, "parquet").content))
    assert (file.num_row_groups, file.metadata.num_rows) == (1, 80)


def test_a_comparison_leaves_as_tables(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment("Corridor", seeds=(0, 1))
    for run in experiment["runs"]:
        reports.metrics(run, "train/return", {10: 1.0, 20: 2.0})
        reports.checkpoint(run, 20, reports.evaluation(7))
    query = {"experiment": [experiment["id"]], "name": "train/return"}

    def files(data_format: str) -> Iterator[tuple[str, bytes]]:
        content = client.get("/api/compare/export", params=query | {"format": data_format}).content
        with ZipFile(io.BytesIO(content)) as archive:
            yield from ((name, archive.read(name)) for name in archive.namelist())

    in_csv, in_parquet = dict(files("csv")), dict(files("parquet"))
    assert list(in_parquet) == ["figures.parquet", "curves.parquet", "seeds.parquet"]
    for name, content in in_csv.items():
        table = read(in_parquet[name.replace("csv", "parquet")])
        assert as_in_csv(table) == list(csv.DictReader(io.StringIO(content.decode())))
        assert json.loads(table.schema.metadata[b"mapless"]) == {"table": name.removesuffix(".csv")}


def test_where_the_part_is_missing_the_answer_says_which(
    client: TestClient, experiment: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "find_spec", lambda _: None)
    for path in (f"/api/experiments/{experiment['id']}/export?", f"/api/compare/export?experiment={experiment['id']}&"):
        refused = client.get(f"{path}format=parquet")
        assert refused.status_code == 501
        assert "pip install 'mapless[parquet]'" in refused.json()["detail"]
        assert "CSV" in refused.json()["detail"]
    assert client.get("/api/audit", params={"action": "data.exported"}).json()["total"] == 0
