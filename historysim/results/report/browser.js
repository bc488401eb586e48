// The contact in a page: the library of historysim as WebAssembly, a model that replays load paths on it, SVG charts, and the
// explorer of a report. Everything is in the page, nothing is fetched.
"use strict";

const TOTALS = [
  "normal_load", "tangential_load", "approach", "displacement", "contact_count", "real_contact_area",
  "tangential_stiffness", "dissipated_energy", "friction_limit", "saturated", "friction", "traction_ratio",
  "slid_together", "erased_memories", "erased_energy", "yielded_share", "yielding_energy",
];
const STATES = ["separated", "full stick", "partial slip", "gross slip"];
const LOAD = 0, DISPLACED = 1, HELD = 2;
const BEYOND_LIMIT = 1;
const PATH_SIZE = 96; // bytes of `hs_path`; browser.c asserts its offsets

async function unpack(base64) {
  const packed = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Compile the library. What it imports from a system (to write to standard error, to exit) is never needed: stubs.
async function loadLibrary(base64) {
  const module = await WebAssembly.compile(await unpack(base64));
  const imports = {};
  for (const { module: from, name } of WebAssembly.Module.imports(module)) (imports[from] ??= {})[name] = () => 0;
  const { exports } = await WebAssembly.instantiate(module, imports);
  exports._initialize?.();
  return exports;
}

// Memory of the library that JavaScript reads and writes; views are made anew since a growing memory moves.
class Memory {
  constructor(library) {
    this.library = library;
    this.addresses = [];
  }
  allocate(bytes) {
    const address = this.library.allocate(Math.max(bytes, 8));
    if (!address) throw new RangeError("out of memory");
    this.addresses.push(address);
    return address;
  }
  put(values) {
    const address = this.allocate(values.byteLength);
    new Uint8Array(this.library.memory.buffer, address, values.byteLength)
      .set(new Uint8Array(values.buffer, values.byteOffset, values.byteLength));
    return address;
  }
  numbers(address, count) {
    return new Float64Array(this.library.memory.buffer, address, count);
  }
  release() {
    for (const address of this.addresses.splice(0)) this.library.release(address);
  }
}

// One straight path (see `hs_path`): controls and targets of the normal channel and of x and y; null holds a channel.
function writePath(bytes, index, row, normal, tangential, parts = 1) {
  const view = new DataView(bytes.buffer, bytes.byteOffset + index * PATH_SIZE, PATH_SIZE);
  const channel = (value, control, target, fraction, controlAt) => {
    view.setFloat64(target, value ?? 0, true);
    view.setFloat64(fraction, value === null ? 0 : 1, true);
    view.setInt32(controlAt, control, true);
  };
  channel(normal.target, normal.control, 0, 8, 64);
  channel(tangential.target, tangential.control, 16, 32, 68);
  channel(null, HELD, 24, 40, 72);
  view.setBigInt64(48, BigInt(parts), true);
  view.setBigInt64(56, BigInt(row), true);
  view.setInt32(76, 1, true);
  view.setFloat64(80, NaN, true);
  view.setFloat64(88, NaN, true);
}

// A contact of summits and the load paths it follows, replayed with friction and moduli times a factor.
class Model {
  // setup: height, radius, friction [SI] (asperity), modulus E* [Pa], ratio E*/(4 G*), directions, rings, drive, paths, rows
  constructor(library, setup, factors = { friction: 1, modulus: 1 }) {
    this.library = library;
    this.setup = setup;
    this.memory = new Memory(library);
    this.count = setup.height.length;
    this.rows = setup.rows;
    this.modulus = setup.modulus * factors.modulus;
    this.friction = setup.friction.map((value) => value * factors.friction);
    this.states = [];
    const distinct = [...new Set(this.friction)].sort((a, b) => a - b);
    const group = Int32Array.from(this.friction, (value) => distinct.indexOf(value));
    const [classes, rings, tolerance] = setup.directions === 2 ? setup.rings : [0, 0, 0];
    const inputs = [setup.height, setup.radius, this.friction, group].map((values) => this.memory.put(values));
    this.start = library.new_state(this.count, ...inputs, this.modulus, setup.ratio, classes, rings, tolerance);
    if (!this.start) throw new RangeError("out of memory");
    this.states.push(this.start);
    this.drive = this.memory.put(Float64Array.from(setup.drive));
    this.refused = this.memory.allocate(24);
    this.paths = this.memory.put(setup.paths);
    this.pathCount = setup.paths.byteLength / PATH_SIZE;
    this.totals = this.memory.allocate(8 * TOTALS.length * this.rows);
    this.vectors = [0, 1].map(() => this.memory.allocate(16 * this.rows));
    this.own = [8, 8 * setup.directions].map((bytes) => this.memory.allocate(bytes * this.rows));
    // the row at which each path ends
    this.ends = new Float64Array(this.pathCount);
    const view = new DataView(setup.paths.buffer, setup.paths.byteOffset);
    let row = 0;
    for (let path = 0; path < this.pathCount; path++) {
      row += Number(view.getBigInt64(path * PATH_SIZE + 48, true)) - 1 + view.getInt32(path * PATH_SIZE + 76, true);
      this.ends[path] = row;
    }
  }

  // Integrate all paths; every so many paths a copy of the state is kept, and the page may show something else.
  async replay({ asperity = -1, keep = true, pause = async () => {} } = {}) {
    const state = this.library.copy_state(this.start);
    const each = Math.max(Math.ceil(this.pathCount / 64), 1);
    if (keep) this.kept = [{ path: 0, state: this.start }];
    this.refusal = null;
    this.known = this.rows;
    let resumed = performance.now();
    for (let path = 0; path < this.pathCount && !this.refusal; path += each) {
      const last = Math.min(path + each, this.pathCount);
      this.refusal = this.#integrate(state, this.paths + path * PATH_SIZE, last - path, 1, asperity, path);
      if (this.refusal) this.known = this.refusal.path ? this.ends[this.refusal.path - 1] : 0;
      else if (keep && last < this.pathCount) {
        this.kept.push({ path: last, state: this.library.copy_state(state) });
        this.states.push(this.kept.at(-1).state);
      }
      if (performance.now() - resumed > 40) {
        await pause();
        resumed = performance.now();
      }
    }
    this.library.free_state(state);
    return this;
  }

  #integrate(state, paths, count, until, asperity, first) {
    const status = this.library.integrate(
      state, paths, count, until, this.drive, this.totals, ...this.vectors, asperity, ...this.own, this.refused,
    );
    if (!status) return null;
    const [request, limit, path] = this.memory.numbers(this.refused, 3);
    if (status !== BEYOND_LIMIT) throw new Error(`the library returned ${status}`);
    return { request, limit, path: first + path };
  }

  // A total at each row up to a refusal; in two directions load and displacement are those of an axis.
  total(name, axis = 0) {
    const vector = this.setup.directions === 2 ? ["tangential_load", "displacement"].indexOf(name) : -1;
    const [start, width, column] = vector < 0 ? [this.totals, TOTALS.length, TOTALS.indexOf(name)]
      : [this.vectors[vector], 2, axis];
    const rows = this.memory.numbers(start, width * this.rows);
    return Float64Array.from({ length: this.known }, (_, row) => rows[row * width + column]);
  }

  // Loads of one asperity at each row.
  async asperity(index, pause) {
    await this.replay({ asperity: index, keep: false, pause });
    const width = this.setup.directions;
    const load = this.memory.numbers(this.own[1], width * this.rows);
    return {
      normal: this.memory.numbers(this.own[0], this.rows).slice(0, this.known),
      tangential: Array.from({ length: width }, (_, axis) =>
        Float64Array.from({ length: this.known }, (_, row) => load[row * width + axis])),
    };
  }

  // The state at a row, which the caller frees.
  stateAt(row) {
    const end = this.ends.findIndex((last) => last > row);
    const from = this.kept.findLast(({ path }) => path <= end);
    const state = this.library.copy_state(from.state);
    // whole paths as in `replay`, of the last one the parts up to the row
    this.#integrate(state, this.paths + from.path * PATH_SIZE, end - from.path, 1, -1, from.path);
    const bytes = this.setup.paths.slice(end * PATH_SIZE, (end + 1) * PATH_SIZE), view = new DataView(bytes.buffer);
    const parts = Number(view.getBigInt64(48, true)), done = row - (end > 0 ? this.ends[end - 1] : 0) + 1;
    if (done < parts) {
      view.setBigInt64(48, BigInt(done), true);
      view.setInt32(76, 0, true);
    }
    const address = this.memory.put(bytes);
    this.#integrate(state, address, 1, Math.min(done / parts, 1), -1, end);
    this.library.release(this.memory.addresses.pop());
    return state;
  }

  // All asperities at a row, and the traction of one: radii and weights of the Hertz pressures that make it up.
  read(row, index) {
    const memory = new Memory(this.library), width = this.setup.directions;
    const state = this.stateAt(row);
    const sizes = [8, 8 * width, 8, 8, 1];
    const addresses = sizes.map((bytes) => memory.allocate(bytes * this.count));
    this.library.read_asperities(state, ...addresses);
    const room = 4096, found = memory.allocate(24 * room);
    const vertices = this.library.superposition(state, index, room, found);
    const [normal, tangential, radius, stick] = addresses.slice(0, 4)
      .map((address, at) => memory.numbers(address, (sizes[at] / 8) * this.count).slice());
    const result = {
      normal, tangential, radius, stick,
      slip: new Int8Array(this.library.memory.buffer, addresses[4], this.count).slice(),
      superposition: memory.numbers(found, 3 * Math.max(vertices, 0)).slice(),
    };
    this.library.free_state(state);
    memory.release();
    return result;
  }

  // τ(r) = Σ Δm p(r; c) in x or y, and μ p(r; a), at distances from the middle of an asperity [Pa].
  traction(cells, index, distance, axis = 0) {
    const peak = (2 * this.modulus) / (Math.PI * this.setup.radius[index]);
    const pressure = (r, edge) => (edge > r ? peak * Math.sqrt(edge * edge - r * r) : 0);
    const terms = cells.superposition;
    return {
      limit: distance.map((r) => this.friction[index] * pressure(r, cells.radius[index])),
      traction: distance.map((r) => {
        let sum = 0;
        for (let term = 0; term < terms.length; term += 3) sum += terms[term + 1 + axis] * pressure(r, terms[term]);
        return sum;
      }),
    };
  }

  free() {
    for (const state of new Set(this.states)) this.library.free_state(state);
    this.memory.release();
  }
}

// ---- numbers and charts -----------------------------------------------------------------------------------------------

const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"]];

// The factor and the unit with a readable prefix for values up to a size.
function scaleFor(values, unit) {
  const largest = values.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
  const [size, prefix] = PREFIXES.find(([size]) => largest >= size) ?? (largest ? PREFIXES.at(-1) : [1, ""]);
  return unit === "s" ? [1, unit] : [1 / size, prefix + unit];
}
function quantity(value, unit) {
  const [factor, scaled] = scaleFor([value], unit);
  return `${Number((value * factor).toPrecision(4))} ${scaled}`.replace("-", "\u2212").replace(/ /g, "\u00a0");
}

function svgNode(parent, name, attributes, text = "") {
  const node = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.textContent = text;
  parent.append(node);
  return node;
}

function ticksBetween(low, high) {
  const rough = (high - low) / 5, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough);
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, k) => (first + k) * step);
}

const CHART = { width: 420, height: 300, margins: { left: 62, right: 12, top: 10, bottom: 42 } };

// Draw lines [{x, y, kind}] and marks [{x, y, kind, label, id}] into an SVG; axes are {label, unit}.
function drawChart(svg, axes, lines, marks = [], equal = false) {
  const { width, height, margins: { left, right, top, bottom } } = CHART;
  svg.replaceChildren();
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const scales = ["x", "y"].map((axis, at) => {
    let low = Infinity, high = -Infinity;
    for (const values of [...lines.map((line) => line[axis]), marks.map((mark) => mark[axis])]) {
      for (const value of values) (low = Math.min(low, value)), (high = Math.max(high, value));
    }
    if (!(low <= high)) [low, high] = [0, 1];
    const margin = (high - low || Math.abs(high) || 1) * 0.05;
    return { low: low - margin, high: high + margin, readable: scaleFor([low, high], axes[at].unit) };
  });
  const pixels = [(width - left - right) / (scales[0].high - scales[0].low), (height - top - bottom) / (scales[1].high - scales[1].low)];
  if (equal) pixels.fill(Math.min(...pixels));
  const place = [(x) => left + (x - scales[0].low) * pixels[0], (y) => height - bottom - (y - scales[1].low) * pixels[1]];
  const write = (value) => String(Number(value.toPrecision(6))).replace("-", "\u2212");
  scales.forEach(({ low, high, readable: [factor, unit] }, at) => {
    const end = equal ? low + (at ? height - top - bottom : width - left - right) / pixels[at] : high;
    for (const tick of ticksBetween(low * factor, end * factor)) {
      const here = place[at](tick / factor);
      svgNode(svg, "line", at ? { x1: left, x2: width - right, y1: here, y2: here, class: "grid" }
        : { x1: here, x2: here, y1: top, y2: height - bottom, class: "grid" });
      svgNode(svg, "text", at ? { x: left - 6, y: here + 4, "text-anchor": "end" }
        : { x: here, y: height - bottom + 16, "text-anchor": "middle" }, write(tick));
    }
    const label = `${axes[at].label} (${unit})`.replace(" ()", "");
    svgNode(svg, "text", at ? { transform: `translate(14 ${(top + height - bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }
      : { x: (left + width - right) / 2, y: height - 6, "text-anchor": "middle" }, label);
  });
  for (const { x, y, kind } of lines) {
    const points = Array.from(x, (value, at) => `${place[0](value).toFixed(1)} ${place[1](y[at]).toFixed(1)}`);
    if (points.length) svgNode(svg, "path", { d: `M${points.join("L")}`, class: `line ${kind}` });
  }
  for (const { x, y, kind, label, id } of marks) {
    const mark = svgNode(svg, "circle", { cx: place[0](x).toFixed(1), cy: place[1](y).toFixed(1), r: kind.includes("chosen") ? 7 : kind === "state0" ? 3 : 4.5, class: `mark ${kind}` });
    if (label) svgNode(mark, "title", {}, label);
    if (id !== undefined) mark.dataset.asperity = id;
  }
}

// ---- the explorer of a report --------------------------------------------------------------------------------------------

const TYPES = { f8: Float64Array, f4: Float32Array, i8: BigInt64Array, u1: Uint8Array };

class Explorer {
  static async open(root) {
    const explorer = new Explorer();
    explorer.root = root;
    root.explorer = explorer;
    try {
      explorer.library = await loadLibrary(document.getElementById("library").textContent);
      const setup = JSON.parse(document.getElementById("setup").textContent);
      const bytes = await unpack(document.getElementById("arrays").textContent);
      for (const [name, [type, start, count]] of Object.entries(setup.arrays)) {
        setup[name] = new TYPES[type](bytes.buffer, start, count);
      }
      explorer.setup = setup;
      await explorer.#start();
    } catch (error) {
      // an old browser, for one
      explorer.part("shown").textContent = `This browser cannot compute the contact: ${error.message}`;
      throw error;
    }
    return explorer;
  }

  part(name) {
    return this.root.querySelector(`[data-part=${name}]`);
  }

  async #start() {
    const { setup } = this;
    this.factors = { friction: 1, modulus: 1 };
    this.row = setup.first_shown;
    this.axis = 0;
    const listen = (name, event, act) => this.part(name)?.addEventListener(event, (change) => act(change.target.value));
    listen("time", "input", (value) => {
      this.row = Number(value);
      // at most once a frame
      this.frame ??= requestAnimationFrame(() => ((this.frame = undefined), this.show()));
    });
    listen("asperity", "change", (value) => {
      const index = setup.labels.indexOf(Number(value));
      if (index >= 0) this.choose(index);
      else this.part("asperity").value = setup.labels[this.index];
    });
    listen("direction", "input", (value) => ((this.axis = Number(value)), this.show()));
    for (const name of ["friction", "modulus"]) {
      listen(name, "input", (value) => ((this.factors[name] = 2 ** Number(value)), this.compute()));
    }
    this.part("reset").addEventListener("click", () => {
      for (const name of ["friction", "modulus"]) (this.factors[name] = 1), (this.part(name).value = 0);
      this.compute();
    });
    this.part("map").addEventListener("click", ({ target }) => {
      if (target.dataset.asperity !== undefined) this.choose(Number(target.dataset.asperity));
    });
    await this.compute();
    const { normal } = this.model.read(this.row, 0);
    await this.choose(setup.drawn.reduce((best, index) => (normal[index] > normal[best] ? index : best), setup.drawn[0]));
    this.check();
    this.root.dataset.ready = "yes";
  }

  // Replay with the present factors; a change in the meantime begins again.
  async compute() {
    const turn = (this.turn = (this.turn ?? 0) + 1);
    const pause = () => new Promise((resume) => setTimeout(resume));
    await (this.busy = (this.busy ?? Promise.resolve()).then(async () => {
      if (turn !== this.turn) return;
      const model = await new Model(this.library, this.setup, this.factors).replay({ pause });
      const own = this.index === undefined ? null : await model.asperity(this.index, pause);
      this.model?.free();
      // together: what is drawn in between has rows of one model
      [this.model, this.own] = [model, own];
    }));
    if (turn === this.turn) this.show();
  }

  async choose(index) {
    const pause = () => new Promise((resume) => setTimeout(resume));
    await (this.busy = this.busy.then(async () => {
      const own = await this.model.asperity(index, pause);
      [this.index, this.own] = [index, own];
    }));
    this.show();
  }

  // State in words whether the page computes what was recorded.
  check() {
    const computed = this.model.total("tangential_load", 0), recorded = this.recorded("load", 0);
    const largest = recorded.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
    this.difference = computed.reduce((most, value, row) => Math.max(most, Math.abs(value - recorded[row])), 0) / (largest || 1);
    this.part("check").textContent = this.difference < 1e-5 && computed.length === recorded.length
      ? "The page computes every number above; the loop agrees with the recorded one."
      : `The loop computed in this page differs from the recorded one by ${(100 * this.difference).toPrecision(2)} % of the largest load.`;
  }

  recorded(name, axis) {
    const values = this.setup[`recorded_${name}`], width = this.setup.directions;
    return Array.from({ length: this.setup.rows }, (_, row) => values[row * width + axis]);
  }

  show() {
    const { setup, model, axis } = this;
    if (this.index === undefined) return;
    const row = (this.shown = Math.min(this.row, model.known - 1)), index = this.index;
    const changed = this.factors.friction !== 1 || this.factors.modulus !== 1;
    const letter = setup.directions === 2 ? ["x", "y"][axis] : "";
    const [u, t, n] = [model.total("displacement", axis), model.total("tangential_load", axis), model.total("normal_load")];
    for (const name of ["friction", "modulus"]) {
      const value = name === "friction" ? setup.friction[index] * this.factors.friction : model.modulus;
      const text = name === "friction" ? `μ = ${Number(value.toPrecision(4))}` : `E* = ${quantity(value, "Pa")}`;
      this.part(`${name}_value`).textContent = text;
      this.part(name).setAttribute("aria-valuetext", text);
    }
    this.part("time").value = this.row;
    this.part("asperity").value = setup.labels[index];
    const loop = [{ x: this.recorded("displacement", axis), y: this.recorded("load", axis), kind: "recorded" }];
    if (changed) loop.push({ x: u, y: t, kind: "computed" });
    const axes = [{ label: `U${letter}`, unit: "m" }, { label: `T${letter}`, unit: "N" }];
    const reached = row >= 0;
    drawChart(this.part("loop"), axes, loop, reached ? [{ x: u[row], y: t[row], kind: "now" }] : []);
    const refused = model.refusal
      ? ` With these values friction holds ${quantity(model.refusal.limit, "N")} where the loads ask for ${quantity(model.refusal.request, "N")}: the replay ends at ${quantity(setup.time[model.known] ?? setup.time.at(-1), "s")}.`
      : "";
    this.part("refused").textContent = refused;
    if (!reached) return;

    const text = `t = ${quantity(setup.time[row], "s")}, step ${row}`;
    this.part("time").setAttribute("aria-valuetext", text);
    this.part("shown").textContent =
      `${text}: N = ${quantity(n[row], "N")}, T${letter} = ${quantity(t[row], "N")}, U${letter} = ${quantity(u[row], "m")}`;
    const cells = (this.cells = model.read(row, index));
    const [x, y] = setup.x ? [setup.x, setup.y] : [setup.height, setup.radius];
    const names = setup.x ? ["x", "y"] : ["summit height", "summit radius"];
    const marks = Array.from(setup.drawn, (at) => ({
      x: x[at], y: y[at], id: at,
      kind: `state${cells.slip[at]}${at === index ? " chosen" : ""}`,
      label: `asperity ${setup.labels[at]}, ${STATES[cells.slip[at]]}`,
    }));
    // separated ones are drawn below the others, the chosen one above
    const level = ({ id }) => (id === index ? 4 : cells.slip[id]);
    marks.sort((a, b) => level(a) - level(b));
    drawChart(this.part("map"), names.map((label) => ({ label, unit: "m" })), [], marks, Boolean(setup.x));

    const time = setup.time.slice(0, model.known), load = this.own.tangential[axis];
    const limit = this.own.normal.map((value) => value * model.friction[index]);
    const history = [
      { x: time, y: limit, kind: "limit" }, { x: time, y: limit.map((value) => -value), kind: "limit" },
      { x: time, y: load, kind: "computed" },
    ];
    drawChart(this.part("history"), [{ label: "time", unit: "s" }, { label: `T${letter} of the asperity`, unit: "N" }], history,
      [{ x: time[row], y: load[row], kind: "now" }]);
    const reach = 1.05 * Math.max(cells.radius[index], 1e-3 * Math.sqrt(setup.radius[index] * 1e-9));
    const distance = Float64Array.from({ length: 241 }, (_, k) => (reach * k) / 240);
    this.profile = { distance, ...model.traction(cells, index, distance, axis) };
    drawChart(this.part("traction"), [{ label: "distance from the middle", unit: "m" }, { label: `traction${letter && ` in ${letter}`}`, unit: "Pa" }], [
      { x: distance, y: this.profile.limit, kind: "limit" },
      { x: distance, y: this.profile.limit.map((value) => -value), kind: "limit" },
      { x: distance, y: this.profile.traction, kind: "computed" },
    ]);
    const stick = cells.slip[index] ? `, c/a = ${Number((cells.stick[index] / cells.radius[index]).toPrecision(3))}` : "";
    this.part("clicked").textContent =
      `asperity ${setup.labels[index]}, ${STATES[cells.slip[index]]}: N = ${quantity(cells.normal[index], "N")}, ` +
      `T${letter} = ${quantity(cells.tangential[index * setup.directions + axis], "N")}${stick}`;
  }
}
