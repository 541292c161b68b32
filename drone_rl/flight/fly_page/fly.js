"use strict";

const $ = id => document.getElementById(id);
const CONTROLS = { // name: [label, arrow, keys]
  forward: ["forward", "↑", ["ArrowUp", "w"]], backward: ["back", "↓", ["ArrowDown", "s"]],
  left: ["left", "←", ["ArrowLeft", "a"]], right: ["right", "→", ["ArrowRight", "d"]],
  up: ["up", "⤒", ["PageUp", "r"]], down: ["down", "⤓", ["PageDown", "f"]],
  yaw_left: ["turn left", "↺", ["q"]], yaw_right: ["turn right", "↻", ["e"]],
  pitch_up: ["nose up", "", ["i"]], pitch_down: ["nose down", "", ["k"]],
  roll_left: ["roll left", "", ["j"]], roll_right: ["roll right", "", ["l"]],
};
const GROUPS = [["yaw_left", "forward", "yaw_right", "left", "backward", "right"],
  ["up", "pitch_up", "roll_left", "down", "pitch_down", "roll_right"]];
const COMMANDS = { // key: [label, function]; those of simple flight are buttons, too
  p: ["hand over, or take back", () => handOver()],
  n: ["new episode", () => send({ type: "reset" })],
  c: ["next camera", () => nextCamera()],
  v: ["record on or off", () => toggleRecord()],
  m: ["your next controls", () => nextMode()],
  t: ["take off (simple flight)", () => send({ type: "take_off" })],
  g: ["land (simple flight)", () => send({ type: "land" })],
};
const SHOWN_KEYS = { ArrowUp: "↑", ArrowDown: "↓", ArrowLeft: "←", ArrowRight: "→", PageUp: "PgUp", PageDown: "PgDn" };
const SLIDERS = {
  speed: ["Speed", "m/s", .5], wind: ["Wind", "m/s", .5], wind_from: ["Wind from", "°", 5], light: ["Light", "×", .05],
};
const MODES = { actions: "the policy's actions", computer_vision: "computer vision", simple_flight: "simple flight" };
const TRAIL = 3000;
const DEAD = .12;
const CHARTS_MS = 66; // between two drawings of map, horizon and bars

let hello = null, state = null, socket = null;
const held = new Map(); // control: what holds it ("key w", "pad", ...)
const images = {}; // newest decoded bitmaps
const fresh = new Set(); // names of bitmaps that are not drawn yet
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
  $("connection").textContent = words;
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
  const bitmaps = await Promise.all(parts);
  pendingAcks += 1;
  if (state && next.frame <= state.frame) { // a newer frame was decoded faster
    bitmaps.forEach(([, bitmap]) => bitmap.close());
    return;
  }
  for (const [name, bitmap] of bitmaps) {
    if (images[name]) images[name].close();
    images[name] = bitmap;
    fresh.add(name);
  }
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

const shownOf = s => [s.pilot, s.mode, s.camera, s.end, s.goals, s.recording, s.saliency, s.settings, s.note];

function describe() {
  if (hello.watch) {
    $("camera").value = state.camera;
    set("flyer", `A program flies ${state.vehicle}`);
    set("note", state.note);
    return;
  }
  const s = state, isPerson = s.pilot === "person", c = words(s);
  $("person").setAttribute("aria-pressed", isPerson);
  $("policy").setAttribute("aria-pressed", !isPerson);
  $("mode").value = s.mode;
  $("camera").value = s.camera;
  $("record").setAttribute("aria-pressed", s.recording.on);
  set("flyer", isPerson ? `You fly: ${MODES[s.mode]}` : `The policy ${hello.policy} flies`);
  set("score", c.score);
  set("end", c.end);
  $("end").hidden = !c.end;
  set("note", s.note);
  set("recording", c.recording);
  if (s.recording.problem) set("problem", s.recording.problem);
  set("method", c.saliency);
  $("saliency").checked = s.saliency.on;
  for (const name of Object.keys(SLIDERS)) slider(name);
  pad();
}

function words(s) {
  const [reached, missed] = s.goals || [null, null];
  const of = hello.total === null ? "" : ` of ${hello.total}`;
  const goals = (hello.total === null ? reached : hello.total) === 1 ? hello.goal : `${hello.goal}s`;
  const isFree = s.pilot === "person" && s.mode !== "actions";
  const end = s.end === null || isFree ? "" : `Episode over, ${s.end}. ` +
    (s.pilot === "person" ? "New episode, or N, starts the next." : "The next one begins.");
  const score = s.goals ? `${reached}${of} ${goals} ${hello.reached}` + (missed ? `, ${missed} missed` : "") : `return ${s.reward}`;
  const saved = `${s.recording.saved} saved in ${hello.demonstrations}`;
  const recording = s.recording.on ? `Recording: ${saved}.` : s.recording.saved ? `Recorded flights: ${saved}.` :
    "Record writes what you fly by the policy's actions, or what the policy flies, as demonstrations.";
  const method = (s.saliency.method || "").replaceAll("_", " ");
  const saliency = {
    off: "tested when it is switched on", testing: "testing methods on this policy; this takes a minute or so",
    shown: `bright pixels affect the most probable action; method ${method}, which passed the tests on this policy`,
    none: "no method passes the tests on this policy, so none is shown",
    failed: `the methods can't be tested: ${s.saliency.problem}`,
  }[s.saliency.state];
  return { end, score, recording, saliency };
}

function set(id, words) { if ($(id).textContent !== words) $(id).textContent = words; }

// What people do

function sendHeld() { send({ type: "hold", controls: [...new Set(held.values())] }); }

function hold(source, control) {
  if (held.get(source) === control) return;
  held.set(source, control);
  sendHeld();
  marks();
}

function letGo(source) {
  if (!held.delete(source)) return;
  sendHeld();
  marks();
}

function letGoOfAll() {
  if (!held.size) return;
  held.clear();
  sendHeld();
  marks();
}

function marks() {
  const names = new Set(held.values());
  document.querySelectorAll("#pad button").forEach(b => b.classList.toggle("held", names.has(b.dataset.control)));
}

function handOver() { send({ type: "pilot", pilot: state && state.pilot === "person" ? "policy" : "person" }); }
function toggleRecord() { send({ type: "record", on: !(state && state.recording.on) }); }
function following(list, now) { return list[(list.indexOf(now) + 1) % list.length]; }
function nextCamera() { send({ type: "camera", camera: following(hello.cameras, state.camera) }); }
function nextMode() { send({ type: "mode", mode: following(Object.keys(MODES), state.mode) }); }

function usable(control) {
  if (!state || state.pilot === "policy") return false;
  if (state.mode === "computer_vision") return true;
  if (state.mode === "simple_flight") return !/pitch|roll/.test(control);
  return hello.discrete ? hello.actions.includes(control) : /forward|left|right/.test(control) && !/roll/.test(control);
}

const keyOf = event => event.key.length === 1 ? event.key.toLowerCase() : event.key;
const byKey = {};
for (const [name, [, , keys]] of Object.entries(CONTROLS)) for (const key of keys) byKey[key] = name;

$("deck").addEventListener("keydown", event => {
  if (event.ctrlKey || event.altKey || event.metaKey || !hello || hello.watch) return;
  const key = keyOf(event);
  if (byKey[key]) {
    event.preventDefault();
    if (!event.repeat) hold(`key ${key}`, byKey[key]);
  } else if (COMMANDS[key] && !event.repeat) {
    event.preventDefault();
    COMMANDS[key][1]();
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
  if (hello.watch) {
    document.body.classList.add("watching");
    document.querySelector("h1").textContent = document.title = "Watch a program fly";
    set("task", `AirSim's server: ${hello.watch}.`);
    return;
  }
  set("name", hello.policy);
  set("task", `Task: ${hello.task.replaceAll("_", " ")}. The policy's actions: ${hello.actions.join(", ")}.`);
  buildPad();
  buildSliders();
  buildKeys();
  buildBars();
  document.querySelector("details").open = matchMedia("(min-width: 34rem)").matches;
  $("deck").focus({ preventScroll: true });
  hint();
}

function element(tag, parent, words = "", name = "") {
  const made = document.createElement(tag);
  made.textContent = words;
  if (name) made.className = name;
  parent.append(made);
  return made;
}

function buildPad() {
  $("pad").replaceChildren();
  for (const group of GROUPS) {
    const box = element("div", $("pad"), "", "group");
    group.forEach((name, i) => {
      const [label, arrow, keys] = CONTROLS[name];
      const button = padButton(box, arrow ? `${arrow} ${label}` : label, keys);
      button.dataset.control = name;
      button.style.gridArea = `${1 + Math.floor(i / 3)} / ${1 + i % 3}`;
      holdable(button, `pad ${name}`, name);
    });
  }
  const box = element("div", $("pad"), "", "group");
  box.id = "ground";
  for (const [key, label] of [["t", "take off"], ["g", "land"]]) {
    padButton(box, label, [key]).addEventListener("click", COMMANDS[key][1]);
  }
}

function padButton(box, label, keys) {
  const button = element("button", box);
  button.type = "button";
  element("span", button, label);
  element("br", button);
  element("kbd", button, keys.map(key => SHOWN_KEYS[key] || key.toUpperCase()).join(" "));
  return button;
}

function holdable(button, source, name) {
  button.addEventListener("pointerdown", event => { button.setPointerCapture(event.pointerId); hold(source, name); });
  for (const kind of ["pointerup", "pointercancel", "lostpointercapture", "blur", "keyup"]) {
    button.addEventListener(kind, () => letGo(source));
  }
  button.addEventListener("contextmenu", event => event.preventDefault());
  button.addEventListener("keydown", event => {
    if (event.key !== " " && event.key !== "Enter" || event.repeat) return;
    event.preventDefault();
    hold(source, name);
  });
}

function pad() {
  const isPerson = state.pilot === "person", words = {
    actions: "One press is one action of the policy; time stands still between them. These flights can be recorded.",
    computer_vision: "A press moves the drone by 0.25 m or turns it by 5 degrees, without physics.",
    simple_flight: "Hold a key to fly at the speed below; let go to brake and hover.",
  }[state.mode];
  set("help", isPerson ? words : "You, or P, takes the controls back.");
  $("pad").hidden = !isPerson;
  $("ground").hidden = state.mode !== "simple_flight";
  document.querySelectorAll("#pad [data-control]").forEach(button => { button.hidden = !usable(button.dataset.control); });
  document.querySelectorAll("#pad .group").forEach(group => { if (group.id !== "ground") group.hidden = !group.querySelector("button:not([hidden])"); });
}

function buildSliders() {
  $("sliders").replaceChildren();
  for (const [name, [label, , step]] of Object.entries(SLIDERS)) {
    const row = element("div", $("sliders"), "", "slider");
    element("label", row, label).htmlFor = `s-${name}`;
    const input = element("input", row);
    const [low, high] = hello.limits[name];
    Object.assign(input, { type: "range", id: `s-${name}`, min: low, max: high, step });
    element("output", row).htmlFor = input.id;
    element("small", row);
    input.addEventListener("input", () => {
      send({ type: "set", name, value: Number(input.value) });
      slider(name, Number(input.value));
    });
    input.addEventListener("pointerup", () => $("deck").focus({ preventScroll: true }));
  }
}

function slider(name, given) {
  const input = $(`s-${name}`), row = input.parentElement, [, unit] = SLIDERS[name];
  const value = given === undefined ? state.settings[name] : given;
  if (given === undefined && document.activeElement !== input) input.value = value;
  const shown = name === "wind_from" ? `${Math.round(value)}° ${compass(value)}` :
    name === "light" ? `${Math.round(100 * value)}%` : `${value.toFixed(1)} ${unit}`;
  if (row.querySelector("output").textContent !== shown) row.querySelector("output").textContent = shown;
  const isFlying = hello.dynamics || state.mode === "simple_flight" && state.pilot === "person";
  const why = name === "wind" && !isFlying ? "moves only drones with dynamics: simple flight" :
    name === "speed" && hello.dynamics && (state.pilot === "policy" || state.mode === "actions") ?
      "the policy's actions have speeds of their own" : "";
  const small = row.querySelector("small");
  if (small.textContent !== why) small.textContent = why;
}

function compass(degrees) {
  return ["ahead", "ahead right", "right", "behind right", "behind", "behind left", "left", "ahead left"][Math.round(degrees / 45) % 8];
}

function buildKeys() {
  $("keys").replaceChildren();
  const rows = GROUPS.flat().map(name => [CONTROLS[name][2], CONTROLS[name][0]]);
  rows.push(...Object.entries(COMMANDS).map(([key, [label]]) => [[key], label]));
  for (const [keys, label] of rows) {
    const term = element("dt", $("keys"));
    keys.forEach(key => { element("kbd", term, SHOWN_KEYS[key] || key.toUpperCase()); term.append(" "); });
    element("dd", $("keys"), label);
  }
}

function buildBars() {
  $("bars").replaceChildren();
  for (const part of hello.order) {
    const row = element("div", $("bars"), "", "share");
    row.dataset.part = part;
    element("span", row, hello.actions[part]);
    element("i", element("span", row, "", "track"));
    element("span", row);
  }
}

function drawBars() {
  const shares = state.probabilities, most = shares.indexOf(Math.max(...shares));
  const told = [];
  document.querySelectorAll("#bars .share").forEach(row => {
    const part = Number(row.dataset.part), percent = Math.round(100 * shares[part]);
    row.classList.toggle("first", part === most);
    row.querySelector("i").style.width = `${100 * shares[part]}%`;
    row.lastChild.textContent = `${percent}%`;
    told.push(`${hello.actions[part]} ${percent}%`);
  });
  $("bars").setAttribute("aria-label", `Action probabilities: ${told.join(", ")}`);
}

// Drawing

const color = name => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
let colors = {};
function readColors() { for (const n of ["ink", "soft", "line", "card", "cube", "trail", "sky", "ground", "back"]) colors[n] = color(n); }
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", readColors);
readColors();

function sized(canvas) {
  const ratio = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const brush = canvas.getContext("2d");
  brush.setTransform(ratio, 0, 0, ratio, 0, 0);
  brush.clearRect(0, 0, width, height);
  return [brush, width, height];
}

function drawImage(name) {
  const canvas = $(name), bitmap = images[name];
  if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
    canvas.width = bitmap.width;
    canvas.height = bitmap.height;
  }
  canvas.getContext("2d").drawImage(bitmap, 0, 0);
}

function drawMap() {
  const [brush, width, height] = sized($("map"));
  const known = [[0, 0], state.position, ...places.filter(Boolean)];
  const low = Math.min(...known.map(p => p[0])) - 3, high = Math.max(...known.map(p => p[0])) + 3;
  const side = Math.max(8, ...known.map(p => Math.abs(p[1]))) + 3;
  const scale = Math.min((height - 16) / (high - low), (width - 16) / (2 * side));
  const to = (x, y) => [width / 2 - y * scale, height - 8 - (x - low) * scale];
  brush.strokeStyle = colors.line;
  brush.fillStyle = colors.soft;
  brush.lineWidth = 1;
  brush.font = "11px system-ui, sans-serif";
  brush.textAlign = "left";
  const step = [5, 10, 20, 50, 100, 200, 500, 1000].find(s => s * scale >= 26) || 5000;
  for (let x = Math.ceil(low / step) * step; x <= high; x += step) {
    const [, v] = to(x, 0);
    brush.beginPath(); brush.moveTo(0, v); brush.lineTo(width, v); brush.stroke();
    brush.fillText(`${x} m`, 4, v - 3);
  }
  const { wind, wind_from: from } = state.settings;
  if (wind > 0) drawWind(brush, width - 26, 26, wind, from);
  brush.strokeStyle = colors.trail;
  brush.lineWidth = 2.5;
  brush.lineJoin = "round";
  brush.beginPath();
  trail.forEach(([x, y], i) => { const [u, v] = to(x, y); if (i) brush.lineTo(u, v); else brush.moveTo(u, v); });
  brush.stroke();
  const edge = Math.max(6, hello.size * scale);
  places.forEach((place, i) => {
    if (!place) return;
    const [u, v] = to(place[0], place[1]), isThere = Boolean(state.objects[i]);
    brush.lineWidth = 2;
    brush.strokeStyle = isThere ? colors.ink : colors.soft;
    brush.setLineDash(isThere ? [] : [3, 3]);
    if (isThere) { brush.fillStyle = colors.cube; brush.fillRect(u - edge / 2, v - edge / 2, edge, edge); }
    brush.strokeRect(u - edge / 2, v - edge / 2, edge, edge);
  });
  brush.setLineDash([]);
  const [u, v] = to(state.position[0], state.position[1]);
  arrow(brush, u, v, state.attitude[2] * Math.PI / 180, 11);
  const told = `Map from above. Drone ${state.position[0].toFixed(1)} m ahead of the start and ` +
    `${Math.abs(state.position[1]).toFixed(1)} m to the ${state.position[1] < 0 ? "right" : "left"}, ` +
    `${state.objects.filter(Boolean).length} ${hello.object}s left.`;
  if ($("map").getAttribute("aria-label") !== told) $("map").setAttribute("aria-label", told);
}

function arrow(brush, u, v, turn, size) {
  brush.save();
  brush.translate(u, v);
  brush.rotate(turn);
  brush.beginPath();
  brush.moveTo(0, -size); brush.lineTo(.7 * size, .8 * size); brush.lineTo(0, .4 * size); brush.lineTo(-.7 * size, .8 * size);
  brush.closePath();
  brush.fillStyle = colors.ink;
  brush.strokeStyle = colors.card;
  brush.lineWidth = 1.5;
  brush.fill();
  brush.stroke();
  brush.restore();
}

function drawWind(brush, u, v, wind, from) {
  brush.save();
  brush.translate(u, v);
  brush.rotate((from + 180) * Math.PI / 180);
  brush.strokeStyle = brush.fillStyle = colors.soft;
  brush.lineWidth = 2;
  brush.beginPath(); brush.moveTo(0, 10); brush.lineTo(0, -10); brush.lineTo(-5, -4); brush.moveTo(0, -10); brush.lineTo(5, -4); brush.stroke();
  brush.restore();
  brush.fillStyle = colors.soft;
  brush.textAlign = "center";
  brush.fillText(`${wind.toFixed(1)} m/s`, u, v + 24);
}

function drawHorizon() {
  const [brush, width, height] = sized($("horizon"));
  const [roll, pitch] = state.attitude, radius = Math.min(width, height) / 2 - 2;
  brush.save();
  brush.translate(width / 2, height / 2);
  brush.beginPath(); brush.arc(0, 0, radius, 0, 2 * Math.PI); brush.clip();
  brush.rotate(-roll * Math.PI / 180);
  const level = pitch * radius / 45;
  brush.fillStyle = colors.sky; brush.fillRect(-2 * radius, -4 * radius, 4 * radius, 4 * radius + level);
  brush.fillStyle = colors.ground; brush.fillRect(-2 * radius, level, 4 * radius, 4 * radius);
  brush.strokeStyle = colors.ink; brush.lineWidth = 1.5;
  brush.beginPath(); brush.moveTo(-2 * radius, level); brush.lineTo(2 * radius, level);
  for (const mark of [-30, -20, -10, 10, 20, 30]) {
    const v = level - mark * radius / 45, half = mark % 20 ? .18 : .3;
    brush.moveTo(-half * radius, v); brush.lineTo(half * radius, v);
  }
  brush.stroke();
  brush.restore();
  brush.strokeStyle = colors.ink; brush.lineWidth = 3;
  brush.beginPath();
  brush.moveTo(width / 2 - .55 * radius, height / 2); brush.lineTo(width / 2 - .2 * radius, height / 2);
  brush.moveTo(width / 2 + .2 * radius, height / 2); brush.lineTo(width / 2 + .55 * radius, height / 2);
  brush.stroke();
  brush.beginPath(); brush.arc(width / 2, height / 2, 3, 0, 2 * Math.PI); brush.stroke();
}

function drawNumbers() {
  const [roll, pitch, yaw] = state.attitude.map(angle => `${Math.round(angle)}°`);
  const rows = { roll, pitch, yaw, height: `${state.position[2].toFixed(1)} m`, speed: `${state.velocity.toFixed(1)} m/s` };
  if (hello.watch) rows.time = `${state.time.toFixed(2)} s`; else rows.steps = state.steps;
  const list = $("numbers");
  if (!list.children.length) for (const name of Object.keys(rows)) { element("dt", list, name); element("dd", list); }
  Object.values(rows).forEach((value, i) => { list.children[2 * i + 1].textContent = value; });
  $("horizon").setAttribute("aria-label", `Artificial horizon: roll ${roll}, pitch ${pitch}`);
}

// Gamepad: left stick climbs and turns, right stick flies forward and sideways

let sentSticks = "0,0,0,0", sticksAt = 0, wasPressed = [];
const ON_GAMEPAD = [() => handOver(), () => send({ type: "reset" }), () => toggleRecord(), () => nextCamera()];

function readGamepad(now) {
  const one = [...navigator.getGamepads()].find(Boolean);
  const words = one ? `Gamepad: ${one.id}. Right stick: forward and sideways; left stick: height and turn; buttons: hand over, new episode, record, camera.` :
    "No gamepad: press one of its buttons.";
  set("gamepad", words);
  const value = i => one && Math.abs(one.axes[i] || 0) > DEAD ? Math.max(-1, Math.min(1, one.axes[i])) : 0;
  const values = [-value(3), -value(2), -value(1), -value(0)].map(v => Math.round(100 * v) / 100 || 0);
  if (String(values) !== sentSticks && now - sticksAt > 30) {
    sentSticks = String(values);
    sticksAt = now;
    send({ type: "sticks", values });
  }
  const pressed = one ? one.buttons.map(button => button.pressed) : [];
  ON_GAMEPAD.forEach((act, i) => { if (pressed[i] && !wasPressed[i]) act(); });
  wasPressed = pressed;
}

let drawn = null, drawnAt = 0;

function loop(now) {
  if (state && hello) {
    if (fresh.has("view")) stats.displayed += 1;
    fresh.forEach(drawImage);
    fresh.clear();
    if (drawn !== state && now - drawnAt >= CHARTS_MS) {
      [drawn, drawnAt] = [state, now];
      if (!hello.watch) drawBars();
      drawMap();
      drawHorizon();
      drawNumbers();
    }
    if (!hello.watch) readGamepad(now);
  }
  for (; pendingAcks > 0; pendingAcks -= 1) send({ type: "ack" });
  requestAnimationFrame(loop);
}

requestAnimationFrame(loop);
connect();
