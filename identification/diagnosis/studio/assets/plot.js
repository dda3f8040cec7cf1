// A plot on a canvas: traces thinned by minimum and maximum of every pixel, points, cells, bands, cursor.
class Plot {
  constructor(host, options) {
    this.o = Object.assign({height: 220, pad: [10, 12, 40, 62], x: '', y: '', said: ''}, options);
    this.lines = []; this.points = null; this.cells = null; this.bands = []; this.levels = [];
    this.view = null; this.home = null; this.cursor = null; this.rect = null; this.inks = {};
    this.canvas = document.createElement('canvas');
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute('role', 'img');
    this.say(this.o.said);
    this.canvas.style.height = this.o.height + 'px';
    host.append(this.canvas);
    this.listen();
    new ResizeObserver(() => this.later()).observe(this.canvas);
  }
  say(text) { this.canvas.setAttribute('aria-label', text); }
  later() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.draw(); });
  }
  // Whole extent of what is drawn.
  extent() {
    const e = [Infinity, -Infinity, Infinity, -Infinity];
    const add = (xs, ys) => {
      for (let i = 0; i < xs.length; i++) {
        const x = xs[i], y = ys[i];
        if (x === x && y === y) {
          if (x < e[0]) e[0] = x;
          if (x > e[1]) e[1] = x;
          if (y < e[2]) e[2] = y;
          if (y > e[3]) e[3] = y;
        }
      }
    };
    for (const l of this.lines) if (l.on !== false) add(l.x, l.y);
    if (this.points) add(this.points.x, this.near(this.points.y));
    if (this.cells) add(this.cells.x, this.cells.y);
    if (this.span) [e[0], e[1]] = this.span;  // of plots that are walked together
    if (!(e[1] > e[0])) { e[0] -= 1; e[1] = e[0] + 2; }
    if (!(e[3] > e[2])) { e[2] -= 1; e[3] = e[2] + 2; }
    const my = 0.06 * (e[3] - e[2]), mx = this.o.fit ? 0 : 0.04 * (e[1] - e[0]);
    return [e[0] - mx, e[1] + mx, e[2] - my, e[3] + my];
  }
  // Of many points a few far off would flatten all others: those are drawn at the edge.
  near(ys) {
    const s = Float64Array.from(ys).filter(v => v === v).sort(), n = s.length;
    const low = s[Math.floor(0.01 * (n - 1))], high = s[Math.ceil(0.99 * (n - 1))], room = high - low;
    this.far = 0;
    if (!this.o.flat || n < 100 || !(s[n - 1] - s[0] > 4 * room)) return ys;
    const off = v => v < low - room || v > high + room;
    this.far = s.filter(off).length;
    return Array.from(ys, v => off(v) ? NaN : v);
  }
  reset() { this.home = this.extent(); this.view = this.home.slice(); this.later(); }
  box() {
    const [t, r, b, l] = this.o.pad;
    return [l, t, Math.max(10, this.canvas.clientWidth - l - r), this.o.height - t - b];
  }
  px(x) { const [l, , w] = this.box(), v = this.view; return l + w * (x - v[0]) / (v[1] - v[0]); }
  py(y) { const [, t, , h] = this.box(), v = this.view; return t + h * (v[3] - y) / (v[3] - v[2]); }
  at(event) {
    const r = this.canvas.getBoundingClientRect(), [l, t, w, h] = this.box(), v = this.view;
    return [v[0] + (v[1] - v[0]) * (event.clientX - r.left - l) / w,
      v[3] - (v[3] - v[2]) * (event.clientY - r.top - t) / h];
  }
  ink(name) {
    return this.inks[name] ??= getComputedStyle(this.canvas).getPropertyValue('--' + name).trim() || name;
  }
  // Course of a line, x in pixels; smallest and largest of each column where they are many.
  course(line) {
    const [l, , w] = this.box(), [x0, x1] = this.view, {x, y} = line, out = [];
    let a = 0, b = x.length;
    if (line.sorted) { a = Math.max(0, Plot.find(x, x0) - 1); b = Math.min(x.length, Plot.find(x, x1) + 2); }
    const k = w / (x1 - x0);
    if (!line.sorted || b - a < 3 * w) {
      for (let i = a; i < b; i++) out.push(l + k * (x[i] - x0), y[i]);
      return out;
    }
    // one bar a column, from the smallest to the largest, joined to the one before
    let column = NaN, low = NaN, high = NaN, last = NaN;
    for (let i = a; i <= b; i++) {
      const c = i < b ? Math.floor(k * (x[i] - x0)) : Infinity, v = y[i];
      if (c !== column) {
        if (low <= high) out.push(l + column, low, l + column, high);
        column = c; low = high = NaN;
        if (last === last) low = high = last;
      }
      if (!(v >= low)) { if (v === v) low = v; }
      if (!(v <= high)) { if (v === v) high = v; }
      last = v;
    }
    out.bars = true;
    return out;
  }
  static find(x, v) {
    let a = 0, b = x.length;
    while (a < b) { const m = (a + b) >> 1; if (x[m] < v) a = m + 1; else b = m; }
    return a;
  }
  draw() {
    const c = this.canvas, ratio = Plot.fine || window.devicePixelRatio || 1, W = c.clientWidth, H = this.o.height;
    if (!W || !this.view) return;
    if (c.width !== Math.round(W * ratio) || c.height !== Math.round(H * ratio)) {
      c.width = Math.round(W * ratio); c.height = Math.round(H * ratio);
    }
    const g = c.getContext('2d'), [l, t, w, h] = this.box();
    this.inks = {};
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, W, H);
    const shown = this.lines.filter(s => s.on !== false), courses = shown.map(s => this.course(s));
    if (this.o.fit) this.fitted(courses);
    g.save(); g.beginPath(); g.rect(l, t, w, h); g.clip();
    if (this.cells) this.heat(g);
    for (const b of this.bands) this.band(g, b);
    g.restore();
    this.axes(g);
    if (this.title) {
      g.fillStyle = this.ink('ink'); g.font = '600 12px system-ui,sans-serif'; g.textAlign = 'left';
      g.fillText(this.title, l, t - 8, w);
    }
    g.save(); g.beginPath(); g.rect(l, t, w, h); g.clip();
    for (const v of this.levels) this.level(g, v);
    shown.forEach((s, i) => s.under && this.line(g, s, courses[i]));
    if (this.points) this.scatter(g);
    shown.forEach((s, i) => s.under || this.line(g, s, courses[i]));
    if (this.cursor != null) {
      const x = this.px(this.cursor);
      g.strokeStyle = this.ink('ink'); g.lineWidth = 1; g.setLineDash([]);
      g.beginPath(); g.moveTo(x, t); g.lineTo(x, t + h); g.stroke();
    }
    if (this.rect) {
      const [a, b, y0, y1] = this.rect, whole = y0 == null;
      const q = [this.px(a), whole ? t : this.py(y1), this.px(b), whole ? t + h : this.py(y0)];
      g.fillStyle = this.ink('pick'); g.globalAlpha = 0.16;
      g.fillRect(q[0], q[1], q[2] - q[0], q[3] - q[1]);
      g.globalAlpha = 1; g.strokeStyle = this.ink('pick'); g.lineWidth = 1.2;
      g.strokeRect(q[0], q[1], q[2] - q[0], q[3] - q[1]);
    }
    g.restore();
  }
  fitted(courses) {
    let low = Infinity, high = -Infinity;
    const [l, , w] = this.box();
    for (const c of courses) for (let i = 1; i < c.length; i += 2) {
      if (c[i - 1] < l - 1 || c[i - 1] > l + w + 1) continue;
      if (c[i] < low) low = c[i];
      if (c[i] > high) high = c[i];
    }
    if (!(high > low)) return;
    const m = 0.06 * (high - low);
    this.view[2] = this.o.floor ?? low - m; this.view[3] = high + m;
  }
  band(g, b) {
    const x0 = this.px(b.from), x1 = Math.max(x0 + 1.5, this.px(b.to)), [, t, , h] = this.box();
    g.globalAlpha = b.alpha ?? 0.5; g.fillStyle = this.ink(b.ink); g.fillRect(x0, t, x1 - x0, h);
    g.globalAlpha = 1;
    if (b.number) {
      g.fillStyle = this.ink('mark'); g.font = 'bold 11px system-ui,sans-serif'; g.textAlign = 'center';
      g.fillText(b.number, (x0 + x1) / 2, t + 11 + 12 * (b.below || 0));
    } else if (b.label && x1 - x0 > 8) {
      g.fillStyle = this.ink('soft'); g.font = '11px system-ui,sans-serif'; g.textAlign = 'left';
      const [l, , w] = this.box(), from = Math.max(x0, l), room = Math.min(x1, l + w) - from - 6;
      if (g.measureText(b.label).width < room) g.fillText(b.label, from + 4, t + 12);
    }
  }
  heat(g) {
    const {x, y, columns, mean, from, to} = this.cells, rows = mean.length / columns;
    const w = (x[1] - x[0]) / columns, h = (y[1] - y[0]) / rows;
    mean.forEach((v, i) => {
      if (v !== v) return;
      const a = this.px(x[0] + w * (i % columns)), b = this.py(y[0] + h * (1 + Math.floor(i / columns)));
      g.fillStyle = Plot.warm((v - from) / (to - from));
      g.fillRect(a, b, this.px(x[0] + w * (1 + i % columns)) - a + 0.5, this.py(y[0] + h * Math.floor(i / columns)) - b + 0.5);
    });
  }
  level(g, v) {
    const [l, , w] = this.box(), y = this.py(v.y);
    g.strokeStyle = this.ink(v.ink || 'soft'); g.lineWidth = 1; g.setLineDash([5, 4]);
    g.beginPath(); g.moveTo(l, y); g.lineTo(l + w, y); g.stroke(); g.setLineDash([]);
  }
  line(g, s, c) {
    g.strokeStyle = this.ink(s.ink); g.lineWidth = s.width || 1.2; g.globalAlpha = s.alpha ?? 1;
    g.setLineDash(s.dash || []); g.lineJoin = 'bevel';
    if (c.bars) {
      const thick = s.width || 1.2;
      g.fillStyle = g.strokeStyle;
      for (let i = 0; i < c.length; i += 4) {
        const top = this.py(c[i + 3]), tall = this.py(c[i + 1]) - top;
        g.fillRect(c[i], top - thick / 2, thick > 1.5 ? 1.5 : 1, tall + thick);
      }
      g.globalAlpha = 1;
      return;
    }
    g.beginPath();
    let pen = false;
    if (s.bars) s.bars.forEach(([a, b], i) => {
      g.moveTo(c[2 * i], this.py(a)); g.lineTo(c[2 * i], this.py(b));
      g.moveTo(c[2 * i] - 2, this.py(s.y[i])); g.lineTo(c[2 * i] + 2, this.py(s.y[i]));
    });
    for (let i = 0; i < c.length; i += 2) {
      const y = c[i + 1];
      if (y !== y) { pen = false; continue; }
      if (s.stem) { g.moveTo(c[i], this.py(0)); g.lineTo(c[i], this.py(y)); continue; }
      if (pen) g.lineTo(c[i], this.py(y)); else g.moveTo(c[i], this.py(y));
      pen = true;
    }
    g.stroke(); g.setLineDash([]); g.globalAlpha = 1;
  }
  scatter(g) {
    const {x, y, hue, picked, near} = this.points, n = x.length, some = picked && picked.includes(1);
    const size = n > 2500 ? 2 : 2.6, [, , low, high] = this.view;
    for (let pass = some ? 0 : 1; pass < 2; pass++) {
      let last = '';
      for (let i = 0; i < n; i++) {
        if (some && picked[i] !== pass) continue;
        const colour = pass || !some ? Plot.hues[hue[i]] : this.ink('faint');
        if (colour !== last) g.fillStyle = last = colour;
        g.fillRect(this.px(x[i]) - size / 2, this.py(Math.min(high, Math.max(low, y[i]))) - size / 2, size, size);
      }
    }
    if (near != null && x[near] === x[near]) {
      g.strokeStyle = this.ink('ink'); g.lineWidth = 2; g.beginPath();
      g.arc(this.px(x[near]), this.py(y[near]), 6, 0, 7); g.stroke();
    }
  }
  axes(g) {
    const [l, t, w, h] = this.box(), v = this.view;
    g.font = '11px system-ui,sans-serif'; g.strokeStyle = this.ink('line'); g.lineWidth = 1;
    g.fillStyle = this.ink('soft'); g.textAlign = 'center';
    if (!this.o.bare) for (const x of Plot.ticks(v[0], v[1], w / 70, this.o.logX)) {
      const p = Math.round(this.px(x)) + 0.5;
      g.beginPath(); g.moveTo(p, t); g.lineTo(p, t + h); g.stroke();
      g.fillText(Plot.text(x, this.o.logX), p, t + h + 15);
    }
    g.textAlign = 'right';
    for (const y of Plot.ticks(v[2], v[3], h / 34, this.o.logY)) {
      const p = Math.round(this.py(y)) + 0.5;
      g.beginPath(); g.moveTo(l, p); g.lineTo(l + w, p); g.stroke();
      g.fillText(Plot.text(y, this.o.logY), l - 6, p + 4);
    }
    g.textAlign = 'center'; g.font = '12px system-ui,sans-serif';
    if (!this.o.bare) g.fillText(this.o.x, l + w / 2, t + h + 33, w);
    g.save(); g.translate(13, t + h / 2); g.rotate(-Math.PI / 2); g.fillText(this.o.y, 0, 0, h + 30); g.restore();
  }
  static ticks(a, b, about, log) {
    const raw = (b - a) / Math.max(2, about), power = 10 ** Math.floor(Math.log10(raw));
    let step = [1, 2, 2.5, 5, 10].find(m => m * power >= raw) * power;
    if (log) step = Math.max(1, Math.round(step));
    const out = [];
    for (let i = Math.ceil(a / step); i * step <= b + 1e-9 * step && out.length < 40; i++) out.push(i * step);
    return out;
  }
  static text(v, log) {
    const n = log ? 10 ** v : v;
    if (Math.abs(n) < 1e-12) return '0';
    const s = Math.abs(n) >= 1e5 || Math.abs(n) < 1e-3 ? n.toExponential(1) : String(+n.toPrecision(6));
    return s.replace('-', '\u2212');
  }
  zoom(factor, middle) {
    const v = this.view, m = middle ?? (v[0] + v[1]) / 2;
    const a = Math.max(this.home[0], m - (m - v[0]) * factor), b = Math.min(this.home[1], m + (v[1] - m) * factor);
    if (b - a > 1e-6 * (this.home[1] - this.home[0])) this.show(a, b);
  }
  pan(share) {
    const v = this.view, d = share * (v[1] - v[0]);
    const s = Math.max(this.home[0] - v[0], Math.min(this.home[1] - v[1], d));
    this.show(v[0] + s, v[1] + s);
  }
  show(a, b) {
    this.view[0] = a; this.view[1] = b; this.later();
    if (this.o.shown) this.o.shown(a, b);
  }
  listen() {
    const c = this.canvas, o = this.o;
    let from = null, moved = false, panned = 0;
    const done = e => {
      if (!from) return;
      const r = moved && this.rect; from = null;
      if (r && o.brushed) o.brushed(r); else if (!moved && o.pointed) o.pointed(this.at(e));
    };
    c.addEventListener('pointerdown', e => {
      if (!this.view || e.button) return;
      from = this.at(e); moved = false; panned = e.clientX;
      try { c.setPointerCapture(e.pointerId); } catch { /* an event that was made up */ }
    });
    c.addEventListener('pointermove', e => {
      if (!this.view) return;
      const p = this.at(e);
      if (!from) { if (o.walked) o.walked(p); return; }
      if (e.shiftKey && o.shown) {
        this.pan(-(e.clientX - panned) / this.box()[2]); panned = e.clientX; moved = false; return;
      }
      const far = Math.abs(this.px(p[0]) - this.px(from[0])) + Math.abs(this.py(p[1]) - this.py(from[1]));
      if (!moved && far < 5) return;
      moved = true;
      if (!o.brushed) return;
      const [x0, x1] = [from[0], p[0]].sort((a, b) => a - b), [y0, y1] = [from[1], p[1]].sort((a, b) => a - b);
      this.rect = o.flat ? [x0, x1, y0, y1] : [x0, x1, null, null];
      this.later();
    });
    c.addEventListener('pointerup', done);
    c.addEventListener('pointercancel', () => { from = null; });
    if (!o.shown) return;
    c.addEventListener('wheel', e => {
      if (!e.ctrlKey && document.activeElement !== c) return; // the page scrolls on
      e.preventDefault(); this.zoom(e.deltaY > 0 ? 1.25 : 0.8, this.at(e)[0]);
    }, {passive: false});
    c.addEventListener('dblclick', () => this.show(this.home[0], this.home[1]));
  }
}
// Pale yellow over orange to dark red, from 0 to 1.
Plot.warm = s => {
  const at = Math.max(0, Math.min(1, s)) * 2, k = Math.min(1, Math.floor(at)), f = at - k;
  const stops = [[255, 246, 196], [253, 141, 60], [128, 0, 38]];
  return `rgb(${stops[k].map((v, i) => Math.round(v + f * (stops[k + 1][i] - v)))})`;
};
Plot.hues = Array.from({length: 64}, (_, i) => {
  // dark blue over teal to yellow, told apart by lightness too
  const s = i / 63, mix = (a, b, c) => Math.round(s < 0.5 ? a + 2 * s * (b - a) : b + (2 * s - 1) * (c - b));
  return `rgb(${mix(58, 20, 234)},${mix(36, 150, 190)},${mix(150, 148, 40)})`;
});
