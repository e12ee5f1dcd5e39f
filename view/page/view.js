"use strict";
const $ = id => document.getElementById(id);
const LAMPS = {BRINGUP: "--soft", READY: "--c5", ENABLING: "--c1", ENGAGING: "--c1", ACTIVE: "--good", STOPPING: "--bad", HOLDING: "--c2", STOPPED: "--bad", FAILED: "--bad"};
const SPAN_S = 20, HOLD_MS = 30, KEPT = 3000, SILENT_MS = 1000;
let hello = null, frames = [], now = null, scene = new Scene($("scene")), plots = [], socket, open = false, held = false, way = 0, age = 0, dropped = 0;
let virtual = false; // time: of a session in lockstep
let over = false, unseen = false, heard = 0; // the session has ended, or goes on without its recorder; when a frame came last
let at = 0, playing = false, playedAt = 0, changed = false, last = {lateness: [], compute: []}, limitRows = [], events = [];
const can = word => hello && hello.words.includes(word);
const say = word => { if (open) socket.send("say " + word); };
const shelf = { // the layout is kept over a restart
  read: () => { try { return JSON.parse(localStorage.getItem("hapticd plots " + hello.name)); } catch { return null; } },
  write: names => { try { localStorage.setItem("hapticd plots " + hello.name, JSON.stringify(names)); } catch { /* private window */ } },
};

function connect() {
  socket = new WebSocket(location.origin.replace(/^http/, "ws") + "/session" + location.search);
  socket.onopen = () => { open = true; };
  socket.onmessage = event => hear(JSON.parse(event.data));
  socket.onclose = () => {
    open = false; letGo(); lamp("not connected", "--bad"); setTimeout(connect, 1000);
    $("hint").textContent = "the dashboard has ended, or its host cannot be reached; a new one prints a new address";
  };
}
function hear(said) {
  if (said.type === "hello") begin(said);
  else if (said.type === "frames") { age = said.age_ms; dropped = said.dropped; heard = performance.now() - age; said.frames.forEach(take); }
  else if (said.type === "said") said.events.forEach(note);
  else if (said.type === "whole") {
    at = 0; playing = false;
    virtual = frames.every(frame => !(frame.high[place("compute")] > 0));
    $("late").parentElement.hidden = $("took").parentElement.hidden = virtual;
    if (virtual) buildPlots();
    seek(0);
  }
  else if (said.type === "pong") way = (performance.now() - +said.of) / 2;
  else if (said.type === "unsaid") $("hint").textContent = `the session does not take "${said.word}"`;
}
function begin(said) {
  hello = said; over = unseen = false; heard = performance.now(); frames = []; now = null; at = 0; events = []; last = {lateness: [], compute: []};
  document.title = `${hello.name} – hapticd`; $("name").textContent = hello.name;
  scene.begin(hello); $("events").replaceChildren(); $("stop").textContent = $("intervention").textContent = "none";
  $("controls").hidden = !hello.live; $("player").hidden = hello.live;
  $("hold").hidden = $("keep").hidden = !can("hold"); $("estop").hidden = !can("e-stop");
  scene.onlead = can("lead") ? lead : null;
  $("hint").textContent = !hello.live ? "" : can("lead") ? `drag ${hello.grips.length > 1 ? "a blue ball to lead the hands" : "the blue ball to lead the hand"}; drag elsewhere to turn, wheel to zoom` : "this machine is real: from here it can only be stopped";
  $("orders").replaceChildren(...hello.words.filter(w => !["hold", "lead", "press", "release", "e-stop", "pull out"].includes(w) && !w.startsWith("push")).map(word => {
    const button = document.createElement("button"); button.textContent = word; button.onclick = () => say(word);
    if (word.startsWith("twin ")) button.setAttribute("aria-pressed", "false");
    return button;
  }));
  buildLimits(); buildSolver(); buildPlots(); changed = true;
}
function note([tick, severity, text]) {
  events.push({tick, severity, text});
  if (hello.live) tell(events.at(-1));
}
function take(frame) {
  if (frame.type === "unseen") {
    unseen = true; showMode(); letGo(); // nobody holds what they cannot see
    $("hint").textContent = "its recorder has ended: nothing here is of now, but stop and emergency stop still reach it";
    return;
  }
  if (frame.type === "over") { over = true; showMode(); letGo(); return; }
  if (frame.lateness.length) last = frame;
  frame.events.forEach(note);
  frames.push(frame);
  if (hello.live) { while (frames.length > KEPT) frames.shift(); now = frame; changed = true; }
}
function tell({tick, severity, text}) {
  const line = document.createElement("li"), time = document.createElement("time"), words = document.createElement("span");
  time.textContent = (tick / hello.rate).toFixed(3) + " s"; words.textContent = text; words.className = severity;
  line.append(time, words); $("events").prepend(line);
  while ($("events").children.length > 200) $("events").lastChild.remove();
  if (severity === "stop") $("stop").textContent = text;
  if (["stop", "refusal", "warning", "failure"].includes(severity)) $("intervention").textContent = text;
}
const lost = () => !hello?.live ? "" : !open ? "not connected" : over ? "session over" : unseen ? "not recorded, not shown: it may still move" : performance.now() - heard > SILENT_MS ? `silent for ${((performance.now() - heard) / 1000).toFixed(0)} s` : "";
const showMode = () => { const why = lost(); if (why || now) lamp(why || now.mode, why ? (over ? "--soft" : "--bad") : LAMPS[now.mode]); };
const lamp = (text, color) => { $("mode").textContent = text; $("lamp").style.setProperty("--lamp", `var(${color})`); };

function show() {
  if (!now) return;
  scene.show(now); scene.draw();
  showMode();
  $("time").textContent = (now.tick / hello.rate).toFixed(1) + " s";
  $("next").textContent = hello.live ? nextStep() : "";
  const forces = threes(now.wrench).filter((_, i) => i % 2 === 0).map(V.size);
  $("force").textContent = forces.map((f, i) => `${hello.grips[i]} hand ${f.toFixed(f < 10 ? 1 : 0)} N`.trim()).join(", ")
    + (now.reachable?.length ? ` of ${V.size(now.reachable).toFixed(0)} N reachable` : "");
  list("held", showLimits(), "no limit");
  if (now.stop) $("stop").textContent = events.findLast(e => e.severity === "stop" && e.tick <= now.tick)?.text ?? now.stop;
  $("estop").classList.toggle("on", now.e_stop_closed === false);
  $("pullout").hidden = !(can("pull out") && now.e_stop_closed === false);
  list("doing", now.doing.map(word => word.replace(/(\d) (?=\S)/g, "$1\u00a0")), "nothing is rendered"); // no unit alone in a line
  for (const button of $("orders").querySelectorAll("[aria-pressed]")) // of several twins, the one that is rendered
    button.setAttribute("aria-pressed", now.doing.some(word => word === button.textContent || word.startsWith(button.textContent + " at ")));
  showDeadMan();
  const pressed = now.pressed === null ? "" : now.pressed ? "pressed" : "open";
  $("hold").classList.toggle("on", now.pressed === true);
  $("hold").textContent = held ? `holding: ${pressed}` : `hold dead-man${pressed ? ` (${pressed})` : ""}`;
}
function list(id, words, none) { // lines end between words rather than in them
  $(id).replaceChildren(...(words.length ? words : [none]).flatMap((word, i, all) => {
    const span = document.createElement("span"); span.textContent = i < all.length - 1 ? word + "," : word;
    return [span, " "];
  }));
}
function nextStep() {
  if (now.e_stop_closed === false) return "next: pull the emergency stop out";
  if (now.mode === "READY") return now.pressed ? "next: let go of the dead-man" : "next: hold the dead-man";
  if (["HOLDING", "STOPPED"].includes(now.mode)) return now.pressed ? "next: let go of the dead-man" : "next: reset";
  return "";
}
function buildLimits() {
  limitRows = [];
  $("limits").replaceChildren(...hello.channels.flatMap((spec, k) => {
    if (spec.group !== "limits") return [];
    const [name, track, value] = ["span", "div", "span"].map(tag => document.createElement(tag)), mark = document.createElement("i");
    name.className = "name"; name.textContent = spec.name; value.className = "value"; track.className = "track"; track.append(mark);
    if (spec.lower === null || spec.upper === null) track.classList.add("none");
    limitRows.push({spec, k, cells: [name, track, value], track, mark, value}); return [name, track, value];
  }));
}
function showLimits() {
  const touched = [];
  for (const {spec, k, cells, track, mark, value} of limitRows) {
    const v = now.mean[k]; mark.hidden = v == null || spec.lower === null || spec.upper === null;
    for (const cell of cells) cell.hidden = v == null && !!now.mean.length; // of a twin that is not rendered
    if (v == null) { value.textContent = ""; track.classList.remove("at"); continue; }
    const near = spec.lower !== null && now.low[k] <= spec.lower + spec.near ? "lower" : spec.upper !== null && now.high[k] >= spec.upper - spec.near ? "upper" : "";
    if (near) touched.push(`${spec.name} (${near})`);
    track.classList.toggle("at", !!near); value.classList.toggle("at", !!near);
    value.textContent = `${steady(v, Math.abs(v) < 10 ? 3 : 1)} ${spec.unit}`;
    mark.style.left = Math.max(0, Math.min(100, 100 * (v - spec.lower) / (spec.upper - spec.lower))) + "%";
  }
  return touched;
}
const place = name => hello.channels.findIndex(spec => spec.name === name); // a channel, -1 where there is none
function showDeadMan() { // how long it is as it is, and how long ago that was heard: at worst in these ticks
  const heard = now.high[place("dead-man last heard")];
  $("deadman").textContent = now.pressed === null || heard === undefined ? "not measured yet"
    : `${now.pressed ? "pressed" : "open"} for ${((now.tick - now.since) / hello.rate).toFixed(1)} s, heard ${heard < 1 ? "in this tick" : `${heard.toFixed(0)} ms ago`}`;
}
let levelRows = [];
function buildSolver() {
  levelRows = [];
  $("levels").replaceChildren(...hello.channels.flatMap((spec, k) => {
    if (spec.group !== "solver" || !spec.name.startsWith("slack of ")) return [];
    const [name, slack, proven] = ["span", "span", "span"].map(tag => document.createElement(tag));
    name.textContent = spec.name.slice("slack of ".length); levelRows.push({spec, k, slack, proven}); return [name, slack, proven];
  }));
  $("solver").hidden = !levelRows.length;
}
function showSolver() {
  const status = place("solver status"), solving = now && now.mean.length && ["ENGAGING", "ACTIVE"].includes(now.mode);
  if (!levelRows.length) return;
  const remark = solving && (hello.remarks[now.low[status]] ?? hello.remarks[now.high[status]]);
  const most = solving && now.high[place("HQP iterations")], done = solving && now.low[place("levels proven")];
  $("answer").textContent = !solving ? "solves while the machine renders" : `${remark || "solved"}, ${most.toFixed(0)} iteration${most === 1 ? "" : "s"} at most`;
  $("answer").className = remark ? "some" : "";
  levelRows.forEach(({spec, k, slack, proven}, i) => {
    const high = solving ? now.high[k] : 0, some = high > 1e-6;
    slack.textContent = solving ? `${some ? high.toPrecision(3) : "met"}${some ? ` ${pretty(spec.unit)}` : ""}` : ""; slack.className = some ? "slack some" : "slack";
    proven.textContent = solving ? (i < done ? "✓" : "–") : ""; proven.title = i < done ? "proven" : "not proven";
  });
}
const steady = (v, digits) => (+v.toFixed(digits) || 0).toFixed(digits); // no minus before a zero
const pretty = unit => unit.replaceAll("^2", "²").replace(/sqrt\(([^)]*)\)/, "√$1");
const OF_THE_LOG = ["records lost", "frames left out", "events left out"];
function showCounts() {
  const counts = Object.entries(now ? now.counts : {}), size = bytes => bytes < 1e6 ? `${(bytes / 1e3).toFixed(0)} kB` : bytes < 1e9 ? `${(bytes / 1e6).toFixed(1)} MB` : `${(bytes / 1e9).toFixed(1)} GB`;
  const rows = (list, loss) => list.flatMap(([name, n]) => {
    const dt = document.createElement("dt"), dd = document.createElement("dd"); dt.textContent = name; dd.textContent = n; dd.className = loss && n ? "some" : ""; return [dt, dd];
  });
  const log = counts.filter(([name]) => OF_THE_LOG.includes(name)), stored = now?.stored, lost = now?.counts["records lost"];
  $("bus").replaceChildren(...rows([["frames received", now?.received ?? 0]]), ...rows(counts.filter(([name]) => !OF_THE_LOG.includes(name)), true));
  const ill = lost ? "records were lost" : !stored ? "" : stored.waiting > stored.room / 2 ? "the recorder falls behind" : stored.free < 1e9 ? "the disk is nearly full" : "";
  $("health").textContent = ill || (stored ? "complete so far" : "read from its file"); $("health").className = ill ? "some" : "";
  $("stored").replaceChildren(...(stored ? rows([["written", size(stored.written)], ["waiting", `${(100 * stored.waiting / stored.room).toFixed(1)} %`], ["free on the disk", size(stored.free)]]) : []), ...rows(log, true));
}
function buildPlots() {
  const groups = {}, specs = hello.channels;
  specs.forEach((spec, k) => { groups[spec.name] = [k]; });
  const vectors = {};
  specs.forEach((spec, k) => { if (spec.group === "hand" && / [xyz]$/.test(spec.name)) (vectors[spec.name.slice(0, -2)] ??= []).push(k); });
  for (const [vector, three] of Object.entries(vectors)) { // "left force" is "force of the left hand"
    const [kind, ...which] = vector.split(" ").reverse(); groups[[kind, "of the", ...which, "hand"].join(" ")] = three;
  }
  const forces = Object.keys(groups).filter(name => name.startsWith("force of the ") && name.endsWith(" hand"));
  const firstLimit = specs.find(spec => spec.group === "limits" && spec.lower !== null);
  const usual = [...forces, firstLimit?.name, ...(virtual ? [] : ["lateness", "compute"])].filter(name => groups[name]);
  let names = (shelf.read() || usual).filter(name => groups[name]);
  const options = chosen => Object.keys(groups).map(name => { const o = document.createElement("option"); o.textContent = name; o.selected = name === chosen; return o; });
  const arrange = () => { shelf.write(names); build(); };
  const build = () => {
    plots = [];
    const cards = names.map((name, i) => {
      const card = document.createElement("div"), head = document.createElement("div"), pick = document.createElement("select"), unit = document.createElement("span"), said = document.createElement("output"), close = document.createElement("button"), canvas = document.createElement("canvas");
      card.className = "card"; head.className = "head"; pick.append(...options(name)); pick.setAttribute("aria-label", "channel");
      pick.onchange = () => { names[i] = pick.value; arrange(); };
      unit.textContent = specs[groups[name][0]].unit && `[${specs[groups[name][0]].unit}]`;
      close.textContent = "×"; close.setAttribute("aria-label", `close ${name}`); close.onclick = () => { names.splice(i, 1); arrange(); };
      head.append(pick, unit, said, close); card.append(head, canvas); plots.push(new Plot(canvas, said, groups[name], specs)); return card;
    });
    const add = document.createElement("div"), pick = document.createElement("select"), prompt = document.createElement("option");
    add.className = "card add"; prompt.textContent = "add a plot"; prompt.selected = true; pick.append(prompt, ...options()); pick.setAttribute("aria-label", "add a plot");
    pick.onchange = () => { names.push(pick.value); arrange(); };
    add.append(pick); $("plots").replaceChildren(...cards, add); changed = true;
  };
  build();
}

// what a person does
let leading = null;
function lead(place) { leading = place; }
function letGo() { if (held) { held = false; say("release"); changed = true; } }
function hold() { if (can("hold") && !held) { held = true; say("hold"); changed = true; } }
function dead(event) { return event.code === "Space" && can("hold") && !event.target.matches("input, select"); }
setInterval(() => { // the session lets go by itself when this falls silent
  if (held) say("hold");
  if (leading) { say("lead " + leading.map(v => v.toFixed(4)).join(" ")); leading = null; }
}, HOLD_MS);
$("hold").addEventListener("pointerdown", () => { if ($("kept").checked && held) letGo(); else hold(); });
for (const name of ["pointerup", "pointercancel", "pointerleave"]) $("hold").addEventListener(name, () => { if (!$("kept").checked) letGo(); });
addEventListener("keydown", event => {
  if (!dead(event)) return;
  event.preventDefault(); if (!event.repeat) hold();
});
addEventListener("keyup", event => {
  if (dead(event)) event.preventDefault(); // else it presses the button that was clicked last
  if (event.code === "Space" && !$("kept").checked) letGo();
});
addEventListener("blur", () => { if (!$("kept").checked) letGo(); });
$("kept").addEventListener("change", () => { if (!$("kept").checked) letGo(); });
document.addEventListener("visibilitychange", () => { if (document.hidden) letGo(); });
$("estop").onclick = () => say("e-stop"); // whoever presses it again, or at the same time, presses it
$("pullout").onclick = () => say("pull out");

// a recording
function seek(index) {
  if (!frames.length) return;
  at = Math.max(0, Math.min(frames.length - 1, index)); now = frames[at];
  $("slider").max = frames.length - 1; $("slider").value = at;
  $("clock").textContent = `${(now.tick / hello.rate).toFixed(2)} of ${(frames.at(-1).tick / hello.rate).toFixed(1)} s`;
  $("events").replaceChildren(); $("stop").textContent = $("intervention").textContent = "none";
  events.filter(e => e.tick <= now.tick).forEach(tell); changed = true;
}
$("slider").oninput = () => { playing = false; seek(+$("slider").value); };
$("play").onclick = () => { playing = !playing; if (playing && at >= frames.length - 1) seek(0); playedAt = performance.now() - (now ? now.tick / hello.rate * 1000 : 0); };

function turn(time) {
  requestAnimationFrame(turn);
  if (!hello) return;
  if (playing) {
    let next = at;
    while (next < frames.length - 1 && frames[next + 1].tick / hello.rate * 1000 <= time - playedAt) next++;
    if (next !== at) seek(next);
    if (at >= frames.length - 1) playing = false;
  }
  $("play").textContent = playing ? "❚❚" : "▶";
  if (changed) show();
  const end = hello.live ? (now ? now.tick / hello.rate : 0) : frames.length ? frames.at(-1).tick / hello.rate : 1;
  const from = hello.live ? Math.max(0, end - SPAN_S) : 0;
  if (changed || plots.some(p => p.dirty)) if (hello.live ? time - drawn > 60 : true) {
    drawn = time;
    for (const plot of plots) { plot.dirty = false; plot.draw(frames, from, Math.max(end, from + 1), hello.rate, hello.live || !now ? null : now.tick / hello.rate); }
  }
  if (changed) { changed = false; }
}
let drawn = 0;
setInterval(() => { // what need not be drawn at every frame
  if (!hello) return;
  if (open) socket.send("ping " + performance.now().toFixed(1));
  if (hello.live) $("latency").textContent = `view ${(age + way).toFixed(0)} ms behind, ${dropped} frames dropped`;
  else $("latency").textContent = virtual ? "a recording of virtual time: it has neither lateness nor cost" : "a recording";
  showMode(); showCounts(); showSolver();
  histogram($("late"), last.lateness, hello.bars, "--c1");
  histogram($("took"), last.compute, hello.bars, "--c3");
}, 500);
new ResizeObserver(() => { // on a phone the switches stay below the head
  document.documentElement.style.setProperty("--head", `${$("lamp").parentElement.offsetHeight}px`);
}).observe($("lamp").parentElement);
addEventListener("resize", () => { scene.framed && scene.fit(); changed = true; });
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { changed = true; });
connect(); requestAnimationFrame(turn);
