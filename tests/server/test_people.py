"""People: invited by a link, signed in with a password, kept to their projects, and out again at once."""

import re
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient
from typer.testing import CliRunner

from server.app import create_app
from server.cli import app as command_line
from server.database import tables
from server.people import passwords
from server.people.passwords import hash_password
from server.people.secret import hash_of
from server.security.principal import Principal
from server.settings import Settings
from tests.server.harness import BASE_URL, TOKEN, WORKER_TOKEN
from tests.server.people import Lab, launch

PASSWORD = "correct horse battery"
OWNER = {"Authorization": f"Bearer {TOKEN}"}


@pytest.fixture
def app(settings: Settings, database_url: str) -> FastAPI:
    """On SQLite and on PostgreSQL."""
    return create_app(settings.model_copy(update={"database_url": database_url}))


@pytest.fixture
def browser(app: FastAPI) -> Iterator[TestClient]:
    """In which nobody is signed in."""
    with TestClient(app, base_url=BASE_URL) as client:
        yield client


@pytest.fixture
def lab(app: FastAPI) -> Lab:
    return Lab(app.state.services)


def invite(client: TestClient, **invitation: object) -> str:
    """The code of a new invitation."""
    response = client.post("/api/invitations", json=invitation, headers=OWNER)
    assert response.status_code == 201, response.text
    path: str = response.json()["path"]
    return path.removeprefix("/join#")


def join(client: TestClient, code: str, name: str = "ada") -> int:
    body = {"code": code, "name": name, "password": PASSWORD}
    status: int = client.post("/api/invitations/accept", json=body).status_code
    return status


def test_a_link_lets_somebody_join_a_project_once(browser: TestClient, lab: Lab) -> None:
    halls, streets = lab.project("Halls"), lab.project("Streets")
    launch(browser, streets, "Theirs", **OWNER)
    assert browser.get("/api/sign-in").json()["people"] is False
    code = invite(browser, project_id=halls, role="editor", note="for Ada")

    view = browser.post("/api/invitations/look", json={"code": code}).json()
    assert (view["purpose"], view["project"], view["role"], view["invited_by"]) == ("join", "Halls", "editor", "owner")
    assert join(browser, code) == 204
    account = browser.get("/api/account").json()
    assert (account["name"], account["kind"], account["administrates"], account["may_launch"]) == (
        "ada",
        "person",
        False,
        True,
    )
    assert [each["name"] for each in browser.get("/api/projects").json()["items"]] == ["Halls"]
    assert browser.get("/api/experiments").json()["total"] == 0

    assert browser.post("/api/invitations/look", json={"code": code}).status_code == 404
    assert join(browser, code, "eve") == 404
    assert browser.get("/api/sign-in").json()["people"] is True


def test_links_end_and_are_withdrawn(browser: TestClient, lab: Lab) -> None:
    ended, withdrawn = invite(browser, project_id=lab.project("Halls")), invite(browser, admin=True)
    with lab.services.database.write() as session:
        session.query(tables.Invitation).filter_by(hash=hash_of(ended)).update({"expires_at": time.time() - 1})
    (left,) = browser.get("/api/invitations", headers=OWNER).json()
    assert browser.delete(f"/api/invitations/{left['id']}", headers=OWNER).status_code == 204

    assert (join(browser, ended), join(browser, withdrawn)) == (404, 404)


def test_one_project_may_not_invite_to_another_or_make_administrators(browser: TestClient, lab: Lab) -> None:
    halls, streets = lab.project("Halls"), lab.project("Streets")
    admin = lab.browser(lab.person("ada", {halls: "admin"}))

    def status(**invitation: object) -> int:
        answered: int = browser.post("/api/invitations", json=invitation, headers=admin).status_code
        return answered

    assert status(project_id=halls, role="admin") == 201
    assert (status(project_id=streets), status(project_id=halls, admin=True), status()) == (404, 403, 403)
    invite(browser, project_id=streets)
    assert [each["project"] for each in browser.get("/api/invitations", headers=admin).json()] == ["Halls"]


def test_signing_in_and_out(browser: TestClient, lab: Lab) -> None:
    lab.person("ada", password_hash=hash_password(PASSWORD))

    def sign_in(name: str, password: str) -> tuple[int, str]:
        response = browser.post("/api/sign-in", json={"name": name, "password": password})
        return response.status_code, response.text

    wrong, unknown = sign_in("ada", "wrong"), sign_in("nobody", PASSWORD)
    assert wrong == unknown
    assert wrong[0] == 401
    assert sign_in(" Ada ", PASSWORD)[0] == 204
    (cookie,) = browser.cookies.jar
    assert cookie.has_nonstandard_attr("HttpOnly")
    assert cookie.get_nonstandard_attr("SameSite") == "strict"
    kept = dict(browser.cookies)
    assert browser.post("/api/sign-out").status_code == 204
    browser.cookies.clear()
    browser.cookies.update(kept)
    assert browser.get("/api/account").status_code == 401, "the secret ends with the session, not with the cookie"


def test_ten_wrong_passwords_and_no_more(browser: TestClient, lab: Lab) -> None:
    lab.services.login_limiter._pause = 0.01
    answers = [browser.post("/api/sign-in", json={"name": "ada", "password": f"wrong{n}"}).status_code for n in range(12)]
    assert answers == [401] * 10 + [429] * 2


def test_only_hashes_are_kept(browser: TestClient, lab: Lab) -> None:
    code = invite(browser, admin=True)
    assert join(browser, code) == 204
    secrets = [code, browser.cookies["mapless-session-8400"]]
    secrets.append(browser.post("/api/account/tokens", json={"name": "t", "scope": "read"}).json()["token"])
    secrets.append(browser.post("/api/worker-tokens", json={"name": "w"}).json()["token"])
    with lab.services.database.read() as session:
        names = ("users", "invitations", "sessions", "api_tokens", "worker_tokens", "audit_entries")
        kept = repr([session.execute(tables.Base.metadata.tables[name].select()).all() for name in names])

    assert "$argon2id$" in kept
    assert not [secret for secret in [*secrets, PASSWORD] if secret in kept]


def test_a_new_password_signs_every_other_browser_out(browser: TestClient, lab: Lab) -> None:
    ada = lab.person("ada", password_hash=hash_password(PASSWORD))
    here, there = lab.browser(ada), lab.browser(ada)
    change = {"old": PASSWORD, "new": "another, longer one"}

    assert browser.put("/api/account/password", json=change | {"old": "x"}, headers=here).status_code == 409
    assert browser.put("/api/account/password", json=change, headers=here).status_code == 204
    assert (
        browser.get("/api/account", headers=here).status_code,
        browser.get("/api/account", headers=there).status_code,
    ) == (
        200,
        401,
    )


def test_a_link_sets_a_forgotten_password(browser: TestClient, lab: Lab) -> None:
    ada = lab.person("ada", password_hash=hash_password("forgotten"))
    before = lab.browser(ada)
    path = browser.post(f"/api/people/{ada}/password-link", headers=OWNER).json()["path"]
    code = path.removeprefix("/join#")

    assert browser.post("/api/invitations/look", json={"code": code}).json()["name"] == "ada"
    assert browser.post("/api/invitations/accept", json={"code": code, "password": PASSWORD}).status_code == 204
    assert browser.get("/api/account").json()["name"] == "ada"
    assert browser.get("/api/account", headers=before).status_code == 401


def test_browsers_are_listed_and_signed_out_one_by_one(browser: TestClient, lab: Lab) -> None:
    ada = lab.person("ada")
    here, there = lab.browser(ada), lab.browser(ada)
    listed = browser.get("/api/account/sessions", headers=here).json()
    assert [each["current"] for each in listed].count(True) == 1
    (other,) = [each["id"] for each in listed if not each["current"]]

    eve = lab.browser(lab.person("eve"))
    assert browser.delete(f"/api/account/sessions/{other}", headers=eve).status_code == 404
    assert browser.delete(f"/api/account/sessions/{other}", headers=here).status_code == 204
    assert browser.get("/api/account", headers=there).status_code == 401
    assert browser.get("/api/account", headers=here).status_code == 200


def test_a_sessions_secret_changes_daily_and_the_old_one_ends(browser: TestClient, lab: Lab) -> None:
    old = lab.browser(lab.person("ada"))
    rows = tables.LoginSession
    with lab.services.database.write() as session:
        session.query(rows).update({"rotated_at": time.time() - 25 * 3600})
    response = browser.get("/api/account", headers=old)
    new = {"Cookie": response.headers["set-cookie"].partition(";")[0]}
    browser.cookies.clear()

    assert new != old
    # Requests that were under way bring the old one for two minutes more.
    assert browser.get("/api/account", headers=old).status_code == 200
    assert browser.get("/api/account", headers=new).status_code == 200
    with lab.services.database.write() as session:
        session.query(rows).update({"rotated_at": time.time() - 200})
    lab.services.gate.changed()
    assert browser.get("/api/account", headers=old).status_code == 401
    assert browser.get("/api/account", headers=new).status_code == 200


def test_who_is_closed_out_is_out_at_once(browser: TestClient, lab: Lab) -> None:
    halls = lab.project("Halls")
    ada, _ = lab.person("ada", {halls: "editor"}), lab.person("root", admin=True)
    signed_in, program = lab.browser(ada), lab.token(ada, "launch")
    assert browser.get("/api/account", headers=program).status_code == 200

    assert browser.patch(f"/api/people/{ada}", json={"disabled": True}, headers=OWNER).status_code == 200
    assert browser.get("/api/account", headers=signed_in).status_code == 401
    assert browser.get("/api/account", headers=program).status_code == 401
    assert browser.patch(f"/api/people/{ada}", json={"disabled": False}, headers=OWNER).status_code == 200
    assert browser.get("/api/account", headers=signed_in).status_code == 401
    assert browser.get("/api/account", headers=program).status_code == 200


def test_the_last_administrator_stays_one(browser: TestClient, lab: Lab) -> None:
    root = lab.person("root", admin=True)
    for patch in ({"admin": False}, {"disabled": True}):
        refused = browser.patch(f"/api/people/{root}", json=patch, headers=OWNER)
        assert (refused.status_code, "Nobody would be left" in refused.json()["detail"]) == (409, True)


def test_a_role_that_changes_holds_at_once(browser: TestClient, lab: Lab) -> None:
    halls = lab.project("Halls")
    ada = lab.person("ada", {halls: "editor"})
    signed_in = lab.browser(ada)
    experiment = launch(browser, halls, **signed_in)
    path = f"/api/projects/{halls}/members/{ada}"

    assert browser.put(path, json={"role": "viewer"}, headers=OWNER).json()["role"] == "viewer"
    assert browser.post(f"/api/experiments/{experiment['id']}/stop", headers=signed_in).status_code == 403
    assert browser.get(f"/api/experiments/{experiment['id']}", headers=signed_in).status_code == 200
    assert browser.delete(path, headers=OWNER).status_code == 204
    assert browser.get(f"/api/experiments/{experiment['id']}", headers=signed_in).status_code == 404
    assert browser.put(path, json={"role": "viewer"}, headers=OWNER).status_code == 404


def test_tokens_are_shown_once_used_and_revoked(browser: TestClient, lab: Lab) -> None:
    halls, streets = lab.project("Halls"), lab.project("Streets")
    ada = lab.person("ada", {halls: "editor", streets: "editor"})
    signed_in = lab.browser(ada)
    request = {"name": "notebook", "scope": "launch", "projects": [halls], "days": 30}
    made = browser.post("/api/account/tokens", json=request, headers=signed_in).json()
    program = {"Authorization": f"Bearer {made['token']}"}

    assert [each["name"] for each in browser.get("/api/projects", headers=program).json()["items"]] == ["Halls"]
    launch(browser, halls, **program)
    assert browser.post("/api/experiments", json={"project_id": streets}, headers=program).status_code == 404
    (listed,) = browser.get("/api/account/tokens", headers=signed_in).json()
    assert "token" not in listed
    assert listed["seen_at"] == pytest.approx(time.time(), abs=60)
    assert listed["expires_at"] == pytest.approx(time.time() + 30 * 24 * 3600, abs=60)

    assert browser.delete(f"/api/account/tokens/{made['id']}", headers=signed_in).status_code == 204
    assert browser.get("/api/projects", headers=program).status_code == 401
    assert browser.get("/api/account/tokens", headers=signed_in).json() == []


def test_last_used_costs_no_write_a_request(browser: TestClient, lab: Lab) -> None:
    program = lab.token(lab.person("ada"), "read")
    assert browser.get("/api/account", headers=program).status_code == 200
    writes = 0
    real = lab.services.database.write

    def counted():  # type: ignore[no-untyped-def]
        nonlocal writes
        writes += 1
        return real()

    lab.services.database.write = counted  # type: ignore[method-assign]
    for _ in range(20):
        lab.services.gate.changed()
        assert browser.get("/api/account", headers=program).status_code == 200
    assert writes == 0


def test_a_moved_experiment_needs_both_projects(browser: TestClient, lab: Lab) -> None:
    halls, streets, parks = (lab.project(name) for name in ("Halls", "Streets", "Parks"))
    ada = lab.browser(lab.person("ada", {halls: "editor", streets: "viewer"}))
    experiment = launch(browser, halls, **ada)
    answers = [
        browser.patch(f"/api/experiments/{experiment['id']}", json={"project_id": each}, headers=ada).status_code
        for each in (halls, streets, parks)
    ]
    assert answers == [200, 403, 404]


def test_a_workers_token_reaches_only_what_was_claimed_with_it(browser: TestClient, lab: Lab) -> None:
    run = launch(browser, lab.project("Halls"), **OWNER)["runs"][0]["id"]
    mine, other = lab.worker_token("gpu-box"), lab.worker_token("laptop")
    shared = {"Authorization": f"Bearer {WORKER_TOKEN}"}
    claim = {"worker": "cpu@gpu-box", "queue": "cpu", "published_attempt": 0, "claim_id": "0" * 32}
    assert browser.post(f"/api/worker/runs/{run}/claim", json=claim, headers=mine).status_code == 200
    events = browser.get(f"/api/runs/{run}/events", headers=OWNER).json()
    assert "Claimed with the token gpu-box." in [event["message"] for event in events]

    upload = f"/api/worker/runs/{run}/checkpoints/1?attempt=1"
    body = b'{"sha256": "' + b"0" * 64 + b'", "after_seq": 0}\nx'
    for foreign in (other, shared):
        assert browser.post(f"/api/worker/runs/{run}/claim", json=claim, headers=foreign).status_code == 409
        refused = browser.put(upload, content=body, headers=foreign)
        assert (refused.status_code, "another token" in refused.json()["detail"]) == (409, True)
    assert "another token" not in browser.put(upload, content=body, headers=mine).text

    (listed,) = [each for each in browser.get("/api/worker-tokens", headers=OWNER).json() if each["name"] == "gpu-box"]
    assert browser.delete(f"/api/worker-tokens/{listed['id']}", headers=OWNER).status_code == 204
    assert browser.put(upload, content=body, headers=mine).status_code == 401


def test_the_log_says_who_did_what_from_where(browser: TestClient, lab: Lab) -> None:
    halls = lab.project("Halls")
    ada = lab.browser(lab.person("ada", {halls: "admin"}))
    experiment = launch(browser, halls, "=1+1", **ada)
    browser.post(f"/api/experiments/{experiment['id']}/stop", headers=ada)
    browser.delete(f"/api/experiments/{experiment['id']}", headers=OWNER)

    def log(**wanted: str) -> list[tuple[str, str, str]]:
        page = browser.get("/api/audit", params=wanted, headers=OWNER).json()
        assert page["total"] == len(page["items"])
        return [(each["actor"], each["action"], each["name"]) for each in page["items"]]

    assert log(target=experiment["id"]) == [
        ("owner", "experiment.deleted", "=1+1"),
        ("ada", "experiment.stopped", "=1+1"),
        ("ada", "experiment.launched", "=1+1"),
    ]
    assert log(action="experiment", actor="ada", project=halls)[0][1] == "experiment.stopped"
    assert log(action="person") == [("ada", "person.signed_in", "ada")]
    assert log(until="1.0") == []
    entry = browser.get("/api/audit", params={"action": "experiment.launched"}, headers=OWNER).json()["items"][0]
    assert (entry["address"], entry["project_id"], entry["details"]) == ("testclient", halls, "1 runs")

    lines = browser.get("/api/audit/csv", params={"action": "experiment"}, headers=OWNER).text.splitlines()
    assert lines[0].startswith("id,at,actor,address,action,")
    assert len(lines) == 4
    # A spreadsheet would take it for a formula.
    assert "'=1+1" in lines[1]


def test_entries_of_the_log_are_never_changed(browser: TestClient, lab: Lab) -> None:
    launch(browser, lab.project("Halls"), **OWNER)
    for change in ("UPDATE audit_entries SET actor = 'nobody'", "DELETE FROM audit_entries"):
        with pytest.raises(Exception, match="audit entries are never changed"), lab.services.database.write() as session:
            session.connection().exec_driver_sql(change)


def test_a_deed_that_fails_is_not_in_the_log(browser: TestClient, lab: Lab) -> None:
    assert browser.post("/api/experiments/nowhere/stop", headers=OWNER).status_code == 404
    assert browser.get("/api/audit", headers=OWNER).json()["total"] == 0


def test_the_command_line_makes_the_first_account(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAPLESS_DATA_DIR", str(tmp_path))
    monkeypatch.setenv("MAPLESS_TOKEN", TOKEN)

    def run(*arguments: str, text: str = "") -> str:
        result = CliRunner().invoke(command_line, ["people", *arguments], input=text)
        return f"{result.exit_code} {result.output}{result.stderr}"

    assert "at least 10 characters" in run("create-admin", "root", text="short\nshort\n")
    assert "root may sign in now" in run("create-admin", "root", text=f"{PASSWORD}\n{PASSWORD}\n")
    assert "1 mapless: There is somebody called root already" in run("create-admin", "root", "--password", PASSWORD)
    assert "There is no project called Halls" in run("invite", "--project", "Halls")
    link = run("invite", "--project", "default", "--role", "editor")
    assert re.fullmatch(r"0 http://127.0.0.1:8400/join#[0-9a-f]{48}\n", link)
    assert "/join#" in run("password-link", "root")
    assert run("list") == "0 root, administrator\n"
    with TestClient(create_app(Settings()), base_url=BASE_URL) as client:
        assert client.post("/api/sign-in", json={"name": "root", "password": PASSWORD}).status_code == 204
        assert join(TestClient(client.app, base_url=BASE_URL), link.strip().partition("#")[2]) == 204


def test_a_password_is_hashed_for_who_does_not_exist_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise the time of a refusal would tell names."""
    hashed = []
    real = passwords._hasher.verify

    class Counting:
        def verify(self, kept: str, password: str) -> bool:
            hashed.append(kept)
            return real(kept, password)

    kept = hash_password(PASSWORD)
    monkeypatch.setattr(passwords, "_hasher", Counting())
    assert passwords.is_password(PASSWORD, kept)
    assert not passwords.is_password("nobody's password", None)
    assert not passwords.is_password("wrong", kept)
    assert len(hashed) == 3
    # As much work: the same kind, memory, passes and lanes.
    assert hashed[1].split("$")[1:4] == kept.split("$")[1:4]


def test_an_open_stream_ends_with_its_rights(browser: TestClient, lab: Lab) -> None:
    halls = lab.project("Halls")
    ada, eve = lab.person("ada", {halls: "viewer"}), lab.person("eve", {halls: "viewer"})
    gate = lab.services.gate

    def principal(headers: dict[str, str]) -> Principal:
        found, _ = portal.call(partial(gate.browser, headers["Cookie"].partition("=")[2], may_rotate=False))
        assert found is not None
        return found

    assert browser.portal is not None
    portal = browser.portal
    ended = portal.start_task_soon(gate.until_changed, principal(lab.browser(ada)))
    goes_on = portal.start_task_soon(gate.until_changed, principal(lab.browser(eve)))
    assert browser.delete(f"/api/projects/{halls}/members/{ada}", headers=OWNER).status_code == 204
    ended.result(10.0)
    assert not goes_on.done()
    goes_on.cancel()
