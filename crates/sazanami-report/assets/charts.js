// Draws the charts of the page. Values under the cursor, zoom, curves on and off; by mouse, touch and keyboard.
"use strict";
(() => {
  const colour = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  // Powers of ten as they are printed.
  const raised = text => text.replace(/e([+-]?\d+)/, (_, power) => " × 10" + [...String(+power)].map(digit => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(digit)]).join(""));
  const text = value => value == null ? "–" : raised(String(+value.toPrecision(5)));
  const made = (name, parent, properties = {}) => parent.appendChild(Object.assign(document.createElement(name), properties));
  const curveColour = (n, printed) => printed ? ["#0969da", "#bc4c00", "#1a7f37", "#8250df", "#bf3989", "#6e7781", "#9a6700", "#1b7c83"][n % 8] : colour("--c" + n % 8);

  // Error bars of points.
  const bars = (curves, tones) => plot => {
    const context = plot.ctx;
    curves.forEach((curve, n) => {
      if (!curve.bars.length || !plot.series[n + 1].show) return;
      context.save();
      context.strokeStyle = tones(n);
      context.lineWidth = devicePixelRatio;
      plot.data[0].forEach((x, i) => {
        const y = plot.data[n + 1][i], half = curve.bars[curve.at.get(x)];
        if (y == null || half == null) return;
        const [at, low, high] = [plot.valToPos(x, "x", true), plot.valToPos(y - half, "y", true), plot.valToPos(y + half, "y", true)];
        const cap = 4 * devicePixelRatio;
        context.beginPath();
        for (const [a, b, c, d] of [[at, low, at, high], [at - cap, low, at + cap, low], [at - cap, high, at + cap, high]]) {
          context.moveTo(a, b);
          context.lineTo(c, d);
        }
        context.stroke();
      });
      context.restore();
    });
  };

  class Chart {
    constructor(figure, data) {
      Object.assign(this, { figure, data, place: figure.querySelector(".plot"), read: figure.querySelector(".read") });
      this.place.replaceChildren();
      this.curves = data.tables.flatMap(table => table.curves.map(curve => ({ ...curve, at: new Map(table.x.map((x, n) => [x, n])) })));
      this.values = uPlot.join(data.tables.map(table => [table.x, ...table.curves.map(curve => curve.y)]), data.tables.map(table => table.curves.map(() => 1)));
      this.keys();
      this.draw(false);
      this.place.addEventListener("keydown", event => this.key(event));
      figure.querySelector("details").addEventListener("toggle", () => this.table());
      new ResizeObserver(() => this.plot.setSize(this.size())).observe(this.place);
    }
    size() { return { width: Math.max(this.place.clientWidth, 200), height: 272 }; }
    draw(printed) {
      this.plot?.destroy();
      const tone = name => printed ? { "--front": "#000", "--line": "#ccc" }[name] : colour(name);
      const axis = label => ({ stroke: tone("--front"), grid: { stroke: tone("--line"), width: 1 }, ticks: { stroke: tone("--line"), width: 1 }, label, labelSize: 22,
        size: (_, values) => label.startsWith("\u2009") ? Math.max(40, 14 + 7 * Math.max(0, ...(values ?? []).map(value => value.length))) : 40,
        values: (_, splits) => splits.map(text) });
      const { x, xUnit, unit, points } = this.data;
      const series = this.curves.map((curve, n) => ({ label: curve.label, show: curve.shown, stroke: curveColour(n, printed), width: 2, dash: n > 7 ? [6, 4] : undefined,
        points: { show: points || this.values[0].length < 40, size: points ? 9 : 5, fill: curveColour(n, printed) }, ...(points ? { paths: () => null } : {}) }));
      const within = (_, low, high) => points ? this.range() : low == null ? [0, 1] : uPlot.rangeNum(low, high, 0.06, true);
      this.plot = new uPlot({
        ...this.size(), legend: { show: false }, cursor: { drag: { x: true, y: false }, focus: { prox: 24 } },
        scales: { x: { time: false, ...(points ? { range: (_, low, high) => low === high ? [low - Math.abs(low || 1) / 2, high + Math.abs(high || 1) / 2] : uPlot.rangeNum(low, high, 0.1, true) } : {}) }, y: { range: within } },
        series: [{ label: x }, ...series],
        axes: [axis(xUnit ? `${x} [${xUnit}]` : x), axis("\u2009" + (unit ? `[${unit}]` : ""))],
        hooks: { setCursor: [plot => this.show(plot.cursor.idx)], draw: [bars(this.curves, n => curveColour(n, printed))] },
      }, this.values, this.place);
    }
    // Range of points with their bars.
    range() {
      const ends = this.curves.flatMap(curve => curve.y.flatMap((y, n) => y == null ? [] : [y - (curve.bars[n] ?? 0), y + (curve.bars[n] ?? 0)]));
      return uPlot.rangeNum(...[Math.min, Math.max].map(of => ends.reduce((a, b) => of(a, b), 0)), 0.08, true);
    }
    keys() {
      const keys = this.figure.querySelector(".keys");
      const names = [...new Set(this.curves.map(curve => curve.label))];
      this.outputs = this.curves.map(() => null);
      names.forEach(name => {
        const n = this.curves.findIndex(curve => curve.label === name);
        const label = made("label", keys);
        const box = made("input", label, { type: "checkbox", checked: this.curves[n].shown });
        made("i", label).style.borderColor = `var(--c${n % 8})`;
        label.append(name);
        this.outputs[n] = made("output", label);
        box.addEventListener("change", () => this.curves.forEach((curve, m) => {
          if (curve.label !== name) return;
          curve.shown = box.checked;
          this.plot.setSeries(m + 1, { show: box.checked });
        }));
      });
      const buttons = made("span", keys, { className: "zoom" });
      for (const [sign, name, factor] of [["+", "zoom in", 0.5], ["−", "zoom out", 2], ["⤢", "show all", 0]])
        made("button", buttons, { type: "button", textContent: sign, ariaLabel: `${name}: ${this.data.title}`, onclick: () => this.zoom(factor) });
    }
    zoom(factor) {
      const [x] = this.values, { min, max } = this.plot.scales.x, ends = [x[0], x[x.length - 1]];
      const at = this.plot.cursor.idx == null ? (min + max) / 2 : x[this.plot.cursor.idx];
      if (factor === 0) return this.plot.setScale("x", { min: ends[0], max: ends[1] });
      this.plot.setScale("x", { min: Math.max(ends[0], at - (at - min) * factor), max: Math.min(ends[1], at + (max - at) * factor) });
    }
    show(at) {
      const line = at == null ? "" : `${this.data.x} ${text(this.values[0][at])} ${this.data.xUnit}`;
      this.outputs.forEach((output, n) => { if (output) output.textContent = at == null ? "" : text(this.values[n + 1][at]); });
      this.read.textContent = at == null ? "" : this.data.points || document.activeElement === this.place
        ? `${line}: ` + this.curves.flatMap((curve, n) => curve.shown && this.values[n + 1][at] != null ? [`${curve.label} ${text(this.values[n + 1][at])} ${this.data.unit}`] : []).join(", ") : line;
    }
    key(event) {
      const step = { ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10 }[event.key];
      const factor = { "+": 0.5, "-": 2, "0": 0 }[event.key];
      if (step === undefined && factor === undefined) return;
      event.preventDefault();
      if (factor !== undefined) return this.zoom(factor);
      const last = this.values[0].length - 1, at = this.plot.cursor.idx ?? (step > 0 ? -1 : last + 1);
      const next = Math.min(last, Math.max(0, at + step));
      this.plot.setCursor({ left: this.plot.valToPos(this.values[0][next], "x"), top: this.plot.bbox.height / 2 / devicePixelRatio });
      this.show(next);
    }
    // All values, when they are asked for.
    table() {
      const place = this.figure.querySelector(".values");
      if (place.childElementCount) return;
      const table = made("table", made("div", place, { className: "wide", tabIndex: 0 }));
      const unit = (name, of) => of ? `${name} [${of}]` : name;
      const head = made("tr", made("thead", table)), body = made("tbody", table);
      [unit(this.data.x, this.data.xUnit), ...this.curves.map(curve => unit(curve.label, this.data.unit))].forEach(name => made("th", head, { scope: "col", textContent: name }));
      this.values[0].forEach((x, row) => {
        const line = made("tr", body);
        this.values.forEach(column => made("td", line, { textContent: text(column[row]) }));
      });
    }
  }

  const charts = JSON.parse(document.getElementById("charts-data").textContent).map((data, n) => new Chart(document.getElementById(`chart-${n}`), data));
  const redraw = printed => charts.forEach(chart => chart.draw(printed));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redraw(false));
  // Canvases come out blank on paper: images stand for them, once the charts are drawn.
  const copies = () => {
    for (const canvas of document.querySelectorAll("canvas")) canvas.after(Object.assign(new Image(), { className: "printed", src: canvas.toDataURL() }));
  };
  addEventListener("beforeprint", () => { redraw(true); queueMicrotask(copies); });
  addEventListener("afterprint", () => { document.querySelectorAll(".printed").forEach(copy => copy.remove()); redraw(false); });
  Object.assign(window, { reportCharts: charts, reportRaised: raised });
})();
