"""Whether a checkpoint's archive is still what was registered: asked when a worker could not go on from it."""

import errno

from server.database import tables
from server.errors import NotFoundError
from server.files import FileStore
from workers.checkpoints import check_archive, sha256_of
from workers.errors import ArchiveError


def is_whole(files: FileStore, checkpoint: tables.Checkpoint) -> bool:
    """Reads the archive twice, a block at a time.

    Raises:
        OSError: the store cannot be asked now.
    """
    try:
        with files.open(checkpoint.id) as file:
            if sha256_of(file) != checkpoint.sha256:
                return False
            file.seek(0)
            # What a worker's disk had damaged before it was brought here has a SHA-256 that agrees.
            check_archive(file, f"checkpoint {checkpoint.id}")
    except (NotFoundError, ArchiveError):
        return False
    except OSError as error:
        if error.errno == errno.EIO:
            return False
        raise
    return True
