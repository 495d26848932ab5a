"""Robots' recordings: uploaded, read by a worker, held beside a policy, seen by those of their project, deleted."""

import base64
from typing import Any

import pytest
from fastapi.testclient import TestClient

from server.bags import service
from server.services import Services
from tests.server.people import Lab
from tests.workers.robot_bags import as_mcap, messages, simulated
from tests.workers.test_bags import TRUTH, task
from tests.workers.test_onnx_policy import graph

URL = "/api/recordings"


@pytest.fixture(scope="module")
def recorded() -> bytes:
    return as_mcap(messages(simulated(seed=3, seconds=40.0, jitter=0.002, speed_noise=0.01, **task())))


def upload(client: TestClient, content: bytes, **query: str) -> dict[str, Any]:
    answer = client.post(URL, params={"name": "drive.mcap", **query}, content=content)
    assert answer.status_code == 201, answer.text
    found: dict[str, Any] = answer.json()
    return found


def test_a_recording_is_read_and_held_beside_policies(client: TestClient, job_worker: None, recorded: bytes) -> None:
    mine = upload(client, recorded)
    assert (mine["name"], mine["size"]) == ("drive.mcap", len(recorded))
    assert client.get(f"{URL}/{mine['id']}").json() == mine
    reading = client.get(f"{URL}/{mine['id']}/reading").json()
    assert reading["seconds"] == pytest.approx(40.0, abs=0.1)
    fitted = {each["key"]: each for each in reading["fitted"]}
    for key, truth in TRUTH.items():
        assert fitted[key]["low"] <= truth <= fitted[key]["high"]
    shipped = client.get(f"{URL}/{mine['id']}/beside", params={"shipped": "complex"}).json()
    assert (shipped["policy"], shipped["period"]) == ("Complex arena", 0.2)
    assert len(shipped["times"]) == len(shipped["forwards"]) == 201
    assert shipped["partings"][0]["metres"] >= shipped["partings"][-1]["metres"] > 0.1
    # Somebody's ONNX file of the default task.
    sent = {"name": "Mine", "content": base64.b64encode(graph()).decode(), "task": {}}
    foreign = client.post("/api/uploads", json=sent).json()
    uploaded = client.get(f"{URL}/{mine['id']}/beside", params={"uploaded": foreign["id"]}).json()
    assert uploaded["policy"] == "Mine"
    assert any(uploaded["driving"])
    # Another choice of topics is another reading.
    refused = client.get(f"{URL}/{mine['id']}/reading", params={"scan": "/front"})
    assert (refused.status_code, refused.json()["detail"]) == (422, "No scans are on /front: choose another topic.")
    nobody = client.get(f"{URL}/{mine['id']}/beside")
    assert (nobody.status_code, nobody.json()["detail"][0]["msg"]) == (
        422,
        "Say which policy: shipped, checkpoint or uploaded.",
    )
    assert client.delete(f"{URL}/{mine['id']}").status_code == 204
    assert client.get(f"{URL}/{mine['id']}/reading").status_code == 404
    assert client.get(URL).json() == {"items": [], "total": 0}


def test_what_is_no_recording_is_kept_and_says_so_when_it_is_read(client: TestClient, job_worker: None) -> None:
    mine = upload(client, b"no recording")
    refused = client.get(f"{URL}/{mine['id']}/reading")
    assert refused.status_code == 422
    assert refused.json()["detail"].startswith("This is no recording of ROS 2: choose an .mcap file")


def test_what_is_too_large_or_empty_or_one_too_many_is_refused(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service, "MAX_BAG_BYTES", 1_000)
    large = client.post(URL, params={"name": "large"}, content=bytes(1_001))
    assert large.status_code == 413
    assert "record only what is needed" in large.json()["detail"]
    empty = client.post(URL, params={"name": "empty"}, content=b"")
    assert (empty.status_code, empty.json()["detail"]) == (400, "The file is empty: choose the recording again.")
    monkeypatch.setattr(service, "MAX_BAGS", 1)
    upload(client, b"first")
    second = client.post(URL, params={"name": "second"}, content=b"second")
    assert (second.status_code, second.json()["detail"]) == (409, "There are 1 recordings already: delete some first.")


def test_each_sees_the_recordings_of_their_projects(client: TestClient, services: Services) -> None:
    lab = Lab(services)
    here = lab.project("Here")
    editor, viewer = lab.person("editor", {here: "editor"}), lab.person("viewer", {here: "viewer"})
    stranger = lab.person("stranger", {lab.project("There"): "admin"})
    mine = upload(client, b"anything", project_id=here)
    del client.headers["Authorization"]
    for person, total, found in ((viewer, 1, 200), (stranger, 0, 404)):
        headers = lab.browser(person)
        assert client.get(URL, headers=headers).json()["total"] == total
        assert client.get(f"{URL}/{mine['id']}", headers=headers).status_code == found
    refused = client.post(URL, params={"name": "x", "project_id": here}, content=b"x", headers=lab.browser(stranger))
    assert refused.status_code in (403, 404)
    assert client.delete(f"{URL}/{mine['id']}", headers=lab.browser(viewer)).status_code == 403
    assert client.delete(f"{URL}/{mine['id']}", headers=lab.browser(editor)).status_code == 204


def test_a_project_that_is_not_there_is_named(client: TestClient) -> None:
    refused = client.post(URL, params={"name": "drive.mcap", "project_id": "nowhere"}, content=b"a recording")
    assert (refused.status_code, "no project nowhere" in refused.json()["detail"]) == (404, True)
