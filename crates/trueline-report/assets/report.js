"use strict";
// Draws the report's plots from the embedded data; no network, no state.
(function () {
  const data = JSON.parse(document.getElementById("data").textContent);
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(name).trim();
  const ink = colour("--ink"), rule = colour("--rule");
  // As many digits as neighbouring ticks need to differ.
  const tickText = (_, ticks) => {
    const step = ticks.length > 1 ? Math.abs(ticks[1] - ticks[0]) : 1;
    const places = Math.min(9, Math.max(0, Math.ceil(-Math.log10(step) - 1e-9)));
    return ticks.map((tick) => tick.toFixed(places));
  };
  const axis = (label) => ({ label, values: tickText, stroke: ink, grid: { stroke: rule, width: 1 }, ticks: { stroke: rule } });
  const digits = (value) => (value == null ? "–" : value.toPrecision(4));

  function plot(id, xLabel, yLabel, columns, series, height) {
    const host = document.getElementById(id);
    const options = {
      width: host.clientWidth,
      height: height || 280,
      scales: { x: { time: false } },
      axes: [axis(xLabel), Object.assign(axis(yLabel), { size: 64 })],
      series: [{ label: xLabel, value: (_, v) => digits(v) }].concat(
        series.map((s) => Object.assign({ value: (_, v) => digits(v) }, s)),
      ),
    };
    const chart = new uPlot(options, columns, host);
    addEventListener("resize", () => chart.setSize({ width: host.clientWidth, height: options.height }));
    return chart;
  }

  const dots = (label, name) => ({
    label, stroke: colour(name), paths: () => null, points: { show: true, size: 4, fill: colour(name), width: 0 },
  });

  // Rows in the order of x, as the charts need them.
  function sorted(x, ...columns) {
    const order = x.map((_, k) => k).sort((a, b) => x[a] - x[b]);
    return [x, ...columns].map((column) => order.map((k) => column[k]));
  }

  const f = data.features;
  const inlier = (values) => values.map((v, k) => (f.outlier[k] ? null : v));
  const two = [dots("across (mm)", "--a"), dots("square to both (mm)", "--b")];
  plot("residual-time", "time since the first robot row (s)", "offset (mm)", sorted(f.stamp_s, inlier(f.offset_2_mm), inlier(f.offset_3_mm)), two);
  plot("residual-along", "along the line (mm)", "offset (mm)", sorted(f.along_mm, inlier(f.offset_2_mm), inlier(f.offset_3_mm)), two);

  const steps = data.result.iterations;
  const index = steps.map((_, k) => k);
  const line = (label, name) => ({ label, stroke: colour(name), width: 2, points: { show: true, size: 6 } });
  plot("convergence-rms", "step", "RMS (mm)", [index, steps.map((s) => s.rms_mm)], [line("RMS (mm)", "--a")], 200);
  plot("convergence-offset", "step", "time offset (ms)", [index, steps.map((s) => 1e3 * s.time_offset_s)], [line("time offset (ms)", "--b")], 200);
})();
