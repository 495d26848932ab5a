"""Every page by keyboard alone: nothing holds the focus, it is always seen, and a dialog gives it back."""

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from tests.browser.small_lab import Addresses, small_lab

pytestmark = pytest.mark.browser

# More than any page has to stop at.
STOPS = 400
# Where the focus is: what it is called, whether it is on the footer's last link, and whether it is drawn.
FOCUSED = """
() => {
  const element = document.activeElement
  const drawn = (one) => {
    const style = getComputedStyle(one)
    return (style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) > 0) || style.boxShadow !== 'none'
  }
  // What Mantine draws itself shows its focus beside or around it; text fields have a border of another colour.
  const field = element.matches('input, textarea, select')
  const around = [element, element.nextElementSibling, element.parentElement].filter(Boolean)
  return {
    what: `${element.tagName} ${element.getAttribute('aria-label') ?? element.textContent.trim().slice(0, 40)}`,
    last: element.matches('footer a[href="/reference"]'),
    seen: field || element === document.body || element.tagName === 'IFRAME' || around.some(drawn),
  }
}
"""


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory, browser: Browser) -> Iterator[tuple[Addresses, BrowserContext]]:
    """The addresses of a service with one of everything, and a browser that stands still."""
    with small_lab(tmp_path_factory.mktemp("lab"), browser) as (found, context):
        # The robots in 3D are a page of their own.
        context.route("**/live/**", lambda route: route.abort())
        yield found, context


def whole(page: Page, path: str, selector: str) -> None:
    """Open a page and wait until it is there."""
    page.goto(path)
    expect(page.locator(f"#root {selector}").first).to_be_visible()
    expect(page.locator("#frame")).to_have_count(0)


@pytest.mark.timeout(900)
def test_tab_goes_through_every_page_to_its_end(lab: tuple[dict[str, tuple[str, str]], BrowserContext]) -> None:
    found, context = lab
    page = context.new_page()
    page.emulate_media(reduced_motion="reduce")
    unseen = []
    for name, (path, selector) in found.items():
        whole(page, path, selector)
        page.keyboard.press("Tab")
        assert page.evaluate(FOCUSED)["what"] == "A Skip to content", name
        page.keyboard.press("Enter")
        expect(page.locator("#main")).to_be_focused()
        for _ in range(STOPS):
            page.keyboard.press("Tab")
            at = page.evaluate(FOCUSED)
            if not at["seen"]:
                unseen.append(f"{name}: {at['what']}")
            if at["last"]:
                break
        else:
            raise AssertionError(f"{name}: the focus does not come to the page's end; it is on {at['what']}")
    page.close()
    assert not unseen, "\n".join(unseen)


def test_a_dialog_takes_the_focus_and_gives_it_back(lab: tuple[dict[str, tuple[str, str]], BrowserContext]) -> None:
    found, context = lab
    page = context.new_page()
    whole(page, *found["training"])
    opener = page.get_by_role("button", name="Seeds").first
    opener.focus()
    page.keyboard.press("Enter")
    dialog = page.get_by_role("dialog")
    expect(dialog).to_be_visible()
    page.wait_for_function("document.activeElement.closest('[role=dialog]')")
    page.keyboard.press("Escape")
    expect(dialog).to_be_hidden()
    expect(opener).to_be_focused()
    page.close()


def test_links_of_the_header_lead_on_and_rows_open(lab: tuple[dict[str, tuple[str, str]], BrowserContext]) -> None:
    found, context = lab
    page = context.new_page()
    whole(page, *found["queue"])
    page.get_by_role("navigation", name="Main").get_by_role("link", name="Trainings").focus()
    page.keyboard.press("Enter")
    row = page.get_by_test_id("experiment").first
    expect(row).to_be_visible()
    row.focus()
    page.keyboard.press("ArrowDown")
    expect(page.get_by_test_id("experiment").nth(1)).to_be_focused()
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", level=1)).not_to_have_text("Trainings")
    expect(page.get_by_text(re.compile(r"^launched \d"))).to_be_visible()
    page.close()


def test_a_menu_gives_the_focus_back(lab: tuple[dict[str, tuple[str, str]], BrowserContext]) -> None:
    found, context = lab
    page = context.new_page()
    whole(page, *found["trainings"])
    opener = page.get_by_role("button", name="Actions for").first
    for _ in range(2):  # the first time it is made
        opener.focus()
        page.keyboard.press("Enter")
        expect(page.get_by_role("menuitem", name="Duplicate")).to_be_focused()
        page.keyboard.press("Escape")
        expect(page.get_by_role("menu")).to_have_count(0)
        expect(opener).to_be_focused()
    page.close()
