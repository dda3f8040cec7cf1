const $ = id => document.getElementById(id), stream = new EventSource('/events');
let found = new Map(), last = '', asked = false;
const cell = (row, text, kind) => { const c = row.insertCell(); c.textContent = text; c.className = kind || ''; return c; };

// The effect in words; the name of the element stays.
const spoken = text => text.replace(/^(.*?)( at |$)/, (_, what, at) => what.replaceAll('_', ' ') + at);

// Candidates, best first; a later round goes on with those that may get there.
function listed(label) {
  const all = [...found].sort((a, b) => a[1].misfit - b[1].misfit).slice(0, 40);
  const top = Math.log(Math.max(1.1, ...all.map(a => a[1].misfit)));
  $('table').hidden = false;
  $('rows').replaceChildren();
  for (const [name, {misfit, fits}] of all) {
    const row = $('rows').insertRow();
    row.className = name === label ? 'new' : '';
    cell(row, name); cell(row, fits, 'n'); cell(row, Number(misfit.toPrecision(4)), 'n');
    cell(row, '', 'b').append(Object.assign(document.createElement('span'), {style: `width:${Math.max(1, 100 * Math.log(Math.max(1, misfit)) / top)}%`}));
  }
}
stream.addEventListener('step', event => {
  const [text, fraction] = JSON.parse(event.data), fit = /^fitting (.+ at .+): (\S+) times the noise$/.exec(text);
  $('bar').value = fraction;
  $('stop').disabled = asked; // a take is not stopped from here
  $('now').textContent = spoken(text);
  if (fit) {
    const label = spoken(fit[1]), before = found.get(label);
    found.set(label, {misfit: Number(fit[2]), fits: (before?.fits || 0) + 1});
    listed(label);
  } else if (text !== last && !/^fitting .+ at /.test(text)) {
    last = text;
    $('steps').append(Object.assign(document.createElement('li'), {textContent: text}));
    if (text.startsWith('screening')) found = new Map();
  }
});
// A take that grows: measured, the model that runs along, and the strip of the mismatch.
let takes = new Map();
stream.addEventListener('take', event => {
  const {name, t, y, model} = JSON.parse(event.data);
  $('take').hidden = false;
  if (!takes.has(name)) {
    const host = $('takes').appendChild(document.createElement('div')), x = [], seen = [], along = [], off = [];
    const both = new Plot(host, {height: 220, fit: true, bare: true, pad: [10, 12, 8, 72], y: name, said: `${name}: measured, and the model`});
    const strip = new Plot(host, {height: 110, fit: true, pad: [10, 12, 40, 72], x: 'time (s)', y: 'mismatch', said: `${name}: measured less the model`});
    both.lines = [{x, y: seen, ink: 'measured', width: 2, sorted: true}, {x, y: along, ink: 'before', width: 1.2, sorted: true}];
    strip.lines = [{x, y: off, ink: 'before', width: 1.2, sorted: true}];
    strip.levels = [{y: 0}];
    takes.set(name, {x, seen, along, off, both, strip});
  }
  const k = takes.get(name);
  k.x.push(...t); k.seen.push(...y); k.along.push(...model); k.off.push(...y.map((v, i) => v - model[i]));
  k.both.reset(); k.strip.reset();
});
stream.addEventListener('open', () => {
  $('takes').replaceChildren(); takes = new Map();
  $('steps').replaceChildren(); found = new Map(); last = '';
});
stream.addEventListener('made', () => { stream.close(); location.reload(); });
stream.addEventListener('ended', () => { stream.close(); $('stop').disabled = true; $('now').textContent = 'ended before anything was named'; });
$('stop').addEventListener('click', () => {
  asked = $('stop').disabled = true; $('stop').textContent = 'stopping after this fit';
  fetch('/stop', {method: 'POST'});
});
