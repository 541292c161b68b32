// Buttons that save a figure as PNG or SVG; they need no network.
function saveAs(name, uri) {
  const link = document.createElement("a");
  link.href = uri;
  link.download = name;
  link.click();
}
function asPng(name, uri, width, height) {
  const image = new Image();
  image.onload = () => {
    const canvas = document.createElement("canvas"), scale = Math.max(1, 1200 / width);
    canvas.width = width * scale; canvas.height = height * scale;
    const pen = canvas.getContext("2d");
    pen.fillStyle = "#fff";
    pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.drawImage(image, 0, 0, canvas.width, canvas.height);
    saveAs(name, canvas.toDataURL("image/png"));
  };
  image.src = uri;
}
function addButtons(figure, what, formats) {
  const line = document.createElement("p");
  line.className = "save";
  for (const [format, save] of Object.entries(formats)) {
    const button = document.createElement("button");
    button.textContent = format;
    button.setAttribute("aria-label", `Save as ${format}: ${what}`);
    button.addEventListener("click", save);
    line.append(button);
  }
  figure.append(line);
}
document.querySelectorAll("figure").forEach((figure, i) => {
  const image = figure.querySelector("img"), svg = figure.querySelector("svg.places");
  if (!image && !svg) return;
  const what = image ? image.alt : svg.getAttribute("aria-label");
  const name = `${i + 1}_${what.replace(/[^a-z0-9]+/gi, "_").slice(0, 60)}`;
  const drawn = () => {
    const copy = svg.cloneNode(true);
    copy.setAttribute("color", "#1e2024");
    copy.setAttribute("width", 900);
    copy.setAttribute("height", 900 * svg.viewBox.baseVal.height / svg.viewBox.baseVal.width);
    return `data:image/svg+xml;charset=utf-8,${encodeURIComponent(new XMLSerializer().serializeToString(copy))}`;
  };
  if (svg) {
    const size = svg.viewBox.baseVal;
    addButtons(figure, what, {
      PNG: () => asPng(`${name}.png`, drawn(), 900, 900 * size.height / size.width),
      SVG: () => saveAs(`${name}.svg`, drawn()),
    });
  } else if (image.src.startsWith("data:image/svg")) {
    addButtons(figure, what, {
      PNG: () => asPng(`${name}.png`, image.src, image.naturalWidth, image.naturalHeight),
      SVG: () => saveAs(`${name}.svg`, image.src),
    });
  } else addButtons(figure, what, { PNG: () => saveAs(`${name}.png`, image.src) });
});
