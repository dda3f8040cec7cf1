"""Seconds of a drawing's layout, and of a redraw in the studio."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from bondgraph.drawing.layout import layout
from identification.diagnosis.studio.page import asset
from tests.benchmarks.bounds import Measured, best, judged
from tests.bondgraph.drawing.test_draw_overlap import chain, random_graph

REDRAW = """<body><div id="h" style="width:1200px"></div><script>PLOT
const n = 20000, x = Float64Array.from({length: n}, (_, i) => i / 1000), took = [];
const plot = new Plot(document.getElementById('h'), {height: 270, fit: true});
plot.lines = [0, 1, 2].map(k => ({x, sorted: true, ink: 'black',
  y: Float32Array.from(x, t => Math.sin(9 * t + k) + 0.1 * Math.sin(977 * t))}));
plot.reset();
for (let i = 0; i < 9; i++) {
  plot.view[0] = i % 2; plot.view[1] = 20 - i % 2;
  const begin = performance.now();
  plot.draw(); plot.canvas.getContext('2d').getImageData(0, 0, 1, 1);
  took.push(performance.now() - begin);
}
document.body.append(`median ${took.sort((a, b) => a - b)[4]} ms`);
</script></body>"""
"""Three traces of 20,000 samples, zoomed out and in, nine times."""


def redrawn() -> Iterator[Measured]:
    """Yield the median redraw of the studio in a browser, if there is one."""
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    if program is None:
        return
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "redraw.html"
        page.write_text(REDRAW.replace("PLOT", asset("plot.js")), encoding="utf-8")
        done = subprocess.run(
            [program, "--headless", "--no-sandbox", "--disable-gpu", "--window-size=1400,1000",
             f"--user-data-dir={folder}/profile", "--dump-dom", page.as_uri()],
            capture_output=True, text=True, check=True,
        )  # fmt: skip
    found = re.search(r"median ([\d.]+) ms</body>", done.stdout)
    assert found is not None, done.stdout[-300:]
    yield Measured("studio: 3 traces of 20,000 samples redrawn", 1e-3 * float(found[1]), 0.05)


def measured() -> Iterator[Measured]:
    """Sixty elements with rings and signals; chains, the longer with five times the elements."""
    yield Measured("random graph of 60 elements", best(lambda: layout(random_graph(39)), 2), 1.0)
    small, large = (best(lambda n=n: layout(chain(n)), 2) for n in (17, 83))  # type: ignore[misc]
    yield Measured("chain of 500 elements", large, 2.0)
    yield Measured("the same by its share of a fifth", large, 15.0 * max(small, 0.01))
    yield from redrawn()


def main() -> int:
    """Print; 1 beyond a bound."""
    return judged(measured())


if __name__ == "__main__":
    sys.exit(main())
