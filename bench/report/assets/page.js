// What is shown: the algorithms whose buttons are pressed, and the problem that is chosen.

const data = JSON.parse(document.getElementById("data").textContent);
const buttons = [...document.querySelectorAll(".legend button")];
const chooser = document.getElementById("problem");

function shown() {
  return buttons.filter((button) => button.getAttribute("aria-pressed") === "true").map((button) => ({
    name: button.dataset.algorithm, color: button.dataset.color, dash: button.dataset.dash,
  }));
}

function figureOf(name) {
  return document.querySelector(`figure[data-chart="${name}"]`);
}

function series(looks, values) {
  return looks.map((look) => ({ look, values: values[look.name] }));
}

function drawShares(name, title, xs, values, xLabel) {
  const x = { low: xs[0], high: xs[xs.length - 1], logarithmic: true, label: xLabel };
  const y = { low: 0, high: 1, logarithmic: false };
  drawLines(figureOf(name), { title, words: `${title}, from 0 to 1`, xs, series: series(shown(), values), x, y });
}

function drawConvergence(problem) {
  const xs = problem.evaluations;
  const lines = shown().map((look) => {
    const [low, values, high] = problem.convergence[look.name];
    return { look, low, values, high };
  });
  const known = lines.flatMap((line) => [...line.low, ...line.values, ...line.high]).filter((value) => value !== null);
  const x = { low: xs[0], high: xs[xs.length - 1], logarithmic: true, label: "evaluations" };
  const y = spanOf(known.length ? known : [1, 10], problem.zero);
  const words = `Convergence on ${problem.name}; the table below has the ends`;
  drawLines(figureOf("convergence"), { title: "Median of the best so far", words, xs, series: lines, x, y });
}

function drawAgainstTime(problem) {
  const figure = figureOf("against-time");
  if (!problem.seconds) {
    figure.replaceChildren();
    return;
  }
  const xs = problem.seconds;
  const lines = series(shown(), problem.against_time);
  const known = lines.flatMap((line) => line.values).filter((value) => value !== null);
  const x = { low: xs[0], high: xs[xs.length - 1], logarithmic: true, label: "seconds of one core" };
  const y = spanOf(known.length ? known : [1, 10], problem.zero);
  const words = `Convergence on ${problem.name} against time; the table below has the seconds`;
  drawLines(figure, { title: "Median of the best so far, against time", words, xs, series: lines, x, y });
}

function drawProblem() {
  const problem = data.problems[chooser.selectedIndex];
  for (const part of document.querySelectorAll(".problem")) {
    part.hidden = Number(part.dataset.problem) !== chooser.selectedIndex;
  }
  drawConvergence(problem);
  drawAgainstTime(problem);
  drawShares("reached", "Share of targets reached", problem.evaluations, problem.reached, "evaluations");
  drawBoxes(figureOf("ends"), problem, shown());
}

function draw() {
  const { evaluations, reached, factors, profile } = data.overall;
  drawShares("overall-reached", "Share of targets reached", evaluations, reached, "evaluations");
  drawShares("profile", "Share of problems within a factor of the best", factors, profile, "factor");
  drawProblem();
}

function step(by) {
  const count = data.problems.length;
  chooser.selectedIndex = (chooser.selectedIndex + by + count) % count;
  drawProblem();
}

for (const button of buttons) {
  button.addEventListener("click", () => {
    button.setAttribute("aria-pressed", String(button.getAttribute("aria-pressed") !== "true"));
    draw();
  });
}
chooser.addEventListener("change", drawProblem);
document.getElementById("previous").addEventListener("click", () => step(-1));
document.getElementById("next").addEventListener("click", () => step(1));
window.addEventListener("resize", draw);
window.addEventListener("beforeprint", draw);
draw();
