// SPDX-License-Identifier: BSD-3-Clause
'use strict';
// Small charts over time in SVG; all share one time cursor, which the two maps show as a point on the path.
const css = name => getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
const el = id => document.getElementById(id);
const escapeHtml = text => String(text).replace(/[&<>"]/g, c => ({'&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;'}[c]));

const Cursor = {
  time: null, listeners: [],
  set(time) { this.time = time; this.listeners.forEach(f => f(time)); },
};

function showTooltip(event, html) {
  const box = el('tooltip');
  box.innerHTML = html;
  box.hidden = false;
  const x = Math.min(event.clientX + 14, window.innerWidth - box.offsetWidth - 8);
  box.style.left = x + 'px';
  box.style.top = (event.clientY + 16 + box.offsetHeight > window.innerHeight ? event.clientY - box.offsetHeight - 10
                                                                              : event.clientY + 16) + 'px';
}
function hideTooltip() { el('tooltip').hidden = true; }

// Round steps (1, 2, 5 times a power of ten): about `count` of them in [low, high].
function ticks(low, high, count) {
  const raw = Math.max(high - low, 1e-12) / count, power = Math.pow(10, Math.floor(Math.log10(raw)));
  const step = [1, 2, 5, 10].map(m => m * power).find(s => s >= raw * 0.999);
  const out = [];
  for (let v = Math.ceil(low / step - 1e-9) * step; v <= high + step * 1e-9; v += step) out.push(Math.abs(v) < step * 1e-9 ? 0 : v);
  return out;
}
function number(v, digits) {
  if (v === null || v === undefined || Number.isNaN(v)) return '–';
  if (digits === undefined) digits = Math.abs(v) >= 100 ? 0 : Math.abs(v) >= 10 ? 1 : Math.abs(v) >= 1 ? 2 : 3;
  return Number(v).toFixed(digits);
}
function nearest(times, t) {
  let low = 0, high = times.length - 1;
  while (high - low > 1) { const mid = (low + high) >> 1; if (times[mid] < t) low = mid; else high = mid; }
  return t - times[low] < times[high] - t ? low : high;
}

// A curve over time. options: {t, y, end, unit, label, color, height, marks: [{t, color, text}]}
function timeChart(parent, options) {
  const width = Math.max(parent.clientWidth, 320), height = options.height || 150;
  const left = 52, right = 10, top = 16, bottom = 22;
  const end = Math.max(options.end, 1e-3);
  const top_value = options.y.reduce((a, b) => Math.max(a, b), options.least || 1e-9);
  const y_ticks = ticks(0, top_value * 1.05, 4);
  const y_max = Math.max(top_value * 1.05, y_ticks[y_ticks.length - 1]);
  const X = t => left + (width - left - right) * t / end, Y = v => height - bottom - (height - top - bottom) * v / y_max;
  let svg = `<svg width="100%" height="${height}" viewBox="0 0 ${width} ${height}" role="img" aria-label="${escapeHtml(options.label)}">`;
  for (const v of y_ticks)
    svg += `<line class="gridline" x1="${left}" x2="${width - right}" y1="${Y(v)}" y2="${Y(v)}"/><text x="${left - 6}" y="${Y(v) + 4}" text-anchor="end">${+v.toPrecision(6)}</text>`;
  for (const t of ticks(0, end, 10))
    svg += `<text x="${X(t)}" y="${height - 6}" text-anchor="middle">${+t.toPrecision(6)}${t === 0 ? ' s' : ''}</text>`;
  svg += `<line class="axis" x1="${left}" x2="${width - right}" y1="${Y(0)}" y2="${Y(0)}"/>`;
  for (const mark of options.marks || [])
    svg += `<line x1="${X(mark.t)}" x2="${X(mark.t)}" y1="${top}" y2="${Y(0)}" stroke="${mark.color}" stroke-dasharray="3 3" opacity=".7"><title>${escapeHtml(mark.text)}</title></line>`;
  let path = '', previous = null;
  options.t.forEach((t, i) => {
    // A hole in the data is a hole in the curve.
    path += (previous === null || t - previous > Math.max(0.5, end / 100) ? 'M' : 'L') + X(t).toFixed(1) + ' ' + Y(options.y[i]).toFixed(1);
    previous = t;
  });
  svg += `<path d="${path}" fill="none" stroke="${options.color}" stroke-width="1.5" stroke-linejoin="round"/>`;
  svg += `<text x="${left}" y="10">${escapeHtml(options.label)}</text><line class="cursor" y1="${top}" y2="${Y(0)}" visibility="hidden"/></svg>`;
  parent.innerHTML = svg;
  const node = parent.firstChild, line = node.querySelector('.cursor');
  attachCursor(node, line, X, width, left, right, end, (event, t) => {
    const i = nearest(options.t, t);
    showTooltip(event, `${number(options.t[i], 2)} s<br><b>${number(options.y[i])} ${options.unit}</b>`);
  });
}

function attachCursor(node, line, X, width, left, right, end, onHover) {
  node.addEventListener('mousemove', event => {
    const box = node.getBoundingClientRect();
    const t = ((event.clientX - box.left) * width / box.width - left) / (width - left - right) * end;
    if (t < 0 || t > end) { hideTooltip(); return; }
    Cursor.set(t);
    onHover(event, t);
  });
  node.addEventListener('mouseleave', () => { hideTooltip(); Cursor.set(null); });
  Cursor.listeners.push(t => {
    line.setAttribute('visibility', t === null ? 'hidden' : 'visible');
    if (t !== null) { line.setAttribute('x1', X(t)); line.setAttribute('x2', X(t)); }
  });
}

// Bands of the tracking state with the loops as marks above. states: [{t, state, reason}]
function stateChart(parent, states, loops, end) {
  const width = Math.max(parent.clientWidth, 320), height = 62, left = 52, right = 10;
  end = Math.max(end, 1e-3);
  const X = t => left + (width - left - right) * Math.min(Math.max(t, 0), end) / end;
  let svg = `<svg width="100%" height="${height}" viewBox="0 0 ${width} ${height}" role="img" aria-label="tracking state over time">`;
  states.forEach((s, i) => {
    const until = i + 1 < states.length ? states[i + 1].t : end;
    svg += `<rect x="${X(s.t)}" y="18" width="${Math.max(X(until) - X(s.t), 1)}" height="20" fill="var(--${s.state})"/>`;
  });
  for (const loop of loops)
    svg += loop.accepted ? `<path d="M${X(loop.t)} 16 l-5 -9 h10 z" fill="var(--loop)"/>`
                         : `<path d="M${X(loop.t)} 8 v7" stroke="var(--muted)" stroke-width="1" opacity=".5"/>`;
  for (const t of ticks(0, end, 10))
    svg += `<text x="${X(t)}" y="${height - 6}" text-anchor="middle">${+t.toPrecision(6)}${t === 0 ? ' s' : ''}</text>`;
  svg += `<line class="cursor" y1="4" y2="40" visibility="hidden"/></svg>`;
  const names = [...new Set(states.map(s => s.state))];
  let legend = names.map(n => `<span class="swatch" style="background:var(--${n})"></span>${n} &nbsp; `).join('');
  if (loops.some(l => l.accepted)) legend += '<span style="color:var(--loop)">▼</span> loop accepted &nbsp; ';
  if (loops.some(l => !l.accepted)) legend += '<span style="opacity:.6">|</span> loop rejected';
  parent.innerHTML = svg + `<div class="hint">${legend}</div>`;
  const node = parent.firstChild;
  attachCursor(node, node.querySelector('.cursor'), X, width, left, right, end, (event, t) => {
    let current = null;
    for (const s of states) if (s.t <= t) current = s;
    showTooltip(event, `${number(t, 2)} s<br><b>${current ? current.state : '–'}</b>${current && current.reason ? '<br>' + escapeHtml(current.reason) : ''}`);
  });
}
