// One plan in three dimensions: its cell as meshes, and where everything is at a moment. Z is up; lengths in metres.
"use strict";
const { THREE } = MeshCat;
const [STICK_M, SEAM_M, BEAD_M, GLOW_M, AXES_M, GRID_M] = [0.008, 0.0025, 0.006, 0.14, 0.15, 0.25];
const FLAT = 1; // layer of what is drawn for tests
const UNIT = {
  tube: new THREE.CylinderGeometry(1, 1, 1, 32, 1, true),
  ball: new THREE.SphereGeometry(1, 32, 16),
};
const UP = new THREE.Vector3(0, 1, 0); // axis of the unit tube

/** Return the numbers of a packed array. */
function unpack(packed) {
  return new Float32Array(Uint8Array.from(atob(packed.f32), (c) => c.charCodeAt(0)).buffer);
}

/** Return a colour of the style sheet, as it is lit. */
function colour(name) {
  const text = getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  return new THREE.Color(text).convertSRGBToLinear();
}

/** Poses and seam parameter of a plan over the cursor; between two frames everything goes linearly. */
class Motion {
  constructor(plan) {
    Object.assign(this, { x: unpack(plan.x), s: unpack(plan.s), poses: unpack(plan.poses) });
    this.index = new Map(plan.frames.map((name, i) => [name, 12 * i]));
    this.stride = 12 * plan.frames.length;
    this.moment = this.at(this.x[0]);
  }

  /** Return the frame at or before a cursor, and the share of the way to the next. */
  at(x) {
    const last = this.x.length - 1;
    if (x >= this.x[last]) return { k: last - 1, share: 1 };
    let [low, high] = [0, last];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.x[middle] <= x) low = middle;
      else high = middle;
    }
    return { k: low, share: Math.max(0, (x - this.x[low]) / (this.x[high] - this.x[low])) };
  }

  /** Return column i of an array with so many columns, at the moment. */
  value(array, columns = 1, i = 0) {
    const { k, share } = this.moment;
    const at = (row) => array[row * columns + i];
    return share === 0 ? at(k) : share === 1 ? at(k + 1) : (1 - share) * at(k) + share * at(k + 1);
  }

  matrix(frame) {
    const from = this.index.get(frame);
    const T = Array.from({ length: 12 }, (_, i) => this.value(this.poses, this.stride, from + i));
    return new THREE.Matrix4().set(...T, 0, 0, 0, 1);
  }

  point(end) {
    return new THREE.Vector3(...end.at).applyMatrix4(this.matrix(end.frame));
  }
}

/** A capsule between two points of a plan, or without round ends a stick. */
class Capsule extends THREE.Group {
  constructor(body, material, round = true) {
    super();
    this.body = body;
    this.tube = new THREE.Mesh(UNIT.tube, material);
    this.balls = round ? { start: new THREE.Mesh(UNIT.ball, material), end: new THREE.Mesh(UNIT.ball, material) } : {};
    this.add(this.tube, ...Object.values(this.balls));
    for (const mesh of this.children) mesh.castShadow = mesh.receiveShadow = true;
  }

  place(motion) {
    const ends = { start: motion.point(this.body.start), end: motion.point(this.body.end) };
    const along = ends.end.clone().sub(ends.start);
    const length = along.length();
    this.tube.visible = length > 1e-6;
    this.tube.position.copy(ends.start).addScaledVector(along, 0.5);
    this.tube.quaternion.setFromUnitVectors(UP, along.normalize());
    this.tube.scale.set(this.body.radius, Math.max(length, 1e-6), this.body.radius);
    for (const [which, ball] of Object.entries(this.balls)) {
      ball.position.copy(ends[which]);
      ball.scale.setScalar(ball.userData.flatRadius || this.body.radius);
    }
  }
}

/** A curve through points at equal steps of its parameter, which is the seam's. */
class SeamCurve extends THREE.Curve {
  constructor(points) {
    super();
    this.points = points;
  }

  getPoint(t, to = new THREE.Vector3()) {
    const last = this.points.length / 3 - 1;
    const k = Math.min(Math.floor(t * last), last - 1);
    const [a, b] = [0, 1].map((i) => new THREE.Vector3().fromArray(this.points, 3 * (k + i)));
    return to.copy(a).lerp(b, t * last - k);
  }

  getUtoTmapping(u) {
    return u;
  }
}

function texture(canvas) {
  return Object.assign(new THREE.CanvasTexture(canvas), { encoding: THREE.sRGBEncoding });
}

/** A text that always faces the camera. */
function label(text, ink) {
  const canvas = Object.assign(document.createElement("canvas"), { width: 256, height: 48 });
  const pen = canvas.getContext("2d");
  Object.assign(pen, { font: "30px system-ui, sans-serif", fillStyle: ink, textBaseline: "middle" });
  pen.fillText(text, 4, 24);
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: texture(canvas), depthTest: false }));
  sprite.center.set(0, 0.5);
  sprite.scale.set(0.4, 0.075, 1);
  return sprite;
}

/** The arc's glow at a torch. */
function glow() {
  const canvas = Object.assign(document.createElement("canvas"), { width: 64, height: 64 });
  const pen = canvas.getContext("2d");
  const light = pen.createRadialGradient(32, 32, 0, 32, 32, 32);
  light.addColorStop(0, "rgba(255,255,255,1)");
  light.addColorStop(0.25, "rgba(255,214,120,.85)");
  light.addColorStop(1, "rgba(255,120,20,0)");
  pen.fillStyle = light;
  pen.fillRect(0, 0, 64, 64);
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: texture(canvas), depthWrite: false }));
  sprite.scale.setScalar(GLOW_M);
  return sprite;
}

/** A cell, drawn. */
class Cell3d {
  constructor(plan) {
    this.plan = plan;
    this.motion = new Motion(plan);
    this.welding = unpack(plan.welding);
    this.scene = new THREE.Scene();
    this.bodies = new Map(); // by label
    this.followers = []; // [object, frame]: what a frame carries
    this.painted = []; // [material, colour name, factor]
    this.glows = [];
    this.beads = [];
    for (const [i, robot] of plan.robots.entries()) this.addRobot(robot, `series-${i % 7}`);
    this.addWork();
    this.addFrames();
    this.place(this.motion.x[0]);
    this.box = this.bounds();
    this.addSurroundings();
  }

  paint(name, factor = 1, options = {}) {
    const material = new THREE.MeshStandardMaterial({ roughness: 0.5, metalness: 0.05, ...options });
    this.painted.push([material, name, factor]);
    return material;
  }

  addCapsules(bodies, name) {
    for (const [i, body] of bodies.entries()) {
      const capsule = new Capsule(body, this.paint(name, body.tool ? 0.45 : i % 2 ? 0.8 : 1));
      this.bodies.set(body.label, capsule);
      this.scene.add(capsule);
    }
  }

  addRobot(robot, name) {
    this.addCapsules(robot.bodies, name);
    for (const [i, stick] of robot.sticks.entries()) {
      const capsule = new Capsule({ ...stick, radius: STICK_M }, this.paint(name, 0.6), false);
      this.bodies.set(`${robot.name} stick ${i}`, capsule);
      this.scene.add(capsule);
    }
    if (robot.role === "welds") {
      const light = glow();
      this.glows.push(light);
      this.follow(light, robot.tcp);
    }
  }

  addWork() {
    const { tee, bodies } = this.plan.workpiece;
    this.work = new THREE.Group();
    this.follow(this.work, "workpiece");
    this.addCapsules(bodies, "work");
    if (tee) this.addTee(tee);
    for (const seam of this.plan.seams) {
      const curve = new SeamCurve(unpack(seam.points));
      const segments = curve.points.length / 3 - 1;
      const tube = (radius, name) => {
        const geometry = new THREE.TubeGeometry(curve, segments, radius, 8, false);
        return new THREE.Mesh(geometry, this.paint(name, 1, { roughness: 0.8 }));
      };
      const bead = tube(BEAD_M, "bead");
      Object.assign(bead.userData, { segments, seam: seam.name });
      this.beads.push(bead);
      this.work.add(tube(SEAM_M, "seam"), bead);
    }
  }

  /** Two real pipes; the verifier's capsules lie within them. */
  addTee(tee) {
    const pipe = (label, radius, length) => {
      const wall = this.paint("work", 1, { side: THREE.DoubleSide, metalness: 0.35 });
      const mesh = new THREE.Mesh(new THREE.CylinderGeometry(radius, radius, length, 64, 1, true), wall);
      mesh.castShadow = mesh.receiveShadow = true;
      this.bodies.set(`workpiece.${label}`, mesh);
      this.work.add(mesh);
      return mesh;
    };
    pipe("main_pipe", tee.main_radius_m, tee.main_length_m).rotation.z = Math.PI / 2;
    const branch = pipe("branch", tee.branch_radius_m, tee.branch_top_m);
    branch.rotation.x = Math.PI / 2;
    branch.position.z = tee.branch_top_m / 2;
  }

  addFrames() {
    this.axes = new THREE.Group();
    this.labels = [];
    this.scene.add(this.axes);
    const axes = (text) => {
      const group = new THREE.Group().add(new THREE.AxesHelper(AXES_M));
      Object.assign(group.children[0], { renderOrder: 1 }).material.depthTest = false; // bodies hide none
      this.labels.push([group, text]);
      return group;
    };
    const placed = axes("P");
    placed.matrix.set(...this.plan.placement_pose, 0, 0, 0, 1);
    placed.matrixAutoUpdate = false;
    this.axes.add(axes("W"), placed);
    this.follow(axes("C"), "workpiece", this.axes);
    for (const robot of this.plan.robots) {
      this.follow(axes(`B ${robot.name}`), `${robot.name}.link0`, this.axes);
      if (robot.tcp) this.follow(axes(`E ${robot.name}`), robot.tcp, this.axes);
    }
    this.axes.visible = false;
  }

  follow(object, frame, parent = this.scene) {
    object.matrixAutoUpdate = object.isSprite === true; // a sprite keeps its size and takes the position alone
    this.followers.push([object, frame]);
    parent.add(object);
  }

  /** Return the box of all bodies over the whole plan. */
  bounds() {
    const box = new THREE.Box3();
    const step = Math.ceil(this.motion.x.length / 24);
    for (let k = 0; k < this.motion.x.length; k += step) {
      this.place(this.motion.x[k]);
      this.scene.updateMatrixWorld();
      for (const body of this.bodies.values()) box.expandByObject(body);
    }
    box.expandByPoint(new THREE.Vector3(box.min.x, box.min.y, 0));
    return box;
  }

  /** Return where the weld is in the middle of the plan. */
  middle() {
    const motion = this.motion;
    motion.moment = { k: motion.x.length >> 1, share: 0 };
    return motion.point({ frame: this.plan.robots.find(({ role }) => role === "welds").tcp, at: [0, 0, 0] });
  }

  /** Return the middle of the bases of the robots that stand by themselves. */
  bases() {
    const stand = this.plan.robots.filter(({ tcp }) => tcp).map(({ name }) => this.motion.point({ frame: `${name}.link0`, at: [0, 0, 0] }));
    return stand.reduce((sum, p) => sum.add(p), new THREE.Vector3()).divideScalar(stand.length);
  }

  addSurroundings() {
    const centre = this.box.getCenter(new THREE.Vector3());
    const radius = this.box.getSize(new THREE.Vector3()).length() / 2;
    const key = new THREE.DirectionalLight(0xffffff, 0.75);
    key.position.set(0.5, 0.35, 1.2).multiplyScalar(2 * radius).add(centre);
    key.target.position.copy(centre);
    key.castShadow = true;
    key.shadow.mapSize.set(2048, 2048);
    key.shadow.normalBias = 0.01;
    key.shadow.radius = 3;
    const reach = 1.15 * radius;
    Object.assign(key.shadow.camera, { left: -reach, right: reach, bottom: -reach, top: reach, near: 0.1, far: 5 * radius });
    const fill = new THREE.DirectionalLight(0xffffff, 0.25);
    fill.position.set(-1, -2, 1).multiplyScalar(radius).add(centre);
    this.scene.add(key, key.target, fill, fill.target, new THREE.HemisphereLight(0xffffff, 0x9098a0, 0.55));
    this.shade = new THREE.ShadowMaterial({ opacity: 0.25 });
    const side = 2 * Math.ceil(2 * radius);
    const floor = new THREE.Mesh(new THREE.PlaneGeometry(side, side), this.shade);
    floor.receiveShadow = true;
    this.ground = new THREE.Group().add(floor);
    this.ground.position.set(Math.round(centre.x), Math.round(centre.y), -0.001);
    this.ground.userData.side = side;
    this.scene.add(this.ground);
  }

  /** Take all colours from the style sheet again. */
  repaint() {
    for (const [material, name, factor] of this.painted) material.color.copy(colour(name)).multiplyScalar(factor);
    const { side, grid } = this.ground.userData;
    if (grid) this.ground.remove(grid);
    const fresh = new THREE.GridHelper(side, side / GRID_M, colour("faint"), colour("grid"));
    fresh.rotation.x = Math.PI / 2;
    Object.assign(fresh.material, { transparent: true, opacity: 0.5 });
    this.ground.userData.grid = fresh;
    this.ground.add(fresh);
    const ink = getComputedStyle(document.documentElement).getPropertyValue("--ink");
    for (const [group, text] of this.labels) {
      if (group.children.length > 1) group.remove(group.children[1]);
      group.add(label(text, ink));
    }
  }

  /** Put everything where it is at a cursor. */
  place(x) {
    const motion = this.motion;
    motion.moment = motion.at(x);
    for (const body of this.bodies.values()) if (body.place) body.place(motion);
    for (const [object, frame] of this.followers) {
      const T = motion.matrix(frame);
      if (object.matrixAutoUpdate) object.position.setFromMatrixPosition(T);
      else object.matrix.copy(T);
      object.matrixWorldNeedsUpdate = true;
    }
    const arc = motion.value(this.welding) > 0.5 && x > motion.x[0] && x < motion.x[motion.x.length - 1];
    for (const light of this.glows) light.visible = arc;
    const s = motion.s;
    const done = (motion.value(s) - s[0]) / (s[s.length - 1] - s[0]);
    for (const bead of this.beads) bead.geometry.setDrawRange(0, 6 * 8 * Math.floor(done * bead.userData.segments + 1e-6));
  }

  /** Light up two bodies, by their labels, and no other. */
  emphasise(labels) {
    for (const [name, body] of this.bodies) {
      const material = (body.tube || body).material;
      if (material.emissive) material.emissive.setHex(labels.includes(name) ? 0x991100 : 0);
    }
  }

  /** Draw alone, in flat colours, some ends of bodies as balls and some beads; for tests, until the page is closed. */
  flatten(marks) {
    this.scene.traverse((object) => object.layers.disable(FLAT));
    for (const { body, end, seam, radius, colour: flat } of marks) {
      const mesh = body ? this.bodies.get(body).balls[end] : this.beads.find((bead) => bead.userData.seam === seam);
      mesh.material = new THREE.MeshBasicMaterial({ color: flat });
      mesh.userData.flatRadius = radius;
      mesh.layers.enable(FLAT);
    }
  }
}
