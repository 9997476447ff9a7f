// Curves over the cursor, with levels, worst places and a line that follows; a click or drag seeks.
"use strict";
const [LEFT, BOTTOM, TOP, RIGHT] = [40, 16, 6, 8]; // pixels around the curves

/** Return an SVG element with attributes. */
function svg(tag, attributes, parent, text) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  if (text !== undefined) element.textContent = text;
  if (parent) parent.append(element);
  return element;
}

/** Return at most five round numbers within a range. */
function ticks(low, high) {
  const raw = (high - low) / 4;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw);
  const first = Math.ceil(low / step - 1e-9);
  return Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, i) => Number(((first + i) * step).toPrecision(12)));
}

/** One plot: curves are {x, y, colour, second, worst, name}, worst being an index or undefined. */
class Plot {
  constructor(parent, title, span, seek) {
    this.element = Object.assign(document.createElement("div"), { className: "plot" });
    this.head = document.createElement("h3");
    this.head.append(title);
    this.span = span;
    this.svg = svg("svg", { role: "img", "aria-label": title });
    this.element.append(this.head, this.svg);
    parent.append(this.element);
    const seeking = (event) => {
      const share = (event.clientX - this.svg.getBoundingClientRect().left - LEFT) / (this.width - LEFT - RIGHT);
      seek(span[0] + Math.min(1, Math.max(0, share)) * (span[1] - span[0]));
    };
    this.svg.addEventListener("pointerdown", (event) => {
      this.svg.setPointerCapture(event.pointerId);
      seeking(event);
    });
    this.svg.addEventListener("pointermove", (event) => event.buttons && seeking(event));
    new ResizeObserver(() => this.shown && this.draw(...this.shown)).observe(this.svg);
  }

  get width() {
    return this.svg.clientWidth;
  }

  get height() {
    return this.svg.clientHeight;
  }

  px(x) {
    return LEFT + ((x - this.span[0]) / (this.span[1] - this.span[0])) * (this.width - LEFT - RIGHT);
  }

  py(y) {
    const [low, high] = this.range;
    return this.height - BOTTOM - ((y - low) / (high - low)) * (this.height - BOTTOM - TOP);
  }

  draw(curves, levels = [], welds = []) {
    this.shown = [curves, levels, welds];
    this.svg.replaceChildren();
    const values = curves.flatMap(({ y }) => Array.from(y).filter(Number.isFinite)).concat(levels);
    let [low, high] = [values.reduce((a, b) => Math.min(a, b), Infinity), values.reduce((a, b) => Math.max(a, b), -Infinity)];
    if (!(low <= high)) [low, high] = [0, 1];
    const margin = 0.06 * (high - low) || 0.1 * Math.abs(high) || 1;
    this.range = [low - margin, high + margin];
    for (const [begin, end] of welds) {
      const box = { x: this.px(begin), width: this.px(end) - this.px(begin), y: TOP, height: this.height - BOTTOM - TOP };
      svg("rect", { ...box, class: "weld" }, this.svg);
    }
    for (const y of ticks(...this.range)) {
      svg("line", { x1: LEFT, x2: this.width - RIGHT, y1: this.py(y), y2: this.py(y), class: "axis" }, this.svg);
      svg("text", { x: LEFT - 4, y: this.py(y) + 3, "text-anchor": "end" }, this.svg, String(y));
    }
    for (const x of ticks(...this.span)) {
      svg("text", { x: this.px(x), y: this.height - 3, "text-anchor": "middle" }, this.svg, String(x));
    }
    for (const y of levels) svg("line", { x1: LEFT, x2: this.width - RIGHT, y1: this.py(y), y2: this.py(y), class: "level" }, this.svg);
    for (const curve of curves) this.curve(curve);
    this.line = svg("line", { y1: TOP, y2: this.height - BOTTOM, class: "cursor" }, this.svg);
    this.seek(this.at ?? this.span[0]);
  }

  curve({ x, y, colour: stroke, second, worst, name }) {
    let pen = "M";
    let d = "";
    for (let k = 0; k < x.length; k += 1) {
      if (!Number.isFinite(y[k])) pen = "M";
      else {
        d += `${pen}${this.px(x[k]).toFixed(1)},${this.py(y[k]).toFixed(1)}`;
        pen = "L";
      }
    }
    const path = svg("path", { d, stroke, class: second ? "second" : "first" }, this.svg);
    svg("title", {}, path, name);
    if (worst === undefined) return;
    const dot = svg("circle", { cx: this.px(x[worst]), cy: this.py(y[worst]), r: 4, fill: stroke }, this.svg);
    svg("title", {}, dot, `${name}: least ${y[worst].toPrecision(4)}`);
  }

  seek(x) {
    this.at = x;
    this.line.setAttribute("x1", this.px(x));
    this.line.setAttribute("x2", this.px(x));
  }
}
