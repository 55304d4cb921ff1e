// Before anything is painted: the theme of last time, or the system's. A file's storage may be refused.
(function () {
  let theme = null;
  try { theme = localStorage.getItem("trueline-theme"); } catch { /* then the system's */ }
  document.documentElement.dataset.theme = theme || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  window.problems = [];
  addEventListener("error", (e) => problems.push(String(e.message)));
  addEventListener("unhandledrejection", (e) => { problems.push(String(e.reason)); document.documentElement.dataset.problems = problems.join("; "); });
  addEventListener("securitypolicyviolation", (e) => problems.push("blocked: " + e.blockedURI));
})();
