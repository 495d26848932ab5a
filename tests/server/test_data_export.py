"""What leaves is read back by what it was made for: the same points, configurations and figures, whatever is in a name."""

import csv
import io
import math
import struct
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest
from fastapi.testclient import TestClient
from httpx import Response
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from server.data_export.event_file import event_file, masked_crc32c
from server.data_export.series import read_series
from server.database import tables
from server.metrics.points import Points
from server.metrics.repository import MetricRepository, ReportedRow
from server.services import Services
from tests.server.harness import Reports


def add_points(services: Services, run: dict[str, Any], name: str, steps: list[int], values: list[float]) -> None:
    """A whole series at once, in chunks; the wall time is the step plus a thousand and a half."""
    with services.database.write() as session:
        points = Points.of(steps, [step + 1_000.5 for step in steps], values)
        MetricRepository(session).add_series(run["id"], {name: points})


def export(client: TestClient, kind: str, item: dict[str, Any], data_format: str) -> Response:
    response: Response = client.get(f"/api/{kind}/{item['id']}/export", params={"format": data_format})
    assert response.status_code == 200, response.text
    return response


def rows_of(response: Response) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(response.text)))


def test_what_leaves_stands_in_the_audit_log(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment("Corridor")
    run = experiment["runs"][0]
    export(client, "runs", run, "csv")
    export(client, "experiments", experiment, "tensorboard")
    client.get("/api/compare/export", params={"experiment": [experiment["id"]], "format": "json"})

    entries = client.get("/api/audit", params={"action": "data.exported"}).json()["items"]

    told = [(entry["target"], entry["name"], entry["project_id"], entry["details"]) for entry in entries]
    assert told == [
        (experiment["id"], "Corridor", "default", "compared, json"),
        (experiment["id"], "Corridor", "default", "tensorboard"),
        (run["id"], "Corridor", "default", "csv"),
    ]


def test_every_point_is_a_row(client: TestClient, services: Services, reports: Reports) -> None:
    experiment = reports.experiment("Corridor", seeds=(3, 8))
    first, second = experiment["runs"]
    add_points(services, first, "train/return", [10, 20, 30], [0.1, -2.0, 1e-9])
    with services.database.write() as session:
        row = ReportedRow(seq=1, step=40, wall_time=1_040.5, values={"train/return": 7.25, "loss/policy": 0.5})
        MetricRepository(session).append({first["id"]: [row]})
    add_points(services, second, "train/return", [10], [4.0])

    response = export(client, "experiments", experiment, "csv")

    assert response.headers["content-type"] == "text/csv; charset=utf-8"
    assert [list(row.values()) for row in rows_of(response)] == [
        [first["id"], "3", "loss/policy", "40", "1040.5", "0.5"],
        [first["id"], "3", "train/return", "10", "1010.5", "0.1"],
        [first["id"], "3", "train/return", "20", "1020.5", "-2.0"],
        [first["id"], "3", "train/return", "30", "1030.5", "1e-09"],
        [first["id"], "3", "train/return", "40", "1040.5", "7.25"],
        [second["id"], "8", "train/return", "10", "1010.5", "4.0"],
    ]
    assert list(rows_of(response)[0]) == ["run", "seed", "metric", "step", "wall_time", "value"]
    assert rows_of(export(client, "runs", first, "csv")) == rows_of(response)[:5]


def test_a_value_comes_back_to_the_bit(client: TestClient, services: Services, reports: Reports) -> None:
    (run,) = reports.experiment()["runs"]
    values = np.random.default_rng(0).normal(scale=1e3, size=20_000).astype(np.float32)
    add_points(services, run, "loss", list(range(values.size)), values.tolist())

    rows = rows_of(export(client, "runs", run, "csv"))

    assert np.array_equal(np.array([row["value"] for row in rows], np.float32), values)
    assert [int(row["step"]) for row in rows] == list(range(values.size))


def test_what_was_not_finite_is_an_empty_cell(client: TestClient, services: Services, reports: Reports) -> None:
    (run,) = reports.experiment()["runs"]
    add_points(services, run, "loss", [1, 2, 3, 4], [1.0, math.nan, math.inf, 2.0])
    reports.metrics(run, "never", {1: -math.inf})

    rows = rows_of(export(client, "runs", run, "csv"))

    assert [(row["metric"], row["value"]) for row in rows] == [
        ("loss", "1.0"),
        ("loss", ""),
        ("loss", ""),
        ("loss", "2.0"),
        ("never", ""),
    ]


def test_a_run_without_points_is_a_heading(client: TestClient, reports: Reports) -> None:
    (run,) = reports.experiment()["runs"]
    assert export(client, "runs", run, "csv").text == "run,seed,metric,step,wall_time,value\r\n"
    (exported,) = export(client, "runs", run, "json").json()["runs"]
    assert (exported["step"], exported["state"], exported["final_evaluation"]) == (0, "queued", None)


@pytest.mark.parametrize("name", ["=1+1", "+a", "-a", "@SUM(A1)"])
def test_a_spreadsheet_takes_no_name_for_a_formula(
    client: TestClient, services: Services, reports: Reports, name: str
) -> None:
    (run,) = reports.experiment()["runs"]
    add_points(services, run, name, [1], [-5.0])

    (row,) = rows_of(export(client, "runs", run, "csv"))

    assert (row["metric"], row["value"]) == (f"'{name}", "-5.0")


def test_a_name_with_commas_and_quotes_is_one_cell(client: TestClient, services: Services, reports: Reports) -> None:
    (run,) = reports.experiment()["runs"]
    add_points(services, run, 'a,"b"\né', [1], [1.0])
    (row,) = rows_of(export(client, "runs", run, "csv"))
    assert row["metric"] == 'a,"b"\né'


@pytest.mark.parametrize(
    ("name", "plain"),
    [("Über den Gang / 2", "uber-den-gang-2"), ('../../"; rm', "rm"), ("走廊", "experiment"), ("x" * 99, "x" * 60)],
)
def test_files_are_named_in_plain_characters(client: TestClient, reports: Reports, name: str, plain: str) -> None:
    experiment = reports.experiment(name, seeds=(4,))
    (run,) = experiment["runs"]
    of_all = export(client, "experiments", experiment, "csv").headers["content-disposition"]
    of_one = export(client, "runs", run, "json").headers["content-disposition"]
    assert of_all == f'attachment; filename="mapless-{plain}-{experiment["id"]}.csv"'
    assert of_one == f'attachment; filename="mapless-{plain}-seed4-{run["id"]}.json"'


def test_a_document_holds_configuration_seeds_and_final_episodes(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment("Corridor", seeds=(0, 1), steps=5_000)
    first, second = experiment["runs"]
    reports.checkpoint(first, 1_000, reports.evaluation(arrivals=1))
    final = reports.checkpoint(first, 2_000, reports.evaluation(arrivals=8, steps=80))
    reports.state(second, "failed", error="Out of memory", step=7)

    response = export(client, "experiments", experiment, "json")
    document = response.json()

    assert response.headers["content-type"] == "application/json"
    assert (document["id"], document["name"]) == (experiment["id"], "Corridor")
    assert document["training"] == experiment["training"]
    one, other = document["runs"]
    assert (one["id"], one["seed"], other["seed"]) == (first["id"], 0, 1)
    evaluation = one["final_evaluation"]
    assert (evaluation["checkpoint"], evaluation["step"], evaluation["suite"]) == (final, 2_000, "simple-200")
    assert [episode["outcome"] for episode in evaluation["episodes"]] == ["arrival"] * 8 + ["collision"] * 2
    assert evaluation["episodes"][0]["steps"] == 80
    assert (other["state"], other["error"], other["step"], other["final_evaluation"]) == ("failed", "Out of memory", 7, None)
    assert export(client, "runs", second, "json").json() == document | {"runs": [other]}


def test_points_that_came_late_stand_where_they_belong_and_the_newest_counts(
    client: TestClient, services: Services, reports: Reports
) -> None:
    (run,) = reports.experiment()["runs"]
    add_points(services, run, "loss", list(range(0, 20_000, 2)), [0.0] * 10_000)
    reports.metrics(run, "loss", {1: 1.0, 10_000: 2.0, 19_999: 3.0})

    exported = Points.joined([points for _, points in read_series(services.database, run["id"])])
    with services.database.read() as session:
        whole = MetricRepository(session).read(run["id"])["loss"]

    assert np.array_equal(exported.steps, whole.steps)
    assert np.array_equal(exported.values, whole.values)
    assert exported.values[[1, 5_001, -1]].tolist() == [1.0, 2.0, 3.0]


def test_a_long_series_is_never_held_whole(services: Services, reports: Reports) -> None:
    (run,) = reports.experiment()["runs"]
    add_points(services, run, "loss", list(range(150_000)), [0.0] * 150_000)

    pieces = [len(points) for _, points in read_series(services.database, run["id"])]

    assert sum(pieces) == 150_000
    assert max(pieces) <= 8_192


def test_what_lies_in_the_trash_does_not_leave(client: TestClient, services: Services, reports: Reports) -> None:
    experiment = reports.experiment()
    (run,) = experiment["runs"]
    with services.database.write() as session:
        session.get_one(tables.Experiment, experiment["id"]).deleted_at = 1.0
    for path in (f"/api/experiments/{experiment['id']}/export", f"/api/runs/{run['id']}/export", "/api/runs/none/export"):
        assert client.get(path).status_code == 404


def test_a_format_that_nobody_knows_is_refused(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment()
    assert client.get(f"/api/experiments/{experiment['id']}/export?format=xls").status_code == 422


def read_by_tensorboard(folder: Path) -> dict[str, list[tuple[int, float, float]]]:
    """Step, wall time and value of every scalar, as TensorBoard's own reader has them; it checks each record's checksums."""
    reader = EventAccumulator(str(folder), size_guidance={"scalars": 0, "tensors": 0})
    reader.Reload()
    return {
        tag: [(int(event.step), float(event.wall_time), float(event.value)) for event in reader.Scalars(tag)]
        for tag in reader.Tags()["scalars"]
    }


def test_tensorboard_reads_the_same_points(client: TestClient, services: Services, reports: Reports, tmp_path: Path) -> None:
    (run,) = reports.experiment("Über", seeds=(5,))["runs"]
    # Every number of bytes that a step may take, on either side of where another one begins.
    steps = sorted({0, 1, 2**62, *(2 ** (7 * more) + side for more in range(1, 9) for side in (-1, 0))})
    add_points(services, run, "train/return", steps, [float(np.float32(0.1 * index)) for index in range(len(steps))])
    add_points(services, run, "loss/" + "é" * 59, [3, 4, 5, 6], [1.0, math.nan, math.inf, -2.5])

    response = export(client, "runs", run, "tensorboard")

    name = response.headers["content-disposition"].split('"')[1]
    assert name == f"events.out.tfevents.{int(run['created_at'])}.mapless-uber-seed5-{run['id']}"
    (tmp_path / name).write_bytes(response.content)
    read = read_by_tensorboard(tmp_path)
    assert set(read) == {"train/return", "loss/" + "é" * 59}
    assert read["train/return"] == [
        (step, step + 1_000.5, float(np.float32(0.1 * index))) for index, step in enumerate(steps)
    ]
    assert [(step, str(value)) for step, _, value in read["loss/" + "é" * 59]] == [
        (3, "1.0"),
        (4, "nan"),
        (5, "nan"),
        (6, "-2.5"),
    ]


def test_tensorboard_has_a_folder_for_each_run_of_an_experiment(
    client: TestClient, services: Services, reports: Reports, tmp_path: Path
) -> None:
    experiment = reports.experiment("../Corridor", seeds=(3, 8, 9))
    for run in experiment["runs"][:2]:
        add_points(services, run, "loss", list(range(10_000)), [float(run["seed"])] * 10_000)

    response = export(client, "experiments", experiment, "tensorboard")

    top = f"mapless-corridor-{experiment['id']}"
    assert response.headers["content-disposition"] == f'attachment; filename="{top}-tensorboard.zip"'
    with ZipFile(io.BytesIO(response.content)) as archive:
        assert archive.testzip() is None
        archive.extractall(tmp_path)
    assert sorted(path.name for path in (tmp_path / top).iterdir()) == ["seed3", "seed8", "seed9"]
    for seed in (3, 8):
        assert [(step, value) for step, _, value in read_by_tensorboard(tmp_path / top / f"seed{seed}")["loss"]] == [
            (step, float(seed)) for step in range(10_000)
        ]
    assert read_by_tensorboard(tmp_path / top / "seed9") == {}


def test_checksums_are_those_of_the_standard() -> None:
    """RFC 3720, B.4: 32 bytes of zeros, and of ones; and the usual nine digits."""
    for data, crc in ((bytes(32), 0x8A9136AA), (b"\xff" * 32, 0x62A8AB43), (b"123456789", 0xE3069283)):
        masked = ((crc >> 15 | crc << 17) + 0xA282EAD8) & 0xFFFFFFFF
        assert masked_crc32c(np.frombuffer(data, np.uint8)[None]).tolist() == [masked]


def test_an_event_is_written_as_worked_out_by_hand() -> None:
    header, record = event_file(0.0, [("a", Points.of([300], [1.0], [2.0]))])
    # Wall time, then "brain.Event:2".
    assert header[12:-4] == b"\x09" + bytes(8) + b"\x1a\x0dbrain.Event:2"
    # Wall time 1.0; step 300 = 0b10_0101100; a summary of 10 bytes, in it a value of 8, with tag "a" and 2.0.
    summary = b"\x2a\x0a" + b"\x0a\x08" + b"\x0a\x01a" + b"\x15" + struct.pack("<f", 2.0)
    assert record[12:-4] == b"\x09" + struct.pack("<d", 1.0) + b"\x10\xac\x02" + summary
    assert record[:8] == struct.pack("<Q", len(record) - 16)


def test_a_comparison_leaves_as_tables(client: TestClient, reports: Reports) -> None:
    experiment, unmeasured = reports.experiment("=Corridor", seeds=(0, 1)), reports.experiment("Later", seeds=(2,))
    for run, arrivals, values in zip(experiment["runs"], (8, 6), ([0.25, 0.5], [0.75, 1.0]), strict=True):
        reports.checkpoint(run, 2_000, reports.evaluation(arrivals=arrivals))
        reports.metrics(run, "train/return", {1_000: values[0], 2_000: values[1]})
    asked = {"experiment": [experiment["id"], unmeasured["id"]], "name": "train/return"}

    response = client.get("/api/compare/export", params=asked)

    assert response.headers["content-disposition"] == 'attachment; filename="mapless-comparison.zip"'
    with ZipFile(io.BytesIO(response.content)) as archive:
        tables_by_name = {
            name: list(csv.DictReader(io.StringIO(archive.read(name).decode()))) for name in archive.namelist()
        }
    success, steps, reward = tables_by_name["figures.csv"]
    assert [row["figure"] for row in (success, steps, reward)] == ["success", "steps_per_target", "reward"]
    assert (success["experiment"], success["name"]) == (experiment["id"], "'=Corridor")
    assert (success["value"], success["seeds"], success["episodes"], success["suite"]) == ("0.7", "2", "20", "simple-200")
    assert float(success["low"]) < 0.7 < float(success["high"])
    # Means of 60 and 20.
    assert (float(steps["value"]), float(reward["value"])) == (80.0, 40.0)
    of_first = [row for row in tables_by_name["curves.csv"] if row["experiment"] == experiment["id"]]
    assert [(row["step"], row["mean"], row["seeds"]) for row in of_first] == [("1000", "0.5", "2"), ("2000", "0.75", "2")]
    # Values that differ by 0.5 stand 0.25 either side of their mean; Student's t of one degree of freedom is 12.706.
    assert float(of_first[0]["high"]) == pytest.approx(0.5 + 12.706 * 0.25, rel=1e-3)
    assert [(row["seed"], row["step"], row["value"]) for row in tables_by_name["seeds.csv"]] == [
        ("0", "1000", "0.25"),
        ("0", "2000", "0.5"),
        ("1", "1000", "0.75"),
        ("1", "2000", "1.0"),
        ("2", "1000", ""),
        ("2", "2000", ""),
    ]
    whole = client.get("/api/compare/export", params=asked | {"format": "json"}).json()
    assert whole == {
        "comparison": client.get("/api/compare", params={"experiment": asked["experiment"]}).json(),
        "curves": client.get("/api/compare/curves", params=asked).json(),
    }
    assert client.get("/api/compare/export?experiment=none").status_code == 404
