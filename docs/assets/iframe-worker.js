// Browsers start no workers for pages opened from a folder. There, the search of the theme runs in a hidden frame.
// The theme looks for the name IFrameWorker.
(function () {
  "use strict";
  if (location.protocol !== "file:") return;
  const prelude = "self.postMessage = (data) => parent.postMessage(data, '*');" +
    "self.importScripts = () => Promise.resolve();";
  class IFrameWorker extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.appendChild(frame);
      this.frame = frame.contentWindow;
      const page = frame.contentDocument;
      page.open();
      page.write("<!doctype html><html><body><script>" + prelude + "<\/script></body></html>");
      page.close();
      const script = page.createElement("script");
      this.waiting = [];
      script.onload = () => {
        for (const data of this.waiting) this.send(data);
        this.waiting = null;
      };
      script.onerror = () => this.dispatchEvent(new ErrorEvent("error", {message: "cannot load " + url}));
      script.src = String(url);
      page.body.appendChild(script);
      addEventListener("message", (event) => {
        if (event.source !== this.frame) return;
        const copy = new MessageEvent("message", {data: event.data});
        if (this.onmessage) this.onmessage(copy);
        this.dispatchEvent(copy);
      });
    }
    send(data) {
      this.frame.dispatchEvent(new MessageEvent("message", {data}));
    }
    postMessage(data) {
      if (this.waiting) this.waiting.push(data);
      else this.send(data);
    }
    terminate() {
      this.frame.frameElement.remove();
    }
  }
  window.IFrameWorker = window.Worker = IFrameWorker;
})();
