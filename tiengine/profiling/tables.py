"""Tables of a profile for the screen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table

from tiengine.profiling.report import Comparison, ProfileReport, Rate

__all__ = ["comparison_table", "report_tables"]


def report_tables(report: ProfileReport) -> RenderableType:
    """Facts, stages and rates of a report."""
    facts = Table(box=None, show_header=False, pad_edge=False)
    facts.add_column(no_wrap=True)
    facts.add_column(overflow="fold")
    for name, text in _facts(report):
        facts.add_row(name, escape(text))
    return Group(facts, "", _stages(report), "", _rates(report))


def comparison_table(comparison: Comparison, names: Sequence[str]) -> RenderableType:
    """Two reports side by side.

    Args:
        comparison: Their rows.
        names: Names of the first and the second.
    """
    table = Table(box=None, pad_edge=False)
    table.add_column("")
    for name in (*map(escape, names), "ratio b/a"):
        table.add_column(name, justify="right", overflow="fold")
    for name, a, b in comparison.rows:
        ratio = "-" if not a or b is None else f"{b / a:.3f}"
        table.add_row(escape(name), *("-" if x is None else f"{x:.3f}" for x in (a, b)), ratio)
    return Group(table, *(f"not measured alike: {escape(words)}" for words in comparison.differences))


def _facts(report: ProfileReport) -> Iterator[tuple[str, str]]:
    """Circumstances of the measurement and numbers of the whole loop."""
    machine, wall, loop, memory, roofs = report.machine, report.wall, report.loop, report.memory, report.roofs
    yield "scenario", f"{report.scenario}, {report.dofs} DOFs a train, {report.passes} passes"
    yield "trains", str(report.trains)
    yield "steps", f"{report.steps} of {report.time_step_s:g} s after {report.warm_up_steps} to warm up"
    yield "versions", ", ".join(f"{name} {version}" for name, version in report.versions.items())
    caches = ", ".join(
        f"L{level} {_size(size)}"
        for level, size in enumerate((machine.l1_bytes, machine.l2_bytes, machine.l3_bytes), start=1)
        if size
    )
    yield (
        "machine",
        f"{machine.cpu}, {machine.cores} cores, {caches or 'caches unknown'}, {_size(machine.memory_bytes)}",
    )
    yield "BLAS", f"{machine.blas}, one thread"
    yield "wall time, import", f"{wall.import_s:.2f} s"
    yield "wall time, JIT", f"{wall.jit_s:.2f} s, of which {wall.code_generation_s:.2f} s generating code"
    yield "wall time, set-up", f"{wall.setup_s:.2f} s"
    yield "real-time factor", f"{loop.real_time_factor:.3f} ({loop.real_time_factor_per_train:.3f} per train)"
    yield "steps per second", f"{loop.steps_per_s:.0f}"
    percentiles = (loop.step_us_p50, loop.step_us_p90, loop.step_us_p99, loop.step_us_max)
    yield "steps at once, p50 p90 p99 max", f"{' '.join(f'{x:.1f}' for x in percentiles)} us"
    yield (
        "overhead of measuring",
        f"{100.0 * loop.measuring_overhead:+.1f} % (timers in the step, against none, in turn)",
    )
    yield (
        "memory",
        (
            f"peak {memory.peak_mb:.1f} MB, model {memory.model_mb:.2f}, state {memory.state_mb:.2f},"
            f" buffers {memory.chunk_mb:.2f} MB"
        ),
    )
    products = f"dgemm {roofs.dgemm_gflops:.1f}, small dgemm {roofs.small_dgemm_gflops:.1f} GFLOP/s"
    triads = f"triad L2 {roofs.triad_l2_gb_per_s:.1f}, DRAM {roofs.triad_dram_gb_per_s:.1f} GB/s"
    yield "roofs, one core", f"{products}; gemv {roofs.gemv_gb_per_s:.1f}, {triads}"


def _stages(report: ProfileReport) -> Table:
    """Stages of the step; estimates marked."""
    table = Table(box=None, pad_edge=False, caption="~ estimated: part of a fused launch", caption_justify="left")
    table.add_column("stage")
    for name in ("calls/step", "us/train-step", "share"):
        table.add_column(name, justify="right")
    for stage in report.stages:
        mark = "~" if stage.estimated else ""
        time = f"{mark}{stage.us_per_train_step:.2f}"
        table.add_row(escape(stage.name), f"{stage.calls_per_step:.3g}", time, f"{100.0 * stage.share:.1f} %")
    table.add_section()
    table.add_row("loop, writing included", "", f"{report.loop.us_per_train_step:.2f}", "100.0 %")
    return table


def _rates(report: ProfileReport) -> Table:
    """Achieved rates of the matrix products."""
    table = Table(box=None, pad_edge=False)
    table.add_column("matrix products of")
    for name in ("kflop/step", "kB/step", "GFLOP/s", "GB/s", "of roof"):
        table.add_column(name, justify="right")
    for rate in report.rates:
        table.add_row(rate.stage, *_rate(rate))
    return table


def _rate(rate: Rate) -> tuple[str, ...]:
    numbers = (rate.flops_per_step / 1e3, rate.bytes_per_step / 1e3, rate.gflops, rate.gb_per_s)
    return (*(f"{x:.1f}" for x in numbers), f"{100.0 * rate.of_roof:.0f} %")


def _size(count: float) -> str:
    """Format a number of bytes."""
    for unit in ("B", "KiB", "MiB"):
        if count < 1024.0:
            return f"{count:.4g} {unit}"
        count /= 1024.0
    return f"{count:.4g} GiB"
