"use strict";
function make(tag, text, name = "") {
  const element = document.createElement(tag);
  element.textContent = text;
  element.className = name;
  return element;
}
function setUp(root, points) {
  const [w, h] = points.tile, canvas = root.querySelector("canvas"), strip = root.querySelector(".strip");
  const sheet = new Image(), n = points.action.length;
  let which = "features", chosen = -1;
  const cut = (ctx, i, x, y) => ctx.drawImage(sheet, (i % 30) * w, Math.floor(i / 30) * h, w, h, x, y, w, h);
  function draw() {
    const cells = points.cells[which];
    canvas.width = w * (1 + Math.max(...cells.map(c => c[0])));
    canvas.height = h * (1 + Math.max(...cells.map(c => c[1])));
    const ctx = canvas.getContext("2d");
    cells.forEach(([c, r], i) => {
      cut(ctx, i, c * w, r * h);
      ctx.fillStyle = `rgba(${points.colors[points.action[i]]},.4)`;
      ctx.fillRect(c * w, r * h, w, h);
      if (i === chosen) { ctx.lineWidth = 5; ctx.strokeStyle = "#000"; ctx.strokeRect(c * w, r * h, w, h); }
    });
  }
  function at(event) {
    const box = canvas.getBoundingClientRect();
    const c = Math.floor((event.clientX - box.left) / box.width * canvas.width / w);
    const r = Math.floor((event.clientY - box.top) / box.height * canvas.height / h);
    return points.cells[which].findIndex(cell => cell[0] === c && cell[1] === r);
  }
  function thumbnail(i) {
    const small = document.createElement("canvas");
    small.width = w; small.height = h;
    cut(small.getContext("2d"), i, 0, 0);
    return small;
  }
  function bar(i, action) {
    const share = points.probabilities[i][action], length = make("i", "");
    const line = make("div", "", action === points.action[i] ? "bar chosen" : "bar");
    length.style.width = `${Math.max(1, 100 * share)}%`;
    line.append(make("span", points.names[action]), length, make("span", share.toFixed(2)));
    return line;
  }
  function choose(i) {
    if (i < 0 || i >= n || i === chosen) return;
    chosen = i;
    strip.replaceChildren();
    for (let k = Math.max(0, i - 3); k <= Math.min(n - 1, i + 3); k++) {
      if (points.episode[k] !== points.episode[i]) continue;
      const box = make("div", "", k === i ? "here" : "");
      box.append(thumbnail(k), `step ${points.step[k]}: ${points.names[points.action[k]]}`);
      strip.append(box);
    }
    const event = points.event[i] ? `, ${points.event[i]}` : "", episode = points.episode[i];
    const note = make("div", `episode ${episode}, step ${points.step[i]} of ${points.last[episode]}${event}`);
    note.append(...points.order.map(action => bar(i, action)));
    strip.append(note);
    draw();
  }
  for (const name of ["mousemove", "click"]) canvas.addEventListener(name, event => { choose(at(event)); });
  canvas.addEventListener("keydown", event => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (step) { choose(Math.min(n - 1, Math.max(0, chosen + step))); event.preventDefault(); }
  });
  root.querySelectorAll("button").forEach(button => button.addEventListener("click", () => {
    which = button.dataset.which;
    root.querySelectorAll("button").forEach(b => b.setAttribute("aria-pressed", b === button));
    draw();
  }));
  sheet.onload = () => { draw(); root.dataset.ready = "true"; };
  sheet.src = points.sprite;
}
document.querySelectorAll(".map").forEach(
  root => setUp(root, JSON.parse(root.querySelector("script").textContent)));
