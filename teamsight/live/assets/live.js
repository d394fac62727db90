// The live page: a socket to the server, and panels beside the view of view.js. Plain JavaScript without a build step.
//
//   link        the socket: frames, messages, acknowledgements, reconnecting
//   controls    run, step, reset, rate, and what the server lets a page set
//   film        which ticks it shows, how far it is, and that nobody wants it any more
//   log         the newest rows of the event log
//   graph       the neighbour graph of the frame that is shown
//   laboratory  what somebody does to bodies and obstacles, and copies of that as text
"use strict";

(() => {

const { View, decodeFrame } = window.teamsight;
const FRAME = 1, HISTORY = 2, HEAD = 8;
const FIRST_WAIT = 250, LONGEST_WAIT = 5000;

function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (typeof value === "boolean") element[name] = value;
    else if (value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

const percent = (value) => (value === null || !Number.isFinite(value) ? "–" : `${(100 * value).toFixed(1)} %`);

// Part: link.

class Link {
  constructor(page) {
    Object.assign(this, { page, socket: null, wait: FIRST_WAIT, timer: 0, drawn: -1, acknowledged: -1, received: 0, moment: [] });
    this.connect();
    for (const name of ["online", "focus"]) addEventListener(name, () => this.hurry());
    document.addEventListener("visibilitychange", () => this.hurry());
  }

  connect() {
    clearTimeout(this.timer);
    const address = new URL("socket", location.href);
    address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    address.search = location.search;
    this.socket = new WebSocket(address);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => {
      Object.assign(this, { wait: FIRST_WAIT, drawn: -1, acknowledged: -1, moment: [] });
      this.page.connected(true);
    };
    this.socket.onmessage = ({ data }) => this.receive(data);
    this.socket.onclose = () => this.lost();
  }

  get isOpen() { return this.socket !== null && this.socket.readyState === WebSocket.OPEN; }

  lost() {
    this.page.connected(false);
    // A little at random, so that many pages do not come back at once.
    this.timer = setTimeout(() => this.connect(), this.wait * (0.8 + 0.4 * Math.random()));
    this.wait = Math.min(this.wait * 1.6, LONGEST_WAIT);
  }

  // Somebody looks at the page again: do not wait any longer.
  hurry() {
    if (this.socket.readyState !== WebSocket.CLOSED || document.hidden) return;
    this.wait = FIRST_WAIT;
    this.connect();
  }

  receive(data) {
    try {
      if (typeof data !== "string") this.receiveFrame(data);
      else {
        const message = JSON.parse(data), act = `on_${message.type}`;
        if (act in this.page) this.page[act](message);
      }
    } catch (error) {
      this.page.fail(`The page cannot read what the server sends: ${error.message}`);
      throw error;
    }
  }

  receiveFrame(data) {
    const head = new DataView(data, 0, HEAD), kind = head.getUint8(0);
    if (kind === HISTORY) this.receiveHistory(data, head);
    if (kind !== FRAME) return;
    this.received += 1;
    // The frames of one moment are shown together: the worlds are compared.
    this.moment.push([head.getUint8(1), new Uint8Array(data, HEAD)]);
    if (this.moment.length < this.page.view.tracks.length) return;
    this.drawn = head.getUint32(4, true);
    // A hidden page draws nothing, acknowledges nothing, and so gets nothing more until somebody looks at it.
    requestAnimationFrame(() => this.acknowledge());
    for (const [track, block] of this.moment.splice(0)) this.page.onFrame(track, block);
  }

  // What was before this page: a size and a block for each frame.
  receiveHistory(data, head) {
    const sizes = new DataView(data), track = head.getUint8(1);
    for (let k = 0, at = HEAD; k < head.getUint32(4, true); k++) {
      const size = sizes.getUint32(at, true);
      this.page.onFrame(track, new Uint8Array(data, at + 4, size));
      at += 4 + size;
    }
  }

  acknowledge() {
    if (this.drawn === this.acknowledged || !this.isOpen) return;
    this.acknowledged = this.drawn;
    this.send("ack", { frame: this.drawn });
  }

  send(type, fields = {}) {
    if (!this.isOpen) return false;
    this.socket.send(JSON.stringify({ type, ...fields }));
    return true;
  }
}

// Part: controls.

// The slider of the rate is logarithmic: its value is 100 times the decimal logarithm of steps a second.
const SLOWEST = 0, FASTEST = 300;
const rateOf = (value) => Number((10 ** (value / 100)).toPrecision(2));
const PAUSE_BETWEEN = 60;
// What somebody has just changed is not set back by messages that were on their way [milliseconds].
const KEPT_FOR = 500;

class Controls {
  constructor(page, element) {
    Object.assign(this, { page, element, inputs: new Map(), shown: "", side: null, values: [], hidden: new Set(), chosen: new Set(), waiting: new Map(), touched: new Map(), state: null });
    element.setAttribute("aria-label", "Controls");
    this.start = make("div", { class: "tl-start" });
    element.append(this.buildAlert(), this.start, this.buildRun(), this.buildRate(), this.buildCompare());
    this.fields = make("div", { class: "tl-fields" });
    this.saveButton = this.button("Save recording", "Save what was seen as a page that plays anywhere", () => this.save());
    this.charts = make("div", { class: "tl-measures" });
    this.chartsKey = "";
    const csv = this.button("Save CSV", "Save the numbers of the charts", () => page.saveCharts());
    this.film = new Film(page, this);
    this.chartBox = make("details", {}, make("summary", {}, "Charts"), this.charts, make("div", { class: "tl-row" }, csv), this.buildBand());
    this.lab = make("div");
    element.append(this.lab, this.fields, this.chartBox, make("div", { class: "tl-row" }, this.saveButton, this.film.opener));
  }

  button(text, title, act) {
    return make("button", { type: "button", class: "ts-button tl-button", title, onclick: act }, text);
  }

  buildAlert() {
    this.alertText = make("span");
    const close = make("button", { type: "button", class: "ts-button", "aria-label": "Dismiss", onclick: () => this.alert("") }, "×");
    this.alertBox = make("div", { class: "tl-alert", role: "alert", hidden: true }, this.alertText, close);
    return this.alertBox;
  }

  alert(text) {
    this.alertBox.hidden = !text;
    setText(this.alertText, text);
    this.showNote();
  }

  buildRun() {
    const { page } = this;
    this.runButton = this.button("Run", "Run (space)", () => page.runOrPause());
    this.runButton.classList.add("tl-run");
    this.note = make("p", { class: "tl-note", role: "status", "aria-live": "polite" });
    this.rest = make("div", { class: "tl-rest", hidden: true },
      make("p", {}, "Your system asks for reduced motion: the run goes on, and this page shows one moment of it."),
      make("div", { class: "tl-row" }, this.button("Follow the run", "Show the newest frame (End)", () => page.follow())));
    this.ticks = make("p", { class: "tl-ticks" });
    return make("div", {},
      make("div", { class: "tl-row" }, this.runButton,
        this.button("Step", "One step (→ at the newest frame)", () => page.step()),
        this.button("Reset", "Start again with the same seed", () => { this.alert(""); page.link.send("reset"); })),
      this.ticks, this.note, this.rest);
  }

  buildRate() {
    const { page } = this;
    const send = (value) => { this.touch("rate of steps"); page.link.send("rate", { value }); };
    this.rate = make("input", { type: "range", min: SLOWEST, max: FASTEST, step: 1, id: "tl-rate", "aria-label": "Steps per second" });
    this.rateText = make("output", { class: "tl-value", for: "tl-rate" });
    this.full = make("input", { type: "checkbox", id: "tl-full" });
    this.every = make("input", { type: "number", min: 1, max: 10000, step: 1, id: "tl-every" });
    this.rate.addEventListener("input", () => { this.full.checked = false; this.showRate(); this.soon("rate", () => send(rateOf(this.rate.value))); });
    this.full.addEventListener("change", () => { send(this.full.checked ? null : rateOf(this.rate.value)); this.showRate(); });
    this.every.addEventListener("change", () => {
      if (this.every.checkValidity() && this.every.value) return page.link.send("every", { value: Number(this.every.value) });
      this.alert(`draw every ${this.every.value} steps: must be a whole number from ${this.every.min} to ${Number(this.every.max).toLocaleString("en")}`);
      this.every.value = this.state ? this.state.every : 1;
    });
    return make("fieldset", {}, make("legend", {}, "Rate"),
      make("div", { class: "tl-field" }, make("label", { for: "tl-rate" }, "steps/s"), this.rate, this.rateText),
      make("div", { class: "tl-field" }, make("label", { for: "tl-full" }, "as fast as possible"), this.full),
      make("div", { class: "tl-field" }, make("label", { for: "tl-every" }, "draw every … steps"), this.every));
  }

  showRate() {
    const isFull = this.full.checked, rate = String(rateOf(this.rate.value));
    setText(this.rateText, isFull ? "–" : rate);
    this.rate.setAttribute("aria-valuetext", isFull ? "as fast as possible" : `${rate} steps per second`);
  }

  buildCompare() {
    const { page } = this;
    this.compare = make("input", { type: "checkbox", id: "tl-compare" });
    this.compare.addEventListener("change", () => { this.touch("two"); page.link.send("compare", { on: this.compare.checked }); });
    const choice = (value, text) => {
      const input = make("input", { type: "radio", name: "tl-side", value: String(value), checked: value === null });
      input.addEventListener("change", () => this.turnTo(value));
      return make("label", {}, input, text);
    };
    this.sides = make("div", { class: "tl-sides", role: "radiogroup", "aria-label": "Settings of", hidden: true },
      "Settings of ", choice(null, "both"), choice(0, "left"), choice(1, "right"));
    return make("div", { class: "tl-compare" },
      make("div", { class: "tl-field" }, make("label", { for: "tl-compare" }, "two worlds, same noise"), this.compare), this.sides);
  }

  // Settings and interventions are those of this world, or of both if null. What is selected is in it too.
  turnTo(side) {
    const { view } = this.page, { track, slot } = view.selected;
    this.side = side;
    for (const input of this.sides.querySelectorAll("input")) input.checked = input.value === String(side);
    this.showValues();
    if (side !== null && slot !== null && track !== side) view.select(side, view.tracks[side].scene.slots[slot] ? slot : null);
  }

  // Somebody has clicked in a world: if one is chosen, it is that one from now on.
  clickedIn(track) { if (this.side !== null && this.side !== track) this.turnTo(track); }

  // Calls at most every few milliseconds, the last time with the last value.
  soon(key, act) {
    const isWaiting = this.waiting.has(key);
    this.waiting.set(key, act);
    if (isWaiting) return;
    act();
    this.waiting.set(key, null);
    setTimeout(() => {
      const last = this.waiting.get(key);
      this.waiting.delete(key);
      if (last) this.soon(key, last);
    }, PAUSE_BETWEEN);
  }

  // Notes that somebody has changed a field, and shows what holds a little later.
  touch(name) {
    this.touched.set(name, performance.now());
    setTimeout(() => {
      if (!this.isTouched(name)) { this.showValues(); if (this.state) this.showState(this.state); }
    }, KEPT_FOR + 20);
  }

  isTouched(name) { return performance.now() - (this.touched.get(name) ?? -Infinity) < KEPT_FOR; }

  set(control, value) {
    // What was refused before is past.
    this.alert("");
    this.touch(control.name);
    this.page.link.send("set", { name: control.name, value, track: this.side });
  }

  // What the server lets a page set.
  describe({ controls, values }) {
    this.values = values;
    const key = JSON.stringify(controls);
    if (key !== this.shown) {
      this.shown = key;
      this.inputs.clear();
      const sections = new Map();
      for (const control of controls) {
        if (!sections.has(control.section)) sections.set(control.section, []);
        sections.get(control.section).push(this.field(control));
      }
      this.fields.replaceChildren(...[...sections].map(([title, fields]) => make("fieldset", {}, make("legend", {}, title), ...fields)));
    }
    this.showValues();
  }

  field(control) {
    const id = `tl-${control.name}`, note = control.live ? "" : " Starts again.";
    const label = make("label", { for: id, title: `${control.help}${note}` }, control.label);
    if (!control.live) label.append(make("span", { class: "tl-again", "aria-label": "(starts again)", title: "Starts again" }, " ↻"));
    const { box, show } = this[["choice", "flag", "digits"].includes(control.kind) ? control.kind : "number"](control, id);
    const field = make("div", { class: "tl-field" }, label, ...box);
    this.inputs.set(control.name, { control, field, show, inputs: box.filter((one) => one.matches("input, select")) });
    return field;
  }

  choice(control, id) {
    const select = make("select", { id }, ...control.choices.map((one) => make("option", { value: one }, one)));
    select.addEventListener("change", () => this.set(control, select.value));
    return { box: [select], show: (value) => { select.value = value; } };
  }

  flag(control, id) {
    const input = make("input", { type: "checkbox", id });
    input.addEventListener("change", () => this.set(control, input.checked));
    return { box: [input], show: (value) => { input.checked = value; } };
  }

  // A whole number that may be larger than those that scripts hold exactly: it stays a text.
  digits(control, id) {
    const input = make("input", { type: "text", inputmode: "numeric", pattern: "[0-9]+", id });
    input.addEventListener("input", () => { delete input.dataset.sent; });
    input.addEventListener("change", () => {
      input.dataset.sent = "yes";
      this.set(control, input.value.trim());
    });
    return { box: [input], show: (value) => { input.value = value; } };
  }

  number(control, id) {
    const limits = { min: control.least, max: control.most, step: control.step ?? (control.kind === "integer" ? 1 : "any") };
    const number = make("input", { type: "number", id, ...limits, step: control.kind === "integer" ? 1 : "any" });
    const send = () => {
      number.dataset.sent = "yes";
      if (number.value !== "" && number.checkValidity()) return this.set(control, Number(number.value));
      this.alert(`${`${control.label} ${number.value}`.trim()}: must be ${control.kind === "integer" ? "a whole number" : "a number"} from ${control.least} to ${control.most}`);
      return this.showValues();
    };
    number.addEventListener("change", send);
    number.addEventListener("input", () => { delete number.dataset.sent; });
    if (control.step === null) return { box: [number], show: (value) => { number.value = value; } };
    const slider = make("input", { type: "range", ...limits, max: control.reach, "aria-label": control.label });
    slider.addEventListener("input", () => {
      number.value = slider.value;
      if (control.live) this.soon(control.name, send);
    });
    if (!control.live) slider.addEventListener("change", send);
    const say = (value) => slider.setAttribute("aria-valuetext", value);
    slider.addEventListener("input", () => say(slider.value));
    // The slider ends before the largest number that can be typed.
    return { box: [slider, number], show: (value) => { slider.value = value; number.value = value; say(value); } };
  }

  // Shows the values that hold, but in a field that somebody is using.
  showValues() {
    const values = this.values[this.side ?? 0] || this.values[0] || {};
    for (const [name, { control, field, show, inputs }] of this.inputs) {
      const differs = this.side === null && this.values.length > 1 && this.values[0][name] !== this.values[1][name];
      field.classList.toggle("tl-differs", differs);
      field.title = differs ? `left ${this.values[0][name]}, right ${this.values[1][name]}` : "";
      // Somebody may be typing a number.
      const isTyping = inputs.some((one) => one === document.activeElement && ["number", "text"].includes(one.type) && !one.dataset.sent);
      if (!this.isTouched(name) && !isTyping) show(values[name]);
      const [other, wanted] = control.only ? control.only.split("=") : [];
      for (const input of inputs) input.disabled = Boolean(other) && !wanted.split(",").includes(String(values[other]));
    }
  }

  // A box for each measure: those of every frame are there from the start, others from the moment at which they are chosen.
  showCharts({ measures, charted }) {
    const { view } = this.page, series = [...new Set(view.tracks.flatMap(({ scene }) => scene.series))];
    const always = series.filter((name) => !measures.includes(name) && !this.chosen.has(name));
    for (const name of [...measures, ...charted]) this.chosen.add(name);
    const names = [...new Set([...always, ...measures, ...charted])], on = (name) => (always.includes(name) ? !this.hidden.has(name) : charted.includes(name));
    const key = JSON.stringify([names, names.map(on)]);
    const hidden = series.filter((name) => !on(name));
    view.hideSeries(hidden);
    if (key === this.chartsKey) return;
    this.chartsKey = key;
    const focused = this.charts.contains(document.activeElement) ? document.activeElement.dataset.name : null;
    this.charts.replaceChildren(...names.map((name) => {
      const box = make("input", { type: "checkbox", checked: on(name), "data-name": name });
      box.addEventListener("change", () => {
        if (always.includes(name)) {
          this.hidden[box.checked ? "delete" : "add"](name);
          this.showCharts(this.state);
        } else this.page.link.send("chart", { name, on: box.checked });
      });
      return make("label", {}, box, view.nameOf(name));
    }));
    if (focused !== null) [...this.charts.querySelectorAll("input")].find((box) => box.dataset.name === focused)?.focus();
  }

  // Runs of other seeds, whose band is drawn behind the observed fraction.
  buildBand() {
    this.bandRuns = make("input", { type: "number", id: "tl-band-runs", min: 8, max: 64, step: 1, value: 16 });
    this.bandTicks = make("input", { type: "number", id: "tl-band-ticks", min: 1, max: 100000, step: 1, placeholder: "present" });
    this.bandButton = this.button("Run for a band", "Runs worlds of other seeds with these settings, beside these", () => this.askBand());
    this.bandStop = this.button("Cancel", "Stop the runs, and show no band", () => this.page.link.send("drop"));
    this.bandStop.hidden = true;
    this.bandNote = make("p", { class: "tl-note", role: "status", "aria-live": "polite" });
    return make("fieldset", {}, make("legend", {}, "Band of other seeds"),
      make("div", { class: "tl-field" }, make("label", { for: "tl-band-runs", title: "8 to 64 runs of each world" }, "runs"), this.bandRuns),
      make("div", { class: "tl-field" }, make("label", { for: "tl-band-ticks", title: "Empty: up to the present tick" }, "ticks"), this.bandTicks),
      make("div", { class: "tl-row" }, this.bandButton, this.bandStop), this.bandNote);
  }

  askBand() {
    const wrong = [[this.bandRuns, "runs"], [this.bandTicks, "ticks"]].find(([field]) => !field.checkValidity());
    if (wrong) return this.alert(`${wrong[1]}: must be a whole number from ${wrong[0].min} to ${Number(wrong[0].max).toLocaleString("en")}`);
    this.alert("");
    const { value } = this.bandTicks;
    return this.page.link.send("band", { runs: Number(this.bandRuns.value) || 16, ticks: value === "" ? null : Number(value) });
  }

  // How far the runs are, or their band.
  showBand(message) {
    const { runs, done, ticks, interval, first, last, bands } = message;
    this.band = message;
    const isThere = runs > 0 && bands.length > 0, isBusy = runs > 0 && !isThere;
    if (!runs && this.bandStop === document.activeElement) this.bandButton.focus();
    this.bandStop.hidden = !runs;
    // A screen reader need not say each run.
    this.bandNote.setAttribute("aria-busy", String(isBusy));
    setText(this.bandStop, isThere ? "Remove band" : "Cancel");
    setText(this.bandNote, isBusy ? `${done} of ${runs} runs` : isThere ? `${runs} runs of ${ticks.toLocaleString("en")} ticks, seeds ${first} to ${last}` : "");
    const text = isThere ? `band: ${interval} % of ${runs} other seeds (percentiles ${50 - interval / 2} to ${50 + interval / 2}); dots: mean${this.bandLimits(message)}` : "";
    if (isThere || this.page.view.band) this.page.view.setBand(isThere ? { text, runs, bands } : null);
  }

  // What a reader has to know of a band: where runs are missing, and that nobody intervened in them.
  bandLimits({ runs, bands }) {
    const ends = bands.flatMap(({ ticks, count }) => { const k = count.findIndex((n) => n < runs); return k < 0 ? [] : [ticks[k]]; });
    const few = ends.length ? `; paler from tick ${Math.min(...ends).toLocaleString("en")}, where n < ${runs} runs have a value, none where n < ${this.bandRuns.min}` : "";
    this.bandDone = Boolean(this.state && this.state.tracks.some(({ done }) => done));
    return few + (this.bandDone ? ". Undisturbed: they have the present settings from tick 0, and nothing else that was done here" : "");
  }

  showState(state) {
    this.state = state;
    this.showCharts(state);
    if (this.page.view.band && this.bandDone !== state.tracks.some(({ done }) => done)) this.showBand(this.band);
    setText(this.runButton, state.running ? "Pause" : "Run");
    // The button below the arena, which also plays the past, is called Pause.
    this.runButton.setAttribute("aria-label", state.running ? "Pause the run" : "Run");
    this.runButton.title = state.running ? "Pause the run (space)" : "Run (space)";
    this.showNote();
    setText(this.ticks, `tick ${state.tracks[0].tick.toLocaleString("en")}, ${this.pace(state)}`);
    if (!this.isTouched("rate of steps")) {
      this.full.checked = state.rate === null;
      if (state.rate !== null) this.rate.value = Math.round(100 * Math.log10(state.rate));
      this.showRate();
    }
    if (document.activeElement !== this.every) this.every.value = state.every;
    if (!this.isTouched("two")) this.compare.checked = state.two;
    this.sides.hidden = state.tracks.length < 2;
    if (state.tracks.length < 2 && this.side !== null) this.turnTo(null);
  }

  // What the worlds do: how fast they are, once that is measured, or why they stand still.
  pace({ running, measured, busy, failed, ended }) {
    if (!running) return busy ? "…" : failed ? "failed" : ended ? "ended" : "paused";
    if (measured === null) return "running";
    const rounded = measured < 10 ? measured.toFixed(1) : Number(measured.toPrecision(measured < 1000 ? 3 : 2)).toLocaleString("en", { maximumFractionDigits: 0 });
    return `${rounded} steps/s`;
  }

  // What an alert says is not said twice.
  showNote() {
    const { busy, note } = this.state || { busy: "", note: "" };
    setText(this.note, busy || (this.alertText.textContent === note ? "" : note));
  }

  save() {
    if (!this.page.link.send("save")) return;
    this.saveButton.disabled = true;
    setText(this.saveButton, "Saving …");
  }

  saved() {
    this.saveButton.disabled = false;
    setText(this.saveButton, "Save recording");
  }
}

// Part: film.

const LARGE_FILM = 20e6, megabytes = (bytes) => `${(bytes / 1e6).toFixed(1)} MB`;

class Film {
  constructor(page, controls) {
    Object.assign(this, { page, controls, isBusy: false });
    this.opener = controls.button("Save film", "Choose the ticks of a film, and save it", () => this.open());
    const number = (id) => {
      const input = make("input", { type: "number", id, step: 1, min: 0, required: true });
      input.addEventListener("input", () => controls.soon("reel", () => this.ask()));
      return input;
    };
    [this.first, this.last] = [number("tl-film-first"), number("tl-film-last")];
    this.said = make("p", { class: "tl-note", role: "status" });
    this.wrong = make("p", { role: "alert" });
    this.bar = make("progress", { "aria-label": "Drawn frames", hidden: true });
    // Not a status: a screen reader need not say each frame.
    this.drawn = make("p", { class: "tl-note" });
    this.maker = controls.button("Make the film", "The server draws it; the worlds go on", () => this.begin());
    this.stopper = controls.button("Cancel the film", "No film, after all", () => this.cancel());
    this.closer = controls.button("Close", "Back to the page; a film that is being made goes on", () => this.dialog.close());
    this.closer.setAttribute("aria-label", "Close the film");
    this.dialog = make("dialog", { class: "ts-help tl-film", "aria-labelledby": "tl-film-title" },
      make("h2", { id: "tl-film-title" }, "Save film"),
      make("p", {}, "With legend and charts, 20 frames a second. The server draws it."),
      make("div", { class: "tl-field" }, make("label", { for: "tl-film-first" }, "from tick"), this.first),
      make("div", { class: "tl-field" }, make("label", { for: "tl-film-last" }, "to tick"), this.last),
      this.said, this.wrong, this.bar, this.drawn, make("div", { class: "tl-row" }, this.maker, this.stopper, this.closer));
    page.view.root.append(this.dialog);
    this.show();
  }

  get isOpen() { return this.dialog.open; }

  open() {
    this.fail("");
    if (!this.isBusy) this.askNewest();
    if (!this.isOpen) this.dialog.showModal();
  }

  askNewest() {
    this.isNewest = true;
    this.page.link.send("reel", { run: this.page.run, first: null, last: null });
  }

  get ticks() { return { run: this.page.run, first: Number(this.first.value), last: Number(this.last.value) }; }

  // What a film of the typed ticks would be.
  ask() {
    if (this.isBusy || !this.first.checkValidity() || !this.last.checkValidity()) return;
    this.fail("");
    this.page.link.send("reel", this.ticks);
  }

  describe({ first, last, oldest, newest, frames, pictures, most, ending, seconds, bytes, width }) {
    for (const [input, value] of [[this.first, first], [this.last, last]]) {
      if (this.isNewest) input.value = value;
      Object.assign(input, { min: oldest, max: Math.max(newest, input.max || 0) });
    }
    this.isNewest = false;
    const count = (value, what) => `${value.toLocaleString("en")} ${what}${value === 1 ? "" : "s"}`;
    const thinned = pictures < frames ? `, of which ${count(pictures, "frame")} are drawn, evenly, since a film has at most ${most.toLocaleString("en")}` : "";
    setText(this.said, `${count(frames, "frame")}${thinned}: ${ending}, ${width.toLocaleString("en")} pixels wide, ${seconds.toLocaleString("en")} s long, about ${megabytes(bytes)}${bytes > LARGE_FILM ? ", large for a mail or a page: choose fewer ticks" : ""}. ` +
      `Ticks ${oldest.toLocaleString("en")} to ${newest.toLocaleString("en")} are kept.`);
  }

  begin() {
    const wrong = [this.first, this.last].find((input) => !input.checkValidity());
    if (wrong) return this.fail(`${wrong.labels[0].textContent} ${wrong.value}: must be a whole number from ${wrong.min} to ${wrong.max}`);
    this.fail("");
    if (this.page.link.send("film", this.ticks)) this.work(0, 0);
    return undefined;
  }

  cancel() {
    if (!this.page.link.send("cancel")) return;
    this.stopper.disabled = true;
    for (const one of [this.opener, this.drawn]) setText(one, "Cancelling …");
  }

  // Some frames are drawn.
  work(done, frames) {
    this.isBusy = true;
    Object.assign(this.bar, { max: frames || 1, value: done });
    this.show();
    if (this.stopper.disabled) return;
    setText(this.opener, frames ? `Frame ${done} of ${frames}` : "Drawing …");
    setText(this.drawn, this.opener.textContent);
    this.bar.setAttribute("aria-valuetext", this.opener.textContent);
  }

  // It is saved, cancelled, or lost.
  end(text = "") {
    if (!this.isBusy) return;
    this.isBusy = this.stopper.disabled = false;
    this.show();
    setText(this.opener, "Save film");
    setText(this.drawn, "");
    if (text) setText(this.said, text);
  }

  fail(text) {
    setText(this.wrong, text);
    this.wrong.hidden = !text;
  }

  show() {
    const { isBusy } = this, hadFocus = this.dialog.contains(document.activeElement);
    this.bar.hidden = this.stopper.hidden = !isBusy;
    for (const one of [this.first, this.last, this.maker]) one.disabled = isBusy;
    // Whoever works by keyboard is not left nowhere.
    if (hadFocus && !this.dialog.querySelector(":focus:enabled")?.checkVisibility()) (isBusy ? this.stopper : this.maker).focus();
  }
}

// Part: log.

class Log {
  constructor(element) {
    this.summary = make("summary", {}, "Events");
    this.body = make("tbody");
    this.nothing = make("p", { class: "ts-soft" }, "None so far.");
    this.table = make("table", {}, make("thead", {}, make("tr", {}, ...["time", "what", "who", ""].map((text) => make("th", { scope: "col" }, text)))), this.body);
    this.details = make("details", { open: true }, this.summary, this.nothing, make("div", { class: "tl-scroll", tabindex: 0, role: "region", "aria-label": "Event log" }, this.table));
    element.append(this.details);
    this.details.addEventListener("toggle", () => this.show(this.tracks));
    this.show([]);
  }

  show(tracks) {
    this.tracks = tracks;
    const total = tracks.reduce((sum, { total: one }) => sum + one, 0);
    setText(this.summary, total ? `Events (${total.toLocaleString("en")})` : "Events");
    this.nothing.hidden = total > 0;
    this.table.parentElement.hidden = total === 0;
    if (!this.details.open) return;
    const rows = tracks.flatMap(({ rows: all }, t) => all.map((row) => ({ row, t })));
    rows.sort((one, other) => other.row[0] - one.row[0]);
    const side = (t) => (tracks.length > 1 ? ["left: ", "right: "][t] : "");
    this.body.replaceChildren(...rows.slice(0, 100).map(({ row: [time, what, group, agent, details], t }) => make("tr", {},
      make("td", {}, Number.isInteger(time) ? String(time) : time.toFixed(2)), make("td", {}, what),
      make("td", {}, `${side(t)}${[group, agent].filter((one) => one !== null).join(" ")}`),
      make("td", {}, Object.entries(details).map(([name, value]) => `${name} ${typeof value === "number" && !Number.isInteger(value) ? value.toPrecision(3) : value}`).join(", ")))));
  }
}

// Part: graph.

// More robots than MOST_ROUND are drawn at their places.
const MOST_ROUND = 60, MOST_CHORDS = 3000, LABELLED = 24, GRAPH_PAUSE = 100, GRAPH_SIZE = 240, BARS = 64;

class Graph {
  constructor(page, element) {
    Object.assign(this, { page, drawnAt: 0, timer: 0, key: "", nodes: [], drawnFrames: [] });
    this.canvas = make("canvas", { role: "img", "aria-label": "Neighbour graph" });
    this.text = make("p", { class: "tl-graph-text" });
    this.details = make("details", { open: true }, make("summary", {}, "Neighbour graph"), this.canvas, this.text);
    element.append(this.details);
    this.details.addEventListener("toggle", () => this.soon());
    this.canvas.addEventListener("click", (event) => this.onClick(event));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { this.key = ""; this.soon(); });
  }

  // Draws now, or soon if that was done a moment ago.
  soon() {
    // Before the first state nobody's neighbours are known.
    if (this.timer || !this.details.open || !this.page.state) return;
    this.timer = setTimeout(() => {
      this.timer = 0;
      this.drawnAt = performance.now();
      this.draw();
    }, Math.max(GRAPH_PAUSE - (performance.now() - this.drawnAt), 0));
  }

  draw() {
    const { view } = this.page, selected = view.selected;
    const shown = view.tracks.map((track, t) => ({ track, t, frame: view.frameOf(t) })).filter(({ frame }) => frame);
    if (!shown.length) return;
    // A change between two steps makes another frame of the same time.
    const isSame = shown.length === this.drawnFrames.length && shown.every(({ frame }, k) => frame === this.drawnFrames[k]);
    const key = [shown.map(({ track }) => track.scene.slots.length), selected.track, selected.slot, this.canvas.clientWidth, shown.length].join();
    if (isSame && key === this.key) return;
    Object.assign(this, { key, drawnFrames: shown.map(({ frame }) => frame) });
    const ratio = devicePixelRatio || 1, width = this.canvas.clientWidth || GRAPH_SIZE, size = Math.min(width / shown.length, GRAPH_SIZE);
    const height = size + BARS;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
      this.canvas.style.height = `${height}px`;
    }
    const to = this.canvas.getContext("2d");
    to.setTransform(ratio, 0, 0, ratio, 0, 0);
    to.clearRect(0, 0, width, height);
    this.nodes = [];
    const texts = shown.map((one, k) => this.drawOne(to, one, (width / shown.length) * k + (width / shown.length - size) / 2, size, selected));
    const text = texts.map((one, k) => (shown.length > 1 ? `${["Left", "Right"][k]}: ${one}` : one)).join(" ");
    setText(this.text, text);
    this.canvas.setAttribute("aria-label", `Neighbour graph. ${text}`);
  }

  drawOne(to, { track, t, frame }, left, size, selected) {
    const { scene } = track, style = getComputedStyle(this.canvas), text = style.color;
    const accent = style.getPropertyValue(`--track-${t}`) || text, soft = style.getPropertyValue("--edge") || text;
    const list = scene.links.findIndex(({ channel }) => channel === "teammates");
    const team = [], place = new Map();
    for (let s = 0; s < frame.n; s++) {
      // Present and active: robots that have failed have no neighbours, and do not count in their mean.
      if (scene.groups[scene.slots[s].group].team !== null && (frame.flags[s] & 3) === 3) { place.set(s, team.length); team.push(s); }
    }
    const { source, target, omitted } = list < 0 ? { source: [], target: [] } : frame.links[list];
    if (omitted) return this.tooMany(track, frame, team.length, omitted, t);
    const degrees = new Uint32Array(team.length);
    for (let k = 0; k < source.length; k++) if (place.has(source[k])) degrees[place.get(source[k])] += 1;
    const inSpace = team.length > MOST_ROUND, { width: wide, height: high } = track.layout, scale = (size - 8) / Math.max(wide, high);
    const spaceX = (k) => left + size / 2 + scale * wide * (frame.x[team[k]] / 65535 - 0.5);
    const spaceY = (k) => size / 2 - scale * high * (frame.y[team[k]] / 65535 - 0.5);
    const radius = size / 2 - 16, roundX = (k) => left + size / 2 + radius * Math.sin((2 * Math.PI * k) / team.length), roundY = (k) => size / 2 - radius * Math.cos((2 * Math.PI * k) / team.length);
    const [x, y] = inSpace ? [spaceX, spaceY] : [roundX, roundY];
    // Of two neighbours across a seam the line would cross all.
    this.seam = inSpace && track.layout.period.some((length) => length) ? size / 2 : Infinity;
    this.chords(to, source, target, place, x, y, soft, accent, selected.track === t ? selected.slot : null);
    const most = degrees.reduce((a, b) => Math.max(a, b), 0), dot = Math.max(Math.min(5, inSpace ? 40 / Math.sqrt(team.length) : (3 * radius) / Math.max(team.length, 1)), 1);
    team.forEach((s, k) => {
      const isSelected = selected.track === t && selected.slot === s;
      to.beginPath();
      to.arc(x(k), y(k), isSelected ? dot + 2 : dot * (0.7 + (0.6 * degrees[k]) / Math.max(most, 1)), 0, 2 * Math.PI);
      to.globalAlpha = isSelected ? 1 : 0.7 + (0.3 * degrees[k]) / Math.max(most, 1);
      to.fillStyle = accent;
      to.fill();
      to.globalAlpha = 1;
      if (isSelected) { to.strokeStyle = text; to.lineWidth = 1.5; to.stroke(); }
      this.nodes.push({ x: x(k), y: y(k), track: t, slot: s });
      if (team.length <= LABELLED) this.label(to, String(degrees[k]), left + size / 2 + (x(k) - left - size / 2) * (1 + 11 / radius), size / 2 + (y(k) - size / 2) * (1 + 11 / radius), text);
    });
    this.histogram(to, degrees, left, size, accent, text, soft);
    const mean = team.length ? source.length / team.length : 0;
    const links = `${source.length.toLocaleString("en")} links${source.length > MOST_CHORDS ? ", too many to draw" : ""}`;
    return `${team.length} robots${inSpace ? " at their places" : ""}, ${links}; ${this.neighbours(mean, most, t)}`;
  }

  // What remains to be said where a frame does not hold the links.
  tooMany({ scene }, frame, robots, links, t) {
    const [mean, most] = ["mean_neighbours", "max_neighbours"].map((name) => frame.value(scene.series.indexOf(name)));
    return `${robots} robots, ${links.toLocaleString("en")} links, too many to show; ${this.neighbours(mean, most, t)}`;
  }

  neighbours(mean, most, t) {
    const state = this.page.state && this.page.state.tracks[t];
    return `neighbours: mean ${mean.toFixed(1)}, at most ${most} now${state ? `, ${Math.max(state.most, most)} so far` : ""}.`;
  }

  // Links as lines between nodes: dashed where only one side has the other in range.
  chords(to, source, target, place, x, y, soft, accent, chosen) {
    if (source.length > MOST_CHORDS) return;
    const both = new Set();
    for (let k = 0; k < source.length; k++) both.add(source[k] * 65536 + target[k]);
    for (const [isMutual, dash] of [[true, []], [false, [3, 3]]]) {
      for (const isChosen of [false, true]) {
        to.beginPath();
        for (let k = 0; k < source.length; k++) {
          const a = source[k], b = target[k], mutual = both.has(b * 65536 + a);
          if (mutual !== isMutual || (mutual && a > b) || !place.has(a) || !place.has(b)) continue;
          if (isChosen !== (a === chosen || b === chosen)) continue;
          const [ax, ay, bx, by] = [x(place.get(a)), y(place.get(a)), x(place.get(b)), y(place.get(b))];
          if (Math.abs(ax - bx) > this.seam || Math.abs(ay - by) > this.seam) continue;
          to.moveTo(ax, ay);
          to.lineTo(bx, by);
        }
        to.setLineDash(dash);
        to.strokeStyle = isChosen ? accent : soft;
        to.lineWidth = isChosen ? 2 : 1;
        to.stroke();
      }
    }
    to.setLineDash([]);
  }

  // How many robots have how many neighbours.
  histogram(to, degrees, left, size, accent, text, soft) {
    const counts = new Array(degrees.reduce((a, b) => Math.max(a, b + 1), 0)).fill(0);
    for (const degree of degrees) counts[degree] += 1;
    const bars = Math.max(counts.length, 6), wide = (size - 8) / bars, most = Math.max(...counts, 1);
    const base = size + BARS - 16, high = BARS - 32;
    for (let k = 0; k < bars; k++) {
      const count = counts[k] || 0, at = left + 4 + k * wide;
      to.fillStyle = accent;
      to.fillRect(at + wide * 0.12, base - (high * count) / most, wide * 0.76, (high * count) / most);
      if (bars <= 16 || k % Math.ceil(bars / 12) === 0) this.label(to, String(k), at + wide / 2, base + 8, text);
      if (count && bars <= 16) this.label(to, String(count), at + wide / 2, base - (high * count) / most - 6, text);
    }
    to.fillStyle = soft;
    to.fillRect(left + 4, base, size - 8, 1);
  }

  label(to, text, x, y, colour) {
    to.font = "10px system-ui, sans-serif";
    to.textAlign = "center";
    to.textBaseline = "middle";
    to.fillStyle = colour;
    to.fillText(text, x, y);
  }

  onClick(event) {
    const box = this.canvas.getBoundingClientRect(), px = event.clientX - box.left, py = event.clientY - box.top;
    let best = null, least = 14;
    for (const node of this.nodes) {
      const away = Math.hypot(node.x - px, node.y - py);
      if (away < least) [best, least] = [node, away];
    }
    if (best) this.page.view.select(best.track, best.slot);
    this.soon();
  }
}

// Part: laboratory.

// What a click or a drag on the arena does.
const TOOLS = [
  ["look", "Look", "Select a body; drag to pan"], ["move", "Move", "Drag a robot or a target"],
  ["switch", "Fail or repair", "Click a body: it fails, or is repaired"], ["add", "Add", "Click where a body is to be"],
  ["remove", "Remove", "Click a body"], ["circle", "Circle", "Drag from the middle of an obstacle to its rim"],
  ["rectangle", "Rectangle", "Drag from one corner of an obstacle to the other"],
  ["polygon", "Polygon", "Draw the rim of an obstacle"],
];
const SVG = "http://www.w3.org/2000/svg";
// Corners of a drawn obstacle, at most, and the pixels that a corner may be off; drags shorter than these pixels are clicks.
const MOST_CORNERS = 40, CORNER_OFF = 4, SHORTEST_DRAG = 4;
const FOUR = (value) => Number(value.toFixed(4));

// The corners of a line without those that are hardly off the way from others (Douglas and Peucker 1973).
function simplified(points, off) {
  if (points.length < 3) return points;
  const [[ax, ay], [bx, by]] = [points[0], points[points.length - 1]], long = Math.hypot(bx - ax, by - ay);
  let most = 0, at = 0;
  points.forEach(([x, y], k) => {
    const away = long ? Math.abs((bx - ax) * (ay - y) - (ax - x) * (by - ay)) / long : Math.hypot(x - ax, y - ay);
    if (away > most) [most, at] = [away, k];
  });
  if (most <= off) return [points[0], points[points.length - 1]];
  return [...simplified(points.slice(0, at + 1), off).slice(0, -1), ...simplified(points.slice(at), off)];
}

class Laboratory {
  constructor(page, element) {
    Object.assign(this, { page, tool: "look", held: null, groups: "" });
    element.append(this.build());
    const { stage } = page.view;
    // Before the canvas itself, which would pan or select.
    for (const [type, act] of [["pointerdown", "begin"], ["pointermove", "go"], ["pointerup", "end"], ["pointercancel", "cancel"]]) {
      stage.addEventListener(type, (event) => this[act](event), true);
    }
    document.addEventListener("keydown", (event) => { if (event.key === "Escape" && this.tool !== "look") this.choose("look"); }, true);
  }

  build() {
    const { page } = this, { controls } = page;
    this.inputs = TOOLS.map(([name, text, title]) => {
      const input = make("input", { type: "radio", name: "tl-tool", value: name, checked: name === "look" });
      input.addEventListener("change", () => this.choose(name));
      return make("label", { title }, input, text);
    });
    this.group = make("select", { id: "tl-group" });
    this.hint = make("p", { class: "tl-note", role: "status" });
    const number = (id, value) => make("input", { type: "number", step: "any", id, value });
    [this.x, this.y, this.size] = [number("tl-x", 0), number("tl-y", 0), number("tl-size", 0.5)];
    const field = (text, input) => make("label", {}, text, input);
    this.exact = make("details", { class: "tl-exact" }, make("summary", {}, "By numbers"),
      make("div", { class: "tl-place" }, field("x", this.x), field("y", this.y), field("radius", this.size)),
      make("div", { class: "tl-row" },
        controls.button("Move the selected body there", "Moves the body that is selected to x, y", () => this.withTyped((place) => this.withSelected("move", place))),
        controls.button("Fail or repair the selected body", "The body that is selected", () => this.switchSelected()),
        controls.button("Remove the selected body", "The body that is selected", () => this.withSelected("remove")),
        controls.button("Add a body there", "Adds a body of the chosen group at x, y", () => this.withTyped((place) => this.add(0, place))),
        controls.button("Add a circle there", "Adds an obstacle of this radius around x, y", () => this.withTyped((place) => this.typedCircle(place)))));
    const copies = { command: "The command that opens this page with the present settings", Python: "A script that repeats this run, interventions included", link: "The address of this page, at this tick" };
    this.copies = Object.entries(copies).map(([form, title]) => controls.button(`Copy as ${form}`, title, () => page.link.send("copy", { form })));
    this.text = make("textarea", { readonly: "", rows: 12, spellcheck: "false", "aria-label": "Copied text" });
    this.said = make("p", { role: "status" });
    this.dialog = make("dialog", { class: "ts-help tl-copied", "aria-labelledby": "tl-copied-title" },
      make("h2", { id: "tl-copied-title" }, "Copy"), this.said, this.text,
      make("button", { type: "button", class: "ts-button ts-wide", onclick: () => this.dialog.close() }, "Close the copy"));
    page.view.root.append(this.dialog);
    return make("fieldset", { class: "tl-lab" }, make("legend", {}, "Intervene"),
      make("div", { class: "tl-tools", role: "radiogroup", "aria-label": "What a click on the arena does" }, ...this.inputs),
      make("div", { class: "tl-field" }, make("label", { for: "tl-group" }, "add to"), this.group),
      this.hint, this.exact,
      make("div", { class: "tl-row" }, controls.button("Remove drawn obstacles", "The arena is again as it was built", () => this.send("clear", 0))),
      make("div", { class: "tl-row tl-presets" }, ...this.copies));
  }

  choose(tool) {
    this.tool = tool;
    this.cancel();
    for (const label of this.inputs) label.firstChild.checked = label.firstChild.value === tool;
    this.page.view.root.classList.toggle("tl-acting", tool !== "look");
    setText(this.hint, tool === "look" ? "" : `${TOOLS.find(([name]) => name === tool)[2]}. Esc ends.`);
  }

  // The groups to which bodies can be added.
  describe(scene) {
    const names = scene.groups.map(({ name }) => name).join();
    if (names === this.groups) return;
    this.groups = names;
    this.group.replaceChildren(...scene.groups.map(({ name }, g) => make("option", { value: g }, name)));
  }

  // What is done on one side is done to both worlds, unless "Settings of" names one.
  send(type, track, fields = {}) {
    const { side } = this.page.controls;
    this.page.controls.alert("");
    // At the newest frame only: there the bodies are where they are drawn.
    if (!this.page.view.following) this.page.view.show(this.page.view.frameCount - 1);
    return this.page.link.send(type, { track: side ?? track, both: side === null, run: this.page.run, ...fields });
  }

  // An empty field is no 0.
  withTyped(act) {
    if ([this.x, this.y].some(({ value }) => value === "")) return this.page.controls.alert("x and y: must be numbers.");
    return act({ x: Number(this.x.value), y: Number(this.y.value) });
  }

  add(track, place) { this.send("add", track, { group: Number(this.group.value), ...place }); }

  typedCircle({ x, y }) {
    if (!(Number(this.size.value) > 0)) return this.page.controls.alert("radius: must be a number above 0.");
    return this.send("obstruct", 0, { shape: "circle", points: [[x, y], [x + Number(this.size.value), y]] });
  }

  withSelected(type, fields = {}) {
    const { track, slot } = this.page.view.selected;
    if (slot === null) return this.page.controls.alert("No body is selected: click one, or press [ or ].");
    return this.send(type, track, { body: this.page.view.tracks[track].scene.slots[slot].id, ...fields });
  }

  switchSelected() {
    const { view } = this.page, { track, slot } = view.selected;
    this.withSelected("switch", slot === null ? {} : { on: !this.isActive(track, slot) });
  }

  isActive(track, slot) {
    const frame = this.page.view.frameOf(track);
    return Boolean(frame && frame.plain.flags[slot] & 2);
  }

  // Where an event is: the track, pixels of the screen from the corner of its canvas, and a place of the arena.
  where(event, t = this.page.view.tracks.findIndex(({ canvas }) => canvas === event.target)) {
    const { arena, canvas } = this.page.view.tracks[t] || {};
    if (!arena) return null;
    const box = canvas.getBoundingClientRect(), px = event.clientX - box.left, py = event.clientY - box.top;
    const [x, y] = arena.toArena(px * arena.ratio, py * arena.ratio);
    const reach = (event.pointerType === "touch" ? 26 : 14) * arena.ratio;
    return { t, px, py, x: FOUR(x), y: FOUR(y), slot: arena.nearest(px * arena.ratio, py * arena.ratio, reach) };
  }

  begin(event) {
    if (this.tool === "look" || event.button || this.held) return;
    const at = this.where(event);
    if (!at) return;
    event.stopPropagation();
    event.preventDefault();
    this.page.controls.clickedIn(at.t);
    const track = this.page.view.tracks[at.t], id = at.slot === null ? null : track.scene.slots[at.slot].id;
    this.held = { ...at, id, pointer: event.pointerId, way: [[at.px, at.py]], last: at, shape: this.overlay(track) };
    event.target.setPointerCapture(event.pointerId);
  }

  go(event) {
    const { held } = this;
    if (!held || event.pointerId !== held.pointer) return;
    event.stopPropagation();
    const at = this.where(event, held.t);
    held.last = at;
    held.way.push([at.px, at.py]);
    this.draw(held, at);
  }

  end(event) {
    const { held, tool } = this;
    if (!held || event.pointerId !== held.pointer) return;
    event.stopPropagation();
    this.cancel();
    const at = this.where(event, held.t), isDrag = Math.hypot(at.px - held.px, at.py - held.py) >= SHORTEST_DRAG;
    const place = { x: at.x, y: at.y }, corners = [[held.x, held.y], [at.x, held.y], [at.x, at.y], [held.x, at.y]];
    if (tool === "add") return this.add(held.t, place);
    if (["circle", "rectangle"].includes(tool) && !isDrag) return this.page.controls.alert("Drag to draw an obstacle.");
    if (tool === "circle") return this.send("obstruct", held.t, { shape: "circle", points: [corners[0], corners[2]] });
    if (tool === "rectangle") return this.send("obstruct", held.t, { shape: "polygon", points: corners });
    if (tool === "polygon") return this.sendPolygon(held);
    if (held.id === null) return this.page.controls.alert("No body is there.");
    if (tool === "move") return isDrag ? this.send("move", held.t, { body: held.id, ...place }) : undefined;
    return this.send(tool, held.t, { body: held.id, ...(tool === "switch" ? { on: !this.isActive(held.t, held.slot) } : {}) });
  }

  sendPolygon(held) {
    const { arena } = this.page.view.tracks[held.t];
    let off = CORNER_OFF, corners = simplified(held.way, off);
    while (corners.length > MOST_CORNERS) corners = simplified(held.way, off *= 1.5);
    const [first, last] = [corners[0], corners[corners.length - 1]];
    if (Math.hypot(first[0] - last[0], first[1] - last[1]) < 2 * CORNER_OFF) corners = corners.slice(0, -1);
    if (corners.length < 3) return this.page.controls.alert("Draw the rim of an obstacle: a closed line with some room inside.");
    const points = corners.map(([px, py]) => arena.toArena(px * arena.ratio, py * arena.ratio).map(FOUR));
    return this.send("obstruct", held.t, { shape: "polygon", points });
  }

  cancel() {
    if (!this.held) return;
    this.held.shape.parentElement.remove();
    this.held = null;
  }

  overlay({ canvas }) {
    const drawing = document.createElementNS(SVG, "svg"), shape = document.createElementNS(SVG, "path");
    drawing.setAttribute("class", "tl-overlay");
    drawing.setAttribute("aria-hidden", "true");
    drawing.append(shape);
    canvas.parentElement.append(drawing);
    return shape;
  }

  // What would be done.
  draw(held, at) {
    const circle = (x, y, r) => `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`;
    const paths = {
      move: () => (held.id === null ? "" : `M${held.px} ${held.py}L${at.px} ${at.py}${circle(at.px, at.py, 8)}`),
      circle: () => circle(held.px, held.py, Math.hypot(at.px - held.px, at.py - held.py)),
      rectangle: () => `M${held.px} ${held.py}H${at.px}V${at.py}H${held.px}Z`,
      polygon: () => `M${held.way.map(([x, y]) => `${x} ${y}`).join("L")}Z`,
    };
    held.shape.setAttribute("d", (paths[this.tool] || (() => ""))());
  }

  async showCopy({ form, text: copied, said: missing }) {
    const text = form === "link" ? `${location.origin}${location.pathname}${location.search}#${copied}` : copied;
    if (form === "link" && location.search) missing.push("It has the token of this page: who has it can open the page.");
    this.text.value = text;
    this.text.classList.toggle("tl-wrapped", form === "link");
    setText(this.dialog.querySelector("h2"), `Copy as ${form}`);
    let said = "Copied.";
    try { await navigator.clipboard.writeText(text); } catch { said = "The browser does not let this page copy; press Ctrl-C."; }
    setText(this.said, [said, ...missing].join(" "));
    if (!this.dialog.open) this.dialog.showModal();
    this.text.focus();
    this.text.select();
  }
}

// Part: start.

// The task, and worlds to begin with.
class Start {
  constructor(page, element) {
    Object.assign(this, { page, element, shown: "" });
  }

  show({ task, tasks, presets, study }) {
    const key = JSON.stringify([task, tasks, presets, study]), { page } = this;
    if (key === this.shown) return;
    this.shown = key;
    const select = make("select", { id: "tl-task" }, ...tasks.map((name) => make("option", { value: name }, name)));
    select.value = task;
    select.addEventListener("change", () => {
      page.controls.alert("");
      page.link.send("task", { name: select.value });
    });
    const buttons = presets.map((name) => page.controls.button(name, `${name}: two worlds on the same noise`, () => page.link.send("preset", { name })));
    this.element.replaceChildren(
      make("div", { class: "tl-field" }, make("label", { for: "tl-task", title: "Another task, under the same seed" }, "task"), select),
      ...(study ? [this.buildRow(this.element.querySelector("#tl-study")?.value)] : []),
      make("div", { class: "tl-row tl-presets", role: "group", "aria-label": "Presets" }, ...buttons));
    document.title = `teamsight: ${task}`;
    page.view.title = document.title;
    page.view.heading.title = document.title;
    setText(page.view.heading, document.title);
  }

  // A run of the study that the command named.
  buildRow(typed = "") {
    const { page } = this, run = make("input", { type: "text", id: "tl-study", placeholder: "0123456789abcdef-7", spellcheck: "false", value: typed });
    const send = () => {
      page.controls.alert("");
      page.link.send("row", { run: run.value.trim() });
    };
    run.addEventListener("keydown", (event) => { if (event.key === "Enter") send(); });
    return make("div", {}, make("div", { class: "tl-field" }, make("label", { for: "tl-study" }, "run of the study"), run),
      make("div", { class: "tl-row" }, page.controls.button("Show this run", "Starts the run of the study that has this id", send)));
  }
}

// Part: address.

// The task, the settings, the seed, the tick and the interventions after the # of the address; the server writes and reads it.
const MOST_LINK = 4000, ADDRESS_PAUSE = 500;

class Address {
  constructor(page) {
    Object.assign(this, { page, isOpen: false, isReady: false, timer: 0 });
    // A page that is loaded again shows what runs; only who comes by a link wants to go there.
    const [visit] = performance.getEntriesByType("navigation");
    this.wanted = !visit || visit.type === "navigate" ? location.hash.slice(1) : "";
    addEventListener("hashchange", () => { this.wanted = location.hash.slice(1); this.open(); });
  }

  ready() {
    this.isReady = true;
    this.open();
  }

  // Goes where the address leads, once the server can.
  open() {
    if (!this.isReady) return;
    this.isOpen = true;
    const { wanted } = this;
    this.wanted = "";
    if (wanted.length > MOST_LINK) this.page.fail(`This link cannot be opened: it has ${wanted.length.toLocaleString("en")} characters, at most ${MOST_LINK.toLocaleString("en")}. The page goes on with what ran.`);
    else if (wanted) this.page.link.send("open", { link: wanted });
    this.soon();
  }

  soon() {
    if (!this.isOpen || this.timer) return;
    this.timer = setTimeout(() => { this.timer = 0; this.show(); }, ADDRESS_PAUSE);
  }

  // The address of what is shown; while it runs, that of its beginning changes with the controls only.
  show() {
    const { state } = this.page;
    if (!state || state.goal || this.wanted) return;
    const hash = `#${state.link}`;
    if (hash !== location.hash) history.replaceState(null, "", `${location.pathname}${location.search}${hash}`);
  }
}

// Part: page.

class Page {
  constructor(root) {
    const view = new View(root, { live: true, title: document.title });
    Object.assign(this, { view, run: null, state: null, isResting: false, hasAsked: false, transport: { running: false } });
    this.banner = make("div", { class: "tl-banner", role: "status", hidden: true }, "Reconnecting …");
    root.prepend(this.banner);
    this.waiting = make("p", { class: "tl-waiting", role: "status", hidden: true });
    view.stage.append(this.waiting);
    this.controls = new Controls(this, view.slot("controls"));
    this.graph = new Graph(this, view.slot("graph"));
    this.log = new Log(view.slot("log"));
    this.laboratory = new Laboratory(this, this.controls.lab);
    this.address = new Address(this);
    this.start = new Start(this, this.controls.start);
    Object.assign(this.transport, { play: () => this.play(), pause: () => this.pause(), step: (count) => this.step(count) });
    view.transport = this.transport;
    view.onselect = ({ track, slot }) => {
      if (slot !== null) this.controls.clickedIn(track);
      this.graph.soon();
    };
    this.watchPosition();
    this.link = new Link(this);
    // Left as it is, the browser may keep a copy of the page with a socket that is dead.
    addEventListener("pageshow", (event) => { if (event.persisted) this.link.hurry(); });
  }

  // The graph follows the frame that is shown, whoever chose it.
  watchPosition() {
    const { view } = this, draw = view.draw.bind(view);
    view.draw = (...times) => { draw(...times); this.graph.soon(); this.showRest(); };
  }

  runOrPause() {
    if (this.transport.running) return this.pause();
    // Who runs the model wants to see it.
    this.view.show(this.view.frameCount - 1);
    return this.startRun();
  }

  play() {
    if (!this.view.following) return false;
    return this.startRun();
  }

  startRun() {
    this.hasAsked = true;
    // A model that fails again at once says nothing new, so what it said stays.
    if (!this.state?.failed) this.controls.alert("");
    return this.link.send("run");
  }

  // A run that this page has not asked for moves nothing here, if the system asks for reduced motion; others see it move.
  restOrFollow(isRunning) {
    const { view } = this;
    if (!isRunning) {
      if (this.isResting) view.show(view.frameCount - 1);
      this.isResting = this.hasAsked = false;
    } else if (!this.transport.running && !this.hasAsked && view.following && matchMedia("(prefers-reduced-motion: reduce)").matches) {
      this.isResting = true;
      view.following = false;
    }
  }

  follow() {
    this.hasAsked = true;
    this.view.show(this.view.frameCount - 1);
    this.view.play();
  }

  showRest() {
    if (this.isResting && this.view.following) this.isResting = false;
    this.controls.rest.hidden = !this.isResting;
  }

  saveCharts() {
    const { view } = this;
    if (!view.times.length) return this.fail("Nothing is there yet to save; let the worlds run first.");
    const name = view.title.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "");
    return view.download(new Blob([view.csv()], { type: "text/csv" }), `${name || "charts"}.csv`);
  }

  pause() { return this.link.send("pause"); }

  step(count = 1) {
    const { view } = this;
    if (count < 0 || !view.following) {
      if (this.transport.running) this.link.send("pause");
      return false;
    }
    this.controls.alert("");
    return this.link.send("step");
  }

  connected(isOpen) {
    this.banner.hidden = isOpen;
    this.view.slot("controls").inert = !isOpen;
    document.documentElement.dataset.connected = String(isOpen);
    if (!isOpen) {
      this.setRunning(false);
      // What the server does now is not known.
      if (this.state) this.controls.showState({ ...this.state, running: false });
      this.controls.saved();
      this.controls.film.end("The connection was lost; make it again.");
    }
  }

  fail(text) { this.controls.alert(text); }

  setRunning(isRunning) {
    const { view, transport } = this;
    if (transport.running === isRunning) return;
    transport.running = isRunning;
    // Somebody who looks at the past is left there.
    if (!view.following) view.showState();
    else if (isRunning) view.play();
    else view.pause();
  }

  on_scene({ track, tracks, run, scene }) {
    const { view } = this;
    if (run !== this.run) {
      this.run = run;
      this.controls.showBand({ runs: 0 });
      if (this.controls.film.isOpen && !this.controls.film.isBusy) this.controls.film.askNewest();
      for (let i = view.tracks.length - 1; i >= 0; i--) {
        if (i >= tracks) view.removeTrack(i);
        else view.clear(i);
      }
      view.following = !this.isResting;
    }
    view.setScene(track, scene);
    this.laboratory.describe(view.tracks[0].scene);
    this.graph.key = "";
  }

  onFrame(track, block) {
    const { view } = this;
    // A frame on its way while the worlds were built anew.
    if (view.tracks[track]) view.append(track, decodeFrame(block, view.tracks[track].scene));
  }

  on_state(state) {
    // Until the first worlds are compiled there is nothing else to show but where their bodies start.
    this.waiting.hidden = state.tracks.length > 0;
    setText(this.waiting, state.tracks.length ? "" : state.busy);
    this.view.slot("controls").inert = !state.tracks.length;
    if (!state.tracks.length) return;
    // Also on a page that is opened later.
    if (state.failed && !(this.state && this.state.failed)) this.fail(state.note);
    // Somebody has started again, maybe on another page.
    if (!state.failed && this.state && this.state.failed && this.controls.alertText.textContent === this.state.note) this.fail("");
    this.state = state;
    this.restOrFollow(state.running);
    this.setRunning(state.running);
    this.showRest();
    this.controls.showState(state);
    this.start.show(state);
    this.address.soon();
    this.graph.soon();
  }

  on_controls(message) {
    this.controls.describe(message);
    this.address.ready();
  }

  on_events({ tracks }) { this.log.show(tracks); }

  on_error({ message }) {
    // The task that holds is chosen again.
    this.start.shown = "";
    if (this.state && this.state.tasks) this.start.show(this.state);
    this.controls.saved();
    // What was refused gives way to what holds.
    this.controls.touched.clear();
    this.controls.chartsKey = "";
    if (this.state) this.controls.showCharts(this.state);
    this.controls.showValues();
    this.fail(message);
    const { film } = this.controls;
    if (film.isOpen) film.fail(message);
    if (message.startsWith("film: ")) film.end();
  }

  on_copied(message) { this.laboratory.showCopy(message); }

  on_band(message) { this.controls.showBand(message); }

  on_reel(message) { this.controls.film.describe(message); }
  on_filming({ done, frames }) { this.controls.film.work(done, frames); }
  on_cancelled() { this.controls.film.end("Cancelled."); }

  on_film({ name, content }) {
    const bytes = Uint8Array.from(atob(content), (one) => one.charCodeAt(0));
    this.controls.film.end(`Saved: ${megabytes(bytes.length)}.`);
    this.view.download(new Blob([bytes], { type: name.endsWith(".mp4") ? "video/mp4" : "image/gif" }), name);
  }

  on_recording({ name, html }) {
    this.controls.saved();
    this.view.download(new Blob([html], { type: "text/html" }), name);
  }
}

window.teamsight.live = new Page(document.getElementById("teamsight"));
window.teamsight.view = window.teamsight.live.view;

})();
