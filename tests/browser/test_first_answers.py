"""What a page is called is there before its code: its first questions come with the HTML, and it takes their answers."""

import re
from collections import Counter
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, Page, Request, expect

from tests.browser.small_lab import small_lab

pytestmark = pytest.mark.browser

NAMED = {"run": "seed 0", "training": "Long 0", "policy": "Complex arena"}


def asked(page: Page) -> Counter[str]:
    """How often each address of the API is asked for, from now on."""
    questions: Counter[str] = Counter()

    def note(request: Request) -> None:
        if (path := urlsplit(request.url).path).startswith("/api/"):
            questions[path] += 1

    page.on("request", note)
    return questions


def test_a_page_is_called_what_it_is_before_its_code_has_come(tmp_path: Path, browser: Browser) -> None:
    with small_lab(tmp_path, browser) as (addresses, context):
        for name, title in NAMED.items():
            page = context.new_page()
            page.route("**/assets/*.js", lambda route: route.abort())
            page.goto(addresses[name][0])
            expect(page.get_by_role("heading", level=1)).to_contain_text(title)
            page.close()


def test_what_was_asked_with_the_html_is_not_asked_again(tmp_path: Path, browser: Browser) -> None:
    with small_lab(tmp_path, browser) as (addresses, context):
        page = context.new_page()
        complaints: list[str] = []
        page.on("console", lambda message: complaints.append(message.text))
        for name in NAMED:
            address, whole = addresses[name]
            questions = asked(page)
            page.goto(address)
            expect(page.locator(whole).first).to_be_visible()
            expect(page.get_by_role("heading", level=1)).to_contain_text(NAMED[name])
            assert [questions[path] for path in (f"/api{address}", "/api/account")] == [1, 1], questions
        # A browser says so when what it was told to fetch ahead is not taken.
        assert not [each for each in complaints if "preload" in each]


def test_another_page_does_not_bear_the_name_of_the_first(tmp_path: Path, browser: Browser) -> None:
    with small_lab(tmp_path, browser) as (addresses, context):
        page = context.new_page()
        page.goto(addresses["run"][0])
        expect(page.get_by_role("heading", level=1)).to_contain_text("seed 0")
        # The answer for the page that follows never comes.
        page.route("**/api/experiments/*", lambda route: None)
        page.get_by_role("link", name="Long 0", exact=True).first.click()
        expect(page).to_have_url(re.compile("/experiments/"))
        expect(page.get_by_role("heading", level=1)).not_to_contain_text("seed 0")
