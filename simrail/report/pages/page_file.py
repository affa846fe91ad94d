"""Where a page of a part is written, with one message if it cannot be."""

from __future__ import annotations

from pathlib import Path

from simrail.core.errors import InputError


def write_page(folder: Path, name: str, text: str) -> Path:
    """Write ``<folder>/<name>.html`` and return its path; the folder is made if it is not there.

    Raises
    ------
    InputError
        If the folder is a file, or cannot be written.
    """
    path = folder / f"{name}.html"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(
            f"the page cannot be written: {error.strerror or error}",
            field="--out",
            value=str(folder),
            limit="a folder that can be written",
            remedy="choose another folder with --out",
        ) from error
    return path
