"""Policies from elsewhere: uploaded, measured by a worker as any other, and refused with the reason where they don't fit."""

import base64
import io
import zipfile
from typing import Any

import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from server.services import Services
from tests.server.people import Lab
from tests.server.test_evaluations import ended
from tests.workers.test_onnx_policy import SIZE, graph
from workers.export.bundle import bundle, export_checkpoint
from workers.shipped.library import shipped_policy

POLICY = shipped_policy("simple")


def upload(client: TestClient, content: bytes, **more: Any) -> dict[str, Any]:
    body = {"name": "From elsewhere", "content": base64.b64encode(content).decode(), **more}
    found: dict[str, Any] = client.post("/api/uploads", json=body).json()
    return found


def test_a_bundle_that_went_out_comes_back_and_drives_as_it_did(client: TestClient, job_worker: None) -> None:
    mine = upload(client, bundle(export_checkpoint(POLICY.archive)))
    assert mine["task"] == POLICY.card.training.task.model_dump(mode="json")
    policy = {"source": "uploaded", "id": mine["id"]}
    suites = [{"by": "name", "name": "simple-200"}]
    (asked,) = client.post("/api/evaluations", json={"policies": [policy], "suites": suites}).json()
    done = ended(client, asked)
    assert (done["state"], done["error"], done["title"]) == ("done", None, "From elsewhere")
    recorded = POLICY.evaluation("simple-200")
    # onnxruntime rounds otherwise than torch: an episode in a hundred may end otherwise.
    assert abs(done["figures"]["success"]["value"] - recorded.success_rate) <= 0.01
    entries = client.get(f"/api/leaderboards/{done['suite_hash']}").json()["entries"]
    assert ("uploaded", "From elsewhere") in {(entry["kind"], entry["title"]) for entry in entries}
    # What was measured stays when the policy goes.
    assert client.delete(f"/api/uploads/{mine['id']}").status_code == 204
    assert client.get(f"/api/evaluations/{asked['id']}").json()["figures"] == done["figures"]
    assert client.get("/api/uploads").json() == {"items": [], "total": 0}


def test_a_policy_of_another_robot_or_none_at_all_is_refused_when_it_comes(client: TestClient) -> None:
    for content, reason in (
        (graph(numbers=SIZE + 1), "choose the ones that the policy was trained with"),
        (b"\x08 and no more of it", "this is no ONNX file"),
        (b"no graph", "this is no ONNX file"),
    ):
        (problem,) = upload(client, content, task={})["detail"]
        assert problem["loc"] == ["body", "content"]
        assert reason in problem["msg"]
    assert client.get("/api/uploads").json()["total"] == 0


OTHER_ROBOT = {
    "robot": {"name": "round", "max_linear_speed": 0.8, "drive": {"name": "omnidirectional", "sideways": 0.5}},
    "lidar": {"rays": 24, "field_of_view": 270.0, "range": 8.0, "noise": 0.01},
    "observation": {
        "parts": [{"name": "ranges", "batches": 24, "frames": 2}, {"name": "distance"}, {"name": "bearing", "frames": 3}]
    },
    "control_period": 0.1,
}


def test_a_task_that_was_filled_in_says_what_the_file_has_to_be_and_takes_it(client: TestClient) -> None:
    shapes = client.post("/api/uploads/shapes", json={"task": OTHER_ROBOT}).json()
    # 24 ranges at two moments, a distance, a bearing at three.
    assert shapes["observation"] == 52
    assert shapes["parts"] == [
        {"name": "ranges", "numbers": 48},
        {"name": "distance", "numbers": 1},
        {"name": "bearing", "numbers": 3},
    ]
    assert [(one["name"], one["low"], one["high"], one["unit"]) for one in shapes["actions"]] == [
        ("linear", -0.8, 0.8, "m/s"),
        ("lateral", -0.4, 0.4, "m/s"),
        ("angular", -1.5, 1.5, "rad/s"),
    ]
    mine = upload(client, graph(numbers=52, actions=3), task=OTHER_ROBOT)
    assert (mine["task"]["lidar"]["rays"], mine["task"]["control_period"]) == (24, 0.1)
    (problem,) = upload(client, graph(numbers=50, actions=3), task=OTHER_ROBOT)["detail"]
    assert "(n, 50), and this robot, LiDAR and observation make it (n, 52)" in problem["msg"]
    (problem,) = upload(client, graph(numbers=52, actions=2), task=OTHER_ROBOT)["detail"]
    assert "'action' is (n, 2), and this robot" in problem["msg"]


def test_what_does_not_fit_in_a_task_is_refused_at_its_field(client: TestClient) -> None:
    task = OTHER_ROBOT | {"lidar": {"rays": 25}}
    for address, more in (("/api/uploads/shapes", {}), ("/api/uploads", {"name": "Mine", "content": ""})):
        refused = client.post(address, json={"task": task, **more})
        assert refused.status_code == 422
        (problem,) = refused.json()["detail"]
        assert problem["loc"] == ["body", "task", "observation"]
        assert "24 does not divide 25" in problem["msg"]


def test_a_file_that_takes_for_ever_is_ended(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("server.uploads.look._SECONDS", 0.01)
    (problem,) = upload(client, graph(), task={})["detail"]
    assert "ONNX Runtime was not done with it" in problem["msg"]


def test_what_is_no_policy_is_refused_next_to_its_field(client: TestClient) -> None:
    def problem(found: dict[str, Any]) -> tuple[list[str], str]:
        (one,) = found["detail"]
        return one["loc"], one["msg"]

    assert problem(upload(client, graph())) == (
        ["body", "task"],
        "Say which robot, LiDAR and observation this policy is for.",
    )
    assert problem(upload(client, b"", task={}))[0] == ["body", "content"]
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("bundle/policy.onnx", graph())
    location, message = problem(upload(client, archive.getvalue()))
    assert location == ["body", "content"]
    assert "manifest.json" in message
    # A file that unpacks to more than anybody may send.
    with zipfile.ZipFile(archive := io.BytesIO(), "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("bundle/manifest.json", b"{}")
        file.writestr("bundle/policy.onnx", bytes(17 * 2**20))
    assert "larger than 16 MiB" in upload(client, archive.getvalue())["detail"]


def test_each_sees_the_uploads_of_their_projects(client: TestClient, services: Services) -> None:
    lab = Lab(services)
    here = lab.project("Here")
    editor, viewer = lab.person("editor", {here: "editor"}), lab.person("viewer", {here: "viewer"})
    stranger = lab.person("stranger", {lab.project("There"): "admin"})
    mine = upload(client, graph(), task={}, project_id=here)
    (asked,) = client.post("/api/evaluations", json={"policies": [{"source": "uploaded", "id": mine["id"]}]}).json()
    del client.headers["Authorization"]
    for person, total, found in ((viewer, 1, 200), (stranger, 0, 404)):
        headers = lab.browser(person)
        assert client.get("/api/uploads", headers=headers).json()["total"] == total
        assert client.get("/api/evaluations", headers=headers).json()["total"] == total
        assert client.get(f"/api/evaluations/{asked['id']}", headers=headers).status_code == found
    assert client.delete(f"/api/uploads/{mine['id']}", headers=lab.browser(viewer)).status_code == 403
    assert client.delete(f"/api/uploads/{mine['id']}", headers=lab.browser(editor)).status_code == 204


def test_a_project_that_is_not_there_is_named(client: TestClient) -> None:
    body = {"name": "From elsewhere", "content": base64.b64encode(graph()).decode(), "task": {}, "project_id": "nowhere"}
    refused = client.post("/api/uploads", json=body)
    assert (refused.status_code, "no project nowhere" in refused.json()["detail"]) == (404, True)


@pytest.mark.parametrize("packing", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_bundle_with_other_bytes_in_it_is_taken_or_refused(
    client: TestClient, monkeypatch: pytest.MonkeyPatch, packing: int, data: st.DataObject
) -> None:
    # What is in the bundle is looked at in a process of its own, each time anew; here it is how it is packed.
    monkeypatch.setattr("server.uploads.service.problem_of", lambda *_: "")
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", packing) as archive:
        archive.writestr("robot/policy.onnx", b"a graph " * 20)
        archive.writestr("robot/manifest.json", '{"training": {"task": {}}}')
    whole = file.getvalue()
    damaged = bytearray(whole)
    for _ in range(data.draw(st.integers(0, 3))):
        start = data.draw(st.integers(4, len(whole) - 1))
        new = data.draw(st.binary(min_size=1, max_size=8))
        damaged[start : start + len(new)] = new
    content = bytes(damaged[: data.draw(st.integers(len(whole) - 40, len(whole)))])
    body = {"name": "From elsewhere", "content": base64.b64encode(content).decode()}
    answer = client.post("/api/uploads", json=body)
    assert answer.status_code in {201, 413, 422}, answer.text
    if answer.status_code == 201:
        assert client.delete(f"/api/uploads/{answer.json()['id']}").status_code == 204
