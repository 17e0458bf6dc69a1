// A chart of curves, one an algorithm, with a cursor that mouse, finger and arrow keys move.

function path(points) {
  let pen = false;
  return points.map(([x, y]) => {
    if (y === null) { pen = false; return ""; }
    const step = `${pen ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`;
    pen = true;
    return step;
  }).join("");
}

function band(chart, xs, low, high) {
  const known = xs.map((x, k) => [x, low[k], high[k]]).filter(([, a, b]) => a !== null && b !== null);
  const there = known.map(([x, , b]) => [chart.toX(x), chart.toY(b)]);
  const back = known.map(([x, a]) => [chart.toX(x), chart.toY(a)]).reverse();
  return known.length ? path([...there, ...back]) + "Z" : "";
}

function drawLines(figure, chartOf) {
  const { title, words, xs, series, x, y } = chartOf;
  const chart = frame(figure, title, words, x, y);
  for (const { look, low, high } of series) {
    if (low) make("path", { d: band(chart, xs, low, high), fill: look.color, opacity: 0.12 }, chart.svg);
  }
  for (const { look, values } of series) {
    const points = values.map((value, k) => [chart.toX(xs[k]), value === null ? null : chart.toY(value)]);
    const attributes = { d: path(points), fill: "none", stroke: look.color, "stroke-width": 2.2 };
    make("path", { ...attributes, "stroke-dasharray": look.dash, "data-algorithm": look.name }, chart.svg);
  }
  addCursor(figure, chart, xs, series, x.label);
}

function addCursor(figure, chart, xs, series, label) {
  const readout = document.createElement("p");
  readout.className = "readout";
  readout.textContent = "Point at the chart, or use the arrow keys, to read values.";
  figure.append(readout);
  const line = make("line", { class: "cursor", y1: chart.box.top, y2: chart.box.bottom, visibility: "hidden" }, chart.svg);
  let place = xs.length - 1;
  const show = () => {
    line.setAttribute("x1", chart.toX(xs[place]));
    line.setAttribute("x2", chart.toX(xs[place]));
    line.setAttribute("visibility", "visible");
    const order = [...series].sort((a, b) => (a.values[place] ?? Infinity) - (b.values[place] ?? Infinity));
    readout.replaceChildren(`${label} ${written(xs[place])}: `, ...order.map((one) => value(one, place)));
  };
  chart.svg.addEventListener("pointermove", (event) => {
    const at = (event.offsetX / chart.svg.clientWidth) * chart.svg.viewBox.baseVal.width;
    const distance = xs.map((x) => Math.abs(chart.toX(x) - at));
    place = distance.indexOf(Math.min(...distance));
    show();
  });
  chart.svg.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!step) return;
    event.preventDefault();
    place = Math.max(0, Math.min(xs.length - 1, place + step));
    show();
  });
}

function value({ look, values }, place) {
  const item = document.createElement("span");
  const dot = document.createElement("i");
  dot.style.background = look.color;
  item.append(dot, `${look.name} ${written(values[place])}`);
  return item;
}
