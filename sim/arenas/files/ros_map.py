"""Maps of ROS' `map_server`: a YAML file and the image that it names, as walls and boxes.

A pixel is free, occupied or unknown as `map_server` reads it; a robot may drive over free cells only, so the other two are
obstacles. The free cells that hang together best are the arena; what lies beyond them is left out, and the occupied cells
along their edge are covered by few rectangles. The edge itself is kept to the pixel.
"""

from io import BytesIO
from pathlib import PurePath
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from sim.arenas.cells import Mask, components
from sim.arenas.document import to_document
from sim.arenas.files.limits import MAX_IMAGE_BYTES, MAX_IMAGE_CELLS, RESOLUTIONS
from sim.arenas.files.own_yaml import describe
from sim.arenas.geometry import Arena
from sim.arenas.rectangles import cover, to_boxes
from sim.config import MAX_OBSTACLES, MAX_SIDE, MIN_SIDE, ArenaFile
from sim.errors import ArenaFormatError, ArenaLimitError

# Scale mode: cells that are more likely occupied than not are obstacles.
_LIKELY = 0.5


class MapInfo(BaseModel):
    """The YAML file of a map, as `map_server` documents it; keys of other tools are ignored."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)

    image: str = Field(min_length=1, max_length=255)
    resolution: float = Field(ge=RESOLUTIONS[0], le=RESOLUTIONS[1])
    origin: tuple[float, float, float]
    negate: bool = False
    occupied_thresh: float = Field(ge=0.0, le=1.0)
    free_thresh: float = Field(ge=0.0, le=1.0)
    mode: Literal["trinary", "scale"] = "trinary"

    @field_validator("image")
    @classmethod
    def _beside_the_file(cls, image: str) -> str:
        # A name with a folder in it could lead anywhere on this machine.
        if PurePath(image).name != image or "\\" in image or image in {".", ".."} or "\0" in image:
            raise ValueError(f"only the name of an image beside the YAML file is read, and {image!r} leads elsewhere")
        return image


def parse_info(name: str, document: dict[str, Any]) -> MapInfo:
    """The map's YAML.

    Raises:
        ArenaFormatError: a value is missing or out of its range.
    """
    try:
        info = MapInfo.model_validate({str(key): value for key, value in document.items()})
    except ValidationError as error:
        raise ArenaFormatError(f"{name}: {describe(error)}") from error
    if info.free_thresh >= info.occupied_thresh:
        raise ArenaFormatError(f"{name}: free_thresh must be below occupied_thresh")
    return info


def read_map(name: str, info: MapInfo, image: bytes) -> ArenaFile:
    """The arena in a map; its middle becomes the origin, and the map's own axes those of the arena.

    Raises:
        ArenaLimitError: the image is too large, or it takes too many boxes.
        ArenaFormatError: it is no PGM or PNG, or has no free cell.
    """
    free = _free_cells(info, _pixels(info.image, image))
    labels, sizes = components(free)
    if not len(sizes):
        raise ArenaFormatError(f"{info.image}: no pixel of it is free; check the thresholds and `negate` in {name}")
    # Image rows go down, ours up.
    inside = np.flipud(labels == 0)
    rows, columns = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
    inside = inside[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    height, width = (count * info.resolution for count in inside.shape)
    if min(height, width) < MIN_SIDE:
        raise ArenaFormatError(f"{name}: {width:g} x {height:g} m of free space is no arena; check the resolution")
    if max(height, width) > MAX_SIDE:
        raise ArenaLimitError(f"{name}: {width:.0f} x {height:.0f} m of free space; an arena may be {MAX_SIDE:g} m long")
    rectangles = cover(_edge(inside), ~inside, MAX_OBSTACLES)
    if len(rectangles) > MAX_OBSTACLES:
        raise ArenaLimitError(
            f"{name}: its walls are so ragged that they take more than {MAX_OBSTACLES} boxes; crop the image, clean it up, "
            "or save it at a coarser resolution"
        )
    boxes = to_boxes(rectangles, -0.5 * width, -0.5 * height, info.resolution)
    return to_document(Arena(PurePath(name).stem[:80] or "map", 0.5 * width, 0.5 * height, boxes=boxes))


def _pixels(name: str, content: bytes) -> NDArray[np.float64]:
    """(rows, columns, channels) 0 to 255; with an alpha channel as the last of 2 or 4."""
    if len(content) > MAX_IMAGE_BYTES:
        raise ArenaLimitError(f"{name}: an image may have {MAX_IMAGE_BYTES // 2**20} MiB, and this one is larger")
    try:
        with Image.open(BytesIO(content), formats=("PNG", "PPM")) as image:
            # The size stands in the header: a small file that unpacks to gigabytes is not unpacked.
            if image.width * image.height > MAX_IMAGE_CELLS:
                raise ArenaLimitError(f"{name}: {image.width} x {image.height} pixels; at most {MAX_IMAGE_CELLS:,} are read")
            deep = image.mode.startswith("I") or image.mode == "F"
            mode = "I" if deep else "LA" if image.mode in {"LA", "PA"} else "RGBA" if _has_alpha(image) else "RGB"
            pixels = np.asarray(image.convert(mode), dtype=np.float64)
    except Image.DecompressionBombError as error:
        raise ArenaLimitError(f"{name}: {error}; at most {MAX_IMAGE_CELLS:,} pixels are read") from error
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError, EOFError) as error:
        raise ArenaFormatError(f"{name}: not readable as a PGM or PNG image: {str(error)[:120]}") from error
    if deep:
        pixels = pixels / 257.0  # 16 bits
    return pixels.reshape(*pixels.shape[:2], -1)


def _has_alpha(image: Image.Image) -> bool:
    return image.mode == "RGBA" or "transparency" in image.info


def _free_cells(info: MapInfo, pixels: NDArray[np.float64]) -> Mask:
    """Which pixels are free: how dark one is, against the thresholds."""
    colours = pixels.shape[2] - (1 if pixels.shape[2] in {2, 4} else 0)
    brightness = pixels[:, :, :colours].mean(axis=2) / 255.0
    occupancy = brightness if info.negate else 1.0 - brightness
    if info.mode == "trinary":
        return np.asarray(occupancy < info.free_thresh)
    scaled = (occupancy - info.free_thresh) / (info.occupied_thresh - info.free_thresh)
    known = pixels[:, :, -1] >= 255.0 if colours < pixels.shape[2] else np.True_
    return np.asarray((scaled < _LIKELY) & known)


def _edge(inside: Mask) -> Mask:
    """The other cells that touch the inside, over an edge or a corner."""
    padded = np.pad(inside, 1)
    near = np.zeros_like(inside)
    rows, columns = inside.shape
    for row in range(3):
        for column in range(3):
            near |= padded[row : row + rows, column : column + columns]
    return near & ~inside
