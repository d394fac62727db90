// Recorded robots: a file of positions is dropped, the server reads it, and this page plays it beside its δ.
//
//   wire    the socket: the file in parts, what is chosen, and the answers
//   drop    a file that is dropped or chosen, on this page or on that of a world
//   curve   how often each δ is exceeded
//   panel   δ, its cautions and its curve; also in a recording that was saved
//   page    the controls, the answer and the view of view.js
"use strict";

(() => {

const { View, decodeReplay } = window.teamsight;
// The server takes no longer messages.
const PART = 4096;
const FIRST_WAIT = 250, LONGEST_WAIT = 5000, PAUSE_BETWEEN = 120, PATIENCE = 300;
const SVG = "http://www.w3.org/2000/svg", DRAWN = new Set(["svg", "path", "line", "rect", "circle", "text", "g"]);

function make(tag, attributes = {}, ...children) {
  const element = DRAWN.has(tag) ? document.createElementNS(SVG, tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (typeof value === "boolean") element[name] = value;
    else if (value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children.filter((one) => one !== null));
  return element;
}

const still = () => matchMedia("(prefers-reduced-motion: reduce)").matches;
const short = (value) => Number(value.toPrecision(3)).toString();
const percent = (share) => (share > 0 && share < 0.0005 ? `${(100 * share).toExponential(0)} %` : `${Number((100 * share).toPrecision(2))} %`);

// Part: wire.

class Wire {
  // `page` has on_… for each kind of answer, and connected(isOpen).
  constructor(page, keeps = true) {
    Object.assign(this, { page, keeps, wait: FIRST_WAIT, file: null, sent: null });
    this.connect();
  }

  connect() {
    const address = new URL("recorded-socket", location.href);
    address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    Object.assign(address, { search: location.search, hash: "" });
    this.socket = new WebSocket(address);
    this.socket.onopen = () => {
      this.wait = FIRST_WAIT;
      this.page.connected(true, this);
    };
    this.socket.onmessage = ({ data }) => {
      const message = JSON.parse(data);
      if (message.type === "send") this.sendParts();
      else this.page[`on_${message.type}`]?.(message);
    };
    this.socket.onclose = () => this.lost();
  }

  // Not when the page itself has closed it.
  get isLost() { return !this.isClosed; }

  lost() {
    this.page.connected(false, this);
    if (!this.keeps) return;
    setTimeout(() => this.connect(), this.wait);
    this.wait = Math.min(this.wait * 1.6, LONGEST_WAIT);
  }

  send(type, fields = {}) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify({ type, ...fields }));
    return true;
  }

  sendFile(file) {
    this.file = file;
    return this.send("file", { name: file.name, size: file.size });
  }

  async sendParts() {
    // Who drops a second file before the first is wanted sends the second, once.
    if (this.sent === this.file) return;
    this.sent = this.file;
    try {
      const content = await this.file.arrayBuffer();
      for (let at = 0; at < content.byteLength; at += PART) this.socket.send(content.slice(at, at + PART));
    } catch {
      this.page.on_error({ message: `${this.file.name}: cannot be read by the browser; drop a file, not a folder.` });
    }
  }

  close() {
    this.keeps = false;
    this.isClosed = true;
    this.socket.close();
  }
}

// Part: drop.

// Calls `take(file)` with a file that is dropped anywhere on the page or chosen by the button that is returned.
function takesFiles(take, fail, label) {
  const one = (files) => {
    if (files.length === 1) take(files[0]);
    else fail(files.length ? `${files.length} files were dropped; drop one CSV with all robots.` : "That is no file; drop a CSV.");
  };
  const veil = make("div", { class: "tr-veil", hidden: true, "aria-hidden": "true" }, make("p", {}, "Drop a CSV of recorded robots: time, robot, x, y"));
  document.body.append(veil);
  const isFile = (event) => [...(event.dataTransfer?.types ?? [])].includes("Files");
  const show = (isShown) => { veil.hidden = !isShown; };
  addEventListener("dragenter", (event) => { if (isFile(event)) show(true); });
  addEventListener("dragover", (event) => { if (isFile(event)) event.preventDefault(); });
  addEventListener("dragleave", (event) => { if (event.relatedTarget === null) show(false); });
  addEventListener("drop", (event) => {
    show(false);
    if (!isFile(event)) return;
    event.preventDefault();
    one(event.dataTransfer.files);
  });
  const input = make("input", { type: "file", accept: ".csv", hidden: true, "aria-label": label });
  input.addEventListener("change", () => {
    if (input.files.length) one(input.files);
    // The same file may be chosen again after it was corrected.
    input.value = "";
  });
  const title = "Open a CSV of positions with the columns time, robot, x, y; or drop it on the page";
  return make("div", { class: "tl-row" }, input,
    make("button", { type: "button", class: "ts-button tl-button", title, onclick: () => input.click() }, label));
}

// On the page of a world: the file is sent, and opened on a page of its own if it can be read.
class Door {
  constructor(live) {
    Object.assign(this, { live, wire: null, file: null });
    live.controls.element.append(takesFiles((file) => this.take(file), (text) => live.fail(text), "Open recorded robots …"));
  }

  take(file) {
    this.wire?.close();
    this.file = file;
    this.live.fail("");
    this.wire = new Wire(this, false);
  }

  connected(isOpen, wire) {
    if (wire !== this.wire) return;
    if (isOpen) wire.sendFile(this.file);
    else if (wire.isLost) this.live.fail(`${this.file.name}: the connection ended before the file was read; drop it again.`);
  }

  on_error({ message }) {
    this.live.fail(message);
    this.wire.close();
  }

  on_kept({ key }) {
    this.wire.close();
    location.assign(`recorded${location.search}#${key}`);
  }
}

// Part: curve.

const WIDE = 300, HIGH = 196, LEFT = 40, BASE = 160, TOP = 12, RIGHT = 8, LABELS = 12;

// The shares of trials in which any robot has more than δ neighbours, with bounds, on a logarithmic scale.
function drawCurve({ curve, delta, choice, trials, trial, largest }) {
  const least = curve.reduce((low, { probability }) => (probability > 0 ? Math.min(low, probability) : low), 1);
  const floor = 10 ** Math.floor(Math.log10(Math.min(choice.risk, least, 1 / trials)) - 0.2);
  const y = (share) => BASE - ((BASE - TOP) * (Math.log10(Math.max(share, floor)) - Math.log10(floor))) / -Math.log10(floor);
  const step = (WIDE - LEFT - RIGHT) / curve.length, x = (k) => LEFT + (k + 0.5) * step;
  const text = (px, py, words, anchor = "middle", kind = "") => make("text", { x: px, y: py, "text-anchor": anchor, class: kind }, words);
  const line = (x1, y1, x2, y2, kind) => make("line", { x1, y1, x2, y2, class: kind });
  const parts = [];
  for (let share = 1; share > floor * 0.99; share /= 10) {
    parts.push(line(LEFT, y(share), WIDE - RIGHT, y(share), "tr-grid"), text(LEFT - 4, y(share) + 3.5, percent(share), "end"));
  }
  const every = Math.ceil(curve.length / LABELS);
  curve.forEach(({ delta: at, low, high, time }, k) => {
    if (time > 0) parts.push(make("rect", { x: x(k) - step * 0.36, y: y(time), width: step * 0.72, height: BASE - y(time), class: "tr-time" }));
    parts.push(line(x(k), y(low), x(k), y(high), "tr-bounds"));
    if (k % every === 0) parts.push(text(x(k), BASE + 13, String(at)));
  });
  const seen = curve.map(({ probability }, k) => [x(k), y(probability), probability]).filter(([, , share]) => share > 0);
  parts.push(make("path", { d: seen.map(([px, py], k) => `${k ? "L" : "M"}${px} ${py}`).join(""), class: "tr-line" }));
  curve.forEach(({ probability }, k) => parts.push(make("circle", { cx: x(k), cy: y(probability), r: 3, class: probability > 0 ? "tr-point" : "tr-none" })));
  parts.push(line(LEFT, y(choice.risk), WIDE - RIGHT, y(choice.risk), "tr-risk"), text(WIDE - RIGHT, y(choice.risk) - 3, `risk ${percent(choice.risk)}`, "end", "tr-over"));
  const place = curve.findIndex(({ delta: at }) => at === delta);
  if (place >= 0) parts.push(line(x(place), TOP, x(place), BASE, "tr-delta"), text(x(place), TOP - 3, `δ = ${delta}`, "middle", "tr-strong"));
  parts.push(line(LEFT, BASE, WIDE - RIGHT, BASE, "tr-axis"), text((LEFT + WIDE) / 2, BASE + 28, "δ (number of neighbours)"));
  const label = `How often δ is exceeded, of ${trials} ${trial}s. The largest number of neighbours is ${largest}. The table below has the values.`;
  return make("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, class: "tr-curve", role: "img", "aria-label": label }, ...parts);
}

function curveTable({ curve, trial, confidence }) {
  const head = ["δ", `${trial}s with more`, `bounds, ${Math.round(100 * confidence)} %`, "of the time"];
  const rows = curve.map(({ delta, probability, low, high, time }) => [delta, percent(probability), `${percent(low)} to ${percent(high)}`, percent(time)]);
  return make("table", { class: "tr-table" },
    make("thead", {}, make("tr", {}, ...head.map((name) => make("th", { scope: "col" }, name)))),
    make("tbody", {}, ...rows.map((row) => make("tr", {}, ...row.map((cell) => make("td", {}, String(cell)))))));
}

// Part: panel.

const factRows = (facts) => facts.map(([term, text]) => make("div", {}, make("dt", {}, term), make("dd", {}, text)));

// δ, its cautions and its curve, before the inspector.
class Panel {
  constructor(view) {
    Object.assign(this, { view, element: view.slot("graph"), answer: make("div", { "aria-live": "polite" }), rest: make("div", {}) });
    view.root.classList.add("tr");
    this.element.classList.add("tr-panel");
    this.element.setAttribute("aria-label", "δ");
    view.inspector.element.before(this.element);
    // Beside the arena, the inspector may be below what the column shows.
    view.onselect = ({ slot }) => {
      if (slot !== null && matchMedia("(min-width: 861px)").matches) view.inspector.element.scrollIntoView({ block: "nearest" });
    };
  }

  show(message) {
    const { answer, cautions, notes, delta, seen, largest, trial, length } = message;
    const meaning = delta === null ? seen : `It is exceeded in a ${trial} if any robot has more than ${delta} neighbours at any time of these ${short(length)}.`;
    this.answer.replaceChildren(
      make("p", { class: "tr-delta-text" }, delta === null ? `${largest} seen, δ = ?` : `δ = ${delta}`),
      make("p", {}, answer), make("p", { class: "ts-soft" }, meaning),
      make("ul", { class: "tr-cautions", "aria-label": "Cautions" }, ...cautions.map((text) => make("li", {}, text))));
    const open = this.rest.querySelector("details[open]") !== null;
    const key = (kind) => make("span", { class: kind, "aria-hidden": "true" });
    this.rest.replaceChildren(drawCurve(message),
      make("p", { class: "tr-legend" }, key("tr-key-point"), ` share of ${trial}s in which any robot has more than δ neighbours, and its bounds; `, key("tr-key-time"), " share of the time"),
      make("details", { open }, make("summary", {}, "Table and notes"), curveTable(message), make("ul", { class: "tr-notes" }, ...notes.map((text) => make("li", {}, text)))));
    if (!this.answer.isConnected) this.element.replaceChildren(this.answer, this.rest);
  }

  // What recorded robots sense of targets is not known, so there is nothing to show of it.
  sayRanges() {
    const { ranges } = this.view.toggles;
    if (ranges) ranges.button.hidden = true;
  }
}

// A recording that was saved with its answer.
async function showSaved(data) {
  const view = await window.teamsight.ready;
  if (!view) return;
  const message = JSON.parse(data.textContent), { choice } = message, panel = new Panel(view);
  const chosen = [["Awareness range", `${short(choice.awareness_range)}, ${choice.range_shape}`], ["Risk", percent(choice.risk)]];
  panel.sayRanges();
  panel.show(message);
  view.slot("controls").append(make("h2", {}, "What the file holds"), make("dl", { class: "tr-facts" }, ...factRows([...message.facts, ...chosen])));
}

// Part: page.

const FREE = { range: [0.02, 5], risk: [0.0001, 0.5] };

const isNumber = ({ value }) => value !== "" && Number(value) > 0;

class Recorded {
  constructor(root) {
    const view = new View(root, { title: document.title });
    Object.assign(this, { view, root, key: location.hash.slice(1), choice: null, isNew: true, isWaiting: false, isChosen: false, timer: 0, soon: 0, taken: null });
    this.banner = make("div", { class: "tl-banner", role: "status", hidden: true }, "Reconnecting …");
    root.prepend(this.banner);
    this.working = make("p", { class: "tr-working", role: "status", hidden: true });
    this.invitation = make("div", { class: "tr-invitation" });
    view.stage.append(this.working, this.invitation);
    root.classList.add("tr-empty");
    this.buildControls(view.slot("controls"));
    this.panel = new Panel(view);
    view.scrub.setAttribute("aria-label", "Time");
    addEventListener("hashchange", () => this.open(location.hash.slice(1)));
    this.wire = new Wire(this);
  }

  buildControls(element) {
    element.setAttribute("aria-label", "Controls");
    this.alertText = make("span", {});
    this.alert = make("div", { class: "tl-alert", role: "alert", hidden: true }, this.alertText,
      make("button", { type: "button", class: "ts-button", "aria-label": "Dismiss", onclick: () => { this.alert.hidden = true; } }, "×"));
    const files = takesFiles((file) => this.take(file), (text) => this.fail(text), "Open CSV …");
    this.save = make("button", { type: "button", class: "ts-button tl-button", title: "Save the recording as a page that plays anywhere", onclick: () => this.ask("save", "Packing …") }, "Save HTML");
    files.append(this.save);
    this.range = this.number("Awareness range", "Distance within which two robots are neighbours, in the unit of the positions", FREE.range);
    this.risk = this.number("Risk", "The largest accepted probability that any robot has more than δ neighbours during a trial; 0.01 is 1 %", FREE.risk);
    this.window = make("input", { type: "number", id: "tr-window", step: "any", min: 0, placeholder: "auto" });
    this.shape = make("select", { id: "tr-shape" }, ...["disc", "square"].map((name) => make("option", { value: name }, name)));
    this.run = make("select", { id: "tr-run" });
    for (const one of [this.window, this.shape, this.run]) one.addEventListener("change", () => this.change());
    const field = (name, input, title) => make("div", { class: "tl-field", title }, make("label", { for: input.id }, name), input);
    this.runField = field("Run", this.run, "Which run is played; δ is that of all");
    this.fields = make("fieldset", {}, make("legend", {}, "Neighbours"), this.range.field, field("Shape of the range", this.shape), this.risk.field,
      field("Window", this.window, "Duration for which the risk is stated, in the unit of time; empty for a choice by the record"), this.runField);
    this.facts = make("dl", { class: "tr-facts" });
    this.understood = make("fieldset", {}, make("legend", {}, "What the file holds"), this.facts);
    element.append(...[this.alert, files, this.fields, this.understood, this.wayBack()].filter(Boolean));
    for (const one of [this.fields, this.understood, this.save]) one.hidden = true;
  }

  // To the page of the world that this server shows too.
  wayBack() {
    if (!location.pathname.endsWith("/recorded")) return null;
    return make("p", { class: "tr-back" }, make("a", { href: `./${location.search}` }, "Back to the world"));
  }

  // A number, and a logarithmic slider between `least` and `most`.
  number(name, title, [least, most]) {
    const id = `tr-${name.toLowerCase().replace(" ", "-")}`, input = make("input", { type: "number", id, step: "any", min: 0 });
    const slider = make("input", { type: "range", min: 0, max: 200, "aria-label": `${name}, slider` });
    const one = { name, input, slider, least, most };
    slider.addEventListener("input", () => {
      input.value = String(Number((one.least * (one.most / one.least) ** (slider.value / 200)).toPrecision(2)));
      slider.setAttribute("aria-valuetext", input.value);
      this.change();
    });
    input.addEventListener("input", () => { this.slide(one); this.change(); });
    // Half a number is no error until somebody leaves it so.
    input.addEventListener("change", () => {
      if (isNumber(input) || !this.choice) return;
      this.fail(`${name}: must be a number above 0, as in ${least}; it stays ${one.held}.`);
      this.showChoice();
    });
    one.field = make("div", { class: "tl-field", title }, make("label", { for: id }, name), slider, input);
    return one;
  }

  slide({ input, slider, least, most }) {
    slider.value = (200 * Math.log(Number(input.value) / least)) / Math.log(most / least);
    slider.setAttribute("aria-valuetext", input.value);
  }

  // What is set goes to the server when that has answered, the newest only.
  change() {
    this.isChosen = true;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.choose(), PAUSE_BETWEEN);
  }

  choose() {
    if (!this.isChosen || this.isWaiting || !this.choice) return;
    if (![this.range, this.risk].every(({ input }) => isNumber(input))) return;
    this.isChosen = false;
    const window = this.window.value === "" ? null : Number(this.window.value);
    const fields = { awareness_range: Number(this.range.input.value), risk: Number(this.risk.input.value), window, range_shape: this.shape.value, run: Number(this.run.value) };
    this.ask("choose", "Counting neighbours …", fields);
  }

  ask(type, text, fields = {}) {
    if (!this.wire.send(type, fields)) return;
    if (type !== "open") this.alert.hidden = true;
    this.wait(text);
  }

  take(file) {
    this.alert.hidden = true;
    this.wait(`Reading ${file.name} …`);
    this.taken = file.name;
    if (!this.wire.sendFile(file)) this.on_error({ message: "The server does not answer; drop the file again when it does." });
  }

  open(key) {
    this.key = key;
    this.ask("open", "Reading …", { key });
  }

  // What takes a moment only says nothing.
  wait(text) {
    this.isWaiting = true;
    this.working.textContent = text;
    clearTimeout(this.soon);
    this.soon = setTimeout(() => { this.working.hidden = false; }, PATIENCE);
  }

  rested() {
    this.isWaiting = false;
    clearTimeout(this.soon);
    this.working.hidden = true;
    this.choose();
  }

  connected(isOpen) {
    this.banner.hidden = isOpen;
    this.view.slot("controls").inert = !isOpen;
    document.documentElement.dataset.connected = String(isOpen);
    if (isOpen) this.open(this.key);
    else this.rested();
    // Opened again, the page shows the file of before.
    if (!isOpen && this.taken) this.fail(`${this.taken}: the connection ended before the file was read; drop it again.`);
    if (!isOpen) this.taken = null;
  }

  fail(text) {
    this.alertText.textContent = text;
    this.alert.hidden = false;
    this.alert.scrollIntoView({ block: "nearest" });
  }

  on_error({ message }) {
    this.taken = null;
    this.fail(message);
    // What was refused gives way to what holds.
    if (this.choice && !this.isChosen) this.showChoice();
    if (!this.choice) this.invite();
    this.rested();
  }

  on_empty() {
    this.invite();
    this.rested();
  }

  invite() {
    if (this.choice || this.invitation.childElementCount) return;
    this.invitation.append(
      make("h2", {}, "Your robots, your δ"),
      make("p", {}, "Drop a CSV of recorded positions on this page, or open one. It has a header and the columns time, robot, x, y; and run, if it holds several recordings."),
      make("pre", { class: "tr-example" }, "time,robot,x,y\n0.0,a,1.20,0.35\n0.0,b,2.01,1.10\n0.1,a,1.22,0.36"),
      make("p", {}, "The page plays it, and says how many neighbours a robot has at most, for the risk that you accept. The file goes to the server that you have started, and no further."));
  }

  on_kept({ key }) {
    this.taken = null;
    this.key = key;
    history.replaceState(null, "", `#${key}`);
  }

  on_record({ name, facts, runs }) {
    document.title = `${name} · teamsight`;
    this.view.title = name;
    this.facts.replaceChildren(...factRows(facts));
    this.run.replaceChildren(...runs.map((text, k) => make("option", { value: k }, text)));
    this.runField.hidden = runs.length < 2;
    for (const one of [this.fields, this.understood, this.save]) one.hidden = false;
    this.invitation.remove();
    this.root.classList.remove("tr-empty");
    // Until the first frames of this one.
    Object.assign(this, { choice: null, isNew: true, isChosen: false });
  }

  on_answer(message) {
    const isNew = !this.choice;
    this.choice = message.choice;
    if (isNew) [this.range.least, this.range.most] = FREE.range.map((factor) => factor * message.choice.awareness_range);
    if (!this.isChosen) this.showChoice();
    this.panel.show(message);
    this.rested();
  }

  showChoice() {
    const { awareness_range: range, risk, window, range_shape: shape, run } = this.choice;
    this.range.input.value = String(range);
    this.risk.input.value = String(risk);
    Object.assign(this.range, { held: range });
    Object.assign(this.risk, { held: risk });
    this.slide(this.range);
    this.slide(this.risk);
    this.window.value = window === null ? "" : String(window);
    this.shape.value = shape;
    this.run.value = String(run);
  }

  async on_track({ scene, frames: packed }) {
    const { view } = this, at = view.position, tick = view.shownTime;
    let frames;
    try {
      frames = await decodeReplay(packed, scene);
    } catch (error) {
      this.fail(`The page cannot read what the server sends: ${error.message}`);
      return;
    }
    const isSame = !this.isNew && view.tracks[0]?.scene.title === scene.title;
    this.isNew = false;
    if (!isSame) view.select(0, null);
    view.setScene(0, scene);
    this.panel.sayRanges();
    view.tracks[0].frames = frames;
    view.refreshTimes();
    view.fitDomain();
    for (const chart of view.charts) chart.resize();
    view.show(isSame && view.times[at] === tick ? at : 0);
    if (!isSame && !still() && view.frameCount > 1) view.play(); else view.showState();
    view.say();
    this.root.dataset.state = "ready";
  }

  on_recording({ name, html }) {
    this.view.download(new Blob([html], { type: "text/html" }), name);
    this.rested();
  }
}

const { live } = window.teamsight, saved = document.getElementById("panel");
if (saved) showSaved(saved);
else if (live) live.door = new Door(live);
else {
  window.teamsight.recorded = new Recorded(document.getElementById("teamsight"));
  window.teamsight.view = window.teamsight.recorded.view;
}

})();
