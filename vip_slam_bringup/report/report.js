// SPDX-License-Identifier: BSD-3-Clause
'use strict';
// Fills the page from the embedded data; sections without data stay away.
function table(parent, columns, rows) {
  const head = columns.map(c => `<th class="${c.text ? 'text' : ''}">${escapeHtml(c.title)}</th>`).join('');
  const body = rows.map(row => '<tr>' + columns.map(c => `<td class="${c.text ? 'text' : ''}">${c.cell(row)}</td>`).join('') + '</tr>').join('');
  parent.innerHTML = `<table><thead><tr>${head}</tr></thead><tbody>${body}</tbody></table>`;
}

function tiles(data) {
  const s = data.summary, out = [];
  const add = (value, unit, label) => out.push(`<div class="tile"><b>${value}<small>${unit}</small></b><span>${label}</span></div>`);
  if (data.error) {
    add(number(100 * data.error.ate, 2), 'cm', 'trajectory error (ATE RMSE)');
    add(number(data.error.rotation_rmse, 2), '°', 'rotation error (RMSE)');
  }
  const length = s.distance !== undefined ? s.distance : pathLength(data.trajectory);
  if (length !== null) add(number(length, 1), 'm', 'travelled');
  add(number(s.duration !== undefined ? s.duration : data.t_end, 1), 's', 'of data');
  if (s.real_time_factor !== undefined) add(number(s.real_time_factor, 1), '×', 'real time');
  if (s.keyframes !== undefined) add(s.keyframes, '', 'keyframes');
  if (s.landmarks !== undefined) add(s.landmarks, '', 'landmarks' + (s.plane_landmarks ? `, ${s.plane_landmarks} on planes` : ''));
  if (data.planes.length || !data.missing.includes('planes.yaml')) add(data.planes.length, '', data.plane_report ? `planes, ${data.plane_report.matched} of ${data.plane_report.true_count} true ones` : 'planes');
  const loops = s.loops || [];
  if (s.loops) add(loops.filter(l => l.accepted).length, '', `loops closed, ${loops.filter(l => !l.accepted).length} rejected`);
  if (s.peak_memory_mb !== undefined) add(number(s.peak_memory_mb, 0), 'MB', 'peak memory');
  el('tiles').innerHTML = out.join('');
}

function pathLength(path) {
  if (!path) return null;
  let length = 0;
  for (let i = 1; i < path.p.length; ++i) length += Math.hypot(...path.p[i].map((v, k) => v - path.p[i - 1][k]));
  return length;
}

function notes(data) {
  const list = [...(data.summary.warnings || [])];
  if (data.summary.finished === false) list.unshift('The run was interrupted: this is what there was until then.');
  if (data.missing.length) list.push('Not in the folder: ' + data.missing.join(', '));
  if (data.truth_note) list.push(data.truth_note);
  if (!data.trajectory) list.push('No image got a pose in the map.');
  if (!list.length) return;
  el('notes').hidden = false;
  el('notes').className = 'notes';
  el('notes').innerHTML = '<ul>' + list.map(n => `<li>${escapeHtml(n)}</li>`).join('') + '</ul>';
}

function timing(data) {
  if (!data.stages.length) return;
  el('timing-card').hidden = false;
  const stages = data.stages, longest = Math.log10(1 + Math.max(...stages.map(s => s.p99)) * 10);
  const at = v => 100 * Math.log10(1 + v * 10) / longest;
  const bar = s => `<svg viewBox="0 0 100 16" preserveAspectRatio="none"><rect x="0" y="6" width="${at(s.p99)}" height="4" fill="var(--line)"/><rect x="0" y="3" width="${at(s.median)}" height="10" fill="var(--estimate)"/></svg>`;
  el('timing-table').innerHTML = '<table><thead><tr><th>stage</th><th class="text">median and 99 % (log scale)</th><th>median ms</th><th>99 % ms</th><th>max ms</th><th>mean ms</th><th title="mean time of the processor: without waiting for others">computing ms</th><th>calls</th><th>sum s</th></tr></thead><tbody>' +
    stages.map((s, i) => `<tr class="pick" data-stage="${i}"><td>${escapeHtml(s.name)}</td><td class="bar">${bar(s)}</td><td>${number(s.median)}</td><td>${number(s.p99)}</td><td>${number(s.max)}</td><td>${number(s.mean)}</td><td>${s.cpu_mean === null ? '' : number(s.cpu_mean)}</td><td>${s.count}</td><td>${number(s.total)}</td></tr>`).join('') + '</tbody></table><p class="hint">Choose a row to see it over time.</p>';
  const rows = [...el('timing-table').querySelectorAll('tr.pick')];
  const pick = i => {
    rows.forEach((row, k) => row.classList.toggle('on', k === i));
    const s = stages[i];
    timeChart(el('timing-chart'), {t: s.t, y: s.ms, end: data.t_end, unit: 'ms', label: s.name + ', ms', color: css('estimate')});
  };
  rows.forEach((row, i) => row.addEventListener('click', () => pick(i)));
  const total = stages.map(s => s.total);
  pick(total.indexOf(Math.max(...total)));
}

function planes(data) {
  if (!data.planes.length) return;
  el('planes-card').hidden = false;
  const report = data.plane_report, errors = {};
  if (report) {
    report.rows.forEach(r => { errors[r.id] = r; });
    const lost = report.true_count - report.matched;
    el('planes-note').textContent = `${report.matched} of ${report.true_count} true planes (1 m² and more, in view for 2 s and more) found` +
      (report.duplicates ? `, ${report.duplicates} found more than once` : ', none twice') + (lost ? `, ${lost} not seen or missed` : '') +
      (report.aligned ? '; compared after aligning the trajectories.' : '; compared without alignment.');
  }
  const tilt = p => 180 / Math.PI * Math.acos(Math.min(1, Math.abs(p.normal[2])));
  const columns = [
    {title: 'id', cell: p => `<span class="swatch" style="background:var(--${['horizontal', 'vertical'].includes(p.kind) ? p.kind : 'general'})"></span>${p.id}`},
    {title: 'kind', text: true, cell: p => escapeHtml(p.kind)},
    {title: 'area m²', cell: p => number(p.area, 2)},
    {title: 'tilt °', cell: p => number(tilt(p), 2)},
    {title: 'normal', cell: p => p.normal.map(v => number(v, 3)).join(', ')},
    {title: 'distance m', cell: p => number(p.distance, 3)},
  ];
  if (data.planes.some(p => p.keyframes !== null)) columns.push({title: 'keyframes', cell: p => p.keyframes === null ? '–' : p.keyframes});
  if (report) columns.push({title: 'true plane', cell: p => errors[p.id].truth === null ? 'none' : errors[p.id].truth},
                           {title: 'angle error °', cell: p => number(errors[p.id].angle, 2)},
                           {title: 'distance error cm', cell: p => errors[p.id].distance === undefined ? '–' : number(100 * errors[p.id].distance, 2)});
  table(el('planes-table'), columns, [...data.planes].sort((a, b) => b.area - a.area));
}

function details(data) {
  const s = data.summary, rows = [];
  for (const key of ['bag', 'sensor', 'variant', 'loop_closing', 'processing_time', 'images', 'tracked_images', 'epochs'])
    if (s[key] !== undefined) rows.push([key.replace(/_/g, ' '), s[key]]);
  for (const key of Object.keys(s.counters || {})) rows.push([key.replace(/_/g, ' '), s.counters[key]]);
  (s.global_ba || []).forEach((g, i) => rows.push([`global bundle adjustment ${i + 1}`, `at ${number(g.t - data.t0, 1)} s: ${g.keyframes} keyframes${g.iterations === undefined ? '' : `, ${g.iterations} iterations`}, ${number(g.ms, 0)} ms`]));
  if (!rows.length) { el('details-card').hidden = true; return; }
  el('details').innerHTML = '<dl>' + rows.map(([k, v]) => `<dt>${escapeHtml(k)}</dt><dd>${escapeHtml(v)}</dd>`).join('') + '</dl>';
}

(function main() {
  const data = JSON.parse(el('data').textContent), s = data.summary;
  const loops = (s.loops || []).map(l => Object.assign({}, l, {t: l.t - data.t0}));
  const states = (s.states || []).map(x => Object.assign({}, x, {t: x.t - data.t0}));
  el('subtitle').textContent = [s.sensor && 'sensor ' + s.sensor, s.variant && 'variant ' + s.variant,
    s.loop_closing !== undefined && 'loop closing ' + (s.loop_closing ? 'on' : 'off')].filter(Boolean).join(' · ');
  notes(data);
  tiles(data);
  const entries = [['trajectory', 'estimate', 'trajectory', '']];
  if (data.odometry) entries.push(['odometry', 'odometry', 'odometry (own frame)', '']);
  if (data.truth) entries.push(['truth', 'truth', 'truth', 'dash']);
  el('legend-top').innerHTML = entries.map(e => `<i class="${e[3]}" style="border-color:var(--${e[1]})"></i>${e[2]}`).join('');
  topView(el('top'), data);
  spaceView(el('space'), data);
  const drawCharts = () => {
    Cursor.listeners = Cursor.listeners.slice(0, 2);  // the two maps stay
    if (states.length) stateChart(el('states'), states, loops, data.t_end); else el('states-card').hidden = true;
    if (data.error) {
      el('error-card').hidden = false;
      const e = data.error, marks = loops.filter(l => l.accepted).map(l => ({t: l.t, color: css('loop'), text: 'loop accepted'}));
      el('error-note').textContent = `${e.count} of ${e.images} poses have truth; one rigid alignment, no scale. RMSE ${number(100 * e.ate, 2)} cm, median ${number(100 * e.median, 2)} cm, largest ${number(100 * e.max, 2)} cm.` +
        (e.rotation_aligned_by === 'positions' ? '' : ` The path is too straight to align orientations by it: these are compared after ${e.rotation_aligned_by === 'yaw' ? 'yaw alone was aligned' : 'they were aligned themselves'}.`);
      timeChart(el('error-position'), {t: e.t, y: e.position.map(v => 100 * v), end: data.t_end, unit: 'cm', least: 0.1, label: 'position, cm', color: css('estimate'), marks});
      timeChart(el('error-rotation'), {t: e.t, y: e.rotation, end: data.t_end, unit: '°', least: 0.1, label: 'rotation, °', color: css('odometry'), marks});
    }
    timing(data);
  };
  drawCharts();
  let timer = null;
  window.addEventListener('resize', () => { clearTimeout(timer); timer = setTimeout(drawCharts, 200); });
  planes(data);
  if (loops.length) {
    el('loops-card').hidden = false;
    table(el('loops-table'), [
      {title: 'time s', cell: l => number(l.t, 2)}, {title: 'keyframe', cell: l => l.query}, {title: 'matches', cell: l => l.match},
      {title: 'inliers', cell: l => l.inliers === undefined ? '–' : l.inliers},
      {title: 'verdict', text: true, cell: l => l.accepted ? '<span style="color:var(--loop)">accepted</span>' : 'rejected'},
      {title: 'why', text: true, cell: l => escapeHtml(l.reason || '')}], loops);
  }
  details(data);
  document.documentElement.dataset.ready = 'true';
})();
