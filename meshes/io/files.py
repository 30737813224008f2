"""Bytes of a drawing: read once, unpacked where they are packed, and refused early where they are something else."""

from __future__ import annotations

import os
import stat
import zlib
from pathlib import Path

from meshes.errors import FileFormatError
from meshes.limits import check_limit, limits

MEGABYTE = 2**20
_GZIP = b"\x1f\x8b"
# how files of other kinds begin, what they are, and the mend
_OTHERS = (
    (b"%PDF", "a PDF (Illustrator saves .ai files so)", "open it there and save it as SVG or DXF"),
    (b"%!PS", "PostScript", "open it in its program and save it as SVG or DXF"),
    (b"AC10", "a DWG drawing of AutoCAD", "save it as DXF"),
    (b"PK\x03\x04", "a ZIP archive", "unpack it and name the drawing in it"),
    (b"\x89PNG", "a picture in PNG", "trace its lines in a drawing program and save them as SVG"),
    (b"\xff\xd8\xff", "a picture in JPEG", "trace its lines in a drawing program and save them as SVG"),
)


def drawing_bytes(path: str | os.PathLike[str], kind: str) -> bytes:
    """The bytes of a drawing; gzip is unpacked.

    Args:
        path: the file.
        kind: what it should be, for messages: "SVG", "DXF", ...

    Returns:
        its bytes, within the limit of `meshes.limits`.

    Raises:
        FileFormatError: it cannot be read, is no plain file, is too large, or is something else by its first bytes.
    """
    try:
        found = Path(path).stat()
        if stat.S_ISDIR(found.st_mode):
            raise FileFormatError(f"this is a folder; name a .{kind.lower()} file in it")
        if not stat.S_ISREG(found.st_mode):  # a pipe would be waited for
            raise FileFormatError("this is no plain file; copy the drawing to one")
        check_limit("megabytes", found.st_size / MEGABYTE, "this drawing", FileFormatError)
        data = Path(path).read_bytes()
    except FileFormatError:
        raise
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise FileFormatError(f"cannot be read ({why}); check the name and rights") from error
    if data.startswith(_GZIP):
        data = _unpacked(data)
    refuse_others(data, kind)
    return data


def refuse_others(data: bytes, kind: str) -> None:
    """Refuse a file that begins as one of another kind, whatever its name is.

    Args:
        data: its first bytes, or all.
        kind: what it should be, for the message.

    Raises:
        FileFormatError: one line with what it is and the mend.
    """
    for begin, what, mend in _OTHERS:
        if data.startswith(begin):
            raise FileFormatError(f"this is {what}, not {kind}; {mend}")


def _unpacked(data: bytes) -> bytes:
    unpack = zlib.decompressobj(wbits=31)
    try:
        text = unpack.decompress(data, limits().megabytes * MEGABYTE + MEGABYTE)
    except zlib.error as error:
        raise FileFormatError(f"the packed file is damaged ({error}); save the drawing again") from error
    check_limit("megabytes", len(text) / MEGABYTE, "this drawing, unpacked,", FileFormatError)
    return text
