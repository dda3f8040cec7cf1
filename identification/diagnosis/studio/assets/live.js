const stream = new EventSource('/events'), steps = document.getElementById('steps');
let last = '';
stream.addEventListener('step', event => {
  const [text, fraction] = JSON.parse(event.data);
  document.getElementById('bar').value = fraction;
  document.getElementById('now').textContent = text;
  if (text === last) return;
  last = text;
  const item = document.createElement('li');
  item.textContent = text;
  steps.append(item);
});
stream.addEventListener('open', () => { steps.replaceChildren(); last = ''; });
stream.addEventListener('made', () => { stream.close(); location.reload(); });
