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
html{background:#eef1f4;-webkit-text-size-adjust:100%}
body{margin:24px auto;max-width:1020px;padding:32px 44px 48px;background:var(--paper);
 color:var(--ink);font:15px/1.5 system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',
 Arial,sans-serif;box-shadow:0 1px 4px rgba(31,41,51,.15)}
header .kicker{color:var(--soft);font-size:13px;letter-spacing:.02em;margin:0 0 6px}
h1{font-size:22px;line-height:1.35;margin:10px 0 14px;font-weight:650;overflow-wrap:anywhere}
h2{font-size:17px;margin:34px 0 8px;padding-top:14px;border-top:1px solid var(--line)}
h3{font-size:14px;margin:18px 0 6px}
p{margin:6px 0 10px;max-width:80ch;overflow-wrap:anywhere}
.badge{display:inline-block;color:#fff;border-radius:4px;padding:3px 11px;font-size:13px;
 font-weight:650}
dl.facts{display:grid;grid-template-columns:repeat(auto-fill,minmax(170px,1fr));gap:8px 22px;
 margin:14px 0 0;padding:12px 16px;background:var(--tint);border-radius:6px}
dl.facts dt{font-size:12px;color:var(--soft)}
dl.facts dd{margin:0;font-weight:550;overflow-wrap:anywhere;font-variant-numeric:tabular-nums}
figure{margin:10px 0 6px;min-width:0}
figure svg{display:block;max-width:100%;height:auto}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,340px),1fr));
 gap:2px 26px;align-items:start}
.tiles figure{max-width:600px}
.tiles figure svg,figure.tiles svg{width:100%}
.tiles>figcaption{grid-column:1/-1}
figure.graph svg{margin:0 auto}
figure.graph{overflow-x:auto}
figcaption{color:var(--soft);font-size:13px;margin-top:3px;max-width:84ch}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:13.5px;margin:8px 0 12px;
 font-variant-numeric:tabular-nums}
th,td{padding:4px 12px 4px 0;border-bottom:1px solid var(--line);text-align:left;
 vertical-align:top}
thead th{color:var(--soft);font-weight:600;font-size:12.5px;border-bottom:1.5px solid #9aa5b1;
 vertical-align:bottom}
td.n,th.n{text-align:right;white-space:nowrap}
td.w{overflow-wrap:anywhere}
tr.named td{background:#eaf3fb;font-weight:600}
tr.maybe td{background:#f4effd}
tr.quiet td{color:var(--soft)}
.bar{display:block;width:110px;height:9px;margin-top:6px;background:#eef1f4;border-radius:2px}
.bar span{display:block;height:9px;background:#9aa5b1;border-radius:2px}
.bar.winner span{background:#0f6cbd}.bar.alike span{background:#8b5cf6}
.bar.nominal span{background:#d97706}
table.equations{width:auto}
.equations td{border-bottom:0;padding:5px 14px 5px 0;vertical-align:middle}
.equations .why{color:var(--soft);font-size:12.5px}
.equations svg{display:block;height:auto}
.before{color:#9a4a06}.after{color:#0f5ea8}
code,.mono{font:13px/1.5 ui-monospace,'SF Mono',Consolas,'DejaVu Sans Mono',monospace;
 overflow-wrap:anywhere;white-space:pre-wrap}
ul,ol{margin:6px 0 10px;padding-left:22px;max-width:84ch}
li{margin:3px 0;overflow-wrap:anywhere}
details{margin:6px 0 10px}
summary{cursor:pointer;color:#0f5ea8;font-size:13.5px}
.callout{border-left:4px solid #0f6cbd;
 background:#eef5fb;padding:8px 14px;border-radius:0 5px 5px 0}
footer{margin-top:34px;color:var(--soft);font-size:12.5px}
@media (max-width:640px){
 body{margin:0;padding:16px 15px 30px;box-shadow:none}
 h1{font-size:19px}
 dl.facts{grid-template-columns:1fr 1fr;gap:8px 14px;padding:10px 12px}
 table.cards,table.cards tbody,table.cards tr{display:block}
 table.cards thead{display:none}
 table.cards tr{border-bottom:1px solid #9aa5b1;padding:6px 0}
 table.cards td{display:flex;justify-content:space-between;gap:16px;border:0;padding:2px 6px;
  text-align:right;white-space:normal;overflow-wrap:anywhere}
 table.cards td::before{content:attr(data-label);color:var(--soft);font-weight:400;
  text-align:left;flex:0 0 38%}
 table.cards td:first-child{display:block;text-align:left;font-weight:600}
 table.cards td:first-child::before{display:none}
 table.cards td:empty{display:none}
}
@media print{@page{size:A4;margin:14mm}
 html{background:#fff}body{margin:0;padding:0;max-width:none;box-shadow:none;font-size:9.5pt}
 h1{font-size:15pt}h2{font-size:12pt;margin-top:16pt;padding-top:6pt}h3{font-size:10pt}
 table{font-size:8.5pt}th,td{padding:2.5pt 7pt 2.5pt 0}td.n,th.n{white-space:normal}
 .scroll,figure.graph{overflow:visible}
 .tiles{grid-template-columns:1fr 1fr;gap:2pt 12pt}figcaption{font-size:8pt}
 .bar{width:60pt}
 h2,h3{break-after:avoid}figure,tr,.callout,dl.facts,.tiles figure{break-inside:avoid}
 thead{display:table-header-group}
 details::details-content{display:block;content-visibility:visible}summary{list-style:none;color:inherit}
 .badge,tr.named td,tr.maybe td,dl.facts,.callout,.bar,.bar span{
 -webkit-print-color-adjust:exact;print-color-adjust:exact}}
"""
