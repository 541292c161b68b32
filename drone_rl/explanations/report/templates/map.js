"use strict";
const tip = document.getElementById("tip");
function make(tag, text, name) {
  const element = document.createElement(tag);
  element.textContent = text;
  element.className = name || "";
  return element;
}
function bars(points, i) {
  const p = points.probabilities[i], chosen = points.action[i];
  return points.order.map(a => {
    const bar = make("div", "", a === chosen ? "bar chosen" : "bar"), length = make("i", "");
    length.style.width = `${Math.max(1, 100 * p[a])}%`;
    bar.append(make("span", points.names[a]), length, make("span", p[a].toFixed(2)));
    return bar;
  });
}
function setUp(root, points) {
  const [w, h] = points.tile, canvas = root.querySelector("canvas"), strip = root.querySelector(".strip");
  const sheet = new Image(), n = points.action.length;
  let which = "features", chosen = -1;
  const cut = (ctx, i, x, y, dw, dh) =>
    ctx.drawImage(sheet, (i % 30) * w, Math.floor(i / 30) * h, w, h, x, y, dw, dh);
  function draw() {
    const cells = points.cells[which];
    canvas.width = w * (1 + Math.max(...cells.map(c => c[0])));
    canvas.height = h * (1 + Math.max(...cells.map(c => c[1])));
    const ctx = canvas.getContext("2d");
    cells.forEach(([c, r], i) => {
      cut(ctx, i, c * w, r * h, w, h);
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
  function picture(target, i, scale) {
    target.width = w; target.height = h;
    cut(target.getContext("2d"), i, 0, 0, w, h);
    if (scale) target.style.width = "100%";
  }
  function describe(i) {
    return `episode ${points.episode[i]}, step ${points.step[i]} of ${points.last[points.episode[i]]}` +
      (points.event[i] ? ", " + points.event[i] : "");
  }
  function hover(event) {
    const i = at(event);
    tip.style.display = i < 0 ? "none" : "block";
    if (i < 0) return;
    picture(tip.querySelector("canvas"), i, true);
    tip.querySelector("div").replaceChildren(...bars(points, i), make("small", describe(i)));
    const x = Math.min(event.clientX + 16, innerWidth - tip.offsetWidth - 8);
    const y = event.clientY + 16 + tip.offsetHeight > innerHeight ? event.clientY - tip.offsetHeight - 16 : event.clientY + 16;
    tip.style.left = `${Math.max(4, x)}px`; tip.style.top = `${Math.max(4, y)}px`;
  }
  function choose(i) {
    if (i < 0 || i >= n) return;
    chosen = i;
    strip.replaceChildren();
    for (let k = i - 3; k <= i + 3; k++) {
      if (k < 0 || k >= n || points.episode[k] !== points.episode[i]) continue;
      const box = document.createElement("div"), small = document.createElement("canvas");
      box.className = k === i ? "here" : "";
      picture(small, k, true);
      box.append(small, `step ${points.step[k]}: ${points.names[points.action[k]]}`);
      strip.append(box);
    }
    strip.append(make("div", describe(i), "note"));
    draw();
  }
  canvas.addEventListener("mousemove", hover);
  canvas.addEventListener("mouseleave", () => { tip.style.display = "none"; });
  canvas.addEventListener("click", event => { choose(at(event)); });
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
