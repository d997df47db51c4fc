"use strict";
// Plays packed runs: particles as shaded discs, drawn into a picture of its own, so that every browser shows the same.
// mark of a particle that is not there; how long a run plays, and how long drawing a frame may take while it does [ms]
const NOWHERE = 65535, PLAYED = 6000, SLOW = 25;

async function unpack(text) {
  const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

class Run {
  // The arrays of one run: positions per axis and frame, fields per frame, body per particle.
  constructor(header, bytes) {
    Object.assign(this, header);
    const n = this.count, frames = this.times.length, size = n * frames;
    this.position = [];
    let at = 0;
    for (let axis = 0; axis < this.dimensions; axis++) {
      const values = new Uint16Array(size);
      for (let k = 0; k < size; k++) values[k] = (bytes[at + k] << 8) | bytes[at + size + k];
      this.position.push(values);
      at += 2 * size;
    }
    this.values = {};
    for (const field of this.fields) { this.values[field.name] = bytes.subarray(at, at + size); at += size; }
    this.body = bytes.subarray(at, at + n);
    if (this.dimensions === 1) this.position.push(new Uint16Array(size));  // a profile fills it in
  }
  at(axis, value) { return this.low[axis] + value / 65534 * (this.high[axis] - this.low[axis]); }
  frame(time) {  // the last frame that is not after a time
    let k = 0;
    while (k + 1 < this.times.length && this.times[k + 1] <= time * (1 + 1e-9)) k++;
    return k;
  }
}

class View {
  // One picture of a run: camera, bodies shown, field.
  constructor(run, canvas, tables) {
    this.run = run; this.canvas = canvas; this.tables = tables;
    this.field = run.fields.length ? run.fields[0].name : "body";
    this.shown = run.bodies.map(() => true);
    this.mirrored = run.planes.length > 0 || run.kinematics === "axisymmetric";
    this.whole = run.dimensions === 1;  // whether the colour scale is that of the run, not of the moment
    this.reset();
  }
  reset() {
    const run = this.run;
    this.yaw = run.dimensions === 3 ? -0.5 : 0; this.pitch = run.dimensions === 3 ? 0.35 : 0;
    this.zoom = 1; this.pan = [0, 0];
  }
  signs() {  // one entry for each copy of the model: a sign for each axis
    let copies = [[1, 1, 1]];
    if (!this.mirrored) return copies;
    const planes = this.run.kinematics === "axisymmetric" ? [1] : this.run.planes;
    for (const axis of planes) copies = copies.concat(copies.map(c => c.map((s, k) => k === axis ? -s : s)));
    return copies;
  }
  camera() {  // scale, middle, and the turned axes of the screen
    const run = this.run, [low, high] = run.view.map(ends => ends.slice());
    for (const copy of this.signs()) for (let k = 0; k < run.dimensions; k++) if (copy[k] < 0) {
      low[k] = Math.min(low[k], -run.view[1][k]); high[k] = Math.max(high[k], -run.view[0][k]);
    }
    const margin = 1.5 * run.spacing;
    const middle = low.map((l, k) => 0.5 * (l + high[k]));
    const size = low.map((l, k) => high[k] - l + 2 * margin);
    const cy = Math.cos(this.yaw), sy = Math.sin(this.yaw), cp = Math.cos(this.pitch), sp = Math.sin(this.pitch);
    // x to the right, y up, z towards the eye, turned about y and then about the screen's x
    const right = [cy, 0, sy], up = [sp * sy, cp, -sp * cy], eye = [-cp * sy, sp, cp * cy];
    let width = size[0], height = size[1] || size[0];
    if (run.dimensions === 3) {
      width = right.reduce((s, r, k) => s + Math.abs(r) * size[k], 0);
      height = up.reduce((s, r, k) => s + Math.abs(r) * size[k], 0);
    }
    const scale = this.zoom * Math.min(this.canvas.width / width, this.canvas.height / height);
    return {scale, middle, right, up, eye};
  }
  scale(frame) {  // first and last of the 256 steps of the run's scale: all, or those of the moment less its outermost 0.5 %
    const {run} = this, values = run.values[this.field], counts = new Uint32Array(256);
    if (this.whole || !values) return [0, 255];
    let all = 0;
    for (let i = 0, at = frame * run.count; i < run.count; i++, at++)
      if (run.position[0][at] !== NOWHERE && this.shown[run.body[i]]) { counts[values[at]]++; all++; }
    let first = 0, last = 255;
    for (let below = counts[0]; first < 255 && below <= 0.005 * all; below += counts[++first]);
    for (let above = counts[255]; last > first && above <= 0.005 * all; above += counts[--last]);
    return [first, Math.max(last, first + 1)];
  }
  colours() {  // 256 colours by 4 shades, as pixels
    const field = this.run.fields.find(f => f.name === this.field);
    const table = new Uint32Array(1024), rgb = field ? this.tables[field.colours] : null;
    for (let shade = 0; shade < 4; shade++) for (let k = 0; k < 256; k++) {
      const dim = this.run.dimensions === 3 ? 0.55 + 0.15 * shade : 1;
      const [first, last] = this.span, j = rgb ? Math.max(0, Math.min(255, Math.round(255 * (k - first) / (last - first)))) : k;
      const c = rgb ? rgb.subarray(3 * j, 3 * j + 3) : hex((this.run.bodies[k] || {colour: "#000000"}).colour);
      table[shade * 256 + k] = 0xff000000 | (c[2] * dim) << 16 | (c[1] * dim) << 8 | (c[0] * dim);
    }
    return table;
  }
  buffers(fold) {  // what is drawn into: as large as the canvas, or a fold smaller
    const {canvas} = this, sheet = fold === 1 ? canvas : document.createElement("canvas");
    if (fold > 1) Object.assign(sheet, {width: canvas.width / fold, height: canvas.height / fold});
    const W = sheet.width, H = sheet.height, picture = sheet.getContext("2d").createImageData(W, H);
    return {sheet, W, H, picture, depth: new Float32Array(W * H), pick: new Int32Array(W * H)};
  }
  draw(frame, share = 0, fold = 1) {  // a frame, or a share of the way from it to the next one; quickly with a larger fold
    const {run, canvas} = this, n = run.count, base = frame * n, context = canvas.getContext("2d");
    this.span = this.scale(frame);
    const {sheet, W, H, picture, depth, pick} = (this.drawn ??= {})[fold] ??= this.buffers(fold);
    const pixels = new Uint32Array(picture.data.buffer);
    this.pick = this.drawn[1] ? this.drawn[1].pick : new Int32Array(canvas.width * canvas.height).fill(-1);
    pixels.fill(0); depth.fill(-Infinity); pick.fill(-1);
    if (run.dimensions === 1) return this.profile(context, frame);
    const ahead = share > 0 ? n : 0, valued = share < 0.5 ? 0 : ahead;
    const {middle, right, up, eye, ...camera} = this.camera(), scale = camera.scale / fold;
    const colours = this.colours(), values = this.field === "body" ? null : run.values[this.field];
    const solid = run.dimensions === 3, radius = Math.max(0.75 * run.spacing * scale, 0.5), disc = discOf(radius, solid), {dys, dxs, rises, shades} = disc, size = dys.length;
    const step = run.low.map((l, k) => (run.high[k] - l) / 65534);
    const [px, py, pz] = run.position;
    for (const copy of this.signs()) for (let i = 0; i < n; i++) {
      const at = base + i, to = px[at + ahead] === NOWHERE ? at : at + ahead;
      if (px[at] === NOWHERE || !this.shown[run.body[i]]) continue;
      const x = copy[0] * (run.low[0] + step[0] * (px[at] + share * (px[to] - px[at]))) - middle[0];
      const y = copy[1] * (run.low[1] + step[1] * (py[at] + share * (py[to] - py[at]))) - middle[1];
      const z = solid ? copy[2] * (run.low[2] + step[2] * (pz[at] + share * (pz[to] - pz[at]))) - middle[2] : 0;
      const sx = 0.5 * W + this.pan[0] / fold + scale * (x * right[0] + y * right[1] + z * right[2]);
      const sy = 0.5 * H + this.pan[1] / fold - scale * (x * up[0] + y * up[1] + z * up[2]);
      if (!(sx > -radius && sx < W + radius && sy > -radius && sy < H + radius)) continue;
      const sz = solid ? scale * (x * eye[0] + y * eye[1] + z * eye[2]) : 0;
      const colour = values ? values[at + valued] : run.body[i], cx = Math.round(sx), cy = Math.round(sy);
      const inside = cx >= disc.reach && cx + disc.reach < W && cy >= disc.reach && cy + disc.reach < H;
      for (let k = 0; k < size; k++) {
        const row = cy + dys[k], column = cx + dxs[k];
        if (!inside && (row < 0 || row >= H || column < 0 || column >= W)) continue;
        const p = row * W + column, near = sz + rises[k];
        if (near < depth[p]) continue;
        depth[p] = near;
        pixels[p] = colours[shades[k] + colour];
        pick[p] = i;
      }
    }
    sheet.getContext("2d").putImageData(picture, 0, 0);
    if (fold === 1) return;
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.drawImage(sheet, 0, 0, canvas.width, canvas.height);
  }
  profile(context, frame) {  // a field over x, a line for each body
    const {run, canvas} = this, W = canvas.width, H = canvas.height, base = frame * run.count;
    context.clearRect(0, 0, W, H);
    const values = run.values[this.field] || run.body;
    for (let b = 0; b < run.bodies.length; b++) {
      if (!this.shown[b]) continue;
      const own = [];
      for (let i = 0; i < run.count; i++)
        if (run.body[i] === b && run.position[0][base + i] !== NOWHERE) own.push(i);
      own.sort((a, c) => run.position[0][base + a] - run.position[0][base + c]);
      context.strokeStyle = context.fillStyle = run.bodies[b].colour;
      context.beginPath();
      for (const i of own) {
        const sx = 8 + run.position[0][base + i] / 65534 * (W - 16), sy = H - 8 - values[base + i] / 255 * (H - 16);
        context.lineTo(sx, sy);
        this.mark(Math.round(sx), Math.round(sy), i);
      }
      context.stroke();
    }
  }
  mark(x, y, i) {
    const W = this.canvas.width;
    for (let dy = -3; dy <= 3; dy++) for (let dx = -3; dx <= 3; dx++) {
      const p = (y + dy) * W + x + dx;
      if (p >= 0 && p < this.pick.length) this.pick[p] = i;
    }
  }
  under(x, y, frame) {  // what is under the pointer, in words
    const i = this.pick[Math.round(y) * this.canvas.width + Math.round(x)];
    if (i === undefined || i < 0) return "";
    const run = this.run, at = frame * run.count + i;
    const place = run.low.map((_, k) => short(run.at(k, run.position[k][at]) * run.units.length[1]));
    const parts = [run.bodies[run.body[i]].name, `(${place.join(", ")})${run.units.length[0] && " " + run.units.length[0]}`];
    for (const field of run.fields) {
      const v = field.ends[0] + run.values[field.name][at] / 255 * (field.ends[1] - field.ends[0]);
      parts.push(`${field.label.replace(/ \[.*/, "")} ${short(v)}${(field.label.match(/\[(.*)\]/) || ["", ""])[1].replace(/^(.+)$/, " $1").replace(" -", "")}`);
    }
    return parts.join("  ·  ");
  }
}

function discOf(radius, solid) {  // the pixels of a disc: offset, height over the middle, place of its shade in the table
  const reach = Math.floor(radius), dys = [], dxs = [], rises = [], shades = [];
  for (let dy = -reach; dy <= reach; dy++) for (let dx = -reach; dx <= reach; dx++) {
    const square = radius * radius - dy * dy - dx * dx;
    if (square < 0) continue;
    const high = Math.sqrt(square), light = radius < 1.5 ? 1 : (0.7 * high - 0.4 * dy - 0.4 * dx) / (0.9 * radius);
    dys.push(dy); dxs.push(dx); rises.push(high);
    shades.push(256 * (solid ? Math.max(0, Math.min(3, Math.floor(4 * light))) : 3));
  }
  return {reach, dys: Int32Array.from(dys), dxs: Int32Array.from(dxs), rises: Float32Array.from(rises), shades: Int32Array.from(shades)};
}
function hex(colour) { return [1, 3, 5].map(k => parseInt(colour.slice(k, k + 2), 16)); }
function short(v) { return Math.abs(v) >= 1e5 || (v && Math.abs(v) < 1e-3) ? v.toExponential(2) : String(+v.toPrecision(4)); }
function timeText(run, t) {
  const [unit, factor] = run.units.time, shown = t * factor;
  return unit ? `t = ${unit === "µs" ? shown.toFixed(2) : short(shown)} ${unit}` : `t = ${short(t)}`;
}

function bar(canvas, field, tables, labels, span) {  // the colour scale
  const context = canvas.getContext("2d");
  if (!field) { canvas.hidden = true; labels.textContent = ""; return; }
  canvas.hidden = false;
  for (let k = 0; k < 256; k++) {
    const c = tables[field.colours].subarray(3 * k, 3 * k + 3);
    context.fillStyle = `rgb(${c[0]},${c[1]},${c[2]})`;
    context.fillRect(k * canvas.width / 256, 0, canvas.width / 256 + 1, canvas.height);
  }
  const [low, high] = span.map(k => short(field.ends[0] + k / 255 * (field.ends[1] - field.ends[0])));
  labels.innerHTML = `<span>${low}</span><span>${field.label}</span><span>${high}</span>`;
}

async function main() {
  const packed = JSON.parse(document.getElementById("runs").textContent);
  const tables = {};
  for (const [name, text] of Object.entries(packed.colours)) tables[name] = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const views = [];
  for (const [number, header] of packed.runs.entries()) {
    const run = new Run(header, await unpack(header.data));
    const view = new View(run, document.getElementById(`canvas-${number}`), tables);
    views.push(view);
    strip(view, document.getElementById(`strip-${number}`));
    steer(view, number, () => show());
  }
  const slider = document.getElementById("time"), play = document.getElementById("play");
  const times = [...new Set(views.flatMap(v => v.run.times))].sort((a, b) => a - b);
  slider.max = times.length - 1;
  let frameTimes = 0, drawn = 0, fold = 1;
  function show(moment) {  // a time between two of the slider's while it plays, else that of the slider
    const playing = typeof moment === "number", t = playing ? moment : times[+slider.value], began = performance.now();
    for (const [number, view] of views.entries()) {
      const own = view.run.times, k = view.run.frame(t);
      view.now = k;
      const share = playing && k + 1 < own.length ? Math.max(0, (t - own[k]) / (own[k + 1] - own[k])) : 0;
      view.draw(k, share, playing ? fold : 1);
      view.legend();
      document.getElementById(`clock-${number}`).textContent = timeText(view.run, playing ? Math.min(t, own[own.length - 1]) : own[k]);
    }
    slider.setAttribute("aria-valuetext", timeText(views[0].run, t));
    const spent = performance.now() - began;
    if (playing && spent > SLOW && fold < 4) fold *= 2;  // many particles: with coarser pixels while it moves
    frameTimes += spent; drawn++;
    Object.assign(document.body.dataset, {milliseconds: (frameTimes / drawn).toFixed(1), frames: drawn});
  }
  let timer = null;
  const last = times.length - 1, still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  function stop() { cancelAnimationFrame(timer); timer = null; play.textContent = "▶ Play"; play.setAttribute("aria-pressed", "false"); }
  slider.addEventListener("input", () => { stop(); show(); });
  play.addEventListener("click", () => {
    if (timer !== null) { stop(); return show(); }
    if (+slider.value >= last) slider.value = 0;
    play.textContent = "❚❚ Pause"; play.setAttribute("aria-pressed", "true");
    const from = times[+slider.value], pace = (times[last] - times[0]) / PLAYED;
    let began = null;
    timer = requestAnimationFrame(function next(now) {
      began ??= now;
      const t = from + (now - began) * pace;
      slider.value = times.findLastIndex(one => one <= t * (1 + 1e-9));
      if (t >= times[last]) { slider.value = last; stop(); return show(); }
      show(still ? undefined : t);
      timer = requestAnimationFrame(next);
    });
  });
  for (const link of document.querySelectorAll("[data-time]")) link.addEventListener("click", () => {
    const t = +link.dataset.time;
    slider.value = times.reduce((best, one, k) => Math.abs(one - t) < Math.abs(times[best] - t) ? k : best, 0);
    show();
  });
  slider.value = times.length - 1;
  show();
  document.body.dataset.shown = views.map(v => `${v.run.count} x ${v.run.times.length}`).join(", ");
  document.body.dataset.ready = "yes";
}

function strip(view, place) {  // six moments, evenly
  const times = view.run.times, count = Math.min(6, times.length);
  for (let k = 0; k < count; k++) {
    const frame = Math.round(k * (times.length - 1) / Math.max(count - 1, 1));
    const figure = document.createElement("figure"), canvas = document.createElement("canvas"), text = document.createElement("figcaption");
    canvas.width = 300; canvas.height = 240;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `${view.run.title}, ${timeText(view.run, times[frame])}`);
    text.textContent = timeText(view.run, times[frame]);
    figure.append(canvas, text); place.append(figure);
    const small = Object.assign(new View(view.run, canvas, view.tables), {whole: true});
    small.draw(frame);
  }
}

function steer(view, number, show) {  // controls of one run, and the pointer
  const get = name => document.getElementById(`${name}-${number}`), {run, canvas} = view;
  view.legend = () => bar(get("bar"), run.fields.find(f => f.name === view.field), view.tables, get("ends"), view.span);
  get("field").addEventListener("change", event => { view.field = event.target.value; show(); });
  get("reset").addEventListener("click", () => { view.reset(); show(); });
  if (get("mirror")) {
    get("mirror").checked = view.mirrored;
    get("mirror").addEventListener("change", event => { view.mirrored = event.target.checked; show(); });
  }
  run.bodies.forEach((_, b) => get(`body-${b}`).addEventListener("change", event => { view.shown[b] = event.target.checked; show(); }));
  if (get("whole")) get("whole").addEventListener("change", event => { view.whole = event.target.checked; show(); });
  let from = null;
  const scaled = event => { const box = canvas.getBoundingClientRect(); return [(event.clientX - box.left) * canvas.width / box.width, (event.clientY - box.top) * canvas.height / box.height]; };
  canvas.addEventListener("pointerdown", event => { from = scaled(event); canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointerup", () => { from = null; });
  canvas.addEventListener("pointermove", event => {
    const at = scaled(event);
    if (!from) { get("under").textContent = view.under(at[0], at[1], view.now) || "\u00a0"; return; }
    move(at[0] - from[0], at[1] - from[1], event.shiftKey); from = at;
  });
  function move(dx, dy, shift) {
    if (run.dimensions === 3 && !shift) { view.yaw += dx * 0.008; view.pitch = Math.max(-1.57, Math.min(1.57, view.pitch + dy * 0.008)); }
    else { view.pan[0] += dx; view.pan[1] += dy; }
    show();
  }
  function zoom(factor, at) {
    for (const k of [0, 1]) {
      const middle = (k ? canvas.height : canvas.width) / 2;
      view.pan[k] = at[k] - middle - factor * (at[k] - middle - view.pan[k]);
    }
    view.zoom *= factor; show();
  }
  canvas.addEventListener("wheel", event => { event.preventDefault(); zoom(Math.exp(-event.deltaY * 0.0015), scaled(event)); }, {passive: false});
  canvas.addEventListener("keydown", event => {
    const steps = {ArrowLeft: [-25, 0], ArrowRight: [25, 0], ArrowUp: [0, -25], ArrowDown: [0, 25]}[event.key];
    const middle = [canvas.width / 2, canvas.height / 2];
    if (steps) move(...steps, event.shiftKey);
    else if (event.key === "+" || event.key === "=") zoom(1.2, middle);
    else if (event.key === "-") zoom(1 / 1.2, middle);
    else return;
    event.preventDefault();
  });
}
main().catch(error => { document.getElementById("trouble").textContent = `The player could not start: ${error.message}`; });
