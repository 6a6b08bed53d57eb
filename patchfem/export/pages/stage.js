// What the player draws on: numbers unpacked, colours, a plane in mm on a canvas with its axes.
"use strict";
const stage = (() => {
  const viridis = Bokeh.Palettes.viridis(256).map((one) => typeof one === "number" ?
    `#${(one >>> 8).toString(16).padStart(6, "0")}` : one.slice(0, 7));
  const mix = (a, b, s) => `rgb(${a.map((v, k) => Math.round(v + s * (b[k] - v))).join(",")})`;
  const cool = [33, 102, 172], pale = [242, 242, 242], hot = [178, 24, 43];
  const diverging = Array.from({length: 256}, (_, k) => k < 128 ? mix(cool, pale, k / 127.5) : mix(pale, hot, k / 127.5 - 1));

  function unpack(box) {                         // numbers of 16 bits in base 64: value = low + step * number
    const bytes = Uint8Array.from(atob(box.data), (c) => c.charCodeAt(0)), whole = new DataView(bytes.buffer);
    const out = new Float64Array(bytes.length / 2);
    for (let k = 0; k < out.length; k++) {
      const number = whole.getUint16(2 * k, true);
      out[k] = number === 65535 ? NaN : box.low + box.step * number;
    }
    return out;
  }

  const short = (v) => v === 0 ? "0" : Number(v.toPrecision(4)).toString();
  function ticks(low, high, count) {             // round numbers from low to high, about `count` of them
    const raw = (high - low) / Math.max(count, 1), power = 10 ** Math.floor(Math.log10(raw));
    const step = power * [1, 2, 5, 10].find((s) => s * power >= raw * (1 - 1e-9)), out = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) out.push(Number((k * step).toPrecision(12)));
    return out;
  }

  // A canvas with axes. window: [left, right, bottom, top]; tall: height in pixels; bar: room for a scale of colours.
  function plane(canvas, window, tall, alike, bar = 0) {
    const wide = canvas.parentElement.clientWidth / columns(canvas.parentElement), dense = devicePixelRatio || 1;
    Object.assign(canvas, {width: Math.round(wide * dense), height: Math.round(tall * dense)});
    Object.assign(canvas.style, {width: `${wide}px`, height: `${tall}px`});
    const pen = canvas.getContext("2d"), ink = pictures.ink;
    pen.setTransform(dense, 0, 0, dense, 0, 0);
    pen.font = "12px system-ui, sans-serif";
    const box = {left: 54, top: 24, right: wide - 14 - bar, bottom: tall - 42};
    let [left, right, bottom, top] = window;
    let sx = (box.right - box.left) / (right - left), sy = (box.bottom - box.top) / (top - bottom);
    if (alike) {                                 // one scale on both axes: the window grows on its shorter side
      sx = sy = Math.min(sx, sy);
      const w = (box.right - box.left) / sx, h = (box.bottom - box.top) / sy;
      [left, right, bottom, top] = [(left + right - w) / 2, (left + right + w) / 2, (bottom + top - h) / 2, (bottom + top + h) / 2];
    }
    const x = (v) => box.left + (v - left) * sx, y = (v) => box.bottom - (v - bottom) * sy;
    const back = (px, py) => [left + (px - box.left) / sx, bottom + (box.bottom - py) / sy];
    function inside(draw) {
      pen.save(); pen.beginPath(); pen.rect(box.left, box.top, box.right - box.left, box.bottom - box.top); pen.clip();
      draw(); pen.restore();
    }
    function axes(title, across, up) {
      pen.strokeStyle = ink("--line"); pen.fillStyle = ink("--soft"); pen.lineWidth = 1;
      pen.strokeRect(box.left, box.top, box.right - box.left, box.bottom - box.top);
      pen.textAlign = "center"; pen.textBaseline = "top";
      for (const v of ticks(left, right, (box.right - box.left) / 70)) {
        pen.fillRect(x(v) - 0.5, box.bottom, 1, 4); pen.fillText(short(v), x(v), box.bottom + 6);
      }
      pen.fillText(across, (box.left + box.right) / 2, box.bottom + 24);
      pen.textAlign = "right"; pen.textBaseline = "middle";
      for (const v of ticks(bottom, top, (box.bottom - box.top) / 45)) {
        pen.fillRect(box.left - 4, y(v) - 0.5, 4, 1); pen.fillText(short(v), box.left - 7, y(v));
      }
      pen.save(); pen.translate(10, (box.top + box.bottom) / 2); pen.rotate(-Math.PI / 2); pen.textAlign = "center";
      pen.fillText(up, 0, 0); pen.restore();
      pen.fillStyle = ink("--ink"); pen.textAlign = "left"; pen.fillText(title, box.left, 11);
    }
    function scale(palette, low, high, unit, over) {
      const at = box.right + 14, h = (box.bottom - box.top) / palette.length;
      palette.forEach((colour, k) => { pen.fillStyle = colour; pen.fillRect(at, box.bottom - (k + 1) * h, 12, h + 0.6); });
      pen.fillStyle = ink("--soft"); pen.textAlign = "left"; pen.textBaseline = "middle";
      for (const v of ticks(low, high, 4)) pen.fillText(short(v), at + 16, box.bottom - (v - low) / (high - low) * (box.bottom - box.top));
      pen.fillText(over ? `${unit}, more` : unit, at - 6, 11);
    }
    return {pen, box, x, y, back, inside, axes, scale, window: [left, right, bottom, top]};
  }

  const columns = (row) => getComputedStyle(row).gridTemplateColumns.split(" ").length;

  function edges(cells, coated) {                // [corner, corner] of the outline, and of the line under a coating
    const seen = new Map();
    for (let c = 0; c < cells.length; c += 4) {
      for (let k = 0; k < 4; k++) {
        const a = cells[c + k], b = cells[c + (k + 1) % 4];
        if (a === b) continue;
        const key = Math.min(a, b) * 65536 + Math.max(a, b), coat = coated[c / 4] > 0.5;
        seen.set(key, [...(seen.get(key) ?? [a, b]), coat]);
      }
    }
    return [...seen.values()].filter((one) => one.length === 3 || one[2] !== one[3]);
  }

  return {viridis, diverging, unpack, short, plane, edges};
})();
