"""Answers that are kept: made once, the longest unused forgotten first, never more bytes than allowed."""

from fastapi.testclient import TestClient

from server.metrics.cache import AnswerCache
from tests.server.harness import Reports


def test_an_answer_is_made_once_and_the_longest_unused_goes_first() -> None:
    cache = AnswerCache(max_bytes=10)
    made: list[str] = []

    def ask(key: str) -> bytes:
        def make() -> bytes:
            made.append(key)
            return key.encode() * 4

        return cache.get(key, make)

    assert (ask("a"), ask("b"), ask("a")) == (b"aaaa", b"bbbb", b"aaaa")
    assert made == ["a", "b"]
    ask("c")  # 12 bytes: b goes, which nobody has asked for since
    ask("a")
    assert made == ["a", "b", "c"]
    ask("b")
    assert made == ["a", "b", "c", "b"]
    # What is larger than everything allowed is answered, and not kept.
    assert cache.get("large", lambda: b"x" * 11) == b"x" * 11
    assert cache.get("large", lambda: b"y") == b"y"


def test_a_run_that_reports_or_is_cut_back_is_looked_at_anew(client: TestClient, reports: Reports) -> None:
    run = reports.experiment()["runs"][0]

    def steps() -> list[int]:
        (series,) = client.get(f"/api/runs/{run['id']}/metrics").json()["series"]
        shown: list[int] = series["steps"]
        return shown

    reports.metrics(run, "a", {10: 1.0, 20: 2.0})
    reports.state(run, "running", last_seq=2, step=20, attempt=1)
    assert steps() == steps() == [10, 20]
    reports.metrics(run, "a", {10: 1.0, 20: 2.0, 30: 3.0})
    reports.state(run, "running", last_seq=3, step=30)
    assert steps() == [10, 20, 30]
    reports.cut(run, 10)
    reports.state(run, "queued", step=10)
    assert steps() == [10]
