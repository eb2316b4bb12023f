"""Turn the figures of `benchmarks/roofline.py` into docs/explanation/roofline.md and its plot."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from continuair.vehicle.layout import ONE_SECTION

LOGGED = 8 * ONE_SECTION.log / 10
"""Bytes of memory per step, float64: a row of the log every ten steps."""
TEMPLATE = Path(__file__).with_name("roofline.md.in")
SIZE = {"float64": 8, "float32": 4}
COLOURS = {"coupled": "#0b6e99", "decoupled": "#d9822b", "independent": "#7a8790"}


def write(result: dict[str, Any], docs: Path) -> None:
    """Write the page and the plot."""
    page = TEMPLATE.read_text()
    known = next(iter(result["counts"].values()))["known"]
    timed = result.get("timed_counts", result["counts"])
    card = json.loads(TEMPLATE.with_name("gpu.json").read_text())
    parts = {
        "MACHINE": f"{result['when']} on {result['machine']}",
        "KNOWN": "; ".join(f"{what}: {found}" for what, (found, _) in known.items()),
        "COUNTS": _counts(result["counts"]),
        "PEAKS": _peaks(result),
        "TIMED": _timed(result) if "timed_counts" in result else "",
        "REACHED": _reached(result, timed),
        "DISKS": _disks(result["disks"]),
        "BATCHES": _batches(result["batches"]),
        "ROW": f"{8 * ONE_SECTION.log}",
        "LOGGED": f"{LOGGED:.3g}",
        "COPY": f"{result['copy'] / 1e9:.3g}",
        "CARD": f"{card['when']}, {card['device']}, Warp {card['warp']}",
        "CARDCOPY": f"{card['copy'] / 1e12:.2g}",
        "CARDRATES": _rates(card),
        "CARDCALLS": _calls(card),
    }
    for name, text in parts.items():
        page = page.replace(f"@{name}@", text)
    (docs / "explanation" / "roofline.md").write_text(page)
    _plot(result, timed, docs / "images" / "roofline.png")


def _table(head: list[str], rows: list[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _counts(counts: dict[str, Any]) -> str:
    rows = []
    for model, count in counts.items():
        kinds = [f"{count['distinct'].get(kind, 0):.4g}" for kind in ("mul", "add", "div", "sqrt")]
        sizes = [f"{count[name]:,.0f}" for name in ("flops", "flops_written", "loads")]
        rows.append([model, *kinds, *sizes])
    head = ["model", "×", "+ and −", "÷", "√", "operations", "as written", "numbers loaded"]
    return _table(head, rows)


def _peaks(result: dict[str, Any]) -> str:
    rows = []
    for precision, peak in result["peaks"].items():
        rows.append([precision, *(f"{peak[kind] / 1e9:.3g}" for kind in ("scalar", "vector"))])
    return _table(["one core", "scalar [Gflop/s]", "vector [Gflop/s]"], rows)


def _timed(result: dict[str, Any]) -> str:
    """What was timed, where it is not what is counted now."""
    counts = result["timed_counts"].items()
    numbers = ", ".join(f"{count['flops']:,.0f} {model}" for model, count in counts)
    return f"""
**The table counts later kernels than those that were timed on {result["when"]}.** Rates below
follow from what was counted then: {numbers}.
"""


def _reached(result: dict[str, Any], timed: dict[str, Any]) -> str:
    rows = []
    for precision, seconds in result["seconds"].items():
        for model, time in seconds.items():
            count, peak = timed[model], result["peaks"][precision]
            rate = count["flops"] / time
            rows.append(
                [
                    f"{model}, {precision}",
                    f"{1e6 * time:.3f}",
                    f"{rate / 1e9:.3g}",
                    f"{100 * rate / peak['scalar']:.0f} %",
                    f"{100 * rate / peak['vector']:.0f} %",
                    f"{SIZE[precision] * count['loads'] / time / 1e9:.3g}",
                ]
            )
    head = ["one run", "µs per RK4 step", "Gflop/s", "of the scalar peak", "of the vector peak"]
    return _table([*head, "loads from L1 [GB/s]"], rows)


def _disks(disks: list[dict[str, float]]) -> str:
    rows = [
        [f"{d['disks']:.0f}", f"{1e6 * d['step']:.3f}", f"{1e3 * d['packing']:.2g}"] for d in disks
    ]
    return _table(["disks", "µs per RK4 step", "packing on the host, once [ms]"], rows)


def _batches(batches: list[dict[str, float]]) -> str:
    threads = [name for name in batches[0] if name != "runs"]
    rows = [[f"{b['runs']}", *(f"{1e6 * b[n]:.3f}" for n in threads)] for b in batches]
    head = [f"{n} thread{'s' if n != '1' else ''} [µs per run and step]" for n in threads]
    return _table(["runs", *head], rows)


def _rates(found: dict[str, Any]) -> str:
    """Steps per second on a card, as `benchmarks/gpu.py` found them."""
    cases = found["cases"]
    best = [
        [
            f"{case['model']}, {case['dtype']}",
            *(_millions(batch["rate"]) for batch in case["batches"]),
            f"{fastest * case['operations'] / 1e12:.3g}",
            f"{case['peak'] / 1e12:.3g}",
            f"{100 * fastest * case['operations'] / case['peak']:.0f} %",
        ]
        for case in cases
        for fastest in [max(batch["rate"] for batch in case["batches"])]
    ]
    sizes = [f"{batch['runs']:,}" for batch in cases[0]["batches"]]
    head = ["million steps per second, runs:", *sizes, "Tflop/s", "peak", "of it"]
    return _table(head, best)


def _calls(found: dict[str, Any]) -> str:
    rows = [[f"{c['runs']:,}", f"{c['device']:.2f}", f"{c['cpu']:.2f}"] for c in found["calls"]]
    beside = f"on {found['cores']} threads of the CPU beside it [s]"
    return _table(["vehicles", "on the card [s]", beside], rows)


def _millions(rate: float) -> str:
    return f"{rate / 1e6:,.0f}" if rate > 1e8 else f"{rate / 1e6:.3g}"


def _plot(result: dict[str, Any], timed: dict[str, Any], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import numpy as np
    from matplotlib import pyplot

    peak = result["peaks"]["float64"]
    intensity = np.geomspace(0.05, 1000, 200)
    figure, axes = pyplot.subplots(figsize=(6.4, 3.6), layout="constrained")
    roof = np.minimum(intensity * result["copy"], peak["vector"]) / 1e9
    axes.loglog(intensity, roof, color="#444444", label="memory, then vector arithmetic")
    axes.axhline(peak["scalar"] / 1e9, color="#444444", ls="--", lw=1, label="scalar arithmetic")
    for model, seconds in result["seconds"]["float64"].items():
        count = timed[model]
        axes.plot(
            count["flops"] / LOGGED,
            count["flops"] / seconds / 1e9,
            "o",
            color=COLOURS[model],
            label=model,
        )
    axes.set_xlabel("operations per byte of memory")
    axes.set_ylabel("Gflop/s, one core, float64")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(fontsize=8, frameon=False)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


if __name__ == "__main__":
    root = Path(__file__).parents[1]
    source = Path(sys.argv[1]) if len(sys.argv) > 1 else root / "benchmarks" / "roofline.json"
    write(json.loads(source.read_text()), root / "docs")
