"""Contact tables kept on disk: one takes two seconds to build and depends on the profiles and their placement alone.

A file holds the numbers of one table and nothing that could be run. Its name is a digest of all that goes in: points,
settings, the source of the modules that build it, and the versions of NumPy and SciPy. What cannot be read or written
is built anew; nothing depends on the cache but time.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from pathlib import Path
from types import ModuleType
from zipfile import BadZipFile

import numpy as np
import scipy
from platformdirs import user_cache_path

from tiengine.contact import hertz, kalker, profile, profile_frame
from tiengine.contact import search as contact_search
from tiengine.contact import table as contact_geometry
from tiengine.contact.profile import Profile
from tiengine.contact.table import ContactSettings, ContactTable, build_contact_table

__all__ = ["contact_table"]

FOLDER = "TIENGINE_CACHE"
"""Environment variable that names another folder."""
MODULES: tuple[ModuleType, ...] = (contact_geometry, contact_search, hertz, kalker, profile, profile_frame)
FIELDS = ("u_min", "du", "alpha_min", "dalpha", "crown_offset")


def contact_table(wheel: Profile, rail: Profile, settings: ContactSettings) -> ContactTable:
    """The table of a wheel and a rail, from the cache if it is there.

    Args:
        wheel: Wheel profile.
        rail: Rail profile.
        settings: Placement, material, range and smoothing.

    Returns:
        The bits of :func:`tiengine.contact.table.build_contact_table`.

    Raises:
        InputError: As there.
    """
    path = _folder() / f"contact-{_digest(wheel, rail, settings)}.npz"
    with contextlib.suppress(OSError, ValueError, KeyError, EOFError, BadZipFile), open(path, "rb") as file:
        kept = np.load(file, allow_pickle=False)
        numbers = dict(zip(FIELDS, kept["numbers"].tolist(), strict=True))
        return ContactTable(values=kept["values"], settings=settings, **numbers)
    table = build_contact_table(wheel, rail, settings)
    with contextlib.suppress(OSError):
        _write(path, table)
    return table


def _folder() -> Path:
    return Path(os.environ[FOLDER]) if os.environ.get(FOLDER) else user_cache_path("tiengine")


def _digest(wheel: Profile, rail: Profile, settings: ContactSettings) -> str:
    """Of everything that the table depends on."""
    digest = hashlib.sha256(f"{np.__version__} {scipy.__version__} {settings!r}".encode())
    for module in MODULES:
        digest.update(Path(str(module.__file__)).read_bytes())
    for part in (wheel, rail):
        digest.update(f"{part.kind} {part.has_cant} {part.smoothing!r}".encode())
        digest.update(part.y.tobytes() + part.z.tobytes())
    return digest.hexdigest()[:32]


def _write(path: Path, table: ContactTable) -> None:
    """Under another name first, so that no reader sees half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f"{path.stem}-{os.getpid()}.part")
    with open(part, "wb") as file:
        np.savez(file, values=table.values, numbers=[getattr(table, name) for name in FIELDS])
    part.replace(path)
