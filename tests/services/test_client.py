"""The Python client, its command line and what docs/client.md shows, against a server and workers as they are."""

import hashlib
import json
import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import httpx
import numpy as np
import pytest

import mapless_client
from mapless_client import models
from tests.services.stack import ROLLOUT, ROOT, TOKEN, Service
from tests.workers.robot_bags import as_mcap, messages, simulated

SCHEMAS = json.loads((ROOT / "web" / "openapi.json").read_text("utf-8"))["components"]["schemas"]


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    service = Service(tmp_path_factory.mktemp("client"))
    service.start_server()
    service.start("w", "workers", "worker", "--concurrency=2", "--name=w", "--jobs=1")
    yield service
    service.close()


@pytest.fixture(scope="module")
def client(service: Service) -> Iterator[mapless_client.Client]:
    with mapless_client.connect(service.url, TOKEN) as client:
        yield client


@pytest.fixture(scope="module")
def trained(client: mapless_client.Client) -> mapless_client.Experiment:
    training = {"steps": 2 * ROLLOUT, "evaluation": {"every_steps": ROLLOUT}}
    *_, last = client.watch(client.launch("Trained", training, seeds=(0, 1)).id, at_most_every=0.1)
    return last


@pytest.fixture
def environment(service: Service) -> dict[str, str]:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return {**os.environ, "PATH": path, "MAPLESS_URL": service.url, "MAPLESS_TOKEN": TOKEN}


def test_a_training_is_watched_to_its_end(client: mapless_client.Client) -> None:
    launched = client.launch("Watched", {"steps": 4 * ROLLOUT}, seeds=(3,))
    seen = list(client.watch(launched.id, at_most_every=0.05))

    assert launched.runs[0].seed == 3
    steps = [each.runs[0].step for each in seen]
    assert steps == sorted(steps)
    assert len(set(steps)) > 1
    assert seen[-1].state == "completed"
    assert steps[-1] == seen[-1].runs[0].total_steps == 4 * ROLLOUT
    assert not any(each.ended for each in seen[:-1])


def test_trainings_are_found_by_the_workbenchs_language(
    client: mapless_client.Client, trained: mapless_client.Experiment
) -> None:
    found = list(client.experiments('name = "Trained"', columns=["algorithm.gamma", "train/return"]))

    assert [each.id for each in found] == [trained.id]
    assert found[0].settings == {"algorithm.gamma": 0.995}
    assert found[0].metrics["train/return"].runs == 2
    with pytest.raises(mapless_client.InvalidRequestError, match="query"):
        list(client.experiments("gamma >"))


def test_curves_are_arrays(client: mapless_client.Client, trained: mapless_client.Experiment, service: Service) -> None:
    run = trained.runs[0].id
    curves = client.metrics(run, ["train/return", "time/steps_per_second"])

    assert set(curves) == {"train/return", "time/steps_per_second"}
    curve = curves["train/return"]
    assert curve.steps.dtype == np.int64
    assert curve.steps.tolist() == service.steps(run)
    assert curve.values.shape == curve.low.shape == curve.high.shape == curve.steps.shape
    assert np.isfinite(curve.values).all()


def test_policies_are_pulled_whole(
    client: mapless_client.Client, trained: mapless_client.Experiment, tmp_path: Path
) -> None:
    checkpoints = list(client.checkpoints(trained.runs[0].id))
    best = client.best_checkpoint(trained.runs[0].id)

    archive = client.pull(best.id, tmp_path / "new")
    assert hashlib.sha256(archive.path.read_bytes()).hexdigest() == archive.sha256 == best.sha256
    assert [each.best for each in checkpoints].count(True) == 1
    assert best in checkpoints

    bundle, onnx = client.pull(best.id, tmp_path, "bundle"), client.pull(best.id, tmp_path, "onnx")
    with zipfile.ZipFile(bundle.path) as opened:
        assert opened.read("mapless-policy/policy.onnx") == onnx.path.read_bytes()
    assert {each.name for each in tmp_path.iterdir()} == {"new", bundle.path.name, onnx.path.name}, "nothing is left over"


def test_a_download_goes_on_where_it_broke_off(
    client: mapless_client.Client, trained: mapless_client.Experiment, tmp_path: Path, service: Service
) -> None:
    best = client.best_checkpoint(trained.runs[0].id)
    whole = client.pull(best.id, tmp_path / "whole").path.read_bytes()
    # Half of it is there, but for a byte that could only be the part's own.
    marked = bytes([whole[0] ^ 1]) + whole[1 : len(whole) // 2]
    part = tmp_path / f".{best.id}-archive-{best.sha256}.part"
    part.write_bytes(marked)

    with pytest.raises(mapless_client.DamagedDownloadError, match="SHA-256"):
        client.pull(best.id, tmp_path)
    assert not part.exists()

    part.write_bytes(whole[: len(whole) // 2])
    with httpx.Client(base_url=service.url, headers={"Authorization": f"Bearer {TOKEN}"}) as http:
        answers: list[httpx.Response] = []
        http.event_hooks["response"].append(answers.append)
        pulled = mapless_client.Client(service.url, http=http).pull(best.id, tmp_path)
    assert pulled.path.read_bytes() == whole
    assert [answer.status_code for answer in answers] == [206]
    assert int(answers[0].headers["Content-Length"]) == len(whole) - len(whole) // 2 + 1


def test_a_part_of_another_file_is_begun_anew(
    client: mapless_client.Client, trained: mapless_client.Experiment, tmp_path: Path
) -> None:
    best = client.best_checkpoint(trained.runs[0].id)
    (tmp_path / f".{best.id}-archive-{'0' * 64}.part").write_bytes(b"something else")

    pulled = client.pull(best.id, tmp_path)

    assert pulled.sha256 == best.sha256
    assert [each.name for each in tmp_path.iterdir()] == [pulled.path.name]


def test_trainings_are_compared(client: mapless_client.Client, trained: mapless_client.Experiment) -> None:
    other = client.launch("Other", {"steps": ROLLOUT, "algorithm": {"gamma": 0.9}})
    list(client.watch(other.id, at_most_every=0.1))
    comparison = client.compare([trained.id, other.id])

    assert [each.id for each in comparison.experiments] == [trained.id, other.id]
    assert comparison.verdicts[0].word == "refused"
    gammas = {each.path: each.values for each in comparison.differences}["algorithm.gamma"]
    assert gammas == [0.995, 0.9]
    assert client.diagnoses(trained.runs[0].id).run_id == trained.runs[0].id
    assert any("begins" in event.message for event in client.events(trained.runs[0].id))


def test_what_the_server_refuses_is_an_error_with_its_sentence(client: mapless_client.Client, service: Service) -> None:
    with pytest.raises(mapless_client.NotFoundError, match="nowhere"):
        client.run("nowhere")
    with pytest.raises(mapless_client.InvalidRequestError, match=r"training\.ppo\.gamma|algorithm.*gamma"):
        client.launch("Wrong", {"algorithm": {"gamma": 2.0}})
    with mapless_client.connect(service.url, "wrong") as stranger, pytest.raises(mapless_client.UnauthorizedError):
        stranger.run("any")


def test_settings_are_searched(client: mapless_client.Client, environment: dict[str, str]) -> None:
    command = ["mapless", "search", "Afar", "--range", "algorithm.learning_rate=1e-4..1e-2:log", "--values"]
    command += ["algorithm.epochs=3,6", "--trials", "4", "--sampler", "quasi", "--set", "steps=1000000"]
    printed = subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.strip()

    stopped = client.stop_study(printed)
    assert (stopped.name, stopped.state, stopped.trials) == ("Afar", "stopped", 4)
    found = client.study(printed)
    assert found.best is None
    assert all(set(trial.values) == {"algorithm.learning_rate", "algorithm.epochs"} for trial in found.results)
    with pytest.raises(mapless_client.InvalidRequestError, match="no such setting"):
        client.search("Wrong", [{"kind": "range", "path": "algorithm.speed", "low": 0.0, "high": 1.0}])


def test_a_robots_recording_becomes_the_task_of_a_training(client: mapless_client.Client, tmp_path: Path) -> None:
    file = tmp_path / "corridor.mcap"
    file.write_bytes(as_mcap(messages(simulated(seconds=45.0, lidar={"noise": 0.01}))))
    sent = client.upload_recording(file)
    assert (sent.name, sent.size) == ("corridor.mcap", file.stat().st_size)
    assert [recording.id for recording in client.recordings()] == [sent.id]
    reading = client.recording_reading(sent.id)
    (noise,) = (fitted for fitted in reading.fitted if fitted.key == "lidar.noise")
    assert noise.value == pytest.approx(0.01, rel=0.3)
    task = reading.task()
    assert task["lidar"]["noise"] == pytest.approx(noise.value, abs=1e-3)
    launched = client.launch("As it drives", {"steps": 2 * ROLLOUT, "task": task})
    client.stop(launched.id)
    file.write_bytes(b"")
    with pytest.raises(mapless_client.RefusedError, match="file is empty"):
        client.upload_recording(file)


def test_the_models_say_what_the_api_says() -> None:
    """Every field is in the API's description, and may be None only where the API says so."""
    for name in vars(models):
        model = getattr(models, name)
        if not (isinstance(model, type) and issubclass(model, models.Model)) or model is models.Model:
            continue
        described = SCHEMAS.get(name) or SCHEMAS[f"{name}-Output"]
        for field, said in model.model_fields.items():
            assert field in described["properties"], f"{name}.{field}"
            nullable = {"type": "null"} in described["properties"][field].get("anyOf", [])
            allows_none = type(None) in get_args(said.annotation) or said.annotation is Any
            assert nullable == allows_none, f"{name}.{field}"


def test_what_the_page_shows_runs(environment: dict[str, str], tmp_path: Path) -> None:
    text = (ROOT / "docs" / "client.md").read_text("utf-8")
    exported, commands, *_installs = re.findall(r"```sh\n(.*?)```", text, re.DOTALL)
    (program,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert set(re.findall(r"MAPLESS_\w+", exported)) == {"MAPLESS_URL", "MAPLESS_TOKEN"}

    shell = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", commands], env=environment, cwd=tmp_path, capture_output=True, text=True
    )
    assert shell.returncode == 0, shell.stderr
    assert "algorithm.gamma: 0.995, 0.97" in shell.stdout
    assert len(json.loads((tmp_path / "comparison.json").read_text())["experiments"]) == 2
    assert (tmp_path / "tables.tex").read_text().count(r"\toprule") == 4
    assert "<svg" in (tmp_path / "comparison.html").read_text()
    assert sorted(path.suffix for path in (tmp_path / "policies").iterdir()) == [".onnx", ".zip", ".zip"]

    python = subprocess.run([sys.executable, "-c", program], env=environment, cwd=tmp_path, capture_output=True, text=True)
    assert python.returncode == 0, python.stderr
    assert "at step 16,384" in python.stdout
    assert python.stdout.splitlines()[-1].startswith("policies/mapless-from-a-program-seed0-")


def test_what_the_page_of_data_shows_runs(
    environment: dict[str, str], trained: mapless_client.Experiment, tmp_path: Path
) -> None:
    text = (ROOT / "docs" / "data.md").read_text("utf-8")
    _, *commands = re.findall(r"```sh\n(.*?)```", text, re.DOTALL)

    shell = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", "".join(commands)], env=environment, cwd=tmp_path, capture_output=True, text=True
    )

    assert shell.returncode == 0, shell.stderr
    assert "train/return" in (tmp_path / "points.csv").read_text()
    document = json.loads((tmp_path / "training.json").read_text())
    assert document["runs"][0]["final_evaluation"]["episodes"]
    with zipfile.ZipFile(tmp_path / "comparison.zip") as archive:
        assert archive.namelist() == ["figures.csv", "curves.csv", "seeds.csv"]
        assert b"train/return" in archive.read("curves.csv")
    assert r"\toprule" in (tmp_path / "figures.tex").read_text()
    assert "train/return" in (tmp_path / "comparison.html").read_text()
    runs = {path.parent.name for path in (tmp_path / "events").glob("*/*/events.out.tfevents.*")}
    assert runs == {f"seed{run['seed']}" for run in document["runs"]}
    # What comes back to where it is from is there already.
    assert re.search(rf"^{document['runs'][0]['id']} +there", shell.stdout, re.MULTILINE)


def test_the_notebook_runs(environment: dict[str, str], tmp_path: Path) -> None:
    notebook = json.loads((ROOT / "docs" / "client.ipynb").read_text("utf-8"))
    cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    ran = subprocess.run(
        [sys.executable, "-c", "\n".join(cells)], env=environment, cwd=tmp_path, capture_output=True, text=True
    )

    assert ran.returncode == 0, ran.stderr
    assert "refused" in ran.stdout
    assert list((tmp_path / "policies").glob("*.zip"))


def test_it_needs_nothing_of_the_server(tmp_path: Path) -> None:
    loaded = "import mapless_client, mapless_client.command, sys; print([m for m in sys.modules if m.split('.')[0] in "
    loaded += "('server', 'workers', 'sim', 'torch', 'numba')])"
    run = subprocess.run([sys.executable, "-c", loaded], cwd=tmp_path, capture_output=True, text=True, check=True)

    assert run.stdout == "[]\n"


def test_the_command_line_refuses_in_one_line(environment: dict[str, str]) -> None:
    def refused(*arguments: str) -> str:
        run = subprocess.run(["mapless", *arguments], env=environment, capture_output=True, text=True)
        assert run.returncode == 1
        return run.stderr

    assert refused("watch", "nowhere") == "mapless: There is no experiment nowhere; it may have been deleted.\n"
    assert refused("launch", "x", "--set", "steps") == "mapless: --set steps: a setting, an equals sign, a value.\n"
    assert refused("search", "x", "--values", "epochs").startswith("mapless: --values epochs: a setting")
    assert refused("search", "x", "--range", "gamma=0.9").startswith("mapless: --range gamma=0.9: a setting")
    assert refused("pull", "x", "--as", "zip") == "mapless: --as takes archive, bundle, onnx, not zip.\n"
