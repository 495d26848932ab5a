"""The page inside the live view's frame: viser's own client, told whom to talk to, with our display over it."""

import functools
import importlib.metadata
import importlib.util
import re
from pathlib import Path

from workers.scene.themes import Theme

VISER_PROTOCOL = f"viser-v{importlib.metadata.version('viser')}"
"""The WebSocket sub-protocol by which viser's client and server know that they are of one version."""

# viser's client is one self-extracting file: its script is unpacked by WebAssembly and runs inline. What the policy can
# still do is keep it, and whatever might be smuggled in, from talking to anybody else.
_POLICY = (
    "default-src 'none'",
    "script-src 'unsafe-inline' 'wasm-unsafe-eval'",
    "style-src 'unsafe-inline'",
    "img-src data: blob:",
    "font-src data:",
    "worker-src blob: data:",
    "connect-src 'self' data: blob:",
    "frame-ancestors 'self'",
    "base-uri 'none'",
    "form-action 'none'",
)
HEADERS = {"Content-Security-Policy": "; ".join(_POLICY), "Cache-Control": "no-cache"}

_DIRECTORY = Path(__file__).parent


@functools.cache
def live_page(theme: Theme) -> str:
    """The HTML of the live view in one theme."""
    styles = asset("panels.css") + asset("display.css")
    head = f"<style>{styles}</style><script>{asset('display.js')}</script>"
    return viser_page(theme, head, '<div id="display" hidden></div>')


def viser_page(theme: Theme, head: str, body: str) -> str:
    """Viser's client in one theme, with something at the end of its head and at the beginning of its body."""
    client = _viser_client()
    client = client.replace("</head>", f"{head}</head>", 1)
    return client.replace("<body>", f'<body data-theme="{theme}">{body}', 1)


def own_websocket(value: str, host: str, path: str) -> bool:
    """Whether `?websocket=` names the page's own bridge, as viser's client writes it into its address by itself."""
    return re.fullmatch(rf"wss?://{re.escape(host)}{re.escape(path)}", value) is not None


@functools.cache
def _viser_client() -> str:
    # Found without importing viser, which takes a second.
    spec = importlib.util.find_spec("viser")
    assert spec is not None
    assert spec.origin is not None
    return (Path(spec.origin).parent / "client" / "build" / "index.html").read_text(encoding="utf-8")


def asset(name: str) -> str:
    """A file that goes into the page."""
    return (_DIRECTORY / "assets" / name).read_text(encoding="utf-8")
