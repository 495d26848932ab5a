"""Alerts: noticed once, said in the words of the diagnoses, sent once to where somebody wants them."""

import asyncio
import hashlib
import hmac
import ipaddress
import json
import time
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from fastapi.testclient import TestClient

from server.alerts import sending
from server.alerts.addresses import RefusedAddressError, check_url, is_public, look_up
from server.alerts.messages import Letter, body
from server.alerts.repository import AlertRepository
from server.alerts.sending import BACK_OFF, AlertSender
from server.alerts.watcher import AT_MOST, AlertWatcher
from server.app import create_app, create_services
from server.database import tables
from server.metrics.repository import MetricRepository, ReportedRow
from server.services import Services
from server.settings import Settings
from tests.server.harness import BASE_URL, TOKEN, Reports
from tests.server.people import Lab, launch
from tests.server.receivers import HttpReceiver, SmtpReceiver, listening

GIB = 2**30
DOCUMENTED = Path(__file__).parents[2] / "docs" / "alerts.md"


@pytest.fixture
def settings(settings: Settings) -> Settings:
    return Settings.model_validate(
        settings.model_dump(exclude_unset=True)
        | {
            "alerts_private_addresses": True,
            "public_url": "https://lab.example/",
            "smtp_host": "127.0.0.1",
            "smtp_security": "none",
        }
    )


@pytest.fixture
def client(settings: Settings, monkeypatch: pytest.MonkeyPatch) -> Iterator[TestClient]:
    """The service, whose own looks and deliveries stand still: the tests make theirs."""
    monkeypatch.setattr(sending, "_WATCH_SECONDS", 3600.0)
    monkeypatch.setattr(sending, "_SEND_SECONDS", 3600.0)
    with TestClient(create_app(settings), base_url=BASE_URL, headers={"Authorization": f"Bearer {TOKEN}"}) as client:
        yield client


@pytest.fixture
def services(client: TestClient) -> Services:
    services: Services = client.app.state.services  # type: ignore[attr-defined]
    return services


@pytest.fixture
def reports(client: TestClient, services: Services) -> Reports:
    return Reports(client, services)


class Clock:
    def __init__(self) -> None:
        self.now = time.time()

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def watcher(services: Services, clock: Clock) -> AlertWatcher:
    return AlertWatcher(services, clock, lambda: 5 * GIB)


def rule(client: TestClient, event: str, **more: Any) -> dict[str, Any]:
    response = client.post("/api/alerts/rules", json={"event": event, "channel": "browser"} | more)
    assert response.status_code == 201, response.text
    made: dict[str, Any] = response.json()
    return made


def alerts(client: TestClient, **headers: str) -> list[dict[str, Any]]:
    items: list[dict[str, Any]] = client.get("/api/alerts", headers=headers).json()["items"]
    return items


def ends(reports: Reports, run: dict[str, Any], state: Any = "completed", **columns: Any) -> None:
    reports.state(run, state, finished_at=time.time(), attempt=1, **columns)


def curves(services: Services, run: dict[str, Any], **series: list[float]) -> None:
    """A point every 100 steps of 10,000; '__' stands for '/'."""
    rows = [
        ReportedRow(i + 1, 100 * (i + 1), 1.0, {name.replace("__", "/"): values[i] for name, values in series.items()})
        for i in range(len(next(iter(series.values()))))
    ]
    with services.database.write() as session:
        MetricRepository(session).append({run["id"]: rows})
        session.get_one(tables.Run, run["id"]).step = rows[-1].step


# --- what is noticed ----------------------------------------------------------------------------------------------------


def test_a_training_that_has_ended_is_told_once_when_all_its_runs_have(
    client: TestClient, reports: Reports, watcher: AlertWatcher, services: Services
) -> None:
    rule(client, "ended")
    first, second = reports.experiment("Corridor", seeds=(0, 1))["runs"]
    ends(reports, first, final_arrivals=186, final_episodes=200, final_suite="simple-200")
    assert watcher.look() == 0

    ends(reports, second, "stopped")
    assert (watcher.look(), watcher.look()) == (1, 0)
    # Another server, and one that has just started, look at the same.
    assert AlertWatcher(services).look() == 0

    (alert,) = alerts(client)
    assert alert["title"] == "Corridor has ended"
    assert alert["text"] == "Of 2 runs: 1 completed, 1 stopped. Success: 93.0\u202f%."
    assert (alert["state"], alert["channel"]) == ("sent", "browser")

    # Resumed, it ends once more.
    reports.state(second, "completed", finished_at=time.time(), attempt=2)
    assert watcher.look() == 1


def test_a_failed_run_is_told_with_its_error_and_its_diagnoses(
    client: TestClient, reports: Reports, watcher: AlertWatcher, services: Services
) -> None:
    rule(client, "failed")
    run = reports.experiment("Corridor", seeds=(7,), steps=10_000)["runs"][0]
    curves(services, run, policy__kl=[0.3] * 40, train__success_rate=[0.0] * 40)
    ends(reports, run, "failed", error="RuntimeError: out of memory")

    assert watcher.look() == 1

    (alert,) = alerts(client)
    assert alert["title"] == "Corridor, seed 7, has failed"
    assert alert["text"].startswith(
        "At step 4\u202f000: RuntimeError: out of memory Its curves say: KL divergence exploded."
    )
    assert "To try first: Lower the learning rate" in alert["text"]
    assert alert["text"].endswith("Also: Success is stuck.")
    assert alert["run_id"] == run["id"]


def test_each_diagnosis_of_a_run_that_goes_on_is_told_once(
    client: TestClient, reports: Reports, watcher: AlertWatcher, services: Services, clock: Clock
) -> None:
    rule(client, "diagnosis")
    run = reports.experiment("Corridor", steps=10_000)["runs"][0]
    reports.state(run, "running", attempt=1)
    curves(services, run, policy__kl=[0.3] * 40, train__success_rate=[0.0] * 40)

    assert watcher.look() == 2
    assert {alert["title"] for alert in alerts(client)} == {
        "Corridor, seed 0: KL divergence exploded",
        "Corridor, seed 0: Success is stuck",
    }
    reports.state(run, "running", step=5_000)
    clock.now += 61.0
    assert watcher.look() == 0


def test_success_is_told_when_an_evaluation_reaches_it(client: TestClient, reports: Reports, watcher: AlertWatcher) -> None:
    rule(client, "success", threshold=0.9)
    run = reports.experiment("Corridor")["runs"][0]
    final = {"final_suite": "simple-200", "final_episodes": 200, "final_step": 30_000}
    reports.state(run, "running", attempt=1, final_arrivals=179, **final)
    assert watcher.look() == 0

    reports.state(run, "running", final_arrivals=180, **final)
    assert watcher.look() == 1
    reports.state(run, "running", final_arrivals=199, **final)
    assert watcher.look() == 0
    assert (
        alerts(client)[0]["text"] == "180 of 200 episodes on simple-200 arrive at step 30\u202f000: at or above 90.0\u202f%."
    )


def test_waiting_too_long_and_a_full_disk_are_told_once_a_day(
    client: TestClient, reports: Reports, watcher: AlertWatcher, clock: Clock
) -> None:
    rule(client, "stuck", threshold=30)
    rule(client, "disk", threshold=6)
    rule(client, "disk", threshold=5)
    runs = reports.experiment("Corridor", seeds=(0, 1, 2))["runs"]
    clock.now = (clock.now // 86_400 + 1) * 86_400
    for run, minutes in zip(runs, (45, 31, 29), strict=True):
        reports.state(run, "queued", queued_at=clock.now - 60 * minutes)

    assert watcher.look() == 2
    assert {alert["title"]: alert["text"][:45] for alert in alerts(client)} == {
        "Corridor waits in the queue": "2 runs wait, for 45 minutes by now. The page ",
        "5.0 GiB are left on the server's disk": "Checkpoints will soon be refused. Delete trai",
    }
    clock.now += 86_399
    assert watcher.look() == 0
    clock.now += 1
    assert watcher.look() == 2


def test_trials_of_studies_and_what_lies_in_the_trash_are_nobodys_news(
    client: TestClient, reports: Reports, watcher: AlertWatcher, services: Services
) -> None:
    rule(client, "ended")
    trial, deleted = reports.experiment("Trial"), reports.experiment("Deleted")
    with services.database.write() as session:
        session.add(tables.Study(id="study", project_id="default", name="S", spec={}, budget=1))
        session.flush()
        session.get_one(tables.Experiment, trial["id"]).study_id = "study"
        session.get_one(tables.Experiment, deleted["id"]).deleted_at = 1.0
    ends(reports, trial["runs"][0])
    ends(reports, deleted["runs"][0])
    assert watcher.look() == 0


def test_what_ended_before_a_rule_was_made_is_not_its_news(
    client: TestClient, reports: Reports, watcher: AlertWatcher
) -> None:
    run = reports.experiment("Corridor")["runs"][0]
    reports.state(run, "failed", finished_at=time.time() - 1.0, attempt=1)
    rule(client, "failed")
    assert watcher.look() == 0


def test_a_rule_with_too_much_to_say_says_so(client: TestClient, reports: Reports, watcher: AlertWatcher) -> None:
    rule(client, "failed")
    for run in reports.experiment("Corridor", seeds=range(AT_MOST + 2))["runs"]:
        ends(reports, run, "failed")
    assert watcher.look() == AT_MOST + 2

    states = [alert["state"] for alert in alerts(client)]
    assert states.count("sent") == AT_MOST
    assert states.count("withheld") == 2


# --- whose rules they are -----------------------------------------------------------------------------------------------


def test_people_hear_of_their_own_projects_alone(client: TestClient, services: Services, reports: Reports) -> None:
    lab = Lab(services)
    here, elsewhere = lab.project("Here"), lab.project("Elsewhere")
    ada, bob = lab.person("ada", {here: "viewer"}), lab.person("bob", {here: "viewer", elsewhere: "editor"})
    browsers = {name: lab.browser(user) for name, user in (("ada", ada), ("bob", bob))}
    for headers in browsers.values():
        client.headers.pop("Authorization", None)
        made = client.post("/api/alerts/rules", json={"event": "ended", "channel": "browser"}, headers=headers)
        assert made.status_code == 201
    hidden = {"event": "ended", "channel": "browser", "project_id": elsewhere}
    assert client.post("/api/alerts/rules", json=hidden, headers=browsers["ada"]).status_code == 404
    disk = {"event": "disk", "channel": "browser", "threshold": 1.0}
    assert client.post("/api/alerts/rules", json=disk, headers=browsers["ada"]).status_code == 403
    client.headers["Authorization"] = f"Bearer {TOKEN}"
    for project in (here, elsewhere):
        ends(reports, launch(client, project, name=f"In {project}")["runs"][0])

    assert AlertWatcher(services).look() == 3

    del client.headers["Authorization"]
    assert [alert["title"] for alert in alerts(client, **browsers["ada"])] == [f"In {here} has ended"]
    assert len(alerts(client, **browsers["bob"])) == 2
    (mine,) = client.get("/api/alerts/rules", headers=browsers["ada"]).json()["items"]
    assert client.delete(f"/api/alerts/rules/{mine['id']}", headers=browsers["bob"]).status_code == 404
    assert client.delete(f"/api/alerts/rules/{mine['id']}", headers=browsers["ada"]).status_code == 204
    assert alerts(client, **browsers["ada"]) == []


def test_the_browser_asks_for_what_is_new(client: TestClient, reports: Reports, watcher: AlertWatcher) -> None:
    made = rule(client, "ended")
    rule(client, "ended", channel="webhook", target="http://127.0.0.1:9/")
    assert client.get("/api/alerts/news").json() == {"items": [], "newest": 0}
    ends(reports, reports.experiment("Corridor")["runs"][0])
    watcher.look()
    assert client.post(f"/api/alerts/rules/{made['id']}/test").status_code == 204

    news = client.get("/api/alerts/news?after=0").json()
    assert [alert["title"] for alert in news["items"]] == ["Corridor has ended", "A test of Mapless's alerts"]
    assert client.get(f"/api/alerts/news?after={news['newest']}").json()["items"] == []
    # Who asks for the first time is not told what is long known.
    assert client.get("/api/alerts/news").json() == {"items": [], "newest": news["newest"]}


def test_a_rule_that_makes_no_sense_is_refused(client: TestClient) -> None:
    for wanted, why in (
        ({"event": "success", "channel": "browser"}, "success takes a threshold"),
        ({"event": "success", "channel": "browser", "threshold": 1.5}, "a success rate from 0 to 1"),
        ({"event": "ended", "channel": "browser", "threshold": 1.0}, "ended has no threshold"),
        ({"event": "ended", "channel": "webhook"}, "begins with https:// or http://"),
        ({"event": "ended", "channel": "webhook", "target": "file:///etc/passwd"}, "begins with https:// or http://"),
        ({"event": "ended", "channel": "webhook", "target": "https://a:b@example.org"}, "no user and no password"),
        ({"event": "ended", "channel": "mail", "target": "ada"}, "name@example.org"),
        ({"event": "ended", "channel": "mail", "target": "a@b.c, d@e.f"}, "name@example.org"),
    ):
        response = client.post("/api/alerts/rules", json=wanted)
        assert response.status_code == 422, wanted
        assert why in response.text


def test_mail_goes_to_ones_own_address(client: TestClient, services: Services) -> None:
    lab = Lab(services)
    ada = lab.person("ada", {lab.project("Here"): "viewer"})
    with services.database.write() as session:
        session.get_one(tables.User, ada).email = "ada@lab.example"
    browser = lab.browser(ada)
    del client.headers["Authorization"]
    wanted = {"event": "ended", "channel": "mail", "target": "eve@example.org"}
    refused = client.post("/api/alerts/rules", json=wanted, headers=browser)
    assert "your own address: ada@lab.example" in refused.text
    wanted["target"] = "Ada@lab.example"
    assert client.post("/api/alerts/rules", json=wanted, headers=browser).status_code == 201


# --- how they are sent --------------------------------------------------------------------------------------------------


async def sent(services: Services, clock: Clock, waits: tuple[float, ...] = ()) -> None:
    sender = AlertSender(services, clock)
    clock.now = max(clock.now, time.time())  # what was asked for by HTTP is due by the server's own clock
    for wait in (0.0, *waits):
        clock.now += wait
        await sender.send_due()
        await sender.settled()
    await sender.close()


def on_a_port(receiver: HttpReceiver | SmtpReceiver, work: Callable[[], Awaitable[None]]) -> None:
    async def run() -> None:
        async with listening(receiver):
            await work()

    asyncio.run(run())


def test_a_webhook_is_sent_once_and_signed(
    client: TestClient, services: Services, reports: Reports, watcher: AlertWatcher, clock: Clock
) -> None:
    receiver = HttpReceiver()
    experiment = reports.experiment("Corridor")

    async def work() -> None:
        made = rule(client, "ended", channel="webhook", target=receiver.url("localhost"))
        ends(reports, experiment["runs"][0])
        watcher.look()
        clock.now += 1.0
        # Two servers, each of which sees that it is due.
        await asyncio.gather(sent(services, clock), sent(services, clock))
        await sent(services, clock, (3_600.0,))

        ((path, headers, content),) = receiver.taken
        assert path == "/hook?a=1"
        assert headers["host"] == f"localhost:{receiver.port}"
        stamp, _, mac = headers["mapless-signature"].partition(",v1=")
        at = stamp.removeprefix("t=")
        assert abs(int(at) - time.time()) < 60
        assert mac == hmac.new(made["secret"].encode(), f"{at}.".encode() + content, hashlib.sha256).hexdigest()
        documented: dict[str, Any] = {}
        exec(DOCUMENTED.read_text().split("```python")[1].split("```")[0], documented)
        assert documented["is_genuine"](made["secret"], headers["mapless-signature"], content)
        assert not documented["is_genuine"](made["secret"], headers["mapless-signature"], content + b" ")

    on_a_port(receiver, work)
    (message,) = receiver.said
    assert message["event"] == "ended"
    assert message["title"] == "Corridor has ended"
    assert message["url"] == f"https://lab.example/experiments/{experiment['id']}"
    (alert,) = alerts(client)
    assert (alert["state"], alert["tries"], alert["outcome"]) == ("sent", 1, None)


def test_what_is_not_taken_is_sent_again_later_and_later(client: TestClient, services: Services, clock: Clock) -> None:
    receiver = HttpReceiver(answers=[(503, ""), (429, "Retry-After: 100\r\n"), (200, "")])

    async def work() -> None:
        made = rule(client, "failed", channel="webhook", target=receiver.url())
        client.post(f"/api/alerts/rules/{made['id']}/test")
        clock.now += 1.0
        await sent(services, clock, (BACK_OFF[0] - 1.0,))
        assert len(receiver.taken) == 1
        (alert,) = alerts(client)
        assert (alert["state"], alert["outcome"]) == ("waiting", "Refused with status 503.")
        await sent(services, clock, (1.0, BACK_OFF[1]))
        # The receiver has asked for more time than we would have given it.
        assert len(receiver.taken) == 2
        await sent(services, clock, (40.0,))

    on_a_port(receiver, work)
    assert len(receiver.taken) == 3
    (alert,) = alerts(client)
    assert (alert["state"], alert["tries"]) == ("sent", 3)


def test_a_refusal_for_good_and_a_last_try_end_it(client: TestClient, services: Services, clock: Clock) -> None:
    receiver = HttpReceiver(answers=[(410, "")])

    async def work() -> None:
        made = rule(client, "failed", channel="webhook", target=receiver.url())
        client.post(f"/api/alerts/rules/{made['id']}/test")
        await sent(services, clock, (1.0, 1e5))
        assert len(receiver.taken) == 1
        assert (alerts(client)[0]["state"], alerts(client)[0]["outcome"]) == ("failed", "Refused with status 410.")
        receiver.answers = [(302, "Location: http://127.0.0.1:1/\r\n")]
        other = rule(client, "failed", channel="webhook", target=receiver.url())
        client.post(f"/api/alerts/rules/{other['id']}/test")
        await sent(services, clock, (1.0,))
        assert alerts(client)[0]["outcome"] == "Refused with status 302."
        receiver.answers = [(500, "")]
        third = rule(client, "failed", channel="webhook", target=receiver.url())
        client.post(f"/api/alerts/rules/{third['id']}/test")
        await sent(services, clock, (1.0, *BACK_OFF, 1e5))

    on_a_port(receiver, work)
    assert len(receiver.taken) == 2 + 1 + len(BACK_OFF)
    assert (alerts(client)[0]["state"], alerts(client)[0]["tries"]) == ("failed", 1 + len(BACK_OFF))


def test_a_server_that_ends_between_sending_and_recording_does_not_send_again(
    client: TestClient, services: Services, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    receiver = HttpReceiver()

    async def work() -> None:
        made = rule(client, "failed", channel="webhook", target=receiver.url())
        client.post(f"/api/alerts/rules/{made['id']}/test")
        clock.now += 1.0
        dying = AlertSender(services, clock)

        def dies(*_: object) -> None:
            raise SystemError

        monkeypatch.setattr(dying, "_settle", dies)
        await dying.send_due()
        await dying.settled()
        assert len(receiver.taken) == 1
        assert alerts(client)[0]["state"] == "sending"

        await sent(create_services(services.settings), clock, (30.0, 60.0, 1.0))

    on_a_port(receiver, work)
    assert len(receiver.taken) == 1
    (alert,) = alerts(client)
    assert alert["state"] == "unclear"
    assert "it may have arrived" in alert["outcome"]


def test_a_receiver_that_says_nothing_keeps_no_other_waiting(
    client: TestClient, services: Services, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("server.alerts.channels.SECONDS", 0.5)
    silent, lively = HttpReceiver(silent=True), HttpReceiver()

    async def work() -> None:
        async with listening(lively):
            for receiver in (silent, lively):
                made = rule(client, "failed", channel="webhook", target=receiver.url())
                client.post(f"/api/alerts/rules/{made['id']}/test")
            await sent(services, clock, (1.0,))

    on_a_port(silent, work)
    assert [alert["state"] for alert in alerts(client)] == ["sent", "waiting"]
    assert alerts(client)[1]["outcome"] == "No answer within 0.5 s."


def test_mail_is_sent_and_a_refused_address_told(client: TestClient, services: Services, clock: Clock) -> None:
    receiver = SmtpReceiver()

    async def work() -> None:
        services.settings = services.settings.model_copy(update={"smtp_port": receiver.port})
        for target in ("ada@example.org", "nobody@example.org"):
            made = rule(client, "failed", channel="mail", target=target)
            client.post(f"/api/alerts/rules/{made['id']}/test")
        await sent(services, clock, (1.0,))

    on_a_port(receiver, work)
    (mail,) = receiver.taken
    assert (mail["To"], mail["Subject"]) == ("ada@example.org", "A test of Mapless's alerts")
    assert "https://lab.example/alerts" in str(mail.get_payload())
    refused, taken = alerts(client)
    assert (taken["state"], refused["state"]) == ("sent", "failed")
    assert "nobody of that name" in refused["outcome"]


def test_a_test_is_not_to_be_had_twice_at_once(client: TestClient) -> None:
    made = rule(client, "ended")
    answers = [client.post(f"/api/alerts/rules/{made['id']}/test").status_code for _ in range(3)]
    assert answers.count(409) >= 1
    assert answers[0] == 204


def letter() -> Letter:
    return Letter(1, "failed", 0.0, "<A> & B", "x" * 3_000, "https://lab.example/runs/r", "p", "e", "r")


def test_every_format_is_what_its_receiver_takes() -> None:
    slack = json.loads(body(letter(), "slack"))["text"]
    assert slack.startswith("*&lt;A&gt; &amp; B*\n")
    assert slack.endswith("<https://lab.example/runs/r|Open in Mapless>")
    discord = json.loads(body(letter(), "discord"))
    assert len(discord["content"]) <= 2_000
    assert discord["allowed_mentions"] == {"parse": []}
    card = json.loads(body(letter(), "teams"))["attachments"][0]
    assert card["contentType"] == "application/vnd.microsoft.card.adaptive"
    assert card["content"]["actions"][0]["url"] == "https://lab.example/runs/r"


# --- where they may go --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("address", "public"),
    [
        ("93.184.216.34", True),
        ("2606:2800:220:1::1", True),
        ("127.0.0.1", False),
        ("10.1.2.3", False),
        ("169.254.169.254", False),
        ("100.64.0.1", False),
        ("0.0.0.0", False),
        ("224.0.0.1", False),
        ("::1", False),
        ("fe80::1", False),
        ("fd00::1", False),
        ("::ffff:127.0.0.1", False),
        # By way of a translator, an IPv4 address in an IPv6 one.
        ("64:ff9b::a00:1", False),
        ("64:ff9b::5db8:d822", True),
        ("2002:a00:1::", False),
    ],
)
def test_what_only_the_server_can_reach_is_not_public(address: str, public: bool) -> None:
    assert is_public(ipaddress.ip_address(address)) is public


def test_a_name_that_leads_inside_is_refused_when_it_is_looked_up() -> None:
    with pytest.raises(RefusedAddressError, match="private network"):
        look_up(check_url("http://localhost:9/"), private=False)
    assert look_up(urlsplit("http://127.0.0.1:9/"), private=True) == "127.0.0.1"


def test_without_leave_nothing_is_sent_inside(client: TestClient, services: Services, clock: Clock) -> None:
    services.settings = services.settings.model_copy(update={"alerts_private_addresses": False})
    wanted = {"event": "ended", "channel": "webhook", "target": "http://169.254.169.254/latest/meta-data"}
    response = client.post("/api/alerts/rules", json=wanted)
    assert response.status_code == 422
    assert "private network" in response.text
    receiver = HttpReceiver()

    async def work() -> None:
        made = rule(client, "ended", channel="webhook", target=receiver.url("localhost"))
        client.post(f"/api/alerts/rules/{made['id']}/test")
        await sent(services, clock, (1.0,))

    on_a_port(receiver, work)
    assert receiver.taken == []
    assert (alerts(client)[0]["state"], alerts(client)[0]["tries"]) == ("failed", 1)


def test_old_alerts_are_forgotten(client: TestClient, services: Services, watcher: AlertWatcher) -> None:
    made = rule(client, "ended")
    client.post(f"/api/alerts/rules/{made['id']}/test")
    with services.database.write() as session:
        AlertRepository(session).forget(time.time() + 1.0)
    assert alerts(client) == []


def test_a_rule_for_a_project_without_a_name_is_refused(client: TestClient) -> None:
    refused = client.post(
        "/api/alerts/rules", json={"event": "success", "channel": "browser", "threshold": 0.9, "project_id": ""}
    )
    assert refused.status_code == 404
