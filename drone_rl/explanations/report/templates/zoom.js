document.querySelectorAll(".exact").forEach(figure => {
  const map = figure.querySelector("svg"), where = figure.querySelector(".where");
  const whole = map.getAttribute("viewBox").split(" ").map(Number);
  let box = [...whole], held = null;
  const show = () => map.setAttribute("viewBox", box.join(" "));
  function at(event) {
    const place = map.getScreenCTM().inverse();
    return new DOMPoint(event.clientX, event.clientY).matrixTransform(place);
  }
  function zoom(x, y, factor) {
    const size = Math.min(whole[2], Math.max(whole[2] * 1e-4, box[2] * factor)) / box[2];
    box = [x - (x - box[0]) * size, y - (y - box[1]) * size, box[2] * size, box[3] * size];
    if (box[2] >= whole[2]) box = [...whole];
    show();
  }
  map.addEventListener("wheel", event => {
    const { x, y } = at(event);
    zoom(x, y, Math.exp(event.deltaY * .002));
    event.preventDefault();
  }, { passive: false });
  map.addEventListener("pointerdown", event => { held = at(event); map.setPointerCapture(event.pointerId); });
  for (const end of ["pointerup", "pointercancel"]) map.addEventListener(end, () => { held = null; });
  map.addEventListener("pointermove", event => {
    const { x, y } = at(event);
    if (held) { box[0] -= x - held.x; box[1] -= y - held.y; show(); }
    const action = event.target.querySelector(":scope > title"); // none while the map itself is held
    where.textContent = `${(-y).toFixed(3)} m ahead, ${Math.abs(x).toFixed(3)} m to the ${x < 0 ? "left" : "right"}` +
      (action ? `: ${action.textContent}` : "");
  });
  map.addEventListener("dblclick", () => { box = [...whole]; show(); });
});
