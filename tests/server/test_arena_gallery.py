"""The gallery, uploads, and trainings on imported arenas."""

import base64
import json
import os
import pty
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from typer.testing import CliRunner

from server.arenas.references import with_geometry
from server.arenas.store import ArenaStore
from server.cli import app as command
from server.errors import NotFoundError
from server.services import Services
from sim.arenas import build_arenas
from sim.config import ImportedArenaConfig
from tests.server.harness import WORKER_TOKEN
from workers.config import TrainingConfig

LAB = """
format: mapless-arena/1
name: Lab
width: 8.0
height: 6.0
circles: [{x: 1.0, y: 0.5, radius: 0.3}]
"""


def upload(client: TestClient, content: bytes | str = LAB, name: str = "lab.yaml", **changes: Any) -> Any:
    raw = content.encode() if isinstance(content, str) else content
    file = {"name": name, "content": base64.b64encode(raw).decode()}
    return client.post("/api/arenas/imported", json={"files": [file], **changes})


def launch(client: TestClient, arena: dict[str, Any]) -> Any:
    return client.post("/api/experiments", json={"training": {"task": {"arena": arena}}})


def test_the_gallery_shows_what_can_be_trained_on(client: TestClient) -> None:
    arenas = client.get("/api/arenas").json()
    assert [arena["key"] for arena in arenas] == [
        "simple", "complex", "clutter", "corridors", "rooms", "warehouse", "maze", "passages", "thicket", "mixed", "varied",
        "intricate", "barn", "people",
    ]  # fmt: skip
    for arena in arenas:
        assert launch(client, arena["config"]).status_code == 201


def test_fixed_and_generated_arenas_are_drawn_as_they_are_trained_on(client: TestClient) -> None:
    view = client.get("/api/arenas/fixed", params={"name": "complex"}).json()
    assert (view["obstacles"], view["geometry"]["width"]) == (17, 10.0)
    assert 0.6 < view["free_share"] < 0.8
    view = client.get("/api/arenas/generated", params={"name": "maze", "difficulty": 0.8, "seed": 3}).json()
    config = TrainingConfig.model_validate({"task": {"arena": view["config"]}}).task.arena
    (arena, *_) = build_arenas(config)
    assert len(view["geometry"]["boxes"]) == len(arena.boxes)
    assert view["geometry"]["boxes"][0]["x"] == pytest.approx(arena.boxes[0, 0], abs=1e-4)
    assert client.get("/api/arenas/fixed", params={"name": "swamp"}).status_code == 422
    assert client.get("/api/arenas/generated", params={"name": "maze", "difficulty": 2}).status_code == 422


def test_an_upload_is_looked_at_first_and_kept_on_demand(client: TestClient) -> None:
    before = client.get("/api/arenas").json()
    preview = upload(client).json()
    assert (preview["title"], preview["obstacles"], preview["known"]) == ("Lab", 1, False)
    assert client.get("/api/arenas").json() == before
    kept = upload(client, keep=True).json()
    assert kept == preview | {"known": True}
    (arena,) = client.get("/api/arenas").json()[len(before) :]
    assert (arena["kind"], arena["title"], arena["config"]) == ("imported", "Lab", kept["config"])
    assert client.get(f"/api/arenas/imported/{arena['key']}").json() == kept
    # The same place again is no second arena.
    upload(client, LAB.replace("Lab", "Other name"), keep=True)
    assert len(client.get("/api/arenas").json()) == len(before) + 1


@pytest.mark.parametrize(
    ("content", "name", "reason"),
    [
        (b"<!DOCTYPE a [<!ENTITY b 'c'>]><sdf/>", "a.world", "entities"),
        (b"PK\x03\x04", "a.yaml", "unpack"),
        (b"format: mapless-arena/1", "a.yaml", "width"),
        (b"x", "../../a.exe", "kind of file"),
        (LAB.replace("0.3}", "40.0}").encode(), "lab.yaml", "square metres"),
    ],
)
def test_a_bad_file_is_refused_with_its_reason_and_leaves_nothing(
    client: TestClient, services: Services, content: bytes, name: str, reason: str
) -> None:
    response = upload(client, content, name, keep=True)
    assert response.status_code == 422
    assert reason in response.json()["detail"]
    assert not services.settings.arenas_dir.exists()


def test_what_is_no_upload_or_too_large_is_refused(client: TestClient) -> None:
    for content in ("%%%", "QUJDé"):
        response = client.post("/api/arenas/imported", json={"files": [{"name": "a.yaml", "content": content}]})
        assert (response.status_code, "base64" in response.json()["detail"]) == (422, True)
    assert client.post("/api/arenas/imported", json={"files": []}).status_code == 422
    assert client.post("/api/arenas/imported", content=b"x" * (25 * 2**20)).status_code == 413


def test_a_training_on_an_imported_arena_carries_it_to_the_worker(client: TestClient, services: Services) -> None:
    config = upload(client, keep=True).json()["config"]
    experiment = launch(client, config).json()
    # Lists stay small: the row knows the hash.
    assert experiment["training"]["task"]["arena"] == config
    training = with_geometry(TrainingConfig.model_validate(experiment["training"]), services.arenas)
    assert isinstance(training.task.arena, ImportedArenaConfig)
    (arena,) = build_arenas(training.task.arena)
    assert arena.circles.tolist() == [[1.0, 0.5, 0.3]]


def test_a_list_calls_an_imported_arena_by_its_name(client: TestClient) -> None:
    sha256 = upload(client, keep=True).json()["config"]["sha256"]
    launch(client, {"name": "imported", "sha256": sha256})
    launch(client, {"name": "simple"})

    listed = client.get("/api/experiments").json()["items"]
    assert [(one["arena"], one["arena_title"]) for one in listed] == [("simple", "Simple"), ("imported", "Lab")]


def test_geometry_that_comes_with_a_training_is_imported(client: TestClient, services: Services) -> None:
    config = upload(client).json()
    arena = config["config"] | {"arena": config["geometry"]}
    assert launch(client, arena).json()["training"]["task"]["arena"] == config["config"]
    assert services.arenas.get(config["config"]["sha256"]).document.name == "Lab"


def test_an_arena_that_is_not_here_cannot_be_trained_on(client: TestClient) -> None:
    for sha256 in ("", "0" * 64):
        response = launch(client, {"name": "imported", "sha256": sha256})
        assert (response.status_code, "gallery" in response.json()["detail"]) == (422, True)


def test_only_an_arena_that_no_training_uses_can_be_deleted(client: TestClient) -> None:
    sha256 = upload(client, keep=True).json()["config"]["sha256"]
    experiment = launch(client, {"name": "imported", "sha256": sha256}).json()
    assert client.get(f"/api/arenas/imported/{sha256}").json()["trainings"] == 1
    response = client.delete(f"/api/arenas/imported/{sha256}")
    assert (response.status_code, response.json()["detail"][:10]) == (409, "1 training")
    client.delete(f"/api/experiments/{experiment['id']}")
    # From the trash it could come back.
    assert client.delete(f"/api/arenas/imported/{sha256}").status_code == 409
    client.post("/api/workbench/actions", json={"action": "remove", "experiments": [experiment["id"]]})
    assert client.delete(f"/api/arenas/imported/{sha256}").status_code == 204
    assert client.get(f"/api/arenas/imported/{sha256}").status_code == 404
    assert client.delete(f"/api/arenas/imported/{sha256}").status_code == 404
    assert client.delete("/api/arenas/imported/etc").status_code == 404


def test_a_file_that_was_changed_is_another_place_and_not_shown(tmp_path: Path, services: Services) -> None:
    store = ArenaStore(tmp_path / "arenas")
    document = with_lab(store)
    path = tmp_path / "arenas" / f"{document}.json"
    path.write_text(path.read_text().replace("8.0", "9.0"))
    with pytest.raises(NotFoundError):
        store.get(document)
    assert store.all() == []


def test_a_run_whose_arena_is_gone_fails_with_that_reason_when_it_is_claimed(client: TestClient, services: Services) -> None:
    config = upload(client, keep=True).json()["config"]
    run_id = launch(client, config).json()["runs"][0]["id"]
    # Behind the service's back, which deletes no arena that a training uses.
    (services.settings.arenas_dir / f"{config['sha256']}.json").unlink()
    claimed = client.post(
        f"/api/worker/runs/{run_id}/claim",
        json={"worker": "w", "published_attempt": 0},
        headers={"Authorization": f"Bearer {WORKER_TOKEN}"},
    )
    assert claimed.status_code == 409
    run = client.get(f"/api/runs/{run_id}").json()
    assert run["state"] == "failed"
    assert run["error"].startswith("The arena is gone: ")


def with_lab(store: ArenaStore) -> str:
    from sim.arenas.files import read_arena

    return store.add(read_arena({"lab.yaml": LAB.encode()}))


def test_the_command_imports_lists_and_shows(tmp_path: Path) -> None:
    (tmp_path / "lab.yaml").write_text(LAB)
    (tmp_path / "bad.world").write_text("no XML")
    data = ["--data-dir", str(tmp_path / "data")]
    run = CliRunner()
    result = run.invoke(command, ["arena", "import", str(tmp_path / "lab.yaml"), str(tmp_path / "bad.world"), *data])
    assert result.exit_code == 1  # one of them was refused, and said why
    assert "Lab  8 x 6 m, 1 obstacles" in result.stdout
    assert "bad.world: not readable as XML" in result.stderr
    assert "Lab" in run.invoke(command, ["arena", "list", *data]).stdout
    shown = run.invoke(command, ["arena", "show", "Lab", *data]).stdout
    assert "- {x: 1.0, y: 0.5, radius: 0.3}" in shown
    assert run.invoke(command, ["arena", "show", "Cellar", *data]).exit_code == 1
    # What is shown can be imported again.
    (tmp_path / "again.yaml").write_text(shown)
    assert run.invoke(command, ["arena", "import", str(tmp_path / "again.yaml"), *data]).exit_code == 0
    assert len(json.loads((next((tmp_path / "data" / "arenas").glob("*.json"))).read_text())["circles"]) == 1


def test_a_world_is_uploaded_together_with_what_moves_in_it(client: TestClient) -> None:
    world = """<sdf><world name='w'><model name='post'><pose frame=>3 3 0 0 0 0</pose><link name='l'><collision name='c'>
      <geometry><cylinder><radius>0.3</radius><length>1</length></cylinder></geometry></collision></link></model>
      <model name='car'><link name='l'><collision name='c'><geometry><sphere><radius>0.2</radius></sphere></geometry>
      </collision></link><plugin name='driver' filename='driver.so'/></model></world></sdf>"""
    frames = "format: mapless-keyframes/1\nmodels: {driver: {keyframes: [{t: 0, x: 0, y: 0}, {t: 4, x: 3, y: 0}]}}"
    response = upload(client, world, "w.world")
    assert response.status_code == 422
    assert "driver.so" in response.json()["detail"]
    files = [
        {"name": name, "content": base64.b64encode(text.encode()).decode()}
        for name, text in (("w.world", world), ("w.keyframes.yaml", frames))
    ]
    preview = client.post("/api/arenas/imported", json={"files": files}).json()
    (mover,) = preview["geometry"]["movers"]
    assert (mover["kind"], mover["radius"], len(mover["keyframes"])) == ("timed", 0.2, 2)


def test_the_command_draws_what_it_understood_and_asks_who_sits_at_a_terminal(tmp_path: Path) -> None:
    file, data = tmp_path / "lab.yaml", tmp_path / "data"
    file.write_text(LAB)
    kept = []
    for answer in (b"n\n", b"y\n"):
        terminal, stdin = pty.openpty()
        os.write(terminal, answer)
        arguments = [sys.executable, "-m", "server", "arena", "import", str(file), "--data-dir", str(data)]
        done = subprocess.run(arguments, stdin=stdin, capture_output=True, text=True, check=True, timeout=60)
        os.close(terminal)
        os.close(stdin)
        assert "+--" in done.stdout
        assert "# obstacle" in done.stdout
        kept.append(len(list((data / "arenas").glob("*.json"))))
    assert kept == [0, 1]


def test_an_arena_is_looked_over_while_it_is_drawn(client: TestClient) -> None:
    arena = {"name": "Drawn", "width": 6.0, "height": 6.0, "target": {"x": 1.0, "y": 1.0}}
    found = client.post("/api/arenas/reviews", json={"arena": arena}).json()
    assert found["free_share"] == pytest.approx(found["free_area"] / 36.0, abs=1e-4)
    assert found["remarks"] == [
        {"refused": False, "text": "The target is not used without a start: place both, or neither.", "x": 1.0, "y": 1.0}
    ]
    # What is drawn is kept as a file of ours is, and what was said to be refused is.
    kept = upload(client, json.dumps(arena), "drawn.json", keep=True)
    assert (kept.status_code, kept.json()["title"]) == (200, "Drawn")
    full = arena | {"boxes": [{"x": 0.0, "y": 0.0, "length": 5.6, "width": 5.6}]}
    assert client.post("/api/arenas/reviews", json={"arena": full}).json()["remarks"][0]["refused"]
    assert upload(client, json.dumps(full), "drawn.json").status_code == 422
    assert client.post("/api/arenas/reviews", json={"arena": arena | {"width": -1.0}}).status_code == 422


def test_an_obstacle_whose_half_is_nothing_is_refused_with_its_place(client: TestClient) -> None:
    box = {"x": 0.0, "y": 0.0, "length": 5e-324, "width": 1.0}
    refused = client.post(
        "/api/arenas/reviews", json={"arena": {"name": "Lab", "width": 8.0, "height": 6.0, "boxes": [box]}}
    )
    assert refused.status_code == 422
    assert refused.json()["detail"][0]["loc"] == ["body", "arena", "boxes", 0, "length"]
