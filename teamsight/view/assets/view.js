// The page of teamsight: replays and live runs, drawn on a canvas. Plain JavaScript without a build step.
//
//   decoding      packed replays and blocks of single frames become frames
//   perception    what a body senses: offsets of links, the ring, relayed targets
//   look          colours of the page, shapes of bodies
//   arena         one canvas for each track
//   charts        the series against time
//   inspector     what is known of one body
//   view          the whole page; its interface is described at the class View
//
// Positions and angles are in the arena's units, with y up; pixels are those of the canvas, with y down.
"use strict";

window.teamsight = (() => {

// Part: decoding.

const PRESENT = 1, ACTIVE = 2, OBSERVED = 4, BLOCKED = 8;
const MOST = 65535, TURN = 65536, MEASURED = 32767;
// How many links of a list frames of a live page hold.
const MOST_LINKS = 100000;
const MOST_RAYS = 10000;

// Frames of a packed replay: columns of all frames one after the other, and where each frame begins in them.
class Store {
  constructor(frames, scene) {
    this.time = new Float32Array(frames);
    this.series = scene.series.map(() => new Float32Array(frames));
    this.first = new Uint32Array(frames + 1);
    this.columns = [];
    this.lists = [];
  }
}

class PackedFrame {
  constructor(store, index) {
    this.store = store;
    this.index = index;
  }
  get time() { return this.store.time[this.index]; }
  get n() { return this.store.first[this.index + 1] - this.store.first[this.index]; }
  get series() { return Float32Array.from(this.store.series, (values) => values[this.index]); }
  get x() { return this.column(0); }
  get y() { return this.column(1); }
  get heading() { return this.column(2); }
  get flags() { return this.column(3); }
  get links() {
    return this.store.lists.map((list) => links(list, this.index));
  }
  // The same with columns that are made once; the getters above make them at each use.
  get plain() {
    const { time, n, x, y, heading, flags, links: lists } = this;
    return { time, n, x, y, heading, flags, links: lists };
  }
  value(s) { return this.store.series[s][this.index]; }
  column(c) { return this.store.columns[c].subarray(this.store.first[this.index], this.store.first[this.index + 1]); }
}

// `omitted` says how many links there are that a frame does not hold.
function links(list, index) {
  const from = list.first[index], to = list.first[index + 1], { scale } = list, omitted = list.omitted[index];
  const found = { source: list.source.subarray(from, to), target: list.target.subarray(from, to), scale, omitted };
  if (list.dx) {
    found.dx = list.dx.subarray(from, to);
    found.dy = list.dy.subarray(from, to);
  }
  return found;
}

class LiveFrame {
  constructor(time, series, columns, lists, bytes) {
    [this.x, this.y, this.heading, this.flags] = columns;
    this.time = time;
    this.series = series;
    this.links = lists;
    this.bytes = bytes;
  }
  get n() { return this.x.length; }
  get plain() { return this; }
  value(s) { return this.series[s]; }
}

// Reads little-endian numbers one after the other. Typed arrays are little-endian on every machine with a browser.
class Reader {
  constructor(data) {
    this.bytes = data instanceof Uint8Array ? data : new Uint8Array(data);
    this.view = new DataView(this.bytes.buffer, this.bytes.byteOffset, this.bytes.byteLength);
    this.at = 0;
  }
  take(length) {
    if (this.at + length > this.bytes.length) {
      throw new Error(`the data end after ${this.bytes.length} bytes; ${this.at + length} or more are needed`);
    }
    this.at += length;
    return this.at - length;
  }
  count() { return this.view.getUint32(this.take(4), true); }
  float() { return this.view.getFloat32(this.take(4), true); }
  floats(count) {
    const from = this.take(4 * count);
    return Float32Array.from({ length: count }, (_, k) => this.view.getFloat32(from + 4 * k, true));
  }
  words(count) {
    const from = this.take(2 * count), place = this.bytes.byteOffset + from;
    if (place % 2 === 0) return new Uint16Array(this.bytes.buffer, place, count);
    return new Uint16Array(this.bytes.slice(from, from + 2 * count).buffer);
  }
  // All low bytes, then all high bytes.
  planes(count) {
    const low = this.take(2 * count), high = low + count, values = new Uint16Array(count), bytes = this.bytes;
    for (let k = 0; k < count; k++) values[k] = bytes[low + k] | (bytes[high + k] << 8);
    return values;
  }
  end() {
    if (this.at !== this.bytes.length) throw new Error(`${this.bytes.length - this.at} bytes too many at the end`);
  }
}

// A block of one frame, as a live run sends it → frame. `offset` is where it begins [bytes].
function decodeFrame(data, scene, offset = 0) {
  const whole = data instanceof Uint8Array ? data : new Uint8Array(data);
  const reader = new Reader(whole.subarray(offset));
  const n = reader.count(), [counts, omitted] = [0, 0].map(() => scene.links.map(() => reader.count()));
  const time = reader.float(), series = reader.floats(scene.series.length);
  const columns = [0, 0, 0, 0].map(() => reader.words(n));
  const lists = scene.links.map((list, l) => {
    const [source, target] = [0, 0].map(() => reader.words(counts[l]));
    const found = { source, target, scale: list.scale, omitted: omitted[l] };
    for (const name of list.measured ? ["dx", "dy"] : []) found[name] = signed(reader.words(counts[l]));
    return found;
  });
  reader.end();
  check(n, lists, scene);
  return new LiveFrame(time, series, columns, lists, reader.bytes.length);
}

const signed = (words) => new Int16Array(words.buffer, words.byteOffset, words.length);

function check(n, lists, scene) {
  if (n > scene.slots.length) throw new Error(`a frame has ${n} bodies, and the scene ${scene.slots.length}`);
  for (const list of lists) {
    for (const column of [list.source, list.target]) {
      for (let k = 0; k < column.length; k++) {
        if (column[k] >= n) throw new Error(`a link names body ${column[k]} of ${n}`);
      }
    }
  }
}

// A packed replay → promise of its frames. `data` is base64, or the bytes.
async function decodeReplay(data, scene) {
  const reader = new Reader(await inflated(typeof data === "string" ? fromBase64(data) : data));
  const frames = reader.count(), store = new Store(frames, scene);
  store.time = reader.floats(frames);
  store.series = scene.series.map(() => reader.floats(frames));
  const sizes = reader.words(frames);
  for (let f = 0; f < frames; f++) store.first[f + 1] = store.first[f] + sizes[f];
  store.columns = [0, 0, 0, 0].map(() => undelta(reader.planes(store.first[frames]), store.first));
  store.lists = scene.links.map((list) => readLinks(reader, frames, list));
  reader.end();
  const all = Array.from({ length: frames }, (_, index) => new PackedFrame(store, index));
  for (const frame of all) check(frame.n, frame.links, scene);
  return all;
}

// Each value is the difference from the same slot's in the frame before → the values.
function undelta(values, first) {
  for (let f = 1; f < first.length - 1; f++) {
    const before = first[f - 1], at = first[f], kept = Math.min(at - before, first[f + 1] - at);
    for (let k = 0; k < kept; k++) values[at + k] += values[before + k];
  }
  return values;
}

function readLinks(reader, frames, { measured, scale }) {
  const first = new Uint32Array(frames + 1);
  for (let f = 0; f < frames; f++) first[f + 1] = first[f] + reader.count();
  const omitted = Uint32Array.from({ length: frames }, () => reader.count());
  const list = { first, omitted, source: reader.planes(first[frames]), target: reader.planes(first[frames]), scale };
  for (let f = 0; f < frames; f++) {
    for (let k = first[f] + 1; k < first[f + 1]; k++) list.source[k] += list.source[k - 1];
  }
  for (const name of measured ? ["dx", "dy"] : []) list[name] = signed(reader.planes(first[frames]));
  return list;
}

function fromBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const characters = atob(text), bytes = new Uint8Array(characters.length);
  for (let k = 0; k < bytes.length; k++) bytes[k] = characters.charCodeAt(k);
  return bytes;
}

async function inflated(bytes) {
  if (typeof DecompressionStream === "undefined") {
    throw new Error("this browser cannot unpack the recording; use Chrome 93, Firefox 113, Safari 16.4 or newer");
  }
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Part: perception.

// The index of the last entry at or before a time; −1 if there is none.
function lastAt(entries, time, timeOf = (entry) => entry) {
  let low = 0, high = entries.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (timeOf(entries[middle]) <= time) low = middle + 1; else high = middle;
  }
  return low - 1;
}

// What is worked out once for a scene.
class Layout {
  constructor(scene) {
    const [x0, y0, x1, y1] = scene.bounds;
    Object.assign(this, { scene, x0, y0, x1, y1, width: x1 - x0, height: y1 - y0 });
    this.group = Uint16Array.from(scene.slots, (slot) => slot.group);
    // A slot of a point has no radius.
    this.radius = Float64Array.from(scene.slots, (slot) => slot.radius || 0);
    this.hasRadii = this.radius.some((radius) => radius > 0);
    this.members = scene.groups.map(() => []);
    scene.slots.forEach((slot, s) => this.members[slot.group].push(s));
    // A period of 0 is none.
    this.period = (scene.wraps || [0, 0]).map((length) => (Number.isFinite(length) ? length : 0));
    this.teammates = scene.links.findIndex((list) => list.channel === "teammates");
    this.targets = scene.links.findIndex((list) => list.channel === "targets");
  }
  x(q) { return this.x0 + (this.width * q) / MOST; }
  y(q) { return this.y0 + (this.height * q) / MOST; }
  // The shortest way along an axis, across the seam where there is one.
  way(difference, axis) {
    const period = this.period[axis];
    return period ? difference - period * Math.round(difference / period) : difference;
  }
}

// Whether the bodies of a group sense others, and its degree of awareness.
const senses = ({ role, fields }) =>
  role === "robot" || Object.keys(fields || {}).some((name) => name.startsWith("senses "));
const degreeOf = ({ role, awareness }) => (awareness ? awareness.name : role === "robot" ? "none" : null);
const angleOf = (frame, slot) => (2 * Math.PI * frame.heading[slot]) / TURN;
const has = (frame, slot, flag) => slot < frame.n && (frame.flags[slot] & flag) !== 0;

// The entries of an observer: from `from` up to `to`.
function entries(list, slot) {
  const { source } = list;
  const bound = (value) => {
    let low = 0, high = source.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (source[middle] < value) low = middle + 1; else high = middle;
    }
    return low;
  };
  return [bound(slot), bound(slot + 1)];
}

// What an observer senses in one list: slot, offset along the axes, range, and bearing, anticlockwise from its heading.
function sensed(layout, frame, l, slot) {
  const list = frame.links[l], { measured } = layout.scene.links[l], heading = angleOf(frame, slot);
  const [from, to] = entries(list, slot), found = [];
  const { x, y } = frame;
  for (let k = from; k < to; k++) {
    const target = list.target[k];
    const dx = measured ? (list.dx[k] * list.scale) / MEASURED
      : layout.way(((x[target] - x[slot]) * layout.width) / MOST, 0);
    const dy = measured ? (list.dy[k] * list.scale) / MEASURED
      : layout.way(((y[target] - y[slot]) * layout.height) / MOST, 1);
    found.push({ slot: target, dx, dy, range: Math.hypot(dx, dy), bearing: wrapped(Math.atan2(dy, dx) - heading) });
  }
  return found.sort((one, other) => one.range - other.range);
}

// The rays of the lidar of a body: heading on the page, and how far each goes to the nearest wall, obstacle or body, as
// drawn and without noise; `reach` where it meets nothing. Rays go from the right end of the field of view to its left.
function raysOf(layout, frame, slot) {
  frame = frame.plain || frame;
  const { scene } = layout, { lidar } = scene.groups[layout.group[slot]];
  if (!lidar || !has(frame, slot, PRESENT) || !has(frame, slot, ACTIVE)) return [];
  const x = layout.x(frame.x[slot]), y = layout.y(frame.y[slot]), reach = lidar.range, heading = angleOf(frame, slot);
  const [wx, wy] = layout.period, shifts = [];
  for (let i = wx ? -1 : 0; i <= (wx ? 1 : 0); i++) {
    for (let j = wy ? -1 : 0; j <= (wy ? 1 : 0); j++) shifts.push([i * wx - x, j * wy - y]);
  }
  const walls = [], discs = [];
  // A seam is no wall.
  const isSeam = ([ax, ay], [bx, by]) => (wx && ax === bx && (ax === layout.x0 || ax === layout.x1))
    || (wy && ay === by && (ay === layout.y0 || ay === layout.y1));
  for (const line of [...scene.walls, ...scene.obstacles]) {
    for (let k = 1; k < line.length; k++) {
      const [a, b] = [line[k - 1], line[k]];
      if (!isSeam(a, b)) for (const [dx, dy] of shifts) walls.push([a[0] + dx, a[1] + dy, b[0] + dx, b[1] + dy]);
    }
  }
  for (let s = 0; s < frame.n; s++) {
    if (s === slot || !(layout.radius[s] > 0) || !has(frame, s, PRESENT) || !has(frame, s, ACTIVE)) continue;
    for (const [dx, dy] of shifts) discs.push([layout.x(frame.x[s]) + dx, layout.y(frame.y[s]) + dy, layout.radius[s]]);
  }
  const near = discs.filter(([cx, cy, radius]) => Math.hypot(cx, cy) < reach + radius);
  const isFull = lidar.field_of_view >= 2 * Math.PI - 1e-9, { rays } = lidar;
  return Array.from({ length: Math.min(rays, MOST_RAYS) }, (_, k) => {
    const share = rays === 1 ? 0 : isFull ? k / rays - 0.5 : k / (rays - 1) - 0.5;
    const angle = heading + share * lidar.field_of_view, ux = Math.cos(angle), uy = Math.sin(angle);
    let distance = reach;
    for (const [ax, ay, bx, by] of walls) {
      const right = ux * ay - uy * ax, left = ux * by - uy * bx;
      if (right === left || right * left > 0) continue;
      const at = (ax * by - ay * bx) / (left - right);
      if (at >= 0 && at < distance) distance = at;
    }
    for (const [cx, cy, radius] of near) {
      const along = cx * ux + cy * uy, across = cx * uy - cy * ux, gap = cx * cx + cy * cy - radius * radius;
      if (gap <= 0) distance = 0;
      else if (along > 0 && Math.abs(across) <= radius) {
        distance = Math.min(distance, along - Math.sqrt(radius * radius - across * across));
      }
    }
    return { angle, distance, isMet: distance < reach };
  });
}

const wrapped = (angle) => angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));

// The nearest in each of δ sectors, numbered anticlockwise; the centre of sector 0 is straight ahead.
function ring(teammates, delta) {
  const nearest = new Map();
  for (const one of teammates) {
    const number = Math.floor((one.bearing * delta) / (2 * Math.PI) + 0.5);
    const sector = ((number % delta) + delta) % delta, shown = nearest.get(sector);
    if (shown) shown.merged += 1;
    else nearest.set(sector, { sector, bearing: wrapped((2 * Math.PI * sector) / delta), range: one.range, merged: 1 });
  }
  return [...nearest.values()].sort((one, other) => one.sector - other.sector);
}

// What a body perceives in a frame; null for one that is absent, or inactive.
function percept(layout, frame, slot) {
  frame = frame.plain || frame;
  if (!has(frame, slot, PRESENT) || !has(frame, slot, ACTIVE)) return null;
  const group = layout.scene.groups[layout.group[slot]];
  const channels = layout.scene.links.map((list, l) => ({
    ...list, sensed: sensed(layout, frame, l, slot), omitted: frame.links[l].omitted,
  }));
  const teammates = layout.teammates < 0 ? [] : channels[layout.teammates].sensed;
  const degree = degreeOf(group), found = { channels, teammates, degree };
  if (degree === "ring") found.ring = ring(teammates, group.awareness.delta);
  if (degree === "nearest") found.nearest = teammates.slice(0, group.awareness.delta);
  if (degree === "shared" && layout.targets >= 0) {
    found.relayed = teammates.flatMap((mate) => sensed(layout, frame, layout.targets, mate.slot).map((target) => {
      const dx = mate.dx + target.dx, dy = mate.dy + target.dy, bearing = Math.atan2(dy, dx) - angleOf(frame, slot);
      return { slot: target.slot, by: mate.slot, dx, dy, range: Math.hypot(dx, dy), bearing: wrapped(bearing) };
    }));
  }
  return found;
}

const tooMany = (count) => `${count.toLocaleString("en")} links, more than ${MOST_LINKS.toLocaleString("en")}: not shown`;

// Who senses a body, by list.
function observers(frame, slot) {
  return frame.links.map(({ source, target }) => {
    const found = [];
    for (let k = 0; k < target.length; k++) if (target[k] === slot) found.push(source[k]);
    return found;
  });
}

// Part: look.

const LIGHT = {
  page: "#f6f7f9", arena: "#ffffff", wall: "#39414e", obstacle: "#c3c9d2", text: "#1b2027", soft: "#56606d",
  grid: "#dde1e7", tracks: ["#0067a8", "#b04a00"], marker: "#1b2027", difference: "#6b3fa0", blocked: "#c2185b",
};
const DARK = {
  page: "#14171b", arena: "#1d2127", wall: "#a9b2bf", obstacle: "#4a525e", text: "#e8ebef", soft: "#a5afbc",
  grid: "#323842", tracks: ["#63b3ed", "#f6ad55"], marker: "#ffffff", difference: "#c4a5f5", blocked: "#ff8ab5",
};

// A page that holds this one in a frame may say which colours it has, and then learns how high this one is:
// {teamsight: {scheme: "dark" or "light"}}, {teamsight: {height}}. It may say so before there is a view.
const outer = { scheme: null, view: null };
const dark = () => (outer.scheme ? outer.scheme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches);
const showScheme = () => { document.documentElement.dataset.scheme = dark() ? "dark" : "light"; };
showScheme();
if (window !== window.parent) addEventListener("message", ({ source, data }) => {
  const { scheme } = (source === window.parent && data && data.teamsight) || {};
  if (scheme !== "dark" && scheme !== "light") return;
  outer.scheme = scheme;
  if (outer.view) outer.view.onOuter();
});
const still = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

function components(colour) {
  const hex = /^#([0-9a-f]{3}|[0-9a-f]{6})$/i.test(colour) ? colour.slice(1) : "808080";
  const full = hex.length === 3 ? [...hex].map((digit) => digit + digit).join("") : hex;
  return [0, 2, 4].map((at) => parseInt(full.slice(at, at + 2), 16));
}

// Relative luminance, as WCAG 2 defines it.
function luminance(rgb) {
  const linear = rgb.map((value) => (value <= 10 ? value / 3294.6 : ((value / 255 + 0.055) / 1.055) ** 2.4));
  return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
}

function contrast(one, other) {
  const [low, high] = [luminance(one), luminance(other)].sort((a, b) => a - b);
  return (high + 0.05) / (low + 0.05);
}

// A colour, moved toward black or white until it stands out from the background.
function legible(colour, background) {
  const ground = components(background), [goal, least] = luminance(ground) > 0.3 ? [0, 3.2] : [255, 5];
  let rgb = components(colour);
  for (let step = 0; step < 40 && contrast(rgb, ground) < least; step++) {
    rgb = rgb.map((value) => value + (goal - value) * 0.06);
  }
  return `#${rgb.map((value) => Math.round(value).toString(16).padStart(2, "0")).join("")}`;
}

const faded = (colour, alpha) => `rgba(${components(colour).join(",")},${alpha})`;

// Shapes of bodies, added to the path of `to`: at (x, y), of size r, heading (hx, hy) in pixels.
const SHAPES = {
  arrow(to, x, y, r, hx, hy) {
    to.moveTo(x + 1.5 * r * hx, y + 1.5 * r * hy);
    to.lineTo(x - 1.1 * r * hx - r * hy, y - 1.1 * r * hy + r * hx);
    to.lineTo(x - 0.5 * r * hx, y - 0.5 * r * hy);
    to.lineTo(x - 1.1 * r * hx + r * hy, y - 1.1 * r * hy - r * hx);
    to.closePath();
  },
  drop(to, x, y, r, hx, hy) {
    const angle = Math.atan2(hy, hx);
    to.moveTo(x + 1.7 * r * hx, y + 1.7 * r * hy);
    to.arc(x, y, r, angle + 0.95, angle - 0.95);
    to.closePath();
  },
  dart(to, x, y, r, hx, hy) {
    to.moveTo(x + 1.5 * r * hx, y + 1.5 * r * hy);
    to.lineTo(x - r * hx - 0.9 * r * hy, y - r * hy + 0.9 * r * hx);
    to.lineTo(x - r * hx + 0.9 * r * hy, y - r * hy - 0.9 * r * hx);
    to.closePath();
  },
  disc(to, x, y, r) {
    to.moveTo(x + 0.85 * r, y);
    to.arc(x, y, 0.85 * r, 0, 2 * Math.PI);
  },
  square(to, x, y, r) {
    to.rect(x - 0.75 * r, y - 0.75 * r, 1.5 * r, 1.5 * r);
  },
  diamond(to, x, y, r) {
    to.moveTo(x, y - 1.1 * r);
    to.lineTo(x + 1.1 * r, y);
    to.lineTo(x, y + 1.1 * r);
    to.lineTo(x - 1.1 * r, y);
    to.closePath();
  },
  cross(to, x, y, r) {
    to.moveTo(x - 0.7 * r, y - 0.7 * r);
    to.lineTo(x + 0.7 * r, y + 0.7 * r);
    to.moveTo(x + 0.7 * r, y - 0.7 * r);
    to.lineTo(x - 0.7 * r, y + 0.7 * r);
  },
};
SHAPES.inactive = (to, x, y, r) => {
  SHAPES.disc(to, x, y, r);
  SHAPES.cross(to, x, y, 0.85 * r);
};
const BY_ROLE = {
  robot: ["arrow", "drop", "dart"], target: ["disc", "diamond", "square"], other: ["square", "diamond", "disc"],
};

// The shape of each group: groups of one role differ.
function shapesOf(scene) {
  const used = {};
  return scene.groups.map(({ role }) => {
    const shapes = BY_ROLE[role] || BY_ROLE.other;
    used[role] = (used[role] || 0) + 1;
    return shapes[(used[role] - 1) % shapes.length];
  });
}

// How a body looks: its group, and one of these states.
const LOOKS = { inactive: 0, hollow: 1, full: 2 };

function lookOf(role, flags) {
  if (!(flags & ACTIVE)) return LOOKS.inactive;
  return role !== "target" || flags & OBSERVED ? LOOKS.full : LOOKS.hollow;
}

// Fills or strokes the path of `to`, which has bodies of one look. Colour is never the only sign: a target that is not
// observed is hollow, and what is inactive is a crossed circle.
function paintBodies(to, colour, look, r, ratio, ground) {
  if (look === LOOKS.full) {
    if (r > 3 * ratio) {
      to.strokeStyle = ground;
      to.lineWidth = 2 * ratio;
      to.stroke();
    }
    to.fillStyle = colour;
    to.fill();
  } else {
    if (look === LOOKS.hollow && r > 3 * ratio) {
      to.fillStyle = ground;
      to.fill();
    }
    to.strokeStyle = look === LOOKS.hollow ? colour : faded(colour, 0.8);
    to.lineWidth = Math.max(Math.min(0.32 * r, 1.8 * ratio), 0.9 * ratio);
    to.stroke();
  }
}

const NAMESPACE = "http://www.w3.org/2000/svg";

// An element with attributes, properties that begin with a dot, listeners that begin with "on", and children.
function make(tag, given = {}, ...children) {
  const isSvg = /^(svg|path|circle|g)$/.test(tag);
  const element = isSvg ? document.createElementNS(NAMESPACE, tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(given)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined && child !== 0));
  return element;
}

// A path of SVG that has the methods of a canvas that shapes use.
class SvgPath {
  constructor() { this.steps = []; }
  moveTo(x, y) { this.steps.push(`M${x} ${y}`); }
  lineTo(x, y) { this.steps.push(`L${x} ${y}`); }
  closePath() { this.steps.push("Z"); }
  rect(x, y, w, h) { this.steps.push(`M${x} ${y}h${w}v${h}h${-w}Z`); }
  arc(x, y, r, from, to) {
    const whole = to - from >= 2 * Math.PI, at = (angle) => `${x + r * Math.cos(angle)} ${y + r * Math.sin(angle)}`;
    if (whole) this.steps.push(`A${r} ${r} 0 1 1 ${x - r} ${y}A${r} ${r} 0 1 1 ${x + r} ${y}`);
    else this.steps.push(`L${at(from)}A${r} ${r} 0 1 1 ${at(to)}`);
  }
}

function bodyIcon(shape, colour, look, ground) {
  const path = new SvgPath();
  SHAPES[look === LOOKS.inactive ? "inactive" : shape](path, 9, 9, look === LOOKS.inactive ? 7 : 5, 0, -1);
  const isFull = look === LOOKS.full;
  return make("svg", { viewBox: "0 0 18 18", width: 18, height: 18, "aria-hidden": "true" }, make("path", {
    d: path.steps.join(""), fill: isFull ? colour : look === LOOKS.hollow ? ground : "none",
    stroke: isFull ? "none" : colour, "stroke-width": 1.7,
  }));
}

// Part: arena.

const LEAST_ZOOM = 0.5, MOST_ZOOM = 60;
// Of more bodies, less is drawn unasked.
const MANY = 250, VERY_MANY = 1500;
// Frames of a trail: of few bodies, of many, of very many, and of the selected one; and the most ticks of these.
const TRAILS = [24, 8, 4], LONG_TRAIL = 150, TRAIL_TICKS = 48, LONG_TRAIL_TICKS = 300;

// Adds a square of this half side to a path, or the part of it within `half` of an angle.
function addSquare(to, x, y, reach, angle, half) {
  if (half >= Math.PI - 1e-6) {
    to.rect(x - reach, y - reach, 2 * reach, 2 * reach);
    return;
  }
  const first = angle - half, last = angle + half, right = Math.PI / 2, turns = [first];
  // Corners are at odd eighths of a turn.
  for (let k = Math.floor(first / right - 0.5) + 1; (k + 0.5) * right < last; k++) turns.push((k + 0.5) * right);
  to.moveTo(x, y);
  for (const turn of [...turns, last]) {
    const dx = Math.cos(turn), dy = Math.sin(turn), scale = reach / Math.max(Math.abs(dx), Math.abs(dy));
    to.lineTo(x + dx * scale, y + dy * scale);
  }
  to.closePath();
}

class Arena {
  // `camera` is shared by all tracks: {zoom, x, y}, where x and y are the middle as shares of the box around the arena.
  constructor(canvas, camera, palette) {
    Object.assign(this, { canvas, camera, palette, drawnSlots: [], frame: null });
    this.to = canvas.getContext("2d", { alpha: false });
    this.still = document.createElement("canvas");
    this.stillFor = "";
    this.px = new Float64Array(0);
    this.py = new Float64Array(0);
    this.next = new Int32Array(0);
  }

  setLayout(layout) {
    this.layout = layout;
    this.shapes = shapesOf(layout.scene);
    this.wallPaths = null;
    this.stillFor = "";
    this.recolour(this.palette);
  }

  recolour(palette) {
    this.palette = palette;
    this.colours = this.layout.scene.groups.map(({ colour }) => legible(colour, palette.arena));
    this.stillFor = "";
  }

  // Returns whether the size has changed.
  resize() {
    this.ratio = Math.min(window.devicePixelRatio || 1, 2);
    const { clientWidth, clientHeight } = this.canvas;
    const [width, height] = [clientWidth, clientHeight].map((side) => Math.max(Math.round(side * this.ratio), 1));
    if (this.canvas.width === width && this.canvas.height === height) return false;
    Object.assign(this.canvas, { width, height });
    this.stillFor = "";
    return true;
  }

  // The transform: pixel = middle of the canvas + scale · (place − middle shown).
  transform() {
    const { layout, camera, canvas, ratio } = this, margin = 14 * ratio;
    const room = [canvas.width - 2 * margin, canvas.height - 2 * margin].map((side) => Math.max(side, 10));
    const scale = camera.zoom * Math.min(room[0] / layout.width, room[1] / layout.height);
    return {
      scale, left: canvas.width / 2, top: canvas.height / 2,
      x: layout.x0 + camera.x * layout.width, y: layout.y0 + camera.y * layout.height,
    };
  }

  toArena(px, py, at = this.transform()) {
    return [at.x + (px - at.left) / at.scale, at.y - (py - at.top) / at.scale];
  }

  // Where bodies are in pixels; between two frames at `share` of the way.
  place(frame, after, share, at) {
    const { layout } = this, n = frame.n;
    if (this.px.length < n) {
      const room = layout.scene.slots.length;
      this.px = new Float64Array(room);
      this.py = new Float64Array(room);
      this.next = new Int32Array(room);
    }
    const { px, py } = this, { x, y, flags } = frame;
    const kx = (layout.width / MOST) * at.scale, ky = (layout.height / MOST) * at.scale;
    const left = at.left + (layout.x0 - at.x) * at.scale, top = at.top - (layout.y0 - at.y) * at.scale;
    for (let s = 0; s < n; s++) {
      px[s] = left + kx * x[s];
      py[s] = top - ky * y[s];
    }
    if (!after || share <= 0) return;
    const to = after.plain, [wx, wy] = layout.period.map((length) => length * at.scale);
    for (let s = 0; s < Math.min(n, to.n); s++) {
      if (!(flags[s] & to.flags[s] & PRESENT)) continue;
      let dx = kx * (to.x[s] - x[s]), dy = -ky * (to.y[s] - y[s]);
      if (wx) dx -= wx * Math.round(dx / wx);
      if (wy) dy -= wy * Math.round(dy / wy);
      px[s] += share * dx;
      py[s] += share * dy;
    }
  }

  // Draws a frame. `shown` says what: {ranges, awareness, links, trails, selected, marked, hovered, before}, where
  // `before(k)` is the frame k frames earlier, or null.
  draw(given, after, share, shown) {
    const at = this.transform(), { to } = this, frame = given && given.plain;
    this.at = at;
    this.frame = frame;
    this.drawStill(at);
    to.setTransform(1, 0, 0, 1, 0, 0);
    to.drawImage(this.still, 0, 0);
    if (!frame) return;
    this.place(frame, after, share, at);
    this.sizeOf(frame);
    this.bucket(frame);
    to.save();
    if (this.layout.period[0] || this.layout.period[1]) this.clipToBox(at);
    if (shown.awareness) this.drawRanges(frame, "awareness_range", at, 0.05);
    if (shown.ranges) this.drawRanges(frame, "sensing_range", at, 0.1);
    if (shown.trails) this.drawTrails(frame, shown, at);
    shown.links.forEach((isShown, l) => isShown && this.drawLinks(frame, l, at));
    if (shown.selected !== null) this.drawSelected(frame, shown.selected, at, shown);
    if (this.layout.hasRadii) this.drawRadii(frame, at);
    this.drawBodies(at);
    if (frame.n <= MANY) this.drawCounts();
    to.restore();
    for (const [slot, kind] of [[shown.marked, "marked"], [shown.hovered, "hovered"], [shown.selected, "selected"]]) {
      if (slot !== null && has(frame, slot, PRESENT)) this.drawMark(slot, kind, at);
    }
  }

  // Background, walls and obstacles, kept until the camera or the size changes.
  drawStill(at) {
    const { canvas, palette, layout, ratio } = this;
    const key = [canvas.width, canvas.height, at.scale, at.x, at.y, palette.arena].join();
    if (key === this.stillFor) return;
    this.stillFor = key;
    Object.assign(this.still, { width: canvas.width, height: canvas.height });
    const to = this.still.getContext("2d", { alpha: false });
    to.fillStyle = palette.page;
    to.fillRect(0, 0, canvas.width, canvas.height);
    to.save();
    if (layout.scene.wraps) this.clipToBox(at, to);
    this.trace(to, layout.scene.walls, at);
    to.fillStyle = palette.arena;
    to.fill("evenodd");
    this.trace(to, layout.scene.obstacles, at);
    to.fillStyle = palette.obstacle;
    to.fill();
    to.strokeStyle = palette.wall;
    to.lineWidth = ratio;
    to.stroke();
    to.restore();
    this.trace(to, layout.scene.walls, at);
    to.strokeStyle = palette.wall;
    to.lineWidth = 1.5 * ratio;
    // A seam is no wall.
    to.setLineDash(layout.scene.wraps ? [6 * ratio, 5 * ratio] : []);
    to.stroke();
  }

  trace(to, lines, at) {
    to.beginPath();
    for (const line of lines) {
      line.forEach(([x, y], k) => {
        const px = at.left + (x - at.x) * at.scale, py = at.top - (y - at.y) * at.scale;
        if (k) to.lineTo(px, py); else to.moveTo(px, py);
      });
    }
  }

  clipToBox(at, to = this.to) {
    const { layout } = this;
    to.beginPath();
    to.rect(
      at.left + (layout.x0 - at.x) * at.scale, at.top - (layout.y1 - at.y) * at.scale,
      layout.width * at.scale, layout.height * at.scale,
    );
    to.clip();
  }

  sizeOf(frame) {
    const { canvas, ratio, camera } = this, room = Math.sqrt((canvas.width * canvas.height) / Math.max(frame.n, 1));
    const zoom = Math.sqrt(Math.max(camera.zoom, 0.5));
    this.r = Math.min(Math.max(0.11 * room * zoom, 1.7 * ratio), 5.5 * ratio * Math.min(zoom, 1.6));
  }

  // Lists of slots by group and look: `head[look]` begins a list, and `next[slot]` goes on.
  bucket(frame) {
    const { layout, next } = this, { groups } = layout.scene, { flags } = frame, group = layout.group;
    const roles = groups.map(({ role }) => role), head = this.head = new Int32Array(3 * groups.length).fill(-1);
    for (let s = frame.n - 1; s >= 0; s--) {
      if (!(flags[s] & PRESENT)) continue;
      const g = group[s], bucket = 3 * g + lookOf(roles[g], flags[s]);
      next[s] = head[bucket];
      head[bucket] = s;
    }
  }

  // Calls `add(slot)` for the bodies of a group that are present.
  each(g, add, fromLook = 0) {
    for (let look = fromLook; look < 3; look++) for (let s = this.head[3 * g + look]; s >= 0; s = this.next[s]) add(s);
  }

  // Calls `add(x, y)` where a circle around (x, y) is seen in the box: there, and across the seam.
  copies(x, y, reach, at, add) {
    const { layout } = this, [wx, wy] = layout.period.map((length) => length * at.scale);
    const left = at.left + (layout.x0 - at.x) * at.scale, top = at.top - (layout.y1 - at.y) * at.scale;
    const right = left + layout.width * at.scale, low = top + layout.height * at.scale;
    for (let i = wx ? -1 : 0; i <= (wx ? 1 : 0); i++) {
      for (let j = wy ? -1 : 0; j <= (wy ? 1 : 0); j++) {
        const cx = x + i * wx, cy = y + j * wy, isOwn = !i && !j;
        if (isOwn || (cx + reach > left && cx - reach < right && cy + reach > top && cy - reach < low)) add(cx, cy);
      }
    }
  }

  addRange(frame, s, name, at) {
    const slot = this.layout.scene.slots[s], reach = slot[name] * at.scale, { to } = this;
    const angle = -angleOf(frame, s), half = name === "sensing_range" ? slot.field_of_view / 2 : Math.PI;
    if (!(reach > 0)) return;
    const isSquare = this.layout.scene.groups[slot.group].range_shape === "square";
    this.copies(this.px[s], this.py[s], reach, at, (x, y) => {
      if (isSquare) addSquare(to, x, y, reach, angle, half);
      else if (half >= Math.PI - 1e-6) {
        to.moveTo(x + reach, y);
        to.arc(x, y, reach, 0, 2 * Math.PI);
      } else {
        to.moveTo(x, y);
        to.arc(x, y, reach, angle - half, angle + half);
        to.closePath();
      }
    });
  }

  // One path for each group, so that the tint shows the area that the group covers.
  drawRanges(frame, name, at, alpha) {
    const { to, ratio } = this;
    this.layout.scene.groups.forEach((group, g) => {
      if (!senses(group)) return;
      to.beginPath();
      this.each(g, (s) => this.addRange(frame, s, name, at), LOOKS.hollow);
      to.fillStyle = faded(this.colours[g], alpha);
      to.fill();
      if (frame.n <= VERY_MANY) {
        to.strokeStyle = faded(this.colours[g], name === "sensing_range" ? 0.4 : 0.28);
        to.lineWidth = ratio;
        to.setLineDash(name === "sensing_range" || frame.n > MANY ? [] : [4 * ratio, 4 * ratio]);
        to.stroke();
        to.setLineDash([]);
      }
    });
  }

  drawTrails(frame, shown, at) {
    const { to, ratio, layout } = this, bands = frame.n > MANY ? 1 : 3;
    const frames = this.framesBack(frame, shown, TRAILS[(frame.n > MANY) + (frame.n > VERY_MANY)], TRAIL_TICKS);
    const length = frames.length - 1;
    layout.scene.groups.forEach((group, g) => {
      to.strokeStyle = this.colours[g];
      to.lineWidth = (group.role === "robot" ? 2 : 1.3) * ratio;
      for (let band = 0; band < bands; band++) {
        const from = Math.round((band * length) / bands), until = Math.round(((band + 1) * length) / bands);
        to.globalAlpha = 0.36 - 0.11 * band;
        to.beginPath();
        this.each(g, (s) => this.addTrail(frames, from, until, s, at));
        to.stroke();
      }
    });
    to.globalAlpha = 1;
  }

  // A frame and those before it: at least two if there are, and no more than `ticks` allow.
  framesBack(frame, shown, length, ticks) {
    const frames = [frame], most = Math.min(length, Math.max(Math.floor(ticks / this.layout.scene.every), 2));
    for (let k = 1; k <= most; k++) {
      const one = shown.before(k);
      if (!one) break;
      frames.push(one.plain);
    }
    return frames;
  }

  // The way of a body over frames `from` to `until`, from the newest back; frame 0 is where it is drawn.
  addTrail(frames, from, until, s, at) {
    const { layout, to } = this;
    let px = 0, py = 0, isOpen = false;
    for (let k = from; k <= until && k < frames.length; k++) {
      const frame = frames[k];
      if (!has(frame, s, PRESENT)) return;
      const x = k ? at.left + (layout.x(frame.x[s]) - at.x) * at.scale : this.px[s];
      const y = k ? at.top - (layout.y(frame.y[s]) - at.y) * at.scale : this.py[s];
      const isJump = isOpen && layout.scene.wraps
        && (Math.abs(x - px) > (layout.width * at.scale) / 2 || Math.abs(y - py) > (layout.height * at.scale) / 2);
      if (isOpen && !isJump) to.lineTo(x, y); else to.moveTo(x, y);
      [px, py, isOpen] = [x, y, true];
    }
  }

  // The way from one body to another in pixels, across the seam where that is shorter.
  way(s, t, at) {
    const dx = this.px[t] - this.px[s], dy = this.py[t] - this.py[s], [wx, wy] = this.layout.period;
    return [
      wx ? dx - wx * at.scale * Math.round(dx / (wx * at.scale)) : dx,
      wy ? dy - wy * at.scale * Math.round(dy / (wy * at.scale)) : dy,
    ];
  }

  addLink(s, t, at, isOneWay) {
    const { to, px, py } = this, [dx, dy] = this.way(s, t, at);
    to.moveTo(px[s], py[s]);
    to.lineTo(px[s] + dx, py[s] + dy);
    if (Math.abs(px[s] + dx - px[t]) + Math.abs(py[s] + dy - py[t]) > 0.5) {
      to.moveTo(px[t] - dx, py[t] - dy);
      to.lineTo(px[t], py[t]);
    }
    if (isOneWay) this.addBarbs(px[t], py[t], dx, dy);
  }

  addBarbs(x, y, dx, dy) {
    const length = Math.hypot(dx, dy), { to, r } = this, back = 1.6 * r, size = 1.3 * r;
    if (length < 3 * r) return;
    const ux = dx / length, uy = dy / length, tipX = x - back * ux, tipY = y - back * uy;
    to.moveTo(tipX - size * ux - 0.55 * size * uy, tipY - size * uy + 0.55 * size * ux);
    to.lineTo(tipX, tipY);
    to.lineTo(tipX - size * ux + 0.55 * size * uy, tipY - size * uy - 0.55 * size * ux);
  }

  // Links of one list. Only between groups that can sense each other does a link show its direction, where it has one.
  drawLinks(frame, l, at) {
    const { layout, to, ratio } = this, { source, target } = frame.links[l], group = layout.group;
    const isDirected = source.length < 20000 ? oneWay(source, target, frame.n) : null;
    const { groups } = layout.scene, isSensing = layout.scene.links[l].channel !== "teammates";
    for (let g = 0; g < groups.length; g++) {
      to.beginPath();
      let any = false;
      for (let k = 0; k < source.length; k++) {
        const s = source[k], t = target[k];
        if (group[t] !== g) continue;
        const isSameRole = groups[group[s]].role === groups[g].role;
        const directed = isDirected && isSameRole && isDirected[k];
        // A link in both directions is drawn once.
        if (isDirected && !isDirected[k] && s > t) continue;
        this.addLink(s, t, at, directed);
        any = true;
      }
      if (!any) continue;
      to.strokeStyle = faded(this.colours[g], isSensing ? 0.9 : 0.6);
      to.lineWidth = (isSensing ? 1.3 : 1.1) * ratio;
      to.stroke();
    }
  }

  drawSelected(frame, s, at, shown) {
    if (!has(frame, s, PRESENT)) return;
    const { to, ratio, layout, px, py } = this, g = layout.group[s], colour = this.colours[g];
    this.drawLongTrail(frame, s, at, shown);
    observers(frame, s).forEach((found, l) => {
      if (layout.scene.links[l].channel !== "teammates") this.drawStrong(found.map((observer) => [observer, s]), at);
    });
    const found = percept(layout, frame, s);
    if (!found) return;
    const ranges = [["awareness_range", [5, 4]], ["sensing_range", []]];
    for (const [name, dash] of senses(layout.scene.groups[g]) ? ranges : []) {
      to.beginPath();
      this.addRange(frame, s, name, at);
      to.strokeStyle = colour;
      to.lineWidth = 1.4 * ratio;
      to.setLineDash(dash.map((length) => length * ratio));
      to.stroke();
      to.setLineDash([]);
      if (!dash.length) {
        to.fillStyle = faded(colour, 0.1);
        to.fill();
      }
    }
    this.drawRays(frame, s, at);
    if (found.ring) this.drawRing(frame, s, found.ring, at);
    found.channels.forEach((channel) => this.drawSensed(channel, s, at));
    for (const target of found.relayed || []) {
      this.drawReading(px[s] + target.dx * at.scale, py[s] - target.dy * at.scale, this.palette.soft);
    }
  }

  // The rays of its lidar, with a dot where one meets something.
  drawRays(frame, s, at) {
    const rays = raysOf(this.layout, frame, s), { to, ratio, palette } = this;
    if (!rays.length) return;
    const reach = this.layout.scene.groups[this.layout.group[s]].lidar.range * at.scale, dot = 3 * ratio;
    this.copies(this.px[s], this.py[s], reach, at, (x, y) => {
      const ends = rays.map(({ angle, distance, isMet }) => [
        x + distance * at.scale * Math.cos(angle), y - distance * at.scale * Math.sin(angle), isMet,
      ]);
      to.beginPath();
      for (const [endX, endY] of ends) {
        to.moveTo(x, y);
        to.lineTo(endX, endY);
      }
      to.strokeStyle = faded(palette.marker, 0.5);
      to.lineWidth = 0.9 * ratio;
      to.stroke();
      to.fillStyle = palette.marker;
      for (const [endX, endY, isMet] of ends) if (isMet) to.fillRect(endX - dot / 2, endY - dot / 2, dot, dot);
    });
  }

  drawLongTrail(frame, s, at, shown) {
    const { to, ratio, layout } = this, frames = this.framesBack(frame, shown, LONG_TRAIL, LONG_TRAIL_TICKS);
    to.beginPath();
    this.addTrail(frames, 0, LONG_TRAIL, s, at);
    to.strokeStyle = faded(this.colours[layout.group[s]], 0.5);
    to.lineWidth = 1.3 * ratio;
    to.stroke();
  }

  drawSensed({ sensed: found, measured }, s, at) {
    const { px, py } = this;
    this.drawStrong(found.map((one) => [s, one.slot]), at);
    for (const one of measured ? found : []) {
      this.drawReading(px[s] + one.dx * at.scale, py[s] - one.dy * at.scale, this.palette.marker);
    }
  }

  drawStrong(pairs, at) {
    const { to, ratio, layout } = this;
    for (const [s, t] of pairs) {
      to.beginPath();
      this.addLink(s, t, at, false);
      to.strokeStyle = this.colours[layout.group[t]];
      to.lineWidth = 2 * ratio;
      to.stroke();
    }
  }

  // Where something is measured or reported to be.
  drawReading(x, y, colour) {
    const { to, r, ratio } = this;
    to.beginPath();
    SHAPES.cross(to, x, y, r);
    to.strokeStyle = colour;
    to.lineWidth = 1.4 * ratio;
    to.stroke();
  }

  // The ring as it is: occupied sectors up to the nearest teammate in them.
  drawRing(frame, s, occupied, at) {
    const { to, ratio, layout } = this, { delta } = layout.scene.groups[layout.group[s]].awareness;
    const reach = layout.scene.slots[s].awareness_range * at.scale, angle = -angleOf(frame, s), half = Math.PI / delta;
    to.strokeStyle = faded(this.palette.soft, 0.55);
    to.lineWidth = ratio;
    this.copies(this.px[s], this.py[s], reach, at, (x, y) => {
      to.beginPath();
      for (let k = 0; delta > 1 && delta <= 72 && k < delta; k++) {
        const edge = angle - 2 * half * k - half;
        to.moveTo(x + 0.9 * reach * Math.cos(edge), y + 0.9 * reach * Math.sin(edge));
        to.lineTo(x + reach * Math.cos(edge), y + reach * Math.sin(edge));
      }
      to.stroke();
      to.beginPath();
      for (const one of occupied) {
        const middle = angle - 2 * half * one.sector, range = one.range * at.scale;
        to.moveTo(x, y);
        to.arc(x, y, range, middle - half, middle + half);
        to.closePath();
      }
      to.fillStyle = faded(this.palette.marker, 0.1);
      to.fill();
      to.stroke();
    });
  }

  // Circles of the true radius. That of a body which is blocked is thick, and has a colour of its own.
  drawRadii(frame, at) {
    const { to, ratio, layout, palette } = this;
    const add = (s) => {
      const reach = layout.radius[s] * at.scale;
      if (reach > 0) this.copies(this.px[s], this.py[s], reach, at, (x, y) => {
        to.moveTo(x + reach, y);
        to.arc(x, y, reach, 0, 2 * Math.PI);
      });
    };
    const stroke = (colour, width, dash = []) => {
      to.strokeStyle = colour;
      to.lineWidth = width * ratio;
      to.setLineDash(dash.map((length) => length * ratio));
      to.stroke();
      to.setLineDash([]);
    };
    layout.scene.groups.forEach((group, g) => {
      for (let look = 0; look < 3; look++) {
        for (let s = this.head[3 * g + look]; s >= 0;) {
          s = this.pathOfSome(s, add);
          to.fillStyle = faded(this.colours[g], look === LOOKS.inactive ? 0.1 : 0.25);
          to.fill();
          stroke(this.colours[g], 1.2, look === LOOKS.inactive ? [3, 3] : []);
        }
      }
    });
    to.beginPath();
    for (let s = 0; s < frame.n; s++) if (has(frame, s, PRESENT) && has(frame, s, BLOCKED)) add(s);
    stroke(palette.blocked, 2.6);
  }

  // A marker is no larger than its body, as long as it can be seen.
  sizeIn(s, size, at) {
    const reach = this.layout.radius[s] * at.scale;
    return reach > 0 ? Math.min(size, Math.max(reach / 1.5, 3 * this.ratio)) : size;
  }

  drawBodies(at) {
    const { r, ratio, layout, to, px, py, frame } = this, isSmall = r < 2.6 * ratio;
    layout.scene.groups.forEach((group, g) => {
      const shape = isSmall && group.role === "robot" ? SHAPES.dart : SHAPES[this.shapes[g]];
      const size = group.role === "target" ? 0.9 * r : r;
      for (let look = 0; look < 3; look++) {
        const drawn = look === LOOKS.inactive ? SHAPES.inactive : shape;
        const add = (s) => {
          const angle = angleOf(frame, s);
          drawn(to, px[s], py[s], this.sizeIn(s, size, at), Math.cos(angle), -Math.sin(angle));
        };
        for (let s = this.head[3 * g + look]; s >= 0;) {
          s = this.pathOfSome(s, add);
          paintBodies(to, this.colours[g], look, size, ratio, this.palette.arena);
        }
      }
    });
  }

  // How many bodies of a group are at one place, where they look like one: "×3" beside it.
  drawCounts() {
    const { r, ratio, layout, to, px, py, palette } = this, font = `600 ${13 * ratio}px system-ui, sans-serif`;
    Object.assign(to, { font, textAlign: "left", textBaseline: "bottom", lineJoin: "round", lineWidth: 3 * ratio });
    Object.assign(to, { strokeStyle: palette.arena, fillStyle: palette.text });
    const places = layout.scene.groups.flatMap((_, g) => {
      const found = [];
      this.each(g, (s) => {
        const same = found.find(({ x, y }) => Math.hypot(px[s] - x, py[s] - y) < r);
        if (same) same.count += 1;
        else found.push({ x: px[s], y: py[s], count: 1 });
      }, LOOKS.hollow);
      return found;
    });
    this.counts = places.filter(({ count }) => count > 1);
    for (const { x, y, count } of this.counts) {
      to.strokeText(`×${count}`, x + r, y - r);
      to.fillText(`×${count}`, x + r, y - r);
    }
  }

  // Adds bodies of one look from slot s on to a new path, and returns the slot that follows, or −1. The time that
  // Chromium takes to fill a path grows with the square of the bodies in it.
  pathOfSome(s, add) {
    this.to.beginPath();
    for (let k = 0; k < 20 && s >= 0; k++, s = this.next[s]) add(s);
    return s;
  }

  drawMark(s, kind, at) {
    const { to, r, ratio, palette } = this;
    to.beginPath();
    to.arc(this.px[s], this.py[s], Math.max(2.1 * r, this.layout.radius[s] * at.scale) + 3 * ratio, 0, 2 * Math.PI);
    to.strokeStyle = kind === "marked" ? palette.soft : palette.marker;
    to.lineWidth = (kind === "selected" ? 2.2 : 1.3) * ratio;
    to.setLineDash(kind === "marked" ? [3 * ratio, 3 * ratio] : []);
    to.stroke();
    to.setLineDash([]);
  }

  // The body nearest to a point [pixels], or null; a large one is found everywhere within its radius. A scan of 5,000
  // takes 20 µs, less than keeping a grid would.
  nearest(x, y, within) {
    const { frame, px, py, layout, at } = this;
    let best = 1, found = null;
    for (let s = 0; frame && s < frame.n; s++) {
      const reach = Math.max(within, layout.radius[s] * at.scale);
      const distance = ((px[s] - x) ** 2 + (py[s] - y) ** 2) / reach ** 2;
      if (distance < best && has(frame, s, PRESENT)) [best, found] = [distance, s];
    }
    return found;
  }

  drawn() {
    const found = [];
    for (let s = 0; this.frame && s < this.frame.n; s++) {
      if (!has(this.frame, s, PRESENT)) continue;
      const [x, y] = this.toArena(this.px[s], this.py[s], this.at);
      found.push({ slot: s, x, y });
    }
    return found;
  }
}

// Whether the link in the other direction is missing, for each link. Sources are sorted.
function oneWay(source, target, n) {
  const first = new Uint32Array(n + 1), found = new Uint8Array(source.length);
  for (let k = 0; k < source.length; k++) first[source[k] + 1]++;
  for (let s = 0; s < n; s++) first[s + 1] += first[s];
  for (let k = 0; k < source.length; k++) {
    let isBack = false;
    for (let j = first[target[k]]; j < first[target[k] + 1] && !isBack; j++) isBack = target[j] === source[k];
    found[k] = isBack ? 0 : 1;
  }
  return found;
}

// Part: charts.

const NAMES = {
  observed: "Observed fraction", mean_neighbours: "Neighbours, mean", max_neighbours: "Neighbours, largest",
};
const isShare = (name) => name === "observed" || name === "observed so far";
const nameOf = (name) => NAMES[name] || capital(name.replaceAll("_", " "));
const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);
const DASHES = [[], [5, 3]];
// Ticks of a running mean.
const WINDOW = 100;

function shownValue(name, value) {
  if (!Number.isFinite(value)) return "–";
  if (isShare(name)) return `${(100 * value).toFixed(0)} %`;
  return Number.isInteger(value) && !name.startsWith("mean") ? String(value) : value.toFixed(value < 10 ? 2 : 1);
}

// The next of 1, 2, 5, 10, 20 …, or of other steps, that is not smaller.
function roundUp(value, steps = [1, 2, 5, 10]) {
  const power = 10 ** Math.floor(Math.log10(value));
  return steps.map((factor) => factor * power).find((one) => one >= value * (1 - 1e-9));
}

// One series against time, for all tracks; or the difference of two. The lines are drawn when data or size change; the
// cursor and the values are elements of their own, so that playing repaints nothing else.
class Chart {
  // `read(frame)` is the value; `lines` says which tracks; `difference` whether it is the one on the right minus the other.
  constructor(parent, name, view, difference = false) {
    Object.assign(this, { name, view, difference, isSmooth: false, means: [], drawnTo: [], domain: [0, 1], top: isShare(name) ? 1 : 0 });
    this.canvas = make("canvas", { class: "ts-chart-lines" });
    this.cursor = make("div", { class: "ts-cursor" });
    this.values = make("span", { class: "ts-values" });
    this.smoothButton = make("button", {
      type: "button", class: "ts-smooth", title: `Running mean of the last ${WINDOW} ticks`, "aria-pressed": "false",
      "aria-label": `Running mean of ${difference ? "the difference of " : ""}${nameOf(name)}`,
      onclick: () => this.setSmooth(!this.isSmooth),
    }, "~");
    const title = difference ? "Right − left" : nameOf(name);
    // A narrow page has one run below the other.
    const stacked = difference ? make("span", { class: "ts-stacked" }, "Lower − upper") : null;
    this.plot = make("div", { class: "ts-plot" }, this.canvas, this.cursor);
    this.bandText = make("p", { class: "ts-band-text", hidden: true });
    this.bandValues = make("p", { class: "ts-band-text ts-band-values", hidden: true });
    this.element = make("figure", { class: `ts-chart${difference ? " ts-difference" : ""}` },
      make("figcaption", {}, make("span", {}, make("span", { class: stacked && "ts-beside" }, title), stacked), this.smoothButton, this.values), this.plot, this.bandValues, this.bandText);
    this.plot.setAttribute("role", "img");
    this.plot.setAttribute("aria-label", `${difference ? nameOf(name) : ""} ${title} against time`.trim());
    if (difference) this.element.title = `${nameOf(name)} of the run on the right, minus that of the run on the left`;
    parent.append(this.element);
    this.describeBand();
    this.to = this.canvas.getContext("2d");
    let isHeld = false;
    const scrub = (event) => view.look(view.nearestIndex(this.timeAt(event.clientX)));
    this.plot.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      isHeld = true;
      this.plot.setPointerCapture(event.pointerId);
      scrub(event);
    });
    this.plot.addEventListener("pointermove", (event) => isHeld && scrub(event));
    for (const type of ["pointerup", "pointercancel"]) this.plot.addEventListener(type, () => { isHeld = false; });
  }

  get series() { return this.view.tracks.map(({ scene }) => scene.series.indexOf(this.name)); }

  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(Math.round(this.canvas.clientWidth * ratio), 1);
    const height = Math.max(Math.round(this.canvas.clientHeight * ratio), 1);
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    this.ratio = ratio;
    this.redraw();
  }

  // Pixels of the plotting area.
  get box() {
    const { ratio, canvas } = this;
    return { left: 40 * ratio, right: canvas.width - 8 * ratio, top: 6 * ratio, low: canvas.height - 16 * ratio };
  }

  px(time) {
    const { left, right } = this.box, [from, until] = this.domain;
    return left + ((right - left) * (time - from)) / (until - from);
  }

  py(value) {
    const { top, low } = this.box, least = this.difference ? -this.top : 0;
    return low - ((low - top) * (value - least)) / (this.top - least || 1);
  }

  timeAt(clientX) {
    const { left, right } = this.box, [from, until] = this.domain;
    const x = (clientX - this.canvas.getBoundingClientRect().left) * this.ratio;
    return from + (Math.min(Math.max((x - left) / (right - left), 0), 1)) * (until - from);
  }

  // The lines to draw: {at(k), time(k), length, colour, dash}.
  get lines() {
    const { tracks, palette } = this.view, series = this.series;
    const line = (t) => {
      const { frames } = tracks[t], s = series[t];
      return {
        at: (k) => (s < 0 ? NaN : frames[k].value(s)), time: (k) => frames[k].time, length: frames.length,
        colour: palette.tracks[t % 2], dash: DASHES[t % 2],
      };
    };
    if (!this.difference) return tracks.map((_, t) => this.smoothed(line(t), t));
    const [left, right] = [line(0), line(1)], { view } = this, { shared } = view;
    const at = (k) => right.at(view.indexAt(1, shared[k])) - left.at(view.indexAt(0, shared[k]));
    return [this.smoothed({ at, time: (k) => shared[k], length: shared.length, colour: palette.difference, dash: [] }, 0)];
  }

  setSmooth(on) {
    this.isSmooth = on;
    this.smoothButton.setAttribute("aria-pressed", String(on));
    this.redraw();
  }

  // The line, or its mean over the last ticks: from the sums up to each point, which are kept while the line grows.
  smoothed(line, l) {
    if (!this.isSmooth) return line;
    const sums = this.means[l] ||= { total: [0], count: [0], from: [] };
    return { ...line, at: (k) => {
      for (let j = sums.from.length; j <= k; j++) {
        const value = line.at(j), isThere = Number.isFinite(value);
        sums.total.push(sums.total[j] + (isThere ? value : 0));
        sums.count.push(sums.count[j] + isThere);
        let first = j ? sums.from[j - 1] : 0;
        while (line.time(first) <= line.time(j) - WINDOW) first += 1;
        sums.from.push(first);
      }
      const first = sums.from[k];
      return (sums.total[k + 1] - sums.total[first]) / (sums.count[k + 1] - sums.count[first]);
    } };
  }

  // Draws what has been added. All is drawn anew only where the axes must change.
  extend() {
    const lines = this.lines;
    let high = 0;
    lines.forEach((line, l) => {
      for (let k = Math.max((this.drawnTo[l] || 0) - 1, 0); k < line.length; k++) {
        const value = Math.abs(line.at(k));
        if (value > high) high = value;
      }
    });
    if (high > this.top || !this.drawnTo.length || this.domain !== this.view.domain) this.redraw();
    else this.drawLines(lines);
  }

  redraw() {
    const { to, canvas, ratio, view } = this, lines = this.lines;
    if (!ratio) return;
    this.means = [];
    let high = this.difference ? 0.05 : 0;
    for (const line of lines) {
      for (let k = 0; k < line.length; k++) high = Math.max(high, Math.abs(line.at(k)) || 0);
    }
    this.domain = view.domain;
    // Half of it is a mark too.
    this.top = isShare(this.name) && !this.difference ? 1 : roundUp(high || 2, [1, 2, 4, 6, 8, 10]);
    to.setTransform(1, 0, 0, 1, 0, 0);
    to.clearRect(0, 0, canvas.width, canvas.height);
    this.drawAxes();
    this.drawBand();
    this.drawnTo = [];
    this.drawnLength = [];
    this.drawLines(lines);
    this.moveCursor();
  }

  drawAxes() {
    const { to, ratio, view } = this, { left, right, low } = this.box, { palette } = view;
    to.font = `${10.5 * ratio}px system-ui, sans-serif`;
    to.fillStyle = palette.soft;
    to.strokeStyle = palette.grid;
    to.lineWidth = ratio;
    to.textAlign = "right";
    to.textBaseline = "middle";
    const marks = this.difference ? [-this.top, 0, this.top] : [0, this.top / 2, this.top];
    for (const mark of marks) {
      const y = Math.round(this.py(mark)) + 0.5;
      to.beginPath();
      to.moveTo(left, y);
      to.lineTo(right, y);
      to.stroke();
      to.fillText(this.axisText(mark), left - 5 * ratio, y);
    }
    to.textBaseline = "alphabetic";
    const bottom = low + 13 * ratio, [from, until] = this.domain;
    for (const [time, align] of [[from, "left"], [until, "right"]]) {
      to.textAlign = align;
      to.fillText(this.view.timeText(time), align === "left" ? left : right, bottom);
    }
    to.textAlign = "center";
    to.fillText(this.view.timeWord, (left + right) / 2, bottom);
  }

  // Says what the band is, and makes room for it.
  describeBand() {
    const { band } = this.view, isThere = Boolean(band) && this.name === "observed" && !this.difference;
    this.bandText.hidden = this.bandValues.hidden = !isThere;
    this.element.classList.toggle("ts-banded", isThere);
    setText(this.bandText, isThere ? band.text : "");
  }

  // What the band is at the time of the cursor, and of how many runs.
  bandValue({ ticks, mean, low, high, count }, t) {
    const k = lastAt(ticks, this.view.shownTime), { runs, bands } = this.view.band;
    if (k < 0) return "";
    const isOver = this.view.shownTime > ticks.at(-1), side = bands.length > 1 ? ["left: ", "right: "][t] : "";
    if (isOver) return `${side}no band after tick ${ticks.at(-1).toLocaleString("en")}`;
    const [least, middle, most] = [low, mean, high].map((values) => (values[k] === null ? "–" : (100 * values[k]).toFixed(0)));
    const some = mean[k] === null ? "no band, " : `mean ${middle} %, ${least} to ${most} %, `;
    return `${side}${some}n = ${count[k]}${count[k] < runs ? ` of ${runs}` : ""}`;
  }

  // Where most runs of other seeds lie, and their mean, behind the lines: one colour for each track. Paler where some
  // runs have no value.
  drawBand() {
    const { to, ratio, view } = this, { band, palette } = view;
    if (this.bandText.hidden) return;
    band.bands.forEach(({ ticks, mean, low, high, count }, t) => {
      const colour = palette.tracks[t % 2], there = ticks.map((_, k) => k).filter((k) => mean[k] !== null);
      // The first point of a path begins it, also by lineTo.
      const trace = (values, keys) => keys.forEach((k) => to.lineTo(this.px(ticks[k]), this.py(values[k])));
      // Stretches without a gap, in which all runs have a value or not all: nobody may have been there to be observed.
      const isWhole = (k) => count[k] === band.runs;
      const stretches = there.reduce((all, k) => {
        const last = all.length ? all.at(-1).at(-1) : -2;
        if (last === k - 1 && isWhole(last) === isWhole(k)) all.at(-1).push(k);
        else all.push(last === k - 1 ? [last, k] : [k]);
        return all;
      }, []);
      for (const keys of stretches) {
        to.beginPath();
        trace(high, keys);
        trace(low, [...keys].reverse());
        to.closePath();
        to.fillStyle = faded(colour, isWhole(keys.at(-1)) ? 0.22 : 0.1);
        to.fill();
        to.beginPath();
        trace(mean, keys);
        to.strokeStyle = colour;
        to.lineWidth = 1.8 * ratio;
        to.setLineDash([1.5 * ratio, 2.5 * ratio]);
        to.stroke();
        to.setLineDash([]);
      }
    });
  }

  axisText(value) {
    if (!isShare(this.name)) return String(Number(value.toPrecision(3)));
    return `${value > 0 && this.difference ? "+" : ""}${Number((100 * value).toPrecision(3))} %`.replace("-", "−");
  }

  drawLines(lines) {
    const { to, ratio } = this, { left, right } = this.box;
    to.lineWidth = 1.4 * ratio;
    to.lineJoin = "round";
    lines.forEach((line, l) => {
      const from = Math.max((this.drawnTo[l] || 0) - 1, 0);
      // Of more frames than pixels, each pixel has its least and largest value.
      const every = Math.floor(line.length / (2 * (right - left))) || 1;
      to.beginPath();
      to.strokeStyle = line.colour;
      to.setLineDash(line.dash.map((length) => length * ratio));
      to.lineDashOffset = this.length = this.drawnLength[l] || 0;
      this.last = null;
      if (every > 1 && from === 0) this.traceMany(line, every);
      else for (let k = from; k < line.length; k++) this.step(line.time(k), line.at(k), k === from);
      to.stroke();
      this.drawnTo[l] = line.length;
      this.drawnLength[l] = this.length;
    });
    to.setLineDash([]);
  }

  step(time, value, isFirst) {
    if (!Number.isFinite(value)) {
      // Nobody was there to be observed: the line has a gap.
      this.last = null;
      return;
    }
    const x = this.px(time), y = this.py(value);
    if (isFirst || !this.last) this.to.moveTo(x, y); else this.to.lineTo(x, y);
    // Dashes go on where the last stroke ended.
    if (this.last) this.length += Math.hypot(x - this.last[0], y - this.last[1]);
    this.last = [x, y];
  }

  traceMany(line, every) {
    for (let k = 0; k < line.length; k += every) {
      let least = Infinity, largest = -Infinity;
      for (let j = k; j < Math.min(k + every, line.length); j++) {
        const value = line.at(j);
        if (value < least) least = value;
        if (value > largest) largest = value;
      }
      this.step(line.time(k), least, !k);
      this.step(line.time(k), largest, false);
    }
  }

  moveCursor() {
    const { view, ratio } = this;
    if (!ratio) return;
    const time = view.shownTime, x = Math.min(Math.max(this.px(time), this.box.left), this.box.right) / ratio;
    this.cursor.style.transform = `translateX(${x.toFixed(2)}px)`;
    const texts = this.difference ? [this.differenceText()] : view.tracks.map((_, t) => this.valueText(t));
    if (this.values.childElementCount !== texts.length) {
      this.values.replaceChildren(...texts.map((_, t) => make("span", { class: `ts-value ts-value-${t}` })));
    }
    texts.forEach((text, t) => setText(this.values.children[t], text));
    if (!this.bandValues.hidden) setText(this.bandValues, view.band.bands.map((one, t) => this.bandValue(one, t)).filter(Boolean).join("; "));
  }

  valueText(t) {
    const frame = this.view.frameOf(t), s = this.series[t];
    return frame && s >= 0 ? shownValue(this.name, frame.value(s)) : "–";
  }

  differenceText() {
    const { shared, shownTime } = this.view, k = lastAt(shared, shownTime);
    const value = shared[k] === shownTime ? this.lines[0].at(k) : NaN, points = Math.round(100 * value);
    return Number.isFinite(value) ? `${points > 0 ? "+" : points < 0 ? "−" : "±"}${Math.abs(points)} points` : "–";
  }
}

function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

// Part: inspector.

const degrees = (angle) => {
  const whole = Math.round((angle * 180) / Math.PI);
  return `${Math.abs(whole)}°${whole > 0 && whole < 180 ? " left" : whole < 0 && whole > -180 ? " right" : ""}`;
};
const length = (value) => Number(value.toPrecision(3)).toString();
const MOST_ROWS = 12;

// What is known of one body, as elements.
class Inspector {
  constructor(view) {
    this.view = view;
    this.body = make("div", { class: "ts-inspected" });
    this.element = make("aside", { class: "ts-inspector", "aria-label": "Inspector" }, this.body);
    this.shown = "";
  }

  update(t, slot) {
    const { view } = this, track = view.tracks[t], frame = track && view.frameOf(t);
    if (!frame || slot === null) return this.hint();
    const { layout } = track, { scene } = layout, plain = frame.plain;
    const one = scene.slots[slot], group = scene.groups[one.group];
    const parts = [this.title(track, plain, slot, group, one)];
    if (!has(plain, slot, PRESENT)) parts.push(soft("Not in the world at this tick."));
    else parts.push(...this.present(layout, plain, slot, group, one));
    this.shown = "body";
    this.body.replaceChildren(...parts.filter(Boolean));
  }

  hint() {
    if (this.shown === "hint") return;
    this.shown = "hint";
    this.body.replaceChildren(
      make("h2", {}, "Inspector"),
      soft("Hover or tap a body to see what it perceives. A tapped one stays selected."),
      this.legend(),
    );
  }

  // The shapes of bodies and what they mean.
  legend() {
    const { view } = this, list = make("ul", { class: "ts-legend" }), seen = new Set();
    for (const { layout, arena } of view.tracks) {
      layout.scene.groups.forEach((group, g) => {
        const key = [group.name, group.role, arena.colours[g], arena.shapes[g]].join();
        if (seen.has(key)) return;
        seen.add(key);
        const line = (look, text) => list.append(make("li", {}, view.icon(arena, g, look), text));
        const more = { robot: ", with heading", target: ", observed" }[group.role] || "";
        line(LOOKS.full, `${group.name}${more}`);
        if (group.role === "target") line(LOOKS.hollow, `${group.name}, not observed`);
      });
    }
    const { layout, arena } = view.tracks[0] || {};
    if (layout && layout.scene.groups.length) {
      if (view.bodyCount <= MANY) list.append(make("li", {}, make("b", {}, "×2"), "two at one place"));
      list.append(make("li", {}, view.icon(arena, 0, LOOKS.inactive), "inactive"));
    }
    if (view.tracks.some((track) => track.layout.hasRadii)) {
      const ring = make("circle", { cx: 9, cy: 9, r: 6, fill: "none", stroke: view.palette.blocked, "stroke-width": 2.6 });
      const icon = make("svg", { viewBox: "0 0 18 18", width: 18, height: 18, "aria-hidden": "true" }, ring);
      list.append(make("li", {}, icon, "blocked by another body"));
    }
    return list;
  }

  title(track, frame, slot, group, one) {
    const { view } = this, isPresent = has(frame, slot, PRESENT);
    const look = isPresent ? lookOf(group.role, frame.flags[slot]) : LOOKS.inactive;
    const states = stateOf(track.scene, frame, slot);
    return make("div", { class: "ts-title" },
      make("h2", {}, view.icon(track.arena, one.group, look), `${group.name} · ${one.name ?? one.id}`),
      soft(states.join(", ")),
    );
  }

  present(layout, frame, slot, group, one) {
    const { scene } = layout, found = percept(layout, frame, slot), seenBy = observers(frame, slot);
    const x = layout.x(frame.x[slot]), y = layout.y(frame.y[slot]);
    const facts = [
      ["Position", `(${x.toFixed(3)}, ${y.toFixed(3)})`],
      ["Heading", `${Math.round((angleOf(frame, slot) * 180) / Math.PI) % 360}°`],
    ];
    if (group.policy) facts.push(["Policy", group.policy]);
    if (degreeOf(group)) facts.push(["Awareness", group.awareness ? degreeText(group.awareness) : "none"]);
    const shape = group.range_shape === "square" ? ", square" : "";
    if (one.radius) facts.push(["Radius", length(one.radius)]);
    // What recorded robots sense of targets is not known.
    if (senses(group) && !scene.clock) facts.push(["Sensing range", length(one.sensing_range) + shape]);
    if (degreeOf(group)) facts.push(["Awareness range", length(one.awareness_range) + shape]);
    const angle = (one.field_of_view * 180) / Math.PI;
    if (angle < 360 - 1e-4) facts.push(["Field of view", `${Math.round(angle)}°`]);
    if (group.lidar) {
      const { rays, range, field_of_view: view } = group.lidar, wide = Math.round((view * 180) / Math.PI);
      facts.push(["Lidar", `${rays} rays, range ${length(range)}${wide < 360 ? `, ${wide}°` : ""}`]);
    }
    for (const [name, value] of Object.entries(group.fields || {})) {
      // What is sensed without a sensor of its own is below.
      const isKnown = name.startsWith("senses ") && !/ by /.test(value);
      if (!isKnown) facts.push([capital(name.replaceAll("_", " ")), String(value)]);
    }
    const list = make("dl", { class: "ts-facts" });
    for (const [name, value] of facts) list.append(make("div", {}, make("dt", {}, name), make("dd", {}, value)));
    const parts = [list];
    scene.links.forEach((link, l) => {
      if (!seenBy[l].length || link.channel === "teammates") return;
      const names = seenBy[l].slice(0, MOST_ROWS).map((s) => bodyName(scene, s)).join(", ");
      const more = seenBy[l].length > MOST_ROWS ? " …" : "";
      parts.push(make("p", {}, make("strong", {}, "Sensed by "), names + more));
    });
    if (!found) parts.push(soft("Inactive: it perceives nothing."));
    else parts.push(...this.percept(layout, slot, group, one, found));
    return parts;
  }

  percept(layout, slot, group, one, found) {
    const { scene } = layout, parts = [];
    for (const channel of found.channels) {
      if (channel.channel === "teammates") continue;
      if (channel.omitted && senses(group)) {
        parts.push(section(`Senses ${channel.name}`, "", ""), soft(`${capital(tooMany(channel.omitted))}.`));
        continue;
      }
      if (!channel.sensed.length && !(group.role === "robot" && channel.channel === "targets")) continue;
      parts.push(section(`Senses ${channel.name}`, channel.sensed.length, channel.measured ? "as measured" : ""));
      parts.push(sensedTable(scene, channel.sensed));
    }
    if (!found.degree && !found.teammates.length) return parts;
    parts.push(...this.awareness(layout, slot, group, one, found));
    return parts;
  }

  // The ring as it is: what is in each occupied sector.
  ring(layout, group, one, found, measured) {
    const { delta } = group.awareness, occupied = found.ring, hidden = found.teammates.length - occupied.length;
    const label = `Ring of ${delta} sectors, ${occupied.length} occupied`;
    const canvas = make("canvas", { class: "ts-ring", role: "img", "aria-label": label });
    this.drawRing(canvas, occupied, delta, one.awareness_range, this.view.trackOf(layout).arena.colours[one.group]);
    const rows = occupied.map(({ sector, merged, range, bearing }) => [
      merged > 1 ? `${sector} (${merged} merged)` : String(sector), length(range), degrees(bearing),
    ]);
    const more = hidden ? ` ${plural(hidden, "teammate")} behind a nearer one in the same sector.` : "";
    return [
      section(`Ring, δ = ${delta}`, `${occupied.length} of ${delta}`, measured), canvas,
      rows.length ? table(["sector", "nearest", "bearing"], rows) : null,
      soft(`Sector 0 is straight ahead.${more}`),
    ];
  }

  awareness(layout, slot, group, one, found) {
    const { scene } = layout, { teammates } = found, count = teammates.length;
    const { omitted } = found.channels[layout.teammates] || {};
    if (omitted) return [section("Neighbours", "", ""), soft(`${capital(tooMany(omitted))}.`)];
    const measured = layout.teammates >= 0 && scene.links[layout.teammates].measured ? "as measured" : "";
    if (found.degree === "ring") {
      const note = section("Neighbours", count, count ? "not identified by the ring" : "");
      return [...this.ring(layout, group, one, found, measured), note, sensedTable(scene, teammates)];
    }
    if (found.degree === "nearest") {
      const { nearest } = found, hidden = count - nearest.length;
      return [
        section(`Nearest, δ = ${group.awareness.delta}`, nearest.length, measured), sensedTable(scene, nearest),
        soft(`Not identified.${hidden ? ` ${plural(hidden, "neighbour")} beyond them.` : ""}`),
      ];
    }
    const parts = [section("Neighbours", count, measured), sensedTable(scene, teammates)];
    if (found.degree === "none") parts.push(soft("Its degree of awareness shows none of them."));
    if (found.degree && !["none", "ring", "pairwise", "shared"].includes(found.degree)) {
      parts.push(soft(`What ${found.degree} shows of them is not recorded.`));
    }
    if (found.degree === "shared") {
      parts.push(section("Relayed targets", found.relayed.length, ""));
      parts.push(table(["", "by", "range", "bearing"], found.relayed.map((s) => [
        bodyName(scene, s.slot), bodyName(scene, s.by), length(s.range), degrees(s.bearing),
      ])));
    }
    return parts;
  }

  // The ring with straight ahead at the top; sector numbers grow anticlockwise.
  drawRing(canvas, occupied, delta, reach, colour) {
    const ratio = Math.min(window.devicePixelRatio || 1, 2), side = 168 * ratio, { palette } = this.view;
    Object.assign(canvas, { width: side, height: side });
    const to = canvas.getContext("2d"), middle = side / 2, radius = side / 2 - 14 * ratio, half = Math.PI / delta;
    const angle = (sector) => -Math.PI / 2 - 2 * half * sector;
    to.lineWidth = ratio;
    to.strokeStyle = palette.grid;
    for (const share of [0.5, 1]) {
      to.beginPath();
      to.arc(middle, middle, radius * share, 0, 2 * Math.PI);
      to.stroke();
    }
    to.beginPath();
    for (let k = 0; delta > 1 && delta <= 120 && k < delta; k++) {
      const edge = angle(k) - half;
      to.moveTo(middle, middle);
      to.lineTo(middle + radius * Math.cos(edge), middle + radius * Math.sin(edge));
    }
    to.stroke();
    for (const one of occupied) {
      const range = (radius * Math.min(one.range, reach)) / (reach || 1);
      to.beginPath();
      to.moveTo(middle, middle);
      to.arc(middle, middle, range, angle(one.sector) - half, angle(one.sector) + half);
      to.closePath();
      to.fillStyle = faded(colour, 0.28);
      to.fill();
      to.beginPath();
      to.arc(middle, middle, range, angle(one.sector) - half, angle(one.sector) + half);
      to.strokeStyle = colour;
      to.lineWidth = 3 * ratio;
      to.stroke();
    }
    to.beginPath();
    SHAPES.arrow(to, middle, middle, 5 * ratio, 0, -1);
    to.fillStyle = palette.text;
    to.fill();
    this.numberSectors(to, delta, middle, radius, angle, ratio);
  }

  numberSectors(to, delta, middle, radius, angle, ratio) {
    to.font = `${10 * ratio}px system-ui, sans-serif`;
    to.textAlign = "center";
    to.textBaseline = "middle";
    to.fillStyle = this.view.palette.soft;
    const every = Math.ceil(delta / 16);
    for (let k = 0; k < delta; k += every) {
      const out = radius + 7 * ratio;
      to.fillText(String(k), middle + out * Math.cos(angle(k)), middle + out * Math.sin(angle(k)));
    }
  }
}

const soft = (text) => make("p", { class: "ts-soft" }, text);
const plural = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;
const bodyName = (scene, slot) => {
  const { group, name, id } = scene.slots[slot];
  return `${scene.groups[group].name} ${name ?? id}`;
};

// The states of a body in words.
function stateOf(scene, frame, slot) {
  if (!has(frame, slot, PRESENT)) return [];
  const states = [has(frame, slot, ACTIVE) ? "active" : "inactive"];
  if (scene.groups[scene.slots[slot].group].role === "target") {
    states.push(has(frame, slot, OBSERVED) ? "observed" : "not observed");
  }
  if (has(frame, slot, BLOCKED)) states.push("blocked");
  return states;
}

function degreeText({ name, delta }) {
  return delta === undefined || delta === null ? name : `${name}, δ = ${delta}`;
}

function section(title, count, note) {
  const more = note ? make("span", { class: "ts-soft" }, ` ${note}`) : null;
  return make("h3", {}, title, make("span", { class: "ts-count" }, String(count)), more);
}

function sensedTable(scene, found) {
  const rows = found.map(({ slot, range, bearing }) => [bodyName(scene, slot), length(range), degrees(bearing)]);
  return table(["", "range", "bearing"], rows);
}

function table(header, rows) {
  if (!rows.length) return soft("none");
  const line = (row) => make("tr", {}, ...row.map((cell) => make("td", {}, cell)));
  const body = make("tbody", {}, ...rows.slice(0, MOST_ROWS).map(line));
  if (rows.length > MOST_ROWS) {
    const more = `and ${rows.length - MOST_ROWS} more`;
    body.append(make("tr", {}, make("td", { colspan: header.length, class: "ts-soft" }, more)));
  }
  const names = header.map((cell) => make("th", { scope: "col" }, cell));
  return make("table", {}, make("thead", {}, make("tr", {}, ...names)), body);
}

// Part: view.

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16];
// Frames a second at speed 1.
const PACE = 20;
// Over more ticks than these the way between two frames is not straight.
const SMOOTH_EVERY = 5;
const KEPT_FRAMES = 20000, KEPT_BYTES = 96e6;
const ICONS = {
  play: "M5 3l11 7-11 7z", pause: "M5 3h3.5v14H5zM11.5 3H15v14h-3.5z",
  first: "M4 3h2.2v14H4zM16 3v14L7 10z", last: "M13.8 3H16v14h-2.2zM4 3l9 7-9 7z",
  back: "M12.5 4v12L4.5 10zM14 4h2v12h-2z", forward: "M7.5 4l8 6-8 6zM4 4h2v12H4z",
  loop: "M4 9a5 5 0 0 1 5-5h4V2l4 3-4 3V6H9a3 3 0 0 0-3 3zM16 11a5 5 0 0 1-5 5H7v2l-4-3 4-3v2h4a3 3 0 0 0 3-3z",
  fit: "M3 3h5v2H5v3H3zM12 3h5v5h-2V5h-3zM3 12h2v3h3v2H3zM15 12h2v5h-5v-2h3z",
  closer: "M9 3h2v6h6v2h-6v6H9v-6H3V9h6z", wider: "M3 9h14v2H3z",
  help: "M6 7a4 4 0 1 1 5.5 3.7c-.6.3-.6.6-.6 1.8H9c0-2 .2-2.6 1.6-3.4A2 2 0 1 0 8 7zM9 14h2v2.2H9z",
  save: "M9 2h2v7l3-3 1.4 1.4L10 12.8 4.6 7.4 6 6l3 3zM3 14h2v2h10v-2h2v4H3z",
};
const HELP = [
  ["Space", "play or pause"], ["← →", "one frame back or forward; with Shift, pan"],
  ["PgUp PgDn", "ten frames back or forward"], ["Home End", "first and last frame"], [", .", "slower, faster"],
  ["o", "loop"], ["+ −", "zoom in, out; also the wheel or two fingers"],
  ["f", "fit the arena; drag to pan"], ["r", "sensing ranges"], ["a", "awareness ranges"], ["l", "links of teammates"],
  ["k", "links of other channels"], ["t", "trails"], ["[ ]", "previous, next body"], ["Esc", "release the body"],
  ["s", "save the picture"], ["?", "this help"],
];

// What keys do.
const ACTS = {
  " ": (view) => view.toggle(), ArrowLeft: (view) => view.step(-1), ArrowRight: (view) => view.step(1),
  PageUp: (view) => view.step(-10), PageDown: (view) => view.step(10),
  Home: (view) => view.look(0), End: (view) => view.look(view.frameCount - 1),
  "Shift ArrowLeft": (view) => view.pan(-0.1, 0), "Shift ArrowRight": (view) => view.pan(0.1, 0),
  "Shift ArrowUp": (view) => view.pan(0, 0.1), "Shift ArrowDown": (view) => view.pan(0, -0.1),
  "+": (view) => view.zoom(1.4), "=": (view) => view.zoom(1.4), "-": (view) => view.zoom(1 / 1.4),
  "−": (view) => view.zoom(1 / 1.4), f: (view) => view.fit(), 0: (view) => view.fit(),
  ",": (view) => view.setSpeed(-1), ".": (view) => view.setSpeed(1), o: (view) => view.setLoop(!view.loop),
  "[": (view) => view.selectNext(-1), "]": (view) => view.selectNext(1),
  Escape: (view) => view.select(view.selected.track, null), s: (view) => view.savePicture(), "?": (view) => view.help(),
};
// By how many frames keys move the slider that has the focus, as they move any slider.
const SLIDER_KEYS = {
  ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10, Home: -Infinity, End: Infinity,
};
for (const key of "ralkt") ACTS[key] = (view) => view.toggleKey(key);

// The page. Of a replay, the whole is there from the start; of a live run, frames are appended.
//
//   setScene(i, scene)     what track i shows; a new one is added; frames are kept unless another box is around the
//                          arena, or series or links are others
//   append(i, frame)       add a frame of decodeFrame (or of decodeReplay) to track i
//   clear(i)               drop the frames of track i
//   removeTrack(i)         drop the last track
//   tracks[i]              {scene, frames, layout, arena}
//   times                  the ticks of which any track has a frame, in order; each track shows its latest frame until then
//   shared                 the ticks of which all tracks have a frame; only there two tracks are compared
//   position               index of the tick that is shown, among these; shownTime is the tick
//   show(index)            show the tick of this index; the last one is followed in a live page
//   play(), pause()        and `playing`; in a live page, play goes on to the newest frame and follows it
//   following              live: the newest frame is shown; going back stops it
//   select(track, slot)    slot null releases; `selected` is {track, slot}; `onselect(selected)` is called
//   drawn(i)               [{slot, x, y}] computed back from the last drawing, in units of the arena
//   slot(name)             empty elements for panels: "controls", "log", "graph"
//   keep                   most frames that a live page keeps of a track; `keepBytes` the most memory
//   transport              {play(), pause(), step(frames)}: what a live page does in place of the view's own, if it
//                          returns true; `transport.running` says which of play and pause the button shows
//   inspect(i, slot)       the percept of a body in the frame shown, for tests and panels
class View {
  constructor(root, { live = false, title = document.title } = {}) {
    Object.assign(this, {
      root, live, title, tracks: [], at: 0, playing: false, following: live, keep: KEPT_FRAMES, keepBytes: KEPT_BYTES,
      selected: { track: 0, slot: null }, hovered: { track: 0, slot: null }, onselect: null, transport: null,
      camera: { zoom: 1, x: 0.5, y: 0.5 }, speed: 1, every: 1, loop: false, palette: dark() ? DARK : LIGHT,
      toggles: {}, charts: [], drawings: 0, scheduled: 0, isDirty: true, lastInspected: 0, lastSaid: 0,
      isSeen: true, domain: [0, 1], times: [], shared: [], unseen: new Set(), band: null,
    });
    this.build();
    this.listen();
  }

  // The interface.

  get position() {
    const index = Math.floor(this.at + 1e-9);
    return this.playing && !this.following ? index - (index % this.every) : index;
  }
  get frameCount() { return this.times.length; }

  setScene(i, scene) {
    if (i < 0 || i > this.tracks.length) throw new Error(`track ${i}: the next one is ${this.tracks.length}`);
    const before = this.tracks[i], layout = new Layout(scene);
    if (!before) this.addTrack(i, scene, layout);
    else {
      // Frames are read by these.
      const read = ({ name, measured }) => [name, measured];
      // A series that is added leaves frames as they are: those of before have no value of it.
      const kept = before.scene.series.length;
      const key = ({ bounds, series, links: lists }) => JSON.stringify([bounds, series.slice(0, kept), lists.map(read)]);
      const isMoved = key(before.scene) !== key(scene);
      Object.assign(before, { scene, layout });
      before.arena.setLayout(layout);
      if (isMoved) this.clear(i);
      for (const one of [this.selected, this.hovered]) {
        if (one.track === i && one.slot >= scene.slots.length) one.slot = null;
      }
    }
    this.describeTracks();
    this.inspector.shown = "";
    this.invalidate();
  }

  append(i, frame) {
    const track = this.tracks[i], { frames } = track;
    const isNew = !frames.length || frame.time > frames[frames.length - 1].time;
    if (!isNew) {
      // The same tick again, after a change while paused; an earlier one after a restart.
      if (frame.time < frames[frames.length - 1].time) this.clear(i);
      else {
        track.bytes -= frames.pop().bytes || 0;
        this.redrawCharts();
      }
    }
    frames.push(frame);
    track.bytes += frame.bytes || 0;
    const { times } = this;
    if (!times.length || frame.time > times[times.length - 1]) times.push(frame.time);
    else if (times[lastAt(times, frame.time)] !== frame.time) this.refreshTimes();
    if (!(this.shared.at(-1) >= frame.time) && this.isShared(frame.time)) this.shared.push(frame.time);
    this.forget(track);
    if (this.following) this.at = Math.max(this.frameCount - 1, 0);
    this.isGrown = true;
    this.invalidate();
  }

  clear(i) {
    const track = this.tracks[i];
    track.frames.length = 0;
    track.bytes = 0;
    this.refreshTimes();
    this.at = this.following ? Math.max(this.frameCount - 1, 0) : 0;
    this.redrawCharts();
    this.invalidate();
  }

  // Lines that grew piece by piece are drawn anew as a whole.
  redrawCharts() {
    for (const chart of this.charts) chart.drawnTo = [];
    this.isGrown = true;
  }

  // Only the last track can go.
  removeTrack(i) {
    const track = this.tracks[i];
    this.observer.unobserve(track.canvas);
    track.box.remove();
    this.tracks.length = i;
    this.refreshTimes();
    if (this.selected.track >= i) this.select(0, null);
    if (this.hovered.track >= i) this.hovered = { track: 0, slot: null };
    this.buildCharts();
    this.describeTracks();
    this.resize();
  }

  show(index) {
    const last = Math.max(this.frameCount - 1, 0);
    this.at = Math.min(Math.max(Number(index) || 0, 0), last);
    this.following = this.live && this.at >= last;
    this.invalidate();
  }

  play() {
    if (!this.live && this.at >= this.frameCount - 1) this.at = 0;
    this.playing = true;
    this.since = 0;
    if (this.live && this.at >= this.frameCount - 1) this.following = true;
    this.showState();
    this.invalidate();
  }

  pause() {
    this.at = this.position;
    if (this.live && this.following) this.redrawCharts();
    this.playing = false;
    if (this.live) this.following = this.at >= this.frameCount - 1;
    this.showState();
    this.say(true);
    this.invalidate();
  }

  select(track, slot) {
    this.selected = { track, slot: slot === undefined ? null : slot };
    if (this.onselect) this.onselect(this.selected);
    this.lastInspected = 0;
    this.invalidate();
  }

  drawn(i) { return this.tracks[i].arena.drawn(); }
  slot(name) { return this.slots[name]; }
  inspect(i, slot) { return percept(this.tracks[i].layout, this.frameOf(i), slot); }

  // What is shown.

  // Works out `times` after frames have gone, or come between others; the tick that is shown stays.
  refreshTimes() {
    const { shownTime } = this;
    this.times = [...new Set(this.tracks.flatMap(({ frames }) => frames.map(({ time }) => time)))].sort((a, b) => a - b);
    this.shared = this.times.filter((time) => this.isShared(time));
    this.at = Math.max(lastAt(this.times, shownTime), 0);
    this.redrawCharts();
  }

  // Whether all tracks have a frame of a time; of a live run it may be on its way.
  isShared(time) { return this.tracks.every(({ frames }, i) => frames[this.indexAt(i, time)]?.time === time); }

  get shownTime() { return this.times[this.position] ?? 0; }

  // How people are told a time: ticks, or the time of a record by its clock.
  get timeWord() { return this.tracks[0]?.scene.clock ? "time" : "tick"; }
  timeText(tick) {
    const { clock } = this.tracks[0]?.scene ?? {};
    return clock ? recordedTime(clock, tick) : String(Math.round(tick));
  }

  // The index of the last frame of a track at or before a time; −1 if there is none.
  indexAt(i, time) {
    const { frames } = this.tracks[i];
    return lastAt(frames, time, (frame) => frame.time);
  }

  indexOf(i) { return this.indexAt(i, this.shownTime); }
  frameOf(i) { return this.tracks[i].frames[this.indexOf(i)] || null; }
  trackOf(layout) { return this.tracks.find((track) => track.layout === layout); }

  // The index of the tick nearest to a time, among those of which there are frames.
  nearestIndex(time) {
    const { times } = this, before = Math.max(lastAt(times, time), 0), after = Math.min(before + 1, times.length - 1);
    return Math.abs(times[after] - time) < Math.abs(times[before] - time) ? after : before;
  }

  // The times that charts show. Those of a run that still grows have room to the right, so that axes change rarely.
  fitDomain() {
    const ends = this.tracks.flatMap(({ frames }) => (frames.length ? [frames[0].time, frames.at(-1).time] : []));
    if (this.band) ends.push(this.band.bands[0].ticks.at(-1));
    const first = ends.length ? Math.min(...ends) : 0, last = ends.length ? Math.max(...ends) : 1;
    const [from, until] = this.domain, quarter = from + (until - from) / 4;
    if (this.live && first >= from && first <= quarter && last >= quarter && last <= until) return;
    const span = Math.max(last - first, 1), room = roundUp(Math.max(1.1 * span, 100), [1, 1.5, 2, 3, 5, 7, 10]);
    const end = first + (this.live ? room : span);
    if (first !== from || end !== until) this.domain = [first, end];
  }

  // Drops the oldest frames in tenths, so that appending stays quick.
  forget(track) {
    const { frames } = track;
    if (!this.live || (frames.length <= this.keep && track.bytes <= this.keepBytes)) return;
    const count = Math.min(Math.max(Math.ceil(frames.length / 10), frames.length - this.keep), frames.length - 1);
    for (const frame of frames.splice(0, count)) track.bytes -= frame.bytes || 0;
    this.refreshTimes();
  }

  // Building.

  build() {
    const { root } = this;
    root.classList.add("ts");
    root.classList.toggle("ts-live", this.live);
    root.replaceChildren();
    this.heading = make("h1", {}, this.title);
    this.chips = make("div", { class: "ts-chips", role: "group", "aria-label": "Show" });
    this.tools = make("div", { class: "ts-tools" },
      this.button("wider", "Zoom out (−)", () => this.zoom(1 / 1.4)),
      this.button("closer", "Zoom in (+)", () => this.zoom(1.4)),
      this.button("fit", "Fit the arena (f)", () => this.fit()),
      this.button("save", "Save the picture (s)", () => this.savePicture()),
      this.button("help", "Help (?)", () => this.help()),
    );
    this.stage = make("div", { class: "ts-stage" });
    this.chartRow = make("div", { class: "ts-charts" });
    this.inspector = new Inspector(this);
    const panel = (name) => [name, make("section", { class: `ts-slot ts-${name}` })];
    this.slots = Object.fromEntries(["controls", "log", "graph"].map(panel));
    this.status = make("p", { class: "ts-hidden", role: "status", "aria-live": "polite", id: "ts-status" });
    this.tip = make("div", { class: "ts-tip", hidden: true });
    this.dialog = this.buildHelp();
    root.append(
      make("header", { class: "ts-head" }, this.heading, this.chips, this.tools),
      make("div", { class: "ts-body" }, this.slots.controls,
        make("div", { class: "ts-centre" }, this.stage, this.buildTransport(), this.chartRow),
        make("div", { class: "ts-side" }, this.inspector.element, this.slots.graph, this.slots.log)),
      this.status, this.tip, this.dialog,
    );
  }

  button(icon, title, act) {
    const label = title.replace(/ \(.*\)$/, ""), path = make("path", { d: ICONS[icon], fill: "currentColor" });
    return make("button", { type: "button", class: "ts-button", title, "aria-label": label, onclick: act },
      make("svg", { viewBox: "0 0 20 20", width: 18, height: 18, "aria-hidden": "true" }, path));
  }

  // A button of the transport that a phone has no room for.
  end(icon, title, act) {
    const button = this.button(icon, title, act);
    button.classList.add("ts-end");
    return button;
  }

  buildTransport() {
    this.playButton = this.button("play", "Play (space)", () => this.toggle());
    this.playButton.classList.add("ts-play");
    this.loopButton = this.button("loop", "Loop (o)", () => this.setLoop(!this.loop));
    this.loopButton.classList.add("ts-loop");
    this.loopButton.setAttribute("aria-pressed", "false");
    const scale = { type: "range", min: 0, max: 0, step: "any", value: 0 };
    this.scrub = make("input", { ...scale, class: "ts-scrub", "aria-label": "Tick" });
    this.scrub.addEventListener("input", () => this.look(this.nearestIndex(Number(this.scrub.value))));
    this.scrub.addEventListener("keydown", (event) => this.onSliderKey(event));
    this.clockText = make("span", { class: "ts-clock" });
    const option = (value, text, chosen) => make("option", { value, selected: value === chosen }, text);
    const pace = `Speed; 1× is ${PACE} frames a second (, and .)`;
    this.speedSelect = make("select", { "aria-label": "Speed", title: pace },
      ...SPEEDS.map((speed) => option(speed, `${speed}×`, this.speed)));
    this.speedSelect.addEventListener("change", () => { this.speed = Number(this.speedSelect.value); });
    const title = "Show every frame, or every second, fifth …";
    this.everySelect = make("select", { class: "ts-end", "aria-label": "Frames to show", title },
      ...[1, 2, 5, 10, 20, 50].map((every) => option(every, `every ${every}`, this.every)));
    this.everySelect.addEventListener("change", () => { this.every = Number(this.everySelect.value); });
    return make("div", { class: "ts-transport", role: "group", "aria-label": "Playing" },
      this.end("first", "First frame (home)", () => this.look(0)),
      this.button("back", "Step back (←)", () => this.step(-1)),
      this.playButton,
      this.button("forward", "Step forward (→)", () => this.step(1)),
      this.end("last", "Last frame (end)", () => this.look(this.frameCount - 1)),
      this.scrub, this.clockText, this.speedSelect, this.everySelect, this.loopButton);
  }

  buildHelp() {
    const keys = (text) => text.split(" ").flatMap((one, k) => [k ? " " : "", make("kbd", {}, one)]);
    const row = ([key, text]) => make("tr", {}, make("th", { scope: "row" }, ...keys(key)), make("td", {}, text));
    const dialog = make("dialog", { class: "ts-help", "aria-labelledby": "ts-help-title" },
      make("h2", { id: "ts-help-title" }, "Keys"), make("table", {}, make("tbody", {}, ...HELP.map(row))),
      make("button", { type: "button", class: "ts-button ts-wide", onclick: () => dialog.close() }, "Close"));
    return dialog;
  }

  addTrack(i, scene, layout) {
    const canvas = make("canvas", { tabindex: 0, role: "img", "aria-describedby": "ts-status" });
    const caption = make("h2", { class: "ts-caption" });
    const observed = make("span", { class: `ts-observed ts-value-${i}` });
    const scale = make("div", { class: "ts-scale" }, make("span"));
    const omitted = make("p", { class: "ts-omitted", hidden: true });
    const box = make("section", { class: "ts-track" },
      make("div", { class: "ts-top" }, caption, observed), make("div", { class: "ts-canvas" }, canvas, scale, omitted));
    const arena = new Arena(canvas, this.camera, this.palette);
    arena.setLayout(layout);
    this.tracks[i] = { scene, layout, frames: [], bytes: 0, arena, canvas, caption, observed, scale, omitted, box };
    this.stage.append(box);
    this.observer.observe(canvas);
    this.listenToCanvas(i, canvas);
    this.refreshTimes();
    this.buildCharts();
    this.resize();
  }

  // Captions, toggles and whatever else depends on the scenes.
  describeTracks() {
    const { tracks } = this, isPair = tracks.length > 1;
    this.stage.classList.toggle("ts-pair", isPair);
    tracks.forEach((track, t) => {
      track.canvas.setAttribute("aria-label", `Arena of ${track.scene.title}`);
      track.caption.hidden = !isPair && (!this.title || track.scene.title === this.title);
      const swatch = isPair ? make("span", { class: `ts-swatch ts-swatch-${t}` }) : null;
      track.caption.replaceChildren(...[swatch, track.scene.title].filter(Boolean));
    });
    this.heading.title = this.title || tracks[0].scene.title;
    setText(this.heading, this.heading.title);
    this.root.classList.toggle("ts-many", this.bodyCount > VERY_MANY);
    this.buildChips();
    if (this.charts.map((chart) => chart.name).join() !== this.chartNames.join()) this.buildCharts();
  }

  nameOf(name) { return nameOf(name); }

  // A band behind the observed fraction, {text, runs, bands: [{ticks, mean, low, high, count}]}, or null.
  setBand(band) {
    this.band = band;
    this.fitDomain();
    for (const chart of this.charts) chart.describeBand();
    for (const chart of this.charts) chart.resize();
    this.invalidate();
  }

  // Which series have no chart.
  hideSeries(names) {
    if ([...this.unseen].join() === names.join()) return;
    this.unseen = new Set(names);
    this.buildCharts();
    this.redrawCharts();
    this.invalidate();
  }

  // The numbers of the charts, for a spreadsheet: a row for each time, a column for each chart and track. A number of a
  // frame has 32 bits, which nine digits hold.
  csv() {
    const { tracks } = this, side = (t) => (tracks.length > 1 ? ["left ", "right "][t] : "");
    const columns = this.chartNames.filter((name, k, all) => all.indexOf(name) === k).flatMap((name) => (
      tracks.map(({ scene }, t) => ({ t, s: scene.series.indexOf(name), title: side(t) + name }))
    )).filter(({ s }) => s >= 0);
    const cell = ({ t, s }, time) => {
      const frame = tracks[t].frames[lastAt(tracks[t].frames, time, (one) => one.time)];
      const value = frame && frame.time === time ? frame.value(s) : NaN;
      if (!Number.isFinite(value)) return "";
      // A frame has 24 bits of it: the fewest digits that say so.
      const digits = [6, 7, 8].find((count) => Math.fround(value.toPrecision(count)) === Math.fround(value)) ?? 9;
      return String(Number(value.toPrecision(digits)));
    };
    const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
    const rows = this.times.map((time) => [time, ...columns.map((one) => cell(one, time))].join());
    return [["time", ...columns.map(({ title }) => quoted(title))].join(), ...rows, ""].join("\r\n");
  }

  get bodyCount() { return Math.max(...this.tracks.map(({ scene }) => scene.slots.length), 0); }
  get chartNames() {
    const names = [...new Set(this.tracks.flatMap(({ scene }) => scene.series))].filter((name) => !this.unseen.has(name));
    // The second of a name is the difference of two tracks.
    return this.tracks.length > 1 ? names.flatMap((name) => (isShare(name) ? [name, name] : [name])) : names;
  }

  buildCharts() {
    this.chartRow.replaceChildren();
    const names = this.chartNames;
    const smooth = new Map(this.charts.map((chart) => [`${chart.name} ${chart.difference}`, chart.isSmooth]));
    this.charts = names.map((name, k) => new Chart(this.chartRow, name, this, names.indexOf(name) !== k));
    for (const chart of this.charts) chart.setSmooth(smooth.get(`${chart.name} ${chart.difference}`) || false);
    this.chartRow.classList.toggle("ts-wrapped", this.charts.length > 4);
    for (const chart of this.charts) chart.resize();
  }

  // The toggles: ranges, links by name, trails.
  buildChips() {
    const names = [...new Set(this.tracks.flatMap(({ scene }) => scene.links.map(({ name }) => name)))];
    const wanted = [
      ["ranges", ["", "Sensing", " ranges"], "r", this.bodyCount <= 2 * MANY],
      ["awareness", ["", "Awareness", " ranges"], "a", false],
      ...names.map((name) => [
        `links ${name}`, ["Links to ", name, ""], name === "teammates" ? "l" : "k", this.bodyCount <= MANY,
      ]),
      ["trails", ["", "Trails", ""], "t", this.bodyCount <= MANY / 2],
    ];
    if (wanted.map(([name]) => name).join() === Object.keys(this.toggles).join()) return;
    this.chips.replaceChildren();
    const before = this.toggles;
    this.toggles = {};
    // A narrow page leaves the words before and after out.
    const word = (text) => (text ? make("span", { class: "ts-word" }, text) : null);
    for (const [name, [prefix, text, suffix], key, isOn] of wanted) {
      const label = prefix + text + suffix, onclick = () => this.setToggle(name, !this.toggles[name].on);
      const facts = { type: "button", class: "ts-chip", title: `${label} (${key})`, "aria-label": label, onclick };
      const button = make("button", facts, word(prefix), text, word(suffix));
      this.toggles[name] = { on: name in before ? before[name].on : isOn, button, key };
      button.setAttribute("aria-pressed", String(this.toggles[name].on));
      this.chips.append(button);
    }
  }

  setToggle(name, on) {
    this.toggles[name].on = on;
    this.toggles[name].button.setAttribute("aria-pressed", String(on));
    this.invalidate();
  }

  toggleKey(key) {
    const names = Object.keys(this.toggles).filter((name) => this.toggles[name].key === key);
    const on = !names.some((name) => this.toggles[name].on);
    for (const name of names) this.setToggle(name, on);
  }

  icon(arena, g, look) { return bodyIcon(arena.shapes[g], arena.colours[g], look, this.palette.arena); }

  // Playing.

  toggle() {
    const { transport } = this;
    const isRunning = transport && "running" in transport ? transport.running : this.playing;
    if (isRunning) this.halt(); else this.start();
  }

  // What the user asks for: a live page may do something else, such as running the model.
  start() { if (!(this.transport && this.transport.play && this.transport.play())) this.play(); }
  halt() { if (!(this.transport && this.transport.pause && this.transport.pause())) this.pause(); }

  // Shows a frame that the user has chosen. A live model goes on meanwhile.
  look(index) {
    this.pause();
    this.show(index);
    this.say(true);
  }

  step(count) {
    if (this.transport && this.transport.step && this.transport.step(count)) return;
    this.look(this.position + count * this.every);
  }

  setLoop(on) {
    this.loop = on;
    this.loopButton.setAttribute("aria-pressed", String(on));
  }

  setSpeed(by) {
    const at = Math.min(Math.max(SPEEDS.indexOf(this.speed) + by, 0), SPEEDS.length - 1);
    this.speed = SPEEDS[at];
    this.speedSelect.value = String(this.speed);
  }

  showState() {
    const { transport } = this, isRunning = transport && "running" in transport ? transport.running : this.playing;
    this.playButton.setAttribute("aria-label", isRunning ? "Pause" : "Play");
    this.playButton.title = isRunning ? "Pause (space)" : "Play (space)";
    this.playButton.querySelector("path").setAttribute("d", ICONS[isRunning ? "pause" : "play"]);
    this.root.dataset.playing = String(isRunning);
  }

  // Drawing.

  invalidate() {
    this.isDirty = true;
    if (!this.scheduled) this.scheduled = requestAnimationFrame((now) => this.tick(now));
  }

  tick(now) {
    this.scheduled = 0;
    this.advance(now);
    if (this.isDirty) this.draw(now);
    this.isDirty = false;
    const isMoving = this.playing && !(this.live && this.following);
    if (isMoving && this.isSeen) this.scheduled = requestAnimationFrame((later) => this.tick(later));
  }

  advance(now) {
    if (!this.playing || this.following) return;
    const passed = this.since ? Math.min((now - this.since) / 1000, 0.25) : 0, last = this.frameCount - 1;
    this.since = now;
    this.at += passed * PACE * this.speed;
    this.isDirty = true;
    if (this.at < last) return;
    this.at = Math.max(last, 0);
    if (this.live) this.following = true;
    else if (this.loop && last > 0) this.at = 0;
    else this.pause();
  }

  draw(now = performance.now()) {
    if (!this.tracks.length) return;
    // Between frames bodies are drawn on the way, unless frames follow each other faster than pictures anyway.
    const isSmooth = this.playing && !this.following && this.every === 1 && PACE * this.speed < 60 && !still()
      && this.tracks.every(({ scene }) => scene.every <= SMOOTH_EVERY);
    this.tracks.forEach((track, t) => this.drawTrack(track, t, isSmooth ? this.shareOf(t) : 0));
    this.drawings += 1;
    if (this.isGrown) {
      this.fitDomain();
      for (const chart of this.charts) chart.extend();
    }
    this.isGrown = false;
    for (const chart of this.charts) chart.moveCursor();
    this.showClock();
    this.inspectSoon(now);
    if (now - this.lastSaid > 10000) this.say();
  }

  // How much of the way from the frame of a track to its next one has passed.
  shareOf(t) {
    const { times, position } = this, { frames } = this.tracks[t], index = this.indexOf(t);
    const before = times[position], after = times[position + 1] ?? before, time = before + (this.at - position) * (after - before);
    const [from, until] = [frames[index], frames[index + 1]];
    return from && until ? (time - from.time) / (until.time - from.time) : 0;
  }

  drawTrack(track, t, share) {
    const { frames, arena } = track;
    const index = this.indexOf(t), isOn = (name) => name in this.toggles && this.toggles[name].on;
    const slotOf = ({ track: one, slot }) => (one === t ? slot : null);
    const selected = slotOf(this.selected);
    const { slot: chosen, track: home } = this.selected;
    const isTwin = chosen !== null && home !== t && chosen < track.scene.slots.length;
    arena.draw(frames[index] || null, frames[index + 1], share, {
      ranges: isOn("ranges"), awareness: isOn("awareness"), trails: isOn("trails"),
      links: track.scene.links.map(({ name }) => isOn(`links ${name}`)), selected, hovered: slotOf(this.hovered),
      marked: isTwin ? chosen : null, before: (k) => frames[index - k] || null,
    });
    this.showScale(track);
    this.showObserved(track, frames[index]);
    this.showOmitted(track, frames[index]);
  }

  // Of two worlds, each has its number beside its name.
  showObserved({ scene, observed }, frame) {
    const s = scene.series.indexOf("observed");
    observed.hidden = s < 0 || !frame || this.tracks.length < 2;
    if (!observed.hidden) setText(observed, `${shownValue("observed", frame.value(s))} observed`);
  }

  // Links that a frame does not hold, so that nobody takes it for a frame without links.
  showOmitted({ scene, omitted }, frame) {
    const lists = frame ? frame.links.flatMap((list, l) => (list.omitted ? [[scene.links[l].name, list.omitted]] : [])) : [];
    omitted.hidden = !lists.length;
    setText(omitted, lists.map(([name, count]) => `${capital(name)}: ${tooMany(count)}`).join(". "));
  }

  // A bar of a round length.
  showScale({ arena, scale }) {
    const perPixel = arena.at.scale / arena.ratio, key = perPixel.toFixed(4);
    if (scale.dataset.key === key) return;
    const long = roundUp(36 / perPixel);
    scale.dataset.key = key;
    scale.style.width = `${long * perPixel}px`;
    setText(scale.firstChild, `${Number(long.toPrecision(2))}`);
  }

  showClock() {
    const { times } = this, first = times[0] ?? 0, last = times[times.length - 1] ?? 0;
    if (Number(this.scrub.min) !== first) this.scrub.min = first;
    if (Number(this.scrub.max) !== last) this.scrub.max = last;
    this.scrub.value = this.shownTime;
    const text = `${this.timeWord} ${this.timeText(this.shownTime)}`;
    this.scrub.setAttribute("aria-valuetext", text);
    setText(this.clockText, text);
  }

  // At once while nothing moves; else a few times a second, and a last time after the last frame.
  inspectSoon(now) {
    const isMoving = this.playing || this.following, wait = this.lastInspected + 120 - now;
    if (!isMoving || wait <= 0) this.inspectNow(now);
    else if (!this.inspectLater) this.inspectLater = setTimeout(() => this.inspectNow(performance.now()), wait);
  }

  inspectNow(now) {
    clearTimeout(this.inspectLater);
    this.inspectLater = 0;
    this.lastInspected = now;
    const { track, slot } = this.selected.slot === null ? this.hovered : this.selected;
    this.inspector.update(track, slot);
  }

  // The text alternative of the canvas. While it plays, it changes rarely.
  say(isAsked = false) {
    if (!this.tracks.length || (this.playing && isAsked)) return;
    this.lastSaid = performance.now();
    const parts = this.tracks.map(({ scene }, t) => {
      const frame = this.frameOf(t);
      if (!frame) return "no frame yet";
      const series = scene.series.map((name, s) => `${nameOf(name).toLowerCase()} ${shownValue(name, frame.value(s))}`);
      return `${this.tracks.length > 1 ? `${scene.title}: ` : ""}${series.join(", ")}`;
    });
    setText(this.status, `${capital(this.timeWord)} ${this.timeText(this.shownTime)}. ${parts.join(". ")}.`);
  }

  resize() {
    for (const { arena } of this.tracks) arena.resize();
    this.invalidate();
  }

  // Listening.

  listen() {
    this.observer = new ResizeObserver(() => {
      this.resize();
      for (const chart of this.charts) chart.resize();
    });
    this.observer.observe(this.chartRow);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.recolour());
    document.addEventListener("keydown", (event) => this.onKey(event));
    document.addEventListener("visibilitychange", () => this.resume());
    outer.view = this;
    if (outer.scheme) this.onOuter();
    // One of many recordings in a page plays only while it can be seen.
    new IntersectionObserver((changes) => {
      this.isSeen = changes[changes.length - 1].isIntersecting;
      this.resume();
    }).observe(this.root);
  }

  onOuter() {
    this.recolour();
    if (document.documentElement.classList.contains("ts-framed")) return;
    document.documentElement.classList.add("ts-framed");
    new ResizeObserver(() => this.sayHeight()).observe(this.root);
  }

  // It grows only, until the width is another: what follows the frame should not move whenever somebody points at a body.
  sayHeight() {
    const tallest = this.said && this.said.width === innerWidth ? this.said.height : 0;
    const height = Math.max(Math.ceil(this.root.getBoundingClientRect().height), tallest);
    if (height > tallest) {
      this.said = { width: innerWidth, height };
      window.parent.postMessage({ teamsight: { height } }, "*");
    }
  }

  resume() {
    this.since = 0;
    this.invalidate();
  }

  recolour() {
    showScheme();
    this.palette = dark() ? DARK : LIGHT;
    for (const { arena } of this.tracks) arena.recolour(this.palette);
    for (const chart of this.charts) chart.redraw();
    this.inspector.shown = "";
    this.invalidate();
  }

  onKey(event) {
    const { target, key } = event;
    if (event.ctrlKey || event.metaKey || event.altKey || this.dialog.open) return;
    const isField = target.closest("input:not([type=range]), select, textarea, [contenteditable]");
    const isSlider = target.closest("input[type=range]");
    const isOfSlider = isSlider && /^(Arrow|Home|End|Page)/.test(key);
    const isOfButton = key === " " && target.closest("button, a, summary");
    if (isField || isOfSlider || isOfButton || !this.tracks.length) return;
    const name = event.shiftKey && key.startsWith("Arrow") ? `Shift ${key}` : key;
    if (!Object.hasOwn(ACTS, name)) return;
    event.preventDefault();
    ACTS[name](this);
  }

  // Keys move the slider to ticks of which there are frames.
  onSliderKey(event) {
    if (!Object.hasOwn(SLIDER_KEYS, event.key) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    this.look(this.position + SLIDER_KEYS[event.key]);
  }

  selectNext(by) {
    const { track } = this.selected, frame = this.tracks[track] && this.frameOf(track);
    if (!frame) return;
    const n = frame.n;
    let slot = this.selected.slot === null ? (by > 0 ? -1 : n) : this.selected.slot;
    for (let k = 0; k < n; k++) {
      slot = (slot + by + n) % n;
      if (has(frame, slot, PRESENT)) break;
    }
    this.select(track, slot);
    this.sayBody(track, slot);
  }

  // What a body senses, for who cannot see the picture.
  sayBody(track, slot) {
    const { scene } = this.tracks[track], found = this.inspect(track, slot);
    const count = ({ name, sensed: list, omitted }) => `${omitted ? "an unknown number of" : list.length} ${name}`;
    const counts = found ? found.channels.map(count) : ["nothing"];
    setText(this.status, `${bodyName(scene, slot)}. Senses ${counts.join(", ")}.`);
  }

  help() { if (!this.dialog.open) this.dialog.showModal(); }

  fit() {
    Object.assign(this.camera, { zoom: 1, x: 0.5, y: 0.5 });
    this.moved();
  }

  // Zooms by a factor, so that the point (fx, fy) of the arena, in shares of its box, stays where it is.
  zoom(factor, fx = this.camera.x, fy = this.camera.y) {
    const { camera } = this, zoom = Math.min(Math.max(camera.zoom * factor, LEAST_ZOOM), MOST_ZOOM);
    const kept = camera.zoom / zoom;
    Object.assign(camera, { zoom, x: fx + (camera.x - fx) * kept, y: fy + (camera.y - fy) * kept });
    this.moved();
  }

  // Moves by shares of what is seen.
  pan(x, y) {
    this.camera.x += x / this.camera.zoom;
    this.camera.y += y / this.camera.zoom;
    this.moved();
  }

  get isZoomed() { return Math.abs(this.camera.zoom - 1) > 1e-6; }

  moved() {
    const { camera } = this;
    camera.x = Math.min(Math.max(camera.x, 0), 1);
    camera.y = Math.min(Math.max(camera.y, 0), 1);
    this.root.classList.toggle("ts-zoomed", this.isZoomed);
    this.invalidate();
  }

  listenToCanvas(t, canvas) {
    const fingers = new Map(), { arena } = this.tracks[t];
    let moved = 0;
    const pixel = (event) => {
      const box = canvas.getBoundingClientRect();
      return [(event.clientX - box.left) * arena.ratio, (event.clientY - box.top) * arena.ratio];
    };
    const share = ([px, py]) => {
      const { layout } = arena, [x, y] = arena.toArena(px, py);
      return [(x - layout.x0) / layout.width, (y - layout.y0) / layout.height];
    };
    const find = (event) => arena.nearest(...pixel(event), (event.pointerType === "touch" ? 26 : 14) * arena.ratio);
    canvas.addEventListener("wheel", (event) => {
      // In a frame of another page, the wheel scrolls that page until the arena is clicked.
      if (window !== window.parent && document.activeElement !== canvas && !event.ctrlKey) return;
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY * (event.deltaMode === 1 ? 0.05 : 0.0015)), ...share(pixel(event)));
    }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      fingers.set(event.pointerId, pixel(event));
      if (fingers.size === 1) moved = 0;
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!fingers.has(event.pointerId)) return this.hover(t, find(event), event);
      const before = [...fingers.values()], was = fingers.get(event.pointerId), now = pixel(event);
      fingers.set(event.pointerId, now);
      moved += Math.hypot(now[0] - was[0], now[1] - was[1]);
      // While all is seen, one finger scrolls the page.
      const isScroll = event.pointerType === "touch" && fingers.size === 1 && !this.isZoomed;
      if (moved < 5 * arena.ratio || isScroll) return;
      this.drag(before, [...fingers.values()], share);
    });
    const release = (event) => {
      if (!fingers.delete(event.pointerId) || event.type !== "pointerup" || moved >= 5 * arena.ratio) return;
      this.select(t, find(event));
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("pointerleave", () => this.hover(t, null));
  }

  // One finger pans, two zoom.
  drag(before, now, share) {
    const mean = (points, axis) => points.reduce((sum, point) => sum + point[axis], 0) / points.length;
    const middle = (points) => [mean(points, 0), mean(points, 1)];
    const apart = ([one, other]) => Math.hypot(one[0] - other[0], one[1] - other[1]);
    const [from, to] = [share(middle(before)), share(middle(now))];
    this.camera.x += from[0] - to[0];
    this.camera.y += from[1] - to[1];
    if (now.length === 2 && apart(before) > 0) this.zoom(apart(now) / apart(before), ...share(middle(now)));
    else this.moved();
  }

  hover(t, slot, event) {
    const { hovered, tip } = this;
    if (slot === null) tip.hidden = true;
    else {
      const { scene } = this.tracks[t];
      const states = stateOf(scene, this.frameOf(t), slot).filter((one) => one !== "active");
      setText(tip, [bodyName(scene, slot), ...states].join(", "));
      tip.hidden = false;
      const left = Math.min(event.clientX + 14, innerWidth - tip.offsetWidth - 8);
      tip.style.transform = `translate(${left}px, ${event.clientY + 16}px)`;
    }
    if (hovered.track === t && hovered.slot === slot) return;
    this.hovered = { track: t, slot };
    this.lastInspected = 0;
    this.invalidate();
  }

  // Saving.

  // The tracks as they are drawn, with a caption, as a PNG.
  picture() {
    const { tracks, palette } = this, ratio = tracks[0].arena.ratio, line = 26 * ratio;
    const canvas = document.createElement("canvas"), gap = 8 * ratio;
    canvas.width = tracks.reduce((sum, track) => sum + track.canvas.width + gap, -gap);
    canvas.height = Math.max(...tracks.map((track) => track.canvas.height)) + line;
    const to = canvas.getContext("2d");
    to.fillStyle = palette.page;
    to.fillRect(0, 0, canvas.width, canvas.height);
    to.font = `${13 * ratio}px system-ui, sans-serif`;
    to.textBaseline = "middle";
    let left = 0;
    tracks.forEach(({ canvas: one, scene }, t) => {
      to.drawImage(one, left, line);
      const frame = this.frameOf(t), s = scene.series.indexOf("observed");
      const observed = frame && s >= 0 ? `, observed ${shownValue("observed", frame.value(s))}` : "";
      to.fillStyle = palette.text;
      const text = `${scene.title}, ${this.timeWord} ${this.timeText(this.shownTime)}${observed}`;
      to.fillText(text, left + 10 * ratio, line / 2, one.width - 20 * ratio);
      left += one.width + gap;
    });
    return new Promise((done) => canvas.toBlob(done, "image/png"));
  }

  async savePicture() {
    this.draw();
    const words = this.tracks[0].scene.title.toLowerCase().match(/[\w.=]+/g) || ["teamsight"];
    this.download(await this.picture(), `${words.join("-")}-${Math.round(this.shownTime)}.png`);
  }

  download(blob, name) {
    const address = URL.createObjectURL(blob), link = make("a", { href: address, download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(address), 10000);
  }
}

// Part: start.

// The time of a tick of a record, in pieces that begin at some ticks and times.
function recordedTime({ step, ticks, times }, tick) {
  const piece = Math.max(lastAt(ticks, tick), 0), digits = Math.max(Math.ceil(-Math.log10(step) - 1e-6), 0);
  return (times[piece] + step * (tick - ticks[piece])).toFixed(Math.min(digits, 9));
}

// A replay in the page: element #replay holds the scenes and the packed frames.
async function start(root, data) {
  root.dataset.state = "loading";
  try {
    const { tracks } = JSON.parse(data.textContent);
    const frames = await Promise.all(tracks.map(({ scene, frames: packed }) => decodeReplay(packed, scene)));
    const view = new View(root);
    window.teamsight.view = view;
    tracks.forEach(({ scene }, t) => {
      view.setScene(t, scene);
      view.tracks[t].frames = frames[t];
    });
    view.refreshTimes();
    view.fitDomain();
    for (const chart of view.charts) chart.resize();
    view.show(0);
    view.say();
    root.dataset.state = "ready";
    if (!still() && view.frameCount > 1) view.play(); else view.showState();
    return view;
  } catch (error) {
    root.dataset.state = "error";
    const text = `The recording cannot be shown: ${error.message}.`;
    root.replaceChildren(make("p", { class: "ts-error", role: "alert" }, text));
    return null;
  }
}

const root = document.getElementById("teamsight"), data = document.getElementById("replay");
const shared = { View, decodeReplay, decodeFrame, percept, raysOf, Layout, view: null, ready: null };
// After this script, so that window.teamsight is there.
if (root && data) shared.ready = Promise.resolve().then(() => start(root, data));
return shared;

})();
