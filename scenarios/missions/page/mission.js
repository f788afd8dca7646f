// The page of missions: choose a map, state a goal and tasks on it, start, watch.
"use strict";

const PERIOD = 300; // between two questions for news [ms]
const TAP = 8; // a touch that moves farther [px] drags the plan
const REACH = 34; // a tap farther from a place [px] is at none

let behaviours = {}; // what is done at each kind of landmark, [code, words] each
let map = null, planned = null, chosen = null, steps = [], landmarks = {};
let seen = { number: 0, log: 0, track: 0, views: 0 };
let track = [], lost = [], running = false;
let mayStart = false;

// --- the plan ---

const svg = at("drawing");
const layers = {};
let box = [0, 0, 10, 10];

/** Points of a polyline; the plan's y points up. */
const points = (list) => list.map(([x, y]) => `${x},${-y}`).join(" ");

function layer(name, ...drawn) {
  if (!layers[name]) { layers[name] = draw("g"); }
  layers[name].replaceChildren(...drawn);
}

function setUpLayers() {
  svg.replaceChildren();
  for (const name of ["walls", "paths", "way", "doors", "beams", "track", "likely", "steps", "believed", "robot", "chosen"]) {
    layers[name] = draw("g");
    svg.append(layers[name]);
  }
}

/** Metres of a pixel. */
const scale = () => 1 / (svg.getScreenCTM()?.a || 1);

function frame(all) {
  const xs = all.map((p) => p[0]), ys = all.map((p) => -p[1]), edge = 1.5;
  const [left, top] = [Math.min(...xs) - edge, Math.min(...ys) - edge];
  box = [left, top, Math.max(...xs) + edge - left, Math.max(...ys) + edge - top];
  at("plan").style.aspectRatio = `${box[2]} / ${box[3]}`;
  show();
}

function show() { svg.setAttribute("viewBox", box.join(" ")); redrawSizes(); }

/** Marks are as large on the screen at any zoom. */
function redrawSizes() {
  for (const one of svg.querySelectorAll("[data-r]")) one.setAttribute("r", one.dataset.r * scale());
  for (const one of svg.querySelectorAll("[data-size]")) one.setAttribute("font-size", one.dataset.size * scale());
  for (const one of svg.querySelectorAll("[data-pose]")) {
    const [x, y, heading] = JSON.parse(one.dataset.pose);
    one.setAttribute("transform", `translate(${x} ${-y}) rotate(${-heading * 180 / Math.PI}) scale(${9 * scale()})`);
  }
}

const dot = (kind, [x, y], r) => draw("circle", { class: kind, cx: x, cy: -y, "data-r": r, r: r * scale() });

function drawMap() {
  setUpLayers();
  const every = [...map.places, ...map.outline.flat()];
  frame(every.length ? every : [[0, 0], [1, 1]]);
  layer("walls", ...map.outline.map((line) => draw("polyline", { class: "wall", points: points(line) })));
  layer("paths",
    ...map.paths.map((path) => draw("polyline", { class: "path", points: points(path.places.map((n) => map.places[n])) })),
    ...map.places.map((place) => dot("place", place, 2)));
  layer("doors", ...map.paths.flatMap((path) => path.doors).map((door) => {
    const mark = dot(door.open ? "door" : "door closed", [door.x, door.y], 5);
    mark.append(draw("title"));
    mark.firstChild.textContent = `door ${door.beside}, ${door.along} m${door.open ? "" : ", closed"}`;
    return mark;
  }));
}

function drawPlan() {
  if (!planned) { layer("way"); layer("steps"); return; }
  const kept = planned.points.filter((_, n) => planned.way.along[n] < planned.goal);
  layer("way", draw("polyline", { class: "way", points: points([...kept, alongWay(planned.goal)]) }));
  const marks = planned.orders.map((order, n) => [n + 1, order.at]);
  layer("steps", ...marks.flatMap(([n, along]) => {
    const [x, y] = alongWay(along);
    const text = draw("text", { class: "steptext", x, y: -y, "data-size": 11 });
    text.textContent = n;
    return [dot("step", [x, y], 9), text];
  }));
  redrawSizes();
}

/** Where so far along the way is. */
function alongWay(along) {
  const way = planned.way.along;
  let n = way.findIndex((one) => one >= along);
  if (n < 0) n = way.length - 1;
  if (n === 0) return planned.points[0];
  const share = Math.min(1, (along - way[n - 1]) / ((way[n] - way[n - 1]) || 1));
  return [0, 1].map((axis) => planned.points[n - 1][axis] + share * (planned.points[n][axis] - planned.points[n - 1][axis]));
}

// Fingers and the mouse: a tap chooses, a drag moves, two fingers or the wheel zoom.
const fingers = new Map();
let moved = 0;

svg.addEventListener("pointerdown", (event) => {
  svg.setPointerCapture(event.pointerId);
  if (!fingers.size) moved = 0;
  fingers.set(event.pointerId, [event.clientX, event.clientY]);
});
svg.addEventListener("pointermove", (event) => {
  const before = fingers.get(event.pointerId);
  if (!before) return;
  const now = [event.clientX, event.clientY], others = [...fingers].filter(([id]) => id !== event.pointerId);
  moved += Math.hypot(now[0] - before[0], now[1] - before[1]);
  fingers.set(event.pointerId, now);
  if (moved < TAP) return;
  if (others.length) {
    const other = others[0][1];
    const apart = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1;
    zoom(apart(before) / apart(now), other);
  } else {
    box[0] -= (now[0] - before[0]) * scale();
    box[1] -= (now[1] - before[1]) * scale();
    show();
  }
});
svg.addEventListener("pointerup", (event) => {
  if (fingers.size === 1 && moved < TAP) choose(event.clientX, event.clientY);
  fingers.delete(event.pointerId);
});
svg.addEventListener("pointercancel", (event) => fingers.delete(event.pointerId));
svg.addEventListener("wheel", (event) => {
  event.preventDefault();
  zoom(Math.exp(event.deltaY * 0.001), [event.clientX, event.clientY]);
}, { passive: false });

function zoom(by, [x, y]) {
  const to = new DOMPoint(x, y).matrixTransform(svg.getScreenCTM().inverse());
  box = [to.x + (box[0] - to.x) * by, to.y + (box[1] - to.y) * by, box[2] * by, box[3] * by];
  show();
}

function choose(x, y) {
  if (!map) return;
  const to = new DOMPoint(x, y).matrixTransform(svg.getScreenCTM().inverse());
  let best = null;
  map.paths.forEach((path) => path.places.forEach((place, view) => {
    const [px, py] = map.places[place], far = Math.hypot(px - to.x, -py - to.y) / scale();
    if (far < REACH && (!best || far < best.far)) best = { far, place, name: `${path.name}:${view}` };
  }));
  chosen = best;
  layer("chosen", ...(best ? [dot("chosen", map.places[best.place], 11)] : []));
  const here = at("here");
  here.hidden = !best || running;
  if (!best) return;
  const along = alongOf(best.place);
  here.replaceChildren(
    make("b", { textContent: along === null ? best.name : `${best.name}, ${along.toFixed(1)} m` }),
    make("button", { textContent: "Begin here", onclick: () => { at("start").value = best.name; closeHere(); replan(); } }),
    make("button", { textContent: "Go here", onclick: () => { at("goal").value = best.name; closeHere(); replan(); } }),
    make("button", { textContent: "Do something here", disabled: along === null,
      onclick: () => { closeHere(); addPlace(along); } }));
}

function closeHere() { at("here").hidden = true; layer("chosen"); }

/** Metres along the way of a place on it, else null. */
function alongOf(place) {
  const n = planned ? planned.way.places.indexOf(place) : -1;
  return n < 0 ? null : planned.way.along[n];
}

// --- the map ---

async function loadMap() {
  map = await ask(`map?name=${encodeURIComponent(at("map").value)}`);
  steps = []; landmarks = {}; planned = null;
  const views = map.paths.flatMap((path) => path.places.map((_, view) => `${path.name}:${view}`));
  // With both ends unnamed the way is the whole path; between its ends by name the shortest leaves out a round.
  for (const [id, unnamed] of [["start", "the path's start"], ["goal", "the path's end"]]) {
    at(id).replaceChildren(make("option", { value: "", textContent: unnamed }), ...views.map((name) => make("option", { textContent: name })));
  }
  const { notes, ...others } = map.told;
  const long = map.paths.map((path) => `${path.name} ${path.length.toFixed(0)} m`).join(", ");
  at("facts").textContent = [long, `${map.places.length} places`, map.sensors.join(" "),
    ...Object.entries(others).map(([key, value]) => `${key} ${value}`), ...(notes ? [`“${notes}”`] : [])].join(" · ");
  drawMap();
  showSteps();
  await replan();
}

// --- the mission ---

function addPlace(along) {
  let n = 1;
  while (`LA${n}` in landmarks) n += 1;
  // The last place's metres are rounded, and may be more than the way has.
  landmarks[`LA${n}`] = along === planned?.way.along.at(-1) ? "end" : along;
  steps.push({ at: `LA${n}` });
  showSteps();
  replan();
}

function request() {
  const number = (id) => at(id).valueAsNumber;
  return {
    map: at("map").value, start: at("start").value, goal: at("goal").value, landmarks,
    steps: steps.map((one) => ({ at: one.at, ...(one.do ? { do: one.do } : {}), ...(one.tasks?.length ? { tasks: one.tasks } : {}) })),
    drive: {
      light: at("light").value.trim(), change: at("change").value, robot: at("robot").value, renderer: at("renderer").value,
      seed: number("seed"), every: number("every"), start: number("down"), odometry: at("odometry").checked,
      speed: Number(at("speed").value),
    },
  };
}

let asking = 0;

async function replan() {
  const mine = asking += 1;
  mayStart = false;
  try {
    const found = await ask("plan", request());
    if (mine !== asking) return;
    planned = found; mayStart = true;
    at("told").textContent = planned.text
      ? `${planned.text} over ${planned.goal.toFixed(1)} of ${planned.length.toFixed(1)} m`
      : `The way as it was learnt, ${planned.goal.toFixed(1)} m`;
    if (planned.text) at("text").value = planned.text;
    mistake("");
  } catch (error) {
    if (mine !== asking) return;
    mistake(error.message);
    at("told").textContent = "";
  }
  showOrders();
  drawPlan();
  at("go").disabled = running || !mayStart || Boolean(map.refused);
}

function showOrders() {
  at("orders").replaceChildren(...(planned && mayStart ? planned.orders : []).map((order, n) => make("li", {},
    make("span", { textContent: `${n + 1}. ${order.at.toFixed(1)} m` }),
    make("span", { textContent: order.do }),
    make("span", { textContent: [order.why, ...order.tasks].join("; ") }))));
  if (planned && mayStart && planned.tasks.length) {
    at("orders").append(make("li", {}, make("span", { textContent: `${planned.goal.toFixed(1)} m` }),
      make("span", { textContent: "goal" }), make("span", { textContent: planned.tasks.join("; ") })));
  }
}

// A name that no photograph of the mission has: two of one name are refused.
function freeName(wanted) {
  const taken = new Set(steps.flatMap((step) => (step.tasks || []).map((task) => task.photograph)));
  let name = wanted;
  for (let k = 2; taken.has(name); k += 1) name = `${wanted} ${k}`;
  return name;
}

function showSteps() {
  at("steps").replaceChildren(...steps.map((step, n) => {
    const changed = () => { showSteps(); replan(); };
    const remove = () => { steps.splice(n, 1); delete landmarks[step.at]; changed(); };
    const up = () => { steps.splice(n - 1, 2, steps[n], steps[n - 1]); changed(); };
    const what = make("select", { "aria-label": "behaviour", onchange: (event) => { step.do = event.target.value; replan(); } },
      ...[["", "as learnt"], ...behaviours[step.at.slice(0, 2)]].map(([value, textContent]) => make("option", { value, textContent })));
    what.value = step.do || "";
    const place = step.at.startsWith("LA") || step.at.startsWith("LO")
      ? [make("label", {}, "at [m] ", make("input", { type: "number", min: 0, step: "any", placeholder: "end", value: landmarks[step.at] ?? "",
        onchange: (event) => { landmarks[step.at] = event.target.value === "" ? "end" : event.target.valueAsNumber; replan(); } }))]
      : [];
    return make("li", {},
      make("div", { className: "row" },
        make("b", { textContent: n + 1 }),
        make("span", { textContent: step.at === "LD" ? "At the next door" : `At ${step.at}` }),
        ...place, make("label", {}, "do ", what),
        ...(n ? [make("button", { textContent: "↑", title: "before the one above", onclick: up })] : []),
        make("button", { textContent: "✕", title: "remove", onclick: remove })),
      make("div", { className: "row tasks" },
        ...(step.tasks || []).map((task, k) => make("button", {
          textContent: `${task.photograph ? `photograph “${task.photograph}”` : `wait ${task.wait} s`} ✕`,
          onclick: () => { step.tasks.splice(k, 1); changed(); } })),
        make("button", { textContent: "+ photograph", onclick: () => {
          (step.tasks ||= []).push({ photograph: freeName(`step ${n + 1}`) }); changed(); } }),
        make("button", { textContent: "+ wait 5 s", onclick: () => { (step.tasks ||= []).push({ wait: 5 }); changed(); } })));
  }));
}

// --- the run ---

/** Show a line, or without one why no mission can be started on this map, if so. */
function mistake(line) {
  const shown = line || map?.refused || "";
  at("mistake").hidden = !shown;
  at("mistake").textContent = shown;
}

async function start() {
  at("go").disabled = true;
  try {
    const { plan } = await ask("start", request());
    planned = plan;
    forget(0);
    setRunning(true);
    scrollTo({ top: 0, behavior: "smooth" });
  } catch (error) {
    mistake(error.message);
    at("go").disabled = !mayStart;
  }
}

function forget(number) {
  seen = { number, log: 0, track: 0, views: 0 };
  track = []; lost = [];
  at("log").replaceChildren();
  at("pictures").replaceChildren();
  for (const name of ["beams", "track", "likely", "believed", "robot"]) if (layers[name]) layer(name);
}

function setRunning(now) {
  running = now;
  document.body.classList.toggle("running", now);
  at("watch").hidden = !now;
  at("mission").hidden = now;
  at("drive").hidden = now;
  if (now) closeHere();
  at("again").hidden = true;
  drawPlan();
}

let gone = false;

async function look() {
  let news;
  try {
    news = await ask(`state?${new URLSearchParams(seen)}`);
    if (gone) mistake("");
    gone = false;
  } catch {
    gone = true;
    mistake("The command that serves this page does not answer.");
    setTimeout(look, 2000);
    return;
  }
  try {
    if (news.number && (running || news.state === "opening" || news.state === "running")) await showNews(news);
  } catch (error) {
    mistake(error.message);
  } finally {
    setTimeout(look, PERIOD);
  }
}

/** Show the map and the plan of the mission that runs: another page may have begun it, or this one before a reload. */
async function adopt({ map: name, plan }) {
  if (at("map").value !== name) {
    if (![...at("map").options].some((one) => one.value === name)) at("map").append(make("option", { textContent: name }));
    at("map").value = name;
    await loadMap();
  }
  asking += 1; // what this page has asked about a plan of its own comes too late
  planned = plan; mayStart = true;
  showOrders();
  drawPlan();
}

async function showNews(news) {
  if (!running) setRunning(true);
  if (news.number !== seen.number) {
    await adopt(news);
    forget(news.number);
  }
  const over = news.state === "over";
  at("number").textContent = news.number;
  at("status").textContent = over ? (news.result.completed ? "completed" : "not completed") : news.status || news.state;
  at("status").className = over ? (news.result.completed ? "good" : "bad") : "";
  at("doing").textContent = over ? ending(news.result)
    : [news.doing, ...(news.tasks || []), news.time === undefined ? "the world is opened" : `${news.time.toFixed(0)} s, ${news.along.toFixed(1)} m`].filter(Boolean).join(" · ");
  at("pause").textContent = news.status === "paused" ? "Resume" : "Pause";
  at("pause").hidden = at("abort").hidden = over;
  at("again").hidden = !over;
  for (const [n, one] of [...at("orders").children].entries()) one.classList.toggle("now", n === news.order);
  if (news.log) showLog(news.log);
  if (news.robot) showTrack(news);
  if (news.views?.length) showViews(news);
  if (over && news.result.photographs?.length) showPhotographs(news.result.photographs);
}

function ending({ why, touched, left }) {
  return [why, touched?.length ? `touched ${touched.join(", ")}` : "", left ? `left in ${left}` : ""].filter(Boolean).join(" · ");
}

function showLog(lines) {
  const log = at("log"), atEnd = log.scrollTop + log.clientHeight > log.scrollHeight - 30;
  log.append(...lines.map(([time, along, what, level]) => make("li", { className: level },
    make("span", { textContent: `${time.toFixed(1)} s` }), make("span", { textContent: `${along.toFixed(1)} m` }),
    make("span", { textContent: what }))));
  seen.log += lines.length;
  if (atEnd && lines.length) log.scrollTop = log.scrollHeight;
}

function showTrack(news) {
  track.push(...news.track);
  seen.track += news.track.length;
  layer("track", draw("polyline", { class: "track", points: points(track) }));
  layer("believed", dot("ring", news.believed, 10));
  layer("robot", draw("path", { class: "robot", d: "M -0.8 -0.8 L 1.2 0 L -0.8 0.8 Z", "data-pose": JSON.stringify(news.robot) }));
  redrawSizes();
}

function showViews(news) {
  lost.push(...news.views.map((view) => view[1]));
  seen.views = news.seen;
  layer("likely", ...news.places.map(([place, p]) => dot("likely", map.places[place] || [0, 0], 2 + 12 * Math.sqrt(p))));
  layer("beams", ...news.scan.map((point) => dot("beam", point, 1.5)));
  at("lost").replaceChildren(draw("polyline", {
    points: lost.map((p, n) => `${lost.length > 1 ? 300 * n / (lost.length - 1) : 0},${38 - 36 * p}`).join(" ") }));
  const way = planned ? planned.way : { places: [], along: [] }, length = way.along.at(-1) || 1;
  const wide = Math.max(2, 300 / (way.places.length || 1) - 1);
  at("belief").replaceChildren(...news.places.flatMap(([place, p]) => {
    const n = way.places.indexOf(place);
    return n < 0 ? [] : [draw("rect", { x: (300 - wide) * way.along[n] / length, y: 60 - 58 * p, width: wide, height: 58 * p })];
  }));
  showPictures(news.pictures.map((name) => [name, `picture?camera=${encodeURIComponent(name)}&view=${news.seen}`]));
}

function showPictures(every) {
  const shown = at("pictures");
  every.forEach(([name, source], n) => {
    if (!shown.children[n]) shown.append(make("figure", {}, make("img", { alt: "" }), make("figcaption", { className: "soft" })));
    const figure = shown.children[n];
    figure.firstChild.src = source;
    figure.firstChild.alt = figure.lastChild.textContent = name;
  });
}

let photographed = 0;

function showPhotographs(names) {
  if (photographed === seen.number) return;
  photographed = seen.number;
  at("pictures").replaceChildren();
  showPictures(names.map((name) => [name, `picture?photograph=${encodeURIComponent(name)}&mission=${seen.number}`]));
}

// --- all together ---

const telling = (work) => async (...given) => { try { await work(...given); } catch (error) { mistake(error.message); } };

at("map").onchange = telling(loadMap);
at("start").onchange = at("goal").onchange = replan;
at("door").onclick = () => { steps.push({ at: "LD" }); showSteps(); replan(); };
at("place").onclick = () => addPlace(planned ? planned.way.along.at(-1) : 0);
at("text").onchange = telling(async () => {
  const text = at("text").value.trim();
  const found = text ? (await ask("steps", { text })).steps : [];
  const before = steps;
  steps = found.map((one, n) => ({ ...one, ...(before[n]?.at === one.at && before[n].tasks ? { tasks: before[n].tasks } : {}) }));
  for (const { at: name } of steps) if (/^L[AO]/.test(name) && !(name in landmarks)) landmarks[name] = "end";
  showSteps();
  await replan();
});
at("go").onclick = start;
at("pause").onclick = telling(() => ask("do", { do: at("pause").textContent.toLowerCase() }));
at("abort").onclick = telling(() => ask("do", { do: "abort" }));
at("again").onclick = () => { setRunning(false); seen.number = 0; replan(); };
addEventListener("resize", redrawSizes);

telling(async () => {
  const { maps, lights, ...told } = await ask("maps");
  behaviours = told.behaviours;
  at("map").replaceChildren(...maps.map(({ name }) => make("option", { textContent: name })));
  at("lights").replaceChildren(...lights.map((light) => make("option", { value: light })));
  setUpLayers();
  await loadMap();
  look();
})();
