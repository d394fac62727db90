// Recordings in a page take the height of what they show, and the colours of the site; the cards of the gallery have a
// filter.
"use strict";

(() => {

const frames = [...document.querySelectorAll("iframe[title]")];

function send(frame) {
  const scheme = document.body.getAttribute("data-md-color-scheme") === "slate" ? "dark" : "light";
  frame.contentWindow.postMessage({ teamsight: { scheme } }, "*");
}

addEventListener("message", ({ source, data }) => {
  const frame = frames.find((one) => one.contentWindow === source), height = data && data.teamsight && data.teamsight.height;
  // With its border.
  if (frame && Number.isFinite(height)) frame.style.height = `${height + frame.offsetHeight - frame.clientHeight}px`;
});
for (const frame of frames) {
  // It may have loaded before this script.
  frame.addEventListener("load", () => send(frame));
  send(frame);
}
new MutationObserver(() => frames.forEach(send)).observe(document.body, { attributeFilter: ["data-md-color-scheme"] });

// Part: the filter.

const grid = document.querySelector(".ts-cards"), cards = [...document.querySelectorAll(".ts-card")];
const wordsOf = (card) => card.querySelector("small").textContent.split(" · ");

function make(tag, properties, ...children) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
}

function buildFilter() {
  const counts = new Map();
  for (const word of cards.flatMap(wordsOf)) counts.set(word, (counts.get(word) || 0) + 1);
  // A word of one card would be its title again.
  const words = [...counts].filter(([, count]) => count > 1).sort((a, b) => b[1] - a[1]).map(([word]) => word);
  const field = make("input", { type: "search", placeholder: "Filter: torus, failures …", ariaLabel: "Filter the recordings" });
  const chips = words.map((word) => make("button", { type: "button", textContent: word, ariaPressed: "false" }));
  const status = make("p", { role: "status" });

  function show() {
    const typed = field.value.toLowerCase().split(/\s+/).filter(Boolean);
    const pressed = chips.filter((chip) => chip.ariaPressed === "true").map((chip) => chip.textContent);
    for (const card of cards) {
      const text = card.textContent.toLowerCase(), its = wordsOf(card);
      card.hidden = !(typed.every((word) => text.includes(word)) && pressed.every((word) => its.includes(word)));
    }
    const left = cards.filter((card) => !card.hidden).length;
    status.textContent = left ? `${left} of ${cards.length} recordings` : "No recording has all these words; take one out.";
  }
  field.addEventListener("input", show);
  for (const chip of chips) {
    chip.addEventListener("click", () => {
      chip.ariaPressed = String(chip.ariaPressed !== "true");
      show();
    });
  }
  const group = make("div", { role: "group", ariaLabel: "Words" }, ...chips);
  grid.before(make("search", { className: "ts-filter" }, field, group, status));
  show();
}

// Without a pointer that hovers, the card in the middle of the screen plays, once.
function playInView() {
  const seen = new IntersectionObserver((changes) => {
    for (const { target, isIntersecting } of changes) target.classList.toggle("ts-seen", isIntersecting);
  }, { rootMargin: "-40% 0px" });
  for (const card of cards) seen.observe(card);
}

if (cards.length) {
  buildFilter();
  if (matchMedia("(hover: none)").matches) playInView();
}

})();

// Code and tables that are wider than the page scroll by keyboard, too. The theme sets and removes the attribute of code.
addEventListener("load", () => setTimeout(() => {
  for (const code of document.querySelectorAll("pre > code")) code.tabIndex = 0;
  const boxes = [...document.querySelectorAll(".md-typeset__scrollwrap")];
  const names = new Map();
  const reach = new ResizeObserver((changes) => {
    for (const { target } of changes) {
      // A stop of the keyboard only where there is something to scroll.
      const wide = target.scrollWidth > target.clientWidth;
      for (const [name, value] of [["tabindex", "0"], ["role", "region"], ["aria-label", names.get(target)]]) {
        if (wide) target.setAttribute(name, value);
        else target.removeAttribute(name);
      }
    }
  });
  boxes.forEach((box, number) => {
    const heads = [...box.querySelectorAll("th")].slice(0, 2).map((head) => head.textContent.trim()).filter(Boolean);
    names.set(box, `Table ${number + 1}: ${heads.join(", ")} …`);
    reach.observe(box);
  });
  document.documentElement.dataset.reach = "set";
}, 500));
