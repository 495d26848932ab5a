"""Signing in with a provider of identities: a certified one as a process of its own, and one that lies."""

import hmac
import time
from base64 import urlsafe_b64encode
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from threading import Thread
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
import uvicorn
from fastapi import FastAPI
from fastapi.testclient import TestClient
from joserfc import jwt
from joserfc.jwk import RSAKey
from pydantic import ValidationError

from server.app import create_app
from server.database import tables
from server.people.oidc.identity import identity_of
from server.people.oidc.journey import begin, seal, unseal
from server.people.passwords import hash_password
from server.security.limits import GuessLimiter
from server.security.secrets import Secrets
from server.settings import Settings
from tests.oidc_provider import CALLBACK, OidcProvider, oidc_provider, settings_for
from tests.server.harness import BASE_URL, TOKEN
from tests.server.people import Lab, launch
from tests.services.stack import free_port

OWNER = {"Authorization": f"Bearer {TOKEN}"}
LAB = "https://mapless.lab.example"
ADA = {"preferred_username": "Ada Lovelace", "email": "Ada@lab.example", "email_verified": True, "groups": ["nav"]}

Serve = Callable[..., TestClient]


@pytest.fixture(scope="module")
def provider(tmp_path_factory: pytest.TempPathFactory) -> Iterator[OidcProvider]:
    with oidc_provider(tmp_path_factory.mktemp("provider"), BASE_URL, LAB) as provider:
        yield provider


@pytest.fixture
def serve(settings: Settings, provider: OidcProvider) -> Iterator[Serve]:
    """A service that sends people to the provider, with these settings more; a browser in which nobody is signed in."""
    with ExitStack() as stack:

        def start(**more: Any) -> TestClient:
            both = settings.model_dump(exclude_unset=True) | {"database_url": more.pop("database_url", None)}
            trust = {name: more.pop(name) for name in ("trusted_proxies", "allowed_hosts") if name in more}
            app = create_app(Settings.model_validate(both | trust | settings_for(provider, **more)))
            return stack.enter_context(TestClient(app, base_url=BASE_URL, follow_redirects=False))

        yield start


def lab_of(browser: TestClient) -> Lab:
    assert isinstance(browser.app, FastAPI)
    return Lab(browser.app.state.services)


def go(browser: TestClient, **wanted: object) -> str:
    """Where the page sends the browser."""
    response = browser.post("/api/sign-in/provider", json=wanted)
    assert response.status_code == 200, response.text
    url: str = response.json()["url"]
    return url


def sign_in(browser: TestClient, provider: OidcProvider, name: str = "ada", **wanted: object) -> str:
    """Where the browser is in the end."""
    back = provider.sign_in(go(browser, **wanted), name)
    # As a browser that comes from another site's page: *strict* cookies stay behind.
    kept = browser.cookies.pop("mapless-session-8400", None)
    response = browser.get(back)
    if kept is not None and "mapless-session-8400" not in browser.cookies:
        browser.cookies.set("mapless-session-8400", kept)
    assert response.status_code == 303, response.text
    return str(response.headers["location"])


def words(browser: TestClient, location: str) -> str:
    """What the page says of a refusal."""
    return str(browser.get("/api/sign-in", params=urlsplit(location).query).json()["refused"])


def test_somebody_new_gets_an_account_and_is_the_same_person_ever_after(
    serve: Serve, provider: OidcProvider, database_url: str
) -> None:
    provider.knows(ada=ADA)
    browser = serve(strangers=True, database_url=database_url)
    assert browser.get("/api/sign-in").json() == {"people": False, "provider": "the university", "refused": None}

    assert sign_in(browser, provider, back="/queue?tab=workers") == "/queue?tab=workers"
    account = browser.get("/api/account").json()
    assert (account["name"], account["email"]) == ("ada-lovelace", "ada@lab.example")
    assert (account["kind"], account["connected"], account["has_password"]) == ("person", True, False)
    assert browser.get("/api/projects").json()["total"] == 0, "an account alone shows nothing"

    assert browser.post("/api/sign-out").status_code == 204
    assert browser.get("/api/account").status_code == 401
    # Renamed at the provider, with another address: it is the subject that counts.
    provider.knows(ada=ADA | {"preferred_username": "countess", "email": "l@else.example"})
    sign_in(browser, provider)
    assert browser.get("/api/account").json()["name"] == "ada-lovelace"
    with lab_of(browser).services.database.read() as session:
        (kept,) = session.query(tables.User).all()
        assert (kept.issuer, kept.subject, kept.email) == (provider.issuer, "ada", "l@else.example")
        log = session.query(tables.AuditEntry).order_by(tables.AuditEntry.id).all()
    assert [(each.actor, each.action) for each in log] == [
        ("ada-lovelace", "person.created"),
        ("ada-lovelace", "person.signed_in"),
        ("ada-lovelace", "person.signed_out"),
        ("ada-lovelace", "person.signed_in"),
    ]


def test_what_the_browser_is_sent_away_with(serve: Serve) -> None:
    browser = serve()
    asked = parse_qs(urlsplit(go(browser)).query)
    assert asked["redirect_uri"] == [BASE_URL + CALLBACK]
    assert (asked["response_type"], asked["code_challenge_method"]) == (["code"], ["S256"])
    assert asked["scope"] == ["openid profile email"]
    assert min(len(asked[name][0]) for name in ("state", "nonce", "code_challenge")) >= 43
    (cookie,) = browser.cookies.jar
    assert cookie.has_nonstandard_attr("HttpOnly")
    assert cookie.get_nonstandard_attr("SameSite") == "lax"
    assert cookie.path == "/api/sign-in/provider"


def test_strangers_need_an_invitation(serve: Serve, provider: OidcProvider) -> None:
    provider.knows(ada=ADA)
    browser = serve()
    refused = sign_in(browser, provider)
    assert refused == "/?refused=stranger"
    assert "you have no account here" in words(browser, refused)
    assert browser.get("/api/account").status_code == 401

    halls = lab_of(browser).project("Halls")
    made = browser.post("/api/invitations", json={"project_id": halls, "role": "editor"}, headers=OWNER).json()
    code = made["path"].removeprefix("/join#")
    assert sign_in(browser, provider, invitation=code) == "/"
    assert [each["role"] for each in browser.get("/api/projects").json()["items"]] == ["editor"]
    assert sign_in(serve(), provider, invitation=code) == "/?refused=link", "it opens once"


def test_an_account_with_a_password_is_connected_by_who_is_signed_in_to_it(serve: Serve, provider: OidcProvider) -> None:
    provider.knows(ada=ADA, eve=ADA | {"email": "eve@lab.example"})
    browser = serve()
    lab = lab_of(browser)
    lab.person("ada", {lab.project("Halls"): "editor"}, password_hash=hash_password("correct horse battery"))
    assert browser.post("/api/sign-in/provider", json={"connect": True}).status_code == 401
    browser.post("/api/sign-in", json={"name": "ada", "password": "correct horse battery"})
    assert sign_in(browser, provider, back="/account", connect=True) == "/account"

    again = serve()
    assert sign_in(again, provider) == "/"
    assert again.get("/api/account").json()["name"] == "ada"
    lab.person("bob", password_hash=hash_password("correct horse battery"))
    other = serve()
    other.post("/api/sign-in", json={"name": "bob", "password": "correct horse battery"})
    refused = sign_in(other, provider, connect=True)
    assert refused == "/account?refused=taken"
    assert other.get("/api/account").json()["name"] == "bob"
    # The same address, or the same name, joins nobody to anything.
    assert sign_in(serve(), provider, "eve") == "/?refused=stranger"


def test_who_is_let_in(serve: Serve, provider: OidcProvider) -> None:
    def end(claims: dict[str, Any], **allowed: Any) -> str:
        asked = browser.app.state.services.provider  # type: ignore[attr-defined]
        asked.settings = replace(settings, **{name: frozenset(value) for name, value in allowed.items()})
        provider.knows(ada=ADA | claims)
        return sign_in(browser, provider)

    browser = serve(strangers=True, scopes="openid email groups")
    settings = browser.app.state.services.provider.settings  # type: ignore[attr-defined]
    assert end({}, domains=["lab.example"]) == "/"
    assert end({}, groups=["nav", "arm"]) == "/"
    refused = "/?refused=not_allowed"
    assert end({"email_verified": False}, domains=["lab.example"]) == refused
    assert end({"email": "ada@lab.example.evil"}, domains=["lab.example"]) == refused
    assert end({"email": "lab.example@evil"}, domains=["lab.example"]) == refused
    assert end({}, groups=["arm"]) == refused
    assert end({"groups": None}, groups=["nav"]) == refused


def test_groups_give_roles_and_take_them_back(serve: Serve, provider: OidcProvider, database_url: str) -> None:
    browser = serve(
        strangers=True,
        scopes="openid profile groups",
        rights={"nav": ["viewer in Halls", "editor in halls", "viewer in Nowhere"], "ops": ["administrator"]},
        database_url=database_url,
    )
    lab = lab_of(browser)
    halls, streets = lab.project("Halls"), lab.project("Streets")
    launch(browser, halls, **OWNER)

    def rights(*groups: str) -> tuple[dict[str, str], bool]:
        provider.knows(ada=ADA | {"groups": groups})
        sign_in(browser, provider)
        account = browser.get("/api/account").json()
        roles = {each["name"]: each["role"] for each in browser.get("/api/projects").json()["items"]}
        return roles, account["administrates"]

    assert rights("nav") == ({"Halls": "editor"}, False)
    with lab.services.database.write() as session:
        (ada,) = session.query(tables.User).all()
        session.add(tables.Membership(project_id=streets, user_id=ada.id, role="viewer"))
    assert rights("nav", "ops")[1] is True
    # What the settings do not name stays as it was given.
    assert rights() == ({"Streets": "viewer"}, False)


def test_who_was_closed_out_does_not_come_in_by_the_provider(serve: Serve, provider: OidcProvider) -> None:
    provider.knows(ada=ADA)
    browser = serve(strangers=True)
    sign_in(browser, provider)
    with lab_of(browser).services.database.write() as session:
        session.query(tables.User).update({"disabled_at": time.time()})
    assert sign_in(serve(strangers=True), provider) == "/?refused=closed"


def test_the_answer_must_come_back_to_the_browser_that_went(serve: Serve, provider: OidcProvider) -> None:
    provider.knows(ada=ADA)
    ours, theirs = serve(strangers=True), serve(strangers=True)
    back = provider.sign_in(go(ours), "ada")
    assert theirs.get(back).headers["location"] == "/?refused=stale", "somebody else's answer, without any cookie"
    go(theirs)
    assert theirs.get(back).headers["location"] == "/?refused=stale", "with the cookie of another sign-in"
    assert ours.get(back).headers["location"] == "/"
    assert ours.get(back).headers["location"] == "/?refused=stale", "it serves once"
    # The same code with a cookie of its own state still lacks the verifier that the code was asked for with.
    own = parse_qs(urlsplit(go(theirs)).query)["state"][0]
    code = parse_qs(urlsplit(back).query)["code"][0]
    assert theirs.get(CALLBACK, params={"code": code, "state": own}).headers["location"] == "/?refused=unusable"
    assert theirs.get("/api/account").status_code == 401


def test_stopping_at_the_provider_leads_back_with_a_reason(serve: Serve) -> None:
    browser = serve()
    state = parse_qs(urlsplit(go(browser)).query)["state"][0]
    answer = browser.get(CALLBACK, params={"error": "access_denied", "state": state})
    assert answer.headers["location"] == "/?refused=stopped"
    assert words(browser, answer.headers["location"]).startswith("The university did not let you in, or you stopped there.")
    assert browser.get("/api/sign-in?refused=<script>").status_code == 422


def test_codes_are_not_guessed_for_long(serve: Serve) -> None:
    browser = serve()
    lab_of(browser).services.login_limiter._pause = 0.01

    def guess() -> str:
        state = parse_qs(urlsplit(go(browser)).query)["state"][0]
        return str(browser.get(CALLBACK, params={"code": "x", "state": state}).headers["location"])

    assert [guess() for _ in range(11)] == ["/?refused=unusable"] * 10 + ["/?refused=busy"]


def test_behind_a_proxy_the_provider_sends_people_to_the_proxys_name(serve: Serve, provider: OidcProvider) -> None:
    provider.knows(ada=ADA)
    trusting = serve(strangers=True, trusted_proxies=["10.0.0.1"], allowed_hosts=["mapless.lab.example"])
    through = TestClient(
        trusting.app,
        base_url=LAB.replace("https", "http"),
        client=("10.0.0.1", 1),
        headers={"X-Forwarded-Proto": "https", "X-Forwarded-For": "192.0.2.7"},
        follow_redirects=False,
    )
    url = go(through)
    assert parse_qs(urlsplit(url).query)["redirect_uri"] == [LAB + CALLBACK]
    journey = {"Cookie": "; ".join(f"{cookie.name}={cookie.value}" for cookie in through.cookies.jar)}
    answer = through.get(provider.sign_in(url, "ada").removeprefix(LAB), headers=journey)
    assert answer.headers["location"] == "/"
    cookies = answer.headers.get_list("set-cookie")
    assert any("mapless-session" in each and "Secure" in each and "SameSite=strict" in each for each in cookies)


def test_the_way_back_never_leaves_this_server() -> None:
    ways = {"//evil.example/x": "/evil.example/x", "/\\evil.example": "/evil.example", "evil.example": "/evil.example"}
    assert {wished: begin(wished, None, None).back for wished in ways} == ways


def test_two_browsers_of_somebody_new_make_one_account(serve: Serve, provider: OidcProvider, database_url: str) -> None:
    provider.knows(ada=ADA)
    browsers = [serve(strangers=True, database_url=database_url) for _ in range(2)]
    with ThreadPoolExecutor() as pool:
        ends = list(pool.map(lambda browser: sign_in(browser, provider), browsers))
    assert ends == ["/", "/"]
    assert len({browser.get("/api/account").json()["name"] for browser in browsers}) == 1


def test_a_provider_that_is_away_is_told_in_words(settings: Settings) -> None:
    away = settings.model_dump(exclude_unset=True) | {
        "oidc_issuer": f"http://127.0.0.1:{free_port()}",
        "oidc_client_id": "mapless",
    }
    with TestClient(create_app(Settings.model_validate(away)), base_url=BASE_URL) as browser:
        answer = browser.post("/api/sign-in/provider", json={})
    assert answer.status_code == 503
    assert answer.json()["detail"].startswith("127.0.0.1 does not answer.")


def test_without_a_provider_there_is_no_way_to_one(client: TestClient) -> None:
    assert client.post("/api/sign-in/provider", json={}).status_code == 404
    assert client.get(CALLBACK).status_code == 404


KEY, OTHER = RSAKey.generate_key(2048, {"kid": "k"}), RSAKey.generate_key(2048, {"kid": "k"})


class Liar:
    """A provider that follows the protocol, but for its ID token, which it makes as it is told."""

    def __init__(self) -> None:
        self.issuer = f"http://127.0.0.1:{free_port()}"
        self.nonce = ""
        self.token: Callable[[dict[str, Any]], str] = lambda claims: jwt.encode({"alg": "RS256", "kid": "k"}, claims, KEY)
        self.app = FastAPI()
        self.app.get("/.well-known/openid-configuration")(self.describe)
        self.app.get("/keys")(lambda: {"keys": [KEY.as_dict(private=False)]})
        self.app.post("/token")(self.exchange)

    def describe(self) -> dict[str, Any]:
        paths = {"authorization_endpoint": "/auth", "token_endpoint": "/token", "jwks_uri": "/keys"}
        supported = {"id_token_signing_alg_values_supported": ["RS256", "HS256", "none"]}
        return {"issuer": self.issuer} | supported | {name: self.issuer + path for name, path in paths.items()}

    def exchange(self) -> dict[str, Any]:
        now = int(time.time())
        claims = {"iss": self.issuer, "sub": "ada", "aud": "mapless", "iat": now, "exp": now + 60, "nonce": self.nonce}
        return {"access_token": "a", "token_type": "Bearer", "id_token": self.token(claims)}


@contextmanager
def served(app: FastAPI, port: int) -> Iterator[None]:
    server = uvicorn.Server(uvicorn.Config(app, port=port, log_level="warning"))
    thread = Thread(target=server.run)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    yield
    server.should_exit = True
    thread.join()


def signed(claims: Mapping[str, Any], key: Any = KEY, **header: str) -> str:
    return jwt.encode({"alg": "RS256", "kid": "k", **header}, dict(claims), key)


def signed_with_the_public_key(claims: Mapping[str, Any]) -> str:
    """What a check by whatever algorithm the token names would let pass: the provider's key is public."""
    header = urlsafe_b64encode(b'{"alg":"HS256","kid":"k"}').rstrip(b"=").decode()
    body = f"{header}.{signed(claims).split('.')[1]}"
    digest = hmac.digest(KEY.as_pem(private=False), body.encode(), "sha256")
    return f"{body}.{urlsafe_b64encode(digest).rstrip(b'=').decode()}"


LIES: dict[str, Callable[[dict[str, Any]], str]] = {
    "the nonce of another sign-in": lambda claims: signed(claims | {"nonce": "another"}),
    "no nonce": lambda claims: signed({name: claims[name] for name in claims if name != "nonce"}),
    "another issuer": lambda claims: signed(claims | {"iss": "http://127.0.0.1:1"}),
    "for another client": lambda claims: signed(claims | {"aud": "another client"}),
    "given to another client": lambda claims: signed(claims | {"aud": ["mapless", "b"], "azp": "b"}),
    "ended": lambda claims: signed(claims | {"exp": int(time.time()) - 120}),
    "of another access token": lambda claims: signed(claims | {"at_hash": "another"}),
    "nobody": lambda claims: signed(claims | {"sub": ""}),
    "signed by somebody else": lambda claims: signed(claims, OTHER),
    "signed with the public key": signed_with_the_public_key,
    "signature cut off": lambda claims: signed(claims).rpartition(".")[0] + ".",
    "unsigned": lambda claims: "eyJhbGciOiJub25lIn0." + signed(claims).split(".")[1] + ".",
    "no token": lambda claims: "nothing of the kind",
}


def test_a_token_that_does_not_hold_lets_nobody_in(settings: Settings) -> None:
    liar = Liar()
    given = settings.model_dump(exclude_unset=True) | {
        "oidc_issuer": liar.issuer,
        "oidc_client_id": "mapless",
        "oidc_strangers": True,
    }
    app = create_app(Settings.model_validate(given))
    ends = {}
    with (
        served(liar.app, int(liar.issuer.rpartition(":")[2])),
        TestClient(app, base_url=BASE_URL, follow_redirects=False) as browser,
    ):
        for lie, token in ({"nothing": signed} | LIES).items():
            app.state.services.login_limiter = GuessLimiter()
            browser.cookies.clear()
            asked = parse_qs(urlsplit(go(browser)).query)
            liar.nonce, liar.token = asked["nonce"][0], token
            answer = browser.get(CALLBACK, params={"code": "c", "state": asked["state"][0]})
            ends[lie] = (answer.headers["location"], "mapless-session-8400" in browser.cookies)
    assert ends == {"nothing": ("/", True)} | dict.fromkeys(LIES, ("/?refused=unusable", False))


def test_a_journey_is_sealed_and_ends() -> None:
    secrets, others = Secrets("a", "w"), Secrets("b", "w")
    journey = begin("/", None, "u1")
    assert unseal(seal(journey, secrets), secrets) == journey
    forged = seal(journey.model_copy(update={"connects": "u2"}), others)
    ended = seal(journey.model_copy(update={"ends": time.time() - 1}), secrets)
    for cookie in ("", ".", "x.y", forged, ended, seal(journey, secrets)[:-1], "é.é"):
        assert unseal(cookie, secrets) is None
    assert len({journey.state, journey.nonce, journey.verifier, begin("/", None, None).state}) == 4


@pytest.mark.parametrize(
    ("claims", "name"),
    [
        ({"preferred_username": "Ada Lovelace"}, "ada-lovelace"),
        ({"email": "ada@lab.example"}, "ada@lab.example"),
        ({"preferred_username": "../Ünï\x00code"}, "n-code"),
        ({"preferred_username": ["a list"]}, "somebody"),
        ({}, "somebody"),
        ({"preferred_username": "x" * 200}, "x" * 80),
    ],
)
def test_names_become_such_as_accounts_have(settings: Settings, claims: dict[str, Any], name: str) -> None:
    told = settings.model_copy(update={"oidc_issuer": "https://id.example", "oidc_client_id": "mapless"}).oidc
    assert told is not None
    assert identity_of({"sub": "s", **claims}, told).name == name


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"oidc_issuer": "http://id.example", "oidc_client_id": "m"}, "must begin with https://"),
        ({"oidc_issuer": "https://id.example"}, "needs MAPLESS_OIDC_CLIENT_ID"),
        ({"oidc_rights": {"nav": ["owner in Halls"]}}, "is no right"),
        ({"oidc_scopes": "profile"}, "String should match"),
    ],
)
def test_settings_that_can_not_be_meant(wrong: dict[str, Any], says: str) -> None:
    with pytest.raises(ValidationError, match=says):
        Settings.model_validate(wrong)


def test_who_signs_out_is_led_to_the_providers_page_that_ends_the_session_there_and_back(
    serve: Serve, provider: OidcProvider
) -> None:
    provider.knows(ada=ADA)
    browser = serve(strangers=True)
    assert browser.get("/api/sign-in/provider/end").status_code == 401
    sign_in(browser, provider)

    url = browser.get("/api/sign-in/provider/end").json()["url"]

    assert url.startswith(provider.issuer)
    # The provider checks the address against those that it knows, and asks its visitor.
    assert provider.sign_out(url) == f"{BASE_URL}/"
