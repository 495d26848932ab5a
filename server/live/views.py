"""Where scenes come from; viser takes a second to import, so nobody pays for it before somebody watches."""

from typing import TYPE_CHECKING

from server.live.hub import View
from server.live.settings import LiveSettings
from sim.config import TaskConfig
from workers.scene.themes import Theme

if TYPE_CHECKING:
    from workers.scene.stage import Stage


def open_view(task: TaskConfig, theme: Theme, settings: LiveSettings, stage: "Stage | None" = None) -> View:
    """A scene on a viser server of its own."""
    from server.live.view import LiveView

    return LiveView(task, theme, settings, stage)
