"""A person comes in by a provider of identities, in a real browser: strangers are told so, the invited join with it."""

import os
import sys
from pathlib import Path

from playwright.sync_api import Browser, Page, expect

from tests.browser.conftest import running
from tests.oidc_provider import OidcProvider, oidc_provider, settings_for
from tests.services.stack import free_port

MAPLESS = [sys.executable, "-m", "server"]


def at_the_provider(page: Page, name: str, provider: OidcProvider) -> None:
    """Sign in there, and let Mapless know who it is."""
    page.wait_for_url(f"{provider.issuer}/**")
    page.get_by_placeholder("Enter any login").fill(name)
    page.get_by_placeholder("and password").fill("any")
    page.get_by_role("button", name="Sign-in").click()
    page.get_by_role("button", name="Continue").click()


def test_somebody_joins_by_a_link_and_comes_back_without_one(browser: Browser, tmp_path: Path) -> None:
    port = free_port()
    origin = f"http://127.0.0.1:{port}"
    with oidc_provider(tmp_path, origin) as provider:
        provider.knows(ada={"preferred_username": "Ada"})
        environment = {f"MAPLESS_{name.upper()}": str(value) for name, value in settings_for(provider).items()}
        with running(MAPLESS, tmp_path / "data", 0, port=port, env={**os.environ, **environment}) as address:
            context = browser.new_context(base_url=origin, viewport={"width": 1280, "height": 900})
            page = context.new_page()
            page.goto("/queue")
            page.get_by_role("button", name="Sign in with the university").click()
            at_the_provider(page, "ada", provider)
            expect(page.get_by_role("alert")).to_contain_text("The university knows you, but you have no account here")

            token = address.partition("token=")[2]
            made = context.request.post(
                "/api/invitations", data={"admin": True}, headers={"Authorization": f"Bearer {token}"}
            ).json()
            page.goto(made["path"])
            page.get_by_role("button", name="Join with the university").click()
            expect(page.get_by_role("button", name="Account of ada")).to_be_visible()

            page.get_by_role("button", name="Account of ada").click()
            page.get_by_role("menuitem", name="Sign out", exact=True).click()
            page.goto("/queue")
            page.get_by_role("button", name="Sign in with the university").click()
            expect(page.get_by_role("button", name="Account of ada")).to_be_visible()
            expect(page).to_have_url(f"{origin}/queue")
            page.goto("/account")
            expect(page.get_by_text("Connected: you sign in to this account with the university.")).to_be_visible()
            context.close()
