"""Where scenes come from; viser takes a second to import, so nobody pays for it before somebody watches."""

from server.live.hub import View
from server.live.settings import LiveSettings
from server.scene.themes import Theme
from sim.config import TaskConfig


def open_view(task: TaskConfig, theme: Theme, settings: LiveSettings) -> View:
    """A scene on a viser server of its own."""
    from server.live.view import LiveView

    return LiveView(task, theme, settings)
