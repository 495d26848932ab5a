"""The nodes of what moves beside the robots."""

import numpy as np
import viser

from workers.frames import Frame
from workers.scene import meshes
from workers.scene.moving import Moving
from workers.scene.themes import Colours, linear


class MoverNodes:
    """A fixed number of movers below one node.

    Args:
        server: where the nodes live.
        moving: where they are set.
        parent: path of the node to hang them under.
        colours: of the theme.
        movers: how many.
    """

    def __init__(self, server: viser.ViserServer, moving: Moving, parent: str, colours: Colours, movers: int) -> None:
        mesh = meshes.mover()
        self._movers = movers
        self._moving = moving
        self._bodies = server.scene.add_batched_meshes_simple(
            f"{parent}/movers",
            mesh.vertices,
            mesh.faces,
            batched_wxyzs=np.tile(np.array([1.0, 0.0, 0.0, 0.0], np.float32), (movers, 1)),
            batched_positions=np.zeros((movers, 3), np.float32),
            batched_scales=np.ones((movers, 3), np.float32),
            batched_colors=linear(colours.mover),
            lod="off",
            flat_shading=True,
        )

    def __len__(self) -> int:
        return self._movers

    def update(self, frame: Frame) -> None:
        """Draws the movers of a frame that has as many."""
        height = np.zeros(self._movers, np.float32)
        self._moving.put(self._bodies, "batched_positions", np.column_stack([frame.movers[:, :2], height]))
        # As wide as each is, all equally tall.
        scales = np.column_stack([frame.movers[:, 2], frame.movers[:, 2], height + np.float32(1.0)])
        self._moving.put(self._bodies, "batched_scales", scales)

    def remove(self) -> None:
        """Takes the nodes away."""
        self._moving.forget(self._bodies)
        self._bodies.remove()
