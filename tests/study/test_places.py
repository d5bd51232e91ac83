"""Dask and submitit give the bits of this machine; workers that do not fit are named."""

from __future__ import annotations

import shutil
import time
from pathlib import Path

import pytest

from tiengine.parameters.errors import InputError
from tiengine.study import on_dask
from tiengine.study.on_dask import Dask
from tiengine.study.on_slurm import Slurm
from tiengine.study.study import Study, study

from .short import PLAN, bits

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning", "ignore::UserWarning")


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    """The study in this process."""
    folder = tmp_path_factory.mktemp("whole") / "study"
    study(PLAN, folder, workers=1)
    return folder


@pytest.fixture(scope="module")
def cluster():
    """A scheduler with one single-threaded worker process."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=50
    ) as cluster:
        yield cluster


def test_dask_has_the_bits_of_this_machine(whole, tmp_path, cluster, monkeypatch):
    """In the shared folder; then with parts that are sent back, as from a machine that does not see it."""
    seen: list[float] = []
    study(PLAN, tmp_path / "shared", place=Dask(cluster.scheduler_address), progress=lambda done, _: seen.append(done))
    assert bits(tmp_path / "shared") == bits(whole)
    assert seen[-1] == 6.0
    monkeypatch.setattr(on_dask, "_see", lambda client, folder: False)
    said: list[str] = []
    study(PLAN, tmp_path / "sent", place=Dask(cluster.scheduler_address), notify=said.append)
    assert bits(tmp_path / "sent") == bits(whole)
    assert "their parts are sent back" in said[0]


def test_dask_continues_what_this_machine_began(whole, tmp_path, cluster):
    """A record is missing: its task is evaluated, the others are left alone."""
    shutil.copytree(whole, tmp_path / "s")
    (tmp_path / "s" / "records" / "00001.json").unlink()
    (tmp_path / "s" / "parts" / "00001.h5").unlink()
    Study.open(tmp_path / "s").resume(place=Dask(cluster.scheduler_address))
    assert bits(tmp_path / "s") == bits(whole)


def test_a_worker_with_another_version_is_named(tmp_path, cluster, monkeypatch):
    """Its address and both versions, before the first task."""
    own = on_dask.metadata.version
    monkeypatch.setattr(on_dask.metadata, "version", lambda name: "9.9" if name == "tiengine" else own(name))
    with pytest.raises(InputError, match=r"worker tcp://\S+ has tiengine \S+; must be 9\.9 as here"):
        study(PLAN, tmp_path / "s", place=Dask(cluster.scheduler_address))


def test_a_worker_with_two_threads_is_named(tmp_path):
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None, silence_logs=50
        ) as cluster,
        pytest.raises(InputError, match="has 2 threads; must have one"),
    ):
        study(PLAN, tmp_path / "s", place=Dask(cluster.scheduler_address))


def test_an_unreachable_scheduler_is_refused_within_ten_seconds(tmp_path):
    pytest.importorskip("distributed")
    clock = time.monotonic()
    with pytest.raises(InputError, match=r"--dask tcp://127\.0\.0\.1:9: no scheduler can be reached"):
        study(PLAN, tmp_path / "s", place=Dask("tcp://127.0.0.1:9"))
    assert time.monotonic() - clock < 10.0


def test_submitit_has_the_bits_of_this_machine(whole, tmp_path):
    """Two jobs of its local executor."""
    pytest.importorskip("submitit")
    study(PLAN, tmp_path / "s", place=Slurm(jobs=2, cluster="local"))
    assert bits(tmp_path / "s") == bits(whole)


def test_a_machine_without_slurm_is_told(tmp_path):
    pytest.importorskip("submitit")
    if shutil.which("sbatch"):
        pytest.skip("there is a Slurm here")
    with pytest.raises(InputError, match="--slurm: jobs cannot be submitted"):
        study(PLAN, tmp_path / "s", place=Slurm())
