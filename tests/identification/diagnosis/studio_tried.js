// What a test asks the page to do to itself; the answer is read from the document.
function selfTest() {
  const refused = [];
  document.addEventListener('securitypolicyviolation', e => refused.push(e.violatedDirective));
  const coloured = plot => {
    plot.draw();
    const c = plot.canvas, all = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
    let n = 0;
    for (let i = 3; i < all.length; i += 4) n += all[i] > 0;
    return n;
  };
  const elements = {};
  for (const g of document.querySelectorAll('#graph .element[role=button]')) {
    g.dispatchEvent(new MouseEvent('click', {bubbles: true}));
    elements[g.dataset.name] = {chosen: state.element, points: plots.plane.points.x.length, lines: plots.plane.lines.length, drawn: coloured(plots.plane)};
  }
  const drag = (plot, from, to) => {
    const r = plot.canvas.getBoundingClientRect(), [l, t, w, h] = plot.box();
    ['pointerdown', 'pointermove', 'pointerup'].forEach((type, i) => {
      const [x, y] = i ? to : from;
      plot.canvas.dispatchEvent(new PointerEvent(type, {bubbles: true, pointerId: 1, clientX: r.left + l + x * w, clientY: r.top + t + y * h}));
    });
    return {count: state.count, runs: runs()};
  };
  choose(data.missing.find(n => planes[n]) || Object.keys(planes)[0]);
  for (const p of Object.values(plots)) p.draw();
  const brushedTime = drag(plots.recording, [0.25, 0.2], [0.5, 0.8]);
  const view = plots.recording.view.slice();
  const brushedPlane = drag(plots.plane, [0.5, 0], [1, 1]);
  document.dispatchEvent(new KeyboardEvent('keydown', {key: 'Escape'}));
  const cleared = state.count;
  const before = state.cursor;
  document.body.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight', bubbles: true}));
  const walked = state.cursor - before;
  document.body.dispatchEvent(new KeyboardEvent('keydown', {key: '+', bubbles: true}));
  const zoomed = plots.recording.view.slice(0, 2);
  plots.recording.reset();
  const box = $('laws').querySelector('input'), was = plots.plane.lines[0].on !== false;
  box.click();
  const switched = was !== (plots.plane.lines[0].on !== false);
  const tall = () => plots.plane.view[3] - plots.plane.view[2], high = tall();
  $('less').click();
  const lower = tall() / high;
  const line = [-2, -1, 0, 1, 2], bent = c => ({nominal: {x: line, y: line}, x: line, y: line.map(v => v + c * v ** 3), laws: [0]});
  const slightly = [bent(0.002), bent(0.2)].map(slight);
  const flat = plots.plane, wave = Float64Array.from({length: 400}, (_, i) => Math.sin(i));
  const own = flat.points, lines = flat.lines, tallest = ys => { flat.points = {...own, x: wave, y: ys}; flat.lines = []; return flat.extent()[3]; };
  const edges = [wave, wave.map((v, i) => i === 7 ? 500 : v), wave.map((v, i) => i % 2 ? 500 : v)].map(ys => [tallest(ys), flat.far]);
  flat.points = own; flat.lines = lines; flat.extent();
  const fetched = performance.getEntriesByType('resource').map(e => e.name);
  const widths = [...document.querySelectorAll('#graph .bond polyline:first-of-type')].map(l => parseFloat(l.style.strokeWidth));
  return {edges, elements, brushedTime, view, brushedPlane, cleared, lower, slightly, walked, zoomed, switched, fetched, refused, widths,
    hatched: document.querySelectorAll('#graph .hatched').length, wide: document.documentElement.scrollWidth - innerWidth,
    said: $('verdict').textContent, parts: plots.recording.bands.length,
    ports: ['map0', 'map1', 'history', 'amplitude'].map(n => coloured(plots[n])), at: $('at').textContent};
}
const out = made('pre', '', document.body);
out.id = 'selftest';
try { out.textContent = JSON.stringify(selfTest()); } catch (e) { out.textContent = JSON.stringify({error: String(e.stack)}); }
