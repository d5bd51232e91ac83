"""Damaged and forged checkpoints: cut, changed, with false facts, with false sizes."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st

from tiengine.parameters.errors import InputError
from tiengine.result_files.checkpoint import Checkpoint, checkpoint_path, sealed

from ..fuzzing import DAMAGES, EXAMPLES, ODD, Damage, mutated_texts, on_many, refused

RANDOM = np.random.default_rng(1)
ARRAYS = {
    "state.motion": RANDOM.normal(size=(5, 7)),
    "state.iterations": np.arange(6),
    "watch.since": np.ones((1, 4, 2)),
}
FACTS: dict[str, Any] = {
    "done": 3000,
    "position": 21.5,
    "loop": 0.7,
    "speed": 97.2,
    "first_seat": 12,
    "first_slab": 1,
    "steps": [3000],
    "alive": [0],
    "stopped": {},
    "rows": {"0": {"wheel": 3000, "body": 600}},
}


def checkpoint(folder: Path) -> Path:
    Checkpoint(0, FACTS, ARRAYS).write(folder / "run.h5")
    return checkpoint_path(folder / "run.h5", 0)


def same(found: Checkpoint) -> bool:
    return (
        {key: found.facts[key] for key in FACTS} == FACTS
        and found.arrays.keys() == ARRAYS.keys()
        and all(found.arrays[name].tobytes() == ARRAYS[name].tobytes() for name in ARRAYS)
    )


@EXAMPLES
def test_changed_bytes(examples: int, tmp_path: Path) -> None:
    """A changed checkpoint is refused, or has the same facts and bits: every relevant byte is under a checksum."""
    path = checkpoint(tmp_path)
    content = path.read_bytes()

    def check(damage: Damage) -> bool:
        path.write_bytes(damage.of(content))
        found: list[Checkpoint] = []
        message = refused(lambda: found.append(Checkpoint.read(path)))
        if message is None:
            assert same(found[0])
        else:
            assert path.name in message
        return message is not None

    on_many(examples, DAMAGES, check)


@EXAMPLES
def test_forged_facts(examples: int, tmp_path: Path) -> None:
    """Facts that are no JSON or have impossible values, in an undamaged archive, are refused."""
    path = checkpoint(tmp_path)
    good = json.dumps({"version": 1, "made_by": {}, "task": 0, **FACTS})
    odd = st.dictionaries(
        st.sampled_from(["version", "made_by", "task", *FACTS]),
        st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5), st.lists(st.integers())),
        min_size=1,
        max_size=2,
    )

    def check(text: str) -> bool:
        archived = io.BytesIO()
        np.savez(archived, facts=np.frombuffer(text.encode(errors="surrogatepass"), np.uint8), **ARRAYS)
        path.write_bytes(sealed(archived.getvalue()))
        found: list[Checkpoint] = []

        def read() -> None:
            found.append(Checkpoint.read(path))
            found[0].check(str(path))

        message = refused(read)
        if message is None:
            facts = found[0].facts
            assert type(facts["done"]) is int
            assert np.isfinite([facts["position"], facts["speed"], facts["loop"]]).all()
        return message is not None

    texts = st.one_of(mutated_texts(good), odd.map(lambda o: json.dumps(json.loads(good) | o)), st.sampled_from(ODD))
    on_many(examples, texts, check)


def npy(shape: str, dtype: str = "'<f8'", order: str = "False") -> bytes:
    """Array file with an arbitrary header."""
    header = f"{{'descr': {dtype}, 'fortran_order': {order}, 'shape': {shape}, }}".encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + bytes(64)


@pytest.mark.parametrize(
    ("header", "why"),
    [
        (npy("(1000000000000000,)"), "claims"),
        (npy("(-1,)"), "negative"),
        (npy("(9223372036854775807, 9223372036854775807)"), "overflow"),
        (npy("(8,)", "'|O'"), "objects, which numpy would unpickle"),
        (npy("(8,)", "[('a', '|O')]"), "objects in a record"),
        (npy("(8,)", "__import__('os').system('false')"), "code"),
        (npy("(8,)", "'<f8'", "[" * 30 + "]" * 30), "nested"),
        (b"\x93NUMPY\x09\x09" + bytes(100), "version"),
        (b"", "empty"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_forged_arrays(header: bytes, why: str, tmp_path: Path) -> None:
    """An array's header is accepted only if the file has the bytes for it."""
    path = tmp_path / ".run.h5.0000.checkpoint"
    forged = io.BytesIO()
    with zipfile.ZipFile(forged, "w") as archive:
        archive.writestr("state.motion.npy", header)
    path.write_bytes(sealed(forged.getvalue()))
    message = refused(lambda: Checkpoint.read(path))
    assert message is not None, why
    assert "not a checkpoint, or damaged" in message


def test_archive_bombs(tmp_path: Path) -> None:
    """Compressed members are not unpacked; sizes in the archive's directory are compared with the file's size."""
    path = tmp_path / ".run.h5.0000.checkpoint"
    bomb = io.BytesIO()
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("facts.npy", npy("(200000000,)") + bytes(200_000_000))
    path.write_bytes(sealed(bomb.getvalue()))
    assert path.stat().st_size < 1_000_000
    message = refused(lambda: Checkpoint.read(path))
    assert message is not None
    assert "compressed" in message
    plain = io.BytesIO()
    with zipfile.ZipFile(plain, "w") as archive:
        archive.writestr("facts.npy", npy("(8,)"))
    size = len(npy("(8,)")).to_bytes(4, "little")
    path.write_bytes(sealed(plain.getvalue().replace(size, (2**31 - 1).to_bytes(4, "little"))))
    message = refused(lambda: Checkpoint.read(path))
    assert message is not None
    assert "declares more data" in message


def test_a_damaged_checkpoint_says_what_to_do(tmp_path: Path) -> None:
    """The run can be resumed without the damaged checkpoint."""
    path = checkpoint(tmp_path)
    path.write_bytes(path.read_bytes()[:-30])
    with pytest.raises(InputError, match=r"0000\.checkpoint: not a checkpoint, or damaged .*; remove it to run"):
        Checkpoint.read(path)
