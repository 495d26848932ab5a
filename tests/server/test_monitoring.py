"""What Prometheus is told: true, bounded, for who may ask; alert rules that promtool understands; and a real scrape."""

import re
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import yaml
from fastapi.testclient import TestClient
from prometheus_client.parser import text_string_to_metric_families

from server.app import create_app
from server.database.engine import Database
from server.services import Services
from server.settings import Settings
from tests.conftest import require_program
from tests.server.harness import BASE_URL, TOKEN, WORKER_TOKEN, Reports
from tests.server.test_serving import serving

ALERTS = Path(__file__).parents[2] / "server" / "monitoring" / "alerts.yml"
METRICS_TOKEN = "a-token-for-prometheus"

Sample = tuple[str, frozenset[tuple[str, str]]]


def scraped(client: TestClient) -> dict[Sample, float]:
    response = client.get("/metrics")
    assert response.status_code == 200
    assert response.headers["content-type"].startswith("text/plain")
    return {
        (sample.name, frozenset(sample.labels.items())): sample.value
        for family in text_string_to_metric_families(response.text)
        for sample in family.samples
    }


def sample(name: str, **labels: str) -> Sample:
    return name, frozenset(labels.items())


def bearer(token: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {token}"}


def test_runs_queues_and_sizes_are_told(client: TestClient, reports: Reports) -> None:
    waiting = reports.experiment(seeds=(0, 1, 2), device="cuda")["runs"]
    running = reports.experiment()["runs"][0]
    reports.state(waiting[0], "queued", queued_at=time.time() - 100)
    reports.state(running, "running")
    reports.checkpoint(running, 10, None)
    reports.heard_of("w", 1.0)

    found = scraped(client)
    assert found[sample("mapless_runs", state="queued")] == 3
    assert found[sample("mapless_runs", state="running")] == 1
    assert found[sample("mapless_runs", state="failed")] == 0
    assert found[sample("mapless_queue_depth", queue="gpu")] == 3
    assert found[sample("mapless_queue_depth", queue="cpu")] == 0
    assert 100 <= found[sample("mapless_queue_wait_seconds", queue="gpu")] < 200
    assert found[sample("mapless_queue_wait_seconds", queue="cpu")] == 0
    assert found[sample("mapless_workers", queue="cpu")] == 1
    assert found[sample("mapless_store_bytes")] == len(b"archive of step 10")
    assert found[sample("mapless_database_bytes")] > 10_000
    assert found[sample("mapless_database_up")] == 1
    assert found[sample("mapless_event_streams")] == 0
    assert found[sample("mapless_live_views")] == 0
    assert found[sample("mapless_lane_waiting", lane="downloads")] == 0


def test_claims_losses_and_reports_are_counted(client: TestClient, services: Services, reports: Reports) -> None:
    run = reports.experiment()["runs"][0]
    claim = {"worker": "w", "published_attempt": 0, "claim_id": "0123456789abcdef" * 2}
    response = client.post(f"/api/worker/runs/{run['id']}/claim", json=claim, headers=bearer(WORKER_TOKEN))
    assert response.status_code == 200, response.text
    link = f"ws://127.0.0.1:8400/api/worker/runs/{run['id']}/link?attempt=1"
    with client.websocket_connect(link, headers=bearer(WORKER_TOKEN)) as worker:
        worker.receive_json()
        worker.send_json({"items": [], "final": {"outcome": "lost", "error": "killed"}})
        assert worker.receive_json()["over"] is True

    found = scraped(client)
    assert found[sample("mapless_claims_total", queue="cpu")] == 1
    assert found[sample("mapless_losses_total")] == 1
    assert found[sample("mapless_ingest_lag_seconds_count")] >= 1


def test_no_client_makes_new_series(client: TestClient) -> None:
    client.get("/api/experiments/none")
    client.get("/nothing/at/all")
    before = {name for name in scraped(client) if "requests" in name[0] or "request" in name[0]}
    for n in range(20):
        client.get(f"/api/experiments/{n}")
        client.get(f"/nothing/{n}")
        client.request(f"METHOD{n}", f"/api/{n}")
        client.get("/api/status", headers={"Host": f"evil{n}.example"})

    found = scraped(client)
    routes = {dict(labels)["route"] for name, labels in found if name == "mapless_request_seconds_count"}
    methods = {dict(labels)["method"] for name, labels in found if name == "mapless_request_seconds_count"}
    assert "/api/experiments/{experiment_id}" in routes
    assert all(not re.search(r"\d", route) for route in routes)
    assert methods <= {"GET", "POST", "other"}
    assert len([name for name in found if "request" in name[0]]) <= len(before) + 5 * 16


def test_the_metrics_token_opens_nothing_else(settings: Settings) -> None:
    given = Settings.model_validate(settings.model_dump() | {"metrics_token": METRICS_TOKEN})
    with TestClient(create_app(given), base_url=BASE_URL) as client:
        assert client.get("/metrics").status_code == 401
        assert client.get("/metrics", headers=bearer("wrong")).status_code == 401
        assert client.get("/metrics", headers=bearer(WORKER_TOKEN)).status_code == 403
        assert client.get("/metrics", headers=bearer(METRICS_TOKEN)).status_code == 200
        assert client.get("/metrics", headers=bearer(TOKEN)).status_code == 200
        assert client.get("/api/status", headers=bearer(METRICS_TOKEN)).status_code == 401
        assert client.get("/api/worker/ping", headers=bearer(METRICS_TOKEN)).status_code == 401


def test_wrong_secrets_are_counted(client: TestClient) -> None:
    for n in range(3):
        client.get("/api/status", headers=bearer(f"wrong{n}"))

    assert scraped(client)[sample("mapless_wrong_secrets_total")] == 3


def test_without_a_database_the_rest_is_told(client: TestClient, services: Services) -> None:
    with socket.create_server(("127.0.0.1", 0)) as nobody:
        port = nobody.getsockname()[1]
    services.database = Database(f"postgresql+psycopg://mapless@127.0.0.1:{port}/mapless")

    found = scraped(client)
    assert found[sample("mapless_database_up")] == 0
    assert sample("mapless_runs", state="queued") not in found
    assert found[sample("mapless_disk_free_bytes")] > 0


def test_sizes_are_those_of_postgresql_too(postgres_url: str, settings: Settings) -> None:
    with TestClient(
        create_app(settings.model_copy(update={"database_url": postgres_url})), base_url=BASE_URL, headers=bearer(TOKEN)
    ) as client:
        assert scraped(client)[sample("mapless_database_bytes")] > 1_000_000


# -- alerts ---------------------------------------------------------------------------------------------------------------


def test_alerts_ask_for_what_is_told(client: TestClient, reports: Reports) -> None:
    reports.experiment()
    told = {name for name, _ in scraped(client)}
    rules = [rule for group in yaml.safe_load(ALERTS.read_text())["groups"] for rule in group["rules"]]
    asked = {name for rule in rules for name in re.findall(r"mapless_\w+", rule["expr"])}

    assert len(asked) >= 9
    assert asked <= told
    assert all(rule["annotations"]["summary"] and rule["labels"]["severity"] for rule in rules)


def test_promtool_reads_the_alerts_and_they_fire_when_they_should(tmp_path: Path) -> None:
    require_program("promtool")
    subprocess.run(["promtool", "check", "rules", str(ALERTS)], check=True, capture_output=True)
    cases = {
        "MaplessQueueStuck": (
            {'mapless_queue_wait_seconds{queue="gpu"}': "700", 'mapless_workers{queue="gpu"}': "0"},
            "gpu",
        ),
        "MaplessDiskLow": ({"mapless_disk_free_bytes": "1000000000"}, None),
        "MaplessDatabaseDown": ({"mapless_database_up": "0"}, None),
    }
    tests = []
    for alert, (series, queue) in cases.items():
        for fires in (True, False):
            values = {name: value if fires else "1e12" if "disk" in name else "1" for name, value in series.items()}
            rule = next(r for g in yaml.safe_load(ALERTS.read_text())["groups"] for r in g["rules"] if r["alert"] == alert)
            summary = rule["annotations"]["summary"].replace("{{ $labels.queue }}", queue or "")
            labels = rule["labels"] | ({"queue": queue} if queue else {})
            tests.append(
                {
                    "interval": "1m",
                    "input_series": [{"series": name, "values": f"{value}x20"} for name, value in values.items()],
                    "alert_rule_test": [
                        {
                            "eval_time": "15m",
                            "alertname": alert,
                            "exp_alerts": [{"exp_labels": labels, "exp_annotations": {"summary": summary}}] if fires else [],
                        }
                    ],
                }
            )
    file = tmp_path / "tests.yml"
    file.write_text(yaml.safe_dump({"rule_files": [str(ALERTS)], "evaluation_interval": "1m", "tests": tests}))
    result = subprocess.run(["promtool", "test", "rules", str(file)], capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr


# -- Prometheus itself ----------------------------------------------------------------------------------------------------


@contextmanager
def prometheus(directory: Path, target: str) -> Iterator[httpx.Client]:
    """Prometheus as docs/monitoring.md sets it up, scraping every second."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    (directory / "token").write_text(METRICS_TOKEN)
    config = {
        "global": {"scrape_interval": "1s", "evaluation_interval": "1s"},
        "rule_files": [str(ALERTS)],
        "scrape_configs": [
            {
                "job_name": "mapless",
                "authorization": {"credentials_file": str(directory / "token")},
                "static_configs": [{"targets": [target]}],
            }
        ],
    }
    (directory / "prometheus.yml").write_text(yaml.safe_dump(config))
    subprocess.run(["promtool", "check", "config", str(directory / "prometheus.yml")], check=True, capture_output=True)
    command = ["prometheus", f"--config.file={directory / 'prometheus.yml'}", f"--storage.tsdb.path={directory / 'tsdb'}"]
    with subprocess.Popen([*command, f"--web.listen-address=127.0.0.1:{port}"], stderr=subprocess.DEVNULL) as process:
        try:
            with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=10) as client:
                yield client
        finally:
            process.terminate()


def test_a_real_prometheus_scrapes_the_service(tmp_path: Path) -> None:
    require_program("prometheus")
    with (
        serving(tmp_path / "data", MAPLESS_METRICS_TOKEN=METRICS_TOKEN) as (_, url),
        prometheus(tmp_path, httpx.URL(url).netloc.decode()) as asked,
    ):
        base, _, token = url.partition("/?token=")
        httpx.post(f"{base}/api/experiments", json={"seeds": [0, 1]}, headers=bearer(token)).raise_for_status()

        def query(expression: str) -> str | None:
            try:
                result = asked.get("/api/v1/query", params={"query": expression}).json()["data"]["result"]
            except httpx.TransportError:
                return None
            return str(result[0]["value"][1]) if result else None

        deadline = time.monotonic() + 60
        while query('mapless_runs{state="queued"}') != "2":
            assert time.monotonic() < deadline, asked.get("/api/v1/targets").text
            time.sleep(0.3)
        assert query('up{job="mapless"}') == "1"
        assert query('mapless_queue_depth{queue="cpu"}') == "2"
        groups = asked.get("/api/v1/rules").json()["data"]["groups"]
        assert {rule["health"] for group in groups for rule in group["rules"]} <= {"ok", "unknown"}
