"""What unpacking an archive may raise that is damaged, or that somebody made up."""

import errno
import lzma
import struct
import tarfile
import zipfile
import zlib

UNPACKING_ERRORS = (
    zipfile.BadZipFile,
    tarfile.TarError,
    zlib.error,
    lzma.LZMAError,
    struct.error,
    EOFError,
    OSError,
    RuntimeError,
    ValueError,
)
"""Of `zipfile`, `tarfile` and what they unpack with; an `OSError` may be the disk's as well: `is_damage` tells."""


def is_damage(error: BaseException) -> bool:
    """Whether one of `UNPACKING_ERRORS` says something of the archive, and not of the disk that it lies on."""
    # bz2 and gzip raise an OSError without a number; a place before the file's beginning is an invalid argument.
    return not isinstance(error, OSError) or error.errno in (None, errno.EINVAL)
