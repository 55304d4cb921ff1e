"use strict";
// Common parts of all charts of the report: theme, zoom by dragging, keyboard, print; and a view in space on a plain canvas.
const Charts = (function () {
  const all = [];
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const narrow = () => innerWidth < 600;
  const show = (v) => (v == null || Number.isNaN(v) ? "–" : typeof v === "number" ? String(+v.toPrecision(4)) : v);

  // Every colour of the page comes from the style sheet; the theme is rebuilt when the style sheet's values change.
  function theme() {
    const ink = css("--ink"), soft = css("--soft"), rule = css("--rule"), card = css("--card");
    const axis = {
      axisLine: { show: true, onZero: false, lineStyle: { color: soft } }, axisTick: { show: true, lineStyle: { color: soft } },
      axisLabel: { color: ink }, nameTextStyle: { color: ink },
      splitLine: { show: true, lineStyle: { color: rule } }, minorSplitLine: { lineStyle: { color: rule, opacity: 0.45 } },
    };
    const category = { ...axis, splitLine: { show: false } };
    return {
      color: ["--a", "--b", "--c", "--bad", "--d"].map(css),
      backgroundColor: "transparent",
      textStyle: { color: ink, fontFamily: "system-ui, sans-serif" },
      valueAxis: axis, logAxis: axis, categoryAxis: category,
      legend: { textStyle: { color: ink }, inactiveColor: soft, pageTextStyle: { color: ink }, pageIconColor: ink, pageIconInactiveColor: rule },
      tooltip: { backgroundColor: card, borderColor: soft, textStyle: { color: ink } },
      visualMap: { textStyle: { color: ink } },
      axisPointer: { lineStyle: { color: soft }, crossStyle: { color: soft } },
    };
  }

  const base = () => ({
    animation: false,
    legend: { type: "plain", top: 0, left: 0, itemGap: 12, itemWidth: 16, itemHeight: 9 }, // v6 puts the legend at the bottom by default, over the axis name
    grid: { left: 70, right: 18, top: 30, bottom: 46, outerBoundsMode: "none" }, // v6 shrinks the grid to fit labels by default
    tooltip: { trigger: "item", confine: true, transitionDuration: 0, enterable: false },
  });
  const tickText = (v) => String(+v.toPrecision(6)); // no thousands separators
  const axis = (name, extra) => Object.assign({ type: "value", name, nameLocation: "middle", nameGap: 28, nameMoveOverlap: false, scale: true, axisLabel: { hideOverlap: true, formatter: tickText } }, extra);
  const yAxis = (name, extra) => axis(name, { nameGap: 54, ...extra });
  // Zooming: drag a rectangle, Ctrl + wheel, pinch; the wheel alone scrolls the page.
  const zoom = () => ({
    dataZoom: [
      { type: "inside", xAxisIndex: "all", filterMode: "none", zoomOnMouseWheel: "ctrl", moveOnMouseMove: false, moveOnMouseWheel: false, preventDefaultMouseMove: false },
      { type: "inside", yAxisIndex: "all", filterMode: "none", zoomOnMouseWheel: "ctrl", moveOnMouseMove: false, moveOnMouseWheel: false, preventDefaultMouseMove: false },
    ],
  });

  // A rectangle drawn with the mouse; flat or narrow ones zoom one axis only. (The toolbox's own rectangle costs a second
  // full render of each chart and has to be switched on again after each change of theme.)
  function dragZoom({ host, chart }) {
    let from = null, mark = null;
    const place = (e) => { const r = host.getBoundingClientRect(); return [e.clientX - r.left, e.clientY - r.top]; };
    const stop = () => { mark?.remove(); mark = from = null; };
    host.addEventListener("pointerdown", (e) => { const p = place(e); if (e.button === 0 && e.pointerType === "mouse" && chart.containPixel("grid", p)) from = p; });
    host.addEventListener("pointermove", (e) => {
      if (!from) return;
      const p = place(e);
      if (!mark) {
        if (Math.hypot(p[0] - from[0], p[1] - from[1]) < 6) return;
        host.setPointerCapture(e.pointerId);
        chart.dispatchAction({ type: "hideTip" });
        mark = document.createElement("div");
        mark.className = "mark";
        host.append(mark);
      }
      const [x, y] = [0, 1].map((k) => Math.min(p[k], from[k])), [w, h] = [0, 1].map((k) => Math.abs(p[k] - from[k]));
      mark.style.cssText = `left:${x}px;top:${y}px;width:${w}px;height:${h}px`;
    });
    host.addEventListener("pointerup", (e) => {
      if (mark) {
        const p = place(e), a = chart.convertFromPixel("grid", from), b = chart.convertFromPixel("grid", p), batch = [];
        for (const k of [0, 1]) if (Math.abs(p[k] - from[k]) > 10) batch.push({ dataZoomIndex: k, startValue: Math.min(a[k], b[k]), endValue: Math.max(a[k], b[k]) });
        if (batch.length) chart.dispatchAction({ type: "dataZoom", batch });
      }
      stop();
    });
    host.addEventListener("pointercancel", stop);
  }

  function add(id, aria, build, keys) {
    const host = document.getElementById(id);
    const live = host.parentElement.querySelector(".live");
    const chart = echarts.init(host, theme());
    const item = { host, chart, build, live };
    all.push(item);
    chart.setOption(build());
    host.tabIndex = 0;
    const canZoom = !!chart.getOption().dataZoom?.length;
    const reset = () => canZoom && (chart.dispatchAction({ type: "dataZoom", batch: chart.getOption().dataZoom.map((_, dataZoomIndex) => ({ dataZoomIndex, start: 0, end: 100 })) }));
    const scale = (f) => canZoom && (chart.dispatchAction({ type: "hideTip" }), chart.dispatchAction({ type: "dataZoom", batch: chart.getOption().dataZoom.slice(0, 2).map((z, dataZoomIndex) => {
      const mid = (z.start + z.end) / 2, half = Math.min(50, (z.end - z.start) / 2 * f);
      const start = Math.max(0, Math.min(100 - 2 * half, mid - half));
      return { dataZoomIndex, start, end: start + 2 * half };
    }) }));
    Object.assign(item, { reset, scale });
    if (canZoom) dragZoom(item);
    // The wheel alone scrolls the page: ECharts swallows it over a chart with an inside zoom, even with zoomOnMouseWheel "ctrl".
    host.addEventListener("wheel", (e) => { if (!e.ctrlKey) e.stopPropagation(); }, { capture: true });
    host.addEventListener("dblclick", () => (item.onreset || reset)());
    host.parentElement.querySelector("[data-reset]")?.addEventListener("click", () => (item.onreset || reset)());

    // Keyboard: one point after the other of the series that is not silent.
    const heard = () => chart.getModel().getSeries().filter((m) => !m.get("silent"));
    let series = 0, index = -1;
    const count = () => heard()[series].getData().count();
    const step = (by, to) => {
      const model = heard()[series], data = model.getData();
      index = Math.max(0, Math.min(data.count() - 1, to ?? index + by));
      const value = data.dimensions.slice(0, 3).map((d) => data.get(d, index));
      // Large scatters have no element for each point and lines are sampled: there the tip is asked for by place.
      if (data.getItemGraphicEl(index) && model.subType !== "line") chart.dispatchAction({ type: "showTip", seriesIndex: model.seriesIndex, dataIndexInside: index });
      else { const [x, y] = chart.convertToPixel({ seriesIndex: model.seriesIndex }, value); chart.dispatchAction({ type: "showTip", x, y }); }
      live.textContent = item.say ? item.say(value) : `${model.name}: ${value.filter((v) => v != null).map(show).join(", ")}`;
    };
    const other = (by) => { const n = heard().length; series = (series + by + n) % n; step(0, Math.max(0, index)); };
    const map = {
      ArrowRight: () => step(1), ArrowLeft: () => step(-1), PageDown: () => step(Math.ceil(count() / 20)), PageUp: () => step(-Math.ceil(count() / 20)),
      Home: () => step(0, 0), End: () => step(0, count() - 1), ArrowUp: () => other(-1), ArrowDown: () => other(1),
      "+": () => scale(0.7), "=": () => scale(0.7), "-": () => scale(1 / 0.7), 0: () => (item.onreset || reset)(),
      Enter: () => { if (index >= 0) item.enter?.(heard()[series].seriesIndex, index); },
      Escape: () => { chart.dispatchAction({ type: "hideTip" }); index = -1; live.textContent = ""; },
      ...keys?.(item),
    };
    host.addEventListener("keydown", (e) => {
      if (e.ctrlKey || e.metaKey || e.altKey || !map[e.key]) return;
      map[e.key]();
      e.preventDefault();
    });
    return item;
  }

  // Width changes: one observer for all charts.
  const sizes = new ResizeObserver((entries) => {
    for (const { target } of entries) { const item = all.find((i) => i.host === target); if (item && target.clientWidth && (target.clientWidth !== item.chart.getWidth() || target.clientHeight !== item.chart.getHeight())) { item.onresize?.(); item.chart.resize(); } }
  });

  function setTheme(name) {
    document.documentElement.dataset.theme = name;
    try { localStorage.setItem("trueline-theme", name); } catch { /* file:// may refuse */ }
    recolour();
  }
  function recolour() {
    for (const item of all) {
      const zooms = item.chart.getOption().dataZoom?.map((z, dataZoomIndex) => ({ dataZoomIndex, start: z.start, end: z.end }));
      item.chart.setTheme(theme()); // resets the zoom: put back below
      item.chart.setOption(item.build()); // colours that build() took from the style sheet
      if (zooms?.length) item.chart.dispatchAction({ type: "dataZoom", batch: zooms });
    }
  }

  // Print: always light, each chart drawn afresh at the width of the paper: as vectors, or at three times the resolution
  // where vectors would be too many. (renderToCanvas() of the chart on screen loses the points of a `large` scatter below size 4.)
  let before = null;
  function beforePrint() {
    if (before) return;
    before = document.documentElement.dataset.theme;
    document.documentElement.dataset.theme = "light";
    for (const item of all) {
      const width = Math.min(720, item.chart.getWidth()), height = Math.round(Math.min(item.chart.getHeight(), width * 0.9));
      const points = item.chart.getModel().getSeries().reduce((n, m) => n + m.getData().count(), 0), svg = points < 3000;
      const paper = echarts.init(svg ? null : document.createElement("div"), theme(), svg ? { renderer: "svg", ssr: true, width, height } : { renderer: "canvas", width, height, devicePixelRatio: 3 });
      paper.setOption(item.build({ width, height }));
      const zooms = item.chart.getOption().dataZoom?.map((z, dataZoomIndex) => ({ dataZoomIndex, start: z.start, end: z.end }));
      if (zooms?.length) paper.dispatchAction({ type: "dataZoom", batch: zooms });
      const out = document.createElement("div");
      out.className = "print";
      if (svg) out.innerHTML = paper.renderToSVGString({ useViewBox: true });
      else {
        paper.getZr().flush();
        out.append(paper.renderToCanvas({ pixelRatio: 3, backgroundColor: "#fff" }));
        out.firstChild.removeAttribute("style"); // it comes positioned absolutely
      }
      item.host.append(out);
      paper.dispose();
    }
  }
  function afterPrint() {
    for (const out of document.querySelectorAll(".print")) out.remove();
    if (before) document.documentElement.dataset.theme = before;
    before = null;
  }
  addEventListener("beforeprint", beforePrint);
  addEventListener("afterprint", afterPrint);

  // --- 3-D: orthographic projection to ordinary line and scatter series. No WebGL; equal aspect by construction. ---
  function view3d(id, aria, scene, palette) {
    let yaw = -0.7, pitch = 0.45, zoomed = 1, item;
    const box = [0, 1, 2].map((k) => {
      let lo = Infinity, hi = -Infinity;
      for (const s of scene) for (let i = k; !s.beyond && i < s.xyz.length; i += 3) { if (s.xyz[i] < lo) lo = s.xyz[i]; if (s.xyz[i] > hi) hi = s.xyz[i]; }
      return [lo, hi];
    });
    // Parts of a film have `each` numbers for every picture; the present picture is drawn.
    let picture = 0;
    const now = (s) => (s.each ? s.xyz.subarray(s.each * picture, s.each * (picture + 1)) : s.xyz);
    const mid = box.map(([lo, hi]) => (lo + hi) / 2);
    const ends = box[0].flatMap((x) => box[1].flatMap((y) => box[2].map((z) => [x, y, z]))).flat();
    function project(xyz, out) {
      const cy = Math.cos(yaw), sy = Math.sin(yaw), cp = Math.cos(pitch), sp = Math.sin(pitch), n = xyz.length / 3;
      out = out || new Float32Array(2 * n);
      for (let i = 0, j = 0; j < 2 * n; i += 3, j += 2) {
        const x = xyz[i] - mid[0], y = xyz[i + 1] - mid[1], z = xyz[i + 2] - mid[2];
        out[j] = cy * x - sy * y;
        out[j + 1] = cp * z + sp * (sy * x + cy * y);
      }
      return out;
    }
    // Frame: the edges of the bounding box that lie behind the scene; ticks where they cover the least of it.
    const nice = (span) => { const p = 10 ** Math.floor(Math.log10(span / 2)); return [5, 2, 1].map((f) => f * p).find((s) => span / s >= 2) || p; };
    const steps = box.map(([lo, hi]) => nice(hi - lo || 1));
    let labels = [];
    function frame() {
      // Depth grows away from the viewer: its gradient in space is (cos p sin yaw, cos p cos yaw, -sin p).
      const away = [Math.cos(pitch) * Math.sin(yaw), Math.cos(pitch) * Math.cos(yaw), -Math.sin(pitch)];
      const near = away.map((g, k) => box[k][g > 0 ? 0 : 1]), far = away.map((g, k) => box[k][g > 0 ? 1 : 0]);
      const line = [], tick = [];
      labels = [];
      for (let a = 0; a < 3; a++) {
        const b = (a + 1) % 3, c = (a + 2) % 3;
        for (const u of box[b]) for (const v of box[c]) {
          if (u === near[b] && v === near[c]) continue; // this edge would lie in front
          const p = [0, 0, 0], q = [0, 0, 0];
          p[a] = box[a][0]; q[a] = box[a][1]; p[b] = q[b] = u; p[c] = q[c] = v;
          line.push(...p, ...q, NaN, NaN, NaN);
        }
        // x and y along the near edges of the floor, z on the upright edge furthest to the left.
        const at = [near[0], near[1], box[2][0]];
        if (a === 2) {
          const corners = [[near[0], far[1]], [far[0], near[1]]].map(([x, y]) => [x, y, Math.cos(yaw) * x - Math.sin(yaw) * y]);
          const [x, y] = corners[0][2] < corners[1][2] ? corners[0] : corners[1];
          at[0] = x; at[1] = y;
        }
        for (let t = Math.ceil(box[a][0] / steps[a]) * steps[a]; t <= box[a][1]; t += steps[a]) {
          const p = [...at]; p[a] = t;
          tick.push(...p); labels.push("xyz"[a] + " " + +t.toFixed(6));
        }
      }
      return [project(line), project(tick)];
    }
    const shown = () => {
      const [edges, ticks] = frame();
      return [{ id: "frame", data: edges }, { id: "ticks", data: ticks }, ...scene.map((s) => ({ id: s.name, data: project(now(s)) }))];
    };
    function range(size) {
      const place = document.getElementById(id), w = size ? size.width : place.clientWidth, h = (size ? size.height : place.clientHeight) - 60;
      // The box about everything fills the place from wherever it is looked at, with room for its labels.
      const seen = project(ends), wide = Math.max(...seen.filter((_, i) => i % 2 === 0).map(Math.abs)), high = Math.max(...seen.filter((_, i) => i % 2).map(Math.abs));
      const k = Math.min((w - 40) / (2 * wide || 1), (h - 40) / (2 * high || 1)) * zoomed, [x, y] = [w / 2 / k, h / 2 / k];
      return { xAxis: { min: -x, max: x }, yAxis: { min: -y, max: y } };
    }
    const build = (size) => {
      const data = shown(), hidden = { type: "value", show: false, splitLine: { show: false } }, r = range(size);
      return {
        ...base(aria),
        legend: { ...base("").legend, data: scene.map((s) => s.name) },
        grid: { left: 0, right: 0, top: 30, bottom: 30, outerBoundsMode: "none" },
        xAxis: { ...hidden, ...r.xAxis }, yAxis: { ...hidden, ...r.yAxis },
        series: [
          { ...data[0], name: "frame", type: "line", showSymbol: false, silent: true, clip: false, lineStyle: { width: 1, color: css("--rule") }, color: css("--rule") },
          { ...data[1], name: "ticks", type: "scatter", silent: true, symbolSize: 3, clip: false, color: css("--soft"),
            label: { show: true, position: "bottom", distance: 2, fontSize: 11, color: css("--soft"), formatter: (p) => labels[p.dataIndex] }, labelLayout: { hideOverlap: true } },
          ...scene.map((s, k) => s.kind === "line"
            ? { ...data[k + 2], name: s.name, type: "line", showSymbol: false, symbol: "none", silent: true, clip: !!s.beyond, color: css(s.colour), lineStyle: { width: s.width || 1.5 } }
            : { ...data[k + 2], name: s.name, type: "scatter", clip: false, large: true, largeThreshold: 0, progressive: 0, symbolSize: s.size || dot(s.xyz.length / 3), color: css(s.colour),
                tooltip: { formatter: (p) => s.tip(p.dataIndex) } }),
        ],
      };
    };
    let waiting = 0;
    const redraw = () => { waiting ||= requestAnimationFrame(() => { waiting = 0; item.chart.setOption({ ...range(), series: shown() }, { silent: true }); }); };
    const turn = (dy, dp) => { yaw += dy; pitch = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, pitch + dp)); redraw(); };
    const look = { iso: [-0.7, 0.45], top: [0, Math.PI / 2], front: [0, 0], side: [-Math.PI / 2, 0] };
    const go = (name) => { [yaw, pitch] = look[name]; zoomed = 1; redraw(); };
    const scale = (f) => { zoomed = Math.max(0.5, Math.min(50, zoomed * f)); redraw(); };
    item = add(id, aria, build, () => ({
      ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
      "+": () => scale(1.25), "=": () => scale(1.25), "-": () => scale(0.8), Home: () => go("iso"), End: () => go("top"), 0: () => go("iso"),
      PageUp: () => go("front"), PageDown: () => go("side"),
    }));
    item.onresize = redraw;
    item.onreset = () => go("iso");
    const host = item.host;
    host.style.touchAction = "pan-y"; // a finger moving sideways turns the view, up and down scrolls the page
    host.style.cursor = "grab";
    let held = null;
    host.addEventListener("pointerdown", (e) => { if (e.button === 0) { held = [e.clientX, e.clientY]; } });
    host.addEventListener("pointermove", (e) => {
      if (!held) return;
      if (!host.hasPointerCapture(e.pointerId)) { host.setPointerCapture(e.pointerId); item.chart.dispatchAction({ type: "hideTip" }); }
      turn((e.clientX - held[0]) * 0.008, (e.clientY - held[1]) * 0.008);
      held = [e.clientX, e.clientY];
    });
    for (const kind of ["pointerup", "pointercancel"]) host.addEventListener(kind, () => { held = null; });
    host.addEventListener("wheel", (e) => { if (e.ctrlKey) { e.preventDefault(); scale(Math.exp(-e.deltaY * 0.002)); } }, { passive: false });
    for (const b of host.parentElement.querySelectorAll("[data-look]")) b.addEventListener("click", () => go(b.dataset.look));
    for (const b of host.parentElement.querySelectorAll("[data-scale]")) b.addEventListener("click", () => scale(+b.dataset.scale));
    const seek = (k) => { picture = k; redraw(); };
    Object.assign(item, { turn, go, seek, frameOnce: (dy) => { yaw += dy; item.chart.setOption({ series: shown() }, { silent: true }); item.chart.getZr().flush(); } });
    return item;
  }

  // Height of the host such that the plot area has the aspect of the image (or square cells); before the chart is made.
  function keepAspect(id, grid, ratio, least, most) {
    const host = document.getElementById(id);
    const set = () => { host.style.height = `${Math.round(Math.max(least, Math.min(most, (host.clientWidth - grid.left - grid.right) / ratio + grid.top + grid.bottom)))}px`; };
    set();
    return set;
  }
  const pairs = (x, y) => { const a = new Float64Array(2 * x.length); for (let i = 0; i < x.length; i++) { a[2 * i] = x[i]; a[2 * i + 1] = y[i]; } return a; };
  // Below a size of 4, `large` draws squares with fillRect: many times faster than circles.
  const dot = (n) => (n > 5000 ? 3 : n > 300 ? 4 : n > 60 ? 6 : 8);
  // Rows without a finite y are left out: one NaN in a `large` scatter makes all of it deaf to the mouse.
  const scatter = (name, x, y, extra) => {
    const keep = []; for (let i = 0; i < y.length; i++) if (Number.isFinite(y[i])) keep.push(i);
    return { type: "scatter", name, data: pairs(keep.map((i) => x[i]), keep.map((i) => y[i])), dimensions: ["x", "y"], large: true, largeThreshold: 1000, progressive: 0, symbolSize: dot(keep.length), ...extra };
  };
  const line = (name, x, y, extra) => ({ type: "line", name, data: pairs(x, y), dimensions: ["x", "y"], showSymbol: false, symbol: extra?.showSymbol ? "circle" : "none", symbolSize: 5, sampling: "minmax", lineStyle: { width: 1.5 }, ...extra });
  const watch = () => all.forEach((i) => sizes.observe(i.host));
  return { add, all, base, axis, yAxis, zoom, scatter, line, pairs, view3d, keepAspect, setTheme, recolour, css, show, narrow, watch, beforePrint, afterPrint };
})();
