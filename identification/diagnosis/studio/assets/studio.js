// The studio: graph, law plane, recording and what is left, joined by one cursor and one selection.
const $ = id => document.getElementById(id);
const data = JSON.parse($('data').textContent);

function bytes(text) {
  const raw = atob(text), out = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
  return out.buffer;
}
const floats = text => new Float32Array(bytes(text)), doubles = text => new Float64Array(bytes(text));
const made = (tag, text, parent) => {
  const e = document.createElement(tag);
  e.textContent = text;
  if (parent) parent.append(e);
  return e;
};
const short = v => String(+Number(v).toPrecision(3)).replace('-', '\u2212');

const state = {element: '', reading: 0, cursor: null, picked: null, count: 0};
const inks = ['before', 'after'];
let time, stripTime, planeTime, planes = {}, readings = [], plots = {};

function unpack() {
  time = doubles(data.time); stripTime = doubles(data.stripTime);
  planeTime = doubles(data.planes.time);
  const begin = planeTime[0], span = planeTime[planeTime.length - 1] - begin || 1;
  const hue = Uint8Array.from(planeTime, t => Math.round(63 * (t - begin) / span));
  for (const [name, p] of Object.entries(data.planes.of)) {
    planes[name] = {
      ...p, hue, x: floats(p.x), y: floats(p.y), power: floats(p.power),
      nominal: {x: floats(p.nominal.x), y: floats(p.nominal.y)},
      laws: p.laws.map(l => ({...l, x: floats(l.x), y: floats(l.y)})),
    };
    planes[name].most = planes[name].power.reduce((m, v) => Math.max(m, Math.abs(v)), 0);
  }
  readings = data.readings.map(r => {
    const measured = floats(r.measured), left = r.left.map(floats);
    const strips = r.strips.map(s => floats(s).map(v => Math.log10(Math.max(0.1, v))));
    return {
      ...r, measured, left, strips,
      fits: left.map(e => measured.map((v, i) => v - e[i] * r.noise)),
      spectra: r.spectra.map(s => ({x: floats(s.x).map(Math.log10), y: floats(s.y).map(Math.log10)})),
      correlations: r.correlations.map(c => ({y: floats(c.y), band: c.band})),
    };
  });
}

const only = () => data.labels.length === 1;
const ink = k => only() ? (data.missing.length === 0 ? 'after' : 'before') : inks[k];

function build() {
  const walk = {walked: p => walkTo(p[0]), pointed: p => walkTo(p[0]), brushed: r => brushTime(r[0], r[1])};
  const shown = (a, b) => {
    for (const p of [plots.recording, plots.strip, plots.left]) {
      p.view[0] = a; p.view[1] = b; p.later();
    }
  };
  const over = 'left / noise';
  plots.recording = new Plot($('recording'), {height: 270, fit: true, bare: true, pad: [10, 12, 8, 62], shown, ...walk});
  plots.strip = new Plot($('strip'), {height: 104, fit: true, floor: -0.7, logY: true, x: 'time (s)', y: 'rms / noise', shown, ...walk});
  plots.left = new Plot($('left'), {height: 230, fit: true, x: 'time (s)', y: over, shown, ...walk});
  plots.spectrum = new Plot($('spectrum'), {height: 230, x: 'frequency (Hz)', y: over, logX: true, logY: true});
  plots.whiteness = new Plot($('whiteness'), {height: 230, x: 'lag (samples)', y: 'autocorrelation'});
  ['map0', 'map1', 'history', 'amplitude'].forEach((n, k) => {
    plots[n] = new Plot($(n), {height: 240, pad: [24, 12, 40, 62], logY: k > 1, y: k > 1 ? 'left, times the noise' : ''});
  });
  plots.plane = new Plot($('plane'), {height: 380, flat: true, brushed: r => brushPlane(r), pointed: nearest});
  const key = (colour, text, area) => {
    const e = made('span', '', $('keys')), k = made('span', '', e);
    k.className = area ? 'key area' : 'key';
    k.style[area ? 'background' : 'borderColor'] = `var(--${colour})`;
    e.append(' ' + text);
  };
  key('measured', 'measured');
  data.labels.forEach((l, k) => key(ink(k), l));
  for (const words of new Set(data.parts.map(p => p.words))) key(held(words), words, true);
  if (data.regions.some(r => r.kind === 'time')) key('active', 'where the model fails most', true);
}
const held = words => words.includes('no choice') ? 'held' : words.includes('not scored') ? 'faint' : 'looked';

function showReading(k) {
  state.reading = k;
  const r = readings[k], line = (y, colour, width) => ({x: time, y, ink: colour, width, sorted: true});
  const fits = r.fits.map((y, i) => ({...line(y, ink(i), 1.2), dash: i ? [] : only() ? [] : [5, 3]}));
  plots.recording.o.y = r.label;
  plots.recording.lines = [line(r.measured, 'measured', 2), ...fits];
  plots.left.lines = r.left.map((y, i) => line(y, ink(i), 0.9));
  plots.left.levels = [{y: 2}, {y: -2}];
  plots.strip.lines = r.strips.map((y, i) => ({...line(y, ink(i), 1.4), x: stripTime}));
  plots.strip.levels = [{y: 0}];
  plots.spectrum.lines = r.spectra.map((s, i) => ({...s, ink: ink(i), width: 1.2}));
  plots.spectrum.levels = [{y: 0}];
  plots.whiteness.lines = r.correlations.map((c, i) => ({
    x: Float32Array.from(c.y, (_, j) => j + 1 + 0.3 * i), y: c.y, ink: ink(i), width: 1.6, stem: true,
  }));
  const band = Math.max(0, ...r.correlations.map(c => c.band));
  plots.whiteness.levels = [{y: 0}, {y: band}, {y: -band}];
  for (const n of ['recording', 'strip', 'left']) plots[n].span = [time[0], time[time.length - 1]];
  for (const n of ['recording', 'strip', 'left', 'spectrum', 'whiteness']) plots[n].reset();
  bands();
  const words = r.levels.map((v, i) => `${data.labels[i]}: ${v === null ? 'unknown' : `${short(v)} times the noise`}`).join('; ');
  $('left-said').textContent = `What is left of ${r.name} on all held-out samples (root mean square, single outliers cut): ${words}. ` +
    'Dashed: two standard deviations of the noise; the noise floor; the band that white noise keeps.';
  const parts = data.parts.filter(p => p.words.startsWith('held')).map(p => `${short(p.from)} to ${short(p.to)} s (${p.words})`);
  plots.recording.say(`${r.label} over ${short(time[time.length - 1] - time[0])} s: measured` +
    `${data.labels.map(l => ', ' + l).join('')}. Held out: ${parts.slice(0, 6).join('; ') || 'nothing'}.`);
  plots.left.say(`What is left of ${r.name} over the noise, ${words}.`);
  plots.strip.say(`Strip of the mismatch of ${r.name}. ${data.regions.map(r => r.words).join('. ')}`);
  plots.spectrum.say(`Spectrum of what is left of ${r.name} over that of the noise.`);
  plots.whiteness.say(`Autocorrelation of what is left of ${r.name}, with the band of white noise.`);
}

function bands() {
  const name = readings[state.reading].name, parts = data.parts.map(p => ({...p, ink: held(p.words), alpha: 1, label: p.words}));
  const worst = kind => data.regions.filter(r => r.kind === kind && (!r.of || r.of === name)).map(r => ({...r, ink: 'active', alpha: kind === 'time' ? 0.6 : 0.2}));
  const chosen = runs().map(([a, b]) => ({from: a, to: b, ink: 'pick', alpha: 0.22}));
  const bare = parts.map(p => ({...p, label: ''}));
  plots.recording.bands = [...parts, ...chosen];
  const files = data.files.flatMap((f, i) => [
    {from: f.from, to: f.to, ink: 'soft', alpha: 0, label: f.name},
    ...(i ? [{from: f.from, to: f.from, ink: 'soft', alpha: 0.6}] : []),
  ]);
  plots.strip.bands = [...bare, ...worst('time'), ...chosen, ...files];
  plots.left.bands = [...bare, ...chosen];
  plots.spectrum.bands = worst('frequency').map((r, i) => ({...r, below: i, from: Math.log10(Math.max(r.from, 1e-9)), to: Math.log10(r.to)}));
  for (const n of ['recording', 'strip', 'left', 'spectrum']) plots[n].later();
}

// Stretches of time whose points are picked.
function runs() {
  const out = [], p = state.picked;
  if (!p) return out;
  const gap = 3 * (planeTime[planeTime.length - 1] - planeTime[0]) / planeTime.length;
  for (let i = 0; i < p.length; i++) {
    if (!p[i]) continue;
    const last = out[out.length - 1];
    if (last && p[i - 1] && planeTime[i] - last[1] < gap) last[1] = planeTime[i];
    else out.push([planeTime[i], planeTime[i]]);
  }
  return out;
}

// Whether what a law bends is lost beside the line that it bends.
function slight(p) {
  const [a, b] = lineOf(p.nominal), span = v => Math.max(...v) - Math.min(...v);
  return p.laws.length > 0 && p.x.length > 0 && span(p.y.map((v, i) => v - a * p.x[i] - b)) < 0.05 * span(p.y);
}

function choose(name) {
  const p = planes[name];
  for (const g of document.querySelectorAll('#graph .element')) {
    g.classList.toggle('chosen', g.dataset.name === name);
    if (g.getAttribute('role')) g.setAttribute('aria-pressed', g.dataset.name === name);
  }
  if (!p) return;
  state.element = name;
  $('element').textContent = `of ${name}`;
  const plot = plots.plane;
  plot.o.x = p.xLabel; plot.o.y = p.yLabel;
  if (!state.asked) $('less').checked = state.less = slight(p);
  const [a, b] = state.less ? lineOf(p.nominal) : [0, 0];
  const off = s => ({x: s.x, y: s.y.map((v, i) => v - a * s.x[i] - b)});
  const nominal = {...off(p.nominal), ink: 'nominal', width: 2.2, under: true};
  const laws = p.laws.map((l, i) => ({...l, ...off(l), ink: `law${i % 6}`, width: 1.3, dash: l.label === 'flexible curve' ? [4, 3] : []}));
  plot.lines = [nominal, ...laws];
  plot.points = {...off(p), hue: p.hue, picked: state.picked, near: null};
  plot.rect = null;
  $('laws').replaceChildren();
  for (const law of [{label: 'law of the model as it is, fitted', line: nominal}, ...laws.map(l => ({label: l.label, line: l}))]) {
    const label = made('label', '', $('laws')), box = made('input', '', label), k = made('span', '', label);
    box.type = 'checkbox'; box.checked = law.line.on !== false;
    box.addEventListener('change', () => { law.line.on = box.checked; plot.later(); });
    k.className = 'key'; k.style.borderColor = `var(--${law.line.ink})`;
    label.append(law.label);
  }
  plot.reset();
  saidPlane();
  showPort(name);
  walkTo(state.cursor);
}

// Misfit over displacement and velocity of a port, and along its history.
function showPort(name) {
  const p = data.ports[name];
  $('port').hidden = !p;
  if (!p) return;
  const log = text => floats(text).map(v => Math.log10(Math.max(v, 1e-3)));
  const maps = p.maps.map(m => ({...m, mean: log(m.mean)})), all = maps.flatMap(m => [...m.mean].filter(v => v === v));
  const from = Math.min(0, ...all), to = Math.max(from + 0.5, ...all);
  $('port-of').textContent = name;
  ['map0', 'map1'].forEach((n, k) => {
    $(n).hidden = !maps[k];
    if (!maps[k]) return;
    Object.assign(plots[n].o, {x: p.xLabel, y: p.yLabel});
    plots[n].cells = {...maps[k], from, to};
    plots[n].title = maps[k].label;
    plots[n].say(`${maps[k].label}: misfit of ${p.of} by ${p.xLabel} and ${p.yLabel}.`);
  });
  ['history', 'amplitude'].forEach((n, k) => {
    const f = p.profiles[k];
    plots[n].o.x = f.xLabel;
    plots[n].levels = [{y: 0}];
    plots[n].lines = f.curves.map((c, i) => {
      const y = floats(c.y), e = floats(c.e);
      return {x: floats(c.x), y: log(c.y), ink: ink(i), bars: Array.from(y, (v, j) => [v - Math.min(e[j], 0.9 * v), v + e[j]].map(Math.log10))};
    });
    plots[n].say(`Misfit of ${p.of} by ${f.xLabel}.`);
  });
  for (const n of ['map0', 'map1', 'history', 'amplitude']) plots[n].reset();
  $('port-key').replaceChildren();
  const key = made('span', `what is left of ${p.of} there, times its noise: ${short(10 ** from)} `, $('port-key'));
  made('span', '', key).className = 'ramp warm';
  key.append(` ${short(10 ** to)}`);
  $('port-said').textContent = 'Blank: hardly visited. Bars: two standard errors; dashed: the noise. ' +
    'A law with memory that is missing shows as a slope over the way since the last turn.';
}

// Least-squares line through a path.
function lineOf({x, y}) {
  const n = x.length, mean = v => v.reduce((s, w) => s + w, 0) / n, mx = mean(x), my = mean(y);
  let xx = 0, xy = 0;
  for (let i = 0; i < n; i++) { xx += (x[i] - mx) ** 2; xy += (x[i] - mx) * (y[i] - my); }
  const a = xx > 0 ? xy / xx : 0;
  return [a, my - a * mx];
}

function saidPlane() {
  const p = planes[state.element];
  if (!p) return;
  const on = p.laws.filter(l => l.on).map(l => l.label).join(', ') || 'none';
  const chosen = state.picked ? ` ${state.count} of them selected.` : '';
  const points = p.x.length ? `${p.x.length} points of ${p.yLabel} over ${p.xLabel}, recovered at ${state.element} ` +
    'as if what is missing sat there alone.' : `${p.yLabel} over ${p.xLabel}.`;
  const far = plots.plane.far, off = far ? ` ${far} of them ${far === 1 ? 'lies far off and is' : 'lie far off and are'} drawn at the edge.` : '';
  const text = `${points}${p.open}${off}${chosen} Laws that are drawn (at first those that the data do not exclude): ${on}.`;
  $('plane-said').textContent = text;
  plots.plane.say(text);
}

function setPicked(picked) {
  state.picked = picked;
  state.count = picked ? picked.reduce((s, v) => s + v, 0) : 0;
  if (plots.plane.points) plots.plane.points.picked = picked;
  plots.plane.later();
  bands(); saidPlane();
  const r = runs();
  $('record-said').textContent = picked
    ? `${state.count} points selected in ${r.length} stretch${r.length === 1 ? '' : 'es'}` +
      (r.length ? `, the first from ${short(r[0][0])} to ${short(r[0][1])} s.` : '.') : '';
}
function brushTime(a, b) {
  plots.plane.rect = null;
  for (const n of ['recording', 'strip', 'left']) plots[n].rect = null;
  state.range = [a, b];
  setPicked(Uint8Array.from(planeTime, t => t >= a && t <= b ? 1 : 0));
}
function brushPlane([x0, x1, y0, y1]) {
  const p = plots.plane.points;
  if (!p) return;
  plots.plane.rect = [x0, x1, y0, y1];
  state.range = null;
  setPicked(Uint8Array.from(p.x, (x, i) => x >= x0 && x <= x1 && p.y[i] >= y0 && p.y[i] <= y1 ? 1 : 0));
}
function clear() {
  for (const p of Object.values(plots)) p.rect = null;
  state.range = null;
  setPicked(null);
}

function nearest([x, y]) {
  const plot = plots.plane, p = plot.points;
  let best = Infinity, at = -1;
  for (let i = 0; p && i < p.x.length; i++) {
    const d = (plot.px(p.x[i]) - plot.px(x)) ** 2 + (plot.py(p.y[i]) - plot.py(y)) ** 2;
    if (d < best) { best = d; at = i; }
  }
  if (at >= 0) walkTo(planeTime[at]);
}

function walkTo(t) {
  if (t == null || !time.length) return;
  state.cursor = Math.min(time[time.length - 1], Math.max(time[0], t));
  for (const n of ['recording', 'strip', 'left']) { plots[n].cursor = state.cursor; plots[n].later(); }
  const at = Math.min(planeTime.length - 1, Plot.find(planeTime, state.cursor));
  if (plots.plane.points) { plots.plane.points.near = at; plots.plane.later(); }
  const r = readings[state.reading], k = Math.min(time.length - 1, Plot.find(time, state.cursor));
  const said = (y, i) => `${['measured', ...data.labels][i]}: ${short(y[k])}${r.unit && ' ' + r.unit}`;
  $('at').textContent = `${r.name} at ${time[k].toPrecision(4)} s \u2013 ${[r.measured, ...r.fits].map(said).join('; ')}`;
  for (const g of document.querySelectorAll('#graph .bond')) {
    const p = planes[g.dataset.head] || planes[g.dataset.tail];
    const wide = p && p.most > 0 ? 1.7 + 5 * Math.sqrt(Math.abs(p.power[at]) / p.most) : 1.7;
    const l = g.querySelector('polyline');
    if (l) l.style.strokeWidth = wide.toFixed(2);
  }
}

function hatch() {
  const drawn = document.querySelector('#graph svg');
  if (!drawn) return;
  const space = drawn.namespaceURI, node = (tag, given, parent) => {
    const e = document.createElementNS(space, tag);
    for (const [k, v] of Object.entries(given)) e.setAttribute(k, v);
    parent.append(e);
    return e;
  };
  drawn.removeAttribute('role'); drawn.removeAttribute('aria-label'); // its elements are buttons
  const pattern = node('pattern', {id: 'hatch', width: 7, height: 7, patternUnits: 'userSpaceOnUse', patternTransform: 'rotate(45)'}, node('defs', {}, drawn));
  node('line', {x1: 0, y1: 0, x2: 0, y2: 7, stroke: '#c2410c', 'stroke-width': 1.6, opacity: 0.55}, pattern);
  for (const g of drawn.querySelectorAll('.element')) {
    const name = g.dataset.name, boxes = g.querySelectorAll(':scope>rect'), body = boxes[boxes.length - 1];
    if (data.missing.includes(name) && body) {
      const over = body.cloneNode();
      over.setAttribute('fill', 'url(#hatch)');
      over.classList.add('hatched');
      body.after(over);
    }
    if (!planes[name]) continue;
    g.tabIndex = 0;
    g.setAttribute('tabindex', '0'); g.setAttribute('role', 'button');
    const warm = data.warmth[name];
    g.setAttribute('aria-label', `${name}: law plane` + (warm >= 0.01 && !data.missing.length ? `, plausibility of the place ${Math.round(100 * warm)} %` : '') +
      (data.missing.includes(name) ? ', physics is missing here' : ''));
    g.addEventListener('click', () => choose(name));
    g.addEventListener('keydown', e => {
      if (e.key === 'Enter' || e.key === ' ') { e.preventDefault(); choose(name); }
    });
  }
}

function keys(e) {
  if (e.target.closest?.('input,select,summary,button') || e.altKey || e.ctrlKey || e.metaKey) return;
  const v = plots.recording.view, step = (v[1] - v[0]) / (e.shiftKey ? 20 : 200), names = Object.keys(planes);
  const at = state.cursor ?? v[0];
  const act = {
    ArrowLeft: () => walkTo(at - step), ArrowRight: () => walkTo(at + step),
    '+': () => plots.recording.zoom(0.7, at), '-': () => plots.recording.zoom(1.4, at),
    '0': () => plots.recording.show(plots.recording.home[0], plots.recording.home[1]),
    ',': () => plots.recording.pan(-0.2), '.': () => plots.recording.pan(0.2),
    '[': () => { state.mark = at; }, ']': () => brushTime(Math.min(state.mark ?? v[0], at), Math.max(state.mark ?? v[0], at)),
    n: () => choose(names[(names.indexOf(state.element) + 1) % names.length]), Escape: clear,
  }[e.key];
  if (act) { e.preventDefault(); act(); }
}

function experiment(e) {
  const item = made('li', `${e.words}: expected to tell ${e.rivals.join(' from ')} by ${short(e.then)} standard errors (${short(e.now)} now)`, $('experiments'));
  if (!e.commands.length) return;
  const courses = e.commands.map(c => floats(c.y)), n = courses[0].length;
  const x = Float64Array.from({length: n}, (_, i) => i * e.dt), names = e.commands.map(c => c.unit ? `${c.name}[${c.unit}]` : c.name);
  const host = made('div', '', item), plot = new Plot(host, {height: 150, fit: true, x: 'time (s)', y: names.join(', '), said: item.textContent});
  plot.lines = courses.map((y, i) => ({x, y, ink: `law${i % 6}`, sorted: true}));
  plot.reset();
  plots[`experiment${$('experiments').children.length}`] = plot;
  const save = made('button', 'download as CSV', item);
  save.type = 'button';
  save.addEventListener('click', () => {
    const cells = ['t[s]', ...names].map(s => /[",\n]/.test(s) ? `"${s.replaceAll('"', '""')}"` : s);
    const rows = Array.from(x, (t, i) => [+t.toPrecision(12), ...courses.map(y => y[i])].join(','));
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([[cells.join(','), ...rows].join('\n') + '\n'], {type: 'text/csv'}));
    link.download = 'next_experiment.csv';
    link.click();
    URL.revokeObjectURL(link.href);
  });
}

function dark(on) {
  document.documentElement.classList.toggle('dark', on);
  for (const p of Object.values(plots)) p.later();
}

function start() {
  $('studio').hidden = false;
  unpack(); build(); hatch();
  $('verdict').textContent = data.verdict;
  readings.forEach((r, k) => { made('option', r.name, $('reading')).value = k; });
  $('reading').parentElement.hidden = readings.length < 2;
  $('reading').addEventListener('change', e => showReading(+e.target.value));
  $('less').addEventListener('change', e => { state.asked = true; state.less = e.target.checked; choose(state.element); });
  $('clear').addEventListener('click', clear);
  $('all').addEventListener('click', () => plots.recording.show(plots.recording.home[0], plots.recording.home[1]));
  $('zoom').addEventListener('click', () => {
    const r = runs();
    if (r.length && r[r.length - 1][1] > r[0][0]) plots.recording.show(r[0][0], r[r.length - 1][1]);
  });
  $('dark').addEventListener('click', () => dark(!document.documentElement.classList.contains('dark')));
  const night = matchMedia('(prefers-color-scheme: dark)');
  night.addEventListener('change', () => dark(night.matches));
  document.addEventListener('keydown', keys);
  if (data.experiments.length) {
    $('next').hidden = false;
    for (const e of data.experiments) experiment(e);
  }
  const worst = readings.reduce((a, r, k) => r.levels[0] > readings[a].levels[0] ? k : a, 0);
  $('reading').value = worst;
  showReading(worst);
  const warmest = Object.entries(data.warmth).filter(([n]) => planes[n]).sort((a, b) => b[1] - a[1])[0];
  choose([...data.places, warmest?.[0], ...Object.keys(planes)].find(n => planes[n]));
  walkTo(time[Math.floor(time.length / 2)]);
  dark(night.matches);
  // on paper: the grid and the width of the page that is printed, lower and twice as fine
  let was = false;
  const printing = on => {
    document.body.classList.toggle('printing', on);
    Plot.fine = on ? 2 : 0;
    for (const p of Object.values(plots)) {
      p.o.height *= on ? 0.8 : 1.25;
      p.canvas.style.height = p.o.height + 'px';
      p.draw();
    }
  };
  addEventListener('beforeprint', () => { was = document.documentElement.classList.contains('dark'); dark(false); printing(true); });
  addEventListener('afterprint', () => { printing(false); dark(was); });
}

if (data.readings.length) start();
