// The page of captures: set a drive up, lead the robot by keys or by touch, watch what is recorded; and the next drive.
"use strict";

const PERIOD = 250; // between two questions for news [ms]
const REPEAT = 120; // between two reports of held keys [ms]
const KEYS = { // of browsers, as the command calls them
  KeyW: "W", KeyS: "S", KeyA: "A", KeyD: "D", ArrowUp: "UpArrow", ArrowDown: "DownArrow", ArrowLeft: "LeftArrow",
  ArrowRight: "RightArrow", Space: "Space", KeyV: "V", KeyX: "X", Delete: "Delete", KeyE: "E", KeyR: "R", Equal: "Equal",
  NumpadAdd: "Equal", Minus: "Minus", NumpadSubtract: "Minus", KeyC: "C",
};
const HELD = new Set(["W", "S", "A", "D", "UpArrow", "DownArrow", "LeftArrow", "RightArrow"]);
const THRESHOLDS = ["distance", "turn", "time"];

let phase = "", pressed = [], viewed = -1, told = "", noting = false;
const held = new Set();

// --- the set-up ---

function fill({ setup, valid, last }) {
  at("name").value = setup.name;
  at("notes").value = setup.notes;
  for (const id of THRESHOLDS) at(id).value = setup[id] ?? "";
  at("sensors").replaceChildren(...valid.map((sensor) => make("label", { className: "tick" },
    make("input", { type: "checkbox", value: sensor, checked: setup.sensors.includes(sensor) }), sensor)));
  at("last").textContent = last;
  at("last").hidden = !last;
}

function filled() {
  const number = (id) => (at(id).value === "" ? null : at(id).valueAsNumber);
  return {
    name: at("name").value.trim(), notes: at("notes").value,
    sensors: [...at("sensors").querySelectorAll("input:checked")].map((box) => box.value),
    ...Object.fromEntries(THRESHOLDS.map((id) => [id, number(id)])),
  };
}

at("form").onsubmit = async (event) => {
  event.preventDefault();
  await trying(() => ask("begin", filled()));
};
at("finish").onclick = () => trying(() => ask("finish", {}));

async function trying(work) {
  try { await work(); mistake(""); } catch (error) { mistake(error.message); }
}

function mistake(line) {
  at("mistake").hidden = !line;
  at("mistake").textContent = line;
}

// --- leading ---

/** Tell which keys are held and were pressed: at once, and while any is held again and again. */
async function report() {
  if (phase !== "driving") return;
  const now = pressed;
  pressed = [];
  try { await ask("keys", { held: [...held], pressed: now }); } catch { /* the news tell of it */ }
}

setInterval(() => { if (held.size) report(); }, REPEAT);

function press(key) { pressed.push(key); report(); }

function hold(key, down) {
  const before = held.has(key);
  if (down) held.add(key); else held.delete(key);
  for (const button of document.querySelectorAll("[data-hold]")) button.classList.toggle("held", held.has(button.dataset.hold));
  if (before !== down) report();
}

function letGo() { for (const key of [...held]) hold(key, false); }

/** Only where words are written the robot hears no key: its emergency stop must not wait for a click elsewhere. */
const writes = (element) => element.matches("textarea, input:not([type=checkbox])");
const ticks = (element, key) => key === "Space" && element.matches("[type=checkbox]");

addEventListener("keydown", (event) => {
  const key = KEYS[event.code];
  if (phase !== "driving" || !key || event.ctrlKey || event.metaKey || event.altKey) return;
  if (writes(event.target) || ticks(event.target, key)) return;
  event.preventDefault();
  if (HELD.has(key)) hold(key, true);
  else if (!event.repeat) press(key);
});
addEventListener("keyup", (event) => { const key = KEYS[event.code]; if (HELD.has(key)) hold(key, false); });
addEventListener("blur", letGo);
document.addEventListener("visibilitychange", letGo);

for (const button of document.querySelectorAll("[data-hold]")) {
  button.onpointerdown = (event) => { button.setPointerCapture(event.pointerId); hold(button.dataset.hold, true); };
  button.onpointerup = button.onpointercancel = button.onlostpointercapture = () => hold(button.dataset.hold, false);
  button.oncontextmenu = (event) => event.preventDefault();
}
for (const button of document.querySelectorAll("[data-key]")) button.onclick = () => press(button.dataset.key);
at("go").onclick = () => press("Space");
at("abort").onclick = () => { if (confirm("Abort, and keep nothing of this drive?")) press("Delete"); };

at("while").oninput = () => { noting = true; };
at("while").onchange = () => trying(async () => { await ask("notes", { notes: at("while").value }); noting = false; });

// --- news ---

function show(news) {
  const { status } = news;
  if (news.phase !== phase) change(news);
  if (phase !== "driving") return;
  showWorld(status.moves && at("world").checked);
  at("phase").textContent = status.phase;
  at("phase").className = status.phase;
  at("go").textContent = { start: "Start", pause: "Pause", resume: "Resume" }[status.go] || "";
  at("go").hidden = !status.go;
  at("warnings").replaceChildren(...status.warnings.map((line) => make("p", { textContent: line })));
  rows("figures", [...status.figures, ["Sampling", sampling(news.setup)], ["Sensors", news.setup.sensors.join(", ")]]);
  if (!noting && document.activeElement !== at("while")) at("while").value = news.notes;
  if (status.count !== viewed) {
    viewed = status.count;
    at("pictures").replaceChildren(...news.pictures.map((name) => make("figure", {},
      make("img", { alt: name, src: `picture?sensor=${encodeURIComponent(name)}&view=${viewed}` }),
      make("figcaption", { className: "soft", textContent: name }))));
  }
}

/** The view of the world is drawn by this page's own processor where there is no graphics card: then keys lag. */
function showWorld(now) {
  const shown = at("view").querySelector("iframe");
  if (now && !shown) at("view").append(make("iframe", { src: "/", title: "The world" }));
  if (!now) shown?.remove();
  at("view").hidden = at("look").hidden = !at("world").checked;
  at("drive").classList.toggle("plain", !at("world").checked);
}
at("world").onchange = () => at("world").blur(); // the next Space is the robot's again
at("world").checked = matchMedia("(min-width: 52rem)").matches;

function sampling({ distance, turn, time }) {
  const words = [distance && `after ${distance} m`, turn && `after ${turn}°`, time && `every ${time} s`];
  return words.filter(Boolean).join(" or ") || "by hand";
}

function rows(id, list) {
  const text = JSON.stringify(list);
  if (at(id).dataset.shown === text) return;
  at(id).dataset.shown = text;
  at(id).replaceChildren(...list.map(([what, value]) => make("tr", {}, make("td", { textContent: what }), make("td", { textContent: value }))));
}

function change(news) {
  phase = news.phase;
  at("setup").hidden = phase !== "setup";
  at("drive").hidden = phase !== "driving";
  at("over").hidden = phase !== "finished";
  letGo();
  mistake("");
  viewed = -1;
  if (phase === "setup" && news.setup) fill(news);
  if (phase === "driving") {
    at("title").textContent = news.setup.name;
    noting = false;
    at("while").value = news.notes;
    rows("legend", news.legend);
    scrollTo(0, 0);
  }
  showWorld(false); // the next drive has another one
}

async function look() {
  try {
    const news = await ask("capture");
    if (news.phase !== "setup" || news.setup) show(news);
    if (told) mistake(told = "");
  } catch {
    if (phase === "finished") return;
    mistake(told = phase === "driving" || phase === "setup" ? "The command that serves this page has ended, or does not answer." : "");
  }
  setTimeout(look, PERIOD);
}
look();
