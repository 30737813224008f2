"""A folder of results that may come from somebody else: nothing in it is written through."""

from __future__ import annotations

import os
from pathlib import Path

from meshes.errors import InputError
from meshes.io.export import shown


def refuse_links(folder: Path) -> None:
    """See that a folder of results, if it is there, has no symbolic links in it; it may be one itself.

    Records, pictures and pages are written under names that are known beforehand. A link of such a name in a folder
    from a stranger would have them written over any file of the user.

    Args:
        folder: of the results.

    Raises:
        InputError: the first link, by its name.
    """
    for place, folders, files in os.walk(folder):
        for name in (*folders, *files):
            found = Path(place) / name
            if found.is_symlink():
                raise InputError(
                    f"'{shown(found)}' is a symbolic link, and results are not written through links; remove it"
                )
