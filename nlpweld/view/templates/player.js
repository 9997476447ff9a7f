// The page: stage with one pane a plan, readings, plots, and the cursor that moves them all.
"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const { timed, plans } = data;
const asked = new URLSearchParams(location.hash.slice(1)); // at, look, view, shadows
const SEAM_S = 20; // what the whole seam takes at speed 1 where there is no time
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];
const VIEWS = { overview: [1, 1.5, 0.75], front: [0, 1, 0.12], side: [1, 0, 0.12], top: [0, 0.001, 1], weld: [0.7, 1, 0.8] };
const byId = (id) => document.getElementById(id);
const element = (tag, properties = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
};

/** All panes on one canvas with one camera. */
class Stage {
  constructor(holder, cells) {
    Object.assign(this, { holder, cells });
    this.viewer = new MeshCat.Viewer(holder, false); // brings renderer and orbit controls; draws nothing by itself
    this.viewer.gui.domElement.remove();
    this.viewer.set_3d_pane_size = () => this.resize();
    this.viewer.controls.dispose();
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.05, 100);
    this.camera.up.set(0, 0, 1);
    this.viewer.set_camera(this.camera);
    this.renderer = this.viewer.renderer;
    this.renderer.outputEncoding = THREE.sRGBEncoding;
    this.renderer.setScissorTest(true);
    this.renderer.shadowMap.autoUpdate = false;
    this.renderer.shadowMap.enabled = asked.get("shadows") !== "off"; // for machines without a graphics processor
    new ResizeObserver(() => this.resize()).observe(holder);
    this.resize();
    this.look("overview");
  }

  resize() {
    const { clientWidth, clientHeight } = this.holder;
    this.renderer.setSize(clientWidth, clientHeight);
    this.camera.aspect = clientWidth / this.cells.length / clientHeight;
    this.camera.updateProjectionMatrix();
    this.ask();
  }

  /** Look at the cell, or at the weld, from a side; at overview and weld the robots stand behind the work. */
  look(name) {
    const box = this.cells.reduce((all, cell) => all.union(cell.box), new THREE.Box3());
    const sphere = box.getBoundingSphere(new THREE.Sphere());
    const close = name === "weld";
    const target = close ? this.work() : sphere.center.clone();
    target.z -= close ? 0.05 : 0.1 * sphere.radius; // leaves the foot of the pane to the readings
    const half = Math.atan(Math.tan((this.camera.fov * Math.PI) / 360) * Math.min(1, this.camera.aspect));
    const distance = (close ? 0.5 : 0.78 * sphere.radius) / Math.sin(half);
    const from = new THREE.Vector3(...VIEWS[name]).normalize().multiplyScalar(distance);
    if (close || name === "overview") from.applyAxisAngle(this.camera.up, this.turn(sphere.radius));
    this.viewer.controls.target.copy(target);
    this.camera.position.copy(target).add(from);
    this.viewer.controls.update();
    this.ask();
  }

  /** Return the middle of the places of the work. */
  work() {
    const sum = new THREE.Vector3();
    for (const cell of this.cells) sum.add(cell.middle());
    return sum.divideScalar(this.cells.length);
  }

  /** Return by how much the view turns so that it comes from where the work is off the robots' bases. */
  turn(radius) {
    const away = this.work().sub(this.cells[0].bases());
    return Math.hypot(away.x, away.y) < 0.25 * radius ? 0 : Math.atan2(away.y, away.x) - Math.PI / 2;
  }

  /** Return where a pane is on the canvas, in pixels of the page. */
  pane(i) {
    const { clientWidth, clientHeight } = this.holder;
    const width = clientWidth / this.cells.length;
    return { left: i * width, top: 0, width, height: clientHeight };
  }

  /** Ask for all panes to be drawn at the next frame, with new shadows where something has moved. */
  ask(moved = false) {
    this.moved ||= moved;
    this.viewer.set_dirty();
  }

  draw() {
    for (const [i, cell] of this.cells.entries()) {
      this.renderer.shadowMap.needsUpdate = this.moved;
      const { left, width, height } = this.pane(i);
      this.renderer.setViewport(left, 0, width, height);
      this.renderer.setScissor(left, 0, width, height);
      this.renderer.render(cell.scene, this.camera);
    }
    this.moved = this.viewer.needs_render = false;
  }
}

/** What one pane says in numbers, robots named by their colours. */
class Card {
  constructor(plan, cell, seek) {
    Object.assign(this, { plan, cell, seek, chips: new Map() });
    this.points = unpack(plan.points);
    this.measures = measuresOf(plan);
    const { value, name, over_seam: over } = plan.objective;
    const at = plan.placement_m.map((m) => (Math.abs(m) < 5e-4 ? 0 : m).toFixed(3)).join(", ");
    const whole = value === null ? "not measured" : `${over} ${name} ${value.toPrecision(5)}`;
    [this.where, this.pair] = [element("p"), element("p")];
    this.head = element("div", { className: "card" }, element("h2", { textContent: plan.name }));
    this.head.append(element("p", { textContent: `placed at (${at}) m; ${whole}` }), this.where, this.pair);
    this.foot = element("div", { className: "chips" });
    for (const [i, robot] of plan.robots.entries()) this.chip(robot.name, robot.role, `w.${robot.name}`, `series-${i % 7}`, robot.model);
    this.chip(name, "all robots", "team");
    this.chip("clearance", "nearest pair", "clearance");
  }

  /** Add one measure: its value now, and the worst along the plan, to which a click goes. */
  chip(name, note, key, series, title = "") {
    const swatch = element("span", { className: "swatch" });
    if (series) swatch.style.background = `var(--${series})`;
    const told = element("span", { className: "faint", textContent: note });
    const chip = element("div", { className: "chip", title }, element("p", {}, ...(series ? [swatch] : []), `${name.replaceAll("_", " ")} `, told));
    this.foot.append(chip);
    const measure = this.measures.get(key);
    if (!measure) return;
    const worst = this.plan.measures.worst[key];
    const { x, s } = this.cell.motion;
    const now = element("b");
    const text = `least ${measure.text(measure.y[worst])} at ${timed ? `${x[worst].toFixed(2)} s` : `s ${s[worst].toFixed(3)}`}`;
    const button = element("button", { className: "least", textContent: text, title: "the worst along the plan; go there" });
    button.addEventListener("click", () => this.seek(x[worst]));
    chip.append(element("p", {}, now, measure.unit), button);
    this.chips.set(key, { now, chip, worst: x[worst] });
  }

  update(cursor) {
    const motion = this.cell.motion;
    const { k, share } = motion.moment;
    const held = Math.min(cursor, motion.x[motion.x.length - 1]);
    for (const [key, { now, chip, worst }] of this.chips) {
      const measure = this.measures.get(key);
      now.textContent = measure.text(motion.value(measure.y));
      chip.classList.toggle("at-least", Math.abs(held - worst) < 1e-6 * (span[1] - span[0]));
    }
    this.nearest = this.plan.measures.pairs[this.measures.get("pair").y[share < 0.5 ? k : k + 1]];
    this.pair.textContent = `nearest: ${this.nearest}`;
    const s = motion.value(motion.s);
    const phase = this.plan.phases.find(({ end_s: end }) => held <= end + 1e-6);
    this.where.textContent = `s ${s.toFixed(3)}, ${this.point(s)}${phase ? `, ${phase.name}` : ""}`;
  }

  /** Return which seam point s is at or after. */
  point(s) {
    const at = this.points.reduce((last, point, i) => (point <= s + 1e-6 ? i : last), 0);
    return s >= this.points[0] + 1 - 1e-6 ? "back at point 0" : `point ${at} of ${this.points.length}`;
  }
}

/** Return the measures of a plan by key: values over its frames, and how they are written. */
function measuresOf(plan) {
  const { w, team, clearance, pair } = plan.measures;
  const plain = (value) => (Number.isFinite(value) ? value.toFixed(4) : "–");
  const found = new Map(Object.entries(w).map(([name, packed]) => [`w.${name}`, { y: unpack(packed), text: plain, unit: " m³" }]));
  found.set("team", { y: unpack(team), text: (v) => (Number.isFinite(v) ? v.toPrecision(4) : "–"), unit: "" });
  found.set("clearance", { y: unpack(clearance).map((m) => 1e3 * m), text: (mm) => mm.toFixed(1), unit: " mm" });
  return found.set("pair", { y: unpack(pair) });
}

/** The plots below the stage; curves of the second plan are dashed. */
class Plots {
  constructor(parent, cards, seek) {
    this.cards = cards;
    const cursor = timed ? "t [s]" : "s";
    const { name, unit } = plans[0].objective;
    const titles = { w: `w [m³] over ${cursor}`, team: `${name} ${unit}`, clearance: "clearance [mm]", joints: "joints [deg]" };
    this.plots = Object.fromEntries(Object.entries(titles).map(([key, title]) => [key, new Plot(parent, title, span, seek)]));
    this.robot = element("select", { ariaLabel: "robot", onchange: () => this.drawJoints() });
    for (const { name: robot } of plans[0].robots) this.robot.append(element("option", { textContent: robot }));
    this.key = element("span");
    this.plots.joints.head.append(this.robot, this.key);
    this.draw();
  }

  curves(keep) {
    return this.cards.flatMap(({ plan, cell, measures }, i) =>
      [...measures].filter(([key]) => keep(key)).map(([key, { y }]) => {
        const robot = plan.robots.findIndex(({ name }) => key === `w.${name}`);
        const stroke = robot < 0 ? `var(--${i ? "series-5" : "ink"})` : `var(--series-${robot % 7})`;
        return { x: cell.motion.x, y, colour: stroke, second: i > 0, worst: plan.measures.worst[key], name: `${plan.name}: ${key.replace("w.", "")}` };
      }),
    );
  }

  draw() {
    const levels = plans[0].measures;
    this.welds = plans[0].phases.filter(({ name }) => name === "weld").map(({ begin_s: begin, end_s: end }) => [begin, end]);
    this.plots.w.draw(this.curves((key) => key.startsWith("w.")), [levels.floor_m3], this.welds);
    this.plots.team.draw(this.curves((key) => key === "team"), [], this.welds);
    this.plots.clearance.draw(this.curves((key) => key === "clearance"), [1e3 * levels.clearance_m], this.welds);
    this.drawJoints();
  }

  drawJoints() {
    const name = this.robot.value;
    const names = Array.from({ length: plans[0].measures.joints[name].shape[1] }, (_, j) => element("span", { textContent: `J${j + 1} ` }));
    for (const [j, text] of names.entries()) text.style.color = `var(--series-${j})`;
    this.key.replaceChildren(...names);
    const curves = this.cards.flatMap(({ plan, cell }, i) => {
      const packed = plan.measures.joints[name];
      if (!packed) return [];
      const [joints, n] = [unpack(packed), packed.shape[1]];
      return Array.from({ length: n }, (_, j) => {
        const y = Array.from(cell.motion.x, (_x, k) => (joints[k * n + j] * 180) / Math.PI);
        return { x: cell.motion.x, y, colour: `var(--series-${j})`, second: i > 0, name: `${plan.name}: J${j + 1}` };
      });
    });
    this.plots.joints.draw(curves, [], this.welds);
  }

  seek(x) {
    for (const plot of Object.values(this.plots)) plot.seek(x);
  }
}

/** Say above the stage what the plans break and what the page leaves out. */
function banners() {
  for (const { name, verdict } of plans.filter((plan) => !plan.verdict.feasible)) {
    const lines = verdict.violations.map((line) => element("li", { textContent: line }));
    if (verdict.more) lines.push(element("li", { textContent: `and ${verdict.more} more` }));
    const head = `${name} is NOT feasible: the verifier finds (nlpweld verify tells all)`;
    byId("banners").append(element("div", { className: "banner" }, head, element("ul", {}, ...lines)));
  }
  const left = data.timeline_left_out.join(", ");
  if (left) byId("banners").append(element("div", { className: "banner note", textContent: `${left} is timed and the other plan is not: both are shown over the seam parameter` }));
}

/** Show when which phase goes on, one strip for each timed plan. */
function phaseStrips() {
  for (const { phases } of plans.filter((plan) => plan.phases.length)) {
    const strip = element("div", { className: "strip" });
    for (const { name, begin_s: begin, end_s: end } of phases) {
      const part = element("span", { className: name, textContent: name, title: `${name}: ${begin.toFixed(2)} to ${end.toFixed(2)} s` });
      part.style.flex = `0 0 ${(100 * (end - begin)) / (span[1] - span[0])}%`;
      strip.append(part);
    }
    byId("phases").append(strip);
    new ResizeObserver(() => {
      for (const part of strip.children) part.classList.toggle("narrow", part.scrollWidth > part.clientWidth);
    }).observe(strip);
  }
}

if (!document.createElement("canvas").getContext("webgl2")) {
  byId("banners").append(element("div", { className: "banner", textContent: "This browser offers no WebGL 2, with which the page draws." }));
}
const cells = plans.map((plan) => new Cell3d(plan));
const span = [Math.min(...cells.map(({ motion }) => motion.x[0])), Math.max(...cells.map(({ motion }) => motion.x[motion.x.length - 1]))];
const pace = timed ? 1 : (span[1] - span[0]) / SEAM_S;
const state = { x: span[0], playing: false, speed: 1 };
const stage = new Stage(byId("canvas"), cells);
const cards = plans.map((plan, i) => new Card(plan, cells[i], (x) => seek(x)));
const plots = new Plots(byId("plots"), cards, (x) => seek(x));

function seek(x) {
  state.x = Math.min(span[1], Math.max(span[0], x));
  for (const cell of cells) cell.place(state.x);
  for (const card of cards) card.update(state.x);
  for (const [i, cell] of cells.entries()) cell.emphasise(state.nearest ? cards[i].nearest.split(" - ") : []);
  plots.seek(state.x);
  byId("scrub").value = (state.x - span[0]) / (span[1] - span[0]);
  byId("now").textContent = timed ? `${state.x.toFixed(2)} of ${span[1].toFixed(2)} s` : `s ${(state.x).toFixed(3)} of the seam`;
  stage.ask(true);
}

function play(on) {
  if (on && state.x >= span[1]) seek(span[0]);
  state.playing = on;
  byId("play").textContent = on ? "⏸" : "▶";
}

function look(name) {
  document.documentElement.dataset.look = name;
  byId("look").textContent = name === "dark" ? "light" : "dark";
  for (const cell of cells) cell.repaint();
  stage.ask();
}

const actions = {
  play: () => play(!state.playing),
  look: () => look(document.documentElement.dataset.look === "dark" ? "light" : "dark"),
  frames: () => {
    state.frames = !state.frames;
    byId("frames").setAttribute("aria-pressed", state.frames);
    for (const cell of cells) cell.axes.visible = state.frames;
    stage.ask();
  },
  nearest: () => {
    state.nearest = !state.nearest;
    byId("nearest").setAttribute("aria-pressed", state.nearest);
    seek(state.x);
  },
};
const step = (share) => seek(state.x + share * (span[1] - span[0]));
const KEYS = {
  " ": actions.play, d: actions.look, f: actions.frames, n: actions.nearest,
  ArrowRight: (event) => step(event.shiftKey ? 0.001 : 0.01), ArrowLeft: (event) => step(event.shiftKey ? -0.001 : -0.01),
  Home: () => seek(span[0]), End: () => seek(span[1]),
};

function wire() {
  for (const [name, act] of Object.entries(actions)) byId(name).addEventListener("click", act);
  for (const [i, name] of Object.keys(VIEWS).entries()) {
    KEYS[String(i + 1)] = () => stage.look(name);
    byId("views").append(element("button", { textContent: name, title: `look: ${name} (${i + 1})`, onclick: KEYS[String(i + 1)] }));
  }
  for (const speed of SPEEDS) byId("speed").append(element("option", { value: speed, textContent: `${speed}×`, selected: speed === 1 }));
  byId("speed").addEventListener("change", (event) => (state.speed = Number(event.target.value)));
  byId("scrub").addEventListener("input", (event) => seek(span[0] + event.target.value * (span[1] - span[0])));
  document.addEventListener("keydown", (event) => {
    const act = KEYS[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === "SELECT") return;
    event.preventDefault();
    act(event);
  });
}

function tick(now) {
  const passed = (now - (state.last ?? now)) / 1e3;
  state.last = now;
  if (state.playing) {
    seek(state.x + passed * state.speed * pace);
    if (state.x >= span[1]) play(false);
  }
  if (stage.viewer.needs_render) stage.draw();
  requestAnimationFrame(tick);
}

function start() {
  byId("title").textContent = plans.map(({ name }) => name).join(" and ");
  const over = timed ? "over time" : "over the seam parameter s, not over time: the plans hold no time axis";
  const about = [...new Set(plans.map(({ cell, title }) => `${cell}: ${title}`))].join("; ");
  byId("about").textContent = `${about}. Shown ${plans.length === 1 ? over.replace("plans hold", "plan holds") : over}.${plans.length > 1 ? " Dashed: " + plans[1].name + "." : ""}`;
  for (const { head, foot } of cards) byId("panes").append(element("section", { className: "pane" }, head, foot));
  banners();
  phaseStrips();
  wire();
  look(asked.get("look") ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
  if (asked.get("view") in VIEWS) stage.look(asked.get("view"));
  seek(span[0] + Number(asked.get("at") ?? 0) * (span[1] - span[0]));
  requestAnimationFrame(tick);
}

// For tests: what the page would show is drawn by the same meshes and camera, some of them alone in flat colours.
window.nlpweld = {
  span, state,
  seek: (x) => {
    seek(x);
    stage.draw();
  },
  setSpeed: (speed) => (state.speed = speed),
  camera: () => {
    stage.camera.updateMatrixWorld();
    const { left, top } = stage.holder.getBoundingClientRect();
    const panes = cells.map((_, i) => stage.pane(i)).map((pane) => ({ ...pane, left: pane.left + left, top: pane.top + top }));
    return { view: stage.camera.matrixWorldInverse.elements, projection: stage.camera.projectionMatrix.elements, panes };
  },
  flatten: (marks) => {
    document.body.classList.add("flat");
    stage.camera.layers.set(FLAT);
    for (const [i, cell] of cells.entries()) cell.flatten(marks.filter(({ plan }) => plan === i));
    seek(state.x);
  },
};
start();
