"""Colours and style sheet of the report; every figure and table takes them from here."""

from __future__ import annotations

from typing import Any

MEASURED = "#1f2933"
BEFORE = "#d97706"
AFTER = "#0f6cbd"
FLOOR = "#6b7280"
BAND = "#cbd5e1"
MUTED = "#9aa5b1"
LOST = "#b8c2cc"

BADGES = {
    "explained": ("nothing is missing", "#15803d"),
    "parameters_only": ("only parameter values", "#0f766e"),
    "missing_physics": ("missing physics", "#c2410c"),
    "unknown_physics": ("unknown physics", "#6d28d9"),
    "insufficient_data": ("insufficient data", "#52606d"),
}

# matplotlib types the keys as literals
PLOT: Any = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.edgecolor": "#7b8794",
    "axes.labelcolor": MEASURED,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "axes.formatter.use_mathtext": False,
    "axes.formatter.limits": (-4, 5),
    "grid.color": "#e4e7eb",
    "grid.linewidth": 0.6,
    "xtick.color": "#3e4c59",
    "ytick.color": "#3e4c59",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.2,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "mathtext.fontset": "cm",
    "path.simplify": True,
    "path.simplify_threshold": 0.2,
}

CSS = """
:root{--ink:#1f2933;--soft:#52606d;--line:#d5dbe1;--paper:#fff;--tint:#f5f7fa}
*{box-sizing:border-box}
html{background:#eef1f4}
body{margin:24px auto;max-width:980px;padding:32px 44px 48px;background:var(--paper);
 color:var(--ink);font:15px/1.5 system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',
 Arial,sans-serif;box-shadow:0 1px 4px rgba(31,41,51,.15)}
header .kicker{color:var(--soft);font-size:13px;letter-spacing:.02em;margin:0 0 6px}
h1{font-size:22px;line-height:1.35;margin:10px 0 14px;font-weight:650;overflow-wrap:anywhere}
h2{font-size:17px;margin:38px 0 8px;padding-top:14px;border-top:1px solid var(--line)}
h3{font-size:14px;margin:20px 0 6px}
p{margin:6px 0 10px;max-width:76ch;overflow-wrap:anywhere}
.badge{display:inline-block;color:#fff;border-radius:4px;padding:3px 11px;font-size:13px;
 font-weight:650}
dl.facts{display:grid;grid-template-columns:repeat(auto-fit,minmax(190px,1fr));gap:8px 22px;
 margin:14px 0 0;padding:12px 16px;background:var(--tint);border-radius:6px}
dl.facts dt{font-size:12px;color:var(--soft)}
dl.facts dd{margin:0;font-weight:550;overflow-wrap:anywhere;font-variant-numeric:tabular-nums}
figure{margin:12px 0 6px}
figure svg{display:block;max-width:100%;height:auto}
figure.graph svg{margin:0 auto}
figcaption{color:var(--soft);font-size:13px;margin-top:4px;max-width:82ch}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:13.5px;margin:8px 0 12px;
 font-variant-numeric:tabular-nums}
th,td{padding:4px 10px 4px 0;border-bottom:1px solid var(--line);text-align:left;
 vertical-align:top}
thead th{color:var(--soft);font-weight:600;font-size:12.5px;border-bottom:1.5px solid #9aa5b1}
td.n,th.n{text-align:right;white-space:nowrap}
td.w{overflow-wrap:anywhere}
tr.named td{background:#eaf3fb;font-weight:600}
tr.maybe td{background:#f4effd}
tr.quiet td{color:var(--soft)}
table.equations{width:auto}
.equations td{border-bottom:0;padding:5px 14px 5px 0;vertical-align:middle}
.equations .why{color:var(--soft);font-size:12.5px}
.equations svg{display:block;height:auto}
.before{color:#b45309}.after{color:#0f5ea8}
code,.mono{font:13px/1.5 ui-monospace,'SF Mono',Consolas,'DejaVu Sans Mono',monospace;
 overflow-wrap:anywhere;white-space:pre-wrap}
ul{margin:6px 0 10px;padding-left:20px}
li{margin:3px 0;overflow-wrap:anywhere}
.callout{border-left:4px solid #0f6cbd;
 background:#eef5fb;padding:8px 14px;border-radius:0 5px 5px 0}
footer{margin-top:34px;color:var(--soft);font-size:12.5px}
@media (max-width:700px){body{margin:0;padding:18px}}
@media print{@page{size:A4;margin:15mm}
 html{background:#fff}body{margin:0;padding:0;max-width:none;box-shadow:none;font-size:10.5pt}
 h2,h3{break-after:avoid}figure,tr,.callout,dl.facts{break-inside:avoid}
 thead{display:table-header-group}
 .badge,tr.named td,tr.maybe td,dl.facts,.callout{-webkit-print-color-adjust:exact;
 print-color-adjust:exact}}
"""
