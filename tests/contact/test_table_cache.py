"""The cache of contact tables: the same bits, another file for other input, no harm from a broken one."""

import numpy as np
import pytest

from tiengine.contact import table_cache as contact_cache
from tiengine.contact.profile import load_profile
from tiengine.contact.table import ContactSettings, build_contact_table
from tiengine.contact.table_cache import contact_table

COARSE = ContactSettings(du=5e-5, dalpha=2e-3, smoothing=0.0)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("TIENGINE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def profiles():
    return load_profile("LMA", "wheel"), load_profile("CHN60", "rail")


def test_same_bits_and_no_second_build(folder, profiles, monkeypatch):
    built = build_contact_table(*profiles, COARSE)
    first = contact_table(*profiles, COARSE)
    monkeypatch.setattr(contact_cache, "build_contact_table", lambda *rest: pytest.fail("built again"))
    second = contact_table(*profiles, COARSE)
    for table in (first, second):
        np.testing.assert_array_equal(table.values, built.values)
        assert (table.u_min, table.du, table.crown_offset) == (built.u_min, built.du, built.crown_offset)
        assert table.settings == COARSE
    assert len(list(folder.iterdir())) == 1


def test_other_input_is_another_file(folder, profiles):
    contact_table(*profiles, COARSE)
    other = contact_table(*profiles, COARSE.model_copy(update={"cant": 0.05}))
    assert len(list(folder.iterdir())) == 2
    assert other.settings.cant == 0.05


@pytest.mark.parametrize("content", [b"", b"no table", b"PK\x03\x04 cut short"])
def test_broken_file_is_built_anew(folder, profiles, content):
    built = contact_table(*profiles, COARSE)
    (file,) = folder.iterdir()
    file.write_bytes(content)
    np.testing.assert_array_equal(contact_table(*profiles, COARSE).values, built.values)
    assert file.stat().st_size > len(content)


def test_no_folder_no_harm(tmp_path, profiles, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    monkeypatch.setenv("TIENGINE_CACHE", str(blocked))
    assert np.isfinite(contact_table(*profiles, COARSE).values).all()
