"use strict";
// Axes: where a value lies, which values have a tick, how a number is written.

// The span of values on a logarithmic axis; zero: where 0 stands, a decade below the least positive value, or null.
function spanOf(values, zero) {
  return { low: zero === null ? Math.min(...values) * 0.95 : zero, high: Math.max(...values, zero) * 1.05, logarithmic: true, zero };
}

function scale({ low, high, logarithmic, zero }, from, to) {
  const bend = logarithmic ? (value) => Math.log10(value === 0 ? zero : value) : (value) => value;
  const span = bend(high) - bend(low) || 1;
  return (value) => from + ((bend(value) - bend(low)) / span) * (to - from);
}

function even(low, high) {
  const rough = (high - low) / 4 || 1;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 2.5, 5, 10].find((digit) => digit * power >= rough * 0.999);
  const found = [];
  for (let value = Math.ceil(low / step) * step; value <= high + step * 1e-9; value += step) found.push(value);
  return found;
}

function ticks({ low, high, logarithmic, zero }) {
  if (zero) return [0, ...ticks({ low: zero * 10, high, logarithmic })];
  if (!logarithmic) return even(low, high);
  const found = (digits) => {
    const values = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power += 1) {
      for (const digit of digits) values.push(digit * 10 ** power);
    }
    return values.filter((value) => value >= low * 0.999 && value <= high * 1.001);
  };
  const wholes = found([1]);
  const some = found([1, 2, 5]);
  if (some.length > 8) return wholes.filter((_, index) => index % Math.ceil(wholes.length / 8) === 0);
  return some.length > 2 ? some : even(low, high);
}

function written(value) {
  if (value === null || value === undefined) return "∞";
  const size = Math.abs(value);
  if (size !== 0 && (size < 0.001 || size >= 1e5)) return value.toExponential(1).replace("e+", "e");
  return String(Number(value.toPrecision(3)));
}

function make(name, attributes, parent, text) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  if (parent) parent.append(element);
  return element;
}

const HALF_LETTER_PX = 3.8; // of the labels of an axis, with some space between them

// An empty chart in a figure: title, frame, ticks and labels; returns the drawing and both scales.
function frame(figure, title, words, x, y) {
  const width = Math.max(280, Math.min(figure.clientWidth || 640, 900));
  const height = y.height || Math.round(Math.min(width * 0.72, 380));
  const box = { left: 52, right: width - 12, top: 10, bottom: height - 40 };
  figure.replaceChildren();
  const caption = document.createElement("figcaption");
  caption.textContent = title;
  const attributes = { width, height, viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": words, tabindex: 0 };
  const svg = make("svg", attributes);
  figure.append(caption, svg);
  const toX = scale(x, box.left, box.right);
  const toY = scale(y, box.bottom, box.top);
  for (const value of y.ticks || ticks(y)) {
    make("line", { class: "grid", x1: box.left, x2: box.right, y1: toY(value), y2: toY(value) }, svg);
    make("text", { x: box.left - 6, y: toY(value) + 4, "text-anchor": "end" }, svg, written(value));
  }
  let taken = -Infinity; // right end of the last label: one that would run into it is left out
  for (const value of x.ticks || ticks(x)) {
    make("line", { class: "grid", x1: toX(value), x2: toX(value), y1: box.top, y2: box.bottom }, svg);
    const half = written(value).length * HALF_LETTER_PX;
    if (toX(value) - half < taken) continue;
    make("text", { x: toX(value), y: box.bottom + 16, "text-anchor": "middle" }, svg, written(value));
    taken = toX(value) + half;
  }
  make("text", { x: (box.left + box.right) / 2, y: height - 4, "text-anchor": "middle" }, svg, x.label);
  return { svg, box, toX, toY };
}
