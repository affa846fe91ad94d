"use strict";
// The film of a ride on plain canvases. World axes: X forward at the start of the piece, Y left, Z up; angles
// ZYX with pitch positive nose down and roll positive left side up, as everywhere in simrail. The frame is
// chosen by the clock: a slow machine draws fewer, never later ones.
(() => {
const data = JSON.parse(document.getElementById("film").textContent);
const $ = id => document.getElementById(id);
const numbers = text => {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return new Float32Array(bytes.buffer);
};
const size = data.scale, hz = data.hz, count = data.frames, length = (count - 1) / hz;
const reference = numbers(data.reference);
const design = { ...data.design, rows: numbers(data.design.rows), width: 6 };
const rails = { ...data.rails, rows: numbers(data.rails.rows), width: 4 };
const bodies = {};
for (const body of data.bodies) bodies[body.name] = { ...body, pose: numbers(body.pose) };
const wheels = data.wheels.map(wheel => ({ ...wheel, turned: numbers(wheel.turned), forces: wheel.forces && numbers(wheel.forces) }));
const attitude = { true: numbers(data.attitude.true), estimated: {} };
for (const name in data.attitude.estimated) attitude.estimated[name] = numbers(data.attitude.estimated[name]);
const signals = data.signals.map(strip => {
  const read = lines => Object.fromEntries(Object.entries(lines).map(([name, text]) => [name, numbers(text)]));
  return { ...strip, lines: read(strip.lines), methods: read(strip.methods) };
});

const state = { t: 0, playing: true, speed: 1, times: 5, method: $("method") ? $("method").value : null, axle: null,
  view: "follow", azimuth: 0.62, elevation: 0.3, distance: 9.5, car: true, arrows: true, drawn: 0, dirty: true };
let anchor = { t: 0, now: 0 };

// ---- small algebra ------------------------------------------------------------------------------------------
const add = (a, b, k = 1) => [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => { const n = Math.hypot(...a) || 1; return [a[0] / n, a[1] / n, a[2] / n]; };
function rotation(roll, pitch, yaw) {
  const cr = Math.cos(roll), sr = Math.sin(roll), cp = Math.cos(pitch), sp = Math.sin(pitch), cy = Math.cos(yaw), sy = Math.sin(yaw);
  return [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, -sp, cp * sr, cp * cr];
}
const turn = (m, v) => [m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[3] * v[0] + m[4] * v[1] + m[5] * v[2], m[6] * v[0] + m[7] * v[1] + m[8] * v[2]];
function times(a, b) {
  const c = new Array(9);
  for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) c[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
  return c;
}
function row(table, width, at) {                       // a row of a table between its rows
  const last = table.length / width - 1, x = Math.min(Math.max(at, 0), last), i = Math.min(Math.floor(x), Math.max(last - 1, 0)), w = x - i;
  const out = new Array(width), j = Math.min(i + 1, last);
  for (let k = 0; k < width; k++) out[k] = table[i * width + k] * (1 - w) + table[j * width + k] * w;
  return out;
}
const along = (line, s) => row(line.rows, line.width, (s - line.from) / line.step);
const lineEnd = design.from + design.step * (design.rows.length / 6 - 1);
function trackAt(s) {
  const [x, y, z, yaw, pitch, roll] = along(design, s);
  return { origin: [x, y, z], yaw, axes: rotation(roll, pitch, yaw) };
}
const onTrack = (s, y, z) => { const f = trackAt(s); return add(f.origin, turn(f.axes, [0, y, z])); };

function poses(frame) {
  const found = {};
  for (const name in bodies) {
    const body = bodies[name], [s, lateral, vertical, roll, pitch, yaw] = row(body.pose, 6, frame), e = state.times, f = trackAt(s);
    found[name] = { s, lateral, vertical, roll,
      origin: add(f.origin, turn(f.axes, [0, e * lateral, body.rest_z + e * (vertical - body.rest_z)])),
      axes: times(f.axes, rotation(e * roll, e * pitch, e * yaw)) };
  }
  return found;
}
const place = (pose, v) => add(pose.origin, turn(pose.axes, v));

// ---- colours ------------------------------------------------------------------------------------------------
let colour = {}, shades = {};
function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["bg", "panel", "ink", "muted", "line", "accent", "sky", "sky2", "ground", "ground2", "ballast", "sleeper", "rail", "railtop", "design", "car", "frame", "axle", "disc", "mark", "window", "true", "estimated", "load", "guiding"])
    colour[name] = style.getPropertyValue("--" + name).trim();
  shades = {};
}
function shade(name, light) {
  const level = Math.round(20 * Math.min(Math.max(light, 0), 1.25)), key = name + level;
  if (!shades[key]) {
    const hex = colour[name], part = i => Math.min(255, Math.round(parseInt(hex.slice(i, i + 2), 16) * level / 20));
    shades[key] = `rgb(${part(1)},${part(3)},${part(5)})`;
  }
  return shades[key];
}
const SUN = unit([0.35, 0.45, 0.82]);

// ---- canvases -----------------------------------------------------------------------------------------------
const FULL = Math.min(window.devicePixelRatio || 1, 2);
let quality = FULL;
function fit(canvas, ratio) {
  const box = canvas.getBoundingClientRect(), w = Math.max(2, Math.round(box.width * ratio)), h = Math.max(2, Math.round(box.height * ratio));
  if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
  const pen = canvas.getContext("2d", { alpha: canvas.id !== "scene" });
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  return { pen, w: box.width, h: box.height };
}

// ---- the large picture --------------------------------------------------------------------------------------
function cameraOf(w, h, frame, found) {
  const s = row(reference, 1, frame)[0], f = trackAt(s), middle = add(f.origin, [0, 0, 0.75 * size]);
  let from, to = middle, reach = state.distance * size;
  const around = (azimuth, elevation, far, target) => add(target, [Math.cos(f.yaw + azimuth) * Math.cos(elevation) * far, Math.sin(f.yaw + azimuth) * Math.cos(elevation) * far, Math.sin(elevation) * far]);
  if (state.view === "line") {                         // stands beside the line, and looks after the vehicle
    const every = 60 * size, post = Math.round(s / every) * every + 0.001, beside = trackAt(Math.min(Math.max(post, design.from), lineEnd));
    from = add(beside.origin, turn(beside.axes, [0, -(0.45 * reach + 2 * size), 0.5 * size + 5 * size * state.elevation]));
  } else if (state.view === "ahead") from = around(0.12 + 0.3 * (state.azimuth - 0.62), 0.1 + 0.3 * (state.elevation - 0.3), 0.85 * reach, middle);
  else if (state.view === "top") from = around(Math.PI, 1.25, 1.2 * reach, middle);
  else if (state.view === "wheel") {
    const wheel = wheels.find(one => one.body === state.axle && one.side > 0) || wheels[0], pose = found[wheel.body];
    to = place(pose, [0, wheel.middle[1] * 0.8, -0.1 * size]);
    from = around(state.azimuth, 0.16 + 0.5 * (state.elevation - 0.3), 0.28 * reach, to);
  } else from = around(state.azimuth, state.elevation, reach, middle);
  const forward = unit(add(to, from, -1)), right = unit(cross(forward, [0, 0, 1])), up = cross(right, forward);
  const focal = 0.95 * Math.max(Math.min(w, 1.6 * h), 0.6 * h), near = 0.12 * size;
  const depth = p => dot(add(p, from, -1), forward);
  const project = p => {
    const d = add(p, from, -1), z = dot(d, forward);
    return z < near ? null : [w / 2 + focal * dot(d, right) / z, h / 2 - focal * dot(d, up) / z, z];
  };
  const ahead = unit([forward[0], forward[1], 0]), slope = dot(up, ahead) / Math.max(dot(forward, ahead), 1e-3);
  return { s, from, project, depth, forward, focal, horizon: h / 2 - focal * slope };
}
function fillRuns(pen, camera, pairs, style) {        // a ribbon between two edges, cut where it is behind the eye
  pen.fillStyle = style;
  pen.beginPath();
  let left = [], right = [];
  const flush = () => {
    if (left.length > 1) {
      pen.moveTo(left[0][0], left[0][1]);
      for (const p of left) pen.lineTo(p[0], p[1]);
      for (let i = right.length - 1; i >= 0; i--) pen.lineTo(right[i][0], right[i][1]);
      pen.closePath();
    }
    left = []; right = [];
  };
  for (const [a, b] of pairs) {
    const p = camera.project(a), q = camera.project(b);
    if (p && q) { left.push(p); right.push(q); } else flush();
  }
  flush();
  pen.fill();
}
function polygon(pen, points) {
  pen.beginPath();
  for (let i = 0; i < points.length; i++) { if (!points[i]) return false; i ? pen.lineTo(points[i][0], points[i][1]) : pen.moveTo(points[i][0], points[i][1]); }
  pen.closePath();
  return true;
}
function strokeRuns(pen, camera, points) {
  pen.beginPath();
  let open = false;
  for (const point of points) {
    const p = camera.project(point);
    if (p) open ? pen.lineTo(p[0], p[1]) : pen.moveTo(p[0], p[1]);
    open = !!p;
  }
  pen.stroke();
}
const noise = n => { const x = Math.sin(127.1 * n + 11.7) * 43758.5453; return x - Math.floor(x); };

function drawGround(pen, w, h, camera) {
  const y = Math.min(Math.max(camera.horizon, -h), 2 * h);
  let wash = pen.createLinearGradient(0, Math.min(y - h, -1), 0, y);
  wash.addColorStop(0, colour.sky); wash.addColorStop(1, colour.sky2);
  pen.fillStyle = wash; pen.fillRect(0, 0, w, Math.max(y, 0));
  wash = pen.createLinearGradient(0, y, 0, Math.max(h, y + 1));
  wash.addColorStop(0, colour.ground2); wash.addColorStop(Math.min(1, 0.55), colour.ground);
  pen.fillStyle = wash; pen.fillRect(0, Math.max(y, 0), w, h);
  pen.fillStyle = shade("ground", 0.86);               // tufts, so that motion is seen
  const step = 2.2 * size, first = Math.ceil((camera.s - 45 * size) / step), last = Math.floor((camera.s + 90 * size) / step);
  pen.beginPath();
  for (let n = first; n <= last; n++) {
    const s = n * step;
    if (s < design.from || s > lineEnd) continue;
    const side = noise(n) < 0.5 ? -1 : 1, p = camera.project(onTrack(s, side * (2.6 + 22 * noise(n + 0.3) ** 2) * size, -0.45 * size));
    if (!p) continue;
    const r = camera.focal * (0.12 + 0.22 * noise(n + 0.6)) * size / p[2];
    if (r > 90) continue;
    pen.moveTo(p[0] + r, p[1]); pen.ellipse(p[0], p[1], r, 0.35 * r, 0, 0, 7);
  }
  pen.fill();
}
function placesOf(camera) {
  const places = [], lo = Math.max(camera.s - 45 * size, design.from), hi = Math.min(camera.s + 150 * size, lineEnd);
  for (let s = lo; s < hi;) {
    places.push(s);
    const far = Math.abs(s - camera.s) / size;
    s += (far < 14 ? 0.25 : far < 45 ? 0.8 : 2.5) * size;
  }
  return places;
}
function drawTrack(pen, camera) {
  const places = placesOf(camera), half = data.tape_m, e = state.times;
  const frames = places.map(trackAt), at = (f, y, z) => add(f.origin, turn(f.axes, [0, y, z]));
  fillRuns(pen, camera, frames.map(f => [at(f, 2.35 * size, -0.45 * size), at(f, -2.35 * size, -0.45 * size)]), shade("ballast", 0.8));
  fillRuns(pen, camera, frames.map(f => [at(f, 1.6 * size, -0.2 * size), at(f, -1.6 * size, -0.2 * size)]), colour.ballast);
  pen.fillStyle = colour.sleeper;
  const step = 0.6 * size, first = Math.ceil(Math.max(camera.s - 25 * size, design.from) / step), last = Math.floor(Math.min(camera.s + 60 * size, lineEnd) / step);
  pen.beginPath();
  for (let n = first; n <= last; n++) {
    const f = trackAt(n * step), wide = 0.13 * size, long = 1.28 * size;
    const quad = [[-wide, -long], [wide, -long], [wide, long], [-wide, long]].map(([x, y]) => camera.project(add(f.origin, turn(f.axes, [x, y, -0.17 * size]))));
    if (quad.some(p => !p)) continue;
    pen.moveTo(quad[0][0], quad[0][1]);
    for (const p of quad.slice(1)) pen.lineTo(p[0], p[1]);
    pen.closePath();
  }
  pen.fill();
  const bent = places.map(s => along(rails, s)), wide = 0.036 * size;
  for (const side of [1, -1]) {
    const k = side > 0 ? 0 : 2;
    const edge = (i, y, z) => at(frames[i], side * (half + y) + e * bent[i][k], z + e * bent[i][k + 1]);
    const rows = [...places.keys()];
    fillRuns(pen, camera, rows.map(i => [edge(i, -wide, 0), edge(i, -wide * 0.5, -0.16 * size)]), shade("rail", 0.75));
    fillRuns(pen, camera, rows.map(i => [edge(i, wide, 0), edge(i, wide * 0.5, -0.16 * size)]), shade("rail", 0.75));
    fillRuns(pen, camera, rows.map(i => [edge(i, -wide, 0), edge(i, wide, 0)]), colour.railtop);
    if (e > 0) {                                       // where the rail would lie by design
      pen.strokeStyle = colour.design; pen.lineWidth = 1.1; pen.globalAlpha = 0.75; pen.setLineDash([6, 5]);
      strokeRuns(pen, camera, frames.map(f => at(f, side * half, 0.004 * size)));
      pen.setLineDash([]); pen.globalAlpha = 1;
    }
  }
  pen.font = "12px system-ui, sans-serif"; pen.textAlign = "center";
  const power = 10 ** Math.floor(Math.log10(20 * size)), post = power * [1, 2, 5, 10].find(one => one * power >= 13 * size), label = data.origin_m;
  for (let n = Math.ceil((places[0] + label) / post); n * post - label < Math.min(camera.s + 110 * size, lineEnd); n++) {
    const s = n * post - label, foot = camera.project(onTrack(s, 2.9 * size, -0.4 * size)), head = camera.project(onTrack(s, 2.9 * size, 1.0 * size));
    if (!foot || !head) continue;
    pen.strokeStyle = colour.muted; pen.lineWidth = Math.max(1, 40 * size / head[2]);
    pen.beginPath(); pen.moveTo(foot[0], foot[1]); pen.lineTo(head[0], head[1]); pen.stroke();
    const scale = Math.min(1.6, 16 * size / head[2]);
    if (scale < 0.35) continue;
    pen.font = `${Math.round(13 * scale)}px system-ui, sans-serif`;
    const text = `${Math.round(n * post * 10) / 10} m`, tw = pen.measureText(text).width + 10 * scale;
    pen.fillStyle = colour.panel; pen.fillRect(head[0] - tw / 2, head[1] - 18 * scale, tw, 18 * scale);
    pen.fillStyle = colour.ink; pen.fillText(text, head[0], head[1] - 4.5 * scale);
  }
}
function boxFaces(camera, pose, box) {                 // its faces that look at the eye, farthest first
  const corners = box.corners.map(c => place(pose, c)), found = [];
  for (const face of data.faces) {
    const [a, b, c] = [corners[face[0]], corners[face[1]], corners[face[2]]];
    const normal = unit(cross(add(b, a, -1), add(c, b, -1)));
    found.push({ points: face.map(i => corners[i]), normal, front: dot(normal, add(a, camera.from, -1)) < 0 });
  }
  return found;
}
function paintBox(pen, camera, pose, box) {
  pen.lineJoin = "round";
  for (const face of boxFaces(camera, pose, box)) {
    if (!face.front || !polygon(pen, face.points.map(camera.project))) continue;
    pen.fillStyle = pen.strokeStyle = shade(box.kind, 0.6 + 0.5 * Math.max(dot(face.normal, SUN), -0.2));
    pen.fill(); pen.lineWidth = 0.8; pen.stroke();
  }
}
const ROUND = 30, circle = [...Array(ROUND).keys()].map(i => [Math.cos(2 * Math.PI * i / ROUND), Math.sin(2 * Math.PI * i / ROUND)]);
function paintWheel(pen, camera, pose, wheel, frame) {
  const spin = row(wheel.turned, 1, frame)[0], [mx, my, mz] = wheel.middle, side = wheel.side;
  const outer = my + side * 0.5 * wheel.width, inner = my - side * 0.5 * wheel.width, step = inner + side * 0.22 * wheel.width;
  const ring = (y, r) => circle.map(([c, s]) => place(pose, [mx + r * c, y, mz + r * s]));
  const axis = turn(pose.axes, [0, side, 0]), outside = dot(axis, add(camera.from, place(pose, [mx, outer, mz]), -1)) > 0;
  const disc = (points, style) => { if (polygon(pen, points.map(camera.project))) { pen.fillStyle = style; pen.fill(); } };
  const tread = (ya, ra, yb, rb) => {
    const a = ring(ya, ra), b = ring(yb, rb);
    for (let i = 0; i < ROUND; i++) {
      const j = (i + 1) % ROUND, m = (i + 0.5) * 2 * Math.PI / ROUND, normal = turn(pose.axes, [Math.cos(m), 0, Math.sin(m)]);
      if (dot(normal, add(a[i], camera.from, -1)) > 0) continue;
      if (!polygon(pen, [a[i], a[j], b[j], b[i]].map(camera.project))) continue;
      pen.fillStyle = pen.strokeStyle = shade("disc", 0.5 + 0.45 * Math.max(dot(normal, SUN), 0)); pen.fill(); pen.lineWidth = 0.6; pen.stroke();
    }
  };
  const face = (y, style) => {                         // hub, spokes and one white mark: it is seen to turn
    disc(ring(y, 0.87 * wheel.radius), style);
    for (let k = 0; k < 6; k++) {
      const from = spin + k * Math.PI / 3, blade = [];
      for (const [r, d] of [[0.26, -0.22], [0.76, -0.30], [0.76, 0.30], [0.26, 0.22]]) {
        const a = from + d; blade.push(place(pose, [mx + r * wheel.radius * Math.sin(a), y, mz + r * wheel.radius * Math.cos(a)]));
      }
      disc(blade, k ? shade("disc", 0.52) : colour.mark);
    }
    disc(ring(y, 0.16 * wheel.radius), shade("axle", 0.8));
  };
  const light = 0.62 + 0.38 * Math.max(dot(axis, SUN) * (outside ? 1 : -1), -0.3), flange = wheel.radius + wheel.flange;
  if (outside) {
    disc(ring(inner, flange), shade("disc", 0.66)); tread(inner, flange, step, flange); disc(ring(step, flange), shade("disc", light * 0.9));
    tread(step, wheel.radius, outer, wheel.radius); disc(ring(outer, wheel.radius), shade("disc", light * 1.12)); face(outer, shade("disc", light * 0.86));
  } else {
    disc(ring(outer, wheel.radius), shade("disc", 0.66)); tread(step, wheel.radius, outer, wheel.radius); tread(inner, flange, step, flange);
    disc(ring(inner, flange), shade("disc", light * 1.1)); face(inner, shade("disc", light * 0.86));
  }
}
function paintCar(pen, camera, found) {
  for (const front of [false, true]) for (const box of data.boxes) {
    if (box.kind !== "car" && box.kind !== "window") continue;
    if (box.kind === "window" && !front) continue;
    for (const face of boxFaces(camera, found[box.body], box)) {
      if (face.front !== front || !polygon(pen, face.points.map(camera.project))) continue;
      pen.globalAlpha = box.kind === "window" ? 0.55 : front ? 0.36 : 0.2;
      pen.fillStyle = shade(box.kind, 0.7 + 0.45 * Math.max(dot(face.normal, SUN), 0)); pen.fill();
      if (box.kind === "car") { pen.globalAlpha = front ? 0.9 : 0.35; pen.strokeStyle = shade("car", 0.75); pen.lineWidth = front ? 1.6 : 1; pen.stroke(); }
    }
  }
  pen.globalAlpha = 1;
}
function arrow(pen, a, b, style, width = 2.4) {
  const dx = b[0] - a[0], dy = b[1] - a[1], n = Math.hypot(dx, dy);
  if (n < 1.5) return;
  const ux = dx / n, uy = dy / n, head = Math.min(9, 0.6 * n);
  pen.strokeStyle = pen.fillStyle = style; pen.lineWidth = width; pen.lineCap = "round";
  pen.beginPath(); pen.moveTo(a[0], a[1]); pen.lineTo(b[0] - ux * head * 0.7, b[1] - uy * head * 0.7); pen.stroke();
  pen.beginPath(); pen.moveTo(b[0], b[1]); pen.lineTo(b[0] - ux * head - uy * head * 0.5, b[1] - uy * head + ux * head * 0.5);
  pen.lineTo(b[0] - ux * head + uy * head * 0.5, b[1] - uy * head - ux * head * 0.5); pen.fill();
}
function drawShadow(pen, camera, found) {
  const x = wheels.map(wheel => found[wheel.body].s), lo = Math.min(...x) - 0.6 * size, hi = Math.max(...x) + 0.6 * size, pairs = [];
  for (let i = 0; i <= 16; i++) { const f = trackAt(lo + (hi - lo) * i / 16); pairs.push([add(f.origin, turn(f.axes, [0, 1.25 * size, -0.14 * size])), add(f.origin, turn(f.axes, [0, -1.25 * size, -0.14 * size]))]); }
  pen.globalAlpha = 0.34; fillRuns(pen, camera, pairs, "#000000"); pen.globalAlpha = 1;
}
function drawHorizons(pen, camera, found, frame) {     // level lines through the IMU, true and as estimated
  const pose = found[data.imu.body];
  if (!pose) return;
  const middle = place(pose, data.imu.place), f = trackAt(pose.s), level = [-Math.sin(f.yaw), Math.cos(f.yaw), 0], long = 1.7 * size;
  const p = camera.project(middle);
  const line = (way, style, dash) => {
    const a = camera.project(add(middle, way, long)), b = camera.project(add(middle, way, -long));
    if (!a || !b) return;
    pen.setLineDash(dash); pen.strokeStyle = style; pen.lineWidth = 3; pen.beginPath(); pen.moveTo(a[0], a[1]); pen.lineTo(b[0], b[1]); pen.stroke(); pen.setLineDash([]);
  };
  line(level, colour.true, []);
  if (state.method && attitude.estimated[state.method]) {
    const off = magnified * (row(attitude.true, 2, frame)[0] - row(attitude.estimated[state.method], 2, frame)[0]);
    line(add([level[0] * Math.cos(off), level[1] * Math.cos(off), 0], [0, 0, Math.sin(off)]), colour.estimated, [8, 5]);
  }
  if (p) { pen.fillStyle = colour.panel; pen.strokeStyle = colour.ink; pen.lineWidth = 1.5; pen.beginPath(); pen.rect(p[0] - 5, p[1] - 4, 10, 8); pen.fill(); pen.stroke(); }
}
function drawScene(frame, found) {
  const { pen, w, h } = fit($("scene"), quality), camera = cameraOf(w, h, frame, found);
  drawGround(pen, w, h, camera); drawTrack(pen, camera); drawShadow(pen, camera, found);
  const items = [];
  for (const box of data.boxes) if (box.kind === "axle" || box.kind === "frame") {
    const middle = box.corners.reduce((sum, c) => add(sum, c, 0.125), [0, 0, 0]);
    items.push({ depth: camera.depth(place(found[box.body], middle)), paint: () => paintBox(pen, camera, found[box.body], box) });
  }
  for (const wheel of wheels) items.push({ depth: camera.depth(place(found[wheel.body], wheel.middle)), paint: () => paintWheel(pen, camera, found[wheel.body], wheel, frame) });
  items.sort((a, b) => b.depth - a.depth).forEach(item => item.paint());
  if (state.car) paintCar(pen, camera, found);
  drawHorizons(pen, camera, found, frame);
  if (state.arrows) for (const wheel of wheels) {
    if (!wheel.forces) continue;
    const [load, guiding] = row(wheel.forces, 5, frame), pose = found[wheel.body], scale = 0.9 * size / (wheel.static_n || 1);
    const foot = place(pose, [0, wheel.middle[1] + wheel.side * 0.12 * size, -wheel.radius]), f = trackAt(pose.s);
    const a = camera.project(foot), up = camera.project(add(foot, turn(f.axes, [0, 0, load * scale]))), beside = camera.project(add(foot, turn(f.axes, [0, 2 * guiding * scale, 0])));
    if (a && up) arrow(pen, a, up, colour.load, 3);
    if (a && beside) arrow(pen, a, beside, colour.guiding, 3);
  }
  const s = camera.s + data.origin_m, speed = 3.6 * hz * (reference[Math.min(Math.floor(frame) + 1, count - 1)] - reference[Math.min(Math.floor(frame), count - 2)]);
  const here = trackAt(camera.s), there = trackAt(camera.s + design.step), bend = (there.yaw - here.yaw) / design.step;
  $("place").textContent = `s = ${s.toFixed(1)} m`;
  $("velocity").textContent = `${speed.toFixed(1)} km/h`;
  const radius = Math.abs(1 / bend), cant = along(design, camera.s)[5] * 1500 * size;
  $("bend").textContent = radius < 5000 * size ? `${bend > 0 ? "left" : "right"}, R ${Math.round(radius)} m, cant ${Math.abs(cant).toFixed(0)} mm` : "straight";
}

// ---- wheels on their rails ----------------------------------------------------------------------------------
function drawFront(frame, found) {
  const { pen, w, h } = fit($("front"), Math.min(window.devicePixelRatio || 1, 2));
  pen.clearRect(0, 0, w, h);
  const { wheel: outline, rail, offset } = data.profiles, half = data.tape_m, zoom = 0.5 * w / (0.2 * size), y0 = h * 0.62;
  for (const wheel of wheels) {
    if (wheel.body !== state.axle) continue;
    const pose = found[wheel.body], side = wheel.side, k = side > 0 ? 0 : 2, bent = along(rails, pose.s);
    const cx = w / 2 - side * w / 4, raw = row(bodies[wheel.body].pose, 6, frame), lateral = raw[1], vertical = raw[2], roll = raw[3];
    // Outward is to the left for the left wheel; the rail stands still in the picture.
    const X = y => cx - (y - side * half - bent[k]) * zoom, Z = z => y0 - (z - bent[k + 1]) * zoom;
    pen.save(); pen.beginPath(); pen.rect(side > 0 ? 0 : w / 2 + 1, 0, w / 2 - 1, h); pen.clip();
    pen.beginPath();
    rail.forEach(([e, z], i) => { const x = X(side * (half + e - offset) + bent[k]), y = Z(z + bent[k + 1]); i ? pen.lineTo(x, y) : pen.moveTo(x, y); });
    const foot = [rail[rail.length - 1], rail[0]].map(([e]) => X(side * (half + e - offset) + bent[k]));
    pen.lineTo(foot[0], h + 5); pen.lineTo(foot[1], h + 5); pen.closePath();
    pen.fillStyle = shade("rail", 1.1); pen.globalAlpha = 0.55; pen.fill(); pen.globalAlpha = 1; pen.strokeStyle = colour.rail; pen.lineWidth = 1.4; pen.stroke();
    const point = (u, d) => { const y = side * (half + u), z = d - wheel.radius; return [X(lateral + y - roll * z), Z(vertical + z + roll * y)]; };
    pen.beginPath();
    outline.forEach(([u, d], i) => { const p = point(u, d); i ? pen.lineTo(p[0], p[1]) : pen.moveTo(p[0], p[1]); });
    const [first, last] = [outline[0], outline[outline.length - 1]], top = 0.118 * size;
    for (const u of [last[0], first[0]]) { const p = point(u, top); pen.lineTo(p[0], p[1]); }
    pen.closePath(); pen.fillStyle = colour.disc; pen.globalAlpha = 0.4; pen.fill(); pen.globalAlpha = 1; pen.strokeStyle = colour.axle; pen.stroke();
    pen.restore();
    pen.font = "12px system-ui, sans-serif"; pen.textAlign = "center"; pen.fillStyle = colour.muted;
    pen.fillText(`${side > 0 ? "left" : "right"}, ${(1e3 * (lateral + wheel.radius * roll - bent[k]) * side).toFixed(2)} mm outward`, cx, 13);
    if (wheel.forces) {
      const [load, guiding, on, angle, flange] = row(wheel.forces, 5, frame), e = Math.min(Math.max(on, rail[0][0]), rail[rail.length - 1][0]);
      let i = rail.findIndex(p => p[0] >= e); if (i < 1) i = 1;
      const t = (e - rail[i - 1][0]) / (rail[i][0] - rail[i - 1][0] || 1), z = rail[i - 1][1] + t * (rail[i][1] - rail[i - 1][1]);
      const at = [X(side * (half + e - offset) + bent[k]), Z(z + bent[k + 1])], scale = 0.3 * h / (wheel.static_n || 1);
      arrow(pen, at, [at[0], at[1] - load * scale], colour.load);
      arrow(pen, at, [at[0] - 2 * guiding * scale, at[1]], colour.guiding);
      pen.beginPath(); pen.arc(at[0], at[1], 4.5, 0, 7); pen.fillStyle = flange > 0.5 ? colour.estimated : colour.panel; pen.fill(); pen.strokeStyle = colour.estimated; pen.lineWidth = 1.8; pen.stroke();
      pen.textAlign = "center"; pen.font = "12px system-ui, sans-serif";
      const y = h - 24, text = (words, style, line) => { pen.font = "600 12px system-ui, sans-serif"; const tw = pen.measureText(words).width + 10; pen.globalAlpha = 0.86; pen.fillStyle = colour.panel; pen.fillRect(cx - tw / 2, y + 17 * line - 12, tw, 16); pen.globalAlpha = 1; pen.fillStyle = style; pen.fillText(words, cx, y + 17 * line); };
      text(`Q ${(load / 1e3).toPrecision(3)} kN`, colour.load, 0); text(`Y ${(guiding / 1e3).toFixed(load > 2e3 ? 2 : 4)} kN`, colour.guiding, 1);
      if (flange > 0.5) { pen.fillStyle = colour.estimated; pen.fillText("flange", at[0] + side * 30, at[1] + 16); }
    }
  }
  pen.strokeStyle = colour.line; pen.lineWidth = 1; pen.beginPath(); pen.moveTo(w / 2, 6); pen.lineTo(w / 2, h - 6); pen.stroke();
}

// ---- horizon ------------------------------------------------------------------------------------------------
let magnified = 1;
{
  let most = 1e-4;
  for (const values of [attitude.true, ...Object.values(attitude.estimated)]) for (let i = 0; i < values.length; i++) if (Math.abs(values[i]) > most && Math.abs(values[i]) < 1) most = Math.abs(values[i]);
  for (const m of [2, 3, 5, 10, 20, 50, 100]) if (m * most < 0.62) magnified = m;
}
function drawHorizon(frame) {
  const { pen, w, h } = fit($("horizon"), Math.min(window.devicePixelRatio || 1, 2)), r = Math.min(0.47 * h, 0.3 * w), cx = r + 8, cy = h / 2;
  pen.clearRect(0, 0, w, h);
  const actual = row(attitude.true, 2, frame), estimated = state.method && attitude.estimated[state.method] ? row(attitude.estimated[state.method], 2, frame) : null;
  const perRadian = r / 0.75;
  pen.save(); pen.beginPath(); pen.arc(cx, cy, r, 0, 7); pen.clip();
  pen.save(); pen.translate(cx, cy); pen.rotate(-magnified * actual[0]); pen.translate(0, -magnified * actual[1] * perRadian);
  pen.fillStyle = colour.sky; pen.fillRect(-3 * r, -4 * r, 6 * r, 4 * r); pen.fillStyle = colour.ground; pen.fillRect(-3 * r, 0, 6 * r, 4 * r);
  pen.strokeStyle = colour.true; pen.lineWidth = 3; pen.beginPath(); pen.moveTo(-3 * r, 0); pen.lineTo(3 * r, 0); pen.stroke(); pen.restore();
  if (estimated) {
    pen.save(); pen.translate(cx, cy); pen.rotate(-magnified * estimated[0]); pen.translate(0, -magnified * estimated[1] * perRadian);
    pen.strokeStyle = colour.estimated; pen.lineWidth = 2.6; pen.setLineDash([9, 6]); pen.beginPath(); pen.moveTo(-3 * r, 0); pen.lineTo(3 * r, 0); pen.stroke(); pen.setLineDash([]); pen.restore();
  }
  pen.restore();
  pen.strokeStyle = colour.muted; pen.lineWidth = 1;
  for (let k = -3; k <= 3; k++) { const a = -Math.PI / 2 + k * Math.PI / 18 * 1; pen.beginPath(); pen.moveTo(cx + (r - 7) * Math.cos(a), cy + (r - 7) * Math.sin(a)); pen.lineTo(cx + r * Math.cos(a), cy + r * Math.sin(a)); pen.stroke(); }
  pen.beginPath(); pen.arc(cx, cy, r, 0, 7); pen.lineWidth = 2; pen.strokeStyle = colour.line; pen.stroke();
  pen.strokeStyle = colour.ink; pen.lineWidth = 3; pen.beginPath(); pen.moveTo(cx - 0.5 * r, cy); pen.lineTo(cx - 0.16 * r, cy); pen.lineTo(cx, cy + 0.1 * r); pen.lineTo(cx + 0.16 * r, cy); pen.lineTo(cx + 0.5 * r, cy); pen.stroke();
  const x = 2 * r + 26, deg = a => (a * 180 / Math.PI), signed = v => (v < 0 ? "\u2212" : "+") + Math.abs(v).toFixed(2) + "°";
  pen.textAlign = "left";
  const write = (words, y, style, font) => { pen.font = font; pen.fillStyle = style; pen.fillText(words, x, y); };
  ["roll", "pitch"].forEach((angle, k) => {
    const y = cy - 0.36 * h + k * 0.4 * h;
    write(angle, y, colour.muted, "12px system-ui, sans-serif");
    write(signed(deg(actual[k])), y + 17, colour.true, "600 14px system-ui, sans-serif");
    if (estimated) { write(signed(deg(estimated[k])), y + 34, colour.estimated, "600 14px system-ui, sans-serif"); write("error " + signed(deg(estimated[k] - actual[k])), y + 50, colour.ink, "12px system-ui, sans-serif"); }
  });
  $("magnified").textContent = `angles × ${magnified}`;
}

// ---- signals: drawn once, a cursor moves over them ----------------------------------------------------------
const strips = document.createElement("div"); strips.id = "strips";
strips.style.cssText = "position:relative";
$("signals").replaceWith(strips); strips.append(Object.assign(document.createElement("canvas"), { id: "signals" }));
$("signals").setAttribute("role", "img"); $("signals").setAttribute("aria-label", "Signals over time");
const cursor = document.createElement("div");
cursor.style.cssText = "position:absolute;top:0;bottom:18px;width:2px;margin-left:-1px;background:var(--accent);pointer-events:none;left:0;will-change:transform";
strips.append(cursor);
const readings = signals.map(() => { const span = document.createElement("span"); span.style.cssText = "position:absolute;left:0;font-size:12.5px;font-variant-numeric:tabular-nums;pointer-events:none;white-space:nowrap"; strips.append(span); return span; });
let strip = { left: 0, width: 1 };
function linesOf(signal) {
  const found = [], palette = [colour.load, colour.guiding, colour.muted];
  for (const name in signal.methods) if (name !== state.method) found.push({ values: signal.methods[name], style: colour.muted, width: 0.8, alpha: 0.32, name });
  Object.entries(signal.lines).forEach(([name, values], i) => found.push({ values, style: name === "true" ? colour.true : palette[i % 3], width: 1.5, alpha: 1, name, shown: true }));
  if (signal.methods[state.method]) found.push({ values: signal.methods[state.method], style: colour.estimated, width: 1.5, alpha: 1, name: state.method, shown: true });
  return found;
}
function drawSignals() {
  const { pen, w, h } = fit($("signals"), Math.min(window.devicePixelRatio || 1, 2));
  pen.clearRect(0, 0, w, h);
  const small = w < 560, left = small ? 70 : 128, right = 8, foot = 18, each = (h - foot) / signals.length;
  strip = { left, width: w - left - right };
  const X = i => left + strip.width * i / (count - 1);
  signals.forEach((signal, n) => {
    const top = n * each + 4, high = each - 9, lines = linesOf(signal);
    let lo = Infinity, hi = -Infinity;
    for (const line of lines) if (line.shown) for (const v of line.values) { if (v < lo) lo = v; if (v > hi) hi = v; }
    if (!(hi > lo)) { const m = Number.isFinite(lo) ? lo : 0; lo = m - 1; hi = m + 1; }
    if (hi - lo < signal.least) { const m = 0.5 * (hi + lo); lo = m - 0.5 * signal.least; hi = m + 0.5 * signal.least; }
    const pad = 0.07 * (hi - lo), Y = v => top + high * (1 - (v - lo + pad) / (hi - lo + 2 * pad));
    pen.strokeStyle = colour.line; pen.lineWidth = 1; pen.strokeRect(left, top, strip.width, high);
    if (lo < 0 && hi > 0) { pen.beginPath(); pen.moveTo(left, Y(0)); pen.lineTo(left + strip.width, Y(0)); pen.stroke(); }
    pen.save(); pen.beginPath(); pen.rect(left, top, strip.width, high); pen.clip(); pen.lineJoin = "round";
    for (const line of lines) {
      pen.strokeStyle = line.style; pen.lineWidth = line.width; pen.globalAlpha = line.alpha; pen.beginPath();
      for (let i = 0; i < count; i++) i ? pen.lineTo(X(i), Y(line.values[i])) : pen.moveTo(X(i), Y(line.values[i]));
      pen.stroke();
    }
    pen.restore(); pen.globalAlpha = 1;
    pen.fillStyle = colour.ink; pen.font = `600 ${small ? 11 : 12.5}px system-ui, sans-serif`; pen.textAlign = "left"; pen.fillText(signal.label, 0, top + 13);
    pen.fillStyle = colour.muted; pen.font = "10.5px system-ui, sans-serif"; pen.textAlign = "right";
    const word = v => Math.abs(v) >= 100 ? v.toFixed(0) : Math.abs(v) >= 10 ? v.toFixed(1) : v.toFixed(2);
    if (!small && high > 34) { pen.fillText(word(hi), left - 5, top + 9); pen.fillText(word(lo), left - 5, top + high - 1); }
    readings[n].style.top = `${top + 17}px`;
  });
  pen.fillStyle = colour.muted; pen.font = "11px system-ui, sans-serif"; pen.textAlign = "center";
  const step = [1, 2, 5, 10, 20, 50, 100].find(one => length / one < (small ? 6 : 13)) || 100;
  for (let t = Math.ceil(data.start_s / step) * step; t <= data.start_s + length; t += step) pen.fillText(`${t} s`, left + strip.width * (t - data.start_s) / length, h - 4);
}
function drawReadings(frame) {
  cursor.style.transform = `translateX(${strip.left + strip.width * frame / (count - 1)}px)`;
  signals.forEach((signal, n) => {
    const words = linesOf(signal).filter(line => line.shown).map(line => `<span style="color:${line.style}">${row(line.values, 1, frame)[0].toFixed(2)}</span>`);
    readings[n].innerHTML = words.join(" ") + ` <span style="color:var(--muted)">${signal.unit}</span>`;
  });
}

// ---- clock --------------------------------------------------------------------------------------------------
function draw() {
  const frame = state.t * hz, found = poses(frame);
  drawScene(frame, found);
  // While it plays, the small pictures take turns: each is drawn in every second frame.
  if (!state.playing || state.drawn % 2) drawFront(frame, found);
  if (!state.playing || state.drawn % 2 === 0) { drawHorizon(frame); drawReadings(frame); }
  $("clock").textContent = `${(data.start_s + state.t).toFixed(2)} s`;
  $("scrub").value = state.t;
  state.drawn++; state.dirty = false;
}
function seek(t) { state.t = Math.min(Math.max(t, 0), length); anchor = { t: state.t, now: performance.now() }; state.dirty = true; }
function play(on) {
  if (on && state.t >= length - 1e-6) seek(0);
  state.playing = on; anchor = { t: state.t, now: performance.now() };
  $("play").textContent = on ? "\u275A\u275A" : "\u25B6";
}
let gap = 20, before = 0, calm = 0;
function tick(now) {
  if (state.playing) {
    state.t = Math.min(anchor.t + state.speed * Math.max(now - anchor.now, 0) / 1e3, length);
    state.dirty = true;
    if (state.t >= length) play(false);
    if (now - before < 500) gap += 0.08 * (now - before - gap);
    if (gap > 52 && quality > 0.65) { quality *= 0.8; gap = 30; calm = 0; }   // fewer dots before fewer frames
    if (gap > 20) calm = 0;
    else if (quality < FULL && ++calm > 300) { quality = Math.min(FULL, quality / 0.8); calm = 0; }
  }
  before = now;
  if (state.dirty) draw();
  requestAnimationFrame(tick);
}
function layout() { readColours(); drawSignals(); state.dirty = true; }
function choose(method) { state.method = method; if ($("method")) $("method").value = method; layout(); }
function look(view) { state.view = view; document.querySelectorAll("#views button").forEach(one => one.classList.toggle("on", one.dataset.view === view)); state.dirty = true; }

$("scrub").max = length;
$("scrub").addEventListener("input", event => seek(+event.target.value));
$("play").addEventListener("click", () => play(!state.playing));
$("speed").addEventListener("change", event => { state.speed = +event.target.value; anchor = { t: state.t, now: performance.now() }; });
if ($("method")) $("method").addEventListener("change", event => choose(event.target.value));
if ($("axle")) $("axle").addEventListener("change", event => { state.axle = event.target.value; state.dirty = true; });
$("exaggeration").addEventListener("input", event => { state.times = +event.target.value; $("times").textContent = state.times; state.dirty = true; });
$("car").addEventListener("change", event => { state.car = event.target.checked; state.dirty = true; });
if ($("arrows")) $("arrows").addEventListener("change", event => { state.arrows = event.target.checked; state.dirty = true; });
document.querySelectorAll("#views button").forEach(one => one.addEventListener("click", () => look(one.dataset.view)));
$("theme").addEventListener("click", () => { const root = document.documentElement; root.dataset.theme = root.dataset.theme === "dark" ? "light" : "dark"; layout(); });
let drag = null;
const stage = $("scene");
stage.addEventListener("pointerdown", event => { drag = [event.clientX, event.clientY]; stage.setPointerCapture(event.pointerId); });
stage.addEventListener("pointermove", event => {
  if (!drag) return;
  state.azimuth -= (event.clientX - drag[0]) * 0.006; state.elevation = Math.min(Math.max(state.elevation + (event.clientY - drag[1]) * 0.005, 0.03), 1.45);
  drag = [event.clientX, event.clientY]; state.dirty = true;
});
stage.addEventListener("pointerup", () => { drag = null; });
stage.addEventListener("wheel", event => { event.preventDefault(); state.distance = Math.min(Math.max(state.distance * Math.exp(event.deltaY * 0.001), 2), 80); state.dirty = true; }, { passive: false });
const toTime = event => { const box = $("signals").getBoundingClientRect(); seek(length * (event.clientX - box.left - strip.left) / strip.width); };
$("signals").addEventListener("pointerdown", event => { toTime(event); $("signals").setPointerCapture(event.pointerId); });
$("signals").addEventListener("pointermove", event => { if (event.buttons) toTime(event); });
document.addEventListener("keydown", event => {
  if (["SELECT", "INPUT"].includes(event.target.tagName) && event.target.id !== "scrub") return;
  if (event.key === " " && event.target.id !== "play") { event.preventDefault(); play(!state.playing); }
  if (event.key === "ArrowLeft" || event.key === "ArrowRight") { event.preventDefault(); play(false); seek(state.t + (event.key === "ArrowRight" ? 1 : -1) / hz * (event.shiftKey ? 25 : 1)); }
});
new ResizeObserver(layout).observe(document.querySelector("main"));

const root = document.documentElement;
const hash = new URLSearchParams(location.hash.slice(1));
if (!root.dataset.theme) root.dataset.theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
if (hash.get("theme")) root.dataset.theme = hash.get("theme");
state.axle = $("axle") ? $("axle").value : wheels[0].body;
const reach = Math.max(...wheels.map(wheel => bodies[wheel.body].pose[0])) - Math.min(...wheels.map(wheel => bodies[wheel.body].pose[0]));
state.distance = Math.max(7.5, 4.8 + 2.1 * reach / size);
readColours();
if (hash.get("x")) { $("exaggeration").value = hash.get("x"); $("exaggeration").dispatchEvent(new Event("input")); }
if (hash.get("car") === "0") { $("car").checked = false; state.car = false; }
if (hash.get("view")) look(hash.get("view"));
if (hash.get("method") && hash.get("method") in attitude.estimated) choose(hash.get("method"));
if (hash.get("azimuth")) state.azimuth = +hash.get("azimuth");
seek(+hash.get("t") || 0);
play(hash.get("play") !== "0" && !matchMedia("(prefers-reduced-motion: reduce)").matches);
layout();
window.film = { state, seek, play, choose, look, length, hz, get frame() { return Math.round(state.t * hz); } };
requestAnimationFrame(tick);
})();
