"""Projects: what belongs together, from the first database on."""

from collections.abc import Iterator

import pytest
from alembic import command
from fastapi.testclient import TestClient
from sqlalchemy import text

from server.database.engine import Database
from server.database.migrate import migration_config, upgrade
from server.services import Services
from tests.server.harness import Reports


@pytest.fixture
def database(empty_database_url: str) -> Iterator[Database]:
    database = Database(empty_database_url)
    yield database
    database.dispose()


def create(client: TestClient, name: str) -> str:
    response = client.post("/api/projects", json={"name": name})
    assert response.status_code == 201, response.text
    identifier: str = response.json()["id"]
    return identifier


def test_experiments_of_before_belong_to_the_first_project(database: Database) -> None:
    command.upgrade(migration_config(database), "0007")
    with database.write() as session:
        session.execute(text("INSERT INTO experiments (id, name, training, created_at) VALUES ('e', 'old', '{}', 1.0)"))
    upgrade(database)

    with database.read() as session:
        query = "SELECT p.name FROM experiments e JOIN projects p ON p.id = e.project_id WHERE e.id = 'e'"
        assert session.scalar(text(query)) == "Default"


def test_there_is_one_project_to_begin_with(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment()

    page = client.get("/api/projects").json()
    assert page["total"] == 1
    (project,) = page["items"]
    assert (project["name"], project["experiments"]) == ("Default", 1)
    assert experiment["project_id"] == project["id"]


def test_launched_into_a_project_found_there_and_moved_to_another(client: TestClient) -> None:
    halls, streets = create(client, "Halls"), create(client, "Streets")
    experiment = client.post("/api/experiments", json={"name": "a", "project_id": halls}).json()
    assert experiment["project_id"] == halls

    def listed(project: str) -> list[str]:
        return [each["name"] for each in client.get("/api/experiments", params={"project": project}).json()["items"]]

    assert (listed(halls), listed(streets)) == (["a"], [])
    moved = client.patch(f"/api/experiments/{experiment['id']}", json={"project_id": streets}).json()
    assert (moved["project_id"], moved["name"]) == (streets, "a")
    assert (listed(halls), listed(streets)) == ([], ["a"])
    counts = {each["name"]: each["experiments"] for each in client.get("/api/projects").json()["items"]}
    assert counts == {"Default": 0, "Halls": 0, "Streets": 1}


def test_a_campaign_is_launched_into_a_project(client: TestClient) -> None:
    halls = create(client, "Halls")
    assert client.post(f"/api/reproduction?project={halls}", json={"seeds": 1, "effort": 0.001}).status_code == 201

    found = client.get("/api/experiments", params={"limit": 200}).json()
    assert {each["project_id"] for each in found["items"]} == {halls}


def test_nothing_is_launched_into_a_project_that_is_not_there(client: TestClient) -> None:
    for path, body in (("/api/experiments", {"project_id": "nowhere"}), ("/api/reproduction?project=nowhere", {})):
        response = client.post(path, json=body)
        assert (response.status_code, "no project nowhere" in response.json()["detail"]) == (404, True)
    assert client.get("/api/experiments").json()["total"] == 0


def test_names_are_unique_in_any_case(client: TestClient, services: Services) -> None:
    halls, streets = create(client, "Halls"), create(client, "Straße")

    assert client.post("/api/projects", json={"name": "HALLS"}).status_code == 409
    refused = client.patch(f"/api/projects/{streets}", json={"name": " halls "})
    assert (refused.status_code, refused.json()["detail"]) == (
        409,
        "There is a project Halls already: choose another name.",
    )
    assert client.patch(f"/api/projects/{halls}", json={"name": "HALLS"}).json()["name"] == "HALLS"
    assert client.patch("/api/projects/nowhere", json={"name": "x"}).status_code == 404
    assert client.post("/api/projects", json={"name": "a\nb"}).status_code == 422
    assert client.post("/api/projects", json={"name": "x" * 81}).status_code == 422
