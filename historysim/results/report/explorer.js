// What a report does when another time or asperity is chosen; names in snake_case come from explorer.py.
const row = steps.data, cell = cells.data, place = map.data;
const now = clock.data.now[0], moments = row.time.length;
const text = (value) => Number(value).toPrecision(4);
// no line ends between them, nor in a minus
const quantity = (name, value, unit) => `${name} = ${text(value)} ${unit}`.replace("-", "\u2212").replace(/ /g, "\u00a0");

marker.data = { x: [row.displacement[now]], y: [row.load[now]] };
const fill = [];
for (let i = 0; i < count; i++) fill.push(colours[cell.state[now * count + i]]);
map.data = { ...place, fill };
const part = (name) => document.getElementById(`${target}-${name}`);
part("time").value = now;
part("time").setAttribute("aria-valuetext", `t = ${text(row.time[now])} s, step ${row.step[now]}`);
part("shown").innerHTML =
  `<b>step ${row.step[now]}</b>, ${quantity("t", row.time[now], "s")}: ${quantity("N", row.normal[now], units.normal)}, ` +
  `${quantity("T", row.load[now], units.force)}, ${quantity("U", row.displacement[now], units.length)}`;

if (map.selected.indices.length > 0) {
  const i = map.selected.indices[0];
  part("asperity").value = i;
  const time = [], load = [], limit = [], below = [];
  for (let k = 0; k < moments; k++) {
    const at = k * count + i;
    time.push(row.time[k]);
    load.push(cell.tangential[at]);
    limit.push(cell.limit[at]);
    below.push(-cell.limit[at]);
  }
  curve.data = { time, load, limit, below };
  moment.data = { x: [time[now]], y: [load[now]] };
  const at = now * count + i;
  const share = cell.state[at] > 0 ? `, ${quantity("c/a", cell.stick_ratio[at], "")}` : "";
  part("clicked").innerHTML =
    `<b>asperity ${place.asperity[i]}</b>, ${names[cell.state[at]]}: ${quantity("N", cell.normal[at], units.own)}, ` +
    `${quantity("T", cell.tangential[at], units.own)}${share}`;

  // Σ Δm p(r; c): Hertz pressures of the radii of the vertices, each with the weight of its vertex
  const radius = [], traction = [], above = [], under = [];
  if (ends.data.end.length > 0) {
    const height = place.height[i], curvature = place.radius[i];
    const list = place.group[i] * moments + now;
    const first = list > 0 ? ends.data.end[list - 1] : 0, last = ends.data.end[list];
    const peak = (2 * modulus) / (Math.PI * curvature);
    const pressure = (r, separation) => {
      const square = curvature * (height - separation) - r * r;
      return square > 0 ? peak * Math.sqrt(square) : 0;
    };
    for (let k = 0; k < points; k++) {
      const r = (1.02 * place.reach[i] * k) / (points - 1);
      let sum = 0;
      for (let j = first; j < last; j++) {
        sum += vertices.data.weight[j] * pressure(r, vertices.data.separation[j]);
      }
      const most = place.friction[i] * pressure(r, row.separation[now]);
      radius.push(r * scales.radius);
      traction.push(sum * scales.stress);
      above.push(most * scales.stress);
      under.push(-most * scales.stress);
    }
  }
  profile.data = { radius, traction, limit: above, below: under };
}
