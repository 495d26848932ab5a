"""The built pages, or a page that says how to build them."""

import gzip
import json
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from server.settings import Settings


@pytest.fixture
def dist(settings: Settings) -> Path:
    """What a build leaves."""
    (settings.web_dist / "assets").mkdir(parents=True)
    (settings.web_dist / "index.html").write_text("<!doctype html><title>Mapless</title>")
    (settings.web_dist / "favicon.svg").write_text("<svg/>")
    (settings.web_dist / "assets" / "index-abc123.js").write_text("export {}")
    (settings.web_dist.parent / "secret.txt").write_text("secret")
    return settings.web_dist


def test_what_is_large_comes_compressed_to_who_takes_it_so(dist: Path, client: TestClient) -> None:
    script = "export const answer = 42\n" * 1_000
    (dist / "assets" / "large-abc123.js").write_text(script)
    for accepted, encoding in (("gzip", "gzip"), ("identity", None)):
        response = client.get("/assets/large-abc123.js", headers={"Accept-Encoding": accepted})
        assert response.headers.get("content-encoding") == encoding
        assert response.text == script
    compressed = client.get("/api/openapi.json", headers={"Accept-Encoding": "gzip"})
    assert compressed.headers["content-encoding"] == "gzip"
    assert int(compressed.headers["content-length"]) < len(compressed.content) / 5


def test_an_asset_comes_as_the_build_compressed_it(dist: Path, client: TestClient) -> None:
    script = b"export const answer = 42\n"
    (dist / "assets" / "page-abc123.js").write_bytes(script)
    (dist / "assets" / "page-abc123.js.gz").write_bytes(gzip.compress(script))
    # The client knows no Brotli: what it gets is what is in the file.
    (dist / "assets" / "page-abc123.js.br").write_bytes(b"brotli")
    for accepted, encoding, content in (
        ("gzip, deflate, br;q=1.0", "br", b"brotli"),
        ("gzip", "gzip", script),
        ("identity", None, script),
    ):
        response = client.get("/assets/page-abc123.js", headers={"Accept-Encoding": accepted})
        assert response.headers.get("content-encoding") == encoding
        assert response.content == content
        assert response.headers["content-type"].startswith("text/javascript")
        assert response.headers["cache-control"] == "public, max-age=31536000, immutable"
        assert ("Accept-Encoding" in response.headers.get("vary", "")) == (encoding is not None)


@pytest.mark.parametrize("path", ["/", "/experiments/abc", "/runs/x/y", "/apiary"])
def test_every_route_of_the_application_is_its_one_page(dist: Path, client: TestClient, path: str) -> None:
    response = client.get(path)

    assert response.status_code == 200
    assert response.headers["content-type"].startswith("text/html")
    assert response.text == (dist / "index.html").read_text()
    # A new build must be seen at the next visit.
    assert response.headers["cache-control"] == "no-cache"


@pytest.mark.parametrize(
    ("path", "page"),
    [("/", "Trainings"), ("/runs/abc", "Run"), ("/board", "Board"), ("/board/abc", "Board"), ("/runs/a/b", "NotFound")],
)
def test_a_route_has_the_html_of_its_page(dist: Path, client: TestClient, path: str, page: str) -> None:
    (dist / "pages").mkdir()
    routes = {"/": "TrainingsPage.html", "/runs/[^/]+": "RunPage.html", "/board(/[^/]+)?": "BoardPage.html"}
    (dist / "pages" / "routes.json").write_text(json.dumps([(pattern, file, []) for pattern, file in routes.items()]))
    for file in ("TrainingsPage.html", "RunPage.html", "BoardPage.html", "NotFoundPage.html"):
        (dist / "pages" / file).write_text(f"<!doctype html><title>{file}</title>")

    response = client.get(path)

    assert response.text == f"<!doctype html><title>{page}Page.html</title>"
    assert response.headers["cache-control"] == "no-cache"


@pytest.mark.parametrize(
    ("path", "named"),
    [
        ("/runs/abc", "</api/status>; {ahead}, </api/runs/abc>; {ahead}"),
        ("/runs/a%3E,%3Cb", "</api/runs/a%3E%2C%3Cb>"),
        ("/runs/{secret}", "</api/runs/%7Bsecret%7D>"),
        ("/elsewhere", None),
    ],
)
def test_the_html_of_a_page_comes_with_what_the_page_asks_first(
    dist: Path, client: TestClient, path: str, named: str | None
) -> None:
    (dist / "pages").mkdir()
    routes = [("/runs/(?P<runId>[^/]+)", "RunPage.html", ["/api/status", "/api/runs/{runId}"])]
    (dist / "pages" / "routes.json").write_text(json.dumps(routes))
    for file in ("RunPage.html", "NotFoundPage.html"):
        (dist / "pages" / file).write_text(f"<!doctype html><title>{file}</title>")

    response = client.get(path)
    again = client.get(path, headers={"If-None-Match": response.headers["etag"]})

    for link in (response.headers.get("link"), again.headers.get("link")):
        ahead = "rel=preload; as=fetch; crossorigin"
        assert link is None if named is None else named.replace("{ahead}", ahead) in (link or "")
    assert "set-cookie" not in response.headers
    # Who is not signed in would be refused: nothing is asked for them.
    client.headers.pop("Authorization", None)
    client.cookies.clear()
    assert "link" not in client.get(path).headers


def test_assets_never_change(dist: Path, client: TestClient) -> None:
    response = client.get("/assets/index-abc123.js")

    assert response.status_code == 200
    assert response.headers["content-type"].startswith("text/javascript")
    assert response.headers["cache-control"] == "public, max-age=31536000, immutable"
    # One that is gone is not answered with a page, which a browser would take for a script.
    assert client.get("/assets/index-gone.js").status_code == 404


def test_other_files_of_the_build(dist: Path, client: TestClient) -> None:
    assert client.get("/favicon.svg").headers["content-type"] == "image/svg+xml"
    assert client.head("/favicon.svg").status_code == 200


@pytest.mark.parametrize(
    "path", ["/../secret.txt", "/%2e%2e/secret.txt", "/assets/../../secret.txt", "/..%2fsecret.txt", "/%00"]
)
def test_nothing_outside_the_build_is_served(dist: Path, client: TestClient, path: str) -> None:
    assert "secret" not in client.get(path).text


def test_a_route_that_the_api_lacks_is_not_a_page(dist: Path, client: TestClient) -> None:
    response = client.get("/api/nothing")

    assert response.status_code == 404
    assert response.json() == {"detail": "There is no route /api/nothing."}


def test_pages_that_were_not_built(client: TestClient) -> None:
    response = client.get("/")

    assert response.status_code == 503
    assert "make pages" in response.text


def test_a_path_longer_than_any_file_is_the_page_too(dist: Path, client: TestClient) -> None:
    assert client.get("/" + "x" * 5_000).status_code == 200
    assert client.get("/" + "x/" * 2_500).status_code == 200
    assert client.get("/assets/" + "x" * 5_000).status_code == 404


def test_what_a_browser_has_already_is_not_sent_again(dist: Path, client: TestClient) -> None:
    (dist / "index.html").write_text("<!doctype html><title>Mapless</title>" + "<p>One</p>" * 200)
    for path in ("/", "/favicon.svg", "/assets/index-abc123.js"):
        first = client.get(path)
        again = client.get(path, headers={"If-None-Match": first.headers["etag"]})
        assert (again.status_code, again.content) == (304, b"")
        assert again.headers["cache-control"] == first.headers["cache-control"]
    tag = client.get("/").headers["etag"]

    (dist / "index.html").write_text("<!doctype html><title>Mapless</title>" + "<p>Other</p>" * 200)
    anew = client.get("/", headers={"If-None-Match": tag})

    assert anew.status_code == 200
    assert "Other" in anew.text
    assert anew.headers["etag"] != tag


def test_a_part_of_an_asset(dist: Path, client: TestClient) -> None:
    for _ in range(2):
        part = client.get("/assets/index-abc123.js", headers={"Range": "bytes=0-5"})
        assert (part.status_code, part.text) == (206, "export")
        assert client.get("/assets/index-abc123.js").text == "export {}"


def test_pages_and_assets_have_the_headers_that_hold_them_to_what_they_are(dist: Path, client: TestClient) -> None:
    for path in ("/", "/assets/index-abc123.js"):
        for _ in range(2):
            response = client.get(path)
            assert response.headers["x-content-type-options"] == "nosniff"
            assert "default-src 'self'" in response.headers["content-security-policy"]
            assert int(response.headers["content-length"]) == len(response.content)
            assert client.head(path).headers["content-length"] == response.headers["content-length"]
            assert client.head(path).content == b""
            assert client.get(path, headers={"Host": "evil.example"}).status_code == 400
