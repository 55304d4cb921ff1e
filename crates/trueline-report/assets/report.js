"use strict";
// Draws the report's charts from the embedded data, one function for each kind; no network, no state.
(async function () {
  const { add, base, axis, yAxis, zoom, scatter, line, view3d, keepAspect, css, show, narrow } = Charts;
  const data = JSON.parse(document.getElementById("data").textContent);
  const columns = data.columns.map((text) => {
    const binary = atob(text), bytes = new Uint8Array(binary.length);
    for (let k = 0; k < binary.length; k++) bytes[k] = binary.charCodeAt(k);
    return new Float32Array(bytes.buffer);
  });
  const DASHES = "path://M0 0H6V2H0ZM10 0H16V2H10Z";
  const raised = (e) => "10" + String(e).replace(/./g, (c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]);
  const power = (v) => raised(Math.round(Math.log10(v)));
  const oneIn = (v) => (v < 1 ? "" : v < 2 ? "1 in 10" : `1 in ${raised(Math.round(v))}`);
  const logAxis = { type: "log", scale: undefined, minorSplitLine: { show: true }, minorTick: { show: true, splitNumber: 9 }, axisLabel: { hideOverlap: true, formatter: power } };
  const round = (a) => a.limits.every((end) => Number.isInteger(end));
  const limits = (a) => (a.limits ? { min: a.limits[0], max: a.limits[1], axisLabel: { hideOverlap: true, formatter: (v) => String(+v.toPrecision(6)), showMinLabel: round(a), showMaxLabel: round(a) } } : {});
  const along = (a, extra) => axis(a.name, { ...(a.log ? logAxis : {}), inverse: a.inverse, ...limits(a), ...extra });
  const words = (a, room) => (a.rarity ? { axisLabel: { hideOverlap: true, formatter: oneIn }, nameGap: room } : {});
  const upright = (a, extra, room) => yAxis(a.name, { ...(a.log ? logAxis : {}), inverse: a.inverse, ...limits(a), ...words(a, room), ...extra });
  // Room for the longest label of an axis of how rare something is: "1 in 10", and a digit for each of the exponent's.
  const rare = (c) => 50 + 5 * String(Math.round(c.y.limits?.[1] ?? 10)).length;
  const lead = (target) => {
    const place = document.getElementById(target);
    if (place) { location.hash = target; place.scrollIntoView({ block: "center" }); }
  };

  // Rows that a legend of these names takes, and with it where the plot begins.
  const below = (c, width) => {
    let rows = 1, used = 0;
    // Series of one name share a place in the legend.
    for (const name of new Set([...(c.series ?? c.parts), ...(c.marks ?? [])].map((part) => part.name))) {
      const wide = 40 + 6.6 * name.length;
      if (used && used + wide > width - 20) { rows++; used = 0; }
      used += wide;
    }
    // A row is 14 px high, rows are 12 px apart as items are, and an axis label needs 10 px above the plot.
    return 4 + 26 * rows;
  };

  const draw = {
    plot(c) {
      const tip = (p) => `${p.marker}${p.seriesName}<br>${c.x.name}: <b>${show(p.value[0])}</b><br>${c.y.name}: <b>${c.y.rarity ? `1 in ${raised(p.value[1].toFixed(1))}` : show(p.value[1])}</b>`;
      // Limits on both sides of zero are one limit.
      const drawn = (m) => (Math.abs(m.at) === Math.abs(c.marks[0].at) ? "dashed" : "dotted");
      // Lines across are named in the legend: over the data a name would cover it.
      const mark = (m) => ({ type: "line", name: m.name, data: [], symbol: "none", color: css("--ink"), lineStyle: { type: drawn(m), width: 1 }, silent: true,
        markLine: { silent: true, symbol: "none", label: { show: false }, lineStyle: { color: css("--ink"), type: drawn(m), width: 1 }, data: [{ [m.upright ? "xAxis" : "yAxis"]: m.at }] } });
      const one = (s) => {
        const x = columns[s.x], y = columns[s.y], colour = css(s.colour);
        // Sampling drops the gaps, and joins the separate parts.
        if (s.line) return line(s.name, x, y, { color: colour, showSymbol: s.dotted, sampling: s.dotted || y.some(Number.isNaN) ? undefined : "minmax", lineStyle: { width: 1.5, type: s.dashed ? "dashed" : "solid" } });
        return scatter(s.name, x, y, { color: colour, ...(s.leads_to === null ? {} : { symbol: "triangle", symbolSize: 8, large: false }) });
      };
      // In the legend a line across is dashes, not a curve.
      const crossing = c.marks.map((m) => m.name);
      const named = [...new Set([...c.series.map((s) => s.name), ...crossing])].map((name) => (crossing.includes(name) ? { name, icon: DASHES } : name));
      const host = document.getElementById(c.id);
      const ends = c.x.limits ? {} : c.x.log ? { min: "dataMin", max: "dataMax" } : { min: "dataMin", max: "dataMax", axisLabel: { hideOverlap: true, formatter: (v) => String(+v.toPrecision(6)), showMinLabel: false, showMaxLabel: false } };
      const item = add(c.id, c.alternative, (size) => ({
        ...base(), ...zoom(), legend: { ...base().legend, data: named }, grid: { ...base().grid, top: below(c, size?.width ?? host.clientWidth), ...(c.y.rarity ? { left: rare(c) + 18 } : {}) },
        tooltip: { ...base().tooltip, formatter: tip },
        xAxis: along(c.x, ends), yAxis: upright(c.y, {}, rare(c)), series: [...c.series.map(one), ...c.marks.map(mark)],
      }));
      item.enter = (series, index) => {
        const leads = c.series[series]?.leads_to;
        if (leads !== null && leads !== undefined) lead(`frame-${columns[leads][index]}`);
      };
      item.chart.on("click", (p) => item.enter(p.seriesIndex, p.dataIndex));
    },

    histogram(c) {
      const middle = (k) => c.low + (k + 0.5) * c.width;
      add(c.id, c.alternative, () => ({
        ...base(), ...zoom(),
        tooltip: { ...base().tooltip, formatter: (q) => `${show(q.value[0] - c.width / 2)} to ${show(q.value[0] + c.width / 2)}: <b>${show(q.value[1])}</b>` },
        xAxis: along(c.axis, { min: c.low, max: c.low + c.width * c.counts.length }), yAxis: yAxis("count"),
        series: [
          { type: "custom", name: "counted", color: css("--a"), dimensions: ["x", "n"], encode: { x: 0, y: 1 }, data: c.counts.map((n, k) => [middle(k), n]), clip: true,
            renderItem: (_, api) => {
              const a = api.coord([api.value(0) - c.width / 2, api.value(1)]), b = api.coord([api.value(0) + c.width / 2, 0]);
              return { type: "rect", shape: { x: a[0] + 0.5, y: a[1], width: Math.max(1, b[0] - a[0] - 1), height: b[1] - a[1] }, style: { fill: api.visual("color"), opacity: 0.75 } };
            } },
          line("expected of noise", c.expected.map((_, k) => middle(k)), c.expected, { color: css("--b"), lineStyle: { width: 2 } }),
        ],
      }));
    },

    matrix(c) {
      const widest = Math.max(...c.rows.map((n) => n.length)), small = narrow();
      const grid = { ...base().grid, left: Math.min(small ? 130 : 190, 12 + 6.6 * widest), right: 62, top: 12, bottom: 104 };
      // A row is no lower than its name.
      const size = keepAspect(c.id, grid, (1.6 * c.columns.length) / c.rows.length, Math.max(240, 116 + 14 * c.rows.length), 620);
      const item = add(c.id, c.alternative, () => ({
        ...base(), legend: { show: false }, grid,
        tooltip: { ...base().tooltip, formatter: (q) => `${c.rows[q.value[1]]} – ${c.columns[q.value[0]]}: <b>${q.value[2].toFixed(3)}</b>` },
        xAxis: { type: "category", data: c.columns, axisLabel: { rotate: small && c.columns.length > 12 ? 90 : 45, interval: 0, fontSize: small && c.columns.length > 12 ? 9 : 11 }, axisTick: { show: false } },
        yAxis: { type: "category", data: c.rows, inverse: true, axisLabel: { interval: 0, fontSize: 11, width: grid.left - 12, overflow: "truncate" }, axisTick: { show: false } },
        visualMap: { type: "continuous", min: -c.strongest, max: c.strongest, calculable: false, right: 0, top: "middle", itemWidth: 12, itemHeight: 100, text: ["+" + c.strongest, "−" + c.strongest], inRange: { color: ["#2166ac", "#92c5de", "#f7f7f7", "#f4a582", "#b2182b"] } },
        series: [{ type: "heatmap", name: "value", data: c.cells,
          label: { show: !small && c.columns.length <= 16, fontSize: 10, color: "#1a1d21", rich: { light: { color: "#ffffff", fontSize: 10 } },
            formatter: (q) => { const v = Math.abs(q.value[2]) < 0.005 ? 0 : q.value[2], t = Math.abs(v) < 9.95 ? v.toFixed(c.strongest > 1 ? 1 : 2) : v.toFixed(0); return Math.abs(v) > 0.7 * c.strongest ? `{light|${t}}` : t; } },
          itemStyle: { borderColor: css("--card"), borderWidth: 1 } }],
      }));
      item.onresize = size;
      item.say = ([column, row, value]) => `${c.rows[row]}, ${c.columns[column]}: ${value.toFixed(2)}`;
    },

    heat(c) {
      const grid = { ...base().grid, top: 12, right: 84 };
      const ratio = (c.x.limits[1] - c.x.limits[0]) / (c.y.limits[1] - c.y.limits[0]);
      const size = c.equal ? keepAspect(c.id, grid, ratio, 220, 620) : () => {};
      const most = c.strongest;
      add(c.id, c.alternative, () => ({
        ...base(), ...zoom(), legend: { show: false }, grid,
        tooltip: { ...base().tooltip, formatter: (q) => `${c.x.name} ${show(q.value[0])}, ${c.y.name} ${show(q.value[1])}<br>${c.unit}: <b>${show(q.value[2])}</b><br>of ${q.value[3]}` },
        xAxis: along(c.x, { splitLine: { show: false } }), yAxis: upright(c.y, { splitLine: { show: false } }),
        visualMap: { type: "continuous", dimension: 2, min: c.signed ? -most : 0, max: most, calculable: false, right: 0, top: "middle", itemWidth: 12, itemHeight: 110, text: [(c.signed ? "+" : "≥ ") + show(+most.toPrecision(2)) + " " + (c.short ?? ""), c.signed ? "−" + show(+most.toPrecision(2)) : "0"], inRange: { color: c.signed ? ["#2166ac", "#92c5de", "#f7f7f7", "#f4a582", "#b2182b"] : ["#440154", "#3b528b", "#21918c", "#5ec962", "#fde725"] } },
        series: [{ type: "custom", name: c.unit, dimensions: ["x", "y", "v", "n"], encode: { x: 0, y: 1, tooltip: 2 }, data: c.cells, clip: true, progressive: 0,
          renderItem: (_, api) => {
            const a = api.coord([api.value(0) - c.cell[0] / 2, api.value(1) - c.cell[1] / 2]), b = api.coord([api.value(0) + c.cell[0] / 2, api.value(1) + c.cell[1] / 2]);
            return { type: "rect", shape: { x: Math.min(a[0], b[0]), y: Math.min(a[1], b[1]), width: Math.abs(b[0] - a[0]) + 0.3, height: Math.abs(b[1] - a[1]) + 0.3 }, style: { fill: api.visual("color") } };
          } }],
      })).onresize = size;
    },

    bars(c) {
      const host = document.getElementById(c.id);
      host.style.height = `${Math.min(40, Math.max(10, 4 + 1.7 * c.names.length))}rem`;
      const low = c.axis.log ? 10 ** Math.floor(Math.log10(Math.min(...c.values, c.mark ? c.mark.at : Infinity))) : undefined;
      // Names take their own width, at most two fifths; longer ones are broken into lines.
      const longest = Math.max(...c.names.map((name) => name.length));
      const left = (width) => Math.round(Math.min(24 + 6.6 * longest, 0.4 * width));
      const item = add(c.id, c.alternative, (size) => ({
        ...base(), legend: { ...base().legend, show: !!c.mark, data: c.mark ? [{ name: c.mark.name, icon: DASHES }] : [] }, grid: { ...base().grid, top: c.mark ? 30 : 12, left: left(size?.width ?? host.clientWidth), right: narrow() ? 56 : 76 },
        tooltip: { ...base().tooltip, formatter: (q) => `${q.name}: <b>${show(q.value)}</b>` },
        xAxis: along(c.axis, { scale: false, min: low, startValue: low }), yAxis: { type: "category", data: c.names, inverse: true, axisTick: { show: false }, axisLabel: { interval: 0, fontSize: 11, lineHeight: 12, width: left(size?.width ?? host.clientWidth) - 14, overflow: "break" } },
        series: [{ type: "bar", name: c.axis.name, data: c.values, color: css("--a"), barCategoryGap: "25%", label: { show: true, position: "right", color: css("--ink"), formatter: (q) => String(+q.value.toPrecision(2)) },
        }, ...(c.mark ? [{ type: "line", name: c.mark.name, data: [], silent: true, symbol: "none", color: css("--bad"), lineStyle: { type: "dashed" }, markLine: { silent: true, symbol: "none", label: { show: false }, lineStyle: { color: css("--bad"), type: "dashed" }, data: [{ xAxis: c.mark.at }] } }] : [])],
      }));
      // A bar's dimensions are its value and its place.
      item.say = (value) => { const k = c.values.findIndex((v) => v === value[0] || v === value[1]); return `${c.names[k]}: ${show(c.values[k])}`; };
    },

    scene(c) {
      const tip = (xyz) => (k) => `x ${show(xyz[3 * k])}, y ${show(xyz[3 * k + 1])}, z ${show(xyz[3 * k + 2])} mm`;
      view3d(c.id, c.alternative, c.parts.map((p) => ({ name: p.name, kind: p.line ? "line" : "points", xyz: columns[p.xyz], colour: p.colour, width: 1.3, tip: tip(columns[p.xyz]) })));
    },
  };

  // A film: pictures at their own pace, or where the slider is.
  draw.film = function (c) {
    const times = columns[c.times], last = times.length - 1;
    const still = c.parts.map((p) => ({ name: p.name, kind: p.line ? "line" : "points", xyz: columns[p.xyz], colour: p.colour, width: 1 }));
    const moving = c.moving.map((p) => ({ name: p.name, kind: p.line ? "line" : "points", xyz: columns[p.xyz], each: columns[p.xyz].length / times.length, colour: p.colour, width: 2.5, size: 10, tip: () => p.name }));
    const arm = (c.arm ? [c.arm] : []).map((p) => ({ name: p.name, kind: "line", xyz: columns[p.xyz], each: columns[p.xyz].length / times.length, colour: p.colour, width: 5, beyond: true }));
    const item = view3d(c.id, c.alternative, [...still, ...arm, ...moving]);
    const bar = document.getElementById(c.id).parentElement.querySelector(".film");
    const [play, slider, told] = ["[data-play]", "[data-time]", "output"].map((name) => bar.querySelector(name));
    slider.max = last;
    const show = (k) => {
      slider.value = k;
      told.textContent = `${times[k].toFixed(1)} of ${times[last].toFixed(1)} s`;
      slider.setAttribute("aria-valuetext", told.textContent);
      item.seek(k);
    };
    let began = null;
    const stop = () => { began = null; play.textContent = "Play"; };
    const step = (ms) => {
      if (began === null) return;
      const s = (ms - began) / 1000;
      let k = +slider.value;
      while (k < last && times[k + 1] <= s) k++;
      show(k);
      if (k < last) requestAnimationFrame(step); else stop();
    };
    play.addEventListener("click", () => {
      if (began !== null) return stop();
      play.textContent = "Pause";
      requestAnimationFrame((ms) => {
        if (+slider.value >= last) show(0);
        began = ms - 1000 * times[+slider.value];
        step(ms);
      });
    });
    slider.addEventListener("input", () => { stop(); show(+slider.value); });
    show(0);
  };

  // Ways to write the same: a list to choose from, and a button that copies.
  for (const [number, choice] of [...document.querySelectorAll(".choice")].entries()) {
    const choose = choice.querySelector(".choose"), forms = [...choice.querySelectorAll(".form")];
    const list = document.createElement("select");
    list.setAttribute("aria-label", `${choice.querySelector("h3").textContent}: notation`);
    for (const [k, form] of forms.entries()) {
      form.id = `form-${number}-${k}`;
      list.append(new Option(form.dataset.name, k));
    }
    const pick = () => forms.forEach((form, k) => { form.style.display = k === +list.value ? "" : "none"; });
    list.addEventListener("change", pick);
    choose.append(list);
    const copy = document.createElement("button");
    copy.textContent = "Copy";
    copy.className = "copy";
    copy.addEventListener("click", async () => {
      const pre = forms[+list.value].querySelector("pre");
      let done = true;
      try { await navigator.clipboard.writeText(pre.textContent); } catch {
        // Pages of files may have no clipboard of their own.
        getSelection().selectAllChildren(pre);
        done = document.execCommand("copy");
      }
      copy.textContent = done ? "Copied" : "Selected: press Ctrl C";
      setTimeout(() => { copy.textContent = "Copy"; }, 2000);
    });
    copy.setAttribute("aria-live", "polite");
    choose.append(copy);
    choice.classList.add("chosen");
    pick();
  }

  const button = document.getElementById("theme");
  const label = () => { button.textContent = document.documentElement.dataset.theme === "dark" ? "Light" : "Dark"; };
  button.addEventListener("click", () => { Charts.setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"); label(); });
  label();
  document.getElementById("print").addEventListener("click", () => print());

  // One chart after the other, so that the page answers in between; first those that are in the window.
  const host = (chart) => document.getElementById(chart.id);
  const visible = data.charts.filter((chart) => host(chart).getBoundingClientRect().top < innerHeight).length;
  for (const [k, chart] of data.charts.entries()) {
    if (k === visible) document.documentElement.dataset.opened = Math.round(performance.now());
    draw[chart.kind](chart);
    await new Promise((done) => setTimeout(done));
  }
  for (const folded of document.querySelectorAll("details")) folded.open = false;
  addEventListener("beforeprint", () => { for (const folded of document.querySelectorAll("details")) folded.open = true; });
  Charts.watch();
  // The drawn charts, for the tests.
  setTimeout(() => {
    const root = document.documentElement;
    for (const { host, chart } of Charts.all) {
      const counts = chart.getModel().getSeries().filter((m) => !["frame", "ticks"].includes(m.get("id"))).map((m) => m.getRawData().count());
      host.dataset.points = counts.reduce((sum, n) => sum + n, 0);
    }
    root.dataset.drawn = Math.round(performance.now());
    root.dataset.requests = performance.getEntriesByType("resource").length;
    root.dataset.overflow = root.scrollWidth - root.clientWidth;
    root.dataset.problems = problems.join("; ");
  }, 50);
})();
