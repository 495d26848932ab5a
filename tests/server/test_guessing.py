"""Guessing secrets: every kind counts, by the address that truly sent it, and who holds the right one gets in."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from fastapi.testclient import TestClient
from pydantic import ValidationError
from starlette.requests import HTTPConnection

from server.app import create_app
from server.errors import TooManyAttemptsError
from server.security.limits import GuessLimiter
from server.settings import Settings
from tests.server.harness import BASE_URL, TOKEN, WORKER_TOKEN

PROXY = "10.9.8.7"
PAUSE = 0.02


@contextmanager
def reached_from(settings: Settings, address: str = PROXY, *, trusted: bool = False) -> Iterator[TestClient]:
    """A service, and connections to it from one address; `trusted`, that of its proxy."""
    app = create_app(settings.model_copy(update={"trusted_proxies": ("10.9.8.0/24",) if trusted else ()}))
    app.state.services.login_limiter._pause = PAUSE
    with TestClient(app, base_url=BASE_URL, client=(address, 50_000), follow_redirects=False) as client:
        yield client


@pytest.fixture
def client(settings: Settings) -> Iterator[TestClient]:
    with reached_from(settings) as client:
        yield client


def bearer(token: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {token}"}


def forwarded(address: str, scheme: str = "https") -> dict[str, str]:
    return {"X-Forwarded-For": address, "X-Forwarded-Proto": scheme}


def guess(client: TestClient, count: int, **headers: str) -> list[int]:
    """The answers to that many wrong tokens in the login form."""
    return [client.post("/api/login", json={"token": f"wrong{n}"}, headers=headers).status_code for n in range(count)]


def test_ten_wrong_tokens_of_any_kind_are_answered_and_no_more(client: TestClient) -> None:
    for n in range(2):
        assert client.post("/api/login", json={"token": f"wrong{n}"}).status_code == 401
        assert client.get(f"/?token=wrong{n}").status_code == 401
        assert client.get("/api/status", headers=bearer(f"wrong{n}")).status_code == 401
        assert client.get("/api/worker/ping", headers=bearer(f"wrong{n}")).status_code == 401
        assert client.get("/api/status", headers={"Cookie": f"mapless-8400=stale{n}"}).status_code == 401

    for refused in (
        client.post("/api/login", json={"token": "wrong"}),
        client.get("/?token=wrong"),
        client.get("/api/status", headers=bearer("wrong")),
        client.get("/api/worker/ping", headers=bearer("wrong")),
        client.get("/api/status", headers={"Cookie": "mapless-8400=another"}),
    ):
        assert refused.status_code == 429
        assert 1 <= int(refused.headers["retry-after"]) <= 60


@pytest.mark.parametrize("path", ["/api/status", "/api/worker/ping", "/live/x/"])
def test_wrong_tokens_in_headers_count(client: TestClient, path: str) -> None:
    answers = [client.get(path, headers=bearer(f"wrong{n}")).status_code for n in range(12)]

    assert answers == [401] * 10 + [429] * 2


def test_the_owner_is_not_locked_out(client: TestClient) -> None:
    assert client.post("/api/login", json={"token": TOKEN}).status_code == 204
    cookie = {"Cookie": "; ".join(f"{name}={value}" for name, value in client.cookies.items())}
    client.cookies.clear()
    assert guess(client, 12)[-1] == 429

    assert client.get("/api/status", headers=cookie).status_code == 200
    assert client.get("/api/status", headers=bearer(TOKEN)).status_code == 200
    assert client.post("/api/login", json={"token": TOKEN}).status_code == 204
    assert client.get(f"/?token={TOKEN}").status_code == 303
    # 404: let in, and there is nothing.
    assert client.get("/api/worker/nothing", headers=bearer(WORKER_TOKEN)).status_code == 404


def test_a_minute_later_nothing_is_held_against_the_address(client: TestClient, settings: Settings) -> None:
    now = 100.0
    client.app.state.services.login_limiter._clock = lambda: now  # type: ignore[attr-defined]
    assert guess(client, 11)[-1] == 429
    now += 61.0

    assert guess(client, 1) == [401]


def test_an_expired_cookie_is_one_guess_however_often_it_comes(client: TestClient) -> None:
    answers = [client.get("/api/status", headers={"Cookie": "mapless-8400=expired"}).status_code for _ in range(30)]
    assert answers == [401] * 30

    answers = [client.get("/api/status", headers={"Cookie": f"mapless-8400={n}"}).status_code for n in range(12)]
    assert answers == [401] * 9 + [429] * 3


def test_who_has_no_token_has_not_guessed(client: TestClient) -> None:
    assert {client.get("/api/status").status_code for _ in range(30)} == {401}


@pytest.mark.parametrize("address", ["127.0.0.1", "::1", PROXY])
def test_nobody_chooses_the_address_that_is_counted(settings: Settings, address: str) -> None:
    with reached_from(settings, address) as client:
        answers = [guess(client, 1, **forwarded(f"203.0.113.{n}"))[0] for n in range(12)]

    assert answers == [401] * 10 + [429] * 2


def test_behind_a_trusted_proxy_everybody_counts_alone(settings: Settings) -> None:
    with reached_from(settings, trusted=True) as client:
        # What the guesser wrote in front of its own address is not believed.
        answers = [guess(client, 1, **forwarded(f"198.51.100.{n}, 203.0.113.66"))[0] for n in range(12)]
        assert answers == [401] * 10 + [429] * 2

        assert guess(client, 1, **forwarded("198.51.100.1")) == [401]
    with reached_from(settings, "10.9.9.9", trusted=True) as stranger:
        assert [guess(stranger, 1, **forwarded(f"203.0.113.{n}"))[0] for n in range(12)][-1] == 429


def test_the_cookie_is_secure_where_the_browser_speaks_https(settings: Settings) -> None:
    def cookie(client: TestClient, scheme: str) -> str:
        response = client.get(f"/?token={TOKEN}", headers=forwarded("203.0.113.4", scheme))
        return str(response.headers["set-cookie"])

    with reached_from(settings, trusted=True) as client:
        assert "Secure" in cookie(client, "https")
        assert "Secure" not in cookie(client, "http")
    with reached_from(settings) as client:
        assert "Secure" not in cookie(client, "https")


def test_a_proxy_that_is_not_named_is_told_in_the_log(settings: Settings, caplog: pytest.LogCaptureFixture) -> None:
    with reached_from(settings) as client:
        guess(client, 3, **forwarded("203.0.113.4"))

    (line,) = [record.getMessage() for record in caplog.records if record.name == "server.security.proxies"]
    assert PROXY in line
    assert "MAPLESS_TRUSTED_PROXIES" in line


def test_a_proxy_is_an_address(settings: Settings) -> None:
    with pytest.raises(ValidationError, match="neither an address nor a network"):
        Settings.model_validate({"trusted_proxies": ("proxy.example",)})


# -- the limiter ----------------------------------------------------------------------------------------------------------


def connection(address: str) -> HTTPConnection:
    return HTTPConnection({"type": "http", "client": (address, 1), "headers": []})


def exhaust(limiter: GuessLimiter, address: str) -> None:
    for n in range(10):
        limiter.failed(connection(address), str(n))


def test_tokens_are_compared_one_at_a_time_and_the_line_is_short() -> None:
    async def attempts() -> tuple[float, int]:
        limiter = GuessLimiter(pause=PAUSE)
        exhaust(limiter, "203.0.113.4")
        loop = asyncio.get_running_loop()
        began = loop.time()
        turns = [limiter.turn(connection("203.0.113.4")) for _ in range(50)]
        refused = [isinstance(end, TooManyAttemptsError) for end in await asyncio.gather(*turns, return_exceptions=True)]
        seconds = loop.time() - began
        # Nobody else waits.
        await asyncio.wait_for(limiter.turn(connection("203.0.113.5")), PAUSE / 4)
        return seconds, 50 - sum(refused)

    seconds, served = asyncio.run(attempts())
    assert served == 8
    assert seconds >= 8 * PAUSE


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("2001:db8:1:2::1", "2001:db8:1:2:ffff::9", True),
        ("2001:db8:1:2::1", "2001:db8:1:3::1", False),
        ("::ffff:203.0.113.4", "203.0.113.4", True),
        ("203.0.113.4", "203.0.113.5", False),
        ("fe80::1%eth0", "fe80::1%eth1", True),
    ],
)
def test_addresses_that_one_guesser_may_have_count_together(one: str, other: str, same: bool) -> None:
    limiter = GuessLimiter()
    exhaust(limiter, one)
    if same:
        with pytest.raises(TooManyAttemptsError):
            limiter.failed(connection(other), "wrong")
    else:
        limiter.failed(connection(other), "wrong")


def test_memory_is_bounded_and_a_flood_of_addresses_forgives_nobody() -> None:
    limiter = GuessLimiter()
    for n in range(10_500):
        limiter.failed(connection(f"10.{n >> 16}.{n >> 8 & 255}.{n & 255}"), "wrong")
        if n % 1_100 == 0:
            limiter.failed(connection("203.0.113.4"), str(n))

    assert len(limiter._guessers) == 10_000
    assert max(len(guesser.failures) for guesser in limiter._guessers.values()) <= 10
    with pytest.raises(TooManyAttemptsError):
        limiter.failed(connection("203.0.113.4"), "wrong")
