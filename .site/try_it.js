// Try it: a contact, a load path that is drawn or dropped as CSV, and its loop and traction, computed in the page.
"use strict";

const FACTORS = {
  time: { s: 1, ms: 1e-3, min: 60, h: 3600 },
  force: { N: 1, kN: 1e3, mN: 1e-3, "µN": 1e-6, uN: 1e-6, nN: 1e-9 },
  length: { m: 1, mm: 1e-3, "µm": 1e-6, um: 1e-6, nm: 1e-9, pm: 1e-12 },
};
// Columns of a file by their names in English and German; a single letter counts by its case.
const COLUMNS = [
  { name: "time", size: "time", pattern: /^(t|time|zeit)$/, text: "time" },
  { name: "normal_load", size: "force", pattern: /^(N|F_?[nN]|normal_?(load|force)|normal(kraft|last))$/, text: "normal load" },
  { name: "normal_displacement", size: "length", pattern: /^(d|δ|approach|normal_?displacement|annäherung)$/, text: "approach" },
  { name: "tangential_load", size: "force", pattern: /^(T|F_?[tT]|tangential_?(load|force)|friction_?force|(tangential|reib|reibungs)kraft)$/, text: "tangential load" },
  { name: "tangential_displacement", size: "length", pattern: /^(U|u|tangential_?displacement|displacement|verschiebung|weg)$/, text: "tangential displacement" },
];
const MOST_ROWS = 20_000;

// Read a load path {time, normal, tangential} in SI from the text of a CSV file; an Error with one sentence if it has none.
function readPath(text) {
  const lines = text.replace(/^\uFEFF/, "").split(/\r\n|\n|\r/).map((line, at) => ({ line: line.trim(), number: at + 1 }))
    .filter(({ line }) => line && !line.startsWith("#"));
  if (!lines.length) throw new Error("The file is empty; expected a table with columns of time, N or approach, U or T.");
  if (/[\0-\x08]/.test(text)) throw new Error("The file is not text; expected a table in CSV.");
  const delimiter = [";", "\t", ","].find((mark) => lines[0].line.includes(mark)) ?? /\s+/;
  const cells = (line) => line.split(delimiter).map((cell) => cell.trim().replace(/^"(.*)"$/, "$1"));
  const names = cells(lines[0].line);
  if (names.every((name) => Number.isFinite(readNumber(name, delimiter)))) {
    throw new Error("The first line has numbers; expected the names of the columns, such as time (s), N (mN), U (nm).");
  }
  const found = {};
  names.forEach((title, column) => {
    const kindOf = (name) =>
      COLUMNS.find(({ pattern }) => pattern.test(name) || (name.length > 1 && pattern.test(name.toLowerCase())));
    let [, name, unit] = /^(.*?)\s*(?:[[(]\s*(.*?)\s*[\])])?$/u.exec(title), kind = kindOf(name);
    if (!kind) [, name, unit] = /^(.*)_(\w+|µ\w)$/u.exec(name) ?? [title, title, ""];
    kind ??= kindOf(name);
    if (!kind) return;
    const factors = FACTORS[kind.size], factor = unit ? factors[unit.replace("μ", "µ")] : 1;
    if (!factor) throw new Error(`Column ${title} has the unit ${unit}; expected one of ${Object.keys(factors).join(", ")}.`);
    found[kind.name] ??= { column, factor, title };
  });
  const demand = (choices, example) => {
    const name = choices.find((choice) => found[choice]);
    if (name) return name;
    const texts = choices.map((choice) => COLUMNS.find((kind) => kind.name === choice).text);
    throw new Error(`No column holds the ${texts.join(" or the ")}; expected one, such as ${example}.`);
  };
  const chosen = [
    demand(["time"], "time (s)"), demand(["normal_load", "normal_displacement"], "N (mN)"),
    demand(["tangential_displacement", "tangential_load"], "U (nm)"),
  ];
  if (lines.length < 2) throw new Error("The file has no rows below the names of its columns.");
  if (lines.length - 1 > MOST_ROWS) {
    throw new Error(`The file has ${lines.length - 1} rows; expected ${MOST_ROWS} at most: leave some out, or use historysim run.`);
  }
  const values = chosen.map(() => []);
  for (const { line, number } of lines.slice(1)) {
    const row = cells(line);
    chosen.forEach((name, at) => {
      const { column, factor, title } = found[name], value = readNumber(row[column] ?? "", delimiter);
      if (!Number.isFinite(value)) throw new Error(`Line ${number}: "${row[column] ?? ""}" in column ${title} is not a number.`);
      values[at].push(value * factor);
    });
    const [time, normal] = values.map((column) => column.at(-1));
    if (values[0].length > 1 && time < values[0].at(-2)) {
      throw new Error(`Line ${number}: the time ${time} s comes after ${values[0].at(-2)} s; expected ascending times.`);
    }
    if (chosen[1] === "normal_load" && normal < 0) {
      throw new Error(`Line ${number}: the normal load is ${quantity(normal, "N")}; expected 0 or more.`);
    }
  }
  return { time: values[0], names: chosen.slice(1), normal: values[1], tangential: values[2] };
}

// A number with a decimal point, or a decimal comma where commas do not delimit columns; NaN if it is not one.
function readNumber(text, delimiter) {
  const german = delimiter !== "," && text.includes(",");
  const plain = german ? text.replace(/\.(?=\d{3}(\D|$))/g, "").replace(",", ".") : text;
  return /^[+\-\u2212]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain) ? Number(plain.replace("\u2212", "-")) : NaN;
}

// Gaussian heights of a seed.
function drawHeights(count, deviation, seed) {
  let state = seed >>> 0;
  const uniform = () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let mixed = Math.imul(state ^ (state >>> 15), state | 1);
    mixed ^= mixed + Math.imul(mixed ^ (mixed >>> 7), mixed | 61);
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  };
  return Float64Array.from({ length: count }, () =>
    deviation * Math.sqrt(-2 * Math.log(1 - uniform())) * Math.cos(2 * Math.PI * uniform()));
}

class Trial {
  static async open(root) {
    const trial = new Trial();
    root.trial = trial;
    trial.root = root;
    try {
      trial.library = await loadLibrary(document.getElementById("library").textContent);
    } catch (error) {
      trial.say(`This browser cannot compute the contact: ${error.message}`);
      throw error;
    }
    trial.listen();
    trial.example();
    root.dataset.ready = "yes";
  }

  part(name) {
    return this.root.querySelector(`[data-part=${name}]`);
  }
  say(text) {
    this.part("message").textContent = text;
  }
  field(name) {
    const input = this.part(name), value = input.valueAsNumber;
    if (!input.checkValidity() || !Number.isFinite(value)) {
      throw new Error(`${input.labels[0].textContent}: "${input.value}"; expected a number from ${input.min}${input.max && ` to ${input.max}`}.`);
    }
    return value * Number(input.dataset.factor ?? 1);
  }

  listen() {
    for (const input of this.root.querySelectorAll("input[type=number], select")) {
      input.addEventListener("input", () => this.schedule());
    }
    this.part("time").addEventListener("input", () => this.show());
    this.part("clear").addEventListener("click", () => ((this.path = this.begin()), this.schedule()));
    this.part("example").addEventListener("click", () => this.example());
    this.part("download").addEventListener("click", () => this.download());
    this.part("file").addEventListener("change", ({ target }) => target.files[0] && this.read(target.files[0]));
    for (const name of ["dragover", "drop"]) {
      document.addEventListener(name, (event) => {
        event.preventDefault();
        if (name === "drop" && event.dataTransfer.files[0]) this.read(event.dataTransfer.files[0]);
      });
    }
    const plane = this.part("plane");
    plane.addEventListener("pointerdown", (event) => {
      plane.setPointerCapture(event.pointerId);
      this.path = this.begin();
      this.point(event);
    });
    plane.addEventListener("pointermove", (event) => event.buttons && this.point(event));
    plane.addEventListener("keydown", (event) => {
      const [x, y] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key] ?? [];
      if (x === undefined) return;
      event.preventDefault();
      if (!this.drawn) this.path = this.begin();
      const { tangential, normal } = this.path, [most, side] = [this.field("most_load"), this.field("most_displacement")];
      this.add((tangential.at(-1) ?? 0) + (x * side) / 10, (normal.at(-1) ?? 0) + (y * most) / 10);
    });
  }

  begin() {
    this.drawn = true;
    return { time: [], names: ["normal_load", "tangential_displacement"], normal: [], tangential: [] };
  }
  // The point of the plane under the pointer: the plane is drawn as charts are, over its whole ranges.
  point({ clientX, clientY }) {
    const matrix = this.part("plane").getScreenCTM().inverse(), at = new DOMPoint(clientX, clientY).matrixTransform(matrix);
    const [most, side] = [this.field("most_load"), this.field("most_displacement")];
    const [{ left, right, top, bottom }, { width, height }] = [CHART.margins, CHART];
    const u = (((at.x - left) / (width - left - right)) * 2.2 - 1.1) * side;
    const n = ((height - bottom - at.y) / (height - top - bottom)) * 1.1 * most - 0.05 * most;
    this.add(u, n);
  }
  add(tangential, normal) {
    const [most, side] = [this.field("most_load"), this.field("most_displacement")];
    const clamp = (value, low, high) => Number(Math.min(Math.max(value, low), high).toPrecision(6));
    this.path.time.push(Number((this.path.time.length * 0.1).toFixed(6)));
    this.path.tangential.push(clamp(tangential, -side, side));
    this.path.normal.push(clamp(normal, 0, most));
    this.schedule();
  }

  example() {
    this.path = this.begin();
    const [most, side] = [this.field("most_load"), this.field("most_displacement")];
    for (let step = 0; step <= 120; step++) {
      const turn = step / 40;
      this.path.time.push(Number((step * 0.1).toFixed(6)));
      this.path.normal.push(most * (0.6 - 0.25 * Math.cos(Math.PI * turn)));
      const swing = 0.6 * Math.min(1, 0.4 + 0.3 * turn) * Math.sin(2 * Math.PI * turn);
      this.path.tangential.push(side * Number(swing.toFixed(6)));
    }
    this.schedule();
  }

  async read(file) {
    try {
      const bytes = await file.arrayBuffer();
      let text;
      try {
        text = new TextDecoder("utf-8", { fatal: true }).decode(bytes);
      } catch {
        text = new TextDecoder("windows-1252").decode(bytes);
      }
      this.path = readPath(text);
      this.drawn = false;
      this.schedule();
    } catch (error) {
      this.say(`${file.name}: ${error.message}`);
    }
    this.part("file").value = "";
  }

  schedule() {
    this.frame ??= requestAnimationFrame(() => {
      this.frame = undefined;
      this.compute();
    });
  }

  // The contact of the fields.
  contact() {
    const ball = this.part("kind").value === "ball";
    for (const name of ["count", "deviation", "seed"]) this.part(name).closest(".control").hidden = ball;
    const count = ball ? 1 : this.field("count");
    return {
      height: ball ? new Float64Array(1) : drawHeights(count, this.field("deviation"), this.field("seed")),
      radius: new Float64Array(count).fill(this.field("radius")),
      friction: new Float64Array(count).fill(this.field("friction")),
      modulus: this.field("modulus"),
      shear: this.field("shear"),
    };
  }

  async compute() {
    const turn = (this.turn = (this.turn ?? 0) + 1);
    try {
      const contact = this.contact(), { time, names, normal, tangential } = this.path;
      const paths = new Uint8Array(PATH_SIZE * time.length);
      const controls = names.map((name) => (name.endsWith("displacement") ? DISPLACED : LOAD));
      time.forEach((_, row) => writePath(paths, row, row,
        { control: controls[0], target: normal[row] }, { control: controls[1], target: tangential[row] }));
      const setup = {
        ...contact, ratio: contact.modulus / (4 * contact.shear), directions: 1, drive: [1e-6, 0, 0, 0], paths, rows: time.length,
      };
      const model = await new Model(this.library, setup).replay();
      if (turn !== this.turn) return model.free();
      this.model?.free();
      this.model = model;
      this.highest = contact.height.indexOf(Math.max(...contact.height));
      this.part("time").max = Math.max(model.known - 1, 0);
      this.part("time").value = this.part("time").max;
      const refusal = model.refusal;
      this.say(!refusal ? "" : `At t = ${time[refusal.path]} s the tangential load is ${quantity(refusal.request, "N")}, more than ` +
        `the friction limit of ${quantity(refusal.limit, "N")}; expected less tangential load, or more friction. The path ends there.`);
      this.show();
    } catch (error) {
      this.say(error.message);
    }
  }

  show() {
    const { model, path, highest } = this, row = Math.min(Number(this.part("time").value), model.known - 1);
    const [most, side] = [this.field("most_load"), this.field("most_displacement")];
    const [u, t, n] = ["displacement", "tangential_load", "normal_load"].map((name) => model.total(name));
    const now = (x, y) => (row < 0 ? [] : [{ x: x[row], y: y[row], kind: "now" }]);
    // invisible corners keep the ranges of a plane that is drawn in
    const corners = this.drawn ? [{ x: [-side, side], y: [0, most], kind: "corner" }] : [];
    drawChart(this.part("plane"), [{ label: "U", unit: "m" }, { label: "N", unit: "N" }],
      [...corners, { x: u, y: n, kind: "computed" }], now(u, n));
    drawChart(this.part("loop"), [{ label: "U", unit: "m" }, { label: "T", unit: "N" }], [{ x: u, y: t, kind: "computed" }], now(u, t));
    const time = path.time.slice(0, model.known), limit = model.total("friction_limit");
    drawChart(this.part("loads"), [{ label: "time", unit: "s" }, { label: "T", unit: "N" }], [
      { x: time, y: limit, kind: "limit" }, { x: time, y: limit.map((value) => -value), kind: "limit" },
      { x: time, y: t, kind: "computed" },
    ], now(time, t));
    if (row < 0) return this.part("traction").replaceChildren();
    const cells = model.read(row, highest), reach = 1.05 * cells.radius[highest] || 1e-9;
    const distance = Float64Array.from({ length: 241 }, (_, k) => (reach * k) / 240);
    const profile = model.traction(cells, highest, distance);
    drawChart(this.part("traction"), [{ label: "distance from the middle", unit: "m" }, { label: "traction", unit: "Pa" }], [
      { x: distance, y: profile.limit, kind: "limit" }, { x: distance, y: profile.limit.map((value) => -value), kind: "limit" },
      { x: distance, y: profile.traction, kind: "computed" },
    ]);
    const touching = cells.slip.filter(Boolean).length;
    this.part("shown").textContent = `t = ${quantity(time[row], "s")}: N = ${quantity(n[row], "N")}, T = ${quantity(t[row], "N")}, ` +
      `U = ${quantity(u[row], "m")}, ${touching} of ${model.count} in contact, the highest in ${STATES[cells.slip[highest]]}`;
  }

  // The scenario that computes the same: hs.run("scenario.toml").
  scenario() {
    const contact = this.contact(), { time, names, normal, tangential } = this.path;
    const waypoints = time.map((at, row) => `    { time = ${at}, ${names[0]} = ${normal[row]}, ${names[1]} = ${tangential[row]} },`);
    const surface = contact.height.length === 1 ? [`kind = "sphere"`, `radius = ${contact.radius[0]}`]
      : [`kind = "summits"`, `height = [${contact.height.join(", ")}]`, `radius = ${contact.radius[0]}`];
    return [
      `title = "A contact from the page Try it"`, "", "[materials]", `contact_modulus = ${contact.modulus}`,
      `shear_modulus = ${contact.shear}`, "", "[surface]", ...surface, "", "[friction]", `coefficient = ${contact.friction[0]}`, "",
      "[loading]", "waypoints = [", ...waypoints, "]", "",
    ].join("\n");
  }
  download() {
    try {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([this.scenario()], { type: "application/toml" }));
      link.download = "scenario.toml";
      link.click();
    } catch (error) {
      this.say(error.message);
    }
  }
}
