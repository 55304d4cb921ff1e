// Asks for the page again and again, and replaces the changed parts. Without this script the page is complete, but static.
"use strict";
(() => {
  const root = document.documentElement;
  const every = Number(root.dataset.every) || 2000;
  root.dataset.problems = "";
  const problem = (text) => { root.dataset.problems += text + "; "; };
  addEventListener("error", (e) => problem(String(e.message)));
  addEventListener("securitypolicyviolation", (e) => problem("blocked: " + e.blockedURI + " " + e.violatedDirective));
  let asked = 0;
  const look = async () => {
    try {
      const answer = await fetch(location.pathname, { cache: "no-store", signal: AbortSignal.timeout(8000) });
      if (!answer.ok) throw new Error(await answer.text());
      const fresh = new DOMParser().parseFromString(await answer.text(), "text/html");
      for (const block of fresh.querySelectorAll("[data-block]")) {
        const old = document.getElementById(block.id);
        if (!old) { location.reload(); return; }
        if (!old.isEqualNode(block)) old.replaceWith(document.adoptNode(block));
      }
      document.title = fresh.title;
      root.dataset.asked = String(asked += 1);
      delete root.dataset.silent;
    } catch {
      // The last known state stays, and is said to be old.
      root.dataset.silent = "true";
    }
    root.dataset.overflow = String(Math.max(0, root.scrollWidth - root.clientWidth));
    setTimeout(look, every);
  };
  setTimeout(look, every);
})();
