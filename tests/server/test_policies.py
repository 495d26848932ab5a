"""The policies that ship, as the pages see them."""

import io
import zipfile

import pytest
from fastapi.testclient import TestClient

from workers.shipped.library import baselines, shipped_policies, shipped_policy


def test_every_policy_stands_beside_the_baselines_of_its_suites(client: TestClient) -> None:
    policies = {policy["name"]: policy for policy in client.get("/api/policies").json()}
    assert policies.keys() == {policy.card.name for policy in shipped_policies()}
    for name, policy in policies.items():
        assert client.get(f"/api/policies/{name}").json() == policy
        card = shipped_policy(name).card
        assert [result["suite"] for result in policy["results"]] == [result.suite for result in card.results]
        for result, recorded in zip(policy["results"], card.results, strict=True):
            assert result["policy"]["success"]["value"] == recorded.figures.success
            assert result["policy"]["success"]["episodes"] == recorded.figures.episodes
            assert [row["name"] for row in result["baselines"]] == [baseline.name for baseline in baselines().baselines]


def test_every_figure_leads_to_its_episodes(client: TestClient) -> None:
    for policy in client.get("/api/policies").json():
        for result in policy["results"]:
            found = client.get(f"/api/policies/{policy['name']}/suites/{result['suite']}/episodes").json()
            assert found["suite_hash"] == result["suite_hash"]
            arrived = [episode["steps"] for episode in found["episodes"] if episode["outcome"] == "arrival"]
            assert len(arrived) / len(found["episodes"]) == result["policy"]["success"]["value"]
            assert sum(arrived) / len(arrived) == result["policy"]["steps"]


def test_a_policy_is_taken_away_as_a_checkpoint_and_as_a_bundle(client: TestClient, job_worker: None) -> None:
    archive = client.get("/api/policies/simple/download")
    assert archive.content == shipped_policy("simple").archive.read_bytes()
    assert archive.headers["content-disposition"] == 'attachment; filename="mapless-simple.zip"'
    bundle = client.get("/api/policies/simple/bundle")
    assert 'filename="mapless-simple-bundle.zip"' in bundle.headers["content-disposition"]
    with zipfile.ZipFile(io.BytesIO(bundle.content)) as files:
        assert "mapless-policy/policy.onnx" in files.namelist()


@pytest.mark.parametrize(
    "path", ["nobody", "nobody/download", "nobody/bundle", "nobody/suites/simple-200/episodes", "simple/suites/x/episodes"]
)
def test_there_is_no_other(client: TestClient, path: str) -> None:
    assert client.get(f"/api/policies/{path}").status_code == 404


def test_a_training_like_it_can_be_launched(client: TestClient) -> None:
    policy = client.get("/api/policies/complex").json()
    launched = client.post(
        "/api/experiments", json={"name": "Again", "seeds": [policy["seed"]], "training": policy["training"]}
    )
    assert launched.status_code == 201
    assert launched.json()["training"] == policy["training"]
