"""Policies from elsewhere: uploaded, measured by a worker as any other, and refused with the reason where they don't fit."""

import base64
import io
import zipfile
from typing import Any

from fastapi.testclient import TestClient

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
    assert ("evaluation", "From elsewhere") in {(entry["kind"], entry["title"]) for entry in entries}
    # What was measured stays when the policy goes.
    assert client.delete(f"/api/uploads/{mine['id']}").status_code == 204
    assert client.get(f"/api/evaluations/{asked['id']}").json()["figures"] == done["figures"]
    assert client.get("/api/uploads").json() == {"items": [], "total": 0}


def test_a_policy_of_another_robot_says_so(client: TestClient, job_worker: None) -> None:
    mine = upload(client, graph(numbers=SIZE + 1), task={})
    (asked,) = client.post("/api/evaluations", json={"policies": [{"source": "uploaded", "id": mine["id"]}]}).json()
    failed = ended(client, asked)
    assert failed["state"] == "failed"
    assert "choose the ones that the policy was trained with" in failed["error"]


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
