// SPDX-License-Identifier: BSD-3-Clause
'use strict';
// The run from above and in 3D, on canvases. World: z up, metres.
function setUpCanvas(canvas, draw) {
  const redraw = () => {
    const ratio = window.devicePixelRatio || 1, box = canvas.getBoundingClientRect();
    canvas.width = Math.round(box.width * ratio);
    canvas.height = Math.round(box.height * ratio);
    const g = canvas.getContext('2d');
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, box.width, box.height);
    draw(g, box.width, box.height);
  };
  let queued = false;
  const request = () => {
    if (queued) return;
    queued = true;
    requestAnimationFrame(() => { queued = false; redraw(); });
  };
  window.addEventListener('resize', request);
  Cursor.listeners.push(request);
  redraw();
  return request;
}

function extent(data) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const take = p => { for (let k = 0; k < 3; ++k) { low[k] = Math.min(low[k], p[k]); high[k] = Math.max(high[k], p[k]); } };
  for (const name of ['trajectory', 'truth']) if (data[name]) data[name].p.forEach(take);
  for (const plane of data.planes) for (const polygon of plane.polygons) polygon.outer.forEach(take);
  if (!isFinite(low[0])) return {low: [-1, -1, 0], high: [1, 1, 1]};
  return {low, high};
}

function positionAt(path, t) {
  if (!path || t === null) return null;
  return path.p[nearest(path.t, t)];
}

const pathStyle = {
  truth: {color: 'truth', width: 1.4, dash: [6, 4]},
  odometry: {color: 'odometry', width: 1.4, dash: []},
  trajectory: {color: 'estimate', width: 2.2, dash: []},
};

function strokePath(g, path, style, project) {
  g.strokeStyle = css(style.color);
  g.lineWidth = style.width;
  g.setLineDash(style.dash);
  g.lineJoin = 'round';
  g.beginPath();
  let open = false;
  for (const p of path.p) {
    const q = project(p);
    if (!q) { open = false; continue; }
    if (open) g.lineTo(q[0], q[1]); else g.moveTo(q[0], q[1]);
    open = true;
  }
  g.stroke();
  g.setLineDash([]);
}

function dot(g, q, color, radius) {
  g.fillStyle = css(color);
  g.strokeStyle = css('card');
  g.lineWidth = 2;
  g.beginPath();
  g.arc(q[0], q[1], radius, 0, 2 * Math.PI);
  g.fill();
  g.stroke();
}

function tracePolygon(g, polygon, project) {
  g.beginPath();
  for (const ring of [polygon.outer, ...(polygon.holes || [])]) {
    const points = ring.map(project);
    if (points.some(p => !p)) return false;
    points.forEach((p, i) => i ? g.lineTo(p[0], p[1]) : g.moveTo(p[0], p[1]));
    g.closePath();
  }
  return true;
}

function topView(canvas, data) {
  const view = {scale: null, x: 0, y: 0, touched: false};  // fits the window until somebody moves it
  const {low, high} = extent(data);
  const request = setUpCanvas(canvas, (g, width, height) => {
    const fit = 0.88 * Math.min(width / Math.max(high[0] - low[0], 0.5), height / Math.max(high[1] - low[1], 0.5));
    if (!view.touched) Object.assign(view, {scale: fit, x: (low[0] + high[0]) / 2, y: (low[1] + high[1]) / 2});
    const project = p => [width / 2 + (p[0] - view.x) * view.scale, height / 2 - (p[1] - view.y) * view.scale];
    const wanted = 90 / view.scale, power = Math.pow(10, Math.floor(Math.log10(wanted)));
    const step = power * [5, 2, 1].find(m => m * power <= wanted);
    g.strokeStyle = css('grid');
    g.lineWidth = 1;
    for (let x = Math.ceil((view.x - width / 2 / view.scale) / step) * step; x < view.x + width / 2 / view.scale; x += step) {
      g.beginPath(); g.moveTo(project([x, 0])[0], 0); g.lineTo(project([x, 0])[0], height); g.stroke();
    }
    for (let y = Math.ceil((view.y - height / 2 / view.scale) / step) * step; y < view.y + height / 2 / view.scale; y += step) {
      g.beginPath(); g.moveTo(0, project([0, y])[1]); g.lineTo(width, project([0, y])[1]); g.stroke();
    }
    // Floors first, walls on top as the thick lines they are from above.
    const order = {horizontal: 0, general: 1, vertical: 2};
    for (const plane of [...data.planes].sort((a, b) => order[a.kind] - order[b.kind] || a.distance - b.distance)) {
      const color = css(plane.kind in order ? plane.kind : 'general');
      for (const polygon of plane.polygons) {
        if (!tracePolygon(g, polygon, project)) continue;
        g.fillStyle = g.strokeStyle = color;
        g.globalAlpha = plane.kind === 'vertical' ? 0.35 : 0.10;
        g.fill('evenodd');
        g.globalAlpha = plane.kind === 'vertical' ? 0.9 : 0.35;
        g.lineWidth = plane.kind === 'vertical' ? 2.6 : 1;
        g.stroke();
        g.globalAlpha = 1;
      }
    }
    for (const name of ['odometry', 'trajectory', 'truth']) if (data[name]) strokePath(g, data[name], pathStyle[name], project);
    for (const loop of data.summary.loops || []) {
      if (!loop.accepted || loop.t_match === undefined) continue;
      const a = positionAt(data.trajectory, loop.t - data.t0), b = positionAt(data.trajectory, loop.t_match - data.t0);
      if (!a || !b) continue;
      g.strokeStyle = css('loop');
      g.lineWidth = 1.6;
      g.beginPath(); g.moveTo(...project(a)); g.lineTo(...project(b)); g.stroke();
    }
    if (data.trajectory) {
      dot(g, project(data.trajectory.p[0]), 'horizontal', 5);
      dot(g, project(data.trajectory.p[data.trajectory.p.length - 1]), 'estimate', 5);
    }
    const here = positionAt(data.trajectory, Cursor.time);
    if (here) dot(g, project(here), 'cursor', 6);
    g.strokeStyle = g.fillStyle = css('muted');
    g.lineWidth = 2;
    g.beginPath(); g.moveTo(12, height - 12); g.lineTo(12 + step * view.scale, height - 12); g.stroke();
    g.font = '12px system-ui, sans-serif';
    g.fillText(+step.toPrecision(3) + ' m', 16 + step * view.scale, height - 8);
  });
  dragAndZoom(canvas, (dx, dy) => { view.touched = true; view.x -= dx / view.scale; view.y += dy / view.scale; request(); },
              factor => { view.touched = true; view.scale *= factor; request(); });
}

// All points that the views show, and the heading of their longest horizontal extent.
function shownPoints(data) {
  const points = data.trajectory ? data.trajectory.p.slice() : [];
  for (const plane of data.planes) for (const polygon of plane.polygons) points.push(...polygon.outer);
  return points;
}
function longAxis(points) {
  let x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (const p of points) { x += p[0] / points.length; y += p[1] / points.length; }
  for (const p of points) { xx += (p[0] - x) ** 2; xy += (p[0] - x) * (p[1] - y); yy += (p[1] - y) ** 2; }
  return 0.5 * Math.atan2(2 * xy, xx - yy);
}

function spaceView(canvas, data) {
  const {low, high} = extent(data), points = shownPoints(data);
  const size = Math.max(high[0] - low[0], high[1] - low[1], high[2] - low[2], 1);
  // Across the longest extent, a little from the side and from above; as near as everything fits.
  const view = {yaw: (points.length ? longAxis(points) : 0) - Math.PI / 2 + 0.35, pitch: 0.8, distance: 1.75 * size,
                target: low.map((v, k) => (v + high[k]) / 2), touched: false};
  const fit = (width, height) => {
    const cy = Math.cos(view.yaw), sy = Math.sin(view.yaw), cp = Math.cos(view.pitch), sp = Math.sin(view.pitch);
    const focal = 1.15 * Math.min(width, height);
    let distance = 0.3 * size;
    for (const p of points) {
      const d = p.map((v, k) => v - view.target[k]);
      const toward = d[0] * cy * cp + d[1] * sy * cp + d[2] * sp;
      const u = Math.abs(-d[0] * sy + d[1] * cy), v = Math.abs(-d[0] * cy * sp - d[1] * sy * sp + d[2] * cp);
      distance = Math.max(distance, toward + focal * Math.max(u / (0.47 * width), v / (0.46 * height)));
    }
    view.distance = distance;
  };
  const request = setUpCanvas(canvas, (g, width, height) => {
    if (!view.touched && points.length) fit(width, height);
    const cy = Math.cos(view.yaw), sy = Math.sin(view.yaw), cp = Math.cos(view.pitch), sp = Math.sin(view.pitch);
    const right = [-sy, cy, 0], up = [-cy * sp, -sy * sp, cp], back = [cy * cp, sy * cp, sp];
    const eye = view.target.map((v, k) => v + view.distance * back[k]);
    const focal = 1.15 * Math.min(width, height);
    const dotp = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const project = p => {
      const d = [p[0] - eye[0], p[1] - eye[1], p[2] - eye[2]], depth = -dotp(d, back);
      if (depth < 0.05 * size) return null;
      return [width / 2 + focal * dotp(d, right) / depth, height / 2 - focal * dotp(d, up) / depth, depth];
    };
    const faces = [];
    for (const plane of data.planes)
      for (const polygon of plane.polygons) {
        const centre = [0, 1, 2].map(k => polygon.outer.reduce((s, p) => s + p[k], 0) / polygon.outer.length);
        const toward = dotp(plane.normal, [eye[0] - centre[0], eye[1] - centre[1], eye[2] - centre[2]]);
        faces.push({plane, polygon, front: toward > 0, depth: Math.hypot(...centre.map((v, k) => v - eye[k]))});
      }
    faces.sort((a, b) => b.depth - a.depth);
    for (const face of faces) {
      if (!tracePolygon(g, face.polygon, project)) continue;
      const color = css(['horizontal', 'vertical'].includes(face.plane.kind) ? face.plane.kind : 'general');
      // Planes seen from behind are glass: one looks into the room like into a doll's house.
      const light = 0.35 + 0.3 * Math.abs(dotp(face.plane.normal, [0.36, 0.48, 0.8]));
      g.fillStyle = g.strokeStyle = color;
      g.globalAlpha = face.front ? light * 0.8 : 0.05;
      g.fill('evenodd');
      g.globalAlpha = face.front ? 0.95 : 0.35;
      g.lineWidth = face.front ? 1.2 : 0.8;
      g.stroke();
      g.globalAlpha = 1;
    }
    for (const name of ['odometry', 'trajectory', 'truth']) if (data[name]) strokePath(g, data[name], pathStyle[name], project);
    if (data.trajectory) {
      const first = project(data.trajectory.p[0]), last = project(data.trajectory.p[data.trajectory.p.length - 1]);
      if (first) dot(g, first, 'horizontal', 4);
      if (last) dot(g, last, 'estimate', 4);
    }
    const here = positionAt(data.trajectory, Cursor.time), q = here && project(here);
    if (q) dot(g, q, 'cursor', 5);
    drawAxes(g, height, right, up);
  });
  dragAndZoom(canvas, (dx, dy, shift) => {
    view.touched = true;
    if (shift) {
      const s = view.distance / 700, cy = Math.cos(view.yaw), sy = Math.sin(view.yaw);
      view.target[0] += s * (sy * dx - cy * dy);
      view.target[1] += s * (-cy * dx - sy * dy);
    } else {
      view.yaw -= dx * 0.008;
      view.pitch = Math.min(1.55, Math.max(-0.3, view.pitch + dy * 0.006));
    }
    request();
  }, factor => { view.touched = true; view.distance /= factor; request(); });
}

function drawAxes(g, height, right, up) {
  const names = ['x', 'y', 'z'], colors = ['#d6443c', '#2e9e4f', '#3b6fd4'];
  g.font = '11px system-ui, sans-serif';
  for (let k = 0; k < 3; ++k) {
    const x = 34 + 24 * right[k], y = height - 34 - 24 * up[k];
    g.strokeStyle = g.fillStyle = colors[k];
    g.lineWidth = 2;
    g.beginPath(); g.moveTo(34, height - 34); g.lineTo(x, y); g.stroke();
    g.fillText(names[k], x + 3, y + 3);
  }
}

function dragAndZoom(canvas, onDrag, onZoom) {
  let last = null;
  canvas.addEventListener('pointerdown', e => { last = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener('pointerup', () => { last = null; });
  canvas.addEventListener('pointermove', e => {
    if (!last) return;
    onDrag(e.clientX - last[0], e.clientY - last[1], e.shiftKey);
    last = [e.clientX, e.clientY];
  });
  canvas.addEventListener('wheel', e => { e.preventDefault(); onZoom(Math.exp(-e.deltaY * 0.0012)); }, {passive: false});
}
