// Plays the pieces frame by frame: data.player as player.py tells it, lengths in mm.
"use strict";
(() => {
  const film = JSON.parse(document.getElementById("data").textContent).player;
  const {viridis, diverging, unpack, short, plane, edges} = stage, ink = pictures.ink;
  const at = (name) => document.getElementById(name), count = film.times.length;
  const LADDER = Array.from({length: 22}, (_, k) => [1, 2, 5][k % 3] * 10 ** Math.floor(k / 3));
  const VISIBLE = 0.05, SLIDE = 0.03;            // shares that the largest motion of the height, the slide of the length take
  const pieces = film.pieces.map((one) => {
    const cells = Array.from(unpack(one.cells), Math.round), coated = unpack(one.coated);
    return {points: unpack(one.points), cells, moves: unpack(one.moves), colours: one.colours.map(unpack),
      edges: edges(cells, coated)};
  });
  const x = unpack(film.x), status = film.status && unpack(film.status);
  const said = (values) => {                     // a number in words, zero where it is less than was rounded away
    const least = 2e-5 * values.reduce((most, v) => Math.max(most, Math.abs(v)), 0);
    return (v) => short(Math.abs(v) < least ? 0 : v);
  };
  const curves = film.curves.map((one) => { const values = unpack(one.values); return {...one, values, said: said(values)}; });
  const state = {frame: film.first, timer: 0, places: [], shown: {}};

  const factor = (share, largest) => {
    const best = share / Math.max(largest, 1e-300), found = LADDER.findLastIndex((one) => one <= best * (1 + 1e-9));
    return Math.max(found, 0);
  };
  const reach = (piece) => {                     // [left, right, bottom, top] of the points as meshed
    const out = [Infinity, -Infinity, Infinity, -Infinity];
    piece.points.forEach((v, k) => { const j = 2 * (k % 2); out[j] = Math.min(out[j], v); out[j + 1] = Math.max(out[j + 1], v); });
    return out;
  };
  const hull = (boxes) => [0, 1, 2, 3].map((k) => (k % 2 ? Math.max : Math.min)(...boxes.map((one) => one[k])));
  const whole = hull(pieces.map(reach));
  let narrow = false;
  const close = (() => {                         // around the contact of all frames, or its most pressed quarter
    const sigma = curves[0].values, n = x.length, touching = [...x].filter((_, k) => range(count).some((f) => sigma[f * n + k] > 0));
    const length = x[n - 1] - x[0], cell = length / n, top = sigma.reduce((best, v, k) => v > sigma[best] ? k : best, 0) % n;
    const wide = touching.length ? touching.at(-1) - touching[0] : length;
    narrow = touching.length > 0 && wide <= length / 4;
    const half = narrow ? Math.max(wide, 4 * cell) : length / 8;
    const middle = narrow ? (touching[0] + touching.at(-1)) / 2 : x[top];
    const left = Math.max(x[0], Math.min(middle - half, x[n - 1] - 2 * half)), right = Math.min(x[n - 1], left + 2 * half);
    return [left, right, -0.3 * (right - left), 0.3 * (right - left)];
  })();
  function range(size) { return Array.from({length: size}, (_, k) => k); }
  const window_ = () => at("play-view").value === "close" ? close : whole;

  function suited() {                            // factors that make motion and slide visible in the view
    const [left, right, bottom, top] = window_();
    let largest = 0;
    for (const {points, moves} of pieces) {
      for (let k = 1; k < moves.length; k += 2) {
        const p = k % points.length, px = points[p - 1], py = points[p];
        if (px >= left && px <= right && py >= bottom && py <= top) largest = Math.max(largest, Math.abs(moves[k]));
      }
    }
    at("play-gap").value = factor(VISIBLE * (top - bottom), largest);
    at("play-slide").value = factor(SLIDE * (right - left), Math.max(...film.slide.map(Math.abs)));
  }

  const factors = () => [LADDER[at("play-gap").value], LADDER[at("play-slide").value]];
  function placed(piece, number, frame) {        // places of the points of a piece in a frame, as drawn
    const {points, moves} = piece, [gap, slide] = factors(), size = points.length, out = new Float64Array(size);
    const aside = number === 1 ? slide * film.slide[frame] : 0;
    for (let k = 0; k < size; k++) out[k] = points[k] + gap * moves[frame * size + k] + (k % 2 ? 0 : aside);
    return out;
  }

  function colouring(number) {                   // palette and ends of a colour, the same in all frames
    const {signed, label, unit} = film.colours[number];
    const all = Float64Array.from(pieces.flatMap((one) => [...one.colours[number]]), Math.abs).sort();
    const largest = all.at(-1), most = all[Math.floor(0.998 * (all.length - 1))];
    const top = (most < 0.8 * largest ? most : largest) || 1;
    return {number, label, unit, said: said(all), palette: signed ? diverging : viridis, low: signed ? -top : 0, top, over: top < largest};
  }

  function drawPieces() {
    const small = innerWidth < 600, view = window_(), look = state.shown.look, {palette, low, top, number} = look;
    const everywhere = view === close ? view : hull(range(count).flatMap((f) => pieces.map((one, k) => reach({points: placed(one, k, f)})))).map((v, k, [l, r, b, t]) => v + [-1, 1][k % 2] * 0.02 * Math.max(r - l, t - b));
    const on = state.plane = plane(at("stage-pieces"), everywhere, small ? 320 : 400, true, 58), {pen} = on;
    state.places = pieces.map((one, k) => placed(one, k, state.frame));
    on.inside(() => {
      pieces.forEach((piece, k) => {
        const p = state.places[k], {cells} = piece, values = piece.colours[number], base = state.frame * cells.length / 4;
        for (let c = 0; c < cells.length / 4; c++) {
          const share = (values[base + c] - low) / (top - low);
          pen.fillStyle = pen.strokeStyle = palette[Math.max(0, Math.min(255, Math.floor(256 * share)))];
          pen.lineWidth = 1; pen.beginPath();
          for (let j = 0; j < 4; j++) { const a = cells[4 * c + j]; pen.lineTo(on.x(p[2 * a]), on.y(p[2 * a + 1])); }
          pen.closePath(); pen.fill(); pen.stroke();
        }
        pen.strokeStyle = ink("--ink"); pen.lineWidth = 0.9; pen.beginPath();
        for (const [a, b] of piece.edges) { pen.moveTo(on.x(p[2 * a]), on.y(p[2 * a + 1])); pen.lineTo(on.x(p[2 * b]), on.y(p[2 * b + 1])); }
        pen.stroke();
      });
    });
    on.axes(look.label, "x [mm]", "y [mm]");
    on.scale(palette, low, top, look.unit, look.over);
  }

  function drawCurve() {
    const curve = state.shown.curve, {values} = curve, n = x.length, view = window_(), [left, right] = view === close ? view : [x[0], x[n - 1]];
    let low = Math.min(0, ...values), high = Math.max(0, ...values);
    const room = 0.06 * (high - low) || 1;
    [low, high] = [low < 0 ? low - room : low - room / 3, high + room];
    const on = state.chart = plane(at("stage-curve"), [left, right, low, high], innerWidth < 600 ? 280 : 400, false), {pen, box} = on;
    const line = (frame, colour, width, alpha) => {
      Object.assign(pen, {strokeStyle: colour, lineWidth: width, globalAlpha: alpha}); pen.beginPath();
      for (let k = 0; k < n; k++) pen.lineTo(on.x(x[k]), on.y(values[frame * n + k]));
      pen.stroke(); pen.globalAlpha = 1;
    };
    on.inside(() => {
      pen.fillStyle = ink("--line"); pen.fillRect(box.left, on.y(0) - 0.5, box.right - box.left, 1);
      range(count).forEach((frame) => line(frame, ink("--soft"), 0.7, 0.35));
      line(state.frame, ink("--accent"), 2, 1);
      if (status) range(n).forEach((k) => {      // a strip of what the places do: sticks, slips, or open
        const kind = Math.round(status[state.frame * n + k]), half = (side) => on.x((x[k] + (x[k + side] ?? x[k])) / 2);
        if (!kind) return;
        pen.fillStyle = ink(kind === 1 ? "--accent" : "--warm");
        pen.fillRect(half(-1), box.bottom - 6, half(1) - half(-1) + 0.6, 6);
      });
    });
    on.axes(`${curve.label} along the interface`, "x [mm]", `${curve.label} [${curve.unit}]`);
  }

  function tell() {
    const f = state.frame, [gap, slide] = factors(), {curve, look} = state.shown, n = x.length;
    const own = curve.values.subarray(f * n, f * n + n), ends = [Math.min(...own), Math.max(...own)].map(curve.said);
    const moment = count > 1 ? `Frame ${f + 1} of ${count}, ${Number(film.times[f].toPrecision(7))} s` : "The pressed state";
    const aside = count > 1 && film.slide.some((v) => v) ? `, the slide of ${short(film.slide[f] * 1e3)} um ${slide} times` : "";
    const foot = status ? " Colours below the curve: blue where the interface sticks, orange where the interface slips." : "";
    at("stage-told").textContent = `${moment}: ${curve.label} from ${ends[0]} to ${ends[1]} ${curve.unit}. Motion and gap magnified ${gap} times${aside}.${foot}`;
    at("play-frame").setAttribute("aria-valuetext", moment);
    at("play-gap-told").textContent = `× ${gap}`;
    at("play-slide-told").textContent = `× ${slide}`;
    at("stage-pieces").setAttribute("aria-label", `Both pieces coloured by ${look.label}. ${at("stage-told").textContent}`);
    at("stage-curve").setAttribute("aria-label", `${curve.label} along the interface, from ${ends[0]} to ${ends[1]} ${curve.unit}`);
  }

  function show(frame = state.frame) {
    state.frame = (frame + count) % count;
    at("play-frame").value = state.frame;
    at("stage-tip").hidden = true;
    drawPieces(); drawCurve(); tell();
  }
  function chosen() {
    state.shown = {look: colouring(Number(at("play-colour").value)), curve: curves[Number(at("play-curve").value)]};
    show();
  }
  function play(on) {
    clearInterval(state.timer);
    state.timer = on && count > 1 ? setInterval(() => show(state.frame + 1), Math.min(300, Math.max(60, 2400 / count))) : 0;
    at("play-run").textContent = state.timer ? "pause" : "play";
  }

  // what lies under the pointer: a cell of a piece, or a place of the curve
  function cellAt(px, py) {
    const [u, v] = state.plane.back(px, py);
    for (const k of [1, 0]) {
      const p = state.places[k], {cells} = pieces[k];
      for (let c = 0; c < cells.length / 4; c++) {
        let odd = false;
        for (let j = 0, i = 3; j < 4; i = j++) {
          const [a, b] = [2 * cells[4 * c + j], 2 * cells[4 * c + i]];
          if (p[a + 1] > v !== p[b + 1] > v && u < (p[b] - p[a]) * (v - p[a + 1]) / (p[b + 1] - p[a + 1]) + p[a]) odd = !odd;
        }
        if (odd) return [k, c];
      }
    }
    return null;
  }
  function spot(event, which) {
    const {offsetX: px, offsetY: py} = event, {box} = which === "pieces" ? state.plane : state.chart;
    if (px < box.left || px > box.right || py < box.top || py > box.bottom) return "";
    if (which === "pieces") {
      const found = cellAt(px, py), {look} = state.shown;
      if (!found) return "";
      const [k, c] = found, one = pieces[k], value = one.colours[look.number][state.frame * one.cells.length / 4 + c];
      const middle = [0, 1].map((j) => one.cells.slice(4 * c, 4 * c + 4).reduce((sum, a) => sum + one.points[2 * a + j], 0) / 4);
      return `${k ? "upper" : "lower"} piece, x ${short(middle[0])} mm, y ${short(middle[1])} mm: ${look.label} ${look.said(value)} ${look.unit}`;
    }
    const u = state.chart.back(px, py)[0], {curve} = state.shown;
    const k = x.reduce((best, v, j) => Math.abs(v - u) < Math.abs(x[best] - u) ? j : best, 0);
    const does = status ? `, ${["open", "sticks", "slips"][Math.round(status[state.frame * x.length + k])]}` : "";
    return `x ${short(x[k])} mm: ${curve.label} ${curve.said(curve.values[state.frame * x.length + k])} ${curve.unit}${does}`;
  }
  for (const which of ["pieces", "curve"]) {
    const canvas = at(`stage-${which}`), tip = at("stage-tip");
    canvas.addEventListener("pointermove", (event) => {
      tip.textContent = spot(event, which);
      tip.hidden = !tip.textContent;
      const home = at("stage").getBoundingClientRect(), left = event.clientX - home.left + 14;
      tip.style.left = `${Math.max(0, Math.min(left, home.width - tip.offsetWidth))}px`;
      tip.style.top = `${event.clientY - home.top + 16}px`;
    });
    canvas.addEventListener("pointerleave", () => { tip.hidden = true; });
  }

  const option = (list, text, value) => list.add(new Option(text, value));
  film.colours.forEach((one, k) => option(at("play-colour"), one.label, k));
  curves.forEach((one, k) => option(at("play-curve"), one.label, k));
  at("play-gap").max = at("play-slide").max = LADDER.length - 1;
  at("play-frame").max = count - 1;
  at("play-slide").closest("label").hidden = !film.slide.some((v) => v);
  at("play-run").closest("div").hidden = count < 2;
  for (const name of ["colour", "curve"]) at(`play-${name}`).onchange = chosen;
  for (const name of ["gap", "slide"]) at(`play-${name}`).oninput = () => show();
  at("play-view").onchange = () => { suited(); show(); };
  at("play-frame").oninput = () => { play(false); show(Number(at("play-frame").value)); };
  at("play-run").onclick = () => play(!state.timer);
  at("play").onsubmit = () => false;
  at("stage").onkeydown = (event) => {
    const to = {ArrowRight: state.frame + 1, ArrowLeft: state.frame - 1, Home: 0, End: count - 1}[event.key];
    if (event.key === " ") play(!state.timer); else if (to !== undefined) { play(false); show(to); } else return;
    event.preventDefault();
  };
  at("play-view").value = narrow ? "close" : "whole";
  suited();
  chosen();
  let width = innerWidth;
  addEventListener("resize", () => { if (innerWidth !== width) { width = innerWidth; show(); } });
  for (const media of ["(prefers-color-scheme: dark)", "print"]) matchMedia(media).addEventListener("change", () => show());
  for (const event of ["beforeprint", "afterprint"]) addEventListener(event, () => show());
})();
