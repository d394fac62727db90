// Recordings that differ in one number: a slider chooses which is shown, and the tick stays. A page of the site has this
// after view.js, and their data in an element #runs: {label, values, runs}.
"use strict";

(async () => {

const { View, decodeReplay } = window.teamsight, root = document.getElementById("teamsight");
const make = (tag, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};

// The observed fraction of a run, and the largest number of neighbours of any robot: of all steps, less the start.
function measured({ series }, frames) {
  const [observed, most] = ["observed", "max_neighbours"].map((name) => series.indexOf(name)), after = frames.slice(1);
  const mean = after.reduce((sum, frame) => sum + frame.value(observed), 0) / after.length;
  return { observed: mean, most: Math.max(...after.map((frame) => frame.value(most))) };
}

function start({ label, values, runs }, frames) {
  const view = new View(root), facts = runs.map(({ scene }, k) => measured(scene, frames[k]));
  window.teamsight.view = view;
  const steps = frames[0].length - 1;
  const slider = make("input", { type: "range", min: 0, max: values.length - 1, step: 1, ariaLabel: label });
  const row = (name, cell) => make("tr", {}, make("th", { scope: "row" }, name), ...values.map((_, k) => cell(k)));
  const bar = ({ observed }) => {
    const element = make("i");
    element.style.height = `${(40 * observed).toFixed(1)}px`;
    return element;
  };
  const table = make("table", {},
    make("caption", { className: "ts-hidden" }, `What changes with ${label}`),
    make("thead", {}, row(label, (k) => make("th", { scope: "col" }, values[k]))),
    make("tbody", {},
      row(`Observed in ${steps} steps`, (k) => make("td", {}, bar(facts[k]), `${(100 * facts[k].observed).toFixed(1)} %`)),
      row("Most neighbours", (k) => make("td", {}, `${facts[k].most}`))));
  const panel = make("section", { className: "ts-choice" }, slider, table);
  panel.style.setProperty("--columns", values.length);
  root.querySelector(".ts-body").before(panel);

  function choose(k) {
    const { at, playing, speed } = view;
    view.pause();
    view.setScene(0, runs[k].scene);
    view.tracks[0].frames = frames[k];
    view.refreshTimes();
    view.fitDomain();
    view.redrawCharts();
    view.show(at);
    view.at = at;
    view.speed = speed;
    if (playing) view.play();
    slider.value = k;
    const { observed, most } = facts[k];
    slider.ariaValueText = `${label} = ${values[k]}: ${(100 * observed).toFixed(1)} % observed, at most ${most} neighbours`;
    for (const one of table.rows) [...one.cells].slice(1).forEach((cell, c) => cell.classList.toggle("ts-chosen", c === k));
  }
  slider.addEventListener("input", () => choose(Number(slider.value)));
  table.addEventListener("click", ({ target }) => {
    const cell = target.closest("td, thead th[scope=col]");
    if (cell) choose(cell.cellIndex - 1);
  });
  choose(Math.floor(values.length / 2));
  for (const chart of view.charts) chart.resize();
  view.select(0, 0);
  view.say();
  root.dataset.state = "ready";
  if (matchMedia("(prefers-reduced-motion: reduce)").matches) view.showState(); else view.play();
}

root.dataset.state = "loading";
try {
  const data = JSON.parse(document.getElementById("runs").textContent);
  start(data, await Promise.all(data.runs.map(({ scene, frames }) => decodeReplay(frames, scene))));
} catch (error) {
  root.dataset.state = "error";
  root.replaceChildren(make("p", { className: "ts-error", role: "alert" }, `The recordings cannot be shown: ${error.message}.`));
}

})();
