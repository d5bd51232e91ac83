"""Disk cache of contact tables: a table takes two seconds to build and depends on profiles and placement only.

A file holds the numbers of one table and nothing executable. Its name is a digest of all inputs: points, settings, the
source of the modules that build the table, and the versions of NumPy and SciPy. A file that cannot be read or written
is ignored and the table is built again; the cache affects computing time only.
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

from tiengine.contact import branches, hertz, kalker, profile, slot_geometry, smoothing
from tiengine.contact import search as contact_search
from tiengine.contact import table as contact_geometry
from tiengine.contact.profile import Profile
from tiengine.contact.table import ContactSettings, ContactTable, build_contact_table
from tiengine.parameters.cache_folders import table_folder

__all__ = ["contact_table"]

MODULES: tuple[ModuleType, ...] = (
    contact_geometry, contact_search, branches, slot_geometry, hertz, kalker, profile, smoothing,
)  # fmt: skip
FIELDS = ("u_min", "du", "alpha_min", "dalpha", "crown_offset")


def contact_table(wheel: Profile, rail: Profile, settings: ContactSettings) -> ContactTable:
    """Contact table of a wheel and a rail, read from the cache where present.

    Args:
        wheel: Wheel profile.
        rail: Rail profile.
        settings: Placement, material, range and smoothing.

    Returns:
        The same bits as :func:`tiengine.contact.table.build_contact_table`.

    Raises:
        InputError: As :func:`tiengine.contact.table.build_contact_table`.
    """
    path = table_folder() / f"contact-{_digest(wheel, rail, settings)}.npz"
    with contextlib.suppress(OSError, ValueError, KeyError, EOFError, BadZipFile), open(path, "rb") as file:
        kept = np.load(file, allow_pickle=False)
        numbers = dict(zip(FIELDS, kept["numbers"].tolist(), strict=True))
        return ContactTable(values=kept["values"], settings=settings, **numbers)
    table = build_contact_table(wheel, rail, settings)
    with contextlib.suppress(OSError):
        _write(path, table)
    return table


def _digest(wheel: Profile, rail: Profile, settings: ContactSettings) -> str:
    """Digest of everything the table depends on, 32 hexadecimal digits."""
    digest = hashlib.sha256(f"{np.__version__} {scipy.__version__} {settings!r}".encode())
    for module in MODULES:
        digest.update(Path(str(module.__file__)).read_bytes())
    for part in (wheel, rail):
        digest.update(f"{part.kind} {part.has_cant} {part.smoothing!r}".encode())
        digest.update(part.y.tobytes() + part.z.tobytes())
    return digest.hexdigest()[:32]


def _write(path: Path, table: ContactTable) -> None:
    """Write a table under a temporary name and rename it, so that no reader sees half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f"{path.stem}-{os.getpid()}.part")
    with open(part, "wb") as file:
        np.savez(file, values=table.values, numbers=[getattr(table, name) for name in FIELDS])
    part.replace(path)
