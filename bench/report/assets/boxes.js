// Ends of all repetitions: a point each, a box from quartile to quartile, a line at the median; a row an algorithm.

function drawBoxes(figure, problem, looks) {
  const feasible = looks.flatMap((look) => problem.ends[look.name]).filter((value) => value !== null);
  const all = feasible.length ? feasible : [1, 10];
  const x = { ...spanOf(all, problem.zero), label: "value at the end" };
  const y = { low: 0, high: Math.max(looks.length, 1), ticks: [], logarithmic: false, height: 34 * looks.length + 60 };
  const chart = frame(figure, "Ends of all repetitions", `Box plots of ${problem.name}; the table below has the figures`, x, y);
  looks.forEach((look, row) => drawRow(chart, problem, look, looks.length - row - 0.5));
}

function drawRow(chart, problem, look, row) {
  const middle = chart.toY(row);
  const half = Math.min(8, Math.abs(chart.toY(0) - chart.toY(1)) * 0.32);
  const [lower, median, upper] = problem.boxes[look.name].map((value) => (value === null ? chart.box.right : chart.toX(value)));
  make("rect", { x: lower, y: middle - half, width: Math.max(upper - lower, 1), height: 2 * half, fill: look.color,
    opacity: 0.25 }, chart.svg);
  make("line", { x1: median, x2: median, y1: middle - half, y2: middle + half, stroke: look.color, "stroke-width": 3 }, chart.svg);
  const ends = problem.ends[look.name];
  ends.forEach((value, k) => {
    if (value === null) return;
    const cy = middle + half * 0.9 * (((k * 0.618) % 1) * 2 - 1);
    make("circle", { cx: chart.toX(value), cy, r: 2.2, fill: look.color, "data-algorithm": look.name }, chart.svg);
  });
  const lost = ends.filter((value) => value === null).length;
  const name = lost ? `${look.name} (${lost} infeasible)` : look.name;
  const halo = { stroke: "#fff", "stroke-width": 3, "paint-order": "stroke" };
  make("text", { x: chart.box.left - 44, y: middle - half - 2, ...halo }, chart.svg, name);
}
