"use strict";

const $ = id => document.getElementById(id);
const CONTROLS = { // name: [label, keys]
  forward: ["↑ forward", ["ArrowUp", "w"]], backward: ["↓ back", ["ArrowDown", "s"]],
  left: ["← left", ["ArrowLeft", "a"]], right: ["→ right", ["ArrowRight", "d"]],
  up: ["⤒ up", ["PageUp", "r"]], down: ["⤓ down", ["PageDown", "f"]],
  yaw_left: ["↺ turn left", ["q"]], yaw_right: ["↻ turn right", ["e"]],
  pitch_up: ["nose up", ["i"]], pitch_down: ["nose down", ["k"]],
  roll_left: ["roll left", ["j"]], roll_right: ["roll right", ["l"]],
};
const GROUPS = [["yaw_left", "forward", "yaw_right", "left", "backward", "right"],
  ["up", "pitch_up", "roll_left", "down", "pitch_down", "roll_right"], ["t", "g"]];
const BUTTONS = { t: "take off", g: "land" };
const COMMANDS = { // key: function
  p: () => handOver(), n: () => send({ type: "reset" }), c: () => nextCamera(), v: () => toggleRecord(),
  m: () => nextMode(), t: () => send({ type: "take_off" }), g: () => send({ type: "land" }),
};
const SHOWN_KEYS = { ArrowUp: "↑", ArrowDown: "↓", ArrowLeft: "←", ArrowRight: "→", PageUp: "PgUp", PageDown: "PgDn" };
const SLIDERS = {
  speed: ["Speed", "m/s", .5], wind: ["Wind", "m/s", .5], wind_from: ["Wind from", "°", 5], light: ["Light", "×", .05],
};
const TRAIL = 1000;
const CHARTS_MS = 66; // between two drawings of map, attitude and bars

let hello = null, state = null, socket = null;
const held = new Map(); // control: what holds it ("key w", "pad", ...)
let bitmaps = []; // decoded images that are not drawn yet, and their names
let trail = [], places = [], episode = 0, pendingAcks = 0;
const stats = { displayed: 0, since: performance.now() };
window.flyStats = stats;

// The socket

function send(message) {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

function connect() {
  const url = new URL("socket", location.href);
  url.protocol = "ws:";
  socket = new WebSocket(url);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => connection("connected", false);
  socket.onclose = () => {
    letGoOfAll();
    connection("no connection: drone-rl fly has ended, or is too busy", true);
    setTimeout(connect, 2000);
  };
  socket.onmessage = event => {
    if (typeof event.data === "string") text(JSON.parse(event.data)); else frame(event.data);
  };
}

function connection(words, isBad) {
  set("connection", words);
  $("connection").classList.toggle("bad", isBad);
}

function text(message) {
  if (message.error) { $("problem").textContent = message.error; return; }
  hello = message;
  begin();
}

async function frame(buffer) {
  const size = new DataView(buffer).getUint32(0, true);
  const next = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size)));
  let at = 4 + size;
  const parts = next.images.map(({ name, type, size: length }) => {
    const blob = new Blob([new Uint8Array(buffer, at, length)], { type });
    at += length;
    return createImageBitmap(blob).then(bitmap => [name, bitmap]);
  });
  const decoded = await Promise.all(parts);
  pendingAcks += 1;
  const isLate = state && next.frame <= state.frame; // a newer frame was decoded faster
  (isLate ? decoded : bitmaps).forEach(([, bitmap]) => bitmap.close());
  if (isLate) return;
  bitmaps = decoded;
  take(next);
}

// State

function take(next) {
  const before = state;
  state = next;
  if (next.episode !== episode) { trail = []; places = []; episode = next.episode; $("problem").textContent = ""; }
  const [x, y] = next.position, last = trail[trail.length - 1];
  if (!last || Math.hypot(x - last[0], y - last[1]) > .05) trail.push([x, y]);
  if (trail.length > TRAIL) trail = trail.filter((_, i) => i % 2);
  next.objects.forEach((place, i) => { if (place) places[i] = place; });
  if (!before || JSON.stringify(shownOf(before)) !== JSON.stringify(shownOf(next))) describe();
}

const shownOf = s => [s.pilot, s.mode, s.camera, s.recording, s.saliency, s.settings, s.texts];

function describe() {
  const s = state, isPerson = s.pilot === "person";
  write(s.texts);
  $("camera").value = s.camera;
  $("person").setAttribute("aria-pressed", isPerson);
  $("policy").setAttribute("aria-pressed", !isPerson);
  $("mode").value = s.mode;
  $("record").setAttribute("aria-pressed", s.recording.on);
  $("end").hidden = !s.texts.end;
  if (s.recording.problem) set("problem", s.recording.problem);
  $("saliency").checked = s.saliency;
  for (const name of Object.keys(SLIDERS)) slider(name);
  pad();
}

function write(texts) { for (const [id, words] of Object.entries(texts)) set(id, words); }

function set(place, words) {
  const element = typeof place === "string" ? $(place) : place;
  if (element.textContent !== words) element.textContent = words;
}

// What people do

function hold(source, control) { if (held.get(source) !== control) { held.set(source, control); sendHeld(); } }
function letGo(source) { if (held.delete(source)) sendHeld(); }
function letGoOfAll() { if (held.size) { held.clear(); sendHeld(); } }

function sendHeld() {
  const names = [...new Set(held.values())];
  send({ type: "hold", controls: names });
  document.querySelectorAll("#pad button").forEach(b => b.classList.toggle("held", names.includes(b.dataset.control)));
}

function handOver() { send({ type: "pilot", pilot: state && state.pilot === "person" ? "policy" : "person" }); }
function toggleRecord() { send({ type: "record", on: !(state && state.recording.on) }); }
function following(list, now) { return list[(list.indexOf(now) + 1) % list.length]; }
function nextCamera() { send({ type: "camera", camera: following(hello.cameras, state.camera) }); }
function nextMode() { send({ type: "mode", mode: following(["actions", "computer_vision", "simple_flight"], state.mode) }); }

function usable(control) {
  if (!state || state.pilot === "policy") return false;
  if (state.mode === "computer_vision") return !BUTTONS[control];
  if (state.mode === "simple_flight") return !/pitch|roll/.test(control);
  return hello.controls.includes(control);
}

const keyOf = event => event.key.length === 1 ? event.key.toLowerCase() : event.key;
const byKey = {};
for (const [name, [, keys]] of Object.entries(CONTROLS)) for (const key of keys) byKey[key] = name;

$("deck").addEventListener("keydown", event => {
  if (event.ctrlKey || event.altKey || event.metaKey || !hello) return;
  const key = keyOf(event);
  if (byKey[key]) {
    event.preventDefault();
    if (!event.repeat) hold(`key ${key}`, byKey[key]);
  } else if (COMMANDS[key] && !event.repeat) {
    event.preventDefault();
    COMMANDS[key]();
  }
});
document.addEventListener("keyup", event => letGo(`key ${keyOf(event)}`));
window.addEventListener("blur", letGoOfAll);
document.addEventListener("visibilitychange", letGoOfAll);
$("deck").addEventListener("blur", () => { letGoOfAll(); hint(); });
$("deck").addEventListener("focus", hint);
$("view").addEventListener("pointerdown", () => $("deck").focus({ preventScroll: true }));

function hint() {
  const hasKeys = matchMedia("(hover: hover) and (pointer: fine)").matches;
  $("hint").hidden = !hasKeys || document.activeElement === $("deck");
}

function clicked(id, act) {
  $(id).addEventListener("click", event => {
    act();
    if (event.detail) $("deck").focus({ preventScroll: true }); // by pointer, not by the keyboard
  });
}
clicked("person", () => send({ type: "pilot", pilot: "person" }));
clicked("policy", () => send({ type: "pilot", pilot: "policy" }));
clicked("reset", () => send({ type: "reset" }));
clicked("record", toggleRecord);
$("mode").addEventListener("change", () => send({ type: "mode", mode: $("mode").value }));
$("camera").addEventListener("change", () => send({ type: "camera", camera: $("camera").value }));
$("saliency").addEventListener("change", () => send({ type: "saliency", on: $("saliency").checked }));

// Built once

function begin() {
  state = null; // the next frame updates what is built here, also after a lost connection
  set("legend", `Seen from above, ahead is up. Triangle: drone. Line: trail. Squares: ${hello.object}s, dashed where one has gone.`);
  write(hello.texts);
  build();
  $("deck").focus({ preventScroll: true });
  hint();
}

function joined(items, text) { return items.map(text).join(""); }
function keyCaps(keys) { return joined(keys, key => `<kbd>${SHOWN_KEYS[key] || key.toUpperCase()}</kbd> `); }

function build() {
  $("pad").innerHTML = joined(GROUPS, group => `<div class="group">${joined(group, name => {
    const [label, keys] = CONTROLS[name] || [BUTTONS[name], [name]];
    return `<button type="button" data-control="${name}">${label}<br>${keyCaps(keys)}</button>`;
  })}</div>`);
  $("sliders").innerHTML = joined(Object.entries(SLIDERS), ([name, [label, , step]]) => `<div class="slider">
    <label for="s-${name}">${label}</label><input type="range" id="s-${name}" name="${name}" step="${step}"
    min="${hello.limits[name][0]}" max="${hello.limits[name][1]}"><output></output></div>`);
  $("bars").innerHTML = joined(hello.order, () => '<div class="share"><span></span><span class="track"><i></i></span><span></span></div>');
}

function onPad(kinds, act) { // act(what the button holds, its name, the event)
  for (const kind of kinds.split(" ")) $("pad").addEventListener(kind, event => {
    const button = event.target.closest("button");
    if (button) act(`pad ${button.dataset.control}`, button.dataset.control, event, button);
  });
}
onPad("pointerdown", (source, name, event, button) => {
  if (!CONTROLS[name]) return;
  button.setPointerCapture(event.pointerId);
  hold(source, name);
});
onPad("pointerup pointercancel lostpointercapture focusout keyup", letGo);
onPad("contextmenu", (source, name, event) => event.preventDefault());
onPad("keydown", (source, name, event) => {
  if (!CONTROLS[name] || event.key !== " " && event.key !== "Enter" || event.repeat) return;
  event.preventDefault();
  hold(source, name);
});
onPad("click", (source, name) => { if (BUTTONS[name]) COMMANDS[name](); });
$("sliders").addEventListener("input", ({ target }) => {
  send({ type: "set", name: target.name, value: Number(target.value) });
  slider(target.name, Number(target.value));
});
$("sliders").addEventListener("pointerup", () => $("deck").focus({ preventScroll: true }));

function pad() {
  const isPerson = state.pilot === "person", words = {
    actions: "One press is one action of the policy; time stands still between them. These flights can be recorded.",
    computer_vision: "A press moves the drone by 0.25 m or turns it by 5 degrees, without physics.",
    simple_flight: "Hold a key to fly at the speed below; let go to brake and hover.",
  }[state.mode];
  set("help", isPerson ? words : "You, or P, takes the controls back.");
  document.querySelectorAll("#pad button").forEach(button => { button.hidden = !usable(button.dataset.control); });
}

function slider(name, given) {
  const input = $(`s-${name}`), [, unit] = SLIDERS[name];
  const value = given === undefined ? state.settings[name] : given;
  if (given === undefined && document.activeElement !== input) input.value = value;
  set(input.nextElementSibling, `${value.toFixed(1)} ${unit}`);
}

function drawBars() {
  const most = Math.max(...state.probabilities), words = [];
  hello.order.forEach((part, i) => {
    const row = $("bars").children[i], share = state.probabilities[part];
    row.classList.toggle("first", share === most);
    row.querySelector("i").style.width = `${100 * share}%`;
    row.firstChild.textContent = hello.actions[part];
    row.lastChild.textContent = `${Math.round(100 * share)}%`;
    words.push(`${row.firstChild.textContent} ${row.lastChild.textContent}`);
  });
  $("bars").setAttribute("aria-label", `Action probabilities: ${words.join(", ")}`);
}

// Drawing

function drawMap() {
  const { clientWidth: width, clientHeight: height } = $("map"), { objects } = state;
  const [ahead, aside] = state.position, shown = [[0, 0], [ahead, aside], ...places.filter(Boolean)];
  const low = Math.min(...shown.map(p => p[0])) - 3, high = Math.max(...shown.map(p => p[0])) + 3;
  const side = Math.max(8, ...shown.map(p => Math.abs(p[1]))) + 3;
  const scale = Math.min((height - 16) / (high - low), (width - 16) / (2 * side));
  const u = y => width / 2 - y * scale, v = x => height - 8 - (x - low) * scale;
  const step = [5, 10, 20, 50, 100, 200, 500, 1000].find(s => s * scale >= 26) || 5000;
  const edge = Math.max(6, hello.size * scale), parts = [];
  for (let x = Math.ceil(low / step) * step; x <= high; x += step) {
    parts.push(`<path class="line" d="M0 ${v(x)}H${width}"/><text x="4" y="${v(x) - 3}">${x} m</text>`);
  }
  parts.push(`<polyline points="${trail.map(([x, y]) => `${u(y)},${v(x)}`).join(" ")}"/>`);
  places.forEach(([x, y], i) => parts.push(`<rect class="${objects[i] ? "there" : ""}" x="${u(y) - edge / 2}"
    y="${v(x) - edge / 2}" width="${edge}" height="${edge}"/>`));
  parts.push(`<path class="drone" d="M0-11L8 9L0 4L-8 9Z" transform="translate(${u(aside)} ${v(ahead)}) rotate(${state.attitude[2]})"/>`);
  $("map").innerHTML = parts.join("");
  $("map").setAttribute("aria-label", `Map from above. Drone ${ahead.toFixed(1)} m ahead of the start and ` +
    `${Math.abs(aside).toFixed(1)} m to the ${aside < 0 ? "right" : "left"}, ${objects.filter(Boolean).length} ${hello.object}s left.`);
}

function drawNumbers() {
  const [roll, pitch, yaw] = state.attitude.map(angle => `${Math.round(angle)}°`);
  const rows = { roll, pitch, yaw, height: `${state.position[2].toFixed(1)} m`, speed: `${state.velocity.toFixed(1)} m/s`,
    steps: state.steps };
  $("numbers").innerHTML = joined(Object.entries(rows), ([name, value]) => `<dt>${name}</dt><dd>${value}</dd>`);
}

let drawn = null, drawnAt = 0;

function loop(now) {
  if (state && hello) {
    for (const [name, bitmap] of bitmaps) {
      Object.assign($(name), { width: bitmap.width, height: bitmap.height }).getContext("bitmaprenderer").transferFromImageBitmap(bitmap);
      if (name === "view") stats.displayed += 1;
    }
    bitmaps = [];
    if (drawn !== state && now - drawnAt >= CHARTS_MS) {
      [drawn, drawnAt] = [state, now];
      drawBars();
      drawMap();
      drawNumbers();
    }
  }
  for (; pendingAcks > 0; pendingAcks -= 1) send({ type: "ack" });
  requestAnimationFrame(loop);
}

requestAnimationFrame(loop);
connect();
