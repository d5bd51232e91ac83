"""A study on Dask workers in network namespaces of their own: one is killed, one loses its network, in mid-task.

Each namespace has its own interface, addresses and routes, as a host has; all see one folder. Namespaces and the bridge
between them are removed at the end. Needs root on Linux.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tiengine.study.folder import Folder
from tiengine.study.on_dask import Dask
from tiengine.study.study import study
from validation.studies.parts import bits

__all__ = ["measure"]

PLAN: dict[str, Any] = {
    "name": "hosts",
    "scenario": "default",
    "seeds": 2,
    "set": {"train.distance": 20.0, "output.run_in": 2.0, "output.precision": "double"},
    "factors": [{"key": "train.speed_kmh", "name": "speed", "values": [260.0, 280.0, 300.0, 310.0, 320.0, 340.0]}],
}
"""Twelve trains in six tasks."""

BRIDGE, NET, PORT = "tie-br0", "10.213.77", 8786
IMPATIENT = {  # a lost host is given up after seconds instead of minutes
    "DASK_DISTRIBUTED__COMM__TIMEOUTS__TCP": "12s",
    "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "5s",
    "DASK_DISTRIBUTED__SCHEDULER__WORKER_TTL": "15s",
}


@dataclass(frozen=True)
class _Host:
    """Namespace with one worker.

    Attributes:
        name: Name of the namespace.
        cable: Its end of the cable at the bridge.
        process: The worker.
    """

    name: str
    cable: str
    process: subprocess.Popen[bytes]


def measure(folder: Path) -> dict[str, Any]:
    """Run a study at home, on one host, on two, and on three of which two are lost.

    Args:
        folder: New folder.
    """
    folder.mkdir()
    clock = time.perf_counter()
    study(PLAN, folder / "home", workers=1)
    found: dict[str, Any] = {"home": _costs(folder / "home", time.perf_counter() - clock, 1)}
    with _network(folder) as address:
        for count in (1, 2):
            with _hosts(address, count, folder):
                clock = time.perf_counter()
                study(PLAN, folder / f"hosts{count}", place=Dask(address))
                found[f"hosts_{count}"] = _costs(folder / f"hosts{count}", time.perf_counter() - clock, count)
        with _hosts(address, 3, folder) as hosts:
            said: list[str] = []
            breaker = threading.Thread(target=_break, args=(folder / "lost", hosts, said), daemon=True)
            breaker.start()
            study(PLAN, folder / "lost", place=Dask(address), notify=said.append, checkpoint=0.5)
            found["two_of_three_lost"] = {"events": said, "status": dict(Folder.open(folder / "lost").status().rows())}
    home = bits(folder / "home")
    found["same_bits"] = {name: bits(folder / name) == home for name in ("hosts1", "hosts2", "lost")}
    return found


def _costs(folder: Path, wall: float, workers: int) -> dict[str, float]:
    """Wall time, that of the tasks themselves, and the overhead of a task [s]."""
    records = list(Folder.open(folder).records())
    spent = sum(record["wall"] for record in records)
    first = min(record["began"] for record in records)
    last = max(record["ended"] for record in records)
    return {
        "wall": wall,
        "wall_of_tasks": spent,
        "from_first_to_last": last - first,
        "overhead_of_a_task": (workers * (last - first) - spent) / len(records),
    }


def _break(folder: Path, hosts: list[_Host], said: list[str]) -> None:
    """Kill the first host's worker and pull the second's cable as soon as each of them computes."""
    while len(list(folder.glob("parts/*.h5"))) < 3:
        time.sleep(0.05)
    os.killpg(hosts[0].process.pid, signal.SIGKILL)
    said.append(f"{hosts[0].name}: worker killed")
    _ip("link", "set", hosts[1].cable, "down")
    said.append(f"{hosts[1].name}: network cut")


@contextmanager
def _network(folder: Path) -> Iterator[str]:
    """Bridge with a scheduler at its address."""
    _ip("link", "add", BRIDGE, "type", "bridge")
    try:
        _ip("addr", "add", f"{NET}.1/24", "dev", BRIDGE)
        _ip("link", "set", BRIDGE, "up")
        address = f"tcp://{NET}.1:{PORT}"
        options = ["--host", address, "--no-dashboard"]
        process = _dask("scheduler", options, [], folder / "scheduler.txt")
        try:
            yield address
        finally:
            _end(process)
    finally:
        _ip("link", "del", BRIDGE)


@contextmanager
def _hosts(address: str, count: int, folder: Path) -> Iterator[list[_Host]]:
    """Namespaces with a single-threaded worker each."""
    hosts: list[_Host] = []
    names = [f"tie{i}" for i in range(1, count + 1)]
    try:
        for i, name in enumerate(names, start=1):
            _ip("netns", "add", name)
            _ip("link", "add", f"{name}-out", "type", "veth", "peer", "name", "eth0", "netns", name)
            _ip("link", "set", f"{name}-out", "master", BRIDGE, "up")
            for what in (["addr", "add", f"{NET}.{i + 1}/24", "dev", "eth0"], ["link", "set", "eth0", "up"]):
                _ip("-n", name, *what)
            _ip("-n", name, "link", "set", "lo", "up")
            options = [
                address,
                "--nthreads",
                "1",
                "--no-dashboard",
                "--host",
                f"{NET}.{i + 1}",
                "--death-timeout",
                "20",
            ]
            scratch = ["--local-directory", str(folder / f"scratch{i}")]
            inside = ["ip", "netns", "exec", name]
            hosts.append(_Host(name, f"{name}-out", _dask("worker", options + scratch, inside, folder / f"{name}.txt")))
        yield hosts
    finally:
        for host in hosts:
            _end(host.process)
        for name in names:
            _ip("netns", "del", name, check=False)
        time.sleep(1.0)  # the scheduler takes note


def _dask(kind: str, options: list[str], inside: list[str], log: Path) -> subprocess.Popen[bytes]:
    """Start a scheduler or a worker, with the leader's modules."""
    command = [*inside, sys.executable, "-m", "dask", kind, *options]
    paths = os.pathsep.join([str(Path.cwd()), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, **IMPATIENT, "PYTHONPATH": paths}
    with log.open("ab") as file:
        return subprocess.Popen(command, env=environment, stdout=file, stderr=file, start_new_session=True)


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a process with its children."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _ip(*words: str, check: bool = True) -> None:
    subprocess.run(["ip", *words], check=check, capture_output=True)
