// Recordings in a page take the height of what they show, and the colours of the site.
"use strict";

(() => {

const frames = [...document.querySelectorAll('iframe[src^="gallery/"]')];

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

})();
