// Heights of two scans along a line that a reader moves: data.scans as surfaces/line.py tells it, lengths in mm.
"use strict";
(() => {
  const told = JSON.parse(document.getElementById("data").textContent).scans;
  const {viridis, diverging, unpack, short, plane} = stage, ink = pictures.ink;
  const at = (name) => document.getElementById(name);
  const x = unpack(told.x), y = unpack(told.y), n = x.length, m = y.length;
  const before = unpack(told.before), depth = unpack(told.depth), after = before.map((v, k) => v - depth[k]);
  const maps = {depth: [depth, "worn depth", diverging], before: [before, "heights before", viridis], after: [after, "heights after", viridis]};
  const middle = [(x[0] + x[n - 1]) / 2, (y[0] + y[m - 1]) / 2], half = [(x[n - 1] - x[0]) / 2, (y[m - 1] - y[0]) / 2];
  const state = {line: [], held: null};
  const finite = (values) => values.filter((v) => Number.isFinite(v));

  const nearest = (axis) => {                    // index of the place of an axis that lies nearest
    const borders = Array.from(axis.slice(1), (v, k) => (v + axis[k]) / 2);
    return (v) => {
      let low = 0, high = borders.length;
      while (low < high) { const k = (low + high) >> 1; if (borders[k] < v) low = k + 1; else high = k; }
      return low;
    };
  };
  const column = nearest(x), row = nearest(y);

  function across(px, py, turn) {                // part of the line through a place that lies on the scan
    const way = [Math.cos(turn), Math.sin(turn)], ends = [-Infinity, Infinity];
    [px, py].forEach((p, k) => {
      if (Math.abs(way[k]) < 1e-12) return;
      const [a, b] = [-1, 1].map((side) => (middle[k] + side * half[k] - p) / way[k]).sort((a, b) => a - b);
      ends[0] = Math.max(ends[0], a); ends[1] = Math.min(ends[1], b);
    });
    return ends[0] < ends[1] ? ends.flatMap((s) => [px + s * way[0], py + s * way[1]]) : null;
  }
  const turn = () => at("cut-angle").value * Math.PI / 180;
  const reach = (t) => Math.abs(half[0] * Math.sin(t)) + Math.abs(half[1] * Math.cos(t));
  function slid() {                              // the line that both sliders tell
    const t = turn(), off = 0.999 * at("cut-place").value * reach(t);
    state.line = across(middle[0] - off * Math.sin(t), middle[1] + off * Math.cos(t), t) ?? state.line;
    show();
  }
  function placed(px, py) {                      // the sliders where a line through a place stands
    const t = turn(), off = (py - middle[1]) * Math.cos(t) - (px - middle[0]) * Math.sin(t);
    at("cut-place").value = Math.max(-1, Math.min(1, off / (0.999 * reach(t))));
  }

  function drawMap() {
    const [values, name, palette] = maps[at("cut-map").value], sizes = finite(Array.from(values));
    const order = (palette === diverging ? sizes.map(Math.abs) : sizes).sort((a, b) => a - b);
    const top = order[Math.floor(0.998 * (order.length - 1))] || 1;
    const low = palette === diverging ? -top : order[Math.ceil(0.002 * (order.length - 1))];
    const window_ = [middle[0] - half[0], middle[0] + half[0], middle[1] - half[1], middle[1] + half[1]];
    const on = state.map = plane(at("stage-map"), window_, innerWidth < 600 ? 300 : 400, true, 58), {pen, box} = on;
    const dense = devicePixelRatio || 1, left = Math.round(on.x(window_[0]) * dense), up = Math.round(on.y(window_[3]) * dense);
    const wide = Math.max(1, Math.round(on.x(window_[1]) * dense) - left), tall = Math.max(1, Math.round(on.y(window_[2]) * dense) - up);
    const image = pen.createImageData(wide, tall), inks = palette.map((one) => one.startsWith("#") ?
      [1, 3, 5].map((k) => parseInt(one.slice(k, k + 2), 16)) : one.match(/\d+(\.\d+)?/g).map(Number));
    const columns = Array.from({length: wide}, (_, k) => column(on.back((left + k + 0.5) / dense, 0)[0]));
    for (let j = 0; j < tall; j++) {
      const base = n * row(on.back(0, (up + j + 0.5) / dense)[1]);
      for (let k = 0; k < wide; k++) {
        const v = values[base + columns[k]];
        if (!Number.isFinite(v)) continue;
        const tone = inks[Math.max(0, Math.min(255, Math.floor(256 * (v - low) / (top - low))))];
        image.data.set([tone[0], tone[1], tone[2], 255], 4 * (j * wide + k));
      }
    }
    pen.putImageData(image, left, up);
    const [a, b, c, d] = state.line;
    on.inside(() => {
      for (const [colour, width] of [["#fff", 4], ["#000", 1.6]]) {
        Object.assign(pen, {strokeStyle: colour, fillStyle: colour, lineWidth: width});
        pen.beginPath(); pen.moveTo(on.x(a), on.y(b)); pen.lineTo(on.x(c), on.y(d)); pen.stroke();
        pen.beginPath(); pen.arc(on.x(a), on.y(b), 2 + width, 0, 7); pen.fill();
      }
    });
    on.axes(name, "x [mm]", "y [mm]");
    on.scale(palette, low, top, told.unit, true);
  }

  function read() {                              // places along the line [mm] and heights there
    const [a, b, c, d] = state.line, length = Math.hypot(c - a, d - b), out = {s: [], before: [], after: [], depth: []};
    const count = Math.max(2, Math.ceil(2 * Math.max(Math.abs(c - a) / (2 * half[0]) * n, Math.abs(d - b) / (2 * half[1]) * m)));
    let last = -1;
    for (let k = 0; k < count; k++) {
      const share = k / (count - 1), cell = n * row(b + share * (d - b)) + column(a + share * (c - a));
      if (cell === last) continue;
      last = cell;
      out.s.push(share * length); out.before.push(before[cell]); out.after.push(after[cell]); out.depth.push(depth[cell]);
    }
    return {...out, length};
  }

  function drawCut() {
    const found = read(), known = finite([...found.before, ...found.after]);
    let low = Math.min(...known), high = Math.max(...known);
    if (!known.length) [low, high] = [-1, 1];
    const room = 0.06 * (high - low) || 1;
    const on = plane(at("stage-cut"), [0, found.length, low - room, high + room], innerWidth < 600 ? 280 : 400, false), {pen} = on;
    const line = (values, colour, width) => {
      Object.assign(pen, {strokeStyle: colour, lineWidth: width}); pen.beginPath();
      let open = true;
      values.forEach((v, k) => {
        if (!Number.isFinite(v)) { open = true; return; }
        if (open) pen.moveTo(on.x(found.s[k]), on.y(v)); else pen.lineTo(on.x(found.s[k]), on.y(v));
        open = false;
      });
      pen.stroke();
    };
    on.inside(() => { line(found.before, ink("--soft"), 1.4); line(found.after, ink("--accent"), 1.4); });
    on.axes("heights along the line (grey: before wear; blue: after wear)", "from the dot along the line [mm]", `height [${told.unit}]`);
    return found;
  }

  function show() {
    drawMap();
    const found = drawCut(), depths = finite(found.depth), [a, b, c, d] = state.line.map(short);
    const mean = depths.reduce((sum, v) => sum + v, 0) / depths.length;
    const deep = depths.length ? `depth ${short(mean)} ${told.unit} on average, from ${short(Math.min(...depths))} to ${short(Math.max(...depths))} ${told.unit}` : "no depth, because a height is missing everywhere";
    const less = found.depth.length - depths.length;
    at("stage-told").textContent = `Line from x ${a} mm, y ${b} mm to x ${c} mm, y ${d} mm: ${deep}${less && depths.length ? `; ${less} of ${found.depth.length} places have no depth` : ""}.`;
    at("cut-angle-told").textContent = `${at("cut-angle").value}°`;
    at("cut-place-told").textContent = `${short(at("cut-place").value * reach(turn()))} mm from the middle`;
    at("stage-map").setAttribute("aria-label", `Map of the ${maps[at("cut-map").value][1]} with the line. ${at("stage-told").textContent}`);
    at("stage-cut").setAttribute("aria-label", `Heights before and after along the line. ${at("stage-told").textContent}`);
  }

  const canvas = at("stage-map");
  canvas.style.touchAction = "none";
  const spot = (event) => {
    const found = state.map.back(event.offsetX, event.offsetY);
    return found.map((v, k) => Math.max(middle[k] - half[k], Math.min(middle[k] + half[k], v)));
  };
  canvas.addEventListener("pointerdown", (event) => { state.held = spot(event); canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointermove", (event) => {
    if (!state.held) return;
    const there = spot(event), far = Math.hypot(there[0] - state.held[0], there[1] - state.held[1]);
    if (far < 0.02 * Math.max(...half)) return;
    state.line = [...state.held, ...there];
    at("cut-angle").value = Math.round((Math.atan2(there[1] - state.held[1], there[0] - state.held[0]) * 180 / Math.PI + 360) % 180);
    placed(...there); show();
  });
  canvas.addEventListener("pointerup", (event) => {
    const there = spot(event), short_ = state.held && Math.hypot(there[0] - state.held[0], there[1] - state.held[1]) < 0.02 * Math.max(...half);
    state.held = null;
    if (short_) { placed(...there); slid(); }
  });

  at("cut-map").onchange = show;
  for (const name of ["place", "angle"]) at(`cut-${name}`).oninput = slid;
  at("cut").onsubmit = () => false;
  at("cut-angle").value = 0;
  placed(...told.first);
  slid();
  let width = innerWidth;
  addEventListener("resize", () => { if (innerWidth !== width) { width = innerWidth; show(); } });
  for (const event of ["beforeprint", "afterprint"]) addEventListener(event, show);
})();
